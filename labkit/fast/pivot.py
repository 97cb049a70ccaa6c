"""Pivot calibration from sums over the poses: as good for a thousand poses as for ten; equals `calibration.pivot`.

With D_i = R_i - mean R and d_i = p_i - mean p the pivot is eliminated and the tip solves D'D tip = -D'd, three
equations.
"""

import numpy as np

from ..calibration import pivot
from ..calibration.pivot import PivotCalibration, as_poses, rank_tolerance, refuse_free_tip
from ..documented import unchecked
from .rigid import rigid_rows


def calibrate_pivot(T_WF, std_rot=None, std_trans=None, robust=False, rng=None):
    """Tip and pivot from poses that all touch one point: `labkit.calibration.pivot.calibrate_pivot`.

    The plain estimate comes from sums over the poses; with noise figures or robust, the readable function does it.
    """
    if robust is not False or std_rot is not None or std_trans is not None:
        return pivot.calibrate_pivot(T_WF, std_rot, std_trans, robust, rng)
    rows = rigid_rows(T_WF, "T_WF")
    if rows is None or rows.shape[1] < 3:
        rows = as_poses(T_WF, 3).reshape(-1, 16).T.copy()
    n, entries, T = rows.shape[1], rows[:12], rows.T.reshape(-1, 4, 4)
    products, mean = entries @ entries.T, entries.mean(1).reshape(3, 4)
    gram = products[:4, :4] + products[4:8, 4:8] + products[8:, 8:] - n * (mean.T @ mean)
    tip = _tip(gram, T, unchecked(rank_tolerance)(None))
    return PivotCalibration(tip, mean[:, :3] @ tip + mean[:, 3], T, np.ones(n))


def _tip(gram, T, tolerance):
    """The tip -(D'D)^-1 D'd; refuses poses that leave it free.

    With trace t and determinant of D'D, its least eigenvalue is at least 4 det / t^2, and the stacked matrix has
    singular values from sqrt(least / 2) to sqrt(2 n): a bound that clears most pose sets without an eigenvalue.
    """
    (a, b, c, _), (_, d, e, _), (_, _, f, _), (u, v, w, _) = gram.tolist()  # plain floats: NumPy is slow on so few
    A, B, C, D, E, F = d * f - e * e, c * e - b * f, b * e - c * d, a * f - c * c, b * c - a * e, a * d - b * b
    determinant, trace = a * A + b * B + c * C, a + d + f
    if not determinant > len(T) * tolerance**2 * trace**2:
        refuse_free_tip(T, tolerance)
    return np.array([A * u + B * v + C * w, B * u + D * v + E * w, C * u + E * v + F * w]) / -determinant
