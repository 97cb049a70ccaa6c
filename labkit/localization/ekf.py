"""The extended Kalman filter with landmarks, the unscented one beside it, and which landmark a reading belongs to.

Planar poses x = (x, y, theta) in m, m, rad with controls u = (v, omega) as in `odometry`; a measurement is (distance,
bearing) to each landmark, z (..., m, 2) in m and rad, NaN where a landmark was not seen.
Source: lecture "Lokalisierung", section "Lokalisierung mit einem Kalman-Filter".
"""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from ..checks import (
    as_count,
    as_covariances,
    as_points,
    as_positive_number,
    as_probability,
    as_readings,
    as_shape,
    covariance_root,
    fit_together,
)
from ..estimation.kalman import Corrected, _after, _apply, _symmetric, _t, nis
from ..geometry.planar import wrap_angle
from . import odometry


@dataclass(frozen=True)
class Localization:
    """A filtered drive: poses x (n, ..., 3), covariances (n, ..., 3, 3), NIS (n, ...), and what it counts.

    dof (n, ...): numbers measured in the step, the degrees of freedom of that step's NIS.
    """

    x: np.ndarray
    cov: np.ndarray
    nis: np.ndarray
    dof: np.ndarray


@dataclass(frozen=True)
class SimulatedRuns:
    """A simulated drive: true poses (n + 1, runs, 3), commands (n, 2), measurements (n, runs, m, 2)."""

    truth: np.ndarray
    controls: np.ndarray
    z: np.ndarray


# --- range and bearing to landmarks -----------------------------------------


def measurement(x, landmarks):
    """Distance (m) and bearing (rad, within [-pi, pi)) from the pose x to each landmark, (..., m, 2).

    Source: lecture, "Messmodell" of "Selbstlokalisierung mit Landmarken".
    """
    dx, dy, theta = _toward(x, landmarks)
    return np.stack([np.hypot(dx, dy), wrap_angle(np.arctan2(dy, dx) - theta)], axis=-1)


def measurement_jacobian(x, landmarks):
    """Derivative of `measurement` by the pose, (..., m, 2, 3).

    Raises ValueError where the robot stands on a landmark: the bearing has no value there.
    """
    dx, dy, _ = _toward(x, landmarks)
    q = dx**2 + dy**2
    if (q == 0).any():
        raise ValueError("the robot stands on a landmark: the bearing to it has no value")
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
        raise ValueError(f"z must have shape (..., {predicted.shape[-2]}, 2), one row a landmark, got {z.shape}")
    fit_together(z=z.shape[:-2], x=predicted.shape[:-2])
    seen = ~np.isnan(z - predicted)
    y = np.where(seen, z - predicted, 0.0)
    if wrap:
        y[..., 1] = wrap_angle(y[..., 1])
    return y.reshape(*y.shape[:-2], -1), seen.reshape(*seen.shape[:-2], -1)


