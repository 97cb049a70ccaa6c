"""What a laser line scanner sees of a sphere: the circle through a scan line, the sphere's center from the circle.

A scan line lies in the plane y = 0 of the sensor frame S: x along the line, z along the distance, both in mm. The plane
cuts a sphere of radius R in a circle of radius r, and the center lies sqrt(R^2 - r^2) in front of the plane or behind
it: the scan line alone does not say on which side. Source: thesis "Optimierung bei der Kalibrierung von
Sensor-Roboter-Systemen", HAW Hamburg 2019, section 6.4.3, listings C15 and C16.
"""

import math
import numbers
from functools import cached_property

import numpy as np

from ..checks import (
    as_finite,
    as_nonnegative,
    as_number,
    as_points,
    as_positive,
    as_positive_number,
    as_shape,
    as_size,
    kind,
    shown,
)
from ..documented import documented
from .result import Parameter, Result, point_parameters, result_class

MIN_SAGITTA = 1e-6  # an arc flatter than this, relative to its length, fixes no circle: the points are collinear
MAX_STEPS = 200  # five are usual; where the noise is as large as the arc, each step gains a digit or less


@result_class
class Circle(Result):
    """Circle through a scan line.

    Attributes
    ----------
    center : array, shape (2,)
        x and z (mm).
    radius : float
        In mm.
    residuals : array, shape (n,)
        Signed distances of the points from the circle, positive inside (mm).
    std : float
        Of a point across the arc, given or estimated (mm); NaN without redundancy.
    covariance : array, shape (3, 3)
        Of x, z and radius (mm^2); NaN without redundancy.
    singular_values : array, shape (3,)
        Of the Jacobian, largest first.
    """

    center: np.ndarray
    radius: float
    residuals: np.ndarray
    jacobian: np.ndarray
    given_std: float | None = None

    parameters = (*point_parameters("center", "xz"), Parameter("radius", "mm"))

    @property
    def weights(self):
        return np.ones(len(self.residuals))

    @cached_property
    def std(self):
        if self.given_std is not None:
            return self.given_std
        freedom = len(self.residuals) - len(self.parameters)
        return math.sqrt(self.residuals @ self.residuals / freedom) if freedom > 0 else math.nan

    @cached_property
    def covariance(self):
        _, values, Vt = np.linalg.svd(self.jacobian, full_matrices=False)
        return self.std**2 * (Vt.T / values**2) @ Vt

    @cached_property
    def singular_values(self):
        return np.linalg.svd(self.jacobian, compute_uv=False)


@result_class
class Sphere(Circle):
    """Sphere through points: like `Circle`, with the center (3,) and the covariance (4, 4) of x, y, z and radius.

    Standard deviation and covariance are NaN where four points leave no redundancy.
    """

    parameters = (*point_parameters("center"), Parameter("radius", "mm"))


def fit_circle_algebraic(x, z):
    """Circle by the linear equations x^2 + z^2 + a1 x + a2 z + a3 = 0.

    Minimizes an algebraic error, the distance weighted by about twice the radius: quick, but on a short arc it comes
    out too small.

    Parameters
    ----------
    x, z : array-like, shape (..., n)
        Points of one scan line, or of many; n >= 3.

    Returns
    -------
    center : array, shape (..., 2)
    radius : float, or array of shape (...)

    Source: thesis, listing C15.
    """
    points = _profile(x, z)
    middle = points.mean(-2)
    p = points - middle[..., None, :]
    scale = np.abs(p).max((-2, -1))[..., None]
    p = p / scale[..., None]  # centered and scaled: the squares of 200 mm would drown those of the arc
    A = np.concatenate([p, np.ones((*p.shape[:-1], 1))], axis=-1)
    a = -np.linalg.pinv(A) @ (p * p).sum(-1)[..., None]
    a = a[..., 0]
    center = -0.5 * a[..., :2]
    radius = scale[..., 0] * np.sqrt(np.maximum((center**2).sum(-1) - a[..., 2], 0.0))
    return middle + scale * center, radius if radius.ndim else float(radius)


def fit_circle(x, z, std=None):
    """Circle by geometric least squares: minimizes the sum of squared distances of the points from the circle.

    Parameters
    ----------
    x, z : array-like, shape (n,)
        Points of the scan line, n >= 3.
    std : float, optional
        Standard deviation of a point across the arc (mm); without it the residuals give the scale of the covariance,
        which takes n >= 4.

    Returns
    -------
    Circle

    Raises
    ------
    ValueError
        When fewer than three points come, they are collinear, or the fit does not settle.

    Source: thesis, section 6.4.3, which uses the algebraic circle; the geometric one is the maximum-likelihood
    estimate.
    """
    points = _profile(x, z)
    if points.ndim != 2:
        raise ValueError(f"x and z must be one scan line, shape (n,), got {np.shape(x)}")
    center, radius = fit_circle_algebraic(x, z)
    solution, residuals, J = _geometric(points, np.append(center, radius))
    return Circle(solution[:2], float(solution[2]), residuals, J, _as_given(std))


