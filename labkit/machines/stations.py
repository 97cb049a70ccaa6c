"""Base stations that sweep planes of light: a delay becomes an angle, two angles a ray, rays a place, diodes a pose.

A station L flashes; with the flash a plane of light that holds its y axis starts to turn about that axis, from -90 deg,
and half a turn later one that holds its x axis does the same about x. A photodiode at (x, y, z) in L, z pointing into
the room, is hit at the angles alpha = atan2(x, z) and beta = atan2(y, z), and the time since the flash tells which.
One station sees the direction of a diode; two find its place, and a handful of diodes on a rigid body its pose. The
angles mean something only while the stations stand where the software believes. Lengths mm, angles rad, times s.

Source: report "Kalibrace a testovani systemu OTUS tracker", ZCU Plzen 2018, section 1 (the principle) and conclusion
(the clamping). It prints no rate: 60 turns a second are those of the first generation of these stations, an assumption.
"""

from functools import cached_property

import numpy as np

from ..calibration.result import Result, pose_parameters, result_class
from ..checks import as_finite, as_points, as_positive_number, as_shape, as_transforms, fit_together, shown
from ..documented import documented
from ..geometry.frames import invert, moved, pose, transform, unit_vector
from ..geometry.lie import exp_so3, skew

TURN_RATE = 60.0  # turns per second, of a station of the first generation: assumed, see above
MAX_STEPS, STEP_TOLERANCE = 30, 1e-10  # Gauss-Newton; rad, and mm divided by the distance
MIN_PARALLAX = 1e-6  # smallest singular value of a place beside the largest: below, all rays are one line
DIODES = 45.0 * unit_vector(
    np.array(
        [[1, 0, 0.2], [0.3, 0.95, 0.2], [-0.8, 0.6, 0.2], [-0.8, -0.6, 0.2], [0.3, -0.95, 0.2]]
        + [[0.5, 0.4, 0.8], [-0.6, 0.1, 0.8], [0.2, -0.6, 0.8], [0, 0, 1]]
    )
)  # mm in E: nine on a dome of 90 mm; the report prints the body's size (102 x 88 x 98 mm), not where its diodes sit


def looking(position, at):
    """Pose of a station that looks at a point, its x axis level and its y axis pointing down.

    Parameters
    ----------
    position, at : array-like, shape (3,), mm
        In W, whose z axis points up; the line between them must not be vertical.

    Returns
    -------
    T_WL : array, shape (4, 4)
    """
    position, at = as_shape(position, "position", 3), as_shape(at, "at", 3)
    z = unit_vector(at - position)
    x = unit_vector(np.cross(z, [0.0, 0.0, 1.0]))
    return pose(np.column_stack([x, np.cross(z, x), z]), position)


STATIONS = np.array(
    [looking(position, (250.0, 0.0, 450.0)) for position in ((1800.0, -1900.0, 1700.0), (1900.0, 1700.0, 1700.0))]
)  # T_WL of two stations 3.6 m apart that look down at a robot in the origin of W


# ---- a sweep, a ray, a place -----------------------------------------------------------------------------------------


def sweep_angle(delay, rate=TURN_RATE):
    """Angle at which a plane of light hits, from the time since the flash.

    Parameters
    ----------
    delay : array-like, shape (...), s
        From 0, the plane at -90 deg, to half a turn.
    rate : float, Hz
        Turns per second.

    Returns
    -------
    angle : array, shape (...), rad
        0 straight ahead, after a quarter of a turn.

    Raises
    ------
    ValueError
        A delay of less than nothing or more than half a turn.

    Source: report, section 1.
    """
    delay, rate = as_finite(delay, "delay"), as_positive_number(rate, "rate")
    wrong = (delay < 0) | (delay > 0.5 / rate)
    if wrong.any():
        raise ValueError(f"delay must be 0 to {shown(0.5 / rate)} s, half a turn, got {shown(delay[wrong].flat[0])}")
    return 2 * np.pi * rate * delay - np.pi / 2


def sweep_delay(angle, rate=TURN_RATE):
    """Time since the flash at which a plane of light is at an angle: `sweep_angle` solved for the delay."""
    return (as_finite(angle, "angle") + np.pi / 2) / (2 * np.pi * as_positive_number(rate, "rate"))


def station_angles(T_WL, points):
    """Angles at which stations see points.

    Parameters
    ----------
    T_WL : array-like, shape (..., 4, 4)
        Poses of the stations.
    points : array-like, shape (..., 3), mm
        In W; the leading axes broadcast.

    Returns
    -------
    angles : array, shape (..., 2), rad
        alpha, of the plane through the station's y axis, and beta, of that through its x axis.

    Raises
    ------
    ValueError
        A point that is not in front of the station.
    """
    return _angles(_seen(T_WL, points))


