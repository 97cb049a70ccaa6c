"""How small errors of poses travel: through products and inverses, into points, from three points into a frame.

The error of a transform T_AB = (R, t) is what `calibration.result` reports: a rotation vector phi about the axes of B
(rad) and a shift d in A (mm), e = (phi, d), so that the true transform is (R exp(phi), t + d), `frames.moved(T, e)`. To
first order every error arrives somewhere else as J e, and a covariance as J cov J'. A rotation grows into a shift by
its lever.

Source: the first-order law of propagation of uncertainty (GUM, JCGM 100:2008, section 5), with poses as in Sola, Deray,
Atchuthan, "A micro Lie theory for state estimation in robotics" (2018), section V.
"""

import numpy as np

from ..checks import (
    as_covariances,
    as_finite,
    as_instance,
    as_items,
    as_points,
    as_shape,
    as_transforms,
    fit_together,
    shown,
)
from .frames import frame_from_points, invert
from .lie import skew


def _blocks(upper_left, lower_left, lower_right):
    """(6, 6) from three blocks: no shift ever turns anything."""
    shape = np.broadcast_shapes(*(np.shape(block) for block in (upper_left, lower_left, lower_right)))
    J = np.zeros((*shape[:-2], 6, 6))
    J[..., :3, :3], J[..., 3:, :3], J[..., 3:, 3:] = upper_left, lower_left, lower_right
    return J


def product_jacobians(T_AB, T_BC):
    """Where the errors of two factors arrive in their product T_AC.

    Parameters
    ----------
    T_AB, T_BC : array-like, shape (..., 4, 4)

    Returns
    -------
    J_AB, J_BC : arrays, shape (..., 6, 6)
        e_AC = J_AB e_AB + J_BC e_BC. A turn of the first factor moves the end by its lever, t_BC.
    """
    T_AB, T_BC = as_transforms(T_AB, "T_AB"), as_transforms(T_BC, "T_BC")
    fit_together(T_AB=T_AB.shape[:-2], T_BC=T_BC.shape[:-2])
    (R, _), (S, t) = ((T[..., :3, :3], T[..., :3, 3]) for T in (T_AB, T_BC))
    return _blocks(np.swapaxes(S, -1, -2), -R @ skew(t), np.eye(3)), _blocks(np.eye(3), np.zeros((3, 3)), R)


def inverse_jacobian(T_AB):
    """Where the error of a transform arrives in its inverse T_BA.

    Parameters
    ----------
    T_AB : array-like, shape (..., 4, 4)

    Returns
    -------
    J : array, shape (..., 6, 6)
        e_BA = J e_AB.
    """
    T_BA = invert(T_AB)
    return _blocks(-np.swapaxes(T_BA[..., :3, :3], -1, -2), skew(T_BA[..., :3, 3]), -T_BA[..., :3, :3])


def point_jacobians(T_AB, p_B):
    """Where the errors of a transform and of a point arrive in the point seen from A.

    Parameters
    ----------
    T_AB : array-like, shape (..., 4, 4)
    p_B : array-like, shape (..., 3), mm

    Returns
    -------
    J_T : array, shape (..., 3, 6)
    J_p : array, shape (..., 3, 3)
        e_A = J_T e_AB + J_p e_B.
    """
    T_AB, p_B = as_transforms(T_AB, "T_AB"), as_points(p_B, "p_B")
    fit_together(T_AB=T_AB.shape[:-2], p_B=p_B.shape[:-1])
    lever = -T_AB[..., :3, :3] @ skew(p_B)
    shift = np.broadcast_to(np.eye(3), lever.shape)
    return np.concatenate([lever, shift], axis=-1), T_AB[..., :3, :3]


def point_covariance(T_AB, cov_AB, p_B, cov_B):
    """Covariance of a point seen from A, when the transform and the point have independent errors.

    Parameters
    ----------
    T_AB : array-like, shape (..., 4, 4)
    cov_AB : array-like, shape (..., 6, 6)
        Rotation vector about the axes of B (rad), shift in A (mm).
    p_B : array-like, shape (..., 3), mm
    cov_B : array-like, shape (..., 3, 3), mm^2

    Returns
    -------
    cov_A : array, shape (..., 3, 3), mm^2
    """
    J_T, J_p = point_jacobians(T_AB, p_B)
    cov_AB, cov_B = as_covariances(cov_AB, "cov_AB", 6), as_covariances(cov_B, "cov_B", 3)
    fit_together(T_AB=J_T.shape[:-2], cov_AB=cov_AB.shape[:-2], cov_B=cov_B.shape[:-2])
    return J_T @ cov_AB @ np.swapaxes(J_T, -1, -2) + J_p @ cov_B @ np.swapaxes(J_p, -1, -2)


