"""Answers of students to chapter 6 that were once judged wrongly."""

import numpy as np
import pytest

from labkit.chapters.ch06_tracker import exercises as ch06
from labkit.exercises.engine import CORRECT, NOT_YET
from labkit.machines import log

ITEMS = {item.id: item for item in ch06.CHAPTER.items}
SEEDS = range(4)


def texts(name, answer, status=NOT_YET):
    outcomes = [ITEMS[name].judge(answer, rng=np.random.default_rng(seed)) for seed in SEEDS]
    assert all(outcome.status == status for outcome in outcomes), [o.text for o in outcomes]
    return {outcome.text for outcome in outcomes}


@pytest.mark.parametrize("sign", [1, -1])
def test_a_block_of_the_equation_may_have_either_sign(sign):
    texts("kron_row", lambda A, B: sign * (np.kron(np.eye(3), A) - np.kron(B.T, np.eye(3))), CORRECT)


def test_the_number_of_columns_is_not_told_that_it_is_the_number_of_motions():
    wrong = texts("e_rot", lambda M: np.linalg.svd(M)[1][-1] ** 2 / (M.shape[1] - 1))
    assert not any("divide by N" in text for text in wrong)


@pytest.mark.parametrize("constant", [1.48, 1.4826, 1 / 0.6745])
def test_the_constant_of_the_robust_rule_may_be_rounded(constant):
    def keep(values, factor):
        distance = np.abs(values - np.median(values))
        return distance < factor * constant * np.median(distance)

    texts("reject_outliers", keep, CORRECT)


def test_other_rules_for_outliers_are_not_told_of_a_missing_constant():
    def box_plot(values, factor):
        low, high = np.percentile(values, [25, 75])
        return (values > low - 1.5 * (high - low)) & (values < high + 1.5 * (high - low))

    theirs = log.reject_outliers
    for rule in (box_plot, lambda values, factor: theirs(values, 3.0)):
        assert not any("1.4826" in text for text in texts("reject_outliers", rule))


def test_a_tracker_that_leads_is_asked_for_at_every_check():
    def lags_only(time, reference, delayed, max_offset):
        step = time[1] - time[0]
        cost = [np.mean((reference[: len(time) - s] - delayed[s:]) ** 2) for s in range(round(max_offset / step) + 1)]
        k = np.clip(np.argmin(cost), 1, len(cost) - 2)
        left, middle, right = cost[k - 1 : k + 2]
        return (k + 0.5 * (left - right) / (left - 2 * middle + right)) * step

    assert "one direction" in texts("time_offset", lags_only).pop()
