"""Quirlen: the tip of a tool and the fixed point it touches, from poses that all keep the tip on that point.

The tool frame F moves, T_WF = (R_i, p_i); the tip sits at `tip` in F and always at `pivot` in W:

    R_i tip + p_i = pivot,    stacked:  [R_i  -I] [tip; pivot] = -p_i

Plain, this is one linear least-squares problem. With known noise each three rows are whitened: orientation noise shakes
the tip across its lever. Robust, poses that miss by far lose their weight. `labkit.fast.pivot` does the plain case for
thousands of poses. Lengths in mm, angles in radians. Source: lab sheet "Kalibrierung", Hochschule Darmstadt 2016,
section 3.
"""

import math
from functools import cached_property

import numpy as np

from ..checks import (
    as_finite,
    as_generator,
    as_nonnegative,
    as_number,
    as_optional_generator,
    as_points,
    as_rotations,
    as_shape,
    as_size,
    as_transforms,
    as_whole,
    fit_together,
    shown,
    solve_covariance,
)
from ..documented import documented, unchecked
from ..geometry.lie import exp_so3, skew
from .result import Result, point_parameters, result_class
from .robust import median_std, tukey_weights

RANK_TOLERANCE = 1e-6  # smallest singular value beside the largest: below, the data do not say where the tip is
NOISE_TOLERANCE = 1.5  # times std_rot: twice what orientation noise alone feigns
TUKEY = 7.0  # residuals beyond seven standard deviations get no weight; 98.2 % efficient on Gaussian noise
TUKEY_SHRINK = 0.9170593779364243  # E[w d^2] / (3 E[w]): what the weights leave of a Gaussian variance
SAMPLES, SCORED = 100, 128  # three-pose candidates for a robust start, and poses that judge them


@result_class
class PivotCalibration(Result):
    """Where the tip is, and how well the poses say so.

    Attributes
    ----------
    tip : array, shape (3,)
        In the tool frame F (mm).
    pivot : array, shape (3,)
        In W (mm).
    T_WF : array, shape (n, 4, 4)
        The poses.
    weights : array, shape (n,)
        1 unless robust; 0 for a pose that was rejected.
    noise : tuple or None
        (std_rot, std_trans) in rad and mm, where they were given.
    robust : bool
        Whether the weights follow from the residuals.
    residuals : array, shape (n, 3)
        R tip + p - pivot in W (mm).
    s0 : float
        sqrt(r'r / n) as in the lab sheet: a distance in space (mm).
    std : float
        Unbiased standard deviation of one coordinate, sqrt(r'r / (3n - 6)) (mm).
    covariance : array, shape (6, 6)
        Of tip and pivot (mm^2).
    singular_values : array, shape (6,)
        Of the stacked matrix of the poses with weight, largest first.
    """

    tip: np.ndarray
    pivot: np.ndarray
    T_WF: np.ndarray
    weights: np.ndarray
    noise: tuple | None = None
    robust: bool = False

    parameters = point_parameters("tip") + point_parameters("pivot")

    @cached_property
    def residuals(self):
        return pivot_residuals(self.T_WF, self.tip, self.pivot)

    @cached_property
    def s0(self):
        return math.sqrt(self._sum_of_squares / self.weights.sum())

    @cached_property
    def std(self):
        return math.sqrt(self._sum_of_squares / self._freedom / (TUKEY_SHRINK if self.robust else 1.0))

    @cached_property
    def covariance(self):
        W = _whitening(self.T_WF, self.tip, self.noise)
        A = (W @ pivot_matrix(self.T_WF).reshape(-1, 3, 6)) * np.sqrt(self.weights)[:, None, None]
        inverse = _inverse_gram(A.reshape(-1, 6))
        if self.robust:
            return self._spread(np.linalg.norm((W @ self.residuals[..., None])[..., 0], axis=1)) * inverse
        return inverse if self.noise else self.std**2 * inverse

    @cached_property
    def singular_values(self):
        return np.linalg.svd(np.linalg.qr(pivot_matrix(self.T_WF[self.weights > 0]), mode="r"), compute_uv=False)

    @property
    def _sum_of_squares(self):
        return float(self.weights @ (self.residuals**2).sum(1))

    @property
    def _freedom(self):
        return max(3 * self.weights.sum() - 6, 1.0)

    def _spread(self, d):
        """Variance of a whitened residual for an M-estimate: squares of psi = w d over the squared mean slope of it."""
        w = self.weights
        slope = (w - 4 / 3 * (1 - np.sqrt(w)) * np.sqrt(w)).sum() / w.sum()
        return (w * d) @ (w * d) / self._freedom / slope**2


