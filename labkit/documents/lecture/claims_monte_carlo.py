"""Lecture, Monte-Carlo localization, its sensors and maps: printed figures, costs, claims, and the algorithm as
printed.
"""

import numpy as np

from ...fast.maps import cast_rays
from ...fast.sensors import SensorSuite
from ...localization import maps, particles
from ...localization.drives import random_drive
from ...localization.mcl import localizer
from ...localization.sensors import see_landmarks, weigh_doors, weigh_landmarks
from ..ledger import Computed, computes
from .examples import global_example, load_building, soccer_run
from .printed import example_noise

NOTEBOOK = "09_monte_carlo"


def _mcl_as_printed(states):
    """The printed algorithm up to its loop: the particles x_k[i] that the loop can still read."""
    chi_new = chi = []  # first line: both sets are emptied, the input too
    return [x for x in (*chi, *chi_new) if x in states]


@computes("particles.mcl_first_line")
def mcl_first_line():
    states = list(range(1000))
    left = len(_mcl_as_printed(states))
    return Computed(
        "χ'_{k+1} = χ_{k+1} = ∅",
        misprint=left == 0,
        proof=f"Executed as printed, the first line empties the input: of {len(states)} particles the "
        f"loop finds {left} to read. The sets filled below are those of step k + 1.",
    )


@computes("particles.draw_probability")
def draw_probability():
    building = load_building()
    rng = np.random.default_rng(9)
    pose, marks = np.array([8.4, 2.4, 0.0]), building.landmarks
    index, z = see_landmarks(building.grid, pose, marks, rng)
    weigh = weigh_landmarks(z, marks[index], 0.1, 0.035)
    near = pose + 0.05 * rng.standard_normal((1000, 3))
    total = np.exp(weigh(near)).sum()
    return Computed(
        "mit Wahrscheinlichkeit w_i / W",
        proof=f"Densities need not add up to 1: for 1000 particles about a pose in the hall W = {total:.3g}. "
        "The roulette slide has it right: it spins on [0, w_1 + ... + w_M], which divides by W.",
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
    return Computed("wesentlich beschleunigt" if search > 100 * table else f"{search / table:.1f} times faster")


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
    return Computed(" und ".join(found))


@computes("particles.twelve_pictures")
def twelve_pictures():
    building = load_building()
    pictures = global_example(building)
    error = [float(np.hypot(*(p.estimate - p.truth)[:2])) for p in pictures]
    spread = [float(np.sqrt(np.trace(np.cov(p.states[:, :2].T)))) for p in pictures]
    return Computed(
        len(pictures) if error[-1] < 0.3 else 0,
        simulated=True,
        proof=f"The slides show pictures without numbers. Simulated on our building: the cloud shrinks "
        f"from {spread[0]:.1f} m to {spread[-1]:.1f} m over {len(pictures)} steps, the estimate's error "
        f"from {error[0]:.1f} m to {error[-1]:.1f} m.",
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


@computes("particles.idea")
def idea():
    """Pictures (a) to (e): positions along a corridor after two looks at doors and two moves."""
    rng, doors = np.random.default_rng(14), np.array([2.0, 4.0, 9.0])
    x = rng.uniform(0, 12, 2000)
    spread = [x.std()]
    for _ in range(2):
        weigh = weigh_doors(doors, saw_door=True)
        x = x[particles.resample_systematic(np.exp(weigh(x)), rng)]
        x = x + 2.0 + 0.1 * rng.standard_normal(x.size)
        spread.append(x.std())
    near = np.mean(np.abs(x - 6.0) < 0.5)
    return Computed(
        "(a) - (e)" if near > 0.4 else "(a)",
        simulated=True,
        proof=f"The figure has no numbers. Simulated with three doors at 2, 4 and 9 m and moves of 2 m: "
        f"the positions spread over {spread[0]:.1f} m at (a), and after (e) {100 * near:.0f} % of them lie within "
        "0.5 m of the one place that fits.",
    )


@computes("particles.first_obstacle")
def first_obstacle():
    """The beam model's expected distance: traced rays against an exact walk through the cells."""
    grid = load_building().grid
    bearings = np.linspace(-2.3, 2.3, 24)
    traced = cast_rays(grid, (8.4, 2.4, 0.3), bearings, 18.0)
    walked = [maps.walk_ray(grid, (8.4, 2.4, 0.3), b, 18.0) for b in bearings]
    share = np.mean(np.abs(traced - walked) < grid.resolution)
    return Computed("zum ersten Hindernispunkt" if share > 0.9 else "nicht zum ersten")