def fit_sphere(points, std=None):
    """Sphere by geometric least squares from its algebraic start.

    Parameters
    ----------
    points : array-like, shape (n, 3), mm
        n >= 4 and not in one plane.
    std : float, optional
        Standard deviation of a point across the surface (mm).

    Returns
    -------
    Sphere

    Raises
    ------
    ValueError
        When fewer than four points come, they lie in one plane, or the fit does not settle.
    """
    points = as_points(points, "points")
    if points.ndim != 2 or len(points) < 4:
        raise ValueError(f"points must have shape (n >= 4, 3), got {points.shape}")
    middle = points.mean(0)
    scale = max(np.abs(points - middle).max(), np.finfo(float).tiny)
    p = (points - middle) / scale
    flatness = np.linalg.svd(p, compute_uv=False)
    if flatness[2] <= MIN_SAGITTA * flatness[0]:
        raise ValueError(
            "points must not lie in one plane: the third singular value is "
            f"{shown(flatness[2] / max(flatness[0], np.finfo(float).tiny), '.1e')} of the first"
        )
    a = np.linalg.lstsq(np.column_stack([p, np.ones(len(p))]), -(p * p).sum(1), rcond=None)[0]
    center = -0.5 * a[:3]
    start = np.append(middle + scale * center, scale * np.sqrt(max(center @ center - a[3], 0.0)))
    solution, residuals, J = _geometric(points, start)
    return Sphere(solution[:3], float(solution[3]), residuals, J, _as_given(std))


def center_offset(radius, circle_radius):
    """Distance of the center of a sphere from a plane that cuts it in a circle, sqrt(R^2 - r^2); broadcasts.

    Parameters
    ----------
    radius, circle_radius : array-like, mm

    Returns
    -------
    offset : float or array, mm

    Raises
    ------
    ValueError
        When the circle is larger than the sphere.

    Source: thesis, formula (6-27).
    """
    R, r = as_positive(radius, "radius"), as_positive(circle_radius, "circle_radius")
    if (r > R).any():
        raise ValueError(
            "the circle must not be larger than the sphere: "
            f"radius {shown(np.min(R))} mm, circle {shown(np.max(r), '.6g')} mm"
        )
    return np.sqrt((R - r) * (R + r))


def offset_sensitivity(radius, circle_radius):
    """How errors of R and r move the center across the plane: (dd/dR, dd/dr) = (R, -r) / d.

    Both grow without bound as the plane approaches the equator (r -> R): there a circle error of 0.01 mm is one of
    millimeters.

    Parameters
    ----------
    radius, circle_radius : array-like, mm

    Returns
    -------
    by_R, by_r : float or array, mm per mm
    """
    d = center_offset(radius, circle_radius)
    with np.errstate(divide="ignore"):
        return radius / d, -np.asarray(circle_radius, float) / d


@documented
def sphere_center_from_profile(x, z, radius, side):
    """Center of a sphere of known radius from one scan line, in the sensor frame.

    Parameters
    ----------
    x, z : array-like, shape (n,)
        Points of the scan line in the plane y = 0 (mm).
    radius : float
        Radius of the sphere (mm).
    side : {+1, -1}
        Sign of the y coordinate of the center. The scan line cannot tell: tilt the scanner and watch whether the arc
        grows.

    Returns
    -------
    center : array, shape (3,)

    Raises
    ------
    ValueError
        When side is neither +1 nor -1, or the fitted circle is larger than the sphere.

    Source: thesis, formulas (6-26) and (6-27), listing C16 (which always takes the negative side).
    """
    _refuse_side(side)
    radius, circle = as_positive_number(radius, "radius"), fit_circle(x, z)
    return np.array([circle.center[0], side * center_offset(radius, circle.radius), circle.center[1]])


def _refuse_side(side):
    if not isinstance(side, numbers.Real) or side not in (1, -1):
        got = repr(side) if isinstance(side, numbers.Real | str) else kind(side)
        raise ValueError(f"side must be +1 or -1, the sign of the center's y coordinate, got {got}")


