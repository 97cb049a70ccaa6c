"""What single measurements do to a least-squares estimate: distances that unmask outliers, and leaving one out.

A fit minimizes the sum of |r_i|^2 over blocks of residuals r_i, whitened so that each has covariance I; J_i is the
derivative of r_i by the p parameters. With N = sum J_i'J_i and H_i = J_i N^-1 J_i' the residual of a block that was
fitted has covariance I - H_i, that of a new one I + H_i. Leaving a block out needs no second fit: r_i becomes
(I - H_i)^-1 r_i.
Source: Cook, Weisberg, "Residuals and Influence in Regression" (1982), chapter 2; exact for linear problems.
"""

import numpy as np
from scipy import special

from ..checks import as_finite, as_positive_number, as_probability, as_shape, as_truths
from ..documented import documented

FREE = 1e-12  # of the largest eigenvalue of a normal matrix with its columns scaled alike: what is smaller is rounding
# Baarda's: seen with 80 %, while a good number is suspected once in a thousand
VISIBLE = float(special.ndtri(0.8) - special.ndtri(0.0005))


def _blocks(residuals, jacobian):
    r, J = as_finite(residuals, "residuals"), as_finite(jacobian, "jacobian")
    if r.ndim != 2 or J.ndim != 3 or J.shape[:2] != r.shape or not J.size:
        raise ValueError(f"residuals and jacobian must have shapes (n, k) and (n, k, p), got {r.shape} and {J.shape}")
    return r, J


def inverse_normal(J):
    """(sum J_i'J_i)^-1, (n, k, p) -> (p, p); refuses parameters that the blocks leave undetermined."""
    J = as_shape(J, "J", "n", "k", "p")
    if not J.size:
        raise ValueError(f"J must hold numbers, got shape {J.shape}")
    flat = J.reshape(-1, J.shape[2])
    return invert_normal(flat.T @ flat)


def invert_normal(N):
    """Inverse of a normal matrix with its columns scaled alike, (p, p); refuses one that is singular beside that."""
    N = as_shape(N, "N", "p", "p")
    if not (np.diagonal(N) > 0).all():
        raise ValueError("a parameter changes no residual, so it is not determined")
    values, vectors = _scaled_alike(N)
    if values[0] <= FREE * values[-1]:
        raise ValueError("the measurements leave a direction of the parameters undetermined")
    half = vectors / np.sqrt(values)
    return half @ half.T


def _scaled_alike(N):
    """Eigenvalues of a normal matrix with its columns scaled alike, smallest first, and the directions, unscaled."""
    scale = np.sqrt(np.diagonal(N))
    scale = np.where(scale > 0, scale, 1.0)
    values, vectors = np.linalg.eigh(N / scale / scale[:, None])
    return values, vectors / scale[:, None]


def free_directions(N):
    """Directions of the parameters that a normal matrix leaves undetermined.

    Parameters
    ----------
    N : array-like, shape (p, p)

    Returns
    -------
    directions : array, shape (p, k)
        As columns, independent of each other; none where all parameters are determined.
    """
    values, directions = _scaled_alike(as_shape(N, "N", "p", "p"))
    return directions[:, values <= FREE * values[-1]]


def shares(jacobian):
    """How many of the parameters each block pays for: the trace of H_i.

    Parameters
    ----------
    jacobian : array-like, shape (n, k, p)

    Returns
    -------
    shares : array, shape (n,)
        Between 0 and k; they add up to p.
    """
    J = as_shape(jacobian, "jacobian", "n", "k", "p")
    return np.einsum("nki,ij,nkj->n", J, inverse_normal(J), J)


