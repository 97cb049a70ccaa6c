"""What arrives at the border: every public function refuses bad input with one clear sentence."""

import math
import numbers
from decimal import Decimal

import numpy as np

ORTHONORMAL_TOLERANCE = 1e-3  # six printed digits pass, a matrix in the wrong unit or a sheared one does not
PRODUCT_TOLERANCE = 1e-2  # a product of a few such matrices
LAST_ROW = np.array([0.0, 0.0, 0.0, 1.0])
LAST_ROW_TOLERANCE = 1e-6  # a product of poses in single precision passes, a transposed pose or a scale does not
COVARIANCE_TOLERANCE = 1e-6  # of the standard deviations: sums in another order pass, single precision, too
LARGEST_COORDINATE = 1e75  # fourth powers of coordinates still fit into a float
FEW = 500  # numbers: of fewer the sum of squares is quicker than the largest and the smallest
MANY = 900  # numbers: of more, matrices are multiplied entry by entry over all of them sooner than one by one
SMALLEST_POSITIVE = 1e-75  # of what is divided by, for the same reason
LARGEST_WHOLE = 1e15  # beyond, a float does not tell one whole number from the next
FLOAT = np.dtype(float)
MOST = 10_000_000  # what one call makes of a kind: some hundred megabytes of poses
KINDS = {"b": "truth values", "c": "complex numbers", "U": "text", "S": "bytes", "M": "dates", "m": "durations"}


def shown(value, form="g"):
    """A number, or a vector as "(x, y, z)", for a sentence; what rounds to zero has no sign."""
    array = np.asarray(value, dtype=float)
    if array.ndim:
        return f"({', '.join(shown(entry, form) for entry in array)})"
    text = format(float(array), form)
    return text.lstrip("-") if float(text) == 0 else text


def as_finite(value, name, below=LARGEST_COORDINATE):
    """`value` as an array of finite floats; refuses what is no number, NaN, infinities and what has no fourth power."""
    array = as_floats(value, name)
    if _are_sound(array, below):
        return array
    array, largest = _with_largest(array, name)
    _refuse_huge(largest, name, below)
    return array


def _are_sound(array, below=LARGEST_COORDINATE):
    """Whether few floats are finite beyond doubt: one sum of squares tells it, sooner than the largest of them."""
    return array.size < FEW and np.vdot(array, array) < below * below  # NaN is not


def as_readings(value, name):
    """`value` as floats in which NaN stands for what was not measured; refuses infinities."""
    array = as_floats(value, name)
    if np.isinf(array).any():
        raise ValueError(f"{name} must be finite, or NaN where nothing was measured, got an infinity")
    return array


def as_floats(value, name):
    """`value` as an array of floats, NaN and infinities among them.

    Raises
    ------
    ValueError
        When it holds text, complex numbers, truth values, dates or other objects, masked numbers, or rows of different
        lengths.
    """
    if type(value) is np.ndarray and value.dtype is FLOAT:  # most that is checked, and is seen to be so at once
        return value
    array = _as_array(value, name, "real numbers")
    if array.dtype.kind in "iuf":
        return array.astype(float, copy=False)
    if array.dtype.kind == "O" and all(_is_real(entry) for entry in array.flat):
        try:
            return array.astype(float)
        except OverflowError:
            raise ValueError(f"{name} must hold numbers below 1e308, got a larger one") from None
    raise ValueError(f"{name} must hold real numbers, got {_what(array)}")


def _as_array(value, name, wanted):
    """`value` as a plain array; a masked one would lose its mask and go on with what the mask hides."""
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        raise ValueError(f"{name} must hold {wanted}, got masked entries")
    try:
        return np.asarray(value)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must hold {wanted}, got rows of different lengths") from None


def _is_real(entry):
    return isinstance(entry, numbers.Real | Decimal) and not isinstance(entry, bool | np.bool_)


def _what(array):
    """What an array holds that are no real numbers, in words."""
    if array.dtype.kind != "O":
        return KINDS.get(array.dtype.kind, f"entries of type {array.dtype}")
    for entry in array.flat:
        if not _is_real(entry):
            return "None" if entry is None else f"an entry of type {type(entry).__name__}"
    return "numbers" if array.size else "nothing"


def as_points(value, name, dim=3):
    """`value` as finite points, shape (..., dim)."""
    array = as_floats(value, name)
    if _are_sound(array) and array.shape[-1:] == (dim,):
        return array
    array, largest = _with_largest(array, name)
    if array.ndim < 1 or array.shape[-1] != dim:
        raise ValueError(f"{name} must have shape (..., {dim}), got {array.shape}")
    _refuse_huge(largest, name)
    return array


