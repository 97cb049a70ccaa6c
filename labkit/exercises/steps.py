"""The general layer, steps: at which step of the student's own code a result goes wrong, and in which way.

The code is run again with one thing in it otherwise: a change of the code (`mutation`), a value on the way turned into
another (`rerun.OTHERWISE`), or a value on the way that the chapter's solution has. What mends the result on all draws
is where it goes wrong.
"""

import ast
import functools
import itertools
import math
import re
from dataclasses import dataclass

import numpy as np

from . import metrics, mutation, operands, relations, rerun, slips
from .arguments import is_numeric
from .wording import joined

WORTH = 3  # how unlikely a change of the code may be that is tried before changes of values
CLOSE = 1e-7  # how far, relatively, two values may lie apart that are the same
BATCH = 120  # changes that are tried at once
ENTRIES = 8  # of a result that are looked at one by one
SPOILT = 2  # times as far off is a part that a change makes worse than it was, though it mends another
ANGLES = re.compile(r"rad|deg|angle|(?<!re)turn|rot|axis|axes|theta|phi|psi|sin|cos|tan|pose|frame", re.IGNORECASE)
SCALED = re.compile(  # of a choice, which does not depend on how large all is that is compared
    "half of it|twice as much|a thousand|it belongs there in|its (square|root|reciprocal|log|exp|sine|tangent)"
    "|it is to be (multiplied|divided) by|the (square|root) of this"
)
CURVED = re.compile(
    "its (log|exp|sine|tangent|inverse|reciprocal)"
)  # of a word or a set: what is small is made a little more
LIFTED = re.compile(  # what brings a number over a bound, whatever is wrong
    "a thousand|divided by its( own)? length|multiplied by the length of"
)
RESCALED = re.compile("to be (multiplied|divided) by")  # as LIFTED, where bounds decide between words
NAMES = re.compile(r"[^\W\d]\w*")
FIRST_ROUND = "it is right in the first round, not in all behind it"
ONE_ENTRY, ONE_ROW = re.compile(r"\bentry\b"), re.compile(r"\brow(?=s?\b)")  # of a value that has several rounds
SUMMED = re.compile(r"\b(mean|sum|length|reverse)\b")
COUNT = re.compile(r"^len\([^()]*\)$|\.shape\[-?\d\]$|\.size$")  # of which no half, root or sine is meant
CHANCE = 1000  # one case of so many may be chance
BOUND = re.compile(r"^[\d.e+-]+ *[<>]|[<>]=? *[\d.e+-]+$")  # a comparison with a number
BOUNDING = re.compile(rf"(\w+\.)?({'|'.join(sorted(mutation.BOUNDS))})\(")
UNBOUNDED = {f"`{name}` is to be left out" for name in mutation.BOUNDED | mutation.BOUNDS}
DECIMALS = re.compile(r"[<>]=? *\d*(\.\d+(e[+-]?\d+)?|e-\d+)$|[<>]=? *\d+e-\d+$")  # a comparison with such a number
NEARER = {  # what brings a result nearer on every draw, and what is said where it is not there yet
    re.compile("these are too few rounds: on all draws here (.+) will do"): (
        "with {} rounds {}. Go on until nothing changes, or choose what needs no rounds"
    ),
    re.compile("rounding shows where a step is as short as this: (.+) will do"): (
        "with {} in its place {}. Of differences over so short a step rounding shows"
    ),
}
COMES_NEARER = "the result comes nearer on every draw, and is not there yet"
LEAVE_OUT = "should be left out"  # what is wrong where leaving out a part mends
NO_CASE = re.compile("(never|always) happen$|belongs there in all cases$|^this statement should be left out$")
TURNED, OTHER_SIGN = "has the wrong sign", "the sign is the other one"
UNEQUAL = ("where `==` belongs", "where `!=` belongs")  # what computed numbers are never, or always
TRUTHS = {"`0` belongs": "`False` belongs", "`1` belongs": "`True` belongs"}
NOT_NEEDED = "What you make of it there does not belong in the result"
FILLED = re.compile(r"\w+(\[.*?\] *[-+*/@%|&]*| *[-+*/@%|&]+)=[^=]")  # a[k] = ..., a += ...
HANDED_ON = re.compile(r"(\w+ = )?[\w.]+(\[[\w:, -]*\])*$")  # an array or a part of it, as it is
RIGHT = "your result is right on every draw tried"
ALONE = f"With this alone changed, {RIGHT}"
NOT_WHOLE = ", but not for whole numbers yet"


def _or_nothing(method):
    """What fails on values that nobody foresaw says nothing: an explanation is worth less than the check."""

    @functools.wraps(method)
    def told(*args):
        try:
            return method(*args)
        except Exception:
            return None

    return told


class Case:
    """One draw: its arguments, the expected result, and that of the student as the metric admits it, or `refused`."""

    def __init__(self, args, metric, expected, result=None, refused=None):
        self.args, self.metric, self.expected, self.result, self.refused = args, metric, expected, result, refused
        self.was_right = result is not None and metric.equal(result, expected)

    def keep(self, found):
        """Whether what a changed function gave, in a tuple, is right; None stands for one that failed."""
        if found is None:
            return False
        try:
            return bool(self.metric.equal(found[0], self.expected))
        except Exception:  # a result of a kind that no metric foresees
            return False

    def admit(self, found):
        """The result of a changed function as the metric takes it; None where it does not."""
        try:
            return self.metric.admit(found[0], self.expected)
        except Exception:  # as above, and what failed
            return None

    def gain(self, found, right):
        """How many parts of a result came right, all that were right still being so; 0 where none did."""
        result = self.admit(found)
        if result is None:
            return 0
        parts = self.right_parts(result)
        if not set(right) <= set(parts):
            return 0
        simple, was_simple = (_difference_words([self], [one]) for one in (result, self.result))
        return 100 if simple not in (None, was_simple) else len(parts) - len(right)

    def distances(self, result):
        """How far off each part of an admitted result is, by what is compared there."""
        return {d.what: d.amount for d in self.metric.deviations(result, self.expected)}

    def is_farther(self, result):
        """Whether some part of another result is off by far more than that of the student: that part is spoilt."""
        before = {} if self.result is None else self.distances(self.result)
        return any(off > SPOILT * before.get(what, np.inf) for what, off in self.distances(result).items())

    def is_nearer(self, result):
        """Whether all that is wrong in the student's result is off by no more than half as much in another."""
        off = {d.what: d.amount for d in self.metric.deviations(self.result, self.expected) if not d.within}
        after = self.distances(result)
        return all(after[what] <= amount / 2 for what, amount in off.items())

    def parts_before(self):
        """Names of the parts of the student's result that are right, be it refused as a whole; None if not known."""
        if self.result is not None or self.refused is None:
            return self.right_parts(self.result)
        if not isinstance(self.metric, metrics.Several):
            return None if np.shape(self.refused) == np.shape(self.expected) else []
        parts = zip(self.metric.names, self.metric.metrics, self.refused, self.expected)
        return [name for name, metric, r, e in parts if Case((), metric, e).keep_raw(r)]

    def keep_raw(self, found):
        """Whether a result is right that the metric has not admitted yet."""
        result = self.admit((found,))
        return result is not None and self.keep((result,))

    def right_parts(self, result):
        """Names of the parts of an admitted result that are right."""
        if result is None:
            return []
        if isinstance(self.metric, metrics.Several):
            return [name for name, part, r, e in self.metric.parts(result, self.expected) if part.equal(r, e)]
        try:
            off = self.metric.deviations(result, self.expected)
        except Exception:  # of a result that no metric foresees
            return []
        if len(off) > 1:
            return [d.what for d in off if d.within and d.what.startswith("the ")]
        if not isinstance(self.metric, metrics.Numbers) or not 0 < np.ndim(self.expected) < 3:
            return []
        r, e = np.asarray(result, dtype=float), np.asarray(self.expected, dtype=float)
        told = [k for k in range(min(e.shape[-1], ENTRIES)) if not np.isin(e[..., k], (0.0, 1.0)).all()]
        entries = "entry" if r.ndim == 1 else "column"
        return [f"{entries} {k} (counted from 0)" for k in told if _same(r[..., k], e[..., k])]


