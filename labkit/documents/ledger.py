"""Every number the documents print, computed afresh and compared with what is printed.

A row of `data/ledger.csv` names one printed number; a function here, registered under the row's id with `computes`,
returns the value that data and library give today. The status follows from the two by `judge`, and a test demands that
it is the one the row states:

reproduced   equal to the printed digits
rounding     off, but by no more than the rounding of the printed inputs allows (the bound is computed)
misprint     the arithmetic around it proves another value
superseded   computable, and the document's claim does not hold
unpublished  the inputs were never published; a simulation of the stated setup gives the value beside it
"""

import csv
import functools
import importlib
import pkgutil
import re
import sys
from dataclasses import dataclass

import numpy as np

from ..tables import DATA

STATUSES = ("reproduced", "rounding", "misprint", "superseded", "unpublished")
COLUMNS = ("id", "document", "place", "quantity", "printed", "unit", "status", "note")
DOCUMENTS = ("lab sheet", "thesis", "report", "lecture")
_ENTRY = re.compile(r"(?P<base>[^\[\]]+)(\[(?P<index>\d+(,\d+)*)\])?")
_functions = {}


@dataclass(frozen=True)
class Row:
    """One printed number (or statement) of a document; `id` may end in an index, as in "frames.K0_T_K1[0,3]"."""

    id: str
    document: str
    place: str
    quantity: str
    printed: str
    unit: str
    status: str
    note: str


@dataclass(frozen=True)
class Computed:
    """What data and library say about a printed number.

    value: number, array (a row's index picks the entry) or text.
    bound: how far rounding of the printed inputs can move the value (same shape, or a scalar); None for exact inputs.
           For simulated values: how far the simulation honestly may lie from the printed one.
    misprint: True where a computed check proves that the printed number cannot be right (scalar, or an array).
    simulated: True where the inputs were never published.
    proof: the argument in one or two sentences, with the computed figures in it.
    """

    value: object
    bound: object = None
    misprint: object = False
    simulated: bool = False
    proof: str = ""

    def at(self, index):
        """The entry a row's index picks."""

        def pick(x):
            return x if x is None or np.ndim(x) == 0 else np.asarray(x)[index]

        return Computed(pick(self.value), pick(self.bound), pick(self.misprint), self.simulated, self.proof)


def computes(*ids):
    """Register a function without arguments that returns the `Computed` of the rows with these ids (without index)."""

    def register(function):
        cached = functools.cache(function)
        for key in ids:
            if key in _functions:
                raise ValueError(f"two functions compute the ledger id {key!r}")
            _functions[key] = cached
        return cached

    return register


def _load_claims():
    for document in DOCUMENTS:
        package = importlib.import_module(f".{document.replace(' ', '_')}", __package__)
        for module in pkgutil.iter_modules(package.__path__):
            if module.name.startswith("claims_"):
                importlib.import_module(f"{package.__name__}.{module.name}")


def rows(path=DATA / "ledger.csv"):
    """All rows of the ledger; refuses an unknown status or document, a double id, a missing entry, with the line."""
    found, seen = [], set()
    with open(path, newline="", encoding="utf-8") as file:
        reader = csv.reader(file)
        if tuple(next(reader, ())) != COLUMNS:
            raise ValueError(f"{path.name}, line 1: expected the columns {', '.join(COLUMNS)}")
        for entries in reader:
            where = f"{path.name}, line {reader.line_num}"
            if len(entries) != len(COLUMNS):
                raise ValueError(f"{where}: expected {len(COLUMNS)} entries, got {len(entries)}")
            row = Row(*entries)
            if row.status not in STATUSES:
                raise ValueError(f"{where}: status must be one of {', '.join(STATUSES)}, got {row.status!r}")
            if row.document not in DOCUMENTS:
                raise ValueError(f"{where}: document must be one of {', '.join(DOCUMENTS)}, got {row.document!r}")
            if not _ENTRY.fullmatch(row.id) or row.id in seen or not row.printed:
                raise ValueError(f"{where}: the id {row.id!r} is malformed or used twice, or nothing is printed")
            seen.add(row.id)
            found.append(row)
    return found


def compute(row):
    """The `Computed` of one row, from the function registered under its id."""
    _load_claims()
    match = _ENTRY.fullmatch(row.id)
    if match["base"] not in _functions:
        raise KeyError(
            f"no function computes the ledger id {match['base']!r}; register one in labkit/documents with @computes"
        )
    computed = _functions[match["base"]]()
    return computed.at(tuple(map(int, match["index"].split(",")))) if match["index"] else computed


def chapter_of(row):
    """Name of the notebook that a row belongs to, as in "01_frames", as the module says that computes it."""
    _load_claims()
    base = _ENTRY.fullmatch(row.id)["base"]
    if base not in _functions:
        raise KeyError(f"no function computes the ledger id {base!r}; register one in labkit/documents with @computes")
    function = _functions[base].__wrapped__
    module = getattr(function, "func", function).__module__  # a partial has its function's module
    return sys.modules[module].NOTEBOOK


def half_unit(printed):
    """Half a unit in the last printed digit: the most that rounding the printed number itself can hide.

    Reads 1.010000, -0.5, 1,5 (decimal comma), 3e-4 and 12; returns None for text.
    """
    match = re.fullmatch(r"[-+]?\d+(?:[.,](?P<decimals>\d+))?(?:[eE](?P<exponent>[-+]?\d+))?", printed.strip())
    if not match:
        return None
    return 0.5 * 10.0 ** (int(match["exponent"] or 0) - len(match["decimals"] or ""))


def judge(row, computed):
    """The status that the computation gives a row, by comparing it with the printed number."""
    half = half_unit(row.printed)
    if half is None:
        same = str(computed.value) == row.printed
        reproduced, within = same, False
    else:
        deviation = abs(float(computed.value) - float(row.printed.replace(",", ".")))
        reproduced = deviation <= half * (1 + 1e-6)
        within = computed.bound is not None and deviation <= (half + float(computed.bound)) * (1 + 1e-6)
    if computed.simulated:
        return "unpublished" if reproduced or within else "superseded"
    if reproduced:
        return "reproduced"
    if within:
        return "rounding"
    return "misprint" if bool(computed.misprint) else "superseded"


def table():
    """All rows with what they compute to: a list of (row, computed, status found)."""
    return [(row, computed, judge(row, computed)) for row in rows() for computed in [compute(row)]]


def totals():
    """Number of rows by status found, in the order of `STATUSES`."""
    found = [status for _, _, status in table()]
    return {status: found.count(status) for status in STATUSES}


def as_text():
    """The whole ledger as plain text, one line per row, and the totals beneath; `python lab.py ledger` prints it."""
    lines = []
    for row, computed, status in table():
        value = computed.value if isinstance(computed.value, str) else f"{float(computed.value):.8g}"
        mark = "" if status == row.status else f"  (the ledger says {row.status})"
        lines.append(f"{row.id:34} {row.printed:>14} {row.unit:5} computed {value:>14}  {status}{mark}")
    lines.append("")
    lines.append("   ".join(f"{status} {count}" for status, count in totals().items()))
    return "\n".join(lines)
