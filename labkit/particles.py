"""Monte-Carlo localization: a cloud of poses that is moved, weighed and redrawn.

States are planar poses (M, 3): x, y, theta in m and rad. A sensor model takes one measurement and returns a
`Weighting`, a function of the states that gives the *logarithm* of each weight: a product of many small densities is
a sum that cannot underflow.
Source: lecture "Lokalisierung", "Monte-Carlo-Lokalisierung".
"""

import math
from collections import deque
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import ndtr

from . import odometry
from .checks import (
    as_count,
    as_covariances,
    as_finite,
    as_floats,
    as_nonnegative,
    as_number,
    as_points,
    as_positive_number,
    as_shape,
    fit_together,
)
from .maps import LikelihoodField, RangeTable, Scanner, cast_rays
from .odometry import wrap_angle
from .tables import read_table

CONTROL_NOISE = {  # variances per way as the lecture prints them: (5 cm)^2 per m, (5 deg)^2 per turn, (2 deg)^2 per m
    "k_d": 0.05**2 / 1.0,
    "k_theta": math.radians(5.0) ** 2 / math.radians(360.0),
    "k_drift": math.radians(2.0) ** 2 / 1.0,
}
SENSORS = ("landmarks", "beams", "likelihood field")
MIN_INJECTED = 0.1  # with recovery some random poses always look around: a wrong place may fit fairly well
MAX_INJECTED = 0.5  # share of the cloud that one step may replace: the rest must be able to hold on to what is right
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


# --- sensor models ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Weighting:
    """One measurement as a function of the states: (M, 3) -> log weights (M,).

    best: log weight of a state that fits perfectly; the yardstick by which recovery judges how bad the cloud has
    become.
    """

    function: object
    best: float = 0.0

    def __call__(self, states):
        return self.function(states)


def weigh_landmarks(z, landmarks, std_range=None, std_bearing=None):
    """Weighting by ranges and bearings to known landmarks.

    Parameters
    ----------
    z : array-like, shape (m, 2)
        Measured range (m) and bearing (rad) of each landmark that is seen.
    landmarks : array-like, shape (m, 2)
        The positions of the landmarks seen, in the same order.
    std_range, std_bearing : float, optional
        Standard deviations (m, rad). Leave one out to use the other reading alone.

    Source: lecture, "Landmarkbasiertes Verfahren (2)".
    """
    z, landmarks = as_points(z, "z", dim=2), as_points(landmarks, "landmarks", dim=2)
    if z.ndim != 2 or z.shape != landmarks.shape:
        raise ValueError(f"z and landmarks must have the same shape (m, 2), got {z.shape} and {landmarks.shape}")
    if std_range is None and std_bearing is None:
        raise ValueError("std_range or std_bearing must be given, got neither: nothing would be weighed")
    stds = [None if std is None else as_positive_number(std, name)
            for std, name in ((std_range, "std_range"), (std_bearing, "std_bearing"))]  # fmt: skip
    best = -len(z) * sum(math.log(std * math.sqrt(2 * math.pi)) for std in stds if std is not None)

    def weigh(states):
        states = as_points(states, "states")
        x, y, theta = (states[..., k].copy() for k in range(3))
        c, s = np.cos(theta), np.sin(theta)
        misfit = np.zeros(x.shape)
        for (r, phi), (mark_x, mark_y) in zip(z, landmarks):
            dx, dy = mark_x - x, mark_y - y
            if stds[0] is not None:
                misfit += np.square((r - np.sqrt(dx * dx + dy * dy)) * (1 / stds[0]))
            if stds[1] is not None:  # turned into the measured direction, the difference needs no wrapping
                ahead, left = c * dx + s * dy, c * dy - s * dx
                cos, sin = math.cos(phi), math.sin(phi)
                misfit += np.square(np.arctan2(cos * left - sin * ahead, cos * ahead + sin * left) * (1 / stds[1]))
        return best - 0.5 * misfit

    return Weighting(weigh, best)


