"""Lecture, Monte-Carlo localization, its sensors and maps: printed figures, costs, claims, and the algorithm as
printed.
"""

import functools

import numpy as np

from ...fast.sensors import SensorSuite
from ...localization import particles
from ...localization.drives import random_drive
from ...localization.mcl import localizer
from ..ledger import Computed, computes
from ..slips import HERE, explained_by
from .examples import load_building, soccer_run
from .printed import example_noise

NOTEBOOK = "09_monte_carlo"


def _mcl(first, read):
    """The printed algorithm, with its first line and the set its loop reads: how many particles it returns."""
    sets = {"χ_k": list(range(1000)), "χ_k'": None, "χ_{k+1}": None, "χ'_{k+1}": None}
    for name in first.removesuffix(" = ∅").split(" = "):
        sets[name] = []
    weighted = None if sets["χ'_{k+1}"] is None else [*sets["χ'_{k+1}"], *(sets[read] or ())]
    return len(weighted or ())


@computes("particles.mcl_first_line")
def mcl_first_line():
    printed = {HERE: "χ_k' = χ_k = ∅", "loop": "χ_k"}
    others = {HERE: ("χ'_{k+1} = χ_{k+1} = ∅",), "loop": ("χ_k'", "χ_{k+1}", "χ'_{k+1}")}
    found = explained_by(printed, lambda d: _mcl(d[HERE], d["loop"]) == 1000, others)
    left = _mcl(printed[HERE], printed["loop"])
    return Computed(
        found[HERE][0] if HERE in found else printed[HERE],
        slips=found,
        proof=f"Executed as printed, the first line empties the input: of 1000 particles {left} come back. The "
        "sets filled below are those of step k + 1; no other set for the loop to read helps.",
    )


def _bisections(m):
    """Comparisons of a binary search for a spin into each of the m intervals of the roulette wheel, shape (m,)."""
    low, high, count = np.zeros(m, dtype=int), np.full(m, m), np.zeros(m, dtype=int)
    spin = (np.arange(m) + 0.5) / m
    while (searching := low < high).any():
        middle = (low + high) // 2
        above = searching & ((middle + 1) / m <= spin)  # the end of an interval belongs to the next
        low, high = np.where(above, middle + 1, low), np.where(searching & ~above, middle, high)
        count += searching
    return count


@computes("particles.roulette_cost")
def roulette_cost():
    """M draws of a binary search: whether each takes log2 M comparisons, or one more."""
    counts = {m: _bisections(m) for m in (64, 256, 1024, 4096, 16384)}
    holds = all((np.log2(m) <= n).all() and (n <= np.log2(m) + 1).all() for m, n in counts.items())
    return Computed("O(M log(M))" if holds else f"{max(n.max() for n in counts.values())} comparisons a draw")


def _spokes(weights, share):
    """Steps of the spoke wheel: a spoke each, and each interval it passes; the first spoke stands at a share of d."""
    m, n, count = len(weights), 0, 0
    distance, end = weights.sum() / m, weights[0]
    spoke = share * distance
    for _ in range(m):
        while spoke > end and n < m - 1:
            n += 1
            end += weights[n]
            count += 1
        spoke += distance
        count += 1
    return count


@computes("particles.spoke_cost")
def spoke_cost():
    """Whether the spoke wheel takes between M and 2 M steps: a spoke each, and an interval passed at most once."""
    rng = np.random.default_rng(11)
    steps = {m: _spokes(rng.exponential(size=m), rng.uniform()) for m in (500, 1000, 2000, 4000)}
    return Computed("O(M)" if all(m <= count < 2 * m for m, count in steps.items()) else f"steps: {steps}")


@computes("particles.spoke_distance")
def spoke_distance():
    """Over all positions of the first spoke in [0, d], particle i must be pointed at M w_i / W times on average."""
    weights = np.array([3.0, 1.0, 0.5, 2.5, 4.0])
    total, m = weights.sum(), len(weights)
    first = (np.arange(20_000) + 0.5) / 20_000 * total / m
    spokes = first[:, None] + np.arange(m) * total / m
    mean = np.bincount(np.searchsorted(np.cumsum(weights), spokes.ravel()), minlength=m) / len(first)
    step = 1 / len(first)  # each end of an interval lies between two positions: half a step of the mean, of both one
    return Computed("W/M" if np.abs(mean - m * weights / total).max() <= step * (1 + 1e-6) else "not W/M")


