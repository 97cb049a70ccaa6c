"""Files spoilt at random: every one gives a result or one sentence, never a traceback, a warning or a hang.

    python tests/bench/fuzz_files.py [10000] [first case]

Each case takes the sound files of one command, spoils one of them once to three times (bytes cut or changed, columns
moved or dropped, numbers replaced, rows doubled, swapped or emptied), and runs the command in this process.
"""

import contextlib
import io
import json
import os
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from labkit.__main__ import main
from labkit.geometry.frames import invert, kuka_from_matrix, pose
from labkit.geometry.lie import exp_so3
from labkit.localization import odometry, path

FILES_OF_A_DRIVE = [
    *["localize", "--odometry", "odometry.txt", "--landmarks", "map.csv"],
    *["--measurements", "readings.csv"],
]
NOISE_OF_A_DRIVE = ["--std-range", "0.05", "--std-bearing-deg", "1", "--std-way", "0.01", "--std-turn-deg", "0.5"]
COMMANDS = {
    "hand-eye": ["calibrate", "hand-eye", "--robot", "robot.csv", "--sensor", "sensor.txt"],
    "pairs": ["calibrate", "hand-eye", "--robot", "pairs.json"],
    "pivot": ["calibrate", "pivot", "pivot.txt"],
    "sphere": ["calibrate", "sphere", "--robot", "robot.csv", "--points", "points.csv"],
    "frame": ["calibrate", "frame", "points.csv", "--nominal", "nominal.csv"],
    "compare": ["calibrate", "compare", "--a", "a.txt", "--b", "b.txt"],
    "localize": [*FILES_OF_A_DRIVE, *NOISE_OF_A_DRIVE],
    "fitted": FILES_OF_A_DRIVE,
}
NASTY = [
    "nan",
    "inf",
    "-1e308",
    "1e400",
    "",
    "x",
    "0",
    "1e-320",
    "9" * 400,
    "1,5",
    "--",
    "0x10",
    "٣",
    "1_000",
    "\x1b[31m",
]
SHARES = (0.04, 0.04, 0.1, 0.04, 0.04, 0.14, 0.4, 0.08, 0.04, 0.08)  # of the ways to spoil a file
SLOW = 20.0  # s of processor time that no case may take


def sound_files(folder):
    """Small sound files of every command."""
    rng = np.random.default_rng(0)
    X, Y = pose(exp_so3([0.3, -1.1, 2.0]), [30.0, -20, 100]), pose(exp_so3([1.0, 0.4, -0.2]), [700.0, 50, -60])
    robot = pose(exp_so3(0.5 * rng.normal(size=(12, 3))), rng.uniform(300, 700, (12, 3)))
    sensor = invert(robot @ X) @ Y
    sensor[:, :3, 3] += 0.1 * rng.normal(size=(12, 3))
    kuka = kuka_from_matrix(robot)
    kuka[:, 3:] = np.rad2deg(kuka[:, 3:])
    rows = "\n".join(";".join(f"{v:.4f}".replace(".", ",") for v in row) for row in kuka)
    (folder / "robot.csv").write_text("X [mm];Y [mm];Z [mm];A;B;C\n" + rows)
    np.savetxt(folder / "sensor.txt", sensor.reshape(-1, 16), fmt="%.6f")
    (folder / "pairs.json").write_text(json.dumps([[a.tolist(), b.tolist()] for a, b in zip(robot, sensor)], indent=0))
    touching = pose(robot[:, :3, :3], [500, 0, 300] - robot[:, :3, :3] @ [0, 0, 150.0])
    np.savetxt(folder / "pivot.txt", touching.reshape(-1, 4), fmt="%.6f")
    np.savetxt(folder / "points.csv", sensor[:, :3, 3], fmt="%.4f", delimiter=",", header="x,y,z", comments="")
    np.savetxt(folder / "nominal.csv", sensor[:, :3, 3] + 5, fmt="%.4f", delimiter=",", header="x,y,z", comments="")
    t = 0.05 * np.arange(160)
    phi = np.stack([np.sin(0.9 * t), 0.7 * np.sin(1.7 * t + 1), 0.5 * np.sin(0.4 * t)], -1)
    moving = pose(exp_so3(phi), 0.3 * np.cos(phi))
    for name, T, when in (("a", moving, t), ("b", invert(Y) @ moving @ X, t + 0.3)):
        quaternion = np.concatenate([0.5 * phi, np.ones((160, 1))], 1)
        if name == "b":
            quaternion = np.roll(quaternion, 1, axis=0)
        quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
        np.savetxt(folder / f"{name}.txt", np.column_stack([when, T[:, :3, 3] / 1000, quaternion]), fmt="%.6f")
    _drive_files(folder, rng)


