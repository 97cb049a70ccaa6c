"""Wheels other than the differential drive's: from what they do to how the body moves, the step it takes, and where
one command leads.

Body velocities are along the robot's own axes: x ahead, y to the left, omega to the left (m/s, m/s, rad/s).
Source: lecture "Lokalisierung", "Koppelnavigation fuer Radfahrzeuge (1)", which leaves both drives to the
reader: "Ackermann- und Mecanumantrieb werden analog behandelt".
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ..checks import as_points, as_positive, as_positive_number, as_shape, fit_together
from ..documented import documented
from ..geometry.planar import wrap_angle
from .odometry import sinc_slope

SAME = 1e-9  # squared misses that differ by less come from symmetric commands


def ackermann_to_twist(u, wheelbase):
    """Control (v, omega) of a car from its speed and the angle of its front wheels.

    The axes of all wheels meet in the instantaneous center of rotation, wheelbase / tan(steering) beside the middle of
    the rear axle. That middle is the robot's origin: it never slides sideways.

    Parameters
    ----------
    u : array-like, shape (..., 2)
        Speed of the middle of the rear axle (m/s), and steering angle of a front wheel in the middle (rad), positive
        to the left, less than a right angle.
    wheelbase : float
        From the rear axle to the front axle (m).

    Returns
    -------
    control : array, shape (..., 2)
        v and omega, as `odometry.step` takes them.

    Raises
    ------
    ValueError
        Wrong shapes, a wheelbase that is not positive, wheels turned by a right angle or more.

    See Also
    --------
    ackermann_jacobian : its derivative by speed and steering angle
    """
    u, wheelbase = _as_steering(u), as_positive_number(wheelbase, "wheelbase")
    return np.stack([u[..., 0], u[..., 0] * np.tan(u[..., 1]) / wheelbase], axis=-1)


def ackermann_jacobian(u, wheelbase):
    """Derivative of `ackermann_to_twist`, which has the parameters, by speed and steering angle.

    Returns
    -------
    J : array, shape (..., 2, 2)
    """
    u, wheelbase = _as_steering(u), as_positive_number(wheelbase, "wheelbase")
    J = np.zeros((*u.shape[:-1], 2, 2))
    J[..., 0, 0] = 1.0
    J[..., 1, 0] = np.tan(u[..., 1]) / wheelbase
    J[..., 1, 1] = u[..., 0] / (wheelbase * np.cos(u[..., 1]) ** 2)
    return J


def _as_steering(u):
    u = as_points(u, "u", 2)
    if (np.abs(u[..., 1]) >= np.pi / 2).any():
        raise ValueError("the steering angle must be less than a right angle")
    return u


def mecanum_matrix(half_length, half_width):
    """Rim speeds of four Mecanum wheels per body velocity: rows front left, front right, rear left, rear right.

    The rollers of a wheel stand at 45 degrees; those that touch the floor form an X, seen through the robot from above.

    Parameters
    ----------
    half_length, half_width : float
        From the robot's center to an axle and to the middle of a wheel (m).

    Returns
    -------
    M : array, shape (4, 3)
        speeds = M @ (v_x, v_y, omega). Its columns are orthogonal.

    Raises
    ------
    ValueError
        Lengths that are not positive.
    """
    lever = as_positive_number(half_length, "half_length") + as_positive_number(half_width, "half_width")
    return np.array([[1.0, -1.0, -lever], [1.0, 1.0, lever], [1.0, 1.0, -lever], [1.0, -1.0, lever]])


def mecanum_to_twist(wheels, half_length, half_width):
    """Body velocity that fits four Mecanum wheels best: least squares, as there is one wheel more than unknowns.

    Parameters
    ----------
    wheels : array-like, shape (..., 4)
        Rim speeds (m/s): front left, front right, rear left, rear right.
    half_length, half_width : float
        As for `mecanum_matrix`.

    Returns
    -------
    twist : array, shape (..., 3)
        v_x, v_y (m/s) and omega (rad/s).
    slip : array, shape (...)
        What the wheels disagree by (m/s): (front left + front right - rear left - rear right) / 4, zero while all
        rollers grip.

    Raises
    ------
    ValueError
        Wrong shapes, lengths that are not positive.
    """
    wheels = as_points(wheels, "wheels", 4)
    twist = wheels @ np.linalg.pinv(mecanum_matrix(half_length, half_width)).T
    return twist, wheels @ np.array([0.25, 0.25, -0.25, -0.25])


def step_twist(x, twist, dt):
    """Pose after a body velocity was held for dt: the exact arc, also for a robot that drives sideways.

    A velocity that turns with the robot leads along a chord, which is sin(h) / h as long as the way and looks h = omega
    dt / 2 aside; with v_y = 0 this is the model "arc" of `odometry.step`.

    Parameters
    ----------
    x : array-like, shape (..., 3)
        Pose (m, m, rad).
    twist : array-like, shape (..., 3)
        v_x, v_y (m/s) and omega (rad/s).
    dt : array-like, shape (...)
        Time step (s).

    Returns
    -------
    x : array, shape (..., 3)

    Raises
    ------
    ValueError
        Wrong shapes, numbers that are not finite, a time step that is not positive.

    See Also
    --------
    step_twist_jacobians : its derivatives
    """
    x, twist, dt = _as_step(x, twist, dt)
    half = 0.5 * twist[..., 2] * dt
    way = (np.sinc(half / np.pi) * dt)[..., None] * _turned(x[..., 2] + half, twist[..., :2])
    heading = x[..., 2] + 2 * half
    return np.concatenate([x[..., :2] + way, heading[..., None]], axis=-1)


def step_twist_jacobians(x, twist, dt):
    """Derivatives of `step_twist`, which has the parameters, by the pose and by the body velocity.

    Returns
    -------
    F_x, F_u : arrays, shape (..., 3, 3)
    """
    x, twist, dt = _as_step(x, twist, dt)
    half = 0.5 * twist[..., 2] * dt
    chord = np.sinc(half / np.pi) * dt
    along = _turned(x[..., 2] + half, twist[..., :2])
    across = np.stack([-along[..., 1], along[..., 0]], axis=-1)  # its derivative by the angle
    F_x, F_u = np.zeros((2, *chord.shape, 3, 3))
    F_x[...] = np.eye(3)
    F_x[..., :2, 2] = chord[..., None] * across
    axes = np.stack([_turned(x[..., 2] + half, axis) for axis in np.eye(2)], axis=-1)
    F_u[..., :2, :2] = chord[..., None, None] * axes
    slope = sinc_slope(half) * dt
    F_u[..., :2, 2] = 0.5 * dt[..., None] * (slope[..., None] * along + chord[..., None] * across)
    F_u[..., 2, 2] = dt
    return F_x, F_u


def _as_step(x, twist, dt):
    x, twist, dt = as_points(x, "x", 3), as_points(twist, "twist", 3), as_positive(dt, "dt")
    shape = fit_together(x=x.shape[:-1], twist=twist.shape[:-1], dt=dt.shape)
    return np.broadcast_to(x, (*shape, 3)), np.broadcast_to(twist, (*shape, 3)), np.broadcast_to(dt, shape)


def _turned(angle, v):
    """Vectors (..., 2) turned by an angle to the left."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * v[..., 0] - s * v[..., 1], s * v[..., 0] + c * v[..., 1]], axis=-1)


