"""A X = X B: where a sensor sits on a flange, from motions alone.

`T_BF` is the flange F in the robot's base B, `T_ST` the target T as the sensor S sees it. Either the sensor rides on
the flange and the target stands still (eye in hand), or the other way round (eye to hand):

    T_BF T_FS T_ST = T_BT    eye in hand: unknown T_FS and T_BT
    T_BF T_FT = T_BS T_ST    eye to hand: unknown T_FT and T_BS, the same loop with T_BF inverted

Lengths mm, angles rad. `solve_ax_xb` is the method of the report (ZCU Plzen 2018, section 3.1, equations 4 to 16),
rotation first, then translation. `calibrate_hand_eye` is the maximum-likelihood estimate for noise on the sensor's
readings; `labkit.fast.ax_xb` finds it from sums over the poses.
"""

from functools import cached_property

import numpy as np

from ..checks import as_choice, as_number, as_positive_number, as_rotations, as_shape, as_transforms, as_truth, shown
from ..documented import documented, unchecked
from ..geometry.frames import invert, moved, pose, rotation_block
from ..geometry.lie import log_so3, nearest_rotation, skew
from .motion import refuse_one_axis
from .result import Result, pose_parameters, result_class
from .robust import median_std

RELATIVE_RANK = 1e-6  # second smallest singular value of the Kronecker matrix per motion: below, the axes are parallel
MIN_ANGLE_STD, MIN_LENGTH_STD = 1e-9, 1e-9  # rad, and relative to the lengths: noise-free data must not divide by zero
MAX_STEPS = 30
STEP_TOLERANCE = 1e-8  # rad; the step is taken before it is judged, and the next would be a thousand times smaller
TUKEY, LOOSE_ROUNDS = 5.2, 12  # cut-off in robust standard deviations of the 6-vector; rounds before it is applied


class HandEye(Result):
    """Base of `EyeInHand` and `EyeToHand`, with the loop of both: robot @ sensor @ T_ST = target.

    Attributes
    ----------
    T_BF, T_ST : array, shape (N, 4, 4)
        Poses of the flange, and the target as the sensor saw it there (mm).
    weights : array, shape (N,)
        1 for a reading that counts fully, 0 for a rejected one.
    given : tuple
        (std_rot, std_trans) as given, None for what was estimated.
    history : array, shape (steps, 3)
        std_rot (rad), std_trans (mm) and the size of the step (rad) in each iteration.
    converged : bool
        Whether the last step was too small to matter; False where the steps ran out.
    residuals : array, shape (N, 6)
        Rotation vector (rad, in T) and translation (mm, in S) of the reading against the prediction.
    std : array, shape (6,)
        Noise of each column of the residuals (rad, mm), as given or as estimated.
    covariance : array, shape (12, 12)
        Of the sensor's pose (rotation vector about the axes of S, then translation) and of the target's (axes of T).
    singular_values : array, shape (12,)
        Of the whitened Jacobian with its columns scaled to length 1, largest first; the last one tells how close the
        data are to leaving something undetermined.
    """

    @cached_property
    def _loop(self):
        """(robot, sensor, target) with robot @ sensor @ T_ST = target."""
        return self.T_BF, self.T_FS, self.T_BT

    @property
    def converged(self):
        return bool(self.history[-1, 2] < STEP_TOLERANCE)

    @cached_property
    def residuals(self):
        robot, sensor, target = self._loop
        predicted = invert(robot @ sensor) @ target
        turn = log_so3(np.swapaxes(predicted[:, :3, :3], 1, 2) @ self.T_ST[:, :3, :3])
        return np.concatenate([turn, self.T_ST[:, :3, 3] - predicted[:, :3, 3]], axis=1)

    @cached_property
    def _information(self):
        """Normal matrices of the twelve unknowns for noise of size 1, rotations and translations apart."""
        root = np.sqrt(np.repeat(self.weights, 3))[:, None]
        by_turns, by_gaps = (root * J for J in unchecked(loop_jacobians)(*self._loop, self.T_ST))
        return by_turns.T @ by_turns, by_gaps.T @ by_gaps

    @cached_property
    def std(self):
        """Each noise level that is estimated pays for the share of the unknowns that it determines."""
        N_rot, N_trans = self._information
        squares = self.weights @ self.residuals**2
        observations, share = 3 * self.weights.sum(), 6.0
        for _ in range(2 if None in self.given else 1):
            freedom = observations - 12 + share, observations - share
            std_rot, std_trans = noise_levels(squares[:3].sum(), squares[3:].sum(), freedom, self.given, _size(self))
            N = N_rot / std_rot**2 + N_trans / std_trans**2
            share = np.trace(_inverse(N) @ N_trans) / std_trans**2
        return np.repeat([std_rot, std_trans], 3)

    @property
    def _normal_matrix(self):
        N_rot, N_trans = self._information
        return N_rot / self.std[0] ** 2 + N_trans / self.std[3] ** 2

    @cached_property
    def covariance(self):
        return _inverse(self._normal_matrix)

    @cached_property
    def singular_values(self):
        N = self._normal_matrix
        scale = 1 / np.sqrt(np.diagonal(N))
        return np.sqrt(np.maximum(np.linalg.eigvalsh(N * scale[:, None] * scale)[::-1], 0.0))


