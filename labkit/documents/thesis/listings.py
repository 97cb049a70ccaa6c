"""The thesis's listings C3 to C5 as they are printed, slips included."""

import numpy as np

from ...calibration.hand_eye import as_sightings, kuka_residuals
from ...checks import as_count, as_number, as_points, as_shape
from ...estimation.differences import numeric_jacobian


def listing_cost(residuals):
    """What listing C3 computes as "mse": (1/(2 n)) (sum of the residual vectors)^2 for each axis, (n, 3) -> (3,).

    The square stands outside the sum. Formula (6-11) asks for half the sum of the squares; this one is n/2 times the
    square of the *mean* residual, to which errors of opposite sign add nothing. It steers no step, it only ends the
    iteration.
    """
    residuals = as_points(residuals, "residuals")
    if residuals.ndim < 2 or not residuals.shape[-2]:
        raise ValueError(f"residuals must have shape (n, 3) with n >= 1, got {residuals.shape}")
    return residuals.sum(-2) ** 2 / (2 * residuals.shape[-2])


def listing_gauss_newton(start_deg, T_BF, x_S, target, step=5e-7, tolerance=1e-20, max_steps=250):
    """Listings C3 to C5 as printed: forward differences, degrees, normal equations, an end by `listing_cost`.

    Where A and C cannot be told apart, at B = +-90 deg, the normal equations are singular; they are solved for the
    shortest step, and so `listing_gauss_newton` goes on where MATLAB's backslash warns and returns what rounding makes
    of it.

    Returns
    -------
    p2_deg : array, shape (k + 1, 6)
        Start and iterates, x, y, z in mm, A, B, C in deg.
    ended : bool
        Whether the stopping rule was met before `max_steps`.
    """
    p, max_steps = as_shape(start_deg, "start_deg", 6), as_count(max_steps, "max_steps", at_least=0)
    T_BF, x_S = as_sightings(T_BF, x_S)
    target, tolerance = as_shape(target, "target", 3), as_number(tolerance, "tolerance")
    unit = np.array([1, 1, 1, *np.deg2rad([1, 1, 1])])

    def residuals(q):
        return kuka_residuals(q * unit, T_BF, x_S, target)

    iterates, last = [p], np.zeros(3)
    for _ in range(max_steps):
        e = residuals(p)
        J = numeric_jacobian(residuals, p, step, "forward")
        p = p - np.linalg.lstsq(J.T @ J, J.T @ e, rcond=1e-13)[0]
        iterates.append(p)
        cost = listing_cost(e.reshape(-1, 3))
        if (np.abs(cost - last) <= tolerance).all():
            return np.array(iterates), True
        last = cost
    return np.array(iterates), False
