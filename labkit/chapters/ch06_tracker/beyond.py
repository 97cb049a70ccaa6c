"""Chapter 6, its parts beyond the core path: base stations, errors over speed, the whole cell; items of its chapter."""

import functools
import itertools

import numpy as np
from scipy.spatial.transform import Rotation

from ...documents.report.printed import COLUMNS, table_d
from ...estimation.optimization import levenberg_marquardt
from ...exercises import metrics
from ...exercises.draws import scaled
from ...exercises.engine import Exercise, Prediction
from ...exercises.outcome import Mistake
from ...exercises.value import Value
from ...geometry.frames import invert, matrix_from_quaternion, pose, quaternion_from_matrix, unit_vector
from ...geometry.lie import exp_so3, skew
from ...geometry.propagation import error_budget, point_covariance
from ...machines import cell, simulation, stations
from ...machines.arm import TX40, tool_pose
from ...machines.log import mean_quaternion
from ...machines.mounting import calibrate_mounting
from ...machines.tracking import static_error_and_lag

# The mean of a stop ----------------------------------------------------------------------------------------------------------


def readings_of_a_stop(rng, part):
    """Quaternions of both signs that scatter by two degrees about one whose given part is 0: its sign is noise.

    Where that is the scalar part, it is half a turn about one of the axes, at which angles about axes jump as well.
    """
    n, center = int(rng.integers(6, 16)), rng.normal(size=4) if part < 3 else np.eye(4)[rng.integers(3)]
    center[part] = 0.0
    R = matrix_from_quaternion(center / np.linalg.norm(center))
    while True:
        q = quaternion_from_matrix(R @ exp_so3(0.035 * rng.normal(size=(n, 3))))
        same = q * np.where(q @ q[0] < 0, -1.0, 1.0)[:, None]
        if 2 <= (same[:, part] < 0).sum() <= n - 2:
            break
    signs = rng.permutation(np.r_[1, 1, 1, -1, -1, rng.choice([-1, 1], n - 5)])
    return (same * signs[:, None],)


def so_many_readings(rng, n):
    """So many quaternions of either sign that scatter by a degree."""
    q = quaternion_from_matrix(exp_so3(rng.normal(size=3)) @ exp_so3(0.02 * rng.normal(size=(n, 3))))
    return (q * np.where(np.arange(n) % 2, -1.0, 1.0)[:, None],)


def readings_of_balanced_parts(rng):
    """Such quaternions about one with parts a, -a, b and -b, as many of either sign: which part is the largest, the sign
    of their sum, and on which side of their plain mean they lie, is noise.
    """
    while True:
        a, b = rng.uniform(0.3, 0.9), rng.uniform(0.1, 0.25)
        center = rng.permutation([a, -a, b, -b])
        R = matrix_from_quaternion(center / np.linalg.norm(center))
        q = quaternion_from_matrix(R @ exp_so3(0.035 * rng.normal(size=(2 * int(rng.integers(4, 8)), 3))))
        same = q * np.where(q @ q[0] < 0, -1.0, 1.0)[:, None]
        q = same * rng.permutation(np.resize([1.0, -1.0], len(q)))[:, None]
        rules = same.sum(axis=1), _largest_part(same), same @ q.mean(axis=0)
        if all(2 <= (noise < 0).sum() <= len(q) - 2 for noise in rules):
            return (q,)


def _largest_part(q):
    """The part of each quaternion that is largest by amount, with its sign."""
    return np.take_along_axis(q, np.abs(q).argmax(axis=1)[:, None], axis=1)[:, 0]


def _unit_mean(signs):
    def variant(q):
        mean = (q * signs(q)[:, None]).mean(axis=0)
        return mean / np.linalg.norm(mean)

    return variant


def _beside_the_neighbor(q):
    """Each reading made alike with the one before, as that one came."""
    signs = np.append(1.0, np.where((q[1:] * q[:-1]).sum(axis=1) > 0, 1.0, -1.0))
    mean = (signs[:, None] * q).mean(axis=0)
    return mean / np.linalg.norm(mean)


STOPS = [
    Exercise(
        "mean_quaternion",
        reference=mean_quaternion,
        draw=(
            *(functools.partial(readings_of_a_stop, part=part) for part in (3, 0, 1, 2)),
            readings_of_balanced_parts,
        ),
        metric=metrics.UpToSign(2e-4),
        noisy=tuple(
            (functools.partial(so_many_readings, n=n), metrics.UpToSign(tol), f"right, but not for {words}:")
            for n, tol, words in (
                (1, 1e-8, "a single reading, which is its own mean to all digits"),
                (2, 2e-4, "two readings"),
                (4, 2e-4, "four readings, as many as a quaternion has parts"),
                (300, 2e-4, "300 readings"),
            )
        ),
        hints=(
            "q and -q are one rotation: whatever you average must be the same for both.",
            "q q^T is. The unit vector with the largest sum of (q_i . mean)^2 is an eigenvector of sum q q^T.",
            "`return np.linalg.eigh(q.T @ q)[1][:, -1]`",
        ),
        mistakes=[
            Mistake(
                _unit_mean(lambda q: np.ones(len(q))),
                "q and -q are one rotation, but their mean is 0. The readings come in both signs: what you average must not depend on it.",
                id="mean_quaternion-signs",
            ),
            Mistake(
                lambda q: Rotation.from_euler("xyz", Rotation.from_quat(q).as_euler("xyz").mean(axis=0)).as_quat(),
                "You averaged angles about three axes. They jump by a whole turn where one passes 180 deg, and near the pole small turns move them "
                "far: average the quaternions, signs aside.",
                id="mean_quaternion-euler",
            ),
            Mistake(
                lambda q: Rotation.from_rotvec(Rotation.from_quat(q).as_rotvec().mean(axis=0)).as_quat(),
                "You averaged rotation vectors. Near a half turn two that are nearly one rotation point in opposite directions; and the mean is not "
                "quite that of the rotations elsewhere.",
                id="mean_quaternion-vectors",
            ),
            Mistake(
                _beside_the_neighbor,
                "Each reading is turned to the side of the one before, as that one came. If that was turned itself, this one lands on the "
                "other side: compare all with one reading.",
                id="mean_quaternion-neighbor",
            ),
            Mistake(
                lambda q: q.mean(axis=0),
                "The readings come in both signs, which cancel; and a mean of unit vectors is shorter than 1.",
                id="mean_quaternion-plain",
            ),
            Mistake(
                _unit_mean(lambda q: np.where(q[:, 3] < 0, -1.0, 1.0)),
                "You made w positive. Near a half turn w is about 0, and its sign is noise: readings of one rotation get opposite signs.",
                id="mean_quaternion-w",
            ),
            Mistake(
                _unit_mean(lambda q: np.where(q @ q.mean(axis=0) < 0, -1.0, 1.0)),
                "You turn each reading to the side of their plain mean. Where about as many come with either sign they cancel, and that mean is "
                "noise: compare all with one reading.",
                id="mean_quaternion-plain-mean",
            ),
            *(
                Mistake(
                    _unit_mean(lambda q, k=k: np.where(q[:, k] < 0, -1.0, 1.0)),
                    f"You made {name} positive. Where it is about 0, its sign is noise: readings of one rotation get opposite signs.",
                    id=f"mean_quaternion-{id}-part",
                )
                for k, (name, id) in enumerate((("x", "first"), ("y", "second"), ("z", "third")))
            ),
            Mistake(
                lambda q: _unit_mean(lambda p: np.ones(len(p)))(q / q[:, 3:]),
                "You divided by w. That takes the sign away, but where w is about 0 the quotients are huge, and a few readings decide alone.",
                id="mean_quaternion-over-w",
            ),
            Mistake(
                _unit_mean(lambda q: np.sign(_largest_part(q))),
                "You made the largest part of each positive. Where two are about equally large, noise decides which it is, and they may differ in sign.",
                id="mean_quaternion-largest-part",
            ),
            Mistake(
                _unit_mean(lambda q: np.where(q.sum(axis=1) < 0, -1.0, 1.0)),
                "You made the sum of the parts positive. Where it is about 0, its sign is noise.",
                id="mean_quaternion-sum-positive",
            ),
            Mistake(
                lambda q: _unit_mean(lambda p: np.ones(len(p)))(np.abs(q)),
                "The absolute value of each part is another rotation: q and -q differ in all four signs at once.",
                id="mean_quaternion-absolute",
            ),
            Mistake(
                lambda q: np.linalg.eigh(q.T @ q)[1][:, 0],
                "This belongs to the smallest eigenvalue: what the readings have least of. `eigh` sorts upward, `svd` downward.",
                id="mean_quaternion-smallest",
            ),
            Mistake(
                lambda q: (m := q * np.where(q @ q[0] < 0, -1.0, 1.0)[:, None]).mean(axis=0) * len(m),
                "The signs are right, but you returned a sum. A quaternion has length 1.",
                id="mean_quaternion-sum",
            ),
            Mistake(
                lambda q: (q * np.where(q @ q[0] < 0, -1.0, 1.0)[:, None]).mean(axis=0),
                "The signs are right, but a mean of unit vectors that scatter is shorter than 1: divide it by its length.",
                id="mean_quaternion-short",
            ),
            Mistake(
                lambda q: (m := q * np.where(q @ q[0] < 0, -1.0, 1.0)[:, None]).sum(axis=0) / max(len(m) - 1, 1),
                "The signs are right, but this is the sum over n - 1. A quaternion has length 1: divide by the length of the sum.",
                id="mean_quaternion-one-less",
            ),
            Mistake(
                lambda q: np.median(q * np.where(q @ q[0] < 0, -1.0, 1.0)[:, None], axis=0),
                "The signs are right, but this is the median of each part. Asked for is the mean, of length 1.",
                id="mean_quaternion-median",
            ),
            Mistake(
                lambda q: q[0],
                "This is the first reading alone.",
                id="mean_quaternion-one",
            ),
        ],
    ),
]

