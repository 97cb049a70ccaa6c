"""Arrays of whole numbers, which an array made like them cuts decimals off."""

from dataclasses import replace

import numpy as np
import pytest

from labkit.chapters.ch01_frames.exercises import CHAPTER as FRAMES
from labkit.chapters.ch04_optimization.exercises import CHAPTER as WELLS
from labkit.exercises.engine import CORRECT, NOT_YET

NORMALIZE = FRAMES["normalize"]


def judged(item, answer):
    return item.judge(answer, rng=np.random.default_rng(0))


def like_the_given(v):
    unit = np.zeros_like(v)
    unit[:] = v / np.linalg.norm(v)
    return unit


def moved_in_a_copy(f, x, h):
    slopes = []
    for k in range(len(x)):
        ahead, behind = np.copy(x), np.copy(x)
        ahead[k] += h
        behind[k] -= h
        slopes.append((f(ahead) - f(behind)) / (2 * h))
    return np.array(slopes)


@pytest.mark.parametrize(
    "item, answer",
    [(NORMALIZE, like_the_given), (WELLS["measured_gradient"], moved_in_a_copy)],
    ids=lambda a: str(a)[:9],
)
def test_decimals_that_are_cut_off_are_told(item, answer):
    outcome = judged(item, answer)
    assert outcome.status == NOT_YET and outcome.text.startswith("right, but not for whole numbers: of [")


def divided_in_place(v):
    unit = v.copy()
    unit /= np.linalg.norm(v)  # an array of integers refuses this aloud
    return unit


def test_what_is_right_or_stops_by_itself_is_taken():
    for answer in (divided_in_place, lambda v: list(v / np.linalg.norm(v))):
        assert judged(NORMALIZE, answer).status == CORRECT


def test_what_is_wrong_at_whole_numbers_for_another_reason_is_told_no_cause():
    anywhere = replace(NORMALIZE, draw=lambda rng: (rng.uniform(1, 2, 3),), noisy=())
    outcome = judged(anywhere, lambda v: v / np.linalg.norm(v) + (np.abs(v).max() > 9))
    assert outcome.status == NOT_YET and outcome.text.startswith("right so far, but not for [")
