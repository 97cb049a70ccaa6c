"""Lecture, Monte-Carlo localization, its sensors and maps: printed figures, costs, claims, and the algorithm as
printed.
"""

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


def _bisections(m, rng):
    """Comparisons of a binary search for one spin of the roulette wheel with m intervals, averaged over spins."""
    ends = np.cumsum(np.full(m, 1 / m))
    count = 0
    for spin in rng.random(200):
        low, high = 0, m
        while low < high:
            middle = (low + high) // 2
            low, high = (middle + 1, high) if ends[middle] <= spin else (low, middle)
            count += 1
    return count / 200


@computes("particles.roulette_cost")
def roulette_cost():
    sizes = 2 ** np.arange(6, 15, 2)
    rng = np.random.default_rng(10)
    slope = np.polyfit(np.log2(sizes), [_bisections(m, rng) for m in sizes], 1)[0]
    return Computed("O(M log(M))" if abs(slope - 1) < 0.02 else f"{slope:.2f} log2 M comparisons a draw")


@computes("particles.spoke_cost")
def spoke_cost():
    rng, steps = np.random.default_rng(11), []
    sizes = (500, 1000, 2000, 4000)
    for m in sizes:
        weights = rng.exponential(size=m)
        distance, n, count = weights.sum() / m, 0, 0
        spoke, end = rng.uniform(0, distance), weights[0]
        for _ in range(m):
            while spoke > end and n < m - 1:
                n += 1
                end += weights[n]
                count += 1
            spoke += distance
            count += 1
        steps.append(count)
    exponent = np.polyfit(np.log(sizes), np.log(steps), 1)[0]
    return Computed("O(M)" if abs(exponent - 1) < 0.01 else f"O(M^{exponent:.2f})")


@computes("particles.spoke_distance")
def spoke_distance():
    """Over all positions of the first spoke in [0, d], particle i must be pointed at M w_i / W times on average."""
    weights = np.array([3.0, 1.0, 0.5, 2.5, 4.0])
    total, m = weights.sum(), len(weights)
    first = (np.arange(20_000) + 0.5) / 20_000 * total / m
    spokes = first[:, None] + np.arange(m) * total / m
    mean = np.bincount(np.searchsorted(np.cumsum(weights), spokes.ravel()), minlength=m) / len(first)
    return Computed("W/M" if np.abs(mean - m * weights / total).max() < 1e-3 else "not W/M")


@computes("particles.variance_lost")
def variance_lost():
    """Pose variance of 100 particles of a standing robot after 2000 rounds of roulette."""
    rng = np.random.default_rng(12)
    cloud, equal = rng.standard_normal((100, 3)), np.full(100, 0.01)
    for _ in range(2000):
        cloud = cloud[particles.resample_roulette(equal, rng)]
    return Computed(cloud.var(0).sum())


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
    names, rng = np.arange(100), np.random.default_rng(13)
    for _ in range(2000):
        names = names[particles.resample_roulette(np.ones(100), rng)]
    return Computed("M" if np.unique(names, return_counts=True)[1][0] == 100 else "fewer than M")


@computes("particles.field_speed")
def field_speed():
    """Distances to compute for one scan of 541 beams and 1000 particles: searched each time, or looked up."""
    building = load_building()
    search = 541 * 1000 * len(building.points)
    table = building.grid.cells.size + 541 * 1000
    return Computed(
        "wesentlich beschleunigt" if search > 100 * table else f"{search / table:.1f} times faster",
        simulated=True,
        proof=f"On our building: {search / table:.0f} times fewer distances for one scan of 541 beams and 1000 "
        "particles.",
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
    found = [word for word, start in (("lokal", True), ("global", False)) if _errors(start) < 0.3]
    return Computed(
        " und ".join(found), simulated=True, proof="Seeded runs in our building end within 0.3 m of the truth."
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
