"""Exercises as the lecturer writes them, and how an answer is judged.

An `Exercise` is a reference function, a random draw of its arguments, a metric, three hints, and a list of
`Mistake`s: wrong variants of the reference, each with the sentence a student needs who made exactly this mistake.
`judge` is pure: it runs an answer and returns an `Outcome`. What is displayed, remembered and bound to a name is the
business of `session`.
"""

import functools
import inspect
import itertools
from dataclasses import dataclass, field

import numpy as np

from . import guard, metrics, scope
from .again import Again
from .evidence import MORE_CASES
from .outcome import CORRECT, NOT_YET, TO_DO, Item, Outcome, is_blank
from .sizes import right_in_all_sizes
from .trial import Trial
from .whole import WholeNumbers
from .wording import NOISY, closed

TOTAL_TIME = 4.0  # seconds: a slow but correct function gets fewer draws of each kind


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
    sizes:      arguments that may be of any size, as a check asks as well; those in one string change together.
    draws:      how many draws a check takes; 0 where the properties alone judge.
    limit:      seconds that one call may take.
    about:      function(result, *arguments) -> what is true of a wrong result that nothing else explains, in a sentence
                without numbers, told where all draws are wrong and have the same; None where there is nothing.
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
    sizes: tuple = ()
    draws: int = 5
    limit: float = guard.TIME_LIMIT
    about: object = None

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

    @functools.cached_property
    def in_all_sizes(self):
        """The property that arguments may be far larger or smaller than others."""
        return right_in_all_sizes(self)

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
        trial, seen = Trial(self, function), []
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
                return trial.outcome(NOT_YET, closed(words))
            for holds in (*self.properties, self.whole, self.in_all_sizes):
                problem = trial.property(holds, rng)
                if problem:
                    return problem
        return verdict

    def _plan(self):
        """(draw, metric, words) of every draw; words are None for the plain ones."""
        noisy = [(draw, metric, *(words or (NOISY,))) for draw, metric, *words in self.noisy]
        return [(draw, self.metric, None) for draw in itertools.islice(itertools.cycle(self.cases), self.draws)] + noisy


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
