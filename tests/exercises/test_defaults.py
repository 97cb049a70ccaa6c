"""A default argument that is filled stays from call to call: who is right but for that hears of it."""

import numpy as np

from labkit.exercises import metrics
from labkit.exercises.engine import Exercise
from labkit.exercises.outcome import CORRECT

DOUBLE = Exercise(
    "double",
    reference=lambda v: 2 * v,
    draw=lambda rng: (rng.normal(size=2),),
    metric=metrics.Numbers(1e-9),
    hints=("Add.", "Add v.", "`return v + v`"),
    properties=(lambda student, rng: None if np.all(student(np.zeros(2)) == 0) else "twice 0 is not 0.",),
)


def judged(answer):
    return DOUBLE.judge(answer, rng=np.random.default_rng(0))


def test_what_stops_on_what_is_left_over_is_told():
    empty = []

    def double(v, seen=empty):
        seen.append(v)
        if len(seen) > 1:
            raise ValueError("one call only")
        return 2 * v

    assert "into `seen` is still there" in judged(double).text


def test_a_property_that_fails_on_what_is_left_over_is_told():
    empty = []

    def double(v, seen=empty):
        seen.append(v)
        return 2 * v + (len(seen) > 1 and not v.any())

    assert "into `seen` is still there" in judged(double).text


def test_what_is_wrong_without_it_is_told_as_ever():
    empty = []

    def double(v, seen=empty):
        return 2 * v if v.any() else v + 1

    assert judged(double).text == "twice 0 is not 0."


def test_what_is_kept_and_does_no_harm_is_right():
    empty = {}

    def double(v, known=empty):
        return known.setdefault(v.tobytes(), 2 * v).copy()

    assert judged(double).status == CORRECT
