"""Logs of a tracker: CSV files read and written, outliers left out, the mean reading of every stop.

Files speak meters, as the report does; a `Log` holds mm and rad. Source: report "Kalibrace a testovani systemu OTUS
tracker", ZCU Plzen 2018, section 3.1.
"""

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ..checks import as_finite, as_number, as_positive_number, as_shape, as_size, as_transforms
from ..documented import documented
from ..geometry.frames import matrix_from_quaternion, pose, quaternion_from_matrix
from ..geometry.lie import log_so3
from ..reading import regular
from .packet import MAX_POSITION, UNIT_TOLERANCE

# ---- the log ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Log:
    """A log of readings.

    Attributes
    ----------
    time : array, shape (k,), s
    T_WE : array, shape (k, 4, 4)
        mm.
    stop : array of int, shape (k,), or None
        The number of the stop each reading belongs to.
    """

    time: np.ndarray
    T_WE: np.ndarray
    stop: np.ndarray | None


_LENGTHS = {"m": 1000.0, "mm": 1.0}


@documented
def write_csv(path, log, unit="m", digits=5):
    """Write a log as a table: time [s], stop (where the log has stops), x y z [unit], qx qy qz qw.

    Parameters
    ----------
    path : str or path
    log : Log
    unit : str
        "m" or "mm", of the positions in the file.
    digits : int
        Decimals of a meter, whatever the unit; at least 0.

    Raises
    ------
    ValueError
        For another unit.

    See Also
    --------
    read_csv
    """
    if unit not in _LENGTHS:
        raise ValueError(f"unit must be m or mm, got {unit!r}")
    positions = log.T_WE[:, :3, 3] / _LENGTHS[unit]
    digits = as_size(digits, "digits", at_least=0)
    places = digits if unit == "m" else max(digits - 3, 0)
    header = [
        "time [s]",
        *(["stop"] if log.stop is not None else []),
        *(f"{c} [{unit}]" for c in "xyz"),
        "qx",
        "qy",
        "qz",
        "qw",
    ]
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        for k, (t, p, q) in enumerate(zip(log.time, positions, quaternion_from_matrix(log.T_WE[:, :3, :3]))):
            stop = [f"{int(log.stop[k])}"] if log.stop is not None else []
            writer.writerow([f"{t:.3f}", *stop, *(f"{v:.{places}f}" for v in p), *(f"{v:.6f}" for v in q)])


@documented
def read_csv(path):
    """Read a log written by `write_csv`, in m or mm, into mm.

    Parameters
    ----------
    path : str or path

    Returns
    -------
    Log

    Raises
    ------
    ValueError
        With the name of the file and the line: a missing or doubled column, columns in different units, a row of
        another length, text for a number, time that does not increase, a quaternion that is none, a position that jumps
        by a factor of 1000 (rows in another unit), a last line cut off.
    """
    path = Path(path)
    text = regular(path).read_text(encoding="utf-8")
    lines = text.splitlines()
    if not lines:
        raise ValueError(f"{path.name}: the file is empty, expected a header line")
    if not text.endswith("\n"):
        raise ValueError(f"{path.name}, line {len(lines)}: the file ends in the middle of this line")
    header = next(csv.reader(lines[:1]))
    columns, factor = _columns(header, path.name)
    rows = np.empty((len(lines) - 1, len(header)))
    for number, row in enumerate(csv.reader(lines[1:]), start=2):
        if len(row) != len(header):
            raise ValueError(f"{path.name}, line {number}: expected {len(header)} entries, got {len(row)}")
        try:
            rows[number - 2] = [float(entry) for entry in row]
        except ValueError:
            bad = next(entry for entry in row if not _is_number(entry))
            raise ValueError(f"{path.name}, line {number}: expected a number, got {bad!r}") from None
    time, p, q = rows[:, columns["time"]], rows[:, columns["xyz"]] * factor, rows[:, columns["q"]]
    _refuse_rows(path.name, rows, time, p, q)
    stop = rows[:, columns["stop"]].astype(int) if "stop" in columns else None
    return Log(time, pose(matrix_from_quaternion(q), p), stop)


def _is_number(entry):
    try:
        float(entry)
    except ValueError:
        return False
    return True


def _columns(header, name):
    if len(set(header)) != len(header):
        raise ValueError(f"{name}, line 1: a column name appears twice in {header}")
    found, units = {}, {}
    for index, title in enumerate(header):
        match = re.fullmatch(r"([xyz]) \[(\w+)\]", title)
        if match:
            found[match[1]], units[match[1]] = index, match[2]
        else:
            found[title] = index
    missing = [title for title in ("time [s]", "x", "y", "z", "qx", "qy", "qz", "qw") if title not in found]
    if missing:
        raise ValueError(
            f"{name}, line 1: expected a column {missing[0]!r} (x, y, z with their unit, as in 'x [m]'), got {header}"
        )
    if len(set(units.values())) > 1:
        raise ValueError(f"{name}, line 1: x, y and z must share one unit, got {', '.join(units[c] for c in 'xyz')}")
    if units["x"] not in _LENGTHS:
        raise ValueError(f"{name}, line 1: lengths must be in m or mm, got {units['x']}")
    columns = {
        "time": found["time [s]"],
        "xyz": [found[c] for c in "xyz"],
        "q": [found[c] for c in ("qx", "qy", "qz", "qw")],
    }
    if "stop" in found:
        columns["stop"] = found["stop"]
    return columns, _LENGTHS[units["x"]]


