"""Monte-Carlo localization: the filter that moves, weighs and redraws a cloud of poses, and recovers from kidnapping.

When to redraw, where random poses come from and how many particles to keep are small objects, put together by whoever
makes the filter.
Source: lecture "Lokalisierung", "Monte-Carlo-Lokalisierung".
"""

import functools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..checks import as_count, as_function, as_generator, as_number, as_points, as_shape, as_size, shown
from ..documented import documented
from .particles import (
    as_weights,
    effective_size,
    estimate_mode,
    normalize_weights,
    resample_systematic,
    should_resample,
    uniform_states,
)

SPREAD_ABOUT_START = (0.2, 0.2, 0.1)  # m, m, rad: standard deviations of a first cloud about a known pose

# --- when to resample ------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Policy:
    """When to resample. Policies combine: `a & b` resamples when both say so, `a | b` when either does.

    Between two resamplings the weights multiply up.

    Parameters
    ----------
    rule : function (step, weights) -> bool
        step: number of the step, from 1 on. weights: shape (M,), of any sum.

    See Also
    --------
    every, when_effective_below
    """

    rule: object

    def __call__(self, step, weights):
        """Whether to resample after a step, from 1 on, with weights, shape (M,)."""
        return bool(self.rule(as_count(step, "step"), as_weights(weights)))

    def __and__(self, other):
        return Policy(lambda step, weights: self(step, weights) and other(step, weights))

    def __or__(self, other):
        return Policy(lambda step, weights: self(step, weights) or other(step, weights))


def every(n):
    """Resample in every n-th step; every(1) is the lecture's plain algorithm.

    Parameters
    ----------
    n : int
        At least 1.

    Returns
    -------
    Policy

    Source: lecture, "Diversitaet der Partikelmenge".
    """
    n = as_count(n, "n")
    return Policy(lambda step, weights: step % n == 0)


def when_effective_below(share):
    """Resample when the effective size has fallen below this share of the number of particles.

    Parameters
    ----------
    share : float
        0 never resamples.

    Returns
    -------
    Policy

    See Also
    --------
    particles.should_resample

    Source: lecture, "Diversitaet der Partikelmenge": resample only when the variance of the weights is high.
    """
    share = as_number(share, "share")
    return Policy(lambda step, weights: should_resample(weights, share))


@dataclass(frozen=True, eq=False)
class Resampling:
    """When and how a filter redraws its cloud.

    Parameters
    ----------
    when : Policy
    draw : function (weights, rng, size) -> indices
        `resample_systematic` or `resample_roulette`.
    """

    when: Policy = when_effective_below(0.7)
    draw: object = resample_systematic


# --- recovery --------------------------------------------------------------------------------------------------------


class Recovered(NamedTuple):
    """Share of particles to replace by random poses, and both averages brought up to date."""

    share: float
    w_slow: float
    w_fast: float


def recover(w_mean, w_slow, w_fast, alpha_slow=0.02, alpha_fast=0.3):
    """How many random poses a fall of the mean weight asks for: max(0, 1 - w_fast / w_slow).

    Two exponential averages follow the mean weight of the cloud, a slow and a fast one. When the fast one has dropped
    below the slow one, the measurements have ceased to fit. Start both with the first mean weight.

    Parameters
    ----------
    w_mean : float
        Mean weight of the cloud by the newest measurement.
    w_slow, w_fast : float
        Both averages before it.
    alpha_slow, alpha_fast : float
        The share of its distance from w_mean that each average moves, 0 <= alpha_slow < alpha_fast <= 1.

    Returns
    -------
    Recovered

    Raises
    ------
    ValueError
        When the two alphas are out of order or out of range.

    Source: beyond the lecture, which names the kidnapped robot problem only (augmented MCL).
    """
    names = ("w_mean", "w_slow", "w_fast", "alpha_slow", "alpha_fast")
    w_mean, w_slow, w_fast, alpha_slow, alpha_fast = map(
        as_number, (w_mean, w_slow, w_fast, alpha_slow, alpha_fast), names
    )
    if not 0 <= alpha_slow < alpha_fast <= 1:
        raise ValueError(
            f"alpha_slow must be below alpha_fast, both from 0 to 1, got {shown(alpha_slow)} and {shown(alpha_fast)}"
        )
    w_slow = w_slow + alpha_slow * (w_mean - w_slow)
    w_fast = w_fast + alpha_fast * (w_mean - w_fast)
    return Recovered(max(0.0, 1.0 - w_fast / w_slow) if w_slow > 0 else 0.0, w_slow, w_fast)


