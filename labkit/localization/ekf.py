"""The extended Kalman filter with landmarks, the unscented one beside it, and which landmark a reading belongs to.

Planar poses x = (x, y, theta) in m, m, rad with controls u = (v, omega) as in `odometry`; a measurement is (distance,
bearing) to each landmark, z (..., m, 2) in m and rad, NaN where a landmark was not seen.
Source: lecture "Lokalisierung", section "Lokalisierung mit einem Kalman-Filter".
"""

from dataclasses import dataclass

import numpy as np

from ..checks import (
    as_covariances,
    as_points,
    as_positive_number,
    as_probability,
    as_readings,
    as_shape,
    as_size,
    as_truth,
    covariance_root,
    fit_together,
    solve_covariance,
)
from ..documented import documented
from ..estimation.gaussian import chi_square_quantile
from ..estimation.kalman import Corrected, _after, _apply, _symmetric, _t, nis
from ..geometry.planar import wrap_angle
from . import odometry


@dataclass(frozen=True, eq=False)
class Localization:
    """A filtered drive, one robot or many.

    Attributes
    ----------
    x : array, shape (n, ..., 3)
        Corrected poses (m, m, rad).
    cov : array, shape (n, ..., 3, 3)
    nis : array, shape (n, ...)
        Normalized innovation squared of each step.
    dof : array of int, shape (n, ...)
        How many numbers were measured in the step, the degrees of freedom of its NIS.
    """

    x: np.ndarray
    cov: np.ndarray
    nis: np.ndarray
    dof: np.ndarray


@dataclass(frozen=True, eq=False)
class SimulatedRuns:
    """Many robots on the same commands.

    Attributes
    ----------
    truth : array, shape (n + 1, runs, 3)
        True poses, the start included.
    controls : array, shape (n, 2)
        Commands.
    z : array, shape (n, runs, m, 2)
        Measurements, NaN where a landmark was not seen.
    """

    truth: np.ndarray
    controls: np.ndarray
    z: np.ndarray


ON_LANDMARK = "the robot stands on a landmark: the bearing to it has no value"


# --- range and bearing to landmarks -----------------------------------------


def measurement(x, landmarks):
    """Distance (m) and bearing (rad, within [-pi, pi)) from a pose to each landmark.

    Parameters
    ----------
    x : array-like, shape (..., 3)
        Pose (m, m, rad).
    landmarks : array-like, shape (m, 2) or (..., m, 2)
        Positions (m).

    Returns
    -------
    z : array, shape (..., m, 2)

    Source: lecture, "Messmodell" of "Selbstlokalisierung mit Landmarken".
    """
    dx, dy, theta = _toward(x, landmarks)
    return np.stack([np.hypot(dx, dy), wrap_angle(np.arctan2(dy, dx) - theta)], axis=-1)


def measurement_jacobian(x, landmarks):
    """Derivative H of `measurement` by the pose; the parameters are those of `measurement`.

    Returns
    -------
    H : array, shape (..., m, 2, 3)

    Raises
    ------
    ValueError
        Where the robot stands on a landmark: the bearing has no value there.
    """
    dx, dy, _ = _toward(x, landmarks)
    q = dx**2 + dy**2
    if (q == 0).any():
        raise ValueError(ON_LANDMARK)
    r = np.sqrt(q)
    H = np.zeros((*q.shape, 2, 3))
    H[..., 0, 0], H[..., 0, 1] = -dx / r, -dy / r
    H[..., 1, 0], H[..., 1, 1], H[..., 1, 2] = dy / q, -dx / q, -1.0
    return H


def _toward(x, landmarks):
    x, landmarks = as_points(x, "x", 3), as_points(landmarks, "landmarks", 2)
    if landmarks.ndim < 2:
        raise ValueError(f"landmarks must have shape (..., m, 2), got {landmarks.shape}")
    fit_together(x=x.shape[:-1], landmarks=landmarks.shape[:-2])
    away = landmarks - x[..., None, :2]
    return away[..., 0], away[..., 1], x[..., 2, None]


