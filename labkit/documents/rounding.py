"""What printed digits hide: the half unit of a number, and how far the half units of the inputs can move a result.

One mechanism for every bound of the ledger. A printed number stands for all numbers within half a unit of its last
digit; a result computed from several of them can be off by what each hides, propagated to first order and added up.
"""

import functools
import re
from typing import NamedTuple

import numpy as np

_NUMBER = re.compile(r"[-+]?(?=[.,]?\d)\d*(?:[.,](?P<decimals>\d*))?(?:[eE](?P<exponent>[-+]?\d+))?")


class Printed(NamedTuple):
    """Numbers as printed.

    Attributes
    ----------
    values : array
    halves : array
        Half a unit in the last printed digit of each.
    """

    values: np.ndarray
    halves: np.ndarray


def half_unit(printed):
    """Half a unit in the last printed digit: the most that rounding the printed number itself can hide.

    Reads 1.010000, -0.5, 1,5 (decimal comma), 3e-4 and 12.

    Parameters
    ----------
    printed : str

    Returns
    -------
    half : float or None
        None for text.
    """
    return _half_unit(printed.strip())


@functools.lru_cache(maxsize=4096)  # who looks for slips asks for the same few texts thousands of times
def _half_unit(printed):
    match = _NUMBER.fullmatch(printed)
    if not match:
        return None
    return 0.5 * 10.0 ** (int(match["exponent"] or 0) - len(match["decimals"] or ""))


def number(printed):
    """The number a printed string stands for; a comma is a decimal point."""
    return float(printed.replace(",", "."))


def read(texts):
    """Printed strings as numbers with their half units.

    Parameters
    ----------
    texts : str or array-like of str

    Returns
    -------
    Printed

    Raises
    ------
    ValueError
        Naming a string that is no number.
    """
    texts = np.asarray(texts)
    strange = [text for text in texts.ravel() if half_unit(str(text)) is None]
    if strange:
        raise ValueError(f"expected printed numbers such as 1.250, 1,5 or 3e-4, got {str(strange[0])!r}")
    values, halves = (np.reshape([of(str(t)) for t in texts.ravel()], texts.shape) for of in (number, half_unit))
    return Printed(values, halves)


def propagate(function, *inputs):
    """A function of printed numbers, and how far their rounding can move it, to first order.

    Each number goes up and down by its half unit alone; the larger of the two moves counts, and the moves add up.

    Parameters
    ----------
    function : callable
        Takes arrays in the order of `inputs`, returns a number or an array.
    inputs : Printed or array-like
        What is no `Printed` is exact.

    Returns
    -------
    value, bound : float or array
    """
    values = [np.array(x.values if isinstance(x, Printed) else x, dtype=float) for x in inputs]
    value = np.asarray(function(*values), dtype=float)
    bound = np.zeros_like(value)
    for k, given in enumerate(inputs):
        for place in np.ndindex(values[k].shape) if isinstance(given, Printed) else ():
            half = np.asarray(given.halves)[place]
            moved = [value + 0.0, value + 0.0]
            for side, sign in enumerate((1.0, -1.0)):
                trial = [v.copy() for v in values]
                trial[k][place] += sign * half
                moved[side] = np.abs(np.asarray(function(*trial), dtype=float) - value)
            bound += np.maximum(*moved)
    return value[()], bound[()]


def is_cut_off(printed, value, bound=0.0):
    """Whether a printed number is the value with its further digits cut off instead of rounded.

    Parameters
    ----------
    printed : str
    value : float
    bound : float
        How far rounded inputs can move the value.
    """
    shown, unit = abs(number(printed)), 2 * half_unit(printed)
    size = abs(value) if value * number(printed) >= 0 else -abs(value)
    slack = 1e-6 * unit
    return shown - bound - slack <= size < shown + unit + bound - slack
