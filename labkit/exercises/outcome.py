"""What a check comes to, the mistakes it can name, and what all items of a chapter share."""

import hashlib
import types
from dataclasses import dataclass, field, replace

from . import guard
from .typeset import typeset

TO_DO, NOT_YET, CORRECT, RAISED = "to do", "not yet", "correct", "your code raised"


@dataclass(frozen=True)
class Outcome:
    """The judgment of one answer: status, what to say about it, and the index of the named mistake it is, if any; which
    of its results are lists where arrays are meant.
    """

    status: str
    text: str = ""
    mistake: int | None = None
    printed: str = ""
    listed: bool | tuple = field(default=False, compare=False)

    def __post_init__(self):
        object.__setattr__(self, "text", guard.printable(typeset(self.text)))


@dataclass(frozen=True)
class Mistake:
    """A wrong variant of the reference, with the same arguments, and what to tell who made it.

    `id` is the same in every term and in every list, so that two classes can be compared. Left out, it follows from
    the exercise and the sentence; whoever only improves the sentence writes the old id down. `within` is for what
    comes from a search or from differences: how far an answer may be from the wrong one and still be it, in the unit
    of a Value, or in place of the tolerance of an exercise's Numbers.
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
            object.__setattr__(self, "mistakes", with_ids(self.id, self.mistakes))


def with_ids(exercise, mistakes):
    """The mistakes, each with an id of its own: that of its sentence, numbered where several variants share it."""
    named = []
    for mistake in mistakes:
        words, text = f"{exercise}-{hashlib.sha256(mistake.text.encode()).hexdigest()[:6]}", typeset(mistake.text)
        same = sum(other.text == text for other in named)
        named.append(replace(mistake, text=text, id=mistake.id or (f"{words}-{same + 1}" if same else words)))
    return tuple(named)


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