def _with_largest(value, name):
    """`value` as an array of finite floats, and the largest of their amounts; thousands of them are passed twice."""
    array = as_floats(value, name)
    largest = max(array.max(initial=0.0), -array.min(initial=0.0))  # NaN if one is
    if not math.isfinite(largest):
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"{name} must be finite, got {array[where]} at index {list(where)}")
    return array, largest


def _refuse_huge(largest, name, below=LARGEST_COORDINATE):
    if largest > below:
        raise ValueError(f"{name} must hold numbers below {below:.0e}, got {shown(largest, '.3g')}")


def as_matrices(value, name, rows, columns):
    """`value` as finite matrices, shape (..., rows, columns)."""
    array = as_floats(value, name)
    if _are_sound(array) and array.shape[-2:] == (rows, columns):
        return array
    array, largest = _with_largest(array, name)
    if array.shape[-2:] != (rows, columns):
        raise ValueError(f"{name} must have shape (..., {rows}, {columns}), got {array.shape}")
    _refuse_huge(largest, name)
    return array


def as_shape(value, name, *shape):
    """`value` as a finite array of just this shape; a letter stands for any length, and twice for the same."""
    array = as_finite(value, name)
    if not is_of_shape(array, shape):
        wanted = f"({shape[0]},)" if len(shape) == 1 else f"({', '.join(map(str, shape))})"
        raise ValueError(f"{name} must have shape {wanted}, got {array.shape}")
    return array


def is_of_shape(array, shape):
    """Whether an array has just this shape; a letter stands for any length, and twice for the same."""
    letters = {}
    return array.ndim == len(shape) and all(
        n == (w if isinstance(w, int) else letters.setdefault(w, n)) for w, n in zip(shape, array.shape)
    )


def as_number(value, name):
    """`value` as one finite float."""
    if isinstance(value, float) and abs(value) <= LARGEST_COORDINATE:
        return float(value)
    return float(as_shape(value, name))


def as_positive_number(value, name):
    """`value` as one positive finite float."""
    if isinstance(value, float) and SMALLEST_POSITIVE <= value <= LARGEST_COORDINATE:
        return float(value)
    return float(as_positive(as_shape(value, name), name))


def as_count(value, name, at_least=1):
    """`value` as a whole number, not below `at_least`."""
    return as_whole(as_number(value, name), name, at_least)


def as_size(value, name, at_least=1):
    """`value` as a whole number of things that are made and kept, not below `at_least`, and not too many of them."""
    size = as_count(value, name, at_least)
    if size > MOST:
        raise ValueError(f"{name} must be at most {MOST:.0e}, got {shown(size, '.9g')}")
    return size


def as_whole(value, name, at_least=None):
    """`value` as it is if it is one whole number, not below `at_least`; 3.0 becomes 3."""
    is_whole = isinstance(value, int | np.integer) and not isinstance(value, bool | np.timedelta64)
    number = value if is_whole else as_number(value, name)
    if number != int(number) or (at_least is not None and number < at_least):
        bound, got = "" if at_least is None else f", at least {at_least}", number if is_whole else shown(number)
        raise ValueError(f"{name} must be a whole number{bound}, got {got}")
    return number if is_whole else int(number)


def fit_together(**shapes):
    """The shape that leading axes broadcast to, {name: shape}; refuses those that do not, with the names."""
    first, *others = shapes.values()
    if others.count(first) == len(others):
        return first
    try:
        return np.broadcast_shapes(first, *others)
    except ValueError:
        found = ", ".join(f"{shape} of {name}" for name, shape in shapes.items())
        raise ValueError(f"the leading axes must be equal or broadcast, got {found}") from None


def as_rotations(value, name, tolerance=ORTHONORMAL_TOLERANCE):
    """`value` as rotation matrices, shape (..., 3, 3), orthonormal and right-handed."""
    if _is_one(value, 3) and _is_orthonormal(value.tolist(), tolerance):
        return value
    array = as_matrices(value, name, 3, 3)
    _refuse_sheared(array, name, tolerance)
    return array


