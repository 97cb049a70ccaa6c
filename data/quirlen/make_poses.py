"""Write poses.csv: twelve synthetic poses whose calibration gives the numbers the lab sheet prints.

    python data/quirlen/make_poses.py

Orientations: the tool's z axis on a cone of 15 to 30 deg about the vertical, spun by up to 60 deg (drawn with the
seed below). Residuals: drawn from a normal distribution, then conditioned on what is printed. They must be
perpendicular to the columns of the stacked matrix (only then they are residuals of the least-squares solution), the
first and the last are the printed P_test, and together they give the printed s0. Everything else about the real
Kreisel.txt is lost.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent.parent))

from labkit.calibration import pivot
from labkit.documents.lab_sheet import printed as lab_sheet

SEED = 2016
POSES = lab_sheet.poses_in_listing()
TIP, PIVOT = np.array([-1.747805, 44.586360, -87.648108]), np.array([-253.032904, 107.040686, -3.215224])
FIRST, LAST, S0 = (-0.106450, 0.191828, -0.098577), (0.043934, -0.236217, -0.109208), 0.443922


def residuals(R, rng):
    """Residuals (n, 3) of a least-squares solution with given first and last pose and given s0, otherwise random."""
    n = len(R)
    A = pivot.pivot_matrix(pivot.touching_poses(R, TIP, PIVOT))
    fixed = np.eye(3 * n)[[0, 1, 2, -3, -2, -1]]
    constraints, values = np.vstack([A.T, fixed]), np.concatenate([np.zeros(6), FIRST, LAST])
    least = np.linalg.lstsq(constraints, values, rcond=None)[0]
    free = np.linalg.svd(constraints)[2][len(values) :]
    random = free.T @ (free @ rng.normal(size=3 * n))
    rest = n * S0**2 - least @ least
    return (least + random * np.sqrt(rest / (random @ random))).reshape(n, 3)


def lines():
    """The lines of poses.csv."""
    rng = np.random.default_rng(SEED)
    azimuth = 2 * np.pi * (np.arange(POSES) + rng.uniform(-0.3, 0.3, POSES)) / POSES
    tilt = np.deg2rad(rng.uniform(15, 30, POSES))
    axis = np.column_stack([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
    R = pivot.tilted(axis, spin=np.deg2rad(rng.uniform(-60, 60, POSES)))
    abc = np.round(Rotation.from_matrix(R).as_euler("XYZ", degrees=True), 9)
    R = Rotation.from_euler("XYZ", abc, degrees=True).as_matrix()
    p = pivot.touching_poses(R, TIP, PIVOT)[:, :3, 3] + residuals(R, rng)
    yield ",".join(lab_sheet.POSE_COLUMNS)
    for row in np.column_stack([p, abc]):
        yield ",".join(f"{value:.9f}" for value in row)


if __name__ == "__main__":
    (HERE / "poses.csv").write_text("\n".join(lines()) + "\n", encoding="utf-8")
