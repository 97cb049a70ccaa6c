"""The receiver survives everything a network and a student can do to it."""

import socket
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

from labkit.machines import udp
from labkit.machines.packet import PACKET, TIME, check_packet, encode_packet, packet_from_pose


def packets(count, start=0, device=1):
    values = packet_from_pose(np.tile(np.eye(4), (count, 1, 1)), (start + np.arange(count)) / 250, device=device)
    return [encode_packet(v) for v in values]


def wait(condition, seconds=3.0):
    until = time.perf_counter() + seconds
    while not condition() and time.perf_counter() < until:
        time.sleep(0.01)
    return condition()


def send(port, *datagrams):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for data in datagrams:
            out.sendto(data, (udp.HOST, port))


def test_a_stream_with_all_faults_is_counted_exactly():
    """The 60 s of the acceptance test (tests/bench/udp_stream.py), shorter and faster than real time."""
    faults = udp.Faults(loss=0.05, duplicate=0.03, reorder=0.05, malformed=0.01, foreign=0.01)
    stream = udp.stream(packets(3000), 250.0, faults, np.random.default_rng(3))
    with udp.listen() as listener, udp.Sender(stream, listener.port, speed=8) as sender:
        assert sender.finished.wait(20)
        total = sum(n for kind, n in sender.sent.items() if kind != "lost")
        assert wait(lambda: listener.statistics().datagrams == total)
        seen, sent = listener.statistics(), sender.sent
    assert seen.good == sent["good"] and seen.duplicates == sent["duplicate"] and seen.stale == 0
    assert sum(seen.bad.values()) == sent["malformed"] + sent["foreign"] > 0
    assert seen.lost == sent["lost"] + sent["malformed"] and seen.late > 0
    stamps = listener.readings()[:, TIME]
    assert (np.diff(stamps) > 0).all() and len(stamps) == sent["good"]


def test_the_plan_of_a_stream():
    data = packets(2000)
    plain = list(udp.stream(data, 250.0, udp.Faults(latency=0.01), np.random.default_rng(0)))
    assert [d for _, d, _ in plain] == data and {k for *_, k in plain} == {"good"}
    np.testing.assert_allclose([due for due, *_ in plain], 0.01 + np.arange(2000) / 250)
    faults = udp.Faults(loss=0.1, duplicate=0.1, reorder=0.1, malformed=0.1, foreign=0.1)
    kinds = [k for *_, k in udp.stream(data, 250.0, faults, np.random.default_rng(1))]
    for kind, share in (("lost", 0.09), ("malformed", 0.1), ("foreign", 0.1), ("duplicate", 0.081)):
        assert abs(kinds.count(kind) / 2000 - share) < 0.02, kind
    assert kinds.count("good") + kinds.count("lost") + kinds.count("malformed") == 2000


def test_faults_can_be_changed_while_a_stream_runs():
    faults = udp.Faults()
    stream = udp.stream(iter(packets(100)), 250.0, faults, np.random.default_rng(0))
    first = [next(stream)[2] for _ in range(50)]
    faults.loss = 1.0
    rest = [kind for *_, kind in stream]
    assert set(first) == {"good"} and rest.count("lost") == 50


def test_every_malformed_packet_is_refused():
    rng = np.random.default_rng(2)
    data = packets(1, start=7)[0]
    for _ in range(500):
        assert check_packet(udp.break_packet(data, rng))[1]


@pytest.mark.parametrize("length, good", [(0.9991, True), (1.0009, True), (0.9989, False), (1.0011, False)])
def test_a_quaternion_may_be_a_thousandth_too_long_or_short(length, good):
    values = list(check_packet(packets(1)[0])[0])
    values[11:15] = [length * q for q in values[11:15]]
    assert (check_packet(encode_packet(values))[1] == "") == good


def test_duplicates_late_ones_and_foreign_devices():
    a, b, c = packets(3)
    with udp.listen() as listener:
        send(listener.port, a, c, b, c, a, packets(1, device=2)[0], b"hello", b"")
        assert wait(lambda: listener.statistics().datagrams == 8)
        seen = listener.statistics()
    assert (seen.good, seen.late, seen.duplicates, seen.lost) == (3, 1, 2, 0)
    assert seen.bad == {"another device": 1, "length": 2}
    np.testing.assert_allclose(listener.readings()[:, TIME], np.arange(3) / 250)
    assert [len(listener.readings(newest)) for newest in (0, 2, 99)] == [0, 2, 3]


def test_a_sender_that_starts_over_is_followed():
    with udp.listen() as listener:
        for first, count in ((100_000, udp.MEMORY + 10), (0, udp.RESTART + 30)):
            for k, data in enumerate(packets(count, first)):
                send(listener.port, data)
                if k % 200 == 199:
                    time.sleep(0.005)
        assert wait(lambda: listener.statistics().datagrams == udp.MEMORY + udp.RESTART + 40)
        seen = listener.statistics()
    assert seen.restarts == 1 and seen.stale == udp.RESTART and len(listener.readings()) == 31
    assert seen.good == udp.MEMORY + 10 + 31


