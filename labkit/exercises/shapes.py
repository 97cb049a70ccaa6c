"""The general layer, shapes: what a result of the wrong shape has to do with the expected one.

The numbers may be right and stand in the wrong place: the diagonal for the matrix, the rows for their sum, one of two
results. What is said holds on all draws.
"""

import re
import types

import numpy as np

UNFIT = re.compile(r"broadcast .*?shapes? (\([\d, ]*\)) (?:into shape )?(\([\d, ]*\))")  # as NumPy says it
MOST = 6  # entries, rows or columns that are tried one by one
LARGEST = 10_000  # entries of a result that is looked at
DEPTH = 8  # lists within lists: more than any array of the course has axes, and one that holds itself has no end


def shape_words(results, expected, names=()):
    """What refused results are, in words; None when nothing is found.

    Parameters
    ----------
    results : list
        What the student's function returned, one for every draw, as it came.
    expected : list
        What the reference returned: an array, a number, or a tuple of several.
    names : sequence of str
        Names of several results.
    """
    if names:
        return _of_several(results, expected, names)
    results, expected = list(map(_numbers, results)), list(map(_numbers, expected))
    if any(x is None for x in (*results, *expected)):
        return None
    if all(x.size == 1 for x in (*results, *expected)):  # one number in brackets, as its refusal says
        return None
    for words, change in _less():
        if _holds(results, expected, lambda r, e, change=change: (r, change(e))):
            return f"what you return is {words}"
    for words, change in _more(min(len(r) if r.ndim else 0 for r in results)):
        if _holds(results, expected, lambda r, e, change=change: (change(r), e)):
            return words
    return None


def strange_size(said, args):
    """Which one of two sizes that do not fit entry by entry no argument has, in words; "" where it is not one alone.

    Parameters
    ----------
    said : str
        NumPy's words.
    args : sequence
        The arguments of the call.
    """
    found, known = UNFIT.search(said), [_sizes_of(arg) for arg in args]
    if not found or None in known:
        return ""
    one, other = (re.findall(r"\d+", shape)[::-1] for shape in found.groups())
    unfit = {int(n) for pair in zip(one, other) for n in pair if pair[0] != pair[1] and "1" not in pair}
    strange = unfit.difference(*known)
    if len(strange) != 1 or len(unfit) != 2:
        return ""
    size = f"no argument of this call has a size of {strange.pop()}"
    made = "does a function give so many, " if any(isinstance(arg, types.FunctionType) for arg in args) else ""
    return f"Entry by entry these shapes do not fit, and {size}: {made}is it typed in, is an entry too many or missing?"


def _sizes_of(value):
    """Lengths of an argument, and its value where it counts something; None where it is of another kind."""
    if isinstance(value, list | tuple):
        parts = [_sizes_of(part) for part in value]
        return None if None in parts else {len(value)}.union(*parts)
    if isinstance(value, np.ndarray):
        return {*value.shape, value.size}
    if isinstance(value, int | np.integer):
        return {int(value)}
    return {len(value)} if isinstance(value, str) else set() if isinstance(value, float | types.FunctionType) else None


def _of_several(results, expected, names):
    for k, name in enumerate(names):
        if _holds(results, expected, lambda r, e, k=k: (_numbers(r), _numbers(e[k]))):
            return f"what you return is {name} alone" if len(names) > 1 else None
    two = all(type(r) in (tuple, list) and len(r) == len(names) == 2 for r in results)
    if two and all(_holds(results, expected, lambda r, e, k=k: (_numbers(r[k]), _numbers(e[1 - k]))) for k in (0, 1)):
        return f"the two results are exchanged: first the {names[0]}, then the {names[1]}"
    for k, name in enumerate(names):
        parts = [r[k] for r in results if type(r) in (tuple, list) and len(r) == len(names)]
        if len(parts) < len(results) or _holds(parts, expected, lambda r, e, k=k: (_numbers(r), _numbers(e[k]))):
            continue
        if words := shape_words(parts, [e[k] for e in expected]):
            return f"{name}: {words}"
    return None


def _numbers(value, depth=DEPTH):
    """A result as an array of a size worth looking at; None for anything that is none, or hides what it is."""
    plain = type(value) is np.ndarray or isinstance(value, np.number) or type(value) in (int, float)
    listed = depth and type(value) in (list, tuple)
    if not plain and not (listed and all(_numbers(part, depth - 1) is not None for part in value[:LARGEST])):
        return None
    if getattr(value, "size", 0) > LARGEST:
        return None
    try:
        array = np.asarray(value)
    except ValueError:
        return None
    return array.astype(float) if array.dtype.kind in "iuf" and array.size else None


def _holds(results, expected, sides):
    try:
        with np.errstate(all="ignore"):
            return all(_equal(*sides(r, e)) for r, e in zip(results, expected))
    except (ValueError, IndexError, TypeError, AttributeError, np.linalg.LinAlgError):
        return False