def _seen(T_WL, points):
    """Points in the frames of the stations, (..., 3), all of them in front."""
    p = transform(invert(as_transforms(T_WL, "T_WL")), as_points(points, "points"))
    if (p[..., 2] <= 0).any():
        raise ValueError(f"points must lie in front of the station (z > 0), got z = {shown(p[..., 2].min())} mm")
    return p


def _angles(p):
    return np.arctan2(p[..., :2], p[..., 2:])


def ray_direction(angles):
    """Direction in which a station sees what its two planes hit at these angles.

    The first plane holds the y axis and (sin alpha, 0, cos alpha), the second the x axis and (0, sin beta, cos beta);
    they meet in the ray.

    Parameters
    ----------
    angles : array-like, shape (..., 2), rad
        alpha and beta, between -90 and 90 deg.

    Returns
    -------
    direction : array, shape (..., 3)
        Of length 1, in the frame of the station.

    Raises
    ------
    ValueError
        An angle of 90 deg or more.
    """
    angles = as_points(angles, "angles", dim=2)
    if (np.abs(angles) >= np.pi / 2).any():
        raise ValueError(f"angles must lie between -90 and 90 deg, got {shown(np.rad2deg(np.abs(angles).max()))}")
    return unit_vector(np.concatenate([np.tan(angles), np.ones_like(angles[..., :1])], axis=-1))


def nearest_to_rays(origins, directions):
    """Point with the least sum of squared distances to rays.

    The distance to ray i is |(I - d_i d_i')(p - o_i)|, so sum (I - d_i d_i') p = sum (I - d_i d_i') o_i.

    Parameters
    ----------
    origins : array-like, shape (n, 3), mm
    directions : array-like, shape (n, 3)
        Not all parallel; their length does not matter.

    Returns
    -------
    p : array, shape (3,), mm

    Raises
    ------
    ValueError
        Fewer than two rays, or all parallel within 1e-6.
    """
    origins = as_shape(origins, "origins", "n", 3)
    d = unit_vector(as_shape(directions, "directions", len(origins), 3))
    across = np.eye(3) - d[:, :, None] * d[:, None, :]
    N = across.sum(0)
    if len(d) < 2 or np.linalg.eigvalsh(N)[0] < 1e-12 * len(d):
        raise ValueError(f"at least two rays that are not parallel must come, got {len(d)}")
    return np.linalg.solve(N, (across @ origins[..., None]).sum(0))[:, 0]


def angle_jacobian(T_WL, points):
    """Derivative of `station_angles` by the points.

    Parameters
    ----------
    T_WL : array-like, shape (..., 4, 4)
    points : array-like, shape (..., 3), mm

    Returns
    -------
    J : array, shape (..., 2, 3), rad/mm
    """
    p = _seen(T_WL, points)
    x, y, z = np.moveaxis(p, -1, 0)
    J = np.zeros((*p.shape[:-1], 2, 3))
    J[..., 0, 0], J[..., 0, 2] = z / (x * x + z * z), -x / (x * x + z * z)
    J[..., 1, 1], J[..., 1, 2] = z / (y * y + z * z), -y / (y * y + z * z)
    return J @ np.swapaxes(np.asarray(T_WL, float)[..., :3, :3], -1, -2)


def place_covariance(T_WL, point, std_angle):
    """Covariance of a place found from the angles of several stations, to first order.

    Parameters
    ----------
    T_WL : array-like, shape (n, 4, 4)
        Poses of n >= 2 stations.
    point : array-like, shape (3,), mm
    std_angle : float, rad
        Standard deviation of each angle.

    Returns
    -------
    covariance : array, shape (3, 3), mm^2

    Raises
    ------
    ValueError
        When all stations see the point along one line.
    """
    T_WL, point = as_shape(T_WL, "T_WL", "n", 4, 4), as_shape(point, "point", 3)
    J = angle_jacobian(T_WL, point).reshape(-1, 3)
    values = np.linalg.svd(J, compute_uv=False)
    if len(values) < 3 or values[2] < MIN_PARALLAX * values[0]:
        raise ValueError("the stations see the point along one line: its distance is not determined")
    return as_positive_number(std_angle, "std_angle") ** 2 * np.linalg.inv(J.T @ J)


# ---- a body with diodes ----------------------------------------------------------------------------------------------


