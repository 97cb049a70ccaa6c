"""Kalman filters: the lecture's linear filter, its steady state, the extended filter with landmarks, and their checks.

States are (..., n), covariances (..., n, n); everything that is not a time loop broadcasts over leading axes. The
landmark filter works on planar poses x = (x, y, theta) in m, m, rad with controls u = (v, omega) as in `odometry`; a
measurement is (distance, bearing) to each landmark, z (..., m, 2) in m and rad, NaN where a landmark was not seen.
Source: lecture "Lokalisierung", section "Lokalisierung mit einem Kalman-Filter".
"""

import itertools
import math
from dataclasses import dataclass, fields

import numpy as np
from scipy import linalg, signal, stats

from . import odometry
from .checks import (
    as_count,
    as_covariances,
    as_finite,
    as_matrices,
    as_number,
    as_points,
    as_positive,
    as_positive_number,
    as_probability,
    as_readings,
    as_shape,
    covariance_root,
    fit_together,
    solve_covariance,
)
from .odometry import wrap_angle
from .tables import read_table

FORMS = ("joseph", "short")
SETTLED = 1e-13  # relative change of a gain below which the time-invariant filter counts as settled


@dataclass(frozen=True)
class Corrected:
    """A correction: state x (..., n), covariance, innovation z - C x with its covariance, and the gain (..., n, m)."""

    x: np.ndarray
    cov: np.ndarray
    innovation: np.ndarray
    cov_innovation: np.ndarray
    gain: np.ndarray


@dataclass(frozen=True)
class SteadyState:
    """Where a time-invariant filter settles: gain (n, m), covariance before and after a correction (n, n)."""

    gain: np.ndarray
    cov_before: np.ndarray
    cov_after: np.ndarray


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
class Drive:
    """A simulated drive: true poses (n + 1, runs, 3), commands (n, 2), measurements (n, runs, m, 2)."""

    truth: np.ndarray
    controls: np.ndarray
    z: np.ndarray


def _t(M):
    return M.swapaxes(-1, -2)


def _apply(M, x):
    return (M @ x[..., None])[..., 0]


def _state(x):
    x = as_finite(x, "x")
    if x.ndim < 1:
        raise ValueError("x must have shape (..., n), got a single number")
    return x, x.shape[-1]


def _symmetric(cov):
    return 0.5 * (cov + _t(cov))


# --- the linear filter -------------------------------------------------------


def vehicle_model(dt):
    """Matrices (A, B, C) of the lecture's vehicle: state (position, velocity), control acceleration, position measured.

    B = (0, dt)' is the lecture's; a constant acceleration over dt would also move the position, by dt^2 / 2.
    Source: lecture, "Beispiel: bewegtes Fahrzeug (1)" and "(2)".
    """
    dt = as_positive_number(dt, "dt")
    return np.array([[1.0, dt], [0.0, 1.0]]), np.array([[0.0], [dt]]), np.array([[1.0, 0.0]])


def predict(x, cov, A, B=None, u=None, cov_u=None, cov_v=None):
    """State and covariance one time step later: (A x + B u, A cov A' + B cov_u B' + cov_v).

    Parameters
    ----------
    x : (..., n), cov : (..., n, n), A : (..., n, n), B : (..., n, k), u : (..., k), cov_u : (..., k, k) of the control.
    cov_v : (..., n, n) of further system noise; the lecture has none beside the control's.

    Source: lecture, "Algorithmus fuer linearen Kalman-Filter", lines 2 and 3.
    """
    x, n = _state(x)
    A, cov = as_matrices(A, "A", n, n), as_matrices(cov, "cov", n, n)
    push, spread = _driven(n, B, u, cov_u, cov_v)
    leading = {"x": x.shape[:-1], "cov": cov.shape[:-2], "A": A.shape[:-2]}
    fit_together(**leading, u=np.shape(push)[:-1], cov_u_and_cov_v=np.shape(spread)[:-2])
    return _predicted(x, cov, A, push, spread)


def _predicted(x, cov, A, push, spread):
    return _apply(A, x) + push, _symmetric(A @ cov @ _t(A) + spread)


