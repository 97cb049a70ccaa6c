"""Where a tracker sits on a flange, by the report's method and with its figures of merit.

Source: report "Kalibrace a testovani systemu OTUS tracker", ZCU Plzen 2018, section 3.1.
"""

from dataclasses import dataclass

import numpy as np

from ..calibration.ax_xb import kronecker_matrix, rotation_from_kronecker, translation_from_motions
from ..checks import as_positive_number, as_shape, as_transforms
from ..geometry.frames import pose, relative, rotation_angle


@dataclass(frozen=True)
class Mounting:
    """Result of `calibrate_mounting`.

    T_FE: array (4, 4). E_rot: equation (13), for a null vector of length 1. E_trans: equation (17), mm.
    rotation, translation: errors of every pose as in the report's figure 8, shape (N,), rad and mm; nan for excluded
    poses, 0 for the reference.
    singular_values: of the Kronecker matrix, largest first. kept: bool array (N,).
    """

    T_FE: np.ndarray
    E_rot: float
    E_trans: float
    rotation: np.ndarray
    translation: np.ndarray
    singular_values: np.ndarray
    kept: np.ndarray


def calibrate_mounting(T_BF, T_WE, factor=8.0):
    """The report's calibration: motions from the first pose, Kronecker system for the rotation, least squares for the
    translation.

    Poses whose errors are gross are left out by a rule fixed beforehand: calibrate, drop the pose with the largest
    error if it lies more than `factor` robust standard deviations above the median in translation or rotation, repeat.

    Parameters
    ----------
    T_BF, T_WE : array-like, shape (N, 4, 4)
        Poses of the flange, and the readings there. The first is the reference; N >= 4.

    Returns
    -------
    Mounting

    Source: report, section 3.1, equations (2) to (17), footnote 5.
    """
    T_BF, T_WE = as_transforms(T_BF, "T_BF"), as_transforms(T_WE, "T_WE")
    if T_BF.ndim != 3 or T_BF.shape != T_WE.shape or len(T_BF) < 4:
        raise ValueError(f"T_BF and T_WE must both have shape (N, 4, 4) with N >= 4, got {T_BF.shape} and {T_WE.shape}")
    factor = as_positive_number(factor, "factor")
    A, B = relative(T_BF[0], T_BF), relative(T_WE[0], T_WE)
    kept = np.ones(len(A), bool)
    while True:
        moved = kept.copy()
        moved[0] = False
        result = _mounting(A, B, moved, kept)
        errors = np.column_stack([result.translation, result.rotation])[moved]
        center = np.median(errors, axis=0)
        excess = ((errors - center) / (1.4826 * np.median(np.abs(errors - center), axis=0) + 1e-12)).max(axis=1)
        if excess.max() <= factor or moved.sum() <= 4:
            return result
        kept[np.flatnonzero(moved)[np.argmax(excess)]] = False


def _mounting(A, B, moved, kept):
    M = kronecker_matrix(A[moved], B[moved])
    R, values = rotation_from_kronecker(M)
    t, gap = translation_from_motions(A[moved], B[moved], R)
    rotation, translation = np.full(len(A), np.nan), np.full(len(A), np.nan)
    rotation[0] = translation[0] = 0.0
    rotation[moved] = rotation_angle(np.swapaxes(A[moved, :3, :3] @ R, -1, -2) @ (R @ B[moved, :3, :3]))
    translation[moved] = np.linalg.norm(gap, axis=1)
    return Mounting(pose(R, t), e_rot(M), e_trans(gap), rotation, translation, values, kept.copy())


def e_rot(M):
    """Equation (13): |M'M v| / (N - 1) for the smallest right singular vector v of M'M, length 1; N blocks of 9 rows.
    No unit."""
    M = as_shape(M, "M", "m", 9)
    if len(M) < 18 or len(M) % 9:
        raise ValueError(f"M must hold at least two motions, nine rows each, got {len(M)} rows")
    v = np.linalg.svd(M.T @ M)[2][-1]
    return float(np.linalg.norm(M.T @ (M @ v)) / (len(M) / 9 - 1))


def e_trans(residuals):
    """Equation (17): |K1 t - K2| / (N - 1), the norm **not** squared; residuals, shape (N, 3), in the unit of the
    lengths."""
    residuals = as_shape(residuals, "residuals", "N", 3)
    if len(residuals) < 2:
        raise ValueError(f"at least 2 residuals are needed, got {len(residuals)}")
    return float(np.linalg.norm(residuals) / (len(residuals) - 1))