@result_class
class Sighting(Result):
    """Pose of a body with diodes from the angles of its stations.

    Attributes
    ----------
    T_WE : array, shape (4, 4)
        The body (mm).
    T_WL : array, shape (n, 4, 4)
        The stations, as they are believed to stand.
    diodes : array, shape (m, 3), mm
        In E.
    angles : array, shape (n, m, 2), rad
    residuals : array, shape (n, m, 2), rad
        Measured less predicted.
    weights : array, shape (2 n m,)
        1 for each angle.
    given_std : float or None
        Standard deviation of an angle (rad), where it was given.
    std : float, rad
        The same, as given or as the residuals have it, unbiased; NaN when six angles leave nothing to judge by.
    covariance : array, shape (6, 6)
        Of the rotation vector (rad, about the axes of E) and the translation (mm, in W).
    singular_values : array, shape (6,)
        Of the Jacobian with its columns scaled to length 1, largest first.
    """

    T_WE: np.ndarray
    T_WL: np.ndarray
    diodes: np.ndarray
    angles: np.ndarray
    given_std: float | None = None

    parameters = pose_parameters("T_WE")

    @cached_property
    def _system(self):
        return _body_system(self.T_WL, self.diodes, self.T_WE)

    @cached_property
    def residuals(self):
        return self.angles - self._system[0]

    @cached_property
    def weights(self):
        return np.ones(self.angles.size)

    @cached_property
    def std(self):
        if self.given_std is not None:
            return self.given_std
        freedom = self.angles.size - len(self.parameters)
        return float(np.sqrt((self.residuals**2).sum() / freedom)) if freedom > 0 else np.nan

    @cached_property
    def covariance(self):
        J = self._system[1].reshape(-1, 6)
        return self.std**2 * np.linalg.inv(J.T @ J)

    @cached_property
    def singular_values(self):
        J = self._system[1].reshape(-1, 6)
        return np.linalg.svd(J / np.linalg.norm(J, axis=0), compute_uv=False)


def _body_system(T_WL, diodes, T_WE):
    """Angles of all diodes, (..., n, m, 2), and their Jacobian by the pose, (..., n, m, 2, 6)."""
    points = transform(T_WE[..., None, :, :], diodes)[..., None, :, :]
    stations = T_WL[:, None]
    by_point = angle_jacobian(stations, points)
    by_turn = -T_WE[..., None, None, :3, :3] @ skew(diodes)
    return _angles(_seen(stations, points)), np.concatenate([by_point @ by_turn, by_point], axis=-1)


def body_angles(T_WL, diodes, T_WE):
    """Angles at which stations see the diodes of a body.

    Parameters
    ----------
    T_WL : array-like, shape (n, 4, 4)
    diodes : array-like, shape (m, 3), mm
        In E.
    T_WE : array-like, shape (..., 4, 4)

    Returns
    -------
    angles : array, shape (..., n, m, 2), rad
    """
    T_WL, diodes = as_shape(T_WL, "T_WL", "n", 4, 4), as_shape(diodes, "diodes", "m", 3)
    points = transform(as_transforms(T_WE, "T_WE")[..., None, :, :], diodes)[..., None, :, :]
    return station_angles(T_WL[:, None], points)


def poses_from_angles(T_WL, diodes, angles, start):
    """Poses of a body from the angles of its diodes, by Gauss-Newton on all angles at once.

    Parameters
    ----------
    T_WL : array-like, shape (n, 4, 4)
        Stations as they are believed to stand; one is enough for three diodes and more.
    diodes : array-like, shape (m, 3), mm
        In E.
    angles : array-like, shape (..., n, m, 2), rad
    start : array-like, shape (..., 4, 4)
        Where to begin: a pose known from before, or from `nearest_to_rays`.

    Returns
    -------
    T_WE : array, shape (..., 4, 4)

    Raises
    ------
    ValueError
        Wrong shapes, fewer than three diodes, iterations that do not settle.
    """
    T_WL, diodes = as_shape(T_WL, "T_WL", "n", 4, 4), as_shape(diodes, "diodes", "m", 3)
    angles, T = as_finite(angles, "angles"), as_transforms(start, "start").copy()
    if len(diodes) < 3:
        raise ValueError(f"at least three diodes fix a pose, got {len(diodes)}")
    if not T.size:
        raise ValueError(f"start must hold at least one pose, got shape {T.shape}")
    if angles.shape != (*T.shape[:-2], len(T_WL), len(diodes), 2):
        raise ValueError(f"angles must have shape (..., {len(T_WL)}, {len(diodes)}, 2), got {angles.shape}")
    size = np.linalg.norm(T_WL[:, :3, 3], axis=-1).max()
    for _ in range(MAX_STEPS):
        predicted, J = _body_system(T_WL, diodes, T)
        J = J.reshape(*T.shape[:-2], -1, 6) * np.repeat([1.0, size], 3)
        r = (angles - predicted).reshape(*T.shape[:-2], -1, 1)
        Jt = np.swapaxes(J, -1, -2)
        step = _solved(Jt @ J, Jt @ r)[..., 0]
        T = moved(T, step * np.repeat([1.0, size], 3))
        if np.abs(step).max(initial=0.0) < STEP_TOLERANCE:
            return T
    raise ValueError(f"the pose did not settle within {MAX_STEPS} steps: is the start too far off?")


