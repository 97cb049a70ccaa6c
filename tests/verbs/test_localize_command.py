"""The command that localizes: files in, three files out, in one go or with one sentence."""

import json
import re

import numpy as np
import pytest

from labkit.__main__ import main
from labkit.localization import odometry, path

MARKS = {"7": (0.0, 0.0), "A": (10.0, 0.0), "12": (10.0, 8.0), "B": (0.0, 8.0), "5": (5.0, 11.0)}


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A drive of 2000 rows at 50 Hz and 250 readings, some of them nonsense, in the current folder."""
    rng = np.random.default_rng(0)
    time, dt = 0.02 * np.arange(2000), 0.02
    u = np.stack([0.5 + 0.2 * np.sin(0.1 * time), 0.3 * np.sin(0.07 * time) + 0.1], 1)
    real = u + rng.normal(size=u.shape) * 0.03 / np.sqrt(dt)
    x = odometry.drive(np.array([4.0, 3.0, 0.5]), real[:-1], dt, "midpoint")
    names, marks = list(MARKS), np.array(list(MARKS.values()))
    lines = ["t;id;range;bearing [deg]"]
    for k in np.sort(rng.integers(0, 2000, 250)):
        m = rng.integers(len(names))
        z = path.measurement(x[k], marks[m : m + 1])[0] + rng.normal(size=2) * [0.1, 0.03]
        if rng.random() < 0.1:
            z = np.array([rng.uniform(1, 12), rng.uniform(-3, 3)])
        name = "?" if rng.random() < 0.1 else "99" if rng.random() < 0.02 else names[m]
        lines.append(f"{time[k]:.3f};{name};{z[0]:.4f};{np.rad2deg(z[1]):.3f}".replace(".", ","))
    (tmp_path / "readings.csv").write_text("\n".join(lines))
    np.savetxt(tmp_path / "odometry.txt", np.column_stack([time, u]), header="t v omega", fmt="%.6f")
    np.savetxt(tmp_path / "truth.txt", np.column_stack([time, x]), fmt="%.6f")
    (tmp_path / "map.csv").write_text("id,x,y\n" + "\n".join(f"{n},{a},{b}" for n, (a, b) in MARKS.items()))
    monkeypatch.chdir(tmp_path)
    return tmp_path


WORDS = ["localize", "--odometry", "odometry.txt", "--landmarks", "map.csv", "--measurements", "readings.csv"]


def test_a_path_with_covariance_and_rejected_readings_by_line(files, capsys):
    assert main([*WORDS, "--truth", "truth.txt", "--out", "found"]) == 0
    said = capsys.readouterr().out
    assert "2000 poses from 250 readings" in said and "against the truth" in said
    found = json.loads((files / "found" / "result.json").read_text())
    assert found["rms_position"] < 0.15 and {r["why"] for r in found["rejected"]} >= {"beyond the gate"}
    assert all(r["line"] == r["reading"] + 1 for r in found["rejected"])
    table = np.loadtxt(files / "found" / "path.csv", delimiter=",", skiprows=1)
    assert table.shape == (2000, 10)
    page = (files / "found" / "report.html").read_text()
    assert not re.search(r"(src|href)=|https?://", page)
    for words in ("NIS by reading", "Readings not used", "Against the truth", "<canvas"):
        assert words in page


@pytest.mark.parametrize(
    "words, sentence",
    [
        ([*WORDS[:-1], "none.csv"], "none.csv: there is no such file"),
        ([*WORDS[:-1], "map.csv"], "map.csv: readings needs a column 'time'"),
        ([*WORDS, "--std-range", "0"], "--std-range must be positive"),
        (WORDS[:3], "the following arguments are required: --landmarks, --measurements"),
    ],
    ids=range(4),
)
def test_what_is_wrong_is_said_in_one_sentence(files, capsys, words, sentence):
    assert main(words) == 1
    said = capsys.readouterr()
    assert sentence in said.err and said.err.count("\n") == 1
