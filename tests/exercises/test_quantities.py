"""A wrong number is told which other one of the same data it is, and only where it is that one."""

import numpy as np
import pytest

from labkit.exercises import metrics, quantities
from labkit.exercises.outcome import CORRECT, NOT_YET
from labkit.exercises.value import Value

ROWS = np.random.default_rng(0).normal(size=(9, 3)) + 0.5
TIP = np.array([-1.7, 44.6, -87.6])
DATA = {"residuals": ROWS, "tip": TIP, "angle": 0.3, "gap": 7.0}


@pytest.mark.parametrize(
    "answer, told",
    [
        (np.median(np.linalg.norm(ROWS, axis=1)), "the median length of the rows of `residuals`"),
        (3 * np.sqrt((ROWS**2).mean()), "three times the rms of all entries of `residuals`"),
        (np.linalg.norm(ROWS.mean(0)), "the length of the mean of the rows of `residuals`"),
        (np.linalg.norm(ROWS[4]), "the length of row 4 (counted from 0) of `residuals` alone"),
        (np.linalg.norm(ROWS, 2) / 3, "the largest singular value of `residuals`, divided by the root of the number"),
        (np.hypot(TIP[0], TIP[2]), "the length made of the entries 0, 2 (counted from 0) of `tip`"),
        (round(float(np.hypot(TIP[0], TIP[2])), 2), "the length made of the entries 0, 2"),
        (7.0 / np.tan(np.rad2deg(0.3)), None),
        (7.0 / np.rad2deg(0.3), "`gap` divided by `angle` in degrees"),
        (np.tan(0.3) * 7.0, "the tangent of `angle` times `gap`"),
        (np.rad2deg(np.sin(0.3)), "this is the sine of `angle`, turned into degrees"),
        (0.3, "this is `angle`"),
        (123.456, None),
    ],
)
def test_another_number_of_the_same_data_is_named(answer, told):
    words = quantities.quantity_words(float(answer), DATA)
    assert words is None if told is None else told in words, words


def test_few_numbers_are_met_by_chance():
    answers = np.random.default_rng(1).uniform(0, 100, 300).round(3)
    assert sum(quantities.quantity_words(a, DATA) is not None for a in answers) < 9


def test_a_value_says_what_a_wrong_answer_is():
    rms = Value("rms", lambda: np.sqrt((ROWS**2).sum(1).mean()), hints=("a", "b", "c"), of={"residuals": lambda: ROWS})
    assert rms.judge(rms.reference()).status == CORRECT
    outcome = rms.judge(np.linalg.norm(ROWS, axis=1).mean())
    assert (outcome.status, outcome.text) == (NOT_YET, "this is the mean length of the rows of `residuals`.")


def test_of_a_wrong_array_one_ratio_or_the_entries_that_are_right_are_told():
    item = Value(
        "v",
        reference=lambda: np.array([0.3, 0.0, 1.7, 2.4]),
        metric=metrics.Numbers(1e-6),
        hints=("a", "b", "c"),
    )
    assert "each of your numbers is 5 times" in item.judge(np.array([1.5, 0.0, 8.5, 12.0])).text
    assert ", though [2] (counted from 0) is right" in item.judge(np.array([0.1, 0.0, 1.7, 2.9])).text
    assert "though" not in item.judge(np.array([0.1, 0.0, 1.1, 2.0])).text
