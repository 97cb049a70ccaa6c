"""What a function keeps from one call to the next, as a list that is filled does: in a default argument, or in a name
of the notebook.
"""

import contextlib
import copy
import types

import numpy as np

from . import guard, scope

COMPARED = (np.ndarray, np.number, list, tuple, dict, str, int, float)
SMALL = 100_000  # entries of what is remembered as it was at first


class Defaults:
    """The default arguments of a function, and what it could change in the notebook, as they were at first."""

    def __init__(self, function):
        self.function, self.first, self.notebook = function, (), {}
        if not isinstance(function, types.FunctionType):
            return
        if any(type(v) in scope.FILLED for v in function.__defaults__ or ()):
            self.first = tuple(_as_it_is(v) for v in function.__defaults__)
        for name in scope.could_change(function):
            with contextlib.suppress(Exception):  # what has no copy, or no end
                value = function.__globals__[name]
                if _size(value) <= SMALL:
                    self.notebook[name] = _as_it_is(value)

    @property
    def may_fill(self):
        """Whether something stands there that a call could leave changed, or has been."""
        return bool(self.first or self.changed)

    @property
    def changed(self):
        """Names of the notebook that are no longer what they were."""
        known = getattr(self.function, "__globals__", {})
        return [name for name, value in self.notebook.items() if not _is_still(value, known.get(name))]

    @property
    def changed_names(self):
        return ", ".join(f"`{name}`" for name in self.changed)

    def words(self):
        """What is told where the function is right with all that it keeps as at first in every call."""
        if self.changed:
            return (
                f"what one call puts into {self.changed_names} is still there in the next. Begun anew in every "
                "call, within the function, your result is right."
            )
        code = self.function.__code__
        names = code.co_varnames[code.co_argcount - len(self.first) : code.co_argcount]
        named = ", ".join(f"`{name}`" for name, value in zip(names, self.first) if type(value) in scope.FILLED)
        return (
            f"what one call puts into {named} is still there in the next, as it is made once, where `def` is read. "
            "With a fresh one in every call this is right: make it within the function."
        )

    def fresh(self, *args):
        """The function with its first defaults, and what it has changed in the notebook as it was."""
        function, known = self.function, self.function.__globals__
        if changed := self.changed:
            known = {**known, **{name: _as_it_is(self.notebook[name]) for name in changed}}
        defaults = tuple(map(_as_it_is, self.first)) if self.first else function.__defaults__
        made = types.FunctionType(function.__code__, known, function.__name__, defaults, function.__closure__)
        made.__kwdefaults__ = function.__kwdefaults__
        return made(*args)


def _as_it_is(value):
    return copy.deepcopy(value) if type(value) in scope.FILLED else value


def _size(value):
    """Entries of an array, a list, a dict or a set, with those of what stands in it; 1 of anything else."""
    if isinstance(value, np.ndarray):
        return value.size
    if type(value) not in scope.FILLED:
        return 1
    if len(value) > SMALL:
        return len(value)
    return 1 + sum(map(_size, value.values() if isinstance(value, dict) else value))


def _is_still(before, now):
    if type(before) is not type(now):
        return False
    if isinstance(before, set):
        return before == now
    return guard.is_same(before, now) if isinstance(before, COMPARED) else before is now
