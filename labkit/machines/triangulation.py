"""Height from two angles: how a light beam and a camera beside it measure a distance, and how far it errs.

Beam and camera stand at the ends of a base L. Seen from there the object lies at the angles alpha and beta against the
base, and its height H over the base follows, L = H / tan(alpha) + H / tan(beta). A line scanner does this for a whole
line of light at once. Lengths mm, angles rad.

Source: thesis "Optimierung bei der Kalibrierung von Sensor-Roboter-Systemen", HAW Hamburg 2019, section 2.2, formulas
(2-9) to (2-12), and appendix B1, the data sheet of the scanner.
"""

import numpy as np

from ..checks import as_finite, as_nonnegative, as_points, as_positive, fit_together, shown

RANGE = (190.0, 290.0)  # mm: where the scanner scanCONTROL 29xx-100 measures (B1)
LINEARITY = 0.16 / 100 * 100.0 / 3  # mm: 0.16 % of that range, printed as three standard deviations (B1)


def _triangle(alpha, beta, base):
    """The three inputs of a triangle whose rays meet above the base."""
    alpha, beta, base = as_finite(alpha, "alpha"), as_finite(beta, "beta"), as_positive(base, "base")
    fit_together(alpha=alpha.shape, beta=beta.shape, base=base.shape)
    for name, angle in (("alpha", alpha), ("beta", beta)):
        if (angle <= 0).any():
            raise ValueError(f"the rays never meet: {name} must be positive, got {shown(angle.min())} rad")
    if (alpha + beta >= np.pi).any():
        most = np.rad2deg((alpha + beta).max())
        raise ValueError(f"the rays never meet: alpha + beta must stay below 180 deg, got {shown(most)} deg")
    return alpha, beta, base


def height_from_angles(alpha, beta, base):
    """Height of an object over a base, from the angles at both its ends.

    Parameters
    ----------
    alpha, beta : array-like, rad
        Between the base and the rays to the object; less than 180 deg together.
    base : array-like, mm

    Returns
    -------
    height : array or float, mm

    Raises
    ------
    ValueError
        Rays that do not meet, a base that is not positive.

    Source: thesis, (2-12), here as L sin(alpha) sin(beta) / sin(alpha + beta): the same, also at 90 deg.
    """
    alpha, beta, base = _triangle(alpha, beta, base)
    return (base * np.sin(alpha) * np.sin(beta) / np.sin(alpha + beta))[()]


def height_derivatives(alpha, beta, base):
    """How the height changes with either angle: H^2 / (L sin^2 alpha) and H^2 / (L sin^2 beta).

    Parameters
    ----------
    alpha, beta, base
        As in `height_from_angles`.

    Returns
    -------
    by_alpha, by_beta : arrays or floats, mm per rad

    Source: the derivative of thesis (2-11), L / H = cot(alpha) + cot(beta).
    """
    alpha, beta, base = _triangle(alpha, beta, base)
    square, sines = height_from_angles(alpha, beta, base) ** 2 / base, (np.sin(alpha) ** 2, np.sin(beta) ** 2)
    as_positive(np.minimum(*sines), "the squared sine of an angle")
    return square / sines[0], square / sines[1]


def height_std(alpha, beta, base, std):
    """Standard deviation of the height when both angles err independently by `std`, to first order.

    Parameters
    ----------
    alpha, beta, base
        As in `height_from_angles`.
    std : array-like, rad
        Of each angle.

    Returns
    -------
    std : array or float, mm
    """
    by_alpha, by_beta = height_derivatives(alpha, beta, base)
    return np.hypot(by_alpha, by_beta) * as_nonnegative(std, "std")


def angles_to(place, base):
    """The angles at which both ends of a base see a place.

    Parameters
    ----------
    place : array-like, shape (..., 2), mm
        Along the base, from the end where alpha is, and above it.
    base : array-like, mm

    Returns
    -------
    alpha, beta : arrays or floats, rad
    """
    place, base = as_points(place, "place", dim=2), as_finite(base, "base")
    fit_together(place=place.shape[:-1], base=base.shape)
    return np.arctan2(place[..., 1], place[..., 0]), np.arctan2(place[..., 1], base - place[..., 0])


def place_from_angles(alpha, beta, base):
    """The place itself, along the base and above it.

    Parameters
    ----------
    alpha, beta, base
        As in `height_from_angles`.

    Returns
    -------
    place : array, shape (..., 2), mm
    """
    height, alpha = height_from_angles(alpha, beta, base), as_finite(alpha, "alpha")
    return np.stack([height * np.cos(alpha) / np.sin(alpha), height], axis=-1)
