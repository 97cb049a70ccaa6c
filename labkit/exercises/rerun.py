"""A student's function run again, with what it computes on the way noted, or one thing in it otherwise.

The function is read again as its author typed it, and every part of it is led through a note that keeps the value or
puts another in its place. Nothing of an exercise is known here: in `collect` this runs where the student's code does.
"""

import ast
import contextlib
import copy
import functools
import inspect
import itertools
import linecache
import textwrap
import types
import warnings

import numpy as np

from . import guard, mutation, scope

NOTE, TICK = "_labkit_note_", "_labkit_tick_"
LONGEST = 1e5  # up to which a number may grow to its exponential: it may end a range
ROUNDS = 16  # values of one place that are kept: it may stand in a loop
ENTRIES = 5000  # of an array that is kept
LENGTH = 60  # characters of code that are quoted
PATIENCE = 5  # times as many steps as the function itself takes may a changed one take ...
STEPS = 2000  # ... and so many more
MOST = 800  # changes of the code that are made
AXIS = ", along the last axis)"
WITHIN = "` in `"  # between a part of the code and the larger one in which it is quoted
OPAQUE = {"locals", "globals", "vars", "eval", "exec", "super", "breakpoint"}  # what code says of itself
OUTSIDE = {"open", "write", "write_text", "write_bytes", "touch", "mkdir", "unlink", "remove", "rename", "savetxt"}
OUTSIDE |= {"save", "savez", "tofile", "dump", "to_csv", "system", "run", "Popen", "sendto", "send", "connect"}
SIZES, OF_A_SIZE = {"shape", "ndim", "size"}, {"len", "shape", "ndim", "size", "zeros_like", "ones_like", "empty_like"}
UNREAD = ast.Global | ast.Nonlocal | ast.Yield | ast.Await  # in a function that is not run again


class TooLong(BaseException):
    """A changed function takes far more steps than the function itself; no Exception, so that it is not swallowed."""


def written(function):
    """What can be run again of a function; None where its code cannot be read.

    One in another process has a `written` of its own.
    """
    if hasattr(function, "written"):
        return function.written()
    found = _read(function)
    if found is None:
        return None
    tree, lines = found
    beside = _beside(function, tree)
    for _, _, more in beside:
        lines = lines | more
    return Written(function, tree, lines, [(helper, definition) for helper, definition, _ in beside])


def read_for_size(function):
    """Names of the arguments of which a function reads how large they are, and nothing else."""
    trees = getattr(written(function), "trees", None)  # none where its code cannot be read
    if not trees:
        return set()
    named = [n for n in ast.walk(trees[0]) if isinstance(n, ast.Name)]
    sized = [n.value for n in ast.walk(trees[0]) if isinstance(n, ast.Attribute) and n.attr in SIZES]
    calls = [n for n in ast.walk(trees[0]) if isinstance(n, ast.Call) and n.args]
    sized += [n.args[0] for n in calls if getattr(n.func, "attr", getattr(n.func, "id", "")) in OF_A_SIZE]
    arguments = {argument.arg for argument in trees[0].args.args}
    return (arguments & {n.id for n in sized if isinstance(n, ast.Name)}) - {n.id for n in named if n not in sized}


def _beside(function, tree):
    """(function, definition, lines) of those that a function calls, and of those that they call, if they stand in the
    cell of its definition: what is wrong with it may be wrong there.
    """
    known, code, found, unread = function.__globals__, function.__code__, {}, [tree]
    while unread:
        names = {n.id for n in ast.walk(unread.pop()) if isinstance(n, ast.Name)}
        for name in sorted(names - set(found) - {code.co_name}):
            helper = known.get(name)
            if not isinstance(helper, types.FunctionType) or helper.__code__.co_name != name:
                continue
            if helper.__code__.co_filename == code.co_filename and (read := _read(helper)):
                found[name] = (helper, *read)
                unread.append(read[0])
    return list(found.values())


