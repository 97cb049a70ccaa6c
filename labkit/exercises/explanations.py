"""What is said of a wrong answer that is no named mistake: from what explains it whole to how far it is off."""

import ast
import copy
import dis
import functools
import itertools
import re
import types

import numpy as np

from . import arguments, budget, cases, guard, metrics, operands, relations, rerun, scope, shapes, slips
from . import steps as own_steps
from .budget import Budget
from .named import MORE_DRAWS, Named
from .outcome import Mistake
from .results import Refusal, admitted_by, are_one, could_change, equal_as_written, is_row, numbers_of
from .wording import closed, leading, on_ordinary_draws, short, shown_whole

NOT_RIGHT = "\nNot right when called as "
MORE_ACCURATE = ": is a case special there, or is it nearly right everywhere, and accurate enough there alone?"
MANY_DIGITS = 1e-3  # by how much better some draws come out where one case is special
EXCHANGED = 6  # draws with one argument from others, on which it is tried whether that argument matters
TELLING = 6  # draws on which a choice is wrong as by an explanation, so that this is not chance
LIKE_CHANCE = 8  # draws on which a choice must stay as it is, so that this is not chance
RANDOM = {"default_rng", "random", "normal", "standard_normal", "multivariate_normal", "RandomState", "gauss"}
BY_CHANCE = 0.3  # how far off, relatively, a result made of random numbers may be by chance


