"""The general layer: what a wrong result that no named mistake explains has to do with the right one.

A relation counts only when it holds on *all* draws. What is said is true of the result, whatever code it came from;
what the cause may be is said with a question mark.
"""

import itertools

import numpy as np

from ..geometry import frames
from .metrics import Angles, Exactly, Numbers, Poses, Rotations, Several, Through, is_single
from .wording import joined

CLOSE = 1e4  # tolerances: an answer nearer than this is nearly right, but not accurate enough ...
FAR = 1e-2  # ... unless it is off by more than this: a coarse tolerance leaves no room for less accurate answers
SINGLE = 2e-6  # how far numbers of single precision may be off after some computing
SHEARED = 1e-3  # from which on RᵀR differs from I by more than rounding
SIMPLE = 12  # the largest number in a fraction that is worth telling
NEARLY = 1e-3  # how nearly a result made by differences, say, must be a multiple of the right one
EXACT = 1e-9  # how nearly two numbers have to agree for it
SEVERAL = 3  # numbers, from which on it is no chance that they are in proportion
LOOP = ": does a loop end too early?"  # asked where the code has one
LONGEST = 12  # entries along the last axis that are tried one by one
FACTORS = {"pi": np.pi, "2 pi": 2 * np.pi, "the root of 2": np.sqrt(2.0), "the root of 3": np.sqrt(3.0)}


def difference_words(metric, pairs, sizes=(), whole=False):
    """What the general layer says of a wrong result, from relations that hold on all draws; None when it knows none.

    `pairs` are (admitted result, expected) of every draw; `sizes` the lengths of what was given, which a forgotten or
    needless division by their number would show. `whole` leaves out what is true of a part of the result only.
    """
    for k, (name, part, _, _) in enumerate(metric.parts(*pairs[0])):
        piece = [metric.parts(*pair)[k] for pair in pairs]
        results, expected = [p[2] for p in piece], [p[3] for p in piece]
        if all(part.equal(r, e) for r, e in zip(results, expected)):
            continue
        words = _relation(part, results, expected, sizes, whole)
        if words:
            return f"{name}: {words}" if name else words
        return None
    return None


def of_a_part(words):
    """What is said of a result, said of a value on the way or of one of several results."""
    for said, told in (("your result", "it"), ("your matrix", "it"), ("the expected", "the right")):
        words = words.replace(said, told)
    return words


def _relation(metric, results, expected, sizes, whole):
    if isinstance(metric, Exactly | Several):
        return None
    if isinstance(metric, Through):
        if any(d.words and not d.within for pair in zip(results, expected) for d in metric.deviations(*pair)):
            return None
        metric = Numbers(1e-9)
    digits = _digits_lost(results, expected)
    if digits:
        return digits
    results = [np.asarray(r, dtype=float) for r in results]
    expected = [np.asarray(e, dtype=float) for e in expected]

    def holds(change):
        try:
            return all(metric.equal(change(r), e) for r, e in zip(results, expected))
        except (ValueError, IndexError, np.linalg.LinAlgError):
            return False

    if isinstance(metric, Poses):
        return _pose_as_a_whole(holds) or (None if whole else _pose_in_parts(metric, results, expected))
    if isinstance(metric, Rotations):
        return _rotation_relation(results, holds, whole)
    unit = getattr(metric, "unit", "")
    words = (
        _sign_or_unit(holds, "rad" if isinstance(metric, Angles) else unit)
        or _without_sign(metric, results, expected)
        or _arrangement(results, expected, holds)
        or _power(results, holds)
        or _factor(results, expected, sizes)
    )
    if words or whole:
        return words
    near = _is_near(metric, results, expected) or _all_equal(results, expected)
    part = None if near else _of_other_places(results, expected) or _nearly_a_factor(results, expected)
    part = part or (None if near else _a_factor_of_each_draw(results, expected))
    part = part or (None if near else _one_part(results, expected, holds, unit))
    return part or _offset(results, expected, unit)


