"""`calibrate.hand_eye` on data of one's own, beside what people use instead: OpenCV's methods and plain least squares.

    python tests/bench/own_data.py [runs] [--nees RUNS] [--times]

Error of sensor on flange over the Cramer-Rao bound of the good rows (rotation | translation), failed runs, and the
median processor time of a run, for N = 10, 20, 100, noise of 0.1 and 0.5 deg, 0.1 and 1 mm, and 0, 10, 30 % outliers
(tens of mm, about 20 deg). OpenCV takes part where `cv2` can be imported (opencv-python-headless below 5; a later one
has no `calibrateHandEye`); it is no dependency of the workbook. Goals: 1.05 without outliers, 1.15 with 10 %, no
failed run; mean NEES of 1000 runs within its 99 % band; 3000 poses in 1 s, 20 in 10 ms.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np
from scipy import stats
from scipy.optimize import least_squares

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from labkit.calibration import calibrate
from labkit.calibration.own_data import HandEyeModel
from labkit.estimation.influence import inverse_normal
from labkit.fast.ax_xb import calibrate_hand_eye
from labkit.geometry.frames import invert, pose
from labkit.geometry.lie import exp_so3, log_so3

try:
    import cv2
except ImportError:
    cv2 = None


FAILURES = (ValueError, np.linalg.LinAlgError, *([cv2.error] if cv2 else []))


def cell(rng, n, std_rot, std_trans, share):
    """Robot and sensor poses, the truth (T_FS, T_BT), and the good rows."""
    robot = pose(exp_so3(np.deg2rad(35) * rng.uniform(-1, 1, (n, 3))), rng.uniform(-200, 200, (n, 3)))
    X = pose(exp_so3(rng.normal(size=3)), rng.uniform(-100, 100, 3))
    Y = pose(exp_so3(rng.normal(size=3)), [700.0, 50.0, -60.0])
    sensor = invert(robot @ X) @ Y
    sensor[:, :3, :3] = sensor[:, :3, :3] @ exp_so3(std_rot * rng.normal(size=(n, 3)))
    sensor[:, :3, 3] += std_trans * rng.normal(size=(n, 3))
    bad = rng.permutation(n)[: round(share * n)]
    sensor[bad, :3, :3] = exp_so3(0.3 * rng.normal(size=(len(bad), 3))) @ sensor[bad, :3, :3]
    sensor[bad, :3, 3] += 40 * rng.normal(size=(len(bad), 3))
    return robot, sensor, (X, Y), np.setdiff1d(np.arange(n), bad)


def error(T, X):
    return np.concatenate([log_so3(X[:3, :3].T @ T[:3, :3]), T[:3, 3] - X[:3, 3]])


def bound(robot, truth, good, std_rot, std_trans):
    """Variances (rotation, translation) that no unbiased estimate beats, summed over the axes."""
    model = HandEyeModel(robot[good], invert(robot[good] @ truth[0]) @ truth[1])
    J = model.linearize(truth)[1] / np.repeat([std_rot, std_trans], 3)[:, None]
    C = inverse_normal(J)
    return np.trace(C[:3, :3]), np.trace(C[3:6, 3:6])


def scipy_reference(robot, sensor, start):
    """Plain least squares over all rows from the truth, rotations in units of 0.1 deg, translations of 0.1 mm."""
    model = HandEyeModel(robot, sensor)
    scale = np.repeat([np.deg2rad(0.1), 0.1], 3)

    def moved(p):
        return tuple(pose(T[:3, :3] @ exp_so3(d[:3]), T[:3, 3] + d[3:]) for T, d in zip(start, (p[:6], p[6:])))

    found = least_squares(lambda p: (model.linearize(moved(p))[0] / scale).ravel(), np.zeros(12), x_scale="jac")
    return moved(found.x)[0]


def methods():
    """{name: function of (robot, sensor, truth) -> T_FS}."""
    found = {"labkit": lambda r, s, _: calibrate.hand_eye(r, s, solver=calibrate_hand_eye).T, "scipy": scipy_reference}
    if cv2 is None:
        return found
    for name in ("TSAI", "PARK", "HORAUD", "ANDREFF", "DANIILIDIS"):
        found[f"cv {name.title()}"] = _opencv(getattr(cv2, f"CALIB_HAND_EYE_{name}"))
    for name in ("SHAH", "LI"):
        found[f"cv world {name.title()}"] = _opencv_world(getattr(cv2, f"CALIB_ROBOT_WORLD_HAND_EYE_{name}"))
    return found


def _opencv(method):
    def run(robot, sensor, _):
        R, t = cv2.calibrateHandEye(
            robot[:, :3, :3], robot[:, :3, 3], sensor[:, :3, :3], sensor[:, :3, 3], method=method
        )
        return pose(R, t.ravel())

    return run


def _opencv_world(method):
    """Its letters: world -> camera is T_SW, base -> gripper is T_FB; it gives base -> world and gripper -> camera."""

    def run(robot, sensor, _):
        inverse = invert(robot)
        found = cv2.calibrateRobotWorldHandEye(
            sensor[:, :3, :3], sensor[:, :3, 3], inverse[:, :3, :3], inverse[:, :3, 3], method=method
        )
        return invert(pose(found[2], found[3].ravel()))

    return run


def table(runs):
    """Print error over bound, failed runs and times of every method in every case."""
    for n in (10, 20, 100):
        for share in (0.0, 0.1, 0.3):
            for deg, mm in ((0.1, 0.1), (0.1, 1.0), (0.5, 0.1), (0.5, 1.0)):
                print(f"N = {n}, {deg} deg, {mm} mm, {100 * share:.0f} % outliers", flush=True)
                for name, method in methods().items():
                    few = runs if name == "labkit" else min(runs, 30 if name == "scipy" or n == 100 else runs)
                    print(f"  {name:<14} {compare(method, n, np.deg2rad(deg), mm, share, few)}", flush=True)


def compare(method, n, std_rot, std_trans, share, runs):
    squares, bounds, times, failed = [], [], [], 0
    for run in range(runs):
        robot, sensor, truth, good = cell(np.random.default_rng([n, run]), n, std_rot, std_trans, share)
        began = time.process_time()
        try:
            e = error(method(robot, sensor, truth), truth[0])
        except FAILURES:
            failed += 1
            continue
        times.append(time.process_time() - began)
        squares.append([e[:3] @ e[:3], e[3:] @ e[3:]])
        bounds.append(bound(robot, truth, good, std_rot, std_trans))
    if not squares:
        return f"all {runs} runs failed"
    ratio = np.sqrt(np.sum(squares, 0) / np.sum(bounds, 0))
    return f"{ratio[0]:7.2f} | {ratio[1]:7.2f}   failed {failed:3} of {runs}   {1e3 * np.median(times):7.2f} ms"


def honesty(runs):
    """Print the mean NEES with the 99 % band of a perfect covariance, and how often it passes the 99 % of its law.

    With the noise told NEES is chi-square with 6 degrees of freedom. With the noise estimated from f of them it is
    6 (f - 2) / f F(6, f) where the covariance is that of Student's law: again 6 on average, with longer tails.
    """
    for n in (4, 10, 20, 100):
        scores, freedom = {"told": [], "estimated": []}, []
        for run in range(runs):
            robot, sensor, truth, _ = cell(np.random.default_rng([7, n, run]), n, np.deg2rad(0.1), 0.1, 0.0)
            for name, options in (("told", {"std_rot": np.deg2rad(0.1), "std_trans": 0.1}), ("estimated", {})):
                found = calibrate.hand_eye(robot, sensor, solver=calibrate_hand_eye, **options)
                e = error(found.T, truth[0])
                scores[name].append(e @ np.linalg.solve(found.covariance, e))
            freedom.append(min(found.noise_freedom.values()))
        f = max(float(np.median(freedom)), 5.0)  # below, the law has no variance
        laws = {"told": stats.chi2(6), "estimated": stats.f(6, f, scale=6 * (f - 2) / f)}
        for name, law in laws.items():
            half = 2.576 * law.std() / np.sqrt(runs)
            beyond = np.mean(np.array(scores[name]) > law.ppf(0.99))
            words = "" if name == "told" else f" from {f:.0f} degrees of freedom"
            print(
                f"N = {n}, noise {name}{words}: mean NEES {np.mean(scores[name]):.2f}, 99 % band {6 - half:.2f} to "
                f"{6 + half:.2f}; {100 * beyond:.1f} % beyond the law's 99 %",
                flush=True,
            )


def times():
    """Print what 20 and 3000 poses take, median of nine."""
    for n in (20, 3000):
        robot, sensor, _, _ = cell(np.random.default_rng(n), n, np.deg2rad(0.1), 0.1, 0.1)
        calibrate.hand_eye(robot, sensor, solver=calibrate_hand_eye)
        took = []
        for _ in range(9):
            began = time.process_time()
            calibrate.hand_eye(robot, sensor, solver=calibrate_hand_eye)
            took.append(time.process_time() - began)
        print(f"{n} poses: median {1e3 * np.median(took):.1f} ms, quickest {1e3 * min(took):.1f} ms", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("runs", type=int, nargs="?", default=200)
    parser.add_argument("--nees", type=int, metavar="RUNS")
    parser.add_argument("--times", action="store_true")
    options = parser.parse_args()
    if options.nees:
        honesty(options.nees)
    elif options.times:
        times()
    else:
        table(options.runs)
