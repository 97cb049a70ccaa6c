"""The tracker's stream over UDP on this machine: a sender with faults to switch on, and a receiver that survives them.

Both run in a thread of their own, bind to localhost only, and stop within a tenth of a second. UDP promises nothing: a
packet may be lost, come twice, late or broken. There is no sequence number and no checksum in the tracker's packet
(report, table 1), so the receiver judges by the timestamp and by plausibility; a flipped bit that leaves a plausible
reading cannot be found.
"""

import heapq
import socket
import threading
import time as clock
from collections import Counter, deque
from dataclasses import dataclass, field

import numpy as np

from ..checks import as_count, as_positive_number
from .packet import IMPLAUSIBLE, PACKET, TIME, check_packet

HOST = "127.0.0.1"
BUFFER = 1 << 20  # bytes the system may hold back for us: 20 s of the stream
MEMORY = 2048  # timestamps remembered to tell duplicates: 8 s at 250 Hz
RESTART = 50  # readings in a row from before the memory, or far off: this many mean that the sender has started over
LEAP, LEAP_READINGS = 60.0, 100  # s, and readings: a stamp farther than both from the newest one is no lost packet


@dataclass
class Faults:
    """What can happen to a stream, each as a probability per packet; it may be changed while the stream runs.

    Attributes
    ----------
    loss : float
        Not sent.
    duplicate : float
        Sent twice.
    reorder : float
        Sent up to 5 packets late.
    malformed : float
        Sent truncated, too long, with a NaN or with a broken quaternion.
    foreign : float
        A stranger's datagram besides.
    latency : float, s
        How much later every packet comes.
    """

    loss: float = 0.0
    duplicate: float = 0.0
    reorder: float = 0.0
    malformed: float = 0.0
    foreign: float = 0.0
    latency: float = 0.0


def break_packet(data, rng):
    """A malformed version of a packet: cut, padded, a NaN in it, or a quaternion that is none.

    Parameters
    ----------
    data : bytes
        A good packet.
    rng : numpy.random.Generator

    Returns
    -------
    bad : bytes
    """
    kind = rng.integers(4)
    if kind == 0:
        return data[: int(rng.integers(0, len(data)))]
    if kind == 1:
        return data + bytes(rng.integers(0, 256, int(rng.integers(1, 64)), dtype=np.uint8))
    values = list(PACKET.unpack(data))
    if kind == 2:
        values[int(rng.integers(0, 23))] = float("nan")
    else:
        values[11 + int(rng.integers(0, 4))] += 2.5
    return PACKET.pack(*values)


def stream(packets, rate, faults, rng):
    """What goes over the wire in place of a row of packets, in the order of sending.

    Parameters
    ----------
    packets : iterable of bytes
    rate : float
        Packets per second.
    faults : Faults
    rng : numpy.random.Generator

    Yields
    ------
    due : float
        Seconds since the start.
    datagram : bytes or None
    kind : str
        "good", "duplicate", "malformed", "foreign"; a lost packet is yielded as "lost" with no datagram, so that a
        sender can keep its books.
    """
    rate, waiting, count = as_positive_number(rate, "rate"), [], 0
    for k, data in enumerate(packets):
        due = k / rate + faults.latency
        lost, twice, late, broken, stranger = rng.random(5) < (
            faults.loss,
            faults.duplicate,
            faults.reorder,
            faults.malformed,
            faults.foreign,
        )
        entries = []
        if stranger:
            entries.append((due, bytes(rng.integers(0, 256, int(rng.integers(1, 300)), dtype=np.uint8)), "foreign"))
        if broken:
            entries.append((due, break_packet(data, rng), "malformed"))
        elif lost:
            entries.append((due, b"", "lost"))
        else:
            entries.append((due + (rng.uniform(1, 5) / rate if late else 0.0), data, "good"))
            if twice:
                entries.append((due + rng.uniform(0, 5) / rate, data, "duplicate"))
        for entry in entries:
            heapq.heappush(waiting, (entry[0], count, *entry[1:]))
            count += 1
        while waiting and waiting[0][0] <= due:
            sent, _, datagram, kind = heapq.heappop(waiting)
            yield sent, datagram, kind
    while waiting:
        sent, _, datagram, kind = heapq.heappop(waiting)
        yield sent, datagram, kind


