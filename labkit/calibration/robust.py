"""Weights and scales that bad measurements cannot carry away.

Source: Huber, "Robust Statistics" (1981); Tukey's biweight after Beaton and Tukey (1974).
"""

import numpy as np

from ..checks import as_finite, as_positive_number, as_shape

MEDIAN_CHI3 = 1.5381722544550522  # median length of a vector of three standard normal components


def median_std(lengths):
    """Standard deviation of one coordinate from the median length of 3-vectors: half of them may be wrong.

    Parameters
    ----------
    lengths : array-like, shape (n,)
        How far each measurement misses (any unit).

    Returns
    -------
    std : float
        In the same unit.
    """
    lengths = as_shape(lengths, "lengths", "n")
    if not len(lengths):
        raise ValueError("lengths must hold at least one number, got none")
    return float(np.median(lengths)) / MEDIAN_CHI3


def tukey_weights(lengths, std, cut):
    """Tukey's weights (1 - (r / (cut std))^2)^2 of residual lengths r, 0 beyond the cut: far outliers have no say.

    Parameters
    ----------
    lengths : array-like, shape (...)
        How far each measurement misses (any unit).
    std : float
        Standard deviation of one coordinate of the good ones, in the same unit, positive.
    cut : float
        Where the weight ends, in standard deviations.

    Returns
    -------
    weights : array, shape (...)
        Between 0 and 1.

    Raises
    ------
    ValueError
        When std or cut is not positive.
    """
    std, cut = as_positive_number(std, "std"), as_positive_number(cut, "cut")
    return np.maximum(1 - (as_finite(lengths, "lengths") / (cut * std)) ** 2, 0.0) ** 2