def _digits_lost(results, expected):
    """That digits alone are missing: numbers of single precision, rounded ones, or whole ones."""
    if _are_single(results, expected):
        return "your result is right as far as single precision goes, some seven digits: leave float32 away"
    results, expected = ([np.asarray(v, dtype=float) for v in values] for values in (results, expected))
    if _are_rounded(results, expected):
        return "your result is the right one, rounded: hand over all digits"
    if _are_cut_off(results, expected):
        return "your result is the right one without its decimals: is it put into an array of whole numbers?"
    return None


def _is_near(metric, results, expected):
    """Whether all that is off is so little off that accuracy is the question, and not which part is wrong."""
    off = [d for pair in zip(results, expected) for d in metric.deviations(*pair) if not d.within]
    return all(map(not_accurate_enough, off))


# Poses and rotations -------------------------------------------------------------------------------------------------


def _moved(T, R=None, t=None):
    T = T.copy()
    if R is not None:
        T[..., :3, :3] = R
    if t is not None:
        T[..., :3, 3] = t
    return T


def _pose_as_a_whole(holds):
    if holds(frames.invert):
        return "your result is the inverse of the expected pose: it maps in the other direction"
    if holds(lambda T: _moved(T, R=np.swapaxes(T[..., :3, :3], -1, -2))):
        return "the origin is right, the rotation is transposed"
    for factor, words in ((1e3, "a thousandth"), (1e-3, "a thousand times")):
        if holds(lambda T, factor=factor: _moved(T, t=factor * T[..., :3, 3])):
            return f"the rotation is right, the translation is {words} of what it should be: mm against m?"
    if holds(lambda T: _moved(T, t=-T[..., :3, 3])):
        return "the rotation is right, the translation has the opposite sign"
    return None


def _pose_in_parts(metric, results, expected):
    turned = _rotation_kind([r[..., :3, :3] for r in results], "rotation block")
    if turned:
        return turned
    *turn, origin = (max(d, key=lambda d: d.amount) for d in zip(*map(metric.deviations, results, expected)))
    if all(map(not_accurate_enough, (*turn, origin))):
        return None
    if all(d.within for d in turn):
        return f"the rotation is right, the translation is not: it is off by {origin.amount:.3g} {origin.unit}"
    if origin.within:
        return f"the translation is right, the rotation is not: it is off by {turn[0].amount:.3g} {turn[0].unit}"
    return None


def both_parts_words(metric, pairs):
    """That rotation and translation of a pose are both off, and by how much at most; None where one is right."""
    if not isinstance(metric, Poses):
        return None
    *turn, origin = (max(d, key=lambda d: d.amount) for d in zip(*(metric.deviations(*pair) for pair in pairs)))
    if origin.within or turn[0].within or turn[0].unit != "deg":
        return None
    by = f"{turn[0].amount:.3g} deg and {origin.amount:.3g} {origin.unit}"
    return f"rotation and translation are both off, by up to {by}"


def _rotation_kind(matrices, what):
    """What keeps matrices from being rotations, if anything does."""
    off = [np.abs(np.swapaxes(r, -1, -2) @ r - np.eye(3)).reshape(-1, 3, 3).max(axis=0, initial=0.0) for r in matrices]
    sheared = [o.max() > SHEARED for o in off]
    if any(sheared):
        return f"your {what} is not orthonormal{_on_some(sheared)}: {_sheared_words(np.max(off, axis=0))}"
    mirrored = [(np.linalg.det(r) < 0).any() for r in matrices]
    if any(mirrored):
        at_times = "an axis may come out either way, and so may U @ Vt of an SVD: look at the determinant"
        cause = "does an axis point the wrong way, have two changed places?" if all(mirrored) else at_times
        return f"your {what} is a reflection{_on_some(mirrored)}, its determinant is -1: {cause}"
    return None


def _on_some(true):
    return "" if all(true) else " on some draws"


