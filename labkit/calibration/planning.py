"""Where to put the robot before anything is measured: poses that see a sphere, and what they will tell.

The scanner sits on the flange at T_FS, the sphere's center in the base at `target` (`labkit.calibration.hand_eye`). A
pose is planned backwards, from the place where the sphere is to appear in the scanner's field. Lengths in mm, angles in
rad. Source: thesis "Optimierung bei der Kalibrierung von Sensor-Roboter-Systemen", HAW Hamburg 2019, section 6.1.
"""

from dataclasses import dataclass

import numpy as np

from ..checks import (
    as_count,
    as_number,
    as_points,
    as_positive_number,
    as_rotations,
    as_shape,
    as_size,
    as_transforms,
    fit_together,
    shown,
)
from ..documented import documented
from ..geometry.frames import pose, transform
from ..geometry.lie import exp_so3
from .hand_eye import MIN_SPREAD, joint_jacobian, rms_distance, sphere_in_scanner

FIELD = (
    (-25.0, 25.0),
    (3.0, 25.0),
    (190.0, 290.0),
)  # mm: x, |y| and z of a sphere center whose arc the scanner sees well
DOWN = np.diag([1.0, -1.0, -1.0])  # orientation of a frame whose z axis points straight down
_IRRATIONAL = np.sqrt([2.0, 3.0, 5.0, 7.0, 11.0, 13.0]) % 1.0


def field_problem(x_S):
    """What keeps the scanner from seeing a sphere at these places, as a sentence; None where all lie in its field.

    Parameters
    ----------
    x_S : array-like, shape (..., 3), mm
        Sphere centers in the scanner frame.

    Returns
    -------
    problem : str or None
    """
    x_S = as_points(x_S, "x_S")
    for axis, (low, high), values in zip("xyz", FIELD, (x_S[..., 0], np.abs(x_S[..., 1]), x_S[..., 2])):
        bad = (values < low - 1e-9) | (values > high + 1e-9)
        if bad.any():
            name = "|y|" if axis == "y" else axis
            first = values[bad].ravel()[0]
            poses, at = ("one pose", "at") if bad.sum() == 1 else (f"{bad.sum()} poses", "first at")
            return f"in {poses} the sphere lies outside {name} = {low:g} to {high:g} mm, {at} {shown(first, '.1f')} mm."
    return None


def predicted_sphere_covariance(T_BF, T_FS, target, std):
    """Covariance of phi, translation and target that a set of poses would give, before anything is measured.

    The sphere centers follow from the poses: x_S = T_FS^-1 T_BF^-1 target. This is the Cramer-Rao bound.

    Parameters
    ----------
    T_BF : array-like, shape (N, 4, 4)
    T_FS : array-like, shape (4, 4)
    target : array-like, shape (3,), mm
    std : float
        Isotropic noise of a center, per coordinate (mm).

    Returns
    -------
    covariance : array, shape (9, 9), rad and mm

    Raises
    ------
    ValueError
        For poses that leave a direction undetermined.
    """
    x_S = sphere_in_scanner(T_BF, T_FS, target)
    as_count(len(x_S), "the number of poses")
    J = joint_jacobian(T_BF, x_S, T_FS)
    scale = np.maximum(np.linalg.norm(J, axis=0), np.finfo(float).tiny)
    values = np.linalg.svd(J / scale, compute_uv=False)
    if len(values) < 9 or values[-1] <= MIN_SPREAD * values[0]:
        raise ValueError("the poses leave scanner or target undetermined: too few, or turned about one axis only")
    return as_positive_number(std, "std") ** 2 * np.linalg.inv(J.T @ J)


@dataclass(frozen=True, eq=False)
class Unseen:
    """What a set of poses would leave free, before anything is measured.

    Attributes
    ----------
    singular_values : array, shape (9,)
        Of the Jacobian with phi times the root-mean-square distance of the sphere, in mm per mm; largest first.
    weakest : array, shape (9,)
        The change of phi (rad), translation and target (mm) that is seen least; a step of length 1 mm.
    turns, slides : arrays, shapes (k, 3) and (m, 3)
        Directions in which phi (in S) and the target (in B) can change unseen, the farthest first; none in general.
    """

    singular_values: np.ndarray
    weakest: np.ndarray
    turns: np.ndarray
    slides: np.ndarray


