"""Newton, Gauss-Newton, Levenberg-Marquardt and trust region, each returning the trace of every iterate.

Two kinds of problem, told apart by the callbacks. A *smooth function*: cost(x) -> float, gradient(x) -> (n,),
hessian(x) -> (n, n). A *sum of squares*: residual(x) -> (m,), jacobian(x) -> (m, n), with the cost 1/2 |residual|^2.
Unknowns need not be vectors: `retract(x, step)` applies an increment (default x + step), so x may be a pose, shape
(4, 4), as long as the Jacobian is taken with respect to the increment. `scale`, the typical size of each entry of the
step, makes parameters of unlike units comparable.

Source: thesis "Optimierung bei der Kalibrierung von Sensor-Roboter-Systemen", HAW Hamburg 2019, sections 2.4.3, 2.5 and
6.1.5-6.2, listings C5 and C8. The step functions broadcast over leading axes, so that a whole picture of starts can be
computed at once.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from ..checks import (
    as_count,
    as_finite,
    as_floats,
    as_function,
    as_instance,
    as_matrices,
    as_nonnegative,
    as_number,
    as_positive,
    as_positive_number,
    as_shape,
    fit_together,
    shown,
)
from ..documented import documented

ROUNDING = 10 * np.finfo(float).eps  # a relative change of the cost below this is noise


@dataclass(frozen=True, eq=False)
class Trace:
    """Every iterate of one run, so that it can be drawn and counted.

    Attributes
    ----------
    x : array, shape (K + 1, ...)
        Iterates, the start first; a rejected step repeats its iterate.
    cost : array, shape (K + 1,)
        Value of the cost at every iterate.
    step : array, shape (K, n)
        Increments tried, rejected ones included.
    radius : array, shape (K,)
        How long each step was allowed to be, in units of `scale`: infinite for Newton and Gauss-Newton; for
        Levenberg-Marquardt its own length, for a damped step minimizes the model in the ball it just reaches.
    converged : bool
        Whether the stopping rule was met.
    reason : str
        In words, what ended the run.
    gain : array, shape (K,)
        Actual over predicted decrease of every step; NaN where the method does not ask.
    accepted : bool array, shape (K,)
        Whether each step was taken.
    """

    x: np.ndarray
    cost: np.ndarray
    step: np.ndarray
    radius: np.ndarray
    converged: bool
    reason: str
    gain: np.ndarray
    accepted: np.ndarray

    @property
    def solution(self):
        """The last iterate."""
        return self.x[-1]

    @property
    def iterations(self):
        """Number of steps tried."""
        return len(self.step)


@dataclass(frozen=True, eq=False)
class Point:
    """What a method knows at one iterate.

    Attributes
    ----------
    x : array
        The iterate.
    cost : float
    gradient : array, shape (n,)
    curvature : array, shape (n, n)
        B, the Hessian or J'J.
    residual, jacobian : arrays, shapes (m,) and (m, n)
        Of a sum of squares.
    """

    x: np.ndarray
    cost: float
    gradient: np.ndarray
    curvature: np.ndarray
    residual: np.ndarray | None = None
    jacobian: np.ndarray | None = None


# --- Stopping rules: called after every accepted step with the points before and after it; a text ends the run ---


def small_gradient(tol=1e-10):
    """Stop once |g_1| + ... + |g_n| <= tol at the new iterate."""
    return lambda before, after: "the gradient is small" if np.abs(after.gradient).sum() <= tol else ""


def small_gradient_before(tol=1e-10):
    """The rule of listing C8: as `small_gradient`, with the gradient the step was computed from, so one step later."""
    return lambda before, after: "the gradient is small" if np.abs(before.gradient).sum() <= tol else ""


def small_change(tol=1e-20):
    """The rule of listing C5 and of section 6.1.5: stop once the cost changes by no more than tol (absolute)."""
    return lambda before, after: "the cost no longer changes" if abs(after.cost - before.cost) <= tol else ""


def settled(tol=1e-12):
    """Free of units: stop once the step is short against x, or the residual stands at right angles to all columns of J,
    within tol."""

    def rule(before, after):
        if np.linalg.norm(after.x - before.x) <= tol * (tol + np.linalg.norm(after.x)):
            return "the step is small"
        if after.residual is not None:
            lengths = np.linalg.norm(after.jacobian, axis=0) * np.linalg.norm(after.residual)
            if (np.abs(after.gradient) <= tol * lengths).all():
                return "the residual is orthogonal to the Jacobian"
        return ""

    return rule


# --- Steps ---


def _model(g, B):
    """Gradient (..., n) and curvature (..., n, n) of a quadratic model."""
    g = as_finite(g, "the gradient")
    if g.ndim < 1:
        raise ValueError("the gradient must have shape (..., n), got a single number")
    B = as_matrices(B, "the curvature", g.shape[-1], g.shape[-1])
    fit_together(gradient=g.shape[:-1], curvature=B.shape[:-2])
    return g, B


def _ball(g, B, radius):
    """A quadratic model and the radius (...) of the ball it is minimized in."""
    (g, B), radius = _model(g, B), as_nonnegative(radius, "radius")
    fit_together(gradient=g.shape[:-1], radius=radius.shape)
    return g, B, radius


def _linearized(r, J):
    """Residual (..., m) and Jacobian (..., m, n) with m >= n."""
    r, J = as_finite(r, "r"), as_finite(J, "J")
    if r.ndim < 1 or J.ndim < 2 or J.shape[-2] != r.shape[-1] or J.shape[-2] < J.shape[-1]:
        raise ValueError(f"r and J must have shapes (..., m) and (..., m, n) with m >= n, got {r.shape} and {J.shape}")
    fit_together(r=r.shape[:-1], J=J.shape[:-2])
    return r, J


def newton_step(g, H):
    """Step to where the quadratic model is stationary, H step = -g; nothing asks whether that is a minimum.

    Parameters
    ----------
    g, H : array-like, shapes (..., n) and (..., n, n)
        Gradient and Hessian.

    Returns
    -------
    step : array, shape (..., n)

    Raises
    ------
    ValueError
        Where H is singular.

    Source: thesis, (2-23), (2-24).
    """
    g, H = _model(g, H)
    return -_solve(H, g[..., None], "the curvature H is singular: the model has no stationary place, or many")


def newton_parts(g, H):
    """The Newton step taken apart along the directions of curvature; it is the sum of its parts.

    Parameters
    ----------
    g, H : array-like, shapes (n,) and (n, n)
        Gradient and symmetric Hessian.

    Returns
    -------
    curvatures : array, shape (n,)
        Eigenvalues of H, smallest first. Where one is negative, its part of the step goes uphill.
    directions, parts : arrays, shape (n, n)
        Column k is the direction of curvature k, and the part of the step along it.

    Raises
    ------
    ValueError
        Wrong shapes, a curvature of zero.

    See Also
    --------
    newton_step : the same step at once.
    """
    g, H = as_shape(g, "g", "n"), as_shape(H, "H", "n", "n")
    g, H = _model(g, H)
    curvatures, directions = np.linalg.eigh(H)
    if (curvatures == 0).any():
        raise ValueError("the curvature H is singular: the model has no stationary place, or many")
    return curvatures, directions, -(directions.T @ g / curvatures) * directions


def gauss_newton_step(r, J):
    """Step that minimizes |r + J step|, by a QR factorization: the normal equations square the condition number.

    Parameters
    ----------
    r, J : array-like, shapes (..., m) and (..., m, n)
        Residual and Jacobian, m >= n.

    Returns
    -------
    step : array, shape (..., n)

    Raises
    ------
    ValueError
        Where the columns of J depend on each other.

    Source: thesis, (2-31), which solves the normal equations.
    """
    r, J = _linearized(r, J)
    Q, R = np.linalg.qr(J)
    return -_solve(R, np.swapaxes(Q, -1, -2) @ r[..., None], "the columns of J depend on each other: many steps fit")


def _solve(A, right, why_not):
    try:
        return np.linalg.solve(A, right)[..., 0]
    except np.linalg.LinAlgError:
        raise ValueError(why_not) from None


def damped_step(r, J, damping):
    """Levenberg-Marquardt step: minimizes |r + J step|^2 + damping |step|^2.

    Parameters
    ----------
    r, J : array-like, shapes (..., m) and (..., m, n)
        Residual and Jacobian.
    damping : array-like, shape (...)
        Not negative.

    Returns
    -------
    step : array, shape (..., n)

    Raises
    ------
    ValueError
        Shapes that do not fit together, a damping below 0.
    """
    r, J, damping = as_finite(r, "r"), as_finite(J, "J"), as_nonnegative(damping, "damping")
    if r.ndim < 1 or J.ndim < 2 or J.shape[-2] != r.shape[-1]:
        raise ValueError(f"r and J must have shapes (..., m) and (..., m, n), got {r.shape} and {J.shape}")
    if fit_together(r=r.shape[:-1], J=J.shape[:-2], damping=damping.shape) != J.shape[:-2] or r.shape != J.shape[:-1]:
        raise ValueError(f"r, J and damping must share leading axes, got {r.shape}, {J.shape}, {damping.shape}")
    n = J.shape[-1]
    root = np.sqrt(damping)[..., None, None] * np.eye(n)
    stacked = np.concatenate([J, np.broadcast_to(root, (*J.shape[:-2], n, n))], axis=-2)
    return gauss_newton_step(np.concatenate([r, np.zeros((*r.shape[:-1], n))], axis=-1), stacked)


def _length(v):
    return np.sqrt((v * v).sum(-1))


def _bend(g, B):
    """Curvature along the gradient, g'Bg."""
    return (g * (B @ g[..., None])[..., 0]).sum(-1)