def _driven(n, B, u, cov_u, cov_v):
    """What a step adds to the state, B u, and to its covariance, B cov_u B' + cov_v."""
    push, spread = 0.0, 0.0
    if B is not None:
        B = as_finite(B, "B")
        k = B.shape[-1] if B.ndim > 1 else 0
        if B.shape[-2:] != (n, k) or not k:
            raise ValueError(f"B must have shape (..., {n}, k), got {B.shape}")
        if u is not None:
            push = _apply(B, as_points(u, "u", k))
        if cov_u is not None:
            spread = B @ as_covariances(cov_u, "cov_u", k) @ _t(B)
    elif u is not None or cov_u is not None:
        raise ValueError("u and cov_u act through B, but B is missing")
    return push, spread if cov_v is None else spread + as_covariances(cov_v, "cov_v", n)


def update(x, cov, z, C, cov_z, form="joseph", dtype=float):
    """Correct a prediction with the measurement z = C x + noise: a `Corrected`.

    Parameters
    ----------
    x : (..., n), cov : (..., n, n), C : (..., m, n), cov_z : (..., m, m).
    z : (..., m), or None for a time step without measurement: the prediction is returned as it is.
    form : "joseph" (I - K C) cov (I - K C)' + K cov_z K', symmetric and positive for every gain, or the lecture's
        "short" (I - K C) cov.
    dtype : float or numpy.float32, to see what single precision does to either form.

    Source: lecture, "Algorithmus fuer linearen Kalman-Filter", lines 5 to 8, and the remark on missing measurements.
    """
    if form not in FORMS:
        raise ValueError(f"form must be one of {', '.join(FORMS)}, got {form!r}")
    x, n = _state(x)
    x = x.astype(dtype)
    cov = as_matrices(cov, "cov", n, n).astype(dtype)  # the short form may have spoiled it: that is to be seen
    C = _measured_by(C, n).astype(dtype)
    m = C.shape[-2]
    cov_z = as_covariances(cov_z, "cov_z", m).astype(dtype)
    z = None if z is None else as_points(z, "z", m).astype(dtype)
    leading = {"x": x.shape[:-1], "cov": cov.shape[:-2], "C": C.shape[:-2], "cov_z": cov_z.shape[:-2]}
    fit_together(**leading, z=() if z is None else z.shape[:-1])
    return _corrected(x, cov, z, C, cov_z, form)


def _measured_by(C, n):
    C = as_finite(C, "C")
    if C.shape[-1:] != (n,) or C.ndim < 2:
        raise ValueError(f"C must have shape (..., m, {n}), got {C.shape}")
    return C


def _corrected(x, cov, z, C, cov_z, form="joseph"):
    PCt = cov @ _t(C)
    S = C @ PCt + cov_z
    if z is None:
        return Corrected(x, cov, np.zeros_like(S[..., 0]), S, np.zeros_like(PCt))
    innovation = z - _apply(C, x)
    K = _t(solve_covariance(S, "C cov C' + cov_z", _t(PCt)))
    return Corrected(x + _apply(K, innovation), _after(cov, K, C, cov_z, form), innovation, S, K)


def filter_steps(z, A, C, cov_z, x0, cov0, B=None, u=None, cov_u=None, cov_v=None):
    """The linear filter along a series: each step predicts as in `predict`, then corrects as in `update`.

    Parameters
    ----------
    z : (steps, m), a row of NaN where nothing was measured; x0 : (n,), cov0 : (n, n) before the first step. The others
    as in `predict` and `update`, the same in every step.

    Returns a `Corrected` whose arrays have the steps as their first axis; innovation and gain are zero where
    nothing was measured.
    """
    x = as_shape(np.atleast_1d(as_finite(x0, "x0")), "x0", "n")
    n = len(x)
    A, C, cov = as_matrices(A, "A", n, n), _measured_by(C, n), as_covariances(cov0, "cov0", n)
    cov_z, z = as_matrices(cov_z, "cov_z", len(C), len(C)), as_readings(z, "z")
    if z.ndim != 2 or z.shape[1] != len(C):
        raise ValueError(f"z must have shape (steps, {len(C)}), got {z.shape}")
    missing = np.isnan(z).all(axis=1)
    z = as_finite(np.where(missing[:, None], 0.0, z), "z")
    push, spread = _driven(n, B, u, cov_u, cov_v)
    steps = []
    for value, nothing in zip(z, missing):
        x, cov = _predicted(x, cov, A, push, spread)
        step = _corrected(x, cov, None if nothing else value, C, cov_z)
        x, cov = step.x, step.cov
        steps.append(step)
    return Corrected(*(np.array([getattr(step, field.name) for step in steps]) for field in fields(Corrected)))


