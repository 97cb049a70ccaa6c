"""How well a tracker follows a motion: errors by sample, time offset, a filter for its positions.

Source: report "Kalibrace a testovani systemu OTUS tracker", ZCU Plzen 2018, section 3.2.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from ..checks import as_finite, as_number, as_points, as_positive_number, as_shape, as_transforms, shown
from ..geometry.frames import pose, pose_distance
from ..geometry.lie import log_so3

# ---- errors of a motion ----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class TrackingErrors:
    """Errors of a tracker sample by sample.

    Attributes
    ----------
    translation : array, shape (k,), mm
    rotation : array, shape (k,), rad
    speed : array, shape (k,), mm/s
    angular_speed : array, shape (k,), rad/s
    """

    translation: np.ndarray
    rotation: np.ndarray
    speed: np.ndarray
    angular_speed: np.ndarray


def _refuse_clock(time):
    if (np.diff(time) <= 0).any():
        raise ValueError(f"time must increase, but does not after sample {int(np.argmax(np.diff(time) <= 0))}")


def speeds(time, T):
    """Speed and angular speed of a sampled motion by central differences.

    Neither depends on the frame the poses are given in, as long as it rests; the angular speed not even on where the
    frame sits on the body.

    Parameters
    ----------
    time : array-like, shape (k,), s
        At least three instants, increasing.
    T : array-like, shape (k, 4, 4)

    Returns
    -------
    speed, angular_speed : arrays, shape (k,), mm/s and rad/s

    Raises
    ------
    ValueError
        Wrong shapes, fewer than three samples, a time that does not increase.
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


def static_error_and_lag(speed, error):
    """What does not depend on the speed, and what a lag adds to it: error^2 = e0^2 + (lag speed)^2.

    Errors that know nothing of each other add as squares. In the squares the law is a line; it is fitted by least
    squares, and a negative intercept or slope counts as 0.

    Parameters
    ----------
    speed, error : array-like, shape (n,)
        mm/s and mm (or rad/s and rad), n >= 2 readings of a motion.

    Returns
    -------
    e0 : float
        In the unit of the error.
    lag : float, s

    Raises
    ------
    ValueError
        Wrong shapes, or speeds that are all the same.
    """
    speed, error = as_finite(speed, "speed"), as_finite(error, "error")
    if speed.ndim != 1 or speed.shape != error.shape or len(speed) < 2:
        raise ValueError(f"speed and error must have the same shape (n,), n >= 2, got {speed.shape}, {error.shape}")
    x = speed**2
    spread = x - x.mean()
    if not (spread**2).sum() > (1e-9 * np.abs(x).max()) ** 2:
        raise ValueError(f"the speeds must differ to tell a lag from what stays, got {shown(speed[0])} throughout")
    slope = (spread @ error**2) / (spread @ spread)
    return tuple(float(np.sqrt(max(v, 0.0))) for v in ((error**2).mean() - slope * x.mean(), slope))


def median_over_speed(speed, error, edges):
    """Median error between the edges of intervals of speed.

    Parameters
    ----------
    speed, error : array-like, shape (n,)
    edges : array-like, shape (m + 1,)
        Increasing, in the unit of the speed.

    Returns
    -------
    median : array, shape (m,)
        NaN where no reading falls.
    """
    speed, edges = as_shape(speed, "speed", "n"), as_shape(edges, "edges", "m + 1")
    error = as_shape(error, "error", len(speed))
    return np.array(
        [
            np.median(error[inside]) if (inside := (speed >= low) & (speed < high)).any() else np.nan
            for low, high in zip(edges[:-1], edges[1:])
        ]
    )


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

    Raises
    ------
    ValueError
        Signals of different length, an uneven clock, fewer samples than three times the largest offset.

    See Also
    --------
    labkit.estimation.clocks.clock_offset : two streams of poses of different rate, with the standard deviation
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
        raise ValueError(
            f"max_offset of {shown(max_offset)} s needs at least {3 * max(most, 1)} samples, got {len(time)}"
        )
    core = reference[most:-most]
    costs = np.array([((delayed[most + s : len(time) - most + s] - core) ** 2).mean() for s in range(-most, most + 1)])
    best = int(np.clip(np.argmin(costs), 1, 2 * most - 1))
    left, middle, right = costs[best - 1 : best + 2]
    curvature = left - 2 * middle + right
    fraction = 0.5 * (left - right) / curvature if curvature > 0 else 0.0
    return float((best - most + np.clip(fraction, -1, 1)) * step)


def shift_time(time, T, offset):
    """Poses of a motion as they were some time later: positions linear, rotations along the shortest arc.

    Parameters
    ----------
    time : array-like, shape (k,), s
        At least two instants, increasing.
    T : array-like, shape (k, 4, 4)
    offset : float, s
        Positive looks ahead; beyond the ends the end is held.

    Returns
    -------
    T : array, shape (k, 4, 4)

    Raises
    ------
    ValueError
        Wrong shapes, fewer than two samples, a time that does not increase.

    See Also
    --------
    labkit.estimation.clocks.sample_stream : at any times, gaps left open
    """
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

    Raises
    ------
    ValueError
        Wrong shapes, no reading, a time that does not increase.
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
