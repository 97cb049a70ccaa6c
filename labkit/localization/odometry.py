"""Dead reckoning (*Koppelnavigation*) of a wheeled robot: motion models, their Jacobians, the growth of uncertainty.

A planar pose is x = (x, y, theta) in m, m, rad, shape (..., 3); a control is u = (v, omega) in m/s and rad/s, shape
(..., 2), held for the time step dt (s). All functions broadcast over leading axes: one call moves a robot, a thousand
particles or 200 runs. The heading is never wrapped here: a path stays continuous.
Source: lecture "Lokalisierung", section "Koppelnavigation".
"""

import numpy as np

from ..checks import (
    as_choice,
    as_covariances,
    as_finite,
    as_generator,
    as_number,
    as_points,
    as_positive,
    as_positive_number,
    as_shape,
    as_size,
    fit_together,
    shown,
)
from ..documented import documented

MODELS = ("euler", "midpoint", "arc")


def wheel_to_twist(v_left, v_right, track):
    """Control of a differential drive from the speeds of its wheels.

    Parameters
    ----------
    v_left, v_right : array-like, shape (...)
        Speeds (m/s).
    track : array-like, shape (...)
        Distance between the wheels (m).

    Returns
    -------
    u : array, shape (..., 2)
        v (m/s) and omega (rad/s).

    Source: lecture, "Wiederholung Differentialantrieb": v = (v_R + v_L) / 2, omega = (v_R - v_L) / l.
    """
    v_left, v_right, track = as_finite(v_left, "v_left"), as_finite(v_right, "v_right"), as_positive(track, "track")
    fit_together(v_left=v_left.shape, v_right=v_right.shape, track=track.shape)
    v, omega = np.broadcast_arrays((v_right + v_left) / 2, (v_right - v_left) / track)
    return np.stack([v, omega], axis=-1)


def twist_to_wheel(u, track):
    """Wheel speeds that give a control; the inverse of `wheel_to_twist`.

    Parameters
    ----------
    u : array-like, shape (..., 2)
        v (m/s) and omega (rad/s).
    track : array-like, shape (...)
        Distance between the wheels (m).

    Returns
    -------
    v_left, v_right : arrays, shape (...)
        In m/s.
    """
    u = as_points(u, "u", 2)
    half = as_positive(track, "track") / 2
    fit_together(u=u.shape[:-1], track=half.shape)
    return u[..., 0] - half * u[..., 1], u[..., 0] + half * u[..., 1]


def _inputs(x, u, dt, model):
    as_model(model)
    x, u, dt = as_points(x, "x", 3), as_points(u, "u", 2), as_positive(dt, "dt")
    fit_together(x=x.shape[:-1], u=u.shape[:-1], dt=dt.shape)
    return x, u, dt


def as_model(model):
    """`model`, one of `MODELS`."""
    return as_choice(model, "model", MODELS)


@documented
def chord(v, omega, dt, model):
    """The straight line a step is replaced by, its direction relative to the heading.

    Parameters
    ----------
    v, omega, dt : array, shape (...)
        As in `step`.
    model : {"euler", "midpoint", "arc"}

    Returns
    -------
    length, turn : arrays, shape (...)
        In m and rad.
    """
    fit_together(v=np.shape(v), omega=np.shape(omega), dt=np.shape(dt))
    half_turn = 0.5 * omega * dt
    length = v * dt
    if model == "euler":
        return length, np.zeros_like(half_turn)
    if model == "arc":
        length = length * np.sinc(half_turn / np.pi)  # the chord of the arc; sinc(0) = 1 is the straight line
    return length, half_turn


def step(x, u, dt, model="midpoint"):
    """Pose after driving with the control u for dt.

    Parameters
    ----------
    x : array-like, shape (..., 3)
        Pose (m, m, rad).
    u : array-like, shape (..., 2)
        Control (m/s, rad/s).
    dt : array-like, shape (...)
        Time step (s).
    model : {"euler", "midpoint", "arc"}
        Straight along the old heading, straight along the heading of half the turn, or along the exact circle about
        the instantaneous center of rotation. The length of the arc's chord is v dt sin(h) / h with h = omega dt / 2,
        so the straight line needs no case of its own.

    Returns
    -------
    x : array, shape (..., 3)

    Raises
    ------
    ValueError
        Wrong shapes, numbers that are not finite, a time step that is not positive, an unknown model.

    Source: lecture, "Koppelnavigation fuer Radfahrzeuge (2)" (midpoint) and "Bemerkungen" (euler, arc).
    """
    x, u, dt = _inputs(x, u, dt, model)
    length, turn = chord(u[..., 0], u[..., 1], dt, model)
    direction = x[..., 2] + turn
    parts = np.broadcast_arrays(
        x[..., 0] + length * np.cos(direction), x[..., 1] + length * np.sin(direction), x[..., 2] + u[..., 1] * dt
    )
    return np.stack(parts, axis=-1)


