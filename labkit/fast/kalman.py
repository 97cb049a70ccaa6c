"""The linear filter along a long series of single numbers; equals `estimation.kalman.filter_steps`."""

import itertools
import math

import numpy as np
from scipy import signal

from ..estimation import kalman as readable
from ..estimation.kalman import Corrected, _series

SETTLED = 1e-13  # change of the covariance, in standard deviations, below which the filter counts as settled
SINGULAR = "C cov C' + cov_z must be positive definite, but it is singular"


def filter_steps(z, A, C, cov_z, x0, cov0, B=None, u=None, cov_u=None, cov_v=None):
    """`estimation.kalman.filter_steps`, which has the arguments, for one number measured in every step.

    The gains do not depend on the data. They are computed until they settle; from there on the filter is a linear
    recursion with constant coefficients, which `scipy.signal.lfilter` runs in compiled code. Where a measurement is
    missing, holds several numbers, or a control moves the state, the readable twin does the work.
    """
    given = _series(z, A, C, cov_z, x0, cov0, B, u, cov_u, cov_v)
    if len(given.C) != 1 or not len(given.z) or given.missing.any() or given.push.any():
        return readable.filter_steps(z, A, C, cov_z, x0, cov0, B, u, cov_u, cov_v)
    A, C, r, z = given.A, given.C[0], float(given.cov_z[0, 0]), given.z[:, 0]
    start = _until_settled_2 if len(A) == 2 else _until_settled
    states, covs, gains, variances = start(z, A, C, given.spread, r, given.x0, given.cov0)
    steps = len(z)
    if len(states) < steps:
        states = _steady_run(z, A, C, gains[-1], states)
    innovation, by_state = z.copy(), C @ A
    innovation[0] -= by_state @ given.x0
    innovation[1:] -= states[:-1] @ by_state
    return Corrected(
        states,
        _held(covs, steps),
        innovation[:, None],
        _held(variances, steps)[:, None, None],
        _held(gains, steps)[:, :, None],
        np.ones(steps, int),
    )


def _held(values, steps):
    """The values, the last one repeated up to `steps` of them; one entry after the other in memory, quick to fill."""
    values, done = np.moveaxis(values, 0, -1), len(values)
    out = np.empty((*values.shape[:-1], steps))
    out[..., :done], out[..., done:] = values, values[..., -1:]
    return np.moveaxis(out, -1, 0)


def _until_settled(z, A, C, cov_v, r, x, cov):
    """Steps until all stands still, at least n of them: states, covariances, gains, variances of innovations."""
    out, old = [], np.inf
    for value in z:
        x, cov = A @ x, readable._symmetric(A @ cov @ A.T + cov_v)
        s = C @ cov @ C + r
        if s == 0:
            raise ValueError(SINGULAR)
        gain = cov @ C / s
        x = x + gain * (value - C @ x)
        cov = readable._after(cov, gain[:, None], C[None, :], np.array([[r]]))
        out.append((x, cov, gain, s))
        std = np.sqrt(np.maximum(np.diagonal(cov), 0.0))
        if len(out) >= len(A) and (np.abs(cov - old) <= SETTLED * np.outer(std, std)).all():
            break
        old = cov
    return tuple(np.array(column) for column in zip(*out))


def _until_settled_2(z, A, C, cov_v, r, x, cov):
    """`_until_settled` for two states, written out: ten times faster than arrays of four numbers."""
    (a, b), (c, d) = A.tolist()
    h0, h1 = C.tolist()
    (q00, q01), (_, q11) = cov_v.tolist()
    (p00, p01), (_, p11) = cov.tolist()
    x0, x1 = x.tolist()
    out, o00, o01, o11 = [], math.inf, math.inf, math.inf
    for value in itertools.chain.from_iterable(z[k : k + 256].tolist() for k in range(0, len(z), 256)):
        x0, x1 = a * x0 + b * x1, c * x0 + d * x1
        m00, m01, m10, m11 = a * p00 + b * p01, a * p01 + b * p11, c * p00 + d * p01, c * p01 + d * p11
        p00, p01, p11 = m00 * a + m01 * b + q00, m00 * c + m01 * d + q01, m10 * c + m11 * d + q11
        g0, g1 = p00 * h0 + p01 * h1, p01 * h0 + p11 * h1
        s = h0 * g0 + h1 * g1 + r
        if s == 0:
            raise ValueError(SINGULAR)
        l0, l1 = g0 / s, g1 / s
        e = value - h0 * x0 - h1 * x1
        x0, x1 = x0 + l0 * e, x1 + l1 * e
        n00, n01, n10, n11 = p00 - l0 * g0, p01 - l0 * g1, p01 - l1 * g0, p11 - l1 * g1  # the short form, and
        j0, j1 = r * l0 - n00 * h0 - n01 * h1, r * l1 - n10 * h0 - n11 * h1  # what Joseph's adds: 0 but for rounding
        p00, p01, p11 = n00 + l0 * j0, n01 + l1 * j0, n11 + l1 * j1
        out.append((x0, x1, p00, p01, p01, p11, l0, l1, s))
        if abs(p00 - o00) <= SETTLED * p00 and abs(p11 - o11) <= SETTLED * p11:
            settled = (p01 - o01) ** 2 <= SETTLED * p00 * SETTLED * p11
            if settled and len(out) >= 2:
                break
        o00, o01, o11 = p00, p01, p11
    out = np.array(out)
    return out[:, :2], out[:, 2:6].reshape(-1, 2, 2), out[:, 6:8], out[:, 8]


def _steady_run(z, A, C, gain, out):
    """The recursion x = M x + gain z with M = (I - gain C) A, continued by one filter of order n per state."""
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
    states = np.empty((n, len(z)))
    states[:, :done] = out.T
    for i, numerator in enumerate(numerators):
        past_z, past_x = z[done - n : done][::-1], out[done - n : done, i][::-1]
        memory = [numerator[k:] @ past_z[: n + 1 - k] - a[k:] @ past_x[: n + 1 - k] for k in range(1, n + 1)]
        states[i, done:] = signal.lfilter(numerator, a, z[done:], zi=memory)[0]
    return states.T
