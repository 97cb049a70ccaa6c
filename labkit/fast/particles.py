"""Clouds of ten thousand particles moved and drawn anew.

Given the same random numbers, each equals its namesake in `localization.particles`; `sample_motion` draws its normal
ones in another way, `normal_pairs`.
"""

import math

import numpy as np

from ..checks import as_generator, as_positive, as_size, fit_together
from ..documented import documented, unchecked
from ..localization import odometry
from ..localization.particles import as_noisy_control, as_weights


def sample_motion(states, u, dt, rng, cov_u, model="midpoint"):
    """As `localization.particles.sample_motion`, of `normal_pairs`, on one coordinate after the other.

    Sine and cosine of the direction come from t, the tangent of half of it: 2 t / (1 + t^2) and (1 - t^2) / (1 + t^2).
    """
    states, u, root = as_noisy_control(states, u, cov_u)
    dt, model = as_positive(dt, "dt"), odometry.as_model(model)
    noise = root @ unchecked(normal_pairs)(as_generator(rng), states[..., 0].size)
    v, omega = (u[:, None] + noise).reshape(2, *states.shape[:-1])
    length, turn = unchecked(odometry.chord)(v, omega, dt, model)
    t = np.tan(0.5 * (states[..., 2] + turn))
    square = t * t
    length /= 1 + square
    moved = np.empty((*fit_together(states=states.shape[:-1], dt=dt.shape), 3))
    np.add(states[..., 0], length * (1 - square), out=moved[..., 0])
    np.add(states[..., 1], 2 * length * t, out=moved[..., 1])
    np.add(states[..., 2], omega * dt, out=moved[..., 2])
    return moved


@documented
def normal_pairs(rng, n):
    """Independent standard normal numbers as points of the plane, which is quicker than one by one.

    Half the squared distance from the middle is exponential and the direction uniform (Box and Muller). One of 16
    million directions is enough for a cloud: single precision makes sine and cosine quicker.

    Parameters
    ----------
    rng : numpy.random.Generator
    n : int
        At least 0.

    Returns
    -------
    array, shape (2, n)
    """
    n = as_size(n, "n", at_least=0)
    far, direction = rng.standard_exponential(n, dtype=np.float32), rng.random(n, dtype=np.float32)
    far *= 2
    np.sqrt(far, out=far)
    direction *= math.tau
    pairs = np.empty((2, n))
    np.multiply(far, np.cos(direction), out=pairs[0])
    np.multiply(far, np.sin(direction), out=pairs[1])
    return pairs


def resample_systematic(weights, rng, size=None):
    """As `localization.particles.resample_systematic`, of the same random number.

    Counts the spokes before the end of each particle's sector, which takes rounding up in place of a search. The index
    a spoke points at is how many sectors end before it.
    """
    weights = as_weights(weights)
    size = len(weights) if size is None else as_size(size, "size", at_least=0)
    ends = np.cumsum(weights)
    ends *= size / ends[-1]
    full = np.searchsorted(ends, ends[-1])
    ends -= as_generator(rng).random()
    spokes = np.ceil(ends, out=ends).astype(np.intp)
    spokes[full:] = size
    return np.cumsum(np.bincount(spokes, minlength=size)[:size])
