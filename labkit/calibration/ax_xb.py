"""A X = X B: where a sensor sits on a flange, from motions alone.

`T_BF` is the flange F in the robot's base B, `T_ST` the target T as the sensor S sees it, `T_FS` the mounting looked
for; the closed loop says T_BF T_FS T_ST = T_BT for every pose. Lengths mm, angles rad.

`solve_ax_xb` is the method of the report (ZCU Plzen 2018, section 3.1, equations 4 to 16), rotation first, then
translation. `calibrate_hand_eye` is the maximum-likelihood estimate for noise on the sensor's readings. Its cost
depends on the N poses through two small matrices only, so an iteration takes the same time for 20 poses and for 20000.
"""

import numpy as np

from ..checks import as_positive_number, as_rotations, as_shape, as_transforms, shown
from ..geometry.frames import pose, rotation_block
from ..geometry.lie import log_so3, nearest_rotation, skew
from .result import HandEye

RELATIVE_RANK = 1e-6  # second smallest singular value of the Kronecker matrix a motion: below it the axes are parallel
MIN_ANGLE_STD, MIN_LENGTH_STD = 1e-9, 1e-9  # rad, and relative to the lengths: noise-free data must not divide by zero
MAX_STEPS, STEP_TOLERANCE = (
    30,
    1e-8,
)  # rad; the step is taken before it is judged, and the next one would be 1000 times smaller
TUKEY, STARTS = 5.2, 12  # cut-off in robust standard deviations of the 6-vector; loose rounds before it is applied

_GENERATORS = skew(np.eye(3))  # (3, 3, 3): d/dphi_k exp(phi) at 0
_I3 = np.eye(3)


def kronecker_matrix(A, B):
    """The linear system of the rotation, M vec(X) = 0, vec stacking **columns**; equations (7) to (9).

    Parameters
    ----------
    A, B : array-like, shape (N, 3, 3) or (N, 4, 4)
        Motions of the flange and of the sensor, A_i X = X B_i. The report writes X A = B X: its letters are exchanged.

    Returns
    -------
    M : array, shape (9 N, 9)
        Blocks I kron A_i - B_i' kron I.
    """
    A, B = rotation_block(A, "A"), rotation_block(B, "B")
    if A.ndim != 3 or A.shape != B.shape:
        raise ValueError(f"A and B must be as many motions, (N, 3, 3) or (N, 4, 4), got {A.shape} and {B.shape}")
    left = np.einsum("jl,nik->njilk", _I3, A)
    right = np.einsum("nlj,ik->njilk", B, _I3)
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
    return nearest_rotation(X * (np.sign(np.linalg.det(X)) or 1.0)), np.sqrt(values)


def translation_from_motions(A, B, R):
    """Translation by least squares from (R_A - I) t = R t_B - t_A; equations (14) to (16).

    Returns
    -------
    t : array, shape (3,)
    residuals : array, shape (N, 3)
        K1 t - K2 of the report, in F.
    """
    A, B, R = as_transforms(A, "A"), as_transforms(B, "B"), as_shape(as_rotations(R, "R"), "R", 3, 3)
    if A.ndim != 3 or A.shape != B.shape:
        raise ValueError(f"A and B must both have shape (N, 4, 4), got {A.shape} and {B.shape}")
    K1 = _I3 - A[:, :3, :3]
    K2 = A[:, :3, 3] - B[:, :3, 3] @ R.T
    t = np.linalg.lstsq(K1.reshape(-1, 3), K2.ravel(), rcond=None)[0]
    return t, K1 @ t - K2


