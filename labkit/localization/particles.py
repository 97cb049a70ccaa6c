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
    as_generator,
    as_indices,
    as_number,
    as_points,
    as_positive_number,
    as_shape,
    as_size,
    shown,
)
from ..documented import documented
from ..geometry.planar import wrap_angle
from . import odometry

_BIN_TURN, _MODE_TURN = math.radians(15), math.radians(30)

# --- motion ----------------------------------------------------------------------------------------------------------


@documented
def sample_motion(states, u, dt, rng, cov_u, model="midpoint"):
    """Each particle moved by its own noisy copy of the control.

    Parameters
    ----------
    states : array-like, shape (..., 3)
        x, y, theta (m, m, rad).
    u : array-like, shape (2,)
        v (m/s) and omega (rad/s).
    dt : float
        Time step (s).
    rng : numpy.random.Generator
    cov_u : array-like, shape (2, 2)
        Covariance of the control, (m/s)^2 and (rad/s)^2.
    model : str
        One of `odometry.MODELS`.

    Returns
    -------
    array, shape (..., 3)

    Raises
    ------
    ValueError
        Wrong shapes, a negative variance, a time step that is not positive, an unknown model.

    See Also
    --------
    odometry_motion
    labkit.fast.particles.sample_motion : the same for thousands of particles

    Source: lecture, "Bewegungsmodell": noise of covariance Sigma_u is added to the control, then f is applied.
    """
    states, u, root = as_noisy_control(states, u, cov_u)
    noise = rng.standard_normal((*states.shape[:-1], 2)) @ root.T
    return odometry.step(states, u + noise, dt, model)


def as_noisy_control(states, u, cov_u):
    """States and control of `sample_motion`, checked, and a root of `cov_u` (root root' = cov_u)."""
    states, u, cov_u = as_points(states, "states"), as_points(u, "u", dim=2), as_covariances(cov_u, "cov_u", 2)
    if u.shape != (2,) or cov_u.shape != (2, 2):
        raise ValueError(f"u and cov_u must have shapes (2,) and (2, 2), got {u.shape} and {cov_u.shape}")
    return states, u, _root(cov_u)


def odometry_motion(k_d, k_theta, k_drift, model="midpoint"):
    """The motion of particles whose controls are as uncertain as odometry says; a standing cloud stands still.

    Parameters
    ----------
    k_d, k_theta, k_drift : float
        Variances per way (m^2/m, rad^2/rad, rad^2/m), as for `odometry.control_covariance`.
    model : str
        One of `odometry.MODELS`.

    Returns
    -------
    function (states, u, dt, rng) -> states

    Source: lecture, "Fehlermodell fuer Steuerbefehl (1) to (3)".
    """

    def motion(states, u, dt, rng):
        return sample_motion(states, u, dt, rng, odometry.control_covariance(u, dt, k_d, k_theta, k_drift), model)

    return motion


def _root(cov):
    """A matrix whose square (times its transpose) is `cov`; also for a singular covariance."""
    if cov[0, 1] == 0 == cov[1, 0]:
        return np.diag(np.sqrt(np.diagonal(cov)))
    values, vectors = np.linalg.eigh(cov)
    return vectors * np.sqrt(np.maximum(values, 0.0))


# --- weights and resampling ------------------------------------------------------------------------------------------


def normalize_weights(log_weights):
    """Weights that add up to 1; the largest logarithm is subtracted first, so that it becomes exp(0).

    Parameters
    ----------
    log_weights : array-like, shape (M,)
        Numbers or -inf.

    Returns
    -------
    array, shape (M,)

    Raises
    ------
    ValueError
        When every weight is zero (all logarithms -inf): no particle explains the measurement.
    """
    log_weights = as_floats(log_weights, "log_weights")
    if log_weights.ndim != 1 or not log_weights.size or not (top := log_weights.max()) < np.inf:
        raise ValueError(f"log_weights must be a vector of numbers or -inf, got shape {log_weights.shape} or NaN in it")
    if top == -np.inf:
        raise ValueError("log_weights are all -inf: no particle explains the measurement, every weight is zero")
    weights = np.exp(log_weights - top)
    return weights / weights.sum()


