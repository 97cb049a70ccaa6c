"""Where a tracker sits on a flange, by the report's method and with its figures of merit.

Source: report "Kalibrace a testovani systemu OTUS tracker", ZCU Plzen 2018, section 3.1.
"""

from functools import cached_property

import numpy as np

from ..calibration.ax_xb import kronecker_matrix, rotation_from_kronecker, translation_from_motions
from ..calibration.result import Result, pose_parameters, result_class
from ..checks import as_positive_number, as_shape, as_transforms
from ..geometry.frames import pose, relative
from ..geometry.lie import log_so3, skew


@result_class
class Mounting(Result):
    """The tracker on the flange by the report's method, with its figures of merit.

    Attributes
    ----------
    T_FE : array, shape (4, 4)
        The mounting (mm).
    A, B : array, shape (N, 4, 4)
        Motions of flange and tracker since the first pose.
    weights : array, shape (N,)
        1 for a pose that takes part, 0 for one that was left out.
    kept : array of bool, shape (N,)
        The same as a mask.
    rotation, translation : array, shape (N,)
        Errors of every pose as in the report's figure 8, rad and mm; NaN for poses left out, 0 for the reference.
    residuals : array, shape (n, 6)
        Of the n motions that take part: rotation vector (rad) and translation (mm, in F) of A T_FE against T_FE B.
    std : array, shape (6,)
        Root mean square of each half of the residuals (rad, mm), the six unknowns charged to both alike.
    E_rot, E_trans : float
        Equation (13), for a null vector of length 1, without unit; equation (17), mm.
    covariance : array, shape (6, 6)
        Of the rotation vector (rad, about the axes of E) and the translation (mm, in F), to first order, the errors of
        the motions taken as independent.
    singular_values : array, shape (9,)
        Of the Kronecker matrix, largest first.
    """

    T_FE: np.ndarray
    A: np.ndarray
    B: np.ndarray
    weights: np.ndarray

    parameters = pose_parameters("T_FE")

    @property
    def kept(self):
        return self.weights > 0

    @cached_property
    def _motions(self):
        return self.A[self.kept][1:], self.B[self.kept][1:]

    @cached_property
    def _kronecker(self):
        return kronecker_matrix(*self._motions)

    @cached_property
    def singular_values(self):
        return rotation_from_kronecker(self._kronecker)[1]

    @cached_property
    def residuals(self):
        A, B = self._motions
        left, right = A @ self.T_FE, self.T_FE @ B
        turn = log_so3(np.swapaxes(right[:, :3, :3], 1, 2) @ left[:, :3, :3])
        return np.concatenate([turn, left[:, :3, 3] - right[:, :3, 3]], axis=1)

    @cached_property
    def std(self):
        squares, freedom = (self.residuals**2).sum(0).reshape(2, 3).sum(1), 3 * (len(self.residuals) - 1)
        return np.repeat(np.sqrt(squares / freedom), 3)

    @cached_property
    def covariance(self):
        (A, B), n = self._motions, len(self.residuals)
        J = np.zeros((n, 2, 3, 6))
        J[:, 0, :, :3] = np.eye(3) - np.swapaxes(B[:, :3, :3], 1, 2)
        J[:, 1, :, :3], J[:, 1, :, 3:] = self.T_FE[:3, :3] @ skew(B[:, :3, 3]), A[:, :3, :3] - np.eye(3)
        by_rotation = np.linalg.pinv(J[:, 0, :, :3].reshape(-1, 3)) * self.std[0]
        by_translation = np.linalg.pinv(J[:, 1, :, 3:].reshape(-1, 3))
        carried = -by_translation @ J[:, 1, :, :3].reshape(-1, 3) @ by_rotation
        gain = np.block([[by_rotation, np.zeros((3, 3 * n))], [carried, by_translation * self.std[3]]])
        return gain @ gain.T

    @cached_property
    def rotation(self):
        return self._of_every_pose(np.linalg.norm(self.residuals[:, :3], axis=1))

    @cached_property
    def translation(self):
        return self._of_every_pose(np.linalg.norm(self.residuals[:, 3:], axis=1))

    def _of_every_pose(self, values):
        errors = np.full(len(self.A), np.nan)
        errors[self.kept] = np.append(0.0, values)
        return errors

    @cached_property
    def E_rot(self):
        return e_rot(self._kronecker)

    @cached_property
    def E_trans(self):
        return e_trans(self.residuals[:, 3:])


