"""A tracker on a robot flange: its packets, its logs, where it sits on the flange, and how well it follows a motion.

E is the frame of the tracker, W the frame in which it reports (its own pose at the moment its axes were reset), so a
reading is `T_WE`. `T_FE` is the mounting on the flange F. Packets and logs speak meters, as the report does; everything
else here is mm and rad.
Source: report "Kalibrace a testovani systemu OTUS tracker", ZCU Plzen 2018: table 1, sections 3.1 and 3.2, appendix D.
"""

import csv
import re
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from .axxb import kronecker_matrix, rotation_from_kronecker, translation_from_motions
from .checks import (
    as_finite,
    as_number,
    as_points,
    as_positive_number,
    as_rotations,
    as_shape,
    as_transforms,
    fit_together,
)
from .frames import matrix_from_quaternion, pose, pose_distance, relative, rotation_angle
from .lie import log_so3

# ---- the packet ------------------------------------------------------------------------------------------------------

# The one assumption about types: table 1 gives 8 bytes a field and nothing else. All 23 are taken as IEEE doubles,
# little-endian, lengths in meters (appendix D prints meters), time in seconds, angles in radians; identifier and
# buttons too.
PACKET = struct.Struct("<23d")
FIELDS = (
    "device", "time", "x", "y", "z", "vx", "vy", "vz", "ax", "ay", "az", "qx", "qy", "qz", "qw",
    "wx", "wy", "wz", "alpha_x", "alpha_y", "alpha_z", "button_1", "button_2",
)  # fmt: skip
TIME, POSITION, VELOCITY, QUATERNION, ANGULAR_VELOCITY = 1, slice(2, 5), slice(5, 8), slice(11, 15), slice(15, 18)
MAX_POSITION = 10.0  # m: twice the tracking area of the data sheet (5 x 5 m); farther away nothing is tracked
UNIT_TOLERANCE = 1e-3  # how far the length of a quaternion may be from 1


def encode_packet(values):
    """184 bytes of one reading; values, shape (23,), in the order of `FIELDS`."""
    values = as_finite(values, "values")
    if values.shape != (len(FIELDS),):
        raise ValueError(f"values must have shape (23,), one number a field of table 1, got {values.shape}")
    return PACKET.pack(*values)


def decode_packet(data):
    """The 23 numbers of a packet, in the order of `FIELDS`.

    Parameters
    ----------
    data : bytes, length 184

    Returns
    -------
    values : array, shape (23,)

    Raises
    ------
    ValueError
        When the length is wrong, a number is not finite, the quaternion is not of length 1 or the position is more than
        10 m away.

    Source: report, section 2, table 1.
    """
    values, fault = check_packet(data)
    if fault:
        raise ValueError(f"not a packet of the tracker: {fault}")
    return np.array(values)


def check_packet(data):
    """(values, "") of a good packet, (None, reason) of a bad one; plain Python, since the receiver calls it for every
    datagram."""
    if len(data) != PACKET.size:
        return None, f"length: expected {PACKET.size} bytes"
    values = PACKET.unpack(data)
    total = sum(values)
    if total - total != 0.0:  # infinite or NaN
        return None, "a number is not finite"
    qx, qy, qz, qw = values[11:15]
    if abs(qx * qx + qy * qy + qz * qz + qw * qw - 1.0) > 2 * UNIT_TOLERANCE:
        return None, "the quaternion is not of length 1"
    if max(map(abs, values[2:5])) > MAX_POSITION:
        return None, f"the position is more than {MAX_POSITION:g} m away"
    return values, ""


def packet_from_pose(T_WE, time, device=1, velocity=(0.0, 0.0, 0.0), angular_velocity=(0.0, 0.0, 0.0)):
    """The 23 numbers for a pose in mm; velocity in mm/s, angular velocity in rad/s. Broadcasts: (..., 4, 4) -> (...,
    23)."""
    T_WE, device, time = as_transforms(T_WE, "T_WE"), as_finite(device, "device"), as_finite(time, "time")
    velocity, angular_velocity = as_points(velocity, "velocity"), as_points(angular_velocity, "angular_velocity")
    leading = {"device": device.shape, "time": time.shape, "velocity": velocity.shape[:-1]}
    leading["angular_velocity"] = angular_velocity.shape[:-1]
    if fit_together(T_WE=T_WE.shape[:-2], **leading) != T_WE.shape[:-2]:
        raise ValueError(f"there must be one pose, or as many as readings, got T_WE {T_WE.shape} and {leading}")
    values = np.zeros((*T_WE.shape[:-2], len(FIELDS)))
    values[..., 0], values[..., TIME] = device, time
    values[..., POSITION] = T_WE[..., :3, 3] / 1000
    values[..., VELOCITY] = velocity / 1000
    values[..., QUATERNION] = quaternion_from_matrix(T_WE[..., :3, :3])
    values[..., ANGULAR_VELOCITY] = angular_velocity
    return values