def _equal(a, b):
    if a is None or b is None or np.shape(a) != np.shape(b):
        return False
    return np.size(b) > 0 and np.size(a) > 0 and bool(np.allclose(a, b, rtol=1e-9, atol=1e-12))


def _less():
    """(words, change of the expected result): the student returned a part or a digest of it, or put it elsewhere."""
    yield "the transpose of the expected result", lambda e: e.T
    yield "the expected matrix' diagonal alone", lambda e: np.diag(_square(e))
    yield "the roots of the expected matrix' diagonal", lambda e: np.sqrt(np.diag(_square(e)))
    yield "a matrix with the expected numbers on its diagonal", lambda e: np.diag(_vector(e))
    yield from _digests("the expected numbers")
    yield "the expected result without its last row or entry", lambda e: _long(e)[:-1]
    yield "the expected result without its first row or entry", lambda e: _long(e)[1:]
    yield "every second of the expected numbers or rows", lambda e: _long(e, 2)[::2]
    for k in range(1, MOST + 1):
        yield f"the {_first(k)} of the expected numbers or rows alone", lambda e, k=k: _long(e, k)[:k]
        yield f"the top left {k} by {k} block of the expected matrix", lambda e, k=k: _square(e, k)[:k, :k]
    for k in range(MOST):
        yield f"row {k} (counted from 0) of the expected result alone", lambda e, k=k: _table(e)[k]
        yield f"column {k} (counted from 0) of the expected result alone", lambda e, k=k: _table(e)[:, k]
        yield f"entry {k} (counted from 0) of the expected result alone", lambda e, k=k: _vector(e)[k]
        yield f"the {_first(k + 1, 'columns')} of the expected result alone", lambda e, k=k: _table(e)[:, : k + 1]


def _first(k, several=""):
    """The first k of several, in words."""
    return " ".join(filter(None, ("first", str(k) * (k > 1), several if k > 1 else several[:-1])))


def _more(rows):
    """(words, change of the result): the student returned more than is asked for."""
    yield "the expected result is the diagonal of the matrix you return", lambda r: np.diag(_square(r))
    yield (
        "the expected matrices are there, and among them the products of every matrix of the one stack with every one "
        "of the other, as `np.dot` gives them: `@` takes the two that stand in the same place",
        _stack_of_own,
    )
    yield "your result has one row or entry too many, the last; the others are right", lambda r: _long(r)[:-1]
    yield "your result has one row or entry too many, the first; the others are right", lambda r: _long(r)[1:]
    if rows > MOST:
        yield "the expected result is the last entry or row of what you return", lambda r: r[-1]
    for k in range(min(rows, MOST)):
        yield f"the expected result is entry or row {k} (counted from 0) of what you return", lambda r, k=k: r[k]
    yield "the expected result is the last entry or row of what you return", lambda r: r[-1]
    for k in range(MOST):
        yield f"the expected result is column {k} (counted from 0) of what you return", lambda r, k=k: _table(r)[:, k]
    for words, digest in _digests("the numbers you return"):  # of two numbers the first may be the larger by chance
        yield f"the expected result is {words}", digest


def _stack_of_own(r):
    """Of the products of all with all, shape (n, i, n, k), those of two with the same number."""
    if r.ndim != 4 or r.shape[0] != r.shape[2]:
        raise ValueError
    return np.einsum("iaib->iab", r)


def _digests(of):
    """(words, function) that make fewer numbers of many."""
    yield f"the sum of {of}", np.sum
    yield f"the mean of {of}", np.mean
    yield f"the length (norm) of {of}", np.linalg.norm
    yield f"the largest of {of}", np.max
    yield f"the smallest of {of}", np.min
    yield f"the number, from 0, of the largest of {of}", lambda e: float(np.argmax(_vector(e)))
    yield f"the number, from 0, of the smallest of {of}", lambda e: float(np.argmin(_vector(e)))
    for axis, each in ((0, "column"), (-1, "row")):
        yield f"the sum of each {each} of {of}", lambda e, axis=axis: _several(e, axis).sum(axis)
        yield f"the mean of each {each} of {of}", lambda e, axis=axis: _several(e, axis).mean(axis)
        yield (
            f"the length (norm) of each {each} of {of}",
            lambda e, axis=axis: np.linalg.norm(_several(e, axis), axis=axis),
        )


def _vector(e):
    if e.ndim != 1:
        raise ValueError
    return e


def _several(e, axis):
    """A table of more than one row, or column, along an axis: of one alone the sum is that one."""
    if _table(e).shape[axis] < 2:
        raise ValueError
    return e


def _table(e):
    if e.ndim < 2:
        raise ValueError
    return e


def _square(e, larger=0):
    if e.ndim != 2 or e.shape[0] != e.shape[1] or len(e) <= larger:
        raise ValueError
    return e


def _long(e, than=1):
    if not e.ndim or len(e) <= than:
        raise ValueError
    return e
