"""Distances and leave-one-out, against fits that were really made without the block."""

import numpy as np
import pytest
from scipy import stats

from labkit.estimation.influence import (
    VISIBLE,
    distance_limit,
    free_directions,
    invert_normal,
    leave_out,
    shares,
    squared_distances,
    visible_errors,
)

RNG = np.random.default_rng(3)
N, K, P = 12, 3, 5
J = RNG.normal(size=(N, K, P))
Y = RNG.normal(size=(N, K))


def fit(kept):
    return np.linalg.lstsq(J[kept].reshape(-1, P), Y[kept].ravel(), rcond=None)[0]


def test_leaving_one_out_equals_the_fit_without_it():
    x = fit(np.arange(N))
    predicted, shifts = leave_out(J @ x - Y, J)
    for i in range(N):
        without = fit(np.delete(np.arange(N), i))
        assert np.allclose(predicted[i], J[i] @ without - Y[i])
        assert np.allclose(shifts[i], without - x)


def test_leaving_a_group_out_equals_the_fit_without_it():
    groups, x = np.repeat([7, 3, 5], 4), fit(np.arange(N))
    predicted, shifts = leave_out(J @ x - Y, J, groups)
    for row, label in enumerate((3, 5, 7)):
        without = fit(np.flatnonzero(groups != label))
        assert np.allclose(predicted[groups == label], (J @ without - Y)[groups == label])
        assert np.allclose(shifts[row], without - x)


def test_distances_follow_chi_square_fitted_or_not():
    kept = np.arange(N) < 8
    rng, samples = np.random.default_rng(4), []
    for _ in range(2000):
        y = rng.normal(size=(N, K))
        x = np.linalg.lstsq(J[kept].reshape(-1, P), y[kept].ravel(), rcond=None)[0]
        samples.append(squared_distances(J @ x - y, J, kept))
    for i in range(N):  # deterministic: the seed is fixed
        assert stats.kstest(np.array(samples)[:, i], "chi2", args=(K,)).pvalue > 1e-4
    assert np.isclose(distance_limit(3, 10**9, 0.99), stats.chi2.ppf(0.99, 3), rtol=1e-6)


def test_what_stays_undetermined_is_refused_or_unknown():
    flat = J.copy()
    flat[..., 0] = 0
    with pytest.raises(ValueError, match="so it is not determined"):
        leave_out(Y, flat)
    flat[..., 0] = flat[..., 1]
    with pytest.raises(ValueError, match="undetermined"):
        leave_out(Y, flat)
    alone = J.copy()
    alone[1:, :, 0] = 0  # the first block alone fixes the first parameter
    predicted, shifts = leave_out(Y, alone)
    assert np.isnan(predicted[0]).all() and np.isnan(shifts[0]).all() and np.isfinite(predicted[1:]).all()


def test_an_error_of_the_visible_size_is_seen_four_times_in_five():
    """20000 fixed draws each way; five standard deviations of a share are 1.4 % and 0.1 %."""
    rng, i = np.random.default_rng(6), 3
    J = rng.normal(size=(9, 3))
    project = np.eye(9) - J @ np.linalg.inv(J.T @ J) @ J.T
    size = visible_errors(J)[i]
    noise = rng.normal(size=(20_000, 9))
    scores = [(noise + d * np.eye(9)[i]) @ project[:, i] / np.sqrt(project[i, i]) for d in (0.0, size)]
    suspected, seen = (np.mean(np.abs(score) > stats.norm.isf(0.0005)) for score in scores)
    assert abs(seen - 0.8) < 0.015 and abs(suspected - 0.001) < 0.0012
    assert abs(VISIBLE - 4.1321) < 1e-4 and np.allclose(visible_errors(J, 2 * VISIBLE), 2 * visible_errors(J))


def test_a_number_that_alone_fixes_a_parameter_hides_every_error():
    J = np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 2.0]])
    assert np.isfinite(visible_errors(J)[:2]).all() and np.isinf(visible_errors(J)[2])


def test_shares_are_traces_of_the_projection_on_what_the_parameters_reach():
    Q = np.linalg.qr(J.reshape(-1, P))[0].reshape(N, K, P)
    np.testing.assert_allclose(shares(J), (Q**2).sum((1, 2)), atol=1e-12)
    assert shares(J).sum() == pytest.approx(P)


def test_free_directions_change_no_residual_and_are_as_many_as_the_rank_lacks():
    """Parameters of very different size; two of them known only by their sum, one not at all."""
    scale = np.array([1e-4, 1.0, 1e5, 3.0, 1.0])
    flat = J.reshape(-1, P).copy()
    flat[:, 3], flat[:, 4] = flat[:, 1], 0
    flat = flat / scale
    free = free_directions(flat.T @ flat)
    assert free.shape == (P, 2)
    np.testing.assert_allclose(flat @ free, 0, atol=1e-7)
    assert np.linalg.matrix_rank(free / scale[:, None]) == 2
    assert free_directions((J.reshape(-1, P) / scale).T @ (J.reshape(-1, P) / scale)).shape == (P, 0)


def test_two_parameters_that_are_nearly_one_are_told_apart_down_to_a_trillionth():
    """Eigenvalues 1 - c and 1 + c: refused where the first is below 1e-12 of the second."""
    for gap, refused in ((1.5e-12, True), (3e-12, False)):
        N = np.array([[1.0, 1 - gap], [1 - gap, 1.0]])
        if refused:
            with pytest.raises(ValueError, match="leave a direction"):
                invert_normal(N)
        else:
            np.testing.assert_allclose(invert_normal(N) * gap, [[0.5, -0.5], [-0.5, 0.5]], rtol=1e-3)