def step_jacobians(x, u, dt, model="midpoint"):
    """Derivatives of `step`, which has the parameters, by the pose and by the control.

    Returns
    -------
    F_x, F_u : arrays, shapes (..., 3, 3) and (..., 3, 2)

    Source: lecture, "Berechnung der Jacobi-Matrizen" (for the model "euler"); the others by the product rule.
    """
    x, u, dt = _inputs(x, u, dt, model)
    length, turn = chord(u[..., 0], u[..., 1], dt, model)
    length, turn, v, omega, theta, dt = np.broadcast_arrays(length, turn, u[..., 0], u[..., 1], x[..., 2], dt)
    cos, sin = np.cos(theta + turn), np.sin(theta + turn)
    F_x = np.zeros((*cos.shape, 3, 3))
    F_x[..., 0, 0] = F_x[..., 1, 1] = F_x[..., 2, 2] = 1.0
    F_x[..., 0, 2], F_x[..., 1, 2] = -length * sin, length * cos

    by_v = dt * np.sinc(turn / np.pi) if model == "arc" else dt
    turn_by_omega = 0.0 if model == "euler" else dt / 2
    length_by_omega = v * dt * sinc_slope(turn) * turn_by_omega if model == "arc" else 0.0
    F_u = np.zeros((*cos.shape, 3, 2))
    F_u[..., 0, 0], F_u[..., 1, 0], F_u[..., 2, 1] = by_v * cos, by_v * sin, dt
    F_u[..., 0, 1] = length_by_omega * cos - length * sin * turn_by_omega
    F_u[..., 1, 1] = length_by_omega * sin + length * cos * turn_by_omega
    return F_x, F_u


@documented
def sinc_slope(h):
    """Derivative of sin(h) / h, with its series where h is small.

    Parameters
    ----------
    h : array, any shape

    Returns
    -------
    array of the same shape
    """
    small = np.abs(h) < 1e-2
    safe = np.where(small, 1.0, h)
    return np.where(small, h * (-1 / 3 + h**2 * (1 / 30 - h**2 / 840)), (np.cos(safe) - np.sin(safe) / safe) / safe)


def turning_center(x, u):
    """Instantaneous center of rotation (ICR): it lies v / omega to the left of the heading.

    Parameters
    ----------
    x, u : array-like, shapes (..., 3) and (..., 2)
        Pose (m, m, rad) and control (m/s, rad/s).

    Returns
    -------
    center : array, shape (..., 2)
        In m.

    Raises
    ------
    ValueError
        Where omega is zero: a straight line has none.
    """
    x, u = as_points(x, "x", 3), as_points(u, "u", 2)
    fit_together(x=x.shape[:-1], u=u.shape[:-1])
    if (u[..., 1] == 0).any():
        raise ValueError("omega must not be zero: a robot on a straight line has no center of rotation")
    radius = u[..., 0] / u[..., 1]
    parts = np.broadcast_arrays(x[..., 0] - radius * np.sin(x[..., 2]), x[..., 1] + radius * np.cos(x[..., 2]))
    return np.stack(parts, axis=-1)


def control_covariance(u, dt, k_d, k_theta, k_drift):
    """Covariance of a control by the lecture's error model, which counts variance per way.

    The variances k_d |v| / dt and (k_theta |omega| + k_drift |v|) / dt grow as dt shrinks, so that the variance
    of the way after a given time does not depend on dt. Reversing and right turns count with their absolute values.

    Parameters
    ----------
    u : array-like, shape (..., 2)
        Control (m/s, rad/s).
    dt : array-like, shape (...)
        Time step (s).
    k_d : float
        Variance of the distance per meter driven (m^2 / m).
    k_theta : float
        Variance of the heading per radian turned (rad^2 / rad).
    k_drift : float
        Variance of the heading per meter driven (rad^2 / m).

    Returns
    -------
    cov_u : array, shape (..., 2, 2)
        In (m/s)^2 and (rad/s)^2.

    Raises
    ------
    ValueError
        Wrong shapes, a negative constant.

    Source: lecture, "Fehlermodell fuer Steuerbefehl (1) to (3)".
    """
    u, dt = as_points(u, "u", 2), as_positive(dt, "dt")
    for name, value in (("k_d", k_d), ("k_theta", k_theta), ("k_drift", k_drift)):
        if as_number(value, name) < 0:
            raise ValueError(f"{name} must not be negative (it is a variance per way), got {shown(value)}")
    fit_together(u=u.shape[:-1], dt=dt.shape)
    v, omega = np.abs(u[..., 0]), np.abs(u[..., 1])
    var_v, var_omega = np.broadcast_arrays(k_d * v / dt, (k_theta * omega + k_drift * v) / dt)
    cov = np.zeros((*var_v.shape, 2, 2))
    cov[..., 0, 0], cov[..., 1, 1] = var_v, var_omega
    return cov


