"""Exponential and logarithm against SciPy and scipy.linalg.expm."""

import math

import numpy as np
import pytest
from scipy.linalg import expm, logm
from scipy.spatial.transform import Rotation

from labkit.geometry import lie

ANGLES = [0.0, 1e-12, 1e-8, 1e-5, 1e-3, 0.1, 1.0, 3.0, 3.14159, np.pi - 1e-8]


def vectors(length, n=20):
    v = np.random.default_rng(2).normal(size=(n, 3))
    return length * v / np.linalg.norm(v, axis=1, keepdims=True)


@pytest.mark.parametrize("angle", ANGLES)
def test_so3_round_trip_and_scipy(angle):
    phi = vectors(angle)
    R = lie.exp_so3(phi)
    np.testing.assert_allclose(R, Rotation.from_rotvec(phi).as_matrix(), atol=3e-15)
    np.testing.assert_allclose(lie.log_so3(R), phi, atol=1e-12)


def test_log_at_pi_returns_a_half_turn():
    R = Rotation.from_rotvec(vectors(np.pi)).as_matrix()
    phi = lie.log_so3(R)
    np.testing.assert_allclose(np.linalg.norm(phi, axis=1), np.pi)
    np.testing.assert_allclose(lie.exp_so3(phi), R, atol=1e-7)


@pytest.mark.parametrize("angle", ANGLES[:-2])
def test_se3_against_the_matrix_exponential(angle):
    xi = np.c_[vectors(angle), np.random.default_rng(3).normal(size=(20, 3))]
    for x in xi:
        generator = np.zeros((4, 4))
        generator[:3, :3], generator[:3, 3] = lie.skew(x[:3]), x[3:]
        np.testing.assert_allclose(lie.exp_se3(x), expm(generator), atol=1e-13)
    np.testing.assert_allclose(lie.log_se3(lie.exp_se3(xi)), xi, atol=1e-9)


def test_adjoint_moves_a_twist_to_the_other_side():
    twists, xi = np.random.default_rng(4).normal(size=(2, 10, 6))
    T = lie.exp_se3(0.6 * twists)
    left = T @ lie.exp_se3(xi) @ np.linalg.inv(T)
    np.testing.assert_allclose(lie.exp_se3((lie.adjoint(T) @ xi[..., None])[..., 0]), left, atol=1e-10)


def test_left_jacobian_by_finite_differences():
    phi, h = np.array([0.4, -0.7, 0.2]), 1e-6
    for k, d in enumerate(np.eye(3)):
        turned = lie.log_so3(lie.exp_so3(phi + h * d) @ lie.exp_so3(phi).T) / h
        np.testing.assert_allclose(lie.left_jacobian_so3(phi)[:, k], turned, atol=1e-6)


def test_nearest_rotation_is_the_nearest():
    rng = np.random.default_rng(6)
    M = Rotation.random(8, rng).as_matrix() + 0.2 * rng.normal(size=(8, 3, 3))
    M[0] *= -1
    R = lie.nearest_rotation(M)
    np.testing.assert_allclose(np.linalg.det(R), 1)
    best = np.linalg.norm(R - M, axis=(1, 2))
    for other in Rotation.random(200, rng).as_matrix():
        assert (np.linalg.norm(other - M, axis=(1, 2)) >= best - 1e-12).all()


def test_log_near_pi_keeps_the_side_in_stacks_of_any_shape():
    axes = np.array([[[1.0, 2, 2], [-2, 1, 2]], [[2, 2, -1], [-1, -2, -2]]]) / 3
    phi = (np.pi - 1e-3) * axes
    np.testing.assert_allclose(
        lie.log_so3(Rotation.from_rotvec(phi.reshape(-1, 3)).as_matrix().reshape(2, 2, 3, 3)), phi
    )
    np.testing.assert_allclose(lie.log_so3(Rotation.from_rotvec(phi[1, 1]).as_matrix()), phi[1, 1])
    mixed = np.array([(np.pi - 1e-11) * axes[0, 0], 0.3 * axes[0, 1]])  # so near that R - R' no longer tells the axis
    np.testing.assert_allclose(lie.log_so3(Rotation.from_rotvec(mixed).as_matrix()), mixed, atol=1e-7)


@pytest.mark.parametrize("angle", (1e-5, 3e-4, 9.99e-4, 1.01e-3, 0.5, 3.0))
def test_left_jacobian_is_the_mean_of_the_rotations_on_the_way(angle):
    """V(phi) = integral of exp(s phi) over s from 0 to 1; the series meets the closed form to the last digits."""
    phi = angle * np.array([2.0, -1, 2]) / 3
    nodes, weights = np.polynomial.legendre.leggauss(20)
    way = Rotation.from_rotvec(0.5 * (1 + nodes)[:, None] * phi).as_matrix()
    np.testing.assert_allclose(lie.left_jacobian_so3(phi), np.tensordot(weights / 2, way, 1), rtol=0, atol=3e-14)


@pytest.mark.parametrize("angle", [1e-7, 3e-4, 0.99e-3, 1.01e-3, 0.02])
def test_series_and_closed_forms_of_small_angles_are_the_taylor_sums(angle):
    found = [float(c[0, 0]) for c in lie._coefficients(np.array(angle**2))]
    limits = (5e-16,) * 3 if angle < 1e-3 else (1e-14, 1e-14, 1e-9)  # t - sin t loses digits where no series is taken
    for first, value, rtol in zip((1, 2, 3), found, limits):
        terms = [(-1) ** k * angle ** (2 * k) / math.factorial(2 * k + first) for k in range(6)]
        np.testing.assert_allclose(value, math.fsum(terms), rtol=rtol)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_interpolation_is_a_share_of_the_twist_between_both(share):
    rng = np.random.default_rng(6)
    T0, T1 = lie.exp_se3(rng.uniform(-1.5, 1.5, (2, 5, 6)) * [1, 1, 1, 100, 100, 100])
    found = lie.interpolate(T0, T1, np.full(5, share))
    for k in range(5):
        twist = np.real(logm(np.linalg.inv(T0[k]) @ T1[k]))
        np.testing.assert_allclose(found[k], T0[k] @ expm(share * twist), atol=1e-8)


@pytest.mark.parametrize("short", [0.0, 1e-9, 1e-5, 1e-3])
def test_half_turns_about_the_axes_and_between_them(short):
    """Where the skew part fades, the axis comes from the largest column of the symmetric one."""
    axes = np.concatenate([np.eye(3), -np.eye(3), np.array([[0.6, 0.8, 0], [0, -0.6, 0.8], [1e-4, 0, -1]])])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    turns = (np.pi - short) * axes
    found = lie.log_so3(Rotation.from_rotvec(turns).as_matrix())
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), np.pi - short, rtol=1e-9)
    off = np.minimum(np.abs(found - turns).max(1), np.abs(found + turns).max(1) if short < 1e-8 else np.inf)
    assert off.max() < 1e-7  # a half turn is one about either sign of its axis
