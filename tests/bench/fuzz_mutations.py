"""Ways to spoil one argument of a call: every one takes (value, rng) and returns what stands in its place.

Used by `fuzz.py`. A mutation of ORDINARY keeps numbers within what a robot, a tracker or a slip of the keyboard
produces; one of EXTREME does not.
"""

import warnings
from datetime import date

import numpy as np

STRANGERS = (None, "text", "", b"bytes", {}, {"a": 1.0}, set(), object(), len, 5, 2.5, True, [], (), [[]], [None], 1j)
STRANGERS += (np.array("text"), np.array([1j, 2.0]), np.array(["a"]), np.array([None]), [1.0, [2.0]], date(2016, 5, 4))
STRANGERS += (np.zeros(0), np.zeros((0, 3)), np.zeros((3, 0)), np.nan, [np.nan], np.ones(3, bool), np.datetime64("now"))
STRANGERS += (np.zeros((2, 2, 2, 2)), range(3), slice(3), ..., float, np.random, np.random.RandomState(0), -1, 0)
HUGE, TINY = 10.0 ** np.array([12, 30, 76, 150, 160, 300, 307]), 10.0 ** -np.array([14, 30, 76, 150, 160, 300, 320])


def is_numeric(value):
    """Whether an argument holds real numbers: an array, a number, nested lists of numbers."""
    if isinstance(value, bool | str | bytes) or value is None:
        return False
    try:
        return np.asarray(value).dtype.kind in "iuf"
    except (ValueError, TypeError):
        return False


def _one_entry(new):
    def spoil(value, rng):
        array = np.array(value, dtype=float)
        if array.size:
            array.flat[rng.integers(array.size)] = new(rng) if callable(new) else new
        return array

    return spoil


def _scaled(factors):
    return lambda value, rng: np.array(value, float) * rng.choice(factors)


def _entry_scaled(factors):
    def spoil(value, rng):
        array = np.array(value, dtype=float)
        if array.size:
            k = rng.integers(array.size)
            array.flat[k] = (array.flat[k] or 1.0) * rng.choice(factors)
        return array

    return spoil


def _shape(value, rng):
    """Another shape: an axis more, less, shorter, longer, swapped."""
    array = np.asarray(value, dtype=float)
    ways = [lambda: array[None], lambda: array[..., None], array.ravel, lambda: array.T, lambda: np.stack([array] * 2)]
    if array.ndim:
        axis = int(rng.integers(array.ndim))
        n = array.shape[axis]
        ways += [lambda: array[0], lambda: array[..., 0], lambda: array[..., :1]] if array.size else []
        ways += [lambda: array.take(range(n - 1), axis), lambda: array.take(range(0), axis)] if n else []
        ways += [lambda: np.concatenate([array, array], axis)]
        ways += [lambda: array.take([0], axis), lambda: array.take(rng.permutation(n), axis)] if n else []
    return ways[rng.integers(len(ways))]()


def _kind(value, rng):
    """The same numbers as something else: text, complex, objects, lists, single precision, whole."""
    array = np.asarray(value, dtype=float)
    whole = np.nan_to_num(array, posinf=9.0, neginf=-9.0).clip(-1e9, 1e9).round().astype(int)
    ways = (array.astype(str), array + 0.1j, array.astype(object), array.tolist(), array.astype("f4"), array > 0)
    ways += (whole, tuple(np.atleast_1d(array).tolist()), np.ma.array(array), whole.astype("m8[s]"))
    return ways[rng.integers(len(ways))]


def _degenerate(value, rng):
    """All zero, all equal, rows that repeat, one coordinate gone, everything on a line."""
    array = np.array(value, dtype=float)
    if not array.size:
        return array
    flat = np.atleast_1d(array).copy()
    flat[..., -1:] = 0.0
    repeated = np.broadcast_to(array[:1], array.shape) if array.ndim else array
    line = np.multiply.outer(np.arange(float(len(array))), np.ones(array.shape[1:])) if array.ndim else array
    ways = (np.zeros_like(array), np.ones_like(array), np.full_like(array, array.flat[0]), flat, repeated, line)
    return np.array(ways[rng.integers(len(ways))])


