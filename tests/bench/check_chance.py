"""How often chance decides a check: `python tests/bench/check_chance.py [SECONDS [EXERCISE ...]]`, 30 s an exercise.

Every check draws afresh, so a right answer might be refused, or a wrong one taken, once in a while. Each exercise is
checked with its own reference and with all its named mistakes, with new seeds for so many seconds. A row appears where
something else came out than should: the reference refused, a mistake taken for right, or answered with another text.
"""

import collections
import sys
import time

import numpy as np

from labkit.exercises import session
from labkit.exercises.engine import CORRECT, NOT_YET, Exercise


def oddities(item, seconds):
    """Number of rounds, and {(which answer, what came out): seeds} of all that should have come out otherwise."""
    answers = [("reference", item.reference, CORRECT, "")]
    answers += [(f"mistake {k}", mistake.variant, NOT_YET, mistake.text) for k, mistake in enumerate(item.mistakes)]
    odd, seed, end = collections.defaultdict(list), 0, time.perf_counter() + seconds
    while time.perf_counter() < end:
        seed += 1
        for name, function, status, text in answers:
            outcome = item.judge(lambda *args, f=function: f(*args), rng=np.random.default_rng(seed))
            if (outcome.status, outcome.text) != (status, text):
                odd[name, f"{outcome.status}: {outcome.text}".splitlines()[0]].append(seed)
    return seed, odd


def main(seconds="30", *wanted):
    rounds, answers = 0, 0
    for chapter in session.chapters():
        for item in chapter.items:
            if not isinstance(item, Exercise) or (wanted and item.id not in wanted):
                continue
            n, odd = oddities(item, float(seconds))
            rounds, answers = rounds + n, answers + n * (1 + len(item.mistakes))
            for (name, said), seeds in odd.items():
                print(f"{chapter.name}/{item.id}, {name}: {len(seeds)} of {n} (seed {seeds[0]}): {said}", flush=True)
    print(f"{answers} answers checked in {rounds} rounds")


if __name__ == "__main__":
    main(*sys.argv[1:])
