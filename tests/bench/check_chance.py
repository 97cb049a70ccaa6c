"""How often chance decides a check.

    python tests/bench/check_chance.py [SECONDS [EXERCISE ...]]      references and named mistakes, 30 s an exercise
    python tests/bench/check_chance.py solved [SEEDS [NN ...]]       what the solved notebooks answer, 100 seeds

Every check draws afresh, so a right answer might be refused, or a wrong one taken, once in a while. Each exercise is
checked with its own reference and with all its named mistakes, with new seeds for so many seconds. A row appears where
something else came out than should: the reference refused, a mistake taken for right, or answered with another text.
"""

import collections
import os
import runpy
import sys
import time

import numpy as np

from labkit.exercises import session, source
from labkit.exercises.engine import Exercise
from labkit.exercises.outcome import CORRECT, NOT_YET


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


def solved(seeds="100", *numbers):
    """Run the solved sources; each check of a function is made with so many seeds, and each refusal is printed."""
    os.environ |= {"LABKIT_STRICT": "1", "MPLBACKEND": "Agg"}
    judge, counts = Exercise.judge, collections.Counter()

    def with_all_seeds(item, function, rng=None):
        outcomes = [judge(item, function, np.random.default_rng(seed)) for seed in range(int(seeds))]
        wrong = [(seed, outcome) for seed, outcome in enumerate(outcomes) if outcome.status != CORRECT]
        counts["checks"] += len(outcomes)
        counts["refused"] += len(wrong)
        for seed, outcome in wrong[:1]:
            print(f"{item.id}: {len(wrong)} of {seeds} (seed {seed}): {outcome.status}. {outcome.text}", flush=True)
        return next((outcome for outcome in outcomes if outcome.status == CORRECT), outcomes[0])

    Exercise.judge = with_all_seeds
    for path in source.sources()[1:]:  # chapter 0 shows a wrong answer
        if not numbers or path.name[:2] in numbers:
            runpy.run_path(str(path))
            print(f"{path.stem}: {counts['refused']} refused of {counts['checks']} so far", flush=True)


if __name__ == "__main__":
    solved(*sys.argv[2:]) if sys.argv[1:2] == ["solved"] else main(*sys.argv[1:])
