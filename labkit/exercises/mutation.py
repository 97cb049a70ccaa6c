"""All single changes of a function's syntax tree: the slips that a hand makes in a right formula.

Each comes with words that say what was changed, to be read behind "your result is what a right formula gives". The
general layer compares a wrong result with what these give; `tests/bench/mutants.py` types them into the checks.
"""

import ast
import copy

PAIRS = (
    *(("sin", "cos"), ("arcsin", "arccos"), ("min", "max"), ("minimum", "maximum"), ("argmin", "argmax")),
    *(("any", "all"), ("zeros", "ones"), ("deg2rad", "rad2deg"), ("hstack", "vstack")),
)
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
    "standard_normal": ("random",),
    "normal": ("uniform",),
}
WRAPPERS = {"array", "asarray", "float", "int", "list", "tuple", "range", "len", "zip", "enumerate", "bool", "set"}
SIGNS = {ast.Add: "plus", ast.Sub: "minus", ast.Mult: "`*`", ast.Div: "`/`", ast.MatMult: "`@`", ast.Pow: "`**`"}
OTHERS = {
    ast.Add: (ast.Sub, ast.Mult),
    ast.Sub: (ast.Add, ast.Div),
    ast.Mult: (ast.Div, ast.Add),
    ast.Div: (ast.Mult, ast.Sub),
    ast.MatMult: (ast.Mult,),
    ast.FloorDiv: (ast.Div,),
    ast.Mod: (ast.FloorDiv,),
}
COMPARISONS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
WITHOUT = {
    ast.Add: "without one of its terms",
    ast.Sub: "without one of its terms",
    ast.Mult: "without one of its factors",
    ast.Div: "without one of its divisions",
    ast.MatMult: "without one matrix of a product",
    ast.Pow: "without one of its powers",
    ast.Mod: "without one of its remainders",
}


def changes(function, most=4):
    """All single changes of a function, the likeliest slips first.

    Parameters
    ----------
    function : ast.FunctionDef
        A right solution.
    most : int
        How unlikely the changes may be: 0 for signs and operators, 1 with what is left out or exchanged, 2 with numbers
        and signs of single names, 3 and 4 with parts squared and names in place of others.

    Returns
    -------
    changes : list of (str, ast.FunctionDef)
        What was changed, in words, and the function that came of it.
    """
    found = []
    names = _names(function)
    for k, node in enumerate(ast.walk(function)):
        for rank, words, new in _changed(node, names):
            if rank <= most:
                found.append((rank, len(found), words, _with(function, k, new)))
    if most:
        found += [(1, len(found) + i, words, tree) for i, (words, tree) in enumerate(_statements(function))]
    return [(words, tree) for _, _, words, tree in sorted(found, key=lambda change: change[:2])]


def _with(function, k, new):
    """A copy of the function in which the k-th node of the walk is another one."""
    tree = copy.deepcopy(function)
    target = next(node for i, node in enumerate(ast.walk(tree)) if i == k)

    class Exchange(ast.NodeTransformer):
        def visit(self, node):
            return copy.deepcopy(new) if node is target else self.generic_visit(node)

    return ast.fix_missing_locations(Exchange().visit(tree))


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
    for other in OTHERS.get(kind, ()):
        words = f"with {SIGNS.get(other, 'another sign')} where {SIGNS.get(kind, 'another sign')} belongs"
        yield 0, words, ast.BinOp(node.left, other(), node.right)
    if kind in (ast.Sub, ast.Div, ast.MatMult):
        what = {ast.Sub: "one difference turned around", ast.Div: "one quotient turned over"}
        words = f"with {what.get(kind, 'the factors of one product `@` exchanged')}"
        yield 0, words, ast.BinOp(node.right, node.op, node.left)
    if kind in WITHOUT:
        yield 1, WITHOUT[kind], node.left
        if kind not in (ast.Pow, ast.Mod):
            yield 1, WITHOUT[kind], node.right
    if kind is ast.MatMult:
        for left, right in ((_transposed(node.left), node.right), (node.left, _transposed(node.right))):
            yield 1, "with one transpose too many, or too few", ast.BinOp(left, node.op, right)
    if kind in (ast.Add, ast.Sub, ast.Div):
        yield 3, "with one part squared", ast.BinOp(node, ast.Pow(), ast.Constant(2))
        yield 3, "with the root of one part taken", _numpy("sqrt", node)


def _transposed(node):
    return ast.Attribute(node, "T", ast.Load())


def _numpy(name, *args):
    return ast.Call(ast.Attribute(ast.Name("np", ast.Load()), name, ast.Load()), list(args), [])


def _unary(node, names):
    what = "one sign turned" if isinstance(node.op, ast.USub) else "one condition turned around"
    yield 0, f"with {what}", node.operand


def _attribute(node, names):
    if node.attr == "T" and isinstance(node.ctx, ast.Load):
        yield 0, "without one of its transposes", node.value