def as_weights(weights):
    """`weights` as a vector (M,) of floats, at least 0 and not all 0; refuses what cannot be added up."""
    weights = as_finite(weights, "weights", below=math.inf)
    if weights.ndim != 1 or not weights.size:
        raise ValueError(f"weights must be a vector (M,), got shape {weights.shape}")
    low, high = weights.min(), weights.max()
    if low < 0 or not 1e-300 <= high <= 1e300:  # beyond, their sum or a share of it leaves the range of a float
        raise ValueError(
            "weights must be at least 0 and not all 0, the largest from 1e-300 to 1e300, "
            f"got {shown(low)} to {shown(high)}"
        )
    return weights


@documented
def resample_roulette(weights, rng, size=None):
    """Indices drawn independently with probability w / sum(w): one spin of the wheel per particle, O(M log M).

    Parameters
    ----------
    weights : array-like, shape (M,)
        At least 0, of any sum.
    rng : numpy.random.Generator
    size : int, optional
        Number of draws, M when not given.

    Returns
    -------
    array of int, shape (size,)
        In rising order: sorted spins find their interval several times faster, as the search stays in the cache.

    Raises
    ------
    ValueError
        A negative weight, or no weight above 0.

    Source: lecture, "Resampling mit Roulette-Rad-Verfahren".
    """
    weights = as_weights(weights)
    spins = np.sort(rng.random(len(weights) if size is None else as_size(size, "size", at_least=0)))
    return _pointed_at(weights, spins)


def resample_systematic(weights, rng, size=None):
    """Indices by one turn of a wheel with evenly spaced spokes: O(M), and equal weights give every particle once.

    A particle of weight w is drawn either floor(M w / W) or ceil(M w / W) times.

    Parameters
    ----------
    weights, rng, size
        As for `resample_roulette`.

    Returns
    -------
    array of int, shape (size,), in rising order

    Raises
    ------
    ValueError
        A negative weight, or no weight above 0.

    See Also
    --------
    labkit.fast.particles.resample_systematic : the same without a search

    Source: lecture, "Resampling mit Speichenrad-Verfahren".
    """
    weights = as_weights(weights)
    size = len(weights) if size is None else as_size(size, "size", at_least=0)
    return _pointed_at(weights, (np.arange(size) + as_generator(rng).random()) / max(size, 1))


def _pointed_at(weights, places):
    """The particles whose sectors hold these places of the wheel, 0 <= place < 1; none of weight zero."""
    ends = np.cumsum(weights)
    last = np.searchsorted(ends, ends[-1])  # a place may round up to the full circle
    return np.minimum(np.searchsorted(ends, places * ends[-1], side="right"), last)


def effective_size(weights):
    """How many equal weights these weights are worth: sum(w)^2 / sum(w^2).

    Parameters
    ----------
    weights : array-like, shape (M,)
        At least 0, of any sum.

    Returns
    -------
    float
        M for equal weights, 1 when one particle has them all.

    Raises
    ------
    ValueError
        A negative weight, or no weight above 0.
    """
    weights = as_weights(weights)
    weights = weights / weights.max()  # else the squares of tiny or huge weights leave the range of a float
    return float(weights.sum() ** 2 / np.square(weights).sum())


def should_resample(weights, threshold=0.5):
    """True when the effective size has fallen below `threshold` times the number of particles.

    The lecture says it in other words: for weights w of mean 1, M / effective_size = 1 + variance(w).

    Parameters
    ----------
    weights : array-like, shape (M,)
    threshold : float

    Returns
    -------
    bool

    Source: lecture, "Diversitaet der Partikelmenge": resample only when the variance of the weights is high.
    """
    return effective_size(weights) < as_number(threshold, "threshold") * len(weights)