# Base stations ---------------------------------------------------------------------------------------------------------------


def ray_direction(delays, rate):
    """Direction in which a station sees a diode that its planes hit so long after their flashes."""
    return stations.ray_direction(stations.sweep_angle(delays, rate))


def delays_of(rng, low, high):
    """The same for a diode that is off by angles of these amounts, in rad."""
    rate = float(rng.uniform(40, 120))
    return stations.sweep_delay(rng.uniform(low, high, 2) * rng.choice([-1, 1], 2), rate), rate


def two_delays(rng):
    """Times after the flashes, s, of a diode that is off in both directions, and turns per second."""
    rate = float(rng.uniform(40, 120))
    return stations.sweep_delay(rng.uniform(0.3, 0.9, 2) * rng.choice([-1, 1], 2), rate), rate


def _direction(of, quarter=0.25, turns=1.0, unit=True):
    """A ray from the angles as another reading of them has it."""

    def variant(delays, rate):
        d = np.array(of(*(2 * np.pi * (turns * rate * delays - quarter))))
        return d / np.linalg.norm(d) if unit else d

    return variant


def _tangents(a, b):
    return np.tan(a), np.tan(b), 1.0


def _sines(a, b):
    return np.sin(a), np.sin(b), np.sqrt(max(0, 1 - np.sin(a) ** 2 - np.sin(b) ** 2))


def rays(rng, most):
    """Two rays, or 3 to `most`, that pass a point at some distance; their directions are of any length."""
    n = int(rng.integers(3, most + 1)) if most > 2 else 2
    place, origins = rng.uniform(-500, 500, 3), rng.uniform(-3000, 3000, (n, 3))
    directions = unit_vector(place - origins + rng.uniform(-30, 30, (n, 3)))
    return origins, directions * rng.uniform(0.3, 4, (n, 1))


def rays_from_behind(rng):
    """The same where the point lies behind the origins of some or all of them: what counts are the lines."""
    origins, directions = rays(rng, 6)
    signs = np.where(rng.random(len(origins)) < 0.3, 1.0, -1.0)
    signs[rng.integers(len(origins))] = -1.0
    return origins, directions * signs[:, None]


def rays_nearly_parallel(rng):
    """Four rays within a few degrees of one another, as from a station far away, that pass a point."""
    place, far = rng.uniform(-500, 500, 3), unit_vector(rng.normal(size=3))
    origins = place - 5000 * far + rng.uniform(-150, 150, (4, 3))
    return origins, place - origins + rng.uniform(-3, 3, (4, 3))


def many_rays(rng):
    """Thirty rays that pass a point."""
    place, origins = rng.uniform(-500, 500, 3), rng.uniform(-3000, 3000, (30, 3))
    return origins, place - origins + rng.uniform(-30, 30, (30, 3))


def _normal_equations(block, right=None):
    """The point from sums of blocks of the rays' directions, of length 1 or as they come."""

    def variant(origins, directions):
        N = np.array([block(d) for d in directions])
        M = N if right is None else np.array([right(d) for d in directions])
        return np.linalg.lstsq(N.sum(0), (M @ origins[..., None]).sum(0)[:, 0], rcond=None)[0]

    return variant


def _nearest_in_pairs(origins, directions):
    """The mean of the points halfway between each two rays."""
    pairs = itertools.combinations(range(len(origins)), 2)
    return np.mean([stations.nearest_to_rays(origins[[*p]], directions[[*p]]) for p in pairs], axis=0)


def _along(d):
    return np.outer(d, d) / (d @ d)


def _across(d):
    return np.eye(3) - _along(d)


@functools.cache
def _knock(course="after stop 10"):
    """Turn of one station, mrad, that makes the printed E_trans: it grows in proportion."""
    joints = simulation.measuring_joints()
    T_BF, T_BE = simulation.flange_poses(joints), tool_pose(TX40, joints, simulation.T_FE)
    turned = np.arange(len(T_BE)) > (10 if course == "after stop 10" else -1)
    actual = stations.last_turned(stations.STATIONS, 2e-3 * turned[:, None] * [0.0, 1.0, 0.0])
    read = stations.read_poses(T_BE, stations.STATIONS, actual, np.random.default_rng(0))
    found = calibrate_mounting(T_BF, invert(read[0]) @ read, factor=1e9)
    return 2.0 * 1000 * table_d().mean[COLUMNS.index("E_trans")] / found.E_trans


