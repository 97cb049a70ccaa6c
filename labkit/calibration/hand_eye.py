"""Hand-eye calibration with a sphere: where a scanner sits on a flange, from the sphere's center seen in many poses.

In every pose i the robot reports T_BF (base <- flange) and the scanner the sphere's center x_S, and all of them
describe one point:

    T_BF,i  T_FS  x_S,i  =  target          (thesis, formulas (4-1) to (4-3); there T_A^F T_F^S x_S = T_P^A x_P')

Lengths in mm, angles in rad. Increments are T_FS exp(phi, .): phi is a rotation vector in the scanner frame S,
translations are plain differences in F, the target lives in B. Covariances and singular values follow that order: phi,
translation, target. Source: thesis "Optimierung bei der Kalibrierung von Sensor-Roboter-Systemen", HAW Hamburg 2019,
sections 2.6, 4.4, 6.1, listings C2-C5.
"""

import contextlib
import functools
import math

import numpy as np

from ..checks import (
    as_count,
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
from ..geometry.frames import invert, matrix_from_kuka, pose, transform
from ..geometry.lie import exp_so3, nearest_rotation, skew
from .result import HandEye

MIN_TURN = 1e-3  # rad: poses turned by less than this about an axis do not fix the target across it
MIN_SPREAD = 1e-6  # relative: sphere centers closer to one line of the scanner frame than this fix no rotation
MAX_STEPS = 50
STEP_TOLERANCE = 1e-12  # rad
MEDIAN_CHI3 = (
    1.5381722544550522  # median length of a 3-vector of unit normal errors: turns a median into a standard deviation
)
TUKEY_CUT = 5.0  # residuals beyond this many standard deviations get the weight 0
SUBSETS = 60  # random pose subsets of the robust start: with a quarter of bad poses one of them is clean with 1 - 1e-5
FIELD = (
    (-25.0, 25.0),
    (3.0, 25.0),
    (190.0, 290.0),
)  # mm: x, |y| and z of a sphere center whose arc the scanner sees well
_IRRATIONAL = np.sqrt([2.0, 3.0, 5.0, 7.0, 11.0, 13.0]) % 1.0
_EYE = np.eye(3)
_GENERATORS = skew(_EYE)  # derivatives of a small rotation about x, y, z
_FLAT_GENERATORS = _GENERATORS.reshape(3, 9)


class SphereHandEye(HandEye):
    """A `HandEye` from a sphere: target is its center in B (3,), residuals are (N, 3) in B, all in mm.

    singular_values: of the Jacobian with phi times the root-mean-square distance of the sphere, so that every column is
    mm per mm. trace: rms distance (mm) at the linear start and after each step. Covariance and singular values are
    worked out when they are first asked for.
    """

    def __init__(self, T_FS, target, residuals, weights, trace, moments, target_free):
        vars(self).update(T_FS=T_FS, target=target, residuals=residuals, weights=weights, trace=trace)
        vars(self).update(_moments=moments, _target_free=target_free)

    @property
    def rms(self):
        """Root mean square of the residual distances over all poses, rejected ones included (mm)."""
        return float(rms_distance(self.residuals))

    @functools.cached_property
    def std(self):
        """Noise of one coordinate, estimated from the weighted residuals (mm); NaN without redundancy."""
        dof = 3 * self._moments[2] - (9 if self._target_free else 6)
        squares = np.vdot(self.residuals * self.weights[:, None], self.residuals)
        return math.sqrt(squares / dof) if dof > 0 else math.nan

    @functools.cached_property
    def _spectrum(self):
        return _spectrum(*self._moments, self.T_FS[:3, :3], self._target_free)

    @property
    def covariance(self):
        """Of phi (rad, in S), translation (mm, in F) and target (mm, in B): std^2 (J'J)^-1, (9, 9) or (6, 6)."""
        values, half = self._spectrum
        return self.std**2 * half @ half.T

    @property
    def singular_values(self):
        """Of the scaled Jacobian, largest first."""
        return self._spectrum[0]


def rms_distance(residuals):
    """Root of the mean squared length of residual vectors, (..., N, 3) -> (...); per axis it is sqrt(3) smaller."""
    residuals = as_finite(residuals, "residuals")
    if residuals.ndim < 2 or not residuals.shape[-2]:
        raise ValueError(f"residuals must have shape (..., N, 3) with N >= 1, got {residuals.shape}")
    return np.sqrt((residuals**2).sum(-1).mean(-1))


# --- model -----------------------------------------------------------------------------------------------------------


def sphere_residuals(T_BF, x_S, T_FS, target):
    """Residual vectors T_BF T_FS x_S - target in B (mm); (..., N, 4, 4), (..., N, 3), (4, 4), (3,) -> (..., N, 3).

    Source: thesis, formula (4-3).
    """
    moved, target = transform(T_BF, transform(T_FS, x_S)), as_points(target, "target")
    fit_together(T_BF=moved.shape, target=target.shape)
    return moved - target


def kuka_residuals(p2, T_BF, x_S, target):
    """The same for T_FS given as a KUKA pose `p2` = x, y, z, A, B, C (mm, rad), stacked as the vector (3 N,)."""
    return sphere_residuals(T_BF, x_S, matrix_from_kuka(p2), target).ravel()


def kuka_jacobian(p2, T_BF, x_S):
    """Analytic derivative of `kuka_residuals` by x, y, z, A, B, C, shape (3 N, 6); mm per mm and mm per rad."""
    T_BF, x_S = _poses(T_BF, x_S)
    p2 = as_shape(p2, "p2", 6)
    R = matrix_from_kuka(p2)[:3, :3]
    arms = x_S @ R.T  # the sphere center relative to the scanner's origin, in F
    J = np.empty((len(T_BF), 3, 6))
    J[..., :3] = T_BF[:, :3, :3]
    J[..., 3:] = -T_BF[:, :3, :3] @ skew(arms) @ rate_matrix(*p2[3:5])
    return J.reshape(-1, 6)


def rate_matrix(A, B):
    """E with omega = E (A', B', C'): the rotation vector, in the outer frame, that changes of the KUKA angles give.

    Its columns are the three axes the angles turn about: z, then y turned by A, then x turned by A and B. det E = -cos
    B: at B = +-90 deg the first and the last axis are one line, A and C become one angle, and no change of the angles
    tilts the frame about the missing direction. Source: what thesis table 7-3 stumbles over without naming it.
    """
    A, B = as_number(A, "A"), as_number(B, "B")
    ca, sa, cb, sb = np.cos(A), np.sin(A), np.cos(B), np.sin(B)
    return np.array([[0.0, -sa, ca * cb], [0.0, ca, sa * cb], [1.0, 0.0, -sb]])


def joint_jacobian(T_BF, x_S, T_FS, target_free=True):
    """Derivative of the residuals by phi (rad, in S), translation (in F) and target (in B); (3 N, 9) or (3 N, 6)."""
    (T_BF, x_S), T_FS = _poses(T_BF, x_S), as_shape(as_transforms(T_FS, "T_FS"), "T_FS", 4, 4)
    R = T_BF[:, :3, :3]
    J = np.empty((len(R), 3, 9 if target_free else 6))
    J[..., :3] = -R @ (T_FS[:3, :3] @ skew(x_S))
    J[..., 3:6] = R
    if target_free:
        J[..., 6:] = -_EYE
    return J.reshape(3 * len(R), -1)


def plate_jacobian(T_BF, x_S, p2, p3, x_P):
    """Derivative of the residuals by both KUKA poses of the thesis's second step, T_FS and T_BP; (3 N, 12).

    p3 enters through the one point T_BP x_P only, so three of its six columns depend on the others whatever the poses:
    the sphere center is observable, the plate's orientation is not. Source: thesis, table 4-2, step 2.
    """
    p3, x_P = as_shape(p3, "p3", 6), as_shape(x_P, "x_P", 3)
    arm = matrix_from_kuka(p3)[:3, :3] @ x_P
    one = -np.concatenate([np.eye(3), -skew(arm) @ rate_matrix(*p3[3:5])], axis=1)
    return np.concatenate([kuka_jacobian(p2, T_BF, x_S), np.tile(one, (len(x_S), 1))], axis=1)


# --- calibration -----------------------------------------------------------------------------------------------------


def calibrate_sphere_target(T_BF, x_S, target=None, robust=False, rng=None):
    """Pose of a scanner on the flange, and the sphere's center, from the center seen in N robot poses, without a start.

    Minimizes the sum of squared residual vectors: the maximum-likelihood estimate for equal, isotropic errors.
    Translation and target enter linearly and are eliminated once; what remains is a quadratic function of the nine
    entries of the rotation matrix, solved freely (the linear start) and then on SO(3) by Gauss-Newton steps that no
    longer depend on N. With a known target even that is one step: the fit of two point sets.

    Parameters
    ----------
    T_BF : array-like, shape (N, 4, 4)
        Robot poses, base <- flange. N >= 4, turned about at least two axes (N >= 3 and no turning needed when `target`
        is given).
    x_S : array-like, shape (N, 3)
        Sphere centers in the scanner frame (mm).
    target : array-like, shape (3,), optional
        Sphere center in the base, if it is known; its error then goes into the result undiminished.
    robust : bool
        Least trimmed squares over random subsets, then Tukey weights on each pose's residual length; bears a third of
        bad poses.
    rng : numpy.random.Generator, optional
        Source of the subsets; a fixed one is used without it, so that results repeat.

    Returns
    -------
    SphereHandEye

    Raises
    ------
    ValueError
        Naming the missing motion: poses that only translate, poses turned about one axis, a sphere that stays at one
        place or on one line of the scanner frame; and wrong shapes.

    Source: thesis, sections 4.4 and 6.1.5, which iterate from a CAD pose with the target held fixed.
    """
    T_BF, x_S = _poses(T_BF, x_S)
    fewest = 4 if target is None else 3
    if len(T_BF) < fewest:
        raise ValueError(f"at least {fewest} poses are needed, got {len(T_BF)}")
    target = None if target is None else as_shape(target, "target", 3)
    R, t = T_BF[:, :3, :3], T_BF[:, :3, 3]
    weights = np.ones(len(R))
    if robust:
        rng = np.random.default_rng(0) if rng is None else rng
        weights = _trimmed_start(R, t, x_S, target, rng)
        R_FS, t_FS, center, residuals, weights, trace, moments = _tukey(R, t, x_S, target, weights)
    else:
        R_FS, t_FS, center, trace, moments = _solve(R, t, x_S, weights, target)
        residuals = _residuals(R, t, x_S, R_FS, t_FS, center)
        trace[-1:] = [_rms(residuals)]
    T_FS = np.zeros((4, 4))
    T_FS[:3, :3], T_FS[:3, 3], T_FS[3, 3] = R_FS, t_FS, 1.0
    return SphereHandEye(T_FS, center, residuals, weights, np.array(trace), moments, target is None)


def linear_start(T_BF, x_S):
    """T_FS and target from the linear equations in 15 unknowns (R_FS, t_FS, target), R_FS then made a rotation.

    R_FS x_S + t_FS - R_BF' target = -R_BF' t_BF: three equations a pose, linear because nothing says yet that R_FS is a
    rotation. Needs five poses or more and sphere centers that do not lie in one plane of the scanner frame.
    """
    T_BF, x_S = _poses(T_BF, x_S)
    R_t, n = np.swapaxes(T_BF[:, :3, :3], 1, 2), len(T_BF)
    D = np.zeros((n, 3, 15))
    for k in range(3):
        D[:, k, 3 * k : 3 * k + 3] = x_S
    D[..., 9:12], D[..., 12:] = np.eye(3), -R_t
    F = -(R_t @ T_BF[:, :3, 3, None])[..., 0]
    u, _, rank, s = np.linalg.lstsq(D.reshape(-1, 15), F.ravel(), rcond=1e-12)
    if rank < 15:
        raise ValueError(
            f"the linear system needs rank 15, got {rank}: take five poses or more, turned about two axes, "
            "with the sphere at different depths and places of the scanner's field"
        )
    T_FS = np.eye(4)
    T_FS[:3, :3], T_FS[:3, 3] = nearest_rotation(u[:9].reshape(3, 3)), u[9:12]
    return T_FS, u[12:]


def gauss_newton_pose(start, T_BF, x_S, target=None, parameters="euler", max_steps=50, tolerance=1e-10):
    """Plain Gauss-Newton from a start pose, each iterate kept: what listing C5 does, with the derivative exact.

    Parameters
    ----------
    start : array-like, shape (6,)
        KUKA pose x, y, z, A, B, C of the scanner (mm, rad).
    target : array-like, shape (3,), optional
        Sphere center in B; freed as three more unknowns (starting from the mean of what the start pose predicts)
        without it.
    parameters : {"euler", "se3"}
        "euler" adds the step to A, B, C; "se3" turns the frame by the step's rotation vector, so no pose is special.
    tolerance : float
        Ends when the step moves no sphere center by more than this (mm).

    Returns
    -------
    poses : array, shape (k + 1, 4, 4)
    rms : array, shape (k + 1,)
    singular_values : array, shape (k + 1, 6)
        Of the Jacobian by the pose at each iterate (angles times the mean distance of the sphere, all mm per mm).
    converged : bool
    """
    if parameters not in ("euler", "se3"):
        raise ValueError(f"parameters must be 'euler' or 'se3', got {parameters!r}")
    (T_BF, x_S), p = _poses(T_BF, x_S), as_shape(start, "start", 6)
    max_steps, tolerance = as_count(max_steps, "max_steps", at_least=0), as_number(tolerance, "tolerance")
    T_FS, free = matrix_from_kuka(p), target is None
    center = transform(T_BF, transform(T_FS, x_S)).mean(0) if free else as_shape(target, "target", 3)
    reach = np.sqrt((x_S**2).sum(-1).mean())
    if not reach > 0:
        raise ValueError("x_S must hold sphere centers away from the scanner's origin, got none or zeros alone")
    scale = np.array([1, 1, 1, 1 / reach, 1 / reach, 1 / reach] + [1, 1, 1] * free)
    poses, rms, values, converged = [], [], [], False
    for step_number in range(max_steps + 1):
        residuals = sphere_residuals(T_BF, x_S, T_FS, center)
        if parameters == "euler":
            J = kuka_jacobian(p, T_BF, x_S)
        else:
            J = joint_jacobian(T_BF, x_S, T_FS, target_free=False)[:, [3, 4, 5, 0, 1, 2]]
        if free:
            J = np.concatenate([J, np.tile(-np.eye(3), (len(x_S), 1))], axis=1)
        U, s, Vt = np.linalg.svd(J * scale, full_matrices=False)
        poses.append(T_FS)
        rms.append(rms_distance(residuals))
        values.append(s)
        if converged or step_number == max_steps:
            break
        inverse = np.divide(1.0, s, out=np.zeros_like(s), where=s > 1e-14 * s[0])
        scaled = -Vt.T @ (inverse * (U.T @ residuals.ravel()))
        step = scaled * scale
        if parameters == "euler":
            p = p + step[:6]
            T_FS = matrix_from_kuka(p)
        else:
            T_FS = T_FS.copy()
            T_FS[:3, :3] = T_FS[:3, :3] @ exp_so3(step[3:6])
            T_FS[:3, 3] += step[:3]
        center = center + step[6:] if free else center
        converged = bool(np.abs(scaled).max() <= tolerance)
    return np.array(poses), np.array(rms), np.array(values), converged


def tukey_weights(lengths, std, cut=TUKEY_CUT):
    """Weights (1 - (r / (cut std))^2)^2 of residual lengths r, 0 beyond the cut: far outliers have no say at all."""
    u = as_finite(lengths, "lengths") / (as_positive_number(cut, "cut") * as_positive_number(std, "std"))
    return np.where(np.abs(u) < 1, (1 - u * u) ** 2, 0.0)


def leave_one_out(T_BF, x_S, robust=False):
    """Residual vectors (N, 3) of each pose under the calibration from the others: what it is worth elsewhere."""
    T_BF, x_S = _poses(T_BF, x_S)
    found = []
    for i in range(len(T_BF)):
        fit = calibrate_sphere_target(np.delete(T_BF, i, 0), np.delete(x_S, i, 0), robust=robust)
        found.append(sphere_residuals(T_BF[i], x_S[i], fit.T_FS, fit.target))
    return np.array(found)


def fit_radius(T_BF, x_S, printed_radius=30.0):
    """Sphere radius that the poses themselves ask for, all else free as well: (radius, standard deviation), mm.

    Each center was computed from a fitted circle as y = +-sqrt(R^2 - r^2) with R = `printed_radius`; another R moves it
    along y only, y' = +-sqrt(y^2 + R^2 - printed_radius^2). Residuals linear in y make this a tenth column of the
    Jacobian; Gauss-Newton steps on R^2, all else solved exactly in between.

    Source: beyond the thesis, which uses three different radii (certificate, listing C16, coordinate machine).
    """
    (T_BF, x_S), radius = _poses(T_BF, x_S), as_positive_number(printed_radius, "printed_radius")
    if len(x_S) < 4:
        raise ValueError(f"at least 4 poses are needed, got {len(x_S)}")
    side, square = np.sign(x_S[:, 1]), x_S[:, 1] ** 2 - radius**2
    if not side.all():
        raise ValueError("x_S must lie off the scan plane: with y = 0 nothing says on which side the center is")
    for _ in range(MAX_STEPS):
        x = x_S.copy()
        x[:, 1] = side * np.sqrt(np.maximum(square + radius**2, 1e-12))
        fit = calibrate_sphere_target(T_BF, x)
        J = np.concatenate([joint_jacobian(T_BF, x, fit.T_FS), _by_radius(T_BF, x, fit.T_FS, radius)], axis=1)
        step = np.linalg.lstsq(J, -fit.residuals.ravel(), rcond=None)[0][9]
        radius += step
        if abs(step) < 1e-9:
            break
    variance = (fit.residuals**2).sum() / (3 * len(x) - 10)
    return radius, float(np.sqrt(variance * np.linalg.inv(J.T @ J)[9, 9]))


def _by_radius(T_BF, x, T_FS, radius):
    by_R = np.zeros_like(x)
    by_R[:, 1] = radius / x[:, 1]
    return (T_BF[:, :3, :3] @ (T_FS[:3, :3] @ by_R[..., None])).reshape(-1, 1)


def predicted_covariance(T_BF, T_FS, target, std):
    """Covariance (9, 9) of phi, translation and target that a set of poses would give, before anything is measured.

    The sphere centers follow from the poses: x_S = T_FS^-1 T_BF^-1 target. This is the Cramer-Rao bound for isotropic
    noise `std` (mm). Raises ValueError for poses that leave a direction undetermined.
    """
    x_S = transform(invert(T_FS), transform(invert(T_BF), target))
    J = joint_jacobian(T_BF, x_S, T_FS)
    scale = np.maximum(np.linalg.norm(J, axis=0), np.finfo(float).tiny)
    values = np.linalg.svd(J / scale, compute_uv=False)
    if len(values) < 9 or values[-1] <= MIN_SPREAD * values[0]:
        raise ValueError("the poses leave scanner or target undetermined: too few, or turned about one axis only")
    return as_positive_number(std, "std") ** 2 * np.linalg.inv(J.T @ J)


def poses_that_see(T_FS, target, R_BF, x_S):
    """Robot poses with given orientations in which the scanner sees the sphere at given places.

    From target = R_BF (R_FS x_S + t_FS) + t_BF; (4, 4), (3,), (..., 3, 3), (..., 3) -> T_BF (..., 4, 4).
    """
    R_BF, arms = as_rotations(R_BF, "R_BF"), transform(T_FS, x_S)
    fit_together(R_BF=R_BF.shape[:-2], x_S=arms.shape[:-1])
    return pose(R_BF, as_points(target, "target") - (R_BF @ arms[..., None])[..., 0])


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
    n, tilt, spread = as_count(n, "n"), as_number(tilt, "tilt"), as_shape(spread, "spread", 3)
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
    down = np.diag([1.0, -1.0, -1.0])
    turned = exp_so3(np.column_stack([np.zeros((n, 2)), yaw]))
    return poses_that_see(T_FS, target, exp_so3(tilted) @ turned @ down @ T_FS[:3, :3].T, x_S)


# --- inside ----------------------------------------------------------------------------------------------------------


def _poses(T_BF, x_S):
    """Robot poses (N, 4, 4) with the sphere center (N, 3) seen in each."""
    T_BF, x_S = as_transforms(T_BF, "T_BF"), as_points(x_S, "x_S")
    if T_BF.ndim != 3 or x_S.shape != (len(T_BF), 3):
        raise ValueError(f"T_BF and x_S must have shapes (N, 4, 4) and (N, 3), got {T_BF.shape} and {x_S.shape}")
    return T_BF, x_S


def _residuals(R, t, x, R_FS, t_FS, center):
    y = x @ R_FS.T + t_FS
    return (R * y[:, None]).sum(-1) + (t - center)


def _rms(residuals):
    return math.sqrt(np.vdot(residuals, residuals) / len(residuals))


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


def _reduce(mean, G, total, target):
    """The cost without translation and target, r'Sr - 2 h'r + c in the entries r of R_FS, and how to get both back."""
    x_mean, b_mean, R_mean = mean[:3], mean[3:6], mean[6:].reshape(3, 3)
    M = G[:3, :3]
    _refuse_narrow(M, x_mean)
    if target is not None:
        return M, G[3:6, :3], 0.0, lambda R_FS: (b_mean - R_FS @ x_mean, target)
    W_inverse = _invert_spread(G[6:, 6:].reshape(3, 3, 3, 3).trace(axis1=1, axis2=3), total)
    D, d = G[6:, :3].reshape(3, 9), G[6:, 3:6].reshape(3, 3, 3).trace(axis1=1, axis2=2)
    DW = D.T @ W_inverse
    S = -DW @ D
    for k in (0, 3, 6):
        S[k : k + 3, k : k + 3] += M
    h = G[3:6, :3].ravel() - DW @ d
    c = G[3, 3] + G[4, 4] + G[5, 5] - d @ W_inverse @ d

    def recover(R_FS):
        center = W_inverse @ (D @ R_FS.ravel() - d)
        return b_mean + center @ R_mean - R_FS @ x_mean, center

    return S, h, c, recover


def _invert_spread(W, total):
    """Inverse of the spread of the orientations, sum of dR dR'; refuses poses that leave the target free."""
    with contextlib.suppress(np.linalg.LinAlgError):
        inverse = np.linalg.inv(W)
        if (
            0 < np.vdot(inverse, inverse) < (total * MIN_TURN**2) ** -2
        ):  # then no eigenvalue of W is below total MIN_TURN^2
            return inverse
    values, vectors = np.linalg.eigh(W)
    turn = np.sqrt(np.maximum(values, 0.0) / total)  # rad, roughly the rms turn about the axes across each direction
    if turn[0] < MIN_TURN:
        if turn[2] < MIN_TURN:
            raise ValueError(
                "the poses only translate: scanner and sphere can be shifted together in any direction; "
                "add poses that turn the flange about two different axes"
            )
        axis = vectors[:, 0] * np.sign(vectors[np.argmax(np.abs(vectors[:, 0])), 0])
        raise ValueError(
            f"all poses turn about one axis, {shown(axis, '.3f')} in the base: scanner and "
            "sphere "
            "can be shifted together along it; add poses that turn the flange about another axis"
        )
    return (vectors / values) @ vectors.T


def _refuse_narrow(M, x_mean):
    """Refuse sphere centers on one line of the scanner frame: nothing then fixes the rotation about it."""
    size = M.trace()
    minors = 0.5 * (size * size - np.vdot(M, M))  # about the product of the two largest eigenvalues
    if minors <= MIN_SPREAD**2 * max(size, x_mean @ x_mean * np.finfo(float).eps) ** 2:
        where = "at one place" if size <= MIN_SPREAD**2 * (x_mean @ x_mean) else "on one line"
        raise ValueError(
            f"the sphere stays {where} of the scanner frame, so the scanner's rotation about it is free; "
            "change its depth and its place along the scan line between the poses"
        )


def _solve(R, t, x, w, target, steps=MAX_STEPS):
    """Least squares with given weights: R_FS, t_FS, target, the rms distance of the iterates, and the moments."""
    moments = _moments(R, t, x, w, target)
    S, h, c, recover = _reduce(*moments, target)
    if target is not None:
        R_FS = nearest_rotation(h)
        return R_FS, *recover(R_FS), [], moments
    R_FS, costs = _descend(S, h, _rotation_start(S, h), steps)
    return R_FS, *recover(R_FS), [math.sqrt(max(cost + c, 0.0) / moments[2]) for cost in costs], moments


def _rotation_start(S, h):
    """Rotation next to the unconstrained minimum S^-1 h, or the best of 24 right-angled ones where S is singular."""
    values, vectors = np.linalg.eigh(S)
    if values[0] > 1e-9 * values[8]:
        return _polar(((vectors / values) @ (h @ vectors)).reshape(3, 3))
    return min((_descend(S, h, Q) for Q in _RIGHT_ANGLED), key=lambda found: found[1][-1])[0]


def _polar(M):
    """Nearest rotation by Newton-Schulz steps where M almost is one, by SVD elsewhere."""
    for _ in range(6):
        error = M.T @ M - _EYE
        square = np.vdot(error, error)
        if square > 0.1:
            break
        M = M - 0.5 * (M @ error)
        if square < 1e-16:
            return M
    return nearest_rotation(M)


def _descend(S, h, R_FS, steps=MAX_STEPS):
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
        while cost > costs[-1] + floor and size >= STEP_TOLERANCE:
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


def _right_angled():
    found = []
    for axes in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)):
        for signs in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            Q = np.zeros((3, 3))
            Q[0, axes[0]], Q[1, axes[1]], Q[2, axes[2]] = *signs, 1
            Q[2] *= np.linalg.det(Q)
            found.append(Q)
    return found


