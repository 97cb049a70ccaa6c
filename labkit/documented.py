"""A docstring keeps its word: an argument of another kind or shape is refused before anything is computed.

`@documented` reads the Parameters of a NumPy docstring at the first call: "rng : numpy.random.Generator",
"tracker : Tracker, optional", 'model : {"euler", "arc"}', "T_BE : array, shape (k, 4, 4)", "free : tuple of str".
What it does not understand it leaves to the function, and "array-like" arguments, which functions check with
`labkit.checks`.
"""

import functools
import inspect
import os
import re
import sys

import numpy as np

from .checks import (
    PRODUCT_TOLERANCE,
    as_choice,
    as_covariances,
    as_finite,
    as_floats,
    as_function,
    as_generator,
    as_indices,
    as_number,
    as_rotations,
    as_transforms,
    as_truths,
    as_whole,
    is_of_shape,
    kind,
)

_LINE = re.compile(r"^(\w[\w, ]*?) : (.+)$")
_SHAPE = re.compile(r"\(([^()]*)\)")
_ARRAY = re.compile(r"(bool )?arrays?( of int)?\b(?!-like)")
_PLAIN = {"str": str, "dict": dict, "bytes": bytes, "bool": (bool, np.bool_), "list": (list, tuple)}
_PLAIN |= {"tuple": (list, tuple), "path": os.PathLike}
_OF = re.compile(r"(tuple|list|dict) of (\w+?)s?$")  # the plural of a kind is its word and an s


def documented(function):
    """Decorator: arguments of another kind or shape than the docstring says are refused in one sentence."""
    rules = []

    @functools.wraps(function)
    def checked(*args, **kwargs):
        if not rules:
            rules.append(_rules(function))
        sizes = {}
        for place, name, check, shape in rules[0]:
            if name in kwargs:
                value = kwargs[name] = check(kwargs[name])
            elif place < len(args):
                value = check(args[place])
                if value is not args[place]:
                    args = (*args[:place], value, *args[place + 1 :])
            else:
                continue
            if shape and value is not None:
                _refuse_other_sizes(name, value, shape, sizes)
        return function(*args, **kwargs)

    return checked


def unchecked(function):
    """The function beneath `documented`, for an inner loop whose arguments have been checked."""
    return function.__wrapped__


def _rules(function):
    """(place, name, check, shape of an array that has but one) of every parameter whose word is understood."""
    found = []
    parameters = inspect.signature(function).parameters
    places = {name: place for place, name in enumerate(parameters)}
    for names, said, more in _parameters(_text(function)):
        for k, name in enumerate(names):
            default = parameters[name].default if name in places else None
            own = _of_one(said, k, len(names))
            check = _check(name, own, f"{said}{more} {default}", function) if name in places else None
            if check:
                optional = "None" in said.partition("->")[0] or default is None
                shapes = _shapes(own) if _ARRAY.match(own) else ()
                check = functools.partial(_unless_none, check) if optional else check
                found.append((places[name], name, check, shapes[0] if len(shapes) == 1 else None))
    return found


def _text(function):
    """The docstring; of a constructor, its class's."""
    if function.__name__ != "__init__":
        return function.__doc__ or ""
    return getattr(sys.modules[function.__module__], function.__qualname__.partition(".")[0]).__doc__ or ""


def _parameters(text):
    """(names, what is said of them, the lines beneath) from the section Parameters."""
    lines = inspect.cleandoc(text).splitlines()
    try:
        begin = lines.index("Parameters") + 2
    except ValueError:
        return
    entry = None
    for k in range(begin, len(lines) + 1):
        ends = k == len(lines) or (k + 1 < len(lines) and set(lines[k + 1]) == {"-"})
        match = None if ends else _LINE.match(lines[k])
        if (ends or match) and entry:
            yield entry
        if ends:
            return
        if match:
            entry = [name.strip() for name in match[1].split(",")], match[2], ""
        elif entry:
            entry = (*entry[:2], f"{entry[2]} {lines[k].strip()}")


def _of_one(said, k, n):
    """What is said of the k-th of n names: of "arrays, shapes (n, 3), (m, 3)" each has its own."""
    first, plural, after = said.partition("shapes")
    shapes = _SHAPE.findall(after)
    return f"{first}shape ({shapes[k]})" if plural and len(shapes) == n else said


def _unless_none(check, value):
    return value if value is None else check(value)