def _e_trans_of_a_turn(turn):
    """What E_trans a turn after stop 10 makes, as a sentence; that of the figure, which begins with some noise."""
    from .stages import compute_moved_station  # with its figures, which the other exercises do without

    made, noise = (compute_moved_station({"tilt": t, "when": "after stop 10"})["E_trans"] for t in (turn, 0.0))
    told = f"A turn of {turn:.3g} mrad after stop 10 makes an E_trans of about {made:.2g} mm"
    printed = 1000 * table_d().mean[COLUMNS.index("E_trans")]
    return f"{told}{', no more than the noise' if made < 1.5 * noise else ''}, not {printed:.3f} mm"


# Errors over speed -----------------------------------------------------------------------------------------------------------


def readings_in_slow_motion(rng):
    """The same in a motion of a few millimeters a second, with errors of micrometers."""
    speed, error = readings_in_motion(rng)
    return 0.01 * speed, 0.001 * error


def few_readings_in_motion(rng):
    """Three readings that lie on the law exactly."""
    speed, e0, lag = (
        rng.permutation(rng.uniform((50, 300, 900), (200, 700, 1500))),
        rng.uniform(2, 9),
        rng.uniform(0.008, 0.03),
    )
    return speed, np.hypot(e0, lag * speed)


def readings_in_motion(rng, n=None, each=1):
    """Speeds, mm/s, and errors, mm, of a motion whose tracker lags; the squares scatter about their line, which meets
    the axis well above 0: what a negative e0^2 means, the docstring does not say. each: readings at one speed.
    """
    while True:
        speed = np.repeat(rng.uniform(20, rng.uniform(900, 1800), n or int(rng.integers(30, 60))), each)
        squares = rng.uniform(3, 9) ** 2 + (rng.uniform(0.008, 0.03) * speed) ** 2
        squares *= 1 + 0.1 * rng.uniform(-1, 1, len(speed))
        slope, intercept = np.polyfit(speed**2, squares, 1)
        if slope > 0 and intercept > 4:
            return speed, np.sqrt(squares)


def _line(x, y, end=lambda intercept, slope: (np.sqrt(intercept), np.sqrt(slope))):
    """Another line through other powers of speed and error; `end` makes the answer of its intercept and slope."""

    def variant(speed, error):
        slope, intercept = np.polyfit(x(speed), y(error), 1)
        return tuple(map(float, end(intercept, slope)))

    return variant


def _with_a_linear_term(speed, error):
    square, _, constant = np.polyfit(speed, error**2, 2)
    return float(np.sqrt(max(constant, 0.0))), float(np.sqrt(max(square, 0.0)))


def _ends_alone(speed, error):
    """The law through the first reading and the last."""
    slope, intercept = np.polyfit(speed[[0, -1]] ** 2, error[[0, -1]] ** 2, 1)
    return float(np.sqrt(intercept)), float(np.sqrt(slope))


def _extremes_alone(speed, error):
    """The law through the slowest reading and the fastest."""
    order = np.argsort(speed)
    return _ends_alone(speed[order], error[order])


def _beside_one_reading(order):
    """e0 as the error of one reading, and the lag that another one then has; `order` puts these two at the ends."""

    def variant(speed, error):
        first, last = order(speed)[[0, -1]]
        return float(error[first]), float(np.sqrt(abs(error[last] ** 2 - error[first] ** 2)) / speed[last])

    return variant


def _fitted_to_errors(speed, error):
    """The law with the least squares of the errors themselves."""
    start = np.sqrt(np.maximum(np.polyfit(speed**2, error**2, 1)[::-1], 1e-6))

    def law(u):
        return np.hypot(u[0], u[1] * speed)

    def jacobian(u):
        return np.column_stack([np.full_like(speed, u[0]), u[1] * speed**2]) / law(u)[:, None]

    found = levenberg_marquardt(lambda u: law(u) - error, jacobian, start, scale=start)
    return tuple(map(float, np.abs(found.x[-1])))


def _square(v):
    return v**2


# The whole cell --------------------------------------------------------------------------------------------------------------


def trolley(rng):
    """The tracker's world, two readings and a learned part, all of them turned and shifted at random."""
    return tuple(pose(exp_so3(rng.normal(size=3)), rng.uniform(-600, 600, 3)) for _ in range(4))


def trolley_hardly_turned(rng):
    """The same where all frames lie along one another, but for some ten-thousandths."""
    return tuple(pose(exp_so3(rng.uniform(1e-4, 3e-4, 3)), rng.uniform(-600, 600, 3)) for _ in range(4))


def trolley_at_rest(rng):
    """The same where the trolley has not moved."""
    T_BW, T_WE, _, T_BP = trolley(rng)
    return T_BW, T_WE, T_WE.copy(), T_BP


def trolley_turned(rng):
    """The same where the tracker is turned and has not moved."""
    T_BW, T_WE0, T_WE1, T_BP = trolley(rng)
    T_WE1[:3, 3] = T_WE0[:3, 3]
    return T_BW, T_WE0, T_WE1, T_BP


def trolley_far_off(rng):
    """The same tens of meters off."""
    poses = trolley(rng)
    for T in poses:
        T[:3, 3] *= 100
    return poses


def uncertain_point(rng):
    """A pose and a point, with full covariances of rad and mm of like weight."""
    T, p = (
        pose(exp_so3(rng.normal(size=3)), rng.uniform(-300, 300, 3)),
        rng.uniform(60, 200, 3) * rng.choice([-1, 1], 3),
    )
    turn, point = rng.normal(size=(6, 6)), rng.normal(size=(3, 3)) * rng.uniform(0.1, 0.4)
    turn = np.repeat([2e-3, 0.2], 3)[:, None] * turn * rng.uniform(0.5, 2)
    return T, turn @ turn.T, p, point @ point.T


def certain_along_some(rng):
    """The same with no error about one axis of the pose and along one of the point: neither covariance has an inverse."""
    T, cov_T, p, cov_p = uncertain_point(rng)
    for cov in (cov_T, cov_p):
        k = rng.integers(len(cov))
        cov[k] = cov[:, k] = 0
    return T, cov_T, p, cov_p


def _carried(
    lever=lambda R, p: -R @ skew(p), shift=lambda R: np.eye(3), turn=lambda R: R, part=slice(None), cov=lambda c: c
):
    """The covariance of a point with other Jacobians, or with a part of the pose's covariance."""

    def variant(T, cov_T, p, cov_p):
        R = T[:3, :3]
        J = np.hstack([lever(R, p), shift(R)])[:, part]
        return J @ cov(cov_T)[part, part] @ J.T + turn(R) @ cov_p @ turn(R).T

    return variant


def _swapped(cov):
    order = [3, 4, 5, 0, 1, 2]
    return cov[np.ix_(order, order)]


def _unrelated(cov):
    """A pose's covariance without what relates its turn to its shift."""
    return np.block([[cov[:3, :3], np.zeros((3, 3))], [np.zeros((3, 3)), cov[3:, 3:]]])


def _variances(cov):
    return np.diag(np.diag(cov))


def sources_of_error(rng):
    """Jacobians and covariances of 2 to 6 sources, of 3, 6 or 9 parameters each."""
    sizes = rng.choice([3, 6, 9], int(rng.integers(2, 7)))
    roots = [rng.normal(size=(n, n)) * rng.uniform(0.05, 0.3) for n in sizes]
    return [rng.normal(size=(3, n)) for n in sizes], [root @ root.T for root in roots]