def squared_distances(residuals, jacobian, kept):
    """Squared distance of each block from what the kept ones predict, in standard deviations; shape (n,).

    Parameters
    ----------
    residuals : array-like, shape (n, k)
        Whitened residuals at the fit of the kept blocks.
    jacobian : array-like, shape (n, k, p)
    kept : array-like of bool, shape (n,)
        Which blocks were fitted.

    Returns
    -------
    distances : array, shape (n,)
        Chi-square with k degrees of freedom for good blocks, fitted or not.

    Raises
    ------
    ValueError
        Wrong shapes, kept blocks that leave a parameter undetermined.
    """
    r, J = _blocks(residuals, jacobian)
    kept = as_truths(kept, "kept")
    if kept.shape != r.shape[:1]:
        raise ValueError(f"kept must have shape {r.shape[:1]}, got {kept.shape}")
    H = J @ inverse_normal(J[kept]) @ np.swapaxes(J, 1, 2)
    spread = np.eye(r.shape[1]) - np.where(kept, 1.0, -1.0)[:, None, None] * H
    values, vectors = np.linalg.eigh(spread)
    along = (np.swapaxes(vectors, 1, 2) @ r[..., None])[..., 0]
    # a block that alone fixes a parameter fits perfectly, whatever it says: along that direction nothing is known
    known = values > 1e-9
    return np.where(known, along**2 / np.where(known, values, 1.0), 0.0).sum(1)


@documented
def distance_limit(k, dof, probability=0.999):
    """Squared distance that a good block of numbers stays below.

    Parameters
    ----------
    k : int
        Numbers in the block.
    dof : float
        Degrees of freedom from which the noise was estimated.
    probability : float

    Returns
    -------
    limit : float
        k times a quantile of the F distribution.
    """
    return k * special.fdtri(as_positive_number(k, "k"), max(dof, 1), as_probability(probability, "probability"))


def leave_out(residuals, jacobian, groups=None):
    """Residuals under the fit to the other blocks, and how far the parameters move without them.

    Parameters
    ----------
    residuals : array-like, shape (n, k)
        Whitened.
    jacobian : array-like, shape (n, k, p)
    groups : array-like, shape (n,), optional
        Blocks with the same label are left out together; each on its own without it.

    Returns
    -------
    residuals : array, shape (n, k)
        NaN where the other blocks do not determine the parameters.
    shifts : array, shape (g, p)
        Estimate without the group minus the estimate with it, groups in ascending order.
    """
    r, J = _blocks(residuals, jacobian)
    inverse = inverse_normal(J)
    if groups is None:
        return _without(r, J, inverse)
    labels, predicted, shifts = as_shape(groups, "groups", len(r)), np.full_like(r, np.nan), []
    for label in np.unique(labels):
        at = labels == label
        alone, shift = _without(r[at].reshape(1, -1), J[at].reshape(1, -1, J.shape[2]), inverse)
        predicted[at] = alone.reshape(-1, r.shape[1])
        shifts.append(shift[0])
    return predicted, np.array(shifts)


@documented
def visible_errors(jacobian, times=VISIBLE):
    """The smallest error of each number that a fit to all of them would show, in standard deviations.

    An error d of one number leaves (1 - h) d of it in its own residual, whose standard deviation is sqrt(1 - h), with
    h its share of the parameters. Source: Baarda, "A testing procedure for use in geodetic networks" (1968).

    Parameters
    ----------
    jacobian : array-like, shape (n, p)
        Derivative of the whitened residuals.
    times : float
        How many standard deviations of its residual an error must reach to be seen.

    Returns
    -------
    errors : array, shape (n,)
        Infinite for a number that alone fixes a parameter.
    """
    J, times = as_shape(jacobian, "jacobian", "n", "p"), as_positive_number(times, "times")
    left = 1 - shares(J[:, None])
    return np.where(left > 1e-9, times / np.sqrt(np.where(left > 1e-9, left, 1.0)), np.inf)


def _without(r, J, inverse):
    """Residuals (n, k) and shifts (n, p) of blocks left out one by one, NaN where the others do not determine all."""
    spread = np.eye(r.shape[1]) - J @ inverse @ np.swapaxes(J, 1, 2)
    known = np.linalg.eigvalsh(spread)[:, 0] > 1e-9
    predicted, shifts = np.full_like(r, np.nan), np.full((len(r), J.shape[2]), np.nan)
    predicted[known] = np.linalg.solve(spread[known], r[known][..., None])[..., 0]
    shifts[known] = (inverse @ np.swapaxes(J[known], 1, 2) @ predicted[known][..., None])[..., 0]
    return predicted, shifts
