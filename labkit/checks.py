"""What arrives at the border: every public function refuses bad input with one clear sentence."""

import numpy as np

ORTHONORMAL_TOLERANCE = 1e-3  # six printed digits pass, a matrix in the wrong unit or a sheared one does not


def as_finite(value, name):
    """`value` as an array of finite floats; refuses objects, complex numbers, NaN and infinities."""
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "biuf":
            if array.dtype.kind in "cSU":
                raise TypeError
            array = array.astype(float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must hold real numbers, got {type(value).__name__}") from None
    if array.dtype.kind != "f" or array.dtype.itemsize < 8:
        array = array.astype(float)
    if not np.isfinite(array).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"{name} must be finite, got {array[where]} at index {list(where)}")
    return array


def as_points(value, name, dim=3):
    """`value` as finite points, shape (..., dim)."""
    array = as_finite(value, name)
    if array.ndim < 1 or array.shape[-1] != dim:
        raise ValueError(f"{name} must have shape (..., {dim}), got {array.shape}")
    return array


def as_rotations(value, name):
    """`value` as rotation matrices, shape (..., 3, 3), orthonormal and right-handed."""
    array = as_finite(value, name)
    if array.shape[-2:] != (3, 3):
        raise ValueError(f"{name} must have shape (..., 3, 3), got {array.shape}")
    _refuse_sheared(array, name)
    return array


def as_transforms(value, name):
    """`value` as rigid transforms, shape (..., 4, 4): orthonormal rotation block, last row (0, 0, 0, 1)."""
    array = as_finite(value, name)
    if array.shape[-2:] != (4, 4):
        raise ValueError(f"{name} must have shape (..., 4, 4), got {array.shape}")
    if array[..., 3, :3].any() or (array[..., 3, 3] != 1.0).any():
        bad = array[..., 3, :].reshape(-1, 4)
        row = bad[(bad != (0.0, 0.0, 0.0, 1.0)).any(-1)][0]
        raise ValueError(f"{name} must have the last row 0 0 0 1, got {np.array2string(row, precision=4)}")
    _refuse_sheared(array[..., :3, :3], name)
    return array


def _refuse_sheared(R, name):
    if R.ndim > 2 and _is_certainly_rigid(R):
        return
    error = np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max(initial=0.0)
    if error > ORTHONORMAL_TOLERANCE:
        raise ValueError(f"{name} must have an orthonormal rotation block, but R'R differs from I by {error:.3g}")
    det = np.linalg.det(R)
    if (det < 0).any():
        raise ValueError(f"{name} must be right-handed, but its rotation block has determinant {det.min():.3g}")


def _is_certainly_rigid(R, block=1024):
    """True only when `_refuse_sheared` cannot find anything wrong: the first two columns are orthonormal, the third is their cross product.

    Works block by block with the components in contiguous rows, which is several times faster than the full test of many small matrices.
    An eighth of the tolerance here leaves room for what the omitted products can add up to.
    """
    R = R.reshape(-1, 3, 3)
    for start in range(0, len(R), block):
        x, y, z = R[start : start + block].transpose(2, 1, 0)
        columns = np.empty((2, 5, x.shape[1]))  # x and y with their first two components repeated: a cross product by slices
        columns[0, :3], columns[1, :3] = x, y
        columns[:, 3:] = columns[:, :2]
        (x, y), error = columns, np.empty((6, x.shape[1]))
        np.multiply(x[1:4], y[2:], out=error[:3])
        error[:3] -= x[2:] * y[1:4]
        error[:3] -= z
        np.einsum("cin,cin->cn", columns[:, :3], columns[:, :3], out=error[3:5])
        error[3:5] -= 1.0
        np.einsum("in,in->n", x[:3], y[:3], out=error[5])
        if not max(error.max(), -error.min()) <= ORTHONORMAL_TOLERANCE / 8:
            return False
    return True


def as_positive(value, name):
    """`value` as positive finite floats (a standard deviation, a length, a time step)."""
    array = as_finite(value, name)
    if (array <= 0).any():
        raise ValueError(f"{name} must be positive, got {array.min():g}")
    return array
