"""The fast linear filter equals the readable one on series long and short, well and badly scaled; it refuses alike."""

from dataclasses import fields

import numpy as np
import pytest

from labkit.estimation import kalman
from labkit.fast import kalman as fast
from labkit.fast.kalman import filter_steps

Z = np.random.default_rng(3).normal(size=(400, 1)).cumsum(0)


def random_covariance(rng, n):
    M = rng.normal(size=(n, n))
    return M @ M.T + 0.1 * np.eye(n)


def system(n, seed=0):
    """A chain of n integrators of which the first is measured: A, C, x0, cov0, cov_v."""
    rng = np.random.default_rng(seed)
    A = np.eye(n) + 0.1 * np.eye(n, k=1)
    return A, np.eye(n)[:1], rng.normal(size=n), random_covariance(rng, n), 0.01 * random_covariance(rng, n)


def assert_equal(*given, rtol=1e-9, **more):
    """Every array of both results, compared to its largest entry."""
    found, expected = filter_steps(*given, **more), kalman.filter_steps(*given, **more)
    for field in fields(kalman.Corrected):
        a, b = getattr(found, field.name), getattr(expected, field.name)
        assert a.shape == b.shape and a.dtype == b.dtype
        np.testing.assert_allclose(a, b, rtol=0, atol=rtol * np.abs(b).max(initial=1e-300), err_msg=field.name)
    return found


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_equals_the_readable_filter(n):
    A, C, x0, cov0, cov_v = system(n)
    for steps in (400, 3, 2, 1, 0):
        assert_equal(Z[:steps], A, C, [[0.04]], x0, cov0, cov_v=cov_v)


@pytest.mark.parametrize("n", [2, 3])
def test_equals_it_where_little_or_nothing_is_certain(n):
    A, C, x0, cov0, cov_v = system(n)
    assert_equal(Z, A, C, [[0.04]], x0, cov0)  # no noise of the system: the gain never settles
    assert_equal(Z, A, C, [[0.04]], x0, 0 * cov0, cov_v=cov_v)  # the start is known
    assert_equal(Z, A, C, [[0.04]], x0, 0 * cov0)  # all is known: nothing is corrected
    assert_equal(Z, A, C, [[1e-3]], x0, 1e6 * cov0, cov_v=cov_v, rtol=1e-8)  # a poor start, a precise sensor
    assert_equal(Z, A, C, [[0.0]], x0, cov0, cov_v=cov_v)  # a perfect sensor
    unseen = assert_equal(Z, np.eye(n), C, [[0.04]], x0, np.eye(n), cov_v=0.1 * np.eye(n))
    np.testing.assert_allclose(unseen.cov[-1, -1, -1], 1 + 0.1 * len(Z))  # what is not seen grows, settled gain or not


@pytest.mark.parametrize("n", [2, 3])
def test_a_covariance_whose_sign_alone_changes_is_not_settled(n):
    """Nothing is seen, and the second state turns over at every step: its variance stays, its covariances do not."""
    A, cov0 = np.diag([1.0, -1.0, 1.0])[:n, :n], 0.5 * (np.eye(n) + 1)
    found = assert_equal(Z[:20], A, np.zeros((1, n)), [[0.04]], np.zeros(n), cov0)
    np.testing.assert_array_equal(found.cov[:, 0, 1], np.tile([-0.5, 0.5], 10))


@pytest.mark.parametrize("n", [2, 3])
def test_equals_it_where_every_state_moves_every_other(n):
    """A full transition, turning and slightly damped, and a sensor that sees a bit of everything."""
    rng = np.random.default_rng(n)
    turn = np.linalg.qr(rng.normal(size=(n, n)))[0]
    _, _, x0, cov0, cov_v = system(n)
    assert np.abs(turn).min() > 0.05
    assert_equal(Z, 0.97 * turn, rng.uniform(0.5, 1, (1, n)), [[0.04]], x0, cov0, cov_v=cov_v)


def test_equals_it_on_single_precision_and_whole_numbers():
    A, C, x0, cov0, cov_v = (part.astype(np.float32) for part in system(2))
    found = assert_equal(Z.astype(np.float32), A, C, np.float32([[0.04]]), x0, cov0, cov_v=cov_v)
    assert found.x.dtype == np.float64
    assert_equal(np.arange(50)[:, None], [[1, 1], [0, 1]], [[1, 0]], [[1]], [0, 0], np.eye(2, dtype=int), cov_v=cov_v)


def test_hands_over_what_it_does_not_tune():
    A, C, x0, cov0, cov_v = system(2)
    gaps = np.where(np.arange(400)[:, None] % 7, Z, np.nan)
    assert assert_equal(gaps, A, C, [[0.04]], x0, cov0, cov_v=cov_v).dof.sum() == 400 - 58
    assert_equal(Z, A, C, [[0.04]], x0, cov0, B=[[0.0], [0.1]], u=[2.0], cov_u=[[0.3]])
    assert_equal(np.hstack([Z, Z]), A, np.eye(2), 0.04 * np.eye(2), x0, cov0, cov_v=cov_v)


@pytest.mark.parametrize(
    "z, C, cov_z, x0",
    [
        ([1.0], [[1.0, 0.0]], [[1.0]], [0.0, 0.0]),
        ([[np.inf]], [[1.0, 0.0]], [[1.0]], [0.0, 0.0]),
        ([[1.0]], [[1.0]], [[1.0]], [0.0, 0.0]),
        ([[1.0]], [[1.0, 0.0]], [[-1.0]], [0.0, 0.0]),
        ([[1.0]], [[1.0, 0.0]], [[1.0]], [0.0, np.nan]),
        ([[1.0]], [[0.0, 0.0]], [[0.0]], [0.0, 0.0]),
    ],
)
def test_refuses_in_the_same_words(z, C, cov_z, x0):
    said = []
    for filter_ in (kalman.filter_steps, filter_steps):
        with pytest.raises(ValueError) as refusal:
            filter_(z, np.eye(2), C, cov_z, x0, np.eye(2))
        said.append(str(refusal.value))
    assert said[0] == said[1]


def test_a_huge_prior_leaves_no_rounding_behind():
    """Nine digits of every entry, though what is left of the measured velocity is a billionth of the prior (Joseph)."""
    for size in (1e6, 3e6, 7e6):
        for seen, measured in (([[0.0, 1.0]], np.s_[:]), ([[1.0, 0.0]], np.s_[:, 0, 0])):
            given = Z[:3], system(2)[0], seen, [[1e-3]], np.zeros(2), size * np.diag([1.1, 1.3])
            one, other = filter_steps(*given).cov[measured], kalman.filter_steps(*given).cov[measured]
            np.testing.assert_allclose(one, other, rtol=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_two_states_settle_when_any_number_of_them_does(seed):
    """At the first step whose covariance differs by no more than the tolerance, beside its standard deviations."""
    A, C, x0, cov0, cov_v = system(2, seed)
    given = Z[:, 0], A, C[0], cov_v, 0.04, x0, cov0
    one, other = fast._until_settled(*given), fast._until_settled_2(*given)
    assert len(one[0]) == len(other[0]) < 300
    covs = kalman.filter_steps(Z, A, C, [[0.04]], x0, cov0, cov_v=cov_v).cov
    std = np.sqrt(np.diagonal(covs, axis1=1, axis2=2))
    close = (np.abs(np.diff(covs, axis=0)) <= fast.SETTLED * std[1:, :, None] * std[1:, None]).all((1, 2))
    assert abs(len(one[0]) - (np.argmax(close) + 2)) <= 1  # the last bits may move it by a step
