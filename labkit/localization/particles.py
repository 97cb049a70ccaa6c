"""Clouds of poses: how they move, how they are drawn anew from their weights, and what they say.

States are planar poses (M, 3): x, y, theta in m and rad.
Source: lecture "Lokalisierung", "Monte-Carlo-Lokalisierung".
"""

import math
from dataclasses import dataclass

import numpy as np

from ..checks import (
    as_count,
    as_covariances,
    as_finite,
    as_floats,
    as_number,
    as_points,
    as_positive_number,
    as_shape,
    shown,
)
from ..geometry.planar import wrap_angle
from . import odometry

CONTROL_NOISE = {  # variances per way as the lecture prints them: (5 cm)^2 per m, (5 deg)^2 per turn, (2 deg)^2 per m
    "k_d": 0.05**2 / 1.0,
    "k_theta": math.radians(5.0) ** 2 / math.radians(360.0),
    "k_drift": math.radians(2.0) ** 2 / 1.0,
}
_BIN_TURN, _MODE_TURN = math.radians(15), math.radians(30)


def sample_motion(states, u, dt, rng, cov_u=None, model="midpoint"):
    """Each particle moved by its own noisy copy of the control.

    Parameters
    ----------
    states : array-like, shape (M, 3)
    u : array-like, shape (2,)
        v (m/s) and omega (rad/s).
    dt : float
        Time step (s).
    rng : numpy.random.Generator
    cov_u : array-like, shape (2, 2), optional
        Covariance of the control; by default `control_covariance` with the lecture's constants, so a standing
        robot's cloud stands still.
    model : str
        One of chapter 7's motion models: "euler", "midpoint", "arc".

    Source: lecture, "Bewegungsmodell": noise of covariance Sigma_u is added to the control, then f is applied.
    """
    states, u = as_points(states, "states"), as_points(u, "u", dim=2)
    cov_u = odometry.control_covariance(u, dt, **CONTROL_NOISE) if cov_u is None else as_covariances(cov_u, "cov_u", 2)
    if u.shape != (2,) or cov_u.shape != (2, 2):
        raise ValueError(f"u and cov_u must have shapes (2,) and (2, 2), got {u.shape} and {cov_u.shape}")
    noise = rng.standard_normal((*states.shape[:-1], 2)) @ _root(cov_u).T
    return odometry.step(states, u + noise, dt, model)


def _root(cov):
    """A matrix whose square (times its transpose) is `cov`; also for a singular covariance."""
    if cov[0, 1] == 0 == cov[1, 0]:
        return np.diag(np.sqrt(np.diagonal(cov)))
    values, vectors = np.linalg.eigh(cov)
    return vectors * np.sqrt(np.maximum(values, 0.0))


# --- weights and resampling ------------------------------------------------------------------------------------------


def normalize_weights(log_weights):
    """Weights that add up to 1 from their logarithms, (M,); the largest is subtracted first, so that it becomes exp(0).

    Raises ValueError when every weight is zero (all logarithms -inf): no particle explains the measurement.
    """
    log_weights = as_floats(log_weights, "log_weights")
    if log_weights.ndim != 1 or not log_weights.size or np.isnan(log_weights).any() or (log_weights == np.inf).any():
        raise ValueError(f"log_weights must be a vector of numbers or -inf, got shape {log_weights.shape} or NaN in it")
    top = log_weights.max()
    if top == -np.inf:
        raise ValueError("log_weights are all -inf: no particle explains the measurement, every weight is zero")
    weights = np.exp(log_weights - top)
    return weights / weights.sum()


def _as_weights(weights):
    weights = as_finite(weights, "weights")
    if weights.ndim != 1 or not weights.size:
        raise ValueError(f"weights must be a vector (M,), got shape {weights.shape}")
    low, high = weights.min(), weights.max()
    if low < 0 or not 1e-300 <= high <= 1e300:  # beyond, their sum or a share of it leaves the range of a float
        raise ValueError(
            "weights must be at least 0 and not all 0, the largest from 1e-300 to 1e300, "
            f"got {shown(low)} to {shown(high)}"
        )
    return weights


