"""Which functions of the library are themselves an exercise's answer: a submission must not call them.

Found by running: an exercise's reference is watched on its own draws, and a function of the library counts whose result
is, or holds, the whole result every time. What the printed solution or its hints call is no answer, but a tool.
"""

import copy
import dataclasses
import functools
import importlib
import inspect
import pkgutil
import re
import sys

import numpy as np

from ..exercises import session, source
from ..exercises.engine import Exercise

ROOMS = ("geometry", "estimation", "calibration", "machines", "localization", "documents", "fast")
DRAWS = 8


@functools.cache
def chapter_names():
    """The names of all chapters, without loading them."""
    folders = importlib.import_module(session.CHAPTERS).__path__
    names = sorted(info.name for info in pkgutil.iter_modules(folders) if re.fullmatch(r"ch\d\d_\w+", info.name))
    return [name.removeprefix("ch").replace("_", "-") for name in names]


def load(name):
    """The chapter of this name."""
    return importlib.import_module(f"{session.CHAPTERS}.ch{name.replace('-', '_')}.exercises").CHAPTER


@functools.cache
def answers(chapter_name):
    """{exercise id: names of library functions that answer it}, such as "labkit.geometry.frames.invert"."""
    chapter = load(chapter_name)
    names = everything()
    return {item.id: _of(item, names, _tools(chapter, item)) for item in chapter.items if isinstance(item, Exercise)}


@functools.cache
def everything():
    """{code object: name} of all functions of the library's rooms."""
    found = {}
    for room in ROOMS:
        package = importlib.import_module(f"labkit.{room}")
        for info in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            module = importlib.import_module(info.name)
            for name, value in vars(module).items():
                code = getattr(getattr(value, "__wrapped__", value), "__code__", None)
                own = getattr(value, "__module__", "") == module.__name__
                if code is not None and own and not code.co_freevars:
                    found[code] = f"{module.__name__}.{name}"
    return found


def _tools(chapter, item):
    """Names of functions that the printed solution or a hint calls."""
    path = source.ROOT / "solutions" / f"{chapter.notebook}.py"
    cells = [cell.text for cell in source.read(path)] if path.exists() else []
    mine = [source.region(text) for text in cells if re.search(rf"(^|[^\w.])ex\.{item.id}\b", text)]
    return set(re.findall(r"(\w+)\s*\(", "\n".join([*mine, *item.hints])))


def _of(item, names, tools):
    held = None
    for k in range(DRAWS):
        args = item.cases[k % len(item.cases)](np.random.default_rng(k))
        calls = _watched(item.reference, args, names)
        held = calls if held is None else held & calls
    own = names.get(getattr(inspect.unwrap(item.reference), "__code__", None))
    found = {name for name in held if name.rpartition(".")[2] not in tools} | ({own} if own else set())
    last = {name.rpartition(".")[2] for name in found}
    twins = {name for name in names.values() if name.startswith("labkit.fast.") and name.rpartition(".")[2] in last}
    return sorted(found | twins)


def _watched(reference, args, names):
    """Names of the outermost library functions, and of private ones, that returned the whole result in this call."""
    args, depth, seen = copy.deepcopy(args), [0], []

    def watch(frame, event, value):
        if event not in ("call", "return"):
            return
        name = names.get(frame.f_code)
        if name is None:
            return
        depth[0] += 1 if event == "call" else -1
        if event == "return" and (depth[0] == 0 or name.rpartition(".")[2].startswith("_")):
            seen.append((name, value))

    before = sys.getprofile()
    sys.setprofile(watch)
    try:
        expected = reference(*args)
    finally:
        sys.setprofile(before)
    return {name for name, value in seen if _holds(value, expected)}


def _holds(value, expected):
    """Whether a result is the expected one, or has all its parts among its own."""
    if _same(value, expected):
        return True
    if isinstance(expected, bool | str | np.bool_) or expected is None:
        return False
    parts = expected if isinstance(expected, tuple) else (expected,)
    own = _parts(value)
    return bool(own) and all(any(_same(part, mine) for mine in own) for part in parts)


def _parts(value):
    if isinstance(value, np.ndarray):
        return list(value) if len(np.atleast_1d(value)) == 1 else []
    if dataclasses.is_dataclass(value):
        value = tuple(getattr(value, field.name) for field in dataclasses.fields(value))
    if not isinstance(value, tuple):
        return []
    return [part for own in value for part in ([own, *own] if isinstance(own, np.ndarray) and own.ndim == 1 else [own])]


def _same(a, b):
    try:
        alike = np.asarray(a).dtype.kind == np.asarray(b).dtype.kind and np.shape(a) == np.shape(b)
        return alike and bool(np.all(np.asarray(a) == np.asarray(b)))
    except Exception:  # what cannot be compared is not the same
        return False
