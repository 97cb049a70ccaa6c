"""What a demo shows: the Stages of the chapters in the notebooks' order, each behind its prediction, and own questions.

Questions, choices, answers and what happened are the chapters' own `Prediction`s; which Stage reveals which of them
says the notebook's source: `ex.predict("id", guess, reveal=stages.name)`, or `stages.name()` for one without.
"""

import ast
import base64
import importlib
import inspect
import json
import re
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

from ..exercises import session, source
from ..exercises.engine import Prediction
from ..places import ROOT
from ..reading import regular
from .vote import MAX_SIZE

MAX_QUESTIONS, MAX_LETTERS, MAX_CHOICES = 100, 400, 8
MAX_FILE = 1 << 20  # bytes; a hundred questions with all their choices in the longest words stay below
OWN = "own"  # the chapter of own questions
TOLD = 60  # letters of what is wrong in a file that a refusal repeats
FIELDS = {"question": str, "choices": list, "answer": object, "why": str, "unit": str, "stage": str, "before": str}


class NotThere(ValueError):
    """There is no such chapter, Stage or question; said in one sentence."""


@dataclass(frozen=True)
class Asked:
    """A question to the room: choices, or a number in `unit`, right within the share `within`; the answer is None where
    there is no right one.
    """

    question: str
    choices: tuple = ()
    answer: object = None
    why: str = ""
    unit: str = ""
    within: float = 0.2

    @classmethod
    def of(cls, prediction):
        """What a chapter asks."""
        choices = tuple(map(str, prediction.choices))
        answer = str(prediction.answer) if choices else float(prediction.answer)
        return cls(prediction.question, choices, answer, prediction.why, prediction.unit, prediction.within)

    @property
    def answer_text(self):
        """The answer as it is written; "" without one."""
        return f"{self.answer:g}" if isinstance(self.answer, float) else self.answer or ""


@dataclass
class Card:
    """One thing to show: a question, a Stage, or a Stage behind its question.

    key : address on the page, "05/scan-line"; stage : the key of the Stage it shows, or "";
    make : function() -> Stage; asked : what the room is asked, or None; question : one of the notebook's text instead;
    cell : id of its cell in the notebook; near : exercises that stand close to it.
    """

    key: str
    chapter: str
    heading: str
    stage: str = ""
    make: object = None
    asked: Asked | None = None
    question: str = ""
    cell: str = ""
    near: list = field(default_factory=list)

    @property
    def title(self):
        """What the overview calls it."""
        if self.chapter == OWN:
            return _short(self.asked.question)
        return self.key.partition("/")[2].replace("-", " ")

    @property
    def shows(self):
        """One sentence: what can be done there."""
        text = inspect.getdoc(self.make) if self.make else ""
        return " ".join((text or "").split())

    def declaration(self):
        """What a page must know of it, as plain data."""
        asked = self.asked or Asked(self.question)
        return {
            "key": self.key,
            "chapter": self.chapter,
            "heading": self.heading,
            "title": self.title,
            "stage": self.stage,
            "shows": self.shows,
            "question": asked.question,
            "choices": asked.choices,
            "unit": asked.unit,
            "answer": asked.answer_text,
            "happened": asked.why,
            "votes": self.asked is not None,
        }


@dataclass
class Program:
    """The cards in order, and the chapters' titles {"05": "..."}."""

    cards: list
    titles: dict

    def __getitem__(self, key):
        for card in self.cards:
            if card.key == key:
                return card
        raise NotThere(f"There is no {key!r} here; {_there(self.cards)}.")

    def __contains__(self, key):
        return any(card.key == key for card in self.cards)

    def makers(self):
        """{key of a Stage: function() -> Stage}."""
        return {card.stage: card.make for card in self.cards if card.make}

    def after(self, key):
        """Keys of the Stages shown by the cards behind and before this one, the next first."""
        place = next(k for k, card in enumerate(self.cards) if card.key == key)
        return [self.cards[k].stage for k in (place + 1, place - 1) if 0 <= k < len(self.cards) and self.cards[k].stage]


def _there(cards):
    keys = [card.key for card in cards]
    return f"there are {', '.join(keys)}" if len(keys) <= 12 else f"there are {len(keys)}, from {keys[0]} to {keys[-1]}"