@result_class
class EyeInHand(HandEye):
    """The sensor on the flange, T_FS, and the target in the base, T_BT; the figures of `HandEye`."""

    T_FS: np.ndarray
    T_BT: np.ndarray
    T_BF: np.ndarray
    T_ST: np.ndarray
    weights: np.ndarray
    given: tuple
    history: np.ndarray

    parameters = pose_parameters("T_FS") + pose_parameters("T_BT")


@result_class
class EyeToHand(HandEye):
    """The sensor in the base, T_BS, and the target on the flange, T_FT; the figures of `HandEye`."""

    T_BS: np.ndarray
    T_FT: np.ndarray
    T_BF: np.ndarray
    T_ST: np.ndarray
    weights: np.ndarray
    given: tuple
    history: np.ndarray

    parameters = pose_parameters("T_BS") + pose_parameters("T_FT")

    @cached_property
    def _loop(self):
        return invert(self.T_BF), self.T_BS, self.T_FT


ROLES = {"in hand": EyeInHand, "to hand": EyeToHand}


# --- the report's method ---------------------------------------------------------------------------------------------


@documented
def kronecker_matrix(A, B):
    """The linear system of the rotation, M vec(X) = 0, vec stacking **columns**; equations (7) to (9).

    Parameters
    ----------
    A, B : array, shape (N, 3, 3) or (N, 4, 4)
        Motions of the flange and of the sensor, A_i X = X B_i. The report writes X A = B X: its letters are exchanged.

    Returns
    -------
    M : array, shape (9 N, 9)
        Blocks I kron A_i - B_i' kron I.

    Raises
    ------
    ValueError
        Motions of different number.
    """
    A, B = rotation_block(A, "A"), rotation_block(B, "B")
    if A.ndim != 3 or A.shape != B.shape:
        raise ValueError(f"A and B must be as many motions, (N, 3, 3) or (N, 4, 4), got {A.shape} and {B.shape}")
    left = np.einsum("jl,nik->njilk", np.eye(3), A)
    right = np.einsum("nlj,ik->njilk", B, np.eye(3))
    return (left - right).reshape(-1, 9)


def rotation_from_kronecker(M):
    """Rotation of the null vector of M: smallest singular vector, sign by det > 0, projected to SO(3); equations (10)
    to (12).

    Returns
    -------
    R : array, shape (3, 3)
    singular_values : array, shape (9,), largest first
        The last one is 0 for exact data. When the last but one is as small, the rotation axes are parallel and R is
        arbitrary.
    """
    M = as_shape(M, "M", "m", 9)
    _, values, Vt = np.linalg.svd(M.T @ M)
    X = Vt[-1].reshape(3, 3, order="F")
    return nearest_rotation(X if np.linalg.det(X) > 0 else -X), np.sqrt(values)