def _refuse_rows(name, rows, time, p, q):
    def refuse(bad, what):
        if bad.any():
            raise ValueError(f"{name}, line {int(np.argmax(bad)) + 2}: {what}")

    refuse(~np.isfinite(rows).all(axis=1), "a number is not finite")
    refuse(np.concatenate([[False], np.diff(time) <= 0]), "time does not increase")
    refuse(np.abs(np.linalg.norm(q, axis=1) - 1) > UNIT_TOLERANCE, "the quaternion is not of length 1")
    size = np.linalg.norm(p, axis=1)
    before, after = p[:-1], p[1:]
    for factor in (1000.0, 0.001):
        close = np.linalg.norm(factor * after - before, axis=1) < 0.05 * size[:-1]
        refuse(
            np.concatenate([[False], close & (np.maximum(size[:-1], size[1:]) > 50)]),
            "the position jumps by a factor of 1000: another unit?",
        )
    refuse(size > 1000 * MAX_POSITION, f"the position is more than {MAX_POSITION:g} m away: another unit?")


# ---- the mounting ----------------------------------------------------------------------------------------------------


def reject_outliers(values, factor=4.0):
    """Which values to keep: those within `factor` robust standard deviations (1.4826 times the median absolute
    deviation) of the median.

    Parameters
    ----------
    values : array-like, shape (n,) or (n, d)
        With columns, a row is kept when every column keeps it.
    factor : float
        Fixed before looking at the data.

    Returns
    -------
    keep : bool array, shape (n,)
        All True when more than half of the values are equal (no scale to judge by).

    Raises
    ------
    ValueError
        Fewer than three values.
    """
    values = as_finite(values, "values")
    if values.ndim not in (1, 2) or len(values) < 3:
        raise ValueError(f"values must have shape (n,) or (n, d) with n >= 3, got {values.shape}")
    factor = as_positive_number(factor, "factor")
    columns = values.reshape(len(values), -1)
    distance = np.abs(columns - np.median(columns, axis=0))
    scale = 1.4826 * np.median(distance, axis=0)
    return ((distance <= factor * scale) | (scale == 0)).all(axis=1)


def mean_quaternion(q):
    """Mean of quaternions whose signs mean nothing: q and -q are one rotation, so only q q' can be averaged.

    Parameters
    ----------
    q : array-like, shape (n, 4)
        Of length 1, n >= 1.

    Returns
    -------
    mean : array, shape (4,)
        Of length 1: the eigenvector of sum q q' with the largest eigenvalue; its sign is free.

    Raises
    ------
    ValueError
        A wrong shape, or no quaternion.

    Source: Markley, Cheng, Crassidis, Oshman, "Averaging quaternions", J. Guidance 30 (2007) 1193.
    """
    q = as_shape(q, "q", "n", 4)
    if not len(q):
        raise ValueError("q must hold at least one quaternion, got none")
    return np.linalg.eigh(q.T @ q)[1][:, -1]


def mean_pose(T):
    """Mean of poses that lie close together; rotations by the projected mean matrix; (n, 4, 4) -> (4, 4)."""
    T = as_shape(as_transforms(T, "T"), "T", "n", 4, 4)
    if not len(T):
        raise ValueError("T must hold at least one pose, got none")
    return pose(Rotation.from_matrix(T[:, :3, :3]).mean().as_matrix(), T[:, :3, 3].mean(0))


@documented
def average_stops(log, factor=4.0, share=0.5):
    """Mean reading of every stop, with outliers left out by `reject_outliers` on position and rotation vector.

    Parameters
    ----------
    log : Log
        With stops.
    factor : float
        As in `reject_outliers`.
    share : float
        A stop of which less was used should not be trusted.

    Returns
    -------
    T_WE : array, shape (m, 4, 4)
    used : array, shape (m,)
        Share of the readings used.

    Raises
    ------
    ValueError
        A log without stops.
    """
    if log.stop is None:
        raise ValueError("the log has no column 'stop': there is nothing to average over")
    factor, share = as_positive_number(factor, "factor"), as_number(share, "share")
    means, used = [], []
    for number in np.unique(log.stop):
        T = log.T_WE[log.stop == number]
        center = np.argmin(np.linalg.norm(T[:, :3, 3] - np.median(T[:, :3, 3], axis=0), axis=1))
        turn = log_so3(np.swapaxes(T[center, :3, :3], -1, -2) @ T[:, :3, :3])
        keep = reject_outliers(np.concatenate([T[:, :3, 3], turn], axis=1), factor)
        if keep.mean() < share:
            keep = np.ones(len(T), bool)
        means.append(mean_pose(T[keep]))
        used.append(keep.mean())
    return np.array(means), np.array(used)