def chain_jacobians(links):
    """Product of a chain, and where the error of each of its links arrives in it.

    Parameters
    ----------
    links : sequence of array-like, each (..., 4, 4)
        T_AB, T_BC, ..., at least one. A link that is passed backward comes inverted, and its Jacobian is to be
        multiplied by `inverse_jacobian` of what was measured.

    Returns
    -------
    T : array, shape (..., 4, 4)
    J : list of arrays, each (..., 6, 6)

    Raises
    ------
    ValueError
        No link.
    """
    links = [as_transforms(T, f"links[{k}]") for k, T in enumerate(as_items(links, "links", "transforms"))]
    if not links:
        raise ValueError("at least one link must come, got none")
    product, J = links[0], [np.broadcast_to(np.eye(6), (*links[0].shape[:-2], 6, 6))]
    for T in links[1:]:
        first, second = product_jacobians(product, T)
        J = [first @ before for before in J] + [second]
        product = product @ T
    return product, J


def three_point_jacobian(origin, x_point, y_point):
    """Where the errors of three points arrive in the frame through them.

    With the points at 0, (a, 0, 0) and (b, h, 0) in the frame, and their errors along its axes, the frame turns about
    its z by (e_x.y - e_o.y) / a, about its y by -(e_x.z - e_o.z) / a, and about its x by what lifts the third point,
    (e_y.z - e_o.z + b phi_y) / h.

    Parameters
    ----------
    origin, x_point, y_point : array-like, shape (..., 3), mm
        As `frames.frame_from_points` takes them.

    Returns
    -------
    J : array, shape (..., 6, 9)
        By the coordinates of origin, x_point and y_point in W.
    """
    T = frame_from_points(origin, x_point, y_point)
    into = np.swapaxes(T[..., :3, :3], -1, -2)
    o, px, py = (as_points(p, name) for p, name in ((origin, "origin"), (x_point, "x_point"), (y_point, "y_point")))
    a = np.linalg.norm(px - o, axis=-1)
    b, h = np.moveaxis((into @ (py - o)[..., None])[..., :2, 0], -1, 0)
    J = np.zeros((*T.shape[:-2], 6, 9))
    J[..., 2, 3:6], J[..., 2, :3] = into[..., 1, :] / a[..., None], -into[..., 1, :] / a[..., None]
    J[..., 1, 3:6], J[..., 1, :3] = -into[..., 2, :] / a[..., None], into[..., 2, :] / a[..., None]
    J[..., 0, :] = b[..., None] * J[..., 1, :]
    J[..., 0, 6:] += into[..., 2, :]
    J[..., 0, :3] -= into[..., 2, :]
    J[..., 0, :] /= h[..., None]
    J[..., 3:, :3] = np.eye(3)
    return J


def error_budget(jacobians, covariances):
    """What each independent source contributes to a result, to first order.

    Parameters
    ----------
    jacobians : dict
        {source: array, shape (m, n)}: how the result moves with the source, all its ways into the result added up.
    covariances : dict
        {source: array, shape (n, n)}, for each of them; what one calibration estimates together is one source.

    Returns
    -------
    shares : dict
        {source: array, shape (m, m)} J cov J'; their sum is the covariance of the result.

    Raises
    ------
    ValueError
        Sources that differ, or a Jacobian that does not fit its covariance.
    """
    jacobians, covariances = as_instance(jacobians, "jacobians", dict), as_instance(covariances, "covariances", dict)
    if set(jacobians) != set(covariances):
        raise ValueError(f"both must name the same sources, got {list(jacobians)} and {list(covariances)}")
    shares = {}
    for name, J in jacobians.items():
        J, cov = as_shape(J, f"the Jacobian of {name}", "m", "n"), as_finite(covariances[name], f"that of {name}")
        if cov.shape != (J.shape[-1], J.shape[-1]):
            raise ValueError(f"{name}: a Jacobian of shape {shown(J.shape)} needs a square covariance, got {cov.shape}")
        shares[name] = J @ as_covariances(cov, f"the covariance of {name}", len(cov)) @ J.T
    return shares
