"""Lab sheet, section 3: the pivot calibration from synthetic poses, and how many poses are enough."""

import functools

import numpy as np

from ...calibration import pivot
from ...geometry.lie import exp_so3
from ..ledger import Computed, computes
from . import printed as lab_sheet

NOTEBOOK = "03_quirlen"


@functools.cache
def _calibration():
    return pivot.calibrate_pivot(lab_sheet.kreisel_poses())


def _simulated(value):
    result = _calibration()
    deviation = np.sqrt(np.diag(result.covariance))
    proof = (
        f"Kreisel.txt was never published. The listing's line numbers leave room for {lab_sheet.poses_in_listing()} "
        "poses; with as many synthetic ones, drawn so that the printed results come out, the calibration gives this "
        f"value, with a standard deviation of {deviation[:3].max():.2f} mm for the worst component of the tip: s0 "
        f"means noise of {result.std:.3f} mm per coordinate, with {3 * len(result.residuals) - 6} degrees of "
        "freedom."
    )
    return Computed(value, simulated=True, proof=proof)


@computes("pivot.x")
def solution():
    return _simulated(np.concatenate([_calibration().tip, _calibration().pivot]))


@computes("pivot.P_t")
def tip():
    return _simulated(_calibration().tip)


@computes("pivot.P_pivot")
def pivot_point():
    return _simulated(_calibration().pivot)


@computes("pivot.P_test_first")
def first_test():
    return _simulated(_calibration().residuals[0])


@computes("pivot.P_test_last")
def last_test():
    return _simulated(_calibration().residuals[-1])


@computes("pivot.s0")
def standard_deviation():
    return _simulated(_calibration().s0)


@computes("pivot.unknowns")
def unknowns():
    return Computed(pivot.pivot_matrix(lab_sheet.kreisel_poses()).shape[1])


@computes("pivot.min_poses")
def least_number():
    """Smallest number of poses with as many equations as unknowns, and what the rank adds to it."""
    rng = np.random.default_rng(3)
    T = pivot.touching_poses(exp_so3(rng.normal(size=(1000, 4, 3))), [0.0, 0.0, 100.0], np.zeros(3))
    A = np.array([pivot.pivot_matrix(t) for t in T])
    values = {n: np.linalg.svd(A[:, : 3 * n], compute_uv=False) for n in (2, 3, 4)}
    ratio = {n: v[:, 5] / v[:, 0] for n, v in values.items()}
    enough = min(n for n, r in ratio.items() if r.max() > pivot.RANK_TOLERANCE)
    proof = (
        "The sheet says at least (mindestens), and six unknowns do ask for two poses of three equations. They do not "
        "suffice: R_1 - R_2 maps the axis of the turn between them to zero; in 1000 random pairs the smallest "
        f"singular value never exceeds {ratio[2].max():.0e} of the largest. From {enough} poses on the system can be "
        f"solved (median {np.median(ratio[3]):.2f})."
    )
    return Computed(-(-A.shape[2] // 3), proof=proof)