def _after(cov, K, C, cov_z, form="joseph"):
    keep = np.eye(cov.shape[-1], dtype=cov.dtype) - K @ C
    if form == "short":
        return keep @ cov
    return keep @ cov @ _t(keep) + K @ cov_z @ _t(K)


def steady_state(A, C, cov_v, cov_z):
    """Gain and covariances of a time-invariant filter after many steps, from the discrete Riccati equation.

    Raises ValueError where the equation has no stabilizing solution (a mode is neither measured nor stable).
    """
    A, C = as_shape(A, "A", "n", "n"), as_shape(C, "C", "m", "n")
    n, m = len(A), len(C)
    A, C = as_shape(A, "A", n, n), as_shape(C, "C", m, n)
    cov_v = as_shape(as_covariances(cov_v, "cov_v", n), "cov_v", n, n)
    cov_z = as_shape(as_covariances(cov_z, "cov_z", m), "cov_z", m, m)
    try:
        before = linalg.solve_discrete_are(A.T, C.T, cov_v, cov_z)
    except np.linalg.LinAlgError as error:
        raise ValueError(f"the filter has no steady state: {error}") from None
    gain = np.linalg.solve(C @ before @ C.T + cov_z, C @ before).T
    return SteadyState(gain, before, _after(before, gain, C, cov_z))


def filter_series(z, A, C, cov_v, cov_z, x0, cov0):
    """Filtered states of a time-invariant filter with one number measured a step; z (n,) or (n, 1) -> (n, states).

    The gains do not depend on the data. They are computed until they settle; from there on the filter is a linear
    recursion with constant coefficients, which `scipy.signal.lfilter` runs in compiled code. Each step predicts, then
    corrects.
    """
    n = len(as_shape(A, "A", "n", "n"))
    A, cov_v = as_shape(A, "A", n, n), as_shape(as_covariances(cov_v, "cov_v", n), "cov_v", n, n)
    C, r = as_finite(C, "C").reshape(-1), as_positive(cov_z, "cov_z").reshape(-1)
    z = as_finite(z, "z")
    if z.ndim > 2 or (z.ndim == 2 and z.shape[1] != 1) or r.shape != (1,) or C.shape != (n,):
        raise ValueError(
            f"filter_series expects one number a step and n = {n} states, got z {z.shape}, C {C.shape}, cov_z {r.shape}"
        )
    z = z.reshape(-1)
    x0, cov0 = as_shape(x0, "x0", n), as_shape(as_covariances(cov0, "cov0", n), "cov0", n, n)
    if not len(z):
        return np.empty((0, n))
    start = _until_settled_2 if n == 2 else _until_settled
    out, gain = start(z, A, C, cov_v, float(r[0]), x0, cov0)
    done = len(out)
    if done == len(z):
        return np.array(out)
    return _steady_run(z, A, C, gain, np.array(out))


def _until_settled(z, A, C, cov_v, r, x, cov):
    """Steps until the gain stands still, at least n of them: (states, gain)."""
    out, old = [], np.inf
    for value in z:
        x, cov = A @ x, A @ cov @ A.T + cov_v
        gain = cov @ C / (C @ cov @ C + r)
        x = x + gain * (value - C @ x)
        cov = _symmetric(_after(cov, gain[:, None], C[None, :], np.array([[r]])))
        out.append(x)
        if len(out) >= len(A) and np.abs(gain - old).max() <= SETTLED * np.abs(gain).max():
            break
        old = gain
    return out, gain


def _until_settled_2(z, A, C, cov_v, r, x, cov):
    """`_until_settled` for two states, written out: ten times faster than arrays of four numbers."""
    (a, b), (c, d) = A.tolist()
    h0, h1 = C.tolist()
    (q00, q01), (_, q11) = cov_v.tolist()
    (p00, p01), (_, p11) = cov.tolist()
    x0, x1 = x.tolist()
    out, k0, k1 = [], math.inf, math.inf
    for value in itertools.chain.from_iterable(z[k : k + 256].tolist() for k in range(0, len(z), 256)):
        x0, x1 = a * x0 + b * x1, c * x0 + d * x1
        m00, m01, m10, m11 = a * p00 + b * p01, a * p01 + b * p11, c * p00 + d * p01, c * p01 + d * p11
        p00, p01, p11 = m00 * a + m01 * b + q00, m00 * c + m01 * d + q01, m10 * c + m11 * d + q11
        g0, g1 = p00 * h0 + p01 * h1, p01 * h0 + p11 * h1
        s = h0 * g0 + h1 * g1 + r
        l0, l1 = g0 / s, g1 / s
        e = value - h0 * x0 - h1 * x1
        x0, x1 = x0 + l0 * e, x1 + l1 * e
        p00, p01, p11 = p00 - l0 * g0, p01 - l0 * g1, p11 - l1 * g1
        out.append((x0, x1))
        if len(out) >= 2 and abs(l0 - k0) + abs(l1 - k1) <= SETTLED * (abs(l0) + abs(l1)):
            break
        k0, k1 = l0, l1
    return out, np.array([l0, l1])


