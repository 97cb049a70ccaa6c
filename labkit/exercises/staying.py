"""What stays from one call of an answer to the next: a list that grows, an array that is returned again."""

import copy
import functools
import itertools

import numpy as np

from . import budget, guard, scope
from .budget import Budget
from .evidence import Evidence
from .results import Refusal, admitted_by, is_another, numbers_of, same_numbers

REPEATING = 0.02  # seconds of processor time in which an answer that came out right is called again
IN_A_ROW = 8  # times that a draw is called then, of each of ...
TURNS = 12  # of draws in which each argument is exchanged: of one the result may hang little, or not at all
PARTS = 2 * ("that is the same in a part",) + 2 * ("that is nearly the same",)  # the last of them
NEARLY = 1e-5, 1e-7  # by which an argument may differ and be the same when it is rounded
ALIKE = 3  # kinds of results at most, where they are words or truth values
UNFILLED = {"empty", "empty_like"}  # what makes arrays that hold whatever stood there before


class Staying(Evidence):
    """The answer, called again."""

    def _kept(self):
        """What stays from one call of the function to the next, if its results show it: those of the first draw, or of
        all where it reads or binds what may stay.
        """
        if self.exercise.metric is None:
            return None
        draws = range(len(self.inputs) if scope.may_keep(self.function) else len(self.inputs[:1]))
        told = (self._kept_on(draw) for draw in draws if self.budget.left())
        return next((words for words in told if words), None)

    def _kept_on(self, draw):
        before = self.pairs[draw][0]
        first = numbers_of(before)
        admitted = functools.partial(admitted_by, self.metrics[draw], self.pairs[draw][1])
        run = guard.run(self.function, self.inputs[draw], admitted, self.exercise.limit)
        if first is None:
            return self._stays_words(run.error) if is_another(before, run) else None
        if not same_numbers(numbers_of(before), first):
            return (
                "your function returns one and the same array at every call: a later call overwrites what an earlier "
                "one returned. Make the array within the function"
            )
        if run.error is None and same_numbers(numbers_of(run.result), first):
            return None
        return self._stays_words(run.error)

    def _stays_words(self, error):
        return self._left_behind() or self._kept_words(error)

    def _left_behind(self):
        """Where the function keeps what spoils its results, if each of them is right with all of that as at first."""
        if self.exercise.metric is None or not self.defaults.may_fill:
            return None
        kind = Budget(budget.SPECIAL)
        for args, metric, (_, expected) in zip(self.inputs, self.metrics, self.pairs):
            if not kind.left() or not self._is_right_on(self.defaults.fresh, args, metric, expected):
                return None
        return self.defaults.words()

    def _is_right_on(self, function, args, metric, expected):
        """Whether another function succeeds where the student's has not."""
        run = guard.run(function, args, functools.partial(admitted_by, metric, expected), self.exercise.limit)
        came = run.error is None and metric is not None and not isinstance(run.result, Refusal)
        return came and metric.equal(run.result, expected)

    def _kept_words(self, error, calls=2):
        told = "stops with an error" if error is not None else "gives another result"
        often, at = ("twice", "the second time") if calls == 2 else ("several times", "in the end")
        cause = "Does something stay from call to call, a global variable or a default argument that is changed?"
        if names := self.defaults.changed_names:
            cause = f"It leaves {names} changed for the next call: does the result follow from that?"
        if UNFILLED & scope.co_names(self.function):
            cause = f"Is each entry of what `np.empty` makes filled? {cause}"
        told = f"called {often} with the same arguments, your function {told} {at}"
        return f"{told}. {cause} Or is something drawn at random?"

    def repeated(self):
        """What stays from call to call, if an answer that came out right does so no more when it is called again."""
        if self.exercise.metric is None or "rng" in self.exercise.arguments:
            return None
        again = functools.partial(self._again_words, kind=Budget(REPEATING))
        run = guard.run(again, (self.function,), limit=self.exercise.limit + REPEATING, author=self.function)
        return run.result and (self._left_behind() or run.result)

    def _again_words(self, function, kind):
        """`repeated`, in one run of the guard: the calls themselves are quick."""
        calls = [1] * len(self.inputs)
        for k in self._in_another_order():
            metric, (_, expected) = self.metrics[k], self.pairs[k]
            result, error, calls[k] = None, None, calls[k] + 1
            try:
                result = function(*copy.deepcopy(self.inputs[k]))
            except Exception as raised:
                error = raised
            if error is not None or not metric.equal(result, expected):
                return self._kept_words(error, calls[k])
            if not kind.left():
                break  # a slow answer is not called more often than it must
        return None

    def _in_another_order(self):
        """Numbers of the draws from the last to the first, words and truth values that are alike together; then some of
        them many times in a row.
        """
        alike = {}
        for k in reversed([k for k, metric in enumerate(self.metrics) if metric is not None]):
            expected = self.pairs[k][1]
            alike.setdefault(expected if isinstance(expected, str | bool | int) else None, []).append(k)
        often = (numbers[0] for numbers in itertools.islice(alike.values(), ALIKE))
        return [*itertools.chain(*alike.values()), *(k for k in often for _ in range(IN_A_ROW))]

    def remembered(self, rng):
        """Whether a function that has something to keep results in finds them again by a part of the arguments, in
        words; None where it does not.

        Two fresh calls differ in one argument, or in a part of it. That of the first is another draw's and need not go
        with the rest: only the second is judged, which nobody misses who has computed it.
        """
        exercise, kind = self.exercise, Budget(budget.SPECIAL)
        if exercise.metric is None or not self.pairs or not scope.may_keep(self.function):
            return None
        for turn, (k, name) in itertools.product(range(TURNS), enumerate(self._names(self.inputs[0]))):
            args, other = (exercise.cases[(turn + k + more) % len(exercise.cases)](rng) for more in (0, turn % 2))
            if not kind.left() or k >= min(len(args), len(other)) or type(args[k]) is not type(other[k]):
                continue
            parts = turn - TURNS + len(PARTS)
            first = other[k] if parts < 0 else partly_alike(args[k], other[k], parts)
            expected = exercise.reference(*copy.deepcopy(args))
            admitted = functools.partial(admitted_by, exercise.metric, expected)
            before = guard.run(self.function, (*args[:k], first, *args[k + 1 :]), admitted, exercise.limit)
            run = guard.run(self.function, args, admitted, exercise.limit)
            if before.error is not None or run.error is not None or exercise.metric.equal(run.result, expected):
                continue
            as_then = same_numbers(numbers_of(run.result), numbers_of(before.result))
            if as_then or self._is_right_on(self.defaults.fresh, args, exercise.metric, expected):
                told = "returns what it returned then" if as_then else "is no longer right"
                another = f"another `{name}`" + (f" {PARTS[parts]}" if first is not other[k] else "")
                rest = " and all else as before" if len(args) > 1 else ""
                return (
                    f"right at first, but called again with {another}{rest}, your function "
                    f"{told}: is a result kept under a key that leaves a part of the arguments out, or rounds it?"
                    f"{self._about_globals()}"
                )
        return None


def partly_alike(value, other, part):
    """Another value of an argument that is this one in a part: bytes or arrays in their first half (part 0) or second
    (part 1), poses (..., 4, 4) in their rotation (0) or translation (1); or one that is nearly the same (parts 2, 3).
    """
    if part > 1:
        is_float = isinstance(value, float) or isinstance(value, np.ndarray) and value.dtype.kind == "f"
        return value + NEARLY[part - 2] if is_float else other
    if isinstance(value, bytes):
        half = len(value) // 2
        return other[:half] + value[half:] if part else value[:half] + other[half:]
    if not isinstance(value, np.ndarray) or np.shape(value) != np.shape(other) or value.size < 2:
        return other
    if value.shape[-2:] == (4, 4):
        kept = np.arange(4) < 3
    else:
        kept = np.arange(value.size).reshape(value.shape) < value.size // 2
    return np.where(kept == (part == 0), value, other)
