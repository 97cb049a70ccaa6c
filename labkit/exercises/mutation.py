"""All single changes of a function's syntax tree: the slips that a hand makes in a right formula.

Each comes with words that say what was changed, to be read behind "your result is what a right formula gives", and
with words for the other direction, where the change is made in a wrong function and mends it. The general layer
compares a wrong result with what the first give (`slips`), and mends a student's own code by the second (`steps`);
`tests/bench/mutants.py` types them into the checks.
"""

import ast
import contextlib
import copy
import functools
import itertools
import math
import re
from dataclasses import dataclass

PAIRS = (
    *(("sin", "cos"), ("arcsin", "arccos"), ("min", "max"), ("minimum", "maximum"), ("argmin", "argmax")),
    *(("any", "all"), ("zeros", "ones"), ("deg2rad", "rad2deg"), ("hstack", "vstack")),
)
PRECISIONS = {"float16": ("float64",), "float32": ("float64",), "single": ("float64",), "half": ("float64",)}
TWINS = {name: (twin,) for pair in PAIRS for name, twin in (pair, pair[::-1])} | {
    "tan": ("sin", "cos"),
    "arctan2": ("hypot",),
    "sum": ("mean", "max"),
    "mean": ("sum", "median"),
    "median": ("mean",),
    "prod": ("sum",),
    "std": ("var",),
    "var": ("std",),
    "eye": ("ones",),
    "floor": ("ceil", "round"),
    "ceil": ("floor", "round"),
    "inv": ("transpose", "reciprocal"),
    "pinv": ("transpose",),
    "log": ("log10",),
    "exp": ("exp2",),
    "multiply": ("outer",),
    "inner": ("outer",),
    "standard_normal": ("random",),
    "normal": ("uniform",),
}
WRAPPERS = {"array", "asarray", "float", "int", "list", "tuple", "range", "len", "zip", "enumerate", "bool", "set"}
MODULES = {"np", "numpy", "math", "scipy"}  # what they hold is no data of the notebook
CAST = "astype"  # the argument of which is no value
APPLIED = {"dot", "apply"}  # methods without which their argument is left, not what they are called of
NO_SEARCH = {"map", "filter", "sorted", "max", "min", "sum", "vectorize", "fromfunction", "apply_along_axis", "reduce"}
GUARD = 1e-3  # below which a bound stands for 0
BOUNDED = {"clip"}  # exchanged, a value and its bound make a constant: that mends, and is not what happened
BOUNDS = {"max", "min", "maximum", "minimum"}
SIGNS = {ast.Add: "plus", ast.Sub: "minus", ast.Mult: "`*`", ast.Div: "`/`", ast.MatMult: "`@`", ast.Pow: "`**`"}
SIGNS |= {ast.FloorDiv: "`//`", ast.Mod: "`%`"}
OTHERS = {
    ast.Add: (ast.Sub, ast.Mult),
    ast.Sub: (ast.Add, ast.Div),
    ast.Mult: (ast.Div, ast.Add, ast.MatMult),
    ast.Div: (ast.Mult, ast.Sub),
    ast.MatMult: (ast.Mult,),
    ast.FloorDiv: (ast.Div,),
    ast.Mod: (ast.FloorDiv,),
}
COMPARISONS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
STRICT = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}  # and what is so but for one number
ORDINALS = ("first", "second", "third")
EQUALITIES = (ast.Eq, ast.NotEq)
WITHOUT = {
    ast.Add: "without one of its terms",
    ast.Sub: "without one of its terms",
    ast.Mult: "without one of its factors",
    ast.Div: "without one of its divisions",
    ast.MatMult: "without one matrix of a product",
    ast.Pow: "without one of its powers",
    ast.Mod: "without one of its remainders",
}
PARTS = {  # what of an operation is left out with its sign
    ast.Add: "term",
    ast.Sub: "term",
    ast.Mult: "factor",
    ast.Div: "division by",
    ast.MatMult: "matrix",
    ast.Pow: "power",
    ast.Mod: "remainder by",
}
COMMUTE = {ast.Add, ast.Mult, ast.MatMult}  # where either side can be left out alone


REDUCTIONS = {"sum", "mean", "median", "std", "var", "prod", "max", "min", "norm", "argmax", "argmin", "any", "all"}
COARSE, FINE = 1e-6, 1e-6  # from which on a bound or a step of differences may be too large, and what part of it is not
LESS = {FINE: "millionth", 1e-3: "thousandth"}  # of a step: where the one is too small, as rounding is divided by it
FINER = -1  # the rank of what is made finer: few changes, tried by themselves, before others make loops without an end
TINY, LONGER, MILD = 1e-6, (1e3, 1e6), 1e-5  # up to which a step of differences may be too short, how many times as
# long is not, and how long at most
ADDED = 0.01  # up to which a number that is added may be there to keep a divisor from 0
ITERATION = 20  # rounds of a loop that goes on until nothing changes, and not through what is given
ROUNDS = 400  # of a loop, or ten times as many as it has: enough for what converges
STACKS = {"column_stack", "hstack", "vstack", "stack", "concatenate"}
STACKED = "the part"  # how what is wrong begins where one part less is put together
SHARES = {"isclose", "allclose"}
SIZES = (
    "len({})",
    "len({}) - 1",
    "{}.shape[-1]",
    "len({0}) - {0}.shape[-1]",
)  # what a number that is typed in may stand for
COUNTING = {"num", "size", "shape"}  # keywords behind which a number counts something
NO_COUNTS = {"polyfit", "swapaxes", "moveaxis", "roll", "diff", "matrix_power", "percentile", "quantile"}
TURNED = {"sin": "cos", "cos": "sin"}
TURNS = {90: "np.pi / 2", 180: "np.pi", 360: "2 * np.pi"}
TO_RADIANS = {"deg2rad", "radians"}
ROUNDING = ("round", "around")
EDGES = (  # (functions, what they take, how it is kept there, as it is told)
    (("arccos", "arcsin", "acos", "asin"), ("clip", (-1, 1)), "beyond -1 or 1, and `np.clip` to -1 ... 1"),
    (("sqrt",), ("maximum", (0,)), "below 0, and `np.maximum` with 0"),
)
REPETITIONS = ("tile", "repeat")
TYPED = 2  # the rank of a number that is typed in
ROUNDED = 2e-3  # how far, relatively, a number may lie from a multiple of pi that it is meant to be
PARTNERS = 12  # values read in one step of which any two may have changed places
REPEATED = 1  # how unlikely a slip may be that is looked for in several places at once


@dataclass(frozen=True)
class Change:
    """One change of a function's syntax tree.

    words:  what was changed in a right formula, behind "your result is what a right formula gives".
    mends:  what is wrong where this change makes a function right, as a clause: "plus stands where minus belongs".
    rank:   how unlikely it is.
    place:  the part of the tree that is changed.
    sets:   (node, name of its field, new content), one or two.
    """

    words: str
    mends: str
    rank: int
    place: ast.AST
    sets: tuple

    @contextlib.contextmanager
    def made(self):
        """Within, the function's own tree is the changed one."""
        before = [(node, field, getattr(node, field)) for node, field, _ in self.sets]
        for node, field, new in self.sets:
            setattr(node, field, new)
        try:
            yield
        finally:
            for node, field, old in before:
                setattr(node, field, old)

    def tree(self, function):
        """The changed function, as a tree of its own."""
        with self.made():
            return ast.fix_missing_locations(copy.deepcopy(function))


def changes(function, most=4):
    """All single changes of a function, the likeliest slips first; a changed tree is made when it is asked for.

    Parameters
    ----------
    function : ast.FunctionDef
        A right solution, or a student's.
    most : int
        How unlikely the changes may be: 0 for signs and operators, 1 with what is left out or exchanged, 2 with numbers
        and signs of single names, 3 and 4 with parts squared and names in place of others.

    Returns
    -------
    changes : list of Change
    """
    found, names, indices = [], _names(function), set(_indices(function))
    places = {node.slice for node in ast.walk(function) if isinstance(node, ast.Subscript)}
    limits = set(_typed_limits(function))
    for node, put in _parts(function):
        for rank, words, new in _changed(node, names):
            if node in limits and isinstance(new, ast.Constant) and new.value not in (-1, 0, 1):
                continue  # with any number that is far enough out the limit does nothing
            rank += node in places and rank == 1  # T[3, :3] is 0 in each pose: a term left out says more
            if rank <= most:
                words = COUNTED if node in indices and words == "with one sign turned" else words
                sets = put(new)
                found.append(Change(words, _mends(words, node, new), rank, node, sets))
    if most:
        found += _statements(function)
    return sorted(found, key=lambda change: change.rank)


