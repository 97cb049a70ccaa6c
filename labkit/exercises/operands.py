"""The general layer, terms and factors: a wrong result that one argument, or how many there are, turns into the right.

A summand forgotten or once too often, an argument handed back as it came, a mean where a sum is meant, a vector not
normalized. What is said holds on all draws, whatever code it came from.
"""

import numpy as np

from . import relations
from .arguments import is_numeric

POWERS = {1.0: "{}", 2.0: "the square of {}", 0.5: "the root of {}"}
CLOSE = 1e-7  # how far apart, relatively, two ratios may lie that are the same


def operand_words(metric, results, expected, named):
    """What one argument has to do with a wrong result, in words; None when nothing is found.

    Parameters
    ----------
    metric : Metric
        Compares one result with the expected one.
    results, expected : list of ndarray
        One of each for every draw.
    named : list of dict
        The arguments of every draw, by the name the student gave them.
    """
    if not named or not any(np.any(e) for e in expected):
        return None
    numeric = _numeric(named)
    words = _term(metric, results, expected, numeric) or _factor(results, expected, numeric)
    if words or not all(np.all(e) for e in expected):
        return words
    return _factor(results, [1 / e for e in expected], numeric, "the reciprocal of the expected one")


def _numeric(named):
    """The arguments that are numbers or arrays of numbers on all draws, each a list with one array for every draw."""
    found = {}
    for name in named[0]:
        values = [given[name] for given in named]
        if all(is_numeric(value) for value in values):
            found[name] = [np.asarray(value, dtype=float) for value in values]
    return found


def _term(metric, results, expected, numeric):
    """A summand that is an argument, or the argument itself."""
    for name, values in numeric.items():
        if not all(_fits(v, r) and np.any(v) for v, r in zip(values, results)):
            continue
        if all(r.shape == v.shape and metric.equal(r, v) for r, v in zip(results, values)):
            return f"your result is the argument `{name}`, unchanged"
        for times, words in (
            (1, f"the argument `{name}` is missing: added to your result it gives the expected one"),
            (-1, f"the argument `{name}` is in your result once too often: taken away, it leaves the expected one"),
            (2, f"twice the argument `{name}` is missing: does it enter with the wrong sign?"),
            (-2, f"twice the argument `{name}` is too much in your result: does it enter with the wrong sign?"),
        ):
            if all(metric.equal(r + times * v, e) for r, v, e in zip(results, values, expected)):
                return words
    return _identity(metric, results, expected)


def _fits(value, result):
    """Whether a value can be added entry by entry: of the same shape, one number, or one row for every row."""
    return value.shape in ((), result.shape) or value.ndim and value.shape == result.shape[-value.ndim :]


def _identity(metric, results, expected):
    if not all(r.ndim == 2 and r.shape[0] == r.shape[1] for r in results):
        return None
    for sign, words in (
        (1, "the identity is missing: added to your matrix it gives"),
        (-1, "your matrix less the identity is"),
    ):
        if all(metric.equal(r + sign * np.eye(len(r)), e) for r, e in zip(results, expected)):
            return f"{words} the expected one"
    return None


def _factor(results, expected, numeric, what="the expected one"):
    """A factor between result and expected that differs from draw to draw as an argument does, or a number of them."""
    ratios = [relations.constant_ratio(r, e, CLOSE) for r, e in zip(results, expected)]
    if None in ratios or len(ratios) < 2 or np.ptp(np.abs(ratios)) <= CLOSE * abs(ratios[0]):
        return None
    for words, sizes in _sizes(numeric):
        for power, form in POWERS.items():
            if power < 1 and np.any(sizes < 0):
                continue
            for sign, minus in ((1, ""), (-1, "minus ")):
                if _same(ratios, sign * sizes**power):
                    return f"your result is {minus}{what} times {form.format(words)}"
                if _same(ratios, sign * sizes**-power):
                    return f"{form.format(words)} times your result is {minus}{what}"
    return None


def _same(ratios, sizes):
    return bool(np.all(np.abs(np.array(ratios) - sizes) <= CLOSE * np.abs(sizes)))


def _sizes(numeric):
    """Numbers that arguments have on each draw, with words: themselves, lengths, norms, sums, counts."""
    for name, values in numeric.items():
        here = f"`{name}`"
        if all(v.ndim == 0 for v in values):
            yield from _signed(here, values)
        elif all(v.ndim for v in values):
            counts = np.array([len(v) for v in values], dtype=float)
            of = f"the {'number of entries' if values[0].ndim == 1 else 'number of rows'} of {here}"
            yield from _positive(of, counts)
            yield from _positive(f"one less than {of}", counts - 1)
            yield from _positive(f"n / (n - 1) (n: {of})", counts / np.maximum(counts - 1, 1e-9))
        if all(v.ndim == 1 for v in values):
            yield from _positive(f"the length (norm) of {here}", [np.linalg.norm(v) for v in values])
            yield from _positive(f"the sum of {here}", [v.sum() for v in values])
            yield from _positive(f"the largest of {here}", [v.max(initial=0.0) for v in values])
            if all(v.size == values[0].size <= 4 for v in values):
                for k in range(values[0].size):
                    yield from _signed(f"`{name}[{k}]`", [v[k] for v in values])
        if all(v.ndim == 2 for v in values):
            counts = np.array([v.shape[1] for v in values], dtype=float)
            yield from _positive(f"the number of columns of {here}", counts)


def _signed(words, values):
    """Numbers as they are, and without their signs where some are negative."""
    values = np.asarray(values, dtype=float)
    if np.all(values > 0):
        yield from _positive(words, values)
    elif np.all(np.isfinite(values)) and np.all(values):
        yield words, values
        yield from _positive(f"the absolute value of {words}", np.abs(values))


def _positive(words, sizes):
    sizes = np.asarray(sizes, dtype=float)
    if np.all(np.isfinite(sizes)) and np.all(sizes > 0):
        yield words, sizes