def poses_from_packets(values):
    """Poses T_WE in mm of decoded packets; (..., 23) -> (..., 4, 4)."""
    values = as_points(values, "values", dim=len(FIELDS))
    return pose(matrix_from_quaternion(values[..., QUATERNION]), 1000 * values[..., POSITION])


def quaternion_from_matrix(R):
    """Quaternion x, y, z, w with w >= 0; (..., 3, 3) -> (..., 4)."""
    R = as_rotations(R, "R")
    if not R.size:
        return np.zeros((*R.shape[:-2], 4))
    q = Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat(canonical=True)
    return q.reshape(*R.shape[:-2], 4)


# ---- the log ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Log:
    """A log of readings: time (k,) s; T_WE (k, 4, 4) in mm; stop (k,), the number of the stop each reading belongs to,
    or None."""

    time: np.ndarray
    T_WE: np.ndarray
    stop: np.ndarray | None


_LENGTHS = {"m": 1000.0, "mm": 1.0}


def write_csv(path, log, unit="m", digits=5):
    """Write a log. Columns: time [s], stop (where the log has stops), x y z [unit], qx qy qz qw; positions with so many
    decimals of a meter."""
    if unit not in _LENGTHS:
        raise ValueError(f"unit must be m or mm, got {unit!r}")
    positions = log.T_WE[:, :3, 3] / _LENGTHS[unit]
    places = digits if unit == "m" else max(digits - 3, 0)
    header = [
        "time [s]",
        *(["stop"] if log.stop is not None else []),
        *(f"{c} [{unit}]" for c in "xyz"),
        "qx",
        "qy",
        "qz",
        "qw",
    ]
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        for k, (t, p, q) in enumerate(zip(log.time, positions, quaternion_from_matrix(log.T_WE[:, :3, :3]))):
            stop = [f"{int(log.stop[k])}"] if log.stop is not None else []
            writer.writerow([f"{t:.3f}", *stop, *(f"{v:.{places}f}" for v in p), *(f"{v:.6f}" for v in q)])


def read_csv(path):
    """Read a log written by `write_csv`, in m or mm, into mm.

    Returns
    -------
    Log

    Raises
    ------
    ValueError
        With the name of the file and the line: a missing or doubled column, columns in different units, a row of
        another length, text for a number, time that does not increase, a quaternion that is none, a position that jumps
        by a factor of 1000 (rows in another unit), a last line cut off.
    """
    path = Path(path)
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    if not lines:
        raise ValueError(f"{path.name}: the file is empty, expected a header line")
    if not text.endswith("\n"):
        raise ValueError(f"{path.name}, line {len(lines)}: the file ends in the middle of this line")
    header = next(csv.reader(lines[:1]))
    columns, factor = _columns(header, path.name)
    rows = np.empty((len(lines) - 1, len(header)))
    for number, row in enumerate(csv.reader(lines[1:]), start=2):
        if len(row) != len(header):
            raise ValueError(f"{path.name}, line {number}: expected {len(header)} entries, got {len(row)}")
        try:
            rows[number - 2] = [float(entry) for entry in row]
        except ValueError:
            bad = next(entry for entry in row if not _is_number(entry))
            raise ValueError(f"{path.name}, line {number}: expected a number, got {bad!r}") from None
    time, p, q = rows[:, columns["time"]], rows[:, columns["xyz"]] * factor, rows[:, columns["q"]]
    _refuse_rows(path.name, rows, time, p, q)
    stop = rows[:, columns["stop"]].astype(int) if "stop" in columns else None
    return Log(time, pose(matrix_from_quaternion(q), p), stop)


def _is_number(entry):
    try:
        float(entry)
    except ValueError:
        return False
    return True