@dataclass(frozen=True)
class Judging:
    """How a change that was found is judged as an answer would be.

    more:  function of the kind of change that gives further cases, on which it is tried once more.
    holds: function of the changed function: whether it has the properties that an answer must have.
    whole: function of the changed function: whether it is right for whole numbers as well.
    """

    more: object
    holds: object
    whole: object


class Search:
    """Looks for one change that mends a student's function."""

    def __init__(self, written, names, cases, judging, budget):
        self.written, self.names, self.judging, self.budget = written, names, judging, budget
        self.cases = sorted(cases, key=lambda case: case.was_right)
        self.results = [None if case.result is None else rerun.numeric(case.result) for case in self.cases]
        self.values = _traces(written, self.cases, budget)
        self.exactly = all(isinstance(c.metric, metrics.Exactly) for c in self.cases)
        self.chosen = self.exactly and all(type(c.expected) is int for c in self.cases)
        self.worded = self.exactly and all(isinstance(c.expected, str) for c in self.cases)
        self.turns = any(map(ANGLES.search, written.lines.values()))
        self.right_for_whole = True

    @functools.cached_property
    def overflows(self):
        """Whether what is right elsewhere is wrong only where it is not finite: by rounding, it may be, so that what
        changes but the last bits mends it.
        """
        wrong = [rerun.numeric(case.refused) for case in self.cases if not case.was_right]
        finite = any(result is None or np.isfinite(result).all() for result in wrong)
        return len(wrong) < len(self.cases) and not finite

    def _does_not_matter(self, plan):
        """Whether the draws on which the result is right, and stays right, tell that a change mends others by luck."""
        changed, words = sum(self._cancelled(plan)), rerun.OTHERWISE[plan[2]][0]
        return changed and (self.overflows or words not in rerun.CONSTANTS and changed > len(self.cases) / 2)

    def _cancelled(self, plan):
        """Of every draw on which the result is right, and stays right, whether the plan changes a value there."""
        kind, k, change, *other = plan
        for values, case in zip(self.values, self.cases):
            mine = case.args[k] if kind == "argument" else values[k][1][0] if values[k][0] else None
            others = [case.args[i] if kind == "value" else values[i][1][-1] for i in other if i is not None]
            if case.was_right and mine is not None:
                mine, *others = (np.asarray(value, dtype=float) for value in (mine, *others))
                yield _changes(rerun.OTHERWISE[change][1], mine, others)

    @_or_nothing
    def finer_words(self):
        """That a bound or a step is too coarse, or that a loop has too few rounds: before the solution is looked at,
        which may well take all the time where an iteration is asked for.
        """
        return self.code_words((mutation.FINER,))

    @_or_nothing
    def words(self):
        """What is wrong where, from the likeliest kind of change to the least; None where nothing mends the result."""
        words = self.code_words(range(WORTH)) or self.value_words()
        return words or (None if self.overflows else self.code_words(range(WORTH, 9)))

    def mending(self, plans, values=None):
        """The first plan that makes the result right on all draws; None where none does in time."""
        tried = self._tried(plans, lambda batch, time: self._fitting(batch, 0, time, values))
        for plan in (plan for plan, fit in tried if fit):
            others = (self._fitting([plan], i, self.budget, values) for i in range(1, len(self.cases)))
            if all(fit == [True] for fit in others) and self._is_answer(plan):
                return plan
        return None

    def _tried(self, plans, results):
        """(plan, what comes of it) one after the other, by `results(plans, budget)`, for as long as there is time."""
        kind, first = self.budget.part(), 0
        while first < len(plans) and kind.left():
            found = results(plans[first : first + BATCH], kind.share())
            yield from zip(plans[first:], found)
            first += max(1, len(found))  # one that takes all the time alone may have a loop without an end

    def _is_answer(self, plan):
        """Whether the function with this change would be taken as an answer, as far as fresh draws tell."""
        if plan[0] in ("value", "own", "argument") and self._does_not_matter(plan):
            return False
        fresh = (self.written.results([plan], c.args, self.budget.left(), c.keep) for c in self.judging.more(plan[0]))
        if any(fit != [True] for fit in fresh):
            return False

        def changed(*args):
            found = self.written.results([plan], args, self.budget.left(), lambda found: found)
            if not found or found[0] is None:
                raise ValueError("the changed function failed")
            return found[0][0]

        if plan[0] == "given":
            return True
        self.right_for_whole = self.judging.whole(changed)
        return self.judging.holds(changed)

    def _alone(self):
        """What is said of the change that was found last."""
        return ALONE if self.right_for_whole else f"{ALONE}{NOT_WHOLE}"

    def _fitting(self, plans, i, budget, values):
        """Whether each plan makes the i-th result right; `values[i]` are those that plans put in other's places."""
        case = self.cases[i]
        if values is not None:
            plans = [(kind, k, list(_in_rounds(self.values[i][k], values[i][q])[1])) for kind, k, q in plans]
        return self.written.results(plans, case.args, budget.left(), case.keep)

    # Changes of the code

    def code_words(self, ranks):
        changes = self.written.changes
        likely = (k for k, (rank, *_) in enumerate(changes) if rank in ranks and self._may_be_said(changes[k][-1]))
        plan = self.mending([("code", k) for k in likely if not self._moves_a_bound(*changes[k][1:])])
        if plan is None:
            return None
        told = self._left_out_instead(plan[1])
        _, line, code, mends = changes[told]
        alone = self.written.left_alone[told]
        stays = f", so that `{alone}` stands alone" if 0 < len(alone) <= rerun.LENGTH else ""
        mends = self._of_truth(mends) + self._if_at_all(told)
        words = self._whatever_words(line, code, mends) or self._weight_words(line, code, mends)
        words = words or self._settled_words(line, mends)
        return words or f"in line {line}, `{code}`: {mends}{stays}. {self._alone()}"

    def _of_truth(self, mends):
        """The words of a change to 0 or 1 where True or False is asked for."""
        asked = all(isinstance(case.expected, bool) for case in self.cases)
        return re.sub("`[01]` belongs", lambda said: TRUTHS[said[0]], mends) if asked else mends

    def _if_at_all(self, number):
        """That a case of which the bound is made finer may be left out, where that mends as well."""
        line, code, mends = self.written.changes[number][1:]
        others = enumerate(self.written.changes) if mends.endswith("will do") else ()
        plans = [
            ("code", k) for k, (_, at, text, words) in others if at == line and NO_CASE.search(words) and code in text
        ]
        return ", if this case is needed at all" if plans and self.mending(plans) else ""

    def _whatever_words(self, line, code, mends):
        """That a comparison does not belong there, where a change mends only because it comes out alike for all: `==`
        or `!=`, since no two numbers are alike, or another sign on one of its sides.
        """
        turned, code = mends.endswith(TURNED), _bare(code)
        if not mends.endswith(UNEQUAL) and not turned:
            return None
        places = ((k, text) for k, (at, text, *_) in enumerate(self.written.places) if at == line)
        alike = [k for k, text in places if text == code or turned and BOUND.search(text) and code in text]
        truths = (k for k in alike if k in self.written.of_truth)
        return self._turned_words(("value", k, change, None) for k in truths for change in rerun.ALWAYS_THE_SAME)

    def _settled_words(self, line, mends):
        """A condition further down that a change settles, or a bound: where it mends as well that it always or never
        holds, or is 0 or 1, nothing is known of what it compares.
        """
        if mends.endswith(("never happen", "always happen")):
            return None
        places, truths = self.written.places, sorted(self.written.of_truth)
        behind = [k for k in truths if places[k][0] > line and not self._is_fixed_truth(k)]
        behind += [k for k, (at, text, *_) in enumerate(places) if at > line and BOUNDING.match(text)]
        return self._turned_words(("value", k, change, None) for k in behind for change in rerun.ALWAYS_THE_SAME)

    def _is_fixed_truth(self, k):
        """Whether a condition comes out alike wherever it is met."""
        met = [values[k][1] for values in self.values if values[k][0]]
        return len({bool(truth) for value in met for truth in np.ravel(value)}) < 2

    def _weight_words(self, line, code, mends):
        """What a line binds, or a bound keeps, where a change of it mends only because that is 1 everywhere then, or as
        good as 1: with another sign what a bound keeps above 0 is that bound everywhere.
        """
        if not mends.endswith((LEAVE_OUT, "is to be left out", TURNED, OTHER_SIGN)):
            return None
        for k, (at, *_) in enumerate(self.written.places):
            if at != line or not (self._binds(k) or self._bounds(k, code)) or not all(v[k][0] for v in self.values):
                continue
            drawn = [values[k][1] for values in self.values]
            among = any(np.ptp(value) for value in drawn)
            differ = among or np.ptp([value.flat[0] for value in drawn]) > 0
            if differ and self.mending([("value", k, rerun.ALWAYS_THE_SAME[1], None)]):
                one = "True" if k in self.written.of_truth else "1"
                one = f"{one} everywhere" if among else one
                there = "on the right side" if self._binds(k) else "in its place"
                return f"{self._where(k)}: with {one} {there}, {RIGHT}, so perhaps it is not needed."
        return None

    def _may_be_said(self, mends):
        """Whether a change is about something that the function has to do with: degrees are of angles alone, and how
        large a number is matters little where one of several is chosen.
        """
        if self.chosen and SCALED.match(mends) or self.exactly and CURVED.match(mends):
            return False
        if self.exactly and LIFTED.search(mends) or self.worded and RESCALED.search(mends):
            return False
        return self.turns or not mends.endswith(("radians", "degrees"))

    def _moves_a_bound(self, line, code, mends):
        """Whether a change only turns what is compared with a number: another number would do as well. Nor is a number
        with decimals what something computed is to be equal to.
        """
        if mends.endswith(UNEQUAL):
            return bool(DECIMALS.search(code))
        bare = _bare(code)
        compared = (text for at, text, *_ in self.written.places if at == line and bare in text and BOUND.search(text))
        return mends.endswith(("belongs there", "belongs there in degrees")) and any(compared)

    def _left_out_instead(self, number):
        """What says more than a change that mends only because it makes a part do nothing: that a case is never to be
        met, or always, where what it asks, in its line or before it, is changed otherwise than to a finer bound, or the
        sign of what it does; that a part should be left out, where it has another sign, name or order or is made finer,
        or the larger one it stands in; that nothing is to be bounded, where another bound is set.
        """
        changes = self.written.changes
        line, code, mends = changes[number][1:]
        at_line = [(k, text, words) for k, (_, at, text, words) in enumerate(changes) if at == line]
        finer = mends.endswith("will do")
        larger = [(k, words) for k, text, words in at_line if _bare(code) in _bare(text) != _bare(code)]
        behind = line - 1 if mends == OTHER_SIGN else line  # the case in which a sign is changed stands before it
        around = larger + [(k, words) for k, (_, at, _, words) in enumerate(changes) if line != at >= behind]
        fixed = [(k, words) for k, (_, at, _, words) in enumerate(changes) if at >= line and _is_fixed(code)]
        case = [k for k, words in around if words.endswith(("never happen", "always happen")) and not finer]
        case += [k for k, words in fixed + larger if words in UNBOUNDED]
        less = [k for k, text, words in at_line if text == code and LEAVE_OUT in words]
        less += [k for k, words in larger if LEAVE_OUT in words and not finer]
        less += [k for k, text, words in at_line if words.startswith(mutation.STACKED) and _bare(code) in _bare(text)]
        replaced = finer or " stands where " in mends or mends.endswith(" exchanged")
        plan = self.mending([("code", k) for k in case + (less if replaced else [])])
        return number if plan is None else plan[1]

    # Values on the way turned into others

    def value_words(self):
        """Those that are the result itself come first: a slow function leaves no time for all the others."""
        places = range(len(self.written.places))
        ends = {k for k in places if self._ends(k)}
        words = self._copied_words()
        words = words or self._turned_words(self._with_own(ends)) or self._turned_words(self._turned(ends))
        others = set(places) - ends
        words = words or self._turned_words(self._turned(others)) or self._turned_words(self._with_own(others))
        return words or self._argument_words()

    def _ends(self, k):
        """Whether a value is the result on all draws on which that place is reached, the first among them."""
        reached = [(v[k][1][-1], r) for v, r in zip(self.values, self.results) if v[k][0]]
        return bool(self.values[0][k][0]) and all(r is not None and _same(value, r) for value, r in reached)

    def _copied_words(self):
        """That of an array which a line fills or adds to a copy is to be handed on: else that line changes what was."""
        drawn, places = range(len(self.values)), self.written.places
        arrays = [k for k in range(len(places)) if any(np.ndim(self.values[i][k][1]) > 1 for i in drawn)]
        if not any(FILLED.match(places[k][1]) for k in arrays):
            return None
        plan = self.mending([("copy", k) for k in arrays if HANDED_ON.match(places[k][1])])
        words = "a copy belongs there, as the array itself is changed later on."
        return plan and f"{self._where(plan[1])}: {words} {self._alone()}"

    def _turned_words(self, plans):
        plan = self.mending(list(plans))
        if plan is None:
            return None
        kind, k, change, other = plan
        if rerun.OTHERWISE[change][0] == rerun.NOUGHT and self._is_given(k):
            nought = "zeros" if self._is_array(k) else "0"
            there = "on the right side" if self._binds(k) else "in its place"
            return f"{self._where(k)}: with {nought} {there}, {RIGHT}. {NOT_NEEDED}"
        name = "" if other is None else self._bound(other) if kind == "own" else self._given_name(k, other)
        words = rerun.OTHERWISE[change][0]
        words = (rerun.OF_SEVERAL.get(words, words) if self._is_bare_listing(k) else words).format(name)
        words = rerun.OF_TRUTHS.get(words, words) if k in self.written.of_truth else words
        words = rerun.OF_ARRAYS.get(words, words) if self._is_array(k) else words
        words = words.replace("belongs in its place", "belongs on the right side") if self._binds(k) else words
        return f"{self._where(k)}: {_closed(words)} {self._alone()}"

    def _is_array(self, k):
        """Whether a place holds arrays: the values noted there come one below the other, a row for every round."""
        return any(values[k][1].ndim > 1 for values in self.values)

    def _bound(self, k):
        """A variable by its name; `_`, which may be bound anew in every line, with its line."""
        line, _, name, *_ = self.written.places[k]
        return f"`{name}` of line {line}" if name == "_" else f"`{name}`"

    def _given_name(self, k, argument):
        """An argument by its name, which stands for another value where it has been bound anew before."""
        name = self.names[argument]
        anew = (code for _, code, bound, *_ in self.written.places[:k] if bound == name and code != name)
        return f"`{name}` as it was given" if any(anew) else f"`{name}`"

    def _argument_words(self):
        """What is to be done with an argument before the first line, as it is read in several places."""
        plans = []
        for i in range(len(self.names)):
            values = [rerun.numeric(case.args[i]) for case in self.cases]
            if all(value is not None for value in values):
                for change, (words, function) in enumerate(rerun.OTHERWISE[: rerun.ALONE]):
                    told = self._may_be_said(words) and not self._is_asked_for(function)
                    if told and _changes(function, values[0], []):
                        plans.append(("argument", i, change))
        plan = self.mending(plans)
        if plan is None:
            return None
        name, words = self.names[plan[1]], rerun.OTHERWISE[plan[2]][0]
        if words in rerun.CONSTANTS:
            constant = rerun.CONSTANTS[words][np.ndim(rerun.numeric(self.cases[0].args[plan[1]])) > 0]
            same = f"the right one is the same whatever `{name}` is"
            return f"with {constant} in the place of `{name}` wherever you read it, {RIGHT}: {same}."
        return f"wherever you read `{name}`: {_closed(words)} {self._alone()}"

    def _where(self, k):
        return f"in line {self.written.places[k][0]}, `{self._meant(k)}`{self._of_several(k)}"

    def _meant(self, k):
        """The code of a place; of a step that binds several names, as w, V = ..., the name that is meant."""
        _, code, name, *_ = self.written.places[k]
        return name if name and re.match(r"[\w*, ]*,[\w*, ]*=[^=]", code) else code

    def _of_several(self, k):
        """In which larger part a value stands, if the line has the same code several times."""
        line, code, *_ = self.written.places[k]
        alike = [place for place in self.written.places if place[:2] == (line, code)]
        around = (text for at, text, _, _, first in self.written.places[k + 1 :] if at == line and first <= k)
        outer = next((text for text in around if text != code), None)
        return f" in `{outer}`" if len(alike) > 1 and outer else ""

    def _turned(self, among):
        """Plans of values at these places turned into others, the likeliest first; none that change nothing."""
        numeric = [i for i in range(len(self.names)) if all(is_numeric(case.args[i]) for case in self.cases)]
        first = self.values[0]
        reached = (k for k in self._entries_first(among) if first[k][0] and not self._is_filled(k))
        reached = (k for k in reached if not self._is_start(k))
        seen = [(k, first[k][1][0], self._is_bounded(k), self._is_bare_listing(k)) for k in reached]
        for change, (words, function) in enumerate(rerun.OTHERWISE):
            if not self._may_be_said(words) or change < rerun.ALONE and self._is_asked_for(function):
                continue
            for argument in [None] if change < rerun.ALONE else numeric:
                others = [] if argument is None else [np.asarray(self.cases[0].args[argument], dtype=float)]
                for k, value, bounded, bare in seen:
                    counted = SCALED.match(words) and COUNT.search(self.written.places[k][1])
                    if counted or bounded and words != rerun.SIGNLESS or bare and words not in rerun.OF_SEVERAL:
                        continue
                    if SUMMED.search(words) and _is_fixed(self.written.places[k][1].rpartition(" = ")[2]):
                        continue  # nobody sums up what is typed in, or turns it around
                    if words in rerun.WEIGHTS and value.ndim and self._is_weighed(k):
                        continue
                    if words == rerun.ONE and value.ndim and self._is_given(k):
                        continue  # whoever is handed an array does not mean ones
                    if _changes(function, value, others) and not self._is_all_of_it(k, function, value, others):
                        yield "value", k, change, argument

    def _is_bare_listing(self, k):
        """Whether several values stand there between commas alone: what is typed behind is done to the last one."""
        _, code, name, *_ = self.written.places[k]
        opened = itertools.accumulate((c in "([{") - (c in ")]}") for c in code)  # it may be quoted in part
        return not name and any(c == "," and not depth for c, depth in zip(code, opened))

    def _entries_first(self, among):
        """These places in their order, but what is taken apart at once, as `x` in `x[2]`, behind all others."""
        places = self.written.places

        whole = (text.split(" = ", 1)[-1].startswith(f"{places[first][1]}[") for _, text, _, _, first in places)
        apart = {place[-1] for place, taken in zip(places, whole) if taken}
        return sorted(among, key=lambda k: (k in apart, k))

    def _is_asked_for(self, function):
        """Whether it makes the right result of an argument on all draws: "wrapped" tells nobody how to wrap."""
        rights = [rerun.numeric(case.expected) for case in self.cases]
        for i in range(len(self.names)):
            values = [rerun.numeric(case.args[i]) for case in self.cases]
            if any(value is None for value in (*values, *rights)):
                continue
            made = (_turned_value(function, value, []) for value in values)
            if all(new is not None and _same(new, right) for new, right in zip(made, rights)):
                return True
        return False

    def _is_all_of_it(self, k, function, value, others):
        """Whether a value on the way becomes the right result: "its inverse" tells nobody how to write `invert`."""
        expected = rerun.numeric(self.cases[0].expected)
        new = _turned_value(function, value, others)
        return not self._ends(k) and expected is not None and new is not None and _same(new, expected)

    def _with_own(self, among):
        """Plans of values at these places put together with a variable that was bound before."""
        places, values = self.written.places, self.values[0]
        bound = [k for k, (_, code, name, *_) in enumerate(places) if name and code != name and values[k][0]]
        bare = {k for k in among if self._is_bare_listing(k)}
        for change in range(rerun.ALONE, rerun.ALONE + rerun.WITH_OWN):
            for variable in bound:
                for k in sorted(k for k in among if k > variable):
                    if not values[k][0] or self._is_bounded(k):
                        continue
                    if k in bare and rerun.OTHERWISE[change][0] not in rerun.OF_SEVERAL:
                        continue
                    if _changes(rerun.OTHERWISE[change][1], values[k][1][0], [values[variable][1][-1]]):
                        yield "own", k, change, variable

    # Changes that mend a part, or leave a simple difference

    @_or_nothing
    def partly_words(self):
        """A change of the code that leaves a simple difference, or makes a part of the result right on all draws."""
        worth = (k for k, (rank, *_) in enumerate(self.written.changes) if 0 <= rank < WORTH)
        plans = [
            ("code", k) for k in worth if self.written.changes[k][-1] != mutation.ONE_ROUND
        ]  # of all it is no part
        best, right = None, [case.parts_before() for case in self.cases]
        if None in right:
            return None
        for plan, better in self._tried(plans, lambda batch, time: self._gains(batch, right[0], time)):
            if better and (words := self._partly(plan, right)) and (best is None or better > best[0]):
                best = better, plan, words
        if best is None:
            return None
        _, line, code, mends = self.written.changes[best[1][1]]
        return f"in line {line}, `{code}`: perhaps {mends}. With this changed, {best[2]}"  # it need not be the mistake

    @_or_nothing
    def nearer_words(self):
        """That more rounds of a loop, or a longer step, bring the result nearer on all draws, yet not near enough."""
        for k, (_, line, code, mends) in enumerate(self.written.changes):
            found, words = next(
                ((f, words) for known, words in NEARER.items() if (f := known.match(mends))), (None, "")
            )
            if found is None or any(case.result is None for case in self.cases):
                continue
            fits = (
                self.written.results(
                    [("code", k)], case.args, self.budget.left(), functools.partial(_comes_nearer, case)
                )
                for case in self.cases
            )
            if all(fit == [True] for fit in fits):
                return f"in line {line}, `{code}`: {words.format(found[1], COMES_NEARER)}"
        return None

    def _gains(self, plans, right, budget):
        """How much better each plan makes the result of the first draw."""
        case = self.cases[0]
        return self.written.results(plans, case.args, budget.left(), lambda found: case.gain(found, right))

    def _partly(self, plan, right):
        """What comes right on all draws by a change that does not make all right, in words."""
        found = []
        for case in self.cases:
            kept = self.written.results([plan], case.args, self.budget.left(), case.admit)
            if kept and kept[0] is not None:
                found.append(kept[0])
        if len(found) < len(self.cases):
            return None
        words = _difference_words(self.cases, found)
        is_new = words not in (None, _difference_words(self.cases, [case.result for case in self.cases]))
        if is_new and not self._are_given(found):
            return words
        parts = [case.right_parts(result) for case, result in zip(self.cases, found)]
        if any(not set(before) <= set(after) for before, after in zip(right, parts)):
            return None
        if any(case.is_farther(result) for case, result in zip(self.cases, found)):
            return None
        before = (set(were) for case, were in zip(self.cases, right) if not case.was_right)
        come = set.intersection(*map(set, parts)).difference(*before)
        come = [part for part in parts[0] if part in come]
        if not come or len(come) > 4:
            return None
        if all(case.keep((result,)) for case, result in zip(self.cases, found)):  # it is none that mends others as well
            return "your result comes out right on the draws tried so far, though perhaps not on all"
        return f"{' and '.join(come)} {'come' if len(come) > 1 else 'comes'} out right, though not all"

    def _are_given(self, results):
        """Whether results are but one of the arguments."""
        drawn = [(rerun.numeric(result), case.args) for result, case in zip(results, self.cases)]
        columns = [[(r, rerun.numeric(args[i])) for r, args in drawn] for i in range(len(self.names))]
        return any(all(r is not None and a is not None and _same(r, a) for r, a in column) for column in columns)

    # Values of the solution

    @_or_nothing
    def given_words(self, solution):
        """The smallest part whose value, taken from the solution, mends the result; and how the two differ."""
        if solution is None:
            return None
        given = [("given", k, q) for k, q in self._given(solution)]
        plan = self.mending(given, solution.values)
        if plan is not None:  # what is read there may be wrong since a line that binds something
            before = [p for p in given if p[1] < plan[1] and self._binds(p[1])]
            plan = self.mending(sorted(before, key=lambda p: p[1]), solution.values) or plan
        return plan and self._compared(*plan[1:], solution)

    def _given(self, solution):
        """(place, place of the solution) of like values that differ where the result is wrong, the smallest first."""
        places = self.written.places
        filled = {places[k][2] for k in range(len(places)) if self._is_filled(k)}
        for k in sorted(range(len(places)), key=lambda k: places[k][3]):
            if (
                places[k][2] in filled
                and places[k][1] != places[k][2]
                or self._is_filled(k)
                or self._is_known(k, solution)
                and not self._is_entry_bound(k)
                or self._are_rows(k)
                or self._is_unfilled(k)
                or self._is_rearranged(k)
            ):
                continue
            for q in solution.distinct:
                pairs = [(mine[k], theirs[q]) for mine, theirs in zip(self.values, solution.values)]
                if self._could_be(pairs) and not (solution.is_result[q] and (self.chosen or self._is_no_step(k))):
                    yield k, q

    @_or_nothing
    def notebook_words(self, solution):
        """What belongs in the place of the notebook's data, which are the same whatever is given: looked at first."""
        made = self._of_notebook()
        if not made:
            return None
        put = [("value", k, way, None) for k in sorted(made & self.written.of_truth) for way in rerun.ALWAYS_THE_SAME]
        put += (plan for plan in (*self._turned(made), *self._with_own(made)) if plan[2] == rerun.IN_ITS_PLACE)
        words = self._turned_words(put) or self._left_out_words()
        if words or solution is None:
            return words
        plan = self.mending([("given", k, q) for k, q in self._given(solution) if k in made], solution.values)
        return plan and self._compared(*plan[1:], solution)

    def _of_notebook(self):
        """Places where data of the notebook are read, or taken in by something larger."""
        read = self.written.of_notebook
        return {k for k, (_, code, *_) in enumerate(self.written.places) if read & set(NAMES.findall(code))}

    def _left_out_words(self):
        """That a part of the code which reads the notebook's data should be left out, where all is right without it."""
        read, changes = self.written.of_notebook, self.written.changes
        parts = (k for k, (*_, mends) in enumerate(changes) if LEAVE_OUT in mends)
        plan = self.mending([("code", k) for k in parts if read & set(NAMES.findall(changes[k][2]))])
        return plan and "in line {1}, `{2}`: {3}. {told}".format(*changes[plan[1]], told=self._alone())

    def _is_no_step(self, k):
        """Whether the right result in a value's place says nothing: in the result's, and where an iteration goes on or
        a search begins.
        """
        return self.is_result(k) or self.written.places[k][0] in self.written.iterated | self.written.searched

    def _is_start(self, k):
        """Whether a value is one number throughout where a search begins, from another one of which it may arrive."""
        if self.written.places[k][0] not in self.written.searched:
            return False
        drawn = [values[k][1].ravel() for values in self.values if values[k][0]]
        return not np.ptp(np.concatenate(drawn))

    def _is_weighed(self, k):
        """Whether a value is taken as a whole by a call: ones, or I, in its place would be no weights."""
        outer = next((text for _, text, _, _, first in self.written.places[k + 1 :] if first <= k), "")
        return bool(re.fullmatch(r"(\w+ = )?[\w.]+\(" + re.escape(self.written.places[k][1]) + r"\)", outer))

    def _is_rearranged(self, k):
        """Whether a value holds the numbers of the result in another shape: that they are wrong says nothing."""
        pairs = [(values[k][1], result) for values, result in zip(self.values, self.results) if values[k][0]]
        return bool(pairs) and all(
            r is not None and v[-1].shape != r.shape and _same(v[-1].ravel(), r.ravel()) for v, r in pairs
        )

    def _are_rows(self, k):
        """Whether a value is, round by round, the rows of the result."""
        return all(r is not None and v[k][0] > 1 and _same(v[k][1], r) for v, r in zip(self.values, self.results))

    def _is_unfilled(self, k):
        """Whether an array of one number everywhere is made there: to be filled, and it is not what is wrong."""
        _, code, _, *_ = self.written.places[k]
        made = (values[k][1] for values in self.values)
        return _is_fixed(code.rpartition(" = ")[2]) and all(m.ndim > 1 and not np.ptp(m) for m in made)

    def _binds(self, k):
        """Whether a value is bound to one name there."""
        _, code, name, *_ = self.written.places[k]
        return bool(name) and code.startswith(f"{name} =")

    def _bounds(self, k, code):
        """Whether this part of the code is kept within a bound there."""
        return bool(BOUNDING.match(self.written.places[k][1])) and _bare(code) in self.written.places[k][1]

    def _could_be(self, pairs):
        """Whether values of the solution can take the place of the student's, and are others where that is wrong."""
        wrong = [not case.was_right for case in self.cases]
        return all(_exchangeable(a, b) if off else _fits(a, b) for (a, b), off in zip(pairs, wrong))

    def _is_entry_bound(self, k):
        """Whether a name is bound to one entry of an argument there: that is right of itself, and may be another value
        than the one that is meant.
        """
        _, code, name, *_ = self.written.places[k]
        return bool(name) and _bound(code, name) in self.names

    def _is_filled(self, k):
        """Whether only a part of this array is assigned there: its other parts are not what the line is about."""
        _, code, name, *_ = self.written.places[k]
        return bool(name) and code.startswith(f"{name}[")

    def _is_bounded(self, k):
        """Whether a number bounds a value, so that half of it would do as well: only its sign can be wrong."""
        return any(BOUND.search(code) for _, code, _, _, first in self.written.places[k + 1 :] if first <= k)

    def _is_known(self, k, solution, given=True):
        """Whether a value on the way is one that the solution has as well, or an argument: then it is right."""
        if not all(values[k][0] for values in self.values):
            return given
        known = ([values[q][1] for values in solution.values] for q in solution.distinct)
        return any(self._is_value(k, theirs) for theirs in known) or given and self._is_given(k)

    def _is_given(self, k):
        """Whether a value on the way is an argument."""
        given = ([rerun.numeric(case.args[i]) for case in self.cases] for i in range(len(self.names)))
        return any(all(g is not None for g in arg) and self._is_value(k, [g[None] for g in arg]) for arg in given)

    def _is_value(self, k, theirs, same=None):
        """Whether a value on the way is another one on every draw, round by round; or one of rounds, row by row."""
        mine, same = [values[k] for values in self.values], same or _same
        return all(
            count and (same(m, t) or len(t) == 1 and same(m, _as_kept(t[0], count)))
            for (count, m), t in zip(mine, theirs)
        )

    def _is_returned(self, k):
        """Whether a value is what comes out on every draw on which that is of a kind to be compared."""
        seen = [(v[k][1], r) for v, r in zip(self.values, self.results) if r is not None and v[k][0]]
        return bool(seen) and all(_same(values[-1], r) for values, r in seen)

    def is_result(self, k):
        return all(r is not None and _same(v[k][1][-1], r) for v, r in zip(self.values, self.results))

    def _compared(self, k, q, solution):
        mine = [values[k][1] for values in self.values]
        rounds = [_in_rounds(values[k], v[q])[1] for values, v in zip(self.values, solution.values)]
        theirs = [np.broadcast_to(t, m.shape) for t, m in zip(rounds, mine)]
        words = value_relation(mine, theirs, [dict(zip(self.names, case.args)) for case in self.cases])
        words = words or f"this value is not right{self._of_parts(k, solution)}"
        end = "" if words[-1] in ".?" else "."
        return f"{self._where(k)}: {words}{end} With the right value there, what follows is right on every draw tried"

    # Right or spoilt on the way

    @_or_nothing
    def passed_words(self, solution, operands=False):
        """A value on the way that is the right result already, though it is not what is returned; of the operands of
        larger parts only where these are asked for: that (I - K H) P is right does not say what is wrong with
        (I - K H) P (I - K H).T - K R K.T.
        """
        results = [q for q in solution.distinct if solution.is_result[q]] if solution else []
        for k in range(len(self.written.places)):
            if self._is_returned(k) or self._is_operand(k) and not operands:
                continue  # the same but for rounding, and not right on every draw
            q = next((q for q in results if self._is_value(k, [values[q][1] for values in solution.values])), None)
            if q is not None:
                mine, theirs = (
                    any(values[i][0] > 1 for values in v) for i, v in ((k, self.values), (q, solution.values))
                )
                each = (self._in_which_round(k) if theirs else ", a part of it each time") if mine else ""
                others = " on some draws" if any(case.was_right for case in self.cases) else ""
                return f"{self._where(k)}, the result is right{each}, but something else is returned{others}"
        return None

    def _is_operand(self, k):
        """Whether a value is one side of a sum, a product or the like in its line."""
        line, code, *_ = self.written.places[k]
        larger = (text for at, text, _, _, first in self.written.places[k + 1 :] if at == line and first <= k)
        around = next(larger, "").rpartition(" = ")[2]
        try:
            part, value = (ast.parse(text, mode="eval").body for text in (around, code))
        except SyntaxError:  # quoted in part, or a step
            return False
        sides = (part.left, part.right) if isinstance(part, ast.BinOp) else ()
        return any(ast.unparse(side) == ast.unparse(value) for side in sides)

    def _in_which_round(self, k):
        """In which round a value is the right result: it need not be the last, of which there may be more than kept."""
        last = (self._fitting([("last", k)], i, self.budget, None) for i in range(len(self.cases)))
        return ", in the last round" if all(fit == [True] for fit in last) else ", in some round"

    @_or_nothing
    def not_finite_words(self):
        """The first value on the way that is not finite, where a result holds NaN or is infinite."""
        for case, values in zip(self.cases, self.values):
            result = rerun.numeric(case.refused)
            if result is None or np.isfinite(result).all() or _are_spoilt(case.args):
                continue  # what was given is not what went wrong
            rounds = [(int(_spoilt(v).argmax()), k) for k, (n, v) in enumerate(values) if n and _spoilt(v).any()]
            made = [(at, k) for at, k in rounds if self._is_made_of_finite(k, at, values)]
            line, code, *_ = self.written.places[min(made or rounds)[1]]
            return f"the first value on the way that is not finite is `{code}` in line {line}"
        return None

    def _is_made_of_finite(self, k, at, values):
        """Whether what goes into a value that is not finite, in a round, is finite, so that it arises there."""
        _, code, name, _, first = self.written.places[k]
        parts = [values[p] for p in range(first, k)]
        return code != name and not any(n == values[k][0] and _spoilt(v)[at] for n, v in parts)

    def _is_step(self, k):
        """Whether a value is computed there: no argument, no name that is read, no constant."""
        line, code, name, *_ = self.written.places[k]
        if code == name or not all(values[k][0] for values in self.values):
            return False
        mine = [values[k][1] for values in self.values]
        if all(np.isin(m, (0.0, 1.0)).all() for m in mine):  # a condition
            return False
        if self._is_count(k) or not name and _is_listing(code):
            return False  # or several values that are steps of their own
        return any(not _same(mine[0][0], other[0]) for other in mine[1:]) and not self._is_given(k)

    def _may_be_wrong(self, k, solution):
        """Whether a value is but read there, by the name it was given in another line, and is none that is right."""
        name = self.written.places[k][1]
        given = name in self.names and self._is_given(k)  # an argument may have been bound anew
        settled = given or name not in self._variables or self._is_count(k)
        return name.isidentifier() and not settled and not self._is_known(k, solution, False)

    @functools.cached_property
    def _variables(self):
        """Names of what the function is given, and of what it binds."""
        return {*self.names, *(name for _, code, name, *_ in self.written.places if name not in ("", code))}

    def _is_count(self, k):
        """Whether a value is one whole number on every draw."""
        mine = [values[k][1] for values in self.values if values[k][0]]
        return bool(mine) and all(m.shape == (1,) and (m == np.round(m)).all() for m in mine)

    def _of_parts(self, k, solution):
        """Whether the parts of a wrong value are right, so that it is what is done with them; or may be wrong."""
        parts, part = [], k - 1
        while part >= self.written.places[k][4]:
            parts.insert(0, part)
            part = self.written.places[part][4] - 1
        parts = [part for part in parts if all(values[part][0] for values in self.values)]
        right = all(self._is_known(part, solution) for part in parts)
        computed = (part for part in parts if right and not self._is_given(part))  # another argument may be meant
        codes = dict.fromkeys(f"`{self.written.places[part][1]}`" for part in computed)
        if not codes:
            doubtful = (p for p in range(self.written.places[k][4], k) if self._may_be_wrong(p, solution))
            names = [f"`{name}`" for name in dict.fromkeys(self.written.places[p][1] for p in doubtful)]
            return f", perhaps because of {joined(names, 'or')} in it" if names else ""
        are, them = ("are values", "them") if len(codes) > 1 else ("is a value", "it")
        return f", though {joined(codes)} in it {are} of the solution as well: look at what is done with {them}"


