"""The general layer, cases: where an answer is right on some draws and not on others, what those have in common."""

import inspect
import itertools
import math
import re

import numpy as np

ENTRIES = 4  # of a short vector, that are looked at one by one
COLUMNS = range(1, 10)  # how many a matrix of several may have, at most, to be told apart
WAYS = 1000  # in which as many draws could have been missed: with fewer, one of some fifty traits may fit by chance
SIZES = 8  # of an argument that are listed, at most
PAIRS = 200  # times as many ways where two traits are told together: there are so many more of them
LENGTH = re.compile(
    r"pose\[[01]\]|\bx\[[01]\]|point|position|origin|landmark|distance|range|way|speed|^`v_"
)  # no angle
ARGUMENT = re.compile(r"`([A-Za-z_]\w*)(?!.* is right$)")
CONFUSED = 3  # pairs of words that are told, at most


def case_words(draws, missed, follows=lambda name, true: True):
    """What the draws on which an answer is wrong have in common, behind "it was wrong": "exactly where" no other has
    it, be it one of two things or both, "only where" some have; None when nothing is found, or when so few draws are
    looked at, or missed, that it may be chance.

    Parameters
    ----------
    draws : list of (dict, object)
        The arguments of every draw by name, and the expected result.
    missed : list of bool
        On which of them the answer is wrong.
    follows : function
        follows(name of an argument, on which draws something is true of it) -> whether the answer comes right with this
        argument from the other draws: else it is not this that matters.
    """
    ways = math.comb(len(missed), sum(missed))
    if ways < WAYS:
        return None
    found = {words: true for words, true in _told(draws).items() if any(true) and not all(true)}
    told = {words: true for words, true in found.items() if all(t or not m for t, m in zip(true, missed))}
    parts = {words: true for words, true in found.items() if all(m or not t for t, m in zip(true, missed))}
    found = {words: true for words, true in found.items() if words not in told or _follows(words, true, follows)}
    told, parts = ({words: true for words, true in some.items() if words in found} for some in (told, parts))
    exact = (words for words, true in told.items() if true == missed)
    if words := next(exact, None) or _count_words(draws, missed):
        return f"exactly where {words}"
    for one, two in itertools.combinations(told, 2) if ways > PAIRS * WAYS else ():
        if [a and b for a, b in zip(told[one], told[two])] == missed:
            return f"exactly where {one} and {two}"
    if ways > PAIRS * WAYS and (words := _either(parts, missed)):
        return f"exactly where {words}"
    rarest = min(told, key=lambda words: sum(told[words]), default=None)
    if rarest and (sum(told[rarest]) / len(missed)) ** sum(missed) < 1 / WAYS:
        return f"only where {rarest}"
    return None


def _follows(words, true, follows):
    names = set(ARGUMENT.findall(words))
    return len(names) != 1 or follows(*names, true)


def _either(parts, missed):
    """Two traits of which the draws have one or both on which an answer is wrong, in words; None where there are none.

    parts: {words: on which draws they are true} of traits that no other draw has.
    """
    for one, two in itertools.combinations(parts, 2):
        if [a or b for a, b in zip(parts[one], parts[two])] == missed:
            return f"{one} or {two}"
    return None


def _count_words(draws, missed):
    """How many rows or entries an argument has on the draws on which an answer is wrong, and on the others, in words;
    None where it may be as many on both. No rule is made of these numbers: of 3, 6 and 9 links not all are odd.
    """
    for name in draws[0][0]:
        values = [given.get(name) for given, _ in draws]
        if not all(isinstance(value, np.ndarray) and value.ndim for value in values):
            continue
        wrong, right = (sorted({len(v) for v, m in zip(values, missed) if m is kind}) for kind in (True, False))
        if min(len(wrong), len(right)) > 1 and len(wrong + right) <= SIZES and not set(wrong) & set(right):
            several = "entries" if values[0].ndim == 1 else "rows"
            return f"`{name}` has {_any_of(wrong)} {several}, and not where it has {_any_of(right)}"
    return None


def _any_of(numbers):
    *first, last = map(str, numbers)
    return f"{', '.join(first)} or {last}"


def _told(draws):
    """{words: on which draws they are true}."""
    traits = [_traits(given, expected) for given, expected in draws]
    shared = set(traits[0]).intersection(*traits[1:])
    return {words: [trait[words] for trait in traits] for words in traits[0] if words in shared} | _kinds(draws)


def side_words(results):
    """Whether numbers are too small, or too large, on every draw, in words; None where it is not so, or not known.

    Parameters
    ----------
    results : list of (object, object)
        What the student's function gave and the expected result, of every draw.
    """
    if len(results) < 4 or any(not isinstance(v, float | np.ndarray) or np.ndim(v) for pair in results for v in pair):
        return None
    off = np.array([result - expected for result, expected in results], dtype=float)
    side = "small" if (off < 0).all() else "large" if (off > 0).all() else None
    return side and f"too {side} on every draw of this check"


def result_words(results):
    """What words, truth values or sets have to do with the right ones on all draws; None where nothing is found.

    Parameters
    ----------
    results : list of (object, object)
        What the student's function gave and the expected result, of every draw.
    """
    if not all(type(value) in (str, bool, int, set, frozenset) for pair in results for value in pair):
        return None
    wrong = [(result, expected) for result, expected in results if result != expected]
    if not wrong:
        return None
    if all(isinstance(value, set | frozenset) for pair in wrong for value in pair):
        if not any(result for result, _ in wrong):
            return "it returns an empty set where something belongs into it"
        if all(result < expected for result, expected in wrong):
            more = sum(len(expected) > 1 for _, expected in results) > 2
            one = ", and never more than one entry" if more and all(len(result) < 2 for result, _ in results) else ""
            return f"what it returns is right, but not all of it is there{one}"
        if all(result > expected for result, expected in wrong):
            return "all that is right is there, but more is returned than that"
        return None
    pairs = list(dict.fromkeys(wrong))
    if (
        len(wrong) == len(results)
        or len(pairs) > CONFUSED
        or not all(isinstance(value, str) for pair in pairs for value in pair)
    ):
        return None
    told = [f"{result!r} where {expected!r} is right" for result, expected in pairs]
    return f"it returns {' and '.join([', '.join(told[:-1]), told[-1]] if told[:-1] else told)}"