def _sheared_words(off):
    """What is not as in a rotation, of how far the products of its columns are from those of a rotation."""
    lengths = [name for name, amount in zip("xyz", np.diag(off)) if amount > SHEARED]
    askew = [f"{'xyz'[i]} and {'xyz'[j]}" for i, j in ((0, 1), (0, 2), (1, 2)) if off[i, j] > SHEARED]
    if not askew:
        return f"the length of its column{'s' * (len(lengths) > 1)} {joined(lengths)} is not 1"
    if not lengths and len(askew) < 3:
        return f"its columns {', and '.join(askew)} are not perpendicular"
    return f"RᵀR differs from I by {off.max():.2g}"


def _rotation_relation(results, holds, whole):
    if holds(lambda R: np.swapaxes(R, -1, -2)):
        return "your matrix is the transpose of the expected rotation: rows and columns, or the direction of the map"
    if whole:
        return None
    kind = _rotation_kind(results, "matrix")
    if kind:
        return kind
    near = all((np.trace(r, axis1=-2, axis2=-1) > 1).all() for r in results)  # 90 degrees, and no other half of a turn
    if near and holds(lambda R: R @ R):
        return "you turn by half the angle"
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1, -1), repeat=3):
            if holds(lambda R, o=list(order), s=signs: R[..., o] * s):
                return f"your axes are the right lines under other names: {_axes(order, signs)}"
    return None


def turned_axes(metric, pairs):
    """Which axes point the other way in results that are right but for that, in words; None where it is not so."""
    if not isinstance(metric, Poses | Rotations):
        return None
    for signs in itertools.product((1, -1), repeat=3):
        if all(metric.equal(_with_axes(metric, result, signs), expected) for result, expected in pairs):
            names = [axis for axis, sign in zip("xyz", signs) if sign < 0]
            return f"your {joined(names)} {'point' if names[1:] else 'points'} the other way"
    return None


def _with_axes(metric, result, signs):
    """A rotation, or a pose, with its axes turned around where a sign is negative."""
    return _moved(result, R=result[..., :3, :3] * signs) if isinstance(metric, Poses) else result * signs


def _axes(order, signs):
    named = [f"{'-' if s < 0 else ''}{'xyz'[o]}" for o, s in zip(order, signs)]
    return ", ".join(f"{axis} should be your {name}" for axis, name in zip("xyz", named) if axis != name)


# Numbers -------------------------------------------------------------------------------------------------------------


def _sign_or_unit(holds, unit):
    if holds(np.negative):
        return "your result is right up to its sign"
    if holds(np.deg2rad):
        return _turned_unit("180/pi", unit.partition("/")[0], "deg", "rad")
    if holds(np.rad2deg):
        return _turned_unit("pi/180", unit.partition("/")[0], "rad", "deg")
    for factor, words in ((1e3, "a thousandth of"), (1e-3, "a thousand times"), (0.5, "twice"), (2.0, "half")):
        if holds(lambda r, factor=factor: factor * r):
            return f"your result is {words} the expected one{_thousand(unit) if factor in (1e3, 1e-3) else ''}"
    return None


def _turned_unit(factor, unit, into, other):
    """What is said of a result that is as if converted `into` one unit of angles, where it is expected in `unit`."""
    words = {"deg": "degrees", "rad": "radians"}
    if unit == other:
        return f"your result is in {words[into]} where {words[other]} are expected"
    if unit == into:
        return f"your result is as if converted to {words[into]} once too often"
    if unit:
        return (
            f"your result is {factor} times the expected one: is an angle in it in the wrong unit, or converted twice?"
        )
    return f"your result is {factor} times the expected one, as if it were converted to {words[into]}"


def _without_sign(metric, results, expected):
    """Right but for signs, and never negative."""
    if all((r >= 0).all() and metric.equal(r, np.abs(e)) for r, e in zip(results, expected)):
        ways = "an absolute value, a square, a root or an arccosine on the way?"
        return f"your result is right but for its sign, which is lost: {ways}"
    return None


def _thousand(unit):
    """Which two units a factor of a thousand may have confused."""
    units = {"s": "ms against s"} | dict.fromkeys(("rad", "mrad"), "mrad against rad")
    units |= dict.fromkeys(("mm", "m"), "mm against m") | {"": "are two units mixed up"}
    return f": {units[unit]}?" if unit in units else ""