def _steady_run(z, A, C, gain, out):
    """The recursion x = M x + gain z with M = (I - gain C) A, continued by one filter of order n a state."""
    n, done = len(A), len(out)
    M = (np.eye(n) - np.outer(gain, C)) @ A
    # Leverrier: the denominator det(I - M q) and the numerators adj(I - M q) gain
    a, numerators, power = np.zeros(n + 1), np.zeros((n, n + 1)), np.eye(n)
    a[0] = 1.0
    for k in range(1, n + 1):
        numerators[:, k - 1] = power @ gain
        power = M @ power
        a[k] = -np.trace(power) / k
        power = power + a[k] * np.eye(n)
    states = np.empty((len(z), n))
    states[:done] = out
    for i, numerator in enumerate(numerators):
        past_z, past_x = z[done - n : done][::-1], out[done - n : done, i][::-1]
        memory = [numerator[k:] @ past_z[: n + 1 - k] - a[k:] @ past_x[: n + 1 - k] for k in range(1, n + 1)]
        states[done:, i] = signal.lfilter(numerator, a, z[done:], zi=memory)[0]
    return states


# --- the lecture's worked examples -------------------------------------------


def example(name):
    """Printed numbers of a worked example as {name: value}; name is "fusion" or "vehicle" (see data/kalman)."""
    if name not in ("fusion", "vehicle"):
        raise ValueError(f'name must be "fusion" or "vehicle", got {name!r}')
    table = read_table(f"kalman/{name}.csv", text=("name", "unit"))
    return dict(zip(table["name"].tolist(), table["value"].tolist()))


def predict_vehicle(steps, dt, var_x0, var_v0, var_a, acceleration=1.0):
    """State (2,) and covariance (2, 2) of the lecture's vehicle after `steps` predictions from rest, none corrected."""
    A, B, _ = vehicle_model(dt)
    names = ("var_x0", "var_v0", "var_a", "acceleration")
    var_x0, var_v0, var_a, acceleration = map(as_number, (var_x0, var_v0, var_a, acceleration), names)
    x, cov = np.zeros(2), np.diag([var_x0, var_v0])
    for _ in range(as_count(steps, "steps", at_least=0)):
        x, cov = predict(x, cov, A, B, u=[acceleration], cov_u=[[var_a]])
    return x, cov


def reconstruct_vehicle(cov, steps, dt):
    """Variances (var_x0, var_v0, var_a) with which `steps` uncorrected predictions lead to the covariance, (3,).

    The covariance is linear in the three and has three entries, so for every number of steps and every time step there
    is exactly one answer. It is possible only where none of the three is negative; steps and dt themselves remain free.
    """
    cov, steps = as_shape(as_covariances(cov, "cov", 2), "cov", 2, 2), as_count(steps, "steps", at_least=2)
    basis = [predict_vehicle(steps, dt, *row)[1] for row in np.eye(3)]
    entries = np.array([[P[0, 0], P[0, 1], P[1, 1]] for P in basis]).T
    return np.linalg.solve(entries, [cov[0, 0], cov[0, 1], cov[1, 1]])


# --- consistency -------------------------------------------------------------


def nees(truth, x, cov, angle=None):
    """Normalized estimation error squared, error' cov^-1 error, (...); `angle` is the index of a state to wrap."""
    truth, x = as_finite(truth, "truth"), as_finite(x, "x")
    fit_together(truth=truth.shape, x=x.shape)
    error = truth - x
    if angle is not None:
        if angle not in range(-error.shape[-1], error.shape[-1]):
            raise ValueError(f"angle must be the index of one of {error.shape[-1]} states, got {angle!r}")
        error[..., angle] = wrap_angle(error[..., angle])
    return _squared(error, cov, "cov")