@_or_nothing
def search(function, names, cases, judging, budget):
    """A `Search` for what is wrong in a function; None where its code cannot be read again."""
    written = rerun.written(function)
    return written and Search(written, names, cases, judging, budget)


def _difference_words(cases, results):
    """What admitted results have to do with the right ones of their draws, in words; None where one was refused."""
    if any(result is None for result in results):
        return None
    pairs = [(result, case.expected) for result, case in zip(results, cases)]
    return relations.difference_words(cases[0].metric, pairs, (), True)


def _comes_nearer(case, found):
    """Whether what a changed function gave, in a tuple, is nearer to what is expected than the student's result."""
    result = None if found is None else case.admit(found)
    return result is not None and case.is_nearer(result)


def _are_spoilt(args):
    """Whether an argument holds what is not finite."""
    return any(a is not None and not np.isfinite(a).all() for a in map(rerun.numeric, args))


def _traces(written, cases, budget):
    """The values on the way of every draw; a function that is too slow for that is not run again and again."""
    kind, found = budget.part(), []
    for case in cases:
        if not kind.left():
            raise TimeoutError
        found.append(written.trace(case.args, kind.left()))
    return found


def _closed(words):
    """Words with a full stop, but behind a question."""
    return words if words.endswith("?") else f"{words}."


