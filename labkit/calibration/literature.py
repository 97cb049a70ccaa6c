"""Hand-eye methods of the literature that the thesis cites: Kim, Cho, Kim and Li et al.

Source: thesis "Optimierung bei der Kalibrierung von Sensor-Roboter-Systemen", HAW Hamburg 2019, section 2.6.
"""

from dataclasses import dataclass

import numpy as np

from ..checks import (
    PRODUCT_TOLERANCE,
    as_matrices,
    as_positive_number,
    as_rotations,
    as_shape,
    as_size,
    as_transforms,
    shown,
)
from ..documented import documented
from ..geometry.frames import invert, pose, transform
from ..geometry.lie import exp_so3, nearest_rotation
from .hand_eye import MIN_SPREAD, as_sightings, calibrate_sphere_target, linear_start, sphere_in_scanner
from .planning import poses_that_see, predicted_sphere_covariance

CUBE = 60.0 * (np.indices((2, 2, 2)).reshape(3, 8).T - 0.5)  # mm, corners


def kim_linear(T_BF, points_S, points_W):
    """T_FS by the linear system D U = F of Kim, Cho and Kim, from a body with several marked points.

    Delta_T T_FS = T_FS (X_S,p X_W') (X_S,q X_W')^-1 for two poses p and q: one AX = XB with twelve unknowns for all
    consecutive pairs, stacked and solved by least squares; the rotation block is then made a rotation. The world frame
    of the body cancels.

    Parameters
    ----------
    T_BF : array-like, shape (N, 4, 4), N >= 3
    points_S : array-like, shape (N, n, 3)
        The points as measured in each pose (mm).
    points_W : array-like, shape (n, 3)
        The same points in the body's own frame.

    Returns
    -------
    T_FS : array, shape (4, 4)

    Raises
    ------
    ValueError
        When the points do not span space: X_S X_W' is then singular. A sphere offers one point, rank 1: the method
        needs four or more.

    Source: thesis, formulas (2-43) to (2-46) and appendix A, after Kim, Cho, Kim (2001).
    """
    T_BF = as_shape(as_transforms(T_BF, "T_BF"), "T_BF", "N", 4, 4)
    X_W = as_shape(points_W, "points_W", "n", 3)
    X_S = as_shape(points_S, "points_S", len(T_BF), len(X_W), 3)
    if len(T_BF) < 3:
        raise ValueError(f"at least 3 poses are needed, got {len(T_BF)}")
    if not len(X_W):
        raise ValueError("points_W must hold four points or more, got none")
    X_S, X_W = (np.concatenate([X, np.ones((*X.shape[:-1], 1))], axis=-1) for X in (X_S, X_W))
    rank = np.linalg.matrix_rank(X_W, tol=1e-9 * np.abs(X_W).max())
    if rank < 4:
        raise ValueError(
            f"points_W must hold four points or more that do not lie in one plane: X_S X_W' has rank {rank}, not 4"
        )
    M = np.swapaxes(X_S, 1, 2) @ X_W
    if (np.linalg.matrix_rank(M[1:]) < 4).any():
        raise ValueError("points_S must span space in every pose, as points_W do")
    D, F = kim_matrix(invert(T_BF[:-1]) @ T_BF[1:], M[:-1] @ np.linalg.inv(M[1:]))
    u, _, rank, _ = np.linalg.lstsq(D.reshape(-1, 12), F.ravel(), rcond=1e-10)
    if rank < 12:
        raise ValueError(f"the motions must turn about two axes: the stacked system has rank {rank}, not 12")
    T_FS = np.eye(4)
    T_FS[:3, :3], T_FS[:3, 3] = nearest_rotation(u.reshape(3, 4)[:, :3]), u.reshape(3, 4)[:, 3]
    return T_FS


def kim_matrix(A, B):
    """A X = X B as linear equations D x = F in the rows of X one after another, X's last row being 0 0 0 1.

    Parameters
    ----------
    A, B : array-like, shape (..., 4, 4)
        Motions. B, made of measured points, may be rigid but for their noise: only its last row is that of a motion.

    Returns
    -------
    D, F : arrays, shapes (..., 12, 12) and (..., 12)

    Raises
    ------
    ValueError
        A and B of different shapes.

    Source: thesis, appendix A.
    """
    A, B = as_transforms(A, "A", PRODUCT_TOLERANCE), as_matrices(B, "B", 4, 4)
    if A.shape != B.shape:
        raise ValueError(f"A and B must have the same shape (..., 4, 4), got {A.shape} and {B.shape}")
    left = A[..., :3, None, :3, None] * np.eye(4)[:, None]
    right = np.eye(3)[:, None, :, None] * np.swapaxes(B, -1, -2)[..., None, :, None, :]
    F = np.zeros((*A.shape[:-2], 3, 4))
    F[..., 3] = -A[..., :3, 3]
    return (left - right).reshape(*A.shape[:-2], 12, 12), F.reshape(*A.shape[:-2], 12)


