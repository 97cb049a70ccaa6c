"""Accuracy of hand-eye methods against the Cramer-Rao bound, written to data/tracker/hand_eye_methods.csv.

    python tests/bench/hand_eye_methods.py [trials]

Needs "opencv-python-headless<5" and scipy, in an environment of its own. Robot poses exact, turns up to 60 deg about
random axes, positions within +-200 mm, the target about 700 mm away; noise per axis on the sensor's readings; 20 poses,
400 trials, seeds as below.
"""

import csv
import sys
from pathlib import Path

import cv2
import numpy as np

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT))

from labkit.calibration import ax_xb
from labkit.fast.ax_xb import calibrate_hand_eye
from labkit.geometry.frames import invert, pose, rotation_angle
from labkit.geometry.lie import exp_so3

POSES = 20
CASES = ((0.1, 0.1), (0.1, 1.0), (0.5, 0.1), (0.5, 1.0))  # deg, mm
T_FS = pose(exp_so3([0.3, -0.5, 1.1]), [30.0, -20.0, 120.0])
T_BT = pose(exp_so3([2.0, 0.4, -0.3]), [700.0, 80.0, -150.0])
OPENCV = ("TSAI", "PARK", "HORAUD", "ANDREFF", "DANIILIDIS")


def draw(rng, std_rot, std_trans):
    axes = rng.normal(size=(POSES, 3))
    axes *= np.deg2rad(60) * rng.uniform(0.1, 1, (POSES, 1)) / np.linalg.norm(axes, axis=1, keepdims=True)
    T_BF = pose(exp_so3(axes), rng.uniform(-200, 200, (POSES, 3)))
    exact = invert(T_FS) @ invert(T_BF) @ T_BT
    noise = pose(
        exact[:, :3, :3] @ exp_so3(std_rot * rng.normal(size=(POSES, 3))),
        exact[:, :3, 3] + std_trans * rng.normal(size=(POSES, 3)),
    )
    return T_BF, exact, noise


def opencv(T_BF, T_ST, method):
    R, t = cv2.calibrateHandEye(
        T_BF[:, :3, :3],
        T_BF[:, :3, 3],
        T_ST[:, :3, :3],
        T_ST[:, :3, 3],
        method=getattr(cv2, f"CALIB_HAND_EYE_{method}"),
    )
    return pose(R, t.ravel())


def main(trials=400):
    rows = []
    for deg, mm in CASES:
        rng = np.random.default_rng([6, int(10 * deg), int(10 * mm)])
        errors, bounds = {}, []
        for _ in range(trials):
            T_BF, exact, T_ST = draw(rng, np.deg2rad(deg), mm)
            covariance = calibrate_hand_eye(T_BF, exact, np.deg2rad(deg), mm).covariance
            bounds.append([np.trace(covariance[:3, :3]), np.trace(covariance[3:6, 3:6])])
            motions = T_BF[:-1], T_ST[:-1]
            found = {f"OpenCV {m.title()}": opencv(T_BF, T_ST, m) for m in OPENCV}
            found["report"] = ax_xb.solve_ax_xb(invert(T_BF[1:]) @ motions[0], T_ST[1:] @ invert(motions[1]))
            found["maximum likelihood"] = calibrate_hand_eye(T_BF, T_ST).T_FS
            for name, T in found.items():
                errors.setdefault(name, []).append(
                    [rotation_angle(T_FS[:3, :3].T @ T[:3, :3]), np.linalg.norm(T[:3, 3] - T_FS[:3, 3])]
                )
        limit = np.sqrt(np.mean(bounds, axis=0))
        for name, e in errors.items():
            ratio = np.sqrt(np.mean(np.square(e), axis=0)) / limit
            rows.append([deg, mm, name, f"{ratio[0]:.3g}", f"{ratio[1]:.3g}"])
            print(rows[-1], flush=True)
    with open(ROOT / "data/tracker/hand_eye_methods.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerows([["std_deg", "std_mm", "method", "rotation", "translation"], *rows])


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