@documented
def count_ancestors(resample, n_particles, n_steps, rng):
    """How many of the first particles survive when a standing robot resamples equal weights again and again.

    Parameters
    ----------
    resample : function (weights, rng) -> indices
    n_particles, n_steps : int
    rng : numpy.random.Generator

    Returns
    -------
    array of int, shape (n_steps + 1,)
    """
    n_particles, n_steps = as_size(n_particles, "n_particles"), as_size(n_steps, "n_steps", at_least=0)
    as_size(n_particles * n_steps, "n_particles times n_steps", at_least=0)
    names, weights = np.arange(n_particles), np.full(n_particles, 1.0 / n_particles)
    left = [n_particles]
    for _ in range(n_steps):
        names = names[as_indices(resample(weights, rng), "what resample returns")]
        left.append(len(np.unique(names)))
    return np.array(left)


# --- from cloud to pose ----------------------------------------------------------------------------------------------


def _weights_of(states, weights):
    """Weights of as many states, all 1 when not given."""
    weights = np.ones(len(states)) if weights is None else as_weights(weights)
    if len(weights) != len(states) or not len(states):
        raise ValueError(
            f"there must be one weight per state and at least one state, got {len(weights)}, {len(states)}"
        )
    return weights


def circular_mean(angles, weights=None):
    """Mean direction: the angle of the weighted mean of the unit vectors (cos, sin).

    Parameters
    ----------
    angles : array-like, shape (M,)
        rad.
    weights : array-like, shape (M,), optional
        All 1 when not given.

    Returns
    -------
    float
        rad, within [-pi, pi].

    Raises
    ------
    ValueError
        When the vectors cancel: then no direction is the mean.
    """
    angles = as_shape(angles, "angles", "M")
    weights = _weights_of(angles, weights)
    c, s = _mean_vector(angles, weights)
    if np.hypot(c, s) <= 1e-12 * weights.sum():
        raise ValueError("angles must not cancel: their unit vectors add up to nothing, so no direction is their mean")
    return float(np.arctan2(s, c))


def _mean_vector(angles, weights):
    return weights @ np.cos(angles), weights @ np.sin(angles)


@dataclass(frozen=True, eq=False)
class Estimate:
    """What a cloud says.

    Attributes
    ----------
    pose : array, shape (3,)
        x, y, theta (m, m, rad).
    covariance : array, shape (3, 3)
        Of x, y, theta.
    share : float
        The share of the weight that the pose rests on.
    """

    pose: np.ndarray
    covariance: np.ndarray
    share: float = 1.0


