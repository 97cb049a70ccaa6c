"""How many students one machine carries: JupyterHub with dummy users who all work at once (Linux, a network).

    python tests/bench/hub_load.py [--seconds 300] [--place FOLDER] [1 4 8 16 ...]

The hub is set up by the commands of docs/hub.md, into FOLDER if it is not there yet. For each number of users: all log
in together, each runs chapter 1 from its first cell to its last, and moves its Stages for so long: a second with an
arrow key held down (25 moves), two seconds of looking at it, then the next Stage. Printed: seconds from the log-in to
the first page and of Run All, milliseconds from a key to the picture that answers it, failures, memory (PSS) of the
hub with its proxy, servers and kernels, their processor time up to the end of Run All by student, and how many
processors are busy while Stages move. The students' own page is no browser but this process, which takes a share of
the processors for itself; it is in the last column.
"""

import argparse
import os
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[2]), str(Path(__file__).resolve().parents[1] / "hub")]

import hub
import numpy as np
import students

NOTEBOOK = "workbook/01_frames.ipynb"
MOVES, LOOKING = 25, 2.0  # of one drag; s until the next one
HEAD = ("users", "log-in s", "Run All s", "median ms", "p95", "p99", "longest", "moves", "failed", "MiB", "MiB/user")
HEAD += ("processor s to begin", "processors", "of them the pages")
TICKS = os.sysconf("SC_CLK_TCK")


class Day:
    """One student's session: log in, run the chapter, move its Stages; what failed is kept and not raised."""

    def __init__(self, address, name):
        self.student, self.kernel = students.Student(address, name, hub.PASSWORD), None
        self.moves, self.failed = [], []

    def try_to(self, work, *given):
        """Seconds that some work took; NaN where it failed."""
        begun = time.monotonic()
        try:
            work(*given)
        except Exception as error:  # whatever goes wrong under load is what is counted
            self.failed.append(f"{type(error).__name__}: {error}"[:200])
            return np.nan
        return time.monotonic() - begun

    def run_all(self):
        cells, self.kernel = self.student.open(NOTEBOOK)
        raised = self.kernel.run_all(cells)
        if raised:
            raise RuntimeError(f"cells raised {raised}")

    def move(self, until):
        stages = [s for s, declared in self.kernel.stages.items() if declared["handles"] or declared["controls"]]
        turn = 0
        while time.monotonic() < until:
            self.moves += self.kernel.move(stages[turn % len(stages)], MOVES)
            turn += 1
            time.sleep(LOOKING)


def family():
    """Numbers of all processes that this one started, and theirs."""
    parents = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            parents[int(path.parent.name)] = int(path.read_text().rpartition(")")[2].split()[1])
        except OSError:  # it has ended
            continue
    found, new = set(), {os.getpid()}
    while new:
        new = {child for child, parent in parents.items() if parent in new} - found
        found |= new
    return found


def memory(processes):
    """MiB in all; what several share counts once."""
    total = 0
    for process in processes:
        try:
            lines = Path(f"/proc/{process}/smaps_rollup").read_text().splitlines()
        except OSError:
            continue
        total += sum(int(line.split()[1]) for line in lines if line.startswith("Pss:"))
    return total / 1024


def processor_seconds(processes):
    """User and system time of processes so far, and of those of their children that have ended."""
    total = 0
    for process in processes:
        try:
            total += sum(map(int, Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[11:15]))
        except OSError:
            continue
    return total / TICKS


def day(place, users, seconds):
    """One row of the table, and what failed."""
    with hub.running(place) as address, ThreadPoolExecutor(users) as pool:
        days = [Day(address, f"student{k}") for k in range(users)]
        log_in = list(pool.map(lambda d: d.try_to(d.student.log_in), days))
        run_all = list(pool.map(lambda d: d.try_to(d.run_all), days))
        processes, begun = family(), time.monotonic()
        before, pages = processor_seconds(processes), time.process_time()
        working = [d for d in days if d.kernel and d.kernel.stages]
        list(pool.map(lambda d: d.try_to(d.move, begun + seconds), working))
        passed = time.monotonic() - begun
        busy, pages = (processor_seconds(processes) - before) / passed, (time.process_time() - pages) / passed
        held = memory(processes)
        for d in days:
            d.try_to(d.kernel.close if d.kernel else int)
            d.try_to(d.student.stop)
    moves = np.array([m for d in days for m in d.moves] or [np.nan])
    failed = [f for d in days for f in d.failed]
    numbers = (np.nanmedian(log_in), np.nanmedian(run_all), *np.percentile(moves, (50, 95, 99, 100)))
    row = (users, *(f"{v:.0f}" for v in numbers), len(moves), len(failed), f"{held:.0f}", f"{held / users:.0f}")
    return (*row, f"{before / users:.0f}", f"{busy + pages:.2f}", f"{pages:.2f}"), failed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("users", nargs="*", type=int, default=[1, 4, 8, 16])
    parser.add_argument("--seconds", type=float, default=300)
    parser.add_argument("--place", type=Path)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        place = asked.place or Path(scratch)
        problem = "" if (place / "bin" / "jupyterhub").exists() else hub.what_is_missing() or hub.set_up(place)
        if problem:
            sys.exit(problem)
        print(f"| {' | '.join(HEAD)} |\n|{' ---: |' * len(HEAD)}", flush=True)
        for users in asked.users:
            row, failed = day(place, users, asked.seconds)
            print(f"| {' | '.join(map(str, row))} |", *sorted(set(failed)), sep="\n  ", flush=True)


if __name__ == "__main__":
    main()