def cauchy_step(g, B, radius):
    """Minimizer of the model along steepest descent inside the radius; to the rim where the model bends down there.

    Parameters
    ----------
    g, B : array-like, shapes (..., n) and (..., n, n)
        Gradient and curvature of the model.
    radius : array-like, shape (...)
        Not negative.

    Returns
    -------
    step : array, shape (..., n)

    Source: thesis, (2-39): the Cauchy point.
    """
    g, B, radius = _ball(g, B, radius)
    length, bend = _length(g), _bend(g, B)
    bends_up = bend > 0
    inside = length**3 / np.where(bends_up, bend * radius, 1.0)
    share = np.where(bends_up, np.minimum(1.0, inside), 1.0)
    return -(share * radius / np.where(length > 0, length, 1.0))[..., None] * g


def dogleg_step(g, B, radius):
    """Powell's dogleg: down the gradient to the model's minimum there, on toward the Newton point, cut at the radius.

    Where B is not positive definite, the Newton point is no minimum and the Cauchy point is returned. The parameters
    are those of `cauchy_step`.

    Returns
    -------
    step : array, shape (..., n)

    Source: thesis (2-33)-(2-35); Nocedal, Wright, Numerical Optimization, section 4.1.
    """
    g, B, radius = _ball(g, B, radius)
    eigenvalues = np.linalg.eigvalsh(B)
    convex = eigenvalues[..., 0] > 1e-14 * np.abs(eigenvalues).max(-1)
    safe = np.where(convex[..., None, None], B, np.eye(B.shape[-1]))
    full = newton_step(g, safe)
    bend = _bend(g, safe)
    corner = -((g * g).sum(-1) / np.where(bend > 0, bend, 1.0))[..., None] * g
    leg = full - corner
    a, b, c = (leg * leg).sum(-1), (corner * leg).sum(-1), (corner * corner).sum(-1) - radius**2
    root = np.sqrt(np.maximum(b * b - a * c, 0.0))
    share = np.clip(-c / np.where(b + root > 0, b + root, 1.0), 0.0, 1.0)
    path = np.where((c < 0)[..., None], corner + share[..., None] * leg, cauchy_step(g, safe, radius))
    step = np.where((_length(full) <= radius)[..., None], full, path)
    return np.where(convex[..., None], step, cauchy_step(g, B, radius))


