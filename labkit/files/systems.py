"""The files of the lab sheet: a system of three points, swirled frames, a calibrated tool.

The sheet names the functions that read and write them and prints no file: this form is ours. A system is three lines
x y z (mm): the origin, a point on the x axis, a point on the y axis. Frames are lines x y z (mm) a b c (deg); a tool is
two lines x y z (mm), the tip in the flange and the pivot in the world. Separators, commas and comments as in `text`.

Source: lab sheet "Kalibrierung", Hochschule Darmstadt, 2016: LoadSys (section 1), LoadSysN (listing 6), LoadCalFrames
and SaveCal (listing 8).
"""

from pathlib import Path

import numpy as np

from ..checks import as_count, as_finite, as_shape
from .text import FileError, read_table

POINTS = ("origin", "point on the x axis", "point on the y axis")


def load_system(path):
    """The three points of a system (mm), shape (3, 3): origin, on the x axis, on the y axis.

    Raises
    ------
    FileError
        One sentence with file and line.
    """
    points = _rows(path, 3, "x y z")
    if len(points) != 3:
        raise FileError(f"{Path(path).name}: expected three points ({', '.join(POINTS)}), got {len(points)}")
    return points


def load_systems(paths):
    """The points of several systems (mm), shape (n, 3, 3); as `load_system`, the first fault ends it."""
    return np.array([load_system(path) for path in paths]).reshape(-1, 3, 3)


def load_frames(path):
    """Swirled frames x y z (mm) a b c (deg), shape (n, 6).

    Raises
    ------
    FileError
        One sentence with file and line.
    """
    return _rows(path, 6, "x y z a b c")


def save_system(path, points, digits=None):
    """Write the three points of a system (mm), shape (3, 3), with so many significant digits; None loses nothing."""
    _save(path, as_shape(as_finite(points, "points"), "points", 3, 3), digits)


def save_calibration(path, tip, pivot, digits=None):
    """Write a tool: its tip in the flange and the pivot in the world (mm), shape (3,); digits as in `save_system`."""
    _save(path, np.array([as_shape(tip, "tip", 3), as_shape(pivot, "pivot", 3)]), digits)


def load_calibration(path):
    """The tip in the flange and the pivot in the world (mm), shape (3,) each, as `save_calibration` wrote them.

    Raises
    ------
    FileError
        One sentence with file and line.
    """
    rows = _rows(path, 3, "x y z")
    if len(rows) != 2:
        raise FileError(f"{Path(path).name}: expected two points (tip, pivot), got {len(rows)}")
    return rows[0], rows[1]


def _rows(path, width, names):
    """Finite numbers of a file, shape (n, width)."""
    table = read_table(path)
    if table.titles and not table.from_comment and [title.lower() for title in table.titles] != names.split():
        raise FileError(f"{table.name}: expected the columns {names}, got {' '.join(table.titles)}")
    for cells, line in zip(table.cells, table.lines):
        if len(cells) != width:
            raise FileError(f"{table.name}, line {line}: expected {width} numbers {names}, got {len(cells)}")
    values = table.numbers()
    for row, line in zip(values, table.lines):
        if not np.isfinite(row).all():
            raise FileError(f"{table.name}, line {line}: expected finite numbers, got {row[~np.isfinite(row)][0]}")
    return values


def _save(path, rows, digits):
    form = repr if digits is None else f"{{:.{as_count(digits, 'digits')}g}}".format
    lines = ["  ".join(form(float(value)) for value in row) for row in rows]
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")