def nis(innovation, cov_innovation):
    """Normalized innovation squared, innovation' S^-1 innovation, (...): the check that needs no truth."""
    return _squared(as_finite(innovation, "innovation"), cov_innovation, "cov_innovation")


def _squared(e, cov, name):
    if e.ndim < 1:
        raise ValueError("an error must have shape (..., n), got a single number")
    cov = as_covariances(cov, name, e.shape[-1])
    fit_together(**{"the errors": e.shape[:-1], name: cov.shape[:-2]})
    return (e * solve_covariance(cov, name, e[..., None])[..., 0]).sum(-1)


def mean_band(dof, runs, probability=0.99):
    """Limits (low, high) between which the mean NEES or NIS of `runs` independent runs lies with that probability."""
    dof, runs = as_count(dof, "dof"), as_count(runs, "runs")
    tail = 0.5 * (1 - as_probability(probability, "probability"))
    return tuple(stats.chi2.ppf([tail, 1 - tail], dof * runs) / runs)


def gate(innovation, cov_innovation, probability=0.99):
    """Whether an innovation is plausible: its NIS lies below the chi-square quantile of its dimension; (...) bool."""
    innovation = as_finite(innovation, "innovation")
    squared = nis(innovation, cov_innovation)
    return squared <= stats.chi2.ppf(as_probability(probability, "probability"), innovation.shape[-1])


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
    return Drive(truth, controls, z)


@dataclass(frozen=True)
class Course:
    """A drive past landmarks with all its settings; `simulate` drives it, `localize` filters what was measured.

    controls (n, 2), dt (s), cov_u (2, 2), landmarks (m, 2), std_range (m), std_bearing (rad), x0 (3,), cov0 (3, 3).
    """

    controls: np.ndarray
    dt: float
    cov_u: np.ndarray
    landmarks: np.ndarray
    std_range: float
    std_bearing: float
    x0: np.ndarray
    cov0: np.ndarray

    def simulate(self, rng, runs, **more):
        """A `Drive` of many robots, each with its own start drawn from x0 and cov0; options as `simulate_drive`."""
        start = self.x0 + rng.standard_normal((runs, 3)) @ np.linalg.cholesky(self.cov0).T
        noise = (self.cov_u, self.landmarks, self.std_range, self.std_bearing)
        return simulate_drive(start, self.controls, self.dt, *noise, rng, runs, **more)

    def localize(self, drive, **changes):
        """The `Localization` of a drive by a filter that believes the course, but for the `changes`."""
        believed = {"cov_u": self.cov_u, "std_range": self.std_range, "std_bearing": self.std_bearing} | changes
        return ekf_localize(drive.controls, drive.z, self.landmarks, self.x0, self.cov0, self.dt, **believed)


def circle_course(marks=4, steps=300):
    """The lecture's circle of chapter 7 past one to four landmarks, a `Course`; sensor and start are ours.

    The lecture shows such a drive ("Beispielfahrt mit einer Landmarke") without its numbers.
    """
    marks, steps, circle = as_count(marks, "marks"), as_count(steps, "steps"), odometry.circle_drive()
    cov_u = odometry.control_covariance(circle.controls[0], circle.dt, **circle.noise)
    landmarks = np.array([[5.0, 5.0], [-4.0, 5.5], [-4.5, -1.0], [4.5, -1.5]])[:marks]
    cov0 = np.diag([0.1**2, 0.1**2, np.radians(3) ** 2])
    controls = np.tile(circle.controls[0], (steps, 1))
    return Course(controls, circle.dt, cov_u, landmarks, 0.1, np.radians(1), np.zeros(3), cov0)


