"""The path of a robot from its own log: odometry at one rate, ranges and bearings to landmarks whenever they came.

Rows of odometry and readings keep their own times. Between two rows the command of the first holds; a reading falls
somewhere between them. The filter is the extended one of `ekf`, with one reading at a time, a gate before each, and
nearest-neighbor association where a reading does not say which landmark it saw. Noise of the odometry grows with time:
std_way in m per root second, std_turn in rad per root second, so that it does not depend on the rate of the log.
"""

from dataclasses import dataclass

import numpy as np

from ..checks import as_covariances, as_indices, as_positive_number, as_shape
from ..documented import documented
from ..estimation.gaussian import chi_square_quantile
from . import odometry
from .ekf import ekf_update, measurement, measurement_jacobian

GATE = 0.999  # share of good readings that pass
LIMIT = float(chi_square_quantile(GATE, 2))


@dataclass(frozen=True, eq=False)
class Log:
    """A drive as it was recorded, on one clean clock.

    time: (n,) s, never falling; u: (n, 2) commands v, omega, held until the next row. z: (k, 2) range m and bearing
    rad; row: (k,) the last row at or before a reading, ascending; lag: (k,) s since that row; landmark: (k,) which one
    it saw, -1 where unknown. landmarks: (m, 2) m.
    """

    time: np.ndarray
    u: np.ndarray
    z: np.ndarray
    row: np.ndarray
    lag: np.ndarray
    landmark: np.ndarray
    landmarks: np.ndarray

    @documented
    def readings(self, chosen):
        """The same log with some of its readings.

        Parameters
        ----------
        chosen : bool array, shape (k,)
        """
        if len(chosen) != len(self.z):
            raise ValueError(f"chosen must have shape ({len(self.z)},), got {chosen.shape}")
        return Log(
            self.time, self.u, self.z[chosen], self.row[chosen], self.lag[chosen], self.landmark[chosen], self.landmarks
        )

    @documented
    def rows(self, first, last):
        """The part from one row to another, with the readings in it.

        Parameters
        ----------
        first, last : int
        """
        first, last = as_indices([first, last], "first and last").tolist()
        inside = (self.row >= first) & (self.row < last)
        part = self.readings(inside)
        return Log(
            self.time[first : last + 1], self.u[first : last + 1], part.z, part.row - first, part.lag, part.landmark,
            self.landmarks,
        )  # fmt: skip


@dataclass(frozen=True)
class Noise:
    """Standard deviations: range (m), bearing (rad), and of the odometry per root second (m and rad)."""

    std_range: float
    std_bearing: float
    std_way: float
    std_turn: float

    def odometry(self, dt):
        """Covariance (2, 2) of a command that holds for dt seconds."""
        dt = as_positive_number(dt, "dt")
        return np.diag([self.std_way**2, self.std_turn**2]) / dt


@dataclass(frozen=True, eq=False)
class Path:
    """A filtered path: x (n, 3), cov (n, 3, 3) at the rows of the odometry; of each reading nis (k,), log_det (k,) of
    its predicted covariance, used (k,) bool, landmark (k,) it was matched to."""

    x: np.ndarray
    cov: np.ndarray
    nis: np.ndarray
    log_det: np.ndarray
    used: np.ndarray
    landmark: np.ndarray


@documented
def filter_path(log, x0, cov0, noise):
    """Extended Kalman filter along a log, reading by reading.

    Parameters
    ----------
    log : Log
    x0, cov0 : array-like, shapes (3,) and (3, 3)
        Pose and covariance at the first row.
    noise : Noise

    Returns
    -------
    Path
        Readings beyond the gate are not used; neither are those of unknown landmarks that fit none, or two.

    Source: lecture, "Algorithmus fuer erweiterten Kalman-Filter"; the gate as in `estimation.kalman.gate`.
    """
    x, cov = as_shape(x0, "x0", 3), as_shape(as_covariances(cov0, "cov0", 3), "cov0", 3, 3)
    poses, covs, told, j = [], [], [], 0
    for k in range(len(log.time)):
        poses.append(x)
        covs.append(cov)
        done = 0.0
        while j < len(log.z) and log.row[j] == k:
            x, cov = _move(x, cov, log.u[k], log.lag[j] - done, noise)
            done = log.lag[j]
            x, cov, *about = _correct(x, cov, log.z[j], log.landmark[j], log.landmarks, noise)
            told.append(about)
            if done == 0.0:
                poses[-1], covs[-1] = x, cov
            j += 1
        if k + 1 < len(log.time):
            x, cov = _move(x, cov, log.u[k], log.time[k + 1] - log.time[k] - done, noise)
    nis, log_det, used, landmark = zip(*told) if told else ((), (), (), ())
    return Path(
        np.array(poses), np.array(covs), np.array(nis), np.array(log_det), np.array(used, bool), np.array(landmark, int)
    )


def _move(x, cov, u, dt, noise):
    return odometry.propagate(x, cov, u, dt, noise.odometry(dt), "midpoint") if dt > 1e-12 else (x, cov)


def _correct(x, cov, z, landmark, landmarks, noise):
    """Pose and covariance after one reading, then its NIS, log det S, whether it was used, and its landmark."""
    R = np.diag([noise.std_range**2, noise.std_bearing**2])
    which = np.arange(len(landmarks)) if landmark < 0 else np.array([landmark])
    y = z - measurement(x, landmarks[which])
    y[:, 1] = (y[:, 1] + np.pi) % (2 * np.pi) - np.pi
    H = measurement_jacobian(x, landmarks[which])
    S = H @ cov @ np.swapaxes(H, 1, 2) + R
    nis = np.einsum("mi,mij,mj->m", y, np.linalg.inv(S), y)
    best = int(nis.argmin())
    used = nis[best] <= LIMIT and (len(nis) == 1 or np.partition(nis, 1)[1] > LIMIT)
    if used:
        corrected = ekf_update(x, cov, z[None], landmarks[which[best : best + 1]], noise.std_range, noise.std_bearing)
        x, cov = corrected.x, corrected.cov
    matched = int(which[best]) if used or landmark >= 0 else -1
    return x, cov, float(nis[best]), float(np.log(np.linalg.det(S[best]))), bool(used), matched