def _bare(code):
    """A part of the code without the larger one in which it is quoted."""
    return code.partition(rerun.WITHIN)[0]


def _bound(code, name):
    """The name of what a step binds one entry of to a name, by a whole number; None where it binds anything else."""
    try:
        step = ast.parse(code).body[0]
    except SyntaxError:  # quoted in part
        return None
    if not isinstance(step, ast.Assign):
        return None
    target, value = step.targets[0], step.value
    pairs = (
        zip(target.elts, value.elts)
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
        else [(target, value)]
    )
    for to, of in pairs:
        if (
            getattr(to, "id", None) == name
            and isinstance(of, ast.Subscript)
            and isinstance(getattr(of.slice, "value", None), int)
        ):
            return getattr(of.value, "id", None)
    return None


def _spoilt(values):
    """In which rounds a value is not finite."""
    return ~np.isfinite(values).reshape(len(values), -1).all(axis=1)


def _is_fixed(code):
    """Whether a part of the code is made of numbers alone, so that it has one value."""
    try:
        names = {node.id for node in ast.walk(ast.parse(_bare(code), mode="eval")) if isinstance(node, ast.Name)}
    except SyntaxError:  # quoted in part, or a step
        return False
    return names <= mutation.MODULES


def _is_listing(code):
    """Whether code is a tuple or a list of several values."""
    try:
        return isinstance(ast.parse(code, mode="eval").body, ast.Tuple | ast.List)
    except SyntaxError:  # quoted in part
        return False