def propagate(x, cov, u, dt, cov_u, model="midpoint"):
    """Pose and covariance after one step, to first order: F_x cov F_x' + F_u cov_u F_u'.

    Parameters
    ----------
    x, u, dt, model
        As in `step`.
    cov : array-like, shape (..., 3, 3)
        Covariance of the pose before.
    cov_u : array-like, shape (..., 2, 2)
        Covariance of the control.

    Returns
    -------
    x, cov : arrays, shapes (..., 3) and (..., 3, 3)

    Source: lecture, "Fehlerfortpflanzung bei Koppelnavigation (2)".
    """
    cov, cov_u = as_covariances(cov, "cov", 3), as_covariances(cov_u, "cov_u", 2)
    F_x, F_u = step_jacobians(x, u, dt, model)
    fit_together(cov=cov.shape[:-2], cov_u=cov_u.shape[:-2], pose_and_control=F_x.shape[:-2])
    after = F_x @ cov @ np.swapaxes(F_x, -1, -2) + F_u @ cov_u @ np.swapaxes(F_u, -1, -2)
    return step(x, u, dt, model), 0.5 * (after + np.swapaxes(after, -1, -2))


def drive(x0, controls, dt, model="midpoint"):
    """Poses along a drive.

    Parameters
    ----------
    x0 : array-like, shape (..., 3)
        Start (m, m, rad).
    controls : array-like, shape (n, ..., 2)
        One control (m/s, rad/s) per time step.
    dt : float
        Time step (s).
    model : {"euler", "midpoint", "arc"}
        As in `step`.

    Returns
    -------
    poses : array, shape (n + 1, ..., 3)
        The start included.

    Raises
    ------
    ValueError
        Controls that are no pairs.
    """
    controls = as_points(controls, "controls", 2)
    if controls.ndim < 2:
        raise ValueError(f"controls must have shape (n, ..., 2), got {controls.shape}")
    dt = as_positive_number(dt, "dt")
    x0 = as_points(x0, "x0", 3)
    path = np.empty((len(controls) + 1, *fit_together(x0=x0.shape[:-1], controls=controls.shape[1:-1]), 3))
    path[0] = x0
    for k, u in enumerate(controls):
        path[k + 1] = step(path[k], u, dt, model)
    return path


def drive_with_covariance(x0, cov0, controls, dt, k_d, k_theta, k_drift, model="midpoint"):
    """Poses and covariances along a drive with the lecture's error model.

    Parameters
    ----------
    x0, cov0 : array-like, shapes (3,) and (3, 3)
        Start (m, m, rad) and its covariance.
    controls, dt, model
        As in `drive`, one robot.
    k_d, k_theta, k_drift : float
        As in `control_covariance`.

    Returns
    -------
    poses, covs : arrays, shapes (n + 1, 3) and (n + 1, 3, 3)
    """
    controls = as_shape(controls, "controls", "n", 2)
    cov_u = control_covariance(controls, as_positive_number(dt, "dt"), k_d, k_theta, k_drift)
    poses, covs = [as_shape(x0, "x0", 3)], [as_shape(as_covariances(cov0, "cov0", 3), "cov0", 3, 3)]
    for u, noise in zip(controls, cov_u):
        x, cov = propagate(poses[-1], covs[-1], u, dt, noise, model)
        poses.append(x)
        covs.append(cov)
    return np.array(poses), np.array(covs)


def noisy_controls(controls, dt, k_d, k_theta, k_drift, rng, runs):
    """Controls as many robots really execute them, each with its own noise.

    Parameters
    ----------
    controls : array-like, shape (n, 2)
        Commands (m/s, rad/s).
    dt, k_d, k_theta, k_drift
        As in `control_covariance`.
    rng : numpy.random.Generator
    runs : int
        Number of robots.

    Returns
    -------
    controls : array, shape (n, runs, 2)
    """
    controls, runs = as_shape(controls, "controls", "n", 2), as_size(runs, "runs")
    as_size(len(controls) * runs, "the number of controls of all runs", at_least=0)
    cov_u = control_covariance(controls, as_positive_number(dt, "dt"), k_d, k_theta, k_drift)
    std = np.sqrt(np.diagonal(cov_u, axis1=-2, axis2=-1))
    noisy = as_generator(rng).standard_normal((len(controls), runs, 2))
    noisy *= std[:, None, :]  # in place: ten thousand robots make arrays of megabytes, which a kernel would keep
    noisy += controls[:, None, :]
    return noisy


def sample_drives(x0, controls, dt, k_d, k_theta, k_drift, rng, runs, model="midpoint"):
    """Paths of many robots given the same commands, each with its own noise.

    The parameters are those of `drive` and `noisy_controls`.

    Returns
    -------
    poses : array, shape (n + 1, runs, 3)
    """
    return drive(x0, noisy_controls(controls, dt, k_d, k_theta, k_drift, rng, runs), dt, model)
