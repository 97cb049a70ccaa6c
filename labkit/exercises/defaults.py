"""What a default argument keeps from one call of a function to the next, as a list that is filled does."""

import copy
import types

import numpy as np

FILLED = (list, dict, set, np.ndarray)


class Defaults:
    """The default arguments of a function as they were at first."""

    def __init__(self, function):
        self.function, self.first = function, ()
        if isinstance(function, types.FunctionType) and any(type(v) in FILLED for v in function.__defaults__ or ()):
            self.first = tuple(copy.deepcopy(v) if type(v) in FILLED else v for v in function.__defaults__)

    @property
    def may_fill(self):
        """Whether something stands there that a call could leave changed."""
        return bool(self.first)

    def words(self):
        """What is told where the function is right with defaults that are as at first in every call."""
        code = self.function.__code__
        names = code.co_varnames[code.co_argcount - len(self.first) : code.co_argcount]
        named = ", ".join(f"`{name}`" for name, value in zip(names, self.first) if type(value) in FILLED)
        return (
            f"what one call puts into {named} is still there in the next, as it is made once, where `def` is read. "
            "With a fresh one in every call this is right: make it within the function."
        )

    def fresh(self, *args):
        """The function with its first defaults."""
        function = self.function
        defaults = tuple(copy.deepcopy(v) if type(v) in FILLED else v for v in self.first)
        made = types.FunctionType(function.__code__, function.__globals__, None, defaults, function.__closure__)
        made.__kwdefaults__ = function.__kwdefaults__
        return made(*args)
