"""The path of a robot from its own log; equals `localization.path.filter_path`.

What the odometry does between two readings does not depend on the pose: the way, the turn and the covariance they add
are turned along with the heading. Sums over all rows give them for any interval, so the filter takes one step a
reading, however many rows lie between, and the poses at the rows follow in one sweep.
"""

import math

import numpy as np

from ..checks import as_covariances, as_instance, as_shape
from ..localization.path import LIMIT, Log, Noise, Path


def filter_path(log, x0, cov0, noise):
    """Extended Kalman filter along a log: arguments and result of `localization.path.filter_path`."""
    as_instance(log, "log", Log), as_instance(noise, "noise", Noise)
    x0, cov0 = as_shape(x0, "x0", 3), as_shape(as_covariances(cov0, "cov0", 3), "cov0", 3, 3)
    n, k = len(log.time), len(log.z)
    at_row = np.arange(n) + np.searchsorted(log.row, np.arange(n), side="left")
    at_reading = np.arange(k) + log.row + 1
    D, sums = _dead_reckoning(log, at_row, at_reading, noise)
    states, told = _filter(log, x0, cov0, noise, *_between(D, sums, np.concatenate([[0], at_reading])))
    # the last reading before each row, or at it; 0 is the start
    last = np.searchsorted(log.row, np.arange(n), side="left")
    last = np.maximum(last, np.searchsorted(log.row + np.where(log.lag > 0, 0.5, 0.0), np.arange(n), side="right"))
    stops = np.concatenate([[0], at_reading])[last]
    x, cov = _carried(states[last], D[stops], D[at_row], sums[at_row] - sums[stops])
    nis, log_det, used, landmark = zip(*told) if told else ((), (), (), ())
    return Path(x, cov, np.array(nis), np.array(log_det), np.array(used, bool), np.array(landmark, int))


def _dead_reckoning(log, at_row, at_reading, noise):
    """Poses (N, 3) of dead reckoning from 0 at every row and reading, and sums (N, 9) of what its noise adds.

    The sums are of h var_way (cc, cs, ss) and of h var_turn (1, x, y, xx, xy, yy) at the middle of each step h.
    """
    N = len(log.time) + len(log.z)
    time, u = np.empty(N), np.empty((N, 2))
    time[at_row], time[at_reading] = log.time, log.time[log.row] + log.lag
    u[at_row], u[at_reading] = log.u, log.u[log.row]
    h = np.diff(time)
    turn = np.concatenate([[0.0], np.cumsum(h * u[:-1, 1])])
    middle = turn[:-1] + 0.5 * h * u[:-1, 1]
    c, s = np.cos(middle), np.sin(middle)
    way = np.stack([h * u[:-1, 0] * c, h * u[:-1, 0] * s], 1)
    place = np.concatenate([np.zeros((1, 2)), np.cumsum(way, axis=0)])
    x, y = (place[:-1] + 0.5 * way).T
    steps = np.stack([c * c, c * s, s * s, np.ones_like(x), x, y, x * x, x * y, y * y], 1) * h[:, None]
    steps[:, :3] *= noise.std_way**2
    steps[:, 3:] *= noise.std_turn**2
    return np.column_stack([place, turn]), np.concatenate([np.zeros((1, 9)), np.cumsum(steps, axis=0)])


def _added(end, sums):
    """Covariance (6 entries) that an interval adds, in the axes of dead reckoning; end (..., 2), sums (..., 9)."""
    cc, cs, ss, one, x, y, xx, xy, yy = np.moveaxis(sums, -1, 0)
    X, Y = np.moveaxis(end, -1, 0)
    return np.stack(
        [
            cc + Y * Y * one - 2 * Y * y + yy,
            cs - (X * Y * one - X * y - Y * x + xy),
            -(Y * one - y),
            ss + X * X * one - 2 * X * x + xx,
            X * one - x,
            one,
        ],
        -1,
    )


def _between(D, sums, stops):
    """Increments of dead reckoning from stop to stop and the covariances they add."""
    return D[stops], np.diff(D[stops], axis=0), _added(D[stops[1:], :2], np.diff(sums[stops], axis=0))


