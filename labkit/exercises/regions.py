"""The general layer, values: whether a wrong value is what the solution's computation gives with one change.

A value is computed in its cell from what the cells before it bound. Of these, what it needs is run again, functions and
values of other exercises being the references; then the computation is run with one change after the other.
"""

import ast
import contextlib
import copy
import functools
import io
import warnings

import numpy as np

from . import guard, mutation, relations, slips

DIGITS = 5  # so many must agree: some three hundred changes are met by chance by one rounded answer in some hundreds
MOST = 400  # changes that are tried
SIZE = 200_000  # entries of data that may stand in the place of others


def change_words(value, answer, is_right, seconds):
    """The change of the solution's computation that gives this answer, in words; None where none does in time.

    Parameters
    ----------
    value : Value
    answer : float or ndarray
    is_right : function
        Of an array: whether it is the value, as the computation without any change must give it.
    seconds : float
        Of processor time; as much again may be spent on what the computation needs.
    """
    if value.chapter is None:
        return None
    unchanged, changed = _variants(value, seconds)
    if unchanged is None or not is_right(unchanged) or relations.are_fractions(answer, unchanged):
        return None
    words = next((words for words, found in changed if _agrees(answer, found) and not _is_put_in(answer, words)), None)
    return words and f"this is what a right computation gives {words}"


def _is_put_in(answer, words):
    """Whether the change puts 0 or 1 somewhere, and this is the answer: whoever typed it made no such change."""
    return any(words.startswith(f"with {number} in ") and np.all(answer == number) for number in (0, 1))


_FOUND = {}  # what `_variants` gave, by notebook and exercise: it does not depend on the answer


def _variants(value, seconds):
    """What the computation gives, and what comes of it with one change after the other, with this in words."""
    key = value.chapter.notebook, value.id
    if key not in _FOUND:
        _FOUND[key] = _computed(_prepared(value, seconds), seconds)
    return _FOUND[key]


def _computed(prepared, seconds):
    if prepared is None:
        return None, []
    function, data = prepared
    unchanged, changed = None, []
    with contextlib.suppress(guard.TimeLimit), guard.time_limit(seconds):
        unchanged = _run(function, data, contextlib.nullcontext())
        for change in mutation.changes(function)[:MOST]:
            found = _run(function, data, change.made())
            if found is not None:
                changed.append((change.words, found))
    return unchanged, changed


def _run(function, data, made):
    """What the computation gives within `made`, as an array; None where it fails."""
    known = dict(data)
    try:
        with warnings.catch_warnings(action="ignore"), np.errstate(all="ignore"), made:
            exec(compile(ast.Module([function], []), "<a computation with one change>", "exec"), known)
            with contextlib.redirect_stdout(io.StringIO()), guard.only_finite_matrices():
                return np.asarray(known[function.name](**_arguments(function, data)), dtype=float)
    except Exception:  # a change may well make nonsense of a computation
        return None


def _arguments(function, data):
    return {argument.arg: data[argument.arg] for argument in function.args.args}


def _agrees(answer, found):
    answer = np.asarray(answer, dtype=float)
    if answer.shape != found.shape or not np.isfinite(found).all() or not np.any(found):
        return False
    size = np.abs(found).max()
    off = np.abs(answer - found).max() / size
    return off <= 1e-9 or off < 20.0 * 10.0**-DIGITS and relations.significant_digits(answer, found) >= DIGITS


@functools.cache
def _region(notebook, id):
    """(statements before the cell's computation, the computation as a function without arguments); None if unknown."""
    before = []
    for cell in slips._cells(notebook):
        statements = ast.parse(cell.text).body
        asked = [(k, _asked(node, id)) for k, node in enumerate(statements)]
        call = next(((k, call) for k, call in asked if call is not None), None)
        if call is not None:
            body = [node for node in statements[: call[0]] if not _is_stub(node)]
            body.append(ast.copy_location(ast.Return(call[1].args[0]), call[1]))
            nothing = ast.arguments(posonlyargs=[], args=[], kwonlyargs=[], kw_defaults=[], defaults=[])
            function = ast.FunctionDef("value", nothing, body, [], None, lineno=1, col_offset=0)
            return before, ast.fix_missing_locations(function)
        before += statements
    return None


def _asked(node, id):
    """The call `ex.id(...)` in a statement."""
    calls = (n for n in ast.walk(node) if isinstance(n, ast.Call) and isinstance(n.func, ast.Attribute) and n.args)
    return next((n for n in calls if n.func.attr == id and getattr(n.func.value, "id", "") == "ex"), None)


def _is_stub(node):
    return isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant) and node.value.value is ...


def _prepared(value, seconds):
    """The computation, with the data it reads as arguments, and what it needs by name; None where it cannot be run."""
    found = _region(value.chapter.notebook, value.id)
    if found is None:
        return None
    before, function = found[0], copy.deepcopy(found[1])
    needed, stored = _names(function)
    known = {item.id: item.reference for item in value.chapter.items if hasattr(item, "draw")}
    try:
        with (
            guard.time_limit(seconds),
            contextlib.redirect_stdout(io.StringIO()),
            warnings.catch_warnings(action="ignore"),
        ):
            for node in _sliced(before, needed - stored, set(known)):
                answered = next((i for i in value.chapter.items if _asked(node, i.id) is not None), None)
                if answered is not None:
                    known[node.targets[0].id] = answered.reference()
                else:
                    exec(compile(ast.Module([node], []), "<before a value>", "exec"), known)
    except (Exception, guard.TimeLimit):
        return None
    known.pop("__builtins__", None)
    names = [name for name in known if name not in stored and _is_data(known[name])]
    function.args.args = [ast.arg(name) for name in names]
    return ast.fix_missing_locations(function), known


def _is_data(value):
    return isinstance(value, int | float | np.ndarray | np.number) and np.size(value) <= SIZE


def _names(node):
    """(names that are read, names that are bound) in a part of the tree."""
    names = [n for n in ast.walk(node) if isinstance(n, ast.Name)]
    bound = {n.id for n in names if isinstance(n.ctx, ast.Store)}
    bound |= {a.arg for n in ast.walk(node) if isinstance(n, ast.arguments) for a in n.args}
    return {n.id for n in names if isinstance(n.ctx, ast.Load)}, bound


def _sliced(statements, needed, references):
    """The statements that bind what is needed, in their order; what references stand for is known."""
    needed, kept = needed - references, []
    for node in reversed(statements):
        if isinstance(node, ast.FunctionDef) and any(_is_of_ex(d) for d in node.decorator_list):
            continue
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = {(alias.asname or alias.name).partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.FunctionDef):
            names = {node.name}
        elif _is_stub(node) or isinstance(node, ast.Expr):
            continue
        else:
            names = _names(node)[1] | _filled(node)
        if names & needed:
            kept.append(node)
            needed |= _names(node)[0] - references - {"ex"}
    return kept[::-1]


def _is_of_ex(decorator):
    return getattr(getattr(decorator, "value", None), "id", "") == "ex"


def _filled(node):
    """Names of arrays that a statement writes into."""
    targets = [n.value for n in ast.walk(node) if isinstance(n, ast.Subscript) and isinstance(n.ctx, ast.Store)]
    return {target.id for target in targets if isinstance(target, ast.Name)}