def _arrangement(results, expected, holds):
    """Right entries in another order."""
    first = results[0]
    unit = all(r.shape == (4,) and abs(np.linalg.norm(e) - 1) < EXACT for r, e in zip(results, expected))
    if unit and holds(lambda r: np.roll(r, -1)):
        return "the scalar part comes first in your quaternion; here it comes last (x, y, z, w)"
    if all(r.ndim == 2 and r.shape[0] == r.shape[1] > 1 for r in results):
        if holds(np.transpose):
            return "your matrix is the transpose of the expected one"
        if holds(np.linalg.inv):
            return "your matrix is the inverse of the expected one"
    oblong = all(r.ndim == 2 and 1 < r.shape[0] != r.shape[1] > 1 for r in results)
    if oblong and holds(lambda r: r.reshape(r.shape[::-1]).T):
        if all(map(_are_rows_of, results, expected)):  # of such symmetry that a reshape would not tell
            return "the rows are right, in another order"
        return "the numbers are right, in the order of columns written as rows: is a `reshape` taken for `.T`?"
    if not first.ndim or first.shape[-1] < 2 or any(r.shape[-1:] != first.shape[-1:] for r in results):
        return None
    if first.ndim == 1 and first.size > 2 and holds(lambda r: r[::-1]):
        return "the entries are right, in reverse order"
    if first.shape[-1] <= LONGEST:
        for i, j in itertools.combinations(range(first.shape[-1]), 2):
            if holds(lambda r, i=i, j=j: _exchanged(r, i, j)):
                others = "; all others are right" if first.shape[-1] > 2 else ""
                return f"the entries {i} and {j} (counted from 0) are exchanged{_along(first)}{others}"
    for shift in (1, -1):
        if len(first) > 2 and holds(lambda r, shift=shift: np.roll(r, shift, axis=0)):
            told = ("early, the first one last", "late, the last one first")[shift < 0]
            return f"the entries are right, but stand one place too {told}"
    return None


def _are_rows_of(result, expected):
    """Whether an array has the rows of another one, in whichever order."""
    order = np.abs(result[:, None] - expected).sum(axis=2).argmin(axis=1)
    return len(set(order)) == len(order) and np.allclose(result, expected[order])


def _along(array):
    return " in each row" if array.ndim > 1 else ""


def _exchanged(r, i, j):
    r = r.copy()
    r[..., [i, j]] = r[..., [j, i]]
    return r


def _power(results, holds):
    if all((r >= 0).all() for r in results):
        if holds(np.sqrt):
            return "your result is the square of the expected one: is a root missing?"
        if holds(np.square):
            return "your result is the square root of the expected one"
    if all((r != 0).all() for r in results) and holds(np.reciprocal):
        return "your result is the reciprocal of the expected one"
    return None


def _factor(results, expected, sizes):
    ratios = [constant_ratio(r, e, 1e-9) for r, e in zip(results, expected)]
    if None in ratios or len(ratios) < 2 or np.ptp(ratios) > 1e-9 * abs(ratios[0]):
        return None
    ratio = ratios[0]
    for name, factor in FACTORS.items():
        for sign, word in ((1, ""), (-1, "minus ")):
            if abs(ratio * sign / factor - 1) < 1e-9:
                return f"your result is {word}{name} times the expected one, on every draw"
            if abs(ratio * sign * factor - 1) < 1e-9:
                return f"{name} times your result is {word or ''}the expected one, on every draw"
    return _times(ratio, sizes)


