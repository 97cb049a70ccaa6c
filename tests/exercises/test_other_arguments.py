"""Whether a wrong answer is told for which other arguments it would be right, and only where that is so."""

import numpy as np
import pytest

from labkit.exercises import metrics
from labkit.exercises.engine import Exercise
from labkit.exercises.outcome import CORRECT, NOT_YET
from labkit.geometry import frames
from labkit.geometry.lie import exp_so3

HINTS = ("a", "b", "c")


def random_pose(rng):
    return frames.pose(exp_so3(rng.normal(size=3)), rng.uniform(-100, 100, 3))


def exercise(reference, draw, metric=None):
    return Exercise("f", reference=reference, draw=draw, metric=metric or metrics.Numbers(1e-9), hints=HINTS)


GAP = exercise(
    lambda T, p, scale: scale**2 * (T[:3, :3] @ p + T[:3, 3]) ** 3,
    lambda rng: (random_pose(rng), rng.normal(size=3), float(rng.uniform(2, 3))),
)
ROWS = exercise(
    lambda a, b, n: (np.arange(len(a)) @ (a * np.sin(b))) ** n,
    lambda rng: (*rng.uniform(0.2, 1, (2, int(rng.integers(6, 9)), 2)), int(rng.integers(2, 5))),
)
SPREAD = exercise(lambda C, x: (x @ C @ x) ** 2, lambda rng: (rng.normal(size=(3, 3)), rng.normal(size=3)))
BETWEEN = exercise(
    lambda A, B: frames.invert(A) @ B, lambda rng: (random_pose(rng), random_pose(rng)), metrics.Poses(1e-6, 1e-6)
)

SIZED = exercise(
    lambda B, u, V: (B @ u + np.diag(B @ V @ B.T)) ** 3,
    tuple(
        lambda rng, k=k: (rng.normal(size=(3, k)), rng.uniform(1, 2, k), np.eye(k) + rng.uniform(0, 0.2, (k, k)))
        for k in (1, 3, 2)
    ),
)


@pytest.mark.parametrize(
    "of, change, told",
    [
        (GAP, lambda T, p, s: (T, -p, s), "comes out with -`p` in place of `p`"),
        (GAP, lambda T, p, s: (T, 0 * p, s), "comes out if `p` were 0"),
        (GAP, lambda T, p, s: (T, p, 1.0), "comes out if `scale` were 1"),
        (GAP, lambda T, p, s: (T, p * [1, 1, 0], s), "comes out if entry 2 (counted from 0) of `p` were 0"),
        (GAP, lambda T, p, s: (T, p * [1, -1, 1], s), "if entry 1 (counted from 0) of `p` had the opposite sign"),
        (GAP, lambda T, p, s: (T, p[[2, 1, 0]], s), "with the entries 0 and 2 (counted from 0) of `p` exchanged"),
        (GAP, lambda T, p, s: (T, p, s**2), "comes out with `scale` squared"),
        (GAP, lambda T, p, s: (frames.invert(T), p, s), "comes out with `T` inverted"),
        (GAP, lambda T, p, s: (frames.pose(T[:3, :3].T, T[:3, 3]), p, s), "with the rotation of `T` transposed"),
        (GAP, lambda T, p, s: (frames.pose(T[:3, :3], 0 * p), p, s), "comes out if `T` had no translation"),
        (GAP, lambda T, p, s: (frames.pose(np.eye(3), T[:3, 3]), p, s), "comes out if `T` did not turn"),
        (SPREAD, lambda C, x: (C * np.eye(3), x), "comes out with the diagonal of `C` alone"),
        (ROWS, lambda a, b, n: (b, a, n), "comes out with `a` and `b` exchanged"),
        (ROWS, lambda a, b, n: (a, np.rad2deg(b), n), "comes out with `b` converted to degrees"),
        (ROWS, lambda a, b, n: (a, b, n + 1), "comes out with `n` + 1 in place of `n`"),
        (ROWS, lambda a, b, n: (a[:-1], b[:-1], n), "comes out without the last of `a` and `b`"),
        (ROWS, lambda a, b, n: (a[1:], b[1:], n), "comes out without the first of `a` and `b`"),
        (ROWS, lambda a, b, n: (a[::-1], b[::-1], n), "comes out with `a` and `b` in reverse order"),
        (ROWS, lambda a, b, n: (a[:4], b[:4], n), "comes out with the first 4 of `a` and `b` alone"),
        (
            SIZED,
            lambda B, u, V: (B[:, :1], u[:1], V[:1, :1]),
            "the first of `u` alone, and what goes with it in `B` and `V`",
        ),
        (SIZED, lambda B, u, V: (B[:, :2], u[:2], V[:2, :2]), "with the first 2 of `u` alone, and what goes with it"),
        (BETWEEN, lambda A, B: (A, frames.pose(B[:3, :3].T, B[:3, 3])), "with the rotation of `B` transposed"),
    ],
)
def test_a_result_that_is_right_for_other_arguments_says_for_which(of, change, told):
    def answer(*args):
        return of.reference(*change(*args))

    outcome = of.judge(answer, rng=np.random.default_rng(0))
    assert outcome.status == NOT_YET and told in outcome.text, outcome.text