def _typed_limits(function):
    """Numbers that are typed in as limits of something."""
    for node in ast.walk(function):
        if isinstance(node, ast.Call) and _called(node) in {*BOUNDS, "clip"}:
            for limit in (getattr(argument, "operand", argument) for argument in node.args):
                if isinstance(limit, ast.Constant):
                    yield limit


def _counted_by_loops(function):
    """Changes of a whole number in brackets to the variable of a loop."""
    loops = [n.target.id for n in ast.walk(function) if isinstance(n, ast.For) and isinstance(n.target, ast.Name)]
    for owner in ast.walk(function):
        for field, content in ast.iter_fields(owner):
            if field == "slice" and isinstance(content, ast.Constant) and type(content.value) is int:
                for name in dict.fromkeys(loops):
                    new = ast.copy_location(ast.Name(name, ast.Load()), content)
                    words = f"with {content.value} where `{name}` belongs"
                    mends = f"{content.value} stands where `{name}` belongs"
                    yield Change(words, mends, 2, content, ((owner, field, new),))


def _never_reached(function):
    """A `return` with steps behind it in its block, put behind them."""
    for owner in ast.walk(function):
        for field in ("body", "orelse"):
            block = getattr(owner, field, None)
            before = block[:-1] if isinstance(block, list) else ()
            first = next((k for k, step in enumerate(before) if isinstance(step, ast.Return)), None)
            if first is not None:
                order = [*block[:first], *block[first + 1 :], block[first]]
                mends = "what stands behind this `return` is never reached, and belongs before it"
                yield Change("", mends, 1, block[first], ((owner, field, order),))


def _rounded_pi(function):
    """All numbers that are pi or a simple multiple of it, rounded, with all their digits at once."""
    sets, rounded = [], []
    for owner in ast.walk(function):
        for field, content in ast.iter_fields(owner):
            parts = content if isinstance(content, list) else [content]
            new = [_with_all_digits(part) for part in parts]
            changed = [part for part, other in zip(parts, new) if other is not part]
            if changed:
                sets.append((owner, field, new if isinstance(content, list) else new[0]))
                rounded += changed
    if rounded:
        rounded = sorted(rounded, key=lambda node: (node.lineno, node.col_offset))
        *others, last = dict.fromkeys(str(node.value) for node in rounded)
        are = f"{', '.join(others)} and {last} are" if others else f"{last} is"
        yield Change("", f"{are} rounded: np.pi has all the digits", 1, rounded[0], tuple(sets))


def _sizes(function):
    """The number of all entries of an array, made that of its rows."""
    for node, put in _parts(function):
        if isinstance(node, ast.Attribute) and node.attr == "size":
            new = ast.Call(ast.Name("len", ast.Load()), [node.value], [])
            yield Change("", f"it counts all numbers, and `{ast.unparse(new)}` belongs there", 1, node, put(new))


def _of_no_share(function):
    """Comparisons that allow a share of the numbers as well, `isclose` and `allclose`, all of them without it."""
    group = []
    for node, put in _parts(function):
        if isinstance(node, ast.Call) and _called(node) in SHARES and len(node.args) == 2:
            share = "rel_tol" if ast.unparse(node.func).startswith("math.") else "rtol"
            rest = [keyword for keyword in node.keywords if keyword.arg != share]
            new = ast.Call(node.func, node.args, [*rest, ast.keyword(share, ast.Constant(0))])
            mends = f"`{_called(node)}` allows a share of the numbers besides: `{share}=0` belongs there"
            group.append(Change("", mends, 0, node, put(new)))
    if len(group) == 1:
        yield group[0]
    elif sets := _together(group):
        yield Change("", f"{group[0].mends}, and into its other calls", 0, group[0].place, sets)


def _repeated(function):
    """Lists and tuples that a whole number is to multiply, made arrays: else they are repeated so many times."""
    for node, put in _parts(function):
        if not isinstance(node, ast.BinOp) or not isinstance(node.op, ast.Mult):
            continue
        for value, times in ((node.left, node.right), (node.right, node.left)):
            if isinstance(value, ast.Name | ast.Subscript) and type(getattr(times, "value", None)) is int:
                product = f"np.array({ast.unparse(value)}) * {times.value}"
                listed = f"isinstance({ast.unparse(value)}, (list, tuple))"
                new = ast.parse(f"{product} if {listed} else {ast.unparse(node)}", mode="eval").body
                mends = f"this repeats a list or tuple, and `{product}` belongs there"
                yield Change("", mends, 0, node, put(new))


def _counted_from_nought(function):
    """A last entry less the first one, which need not be 0: meant may be how far the one is from the other."""
    for node, put in _parts(function):
        index = node.slice if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) else None
        if index is not None and ast.unparse(index) == "-1" and isinstance(node.ctx, ast.Load):
            first = ast.Subscript(node.value, ast.Constant(0), ast.Load())
            mends = f"`{ast.unparse(first)}` is to be taken off, as that need not be 0"
            yield Change("", mends, 1, node, put(ast.BinOp(node, ast.Sub(), first)))


def _of_one_triangle(function):
    """Triangular systems of which the lower triangle is meant, or the whole matrix."""
    for node, put in _parts(function):
        if isinstance(node, ast.Call) and _called(node) == "solve_triangular" and len(node.args) == 2:
            if not any(keyword.arg == "lower" for keyword in node.keywords):
                lower = ast.keyword("lower", ast.Constant(True))
                mends = "this reads the upper triangle alone: `lower=True` is missing"
                yield Change("", mends, 0, node, put(ast.Call(node.func, node.args, [*node.keywords, lower])))
            mends = "`solve_triangular` reads one triangle alone: `np.linalg.solve` belongs there, of the whole matrix"
            yield Change("", mends, 1, node, put(ast.Call(_linalg("solve"), node.args, [])))


def _of_diagonals(function):
    """Sums of rows or columns where the diagonal is meant, and a matrix with all but its diagonal set to 0."""
    for node, put in _parts(function):
        inner = _summed_along(node)
        if inner is not None:
            new = _numpy("diag", inner)
            yield Change("", f"sums stand where the diagonal belongs, `{ast.unparse(new)}`", 2, node, put(new))
        inner = _first_argument(_first_argument(node, "diag"), "diag")
        if inner is not None:
            mends = f"all but the diagonal is set to 0, and all of `{ast.unparse(inner)}` belongs there"
            yield Change("", mends, 1, node, put(inner))


def _summed_along(node):
    """What is summed along one axis, as an argument or as the owner of the method; None in any other part."""
    if not isinstance(node, ast.Call) or _called(node) != "sum" or [k.arg for k in node.keywords] != ["axis"]:
        return None
    return node.args[0] if node.args else getattr(node.func, "value", None)


def _first_argument(node, name):
    """The only argument of a call of this name; None where it is anything else."""
    alone = isinstance(node, ast.Call) and _called(node) == name and len(node.args) == 1 and not node.keywords
    return node.args[0] if alone else None


def _lost_signs(function):
    """Roots of 1 less the square of a sine or a cosine: the other of the two, which has a sign."""
    bound = dict(_bound_turns(function))
    for node, put in _parts(function):
        part = _squared_beside_1(node)
        turn = bound.get(part.id) if isinstance(part, ast.Name) else part
        if _is_turn(turn):
            new = ast.Call(_numpy(TURNED[_called(turn)], turn).func, turn.args, [])
            yield Change("", f"a root is never negative, and `{ast.unparse(new)}` belongs there", 1, node, put(new))


def _bound_turns(function):
    """(name, call) of each sine or cosine that a step binds to a name, alone or with others."""
    for step in (node for node in ast.walk(function) if isinstance(node, ast.Assign)):
        target, value = step.targets[0], step.value
        both = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
        for to, of in zip(target.elts, value.elts) if both else [(target, value)]:
            if isinstance(to, ast.Name) and _is_turn(of):
                yield to.id, of


def _is_turn(node):
    return isinstance(node, ast.Call) and _called(node) in TURNED and len(node.args) == 1


def _squared_beside_1(node):
    """What stands squared in a root of 1 less it; None in any other part of the code."""
    if not isinstance(node, ast.Call) or _called(node) != "sqrt" or len(node.args) != 1:
        return None
    less = node.args[0]
    if not isinstance(less, ast.BinOp) or not isinstance(less.op, ast.Sub) or _number(less.left) != 1:
        return None
    square = less.right
    if isinstance(square, ast.BinOp) and isinstance(square.op, ast.Pow) and _number(square.right) == 2:
        return square.left
    twice = isinstance(square, ast.BinOp) and isinstance(square.op, ast.Mult)
    return square.left if twice and ast.dump(square.left) == ast.dump(square.right) else None