def _filter(log, x0, cov0, noise, D, increments, added):
    """States (k + 1, 9), the pose and six entries of the covariance behind each reading, and what is told of each."""
    state = (*x0.tolist(), *cov0[(0, 0, 0, 1, 1, 2), (0, 1, 2, 1, 2, 2)].tolist())
    var_r, var_b = noise.std_range**2, noise.std_bearing**2
    states, told, marks = [state], [], log.landmarks.tolist()
    everyone = list(range(len(marks)))
    rows = zip(D[:-1, 2].tolist(), increments.tolist(), added.tolist(), log.z.tolist(), log.landmark.tolist())
    for heading, step, more, (distance, bearing), which in rows:
        state = _moved(state, heading, step, more)
        best = second = None
        for m in everyone if which < 0 else (which,):
            found = _innovation(state, marks[m], distance, bearing, var_r, var_b)
            if best is None or found[0] < best[0]:
                best, second, matched = found, best, m
            elif second is None or found[0] < second[0]:
                second = found
        used = best[0] <= LIMIT and (second is None or second[0] > LIMIT)
        if used:
            state = _corrected(state, best)
        told.append((best[0], math.log(best[6]), used, matched if used or which >= 0 else -1))
        states.append(state)
    return np.array(states), told


def _moved(state, heading, step, more):
    """The state after an increment of dead reckoning that began with another heading."""
    x, y, theta, a, b, c, d, e, f = state
    turn = theta - heading
    C, S = math.cos(turn), math.sin(turn)
    dx, dy = C * step[0] - S * step[1], S * step[0] + C * step[1]
    q0, q1, q2, q3, q4, q5 = more
    # F = [[1, 0, -dy], [0, 1, dx], [0, 0, 1]], then the covariance added, turned
    ca, ea = c - dy * f, e + dx * f
    return (
        x + dx,
        y + dy,
        theta + step[2],
        a - dy * (c + ca) + C * C * q0 - 2 * C * S * q1 + S * S * q3,
        b + dx * c - dy * ea + C * S * (q0 - q3) + (C * C - S * S) * q1,
        ca + C * q2 - S * q4,
        d + dx * (e + ea) + S * S * q0 + 2 * C * S * q1 + C * C * q3,
        ea + S * q2 + C * q4,
        f + q5,
    )


def _innovation(state, mark, distance, bearing, var_r, var_b):
    """(nis, innovation, S as three numbers, its determinant, the two columns cov H')."""
    x, y, theta, a, b, c, d, e, f = state
    dx, dy = mark[0] - x, mark[1] - y
    q = dx * dx + dy * dy
    r = math.sqrt(q)
    hx, hy, bx, by = -dx / r, -dy / r, dy / q, -dx / q
    er = distance - r
    eb = (bearing - math.atan2(dy, dx) + theta + math.pi) % math.tau - math.pi
    p0, p1, p2 = a * hx + b * hy, b * hx + d * hy, c * hx + e * hy
    g0, g1, g2 = a * bx + b * by - c, b * bx + d * by - e, c * bx + e * by - f
    s00, s01, s11 = hx * p0 + hy * p1 + var_r, hx * g0 + hy * g1, bx * g0 + by * g1 - g2 + var_b
    det = s00 * s11 - s01 * s01
    nis = (s11 * er * er - 2 * s01 * er * eb + s00 * eb * eb) / det
    return nis, er, eb, s00, s01, s11, det, (p0, p1, p2), (g0, g1, g2)


def _corrected(state, found):
    x, y, theta, a, b, c, d, e, f = state
    _, er, eb, s00, s01, s11, det, p, g = found
    k = [((s11 * u - s01 * v) / det, (s00 * v - s01 * u) / det) for u, v in zip(p, g)]
    (k0, l0), (k1, l1), (k2, l2) = k
    return (
        x + k0 * er + l0 * eb,
        y + k1 * er + l1 * eb,
        theta + k2 * er + l2 * eb,
        a - k0 * p[0] - l0 * g[0],
        b - k0 * p[1] - l0 * g[1],
        c - k0 * p[2] - l0 * g[2],
        d - k1 * p[1] - l1 * g[1],
        e - k1 * p[2] - l1 * g[2],
        f - k2 * p[2] - l2 * g[2],
    )


def _carried(states, start, end, sums):
    """Poses (n, 3) and covariances (n, 3, 3) of states carried along dead reckoning, all at once."""
    turn = states[:, 2] - start[:, 2]
    C, S = np.cos(turn), np.sin(turn)
    d = end - start
    dx, dy = C * d[:, 0] - S * d[:, 1], S * d[:, 0] + C * d[:, 1]
    x = states[:, :3] + np.stack([dx, dy, d[:, 2]], 1)
    index = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
    P, Q = states[:, 3:][:, index], _added(end[:, :2], sums)[:, index]
    F, R = (np.tile(np.eye(3), (len(x), 1, 1)) for _ in range(2))
    F[:, 0, 2], F[:, 1, 2] = -dy, dx
    R[:, 0, 0], R[:, 0, 1], R[:, 1, 0], R[:, 1, 1] = C, -S, S, C
    return x, F @ P @ np.swapaxes(F, 1, 2) + R @ Q @ np.swapaxes(R, 1, 2)
