"""Judges one submitted notebook: it runs in a worker, and what it hands in is judged here, where nothing of it runs.

This process alone holds references, draws, metrics and mistakes. The engine's own `judge` does the judging: it is given
a `Remote` in place of the student's function.
"""

import contextlib
import hashlib
import importlib
import time
from dataclasses import dataclass, field

import numpy as np

from ..exercises import budget, guard, session
from ..exercises.engine import Exercise, Prediction
from ..exercises.outcome import CORRECT, NOT_YET, RAISED, TO_DO, Outcome
from ..exercises.value import Value
from ..tables import DATA
from . import library, sandbox, wire
from .border import Border, run_trusted
from .worker import FIGURES

SILENCE = 30.0  # seconds that a cell may compute without handing anything in
WHOLE = 240.0  # seconds for all of a notebook
TURNS = 6  # times that a notebook is run, without the cells that stopped it
LOOKING = 4.0  # seconds in which an explanation is looked for: what a notebook finds is found here too
HANDED = 25  # times that one exercise may be handed in
LIBRARY = "library"  # the status of an answer that is not the student's own
NOT_REACHED, PREDICTED, UNREADABLE = "not reached", "predicted", "not a choice"
SHOWN = 40  # cells that raised are listed up to this number


@dataclass
class Verdicts:
    """What came out for one notebook: an `Outcome` an exercise, what was predicted, and what went wrong on the way."""

    outcomes: dict = field(default_factory=dict)
    predictions: dict = field(default_factory=dict)
    alike: dict = field(default_factory=dict)
    failed: list = field(default_factory=list)
    stopped: list = field(default_factory=list)


@dataclass
class Plan:
    """What a second run of a notebook does otherwise: leaves cells out, settles exercises, withholds values."""

    skip: set = field(default_factory=set)
    settled: dict = field(default_factory=dict)
    withheld: set = field(default_factory=set)


def judge(chapter, cells, seed, key):
    """The `Verdicts` on the code cells of one notebook; draws follow from `seed` and `key`, which names the file."""
    plan, until = Plan(), time.monotonic() + WHOLE
    budget.LOOKING = LOOKING
    stopped = []
    for _ in range(TURNS):
        run = Session(chapter, seed, key, plan)
        ended = run.run(cells, until)
        if ended:
            stopped.append(run.settle(plan, ended))
            if time.monotonic() > until or ended.startswith(wire.NOT_STARTED):
                break
        elif run.given & run.again - plan.withheld:
            plan.withheld |= run.given & run.again
        else:
            break
    run.verdicts.stopped = stopped
    return run.verdicts