def program(chapters=(), questions=None, folder=ROOT / "solutions"):
    """The cards of some chapters (all by default), with the questions of a TOML file among them.

    Parameters
    ----------
    chapters : sequence of str
        Numbers or names: "5", "05", "05-hand-eye".
    questions : path, optional
        A TOML file with own questions; `read_questions` tells what it holds.

    Raises
    ------
    NotThere, ValueError
        For an unknown chapter, an edition without sources, a file that cannot be read or a question that is none.
    """
    paths = [source.find(chapter, folder) for chapter in dict.fromkeys(chapters)] or source.sources(folder)
    if not paths:
        raise NotThere("This edition holds no sources of the chapters, and so no Stages to show.")
    titles, cards = {}, []
    for path in paths:
        chapter = importlib.import_module(f"{session.CHAPTERS}.ch{path.stem}.exercises").CHAPTER
        titles[path.stem[:2]] = chapter.title
        cards += _cards(chapter, source.read(path))
    if questions is not None:
        cards = _placed(read_questions(questions), cards)
        titles[OWN] = "Own questions"
    return Program(cards, titles)


def _cards(chapter, cells):
    """The cards of one chapter; the exercises between two of them are near to the first."""
    number, heading, asked, cards, waiting = chapter.name[:2], chapter.title, "", [], []
    stages = _stages_of(chapter)
    exercises = {item.id: item for item in chapter.items if not isinstance(item, Prediction)}
    for cell in cells:
        if cell.kind == "markdown":
            heading = ([heading] + re.findall(r"^##+ (.*)$", cell.text, re.M))[-1]
            asked = _last_question(cell.text)
            continue
        tree = ast.parse(source.solved(cell.text))
        for prediction, name in _shown(tree):
            card = Card(f"{number}/{(name or prediction).replace('_', '-')}", number, _plain(heading), cell=cell.id)
            if prediction:
                card.asked = Asked.of(chapter[prediction])
            if name:
                maker = getattr(stages, name)
                if not _makes_stage(maker):
                    continue
                card.stage, card.make, card.question = card.key, maker, asked
            card.near, waiting = (waiting if not cards else []), []
            cards.append(card)
        near = cards[-1].near if cards else waiting
        near += [exercises[n] for n in _exercises_in(tree) if n in exercises and exercises[n] not in near]
    for before, card in zip(cards, cards[1:]):
        card.near = card.near or before.near[-2:]  # it closes a section: what the class has just written
    return cards


def _stages_of(chapter):
    name = f"{session.CHAPTERS}.ch{chapter.notebook}.stages"
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name != name:
            raise
        return None


def _makes_stage(maker):
    """Whether a function of a chapter's `stages` makes a Stage, without calling it."""
    return any(name.startswith("Stage") for name in maker.__code__.co_names)


def _shown(tree):
    """(id of a prediction or "", name of a Stage or "") of each call in a cell that shows one."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
            continue
        owner = getattr(node.func.value, "id", "")
        if (owner, node.func.attr) == ("ex", "predict"):
            yield node.args[0].value, next((_stage_name(k.value) for k in node.keywords if k.arg == "reveal"), "")
        elif owner == "stages" and not node.args and not node.keywords:
            yield "", node.func.attr


def _stage_name(node):
    """ "name" of `stages.name`."""
    return node.attr if isinstance(node, ast.Attribute) and getattr(node.value, "id", "") == "stages" else ""


def _exercises_in(tree):
    """Names used as `ex.name`, in order."""
    found = [n for n in ast.walk(tree) if isinstance(n, ast.Attribute) and getattr(n.value, "id", "") == "ex"]
    return [node.attr for node in sorted(found, key=lambda n: (n.lineno, n.col_offset))]


def _plain(text):
    """Markdown without its signs."""
    return re.sub(r"[*`$]|\\(?=\w)", "", text).strip()


def _last_question(text):
    """The question a text ends with, plain; "" where it ends otherwise."""
    found = re.findall(r"(?:^|[.:?]\s+)([A-Z][^.:?]*\?)\s*$", " ".join(text.split()))
    return _plain(found[-1]) if found else ""


# -- own questions


def read_questions(path):
    """The own questions of a TOML file as cards: a list of tables `[[question]]`.

    question and choices, or question and unit for a number; answer, why: left out, nothing is revealed;
    stage = "05/scan-line": the Stage that reveals it; before = "05/scan-line": where it is asked, else at the end.

    Raises
    ------
    ValueError
        Naming file and number of the question, and what was expected.
    """
    path = Path(path)
    found = _toml(path)
    tables = found.get("question")
    if set(found) != {"question"} or not (tables and isinstance(tables, list) and all(type(t) is dict for t in tables)):
        got = _short(", ".join(found)) if found and tables != [] else "nothing"
        raise ValueError(f"{path}: expected tables [[question]] and nothing else, got {got}")
    if len(tables) > MAX_QUESTIONS:
        raise ValueError(f"{path}: at most {MAX_QUESTIONS} questions, got {len(tables)}")
    return [_own(f"{path}, question {k}", k, table) for k, table in enumerate(tables, start=1)]


def _toml(path):
    """What a TOML file says; the mark that Windows' editors put in front of a text is left out."""
    if (size := regular(path).stat().st_size) > MAX_FILE:
        raise ValueError(
            f"{path}: own questions take at most {MAX_FILE / 2**20:g} MB, and this is {size / 2**20:.1f} MB"
        )
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except UnicodeDecodeError:
        raise ValueError(f"{path}: expected text in UTF-8, and it is none") from None
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{path}: this is no TOML: {_short(str(error), 2 * TOLD)}") from None
    except RecursionError:
        raise ValueError(f"{path}: expected tables [[question]], and got brackets within brackets") from None


