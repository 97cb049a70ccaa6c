"""Systematic resampling without a search draws what the textbook's draws."""

import numpy as np
import pytest

from labkit.fast import particles as fast
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