def exact_step(g, B, radius):
    """The model's minimizer inside the radius, also for an indefinite B.

    It solves (B + shift I) step = -g with the smallest sufficient shift. The parameters are those of `cauchy_step`.

    Returns
    -------
    step : array, shape (..., n)

    Source: More, Sorensen, Computing a trust region step (1983).
    """
    g, B, radius = _ball(g, B, radius)
    eigenvalues, V = np.linalg.eigh(B)
    along = (np.swapaxes(V, -1, -2) @ g[..., None])[..., 0]
    size = np.abs(eigenvalues).max(-1) + _length(g) / radius
    low = np.maximum(-eigenvalues[..., 0], 0.0) + 1e-14 * size
    high = low + _length(g) / radius

    def at(shift):
        return -along / (eigenvalues + shift[..., None])

    for _ in range(60):
        middle = 0.5 * (low + high)
        too_long = _length(at(middle)) > radius
        low, high = np.where(too_long, middle, low), np.where(too_long, high, middle)
    start = np.maximum(-eigenvalues[..., 0], 0.0) + 1e-14 * size
    shift = np.where(_length(at(start)) <= radius, start, high)
    step = at(shift)
    rim = np.sqrt(np.maximum(radius**2 - (step[..., 1:] ** 2).sum(-1), 0.0))  # where the model bends down it ends there
    step[..., 0] = np.where(eigenvalues[..., 0] < 0, np.copysign(rim, step[..., 0]), step[..., 0])
    return (V @ step[..., None])[..., 0]