def _nearly_a_factor(results, expected):
    """A whole number of times the expected result, or such a part of it, but for what differences leave, say."""
    found = set()
    for r, e in zip(results, expected):
        size = np.abs(r).max(initial=0.0)
        if r.shape != e.shape or not np.isfinite(r).all() or size < EXACT:
            return None
        ratio = float((r * e).sum() / max((e * e).sum(), EXACT**2))
        factor = round(ratio) if abs(ratio) > 1 else 1 / round(1 / ratio) if ratio else 0
        if not 1 / SIMPLE <= abs(factor) <= SIMPLE or np.abs(r - factor * e).max() > NEARLY * size:
            return None
        found.add(factor)
    if len(results) < 2 or len(found) != 1 or found & {1, -1}:
        return None
    factor = found.pop()
    times = f"{factor}" if abs(factor) > 1 else f"{'-' if factor < 0 else ''}1/{round(1 / abs(factor))}"
    return f"your result is nearly {times} times the expected one, within a thousandth of its size, on every draw"


def _a_factor_of_each_draw(results, expected):
    """Several numbers that are right in proportion, on every draw."""
    if len(results) < 2 or any(np.count_nonzero(e) < SEVERAL for e in expected):
        return None
    ratios = [constant_ratio(r, e, EXACT) for r, e in zip(results, expected)]
    if None in ratios:
        return None
    if np.allclose(np.abs(ratios), 1, rtol=EXACT, atol=0):
        return "your result is the expected one, but its sign is turned on some draws" if max(ratios) > 0 else None
    return (
        "your result is the expected one times a number that is not the same on every draw: look at what it is "
        "multiplied or divided by"
    )


def _times(ratio, sizes):
    n, share = round(ratio), round(1 / ratio)
    if n in sizes and abs(ratio - n) < 1e-6:
        return f"your result is {n} times the expected one, on every draw: a sum where a mean is meant?"
    if share in sizes and abs(1 / ratio - share) < 1e-6:
        return f"your result is 1/{share} of the expected one, on every draw: a mean where a sum is meant?"
    if share > 1 and abs(1 / ratio - share) < 1e-6:
        return f"your result is 1/{share} of the expected one, on every draw"
    if abs(ratio - 1) < EXACT:  # it differs in the last digits alone
        return None
    digits = 4 if abs(ratio - 1) > NEARLY else 12
    return f"your result is {ratio:.{digits}g} times the expected one, on every draw"


def constant_ratio(result, expected, close):
    """The one number that turns the expected entries into those of the result; None when they need several."""
    use = np.abs(expected) > 1e-12
    if result.shape != expected.shape or not use.any() or (np.abs(result[~use]) > 1e-9).any():
        return None
    ratio = result[use] / expected[use]
    return float(ratio.flat[0]) if ratio.flat[0] and np.ptp(ratio) <= close * abs(ratio.flat[0]) else None


def _one_part(results, expected, holds, unit):
    """One entry along the last axis, or all rows after the first ones, are wrong; the rest is right."""
    first = results[0]
    if not first.ndim or any(r.shape[-1:] != first.shape[-1:] for r in results):
        return None
    if 1 < first.shape[-1] <= LONGEST:
        for k in range(first.shape[-1]):
            if holds(lambda r, k=k: _with_entry(r, k, -r[..., k])):
                return f"entry {k} (counted from 0) has the opposite sign{_along(first)}; all others are right"
        for k in range(first.shape[-1]):
            bare = [_with_entry(e, k, np.abs(e[..., k])) for e in expected]
            if all((r[..., k] >= 0).all() for r in results) and _all_equal(results, bare):
                lost = f"entry {k} (counted from 0) has lost its sign{_along(first)}: yours is never negative"
                return f"{lost}; all others are right"
        for k in range(first.shape[-1]):
            patched = [_with_entry(r, k, e[..., k]) for r, e in zip(results, expected)]
            if _all_equal(patched, expected):
                off = max(np.abs(r[..., k] - e[..., k]).max() for r, e in zip(results, expected))
                where = _wrong_places(results, expected, k)
                return f"{where} is not right: it is off by {off:.3g}{' ' + unit if unit else ''}"
    if len(first) > 2:
        for rows in range(len(first) - 1, 0, -1):
            if _all_equal([r[:rows] for r in results], [e[:rows] for e in expected]):
                one, several = ("entry", "") if first.ndim == 1 else ("row", " rows")
                right = (
                    f"the first {one} is right, not all behind it"
                    if rows == 1
                    else f"the first {rows}{several} are right, not all behind them"
                )
                return f"{right} are{LOOP}"
    return None


