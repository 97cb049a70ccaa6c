"""Logs of a drive: odometry, a map of landmarks, ranges and bearings to them, and true poses.

odometry   t v omega          s, m/s, rad/s
landmarks  id x y             m
readings   t id range bearing s, m, rad; an id of ?, -, -1 or nothing is unknown
truth      t x y theta        s, m, rad

Columns by their titles in any order, or as listed without titles. Times may jump: a clock that was set is no fault of
the file, and `localization` copes with it.
"""

from dataclasses import dataclass

import numpy as np

from .columns import ANGLES, LENGTHS, TIMES, columns_of, need
from .text import FileError, read_table

UNKNOWN = {"", "?", "-", "-1", "nan", "none", "unknown"}
ORDERS = {
    "odometry": ("time", "v", "omega"),
    "landmarks": ("id", "x", "y"),
    "readings": ("time", "id", "range", "bearing"),
    "truth": ("time", "x", "y", "theta"),
}
EXTRA = {"landmarks": 2}  # columns that may follow: the standard deviations of surveyed landmarks
FASTEST, QUICKEST = 100.0, 50.0  # m/s and rad/s: beyond, the unit is another
FARTHEST = 1e5  # m


@dataclass(frozen=True, eq=False)
class Odometry:
    """What the wheels say: time (n,) s, v (n,) m/s, omega (n,) rad/s, places of the rows."""

    name: str
    time: np.ndarray
    v: np.ndarray
    omega: np.ndarray
    lines: np.ndarray


@dataclass(frozen=True, eq=False)
class Landmarks:
    """A map: ids (m,) as text, points (m, 2) m."""

    name: str
    ids: tuple
    points: np.ndarray


@dataclass(frozen=True, eq=False)
class Readings:
    """Ranges and bearings: time (k,) s, ids (k,) as text and None where unknown, z (k, 2) m and rad, lines (k,)."""

    name: str
    time: np.ndarray
    ids: tuple
    z: np.ndarray
    lines: np.ndarray


@dataclass(frozen=True, eq=False)
class Truth:
    """True poses: time (n,) s, x (n, 3) m, m, rad."""

    name: str
    time: np.ndarray
    x: np.ndarray


def read_odometry(path, angle=None):
    """The log of v and omega of a drive, as an `Odometry`; refuses with file and line."""
    table, columns = _columns(path, "odometry")
    values = _values(table, columns, ("time", "v", "omega"), angle)
    if len(values) < 2:
        raise FileError(f"{table.name}: odometry needs at least 2 rows, got {len(values)}")
    for column, limit, what in ((1, FASTEST, "m/s"), (2, QUICKEST, "rad/s")):
        bad = np.abs(values[:, column]) > limit
        if bad.any():
            k = int(np.argmax(bad))
            raise FileError(
                f"{table.name}, line {table.lines[k]}: {values[k, column]:.4g} {what} is no robot: "
                "another unit or column?"
            )
    return Odometry(table.name, *values.T, table.lines)


def read_landmarks(path):
    """A map of landmarks, as `Landmarks`; refuses doubled ids and points that are none."""
    table, columns = _columns(path, "landmarks")
    ids = [_id(row[columns["id"][0]]) for row in table.cells]
    for k, name in enumerate(ids):
        if name is None:
            raise FileError(f"{table.name}, line {table.lines[k]}: a landmark needs an id")
        if name in ids[:k]:
            raise FileError(f"{table.name}, line {table.lines[k]}: the landmark {name!r} appears twice")
    return Landmarks(table.name, tuple(ids), _values(table, columns, ("x", "y"), None))


def read_readings(path, angle=None):
    """Ranges and bearings to landmarks, as `Readings`; refuses ranges that are negative and bearings beyond a turn."""
    table, columns = _columns(path, "readings")
    values = _values(table, columns, ("time", "range", "bearing"), angle)
    for bad, what in (
        (values[:, 1] <= 0, "a range must be positive"),
        (
            np.abs(values[:, 2]) > 2 * np.pi + 0.01,
            "a bearing must lie within a turn: are they degrees? Say --angle deg",
        ),
    ):
        if bad.any():
            raise FileError(f"{table.name}, line {table.lines[int(np.argmax(bad))]}: {what}")
    ids = tuple(_id(row[columns["id"][0]]) for row in table.cells)
    return Readings(table.name, values[:, 0], ids, values[:, 1:], table.lines)


def read_truth(path, angle=None):
    """True poses of a drive, as `Truth`; its times must increase."""
    table, columns = _columns(path, "truth")
    values = _values(table, columns, ("time", "x", "y", "theta"), angle)
    if (np.diff(values[:, 0]) <= 0).any():
        k = int(np.argmax(np.diff(values[:, 0]) <= 0)) + 1
        raise FileError(f"{table.name}, line {table.lines[k]}: the time does not increase")
    return Truth(table.name, values[:, 0], values[:, 1:])


def _columns(path, kind):
    """(table, {meaning: (index, unit)})."""
    table, order = read_table(path), ORDERS[kind]
    columns, _ = columns_of(table, order)
    if any(name in columns for name in order):
        need(table, columns, order, kind)
        return table, {name: (columns[name].index, columns[name].unit) for name in order}
    if not len(order) <= table.width <= len(order) + EXTRA.get(kind, 0):
        raise FileError(
            f"{table.name}, line {table.lines[0]}: {kind} are rows of {' '.join(order)}, got {table.width} columns"
        )
    return table, {name: (k, None) for k, name in enumerate(order)}


def _values(table, columns, names, angle):
    """The columns as floats (n, k) in s, m and rad; finite, with lengths no robot exceeds."""
    values = table.numbers([columns[name][0] for name in names])
    for k, name in enumerate(names):
        unit = columns[name][1]
        if name in ("bearing", "theta", "omega"):
            if (unit or angle or "").startswith("deg") or ANGLES.get(unit) == "deg":
                values[:, k] *= np.pi / 180
        elif name == "time":
            values[:, k] *= TIMES.get(unit, 1.0)
        elif unit in LENGTHS:
            values[:, k] *= LENGTHS[unit] / 1000.0
        limit = 1e12 if name == "time" else FARTHEST
        bad = ~(np.abs(values[:, k]) <= limit)
        if bad.any():
            row = int(np.argmax(bad))
            got = f"{name} {values[row, k]:g}"
            raise FileError(
                f"{table.name}, line {table.lines[row]}: expected a finite number of sensible size, got {got}"
            )
    return values


def _id(entry):
    """An id as text, `7.0` like `7`; None when it is unknown."""
    entry = entry.strip()
    if entry.lower() in UNKNOWN:
        return None
    try:
        number = float(entry)
    except ValueError:
        return entry
    return str(int(number)) if number.is_integer() else entry
