"""Whether a stack of poses is beyond doubt rigid, in few passes over it; else `checks.as_transforms` decides."""

import numpy as np

from ..checks import LARGEST_COORDINATE, LAST_ROW_TOLERANCE, ORTHONORMAL_TOLERANCE, as_floats
from ..documented import documented

CERTAIN = ORTHONORMAL_TOLERANCE**2 / 10  # two columns of length 1 within t of their cross product's: x'y <= sqrt(5 t)
BLOCK = 1024  # poses that stay in a processor's cache from one pass to the next


@documented
def rigid_rows(value, name):
    """The entries of a stack of poses as contiguous rows, a copy, when they are rigid beyond doubt.

    Columns x, y, z of a matrix are a right-handed rotation when z = x cross y and all three have length 1, since
    |x cross y| = 1 leaves no room for x'y. A sum of squares takes the place of many comparisons; it is NaN or infinite
    where an entry is.

    Parameters
    ----------
    value : array-like, shape (n, 4, 4)
        Poses.
    name : str
        What a refusal calls them.

    Returns
    -------
    rows : array, shape (16, n), or None
        None for another shape, no poses, or poses that `checks.as_transforms` has to look at.

    Raises
    ------
    ValueError
        When `value` holds no numbers.
    """
    array = as_floats(value, name)
    if array.ndim != 3 or array.shape[1:] != (4, 4) or not len(array):
        return None
    rows = np.array(array.reshape(-1, 16).T, order="C")
    blocks = (rows[:, start : start + BLOCK] for start in range(0, len(array), BLOCK))
    with np.errstate(over="ignore", invalid="ignore"):
        return rows if all(_are_certainly_rigid(block) for block in blocks) else None


def _are_certainly_rigid(rows):
    columns = np.empty((3, 5, rows.shape[1]))
    columns[:, :3] = rows[:12].reshape(3, 4, -1)[:, :3].swapaxes(0, 1)
    columns[:2, 3:] = columns[:2, :2]  # the first two components again: a cross product by slices
    x, y, z = columns
    error = x[1:4] * y[2:]
    error -= x[2:] * y[1:4]
    error -= z[:3]
    norms = np.einsum("kin,kin->kn", columns[:, :3], columns[:, :3])
    norms -= 1.0
    last = np.array(rows[12:])
    last[3] -= 1.0
    entries = rows.ravel(order="K")
    return (
        np.vdot(error, error) + np.vdot(norms, norms) <= CERTAIN**2
        and np.vdot(last, last) <= LAST_ROW_TOLERANCE**2
        and np.vdot(entries, entries) <= LARGEST_COORDINATE**2
    )
