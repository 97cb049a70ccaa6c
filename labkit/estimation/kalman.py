"""Kalman filters: the lecture's linear filter, its steady state, the extended filter with landmarks, and their checks.

States are (..., n), covariances (..., n, n); everything that is not a time loop broadcasts over leading axes. The
landmark filter works on planar poses x = (x, y, theta) in m, m, rad with controls u = (v, omega) as in `odometry`; a
measurement is (distance, bearing) to each landmark, z (..., m, 2) in m and rad, NaN where a landmark was not seen.
Source: lecture "Lokalisierung", section "Lokalisierung mit einem Kalman-Filter".
"""

from dataclasses import dataclass, fields

import numpy as np
from scipy import linalg, stats

from ..checks import (
    as_count,
    as_covariances,
    as_finite,
    as_matrices,
    as_points,
    as_positive_number,
    as_probability,
    as_readings,
    as_shape,
    fit_together,
    solve_covariance,
)
from ..geometry.planar import wrap_angle

FORMS = ("joseph", "short")


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
