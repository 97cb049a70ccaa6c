"""The general layer, slips: whether a wrong result is that of a right formula with one change.

The chapter's own solution is changed in one place after the other, and its result compared with the student's. What is
said is true by construction, and names the slip without showing the formula.
"""

import ast
import copy
import functools
import re
import warnings

from ..places import ROOT
from . import mutation, source

RANKS = 400  # changes that are tried at most
BY_CHANCE = re.compile("with `[!=]=` where `[<>]")  # as good as always true, or never: so is many another slip


def changed_formulas(exercise):
    """(words, function) of what comes of the chapter's solution when one thing is changed, the likeliest first.

    Nothing where the solutions are not at hand: an edition for students may leave them out.
    """
    solution = _solution(exercise)
    if solution is None:
        return
    function, known = solution
    for change in _changes(exercise.chapter.notebook, exercise.id)[:RANKS]:
        if BY_CHANCE.search(change.words):
            continue
        namespace = dict(known)
        try:
            with warnings.catch_warnings(action="ignore"), change.made():  # also of nonsense, such as 2[0]
                code = compile(ast.Module([function], []), "<a formula with one change>", "exec")
            exec(code, namespace)
        except (SyntaxError, ValueError, RecursionError):
            continue
        yield change.words, namespace[function.name]


def solved(exercise):
    """The solution's function and its tree; None where the solutions are not at hand."""
    solution = _solution(exercise)
    if solution is None:
        return None
    tree, known = copy.deepcopy(solution[0]), solution[1]
    exec(compile(ast.Module([tree], []), "<a solution>", "exec"), known)
    return known[tree.name], tree


@functools.cache
def _changes(notebook, id):
    return mutation.changes(_function(notebook, id))


def _solution(exercise):
    """The function as the solution writes it, and the names its notebook knows: imports and the other exercises."""
    if exercise.chapter is None or _function(exercise.chapter.notebook, exercise.id) is None:
        return None
    known = dict(_imported(exercise.chapter.notebook))
    for item in exercise.chapter.items:
        if hasattr(item, "draw"):
            known[item.id] = item.reference
    return _function(exercise.chapter.notebook, exercise.id), known


def _cells(notebook):
    try:
        cells = source.read(ROOT / "solutions" / f"{notebook}.py")
    except (OSError, source.SourceError):
        return []
    return [cell for cell in cells if cell.kind == "code" and "student" not in cell.tags]


@functools.cache
def _functions(notebook):
    """The solved functions of a notebook by the exercise that checks them, without docstring and decorator."""
    found = {}
    for cell in _cells(notebook):
        for node in ast.parse(cell.text).body:
            asked = [d for d in getattr(node, "decorator_list", ()) if isinstance(d, ast.Attribute)]
            if isinstance(node, ast.FunctionDef) and asked and getattr(asked[0].value, "id", "") == "ex":
                node.decorator_list = []
                if ast.get_docstring(node) is not None:
                    node.body = node.body[1:]
                found[asked[0].attr] = node
    return found


def _function(notebook, id):
    return _functions(notebook).get(id)


@functools.cache
def _imported(notebook):
    known = {}
    for cell in _cells(notebook):
        for node in ast.parse(cell.text).body:
            if isinstance(node, ast.Import | ast.ImportFrom):
                exec(compile(ast.Module([node], []), "<imports>", "exec"), known)
    return known
