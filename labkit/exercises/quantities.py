"""The general layer, values: which other number that is made of the same data a wrong answer is.

A Value names the data it comes from. What is said is true by construction: the answer equals the number that is named,
to all its digits or to four of them.
"""

import itertools

import numpy as np

from . import relations

DIGITS = 4  # so many must agree: some two hundred candidates are met by chance by two rounded answers in a hundred
ALONE = ((lambda a: a, "{}"), (np.rad2deg, "{} in degrees"), (np.tan, "the tangent of {}"), (np.sin, "the sine of {}"))
PAIRS = (
    (lambda a, b: a * b, "{} times {}"),
    (lambda a, b: a / b, "{} divided by {}"),
    (lambda a, b: a + b, "{} plus {}"),
    (lambda a, b: a - b, "{} minus {}"),
)


def quantity_words(answer, data):
    """What an answer is that was made of the same data in another way.

    Parameters
    ----------
    answer : float
    data : dict
        Numbers, vectors (d,) and rows of vectors (n, d) by the names they have in the notebook.

    Returns
    -------
    words : str or None
        "this is the median length of the rows of `residuals`", say; None where nothing fits.
    """
    for value, words in _candidates({name: np.asarray(value, dtype=float) for name, value in data.items()}):
        if np.isfinite(value) and value != 0 and _agrees(answer, float(value)):
            return f"this is {words}"
    return None


def _quoted(name):
    """A name of the notebook in quotes; words as they are."""
    return name if " " in name and "[" not in name else f"`{name}`"


def _agrees(answer, value):
    off = abs(answer - value) / abs(value)
    return off <= 1e-9 or off < 20.0 * 10.0**-DIGITS and relations.significant_digits(answer, value) >= DIGITS


def _candidates(data):
    numbers = {name: value for name, value in data.items() if not value.ndim}
    with np.errstate(all="ignore"):
        for name, value in data.items():
            yield from (_of_number, _of_vector, _of_rows)[value.ndim](_quoted(name), value)
        for (a, x), (b, y) in itertools.permutations(numbers.items(), 2):
            for (f, of_a), (g, of_b), (both, words) in itertools.product(ALONE, ALONE, PAIRS):
                yield both(f(x), g(y)), words.format(of_a.format(_quoted(a)), of_b.format(_quoted(b)))


def _of_number(name, value):
    for change, words in ALONE:
        yield change(value), words.format(name)
    yield np.rad2deg(np.sin(value)), f"the sine of {name}, turned into degrees as an angle is"
    yield value**2, f"the square of {name}"
    yield np.sqrt(value), f"the root of {name}"


def _of_vector(name, v):
    for k, entry in enumerate(v):
        yield entry, f"entry {k} (counted from 0) of {name} alone"
        yield abs(entry), f"entry {k} (counted from 0) of {name} alone, without its sign"
    for n in range(2, len(v) + 1):
        for some in itertools.combinations(range(len(v)), n):
            which = f"the entries {', '.join(map(str, some))} (counted from 0) of {name}"
            yield np.linalg.norm(v[list(some)]), f"the length made of {which}"
    yield v @ v, f"the squared length of {name}"
    yield v.sum(), f"the sum of the entries of {name}"
    yield np.abs(v).sum(), f"the sum of the entries of {name} without their signs"
    yield np.abs(v).mean(), f"the mean of the entries of {name} without their signs"
    yield v.mean(), f"the mean of the entries of {name}"


def _of_rows(name, rows):
    lengths, of = np.linalg.norm(rows, axis=1), f"of the rows of {name}"
    yield lengths.mean(), f"the mean length {of}"
    yield np.median(lengths), f"the median length {of}"
    yield lengths.max(), f"the largest length {of}"
    yield lengths.min(), f"the least length {of}"
    yield lengths.sum(), f"the sum of the lengths {of}"
    yield lengths.std(), f"the standard deviation of the lengths {of}"
    yield lengths.std(ddof=1), f"the standard deviation of the lengths {of}, n - 1 below the root"
    yield np.linalg.norm(rows.mean(axis=0)), f"the length of the mean {of}"
    for k, column in enumerate(rows.T):
        yield np.sqrt((column**2).mean()), f"the rms of entry {k} (counted from 0) {of}"
        yield column.mean(), f"the mean of entry {k} (counted from 0) {of}"
        yield column.std(), f"the standard deviation of entry {k} (counted from 0) {of}"
    squares = rows**2
    for times, what in ((1, ""), (2, "twice "), (3, "three times ")):
        yield times * np.sqrt(squares.mean()), f"{what}the rms of all entries of {name}"
        yield times * np.sqrt(squares.sum(axis=1).mean()), f"{what}the rms length {of}"
        yield times * rows.std(), f"{what}the standard deviation of all entries of {name}"
    yield rows.std(ddof=1), f"the standard deviation of all entries of {name}, n - 1 below the root"
    yield squares.sum(), f"the sum of all squares of {name}"
    yield np.sqrt(squares.sum()), f"the root of the sum of all squares of {name}"
    yield squares.mean(), f"the mean of all squares of {name}"
    yield np.abs(rows).mean(), f"the mean of all entries of {name} without their signs"
    yield np.abs(rows).max(), f"the largest entry of {name} without its sign"
    most = np.linalg.norm(rows, 2)
    yield most, f"the largest singular value of {name}, `np.linalg.norm({name.strip('`')}, 2)`"
    yield (
        most / np.sqrt(len(rows)),
        f"the largest singular value of {name}, divided by the root of the number of its rows",
    )
    for k, length in enumerate(lengths):
        yield length, f"the length of row {k} (counted from 0) of {name} alone"