def as_transforms(value, name, tolerance=ORTHONORMAL_TOLERANCE):
    """`value` as rigid transforms, shape (..., 4, 4): orthonormal rotation block, last row (0, 0, 0, 1).

    What rounding leaves passes: up to 1e-6 in the last row, 1e-3 in R'R.
    """
    if _is_one(value, 4) and _is_rigid(value.tolist(), tolerance):
        return value
    array = as_matrices(value, name, 4, 4)
    last = array[..., 3, :]
    if not (last == LAST_ROW).all():
        off = np.abs(last - LAST_ROW).max(-1)
        if (off > LAST_ROW_TOLERANCE).any():
            row = last.reshape(-1, 4)[np.argmax(off)]
            raise ValueError(f"{name} must have the last row 0 0 0 1, got {shown(row, '.9g')}")
    _refuse_sheared(array[..., :3, :3], name, tolerance)
    return array


def _is_one(value, n):
    """Whether a value is one matrix (n, n) of floats."""
    return type(value) is np.ndarray and value.shape == (n, n) and value.dtype == float


def _is_rigid(rows, tolerance):
    """Whether one matrix, four lists of floats, is a transform beyond doubt; what is not has all tests before it."""
    *upper, last = rows
    return (
        last == [0.0, 0.0, 0.0, 1.0]
        and all(abs(row[3]) <= LARGEST_COORDINATE for row in upper)
        and _is_orthonormal([row[:3] for row in upper], tolerance)
    )


def _is_orthonormal(rows, tolerance):
    """Whether one matrix, three lists of floats, is a rotation beyond doubt: R'R within half the tolerance, det R > 0.

    Nearly every matrix that is checked is one, and is seen to be one here in a tenth of the time that arrays take.
    """
    off, det = _off_and_determinant(rows)
    return all(abs(entry) < 0.5 * tolerance for entry in off) and det > 0  # NaN is neither


def _are_orthonormal(R, tolerance):
    """The same of many matrices, entry by entry over all of them."""
    off, det = _off_and_determinant(R.transpose(R.ndim - 2, R.ndim - 1, *range(R.ndim - 2)))
    return np.abs(off).max() < 0.5 * tolerance and det.min() > 0


def _off_and_determinant(rows):
    """Entries of R'R - I, and det R."""
    (a, b, c), (d, e, f), (g, h, i) = rows
    off = (
        a * a + d * d + g * g - 1, b * b + e * e + h * h - 1, c * c + f * f + i * i - 1,
        a * b + d * e + g * h, a * c + d * f + g * i, b * c + e * f + h * i,
    )  # fmt: skip
    return off, a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)


def _refuse_sheared(R, name, tolerance):
    if R.size > MANY and _are_orthonormal(R, tolerance):
        return
    error = np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max(initial=0.0)
    if error > tolerance:
        raise ValueError(
            f"{name} must have an orthonormal rotation block, but R'R differs from I by {shown(error, '.3g')}"
        )
    det = np.linalg.det(R)
    if (det < 0).any():
        raise ValueError(
            f"{name} must be right-handed, but its rotation block has determinant {shown(det.min(), '.3g')}"
        )


def as_truths(value, name):
    """`value` as an array of truth values; refuses numbers, which would be indices."""
    array = _as_array(value, name, "truth values")
    if array.dtype.kind != "b":
        got = "numbers" if array.dtype.kind in "iuf" else _what(array)
        raise ValueError(f"{name} must hold truth values, got {got}")
    return array


def as_indices(value, name, below=None):
    """`value` as an array of whole numbers, which name rows or entries: from 0 on, where `below` says how many."""
    array = as_floats(value, name)
    if (array != np.floor(array)).any() or (np.abs(array) > LARGEST_WHOLE).any():  # infinities among them
        raise ValueError(f"{name} must hold whole numbers, of amounts up to {LARGEST_WHOLE:.0e}")
    if below is not None and ((array < 0) | (array >= below)).any():
        raise ValueError(f"{name} must lie from 0 to {below - 1}, got {shown(array.min())} to {shown(array.max())}")
    return array.astype(int)


def as_generator(value, name="rng"):
    """`value` as it is; refuses what is no `numpy.random.Generator`."""
    return as_instance(value, name, np.random.Generator, "a numpy.random.Generator, as default_rng(seed) gives it")


def as_optional_generator(value, seed=0):
    """`value`, or a generator of this seed in place of None."""
    return np.random.default_rng(seed) if value is None else as_generator(value)


def as_function(value, name):
    """`value` as it is; refuses what cannot be called."""
    if not callable(value):
        raise ValueError(f"{name} must be a function, got {kind(value)}")
    return value


def as_instance(value, name, type_, wanted=""):
    """`value` as it is; refuses what is no instance of a class, which `wanted` puts into words."""
    if not isinstance(value, type_):
        raise ValueError(f"{name} must be {wanted or type_.__name__}, got {kind(value)}")
    return value