def predicted_decrease(g, B, step):
    """Decrease m(0) - m(step) that the quadratic model promises.

    Parameters
    ----------
    g, B : array-like, shapes (..., n) and (..., n, n)
        Gradient and curvature of the model.
    step : array-like, shape (..., n)

    Returns
    -------
    decrease : array, shape (...)

    Raises
    ------
    ValueError
        Shapes that do not fit together.

    Source: thesis, (2-33).
    """
    (g, B), step = _model(g, B), as_finite(step, "step")
    if step.shape[-1:] != g.shape[-1:]:
        raise ValueError(f"step must have shape (..., {g.shape[-1]}), got {step.shape}")
    fit_together(gradient=g.shape[:-1], step=step.shape[:-1])
    return -(g * step).sum(-1) - 0.5 * _bend(step, B)


def gain_ratio(cost, new_cost, g, B, step):
    """Actual over predicted decrease: 1 for a perfect model, below 0 when the cost rose.

    Both decreases get a share of the cost's rounding error added, so that the ratio tends to 1 where nothing
    but rounding is left.

    Parameters
    ----------
    cost, new_cost : array-like, shape (...)
        Before and after the step.
    g, B, step
        As in `predicted_decrease`.

    Returns
    -------
    gain : array, shape (...)

    Source: thesis, (2-36).
    """
    cost, new_cost = as_finite(cost, "cost"), as_finite(new_cost, "new_cost")
    noise = ROUNDING * np.abs(cost) + np.finfo(float).tiny
    predicted = predicted_decrease(g, B, step)
    fit_together(cost=cost.shape, new_cost=new_cost.shape, decrease=predicted.shape)
    return (cost - new_cost + noise) / (predicted + noise)


def classify_extremum(g, H, tol=1e-6):
    """Kind of a point by first and second order.

    Parameters
    ----------
    g, H : array-like, shapes (n,) and (n, n)
        Gradient and Hessian at the point.
    tol : float
        A point counts as stationary when |g| <= tol times the largest |eigenvalue| of H (so a length,
        in the unit of x); an eigenvalue counts as zero below tol times the largest.

    Returns
    -------
    kind : str
        "minimum", "maximum", "saddle", "degenerate" or "not stationary".

    Raises
    ------
    ValueError
        Shapes that do not fit together.

    Source: thesis, section 2.4.3.
    """
    g, H, tol = as_finite(g, "g"), as_finite(H, "H"), as_positive_number(tol, "tol")
    if g.ndim != 1 or H.shape != (len(g), len(g)):
        raise ValueError(f"g and H must have shapes (n,) and (n, n), got {g.shape} and {H.shape}")
    eigenvalues = np.linalg.eigvalsh(0.5 * (H + H.T))
    size = np.abs(eigenvalues).max()
    if np.linalg.norm(g) > tol * size:
        return "not stationary"
    if (np.abs(eigenvalues) <= tol * size).any():
        return "degenerate"
    if (eigenvalues > 0).all():
        return "minimum"
    return "maximum" if (eigenvalues < 0).all() else "saddle"


# --- The four methods ---


@dataclass
class _Recorder:
    """Collects a run's iterates and turns them into a Trace."""

    points: list[Point]
    steps: list = field(default_factory=list)
    radii: list = field(default_factory=list)
    gains: list = field(default_factory=list)
    accepted: list = field(default_factory=list)

    def add(self, point, step, radius=np.inf, gain=np.nan, accepted=True):
        self.points.append(point)
        self.steps.append(step)
        self.radii.append(radius)
        self.gains.append(gain)
        self.accepted.append(accepted)

    def trace(self, reason, converged):
        n = len(self.points[0].gradient)
        return Trace(
            x=np.array([p.x for p in self.points]),
            cost=np.array([p.cost for p in self.points]),
            step=np.array(self.steps).reshape(-1, n),
            radius=np.array(self.radii, dtype=float),
            converged=converged,
            reason=reason,
            gain=np.array(self.gains, dtype=float),
            accepted=np.array(self.accepted, dtype=bool),
        )