class _Endpoint:
    """A socket served by a thread of its own until it is closed; a context manager."""

    def close(self):
        """Stop the thread and free the port; what has been counted or received stays readable."""
        self._stop.set()
        self._thread.join(2.0)
        self._socket.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


class Sender(_Endpoint):
    """A simulated tracker: sends a `stream` to a port of this machine in real time, or `speed` times as fast.

    `sent` counts by kind; `finished` is set when the stream is over. Use as a context manager, or call `close`.
    """

    def __init__(self, stream, port, speed=1.0):
        port, speed = as_count(port, "port"), as_positive_number(speed, "speed")
        self.sent, self.finished = Counter(), threading.Event()
        self._stop = threading.Event()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._thread = threading.Thread(
            target=self._run, args=(stream, (HOST, port), speed), name="tracker sender", daemon=True
        )
        self._thread.start()

    def _run(self, stream, address, speed):
        start = clock.perf_counter()
        for due, datagram, kind in stream:
            wait = start + due / speed - clock.perf_counter()
            if (wait > 1e-3 and self._stop.wait(wait)) or self._stop.is_set():
                break
            if kind != "lost":
                try:
                    self._socket.sendto(datagram, address)
                except (OSError, OverflowError):  # also a port beyond the last one
                    kind = "refused"
            self.sent[kind] += 1
        self.finished.set()

    def flush(self, listener, seconds=3.0):
        """Wait until a listener has seen everything that was sent so far; True when it has."""
        until = clock.perf_counter() + seconds
        total = sum(number for kind, number in self.sent.items() if kind not in ("lost", "refused"))
        while listener.statistics().datagrams < total and clock.perf_counter() < until:
            clock.sleep(0.005)
        return listener.statistics().datagrams >= total


@dataclass(frozen=True)
class Statistics:
    """What a receiver has seen: datagrams = good + duplicates + stale + all bad ones.

    Attributes
    ----------
    good : int
        Readings, each counted once.
    late : int
        Good ones that came after a younger one.
    duplicates, stale : int
        Seen before; too old to tell whether they were.
    bad : dict
        {reason: count}.
    lost : int
        Readings missing between the first and the last timestamp, estimated with `rate`.
    restarts : int
        Times the sender started over.
    """

    datagrams: int = 0
    good: int = 0
    late: int = 0
    duplicates: int = 0
    stale: int = 0
    lost: int = 0
    restarts: int = 0
    bad: dict = field(default_factory=dict)


