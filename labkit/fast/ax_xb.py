"""Maximum-likelihood hand-eye calibration from sums over the poses; equals `calibration.ax_xb`.

The cost depends on the N poses through two small matrices only, so an iteration takes the same time for 20 poses and
for 20000.
"""

import numpy as np

from ..calibration.ax_xb import (
    MAX_STEPS,
    STEP_TOLERANCE,
    _length,
    calibrate_with,
    kronecker_matrix,
    linear_rotations,
    noise_levels,
)
from ..checks import as_transforms
from ..documented import unchecked
from ..geometry.frames import pose
from ..geometry.lie import nearest_rotation, skew

_GENERATORS = skew(np.eye(3))  # (3, 3, 3): d/dphi_k exp(phi) at 0
_I3 = np.eye(3)


def calibrate_hand_eye(T_BF, T_ST, std_rot=None, std_trans=None, robust=False, *, eye="in hand"):
    """Poses of sensor and target from noisy readings: `labkit.calibration.ax_xb.calibrate_hand_eye`."""
    return unchecked(calibrate_with)(_fit, T_BF, T_ST, std_rot, std_trans, robust, eye)


def solve_ax_xb(A, B):
    """Mountings from many readings of the same motions at once: `labkit.calibration.ax_xb.solve_ax_xb`.

    Motions whose axes are parallel are not refused: noise alone then decides the free angle of each mounting.

    Parameters
    ----------
    A : array-like, shape (N, 4, 4)
        Motions of the flange (mm).
    B : array-like, shape (..., N, 4, 4)
        Readings of them by the sensor (mm).

    Returns
    -------
    T_FS : array, shape (..., 4, 4)

    Raises
    ------
    ValueError
        Fewer than two motions, or not as many of both.
    """
    A, B = as_transforms(A, "A"), as_transforms(B, "B")
    if A.ndim != 3 or B.shape[-3:] != A.shape or len(A) < 2:
        raise ValueError(f"A and B must have shapes (N, 4, 4) and (..., N, 4, 4) with N >= 2, got {A.shape}, {B.shape}")
    runs, n = B.shape[:-3], len(A)
    every = np.broadcast_to(A, B.shape)
    M = unchecked(kronecker_matrix)(every.reshape(-1, 4, 4), B.reshape(-1, 4, 4)).reshape(*runs, 9 * n, 9)
    X = np.swapaxes(np.linalg.svd(M, full_matrices=False)[2][..., -1, :].reshape(*runs, 3, 3), -1, -2)
    R = nearest_rotation(X * np.where(np.linalg.det(X) < 0, -1.0, 1.0)[..., None, None])
    K1 = (_I3 - A[:, :3, :3]).reshape(-1, 3)
    K2 = every[..., :3, 3] - (R[..., None, :, :] @ B[..., :3, 3, None])[..., 0]
    return pose(R, K2.reshape(*runs, 3 * n) @ np.linalg.pinv(K1).T)


def _fit(robot, T_ST, weights, given):
    """Gauss-Newton on the rotations of sensor and target alone, the translations eliminated."""
    size = _length(robot, T_ST)
    K, H, elimination, mean, sum_A, total = _sums(robot, T_ST, weights)
    H9, h, h0 = H[:9, :9], H[:9, 9], H[9, 9]
    normal_r = np.empty((6, 6))
    normal_r[:3, :3] = normal_r[3:, 3:] = total * _I3
    normal_r[:3, 3:], normal_r[3:, :3] = -sum_A, -sum_A.T
    both, freedom, history = unchecked(linear_rotations)(robot, T_ST, weights), 3 * total - 6, []
    for _ in range(MAX_STEPS):
        x, y = both.reshape(2, 9)
        Lx, Ly = (both[:, None] @ _GENERATORS).reshape(2, 3, 9)
        Kx, Hx = K @ x, H9 @ x + h
        std_r, std_t = unchecked(noise_levels)(3 * total - y @ Kx, x @ Hx + h @ x + h0, (freedom, freedom), given, size)
        normal, gradient = normal_r / std_r**2, np.empty(6)
        normal[:3, :3] += Lx @ H9 @ Lx.T / std_t**2
        gradient[:3] = Lx @ (Hx / std_t**2 - 0.5 / std_r**2 * (K.T @ y))
        gradient[3:] = -0.5 / std_r**2 * (Ly @ Kx)
        step = -np.linalg.solve(normal, gradient)
        both = _turned(both, step.reshape(2, 3))
        largest = np.abs(step).max()
        history.append((std_r, std_t, largest))
        if largest < STEP_TOLERANCE:
            break
    T = np.zeros((2, 4, 4))
    T[:, :3, :3], T[:, 3, 3] = both, 1.0
    T[0, :3, 3] = -elimination @ np.append(both[0].ravel(), 1.0)
    T[1, :3, 3] = mean @ np.concatenate([T[0, :3, 3], both[0].ravel(), [1.0]])
    return T[0], T[1], history


def _sums(robot, T_ST, weights):
    """K of the rotations, and the translation cost with both translations eliminated.

    The gap is R tx + R Rx a + p - ty = C (tx, rvec Rx, 1) - ty.
    """
    (R, p), (A, a) = ((T[:, :3, :3], T[:, :3, 3]) for T in (robot, T_ST))
    n, total = len(R), weights.sum()
    C = np.empty((n, 3, 13))
    C[:, :, :3], C[:, :, 12] = R, p
    C[:, :, 3:12] = (R[:, :, :, None] * a[:, None, None, :]).reshape(n, 3, 9)
    # rvec(R X A) = (R kron A') rvec(X)
    K = ((R.reshape(-1, 9) * weights[:, None]).T @ A.reshape(-1, 9)).reshape(3, 3, 3, 3).transpose(0, 3, 1, 2)
    mean = (weights @ C.reshape(-1, 39)).reshape(3, 13) / total
    rows = (C - mean).reshape(-1, 13)
    G = (rows * np.repeat(weights, 3)[:, None]).T @ rows
    elimination = np.linalg.solve(G[:3, :3], G[:3, 3:])
    H = G[3:, 3:] - G[3:, :3] @ elimination
    return K.reshape(9, 9), H, elimination, mean, (weights @ A.reshape(-1, 9)).reshape(3, 3), total


def _turned(R, phi):
    """R, shape (n, 3, 3), turned by phi, shape (n, 3), about its own axes, by Cayley's map: exactly orthonormal, equal
    to the exponential up to |phi|^3 / 12."""
    S = (phi @ _GENERATORS.reshape(3, 9)).reshape(R.shape)
    return R @ (_I3 + (S + 0.5 * (S @ S)) / (1.0 + 0.25 * (phi * phi).sum(axis=1))[:, None, None])
