"""The general layer, arguments: whether a wrong result is the right one for arguments that differ in one respect.

What is said holds on all draws: the reference, called with the changed arguments, gives the student's result on
all draws. The commonest slips are of this kind: two arguments exchanged, a matrix not inverted, a term forgotten, an
angle in degrees, the last row left out, the notebook's data in place of what was handed over.
"""

import itertools
import re

import numpy as np

LONGEST = 6  # entries of a vector that are changed one by one
SIZES = re.compile(r"converted to|twice|half|squared|the root|` times `|divided by")  # changes of how large a number is


def changes(names, inputs, notebook):
    """The changes of arguments that are tried, the likeliest first.

    Parameters
    ----------
    names : list of str
        What the arguments are called.
    inputs : list of tuple
        The arguments of every draw.
    notebook : dict
        Data of the notebook, by name, that the judged function reads.

    Returns
    -------
    changes : iterator of (words, function)
        What comes after "your result is what comes out", and a function from one draw's arguments to changed ones.
    """
    columns = list(zip(*inputs))
    numeric = [k for k, column in enumerate(columns) if all(map(is_numeric, column))]
    for k, (name, value) in itertools.product(numeric, notebook.items()):
        if _is_like(value, columns[k][0]):
            yield f"with the notebook's `{name}` in place of `{names[k]}`", _replace(k, lambda _, value=value: value)
    for i, j in itertools.combinations(numeric, 2):
        if all(np.shape(a) == np.shape(b) for a, b in zip(columns[i], columns[j])):
            yield f"with `{names[i]}` and `{names[j]}` exchanged", _exchange(i, j)
    yield from _fewer_rows(names, columns, numeric)
    yield from _of_lower_size(names, columns, numeric)
    for k in numeric:
        for words, change in _of_one(names[k], columns[k]):
            yield words, _replace(k, change)
    yield from _scaled(names, columns, numeric)


def _scaled(names, columns, numeric):
    """One argument multiplied or divided by another one that is a number, but no count."""
    plain = [k for k in numeric if all(np.ndim(v) == 0 and not isinstance(v, int | np.integer) for v in columns[k])]
    for k, by in itertools.product(numeric, plain):
        if k != by and not all(isinstance(v, int | np.integer) for v in columns[k]):
            here, other = f"`{names[k]}`", f"`{names[by]}`"
            yield f"with {here} times {other} in place of {here}", _by_another(k, by, np.multiply)
            yield f"with {here} divided by {other} in place of {here}", _by_another(k, by, np.divide)


def _by_another(k, by, operation):
    return lambda args: (*args[:k], operation(args[k], args[by]), *args[k + 1 :])


def is_numeric(value):
    """Whether an argument is a number or an array of numbers."""
    if isinstance(value, bool):
        return False
    return isinstance(value, int | float | np.number) or isinstance(value, np.ndarray) and value.dtype.kind in "if"


def _is_like(value, given):
    """Whether data of the notebook could stand where an argument is meant: numbers of the same dimensions."""
    return is_numeric(value) and np.ndim(value) == np.ndim(given) and np.shape(value)[1:] == np.shape(given)[1:]


def _replace(k, change):
    return lambda args: (*args[:k], change(args[k]), *args[k + 1 :])


def _exchange(i, j):
    def change(args):
        args = list(args)
        args[i], args[j] = args[j], args[i]
        return tuple(args)

    return change


def _fewer_rows(names, columns, numeric):
    """Rows left out or turned around, at once in all arguments that have one row each of the same things."""
    arrays = [k for k in numeric if all(np.ndim(v) and len(v) > 1 for v in columns[k])]
    groups = {}
    for k in arrays:
        if not _is_single(columns[k]):
            groups.setdefault(tuple(map(len, columns[k])), []).append(k)
    for group in groups.values():
        of = " and ".join(f"`{names[k]}`" for k in group)
        for words, rows in (
            (f"without the last of {of}", np.s_[:-1]),
            (f"without the first of {of}", np.s_[1:]),
            (f"with {of} in reverse order", np.s_[::-1]),
            (f"with the first of {of} alone", np.s_[:1]),
            *((f"with the first {n} of {of} alone", np.s_[:n]) for n in (2, 3, 4)),
        ):
            yield words, _rows(group, rows)


