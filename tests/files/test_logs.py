"""Logs of a drive: columns by title and by order, units, unknown ids, and the sentence of every fault."""

import numpy as np
import pytest

from labkit.files.logs import read_landmarks, read_odometry, read_readings, read_truth
from labkit.files.text import FileError


def written(tmp_path, text):
    path = tmp_path / "log.csv"
    path.write_text(text)
    return path


def test_columns_by_title_in_any_order_and_unit(tmp_path):
    log = read_odometry(written(tmp_path, "omega [deg/s];t [ms];v [mm/s]\n90;0;500\n-90;100;1000,5\n"))
    assert np.allclose(log.time, [0, 0.1]) and np.allclose(log.v, [0.5, 1.0005])
    assert np.allclose(log.omega, [np.pi / 2, -np.pi / 2])
    readings = read_readings(written(tmp_path, "id,bearing,range,time\n7.0,0.1,2,1\n?,0.2,3,2\n,0.3,4,3\nA2,0,1,0\n"))
    assert readings.ids == ("7", None, None, "A2")
    assert np.allclose(readings.z, [[2, 0.1], [3, 0.2], [4, 0.3], [1, 0]])


def test_columns_in_their_usual_order(tmp_path):
    assert read_landmarks(written(tmp_path, "# Subject x y x-std y-std\n6 1.8 -5.5 1e-4 2e-4\n")).ids == ("6",)
    truth = read_truth(written(tmp_path, "0 1 2 90\n1 1 2 45\n"), angle="deg")
    assert np.allclose(truth.x[:, 2], [np.pi / 2, np.pi / 4])
    assert read_readings(written(tmp_path, "1 4 2.5 0.1\n0.5 5 2.5 0.1\n")).ids == ("4", "5")  # clocks may jump


FAULTS = [
    (read_odometry, "1 2\n", "log.csv, line 1: odometry are rows of time v omega, got 2 columns"),
    (read_odometry, "0 1 0\n", "log.csv: odometry needs at least 2 rows, got 1"),
    (read_odometry, "0 1 0\n1 500 0\n", "log.csv, line 2: 500 m/s is no robot: another unit or column?"),
    (read_odometry, "0 1 0\n1 1 90\n", "log.csv, line 2: 90 rad/s is no robot: another unit or column?"),
    (read_odometry, "0 1 0\nnan 1 0\n", "log.csv, line 2: expected a finite number of sensible size, got time nan"),
    (read_odometry, "t,v\n0,1\n", "log.csv: odometry needs a column 'omega', but the header has t, v"),
    (read_landmarks, "1 0 0\n2 1 1\n1.0 3 3\n", "log.csv, line 3: the landmark '1' appears twice"),
    (read_landmarks, "-1 0 0\n", "log.csv, line 1: a landmark needs an id"),
    (read_landmarks, "1 0 1e9\n", "line 1: expected a finite number of sensible size, got y 1e+09"),
    (read_readings, "0 1 -2 0\n", "log.csv, line 1: a range must be positive"),
    (read_readings, "0 1 2 80\n", "line 1: a bearing must lie within a turn: are they degrees? Say --angle deg"),
    (read_readings, "0 1 2 x\n", "log.csv, line 1: expected a number, got 'x'"),
    (read_truth, "0 0 0 0\n0 1 1 0\n", "log.csv, line 2: the time does not increase"),
]


@pytest.mark.parametrize("read, text, sentence", FAULTS, ids=range(len(FAULTS)))
def test_every_fault_has_its_sentence(read, text, sentence, tmp_path):
    with pytest.raises(FileError) as refusal:
        read(written(tmp_path, text))
    assert sentence in str(refusal.value)