def _check(name, said, more, function):
    """A function that returns the argument, or refuses it; None where the docstring's word is not understood."""
    gaps = bool(re.search(r"\bNaN\b|\binf", more))
    if said.startswith("{"):
        options = re.findall(r'"([^"]*)"', said.partition("}")[0])
        return functools.partial(as_choice, name=name, options=options) if options else None
    first = said.partition(",")[0].strip()
    if first == "float":
        return functools.partial(_number, name, gaps)
    if first == "int":
        least = re.search(r"\b[Aa]t least (\d+)", more)
        return functools.partial(as_whole, name=name, at_least=int(least[1]) if least else None)
    if _ARRAY.match(said):
        return functools.partial(_array, name, _shapes(said), first.startswith("bool"), "of int" in first, gaps)
    if re.match(r"(function|callable)s?\b", first):
        return functools.partial(as_function, name=name)
    if container := _OF.match(first):
        entry = _check(f"each entry of {name}", container[2], "", function)
        return entry and functools.partial(_container, name, container[1], entry)
    words = [word for word in first.split(" or ") if word != "None"]
    if words == ["numpy.random.Generator"]:
        return functools.partial(as_generator, name=name)
    types = [_PLAIN.get(word) or _class(word, function) for word in words]
    if not all(types):
        return None
    alike = re.search(r"[Oo]r anything with `(\w+)", more)
    wanted = f"of type {' or '.join(words)}{f', or have `{alike[1]}`' if alike else ''}"
    return functools.partial(_instance, name, types, wanted, alike[1] if alike else None)


def _class(word, function):
    """The class a word names, or the word where the function's module does not import it; None if it names none."""
    if not re.fullmatch(r"[\w.]*\b[A-Z]\w*", word):
        return None
    own = function.__globals__.get(word)
    return own if isinstance(own, type) else word


def _shapes(said):
    """The shapes a parameter may have, each a tuple of numbers, names and perhaps "..." in front; () for any."""
    after = said.partition("shape")[2]
    shapes = [[part.strip() for part in text.split(",") if part.strip()] for text in _SHAPE.findall(after)]
    if not all(re.fullmatch(r"\w+|\.\.\.", part) for shape in shapes for part in shape):
        return ()
    return tuple(tuple(int(part) if part.isdigit() else part for part in shape) for shape in shapes)


def _array(name, shapes, truths, indices, gaps, value):
    if truths:
        value = as_truths(value, name)
    elif indices:
        value = as_indices(value, name)
    elif type(value) is not np.ndarray or value.dtype.kind not in "iufb":  # truth values and indices stay such
        value = as_floats(value, name)
    if not gaps and value.dtype.kind == "f":
        as_finite(value, name)
    if shapes and not any(_fits(value, shape) for shape in shapes):
        wanted = " or ".join(f"({', '.join(map(str, shape))}{',' * (len(shape) == 1)})" for shape in shapes)
        raise ValueError(f"{name} must have shape {wanted}, got {value.shape}")
    if not gaps:
        _keeps_its_name(name, {shape[-2:] for shape in shapes}, value)
    return value


def _keeps_its_name(name, ends, value):
    """Refuses what is called a transform, a rotation or a covariance and is none.

    An array of shape (..., 4, 4) is one of transforms here, whatever its name.
    """
    if value.shape[-2:] == (4, 4) and (name.startswith("T") or (4, 4) in ends):
        as_transforms(value, name, PRODUCT_TOLERANCE)
    elif value.shape[-2:] == (3, 3) and (re.match(r"R(_|$)", name) or (4, 4) in ends):
        as_rotations(value, name, PRODUCT_TOLERANCE)
    elif name.startswith("cov") and value.ndim > 1 and value.shape[-2] == value.shape[-1]:
        as_covariances(value, name, value.shape[-1])


def _refuse_other_sizes(name, value, shape, sizes):
    """Refuses an array in whose shape a letter stands for another number than in that of an argument before it."""
    for letter, n in zip(reversed(shape), reversed(value.shape)):
        if isinstance(letter, str) and letter != "...":
            known, other = sizes.setdefault(letter, (n, name))
            if known != n:
                raise ValueError(f"{name} must have {letter} = {known} as {other} has, got shape {value.shape}")


def _fits(value, shape):
    """Whether an array is of a shape that may begin with "...", any number of axes of any length."""
    if shape[:1] == ("...",):
        shape = (*map(str, range(value.ndim - len(shape) + 1)), *shape[1:])
    return is_of_shape(value, shape)


def _number(name, gaps, value):
    if not gaps or np.shape(as_floats(value, name)):
        as_number(value, name)
    return value


def _container(name, word, check, value):
    _instance(name, [_PLAIN[word]], f"of type {word}", None, value)
    for entry in value.values() if isinstance(value, dict) else value:
        check(entry)
    return value


def _instance(name, types, wanted, alike, value):
    if not any(_is_of(value, type_) for type_ in types) and not (alike and hasattr(value, alike)):
        raise ValueError(f"{name} must be {wanted}, got {kind(value)}")
    return value


def _is_of(value, type_):
    """Whether a value is of a class, or of one that is called like this: "Building", "drives.Drive"."""
    if not isinstance(type_, str):
        return isinstance(value, type_)
    return any(f".{c.__module__}.{c.__qualname__}".endswith(f".{type_}") for c in type(value).__mro__)
