"""The thesis's function of two variables (6-16): two wells, a saddle between them, a plain around them.

    f(x) = -100 / (|x - (1, 1)|^2 + 1) - 200 / (|x - (-1, -2)|^2 + 1)

All functions broadcast over leading axes, x has shape (..., 2); nothing here has a unit. Source: thesis "Optimierung
bei der Kalibrierung von Sensor-Roboter-Systemen", HAW Hamburg 2019, section 6.2 and listings C7-C9.
"""

from dataclasses import dataclass
from functools import cache, partial

import numpy as np
from scipy.optimize import minimize

from ...checks import as_choice, as_count, as_points, as_positive_number
from ...estimation import optimization as opt

CENTERS = np.array([[1.0, 1.0], [-1.0, -2.0]])
DEPTHS = np.array([100.0, 200.0])
ALONG = CENTERS[1] - CENTERS[0]
NAMES = ("local minimum", "global minimum", "saddle", "nowhere")
METHODS = ("newton", "gauss_newton", "levenberg_marquardt", "trust_region")


def _parts(x, width=1.0):
    """Offsets from both centers (..., 2, 2), q = squared distance + width^2 (..., 2), depths times width^2."""
    d, width = as_points(x, "x", 2)[..., None, :] - CENTERS, as_positive_number(width, "width")
    return d, (d * d).sum(-1) + width**2, DEPTHS * width**2


def value(x, width=1.0):
    """f(x), equation (6-16). A `width` other than 1 widens both wells at the same depth."""
    _, q, w = _parts(x, width)
    return -(w / q).sum(-1)


def gradient(x, width=1.0):
    """Gradient of f, equation (6-17); shape (..., 2)."""
    d, q, w = _parts(x, width)
    return ((2 * w / q**2)[..., None] * d).sum(-2)


def hessian(x, width=1.0):
    """Hessian of f, shape (..., 2, 2); agrees with the code of listing C9, not with the formulas of listing C7."""
    d, q, w = _parts(x, width)
    outer = d[..., :, None] * d[..., None, :]
    bowl = (2 * w / q**2).sum(-1)[..., None, None] * np.eye(2)
    return bowl - ((8 * w / q**3)[..., None, None] * outer).sum(-3)


def residual(x):
    """Four residuals whose squares add up to f + 300; (..., 2) -> (..., 4).

    The thesis does not say how it applied Gauss-Newton to a scalar function. Here each well gives the residual vector
    sqrt(w / q) (x - center), because w - w / q = w |x - center|^2 / q. The minima and the saddle stay where they are.
    Each term is the Geman-McClure loss of robust estimation: a target that stops pulling once it is far away.
    """
    d, q, _ = _parts(x)
    r = np.sqrt(DEPTHS / q)[..., None] * d
    return r.reshape(*r.shape[:-2], 4)


def jacobian(x):
    """Derivative of `residual`, shape (..., 4, 2)."""
    d, q, _ = _parts(x)
    J = np.sqrt(DEPTHS / q)[..., None, None] * (np.eye(2) - d[..., :, None] * d[..., None, :] / q[..., None, None])
    return J.reshape(*J.shape[:-3], 4, 2)


def model(method, x):
    """Quadratic model that one of `METHODS` builds of f at a point.

    Parameters
    ----------
    method : str
        Gauss-Newton and Levenberg-Marquardt put 2 J'J in place of the Hessian.
    x : array-like, shape (2,)

    Returns
    -------
    f, g, B : float, arrays of shapes (2,) and (2, 2)
        Value, gradient and curvature, in the units of f.
    """
    if method in ("gauss_newton", "levenberg_marquardt"):
        r, J = residual(x), jacobian(x)
        return float(value(x)), 2 * J.T @ r, 2 * J.T @ J
    return float(value(x)), gradient(x), hessian(x)


# --- The line through both centers ---


def on_line(t):
    """Place t on the line through both centers, 0 at (1, 1) and 1 at (-1, -2); (...) -> (..., 2)."""
    return CENTERS[0] + np.multiply.outer(t, ALONG)


def along_line(x):
    """The t of the place on the line that lies closest to x; (..., 2) -> (...)."""
    return (x - CENTERS[0]) @ ALONG / (ALONG @ ALONG)


def line_model(t):
    """Value, slope and curvature of f along the line through both centers, at a place t, by t."""
    x = on_line(t)
    return float(value(x)), float(gradient(x) @ ALONG), float(ALONG @ hessian(x) @ ALONG)


# --- What listing C7 prints ---


def printed_hessian(x):
    """Hessian as listing C7 prints it: H11 ends in -(-1600 (x1 - 1)^2) / q2^3, and H22 repeats H11."""
    d, q, _ = _parts(x)
    square = d[..., 0, 0] ** 2
    diagonal = (2 * DEPTHS / q**2).sum(-1) - 800 * square / q[..., 0] ** 3 + 1600 * square / q[..., 1] ** 3
    H = hessian(x).copy()
    H[..., 0, 0] = H[..., 1, 1] = diagonal
    return H


@dataclass(frozen=True)
class Extremum:
    """A stationary point: where, how deep, of what kind, with the eigenvalues of its Hessian."""

    x: np.ndarray
    value: float
    kind: str
    eigenvalues: np.ndarray


@cache
def extrema():
    """The three stationary points in the order of `NAMES`, found by Newton from three close starts."""
    starts = (CENTERS[0], CENTERS[1], CENTERS.mean(0) + (0.2, 0.3))
    found = [opt.newton(value, gradient, hessian, start, stop=opt.small_gradient(1e-12)).solution for start in starts]
    return tuple(_extremum(x) for x in found)


