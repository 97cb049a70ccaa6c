"""Success rates of Monte-Carlo localization in the building over seeded runs, with every sensor model.

    python tests/bench/mcl_success.py [--runs 100] [--tasks global adaptive kidnapped camera] [--write]

Global: 5000 particles spread over the whole building; success when after 60 steps the estimate (the heaviest cluster)
lies within 0.3 m and 10 deg of the truth. Adaptive: the same with KLD sampling. Camera: the same with the lecture's
RGBD camera in place of its laser scanner (`sensors.XTION`), for the two models that weigh scans. Kidnapped: the robot
is tracked for 20 steps and then put into another room; success when within 60 steps the estimate is right again, and
stays so for five steps. The intervals are Clopper and Pearson's, 95 %.
`--write` stores the table as data/monte_carlo/success.csv.
"""

import argparse
import csv
import sys
import time
from pathlib import Path

import numpy as np
from scipy.stats import beta

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from labkit.documents.lecture.examples import load_building
from labkit.documents.lecture.printed import example_noise
from labkit.fast.sensors import SensorSuite
from labkit.geometry import planar
from labkit.localization import mcl
from labkit.localization.drives import random_drive
from labkit.localization.particles import KldSampling, odometry_motion
from labkit.localization.sensors import SENSORS, XTION

N_PARTICLES, N_STEPS, N_TRACKED, N_STAY = 5000, 60, 20, 5
NEAR, TURN = 0.3, np.radians(10)
NOISE = example_noise()
MOTION = odometry_motion(**NOISE)
HEADER = ("task", "model", "runs", "successes", "low", "high", "median_steps", "median_error", "median_error_deg")


def errors(filter_, pose):
    """Distance (m) and angle (rad) between the estimate and the true pose."""
    found = filter_.estimate().pose
    return np.hypot(*(found[:2] - pose[:2])), abs(planar.wrap_angle(found[2] - pose[2]))


def steps_right(suite, model, filter_, drive, rng, world=None):
    """Errors after each step of a drive, shape (n, 2)."""
    found = []
    for u, pose in zip(drive.controls, drive.truth[1:]):
        filter_.step(u, drive.dt, suite.measure(model, pose, rng, world), rng)
        found.append(errors(filter_, pose))
    return np.array(found)


def is_right(found):
    return (found[:, 0] < NEAR) & (found[:, 1] < TURN)


def first_stay(right):
    """Number of steps until the first of N_STAY right ones in a row, or None."""
    run = np.convolve(right, np.ones(N_STAY), "valid") == N_STAY
    return int(np.argmax(run)) + 1 if run.any() else None


def run_global(suite, model, seed, **options):
    """(success, steps until right and staying, last errors) of one global localization."""
    rng = np.random.default_rng([1, seed])
    drive = random_drive(suite.building, NOISE, N_STEPS, rng)
    filter_ = mcl.localizer(suite.building.grid, MOTION, N_PARTICLES, rng, **options)
    found = steps_right(suite, model, filter_, drive, rng)
    right = is_right(found)
    return bool(right[-1]), first_stay(right), found[-1]


def run_adaptive(suite, model, seed):
    """The same with a number of particles that adapts, from N_PARTICLES down to 2000."""
    return run_global(suite, model, seed, adaptive=KldSampling(n_min=2000, epsilon=0.005))


def run_kidnapped(suite, model, seed):
    """(success, steps until right and staying, last errors) of one kidnapping."""
    rng = np.random.default_rng([2, seed])
    before = random_drive(suite.building, NOISE, N_TRACKED, rng)
    filter_ = mcl.localizer(suite.building.grid, MOTION, N_PARTICLES, rng, start=before.truth[0])
    steps_right(suite, model, filter_, before, rng)
    while True:
        after = random_drive(suite.building, NOISE, N_STEPS, rng)
        if np.hypot(*(after.truth[0, :2] - before.truth[-1, :2])) > 3.0:
            break
    found = steps_right(suite, model, filter_, after, rng)
    steps = first_stay(is_right(found))
    return steps is not None, steps, found[-1]


TASKS = {"global": run_global, "adaptive": run_adaptive, "kidnapped": run_kidnapped, "camera": run_global}


def interval(successes, runs, level=0.95):
    """Clopper and Pearson's interval of a share."""
    a = (1 - level) / 2
    low = beta.ppf(a, successes, runs - successes + 1) if successes else 0.0
    high = beta.ppf(1 - a, successes + 1, runs - successes) if successes < runs else 1.0
    return low, high


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--write", action="store_true", help="store the table in data/monte_carlo/success.csv")
    parser.add_argument("--tasks", nargs="+", choices=list(TASKS), default=list(TASKS))
    args = parser.parse_args()
    building = load_building()
    laser, camera = SensorSuite(building), SensorSuite(building, XTION, every=16)
    rows = []
    for task in args.tasks:
        run, suite = TASKS[task], camera if task == "camera" else laser
        for model in SENSORS[1:] if task == "camera" else SENSORS:
            began = time.perf_counter()
            results = [run(suite, model, seed) for seed in range(args.runs)]
            good = sum(ok for ok, _, _ in results)
            steps = np.median([n for _, n, _ in results if n is not None])
            near, turn = np.median([e for ok, _, e in results if ok], axis=0)
            low, high = interval(good, args.runs)
            figures = (f"{low:.3f}", f"{high:.3f}", f"{steps:g}", f"{near:.3f}", f"{np.degrees(turn):.2f}")
            rows.append((task, model, args.runs, good, *figures))
            print(dict(zip(HEADER, rows[-1])), f"{time.perf_counter() - began:.0f} s", flush=True)
    if args.write:
        with open(ROOT / "data/monte_carlo/success.csv", "w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows([HEADER, *rows])


if __name__ == "__main__":
    main()
