"""The exercises as the student meets them: `ex = course("01-frames")`, then `@ex.invert`, `ex.distance(value)`."""

import difflib
import html
import importlib
import json
import os
import pkgutil
import re
import zlib
from typing import NamedTuple

import ipywidgets
import numpy as np

from ..places import ROOT
from . import feedback, guard, kept, progress, source
from .engine import Prediction
from .feedback import Named, Panel
from .listed import in_arrays
from .outcome import CORRECT, NOT_YET, RAISED, TO_DO, is_blank
from .value import Value

CHAPTERS = "labkit.chapters"  # found by name: the engine imports no chapter
SOLUTIONS = ROOT / "solutions"


class NotCorrect(AssertionError):
    """Raised in strict mode, where everything must be solved: CI runs the solved notebooks with LABKIT_STRICT=1."""


def is_strict():
    """Whether the environment variable LABKIT_STRICT asks that everything be solved."""
    return os.environ.get("LABKIT_STRICT", "") not in ("", "0")


def chapters():
    """All chapters that exist, in order."""
    folders = importlib.import_module(CHAPTERS).__path__
    names = sorted(m.name for m in pkgutil.iter_modules(folders) if re.fullmatch(r"ch\d\d_\w+", m.name))
    return [importlib.import_module(f"{CHAPTERS}.{name}.exercises").CHAPTER for name in names]


def course(name):
    """The exercises of one chapter, for the first cell of its notebook.

    Parameters
    ----------
    name : str
        "01-frames" for the notebook 01_frames.

    Raises
    ------
    ValueError
        When there is no such chapter, with those there are.
    """
    folder = f"{CHAPTERS}.ch{str(name).replace('-', '_')}"
    try:
        chapter = importlib.import_module(f"{folder}.exercises").CHAPTER
    except ModuleNotFoundError as error:
        if error.name != folder:
            raise
        known = ", ".join(c.name for c in chapters())
        raise ValueError(f"there is no chapter {name!r}; there are {known}") from None
    guard.PRISTINE.look()
    return Course(chapter)


class Course:
    """One chapter's exercises as attributes."""

    def __init__(self, chapter):
        self._chapter = chapter
        self._bound = {i.id: Bound(chapter, i) for i in chapter.items if not isinstance(i, Prediction)}

    def __getattr__(self, id):
        bound = self.__dict__.get("_bound", {})
        if id in bound:
            return bound[id]
        near = difflib.get_close_matches(id, bound, n=1)
        guess = f"; did you mean {near[0]!r}?" if near else f"; there are {', '.join(bound)}"
        raise AttributeError(f"chapter {self._chapter.name} has no exercise {id!r}{guess}")

    def __dir__(self):
        return [*super().__dir__(), *self._bound]

    def __repr__(self):
        return f"exercises of chapter {self._chapter.name}: {', '.join(self._bound)}"

    def predict(self, id, answer=None, reveal=None):
        """Lock in a prediction, then show what `reveal()` returns; without one, offer the choices as buttons."""
        try:
            item = self._chapter[id]
        except KeyError:
            known = ", ".join(i.id for i in self._chapter.items if isinstance(i, Prediction))
            raise AttributeError(f"chapter {self._chapter.name} has no prediction {id!r}; there are {known}") from None
        ask(self._chapter, item, answer, reveal)

    def after(self, *ids):
        """Whether these exercises are solved; where not, a line says what the cell waits for. For cells whose output
        would give an answer away.
        """
        done = progress.solved()
        open_ = [id for id in ids if (self._chapter.name, self._chapter[id].id) not in done]
        if open_ and not is_strict():
            feedback.show(Panel(f"this cell waits for {', '.join(open_)}: it would give the answer away", (), TO_DO))
            return False
        return True

    def progress(self):
        """Show what is solved in this chapter."""
        feedback.show(chapter_panel(self._chapter))