def weigh_beams(world, ranges, bearings, std, r_max, shares=(0.75, 0.1, 0.05, 0.1), decay=0.5, step=None):
    """Weighting by the beam model: each range is compared with the one that ray casting expects.

    Parameters
    ----------
    world : OccupancyGrid or RangeTable
        Anything with `cast(poses, bearings, r_max)`.
    ranges, bearings : array-like, shape (B,)
        One scan (m, rad).
    std : float
        Standard deviation of a range (m).
    r_max : float
        Range of the scanner (m).
    shares : four numbers that add up to 1
        hit: Gauss about the expected range, normalized on [0, r_max]; short: something unmapped stood in the way;
        max: nothing came back; random. The lecture's model is (1, 0, 0, 0): one such surprise makes the whole product
        zero or nearly so.
    decay : float
        Rate of the short readings (1/m).
    step : float, optional
        Compute the density once a scan at expected ranges every `step` m and look it up: faster for thousands of
        particles, and harmless while step is far below std.

    Source: lecture, "Strahlenmodell"; the mixture is the usual extension.
    """
    ranges, bearings = as_finite(ranges, "ranges"), as_finite(bearings, "bearings")
    if ranges.ndim != 1 or ranges.shape != bearings.shape:
        raise ValueError(f"ranges and bearings must have the same shape (B,), got {ranges.shape} and {bearings.shape}")
    shares = _shares(shares)
    std, r_max, decay = (as_positive_number(v, n) for v, n in ((std, "std"), (r_max, "r_max"), (decay, "decay")))

    def log_density(expected):
        with np.errstate(divide="ignore"):  # log 0 = -inf is the honest weight of an impossible pose
            return np.log(_beam_density(ranges, expected, std, r_max, shares, decay))

    if step is not None:
        step = as_positive_number(step, "step")
        if r_max / step > 1e6:
            raise ValueError(f"step must be at least a millionth of r_max, got {step:g} m")
        nodes = np.append(np.arange(0, r_max, step), r_max).astype(np.float32)
        table = np.ascontiguousarray(log_density(nodes[:, None]).T)
        rows = np.arange(len(ranges), dtype=np.int32) * len(nodes)

    def weigh(states):
        expected = world.cast(states, bearings, r_max)
        if step is None:
            return log_density(expected).sum(-1)
        node = (expected * np.float32(1 / step) + np.float32(0.5)).astype(np.int32)
        np.minimum(node, len(nodes) - 1, out=node)
        node += rows
        return table.ravel().take(node).sum(-1, dtype=float)

    best = log_density(ranges)
    return Weighting(weigh, float(best[np.isfinite(best)].sum()))


def beam_density(ranges, expected, std, r_max, shares, decay=0.5):
    """p(range | expected range) of the beam model, in 1/m (a share where the reading is r_max); shapes broadcast.

    Each part integrates to its share over [0, r_max], so the whole is a density for every expected range.
    """
    std, r_max, decay = (as_positive_number(v, n) for v, n in ((std, "std"), (r_max, "r_max"), (decay, "decay")))
    ranges, expected = as_finite(ranges, "ranges"), as_finite(expected, "expected")
    fit_together(ranges=ranges.shape, expected=expected.shape)
    return _beam_density(ranges, expected, std, r_max, _shares(shares), decay)


def _shares(shares):
    shares = as_finite(shares, "shares")
    if shares.shape != (4,) or (shares < 0).any() or abs(shares.sum() - 1) > 1e-9:
        raise ValueError(f"shares must be four numbers from 0 to 1 that add up to 1, got {shares.tolist()}")
    return shares


def _beam_density(ranges, expected, std, r_max, shares, decay):
    """`beam_density` in the precision of the expected ranges, which ray casting gives as float32."""
    hit, short, none, anywhere = (float(share) for share in shares)
    shape = np.broadcast_shapes(np.shape(ranges), np.shape(expected))
    expected = np.atleast_1d(expected)
    expected = expected if expected.dtype == np.float32 else expected.astype(float)
    ranges = np.asarray(ranges, dtype=expected.dtype)
    density = (ranges - expected) / std
    density *= density
    density *= -0.5
    np.exp(density, out=density)
    density *= hit / (std * math.sqrt(2 * math.pi))
    near_end = (expected < 5 * std) | (expected > r_max - 5 * std)  # elsewhere the whole bell is in range
    z = expected[near_end].astype(float)
    inside = np.ones(expected.shape, dtype=expected.dtype)
    inside[near_end] = np.maximum(ndtr((r_max - z) / std) - ndtr(-z / std), 1e-12)
    density /= inside
    density += anywhere / r_max
    if short > 0:
        norm = np.maximum(-np.expm1(-decay * expected), 1e-12)
        density += (ranges < expected) * (short * decay * np.exp(-decay * ranges)) / norm
    lost = none + anywhere / r_max + (expected >= r_max) * hit
    return np.where(ranges >= r_max, lost, density).reshape(shape)