class Explanations(Named):
    """Each says one kind of thing about the answer, or nothing."""

    def _of_some(self, text):
        """What is said of one special draw, as it is true where those of another kind are wrong as well."""
        wrong = {words for m, pair, words in zip(self.metrics, self.pairs, self.words) if words and not m.equal(*pair)}
        return on_ordinary_draws(text) if len(wrong) > 1 else text

    def _where_it_is_wrong(self):
        """What the draws on which it is wrong have in common, as one more sentence, where it is right on others."""
        words = self._special_case() if self._right_somewhere() else None
        return f" {words}" if words else ""

    def _relation(self, whole=False):
        """What the general layer says of the results; nothing where one was refused, or only special ones are wrong."""
        if self.refusal or self.exercise.metric is None or self._right_on_plain():
            return None
        arrays = [arg for args in self.inputs for arg in args if isinstance(arg, np.ndarray)]
        sizes = {n for array in arrays for n in (*array.shape, array.size)}
        tell = functools.partial(relations.difference_words, self.exercise.metric, sizes=sizes, whole=whole)
        words = tell(self._plain_pairs())
        fresh = [pair for *_, pair in self._fresh_results if not isinstance(pair[0], Refusal)] if words else []
        words = tell(self._plain_pairs() + fresh) if fresh else words
        return words if words is None or has_loop(self.function) else words.replace(relations.LOOP, "")

    def _other_arguments(self):
        """Whether the results are right for arguments changed in one respect, with these in words."""
        if self.exercise.metric is None or not self.inputs:
            return None
        cases = self._cases()
        read = scope.notebook_data(self.function)
        notebook = {name: self.function.__globals__[name] for name in read}
        tried = arguments.changes(self._names(self.inputs[0]), [case[0] for case in cases], notebook)
        reference = self.exercise.reference
        if self._is_always_the_same() or self._holds_no_number() or self._one_truth():
            return None
        told = ((words, change) for words, change in self._of_no_size(tried) if self._is_felt(change))
        words = self._first_that_fits((words, lambda *args, c=change: reference(*c(args))) for words, change in told)
        return words and f"your result is what comes out {words}"

    def _of_no_size(self, tried):
        """Of (words, function) those that change no size, where words, truth values or sets are expected: another size
        would do as well.
        """
        sized = not all(isinstance(expected, str | bool | set | frozenset) for _, expected in self.pairs)
        return (pair for pair in tried if sized or not arguments.SIZES.search(pair[0]))

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
        draws, kind = self._cases(), self.budget.part()
        for words, function in variants:
            if not kind.left():
                return None
            mistake = Mistake(function, words)
            begun = self._fits_within(kind.share().left(), mistake, draws[:1])
            if begun and self._fits_within(kind.left(), mistake, draws[1:]) and self._fits_more(function):
                return words
        return None

    def _fits_within(self, seconds, mistake, draws):
        """Whether a variant gives the student's results in so many seconds: it may well have a loop without an end."""
        try:
            with guard.time_limit(seconds):
                return all(self._is_mistake(mistake, *draw) for draw in draws)
        except guard.TimeLimit:
            return False

    def _fits_more(self, function):
        """Whether a variant gives the student's results on fresh draws as well."""
        mistake, draws = Mistake(function, ""), self._fresh_results
        wrong = sum(not metric.equal(*pair) for _, metric, pair in self._cases() + draws)
        if self._is_choice() and wrong < TELLING or self._is_one_truth_nearly():
            return False
        try:
            with guard.time_limit(self.budget.left()):
                return all(self._is_mistake(mistake, *draw) for draw in draws) and self._is_it_again(mistake)
        except guard.TimeLimit:
            return False

    def _is_one_truth_nearly(self):
        """Whether of truth values one came out on hardly any draw, so that many a rule would give them."""
        results = [pair[0] for *_, pair in self._cases() + self._fresh_results]
        truths = all(type(result) is bool for result in results)
        return truths and min(map(results.count, (True, False))) < TELLING

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
        return "\n".join(map(closed, told)) or None

    def _solution(self, search):
        return own_steps.of_solution(self.exercise, search.cases, self.budget)

    def _search(self):
        """What looks for the step of the student's own code at which it goes wrong; None where it cannot be read."""
        if self.exercise.metric is None or not self.inputs:
            return None
        drawn = [
            own_steps.Case(args, metric, pair[1], refused=pair[0].value)
            if isinstance(pair[0], Refusal)
            else own_steps.Case(args, metric, pair[1], pair[0])
            for args, metric, pair in zip(self.inputs, self.metrics, self.pairs)
        ]
        return own_steps.search(self.function, self._names(self.inputs[0]), drawn, self._judging(), self.budget)

    def _one_change(self):
        """Whether the results are those of a right formula with one change, with this in words."""
        if self.exercise.metric is None or not self.inputs or self._is_always_the_same() or self._is_told_apart():
            return None
        if self._holds_no_number() or self._never_said() or self._one_truth():
            return None
        words = self._first_that_fits(self._of_no_size(slips.changed_formulas(self.exercise)))
        return words and f"your result is what a right formula gives {words}"

    def _picked(self):
        """Whether all results are rows of one argument, as they came, in words; None where they are not."""
        wrong = [(args, *pair) for args, metric, pair in self._cases() if not metric.equal(*pair)]
        for k, name in enumerate(self._names(wrong[0][0]) if len(wrong) > 1 else ()):
            if all(is_row(result, args[k]) and not is_row(expected, args[k]) for args, result, expected in wrong):
                return f"your result is one of the rows of `{name}` as it came, and the right one is none of them"
        return None

    def _never_said(self):
        """Which of several words came out on no plain draw, though it is right on some."""
        pairs = self._plain_pairs()
        words = all(isinstance(word, str) for pair in pairs for word in pair)
        if not words or not self._right_somewhere():  # as long as nothing is right, no right word is told
            return None
        said = {result for result, _ in pairs}
        lacking = list(dict.fromkeys(f"`{expected!r}`" for _, expected in pairs if expected not in said))
        if len(lacking) > 1:
            return f"{', '.join(lacking[:-1])} and {lacking[-1]} came out on no draw, though each is right on some"
        return f"{lacking[0]} came out on no draw, though it is right on some" if lacking else None

    def _one_truth(self):
        """That arrays of truth values hold one of the two alone, which many a wrong computation gives."""
        pairs = self._plain_pairs()
        parts = [part for pair in pairs for part in pair]
        if not all(isinstance(part, np.ndarray) and part.dtype.kind == "b" and part.ndim for part in parts):
            return None
        mine, right = ({bool(truth) for array in arrays for truth in array.flat} for arrays in zip(*pairs))
        return f"every entry of your result is {mine.pop()}, on every draw" if len(mine) < len(right) else None

    def _is_told_apart(self):
        """Whether special draws alone are wrong of which the exercise says what they are: on a few draws of one kind
        many a change of the solution comes to the same.
        """
        pairs = zip(self.metrics, self.pairs, self.words)
        return self._right_on_plain() and any(leading(words) and not m.equal(*pair) for m, pair, words in pairs)

    def _other_shape(self):
        """What results of a wrong shape have to do with the expected ones."""
        if self._is_always_the_same():
            return ""
        metric, pairs = self.exercise.metric, self._plain_pairs()
        if not all(isinstance(r, Refusal) or metric is not None and metric.equal(r, e) for r, e in pairs):
            return ""
        pairs = [pair for pair in pairs if isinstance(pair[0], Refusal)]  # in one size it may be right
        results = [result.value for result, _ in pairs]
        if not results or any(result is None for result in results):
            return ""
        names = getattr(self.exercise.metric, "names", ())
        words = shapes.shape_words(results, [expected for _, expected in pairs], names)
        named = words and words.partition(":")[0] in names
        return f" {words if named else words[0].upper() + words[1:]}." if words else ""

    def _one_shape(self):
        """That results have one shape where expected ones have several, some of them smaller, as one more sentence."""
        pairs = [(numbers_of(result), rerun.numeric(expected)) for result, expected in self._plain_pairs()]
        if any(r is None or e is None or r.ndim != e.ndim for r, e in pairs):
            return ""
        one = len({r.shape for r, _ in pairs}) == 1 < len({e.shape for _, e in pairs})
        larger = any(r.size > e.size for r, e in pairs)
        return " It has this shape on every draw, whatever is given: is a size typed in?" if one and larger else ""

    def _unmoved(self):
        """An argument that makes no difference to the results, though it should."""
        draws = self._cases()
        if self.exercise.metric is None or not draws or not self.budget.left():
            return None
        if words := self._one_truth():
            return words
        told = dict.fromkeys(rerun.read_for_size(self.function), "uses only the size of")
        told |= dict.fromkeys(unread_arguments(self.function), "never uses")
        names = self._names(draws[0][0])
        for k, name in enumerate(names):
            if name in told and any(self._moves(k, *pair) for pair in self._exchanges(k, draws)):
                return f"your function {told[name]} `{name}`, and the result should change with `{name}`"
        if self._is_nothing_but_zeros():
            return "your result is nothing but zeros, on every draw of this check"
        for k, name in enumerate(names):
            least = LIKE_CHANCE if self._is_choice() else 2
            if self._makes_no_difference(k, draws) and self._makes_no_difference(k, draws + self._fresh_results, least):
                return f"your result did not change with `{name}` on any draw of this check, and it should"
        return None

    def _exchanges(self, k, draws):
        """(draw, its arguments with the k-th of another one) of every draw; the next that has another one like it."""
        for i, (args, *_) in enumerate(draws):
            others = next((o for o, *_ in draws[i + 1 :] + draws[:i] if could_change(args[k], o[k])), None)
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
        if len(results) < 2 or are_one(expected) or not are_one(results):
            return ""
        return " Your result is the same on every draw, the right one is not: is it typed in, or made of other data?"

    def _by_chance(self):
        """That a result which is nearly right comes of random numbers, as one more sentence."""
        drawn = RANDOM & scope.co_names(self.function)
        if not drawn or "rng" in self.exercise.arguments or isinstance(self.exercise.metric, metrics.Exactly):
            return ""
        numbers = [(numbers_of(r), numbers_of(e)) for r, e in self._plain_pairs()]
        if any(r is None or e is None or np.shape(r) != np.shape(e) for r, e in numbers):
            return ""
        if any(np.linalg.norm(np.subtract(r, e)) > BY_CHANCE * np.linalg.norm(e) for r, e in numbers):
            return ""
        return " Your function draws random numbers, so part of this may be chance: is there a way without them?"

    def _about(self):
        """What the exercise tells of results that are wrong on every draw, by more than digits: one more sentence."""
        if self.exercise.about is None or self.refusal or self._right_somewhere():
            return ""
        worst = self._worst(self._plain_pairs())
        if worst is None or relations.not_accurate_enough(worst):
            return ""
        wrong = [(pair[0], args) for args, metric, pair in self._cases() if not metric.equal(*pair)]
        try:
            with np.errstate(all="ignore"), guard.only_finite_matrices():
                told = {self.exercise.about(result, *copy.deepcopy(args)) for result, args in wrong}
        except Exception:  # not every result can be asked
            return ""
        words = told.pop() if len(told) == 1 else None
        return f" {words}" if words else ""

    def _makes_no_difference(self, k, draws, least=0):
        """Whether the k-th argument, taken from the next draw, changes the reference's results, never the student's."""
        tried = 0
        for draw, changed in self._exchanges(k, draws):
            moved = self._moves(k, draw, changed)
            if moved is None:
                continue
            run = guard.run(self.function, changed, limit=self.exercise.limit)
            if not moved or run.error is not None or not equal_as_written(draw[1], run.result, draw[2][0]):
                return False
            tried += 1
        return tried >= least

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
        shown = max(missed, key=lambda draw: _times_off(self._worst([draw[1:]])))
        example = self._example(*shown, len(missed) < len(pairs))
        own = isinstance(metric, metrics.Exactly) and type(metric).deviations is not metrics.Exactly.deviations
        words = None if own else cases.result_words(pairs) or relations.both_parts_words(metric, pairs)
        if 0 < len(missed) < len(pairs) and (axes := relations.turned_axes(metric, [pair for _, *pair in missed])):
            words = f"{axes} where the result is wrong"
        told = closed(words or str(self._worst([shown[1:]]) if example else most))
        if len(missed) == len(pairs):
            side = cases.side_words(pairs) and cases.side_words([pair for *_, pair in self._fresh_results])
            told = f"{told[:-1]}, and {side}." if side else told
            return told + self._right_parts() + example
        special = self._special_case()
        asked = (
            ", perhaps by chance."
            if self._is_choice()
            else MORE_ACCURATE
            if near
            else ": what is different about the others?"
        )
        named = None if special or near else self._named_elsewhere()
        asked = f". Where it is wrong: {named}" if named else asked
        right = special or f"It was right on {len(pairs) - len(missed)} of {len(pairs)} draws{asked}"
        return f"{told} {right}{example}"

    def _worst(self, pairs):
        """The deviation that is farthest beyond its tolerance; None where none is."""
        off = [d for pair in pairs for d in self.exercise.metric.deviations(*pair) if not d.within]
        return max(off, key=_times_off, default=None)

    def _example(self, args, result, expected, somewhere_right):
        """One call that did not come out right, with what it gives, if all can be shown whole; the right result is told
        where it is one of some words, a number stays to be found. What is shown is what comes of the digits that are
        shown: who types them gets it.
        """
        call = self._call(args)
        if "<" not in call:
            typed = self._as_typed(args)
            if typed is not None and self.exercise.metric.equal(*typed):
                return ""
            result, expected = typed or (result, expected)
        mine = shown_whole(result)
        if "<" in call or mine is None:
            kinds_alone = re.fullmatch(r"\w+\((\w+=<\w+>(, )?)*\)", call)
            return f"{NOT_RIGHT}{call}" if somewhere_right and not kinds_alone else ""
        tells = isinstance(expected, str) and self._right_somewhere()
        right = f", and {shown_whole(expected)} is right" if tells else ""
        return f"{NOT_RIGHT}{call}: it gives {mine}{right}"

    def _as_typed(self, args):
        """(result, expected) for the digits of the arguments that a call shows; None where one of both fails there."""
        try:
            args = [_as_shown(arg) for arg in args]
            expected = self.exercise.reference(*copy.deepcopy(args))
        except Exception:  # infinity is no digits, and of digits that are left no matrix need be a rotation
            return None
        admitted = functools.partial(admitted_by, self.exercise.metric, expected)
        run = guard.run(self.function, args, admitted, self.exercise.limit)
        return None if run.error is not None or isinstance(run.result, Refusal) else (run.result, expected)

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
        kind = Budget(max(budget.SPECIAL, self.budget.left()))
        for number in range(MORE_DRAWS):
            if kind.left() < budget.SPECIAL / 2:
                break  # a slow answer, perhaps in another process: it is not called more often than it must
            args, expected, metric = self.exercise.plain_again[number]
            run = guard.run(self.function, args, lambda r, m=metric, e=expected: m.admit(r, e), self.exercise.limit)
            draws.append((args, expected, run.error is not None or not metric.equal(run.result, expected)))
        missed = [wrong for *_, wrong in draws]
        named = [(dict(zip(self._names(args), args)), expected) for args, expected, _ in draws]
        words = cases.case_words(named, missed, functools.partial(self._follows, draws, kind))
        if words is None or not words.startswith("exactly"):
            given = [args for args, *_ in draws]
            words = own_steps.condition_words(self.function, given, missed, kind) or words
        was = "gave no right result" if stopped else "was wrong"
        return words and f"On {len(draws)} draws it {was} {words}."

    def _follows(self, draws, kind, name, true):
        """Whether an answer that is wrong on some of (arguments, expected, wrong) where something is true of the
        argument of this name comes right with that argument from others, as far as this can be tried in the time.
        """
        k = self._names(draws[0][0]).index(name)
        others = [args for (args, *_), has in zip(draws, true) if not has]
        mixed = (
            (*args[:k], other[k], *args[k + 1 :])
            for args, _, wrong in draws
            for other in others
            if wrong and np.shape(other[k]) == np.shape(args[k])
        )
        tried = itertools.takewhile(lambda _: kind.left(), itertools.islice(mixed, EXCHANGED))
        return all(self._is_right_for(args) is not False for args in tried)

    def _is_right_for(self, args):
        """Whether the answer is right for arguments of several draws; None where they do not go together."""
        metric = self.exercise.metric
        try:
            with np.errstate(all="ignore"):
                expected = self.exercise.reference(*copy.deepcopy(args))
            metric.admit(expected, expected)
        except Exception:  # what was drawn for other arguments may well not fit
            return None
        return self._is_right_on(self.function, args, metric, expected)


