"""Exercises as the lecturer writes them, and how an answer is judged.

An `Exercise` is a reference function, a random draw of its arguments, a metric, three hints, and a list of
`Mistake`s: wrong variants of the reference, each with the sentence a student needs who made exactly this mistake.
`judge` is pure: it runs an answer and returns an `Outcome`. What is displayed, remembered and bound to a name is the
business of `session`.
"""

import contextlib
import copy
import dis
import functools
import hashlib
import inspect
import itertools
import re
import types
from dataclasses import dataclass, field, replace

import numpy as np

from . import arguments, cases, guard, metrics, operands, quantities, regions, relations, rerun, scope, shapes, slips
from . import steps as own_steps
from .again import Again
from .budget import Budget, seconds
from .defaults import Defaults
from .typeset import typeset
from .whole import WholeNumbers

TO_DO, NOT_YET, CORRECT, RAISED = "to do", "not yet", "correct", "your code raised"
NOISY = "exact on clean data, but noise enters otherwise than it should: on noisy data"
TOTAL_TIME = 4.0  # seconds: a slow but correct function gets fewer draws of each kind
BEFORE = "It was right before, on other draws: what is different about this one?"
OTHER_SHAPES = "It was right before, on other draws: what is different about this one, its shapes perhaps?"
NOT_RIGHT = "\nNot right when called as "
MANY_DIGITS = 1e-3  # by how much better some draws come out where one case is special
TELLING = 6  # draws on which a choice is wrong as by an explanation, so that this is not chance
LIKE_CHANCE = 8  # draws on which a choice must stay as it is, so that this is not chance
LISTED = 9  # entries of a wrong array of which those that are right are listed
SHOWN = 4  # entries of a set or vector that is shown whole
MORE_DRAWS = 30  # on which an answer that is right on some draws only is tried, to tell on which
SELDOM = 0.2  # of the draws come out right where no case is special, but one comes out by chance
MORE_CASES = 8  # on which an explanation from the first draws is tried once more, at least ...
MOST_CASES = 64  # ... and at most, as far as LOOKING allows: of one in fifty draws a coincidence may hide
REPEATING = 0.02  # seconds of processor time in which an answer that came out right is called again
IN_A_ROW = 8  # times that a draw is called then, of each of ...
ALIKE = 3  # kinds of results at most, where they are words or truth values
LOOKING = 1.2  # seconds of processor time, from the beginning of a check, in which an explanation is looked for
RANDOM = {"default_rng", "random", "normal", "standard_normal", "multivariate_normal", "RandomState", "gauss"}
BY_CHANCE = 0.3  # how far off, relatively, a result made of random numbers may be by chance
SPECIAL = 0.8  # more, where an answer is right on some draws only, for what the others have in common
UNITS = {
    "mm": ("length", 1e-3),
    "cm": ("length", 1e-2),
    "m": ("length", 1.0),
    "rad": ("angle", 1.0),
    "deg": ("angle", np.pi / 180),
}


@dataclass(frozen=True)
class Outcome:
    """The judgment of one answer: status, what to say about it, and the index of the named mistake it is, if any."""

    status: str
    text: str = ""
    mistake: int | None = None
    printed: str = ""

    def __post_init__(self):
        object.__setattr__(self, "text", guard.printable(typeset(self.text)))


@dataclass(frozen=True)
class Mistake:
    """A wrong variant of the reference, with the same arguments, and what to tell who made it.

    `id` is the same in every term and in every list, so that two classes can be compared. Left out, it follows from
    the exercise and the sentence; whoever only improves the sentence writes the old id down. `within` is for a Value
    that comes from a search: how far, in the Value's unit, an answer may be from the wrong one and still be it.
    """

    variant: object
    text: str
    id: str = ""
    within: float = 0.0


@dataclass(frozen=True)
class Item:
    """What all exercises share."""

    id: str
    chapter = None  # the Chapter it stands in, which tells it so

    def __post_init__(self):
        if not self.id.isidentifier():
            raise ValueError(f"an exercise id must be a Python name, got {self.id!r}")
        hints = getattr(self, "hints", None)
        if hints is not None and (isinstance(hints, str) or len(hints) != 3):
            raise ValueError(f"exercise {self.id!r} needs exactly three hints, got {len(hints)}")
        if hints is not None:
            object.__setattr__(self, "hints", tuple(map(typeset, hints)))
        if hasattr(self, "mistakes"):
            object.__setattr__(self, "mistakes", _with_ids(self.id, self.mistakes))


def _with_ids(exercise, mistakes):
    """The mistakes, each with an id of its own: that of its sentence, numbered where several variants share it."""
    named = []
    for mistake in mistakes:
        words, text = f"{exercise}-{hashlib.sha256(mistake.text.encode()).hexdigest()[:6]}", typeset(mistake.text)
        same = sum(other.text == text for other in named)
        named.append(replace(mistake, text=text, id=mistake.id or (f"{words}-{same + 1}" if same else words)))
    return tuple(named)


@dataclass(frozen=True)
class Exercise(Item):
    """A function to write.

    reference:  the tested library function.
    draw:       draw(rng) -> tuple of arguments, fresh at every check. Several in a tuple take turns, so that no
                case which tells a right answer from a wrong one is left to chance.
    metric:     compares one result with the reference's; None for stochastic code, which `properties` judge.
    hints:      three, from the rule to the line.
    mistakes:   wrong variants; an answer equal to one on all draws gets its text.
    noisy:      (draw, metric) or (draw, metric, words): one more draw, with noise and a tolerance band for estimators,
                or at a special place; several such in a list. `words` lead in what is said when only this draw fails.
    properties: functions (student_function, rng) -> None or a sentence that says what does not hold.
    fixed:      {argument: reason} of arguments that are the same, or of one shape, in all draws: what the docstring
                leaves free must vary, or an answer could be wired to it.
    decimals:   {argument: reason} of arguments that nobody has to take in whole numbers.
    draws:      how many draws a check takes; 0 where the properties alone judge.
    limit:      seconds that one call may take.
    """

    reference: object
    draw: object
    metric: object = None
    hints: tuple = ()
    mistakes: tuple = ()
    noisy: tuple = ()
    properties: tuple = ()
    fixed: dict = field(default_factory=dict)
    decimals: dict = field(default_factory=dict)
    draws: int = 5
    limit: float = guard.TIME_LIMIT

    def __post_init__(self):
        super().__post_init__()
        noisy = self.noisy or ()
        object.__setattr__(self, "noisy", (noisy,) if noisy and callable(noisy[0]) else tuple(noisy))
        if self.metric is None and not self.properties:
            raise ValueError(f"exercise {self.id!r} needs a metric or properties")
        if 0 < self.draws < len(self.cases):
            raise ValueError(f"exercise {self.id!r} takes {self.draws} draws, too few for {len(self.cases)} in turn")

    @property
    def cases(self):
        """The draws that take turns."""
        return self.draw if isinstance(self.draw, tuple) else (self.draw,)

    @functools.cached_property
    def plain_again(self):
        """Plain draws that are the same at every check."""
        return Again(((draw, self.metric) for draw in itertools.cycle(self.cases)), self.reference)

    @functools.cached_property
    def all_again(self):
        """Draws that are the same at every check, the special ones among the first."""
        plain = [(draw, self.metric) for draw in self.cases]
        special = [(draw, metric) for draw, metric, *_ in self.noisy]
        first = [*itertools.islice(itertools.cycle(plain), MORE_CASES), *special, *special]
        return Again(itertools.chain(first, itertools.cycle(plain)), self.reference)

    @functools.cached_property
    def whole(self):
        """The property that whole numbers are numbers, too."""
        return WholeNumbers(self)

    @property
    def arguments(self):
        """Names of the reference's parameters that a draw fills."""
        return list(inspect.signature(self.reference).parameters)

    def judge(self, function, rng=None):
        """Run the student's function on fresh draws and say what came out; never raises, whatever the function does."""
        rng = np.random.default_rng() if rng is None else rng
        if is_blank(function):
            return Outcome(TO_DO)
        if not callable(function):
            return Outcome(NOT_YET, f"expected a function, got {metrics._describe(function)}.")
        twins = scope.twins_of(self)
        if scope.is_the_librarys(function, self, twins):
            where = f"{function.__module__}.{function.__name__}"
            return Outcome(
                NOT_YET, f"that is the library's own function, `{where}`: it is the one you are asked to write."
            )
        with scope.own_name(function, self.id), scope.without(twins, function):
            return self._try(function, rng)

    def _try(self, function, rng):
        trial, seen = _Trial(self, function), []
        for draw, metric, words in self._plan():
            if trial.spent > TOTAL_TIME and len(seen) > 1 and draw in seen:
                continue
            if words and trial.is_wrong():
                break
            problem = trial.draw(draw(rng), metric, words)
            if problem:
                return problem
            seen.append(draw)
        verdict = trial.verdict()
        if verdict.status == CORRECT:
            if words := trial.repeated() or trial.remembered(rng):
                return trial.outcome(NOT_YET, _closed(words))
            for holds in (*self.properties, self.whole):
                problem = trial.property(holds, rng)
                if problem:
                    return problem
        return verdict

    def _plan(self):
        """(draw, metric, words) of every draw; words are None for the plain ones."""
        noisy = [(draw, metric, *(words or (NOISY,))) for draw, metric, *words in self.noisy]
        return [(draw, self.metric, None) for draw in itertools.islice(itertools.cycle(self.cases), self.draws)] + noisy