def poses_from_euler(xyzabc_deg):
    """Poses from positions and three angles with R = Rx(a) Ry(b) Rz(c).

    Parameters
    ----------
    xyzabc_deg : array-like, shape (..., 6)
        x, y, z (mm) and a, b, c (deg).

    Returns
    -------
    T_WF : array, shape (..., 4, 4)
    """
    xyzabc_deg = as_points(xyzabc_deg, "xyzabc_deg", dim=6)
    abc = np.deg2rad(xyzabc_deg[..., 3:, None]) * np.eye(3)
    T = np.zeros((*xyzabc_deg.shape[:-1], 4, 4))
    T[..., :3, :3] = exp_so3(abc[..., 0, :]) @ exp_so3(abc[..., 1, :]) @ exp_so3(abc[..., 2, :])
    T[..., :3, 3], T[..., 3, 3] = xyzabc_deg[..., :3], 1.0
    return T


# --- the linear system -----------------------------------------------------------------------------------------------


def pivot_matrix(T_WF):
    """The stacked matrix [R_i  -I].

    Parameters
    ----------
    T_WF : array-like, shape (n, 4, 4)

    Returns
    -------
    A : array, shape (3n, 6)

    Source: lab sheet, section 3.
    """
    T = as_poses(T_WF, 1)
    A = np.empty((len(T), 3, 6))
    A[..., :3], A[..., 3:] = T[:, :3, :3], -np.eye(3)
    return A.reshape(-1, 6)


def pivot_rhs(T_WF):
    """The stacked right-hand side -p_i.

    Parameters
    ----------
    T_WF : array-like, shape (n, 4, 4)

    Returns
    -------
    b : array, shape (3n,), mm

    Source: lab sheet, section 3.
    """
    return -as_poses(T_WF, 1)[:, :3, 3].ravel()


def solve_pivot(A, b):
    """Least-squares solution of A x = b, by orthogonal factorization.

    Parameters
    ----------
    A : array-like, shape (3n, 6)
    b : array-like, shape (3n,), mm

    Returns
    -------
    x : array, shape (6,), mm
        Tip, then pivot.

    Raises
    ------
    ValueError
        When A has not rank 6: the smallest singular value is below 1e-6 of the largest.

    Source: lab sheet, section 3, equation (1), which forms (A'A)^-1 A'b and so squares the condition number.
    """
    A, b = as_points(A, "A", dim=6), as_finite(b, "b")
    if A.ndim != 2 or b.shape != (len(A),):
        raise ValueError(f"A and b must have shapes (m, 6) and (m,), got {A.shape} and {b.shape}")
    x, _, rank, values = np.linalg.lstsq(A, b, rcond=RANK_TOLERANCE)
    if rank < 6:
        raise ValueError(f"A must have rank 6, but its rank is {rank}: the singular values are {shown(values, '.6g')}")
    return x


def pivot_residuals(T_WF, tip, pivot):
    """How far the tip misses the pivot in each pose, R_i tip + p_i - pivot.

    Parameters
    ----------
    T_WF : array-like, shape (n, 4, 4)
    tip, pivot : array-like, shape (3,), mm

    Returns
    -------
    residuals : array, shape (n, 3), mm
        In W.

    Source: lab sheet, section 3, equation (2).
    """
    T, tip, pivot = as_poses(T_WF, 1), as_shape(tip, "tip", 3), as_shape(pivot, "pivot", 3)
    return T[:, :3, :3] @ tip + T[:, :3, 3] - pivot


def pivot_covariance(A, residuals):
    """Covariance of (tip, pivot) when every coordinate of the residuals carries the same noise: std^2 (A'A)^-1.

    Parameters
    ----------
    A : array-like, shape (3n, 6)
    residuals : array-like, shape (n, 3) or (3n,), mm

    Returns
    -------
    covariance : array, shape (6, 6), mm^2
        With std^2 = r'r / (3n - 6), the unbiased estimate.

    Raises
    ------
    ValueError
        When A has not more than 6 rows, or not rank 6.
    """
    A, r = as_points(A, "A", dim=6), as_finite(residuals, "residuals").ravel()
    if A.ndim != 2 or len(r) != len(A) or len(A) <= 6:
        raise ValueError(f"A must have more than 6 rows and one for each residual, got {A.shape} and {r.shape}")
    return (r @ r) / (len(r) - 6) * _inverse_gram(A)


