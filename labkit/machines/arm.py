"""A serial robot in the Denavit-Hartenberg convention: forward kinematics, Jacobian, numeric inverse, smooth motions;
the Staubli TX40.

Joint angles `q` are radians with shape (..., n), lengths mm. `T_BF` is the pose of the flange F (the report's frame 6)
in the base B. Frame i sits at the end of link i and turns with joint i; the first factor of link i turns about the z
axis of frame i - 1.
Source: report "Kalibrace a testovani systemu OTUS tracker", ZCU Plzen 2018, appendices B and C; Denavit and Hartenberg
(1955), its reference [2].
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_banded

from ..checks import (
    as_count,
    as_finite,
    as_indices,
    as_number,
    as_points,
    as_positive_number,
    as_shape,
    as_size,
    as_transforms,
    fit_together,
    shown,
)
from ..documented import documented
from ..geometry.frames import _cross, invert, pose, unit_vector
from ..geometry.lie import _log_so3, exp_so3

# What the data sheet prints (appendix B): reaches in mm. R.b is axis 3 to axis 5, R.M is axis 1 to axis 5, then axis 1
# to axis 6.
REACH_FOREARM, REACH_WRIST, REACH_FLANGE = 225.0, 450.0, 515.0
# Not in the text of the report, whose drawings are lost: taken from the PyPI package robotkinematicscatalogue 1.1.2,
# which lists the TX40 with the same three link lengths and joint limits.
SHOULDER_OFFSET, BASE_HEIGHT = 35.0, 320.0
RAMP = 0.12  # share of a motion's time spent on getting up to speed, and on slowing down
IN_VAIN = 20_000  # draws of a pose without one that fits: where one in 200 does, that is as good as impossible
MOST_DRAWS = 100_000  # of a pose, all in all; some seconds
MOST_SAMPLES = 250_000  # of a motion: a thousand seconds at the 250 Hz of the report's tracker


@dataclass(frozen=True)
class Arm:
    """A serial arm.

    Attributes
    ----------
    dh : array, shape (n, 4)
        One link per row: theta offset (rad), d (mm), a (mm), alpha (rad).
    q_min, q_max : arrays, shape (n,), rad
        Joint limits.
    speed : array, shape (n,), rad/s
        Joint speed limits.
    """

    name: str
    dh: np.ndarray
    q_min: np.ndarray
    q_max: np.ndarray
    speed: np.ndarray


def dh_matrix(theta, d, a, alpha):
    """Transform from frame i to frame i - 1 of a link in the classic Denavit-Hartenberg convention.

    Rot(z, theta) Trans(z, d) Trans(x, a) Rot(x, alpha), all arguments broadcast.

    Parameters
    ----------
    theta, alpha : array-like, rad
    d, a : array-like, mm

    Returns
    -------
    T : array, shape (..., 4, 4)

    Source: report, appendix C (reference [2]).
    """
    theta, d, a, alpha = map(as_finite, (theta, d, a, alpha), ("theta", "d", "a", "alpha"))
    return _dh_matrix(theta, d, a, alpha, fit_together(theta=theta.shape, d=d.shape, a=a.shape, alpha=alpha.shape))


def _dh_matrix(theta, d, a, alpha, shape):
    T = np.zeros((*shape, 4, 4))
    c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    T[..., 0, 0], T[..., 0, 1], T[..., 0, 2], T[..., 0, 3] = c, -s * ca, s * sa, a * c
    T[..., 1, 0], T[..., 1, 1], T[..., 1, 2], T[..., 1, 3] = s, c * ca, -c * sa, a * s
    T[..., 2, 1], T[..., 2, 2], T[..., 2, 3] = sa, ca, d
    T[..., 3, 3] = 1.0
    return T


def link_frames(dh, q):
    """Poses of the base and of every link.

    Parameters
    ----------
    dh : array-like, shape (n, 4)
        Denavit-Hartenberg table: theta, d, a, alpha (rad, mm).
    q : array-like, shape (..., n), rad

    Returns
    -------
    frames : array, shape (..., n + 1, 4, 4)
        In B; the first is the identity, the last is the flange.

    Raises
    ------
    ValueError
        Where q has not one angle per joint.
    """
    dh, q = _as_dh(dh), as_finite(q, "q")
    if q.ndim < 1 or q.shape[-1] != len(dh):
        raise ValueError(f"q must have shape (..., {len(dh)}), one angle per joint, got {q.shape}")
    return _link_frames(dh, q)


def _link_frames(dh, q):
    links = _dh_matrix(q + dh[:, 0], *dh.T[1:], q.shape)
    frames = np.empty((*q.shape[:-1], len(dh) + 1, 4, 4))
    frames[..., 0, :, :] = np.eye(4)
    for i in range(len(dh)):
        frames[..., i + 1, :, :] = frames[..., i, :, :] @ links[..., i, :, :]
    return frames


def forward_kinematics(dh, q):
    """Pose of the flange: the product of all link transforms.

    Parameters
    ----------
    dh : array-like, shape (n, 4)
        One link per row: theta offset (rad), d (mm), a (mm), alpha (rad).
    q : array-like, shape (..., n)
        Joint angles, rad.

    Returns
    -------
    T_BF : array, shape (..., 4, 4)

    Source: report, section 3 ("T_6^b ... lze ji pocitat standardnim postupem") and appendix C.
    """
    return link_frames(dh, q)[..., -1, :, :]


def jacobian(dh, q):
    """Geometric Jacobian: joint rates to angular velocity and velocity of the flange, both in B.

    Parameters
    ----------
    dh : array-like, shape (n, 4)
        As in `link_frames`.
    q : array-like, shape (..., n), rad

    Returns
    -------
    J : array, shape (..., 6, n)
        Rows 0-2 angular velocity (rad/s per rad/s), rows 3-5 velocity (mm/s per rad/s).
    """
    return _jacobian(link_frames(dh, q))


def _jacobian(frames):
    axes = frames[..., :-1, :3, 2]
    arms = frames[..., -1:, :3, 3] - frames[..., :-1, :3, 3]
    return np.swapaxes(np.concatenate([axes, _cross(axes, arms)], axis=-1), -1, -2)


@documented
def inverse_kinematics(robot, T_BF, start, iterations=60, tolerance=1e-9):
    """Joint angles that reach a pose, by damped least squares from `start`, kept inside the joint limits.

    Parameters
    ----------
    robot : Arm
    T_BF : array-like, shape (..., 4, 4)
    start : array-like, shape (n,) or (..., n)
        Where the search begins. A start near the solution picks the branch (elbow, wrist); one start for a whole path
        keeps the path smooth.
    iterations : int
        The most steps taken.
    tolerance : float
        The search stops when every pose is closer than this, in rad and in 200 mm.

    Returns
    -------
    q : array, shape (..., n)
    reached : bool array, shape (...)
        False where the pose is out of reach, out of the limits, or the search got stuck; q is then the best it found.

    Raises
    ------
    ValueError
        A number of starts that fits neither one nor each pose.
    """
    T_BF = as_transforms(T_BF, "T_BF")
    start, iterations = as_points(start, "start", dim=len(robot.dh)), as_count(iterations, "iterations")
    if fit_together(T_BF=T_BF.shape[:-2], start=start.shape[:-1]) != T_BF.shape[:-2]:
        raise ValueError(f"start must be one for all or one per pose, got {start.shape} for T_BF {T_BF.shape}")
    tolerance = as_positive_number(tolerance, "tolerance")
    q, dh = np.broadcast_to(start, (*T_BF.shape[:-2], len(robot.dh))).copy(), _as_dh(robot.dh)
    scale = np.repeat([1.0, 1 / 200], 3)  # a turn of 1 rad counts as much as 200 mm
    best, best_size = q, np.full(q.shape[:-1], np.inf)
    damping = 1e-3
    for _ in range(iterations):
        frames = _link_frames(dh, q)
        error = _pose_error(frames[..., -1, :, :], T_BF) * scale
        size = np.linalg.norm(error, axis=-1)
        better = size < best_size
        best, best_size = np.where(better[..., None], q, best), np.minimum(size, best_size)
        if (best_size < tolerance).all():
            break
        J = _jacobian(frames) * scale[:, None]
        weight = np.minimum(damping, size**2) + 1e-12
        normal = np.swapaxes(J, -1, -2) @ J + weight[..., None, None] * np.eye(len(dh))
        step = np.linalg.solve(normal, np.swapaxes(J, -1, -2) @ error[..., None])[..., 0]
        step *= np.minimum(1.0, 0.5 / np.maximum(np.abs(step).max(-1, keepdims=True), 1e-300))
        q = np.clip(q + step, robot.q_min, robot.q_max)
    return best, best_size < max(1e-6, tolerance)


def pose_error(T, T_goal):
    """What is missing from one pose to another, in the base.

    Parameters
    ----------
    T, T_goal : array-like, shape (..., 4, 4)

    Returns
    -------
    error : array, shape (..., 6)
        Rotation vector (rad), displacement (mm).
    """
    T, T_goal = as_transforms(T, "T"), as_transforms(T_goal, "T_goal")
    fit_together(T=T.shape[:-2], T_goal=T_goal.shape[:-2])
    return _pose_error(T, T_goal)


def _pose_error(T, T_goal):
    turn = T_goal[..., :3, :3] @ np.swapaxes(T[..., :3, :3], -1, -2)
    return np.concatenate([_log_so3(turn), T_goal[..., :3, 3] - T[..., :3, 3]], axis=-1)


@documented
def within_limits(robot, q):
    """Whether all joints keep their limits.

    Parameters
    ----------
    robot : Arm
    q : array-like, shape (..., n), rad

    Returns
    -------
    within : bool array, shape (...)
    """
    q = as_points(q, "q", dim=len(robot.dh))
    return ((q >= robot.q_min) & (q <= robot.q_max)).all(-1)


@documented
def measuring_poses(robot, rng, count=21, center=None, spread=(0.5, 0.35, 0.35, 0.9, 0.7, 0.9), box=None, facing=0.3):
    """Joint angles of reachable measuring poses about a center pose, the first being the center itself.

    Parameters
    ----------
    robot : Arm
    rng : numpy.random.Generator
    count : int
    center : array-like, shape (n,), rad
        `HOME` unless given.
    spread : array-like, shape (n,), rad
        Joint angles are drawn uniformly this far on either side.
    box : array-like, shape (2, 3), mm
        Two corners in B between which the flange must lie.
    facing : float
        Least component along z of B of the flange's z axis, which must point to the base stations overhead.

    Returns
    -------
    q : array, shape (count, n), rad

    Raises
    ------
    ValueError
        A box that is none, or too few poses found in it.
    """
    center = HOME if center is None else as_points(center, "center", dim=len(robot.dh))
    box = np.array([[-600.0] * 3, [600.0, 600.0, 1000.0]]) if box is None else as_finite(box, "box")
    if box.shape != (2, 3):
        raise ValueError(f"box must have shape (2, 3), two corners, got {box.shape}")
    spread, count = as_shape(spread, "spread", len(robot.dh)), as_size(count, "count")
    found, tries, last = [np.array(center)], 0, 0
    while len(found) < count:
        tries += 1
        if tries > min(200 * count, MOST_DRAWS, last + IN_VAIN):
            raise ValueError(
                f"only {len(found)} of {count} measuring poses were found in {tries - 1} draws: widen spread or "
                "box, or ask for fewer"
            )
        q = center + spread * rng.uniform(-1, 1, len(robot.dh))
        T = forward_kinematics(robot.dh, q)
        inside = (T[:3, 3] >= box[0]).all() and (T[:3, 3] <= box[1]).all()
        if within_limits(robot, q) and inside and T[2, 2] >= facing:
            found.append(q)
            last = tries
    return np.array(found)


def smooth_motion(via, duration, rate):
    """A motion through joint positions that starts and ends at rest and has continuous acceleration.

    Parameters
    ----------
    via : array-like, shape (m, n)
        Joint positions to pass, rad.
    duration, rate : float
        s and samples/s.

    Returns
    -------
    time : array, shape (k,), s
    q : array, shape (k, n), rad

    Raises
    ------
    ValueError
        Fewer than two joint positions.

    A natural-looking stand-in for "prujezd nekolika body s polynomialnim napojovanim" (report, section 3.2): a cubic
    spline through the points, run along by a polynomial of degree 5 at both ends.
    """
    via = as_finite(via, "via")
    duration, rate = as_positive_number(duration, "duration"), as_positive_number(rate, "rate")
    if via.ndim != 2 or len(via) < 2:
        raise ValueError(f"via must hold at least 2 joint positions, shape (m, n), got {via.shape}")
    time = _samples(duration, rate)
    return time, _spline(via, _ramp(time / time[-1]) * (len(via) - 1))


def _spline(values, at):
    """The cubic spline through values (m, n) at 0, 1, ..., m - 1, whose outer two pieces are one cubic ("not a knot").

    As `scipy.interpolate.CubicSpline`, which a kernel that moves the arm need not load: 14 MB with all it imports.
    """
    rise = np.diff(values, axis=0)
    if len(rise) < 3:  # one line, one parabola
        slope = rise[[0, 0]] if len(rise) == 1 else np.array([[3, -1], [1, 1], [-1, 3]]) @ rise / 2
    else:  # equal second derivatives where pieces meet: s[i-1] + 4 s[i] + s[i+1] = 3 (rise[i-1] + rise[i])
        bands = np.tile([[1.0], [4.0], [1.0]], len(values))
        bands[0, 1], bands[1, [0, -1]], bands[2, -2] = 2, 1, 2
        ends = (5 * rise[[0, -1]] + rise[[1, -2]]) / 2  # equal third derivatives beside the ends
        slope = solve_banded((1, 1), bands, np.concatenate([ends[:1], 3 * (rise[:-1] + rise[1:]), ends[1:]]))
    i = np.clip(at.astype(int), 0, len(rise) - 1)
    u, rise, left, right = (at - i)[:, None], rise[i], slope[i], slope[i + 1]
    return values[i] + u * (left + u * (3 * rise - 2 * left - right + u * (left + right - 2 * rise)))


def _samples(duration, rate):
    """Sampling times 0, 1 / rate, ... up to the duration (s)."""
    count = duration * rate
    if not 0.5 < count <= MOST_SAMPLES:
        raise ValueError(
            f"duration and rate must give from 1 to {MOST_SAMPLES} steps, got {shown(duration)} s at "
            f"{shown(rate)} samples/s"
        )
    return np.arange(round(count) + 1) / rate


def _ramp(s, ends=RAMP):
    """Path parameter 0..1 over normalized time 0..1: constant speed, with smooth starts and stops over the share
    `ends`."""
    u = np.minimum(np.minimum(s, 1 - s) / ends, 1.0)
    eased = ends * (u**4 * (2.5 - 3 * u + u**2))  # integral of the quintic smoothstep 10u^3 - 15u^4 + 6u^5
    flat = np.maximum(np.minimum(s, 1 - s) - ends, 0.0)
    half = eased + flat
    total = 2 * (0.5 * ends + 0.5 - ends)
    return np.where(s <= 0.5, half, total - half) / total


def joint_speeds(time, q):
    """Joint speeds by central differences.

    Parameters
    ----------
    time : array-like, shape (k,), s
        Increasing.
    q : array-like, shape (k, n), rad

    Returns
    -------
    speeds : array, shape (k, n), rad/s

    Raises
    ------
    ValueError
        Wrong shapes, fewer than two instants, a time that does not increase.
    """
    time = as_shape(time, "time", "k")
    if len(time) < 2 or (np.diff(time) <= 0).any():
        raise ValueError("time must hold at least two instants and increase")
    return np.gradient(as_shape(q, "q", len(time), "n"), time, axis=0)


def _as_dh(dh):
    dh = as_finite(dh, "dh")
    if dh.ndim != 2 or dh.shape[1] != 4:
        raise ValueError(f"dh must have shape (n, 4): theta offset, d, a, alpha of each link, got {dh.shape}")
    return dh


def _tx40():
    """The TX40, its lengths derived from the printed reaches: forearm = R.b, upper arm = R.M - R.b, wrist to flange =
    515 - R.M.

    The last one agrees with "d_6 = 0.065" (m) in appendix C. The shoulder offset and the height of axis 2 come from
    elsewhere (see the top of this module); the height cancels from every difference of poses. The zero position, arm
    upright, is the manufacturer's. Joint limits: appendix B.
    Joint speeds: the text of appendix B is garbled at axes 1 to 3 ("EEE", "175", "595" deg/s). All three are held to
    175 deg/s here, the smallest reading: a motion that keeps it keeps every plausible one.
    """
    upper, wrist = REACH_WRIST - REACH_FOREARM, REACH_FLANGE - REACH_WRIST
    quarter = np.pi / 2
    dh = np.array(
        [
            [0.0, BASE_HEIGHT, 0.0, -quarter],
            [-quarter, SHOULDER_OFFSET, upper, 0.0],
            [quarter, 0.0, 0.0, quarter],
            [0.0, REACH_FOREARM, 0.0, -quarter],
            [0.0, 0.0, 0.0, quarter],
            [0.0, wrist, 0.0, 0.0],
        ]
    )
    q_max = np.deg2rad([180.0, 125.0, 138.0, 270.0, 133.5, 270.0])
    q_min = np.deg2rad([-180.0, -125.0, -138.0, -270.0, -120.0, -270.0])
    speed = np.deg2rad([175.0, 175.0, 175.0, 1035.0, 1135.0, 1575.0])
    return Arm("Staubli TX40", dh, q_min, q_max, speed)


TX40 = _tx40()
HOME = np.deg2rad(
    [0.0, 20.0, 95.0, 0.0, -70.0, 0.0]
)  # arm bent, flange above the forearm: the pose in which the tracker is referenced


@documented
def wrist_reach(robot, q):
    """Distances of the wrist center (axis 5) as the data sheet names them.

    Parameters
    ----------
    robot : Arm
    q : array-like, shape (..., n), rad

    Returns
    -------
    in_plane, shoulder, elbow : arrays, shape (...), mm
        Horizontal distance from axis 1 measured in the plane of the arm (without the shoulder offset), distance from
        axis 2, distance from axis 3.
    """
    frames = link_frames(robot.dh, q)
    wrist, elbow = frames[..., 4, :3, 3], frames[..., 2, :3, 3]
    axis_2 = frames[..., 1, :3, 2]
    shoulder = frames[..., 1, :3, 3] + robot.dh[1, 1] * axis_2
    in_plane = np.linalg.norm((wrist - shoulder)[..., :2], axis=-1)
    return in_plane, np.linalg.norm(wrist - shoulder, axis=-1), np.linalg.norm(wrist - elbow, axis=-1)


@documented
def tool_pose(robot, q, T_FE):
    """Pose in B of a frame E mounted on the flange.

    Parameters
    ----------
    robot : Arm
    q : array-like, shape (..., n), rad
    T_FE : array-like, shape (4, 4)

    Returns
    -------
    T_BE : array, shape (..., 4, 4)
    """
    T_BF, T_FE = forward_kinematics(robot.dh, q), as_transforms(T_FE, "T_FE")
    fit_together(q=T_BF.shape[:-2], T_FE=T_FE.shape[:-2])
    return T_BF @ T_FE


@documented
def rotation_only(robot, T_FE, start, axes, angle, duration, rate):
    """A motion that turns the mounted frame E to and fro about its own axes and leaves its origin where it is.

    Parameters
    ----------
    robot : Arm
    axes : array-like, shape (m, 3)
        Directions in E at `start`, one after the other, each with an equal share of `duration`.
    angle : float, rad
        How far it turns each time.

    Returns
    -------
    time : array, shape (k,), s
    q : array, shape (k, n), rad

    Raises
    ------
    ValueError
        No axis, or one that is zero; a pose of the motion that cannot be reached.

    Source: report, section 3.2, measurement 4.
    """
    T_FE, start = as_shape(as_transforms(T_FE, "T_FE"), "T_FE", 4, 4), as_shape(start, "start", len(robot.dh))
    axes, angle = as_shape(axes, "axes", "m", 3), as_number(angle, "angle")
    if not len(axes) or not np.linalg.norm(axes, axis=-1).all():
        raise ValueError("axes must hold at least one direction, and none may be zero")
    duration, rate = as_positive_number(duration, "duration"), as_positive_number(rate, "rate")
    time = _samples(duration, rate)
    share = np.minimum(time / duration * len(axes), len(axes) - 1e-9)
    k, s = share.astype(int), share - share.astype(int)
    swing = _ramp(np.where(s < 0.5, 2 * s, 2 - 2 * s))
    unit = unit_vector(axes)
    T_BE = tool_pose(robot, start, T_FE)
    R = T_BE[:3, :3] @ exp_so3(angle * swing[:, None] * unit[k])
    T_BF = pose(R, np.broadcast_to(T_BE[:3, 3], (len(time), 3))) @ invert(T_FE)
    q, reached = inverse_kinematics(robot, T_BF, start)
    if not reached.all():
        raise ValueError(
            f"the motion cannot be reached: {np.count_nonzero(~reached)} of {len(time)} poses, first at "
            f"{shown(time[~reached][0], '.2f')} s"
        )
    return time, q


@documented
def reach_position(robot, position, start, joints=(0, 1, 2), iterations=40):
    """Joint angles that bring the flange to a position with some joints alone; the others stay as in `start`.

    Parameters
    ----------
    robot : Arm
    position : array-like, shape (3,), mm, in B
    start : array-like, shape (n,), rad
    joints : array of int, shape (m,)
        Which of them move.
    iterations : int

    Returns
    -------
    q : array, shape (n,)
        Inside the joint limits. Out of reach, the flange stops as close as damped least squares brings it.

    Raises
    ------
    ValueError
        A joint that the robot has not, or none.
    """
    position, q = as_shape(position, "position", 3), np.array(as_shape(start, "start", len(robot.dh)))
    joints = as_indices(joints, "joints", below=len(q))
    if not len(joints):
        raise ValueError("joints must name at least one, got none")
    best, best_size = q.copy(), np.inf
    for _ in range(as_size(iterations, "iterations", at_least=0)):
        frames = link_frames(robot.dh, q)
        gap = position - frames[-1, :3, 3]
        size = float(np.linalg.norm(gap))
        if size < best_size:
            best, best_size = q.copy(), size
        if size < 1e-6:
            break
        J = _jacobian(frames)[3:, joints]
        step = np.linalg.solve(J.T @ J + (1e-6 + min(size, 100.0) * 10) * np.eye(len(joints)), J.T @ gap)
        q[joints] += step * min(1.0, 0.3 / max(np.abs(step).max(), 1e-12))
        q = np.clip(q, robot.q_min, robot.q_max)
    return best


@documented
def arm_points(robot, q):
    """Where to draw the arm: base, axis 2, shoulder, elbow, wrist, flange.

    Parameters
    ----------
    robot : Arm
    q : array-like, shape (n,), rad

    Returns
    -------
    points : array, shape (6, 3), mm
    """
    frames = link_frames(robot.dh, as_shape(q, "q", len(robot.dh)))
    shoulder = frames[1, :3, 3] + robot.dh[1, 1] * frames[1, :3, 2]
    return np.array(
        [frames[0, :3, 3], frames[1, :3, 3], shoulder, frames[2, :3, 3], frames[4, :3, 3], frames[6, :3, 3]]
    )