def _smooth(cost, gradient, hessian):
    """Evaluator of a smooth function: x -> Point."""
    for function, name in ((cost, "cost"), (gradient, "gradient"), (hessian, "hessian")):
        as_function(function, name)

    def at(x):
        g, H = as_floats(gradient(x), "the gradient"), as_floats(hessian(x), "the Hessian")
        if g.ndim != 1 or H.shape != (g.size, g.size):
            raise ValueError(f"gradient and hessian must return shapes (n,) and (n, n), got {g.shape} and {H.shape}")
        return Point(x, _one_number(cost(x)), g, H)

    return at


def _one_number(value):
    """A cost as a float, infinity among them."""
    value = as_floats(value, "the cost")
    if value.size != 1:
        raise ValueError(f"the cost must be one number, got shape {value.shape}")
    return value.item()


def _squares(residual, jacobian):
    """Evaluator of a sum of squares: x -> Point with cost 1/2 |r|^2, gradient J'r and curvature J'J."""
    as_function(residual, "residual"), as_function(jacobian, "jacobian")

    def at(x):
        r, J = as_floats(residual(x), "the residual"), as_floats(jacobian(x), "the Jacobian")
        if r.ndim != 1 or J.ndim != 2 or J.shape[0] != r.size or J.shape[0] < J.shape[1]:
            raise ValueError(
                f"residual and jacobian must return shapes (m,) and (m, n) with m >= n, got {r.shape} and {J.shape}"
            )
        return Point(x, 0.5 * float(r @ r), J.T @ r, J.T @ J, r, J)

    return at


def _start(evaluate, x0):
    point = evaluate(as_finite(x0, "x0"))
    if not _is_finite(point):
        raise ValueError(f"the cost or its derivatives are not finite at the start x0 = {shown(x0)}")
    return point


def _rule(stop, usual):
    """A stopping rule whose answer is a reason or an empty text, as that of the usual ones."""
    if stop is None:
        return usual()
    return lambda point, new: as_instance(stop(point, new), "what stop returns", str, "text")


def _refuse_scale(scale, point):
    if scale.shape not in ((), point.gradient.shape):
        raise ValueError(f"scale must be one number or one per unknown, {point.gradient.shape}, got {scale.shape}")


def _is_finite(point):
    g, B = point.gradient, point.curvature
    return math.isfinite(point.cost) and math.isfinite(np.vdot(g, g)) and math.isfinite(np.vdot(B, B))


def _retracted(retract, x, step):
    """The unknowns after a step; refuses what is of another shape than before it."""
    if retract is np.add and np.shape(step) != np.shape(x):
        raise ValueError(f"x has shape {np.shape(x)}, but its derivatives are by {len(step)} unknowns")
    new = as_floats(retract(x, step), "what retract returns")
    if new.shape != np.shape(x):
        raise ValueError(f"retract must keep the shape of x, {np.shape(x)}, got {new.shape}")
    return new


def _undamped(evaluate, x0, next_step, retract, stop, max_iterations):
    """The loop Newton and Gauss-Newton share: solve, step, ask the stopping rule."""
    point = _start(evaluate, x0)
    record = _Recorder([point])
    for _ in range(as_count(max_iterations, "max_iterations", at_least=0)):
        step, trouble = next_step(point)
        if trouble:
            return record.trace(trouble, False)
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            new = evaluate(_retracted(retract, point.x, step))
        if not _is_finite(new):
            return record.trace("the next step leads to where the cost is not finite", False)
        record.add(new, step)
        reason = stop(point, new)
        if reason:
            return record.trace(reason, True)
        point = new
    return record.trace(f"no convergence within {max_iterations} iterations", False)


