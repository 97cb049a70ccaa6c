"""One check in progress: draws, properties, and the verdict on what came of them."""

import copy

from . import guard, metrics, scope
from .budget import seconds
from .explanations import NOT_RIGHT
from .listed import listed_in
from .outcome import CORRECT, NOT_YET
from .raised import Raised
from .results import Refusal
from .staying import Staying
from .wording import closed, joined, leading

INTO_SECOND = " `np.arctan(y, x)` writes into x: `np.arctan2` takes two."


class Trial(Raised, Staying):
    """A function and what one check makes of it."""

    def draw(self, args, metric, words=None):
        """Run one draw; returns an Outcome when it ends the check, None otherwise."""
        expected = self.exercise.reference(*copy.deepcopy(args))
        admitted = []

        def finish(result):
            try:
                admitted.append(metric.admit(result, expected) if metric else result)
                self.listed = self.listed or listed_in(result, expected)
            except metrics.Refused as refusal:
                self.refusal = self.refusal or f"{self._led(words)}{refusal}"
                admitted.append(Refusal(result))
            return None

        started = seconds()
        run = guard.run(self.function, args, finish, self.exercise.limit)
        self.spent += seconds() - started
        self.printed = self.printed or run.printed
        if run.error is not None:
            if self.defaults.may_fill and self._is_right_on(self.defaults.fresh, args, metric, expected):
                return self.outcome(NOT_YET, self.defaults.words())
            named = self._named_by_failing(run.error, args)
            if named:
                return named
            told = self._raised(run, args, words)
            endless = isinstance(run.error, RecursionError | MemoryError)  # it would be so again and again
            return told if endless else self._mended(told, args, metric, expected)
        if run.changed:
            changed = [f"`{name}`" for k, name in enumerate(self._names(args)) if k in run.changed]
            what = f"argument {changed[0]}" if len(changed) == 1 else f"arguments {joined(changed)}"
            as_they_came = "it as it came" if len(changed) == 1 else "them as they came"
            advice = INTO_SECOND if "arctan" in scope.co_names(self.function) else ""
            said = f"your function changes its {what} in place:"
            told = f"{said} leave {as_they_came}, and change a fresh copy instead"
            return self.outcome(NOT_YET, f"{told}.{advice}")
        self.inputs.append(args)
        self.pairs.append((admitted[0], expected))
        self.metrics.append(metric)
        self.words.append(words)
        return None

    def _led(self, words):
        """What is said of a special draw before its result is refused, where all draws before it were right."""
        right = self.pairs and all(m and m.equal(r, e) for m, (r, e) in zip(self.metrics, self.pairs))
        lead = leading(words) if right else ""
        return f"{lead[:-1]}: " if lead else ""

    def property(self, holds, rng):
        """Check one property of the student's function, guarded like a call."""
        again = copy.deepcopy(rng)
        run = self._run_property(holds, self.function, rng)
        if (run.error is not None or run.result) and self.defaults.may_fill:
            run = self._run_property(holds, self.defaults.fresh, again)  # what is left over is told apart from the rest
            if run.error is None and not run.result:
                return self.outcome(NOT_YET, self.defaults.words())
        if run.error is not None:
            return self._raised(run, ())
        return self.outcome(NOT_YET, f"{run.result}{self._about_globals()}") if run.result else None

    def _run_property(self, holds, function, rng):
        return guard.run(holds, (function, rng), limit=self.exercise.limit, author=self.function)

    def _refused(self, words, mended):
        """A refused result, with words beside it; where a place is told that mends it, none is to be looked for."""
        refusal = self.refusal.replace(metrics.NOT_FINITE, "") if mended else self.refusal
        return self.outcome(NOT_YET, closed(refusal) + words + self._about_globals())

    def verdict(self):
        """Compare what came back with the references, then the named mistakes, then by the general layer."""
        if all(m is None or m.equal(r, e) for m, (r, e) in zip(self.metrics, self.pairs)) and not self.refusal:
            named = self._named_mistake() if self.exercise.metric is None else None
            return named or self.outcome(CORRECT)
        keeps = scope.may_keep(self.function)  # else by chance the results may be a mistake's
        kept = self._kept() or self._left_behind() if keeps else None
        named = None if kept else self._named_mistake() or self._named_in_parts()
        if named:
            return named
        words = kept or self._kept() or self._relation(whole=True) or self._other_arguments() or self._terms()
        unmoved = None if words or self.refusal else self._unmoved()  # now, since the search may use up the budget
        search = None if words else self._search()
        step = search and search.finer_words()
        nearer = search and not step and search.nearer_words()  # now, as above
        solution = search and not step and self._solution(search)
        step = step or search and (search.passed_words(solution) or search.notebook_words(solution) or search.words())
        step = step or search and search.passed_words(solution, True)
        shape = self._other_shape() if self.refusal else ""
        step = step or (None if words or shape else unmoved or self._one_change())
        words = words or (not self.refusal and step)
        if words:
            return self.outcome(NOT_YET, closed(words) + self._about_globals())
        mended = bool(step)
        if search and not step and not self._right_often():
            step = search.not_finite_words() if self.refusal else None
            step = step or nearer or search.partly_words() or search.given_words(solution)
        if self.refusal:
            words = shape or (f" {step[0].upper()}{closed(step[1:])}" if step else "")
            return self._refused(words or self._one_shape(), mended)
        if step:
            return self.outcome(NOT_YET, closed(step) + self._about_globals())
        if self._right_on_plain():
            for metric, pair, words in zip(self.metrics, self.pairs, self.words):
                if words and not metric.equal(*pair):
                    off = next(d for d in metric.deviations(*pair) if not d.within)
                    return self.outcome(NOT_YET, self._of_some(closed(f"{words} {off}")) + self._about_globals())
        words = unmoved or self._never_said() or self._relation() or self._picked()
        said, example, call = (closed(words) if words else self._deviation()).partition(NOT_RIGHT)
        said += (self._where_it_is_wrong() if words else self._constant() + self._by_chance()) + self._about()
        words = said + example + call
        return self.outcome(NOT_YET, words + self._about_globals())
