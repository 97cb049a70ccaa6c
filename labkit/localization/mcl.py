"""Monte-Carlo localization: the filter that moves, weighs and redraws a cloud of poses, and recovers from kidnapping.

Source: lecture "Lokalisierung", "Monte-Carlo-Lokalisierung".
"""

from dataclasses import dataclass

import numpy as np

from ..checks import as_number, as_points, shown
from .particles import (
    effective_size,
    estimate_mode,
    kld_take,
    normalize_weights,
    resample_systematic,
    sample_motion,
    uniform_states,
)

MIN_INJECTED = 0.1  # with recovery some random poses always look around: a wrong place may fit fairly well
MAX_INJECTED = 0.5  # share of the cloud that one step may replace: the rest must be able to hold on to what is right


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
            f"alpha_slow must be below alpha_fast, both from 0 to 1, got {shown(alpha_slow)} and {shown(alpha_fast)}"
        )
    w_slow = w_slow + alpha_slow * (w_mean - w_slow)
    w_fast = w_fast + alpha_fast * (w_mean - w_fast)
    return (max(0.0, 1.0 - w_fast / w_slow) if w_slow > 0 else 0.0), w_slow, w_fast


@dataclass(frozen=True)
class StepReport:
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
        return normalize_weights(self.log_weights)

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
        return StepReport(len(self.states), effective, due, injected, w_mean, all_zero)

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
    step: StepReport


def record(filter_, drive, measure, rng):
    """Run a filter along a drive and keep a `Picture` of each step.

    measure: function (pose, k) -> Weighting or None, the measurement at the true pose after step k.
    """
    pictures = []
    for k, (u, pose) in enumerate(zip(drive.controls, drive.truth[1:])):
        filter_.states = filter_.motion(filter_.states, u, drive.dt, rng)
        weigh, before = measure(pose, k), filter_.states
        log_w = filter_.log_weights + (0 if weigh is None else filter_.exponent * (weigh(before) - weigh.best))
        weights = normalize_weights(log_w) if np.isfinite(log_w).any() else filter_.weights
        step = filter_.correct(weigh, rng)
        pictures.append(Picture(before, weights, pose, estimate_mode(before, weights).pose, step))
    return pictures