class _Trial:
    """One check in progress: the draws so far, what the student's function made of them, what it printed."""

    def __init__(self, exercise, function):
        self.exercise, self.function, self.defaults = exercise, function, Defaults(function)
        self.pairs, self.inputs, self.metrics, self.words = [], [], [], []
        self.refusal, self.printed, self.spent, self.budget = "", "", 0.0, Budget(LOOKING)

    def outcome(self, status, text="", mistake=None):
        return Outcome(status, text, mistake, self.printed)

    def draw(self, args, metric, words=None):
        """Run one draw; returns an Outcome when it ends the check, None otherwise."""
        expected = self.exercise.reference(*copy.deepcopy(args))
        admitted = []

        def finish(result):
            try:
                admitted.append(metric.admit(result, expected) if metric else result)
            except metrics.Refused as refusal:
                self.refusal = self.refusal or f"{self._led(words)}{refusal}"
                admitted.append(_Refusal(result))
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
            names = ", ".join(f"`{name}`" for k, name in enumerate(self._names(args)) if k in run.changed)
            return self.outcome(NOT_YET, f"your function changes its argument {names} in place: work on a copy.")
        self.inputs.append(args)
        self.pairs.append((admitted[0], expected))
        self.metrics.append(metric)
        self.words.append(words)
        return None

    def _led(self, words):
        """What is said of a special draw before its result is refused, where all draws before it were right."""
        right = self.pairs and all(m and m.equal(r, e) for m, (r, e) in zip(self.metrics, self.pairs))
        lead = _lead(words) if right else ""
        return f"{lead[:-1]}: " if lead else ""

    def property(self, holds, rng):
        """Check one property of the student's function, guarded like a call."""
        again = copy.deepcopy(rng)
        run = self._run_property(holds, self.function, rng)
        if self.defaults.may_fill and (run.error is not None or run.result):
            run = self._run_property(holds, self.defaults.fresh, again)  # what is left over is told apart from the rest
            if run.error is None and not run.result:
                return self.outcome(NOT_YET, self.defaults.words())
        if run.error is not None:
            return self._raised(run, ())
        return self.outcome(NOT_YET, f"{run.result}{self._about_globals()}") if run.result else None

    def _is_right_on(self, function, args, metric, expected):
        """Whether another function succeeds where the student's has stopped."""
        run = guard.run(function, args, functools.partial(_admitted, metric, expected), self.exercise.limit)
        came = run.error is None and metric is not None and not isinstance(run.result, _Refusal)
        return came and metric.equal(run.result, expected)

    def _run_property(self, holds, function, rng):
        return guard.run(holds, (function, rng), limit=self.exercise.limit, author=self.function)

    def is_wrong(self):
        """Whether a plain draw came out wrong: then special ones have nothing to tell."""
        return bool(self.refusal) or self.exercise.metric is not None and not self._right_on_plain()

    def verdict(self):
        """Compare what came back with the references, then the named mistakes, then by the general layer."""
        if all(m is None or m.equal(r, e) for m, (r, e) in zip(self.metrics, self.pairs)) and not self.refusal:
            named = self._named_mistake() if self.exercise.metric is None else None
            return named or self.outcome(CORRECT)
        kept = self._kept() if scope.may_keep(self.function) else None  # else by chance the results may be a mistake's
        named = None if kept else self._named_mistake() or self._named_in_parts()
        if named:
            return named
        words = kept or self._kept() or self._relation(whole=True) or self._other_arguments() or self._terms()
        unmoved = None if words or self.refusal else self._unmoved()  # now, since the search may use up the budget
        search = None if words else self._search()
        solution = search and self._solution(search)
        step = search and (search.passed_words(solution) or search.notebook_words(solution) or search.words())
        shape = self._other_shape() if self.refusal else ""
        words = words or (not self.refusal and step) or (not shape and (unmoved or self._one_change()))
        if words:
            return self.outcome(NOT_YET, _closed(words) + self._about_globals())
        if search and not step and not self._right_often():
            step = search.not_finite_words() if self.refusal else None
            step = step or search.nearer_words() or search.partly_words() or search.given_words(solution)
        if self.refusal:
            words = shape or (f" {step[0].upper()}{_closed(step[1:])}" if step else "")
            words = words or self._agreement(search, solution)
            return self.outcome(NOT_YET, _closed(self.refusal) + words + self._about_globals())
        if step:
            return self.outcome(NOT_YET, _closed(step) + self._about_globals())
        if self._right_on_plain():
            for metric, pair, words in zip(self.metrics, self.pairs, self.words):
                if words and not metric.equal(*pair):
                    off = next(d for d in metric.deviations(*pair) if not d.within)
                    return self.outcome(NOT_YET, self._of_some(_closed(f"{words} {off}")))
        words = unmoved or self._never_said() or self._relation() or self._picked()
        said, example, call = (_closed(words) if words else self._deviation()).partition(NOT_RIGHT)
        said += self._where_it_is_wrong() if words else self._constant() + self._by_chance()
        words = said + self._agreement(search, solution) + example + call
        return self.outcome(NOT_YET, words + self._about_globals())

    def _of_some(self, text):
        """What is said of one special draw, as it is true where those of another kind are wrong as well."""
        wrong = {words for m, pair, words in zip(self.metrics, self.pairs, self.words) if words and not m.equal(*pair)}
        return _in_ordinary_cases(text) if len(wrong) > 1 else text

    def _where_it_is_wrong(self):
        """What the draws on which it is wrong have in common, as one more sentence, where it is right on others."""
        words = self._special_case() if self._right_somewhere() else None
        return f" {words}" if words else ""

    def _agreement(self, search, solution):
        """How far what is computed on the way is what the solution computes, as one more sentence."""
        words = search and not self._right_somewhere() and search.agreement_words(solution)
        return f" {words}." if words else ""

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
        first = _numbers_of(before)
        admitted = functools.partial(_admitted, self.metrics[draw], self.pairs[draw][1])
        run = guard.run(self.function, self.inputs[draw], admitted, self.exercise.limit)
        if first is None:
            return self._kept_words(run.error) if _is_another(before, run) else None
        if not _same_numbers(_numbers_of(before), first):
            return (
                "your function returns one and the same array at every call: a later call overwrites what an earlier "
                "one returned. Make the array within the function"
            )
        if run.error is None and _same_numbers(_numbers_of(run.result), first):
            return None
        return self._kept_words(run.error)

    def _kept_words(self, error, calls=2):
        told = "stops with an error" if error is not None else "gives another result"
        often, at = ("twice", "the second time") if calls == 2 else ("several times", "in the end")
        return (
            f"called {often} with the same arguments, your function {told} {at}. Does something stay from "
            "call to call, a global variable or a default argument that is changed? Or is something drawn at random?"
        )

    def repeated(self):
        """What stays from call to call, if an answer that came out right does so no more when it is called again."""
        if self.exercise.metric is None or "rng" in self.exercise.arguments:
            return None
        again = functools.partial(self._again_words, kind=Budget(REPEATING))
        return guard.run(again, (self.function,), limit=self.exercise.limit + REPEATING, author=self.function).result

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

        Two fresh calls differ in one argument. That of the first is another draw's and need not go with the rest: only
        the second is judged, which nobody misses who has computed it.
        """
        exercise, kind = self.exercise, Budget(SPECIAL)
        if exercise.metric is None or not self.pairs or not scope.may_keep(self.function):
            return None
        for k, name in enumerate(self._names(self.inputs[0])):
            draw = exercise.cases[k % len(exercise.cases)]
            args, other = draw(rng), draw(rng)
            if not kind.left() or k >= min(len(args), len(other)) or not _could_change(args[k], other[k]):
                continue
            expected = exercise.reference(*copy.deepcopy(args))
            admitted = functools.partial(_admitted, exercise.metric, expected)
            before = guard.run(self.function, (*args[:k], other[k], *args[k + 1 :]), admitted, exercise.limit)
            run = guard.run(self.function, args, admitted, exercise.limit)
            if before.error is not None or run.error is not None or exercise.metric.equal(run.result, expected):
                continue
            if _same_numbers(_numbers_of(run.result), _numbers_of(before.result)):
                return (
                    f"right at first, but called again with another `{name}` and all else as before, your function "
                    "returns what it returned then, which is right no more: is a result kept, and found again by a "
                    f"part of the arguments alone?{self._about_globals()}"
                )
        return None

    def _relation(self, whole=False):
        """What the general layer says of the results; nothing where one was refused, or only special ones are wrong."""
        if self.refusal or self.exercise.metric is None or self._right_on_plain():
            return None
        arrays = [arg for args in self.inputs for arg in args if isinstance(arg, np.ndarray)]
        sizes = {n for array in arrays for n in (*array.shape, array.size)}
        words = relations.difference_words(self.exercise.metric, self._plain_pairs(), sizes, whole)
        return words if words is None or _has_loop(self.function) else words.replace(relations.LOOP, "")

    def _other_arguments(self):
        """Whether the results are right for arguments changed in one respect, with these in words."""
        if self.exercise.metric is None or not self.inputs:
            return None
        cases = self._cases()
        read = scope.notebook_data(self.function)
        notebook = {name: self.function.__globals__[name] for name in read}
        tried = arguments.changes(self._names(self.inputs[0]), [case[0] for case in cases], notebook)
        reference = self.exercise.reference
        if self._is_always_the_same() or self._holds_no_number():
            return None
        if all(isinstance(expected, str | bool | set | frozenset) for _, expected in self.pairs):
            tried = (pair for pair in tried if not arguments.SIZES.search(pair[0]))  # another size would do as well
        told = ((words, change) for words, change in tried if self._is_felt(change))
        words = self._first_that_fits((words, lambda *args, c=change: reference(*c(args))) for words, change in told)
        return words and f"your result is what comes out {words}"

    def _is_always_the_same(self):
        """Whether the results are one and the same on all draws, so that many a wrong computation would give them."""
        metric, pairs = self.exercise.metric, self._plain_pairs()
        if isinstance(metric, metrics.Exactly) or len(pairs) < 2:
            return False
        try:
            if self.refusal:
                return _are_one([r.value if isinstance(r, _Refusal) else r for r, _ in pairs])
            return all(_equal_as_written(metric, result, pairs[0][0]) for result, _ in pairs[1:])
        except Exception:  # results of different draws need not go together
            return False

    def _holds_no_number(self):
        """Whether some result holds nothing but NaN or infinity, which many a wrong computation gives."""
        results = (_numbers_of(result) for result, _ in self._plain_pairs())
        return any(numbers is not None and not np.isfinite(numbers).any() for numbers in results)

    def _is_felt(self, change):
        """Whether a change of arguments leaves them as they are where the answer is right, if that is about numbers."""
        if self.refusal or isinstance(self.exercise.metric, metrics.Exactly):
            return True
        try:
            right = [args for args, metric, pair in self._cases() if metric.equal(*pair)]
            return all(all(map(np.array_equal, change(copy.deepcopy(args)), args)) for args in right)
        except Exception:  # a change may not be possible for the arguments of each draw
            return False

    def _first_that_fits(self, variants):
        """The words of the first of (words, function) that gives the student's results, on fresh draws as well; None
        if none does in time.
        """
        draws, kind, variants = self._cases(), self.budget.part(), iter(variants)
        while kind.left():
            fits = None
            try:
                with guard.time_limit(kind.left()):  # a variant may well have a loop without an end
                    for words, function in variants:
                        if all(self._is_mistake(Mistake(function, words), *case) for case in draws):
                            fits = words, function
                            break
            except guard.TimeLimit:
                return None
            if fits is None or self._fits_more(fits[1]):
                return fits and fits[0]
        return None

    def _fits_more(self, function):
        """Whether a variant gives the student's results on fresh draws as well."""
        mistake, draws = Mistake(function, ""), self._fresh_results
        wrong = sum(not metric.equal(*pair) for _, metric, pair in self._cases() + draws)
        if self._is_choice() and wrong < TELLING:
            return False
        try:
            with guard.time_limit(self.budget.left()):
                return self._is_it_again(mistake) and all(self._is_mistake(mistake, *draw) for draw in draws)
        except guard.TimeLimit:
            return False

    @functools.cached_property
    def _fresh_results(self):
        """(arguments, metric, (result, expected)) of the student's function on fresh plain draws, where it succeeds."""
        found, kind = [], self.budget.part()
        for case in self._fresh:
            if not kind.left():
                break  # a slow answer is not called more often than it must
            if case.metric is self.exercise.metric:
                admitted = functools.partial(_admitted, case.metric, case.expected)
                run = guard.run(self.function, case.args, admitted, self.exercise.limit)
                if run.error is None:
                    found.append((case.args, case.metric, (run.result, case.expected)))
        return found

    def _terms(self):
        """What one argument, or a number of them, has to do with each part of the results that is wrong."""
        if self.refusal or self.exercise.metric is None or self._right_on_plain():
            return None
        pairs = self._plain_pairs()
        named = [dict(zip(self._names(args), args)) for args, _, _ in self._cases()]
        told = []
        for k, (name, metric, _, _) in enumerate(self.exercise.metric.parts(*pairs[0])):
            pieces = [self.exercise.metric.parts(*pair)[k] for pair in pairs]
            if isinstance(metric, metrics.Exactly) or all(metric.equal(r, e) for _, _, r, e in pieces):
                continue
            if any(metric.equal(r, e) for _, _, r, e in pieces):
                return None  # right in some cases: these are what is to be told
            results, expected = ([np.asarray(piece[i], dtype=float) for piece in pieces] for i in (2, 3))
            words = operands.operand_words(metric, results, expected, named)
            if words is None:
                return None
            told.append(f"{name}: {words}" if name else words)
        return "\n".join(map(_closed, told)) or None

    def _solution(self, search):
        return own_steps.of_solution(self.exercise, search.cases, self.budget)

    def _is_choice(self):
        """Whether one of several is to be chosen, which a wrong rule may well do by chance."""
        numbers = all(type(expected) is int for _, expected in self.pairs)
        return numbers and isinstance(self.exercise.metric, metrics.Exactly)

    def _right_somewhere(self):
        """Whether some plain draws come out right, and not by chance: then these are what is to be told."""
        metric = self.exercise.metric
        return not self.refusal and not self._is_choice() and any(metric.equal(*pair) for pair in self._plain_pairs())

    def _right_often(self):
        """Whether so many plain draws come out right that what the others have in common says more than a step does."""
        right = [self.exercise.metric.equal(*pair) for pair in self._plain_pairs()] if self._right_somewhere() else []
        return sum(right) > SELDOM * len(right)

    def _search(self):
        """What looks for the step of the student's own code at which it goes wrong; None where it cannot be read."""
        if self.exercise.metric is None or not self.inputs:
            return None
        drawn = [
            own_steps.Case(args, metric, pair[1], refused=pair[0].value)
            if isinstance(pair[0], _Refusal)
            else own_steps.Case(args, metric, pair[1], pair[0])
            for args, metric, pair in zip(self.inputs, self.metrics, self.pairs)
        ]
        return own_steps.search(self.function, self._names(self.inputs[0]), drawn, self._judging(), self.budget)

    def _mended(self, outcome, args, metric, expected):
        """What was raised, with the change of the student's code that gives the right result, if one does."""
        if outcome.status != RAISED or metric is None or metric is not self.exercise.metric:
            return outcome
        drawn = [own_steps.Case(args, metric, expected), *self._fresh[:2]]
        search = own_steps.search(self.function, self._names(args), drawn, self._judging(), self.budget)
        words = search and search.words()
        return replace(outcome, text=f"{outcome.text}\n{words[0].upper()}{_closed(words[1:])}") if words else outcome

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
        return own_steps.Judging(self._fresh_cases, self._has_properties)

    def _has_properties(self, function):
        """Whether a changed function has the properties asked for, which are part of the judgment."""
        try:
            return not any(holds(function, np.random.default_rng(0)) for holds in self.exercise.properties)
        except Exception:  # what fails has not got them
            return False

    def _one_change(self):
        """Whether the results are those of a right formula with one change, with this in words."""
        if self.exercise.metric is None or not self.inputs or self._is_always_the_same() or self._is_told_apart():
            return None
        if self._holds_no_number() or self._never_said():
            return None
        words = self._first_that_fits(slips.changed_formulas(self.exercise))
        return words and f"your result is what a right formula gives {words}"

    def _picked(self):
        """Whether all results are rows of one argument, as they came, in words; None where they are not."""
        wrong = [(args, *pair) for args, metric, pair in self._cases() if not metric.equal(*pair)]
        for k, name in enumerate(self._names(wrong[0][0]) if len(wrong) > 1 else ()):
            if all(_is_row(result, args[k]) and not _is_row(expected, args[k]) for args, result, expected in wrong):
                return f"your result is one of the rows of `{name}` as it came, and the right one is none of them"
        return None

    def _never_said(self):
        """Which of several words never comes out, though it is right on some plain draws."""
        pairs = self._plain_pairs()
        words = all(isinstance(word, str) for pair in pairs for word in pair)
        if not words or not self._right_somewhere():  # as long as nothing is right, no right word is told
            return None
        said = {result for result, _ in pairs}
        lacking = list(dict.fromkeys(f"`{expected!r}`" for _, expected in pairs if expected not in said))
        if len(lacking) > 1:
            return f"{', '.join(lacking[:-1])} and {lacking[-1]} never come out, though each is right on some draws"
        return f"{lacking[0]} never comes out, though it is right on some draws" if lacking else None

    def _is_told_apart(self):
        """Whether special draws alone are wrong of which the exercise says what they are: on a few draws of one kind
        many a change of the solution comes to the same.
        """
        pairs = zip(self.metrics, self.pairs, self.words)
        return self._right_on_plain() and any(_lead(words) and not m.equal(*pair) for m, pair, words in pairs)

    def _other_shape(self):
        """What results of a wrong shape have to do with the expected ones."""
        if self._is_always_the_same():
            return ""
        pairs = self._plain_pairs()
        results = [pair[0].value if isinstance(pair[0], _Refusal) else None for pair in pairs]
        if any(result is None for result in results):
            return ""
        names = getattr(self.exercise.metric, "names", ())
        words = shapes.shape_words(results, [expected for _, expected in pairs], names)
        return f" {words[0].upper()}{words[1:]}." if words else ""

    def _unmoved(self):
        """An argument that makes no difference to the results, though it should."""
        draws = self._cases()
        if self.exercise.metric is None or not draws or not self.budget.left():
            return None
        told = dict.fromkeys(rerun.read_for_size(self.function), "uses only the size of")
        told |= dict.fromkeys(_unread(self.function), "never uses")
        names = self._names(draws[0][0])
        for k, name in enumerate(names):
            if name in told and any(self._moves(k, *pair) for pair in self._exchanges(k, draws)):
                return f"your function {told[name]} `{name}`, and its result should change with it"
        for k, name in enumerate(names):
            least = LIKE_CHANCE if self._is_choice() else 2
            if self._makes_no_difference(k, draws) and self._makes_no_difference(k, draws + self._fresh_results, least):
                return f"your result did not change with `{name}` on any draw of this check, and it should"
        return None

    def _exchanges(self, k, draws):
        """(draw, its arguments with the k-th of another one) of every draw; the next that has another one like it."""
        for i, (args, *_) in enumerate(draws):
            others = next((o for o, *_ in draws[i + 1 :] + draws[:i] if _could_change(args[k], o[k])), None)
            if others is not None:
                yield draws[i], (*args[:k], others[k], *args[k + 1 :])

    def _moves(self, k, draw, changed):
        """Whether the reference gives another result for the changed arguments; None where they do not go together."""
        try:
            return not draw[1].equal(self.exercise.reference(*copy.deepcopy(changed)), draw[2][1])
        except Exception:
            return None

    def _constant(self):
        """That all results are one and the same, if they are and should not be, as one more sentence."""
        results, expected = zip(*self._plain_pairs())
        if len(results) < 2 or _are_one(expected) or not _are_one(results):
            return ""
        return " Your result is the same on every draw, the right one is not: is it typed in, or made of other data?"

    def _by_chance(self):
        """That a result which is nearly right comes of random numbers, as one more sentence."""
        drawn = RANDOM & set(getattr(getattr(self.function, "__code__", None), "co_names", ()))
        if not drawn or "rng" in self.exercise.arguments or isinstance(self.exercise.metric, metrics.Exactly):
            return ""
        numbers = [(_numbers_of(r), _numbers_of(e)) for r, e in self._plain_pairs()]
        if any(r is None or e is None or np.shape(r) != np.shape(e) for r, e in numbers):
            return ""
        if any(np.linalg.norm(np.subtract(r, e)) > BY_CHANCE * np.linalg.norm(e) for r, e in numbers):
            return ""
        return " Your function draws random numbers, so part of this may be chance: is there a way without them?"

    def _makes_no_difference(self, k, draws, least=0):
        """Whether the k-th argument, taken from the next draw, changes the reference's results, never the student's."""
        tried = 0
        for draw, changed in self._exchanges(k, draws):
            moved = self._moves(k, draw, changed)
            if moved is None:
                continue
            run = guard.run(self.function, changed, limit=self.exercise.limit)
            if not moved or run.error is not None or not _equal_as_written(draw[1], run.result, draw[2][0]):
                return False
            tried += 1
        return tried >= least

    def _about_globals(self):
        """A line about data of the notebook that the function reads, which a checked function is not given."""
        names = ", ".join(f"`{name}`" for name in scope.notebook_data(self.function))
        if not names:
            return ""
        return f"\nYour function reads {names} from the notebook: what it computes with should come in as an argument."

    def _plain_pairs(self):
        return [pair for pair, words in zip(self.pairs, self.words) if words is None]

    def _right_on_plain(self):
        metric = self.exercise.metric
        return metric is not None and all(metric.equal(*pair) for pair in self._plain_pairs())

    def _named_mistake(self):
        """The mistake that explains all plain draws, and the special ones too where those alone are wrong."""
        cases = self._cases()
        for k, mistake in enumerate(self.exercise.mistakes):
            if all(self._is_mistake(mistake, *case) for case in cases) and self._is_it_again(mistake):
                return self.outcome(NOT_YET, mistake.text, k)
        return None

    def _is_it_again(self, mistake):
        """Whether an answer is equal to a mistake on fresh draws too, where it is one of several, some of them, or a
        truth value: two rules may decide alike by chance.
        """
        decides = isinstance(self.exercise.metric, metrics.Exactly)
        if not decides or self.refusal or self._right_on_plain():
            return True
        if isinstance(self.pairs[0][1], str):
            return self._shows_always(mistake)
        return self._is_it_on(mistake, (self.exercise.plain_again[number] for number in range(MORE_DRAWS)))

    def _shows_always(self, mistake):
        """Whether an answer is a mistake's wherever that is wrong, at special places too: one of a few words may be the
        same by another rule, and be wrong on a draw or two.
        """
        cases = (self.exercise.all_again[number] for number in range(MORE_CASES + 2 * len(self.exercise.noisy)))
        return self._is_it_on(mistake, (case for case in cases if self._is_wrong_on(mistake, *case)))

    def _is_wrong_on(self, mistake, args, expected, metric):
        return not _failure(mistake, args) and not self._is_mistake(mistake, args, metric, (expected, expected))

    def _is_it_on(self, mistake, cases):
        """Whether the answer gives what a mistake does on (arguments, expected, metric) of each case."""
        kind = Budget(SPECIAL)
        for args, expected, metric in cases:
            run = guard.run(self.function, args, limit=self.exercise.limit)
            if run.error is not None or not self._is_mistake(mistake, args, metric, (run.result, expected)):
                return False
            if not kind.left():
                break  # a slow answer is not called more often than it must
        return True

    def _cases(self):
        """(arguments, metric, pair) of the draws that tell: the plain ones, or all where only special ones are off."""
        everything = self._right_on_plain()
        rows = zip(self.inputs, self.metrics, self.pairs, self.words)
        return [row[:3] for row in rows if everything or row[3] is None]

    def _named_by_failing(self, error, args):
        """The mistake that explains the draws so far and fails alike on this one: right, or possible, in one size."""
        if not isinstance(error, ValueError | TypeError | IndexError):
            return None
        cases = [*zip(self.inputs, self.metrics, self.pairs)]
        for k, mistake in enumerate(self.exercise.mistakes):
            alike = cases and type(_failure(mistake, args)) is type(error)
            if alike and all(self._is_mistake(mistake, *case) for case in cases):
                return self.outcome(NOT_YET, mistake.text, k)
        return None

    def _named_in_parts(self):
        """Of several results each may be a slip of its own: then each gets its text."""
        if not isinstance(self.exercise.metric, metrics.Several) or self.refusal:
            return None
        cases = [case[:3] for case in zip(self.inputs, self.metrics, self.pairs, self.words) if case[3] is None]
        texts, first = {}, None
        for part, (name, metric, _, _) in enumerate(self.exercise.metric.parts(*cases[0][2])):
            if all(metric.equal(pair[0][part], pair[1][part]) for _, _, pair in cases):
                continue
            k = next((k for k in range(len(self.exercise.mistakes)) if self._is_slip_of(k, part, metric, cases)), None)
            if k is None:
                return None
            texts[name], first = self.exercise.mistakes[k].text, k if first is None else first
        words = "\n".join(f"{name}: {text}" for name, text in texts.items())
        return self.outcome(NOT_YET, words, first) if len(texts) > 1 else None

    def _is_slip_of(self, k, part, metric, cases):
        """Whether one part of the results is that of mistake k on all draws."""
        try:
            with np.errstate(all="ignore"), guard.only_finite_matrices():
                wrong = [self.exercise.mistakes[k].variant(*copy.deepcopy(args))[part] for args, _, _ in cases]
                same = all(_equal_as_written(metric, pair[0][part], w) for (_, _, pair), w in zip(cases, wrong))
                return same and not all(metric.equal(w, pair[1][part]) for (_, _, pair), w in zip(cases, wrong))
        except Exception:  # a wrong variant may well fail on a draw: then the answer is not this mistake
            return False

    def _is_mistake(self, mistake, args, metric, pair):
        metric = metric or metrics.Numbers(1e-12)
        try:
            with np.errstate(all="ignore"), guard.only_finite_matrices():
                wrong = mistake.variant(*copy.deepcopy(args))
                result = pair[0].value if isinstance(pair[0], _Refusal) else pair[0]
                return _equal_as_written(metric, result, wrong)
        except Exception:  # a wrong variant may well fail on a draw: then the answer is not this mistake
            return False

    def _deviation(self):
        """The worst deviation on the plain draws, or that of the call beside it; if some draws were right, a call that
        was not.
        """
        metric, pairs = self.exercise.metric, self._plain_pairs()
        most = self._worst(pairs)
        if most is None:
            return "right on most draws, but not on all."
        near = relations.not_accurate_enough(most)
        if near and not self._right_to_many_digits(most):
            return near
        missed = [(args, *pair) for args, pair in zip(self.inputs, pairs) if not metric.equal(*pair)]
        example = self._example(*missed[0])
        if len(missed) < len(pairs):
            example = example or f"{NOT_RIGHT}{self._call(missed[0][0])}"
        own = isinstance(metric, metrics.Exactly) and type(metric).deviations is not metrics.Exactly.deviations
        words = None if own else cases.result_words(pairs)
        told = _closed(words or str(self._worst([missed[0][1:]]) if example else most))
        if len(missed) == len(pairs):
            side = cases.side_words(pairs)
            told = f"{told[:-1]}, and {side}." if side else told
            return told + self._right_parts() + example
        special = self._special_case()
        asked = ", perhaps by chance." if self._is_choice() else ": which case is special?"
        right = special or f"It was right on {len(pairs) - len(missed)} of {len(pairs)} draws{asked}"
        return f"{told} {right}{example}"

    def _worst(self, pairs):
        """The deviation that is farthest beyond its tolerance; None where none is."""
        off = [d for pair in pairs for d in self.exercise.metric.deviations(*pair) if not d.within]
        return max(off, key=lambda d: d.amount / max(d.tolerance, 1e-300), default=None)

    def _example(self, args, result, expected):
        """One call that did not come out right, with what it gives, if all can be shown whole; the right result is told
        where it is one of some words, a number stays to be found.
        """
        call, mine = self._call(args), _whole(result)
        if "<" in call or mine is None:
            return ""
        right = f", and {_whole(expected)} is right" if isinstance(expected, str) and self._right_somewhere() else ""
        return f"{NOT_RIGHT}{call}: it gives {mine}{right}"

    def _right_parts(self):
        """Which of several results are right on all draws, as one more sentence; nothing where none or all are."""
        metric, pairs = self.exercise.metric, self._plain_pairs()
        right = [
            name
            for k, (name, part, _, _) in enumerate(metric.parts(*pairs[0]))
            if all(part.equal(*metric.parts(*pair)[k][2:]) for pair in pairs)
        ]
        return f" Right are: {', '.join(right)}." if right and isinstance(metric, metrics.Several) else ""

    def _right_to_many_digits(self, worst):
        """Whether some draws come out so much better than the worst that a case is to be told, not the accuracy."""
        sizes = [max((d.amount for d in m.deviations(*pair)), default=0.0) for _, m, pair in self._cases()]
        return len(sizes) > 1 and min(sizes) < MANY_DIGITS * worst.amount

    def _special_case(self, stopped=()):
        """What the draws on which the answer is wrong have in common, fresh ones among them, as a sentence; `stopped`
        are the arguments of one on which it raised.
        """
        draws = [(args, pair[1], not m.equal(*pair)) for args, m, pair in self._cases()]
        draws += [(stopped, None, True)] if stopped else []
        kind = Budget(max(SPECIAL, self.budget.left()))
        for number in range(MORE_DRAWS):
            if kind.left() < SPECIAL / 2:
                break  # a slow answer, perhaps in another process: it is not called more often than it must
            args, expected, metric = self.exercise.plain_again[number]
            run = guard.run(self.function, args, lambda r, m=metric, e=expected: m.admit(r, e), self.exercise.limit)
            draws.append((args, expected, run.error is not None or not metric.equal(run.result, expected)))
        missed = [wrong for *_, wrong in draws]
        named = [(dict(zip(self._names(args), args)), expected) for args, expected, _ in draws]
        words = cases.case_words(named, missed)
        if words is None or not words.startswith("exactly"):
            given = [args for args, *_ in draws]
            words = own_steps.condition_words(self.function, given, missed, kind) or words
        was = "was not right" if stopped else "was wrong"
        return words and f"On {len(draws)} draws it {was} {words}."

    def _call(self, args):
        given = ", ".join(f"{name}={_short(arg)}" for name, arg in zip(self._names(args), args))
        return f"{self.exercise.id}({given})"

    def _names(self, args):
        """What the arguments are called: as in the student's function if it takes so many, else as in the reference."""
        own = getattr(self.function, "__code__", None)
        names = own.co_varnames[: own.co_argcount] if own else ()
        names = names if len(names) == len(args) else self.exercise.arguments
        return [names[k] if k < len(names) else f"argument {k + 1}" for k in range(len(args))]

    def _before(self, args):
        """That it was right before, and whether shapes may be what is different now."""
        shapes_before = [[np.shape(arg) for arg in others if isinstance(arg, np.ndarray)] for others in self.inputs]
        shape = [np.shape(arg) for arg in args if isinstance(arg, np.ndarray)]
        return BEFORE if shape in shapes_before else OTHER_SHAPES

    def _raised(self, run, args, words=None):
        error = run.error
        if isinstance(error, NotImplementedError):
            return self.outcome(TO_DO)
        if isinstance(error, guard.TimeLimit):
            text = (
                f"your code did not finish within {self.exercise.limit:g} s: is there a loop without an end,"
                " or one that tries far more than it must?"
            )
            return self.outcome(NOT_YET, text)
        if isinstance(error, scope.TwinCalled):
            return self.outcome(
                NOT_YET, f"your function calls the library's `{error}`: that is the function you are asked to write."
            )
        if isinstance(error, guard.Forbidden):
            return self.outcome(
                NOT_YET,
                f"your code calls {error}, which a checked function must not do: it gets its data as arguments.",
            )
        if isinstance(error, SystemExit):
            return self.outcome(NOT_YET, "your code calls exit(): a function ends with `return`.")
        if isinstance(error, TypeError) and not run.line and "argument" in run.said:
            wanted = ", ".join(self._names(args) if args else self.exercise.arguments)
            return self.outcome(NOT_YET, f"your function cannot be called with ({wanted}): {run.said}.")
        if isinstance(error, NameError) and error.name:
            where = f"\nin {run.line}" if run.line else ""
            hint = f"`{error.name}` is not known: has the cell that defines it been run since the kernel started?"
            return self.outcome(RAISED, f"NameError: {hint}{where}")
        if isinstance(error, RecursionError):
            return self.outcome(RAISED, "RecursionError: your function calls itself without an end.")
        said = run.said or WORDLESS.get(type(error), "" if isinstance(error, AssertionError) else "it says no more")
        if isinstance(error, AssertionError) and not said:
            said = "`assert` raises; an answer is handed over with `return`"
        handed = scope.handed_over(error, dict(zip(self._names(args), args)), self.exercise.reference)
        advice = handed or next((f". {told}" for words, told in ADVICE.items() if re.search(words, said)), "")
        if not (advice or args or run.line):
            advice = ". What your function returned could not be worked with."
        where = f"\nin {run.line}" if run.line else ""
        return self.outcome(RAISED, f"{type(error).__name__}: {said}{advice}{where}{self._given(error, args, words)}")

    def _given(self, error, args, words):
        """The call that raised, as a line; of a property, what it says it gave."""
        if not args:
            return f"\nwhen given {error.given}" if hasattr(error, "given") else ""
        told = f"\nwhen called as {self._call(args)}"
        if self.pairs and all(m and m.equal(r, e) for m, (r, e) in zip(self.metrics, self.pairs)):
            told += f"\n{_lead(words) or self._special_case(args) or self._before(args)}"
        return told + self._about_globals()