@_or_nothing
def condition_words(function, draws, missed, budget):
    """Which condition in a student's own code was true, or false, wherever the result is wrong; None where none tells,
    or where this may be chance.

    Parameters
    ----------
    function : function
    draws : list of tuple
        Arguments.
    missed : list of bool
        On which of them the result is wrong.
    budget : Budget
    """
    written = rerun.written(function)
    if written is None:
        return None
    met = [
        {(k, truth): n for k, *seen, n in conditions for truth in (0, 1) if seen[truth]}
        for conditions in written.truths(draws, budget.left())
    ]
    if len(met) < len(draws):
        return None
    best = None
    for place in sorted(set().union(*met)):
        without = [i for i, found in enumerate(met) if place not in found]
        if any(missed[i] for i in without) or _may_be_chance(len(draws), sum(missed), len(without)):
            continue
        if len(without) < len(draws) - sum(missed) and any(found.get(place, 0) > 1 for found in met):
            continue  # in some round of many: what else went on in that run may matter as well
        if best is None or len(without) > best[0]:
            best = len(without), place
    if best is None:
        return None
    _, (k, truth) = best
    line, code, *_ = written.places[k]
    once = all(found.get((k, truth), 0) < 2 for found in met)
    where = f"`{code}` (line {line}) was {'false' if truth else 'true'}{'' if once else ' in some round'}"
    only = "exactly" if best[0] == len(draws) - sum(missed) else "only"
    return f"{only} where {where}: perhaps by what happens then, perhaps by the condition"