def _short(text, letters=TOLD):
    """A text, cut where it is long: whoever wrote it knows the rest."""
    return text if len(text) <= letters else f"{text[:letters]} ..."


def _own(where, number, table):
    """(card, key it stands before or "", where it was written) of one table."""
    for name, value in table.items():
        if name not in FIELDS:
            raise ValueError(f"{where}: there is no {_short(repr(name))}, only {', '.join(FIELDS)}")
        if not isinstance(value, FIELDS[name]):
            wanted = "a list" if name == "choices" else "text"
            raise ValueError(f"{where}: {name} must be {wanted}, got {_short(repr(value))}")
        longest = max((len(text) for text in (value if name == "choices" else [value]) if type(text) is str), default=0)
        if longest > MAX_LETTERS:
            what = "each of the choices" if name == "choices" else name
            raise ValueError(f"{where}: {what} is at most {MAX_LETTERS} letters long, got {longest}")
    choices = table.get("choices", [])
    if not table.get("question", "").strip():
        raise ValueError(f"{where}: a question is needed")
    if choices and not (2 <= len(choices) <= MAX_CHOICES and all(type(c) is str and c.strip() for c in choices)):
        raise ValueError(f"{where}: choices are 2 to {MAX_CHOICES} texts, got {_short(repr(choices))}")
    if len(set(choices)) < len(choices):
        raise ValueError(f"{where}: two of the choices are alike")
    answer = table.get("answer")
    if answer is not None and (answer not in choices if choices else not _is_number(answer)):
        wanted = "none of the choices" if choices else f"no number up to {MAX_SIZE:g}"
        raise ValueError(f"{where}: the answer {_short(repr(answer))} is {wanted}")
    if not choices and "answer" in table:
        answer = float(answer)
    unit = table.get("unit", "")
    question = table["question"] if choices or not unit else _with_unit(table["question"].rstrip(), unit)
    asked = Asked(question, tuple(choices), answer, table.get("why", ""), unit)
    card = Card(f"{OWN}/{number}", OWN, "Own questions", asked=asked, stage=table.get("stage", ""))
    return card, table.get("before", ""), where


def _with_unit(question, unit):
    """The unit that a number is asked for in, as the chapters' questions say it: "How far is it (mm)?"."""
    if f"({unit})" in question:
        return question
    return f"{question.removesuffix('?')} ({unit}){'?' if question.endswith('?') else ''}"


def _is_number(answer):
    return type(answer) in (int, float) and abs(answer) <= MAX_SIZE


def _placed(own, cards):
    """The cards with the own ones among them; what these name must be shown, too."""
    there = Program(cards, {})
    for card, before, where in own:
        for name in filter(None, (card.stage, before)):
            if name not in there:
                raise NotThere(f"{where}: there is no {_short(repr(name))} here; {_there(cards)}.")
        if card.stage:
            shown = there[card.stage]
            if not shown.make:
                raise NotThere(f"{where}: {card.stage} is a question without a Stage.")
            card.make, card.cell = shown.make, shown.cell
        place = cards.index(there[before]) if before else len(cards)
        cards = [*cards[:place], card, *cards[place:]]
        there = Program(cards, {})
    return cards


# -- thumbnails: the small pictures that the solved notebooks hold


def thumbnails(chapters, folder=ROOT / "solutions"):
    """{(number of a chapter, id of a cell): PNG} of some chapters' solved notebooks; where there is none, nothing."""
    found = {}
    for path in source.sources(folder):
        notebook = path.with_suffix(".ipynb")
        if path.stem[:2] not in chapters or not notebook.exists():
            continue
        for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
            pictures = [o["data"]["image/png"] for o in cell.get("outputs", []) if "image/png" in o.get("data", {})]
            if pictures:
                found[path.stem[:2], cell["id"]] = base64.b64decode(pictures[0])
    return found
