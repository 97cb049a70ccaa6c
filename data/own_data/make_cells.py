"""Write three synthetic cells, each with one planted fault, as their owners would have saved them.

    python data/own_data/make_cells.py

swapped_role   robot.csv (KUKA, mm) and sensor.txt (4 x 4 row by row, m): the sensor in the target instead of the
               target in the sensor.
slipped_screw  robot.csv (x y z and quaternion, m, w first, titles) and sensor.csv (the same): the sensor's bracket
               slips by 2.5 mm and 0.6 deg after row 14 of 24.
late_clock     robot.txt and tracker.txt (TUM, m): 100 and 60 samples a second; the tracker's clock runs 84 ms behind,
               and its record pauses for 1.5 s.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent.parent))

from labkit.geometry.frames import invert, kuka_from_matrix, pose
from labkit.geometry.lie import exp_so3
from labkit.machines.sensor_cell import CELL

SEED = 11
T_FS, T_BT, STD_ROT, STD_TRANS = CELL.T_FS, CELL.T_BT, CELL.std_rot, CELL.std_trans
SLIP, SLIP_AFTER = pose(exp_so3(np.deg2rad([0.0, 0.6, 0.0])), [0.0, 1.5, -2.0]), 14
CLOCK, PAUSE = -0.084, (14.0, 15.5)  # s


def looking(rng, n):
    """Flange poses from which the sensor sees the target from half a meter, tilted up to 30 deg."""
    tilt = np.deg2rad(30) * rng.uniform(-1, 1, (n, 3))
    return CELL.looking(tilt, np.column_stack([rng.uniform(-60, 60, (n, 2)), rng.uniform(420, 580, n)]))


def quaternions(T):
    return Rotation.from_matrix(T[:, :3, :3]).as_quat()


def swapped_role(rng):
    """{file: lines}: the sensor's poses are inverted."""
    robot = looking(rng, 18)
    sensor = invert(CELL.read(robot, rng))
    kuka = kuka_from_matrix(robot)
    kuka[:, 3:] = np.rad2deg(kuka[:, 3:])
    sensor[:, :3, 3] /= 1000
    yield (
        "robot.csv",
        ["X [mm],Y [mm],Z [mm],A [deg],B [deg],C [deg]", *(",".join(f"{v:.4f}" for v in r) for r in kuka)],
    )
    yield "sensor.txt", [" ".join(f"{v:.7f}" for v in T.ravel()) for T in sensor]


def slipped_screw(rng):
    """{file: lines}: the bracket moves after row 14."""
    robot = looking(rng, 24)
    mounting = np.where((np.arange(24) < SLIP_AFTER)[:, None, None], T_FS, T_FS @ SLIP)
    for name, T in (("robot.csv", robot), ("sensor.csv", CELL.read(robot, rng, mounting))):
        q = np.roll(quaternions(T), 1, axis=1)
        rows = np.column_stack([T[:, :3, 3] / 1000, q])
        yield name, ["x [m];y [m];z [m];qw;qx;qy;qz", *(";".join(f"{v:.7f}" for v in row) for row in rows)]


def late_clock(rng):
    """{file: lines}: two streams of one motion."""

    def robot_at(t):
        phi = np.stack([0.5 * np.sin(0.9 * t), 0.4 * np.sin(1.3 * t + 1), 0.6 * np.sin(0.5 * t)], -1)
        way = np.stack([150 * np.sin(0.7 * t), 120 * np.cos(0.5 * t), 80 * np.sin(1.1 * t)], -1)
        return pose(exp_so3(phi), np.array([600.0, 0, 500]) + way)

    time = np.arange(0, 25, 0.01)
    true = np.arange(1.0, 24, 1 / 60)
    true = true[(true < PAUSE[0]) | (true > PAUSE[1])]
    n = len(true)
    seen = invert(T_BT) @ robot_at(true) @ T_FS  # the marker in the world of its tracker
    seen[:, :3, 3] += STD_TRANS * rng.normal(size=(n, 3))
    seen = pose(seen[:, :3, :3] @ exp_so3(STD_ROT * rng.normal(size=(n, 3))), seen[:, :3, 3])
    for name, t, T in (("robot.txt", time, robot_at(time)), ("tracker.txt", true + CLOCK, seen)):
        rows = np.column_stack([T[:, :3, 3] / 1000, quaternions(T)])
        yield name, [f"{a:.4f} " + " ".join(f"{v:.6f}" for v in row) for a, row in zip(t, rows)]


def cells():
    """{cell/file: text} of all three."""
    found = {}
    for number, cell in enumerate((swapped_role, slipped_screw, late_clock)):
        for name, lines in cell(np.random.default_rng([SEED, number])):
            found[f"{cell.__name__}/{name}"] = "\n".join(lines) + "\n"
    return found


if __name__ == "__main__":
    for name, text in cells().items():
        (HERE / name).parent.mkdir(exist_ok=True)
        (HERE / name).write_text(text, encoding="utf-8")
