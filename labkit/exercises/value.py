"""A number to find, with its unit."""

import contextlib
import math
from dataclasses import dataclass, field, replace

import numpy as np

from . import budget, guard, metrics, quantities, regions, relations, shapes
from .outcome import CORRECT, NOT_YET, TO_DO, Item, Outcome, is_blank
from .wording import closed

LISTED = 9  # entries of a wrong array of which those that are right are listed
WRITTEN = 8  # characters of a number that may have been rounded before it was typed in
ALL_DIGITS = 1e-6  # of its size, by which two ways to compute a number may differ
NEAR = 0.2  # of the largest entry: farther off, an array is not called near
UNITS = {
    "mm": ("length", 1e-3),
    "cm": ("length", 1e-2),
    "m": ("length", 1.0),
    "rad": ("angle", 1.0),
    "deg": ("angle", np.pi / 180),
}


@dataclass(frozen=True)
class Value(Item):
    """A number to find, with its unit.

    reference: function without arguments that computes it from data and library.
    rtol, atol: how close an answer must be (relative to the value, absolute in `unit`).
    digits:     a right answer may be rounded to so many significant digits, as a notebook prints it.
    mistakes:  functions without arguments that give a wrong value.
    of:        {name: function} of the data it is made of, by which a wrong answer may be known.
    about:     function(answer) -> what follows from an answer that nothing else explains, beside what is asked for, in
               a sentence.
    beside:    (name, metric, function that gives the expected value) of what a function returns behind the number: an
               answer may be both; behind them, where there are such, {words: function} of wrong ones.
    """

    reference: object
    unit: str = ""
    rtol: float = 1e-3
    atol: float = 0.0
    hints: tuple = ()
    mistakes: tuple = ()
    metric: object = None
    digits: int = 3
    of: dict = field(default_factory=dict)
    about: object = None
    beside: tuple = ()

    def measure(self):
        expected = float(self.reference())
        least = max(self.rtol * abs(expected), self.atol) / max(1.0, abs(expected))
        metric = metrics.Numbers(least, self.unit)
        return expected, metrics.First(metric, self.beside) if self.beside else metric

    def judge(self, answer, unit=None, rng=None):
        """Compare a number with the reference, in any unit of the same kind; never raises."""
        if is_blank(answer):
            return Outcome(TO_DO)
        if self.metric is not None:
            return self._judge_with(self.metric, self.reference(), answer)
        expected, metric = self.measure()
        if isinstance(answer, np.ndarray) and answer.size == 1:
            answer = answer.reshape(())
        run = (
            guard.run(lambda: metric.admit(answer, expected), ())  # some things, such as a generator, have no copy
            if unit is None
            else guard.run(lambda: self._converted(answer, unit, expected), ())
        )
        if isinstance(run.error, metrics.Refused | ValueError):
            return Outcome(NOT_YET, _refusal_words(run.error, answer, expected))
        if run.error is not None:
            return Outcome(NOT_YET, f"expected a number{self._in_unit()}, got {metrics._describe(answer)}.")
        return self._compare(metric, run.result, expected)

    def _mistake(self, answer, is_it, near=False):
        """The mistake whose value `is_it` finds in the answer, or else the one which the answer is near enough to; None
        where several may be meant that are told in different words, as where an answer is rounded.
        """
        found, around = [], []
        for k, mistake in enumerate(self.mistakes):
            wrong = mistake.variant()
            if is_it(answer, wrong):
                found.append(k)
                if not near:
                    break
            elif near and mistake.within and abs(answer - wrong) <= mistake.within:
                around.append((abs(answer - wrong), k))
        found = found or [k for _, k in sorted(around)[:1]]
        if len({self.mistakes[k].text for k in found}) != 1:
            return None
        return Outcome(NOT_YET, self.mistakes[found[0]].text, found[0])

    def _converted(self, answer, unit, expected):
        if isinstance(unit, int | float):
            raise ValueError(f"a decimal number is written with a point, {answer}.{unit}, and not {answer},{unit}")
        if unit == self.unit:
            return metrics.Numbers().admit(answer, expected)
        here, there = UNITS.get(self.unit), UNITS.get(unit)
        if here is None or there is None or here[0] != there[0]:
            raise ValueError(f"the answer is wanted in {self.unit or 'no unit'}, got {unit!r}")
        return metrics.Numbers().admit(answer, expected) * there[1] / here[1]

    def _judge_with(self, metric, expected, answer):
        run = guard.run(lambda: metric.admit(answer, expected), ())
        if isinstance(run.error, metrics.Refused):
            return Outcome(NOT_YET, _refusal_words(run.error, answer, expected))
        if run.error is not None:
            text = closed(f"{type(run.error).__name__}: {run.said}")
            return Outcome(NOT_YET, text + _of_shape(answer, expected))
        return self._compare(metric, run.result, expected)

    def _compare(self, metric, answer, expected):
        """Right, or a mistake to its own digits, or what the general layer says; rounded answers need `digits`.

        A mistake is compared by itself, not with the tolerance of right answers: a number near it is not it.
        """
        exact = metrics.Numbers(1e-9)
        is_right = metric.equal(answer, expected)
        near = metric.nearest(expected, answer)
        named = None if exact.equal(answer, expected) else self._mistake(answer, exact.equal)
        if named is None and near is not expected and not is_right:
            named = self._mistake(answer + (expected - near), exact.equal)
        if named:
            return named
        digits = 0 if _is_whole(expected) else relations.significant_digits(answer, near)
        if is_right or digits >= self.digits:
            return Outcome(CORRECT)
        named = self._mistake(
            answer, lambda a, w: relations.significant_digits(a, w) >= max(self.digits, digits + 1), near=True
        )
        if named:
            return named
        if digits > 1:
            least = f"right as far as it goes: at least {self.digits} digits are needed"
            return Outcome(NOT_YET, f"{least}. If it is rounded, hand over the computed value; else compute it finer.")
        words = relations.difference_words(_as_written(metric, answer, expected), [(answer, expected)])
        words = words or self._made_otherwise(answer)
        words = words or self._changed(metric, answer, expected) or relations.ratio_words(answer, expected)
        words = words or self._follows(answer)
        return Outcome(NOT_YET, closed(words) if words else self._which_way(answer, expected))

    def _follows(self, answer):
        """What would follow from the answer, in words; None where the Value does not tell, or nothing can."""
        if self.about is None or not np.isfinite(answer).all():
            return None
        with contextlib.suppress(ValueError, ArithmeticError), np.errstate(all="ignore"):
            return self.about(answer)

    def _changed(self, metric, answer, expected):
        """Which change of the solution's computation gives it."""
        return regions.change_words(self, answer, lambda found: metric.equal(found, expected), budget.LOOKING / 2)

    def _made_otherwise(self, answer):
        """Which other number of the same data it is."""
        if np.ndim(answer) or not self.of:
            return None
        return quantities.quantity_words(float(answer), {name: data() for name, data in self.of.items()})

    def _which_way(self, answer, expected):
        if np.ndim(expected):
            told = _right_entries(answer, expected) or _how_near(answer, expected)
            return f"not this value{self._in_unit()}{told}: the hints lead on."
        if not np.isfinite(answer):
            return f"not this value{self._in_unit()}: the hints lead on."
        if relations.significant_digits(answer, expected) == 1:
            return "right to one digit only. If it is rounded, hand over the computed value; else the hints lead on."
        size = "large" if abs(answer) > abs(expected) else "small"
        if answer * expected < 0:
            return f"not this value{self._in_unit()}, and it should have the other sign: the hints lead on."
        yours = "without its sign yours" if expected < 0 else "yours"
        return f"not this value{self._in_unit()}: {yours} is too {size}. The hints lead on."

    def _in_unit(self):
        return f" in {self.unit}" if self.unit else ""


