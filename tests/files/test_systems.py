"""The lab sheet's files: what is written comes back to the last bit, and every fault is one sentence with its line."""

import numpy as np
import pytest

from labkit.calibration.pivot import calibrate_pivot, poses_from_euler
from labkit.chapters.ch02_chaining import beyond
from labkit.documents.lab_sheet import printed as lab_sheet
from labkit.files import systems
from labkit.files.text import FileError, number_in
from labkit.tables import DATA


def test_systems_come_back_to_the_last_bit(tmp_path):
    points = lab_sheet.station_points().reshape(-1, 3, 3)
    points[0, 0] = 0.1 + 0.2, 1e-300, -1 / 3
    paths = [tmp_path / f"4_2_System{k}.txt" for k in range(1, 9)]
    for path, three in zip(paths, points):
        systems.save_system(path, three)
    assert (systems.load_systems(paths) == points).all()
    assert systems.load_systems([]).shape == (0, 3, 3)


def test_a_tool_comes_back_and_fewer_digits_lose_some(tmp_path):
    path, tip, pivot = (
        tmp_path / "Kalibrierung.txt",
        np.array([0.1 + 0.2, 44.58636, -87.6]),
        np.array([1.0, 2.0, 1 / 3]),
    )
    systems.save_calibration(path, tip, pivot)
    assert all((found == wanted).all() for found, wanted in zip(systems.load_calibration(path), (tip, pivot)))
    systems.save_calibration(path, tip, pivot, digits=6)
    assert 1e-8 < np.abs(systems.load_calibration(path)[1] - pivot).max() < 1e-6


def test_frames_of_a_swirl_are_read_as_the_workbook_reads_them(tmp_path):
    text = (DATA / "quirlen" / "poses.csv").read_text(encoding="utf-8").splitlines()
    rows = [line.split(",")[-6:] for line in text[1:]]
    path = tmp_path / "Kreisel.txt"
    path.write_text("# x y z a b c\n" + "\n".join("\t".join(row) for row in rows), encoding="utf-8")
    T_WF = poses_from_euler(systems.load_frames(path))
    np.testing.assert_allclose(T_WF, lab_sheet.kreisel_poses(), atol=1e-12)
    assert calibrate_pivot(T_WF).tip[0] == pytest.approx(-1.747805, abs=1e-6)


@pytest.mark.parametrize(
    "text, words",
    [
        ("1 2 3\n4 5 6\n", "a.txt: expected three points (origin, point on the x axis, point on the y axis), got 2"),
        ("1 2 3\n4 x 6\n7 8 9\n", "a.txt, line 2: expected a number, got 'x'"),
        ("1 2 3\n\n# c\n4 5\n7 8 9\n", "a.txt, line 4: expected 3 entries, as line 1 has, got 2"),
        ("1 2\n4 5\n7 8\n", "a.txt, line 1: expected 3 numbers x y z, got 2"),
        ("1;2;3\n4;nan;6\n7;8;9\n", "a.txt, line 2: expected finite numbers, got nan"),
        ("z y x\n1 2 3\n4 5 6\n7 8 9\n", "a.txt: expected the columns x y z, got z y x"),
        ("", "a.txt: the file is empty"),
    ],
)
def test_every_fault_is_one_sentence(tmp_path, text, words):
    path = tmp_path / "a.txt"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FileError) as refusal:
        systems.load_system(path)
    assert str(refusal.value) == words


def test_other_faults(tmp_path):
    with pytest.raises(FileError, match="no such file"):
        systems.load_system(tmp_path / "none.txt")
    path = tmp_path / "tool.txt"
    systems.save_system(path, np.eye(3))
    with pytest.raises(FileError, match="expected two points"):
        systems.load_calibration(path)
    with pytest.raises(FileError, match="expected 6 numbers"):
        systems.load_frames(path)
    with pytest.raises(ValueError, match="points"):
        systems.save_system(path, np.zeros((2, 3)))


def test_the_reader_of_the_exercise_reads_what_the_library_reads(tmp_path):
    """Where one separator is kept: the exercise also takes tabs beside blanks, and commas beside both."""
    path = tmp_path / "system.txt"
    for seed in range(20):
        (text,) = beyond.TEXTS[seed % 2](np.random.default_rng(seed))
        path.write_text(text.replace("\t", " "), encoding="utf-8")
        assert (systems.load_system(path) == beyond.read_system(text)).all()
    three = beyond.system(np.random.default_rng(0))
    path.write_text(beyond.write_system(three), encoding="utf-8")
    assert (systems.load_system(path) == three).all()


def test_a_number_or_none():
    assert number_in("-1.5e3") == -1500 and np.isnan(number_in("x")) and np.isnan(number_in(""))