def ekf_localize(
    u, z, landmarks, x0, cov0, dt, std_range, std_bearing, cov_u=None, cov_v=None, model="euler", wrap=True
):
    """Extended Kalman filter along a whole drive, one robot or many at once: a `Localization`.

    Parameters
    ----------
    u : (n, 2), or (n, runs, 2), commands; step k moves with u[k] and then corrects with z[k].
    z : (n, m, 2) or (n, runs, m, 2), NaN where nothing was measured.    landmarks : (m, 2).
    x0 : (3,) or (runs, 3).    cov0 : (3, 3) or (runs, 3, 3).
    cov_u : (2, 2) or (n, 2, 2) noise of the control, uncorrelated as in the lecture.    cov_v : (3, 3) further noise.

    The correction is in information form: with W = sum H' R^-1 H over the landmarks, cov = prior (I + W prior)^-1. It
    equals the lecture's gain form for independent measurements, and inverts one 3 x 3 matrix whatever their number.
    """
    u, landmarks, z = as_points(u, "u", 2), as_shape(landmarks, "landmarks", "m", 2), as_readings(z, "z")
    if u.ndim not in (2, 3):
        raise ValueError(f"u must have shape (n, 2) or (n, runs, 2), got {u.shape}")
    m = len(landmarks)
    if model not in ("euler", "midpoint"):
        raise ValueError(f"model must be one of euler, midpoint, got {model!r}")
    if z.ndim not in (3, 4) or z.shape[0] != len(u) or z.shape[-2:] != (m, 2):
        raise ValueError(
            f"z must have shape ({len(u)}, {m}, 2) or ({len(u)}, runs, {m}, 2) for {len(u)} controls and {m} "
            f"landmarks, got {z.shape}"
        )
    if (np.isnan(z[..., 0]) != np.isnan(z[..., 1])).any():
        raise ValueError("z must be finite, or NaN in both numbers of a landmark that was not seen")
    runs = z.shape[1:-2]
    x0, cov0 = as_points(x0, "x0", 3), as_covariances(cov0, "cov0", 3)
    for name, got in (("u", u.shape[1:-1]), ("x0", x0.shape[:-1]), ("cov0", cov0.shape[:-2])):
        if got not in ((), runs):
            raise ValueError(f"{name} must come once for all runs or once a run as z, {runs}, got leading axes {got}")
    x0, cov0 = np.broadcast_to(x0, (*runs, 3)), np.broadcast_to(cov0, (*runs, 3, 3))
    var_u = np.zeros((len(u), 2)) if cov_u is None else _control_variances(cov_u, len(u))
    extra = np.zeros((3, 3)) if cov_v is None else as_shape(as_covariances(cov_v, "cov_v", 3), "cov_v", 3, 3)
    turn = 0.5 if model == "midpoint" else 0.0
    stds = as_positive_number(std_range, "std_range"), as_positive_number(std_bearing, "std_bearing")
    weights = tuple(1 / std**2 for std in stds)
    run = _filter_many if runs else _filter_one
    x, cov, score = run(u, z, landmarks, x0, cov0, as_positive_number(dt, "dt"), weights, var_u, extra, turn, wrap)
    return Localization(x, cov, score, np.isfinite(z).sum((-1, -2)))


def _control_covariances(cov_u, n):
    cov_u = as_covariances(cov_u, "cov_u", 2)
    if cov_u.shape not in ((2, 2), (n, 2, 2)):
        raise ValueError(f"cov_u must have shape (2, 2) or ({n}, 2, 2), got {cov_u.shape}")
    return np.broadcast_to(cov_u, (n, 2, 2))


def _control_variances(cov_u, n):
    cov_u = _control_covariances(cov_u, n)
    if (cov_u[:, 0, 1] != 0).any():
        raise ValueError("cov_u must be diagonal: ekf_localize takes v and omega as uncorrelated, as the lecture does")
    return np.diagonal(cov_u, axis1=-2, axis2=-1)


_UPPER = ((0, 0, 0, 1, 1, 2), (0, 1, 2, 1, 2, 2))


