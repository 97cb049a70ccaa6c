"""Rotations and rigid motions as vectors: the exponential and the logarithm of SO(3) and SE(3).

A twist is written rotation first, xi = (phi, rho): phi is the rotation vector (rad), rho the translation part (in the
unit of the lengths). All functions broadcast over leading axes. The rotation of a twist is phi itself; the translation
of exp(xi) is V(phi) rho. Source: Sola, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics" (2018),
appendix.
"""

import numpy as np

from ..checks import PRODUCT_TOLERANCE, as_finite, as_matrices, as_points, as_rotations, as_transforms, fit_together


def skew(v):
    """Matrix of the cross product, skew(v) @ w = v x w; (..., 3) -> (..., 3, 3)."""
    return _skew(as_points(v, "v"))


def _skew(v):
    S = np.zeros((*v.shape, 3))
    S[..., 0, 1], S[..., 0, 2], S[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    S[..., 1, 0], S[..., 2, 0], S[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return S


def _coefficients(theta_squared):
    """sin(t)/t, (1 - cos t)/t^2 and (t - sin t)/t^3, with their series where t is small."""
    small = theta_squared < 1e-6
    t2 = np.where(small, 1.0, theta_squared)
    t = np.sqrt(t2)
    a = np.where(small, 1 - theta_squared / 6 + theta_squared**2 / 120, np.sin(t) / t)
    b = np.where(small, 0.5 - theta_squared / 24 + theta_squared**2 / 720, 2 * np.sin(t / 2) ** 2 / t2)
    c = np.where(small, 1 / 6 - theta_squared / 120 + theta_squared**2 / 5040, (1 - np.sin(t) / t) / t2)
    return a[..., None, None], b[..., None, None], c[..., None, None]


def exp_so3(phi):
    """Rotation matrix of the rotation vector phi (rad), Rodrigues' formula; (..., 3) -> (..., 3, 3)."""
    return _exp_so3(as_points(phi, "phi"))


def _exp_so3(phi):
    S = _skew(phi)
    a, b, _ = _coefficients((phi**2).sum(-1))
    return np.eye(3) + a * S + b * (S @ S)


def log_so3(R):
    """Rotation vector of the rotation matrix R (rad, length at most pi); (..., 3, 3) -> (..., 3).

    Accurate over the whole range: near pi, where R - R' vanishes, the axis is read from the symmetric part.
    """
    return _log_so3(as_rotations(R, "R", PRODUCT_TOLERANCE))


def _log_so3(R):
    w = 0.5 * np.stack([R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], axis=-1)
    sin = np.linalg.norm(w, axis=-1)
    cos = 0.5 * (np.trace(R, axis1=-2, axis2=-1) - 1)
    angle = np.arctan2(sin, cos)
    phi = (angle / np.maximum(sin, 1e-300))[..., None] * w
    near_pi = cos < -0.99
    if near_pi.any():
        phi = np.where(near_pi[..., None], _log_near_pi(R, w, angle), phi)
    return phi


def _log_near_pi(R, w, angle):
    """Rotation vector from (R + R')/2 = cos I + (1 - cos) a a': the largest column is the axis up to its sign."""
    B = 0.5 * (R + np.swapaxes(R, -1, -2)) - np.cos(angle)[..., None, None] * np.eye(3)
    k = np.argmax(np.diagonal(B, axis1=-2, axis2=-1), axis=-1)
    axis = np.take_along_axis(B, k[..., None, None], axis=-1)[..., 0]
    axis = axis / np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), 1e-300)
    sign = np.where((axis * w).sum(-1) < 0, -1.0, 1.0)
    return (sign * angle)[..., None] * axis


def left_jacobian_so3(phi):
    """V(phi) with exp(phi + d) = exp(V(phi) d) exp(phi) to first order; (..., 3) -> (..., 3, 3)."""
    return _left_jacobian_so3(as_points(phi, "phi"))


def _left_jacobian_so3(phi):
    S = _skew(phi)
    _, b, c = _coefficients((phi**2).sum(-1))
    return np.eye(3) + b * S + c * (S @ S)


def exp_se3(xi):
    """Rigid transform of the twist xi = (phi, rho); (..., 6) -> (..., 4, 4)."""
    xi = as_points(xi, "xi", dim=6)
    T = np.zeros((*xi.shape[:-1], 4, 4))
    T[..., :3, :3] = _exp_so3(xi[..., :3])
    T[..., :3, 3] = (_left_jacobian_so3(xi[..., :3]) @ xi[..., 3:, None])[..., 0]
    T[..., 3, 3] = 1.0
    return T


def log_se3(T):
    """Twist xi = (phi, rho) of the rigid transform T; (..., 4, 4) -> (..., 6)."""
    T = as_transforms(T, "T", PRODUCT_TOLERANCE)
    phi = _log_so3(T[..., :3, :3])
    rho = np.linalg.solve(_left_jacobian_so3(phi), T[..., :3, 3, None])[..., 0]
    return np.concatenate([phi, rho], axis=-1)


def adjoint(T):
    """Ad(T) with T exp(xi) T^-1 = exp(Ad(T) xi); (..., 4, 4) -> (..., 6, 6), twists rotation first."""
    T = as_transforms(T, "T", PRODUCT_TOLERANCE)
    A = np.zeros((*T.shape[:-2], 6, 6))
    R = T[..., :3, :3]
    A[..., :3, :3] = A[..., 3:, 3:] = R
    A[..., 3:, :3] = _skew(T[..., :3, 3]) @ R
    return A


def nearest_rotation(M):
    """Rotation matrix closest to M in the Frobenius norm, by SVD with the determinant corrected; (..., 3, 3)."""
    U, _, Vt = np.linalg.svd(as_matrices(M, "M", 3, 3))
    U[..., :, 2] *= np.sign(np.linalg.det(U @ Vt))[..., None]
    return U @ Vt


def interpolate(T0, T1, s):
    """Pose a share s of the way from T0 to T1 at constant twist, T0 exp(s log(T0^-1 T1)).

    Parameters
    ----------
    T0, T1 : array-like, shape (..., 4, 4)
    s : array-like, shape (...)
        0 gives T0, 1 gives T1.

    Returns
    -------
    T : array, shape (..., 4, 4)

    Source: Sola, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics" (2018), section II.
    """
    T0, T1, s = as_transforms(T0, "T0"), as_transforms(T1, "T1"), as_finite(s, "s")
    fit_together(T0=T0.shape[:-2], T1=T1.shape[:-2], s=s.shape)
    R_t = np.swapaxes(T0[..., :3, :3], -1, -2)
    between = np.zeros(np.broadcast_shapes(T0.shape, T1.shape))
    between[..., :3, :3] = R_t @ T1[..., :3, :3]
    between[..., :3, 3] = (R_t @ (T1[..., :3, 3] - T0[..., :3, 3])[..., None])[..., 0]
    between[..., 3, 3] = 1.0
    return T0 @ exp_se3(s[..., None] * log_se3(between))
