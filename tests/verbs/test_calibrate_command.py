"""The command itself: files in, two files out, the exit code, and one sentence for whatever is wrong."""

import json
import os
import re
import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from labkit.__main__ import main
from labkit.exercises.source import ROOT
from labkit.geometry.frames import invert, kuka_from_matrix, pose
from labkit.geometry.lie import exp_so3

X = pose(exp_so3([0.3, -1.1, 2.0]), [30.0, -20.0, 100.0])
Y = pose(exp_so3([1.0, 0.4, -0.2]), [700.0, 50.0, -60.0])


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A cell of 15 poses, row 4 wrong: the robot as KUKA in mm with decimal commas, the sensor as matrices in m."""
    rng = np.random.default_rng(0)
    robot = pose(exp_so3(0.5 * rng.normal(size=(15, 3))), rng.uniform(300, 700, (15, 3)))
    sensor = invert(robot @ X) @ Y
    sensor[:, :3, 3] += 0.1 * rng.normal(size=(15, 3))
    sensor[:, :3, :3] = sensor[:, :3, :3] @ exp_so3(1e-3 * rng.normal(size=(15, 3)))
    sensor[3, :3, 3] += 25
    kuka = kuka_from_matrix(robot)
    kuka[:, 3:] = np.rad2deg(kuka[:, 3:])
    rows = [";".join(f"{v:.6f}".replace(".", ",") for v in row) for row in kuka]
    (tmp_path / "robot.csv").write_text("\n".join(["X [mm];Y [mm];Z [mm];A;B;C", *rows]))
    meters = sensor.copy()
    meters[:, :3, 3] /= 1000
    np.savetxt(tmp_path / "sensor.txt", meters.reshape(-1, 16), fmt="%.9f")
    np.savetxt(tmp_path / "swapped.txt", invert(meters).reshape(-1, 16), fmt="%.9f")
    np.savetxt(tmp_path / "short.txt", meters[:-1].reshape(-1, 16), fmt="%.9f")
    center = robot[:, :3, :3] @ [0, 0, 150.0]
    touching = pose(robot[:, :3, :3], [500, 0, 300] - center)
    np.savetxt(tmp_path / "pivot.txt", touching.reshape(-1, 16), fmt="%.6f")
    np.savetxt(tmp_path / "points.csv", sensor[:, :3, 3], fmt="%.4f", delimiter=",")
    np.savetxt(tmp_path / "three.csv", robot[:3, :3, 3], fmt="%.4f", delimiter=",")
    for name, poses in (("robot", robot), ("sensor", sensor), ("touching", touching)):
        np.savetxt(tmp_path / f"two_{name}.txt", poses[:2].reshape(-1, 16), fmt="%.6f")
    np.savetxt(tmp_path / "two.csv", sensor[:2, :3, 3], fmt="%.4f", delimiter=",")
    about_z = pose(exp_so3(np.linspace(-0.5, 0.5, 15)[:, None] * [0.0, 0.0, 1.0]), robot[:, :3, 3])
    for name, poses in (("robot", about_z), ("sensor", invert(about_z @ X) @ Y)):
        np.savetxt(tmp_path / f"axis_{name}.txt", poses.reshape(-1, 16), fmt="%.9f")
    _streams(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _streams(folder):
    """a.txt and b.txt: TUM rows of one motion on two clocks; b with a time twice, turned round, and cut by a gap."""
    t = 0.02 * np.arange(400)
    phi = np.stack([np.sin(0.9 * t), 0.7 * np.sin(1.7 * t + 1), 0.5 * np.sin(2.4 * t)], -1)
    moving = pose(exp_so3(phi), 300 * np.cos(phi))
    for name, T, clock in (("a", moving, t), ("b", invert(Y) @ moving @ X, t + 7.25)):
        q = Rotation.from_matrix(T[:, :3, :3]).as_quat()
        table = np.column_stack([clock, T[:, :3, 3], q])
        rows = {name: table, "gap": np.delete(table, slice(150, 300), 0), "back": table[::-1]}
        rows["twice"] = table[[0, 1, 1, *range(2, 400)]]
        for kind in rows if name == "b" else ("a",):
            np.savetxt(folder / f"{kind}.txt", rows[kind], fmt="%.9f")


def test_files_of_two_units_and_formats_give_one_result(files, capsys):
    words = ["calibrate", "hand-eye", "--robot", "robot.csv", "--sensor", "sensor.txt", "--out", "found"]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "robot.csv: 15 poses, kuka, angles in deg (assumed), columns by their titles, mm (header)" in said
    assert "sensor.txt: 15 poses, matrix, matrices row by row, columns by their number, m (assumed)" in said
    assert "rejected rows: 4" in said
    found = json.loads((files / "found" / "result.json").read_text())
    assert found["kind"] == "hand-eye" and found["length_unit"] == "mm" and found["rejected"] == [4]
    assert np.allclose(np.array(found["T"])[:3, 3], X[:3, 3], atol=1)
    names = "T T_target covariance std rms_rotation_deg rms_translation rows singular_values time_offset warnings"
    assert set(names.split()) <= set(found)


def test_the_report_is_one_file_that_needs_no_network(files):
    assert main(["calibrate", "hand-eye", "--robot", "robot.csv", "--sensor", "sensor.txt", "--out", "found"]) == 0
    page = (files / "found" / "report.html").read_text()
    assert not re.search(r"(src|href)=|https?://|@import|url\(", page)
    for words in ("Residuals by row", "What to measure next", "What is known worst", "<canvas", "prefers-color-scheme"):
        assert words in page
    assert page.count("rejected</title>") == 2 and "$" not in re.sub(r"<script>.*?</script>", "", page, flags=re.S)
    scene = json.loads(re.search(r'<script type="application/json" id="scene">(.*?)</script>', page, re.S)[1])
    assert {line["role"] for line in scene["lines"]} == {"x", "y", "z", "measurement", "muted", "estimate"}


@pytest.mark.parametrize(
    "words, said",
    [
        (["pivot", "pivot.txt"], "15 of 15 rows agree"),
        (["sphere", "--robot", "robot.csv", "--points", "points.csv"], "rejected rows: 4"),
        (["frame", "three.csv"], "frame in the measuring system (mm):"),
        (["frame", "points.csv", "--nominal", "points.csv"], "15 of 15 rows agree"),
    ],
    ids=lambda v: v[0] if isinstance(v, list) else "",
)
def test_every_kind_runs_and_reports(files, capsys, words, said):
    assert main(["calibrate", *words, "--out", "found"]) == 0
    assert said in capsys.readouterr().out
    assert json.loads((files / "found" / "result.json").read_text())["kind"] == words[0]


REFUSED = [
    (
        ["hand-eye", "--robot", "robot.csv", "--sensor", "swapped.txt"],
        "robot.csv and swapped.txt: it seems that the sensor file holds the sensor in",
    ),
    (["hand-eye", "--robot", "robot.csv", "--sensor", "short.txt"], "robot.csv has 15 rows and short.txt has 14"),
    (["hand-eye", "--robot", "robot.csv"], "needs --robot and --sensor"),
    (["hand-eye", "--robot", "robot.csv", "--sensor", "none.txt"], "none.txt: there is no such file"),
    (
        ["hand-eye", "--robot", "robot.csv", "--sensor", "sensor.txt", "--std-trans", "-1"],
        "--std-trans must be positive",
    ),
    (["frame", "points.csv"], "points.csv: a frame through points needs 3 of them, got 15"),
    (["compare", "--a", "robot.csv", "--b", "sensor.txt"], "robot.csv: a stream needs a time in every row"),
    (
        ["hand-eye", "--robot", "two_robot.txt", "--sensor", "two_sensor.txt", "--length", "mm"],
        "two_robot.txt and two_sensor.txt: hand-eye calibration needs at least 3 poses, better 10, got 2",
    ),
    (
        ["pivot", "two_touching.txt", "--length", "mm"],
        "two_touching.txt: pivot calibration needs at least 3 poses, better 10, got 2",
    ),
    (
        ["sphere", "--robot", "two_robot.txt", "--points", "two.csv", "--length", "mm"],
        "two_robot.txt and two.csv: calibration with a sphere needs at least 4 poses, better 10, got 2",
    ),
    (["frame", "two.csv"], "two.csv: a frame through points needs 3 of them, got 2; or give --nominal"),
    (
        ["hand-eye", "--robot", "axis_robot.txt", "--sensor", "axis_sensor.txt", "--length", "mm"],
        "axis_robot.txt and axis_sensor.txt: the flange turns about one axis only, the flange's z axis, by 17.7 deg",
    ),
    (["compare", "--a", "a.txt", "--b", "twice.txt", "--length", "mm"], "twice.txt, line 3: the same time"),
    (["compare", "--a", "a.txt", "--b", "back.txt", "--length", "mm"], "back.txt, line 2: a time before that"),
    (["pivot"], "the following arguments are required: poses; see: python lab.py calibrate pivot --help"),
    (["eye"], "invalid choice: 'eye'"),
    ([], "the following arguments are required: KIND"),
]


@pytest.mark.parametrize("words, sentence", REFUSED, ids=range(len(REFUSED)))
def test_what_is_wrong_is_said_in_one_sentence(files, capsys, words, sentence):
    assert main(["calibrate", *words]) == 1
    said = capsys.readouterr()
    assert sentence in said.err and said.err.count("\n") == 1 and said.out == ""


def test_streams_of_two_clocks_with_a_gap(files):
    words = ["compare", "--a", "a.txt", "--b", "gap.txt", "--length", "mm", "--out", "found"]
    assert main(["calibrate", *words]) == 0
    found = json.loads((files / "found" / "result.json").read_text())
    assert found["time_offset"]["offset"] == pytest.approx(7.25, abs=1e-3) and 200 < found["rows"] < 260
    assert np.allclose(np.array(found["T"])[:3, 3], X[:3, 3], atol=0.05)


def test_the_module_is_the_command(files):
    done = subprocess.run(
        [sys.executable, "-m", "labkit", "calibrate", "pivot", "pivot.txt"],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 0 and "15 of 15 rows agree" in done.stdout and not done.stderr
    assert main([]) == 0 and main(["calibrat"]) == 1
