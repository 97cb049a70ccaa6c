"""Every format of poses has a sample in samples/, read against one reference; every fault has its sentence."""

import json
from pathlib import Path

import numpy as np
import pytest

from labkit.files.points import read_points
from labkit.files.poses import read_pairs, read_poses, refuse_other_rows, refuse_times
from labkit.files.text import FileError

SAMPLES = Path(__file__).parent / "samples"
REFERENCE = np.loadtxt(SAMPLES / "reference_mm.txt").reshape(-1, 4, 4)  # written by SciPy's Rotation, nine digits
READ = {  # sample: options, format that must be recognized
    "quaternion_named.csv": ({}, "quaternion"),
    "euroc.csv": ({}, "quaternion"),
    "ros_echo.csv": ({}, "quaternion"),
    "tum.txt": ({}, "quaternion"),
    "tum_bare.txt": ({}, "tum"),
    "quaternion_bare.txt": ({}, "quaternion"),
    "quaternion_wxyz.txt": ({"quaternion": "wxyz"}, "quaternion"),
    "kuka_semicolon_decimal_comma.csv": ({}, "kuka"),
    "kuka_bare.txt": ({}, "kuka"),
    "ur_bom.csv": ({}, "ur"),
    "ur_bare.txt": ({"format": "ur"}, "ur"),
    "matrix_12.txt": ({}, "matrix"),
    "matrix_16.txt": ({}, "matrix"),
    "matrix_blocks.txt": ({}, "matrix"),
    "matrix_named.csv": ({}, "matrix"),
    "folder": ({}, "folder"),
    "pairs.json": ({}, "json"),
    "moveit.json": ({}, "json"),
    "list.json": ({}, "json"),
}


@pytest.mark.parametrize("name", READ)
def test_every_format_gives_the_same_poses(name):
    options, recognized = READ[name]
    poses = read_poses(SAMPLES / name, **options)
    assert poses.format == recognized
    assert poses.assumed.startswith(f"{name}: 6 poses, ")
    assert np.abs(poses.in_unit("mm").T - REFERENCE).max() < 1e-6  # samples have nine digits of a meter
    if poses.time is not None:
        assert np.allclose(poses.time, 10 + 0.5 * np.arange(6))


def test_every_sample_is_read():
    assert {path.name for path in SAMPLES.iterdir()} == {*READ, "reference_mm.txt", "points.csv"}


@pytest.mark.parametrize("name", ["pairs.json", "moveit.json"])
def test_pairs_hold_the_robot_first(name):
    robot, sensor = read_pairs(SAMPLES / name)
    assert np.abs(robot.in_unit("mm").T - REFERENCE).max() < 1e-6
    assert np.abs(robot.T @ sensor.T - np.eye(4)).max() < 1e-5  # the sample's sensor sees the inverse


def test_points_with_semicolons_and_decimal_commas():
    found = read_points(SAMPLES / "points.csv")
    assert found.length == "mm"
    assert np.array_equal(found.points, [[1.5, 2, 3], [4, 5, 6.25]])
    assert np.allclose(found.in_unit("m"), found.points / 1000)


def test_what_is_said_overrules_what_is_assumed(tmp_path):
    rows = "1 0 0 0 0 0 1\n0 1 0 0 0 0 1\n"
    path = tmp_path / "poses.txt"
    path.write_text(rows)
    assert read_poses(path).length == "m"
    assert read_poses(path, length="mm", any_size=True).length == "mm"
    first = read_poses(path, quaternion="wxyz").T[0, :3, :3]
    assert np.allclose(first, np.diag([-1, -1, 1]))  # 0 0 0 1 read as w x y z: half a turn about z
    path.write_text("0 0 500 90 0 0\n0 0 600 0 90 0\n")
    assert read_poses(path).format == "kuka"
    path.write_text("0 0 0.5 1.5 0 0\n0 0 0.6 0 1.5 0\n")
    assert np.allclose(read_poses(path, format="ur").T[0, 1:3, 2], [-np.sin(1.5), np.cos(1.5)])
    assert np.allclose(
        read_poses(path, format="ur", angle="deg").T[0, 1:3, 2], [-np.sin(1.5 * np.pi / 180), 1], atol=1e-3
    )