def solve_ax_xb(A, B):
    """Mounting from motion pairs by the report's method: Kronecker product and SVD for the rotation, then least
    squares.

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
    M = kronecker_matrix(A, B)
    R, values = rotation_from_kronecker(M)
    if values[-2] <= RELATIVE_RANK * np.sqrt(len(A)):
        raise ValueError(
            "the rotation axes of all motions are parallel or nothing turns: the second smallest singular value of the "
            f"Kronecker matrix is {shown(values[-2], '.2g')}, so one angle of the mounting stays free"
        )
    return pose(R, translation_from_motions(A, B, R)[0])


def calibrate_hand_eye(T_BF, T_ST, std_rot=None, std_trans=None, robust=False):
    """Maximum-likelihood mounting when the sensor's readings carry the noise and the robot does not.

    Parameters
    ----------
    T_BF : array-like, shape (N, 4, 4)
        Poses of the flange.
    T_ST : array-like, shape (N, 4, 4)
        The target as the sensor saw it. N >= 3, rotation axes of the motions not all parallel.
    std_rot, std_trans : float, optional
        Standard deviation of a reading per axis, rad and mm. What is not given is estimated together with the mounting.
    robust : bool
        Down-weight and finally ignore readings that fit nothing (Tukey's biweight over the six normalized residuals,
        scale by the median).

    Returns
    -------
    HandEye
        target is T_BT, shape (4, 4). residuals, shape (N, 6): rotation vector (rad) and translation (mm, in S) of the
        reading against the prediction. covariance, shape (12, 12): T_FS first (rotation vector about the axes of S,
        translation in F), T_BT after it (axes of T, translation in B). trace, shape (steps, 3): std_rot, std_trans and
        the size of the step.

    Raises
    ------
    ValueError
        When the stacks differ, N < 3, or the data leave a direction of the mounting undetermined.

    The start is linear: rotations by the singular vectors of one 9 x 9 matrix (Shah 2013), translations by least
    squares.
    """
    T_BF, T_ST = as_transforms(T_BF, "T_BF"), as_transforms(T_ST, "T_ST")
    if T_BF.ndim != 3 or T_BF.shape != T_ST.shape or len(T_BF) < 3:
        raise ValueError(f"T_BF and T_ST must both have shape (N, 4, 4) with N >= 3, got {T_BF.shape} and {T_ST.shape}")
    given = tuple(
        None if std is None else as_positive_number(std, name)
        for std, name in ((std_rot, "std_rot"), (std_trans, "std_trans"))
    )
    problem = _Problem(T_BF, T_ST, given)
    weights = np.ones(len(T_BF))
    state = problem.fit(weights, problem.start(weights))
    if robust:
        weights, state = _reweigh(problem, weights, state)
    return problem.result(weights, state)


class _Problem:
    """The data of one calibration, and its cost as a function of Rx (of T_FS) and Ry (of T_BT) alone."""

    def __init__(self, T_BF, T_ST, given):
        self.given, self.n = given, len(T_BF)
        self.R, self.A = T_BF[:, :3, :3], T_ST[:, :3, :3]
        self.p, self.a = T_BF[:, :3, 3], T_ST[:, :3, 3]
        self.size = np.abs(self.p).max() + np.abs(self.a).max() + 1e-300
        # translation residual in B: e_i = R_i tx + R_i Rx a_i + p_i - ty = C_i (tx, rvec Rx, 1) - ty
        self.C = np.empty((self.n, 3, 13))
        self.C[:, :, :3] = self.R
        self.C[:, :, 3:12] = (self.R[:, :, :, None] * self.a[:, None, None, :]).reshape(self.n, 3, 9)
        self.C[:, :, 12] = self.p
        self.trace = []

    def sums(self, weights):
        """All that the iterations need: K of the rotations, and the translation cost with tx and ty eliminated."""
        total = weights.sum()
        flat = self.R.reshape(-1, 9)
        weighted = flat if total == self.n else flat * weights[:, None]
        # rvec(R X A) = (R kron A') rvec(X)
        K = (weighted.T @ self.A.reshape(-1, 9)).reshape(3, 3, 3, 3).transpose(0, 3, 1, 2).reshape(9, 9)
        mean = (weights @ self.C.reshape(-1, 39)).reshape(3, 13) / total
        rows = (self.C - mean).reshape(-1, 13)
        scaled = rows if total == self.n else rows * np.repeat(weights, 3)[:, None]
        G = scaled.T @ rows
        try:
            elimination = np.linalg.solve(G[:3, :3], G[:3, 3:])
        except np.linalg.LinAlgError:
            raise ValueError(_UNDETERMINED) from None
        H = G[3:, 3:] - G[3:, :3] @ elimination
        mean_A = (weights @ self.A.reshape(-1, 9)).reshape(3, 3)
        return K, H, elimination, mean, mean_A, total

    def start(self, weights):
        """Rotations from the leading singular vectors of K: K rvec(Rx) = N rvec(Ry) for exact data."""
        sums = self.sums(weights)
        U, values, Vt = np.linalg.svd(sums[0])
        if values[0] - values[1] <= RELATIVE_RANK**2 * values[0]:
            raise ValueError(_UNDETERMINED)
        both = np.stack([Vt[0], U[:, 0]]).reshape(2, 3, 3)
        if np.linalg.det(both[0]) < 0:
            both = -both
        return nearest_rotation(both), sums

    def fit(self, weights, start):
        """Gauss-Newton on (Rx, Ry), the noise levels estimated along when they are not given."""
        both, sums = start
        K, H, _, _, sum_A, total = sums
        H9, h, h0 = H[:9, :9], H[:9, 9], H[9, 9]
        normal_r = np.empty((6, 6))
        normal_r[:3, :3] = normal_r[3:, 3:] = total * _I3
        normal_r[:3, 3:], normal_r[3:, :3] = -sum_A, -sum_A.T
        freedom = max(3 * total - 6, 1.0)
        for _ in range(MAX_STEPS):
            x, y = both.reshape(2, 9)
            Lx, Ly = (both[:, None] @ _GENERATORS).reshape(2, 3, 9)
            Kx, Hx = K @ x, H9 @ x + h
            std_r, std_t = self.stds(3 * total - y @ Kx, x @ Hx + h @ x + h0, freedom)
            normal, gradient = normal_r / std_r**2, np.empty(6)
            normal[:3, :3] += Lx @ H9 @ Lx.T / std_t**2
            gradient[:3] = Lx @ (Hx / std_t**2 - 0.5 / std_r**2 * (K.T @ y))
            gradient[3:] = -0.5 / std_r**2 * (Ly @ Kx)
            step = -np.linalg.solve(normal, gradient)
            both = _turned(both, step.reshape(2, 3))
            size = np.abs(step).max()
            self.trace.append((std_r, std_t, size))
            if size < STEP_TOLERANCE:
                break
        Rx, Ry = both
        tx = -sums[2] @ np.append(Rx.ravel(), 1.0)
        ty = sums[3] @ np.concatenate([tx, Rx.ravel(), [1.0]])
        return Rx, Ry, tx, ty

    def stds(self, cost_r, cost_t, freedom):
        """Noise levels: as given, or from the residuals, a quarter of the unknowns charged to each of the four
        blocks."""
        std_r = self.given[0] or max(max(cost_r, 0.0) / freedom, MIN_ANGLE_STD**2) ** 0.5
        std_t = self.given[1] or max(max(cost_t, 0.0) / freedom, (MIN_LENGTH_STD * self.size) ** 2) ** 0.5
        return std_r, std_t

    def residuals(self, state):
        """Reading against prediction, shape (N, 6), in the axes of the target (rotation) and of S (translation)."""
        Rx, Ry, tx, ty = state
        RX = self.R @ Rx
        turn = log_so3(Ry.T @ RX @ self.A)
        gap = self.a @ Rx.T + tx
        e = (self.R @ gap[:, :, None])[..., 0] + self.p - ty
        return turn, (np.swapaxes(RX, 1, 2) @ e[:, :, None])[..., 0]

    def information(self, weights, Rx):
        """Normal matrices of the twelve unknowns for noise of size 1, rotations and translations apart, from sums in
        closed form."""
        total = weights.sum()
        A_sum, R_sum = (weights @ self.A.reshape(-1, 9)).reshape(3, 3), (weights @ self.R.reshape(-1, 9)).reshape(3, 3)
        aw = self.a * weights[:, None]
        aa = aw.T @ self.a
        # sum of skew(a_i) Rx' R_i' over the poses, column by column a cross product
        aR = Rx.T @ (aw.T @ self.R.transpose(0, 2, 1).reshape(-1, 9)).reshape(3, 3, 3)
        cross = np.array([aR[1, 2] - aR[2, 1], aR[2, 0] - aR[0, 2], aR[0, 1] - aR[1, 0]])
        N_r, N_t = np.zeros((12, 12)), np.zeros((12, 12))
        N_r[:3, :3] = N_r[6:9, 6:9] = N_t[3:6, 3:6] = N_t[9:, 9:] = total * _I3
        N_r[:3, 6:9], N_r[6:9, :3] = -A_sum, -A_sum.T
        N_t[:3, :3] = (aa[0, 0] + aa[1, 1] + aa[2, 2]) * _I3 - aa
        arm = skew(aw.sum(0)) @ Rx.T
        N_t[:3, 3:6], N_t[3:6, :3] = arm, arm.T
        N_t[:3, 9:], N_t[9:, :3] = -cross, -cross.T
        N_t[3:6, 9:], N_t[9:, 3:6] = -R_sum.T, -R_sum
        return N_r, N_t

    def result(self, weights, state):
        """Residuals, noise levels and covariance at the solution; each noise level pays for the share of the unknowns
        it determines."""
        turn, e = self.residuals(state)
        cost_r, cost_t = weights @ (turn * turn).sum(1), weights @ (e * e).sum(1)
        N_r, N_t = self.information(weights, state[0])
        observations = 3 * weights.sum()
        share = 6.0
        for _ in range(2 if None in self.given else 1):
            std_r = self.stds(cost_r, cost_t, max(observations - 12 + share, 1.0))[0]
            std_t = self.stds(cost_r, cost_t, max(observations - share, 1.0))[1]
            N_w = N_t / std_t**2
            N = N_r / std_r**2 + N_w
            scale = 1 / np.sqrt(N.diagonal())
            unit = N * scale[:, None] * scale
            covariance = np.linalg.inv(unit) * scale[:, None] * scale
            share = (covariance * N_w).sum()
        values = np.linalg.eigvalsh(unit)
        if values[0] <= RELATIVE_RANK**2 * values[-1]:
            raise ValueError(_UNDETERMINED)
        Rx, Ry, tx, ty = state
        T = np.zeros((2, 4, 4))
        T[0, :3, :3], T[1, :3, :3], T[0, :3, 3], T[1, :3, 3], T[:, 3, 3] = Rx, Ry, tx, ty, 1.0
        return HandEye(
            T[0], T[1], np.concatenate([turn, e], 1), covariance, np.sqrt(values[::-1]), weights, np.array(self.trace)
        )


_UNDETERMINED = (
    "T_BF leaves a direction of the mounting undetermined: the rotation axes of all motions are parallel, "
    "or the poses do not turn"
)


def _turned(R, phi):
    """R, shape (n, 3, 3), turned by phi, shape (n, 3), about its own axes, by Cayley's map: exactly orthonormal, equal
    to the exponential up to |phi|^3 / 12."""
    S = (phi @ _GENERATORS.reshape(3, 9)).reshape(R.shape)
    return R @ (_I3 + (S + 0.5 * (S @ S)) / (1.0 + 0.25 * (phi * phi).sum(-1))[:, None, None])


def _reweigh(problem, weights, state):
    """Iteratively reweighted least squares: first bounded influence (1 / distance), then Tukey's biweight."""
    for k in range(3 * STARTS):
        turn, e = problem.residuals(state)
        scales = [1.4826 * np.median(np.linalg.norm(v, axis=1)) / 2.2817 for v in (turn, e)]
        floor = (MIN_ANGLE_STD, MIN_LENGTH_STD * problem.size)
        d = np.sqrt(sum((v * v).sum(1) / max(s, f) ** 2 for v, s, f in zip((turn, e), scales, floor)))
        fresh = 1 / np.maximum(d, 1.0) if k < STARTS else np.maximum(1 - (d / TUKEY) ** 2, 0.0) ** 2
        if fresh.sum() < 4:
            raise ValueError("robust: fewer than 4 readings agree with each other, so no majority can be followed")
        if k > STARTS and np.abs(fresh - weights).max() < 1e-6:
            break
        weights = fresh
        state = problem.fit(weights, problem.start(weights))
    return weights, state