def _may_be_chance(draws, missed, without):
    """Whether so many draws might be right by chance, more often than once in some thousand cases."""
    return not without or math.comb(draws, without) < CHANCE * math.comb(draws - missed, without)


def value_relation(mine, theirs, named):
    """How values on the way differ from those that are right, in words; None where nothing is found."""
    rounds = max(m.ndim if len(m) > 1 else 0 for m in mine)  # the first axis counts them, then, and no rows
    mine = [m[0] if len(m) == 1 else m for m in mine]
    theirs = [t[0] if len(t) == 1 else t for t in theirs]
    exact = metrics.Numbers(1e-9)
    words = relations.difference_words(exact, list(zip(mine, theirs)), (), True)
    words = words or operands.operand_words(exact, mine, theirs, named)
    words = words or relations.difference_words(exact, list(zip(mine, theirs)), ())
    words = words and words.removesuffix(relations.LOOP)
    if words and rounds:
        words = (ONE_ENTRY if rounds == 1 else ONE_ROW).sub("round", words)
        words = words.replace("the first round is right, not all behind it are", FIRST_ROUND)
    return words and relations.of_a_part(words)


class Solution:
    """The values on the way of the chapter's solution on the same draws."""

    def __init__(self, written, cases, budget):
        self.places, self.values = written.places, _traces(written, cases, budget)
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