def one_source(rng):
    """A single source."""
    jacobians, covariances = sources_of_error(rng)
    return jacobians[:1], covariances[:1]


def many_sources(rng):
    """Sources of 1, 2, 3 and up to 12 parameters."""
    sizes = rng.permutation(np.arange(1, 13))
    roots = [0.2 * rng.normal(size=(n, n)) for n in sizes]
    return [rng.normal(size=(3, n)) for n in sizes], [root @ root.T for root in roots]


def small_sources(rng):
    """Sources of which each contributes micrometers at most."""
    jacobians, covariances = sources_of_error(rng)
    return jacobians, [1e-8 * cov for cov in covariances]


def certain_sources(rng):
    """Sources of which one parameter each is known exactly: no covariance has an inverse."""
    jacobians, covariances = sources_of_error(rng)
    for cov in covariances:
        k = rng.integers(len(cov))
        cov[k] = cov[:, k] = 0
    return jacobians, covariances


def shares(jacobians, covariances):
    """Standard deviation in space, mm, that each source contributes."""
    named = dict(enumerate(jacobians)), dict(enumerate(covariances))
    return np.array(list(cell.sizes(error_budget(*named)).values()))


def _each(of):
    def variant(jacobians, covariances):
        return np.array([of(J, C) for J, C in zip(jacobians, covariances)])

    return variant


@functools.cache
def budget():
    """The sizes of the notebook's budget, and their total."""
    found = cell.sizes(cell.miss_budget(cell.calibrated_cell(np.random.default_rng(6)), cell.simulated_job(cell.FAR)))
    return found, float(np.sqrt(sum(size**2 for size in found.values())))


def _improved(factor, source="tracker"):
    """The total when one source's share is multiplied by a factor."""
    found, total = budget()
    return float(np.sqrt(total**2 - (1 - factor**2) * found[source] ** 2))