def _solved(N, right):
    try:
        return np.linalg.solve(N, right)
    except np.linalg.LinAlgError:
        raise ValueError("the angles do not fix the pose: are the diodes on one line?") from None


@documented
def sight(T_WL, diodes, angles, start, std=None):
    """One pose with its covariance; the parameters are those of `poses_from_angles`, for a single body.

    Parameters
    ----------
    T_WL, diodes, angles, start : arrays, shapes (n, 4, 4), (m, 3), (n, m, 2), (4, 4)
    std : float, rad, optional
        Standard deviation of an angle; estimated from the residuals unless given.

    Returns
    -------
    Sighting
    """
    T = poses_from_angles(T_WL, diodes, angles, start)
    return Sighting(T, T_WL, diodes, angles, None if std is None else as_positive_number(std, "std"))


# ---- stations that do not stay ---------------------------------------------------------------------------------------


def tilted(T_WL, rotation, shift=(0.0, 0.0, 0.0)):
    """Stations that have turned about their own axes, and been shifted.

    Parameters
    ----------
    T_WL : array-like, shape (..., 4, 4)
    rotation : array-like, shape (..., 3), rad
        Rotation vectors in the frames of the stations.
    shift : array-like, shape (..., 3), mm
        In the frames of the stations.

    Returns
    -------
    T_WL : array, shape (..., 4, 4)
    """
    T_WL, turned = as_transforms(T_WL, "T_WL"), pose(exp_so3(rotation), as_points(shift, "shift"))
    fit_together(T_WL=T_WL.shape[:-2], rotation_and_shift=turned.shape[:-2])
    return T_WL @ turned


def last_turned(T_WL, turns):
    """Stations at each of several readings, the last of them turned about its own axes.

    Parameters
    ----------
    T_WL : array-like, shape (n, 4, 4)
        Where they are believed to stand.
    turns : array-like, shape (k, 3), rad
        Rotation vector of the last station at each reading.

    Returns
    -------
    T_WL : array, shape (k, n, 4, 4)
        As `read_poses` takes them.
    """
    T_WL, turns = as_shape(T_WL, "T_WL", "n", 4, 4), as_shape(turns, "turns", "k", 3)
    actual = np.repeat(T_WL[None], len(turns), axis=0)
    actual[:, -1] = tilted(actual[:, -1], turns)
    return actual


@documented
def read_poses(T_WE, believed, actual, rng, std_angle=0.0, diodes=DIODES):
    """What a tracker reports when its stations stand elsewhere than it believes.

    Parameters
    ----------
    T_WE : array-like, shape (k, 4, 4)
        Where the tracker is.
    believed : array-like, shape (n, 4, 4)
        Stations as the software knows them.
    actual : array-like, shape (n, 4, 4) or (k, n, 4, 4)
        Stations as they stand, the same for all readings or one set a reading.
    rng : numpy.random.Generator
    std_angle : float, rad
        Noise of an angle.
    diodes : array-like, shape (m, 3), mm

    Returns
    -------
    T_WE : array, shape (k, 4, 4)

    Raises
    ------
    ValueError
        Stations of another number than believed.
    """
    T_WE, believed = as_shape(T_WE, "T_WE", "k", 4, 4), as_shape(believed, "believed", "n", 4, 4)
    actual = as_transforms(actual, "actual")
    if actual.shape not in (believed.shape, (len(T_WE), *believed.shape)):
        raise ValueError(
            f"actual must have the shape of believed, {believed.shape}, or one more axis of {len(T_WE)} "
            f"readings, got {actual.shape}"
        )
    actual = np.broadcast_to(actual, (len(T_WE), *believed.shape))
    points = transform(T_WE[:, None], diodes)[:, None]
    angles = station_angles(actual[:, :, None], points)
    angles = angles + float(std_angle) * rng.normal(size=angles.shape)
    return poses_from_angles(believed, diodes, angles, T_WE)