def _with_all_digits(node):
    """A number with the digits of the multiple of pi that it is, rounded; any other part of the code as it is."""
    if not isinstance(node, ast.Constant) or type(node.value) is not float or not node.value:
        return node
    for exact in (math.pi, 2 * math.pi, math.pi / 2, math.pi / 180, 180 / math.pi):
        if 0 < abs(node.value / exact - 1) < ROUNDED:
            return ast.copy_location(ast.Constant(exact), node)
    return node


def _everywhere(found):
    """One change made at all places at once that look alike but for their names, or lose the same function."""
    alike = {}
    for change in found:
        if _is_cancelled(change):
            continue
        likely = change.rank <= REPEATED or isinstance(change.place, ast.Attribute)  # `wells.value` for `f`, each time
        if likely and change.mends and isinstance(change.place, ast.expr):
            alike.setdefault((change.words, _form(change.place), _form(_put(change))), []).append(change)
            if isinstance(change.place, ast.Call) and re.fullmatch(r"without `\w+`", change.words):
                kept = change.place.args.index(_put(change)) if _put(change) in change.place.args else None
                alike.setdefault((change.words, ast.unparse(change.place.func), kept), []).append(change)
    for group in alike.values():
        sets = _together(group)
        if sets is None or any(_holds(a.place, b.place) for a in group for b in group):
            continue
        first, *others = sorted(group, key=lambda change: (change.place.lineno, change.place.col_offset))
        also = " and ".join(f"`{ast.unparse(other.place)}` (line {other.place.lineno})" for other in others)
        yield Change(first.words, f"{first.mends}, and the same in {also}", first.rank, first.place, sets)


def _is_cancelled(change):
    """Whether a number is added in the place of a factor, or taken off: made in several places it may well cancel."""
    here, new = change.place, _put(change) if isinstance(change.place, ast.BinOp) else None
    sums = isinstance(getattr(new, "op", None), ast.Add | ast.Sub) and not isinstance(here.op, ast.Add | ast.Sub)
    return sums and any(isinstance(side, ast.Constant) for side in (here.left, here.right))


def _put(change):
    """What a change puts in the place of a part."""
    owner, field, new = change.sets[0]
    return next(n for o, n in zip(getattr(owner, field), new) if n is not o) if isinstance(new, list) else new


def _together(group):
    """What several changes set, in lists as well; None where there is one, or two of them change the same part."""
    sets = {}
    for change in group:
        owner, field, new = change.sets[0]
        _, _, before = sets.setdefault((id(owner), field), (owner, field, new))
        if before is new:
            continue
        if not isinstance(new, list) or any(
            a is not o and b is not o for o, a, b in zip(getattr(owner, field), before, new)
        ):
            return None
        both = [b if a is o else a for o, a, b in zip(getattr(owner, field), before, new)]
        sets[id(owner), field] = owner, field, both
    return tuple(sets.values()) if len(group) > 1 else None


def _form(node):
    """What a part of the code looks like without the names of its values."""
    return re.sub(r"\bid='(?!np'|math')\w+'", "id=''", ast.dump(node))


def _holds(one, other):
    """Whether a part of the code stands within another one."""
    return one is not other and any(part is other for part in ast.walk(one))


def _indices(function):
    """What stands in brackets, or on either side of a colon there: its sign says from which end is counted."""
    for node in ast.walk(function):
        if isinstance(node, ast.Subscript):
            yield from node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        elif isinstance(node, ast.Slice):
            yield from (node.lower, node.upper)


def mending(function):
    """What may mend a function: all single changes, and besides them bounds and steps made finer, loops made longer,
    gone on with or begun at 0, an axis, an outer product, an index that a loop should count, an argument or a size that
    is typed in, a pi of three digits, the sign that a root has lost, a diagonal that is meant or is not, a share that a
    comparison allows, a list that is repeated, a first entry that is not taken off the last one, a triangle, what
    rounding brings beyond what a function takes, and one slip mended wherever it stands: who copies a line copies its
    slip.
    """
    found = changes(function)
    narrower = list(_narrower(function, found))
    found = [change for change in found if not any(change is other for other in narrower)]
    found += _with_an_axis(function)
    found = [*_finer(function), *found, *_counted_by_loops(function), *_everywhere(found)]
    found += [*_finer_differences(function), *_with_an_outer_product(function), *_of_rounds(function)]
    found += [
        *_begun_late(function),
        *_typed_numbers(function),
        *_exchanged_throughout(function),
        *_from_the_first(function),
    ]
    found += [
        *_shorter_steps(function),
        *_longer_steps(function),
        *_rounded_pi(function),
        *_never_reached(function),
        *_unstacked(function),
    ]
    found += _lost_signs(function)
    found += _of_diagonals(function)
    found += _sizes(function)
    found += _of_no_share(function)
    found += _repeated(function)
    found += [*_counted_from_nought(function), *_of_one_triangle(function)]
    found += _kept_within(function)
    meant = {*_digits_left(function), *_not_repeated(function), *_typed_starts(function)}
    return sorted((change for change in found if change.place not in meant), key=lambda change: change.rank)


def starts(function):
    """What is handed to a search beside a function, where it begins: the right result stays where it is there, and from
    another place it may well be found.
    """
    functions = {node.name for node in ast.walk(function) if isinstance(node, ast.FunctionDef)}
    steps = [n for n in ast.walk(function) if isinstance(n, ast.Assign) and isinstance(n.targets[0], ast.Name)]
    functions |= {step.targets[0].id for step in steps if isinstance(step.value, ast.Lambda)}
    for call in (node for node in ast.walk(function) if isinstance(node, ast.Call) and _called(node) not in NO_SEARCH):
        handed = [*call.args, *(keyword.value for keyword in call.keywords)]
        beside = [
            part for part in handed if not isinstance(part, ast.Lambda) and getattr(part, "id", "") not in functions
        ]
        if len(beside) < len(handed):
            yield from beside
            yield from (step.value for step in steps if step.targets[0].id in {getattr(p, "id", "") for p in beside})


def _typed_starts(function):
    """Parts of where a search begins, if that is made of numbers alone."""
    for start in starts(function):
        if {n.id for n in ast.walk(start) if isinstance(n, ast.Name)} <= MODULES:
            yield from ast.walk(start)


def _kept_within(function):
    """Arccosines, arcsines and roots of what is kept where they are defined: rounding may bring it beyond."""
    for call, put in _parts(function):
        name = _called(call) if isinstance(call, ast.Call) and len(call.args) == 1 else ""
        for names, (keep, limits), words in EDGES:
            if name in names:
                new = ast.Call(call.func, [_numpy(keep, call.args[0], *map(ast.Constant, limits))], call.keywords)
                yield Change("", f"what is put in comes out {words} belongs around it", 1, call, put(new))


def _digits_left(function):
    """Numbers that say to how many digits something is rounded: with any of them the rounding is too much."""
    for call in (node for node in ast.walk(function) if isinstance(node, ast.Call)):
        if getattr(call.func, "attr", getattr(call.func, "id", "")) in ROUNDING:
            yield from (part for part in call.args if isinstance(part, ast.Constant))
            yield from (keyword.value for keyword in call.keywords)


def _not_repeated(function):
    """Each 1 that says along which axis nothing is repeated: with a 0 in its place the whole is left out."""
    for call in (node for node in ast.walk(function) if isinstance(node, ast.Call)):
        if getattr(call.func, "attr", "") in REPETITIONS:
            parts = (part for argument in call.args[1:] for part in ast.walk(argument))
            yield from (part for part in parts if isinstance(part, ast.Constant) and part.value == 1)


def _with_an_axis(function):
    """Sums, means and the like of all numbers of an array, taken along one axis."""
    for node, put in _parts(function):
        for axis in (0, 1) if _takes_all(node) else ():
            new = ast.Call(node.func, node.args, [*node.keywords, ast.keyword("axis", ast.Constant(axis))])
            mends = f"this takes all numbers together, and `axis={axis}` belongs there"
            yield Change("", mends, 1, node, put(new))


def _unstacked(function):
    """Arrays put together of one part less."""
    for call in (node for node in ast.walk(function) if isinstance(node, ast.Call) and node.args):
        name, parts = getattr(call.func, "attr", ""), call.args[0]
        if name not in STACKS or not isinstance(parts, ast.List | ast.Tuple) or len(parts.elts) < 2:
            continue
        for i, part in enumerate(parts.elts):
            new = type(parts)([*parts.elts[:i], *parts.elts[i + 1 :]], ast.Load())
            _locate(new, parts)
            mends = f"{STACKED} `{ast.unparse(part)}` should be left out"
            yield Change("", mends, 1, parts, ((call, "args", [new, *call.args[1:]]),))


def _takes_all(node):
    """Whether this is a call of a sum, a mean or the like without an axis: of NumPy, or a method of an array."""
    if not isinstance(node, ast.Call) or getattr(node.func, "attr", "") not in REDUCTIONS or node.keywords:
        return False
    of_numpy = ast.unparse(node.func).startswith("np.")
    return len(node.args) == of_numpy


