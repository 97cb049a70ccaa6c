"""Errors of poses through products, inverses, points and frames: against differences, closed forms and Monte Carlo."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from labkit.geometry import propagation
from labkit.geometry.frames import frame_from_points, gram_schmidt_covariance, invert, moved, pose, transform


def random_pose(rng):
    return pose(Rotation.random(random_state=rng).as_matrix(), rng.uniform(-300, 300, 3))


def error_between(T, disturbed):
    """e of T -> disturbed, by SciPy."""
    return np.r_[Rotation.from_matrix(T[:3, :3].T @ disturbed[:3, :3]).as_rotvec(), (disturbed - T)[:3, 3]]


def differences(f, n, h=1e-6):
    """Jacobian of a function of n small errors by central differences."""
    return np.array([(f(h * e) - f(-h * e)) / (2 * h) for e in np.eye(n)]).T


SEEDS = pytest.mark.parametrize("seed", range(3))


@SEEDS
def test_errors_of_both_factors_arrive_in_the_product(seed):
    rng = np.random.default_rng(seed)
    A, B = random_pose(rng), random_pose(rng)
    J_A, J_B = propagation.product_jacobians(A, B)
    by_A = differences(lambda e: error_between(A @ B, moved(A, e) @ B), 6)
    by_B = differences(lambda e: error_between(A @ B, A @ moved(B, e)), 6)
    np.testing.assert_allclose(J_A, by_A, atol=1e-6)
    np.testing.assert_allclose(J_B, by_B, atol=1e-6)


@SEEDS
def test_the_error_of_an_inverse_and_of_a_point(seed):
    rng = np.random.default_rng(seed)
    T, p = random_pose(rng), rng.uniform(-100, 100, 3)
    by_T = differences(lambda e: error_between(invert(T), invert(moved(T, e))), 6)
    np.testing.assert_allclose(propagation.inverse_jacobian(T), by_T, atol=1e-6)
    np.testing.assert_allclose(
        propagation.inverse_jacobian(invert(T)) @ propagation.inverse_jacobian(T), np.eye(6), atol=1e-9
    )
    J_T, J_p = propagation.point_jacobians(T, p)
    np.testing.assert_allclose(J_T, differences(lambda e: transform(moved(T, e), p), 6), atol=1e-6)
    np.testing.assert_allclose(J_p, differences(lambda e: transform(T, p + e), 3), atol=1e-6)


def test_covariance_of_a_point_is_that_of_many_draws():
    """20,000 draws: each variance is known to 1 %."""
    rng = np.random.default_rng(7)
    T, p = random_pose(rng), rng.uniform(-100, 100, 3)
    scale = np.repeat([1e-3, 0.2], 3)
    roots = rng.normal(size=(6, 6)) * scale[:, None], 0.1 * rng.normal(size=(3, 3))
    cov_T, cov_p = (root @ root.T for root in roots)
    e, d = (rng.normal(size=(20_000, len(root))) @ root.T for root in roots)
    points = transform(moved(T, e), p + d)
    values, axes = np.linalg.eigh(propagation.point_covariance(T, cov_T, p, cov_p))
    np.testing.assert_allclose((points @ axes).var(0), values, rtol=0.06)


def test_each_link_of_a_chain():
    rng = np.random.default_rng(4)
    links = [random_pose(rng) for _ in range(4)]
    T, J = propagation.chain_jacobians(links)
    for k in range(4):

        def product(e, k=k):
            return np.linalg.multi_dot([moved(L, e) if i == k else L for i, L in enumerate(links)])

        np.testing.assert_allclose(J[k], differences(lambda e, f=product: error_between(T, f(e)), 6), atol=2e-6)
    with pytest.raises(ValueError, match="at least one link"):
        propagation.chain_jacobians([])


@SEEDS
def test_three_points_turn_and_shift_their_frame(seed):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-200, 200, (3, 3))
    T = frame_from_points(*points)
    numeric = differences(lambda e: error_between(T, frame_from_points(*(points + e.reshape(3, 3)))), 9, h=1e-4)
    np.testing.assert_allclose(propagation.three_point_jacobian(*points), numeric, atol=1e-7)


def test_three_points_have_the_closed_form_covariance_of_chapter_1():
    J = propagation.three_point_jacobian([0, 0, 0], [120, 0, 0], [40, 70, 0])
    np.testing.assert_allclose(0.2**2 * (J @ J.T)[:3, :3], gram_schmidt_covariance(120, 40, 70, 0.2), atol=1e-15)


def test_leading_axes_broadcast():
    rng = np.random.default_rng(5)
    A, B = np.array([random_pose(rng) for _ in range(3)]), random_pose(rng)
    J_A, J_B = propagation.product_jacobians(A, B)
    one = propagation.product_jacobians(A[1], B)
    np.testing.assert_allclose([J_A[1], J_B[1]], one)
    points = rng.uniform(-200, 200, (3, 4, 3))
    many = propagation.three_point_jacobian(*points)
    np.testing.assert_allclose(many[2], propagation.three_point_jacobian(*points[:, 2]))
    assert propagation.point_jacobians(A, [1.0, 2, 3])[0].shape == (3, 3, 6)


def test_the_shares_add_up_and_what_does_not_fit_is_refused():
    rng = np.random.default_rng(6)
    J = {"a": rng.normal(size=(3, 6)), "b": rng.normal(size=(3, 2))}
    roots = {"a": rng.normal(size=(6, 6)), "b": rng.normal(size=(2, 2))}
    cov = {name: root @ root.T for name, root in roots.items()}
    shares = propagation.error_budget(J, cov)
    joint = np.block([[cov["a"], np.zeros((6, 2))], [np.zeros((2, 6)), cov["b"]]])
    both = np.hstack([J["a"], J["b"]])
    np.testing.assert_allclose(sum(shares.values()), both @ joint @ both.T)
    with pytest.raises(ValueError, match="same sources"):
        propagation.error_budget(J, {"a": cov["a"]})
    with pytest.raises(ValueError, match="b: a Jacobian"):
        propagation.error_budget(J, {"a": cov["a"], "b": np.eye(3)})
