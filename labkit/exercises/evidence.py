"""What is known of an answer in one check: the draws so far, what came of them, and fresh ones for explanations."""

import functools

import numpy as np

from . import budget, guard, metrics, scope
from . import steps as own_steps
from .budget import Budget
from .defaults import Defaults
from .outcome import Outcome
from .results import Refusal, admitted_by, are_one, equal_as_written, numbers_of
from .wording import short

SELDOM = 0.2  # of the draws come out right where no case is special, but one comes out by chance
MORE_CASES = 8  # on which an explanation from the first draws is tried once more, at least ...
MOST_CASES = 64  # ... and at most, as far as LOOKING allows: of one in fifty draws a coincidence may hide


class Evidence:
    """The draws so far, what the student's function made of them, what it printed, and the time that is left."""

    def __init__(self, exercise, function):
        self.exercise, self.function, self.defaults = exercise, function, Defaults(function)
        self.pairs, self.inputs, self.metrics, self.words = [], [], [], []
        self.refusal, self.printed, self.spent, self.budget = "", "", 0.0, Budget(budget.LOOKING)
        self.listed = False

    def outcome(self, status, text="", mistake=None):
        return Outcome(status, text, mistake, self.printed, self.listed)

    def _cases(self):
        """(arguments, metric, pair) of the draws that tell: the plain ones, or all where only special ones are off."""
        everything = self._right_on_plain()
        rows = zip(self.inputs, self.metrics, self.pairs, self.words)
        return [row[:3] for row in rows if everything or row[3] is None]

    def _plain_pairs(self):
        return [pair for pair, words in zip(self.pairs, self.words) if words is None]

    def is_wrong(self):
        """Whether a plain draw came out wrong: then special ones have nothing to tell."""
        return bool(self.refusal) or self.exercise.metric is not None and not self._right_on_plain()

    def _right_on_plain(self):
        metric = self.exercise.metric
        return metric is not None and all(metric.equal(*pair) for pair in self._plain_pairs())

    def _right_somewhere(self):
        """Whether some plain draws come out right, and not by chance: then these are what is to be told."""
        metric = self.exercise.metric
        return not self.refusal and not self._is_choice() and any(metric.equal(*pair) for pair in self._plain_pairs())

    def _right_often(self):
        """Whether so many plain draws come out right that what the others have in common says more than a step does."""
        right = [self.exercise.metric.equal(*pair) for pair in self._plain_pairs()] if self._right_somewhere() else []
        return sum(right) > SELDOM * len(right)

    def _is_choice(self):
        """Whether one of several is to be chosen, which a wrong rule may well do by chance."""
        numbers = all(type(expected) is int for _, expected in self.pairs)
        return numbers and isinstance(self.exercise.metric, metrics.Exactly)

    def _is_always_the_same(self):
        """Whether the results are one and the same on all draws, or nothing but zeros, so that many a wrong computation
        would give them.
        """
        metric, pairs = self.exercise.metric, self._plain_pairs()
        if isinstance(metric, metrics.Exactly) or len(pairs) < 2:
            return False
        if self._is_nothing_but_zeros():
            return True
        try:
            if self.refusal:
                return are_one([r.value if isinstance(r, Refusal) else r for r, _ in pairs])
            return all(equal_as_written(metric, result, pairs[0][0]) for result, _ in pairs[1:])
        except Exception:  # results of different draws need not go together
            return False

    def _is_nothing_but_zeros(self):
        """Whether all entries of the results are 0, on several draws."""
        numbers = [numbers_of(result) for result, _ in self._plain_pairs()]
        return len(numbers) > 1 and not any(n is None or n.any() for n in numbers)

    def _holds_no_number(self):
        """Whether some result holds nothing but NaN or infinity, which many a wrong computation gives."""
        results = (numbers_of(result) for result, _ in self._plain_pairs())
        return any(numbers is not None and not np.isfinite(numbers).any() for numbers in results)

    @functools.cached_property
    def _fresh_results(self):
        """(arguments, metric, (result, expected)) of the student's function on fresh plain draws, where it succeeds."""
        found, kind = [], self.budget.part()
        for case in self._fresh:
            if not kind.left():
                break  # a slow answer is not called more often than it must
            if case.metric is self.exercise.metric:
                admitted = functools.partial(admitted_by, case.metric, case.expected)
                run = guard.run(self.function, case.args, admitted, self.exercise.limit)
                if run.error is None:
                    found.append((case.args, case.metric, (run.result, case.expected)))
        return found

    @functools.cached_property
    def _fresh(self):
        """More draws, on which an explanation is tried once more: plain ones, the special ones among the first."""
        found, kind = [], self.budget.part()
        for number in range(MOST_CASES):
            if number >= MORE_CASES + 2 * len(self.exercise.noisy) and not kind.left():
                break
            args, expected, metric = self.exercise.all_again[number]
            found.append(own_steps.Case(args, metric, expected))
        return found

    def _fresh_cases(self, kind):
        """Those for a kind of change; values from the solution are those of certain draws, and go with no others."""
        return () if kind == "given" else self._fresh

    def _judging(self):
        whole = functools.partial(self._has, properties=(self.exercise.whole,))
        return own_steps.Judging(
            self._fresh_cases, functools.partial(self._has, properties=self.exercise.properties), whole
        )

    def _has(self, function, properties):
        """Whether a changed function has properties that are part of the judgment."""
        try:
            return not any(holds(function, np.random.default_rng(0)) for holds in properties)
        except Exception:  # what fails has not got them
            return False

    def _names(self, args):
        """What the arguments are called: as in the student's function if it takes so many, else as in the reference."""
        own = getattr(self.function, "__code__", None)
        names = own.co_varnames[: own.co_argcount] if own else ()
        names = names if len(names) == len(args) else self.exercise.arguments
        return [names[k] if k < len(names) else f"argument {k + 1}" for k in range(len(args))]

    def _call(self, args):
        given = ", ".join(f"{name}={short(arg)}" for name, arg in zip(self._names(args), args))
        return f"{self.exercise.id}({given})"

    def _about_globals(self):
        """A line about data of the notebook that the function reads, which a checked function is not given."""
        filled = self.defaults.changed  # by the function itself: nobody hands that in
        names = ", ".join(f"`{name}`" for name in scope.notebook_data(self.function) if name not in filled)
        if not names:
            return ""
        return f"\nYour function reads {names} from the notebook: what it computes with should come in as an argument."