def _with_an_outer_product(function):
    """A vector times itself, made a matrix."""
    for owner in ast.walk(function):
        for field, node in ast.iter_fields(owner):
            if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.MatMult | ast.Pow):
                left, right = node.left, node.right
                alike = ast.unparse(right) in (ast.unparse(left), f"{ast.unparse(left)}.T")
                if alike or isinstance(node.op, ast.Pow) and getattr(right, "value", None) == 2:
                    new = _numpy("outer", left, left)
                    _locate(new, node)
                    yield Change(
                        "", "`np.outer` makes a matrix of it, and belongs there", 2, node, ((owner, field, new),)
                    )


def _of_rounds(function):
    """Loops that go on where `break` ends them, and those that keep the largest, or the least, where they add up."""
    for owner in ast.walk(function):
        for field in ("body", "orelse"):
            block = getattr(owner, field, None)
            for i, statement in enumerate(block if isinstance(block, list) else ()):
                for mends, new in _other_rounds(statement):
                    _locate(new, statement)
                    yield Change("", mends, 2, statement, ((owner, field, [*block[:i], new, *block[i + 1 :]]),))


def _other_rounds(statement):
    if isinstance(statement, ast.Break):
        yield "the rounds behind it are left out, and `continue` belongs there", ast.Continue()
    adds = isinstance(statement, ast.AugAssign) and isinstance(statement.op, ast.Add)
    if adds and isinstance(statement.target, ast.Name):
        so_far = ast.Name(statement.target.id, ast.Load())
        for keep, words in (("max", "largest"), ("min", "least")):
            kept = ast.Call(ast.Name(keep, ast.Load()), [so_far, statement.value], [])
            yield f"all are added up here, and the {words} belongs there", ast.Assign([statement.target], kept)


def _narrower(function, found):
    """Changes that draw bounds nearer together, those of `np.clip` or one of `max` and the like: they mend where any
    constant would.
    """
    calls = [n for n in ast.walk(function) if isinstance(n, ast.Call) and len(n.args) > 1]
    within = {part: call for call in calls for part in ast.walk(call) if _limits(call)}
    for change in found:
        call = within.get(change.place)
        if call is None:
            continue
        (low, high), name = _limits(call), _called(call)
        with change.made():
            new = _limits(call) if _called(call) == name and len(call.args) > 1 else None
        if new and (new[0] > low or new[1] < high):
            yield change


def _called(call):
    return getattr(call.func, "attr", getattr(call.func, "id", ""))


def left_alone(change):
    """The part that a change leaves of a call with several arguments, as it is typed; "" for any other change."""
    call = change.place
    if len(change.sets) > 1 or not isinstance(call, ast.Call) or not re.fullmatch(r"without `\w+`", change.words):
        return ""
    several = len(call.args) + len(call.keywords) + (_put(change) not in call.args) > 1
    return ast.unparse(_put(change)) if several else ""


def _limits(call):
    """Between which numbers, typed in, a call keeps what it is given; None where it does not."""
    name, numbers = _called(call), [_number(part) for part in call.args]
    if name == "clip" and len(numbers) == 3 and None not in numbers[1:]:
        return numbers[1], numbers[2]
    typed = [number for number in numbers if number is not None]
    if len(typed) != 1:
        return None
    return {"max": (typed[0], math.inf), "min": (-math.inf, typed[0])}.get(name.removesuffix("imum"))


def _number(node):
    """A number as it is typed, with or without a sign; None for anything else."""
    try:
        value = ast.literal_eval(node)
    except ValueError:
        return None
    return value if isinstance(value, int | float) else None


def _finer(function):
    """Numbers that end a loop, bound a case, keep a divisor from 0 or make a step of differences, so small or large
    that they do no harm.
    """
    for owner in ast.walk(function):
        if isinstance(owner, ast.Compare) and len(owner.ops) == 1:
            number = owner.comparators[0]
            if _is_coarse(number) and isinstance(owner.ops[0], ast.Lt | ast.LtE | ast.Gt | ast.GtE):
                yield _with_a_part_of_it(FINER, owner, "comparators")
        elif isinstance(owner, ast.BinOp) and isinstance(owner.op, ast.Add):
            for side in ("left", "right"):
                number = getattr(owner, side)
                if _is_coarse(number, ADDED):
                    yield _with_a_part_of_it(FINER, owner, side)
        elif isinstance(owner, ast.Assign):
            both = isinstance(owner.value, ast.Tuple)
            for k, number in enumerate(owner.value.elts if both else [owner.value]):
                for part in LESS if _is_coarse(number) else ():
                    yield _with_a_part_of_it(2, *((owner.value, "elts") if both else (owner, "value")), part, k)
        elif isinstance(owner, ast.For) and getattr(getattr(owner.iter, "func", None), "id", "") == "range":
            given = owner.iter.args
            if len(given) == 1 and isinstance(given[0], ast.Constant) and type(given[0].value) is int:
                rounds = given[0].value
                for more in (max(10 * rounds, ROUNDS), 100 * rounds)[: 2 if rounds >= ITERATION else 1]:
                    number = ast.copy_location(ast.Constant(more), given[0])
                    mends = f"these are too few rounds: on all draws here {more} will do"
                    yield Change("", mends, FINER, owner.iter, ((owner.iter, "args", [number]),))


def _exchanged_throughout(function):
    """Two names, or two entries of one array, that change places wherever they stand in a step."""
    for statement in ast.walk(function):
        if not isinstance(statement, ast.Assign | ast.AugAssign | ast.Return) or statement.value is None:
            continue
        read, values = {}, statement.value
        for node in ast.walk(values):
            if _may_change_places(node):
                read.setdefault(ast.unparse(node), []).append(node)
        calls = [node for node in ast.walk(values) if isinstance(node, ast.Call)]
        fixed = {part for call in calls for part in ast.walk(call if _is_bound(call) else call.func)}
        texts = [text for text, nodes in read.items() if not fixed & set(nodes)][:PARTNERS]
        for one, other in itertools.combinations(texts, 2):
            if _alike(read[one][0], read[other][0]):
                sets = [_turned_into(node, read[other][0]) for node in read[one]]
                sets += [_turned_into(node, read[one][0]) for node in read[other]]
                mends = f"`{one}` and `{other}` have changed places in this step"
                yield Change("", mends, 2, values, tuple(itertools.chain(*sets)))


def _is_bound(call):
    """Whether a call holds a value within bounds: then another one in its place is another bound, and no exchange."""
    return _called(call) in BOUNDED | BOUNDS


def _may_change_places(node):
    """Whether this is a name, or one entry of an array, that is read."""
    if not isinstance(getattr(node, "ctx", None), ast.Load):
        return False
    if isinstance(node, ast.Name):
        return node.id not in ("np", "math")
    return isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) and _is_entry(node.slice)


def _is_entry(index):
    numbers = index.elts if isinstance(index, ast.Tuple) else [index]
    return all(isinstance(number, ast.Constant) and type(number.value) is int for number in numbers)


def _alike(one, other):
    """Whether both are names, or both entries of one array."""
    if isinstance(one, ast.Subscript) and isinstance(other, ast.Subscript):
        return one.value.id == other.value.id
    return isinstance(one, ast.Name) and isinstance(other, ast.Name)


def _turned_into(node, other):
    """What is to be set to make another name, or another entry, of this one."""
    if isinstance(node, ast.Name):
        return ((node, "id", other.id),)
    return ((node, "slice", other.slice),)


def _finer_differences(function):
    """Quotients of differences whose step is a number that is typed in several times, it or its double as a divisor."""
    coarse = [found for found in _typed(function) if _is_coarse(found[-1])]
    for step in sorted({node.value for *_, node in coarse}):
        alike = [found for found in coarse if found[-1].value in (step, 2 * step)]
        quotients = [owner for owner, field, *_ in alike if field == "right" and isinstance(owner.op, ast.Div)]
        for part, word in LESS.items() if quotients else ():
            if sets := _together(_all_turned_into(lambda step, part=part: part * step, alike)):
                mends = f"`{step}` is far too long a step for differences: a {word} of it will do, wherever it stands"
                yield Change("", mends, FINER, quotients[0], sets)


def _all_turned_into(other, alike):
    """The changes of numbers that are typed in, wherever they stand, into `other` of them."""
    group = []
    for owner, field, content, i, node in alike:
        new = ast.copy_location(ast.Constant(other(node.value)), node)
        whole = [*content[:i], new, *content[i + 1 :]] if isinstance(content, list) else new
        group.append(Change("", "", FINER, node, ((owner, field, whole),)))
    return group


