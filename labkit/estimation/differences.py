"""Jacobians by finite differences."""

import numpy as np

from ..checks import as_count, as_finite, as_positive
from ..documented import documented


@documented
def numeric_jacobian(function, x, step=1e-6, scheme="central", retract=np.add, n=None):
    """Derivative of a function with respect to the n entries of an increment of x.

    Parameters
    ----------
    function : callable
        x -> array, shape (...).
    x : array-like
        Where. A vector, or anything that `retract` understands, such as a pose of shape (4, 4).
    step : float or array-like, shape (n,)
        Step of each entry, in its unit.
    scheme : {"central", "forward"}
        Central is off by step^2 f''' / 6, forward by step f'' / 2; rounding adds about eps |f| / step to both.
    retract : callable
        (x, increment) -> x; by default their sum.
    n : int, optional
        Number of entries of an increment; the size of x by default.

    Returns
    -------
    J : array, shape (..., n)

    Raises
    ------
    ValueError
        Wrong shapes, a step that is not positive, an unknown scheme.

    Source: thesis, formula (6-15) and listing C4 (forward, one step for millimeters and degrees alike).
    """
    x, steps = as_finite(x, "x"), as_positive(step, "step")
    n = x.size if n is None else as_count(n, "n")
    if not n or steps.shape not in ((), (n,)):
        raise ValueError(f"x and step must have shapes (n,) and () or (n,), got {x.shape} and {steps.shape}")
    if retract is np.add and (x.ndim > 1 or x.size != n):
        raise ValueError(f"x must have shape ({n},) where no retract says what an increment does, got {x.shape}")
    columns, here = [], function(x) if scheme == "forward" else None
    for h, direction in zip(np.broadcast_to(steps, n), np.eye(n)):
        ahead = function(retract(x, h * direction))
        if scheme == "forward":
            columns.append(np.subtract(ahead, here) / h)
        else:
            columns.append(np.subtract(ahead, function(retract(x, -h * direction))) / (2 * h))
    return np.stack(columns, axis=-1)
