"""How a student's result is compared with the reference: in degrees and millimeters, never without a unit.

A metric first *admits* a result (converts what is harmless, refuses the rest with one sentence), then measures its
deviations from the expected value, each with a unit and a tolerance.
"""

import inspect
from dataclasses import dataclass, replace
from decimal import Decimal

import numpy as np

from ..geometry import frames

MAX_ENTRIES = 10_000_000
INTEGERS = (int, np.integer)
ORTHONORMAL = 1e-5  # how far R'R may be from I, also where the angle may be off by much more


class Refused(Exception):
    """The result cannot be compared at all; the message says what was expected and what came."""


class RefusedBeside(Refused):
    """The first of several results is right, one behind it is not: `lead` says so, `pair` is (that one, expected), and
    `known` what is said of just this one, if something is.
    """

    def __init__(self, name, metric, pair, known, deviation):
        self.lead, self.metric, self.pair = f"the first result is right, the {name} is not", metric, pair
        self.known = known
        super().__init__(f"{self.lead}: {deviation}")


@dataclass(frozen=True)
class Deviation:
    """How far one aspect of a result is off; with `several`, the entry is the worst of those that are, else the one at
    `place`.
    """

    what: str
    amount: float
    unit: str
    tolerance: float
    words: str = ""
    several: bool = False
    place: tuple = ()

    @property
    def within(self):
        return bool(self.amount <= self.tolerance)

    def __str__(self):
        if self.words:
            return f"{self.what}: {self.words}" if self.what else self.words
        alone = f"entry {list(self.place)} (counted from 0)" if self.place else "one entry"
        entry = self.what.replace("one entry", "the worst entry" if self.several else alone)
        what = f"{entry} is off" if entry else "it is off"
        return f"{what} by {self.amount:.3g}{' ' + self.unit if self.unit else ''}"


class Metric:
    """Base: `admit(result, expected)` then `deviations(result, expected)`."""

    def admit(self, result, expected):
        raise NotImplementedError

    def deviations(self, result, expected):
        raise NotImplementedError

    def parts(self, result, expected):
        """(name, metric, result, expected) of the pieces that the general layer may diagnose one by one."""
        return [("", self, result, expected)]

    def nearest(self, expected, result):
        """What is expected, of all that it may be written as what is nearest to an admitted result."""
        return expected

    def equal(self, result, expected):
        try:
            return all(d.within for d in self.deviations(self.admit(result, expected), expected))
        except Refused:
            return False


def as_array(result, shape):
    """The result as a float array of this shape; refuses everything that is no harmless way of writing one.

    Parameters
    ----------
    result : anything
        What a student's code returned.
    shape : tuple of int
        The shape that is expected; () is a number.

    Returns
    -------
    array : array of that shape, of integers or floats

    Raises
    ------
    Refused
        With what was expected and what came.
    """
    wanted = f"expected {'a number' if shape == () else f'an array of shape {shape}'}"
    result = _value(result)
    array = _real(_converted(result, wanted), result, wanted)
    _refuse_shape(array, shape, wanted)
    _refuse_infinite(array)
    return array


def _value(result):
    """The result itself; that of SciPy's rotations and sparse matrices as an array."""
    if result is None:
        raise Refused("it returned None: is a `return` missing?")
    if result is ...:
        raise Refused("it returned `...`: the placeholder is still there")
    if inspect.iscoroutine(result):
        result.close()  # nobody waits for it
        raise Refused("it returned a coroutine: leave out `async` before `def`")
    if inspect.isgenerator(result):
        if result.gi_code.co_name == "<genexpr>":
            raise Refused("it returned a generator, whose numbers are still to be computed: make an array of it")
        raise Refused("it returned a generator: use `return`, not `yield`")
    if type(result) is tuple and len(result) == 4 and _are_of_lstsq(*result):
        raise Refused(
            "`lstsq` returns four things in a tuple: x, sum of squares, rank, singular values. Take the first, [0]"
        )
    if hasattr(result, "x") and hasattr(result, "success"):
        raise Refused("the optimizer returns a whole report; its solution is the attribute `.x`")
    for method in ("as_matrix", "toarray"):
        if hasattr(result, method) and not isinstance(result, type):
            result = getattr(result, method)()
    if callable(result):
        name = getattr(result, "__name__", "something callable")
        raise Refused(f"it returned {name}, a function: are the parentheses missing?")
    return result


