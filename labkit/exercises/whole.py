"""A property of answers: an array of whole numbers is one of numbers, and nothing is cut off.

Whoever makes an array like one that was given, by `zeros_like` or `copy`, gets one of integers where a student types
`np.array([3, 0, 4])`, and it cuts decimals off without a word. An answer that stops there says so itself.
"""

import copy

import numpy as np

from . import metrics


def right_for_whole_numbers(reference, metric, draw, *rounded):
    """A property for `Exercise.properties`.

    Parameters
    ----------
    reference : function
    metric : Metric
    draw : function
        Of a random generator: arguments.
    rounded : int
        Which of them are made whole, counted from 0.

    Returns
    -------
    holds : function
        Of the student's function and a random generator: None, or a sentence.
    """

    def holds(student, rng):
        args = tuple(_rounded(arg) if k in rounded else arg for k, arg in enumerate(draw(rng)))
        expected = reference(*_with_floats(args))
        try:
            result = student(*copy.deepcopy(args))
        except (TypeError, ValueError):  # told aloud: no wrong number goes on from there
            return None
        if _is_right(metric, result, expected):
            return None
        given = ", ".join(np.array2string(arg, separator=", ").replace("\n", "") for arg in args if _is_whole(arg))
        if not _is_right(metric, student(*_with_floats(args)), expected):
            return f"right so far, but not for {given}."
        return (
            f"right, but not for whole numbers: of {given} it makes something else than of the same numbers with a "
            "decimal point. Does it make an array like the one that is given, with `zeros_like`, `copy` or `np.array`? "
            "Such an array holds whole numbers too, and cuts decimals off: `dtype=float` makes it one of decimals."
        )

    return holds


def _rounded(arg):
    return np.rint(arg).astype(int)


def _is_right(metric, result, expected):
    try:
        return metric.equal(metric.admit(result, expected), expected)
    except metrics.Refused:
        return False


def _is_whole(arg):
    return isinstance(arg, np.ndarray) and arg.dtype.kind in "iu"


def _with_floats(args):
    return tuple(arg.astype(float) if _is_whole(arg) else copy.deepcopy(arg) for arg in args)