def test_data_of_the_notebook_in_place_of_an_argument_are_named():
    known = {"np": np, "measured": np.arange(1.0, 15).reshape(7, 2)}
    exec("def f(a, b, n): return (np.arange(7) @ (measured * np.sin(np.resize(b, (7, 2)))))**n", known)
    of = exercise(ROWS.reference, lambda rng: (*rng.uniform(0.2, 1, (2, 7, 2)), int(rng.integers(2, 5))))
    assert "with the notebook's `measured` in place of `a`" in of.judge(known["f"]).text


def test_a_result_that_one_change_does_not_explain_is_not_explained():
    rng = np.random.default_rng(0)
    for of, answer in (
        (GAP, lambda T, p, s: GAP.reference(T, p, s) + np.sin(p)),
        (ROWS, lambda a, b, n: ROWS.reference(a, b, n) + np.cos(b[0])),
        (BETWEEN, lambda A, B: A @ B @ A),
    ):
        outcome = of.judge(answer, rng=rng)
        assert outcome.status == NOT_YET and "comes out" not in outcome.text, outcome.text


def test_an_answer_that_is_right_is_right_however_often_a_change_leaves_it_as_it_is():
    of = exercise(lambda x, y: x * y, lambda rng: tuple(rng.normal(size=2)))
    assert of.judge(lambda x, y: y * x).status == CORRECT


def test_attributes_are_no_data_of_the_notebook():
    known = {"T": np.eye(4)}
    exec("def f(A, B): return A.T @ B", known)
    assert "notebook" not in BETWEEN.judge(known["f"]).text


def test_a_constant_answer_is_not_told_as_another_argument():
    item = Exercise(
        "formula",
        reference=lambda a, b: a * b,
        draw=lambda rng: (rng.normal(size=3), float(rng.uniform(1, 2))),
        metric=metrics.Numbers(1e-9),
        hints=("a", "b", "c"),
    )
    text = item.judge(lambda a, b: np.zeros(3), rng=np.random.default_rng(0)).text
    assert "what comes out" not in text


def test_an_argument_changed_holds_on_fresh_draws_as_well():
    draws = iter([0.0, 1.0] * 3)
    item = Exercise(
        "formula",
        reference=lambda a, b: a + b,
        draw=lambda rng: (float(rng.uniform(1, 2)), next(draws, 0.5)),
        metric=metrics.Numbers(1e-9),
        hints=("a", "b", "c"),
    )
    text = item.judge(
        lambda a, b: a + (3.0 if b == 0.5 else 1.0 - np.cos(np.pi * b)), rng=np.random.default_rng(0)
    ).text
    assert "what comes out" not in text
