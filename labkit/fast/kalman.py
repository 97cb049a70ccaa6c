"""The time-invariant linear filter along a series; equals `estimation.kalman.filter_steps`."""

import itertools
import math

import numpy as np
from scipy import signal

from ..checks import as_covariances, as_finite, as_positive, as_shape
from ..estimation.kalman import _after, _symmetric

SETTLED = 1e-13  # relative change of a gain below which the time-invariant filter counts as settled


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
