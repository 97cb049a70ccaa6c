"""Poses in the plane against their 3 x 3 matrices and the matrix exponential."""

import numpy as np
import pytest
from scipy.linalg import expm

from labkit.geometry import planar


def matrix(x):
    c, s = np.cos(x[2]), np.sin(x[2])
    return np.array([[c, -s, x[0]], [s, c, x[1]], [0, 0, 1]])


def poses(seed, n=6):
    return np.random.default_rng(seed).uniform([-3, -3, -2], [3, 3, 2], (n, 3))


def test_poses_multiply_and_divide_like_their_matrices():
    for x, y in zip(poses(1), poses(2)):
        there = planar.compose_pose(x, y)
        np.testing.assert_allclose(matrix(there), matrix(x) @ matrix(y), atol=1e-12)
        assert there[2] == x[2] + y[2]  # not wrapped
        np.testing.assert_allclose(
            matrix(planar.relative_pose(x, y)), np.linalg.solve(matrix(x), matrix(y)), atol=1e-12
        )
    np.testing.assert_allclose(
        planar.compose_pose(poses(1), poses(2)[0])[3], planar.compose_pose(poses(1)[3], poses(2)[0])
    )


@pytest.mark.parametrize("turn", [0.0, 1e-9, -1e-3, 0.4, -2.0, 3.0])
def test_a_pose_is_the_exponential_of_its_twist(turn):
    xi = np.array([1.2, -0.7, turn])
    generator = np.array([[0, -turn, 1.2], [turn, 0, -0.7], [0, 0, 0]])
    np.testing.assert_allclose(matrix(planar.exp_pose(xi)), expm(generator), atol=1e-12)
    np.testing.assert_allclose(planar.log_pose(planar.exp_pose(xi)), xi, atol=1e-12)


def test_directions_are_wrapped_into_one_turn():
    angles = np.array([-7.0, -np.pi, -0.5, 0.0, 3.0, 3.5, 40.0])
    wrapped = planar.wrap_angle(angles)
    np.testing.assert_allclose(np.exp(1j * wrapped), np.exp(1j * angles), atol=1e-12)
    assert (wrapped >= -np.pi).all() and (wrapped < np.pi).all() and wrapped[1] == -np.pi