@dataclass(frozen=True, eq=False)
class Recovery:
    """Random poses for a filter that may be lost: where they come from, and how many of them.

    Parameters
    ----------
    draw : function (n, rng) -> states, shape (n, 3)
        For example `functools.partial(uniform_states, grid)`.
    least, most : float
        Limits of the share of the cloud that one resampling replaces, 0 <= least <= most <= 1. The least look around
        always, since a wrong place may fit fairly well; the rest of the cloud holds on to what is right.
    alpha_slow, alpha_fast : float
        As for `recover`.
    """

    draw: object
    least: float = 0.3
    most: float = 0.5
    alpha_slow: float = 0.02
    alpha_fast: float = 0.3

    def __post_init__(self):
        least, most = as_number(self.least, "least"), as_number(self.most, "most")
        as_function(self.draw, "draw")
        as_number(self.alpha_slow, "alpha_slow"), as_number(self.alpha_fast, "alpha_fast")
        if not 0 <= least <= most <= 1:
            raise ValueError(f"least must not be above most, both from 0 to 1, got {shown(least)} and {shown(most)}")

    @documented
    def watch(self, mean_weight, averages):
        """`recover` for a filter.

        Parameters
        ----------
        mean_weight : float
        averages : Recovered or None
            None before the first measurement.
        """
        w_slow, w_fast = (mean_weight, mean_weight) if averages is None else averages[1:]
        return recover(mean_weight, w_slow, w_fast, self.alpha_slow, self.alpha_fast)

    @documented
    def count(self, asked, n):
        """How many of n particles to replace when the averages ask for the share `asked`.

        Parameters
        ----------
        asked : float
        n : int
            At least 0.
        """
        return round(min(max(asked, self.least), self.most) * n)


# --- the filter ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class StepReport:
    """What one step of the filter did.

    Attributes
    ----------
    states, weights : arrays, shapes (M, 3) and (M,)
        The cloud after motion and measurement, before resampling; the weights add up to 1.
    resampled : bool
    injected : int
        Random poses put in.
    mean_weight : float or None
        1 when every particle fits perfectly; None when nothing was measured.
    all_zero : bool
        No particle explained the measurement, so it was not used.
    """

    states: np.ndarray
    weights: np.ndarray
    resampled: bool
    injected: int
    mean_weight: float
    all_zero: bool

    @property
    def n_particles(self):
        """Number of particles before resampling."""
        return len(self.states)

    @functools.cached_property
    def effective(self):
        """Effective size before resampling."""
        return effective_size(self.weights)

    @functools.cached_property
    def estimate(self):
        """`Estimate` by the heaviest cluster before resampling."""
        return estimate_mode(self.states, self.weights)