def _lead(words):
    """What an exercise says of the first special draw that fails, as a sentence, those behind it not tried; "" where it
    says nothing of its own.
    """
    return "" if words in (None, NOISY) else _in_ordinary_cases(f"{words[0].upper()}{words[1:].rstrip(':')}.")


def _in_ordinary_cases(text):
    """What is said to be right but for one kind of case, said of ordinary cases alone: other kinds may be wrong too."""
    return re.sub("^([Rr])ight, but not ", r"\1ight in ordinary cases, but not ", text)


def _is_row(value, rows):
    """Whether numbers are one row of an array."""
    value, rows = rerun.numeric(value), rerun.numeric(rows)
    if value is None or rows is None or not value.ndim or rows.shape[1:] != value.shape or len(rows) < 2:
        return False
    return any(np.array_equal(value, row) for row in rows)


def _failure(mistake, args):
    """What a wrong variant raises on a draw; None where it can compute it."""
    try:
        with np.errstate(all="ignore"):
            mistake.variant(*copy.deepcopy(args))
    except Exception as error:
        return error
    return None


def _are_one(results):
    """Whether results are one and the same, however small they are."""
    try:
        return all(_equal_arrays(result, results[0], atol=0.0) for result in results[1:])
    except (TypeError, ValueError):  # no numbers, but words or a set of them
        return all(type(result) in (str, set) and result == results[0] for result in results[1:])