def weigh_likelihood_field(field, ranges, bearings):
    """Weighting by a `LikelihoodField`: how near do the measured obstacle points lie to mapped ones?

    ranges, bearings: one scan, shapes (B,), in m and rad; readings at the field's r_max are left out.
    Source: lecture, "Likelihoodfield (1)" and "(2)".
    """
    hits = int((as_finite(ranges, "ranges") < field.r_max).sum())
    return Weighting(lambda states: field.log_weights(states, ranges, bearings), hits * float(field.log_density(0.0)))


def weigh_doors(doors, saw_door, std=0.3, trust=0.9):
    """Weighting of positions x along a corridor, shape (M,), by a sensor that says "door" or "no door".

    doors: positions (m). std: half width of a door as a Gauss (m). trust: share of right answers in front of a door.
    Source: lecture, "Idee", pictures (b) and (d).
    """
    doors = as_shape(doors, "doors", "n")
    if not len(doors):
        raise ValueError("doors must hold at least one position, got none")
    std, trust = as_positive_number(std, "std"), as_number(trust, "trust")
    if not 0.5 <= trust < 1:
        raise ValueError(f"trust must be at least 0.5 and below 1, got {trust:g}")

    def weigh(x):
        nearest = np.abs(as_finite(x, "x")[..., None] - doors).min(-1)
        says_door = (1 - trust) + (2 * trust - 1) * np.exp(-0.5 * (nearest / std) ** 2)
        return np.log(says_door if saw_door else 1 - says_door)

    return Weighting(weigh, math.log(trust))


# --- weights and resampling ------------------------------------------------------------------------------------------


def normalize(log_weights):
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
            f"weights must be at least 0 and not all 0, the largest from 1e-300 to 1e300, got {low:g} to {high:g}"
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


# --- recovery and the number of particles ----------------------------------------------------------------------------


def recover(w_mean, w_slow, w_fast, alpha_slow=0.02, alpha_fast=0.3):
    """Share of particles to replace by random poses, and both averages brought up to date: (share, w_slow, w_fast).

    Two exponential averages follow the mean weight of the cloud, a slow and a fast one. When the fast one has dropped
    below the slow one, the measurements have stopped to fit: share = max(0, 1 - w_fast / w_slow). Start both averages
    with the first mean weight. Source: beyond the lecture, which names the kidnapped robot problem only (augmented
    MCL).
    """
    names = ("w_mean", "w_slow", "w_fast", "alpha_slow", "alpha_fast")
    w_mean, w_slow, w_fast, alpha_slow, alpha_fast = map(
        as_number, (w_mean, w_slow, w_fast, alpha_slow, alpha_fast), names
    )
    if not 0 <= alpha_slow < alpha_fast <= 1:
        raise ValueError(
            f"alpha_slow must be below alpha_fast, both from 0 to 1, got {alpha_slow:g} and {alpha_fast:g}"
        )
    w_slow = w_slow + alpha_slow * (w_mean - w_slow)
    w_fast = w_fast + alpha_fast * (w_mean - w_fast)
    return (max(0.0, 1.0 - w_fast / w_slow) if w_slow > 0 else 0.0), w_slow, w_fast


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


@dataclass(frozen=True)
class Step:
    """What one step of the filter did.

    n_particles; effective: effective size before resampling; resampled: whether it was; injected: random poses put in;
    w_mean: mean weight (1 = every particle fits perfectly); all_zero: no particle explained the scan, so it was not
    used.
    """

    n_particles: int
    effective: float
    resampled: bool
    injected: int
    w_mean: float
    all_zero: bool