@documented
def profile_center_covariance(radius, circle, side, std_radius=0.0):
    """First-order covariance of the center that `sphere_center_from_profile` finds.

    Parameters
    ----------
    radius : float, mm
        Of the sphere.
    circle : Circle
    side : {+1, -1}
        Sign of the y coordinate of the center.
    std_radius : float, mm
        Standard deviation of the sphere's radius.

    Returns
    -------
    covariance : array, shape (3, 3), mm^2
    """
    _refuse_side(side)
    by_R, by_r = offset_sensitivity(as_positive_number(radius, "radius"), circle.radius)
    std_radius = float(as_nonnegative(as_number(std_radius, "std_radius"), "std_radius"))
    J = np.zeros((3, 4))  # columns: circle x, z, r, sphere radius
    J[0, 0], J[2, 1], J[1, 2], J[1, 3] = 1.0, 1.0, side * by_r, side * by_R
    cov = np.zeros((4, 4))
    cov[:3, :3], cov[3, 3] = circle.covariance, std_radius**2
    return J @ cov @ J.T


@documented
def scan_line(center, radius, half_angle, n, std=0.0, rng=None):
    """Points a scanner at the origin of S measures on a sphere: the arc of the cut that faces it.

    Parameters
    ----------
    center : array-like, shape (3,)
        Center of the sphere in S (mm); |y| < radius.
    radius : float
        Its radius (mm).
    half_angle : float
        Half the angle of the arc, seen from the center of the circle (rad).
    n : int
        Number of points.
    std : float
        Noise across the arc (mm).
    rng : numpy.random.Generator, optional
        Needed for noise.

    Returns
    -------
    x, z : array, shape (n,)

    Raises
    ------
    ValueError
        Noise without a generator, a scan plane that misses the sphere.
    """
    center, half_angle, n = as_shape(center, "center", 3), as_number(half_angle, "half_angle"), as_size(n, "n")
    std = float(as_nonnegative(as_number(std, "std"), "std"))
    if std and rng is None:
        raise ValueError("rng must be given when std is not 0")
    r = np.sqrt(max(as_positive_number(radius, "radius") ** 2 - center[1] ** 2, 0.0))
    if r == 0:
        raise ValueError(
            f"the scan plane misses the sphere: |y| = {shown(abs(center[1]))} mm, radius {shown(radius)} mm"
        )
    angle = np.linspace(-half_angle, half_angle, n)
    reach = r + (std * rng.normal(size=n) if std > 0 else 0.0)
    return center[0] + reach * np.sin(angle), center[2] - reach * np.cos(angle)


def _as_given(std):
    return None if std is None else as_positive_number(std, "std")


def _profile(x, z):
    """Scan lines as points (..., n, 2); refuses other shapes, fewer than three points and collinear ones."""
    x, z = as_finite(x, "x"), as_finite(z, "z")
    if x.ndim < 1 or x.shape != z.shape or x.shape[-1] < 3:
        raise ValueError(f"x and z must have the same shape (..., n >= 3), got {x.shape} and {z.shape}")
    points = np.stack([x, z], axis=-1)
    p = points - points.mean(-2, keepdims=True)
    moments = np.swapaxes(p, -1, -2) @ p
    values = np.linalg.eigvalsh(moments)
    ratio = np.sqrt(np.maximum(values[..., 0], 0.0) / np.maximum(values[..., 1], np.finfo(float).tiny))
    if (ratio <= MIN_SAGITTA).any():
        raise ValueError(
            f"the points are collinear: they spread {shown(ratio.min(), '.1e')} times as far across their line "
            "as along it"
        )
    return points


def _geometric(points, start):
    """Gauss-Newton on center and radius with step halving: (solution, residuals, Jacobian at the solution)."""

    def linearize(q):
        d = q[:-1] - points
        length = np.linalg.norm(d, axis=1)
        J = np.column_stack([d / np.maximum(length, np.finfo(float).tiny)[:, None], -np.ones(len(points))])
        return length - q[-1], J

    q = start
    r, J = linearize(q)
    for _ in range(MAX_STEPS):
        step = np.linalg.lstsq(J, -r, rcond=None)[0]
        for _ in range(30):
            r_new, J_new = linearize(q + step)
            if r_new @ r_new <= r @ r * (1 + 1e-12):
                break
            step = step / 2
        else:
            break
        q, r, J = q + step, r_new, J_new
        if np.abs(step).max() <= 1e-12 * np.abs(q).max():
            break
    else:
        raise ValueError(
            f"the fit does not settle: after {MAX_STEPS} steps the radius is {shown(q[-1], '.6g')} and the last step "
            f"was {shown(np.abs(step).max(), '.2g')}; is the noise as large as the arc?"
        )
    return q, r, J
