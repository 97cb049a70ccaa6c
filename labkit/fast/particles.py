"""Systematic resampling without a search; equals `localization.particles.resample_systematic`."""

import numpy as np

from ..checks import as_count
from ..localization.particles import as_weights


def resample_systematic(weights, rng, size=None):
    """As `localization.particles.resample_systematic`, of the same random number.

    Counts the spokes that point at each particle or an earlier one, which takes rounding up in place of a search.
    """
    weights = as_weights(weights)
    size = len(weights) if size is None else as_count(size, "size", at_least=0)
    ends = np.cumsum(weights)
    ends *= size / ends[-1]
    full = ends >= ends[-1]
    ends -= rng.random()
    spokes = np.ceil(ends, out=ends).astype(np.intp)
    spokes[full] = size
    return np.repeat(np.arange(len(weights)), np.diff(spokes, prepend=0))