def test_nothing_blocks_and_everything_closes():
    before = threading.active_count()
    started = time.perf_counter()
    listener = udp.listen()
    assert listener.readings().shape == (0, 23) and listener.statistics() == udp.Statistics()
    endless = udp.stream(iter(lambda: packets(1)[0], None), 250.0, udp.Faults(), np.random.default_rng(0))
    sender = udp.Sender(endless, listener.port)
    port = listener.port
    sender.close()
    listener.close()
    listener.close()
    assert time.perf_counter() - started < 1.5 and threading.active_count() == before
    with udp.listen(port) as again:  # the port is free
        assert again.port == port


def test_a_taken_or_impossible_port_is_named():
    with (
        udp.listen() as listener,
        pytest.raises(ValueError, match=f"port {listener.port} of this machine cannot be used"),
    ):
        udp.listen(listener.port)
    with pytest.raises(ValueError, match="port 70000"):
        udp.listen(70000)


def test_only_this_machine_can_reach_it():
    with udp.listen() as listener:
        assert listener._socket.getsockname()[0] == "127.0.0.1"


def test_a_sender_without_a_listener_survives():
    with udp.listen() as listener:
        port = listener.port
    with udp.Sender(udp.stream(packets(20), 250.0, udp.Faults(), np.random.default_rng(0)), port, speed=10) as sender:
        assert sender.finished.wait(3)
    assert sum(sender.sent.values()) == 20


def test_memory_stays_bounded():
    with udp.listen(keep=50) as listener:
        send(listener.port, *packets(120))
        assert wait(lambda: listener.statistics().good == 120)
        assert len(listener.readings()) == 50 and len(listener._seen) <= udp.MEMORY


@pytest.mark.parametrize(("seen", "arrived"), [([18, 19, 20], True), ([18, 19], False)])
def test_a_flush_waits_for_what_is_still_on_its_way(seen, arrived):
    """20 datagrams were sent, two more lost or refused; the listener counts one more whenever it is asked."""
    counts = iter(seen)
    last = [0]

    def statistics():
        last[0] = next(counts, last[0])
        return SimpleNamespace(datagrams=last[0])

    with udp.listen() as real, udp.Sender(iter([]), real.port) as sender:
        assert sender.finished.wait(3)
        sender.sent.update({"good": 18, "stale": 2, "lost": 1, "refused": 1})
        assert sender.flush(SimpleNamespace(statistics=statistics), seconds=0.05 if not arrived else 3.0) is arrived


VALUES = packet_from_pose(np.eye(4), 0.0)


def packet_at(stamp):
    return PACKET.pack(*VALUES[:TIME], stamp, *VALUES[TIME + 1 :])


def statistics_after(*stamps):
    """What a listener has counted of packets with these time stamps, taken in this order without a network."""
    with udp.Listener() as listener, listener._lock:
        for stamp in stamps:
            listener._take(packet_at(stamp))
    return listener.statistics()


def test_a_forged_time_stamp_is_refused_and_spoils_nothing():
    """One packet from the far future among 5000 good ones, and one from beyond all time."""
    good = [k / 250 for k in range(5000)]
    seen = statistics_after(*good[:2500], 1e9, -1e308, 1e308, *good[2500:])
    assert (seen.good, seen.lost, seen.restarts, seen.stale) == (5000, 0, 0, 0)
    assert seen.bad == {udp.IMPLAUSIBLE: 3} and seen.datagrams == 5003


def test_a_forged_first_packet_is_overcome_by_the_good_ones():
    seen = statistics_after(1e9, *[k / 250 for k in range(200)])
    assert seen.restarts == 1 and seen.bad == {udp.IMPLAUSIBLE: udp.RESTART - 1} and seen.lost == 0
    assert seen.good == 1 + 200 - (udp.RESTART - 1)


def test_a_sender_that_was_away_for_long_is_heard_again():
    seen = statistics_after(*[k / 250 for k in range(300)], *[3600 + k / 250 for k in range(300)])
    assert seen.restarts == 1 and seen.lost == 0 and seen.bad == {udp.IMPLAUSIBLE: udp.RESTART - 1}


@pytest.mark.parametrize("options", [{"port": 80.5}, {"port": -1}, {"rate": float("nan")}, {"rate": 0}, {"keep": 0.5}])
def test_a_listener_refuses_nonsense_in_a_sentence(options):
    with pytest.raises(ValueError, match=f"{next(iter(options))} must be"):
        udp.Listener(**options)


def test_a_sender_to_no_port_finishes_and_says_refused():
    with udp.Sender([(0.0, b"x", "good")], 70000) as sender:
        assert sender.finished.wait(5) and sender.sent == {"refused": 1}