def _are_of_lstsq(x, squares, rank, singular):
    """Whether four results are those of `lstsq`: there are no more singular values than unknowns."""
    return np.ndim(x) and isinstance(rank, INTEGERS) and np.ndim(singular) == 1 and rank <= len(singular) <= len(x)


def _converted(result, wanted):
    """The result as an array of whatever kind, unless it is too large to look at or its parts do not fit."""
    dimensions = getattr(result, "shape", ())
    sized = getattr(result, "size", 0) is not None and np.size(dimensions)
    if sized and np.prod(np.asarray(dimensions, dtype=float)) > MAX_ENTRIES:
        raise Refused(f"{wanted}, got one of shape {tuple(dimensions)}")
    try:
        return np.asarray(result)
    except Exception:
        parts = f" of {len(result)} parts that differ in shape" if type(result) in (list, tuple) else ""
        raise Refused(f"{wanted}, got {_describe(result)}{parts}: return one array") from None


def _real(array, result, wanted):
    """The array as integers or floats."""
    if array.dtype.kind == "c":
        if np.abs(array.imag).max(initial=0.0) > 0:
            cause = "a root of a negative number, or is `np.angle` missing?"
            real = (
                f"{wanted} of real numbers, got complex ones"
                if array.ndim
                else "expected a real number, got a complex one"
            )
            raise Refused(f"{real}: {cause}")
        array = array.real
    if array.dtype.kind == "b":
        raise Refused(f"{wanted}, got True or False: is there a comparison where a formula should be?")
    if array.dtype.kind == "O":
        if any(isinstance(entry, Decimal) for entry in array.ravel()):
            raise Refused(f"{wanted}, got a Decimal, which does not mix with floats: float(...) makes one of it")
        try:
            array = array.astype(float)
        except Exception:
            raise Refused(f"{wanted}, got {_describe(result)}") from None
    if array.dtype.kind not in "iuf":
        raise Refused(f"{wanted}, got {_describe(result)}")
    return array


def _refuse_shape(array, shape, wanted):
    if shape == () and array.size == 1 and array.ndim:
        raise Refused(f"{wanted}, got an array of shape {array.shape} that holds one: take it out, with `.item()`")
    if array.shape != shape:
        hint = ""
        if array.ndim == 2 and array.T.shape == shape:
            hint = ": transposed?"
        elif array.size == np.prod(shape):
            hint = ": the right number of entries, arranged differently"
        raise Refused(f"{wanted}, got {'a number' if array.shape == () else f'shape {array.shape}'}{hint}")


NOT_FINITE = (  # where to look, as long as the place is not known
    ": look for a division by zero, the exponential of a large number or the logarithm of 0, a root of a negative"
    " number, an arccos or arcsin of something beyond -1 and 1, or an iteration that runs away"
)


def _refuse_infinite(array):
    if not np.isfinite(array).all():
        bad = int((~np.isfinite(array)).sum())
        which = "NaN" if np.isnan(array).any() else "infinity"
        count = "" if array.ndim == 0 else f" in {bad} of {array.size} entries"
        raise Refused(f"the result holds {which}{count}{NOT_FINITE}")


def _describe(result):
    name = type(result).__name__
    if isinstance(result, np.ndarray) and result.dtype.kind in "USO":
        return "an array of text" if result.dtype.kind != "O" else "an array of objects that are no numbers"
    return f"{'an' if name[0] in 'aeiouAEIOU' or name == 'ndarray' else 'a'} {name}"


def is_single(array):
    """Whether an array holds numbers of single precision, or of half."""
    return array.dtype.itemsize < 8 and array.dtype.kind == "f"


