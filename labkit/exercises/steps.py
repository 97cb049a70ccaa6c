"""The general layer, steps: at which step of the student's own code a result goes wrong, and in which way.

The code is run again with one thing in it otherwise: a change of the code (`mutation`), a value on the way turned into
another (`rerun.OTHERWISE`), or a value on the way that the chapter's solution has. What mends the result on all draws
is where it goes wrong.
"""

import itertools
import time

import numpy as np

from . import metrics, operands, relations, rerun, slips
from .arguments import is_numeric

WORTH = 3  # how unlikely a change of the code may be that is tried before changes of values
CLOSE = 1e-7  # how far, relatively, two values may lie apart that are the same
BATCH = 120  # changes that are tried at once
NAMED = 4  # values that are told to be right, at most
ALONE = "With this alone changed, your result is right"


class Case:
    """One draw: its arguments, and whether a result is right on it."""

    def __init__(self, args, metric, expected, was_right=False):
        self.args, self.metric, self.expected, self.was_right = args, metric, expected, was_right

    def keep(self, found):
        """Whether what a changed function gave, in a tuple, is right; None stands for one that failed."""
        if found is None:
            return False
        try:
            return bool(self.metric.equal(found[0], self.expected))
        except Exception:  # a result of a kind that no metric foresees
            return False


class Search:
    """Looks for one change that mends a student's function."""

    def __init__(self, written, names, cases, results, more, seconds):
        """`results` of the cases as arrays; `more()` gives further cases, on which what was found is tried once more;
        `seconds` for each kind of change.
        """
        self.written, self.names, self.more, self.seconds = written, names, more, seconds
        order = sorted(range(len(cases)), key=lambda k: cases[k].was_right)
        self.cases, self.results = [cases[k] for k in order], [results[k] for k in order]
        self.values = [written.trace(case.args, seconds) for case in self.cases]

    def words(self):
        """What is wrong where, from the likeliest kind of change to the least; None where nothing mends the result."""
        return self.code_words(range(WORTH)) or self.value_words() or self.code_words(range(WORTH, 9))

    def mending(self, plans, values=None):
        """The first plan that makes the result right on all draws; None where none does in time."""
        left = self.seconds
        for start in range(0, len(plans), BATCH):
            batch, began, before = plans[start : start + BATCH], time.thread_time(), self.written.spent
            fits = self._fitting(batch, 0, left, values)
            for plan in [plan for plan, fit in zip(batch, fits) if fit]:
                others = (self._fitting([plan], i, self.seconds, values) for i in range(1, len(self.cases)))
                more = (self.written.results([plan], c.args, self.seconds, c.keep) for c in self.more(plan[0]))
                if all(fit == [True] for fit in (*others, *more)):
                    return plan
            left -= time.thread_time() - began + self.written.spent - before
            if left <= 0.01 or len(fits) < len(batch):
                return None
        return None

    def _fitting(self, plans, i, seconds, values):
        """Whether each plan makes the i-th result right; `values[i]` are those that plans put in other's places."""
        case = self.cases[i]
        if values is not None:
            plans = [(kind, k, list(values[i][q][1])) for kind, k, q in plans]
        return self.written.results(plans, case.args, seconds, case.keep)

    # Changes of the code

    def code_words(self, ranks):
        changes = self.written.changes
        plan = self.mending([("code", k) for k, (rank, *_) in enumerate(changes) if rank in ranks])
        if plan is None:
            return None
        _, line, code, mends = changes[plan[1]]
        return f"in line {line}, `{code}`: {mends}. {ALONE}"

    # Values on the way turned into others

    def value_words(self):
        return self._turned_words(self._turned()) or self._turned_words(self._with_own())

    def _turned_words(self, plans):
        plan = self.mending(list(plans))
        if plan is None:
            return None
        kind, k, change, other = plan
        name = "" if other is None else self.written.places[other][2] if kind == "own" else self.names[other]
        return f"{self._where(k)}: {rerun.OTHERWISE[change][0].format(name)}. {ALONE}"

    def _where(self, k):
        line, code, *_ = self.written.places[k]
        return f"in line {line}, `{code}`"

    def _turned(self):
        """Plans of values turned into others, the likeliest first, without those that change nothing or cannot be."""
        numeric = [i for i in range(len(self.names)) if all(is_numeric(case.args[i]) for case in self.cases)]
        seen = [(k, values[0]) for k, (count, values) in enumerate(self.values[0]) if count]
        for change, (_, function) in enumerate(rerun.OTHERWISE):
            for argument in [None] if change < rerun.ALONE else numeric:
                others = [] if argument is None else [np.asarray(self.cases[0].args[argument], dtype=float)]
                for k, value in seen:
                    if _changes(function, value, others):
                        yield "value", k, change, argument

    def _with_own(self):
        """Plans of values put together with a variable that was bound before."""
        places, values = self.written.places, self.values[0]
        bound = [k for k, (_, code, name, *_) in enumerate(places) if name and code != name and values[k][0]]
        for change in range(rerun.ALONE, rerun.ALONE + rerun.WITH_OWN):
            for variable in bound:
                for k in range(variable + 1, len(places)):
                    if values[k][0] and _changes(
                        rerun.OTHERWISE[change][1], values[k][1][0], [values[variable][1][-1]]
                    ):
                        yield "own", k, change, variable

    # Values of the solution

    def given_words(self, solution):
        """The smallest part whose value, taken from the solution, mends the result; and how the two differ."""
        if solution is None:
            return None
        plan = self.mending([("given", k, q) for k, q in self._given(solution)], solution.values)
        return plan and self._compared(*plan[1:], solution)

    def _given(self, solution):
        """(place, place of the solution) of values of one shape that differ on every draw, the smallest place first."""
        places = self.written.places
        for k in sorted(range(len(places)), key=lambda k: places[k][3]):
            if self._is_known(k, solution):
                continue
            for q in solution.distinct:
                pairs = [(mine[k], theirs[q]) for mine, theirs in zip(self.values, solution.values)]
                if all(_exchangeable(a, b) for a, b in pairs) and not (solution.is_result[q] and self.is_result(k)):
                    yield k, q

    def _is_known(self, k, solution):
        """Whether a value on the way is one that the solution has as well, or an argument: then it is right."""
        if not all(values[k][0] for values in self.values):
            return True
        mine = [values[k][1] for values in self.values]
        known = ([values[q][1] for values in solution.values] for q in solution.distinct)
        given = ([rerun.numeric(case.args[i]) for case in self.cases] for i in range(len(self.names)))
        return any(
            all(t is not None and _same(m[0], t[0] if t.ndim > m.ndim - 1 else t) for m, t in zip(mine, theirs))
            for theirs in itertools.chain(known, given)
        )

    def is_result(self, k):
        return all(r is not None and _same(v[k][1][-1], r) for v, r in zip(self.values, self.results))

    def _compared(self, k, q, solution):
        mine = [values[k][1] for values in self.values]
        theirs = [np.broadcast_to(v[q][1], m.shape) for v, m in zip(solution.values, mine)]
        words = value_relation(mine, theirs, [dict(zip(self.names, case.args)) for case in self.cases])
        words = words or f"this value is not right{self._of_right_parts(k, solution)}"
        end = "" if words[-1] in ".?" else "."
        return f"{self._where(k)}: {words}{end} With the right value there, all that follows is right"

    def _of_right_parts(self, k, solution):
        """Whether the parts of a wrong value are right, so that it is what is done with them."""
        parts, part = [], k - 1
        while part >= self.written.places[k][4]:
            parts.insert(0, part)
            part = self.written.places[part][4] - 1
        parts = [part for part in parts if all(values[part][0] for values in self.values)]
        codes = dict.fromkeys(f"`{self.written.places[part][1]}`" for part in parts if self._is_known(part, solution))
        if not codes or not all(self._is_known(part, solution) for part in parts):
            return ""
        are, them = ("are", "them") if len(codes) > 1 else ("is", "it")
        return f", though {' and '.join(codes)} in it {are}: look at what is done with {them}"


