"""What holds of every answer: a whole number is a number, typed as `3` or standing in an array of integers.

Whoever makes an array like one that was given, by `zeros_like` or `copy`, gets one of integers where a student types
`np.array([3, 0, 4])`, and it cuts decimals off without a word. An answer that stops there says so itself.

The numbers of some draws are made whole, those of all arguments at once and of each alone. No table says of which that
can be asked: something is told only where the answer is right for the same numbers with a decimal point.
"""

import contextlib
import copy
import inspect
import itertools

import numpy as np

from . import metrics
from .budget import seconds

DRAWS = 2  # of which the numbers are made whole
LARGEST = 2**31  # numbers beyond are left as they are: their products may not fit into an integer
LONGEST = 0.2  # seconds of processor time for all of them: a slow but right function gets as far as it gets
SHOWN = 16  # entries of an array that is shown whole
QUARTER_TURNS = np.array(
    [
        np.eye(3, dtype=int)[list(order)] * signs
        for order in itertools.permutations(range(3))
        for signs in itertools.product((1, -1), repeat=3)
        if np.linalg.det(np.eye(3)[list(order)] * signs) > 0
    ]
)


class WholeNumbers:
    """A property of the answers to an exercise: right for whole numbers as it is for others.

    The draws are the same at every check; each is made once, and what its result is computed once.
    """

    def __init__(self, exercise):
        self._exercise, self._cases = exercise, None

    def __call__(self, student, rng=None):
        """None, or a sentence."""
        began = seconds()
        self._cases = self._cases or list(_cases(self._exercise))
        for changed, given, with_point, expected, metric in self._cases:
            if seconds() - began > LONGEST:
                return None
            wrong = not _succeeds(student, given, expected, metric, aloud=True)
            if wrong and _succeeds(student, with_point, expected, metric, aloud=False):
                return _told(self._names(student), changed, given)
        return None

    def _names(self, student):
        """What the arguments are called, by the student where that can be read."""
        with contextlib.suppress(TypeError, ValueError):
            names = list(inspect.signature(student).parameters)
            return names if len(names) == len(self._exercise.arguments) else self._exercise.arguments
        return self._exercise.arguments


def _cases(exercise):
    """(numbers of the arguments made whole, arguments, the same with a decimal point, expected, metric)."""
    for number in range(DRAWS if exercise.metric else 0):
        args, _, metric = exercise.plain_again[number]
        made = [whole(arg) for arg in args]
        may = [k for k, new in enumerate(made) if new is not None and exercise.arguments[k] not in exercise.decimals]
        for changed in [may, *([k] for k in may if len(may) > 1)] if may else []:
            given = tuple(made[k] if k in changed else arg for k, arg in enumerate(args))
            with_point = tuple(_with_point(arg) if k in changed else arg for k, arg in enumerate(given))
            try:
                with np.errstate(all="ignore"):
                    expected = exercise.reference(*copy.deepcopy(with_point))
                sound = metric.equal(metric.admit(expected, expected), expected)
            except Exception:  # no such numbers for it, a singular matrix perhaps
                continue
            if sound:
                yield changed, given, with_point, expected, metric


def whole(value):
    """A number, array, list or tuple in integers, a rotation and that of a pose as quarter turns; None where it holds
    other things than decimals, or what no integer is.
    """
    if isinstance(value, list | tuple):
        parts = [whole(part) for part in value]
        return None if not parts or any(part is None for part in parts) else type(value)(parts)
    if not isinstance(value, float | np.ndarray) or np.asarray(value).dtype.kind != "f":
        return None
    if not np.size(value) or not np.isfinite(value).all() or np.abs(value).max() > LARGEST:
        return None
    away = np.copysign(np.ceil(np.abs(value)), value).astype(int)  # so that no number becomes 0
    if not isinstance(value, np.ndarray):
        return int(away)
    if value.ndim > 1 and value.shape[-2:] in ((3, 3), (4, 4)):
        R = value[..., :3, :3]
        if np.allclose(R.swapaxes(-1, -2) @ R, np.eye(3)):
            away[..., :3, :3] = QUARTER_TURNS[np.einsum("gij,...ij->...g", QUARTER_TURNS, R).argmax(axis=-1)]
    return away


def _with_point(value):
    if isinstance(value, list | tuple):
        return type(value)(map(_with_point, value))
    return value.astype(float) if isinstance(value, np.ndarray) else float(value)


def _succeeds(student, args, expected, metric, aloud):
    """Whether the result is right; `aloud` is what to say where the answer raises, and no wrong number goes on."""
    try:
        result = student(*copy.deepcopy(args))
    except Exception:
        return aloud
    try:
        return metric.equal(metric.admit(result, expected), expected)
    except metrics.Refused:
        return False


def _told(names, changed, args):
    given = ", ".join(_given(names[k], args[k]) for k in changed)
    return (
        f"right, but not for whole numbers: for {given} your result is another one than for the same numbers with a "
        "decimal point. Does it make an array of the kind that is given, with `zeros_like`, `copy`, `np.array` or "
        "`dtype=`? Such an array holds whole numbers too, and cuts decimals off: `dtype=float` keeps them."
    )


def _given(name, value):
    if isinstance(value, int) or isinstance(value, np.ndarray) and value.size <= SHOWN:
        return f"`{name}` = {np.array2string(np.asarray(value), separator=', ')}".replace("\n", "")
    return f"`{name}` of whole numbers"
