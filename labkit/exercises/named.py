"""Which named mistake an answer is: on all draws, by failing alike, or each part of its results by one of its own."""

import copy
import functools
import re
from dataclasses import replace

import numpy as np

from . import budget, guard, metrics
from .budget import Budget
from .evidence import MORE_CASES, Evidence
from .outcome import NOT_YET
from .results import Refusal, admitted_by, are_one, equal_as_written, failure_of

BESIDE = re.compile(
    r"The [a-z ]+ (?:is|are) right(\. |; |, but )"
)  # said of the other results, where one alone is wrong
MORE_DRAWS = 30  # on which a mistake is to show as well, and an answer is tried that is right on some draws only


class Named(Evidence):
    """The mistakes of the exercise, beside what the answer gives."""

    def _named_mistake(self):
        """The mistake that explains all plain draws, and the special ones too where those alone are wrong."""
        cases = self._cases()
        for k, mistake in enumerate(self.exercise.mistakes):
            alike = all(self._is_mistake(mistake, *case) for case in cases)
            if alike and self._is_it_again(mistake):
                return self.outcome(NOT_YET, mistake.text, k)
        return None

    def _is_it_again(self, mistake):
        """Whether an answer is equal to a mistake on fresh draws too, as those of one check may all be of one kind and
        two rules decide alike by chance: on plain ones, or on special ones where that is wrong if those alone are off.
        """
        exercise = self.exercise
        if exercise.metric is None:
            return True
        if self._right_on_plain():
            special = range(MORE_CASES, MORE_CASES + 2 * len(exercise.noisy))
            cases = (exercise.all_again[number] for number in special)
            return self._is_it_on(mistake, (case for case in cases if self._is_wrong_on(mistake, *case)))
        if not self.refusal and isinstance(self.pairs[0][1], str):
            return self._shows_always(mistake)
        return self._is_it_on(mistake, (exercise.plain_again[number] for number in range(MORE_DRAWS)))

    def _shows_always(self, mistake):
        """Whether an answer is a mistake's wherever that is wrong, at special places too: one of a few words may be the
        same by another rule, and be wrong on a draw or two.
        """
        cases = (self.exercise.all_again[number] for number in range(MORE_CASES + 2 * len(self.exercise.noisy)))
        return self._is_it_on(mistake, (case for case in cases if self._is_wrong_on(mistake, *case)))

    def _is_wrong_on(self, mistake, args, expected, metric):
        return not failure_of(mistake, args) and not self._is_mistake(mistake, args, metric, (expected, expected))

    def _is_it_on(self, mistake, cases):
        """Whether the answer gives what a mistake does on (arguments, expected, metric) of each case."""
        kind = Budget(budget.SPECIAL)
        for args, expected, metric in cases:
            run = guard.run(self.function, args, functools.partial(admitted_by, metric, expected), self.exercise.limit)
            if run.error is not None and type(run.error) is not type(failure_of(mistake, args)):
                return False
            if run.error is None and not self._is_mistake(mistake, args, metric, (run.result, expected)):
                return False
            if not kind.left():
                break  # a slow answer is not called more often than it must
        return True

    def _named_by_failing(self, error, args):
        """The mistake that explains the draws so far, right or possible in one size, and fails on this one in the very
        same words, as these tell of the sizes that did not fit; a text is refused in words of one's own.
        """
        if not isinstance(error, ValueError | TypeError | IndexError):
            return None
        cases = [*zip(self.inputs, self.metrics, self.pairs)]
        for k, mistake in enumerate(self.exercise.mistakes):
            failure = failure_of(mistake, args) if cases else None
            sized = any(isinstance(arg, np.ndarray) for arg in args)
            alike = type(failure) is type(error) and (str(failure) == str(error) or not sized)
            if alike and all(self._is_mistake(mistake, *case) for case in cases):
                return self.outcome(NOT_YET, mistake.text, k)
        return None

    def _named_in_parts(self):
        """Of several results each may be a slip of its own: then each gets its text."""
        if not isinstance(self.exercise.metric, metrics.Several) or self.exercise.metric.together or self.refusal:
            return None
        cases = [case[:3] for case in zip(self.inputs, self.metrics, self.pairs, self.words) if case[3] is None]
        texts, first = {}, None
        for part, (name, metric, _, _) in enumerate(self.exercise.metric.parts(*cases[0][2])):
            if all(metric.equal(pair[0][part], pair[1][part]) for _, _, pair in cases):
                continue
            k = self._slip_of(part, metric, cases)
            if k is None:
                return None
            texts[name], first = _of_one_result(self.exercise.mistakes[k].text), k if first is None else first
        words = "\n".join(f"{name}: {text}" for name, text in texts.items())
        return self.outcome(NOT_YET, words, first) if len(texts) > 1 else None

    def _named_elsewhere(self):
        """The text of the mistake that an answer is wherever it is wrong, where it is right on other draws; None where
        it is none on all of them, or where all that is wrong is one of several to choose, so that two rules may agree.
        """
        if self.refusal:
            return None
        draws = [(args, m, pair) for args, m, pair in self._cases() + self._fresh_results if not m.equal(*pair)]
        parts = (part for _, m, pair in draws for part in m.parts(*pair))
        chosen = all(isinstance(part, metrics.Exactly) or part.equal(*pair) for _, part, *pair in parts)
        if chosen or are_one([result for *_, (result, _) in draws]):
            return None  # also of one and the same number, as where one text alone is wrong
        for mistake in self.exercise.mistakes if len(draws) > 1 else ():
            if all(self._is_mistake(mistake, *draw) for draw in draws):
                return mistake.text
        return None

    def _slip_of(self, part, metric, cases):
        """Which mistake one part of the results is on all draws, rather one of this part alone; None if it is none."""
        slips = [k for k in range(len(self.exercise.mistakes)) if self._is_slip_of(k, part, metric, cases)]
        alone = (k for k in slips if BESIDE.match(self.exercise.mistakes[k].text))
        return next(alone, slips[0] if slips else None)

    def _is_slip_of(self, k, part, metric, cases):
        """Whether one part of the results is that of mistake k on all draws."""
        try:
            with np.errstate(all="ignore"), guard.only_finite_matrices():
                wrong = [self.exercise.mistakes[k].variant(*copy.deepcopy(args))[part] for args, _, _ in cases]
                same = all(equal_as_written(metric, pair[0][part], w) for (_, _, pair), w in zip(cases, wrong))
                return same and not all(metric.equal(w, pair[1][part]) for (_, _, pair), w in zip(cases, wrong))
        except Exception:  # a wrong variant may well fail on a draw: then the answer is not this mistake
            return False

    def _is_mistake(self, mistake, args, metric, pair):
        metric = metric or metrics.Numbers(1e-12)
        if mistake.within and isinstance(metric, metrics.Numbers):
            metric = replace(metric, tol=mistake.within)
        try:
            with np.errstate(all="ignore"), guard.only_finite_matrices():
                wrong = mistake.variant(*copy.deepcopy(args))
                result = pair[0].value if isinstance(pair[0], Refusal) else pair[0]
                return equal_as_written(metric, result, wrong)
        except Exception:  # a wrong variant may well fail on a draw: then the answer is not this mistake
            return False


def _of_one_result(text):
    """A mistake's text without the words that all else is right, where other results are wrong as well."""
    found = BESIDE.match(text)
    rest = text[found.end() :] if found else text
    return rest if found is None or found[1] == ". " else rest[0].upper() + rest[1:]