def translation_from_motions(A, B, R):
    """Translation by least squares from (R_A - I) t = R t_B - t_A.

    Parameters
    ----------
    A, B : array-like, shape (N, 4, 4)
        Motions of flange and sensor.
    R : array-like, shape (3, 3)
        Rotation of the sensor on the flange.

    Returns
    -------
    t : array, shape (3,), mm
    residuals : array, shape (N, 3), mm
        K1 t - K2 of the report, in F.

    Raises
    ------
    ValueError
        Motions of different number.

    Source: report, equations (14) to (16).
    """
    A, B, R = as_transforms(A, "A"), as_transforms(B, "B"), as_shape(as_rotations(R, "R"), "R", 3, 3)
    if A.ndim != 3 or A.shape != B.shape:
        raise ValueError(f"A and B must both have shape (N, 4, 4), got {A.shape} and {B.shape}")
    K1 = np.eye(3) - A[:, :3, :3]
    K2 = A[:, :3, 3] - B[:, :3, 3] @ R.T
    t = np.linalg.lstsq(K1.reshape(-1, 3), K2.ravel(), rcond=None)[0]
    return t, K1 @ t - K2


def solve_ax_xb(A, B):
    """Mounting from motion pairs by the report's method: Kronecker product for the rotation, then least squares.

    Parameters
    ----------
    A : array-like, shape (N, 4, 4)
        Motions of the flange, T_F1F2. The report calls them B (its equation 6).
    B : array-like, shape (N, 4, 4)
        The same motions as the sensor saw itself move, T_S1S2; the report's A. N >= 2 with rotation axes that are not
        parallel.

    Returns
    -------
    T_FS : array, shape (4, 4)
        With A T_FS = T_FS B.

    Raises
    ------
    ValueError
        When the two stacks differ, fewer than two motions come, or all rotation axes are parallel (or no motion turns).

    Source: report, section 3.1, equations (4) to (16).
    """
    A, B = as_transforms(A, "A"), as_transforms(B, "B")
    if A.ndim != 3 or A.shape != B.shape or len(A) < 2:
        raise ValueError(f"A and B must both have shape (N, 4, 4) with N >= 2, got {A.shape} and {B.shape}")
    M = unchecked(kronecker_matrix)(A, B)
    R, values = rotation_from_kronecker(M)
    if values[-2] <= RELATIVE_RANK * np.sqrt(len(A)):
        raise ValueError(
            "the rotation axes of all motions are parallel or nothing turns: the second smallest singular value of the "
            f"Kronecker matrix is {shown(values[-2], '.2g')}, so one angle of the mounting stays free"
        )
    return pose(R, translation_from_motions(A, B, R)[0])


# --- maximum likelihood ----------------------------------------------------------------------------------------------


def calibrate_hand_eye(T_BF, T_ST, std_rot=None, std_trans=None, robust=False, *, eye="in hand"):
    """Maximum-likelihood poses of sensor and target when the readings carry the noise and the robot does not.

    Parameters
    ----------
    T_BF : array-like, shape (N, 4, 4)
        Poses of the flange in the base (mm). N >= 3, turned about at least two axes.
    T_ST : array-like, shape (N, 4, 4)
        Readings: the target as the sensor saw it in each (mm).
    std_rot, std_trans : float, optional
        Standard deviation of a reading per axis, rad and mm. What is not given is estimated together with the poses.
    robust : bool
        Down-weight and finally ignore readings that fit nothing (Tukey's biweight over the six normalized residuals,
        scale by the median).
    eye : {"in hand", "to hand"}
        Whether the sensor rides on the flange, or stands still and looks at a target that does.

    Returns
    -------
    EyeInHand or EyeToHand
        With T_FS and T_BT, or with T_BS and T_FT.

    Raises
    ------
    ValueError
        When the stacks differ, N < 3, or the poses do not turn about two axes.

    Source: the start solves for the rotations by one singular value decomposition (Shah 2013) and for the translations
    by least squares; beyond the report.

    See Also
    --------
    labkit.fast.ax_xb.calibrate_hand_eye : the same from sums over the poses.
    """
    return calibrate_with(_gauss_newton, T_BF, T_ST, std_rot, std_trans, robust, eye)


