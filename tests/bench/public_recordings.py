"""`calibrate` on recordings of other laboratories, with the noise of real robots and cameras, beside OpenCV's methods.

    python tests/bench/public_recordings.py FOLDER [--fetch]

FOLDER holds the files, which are not part of this repository. With --fetch the ones that are missing are taken from
github.com; where that is not reachable, put them there by hand:

    robot_arm_w_color_camera_real.zip, prime_sense_color_w_vicon_1.zip, prime_sense_color_w_vicon_2.zip
        github.com/ethz-asl/hand_eye_calibration, folder datasets; BSD 3-Clause, (c) 2017 ETHZ ASL. A robot arm that
        carries a camera, and a camera tracked by Vicon. Source: Furrer et al., "Evaluation of Combined Time-Offset
        Estimation and Hand-Eye Calibration on Robotic Datasets", Field and Service Robotics 2017.
    pose_samples.json
        github.com/moveit/moveit_calibration, moveit_calibration_plugins/handeye_calibration_solver/test;
        BSD 3-Clause, (c) 2020 ROS Planning. 50 pairs of a robot and a camera beside it, "real data" by their test.

Nobody knows the truth of a real recording. So the rows are cut into blocks, every method is given the even ones, and
judged by the odd ones: how far from one place each row puts the target, with a place fitted robustly for each method
alike (median, and what 90 % of the rows stay below). The clock offset is found by `calibrate` and given to all. And the
two halves, calibrated apart, must agree within what their covariances tell: d' (C1 + C2)^-1 d / 6 is 1 on average where
the readings err independently of each other. In a stream they do not: neighbors share their errors.
"""

import argparse
import io
import sys
import time
import urllib.request
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

import own_data

from labkit.calibration import calibrate
from labkit.estimation.clocks import clock_offset, sample_stream
from labkit.fast.ax_xb import calibrate_hand_eye
from labkit.files.poses import read_pairs, read_poses
from labkit.geometry.frames import invert, pose, pose_distance
from labkit.geometry.lie import exp_so3, log_so3

ETH = "https://github.com/ethz-asl/hand_eye_calibration/raw/master/datasets/"
MOVEIT = (
    "https://github.com/moveit/moveit_calibration/raw/master/"
    "moveit_calibration_plugins/handeye_calibration_solver/test/"
)
STREAMS = ("robot_arm_w_color_camera_real", "prime_sense_color_w_vicon_1", "prime_sense_color_w_vicon_2")
ROWS, BLOCKS = 300, 10  # of a stream, spread evenly; blocks of neighbors that are used or judged together


@dataclass
class Recording:
    """Rows that belong together: flange in base, target in sensor (mm), and what was done to the clocks."""

    name: str
    robot: np.ndarray
    sensor: np.ndarray
    about: str


def fetch(folder):
    """Take what is missing from its laboratory."""
    folder.mkdir(parents=True, exist_ok=True)
    for address in [*(f"{ETH}{name}.zip" for name in STREAMS), f"{MOVEIT}pose_samples.json"]:
        path = folder / address.rpartition("/")[2]
        if not path.exists():
            try:
                path.write_bytes(urllib.request.urlopen(address, timeout=60).read())
            except OSError as error:
                print(f"{path.name}: not fetched ({error}); put it there by hand")


def recordings(folder):
    """What of the four recordings lies in the folder."""
    for name in STREAMS:
        if (folder / f"{name}.zip").exists():
            yield stream(folder, name)
    if (folder / "pose_samples.json").exists():
        robot, sensor = read_pairs(folder / "pose_samples.json")
        robot = invert(robot.in_unit("mm").T)  # the camera stands beside the robot: eye to hand
        yield Recording("MoveIt's samples", robot, sensor.in_unit("mm").T, "eye to hand, no times")


