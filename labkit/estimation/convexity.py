"""Where a function is convex: the curvature matrix at a place, and the chord between two.

f is convex on a convex set if every chord lies on or above f; if it has two derivatives, if its Hessian has no negative
eigenvalue there. Then a local minimum is the global one. Source: thesis "Optimierung bei der Kalibrierung von
Sensor-Roboter-Systemen", HAW Hamburg 2019, section 2.4.2.
"""

import numpy as np

from ..checks import as_finite, as_matrices, as_number, as_size
from ..documented import documented


def positive_definite(B):
    """Whether all eigenvalues of symmetric matrices are above zero.

    Parameters
    ----------
    B : array-like, shape (..., n, n)

    Returns
    -------
    positive : bool array, shape (...)

    Raises
    ------
    ValueError
        Matrices that are not square.

    Source: thesis, section 2.4.2, convexity by the Hessian.
    """
    B = as_finite(B, "B")
    n = B.shape[-1] if B.ndim else 0
    return (np.linalg.eigvalsh(as_matrices(B, "B", n, n)) > 0).all(-1)


@documented
def chord(f, x, y, n):
    """A function and its chord at n places from x to y, evenly spaced, both ends included.

    Parameters
    ----------
    f : callable
        Takes shape (d,), returns a number.
    x, y : array-like, shape (d,)
    n : int
        At least 2.

    Returns
    -------
    share, values, heights : arrays, shape (n,)
        Lambda from 0 at x to 1 at y; f there; (1 - lambda) f(x) + lambda f(y).

    Raises
    ------
    ValueError
        Ends of different shapes, n below 2.

    Source: thesis, section 2.4.2, definition a) of convex functions.
    """
    x, y, n = as_finite(x, "x"), as_finite(y, "y"), as_size(n, "n", at_least=2)
    if x.ndim != 1 or x.shape != y.shape:
        raise ValueError(f"x and y must have the same shape (d,), got {x.shape} and {y.shape}")
    share = np.linspace(0.0, 1.0, n)
    values = np.array([as_number(f((1 - t) * x + t * y), "what f returns") for t in share])
    return share, values, (1 - share) * values[0] + share * values[-1]


def rise_above_chord(f, x, y, n):
    """By how much f rises above its chord at most, over the n places of `chord`; 0 where it never does.

    Parameters
    ----------
    f, x, y, n
        As in `chord`.

    Returns
    -------
    rise : float
    """
    _, values, heights = chord(f, x, y, n)
    return float((values - heights).max())