class MonteCarloLocalizer:
    """The lecture's MCL with its options: when and how to resample, recovery, and a number of particles that adapts.

    Parameters
    ----------
    states : array-like, shape (M, 3)
        The first cloud: about a known pose (local) or `uniform_states` (global localization).
    resample : function (weights, rng, size) -> indices
        `resample_systematic` or `resample_roulette`.
    threshold : float
        Resample when the effective size is below this share of M: 1 resamples always, 0 never. In between the
        weights multiply up.
    every : int
        Resample in every `every`-th step at most (the lecture's N).
    exponent : float
        The log weights are multiplied by it. Neighboring beams share their errors: 60 of them do not know 60 times
        as much as one.
    draw : function (n, rng) -> states, optional
        Where recovery takes random poses from, for at most half of the cloud a step; without it there is no recovery.
    recovery : (alpha_slow, alpha_fast)
    kld : dict, optional
        Options of `kld_take`, with which each resampling chooses the number of particles, up to the first cloud's.
    motion : function (states, u, dt, rng) -> states
    """

    def __init__(
        self,
        states,
        resample=resample_systematic,
        threshold=0.5,
        every=1,
        exponent=1.0,
        draw=None,
        recovery=(0.02, 0.3),
        kld=None,
        motion=sample_motion,
    ):
        self.states = as_points(states, "states").reshape(-1, 3).copy()
        self.n_max = len(self.states)
        self.log_weights = np.zeros(self.n_max)
        self.resample, self.threshold, self.every, self.exponent = resample, threshold, every, exponent
        self.draw, self.recovery, self.kld, self.motion = draw, recovery, kld, motion
        self.averages = None
        self.count = 0

    @property
    def weights(self):
        """Normalized weights (M,)."""
        return normalize(self.log_weights)

    def estimate(self):
        """Pose and covariance of the heaviest cluster."""
        return estimate_mode(self.states, self.weights)

    def step(self, u, dt, weigh, rng):
        """Move by u for dt, weigh by a `Weighting` (or None when nothing was measured), and resample if it is time;
        a `Step`."""
        self.states = self.motion(self.states, u, dt, rng)
        return self.correct(weigh, rng)

    def correct(self, weigh, rng):
        """Weigh and resample without moving."""
        self.count += 1
        share, w_mean, all_zero = 0.0, 1.0, False
        if weigh is not None:
            log_w = self.exponent * (weigh(self.states) - weigh.best)
            all_zero = bool((self.log_weights + log_w == -np.inf).all())
            w_mean = float((self.weights * np.exp(log_w)).sum())
            if not all_zero:
                self.log_weights = self.log_weights + log_w
                self.log_weights -= self.log_weights.max()
            if self.draw is not None:
                slow, fast = self.averages or (w_mean, w_mean)
                share, *self.averages = recover(w_mean, slow, fast, *self.recovery)
        effective = effective_size(self.weights)
        due = self.count % self.every == 0 and effective < self.threshold * len(self.states)
        share = float(np.clip(share, MIN_INJECTED, MAX_INJECTED)) if self.draw is not None else 0.0
        due = due or share > 0 or self.threshold >= 1 and self.count % self.every == 0
        injected = self._redraw(share, rng) if due else 0
        return Step(len(self.states), effective, due, injected, w_mean, all_zero)

    def _redraw(self, share, rng):
        """Resample, then put random poses in place of a share; how many. They come after the count of KLD sampling:
        strewn over the whole building they would ask for all particles in every step."""
        size = self.n_max if self.kld is not None else len(self.states)
        chosen = self.states[self.resample(self.weights, rng, size)]
        if self.kld is not None:
            chosen = rng.permutation(chosen)
            chosen = chosen[: kld_take(chosen, **self.kld)]
        injected = int(round(share * len(chosen)))
        if injected:
            place = rng.choice(len(chosen), injected, replace=False)
            chosen[place] = self.draw(injected, rng)
        self.states, self.log_weights = chosen, np.zeros(len(chosen))
        return injected


# --- simulated drives ------------------------------------------------------------------------------------------------


def find_route(edges, start, goal):
    """Shortest list of node names from start to goal along the edges of a topological map (breadth first)."""
    if not all(isinstance(edge, (tuple, list)) and len(edge) == 2 for edge in edges):
        raise ValueError("edges must be pairs of names")
    before, queue = {start: None}, deque([start])
    while queue and goal not in before:
        here = queue.popleft()
        for a, b in edges:
            for one, other in ((a, b), (b, a)):
                if one == here and other not in before:
                    before[other] = here
                    queue.append(other)
    if goal not in before:
        raise ValueError(f"edges must connect {start!r} with {goal!r}, but no chain of edges does")
    route = [goal]
    while before[route[-1]] is not None:
        route.append(before[route[-1]])
    return route[::-1]