def stream(folder, name):
    """Two streams of an archive on one clock: the body in its base, and the target in the camera."""
    place = folder / name
    with zipfile.ZipFile(io.BytesIO((folder / f"{name}.zip").read_bytes())) as archive:
        files = [entry for entry in archive.namelist() if entry.endswith(".csv")]
        for entry in files:
            (place / Path(entry).name).parent.mkdir(exist_ok=True)
            (place / Path(entry).name).write_bytes(archive.read(entry))
    camera = next(f for f in files if "target" in f or "camera" in Path(f).name)
    body = next(f for f in files if f != camera)
    a, b = (once(read_poses(place / Path(f).name, any_size=True).in_unit("mm")) for f in (body, camera))
    clocks = clock_offset(a[0], a[1], b[0], b[1])
    robot, known = sample_stream(a[0], a[1], b[0] - clocks.offset)
    rows = np.flatnonzero(known)
    rows = rows[np.linspace(0, len(rows) - 1, min(ROWS, len(rows))).astype(int)]
    said = f"clock {1e3 * clocks.offset:.1f} ms +- {1e3 * clocks.std:.1f} ms"
    # the camera's file holds the camera in the frame of its target
    return Recording(name, robot[rows], invert(b[1][rows]), f"{len(a[0])} and {len(b[0])} samples, {said}")


def once(poses):
    """Times and poses in order, repeated times left out."""
    order = np.argsort(poses.time, kind="stable")
    order = order[np.concatenate([[True], np.diff(poses.time[order]) > 0])]
    return poses.time[order], poses.T[order]


def halves(n):
    """The even and the odd blocks of n rows."""
    block = np.arange(n) * BLOCKS // n
    return block % 2 == 0, block % 2 == 1


def spread(targets):
    """Angle (deg) and distance of poses from the one they agree on best: medians, twice trimmed."""
    middle = targets[np.argmin(np.median(pose_distance(targets[:, None], targets[None])[1], axis=1))]
    for _ in range(3):
        turn = log_so3(np.swapaxes(middle[None, :3, :3], 1, 2) @ targets[:, :3, :3])
        shift = targets[:, :3, 3]
        middle = pose(middle[:3, :3] @ exp_so3(np.median(turn, axis=0)), np.median(shift, axis=0))
    angle, distance = pose_distance(middle, targets)
    return np.rad2deg(angle), distance


def judged(recording):
    """Print how the methods do on rows they have not seen."""
    used, kept = halves(len(recording.robot))
    print(f"\n{recording.name}: {recording.about}; {len(used)} rows", flush=True)
    for name, method in own_data.methods().items():
        if name == "scipy":  # it starts from the truth, which nobody has
            continue
        began = time.process_time()
        try:
            X = method(recording.robot[used], recording.sensor[used], None)
        except own_data.FAILURES as error:
            print(f"  {name:<14} failed: {' '.join(str(error).split())[:90]}")
            continue
        took = time.process_time() - began
        angle, distance = spread(recording.robot[kept] @ X @ recording.sensor[kept])
        print(
            f"  {name:<14} median {np.median(distance):7.2f} mm {np.median(angle):6.3f} deg   90 % below "
            f"{np.quantile(distance, 0.9):7.2f} mm {np.quantile(angle, 0.9):6.3f} deg   {1e3 * took:6.1f} ms",
            flush=True,
        )
    agreement(recording, used, kept)


def agreement(recording, *parts):
    """Print how far the two halves' calibrations are apart, beside what they tell."""
    try:
        one, other = (
            calibrate.hand_eye(recording.robot[part], recording.sensor[part], solver=calibrate_hand_eye)
            for part in parts
        )
    except ValueError as refusal:
        print(f"  halves: {refusal}")
        return
    d = own_data.error(one.T, other.T)
    score = d @ np.linalg.solve(one.covariance + other.covariance, d) / 6
    length, angle = np.linalg.norm(d[3:]), np.rad2deg(np.linalg.norm(d[:3]))
    print(
        f"  halves apart by {length:.2f} mm and {angle:.3f} deg; in what they tell: {score:.1f}; rejected "
        f"{len(one.rejected)} and {len(other.rejected)} of {one.rows} and {other.rows}"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--fetch", action="store_true")
    options = parser.parse_args()
    if options.fetch:
        fetch(options.folder)
    found = list(recordings(options.folder))
    for recording in found:
        judged(recording)
    if not found:
        sys.exit(f"{options.folder} holds none of the recordings; the first lines of this file say where they are")