def calibrate_mounting(T_BF, T_WE, factor=8.0):
    """The report's calibration: motions from the first pose, Kronecker system for the rotation, least squares for the
    translation.

    Poses whose errors are gross are left out by a rule fixed beforehand: calibrate, drop the pose with the largest
    error if it lies more than `factor` robust standard deviations above the median in translation or rotation, repeat.

    Parameters
    ----------
    T_BF, T_WE : array-like, shape (N, 4, 4)
        Poses of the flange, and the readings there (mm). The first is the reference; N >= 4.
    factor : float
        Largest error that stays in, in robust standard deviations.

    Returns
    -------
    Mounting

    Raises
    ------
    ValueError
        Fewer than four poses, or not as many of both.

    Source: report, section 3.1, equations (2) to (17), footnote 5.
    """
    T_BF, T_WE = as_transforms(T_BF, "T_BF"), as_transforms(T_WE, "T_WE")
    if T_BF.ndim != 3 or T_BF.shape != T_WE.shape or len(T_BF) < 4:
        raise ValueError(f"T_BF and T_WE must both have shape (N, 4, 4) with N >= 4, got {T_BF.shape} and {T_WE.shape}")
    factor = as_positive_number(factor, "factor")
    A, B = relative(T_BF[0], T_BF), relative(T_WE[0], T_WE)
    weights = np.ones(len(A))
    while True:
        moved = np.flatnonzero(weights)[1:]
        T_FE = _two_steps(A[moved], B[moved])
        result = Mounting(T_FE, A, B, weights)
        errors = np.column_stack([result.translation, result.rotation])[moved]
        center = np.median(errors, axis=0)
        excess = ((errors - center) / (1.4826 * np.median(np.abs(errors - center), axis=0) + 1e-12)).max(axis=1)
        if excess.max() <= factor or len(moved) <= 4:
            return result
        weights = weights.copy()
        weights[moved[np.argmax(excess)]] = 0.0


def _two_steps(A, B):
    R, _ = rotation_from_kronecker(kronecker_matrix(A, B))
    return pose(R, translation_from_motions(A, B, R)[0])


def e_rot(M):
    """Equation (13): |M'M v| / (N - 1) for the smallest right singular vector v of M'M, of length 1.

    Parameters
    ----------
    M : array-like, shape (9 N, 9)
        Kronecker matrix of N >= 2 motions.

    Returns
    -------
    E_rot : float
        Without unit.

    Source: report, equation (13).
    """
    M = as_shape(M, "M", "m", 9)
    if len(M) < 18 or len(M) % 9:
        raise ValueError(f"M must hold at least two motions, nine rows each, got {len(M)} rows")
    v = np.linalg.svd(M.T @ M)[2][-1]
    return float(np.linalg.norm(M.T @ (M @ v)) / (len(M) / 9 - 1))


def e_trans(residuals):
    """Equation (17): |K1 t - K2| / (N - 1), the norm **not** squared.

    Parameters
    ----------
    residuals : array-like, shape (N, 3)
        K1 t - K2 of N >= 2 motions.

    Returns
    -------
    E_trans : float
        In the unit of the residuals.

    Source: report, equation (17).
    """
    residuals = as_shape(residuals, "residuals", "N", 3)
    if len(residuals) < 2:
        raise ValueError(f"at least 2 residuals are needed, got {len(residuals)}")
    return float(np.linalg.norm(residuals) / (len(residuals) - 1))