def li_rotation(T_BF, x_S):
    """R_FS from poses that are translated only, step 1 of Li et al.

    Two poses of the same orientation see the sphere shifted, R_BF R_FS (x_q - x_p) = t_p - t_q; the thesis prints the
    right side with the sign reversed. The shifts are taken from their means, and the directions fitted by SVD.

    Parameters
    ----------
    T_BF : array-like, shape (N, 4, 4), N >= 3
        Robot poses that all have the orientation of the first.
    x_S : array-like, shape (N, 3)
        The sphere's center in the scanner (mm).

    Returns
    -------
    R_FS : array, shape (3, 3)

    Raises
    ------
    ValueError
        When the translations lie along one line: the rotation about it stays free.

    Source: thesis, formula (2-41), after Li et al. (2011).
    """
    T_BF, x_S = as_sightings(T_BF, x_S)
    seen = x_S - x_S.mean(0)
    moved = -(T_BF[:, :3, 3] - T_BF[:, :3, 3].mean(0)) @ T_BF[0, :3, :3]
    return _fitted_rotation(moved, seen)


def _fitted_rotation(moved, seen):
    """The rotation that turns the shifts seen into those moved, row by row."""
    values = np.linalg.svd(moved, compute_uv=False)
    if len(values) < 2 or values[1] <= MIN_SPREAD * values[0]:
        raise ValueError("the translations must not all lie along one line: the rotation about it stays free")
    return nearest_rotation(moved.T @ seen)


def li_translation(T_BF, x_S, R_FS):
    """t_FS and target once R_FS is known, step 2 of Li et al.: R_BF t_FS - target = -(t_BF + R_BF R_FS x_S).

    Parameters
    ----------
    T_BF : array-like, shape (N, 4, 4), N >= 2
        Robot poses that turn about two axes.
    x_S : array-like, shape (N, 3)
        The sphere's center in the scanner (mm).
    R_FS : array-like, shape (3, 3)

    Returns
    -------
    t_FS, target : arrays, shape (3,), mm

    Raises
    ------
    ValueError
        When the poses turn about one axis only.

    Source: thesis, formulas (2-40) and (2-42), after Li et al. (2011).
    """
    (T_BF, x_S), R_FS = as_sightings(T_BF, x_S), as_shape(as_rotations(R_FS, "R_FS"), "R_FS", 3, 3)
    R, t = T_BF[:, :3, :3], T_BF[:, :3, 3]
    design = np.concatenate([R, np.tile(-np.eye(3), (len(R), 1, 1))], axis=2).reshape(-1, 6)
    right = -(t + (R @ (x_S @ R_FS.T)[..., None])[..., 0])
    u, _, rank, _ = np.linalg.lstsq(design, right.ravel(), rcond=1e-9)
    if rank < 6:
        raise ValueError(f"the rotations must turn about two axes: step 2 has rank {rank}, not 6")
    return u[:3], u[3:]


def li_two_step(T_BF, x_S, max_turn_deg=0.01):
    """T_FS and target by the two steps of Li et al.: rotation from pure translations, then translation.

    Step 1 is that of `li_rotation` for all pairs of poses with the same orientation, step 2 `li_translation`.

    Parameters
    ----------
    T_BF, x_S : as in `calibrate_sphere_target`
    max_turn_deg : float
        Poses whose orientations differ by at most this (deg) count as translated only.

    Returns
    -------
    T_FS : array, shape (4, 4)
    target : array, shape (3,), mm

    Raises
    ------
    ValueError
        When fewer than two independent translations are among the poses, or the other poses turn about one axis only.

    Source: thesis, formulas (2-40) to (2-42), after Li et al. (2011).
    """
    (T_BF, x_S), max_turn_deg = as_sightings(T_BF, x_S), as_positive_number(max_turn_deg, "max_turn_deg")
    if len(T_BF) < 2:
        raise ValueError(f"at least 2 poses are needed, got {len(T_BF)}")
    R, t = T_BF[:, :3, :3], T_BF[:, :3, 3]
    p, q = np.triu_indices(len(R), 1)
    chord = np.linalg.norm(R[p] - R[q], axis=(1, 2))  # 2 sqrt(2) sin(angle / 2)
    same = chord <= 2 * np.sqrt(2) * np.sin(np.deg2rad(max_turn_deg) / 2)
    if not same.any():
        least = np.rad2deg(2 * np.arcsin(chord.min() / (2 * np.sqrt(2))))
        raise ValueError(
            f"no two poses have the same orientation (the nearest differ by {shown(least, '.3g')} deg): "
            "step 1 needs the robot to translate without turning"
        )
    p, q = p[same], q[same]
    moved = (np.swapaxes(R[p], 1, 2) @ (t[p] - t[q])[..., None])[..., 0]
    R_FS = _fitted_rotation(moved, x_S[q] - x_S[p])
    t_FS, target = li_translation(T_BF, x_S, R_FS)
    return pose(R_FS, t_FS), target