@dataclass(frozen=True)
class Drive:
    """A simulated drive: true poses (n + 1, 3), the controls that odometry reports (n, 2), and the time step (s)."""

    truth: np.ndarray
    controls: np.ndarray
    dt: float


def follow(start, waypoints, n_steps, dt, speed=0.6, turn_rate=0.8):
    """Controls (n_steps, 2) of a robot that turns toward each waypoint and drives there; it stands still at the end."""
    (x, y, theta), n_steps = as_shape(start, "start", 3), as_count(n_steps, "n_steps", at_least=0)
    named = ((dt, "dt"), (speed, "speed"), (turn_rate, "turn_rate"))
    dt, speed, turn_rate = (as_positive_number(value, name) for value, name in named)
    controls = []
    for goal_x, goal_y in as_points(waypoints, "waypoints", dim=2).reshape(-1, 2).tolist():
        if len(controls) >= n_steps:
            break
        way, heading = math.hypot(goal_x - x, goal_y - y), math.atan2(goal_y - y, goal_x - x)
        turn = float(wrap_angle(heading - theta))
        for amount, rate, unit in ((turn, turn_rate, (0, 1)), (way, speed, (1, 0))):
            n = math.ceil(abs(amount) / (rate * dt) - 1e-9)
            if n:
                controls += [(amount / (n * dt) * unit[0], amount / (n * dt) * unit[1])] * min(n, n_steps)
        x, y, theta = goal_x, goal_y, heading
    controls = (controls + [(0.0, 0.0)] * n_steps)[:n_steps]
    return np.array(controls).reshape(-1, 2)


def random_drive(building, n_steps, rng, dt=0.5, start=None):
    """A `Drive` from room to room of a building, in a random order; odometry reports it with the lecture's noise.

    start: name of the first node, random when not given.
    """
    rooms = [name for name in building.nodes if not name.startswith(("door", "corridor"))]
    here = start or rooms[rng.integers(len(rooms))]
    xy = np.array(building.nodes[here])
    pose = np.array([*xy, rng.uniform(-np.pi, np.pi)])
    waypoints = []
    while len(waypoints) < 2 * n_steps * dt:  # more than can be reached
        goal = rooms[rng.integers(len(rooms))]
        if goal != here:
            waypoints += [building.nodes[name] for name in find_route(building.edges, here, goal)[1:]]
            here = goal
    controls = follow(pose, waypoints, n_steps, dt)
    truth = odometry.drive(pose, controls, dt)
    return Drive(truth, odometry.noisy_controls(controls, dt, **CONTROL_NOISE, rng=rng, runs=1)[:, 0], dt)


class Wanderer:
    """A robot that goes on from place to place of a topological map, from wherever it is put.

    control(pose, dt): the control for the next step; it turns toward the place it is heading for, then drives there.
    """

    def __init__(self, building, rng):
        self.building, self.rng, self.at, self.goal = building, rng, None, None

    def start_over(self):
        """Forget where it was heading: it has been carried away."""
        self.at = self.goal = None

    def control(self, pose, dt, speed=0.6, turn_rate=0.8):
        """v and omega, shape (2,)."""
        if self.goal is None:
            self.goal = self._in_sight(pose)
        if self.goal is None:
            return np.array([0.0, turn_rate / 2])
        way = np.subtract(self.building.nodes[self.goal], pose[:2])
        if np.hypot(*way) < 0.02:
            self.at, self.goal = self.goal, self._next()
            way = np.subtract(self.building.nodes[self.goal], pose[:2])
        turn = float(wrap_angle(np.arctan2(way[1], way[0]) - pose[2]))
        if abs(turn) > 0.02:
            return np.array([0.0, np.clip(turn / dt, -turn_rate, turn_rate)])
        return np.array([min(speed, np.hypot(*way) / dt), 0.0])

    def _next(self):
        neighbors = [b if a == self.goal else a for a, b in self.building.edges if self.goal in (a, b)]
        onward = [name for name in neighbors if name != self.at] or neighbors
        return onward[self.rng.integers(len(onward))]

    def _in_sight(self, pose):
        names = list(self.building.nodes)
        ways = np.array([self.building.nodes[name] for name in names]) - pose[:2]
        distance, direction = np.hypot(*ways.T), np.arctan2(ways[:, 1], ways[:, 0])
        free = self.building.grid.cast((*pose[:2], 0.0), direction, 30.0) > distance
        return names[int(np.argmin(np.where(free, distance, np.inf)))] if free.any() else None


