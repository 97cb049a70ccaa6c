"""Hand-eye calibration with a sphere from sums over the poses; equals `calibration.hand_eye`.

Translation and target enter linearly and are eliminated once; what remains is a quadratic function of the nine entries
of the rotation matrix, r'Sr - 2 h'r + c. It is solved freely (the linear start), and then on SO(3) by Newton steps that
no longer depend on the number of poses.
"""

import math

import numpy as np

from ..calibration.hand_eye import (
    MAX_STEPS,
    calibrate_with,
    refuse_undetermined,
    right_angled,
    rms_distance,
    sphere_residuals,
)
from ..calibration.motion import MIN_TURN
from ..documented import unchecked
from ..geometry.lie import nearest_rotation, skew

NARROW = 1e-5  # relative spread of the sphere's places below which the readable refusal has a look
_EYE = np.eye(3)
_GENERATORS = skew(_EYE)  # derivatives of a small rotation about x, y, z


def calibrate_sphere_target(T_BF, x_S, target=None, robust=False, rng=None):
    """Scanner on the flange and center of the sphere: `labkit.calibration.hand_eye.calibrate_sphere_target`."""
    return unchecked(calibrate_with)(_fit, T_BF, x_S, target, robust, rng)


def _fit(T_BF, x_S, weights, target, max_steps, start=None):
    """Least squares with given weights: T_FS, target and the rms distance of the iterates."""
    mean, G, total = _moments(T_BF[:, :3, :3], T_BF[:, :3, 3], x_S, weights, target)
    if not _is_clearly_determined(mean, G, total, target):
        unchecked(refuse_undetermined)(T_BF, x_S, weights, target is not None)
    T_FS = np.eye(4)
    if target is not None:
        T_FS[:3, :3] = nearest_rotation(G[3:6, :3])
        T_FS[:3, 3] = mean[3:6] - T_FS[:3, :3] @ mean[:3]
        return T_FS, target, [rms_distance(sphere_residuals(T_BF, x_S, T_FS, target))]
    S, h, c, recover = _reduce(mean, G)
    T_FS[:3, :3], costs = _descend(S, h, _rotation_start(S, h) if start is None else start, max_steps)
    T_FS[:3, 3], center = recover(T_FS[:3, :3])
    return T_FS, center, [math.sqrt(max(cost + c, 0.0) / total) for cost in costs]


def _moments(R, t, x, w, target):
    """All that the sums over the poses need: weighted mean (15,) and scatter (15, 15) of x, b and R, and the total
    weight.

    b = R' (target - t) with the target at 0 while it is unknown: where the sphere lies from the flange, but for its
    turned center.
    """
    Z = np.empty((len(R), 15))
    Z[:, :3], Z[:, 3:6], Z[:, 6:] = x, ((target - t if target is not None else -t)[:, None] @ R)[:, 0], R.reshape(-1, 9)
    total = float(w.sum())
    mean = w @ Z / total
    Z -= mean
    return mean, (Z * w[:, None]).T @ Z, total


def _turning(G):
    """Sum of dR dR' over the poses, whose small eigenvalue is an axis that all of them share."""
    return G[6:, 6:].reshape(3, 3, 3, 3).trace(axis1=1, axis2=3)


def _is_clearly_determined(mean, G, total, target):
    """Quick bounds that clear most pose sets without an eigenvalue; what they do not clear is looked at closely."""
    M, far = G[:3, :3], total * (mean[:3] @ mean[:3])
    size = M.trace()
    minors = 0.5 * (size * size - np.vdot(M, M))  # about the product of the two largest eigenvalues
    if not minors > NARROW**2 * max(size, 1e-12 * far) ** 2:
        return False
    W = _turning(G)
    # the least eigenvalue of W is at least 4 det / trace^2
    return target is not None or 4 * np.linalg.det(W) > 2 * total * MIN_TURN**2 * W.trace() ** 2