@documented
def unseen_changes(T_BF, T_FS, target, tolerance=1e-3):
    """Changes of scanner and sphere that a set of poses hardly sees.

    Parameters
    ----------
    T_BF : array-like, shape (N, 4, 4)
        At least three poses.
    T_FS : array-like, shape (4, 4)
    target : array-like, shape (3,), mm
    tolerance : float
        A change counts as unseen when its singular value is no more than this share of the largest.

    Returns
    -------
    Unseen

    See Also
    --------
    predicted_sphere_covariance : how well the poses determine what they see.
    """
    x_S = sphere_in_scanner(T_BF, T_FS, target)
    as_count(len(x_S), "the number of poses")
    distance = rms_distance(x_S)
    scale = np.array([1 / distance] * 3 + [1.0] * 6)
    _, values, Vt = np.linalg.svd(joint_jacobian(T_BF, x_S, T_FS) * scale, full_matrices=False)
    free = Vt[values <= tolerance * values[0]]
    return Unseen(values, Vt[-1] * scale, _reached(free[:, :3]), _reached(free[:, 6:]))


def _reached(block):
    """Directions (k, 3) in which unseen changes reach into one block of unknowns, the farthest first."""
    _, sizes, directions = np.linalg.svd(block)
    return directions[: (sizes > 0.05).sum()]


def poses_that_see(T_FS, target, R_BF, x_S):
    """Robot poses with given orientations in which the scanner sees the sphere at given places.

    From target = R_BF (R_FS x_S + t_FS) + t_BF.

    Parameters
    ----------
    T_FS : array-like, shape (4, 4)
    target : array-like, shape (..., 3), mm
        One sphere, or one a pose.
    R_BF : array-like, shape (..., 3, 3)
    x_S : array-like, shape (..., 3), mm

    Returns
    -------
    T_BF : array, shape (..., 4, 4)
    """
    R_BF, arms = as_rotations(R_BF, "R_BF"), transform(T_FS, x_S)
    target = as_points(target, "target")
    fit_together(R_BF=R_BF.shape[:-2], x_S=arms.shape[:-1], target=target.shape[:-1])
    return pose(R_BF, target - (R_BF @ arms[..., None])[..., 0])


def pattern(T_FS, target, tilt, spread, n=31):
    """Robot poses spread evenly: the sphere all over a part of the scanner's field, the scanner tilted all around.

    Parameters
    ----------
    T_FS, target : array, shape (4, 4) and (3,)
        Where the scanner and the sphere roughly are.
    tilt : float
        Largest angle between the scanner's line of sight and straight down (rad).
    spread : array-like, shape (3,)
        Half the width of the part of the field that is used, in x, y and z of S, about the field's middle (mm); the
        sphere's center stays off the scan plane by at least 3 mm, on either side.
    n : int
        Number of poses.

    Returns
    -------
    T_BF : array, shape (n, 4, 4)
    """
    n, tilt, spread = as_size(n, "n"), as_number(tilt, "tilt"), as_shape(spread, "spread", 3)
    T_FS, target = as_shape(as_transforms(T_FS, "T_FS"), "T_FS", 4, 4), as_shape(target, "target", 3)
    k = np.arange(n)
    u = (0.5 + np.outer(k, _IRRATIONAL)) % 1.0  # evenly spread over a cube, without chance
    (x_low, x_high), (y_low, y_high), (z_low, z_high) = FIELD
    across = y_low + u[:, 1] * np.clip(spread[1] - y_low, 0.0, y_high - y_low)
    x_S = np.column_stack([
        0.5 * (x_low + x_high) + spread[0] * (2 * u[:, 0] - 1),
        across * np.where(k % 2, 1.0, -1.0),
        0.5 * (z_low + z_high) + spread[2] * (2 * u[:, 2] - 1),
    ])  # fmt: skip
    around, yaw = 2 * np.pi * u[:, 3], 2 * np.pi * u[:, 4] * min(1.0, tilt / 0.2)
    tilted = tilt * np.sqrt(u[:, 5])[:, None] * np.column_stack([np.cos(around), np.sin(around), np.zeros(n)])
    turned = exp_so3(np.column_stack([np.zeros((n, 2)), yaw]))
    return poses_that_see(T_FS, target, exp_so3(tilted) @ turned @ DOWN @ T_FS[:3, :3].T, x_S)