def see_landmarks(grid, pose, landmarks, rng, std_range=0.1, std_bearing=0.035, r_max=8.0):
    """Indices and noisy (range, bearing) of the landmarks in sight: nearer than r_max and not behind a wall.

    Landmarks may sit on a wall: the last 0.1 m before one does not count as an obstacle. grid None: nothing hides
    anything.
    """
    pose, landmarks = as_shape(pose, "pose", 3), as_shape(landmarks, "landmarks", "m", 2)
    named = ((std_range, "std_range"), (std_bearing, "std_bearing"), (r_max, "r_max"))
    std_range, std_bearing, r_max = (float(as_nonnegative(as_number(value, name), name)) for value, name in named)
    d = landmarks - pose[:2]
    r, phi = np.hypot(*d.T), wrap_angle(np.arctan2(d[:, 1], d[:, 0]) - pose[2])
    seen = r < r_max
    if grid is not None:
        seen &= cast_rays(grid, pose, phi, r_max + 1.0) > r - 0.1
    index = np.flatnonzero(seen)
    noise = rng.standard_normal((len(index), 2)) * [std_range, std_bearing]
    return index, np.column_stack([r[index], phi[index]]) + noise


class SensorSuite:
    """The three sensor models in one building: measures in the world, hands out weightings made from the robot's map.

    building: a `maps.Building`. scanner: its scans; every `every`-th beam is used. The beam model looks its ranges up
    in a `RangeTable`, made at the first use.
    """

    def __init__(self, building, scanner=Scanner(), every=9, std_field=0.15, std_beam=0.2):  # noqa: B008
        self.building, self.scanner, self.every, self.std_beam = building, scanner, every, std_beam
        self.field = LikelihoodField(building.grid, std_field, r_max=scanner.r_max)

    @cached_property
    def table(self):
        """Ranges for the beam model, computed in advance."""
        return RangeTable(self.building.grid, self.scanner.r_max)

    def measure(self, model, pose, rng, world=None):
        """A `Weighting` from one measurement at the true pose; None when no landmark is in sight.

        model: one of `SENSORS`. world: the map as it really is, with what the robot's map lacks.
        """
        world = world or self.building.grid
        if model == "landmarks":
            index, z = see_landmarks(world, pose, self.building.landmarks, rng)
            return weigh_landmarks(z, self.building.landmarks[index], 0.1, 0.035) if len(index) else None
        return self.weigh_scan(model, *self.scanner.scan(world, pose, rng, self.every))

    def weigh_scan(self, model, ranges, bearings):
        """The `Weighting` of a scan by "beams" or "likelihood field"."""
        if model == "beams":
            return weigh_beams(self.table, ranges, bearings, self.std_beam, self.scanner.r_max, step=0.02)
        if model == "likelihood field":
            return weigh_likelihood_field(self.field, ranges, bearings)
        raise ValueError(f"model must be one of {', '.join(SENSORS)}, got {model!r}")


# Shares of the log weights that each model contributes, found by the success rates in tests/bench/mcl_success.py
EXPONENTS = {"landmarks": 0.3, "beams": 0.1, "likelihood field": 0.06}


def localizer(building, model, n_particles, rng, start=None, recovery=True, **options):
    """A `MonteCarloLocalizer` with the settings of the success rates; spread over the building, or about a pose
    `start`.
    """
    if start is None:
        states = uniform_states(building.grid, n_particles, rng)
    else:
        states = as_points(start, "start") + rng.standard_normal((n_particles, 3)) * [0.2, 0.2, 0.1]
    draw = (lambda n, rng: uniform_states(building.grid, n, rng)) if recovery else None
    options = {"exponent": EXPONENTS[model], "draw": draw, **options}
    return MonteCarloLocalizer(states, **options)


@dataclass(frozen=True)
class Picture:
    """One moment of a recorded run: cloud and weights before resampling, true pose, estimate, what the filter did."""

    states: np.ndarray
    weights: np.ndarray
    truth: np.ndarray
    estimate: np.ndarray
    step: Step