class MonteCarloLocalizer:
    """The lecture's Monte-Carlo localization: move, weigh, redraw.

    Parameters
    ----------
    states : array-like, shape (M, 3)
        The first cloud: about a known pose (local) or `uniform_states` (global localization).
    motion : function (states, u, dt, rng) -> states
        For example `particles.odometry_motion(...)`.
    resampling : Resampling
    recovery : Recovery, optional
        Without it no random poses come in. With it they take the places of redrawn particles, in steps that resample
        and have measured something; when the averages have asked for them, both start over, as the new poses change
        the mean weight by themselves.
    adaptive : particles.KldSampling, optional
        Lets each resampling choose the number of particles, up to M.

    Attributes
    ----------
    states : array, shape (M, 3)
    weights : array, shape (M,), normalized

    Source: lecture, "Monte-Carlo-Lokalisierung"; recovery and adaptive number are beyond it.
    """

    @documented
    def __init__(self, states, motion, resampling=Resampling(), recovery=None, adaptive=None):
        self.states = as_points(states, "states").reshape(-1, 3).copy()
        self.motion, self.resampling, self.recovery, self.adaptive = motion, resampling, recovery, adaptive
        self.n_max = len(self.states)
        self._log_weights = np.zeros(self.n_max)
        self._averages = None
        self._step = 0

    @property
    def weights(self):
        """Normalized weights, shape (M,)."""
        return normalize_weights(self._log_weights)

    def estimate(self):
        """`Estimate` by the heaviest cluster."""
        return estimate_mode(self.states, self.weights)

    @documented
    def step(self, u, dt, weighting, rng):
        """Move, weigh, and resample if it is time.

        Parameters
        ----------
        u : array-like, shape (2,)
            v (m/s) and omega (rad/s), as odometry reports them.
        dt : float
            Time step (s).
        weighting : sensors.Weighting or None
            None when nothing was measured.
        rng : numpy.random.Generator

        Returns
        -------
        StepReport
        """
        self.states = self.motion(self.states, u, dt, rng)
        return self.correct(weighting, rng)

    @documented
    def correct(self, weighting, rng):
        """The `StepReport` of a step without motion.

        Parameters
        ----------
        weighting : sensors.Weighting or None
        rng : numpy.random.Generator
        """
        self._step = self._step + 1
        mean_weight, all_zero = (None, False) if weighting is None else self._weigh(weighting)
        states, weights = self.states, self.weights
        due = self.resampling.when(self._step, weights)
        if due:
            self._redraw(weights, rng)
        injected = self._inject(rng) if due and mean_weight is not None and self.recovery is not None else 0
        return StepReport(states, weights, due, injected, mean_weight, all_zero)

    def resize(self, n_particles, rng):
        """Go on with another number of particles, drawn from this cloud."""
        self.n_max, rng = as_size(n_particles, "n_particles"), as_generator(rng)
        self.states = self.states[self.resampling.draw(self.weights, rng, self.n_max)]
        self._log_weights = np.zeros(self.n_max)

    def _weigh(self, weighting):
        """Multiply the weights by the measurement's, unless all would be zero; the measurement's mean, and whether."""
        log_w = weighting(self.states) - weighting.best
        mean_weight = float(self.weights @ np.exp(log_w))
        product = self._log_weights + log_w
        all_zero = bool((product == -np.inf).all())
        if not all_zero:
            self._log_weights = product - product.max()
        if self.recovery is not None:
            self._averages = self.recovery.watch(mean_weight, self._averages)
        return mean_weight, all_zero

    def _redraw(self, weights, rng):
        if self.adaptive is None:
            self.states = self.states[self.resampling.draw(weights, rng, len(weights))]
        else:
            drawn = rng.permutation(self.states[self.resampling.draw(weights, rng, self.n_max)])
            self.states = drawn[: self.adaptive.enough(drawn)]
        self._log_weights = np.zeros(len(self.states))

    def _inject(self, rng):
        """Put random poses in place of redrawn ones; how many. They come after the count of `adaptive`: strewn over
        the whole building they would ask for all particles in every step."""
        asked = self._averages.share
        n = self.recovery.count(asked, len(self.states))
        self.states[rng.choice(len(self.states), n, replace=False)] = self.recovery.draw(n, rng)
        if asked > self.recovery.least:
            self._averages = None
        return n


@documented
def localizer(grid, motion, n_particles, rng, start=None, recovery=True, **options):
    """A `MonteCarloLocalizer` spread over a map, or about a known pose.

    Parameters
    ----------
    grid : maps.OccupancyGrid
    motion : function (states, u, dt, rng) -> states
    n_particles : int
        At least 1.
    rng : numpy.random.Generator
    start : array-like, shape (3,), optional
        A known pose (m, m, rad): local localization. When not given, global.
    recovery : bool
        Whether random poses from all over the map may come in.
    **options
        Further arguments of `MonteCarloLocalizer`.

    Returns
    -------
    MonteCarloLocalizer
    """
    n_particles = as_size(n_particles, "n_particles")
    if start is None:
        states = uniform_states(grid, n_particles, rng)
    else:
        states = as_shape(start, "start", 3) + rng.standard_normal((n_particles, 3)) * SPREAD_ABOUT_START
    policy = Recovery(functools.partial(uniform_states, grid)) if recovery else None
    return MonteCarloLocalizer(states, motion, recovery=policy, **options)


@dataclass(frozen=True, eq=False)
class Picture:
    """One moment of a recorded run: the true pose, shape (3,), and the filter's `StepReport`."""

    truth: np.ndarray
    step: StepReport

    @property
    def states(self):
        """The cloud before resampling, shape (M, 3)."""
        return self.step.states

    @property
    def estimate(self):
        """The estimated pose, shape (3,)."""
        return self.step.estimate.pose


@documented
def record(filter_, drive, measure, rng):
    """Run a filter along a drive and keep a `Picture` of each step.

    Parameters
    ----------
    filter_ : MonteCarloLocalizer
    drive : drives.Drive
    measure : function (pose, k) -> Weighting or None
        The measurement at the true pose after step k.
    rng : numpy.random.Generator

    Returns
    -------
    list of Picture
    """
    return [
        Picture(pose, filter_.step(u, drive.dt, measure(pose, k), rng))
        for k, (u, pose) in enumerate(zip(drive.controls, drive.truth[1:]))
    ]