# --- what a drive can be told ----------------------------------------------------------------------------------------


class Drivetrain(NamedTuple):
    """What a drive can be told: `numbers` shares of its limits, each from -1 to 1, and what the body does then.

    twist: shares (..., numbers) -> v_x, v_y (m/s) and omega (rad/s), (..., 3).
    """

    numbers: int
    twist: Callable


def differential_drive(speed, turn_rate):
    """Two driven wheels, told how fast to go ahead and to turn.

    Parameters
    ----------
    speed, turn_rate : float
        The most it can do (m/s, rad/s).

    Returns
    -------
    drive : Drivetrain
    """
    return Drivetrain(2, lambda share: _ahead(speed * share[..., 0], turn_rate * share[..., 1]))


def ackermann_drive(speed, steering, wheelbase):
    """A car, told how fast to go ahead and to which side to steer.

    Parameters
    ----------
    speed, steering : float
        The most it can do (m/s, rad).
    wheelbase : float
        As for `ackermann_to_twist` (m).

    Returns
    -------
    drive : Drivetrain
    """
    limits = np.array([speed, steering])
    return Drivetrain(2, lambda share: _ahead(*np.moveaxis(ackermann_to_twist(limits * share, wheelbase), -1, 0)))


def mecanum_drive(speed, turn_rate):
    """Four Mecanum wheels, told how fast to go ahead, to the left, and to turn.

    Parameters
    ----------
    speed : float
        The most it can do ahead and, at the same time, to the left (m/s).
    turn_rate : float
        The most it can do (rad/s).

    Returns
    -------
    drive : Drivetrain
    """
    return Drivetrain(3, lambda share: np.array([speed, speed, turn_rate]) * share)


def _ahead(v, omega):
    return np.stack([v, np.zeros_like(v), omega], axis=-1)


@documented
def nearest_command(drive, spot, dt, lever):
    """The one command which, held for dt, leads from the origin nearest to a spot.

    The best of a grid over all commands, improved by least squares within the limits: what is nearest on one side may
    not be on the other. Of commands that miss by the same the gentlest is taken, and ahead before back.

    Parameters
    ----------
    drive : Drivetrain
    spot : array-like, shape (3,)
        Pose (m, m, rad).
    dt : float
        For which the command is held (s).
    lever : float
        What a heading that is off by 1 rad counts beside a place that is off (m).

    Returns
    -------
    share : array, shape (drive.numbers,)
        Between -1 and 1; `drive.twist(share)` is the body velocity.

    Raises
    ------
    ValueError
        Wrong shapes, a time or a lever that is not positive.
    """
    spot, dt, lever = as_shape(spot, "spot", 3), as_positive_number(dt, "dt"), as_positive_number(lever, "lever")

    def miss(share):
        off = step_twist(np.zeros(3), drive.twist(share), dt) - spot
        off[..., 2] = lever * wrap_angle(off[..., 2])
        return off

    axis = np.linspace(1, -1, 41 if drive.numbers == 2 else 11)
    grid = np.stack(np.meshgrid(*[axis] * drive.numbers, indexing="ij"), axis=-1).reshape(-1, drive.numbers)
    grid = grid[np.argsort(np.round((grid**2).sum(1), 9), kind="stable")]
    far = (miss(grid) ** 2).sum(1)
    start = grid[np.argmax(far <= far.min() + SAME)]
    return least_squares(miss, start, bounds=(-1, 1), method="dogbox").x
