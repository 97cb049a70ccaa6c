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


def as_positive(value, name):
    """`value` as positive finite floats (a standard deviation, a length, a time step)."""
    array = as_finite(value, name)
    if (array <= 0).any():
        raise ValueError(f"{name} must be positive, got {array.min():g}")
    return array