def _longer_steps(function):
    """Tiny steps of differences made a thousand or a million times as long, wherever they stand: rounding is divided by
    them.
    """
    tiny = [found for found in _typed(function) if type(found[-1].value) is float and 0 < found[-1].value <= TINY]
    for number, times in itertools.product(sorted({node.value for *_, node in tiny}), LONGER):
        alike = [found for found in tiny if found[-1].value == number]
        longer = float(f"{times * number:g}")
        if times > LONGER[0] and longer > MILD or not _is_step(function, {node for *_, node in alike}):
            continue
        group = _all_turned_into(lambda _, longer=longer: longer, alike)
        if sets := group[0].sets if len(group) == 1 else _together(group):
            mends = f"rounding shows where a step is as short as this: {longer:g} will do"
            yield Change("", mends, FINER, group[0].place, sets)


def _is_step(function, numbers):
    """Whether numbers that are typed in, or a name bound to them, divide without a sum, and whether they, or what is
    made of them, are added somewhere.
    """
    bound = set()
    for step in (node for node in ast.walk(function) if isinstance(node, ast.Assign)):
        target, value = step.targets[0], step.value
        both = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
        pairs = zip(target.elts, value.elts) if both else [(target, value)]
        bound |= {to.id for to, of in pairs if of in numbers and isinstance(to, ast.Name)}

    def holds(part, names=bound):
        return any(node in numbers or getattr(node, "id", None) in names for node in ast.walk(part))

    made = set(bound)
    for to, of in _bindings(function):
        made |= {n.id for n in ast.walk(to) if isinstance(n, ast.Name)} if holds(of, made) else set()
    sums = [n for n in ast.walk(function) if isinstance(n, ast.BinOp | ast.AugAssign) and _adds(n)]
    divisors = [n.right for n in ast.walk(function) if isinstance(n, ast.BinOp) and isinstance(n.op, ast.Div)]
    divisors += [n.value for n in ast.walk(function) if isinstance(n, ast.AugAssign) and isinstance(n.op, ast.Div)]
    return any(holds(n, made) for n in sums) and any(holds(d) and not any(map(_adds, ast.walk(d))) for d in divisors)


def _bindings(function):
    """(what is bound, to what) by steps, loops and comprehensions, line by line."""
    found = []
    for node in ast.walk(function):
        if isinstance(node, ast.Assign):
            to = node.targets[0]
            found.append((to.value if isinstance(to, ast.Subscript) else to, node.value))
        if isinstance(node, ast.For | ast.comprehension):
            found.append((node.target, node.iter))
    return sorted(found, key=lambda pair: pair[0].lineno)


def _adds(node):
    return isinstance(getattr(node, "op", None), ast.Add | ast.Sub)


def _begun_late(function):
    """Loops over `range(first, behind)` that begin at 0."""
    for node in ast.walk(function):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "range" and len(node.args) == 2:
            mends = f"the loop begins at `{ast.unparse(node.args[0])}`, and belongs from 0 on"
            yield Change("", mends, 2, node, ((node, "args", node.args[1:]),))


def _from_the_first(function):
    """Second entries, as `time[1]`, from which the first is subtracted: a step where nothing has to begin at 0."""
    for node, put in _parts(function):
        if _is_second(node):
            first = ast.Subscript(node.value, ast.Constant(0), ast.Load())
            new = ast.BinOp(node, ast.Sub(), first)
            yield Change("", f"`{ast.unparse(first)}` is to be subtracted", 2, node, put(new))


def _is_second(node):
    if (
        not isinstance(node, ast.Subscript)
        or not isinstance(node.ctx, ast.Load)
        or not isinstance(node.value, ast.Name)
    ):
        return False
    return isinstance(node.slice, ast.Constant) and node.slice.value == 1 and type(node.slice.value) is int


def _typed_numbers(function):
    """Numbers that are typed in, changed to an argument that is read nowhere, to the size of one, or to radians, and
    factors and entries such as 0.1 to any argument; a number that stands in several places is changed in all of them.
    """
    given = [argument.arg for argument in function.args.args]
    read = {n.id for n in ast.walk(function) if isinstance(n, ast.Name)}
    unread, alike = [name for name in given if name not in read], {}
    for owner, field, content, i, node in _typed(function):
        counts = type(node.value) is int and node.value > 1 and not _is_no_count(owner)
        sizes = [form.format(name) for name in given for form in SIZES if counts]
        turns = [TURNS[node.value]] if node.value in TURNS else []
        factor = isinstance(getattr(owner, "op", None), ast.Mult | ast.Div) or isinstance(owner, ast.List | ast.Tuple)
        sizes += [name for name in given if factor and node.value % 0.5 and name in read]
        for text in (*unread, *turns, *sizes):
            new = ast.copy_location(ast.parse(text, mode="eval").body, node)
            _locate(new, node)
            whole = [*content[:i], new, *content[i + 1 :]] if isinstance(content, list) else new
            mends = f"{node.value} is typed in where `{text}` belongs"
            change = Change("", mends, TYPED if text in sizes else 1, node, ((owner, field, whole),))
            alike.setdefault((node.value, text), []).append(change)
            yield change
    for (number, text), group in alike.items():
        if sets := _together(group):
            mends = f"{number} is typed in where `{text}` belongs, here and where it stands again"
            first = min((change.place for change in group), key=lambda node: (node.lineno, node.col_offset))
            yield Change("", mends, TYPED, first, sets)


def _is_no_count(owner):
    """Whether a number of this owner says which axis, order, power or percentage, as far as its name tells."""
    if isinstance(owner, ast.keyword):
        return owner.arg not in COUNTING
    return isinstance(owner, ast.Call) and getattr(owner.func, "attr", "") in REDUCTIONS | NO_COUNTS


def _typed(function):
    """(owner, field, content, place in it, number) of what is typed in, but in brackets."""
    inner = {n for part in ast.walk(function) if isinstance(part, ast.Subscript) for n in ast.walk(part.slice)}
    for owner in ast.walk(function):
        for field, content in ast.iter_fields(owner):
            for i, node in enumerate(content if isinstance(content, list) else [content]):
                if isinstance(node, ast.Constant) and type(node.value) in (int, float) and node not in inner:
                    yield owner, field, content, i, node


def _shorter_steps(function):
    """Steps along a ray or in time, in a `while` that asks for what they add up to, in `np.arange` or in `np.linspace`,
    made shorter.
    """
    for owner in ast.walk(function):
        if isinstance(owner, ast.While):
            asked = {n.id for n in ast.walk(owner.test) if isinstance(n, ast.Name)}
            for step in owner.body:
                adds = isinstance(step, ast.AugAssign) and isinstance(step.op, ast.Add | ast.Sub)
                whole = adds and type(getattr(step.value, "value", None)) is int
                if adds and not whole and getattr(step.target, "id", "") in asked:
                    yield from _with_a_part(step, "value", step.value)
        elif isinstance(owner, ast.Call) and getattr(owner.func, "attr", "") == "arange" and len(owner.args) == 3:
            yield from _with_a_part(owner, "args", owner.args[2])
        elif isinstance(owner, ast.Call) and getattr(owner.func, "attr", "") == "linspace" and len(owner.args) == 3:
            places = getattr(owner.args[2], "value", None)
            for more in (10 * places, 30 * places, 100 * places) if type(places) is int else ():
                new = ast.copy_location(ast.Constant(more), owner.args[2])
                mends = f"{places} places are far too few: {more} will do"
                yield Change("", mends, FINER, owner, ((owner, "args", [*owner.args[:2], new]),))


def _with_a_part(place, field, step):
    """Steps a hundredth as long, and a thirtieth: of the shortest there may be too many for the time there is."""
    for part, words in ((100, "hundredth"), (30, "thirtieth")):
        new = ast.BinOp(step, ast.Div(), ast.Constant(part))
        _locate(new, step)
        mends = f"steps of `{ast.unparse(step)}` are far too long: a {words} of that will do"
        yield Change("", mends, FINER, place, ((place, field, [*place.args[:2], new] if field == "args" else new),))


def _is_coarse(node, most=1.0):
    return isinstance(node, ast.Constant) and type(node.value) is float and COARSE <= node.value <= most


def _with_a_part_of_it(rank, place, field, part=FINE, k=0):
    """A number that is typed in, the k-th where there are several, made far smaller."""
    content = getattr(place, field)
    number = content[k] if isinstance(content, list) else content
    new = ast.copy_location(ast.Constant(part * number.value), number)
    mends = f"`{ast.unparse(number)}` is far too large: a {LESS[part]} of it will do"
    whole = [*content[:k], new, *content[k + 1 :]] if isinstance(content, list) else new
    return Change("", mends, rank, place, ((place, field, whole),))


