"""Right elsewhere and wrong at a special place: who is, hears of the place."""

import numpy as np

from labkit.exercises import metrics, special

HOLDS = special.right_where(
    lambda v: 2 * v,
    metrics.Numbers(1e-9, "mm"),
    ("for a short vector", lambda rng: (rng.normal(size=2),)),
    ("for a long vector", lambda rng: (rng.normal(size=9),)),
)


def told(student):
    return HOLDS(student, np.random.default_rng(0))


def short_ones(answer):
    return lambda v: 2 * v if len(v) < 3 else answer(v)


def test_who_is_right_everywhere_hears_nothing():
    assert told(lambda v: v + v) is None


def test_the_place_is_named_with_what_is_wrong_there():
    assert told(short_ones(lambda v: v)).startswith("right so far, but not for a long vector: the worst entry is off")
    assert told(short_ones(lambda v: v[:2])).startswith("right so far, but not for a long vector: expected an array")
    assert told(short_ones(lambda v: v[9])).startswith(
        "right so far, but not for a long vector: there it raises IndexError"
    )
    assert told(lambda v: 3 * v).startswith("right so far, but not for a short vector")


def test_arguments_of_the_reference_are_not_those_of_the_answer():
    def in_place(v):
        v += v
        return v

    assert told(in_place) is None


def test_a_slow_answer_is_not_called_for_ever(monkeypatch):
    monkeypatch.setattr(special, "LONGEST", -1.0)
    assert told(lambda v: 3 * v) is None