def _call(node, names):
    name = getattr(node.func, "attr", getattr(node.func, "id", ""))
    inner = node.args[0] if node.args else getattr(node.func, "value", None)
    if isinstance(inner, ast.Starred) or name in WRAPPERS:
        return
    for twin in TWINS.get(name, ()):
        words = f"with `{twin}` where `{name}` belongs"
        if isinstance(node.func, ast.Attribute):
            yield 0, words, ast.Call(ast.Attribute(node.func.value, twin, ast.Load()), node.args, node.keywords)
        else:
            yield 0, words, ast.Call(ast.Name(twin, ast.Load()), node.args, node.keywords)
    if name == "arctan2" and len(node.args) == 2:
        quotient = _numpy("arctan", ast.BinOp(node.args[0], ast.Div(), node.args[1]))
        yield 0, "with `arctan` of a quotient where `arctan2` belongs", quotient
    if inner is not None and not (isinstance(inner, ast.Name) and inner.id in ("np", "rng")):
        yield 1, f"without `{name}`", inner
    for i in range(len(node.args) - 1):
        args = [*node.args[:i], node.args[i + 1], node.args[i], *node.args[i + 2 :]]
        yield 1, f"with two arguments of `{name}` exchanged", ast.Call(node.func, args, node.keywords)
    for i, keyword in enumerate(node.keywords):
        rest = [*node.keywords[:i], *node.keywords[i + 1 :]]
        yield 1, f"without `{keyword.arg}=` in one call", ast.Call(node.func, node.args, rest)
        if keyword.arg == "axis":
            for axis in (0, 1):
                changed = [*rest, ast.keyword("axis", ast.Constant(axis))]
                yield 1, "along another axis in one call", ast.Call(node.func, node.args, changed)
    yield 2, "with one sign turned", ast.UnaryOp(ast.USub(), node)
    yield 3, "with one part squared", ast.BinOp(node, ast.Pow(), ast.Constant(2))
    yield 3, "with the root of one part taken", _numpy("sqrt", node)
    yield 3, "with one angle in degrees", _numpy("rad2deg", node)


def _comparison(node, names):
    for kind, sign in COMPARISONS.items():
        here = type(node.ops[0])
        if len(node.ops) == 1 and here in COMPARISONS and kind is not here:
            words = f"with `{sign}` where `{COMPARISONS[here]}` belongs"
            yield 0, words, ast.Compare(node.left, [kind()], node.comparators)


def _conditions(node, names):
    other = ast.Or() if isinstance(node.op, ast.And) else ast.And()
    yield 0, "with `and` and `or` exchanged in one place", ast.BoolOp(other, node.values)
    for i in range(len(node.values)):
        rest = [*node.values[:i], *node.values[i + 1 :]]
        yield 1, "without one of its conditions", rest[0] if len(rest) == 1 else ast.BoolOp(node.op, rest)


def _cases(node, names):
    yield 0, "with the two cases of one condition exchanged", ast.IfExp(node.test, node.orelse, node.body)
    yield 1, "with one case treated like the other", node.body
    yield 1, "with one case treated like the other", node.orelse


def _constant(node, names):
    value = node.value
    if isinstance(value, bool):
        yield 2, f"with {not value} where {value} belongs", ast.Constant(not value)
    elif isinstance(value, int | float):
        for other in dict.fromkeys((value + 1, value - 1, -value, value / 2, 2 * value)):
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
            yield 4, "with another intermediate result in one place", ast.Name(other, ast.Load())
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
        yield 1, "with two neighbors in one list exchanged", type(node)(items, ast.Load())


def _slice(node, names):
    if node.lower:
        yield 2, "with one row or column too many, the first", ast.Slice(None, node.upper, node.step)
    if node.upper:
        yield 2, "with one row or column too many, the last", ast.Slice(node.lower, None, node.step)


def _subscript(node, names):
    if isinstance(node.ctx, ast.Load):
        yield 2, "with one sign turned", ast.UnaryOp(ast.USub(), node)
        yield 3, "with one part squared", ast.BinOp(node, ast.Pow(), ast.Constant(2))
        yield 3, "with the root of one part taken", _numpy("sqrt", node)
        yield 3, "with 1 in the place of one part", ast.Constant(1)
        yield 3, "with 0 in the place of one part", ast.Constant(0)


def _statements(function):
    """(words, tree) for every step left out, and every loop that takes one round only."""
    for k, node in enumerate(ast.walk(function)):
        for field in ("body", "orelse"):
            block = getattr(node, field, None)
            if not isinstance(block, list):
                continue
            for i, statement in enumerate(block):
                if isinstance(statement, ast.Assign | ast.AugAssign | ast.If | ast.For | ast.Expr) and not _is_told(
                    statement
                ):
                    yield "without one of its steps", _shorter(function, k, field, i)
                if isinstance(statement, ast.AugAssign):
                    new = ast.Assign([statement.target], statement.value)
                    yield "with `=` where a value is to be added to", _shorter(function, k, field, i, new)
                if isinstance(statement, ast.For):
                    once = [*statement.body, ast.Break()]
                    loop = ast.For(statement.target, statement.iter, once, [], None)
                    yield "with one round of its loop", _shorter(function, k, field, i, loop)
                if isinstance(statement, ast.If):
                    for words, test in (("never", False), ("always", True)):
                        new = ast.If(ast.Constant(test), statement.body, statement.orelse)
                        yield f"with one case {words} taken", _shorter(function, k, field, i, new)


def _is_told(statement):
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def _shorter(function, k, field, i, new=None):
    """A copy of the function without one statement, or with another one in its place."""
    tree = copy.deepcopy(function)
    block = getattr(next(node for j, node in enumerate(ast.walk(tree)) if j == k), field)
    block[i] = copy.deepcopy(new) if new is not None else ast.Pass()
    return ast.fix_missing_locations(tree)
