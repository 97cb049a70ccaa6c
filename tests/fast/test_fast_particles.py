"""Clouds of many particles move and are drawn anew as the textbook's are, of the same normal and random numbers."""

import numpy as np
import pytest
from scipy import stats

from labkit.fast import particles as fast
from labkit.localization import odometry
from labkit.localization import particles as plain


@pytest.mark.parametrize("dtype", [float, np.float32])
@pytest.mark.parametrize("size", [None, 0, 1, 7, 3000])
def test_both_draw_the_same(dtype, size):
    """The same random number; only a spoke within rounding of a sector's end may point at its neighbor."""
    rng = np.random.default_rng(1)
    for weights in (rng.exponential(size=1000) ** 2, np.ones(50), np.array([0.0, 3.0, 0.0]), [0, 0, 1e-200, 1e-200]):
        weights = np.asarray(weights).astype(dtype) if np.max(weights) > 1e-30 else np.asarray(weights)
        a = fast.resample_systematic(weights, np.random.default_rng(2), size)
        b = plain.resample_systematic(weights, np.random.default_rng(2), size)
        assert a.shape == b.shape and np.abs(a - b).sum() <= 1
        assert (weights[a] > 0).all() and (weights[b] > 0).all()


class SameNormals(np.random.Generator):
    """Hands the textbook the normal numbers that the fast twin draws."""

    def standard_normal(self, shape):
        return fast.normal_pairs(np.random.Generator(self.bit_generator), int(np.prod(shape[:-1]))).T.reshape(shape)


@pytest.mark.parametrize("dtype", [float, np.float32])
@pytest.mark.parametrize("model", odometry.MODELS)
def test_both_move_alike(dtype, model):
    """All directions, the half turn and many turns included; singular and full covariances; a single state."""
    rng = np.random.default_rng(4)
    turns = np.append(rng.uniform(-40, 40, 300), np.pi * np.array([1, -1, 3, 0.5, 0, 2, -7]))
    states = np.column_stack([rng.uniform(-9, 9, (307, 2)), turns]).astype(dtype)
    for cov in (np.zeros((2, 2)), np.diag([0.04, 0.0]), [[0.04, 0.01], [0.01, 0.09]], np.full((2, 2), 0.04)):
        for u, shape in (([1.5, -0.4], (307, 3)), ([-2.0, 0.0], (307, 1, 3)), ([0.0, 5.0], (307, 3))):
            a, b = (
                module.sample_motion(states.reshape(shape), u, 0.3, SameNormals(np.random.PCG64(5)), cov, model)
                for module in (fast, plain)
            )
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-13)
    assert fast.sample_motion(states[0], [1, 0], 0.1, rng, np.eye(2), model).shape == (3,)


def test_normal_pairs_are_normal_and_independent():
    """The whole distribution by SciPy's test, and products of powers up to the fourth within 6 standard errors.

    Under another stream of random numbers it would fail by chance with a probability of 2e-7.
    """
    x, y = pairs = fast.normal_pairs(np.random.default_rng(3), 100_000)
    assert min(stats.kstest(sample, "norm").pvalue for sample in pairs) > 5e-8
    for product, mean in ((x, 0), (y, 0), (x * x, 1), (y * y, 1), (x * y, 0), (x * x * y * y, 1), (x**4, 3), (y**4, 3)):
        assert abs(product.mean() - mean) < 6 * product.std() / np.sqrt(len(x))


def test_what_the_textbook_refuses_is_refused():
    good = {"states": np.zeros((4, 3)), "u": [1.0, 0.1], "dt": 0.1, "cov_u": np.eye(2), "model": "euler"}
    for wrong in ({"dt": 0.0}, {"model": "straight"}, {"u": [1.0]}, {"cov_u": -np.eye(2)}, {"states": np.zeros(4)}):
        said = []
        for module in (fast, plain):
            with pytest.raises(ValueError) as refusal:
                module.sample_motion(rng=np.random.default_rng(1), **{**good, **wrong})
            said.append(str(refusal.value))
        assert said[0] == said[1]
