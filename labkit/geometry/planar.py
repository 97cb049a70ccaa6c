"""Poses in the plane, x = (x, y, theta) in m, m, rad, shape (..., 3): composed, compared, as twists."""

import numpy as np

from ..checks import as_finite, as_points, fit_together


def wrap_angle(angle):
    """The same direction within [-pi, pi) (rad), but for rounding next to -pi; any shape."""
    return (as_finite(angle, "angle") + np.pi) % (2 * np.pi) - np.pi


def relative_pose(x, y):
    """Pose y seen from pose x.

    Parameters
    ----------
    x, y : array-like, shape (..., 3)
        x, y (m) and heading (rad) of both.

    Returns
    -------
    seen : array, shape (..., 3)
        The heading within [-pi, pi).

    See Also
    --------
    compose_pose : the way back.
    """
    x, y = as_points(x, "x", 3), as_points(y, "y", 3)
    fit_together(x=x.shape[:-1], y=y.shape[:-1])
    d, c, s = y - x, np.cos(x[..., 2]), np.sin(x[..., 2])
    parts = (c * d[..., 0] + s * d[..., 1], c * d[..., 1] - s * d[..., 0], wrap_angle(d[..., 2]))
    return np.stack(parts, axis=-1)


def log_pose(x):
    """Exponential coordinates (rho_x, rho_y, phi) of a planar pose: the twist that reaches it in one second.

    The inverse of driving an arc, with sideways motion allowed: (v, 0, omega) for what `odometry.step` reaches with
    "arc".
    """
    x = as_points(x, "x", 3)
    half = wrap_angle(x[..., 2]) / 2
    scale = 1 / np.sinc(half / np.pi)
    c, s = scale * np.cos(half), scale * np.sin(half)
    return np.stack([c * x[..., 0] + s * x[..., 1], c * x[..., 1] - s * x[..., 0], 2 * half], axis=-1)


def exp_pose(xi):
    """Planar pose of exponential coordinates, (..., 3); the inverse of `log_pose`."""
    xi = as_points(xi, "xi", 3)
    half = xi[..., 2] / 2
    scale = np.sinc(half / np.pi)
    c, s = scale * np.cos(half), scale * np.sin(half)
    return np.stack([c * xi[..., 0] - s * xi[..., 1], s * xi[..., 0] + c * xi[..., 1], xi[..., 2]], axis=-1)


def compose_pose(x, y):
    """Pose whose coordinates seen from x are y: the inverse of `relative_pose`.

    Parameters
    ----------
    x, y : array-like, shape (..., 3)
        x, y (m) and heading (rad).

    Returns
    -------
    pose : array, shape (..., 3)
        The heading is not wrapped.
    """
    x, y = as_points(x, "x", 3), as_points(y, "y", 3)
    fit_together(x=x.shape[:-1], y=y.shape[:-1])
    c, s = np.cos(x[..., 2]), np.sin(x[..., 2])
    there = (x[..., 0] + c * y[..., 0] - s * y[..., 1], x[..., 1] + s * y[..., 0] + c * y[..., 1])
    return np.stack(np.broadcast_arrays(*there, x[..., 2] + y[..., 2]), axis=-1)