def _columns(header, name):
    if len(set(header)) != len(header):
        raise ValueError(f"{name}, line 1: a column name appears twice in {header}")
    found, units = {}, {}
    for index, title in enumerate(header):
        match = re.fullmatch(r"([xyz]) \[(\w+)\]", title)
        if match:
            found[match[1]], units[match[1]] = index, match[2]
        else:
            found[title] = index
    missing = [title for title in ("time [s]", "x", "y", "z", "qx", "qy", "qz", "qw") if title not in found]
    if missing:
        raise ValueError(
            f"{name}, line 1: expected a column {missing[0]!r} (x, y, z with their unit, as in 'x [m]'), got {header}"
        )
    if len(set(units.values())) > 1:
        raise ValueError(f"{name}, line 1: x, y and z must share one unit, got {', '.join(units[c] for c in 'xyz')}")
    if units["x"] not in _LENGTHS:
        raise ValueError(f"{name}, line 1: lengths must be in m or mm, got {units['x']}")
    columns = {
        "time": found["time [s]"],
        "xyz": [found[c] for c in "xyz"],
        "q": [found[c] for c in ("qx", "qy", "qz", "qw")],
    }
    if "stop" in found:
        columns["stop"] = found["stop"]
    return columns, _LENGTHS[units["x"]]


def _refuse_rows(name, rows, time, p, q):
    def refuse(bad, what):
        if bad.any():
            raise ValueError(f"{name}, line {int(np.argmax(bad)) + 2}: {what}")

    refuse(~np.isfinite(rows).all(axis=1), "a number is not finite")
    refuse(np.concatenate([[False], np.diff(time) <= 0]), "time does not increase")
    refuse(np.abs(np.linalg.norm(q, axis=1) - 1) > UNIT_TOLERANCE, "the quaternion is not of length 1")
    size = np.linalg.norm(p, axis=1)
    before, after = p[:-1], p[1:]
    apart = np.linalg.norm(after - before, axis=1) > 0.9 * np.maximum(size[:-1], size[1:])
    for factor in (1000.0, 0.001):
        close = np.linalg.norm(factor * after - before, axis=1) < 0.05 * size[:-1]
        refuse(
            np.concatenate([[False], apart & close & (np.maximum(size[:-1], size[1:]) > 50)]),
            "the position jumps by a factor of 1000: another unit?",
        )
    refuse(size > 1000 * MAX_POSITION, f"the position is more than {MAX_POSITION:g} m away: another unit?")


# ---- the mounting ----------------------------------------------------------------------------------------------------


def reject_outliers(values, factor=4.0):
    """Which values to keep: those within `factor` robust standard deviations (1.4826 times the median absolute
    deviation) of the median.

    Parameters
    ----------
    values : array-like, shape (n,) or (n, d)
        With columns, a row is kept when every column keeps it.
    factor : float
        Fixed before looking at the data.

    Returns
    -------
    keep : bool array, shape (n,)
        All True when more than half of the values are equal (no scale to judge by).
    """
    values = as_finite(values, "values")
    if values.ndim not in (1, 2) or len(values) < 3:
        raise ValueError(f"values must have shape (n,) or (n, d) with n >= 3, got {values.shape}")
    factor = as_positive_number(factor, "factor")
    columns = values.reshape(len(values), -1)
    distance = np.abs(columns - np.median(columns, axis=0))
    scale = 1.4826 * np.median(distance, axis=0)
    return ((distance <= factor * scale) | (scale == 0)).all(axis=1)


def mean_pose(T):
    """Mean of poses that lie close together; rotations by the projected mean matrix; (n, 4, 4) -> (4, 4)."""
    T = as_shape(as_transforms(T, "T"), "T", "n", 4, 4)
    if not len(T):
        raise ValueError("T must hold at least one pose, got none")
    return pose(Rotation.from_matrix(T[:, :3, :3]).mean().as_matrix(), T[:, :3, 3].mean(0))


def average_stops(log, factor=4.0, share=0.5):
    """Mean reading of every stop, with outliers left out by `reject_outliers` on position and rotation vector.

    Returns
    -------
    T_WE : array, shape (m, 4, 4)
    used : array, shape (m,)
        Share of the readings used; a stop with less than `share` of them should not be trusted.
    """
    if log.stop is None:
        raise ValueError("the log has no column 'stop': there is nothing to average over")
    factor, share = as_positive_number(factor, "factor"), as_number(share, "share")
    means, used = [], []
    for number in np.unique(log.stop):
        T = log.T_WE[log.stop == number]
        center = np.argmin(np.linalg.norm(T[:, :3, 3] - np.median(T[:, :3, 3], axis=0), axis=1))
        turn = log_so3(np.swapaxes(T[center, :3, :3], -1, -2) @ T[:, :3, :3])
        keep = reject_outliers(np.concatenate([T[:, :3, 3], turn], axis=1), factor)
        if keep.mean() < share:
            keep = np.ones(len(T), bool)
        means.append(mean_pose(T[keep]))
        used.append(keep.mean())
    return np.array(means), np.array(used)


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