_RIGHT_ANGLED = _right_angled()


def _trimmed_start(R, t, x, target, rng):
    """Weights 0 or 1 of the half of the poses that agree best: random subsets, the best five of them concentrated."""
    n, size = len(R), min(len(R), 6 if target is None else 4)
    half = min(n, (n + size) // 2 + 1)

    def concentrate(chosen):
        try:
            R_FS, t_FS, center, *_ = _solve(R[chosen], t[chosen], x[chosen], np.ones(len(chosen)), target, steps=4)
        except (ValueError, np.linalg.LinAlgError):
            return np.inf, None  # a subset without the motions the whole set has
        squares = (_residuals(R, t, x, R_FS, t_FS, center) ** 2).sum(1)
        nearest = np.argsort(squares, kind="stable")[:half]
        return squares[nearest].sum(), nearest

    found = [concentrate(rng.choice(n, size, replace=False)) for _ in range(SUBSETS)]
    found = sorted((f for f in found if f[1] is not None), key=lambda f: f[0])[:5]
    for _ in range(3):
        found = [concentrate(nearest) for _, nearest in found]
    weights = np.zeros(n)
    weights[min(found, key=lambda f: f[0])[1] if found else slice(None)] = 1.0
    return weights


def _tukey(R, t, x, target, weights):
    """Iteratively reweighted least squares from the trimmed start; the scale is the median residual length."""
    trace = []
    for _ in range(MAX_STEPS):
        R_FS, t_FS, center, _, moments = _solve(R, t, x, weights, target)
        residuals = _residuals(R, t, x, R_FS, t_FS, center)
        lengths = np.sqrt((residuals * residuals).sum(1))
        trace.append(_rms(residuals))
        scale = np.median(lengths) / MEDIAN_CHI3
        if scale <= 1e-12 * np.abs(x).max():  # noise-free: what does not fit exactly is wrong
            new = (lengths <= 1e-9 * np.abs(x).max()).astype(float)
        else:
            new = tukey_weights(lengths, scale)
        if np.abs(new - weights).max() < 1e-8:
            break
        weights = new
    return R_FS, t_FS, center, residuals, weights, trace, moments


def _spectrum(mean, G, total, R_FS, target_free):
    """Singular values of the scaled Jacobian of phi, translation (and target), and half with (J'J)^-1 = half half'.

    J'J is put together from the moments of the poses; J = (-R_BF R_FS [x], R_BF, -I) itself is never built.
    """
    k, x_mean = 9 if target_free else 6, mean[:3]
    moment = G[:3, :3] + total * np.outer(x_mean, x_mean)
    reach = math.sqrt(moment.trace() / total)
    first = (total / reach) * (x_mean @ _FLAT_GENERATORS).reshape(3, 3) @ R_FS.T
    A = total * np.eye(k)
    A[:3, :3] = (moment.trace() * _EYE - moment) / reach**2
    A[:3, 3:6], A[3:6, :3] = first, first.T
    if target_free:
        turned = -total * mean[6:].reshape(3, 3)
        mixed = (G[:3, 6:] / reach + np.outer(total / reach * x_mean, mean[6:])).reshape(3, 3, 3)  # sum of x_j R_BF
        cross = -(_GENERATORS @ R_FS.T @ mixed.transpose(0, 2, 1)).sum(0)
        A[3:6, 6:], A[6:, 3:6] = turned.T, turned
        A[:3, 6:], A[6:, :3] = cross, cross.T
    values, vectors = np.linalg.eigh(A)
    values = np.sqrt(np.maximum(values, np.finfo(float).tiny))
    half = vectors / values
    half[:3] /= reach
    return values[::-1], half