@functools.cache
def _survivors():
    """Which of 100 particles with equal weights are left after 2000 rounds of roulette, shape (100,).

    Two draws from the last set differ with probability 0.99^2001 = 1.8e-9 on average, and with at least 0.0198 where
    two different particles are left: fewer than one seed in ten million leaves them.
    """
    rng, left = np.random.default_rng(12), np.arange(100)
    for _ in range(2000):
        left = left[particles.resample_roulette(np.full(100, 0.01), rng)]
    return left


@computes("particles.variance_lost")
def variance_lost():
    """Variance of the poses of the particles that 2000 rounds of roulette leave."""
    return Computed(
        np.random.default_rng(12).standard_normal((100, 3))[_survivors()].var(0).sum(),
        proof="M copies of one particle have no variance: it follows from the sentence before.",
    )


@computes("particles.spoke_unchanged")
def spoke_unchanged():
    rng = np.random.default_rng(12)
    kept = np.arange(100)
    for _ in range(2000):
        kept = kept[particles.resample_systematic(np.full(100, 0.01), rng)]
    changed = int((kept != np.arange(100)).sum())
    return Computed(f"{changed} changed" if changed else "unverändert")


@computes("particles.copies")
def copies():
    return Computed("M" if np.bincount(_survivors()).max() == 100 else "fewer than M")


@computes("particles.field_speed")
def field_speed():
    """Distances to obstacle points for one scan of 541 beams and 1000 particles: searched, or computed in advance."""
    building = load_building()
    search, ahead = (n * len(building.points) for n in (541 * 1000, building.grid.cells.size))
    return Computed(
        "wesentlich beschleunigt" if search > 10 * ahead else f"{search / ahead:.1f} times faster",  # ten: our choice
        simulated=True,
        proof=f"On our building one scan of 541 beams and 1000 particles asks for {search / 1e6:.0f} million "
        f"distances; computed in advance, for every cell of the map, it is {ahead / 1e6:.0f} million, once for all "
        f"scans: {search / ahead:.0f} times fewer with the first scan.",
    )


def _errors(start, seed=21):
    building, rng = load_building(), np.random.default_rng(seed)
    noise = example_noise()
    suite, drive = SensorSuite(building), random_drive(building, noise, 30, rng)
    motion, known = particles.odometry_motion(**noise), drive.truth[0] if start else None
    filter_ = localizer(building.grid, motion, 3000, rng, start=known)
    for u, pose in zip(drive.controls, drive.truth[1:]):
        filter_.step(u, drive.dt, suite.measure("landmarks", pose, rng), rng)
    return float(np.hypot(*(filter_.estimate().pose - drive.truth[-1])[:2]))


@computes("particles.variants")
def variants():
    """One run of each variant that arrives shows that it can; within three cells of the map, which is our choice."""
    errors = {"lokal": _errors(True), "global": _errors(False)}
    return Computed(
        " und ".join(word for word, error in errors.items() if error < 0.3),
        simulated=True,
        proof=f"Seeded runs in our building end {errors['lokal']:.2f} m from the truth with the start known, "
        f"{errors['global']:.2f} m with it unknown.",
    )


@computes("particles.soccer_path")
def soccer_path():
    run = soccer_run()
    mcl = np.sqrt(np.square(run.estimates - run.truth[1:])[:, :2].sum(1).mean())
    odometry = np.sqrt(np.square(run.odometry - run.truth)[:, :2].sum(1).mean())
    return Computed(
        "über MCL ermittelter Weg" if mcl < odometry else "über Odometrie gemessener Weg",
        simulated=True,
        proof=f"The run was never published. Simulated with six landmarks, the path found by MCL is off "
        f"by {mcl:.2f} m (RMS), the one measured by odometry by {odometry:.2f} m.",
    )