# ---- accuracy in motion ----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class TrackingErrors:
    """Errors sample by sample, each of shape (k,): translation mm, rotation rad, speed mm/s, angular_speed rad/s."""

    translation: np.ndarray
    rotation: np.ndarray
    speed: np.ndarray
    angular_speed: np.ndarray


def _refuse_clock(time):
    if (np.diff(time) <= 0).any():
        raise ValueError(f"time must increase, but does not after sample {int(np.argmax(np.diff(time) <= 0))}")


def speeds(time, T):
    """Speed (mm/s) and angular speed (rad/s) of a sampled motion by central differences; (k,), (k, 4, 4) -> (k,), (k,).

    Neither depends on the frame the poses are given in, as long as it rests; the angular speed not even on where the
    frame sits on the body.
    """
    time, T = as_finite(time, "time"), as_transforms(T, "T")
    if T.ndim != 3 or len(T) < 3 or time.shape != T.shape[:1]:
        raise ValueError(f"time and T must have shapes (k,) and (k, 4, 4) with k >= 3, got {time.shape} and {T.shape}")
    _refuse_clock(time)
    before, after = np.r_[0, : len(T) - 1], np.r_[1 : len(T), len(T) - 1]
    span = time[after] - time[before]
    turn = np.linalg.norm(log_so3(np.swapaxes(T[before, :3, :3], -1, -2) @ T[after, :3, :3]), axis=1)
    return np.linalg.norm(T[after, :3, 3] - T[before, :3, 3], axis=1) / span, turn / span


def tracking_errors(time, T_true, T_read, velocities=None):
    """Errors of readings against a reference motion of the same frame, at the same times.

    Parameters
    ----------
    time : array-like, shape (k,), s
    T_true, T_read : array-like, shape (k, 4, 4)
        The tracker's frame as the robot carries it and as the tracker reports it, both in the same frame.
    velocities : pair of arrays, optional
        The speeds (mm/s) and angular speeds (rad/s) the tracker reports; without them they come from differences of its
        poses.

    Returns
    -------
    TrackingErrors

    Source: report, section 3.2, figures 10 to 17.
    """
    (v, w), (rotation, translation) = speeds(time, T_true), pose_distance(T_true, T_read)
    if velocities is None:
        v_read, w_read = speeds(time, T_read)
    else:
        v_read, w_read = as_shape(velocities, "velocities", 2, len(v))
    return TrackingErrors(translation, rotation, np.abs(v_read - v), np.abs(w_read - w))


def summarize(errors):
    """Mean, RMS, median, 95 % quantile and maximum of errors, as a dictionary."""
    errors = as_finite(errors, "errors")
    if not errors.size:
        raise ValueError("errors must hold at least one number, got none")
    return {
        "mean": float(errors.mean()),
        "RMS": float(np.sqrt((errors**2).mean())),
        "median": float(np.median(errors)),
        "95 %": float(np.quantile(errors, 0.95)),
        "max": float(errors.max()),
    }


