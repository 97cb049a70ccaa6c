"""Tip error beside the Cramer-Rao bound, and failed runs, with and without outliers: python
tests/bench/pivot_accuracy.py [runs]

Poses as in the peers' comparison: turns up to 45 deg about random axes, tip 150 mm, 0.1 deg and 0.2 mm, gross
outliers of 20 to 50 mm. The bound counts all poses, good and bad. A run has failed when it raises or when its tip is
off by more than five times the bound.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from labkit.calibration import pivot
from labkit.geometry.lie import exp_so3

TIP, PIVOT = np.array([12.0, -8.0, 150.0]), np.array([100.0, 50.0, -900.0])
STD_ROT, STD_TRANS = np.deg2rad(0.1), 0.2


def poses(rng, n, outliers):
    """Measured poses and their true rotations."""
    axis = rng.normal(size=(n, 3))
    axis *= np.deg2rad(45) * rng.uniform(0.1, 1, (n, 1)) / np.linalg.norm(axis, axis=1, keepdims=True)
    R = exp_so3(axis)
    T = pivot.touching_poses(R, TIP, PIVOT, STD_ROT, STD_TRANS, rng)
    bad = rng.permutation(n)[: int(outliers * n)]
    away = rng.normal(size=(len(bad), 3))
    T[bad, :3, 3] += rng.uniform(20, 50, (len(bad), 1)) * away / np.linalg.norm(away, axis=1, keepdims=True)
    return T, R


METHODS = {
    "plain": lambda T: pivot.calibrate_pivot(T),
    "weighted": lambda T: pivot.calibrate_pivot(T, STD_ROT, STD_TRANS),
    "robust": lambda T: pivot.calibrate_pivot(T, robust=True),
    "robust, weighted": lambda T: pivot.calibrate_pivot(T, STD_ROT, STD_TRANS, robust=True),
}


def main(runs):
    print(f"{runs} runs; tip error (rms) / bound, mean NEES of the tip (3 expected), failed runs")
    for outliers in (0.0, 0.1, 0.3):
        for n in (20, 100, 1000):
            rng = np.random.default_rng([n, int(100 * outliers)])
            squares, bound, nees, failed = (
                {m: [] for m in METHODS},
                [],
                {m: [] for m in METHODS},
                dict.fromkeys(METHODS, 0),
            )
            for _ in range(runs):
                T, R = poses(rng, n, outliers)
                bound.append(np.trace(pivot.predicted_covariance(R, TIP, STD_ROT, STD_TRANS)[:3, :3]))
                for name, method in METHODS.items():
                    try:
                        result = method(T)
                    except ValueError:
                        failed[name] += 1
                        continue
                    error = result.tip - TIP
                    squares[name].append(error @ error)
                    nees[name].append(error @ np.linalg.solve(result.covariance[:3, :3], error))
                    failed[name] += error @ error > 25 * bound[-1]
            for name in METHODS:
                ratio = np.sqrt(np.mean(squares[name]) / np.mean(bound))
                print(
                    f"{outliers:4.0%}  N={n:4}  {name:17} {ratio:8.3f} {np.mean(nees[name]):8.2f} {failed[name]:6}",
                    flush=True,
                )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