def resample_roulette(weights, rng, size=None):
    """Indices drawn independently with probability w / sum(w): one spin of the wheel per particle, O(M log M).

    weights: (M,), at least 0, of any sum. size: number of draws, M by default. The indices come in rising order:
    sorted spins find their interval several times faster, as the search stays in the cache.
    Source: lecture, "Resampling mit Roulette-Rad-Verfahren".
    """
    weights = _as_weights(weights)
    ends = np.cumsum(weights)
    spins = np.sort(rng.random(len(weights) if size is None else as_count(size, "size", at_least=0))) * ends[-1]
    last = np.searchsorted(ends, ends[-1])  # a spin may round up to the full circle
    return np.minimum(np.searchsorted(ends, spins, side="right"), last)


def resample_systematic(weights, rng, size=None):
    """Indices by one turn of a wheel with evenly spaced spokes: O(M), and equal weights give every particle once.

    A particle of weight w is drawn either floor(M w / W) or ceil(M w / W) times. weights, size: as for
    `resample_roulette`.
    Source: lecture, "Resampling mit Speichenrad-Verfahren".
    """
    weights = _as_weights(weights)
    size = len(weights) if size is None else as_count(size, "size", at_least=0)
    ends = np.cumsum(weights)
    ends *= size / ends[-1]
    full = ends >= ends[-1]
    ends -= rng.random()
    spokes = np.ceil(ends, out=ends).astype(np.intp)  # how many spokes point at this particle or an earlier one
    spokes[full] = size
    return np.repeat(np.arange(len(weights)), np.diff(spokes, prepend=0))


def effective_size(weights):
    """sum(w)^2 / sum(w^2): M for equal weights, 1 when one particle has them all."""
    weights = _as_weights(weights)
    weights = weights / weights.max()  # else the squares of tiny or huge weights leave the range of a float
    return float(weights.sum() ** 2 / np.square(weights).sum())


def should_resample(weights, threshold=0.5):
    """True when the effective size has fallen below `threshold` times the number of particles.

    Source: lecture, "Diversitaet der Partikelmenge": resample only when the variance of the weights is high. For
    weights w of mean 1,
    M / effective_size = 1 + variance(w): the same rule in other words.
    """
    return effective_size(weights) < as_number(threshold, "threshold") * len(weights)


def count_ancestors(resample, n_particles, n_steps, rng):
    """How many of the first particles survive when a standing robot resamples equal weights again and again:
    (n_steps + 1,)."""
    n_particles, n_steps = as_count(n_particles, "n_particles"), as_count(n_steps, "n_steps", at_least=0)
    names, weights = np.arange(n_particles), np.full(n_particles, 1.0 / n_particles)
    left = [n_particles]
    for _ in range(n_steps):
        names = names[resample(weights, rng)]
        left.append(len(np.unique(names)))
    return np.array(left)


# --- from cloud to pose ----------------------------------------------------------------------------------------------


def _weights_of(states, weights):
    """Weights of as many states, all 1 when not given."""
    weights = np.ones(len(states)) if weights is None else _as_weights(weights)
    if len(weights) != len(states) or not len(states):
        raise ValueError(f"there must be one weight a state and at least one state, got {len(weights)}, {len(states)}")
    return weights


def circular_mean(angles, weights=None):
    """Mean direction (rad, in [-pi, pi)): the angle of the weighted mean of the unit vectors (cos, sin).

    Raises ValueError when the vectors cancel: then no direction is the mean.
    """
    angles = as_shape(angles, "angles", "M")
    weights = _weights_of(angles, weights)
    c, s = _mean_vector(angles, weights)
    if np.hypot(c, s) <= 1e-12 * weights.sum():
        raise ValueError("angles must not cancel: their unit vectors add up to nothing, so no direction is their mean")
    return float(np.arctan2(s, c))


def _mean_vector(angles, weights):
    return weights @ np.cos(angles), weights @ np.sin(angles)


@dataclass(frozen=True)
class Estimate:
    """What a cloud says: pose (3,), covariance (3, 3) and the share of the weight that it rests on."""

    pose: np.ndarray
    covariance: np.ndarray
    share: float = 1.0