def _of_lower_size(names, columns, numeric):
    """The first ones of a vector, with the rows and columns of matrices that go with them: code for one size alone."""
    axes = {}
    for k in numeric:
        for axis in range(np.ndim(columns[k][0])) if len({np.ndim(v) for v in columns[k]}) == 1 else ():
            axes.setdefault(tuple(np.shape(v)[axis] for v in columns[k]), []).append((k, axis))
    for sizes, found in axes.items():
        vectors = [k for k, _ in found if np.ndim(columns[k][0]) == 1]
        others = list(dict.fromkeys(k for k, _ in found if k not in vectors))
        if vectors and others and len(set(sizes)) > 1:
            of, beside = (" and ".join(f"`{names[k]}`" for k in group) for group in (vectors, others))
            for n, first in ((1, "the first"), (2, "the first 2")):
                yield f"with {first} of {of} alone, and what goes with it in {beside}", _up_to(n, found)


def _up_to(n, axes):
    def change(args):
        args = list(args)
        for k, axis in axes:
            args[k] = np.take(args[k], range(min(n, np.shape(args[k])[axis])), axis)
        return tuple(args)

    return change


def _is_single(column):
    """Whether an argument is one point, matrix or pose, which has no rows to leave out."""
    return all(np.shape(v) in ((2,), (3,), (2, 2), (3, 3), (4, 4)) for v in column)


def _rows(group, rows):
    return lambda args: tuple(arg[rows] if k in group else arg for k, arg in enumerate(args))


def _of_one(name, column):
    """What may have become of one argument."""
    here, first = f"`{name}`", column[0]
    if all(isinstance(v, int | np.integer) for v in column):
        yield f"with {here} - 1 in place of {here}", lambda v: v - 1
        yield f"with {here} + 1 in place of {here}", lambda v: v + 1
        return
    shape = np.shape(first)
    if len(shape) > 1 and shape[-1] == shape[-2]:
        yield from _of_matrices(here, column)
    yield f"with -{here} in place of {here}", np.negative
    yield f"if {here} were 0", lambda v: 0 * v
    if not shape:
        yield f"if {here} were 1", lambda v: 1.0
    yield f"with {here} converted to radians", np.deg2rad
    yield f"with {here} converted to degrees", np.rad2deg
    yield f"with twice {here}", lambda v: 2 * v
    yield f"with half of {here}", lambda v: v / 2
    yield f"with {here} squared", np.square
    if all(np.min(v, initial=0.0) >= 0 for v in column):
        yield f"with the root of {here}", np.sqrt
    if len(shape) == 1 and shape[0] <= LONGEST and all(np.shape(v) == shape for v in column):
        yield from _of_entries(here, shape[0])


def _of_matrices(here, column):
    yield f"with {here} transposed", lambda v: np.swapaxes(v, -1, -2)
    yield f"with {here} inverted", np.linalg.inv
    yield f"with the diagonal of {here} alone", lambda v: v * np.eye(v.shape[-1])
    yield f"if {here} were the identity", lambda v: np.broadcast_to(np.eye(v.shape[-1]), v.shape).copy()
    if all(np.shape(v)[-1] == 4 and np.allclose(v[..., 3, :], (0, 0, 0, 1)) for v in column):
        yield f"with the rotation of {here} transposed", _pose(lambda R: np.swapaxes(R, -1, -2), lambda t: t)
        yield f"with the translation of {here} negated", _pose(lambda R: R, np.negative)
        yield f"if {here} had no translation", _pose(lambda R: R, lambda t: 0 * t)
        yield f"if {here} did not turn", _pose(lambda R: 0 * R + np.eye(3), lambda t: t)


def _pose(turn, shift):
    def change(T):
        T = T.copy()
        T[..., :3, :3], T[..., :3, 3] = turn(T[..., :3, :3].copy()), shift(T[..., :3, 3].copy())
        return T

    return change


def _of_entries(here, n):
    for k in range(n):
        entry = f"entry {k} (counted from 0) of {here}"
        yield f"if {entry} had the opposite sign", _entry(k, np.negative)
        yield f"if {entry} were 0", _entry(k, lambda v: 0.0)
        yield f"if {entry} were half as large", _entry(k, lambda v: v / 2)
        yield f"if {entry} were twice as large", _entry(k, lambda v: 2 * v)
    for i, j in itertools.combinations(range(n), 2):
        yield f"with the entries {i} and {j} (counted from 0) of {here} exchanged", _entries(i, j)


def _entry(k, change):
    def changed(v):
        v = np.array(v, dtype=float)
        v[k] = change(v[k])
        return v

    return changed


def _entries(i, j):
    def changed(v):
        v = np.array(v, dtype=float)
        v[[i, j]] = v[[j, i]]
        return v

    return changed