@documented
def calibrate_with(fit, T_BF, T_ST, std_rot, std_trans, robust, eye):
    """What `calibrate_hand_eye` does around its fit: input, outliers, result.

    Parameters
    ----------
    fit : function
        fit(robot, T_ST, weights, given) returns sensor and target of the loop robot @ sensor @ T_ST = target, and the
        history.
    T_BF, T_ST, std_rot, std_trans, eye
        As in `calibrate_hand_eye`.
    robust : bool

    Returns
    -------
    EyeInHand or EyeToHand

    Raises
    ------
    ValueError
        As `calibrate_hand_eye`.
    """
    T_BF, T_ST = as_transforms(T_BF, "T_BF"), as_transforms(T_ST, "T_ST")
    if T_BF.ndim != 3 or T_BF.shape != T_ST.shape or len(T_BF) < 3:
        raise ValueError(f"T_BF and T_ST must both have shape (N, 4, 4) with N >= 3, got {T_BF.shape} and {T_ST.shape}")
    as_choice(eye, "eye", ROLES)
    as_truth(robust, "robust")
    given = tuple(
        None if std is None else as_positive_number(std, name)
        for std, name in ((std_rot, "std_rot"), (std_trans, "std_trans"))
    )
    T_BF, T_ST, weights = T_BF.copy(), T_ST.copy(), np.ones(len(T_BF))
    robot, frame = (T_BF, "base") if eye == "in hand" else (invert(T_BF), "flange")

    def solve(weights):
        unchecked(refuse_one_axis)(robot[:, :3, :3], weights, frame, "sensor and target")
        sensor, target, history = fit(robot, T_ST, weights, given)
        return ROLES[eye](sensor, target, T_BF, T_ST, weights, given, np.array(history))

    return _reweighted(solve, solve(weights)) if robust else solve(weights)


def _reweighted(solve, result):
    """Iteratively reweighted least squares: first bounded influence (1 / distance), then Tukey's biweight."""
    floors = MIN_ANGLE_STD, MIN_LENGTH_STD * _size(result)
    for k in range(3 * LOOSE_ROUNDS):
        parts = result.residuals[:, :3], result.residuals[:, 3:]
        lengths = [np.linalg.norm(part, axis=1) for part in parts]
        d = np.hypot(*(length / max(median_std(length), floor) for length, floor in zip(lengths, floors)))
        fresh = 1 / np.maximum(d, 1.0) if k < LOOSE_ROUNDS else np.maximum(1 - (d / TUKEY) ** 2, 0.0) ** 2
        if fresh.sum() < 4:
            raise ValueError("robust: fewer than 4 readings agree with each other, so no majority can be followed")
        if k > LOOSE_ROUNDS and np.abs(fresh - result.weights).max() < 1e-6:
            break
        result = solve(fresh)
    return result


@documented
def linear_rotations(robot, T_ST, weights):
    """Rotations of sensor and target: R X A = Y for all poses is K rvec(X) = N rvec(Y), X and Y singular vectors of K.

    Parameters
    ----------
    robot, T_ST : array, shape (N, 4, 4)
        The loop is robot @ sensor @ T_ST = target.
    weights : array, shape (N,)

    Returns
    -------
    both : array, shape (2, 3, 3)

    Source: Shah (2013).
    """
    sums = np.tensordot(weights[:, None, None] * robot[:, :3, :3], T_ST[:, :3, :3], (0, 0))  # of R_ij A_kl
    K = sums.transpose(0, 3, 1, 2).reshape(9, 9)
    U, _, Vt = np.linalg.svd(K)
    both = np.stack([Vt[0], U[:, 0]]).reshape(2, 3, 3)
    return nearest_rotation(both if np.linalg.det(both[0]) > 0 else -both)


def _best_shifts(robot, T_ST, weights, Rx, Ry):
    """Sensor and target with the rotations Rx and Ry and the translations that fit best: they enter linearly."""
    sensor, target = pose(Rx, np.zeros(3)), pose(Ry, np.zeros(3))
    root = np.sqrt(np.repeat(weights, 3))
    J = unchecked(loop_jacobians)(robot, sensor, target, T_ST)[1][:, [3, 4, 5, 9, 10, 11]]
    gaps = (robot @ sensor @ T_ST)[:, :3, 3].ravel()
    t = np.linalg.lstsq(J * root[:, None], -gaps * root, rcond=None)[0]
    return pose(Rx, t[:3]), pose(Ry, t[3:])


