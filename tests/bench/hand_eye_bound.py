"""The acceptance measurement of `calibrate_hand_eye`: error over the Cramer-Rao bound and mean NEES in four noise
cases.

    python tests/bench/hand_eye_bound.py [runs] [batches]

Goal: at most 1.05 times the bound with the noise levels not told, mean NEES 6 +- 0.3 over 400 runs, told and not told.
The mean of 400 runs of a perfect filter has a standard error of 0.17, so one batch in twelve misses 0.3 by chance;
several batches tell chance from a covariance that promises too much. The last columns count the batches inside.
"""

import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "calibration")]

import test_ax_xb as lab

from labkit.fast import ax_xb
from labkit.geometry.frames import invert

BAND = 0.3  # about 6


def batch(n, deg, mm, runs, seed):
    """Squared errors and bounds (rotation, translation) and NEES (told, not told), each the mean over the runs."""
    rng, std_rot = np.random.default_rng(seed), np.deg2rad(deg)
    squares, bounds, nees = [], [], []
    for _ in range(runs):
        T_BF, T_ST = lab.setup(rng, n, std_rot, mm)
        exact = invert(lab.T_FS) @ invert(T_BF) @ lab.T_BT
        C = ax_xb.calibrate_hand_eye(T_BF, exact, std_rot, mm).covariance
        bounds.append([np.trace(C[:3, :3]), np.trace(C[3:6, 3:6])])
        results = ax_xb.calibrate_hand_eye(T_BF, T_ST, std_rot, mm), ax_xb.calibrate_hand_eye(T_BF, T_ST)
        errors = [lab.error(r.T_FS) for r in results]
        squares.append([errors[1][:3] @ errors[1][:3], errors[1][3:] @ errors[1][3:]])
        nees.append([e @ np.linalg.solve(r.covariance[:6, :6], e) for r, e in zip(results, errors)])
    return np.mean(squares, axis=0), np.mean(bounds, axis=0), np.mean(nees, axis=0)


def main(runs=400, batches=5):
    print("poses  deg   mm   rotation  translation  NEES told  not told  inside told  not told")
    for n in (20, 100):
        for deg, mm in ((0.1, 0.1), (0.1, 1.0), (0.5, 0.1), (0.5, 1.0)):
            seed = [n, int(10 * deg), int(10 * mm)]
            squares, bounds, nees = map(np.array, zip(*(batch(n, deg, mm, runs, [*seed, k]) for k in range(batches))))
            ratio = np.sqrt(squares.mean(0) / bounds.mean(0))
            (told, not_told), inside = nees.mean(0), (np.abs(nees - 6) <= BAND).sum(0)
            print(
                f"{n:5}  {deg:.1f}  {mm:.1f}   {ratio[0]:8.3f}  {ratio[1]:11.3f}  {told:9.2f}  {not_told:8.2f}"
                f"  {inside[0]:4} of {batches:3}  {inside[1]:4} of {batches}",
                flush=True,
            )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