def _has_loop(function):
    """Whether a function, or one within it, jumps back; so it may where its code is not known."""
    codes = [getattr(function, "__code__", None)]
    for code in codes:
        if not isinstance(code, types.CodeType):
            return True
        if any("JUMP_BACKWARD" in i.opname or i.opname == "FOR_ITER" for i in dis.get_instructions(code)):
            return True
        codes += [constant for constant in code.co_consts if isinstance(constant, types.CodeType)]
    return False


def _unread(function):
    """Names of the arguments that a function's code, and that of functions within it, never reads."""
    code = getattr(function, "__code__", None)
    if not isinstance(code, types.CodeType):
        return set()
    names = code.co_varnames[: code.co_argcount]
    loads = [i for i in dis.get_instructions(code) if i.opname.startswith("LOAD") and i.opname != "LOAD_CONST"]
    read = {name for i in loads for name in (i.argval if isinstance(i.argval, tuple) else (i.argval,))}
    return set(names) - read - set(code.co_cellvars)


def _could_change(one, other):
    """Whether an argument of one draw can be put in the place of another's, and makes another call of it."""
    if not all(isinstance(v, int | float | np.number | np.ndarray) and not isinstance(v, bool) for v in (one, other)):
        return False
    return np.shape(one) == np.shape(other) and not np.array_equal(one, other)