@dataclass(frozen=True)
class Numbers(Metric):
    """A number or an array: largest deviation, relative to the size of the expected entries (at `least` 1).

    `tol` is that relative tolerance; `unit` names the deviation. With `absolute` the tolerance is in this unit, however
    large the entries are; with `least=0` it shrinks with them, however small they are.
    """

    tol: float = 1e-9
    unit: str = ""
    absolute: bool = False
    least: float = 1.0

    def admit(self, result, expected):
        return as_array(result, np.shape(expected))

    def deviations(self, result, expected):
        expected = np.asarray(expected, dtype=float)
        scale = 1.0 if self.absolute else max(self.least, np.abs(expected).max(initial=0.0))
        off, tol = np.abs(result.astype(float) - expected), self.tol * scale
        what, amount = "one entry" if result.ndim else "", float(off.max(initial=0.0))
        place = tuple(map(int, np.unravel_index(off.argmax(), off.shape))) if off.size else ()
        return [Deviation(what, amount, self.unit, tol, several=bool((off > tol).sum() > 1), place=place)]


@dataclass(frozen=True)
class Angles(Metric):
    """Angles in radians, compared around the circle."""

    tol: float = 1e-9

    def admit(self, result, expected):
        return as_array(result, np.shape(expected))

    def deviations(self, result, expected):
        off = np.abs(np.angle(np.exp(1j * (result.astype(float) - expected)))).max(initial=0.0)
        return [Deviation("the angle", float(np.rad2deg(off)), "deg", float(np.rad2deg(self.tol)))]


@dataclass(frozen=True)
class PlanarPoses(Metric):
    """A planar pose (x, y, theta) in m and rad: theta is an angle, and any number of whole turns more is the same pose.

    `tol` is relative to the size of the expected position (at least 1), and absolute for the heading.
    """

    tol: float = 1e-9

    def admit(self, result, expected):
        return as_array(result, np.shape(expected))

    def deviations(self, result, expected):
        expected = np.asarray(expected, dtype=float)
        position = Numbers(self.tol, "m").deviations(result[..., :2], expected[..., :2])[0]
        distance = np.linalg.norm(result[..., :2].astype(float) - expected[..., :2], axis=-1).max(initial=0.0)
        heading = Angles(self.tol).deviations(result[..., 2], expected[..., 2])[0]
        return [
            Deviation("the position", float(distance), "m", position.tolerance),
            Deviation("the heading", heading.amount, "deg", heading.tolerance),
        ]

    def nearest(self, expected, result):
        near = np.array(expected, dtype=float)
        near[..., 2] += 2 * np.pi * np.round((result[..., 2] - near[..., 2]) / (2 * np.pi))
        return near


@dataclass(frozen=True)
class UpToSign(Metric):
    """An array whose overall sign is free: an axis, a null vector, a quaternion."""

    tol: float = 1e-9
    unit: str = ""

    def admit(self, result, expected):
        return as_array(result, np.shape(expected))

    def deviations(self, result, expected):
        plain = Numbers(self.tol, self.unit)
        return min((plain.deviations(s * result, expected) for s in (1, -1)), key=lambda d: d[0].amount)


@dataclass(frozen=True)
class Rotations(Metric):
    """Rotation matrices, shape (..., 3, 3): angle between them, and how far the result is from orthonormal."""

    deg: float = 1e-6

    def admit(self, result, expected):
        return as_array(result, np.shape(expected))

    def deviations(self, result, expected):
        R = result.astype(float)
        skewness = float(np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max(initial=0.0))
        allowed = min(np.deg2rad(self.deg), ORTHONORMAL)
        mirrored = bool((np.linalg.det(R) < 0).any())
        if skewness > 1e-3 or mirrored or not _are_rotations(expected):
            entry = float(np.abs(R - expected).max(initial=0.0))
            reflection = ": it is a reflection, its determinant is -1" if mirrored and skewness <= 1e-3 else ""
            return [Deviation("the rotation", entry, f"in its worst entry{reflection}", allowed)]
        angle = float(np.rad2deg(np.max(frames.rotation_angle(np.swapaxes(R, -1, -2) @ expected), initial=0.0)))
        return [
            Deviation("the rotation", angle, "deg", self.deg),
            Deviation("RᵀR - I", skewness, "", max(allowed, 1e-9)),
        ]


