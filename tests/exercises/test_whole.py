"""Whole numbers, typed as such, which an array made like them cuts decimals off."""

from dataclasses import replace

import numpy as np
import pytest

from labkit.chapters.ch01_frames.exercises import CHAPTER as FRAMES
from labkit.chapters.ch03_quirlen.exercises import CHAPTER as PIVOT
from labkit.chapters.ch04_optimization.exercises import CHAPTER as WELLS
from labkit.chapters.ch05_hand_eye.exercises import CHAPTER as HAND_EYE
from labkit.chapters.ch06_tracker.exercises import CHAPTER as TRACKER
from labkit.exercises.outcome import CORRECT, NOT_YET
from labkit.exercises.whole import QUARTER_TURNS, whole
from labkit.geometry.frames import pose
from labkit.geometry.lie import exp_so3

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


def rows_behind_one_another(function, x, step):
    return np.transpose(moved_in_a_copy(function, x, step))


def of_the_kind_of_all(theta, d, a, alpha):
    T = np.eye(4, dtype=np.result_type(theta, d, a, alpha))
    ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    T[:3] = [ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d]
    return T


def in_the_place_of_the_part(T_BW, T_WE0, T_WE1, T_BP0):
    T = T_BP0.copy()
    T[:] = T_BW @ T_WE1 @ np.linalg.inv(T_BW @ T_WE0) @ T_BP0
    return T


def in_rows_like_the_tip(T_WF, tip, point):
    rows = np.empty((len(T_WF), 3), dtype=tip.dtype)
    for k, T in enumerate(T_WF):
        rows[k] = T[:3, :3] @ tip + T[:3, 3] - point
    return rows


@pytest.mark.parametrize(
    "item, answer, given",
    [
        (NORMALIZE, like_the_given, "`v` = ["),
        (WELLS["measured_gradient"], moved_in_a_copy, "`x` = ["),
        (TRACKER["dh_matrix"], of_the_kind_of_all, "`theta` = 3, `d` = "),
        (TRACKER["moved_part"], in_the_place_of_the_part, "`T_BP0` = [["),
        (PIVOT["pivot_residuals"], in_rows_like_the_tip, "`tip` = ["),
    ],
    ids=lambda a: str(getattr(a, "id", ""))[:9],
)
def test_decimals_that_are_cut_off_are_told(item, answer, given):
    outcome = judged(item, answer)
    assert outcome.status == NOT_YET and outcome.text.startswith("right, but not for whole numbers: for ")
    assert given in outcome.text  # alone, or with the others where already a last bit of all of them is cut off


def divided_in_place(v):
    unit = v.copy()
    unit /= np.linalg.norm(v)  # an array of integers refuses this aloud
    return unit


def test_what_is_right_or_stops_by_itself_is_taken():
    for answer in (divided_in_place, lambda v: list(v / np.linalg.norm(v))):
        assert judged(NORMALIZE, answer).status == CORRECT


def test_an_argument_may_be_left_out_with_a_reason():
    decimals = replace(NORMALIZE, decimals={"v": "a reason"})
    assert judged(decimals, like_the_given).status == CORRECT
    assert judged(HAND_EYE["numeric_jacobian"], rows_behind_one_another).status == CORRECT  # x: floats, as it says


def test_what_is_wrong_for_the_same_numbers_with_a_decimal_point_is_told_no_cause():
    anywhere = replace(NORMALIZE, draw=lambda rng: (rng.uniform(1, 2, 3),), noisy=(), properties=())
    assert anywhere.whole(lambda v: v / np.linalg.norm(v) + (v == np.round(v)).all()) is None


def test_numbers_are_made_whole_and_turns_stay_turns():
    assert whole(0.2) == 1 and whole(np.float64(-3.2)) == -4 and whole([0.5, np.array([0.0])]) == [1, np.array([0])]
    assert all(whole(other) is None for other in (2, True, "2.5", None, [], np.arange(3), np.array([np.nan]), [1.5, 2]))
    T = whole(pose(exp_so3([[0.0, 0.1, 1.5], [3.0, 0.1, 0.0]]), [[0.5, 0, -2], [1, 1, 1.0]]))
    assert T.dtype.kind == "i" and len(QUARTER_TURNS) == 24
    np.testing.assert_array_equal(T[0], [[0, -1, 0, 1], [1, 0, 0, 0], [0, 0, 1, -2], [0, 0, 0, 1]])
    np.testing.assert_array_equal(T[1, :3, :3], np.diag([1, -1, -1]))