def _kinds(draws):
    """{words: on which draws they are true} of what an argument or the right result is, where it is a word, a truth
    value or a function.
    """
    found = []
    for given, expected in draws:
        functions = {f"`{name}` is {value.__name__}" for name, value in given.items() if inspect.isfunction(value)}
        found.append(functions | ({f"`{expected!r}` is right"} if isinstance(expected, str | bool | int) else set()))
    return {words: [words in kinds for kinds in found] for words in dict.fromkeys(w for k in found for w in sorted(k))}


def _traits(given, expected):
    """{words: whether they are true} of one draw."""
    found = {}
    for name, value in given.items():
        found |= _of_value(f"`{name}`", value)
    for (one, texts), (other, text) in itertools.permutations(given.items(), 2):
        if isinstance(texts, list) and isinstance(text, str):
            found[f"`{one}` holds what `{other}` is"] = text in texts
    if isinstance(expected, set | frozenset):
        found["the right result is empty"] = not expected
    elif isinstance(expected, float | np.floating):
        found["the right result is negative"] = bool(expected < 0)
        found["the right result is 0"] = bool(expected == 0)
    return found


def _of_value(here, value):
    if isinstance(value, bool | np.bool_):
        return {f"{here} is True": bool(value), f"{here} is False": not value}
    if isinstance(value, str):
        return _of_text(here, value)
    if isinstance(value, list | tuple) and value and all(isinstance(v, str) for v in value):
        return {
            f"{here} holds a comma": any("," in v for v in value),
            f"{here} has one entry": len(value) == 1,
            f"{here} holds the same text twice": len(set(value)) < len(value),
        } | {f"{here} does not have {n} entries": len(value) != n for n in range(2, 7)}
    several = _of_arrays(here, value) if isinstance(value, list | tuple) else {}
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        return several
    return several | _of_array(here, array)


def _of_arrays(here, arrays):
    """The same of several matrices, which need not be of one size."""
    if not arrays or not all(isinstance(a, np.ndarray) and a.ndim == 2 for a in arrays):
        return {}
    most = max(a.shape[1] for a in arrays)
    found = {f"a matrix in {here} has more than {n} columns": most > n for n in COLUMNS}
    return found | _of_count(here, ("entry", "entries"), len(arrays))


def _of_text(here, text):
    number, exponent, power = text.lower().replace(",", ".").partition("e")
    return {
        f"{here} has a comma": "," in text,
        f"{here} has no decimals": "." not in number,
        f"{here} has decimals": "." in number,
        f"{here} has an exponent": bool(exponent),
        f"{here} has a negative exponent": power.startswith("-"),
        f"{here} has an exponent that is not negative": bool(exponent) and not power.startswith("-"),
        f"{here} has an exponent of several digits": len(power.lstrip("+-")) > 1,
        f"the digits of {here} begin with a zero": number.lstrip("+-").startswith("0"),
        f"the decimals of {here} end with a zero": number.endswith("0") and "." in number,
        f"{here} has a zero right behind the point": number.partition(".")[2].startswith("0"),
        f"the digits of {here} end with a zero, an exponent aside": number.endswith("0"),
        f"{here} has several digits": sum(c.isdigit() for c in number) > 1,
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
        found |= _of_points(here, array) | _of_eigenvalues(here, array)
    return found


def _of_eigenvalues(here, matrix):
    """Whether a symmetric matrix bends down somewhere."""
    if matrix.shape[0] != matrix.shape[1] or not np.isfinite(matrix).all() or not np.allclose(matrix, matrix.T):
        return {}
    return {f"{here} has a negative eigenvalue": bool(np.linalg.eigvalsh(matrix)[0] < 0)}


def _of_points(here, points):
    """Whether points of a plane or of space, more than it takes to fill it, lie on one line or in one plane."""
    if points.shape[1] not in (2, 3) or len(points) <= points.shape[1] or not np.isfinite(points).all():
        return {}
    sizes = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    line, plane = sizes[1] < 1e-9 * sizes[0], sizes[-1] < 1e-9 * sizes[0]
    return {f"the rows of {here} lie on one line": bool(line)} | (
        {f"the rows of {here} lie in one plane": bool(plane)} if points.shape[1] == 3 else {}
    )


def _of_count(here, words, count):
    one, several = words
    found = {}
    for n in (1, 2, 3):
        found[f"{here} has {n} {one if n == 1 else several}"] = count == n
        found[f"{here} has more than {n} {one if n == 1 else several}"] = count > n
    found |= {f"{here} does not have {n} {one if n == 1 else several}": count != n for n in (1, 2, 3)}
    return found


def _of_number(here, value):
    found = {
        f"{here} is negative": value < 0,
        f"{here} is positive": value > 0,
        f"{here} is 0": value == 0,
        f"{here} is not 0": value != 0,
        f"{here} is above 1": value > 1,
        f"{here} is 1": value == 1,
        f"{here} is not 1": value != 1,
    }
    if not LENGTH.search(here):
        found[f"{here} is above pi"] = value > np.pi
        found[f"{here} is beyond pi, in either direction"] = abs(value) > np.pi
    return found