def _inverse_gram(A):
    """(A'A)^-1 from the triangular factor of A, which does not square the condition number."""
    R = np.linalg.qr(A, mode="r")
    if np.abs(np.diagonal(R)).min() <= RANK_TOLERANCE * np.abs(np.diagonal(R)).max():
        raise ValueError("A must have rank 6, but a direction of (tip, pivot) is not determined")
    R_inverse = np.linalg.inv(R)
    return R_inverse @ R_inverse.T


# --- calibration -----------------------------------------------------------------------------------------------------


@documented
def calibrate_pivot(T_WF, std_rot=None, std_trans=None, robust=False, rng=None):
    """Tip and pivot from poses that all touch one point.

    Parameters
    ----------
    T_WF : array-like, shape (n, 4, 4)
        Measured poses of the tool frame, n >= 3, turned about at least two axes; n >= 5 when robust.
    std_rot, std_trans : float, optional
        Standard deviation of each component of a pose's rotation vector (rad) and position (mm). Given together, they
        weight the residuals: orientation noise shakes the tip across its lever, not along it. Then they also scale
        the covariance (unless robust).
    robust : bool
        Give poses that miss by far no weight (Tukey), starting from the best of many three-pose solutions.
    rng : numpy.random.Generator, optional
        Draws the three-pose samples; by default a fixed one, so that the same poses give the same result.

    Returns
    -------
    PivotCalibration

    Raises
    ------
    ValueError
        When the tip is not determined, with the direction in which it is free, in the tool frame.

    Source: lab sheet, section 3; weights by propagating std_rot through the lever; Tukey's weights as in Huber,
    "Robust Statistics" (1981).

    See Also
    --------
    labkit.fast.pivot.calibrate_pivot : the same for thousands of poses.
    """
    T, noise = as_poses(T_WF, 5 if robust else 3).copy(), as_noise(std_rot, std_trans)
    tolerance = rank_tolerance(noise)
    unchecked(refuse_free_tip)(T, tolerance)
    if robust:
        x, weights = _reweighted(T, noise, as_optional_generator(rng))
        if (count := np.count_nonzero(weights)) < 4:
            raise ValueError(f"only {count} of {len(T)} poses agree on a tip; at least 4 must")
        refuse_free_tip(T[weights > 0], tolerance)
    else:
        x, weights = solve_pivot(pivot_matrix(T), pivot_rhs(T)), np.ones(len(T))
        for _ in range(3 if noise else 0):  # the whitening knows the tip through its lever alone: three rounds settle
            x = _weighted_solution(T, weights, _whitening(T, x[:3], noise))
    return PivotCalibration(x[:3], x[3:], T, weights, noise, robust)


def as_poses(T_WF, at_least):
    """The poses as an array (n, 4, 4), n >= at_least; anything else is refused."""
    T, at_least = as_transforms(T_WF, "T_WF"), as_whole(at_least, "at_least")
    if T.ndim != 3:
        raise ValueError(f"T_WF must have shape (n, 4, 4), got {T.shape}")
    if len(T) < at_least:
        why = ": two poses always leave the tip free along the axis of the turn between them" if len(T) == 2 else ""
        raise ValueError(f"T_WF must hold at least {at_least} poses, got {len(T)}{why}")
    return T


def as_noise(std_rot, std_trans):
    """(std_rot, std_trans) as floats, or None when neither is given."""
    if std_rot is None and std_trans is None:
        return None
    if std_rot is None or std_trans is None:
        raise ValueError("std_rot and std_trans must come together: only their ratio tells how to weight")
    std_rot, std_trans = as_number(std_rot, "std_rot"), as_number(std_trans, "std_trans")
    if std_rot < 0 or std_trans <= 0:
        raise ValueError(
            f"std_rot must not be negative and std_trans must be positive, got {shown(std_rot)} and {shown(std_trans)}"
        )
    return std_rot, std_trans


@documented
def rank_tolerance(noise):
    """How small the smallest singular value may be beside the largest: orientation noise feigns some of its own.

    Parameters
    ----------
    noise : array, shape (2,), or None
        Standard deviations of rotation (rad) and translation (mm).
    """
    return RANK_TOLERANCE if noise is None else max(RANK_TOLERANCE, NOISE_TOLERANCE * noise[0])