def value_relation(mine, theirs, named):
    """How values on the way differ from those that are right, in words; None where nothing is found."""
    mine = [m[0] if len(m) == 1 else m for m in mine]
    theirs = [t[0] if len(t) == 1 else t for t in theirs]
    exact = metrics.Numbers(1e-9)
    words = relations.difference_words(exact, list(zip(mine, theirs)), (), True)
    words = words or operands.operand_words(exact, mine, theirs, named)
    words = words or relations.difference_words(exact, list(zip(mine, theirs)), ())
    for said, told in (("your result", "it"), ("your matrix", "it"), ("the expected", "the right")):
        words = words and words.replace(said, told)
    return words


class Solution:
    """The values on the way of the chapter's solution on the same draws."""

    def __init__(self, written, cases, seconds):
        self.places, self.values = written.places, [written.trace(case.args, seconds) for case in cases]
        kept = [q for q in range(len(self.places)) if all(values[q][0] for values in self.values)]
        self.distinct = []
        for q in kept:
            if not any(_all_same(self.values, q, other) for other in self.distinct):
                self.distinct.append(q)
        expected = [rerun.numeric(case.expected) for case in cases]
        self.is_result = {
            q: all(e is not None and _same(values[q][1][-1], e) for values, e in zip(self.values, expected))
            for q in self.distinct
        }


def _all_same(draws, q, other):
    return all(v[q][0] == v[other][0] and _same(v[q][1], v[other][1]) for v in draws)


def _same(a, b):
    return np.shape(a) == np.shape(b) and bool(np.allclose(a, b, rtol=CLOSE, atol=1e-12, equal_nan=True))


def _exchangeable(mine, theirs):
    """Whether a value of the solution can take the place of one of the student's, and is another."""
    (count, a), (turns, b) = mine, theirs
    fits = count > 0 and turns in (1, count) and a.shape[1:] == b.shape[1:]
    return fits and not _same(a, np.broadcast_to(b, a.shape))


def _changes(function, value, others):
    try:
        with np.errstate(all="ignore"):
            new = np.asarray(function(value.copy(), *others), dtype=float)
    except Exception:  # not of a value like this
        return False
    return np.isfinite(new).all() and not _same(new, value)


def of_solution(exercise, cases, seconds):
    """The solution's values on the way; None where it is not at hand."""
    found = slips.solved(exercise)
    if found is None:
        return None
    function, tree = found
    return Solution(rerun.Written(function, tree), cases, seconds)
