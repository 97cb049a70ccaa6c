"""Endless answers ended at random moments, thousands of times.

    python tests/bench/limit_race.py [--runs 2000] [--seed 1]

A ring of the clock may come between any two instructions: while a block is left, an exception handled, a generator
closed. Each run is one endless answer of `LOOPS` with a limit of 20 to 120 ms; it must end with `TimeLimit` within 3 s
more of processor time, and a right loop that follows must not be met by a ring that came too late. Every second batch
goes without interval timers, as on Windows. A run that does not end is shown with its stack, and the next begins.
"""

import argparse
import faulthandler
import multiprocessing
import signal
import sys
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from labkit.exercises import guard

BATCH = 25  # runs of one process
PATIENCE = 60.0  # s without a word, on a busy machine
MORE = 3.0  # s of processor time beyond the limit
CLEAN = 0.08  # s of a right loop afterwards; rings come every 50 ms


def comprehension():
    return [i for i in iter(int, 1)]


def plain():
    while True:
        pass


def appending():
    kept = []
    while True:
        kept.append(len(kept))
        if len(kept) > 10_000:
            kept = []


def swallowing():
    while True:
        try:
            while True:
                pass
        except:  # noqa: E722
            continue


def swallowing_twice():
    while True:
        try:
            try:  # noqa: SIM105
                sum(range(1000))
            except BaseException:
                pass
        except BaseException:
            pass


def sleeping():
    while True:
        try:  # noqa: SIM105
            time.sleep(0.005)
        except BaseException:
            pass


def decomposing():
    while True:
        np.linalg.norm(np.linalg.inv(np.eye(3)))


def recursing():
    def down(n):
        return down(n + 1) if n < 500 else n

    while True:
        down(0)


def generating():
    def numbers():
        try:
            while True:
                yield 1
        finally:
            sum(range(100))

    return sum(sum(1 for _, _ in zip(range(100), numbers())) for _ in iter(int, 1))


def sorting():
    while True:
        sorted(range(1000), key=lambda k: -k)


LOOPS = (
    comprehension, plain, appending, swallowing, swallowing_twice, sleeping, decomposing, recursing, generating, sorting
)  # fmt: skip


def work(pipe, numbers, seed):
    """Tell each run before it begins, and how it ended."""
    if numbers[0] // BATCH % 2 and hasattr(signal, "setitimer"):
        del signal.setitimer
    for number in numbers:
        rng = np.random.default_rng([seed, number])
        loop, limit = LOOPS[rng.integers(len(LOOPS))], rng.uniform(0.02, 0.12)
        pipe.send((number, loop.__name__, None))
        faulthandler.dump_traceback_later(0.8 * PATIENCE, exit=False)
        pipe.send((number, loop.__name__, ended(loop, limit)))
        faulthandler.cancel_dump_traceback_later()
    pipe.close()


def ended(loop, limit):
    """How a run ended: "in time", or what was wrong with it."""
    begun = time.process_time()
    try:
        error = guard.run(loop, (), limit=limit).error
    except BaseException as escaped:
        return f"escaped: {escaped!r}"
    if not isinstance(error, guard.TimeLimit):
        return f"ended with {error!r}"
    if time.process_time() - begun > limit + MORE:
        return "late"
    try:
        until = time.process_time() + CLEAN
        while time.process_time() < until:
            pass
    except BaseException as leaked:
        return f"leaked: {leaked!r}"
    return "in time"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first run")
    asked = parser.parse_args()
    todo, counts, context = (
        list(range(asked.first, asked.first + asked.runs)),
        Counter(),
        multiprocessing.get_context("spawn"),
    )
    while todo:
        ours, theirs = context.Pipe(duplex=False)
        numbers = [number for number in todo if number // BATCH == todo[0] // BATCH]
        process = context.Process(target=work, args=(theirs, numbers, asked.seed), daemon=True)
        process.start()
        theirs.close()
        begun = None
        try:
            while ours.poll(PATIENCE):
                number, name, told = ours.recv()
                begun = (number, name)
                if told:
                    todo.remove(number)
                    tell(counts, number, name, told)
        except EOFError:
            pass
        process.kill()
        process.join()
        if begun and begun[0] in todo:
            todo.remove(begun[0])
            tell(counts, *begun, "never ended")
    print("\n".join(f"{name:18}{told:12}{count}" for (name, told), count in sorted(counts.items())))


def tell(counts, number, name, told):
    counts[name, told] += 1
    if told != "in time":
        print(f"{number} {name}: {told}", flush=True)


if __name__ == "__main__":
    main()
