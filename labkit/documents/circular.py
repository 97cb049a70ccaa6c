"""Which computed values read their own printed answer? Move every printed number a little and see what follows.

All tables of `data/` are copied with digits of its own behind each number, a move that is known and smaller than the
last printed digit, and the ledger is computed again from the copy. A result that agrees with what is printed, and that
moves exactly as one of the printed numbers equal to it does, was read and not computed. No word that agrees stands in a
table: tests/documents/test_contrary.py shows for each that another one comes out of other data.
"""

import csv
import functools
import gc
import re
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .. import tables
from .ledger import COUNTED, base_of, compute, rows
from .rounding import half_unit, number

KEYS = (
    "pose",
    "run",
    "line",
    "row",
    "link",
    "angle_deg",
    "criterion",
    "steps",
    "iterations",
)  # name rows, count things
AGREEING = ("reproduced", "rounding", "cut off", "consistent")
_PLAIN = re.compile(r"([-+]?\d+(?:\.\d*)?)([eE][-+]?\d+)?")


def _moved(text, rng):
    """A printed number with seven digits of its own behind it, or the text where it is no number."""
    match = _PLAIN.fullmatch(text)
    if not match:
        return text
    mantissa = match[1] if "." in match[1] else match[1] + "."
    return f"{mantissa}0{rng.integers(10**6, 10**7)}{match[2] or ''}"


def _move_tables(folder, rng):
    """Move all tables in a copy of `data/`: what stands in them, and by how much each number moves, shape (n, 2)."""
    moves = []
    for path in sorted(folder.rglob("*.csv")):
        if path.parent == folder:
            continue
        with open(path, newline="", encoding="utf-8") as file:
            header, *body = csv.reader(file)
        for line in body:
            for k, (name, text) in enumerate(zip(header, line)):
                line[k] = text if name in KEYS else _moved(text, rng)
                if line[k] != text:
                    moves.append((abs(float(text)), abs(float(line[k]) - float(text))))
        with open(path, "w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows([header, *body])
    return np.array(moves)


def _forget():
    """Empty every cache of this package, so that the next computation reads its tables again."""
    package = __package__.partition(".")[0]
    for cached in gc.get_objects():
        if isinstance(cached, functools._lru_cache_wrapper):
            function = getattr(cached.__wrapped__, "func", cached.__wrapped__)  # out of its partial
            if (function.__module__ or "").startswith(package):
                cached.cache_clear()


def _values(tried):
    """The computed values of rows; None for words, and where moved tables have no answer."""
    values, hopeless = [], set()
    for row in tried:
        value = None
        if base_of(row) not in hopeless:
            try:
                value = compute(row).value
            except (ValueError, AssertionError, KeyError, IndexError, ZeroDivisionError, np.linalg.LinAlgError):
                hopeless.add(base_of(row))
        values.append(None if value is None or isinstance(value, str) else float(value))
    return values


@dataclass(frozen=True, eq=False)
class Trial:
    """Results and claims that agree with what is printed, computed from the tables and from moved ones.

    Attributes
    ----------
    rows : list of ledger.Row
    before, after : list
        Their values, None for words.
    moves : array, shape (n, 2)
        What stands in the tables, and by how much each number was moved.
    """

    rows: list
    before: list
    after: list
    moves: np.ndarray

    @property
    def followers(self):
        """Rows that agree with what is printed because they read it."""
        tried = zip(self.rows, self.before, self.after)
        return [row for row, old, new in tried if _follows(row, old, new, self.moves)]

    @property
    def still(self):
        """Rows of computations in which no number moves with any table."""
        tried = list(zip(self.rows, self.before, self.after))
        moving = {base_of(row) for row, old, new in tried if new != old}
        return [row for row, old, _ in tried if old is not None and base_of(row) not in moving]


def trial(all_rows=None):
    """Compute the ledger from moved tables.

    Parameters
    ----------
    all_rows : list of ledger.Row, optional
        Those of `data/ledger.csv` by default.

    Returns
    -------
    Trial
    """
    tried = [
        row
        for row in (rows() if all_rows is None else all_rows)
        if row.kind in COUNTED and row.status in AGREEING and half_unit(row.printed) is not None
    ]
    before, home = _values(tried), tables.DATA
    with tempfile.TemporaryDirectory() as copy:
        moved = Path(copy) / "data"
        shutil.copytree(home, moved, ignore=shutil.ignore_patterns("own_data", "*.py", "*.md"))
        moves = _move_tables(moved, np.random.default_rng(20))
        try:
            tables.DATA = moved
            _forget()
            after = _values(tried)
        finally:
            tables.DATA = home
            _forget()
    return Trial(tried, before, after, moves)


def _follows(row, old, new, moves):
    """Whether a value has moved as one of the printed numbers equal to the row's has, in any unit of length."""
    if old is None or new is None or new == old:
        return False
    shift, printed = abs(new - old), abs(number(row.printed))
    scaled = moves[:, None, :] * np.array([1.0, 1000.0, 0.001])[:, None]
    same = np.abs(scaled[..., 0] - printed) <= half_unit(row.printed)
    return bool((same & np.isclose(scaled[..., 1], shift, rtol=1e-6, atol=0.0)).any())