@dataclass(frozen=True)
class _Refusal:
    """A result the metric refused, kept because a named mistake may explain it (a transposed shape, say)."""

    value: object


def _admitted(metric, expected, result):
    try:
        return metric.admit(result, expected)
    except metrics.Refused:
        return _Refusal(result)


def _numbers_of(result):
    """The numbers of an admitted or refused result, as a copy; None where they are none, or too many."""
    value = result.value if isinstance(result, _Refusal) else result
    found = rerun.numeric(value)
    if found is not None or not isinstance(value, list | tuple):
        return found
    parts = [rerun.numeric(part) for part in value]  # of several results
    return np.concatenate([p.ravel() for p in parts]) if parts and not any(p is None for p in parts) else None


def _is_another(first, run):
    """Whether a word, a set or several results are others than before, or an error, at a second call."""
    if type(first) in (str, set, frozenset):
        return run.error is not None or run.result != first
    several = isinstance(first, list | tuple) and isinstance(run.result, list | tuple)
    pairs = [(rerun.numeric(a), rerun.numeric(b)) for a, b in zip(first, run.result)] if several else []
    return any(a is not None and b is not None and not _same_numbers(a, b) for a, b in pairs)


def _same_numbers(one, other):
    if one is None or other is None or one.shape != other.shape:
        return False
    return bool(np.allclose(one, other, rtol=1e-9, atol=1e-12, equal_nan=True))


