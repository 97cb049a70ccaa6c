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


def test_packets_are_broken_in_four_ways_as_often_as_each_other():
    """800 draws: each share is known to 1.5 %; shorter and longer, a number that is none, a quaternion too long."""
    rng, data = np.random.default_rng(5), packets(1, start=7)[0]
    broken = [udp.break_packet(data, rng) for _ in range(800)]
    reasons = [check_packet(b)[1] for b in broken]
    ways = [
        sum(len(b) < len(data) for b in broken),
        sum(len(b) > len(data) for b in broken),
        reasons.count("a number is not finite"),
        reasons.count("the quaternion is not of length 1"),
    ]
    assert sum(ways) == 800 and min(ways) > 130 and max(ways) < 270


def test_late_packets_and_copies_come_up_to_five_packets_later():
    data, rate = packets(3000), 250.0
    when = {d: k / rate for k, d in enumerate(data)}
    for faults, kind, least in (
        (udp.Faults(reorder=1.0), "good", 1.0),
        (udp.Faults(duplicate=1.0), "duplicate", 0.0),
    ):
        sent = udp.stream(data, rate, faults, np.random.default_rng(2))
        late = np.array([due - when[d] for due, d, k in sent if k == kind]) * rate
        assert len(late) == 3000 and least <= late.min() < least + 0.05 and 4.95 < late.max() <= 5.0


def test_what_comes_after_a_younger_one_is_late_and_what_never_comes_is_lost():
    seen = statistics_after(*np.array([3, 4, 8, 6, 9, 2, 10]) / 250)
    assert (seen.good, seen.late, seen.lost) == (7, 2, 2)  # 5 and 7 of 2 to 10


@pytest.mark.parametrize(("rate", "leap"), [(250.0, 60.0), (1.0, 100.0)])
def test_a_leap_is_longer_than_a_minute_and_than_a_hundred_readings(rate, leap):
    for ahead, bad in ((0.99, {}), (1.01, {udp.IMPLAUSIBLE: 1})):
        receiver = udp.Receiver(rate=rate)
        for stamp in (0.0, ahead * leap):
            receiver.take(packet_at(stamp))
        assert receiver.statistics().bad == bad


def test_readings_from_before_the_memory_are_stale_until_there_are_fifty_in_a_row():
    receiver = udp.Receiver()
    newest = [10_000 + k for k in range(udp.MEMORY)]
    for k in [*newest, *range(udp.RESTART - 1), 20_000, *range(udp.RESTART - 1)]:
        receiver.take(packet_at(k / 250))
    seen = receiver.statistics()
    assert (seen.restarts, seen.stale, seen.good) == (0, 2 * (udp.RESTART - 1), udp.MEMORY + 1)


def test_a_sender_keeps_the_time_of_its_stream():
    """0.3 s of it at three times its speed; beside load it may take longer, never less."""
    with udp.listen() as listener:
        started = time.perf_counter()
        with udp.Sender([(0.0, b"a", "good"), (0.3, b"b", "good")], listener.port, speed=3) as sender:
            assert sender.finished.wait(10)
        assert time.perf_counter() - started >= 0.099