def _as_written(metric, answer, expected):
    """The metric with no more tolerance than an answer of so many digits needs: two numbers that are made of each other
    agree in all digits, others in some by chance.
    """
    if not isinstance(metric, metrics.Numbers) or np.ndim(answer) or len(f"{abs(float(answer)):.15g}") <= WRITTEN:
        return metric
    size = abs(float(expected))
    return replace(metric, tol=min(metric.tol, ALL_DIGITS * size / max(metric.least, size)), absolute=False)


def _right_entries(answer, expected):
    """Which entries of a wrong array are right, if some are, as a part of a sentence; zeros and ones tell nothing."""
    answer, expected = np.asarray(answer, dtype=float), np.asarray(expected, dtype=float)
    if answer.shape != expected.shape or expected.size > LISTED:
        return ""
    right = np.isclose(answer, expected, rtol=1e-4, atol=0.0)
    told = [[int(i) for i in place] for place in np.argwhere(right & ~np.isin(expected, (0.0, 1.0)))]
    if not told or right.all():
        return ""
    return f", though {', '.join(map(str, told))} (counted from 0) {'are' if len(told) > 1 else 'is'} right"


def _how_near(answer, expected):
    """That every entry of a wrong array is nearly right, as a part of a sentence."""
    answer, expected = np.asarray(answer, dtype=float), np.asarray(expected, dtype=float)
    off = np.abs(answer - expected).max() / np.abs(expected).max(initial=1e-300)
    if not off < NEAR:
        return ""
    return (
        f", though no entry is off by more than {math.ceil(100 * off)} % of the largest (perhaps by an approximation, "
        "a sample, or a small term that is missing)"
    )


def _refusal_words(refusal, answer, expected):
    """Why an answer cannot be compared; of a result behind the first, what it has to do with the right one."""
    if not isinstance(refusal, metrics.RefusedBeside):
        return closed(_for_value(refusal)) + _of_shape(answer, expected)
    words = refusal.known or relations.difference_words(refusal.metric, [refusal.pair], (), True)
    return closed(f"{refusal.lead}: {relations.of_a_part(words)}" if words else str(refusal))


def _of_shape(answer, expected):
    """What an answer of the wrong shape has to do with the expected one, as one more sentence."""
    words = shapes.shape_words([answer], [expected])
    return f" {words[0].upper()}{words[1:].replace('you return', 'you hand over')}." if words else ""


def _is_whole(expected):
    """Whether numbers are counts, which nobody rounds."""
    return bool(np.all(np.asarray(expected) == np.round(expected)))


def _for_value(refusal):
    return str(refusal).replace("it returned None: is a `return` missing?", "got None").replace("it returned", "got")
