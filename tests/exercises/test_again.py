"""Draws that are tried again are the same each time, whatever has been done to them meanwhile."""

import itertools

import numpy as np

from labkit.exercises import metrics
from labkit.exercises.again import Again
from labkit.exercises.engine import Exercise
from labkit.exercises.evidence import MORE_CASES


def test_each_draw_is_made_once_and_handed_out_as_a_copy():
    made = []

    def draw(rng):
        made.append(rng.normal(size=3))
        return (made[-1].copy(),)

    again = Again(itertools.repeat((draw, "beside")), lambda v: 2 * v)
    args, expected, beside = again[2]
    args[0][:] = expected[:] = 0
    args, expected, beside = again[2]
    np.testing.assert_array_equal(args[0], made[2])
    np.testing.assert_array_equal(expected, 2 * made[2])
    assert len(made) == 3 and beside == "beside"


def test_special_draws_are_among_the_first():
    special = metrics.Numbers(0.5)
    item = Exercise(
        "f", reference=abs, draw=lambda rng: (float(rng.uniform(1, 2)),), metric=metrics.Numbers(1e-9),
        hints=("a", "b", "c"), noisy=(lambda rng: (0.0,), special),
    )  # fmt: skip
    first = [item.all_again[k][2] is special for k in range(MORE_CASES + 4)]
    assert first == MORE_CASES * [False] + [True, True, False, False]
    assert all(item.plain_again[k][2] is item.metric for k in range(4))