@dataclass(frozen=True, eq=False)
class SuitableScene:
    """Poses that suit the methods of the literature as well, and what is seen in them.

    Attributes
    ----------
    T_FS : array, shape (4, 4)
        The true scanner (mm).
    target : array, shape (3,)
        The true sphere, and the middle of the cube (mm).
    T_BF : array, shape (16, 4, 4)
        Twelve poses turned about all axes, and four that only translate the first.
    x_S : array, shape (16, 3)
        The sphere's center as measured (mm).
    cube_S : array, shape (16, 8, 3)
        The corners of a cube as measured (mm).
    cube_W : array, shape (8, 3)
        The same corners in the cube's own frame (mm).
    """

    T_FS: np.ndarray
    target: np.ndarray
    T_BF: np.ndarray
    x_S: np.ndarray
    cube_S: np.ndarray
    cube_W: np.ndarray

    @property
    def translated(self):
        """Numbers of the poses that share one orientation."""
        return np.array([0, 12, 13, 14, 15])


@documented
def suitable_scene(std, rng):
    """A random scanner, a sphere and a 60 mm cube, seen from poses that suit all methods.

    Parameters
    ----------
    std : float
        Noise of each coordinate (mm).
    rng : numpy.random.Generator

    Returns
    -------
    SuitableScene
    """
    std = as_positive_number(std, "std")
    T_FS, target = pose(exp_so3(rng.uniform(-1, 1, 3)), rng.uniform(-100, 100, 3)), rng.uniform(-500, 500, 3)
    places = np.column_stack([rng.uniform(-25, 25, 12), rng.uniform(-20, 20, 12), rng.uniform(190, 290, 12)])
    T_BF = poses_that_see(T_FS, target, exp_so3(rng.uniform(-1, 1, (12, 3))), places)
    shifts = np.concatenate([30 * np.eye(3), [[-30.0, 20.0, 10.0]]])
    T_BF = np.concatenate([T_BF, T_BF[:1] @ pose(np.tile(np.eye(3), (4, 1, 1)), shifts)])
    exact = sphere_in_scanner(T_BF, T_FS, target)
    seen = exact + std * rng.normal(size=exact.shape)
    cube = transform(invert(T_BF @ T_FS)[:, None], CUBE + target)
    return SuitableScene(T_FS, target, T_BF, seen, cube + std * rng.normal(size=cube.shape), CUBE)


METHODS = {
    "joint fit (sphere)": lambda scene: calibrate_sphere_target(scene.T_BF, scene.x_S).T_FS,
    "linear start (sphere)": lambda scene: linear_start(scene.T_BF, scene.x_S)[0],
    "Li et al. (sphere)": lambda scene: li_two_step(scene.T_BF, scene.x_S)[0],
    "Kim, Cho, Kim (cube)": lambda scene: kim_linear(scene.T_BF, scene.cube_S, scene.cube_W),
}


@documented
def compare_methods(repeats, std, rng, methods=METHODS):
    """Errors of several methods on scenes that suit all of them, and the bound for one sphere.

    Parameters
    ----------
    repeats : int
    std : float
        Noise of each coordinate (mm).
    rng : numpy.random.Generator
    methods : dict of functions, optional
        {name: function of a `SuitableScene` that returns T_FS}; those of the literature and the joint fit by default.

    Returns
    -------
    errors : dict
        {method: rms error of the translation of T_FS (mm)}.
    bound : float
        The Cramer-Rao bound of one sphere (mm), rms over the repeats.
    """
    repeats, std = as_size(repeats, "repeats"), as_positive_number(std, "std")
    squares, bounds = {name: [] for name in methods}, []
    for _ in range(repeats):
        scene = suitable_scene(std, rng)
        for name, method in methods.items():
            found = as_shape(method(scene), f"what {name} returns", 4, 4)
            squares[name].append(((found[:3, 3] - scene.T_FS[:3, 3]) ** 2).sum())
        covariance = predicted_sphere_covariance(scene.T_BF, scene.T_FS, scene.target, std)
        bounds.append(np.trace(covariance[3:6, 3:6]))
    return {name: float(np.sqrt(np.mean(square))) for name, square in squares.items()}, float(np.sqrt(np.mean(bounds)))