@documented
def newton(cost, gradient, hessian, x0, *, stop=None, max_iterations=100):
    """Newton's method on a smooth function: full steps toward whichever stationary point comes first.

    Parameters
    ----------
    cost, gradient, hessian : callables
        Of x, shape (n,), returning a float, shape (n,) and shape (n, n).
    x0 : array-like, shape (n,)
        Start.
    stop : callable
        Stopping rule, by default `small_gradient(1e-10)`.

    Returns
    -------
    Trace

    Raises
    ------
    ValueError
        When the callbacks' shapes do not fit or nothing is finite at x0. A singular Hessian ends the run
        and is named in `reason`.

    Source: thesis, section 2.5.2 and listing C8.
    """

    def next_step(point):
        if np.linalg.cond(point.curvature) > 1 / np.finfo(float).eps:
            return None, "the Hessian is singular"
        return newton_step(point.gradient, point.curvature), ""

    return _undamped(
        _smooth(cost, gradient, hessian), x0, next_step, np.add, _rule(stop, small_gradient), max_iterations
    )


@documented
def gauss_newton(residual, jacobian, x0, *, retract=np.add, stop=None, max_iterations=100):
    """Gauss-Newton on a sum of squares: full steps that minimize the linearized residual.

    Parameters
    ----------
    residual, jacobian : callables
        Of x, returning shapes (m,) and (m, n); the Jacobian with respect to the increment that `retract` applies.
    x0 : array-like
        Start, shape (n,), or whatever `retract` accepts.
    retract : callable
        (x, step) -> new x.
    stop : callable
        Stopping rule, by default `settled(1e-12)`.

    Returns
    -------
    Trace

    Raises
    ------
    ValueError
        When the callbacks' shapes do not fit or nothing is finite at x0. A Jacobian without full
        column rank ends the run, with its rank in `reason`.

    Source: thesis, (2-28)-(2-32), section 6.1.5 and listing C5.
    """

    def next_step(point):
        rank, n = np.linalg.matrix_rank(point.jacobian), point.jacobian.shape[1]
        if rank < n:
            return None, f"the Jacobian has rank {rank}, but there are {n} unknowns"
        return gauss_newton_step(point.residual, point.jacobian), ""

    return _undamped(_squares(residual, jacobian), x0, next_step, retract, _rule(stop, settled), max_iterations)


@documented
def levenberg_marquardt(
    residual, jacobian, x0, *, damping=1e-3, scale=1.0, retract=np.add, stop=None, max_iterations=100
):  # fmt: skip
    """Levenberg-Marquardt: Gauss-Newton with a damping that follows the gain ratio.

    `damping` is the first damping, relative to the largest diagonal entry of the scaled J'J. A step that raises the
    cost is rejected and the damping grows; the better the model predicted, the more it shrinks. Other parameters as in
    `gauss_newton` and `trust_region`.

    Parameters
    ----------
    residual, jacobian, retract : callables
    stop : callable, optional

    Returns
    -------
    Trace

    Source: Nielsen, Damping parameter in Marquardt's method, IMM report (1999).
    """
    evaluate, stop, scale = _squares(residual, jacobian), _rule(stop, settled), as_positive(scale, "scale")
    max_iterations = as_count(max_iterations, "max_iterations", at_least=0)
    point = _start(evaluate, x0)
    _refuse_scale(scale, point)
    record = _Recorder([point])
    damping = as_positive_number(damping, "damping") * ((point.jacobian * scale) ** 2).sum(0).max()
    growth = 2.0
    for _ in range(max_iterations):
        if not point.gradient.any():
            return record.trace("the gradient is zero", True)
        scaled = damped_step(point.residual, point.jacobian * scale, damping)
        step, radius = scale * scaled, _length(scaled)
        new, gain = _try(evaluate, point, retract, step)
        if gain > 0:
            damping *= max(1 / 3, 1 - (2 * gain - 1) ** 3)
            growth = 2.0
        else:
            damping *= growth
            growth *= 2.0
        record.add(new if gain > 0 else point, step, radius, gain, gain > 0)
        reason, converged = (stop(point, new), True) if gain > 0 else _stuck(point, step)
        if reason:
            return record.trace(reason, converged)
        point = record.points[-1]
    return record.trace(f"no convergence within {max_iterations} iterations", False)