def _filter_one(u, z, landmarks, x0, cov0, dt, weights, var_u, extra, turn, wrap):
    """One robot on Python floats: no array is worth its call for three numbers."""
    pose, P, extra = tuple(x0.tolist()), tuple(cov0[_UPPER].tolist()), tuple(extra[_UPPER].tolist())
    w_r, w_b = (float(w) for w in weights)
    dt, marks, out = float(dt), landmarks.tolist(), []
    sqrt, atan2, pi, tau = math.sqrt, math.atan2, math.pi, math.tau
    for (v, w), noise, seen in zip(u.tolist(), var_u.tolist(), z.tolist()):
        pose, P = _move(pose, P, v, w, dt, noise, extra, turn)
        x, y, theta = pose
        a = b = c = d = e = f = g0 = g1 = g2 = score = 0.0
        for (lx, ly), (distance, bearing) in zip(marks, seen):
            if distance != distance:  # NaN: not seen
                continue
            dx, dy = lx - x, ly - y
            q = dx * dx + dy * dy
            r = sqrt(q)
            ux, uy, bx, by = dx / r, dy / r, dy / q, -dx / q
            er, eb = distance - r, bearing - atan2(dy, dx) + theta
            if wrap:
                eb = (eb + pi) % tau - pi
            wx, wy, vx, vy = w_r * ux, w_r * uy, w_b * bx, w_b * by
            a, b, d = a + wx * ux + vx * bx, b + wx * uy + vx * by, d + wy * uy + vy * by
            c, e, f = c - vx, e - vy, f + w_b
            g0, g1, g2 = g0 - wx * er + vx * eb, g1 - wy * er + vy * eb, g2 - w_b * eb
            score += w_r * er * er + w_b * eb * eb
        pose, P, explained = _absorb(pose, P, (a, b, c, d, e, f), (g0, g1, g2))
        out += pose
        out += P
        out.append(score - explained)
    out = np.array(out).reshape(len(u), 10)
    cov = out[:, [3, 4, 5, 4, 6, 7, 5, 7, 8]].reshape(-1, 3, 3)
    return out[:, :3], cov, out[:, 9]


def _move(pose, P, v, w, dt, noise, extra, turn):
    """Predicted pose and covariance (six entries)."""
    (x, y, theta), (p00, p01, p02, p11, p12, p22), (var_v, var_w) = pose, P, noise
    q00, q01, q02, q11, q12, q22 = extra
    direction = theta + turn * dt * w
    c, s = dt * math.cos(direction), dt * math.sin(direction)
    a, b = -v * s, v * c
    e, f, cv, wt = turn * dt * a, turn * dt * b, c * var_v, dt * var_w
    m02, m12 = p02 + a * p22, p12 + b * p22
    moved = (
        p00 + a * (p02 + m02) + c * cv + e * e * var_w + q00,
        p01 + a * p12 + b * m02 + s * cv + e * f * var_w + q01,
        m02 + e * wt + q02,
        p11 + b * (p12 + m12) + s * s * var_v + f * f * var_w + q11,
        m12 + f * wt + q12,
        p22 + dt * wt + q22,
    )
    return (x + b, y - a, theta + w * dt), moved


def _absorb(pose, P, W, g):
    """Pose and covariance after measurements of information W = H'R^-1 H (six entries) and g = H'R^-1 innovation."""
    p00, p01, p02, p11, p12, p22 = P
    w00, w01, w02, w11, w12, w22 = W
    a = 1 + w00 * p00 + w01 * p01 + w02 * p02  # I + W P, row by row
    b = w00 * p01 + w01 * p11 + w02 * p12
    c = w00 * p02 + w01 * p12 + w02 * p22
    d = w01 * p00 + w11 * p01 + w12 * p02
    e = 1 + w01 * p01 + w11 * p11 + w12 * p12
    f = w01 * p02 + w11 * p12 + w12 * p22
    h = w02 * p00 + w12 * p01 + w22 * p02
    i = w02 * p01 + w12 * p11 + w22 * p12
    j = 1 + w02 * p02 + w12 * p12 + w22 * p22
    c00, c10, c20 = e * j - f * i, f * h - d * j, d * i - e * h  # its cofactors, and k = 1 / its determinant
    c01, c11, c21 = c * i - b * j, a * j - c * h, b * h - a * i
    c02, c12, c22 = b * f - c * e, c * d - a * f, a * e - b * d
    k = 1 / (a * c00 + b * c10 + c * c20)
    n00, n01 = k * (p00 * c00 + p01 * c10 + p02 * c20), k * (p00 * c01 + p01 * c11 + p02 * c21)
    n02, n11 = k * (p00 * c02 + p01 * c12 + p02 * c22), k * (p01 * c01 + p11 * c11 + p12 * c21)
    n12, n22 = k * (p01 * c02 + p11 * c12 + p12 * c22), k * (p02 * c02 + p12 * c12 + p22 * c22)
    g0, g1, g2 = g
    x, y, z = n00 * g0 + n01 * g1 + n02 * g2, n01 * g0 + n11 * g1 + n12 * g2, n02 * g0 + n12 * g1 + n22 * g2
    return (pose[0] + x, pose[1] + y, pose[2] + z), (n00, n01, n02, n11, n12, n22), x * g0 + y * g1 + z * g2