def _drive_files(folder, rng):
    time_ = 0.1 * np.arange(300)
    u = np.stack([0.5 + 0.2 * np.sin(0.3 * time_), 0.3 * np.sin(0.2 * time_) + 0.1], 1)
    x = odometry.drive(np.array([4.0, 3.0, 0.5]), u[:-1], 0.1, "midpoint")
    marks = np.array([[0.0, 0], [10, 0], [10, 8], [0, 8], [5, 11]])
    lines = ["t id range bearing"]
    for k in np.sort(rng.integers(0, 299, 60)):
        m = rng.integers(5)
        z = path.measurement(x[k], marks[m : m + 1])[0] + rng.normal(size=2) * [0.05, 0.02]
        lines.append(f"{time_[k]:.3f} {m} {z[0]:.4f} {z[1]:.4f}")
    (folder / "readings.csv").write_text("\n".join(lines))
    np.savetxt(folder / "odometry.txt", np.column_stack([time_, u]), fmt="%.5f")
    np.savetxt(folder / "map.csv", np.column_stack([np.arange(5), marks]), fmt="%g", delimiter=",")


def spoil(data, rng):
    """The bytes of a file, spoilt in one of ten ways."""
    kind = rng.choice(10, p=SHARES)
    if kind == 0:
        return data[: rng.integers(len(data) + 1)]
    if kind == 1:
        cut = np.sort(rng.integers(0, len(data) + 1, 2))
        return data[: cut[0]] + data[cut[1] :]
    if kind == 2:
        changed = bytearray(data)
        for k in rng.integers(0, max(len(changed), 1), 5):
            if changed:
                changed[k] = rng.integers(256)
        return bytes(changed)
    lines = data.decode("utf-8", errors="replace").splitlines() or [""]
    mark = next((m for m in ";,\t" if m in lines[-1]), " ")
    table = [line.split(mark) for line in lines]
    row, column = rng.integers(len(table)), rng.integers(max(map(len, table)))
    if kind == 3:
        table = [cells[:column] + cells[column + 1 :] for cells in table]
    elif kind == 4:
        order = rng.permutation(max(map(len, table)))
        table = [[cells[k] for k in order if k < len(cells)] for cells in table]
    elif kind == 5:
        table[row][column % len(table[row])] = NASTY[rng.integers(len(NASTY))]
    elif kind == 6:
        table[row][column % len(table[row])] = f"{rng.normal() * 10.0 ** rng.integers(-6, 9):.6g}"
    elif kind == 7:
        table.insert(row, table[rng.integers(len(table))])
    elif kind == 8:
        table[row] = [] if rng.random() < 0.5 else table[row][:-1]
    else:
        factor = 10.0 ** rng.integers(-4, 5)
        table = [[_scaled(c, factor) if k == column else c for k, c in enumerate(cells)] for cells in table]
    return "\n".join(mark.join(cells) for cells in table).encode()


def _scaled(cell, factor):
    try:
        return f"{float(cell) * float(factor):.8g}"  # beyond all numbers it is inf, without a warning
    except ValueError:
        return cell


def one(words, folder, rng):
    """Spoil one file of a command and run it: ("result" or "sentence", what was said); raises what must not happen."""
    files = [word for word in words if (folder / word).is_file()]
    name = files[rng.integers(len(files))]
    before = (folder / name).read_bytes()
    data = before
    for _ in range(1 + (rng.random() < 0.2) + (rng.random() < 0.1)):
        data = spoil(data, rng)
    (folder / name).write_bytes(data)
    out, err, started, here = io.StringIO(), io.StringIO(), time.process_time(), Path.cwd()
    try:
        os.chdir(folder)
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), warnings.catch_warnings():
            warnings.simplefilter("error")
            code = main([*words, "--out", "found"])
        took = time.process_time() - started
        assert took < SLOW, f"{took:.0f} s of processor time"
        said = err.getvalue()
        if code == 0:
            json.loads((folder / "found" / "result.json").read_text(), parse_constant=lambda c: 1 / 0)
            assert not said, said
            return "result", out.getvalue()
        assert code == 1 and said.count("\n") == 1 and 10 < len(said) < 500, (code, said)
        return "sentence", said
    except BaseException:
        (folder / f"bad_{name}").write_bytes(data)
        raise
    finally:
        os.chdir(here)
        (folder / name).write_bytes(before)


def many(count, seed=0, first=0):
    """Run so many cases from a first one on: (counts of (command, outcome), list of (case, traceback))."""
    counts, faults = Counter(), []
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        sound_files(folder)
        for case in range(first, first + count):
            name = "fitted" if case % 50 == 49 else list(COMMANDS)[case % (len(COMMANDS) - 1)]  # the slow one seldom
            try:
                counts[name, one(COMMANDS[name], folder, np.random.default_rng([seed, case]))[0]] += 1
            except Exception:
                faults.append((case, traceback.format_exc()))
    return counts, faults


if __name__ == "__main__":
    total, first = (int(word) for word in [*sys.argv[1:], *("10000", "0")[len(sys.argv) - 1 :]])
    began = time.perf_counter()
    counts, faults = many(total, first=first)
    for (name, outcome), number in sorted(counts.items()):
        print(f"{name:<10} {outcome:<9} {number}")
    for case, text in faults[:12]:
        print(f"--- case {case}\n{text[-900:]}")
    print(f"{total} files from {first} on, {len(faults)} faults, {time.perf_counter() - began:.0f} s")
    sys.exit(bool(faults))