def _are_rotations(matrices):
    """Whether matrices are rotations, so that an angle between them and others means something."""
    gap = np.abs(np.swapaxes(matrices, -1, -2) @ matrices - np.eye(3)).max(initial=0.0)
    return bool(gap < ORTHONORMAL) and bool((np.linalg.det(matrices) > 0).all())


@dataclass(frozen=True)
class Poses(Metric):
    """Rigid transforms, shape (..., 4, 4): angle of the rotations and distance of the origins."""

    deg: float = 1e-6
    mm: float = 1e-6
    unit: str = "mm"

    def admit(self, result, expected):
        result = as_array(result, np.shape(expected))
        if result.shape[-2:] != (4, 4):
            raise Refused(f"a pose has shape (..., 4, 4), not {result.shape}")
        last = result[..., 3, :].reshape(-1, 4)
        right = np.isclose(last, (0, 0, 0, 1), atol=1e-6).all(axis=1)
        if not right.all():
            row = last[np.argmin(right)]
            told = (" ".join(f"{v + 0.0:.{digits}g}" for v in row) for digits in (3, 9))
            raise Refused(f"the last row must be 0 0 0 1, got {next(words for words in told if words != '0 0 0 1')}")
        return result

    def deviations(self, result, expected):
        turn = Rotations(self.deg).deviations(result[..., :3, :3], expected[..., :3, :3])
        distance = np.linalg.norm(result[..., :3, 3].astype(float) - expected[..., :3, 3], axis=-1).max(initial=0.0)
        return [*turn, Deviation("the origin", float(distance), self.unit, self.mm)]


@dataclass(frozen=True)
class Exactly(Metric):
    """Counts, words, truth values, sets: equal or not."""

    def admit(self, result, expected):
        if result is None and isinstance(expected, set | frozenset):
            raise Refused("it returned None, and a set is expected: is a `return` missing? The empty set is set()")
        if result is None and expected is not None:
            raise Refused("it returned None: is a `return` missing?")
        if isinstance(expected, set | frozenset):
            if not isinstance(result, set | frozenset):
                made = ": set(...) makes one of it" if isinstance(result, list | tuple | dict) else ""
                raise Refused(f"expected a set, got {_describe(result)}{made}")
            found = {v.item() if isinstance(v, np.generic) else v for v in result}
            if found and expected and all(isinstance(v, str) for v in found) and all(type(v) is int for v in expected):
                raise Refused("expected a set of whole numbers, got one of texts")
            return found
        if isinstance(expected, np.ndarray):
            try:
                array = np.asarray(result)
            except Exception:
                raise Refused(f"expected an array of shape {expected.shape}, got {_describe(result)}") from None
            if array.shape != expected.shape:
                raise Refused(f"expected an array of shape {expected.shape}, got shape {array.shape}")
            if expected.dtype == bool and array.dtype.kind in "iu" and np.isin(array, (0, 1)).all():
                array = array.astype(bool)
            if expected.dtype == bool and array.dtype != bool:
                raise Refused(f"expected an array of True and False, got {array.dtype}")
            return array
        if isinstance(result, np.generic) or (isinstance(result, np.ndarray) and result.size == 1):
            result = result.item()
        if isinstance(result, str) and isinstance(expected, str) and _plain(result) == _plain(expected):
            if result.strip().lower() == expected.lower():
                return expected
            raise Refused(f"{result!r} is the right word, but it is written {expected!r}: who compares asks for that")
        if isinstance(expected, bool) and type(result) is int and result in (0, 1):
            result = bool(result)
        kinds = ((bool,), "True or False"), ((str,), "a word"), ((int,), "a whole number")
        for types, words in kinds:
            if isinstance(expected, types):
                whole = types == (int,) and isinstance(result, float) and result.is_integer()
                if not isinstance(result, types) and not whole:
                    raise Refused(f"expected {words}, got {_describe(result)}")
                break
        return result

    def deviations(self, result, expected):
        same = np.array_equal(result, expected) if isinstance(expected, np.ndarray) else bool(result == expected)
        shown = f"`{result!r}`" if isinstance(result, str | bool | int | float) else "what you return"
        return [Deviation("", 0.0 if same else 1.0, "", 0.5, words=f"{shown} is not the answer here")]