def _parts(function):
    """(part of the code, function that puts another in its place: what a `Change` sets) of every part."""
    for owner in ast.walk(function):
        for field, content in ast.iter_fields(owner):
            for i, node in enumerate(content if isinstance(content, list) else [content]):
                if isinstance(node, ast.AST):
                    yield node, functools.partial(_set_of, owner, field, content, i, node)


def _set_of(owner, field, content, i, node, new):
    _locate(new, node)
    whole = [*content[:i], new, *content[i + 1 :]] if isinstance(content, list) else new
    return ((owner, field, whole),)


def _locate(new, node):
    """What takes a node's place stands in its line."""
    if "lineno" in new._attributes and not hasattr(new, "lineno"):
        ast.copy_location(new, node)
    ast.fix_missing_locations(new)


ARRAYS = {"array", "asarray", "zeros_like", "ones_like", "empty_like"}  # that take over whole numbers as such
WHOLE = "with an array of floats made one of whole numbers"
ALIASES = ("with another name where a copy belongs", "with a part where a copy belongs")
AFRESH = "with a list or array that each round finds as it was"
COUNTED = "with one index counted from the other end"
SECOND_LIKE_FIRST = "with the second case treated like the first"
FIRST_LIKE_SECOND = "with the first case treated like the second"
ONE_ROUND = "the loop is to take one round only"
DIVISOR = "with a divisor where a quotient belongs"
IN_DEGREES = "with one value times 180/pi, as from radians to degrees"
REVERSED = (  # (words of what was changed in a right formula, what is wrong where the change mends)
    (r"with (.+) where (.+) belongs", r"\2 stands where \1 belongs"),
    (r"without one of its (.+)s", r"one \1 should be left out"),
    (r"without `(\w+)=` in one call", r"`\1=` does not belong there"),
    (r"without `(\w+)`", r"`\1` is to be left out"),
    (r"without the (second argument of `norm`)", r"the \1 should be left out"),
    (r"with one transpose too many, or too few", "one transpose is missing, or too many"),
    (r"with (.+) (turned around|turned over|exchanged)", r"\1 is \2"),
    (r"with the factors of one product `@` in another order", "the factors of this product belong in another order"),
    (r"with one sign turned", "the sign is the other one"),
    (COUNTED, "this index counts from the other end"),
    (r"with one part squared", "the square of this belongs there"),
    (r"with the root of one part taken", "the root of this belongs there"),
    (IN_DEGREES, "this belongs there in degrees"),
    (r"along another axis in one call", "another axis belongs there"),
    (r"with ([01]) in the place of one part", r"\1 belongs in the place of this"),
    (r"with one slice taken to the end", "what stands behind this slice is left out, and belongs there"),
    (r"with one slice taken from the start", "what stands before this slice is left out, and belongs there"),
    (
        r"with a list of whole numbers made one of floats",
        "an array made of this is one of integers, and cuts off decimals",
    ),
    (WHOLE, "`dtype=float` is missing: an array made of whole numbers alone cuts off decimals"),
    (r"with one round of its loop", ONE_ROUND),
    (r"with one case (never|always) taken", r"this case is to be \1 taken"),
)


def _mends(words, node, new):
    """What is wrong with a function that this change makes right."""
    if isinstance(node, ast.Name):
        return _name_that_mends(words, node, new)
    if _is_of_degrees(node) and isinstance(new, ast.Call | ast.Constant):
        return ""
    if isinstance(node, ast.BinOp) and (new is node.left or new is node.right):
        return _left_out(node, new)
    if isinstance(node, ast.BinOp) and isinstance(new, ast.UnaryOp) and new.operand is node.right:
        return f"the term `{ast.unparse(node.left)}` should be left out"
    if isinstance(node, ast.BoolOp) and words.startswith("without one side"):
        kept = new.values if isinstance(new, ast.BoolOp) else [new]
        return f"`{ast.unparse(next(v for v in node.values if v not in kept))}` should be left out"
    if words in (SECOND_LIKE_FIRST, FIRST_LIKE_SECOND):
        return f"`{ast.unparse(new)}` belongs there in all cases"
    for said, told in REVERSED:
        if re.fullmatch(said, words):
            told = re.sub(said, told, words)
            return re.sub(r"^(two .+|the factors .+|.* and .+|the two .+) is ", r"\1 are ", told)
    return ""


def _left_out(node, rest):
    """That a part of an operation should be left out, where the rest of it mends."""
    kind, alone = type(node.op), f"`{ast.unparse(rest)}` alone belongs there"
    if rest is node.right:
        return f"the {PARTS[kind]} `{ast.unparse(node.left)}` should be left out" if kind in COMMUTE else alone
    return f"the {PARTS[kind]} `{ast.unparse(node.right)}` should be left out"


def _is_of_degrees(node):
    """Whether this makes radians of a number that is typed in, beyond a whole turn if it were radians itself: left in
    degrees it is a bound that nothing reaches, or any angle.
    """
    if not isinstance(node, ast.Call) or _called(node) not in TO_RADIANS or not node.args:
        return False
    typed = getattr(node.args[0], "value", None)
    return isinstance(typed, int | float) and abs(typed) > 2 * math.pi


def _name_that_mends(words, node, new):
    if isinstance(new, ast.Name | ast.Constant):
        return f"`{node.id}` stands where `{ast.unparse(new)}` belongs"
    return {"with one sign turned": f"`{node.id}` has the wrong sign"}.get(words, f"`{ast.unparse(new)}` belongs there")


