"""What functions return: as numbers, admitted or refused, and which of them are equal."""

import copy
from dataclasses import dataclass

import numpy as np

from . import metrics, rerun

FLOAT32_TOLERANCE = 2e-5  # relative, of numbers of single precision that are compared with a mistake's


@dataclass(frozen=True)
class Refusal:
    """A result the metric refused, kept because a named mistake may explain it (a transposed shape, say)."""

    value: object


def admitted_by(metric, expected, result):
    try:
        return metric.admit(result, expected)
    except metrics.Refused:
        return Refusal(result)


def numbers_of(result):
    """The numbers of an admitted or refused result, as a copy; None where they are none, or too many."""
    value = result.value if isinstance(result, Refusal) else result
    found = rerun.numeric(value)
    if found is not None or not isinstance(value, list | tuple):
        return found
    parts = [rerun.numeric(part) for part in value]  # of several results
    return np.concatenate([p.ravel() for p in parts]) if parts and not any(p is None for p in parts) else None


def is_another(first, run):
    """Whether a word, a set or several results are others than before, or an error, at a second call."""
    if type(first) in (str, set, frozenset):
        return run.error is not None or run.result != first
    several = isinstance(first, list | tuple) and isinstance(run.result, list | tuple)
    pairs = [(rerun.numeric(a), rerun.numeric(b)) for a, b in zip(first, run.result)] if several else []
    return any(a is not None and b is not None and not same_numbers(a, b) for a, b in pairs)


def same_numbers(one, other):
    if one is None or other is None or one.shape != other.shape:
        return False
    return bool(np.allclose(one, other, rtol=1e-9, atol=1e-12, equal_nan=True))


def equal_as_written(metric, result, wrong):
    """Whether a result equals a mistake's: by the metric, or as bare arrays where it refuses the mistake itself."""
    try:
        metric.admit(wrong, wrong)
    except metrics.Refused:
        return equal_arrays(result, wrong)
    return metric.equal(result, wrong) or isinstance(metric, metrics.Poses) and equal_arrays(result, wrong)


def equal_arrays(a, b, atol=1e-12):
    if isinstance(b, tuple):
        return isinstance(a, tuple | list) and len(a) == len(b) and all(equal_arrays(*ab, atol) for ab in zip(a, b))
    a, b = np.asarray(a), np.asarray(b)
    rtol = FLOAT32_TOLERANCE if metrics.is_single(a) or metrics.is_single(b) else 1e-9
    kind = complex if "c" in (a.dtype.kind, b.dtype.kind) else float
    return a.shape == b.shape and np.allclose(a.astype(kind), b.astype(kind), rtol=rtol, atol=atol, equal_nan=True)


def are_one(results):
    """Whether results are one and the same, however small they are."""
    try:
        return all(equal_arrays(result, results[0], atol=0.0) for result in results[1:])
    except (TypeError, ValueError):  # no numbers, but words or a set of them
        return all(type(result) in (str, set) and result == results[0] for result in results[1:])


def is_row(value, rows):
    """Whether numbers are one row of an array."""
    value, rows = rerun.numeric(value), rerun.numeric(rows)
    if value is None or rows is None or not value.ndim or rows.shape[1:] != value.shape or len(rows) < 2:
        return False
    return any(np.array_equal(value, row) for row in rows)


def failure_of(mistake, args):
    """What a wrong variant raises on a draw; None where it can compute it."""
    try:
        with np.errstate(all="ignore"):
            mistake.variant(*copy.deepcopy(args))
    except Exception as error:
        return error
    return None


def could_change(one, other):
    """Whether an argument of one draw can be put in the place of another's, and makes another call of it."""
    if not all(isinstance(v, int | float | np.number | np.ndarray) and not isinstance(v, bool) for v in (one, other)):
        return False
    return np.shape(one) == np.shape(other) and not np.array_equal(one, other)
