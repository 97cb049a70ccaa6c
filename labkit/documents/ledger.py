"""What the documents print, computed afresh and compared with what is printed.

A row of `data/ledger.csv` names one printed thing; a function here, registered under the row's id with `computes`,
returns what data and library give today. The status follows from the two by `judge`, and a test demands that it is the
one the row states. Only results and claims are counted:

result       a number or formula the document arrives at
claim        a sentence that can be tried
check        one input printed twice, which must agree
structure    true of every such thing, whatever was measured: a row 0 0 0 1, an identity, bytes that follow each other
consequence  follows from another row

reproduced      equal to the printed digits
rounding        off by no more than the printed inputs allow, propagated from their digits
cut off         the digits were truncated instead of rounded
misprint        what is printed around it proves another value, and no slip elsewhere explains it as well
contradiction   two printed things exclude each other, and the data cannot tell which is wrong
refuted         a claim, computable from printed inputs alone, does not hold
consistent      inputs unpublished: a reconstruction agrees, which proves possibility, not truth
not computable  inputs unpublished, and no reconstruction decides it

A misprint may come from the conversion of the document to text as well as from its authors.
"""

import csv
import functools
import importlib
import inspect
import pkgutil
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..tables import DATA
from .rounding import half_unit, is_cut_off, number
from .slips import HERE

KINDS = ("result", "claim", "check", "structure", "consequence")
COUNTED = ("result", "claim")
STATUSES = (
    "reproduced", "rounding", "cut off", "misprint", "contradiction", "refuted", "consistent", "not computable"
)  # fmt: skip
COLUMNS = ("id", "document", "place", "quantity", "printed", "unit", "kind", "status", "note")
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
    kind: str
    status: str
    note: str


@dataclass(frozen=True)
class Computed:
    """What data and library say about a printed number.

    value: number, array (a row's index picks the entry) or text; None where nothing can be computed.
    bound: how far the value can be off: what `rounding.propagate` finds for printed inputs, or the spread of what a
           reconstruction leaves open (same shape, or a scalar); None for exact inputs.
    slips: names of the printed things of which one slip explains the disagreement, as `slips.explained_by` finds them
           (`HERE` for the row's own); a dictionary {index: names} where the rows of an array differ; None where no
           arithmetic determines what should stand there.
    simulated: True where inputs were never published.
    proof: the argument in one or two sentences, with the computed figures in it.
    """

    value: object
    bound: object = None
    slips: object = None
    simulated: bool = False
    proof: str = ""

    def at(self, index):
        """The entry a row's index picks."""

        def pick(x):
            return x if x is None or np.ndim(x) == 0 else np.asarray(x)[index]

        slips = self.slips.get(index) if self._many_slips else self.slips
        return Computed(pick(self.value), pick(self.bound), slips, self.simulated, self.proof)

    @property
    def _many_slips(self):
        return isinstance(self.slips, Mapping) and any(isinstance(key, tuple) for key in self.slips)


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


@functools.cache
def _load_claims():
    for document in DOCUMENTS:
        package = importlib.import_module(f".{document.replace(' ', '_')}", __package__)
        for module in pkgutil.iter_modules(package.__path__):
            if module.name.startswith("claims_"):
                importlib.import_module(f"{package.__name__}.{module.name}")


def rows(path=DATA / "ledger.csv"):
    """All rows of the ledger; refuses what is misspelled, double or missing, with the line."""
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
            for name, known in (("kind", KINDS), ("status", STATUSES), ("document", DOCUMENTS)):
                if getattr(row, name) not in known:
                    raise ValueError(f"{where}: {name} must be one of {', '.join(known)}, got {getattr(row, name)!r}")
            if not _ENTRY.fullmatch(row.id) or row.id in seen or not row.printed:
                raise ValueError(f"{where}: the id {row.id!r} is malformed or used twice, or nothing is printed")
            seen.add(row.id)
            found.append(row)
    return found


def base_of(row):
    """The id of a row without its index."""
    return _ENTRY.fullmatch(row.id)["base"]


def function_of(row):
    """The function that computes a row; refuses an id that none is registered for."""
    _load_claims()
    if base_of(row) not in _functions:
        raise KeyError(
            f"no function computes the ledger id {base_of(row)!r}; register one in labkit/documents with @computes"
        )
    return _functions[base_of(row)]


def compute(row):
    """The `Computed` of one row, from the function registered under its id."""
    computed, index = function_of(row)(), _ENTRY.fullmatch(row.id)["index"]
    return computed.at(tuple(map(int, index.split(",")))) if index else computed


def _written(row):
    """The function as it was written, out of its cache and its partial."""
    function = function_of(row).__wrapped__
    return getattr(function, "func", function)


def chapter_of(row):
    """Name of the notebook that a row belongs to, as in "01_frames", as the module says that computes it."""
    return sys.modules[_written(row).__module__].NOTEBOOK


def code_of(row):
    """Where a row is computed, and the lines that do it: (file and line, source)."""
    function = _written(row)
    lines, first = inspect.getsourcelines(function)
    file = function.__module__.replace(".", "/") + ".py"
    return f"{file}, line {first}", "".join(lines).rstrip()


def is_vacuous(printed, bound):
    """Whether a bound excludes nothing: it is wider than a unit of the last digit and than half the number itself."""
    return bound > 2 * half_unit(printed) and bound > abs(number(printed)) / 2


def judge(row, computed):
    """The status that the computation gives a row, by comparing it with the printed number."""
    half = half_unit(row.printed)
    if half is None or computed.value is None or isinstance(computed.value, str):
        return _judge_words(row, computed)
    if np.isnan(computed.value):
        return "not computable"
    bound = 0.0 if computed.bound is None else float(computed.bound)
    value, deviation = float(computed.value), abs(float(computed.value) - number(row.printed))
    reproduced = deviation <= half * (1 + 1e-6)
    within = reproduced or deviation < (half + bound) * (1 - 1e-6)
    if computed.simulated:
        agrees = within or is_cut_off(row.printed, value, bound)
        return "consistent" if agrees and not is_vacuous(row.printed, bound) else "not computable"
    if reproduced:
        return "reproduced"
    if within:
        return "not computable" if is_vacuous(row.printed, bound) else "rounding"
    return "cut off" if is_cut_off(row.printed, value, bound) else _disagreement(row, computed)


def _judge_words(row, computed):
    same = str(computed.value) == row.printed
    if computed.value is None or (computed.simulated and not same):
        return "not computable"
    if same:
        return "consistent" if computed.simulated else "reproduced"
    return _disagreement(row, computed)


def _disagreement(row, computed):
    """Whose fault: the claim's, that of what is printed here and nowhere else, or nobody can tell."""
    if row.kind == "claim":
        return "refuted"
    if computed.slips is None:
        return "contradiction"
    return "contradiction" if set(computed.slips) - {HERE} else "misprint"


def table():
    """All rows with what they compute to: a list of (row, computed, status found)."""
    return [(row, computed, judge(row, computed)) for row in rows() for computed in [compute(row)]]


def counts(all_rows):
    """{document: {status: number of results and claims}} of rows, by the status they state."""
    found = {document: dict.fromkeys(STATUSES, 0) for document in DOCUMENTS}
    for row in all_rows:
        if row.kind in COUNTED:
            found[row.document][row.status] += 1
    return found