def _equal_as_written(metric, result, wrong):
    """Whether a result equals a mistake's: by the metric, or as bare arrays where it refuses the mistake itself."""
    try:
        metric.admit(wrong, wrong)
    except metrics.Refused:
        return _equal_arrays(result, wrong)
    return metric.equal(result, wrong) or isinstance(metric, metrics.Poses) and _equal_arrays(result, wrong)


def _equal_arrays(a, b, atol=1e-12):
    if isinstance(b, tuple):
        return isinstance(a, tuple | list) and len(a) == len(b) and all(_equal_arrays(*ab, atol) for ab in zip(a, b))
    a, b = np.asarray(a), np.asarray(b)
    rtol = metrics.FLOAT32_TOLERANCE if metrics._is_single(a) or metrics._is_single(b) else 1e-9
    kind = complex if "c" in (a.dtype.kind, b.dtype.kind) else float
    return a.shape == b.shape and np.allclose(a.astype(kind), b.astype(kind), rtol=rtol, atol=atol, equal_nan=True)


WORDLESS = {  # what is raised without a word
    MemoryError: "your code asks for more memory than there is",
    KeyboardInterrupt: "the check was interrupted",
}
ADVICE = {  # what NumPy means, by a regular expression
    r"string to float: .*'[-+\d]*,": "`float` reads 1.5, but not 1,5: replace a decimal comma by a point first.",
    "must be square": "`solve` and `inv` need as many equations as unknowns; `lstsq` takes more.",
    "Singular matrix": "The equations do not fix all unknowns: is one missing, or there twice? Has a loop run off?",
    "Incompatible dimensions": "`lstsq` needs one right side a row of the matrix: is `.ravel()` missing?",
    "mismatch in its core dimension": "The inner sizes must agree, (n, k) @ (k, m); rows of vectors take `v @ R.T`.",
    "not aligned": "The inner sizes must agree, (n, k) @ (k, m); rows of vectors take `v @ R.T`.",
    "can be converted to Python scalars": "`math` and `float` take one number; `np.sin` and the like take arrays.",
    "inhomogeneous": "The parts of this array have different lengths.",
    "truth value of an array": "`if` takes one truth value; `np.where` chooses entry by entry.",
    "bitwise_xor": "`^` is no power in Python: write `**`.",
    r"for \^: ": "`^` is no power in Python: write `**`.",
    r"out of bounds for axis .* \d+$": "Indices count from 0; of a matrix the row comes first: [row, column].",
    "math domain error": "A root of a negative number, or an arccosine beyond 1, perhaps by rounding: see `np.clip`.",
    "requires a buffer of": "The format and the data differ in length: in `struct`, d takes 8 bytes, f takes 4.",
    "'list' object has no attribute": "A list is no array: `np.array(...)` makes one of it.",
    "float' object has no attribute": "Here stands a single number, and no array.",
    "float64' object has no attribute": "Here stands a single number, and no array.",
    "float' object is not subscriptable": "Brackets take an entry out of several: here stands a single number.",
    "remapped shapes": "In `einsum` one letter has one length: here a letter stands for two.",
    "could not be broadcast": "Entry by entry these shapes do not fit: is `@` meant, is a sum over an axis missing?",
}


