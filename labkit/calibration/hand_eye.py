"""Hand-eye calibration with a sphere: where a scanner sits on a flange, from the sphere's center seen in many poses.

In every pose i the robot reports T_BF (base <- flange) and the scanner the sphere's center x_S, and all of them
describe one point:

    T_BF,i  T_FS  x_S,i  =  target          (thesis, formulas (4-1) to (4-3); there T_A^F T_F^S x_S = T_P^A x_P')

`linear_start` forgets that R_FS is a rotation and solves linear equations in fifteen unknowns; Gauss-Newton steps on
the pose do the rest. `labkit.fast.hand_eye` finds the same minimum from sums over the poses. Lengths in mm, angles in
rad. Increments are T_FS exp(phi, .): phi is a rotation vector in the scanner frame S, translations are plain
differences in F, the target lives in B. Covariances and singular values follow that order: phi, translation, target.
Source: thesis "Optimierung bei der Kalibrierung von Sensor-Roboter-Systemen", HAW Hamburg 2019, sections 2.6, 4.4,
6.1, listings C2 to C5.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..checks import (
    SMALLEST_POSITIVE,
    as_count,
    as_finite,
    as_names,
    as_number,
    as_optional_generator,
    as_points,
    as_positive_number,
    as_row_weights,
    as_shape,
    as_transforms,
    as_truth,
    fit_together,
    shown,
)
from ..documented import documented, unchecked
from ..geometry.frames import invert, matrix_from_kuka, pose, transform
from ..geometry.lie import exp_so3, nearest_rotation, skew
from .motion import refuse_one_axis
from .result import Parameter, Result, point_parameters, pose_parameters, result_class
from .robust import median_std, tukey_weights

MIN_SPREAD = 1e-6  # relative: sphere centers closer to one line of the scanner frame than this fix no rotation
LINEAR_SPREAD = 1e-5  # relative: below, fifteen linear unknowns say nothing about where to start
MAX_STEPS = 50
SEARCH_STEPS = 15  # from the nearest of 24 orientations, up to 63 deg away, into a valley; the fit then goes down in it
STEP_TOLERANCE = 1e-11  # rad: Gauss-Newton would make the next step about a thousand times smaller
TUKEY_CUT = 5.0  # residuals beyond this many standard deviations get the weight 0
SUBSETS = 60  # random pose subsets of the robust start: with a quarter of bad poses one of them is clean with 1 - 1e-5
SAMPLE, SAMPLE_KNOWN = 6, 4  # poses in a subset, and where the target is known


@result_class
class SphereHandEye(Result):
    """Where a scanner sits on the flange, from a sphere seen in many poses.

    Attributes
    ----------
    T_FS : array, shape (4, 4)
        The scanner in the flange (mm).
    target : array, shape (3,)
        Center of the sphere in the base (mm).
    T_BF, x_S : array, shape (N, 4, 4) and (N, 3)
        The poses, and the centers seen in them (mm).
    weights : array, shape (N,)
        1 for a pose that counts fully, 0 for a rejected one.
    history : array
        Root-mean-square distance (mm) at the start and after each step, or after each round of weights when robust.
    target_known : bool
        Whether the target was given and not estimated.
    converged : bool
        Whether the last step or round changed nothing that matters; False where they ran out.
    residuals : array, shape (N, 3)
        T_BF T_FS x_S - target in the base (mm).
    rms : float
        Root mean square of the residual distances over all poses, rejected ones included (mm).
    std : float
        Noise of one coordinate, from the weighted residuals (mm); NaN without redundancy.
    covariance : array, shape (9, 9), or (6, 6) with a known target
        std^2 (J'J)^-1 of phi (rad, in S), translation (mm, in F) and target (mm, in B).
    singular_values : array
        Of the Jacobian with phi times the root-mean-square distance of the sphere, so that every column is mm per mm;
        largest first.
    """

    T_FS: np.ndarray
    target: np.ndarray
    T_BF: np.ndarray
    x_S: np.ndarray
    weights: np.ndarray
    history: np.ndarray
    target_known: bool = False

    @property
    def parameters(self):
        return pose_parameters("T_FS") + (() if self.target_known else point_parameters("target"))

    @property
    def converged(self):
        return len(self.history) < MAX_STEPS

    @cached_property
    def residuals(self):
        return sphere_residuals(self.T_BF, self.x_S, self.T_FS, self.target)

    @property
    def rms(self):
        return float(rms_distance(self.residuals))

    @cached_property
    def std(self):
        freedom = 3 * self.weights.sum() - len(self.parameters)
        return math.sqrt(self.weights @ (self.residuals**2).sum(1) / freedom) if freedom > 0 else math.nan

    @cached_property
    def _decomposition(self):
        """Singular values of the scaled Jacobian, and half with (J'J)^-1 = half half'."""
        J = joint_jacobian(self.T_BF, self.x_S, self.T_FS, target_free=not self.target_known)
        reach = math.sqrt(self.weights @ (self.x_S**2).sum(1) / self.weights.sum())
        scale = np.array([1 / reach] * 3 + [1.0] * (J.shape[1] - 3))
        _, values, Vt = np.linalg.svd(J * np.sqrt(np.repeat(self.weights, 3))[:, None] * scale, full_matrices=False)
        return values, scale[:, None] * Vt.T / values

    @cached_property
    def covariance(self):
        half = self._decomposition[1]
        return self.std**2 * half @ half.T

    @property
    def singular_values(self):
        return self._decomposition[0]


@result_class
class SphereRadius(SphereHandEye):
    """A `SphereHandEye` whose sphere radius was estimated along, the last of its parameters.

    radius: float (mm). x_S holds the centers that follow from it.
    """

    radius: float = math.nan

    parameters = (*pose_parameters("T_FS"), *point_parameters("target"), Parameter("radius", "mm"))

    @cached_property
    def _decomposition(self):
        J = radius_jacobian(self.T_BF, self.x_S, self.T_FS, self.radius)
        scale = 1 / np.linalg.norm(J, axis=0)
        _, values, Vt = np.linalg.svd(J * scale, full_matrices=False)
        return values, scale[:, None] * Vt.T / values


@dataclass(frozen=True, eq=False)
class PoseIterates:
    """What plain Gauss-Newton did.

    Attributes
    ----------
    poses : array, shape (k + 1, 4, 4)
        T_FS at the start and after each step.
    rms : array, shape (k + 1,)
        Root-mean-square distance there (mm).
    singular_values : array, shape (k + 1, 6 or 9)
        Of the Jacobian at each iterate (angles times the mean distance of the sphere, all mm per mm), largest first.
    converged : bool
    """

    poses: np.ndarray
    rms: np.ndarray
    singular_values: np.ndarray
    converged: bool


def rms_distance(residuals):
    """Root of the mean squared length of residual vectors; per axis it is sqrt(3) smaller.

    Parameters
    ----------
    residuals : array-like, shape (..., N, 3)

    Returns
    -------
    rms : float or array, shape (...)
        In the unit of the residuals.
    """
    residuals = as_finite(residuals, "residuals")
    if residuals.ndim < 2 or not residuals.shape[-2]:
        raise ValueError(f"residuals must have shape (..., N, 3) with N >= 1, got {residuals.shape}")
    return np.sqrt((residuals**2).sum(-1).mean(-1))


# --- model -----------------------------------------------------------------------------------------------------------


def sphere_in_scanner(T_BF, T_FS, target):
    """The sphere's center as the scanner sees it in each pose: target, mapped from B to F and on to S.

    Parameters
    ----------
    T_BF : array-like, shape (..., N, 4, 4)
    T_FS : array-like, shape (4, 4)
    target : array-like, shape (3,), mm

    Returns
    -------
    x_S : array, shape (..., N, 3), mm

    Source: thesis, formula (4-1), solved for x_S.
    """
    return transform(invert(T_FS), transform(invert(T_BF), target))


def sphere_residuals(T_BF, x_S, T_FS, target):
    """Residual vectors T_BF T_FS x_S - target.

    Parameters
    ----------
    T_BF : array-like, shape (..., N, 4, 4)
    x_S : array-like, shape (..., N, 3), mm
    T_FS : array-like, shape (4, 4)
    target : array-like, shape (3,), mm

    Returns
    -------
    residuals : array, shape (..., N, 3), mm
        In B.

    Source: thesis, formula (4-3).
    """
    centers, target = transform(T_BF, transform(T_FS, x_S)), as_points(target, "target")
    fit_together(T_BF=centers.shape, target=target.shape)
    return centers - target


def kuka_residuals(p2, T_BF, x_S, target):
    """The same for T_FS given as a KUKA pose, stacked.

    Parameters
    ----------
    p2 : array-like, shape (6,)
        x, y, z (mm), A, B, C (rad).

    Returns
    -------
    residuals : array, shape (3 N,), mm

    See Also
    --------
    sphere_residuals
    """
    return sphere_residuals(T_BF, x_S, matrix_from_kuka(p2), target).ravel()


def kuka_jacobian(p2, T_BF, x_S):
    """Analytic derivative of `kuka_residuals` by x, y, z, A, B, C.

    Parameters
    ----------
    p2 : array-like, shape (6,)
        The scanner in the flange (mm, rad).
    T_BF : array-like, shape (N, 4, 4)
    x_S : array-like, shape (N, 3), mm

    Returns
    -------
    J : array, shape (3 N, 6)
        mm per mm and mm per rad.
    """
    T_BF, x_S = as_sightings(T_BF, x_S)
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
    tilts the frame about the missing direction.

    Parameters
    ----------
    A, B : float, rad

    Returns
    -------
    E : array, shape (3, 3)

    Source: what thesis table 7-3 stumbles over without naming it.
    """
    A, B = as_number(A, "A"), as_number(B, "B")
    ca, sa, cb, sb = np.cos(A), np.sin(A), np.cos(B), np.sin(B)
    return np.array([[0.0, -sa, ca * cb], [0.0, ca, sa * cb], [1.0, 0.0, -sb]])


@documented
def joint_jacobian(T_BF, x_S, T_FS, target_free=True):
    """Derivative of the residuals by phi (in S), translation (in F) and target (in B).

    Parameters
    ----------
    T_BF : array-like, shape (N, 4, 4)
    x_S : array-like, shape (N, 3), mm
    T_FS : array-like, shape (4, 4)
    target_free : bool
        Whether the target is estimated, too.

    Returns
    -------
    J : array, shape (3 N, 9), or (3 N, 6) without the target
        mm per rad and mm per mm.
    """
    (T_BF, x_S), T_FS = as_sightings(T_BF, x_S), as_shape(as_transforms(T_FS, "T_FS"), "T_FS", 4, 4)
    R = T_BF[:, :3, :3]
    J = np.empty((len(R), 3, 9 if target_free else 6))
    J[..., :3] = -R @ (T_FS[:3, :3] @ skew(x_S))
    J[..., 3:6] = R
    if target_free:
        J[..., 6:] = -np.eye(3)
    return J.reshape(3 * len(R), -1)


def radius_jacobian(T_BF, x_S, T_FS, radius):
    """`joint_jacobian` with the sphere's radius as a tenth column: y = +-sqrt(R^2 - r^2) has dy/dR = R / y.

    Parameters
    ----------
    T_BF : array-like, shape (N, 4, 4)
    x_S : array-like, shape (N, 3), mm
    T_FS : array-like, shape (4, 4)
    radius : float, mm

    Returns
    -------
    J : array, shape (3 N, 10)

    Raises
    ------
    ValueError
        A center in the scan plane, y = 0.
    """
    (T_BF, x_S), T_FS = as_sightings(T_BF, x_S), as_shape(as_transforms(T_FS, "T_FS"), "T_FS", 4, 4)
    if not x_S[:, 1].all():
        raise ValueError("x_S must hold no center in the scan plane: y = 0 does not change with the radius alone")
    by_R = np.zeros_like(x_S)
    by_R[:, 1] = as_number(radius, "radius") / x_S[:, 1]
    turned = T_BF[:, :3, :3] @ (T_FS[:3, :3] @ by_R[..., None])
    return np.concatenate([joint_jacobian(T_BF, x_S, T_FS), turned.reshape(-1, 1)], axis=1)


def plate_jacobian(T_BF, x_S, p2, p3, x_P):
    """Derivative of the residuals by both KUKA poses of the thesis's second step, T_FS and T_BP.

    p3 enters through the one point T_BP x_P only, so three of its six columns depend on the others whatever the poses:
    the sphere center is observable, the plate's orientation is not.

    Parameters
    ----------
    p2, p3 : array-like, shape (6,)
        T_FS and T_BP as x, y, z (mm), A, B, C (rad).
    x_P : array-like, shape (3,), mm
        The sphere in the plate.

    Returns
    -------
    J : array, shape (3 N, 12)

    Source: thesis, table 4-2, step 2.
    """
    p3, x_P = as_shape(p3, "p3", 6), as_shape(x_P, "x_P", 3)
    arm = matrix_from_kuka(p3)[:3, :3] @ x_P
    one = -np.concatenate([np.eye(3), -skew(arm) @ rate_matrix(*p3[3:5])], axis=1)
    return np.concatenate([kuka_jacobian(p2, T_BF, x_S), np.tile(one, (len(x_S), 1))], axis=1)


# --- calibration -----------------------------------------------------------------------------------------------------


@documented
def calibrate_sphere_target(T_BF, x_S, target=None, robust=False, rng=None):
    """Pose of a scanner on the flange, and the sphere's center, from the center seen in N robot poses, without a start.

    Minimizes the sum of squared residual vectors: the maximum-likelihood estimate for equal, isotropic errors. With a
    known target this is the fit of two point sets; otherwise a linear start and Gauss-Newton steps on the pose.

    Parameters
    ----------
    T_BF : array-like, shape (N, 4, 4)
        Robot poses, base <- flange. N >= 4, turned about at least two axes; N >= 3 and no turning needed when `target`
        is given; N >= 7, or 5 with a target, when robust.
    x_S : array-like, shape (N, 3)
        Sphere centers in the scanner frame (mm).
    target : array-like, shape (3,), optional
        Sphere center in the base (mm), if it is known; its error then goes into the result undiminished.
    robust : bool
        Least trimmed squares over random subsets, then Tukey weights on each pose's residual length; tolerates a third
        of bad poses.
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

    See Also
    --------
    labkit.fast.hand_eye.calibrate_sphere_target : the same from sums over the poses.
    """
    return calibrate_with(_least_squares, T_BF, x_S, target, robust, rng)


@documented
def calibrate_with(fit, T_BF, x_S, target, robust, rng):
    """What `calibrate_sphere_target` does around its fit: input, outliers, result.

    Parameters
    ----------
    fit : function
        fit(T_BF, x_S, weights, target, max_steps, start=None) returns T_FS, target and the rms distance (mm) of its
        iterates; `start` is an orientation that lies near.
    T_BF, x_S, target, rng
        As in `calibrate_sphere_target`.
    robust : bool

    Returns
    -------
    SphereHandEye

    Raises
    ------
    ValueError
        As `calibrate_sphere_target`.
    """
    as_truth(robust, "robust")
    (T_BF, x_S), sample = as_sightings(T_BF, x_S), SAMPLE if target is None else SAMPLE_KNOWN
    fewest = sample + 1 if robust else 4 if target is None else 3
    if len(T_BF) < fewest:
        raise ValueError(f"at least {fewest} poses are needed{' when robust' if robust else ''}, got {len(T_BF)}")
    known = None if target is None else as_shape(target, "target", 3)
    T_BF, x_S, weights = T_BF.copy(), x_S.copy(), np.ones(len(T_BF))
    if robust:
        weights = _trimmed_start(fit, T_BF, x_S, known, sample, as_optional_generator(rng))
        T_FS, center, weights, history = _reweighted(fit, T_BF, x_S, known, weights)
    else:
        T_FS, center, history = fit(T_BF, x_S, weights, known, MAX_STEPS)
    return SphereHandEye(T_FS, center, T_BF, x_S, weights, np.array(history), target is not None)


def as_sightings(T_BF, x_S):
    """Robot poses (N, 4, 4) with the sphere center (N, 3) seen in each; anything else is refused."""
    T_BF, x_S = as_transforms(T_BF, "T_BF"), as_points(x_S, "x_S")
    if T_BF.ndim != 3 or x_S.shape != (len(T_BF), 3):
        raise ValueError(f"T_BF and x_S must have shapes (N, 4, 4) and (N, 3), got {T_BF.shape} and {x_S.shape}")
    return T_BF, x_S


@documented
def refuse_undetermined(T_BF, x_S, weights, target_known):
    """Refuses poses that leave scanner or sphere free, naming the missing motion.

    Parameters
    ----------
    T_BF, x_S, weights : arrays, shapes (N, 4, 4), (N, 3), (N,)
    target_known : bool
    """
    unchecked(refuse_one_line)(x_S, weights)
    if not target_known:
        unchecked(refuse_one_axis)(T_BF[:, :3, :3], weights, "base", "scanner and sphere")


@documented
def refuse_one_line(x_S, weights):
    """Refuses sphere centers on one line of the scanner frame: nothing then fixes the rotation about it.

    Parameters
    ----------
    x_S, weights : arrays, shapes (N, 3) and (N,)
    """
    if len(x_S) < 2:
        raise ValueError(f"at least 2 sphere centers are needed, got {len(x_S)}")
    as_row_weights(weights)
    mean = weights @ x_S / weights.sum()
    spread = np.linalg.svd((x_S - mean) * np.sqrt(weights)[:, None], compute_uv=False)
    far = math.sqrt(weights.sum()) * np.linalg.norm(mean)
    if spread[1] <= max(MIN_SPREAD * max(spread[0], MIN_SPREAD * far), SMALLEST_POSITIVE):
        where = "at one place" if spread[0] <= max(MIN_SPREAD * far, SMALLEST_POSITIVE) else "on one line"
        raise ValueError(
            f"the sphere stays {where} of the scanner frame, so the scanner's rotation about it is free; change its "
            "depth and its place along the scan line between the poses"
        )


def _least_squares(T_BF, x_S, weights, target, max_steps, start=None):
    """T_FS and target that minimize the weighted sum of squares, and the rms distance of the iterates; `start` is an
    orientation known to lie near, of a like problem.
    """
    unchecked(refuse_undetermined)(T_BF, x_S, weights, target is not None)
    if target is not None:
        T_FS = _fit_frame(x_S, transform(invert(T_BF), target), weights)
        return T_FS, target, [rms_distance(sphere_residuals(T_BF, x_S, T_FS, target))]
    if start is None:
        u, spread = _linear_solution(T_BF, x_S, weights)
        linear = spread > LINEAR_SPREAD
        start = nearest_rotation(u[:9].reshape(3, 3)) if linear else _searched_start(T_BF, x_S, weights)
    return _gauss_newton(start, T_BF, x_S, weights, max_steps)


def _searched_start(T_BF, x_S, weights):
    """Of the 24 right-angled orientations, all of them led downhill at once (Levenberg-Marquardt), the lowest."""
    A, b = _without_shift(T_BF, x_S, weights)
    R, turns = right_angled(), skew(np.eye(3))
    damping, r = np.full((len(R), 1, 1), 1e-3), R.reshape(-1, 9) @ A.T + b
    for _ in range(SEARCH_STEPS):
        J = (R[:, None] @ turns).reshape(-1, 3, 9) @ A.T
        H = J @ J.swapaxes(1, 2)
        H += (damping * H.trace(axis1=1, axis2=2)[:, None, None] + np.finfo(float).tiny) * np.eye(3)
        trial = R @ exp_so3(-np.linalg.solve(H, J @ r[..., None])[..., 0])
        missed = trial.reshape(-1, 9) @ A.T + b
        lower = ((missed**2).sum(1) < (r**2).sum(1))[:, None]
        r, R = np.where(lower, missed, r), np.where(lower[..., None], trial, R)
        damping *= np.where(lower[..., None], 0.2, 5.0)
    return R[(r**2).sum(1).argmin()]


def _without_shift(T_BF, x_S, weights):
    """A (10, 9) and b (10,): A R_FS.ravel() + b is as long as all weighted residuals with the best translation and
    target, which enter linearly.
    """
    root = np.sqrt(np.repeat(weights, 3))[:, None]
    shift = np.concatenate([T_BF[:, :3, :3], np.broadcast_to(-np.eye(3), (len(T_BF), 3, 3))], axis=2).reshape(-1, 6)
    turned = (T_BF[:, :3, :3, None] * x_S[:, None, None]).reshape(-1, 9)
    left = np.column_stack([turned, T_BF[:, :3, 3].ravel()]) * root
    Q = np.linalg.qr(shift * root)[0]
    left = np.linalg.qr(left - Q @ (Q.T @ left), mode="r")
    return left[:, :9], left[:, 9]


def _fit_frame(x_S, x_F, weights):
    """The transform that takes weighted points from S to F with the least sum of squares (Kabsch)."""
    mean_S, mean_F = weights @ x_S / weights.sum(), weights @ x_F / weights.sum()
    R_FS = nearest_rotation((weights[:, None] * (x_F - mean_F)).T @ (x_S - mean_S))
    return pose(R_FS, mean_F - R_FS @ mean_S)


def _gauss_newton(R_FS, T_BF, x_S, weights, max_steps):
    """Gauss-Newton from an orientation, steps cut until they descend: T_FS, target, rms distance of the iterates.

    A step that ends higher is cut to the lowest point of the parabola through its ends with its slope at the start, at
    most to a tenth.
    """
    root, R_BF, t_BF = np.sqrt(np.repeat(weights, 3)), T_BF[:, :3, :3], T_BF[:, :3, 3]
    turned_S = skew(x_S)
    J = np.empty((len(T_BF), 3, 9))
    J[..., 3:6], J[..., 6:] = R_BF, -np.eye(3)

    # `sphere_residuals`, `joint_jacobian` and `moved`, whose checks would take most of the time
    def at(T_FS, target):
        seen = R_BF @ (x_S @ T_FS[:3, :3].T + T_FS[:3, 3])[..., None]
        r = (seen[..., 0] + t_BF - target).ravel() * root
        return T_FS, target, r, r @ r

    def jacobian(T_FS):
        J[..., :3] = -R_BF @ (T_FS[:3, :3] @ turned_S)
        return J.reshape(-1, 9) * root[:, None]

    def after(T_FS, target, step):
        moved = T_FS.copy()
        moved[:3, :3], moved[:3, 3] = T_FS[:3, :3] @ exp_so3(step[:3]), T_FS[:3, 3] + step[3:6]
        return at(moved, target + step[6:])

    shift = _best_shift(R_FS, T_BF, x_S, root)
    (T_FS, target, r, cost), costs = at(pose(R_FS, shift[:3]), shift[3:]), []
    for _ in range(max_steps):
        costs.append(cost)
        weighted = jacobian(T_FS)
        step = np.linalg.lstsq(weighted, -r, rcond=None)[0]
        slope, trial = r @ weighted @ step, after(T_FS, target, step)
        while trial[3] > cost and np.abs(step[:3]).max() > STEP_TOLERANCE:
            share = max(0.1, slope / (2 * slope - (trial[3] - cost)))
            step, slope = share * step, share * slope
            trial = after(T_FS, target, step)
        T_FS, target, r, cost = trial
        if np.abs(step[:3]).max() <= STEP_TOLERANCE:
            break
    return T_FS, target, np.sqrt(np.array([*costs, cost]) / weights.sum())


def _best_shift(R_FS, T_BF, x_S, root):
    """Translation and target, (6,), that fit best with the orientation R_FS: they enter linearly."""
    T_FS = pose(R_FS, np.zeros(3))
    J = joint_jacobian(T_BF, x_S, T_FS)[:, 3:] * root[:, None]
    return np.linalg.lstsq(J, -sphere_residuals(T_BF, x_S, T_FS, np.zeros(3)).ravel() * root, rcond=None)[0]


def right_angled():
    """The 24 rotations that map axes to axes, shape (24, 3, 3)."""
    signs = np.stack(np.meshgrid([1, -1], [1, -1], [1, -1]), -1).reshape(-1, 1, 3)
    axes = np.eye(3)[[[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]]]
    found = (signs[:, None] * axes).reshape(-1, 3, 3)
    return found[np.linalg.det(found) > 0]


def linear_start(T_BF, x_S):
    """T_FS and target from the linear equations in 15 unknowns (R_FS, t_FS, target), R_FS then made a rotation.

    R_FS x_S + t_FS - R_BF' target = -R_BF' t_BF: three equations per pose, linear because nothing says yet that R_FS is
    a rotation. Needs five poses or more and sphere centers that do not lie in one plane of the scanner frame.

    Parameters
    ----------
    T_BF : array-like, shape (N, 4, 4)
    x_S : array-like, shape (N, 3), mm

    Returns
    -------
    T_FS : array, shape (4, 4)
    target : array, shape (3,), mm

    Raises
    ------
    ValueError
        When the system has not rank 15.
    """
    T_BF, x_S = as_sightings(T_BF, x_S)
    u, spread = _linear_solution(T_BF, x_S, np.ones(len(T_BF)))
    if spread < 1e-12:
        raise ValueError(
            "the linear system needs rank 15, got less: take five poses or more, turned about two axes, "
            "with the sphere at different depths and places of the scanner's field"
        )
    return pose(nearest_rotation(u[:9].reshape(3, 3)), u[9:12]), u[12:]


def _linear_solution(T_BF, x_S, weights):
    """The 15 unknowns, and the smallest singular value of their system over the largest, centers scaled to length 1."""
    R_t, n = np.swapaxes(T_BF[:, :3, :3], 1, 2), len(T_BF)
    reach = max(rms_distance(x_S), np.finfo(float).tiny)
    D = np.zeros((n, 3, 15))
    for k in range(3):
        D[:, k, 3 * k : 3 * k + 3] = x_S / reach
    D[..., 9:12], D[..., 12:] = np.eye(3), -R_t
    F, root = -(R_t @ T_BF[:, :3, 3, None])[..., 0], np.sqrt(np.repeat(weights, 3))
    u, _, _, values = np.linalg.lstsq(D.reshape(-1, 15) * root[:, None], F.ravel() * root, rcond=None)
    u[:9] /= reach
    return u, values[14] / values[0] if 3 * n >= 15 else 0.0


@documented
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
    PoseIterates

    Raises
    ------
    ValueError
        An unknown parametrization, or no sphere center away from the scanner's origin.

    Source: thesis, listings C3 to C5; `labkit.documents.thesis.listings` has them as printed.
    """
    (T_BF, x_S), p = as_sightings(T_BF, x_S), as_shape(start, "start", 6)
    max_steps, tolerance = as_count(max_steps, "max_steps", at_least=0), as_number(tolerance, "tolerance")
    T_FS, free = matrix_from_kuka(p), target is None
    center = transform(T_BF, transform(T_FS, x_S)).mean(0) if free else as_shape(target, "target", 3)
    reach = rms_distance(x_S)
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
    return PoseIterates(np.array(poses), np.array(rms), np.array(values), converged)


def leave_one_out(T_BF, x_S, robust=False, groups=None):
    """Residual vector of each pose under the calibration from the others: what it is worth elsewhere.

    Poses of one line of motion are alike, and vouch for each other; with `groups` the whole line is left out at once.

    Parameters
    ----------
    T_BF : array-like, shape (N, 4, 4)
    x_S : array-like, shape (N, 3), mm
    robust : bool
        As in `calibrate_sphere_target`.
    groups : sequence of N names, optional
        Which poses go together, such as the names of their lines; None leaves out one pose at a time.

    Returns
    -------
    residuals : array, shape (N, 3), mm

    Raises
    ------
    ValueError
        When `groups` does not name a group for each pose.
    """
    T_BF, x_S = as_sightings(T_BF, x_S)
    groups = list(range(len(T_BF))) if groups is None else as_names(groups, "groups")
    if len(groups) != len(T_BF):
        raise ValueError(f"groups must name one group a pose, {len(T_BF)} of them, got {len(groups)}")
    found = np.empty_like(x_S)
    number = {group: k for k, group in enumerate(dict.fromkeys(groups))}
    numbers = np.array([number[group] for group in groups])
    for k in range(len(number)):
        out = numbers == k
        fit = calibrate_sphere_target(T_BF[~out], x_S[~out], robust=robust)
        found[out] = sphere_residuals(T_BF[out], x_S[out], fit.T_FS, fit.target)
    return found


def fit_radius(T_BF, x_S, printed_radius=30.0):
    """Sphere radius that the poses themselves ask for, all else free as well.

    Each center was computed from a fitted circle as y = +-sqrt(R^2 - r^2) with R = `printed_radius`; another R moves it
    along y only, y' = +-sqrt(y^2 + R^2 - printed_radius^2). Residuals linear in y make this a tenth column of the
    Jacobian; Gauss-Newton steps on R, all else solved exactly in between.

    Parameters
    ----------
    T_BF : array-like, shape (N, 4, 4)
    x_S : array-like, shape (N, 3), mm
        Centers off the scan plane, y not 0; N >= 4.
    printed_radius : float
        The radius that the centers were computed with (mm).

    Returns
    -------
    SphereRadius

    Raises
    ------
    ValueError
        When a center lies on the scan plane, or the steps do not settle on a radius.

    Source: beyond the thesis, which uses three different radii (certificate, listing C16, coordinate machine).
    """
    (T_BF, x_S), radius = as_sightings(T_BF, x_S), as_positive_number(printed_radius, "printed_radius")
    if len(x_S) < 4:
        raise ValueError(f"at least 4 poses are needed, got {len(x_S)}")
    side, square = np.sign(x_S[:, 1]), x_S[:, 1] ** 2 - radius**2
    if not side.all():
        raise ValueError("x_S must lie off the scan plane: with y = 0 nothing says on which side the center is")
    history = []
    for _ in range(MAX_STEPS):
        x = x_S.copy()
        x[:, 1] = side * np.sqrt(np.maximum(square + radius**2, 1e-12))
        fit = calibrate_sphere_target(T_BF, x)
        history.append(fit.rms)
        J = radius_jacobian(T_BF, x, fit.T_FS, radius)
        step = np.linalg.lstsq(J, -fit.residuals.ravel(), rcond=None)[0][9]
        if abs(step) < 1e-9 and (square + radius**2 > 1e-12).all():
            return SphereRadius(fit.T_FS, fit.target, fit.T_BF, x, fit.weights, np.array(history), radius=radius)
        radius += step
    raise ValueError(
        f"the radius does not settle: after {MAX_STEPS} steps it is {shown(radius, '.6g')} mm and the last step was "
        f"{shown(step, '.2g')} mm; are these centers those of circles on one sphere?"
    )


# --- outliers --------------------------------------------------------------------------------------------------------


def _trimmed_start(fit, T_BF, x_S, target, size, rng):
    """Weights 0 or 1 of the half of the poses that agree best: random subsets, the best five of them concentrated."""
    n = len(T_BF)
    half = min(n, (n + size) // 2 + 1)

    def concentrate(chosen):
        try:
            T_FS, center, _ = fit(T_BF[chosen], x_S[chosen], np.ones(len(chosen)), target, 4)
        except (ValueError, np.linalg.LinAlgError):
            return np.inf, None  # a subset without the motions the whole set has
        squares = (sphere_residuals(T_BF, x_S, T_FS, center) ** 2).sum(1)
        nearest = np.argsort(squares, kind="stable")[:half]
        return squares[nearest].sum(), nearest

    found = [concentrate(rng.choice(n, size, replace=False)) for _ in range(SUBSETS)]
    found = sorted((f for f in found if f[1] is not None), key=lambda f: f[0])[:5]
    for _ in range(3):
        found = [concentrate(nearest) for _, nearest in found]
    weights = np.zeros(n)
    weights[min(found, key=lambda f: f[0])[1] if found else slice(None)] = 1.0
    return weights


def _reweighted(fit, T_BF, x_S, target, weights):
    """Iteratively reweighted least squares from the trimmed start; the scale is the median residual length."""
    history, exact, start = [], 1e-12 * np.abs(x_S).max(), None
    for _ in range(MAX_STEPS):
        T_FS, center, _ = fit(T_BF, x_S, weights, target, MAX_STEPS, start)
        start = T_FS[:3, :3]
        lengths = np.linalg.norm(sphere_residuals(T_BF, x_S, T_FS, center), axis=1)
        history.append(math.sqrt((lengths**2).mean()))
        scale = median_std(lengths)
        noise_free = scale <= exact  # then what does not fit exactly is wrong
        new = (lengths <= 1000 * exact).astype(float) if noise_free else tukey_weights(lengths, scale, TUKEY_CUT)
        if np.abs(new - weights).max() < 1e-8:
            break
        weights = new
    return T_FS, center, weights, history