def _filter_many(u, z, landmarks, x0, cov0, dt, weights, var_u, extra, turn, wrap):
    """Many robots at once: states (3, runs), covariances (3, 3, runs), so that every operation runs along the runs."""
    steps, runs, m, _ = z.shape
    u = np.broadcast_to(u if u.ndim == 3 else u[:, None, :], (steps, runs, 2)).transpose(0, 2, 1)
    pose, P = x0.T.copy(), cov0.transpose(1, 2, 0).copy()
    marks, extra, noisy = landmarks.T[:, :, None], extra[:, :, None], extra.any()
    z = np.ascontiguousarray(z.transpose(0, 3, 2, 1))  # step, number, landmark, run
    weight = np.isfinite(z) * np.reshape(weights, (2, 1, 1))
    z = np.where(np.isfinite(z), z, 0.0)
    poses, covs, scores = np.empty((steps, 3, runs)), np.empty((steps, 3, 3, runs)), np.empty((steps, runs))
    H, y, along = np.empty((3, 2, m, runs)), np.empty((2, m, runs)), np.empty((2, runs))
    H[2, 0], H[2, 1] = 0.0, -1.0  # the heading: not seen by distances, subtracted from bearings
    rows, error, weight = H.reshape(3, 2 * m, runs), y.reshape(2 * m, runs), weight.reshape(steps, 2 * m, runs)
    weighted = np.empty_like(rows)
    for k in range(steps):
        _move_many(pose, P, u[k], dt, var_u[k], turn, along)
        if noisy:
            P += extra
        d = marks - pose[:2, None]
        minus_q = d[0] * d[0]
        minus_q += d[1] * d[1]
        r = np.sqrt(minus_q)
        np.negative(minus_q, out=minus_q)
        np.subtract(z[k, 0], r, out=y[0])
        np.subtract(z[k, 1], np.arctan2(d[1], d[0]), out=y[1])
        y[1] += pose[2]
        if wrap:
            y[1] -= math.tau * np.rint(y[1] * (1 / math.tau))
        np.negative(r, out=r)
        np.divide(d, r, out=H[:2, 0])
        np.divide(d[1], minus_q, out=H[0, 1])
        np.negative(H[0, 1], out=H[0, 1])
        np.divide(d[0], minus_q, out=H[1, 1])
        np.multiply(rows, weight[k], out=weighted)
        g = np.einsum("ikr,kr->ir", weighted, error)
        P = _absorb_many(P, np.einsum("ikr,jkr->ijr", weighted, rows))
        change = np.einsum("ijr,jr->ir", P, g)
        pose += change
        poses[k], covs[k] = pose, P
        error *= error
        np.einsum("kr,kr->r", error, weight[k], out=scores[k])
        scores[k] -= np.einsum("ir,ir->r", change, g)
    return poses.transpose(0, 2, 1), covs.transpose(0, 3, 1, 2), scores


def _move_many(pose, P, u, dt, noise, turn, along):
    """`_move` in place."""
    direction = pose[2] + (turn * dt) * u[1] if turn else pose[2]
    np.cos(direction, out=along[0])
    np.sin(direction, out=along[1])
    way = dt * u[0] * along
    pose[:2] += way
    pose[2] += dt * u[1]
    bend = way[::-1] * [[-1.0], [1.0]]
    P[:2] += bend[:, None] * P[2]
    P[:, :2] += bend * P[:, 2, None]
    if noise[0]:
        P[:2, :2] += along[:, None] * ((dt * dt * noise[0]) * along)
    if noise[1]:
        P[2, 2] += dt * dt * noise[1]
        if turn:
            cross = (turn * dt * dt * noise[1]) * bend
            P[:2, 2] += cross
            P[2, :2] += cross
            P[:2, :2] += (turn * dt) ** 2 * noise[1] * bend[:, None] * bend


def _absorb_many(P, W):
    """Covariances after measurements of information W; the cofactors come from the matrix continued cyclically."""
    M = np.empty((5, 5, P.shape[-1]))
    M[:3, :3] = np.einsum("ijr,jkr->ikr", W, P)
    for i in range(3):
        M[i, i] += 1.0
    M[3:, :3] = M[:2, :3]
    M[:, 3:] = M[:, :2]
    C = M[1:4, 1:4] * M[2:, 2:] - M[1:4, 2:] * M[2:, 1:4]
    C /= M[0, 0] * C[0, 0] + M[0, 1] * C[0, 1] + M[0, 2] * C[0, 2]
    return np.einsum("ijr,kjr->ikr", P, C)