def as_truth(value, name):
    """`value` as it is; refuses what is neither True nor False, such as an array."""
    return as_instance(value, name, bool | np.bool_, "True or False")


def as_choice(value, name, options):
    """`value` as it is; refuses what is none of some words."""
    if not isinstance(value, str) or value not in options:
        got = repr(value) if isinstance(value, str) else kind(value)
        raise ValueError(f"{name} must be one of {', '.join(options)}, got {got}")
    return value


def as_items(value, name, of):
    """`value` as a list; refuses what holds no items, with the word for what they should be."""
    if isinstance(value, str | bytes) or not np.iterable(value):
        raise ValueError(f"{name} must be a sequence of {of}, got {kind(value)}")
    return list(value)


def as_names(value, name):
    """`value` as a list of names; refuses what can name nothing, such as a list."""
    names = as_items(value, name, "names")
    for one in names:
        try:
            hash(one)
        except TypeError:
            raise ValueError(f"{name} must hold names, got {kind(one)}") from None
    return names


def kind(value):
    """What something is, for a refusal: "None", or its type."""
    return "None" if value is None else f"an object of type {type(value).__name__}"


def as_positive(value, name):
    """`value` as positive finite floats (a standard deviation, a length, a time step)."""
    array = as_finite(value, name)
    if (array < SMALLEST_POSITIVE).any():
        wanted = "positive" if array.min() <= 0 else f"at least {SMALLEST_POSITIVE:.0e}"
        raise ValueError(f"{name} must be {wanted}, got {shown(array.min())}")
    return array


def as_nonnegative(value, name):
    """`value` as finite floats, none below 0 (a standard deviation that may be absent)."""
    array = as_finite(value, name)
    if (array < 0).any():
        raise ValueError(f"{name} must not be negative, got {shown(array.min())}")
    return array


def as_row_weights(value, name="weights"):
    """`value` as weights of rows: none below 0, not all 0."""
    array = as_nonnegative(value, name)
    if not array.any():
        raise ValueError(f"{name} must not all be zero")
    return array


def as_probability(value, name):
    """`value` as one float above 0 and below 1."""
    number = as_number(value, name)
    if not SMALLEST_POSITIVE < number < 1:
        raise ValueError(f"{name} must lie between 0 and 1, got {shown(number)}")
    return number


def as_covariances(value, name, n):
    """`value` as covariances, shape (..., n, n): symmetric, and in no direction a negative variance.

    What rounding leaves passes: up to 1e-6 of the product of the two standard deviations.
    """
    array = as_matrices(value, name, n, n)
    if not _is_definite(array):
        _refuse_indefinite(array, name)
    return array


def _is_definite(array):
    """Whether symmetric matrices, to the last bit, are positive definite: most covariances are, and this is quick."""
    if (array != np.swapaxes(array, -1, -2)).any():
        return False
    try:
        np.linalg.cholesky(array)
    except np.linalg.LinAlgError:
        return False
    return True


def _refuse_indefinite(array, name):
    variances = np.diagonal(array, axis1=-2, axis2=-1)
    if (variances < 0).any():
        raise ValueError(f"{name} must hold no negative variance, got {shown(variances.min())}")
    std = np.sqrt(variances + 1e-12 * variances.max(-1, keepdims=True, initial=0.0))  # a row of zeros is rounded, too
    rounding = COVARIANCE_TOLERANCE * std[..., :, None] * std[..., None, :]
    if (np.abs(array - np.swapaxes(array, -1, -2)) > rounding).any():
        raise ValueError(f"{name} must be symmetric, but differs from its transpose")
    try:
        np.linalg.cholesky(array + (rounding + np.finfo(float).tiny) * np.eye(array.shape[-1]))
    except np.linalg.LinAlgError:
        raise ValueError(
            f"{name} must be positive definite or singular, but has a negative variance in some direction"
        ) from None


def solve_covariance(cov, name, right):
    """cov^-1 right; refuses a covariance without an inverse."""
    try:
        return np.linalg.solve(cov, right)
    except np.linalg.LinAlgError:
        raise ValueError(f"{name} must be positive definite, but it is singular") from None


def covariance_root(cov, name):
    """Lower triangular L with L L' = cov; refuses a covariance that is not positive definite."""
    try:
        return np.linalg.cholesky(cov)
    except np.linalg.LinAlgError:
        raise ValueError(f"{name} must be positive definite, but it is not") from None
