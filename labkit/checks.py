"""What arrives at the border: every public function refuses bad input with one clear sentence."""

import math

import numpy as np

ORTHONORMAL_TOLERANCE = 1e-3  # six printed digits pass, a matrix in the wrong unit or a sheared one does not


def as_finite(value, name):
    """`value` as an array of finite floats; refuses objects, complex numbers, NaN and infinities."""
    array = as_floats(value, name)
    # the sum of squares is one quick call, and infinite or NaN if an entry is; huge entries get the second look
    if not math.isfinite(np.vdot(array, array)) and not np.isfinite(array).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"{name} must be finite, got {array[where]} at index {list(where)}")
    return array


def as_readings(value, name):
    """`value` as floats in which NaN stands for what was not measured; refuses infinities."""
    array = as_floats(value, name)
    if np.isinf(array).any():
        raise ValueError(f"{name} must be finite, or NaN where nothing was measured, got an infinity")
    return array


def as_floats(value, name):
    """`value` as an array of floats, NaN and infinities among them; refuses objects, texts and complex numbers."""
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "biuf":
            if array.dtype.kind in "cSU" or value is None:
                raise TypeError
            array = array.astype(float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must hold real numbers, got {type(value).__name__}") from None
    if array.dtype.kind != "f" or array.dtype.itemsize < 8:
        array = array.astype(float)
    return array


def as_points(value, name, dim=3):
    """`value` as finite points, shape (..., dim)."""
    array = as_finite(value, name)
    if array.ndim < 1 or array.shape[-1] != dim:
        raise ValueError(f"{name} must have shape (..., {dim}), got {array.shape}")
    return array


def as_matrices(value, name, rows, columns):
    """`value` as finite matrices, shape (..., rows, columns)."""
    array = as_finite(value, name)
    if array.shape[-2:] != (rows, columns):
        raise ValueError(f"{name} must have shape (..., {rows}, {columns}), got {array.shape}")
    return array


def as_shape(value, name, *shape):
    """`value` as a finite array of just this shape; a letter stands for any length."""
    array = as_finite(value, name)
    if array.ndim != len(shape) or any(isinstance(w, int) and w != n for w, n in zip(shape, array.shape)):
        wanted = f"({shape[0]},)" if len(shape) == 1 else f"({', '.join(map(str, shape))})"
        raise ValueError(f"{name} must have shape {wanted}, got {array.shape}")
    return array


def as_number(value, name):
    """`value` as one finite float."""
    return float(as_shape(value, name))


def as_positive_number(value, name):
    """`value` as one positive finite float."""
    return float(as_positive(as_shape(value, name), name))


def as_count(value, name, at_least=1):
    """`value` as a whole number, not below `at_least`."""
    number = as_number(value, name)
    if number != int(number) or number < at_least:
        raise ValueError(f"{name} must be a whole number, at least {at_least}, got {number:g}")
    return int(number)


def fit_together(**shapes):
    """The shape that leading axes broadcast to, {name: shape}; refuses those that do not, with the names."""
    try:
        return np.broadcast_shapes(*shapes.values())
    except ValueError:
        found = ", ".join(f"{shape} of {name}" for name, shape in shapes.items())
        raise ValueError(f"the leading axes must be equal or broadcast, got {found}") from None


def as_rotations(value, name):
    """`value` as rotation matrices, shape (..., 3, 3), orthonormal and right-handed."""
    array = as_matrices(value, name, 3, 3)
    _refuse_sheared(array, name)
    return array


def as_transforms(value, name):
    """`value` as rigid transforms, shape (..., 4, 4): orthonormal rotation block, last row (0, 0, 0, 1)."""
    array = as_floats(value, name)
    if array.ndim > 2 and array.shape[-2:] == (4, 4) and _are_certainly_rigid(array.reshape(-1, 16).T):
        return array
    return _all_rigid(array, name)


def as_transform_rows(value, name):
    """`value`, a stack of rigid transforms, shape (n, 4, 4), with a copy of its entries as contiguous rows (16, n)."""
    array = as_floats(value, name)
    if array.ndim == 3 and array.shape[1:] == (4, 4):
        rows = np.array(array.reshape(-1, 16).T, order="C")
        if _are_certainly_rigid(rows):
            return array, rows
    array = _all_rigid(array, name)
    if array.ndim != 3:
        raise ValueError(f"{name} must have shape (n, 4, 4), got {array.shape}")
    return array, np.array(array.reshape(-1, 16).T, order="C")


def _all_rigid(array, name):
    array = as_finite(array, name)
    if array.shape[-2:] != (4, 4):
        raise ValueError(f"{name} must have shape (..., 4, 4), got {array.shape}")
    if (array[..., 3, :] != (0.0, 0.0, 0.0, 1.0)).any():
        bad = array[..., 3, :].reshape(-1, 4)
        row = bad[(bad != (0.0, 0.0, 0.0, 1.0)).any(-1)][0]
        raise ValueError(f"{name} must have the last row 0 0 0 1, got {np.array2string(row, precision=4)}")
    _refuse_sheared(array[..., :3, :3], name)
    return array


def _refuse_sheared(R, name):
    error = np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max(initial=0.0)
    if error > ORTHONORMAL_TOLERANCE:
        raise ValueError(f"{name} must have an orthonormal rotation block, but R'R differs from I by {error:.3g}")
    det = np.linalg.det(R)
    if (det < 0).any():
        raise ValueError(f"{name} must be right-handed, but its rotation block has determinant {det.min():.3g}")


def _are_certainly_rigid(rows, block=1024):
    """True only when `as_transforms` would find nothing wrong with the transforms whose entries are (16, n).

    Quick, because it works on contiguous rows of components: columns x, y, z with z = x cross y and length 1 are a
    rotation, since |x cross y| = 1 leaves no room for x'y. A sum of squares takes the place of many comparisons; it
    is NaN or infinite where an entry is. Within t of these conditions, x'y is at most sqrt(5 t).
    """
    for start in range(0, rows.shape[1], block):
        part = rows[:, start : start + block]
        columns = np.empty((3, 5, part.shape[1]))
        columns[:, :3] = part[:12].reshape(3, 4, -1)[:, :3].swapaxes(0, 1)
        columns[:2, 3:] = columns[:2, :2]  # the first two components again: a cross product by slices
        x, y, z = columns
        error = x[1:4] * y[2:]
        error -= x[2:] * y[1:4]
        error -= z[:3]
        norms = np.einsum("kin,kin->kn", columns[:, :3], columns[:, :3])
        norms -= 1.0
        last = np.array(part[12:])
        last[3] -= 1.0
        if not np.vdot(error, error) + np.vdot(norms, norms) <= (ORTHONORMAL_TOLERANCE**2 / 10) ** 2:
            return False
        entries = part.ravel(order="K")
        if np.vdot(last, last) != 0.0 or not math.isfinite(np.vdot(entries, entries)):
            return False
    return rows.shape[1] > 0


def as_positive(value, name):
    """`value` as positive finite floats (a standard deviation, a length, a time step)."""
    array = as_finite(value, name)
    if (array <= 0).any():
        raise ValueError(f"{name} must be positive, got {array.min():g}")
    return array


def as_nonnegative(value, name):
    """`value` as finite floats, none below 0 (a standard deviation that may be absent)."""
    array = as_finite(value, name)
    if (array < 0).any():
        raise ValueError(f"{name} must not be negative, got {array.min():g}")
    return array


def as_probability(value, name):
    """`value` as one float above 0 and below 1."""
    number = as_number(value, name)
    if not 0 < number < 1:
        raise ValueError(f"{name} must lie between 0 and 1, got {number:g}")
    return number


def as_covariances(value, name, n):
    """`value` as covariances, shape (..., n, n): symmetric, no variance negative."""
    array = as_matrices(value, name, n, n)
    variances = np.diagonal(array, axis1=-2, axis2=-1)
    if (variances < 0).any():
        raise ValueError(f"{name} must hold no negative variance, got {variances.min():g}")
    if np.abs(array - np.swapaxes(array, -1, -2)).max(initial=0.0) > 1e-6 * np.abs(array).max(initial=0.0):
        raise ValueError(f"{name} must be symmetric, but differs from its transpose")
    return array


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
