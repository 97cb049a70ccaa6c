"""Quirlen: the tip of a tool and the fixed point it touches, from poses that all keep the tip on that point.

The tool frame F moves, T_WF = (R_i, p_i); the tip sits at `tip` in F and always at `pivot` in W:

    R_i tip + p_i = pivot,    stacked:  [R_i  -I] [tip; pivot] = -p_i

The pivot is eliminated by taking means: with D_i = R_i - mean R and d_i = p_i - mean p the tip solves D_i tip = -d_i,
and the singular values of the full system are sqrt(n (1 +- s_k)) with the singular values s_k of mean R. Lengths in
mm, angles in radians. Source: lab sheet "Kalibrierung", Hochschule Darmstadt 2016, section 3.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..checks import (
    as_count,
    as_finite,
    as_nonnegative,
    as_number,
    as_points,
    as_rotations,
    as_shape,
    as_transform_rows,
    fit_together,
    shown,
)
from ..geometry.lie import exp_so3, skew

RANK_TOLERANCE = 1e-6  # smallest singular value beside the largest: below, the data do not say where the tip is
NOISE_TOLERANCE = 1.5  # times std_rot: twice what orientation noise alone feigns
TUKEY = 7.0  # residuals beyond seven standard deviations get no weight; 98.2 % efficient on Gaussian noise
SAMPLES, SCORED = 100, 128  # three-pose candidates for a robust start, and poses that judge them
TUKEY_SHRINK = 0.9170593779364243  # E[w d^2] / (3 E[w]): what the weights leave of a Gaussian variance
MEDIAN_CHI3 = 1.5381722544550522  # median length of a vector of three standard normal components
IDENTITY = np.eye(3)


@dataclass(frozen=True)
class PivotCalibration:
    """Where the tip is, and how well the poses say so.

    tip: (3,) in the tool frame F. pivot: (3,) in W. residuals: (n, 3), R tip + p - pivot in W. s0: sqrt(r'r / n) as
    in the lab sheet, a distance in space. std: unbiased standard deviation of one coordinate, sqrt(r'r / (3n - 6)).
    covariance: (6, 6) of tip and pivot. singular_values: (6,) of the stacked matrix, largest first. weights: (n,), 1
    unless robust.
    """

    tip: np.ndarray
    pivot: np.ndarray
    residuals: np.ndarray
    s0: float
    std: float
    covariance: np.ndarray
    singular_values: np.ndarray
    weights: np.ndarray


class _PlainCalibration(PivotCalibration):
    """Knows tip and pivot, and works out the rest from its own copy of the poses when first asked: that takes as long
    again, and a tool that is calibrated on the way does without.
    """

    def __init__(self, rows, mean, gram, tip, pivot):
        self.__dict__.update(tip=tip, pivot=pivot, _rows=rows, _mean=mean, _gram=gram)

    @property
    def _n(self):
        return self._rows.shape[1]

    @cached_property
    def residuals(self):
        return _moved(self._rows, self.tip, self.pivot).T

    @cached_property
    def s0(self):
        return math.sqrt(np.vdot(self.residuals, self.residuals) / self._n)

    @cached_property
    def std(self):
        return math.sqrt(np.vdot(self.residuals, self.residuals) / (3 * self._n - 6))

    @cached_property
    def covariance(self):
        both = np.concatenate((IDENTITY, self._mean[:, :3]))  # a shift of the tip moves the pivot along
        covariance = both @ np.linalg.inv(self._gram[:3, :3]) @ both.T
        covariance[3:, 3:] += IDENTITY / self._n
        return self.std**2 * covariance

    @cached_property
    def singular_values(self):
        return _singular_values(self._gram, self._n)

    @cached_property
    def weights(self):
        return np.ones(self._n)


def poses_from_euler(xyzabc_deg):
    """T_WF from x, y, z (mm) and three angles a, b, c (deg) with R = Rx(a) Ry(b) Rz(c); (..., 6) -> (..., 4, 4)."""
    xyzabc_deg = as_points(xyzabc_deg, "xyzabc_deg", dim=6)
    abc = np.deg2rad(xyzabc_deg[..., 3:, None]) * np.eye(3)
    T = np.zeros((*xyzabc_deg.shape[:-1], 4, 4))
    T[..., :3, :3] = exp_so3(abc[..., 0, :]) @ exp_so3(abc[..., 1, :]) @ exp_so3(abc[..., 2, :])
    T[..., :3, 3], T[..., 3, 3] = xyzabc_deg[..., :3], 1.0
    return T


def _poses(T_WF, at_least):
    """The poses, (n, 4, 4), and their entries as contiguous rows, (16, n)."""
    T, rows = as_transform_rows(T_WF, "T_WF")
    if len(T) < at_least:
        raise ValueError(f"T_WF must hold at least {at_least} poses, got {len(T)}{_few(len(T))}")
    return T, rows


def _few(n):
    return ": two poses always leave the tip free along the axis of the turn between them" if n == 2 else ""


def pivot_matrix(T_WF):
    """The stacked matrix [R_i  -I]; (n, 4, 4) -> (3n, 6). Source: lab sheet, section 3."""
    T, _ = _poses(T_WF, 1)
    A = np.empty((len(T), 3, 6))
    A[..., :3], A[..., 3:] = T[:, :3, :3], -np.eye(3)
    return A.reshape(-1, 6)


def pivot_rhs(T_WF):
    """The stacked right-hand side -p_i; (n, 4, 4) -> (3n,). Source: lab sheet, section 3."""
    return -_poses(T_WF, 1)[0][:, :3, 3].ravel()


def solve_pivot(A, b):
    """Least-squares solution x = (tip, pivot) of A x = b, by orthogonal factorization; (3n, 6), (3n,) -> (6,).

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
    """How far the tip misses the pivot in each pose, R_i tip + p_i - pivot; (n, 4, 4) -> (n, 3).

    Source: lab sheet, section 3, equation (2).
    """
    (T, _), tip, pivot = _poses(T_WF, 1), as_points(tip, "tip"), as_points(pivot, "pivot")
    return T[:, :3, :3] @ tip + T[:, :3, 3] - pivot


def pivot_covariance(A, residuals):
    """Covariance of (tip, pivot) when every coordinate of the residuals carries the same noise: std^2 (A'A)^-1.

    Parameters
    ----------
    A : array-like, shape (3n, 6)
    residuals : array-like, shape (n, 3) or (3n,)

    Returns
    -------
    covariance : array, shape (6, 6)
        With std^2 = r'r / (3n - 6), the unbiased estimate.
    """
    A, r = as_points(A, "A", dim=6), as_finite(residuals, "residuals").ravel()
    if A.ndim != 2 or len(r) != len(A) or len(A) <= 6:
        raise ValueError(f"A must have more than 6 rows and one for each residual, got {A.shape} and {r.shape}")
    R = np.linalg.qr(A, mode="r")
    if np.abs(np.diagonal(R)).min() <= RANK_TOLERANCE * np.abs(np.diagonal(R)).max():
        raise ValueError("A must have rank 6, but a direction of (tip, pivot) is not determined")
    R_inverse = np.linalg.inv(R)
    return (r @ r) / (len(r) - 6) * R_inverse @ R_inverse.T


def robust_weights(distances, scale, cutoff=TUKEY):
    """Tukey's weights (1 - (d / (cutoff scale))^2)^2, and 0 beyond the cutoff; (...) -> (...).

    Parameters
    ----------
    distances : array-like, shape (...)
        How far each pose misses, never negative (mm).
    scale : float
        Standard deviation of one coordinate of the good poses (mm), positive.
    """
    d, scale, cutoff = as_finite(distances, "distances"), float(scale), float(cutoff)
    if not scale > 0 or not cutoff > 0:
        raise ValueError(f"scale and cutoff must be positive, got {shown(scale)} and {shown(cutoff)}")
    return _tukey(d / scale, cutoff)


def _tukey(d, cutoff=TUKEY):
    q = 1.0 - (d / cutoff) ** 2
    return np.maximum(q, 0.0) ** 2


def robust_scale(distances):
    """Standard deviation of a coordinate from the median distance: half the poses may be wrong; (n,) -> float."""
    return _scale(as_finite(distances, "distances"))


def _scale(d):
    half = len(d) // 2
    return float(np.partition(d, half)[half]) / MEDIAN_CHI3


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
    """
    T, rows = _poses(T_WF, 5 if robust else 3)
    noise = _noise(std_rot, std_trans)
    tolerance = RANK_TOLERANCE if noise is None else max(RANK_TOLERANCE, NOISE_TOLERANCE * noise[0])
    mean, gram = _gram(rows)
    tip = _tip(gram, len(T), tolerance)
    if robust:
        return _robust(T, rows, noise, tolerance, np.random.default_rng(0) if rng is None else rng)
    pivot = mean[:, :3] @ tip + mean[:, 3]
    if noise is None:
        return _PlainCalibration(rows, mean, gram, tip, pivot)
    return _weighted(rows, tip, pivot, _singular_values(gram, len(T)), noise)


def _noise(std_rot, std_trans):
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


def _gram(rows):
    """Mean of [R p] over the poses, and [D d]'[D d] of the deviations from it; (16, n) -> (3, 4), (4, 4).

    The last row of the entries is all ones: a product with it sums.
    """
    n, entries = rows.shape[1], rows[:12]
    products = entries @ entries.T
    mean = (entries @ rows[15]).reshape(3, 4) / n
    squares = products[:4, :4] + products[4:8, 4:8]
    squares += products[8:, 8:]
    squares -= n * (mean.T @ mean)
    return mean, squares


def _moved(rows, tip, pivot):
    """R tip + p - pivot from the entries of the poses; (16, n) -> (3, n)."""
    factors = np.zeros((3, 16))
    factors[0, :3] = factors[1, 4:7] = factors[2, 8:11] = tip
    factors[0, 3] = factors[1, 7] = factors[2, 11] = 1.0
    factors[:, 15] = -pivot
    return factors @ rows


def _share(ratio):
    return "practically nothing" if ratio < 1e-7 else f"{ratio:.1e}"


def _tip(gram, n, tolerance):
    """The plain tip -(D'D)^-1 D'd; refuses a direction that the poses leave free.

    With trace t and determinant of D'D, its least eigenvalue is at least 4 det / t^2, and the stacked matrix has
    singular values from sqrt(least / 2) to sqrt(2 n): a bound that clears most pose sets without an eigenvalue.
    """
    (a, b, c, _), (_, d, e, _), (_, _, f, _), (u, v, w, _) = gram.tolist()  # plain floats: NumPy is slow on so few
    A, B, C, D, E, F = d * f - e * e, c * e - b * f, b * e - c * d, a * f - c * c, b * c - a * e, a * d - b * b
    determinant, trace = a * A + b * B + c * C, a + d + f
    if not determinant > n * tolerance**2 * trace**2:
        _refuse_free_tip(gram, n, tolerance)
    return np.array([A * u + B * v + C * w, B * u + D * v + E * w, C * u + E * v + F * w]) / -determinant


def _singular_values(gram, n):
    """Of the stacked matrix, from the deviations of the poses; (6,), largest first."""
    q = np.maximum(np.linalg.eigvalsh(gram[:3, :3]) / n, 0.0)  # 1 - s^2
    s = np.sqrt(np.maximum(1.0 - q, 0.0))
    return np.sqrt(n * np.concatenate([1.0 + s, (q / (1.0 + s))[::-1]]))


def _refuse_free_tip(gram, n, tolerance):
    """Raises when a singular value falls below the tolerance, with the direction that is free."""
    ratios = _singular_values(gram, n)
    ratios /= ratios[0]
    if ratios[5] > tolerance:
        return
    free = int((ratios <= tolerance).sum())
    v = np.linalg.eigh(gram[:3, :3])[1][:, 0]
    v *= 1.0 if v[np.abs(v).argmax()] > 0 else -1.0
    where = f"along {shown(v, '.2f')} in the tool frame" if free == 1 else f"in {free} directions"
    raise ValueError(
        f"the poses do not fix the tip, it is free {where}: the smallest singular value is {_share(ratios[5])} of the"
        f" largest, more than {shown(tolerance, '.1e')} is needed; turn the tool about"
        f" {'another axis' if free == 1 else 'two axes'}"
    )


class _Weighted:
    """Weighted least squares about a current tip and pivot, on the entries of the poses as contiguous rows (16, n).

    With C = std_trans^2 I + std_rot^2 [tip]x[tip]x' (in F) and u = R tip, R C^-1 R' = (I + g u u') / c, where
    c = std_trans^2 + (std_rot |tip|)^2 and g = (std_rot / std_trans)^2. Without noise figures C = I, and distances
    are in mm.
    """

    def __init__(self, rows, noise):
        std_rot, self.std_trans = (0.0, 1.0) if noise is None else noise
        self.variance_rot, self.g = std_rot**2, (std_rot / self.std_trans) ** 2
        self.rows, self.positions = rows, rows[3:12:4]

    def look(self, tip, pivot):
        """Residuals (3, n) and Mahalanobis distances (n,) at tip and pivot."""
        self.tip = tip
        self.c = self.std_trans**2 + self.variance_rot * (tip @ tip)
        self.r = _moved(self.rows, tip, pivot)
        squares = np.einsum("in,in->n", self.r, self.r)
        if self.g:
            self.u = self.r - self.positions
            self.u += pivot[:, None]
            self.along = np.einsum("in,in->n", self.u, self.r)
            squares += self.g * self.along**2
        return self.r, np.sqrt(squares / self.c)

    def step(self, w):
        """Gauss-Newton step (6,) for weights w (n,), and the normal matrix (6, 6)."""
        N, rhs, total = np.empty((6, 6)), np.empty(6), w.sum()
        wr = self.r * w
        products = (self.rows[:12] @ wr.T).reshape(3, 4, 3)  # component of [R p], of the residual
        N[:3, :3] = N[3:, 3:] = total * IDENTITY
        N[3:, :3] = -(self.rows[:12] @ w).reshape(3, 4)[:, :3]
        rhs[:3], rhs[3:] = np.einsum("iji->j", products)[:3], -wr.sum(1)
        if self.g:
            W = IDENTITY + self.g * np.outer(self.tip, self.tip)
            N[:3, :3] = total * W
            N[3:, :3] = N[3:, :3] @ W
            N[3:, 3:] += self.g * ((self.u * w) @ self.u.T)
            rhs[:3] = W @ rhs[:3]
            rhs[3:] -= self.g * (self.u @ (w * self.along))
        N[:3, 3:] = N[3:, :3].T
        return -np.linalg.solve(N, rhs), N / self.c


def _weighted(rows, tip, pivot, values, noise):
    n, problem = rows.shape[1], _Weighted(rows, noise)
    w = np.ones(n)
    for _ in range(3):  # the weights know the tip through its length and direction alone: three steps settle them
        problem.look(tip, pivot)
        step, N = problem.step(w)
        tip, pivot = tip + step[:3], pivot + step[3:]
    r, _ = problem.look(tip, pivot)
    total = float(np.vdot(r, r))
    s0, std = math.sqrt(total / n), math.sqrt(total / (3 * n - 6))
    return PivotCalibration(tip, pivot, r.T, s0, std, np.linalg.inv(N), values, w)


def _robust(T, rows, noise, tolerance, rng):
    tip, pivot = _best_of_samples(T, rng)
    problem, n = _Weighted(rows, noise), len(T)
    for k in range(30):
        r, d = problem.look(tip, pivot)
        if k < 3:  # the scale settles first; afterwards it stays, so that the steps converge
            scale = max(_scale(d), 1e-12)
        w = _tukey(d / scale)
        step, N = problem.step(w)
        tip, pivot = tip + step[:3], pivot + step[3:]
        if k >= 3 and np.abs(step).max() < 1e-2 * scale * math.sqrt(problem.c / n):
            break
    kept = w > 0
    count = int(np.count_nonzero(kept))
    if count < 4:
        raise ValueError(f"only {count} of {n} poses agree on a tip; at least 4 must")
    _, gram = _gram(rows[:, kept])
    _refuse_free_tip(gram, count, tolerance)
    total, left = float(w.sum()), float(np.einsum("in,in,n->", r, r, w))
    freedom = max(3 * total - 6, 1.0)
    slope = (w - 4 / 3 * (d / (TUKEY * scale)) ** 2 * np.sqrt(w)).sum() / total
    spread = np.vdot(w * d, w * d) / freedom / slope**2
    s0, std = math.sqrt(left / total), math.sqrt(left / freedom / TUKEY_SHRINK)
    covariance = spread * np.linalg.inv(N)
    return PivotCalibration(tip, pivot, r.T, s0, std, covariance, _singular_values(gram, count), w)


def _best_of_samples(T, rng):
    """Tip and pivot of the three poses whose solution has the least median distance over the poses."""
    n, order = len(T), rng.permutation(len(T))
    triples = [order[: n // 3 * 3].reshape(-1, 3)]
    while sum(map(len, triples)) < SAMPLES:
        triples.append(rng.permutation(n)[: n // 3 * 3].reshape(-1, 3))
    upper = T[np.concatenate(triples)[:SAMPLES], :3]
    mean = upper.mean(1)
    D = (upper - mean[:, None]).reshape(-1, 9, 4)
    gram = np.swapaxes(D[..., :3], 1, 2) @ D
    tips = -np.linalg.solve(gram[..., :3] + 1e-9 * IDENTITY, gram[..., 3:])[
        ..., 0
    ]  # the ridge lets a degenerate triple lose
    pivots = (mean[..., :3] @ tips[..., None])[..., 0] + mean[..., 3]
    squares = _squared_distances(T[order[:SCORED], :3], tips, pivots)
    half = squares.shape[1] // 2
    best = np.partition(squares, half, axis=1)[:, half].argmin()
    return tips[best], pivots[best]


def _squared_distances(upper, tips, pivots):
    """|R tip + p - pivot|^2 of every candidate in every pose, as one matrix product; (n, 3, 4), (k, 3), (k, 3) -> (k,
    n).

    Multiplied out: |tip|^2 + |p - pivot|^2 + 2 tip'R'(p - pivot), with positions counted from their mean to keep the
    digits.
    """
    n, k, R = len(upper), len(tips), upper[..., :3]
    center = upper[..., 3].mean(0)
    p, pivots = upper[..., 3] - center, pivots - center
    of_pose, of_candidate = np.ones((n, 17)), np.ones((k, 17))
    of_pose[:, :9], of_pose[:, 9:12] = R.reshape(n, 9), p
    of_pose[:, 12:15], of_pose[:, 15] = np.einsum("nij,ni->nj", R, p), np.einsum("ni,ni->n", p, p)
    of_candidate[:, :9] = (-2.0 * pivots[:, :, None] * tips[:, None, :]).reshape(k, 9)
    of_candidate[:, 9:12], of_candidate[:, 12:15] = -2.0 * pivots, 2.0 * tips
    of_candidate[:, 16] = np.einsum("ki,ki->k", tips, tips) + np.einsum("ki,ki->k", pivots, pivots)
    return of_candidate @ of_pose.T


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
    covariance : array, shape (6, 6)
    """
    R, tip = as_shape(as_rotations(R, "R"), "R", "n", 3, 3), as_shape(tip, "tip", 3)
    std_rot, std_trans = _noise(as_number(std_rot, "std_rot"), as_number(std_trans, "std_trans"))
    lever = skew(tip)
    C = std_trans**2 * np.eye(3) + std_rot**2 * lever @ lever.T
    A = np.concatenate([R, np.broadcast_to(-np.eye(3), R.shape)], axis=-1)
    information = (np.swapaxes(A, 1, 2) @ (R @ np.linalg.inv(C) @ np.swapaxes(R, 1, 2)) @ A).sum(0)
    values = np.linalg.eigvalsh(information)
    if values[0] <= RANK_TOLERANCE**2 * values[-1]:
        raise ValueError("the orientations do not fix the tip: the information matrix has a zero eigenvalue")
    return np.linalg.inv(information)


def tilted(directions, spin=0.0):
    """Rotations that turn the tool's z axis to the given directions by the shortest way, after a spin about it; (...,
    3) -> (..., 3, 3).

    `directions` need not have length 1 but must not be zero; `spin` in radians, shape (...).
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
    """Rotations of a tool led once around a cone, its z axis `half_angle` (rad) from the vertical; (n, 3, 3).

    `turns` is how often it spins about its own axis on the way. With exactly one turn the whole motion is a
    rotation about the vertical, a single axis: then the poses leave the tip free along it.
    """
    n, half_angle, turns = as_count(n, "n"), as_number(half_angle, "half_angle"), as_number(turns, "turns")
    phi = 2 * np.pi * np.arange(n) / n
    sine, cosine = np.sin(half_angle), np.cos(half_angle)
    d = np.column_stack([sine * np.cos(phi), sine * np.sin(phi), np.full(n, cosine)])
    return tilted(d, spin=turns * phi)


def touching_poses(R, tip, pivot, std_rot=0.0, std_trans=0.0, rng=None):
    """Measured poses T_WF of a tool that touches `pivot` with `tip` in the orientations R; (..., n, 3, 3) -> (..., n,
    4, 4).

    Noise: R exp(phi) with components of std_rot (rad), position plus components of std_trans; `rng` is needed when
    either is not 0.
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
        T[..., :3, :3] = R @ exp_so3(std_rot * rng.normal(size=(*R.shape[:-2], 3)))
        T[..., :3, 3] += std_trans * rng.normal(size=(*R.shape[:-2], 3))
    return T
