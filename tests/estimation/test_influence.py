"""Distances and leave-one-out, against fits that were really made without the block."""

import numpy as np
import pytest
from scipy import stats

from labkit.estimation.influence import distance_limit, leave_out, squared_distances

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
    samples = []
    for _ in range(2000):
        y = RNG.normal(size=(N, K))
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
