"""The measurements of the report, simulated: its logs were never published.

A `Tracker` reads its own pose with four kinds of error that the report describes or its numbers imply: white noise, a
systematic error that depends on the place (it repeats from run to run, which is why the six runs of appendix D agree so
much better than the poses of one run), "nonsense" readings, and latency. Everything drawn is drawn from `rng`; the
systematic error is the room's and has a seed of its own.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import count

import numpy as np

from ..checks import as_choice, as_count, as_positive_number, as_size
from ..documented import documented
from ..geometry.frames import invert, matrix_from_quaternion, moved, pose
from ..geometry.lie import exp_so3
from .arm import HOME, RAMP, TX40, forward_kinematics, measuring_poses, rotation_only, smooth_motion, tool_pose
from .log import Log
from .packet import POSITION, TIME, encode_packet, packet_from_pose
from .tracking import shift_time, speeds

RATE = 250.0  # Hz, wireless (report, section 2)
STOPS, STOP_TIME, RUNS = 21, 4.0, 6  # report, section 3.1
T_FE = pose(
    matrix_from_quaternion([0.004, 0.005, -0.002, -1.0]), [13.55, 1.82, 49.17]
)  # the report's result is the simulation's truth

# Joint positions (deg) that the motions of section 3.2 pass, and seconds for the slow one; middle and fast run through
# the same points in 1/2 and 1/4 of the time.
VIA_DEG = [
    [0, 20, 95, 0, -70, 0],
    [45, 10, 100, -12, -66, -50],
    [40, 55, 55, 16, -70, -42],
    [-6, 58, 62, 28, -78, 14],
    [-46, 45, 78, 12, -78, 48],
    [-40, 2, 116, -16, -64, 42],
    [0, -8, 112, -24, -58, 6],
    [0, 20, 95, 0, -70, 0],
]
SLOW_DURATION = 10.0
MOTIONS = {"slow": 1.0, "middle": 0.5, "fast": 0.25}
TURN_SPEED, TURN_ANGLE = 0.2, 0.5  # rad/s and rad, measurement 4; the report gives no angle


@dataclass(frozen=True)
class Tracker:
    """Error model of the tracker; standard deviations are per axis.

    Attributes
    ----------
    std_position, std_rotation, std_speed, std_gyro : float, mm, rad, mm/s, rad/s
        White noise of a reading.
    drift_position, drift_rotation : float, mm and rad
        What a stop of some seconds adds and averaging cannot remove.
    field_position, field_rotation : float, mm and rad
        Rms per axis of the systematic error over the room.
    wavelength : float, mm
        Of the ups and downs of that error.
    nonsense : float
        Probability that a burst of nonsense begins at a reading.
    burst : float
        Mean number of readings in a burst.
    jump, swing : float, mm and rad
        Typical size of nonsense.
    latency : float, s
    seed : int
        Of the systematic error, which belongs to the room.
    """

    std_position: float = 0.4
    std_rotation: float = np.deg2rad(0.05)
    std_speed: float = 12.0
    std_gyro: float = np.deg2rad(2.0)
    drift_position: float = 0.15
    drift_rotation: float = np.deg2rad(0.01)
    field_position: float = 2.0
    field_rotation: float = np.deg2rad(0.28)
    wavelength: float = 420.0
    nonsense: float = 0.0
    burst: float = 4.0
    jump: float = 350.0
    swing: float = np.deg2rad(20.0)
    latency: float = 0.0
    seed: int = 2018

    @cached_property
    def _waves(self):
        rng = np.random.default_rng(self.seed)
        direction = rng.normal(size=(12, 3))
        waves = (
            direction
            / np.linalg.norm(direction, axis=1, keepdims=True)
            * (2 * np.pi / self.wavelength)
            * rng.uniform(0.6, 1.4, (12, 1))
        )
        return waves, rng.uniform(0, 2 * np.pi, 12), rng.normal(size=(12, 6)) / np.sqrt(6.0)

    @documented
    def systematic(self, positions):
        """Systematic error at places of the room.

        Parameters
        ----------
        positions : array, shape (..., 3), mm

        Returns
        -------
        error : array, shape (..., 6)
            Rotation vector (rad) and displacement (mm).
        """
        waves, phases, amplitudes = self._waves
        error = np.sin(positions @ waves.T + phases) @ amplitudes
        return error * np.repeat([self.field_rotation, self.field_position], 3)

    @documented
    def read(self, T_BE, rng, drift=None):
        """Readings of the true poses in the room (here the robot's base), without nonsense and latency.

        Parameters
        ----------
        T_BE : array, shape (k, 4, 4)
        rng : numpy.random.Generator
        drift : array, shape (k, 6), optional
            What the stops add, as `drift` draws it.

        Returns
        -------
        T : array, shape (k, 4, 4)
        """
        error = self.systematic(T_BE[:, :3, 3]) + (0.0 if drift is None else drift)
        error[:, :3] += self.std_rotation * rng.normal(size=(len(T_BE), 3))
        error[:, 3:] += self.std_position * rng.normal(size=(len(T_BE), 3))
        return moved(T_BE, error)

    @documented
    def drift(self, stops, rng):
        """What each stop adds to all of its readings.

        Parameters
        ----------
        stops : int
            At least 0.
        rng : numpy.random.Generator

        Returns
        -------
        drift : array, shape (stops, 6)
            Rotation vector (rad) and displacement (mm).
        """
        stops = as_size(stops, "stops", at_least=0)
        return rng.normal(size=(stops, 6)) * np.repeat([self.drift_rotation, self.drift_position], 3)

    @documented
    def spoil(self, T, rng, tail=0.15):
        """Put bursts of nonsense into readings.

        Parameters
        ----------
        T : array, shape (k, 4, 4)
        rng : numpy.random.Generator
        tail : float
            Spread of the logarithm of a burst's size, whose median is `jump`.

        Returns
        -------
        T : array, shape (k, 4, 4)
        bad : bool array, shape (k,)
            Where the readings are nonsense.
        """
        starts = rng.random(len(T)) < self.nonsense
        bad = np.zeros(len(T), bool)
        T = T.copy()
        for k in np.flatnonzero(starts):
            until = k + int(rng.geometric(1 / self.burst))
            span = slice(k, min(until, len(T)))
            n = span.stop - span.start
            size = np.exp(tail * rng.normal())
            shift, turn = rng.normal(size=3), rng.normal(size=3)
            wobble = 1 + 0.1 * rng.normal(size=(n, 1))
            T[span, :3, 3] += wobble * self.jump * size * shift / np.linalg.norm(shift)
            T[span, :3, :3] = T[span, :3, :3] @ exp_so3(wobble * self.swing * size * turn / np.linalg.norm(turn))
            bad[span] = True
        return T, bad


RESTING = Tracker(nonsense=0.008)
MOVING = Tracker(nonsense=0.015, burst=2.0, latency=0.008)


@documented
def measuring_joints(seed=7):
    """The 21 joint positions of all six runs, rad; the first is where the tracker is reset.

    Parameters
    ----------
    seed : int
        At least 0.
    """
    return measuring_poses(TX40, np.random.default_rng(seed), STOPS)


@documented
def calibration_run(rng, tracker=None, joints=None, rate=5.0, lost_stop=None):
    """One run of section 3.1: the robot rests 4 s at each of the 21 poses.

    Parameters
    ----------
    rng : numpy.random.Generator
    tracker : Tracker, optional
    joints : array, shape (n, 6), optional
        In which it rests (rad); those of the report's runs without them.
    rate : float
        Readings per second that the log keeps (the stream has 250).
    lost_stop : int, optional
        A stop in which the tracker reports nonsense from beginning to end, as in the report's figure 8.

    Returns
    -------
    Log
        In the frame W of the first reading; 5 s from stop to stop.
    """
    tracker = tracker or RESTING
    joints = measuring_joints() if joints is None else joints
    as_count(len(joints), "the number of stops")
    readings = as_size(np.floor(STOP_TIME * as_positive_number(rate, "rate")), "the number of readings per stop")
    T_BE = tool_pose(TX40, joints, T_FE)
    drift = tracker.drift(len(joints), rng)
    stop = np.repeat(np.arange(len(joints)), readings)
    time = np.repeat(5.0 * np.arange(len(joints)), readings) + np.tile(np.arange(readings) / rate, len(joints))
    T = tracker.read(T_BE[stop], rng, drift[stop])
    reset = T[0].copy()
    T, _ = tracker.spoil(T, rng)
    if lost_stop is not None:
        gone = stop == lost_stop
        T[gone] = T[gone] @ pose(exp_so3(rng.normal(size=3) * tracker.swing), rng.normal(size=3) * 0.3 * tracker.jump)
    T[0] = reset
    return Log(time, invert(reset) @ T, stop)


def stop_readings(T_BE, tracker, rng):
    """One reading at each stop, in the frame W of the first.

    Parameters
    ----------
    T_BE : array, shape (n, 4, 4)
        Where the robot holds the tracker's frame E.
    tracker : Tracker
        Its white noise is that of the mean over a stop.
    rng : numpy.random.Generator

    Returns
    -------
    T_WE : array, shape (n, 4, 4)
    """
    as_count(len(T_BE), "the number of stops")
    T = tracker.read(T_BE, rng, tracker.drift(len(T_BE), rng))
    return invert(T[0]) @ T


@dataclass(frozen=True)
class Motion:
    """A simulated motion, k samples.

    The angular velocity comes from the tracker's gyroscope and stays sound while the optics report
    nonsense: an assumption of the simulation.

    Attributes
    ----------
    time : array, shape (k,), s
    q : array, shape (k, 6), rad
        Joint angles.
    T_true, T_read : arrays, shape (k, 4, 4)
        The frame E as the robot carries it and as the tracker reports it, both in W.
    v_read, w_read : arrays, shape (k,), mm/s and rad/s
        Norms of the velocities it reports.
    nonsense : bool array, shape (k,)
        True where the optical reading is nonsense.
    """

    time: np.ndarray
    q: np.ndarray
    T_true: np.ndarray
    T_read: np.ndarray
    v_read: np.ndarray
    w_read: np.ndarray
    nonsense: np.ndarray


@documented
def robot_motion(name, rate=RATE):
    """Joint angles of one of the motions of section 3.2.

    Parameters
    ----------
    name : str
        slow, middle, fast or rotation.
    rate : float
        Samples per second.

    Returns
    -------
    time : array, shape (k,), s
    q : array, shape (k, 6), rad

    Raises
    ------
    ValueError
        An unknown name.

    Source: report, section 3.2.
    """
    if name == "rotation":
        to_and_fro = 2 * TURN_ANGLE / ((1 - RAMP) * TURN_SPEED)
        return rotation_only(TX40, T_FE, HOME, np.eye(3), TURN_ANGLE, 3 * to_and_fro, rate)
    as_choice(name, "name", (*MOTIONS, "rotation"))
    return smooth_motion(np.deg2rad(VIA_DEG), SLOW_DURATION * MOTIONS[name], rate)


@documented
def simulate_motion(name, rng, tracker=None, rate=RATE):
    """A motion of section 3.2 as the robot makes it and the tracker sees it.

    Parameters
    ----------
    name : str
        slow, middle, fast or rotation.
    rng : numpy.random.Generator
    tracker : Tracker, optional
        `MOVING` unless given.
    rate : float
        Readings per second.

    Returns
    -------
    Motion
        Its reference frame W is the true first pose: no error of the reset in it.

    Raises
    ------
    ValueError
        An unknown name.

    Source: report, section 3.2.
    """
    tracker = tracker or MOVING
    time, q = robot_motion(name, rate)
    T_BE = tool_pose(TX40, q, T_FE)
    T_read, v_read, w_read, bad = follow_path(time, T_BE, tracker, rng)
    to_W = invert(T_BE[0])
    return Motion(time, q, to_W @ T_BE, to_W @ T_read, v_read, w_read, bad)


@documented
def follow_path(time, T_BE, tracker, rng):
    """What a tracker reports while it is carried along a path.

    Parameters
    ----------
    time : array, shape (k,), s
    T_BE : array, shape (k, 4, 4)
        The path of its frame E.
    tracker : Tracker
    rng : numpy.random.Generator

    Returns
    -------
    T_read : array, shape (k, 4, 4)
    v_read, w_read : arrays, shape (k,)
        Reported speed (mm/s) and angular speed (rad/s).
    nonsense : bool array, shape (k,)
        Where the optical reading is nonsense.
    """
    late = shift_time(time, T_BE, -tracker.latency)
    T_read, bad = tracker.spoil(tracker.read(late, rng), rng)
    v, w = speeds(time, late)
    v_read = np.abs(v + tracker.std_speed * rng.normal(size=len(v))) + np.where(
        bad, rng.uniform(0, 10 * tracker.jump, len(v)), 0.0
    )
    return T_read, v_read, np.abs(w + tracker.std_gyro * rng.normal(size=len(w))), bad


def motion_speeds(name):
    """Speed (mm/s) and angular speed (rad/s) of the tracker's frame along a motion."""
    time, q = robot_motion(name, 100.0)
    return speeds(time, tool_pose(TX40, q, T_FE))


def flange_poses(joints):
    """T_BF of joint positions (rad)."""
    return forward_kinematics(TX40.dh, joints)


@documented
def endless_packets(rng, nonsense=lambda: False, tracker=None):
    """Packets of a tracker that is carried through the slow motion again and again; a generator without an end.

    Parameters
    ----------
    rng : numpy.random.Generator
    nonsense : callable
        Asked at every packet whether bursts of nonsense may begin, so that it can be switched while the stream runs.
    tracker : Tracker, optional
        `MOVING` unless given.

    Yields
    ------
    packet : bytes
    """
    tracker = tracker or MOVING
    time, q = robot_motion("slow")
    T_BE = tool_pose(TX40, q, T_FE)
    T_WE = invert(T_BE[0]) @ tracker.read(T_BE, rng)
    values = packet_from_pose(T_WE[:-1], 0.0)
    left, shift = 0, np.zeros(3)
    for k in count():
        row = values[k % len(values)].copy()
        row[TIME] = k / RATE
        if left == 0 and nonsense() and rng.random() < tracker.nonsense:
            left, direction = int(rng.geometric(1 / tracker.burst)), rng.normal(size=3)
            shift = tracker.jump * direction / np.linalg.norm(direction) / 1000
        if left:
            left -= 1
            row[POSITION] += shift
        yield encode_packet(row)