@documented
def trust_region(
    fun, jac, x0, *, hessian=None, radius=1.0, max_radius=1e3, accept=0.1, subproblem=dogleg_step,
    scale=1.0, retract=np.add, stop=None, max_iterations=200,
):  # fmt: skip
    """Trust region: minimize the quadratic model inside a radius, and let the gain ratio rule the radius.

    Parameters
    ----------
    fun, jac : callables
        With `hessian`: cost(x) and gradient(x) of a smooth function. Without: residual(x) and
        jacobian(x) of a sum of squares.
    x0 : array-like
        Start, shape (n,), or whatever `retract` accepts.
    radius, max_radius : float
        First and largest radius, in the unit of the step divided by `scale`.
    accept : float
        A step is taken when its gain ratio exceeds this number, from [0, 1/4).
    subproblem : callable
        (g, B, radius) -> step: `dogleg_step`, `cauchy_step` or `exact_step`.
    scale : float or array-like, shape (n,)
        Typical size of each entry of the step, for unknowns of unlike units.
    retract, stop : callables
        As in `gauss_newton`.

    Returns
    -------
    Trace

    Raises
    ------
    ValueError
        Values of `accept`, radius or scale that are out of range; a start where the function is not finite.

    Source: thesis, section 2.5.4 and the scheme of section 6.1.6: radius to a quarter of the step below a
    gain of 1/4, doubled above 3/4 when the step reached the rim.
    """
    accept, max_iterations = as_number(accept, "accept"), as_count(max_iterations, "max_iterations", at_least=0)
    if not 0 <= accept < 0.25:
        raise ValueError(f"accept must lie in [0, 1/4), got {shown(accept)}")
    radius, max_radius = as_positive_number(radius, "radius"), as_positive_number(max_radius, "max_radius")
    evaluate = _squares(fun, jac) if hessian is None else _smooth(fun, jac, hessian)
    stop, scale = _rule(stop, settled), as_positive(scale, "scale")
    point = _start(evaluate, x0)
    _refuse_scale(scale, point)
    record = _Recorder([point])
    for _ in range(max_iterations):
        if not point.gradient.any():
            return record.trace("the gradient is zero", True)
        square = np.outer(scale, scale) if scale.ndim else scale**2
        scaled = subproblem(scale * point.gradient, square * point.curvature, radius)
        step, length = scale * scaled, _length(scaled)
        new, gain = _try(evaluate, point, retract, step)
        record.add(new if gain > accept else point, step, radius, gain, gain > accept)
        radius = next_radius(radius, length, gain, max_radius)
        reason, converged = (stop(point, new), True) if gain > accept else _stuck(point, step)
        if reason:
            return record.trace(reason, converged)
        point = record.points[-1]
    return record.trace(f"no convergence within {max_iterations} iterations", False)


def next_radius(radius, length, gain, max_radius):
    """The radius of a trust region after a step.

    Parameters
    ----------
    radius, length, gain : array-like, shapes that broadcast
        Radius and length of the step, and the gain ratio it had.
    max_radius : float or array-like

    Returns
    -------
    radius : float or array
        A quarter of the length after a poor gain, twice the radius after a good one at the rim, else as before.

    Source: thesis, section 6.1.6.
    """
    radius, length, gain = as_positive(radius, "radius"), as_nonnegative(length, "length"), as_floats(gain, "gain")
    max_radius = as_positive(max_radius, "max_radius")
    fit_together(radius=radius.shape, length=length.shape, gain=gain.shape, max_radius=max_radius.shape)
    on_rim = length >= (1 - 1e-9) * radius
    wider = np.where((gain > 0.75) & on_rim, np.minimum(2 * radius, max_radius), radius)
    return np.where(gain < 0.25, 0.25 * length, wider)[()]


def _try(evaluate, point, retract, step):
    """The point a step leads to, and the step's gain ratio; -infinity where the cost is not finite."""
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        new = evaluate(_retracted(retract, point.x, step))
    if not _is_finite(new):
        return new, -np.inf
    return new, float(gain_ratio(point.cost, new.cost, point.gradient, point.curvature, step))


def _stuck(point, step):
    """(reason, converged) when a rejected step has become too short to change x at all, else ("", False).

    Converged when even the whole Newton step promises less than rounding of the cost can show: then the last bits
    decided that no step was taken, and x is the minimum as exactly as it can be told.
    """
    eps = np.finfo(float).eps
    if np.linalg.norm(step) > eps * (np.finfo(float).tiny + np.linalg.norm(point.x)):
        return "", False
    promised = 0.5 * abs(point.gradient @ np.linalg.lstsq(point.curvature, point.gradient, rcond=None)[0])
    return "no step lowers the cost, down to rounding", bool(promised <= 8 * eps * abs(point.cost))
