"""The landmark filter along a drive, in information form; equals `localization.ekf.ekf_localize`."""

import math

import numpy as np

from ..localization import ekf as readable
from ..localization.ekf import ON_LANDMARK, Localization, _given


def ekf_localize(
    u, z, landmarks, x0, cov0, dt, std_range, std_bearing, cov_u=None, cov_v=None, model="euler", wrap=True
):
    """`localization.ekf.ekf_localize`, which has the arguments, one robot or many at once.

    The correction is in information form: with W = sum H' R^-1 H over the landmarks, cov = prior (I + W prior)^-1. It
    equals the lecture's gain form for independent measurements, and inverts one 3 x 3 matrix whatever their number.
    Where v and omega are correlated, or the model is the arc, the readable twin does the work.
    """
    given = _given(u, z, landmarks, x0, cov0, dt, std_range, std_bearing, cov_u, cov_v, model, wrap)
    if model == "arc" or given.cov_u[:, 0, 1].any() or not len(given.u):
        return readable.ekf_localize(u, z, landmarks, x0, cov0, dt, std_range, std_bearing, cov_u, cov_v, model, wrap)
    var_u = np.diagonal(given.cov_u, axis1=-2, axis2=-1)
    weights = 1 / given.std_range**2, 1 / given.std_bearing**2
    run = _filter_many if given.z.ndim == 4 else _filter_one
    try:
        x, cov, score = run(given, weights, var_u, 0.5 if model == "midpoint" else 0.0)
    except ZeroDivisionError:
        raise ValueError("the covariance of the innovation must be positive definite, but it is singular") from None
    return Localization(x, cov, score, np.isfinite(given.z).sum((-1, -2)))


_UPPER = ((0, 0, 0, 1, 1, 2), (0, 1, 2, 1, 2, 2))


def _filter_one(given, weights, var_u, turn):
    """One robot on Python floats: no array is worth its call for three numbers."""
    pose, P, extra = given.x0.tolist(), given.cov0[_UPPER].tolist(), given.cov_v[_UPPER].tolist()
    (w_r, w_b), dt, wrap, marks, out = weights, given.dt, given.wrap, given.landmarks.tolist(), []
    hypot, atan2, pi, tau = math.hypot, math.atan2, math.pi, math.tau
    for (v, w), noise, seen in zip(given.u.tolist(), var_u.tolist(), given.z.tolist()):
        pose, P = _move(pose, P, v, w, dt, noise, extra, turn)
        x, y, theta = pose
        a = b = c = d = e = f = g0 = g1 = g2 = score = 0.0
        for (lx, ly), (distance, bearing) in zip(marks, seen):
            dx, dy = lx - x, ly - y
            if distance != distance:  # NaN: not seen
                if dx == dy == 0:
                    raise ValueError(ON_LANDMARK)
                continue
            r = hypot(dx, dy)
            try:
                ux, uy = dx / r, dy / r
            except ZeroDivisionError:
                raise ValueError(ON_LANDMARK) from None
            bx, by = uy / r, ux / r  # the bearing by x and, negative, by y
            er, eb = distance - r, bearing - atan2(dy, dx) + theta
            if wrap:
                eb = (eb + pi) % tau - pi
            wx, wy, vx, vy = w_r * ux, w_r * uy, w_b * bx, w_b * by
            a, b, d = a + wx * ux + vx * bx, b + wx * uy - vx * by, d + wy * uy + vy * by
            c, e, f = c - vx, e + vy, f + w_b
            g0, g1, g2 = g0 - wx * er + vx * eb, g1 - wy * er - vy * eb, g2 - w_b * eb
            score += w_r * er * er + w_b * eb * eb
        pose, P, explained = _absorb(pose, P, (a, b, c, d, e, f), (g0, g1, g2))
        out += pose
        out += P
        out.append(score - explained)
    out = np.array(out).reshape(-1, 10)
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


def _filter_many(given, weights, var_u, turn):
    """Many robots at once: states (3, runs), covariances (3, 3, runs), so that every operation runs along the runs."""
    (steps, runs, m, _), u, dt = given.z.shape, given.u, given.dt
    u = np.broadcast_to(u if u.ndim == 3 else u[:, None, :], (steps, runs, 2)).transpose(0, 2, 1)
    pose, P = given.x0.T.copy(), given.cov0.transpose(1, 2, 0).copy()
    marks, extra, noisy = given.landmarks.T[:, :, None], given.cov_v[:, :, None], given.cov_v.any()
    z = np.ascontiguousarray(given.z.transpose(0, 3, 2, 1))  # step, number, landmark, run
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
        _measured_many(pose, marks, z[k], given.wrap, H, y)
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


def _measured_many(pose, marks, z, wrap, H, y):
    """Innovations of all landmarks into y (2, m, runs), and how they change with the pose into H (3, 2, m, runs)."""
    d = marks - pose[:2, None]
    minus_q = d[0] * d[0]
    minus_q += d[1] * d[1]
    if not minus_q.all():
        raise ValueError(ON_LANDMARK)
    r = np.sqrt(minus_q)
    np.negative(minus_q, out=minus_q)
    np.subtract(z[0], r, out=y[0])
    np.subtract(z[1], np.arctan2(d[1], d[0]), out=y[1])
    y[1] += pose[2]
    if wrap:
        y[1] -= math.tau * np.rint(y[1] * (1 / math.tau))
    np.negative(r, out=r)
    np.divide(d, r, out=H[:2, 0])
    np.divide(d[1], minus_q, out=H[0, 1])
    np.negative(H[0, 1], out=H[0, 1])
    np.divide(d[0], minus_q, out=H[1, 1])


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