class Bound:
    """One exercise in the student's hands."""

    def __init__(self, chapter, item):
        self._chapter, self._item = chapter, item
        self._hints_seen = 0
        self._call = re.compile(rf"(^|[^\w.])ex\.{item.id}\b")

    def __repr__(self):
        name = self._item.id
        return f"exercise {name}: check with `@ex.{name}`, or ask .hint(), .solution(), .starter(), .reset()"

    def __call__(self, answer, unit=None):
        """Check an answer, say what came out, and return what later cells go on with: the answer, or the reference."""
        if guard.Judging.depth:
            raise guard.Forbidden(f"ex.{self._item.id}()")
        guard.PRISTINE.restore()
        is_value = isinstance(self._item, Value)
        with kept.a_check():
            outcome = self._item.judge(answer, unit) if is_value else self._item.judge(answer, self._generator())
        if not is_strict() or outcome.status == CORRECT:
            named = {} if outcome.mistake is None else {"mistake": self._item.mistakes[outcome.mistake].id}
            progress.record(self._chapter.name, self._item.id, outcome.status, **named)
        feedback.show(self._panel(outcome, guard.PRISTINE.drain()))
        if outcome.status == CORRECT:
            return Answer.of(answer) if is_value else in_arrays(answer, outcome.listed)
        if is_strict():
            raise NotCorrect(f"{self._item.id}: {outcome.status}. {outcome.text}")
        feedback.show(feedback.button_row(self._next_hint, self._solution, self._start_over))
        return Answer.reference(self._item.reference()) if is_value else self._item.reference

    def _generator(self):
        """Where the draws come from: fresh for a student, the same in every run of CI, which must not hang on luck."""
        return np.random.default_rng(zlib.crc32(self._item.id.encode())) if is_strict() else None

    def _panel(self, outcome, replaced):
        name = self._item.id
        paragraphs = [_sentence(outcome.text)]
        if outcome.status == RAISED:
            paragraphs = [outcome.text]
        if outcome.printed:
            paragraphs.append(f"Your code printed:\n{outcome.printed.rstrip()}")
        if replaced:
            paragraphs.append(f"Replaced in the library, and put back: {', '.join(replaced)}.")
        if outcome.status != CORRECT:
            kept = "value" if isinstance(self._item, Value) else "function"
            paragraphs.append(f"Until then `{name}` stands for the reference {kept}, so that the next cells work.")
        return Panel(f"{name}: {outcome.status}", paragraphs, outcome.status)

    def hint(self, number=None):
        """Show the next of three hints, or a certain one."""
        if number is not None and number not in (1, 2, 3):
            raise ValueError(f"there are hints 1, 2 and 3, got {number!r}")
        feedback.show(self._hint_panel(number) if number else self._next_hint()[0])

    def solution(self):
        """Show the solution's code."""
        feedback.show(self._solution())

    def starter(self):
        """Show the cell without an answer, to be copied."""
        feedback.show(self._starter())

    def reset(self):
        """Forget this exercise's progress and hints, and show the cell without an answer."""
        feedback.show(self._start_over())

    def _next_hint(self):
        remembered = sum(e["event"] == "hint" for e in progress.of(self._chapter.name, self._item.id))
        number = max(remembered, self._hints_seen) % 3 + 1
        self._hints_seen = number
        progress.record(self._chapter.name, self._item.id, "hint", number=number)
        return self._hint_panel(number), 3 - number

    def _hint_panel(self, number):
        return Panel(f"{self._item.id}: hint {number} of 3", [self._item.hints[number - 1]])

    def _cell(self):
        path = SOLUTIONS / f"{self._chapter.notebook}.py"
        if not path.exists():
            return None
        cells = (cell.text for cell in source.read(path) if cell.kind == "code")
        return next((text for text in cells if self._call.search(text) and source.region(text)), None)

    def _solution(self):
        cell = self._cell()
        if cell is None:
            return Panel(f"{self._item.id}: no solution is stored in this edition")
        progress.record(self._chapter.name, self._item.id, "solution")
        return Panel(f"{self._item.id}: a solution", code=source.region(cell))

    def _starter(self):
        cell = self._cell()
        code = source.blank(cell) if cell else self._blank_cell()
        return Panel(f"{self._item.id}: the cell without an answer, to be copied", code=code)

    def _blank_cell(self):
        """The cell of the blank notebook, for an edition without solutions."""
        path = ROOT / "notebooks" / f"{self._chapter.notebook}.ipynb"
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"] if path.exists() else []
        texts = ("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
        return next((text for text in texts if self._call.search(text) and source.STUB in text), "")

    def _start_over(self):
        progress.record(self._chapter.name, self._item.id, "reset")
        self._hints_seen = 0
        return self._starter()


HIDDEN = "(still to be found)"


class ArrayAnswer(np.ndarray):
    """A checked array. One that stands for the reference counts like any array, but does not show its numbers."""

    hidden = False

    def __array_finalize__(self, whole):
        """Another view of a hidden array is hidden as well; what is computed from it is the student's own."""
        self.hidden = getattr(whole, "hidden", False) and np.may_share_memory(self, whole)

    def __getitem__(self, key):
        part = super().__getitem__(key)
        return Answer.reference(part) if self.hidden else part

    def __repr__(self):
        return HIDDEN if self.hidden else repr(np.asarray(self))

    def __str__(self):
        return HIDDEN if self.hidden else str(np.asarray(self))

    def __format__(self, spec):
        return HIDDEN if self.hidden else format(np.asarray(self), spec)

    def _ipython_display_(self):
        """Nothing: the feedback above has said it."""


class Answer(float):
    """A checked number. One that stands for the reference counts like any float, but does not show its digits."""

    hidden = False

    @classmethod
    def of(cls, value):
        """A number or an array that shows nothing where it is the last line of a cell; anything else as it is."""
        if isinstance(value, np.ndarray) and value.ndim:
            return value.view(ArrayAnswer)
        try:
            return cls(value)
        except (TypeError, ValueError):
            return value

    @classmethod
    def reference(cls, value):
        answer = cls.of(np.array(value) if isinstance(value, np.ndarray) else value)
        if isinstance(answer, cls | ArrayAnswer):
            answer.hidden = True
        return answer

    def __repr__(self):
        return HIDDEN if self.hidden else float.__repr__(self)

    __str__ = __repr__

    def __format__(self, spec):
        return repr(self) if self.hidden else float.__format__(self, spec)

    def _ipython_display_(self):
        """Nothing: the feedback above has said it."""


def ask(chapter, item, answer, reveal):
    """Lock in a prediction and reveal; or show the question with its choices, and reveal after a click."""
    locked = [e["answer"] for e in progress.of(chapter.name, item.id) if e["event"] == "predicted" and "answer" in e]
    if is_strict():
        if is_blank(answer) or not item.is_right(item.read(answer)):
            missing = TO_DO if is_blank(answer) else "not the right one"
            raise NotCorrect(f"{item.id}: the prediction is {missing}")
        locked = []
    given = None
    if not is_blank(answer):
        try:
            given = item.read(answer)
        except ValueError as error:
            feedback.show(Panel(f"{item.id}: {NOT_YET}", [_sentence(f"{error}.")], NOT_YET))
            return
    if locked or given is not None:
        feedback.show(_locked_panel(chapter, item, locked[0] if locked else given, first=not locked))
        if reveal:
            feedback.show(reveal())
    else:
        feedback.show(_question(chapter, item, reveal))


def _locked_panel(chapter, item, choice, first):
    if first:
        progress.record(chapter.name, item.id, "predicted", answer=choice)
    return Panel(
        f"{item.id}: locked in", [item.question, f"{_chosen(item, choice)} {_verdict(item, choice)}", item.why]
    )


def _chosen(item, choice):
    return f"Your prediction: {choice}{_unit(item)}."


def _verdict(item, choice):
    return "That is what happens." if item.is_right(choice) else f"What happens: {item.answer}{_unit(item)}."


def _unit(item):
    return f" {item.unit}" if item.unit else ""


def _question(chapter, item, reveal):
    """The question with a button for each choice; a click locks it in and puts the figure beneath, and under it what
    happens, folded: one can find out by hand first.
    """
    text = ipywidgets.HTML(Panel(f"{item.id}: predict first", [item.question], TO_DO).html())
    answers = ipywidgets.HBox(layout=ipywidgets.Layout(flex_flow="row wrap"))
    name = f"[predict first: {item.question} {' | '.join(map(str, item.choices))}]".replace(" ]", "]")
    choices = "".join(f"<li>{html.escape(str(choice))}</li>" for choice in item.choices)
    revealed, told = [], ipywidgets.HTML()

    def still():
        if answers.children:
            return f"{text.value}<ul>{choices}</ul>"
        return "".join([text.value, *(thing.still() for thing in revealed), told.value])

    box = Named([text, answers], name, still)

    def lock(choice):
        panel = _locked_panel(chapter, item, choice, first=True)
        revealed.extend([reveal()] if reveal else [])
        answers.children = []
        if revealed:
            told.value = _folded("What happened?", Panel(_verdict(item, choice), [item.why]))
            panel = Panel(panel.head, [item.question, _chosen(item, choice)])
        text.value = panel.html()
        box.children = [text, *(thing.widget for thing in revealed), told]
        for thing in revealed:
            thing.at_rest.append(box.store)
        box.store()

    if item.choices:
        answers.children = [feedback.button(str(c), lambda c=c: lock(c)) for c in item.choices]
    else:
        number = ipywidgets.FloatText(description=item.unit or "value", layout=ipywidgets.Layout(width="14em"))
        answers.children = [number, feedback.button("Lock in", lambda: lock(number.value))]
    return box


def _folded(summary, panel):
    """A panel as HTML that opens on a click or by keys."""
    style = "cursor:pointer;margin:4px;font-size:var(--jp-content-font-size1, inherit)"
    return f'<details><summary style="{style}">{summary}</summary>{panel.html()}</details>'


def _sentence(text):
    """The text with a capital, unless it begins with a symbol: s0, x, R."""
    return text[:1].upper() + text[1:] if re.match(r"(a|[a-z]{2,})[\s,:;'-]", text) else text


def chapter_panel(chapter):
    """What is solved in a chapter, item by item; what goes beyond the core path is marked."""
    done = progress.solved()
    lines = []
    for item in chapter.items:
        sign = "✓" if (chapter.name, item.id) in done else "○"
        lines.append(f"{sign} {item.id}{'  (further)' if item.id in chapter.further else ''}")
    count = _count(chapter, done)
    return Panel(f"{chapter.name}: {count.core} of {count.of_core} done{_more(count)}", ["\n".join(lines)])


class Count(NamedTuple):
    """How much of a chapter is done: of its core path, and of what goes further."""

    core: int
    of_core: int
    further: int
    of_further: int


def _count(chapter, done):
    core = [(chapter.name, item.id) in done for item in chapter.items if item.id not in chapter.further]
    more = [(chapter.name, id) in done for id in chapter.further]
    return Count(sum(core), len(core), sum(more), len(more))


def _more(count):
    return f", further {count.further} of {count.of_further}" if count.of_further else ""


def overview():
    """(chapter, `Count` of what is done) of every chapter."""
    done = progress.solved()
    return [(c, _count(c, done)) for c in chapters()]


class CourseMap:
    """The chapters as a table with links and what is done; plain text where no HTML is shown."""

    def __repr__(self):
        return progress_text()

    def _repr_mimebundle_(self, include=None, exclude=None):
        rows = "".join(
            f'<tr><td style="text-align:right">{c.name[:2].lstrip("0") or "0"}</td>'
            f'<td style="text-align:left"><a href="{c.notebook}.ipynb">{html.escape(c.title)}</a></td>'
            f'<td><progress value="{n.core}" max="{n.of_core}" aria-label="{html.escape(c.title)}"></progress></td>'
            f"<td>{n.core} of {n.of_core}</td><td>{f'{n.further} of {n.of_further}' if n.of_further else ''}</td></tr>"
            for c, n in overview()
        )
        head = "<tr><th></th><th>chapter</th><th>done</th><th></th><th>further</th></tr>"
        return {"text/plain": repr(self), "text/html": f"<table>{head}{rows}</table>"}


def course_map():
    """The chapters of the course with links and the reader's own progress."""
    return CourseMap()


def progress_text():
    """All chapters with a bar of what is done; `python lab.py progress` prints it."""
    lines = []
    for chapter, n in overview():
        bar = "#" * round(20 * n.core / max(n.of_core, 1))
        lines.append(f"{chapter.name:20} [{bar:20}] {n.core:2} of {n.of_core}{_more(n)}")
    return "\n".join(lines)
