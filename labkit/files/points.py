"""Measured points: three columns x y z, with or without titles."""

from dataclasses import dataclass

import numpy as np

from .columns import LENGTHS, columns_of, need, one_unit
from .poses import LARGEST, _refuse_infinite
from .text import FileError, read_table


@dataclass(frozen=True, eq=False)
class Points:
    """Points of one file: points (n, 3), places ("line 7"), length unit, and what was assumed in one line."""

    name: str
    points: np.ndarray
    places: tuple
    length: str
    assumed: str

    def __len__(self):
        return len(self.points)

    def in_unit(self, length):
        """The points in m or mm, (n, 3)."""
        return self.points * (LENGTHS[self.length] / LENGTHS[length])


def read_points(path, length=None, any_size=False):
    """Points of a file: columns x y z by their titles, or three columns (four, with a number before them) without.

    Raises
    ------
    FileError
        One sentence with file and line.
    """
    table = read_table(path)
    columns, _ = columns_of(table, ("x", "y", "z"))
    if columns:
        need(table, columns, ("x", "y", "z"), "a point")
        picked, unit = [columns[name].index for name in "xyz"], one_unit(table, columns, ("x", "y", "z"), LENGTHS)
    elif table.width in (3, 4):
        picked, unit = list(range(table.width - 3, table.width)), None
    else:
        raise FileError(f"{table.name}, line {table.lines[0]}: expected points x y z, got {table.width} columns")
    values = table.numbers(picked)
    _refuse_infinite(table, values)
    reach = float(np.abs(values).max(initial=0.0))
    said = "m" if unit and LENGTHS[unit] > 1 else unit and "mm"
    chosen = said or length or ("m" if reach <= 5.0 else "mm")
    if reach > LARGEST[chosen] and not any_size:
        raise FileError(
            f"{table.name}: points reach {reach:.4g} {chosen}: are they in another unit? Say --length, "
            "or --any-size if it is so"
        )
    why = " (header)" if said else "" if length else " (assumed)"
    places = tuple(f"line {line}" for line in table.lines)
    return Points(table.name, values, places, chosen, f"{table.name}: {len(values)} points, {chosen}{why}")