@documented
def refuse_free_tip(T, tolerance):
    """Refuses poses whose stacked matrix has a singular value below the tolerance (relative to the largest).

    The null vector is (v, R_i v): the tip can move along v, fixed in the tool, and the pivot with it.

    Parameters
    ----------
    T : array, shape (n, 4, 4)
        n >= 2.
    tolerance : float
    """
    if len(T) < 2:
        raise ValueError(f"T must hold at least 2 poses, got {len(T)}")
    _, values, Vt = np.linalg.svd(np.linalg.qr(pivot_matrix(T), mode="r"))
    ratios = values / values[0]
    if ratios[5] > tolerance:
        return
    free, v = int((ratios <= tolerance).sum()), Vt[5, :3] / np.linalg.norm(Vt[5, :3])
    v *= 1.0 if v[np.abs(v).argmax()] > 0 else -1.0
    where = f"along {shown(v, '.2f')} in the tool frame" if free == 1 else f"in {free} directions"
    share = "practically nothing" if ratios[5] < 1e-7 else shown(ratios[5], ".1e")
    raise ValueError(
        f"the poses do not fix the tip, it is free {where}: the smallest singular value is {share} of the largest, "
        f"more than {shown(tolerance, '.1e')} is needed; turn the tool about "
        f"{'another axis' if free == 1 else 'two axes'}"
    )


def _whitening(T, tip, noise):
    """W_i, (n, 3, 3), that turn the residuals in W into three numbers of variance 1 each (without noise, into F).

    In F a residual has the covariance std_trans^2 I + std_rot^2 [tip]x [tip]x'.
    """
    std_rot, std_trans = (0.0, 1.0) if noise is None else noise
    C = std_trans**2 * np.eye(3) + std_rot**2 * skew(tip) @ skew(tip).T
    return np.linalg.inv(np.linalg.cholesky(C)) @ np.swapaxes(T[:, :3, :3], 1, 2)


def _weighted_solution(T, weights, W):
    """x = (tip, pivot) that minimizes the sum of weights |W_i (R_i tip + p_i - pivot)|^2."""
    W = W * np.sqrt(weights)[:, None, None]
    A, b = W @ pivot_matrix(T).reshape(-1, 3, 6), W @ pivot_rhs(T).reshape(-1, 3, 1)
    return np.linalg.lstsq(A.reshape(-1, 6), b.ravel(), rcond=None)[0]


def _reweighted(T, noise, rng):
    """Iteratively reweighted least squares from the best sample: x = (tip, pivot) and the weights."""
    x, weights = _best_of_samples(T, rng), np.zeros(len(T))
    for k in range(30):
        W = _whitening(T, x[:3], noise)
        d = np.linalg.norm((W @ pivot_residuals(T, x[:3], x[3:])[..., None])[..., 0], axis=1)
        if k < 3:  # the scale settles first; afterwards it stays, so that the steps converge
            rounding = 100 * np.finfo(float).eps * np.abs(T[:, :3, 3]).max() * np.abs(W).max()
            scale = max(median_std(d), rounding)  # of exact poses, residuals are nothing else
        last, weights = weights, tukey_weights(d, scale, TUKEY)
        x = _weighted_solution(T, weights, W)
        if k >= 3 and np.abs(weights - last).max() < 1e-4:
            break
    return x, weights