def _in_rounds(mine, theirs):
    """(count, values) of the solution, row by row where the student's loop takes one row of it in each round."""
    (count, a), (turns, b) = mine, theirs
    return (count, b[0]) if turns == 1 and count > 1 and b.shape[1:2] == (count,) and b.ndim > a.ndim else theirs


def _as_kept(rows, count):
    """Those rows of the solution's value that a loop goes through while its values are kept."""
    return rows[:count] if rows.ndim and len(rows) > count == rerun.ROUNDS else rows


def _exchangeable(mine, theirs):
    """Whether a value of the solution can take the place of one of the student's, and is another."""
    a, (_, b) = mine[1], _in_rounds(mine, theirs)
    return _fits(mine, theirs) and not _same(a, np.broadcast_to(b, a.shape))


def _fits(mine, theirs):
    """Whether a value of the solution can take the place of one of the student's."""
    (count, a), (turns, b) = mine, _in_rounds(mine, theirs)
    return count > 0 and turns in (1, count) and a.shape[1:] == b.shape[1:]


def _changes(function, value, others):
    new = _turned_value(function, value, others)
    return new is not None and np.isfinite(new).all() and not _same(new, value)


def _turned_value(function, value, others):
    """A value turned into another; None where it cannot be."""
    try:
        with np.errstate(all="ignore"):
            return np.asarray(function(value.copy(), *others), dtype=float)
    except Exception:  # not of a value like this
        return None


@_or_nothing
def of_solution(exercise, cases, budget):
    """The solution's values on the way; None where it is not at hand."""
    found = slips.solved(exercise)
    if found is None:
        return None
    function, tree = found
    return Solution(rerun.Written(function, tree), cases, budget)
