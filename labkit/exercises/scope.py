"""What a checked function sees besides its arguments: its own name, the notebook's data, the library's twin."""

import __future__

import ast
import contextlib
import copy
import dis
import functools
import linecache
import sys
import types

import numpy as np

from . import guard

OWN_ROOMS = ("labkit.chapters.", "labkit.exercises.", "labkit.stage.", "labkit.verbs.")
DATA_TYPES = (int, float, complex, list, tuple, dict, set)
FILLED = (list, dict, set, np.ndarray)  # what one call can change for the next


class TwinCalled(guard.Forbidden):
    """Raised in a student's function that calls the library's version of the very function it should be."""


def is_the_librarys(function, exercise, twins):
    """Whether an answer is no answer of one's own, but the library's."""
    return function is exercise.reference or any(function is twin for _, _, twin in twins)


@contextlib.contextmanager
def own_name(function, name):
    """While a function is judged, its name means the function: it may call itself, and is not judged with another. What
    its cell defines further down is known as well: it is judged where it is defined, and called later on.
    """
    known = getattr(function, "__globals__", None)
    if known is None or (function.__module__ or "").split(".")[0] == "labkit":
        yield
        return
    absent = object()
    names = {name, getattr(function, "__name__", name)} - {"<lambda>"}
    meant = _defined_below(function) | dict.fromkeys(names, function)
    before = {key: known.get(key, absent) for key in meant}
    known.update(meant)
    try:
        yield
    finally:
        for key, value in before.items():
            if value is absent:
                known.pop(key, None)
            else:
                known[key] = value


def _defined_below(function):
    """{name: function} of the plain functions that stand below a function in its cell, which has not got there yet."""
    if not isinstance(function, types.FunctionType):
        return {}
    code, known = function.__code__, function.__globals__
    try:
        cell = ast.parse("".join(linecache.getlines(code.co_filename, known)))
    except (SyntaxError, ValueError, RecursionError):  # a cell may hold what is no Python
        return {}
    below = [node for node in cell.body if _is_plain(node) and node.lineno > code.co_firstlineno]
    below = [node for node in below if not _is_known(known.get(node.name), code.co_filename, node.lineno)]
    found = {}
    unread = __future__.annotations.compiler_flag  # annotations may be any code
    exec(compile(ast.Module(below, []), code.co_filename, "exec", unread, True), known, found)
    return found


def _is_plain(node):
    """Whether a statement defines a function and does nothing else: it runs no other code."""
    if not isinstance(node, ast.FunctionDef) or node.decorator_list:
        return False
    return all(isinstance(value, ast.Constant | None) for value in (*node.args.defaults, *node.args.kw_defaults))


def _is_known(value, file, line):
    code = getattr(value, "__code__", None)
    return code is not None and (code.co_filename, code.co_firstlineno) == (file, line)


@contextlib.contextmanager
def without(twins, function):
    """While a function is judged, the notebook's code cannot call the library's function of the same name.

    The library itself can: only a call from the globals of the judged function raises `TwinCalled`.
    """
    theirs = getattr(function, "__globals__", None)
    twins = twins if theirs is not None else []
    for module, name, twin in twins:
        setattr(module, name, _refusing(twin, f"{module.__name__.rpartition('.')[2]}.{name}", theirs))
    try:
        yield
    finally:
        for module, name, twin in twins:
            setattr(module, name, twin)


def twins_of(exercise):
    """[(module, name, function)] of what the library has for it: its reference, or what that is called after.

    A reference that a chapter wrote around a function of the library bears its name.
    """
    return _twins(exercise.reference, exercise.id, len(sys.modules))


@functools.lru_cache(maxsize=512)
def _twins(reference, id, _loaded):
    """`twins_of` a reference, looked for again when modules have been loaded."""
    wrapped = (reference.__module__ or "").startswith(OWN_ROOMS)
    found = []
    for module_name, module in list(sys.modules.items()):
        if module is None or not module_name.startswith("labkit.") or module_name.startswith(OWN_ROOMS):
            continue
        for name, value in list(vars(module).items()):
            is_it = value is reference or wrapped and name == id
            if is_it and isinstance(value, types.FunctionType) and not name.startswith("_"):
                found.append((module, name, value))
    return found