STATIONS = [
    Prediction(
        "sweep",
        question="The plane of light turns 60 times a second. How far does it move in a microsecond, 3 m away (mm)?",
        answer=1.131,
        unit="mm",
        within=0.05,
        why="2 pi 60 rad/s times 1e-6 s times 3000 mm is 1.1 mm: a tracker of this kind measures times, and a time that is off by a microsecond is a millimeter.",
    ),
    Exercise(
        "ray_direction",
        reference=ray_direction,
        draw=two_delays,
        metric=metrics.Numbers(1e-9),
        noisy=(
            *(
                (
                    functools.partial(delays_of, low=low, high=high),
                    metrics.Numbers(1e-9),
                    f"right, but not for a diode {words}:",
                )
                for low, high, words in (
                    (0, 0, "straight ahead"),
                    (1e-4, 5e-3, "nearly straight ahead, by thousandths of a radian"),
                    (1.23, 1.45, "far aside, by 70 deg and more"),
                )
            ),
            *(
                (functools.partial(scaled, draw=two_delays, factors=(1 / factor, factor)), metrics.Numbers(1e-9), words)
                for factor, words in (
                    (20, "right, but not for fast planes, 800 turns a second and more:"),
                    (0.01, "right, but not for slow planes, about a turn a second or less:"),
                )
            ),
        ),
        fixed={"delays": "a station has two planes, so there are two delays"},
        hints=(
            "First the angles: a whole turn takes 1 / rate, and the plane starts a quarter of a turn before straight ahead. Then the ray: both planes hold it.",
            "alpha = atan2(x, z) and beta = atan2(y, z), so x / z and y / z are their tangents. Take z = 1, then the length 1.",
            "`angles = 2 * np.pi * rate * np.asarray(delays) - np.pi / 2\nd = np.append(np.tan(angles), 1.0)\nreturn d / np.linalg.norm(d)`",
        ),
        mistakes=[
            Mistake(
                _direction(_tangents, quarter=0.0),
                "The plane starts a quarter of a turn before straight ahead, at -90 deg: subtract pi / 2.",
                id="ray_direction-quarter",
            ),
            Mistake(
                _direction(_tangents, turns=0.5 / np.pi),
                "Delay times rate counts turns: an angle in rad is 2 pi times as much, and a quarter of a turn is pi / 2.",
                id="ray_direction-turns",
            ),
            Mistake(
                lambda delays, rate: _direction(_tangents)(delays, 60.0),
                "You use 60 turns per second: `rate` says how many they are.",
                id="ray_direction-sixty",
            ),
            Mistake(
                lambda delays, rate: np.append(np.tan(delays), 1.0) / np.linalg.norm(np.append(np.tan(delays), 1.0)),
                "The delays are times, in seconds. First make angles of them.",
                id="ray_direction-times",
            ),
            Mistake(
                _direction(_tangents, unit=False),
                "The direction is right, its length is not 1.",
                id="ray_direction-length",
            ),
            *(
                Mistake(
                    _direction(of),
                    "You take the angles as azimuth and elevation. They are not: each plane turns about its own axis, and "
                    "alpha = atan2(x, z), beta = atan2(y, z) both start from z.",
                    id=f"ray_direction-sphere-{k}",
                )
                for k, of in enumerate(
                    (
                        lambda a, b: (np.sin(a) * np.cos(b), np.sin(b), np.cos(a) * np.cos(b)),
                        lambda a, b: (np.sin(a), np.sin(b) * np.cos(a), np.cos(a) * np.cos(b)),
                    )
                )
            ),
            Mistake(
                _direction(lambda a, b: (np.sin(a), np.sin(b), 1.0)),
                "You put the sines beside z = 1. x / z and y / z are the tangents.",
                id="ray_direction-sines",
            ),
            *(
                Mistake(
                    _direction(_sines, unit=unit),
                    "You take the sines of the angles as the first two parts of the direction. The planes cut at x / z = tan alpha, y / z = tan beta.",
                    id=f"ray_direction-cosines{words}",
                )
                for unit, words in ((True, ""), (False, "-of-any-length"))
            ),
            Mistake(
                _direction(lambda a, b: (a, b, 1.0)),
                "You put the angles beside z = 1, which is right for small ones alone. x / z and y / z are their tangents.",
                id="ray_direction-small",
            ),
            Mistake(
                _direction(lambda a, b: (np.tan(b), np.tan(a), 1.0)),
                "The two have changed places: the first delay belongs to the plane that holds the y axis, and gives x.",
                id="ray_direction-swapped",
            ),
            Mistake(
                _direction(lambda a, b: (np.tan(-a), np.tan(-b), 1.0)),
                "The plane moves toward +x and +y as time passes: your angles have the opposite sign.",
                id="ray_direction-sign",
            ),
            Mistake(
                _direction(_tangents, turns=0.5),
                "The plane turns by 2 pi in 1 / rate; yours by pi.",
                id="ray_direction-half-a-turn",
            ),
            Mistake(
                _direction(lambda a, b: _tangents(np.rad2deg(a), np.rad2deg(b))),
                "np.tan wants radians.",
                id="ray_direction-degrees",
            ),
        ],
    ),
    Exercise(
        "nearest_to_rays",
        reference=stations.nearest_to_rays,
        sizes=("origins",),
        draw=tuple(functools.partial(rays, most=most) for most in (6, 2, 3)),
        metric=metrics.Numbers(1e-6, "mm"),
        noisy=(
            (
                rays_from_behind,
                metrics.Numbers(1e-6, "mm"),
                "right, but not where the point lies behind the origin of a ray: the line counts, which goes both ways:",
            ),
            (
                rays_nearly_parallel,
                metrics.Numbers(1e-6, "mm"),
                "right, but not for rays that lie within a few degrees of one another:",
            ),
            (many_rays, metrics.Numbers(1e-6, "mm"), "right, but not for thirty rays:"),
            *(
                (
                    functools.partial(scaled, draw=functools.partial(rays, most=6), factors=factors),
                    metrics.Numbers(1e-6, "mm"),
                    f"right, but not for {words}:",
                )
                for factors, words in (
                    ((100, 1e3), "stations that stand hundreds of meters apart and directions of a length of hundreds"),
                    ((0.01, 1e-3), "stations that stand centimeters apart and directions of a length of thousandths"),
                )
            ),
        ),
        hints=(
            "What of p - o is the distance to a ray through o? The part across its direction d. Make the sum of its squares least.",
            "With d of length 1 the part across is (I - d d^T)(p - o), and (I - d d^T) is its own square: sum (I - d d^T) p = sum (I - d d^T) o.",
            "`N, b = np.zeros((3, 3)), np.zeros(3)\n"
            "for o, d in zip(origins, directions):\n"
            "    across = np.eye(3) - np.outer(d, d) / (d @ d)\n"
            "    N, b = N + across, b + across @ o\n"
            "return np.linalg.solve(N, b)`",
        ),
        mistakes=[
            Mistake(
                _normal_equations(lambda d: np.eye(3) - np.outer(d, d)),
                "The directions are not of length 1 here: I - d d^T takes away the part along d only if they are.",
                id="nearest_to_rays-length",
            ),
            Mistake(
                _normal_equations(_along),
                "d d^T is the part along the ray, which may be as long as it likes. The distance is what remains, I - d d^T.",
                id="nearest_to_rays-along",
            ),
            Mistake(
                lambda origins, directions: np.mean(origins, axis=0),
                "This is the middle of the stations. The point lies where the rays meet.",
                id="nearest_to_rays-origins",
            ),
            Mistake(
                _normal_equations(_across, lambda d: np.eye(3)),
                "On the right side each origin counts with its part across the ray: (I - d d^T) o.",
                id="nearest_to_rays-right-side",
            ),
            Mistake(
                _normal_equations(_across, lambda d: -_across(d)),
                "The point is on the other side of the origin: sum (I - d d^T) p = + sum (I - d d^T) o.",
                id="nearest_to_rays-sign",
            ),
            Mistake(
                lambda origins, directions: (origins + directions).mean(0),
                "You went along each ray by the length of its direction, which says nothing. How far to go is what has to be found.",
                id="nearest_to_rays-one-step",
            ),
            Mistake(
                lambda origins, directions: stations.nearest_to_rays(origins[:2], directions[:2]),
                "You used the first two rays alone. There may be more, and all of them count.",
                id="nearest_to_rays-first-two",
            ),
            Mistake(
                _nearest_in_pairs,
                "You took the mean over pairs of rays. Two rays that are nearly parallel spoil it; one sum over all rays weighs them as they should be.",
                id="nearest_to_rays-pairs",
            ),
        ],
    ),
    Prediction(
        "moved",
        question="Somebody knocks a station by 0.1 deg, and the software does not know. When does that spoil the calibration more?",
        choices=("before the run begins", "after its tenth stop", "both alike"),
        answer="after its tenth stop",
        why="Before the run, nearly all of it is one rigid motion of the whole world, and W takes that up. In the middle there are two worlds, and no mounting fits both.",
    ),
    Value(
        "knock",
        reference=_knock,
        unit="mrad",
        rtol=0.05,
        about=_e_trans_of_a_turn,
        digits=2,
        hints=(
            "Set the figure to *after stop 10* and move the knob until E_trans is 0.80 mm.",
            "E_trans grows in proportion to the turn: one reading is enough, and a division.",
            "`result = stages.compute_moved_station({'tilt': 1.0, 'when': 'after stop 10'})\nknock = 0.802 / result['E_trans']`",
        ),
        mistakes=[
            Mistake(
                lambda: np.rad2deg(1e-3 * _knock()),
                "This is in degrees. Wanted are mrad.",
                id="knock-degrees",
                within=0.006,
            ),
            Mistake(lambda: 1e-3 * _knock(), "This is in rad. Wanted are mrad.", id="knock-rad", within=3e-4),
            Mistake(
                lambda: _knock("before the run"),
                "This would be the station that moved before the run, which hardly shows. Let it move after stop 10.",
                id="knock-before",
                within=6.0,
            ),
            *(
                Mistake(
                    lambda turn=turn: turn,
                    "This is the 0.1 deg of the question before. Asked for is another turn, the one that makes an E_trans of "
                    "0.802 mm: try some, in mrad, and see what they make.",
                    id=f"knock-of-the-question-{k}",
                )
                for k, turn in enumerate((0.1, 1e3 * np.deg2rad(0.1), 1.75))
            ),
            *(
                Mistake(
                    lambda e_trans=e_trans: e_trans,
                    "This is E_trans itself, in mm. Asked for is the turn of the station that makes it.",
                    id=f"knock-e-trans-{k}",
                )
                for k, e_trans in enumerate((0.802, 0.8))
            ),
        ],
    ),
]

ERROR_AND_LAG = metrics.Several(metrics.Numbers(1e-6, "mm"), metrics.Numbers(1e-9, "s"), names=("e0", "lag"))