def _plain(words):
    """Words without their case, and with single spaces for underscores and hyphens."""
    return " ".join(words.lower().replace("_", " ").replace("-", " ").split())


@dataclass(frozen=True)
class Several(Metric):
    """A tuple of results, each with its own metric and name; `together` where none has a slip of its own, as each
    follows from all of them.
    """

    metrics: tuple
    names: tuple
    together: bool = False

    def __init__(self, *metrics, names, together=False):
        object.__setattr__(self, "together", together)
        object.__setattr__(self, "metrics", metrics)
        object.__setattr__(self, "names", tuple(names))
        if len(metrics) != len(self.names):
            raise ValueError(f"{len(metrics)} metrics need as many names, got {len(self.names)}")

    def admit(self, result, expected):
        wanted = f"expected {len(self.names)} results ({', '.join(self.names)})"
        if result is None:
            raise Refused("it returned None: is a `return` missing?")
        try:
            count = len(result)
            _refuse_unordered(result, wanted)
        except TypeError:
            raise Refused(f"{wanted}, got {_describe(result)}") from None
        if count != len(self.names):
            one = f"one array of shape {result.shape}" if isinstance(result, np.ndarray) else count
            raise Refused(f"{wanted}, got {one}")
        admitted = []
        for name, metric, part, want in zip(self.names, self.metrics, result, expected):
            try:
                admitted.append(metric.admit(part, want))
            except Refused as error:
                if isinstance(result, np.ndarray) and np.shape(part) != np.shape(want):  # taken apart into its rows
                    raise Refused(f"{wanted}, got one array of shape {result.shape}") from None
                raise Refused(f"{name}: {error}") from None
        return admitted

    def deviations(self, result, expected):
        found = []
        for name, metric, part, want in zip(self.names, self.metrics, result, expected):
            found += [replace(d, what=_joined(name, d.what)) for d in metric.deviations(part, want)]
        return found

    def parts(self, result, expected):
        return list(zip(self.names, self.metrics, result, expected))


def _refuse_unordered(result, wanted):
    """Several results stand in an order: what goes by names, or is one text, is none of them."""
    if isinstance(result, dict | set | frozenset | str):
        raise Refused(f"{wanted}, separated by commas, got {_describe(result)}")


@dataclass(frozen=True)
class First(Metric):
    """The first of several results: alone, or with the others behind it, which are then compared as well.

    `others` are (name, metric, function that gives the expected value) of what may follow, and where there are such
    {what is said of it: function that gives it} of wrong ones.
    """

    metric: Metric
    others: tuple

    def admit(self, result, expected):
        several = isinstance(result, tuple) and len(result) == 1 + len(self.others)
        if not several or all(isinstance(part, int | float | np.number) for part in result) and np.ndim(expected):
            return self.metric.admit(result, expected)
        first = self.metric.admit(result[0], expected)
        for (name, metric, reference, *known), part in zip(self.others, result[1:]):
            wanted = reference()
            part = metric.admit(part, wanted)
            off = [d for d in metric.deviations(part, wanted) if not d.within]
            if off and self.metric.equal(first, expected):
                told = (words for wrong in known for words, made in wrong.items() if metric.equal(part, made()))
                raise RefusedBeside(name, metric, (part, wanted), next(told, None), off[0])
        return first

    def deviations(self, result, expected):
        return self.metric.deviations(result, expected)


def _joined(name, what):
    """What is off in a named part; the name alone where the part says nothing more than it."""
    return name if what in ("", name, f"the {name}") else f"{name}: {what}"


@dataclass(frozen=True)
class Through(Metric):
    """Compare after a function: through(matrix_from_kuka, poses()) lets every set of angles of the same pose pass."""

    function: object
    metric: Metric

    def admit(self, result, expected):
        return as_array(result, np.shape(expected))

    def deviations(self, result, expected):
        try:
            image = np.asarray(self.function(result.astype(float)))
        except ValueError as error:
            raise Refused(str(error)) from None
        return self.metric.deviations(image, self.function(expected))
