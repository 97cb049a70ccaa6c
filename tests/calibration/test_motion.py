"""Motions of robot and sensor: the loop they come from, and what no mounting changes."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from labkit.calibration.motion import between_axes, motions, screw, turning
from labkit.geometry.frames import invert, pose
from labkit.geometry.lie import exp_so3

RNG = np.random.default_rng(0)
T_BF = pose(exp_so3(RNG.uniform(-1, 1, (9, 3))), RNG.uniform(-300, 300, (9, 3)))
X = pose(exp_so3([0.4, -0.2, 0.9]), [40.0, -30.0, 110.0])
T_ST = invert(T_BF @ X) @ pose(exp_so3([1.0, 0.4, -0.2]), [700.0, 50.0, -60.0])


def test_motions_close_the_loop():
    A, B = motions(T_BF, T_ST)
    assert np.allclose(A @ X, X @ B) and A.shape == (8, 4, 4)
    with pytest.raises(ValueError, match="n at least 2"):
        motions(T_BF[:1], T_ST[:1])
    with pytest.raises(ValueError, match=r"got \(9, 4, 4\) and \(8, 4, 4\)"):
        motions(T_BF, T_ST[1:])


def test_a_screw_is_built_and_read():
    axis, point = np.array([2.0, -1.0, 2.0]) / 3, np.array([30.0, 5.0, -8.0])
    R = Rotation.from_rotvec(0.7 * axis).as_matrix()
    T = pose(R, point - R @ point + 12.0 * axis)
    assert screw(T) == (pytest.approx(0.7), pytest.approx(12.0))
    assert screw(invert(T)) == (pytest.approx(0.7), pytest.approx(12.0))  # the axis turns around with the shift
    assert screw(pose(np.eye(3), [3.0, 4.0, 0.0])) == (0.0, pytest.approx(5.0))


def test_no_mounting_changes_angle_shift_and_the_angles_between_axes():
    A, B = motions(T_BF, T_ST)
    assert np.allclose(screw(A), screw(B))
    for apart in (1, 2, 3):
        assert np.allclose(between_axes(A, apart), between_axes(B, apart), atol=1e-7)
        assert between_axes(A, apart).shape == (8 - apart,)


def test_an_inverted_file_is_seen_between_motions_that_share_no_row_alone():
    A, _ = motions(T_BF, T_ST)
    _, wrong = motions(T_BF, invert(T_ST))
    assert np.allclose(screw(A), screw(wrong)) and np.allclose(between_axes(A), between_axes(wrong), atol=1e-7)
    assert np.abs(between_axes(A, 2) - between_axes(wrong, 2)).max() > 0.2


def test_turns_across_the_axes_are_root_mean_squares_whatever_the_weights_add_up_to():
    """Small turns about x, y and z with known weighted squares: across z turn those about x and y, and so on."""
    sizes, weights = np.array([0.02, 0.01, 0.005]), np.array([3.0, 1.0, 2.0, 3.0, 1.0, 2.0])
    turns = np.concatenate([np.diag(sizes), -np.diag(sizes)])
    squares = np.array([6.0, 2.0, 4.0]) * sizes**2 / 12  # about x, y and z
    for factor in (1.0, 0.01, 40.0):
        found, directions = turning(exp_so3(turns), factor * weights)
        order = np.argsort(squares.sum() - squares)
        np.testing.assert_allclose(found**2, (squares.sum() - squares)[order], rtol=1e-3)
        np.testing.assert_allclose(np.abs(directions), np.eye(3)[:, order], atol=1e-3)


def test_the_angle_between_axes_does_not_hang_on_how_far_they_turn():
    turns = np.array([[0.3, 0, 0], [0, 1.2, 0], [0.02, 0.02, 0]])
    found = between_axes(pose(exp_so3(turns), np.zeros((3, 3))), 1)
    np.testing.assert_allclose(np.rad2deg(found), [90.0, 45.0], atol=1e-6)