SPEEDS = [
    Prediction(
        "tempo",
        question="The same path in half the time, and a tracker with a constant lag. By which factors do its errors of position and of speed grow?",
        choices=("2 and 2", "2 and 4", "4 and 4"),
        answer="2 and 4",
        why="The position is off by speed times lag, and the speed doubles. The speed is off by acceleration times lag, and the acceleration is four times as large.",
    ),
    Exercise(
        "static_error_and_lag",
        reference=static_error_and_lag,
        draw=readings_in_motion,
        metric=ERROR_AND_LAG,
        noisy=(
            (
                readings_in_slow_motion,
                ERROR_AND_LAG,
                "right, but not for slow motions, a few mm/s and errors of micrometers:",
            ),
            (few_readings_in_motion, ERROR_AND_LAG, "right, but not for three readings:"),
            (
                functools.partial(readings_in_motion, each=2),
                ERROR_AND_LAG,
                "right, but not for several readings at one speed:",
            ),
            (functools.partial(readings_in_motion, n=200), ERROR_AND_LAG, "right, but not for 200 readings:"),
        ),
        hints=(
            "The law bends in speed and error. In which two quantities is it a straight line?",
            "error^2 against speed^2: the intercept is e0^2, the slope lag^2. Two unknowns, `np.polyfit` or `lstsq`.",
            "`slope, intercept = np.polyfit(speed**2, error**2, 1)\nreturn np.sqrt(intercept), np.sqrt(slope)`",
        ),
        mistakes=[
            Mistake(
                _line(_square, _square, lambda i, s: (np.sqrt(s), np.sqrt(i))),
                "The two have changed places: e0 comes first, from the intercept (`np.polyfit` gives the slope first).",
                id="static_error_and_lag-swapped",
            ),
            Mistake(
                _line(_square, _square, lambda i, s: (i, s)),
                "These are e0^2 and lag^2, in mm^2 and s^2. Take the roots.",
                id="static_error_and_lag-squares",
            ),
            Mistake(
                _line(lambda v: v, lambda e: e, lambda i, s: (i, s)),
                "You laid a line through errors and speeds themselves, as if the errors simply added. Independent errors add as squares.",
                id="static_error_and_lag-plain",
            ),
            Mistake(
                _line(lambda v: v, lambda e: e, lambda i, s: (s, i)),
                "A line through errors and speeds themselves, its slope first. Independent errors add as squares, and e0 comes first.",
                id="static_error_and_lag-plain-swapped",
            ),
            Mistake(
                _line(lambda v: v, _square, lambda i, s: (np.sqrt(max(i, 0)), np.sqrt(s))),
                "You squared the errors, but not the speeds: error^2 = e0^2 + lag^2 speed^2.",
                id="static_error_and_lag-speed",
            ),
            Mistake(
                _line(_square, lambda e: e, lambda i, s: (i, np.sqrt(s))),
                "You squared the speeds, but not the errors: error^2 = e0^2 + lag^2 speed^2.",
                id="static_error_and_lag-error",
            ),
            Mistake(
                _line(_square, _square, lambda i, s: (np.sqrt(i), 1000 * np.sqrt(s))),
                "The lag is in milliseconds; wanted are seconds.",
                id="static_error_and_lag-milliseconds",
            ),
            Mistake(
                _with_a_linear_term,
                "You fit a parabola in the speed, with a term of the speed itself: it takes up noise that belongs to the other two. The law has none: "
                "error^2 is a straight line in speed^2.",
                id="static_error_and_lag-parabola",
            ),
            Mistake(
                _ends_alone,
                "You use the first reading and the last alone, with all their noise. A least-squares line takes all of them.",
                id="static_error_and_lag-ends",
            ),
            Mistake(
                _extremes_alone,
                "You use the slowest reading and the fastest alone, with all their noise. A least-squares line takes all of them.",
                id="static_error_and_lag-extremes",
            ),
            *(
                Mistake(
                    _beside_one_reading(order),
                    f"Your e0 is the error of the {one} reading, and the lag follows from the {other} alone. Each has its noise: a least-squares line "
                    "takes all of them, and its intercept is e0^2.",
                    id=f"static_error_and_lag-{one}-and-{other}",
                )
                for one, other, order in (
                    ("first", "last", lambda speed: np.arange(len(speed))),
                    ("slowest", "fastest", np.argsort),
                )
            ),
            Mistake(
                _fitted_to_errors,
                "Here the errors themselves are fitted by least squares. Asked for are the squares of the errors, against those of the speed: a line.",
                id="static_error_and_lag-errors",
            ),
            Mistake(
                _line(_square, _square, lambda i, s: (np.sqrt(i), s)),
                "The slope is lag^2: take its root as well.",
                id="static_error_and_lag-root",
            ),
            Mistake(
                lambda speed, error: (0.0, float(np.sqrt((speed**2 @ error**2) / (speed**2 @ speed**2)))),
                "Your line passes through the origin: what is there at rest, e0, counts as lag.",
                id="static_error_and_lag-origin",
            ),
            Mistake(
                lambda speed, error: (float(error.min()), static_error_and_lag(speed, error)[1]),
                "The smallest error of all is the luckiest reading, not what stays at rest: take the intercept of the line.",
                id="static_error_and_lag-smallest",
            ),
        ],
    ),
]