def _whole(value):
    """A number, word, set or short vector as it is shown whole; None for anything larger."""
    value = value.item() if isinstance(value, np.ndarray) and not value.ndim else value
    if isinstance(value, set | frozenset):
        plain = len(value) <= SHOWN and all(type(v) in (int, float, str) for v in value)
        words = ", ".join(sorted(map(_short, value), key=lambda text: (len(text), text))) if plain else ""
        return f"{{{words}}}" if words else None if value else "set()"
    if isinstance(value, np.ndarray) and value.ndim == 1 and 0 < value.size <= SHOWN:
        return _short(value)
    return _short(value) if isinstance(value, str | int | float | np.generic) else None


def _plain(value):
    """A value with NumPy's numbers and words, within it too, as Python's, which are shown as one types them."""
    if isinstance(value, np.generic):
        return value.item()
    return type(value)(map(_plain, value)) if type(value) in (list, tuple, set) else value


def _short(value):
    """An argument in a few characters."""
    value = _plain(value)
    if isinstance(value, np.ndarray):
        if value.size > 16:
            return f"<array of shape {value.shape}>"
        tiny = value.dtype.kind == "f" and 0 < np.abs(value).max(initial=0.0) < 1e-3
        words = np.array2string(value, precision=3, suppress_small=not tiny, separator=", ", max_line_width=100)
        return words.replace("\n", "")
    if inspect.isfunction(value):
        return value.__name__
    if isinstance(value, np.random.Generator):
        return "<Generator>"
    text = f"{value:.6g}" if isinstance(value, float) else repr(value)
    return text if len(text) <= 60 else f"<{type(value).__name__}>"


