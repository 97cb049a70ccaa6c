"""Frames from three measured points, rigid transforms, and the angles of a KUKA controller.

`T_AB` maps coordinates in B to coordinates in A, so neighboring letters cancel: `T_AC = T_AB @ T_BC`. Lengths carry
whatever unit the points have (mm in this chapter), angles are radians, and all functions broadcast over leading axes.
Source: lab sheet "Kalibrierung", Hochschule Darmstadt 2016, section 1.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from ..checks import (
    PRODUCT_TOLERANCE,
    SMALLEST_POSITIVE,
    as_finite,
    as_number,
    as_points,
    as_positive_number,
    as_rotations,
    as_shape,
    as_transforms,
    fit_together,
    shown,
)
from ..documented import documented
from .lie import exp_so3, nearest_rotation, skew

MIN_ARM_ANGLE_DEG = 1e-3  # below this the triangle is so flat that its height drowns in the last digits of the points
YZX, ZXY = np.array([[1, 2, 0], [2, 0, 1]])  # entries in turn
MIN_ARM = 1e-9  # relative to the largest coordinate: a shorter arm is rounding error, not a direction


def pose(R, t):
    """Transform with a given rotation and translation.

    Parameters
    ----------
    R : array-like, shape (..., 3, 3)
        Rotation.
    t : array-like, shape (..., 3)
        Translation, in the unit of the points.

    Returns
    -------
    T : array, shape (..., 4, 4)
    """
    return _pose(as_rotations(R, "R"), as_points(t, "t"))


def _pose(R, t):
    T = np.zeros((*fit_together(R=R.shape[:-2], t=t.shape[:-1]), 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = R, t, 1.0
    return T


def unit_vector(v):
    """Directions of length 1.

    Parameters
    ----------
    v : array-like, shape (..., n)
        Vectors of any length but zero.

    Returns
    -------
    direction : array, shape (..., n)

    Raises
    ------
    ValueError
        When a vector is zero.
    """
    v = as_finite(v, "v")
    if v.ndim < 1:
        raise ValueError("v must have shape (..., n), got a single number")
    return _unit_vector(v)


def _unit_vector(v):
    largest = np.abs(v).max(-1, keepdims=True, initial=0.0)
    if (largest == 0).any():
        raise ValueError("v must not be the zero vector: it has no direction")
    v = v / largest  # so that no square overflows or vanishes
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def gram_schmidt(a, b):
    """Right-handed orthonormal axes from two directions.

    x points along `a`, y is what remains of `b` once its part along `a` is removed, z = x cross y.

    Parameters
    ----------
    a, b : array-like, shape (..., 3)
        Two directions, neither zero nor parallel. `a` is kept, `b` only fixes the plane.

    Returns
    -------
    R : array, shape (..., 3, 3)
        The columns are x, y, z.

    Raises
    ------
    ValueError
        When a direction is zero or both are parallel within 0.001 deg, with the angle found.

    Source: lab sheet, section 1, the four formulas before listing 1.
    """
    a, b = as_points(a, "a"), as_points(b, "b")
    fit_together(a=a.shape[:-1], b=b.shape[:-1])
    for arm, name in ((a, "a"), (b, "b")):
        if (arm == 0).all(-1).any():
            raise ValueError(f"{name} is zero: it gives no direction")
    return _axes(a, b, "a and b are parallel")


def _axes(a, b, if_flat):
    """The formulas of `gram_schmidt`; `if_flat` begins the refusal of parallel directions."""
    x, b = _unit_vector(a), _unit_vector(b)
    angle = _arm_angle(x, b)
    flattest = np.minimum(angle, np.pi - angle).min(initial=np.pi)
    if flattest < np.deg2rad(MIN_ARM_ANGLE_DEG):
        raise ValueError(f"{if_flat}: the angle between the arms is {shown(np.rad2deg(flattest), '.2g')} deg")
    y = _unit_vector(b - (x * b).sum(-1, keepdims=True) * x)
    z = _cross(x, y)
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1)


def _cross(a, b):
    """a x b, entry by entry a_y b_z - a_z b_y: `np.cross` looks for the axes first, which takes longer than this."""
    return a.take(YZX, -1) * b.take(ZXY, -1) - a.take(ZXY, -1) * b.take(YZX, -1)


def frame_from_points(origin, x_point, y_point):
    """Frame through three measured points.

    Parameters
    ----------
    origin, x_point, y_point : array-like, shape (..., 3)
        The origin, a point on the positive x axis and a point on the side of positive y, all measured in W.

    Returns
    -------
    T_WF : array, shape (..., 4, 4)
        Maps coordinates in the frame F to coordinates in W.

    Raises
    ------
    ValueError
        When two points coincide or all three are collinear, with the angle between the arms.

    Source: lab sheet, section 1, listing 1.
    """
    o, px, py = map(as_points, (origin, x_point, y_point), ("origin", "x_point", "y_point"))
    fit_together(origin=o.shape[:-1], x_point=px.shape[:-1], y_point=py.shape[:-1])
    for point, name in ((px, "x_point"), (py, "y_point")):
        _refuse_short(point - o, point, name)
    R = _axes(px - o, py - o, "origin, x_point and y_point are collinear")
    return _pose(R, o)


def _refuse_short(arm, point, name):
    """Raise when an arm has no length beside the coordinates it came from."""
    if (np.abs(arm).max(-1) <= MIN_ARM * np.abs(point).max(-1)).any():
        length = np.linalg.norm(arm, axis=-1)
        raise ValueError(
            f"{name} coincides with origin: the arm is {shown(length.min(), '.3g')} long and gives no direction"
        )


def arm_angle(a, b):
    """Angle between two directions, accurate also near 0 and pi.

    Parameters
    ----------
    a, b : array-like, shape (..., 3)
        Two directions of any length.

    Returns
    -------
    angle : array, shape (...)
        From 0 to pi (rad).

    See Also
    --------
    rotation_angle : the angle of a rotation.
    """
    a, b = as_points(a, "a"), as_points(b, "b")
    fit_together(a=a.shape, b=b.shape)
    return _arm_angle(a, b)


def _arm_angle(a, b):
    return np.arctan2(np.linalg.norm(_cross(a, b), axis=-1), (a * b).sum(-1))


def invert(T):
    """Inverse of rigid transforms without solving anything: (R, t) becomes (R', -R' t).

    Parameters
    ----------
    T : array-like, shape (..., 4, 4)
        T_AB.

    Returns
    -------
    inverse : array, shape (..., 4, 4)
        T_BA.

    See Also
    --------
    relative : the inverse of one pose times another.
    """
    return _invert(as_transforms(T, "T"))


def _invert(T):
    inverse = np.zeros_like(T)
    R_t = np.swapaxes(T[..., :3, :3], -1, -2)
    inverse[..., :3, :3] = R_t
    inverse[..., :3, 3] = -(R_t @ T[..., :3, 3, None])[..., 0]
    inverse[..., 3, 3] = 1.0
    return inverse


def transform(T, points):
    """Coordinates in A of points given in B.

    Parameters
    ----------
    T : array-like, shape (..., 4, 4)
        T_AB.
    points : array-like, shape (..., 3)
        Coordinates in B.

    Returns
    -------
    points : array, shape (..., 3)
        Coordinates in A.
    """
    T, points = as_transforms(T, "T"), as_points(points, "points")
    if T.ndim > 2:
        fit_together(T=T.shape[:-2], points=points.shape[:-1])
    return (T[..., :3, :3] @ points[..., None])[..., 0] + T[..., :3, 3]


def moved(T, step):
    """Transform after a small change: turned on the right, shifted on the left, (R exp(phi), t + d).

    Parameters
    ----------
    T : array-like, shape (..., 4, 4)
        T_AB.
    step : array-like, shape (..., 6)
        Rotation vector phi about the axes of B (rad), shift d in A (length).

    Returns
    -------
    T : array, shape (..., 4, 4)
    """
    T, step = as_transforms(T, "T"), as_points(step, "step", dim=6)
    fit_together(T=T.shape[:-2], step=step.shape[:-1])
    return _pose(T[..., :3, :3] @ exp_so3(step[..., :3]), as_points(T[..., :3, 3] + step[..., 3:], "t"))


def relative(T_WA, T_WB):
    """Pose of B seen from A: T_AB = T_WA^-1 T_WB.

    Parameters
    ----------
    T_WA, T_WB : array-like, shape (..., 4, 4)
        Both poses in one frame W.

    Returns
    -------
    T_AB : array, shape (..., 4, 4)

    Source: lab sheet, section 1, the formula for K0_T_K1.
    """
    T_WA, T_WB = as_transforms(T_WA, "T_WA"), as_transforms(T_WB, "T_WB")
    fit_together(T_WA=T_WA.shape[:-2], T_WB=T_WB.shape[:-2])
    return _invert(T_WA) @ T_WB


@documented
def rotation_block(T, name="T"):
    """Upper left 3 x 3 block of finite matrices, a rotation or not.

    Parameters
    ----------
    T : array-like, shape (..., 4, 4) or (..., 3, 3)
    name : str
        What a refusal calls it.

    Returns
    -------
    R : array, shape (..., 3, 3)

    Raises
    ------
    ValueError
        Any other shape.
    """
    T = as_finite(T, name)
    if T.shape[-2:] not in ((3, 3), (4, 4)):
        raise ValueError(f"{name} must have shape (..., 4, 4) or (..., 3, 3), got {T.shape}")
    return T[..., :3, :3]


def rotation_angle(T):
    """Angle of a rotation, accurate also near 0 and pi.

    Parameters
    ----------
    T : array-like, shape (..., 4, 4) or (..., 3, 3)

    Returns
    -------
    angle : array, shape (...)
        From 0 to pi (rad).

    See Also
    --------
    pose_distance : the angle and the distance between two poses.
    """
    R = as_rotations(rotation_block(T), "T", PRODUCT_TOLERANCE)
    twice_sin = np.linalg.norm(
        np.stack([R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], -1), axis=-1
    )
    return np.arctan2(twice_sin, np.trace(R, axis1=-2, axis2=-1) - 1)


def pose_distance(T1, T2):
    """How far two poses are apart.

    Parameters
    ----------
    T1, T2 : array-like, shape (..., 4, 4)

    Returns
    -------
    angle : array, shape (...)
        Angle of the rotation between them (rad).
    distance : array, shape (...)
        Distance of their origins, in the unit of the poses.
    """
    T1, T2 = as_transforms(T1, "T1"), as_transforms(T2, "T2")
    fit_together(T1=T1.shape[:-2], T2=T2.shape[:-2])
    distance = np.linalg.norm(T1[..., :3, 3] - T2[..., :3, 3], axis=-1)
    return rotation_angle(np.swapaxes(T1[..., :3, :3], -1, -2) @ T2[..., :3, :3]), distance


def matrix_from_kuka(xyzabc):
    """Transform of a KUKA pose: rotation Rz(A) Ry(B) Rx(C), translation (x, y, z).

    Parameters
    ----------
    xyzabc : array-like, shape (..., 6)
        x, y, z in a length unit, then A, B, C in **radians**; `kuka_from_degrees` converts what a controller displays.

    Returns
    -------
    T : array, shape (..., 4, 4)
    """
    xyzabc = as_points(xyzabc, "xyzabc", dim=6)
    a, b, c = xyzabc[..., 3], xyzabc[..., 4], xyzabc[..., 5]
    ca, cb, cc, sa, sb, sc = np.cos(a), np.cos(b), np.cos(c), np.sin(a), np.sin(b), np.sin(c)
    T = np.zeros((*xyzabc.shape[:-1], 4, 4))
    T[..., 0, 0], T[..., 0, 1], T[..., 0, 2] = ca * cb, ca * sb * sc - sa * cc, ca * sb * cc + sa * sc
    T[..., 1, 0], T[..., 1, 1], T[..., 1, 2] = sa * cb, sa * sb * sc + ca * cc, sa * sb * cc - ca * sc
    T[..., 2, 0], T[..., 2, 1], T[..., 2, 2] = -sb, cb * sc, cb * cc
    T[..., :3, 3] = xyzabc[..., :3]
    T[..., 3, 3] = 1.0
    return T


def kuka_from_matrix(T):
    """KUKA pose of a transform.

    Parameters
    ----------
    T : array-like, shape (..., 4, 4)

    Returns
    -------
    xyzabc : array, shape (..., 6)
        x, y, z, then A, B, C (rad): B in [-pi/2, pi/2], A and C in [-pi, pi]. At B = +-pi/2 only A -+ C is
        determined; there A comes out of what rounding left, or 0, and C takes the rest.

    See Also
    --------
    matrix_from_kuka : the way back; it always returns the same T.
    """
    T = as_transforms(T, "T")
    a = np.arctan2(T[..., 1, 0], T[..., 0, 0])
    sa, ca = np.sin(a), np.cos(a)
    b = np.arctan2(-T[..., 2, 0], ca * T[..., 0, 0] + sa * T[..., 1, 0])
    c = np.arctan2(sa * T[..., 0, 2] - ca * T[..., 1, 2], ca * T[..., 1, 1] - sa * T[..., 0, 1])
    return np.concatenate([T[..., :3, 3], np.stack([a, b, c], axis=-1)], axis=-1)


def kuka_from_degrees(xyzabc_deg):
    """KUKA poses with the angles in radians.

    Parameters
    ----------
    xyzabc_deg : array-like, shape (..., 6)
        x, y, z, then A, B, C in degrees, as a controller displays them.

    Returns
    -------
    xyzabc : array, shape (..., 6)
    """
    xyzabc_deg = as_points(xyzabc_deg, "xyzabc_deg", dim=6)
    return np.concatenate([xyzabc_deg[..., :3], np.deg2rad(xyzabc_deg[..., 3:])], axis=-1)


def matrix_from_quaternion(xyzw):
    """Rotation matrix of a quaternion.

    Parameters
    ----------
    xyzw : array-like, shape (..., 4)
        Scalar last, of any length but zero.

    Returns
    -------
    R : array, shape (..., 3, 3)

    See Also
    --------
    quaternion_from_matrix : the way back.
    """
    q = as_points(xyzw, "xyzw", dim=4)
    if (q == 0).all(-1).any():
        raise ValueError("xyzw must not be the zero quaternion: it is no rotation")
    q = unit_vector(q)
    v, w = q[..., :3], q[..., 3, None, None]
    S = skew(v)
    return np.eye(3) + 2 * w * S + 2 * S @ S


def quaternion_from_matrix(R):
    """Quaternion of a rotation matrix.

    Parameters
    ----------
    R : array-like, shape (..., 3, 3)

    Returns
    -------
    xyzw : array, shape (..., 4)
        Scalar last, w >= 0, length 1.

    See Also
    --------
    matrix_from_quaternion : the way back.
    """
    R = as_rotations(R, "R")
    q = Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat(canonical=True) if R.size else np.zeros((0, 4))
    return q.reshape(*R.shape[:-2], 4)


def fit_frame(points_F, points_W):
    """Frame that fits many points at once, by SVD (Kabsch): minimizes sum |T_WF p_F - p_W|^2.

    Parameters
    ----------
    points_F : array-like, shape (..., n, 3)
        Where the points sit in the frame: the drawing of the part.
    points_W : array-like, shape (..., n, 3)
        Where they were measured. n >= 3, not collinear.

    Returns
    -------
    T_WF : array, shape (..., 4, 4)

    Raises
    ------
    ValueError
        When fewer than three points come, or they coincide or are collinear (second singular value below 1e-9 of the
        first).

    Source: Kabsch, Acta Cryst. A32 (1976) 922; with the determinant corrected as in Umeyama, PAMI 13 (1991) 376.
    """
    p, q = as_points(points_F, "points_F"), as_points(points_W, "points_W")
    fit_together(points_F=p.shape, points_W=q.shape)
    p, q = np.broadcast_arrays(p, q)
    if p.ndim < 2 or p.shape[-2] < 3:
        raise ValueError(f"at least 3 points are needed, got {p.shape[-2] if p.ndim > 1 else 1}")
    p_mean, q_mean = p.mean(-2), q.mean(-2)
    spread = np.swapaxes(p - p_mean[..., None, :], -1, -2) @ (q - q_mean[..., None, :])
    values = np.linalg.svd(spread, compute_uv=False)
    if (values[..., 0] == 0).any():
        raise ValueError("the points coincide: they have no orientation")
    if (values[..., 1] <= 1e-9 * values[..., 0]).any():
        ratio = (values[..., 1] / values[..., 0]).min()
        raise ValueError(f"the points are collinear: the second singular value is {shown(ratio, '.1e')} of the first")
    R = nearest_rotation(np.swapaxes(spread, -1, -2))
    return pose(R, q_mean - (R @ p_mean[..., None])[..., 0])


def gram_schmidt_covariance(x_arm, y_along, y_height, std):
    """First-order covariance of the rotation vector (in F) of `frame_from_points`.

    With the origin at 0, x_point at (x_arm, 0, 0) and y_point at (y_along, y_height, 0), the error of the frame about
    its own axes is

        about x: (e_y.z - e_o.z - (y_along / x_arm) (e_x.z - e_o.z)) / y_height
        about y: -(e_x.z - e_o.z) / x_arm
        about z: (e_x.y - e_o.y) / x_arm

    Parameters
    ----------
    x_arm, y_along, y_height : float
        The triangle, as above (mm).
    std : float
        Isotropic noise of each of the three points, per coordinate (mm).

    Returns
    -------
    cov_rot : array, shape (3, 3), rad^2

    Raises
    ------
    ValueError
        Where the triangle is flat.
    """
    c, u, h = (as_number(v, n) for v, n in ((x_arm, "x_arm"), (y_along, "y_along"), (y_height, "y_height")))
    std = as_positive_number(std, "std")
    if c == 0 or h == 0:
        raise ValueError(
            f"x_arm and y_height must not be 0 (a flat triangle gives no frame), got {shown(c)} and {shown(h)}"
        )
    r = u / c
    J = np.array(  # columns: e_o.y, e_o.z, e_x.y, e_x.z, e_y.z
        [[0, (r - 1) / h, 0, -r / h, 1 / h], [0, 1 / c, 0, -1 / c, 0], [-1 / c, 0, 1 / c, 0, 0]]
    )
    return std**2 * J @ J.T


def fit_covariance(points_F, std):
    """Cramer-Rao bound of the rotation vector (in F) of a frame fitted to points with isotropic noise.

    The information is sum (|d|^2 I - d d') / std^2 over the points d about their mean: the tensor of inertia of the
    triangle.

    Parameters
    ----------
    points_F : array-like, shape (n, 3), mm
        Where the points are on the body.
    std : float
        Noise of each measured coordinate (mm).

    Returns
    -------
    cov_rot : array, shape (3, 3), rad^2

    Raises
    ------
    ValueError
        For fewer than three points, or collinear ones.

    See Also
    --------
    fit_frame : the estimate that attains it.
    """
    d = as_shape(points_F, "points_F", "n", 3)
    if len(d) < 3:
        raise ValueError(f"at least 3 points are needed, got {len(d)}")
    d = d - d.mean(-2, keepdims=True)
    std = as_positive_number(std, "std")
    values = np.linalg.svd(d, compute_uv=False)
    if values[1] <= max(1e-9 * values[0], SMALLEST_POSITIVE):
        raise ValueError("the points are collinear or coincide: the rotation about their line stays free")
    return std**2 * np.linalg.inv((d * d).sum() * np.eye(3) - d.T @ d)
