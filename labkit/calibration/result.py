"""What every hand-eye calibration returns."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class HandEye:
    """Result of a hand-eye calibration.

    T_FS: array (4, 4), the sensor S in the flange F.
    target: what the sensor looks at: T_BT, array (4, 4), for poses; the center of a sphere in B, array (3,), for
    spheres.
    residuals: array (N, k), one measurement a row; rotation vector (rad) before translation where there are both.
    covariance: of the unknowns. The first six belong to T_FS: rotation vector (rad, about the axes of S), then
    translation (in F); the target follows.
    singular_values: of the whitened Jacobian with its columns scaled to length 1, largest first; the last one tells
    how close the data are to leaving something undetermined.
    weights: array (N,), 1 for a measurement that counts fully, 0 for a rejected one.
    trace: one row of figures an iteration (what they are, the function says).
    """

    T_FS: np.ndarray
    target: np.ndarray
    residuals: np.ndarray
    covariance: np.ndarray
    singular_values: np.ndarray
    weights: np.ndarray
    trace: object