def _times_off(deviation):
    """How many tolerances something is off."""
    return deviation.amount / max(deviation.tolerance, 1e-300)


def has_loop(function):
    """Whether a function, or one within it, jumps back; so it may where its code is not known."""
    codes = [getattr(function, "__code__", None)]
    for code in codes:
        if not isinstance(code, types.CodeType):
            return True
        if any("JUMP_BACKWARD" in i.opname or i.opname == "FOR_ITER" for i in dis.get_instructions(code)):
            return True
        codes += [constant for constant in code.co_consts if isinstance(constant, types.CodeType)]
    return False


def unread_arguments(function):
    """Names of the arguments that a function's code, and that of functions within it, never reads."""
    code = getattr(function, "__code__", None)
    if not isinstance(code, types.CodeType):
        return set()
    names = code.co_varnames[: code.co_argcount]
    loads = [i for i in dis.get_instructions(code) if i.opname.startswith("LOAD") and i.opname != "LOAD_CONST"]
    read = {name for i in loads for name in (i.argval if isinstance(i.argval, tuple) else (i.argval,))}
    return set(names) - read - set(code.co_cellvars)


def _as_shown(value):
    """A number or an array of the digits in which it is shown; anything else as it is."""
    if isinstance(value, np.ndarray):
        return np.array(ast.literal_eval(short(value)), dtype=value.dtype)
    return float(short(value)) if isinstance(value, float) else value