def record(filter_, drive, measure, rng):
    """Run a filter along a drive and keep a `Picture` of each step.

    measure: function (pose, k) -> Weighting or None, the measurement at the true pose after step k.
    """
    pictures = []
    for k, (u, pose) in enumerate(zip(drive.controls, drive.truth[1:])):
        filter_.states = filter_.motion(filter_.states, u, drive.dt, rng)
        weigh, before = measure(pose, k), filter_.states
        log_w = filter_.log_weights + (0 if weigh is None else filter_.exponent * (weigh(before) - weigh.best))
        weights = normalize(log_w) if np.isfinite(log_w).any() else filter_.weights
        step = filter_.correct(weigh, rng)
        pictures.append(Picture(before, weights, pose, estimate_mode(before, weights).pose, step))
    return pictures


def global_example(building, n_particles=5000, n_steps=12, seed=5):
    """The lecture's twelve pictures, "Beispiel (1)" to "(12)", on the workbook's building: global localization,
    simulated.
    """
    rng, suite = np.random.default_rng(seed), SensorSuite(building)
    drive = random_drive(building, n_steps, rng, start="hall")
    filter_ = localizer(building, "likelihood field", n_particles, rng, recovery=False)
    return record(filter_, drive, lambda pose, k: suite.measure("likelihood field", pose, rng), rng)


@dataclass(frozen=True)
class SoccerRun:
    """The lecture's soccer example, simulated.

    landmarks (6, 2); truth (n + 1, 3); odometry (n + 1, 3): the path that the controls alone give; estimates (n, 3);
    seen (n,): the landmark recognized at each step, or -1; pictures: one `Picture` a step.
    """

    landmarks: np.ndarray
    truth: np.ndarray
    odometry: np.ndarray
    estimates: np.ndarray
    seen: np.ndarray
    pictures: list


def soccer_run(n_particles=1000, n_steps=120, seed=5, use=("range", "bearing")):
    """A robot with a camera drives over a soccer field and recognizes one of six landmarks at a time; the start is
    known.

    The camera looks 28 deg to either side and sees the nearest landmark within. Odometry has four times the lecture's
    noise, as legs slip more than wheels. use: which of "range" and "bearing" the filter may use; none leaves it to
    odometry. Source: lecture, "Beispiel (1)" and "(2)" behind the landmark model; its data were never published.
    """
    rng = np.random.default_rng(seed)
    marks = read_table("monte_carlo/soccer_landmarks.csv")
    landmarks = np.column_stack([marks["x"], marks["y"]])
    corners = [(0.8, 0.6), (3.4, 0.6), (3.4, 2.1), (2.1, 1.35), (0.8, 2.1)] * 3
    dt, start = 0.4, np.array([0.8, 2.1, -math.pi / 2])
    std_range, std_bearing = 0.15, 0.08
    controls = follow(start, corners, n_steps, dt, speed=0.25, turn_rate=0.6)
    noise = {key: 4 * value for key, value in CONTROL_NOISE.items()}
    noisy = odometry.noisy_controls(controls, dt, **noise, rng=rng, runs=1)[:, 0]
    drive = Drive(odometry.drive(start, controls, dt), noisy, dt)

    def motion(states, u, dt, rng):
        return sample_motion(states, u, dt, rng, cov_u=odometry.control_covariance(u, dt, **noise))

    seen = []

    def measure(pose, k):
        index, z = see_landmarks(None, pose, landmarks, rng, std_range, std_bearing)
        ahead = np.abs(z[:, 1]) < math.radians(28)
        if not ahead.any():
            seen.append(-1)
            return None
        nearest = np.flatnonzero(ahead)[np.argmin(z[ahead, 0])]
        seen.append(int(index[nearest]))
        stds = {f"std_{name}": std for name, std in (("range", std_range), ("bearing", std_bearing)) if name in use}
        if not stds:
            return None
        return weigh_landmarks(z[nearest : nearest + 1], landmarks[seen[-1] : seen[-1] + 1], **stds)

    cloud = start + rng.standard_normal((n_particles, 3)) * [0.1, 0.1, 0.1]
    pictures = record(MonteCarloLocalizer(cloud, motion=motion), drive, measure, rng)
    reckoned = odometry.drive(start, noisy, dt)
    estimates = np.array([picture.estimate for picture in pictures])
    return SoccerRun(landmarks, drive.truth, reckoned, estimates, np.array(seen), pictures)