def _read(function):
    """A function's definition, its lines counted as in its cell, and these lines; None where it cannot be read."""
    if not isinstance(function, types.FunctionType) or function.__code__.co_freevars:
        return None
    code = function.__code__
    cell = linecache.getlines(code.co_filename, function.__globals__)
    try:
        text = textwrap.dedent("".join(inspect.getblock(cell[code.co_firstlineno - 1 :])))
        module = ast.parse(text)
        node = module.body[0]
    except (SyntaxError, ValueError, IndexError, RecursionError):
        return None
    if not isinstance(node, ast.FunctionDef) or not (_makes(text, code) or _makes("".join(cell), code)):
        return None
    names = {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}
    names |= {n.attr for n in ast.walk(node) if isinstance(n, ast.Attribute)}  # what may write files stays as it is
    if names & (OPAQUE | OUTSIDE) or any(isinstance(n, UNREAD) for n in ast.walk(node)):
        return None
    ast.increment_lineno(module, code.co_firstlineno - 1)
    return _bare(node), {code.co_firstlineno + k: line for k, line in enumerate(text.splitlines())}


def _makes(text, code):
    """Whether a text is compiled to this code. A call of what is imported beside the function is compiled otherwise
    than one of what was imported before, so that the whole cell may tell where the definition alone does not.
    """
    try:
        made = compile(text, "", "exec")
    except (SyntaxError, ValueError, RecursionError):  # a cell may hold what is no Python
        return False
    found = (c for c in made.co_consts if isinstance(c, types.CodeType) and c.co_name == code.co_name)
    return any(c.co_code == code.co_code and c.co_names == code.co_names for c in found)


def _bare(node):
    """The definition without what stands around the steps: decorators, docstring, defaults, annotations."""
    node.decorator_list, node.returns = [], None
    if ast.get_docstring(node, clean=False) is not None and len(node.body) > 1:
        node.body = node.body[1:]
    node.args.defaults, node.args.kw_defaults = [], [None] * len(node.args.kwonlyargs)
    for argument in ast.walk(node.args):
        if isinstance(argument, ast.arg):
            argument.annotation = None
    return node


def _searched(tree):
    return (line for start in mutation.starts(tree) for line in range(start.lineno, start.end_lineno + 1))


