"""Kalman filters: the lecture's linear filter, its steady state, and the checks of a filter's honesty.

States are (..., n), covariances (..., n, n); everything that is not a time loop broadcasts over leading axes. The
letters are the lecture's: x = A x + B u moves the state, z = C x measures it, K is the gain.
Source: lecture "Lokalisierung", section "Lokalisierung mit einem Kalman-Filter".
"""

from dataclasses import dataclass, fields

import numpy as np
from scipy import linalg

from ..checks import (
    as_choice,
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
from ..documented import documented
from ..geometry.planar import wrap_angle
from .gaussian import chi_square_quantile

FORMS, PRECISIONS = ("joseph", "short"), ("float", "float64", "float32")


@dataclass(frozen=True, eq=False)
class Corrected:
    """What a measurement made of a prediction.

    Attributes
    ----------
    x, cov : arrays, shapes (..., n) and (..., n, n)
        State and its covariance.
    innovation : array, shape (..., m)
        Measured minus expected; 0 where a number was not measured.
    cov_innovation : array, shape (..., m, m)
        Covariance of the innovation, S = C cov C' + cov_z.
    gain : array, shape (..., n, m)
        K; columns of zeros where a number was not measured.
    dof : array of int, shape (...)
        How many numbers were measured: the degrees of freedom of the innovation.
    """

    x: np.ndarray
    cov: np.ndarray
    innovation: np.ndarray
    cov_innovation: np.ndarray
    gain: np.ndarray
    dof: np.ndarray

    @property
    def nis(self):
        """Normalized innovation squared, (...); chi-square with `dof` degrees of freedom for an honest filter."""
        return nis(self.innovation, self.cov_innovation)


@dataclass(frozen=True, eq=False)
class SteadyState:
    """Where a time-invariant filter settles: gain (n, m), covariance before and after a correction (n, n)."""

    gain: np.ndarray
    cov_before: np.ndarray
    cov_after: np.ndarray


def _t(M):
    return M.swapaxes(-1, -2)


def _apply(M, x):
    return (M @ x[..., None])[..., 0]


def _symmetric(cov):
    return 0.5 * (cov + _t(cov))


# --- the linear filter -------------------------------------------------------


def vehicle_model(dt):
    """Matrices (A, B, C) of the lecture's vehicle.

    The state is (position, velocity), the control an acceleration, and the position is measured. B = (0, dt)' is the
    lecture's; a constant acceleration over dt would also move the position, by dt^2 / 2.

    Parameters
    ----------
    dt : float
        Time step (s).

    Returns
    -------
    A, B, C : arrays, shapes (2, 2), (2, 1), (1, 2)

    Source: lecture, "Beispiel: bewegtes Fahrzeug (1)" and "(2)".
    """
    dt = as_positive_number(dt, "dt")
    return np.array([[1.0, dt], [0.0, 1.0]]), np.array([[0.0], [dt]]), np.array([[1.0, 0.0]])


def predict(x, cov, A, B=None, u=None, cov_u=None, cov_v=None):
    """State and covariance one time step later: (A x + B u, A cov A' + B cov_u B' + cov_v).

    Parameters
    ----------
    x : array-like, shape (..., n)
        State.
    cov : array-like, shape (..., n, n)
        Its covariance.
    A, B : array-like, shapes (..., n, n) and (..., n, k)
        How the state follows itself, and how the control acts.
    u, cov_u : array-like, shapes (..., k) and (..., k, k), optional
        Control and its covariance; they act through B.
    cov_v : array-like, shape (..., n, n), optional
        Further noise of the system; the lecture has none beside the control's.

    Returns
    -------
    x, cov : arrays, shapes (..., n) and (..., n, n)

    Raises
    ------
    ValueError
        Wrong shapes, numbers that are not finite, a negative variance, a control without B.

    Source: lecture, "Algorithmus fuer linearen Kalman-Filter", lines 2 and 3.
    """
    x, n = _state(x)
    A, cov = as_matrices(A, "A", n, n), as_covariances(cov, "cov", n)
    push, spread = _driven(n, B, u, cov_u, cov_v)
    leading = {"x": x.shape[:-1], "cov": cov.shape[:-2], "A": A.shape[:-2]}
    fit_together(**leading, u=np.shape(push)[:-1], cov_u_and_cov_v=np.shape(spread)[:-2])
    return _predicted(x, cov, A, push, spread)


def _state(x):
    x = as_finite(x, "x")
    if x.ndim < 1:
        raise ValueError("x must have shape (..., n), got a single number")
    return x, x.shape[-1]


def _driven(n, B, u, cov_u, cov_v):
    """What a step adds to the state, B u, and to its covariance, B cov_u B' + cov_v."""
    push, spread = 0.0, 0.0
    if B is not None:
        B = as_finite(B, "B")
        k = B.shape[-1] if B.ndim > 1 else 0
        if B.shape[-2:] != (n, k) or not k:
            raise ValueError(f"B must have shape (..., {n}, k), got {B.shape}")
        if u is not None:
            u = as_points(u, "u", k)
            fit_together(B=B.shape[:-2], u=u.shape[:-1])
            push = _apply(B, u)
        if cov_u is not None:
            cov_u = as_covariances(cov_u, "cov_u", k)
            fit_together(B=B.shape[:-2], cov_u=cov_u.shape[:-2])
            spread = B @ cov_u @ _t(B)
    elif u is not None or cov_u is not None:
        raise ValueError("u and cov_u act through B, but B is missing")
    if cov_v is not None:
        cov_v = as_covariances(cov_v, "cov_v", n)
        fit_together(B_and_cov_u=np.shape(spread)[:-2], cov_v=cov_v.shape[:-2])
        spread = spread + cov_v
    return push, spread


def _predicted(x, cov, A, push, spread):
    return _apply(A, x) + push, _symmetric(A @ cov @ _t(A) + spread)


def update(x, cov, z, C, cov_z, form="joseph", dtype=float):
    """Correct a prediction with the measurement z = C x + noise.

    Parameters
    ----------
    x : array-like, shape (..., n)
        Predicted state.
    cov : array-like, shape (..., n, n)
        Its covariance.
    z : array-like, shape (..., m), or None
        Measurement; None for a time step without one: the prediction is returned as it is.
    C, cov_z : array-like, shapes (..., m, n) and (..., m, m)
        What is measured of the state, and the covariance of the measurement.
    form : {"joseph", "short"}
        (I - K C) cov (I - K C)' + K cov_z K', symmetric and positive for every gain, or the lecture's (I - K C) cov.
    dtype : type
        float, or numpy.float32 to see what single precision does to either form.

    Returns
    -------
    Corrected

    Raises
    ------
    ValueError
        Wrong shapes, numbers that are not finite, a negative variance, an innovation whose covariance is singular.

    Source: lecture, "Algorithmus fuer linearen Kalman-Filter", lines 5 to 8, and the remark on missing measurements.
    """
    as_choice(form, "form", FORMS), as_choice(getattr(dtype, "__name__", dtype), "dtype", PRECISIONS)
    x, n = _state(x)
    x = x.astype(dtype)
    rounds = form == "short" or dtype is np.float32  # what rounding makes of a covariance is to be seen there
    cov = (as_matrices(cov, "cov", n, n) if rounds else as_covariances(cov, "cov", n)).astype(dtype)
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
        innovation = np.zeros_like(S[..., 0])
        return Corrected(x, cov, innovation, S, np.zeros_like(PCt), np.zeros(innovation.shape[:-1], int))
    innovation = z - _apply(C, x)
    K = _t(solve_covariance(S, "C cov C' + cov_z", _t(PCt)))
    dof = np.full(innovation.shape[:-1], innovation.shape[-1])
    return Corrected(x + _apply(K, innovation), _after(cov, K, C, cov_z, form), innovation, S, K, dof)


def _after(cov, K, C, cov_z, form="joseph"):
    keep = np.eye(cov.shape[-1], dtype=cov.dtype) - K @ C
    if form == "short":
        return keep @ cov
    return keep @ cov @ _t(keep) + K @ cov_z @ _t(K)


@dataclass(frozen=True, eq=False)
class _Series:
    """Checked arguments of `filter_steps`; push and spread are what a step adds to the state and to its covariance."""

    z: np.ndarray
    missing: np.ndarray
    A: np.ndarray
    C: np.ndarray
    cov_z: np.ndarray
    x0: np.ndarray
    cov0: np.ndarray
    push: np.ndarray
    spread: np.ndarray


def _series(z, A, C, cov_z, x0, cov0, B, u, cov_u, cov_v):
    x0 = as_shape(np.atleast_1d(as_finite(x0, "x0")), "x0", "n")
    n = len(x0)
    C = as_shape(_measured_by(C, n), "C", "m", n)
    m, z = len(C), as_readings(z, "z")
    if z.ndim != 2 or z.shape[1] != m:
        raise ValueError(f"z must have shape (steps, {m}), got {z.shape}")
    unread = np.isnan(z)
    missing = unread.all(axis=1)
    push, spread = _driven(n, B, u, cov_u, cov_v)
    return _Series(
        z=as_finite(np.where(missing[:, None], 0.0, z), "z") if unread.any() else z,
        missing=missing,
        A=as_shape(A, "A", n, n),
        C=C,
        cov_z=as_shape(as_covariances(cov_z, "cov_z", m), "cov_z", m, m),
        x0=x0,
        cov0=_symmetric(as_shape(as_covariances(cov0, "cov0", n), "cov0", n, n)),
        push=as_shape(push + np.zeros(n), "B u", n),
        spread=_symmetric(as_shape(spread + np.zeros((n, n)), "B cov_u B' + cov_v", n, n)),
    )


def filter_steps(z, A, C, cov_z, x0, cov0, B=None, u=None, cov_u=None, cov_v=None):
    """The linear filter along a series: each step predicts as in `predict`, then corrects as in `update`.

    Parameters
    ----------
    z : array-like, shape (steps, m)
        One measurement per step, a row of NaN where nothing was measured.
    A, C, cov_z : array-like, shapes (n, n), (m, n), (m, m)
        As in `predict` and `update`, the same in every step.
    x0, cov0 : array-like, shapes (n,) and (n, n)
        State and covariance before the first step.
    B, u, cov_u, cov_v : array-like, shapes (n, k), (k,), (k, k), (n, n), optional
        As in `predict`, the same in every step.

    Returns
    -------
    Corrected
        Its arrays have the steps as their first axis.

    Raises
    ------
    ValueError
        As `predict` and `update`; a row of z in which only a part is NaN.

    See Also
    --------
    labkit.fast.kalman.filter_steps : the same for long series of single numbers.
    """
    given = _series(z, A, C, cov_z, x0, cov0, B, u, cov_u, cov_v)
    x, cov, steps = given.x0, given.cov0, []
    for measured, missing in zip(given.z, given.missing):
        x, cov = _predicted(x, cov, given.A, given.push, given.spread)
        step = _corrected(x, cov, None if missing else measured, given.C, given.cov_z)
        x, cov = step.x, step.cov
        steps.append(step)
    return _stacked(steps, given)


def _stacked(steps, given):
    """One `Corrected` of many, the steps along the first axis; of the right shapes also without any step."""
    if steps:
        return Corrected(*(np.array([getattr(step, field.name) for step in steps]) for field in fields(Corrected)))
    m, n = given.C.shape
    return Corrected(*(np.empty((0, *s)) for s in ((n,), (n, n), (m,), (m, m), (n, m))), np.empty(0, int))


def steady_state(A, C, cov_v, cov_z):
    """Gain and covariances of a time-invariant filter after many steps, from the discrete Riccati equation.

    Parameters
    ----------
    A, C : array-like, shapes (n, n) and (m, n)
        Model and measurement.
    cov_v, cov_z : array-like, shapes (n, n) and (m, m)
        Noise of the system per step, and of the measurement.

    Returns
    -------
    SteadyState

    Raises
    ------
    ValueError
        Where the equation has no stabilizing solution, because a mode is neither measured nor stable, or none is found,
        because its numbers are too far apart.
    """
    A, C = as_shape(A, "A", "n", "n"), as_shape(C, "C", "m", "n")
    n, m = len(A), len(C)
    A, C = as_shape(A, "A", n, n), as_shape(C, "C", m, n)
    cov_v = as_shape(as_covariances(cov_v, "cov_v", n), "cov_v", n, n)
    cov_z = as_shape(as_covariances(cov_z, "cov_z", m), "cov_z", m, m)
    try:
        before = linalg.solve_discrete_are(A.T, C.T, _symmetric(cov_v), _symmetric(cov_z))
    except np.linalg.LinAlgError as error:
        raise ValueError(f"the filter has no steady state: {error}") from None
    except ValueError:
        raise ValueError("no steady state can be computed: the noises and matrices are too unlike in size") from None
    gain = np.linalg.solve(C @ before @ C.T + cov_z, C @ before).T
    return SteadyState(gain, before, _after(before, gain, C, cov_z))


# --- consistency -------------------------------------------------------------


@documented
def nees(truth, x, cov, angle=None):
    """Normalized estimation error squared, error' cov^-1 error.

    Parameters
    ----------
    truth, x : array-like, shape (..., n)
        True and estimated state.
    cov : array-like, shape (..., n, n)
        Covariance that the filter claims.
    angle : int, optional
        Index of a state that is an angle (rad): its error is wrapped.

    Returns
    -------
    nees : array, shape (...)
        Chi-square with n degrees of freedom for an honest filter.

    Raises
    ------
    ValueError
        Wrong shapes, an index that is none, a covariance without an inverse.
    """
    truth, x = as_finite(truth, "truth"), as_finite(x, "x")
    fit_together(truth=truth.shape, x=x.shape)
    error = truth - x
    if angle is not None:
        if angle not in range(-error.shape[-1], error.shape[-1]):
            raise ValueError(f"angle must be the index of one of {error.shape[-1]} states, got {angle}")
        error[..., angle] = wrap_angle(error[..., angle])
    return _squared(error, cov, "cov")


def nis(innovation, cov_innovation):
    """Normalized innovation squared, innovation' S^-1 innovation: the check that needs no truth.

    Parameters
    ----------
    innovation : array-like, shape (..., m)
        Measured minus expected.
    cov_innovation : array-like, shape (..., m, m)
        Its covariance S.

    Returns
    -------
    nis : array, shape (...)
    """
    return _squared(as_finite(innovation, "innovation"), cov_innovation, "cov_innovation")


def _squared(e, cov, name):
    if e.ndim < 1:
        raise ValueError("an error must have shape (..., n), got a single number")
    cov = as_covariances(cov, name, e.shape[-1])
    fit_together(**{"the errors": e.shape[:-1], name: cov.shape[:-2]})
    return (e * solve_covariance(cov, name, e[..., None])[..., 0]).sum(-1)


def mean_band(dof, runs, probability=0.99):
    """Limits between which the mean NEES or NIS of independent runs lies.

    Parameters
    ----------
    dof : int
        Degrees of freedom of one run: the number of states, or of measured numbers.
    runs : int
    probability : float

    Returns
    -------
    low, high : float
    """
    dof, runs = as_count(dof, "dof"), as_count(runs, "runs")
    tail = 0.5 * (1 - as_probability(probability, "probability"))
    return tuple(chi_square_quantile([tail, 1 - tail], dof * runs) / runs)


@documented
def gate(step, probability=0.99):
    """Whether what was measured is plausible: its NIS lies below the chi-square quantile of as many numbers.

    Only what was seen counts: one landmark of three is two numbers, not six. Where nothing was seen, nothing is
    implausible.

    Parameters
    ----------
    step : Corrected or Localization
        A correction, or many of them: whatever has `nis` and `dof`, of shape (...).
    probability : float
        Share of honest measurements that pass.

    Returns
    -------
    plausible : array of bool, shape (...)
    """
    probability, dof = as_probability(probability, "probability"), np.maximum(step.dof, 1)  # of nothing, NIS is 0
    return step.nis <= chi_square_quantile(probability, dof)