def ekf_update(x, cov, z, landmarks, std_range, std_bearing, iterations=1, wrap=True):
    """Correct a pose with distances and bearings to known landmarks: a `Corrected` over all 2 m numbers stacked.

    Parameters
    ----------
    x : (..., 3), cov : (..., 3, 3), landmarks : (m, 2) or (..., m, 2), z : (..., m, 2), NaN where nothing was measured.
    iterations : 1 is the extended Kalman filter; more linearize again at the corrected pose (iterated filter), which is
        Gauss-Newton on prior and measurement together.
    wrap : False leaves the bearing innovation as it is, which fails as soon as it crosses +-pi.

    Source: lecture, "Algorithmus fuer erweiterten Kalman-Filter", lines 5 to 8.
    """
    prior, cov = as_points(x, "x", 3), as_covariances(cov, "cov", 3)
    std = np.array([as_positive_number(std_range, "std_range"), as_positive_number(std_bearing, "std_bearing")])
    fit_together(x=prior.shape[:-1], cov=cov.shape[:-2])
    x = prior
    for _ in range(as_count(iterations, "iterations")):
        H = measurement_jacobian(x, landmarks)
        H = H.reshape(*H.shape[:-3], -1, 3)
        y, seen = _stacked(z, measurement(x, landmarks), wrap)
        H = np.where(seen[..., None], H, 0.0)
        R = np.broadcast_to(np.tile(std**2, H.shape[-2] // 2), seen.shape)
        R = R[..., None] * np.eye(H.shape[-2])
        S = H @ cov @ _t(H) + R
        K = _t(np.linalg.solve(S, H @ cov))
        x = prior + _apply(K, y - _apply(H, prior - x))
    return Corrected(x, _symmetric(_after(cov, K, H, R)), y, S, K)


def ekf_step(x, cov, u, dt, cov_u, z, landmarks, std_range, std_bearing, model="euler", iterations=1, wrap=True):
    """One prediction and correction of the landmark filter: a `Corrected`; arguments of `propagate`, `ekf_update`."""
    x, cov = odometry.propagate(x, cov, u, dt, cov_u, model)
    return ekf_update(x, cov, z, landmarks, std_range, std_bearing, iterations, wrap)


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
    """Pose and covariance after one step from 11 points of pose and control driven through the model itself.

    The arguments are those of `odometry.propagate`; no Jacobian is needed. cov and cov_u must be positive definite.
    """
    x, cov = as_points(x, "x", 3), as_covariances(cov, "cov", 3)
    shape = x.shape[:-1]
    both = np.concatenate([x, np.broadcast_to(as_points(u, "u", 2), (*shape, 2))], axis=-1)
    joint = np.zeros((*shape, 5, 5))
    joint[..., :3, :3], joint[..., 3:, 3:] = cov, as_covariances(cov_u, "cov_u", 2)
    points, weights = _sigma_points(both, joint)
    moved = odometry.step(points[..., :3], points[..., 3:], dt, model)
    mean = weights @ moved
    spread = moved - mean[..., None, :]
    return mean, _symmetric(_t(weights[:, None] * spread) @ spread)


def unscented_update(x, cov, z, landmarks, std_range, std_bearing):
    """Correct a pose by the unscented transform: a `Corrected`; arguments as `ekf_update`."""
    x, cov = as_points(x, "x", 3), as_covariances(cov, "cov", 3)
    std_range, std_bearing = as_positive_number(std_range, "std_range"), as_positive_number(std_bearing, "std_bearing")
    points, weights = _sigma_points(x, cov)
    center = measurement(x, landmarks)
    marks = np.asarray(landmarks, dtype=float)
    h = measurement(points, marks[..., None, :, :] if marks.ndim > 2 else marks) - center[..., None, :, :]
    h[..., 1] = wrap_angle(h[..., 1])
    h = h.reshape(*h.shape[:-2], -1)
    mean = weights @ h
    y, seen = _stacked(z, center, True)
    y = np.where(seen, y - mean, 0.0)
    y[..., 1::2] = wrap_angle(y[..., 1::2])
    spread = np.where(seen[..., None, :], h - mean[..., None, :], 0.0)
    var = np.tile([std_range**2, std_bearing**2], h.shape[-1] // 2)
    S = _t(weights[:, None] * spread) @ spread + np.diag(var)
    K = _t(np.linalg.solve(S, _t(weights[:, None] * spread) @ (points - x[..., None, :])))
    return Corrected(x + _apply(K, y), _symmetric(cov - K @ S @ _t(K)), y, S, K)


# --- association and whole drives --------------------------------------------


def associate(x, cov, z, landmarks, std_range, std_bearing, by="mahalanobis", probability=0.99):
    """Index of the landmark each measurement belongs to, (k,) int, -1 where none passes the gate; x (3,), z (k, 2).

    by : "mahalanobis" compares innovations in units of their covariance; "nearest" compares in meters where the
        measured points would lie, and then gates alike. Each measurement is matched on its own.
    """
    x, z, landmarks = as_shape(x, "x", 3), as_shape(z, "z", "k", 2), as_shape(landmarks, "landmarks", "m", 2)
    std_range, std_bearing = as_positive_number(std_range, "std_range"), as_positive_number(std_bearing, "std_bearing")
    if not len(landmarks):
        raise ValueError("landmarks must hold at least one, got none")
    predicted, H = measurement(x, landmarks), measurement_jacobian(x, landmarks)
    y = z[:, None, :] - predicted[None, :, :]
    y[..., 1] = wrap_angle(y[..., 1])
    S = H @ as_covariances(cov, "cov", 3) @ _t(H) + np.diag([std_range**2, std_bearing**2])
    distance = nis(y, S)
    if by == "nearest":
        points = x[:2] + z[:, :1] * np.stack([np.cos(x[2] + z[:, 1]), np.sin(x[2] + z[:, 1])], axis=-1)
        best = np.linalg.norm(points[:, None, :] - landmarks, axis=-1).argmin(1)
    elif by == "mahalanobis":
        best = distance.argmin(1)
    else:
        raise ValueError(f'by must be "mahalanobis" or "nearest", got {by!r}')
    passed = distance[np.arange(len(z)), best] <= stats.chi2.ppf(as_probability(probability, "probability"), 2)
    return np.where(passed, best, -1)


def simulate_drive(x0, controls, dt, cov_u, landmarks, std_range, std_bearing, rng, runs, model="euler", reach=np.inf):
    """A `Drive` of `runs` robots whose controls and measurements carry Gaussian noise.

    x0 : (3,) or (runs, 3) true start.    controls : (n, 2) commands.    cov_u : (2, 2) or (n, 2, 2).
    reach : landmarks farther away (m) are not seen and measure NaN.
    """
    controls, runs = as_shape(controls, "controls", "n", 2), as_count(runs, "runs")
    std_range, std_bearing = as_positive_number(std_range, "std_range"), as_positive_number(std_bearing, "std_bearing")
    root = covariance_root(_control_covariances(cov_u, len(controls)), "cov_u")
    x0 = as_points(x0, "x0", 3)
    if x0.shape not in ((3,), (runs, 3)):
        raise ValueError(f"x0 must have shape (3,) or ({runs}, 3), got {x0.shape}")
    real = controls[:, None, :] + rng.standard_normal((len(controls), runs, 2)) @ _t(root)
    truth = odometry.drive(np.broadcast_to(x0, (runs, 3)), real, dt, model)
    z = measurement(truth[1:], landmarks)
    far = z[..., 0] > reach
    z = z + rng.standard_normal(z.shape) * [std_range, std_bearing]
    z[..., 1] = wrap_angle(z[..., 1])
    z[far] = np.nan
    return SimulatedRuns(truth, controls, z)


def _control_covariances(cov_u, n):
    cov_u = as_covariances(cov_u, "cov_u", 2)
    if cov_u.shape not in ((2, 2), (n, 2, 2)):
        raise ValueError(f"cov_u must have shape (2, 2) or ({n}, 2, 2), got {cov_u.shape}")
    return np.broadcast_to(cov_u, (n, 2, 2))