def _of_other_places(results, expected):
    """Rows, or entries of a vector, that hold what belongs into others; all others are right."""
    count = len(expected[0]) if expected[0].ndim else 0
    if not 1 < count <= LONGEST or any(len(a) != count for a in (*results, *expected)):
        return None

    def is_right(i, j):
        return all(r[i].shape == e[j].shape and np.allclose(r[i], e[j], rtol=1e-9, atol=1e-12) for r, e in pairs)

    pairs = list(zip(results, expected))
    varied = [j for j in range(count) if not _all_equal([expected[0][j]] * len(pairs), [e[j] for e in expected])]
    wrong = [i for i in range(count) if not is_right(i, i)]
    found = [next((j for j in varied if is_right(i, j)), None) for i in wrong]
    if None in found:
        return None
    kind = "entry" if expected[0].ndim == 1 else "row"
    told = ", ".join(f"{kind} {i} what belongs into {kind} {j}" for i, j in zip(wrong, found))
    return f"{told.replace(' what', ' holds what', 1)} (counted from 0); all others are right"


def _wrong_places(results, expected, k):
    """Where results are wrong that differ from the expected ones in entry k along the last axis alone."""
    wrong = [~np.isclose(r[..., k], e[..., k], rtol=1e-9, atol=1e-12) for r, e in zip(results, expected)]
    if not wrong[0].ndim:
        return f"only entry {k} (counted from 0)"
    if all(w.all() for w in wrong):
        return f"only entry {k} (counted from 0) in each row"
    rows = {tuple(map(int, row)) for w in wrong for row in np.argwhere(w)}
    if len(rows) == 1 and len({w.shape for w in wrong}) == 1:
        return f"only entry {[*rows.pop(), k]} (counted from 0)"
    return f"only entry {k} (counted from 0) in some rows"


def _with_entry(r, k, value):
    r = r.copy()
    r[..., k] = value
    return r


def _all_equal(results, expected):
    return all(np.allclose(r, e, rtol=1e-9, atol=1e-12) for r, e in zip(results, expected))


def _offset(results, expected, unit):
    """The same number added to every entry, on all draws."""
    gaps = np.concatenate([np.ravel(r - e) for r, e in zip(results, expected)])
    if len(results) > 1 and abs(gaps[0]) > 1e-9 and np.ptp(gaps) < 1e-9 * max(1.0, abs(gaps[0])):
        amount = f"{abs(gaps[0]):.4g}{' ' + unit if unit else ''}"
        return f"your result is too {'large' if gaps[0] > 0 else 'small'} by {amount}, on every draw"
    return None


def ratio_words(answer, expected):
    """What a wrong number has to do with the right one: a simple fraction of it, the root of one, what is left to 1; of
    an array, the one fraction that all its numbers are.
    """
    if np.ndim(expected):
        ratio = _common_ratio(np.asarray(answer, dtype=float), np.asarray(expected, dtype=float))
        fraction = _fraction(ratio) or _power_of_ten(ratio)
        return fraction and f"each of your numbers is {fraction} times the expected one"
    if not (np.isfinite(answer) and expected and answer):
        return None
    if fraction := _fraction(float(answer) / float(expected)):
        return f"your value is {fraction} times the expected one"
    for whole, words in ((1.0, "1"), (np.pi, "pi"), (2 * np.pi, "2 pi"), (180.0, "180"), (360.0, "360")):
        if abs(answer + expected - whole) < EXACT * whole:
            return f"your value and the expected one make {words} together: it is what is left of {words}"
        if abs(abs(answer - expected) - whole) < EXACT * whole:
            return f"your value is too {'large' if answer > expected else 'small'} by {words}"
    return None


def are_fractions(answer, expected):
    """Whether two numbers are quotients of small whole numbers: many a change makes one of the other, by chance."""
    return not np.ndim(expected) and all(_is_fraction(float(number)) for number in (answer, expected))


