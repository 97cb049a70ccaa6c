"""Stages of chapter 11: what they compute, against closed forms and repeated calibrations, and that each draws, fails,
recovers."""

import numpy as np
import pytest
from scipy import stats

from labkit.calibration import calibrate
from labkit.chapters.ch11_your_own_data import stages as w
from labkit.machines.sensor_cell import CELL

ALL = (w.motions_beside_each_other, w.pose_left_out, w.next_pose, w.done_again)


@pytest.mark.parametrize("make", ALL)
def test_draws_fails_and_recovers(make, draws_fails_and_recovers):
    draws_fails_and_recovers(make)


def motions(cell, inverted=False, clock_ms=0):
    return w.compute_motions({"cell": cell, "inverted": inverted, "clock_ms": clock_ms})


def test_an_inverted_file_moves_the_axes_and_no_angle():
    wrong, right = motions("swapped_role"), motions("swapped_role", inverted=True)
    assert np.allclose(wrong["angles"], right["angles"], atol=1e-6)
    assert right["rms"][1] < 1 < 10 < wrong["rms"][1]


def test_the_late_clock_is_seen_in_the_angles_and_mended_by_its_84_ms():
    rms = {k: motions("late_clock", clock_ms=k)["rms"][0] for k in (-84, 0, 70, 84, 98)}
    assert min(rms, key=rms.get) == 84 and rms[84] < 0.2 < 0.7 < rms[0] < rms[-84]


def test_the_pose_across_is_the_one_that_counts():
    stds = {k: w.compute_without({"drop": k, "kind": "one"})["std"][1] for k in range(11)}
    assert np.isinf(stds[4]) and all(stds[k] < 1.05 * stds[0] for k in stds if k != 4)
    result = w.compute_without({"drop": 4, "kind": "one"})
    axis = result["T_BF"][0, :3, :3] @ CELL.T_FS[:3, :3] @ [0, 1, 0]  # the axis of all the turns, in the base
    assert abs(result["slide"] @ axis) == pytest.approx(1, abs=1e-6)
    J = w._derivatives(w._ten("one"))[0]
    scale = np.sqrt(np.diagonal(np.linalg.inv(w._normal(J))))
    values = np.linalg.svd(np.delete(J, 3, 0).reshape(-1, 12) * scale, compute_uv=False)
    assert values[-2] < 1e-6 * values[0] and values[-3] > 1e-3 * values[0]
    assert result["free"] == 2  # as the caption says
    assert w.compute_without({"drop": 0, "kind": "around"})["shares"].sum() == pytest.approx(12)


def test_one_pose_across_beats_ninety_of_the_kind():
    across, alike = w.compute_next({"P": np.array([20.0, 0.0])}), w.compute_next({"P": np.array([0.0, 10.0])})
    assert np.linalg.norm(across["after"][3:]) < np.linalg.norm(across["ninety"][3:])
    assert (alike["after"] > 0.97 * alike["now"]).all()
    assert np.allclose(across["ninety"], across["now"] / np.sqrt(11))


def test_what_is_predicted_is_what_the_calibration_tells():
    """The standard deviations of the Stage beside those of `calibrate` on readings without noise, told the same one."""
    tilt = np.deg2rad(w._nine()[0])
    T_BF = CELL.looking(tilt, np.broadcast_to(w.PLACE, tilt.shape))
    found = calibrate.hand_eye(T_BF, CELL.read(T_BF, None, std=0.0), std_rot=CELL.std_rot, std_trans=CELL.std_trans)
    assert np.allclose(found.std, w.compute_next({"P": np.zeros(2)})["now"], rtol=1e-3)


@pytest.mark.parametrize("n", [3, 4, 12])
def test_done_again_follows_students_law(n):
    """4000 fixed draws; the odds of missing a share by 5 standard deviations are below 1e-6."""
    estimated, student, known = (w.compute_again({"n": n, "noise": k}) for k in ("estimated", "student", "known"))
    law = stats.t(estimated["freedom"])
    for result, beyond in ((estimated, 2 * law.sf(2)), (known, 2 * stats.norm.sf(2))):
        assert abs(result["beyond"] - beyond) < 5 * np.sqrt(beyond * (1 - beyond) / w.REPEATED)
    assert student["beyond"] < estimated["beyond"] and 0.9 < known["spread"] < 1.1