def _stacked(z, predicted, wrap):
    """Innovations (..., 2 m), with NaN for what was not measured replaced by 0, and the mask of what was."""
    z = as_readings(z, "z")
    if z.shape[-2:] != predicted.shape[-2:]:
        raise ValueError(f"z must have shape (..., {predicted.shape[-2]}, 2), one row per landmark, got {z.shape}")
    fit_together(z=z.shape[:-2], x=predicted.shape[:-2])
    seen = ~np.isnan(z - predicted)
    y = np.where(seen, z - predicted, 0.0)
    if as_truth(wrap, "wrap"):
        y[..., 1] = wrap_angle(y[..., 1])
    shape = (*y.shape[:-2], 2 * y.shape[-2])
    return y.reshape(shape), seen.reshape(shape)


def ekf_update(x, cov, z, landmarks, std_range, std_bearing, iterations=1, wrap=True):
    """Correct a pose with distances and bearings to known landmarks.

    Parameters
    ----------
    x : array-like, shape (..., 3)
        Predicted pose (m, m, rad).
    cov : array-like, shape (..., 3, 3)
        Its covariance.
    z : array-like, shape (..., m, 2)
        Distance (m) and bearing (rad) to each landmark, NaN where nothing was measured.
    landmarks : array-like, shape (m, 2) or (..., m, 2)
        Positions (m).
    std_range, std_bearing : float
        Standard deviations of distance (m) and bearing (rad).
    iterations : int
        1 is the extended Kalman filter; more linearize again at the corrected pose (iterated filter), which is
        Gauss-Newton on prior and measurement together.
    wrap : bool
        False leaves the bearing innovation as it is, which fails as soon as it crosses +-pi.

    Returns
    -------
    Corrected
        Innovation and gain over all 2 m numbers stacked; `dof` counts those that were measured.

    Raises
    ------
    ValueError
        Wrong shapes, numbers that are not finite, a robot that stands on a landmark.

    Source: lecture, "Algorithmus fuer erweiterten Kalman-Filter", lines 5 to 8.
    """
    prior, cov = as_points(x, "x", 3), as_covariances(cov, "cov", 3)
    std = np.array([as_positive_number(std_range, "std_range"), as_positive_number(std_bearing, "std_bearing")])
    fit_together(x=prior.shape[:-1], cov=cov.shape[:-2])
    x = prior
    for _ in range(as_size(iterations, "iterations")):
        H = measurement_jacobian(x, landmarks)
        H = H.reshape(*H.shape[:-3], 2 * H.shape[-3], 3)
        y, seen = _stacked(z, measurement(x, landmarks), wrap)
        H = np.where(seen[..., None], H, 0.0)
        R = np.tile(std**2, H.shape[-2] // 2) * np.eye(H.shape[-2])
        S = H @ cov @ _t(H) + R
        K = _t(solve_covariance(S, "the covariance of the innovation", H @ cov))
        x = prior + _apply(K, y - _apply(H, prior - x))
    return Corrected(x, _symmetric(_after(cov, K, H, R)), y, S, K, seen.sum(-1))


def ekf_step(
    x, cov, u, dt, cov_u, z, landmarks, std_range, std_bearing, model="euler", iterations=1, wrap=True, cov_v=None
):
    """One prediction and one correction of the landmark filter.

    Parameters
    ----------
    x, cov, u, dt, cov_u, model
        As in `odometry.propagate`.
    z, landmarks, std_range, std_bearing, iterations, wrap
        As in `ekf_update`.
    cov_v : array-like, shape (..., 3, 3), optional
        Noise of the motion beside the control's.

    Returns
    -------
    Corrected

    Source: lecture, "Algorithmus fuer erweiterten Kalman-Filter".
    """
    x, cov = odometry.propagate(x, cov, u, dt, cov_u, model)
    if cov_v is not None:
        cov_v = as_covariances(cov_v, "cov_v", 3)
        fit_together(cov=cov.shape[:-2], cov_v=cov_v.shape[:-2])
        cov = cov + cov_v
    return ekf_update(x, cov, z, landmarks, std_range, std_bearing, iterations, wrap)


@dataclass(frozen=True, eq=False)
class _Given:
    """Checked arguments of `ekf_localize`; x0 and cov0 once per run, cov_u once per step."""

    u: np.ndarray
    z: np.ndarray
    landmarks: np.ndarray
    x0: np.ndarray
    cov0: np.ndarray
    dt: float
    std_range: float
    std_bearing: float
    cov_u: np.ndarray
    cov_v: np.ndarray
    model: str
    wrap: bool


def _given(u, z, landmarks, x0, cov0, dt, std_range, std_bearing, cov_u, cov_v, model, wrap):
    u, landmarks, z = as_points(u, "u", 2), as_shape(landmarks, "landmarks", "m", 2), as_readings(z, "z")
    if u.ndim not in (2, 3):
        raise ValueError(f"u must have shape (n, 2) or (n, runs, 2), got {u.shape}")
    n, m = len(u), len(landmarks)
    model = odometry.as_model(model)
    if z.ndim not in (3, 4) or z.shape[0] != n or z.shape[-2:] != (m, 2):
        raise ValueError(
            f"z must have shape ({n}, {m}, 2) or ({n}, runs, {m}, 2) for {n} controls and {m} landmarks, got {z.shape}"
        )
    if (np.isnan(z[..., 0]) != np.isnan(z[..., 1])).any():
        raise ValueError("z must be finite, or NaN in both numbers of a landmark that was not seen")
    runs = z.shape[1:-2]
    x0, cov0 = as_points(x0, "x0", 3), as_covariances(cov0, "cov0", 3)
    for name, got in (("u", u.shape[1:-1]), ("x0", x0.shape[:-1]), ("cov0", cov0.shape[:-2])):
        if got not in ((), runs):
            raise ValueError(f"{name} must come once for all runs or once per run as z, {runs}, got leading axes {got}")
    cov_v = np.zeros((3, 3)) if cov_v is None else as_shape(as_covariances(cov_v, "cov_v", 3), "cov_v", 3, 3)
    return _Given(
        u, z, landmarks, np.broadcast_to(x0, (*runs, 3)), _symmetric(np.broadcast_to(cov0, (*runs, 3, 3))),
        as_positive_number(dt, "dt"), as_positive_number(std_range, "std_range"),
        as_positive_number(std_bearing, "std_bearing"),
        _control_covariances(np.zeros((2, 2)) if cov_u is None else cov_u, n), _symmetric(cov_v), model,
        as_truth(wrap, "wrap"),
    )  # fmt: skip


def ekf_localize(
    u, z, landmarks, x0, cov0, dt, std_range, std_bearing, cov_u=None, cov_v=None, model="euler", wrap=True
):
    """The landmark filter along a whole drive, one robot or many at once: `ekf_step` after `ekf_step`.

    Parameters
    ----------
    u : array-like, shape (n, 2) or (n, runs, 2)
        Commands (m/s, rad/s); step k moves with u[k] and then corrects with z[k].
    z : array-like, shape (n, m, 2) or (n, runs, m, 2)
        Distance (m) and bearing (rad) to each landmark, NaN in both where it was not seen.
    landmarks : array-like, shape (m, 2)
        Positions (m).
    x0 : array-like, shape (3,) or (runs, 3)
        Pose before the first step (m, m, rad).
    cov0 : array-like, shape (3, 3) or (runs, 3, 3)
        Its covariance.
    dt : float
        Time step (s).
    std_range, std_bearing : float
        Standard deviations of distance (m) and bearing (rad).
    cov_u : array-like, shape (2, 2) or (n, 2, 2), optional
        Covariance of the control; none by default.
    cov_v : array-like, shape (3, 3), optional
        Noise of the motion per step beside the control's.
    model : {"euler", "midpoint", "arc"}
        As in `odometry.step`.
    wrap : bool
        As in `ekf_update`.

    Returns
    -------
    Localization

    Raises
    ------
    ValueError
        Wrong shapes, numbers that are not finite, a landmark seen by half, a robot that stands on a landmark.

    See Also
    --------
    labkit.fast.ekf.ekf_localize : the same, many times as fast.

    Source: lecture, "Algorithmus fuer erweiterten Kalman-Filter".
    """
    given = _given(u, z, landmarks, x0, cov0, dt, std_range, std_bearing, cov_u, cov_v, model, wrap)
    x, cov, shape = given.x0, given.cov0, (len(given.u), *given.x0.shape[:-1])
    found = Localization(np.empty((*shape, 3)), np.empty((*shape, 3, 3)), np.empty(shape), np.empty(shape, int))
    sensor = {"landmarks": given.landmarks, "std_range": given.std_range, "std_bearing": given.std_bearing}
    for k, (u, cov_u, z) in enumerate(zip(given.u, given.cov_u, given.z)):
        step = ekf_step(x, cov, u, given.dt, cov_u, z, **sensor, model=model, wrap=wrap, cov_v=given.cov_v)
        x, cov = step.x, step.cov
        found.x[k], found.cov[k], found.nis[k], found.dof[k] = x, cov, step.nis, step.dof
    return found


# --- the unscented filter ----------------------------------------------------


def _sigma_points(x, cov):
    """Points (..., 2 n + 1, n) at the mean and at +- the columns of the root of 3 cov, and their weights (2 n + 1,)."""
    n = x.shape[-1]
    columns = _t(covariance_root(3 * cov, "the covariance"))
    points = np.concatenate([x[..., None, :], x[..., None, :] + columns, x[..., None, :] - columns], axis=-2)
    weights = np.full(2 * n + 1, 1 / 6)
    weights[0] = (3 - n) / 3
    return points, weights


def unscented_predict(x, cov, u, dt, cov_u, model="euler"):
    """Pose and covariance after one step, from 11 points of pose and control driven through the model itself.

    No Jacobian is needed; cov and cov_u must be positive definite.

    Parameters
    ----------
    x, cov, u, dt, cov_u, model
        As in `odometry.propagate`.

    Returns
    -------
    x, cov : arrays, shapes (..., 3) and (..., 3, 3)

    Raises
    ------
    ValueError
        Wrong shapes, numbers that are not finite, a covariance that is not positive definite.
    """
    x, cov = as_points(x, "x", 3), as_covariances(cov, "cov", 3)
    u, cov_u = as_points(u, "u", 2), as_covariances(cov_u, "cov_u", 2)
    shape = fit_together(x=x.shape[:-1], cov=cov.shape[:-2], u=u.shape[:-1], cov_u=cov_u.shape[:-2])
    both = np.concatenate([np.broadcast_to(x, (*shape, 3)), np.broadcast_to(u, (*shape, 2))], axis=-1)
    joint = np.zeros((*shape, 5, 5))
    joint[..., :3, :3], joint[..., 3:, 3:] = cov, cov_u
    points, weights = _sigma_points(both, joint)
    moved = odometry.step(points[..., :3], points[..., 3:], dt, model)
    mean = weights @ moved
    spread = moved - mean[..., None, :]
    return mean, _symmetric(_t(weights[:, None] * spread) @ spread)


def unscented_update(x, cov, z, landmarks, std_range, std_bearing):
    """Correct a pose by sending seven points through the measurement itself (unscented transform).

    Parameters
    ----------
    x, cov, z, landmarks, std_range, std_bearing
        As in `ekf_update`; cov must be positive definite.

    Returns
    -------
    Corrected

    Raises
    ------
    ValueError
        As `ekf_update`, and where cov is not positive definite.
    """
    x, cov = as_points(x, "x", 3), as_covariances(cov, "cov", 3)
    std_range, std_bearing = as_positive_number(std_range, "std_range"), as_positive_number(std_bearing, "std_bearing")
    x = np.broadcast_to(x, (*fit_together(x=x.shape[:-1], cov=cov.shape[:-2]), 3))
    points, weights = _sigma_points(x, cov)
    center = measurement(x, landmarks)
    marks = np.asarray(landmarks, dtype=float)
    h = measurement(points, marks[..., None, :, :] if marks.ndim > 2 else marks) - center[..., None, :, :]
    h[..., 1] = wrap_angle(h[..., 1])
    h = h.reshape(*h.shape[:-2], 2 * h.shape[-2])
    mean = weights @ h
    y, seen = _stacked(z, center, True)
    y = np.where(seen, y - mean, 0.0)
    y[..., 1::2] = wrap_angle(y[..., 1::2])
    spread = np.where(seen[..., None, :], h - mean[..., None, :], 0.0)
    var = np.tile([std_range**2, std_bearing**2], h.shape[-1] // 2)
    S = _t(weights[:, None] * spread) @ spread + np.diag(var)
    cross = _t(weights[:, None] * spread) @ (points - x[..., None, :])
    K = _t(solve_covariance(S, "the covariance of the innovation", cross))
    return Corrected(x + _apply(K, y), _symmetric(cov - K @ S @ _t(K)), y, S, K, seen.sum(-1))


# --- association and simulated drives ----------------------------------------


@documented
def associate(x, cov, z, landmarks, std_range, std_bearing, by="mahalanobis", probability=0.99):
    """Index of the landmark each measurement belongs to; each is matched on its own.

    Parameters
    ----------
    x, cov : array-like, shapes (3,) and (3, 3)
        Pose (m, m, rad) and its covariance.
    z : array-like, shape (k, 2)
        Distances (m) and bearings (rad) to unknown landmarks.
    landmarks : array-like, shape (m, 2)
        Positions (m).
    std_range, std_bearing : float
        Standard deviations of distance (m) and bearing (rad).
    by : {"mahalanobis", "nearest"}
        Compare innovations in units of their covariance, or in meters where the measured points would lie.
    probability : float
        Share of honest measurements that pass the gate: chi-square with two degrees of freedom.

    Returns
    -------
    index : array of int, shape (k,)
        -1 where none passes the gate.

    Raises
    ------
    ValueError
        Wrong shapes, no landmark, a pose on a landmark.
    """
    x, z, landmarks = as_shape(x, "x", 3), as_shape(z, "z", "k", 2), as_shape(landmarks, "landmarks", "m", 2)
    std_range, std_bearing = as_positive_number(std_range, "std_range"), as_positive_number(std_bearing, "std_bearing")
    if not len(landmarks):
        raise ValueError("landmarks must hold at least one, got none")
    predicted, H = measurement(x, landmarks), measurement_jacobian(x, landmarks)
    y = z[:, None, :] - predicted[None, :, :]
    y[..., 1] = wrap_angle(y[..., 1])
    cov = as_shape(as_covariances(cov, "cov", 3), "cov", 3, 3)
    S = H @ cov @ _t(H) + np.diag([std_range**2, std_bearing**2])
    distance = nis(y, S)
    if by == "nearest":
        points = x[:2] + z[:, :1] * np.stack([np.cos(x[2] + z[:, 1]), np.sin(x[2] + z[:, 1])], axis=-1)
        best = np.linalg.norm(points[:, None, :] - landmarks, axis=-1).argmin(1)
    else:
        best = distance.argmin(1)
    passed = distance[np.arange(len(z)), best] <= chi_square_quantile(as_probability(probability, "probability"), 2)
    return np.where(passed, best, -1)


@documented
def simulate_drive(x0, controls, dt, cov_u, landmarks, std_range, std_bearing, rng, runs, model="euler", reach=np.inf):
    """Drives of many robots on the same commands, their controls and measurements with Gaussian noise.

    Parameters
    ----------
    x0 : array-like, shape (3,) or (runs, 3)
        True start (m, m, rad).
    controls : array-like, shape (n, 2)
        Commands (m/s, rad/s).
    dt : float
        Time step (s).
    cov_u : array-like, shape (2, 2) or (n, 2, 2)
        Covariance of the control, positive definite.
    landmarks : array-like, shape (m, 2)
        Positions (m).
    std_range, std_bearing : float
        Standard deviations of distance (m) and bearing (rad).
    rng : numpy.random.Generator
    runs : int
        Number of robots.
    model : {"euler", "midpoint", "arc"}
        As in `odometry.step`.
    reach : float
        Landmarks farther away (m) are not seen and measure NaN.

    Returns
    -------
    SimulatedRuns

    Raises
    ------
    ValueError
        Wrong shapes, a covariance that is not positive definite.
    """
    controls, runs = as_shape(controls, "controls", "n", 2), as_size(runs, "runs")
    std_range, std_bearing = as_positive_number(std_range, "std_range"), as_positive_number(std_bearing, "std_bearing")
    root = covariance_root(_control_covariances(cov_u, len(controls)), "cov_u")
    x0 = as_points(x0, "x0", 3)
    if x0.shape not in ((3,), (runs, 3)):
        raise ValueError(f"x0 must have shape (3,) or ({runs}, 3), got {x0.shape}")
    real = controls[:, None, :] + rng.standard_normal((len(controls), runs, 2)) @ _t(root)
    truth = odometry.drive(np.broadcast_to(x0, (runs, 3)), real, dt, model)
    z = measurement(truth[1:], landmarks)
    far = z[..., 0] > reach
    noise = rng.standard_normal(z.shape)
    noise *= [std_range, std_bearing]
    z += noise
    z[..., 1] = wrap_angle(z[..., 1])
    z[far] = np.nan
    return SimulatedRuns(truth, controls, z)


def _control_covariances(cov_u, n):
    cov_u = as_covariances(cov_u, "cov_u", 2)
    if cov_u.shape not in ((2, 2), (n, 2, 2)):
        raise ValueError(f"cov_u must have shape (2, 2) or ({n}, 2, 2), got {cov_u.shape}")
    return np.broadcast_to(cov_u, (n, 2, 2))