def estimate(states, weights=None):
    """Mean pose and covariance of the whole cloud; misleading for a cloud with two modes.

    Parameters
    ----------
    states : array-like, shape (M, 3)
    weights : array-like, shape (M,), optional
        All 1 when not given.

    Returns
    -------
    Estimate
        The heading is averaged on the circle; where the headings cancel it is 0.

    Raises
    ------
    ValueError
        No state, or not one weight per state.

    See Also
    --------
    estimate_mode, circular_mean
    """
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
    """Mean of the heaviest cluster alone: what lies near the middle of the heaviest bin.

    For a cloud with two modes the mean of all lies between them, maybe in a wall; this one lies in the better mode.

    Parameters
    ----------
    states : array-like, shape (M, 3)
    weights : array-like, shape (M,), optional
        All 1 when not given.
    cell, turn : float
        Size of the bins (m, rad).

    Returns
    -------
    Estimate

    See Also
    --------
    estimate, pose_bins
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


# --- how many particles ----------------------------------------------------------------------------------------------


def pose_bins(states, cell=0.5, turn=_BIN_TURN):
    """One whole number per pose, equal for poses in the same bin.

    Parameters
    ----------
    states : array-like, shape (..., 3)
    cell, turn : float
        Size of the bins (m, rad).

    Returns
    -------
    array of int, shape (...)

    Raises
    ------
    ValueError
        More than 65,536 bins to a turn.
    """
    states, cell, turn = as_points(states, "states"), as_positive_number(cell, "cell"), as_positive_number(turn, "turn")
    if turn < 1e-4:
        raise ValueError(f"turn must be at least 1e-4 rad, got {shown(turn)}")
    i, j = np.floor(states[..., 0] / cell).astype(np.int64), np.floor(states[..., 1] / cell).astype(np.int64)
    heading = states[..., 2] % (2 * np.pi) % (2 * np.pi)  # the remainder of -1e-17 is a whole turn; its own is 0
    k = np.floor(heading / turn).astype(np.int64)
    return (i << 40) + (j << 16) + k


def kld_size(n_bins, epsilon=0.05, quantile=2.326):
    """Particles needed so that the Kullback-Leibler error stays below epsilon.

    Parameters
    ----------
    n_bins : array-like, any shape
        Number of bins the cloud occupies.
    epsilon : float
    quantile : float
        Normal quantile of the probability with which it does; 2.326 is 99 %.

    Returns
    -------
    array, shape of n_bins
        With Wilson and Hilferty's approximation of the chi-square quantile.

    Raises
    ------
    ValueError
        epsilon is not positive.

    Source: beyond the lecture (KLD sampling).
    """
    n_bins, quantile = as_finite(n_bins, "n_bins"), as_number(quantile, "quantile")
    epsilon = as_positive_number(epsilon, "epsilon")
    k = np.maximum(n_bins - 1, 1e-9)
    a = 2 / (9 * k)
    size = np.ceil(k / (2 * epsilon) * (1 - a + np.sqrt(a) * quantile) ** 3)
    return np.where(n_bins > 1, size, 1.0)


@dataclass(frozen=True, eq=False)
class KldSampling:
    """A number of particles that adapts: as many as the bins that the cloud occupies ask for.

    Parameters
    ----------
    n_min : int
        Never fewer, if there are so many.
    epsilon, quantile : float
        As for `kld_size`.
    cell, turn : float
        Size of the bins (m, rad).

    Source: beyond the lecture (KLD sampling).
    """

    n_min: int = 100
    epsilon: float = 0.05
    quantile: float = 2.326
    cell: float = 0.5
    turn: float = _BIN_TURN

    def enough(self, states):
        """How many of randomly ordered particles (M, 3) are enough: the first n >= kld_size(bins among the first n)."""
        bins = pose_bins(as_shape(states, "states", "M", 3), self.cell, self.turn)
        n_min = as_count(self.n_min, "n_min", at_least=0)
        _, first = np.unique(bins, return_index=True)
        is_new = np.zeros(len(bins), dtype=int)
        is_new[first] = 1
        n = np.arange(1, len(bins) + 1)
        enough = n >= np.maximum(kld_size(np.cumsum(is_new), self.epsilon, self.quantile), n_min)
        return int(np.argmax(enough)) + 1 if enough.any() else len(bins)


@documented
def uniform_states(grid, n_particles, rng):
    """Poses spread evenly over the free cells of a map and over all headings.

    Parameters
    ----------
    grid : maps.OccupancyGrid
    n_particles : int
    rng : numpy.random.Generator

    Returns
    -------
    array, shape (n_particles, 3)

    Raises
    ------
    ValueError
        When no cell is free.
    """
    i, j = np.nonzero(grid.free)
    if not len(i):
        raise ValueError("grid must have at least one free cell, got none: there is no place for a particle")
    n_particles = as_size(n_particles, "n_particles", at_least=0)
    pick = rng.integers(len(i), size=n_particles)
    xy = grid.center_of(i[pick], j[pick]) + grid.resolution * (rng.random((n_particles, 2)) - 0.5)
    return np.column_stack([xy, rng.uniform(-np.pi, np.pi, n_particles)])