class Session:
    """One run of one notebook."""

    def __init__(self, chapter, seed, key, plan):
        self.chapter, self.plan, self.verdicts = chapter, plan, Verdicts()
        self.items = {item.id: item for item in chapter.items}
        self.answers = library.answers(chapter.name)
        self.library = sorted({name for names in self.answers.values() for name in names})
        self.seed = [seed, *hashlib.sha256(f"{chapter.name} {key}".encode()).digest()]
        self.handed, self.given, self.again = dict.fromkeys(self.items, 0), set(), set()
        self.cell, self.judging, self.called, self.last = None, None, "", {}

    def run(self, cells, until):
        """Run the notebook; returns "" or what ended it early."""
        with sandbox.worker() as process:
            self.border = Border(process.stdout.fileno(), process.stdin.fileno(), self._run_trusted, SILENCE)
            self.border.line.until = until
            handlers = ("cell", "failed", "blank", "hand", "predict", "library", "constant", "compute")
            self.border.handlers |= {name: getattr(self, f"_{name}") for name in handlers}
            try:
                self.border.ask("prepare", **self._equipment())
            except Exception as error:
                return wire.NOT_STARTED if isinstance(error, wire.Gone) else f"{wire.NOT_STARTED}: {error}"
            try:
                self.border.ask("run", cells=cells, skip=self.plan.skip)
                self._judge_again()
            except Exception as error:
                return str(error) or type(error).__name__
            return ""

    def _equipment(self):
        package = sandbox.PACKAGE
        secret = [str(path) for path in (*sandbox.hidden(), package / "collect" / "judge.py", session.SOLUTIONS)]
        secret += sorted({f"{package.parent}/{name.rpartition('.')[0].replace('.', '/')}.py" for name in self.library})
        secret += [f"{folder}/__pycache__" for folder in sandbox.folders()]  # there they lie as well, compiled
        bwrap, _ = sandbox.bubblewrap()
        exercises = [id for id, item in self.items.items() if not isinstance(item, Prediction)]
        return {
            "chapter": self.chapter.name,
            "exercises": exercises,
            "references": {id: item.reference for id, item in self.items.items() if isinstance(item, Exercise)},
            "library": self.library,
            "secret": secret,
            "readable": [str(package), str(DATA)],
            "own": "/tmp" if bwrap else "",
        }

    def settle(self, plan, why):
        """After a run that was ended: what stopped it is left out of the next; returns a sentence on it."""
        late = why == wire.LATE
        if self.judging:
            limit = self.items[self.judging].limit if hasattr(self.items[self.judging], "limit") else guard.TIME_LIMIT
            text = (
                f"your code did not finish within {limit:g} s, and could not be interrupted."
                if late
                else "your code ended the process that ran it."
            )
            plan.settled[self.judging] = Outcome(NOT_YET if late else RAISED, text)
            return f"exercise {self.judging}: {text}"
        if self.cell is None:
            return why
        plan.skip.add(self.cell)
        took = f"did not end within {SILENCE:g} s" if late else f"ended the process ({why})"
        return f"code cell {self.cell + 1} {took} and was left out"

    # what the worker asks

    def _cell(self, parts, number):
        self.cell = int(number)
        return {}

    def _failed(self, parts, number, error):
        if len(self.verdicts.failed) < SHOWN:
            self.verdicts.failed.append([int(number), str(error)[: wire.LONGEST]])
        return {}

    def _item(self, id):
        if self.judging:
            raise RuntimeError(f"{self.judging} is being judged: nothing else can be handed in meanwhile")
        item = self.items.get(id)
        if item is None:
            raise AttributeError(f"there is no exercise {str(id)[:80]!r} in this chapter")
        self.handed[id] += 1
        if self.handed[id] > HANDED:
            raise RuntimeError(f"{id} is handed in more than {HANDED} times")
        if self.handed[id] > 1:
            self.again.add(id)
        return item

    def _blank(self, parts, id):
        item = self._item(id)
        self.verdicts.outcomes.setdefault(id, Outcome(TO_DO))
        return {"value": self._reference(item, parts)}

    def _hand(self, parts, id, answer, unit):
        item = self._item(id)
        outcome = self.plan.settled.get(id) or self._judged(item, answer, unit)
        self.verdicts.outcomes[id] = outcome
        self.last[id] = answer
        if outcome.status == NOT_YET and outcome.mistake is None and id not in self.plan.settled:
            self.verdicts.alike[id] = (
                self._shown(answer) if isinstance(item, Value) else self._fingerprint(item, answer)
            )
        if outcome.status == CORRECT or id in self.plan.withheld:
            return {}
        return {"value": self._reference(item, parts)}

    def _judged(self, item, answer, unit=None):
        """The engine's outcome; calling the library's own answer makes it another, whatever came out."""
        rng = np.random.default_rng([*self.seed, *item.id.encode(), self.handed[item.id]])
        self.judging, self.called = item.id, ""
        unit = unit if isinstance(unit, str) else None
        outcome = item.judge(answer, unit) if isinstance(item, Value) else item.judge(answer, rng)
        if self.border.line.broken:
            raise wire.Gone(self.border.line.broken)
        self.judging = None
        if self.called:
            text = f"your code calls the library's `{self.called}`, which is what this exercise asks for."
            return Outcome(LIBRARY, text)
        return outcome

    def _judge_again(self):
        """A function handed in several times is judged once more: the notebook could stop at a lucky draw."""
        for id in sorted(self.again):
            answer = self.last.get(id)
            if callable(answer) and id not in self.plan.settled:
                self.verdicts.outcomes[id] = self._judged(self.items[id], answer)

    def _reference(self, item, parts):
        if isinstance(item, Value):  # could be handed in again; a function given back refuses while it is judged
            self.given.add(item.id)
        reference = item.reference() if isinstance(item, Value) else item.reference
        return self.border.encode(reference, parts)

    def _predict(self, parts, id, answer):
        item = self.items.get(id)
        if not isinstance(item, Prediction):
            raise AttributeError(f"there is no prediction {str(id)[:80]!r} in this chapter")
        if answer is not None and id not in self.verdicts.predictions:
            try:
                choice = item.read(answer)
                self.verdicts.predictions[id] = [str(choice), bool(item.is_right(choice))]
            except Exception:  # whatever it is, it is no choice
                self.verdicts.predictions[id] = [UNREADABLE, False]
        return {}

    def _library(self, parts, name, args, kwargs):
        if name not in self.library:
            raise LookupError(f"nothing is known of {str(name)[:80]!r}")
        module, _, function = name.rpartition(".")
        outcome = self._run_trusted(getattr(importlib.import_module(module), function), args, kwargs, None, lambda r: r)
        if outcome.error is not None:
            raise outcome.error
        return {"value": self.border.encode(outcome.result, parts)}

    def _run_trusted(self, function, args, kwargs, limit, finish):
        """One of this side's functions for the worker, but never the one that is being judged."""
        if self.judging:
            item = self.items[self.judging]
            name = library.everything().get(getattr(getattr(function, "__wrapped__", function), "__code__", None), "")
            if function is getattr(item, "reference", None) or name in self.answers.get(item.id, ()):
                self.called = name.removeprefix("labkit.") or item.id
                run = guard.Run(error=RuntimeError(f"the library's {self.called} is what this exercise asks for"))
                run.given, run.spent = args, 0.0
                return run
        return run_trusted(function, args, kwargs, limit, finish)

    def _constant(self, parts, module, name):
        """A constant of the chapter's figures, which are not loaded in the worker."""
        figures = {f"labkit.chapters.ch{self.chapter.notebook}.{part}" for part in FIGURES if part != "exercises"}
        if str(module) not in figures or not str(name).isupper():
            raise AttributeError(f"there is no {str(module)[:80]}.{str(name)[:80]}")
        return {"value": self.border.encode(getattr(importlib.import_module(module), name), parts)}

    def _compute(self, parts, module, name, args):
        """What a Stage computes from a state, as a notebook may ask it; refused while an answer is judged."""
        if self.judging:
            raise RuntimeError(f"no figure computes while {self.judging} is judged")
        if module != f"labkit.chapters.ch{self.chapter.notebook}.stages" or not str(name).startswith("compute_"):
            raise AttributeError(f"there is no {str(module)[:80]}.{str(name)[:80]}")
        outcome = run_trusted(getattr(importlib.import_module(module), name), args, {}, None, lambda r: r)
        if outcome.error is not None:
            raise outcome.error
        return {"value": self.border.encode(outcome.result, parts)}

    def _fingerprint(self, item, answer):
        """The same few letters for all functions that give the same results on draws that all students share."""
        rng, parts = np.random.default_rng([self.seed[0], *item.id.encode()]), []
        with contextlib.suppress(Exception):
            for case in (item.cases * 3)[:3]:
                run = guard.run(answer, case(rng), limit=item.limit)
                words = wire.encode(_rounded(run.result), parts) if run.error is None else type(run.error).__name__
                parts.append(repr(words).encode())
            return hashlib.sha256(b"|".join(parts)).hexdigest()[:8]
        return ""

    @staticmethod
    def _shown(answer):
        """A wrong value in a few digits, the same for all who have it."""
        with contextlib.suppress(Exception):
            array = np.asarray(answer, dtype=float)
            if array.size <= 16:
                return np.array2string(array, formatter={"float": lambda v: f"{v:.4g}"}, separator=", ").replace(
                    "\n", ""
                )
        return ""


def _rounded(value):
    """A result to six significant digits, so that the order of additions does not tell two answers apart."""
    if isinstance(value, tuple | list):
        return [_rounded(part) for part in value]
    array = np.asarray(value)
    if array.dtype.kind not in "fc":
        return value
    size = np.abs(array[np.isfinite(array)]).max(initial=0.0)
    return array if size == 0 else np.round(array / size, 6) + 0.0