def _refusing(twin, where, theirs):
    @guard.standing_for(twin)
    def guarded(*args, **kwargs):
        if sys._getframe(1).f_globals is theirs:
            raise TwinCalled(where)
        return twin(*args, **kwargs)

    return guarded


def handed_over(error, given, reference):
    """What a function that is an argument was called with where it raised, as one more sentence, "" where none did.

    Parameters
    ----------
    error : Exception
    given : dict of object
        The arguments by name.
    reference : function
        The solution, which tells of what shape the function takes its own argument.
    """
    codes = {value.__code__: name for name, value in given.items() if isinstance(value, types.FunctionType)}
    trace = error.__traceback__
    while trace is not None and trace.tb_frame.f_code not in codes:
        trace = trace.tb_next
    if trace is None or not trace.tb_frame.f_code.co_argcount:
        return ""
    code = trace.tb_frame.f_code
    shape = np.shape(trace.tb_frame.f_locals[code.co_varnames[0]])
    taken = _shapes_taken(reference, given, codes[code])
    if len(taken) != 1 or shape in taken:
        return ""
    return f". Here `{codes[code]}` is called with {_of_shape(shape)}, and takes {_of_shape(*taken)}."


def _of_shape(shape):
    return f"an array of shape {shape}" if shape else "a single number"


def _shapes_taken(reference, given, name):
    """Shapes of what the solution calls a function with that is one of its arguments."""
    shapes = set()

    def noting(x, *others):
        shapes.add(np.shape(x))
        return given[name](x, *others)

    with contextlib.suppress(Exception):  # a reference may ask for more than a function
        reference(*copy.deepcopy([noting if key == name else value for key, value in given.items()]))
    return shapes


def notebook_data(function):
    """Names of the notebook's data (no functions, no modules) that a function reads without being given them."""
    known, code = getattr(function, "__globals__", {}), getattr(function, "__code__", None)
    if not isinstance(code, types.CodeType):  # none, or that of a function in another process
        return []
    return [name for name in _names(code) if name in known and _is_data(known[name])]


def may_keep(function):
    """Whether something may stay from one call of a function to the next: data of the notebook that it reads, a name of
    the notebook that it binds, a default that can be changed.
    """
    defaults = getattr(function, "__defaults__", None) or ()
    filled = any(isinstance(default, FILLED) for default in defaults)
    return filled or bool(_bound(function) or notebook_data(function))


def could_change(function):
    """Names of the notebook's data that a function could leave changed: what can be filled, and what it binds."""
    filled = [name for name in notebook_data(function) if type(function.__globals__[name]) in FILLED]
    return list(dict.fromkeys([*filled, *_bound(function)]))


def co_names(function):
    """Names of globals and attributes that a function reads; none where it is not written in Python."""
    return set(getattr(getattr(function, "__code__", None), "co_names", ()))


def _bound(function):
    """Names of the notebook that a function binds."""
    code = getattr(function, "__code__", None)
    instructions = dis.get_instructions(code) if isinstance(code, types.CodeType) else ()
    return [i.argval for i in instructions if i.opname == "STORE_GLOBAL"]


def _names(code):
    """Global names a code object reads, and those of the functions defined within it, each once and in order.

    `co_names` alone would hold attributes too: the T of `R.T` is no name of the notebook.
    """
    found = dict.fromkeys(i.argval for i in dis.get_instructions(code) if i.opname in ("LOAD_GLOBAL", "LOAD_NAME"))
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            found |= dict.fromkeys(_names(constant))
    return list(found)


def _is_data(value):
    if isinstance(value, bool) or callable(value) or isinstance(value, types.ModuleType):
        return False
    return isinstance(value, DATA_TYPES) or type(value).__module__.split(".")[0] in ("numpy", "labkit")