def _names(function):
    """Arguments of a function, and what it assigns."""
    given = [argument.arg for argument in function.args.args]
    stored = [n.id for n in ast.walk(function) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
    return given, [name for name in dict.fromkeys(stored) if name not in given]


def _changed(node, names):
    """(rank, words, other node) of what may stand in a node's place."""
    kinds = {
        ast.BinOp: _operation,
        ast.UnaryOp: _unary,
        ast.Attribute: _attribute,
        ast.Call: _call,
        ast.Compare: _comparison,
        ast.BoolOp: _conditions,
        ast.IfExp: _cases,
        ast.Constant: _constant,
        ast.Name: _name,
        ast.Tuple: _sequence,
        ast.List: _sequence,
        ast.Slice: _slice,
        ast.Subscript: _subscript,
    }
    kind = kinds.get(type(node))
    return list(kind(node, names)) if kind else []


def _operation(node, names):
    kind = type(node.op)
    sides = (getattr(part, "value", None) for part in (node.left, node.right) if isinstance(part, ast.Constant))
    one = 1 in sides  # n * 1 for n + 1 is a term left out
    for other in () if one and kind in (ast.Add, ast.Sub) else OTHERS.get(kind, ()):
        words = f"with {SIGNS.get(other, 'another sign')} where {SIGNS.get(kind, 'another sign')} belongs"
        yield 0, words, ast.BinOp(node.left, other(), node.right)
    if isinstance(node.right, ast.Constant) and kind in (ast.Mult, ast.Pow):  # one asterisk too few, or too many
        other = ast.Pow if kind is ast.Mult else ast.Mult
        yield 1, f"with {SIGNS[other]} where {SIGNS[kind]} belongs", ast.BinOp(node.left, other(), node.right)
    if kind in (ast.Sub, ast.Div, ast.MatMult):
        what = {ast.Sub: "one difference turned around", ast.Div: "one quotient turned over"}
        words = f"with {what.get(kind, 'the factors of one product `@` exchanged')}"
        yield 0, words, ast.BinOp(node.right, node.op, node.left)
    if kind in WITHOUT:
        # a number alone for x - 1 is nobody's slip, and mends where any constant does
        bare = kind in (ast.Add, ast.Sub)
        if not (bare and isinstance(node.left, ast.Constant)):
            yield 1, _without(kind, node.right, names), node.left
        if kind not in (ast.Pow, ast.Mod) and not (bare and isinstance(node.right, ast.Constant)):
            yield 1, DIVISOR if kind is ast.Div else _without(kind, node.left, names), node.right
        if kind is ast.Sub and not any(isinstance(part, ast.Constant) for part in (node.left, node.right)):
            yield 1, _without(kind, node.left, names), ast.UnaryOp(ast.USub(), node.right)
    if kind is ast.MatMult and isinstance(node.left, ast.BinOp) and isinstance(node.left.op, ast.MatMult):
        a, b, c = node.left.left, node.left.right, node.right
        for one, two, three in ((a, c, b), (b, c, a), (c, a, b), (c, b, a)):
            inner = ast.BinOp(one, ast.MatMult(), two)
            yield 1, "with the factors of one product `@` in another order", ast.BinOp(inner, ast.MatMult(), three)
    if kind is ast.MatMult:
        for left, right in ((_transposed(node.left), node.right), (node.left, _transposed(node.right))):
            yield 1, "with one transpose too many, or too few", ast.BinOp(left, node.op, right)
    if kind in (ast.Add, ast.Sub, ast.Div):
        yield 3, "with one part squared", ast.BinOp(node, ast.Pow(), ast.Constant(2))
        yield 3, "with the root of one part taken", _numpy("sqrt", node)


def _without(kind, part, names):
    """What is left out, by its name where it is an argument."""
    if kind in (ast.Add, ast.Sub) and isinstance(part, ast.Name) and part.id in names[0]:
        return f"without the term `{part.id}` in one place"
    return WITHOUT[kind]


def _transposed(node):
    return ast.Attribute(node, "T", ast.Load())


def _linalg(name):
    return ast.Attribute(ast.Attribute(ast.Name("np", ast.Load()), "linalg", ast.Load()), name, ast.Load())


def _numpy(name, *args):
    return ast.Call(ast.Attribute(ast.Name("np", ast.Load()), name, ast.Load()), list(args), [])


def _unary(node, names):
    what = "one sign turned" if isinstance(node.op, ast.USub) else "one condition turned around"
    yield 0, f"with {what}", node.operand


def _attribute(node, names):
    if node.attr == "T" and isinstance(node.ctx, ast.Load):
        yield 0, "without one of its transposes", node.value
    for other in PRECISIONS.get(node.attr, ()):
        yield 0, f"with `{other}` where `{node.attr}` belongs", ast.Attribute(node.value, other, node.ctx)
    if isinstance(node.ctx, ast.Load) and _root(node) not in {*MODULES, *names[0], *names[1], None}:
        for other in names[0]:
            yield 3, f"with `{other}` where `{ast.unparse(node)}` belongs", ast.Name(other, ast.Load())


def _root(node):
    """The name that a chain of attributes begins with; None where it begins with anything else."""
    while isinstance(node, ast.Attribute):
        node = node.value
    return getattr(node, "id", None)


def _call(node, names):
    name = getattr(node.func, "attr", getattr(node.func, "id", ""))
    inner = _what_is_called_upon(node, name, names)
    if name in ARRAYS and not any(keyword.arg == "dtype" for keyword in node.keywords):
        floats = [*node.keywords, ast.keyword("dtype", ast.Name("float", ast.Load()))]
        yield 2, WHOLE, ast.Call(node.func, node.args[:1], floats)
    if name == "int" and isinstance(inner, ast.BinOp | ast.Call):
        yield 1, "without `int`", inner
    if isinstance(inner, ast.Starred) or name in WRAPPERS:
        return
    for twin in () if _is_guarded(name, node.args) else TWINS.get(name, ()):
        words = f"with `{twin}` where `{name}` belongs"
        if isinstance(node.func, ast.Attribute):
            yield 0, words, ast.Call(ast.Attribute(node.func.value, twin, ast.Load()), node.args, node.keywords)
        else:
            yield 0, words, ast.Call(ast.Name(twin, ast.Load()), node.args, node.keywords)
    if name == "arctan" and node.args and isinstance(getattr(node.args[0], "op", None), ast.Div):
        both = _numpy("arctan2", node.args[0].left, node.args[0].right)
        yield 0, "with `arctan2` where `arctan` of a quotient belongs", both
    if name == "arctan" and len(node.args) == 2:  # of which it writes the result into the second
        yield 0, "with `arctan2` where `arctan` belongs", _numpy("arctan2", *node.args)
    if name == "where" and len(node.args) == 3:
        yield 0, SECOND_LIKE_FIRST, node.args[1]
        yield 0, FIRST_LIKE_SECOND, node.args[2]
    if name == "arctan2" and len(node.args) == 2:
        quotient = _numpy("arctan", ast.BinOp(node.args[0], ast.Div(), node.args[1]))
        yield 0, "with `arctan` of a quotient where `arctan2` belongs", quotient
    if inner is not None and not (isinstance(inner, ast.Name) and inner.id in ("np", "rng")):
        yield 1, f"without `{name}`", inner
        if name in BOUNDS and len(node.args) == 2 and inner is node.args[0] and _number(node.args[1]) is None:
            yield 1, f"without `{name}`", node.args[1]
    yield from _other_arguments(node, name)
    yield 2, "with one sign turned", ast.UnaryOp(ast.USub(), node)
    yield 3, "with one part squared", ast.BinOp(node, ast.Pow(), ast.Constant(2))
    yield 3, "with the root of one part taken", _numpy("sqrt", node)
    yield from [] if name in NO_ANGLES else [(3, IN_DEGREES, _numpy("rad2deg", node))]


def _what_is_called_upon(node, name, names):
    """What is left of a call without it: its first argument, of a limit what is no typed number, or the value of which
    it is a method, as a text is; None for a value that is rounded, which is not often what is wrong.
    """
    owner = getattr(node.func, "value", None)
    is_value = _root(owner) in {*names[0], *names[1]} or isinstance(owner, ast.Call | ast.Subscript | ast.BinOp)
    if is_value and node.args and name in ROUNDING:
        return None
    if name in BOUNDS and len(node.args) == 2 and _number(node.args[0]) is not None:
        return node.args[1]
    of_the_owner = is_value and name not in APPLIED or name == CAST
    return node.args[0] if node.args and not of_the_owner else owner


NO_ANGLES = {"norm", "hypot", "sqrt", "eigvalsh", "eigvals", "det", "median", "trace", "len"}  # what these return


def _other_arguments(node, name):
    """A call with an argument less, two exchanged, or along another axis."""
    if name == "norm" and len(node.args) == 2:  # of a matrix another norm than that of all its numbers
        yield 1, "without the second argument of `norm`", ast.Call(node.func, node.args[:1], node.keywords)
    for i in range(len(node.args) - 1 if name not in BOUNDED else 0):
        args = [*node.args[:i], node.args[i + 1], node.args[i], *node.args[i + 2 :]]
        yield 1, f"with two arguments of `{name}` exchanged", ast.Call(node.func, args, node.keywords)
    for i, keyword in enumerate(node.keywords):
        rest = [*node.keywords[:i], *node.keywords[i + 1 :]]
        yield 1, f"without `{keyword.arg}=` in one call", ast.Call(node.func, node.args, rest)
        if keyword.arg == "axis":
            for axis in (0, 1):
                changed = [*rest, ast.keyword("axis", ast.Constant(axis))]
                yield 1, "along another axis in one call", ast.Call(node.func, node.args, changed)


def _is_guarded(name, args):
    """Whether a bound only keeps a division from failing: the other bound would make a constant of what it bounds."""
    numbers = [a.value for a in args if isinstance(a, ast.Constant) and isinstance(a.value, float)]
    return name in ("minimum", "maximum", "min", "max") and any(0 < number < GUARD for number in numbers)


def _comparison(node, names):
    for (i, op), (kind, sign) in itertools.product(enumerate(node.ops), COMPARISONS.items()):
        here = type(op)
        if here in COMPARISONS and kind is not here:
            which = f"the {ORDINALS[i]} " if len(node.ops) > 1 and i < len(ORDINALS) else ""
            words = f"with `{sign}` where {which}`{COMPARISONS[here]}` belongs"
            other = (kind in EQUALITIES) != (here in EQUALITIES)  # of numbers: a case never met, or always
            ops = [*node.ops[:i], kind(), *node.ops[i + 1 :]]
            yield 2 if other else 0, words, ast.Compare(node.left, ops, node.comparators)
    first = type(node.ops[0])
    if len(node.ops) > 1 and first in STRICT and all(type(op) is first for op in node.ops):
        words = f"with `{COMPARISONS[STRICT[first]]}` where each `{COMPARISONS[first]}` belongs"
        yield 0, words, ast.Compare(node.left, [STRICT[first]()] * len(node.ops), node.comparators)


def _conditions(node, names):
    joined, other = ("and", ast.Or()) if isinstance(node.op, ast.And) else ("or", ast.And())
    yield 0, "with `and` and `or` exchanged in one place", ast.BoolOp(other, node.values)
    for i in range(len(node.values)):
        rest = [*node.values[:i], *node.values[i + 1 :]]
        yield 1, f"without one side of `{joined}`", rest[0] if len(rest) == 1 else ast.BoolOp(node.op, rest)


def _cases(node, names):
    yield 0, "with the two cases of one condition exchanged", ast.IfExp(node.test, node.orelse, node.body)
    yield 1, SECOND_LIKE_FIRST, node.body
    yield 1, FIRST_LIKE_SECOND, node.orelse


def _constant(node, names):
    value = node.value
    if isinstance(value, bool):
        yield 2, f"with {not value} where {value} belongs", ast.Constant(not value)
    elif isinstance(value, int | float):
        tiny = isinstance(value, float) and 0 < abs(value) <= ADDED  # a bound that is to be 0, and is none of about 1
        for other in dict.fromkeys((*((0,) if tiny else (value + 1, value - 1)), -value, value / 2, 2 * value)):
            if other != value:
                whole = int(other) if isinstance(value, int) and other == int(other) else other
                yield 2, f"with {whole} where {value} belongs", ast.Constant(whole)


def _name(node, names):
    given, own = names
    if not isinstance(node.ctx, ast.Load) or node.id not in given + own:
        return
    here = f"`{node.id}`" if node.id in given else "one intermediate result"
    for other in given:
        if other != node.id:
            yield 3, f"with `{other}` in one place where {here} belongs", ast.Name(other, ast.Load())
    for other in own:
        if other != node.id:
            yield 4, "with one intermediate result in the place of another", ast.Name(other, ast.Load())
    yield 2, "with one sign turned", ast.UnaryOp(ast.USub(), node)
    for number in (0, 1):
        yield 3, f"with {number} in one place where {here} belongs", ast.Constant(number)
    yield 3, f"with {here} squared in one place", ast.BinOp(node, ast.Pow(), ast.Constant(2))
    yield 3, f"with the root of {here} in one place", _numpy("sqrt", node)


def _sequence(node, names):
    if not isinstance(node.ctx, ast.Load):
        return
    for i in range(len(node.elts) - 1):
        items = [*node.elts[:i], node.elts[i + 1], node.elts[i], *node.elts[i + 2 :]]
        what = "indices" if any(isinstance(part, ast.Slice) for part in node.elts) else "neighbors in one list"
        yield 1, f"with two {what} exchanged", type(node)(items, ast.Load())
    first = node.elts[0] if node.elts else None
    if isinstance(first, ast.Constant) and type(first.value) is int:
        floats = [ast.Constant(float(first.value)), *node.elts[1:]]
        yield 1, "with a list of whole numbers made one of floats", type(node)(floats, ast.Load())


def _slice(node, names):
    if node.lower:
        yield 2, "with one slice taken from the start", ast.Slice(None, node.upper, node.step)
    if node.upper:
        yield 2, "with one slice taken to the end", ast.Slice(node.lower, None, node.step)


def _subscript(node, names):
    if isinstance(node.ctx, ast.Load):
        yield 2, "with one sign turned", ast.UnaryOp(ast.USub(), node)
        yield 3, "with one part squared", ast.BinOp(node, ast.Pow(), ast.Constant(2))
        yield 3, "with the root of one part taken", _numpy("sqrt", node)
        yield 3, "with 1 in the place of one part", ast.Constant(1)
        yield 3, "with 0 in the place of one part", ast.Constant(0)


def _statements(function):
    """Steps left out, loops that take one round only, cases never or always taken, steps in another order or block."""
    for owner in ast.walk(function):
        for field in ("body", "orelse"):
            block = getattr(owner, field, None)
            if isinstance(block, list):
                for i, statement in enumerate(block):
                    for words, mends, new in _instead(statement):
                        for part in new:
                            _locate(part, statement)
                        sets = ((owner, field, [*block[:i], *new, *block[i + 1 :]]),)
                        yield Change(words, mends, FINER if words in ALIASES else 1, statement, sets)
                    yield from _elsewhere(owner, field, block, i)
                    yield from _afresh(owner, field, block, i)


def _instead(statement):
    """(words, what is wrong where it mends, statements) of what may stand in a statement's place."""
    kinds = ast.Assign | ast.AugAssign | ast.If | ast.For | ast.Expr
    if isinstance(statement, kinds) and not _is_told(statement):
        yield "without one of its steps", "this statement should be left out", [ast.Pass()]
    if isinstance(statement, ast.AugAssign):
        sign = f"`{ast.unparse(statement).removeprefix(ast.unparse(statement.target)).split()[0]}`"
        mends = f"{sign} keeps what was there before, which does not belong to the result: `=`"
        mends = mends if isinstance(statement.op, ast.Add) else f"{sign} stands where `=` belongs"
        yield f"with `=` where {sign} belongs", mends, [ast.Assign([statement.target], statement.value)]
    if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
        copied = ast.Call(ast.Attribute(statement.value, "copy", ast.Load()), [], [])
        name, of = statement.targets[0].id, statement.value
        if isinstance(of, ast.Name):
            mends = f"`{name}` is no copy of `{of.id}`, but another name for it: what changes one changes both"
            yield ALIASES[0], mends, [ast.Assign(statement.targets, copied)]
        if isinstance(of, ast.Subscript) and isinstance(of.value, ast.Name):
            mends = f"`{name}` is no copy, but a part of `{of.value.id}`: what changes one changes the other"
            yield ALIASES[1], mends, [ast.Assign(statement.targets, copied)]
    if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name | ast.Subscript):
        mends = "`=` throws away what was there before, which belongs to the result: `+=`"
        yield "with `+=` where `=` belongs", mends, [ast.AugAssign(statement.targets[0], ast.Add(), statement.value)]
    if isinstance(statement, ast.Continue):
        mends = "`continue` goes on with the next round; `break`, which ends the loop, belongs there"
        yield "with `break` where `continue` belongs", mends, [ast.Break()]
    if isinstance(statement, ast.For):
        once = [*statement.body, ast.Break()]
        mends = ONE_ROUND
        yield "with one round of its loop", mends, [ast.For(statement.target, statement.iter, once, [], None)]
    if isinstance(statement, ast.If):
        for words, test in (("never", False), ("always", True)):
            new = ast.If(ast.Constant(test), statement.body, statement.orelse)
            mends = f"what stands under this condition should {words} happen"
            yield f"with one case {words} taken", mends, [new]