def _bare(): ...


def _told():
    """A docstring and nothing else."""


_BLANK_CODES = {_bare.__code__.co_code, _told.__code__.co_code}


def is_blank(answer):
    """Whether nothing has been written: `...`, None, or a function whose body is `...` or `pass`."""
    if answer is None or answer is ...:
        return True
    if not isinstance(answer, types.FunctionType):
        return False
    code = answer.__code__
    return code.co_code in _BLANK_CODES and all(constant is None for constant in code.co_consts[1:])


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
               answer may be both.
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
            return Outcome(NOT_YET, _closed(_for_value(run.error)) + _of_shape(answer, expected))
        if run.error is not None:
            return Outcome(NOT_YET, f"expected a number{self._in_unit()}, got {metrics._describe(answer)}.")
        return self._compare(metric, run.result, expected)

    def _mistake(self, answer, is_it, near=False):
        """The first mistake whose value `is_it` finds in the answer, or which the answer is near enough to."""
        for k, mistake in enumerate(self.mistakes):
            wrong = mistake.variant()
            if is_it(answer, wrong) or near and mistake.within and abs(answer - wrong) <= mistake.within:
                return Outcome(NOT_YET, mistake.text, k)
        return None

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
        if run.error is not None:
            text = (
                _for_value(run.error)
                if isinstance(run.error, metrics.Refused)
                else f"{type(run.error).__name__}: {run.said}"
            )
            return Outcome(NOT_YET, _closed(text) + _of_shape(answer, expected))
        return self._compare(metric, run.result, expected)

    def _compare(self, metric, answer, expected):
        """Right, or a mistake to its own digits, or what the general layer says; rounded answers need `digits`.

        A mistake is compared by itself, not with the tolerance of right answers: a number near it is not it.
        """
        exact = metrics.Numbers(1e-9)
        is_right = metric.equal(answer, expected)
        named = None if exact.equal(answer, expected) else self._mistake(answer, exact.equal)
        if named:
            return named
        digits = 0 if _is_whole(expected) else relations.significant_digits(answer, expected)
        if is_right or digits >= self.digits:
            return Outcome(CORRECT)
        named = self._mistake(
            answer, lambda a, w: relations.significant_digits(a, w) >= max(self.digits, digits + 1), near=True
        )
        if named:
            return named
        if digits > 1:
            least = f"at least {self.digits} digits are needed"
            return Outcome(NOT_YET, f"right as far as it goes: {least}, so hand over the computed value.")
        words = relations.difference_words(metric, [(answer, expected)]) or self._made_otherwise(answer)
        words = words or self._changed(metric, answer, expected) or relations.ratio_words(answer, expected)
        words = words or self._follows(answer)
        return Outcome(NOT_YET, _closed(words) if words else self._which_way(answer, expected))

    def _follows(self, answer):
        """What would follow from the answer, in words; None where the Value does not tell, or nothing can."""
        if self.about is None or not np.isfinite(answer).all():
            return None
        with contextlib.suppress(ValueError, ArithmeticError), np.errstate(all="ignore"):
            return self.about(answer)

    def _changed(self, metric, answer, expected):
        """Which change of the solution's computation gives it."""
        return regions.change_words(self, answer, lambda found: metric.equal(found, expected), LOOKING / 2)

    def _made_otherwise(self, answer):
        """Which other number of the same data it is."""
        if np.ndim(answer) or not self.of:
            return None
        return quantities.quantity_words(float(answer), {name: data() for name, data in self.of.items()})

    def _which_way(self, answer, expected):
        if np.ndim(expected):
            right = _right_entries(answer, expected)
            return f"not this value{self._in_unit()}{right}: the hints lead on."
        if not np.isfinite(answer):
            return f"not this value{self._in_unit()}: the hints lead on."
        size = "large" if abs(answer) > abs(expected) else "small"
        if answer * expected < 0:
            return f"not this value{self._in_unit()}, and it should have the other sign: the hints lead on."
        return f"not this value{self._in_unit()}: yours is too {size}. The hints lead on."

    def _in_unit(self):
        return f" in {self.unit}" if self.unit else ""


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


def _of_shape(answer, expected):
    """What an answer of the wrong shape has to do with the expected one, as one more sentence."""
    words = shapes.shape_words([answer], [expected])
    return f" {words[0].upper()}{words[1:].replace('you return', 'you hand over')}." if words else ""


def _closed(sentence):
    """The sentence with a period, unless it ends already."""
    return sentence if sentence[-1:] in ".?:" else f"{sentence}."


def _is_whole(expected):
    """Whether numbers are counts, which nobody rounds."""
    return bool(np.all(np.asarray(expected) == np.round(expected)))


def _for_value(refusal):
    return str(refusal).replace("it returned None: is a `return` missing?", "got None").replace("it returned", "got")


@dataclass(frozen=True)
class Prediction(Item):
    """A question to be answered before a figure is shown; the first answer is locked in.

    choices: the possible answers, one of them `answer`; empty for a number in `unit`, right within the relative
             distance `within`.
    why:     one or two sentences that say what the figure will show.
    """

    question: str
    answer: object
    choices: tuple = ()
    why: str = ""
    unit: str = ""
    within: float = 0.2

    def __post_init__(self):
        super().__post_init__()
        if self.choices and self.answer not in self.choices:
            raise ValueError(f"prediction {self.id!r}: the answer {self.answer!r} is none of the choices")

    def read(self, answer):
        """The choice (or number) that an answer means; raises ValueError with the possible ones."""
        if not self.choices:
            try:
                return float(answer)
            except (TypeError, ValueError):
                raise ValueError(
                    f"expected a number{' in ' + self.unit if self.unit else ''}, got {answer!r}"
                ) from None
        for choice in self.choices:
            if str(answer).strip().lower() == str(choice).lower():
                return choice
        raise ValueError(f"expected one of: {'; '.join(map(str, self.choices))}. Got {answer!r}")

    def is_right(self, answer):
        if self.choices:
            return answer == self.answer
        return abs(answer - self.answer) <= self.within * abs(self.answer)


@dataclass(frozen=True)
class Chapter:
    """A chapter's exercises in the order of its notebook; `name` is "NN-name" for the notebook NN_name.

    `further` are the ids of those that stand beyond the core path, in sections marked *further*.
    """

    name: str
    items: tuple = field(default_factory=tuple)
    title: str = ""
    further: tuple = ()

    def __post_init__(self):
        object.__setattr__(self, "items", tuple(self.items))
        object.__setattr__(self, "further", tuple(self.further))
        object.__setattr__(self, "title", self.title or self.name.partition("-")[2].replace("-", " ").capitalize())
        for item in self.items:
            object.__setattr__(item, "chapter", self)
        ids = [item.id for item in self.items]
        double = {i for i in ids if ids.count(i) > 1}
        taken = {"predict", "progress", "chapter", "after"} & set(ids)
        if double or taken:
            raise ValueError(f"chapter {self.name}: the exercise id {min(double | taken)!r} is taken")
        if set(self.further) - set(ids):
            raise ValueError(f"chapter {self.name}: {min(set(self.further) - set(ids))!r} is none of its exercises")

    def __getitem__(self, id):
        for item in self.items:
            if item.id == id:
                return item
        raise KeyError(id)

    @property
    def notebook(self):
        return self.name.replace("-", "_")