def _best_of_samples(T, rng):
    """x = (tip, pivot) of the three poses whose solution has the least median distance over the poses.

    A triple that leaves the tip free gives some point of its line, and loses.
    """
    n, order = len(T), rng.permutation(len(T))
    triples = [order[: n // 3 * 3].reshape(-1, 3)]
    while sum(map(len, triples)) < SAMPLES:
        triples.append(rng.permutation(n)[: n // 3 * 3].reshape(-1, 3))
    triples = np.concatenate(triples)[:SAMPLES]
    A, b = pivot_matrix(T).reshape(n, 3, 6)[triples], pivot_rhs(T).reshape(n, 3)[triples]
    x = (np.linalg.pinv(A.reshape(-1, 9, 6), rcond=RANK_TOLERANCE) @ b.reshape(-1, 9, 1))[..., 0]
    R, p = T[order[:SCORED], :3, :3], T[order[:SCORED], :3, 3]
    misses = np.einsum("nij,kj->kni", R, x[:, :3]) + p - x[:, None, 3:]
    return x[np.median((misses**2).sum(-1), axis=1).argmin()]


# --- planning --------------------------------------------------------------------------------------------------------


def predicted_covariance(R, tip, std_rot, std_trans):
    """Cramer-Rao bound of (tip, pivot) for planned orientations, before any pose is measured.

    The poses' own rotations are nuisance parameters: their noise reaches the tip through its lever.

    Parameters
    ----------
    R : array-like, shape (n, 3, 3)
    tip : array-like, shape (3,)
        Roughly where the tip will be, in the tool frame.
    std_rot, std_trans : float
        Standard deviation of each component of a pose's rotation vector (rad) and position.

    Returns
    -------
    covariance : array, shape (6, 6), mm^2

    Raises
    ------
    ValueError
        When the orientations do not fix the tip.
    """
    R, tip = as_shape(as_rotations(R, "R"), "R", "n", 3, 3), as_shape(tip, "tip", 3)
    std_rot, std_trans = as_noise(as_number(std_rot, "std_rot"), as_number(std_trans, "std_trans"))
    lever = skew(tip)
    C = std_trans**2 * np.eye(3) + std_rot**2 * lever @ lever.T
    A = np.concatenate([R, np.broadcast_to(-np.eye(3), R.shape)], axis=-1)
    inverse = solve_covariance(C, "the noise of a reading", np.eye(3))
    information = (np.swapaxes(A, 1, 2) @ (R @ inverse @ np.swapaxes(R, 1, 2)) @ A).sum(0)
    values = np.linalg.eigvalsh(information)
    if values[0] <= RANK_TOLERANCE**2 * values[-1]:
        raise ValueError("the orientations do not fix the tip: the information matrix has a zero eigenvalue")
    return np.linalg.inv(information)


def tilted(directions, spin=0.0):
    """Rotations that turn the tool's z axis to the given directions by the shortest way, after a spin about it.

    Parameters
    ----------
    directions : array-like, shape (..., 3)
        Of any length but zero.
    spin : array-like, shape (...)
        Turn of the tool about its own z axis before (rad).

    Returns
    -------
    R : array, shape (..., 3, 3)

    Raises
    ------
    ValueError
        When a direction is zero.
    """
    d, spin = as_points(directions, "directions"), as_finite(spin, "spin")
    d = np.broadcast_to(d, (*fit_together(directions=d.shape[:-1], spin=spin.shape), 3))
    length = np.linalg.norm(d, axis=-1)
    if (length == 0).any():
        raise ValueError("directions must not be zero: the tool has to point somewhere")
    across = np.cross([0.0, 0.0, 1.0], d / length[..., None])
    sine = np.linalg.norm(across, axis=-1)
    angle = np.arctan2(sine, d[..., 2] / length)
    flipped = (sine < 1e-12) & (angle > 1)  # straight down: turn about x
    axis = np.where(flipped[..., None], [1.0, 0.0, 0.0], across / np.where(sine < 1e-300, 1.0, sine)[..., None])
    turn = np.zeros(d.shape)
    turn[..., 2] = spin
    return exp_so3(angle[..., None] * axis) @ exp_so3(turn)


def cone(n, half_angle, turns=0.0):
    """Rotations of a tool led once around a cone.

    Parameters
    ----------
    n : int
        Number of poses.
    half_angle : float
        Between the tool's z axis and the vertical (rad).
    turns : float
        How often the tool spins about its own axis on the way. With exactly one turn the whole motion is a rotation
        about the vertical, a single axis: then the poses leave the tip free along it.

    Returns
    -------
    R : array, shape (n, 3, 3)
    """
    n, half_angle, turns = as_size(n, "n"), as_number(half_angle, "half_angle"), as_number(turns, "turns")
    phi = 2 * np.pi * np.arange(n) / n
    sine, cosine = np.sin(half_angle), np.cos(half_angle)
    d = np.column_stack([sine * np.cos(phi), sine * np.sin(phi), np.full(n, cosine)])
    return tilted(d, spin=turns * phi)


def touching_poses(R, tip, pivot, std_rot=0.0, std_trans=0.0, rng=None):
    """Measured poses of a tool that touches `pivot` with `tip` in given orientations.

    Parameters
    ----------
    R : array-like, shape (..., n, 3, 3)
        Orientations of the tool.
    tip, pivot : array-like, shape (3,), mm
    std_rot, std_trans : float
        Noise: R exp(phi) with components of std_rot (rad), position plus components of std_trans (mm).
    rng : numpy.random.Generator
        Needed when either is not 0.

    Returns
    -------
    T_WF : array, shape (..., n, 4, 4)

    Raises
    ------
    ValueError
        Noise without a generator.
    """
    R, tip, pivot = as_rotations(R, "R"), as_shape(tip, "tip", 3), as_shape(pivot, "pivot", 3)
    std_rot, std_trans = (
        float(as_nonnegative(as_number(v, name), name)) for v, name in ((std_rot, "std_rot"), (std_trans, "std_trans"))
    )
    T = np.zeros((*R.shape[:-2], 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = R, pivot - R @ tip, 1.0
    if std_rot or std_trans:
        if rng is None:
            raise ValueError("rng must be given when std_rot or std_trans is not 0")
        rng = as_generator(rng)
        T[..., :3, :3] = R @ exp_so3(std_rot * rng.normal(size=(*R.shape[:-2], 3)))
        T[..., :3, 3] += std_trans * rng.normal(size=(*R.shape[:-2], 3))
    return T
