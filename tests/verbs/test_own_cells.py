"""The three cells of data/own_data are what their script writes, and the command finds the fault planted in each."""

import importlib.util
import json

import numpy as np
import pytest

from labkit.__main__ import main
from labkit.tables import DATA

FOLDER = DATA / "own_data"
SPEC = importlib.util.spec_from_file_location("make_cells", FOLDER / "make_cells.py")
make_cells = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(make_cells)


def test_the_files_are_what_the_script_writes():
    for name, text in make_cells.cells().items():
        stored = (FOLDER / name).read_text(encoding="utf-8").splitlines()
        fresh = text.splitlines()
        assert len(stored) == len(fresh)
        for a, b in zip(stored, fresh):  # the last digits differ between machines
            if a != b:
                a, b = (
                    np.array([float(v) for v in line.replace(",", " ").replace(";", " ").split()]) for line in (a, b)
                )
                assert np.abs(a - b).max() < 1e-3


def run(cell, tmp_path, *words):
    assert main(["calibrate", *[str(FOLDER / cell / w) if "." in w else w for w in words], "--out", str(tmp_path)]) == 0
    return json.loads((tmp_path / "result.json").read_text())


def test_the_swapped_role_is_named(capsys):
    words = ["hand-eye", "--robot", str(FOLDER / "swapped_role/robot.csv"), "--sensor"]
    assert main(["calibrate", *words, str(FOLDER / "swapped_role/sensor.txt")]) == 1
    assert "it seems that the sensor file holds the sensor in the target" in capsys.readouterr().err


def test_the_slip_is_dated(tmp_path):
    found = run("slipped_screw", tmp_path, "hand-eye", "--robot", "robot.csv", "--sensor", "sensor.csv")
    assert found["rejected"] == list(range(15, 25))
    assert "did something slip before row 15?" in found["warnings"][-1]
    e = np.array(found["T"])[:3, 3] - make_cells.T_FS[:3, 3] / 1000
    assert np.abs(e / np.array(found["std"])[3:]).max() < 5


def test_the_clock_is_measured(tmp_path):
    found = run("late_clock", tmp_path, "compare", "--a", "robot.txt", "--b", "tracker.txt")
    offset = found["time_offset"]
    assert abs(offset["offset"] - make_cells.CLOCK) < 5 * offset["std"] < 2e-3
    e = np.array(found["T"])[:3, 3] - make_cells.T_FS[:3, 3] / 1000
    assert np.abs(e / np.array(found["std"])[3:]).max() < 5
    assert found["rms_translation"] == pytest.approx(0.15e-3 * np.sqrt(3), rel=0.3)