def _extremum(x):
    H = hessian(x)
    return Extremum(x, float(value(x)), opt.classify_extremum(gradient(x), H), np.linalg.eigvalsh(H))


def which(x, tol=1e-4):
    """Index into `NAMES` of the stationary point that lies within tol of x, 3 where none does; (..., 2) -> (...)."""
    return _which(as_points(x, "x", 2), tol)


def _which(x, tol=1e-4):
    near = np.stack([np.linalg.norm(x - e.x, axis=-1) <= tol for e in extrema()], axis=-1)
    return np.where(near.any(-1), near.argmax(-1), 3)


def run(method, start, width=1.0, **options):
    """Trace of one of `METHODS` on the two wells, from start, shape (2,).

    Newton and the trust region use gradient and Hessian, also of wells of another `width`. Raises ValueError where
    Gauss-Newton or Levenberg-Marquardt, which use the residual, are asked for another width: it is that of width 1.
    """
    f, g, H = (partial(of, width=width) for of in (value, gradient, hessian))
    if method in ("gauss_newton", "levenberg_marquardt"):
        if width != 1.0:
            raise ValueError(f"{method} uses the residual of width 1, got width {width:g}")
        return getattr(opt, method)(residual, jacobian, start, **options)
    if method == "newton":
        return opt.newton(f, g, H, start, **options)
    if method == "trust_region":
        return opt.trust_region(f, g, start, hessian=H, **options)
    raise ValueError(f"method must be one of {', '.join(METHODS)}, got {method!r}")


# --- A whole picture of starts at once ---


def destinations(method, starts, max_iterations=100):
    """Where one of `METHODS` ends from many starts, all advanced together.

    Parameters
    ----------
    method : str
        One of `METHODS`, with the settings of `run`.
    starts : array-like, shape (..., 2)

    Returns
    -------
    label : array of int, shape (...)
        Index into `NAMES`.
    steps : array of int, shape (...)
        Steps tried until x moved by less than 1e-10, or max_iterations.
    """
    advance, first = _ADVANCE[as_choice(method, "method", METHODS)]
    starts, max_iterations = as_points(starts, "starts", 2), as_count(max_iterations, "max_iterations", at_least=0)
    x = starts.reshape(-1, 2).copy()
    memory = first(x)
    steps, open_ = np.zeros(len(x), dtype=int), np.arange(len(x))
    for _ in range(max_iterations):
        if not len(open_):
            break
        old = x[open_]
        new, moved, memory = advance(old, memory)
        x[open_], steps[open_] = new, steps[open_] + 1
        going = ((np.abs(new - old).max(-1) > 1e-10) | ~moved) & (np.abs(new).max(-1) < 1e4)
        open_, memory = open_[going], memory[going]
    shape = starts.shape[:-1]
    return _which(x).reshape(shape), steps.reshape(shape)


def _advance_newton(x, memory):
    return x + opt.newton_step(gradient(x), hessian(x)), np.ones(len(x), dtype=bool), memory


def _advance_gauss_newton(x, memory):
    return x + opt.gauss_newton_step(residual(x), jacobian(x)), np.ones(len(x), dtype=bool), memory


def _advance_levenberg_marquardt(x, memory):
    r, J = residual(x), jacobian(x)
    JT = np.swapaxes(J, -1, -2)
    g, B = (JT @ r[..., None])[..., 0], JT @ J
    damping, growth = memory.T
    step = opt.newton_step(g, B + damping[:, None, None] * np.eye(2))
    cost, new_cost = 0.5 * (r * r).sum(-1), 0.5 * (value(x + step) + DEPTHS.sum())
    gain = opt.gain_ratio(cost, new_cost, g, B, step)
    good = gain > 0
    damping = damping * np.where(good, np.maximum(1 / 3, 1 - (2 * np.where(good, gain, 0) - 1) ** 3), growth)
    growth = np.where(good, 2.0, 2 * growth)
    return np.where(good[:, None], x + step, x), good, np.stack([damping, growth], axis=-1)


def _advance_trust_region(x, radius):
    g, H = gradient(x), hessian(x)
    step = opt.dogleg_step(g, H, radius)
    gain = opt.gain_ratio(value(x), value(x + step), g, H, step)
    good = gain > 0.1
    radius = opt.next_radius(radius, np.linalg.norm(step, axis=-1), gain, 1e3)
    return np.where(good[:, None], x + step, x), good, radius


def _first_damping(x):
    return np.stack([1e-3 * (jacobian(x) ** 2).sum(-2).max(-1), np.full(len(x), 2.0)], axis=-1)


_ADVANCE = {
    "newton": (_advance_newton, lambda x: np.zeros(len(x))),
    "gauss_newton": (_advance_gauss_newton, lambda x: np.zeros(len(x))),
    "levenberg_marquardt": (_advance_levenberg_marquardt, _first_damping),
    "trust_region": (_advance_trust_region, lambda x: np.ones(len(x))),
}


def luck(landings=4, methods=5):
    """Probability that at least one of several methods has all landings right if each is the toss of a coin."""
    return 1 - (1 - 0.5**landings) ** methods


def stand_ins(start):
    """{name: (end, iterations)} of the stand-ins from one start, to a gradient of 1e-6; `end` indexes `wells.NAMES`."""
    rule = opt.small_gradient(1e-6)
    runs = [run(method, start, stop=rule) for method in METHODS[1:]]
    runs.append(run("trust_region", start, radius=10.0, subproblem=opt.exact_step, stop=rule))
    found = [(int(which(run.solution)), run.iterations) for run in runs]
    bfgs = minimize(value, start, method="BFGS")
    return {"BFGS": (int(which(bfgs.x, 1e-3)), bfgs.nit)} | dict(zip(("GN", "LM", "dogleg", "exact"), found))