@documented
def loop_jacobians(robot, sensor, target, T_ST):
    """Derivatives of the loop's errors by small rotations and translations of sensor and target.

    The error of the rotation is the rotation vector of target' robot sensor T_ST, that of the translation the gap
    between both sides in the base.

    Parameters
    ----------
    robot, T_ST : array, shape (N, 4, 4)
    sensor, target : array, shape (4, 4)

    Returns
    -------
    by_turns, by_gaps : array, shape (3 N, 12)
        Columns: rotation vector about the axes of S, translation of the sensor; the same of the target.
    """
    n, R, A, a = len(robot), robot[:, :3, :3], T_ST[:, :3, :3], T_ST[:, :3, 3]
    by_turns, by_gaps = np.zeros((2, n, 3, 12))
    by_turns[..., :3], by_turns[..., 6:9] = np.swapaxes(A, 1, 2), -np.eye(3)
    by_gaps[..., :3] = -R @ (sensor[:3, :3] @ skew(a))
    by_gaps[..., 3:6], by_gaps[..., 9:] = R, -np.eye(3)
    return by_turns.reshape(-1, 12), by_gaps.reshape(-1, 12)


def _gauss_newton(robot, T_ST, weights, given):
    """Gauss-Newton on both poses from the linear start, the noise levels estimated along when they are not given.

    Rotations are compared by the chordal distance, 2 sin(angle / 2), whose gradient is the skew part of the error.
    """
    sensor, target = _best_shifts(robot, T_ST, weights, *linear_rotations(robot, T_ST, weights))
    root, freedom = np.sqrt(np.repeat(weights, 3)), 3 * weights.sum() - 6
    size, history = _length(robot, T_ST), []
    for _ in range(MAX_STEPS):
        closed = robot @ sensor @ T_ST
        E, gap = target[:3, :3].T @ closed[:, :3, :3], closed[:, :3, 3] - target[:3, 3]
        turn = 0.5 * np.stack([E[:, 2, 1] - E[:, 1, 2], E[:, 0, 2] - E[:, 2, 0], E[:, 1, 0] - E[:, 0, 1]], axis=1)
        squares = weights @ (3 - np.trace(E, axis1=1, axis2=2)), weights @ (gap**2).sum(1)
        std_rot, std_trans = unchecked(noise_levels)(*squares, (freedom, freedom), given, size)
        by_turns, by_gaps = unchecked(loop_jacobians)(robot, sensor, target, T_ST)
        J = np.concatenate([by_turns * root[:, None] / std_rot, by_gaps * root[:, None] / std_trans])
        r = np.concatenate([turn.ravel() * root / std_rot, gap.ravel() * root / std_trans])
        scale = 1 / np.linalg.norm(J, axis=0)
        step = scale * np.linalg.lstsq(J * scale, -r, rcond=None)[0]
        sensor, target = moved(sensor, step[:6]), moved(target, step[6:])
        largest = np.abs(step[[0, 1, 2, 6, 7, 8]]).max()
        history.append((std_rot, std_trans, largest))
        if largest < STEP_TOLERANCE:
            break
    return sensor, target, history


@documented
def noise_levels(square_rot, square_trans, freedom, given, size):
    """Standard deviations of the readings: as given, or from sums of squares and their degrees of freedom.

    Parameters
    ----------
    square_rot, square_trans : float
        Sums of squares (rad^2, mm^2).
    freedom : array, shape (2,)
        Degrees of freedom of rotation and translation.
    given : tuple
        Standard deviations of both where they are known (rad, mm), or None.
    size : float
        Of the data (mm): noise-free data have at least its rounding.

    Returns
    -------
    std_rot, std_trans : float, rad and mm
    """
    floors = MIN_ANGLE_STD, MIN_LENGTH_STD * size
    given = [known if known is None else as_number(known, "given") for known in given]
    return tuple(
        known or max(max(square, 0.0) / max(free, 1.0), floor**2) ** 0.5
        for known, square, free, floor in zip(given, (square_rot, square_trans), freedom, floors)
    )


def _length(robot, T_ST):
    return np.abs(robot[:, :3, 3]).max() + np.abs(T_ST[:, :3, 3]).max() + 1e-300


def _size(result):
    return _length(result._loop[0], result.T_ST)


def _inverse(N):
    """Inverse of a normal matrix whose unknowns have different units."""
    scale = 1 / np.sqrt(np.diagonal(N))
    return np.linalg.inv(N * scale[:, None] * scale) * scale[:, None] * scale