CELL = [
    Exercise(
        "moved_part",
        reference=cell.moved_part,
        sizes=("T_BW", "T_WE0", "T_WE1", "T_BP0"),
        draw=trolley,
        metric=metrics.Poses(1e-6, 1e-6),
        noisy=(
            (
                trolley_hardly_turned,
                metrics.Poses(1e-6, 1e-6),
                "right, but not where all frames lie nearly along one another, but for ten-thousandths:",
            ),
            (trolley_at_rest, metrics.Poses(1e-6, 1e-6), "right, but not where the trolley has not moved:"),
            (trolley_turned, metrics.Poses(1e-6, 1e-6), "right, but not where the tracker turns on the spot:"),
            (trolley_far_off, metrics.Poses(1e-6, 1e-4), "right, but not tens of meters off:"),
        ),
        fixed=dict.fromkeys(("T_BW", "T_WE0", "T_WE1", "T_BP0"), "a pose is 4 x 4"),
        hints=(
            "Tracker and part ride on one trolley: T_EP, the part seen from the tracker, is the same then and now. Find it from then, use it now.",
            "Then: T_BP0 = T_BW T_WE0 T_EP. Now: T_BP = T_BW T_WE1 T_EP.",
            "`T_EP = np.linalg.inv(T_BW @ T_WE0) @ T_BP0\nreturn T_BW @ T_WE1 @ T_EP`",
        ),
        mistakes=[
            Mistake(
                lambda T_BW, T_WE0, T_WE1, T_BP0: pose(
                    T_BP0[:3, :3], T_BP0[:3, 3] + T_BW[:3, :3] @ (T_WE1[:3, 3] - T_WE0[:3, 3])
                ),
                "You shifted the part by the way of the tracker. The trolley turns as well: then the part turns with it, and swings round.",
                id="moved_part-shifted",
            ),
            Mistake(
                lambda W, E0, E1, P: cell.moved_part(W, E1, E0, P),
                "You moved the part backward: first and second reading have changed places.",
                id="moved_part-backward",
            ),
            Mistake(
                lambda W, E0, E1, P: E1 @ invert(E0) @ P,
                "The readings are given in W, the part in B: the motion must be carried over by T_BW, before and after.",
                id="moved_part-world",
            ),
            Mistake(
                lambda W, E0, E1, P: W @ E1 @ E0.T @ W.T @ P,
                "The transpose of a transform is not its inverse, only that of its rotation is: take `np.linalg.inv`.",
                id="moved_part-transposed",
            ),
            Mistake(
                lambda W, E0, E1, P: W @ E1 @ invert(E0) @ P,
                "T_BW stands at one end alone. From B into W you need its inverse as well: T_BE0 is T_BW T_WE0, as a whole inverted.",
                id="moved_part-one-end",
            ),
            Mistake(
                lambda W, E0, E1, P: P @ invert(E0) @ E1,
                "You applied the tracker's own motion, E0 to E1, to the part's frame. The two frames are not one: go through T_EP.",
                id="moved_part-own-motion",
            ),
            Mistake(
                lambda W, E0, E1, P: pose(
                    cell.moved_part(W, E0, E1, P)[:3, :3], P[:3, 3] + W[:3, :3] @ (E1[:3, 3] - E0[:3, 3])
                ),
                "The part turns as it should, but its origin moves as far as that of the tracker. It sits beside the tracker, and the turn swings it "
                "round: go through T_EP.",
                id="moved_part-without-lever",
            ),
            Mistake(
                lambda W, E0, E1, P: W @ E1,
                "This is where the tracker is. The part sits beside it, by T_EP.",
                id="moved_part-tracker",
            ),
            Mistake(
                lambda W, E0, E1, P: W @ E1 @ P,
                "T_BP0 is seen from the base, not from the tracker: T_EP has to be found first.",
                id="moved_part-part-on-tracker",
            ),
            Mistake(
                lambda W, E0, E1, P: invert(W) @ E1 @ invert(E0) @ W @ P,
                "T_BW and its inverse have changed places.",
                id="moved_part-inverse",
            ),
            Mistake(
                lambda W, E0, E1, P: invert(W @ E0) @ P,
                "This is T_EP, the part seen from the tracker. One step is left: where the tracker is now.",
                id="moved_part-half-way",
            ),
            Mistake(
                lambda W, E0, E1, P: W @ E1 @ E0 @ P,
                "The first reading has to be undone before the second is done: its inverse, with T_BW on both sides.",
                id="moved_part-not-undone",
            ),
            Mistake(
                lambda W, E0, E1, P: W @ invert(E0) @ E1 @ invert(W) @ P,
                "E0^-1 E1 is the motion seen from the tracker. Between T_BW and its inverse the motion seen from W belongs, E1 E0^-1.",
                id="moved_part-seen-from-tracker",
            ),
            Mistake(
                lambda W, E0, E1, P: P @ W @ E1 @ invert(W @ E0),
                "The motion in the base stands before the part: T_BE1 T_BE0^-1 T_BP0.",
                id="moved_part-behind",
            ),
            Mistake(
                lambda W, E0, E1, P: W @ E1 @ invert(E0) @ W @ P,
                "T_BW leads into the base at the end; at the beginning its inverse leads out of it.",
                id="moved_part-world-twice",
            ),
            Mistake(
                lambda W, E0, E1, P: P,
                "This is where the part was learned. It has moved since.",
                id="moved_part-still",
            ),
        ],
    ),
    Prediction(
        "touch",
        question="Instead of seen by the scanner, the marks are touched with the same tip, the flange turned as later at the hole. The tip's calibration is 1 mm off. By how much does the tip miss the hole, if the trolley has not moved?",
        choices=("not at all", "by 1 mm", "by 2 mm"),
        answer="not at all",
        why="The tip is wrong by the same vector when it measures and when it is used, and the two cancel. An error that is common to both needs no calibration; turn the part, and it comes back.",
    ),
    Prediction(
        "returns",
        question="The trolley comes back exactly to where the part was learned. What does the error of T_BW do to the part's place now?",
        choices=("nothing", "as much as anywhere", "twice as much: it enters twice"),
        answer="nothing",
        why="T_BW enters once forward and once backward. Where both readings are equal, the two cancel, whatever its error. The farther the trolley goes and the more it turns, the less they do.",
    ),
    Exercise(
        "point_covariance",
        reference=point_covariance,
        sizes=("cov_AB", "p_B", "cov_B"),
        draw=uncertain_point,
        metric=metrics.Numbers(1e-6, "mm^2"),
        noisy=tuple(
            (
                functools.partial(scaled, draw=uncertain_point, factors=factors),
                metrics.Numbers(1e-6, "mm^2", least=0),
                words,
            )
            for factors, words in (
                ((1, 1, 1, 0), "right, but not for a point without an error of its own, cov_p = 0:"),
                ((1, 0, 1, 1), "right, but not for a pose without error, cov_T = 0:"),
                ((1, 1, 0, 1), "right, but not for the origin of B, p = 0:"),
                ((1, 1e-6, 1, 1e-6), "right, but not for small covariances, of micrometers:"),
                ((1, 1e3, 40, 1e3), "right, but not for a point meters away and large covariances:"),
            )
        )
        + (
            (
                certain_along_some,
                metrics.Numbers(1e-6, "mm^2"),
                "right, but not where there is no error along some axis, its variance 0:",
            ),
        ),
        fixed={
            "T_AB": "a pose is 4 x 4",
            "cov_AB": "a pose has six parameters",
            **dict.fromkeys(("p_B", "cov_B"), "a point in space"),
        },
        hints=(
            "What does a small rotation phi about the axes of B do to the point R p + t? And a small error of p itself? Two Jacobians, two terms.",
            "R exp(phi) p is R p - R [p] phi to first order, with [p] = skew(p): J = (-R [p], I), and cov = J cov_T J^T + R cov_p R^T.",
            "`R = T[:3, :3]\nx, y, z = p\nlever = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])\nJ = np.hstack([-R @ lever, np.eye(3)])\nreturn J @ cov_T @ J.T + R @ cov_p @ R.T`",
        ),
        mistakes=[
            Mistake(
                _carried(turn=lambda R: np.eye(3)),
                "cov_p is given along the axes of B: turn it into A, R cov_p R^T.",
                id="point_covariance-unturned",
            ),
            Mistake(
                _carried(turn=lambda R: R.T),
                "R takes B to A: the point's part is R cov_p R^T, not R^T cov_p R.",
                id="point_covariance-transposed",
            ),
            Mistake(
                _carried(part=slice(3, 6)),
                "The turn of the pose is missing: it moves the point by its lever. Use all six rows of cov_T.",
                id="point_covariance-no-lever",
            ),
            Mistake(
                lambda T, cov_T, p, cov_p: _carried()(T, cov_T, p, 0 * cov_p),
                "The error of the point itself is missing: + R cov_p R^T.",
                id="point_covariance-no-point",
            ),
            Mistake(
                _carried(lever=lambda R, p: -skew(p)),
                "The lever is turned along with the pose: -R [p], not -[p].",
                id="point_covariance-lever-in-B",
            ),
            Mistake(
                _carried(lever=lambda R, p: -skew(R @ p)),
                "You took the rotation vector about the axes of A. Here it is about those of B, as all results of the workbook have it: -R [p].",
                id="point_covariance-axes-of-A",
            ),
            Mistake(
                _carried(lever=lambda R, p: R @ skew(p)),
                "The lever has the wrong sign: phi x p is -[p] phi. It matters wherever rotation and translation are correlated.",
                id="point_covariance-sign",
            ),
            Mistake(
                _carried(shift=lambda R: R),
                "The translation of T is given along the axes of A already: its Jacobian is I, not R.",
                id="point_covariance-shift",
            ),
            Mistake(
                lambda T, cov_T, p, cov_p: T[:3, :3] @ (cov_T[3:, 3:] + cov_p) @ T[:3, :3].T,
                "The shift of T is given in A and needs no turning, and the turn of T is missing: it moves the point by its lever.",
                id="point_covariance-both-turned",
            ),
            Mistake(
                lambda T, cov_T, p, cov_p: _carried(lever=lambda R, q: -skew(R @ q + T[:3, 3]))(T, cov_T, p, cov_p),
                "A turn about B's origin has the lever from there, R p. Yours starts at A's origin.",
                id="point_covariance-from-A",
            ),
            Mistake(
                _carried(cov=_swapped),
                "You took the translation first. The covariance holds the rotation vector first, then the translation.",
                id="point_covariance-order",
            ),
            Mistake(
                _carried(cov=_variances),
                "You used the variances of the pose alone. Rotation and translation of one calibration are correlated, and here it is felt.",
                id="point_covariance-variances",
            ),
            Mistake(
                _carried(cov=_unrelated),
                "You added what the turn does and what the shift does, as if they erred independently. They come from one calibration: the blocks of "
                "cov_T beside the diagonal count as well.",
                id="point_covariance-unrelated",
            ),
        ],
    ),
    Exercise(
        "shares",
        reference=shares,
        draw=sources_of_error,
        metric=metrics.Numbers(1e-9, "mm"),
        noisy=(
            (one_source, metrics.Numbers(1e-9, "mm"), "right, but not for one source alone:"),
            (many_sources, metrics.Numbers(1e-9, "mm"), "right, but not for a dozen sources, of 1 to 12 parameters:"),
            (
                small_sources,
                metrics.Numbers(1e-6, "mm", least=0),
                "right, but not for sources that contribute micrometers:",
            ),
            (
                certain_sources,
                metrics.Numbers(1e-9, "mm"),
                "right, but not where a parameter of each source is known exactly, its variance 0:",
            ),
        ),
        hints=(
            "To first order each source moves the result by J e. What covariance does that make, and what is its size in space?",
            "J cov J^T, shape (3, 3). Its trace is the mean squared distance; the root of it a length.",
            "`return np.array([np.sqrt(np.trace(J @ C @ J.T)) for J, C in zip(jacobians, covariances)])`",
        ),
        mistakes=[
            Mistake(
                _each(lambda J, C: np.trace(J @ C @ J.T)),
                "These are variances, in mm^2: take the root.",
                id="shares-variance",
            ),
            Mistake(
                _each(lambda J, C: np.sqrt(np.diag(J @ C @ J.T)).sum()),
                "You added the standard deviations of the three axes. Squares add: the root of the trace.",
                id="shares-linear",
            ),
            *(
                Mistake(
                    _each(lambda J, C, sign=sign: np.linalg.norm(J @ (sign(C) * np.sqrt(np.abs(C))))),
                    "You took the root of the covariance entry by entry. What makes it by L Lᵀ is another matrix, such as that "
                    "of Cholesky; without it, the root of trace(J C Jᵀ) will do.",
                    id=f"shares-root-of-entries{end}",
                )
                for sign, end in ((np.sign, ""), (np.ones_like, "-unsigned"))
            ),
            Mistake(
                _each(lambda J, C: np.sqrt(np.trace(J @ _variances(C) @ J.T))),
                "You used the variances of the parameters alone. Those of one calibration are correlated: take all of its covariance.",
                id="shares-variances-only",
            ),
            Mistake(
                _each(lambda J, C: np.sqrt(np.linalg.eigvalsh(J @ C @ J.T)[-1])),
                "This is the standard deviation in the worst direction. Asked for is the one in space: the root of the trace.",
                id="shares-worst",
            ),
            Mistake(
                _each(lambda J, C: np.sqrt(np.diag(J @ C @ J.T).max())),
                "This is the standard deviation along the worst axis. Asked for is the one in space: the root of the trace.",
                id="shares-worst-axis",
            ),
            Mistake(
                _each(lambda J, C: np.sqrt(np.trace(J @ C @ J.T) / 3)),
                "You divided by 3: that is the root mean square per axis. The distance in space is the root of the whole trace.",
                id="shares-per-axis",
            ),
            Mistake(
                _each(lambda J, C: np.sqrt(np.trace(C))),
                "The covariance of a source is in its own units. The Jacobian carries it to the result: J cov J^T.",
                id="shares-no-jacobian",
            ),
            Mistake(
                _each(lambda J, C: np.linalg.norm(J @ C @ J.T)),
                "The norm of the covariance is no length: take the root of its trace.",
                id="shares-norm",
            ),
            Mistake(
                lambda jacobians, covariances: (own := shares(jacobians, covariances) ** 2) / own.sum(),
                "These are shares of the variance, which add up to 1. Asked for are lengths in mm.",
                id="shares-fractions",
            ),
            Mistake(
                lambda jacobians, covariances: float(np.linalg.norm(shares(jacobians, covariances))),
                "This is the total. Asked for is one number a source.",
                id="shares-total",
            ),
        ],
    ),
    Value(
        "halved",
        reference=lambda: _improved(0.5),
        unit="mm",
        rtol=2e-3,
        hints=(
            "Which source is the largest? Only its share changes, and squares add.",
            "total^2 is the sum of the squares. Half of a standard deviation is a quarter of a variance.",
            "`largest = max(sizes.values())\nhalved = np.sqrt(total**2 - 0.75 * largest**2)`",
        ),
        mistakes=[
            Mistake(
                lambda: budget()[1] / 2,
                "This is half of the whole. Only one of six sources gets better.",
                id="halved-all",
            ),
            Mistake(
                lambda: budget()[1] - budget()[0]["tracker"] / 2,
                "This is the total less half of the largest share. Standard deviations do not add, their squares do.",
                id="halved-linear",
            ),
            Mistake(
                lambda: _improved(np.sqrt(0.5)),
                "This is the total with half of the variance. Half the standard deviation leaves a quarter of it.",
                id="halved-variance",
            ),
            Mistake(
                lambda: _improved(0.0),
                "This is the total without that source. Half of its standard deviation remains.",
                id="halved-removed",
            ),
            *(
                Mistake(
                    lambda source=source: _improved(0.5, source),
                    "This is the total when a source is improved that is not the largest.",
                    id=f"halved-{source.replace(' ', '-')}",
                )
                for source in ("scanner", "tip", "marks", "first reading")
            ),
            Mistake(lambda: budget()[1], "This is the total as it is.", id="halved-not"),
            Mistake(
                lambda: budget()[1] / np.sqrt(2),
                "This is the total over the root of 2, as if each variance were halved. One of six sources alone gets better, by half of its standard "
                "deviation: that the numbers are nearly equal is chance.",
                id="halved-root-two",
            ),
            Mistake(
                lambda: float(np.hypot(budget()[1], np.sqrt(3) * budget()[0]["tracker"]) / 2),
                "Here all sources are halved but the largest. It is the other way round.",
                id="halved-all-others",
            ),
            Mistake(
                lambda: _improved(0.25),
                "This is with a quarter of that source's standard deviation. Four times as many readings halve it.",
                id="halved-quarter",
            ),
            Mistake(
                lambda: sum(budget()[0].values()) - max(budget()[0].values()) / 2,
                "You added the standard deviations. The sources know nothing of each other: their squares add.",
                id="halved-sum",
            ),
            Mistake(
                lambda: float(np.sqrt(budget()[1] ** 2 - budget()[0]["tracker"] ** 2 / 4)),
                "You took away a quarter of its variance. Half of the standard deviation leaves a quarter: three quarters go.",
                id="halved-quarter-removed",
            ),
            Mistake(
                lambda: float(np.sqrt(budget()[1] ** 2 - budget()[0]["tracker"] / 2)),
                "From the sum of the squares you took half a standard deviation, millimeters from square millimeters.",
                id="halved-units",
            ),
            Mistake(
                lambda: budget()[0]["tracker"] / 2,
                "This is the improved share alone. The other five remain: add the squares.",
                id="halved-alone",
            ),
            Mistake(
                lambda: _improved(0.5) ** 2,
                "This is the variance, in mm^2. Take the root.",
                id="halved-squared",
            ),
        ],
    ),
]