def estimate(states, weights=None):
    """Mean pose and covariance of the whole cloud; the heading is averaged on the circle. Misleading for a cloud
    with two modes."""
    states = as_points(states, "states").reshape(-1, 3)
    weights = _weights_of(states, weights)
    w = weights / weights.sum()
    x, y, theta = states.T
    c, s = _mean_vector(theta, w)
    heading = np.arctan2(s, c) if np.hypot(c, s) > 1e-9 else 0.0  # headings that cancel have no mean
    pose = np.array([w @ x, w @ y, heading])
    deviation = states - pose
    deviation[:, 2] = wrap_angle(deviation[:, 2])
    return Estimate(pose, (deviation.T * w) @ deviation)


def estimate_mode(states, weights=None, cell=0.5, turn=_MODE_TURN):
    """Mean of the heaviest cluster alone: the heaviest bin of `cell` m and `turn` rad, with its neighbors.

    For a cloud with two modes the mean of all lies between them, maybe in a wall; this one lies in the better mode.
    """
    states = as_points(states, "states").reshape(-1, 3)
    weights = _weights_of(states, weights)
    _, index = np.unique(pose_bins(states, cell, turn), return_inverse=True)
    heavy = states[index == np.argmax(np.bincount(index, weights))]
    center = estimate(heavy).pose
    near = np.hypot(*(states[:, :2] - center[:2]).T) < 1.5 * cell
    near &= np.abs(wrap_angle(states[:, 2] - center[2])) < 1.5 * turn
    part = estimate(states[near], weights[near])
    return Estimate(part.pose, part.covariance, float(weights[near].sum() / weights.sum()))


def pose_bins(states, cell=0.5, turn=_BIN_TURN):
    """One whole number for each pose, (M, 3) -> (M,), equal for poses in the same bin of `cell` m and `turn` rad."""
    states, cell, turn = as_points(states, "states"), as_positive_number(cell, "cell"), as_positive_number(turn, "turn")
    i, j = np.floor(states[..., 0] / cell).astype(np.int64), np.floor(states[..., 1] / cell).astype(np.int64)
    k = np.floor((states[..., 2] % (2 * np.pi)) / turn).astype(np.int64)
    return (i << 40) + (j << 16) + k


def kld_size(n_bins, epsilon=0.05, quantile=2.326):
    """Particles needed so that, with the probability of the normal `quantile`, the Kullback-Leibler error stays
    below epsilon.

    n_bins: number of bins the cloud occupies (any shape). The chi-square quantile is Wilson and Hilferty's
    approximation.
    """
    n_bins, quantile = as_finite(n_bins, "n_bins"), as_number(quantile, "quantile")
    epsilon = as_positive_number(epsilon, "epsilon")
    k = np.maximum(n_bins - 1, 1e-9)
    a = 2 / (9 * k)
    size = np.ceil(k / (2 * epsilon) * (1 - a + np.sqrt(a) * quantile) ** 3)
    return np.where(n_bins > 1, size, 1.0)


def kld_take(states, n_min=100, epsilon=0.05, quantile=2.326, cell=0.5, turn=_BIN_TURN):
    """How many of randomly ordered particles (M, 3) are enough: the first n with n >= kld_size(bins among the first
    n)."""
    bins, n_min = pose_bins(as_shape(states, "states", "M", 3), cell, turn), as_count(n_min, "n_min", at_least=0)
    _, first = np.unique(bins, return_index=True)
    is_new = np.zeros(len(bins), dtype=int)
    is_new[first] = 1
    n = np.arange(1, len(bins) + 1)
    enough = n >= np.maximum(kld_size(np.cumsum(is_new), epsilon, quantile), n_min)
    return int(np.argmax(enough)) + 1 if enough.any() else len(bins)


def uniform_states(grid, n_particles, rng):
    """Poses (n, 3) spread evenly over the free cells of a map and over all headings."""
    i, j = np.nonzero(grid.free)
    if not len(i):
        raise ValueError("grid must have at least one free cell, got none: there is no place for a particle")
    n_particles = as_count(n_particles, "n_particles", at_least=0)
    pick = rng.integers(len(i), size=n_particles)
    xy = grid.center_of(i[pick], j[pick]) + grid.resolution * (rng.random((n_particles, 2)) - 0.5)
    return np.column_stack([xy, rng.uniform(-np.pi, np.pi, n_particles)])
