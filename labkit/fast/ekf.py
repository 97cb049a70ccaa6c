"""The landmark filter along a drive, in information form; equals steps of `localization.ekf.ekf_step`."""

import math

import numpy as np

from ..checks import as_covariances, as_points, as_positive_number, as_readings, as_shape
from ..localization.ekf import Localization, _control_covariances


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
