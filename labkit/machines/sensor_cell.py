"""A synthetic cell: a sensor on a flange that looks at one target, to be measured as often as one likes.

The files of `data/own_data` were measured in `CELL`; a calibration of them can be held against its truth, and a pose
that seems worth measuring can be measured.
"""

from dataclasses import dataclass

import numpy as np

from ..checks import as_generator
from ..documented import documented
from ..geometry.frames import invert, pose
from ..geometry.lie import exp_so3


@dataclass(frozen=True, eq=False)
class SensorCell:
    """Where things are, and how well the sensor reads.

    Attributes
    ----------
    T_FS, T_BT : array, shape (4, 4)
        Sensor on the flange and target in the base (mm).
    std_rot, std_trans : float
        Noise of a reading per axis (rad, mm).
    """

    T_FS: np.ndarray
    T_BT: np.ndarray
    std_rot: float
    std_trans: float

    @documented
    def read(self, T_BF, rng, T_FS=None, std=1.0):
        """The target as the sensor sees it from flange poses, with noise.

        Parameters
        ----------
        T_BF : array, shape (n, 4, 4)
        rng : numpy.random.Generator or None
        T_FS : array, shape (4, 4) or (n, 4, 4), optional
            Where the sensor sits, when it has moved.
        std : float
            How many times the cell's noise; with 0 no generator is needed.

        Returns
        -------
        T_ST : array, shape (n, 4, 4)
        """
        n, T_FS = len(T_BF), self.T_FS if T_FS is None else T_FS
        if T_FS.shape not in ((4, 4), T_BF.shape):
            raise ValueError(f"T_FS must have shape (4, 4) or {T_BF.shape}, as T_BF, got {T_FS.shape}")
        seen = invert(T_BF @ T_FS) @ self.T_BT
        if not std:
            return seen
        rng = as_generator(rng)
        seen[:, :3, 3] += std * self.std_trans * rng.normal(size=(n, 3))
        return pose(seen[:, :3, :3] @ exp_so3(std * self.std_rot * rng.normal(size=(n, 3))), seen[:, :3, 3])

    def looking(self, tilt, place):
        """Flange poses from which the target appears turned and placed so in the sensor.

        Parameters
        ----------
        tilt : array-like, shape (n, 3)
            Rotation vectors (rad).
        place : array-like, shape (n, 3)
            In the sensor's frame (mm).

        Returns
        -------
        T_BF : array, shape (n, 4, 4)
        """
        return self.T_BT @ invert(pose(exp_so3(tilt), place)) @ invert(self.T_FS)


CELL = SensorCell(
    pose(exp_so3([0.1, -0.3, 1.2]), [42.0, -18.0, 96.0]),
    pose(exp_so3([0.2, 3.0, 0.1]), [850.0, 120.0, 60.0]),
    np.deg2rad(0.08),
    0.15,
)
