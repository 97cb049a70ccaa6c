"""How well a robot arrives: accuracy and repeatability of poses and of paths, and a simulated robot to measure them on.

*Accuracy* compares where a robot was sent with where it arrives on average, *repeatability* only its arrivals with one
another: the second needs no base, and says nothing about the first. Lengths mm, times s.

Source: thesis "Optimierung bei der Kalibrierung von Sensor-Roboter-Systemen", HAW Hamburg 2019, sections 2.1.1 and
2.1.2, which name the kinds and their causes; the numbers are those of ISO 9283 (AP, RP, AT, RT).
"""

from dataclasses import dataclass

import numpy as np

from ..calibration.planning import DOWN, poses_that_see
from ..checks import as_count, as_nonnegative, as_positive_number, as_shape, as_size, as_transforms, fit_together
from ..documented import documented
from ..geometry.lie import exp_so3


def position_accuracy(command, reached):
    """Distance from where a robot was sent to the mean of where it arrived.

    Parameters
    ----------
    command : array-like, shape (d,), mm
    reached : array-like, shape (n, d), mm

    Returns
    -------
    accuracy : float, mm

    Raises
    ------
    ValueError
        No arrival, or another dimension.

    Source: thesis, section 2.1.1; AP of ISO 9283.
    """
    reached = _arrivals(reached, 1)
    return float(np.linalg.norm(reached.mean(0) - as_shape(command, "command", reached.shape[1])))


def repeatability(reached):
    """Mean distance of arrivals from their mean, plus three standard deviations of that distance.

    Parameters
    ----------
    reached : array-like, shape (n, d), n >= 2, mm

    Returns
    -------
    repeatability : float, mm

    Raises
    ------
    ValueError
        Fewer than two arrivals.

    Source: thesis, section 2.1.1; RP of ISO 9283, with n - 1 below the root.
    """
    reached = _arrivals(reached, 2)
    distances = np.linalg.norm(reached - reached.mean(0), axis=1)
    return float(distances.mean() + 3 * distances.std(ddof=1))


def _arrivals(reached, at_least):
    reached = as_shape(reached, "reached", "n", "d")
    if len(reached) < at_least:
        raise ValueError(f"reached must hold at least {at_least} arrivals, got {len(reached)}")
    return reached


def path_accuracy(command, paths):
    """Largest distance from a commanded path to the mean of the paths that were driven, instant by instant.

    Parameters
    ----------
    command : array-like, shape (k, d), mm
    paths : array-like, shape (n, k, d), mm

    Returns
    -------
    accuracy : float, mm

    Source: AT of ISO 9283, here at equal instants, so that a delay counts as an error.
    """
    command = as_shape(command, "command", "k", "d")
    paths = as_shape(paths, "paths", "n", *command.shape)
    as_count(len(paths), "the number of paths")
    return float(np.linalg.norm(paths.mean(0) - command, axis=1).max())


def path_repeatability(paths):
    """Largest `repeatability` among the instants of paths driven again and again.

    Parameters
    ----------
    paths : array-like, shape (n, k, d), n >= 2, mm

    Returns
    -------
    repeatability : float, mm

    Source: RT of ISO 9283, at equal instants.
    """
    paths = as_shape(paths, "paths", "n", "k", "d")
    as_count(paths.shape[1], "the number of instants")
    return max(repeatability(paths[:, k]) for k in range(paths.shape[1]))


@dataclass(frozen=True, eq=False)
class RobotErrors:
    """What is wrong with a robot, in the neighborhood of one pose.

    Attributes
    ----------
    offset : array, shape (d,)
        Always the same: wrong lengths and zeros of its joints, temperature, load (mm).
    backlash : float
        How far it stops short on the side it came from: play in joints and gears (mm).
    std : float
        Noise of each coordinate (mm).
    lag : float
        Delay of its controllers (s).
    """

    offset: np.ndarray
    backlash: float = 0.0
    std: float = 0.0
    lag: float = 0.0


@documented
def arrive(command, directions, errors, rng):
    """Where a robot stops that comes from given directions.

    Parameters
    ----------
    command : array-like, shape (d,), mm
    directions : array-like, shape (n, d)
        Unit vectors of its motion just before it stops.
    errors : RobotErrors
    rng : numpy.random.Generator

    Returns
    -------
    reached : array, shape (n, d), mm
    """
    command = as_shape(command, "command", "d")
    directions = as_shape(directions, "directions", "n", len(command))
    noise = as_nonnegative(errors.std, "std") * rng.normal(size=directions.shape)
    return command + errors.offset - errors.backlash * directions + noise


@documented
def drive(command, dt, errors, rng, n=1):
    """Paths of a robot whose controllers follow with a delay: a first-order lag, at rest at the start.

    Parameters
    ----------
    command : array-like, shape (k, d), mm
        Where it should be at the instants 0, dt, 2 dt, ...
    dt : float, s
    errors : RobotErrors
    rng : numpy.random.Generator
    n : int
        How often it drives.

    Returns
    -------
    paths : array, shape (n, k, d), mm
    """
    command, dt, n = as_shape(command, "command", "k", "d"), as_positive_number(dt, "dt"), as_size(n, "n")
    fit_together(command=command.shape[1:], offset=np.shape(errors.offset))
    share = 1.0 if errors.lag == 0 else -np.expm1(-dt / errors.lag)
    path = command.copy()
    for k in range(1, len(command)):
        path[k] = path[k - 1] + share * (command[k] - path[k - 1])
    return path + errors.offset + errors.std * rng.normal(size=(n, *command.shape))


@documented
def corner(speed, length=60.0, instants=61):
    """A path around a right angle at constant speed, each leg of one length.

    Parameters
    ----------
    speed : float, mm/s
    length : float, mm
    instants : int

    Returns
    -------
    path : array, shape (instants, 2), mm
        From (-length, 0) over (0, 0) to (0, length).
    dt : float, s
    """
    s = np.linspace(-length, length, as_size(instants, "instants", at_least=3))
    path = np.column_stack([np.minimum(s, 0.0), np.maximum(s, 0.0)])
    return path, (s[1] - s[0]) / as_positive_number(speed, "speed")


@documented
def looking_down_at(marks, T_FS, turns, height=240.0):
    """Flange poses from which a scanner sees marks straight below it, the flange turned about the vertical in between.

    Parameters
    ----------
    marks : array-like, shape (n, 3), mm
        In the base.
    T_FS : array-like, shape (4, 4)
        Where the scanner really sits.
    turns : array-like, shape (n,), rad
    height : float, mm

    Returns
    -------
    T_BF : array, shape (n, 4, 4)
    x_S : array, shape (n, 3), mm
        The marks as the scanner sees them.
    """
    marks, T_FS = as_shape(marks, "marks", "n", 3), as_shape(as_transforms(T_FS, "T_FS"), "T_FS", 4, 4)
    turns = as_shape(turns, "turns", len(marks))
    x_S = np.tile([0.0, 0.0, float(height)], (len(marks), 1))
    R_BF = exp_so3(turns[:, None] * [0.0, 0.0, 1.0]) @ DOWN @ T_FS[:3, :3].T
    return poses_that_see(T_FS, marks, R_BF, x_S), x_S