def _iterated(tree):
    bound = [node for node in ast.walk(tree) if isinstance(node, ast.Assign | ast.AugAssign)]
    loops = [node for node in ast.walk(tree) if isinstance(node, ast.For | ast.While)]
    again = set()
    for statement in (part for loop in loops for part in ast.walk(loop) if part in bound):
        names = {n.id for n in ast.walk(statement) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
        read = {n.id for n in ast.walk(statement.value) if isinstance(n, ast.Name)}
        again |= names if isinstance(statement, ast.AugAssign) else names & read
    for statement in bound:
        names = {n.id for n in ast.walk(statement) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
        if names & again:
            yield statement.lineno


def _outwards(node, outer):
    """The larger parts of the code in which a part stands, one in the other, up to the statement."""
    while isinstance(outer[node], ast.expr):
        node = outer[node]
        yield node


class Written:
    """A function that was read again, with the functions `beside` it, [(function, definition)], that it calls.

    changes: (rank, line, code, what is wrong where it mends) of every single change of the code, by its number.
    places:  (line, code, name of the variable, size, number of its first part) of every value on the way.
    of_truth: numbers of the places where a truth value, or an array of them, was met in a trace.
    """

    FACTS = ("lines", "of_notebook", "iterated", "searched", "left_alone")

    def __init__(self, function, tree, lines=None, beside=()):
        self.function, self.beside, self.lines = function, [helper for helper, _ in beside], lines or {}
        self.trees = [tree, *(definition for _, definition in beside)]
        self.counted, self.of_truth = STEPS, set()
        self._noted, self.places = _noted(function, self.trees, self.lines)
        for tree in self.trees:
            _ticking(tree)

    @property
    def facts(self):
        """{name: value} of what is known without a trace: another process asks for it."""
        return {name: getattr(self, name) for name in self.FACTS}

    @functools.cached_property
    def of_notebook(self):
        """Names of the notebook's data that the function reads without being given them."""
        return set(scope.notebook_data(self.function))

    @functools.cached_property
    def iterated(self):
        """Lines in which a variable is bound that a loop makes anew of itself."""
        return {line for tree in self.trees for line in _iterated(tree)}

    @functools.cached_property
    def searched(self):
        """Lines in which stands where a search begins."""
        return {line for tree in self.trees for line in _searched(tree)}

    @functools.cached_property
    def left_alone(self):
        """What each change leaves of a call with several arguments that it takes away, by its number; else ""."""
        return [mutation.left_alone(change) for change in self._changes]

    @functools.cached_property
    def _changes(self):
        found = [c for tree in self.trees for c in mutation.mending(tree) if c.mends]
        return sorted(found, key=lambda change: change.rank)[:MOST]

    @property
    def changes(self):
        found = []
        for c in self._changes:
            text, around = _shown(c.place, self.lines), self._around.get(c.place)
            told = f"{text}{WITHIN}{around}" if around not in (None, text) and len(c.sets) == 1 else text
            found.append((c.rank, c.place.lineno, told, c.mends))
        return found

    @functools.cached_property
    def _around(self):
        """{part of the code: the larger part that tells it from others} of those that look alike in their line."""
        found = {}
        for tree in self.trees:
            outer = {part: node for node in ast.walk(tree) for part in ast.iter_child_nodes(node)}
            alike = {}
            for node in ast.walk(tree):
                if isinstance(node, ast.expr):
                    alike.setdefault((node.lineno, _shown(node, self.lines)), []).append(node)
            for nodes in alike.values():
                larger = [[_shown(o, self.lines) for o in _outwards(node, outer)] for node in nodes if len(nodes) > 1]
                for node, own in zip(nodes, larger):
                    others = {text for texts in larger if texts is not own for text in texts}
                    found |= {node: next((text for text in own if text not in others), own[0])} if own else {}
        return found

    def results(self, plans, args, seconds, keep):
        """What comes of every plan on one draw, in the plans' order, each handed to `keep`.

        A plan is ("code", number of a change), ("value", number of a place, number of one of `OTHERWISE`, number of an
        argument), ("own", number of a place, number of one of `OTHERWISE`, number of a place where a variable was
        bound before, which is taken as it is by then), ("argument", number of an argument, number of one of
        `OTHERWISE`), ("given", number of a place, values in its place, one for every round), ("copy", number of a
        place), which puts a copy of its value there, or ("last", number of a place), which gives the last of them.
        Where one fails, `keep` gets None. The list is shorter where the time, in seconds, is over.
        """
        found = []

        def work():
            for plan in plans:
                found.append(keep(self._result(plan, args)))

        guard.run(work, (), limit=seconds, author=self.function)
        return found

    def _result(self, plan, args):
        copies = copy.deepcopy(args)
        try:
            with np.errstate(all="ignore"):
                if plan[0] == "code":
                    found = self._changed(plan[1])(*copies)
                    return None if _differ(copies, args) else (found,)
                if plan[0] == "argument":
                    note = _Note(self.counted)
                    return (self._made(self._noted, {NOTE: note})(*_given_otherwise(copies, *plan[1:])),)
                if plan[0] == "last":
                    note = _Note(self.counted)
                    note.watched = {plan[1]}
                    self._made(self._noted, {NOTE: note})(*copies)
                    return (note.seen,)
                note = _Note(self.counted, plan[1])
                note.watched = self._bound_as(plan[3]) if plan[0] == "own" else ()
                note.otherwise = _copied if plan[0] == "copy" else _but_for_copies(_otherwise(plan, copies, note))
                return (self._made(self._noted, {NOTE: note})(*copies),)
        except (Exception, TooLong):  # a change may well make nonsense of a function
            return None

    def _bound_as(self, place):
        """Numbers of all places where the variable is bound that is bound at this one."""
        line, _, name, *_ = self.places[place]
        tree = next(tree for tree in self.trees if tree.lineno <= line <= tree.end_lineno)
        return {
            k
            for k, (at, code, other, *_) in enumerate(self.places)
            if name == other != code and tree.lineno <= at <= tree.end_lineno
        }

    def _changed(self, number):
        with warnings.catch_warnings(action="ignore"), self._changes[number].made():
            code = compile(ast.Module(self.trees, []), "<changed>", "exec")
        steps = itertools.count(1)

        def tick():
            if next(steps) > self.counted:
                raise TooLong

        return self._made(code, {TICK: tick})

    def _made(self, code, extra):
        """The function that a compiled definition gives among the names of the notebook, which it leaves alone."""
        known = {**self.function.__globals__, **extra}
        exec(code, known)
        for function in (*self.beside, self.function):
            made = known[function.__code__.co_name]
            made.__defaults__, made.__kwdefaults__ = function.__defaults__, function.__kwdefaults__
        return made

    def trace(self, args, seconds):
        """(number of rounds, their values in one array) of every place on one draw; (0, None) where there are none."""
        kept, note = [[] for _ in self.places], None

        def work():
            nonlocal note
            note = _Note(None, kept=kept)
            with np.errstate(all="ignore"):
                self._made(self._noted, {NOTE: note})(*copy.deepcopy(args))

        guard.run(work, (), limit=seconds, author=self.function)
        self.counted = max(self.counted, PATIENCE * note.steps + STEPS) if note else STEPS
        self.of_truth |= note.truths if note else set()
        return [_stacked(values) for values in kept]

    def truths(self, draws, seconds):
        """Of every draw: (number of a place, if ever true, if ever false, in how many rounds) of the conditions met.

        The list is shorter where the time, in seconds, is over.
        """
        found = []

        def work():
            for args in draws:
                note = _Truths(None)
                with np.errstate(all="ignore"), contextlib.suppress(Exception):  # a draw on which it fails
                    self._made(self._noted, {NOTE: note})(*copy.deepcopy(args))
                found.append([(k, *met) for k, met in note.met.items()])

        guard.run(work, (), limit=seconds, author=self.function)
        return found


def _differ(arrays, before):
    """Whether a function changed one of its arguments, of arrays and numbers."""
    pairs = ((numeric(a), numeric(b)) for a, b in zip(arrays, before))
    return any(a is not None and not np.array_equal(a, b, equal_nan=True) for a, b in pairs)


def _stacked(values):
    """(count, values of all rounds in one array); (0, None) where there are none of one shape."""
    if not values or any(v is None or v.shape != values[0].shape for v in values):
        return 0, None
    return len(values), np.stack(values)


def numeric(value):
    """A value as an array of numbers that is kept; None for anything else, and for what cannot be read."""
    try:
        return _as_numbers(value)
    except Exception:  # whatever a student's own kind of number does; a whole number too large for a float
        return None


def _as_numbers(value):
    if isinstance(value, bool | np.bool_ | int | float | np.number):
        return np.asarray(value, dtype=float)
    if isinstance(value, list | tuple) and 0 < len(value) <= ENTRIES and type(value) in (list, tuple):
        value = np.asarray(value)
    if isinstance(value, np.ndarray) and value.dtype.kind in "biuf" and 0 < value.size <= ENTRIES:
        return np.array(value, dtype=float)
    return None


class _Note:
    """Is told every value on the way; keeps them, or puts others in the place of one."""

    otherwise = seen = None  # function(value, round); the last value of the places that are watched
    watched = ()

    def __init__(self, most, place=-1, kept=None):
        self.most, self.place, self.kept = most, place, kept
        self.steps, self.round, self.truths = 0, 0, set()

    def __call__(self, k, value):
        self.steps += 1
        if self.most is not None and self.steps > self.most:
            raise TooLong
        if self.kept is not None and len(self.kept[k]) < ROUNDS:
            self.kept[k].append(numeric(value))
            if _is_truth(value):
                self.truths.add(k)
        if k in self.watched:
            self.seen = value
        if k == self.place:
            self.round += 1
            return self.otherwise(value, self.round - 1)
        return value


class _Truths(_Note):
    """Is told every value on the way, and keeps which conditions were true and which were false."""

    def __init__(self, most):
        super().__init__(most)
        self.met = {}

    def __call__(self, k, value):
        if isinstance(value, bool | np.bool_):
            true, false, rounds = self.met.get(k, (False, False, 0))
            self.met[k] = true or bool(value), false or not value, rounds + 1
        return value


# What is put in the place of a value ------------------------------------------------------------------------------


def _otherwise(plan, args, note):
    """function(value, round) -> what is put in its place."""
    if plan[0] == "given":
        values = plan[2]
        return lambda value, turn: _like(value, values[min(turn, len(values) - 1)])
    change = OTHERWISE[plan[2]][1]
    if plan[3] is None:
        return lambda value, turn: _like(value, change(_number(value)))
    if plan[0] == "own":
        return lambda value, turn: _like(value, change(_number(value), _number(note.seen)))
    return lambda value, turn: _like(value, change(_number(value), np.asarray(args[plan[3]], dtype=float)))


def _copied(value, _):
    return copy.deepcopy(value)


def _but_for_copies(change):
    """The same, where another value comes of it; else the very array: a copy of it would mend what is filled later on,
    and have nothing to do with what the change is said to be.
    """

    def changed(value, turn):
        new, old = change(value, turn), numeric(value)
        return value if old is not None and np.array_equal(_number(new), old, equal_nan=True) else new

    return changed


def _exponential(v):
    """Not of a number so large that an array as long as its exponential would fill the memory."""
    if np.ndim(v) == 0 and v > np.log(LONGEST):
        raise ValueError("too long")
    return np.exp(v)


def _given_otherwise(args, i, change):
    return (*args[:i], _like(args[i], OTHERWISE[change][1](_number(args[i]))), *args[i + 1 :])


def _number(value):
    found = numeric(value)
    if found is None:
        raise ValueError("no number")
    return found


def _like(value, new):
    """A new value of the same kind as the old one: an index stays an index, a truth value a truth value."""
    whole = isinstance(value, int | np.integer) or isinstance(value, np.ndarray) and value.dtype.kind in "iu"
    if _is_truth(value):
        return _as_truth(value, np.asarray(new))
    if whole and np.shape(new) == np.shape(value) and np.all(np.asarray(new) == np.round(new)):
        return int(new) if np.ndim(new) == 0 else np.asarray(new).astype(int)
    if isinstance(value, list) and np.ndim(new):
        return _list_like(value, np.asarray(new))
    if isinstance(value, tuple) and np.ndim(new):
        return tuple(np.asarray(new))
    new = np.array(new, dtype=float)
    return float(new) if new.ndim == 0 else new


def _as_truth(value, new):
    """New truth values; numbers that are none would all count as true, whatever they say."""
    if not np.isin(new, (0, 1)).all():
        raise ValueError("no truth value")
    return new != 0 if isinstance(value, np.ndarray) else bool(new)


def _list_like(value, new):
    """A list of whole numbers stays one: made one of floats it might mend what has nothing to do with its values."""
    whole = all(isinstance(part, int | np.integer) and not isinstance(part, bool) for part in value)
    return new.astype(int).tolist() if whole and (new == np.round(new)).all() else list(new)


def _is_truth(value):
    return isinstance(value, bool | np.bool_) or isinstance(value, np.ndarray) and value.dtype.kind == "b"


def _square(v):
    if v.ndim < 2 or v.shape[-1] != v.shape[-2]:
        raise ValueError("not square")
    return v


def _matrix(v):
    if v.ndim < 2:
        raise ValueError("no matrix")
    return v


def _vector(v):
    if v.ndim != 1:
        raise ValueError("no vector")
    return _long(v)


def _long(v):
    if not v.ndim or len(v) < 2:
        raise ValueError("no vector")
    return v


def _whole(v):
    if v.ndim or v != np.round(v):
        raise ValueError("no whole number")
    return v


def _truth(v):
    if np.min(v) < 0 or np.max(v) > 1:
        raise ValueError("no share, and no truth value")
    return 1.0 - v


def _entry_negated(v, k):
    v = _long(v).copy()
    v[..., k] = -v[..., k]
    return v


def _entries_exchanged(v, i, j):
    v = _long(v).copy()
    v[..., [i, j]] = v[..., [j, i]]
    return v


def _pose(v, turn, shift):
    if v.shape[-2:] != (4, 4):
        raise ValueError("no pose")
    v = v.copy()
    v[..., :3, :3], v[..., :3, 3] = turn(v[..., :3, :3].copy()), shift(v[..., :3, 3].copy())
    return v


def _normalized(v):
    return _vector(v) / np.linalg.norm(v)


def _rows_normalized(v):
    return _matrix(v) / np.linalg.norm(v, axis=-1, keepdims=True)


def _with_own_rows(v):
    return v - _matrix(v).mean(axis=0)


def _same(v):
    return v


def _kept_rows(v, rows):
    return _long(v)[rows]


def _of_its_shape(change):
    """The change where it leaves an array its shape: one of whose length alone is read would be told for the length."""

    def changed(v, a):
        new = change(v, a)
        if v.ndim and np.shape(new) != v.shape:
            raise ValueError("another shape")
        return new

    return changed


SIGNLESS = "its absolute value belongs there"
OPPOSITE = "1 less it, 1 - ..., belongs there"
NOUGHT, ONE = "0 belongs in its place", "1 belongs in its place"
IDENTITY = "the identity belongs in its place"
WEIGHTS = ONE, IDENTITY  # what is as good as no factor
ANOTHER = "{} belongs in its place"
OF_TRUTHS = {  # what the same changes are called where they are made to a truth value, or an array of them
    OPPOSITE: "its opposite belongs there, `not` or `~`",
    NOUGHT: "False belongs in its place",
    ONE: "True belongs in its place",
}
OF_ARRAYS = {  # what the same changes are called where they are made to an array: a number may not take its place
    NOUGHT: "zeros of its shape belong in its place",
    ONE: "ones of its shape belong in its place",
    OF_TRUTHS[NOUGHT]: "False belongs in the place of each of its entries",
    OF_TRUTHS[ONE]: "True belongs in the place of each of its entries",
}
CONSTANTS = {  # what an argument is replaced with wherever it is read: (a number, an array)
    NOUGHT: ("0", "zeros"),
    ONE: ("1", "ones"),
    IDENTITY: ("1", "the identity"),
}
OTHERWISE = (  # (what it should have been, function of the value [and of an argument]), the likeliest first
    ("it has the wrong sign", np.negative),
    ("it belongs there transposed", lambda v: np.swapaxes(_matrix(v), -1, -2)),
    ("its inverse belongs there", lambda v: np.linalg.inv(_square(v))),
    ("half of it belongs there", lambda v: v / 2),
    ("twice as much belongs there", lambda v: 2 * v),
    ("its square belongs there", np.square),
    ("its root belongs there", np.sqrt),
    ("its reciprocal belongs there", lambda v: 1 / v),
    ("it belongs there in radians", np.deg2rad),
    ("it belongs there in degrees", np.rad2deg),
    ("a thousand times as much belongs there: a unit?", lambda v: 1000 * v),
    ("a thousandth of it belongs there: a unit?", lambda v: v / 1000),
    (SIGNLESS, np.abs),
    ("it should be larger by 1", lambda v: _whole(v) + 1),
    ("it should be smaller by 1", lambda v: _whole(v) - 1),
    (OPPOSITE, _truth),
    (NOUGHT, np.zeros_like),
    (ONE, np.ones_like),
    (IDENTITY, lambda v: 0 * _square(v) + np.eye(v.shape[-1])),
    ("it is to be divided by its length", _normalized),
    ("each row of it is to be divided by the length of that row", _rows_normalized),
    ("the mean of its rows is to be taken off", _with_own_rows),
    ("the mean of its rows belongs there", lambda v: _matrix(_long(v)).mean(axis=0)),
    ("the sum of its rows belongs there", lambda v: _matrix(_long(v)).sum(axis=0)),
    ("its length (norm) belongs there", lambda v: np.linalg.norm(_long(v))),
    ("its mean belongs there", lambda v: _long(v).mean()),
    ("its sum belongs there", lambda v: _long(v).sum()),
    ("its running sum belongs there", lambda v: np.cumsum(_long(v), axis=0)),
    ("it should be in reverse order", lambda v: _long(v)[::-1]),
    ("its last row or entry does not belong there", lambda v: _kept_rows(v, np.s_[:-1])),
    ("its first row or entry does not belong there", lambda v: _kept_rows(v, np.s_[1:])),
    ("it should be wrapped to between -pi and pi", lambda v: np.angle(np.exp(1j * v))),
    ("what is below 0 is to be 0 there", lambda v: np.maximum(v, 0.0)),
    ("its logarithm belongs there", np.log),
    ("its exponential belongs there", lambda v: _exponential(v)),
    ("its sine belongs there", np.sin),
    ("its tangent belongs there", np.tan),
    ("its diagonal alone belongs there", lambda v: np.diag(np.diag(_square(v)))),
    ("its rotation should be transposed", lambda v: _pose(v, lambda R: np.swapaxes(R, -1, -2), _same)),
    ("its translation should have the other sign", lambda v: _pose(v, _same, np.negative)),
    ("its translation does not belong there", lambda v: _pose(v, _same, np.zeros_like)),
    ("its rotation does not belong there", lambda v: _pose(v, lambda R: 0 * R + np.eye(3), _same)),
    *(
        (f"its entry {k} (counted from 0{AXIS} has the wrong sign", functools.partial(_entry_negated, k=k))
        for k in range(4)
    ),
    *(
        (
            f"its entries {i} and {j} (counted from 0{AXIS} are exchanged",
            functools.partial(_entries_exchanged, i=i, j=j),
        )
        for i, j in itertools.combinations(range(4), 2)
    ),
    ("it is to be multiplied by {}", _of_its_shape(np.multiply)),
    ("it is to be divided by {}", _of_its_shape(np.divide)),
    (ANOTHER, lambda v, a: a),
    ("{} is missing: it is to be added", _of_its_shape(np.add)),
    ("{} is to be taken off", _of_its_shape(np.subtract)),
    ("the matrix {} is to be multiplied with it, from the left", lambda v, a: _matrix(a) @ v),
    ("it is to be multiplied by the square of {}", _of_its_shape(lambda v, a: v * a**2)),
    ("it is to be divided by the square of {}", _of_its_shape(lambda v, a: v / a**2)),
    ("it is to be divided by the length of {}, as `len` gives it", lambda v, a: v / len(a)),
    ("it is to be multiplied by the length of {}, as `len` gives it", lambda v, a: v * len(a)),
)
OF_SEVERAL = {  # what may be said of values with commas alone around them: what is typed there is done to one of them
    words: words.replace("it is to be ", "each of them is to be ")
    for words, _ in OTHERWISE
    if words.startswith(("it is to be multiplied by", "it is to be divided by", "its entr"))
} | {
    "{} is missing: it is to be added": "{} is missing: it is to be added to each of them",
    "{} is to be taken off": "{} is to be taken off each of them",
    "it has the wrong sign": "each of them has the wrong sign",
}
ALWAYS_THE_SAME = [k for k, (words, _) in enumerate(OTHERWISE) if words in (NOUGHT, ONE)]  # what settles a condition
IN_ITS_PLACE = next(k for k, (words, _) in enumerate(OTHERWISE) if words == ANOTHER)
WITH_OWN = 6  # of those that take an argument also take a variable
ALONE = sum("{}" not in words for words, _ in OTHERWISE)  # of one value; the others take an argument as well


# Notes in the code ------------------------------------------------------------------------------------------------


def _noted(function, trees, lines):
    """The compiled definitions in which every value goes through a note, and the places by their numbers."""
    known = {name for name, value in function.__globals__.items() if isinstance(value, types.ModuleType)}
    places, noted = [], []
    for tree in trees:
        noted.append(ast.fix_missing_locations(_Noting(known, tree, lines, places).definition()))
    return compile(ast.Module(noted, []), "<noted>", "exec"), places


def _shown(node, lines):
    """A part of the code as it was typed, if it is short enough to be quoted."""
    if isinstance(node, ast.stmt) and hasattr(node, "body"):
        return lines.get(node.lineno, ast.unparse(node).partition("\n")[0]).strip()
    if node.lineno == node.end_lineno and node.lineno in lines:
        text = lines[node.lineno].encode()[node.col_offset : node.end_col_offset].decode()
    else:
        text = ast.unparse(node).partition("\n")[0]
    return text if len(text) <= LENGTH else f"{text[: LENGTH - 4]} ..."


class _Noting(ast.NodeTransformer):
    """Puts a note around every value that is computed, and behind every name that is bound."""

    def __init__(self, modules, tree, lines, places):
        self.modules, self.tree, self.lines, self.places = modules, copy.deepcopy(tree), lines, places
        stored = {n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
        self.own = stored | {argument.arg for argument in ast.walk(tree.args) if isinstance(argument, ast.arg)}

    def definition(self):
        self.tree.body = [part for statement in self.tree.body for part in self._list(self.visit(statement))]
        return self.tree

    @staticmethod
    def _list(found):
        return found if isinstance(found, list) else [found]

    def _note(self, node, name="", text=""):
        size, first = sum(1 for _ in ast.walk(node)), len(self.places)
        here = (node.lineno, text or _shown(node, self.lines), name, size, first)
        inner = self._inner(node)
        self.places.append(here)  # behind its parts: in the order in which they are computed
        call = ast.Call(ast.Name(NOTE, ast.Load()), [ast.Constant(len(self.places) - 1), inner], [])
        return ast.copy_location(call, node)

    def visit(self, node):
        if not isinstance(node, ast.expr):
            return super().visit(node)
        if isinstance(node, ast.Constant | ast.JoinedStr):
            return node
        if isinstance(getattr(node, "ctx", None), ast.Store | ast.Del) or self._is_of_a_module(node):
            return node
        if isinstance(node, ast.Starred | ast.Lambda | ast.Slice | ast.NamedExpr):
            return self._inner(node)
        return self._note(node, node.id if isinstance(node, ast.Name) else "")

    def _inner(self, node):
        if isinstance(node, ast.Call):
            if isinstance(node.func, ast.Attribute) and not self._is_of_a_module(node.func):
                node.func.value = self.visit(node.func.value)
            elif not isinstance(node.func, ast.Name | ast.Attribute):
                node.func = self.visit(node.func)
            node.args = [self.visit(arg) for arg in node.args]
            for keyword in node.keywords:
                keyword.value = self.visit(keyword.value)
            return node
        if isinstance(node, ast.Subscript):
            node.value = self.visit(node.value)
            if isinstance(node.slice, ast.Tuple):
                node.slice.elts = [self.visit(part) for part in node.slice.elts]
            else:
                node.slice = self.visit(node.slice)
            return node
        return self.generic_visit(node)

    def _is_of_a_module(self, node):
        while isinstance(node, ast.Attribute):
            node = node.value
        return isinstance(node, ast.Name) and node.id in self.modules and node.id not in self.own

    def _behind(self, statement, targets, text):
        """The statement, and behind it a note of every name that it binds or fills."""
        names = []
        for target in targets:
            for node in target.elts if isinstance(target, ast.Tuple | ast.List) else [target]:
                while isinstance(node, ast.Subscript | ast.Starred):
                    node = node.value
                if isinstance(node, ast.Name) and node.id in self.own:
                    names.append(node.id)
        notes = []
        for name in names:
            noted = self._note(ast.copy_location(ast.Name(name, ast.Load()), statement), name, text)
            notes.append(ast.copy_location(ast.Assign([ast.Name(name, ast.Store())], noted), statement))
        return [statement, *notes]

    def visit_Assign(self, node):
        only, text = node.targets[0], _shown(node, self.lines)
        if len(node.targets) == 1 and isinstance(only, ast.Name) and not isinstance(node.value, ast.Constant):
            node.value = self._note(node.value, only.id, text)
            return node
        node.value = self.visit(node.value)
        return self._behind(node, node.targets, text)

    def visit_AugAssign(self, node):
        text = _shown(node, self.lines)
        node.value = self.visit(node.value)
        return self._behind(node, [node.target], text)

    def visit_AnnAssign(self, node):
        node.annotation = ast.Constant(0)
        if node.value is None:
            return node
        text = _shown(node, self.lines)
        node.value = self.visit(node.value)
        return self._behind(node, [node.target], text)

    def visit_FunctionDef(self, node):
        node.body = [part for statement in node.body for part in self._list(self.visit(statement))]
        return node

    def visit_ClassDef(self, node):
        return node

    def visit_Match(self, node):
        return node


def _ticking(tree):
    """Counts the rounds of every loop, so that a change without an end is given up."""
    for node in ast.walk(tree):
        if isinstance(node, ast.For | ast.While):
            tick = ast.Expr(ast.Call(ast.Name(TICK, ast.Load()), [], []))
            node.body.insert(0, ast.fix_missing_locations(ast.copy_location(tick, node)))