GOOD = "0.1 0.2 0.3 0 0 0 1"
EYE = "1 0 0 0.1 0 1 0 0.2 0 0 1 0.3 0 0 0 1"
FAULTS = {  # fault: (text, options, what the sentence says)
    "empty": ("", {}, "p.txt: the file is empty"),
    "comments": ("# nothing\n", {}, "p.txt: the file holds comments alone, expected rows of numbers"),
    "header alone": ("x,y,z,qx,qy,qz,qw\n", {}, "p.txt: the file holds a header alone"),
    "binary": ("a\0b", {}, "p.txt: expected text, got binary data"),
    "short row": (f"{GOOD}\n{GOOD[:-2]}\n", {}, "p.txt, line 2: expected 7 entries, as line 1 has, got 6"),
    "header longer": (
        "x y z qx qy qz qw t\n" + GOOD,
        {},
        "p.txt, line 2: expected 8 entries, as the header has, got 7",
    ),
    "no number": (f"{GOOD}\n{GOOD.replace('0.3', 'O.3')}\n", {}, "p.txt, line 2: expected a number, got 'O.3'"),
    "empty cell": ("x,y,z,qx,qy,qz,qw\n1,,3,0,0,0,1", {}, "p.txt, line 2: expected a number, got an empty cell"),
    "not finite": (f"{GOOD}\n\n{GOOD.replace('0.3', 'nan')}\n", {}, "p.txt, line 3: expected a finite number, got nan"),
    "infinite": (f"{GOOD}\n{GOOD.replace('0.3', '-inf')}\n", {}, "p.txt, line 2: expected a finite number, got -inf"),
    "quaternion": (f"{GOOD}\n1 2 3 0 0 0 0.9\n", {}, "p.txt, line 2: the quaternion has length 0.9, not 1"),
    "columns": ("1 2 3 4 5\n", {}, "p.txt, line 1: 5 columns without a known header are no pose"),
    "six columns": ("1 2 3 0.1 0.2 0.3\n", {}, "six columns without a header may be x y z A B C or a rotation vector"),
    "no orientation": ("x y z\n1 2 3\n", {}, "p.txt: positions, but no orientations"),
    "missing": (
        "x y z qx qy qz\n1 2 3 0 0 0\n",
        {},
        "format quaternion needs a column 'qw', but the header has x, y, z",
    ),
    "twice": ("x x z qx qy qz qw\n" + GOOD, {}, "the columns 'x' and 'x' both mean x"),
    "two notations": (f"x y z qx qy qz qw A B C\n{GOOD} 1 2 3", {}, "the header fits quaternion and kuka: say which"),
    "unit of length": (
        "x [inch],y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1",
        {},
        "lengths must be in m or mm, but column 'x [inch]'",
    ),
    "two units": ("x [m],y [mm],z,qx,qy,qz,qw\n1,2,3,0,0,0,1", {}, "x, y, z must share one unit, got"),
    "sheared": (EYE.replace("1", "1.1", 1), {}, "p.txt, line 1: the matrix is no rotation, R'R differs from I by 0.21"),
    "left-handed": ("-" + EYE, {}, "p.txt, line 1: the matrix is left-handed, its determinant is -1"),
    "last row": (EYE[:-1] + "2", {}, "p.txt, line 1: the last row of a matrix must be 0 0 0 1, got 0 0 0 2"),
    "by columns": ("1 0 0 0 0 1 0 0 0 0 1 0 0.1 0.2 0.3 1", {}, "got 0.1 0.2 0.3 1: is it written column by column?"),
    "blocks": ("1 0 0 0\n0 1 0 0\n0 0 1 0\n", {}, "p.txt: 3 rows of four are no blocks of 4 x 4 matrices"),
    "a robot of 300 m": (
        GOOD.replace("0.1", "300"),
        {"length": "m"},
        "positions reach 300 m, which no robot does: are",
    ),
    "a robot of 3 mm": (
        GOOD,
        {"length": "mm"},
        "positions reach 0.3742 mm, which no robot does: are they m? Say --length",
    ),
    "m or mm": (
        GOOD.replace("0.1", "20"),
        {},
        "positions reach 20, which may be m or mm: say --length m or --length mm",
    ),
    "angles": (
        "A B C x y z\n1 0 0 9 9 500\n0 1 0 9 9 500\n0 0 1 9 9 500",
        {},
        "A, B and C stay within 1.00: are they radians?",
    ),
    "degrees": (
        "1 2 300 30 0 0\n",
        {"format": "ur"},
        "line 1: an angle of 30 rad is more than one turn: are they degrees?",
    ),
    "format": (
        GOOD,
        {"format": "abb"},
        "--format must be one of quaternion, tum, kuka, ur, matrix, folder, json, got 'abb'",
    ),
    "columns of format": (GOOD, {"format": "tum"}, "p.txt, line 1: format tum needs 7 columns behind the time, got 6"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_has_its_sentence(fault, tmp_path):
    text, options, sentence = FAULTS[fault]
    path = tmp_path / "p.txt"
    path.write_text(text)
    with pytest.raises(FileError) as refusal:
        read_poses(path, **options)
    assert sentence in str(refusal.value) and "\n" not in str(refusal.value)


JSON_FAULTS = {
    "[1, 2": "p.json, line 1: this is not JSON",
    "{}": "p.json: expected a list of 4 x 4 matrices, or of pairs of them",
    "[[1, 2, 3]]": "p.json, entry 1: expected a 4 x 4 matrix or a pair of them, got an array of shape (3,)",
    '["a"]': "p.json, entry 1: expected a 4 x 4 matrix or a pair of them, got 'a'",
    f"[[{'9' * 400}, {'1, ' * 14}1]]": "p.json, entry 1: expected finite numbers, got inf",
    f"[[{'9' * 5000}, {'1, ' * 14}1]]": "p.json, entry 1: expected finite numbers, got inf",
    json.dumps([np.diag([1, 1, -1, 1]).tolist()]): "p.json, entry 1: the matrix is left-handed",
    json.dumps([np.eye(4).tolist(), [np.eye(4).tolist()] * 2]): "p.json, entry 2: expected 1 matrices as in entry 1",
}


@pytest.mark.parametrize("text", JSON_FAULTS, ids=range(len(JSON_FAULTS)))
def test_json_is_refused_by_its_entry(text, tmp_path):
    path = tmp_path / "p.json"
    path.write_text(text)
    with pytest.raises(FileError) as refusal:
        read_poses(path)
    assert JSON_FAULTS[text] in str(refusal.value)


def test_folders_are_refused_by_their_files(tmp_path):
    with pytest.raises(FileError, match="the folder holds no text files with numbers in their names"):
        read_poses(tmp_path)
    (tmp_path / "pose_1.txt").write_text(EYE)
    (tmp_path / "other_01.txt").write_text(EYE)
    with pytest.raises(FileError, match="other_01.txt and pose_1.txt have the same number 1"):
        read_poses(tmp_path)
    (tmp_path / "other_01.txt").write_text("1 2 3")
    (tmp_path / "pose_1.txt").unlink()
    with pytest.raises(FileError, match="other_01.txt: expected 4 rows of 4 numbers, got 3 numbers"):
        read_poses(tmp_path)
    with pytest.raises(FileError, match="nowhere.txt: there is no such file"):
        read_poses(tmp_path / "nowhere.txt")


@pytest.mark.parametrize(
    "times, sentence",
    [
        ((1, 1, 2), "line 2: the same time as the row before"),
        ((1, 2, 1.5), "line 3: a time before that of the last row"),
    ],
)
def test_times_of_a_stream_increase(times, sentence, tmp_path):
    path = tmp_path / "stream.txt"
    path.write_text("\n".join(f"{t} {GOOD}" for t in times))
    with pytest.raises(FileError, match=sentence):
        refuse_times(read_poses(path))
    path.write_text(GOOD)
    with pytest.raises(FileError, match="a stream needs a time in every row"):
        refuse_times(read_poses(path))


def test_rows_of_two_files_belong_together(tmp_path):
    robot, sensor = tmp_path / "robot", tmp_path / "sensor"
    for folder, numbers in ((robot, (1, 2, 3)), (sensor, (1, 2, 4))):
        folder.mkdir()
        for number in numbers:
            (folder / f"{folder.name}_{number:02}.txt").write_text(EYE)
    with pytest.raises(FileError, match="the numbers of the files in robot and sensor differ"):
        refuse_other_rows(read_poses(robot, length="m"), read_poses(sensor, length="m"))
    (sensor / "sensor_04.txt").rename(sensor / "sensor_03.txt")
    refuse_other_rows(read_poses(robot, length="m"), read_poses(sensor, length="m"))
    (sensor / "sensor_03.txt").unlink()
    with pytest.raises(FileError, match="robot has 3 rows and sensor has 2: they must come row by row"):
        refuse_other_rows(read_poses(robot, length="m"), read_poses(sensor, length="m"))