def _is_fraction(number):
    return any(abs(m * number - round(m * number)) < EXACT for m in range(1, SIMPLE + 1)) and abs(number) < SIMPLE


def _fraction(ratio):
    """A simple fraction, or the root of one, that a ratio is, in words; None where it is none."""
    for power, form in ((1, "{}"), (2, "the root of {}")):
        for n, m in itertools.product(range(1, SIMPLE + 1), repeat=2):
            if np.gcd(n, m) == 1 and n != m and abs(abs(ratio) ** power * m / n - 1) < EXACT:
                return ("minus " if ratio < 0 else "") + form.format(f"{n}/{m}" if m > 1 else n)
    return None


def _power_of_ten(ratio):
    """A power of ten that a ratio is, or is but for its sign; None where it is none."""
    power = 10.0 ** np.round(np.log10(abs(ratio))) if np.isfinite(ratio) and ratio else 1.0
    return f"{np.copysign(power, ratio):g}" if power != 1.0 and abs(abs(ratio) / power - 1) < EXACT else None


def _common_ratio(answer, expected):
    """The ratio that all numbers of two arrays have; NaN where they have none, or where there is but one."""
    some = expected != 0
    if answer.shape != expected.shape or some.sum() < 2 or answer[~some].any():
        return np.nan
    ratio = answer[some] / expected[some]
    return ratio[0] if np.allclose(ratio, ratio[0], rtol=EXACT, atol=0.0) else np.nan


# Digits --------------------------------------------------------------------------------------------------------------


def _are_single(results, expected):
    """Whether results are of single precision, and right as far as that goes."""
    pairs = [(np.asarray(r), np.asarray(e, dtype=float)) for r, e in zip(results, expected)]
    near = all(np.abs(r - e).max(initial=0.0) <= SINGLE * max(1.0, np.abs(e).max(initial=0.0)) for r, e in pairs)
    return near and any(is_single(r) for r, _ in pairs)


def _are_rounded(results, expected):
    """Whether these are the expected results with some digits, one of which shows at least: 1 for 0.9996 shows none."""
    shown = any(float(f"{x:.0e}") != x for result in results for x in np.ravel(result))
    return shown and all(significant_digits(r, e) > 1 for r, e in zip(results, expected))


def _are_cut_off(results, expected):
    """Whether these are the expected numbers with their decimals cut off, which only an array shows well enough."""
    cut = [r.shape == e.shape and np.array_equal(r, np.trunc(e)) for r, e in zip(results, expected)]
    kept = [int((np.abs(r) > 1).sum()) for r in results]
    lost = [int((np.round(e) != e).sum()) for e in expected]
    return all(cut) and min(kept) > 1 and min(lost) > 2


def significant_digits(answer, expected):
    """To how many significant digits an answer is the expected number (or array) rounded; 0 where it is not at all.

    2.0 is 1.996 to three digits: what looks like fewer may be the zeros that a number does not show.
    """
    try:
        answer, expected = np.asarray(answer, dtype=float), np.asarray(expected, dtype=float)
    except (TypeError, ValueError):
        return 0
    size = np.abs(expected).max(initial=0.0)
    if answer.shape != expected.shape or not 0 < size < np.inf:
        return 0
    leading, found = int(np.floor(np.log10(size))), 0
    for digits in range(1, 13):
        unit = 10.0 ** (leading + 1 - digits)
        on_grid = np.allclose(answer / unit, np.round(answer / unit), rtol=1e-12, atol=1e-6)
        if on_grid and np.abs(answer - expected).max() <= 0.5000001 * unit:
            found = digits
    return found


def not_accurate_enough(deviation):
    """What to say of an answer that is nearly right; None for one that is farther off."""
    if deviation.words or deviation.amount > min(CLOSE * deviation.tolerance, FAR):
        return None
    return (
        f"{deviation}: nearly right, but not accurate enough. Too few iterations, too long or too short a step of "
        "differences, an approximation or a rounded number on the way?"
    )
