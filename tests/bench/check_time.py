"""How long a check takes, exercise by exercise: `python tests/bench/check_time.py`. The aim is 50 ms for ordinary ones.

Right is a correct answer; wrong is the dearest case, an answer that is no named mistake, so that all of them are tried.
"""

import time

import numpy as np

from labkit.exercises import session
from labkit.exercises.engine import Exercise


def median_ms(item, answer, repeats=9):
    times = []
    for seed in range(repeats):
        start = time.perf_counter()
        item.judge(answer, rng=np.random.default_rng(seed))
        times.append(1e3 * (time.perf_counter() - start))
    return np.median(times)


def wrong(item):
    """The reference's result, slightly spoiled where it is numeric."""

    def answer(*args):
        result = item.reference(*args)
        return result * 1.01 if isinstance(result, np.ndarray | float) else result

    return answer


def main():
    print("| exercise | right (ms) | wrong (ms) |\n| --- | --- | --- |")
    for chapter in session.chapters():
        for item in chapter.items:
            if isinstance(item, Exercise):
                row = median_ms(item, lambda *args, item=item: item.reference(*args)), median_ms(item, wrong(item))
                print(f"| {chapter.name}/{item.id} | {row[0]:.1f} | {row[1]:.1f} |")


if __name__ == "__main__":
    main()