class Receiver:
    """What a receiver makes of datagrams, wherever they come from: readings in order, and counts that add up.

    Parameters
    ----------
    device : float or None
        Readings of another device are reported as bad. None accepts all.
    rate : float
        Readings per second, to estimate how many were lost.
    keep : int
        How many of the newest readings are kept.
    """

    def __init__(self, device=1.0, rate=250.0, keep=20000):
        self.device, self.rate = device, as_positive_number(rate, "rate")
        self._leap = max(LEAP, LEAP_READINGS / self.rate)
        self._readings = deque(maxlen=as_count(keep, "keep"))
        self._lock = threading.Lock()
        self._clear()
        self._counts, self._bad = Counter(), Counter()

    def _clear(self):
        self._seen, self._order = set(), deque()
        self._first = self._newest = None
        self._since, self._old, self._far = 0, 0, 0

    def take(self, data):
        """Judge one datagram, bytes, and count it."""
        with self._lock:
            self._take(data)

    def _take(self, data):
        self._counts["datagrams"] += 1
        values, fault = check_packet(data)
        if not fault and self.device is not None and values[0] != self.device:
            fault = "another device"
        if fault:
            self._bad[fault.split(":")[0]] += 1
            return
        stamp = values[TIME]
        if stamp in self._seen:
            self._counts["duplicates"] += 1
            return
        if self._leaps(stamp):
            self._far += 1
            if self._far < RESTART:
                self._bad[IMPLAUSIBLE] += 1
                return
            self._start_over()
        self._far = 0
        if len(self._order) == MEMORY and stamp < self._order[0]:
            self._counts["stale"] += 1
            self._old += 1
            if self._old < RESTART:
                return
            self._start_over()
        self._old = 0
        self._remember(stamp)
        self._counts["good"] += 1
        self._since += 1
        if self._newest is not None and stamp < self._newest:
            self._counts["late"] += 1
        self._newest = stamp if self._newest is None else max(self._newest, stamp)
        self._first = stamp if self._first is None else min(self._first, stamp)
        self._readings.append(values)

    def _leaps(self, stamp):
        """Whether a stamp is far ahead of all others, or far behind while the memory cannot yet tell how old it is."""
        if self._newest is None:
            return False
        ahead = stamp - self._newest
        return ahead > self._leap or (-ahead > self._leap and len(self._order) < MEMORY)

    def _start_over(self):
        self._counts["restarts"] += 1
        self._counts["lost"] += self._missing()
        self._readings.clear()
        self._clear()

    def _remember(self, stamp):
        if len(self._order) == MEMORY:
            self._seen.discard(self._order.popleft())
        self._order.append(stamp)
        self._seen.add(stamp)

    def _missing(self):
        if self._first is None:
            return 0
        return max(round((self._newest - self._first) * self.rate) + 1 - self._since, 0)

    def statistics(self):
        """What has arrived so far."""
        with self._lock:
            counts = dict(self._counts)
            counts["lost"] = counts.get("lost", 0) + self._missing()
            return Statistics(**counts, bad=dict(self._bad))

    def readings(self, newest=None):
        """The kept readings in the order of their timestamps.

        Parameters
        ----------
        newest : int, optional
            Return no more than the newest of this number.

        Returns
        -------
        readings : array, shape (k, 23)
            Fields as in `packet.FIELDS`.
        """
        with self._lock:
            rows = list(self._readings)
        table = np.array(rows).reshape(-1, PACKET.size // 8)
        table = table[np.argsort(table[:, TIME], kind="stable")]
        return table if newest is None else table[max(len(table) - as_count(newest, "newest", at_least=0), 0) :]


class Listener(_Endpoint, Receiver):
    """A receiver on localhost that never blocks its caller.

    Parameters
    ----------
    port : int
        0 takes any free port; `port` tells which.
    options
        Those of `Receiver`.

    Use as a context manager, or call `close`. Raises ValueError when the port is taken.
    """

    def __init__(self, port=0, **options):
        super().__init__(**options)
        port = as_count(port, "port", at_least=0)
        self._stop = threading.Event()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
        try:
            self._socket.bind((HOST, port))
        except (OSError, OverflowError) as error:
            self._socket.close()
            raise ValueError(
                f"port {port} of this machine cannot be used ({error}); port=0 takes any free one"
            ) from None
        self._socket.settimeout(0.1)
        self.port = self._socket.getsockname()[1]
        self._thread = threading.Thread(target=self._run, name="tracker listener", daemon=True)
        self._thread.start()

    def _run(self):
        while not self._stop.is_set():
            try:
                data = self._socket.recv(65535)
            except TimeoutError:
                continue
            except OSError:  # Windows reports an earlier send to a closed port here; a closed socket ends the loop
                if self._stop.wait(0.01):
                    break
                continue
            self.take(data)


def listen(port=0, **options):
    """A running `Listener`; a context manager."""
    return Listener(port, **options)