def _elsewhere(owner, field, block, i):
    """Two neighboring steps exchanged; the last one of a loop behind it, or the one behind it in the loop."""
    here, behind = block[i], block[i + 1] if i + 1 < len(block) else None
    if behind is not None and not isinstance(here, ast.Return):
        order = [*block[:i], behind, here, *block[i + 2 :]]
        mends = "this step and the one behind it are in the wrong order"
        yield Change("with two of its steps exchanged", mends, 1, here, ((owner, field, order),))
    if not isinstance(here, ast.For | ast.While):
        return
    if len(here.body) > 1:
        out = ((here, "body", here.body[:-1]), (owner, field, [*block[: i + 1], here.body[-1], *block[i + 1 :]]))
        mends = "this stands inside the loop, at its end; behind the loop it is right"
        yield Change("with one step of a loop behind it", mends, 1, here.body[-1], out)
    last = here.body[-1]
    if isinstance(last, ast.If) and last.orelse and isinstance(last.orelse[-1], ast.Return):
        out = ((last, "orelse", []), (owner, field, [*block[: i + 1], *last.orelse, *block[i + 1 :]]))
        mends = "this ends the loop in its first round; behind the loop it is right"
        yield Change("with the last case of a loop behind it", mends, 1, last.orelse[-1], out)
    if behind is not None and not isinstance(behind, ast.Return):
        into = ((here, "body", [*here.body, behind]), (owner, field, [*block[: i + 1], *block[i + 2 :]]))
        mends = "this stands behind the loop and belongs into it, at its end"
        yield Change("with a step drawn into a loop", mends, 1, behind, into)


def _afresh(owner, field, block, i):
    """What is from before a loop as it was at the beginning of each round, though rounds change it."""
    loop = block[i]
    if not isinstance(loop, ast.For | ast.While):
        return
    stored = {n.id for n in ast.walk(loop) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    for inner in ast.walk(loop):
        if not isinstance(inner, ast.For | ast.While):
            continue
        for name, words, needs in _changed_by_rounds(inner, stored):
            kept = f"{name}_as_it_was"
            before, again = (
                ast.parse(f"{to} = __import__('copy').deepcopy({of})").body[0]
                for to, of in ((kept, name), (name, kept))
            )
            _locate(before, loop)
            _locate(again, inner)
            mends = f"`{name}` is changed in each round, and the next one finds it changed: {needs}"
            outside = (owner, field, [*block[:i], before, *block[i:]])
            yield Change(words, mends, 1, inner, (outside, (inner, "body", [again, *inner.body])))


def _changed_by_rounds(loop, stored):
    """(name, words, what each round needs) of lists and arrays changed in place, and of what is added to."""
    for name in sorted({_changed_in_place(statement) for statement in loop.body} - stored - {None}):
        yield name, AFRESH, "each needs a fresh copy"
    added = [s.target for s in loop.body if isinstance(s, ast.AugAssign) and isinstance(s.target, ast.Name)]
    for name in dict.fromkeys(target.id for target in added):
        yield name, "with a value that each round finds as it was", "each needs it as it was before the loop"


def _changed_in_place(statement):
    """The name of a list or array of which a statement changes a part; None where it does no such thing."""
    targets = getattr(statement, "targets", [getattr(statement, "target", None)])
    target = targets[0].value if isinstance(targets[0], ast.Subscript) else None
    return target.id if isinstance(target, ast.Name) else None


def _is_told(statement):
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
