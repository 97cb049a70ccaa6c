"""The acceptance stream: 60 s at 250 Hz in real time with loss, duplicates, reordering, malformed and foreign packets.

    python tests/bench/udp_stream.py [seconds] [speed]

Every good packet must be counted once and every bad one reported; prints both sides' books and the memory and time it
took.
"""

import resource
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent.parent))

from labkit.machines import udp
from labkit.machines.packet import TIME, encode_packet, packet_from_pose


def main(seconds=60.0, speed=1.0):
    rng = np.random.default_rng(250)
    count = int(250 * seconds)
    faults = udp.Faults(loss=0.05, duplicate=0.03, reorder=0.05, malformed=0.01, foreign=0.01)
    T = np.tile(np.eye(4), (count, 1, 1))
    T[:, 0, 3] = np.arange(count) % 1000
    packets = [encode_packet(v) for v in packet_from_pose(T, np.arange(count) / 250)]
    started, cpu = time.perf_counter(), time.process_time()
    with (
        udp.listen(keep=count) as listener,
        udp.Sender(udp.stream(packets, 250.0, faults, rng), listener.port, speed) as sender,
    ):
        sender.finished.wait(seconds / speed + 30)
        time.sleep(0.3)
        statistics, stamps = listener.statistics(), listener.readings()[:, TIME]
    print(
        f"{time.perf_counter() - started:.1f} s, {time.process_time() - cpu:.1f} s of processor time, "
        f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB"
    )
    print("sent    ", dict(sender.sent))
    print("received", statistics)
    sent = sender.sent
    assert statistics.good == sent["good"] == len(np.unique(stamps)), "a good packet was not counted exactly once"
    assert statistics.duplicates == sent["duplicate"]
    assert sum(statistics.bad.values()) == sent["malformed"] + sent["foreign"], "a bad packet was not reported"
    assert statistics.lost == sent["lost"] + sent["malformed"]
    print("every good packet counted once, every bad one reported")


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