def time_offset(time, reference, delayed, max_offset=0.2):
    """How much later a signal comes than its reference (s): best match of two speed curves, to a fraction of a sample.

    Parameters
    ----------
    time : array-like, shape (k,), s, evenly spaced
    reference, delayed : array-like, shape (k,)
        Angular speeds (their norms need no calibration), the robot's and the tracker's.
    max_offset : float, s
        Offsets up to this size are tried, in both directions.

    Returns
    -------
    offset : float
        Positive when `delayed` lags. The mean squared difference over the common part is minimized; a parabola through
        the best three gives the fraction.
    """
    time, reference, delayed = as_finite(time, "time"), as_finite(reference, "reference"), as_finite(delayed, "delayed")
    if time.ndim != 1 or not time.shape == reference.shape == delayed.shape:
        raise ValueError(
            f"time, reference and delayed must have the same length, got {time.shape}, {reference.shape}, "
            f"{delayed.shape}"
        )
    if len(time) < 3:
        raise ValueError(f"at least 3 samples are needed, got {len(time)}")
    step = (time[-1] - time[0]) / (len(time) - 1)
    if not step > 0 or np.abs(np.diff(time) - step).max() > 0.01 * step:
        raise ValueError("time must increase by even steps, within 1 %")
    max_offset = as_positive_number(max_offset, "max_offset")
    most = int(round(min(max_offset / step, len(time))))
    if most < 1 or len(time) < 3 * most:
        raise ValueError(f"max_offset of {max_offset:g} s needs at least {3 * max(most, 1)} samples, got {len(time)}")
    core = reference[most:-most]
    costs = np.array([((delayed[most + s : len(time) - most + s] - core) ** 2).mean() for s in range(-most, most + 1)])
    best = int(np.clip(np.argmin(costs), 1, 2 * most - 1))
    left, middle, right = costs[best - 1 : best + 2]
    curvature = left - 2 * middle + right
    fraction = 0.5 * (left - right) / curvature if curvature > 0 else 0.0
    return float((best - most + np.clip(fraction, -1, 1)) * step)


def shift_time(time, T, offset):
    """Poses as they were `offset` seconds later: positions linear, rotations along the shortest arc; ends are held. (k,
    4, 4)."""
    time, T, offset = as_finite(time, "time"), as_transforms(T, "T"), as_number(offset, "offset")
    if T.ndim != 3 or len(T) < 2 or time.shape != T.shape[:1]:
        raise ValueError(f"time and T must have shapes (k,) and (k, 4, 4) with k >= 2, got {time.shape} and {T.shape}")
    _refuse_clock(time)
    when = np.clip(time + offset, time[0], time[-1])
    k = np.clip(np.searchsorted(time, when, side="right") - 1, 0, len(time) - 2)
    s = ((when - time[k]) / (time[k + 1] - time[k]))[:, None]
    return pose(
        Slerp(time, Rotation.from_matrix(T[:, :3, :3]))(when).as_matrix(), (1 - s) * T[k, :3, 3] + s * T[k + 1, :3, 3]
    )


def filter_positions(time, positions, std_position=3.0, std_acceleration=4000.0, gate=16.27):
    """Gate, then a Kalman filter with constant velocity: what the report's conclusion asks for, and the bridge to
    chapter 8.

    Parameters
    ----------
    time : array-like, shape (k,), s
    positions : array-like, shape (k, 3), mm
    std_position : float, mm
        Standard deviation of a good reading, per axis.
    std_acceleration : float, mm/s^2
        What the hand or robot may do to the velocity.
    gate : float
        A reading whose squared normalized innovation exceeds this is not used; 16.27 lets 99.9 % of good ones pass
        (chi-square, 3 degrees of freedom).

    Returns
    -------
    filtered : array, shape (k, 3), mm
    used : bool array, shape (k,)
    """
    time, positions = as_finite(time, "time"), as_points(positions, "positions")
    if positions.ndim != 2 or time.shape != positions.shape[:1]:
        raise ValueError(f"time and positions must have shapes (k,) and (k, 3), got {time.shape} and {positions.shape}")
    _refuse_clock(time)
    gate = as_positive_number(gate, "gate")
    if not len(time):
        raise ValueError("time and positions must hold at least one reading, got none")
    noise, drive = (
        as_positive_number(std_position, "std_position") ** 2,
        as_positive_number(std_acceleration, "std_acceleration") ** 2,
    )
    x, v = np.median(positions[:5], axis=0), np.zeros(3)
    pp, pv, vv = noise, 0.0, 1e6  # one covariance for all three axes: position, cross, velocity
    filtered, used = np.empty_like(positions), np.zeros(len(time), bool)
    last = time[0]
    for k, z in enumerate(positions):
        dt, last = time[k] - last, time[k]
        x = x + dt * v
        pp += 2 * dt * pv + dt * dt * vv + 0.25 * dt**4 * drive
        pv += dt * vv + 0.5 * dt**3 * drive
        vv += dt * dt * drive
        innovation, s = z - x, pp + noise
        if innovation @ innovation <= gate * s:
            gain_x, gain_v = pp / s, pv / s
            x, v = x + gain_x * innovation, v + gain_v * innovation
            pp, pv, vv = (1 - gain_x) * pp, (1 - gain_x) * pv, vv - gain_v * pv
            used[k] = True
        filtered[k] = x
    return filtered, used