def _matrix(value, rng):
    """A square matrix that is no covariance and no rotation: asymmetric, indefinite, singular, sheared, mirrored."""
    array = np.array(value, dtype=float)
    if array.ndim < 2 or array.shape[-1] != array.shape[-2] or not array.shape[-1]:
        return -array
    n, eye, scale = array.shape[-1], np.eye(array.shape[-1]), float(np.abs(array[np.isfinite(array)]).max(initial=0))
    mirrored, upper = array.copy(), np.triu(np.ones((n, n)))
    mirrored[..., :1] *= -1
    ways = (array * upper, array - 2 * scale * eye, array * np.eye(n)[0], np.swapaxes(array, -1, -2), mirrored)
    ways += (array + scale * np.eye(n, k=1), 5 * np.ones_like(array), array + scale * (1 - eye), 2 * array)
    ways += (np.broadcast_to(rng.normal(size=(n, n)), array.shape).copy(), array * rng.choice([-1.0, 1.0], size=(n, n)))
    return ways[rng.integers(len(ways))]


def _noise(value, rng):
    array = np.array(value, dtype=float)
    level = 10.0 ** rng.integers(-9, 1)
    return array + level * (np.abs(array) + 1e-3) * rng.normal(size=array.shape)


def _stranger(value, rng):
    return STRANGERS[rng.integers(len(STRANGERS))]


NUMERIC = (
    _one_entry(np.nan),
    _one_entry(lambda rng: rng.choice([np.inf, -np.inf])),
    _one_entry(0.0),
    _one_entry(lambda rng: rng.normal()),
    lambda value, rng: np.full_like(np.array(value, float), np.nan),
    lambda value, rng: -np.array(value, float),
    _scaled([1e-3, 1e3, 0.5, 0.017453292519943295, 57.29577951308232]),
    _entry_scaled([-1.0, 1e-3, 1e3]),
    _shape,
    _shape,
    _kind,
    _degenerate,
    _degenerate,
    _matrix,
    _matrix,
    _noise,
    _noise,
    _stranger,
)
EXTREME = (_scaled(HUGE), _scaled(TINY), _entry_scaled(HUGE), _entry_scaled(TINY))


def _spoil_number(value, rng):
    """One number: whole ones stay whole most of the time, and within what a count may be."""
    if isinstance(value, int | np.integer) and rng.random() < 0.6:
        return int(rng.choice([0, 1, 2, 3, 7, 100, -1, -value, value + 1, value - 1]))
    return None


def _spoil_items(value, rng, spoil):
    """A list, tuple or dictionary with one item spoilt, gone, doubled or of another name."""
    keys = list(value) if isinstance(value, dict) else list(range(len(value)))
    if not keys or rng.random() < 0.25:
        return _stranger(value, rng)
    k, way = keys[rng.integers(len(keys))], rng.integers(4)
    if isinstance(value, dict):
        rest = {key: v for key, v in value.items() if key != k}
        return (rest, {**rest, "other": value[k]}, *[{**value, k: spoil(value[k], rng)}] * 2)[way]
    rest = [v for j, v in enumerate(value) if j != k]
    found = (rest, [*value, value[k]], *[[*value[:k], spoil(value[k], rng), *value[k + 1 :]]] * 2)[way]
    return tuple(found) if isinstance(value, tuple) and not hasattr(value, "_fields") else found


def _spoil_function(value, rng):
    """A function that returns what it should not, or none at all."""

    def instead(*args, **kwargs):
        result = value(*args, **kwargs)
        return _stranger(result, rng) if rng.random() < 0.4 else spoil(result, rng)

    return instead if rng.random() < 0.6 else _stranger(value, rng)


def spoil(value, rng, extreme=False):
    """`value` with one mutation that fits its kind; `extreme` asks for numbers of no ordinary magnitude."""
    if is_numeric(value):
        if extreme:
            with np.errstate(all="ignore"):
                return EXTREME[rng.integers(len(EXTREME))](value, rng)
        whole = _spoil_number(value, rng)
        if whole is not None:
            return whole
        with np.errstate(all="ignore"), warnings.catch_warnings(action="ignore"):
            spoilt = NUMERIC[rng.integers(len(NUMERIC))](value, rng)
        number = isinstance(value, float | int) and isinstance(spoilt, np.ndarray) and spoilt.shape == ()
        return spoilt.item() if number else spoilt
    if isinstance(value, list | tuple | dict):
        return _spoil_items(value, rng, lambda v, rng: spoil(v, rng, extreme))
    if isinstance(value, bool):
        return rng.choice([not value]).item() if rng.random() < 0.6 else _stranger(value, rng)
    if callable(value) and not isinstance(value, type):
        return _spoil_function(value, rng)
    return _stranger(value, rng)
