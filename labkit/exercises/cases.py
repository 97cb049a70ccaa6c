"""The general layer, cases: where an answer is right on some draws and not on others, what those have in common."""

import math

import numpy as np

ENTRIES = 4  # of a short vector, that are looked at one by one
WAYS = 1000  # in which as many draws could have been missed: with fewer, one of some fifty traits may fit by chance


def case_words(draws, missed):
    """What the draws on which an answer is wrong have in common, and no other has; None when nothing is found, or when
    so few draws are looked at, or missed, that it may be chance.

    Parameters
    ----------
    draws : list of (dict, object)
        The arguments of every draw by name, and the expected result.
    missed : list of bool
        On which of them the answer is wrong.
    """
    if math.comb(len(missed), sum(missed)) < WAYS:
        return None
    traits = [_traits(given, expected) for given, expected in draws]
    shared = set(traits[0]).intersection(*traits[1:])
    for words in traits[0]:
        if words in shared and [trait[words] for trait in traits] == missed:
            return words
    return None


def _traits(given, expected):
    """{words: whether they are true} of one draw."""
    found = {}
    for name, value in given.items():
        found |= _of_value(f"`{name}`", value)
    if isinstance(expected, str | bool | int | np.bool_):
        found |= {f"`{expected!r}` is right": True}
    elif (
        not isinstance(expected, tuple) and np.ndim(expected) == 0 and not isinstance(expected, set | frozenset | dict)
    ):
        found["the right result is negative"] = bool(expected < 0)
        found["the right result is 0"] = bool(expected == 0)
    elif isinstance(expected, set | frozenset):
        found["the right result is empty"] = not expected
    return found


def _of_value(here, value):
    if isinstance(value, bool | np.bool_):
        return {f"{here} is True": bool(value), f"{here} is False": not value}
    if isinstance(value, str):
        return _of_text(here, value)
    if isinstance(value, list | tuple) and value and all(isinstance(v, str) for v in value):
        return {f"{here} holds a comma": any("," in v for v in value), f"{here} has one entry": len(value) == 1}
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        return {}
    return _of_array(here, array)


def _of_text(here, text):
    return {
        f"{here} has a comma": "," in text,
        f"{here} has no decimals": "." not in text and "," not in text,
        f"{here} has an exponent": "e" in text.lower(),
        f"{here} has a negative exponent": "e-" in text.lower(),
        f"{here} ends with a zero behind the point": text.endswith("0") and ("." in text or "," in text),
        f"{here} is negative": text.startswith("-"),
    }


def _of_array(here, array):
    found = {}
    if array.ndim == 0:
        found = _of_number(here, float(array))
    elif array.ndim == 1 and array.size <= ENTRIES:
        for k, entry in enumerate(array):
            found |= _of_number(f"{here[:-1]}[{k}]`", float(entry))
    elif array.size:
        found[f"{here} has negative entries"] = bool((array < 0).any())
        found[f"{here} has entries that are 0"] = bool((array == 0).any())
        found[f"{here} has infinite entries"] = bool(np.isinf(array).any())
    if array.ndim:
        found |= _of_count(here, ("entry", "entries") if array.ndim == 1 else ("row", "rows"), len(array))
    if array.ndim == 2:
        found |= _of_count(here, ("column", "columns"), array.shape[1])
        found[f"{here} is not square"] = array.shape[0] != array.shape[1]
        found[f"{here} has more rows than columns"] = array.shape[0] > array.shape[1]
        found[f"{here} has fewer rows than columns"] = array.shape[0] < array.shape[1]
    return found


def _of_count(here, words, count):
    one, several = words
    found = {}
    for n in (1, 2, 3):
        found[f"{here} has {n} {one if n == 1 else several}"] = count == n
        found[f"{here} has more than {n} {one if n == 1 else several}"] = count > n
    found[f"the number of {several} of {here} is odd"] = count % 2 == 1
    found[f"the number of {several} of {here} is even"] = count % 2 == 0
    return found


def _of_number(here, value):
    return {
        f"{here} is negative": value < 0,
        f"{here} is positive": value > 0,
        f"{here} is 0": value == 0,
        f"{here} is not 0": value != 0,
        f"{here} is above pi": value > np.pi,
        f"{here} is beyond pi, in either direction": abs(value) > np.pi,
        f"{here} is above 1": value > 1,
        f"{here} is 1": value == 1,
        f"{here} is not 1": value != 1,
    }