def _reduce(mean, G):
    """The cost without translation and target, r'Sr - 2 h'r + c in the entries r of R_FS, and how to get both back."""
    x_mean, b_mean, R_mean = mean[:3], mean[3:6], mean[6:].reshape(3, 3)
    W_inverse = np.linalg.inv(_turning(G))
    D, d = G[6:, :3].reshape(3, 9), G[6:, 3:6].reshape(3, 3, 3).trace(axis1=1, axis2=2)
    DW = D.T @ W_inverse
    S = -DW @ D
    for k in (0, 3, 6):
        S[k : k + 3, k : k + 3] += G[:3, :3]
    h = G[3:6, :3].ravel() - DW @ d
    c = G[3, 3] + G[4, 4] + G[5, 5] - d @ W_inverse @ d

    def recover(R_FS):
        center = W_inverse @ (D @ R_FS.ravel() - d)
        return b_mean + center @ R_mean - R_FS @ x_mean, center

    return S, h, c, recover


def _rotation_start(S, h):
    """Rotation next to the unconstrained minimum S^-1 h, or the best of 24 right-angled ones where S is singular."""
    values, vectors = np.linalg.eigh(S)
    if values[0] > 1e-9 * values[8]:
        return nearest_rotation(((vectors / values) @ (h @ vectors)).reshape(3, 3))
    return min((_descend(S, h, Q, MAX_STEPS) for Q in right_angled()), key=lambda found: found[1][-1])[0]


def _descend(S, h, R_FS, steps):
    """Newton on SO(3) for r'Sr - 2 h'r, Gauss-Newton where that points uphill, steps halved until they descend.

    A short step is followed by one more with the same matrix, which leaves an error of its third power. Returns the
    rotation and the cost of each iterate.
    """
    gradient = S @ R_FS.ravel() - h
    costs = [R_FS.ravel() @ (gradient - h)]
    floor = 1e-15 * (abs(R_FS.ravel() @ h) + abs(costs[0]))

    def moved(step, size):
        Q = _turn(*step.tolist(), size) @ R_FS
        q = Q.ravel()
        slope = S @ q - h
        return Q, slope, q @ (slope - h)

    for _ in range(steps):
        G = (_GENERATORS @ R_FS).reshape(3, 9)
        slope, H = G @ gradient, G @ S @ G.T
        Z = gradient.reshape(3, 3) @ R_FS.T
        inverse = np.linalg.inv(H + 0.5 * (Z + Z.T) - Z.trace() * _EYE)
        step = -(inverse @ slope)
        if slope @ step > 0:
            step = -np.linalg.solve(H, slope)
        size = math.sqrt(step @ step)
        if size > 1.0:
            step, size = step / size, 1.0
        Q, new_gradient, cost = moved(step, size)
        while cost > costs[-1] + floor and size >= 1e-12:
            step, size = step / 2, size / 2
            Q, new_gradient, cost = moved(step, size)
        R_FS, gradient = Q, new_gradient
        costs.append(cost)
        if size < 1e-7:  # the next Newton step would be below 1e-13
            break
        if size < 1e-2:
            step = -(inverse @ ((_GENERATORS @ R_FS).reshape(3, 9) @ gradient))
            again = math.sqrt(step @ step)
            R_FS, gradient, cost = moved(step, again)
            costs.append(cost)
            if size * again < 1e-9:
                break
    return R_FS, costs


def _turn(x, y, z, angle):
    """Rodrigues' formula for one rotation vector of known length, in plain floats: a tenth of the time of `exp_so3`."""
    a = math.sin(angle) / angle if angle > 1e-7 else 1.0
    b = (1 - math.cos(angle)) / angle**2 if angle > 1e-4 else 0.5
    return np.array(
        [
            [1 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y],
            [b * x * y + a * z, 1 - b * (x * x + z * z), b * y * z - a * x],
            [b * x * z - a * y, b * y * z + a * x, 1 - b * (x * x + y * y)],
        ]
    )
