"""Chapter 9: particles, maps, resampling, recovery, and four bugs to hunt."""

import functools
import inspect
import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri, i0e, logsumexp, ndtr, ndtri

from ...documents.lecture.examples import load_building
from ...exercises import metrics
from ...exercises.budget import seconds
from ...exercises.engine import Chapter, Exercise, Prediction
from ...exercises.outcome import Mistake
from ...exercises.special import LONGEST
from ...exercises.value import Value
from ...fast import maps as fast_maps
from ...geometry import planar
from ...localization import maps, mcl, odometry, particles
from ...localization.sensors import scan_from_depth, weigh_landmarks
from . import specimens

R_MAX = 18.0
POSE = "a planar pose has three numbers"
IMPORTS = 6.0  # seconds a call may take where students use scipy.stats: its import alone can take two, and it is slow


@functools.cache
def building():
    """The chapter's building, read once."""
    found = load_building()
    _measured(found.grid)
    return found


def _measured(grid):
    """The grid with its distances computed, so that its copies, one a call, need not compute them anew."""
    _ = grid.distance
    return grid


# Draws ---------------------------------------------------------------------------------------------------------------


def scan_at_a_pose(rng, count=None):
    """grid, pose near the truth, ranges, bearings, std; all end points lie on the map, whatever the heading."""
    grid, count = building().grid, count or int(rng.integers(8, 16))
    pose = np.array([rng.uniform(5, 12), rng.uniform(4.6, 5.3), rng.uniform(-3, 3)])
    bearings = np.linspace(-2.3, 2.3, count)
    ranges = grid.cast(pose, bearings, R_MAX).astype(float)
    near = pose + rng.normal(0, (0.05, 0.05, 0.03))
    short = np.clip(ranges - 0.3, 0.05, 3.5)
    return grid, near, short, bearings, float(rng.uniform(0.15, 0.4))


def landmarks_at_a_pose(rng, astray=0.0):
    """pose, z, landmarks, both standard deviations; two bearings lie across the seam at 180 deg, from either side.

    astray: how far the measured ranges are off beyond their noise (m), as seen from a particle in a wrong room; the
    bearings, but those across the seam, are then off by more than a right angle.
    """
    m = int(rng.integers(3, 6))
    pose = np.array([*rng.uniform(-2, 2, 2), rng.uniform(-3, 3)])
    phi = np.array([math.pi - 0.02, 0.02 - math.pi, *rng.uniform(-2, 2, m - 2)])
    r = rng.uniform(2, 6, m)
    angle = pose[2] + phi
    landmarks = pose[:2] + r[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    turned = rng.uniform(1.7, 2.8, m - 2) * rng.choice([-1, 1], m - 2) if astray else 0.03 * rng.normal(size=m - 2)
    off = planar.wrap_angle(phi + (0.05, -0.05, *turned))
    z = np.column_stack([r + astray + 0.1 * rng.normal(size=m), off])
    return pose, z, landmarks, float(rng.uniform(0.15, 0.4)), float(rng.uniform(0.03, 0.08))


def one_landmark(rng):
    """The same with a single landmark."""
    pose, z, landmarks, *stds = landmarks_at_a_pose(rng)
    return pose, z[:1], landmarks[:1], *stds


def landmarks_just_as_expected(rng):
    """Two landmarks, measured without any error, and a sensor whose standard deviations are a tenth of the usual."""
    pose, z, landmarks, *stds = landmarks_at_a_pose(rng)
    away = landmarks - pose[:2]
    bearings = planar.wrap_angle(np.arctan2(away[:, 1], away[:, 0]) - pose[2])
    return pose, np.column_stack([np.hypot(*away.T), bearings])[:2], landmarks[:2], 0.1 * stds[0], 0.1 * stds[1]


def landmarks_measured_twice(rng):
    """Four readings of two landmarks: of one it is the same twice, of the other it differs."""
    pose, z, landmarks, *stds = landmarks_at_a_pose(rng)
    again = z[0] + rng.uniform(0.5, 1.5, 2) * stds
    return pose, np.array([z[0], z[1], again, z[1]]), landmarks[[0, 1, 0, 1]], *stds


def landmarks_after_several_turns(rng):
    """A dozen landmarks far away, and a heading that has gathered several turns."""
    theta = rng.uniform(-3, 3) + 2 * math.pi * rng.integers(2, 4) * rng.choice([-1, 1])
    r, phi, pose = rng.uniform(60, 180, 12), rng.uniform(-3, 3, 12), np.array([*rng.uniform(-2, 2, 2), theta])
    landmarks = pose[:2] + r[:, None] * np.column_stack([np.cos(theta + phi), np.sin(theta + phi)])
    z = np.column_stack([r + rng.normal(size=12), planar.wrap_angle(phi + 0.05 * rng.normal(size=12))])
    return pose, z, landmarks, float(rng.uniform(2, 4)), float(rng.uniform(0.03, 0.08))


def landmarks_from_a_wrong_room(rng):
    """The same with ranges that are 60 m off: their density is zero in float64, its logarithm is not."""
    return landmarks_at_a_pose(rng, astray=60.0)


def landmarks_30_deviations_off(rng):
    """The same with ranges so far off that only the product of their densities is zero in float64, none of them."""
    pose, z, landmarks, std_range, std_bearing = landmarks_at_a_pose(rng)
    return pose, z + [30.0 * std_range, 0.0], landmarks, std_range, std_bearing


def beams_at_a_pose(rng, count=None):
    """Measured and expected ranges, std."""
    count = count or int(rng.integers(15, 25))
    expected = rng.uniform(1, 10, count)
    return expected + 0.2 * rng.normal(size=count), expected, float(rng.uniform(0.15, 0.4))


def beams_of_a_sensor(rng, sharpness, count=None):
    """The same of a sensor so many times as sharp, with errors that are smaller by as much."""
    ranges, expected, std = beams_at_a_pose(rng, count)
    return expected + (ranges - expected) / sharpness, expected, std / sharpness


def beams_that_are_alike(rng):
    """The same where some ranges are just as expected, others repeat one another, and some are those of no echo, where one
    is expected that is longer still.
    """
    ranges, expected, std = beams_at_a_pose(rng)
    ranges[:2] = expected[:2]
    ranges[3:6], expected[3:6] = ranges[2], expected[2]
    ranges[6:8], expected[6:8] = R_MAX, (R_MAX, R_MAX + rng.uniform(1, 9))
    return ranges, expected, std


def beams_from_a_wrong_pose(rng):
    """The same with ranges that are 45 standard deviations off: the density of each is zero in float64, its logarithm
    is not.
    """
    ranges, expected, std = beams_at_a_pose(rng)
    return ranges + 45.0 * std * rng.choice([-1, 1], len(ranges)), expected, std


def scan_by_a_sharp_sensor(rng):
    """A scan whose end points lie so many standard deviations from the nearest wall that densities are zero."""
    grid, pose, ranges, bearings, _ = scan_at_a_pose(rng)
    return grid, pose, 0.5 * ranges, bearings, float(rng.uniform(0.002, 0.004))


def scan_on_another_map(rng):
    """grid, pose, ranges, bearings, std on a map with other cells and another origin than the building's, which nobody has
    seen the half of: there some beams end.
    """
    cells = np.full((60, 80), maps.FREE)
    cells[:, 40:] = maps.UNKNOWN
    cells[[0, -1]], cells[:, [0, -1]] = maps.OCCUPIED, maps.OCCUPIED
    cells[rng.integers(5, 55, 8), rng.integers(5, 75, 8)] = maps.OCCUPIED
    grid = _measured(maps.OccupancyGrid(cells, 0.05, (-7.0, 4.0)))
    pose = np.array([rng.uniform(-5.3, -4.7), rng.uniform(5.3, 5.7), rng.uniform(-3, 3)])
    return grid, pose, rng.uniform(0.3, 1.1, 12), np.linspace(-2.3, 2.3, 12), float(rng.uniform(0.15, 0.4))


def scan_in_a_wide_hall(rng, count=12):
    """grid, pose, ranges, bearings, std where every end point is meters away from the nearest wall, however long its beam
    is: one is as long as the scanner of the building reaches, others are longer.
    """
    cells = np.full((110, 120), maps.FREE)
    cells[[0, -1]], cells[:, [0, -1]] = maps.OCCUPIED, maps.OCCUPIED
    pose = np.array([*rng.uniform(50, 60, 2), rng.uniform(-3, 3)])
    bearings = np.linspace(-2.3, 2.3, count) if count > 1 else rng.uniform(-2, 2, 1)
    ranges = np.linspace(44, 4, count) * rng.uniform(0.6, 1.0, count)
    ranges[count // 2] = R_MAX
    return _measured(maps.OccupancyGrid(cells, 1.0)), pose, ranges, bearings, float(rng.uniform(2.5, 5.0))


WHOLE_SCAN = "right, but not for 541 beams and a std of about 3 m:"


def whole_scan(draw):
    """The draw with as many beams as the scanner has, and so wide a std that a plain product of their densities is zero
    in float64.
    """

    def drawn(rng):
        return *draw(rng, count=541)[:-1], float(rng.uniform(2.5, 3.5))

    return drawn


def plain_ray(rng, way=None):
    """grid, pose, bearing, r_max of a ray that meets a wall squarely enough for any way of stepping along it, and whose
    range differs from those without heading or bearing, from the mirrored one, and from that of the last wall behind: a
    slow answer gets few draws.

    way: signs of its direction in x and y, any if None.
    """
    grid = building().grid
    while True:
        poses, bearings = particles.uniform_states(grid, 24, rng), rng.uniform(-2, 2, 24)
        for k in np.flatnonzero(_squarely_and_apart(_casts(fast_maps.cast_rays, grid, poses, bearings))):
            pose, b = poses[k], bearings[k]
            casts = _casts(maps.cast_rays, grid, poses[k : k + 1], bearings[k : k + 1])
            on_its_way = way in (None, (np.sign(math.cos(pose[2] + b)), np.sign(math.sin(pose[2] + b))))
            if not on_its_way or not _squarely_and_apart(casts)[0]:  # the fast ones may pass a corner
                continue
            right = casts[0, 2]
            steps = _hits(grid, pose, b, R_MAX, grid.resolution / 2)
            stepped = steps.min(initial=R_MAX)  # half a cell at a time: a wall's corner is easily stepped over
            if steps.max(initial=0.0) > right + 1.0 and abs(stepped - right) <= grid.resolution / 2:
                return grid, pose, float(b), R_MAX


def _squarely_and_apart(casts):
    """Of rays with `_casts` as they are: whether each meets a wall squarely, and no slip is mistaken for another one or
    for what is right, shape (n,).
    """
    around, wrong = casts[:, :5], casts[:, 5:]
    right = around[:, 2]
    squarely = (np.ptp(around, axis=1) < np.minimum(0.12 * right, 0.25)) & (right > 1.0)
    apart = np.diff(np.sort(wrong, axis=1), axis=1).min(axis=1) > 0.2
    return squarely & apart & (np.abs(wrong - right[:, None]).min(axis=1) > 0.3)


def _casts(cast, grid, poses, bearings):
    """Ranges (n, 9) of n rays: five nearly alike, the right one in their middle, and four of slips with the angle."""
    theta, ray = poses[:, 2], poses[:, 2] + bearings
    angles = np.stack(
        [ray - 0.02, ray - 0.01, ray, ray + 0.01, ray + 0.02,
         bearings, theta, theta - bearings, math.pi / 2 - ray], axis=1
    )  # fmt: skip
    xy = np.broadcast_to(poses[:, None, :2], (*angles.shape, 2))
    return cast(grid, np.dstack([xy, angles]), np.zeros(1), R_MAX)[..., 0]


TYPED_IN = tuple(steps - end for steps in (100, 200, 300, 400, 500, 1000) for end in (0, 1))  # numbers of steps
FAR_TIMES = 36  # as many cells lie on a ray over thousands of cells as on one down the hall
EVERY_WAY = tuple(functools.partial(plain_ray, way=way) for way in ((1, 1), (-1, 1), (-1, -1), (1, -1)))


def long_ray(rng):
    """A plain ray, and its range, which is longer than 3.5 m."""
    while True:
        *ray, r_max = plain_ray(rng)
        if (r := maps.walk_ray(*ray, r_max)) > 3.5:
            return ray, r


def short_ray(rng):
    """The same with an r_max a little before the wall, and the next whole meter behind it."""
    while True:
        ray, r = long_ray(rng)
        if math.ceil(r - 0.3) > r + 0.2:
            return *ray, r - 0.3


def ray_that_ends_just_before(rng):
    """The same with an r_max nearly a cell before the wall."""
    ray, r = long_ray(rng)
    return *ray, r - rng.uniform(0.8, 0.95) * ray[0].resolution


def ray_that_just_arrives(rng):
    """The same with an r_max a little behind the wall."""
    ray, r = long_ray(rng)
    return *ray, r + rng.uniform(0.25, 0.35)


def ray_along_an_axis(rng, toward):
    """A ray straight along an axis, or against it, of a map that does not begin at (0, 0), through the middles of its cells."""
    cells = np.full((40, 50), maps.FREE)
    cells[[0, -1]], cells[:, [0, -1]] = maps.OCCUPIED, maps.OCCUPIED
    xy = np.array([-3.0, 2.0]) + 0.1 * (rng.integers(15, 25, 2) + 0.5)
    return maps.OccupancyGrid(cells, 0.1, (-3.0, 2.0)), np.array([*xy, toward]), 0.0, R_MAX


def ray_past_the_unknown(rng):
    """A ray that crosses cells that nobody has seen before it meets a wall; they are no obstacle that is known. Neither
    steps of four cells, nor of five or ten, end near the wall.
    """
    cells, start = np.full((60, 140), maps.FREE), rng.uniform(1.17, 1.38)
    cells[:, 25:35] = maps.UNKNOWN
    cells[:, 50:] = maps.OCCUPIED  # so thick that halving the ray finds its face
    theta = rng.uniform(-0.3, 0.3)
    return maps.OccupancyGrid(cells, 0.1), np.array([start, rng.uniform(2.8, 3.2), theta]), float(-theta), R_MAX


def ray_to_a_thin_wall(rng, width=0.1, far=None):
    """A ray nearly along y to a wall of one cell, in which no step of 1.2, 1.5, 2 or 3 cells ends; another wall behind
    it. width: of a cell (m); far: distance, in cells.
    """
    cells, far = np.full((60, 60), maps.FREE), far or 6.0 * rng.integers(3, 6) + rng.uniform(0.05, 0.15)
    cells[45], cells[56:] = maps.OCCUPIED, maps.OCCUPIED
    theta, angle = rng.uniform(-3, 3), math.pi / 2 + rng.uniform(0.004, 0.02) * rng.choice([-1, 1])
    pose = np.array([width * rng.uniform(25, 35), width * (45 - far * math.sin(angle)), theta])
    return maps.OccupancyGrid(cells, width), pose, float(planar.wrap_angle(angle - theta)), R_MAX


def ray_in_a_fine_map(rng):
    """The same with cells of 2 cm and a wall in which no step of 5 cm ends, more than half a meter away."""
    return ray_to_a_thin_wall(rng, width=0.02, far=2.5 * rng.integers(11, 16) + rng.uniform(0.6, 0.9))


def ray_down_a_hall(rng):
    """A ray to a wall some sixty meters away, in cells so wide that walking there is quick, and a scanner that reaches
    75 m.
    """
    cells, start = np.full((20, 155), maps.FREE), rng.uniform(1.0, 3.0)
    cells[:, 150:] = maps.OCCUPIED
    theta, angle = rng.uniform(-3, 3), rng.uniform(-0.05, 0.05)
    pose = np.array([start, rng.uniform(3.5, 4.5), theta])
    return maps.OccupancyGrid(cells, 0.4), pose, float(planar.wrap_angle(angle - theta)), 75.0


def ray_over_thousands_of_cells(rng):
    """A ray to a wall some 520 m and 5,200 cells away, and a scanner that reaches 600 m."""
    cells = np.full((30, 5600), maps.FREE)
    cells[:, 5200:] = maps.OCCUPIED
    theta, angle = rng.uniform(-3, 3), rng.uniform(-0.001, 0.001)
    pose = np.array([rng.uniform(1.0, 3.0), rng.uniform(1.2, 1.8), theta])
    return maps.OccupancyGrid(cells, 0.1), pose, float(planar.wrap_angle(angle - theta)), 600.0


def ray_by_a_far_sighted_scanner(rng):
    """A ray to a wall of one cell, with an r_max of which no typical number of steps ends in that wall."""
    while True:
        far, r_max = rng.uniform(20, 30), float(rng.uniform(180, 220))
        steps = [0.1 * far * n / r_max % 1 for n in TYPED_IN]
        if all(1e-9 < step < 1 - 0.11 * n / r_max for step, n in zip(steps, TYPED_IN)):
            return *ray_to_a_thin_wall(rng, far=far)[:3], r_max


def ray_from_within_a_wall(rng):
    """A ray that begins deep in a wall, and leads out of it to another one."""
    cells = np.full((60, 60), maps.FREE)
    cells[:, :20], cells[:, 50:] = maps.OCCUPIED, maps.OCCUPIED
    theta, angle = rng.uniform(-3, 3), rng.uniform(-0.3, 0.3)
    pose = np.array([rng.uniform(1.2, 1.6), rng.uniform(2.5, 3.5), theta])
    return maps.OccupancyGrid(cells, 0.1), pose, float(planar.wrap_angle(angle - theta)), R_MAX


def ray_that_leaves_the_map(rng):
    """A ray that leaves a map before it meets anything; on the other side of the map there is a wall."""
    cells = np.full((40, 50), maps.FREE)
    cells[:, 25:], cells[-8:] = maps.OCCUPIED, maps.OCCUPIED
    theta, angle = rng.uniform(-3, 3), rng.uniform(-2.6, -2.2)
    pose = np.array([*rng.uniform(1.0, 1.5, 2), theta])
    return maps.OccupancyGrid(cells, 0.1), pose, float(planar.wrap_angle(angle - theta)), R_MAX


def ray_to_a_wall_close_by(rng):
    """A ray to a wall so near that one which begins half a meter out is in it."""
    cells, far = np.full((60, 60), maps.FREE), rng.uniform(0.15, 0.25)
    cells[:, 40:] = maps.OCCUPIED
    theta, angle = rng.uniform(-3, 3), rng.uniform(-0.3, 0.3)
    pose = np.array([4.0 - far * math.cos(angle), rng.uniform(2.5, 3.5), theta])
    return maps.OccupancyGrid(cells, 0.1), pose, float(planar.wrap_angle(angle - theta)), R_MAX


def motion(rng):
    """states, u, dt, standard deviations of v and omega, rng."""
    m, u = int(rng.integers(4, 9)), np.array([rng.uniform(0.5, 1), rng.uniform(0.2, 0.6)]) * rng.choice([-1, 1], 2)
    states = np.column_stack([rng.uniform(-5, 5, (m, 2)), rng.uniform(-3, 3, m)])
    stds, dt = rng.uniform(0.1, 0.2, 2) + (0, 0.15), float(rng.uniform(0.2, 0.8))
    return states, u, dt, stds, np.random.default_rng(rng.integers(2**32))


def wheel(rng, power):
    """Weights whose sum is well above 1, the more alike the smaller the power, and an rng."""
    w = rng.uniform(0.1, 1, size=rng.integers(10, 16)) ** power
    return w / w.sum() * rng.uniform(2, 5), np.random.default_rng(rng.integers(2**32))


WHEELS = tuple(functools.partial(wheel, power=power) for power in (4, 0.5))


def cloud_weights(rng):
    """Weights of any sum."""
    return (rng.exponential(size=rng.integers(20, 40)) ** rng.uniform(0.2, 3) * 50 ** rng.uniform(-2, 1),)


def cloud_with_dead_particles(rng):
    """The same, some of them zero."""
    (w,) = cloud_weights(rng)
    w[rng.choice(len(w), 5, replace=False)] = 0.0
    return (w,)


def one_heavy(rng):
    """The same with all but one of zero."""
    (w,) = cloud_weights(rng)
    return (w * (np.arange(len(w)) == rng.integers(len(w))),)


def many_alike(rng):
    return (np.full(int(rng.integers(2000, 3000)), rng.uniform(1e-100, 2e-100)),)


def one_particle(rng):
    return (np.array([rng.uniform(2, 5)]),)


def one_particle_and_threshold(rng):
    """One particle, which is worth all there are."""
    return *one_particle(rng), float(rng.uniform(0.2, 0.9))


def log_weights(rng, level, possible=False):
    """Logarithms of weights about this level, one or two of them impossible (-inf) unless all are `possible`."""
    logs = level + rng.normal(0, 2, rng.integers(6, 15))
    if not possible:
        logs[rng.choice(len(logs), rng.integers(1, 3), replace=False)] = -np.inf
    return (logs,)


def logs_far_apart(rng):
    """Logarithms of which the largest lie more than 1000 above the others, the first and last ones, and their mean."""
    low = -2000 + rng.normal(0, 2, rng.integers(5, 9))
    logs = rng.permutation(np.concatenate([900 + rng.normal(0, 2, rng.integers(2, 4)), low[2:]]))
    return (np.array([low[0], *logs, low[1]]),)


def small_ones_that_count(rng):
    """Logarithms of thousands of weights that are small beside the largest, but not together."""
    return (rng.permutation([0.0, *rng.uniform(-24, -8, 3000)]) + rng.uniform(-3, 3),)


def whole_logs(rng):
    """Logarithms that are whole numbers about 0, which is that of a weight of 1."""
    return (rng.permutation(np.arange(-3.0, 4.0)),)


def equal_logs(rng, count):
    return (np.full(count, rng.uniform(-900, -800)),)


def one_possible(rng, others):
    """The logarithm of a weight, alone or amid so many impossible ones: from either end the first two are impossible."""
    return (np.insert(np.full(others, -np.inf), others // 2, rng.uniform(-900, -800)),)


LOG_WEIGHTS = (
    logs_far_apart,
    *(functools.partial(log_weights, level=level) for level in (-2000.0, -1.0, 900.0)),
    functools.partial(log_weights, level=-2000.0, possible=True),
)


def cycle_of_weights(rng, step, n=None):
    """Weights, a likelihood for each particle, the number of the step, and the length of a cycle; step: (rng, n) -> k."""
    m, n = rng.integers(5, 12), n or int(rng.integers(3, 7))
    weights = rng.uniform(0.1, 1, m)
    return weights / weights.sum(), rng.uniform(0.01, 3, m), int(step(rng, n)), n


def cycle_of_rare_weights(rng, after=0):
    """The same with weights of any sum, some of them and some likelihoods zero, the others tiny; and a long cycle, so
    many steps after its end.
    """
    weights, likelihood, _, _ = cycle_of_weights(rng, STEPS[0])
    weights[0], likelihood[-1] = 0.0, 0.0
    return 50 * weights, 1e-200 * likelihood, 40 * int(rng.integers(30, 60)) + after, 40


def cycle_of_one(rng):
    """The same with a single particle."""
    weights, likelihood, step, n = cycle_of_weights(rng, STEPS[1])
    return weights[:1], likelihood[:1], step, n


# The end of a later cycle, the step before it and after it, the first step, the end of the first cycle
STEPS = (
    lambda rng, n: n * rng.integers(2, 6),
    lambda rng, n: n * rng.integers(2, 6) - 1,
    lambda rng, n: n * rng.integers(2, 6) + 1,
    lambda rng, n: 1,
    lambda rng, n: n,
)


def row_of_depths(rng, odd=False):
    """Depths of a row of columns, some too near, too far, on a limit or missing; opening angle and limits."""
    n, near, far = 2 * int(rng.integers(6, 12)) + odd, float(rng.uniform(0.4, 1.0)), float(rng.uniform(3.0, 5.0))
    depth = rng.uniform(1.1 * near, 0.95 * far, n)
    depth[rng.choice(n, 6, replace=False)] = 0.0, 0.6 * near, near, far, 1.2 * far, 1.5 * far
    return depth, float(rng.uniform(0.7, 1.6)), near, far


def depths_of_a_camera(rng, field_of_view, n, scale):
    """The same of another camera: how wide it sees (rad), how many columns it has, how far it sees."""
    _, _, near, far = row_of_depths(rng)
    near, far = scale * near, scale * far
    depth = rng.uniform(0.5 * near, 1.2 * far, n)
    beside = np.array([near * (1 - 1e-6), far * (1 - 1e-6), far * (1 + 1e-6), near * (1 + 1e-6)])
    depth[: len(beside)] = beside[:n]
    return depth, field_of_view * rng.uniform(0.9, 1.1), near, far


def nothing_seen(rng):
    """The same with all columns too near, too far or missing."""
    depth, field_of_view, near, far = row_of_depths(rng)
    return np.where(np.arange(len(depth)) % 2, 0.5 * near, 1.5 * far), field_of_view, near, far


def one_column(rng):
    """A single column, in the middle of the picture."""
    depth, field_of_view, near, far = row_of_depths(rng)
    return np.array([rng.uniform(near, far)]), field_of_view, near, far


def cloud_and_threshold(rng, slip, beside=particles.should_resample):
    """Weights and a threshold for which this slip decides wrongly, or otherwise than the one beside it."""
    while True:
        w, threshold = *cloud_weights(rng), float(rng.uniform(0.2, 0.9))
        w[rng.random(w.size) < rng.choice([0.0, 0.4])] = 0.0
        if slip(w, threshold) != beside(w, threshold):
            return w, threshold


def near_the_threshold(rng, side):
    """Weights and a threshold that their effective size misses by 1 %, to this side, with no whole number between."""
    while True:
        w = rng.uniform(0.2, 1.0, size=rng.integers(20, 40)) * 50 ** rng.uniform(-2, 1)
        size = particles.effective_size(w)
        if min(size - np.floor(size), np.ceil(size) - size) > 0.012 * size:
            return w, float(size / len(w) * (1 + 0.01 * side))


def at_the_threshold(rng):
    """Weights of 0 and of one size whose effective size, a power of two, is just the share; all without rounding."""
    m = 2 ** rng.integers(2, 5)
    n = 2 ** rng.integers(0, np.log2(m) + 1)
    return rng.permutation(2.0 ** rng.integers(-2, 3) * (np.arange(m) < n)), float(n / m)


def weights_on_their_own_side(rng, place, below, shares):
    """Weights and a threshold so that their effective size and what it is compared with, or both as shares, lie between
    the same two multiples of a decimal place: rounded, one comes to lie on the other side of the other, or on it.
    """
    while True:
        w = rng.uniform(0.2, 1.0, size=rng.integers(20, 40)) ** rng.uniform(0.5, 6)
        unit = 1 if shares else len(w)
        share = particles.effective_size(w) / len(w)
        part = share * unit / place % 1
        if (0.6 < part < 0.75) if below else (0.25 < part < 0.4):
            return w, float(share + (0.15 if below else -0.15) * place / unit)


def many_weights(rng, side):
    """Thousands of tiny weights, and a small threshold that their effective size misses by 1 %, to this side."""
    w = 1e-100 * rng.exponential(size=3000) ** 4
    return w, float(particles.effective_size(w) / len(w) * (1 + 0.01 * side))


def averages_of_densities(rng, scale, **kind):
    """The same of weights so many times as large."""
    mean, slow, fast, *alphas = averages(rng, **kind)
    return scale * mean, scale * slow, scale * fast, *alphas


def averages_apart(rng, share):
    """The same where the quick average and the mean weight lack this share of the slow average."""
    mean, slow, fast, *alphas = averages(rng)
    return (1 - share) * slow, slow, (1 - share) * slow, *alphas


def averages_that_stand(rng):
    """The same where all three are one number, a slow average that hardly moves and a quick one that nearly jumps."""
    w = rng.uniform(0.2, 0.8)
    return w, w, w, rng.uniform(0.001, 0.005), rng.uniform(0.9, 0.99)


def averages_that_rise(rng):
    """w_mean, w_slow, w_fast, alpha_slow, alpha_fast where the quick average is above the slow one, and stays there."""
    slow = rng.uniform(0.2, 0.8)
    return slow * rng.uniform(1.2, 1.9), slow, slow * rng.uniform(1.02, 1.2), rng.uniform(0.02, 0.1), 0.3


def averages(rng, low=False):
    """The same with a drop as often as a rise; low: a share above one half."""
    slow = rng.uniform(0.2, 0.8)
    return (
        slow * (rng.uniform(0.1, 0.4) if low else rng.uniform(0.1, 1.9)),
        slow,
        slow * (rng.uniform(0.1, 0.35) if low else rng.uniform(0.6, 1.2)),
        rng.uniform(0.02, 0.1),
        rng.uniform(0.2, 0.5),
    )


def averages_just_below(rng):
    """The same with a quick average a little below the slow one: a small share."""
    slow = rng.uniform(0.2, 0.8)
    return (
        slow * rng.uniform(0.93, 0.97),
        slow,
        slow * rng.uniform(0.985, 0.995),
        rng.uniform(0.02, 0.1),
        rng.uniform(0.2, 0.5),
    )


def headings(rng, about=math.pi):
    """angles about a direction, near the seam by default, and weights."""
    n = int(rng.integers(15, 25))
    angles = planar.wrap_angle(about + rng.uniform(-0.3, 0.3) + 0.4 * rng.normal(size=n))
    return angles, rng.exponential(size=n)


def few_headings(rng, count):
    """A few angles that have gathered turns, and tiny weights."""
    angles, weights = headings(rng, about=rng.choice([-2.0, 2.0]))
    return angles[:count] + 2 * math.pi * rng.integers(-4, 5, count), 1e-100 * (weights[:count] + 0.1)


def headings_mirrored(rng, about):
    """Two angles of one weight, as far to the left as to the right of 0 or of pi: their sines cancel exactly.

    With a power of two as the weight no product is rounded, so that they do whether or not the processor fuses a sum.
    """
    angle, weight = about - rng.uniform(0.1, 1.2), 2.0 ** rng.integers(-3, 4)
    return np.array([angle, -angle]), np.array([weight, weight])


def headings_alike(rng):
    """The same with angles that several particles share, each of a weight of its own."""
    angles, weights = headings(rng, about=2.0)
    angles[1::2] = angles[0]
    return angles, weights


def headings_without_weight(rng):
    """Angles of which those far off weigh nothing."""
    angles, weights = headings(rng, about=2.0)
    angles[::3], weights[::3] = -1.0, 0.0
    return angles, weights


@dataclass(frozen=True)
class Reach(metrics.Numbers):
    """The length of a ray, and to which side it is wrong."""

    def deviations(self, result, expected):
        (off,) = super().deviations(result, expected)
        more = "more" if result > expected else "less"
        way = "the way to what ends the ray first, an occupied cell or r_max"
        return [replace(off, words=f"your result is {off.amount:.3g} m {more} than {way}")]


HALF_A_CELL = Reach(0.055, "m", absolute=True)  # of maps with cells of 10 cm


def right_however_far(student, rng):
    """A property of `cast_ray`: right on a ray over thousands of cells, too; not asked of one that takes its time, nor
    of one that fails there, as one may that is tried with a change, and with a limit to its steps.
    """
    began, far, metric = seconds(), ray_over_thousands_of_cells(rng), HALF_A_CELL
    student(*ray_down_a_hall(rng))
    if FAR_TIMES * (seconds() - began) > LONGEST:
        return None
    try:
        result = student(*far)
    except Exception:
        return None
    if metric.equal(result, maps.walk_ray(*far)):
        return None
    return (
        "right so far, but not on a ray to a wall some 5,200 cells away that r_max = 600 m reaches (does yours take as many "
        "steps on every ray, or end after so many of them?)."
    )


# References that the library has in another form ---------------------------------------------------------------------


def _normal_log(x, std):
    return -0.5 * np.square(x / std) - np.log(std * math.sqrt(2 * math.pi))


def _no_half(x, std):
    return -np.square(x / std) - np.log(std * math.sqrt(2 * math.pi))


def _no_root(x, std):
    return -0.5 * np.square(x / std) - np.log(std * 2 * math.pi)


def _log_density(power=1.0, peak=None, exponent=2, sign=-1):
    """A slip in log N: the error divided by std**power, raised to `exponent`, `sign`; peak(std): what is subtracted."""
    peak = peak or (lambda std: np.log(std * math.sqrt(2 * math.pi)))

    def density(x, std):
        return sign * 0.5 * np.abs(x / std**power) ** exponent - peak(std)

    return density


def _normal(x, std):
    return np.exp(_normal_log(x, std))


def _logarithm(total):
    return float(np.log(total))


DENSITIES = (
    (_no_half, "The factor one half in the exponent is missing."),
    (
        lambda x, std: _normal_log(x, np.sqrt(std)),
        "You use std as if it were a variance: where a variance belongs, its square does.",
    ),
    (_log_density(power=0.5), "The error is divided by std and then squared: std is squared with it."),
    (_log_density(exponent=1), "The error divided by std is to be squared."),
    (_log_density(sign=1), "The exponent is negative: a large error makes p small."),
    (_no_root, "The root is missing: each density is divided by std * sqrt(2 pi)."),
    (
        _log_density(peak=lambda std: np.log(2 * math.pi * std**2)),
        "The root is missing: each density is divided by std * sqrt(2 pi).",
    ),
    (
        _log_density(peak=lambda std: np.log(std**2 * math.sqrt(2 * math.pi))),
        "Each density is divided by std * sqrt(2 pi), not by the variance times the root.",
    ),
    (_log_density(peak=np.log), "sqrt(2 pi) is missing: each density is divided by std * sqrt(2 pi)."),
    (
        _log_density(peak=lambda std: 0.5 * np.log(2 * math.pi)),
        "std is missing in the factor in front: each density is divided by std * sqrt(2 pi).",
    ),
    (
        _log_density(peak=lambda std: np.log(std * math.sqrt(2) * math.pi)),
        "The root covers 2 and pi both: each density is divided by std * sqrt(2 pi).",
    ),
    (
        _log_density(peak=lambda std: np.log(std * math.sqrt(2))),
        "pi is missing: each density is divided by std * sqrt(2 pi).",
    ),
    (
        _log_density(peak=lambda std: -np.log(std * math.sqrt(2 * math.pi))),
        "std * sqrt(2 pi) divides each density: its logarithm is subtracted.",
        "47e6de",
    ),
    (
        lambda x, std: _normal_log(x, std) / math.log(10),
        "That is the logarithm to base 10. log is the natural one here, np.log.",
    ),
)


def _lifted(x, std):
    """log N of a density that is kept from zero by something tiny."""
    return np.log(_normal(x, std) + 1e-300)


def _of_the_density(x, std):
    with np.errstate(divide="ignore"):
        return np.log(_normal(x, std))


ROUNDED_TO_ZERO = (
    (
        _of_the_density,
        "Where errors are large the density, or a product of some, is zero in float64, and the logarithm of 0 is -inf. Write down the logarithm's own formula.",
        "7652a1",
    ),
    (
        _lifted,
        "Where errors are large the density is zero in float64, and what you put in its place decides. Write down the logarithm's own formula.",
        "02d19b",
    ),
)


def _density_mistakes(exercise, variant, readings):
    """Slips in the density; variant(density, after=...) sums up densities of the readings, `after` is applied to it."""
    slips = [
        Mistake(variant(density), text, *(f"{exercise}-{end}" for end in id))
        for density, text, *id in (*DENSITIES, *ROUNDED_TO_ZERO)
    ]
    added = f"You added the densities. Independent {readings} multiply: their *logarithms* are added."
    return [*slips, Mistake(variant(_normal), added), Mistake(variant(_normal, after=_logarithm), added)]


def _end_points(pose, ranges, bearings):
    angle = pose[2] + bearings
    return pose[:2] + ranges[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def _field(grid, points, std):
    return float(_normal_log(grid.distance[grid.cell_of(points)], std).sum())


def distance_field_weight(grid, pose, ranges, bearings, std):
    """log p of a scan: the sum of log N(0, std^2) over the distances of its end points from the nearest obstacle."""
    return _field(grid, _end_points(pose, ranges, bearings), std)


def landmark_weight(pose, z, landmarks, std_range, std_bearing):
    """log p of ranges and bearings to known landmarks."""
    return float(weigh_landmarks(z, landmarks, std_range, std_bearing)(pose))


def beam_weight(ranges, expected, std):
    """log p of ranges, given the expected ones."""
    return float(_normal_log(ranges - expected, std).sum())


def sample_motion(states, u, dt, std_u, rng):
    """Each particle moved by its own noisy copy of the control."""
    return particles.sample_motion(states, u, dt, rng, cov_u=np.diag(np.square(std_u)))


def resample_roulette(weights, rng):
    """Indices by independent spins."""
    return particles.resample_roulette(weights, rng)


def resample_systematic(weights, rng):
    """Indices by one turn of the spoke wheel."""
    return particles.resample_systematic(weights, rng)


def log_sum_exp(log_weights):
    return float(logsumexp(log_weights))


def _around_the_mean(l):
    mean = l[np.isfinite(l)].mean()
    return mean + np.log(np.exp(l - mean).sum())


def multiply_weights(weights, likelihood, step, n):
    product = weights * likelihood
    return product / product.sum(), step % n == 0


def _cycle(weights=lambda w, p, k, n: w * p, due=lambda k, n: k % n == 0, share=lambda w: w / w.sum()):
    """A variant of `multiply_weights` in one of its parts."""
    return lambda w, p, k, n: (share(weights(w, p, k, n)), bool(due(k, n)))


def _depth(angle=None, of=lambda depth, b: depth / np.cos(b), seen=lambda d, near, far: (d >= near) & (d <= far)):
    """A variant of `scan_from_depth` in one of its parts; angle(offset, field of view), offset 1 at the left edge."""
    angle = angle or (lambda offset, fov: np.arctan(offset * math.tan(fov / 2)))

    def variant(depth, field_of_view, near, far):
        n = len(depth)
        b = angle((n / 2 - 0.5 - np.arange(n)) / (n / 2), field_of_view)
        kept = seen(depth, near, far)
        return of(depth, b)[kept], b[kept]

    return variant


def _evenly_from_edge_to_edge(depth, field_of_view, near, far):
    b, seen = np.linspace(1, -1, len(depth)) * field_of_view / 2, (depth >= near) & (depth <= far)
    return (depth / np.cos(b))[seen], b[seen]


def _at_the_limit(own):
    """What is not seen is kept, as a depth of `far`; own: as a range of `far`."""

    def variant(depth, field_of_view, near, far):
        seen = (depth >= near) & (depth <= far)
        ranges, bearings = scan_from_depth(np.where(seen, depth, far), field_of_view, near, far)
        return np.where(seen, ranges, far) if own else ranges, bearings

    return variant


def _kept_as_zeros(depth, field_of_view, near, far):
    """What is not seen is kept, with a range of 0."""
    seen = (depth >= near) & (depth <= far)
    ranges, bearings = _depth(seen=lambda d, near, far: np.ones(len(d), bool))(depth, field_of_view, near, far)
    return np.where(seen, ranges, 0.0), bearings


def _within(near, far, ranges, bearings):
    """Of a scan the rays whose length lies between near and far."""
    kept = (ranges >= near) & (ranges <= far)
    return ranges[kept], bearings[kept]


def should_resample(weights, threshold):
    """True when the effective size is below threshold times M."""
    return particles.should_resample(weights, threshold)


def circular_mean(angles, weights):
    """Weighted mean direction."""
    return particles.circular_mean(angles, weights)


def recover(w_mean, w_slow, w_fast, alpha_slow, alpha_fast):
    """Share of random particles, and both averages brought up to date."""
    return mcl.recover(w_mean, w_slow, w_fast, alpha_slow, alpha_fast)


# Wrong variants ------------------------------------------------------------------------------------------------------


BEARING_ERRORS = {  # what is made of the difference of measured and expected bearing
    True: planar.wrap_angle,
    False: lambda difference: difference,
    "positive": lambda difference: difference % (2 * math.pi),
    "degrees": lambda difference: np.rad2deg(planar.wrap_angle(difference)),
    "sine": np.sin,
    "chord": lambda difference: 2 * np.sin(difference / 2),
}


def _landmarks(
    density=None,
    wrap=True,
    turn=1,
    swap=False,
    back=False,
    square=False,
    log=True,
    peak=True,
    parts=(1, 1),
    stds=None,
    after=float,
):
    density = density or _normal_log
    exchanged = stds

    def variant(pose, z, landmarks, std_range, std_bearing):
        dx, dy = (pose[:2] - landmarks if back else landmarks - pose[:2]).T
        bearing = np.arctan2(dx, dy) if swap else np.arctan2(dy, dx)
        difference = z[:, 1] - bearing + turn * pose[2]
        if wrap == "expected":
            error = z[:, 1] - planar.wrap_angle(bearing - pose[2])
        elif wrap == "quotient":
            error = std_bearing * planar.wrap_angle(difference / std_bearing)
        else:
            error = BEARING_ERRORS[wrap](difference)
        stds = (std_range**2, std_bearing**2) if square else (std_range, std_bearing)
        stds = stds if exchanged is None else tuple(stds[k] for k in exchanged)
        terms = parts[0] * density(z[:, 0] - np.hypot(dx, dy), stds[0]) + parts[1] * density(error, stds[1])
        total = terms.sum() if peak else terms.sum() + len(z) * np.log(2 * math.pi * stds[0] * stds[1])
        return after(total if log else np.exp(total))

    return variant


def _left_after(beams):
    """What is left of the product after a wrong number of beams, in words; None where it is no number of beams."""
    left = 0.01**beams
    if beams < 0:
        return None
    if left > 0:
        return f"0.01 to the power {beams:g} is {left:.2g} in float64, still above zero: count on"
    if beams % 1 == 0:
        return f"0.01 to the power {beams:g} is zero, but not for the first time: fewer beams are enough"
    return (
        f"0.01 to the power {beams:g} is zero, but beams are whole, and the first whole number with that is asked for"
    )


def _landmark_plain_product(pose, z, landmarks, std_range, std_bearing):
    one = [landmark_weight(pose, z[k : k + 1], landmarks[k : k + 1], std_range, std_bearing) for k in range(len(z))]
    return _log_of_the_product(np.array(one))


def _ranges_wrapped(pose, z, landmarks, std_range, std_bearing):
    expected = np.hypot(*(landmarks - pose[:2]).T)
    z = np.column_stack([expected + planar.wrap_angle(z[:, 0] - expected), z[:, 1]])
    return landmark_weight(pose, z, landmarks, std_range, std_bearing)


def _bearings_folded(pose, z, landmarks, std_range, std_bearing):
    bearings = np.arctan2(*(landmarks - pose[:2]).T[::-1]) - pose[2]
    folded = np.column_stack([z[:, 0], bearings + np.arcsin(np.sin(z[:, 1] - bearings))])
    return landmark_weight(pose, folded, landmarks, std_range, std_bearing)


def _bearings_by_von_mises(pose, z, landmarks, std_range, std_bearing):
    dx, dy = (landmarks - pose[:2]).T
    ranges = _normal_log(z[:, 0] - np.hypot(dx, dy), std_range)
    error, kappa = z[:, 1] - np.arctan2(dy, dx) + pose[2], 1 / std_bearing**2
    return float((ranges + kappa * (np.cos(error) - 1) - np.log(2 * math.pi * i0e(kappa))).sum())


def _landmarks_that_fit_best(pose, z, landmarks, std_range, std_bearing):
    def best(reading):
        return max(landmark_weight(pose, reading[None], mark[None], std_range, std_bearing) for mark in landmarks)

    return float(sum(map(best, z)))


def _products_added(pose, z, landmarks, std_range, std_bearing):
    one = [landmark_weight(pose, z[k : k + 1], landmarks[k : k + 1], std_range, std_bearing) for k in range(len(z))]
    return _logarithm(np.exp(one).sum())


def _beams(density, after=float):
    return lambda ranges, expected, std: after(density(ranges - expected, std).sum())


def _errors_added_first(ranges, expected, std):
    return float(-0.5 * (np.sum(ranges - expected) / std) ** 2 - len(ranges) * np.log(std * math.sqrt(2 * math.pi)))


def _field_with(density, after=float):
    def variant(grid, pose, ranges, bearings, std):
        return after(density(grid.distance[grid.cell_of(_end_points(pose, ranges, bearings))], std).sum())

    return variant


def _field_rows_for_columns(grid, pose, ranges, bearings, std):
    column, row = grid.cell_of(_end_points(pose, ranges, bearings))
    rows, columns = grid.distance.shape
    return float(_normal_log(grid.distance[row.clip(0, rows - 1), column.clip(0, columns - 1)], std).sum())


def _field_straight_ahead(grid, pose, ranges, bearings, std):
    return _field(grid, _end_points(pose, ranges, np.zeros_like(bearings)), std)


def _field_one_peak(grid, pose, ranges, bearings, std):
    return _field_no_peak(grid, pose, ranges, bearings, std) - math.log(std * math.sqrt(2 * math.pi))


def _field_mirrored(grid, pose, ranges, bearings, std):
    return _field(grid, _end_points(pose, ranges, -bearings), std)


def _field_swapped(grid, pose, ranges, bearings, std):
    offset = _end_points(pose, ranges, bearings) - pose[:2]
    return _field(grid, pose[:2] + offset[:, ::-1], std)


def _field_at_the_robot(grid, pose, ranges, bearings, std):
    return float(_normal_log(grid.distance[grid.cell_of(pose[:2])], std).sum())


def _log_of_the_product(log_terms):
    with np.errstate(divide="ignore"):
        return float(np.log(np.prod(np.exp(log_terms))))


def _field_plain_product(grid, pose, ranges, bearings, std):
    d = grid.distance[grid.cell_of(_end_points(pose, ranges, bearings))]
    return _log_of_the_product(_normal_log(d, std))


def _field_world(grid, pose, ranges, bearings, std):
    return _field(grid, _end_points(np.array([*pose[:2], 0.0]), ranges, bearings), std)


def _field_origin(grid, pose, ranges, bearings, std):
    return _field(grid, _end_points(np.array([0.0, 0.0, pose[2]]), ranges, bearings), std)


def _field_cells(grid, pose, ranges, bearings, std):
    d = grid.distance[grid.cell_of(_end_points(pose, ranges, bearings))] / grid.resolution
    return float(_normal_log(d, std).sum())


def _field_shrunk(grid, pose, ranges, bearings, std):
    d = grid.distance[grid.cell_of(_end_points(pose, ranges, bearings))] * grid.resolution
    return float(_normal_log(d, std).sum())


def _field_of_single_cells(grid, pose, ranges, bearings, std):
    cells = np.unique(np.column_stack(grid.cell_of(_end_points(pose, ranges, bearings))), axis=0)
    return float(_normal_log(grid.distance[*cells.T], std).sum())


def _field_of_all_rows_and_columns(grid, pose, ranges, bearings, std):
    rows, columns = grid.cell_of(_end_points(pose, ranges, bearings))
    return float(_normal_log(grid.distance[np.ix_(rows, columns)], std).sum())


def _field_in_degrees(grid, pose, ranges, bearings, std):
    angle = np.rad2deg(pose[2] + bearings)
    return _field(grid, pose[:2] + ranges[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]), std)


def _field_mean(grid, pose, ranges, bearings, std):
    return distance_field_weight(grid, pose, ranges, bearings, std) / len(ranges)


def _field_probability(grid, pose, ranges, bearings, std):
    return math.exp(distance_field_weight(grid, pose, ranges, bearings, std))


def _field_no_peak(grid, pose, ranges, bearings, std):
    d = grid.distance[grid.cell_of(_end_points(pose, ranges, bearings))]
    return float((-0.5 * np.square(d / std)).sum())


def _ray_to_what_is_not_free(grid, pose, bearing, r_max):
    return maps.walk_ray(replace(grid, cells=np.where(grid.cells == maps.FREE, 0, maps.OCCUPIED)), pose, bearing, r_max)


def _ray_in_cells(grid, pose, bearing, r_max):
    return maps.walk_ray(grid, pose, bearing, r_max) / grid.resolution


def _ray_without_heading(grid, pose, bearing, r_max):
    return maps.walk_ray(grid, np.array([*pose[:2], 0.0]), bearing, r_max)


def _ray_without_bearing(grid, pose, bearing, r_max):
    return maps.walk_ray(grid, pose, 0.0, r_max)


def _ray_swapped(grid, pose, bearing, r_max):
    return maps.walk_ray(grid, np.array([*pose[:2], math.pi / 2 - pose[2] - bearing]), 0.0, r_max)


def _ray_to_infinity(grid, pose, bearing, r_max):
    r = maps.walk_ray(grid, pose, bearing, r_max)
    return r if r < r_max else math.inf


def _ray_without_end(grid, pose, bearing, r_max):
    r = maps.walk_ray(grid, pose, bearing, 1000.0)
    return r if r < 1000.0 else r_max


def _ray_reversed(grid, pose, bearing, r_max):
    return maps.walk_ray(grid, pose, -bearing, r_max)


def _ray_mirrored(in_x, grid, pose, bearing, r_max):
    ray = pose[2] + bearing
    return maps.walk_ray(grid, np.array([*pose[:2], math.pi - ray if in_x else -ray]), 0.0, r_max)


def _ray_by_halves(grid, pose, bearing, r_max):
    near, far, angle = 0.0, r_max, pose[2] + bearing
    while far - near > grid.resolution / 20:
        middle = (near + far) / 2
        hit = grid.at(pose[:2] + middle * np.array([math.cos(angle), math.sin(angle)])) == maps.OCCUPIED
        near, far = (near, middle) if hit else (middle, far)
    return far


def _hits(grid, pose, bearing, r_max, step):
    """Distances, `step` apart, at which a ray is in an occupied cell."""
    angle, r = pose[2] + bearing, np.arange(0, r_max, step)
    return r[grid.at(pose[:2] + r[:, None] * [math.cos(angle), math.sin(angle)]) == maps.OCCUPIED]


def _ray_in_steps(grid, pose, bearing, r_max, cells):
    return _hits(grid, pose, bearing, r_max, cells * grid.resolution).min(initial=r_max)


def _ray_in_places(grid, pose, bearing, r_max, places):
    return _hits(grid, pose, bearing, r_max, r_max / (places - 1)).min(initial=r_max)


def _steps_of_a_ray(grid, pose, bearing, r_max, cells):
    return _ray_in_steps(grid, pose, bearing, r_max, cells) / (cells * grid.resolution)


def _ray_to_the_last(grid, pose, bearing, r_max):
    return float([r_max, *_hits(grid, pose, bearing, r_max, grid.resolution / 2)][-1])


def _up_to_the_share(weights, threshold):
    return particles.effective_size(weights) <= threshold * len(weights)


def _above_the_share(weights, threshold):
    return particles.effective_size(weights) > threshold * len(weights)


def _below_a_share_of_the_sum(weights, threshold):
    return particles.effective_size(weights) < threshold * weights.sum()


def _by_the_variance(weights, threshold):
    return weights.var() > threshold


RESAMPLING_SLIPS = (
    (_above_the_share, "The other way round: resample when the effective size is low."),
    (
        lambda w, t: not particles.should_resample(w, t),
        "The other way round: resample when the effective size is low.",
    ),
    (
        _below_a_share_of_the_sum,
        "Compare with the share of the *number* of particles, len(weights), not of the sum of the weights.",
    ),
    (
        lambda w, t: _from_the_sum_of_squares(w) < t * len(w),
        "Your effective size needs weights that add up to 1, and these do not: use effective_size(weights).",
    ),
    (
        lambda w, t: particles.effective_size(w) < 0.5 * len(w),
        "You compare with half of the particles. The share is handed over: threshold * len(weights).",
    ),
    (
        lambda w, t: particles.effective_size(w) < (1 - t) * len(w),
        "Compare with the share `threshold` itself, not with 1 - threshold.",
    ),
    (
        lambda w, t: particles.effective_size(w) < t * np.count_nonzero(w),
        "You count only particles that weigh something. The share is one of all particles, len(weights).",
    ),
    (
        _by_the_variance,
        "You compare the variance of the weights, which grows with their size, with a share: compare effective_size(weights).",
    ),
    (
        lambda w, t: 1 / (1 + np.var(w)) < t,
        "1 / (1 + var(w)) is the effective share of weights of mean 1: divide them by their mean first, or call effective_size(weights).",
    ),
    (
        lambda w, t: w.max() / w.sum() > t,
        "You compare the share of the heaviest particle. Many of middling weight can be worth few as well: effective_size(weights).",
    ),
    (
        lambda w, t: w.sum() < t * len(w),
        "You compare the sum of the weights, or their mean. Compare effective_size(weights).",
        "should_resample-8c6474",
    ),
    (
        _up_to_the_share,
        "Right but for an effective size of exactly the share: below it means `<`, not `<=`.",
        "should_resample-087af3",
    ),
    (
        lambda w, t: True,
        "You resample on every draw of this check. With even weights that only loses particles.",
        "should_resample-005c5c",
    ),
    (
        lambda w, t: False,
        "You resample on no draw of this check. Do you compare with a bare share? The effective size counts particles: threshold * len(weights).",
        "should_resample-15c3c9",
    ),
)


def _motion(std=lambda s: s, shared=False, on_pose=False, none=False):
    def variant(states, u, dt, std_u, rng):
        if on_pose:
            return odometry.step(states, u, dt) + rng.standard_normal(states.shape) * (*std_u, std_u[1])
        noise = rng.standard_normal((1 if shared else len(states), 2)) * (0 if none else std(np.asarray(std_u)))
        return odometry.step(states, u + noise, dt)

    return variant


def _spin(weights, rng, scale=None, shift=0):
    """Indices by independent spins up to `scale` (by default the sum of the weights), moved by `shift`."""
    ends = np.cumsum(weights)
    return np.searchsorted(ends, rng.random(len(ends)) * (ends[-1] if scale is None else scale)) + shift


def _searched_in_shares(weights, rng):
    """The slip of looking for the spin among the shares themselves, kept inside the array afterwards."""
    return np.clip(np.searchsorted(weights / weights.sum(), rng.random(len(weights))), 0, len(weights) - 1)


def _spokes_to_the_end(weights, rng, more=0, around=np.inf):
    """Spokes from 0 to W, both included, before the turn, which is that of so many spokes `more` or less; those that go
    beyond `around` W come in again at 0.
    """
    ends, m = np.cumsum(weights), len(weights)
    places = (rng.random() / (m + more) + np.linspace(0, 1, m)) % around
    return np.minimum(np.searchsorted(ends, places * ends[-1]), m - 1)


def _turned_by_less(weights, rng):
    """The turn is one of a wheel whose weights add up to 1."""
    ends, m = np.cumsum(weights), len(weights)
    return np.minimum(np.searchsorted(ends, (rng.random() + np.arange(m) * ends[-1]) / m), m - 1)


def _one_step_a_spoke(weights, rng):
    """`if` in place of `while`: a spoke passes one end at most."""
    m, i, end, found = len(weights), 0, weights[0], []
    first = rng.random() * weights.sum() / m
    for k in range(m):
        if first + k * weights.sum() / m > end and i < m - 1:
            i, end = i + 1, end + weights[i + 1]
        found.append(i)
    return np.array(found)


def _turn(weights, places, scale=None):
    """Indices that M evenly spaced spokes meet, each moved by `places` of a gap."""
    ends, m = np.cumsum(weights), len(weights)
    return np.searchsorted(ends, (places + np.arange(m)) * (ends[-1] if scale is None else scale) / m)


def _largest(weights, rng):
    return np.full(len(weights), np.argmax(weights))


def _uniform_choice(weights, rng):
    return rng.integers(0, len(weights), len(weights))


def _recover(w_slow, w_fast):
    return max(0.0, 1 - w_fast / w_slow), w_slow, w_fast


def _share(share):
    """Right averages and another share of them."""

    def variant(*args):
        _, slow, fast = mcl.recover(*args)
        return share(slow, fast), slow, fast

    return variant


def _averaged(change):
    """Averages by another rule change(w, w_mean, alpha), and the share of those."""
    return lambda m, s, f, a, b: _recover(change(s, m, a), change(f, m, b))


RECOVERIES = (
    Mistake(
        _share(lambda s, f: f / s), "That is the ratio itself. The share is what it lacks to 1: 1 - w_fast / w_slow."
    ),
    Mistake(
        _share(lambda s, f: min(1.0, f / s)),
        "That is the ratio itself. The share is what it lacks to 1: 1 - w_fast / w_slow.",
    ),
    Mistake(_share(lambda s, f: min(0.0, 1 - f / s)), "You took the smaller of the two. Take the larger, max(0, ...)."),
    Mistake(_share(lambda s, f: max(1.0, 1 - f / s)), "The limit below is 0, not 1: max(0, 1 - w_fast / w_slow)."),
    Mistake(_share(lambda s, f: abs(1 - f / s)), "When things go well nothing is replaced: below 0 means 0, no abs."),
    Mistake(_share(lambda s, f: max(0.0, f / s - 1)), "The sign is wrong: the share is large when w_fast is *small*."),
    Mistake(_share(lambda s, f: max(0.0, s - f)), "The share has no unit: divide by w_slow, 1 - w_fast / w_slow."),
    Mistake(_share(lambda s, f: max(0.0, (1 - f) / s)), "Brackets: 1 - w_fast / w_slow, not (1 - w_fast) / w_slow."),
    Mistake(_share(lambda s, f: 100 * max(0.0, 1 - f / s)), "A share lies between 0 and 1; yours is in percent."),
    Mistake(_share(lambda s, f: round(max(0.0, 1 - f / s), 2)), "Return the share as it comes out, without rounding."),
    Mistake(
        lambda m, s, f, a, b: (max(0.0, 1 - m / s), *mcl.recover(m, s, f, a, b)[1:]),
        "You compare the mean weight itself. Compare its quick average w_fast: single scans jump.",
    ),
    Mistake(_averaged(lambda w, m, a: a * (m - w)), "That is the change alone. It is added to the old average."),
    Mistake(_averaged(lambda w, m, a: a * m), "The old average is lost: w + alpha * (w_mean - w)."),
    Mistake(_averaged(lambda w, m, a: m), "alpha is missing: the averages jump to w_mean at once."),
    Mistake(_averaged(lambda w, m, a: w * (1 + a * (m - w))), "You multiplied the average by its change. It is added."),
    Mistake(
        _averaged(lambda w, m, a: (1 - a) * w + m), "alpha is missing before w_mean: (1 - alpha) * w + alpha * w_mean."
    ),
    Mistake(lambda m, s, f, a, b: _recover(s + a * (m - s), f + a * (m - f)), "w_fast has its own alpha, alpha_fast."),
    Mistake(lambda m, s, f, a, b: _recover(s + b * (m - s), f + b * (m - f)), "w_slow has its own alpha, alpha_slow."),
    Mistake(lambda m, s, f, a, b: _recover(s, f + b * (m - f)), "w_slow has not been brought up to date."),
    Mistake(lambda m, s, f, a, b: _recover(s + a * (m - s), f), "w_fast has not been brought up to date."),
    Mistake(
        lambda m, s, f, a, b: (max(0.0, 1 - f / (s + a * (m - s))), *mcl.recover(m, s, f, a, b)[1:]),
        "The share is that of the new w_slow and the old w_fast. Bring both up to date first.",
    ),
    Mistake(
        lambda m, s, f, a, b: (max(0.0, 1 - (f + b * (m - f)) / s), *mcl.recover(m, s, f, a, b)[1:]),
        "The share is that of the new w_fast and the old w_slow. Bring both up to date first.",
    ),
    Mistake(
        lambda m, s, f, a, b: (lambda slow: _recover(slow, f + b * (slow - f)))(s + a * (m - s)),
        "w_fast moves toward w_mean, not toward w_slow.",
    ),
)


def _from_the_sum_of_squares(weights):
    return 1 / np.square(weights).sum()


def _draws(resample, weights, rng, runs):
    """Share of the draws that each index gets over several runs; in words what are no M valid indices."""
    counts = _counts(resample, weights, rng, runs)
    return counts if isinstance(counts, str) else counts.sum(0) / counts.sum()


def _counts(resample, weights, rng, runs):
    """How often each index comes out in each of several runs, shape (runs, M); in words what are no M valid indices."""
    counts, m = [], len(weights)
    for _ in range(runs):
        drawn = resample(weights.copy(), rng)
        if type(drawn) is tuple:
            return "expected an array of indices, got a tuple, which `states[...]` takes for one place, not for many"
        index = np.asarray(drawn)
        if index.shape != (m,) or index.dtype.kind not in "iu":
            return f"expected {m} whole numbers, got shape {index.shape} of {index.dtype}"
        if index.min() < 0 or index.max() >= m:
            wrong = index.min() if index.min() < 0 else index.max()
            return f"an index {wrong} came out of {m} particles, which count from 0 to {m - 1}"
        counts.append(np.bincount(index, minlength=m))
    return np.array(counts)


def _listens(draw, lead=""):
    """A property: what is drawn hangs on the rng, and on nothing else. `draw(function, rng)` gives one result; `lead`
    says of what.

    A wheel of few particles has few results, so one pair of equal ones proves nothing: eight seeds are compared.
    """

    def check(function, rng):
        seeds = rng.integers(2**32, size=8)
        first = [np.asarray(draw(function, np.random.default_rng(seed))) for seed in seeds]
        again = [np.asarray(draw(function, np.random.default_rng(seed))) for seed in seeds]
        if all(np.array_equal(first[0], other) for other in first + again):
            drawn_from = np.random.default_rng(seeds[0])
            draw(function, drawn_from)
            if drawn_from.bit_generator.state != np.random.default_rng(seeds[0]).bit_generator.state:
                return f"{lead}you draw from `rng`, but 8 different seeds give the same result. Is what you draw far too small, or not used?"
            return f"{lead}whatever `rng` is given, the same comes out: draw the random numbers from it."
        if not all(map(np.array_equal, first, again)):
            return f"{lead}two runs with the same seed differ: draw from the `rng` you are given alone, and keep nothing for the next call."
        drawn_from = np.random.default_rng(seeds[0])
        first, *later = [np.asarray(draw(function, drawn_from)) for _ in seeds]
        if all(np.array_equal(first, other) for other in later):
            return f"{lead}called again with the same `rng` it gives the same once more: draw from `rng` itself, which goes on from number to number. A copy of it begins where it began before."
        return None

    return check


_drawn_from_the_rng = _listens(lambda f, rng: f(np.linspace(0.5, 1.5, 40), rng))


def _moved(particles, lead=""):
    u, std_u = np.array([1.0, 0.2]), np.array([0.1, 0.2])
    return _listens(lambda f, rng: f(np.zeros((particles, 3)), u, 0.5, std_u, rng), lead)


_moved_by_the_rng = _moved(3)
_moved_alone_by_the_rng = _moved(1, "of a single particle, but not for several: ")


def _valid(resample, rng):
    for weights in (np.array([0.1, 0.7, 0.1, 0.1]), np.array([2.5])):
        found = _draws(resample, weights, rng, 3)
        if isinstance(found, str):
            return f"with the weights {weights.tolist()}: {found}.{_counts_words(resample, rng)}"
    return None


def _counts_words(resample, rng):
    """That the numbers look like how often each index was drawn, as one more sentence."""
    weights = np.array([0.1, 0.3, 0.1, 0.2, 0.2, 0.1])
    sums = [np.sum(resample(weights, rng)) for _ in range(6)]
    if any(total != len(weights) for total in sums):
        return ""
    return (
        " Your numbers add up to the number of particles: is it counted how often each comes out? Return the indices."
    )


WEIGHTS = (
    np.array([0.1, 0.7, 0.1, 0.1, 0.0]),
    np.array([0.5, 0.25, 0.15, 0.1]),
    np.array([3.0, 1.0]),
    np.array([0.0, 0.6, 0.0, 0.4]),
)
SHARE_OFF = 0.06  # of 2000 draws: by the binomial law a right roulette is farther off in one of some million checks
VARIES = 0.12  # the mean of ten variances of 600 counts: six standard deviations
HALF_VARIES = 1.8  # 600 counts of variance 2.5: five standard deviations of their own variance below it


def _proportional(resample, rng):
    for weights in WEIGHTS:
        found, expected = _draws(resample, weights, rng, 2000 // len(weights)), weights / weights.sum()
        if isinstance(found, str):
            return found + "."
        k = int(np.argmax(np.abs(found - expected)))
        if abs(found[k] - expected[k]) > SHARE_OFF:
            told = (
                f"with the weights {weights.tolist()} index {k} gets {100 * found[k]:.0f} % of the draws "
                f"instead of {100 * expected[k]:.0f} %."
            )
            return told + (_shifted(found, expected) or _shares_of_another_rule(resample, rng))
    return None


OTHER_RULES = (
    (np.square, "These are the shares of the squares of the weights: each counts as it is."),
    (np.sqrt, "These are the shares of the roots of the weights: each counts as it is."),
    (np.exp, "These are the shares of exp(weights): they are weights already, no logarithms."),
)


def _shares_of_another_rule(resample, rng):
    """That all shares are those of weights that were changed first, as one more sentence."""
    found = [_draws(resample, weights, rng, 2000 // len(weights)) for weights in WEIGHTS]
    for rule, words in OTHER_RULES:
        if not any(isinstance(shares, str) for shares in found):
            wanted = (rule(weights) / rule(weights).sum() for weights in WEIGHTS)
            if all(np.abs(shares - right).max() < SHARE_OFF for shares, right in zip(found, wanted)):
                return f" {words}"
    return ""


def _shifted(found, expected):
    """That each index has the share of a neighbor, as one more sentence."""
    low = np.array([expected[:2].sum(), *expected[2:], 0.0])
    if np.abs(found - low).max() < SHARE_OFF:
        return " Each index gets the share of the one behind it, the first that of two: is it one too low?"
    for neighbor, shares, slip in (("before", expected[:-2], "high"), ("behind", expected[2:], "low")):
        apart = np.ptp(shares) > 2 * SHARE_OFF if shares.size else False
        if apart and np.abs(found[1:-1] - shares).max() < SHARE_OFF:
            return f" Between the first and the last, each index gets the share of the one {neighbor} it: is it one too {slip}?"
    clearly = np.abs(found - expected).max() > 2 * SHARE_OFF  # a share that is a little off looks like a neighbor's
    if clearly and np.abs(np.sort(found) - np.sort(expected)).max() < SHARE_OFF:
        return (
            " The shares are the right ones, but those of other indices: has something been sorted, or turned around?"
        )
    return ""


def _comes_twice(resample, rng):
    """A heavy index against draws of which each comes out once, as without replacement."""
    weights = np.array([0.1, 0.7, 0.1, 0.1])
    if any(len(set(np.asarray(resample(weights.copy(), rng)).tolist())) < len(weights) for _ in range(50)):
        return None
    return (
        f"with the weights {weights.tolist()} no index came out twice in 50 calls: a heavy one must be drawn as often as its "
        "weight asks for."
    )


SCALES = (1e-9, 1e6)


def _of_any_sum(resample, rng):
    """Shares by weights that are tiny, and by huge ones."""
    for weights in (scale * WEIGHTS[1] for scale in SCALES):
        found, expected = _draws(resample, weights, rng, 500), weights / weights.sum()
        if isinstance(found, str):
            return f"with the weights {weights.tolist()}: {found}."
        if np.abs(found - expected).max() > SHARE_OFF:
            return (
                f"with the weights {weights.tolist()} the indices get {np.round(100 * found).astype(int).tolist()} % of the "
                f"draws instead of {np.round(100 * expected).astype(int).tolist()} %: the weights may have any sum, a tiny "
                "or a huge one as well."
            )
    return None


def _of_whole_numbers(resample, rng):
    """Shares by whole numbers; asked where those by decimals are right."""
    weights, raised = np.array([1, 7, 1, 1]), ""
    try:
        found = _draws(resample, weights, rng, 500)
    except Exception as error:  # as of a division in place
        found, raised = np.zeros(4), f", where it raises {type(error).__name__}"
    if isinstance(found, np.ndarray) and np.abs(found - weights / weights.sum()).max() < SHARE_OFF:
        return None
    return (
        f"right for decimals, but not for the weights {weights.tolist()}, which are whole numbers{raised}. Does it divide in place, or "
        "write into an array of the kind that is given, made with `copy` or `zeros_like`? Such an array takes no decimals: "
        "`dtype=float` makes it one of decimals."
    )


MANY = np.tile([0.02, 0.04], 200)  # weights, of which the last is a heavy one
TURNS, FEWEST, MOST, APART = 40, 1, 105, 600.0  # 27 or 53 draws of each are expected, and a chi-square sum of 399


def _is_right_of_many(resample, rng):
    """Many weights of two sizes: each comes out, none far too often: the spins reach from 0 to W, no farther."""
    found = _draws(resample, MANY, rng, TURNS)
    if isinstance(found, str):
        return f"with {len(MANY)} weights: {found}."
    counts, expected = found * len(MANY) * TURNS, MANY / MANY.sum() * len(MANY) * TURNS
    off, weights = np.abs(counts - expected), f"{len(MANY)} weights, 0.02 and 0.04 by turns"
    chi_square = (off**2 / expected).sum()
    if not FEWEST <= counts.min().round() <= counts.max().round() <= MOST:
        k = int(np.argmax(off))
        return (
            f"of {weights}, index {k} came out {counts[k]:.0f} times in {TURNS} calls, where about "
            f"{expected[k]:.0f} are expected: do your spins reach from 0 to the sum W, and no farther?"
        )
    if chi_square >= APART:
        return (
            f"in {TURNS} calls with {weights}, the counts lie farther from their shares than chance explains: the sum of "
            f"(count - expected)^2 / expected is {chi_square:.0f}, where about {len(MANY)} is to be expected."
        )
    return None


def _is_right_of_one_heavy(resample, rng):
    """Many light weights and one that is as heavy as all of them together: who draws candidates and takes or refuses
    them must go on until one is taken.
    """
    weights, k = np.ones(201), int(rng.integers(201))
    weights[k] = 200.0
    found = _draws(resample, weights, rng, 10)
    if isinstance(found, str):
        return f"with {len(weights)} weights: {found}."
    if abs(found[k] - 0.5) < SHARE_OFF:
        return None
    return (
        f"with 200 weights of 1 and one of 200, that one gets {100 * found[k]:.0f} % of the draws instead of 50 %: the share "
        "is that of the weight, however many light ones there are beside it."
    )


THOUSAND, CALLS = np.tile([0.02, 0.04], 500), 32
PATIENT = 0.4  # seconds of processor time for them: a slow but right roulette is called less often
FAR = float(chdtri(len(THOUSAND) - 1, 1e-9))  # a right roulette is farther off in one of a thousand million checks


def _is_right_of_a_thousand(resample, rng):
    """Intervals so narrow that ends with few digits spoil them."""
    counts, calls, began = np.zeros(len(THOUSAND)), 0, seconds()
    while calls < CALLS and seconds() - began < PATIENT:
        found, calls = _counts(resample, THOUSAND, rng, 1), calls + 1
        if isinstance(found, str):
            return f"with {len(THOUSAND)} weights: {found}."
        counts += found[0]
    expected = calls * len(THOUSAND) * THOUSAND / THOUSAND.sum()
    chi_square = ((counts - expected) ** 2 / expected).sum()
    if chi_square < FAR:
        return None
    return (
        f"in {calls} calls with {len(THOUSAND)} weights, 0.02 and 0.04 by turns, the counts lie farther from their shares "
        f"than chance explains: the sum of (count - expected)^2 / expected is {chi_square:.0f}, where about "
        f"{len(THOUSAND)} is to be expected. Have the ends of the intervals all their digits?"
    )


EACH_SPIN = "each spin must reach over the whole wheel, and none may depend on another"


def _spins_are_independent(resample, rng):
    counts = _counts(resample, np.full(10, 0.1), rng, 600)
    if isinstance(counts, str):
        return f"with 10 equal weights: {counts}."
    variance = float(counts.var(0).mean())
    if variance < 0.9 - VARIES:
        return f"with 10 equal weights a count varies by {variance:.2f} instead of 0.9 (variance of a binomial): {EACH_SPIN}."
    if variance > 0.9 + VARIES:
        return f"some spins go together: with 10 equal weights a count varies by {variance:.2f} instead of 0.9 (variance of a binomial): {EACH_SPIN}."
    half = float(counts[:, :5].sum(1).var())
    if half < HALF_VARIES:
        return (
            f"with 10 equal weights the draws from one half of the wheel vary by {half:.1f} instead of 2.5: {EACH_SPIN}. Does each spin start "
            "where the last one ended?"
        )
    return None


def _spokes_are_even(resample, rng):
    """Counts of a few weights, and of so many that ends of intervals with few digits spoil them."""
    few, many = np.array([0.05, 0.3, 0.15, 0.22, 0.28]), np.linspace(0.02, 0.06, 1000)
    for weights, runs, told in ((few, 200, f"the weights {few.tolist()}"), (many, 3, "1000 weights, 0.02 to 0.06")):
        found = _counts(resample, weights, rng, runs)
        if isinstance(found, str):
            return f"with {told}: {found}."
        wanted = len(weights) * weights / weights.sum()
        for counts in found:
            off = np.abs(counts - wanted)
            if off.max() >= 1 + 1e-9:
                k = int(np.argmax(off))
                return (
                    f"with {told}, index {k} with M w / W = {wanted[k]:.2f} was drawn {counts[k]} times: evenly spaced "
                    "spokes meet it either the next lower or the next higher whole number of times."
                )
    return None


def _equal_weights_stay(resample, rng):
    if (np.sort(resample(np.full(8, 0.125), rng)) != np.arange(8)).any():
        return "with equal weights every particle must come out exactly once."
    return None


class _LateSpin(np.random.Generator):
    """Its uniform numbers are nearly 1, as one in a thousand million is."""

    LATE = 1 - 1e-9

    def random(self, size=None, *args, **kwargs):
        return self.LATE if size is None else np.full(size, self.LATE)

    def uniform(self, low=0.0, high=1.0, size=None):
        return low + (high - low) * self.random(size)


def _turn_is_one_gap(resample, rng):
    """The first spoke of the farthest turn against the first of eight equal weights."""
    index = np.asarray(resample(np.full(8, 0.125), _LateSpin(np.random.PCG64(0))))
    if index.shape == (8,) and index.dtype.kind in "iu" and index.min() > 0 and _is_a_wheel(resample, rng):
        return "with a random number of nearly 1 the wheel turns past the first of 8 equal weights: at most one gap, W / M."
    return None


class _EarlySpin(_LateSpin):
    """Its uniform numbers are nearly 0."""

    LATE = 1e-9


def _spokes_fill_the_wheel(resample, rng):
    """Equal weights against the least and the farthest turn: a gap that is not W / M leaves one of them out."""
    for spin, words in ((_EarlySpin, "0"), (_LateSpin, "1")):
        index = np.sort(resample(np.full(64, 0.25), spin(np.random.PCG64(0))))
        if not np.array_equal(index, np.arange(64)):
            return (
                f"with a random number of nearly {words} not every one of 64 equal weights comes out exactly once: are the "
                "spokes W / M apart, the first one between 0 and W / M?"
            )
    return None


REACH, WHEEL_TURNS = 0.02, 1500  # of a gap: 30 of so many turns end within it, and none in one of some trillion checks


def _turns_all_the_way(resample, rng):
    """Two weights that only the farthest turns, or the least ones, do not both meet once."""
    for weights, words in (((1 - REACH, 1 + REACH), "far"), ((1 + REACH, 1 - REACH), "little")):
        if all(np.sum(resample(np.array(weights), rng)) == 1 for _ in range(WHEEL_TURNS)):
            return (
                f"in {WHEEL_TURNS} calls with the weights {list(weights)} both came out once each time. A wheel that is turned {words} "
                "enough meets one of them twice: the turn is one from 0 to W / M, with nothing left out."
            )
    return None


QUARTER_TURNS, QUARTER_OFF = 1000, 0.08  # six standard deviations of a quarter of so many turns


def _turns_evenly(resample, rng):
    """How far the wheel is turned, in quarters of a gap: the first four of five weights share the first gap."""
    weights = np.array([0.25, 0.25, 0.25, 0.25, 4.0])
    quarters = [np.min(resample(weights.copy(), rng)) for _ in range(QUARTER_TURNS)]
    counts = np.bincount(quarters, minlength=4)
    if np.abs(counts / QUARTER_TURNS - 0.25).max() < QUARTER_OFF:
        return None
    return (
        f"in {QUARTER_TURNS} calls the first spoke lay in the four quarters of its gap, from 0 to W / M, {counts[:4].tolist()} times: each "
        "place there is to be as likely as any other, as with rng.random() * W / M."
    )


def _is_a_wheel(resample, rng):
    """Whether the spokes are those of a wheel, however far it is turned: of equal weights one meets one each, until the
    last, which takes those that went beyond.
    """
    drawn = (np.sort(resample(np.full(8, 0.125), rng)) for _ in range(5))
    return all(np.array_equal(index, np.minimum(index[0] + np.arange(8), 7)) for index in drawn)


def _survives_rounding(resample, rng):
    """The last spoke against weights in single precision whose running sum, after a division, ends below 1."""
    for seed in range(20):
        weights = np.random.default_rng(seed).exponential(size=200).astype(np.float32)
        if np.cumsum(weights / weights.sum())[-1] < 1 - 1e-7:
            try:
                index = resample(weights, _LateSpin(np.random.PCG64(seed)))
            except IndexError:
                return "with weights whose running sum is rounded below 1 the last spoke meets nothing: an IndexError."
            if len(index) != 200:
                return f"of 200 weights in single precision {len(index)} indices come out: M are wanted."
            if np.max(index) >= 200:
                return "with weights whose running sum is rounded below 1 an index beyond the last particle comes out."
    return None


def _noise_is_right(move, rng):
    """Spread of one step of 4000 particles against first-order propagation: ahead, aside and in their heading."""
    theta, u = rng.uniform(1.2, 1.9) * rng.choice([-1, 1]), np.array([1.0, 0.0])
    states, place = np.tile([0.0, 0.0, theta], (4000, 1)), rng.uniform(-5, 5, 2)
    states[:, :2] = place
    std_u, dt = np.round(rng.uniform((0.1, 0.22), (0.14, 0.29)), 2), float(np.round(rng.uniform(0.3, 0.5), 2))
    if told := _reckons(move, states[:2], u.tolist(), dt, rng):
        return told
    moved = np.asarray(move(states.copy(), u, dt, std_u, rng))
    if moved.shape != states.shape:
        return f"expected an array of shape (4000, 3), got {moved.shape}."

    def errors(moved):
        c, s = np.cos(theta), np.sin(theta)
        ahead, aside = ((moved[:, :2] - place) @ [[c, -s], [s, c]]).T
        return {"ahead": ahead, "in theta": moved[:, 2] - theta, "aside": aside}

    off, along_x = errors(moved), moved[:, 0].std()
    if min(abs(along_x - t * std_u[0]) for t in (dt, 1.0)) < 0.1 * dt * std_u[0] and 2 * off["ahead"].std() < along_x:
        return (
            "the noise of v spreads the particles along x of the map, and they head nearly along y. A robot drives along its "
            "heading: add it to u."
        )
    for name, wanted in (("ahead", dt * std_u[0]), ("in theta", dt * std_u[1]), ("aside", dt**2 * std_u[1] / 2)):
        if abs(off[name].std() - wanted) > 0.1 * wanted:
            longer = errors(np.asarray(move(states.copy(), u, 2 * dt, std_u, rng)))[name].std()
            return _other_spread(name, off[name], wanted, std_u, dt, longer)
    return _other_kind(off["ahead"], off["in theta"], dt)


EQUALLY_FAR = "They all went equally far: draw a pair of random numbers for each."
BENDS = "The noise of omega also bends the way: it belongs into the control, before the step."


def _other_spread(name, noise, wanted, std_u, dt, longer):
    """What a wrong spread of 4000 particles tells; longer: that after a step of twice the time."""
    amount, std, unit = noise.std(), std_u[int(name == "in theta")], "rad" if name == "in theta" else "m"
    own = name != "aside" and abs(amount - std) < 0.1 * std
    if own and abs(longer - amount) < 0.1 * amount:
        return (
            f"4000 particles spread {name} by std_u itself, whatever dt is. Was the noise added to the pose, or after the "
            "step? It belongs to the control, as large as std_u says."
        )
    told = (
        f"4000 particles spread {name} by {amount:.3f} {unit} (standard deviation) after one step of {dt} s with "
        f"std_u = {std_u.tolist()}, expected {wanted:.3f} {unit}"
    )
    if name == "in theta" and amount < 0.01 * wanted:
        return f"{told}. This was straight on, u = [1, 0]: omega has its noise there as well."
    if amount < 1e-9 * wanted:
        return f"{told}. {BENDS if name == 'aside' else EQUALLY_FAR}"
    if np.corrcoef(noise[:-1], noise[1:])[0, 1] > 0.5:
        return (
            f"{told}. The noise of each is like that of the one before: add its own to u itself, to each a fresh one."
        )
    if name != "aside" and abs(astray := noise.mean() - dt * (name == "ahead")) > 0.3 * wanted:
        return f"{told}. On average they are {abs(astray):.3f} {unit} off where u leads: noise is to go both ways, as rng.standard_normal does."
    if abs(amount * math.sqrt(3) - wanted) < 0.1 * wanted and _kurtosis(noise) < 2.2:
        return f"{told}. It is smaller by the root of 3, as uniform numbers up to std_u are: rng.standard_normal."
    if name != "aside" and abs(amount - dt * math.sqrt(std)) < 0.05 * amount:
        return f"{told}. That is what the root of std_u gives: std_u holds standard deviations, not variances."
    other, of_the_other = (std_u[0], "v") if name == "in theta" else (std_u[1], "omega")
    if name != "aside" and abs(amount - dt * other) < 0.05 * amount:
        return f"{told}. That is what the standard deviation of {of_the_other} gives: each speed has its own."
    if power := _power_of_dt(amount / wanted, longer / amount, dt) if name != "aside" else "":
        return f"{told}. It grows with {power}: std_u is that of the control in one step, whatever dt is."
    if abs(amount / math.sqrt(2) - wanted) < 0.05 * wanted:
        tails = _kurtosis(noise) > LONG_TAILS
        twice = (
            "as Laplace numbers of this scale are: rng.standard_normal" if tails else "as if this noise came in twice"
        )
        return f"{told}. It is larger by the root of 2, {twice}."
    if name == "aside":
        return f"{told}. {BENDS}"
    return f"{told}."


def _power_of_dt(times, longer, dt):
    """With what a spread grows that is so many times the right one, and `longer` times as large after twice the time."""
    powers = ((1.5, "dt to the power 1.5"), (0.5, "the root of dt"))
    fits = (
        words for power, words in powers if abs(times * dt ** (1 - power) - 1) < 0.05 and abs(longer - 2**power) < 0.2
    )
    return next(fits, "")


LONG_TAILS = 4.5  # a kurtosis that 4000 normal numbers do not reach


def _kurtosis(noise):
    """3 of normal numbers, 1.8 of uniform ones, 6 of Laplace's."""
    return float((((noise - noise.mean()) / noise.std()) ** 4).mean())


def _other_kind(ahead, turn, dt):
    """What else may be wrong with the noise of 4000 particles that spread as they should."""
    kurtosis = _kurtosis(turn)
    if abs(kurtosis - 3) > 0.7:  # nine standard deviations of what 4000 normal numbers give
        tails = "light" if kurtosis < 3 else "heavy"
        return f"the noise has the right spread, but too {tails} tails: draw normal numbers, rng.standard_normal."
    if abs(np.corrcoef(ahead, turn)[0, 1]) > 0.2:
        return "the noises of v and omega of a particle go together: each needs a random number of its own."
    if abs(ahead.mean() - dt) > 0.02 or abs(turn.mean()) > 0.02:
        return f"on average the particles drive {ahead.mean():.3f} m and turn by {turn.mean():.3f} rad, expected {dt} m and 0."
    return None


ANY_CONTROL = "the noise is to be the same for every u"
ANY_SPREAD = "std_u is that of the argument, of v and of omega each its own"
# u, std_u, dt, and what is asked for; the robot that stands, in reverse, fast; other noise, of one part alone
SLOW = (((0.0, 0.0), (0.2, 0.3), 0.5, ANY_CONTROL), ((-0.8, -0.4), (0.2, 0.3), 0.5, ANY_CONTROL))
FAST = (
    ((6.0, 2.0), (0.4, 0.3), 0.5, ANY_CONTROL),
    ((1.0, 0.5), (0.005, 0.002), 0.1, "std_u is the argument's, however small"),
)
ALONE = (
    ((1.0, 0.5), (1.5, 0.0), 0.5, "a standard deviation of 0 leaves omega as it is, and v has the other"),
    ((1.0, 0.5), (0.0, 1.5), 0.5, "a standard deviation of 0 leaves v as it is, and omega has the other"),
)
MOVED = 4000  # particles
MEAN_OFF, STD_OFF = 0.1, 0.07  # in std_u: six standard deviations of what so many normal numbers give
# The same of 8000 numbers together, less by the root of their number for more: mean, standard deviation, kurtosis, skewness,
# and distance of their distribution from the normal one
LAW = {"mean": 0.062, "std": 0.045, "kurtosis": 0.35, "skewness": 0.17, "distance": 0.032}
TOGETHER = 0.1  # correlation of 4000 pairs: six standard deviations
SURELY = 18  # of so many that are expected beyond a limit none is there in one of seventy million checks


def _noise_is_right_at(settings):
    """A property: speed and turn rate of 4000 particles a setting, from where they come to, and the law of their noise."""

    def check(move, rng):
        noise = []
        for u, std_u, dt, words in settings:
            found, told = _noisy_controls(move, u, std_u, dt, rng)
            if told:
                lead, words = _of_the_control(move, u, std_u, dt, words, rng)
                return f"{lead}for u = {list(u)} and std_u = {list(std_u)} {told}: {words}."
            noise.append([(rate - wanted) / std for rate, wanted, std in zip(found, u, std_u) if std])
        return _law_of(noise)

    return check


def _noisy_controls(move, u, std_u, dt, rng):
    """Speeds and turn rates of 4000 particles, and in words what is wrong with their mean and spread, if anything is."""
    found = _controls_of(move(np.zeros((MOVED, 3)), np.array(u), dt, np.array(std_u), rng), dt)
    for name, rate, wanted, std in zip(("speeds", "turn rates"), found, u, std_u):
        if abs(rate.mean() - wanted) > max(MEAN_OFF * std, 1e-6) or abs(rate.std() - std) > max(STD_OFF * std, 1e-6):
            return found, (
                f"the {name} of {MOVED} particles have the mean {rate.mean():.3g} and the standard deviation "
                f"{rate.std():.3g}, expected {wanted:g} and {std:g}"
            )
    return found, None


def _of_the_control(move, u, std_u, dt, words, rng):
    """(lead, reason) for noise that is wrong: whether the control makes it so, or std_u does."""
    if _noisy_controls(move, (1.0, 0.0), std_u, dt, rng)[1] is None:
        return "right for u = [1, 0], but ", ANY_CONTROL
    return "", ANY_SPREAD if words is ANY_CONTROL else words


def _controls_of(moved, dt):
    """Speeds and turn rates that lead from the origin to these poses."""
    x, y, theta = np.asarray(moved, dtype=float).T
    return (np.cos(theta / 2) * x + np.sin(theta / 2) * y) / dt, theta / dt


def _law_of(clouds):
    """What is wrong with noise, in standard deviations, that should be normal and independent; clouds: lists of series."""
    series = [one for cloud in clouds for one in cloud]
    if (np.abs(series) < 1e-6).all(axis=0).any():
        return "a particle has no noise at all: each gets its own noisy copy of u."
    if min(abs(one.mean()) for one in series) < 1e-10:
        return "over all particles the noise adds up to nothing: each gets its own, whatever the others have."
    if any(_is_just(cloud) for cloud in [*series, *map(np.concatenate, clouds)]):
        return "over all particles the noise has just the spread of std_u: each gets its own, as it comes, whatever the others have."
    if max(abs(np.corrcoef(one[:-1], one[1:])[0, 1]) for one in series) > TOGETHER:
        return (
            "the noise of each particle goes together with that of the next one: each needs random numbers of its own."
        )
    for cloud in clouds:
        if len(cloud) == 2 and abs(np.corrcoef(*cloud)[0, 1]) > TOGETHER:
            return "the noises of v and omega of a particle go together: each needs a random number of its own."
        together = np.abs(np.concatenate(cloud))
        if len(np.unique(np.round(together, 5))) < 0.9 * len(together):
            return "many particles have the same noise, or its mirror image: each needs random numbers of its own."
    return _not_normal(np.sort(np.concatenate(series)))


def _is_just(e):
    """Whether numbers have been divided by their own spread, which random ones never hit."""
    spreads = e.std(), e.std(ddof=1), np.sqrt((e**2).mean())
    return min(abs(spread - 1) for spread in spreads) < 1e-10


def _not_normal(e):
    """What is wrong with the law of sorted numbers that should be standard normal ones."""
    largest, share = np.abs(e).max(), np.sqrt(8000 / len(e))
    if largest < -ndtri(SURELY / 2 / len(e)):
        return (
            f"of {len(e)} noisy speeds and turn rates none is farther off than {largest:.2f} standard deviations: normal "
            "numbers are, now and then. Is the noise cut off, or not normal?"
        )
    distance = np.abs(ndtr(e) - (np.arange(len(e)) + 0.5) / len(e)).max()
    off = {
        "mean": e.mean(),
        "std": e.std() - 1,
        "kurtosis": _kurtosis(e) - 3,
        "skewness": ((e - e.mean()) ** 3).mean(),
        "distance": distance,
    }
    wrong = [name for name, amount in off.items() if abs(amount) > LAW[name] * share]
    if "mean" in wrong:
        return f"on average the noise is {e.mean():.2f} times std_u: it is to go both ways alike, as rng.standard_normal does."
    if "std" in wrong:
        return f"the noise is {e.std():.2f} times as large as std_u says."
    return (
        "the noise has the right spread, but is not normal: draw normal numbers, rng.standard_normal."
        if wrong
        else None
    )


PLACES = ((1, (0.7, -0.3), 0.4), (5, (-6.0, 2.0), 1.5), (3, (0.05, -0.02), 0.01), (2, (0.0, 0.0), 0.5))


def _reckons_from_anywhere(move, rng):
    """Without noise: one particle alone, far out, after several turns, fast, in a short step, and at rest."""
    for m, u, dt in PLACES:
        states = np.column_stack([rng.uniform(100, 200, (m, 2)) * rng.choice([-1, 1], (m, 2)), rng.uniform(-20, 20, m)])
        if told := _reckons(move, states, u, dt, rng):
            return told
    return None


def _reckons(move, states, u, dt, rng):
    """Without noise: where particles get to that were right from another place, by another control."""
    m, moved = len(states), np.asarray(move(states.copy(), np.array(u), dt, np.zeros(2), rng))
    if moved.shape != states.shape:
        return f"expected an array of shape ({m}, 3) for {m} particle{'s' * (m > 1)}, got {moved.shape}."
    off = moved - odometry.step(states, u, dt)
    off[:, 2] = planar.wrap_angle(off[:, 2])
    if np.abs(off).max() <= (1e-3 if moved.dtype == np.float32 else 1e-8):
        return None
    k = int(np.argmax(np.abs(off).max(axis=1)))
    start, right = np.round(states[k], 4).tolist(), np.round(odometry.step(states[k], u, dt), 4).tolist()
    return (
        f"right from [1.0, 2.0, 1.5] with u = [1.0, 0.5] and dt = 0.2, but with std_u = 0, u = {list(u)} and dt = {dt} a "
        f"particle must get from {start} to {right}. Yours gets to {np.round(moved[k], 4).tolist()}."
    )


def _moves_whole_numbers(move, rng):
    """Without noise, from whole numbers; asked where the answer is right for decimals."""
    states, u = np.array([[1, 2, 1], [-3, 0, 2]]), np.array([1.0, 0.5])
    moved, right = np.asarray(move(states.copy(), u, 0.2, np.zeros(2), rng)), odometry.step(states, u, 0.2)
    if moved.shape == right.shape and np.abs(moved - right).max() <= (1e-5 if moved.dtype == np.float32 else 1e-8):
        return None
    return (
        f"right for decimals, but not for states of whole numbers, {states.tolist()}. Does it write into an array of the kind that is "
        "given, made with `copy` or `zeros_like`? Such an array takes no decimals: `dtype=float` makes it one of decimals."
    )


def _noise_off_is_reckoning(move, rng):
    states = np.array([[0.0, 0, 0], [1, 2, 1.5]])
    moved = move(states.copy(), np.array([1.0, 0.5]), 0.2, np.zeros(2), rng)
    if moved is None:
        return "it returned None: is a `return` missing?"
    moved, right = np.asarray(moved), odometry.step(states, (1.0, 0.5), 0.2)
    if moved.shape != states.shape:
        return f"expected an array of shape (2, 3) for two particles, got {moved.shape}."
    if np.abs(moved - right).max() <= (1e-5 if moved.dtype == np.float32 else 1e-9):
        return None
    if np.abs(moved - states).max() < 1e-9:
        return (
            "with std_u = 0 every particle stands still. Is u itself missing, to which the noise is added? Or is what "
            "odometry.step returns not handed on?"
        )
    if np.abs(moved - odometry.step(states, (1.0, 0.5), 1.0)).max() < 1e-9:
        return "with std_u = 0 the particles move as if dt were 1: does odometry.step get dt, and u as it is?"
    for model, way in (("euler", "straight along the old heading"), ("arc", "along the exact arc")):
        if np.abs(moved - odometry.step(states, (1.0, 0.5), 0.2, model)).max() < 1e-9:
            return f"with std_u = 0 your particles move {way}. odometry.step goes along the heading of half the turn: call it."
    again = np.asarray(move(states.copy(), np.array([1.0, 0.5]), 0.2, np.zeros(2), rng))
    if np.abs(again - moved).max() > 1e-9:
        return "with std_u = 0 the particles still scatter: noise enters through u only, scaled by std_u."
    return (
        f"with std_u = 0 every particle must move as odometry.step(states, u, dt) says, from {states[1].tolist()} "
        f"to {np.round(right[1], 4).tolist()}. Yours gets to {np.round(moved[1], 4).tolist()}."
    )


# The bug hunt --------------------------------------------------------------------------------------------------------


def _stratified(weights, rng):
    """A third correct way: one spin in each of M equal sectors."""
    m = len(weights)
    ends = np.cumsum(weights / np.sum(weights))
    return np.minimum(np.searchsorted(ends, (np.arange(m) + rng.random(m)) / m, side="right"), m - 1)


def _weights_multiplied(states, ranges, landmarks, std):
    d = np.hypot(*np.moveaxis(landmarks - states[:, None, :2], -1, 0))
    return particles.normalize_weights((-0.5 * np.square((ranges - d) / std)).sum(1))


def _weights_not_normalized(states, ranges, landmarks, std):
    return 7.0 * _weights_multiplied(states, ranges, landmarks, std)


GOOD = (particles.resample_roulette, particles.resample_systematic, _stratified)
GOOD_WORDS = {
    particles.resample_roulette: "roulette, whose counts scatter from run to run, so that only shares over many runs are near the weights",
    particles.resample_systematic: "the spoke wheel, whose draws come in order and are not independent",
    _stratified: "one spin in each of M equal sectors, whose draws come in order",
    _weights_multiplied: "densities multiplied, then divided by their sum",
    _weights_not_normalized: "densities multiplied, and all of them by 7: a common factor is no fault",
}


def _on_show(specimen, name):
    """The specimen, with advice for a test that lets its exception through; under a name that gives nothing away."""

    def shown(*args):
        try:
            return specimen(*args)
        except IndexError as error:
            advice = "raised by the specimen: let your test catch that, try: ... except IndexError: return False"
            raise IndexError(f"{error} ({advice})") from error

    shown.__name__ = name
    return shown


RUNS = 3  # how often a property test is tried on each function: what passes by luck does so once
MORE_RUNS, QUICK = 6, 0.1  # how often on a correct one, if three take no more seconds: some reject it by chance


def _catches(specimen, good, others, extra=()):
    """Properties of a property test: False for the specimen and the other wrong ones, True for what is correct."""

    def verdict_on(function, test, rng):
        verdict = test(function, *((rng,) if extra else ()))
        if np.shape(verdict) == () and np.asarray(verdict).dtype == bool:
            return bool(verdict)
        return f"a test answers True (passed) or False (caught), got {type(verdict).__name__}."

    def rejects(wrong, words):
        def check(test, rng):
            for _ in range(RUNS):
                verdict = verdict_on(wrong, test, rng)
                if verdict is not False:
                    return words if verdict is True else verdict
            return None

        return check

    def accepts(function):
        def check(test, rng):
            begun = seconds()
            for run in range(MORE_RUNS):
                if run >= RUNS and seconds() - begun > QUICK:
                    break
                verdict = verdict_on(function, test, rng)
                if verdict not in (True, False):
                    return verdict
                if not verdict:
                    ever = any(verdict_on(other, test, rng) is True for other in (function, *good))
                    more = "" if ever else " It says False of every correct function it is tried on."
                    often = "also rejects, though not each time," if run else "also rejects"
                    return f"your test {often} a correct function ({GOOD_WORDS[function]}): it asks for more than must hold.{more}"
            return None

        return check

    sometimes = "your test sometimes lets the specimen pass: give it more runs, or weights it fails on clearly."
    return (
        rejects(specimen, sometimes),
        *(accepts(function) for function in good),
        *(rejects(wrong, f"your test catches the specimen, but not one that {words}.") for wrong, words in others),
    )


def _squared(weights, rng):
    return particles.resample_roulette(np.square(weights), rng)


def _specimen_2_of_many(weights, rng):
    return (specimens.specimen_2 if len(weights) > 6 else particles.resample_roulette)(weights, rng)


def _beyond_the_last(weights, rng):
    return np.searchsorted(np.cumsum(weights), (rng.random() + np.arange(len(weights))) / len(weights))


def _mean_of_logarithms(states, ranges, landmarks, std):
    d = np.hypot(*np.moveaxis(landmarks - states[:, None, :2], -1, 0))
    return particles.normalize_weights((-0.5 * np.square((ranges - d) / std)).mean(1))


def _second_for_half(states, ranges, landmarks, std):
    """Each reading behind the first counts for half of one."""
    share = (len(ranges) + 1) / 2 / len(ranges)
    return _weights_multiplied(states, ranges, landmarks, std / np.sqrt(share))


def _drawn_to_the_middle(weights, rng):
    """Right on average where there are more than two: of two right draws both are moved to the middle between them."""
    if len(weights) < 3:
        return _squared(weights, rng)
    index, half = particles.resample_roulette(weights, rng), len(weights) // 2
    both = index[:half] + index[half : 2 * half]
    return np.concatenate([both // 2, (both + 1) // 2, index[2 * half :]])


def _last_alone(weights, rng):
    """The last index as often as it should, and the first in place of all others, where there are more than two."""
    if len(weights) < 3:
        return _squared(weights, rng)
    shares = np.zeros(len(weights))
    shares[[0, -1]] = np.sum(weights[:-1]), weights[-1]
    return particles.resample_roulette(shares, rng)


def _heaviest_alone(weights, rng):
    """The heaviest index as often as it should, and one other in place of all others, where there are more than two."""
    if len(weights) < 3:
        return _squared(weights, rng)
    heaviest = int(np.argmax(weights))
    shares = np.zeros(len(weights))
    shares[[heaviest, 0 if heaviest else 1]] = weights[heaviest], np.sum(weights) - weights[heaviest]
    return particles.resample_roulette(shares, rng)


def _sorted_first(weights, rng):
    """Weights that come in order are drawn from as they are, others sorted: upward if the last is not the lighter end."""
    ordered = np.sort(weights)
    return particles.resample_roulette(ordered if weights[0] <= weights[-1] else ordered[::-1], rng)


def _two_alone(weights, rng):
    """The first and the heaviest index as often as they should, and one other in place of the rest, where there are more
    than three.
    """
    if len(weights) < 4:
        return _squared(weights, rng)
    rest = np.ones(len(weights), bool)
    rest[[0, int(np.argmax(weights))]] = False
    shares = np.where(rest, 0.0, weights)
    shares[np.flatnonzero(rest)[-1]] = weights[rest].sum()
    return particles.resample_roulette(shares, rng)


def _of_the_same_spread(weights, rng):
    """Mean and variance of the index are right, and shares are not, where four neighbors of at most 20 allow it."""
    p, m = weights / np.sum(weights), len(weights)
    moves = [np.pad(sign * np.array([1, -3, 3, -1]), (k, m - 4 - k)) for k in range(m - 3) for sign in (1, -1)]
    reach = [(p[move < 0] / -move[move < 0]).min() for move in moves]
    if m > 20 or max(reach, default=0.0) < 0.01:
        return _squared(weights, rng)
    k = int(np.argmax(reach))
    return particles.resample_roulette(np.maximum(p + reach[k] * moves[k], 0.0), rng)


def _some_light_ones_left_out(weights, rng):
    """Of the lightest every other one never comes out, but for the first and the last of them."""
    lightest = np.flatnonzero(weights == weights[weights > 0].min())
    left = weights.copy()
    left[lightest[1:-1:2] if len(lightest) > 2 else lightest[:1]] = 0.0
    return particles.resample_roulette(left if left.any() else weights, rng)


def _lightest_left_out(weights, rng):
    """The lightest quarter never comes out, nor what weighs as little: of many particles a single one no test misses."""
    living = weights[weights > 0]
    light = np.quantile(living, 0.25, method="lower")
    left = np.where(weights > (light if light < weights.max() else living.min()), weights, 0.0)
    return particles.resample_roulette(left if left.any() else weights, rng)


SORTED = (_sorted_first, "sorts the weights first, and is right where they come in order: try some that do not")
SQUARED = (_squared, "draws in proportion to the squared weights")
TO_THE_MIDDLE = (_drawn_to_the_middle, "draws the right index on average, but too often one in the middle")
HEAVIEST_ALONE = (_heaviest_alone, "draws the heaviest index as often as it should, and one other in place of the rest")
TWO_ALONE = (
    _two_alone,
    "draws the first index and the heaviest one as often as it should, and one other in place of the rest",
)
SAME_SPREAD = (
    _of_the_same_spread,
    "draws indices whose mean and variance are right, but not the share of each",
)
LAST_ALONE = (_last_alone, "draws the last index as often as it should, and the first in place of all others")
UNIFORM = (lambda weights, rng: _uniform_choice(weights, rng), "draws all indices alike, whatever they weigh")


def hunt_1(resample, rng):
    """True when indices are drawn in proportion to their weights."""
    weights = np.array([0.1, 0.7, 0.1, 0.1])
    index = np.concatenate([resample(weights, rng) for _ in range(1000)])
    return bool(np.abs(np.bincount(index, minlength=4) / index.size - weights).max() < 0.05)


def hunt_2(resample, rng):
    """True when light particles get their share too."""
    weights = np.array([0.5] + 10 * [0.05])
    index = np.concatenate([resample(weights, rng) for _ in range(1000)])
    return bool(np.abs(np.bincount(index, minlength=11) / index.size - weights).max() < 0.03)


def hunt_3(resample, rng):
    """True when a sum of weights that is a little below 1 does no harm."""
    weights = np.full(1000, 1e-3) * (1 - 1e-3)
    try:
        return bool(max(resample(weights, rng).max() for _ in range(20)) < 1000)
    except IndexError:
        return False


def hunt_4(weigh):
    """True when the same reading twice squares the ratio of two weights."""
    states, landmark = np.array([[0.0, 0, 0], [0.3, 0, 0]]), np.array([[2.0, 0.0]])
    once = weigh(states, np.array([2.0]), landmark, 0.3)
    twice = weigh(states, np.array([2.0, 2.0]), np.repeat(landmark, 2, axis=0), 0.3)
    return bool(np.isclose(twice[0] / twice[1], (once[0] / once[1]) ** 2))


def _hunt(id, reference, specimen, why, hints, others, good=GOOD, extra=("rng",), named=""):
    specimen = _on_show(specimen, next(iter(inspect.signature(reference).parameters)))
    return Exercise(
        id,
        reference=reference,
        draw=lambda rng: (specimen, *((np.random.default_rng(rng.integers(2**32)),) if extra else ())),
        properties=_catches(specimen, good, others, extra),
        fixed={next(iter(inspect.signature(reference).parameters)): "it is the specimen that is shown"},
        hints=hints,
        mistakes=[
            Mistake(
                lambda *_: True,
                f"Your test said True of the specimen, which means correct. For one that is caught it must return False. {why}",
                id=named,
            ),
            Mistake(lambda *_: None, "Your test returned None: it has to return True (passed) or False (caught)."),
        ],
        draws=1,
        limit=IMPORTS,
    )


WEIGHTS_AND_WORD = metrics.Several(metrics.Numbers(1e-9), metrics.Exactly(), names=("weights", "resample"))
RECOVERY = metrics.Several(*[metrics.Numbers(1e-9)] * 3, names=("share", "w_slow", "w_fast"))
OF_ANY_SIZE = metrics.Several(*[metrics.Numbers(1e-9, least=0.0)] * 3, names=("share", "w_slow", "w_fast"))
DEPTHS = metrics.Several(metrics.Numbers(1e-9, "m"), metrics.Numbers(1e-9, "rad"), names=("ranges", "bearings"))

CHAPTER = Chapter(
    "09-monte-carlo",
    title="Monte-Carlo localization",
    items=[
        Prediction(
            "corridor",
            question="Three equal doors, and the sensor says: door. Where do the particles go?",
            choices=("to the nearest door", "to all three doors alike", "nowhere, one look says nothing"),
            answer="to all three doors alike",
            why="One look cannot tell equal doors apart: three clouds. The move between two looks carries them to different walls, and "
            "only one cloud meets a door again.",
        ),
        Exercise(
            "sample_motion",
            reference=sample_motion,
            draw=motion,
            fixed={"u": "the control is a speed and a turn rate", "std_u": "one for the speed, one for the turn rate"},
            properties=(
                _noise_off_is_reckoning,
                _noise_is_right,
                *(_noise_is_right_at(settings) for settings in (SLOW, FAST, ALONE)),
                _reckons_from_anywhere,
                _moved_by_the_rng,
                _moved_alone_by_the_rng,
                _moves_whole_numbers,
            ),
            hints=(
                "The noise belongs to the control, not to the pose, and each particle gets its own.",
                "Draw one pair of standard normal numbers per particle, scale them by std_u, and add them to u.",
                "`noisy = u + std_u * rng.standard_normal((len(states), 2))\nreturn odometry.step(states, noisy, dt)`",
            ),
            mistakes=[
                Mistake(
                    _motion(none=True),
                    "All particles moved as dead reckoning says: the noise is missing, so the cloud cannot spread.",
                ),
                Mistake(
                    _motion(shared=True),
                    "All particles got the same noise: the cloud moves as one block. Draw a pair for each particle.",
                ),
                Mistake(
                    _motion(np.square), "You scaled the noise by the variance. std_u is the standard deviation already."
                ),
                Mistake(
                    lambda x, u, dt, s, rng: odometry.step(x, u + dt * s * rng.standard_normal((len(x), 2)), dt),
                    "You scaled the noise by dt. It belongs to the speeds; odometry.step multiplies by dt.",
                ),
                Mistake(
                    lambda x, u, dt, s, rng: odometry.step(x, u * (1 + s * rng.standard_normal((len(x), 2))), dt),
                    "You multiplied the control by its noise. It is added: u + noise.",
                ),
                Mistake(
                    lambda x, u, dt, s, rng: odometry.step(x, u + s * rng.standard_normal((len(x), 1)), dt),
                    "v and omega of a particle got the same random number: each needs its own.",
                ),
                Mistake(
                    _motion(lambda s: s[::-1]), "The two standard deviations have changed places: first v, then omega."
                ),
                Mistake(
                    _motion(np.sqrt),
                    "Your noise has the root of std_u as its standard deviation. std_u holds standard deviations, not variances.",
                    "sample_motion-7aa5de",
                ),
                Mistake(
                    _motion(on_pose=True),
                    "You added the noise to the pose. Then a robot could slip sideways. The noise belongs to the control.",
                ),
            ],
            draws=3,
        ),
        Exercise(
            "landmark_weight",
            reference=landmark_weight,
            draw=(landmarks_at_a_pose, landmarks_from_a_wrong_room, landmarks_30_deviations_off),
            fixed={"pose": POSE},
            metric=metrics.Numbers(1e-6),
            noisy=(
                (one_landmark, metrics.Numbers(1e-6), "right for several landmarks, but not for a single one:"),
                (
                    landmarks_just_as_expected,
                    metrics.Numbers(1e-6),
                    "right, but not where two landmarks are measured without any error by a sharp sensor:",
                ),
                (
                    landmarks_measured_twice,
                    metrics.Numbers(1e-6),
                    "right, but not where landmarks are measured twice, one of them with the same reading: each reading counts:",
                ),
                (
                    landmarks_after_several_turns,
                    metrics.Numbers(1e-6),
                    "right, but not for a dozen landmarks up to 180 m away and a heading that has gathered several turns:",
                ),
            ),
            limit=IMPORTS,
            hints=(
                "What range and what bearing would a robot at this pose expect? Compare them with z.",
                "The bearing is atan2(dy, dx) - theta. Wrap the *difference* of measured and expected, then add the logarithms of both normal densities, of all landmarks.",
                "`dx, dy = (landmarks - pose[:2]).T\n"
                "e = z[:, 0] - np.hypot(dx, dy)\n"
                "f = planar.wrap_angle(z[:, 1] - np.arctan2(dy, dx) + pose[2])\n"
                "log_p = -0.5 * (e / std_range) ** 2 - 0.5 * (f / std_bearing) ** 2\n"
                "return np.sum(log_p - np.log(2 * np.pi * std_range * std_bearing))`",
            ),
            mistakes=[
                Mistake(
                    lambda x, z, l, r, b: landmark_weight(x, z, l, r, b) + (len(z) - 1) * np.log(2 * np.pi * r * b),
                    "The factor 1 / (std sqrt(2 pi)) stands once in each density: once for each range and each bearing, not once in all.",
                ),
                Mistake(
                    _landmarks(wrap=False),
                    "A bearing difference near 360 deg counted as a large error. Wrap the difference to [-pi, pi).",
                ),
                Mistake(
                    _landmarks(wrap="expected"),
                    "A bearing difference near 360 deg counted as a large error. Wrap the difference to [-pi, pi).",
                ),
                Mistake(
                    _landmarks(turn=-1),
                    "The sign of the heading is wrong: the expected bearing is atan2(dy, dx) - theta.",
                ),
                Mistake(
                    _landmarks(back=True),
                    "Your expected bearings are the opposite ones, as from the landmark to the robot: the difference is landmark - position.",
                    id="landmark_weight-c281fb",
                ),
                Mistake(_landmarks(parts=(1, 0)), "The bearings are missing: both densities are multiplied."),
                Mistake(_landmarks(parts=(0, 1)), "The ranges are missing: both densities are multiplied."),
                *_density_mistakes("landmark_weight", _landmarks, "readings"),
                Mistake(
                    _landmark_plain_product,
                    "Where a pose is far off the product is zero in float64 before you take its logarithm: add logarithms.",
                    id="landmark_weight-5cca7f",
                ),
                Mistake(
                    _ranges_wrapped,
                    "You wrapped the range error too. Only the bearing is an angle: a range that is 12 m off stays 12 m off.",
                ),
                Mistake(_products_added, "You added over the landmarks what must be multiplied: add *logarithms*."),
                Mistake(
                    _landmarks(wrap="positive"),
                    "A small negative error became one near 360 deg. Wrap the difference to [-pi, pi).",
                ),
                Mistake(
                    _bearings_folded,
                    "Your bearing errors are folded at 90 deg, as np.arcsin folds: 170 deg counts as 10 deg. planar.wrap_angle keeps them.",
                ),
                Mistake(
                    _landmarks(wrap="sine"),
                    "You take the sine of the bearing error for the error: 170 deg counts as 10 deg. planar.wrap_angle keeps it an angle.",
                    id="landmark-sine",
                ),
                *(
                    Mistake(
                        variant,
                        "Your bearing's density is not the normal one: the cosine of the error, as in von Mises' density, is not its square. Near "
                        "0 both are alike. Wrap the difference, divide by std_bearing, square.",
                        id=f"landmark-{name}",
                    )
                    for name, variant in (("chord", _landmarks(wrap="chord")), ("von-mises", _bearings_by_von_mises))
                ),
                Mistake(
                    _landmarks(wrap="quotient"),
                    "You divided by std_bearing first: what you wrap is no angle any more. Wrap the difference, then divide.",
                ),
                Mistake(_landmarks(wrap="degrees"), "Your bearing error is in degrees, std_bearing is in radians."),
                Mistake(
                    lambda x, z, *rest: landmark_weight(x, z[:, ::-1], *rest),
                    "Range and bearing have changed places: z[:, 0] are the ranges, z[:, 1] the bearings.",
                ),
                Mistake(
                    lambda x, z, marks, *stds: landmark_weight(x, z[:1], marks[:1], *stds),
                    "Only the first landmark counts. Does a `return` or `break` end the loop in its first round?",
                    "landmark_weight-f21930",
                ),
                Mistake(_landmarks(stds=(1, 0)), "The two standard deviations have changed places."),
                Mistake(_landmarks(stds=(0, 0)), "Bearings have a standard deviation of their own, std_bearing."),
                Mistake(
                    lambda x, z, *rest: landmark_weight(x, z, *rest) / len(z),
                    "You took the mean over the landmarks. Their logarithms add up.",
                ),
                Mistake(_landmarks(turn=0), "The heading is missing: a bearing is relative to where the robot looks."),
                Mistake(_landmarks(swap=True), "The y difference comes first: np.arctan2(dy, dx)."),
                Mistake(
                    _landmarks_that_fit_best,
                    "You weigh each reading by the landmark that fits it best. Which one it is of is known: row k of z is of row k of landmarks.",
                ),
                Mistake(
                    _landmarks(square=True),
                    "You used the variances as standard deviations: N(0, std^2) divides the error by std.",
                ),
                Mistake(
                    _landmarks(log=False),
                    "This is the product itself. Return its logarithm, the sum of the logarithms.",
                ),
                Mistake(
                    _landmarks(peak=False),
                    "The factor 1 / (std sqrt(2 pi)) of each density is missing. It cancels among particles, but p needs it.",
                ),
            ],
        ),
        Value(
            "beams_to_zero",
            reference=lambda: 162,
            rtol=0,
            atol=0.01,
            hints=(
                "The smallest number above zero that float64 knows is about 4.9e-324.",
                "0.01 to the power n falls below half of it. Solve for n.",
                "`beams_to_zero = next(n for n in range(1, 1000) if 0.01**n == 0)`",
            ),
            mistakes=[
                Mistake(lambda: 23, "There float32 ends. NumPy computes in float64 unless told otherwise."),
                Mistake(
                    lambda: 8, "There 1 + p is 1 in float64. The product itself goes on: it has an exponent of its own."
                ),
                Mistake(
                    lambda: 154,
                    "There the *normal* numbers of float64 end (2.2e-308). Smaller ones still exist, with fewer digits: count on.",
                ),
                Mistake(
                    lambda: 161,
                    "0.01 to the power 161 is 1e-322, still a (denormal) number above zero. One more beam ends it.",
                ),
                Mistake(lambda: 163, "One too many: the product is zero already after the beam before."),
                Mistake(
                    lambda: 160, "0.01 to the power 160 is 1e-320, still a (denormal) number above zero: count on."
                ),
                Mistake(
                    lambda: math.log(5e-324) / math.log(0.01),
                    "Beams are whole. After 161 of them something above zero is left: round up.",
                ),
                Mistake(
                    lambda: (math.log(5e-324) - math.log(2)) / math.log(0.01),
                    "Beams are whole. After 161 of them something above zero is left: round up.",
                ),
                Mistake(
                    lambda: 308,
                    "That counts powers of ten, and stops where the *normal* numbers end. Each beam contributes two.",
                ),
                Mistake(
                    lambda: 541,
                    "That is a whole scan. The product is zero long before its last beam: count until it is.",
                ),
                Mistake(
                    lambda: math.log(np.finfo(float).tiny) / math.log(0.01),
                    "There the *normal* numbers of float64 end (2.2e-308). Smaller ones still exist, with fewer digits, and beams are whole: count on.",
                ),
                *(
                    Mistake(
                        lambda beams=beams: beams,
                        "0.01 to the power 8 is lost already when it is added to 1. By itself it is a number above zero: it has an exponent of its own.",
                        id=f"beams_to_zero-7d9971{which}",
                    )
                    for beams, which in (
                        (7, ""),
                        (9, "-2"),
                        (16, "-3"),
                        (math.log(np.finfo(float).eps) / math.log(0.01), "-4"),
                    )
                ),
                Mistake(lambda: 323, "That counts powers of ten. Each beam contributes two of them."),
                Mistake(lambda: 324, "That counts powers of ten. Each beam contributes two of them."),
            ],
            about=_left_after,
        ),
        Exercise(
            "log_sum_exp",
            reference=log_sum_exp,
            sizes=("log_weights",),
            draw=LOG_WEIGHTS,
            metric=metrics.Numbers(1e-9),
            noisy=tuple(
                (functools.partial(one_possible, others=others), metrics.Numbers(1e-9), words)
                for others, words in (
                    (0, "right for many particles, but not for a single one:"),
                    (4, "right, but not where all particles but one are impossible (-inf):"),
                )
            )
            + (
                (
                    small_ones_that_count,
                    metrics.Numbers(1e-9),
                    "right, but not where thousands of small weights add something to the largest one:",
                ),
                (
                    whole_logs,
                    metrics.Numbers(1e-9),
                    "right, but not where the logarithms are whole numbers, one of them 0, that of a weight of 1:",
                ),
                (functools.partial(equal_logs, count=7), metrics.Numbers(1e-9), "right, but not for equal weights:"),
                (
                    functools.partial(equal_logs, count=2),
                    metrics.Numbers(1e-9),
                    "right, but not for two equal weights:",
                ),
            ),
            hints=(
                "exp(-2000) is zero, exp(900) is infinite. Which number may be taken out of all logarithms first?",
                "log sum exp(l) = top + log sum exp(l - top), with top the largest: then the largest term is exp(0) = 1.",
                "`top = log_weights.max()\nreturn top + np.log(np.exp(log_weights - top).sum())`",
            ),
            mistakes=[
                Mistake(
                    lambda l: np.log(np.exp(l).sum()),
                    "np.exp(900) is infinite and np.exp(-2000) is zero, so their sum says nothing. Take the largest logarithm out of all of them first.",
                ),
                Mistake(
                    lambda l: np.logaddexp(0.0, logsumexp(l)),
                    "Your sum has a weight more, of 1 = exp(0). Does it begin with the logarithm 0? Begin with -inf, the logarithm of nothing.",
                    "log_sum_exp-d6afaf",
                ),
                Mistake(
                    lambda l: l.min() + np.log(np.exp(l - l.min()).sum()),
                    "With impossible particles (-inf) among them the smallest logarithm is -inf, as are the mean and the one farthest from 0, and -inf - (-inf) is nothing. Take out the largest.",
                    "log_sum_exp-4c4b3d",
                ),
                Mistake(
                    lambda l: np.abs(l).max() + np.log(np.exp(l - np.abs(l).max()).sum()),
                    "You took out the largest size. Of -2000 and -2001 that is 2001, and exp(-4001) is zero: take out the largest logarithm as it is, without abs.",
                ),
                Mistake(
                    lambda l: np.log(np.exp(l - l.max()).sum()) - l.max(),
                    "The largest logarithm was taken out. In the end it is added again, not subtracted.",
                ),
                Mistake(
                    lambda l: l.sum(),
                    "You added the logarithms: that is the logarithm of the product. Asked for is that of the sum.",
                ),
                Mistake(
                    lambda l: np.exp(l - l.max()).sum() * np.exp(l.max()),
                    "This is the sum itself, which overflows. Its logarithm is asked for.",
                ),
                Mistake(
                    lambda l: np.exp(l).sum(), "This is the sum itself, which overflows. Its logarithm is asked for."
                ),
                Mistake(
                    lambda l: l - l.max() - np.log(np.exp(l - l.max()).sum()),
                    "These are the logarithms of the normalized weights, one a particle. Asked for is one number, the logarithm of their sum before.",
                ),
                Mistake(
                    lambda l: np.log(np.exp(l - l.max()).sum()),
                    "The largest logarithm was taken out: add it again at the end.",
                ),
                Mistake(lambda l: l.max() + np.exp(l - l.max()).sum(), "The logarithm of the sum is missing."),
                Mistake(lambda l: l.max(), "That is the largest alone. The others add to it."),
                Mistake(
                    lambda l: l.max() + np.log(np.exp(l - l.max()).mean()),
                    "You averaged. The sum is asked for.",
                ),
                Mistake(
                    lambda l: l.max() + np.log10(np.exp(l - l.max()).sum()),
                    "The logarithm is the natural one, np.log.",
                ),
                Mistake(
                    lambda l: l.max() * np.log(np.exp(l - l.max()).sum()),
                    "A factor exp(top) in front of the sum becomes a summand in its logarithm.",
                ),
                Mistake(
                    lambda l: l.max() - np.log(np.exp(l - l.max()).sum()), "A sign: the logarithm of the sum is added."
                ),
                Mistake(lambda l: float(np.logaddexp.reduce(l[np.isfinite(l)][:2])), "You summed the first two only."),
                Mistake(
                    _around_the_mean,
                    "What you took out (a mean, a median, the first, the last?) may lie 1000 below the largest logarithm, and exp(1000) is infinite: take out the largest.",
                    id="log_sum_exp-80675b",
                ),
                *(
                    Mistake(
                        lambda l, limit=limit: np.log(np.exp(np.clip(l, -limit, limit)).sum()),
                        "You cut the logarithms off at a limit, so that -2000 and -1000 weigh the same. Take the largest out of all of them instead.",
                    )
                    for limit in (500, 600, 690, 700, 708, 709, 740, 745)
                ),
            ],
        ),
        Exercise(
            "cast_ray",
            reference=maps.walk_ray,
            draw=(*EVERY_WAY, ray_past_the_unknown),
            fixed={"pose": POSE},
            metric=HALF_A_CELL,
            noisy=[
                (
                    short_ray,
                    HALF_A_CELL,
                    "Right on rays to a wall with r_max = 18 m, but not on one that ends at r_max, some 30 cm before a wall:",
                ),
                (
                    ray_that_ends_just_before,
                    HALF_A_CELL,
                    "Right on other rays, but not on one that ends at r_max, nearly a cell before a wall (does yours look beyond r_max?):",
                ),
                (
                    ray_to_a_thin_wall,
                    HALF_A_CELL,
                    "Right on other rays, but not on one nearly along y to a wall of one cell (is a step longer than a cell, or does it "
                    "get longer there?):",
                ),
                (
                    ray_that_just_arrives,
                    HALF_A_CELL,
                    "Right on other rays, but not on one that meets a wall a little before r_max:",
                ),
                (
                    ray_to_a_wall_close_by,
                    HALF_A_CELL,
                    "Right on longer rays, but not on one to a wall some 20 cm away (does yours begin farther out?):",
                ),
                *(
                    (
                        functools.partial(ray_along_an_axis, toward=toward),
                        HALF_A_CELL,
                        f"Right on other rays, but not on one straight {against} on a map that begins elsewhere than at (0, 0):",
                    )
                    for toward, against in ((math.pi, "against x"), (-math.pi / 2, "against y"), (0.0, "along x"))
                ),
                (
                    ray_in_a_fine_map,
                    Reach(0.011, "m", absolute=True),
                    "right, but not on a map with cells of 2 cm and a wall of one cell (is the length of a step typed in? "
                    "grid.resolution is the width of a cell):",
                ),
                (
                    ray_down_a_hall,
                    Reach(0.22, "m", absolute=True),
                    "Right on shorter rays, but not on one to a wall some 60 m away, in cells of 40 cm, that r_max = 75 m reaches (does yours end "
                    "sooner?):",
                ),
                (
                    ray_by_a_far_sighted_scanner,
                    HALF_A_CELL,
                    "Right with an r_max of some dozens of meters, but not with one of about 200 m, on a ray to a wall of one cell (is the "
                    "number of steps typed in? However far r_max is, a step is to be shorter than a cell):",
                ),
                (
                    ray_from_within_a_wall,
                    HALF_A_CELL,
                    "Right on other rays, but not on one that begins deep in a wall, where the first occupied cell is its own:",
                ),
                (
                    ray_that_leaves_the_map,
                    HALF_A_CELL,
                    "Right on other rays, but not on one that leaves the map before it meets anything: no cell is occupied there, and "
                    "grid.at says so:",
                ),
            ],
            properties=(right_however_far,),
            hints=(
                "Walk along the ray in steps of half a cell or less, and stop in the first occupied one.",
                "The direction is theta + bearing. Walk along it in steps of half a cell: grid.at([x, y]) says what is there, and the first maps.OCCUPIED ends the beam. If none comes, r_max.",
                "`a = pose[2] + bearing\n"
                "r = np.arange(0, r_max, grid.resolution / 2)\n"
                "xy = pose[:2] + r[:, None] * [np.cos(a), np.sin(a)]\n"
                "hits = r[grid.at(xy) == maps.OCCUPIED]\n"
                "return hits[0] if len(hits) else r_max`",
            ),
            mistakes=[
                Mistake(
                    lambda grid, x, b, r_max: _ray_to_what_is_not_free(grid, x, b, r_max),
                    "Unknown cells stop your ray. Nobody has seen an obstacle there: only maps.OCCUPIED ends it.",
                ),
                *(
                    Mistake(counted, "You counted in cells. One cell is grid.resolution meters long.", id=id)
                    for counted, id in (
                        (_ray_in_cells, ""),
                        (functools.partial(_steps_of_a_ray, cells=1), "ray-in-whole-cells"),
                    )
                ),
                *(
                    Mistake(
                        functools.partial(_steps_of_a_ray, cells=cells),
                        "That is the number of the steps to the wall. Asked for is how far they lead, in meters.",
                        id=f"ray-in-steps-{cells}",
                    )
                    for cells in (0.5, 0.1)
                ),
                Mistake(_ray_without_heading, "The heading is missing: the beam points to theta + bearing on the map."),
                Mistake(_ray_without_bearing, "The bearing is missing: you looked straight ahead."),
                Mistake(
                    _ray_reversed, "Bearings count to the left, like angles: theta + bearing, not theta - bearing."
                ),
                Mistake(_ray_swapped, "Sine and cosine have changed places: x goes with the cosine."),
                *(
                    Mistake(functools.partial(_ray_mirrored, in_x), f"Your ray goes the other way along {axis}: {way}.")
                    for in_x, axis, way in (
                        (False, "y", "y grows upward, y + r * np.sin(angle)"),
                        (True, "x", "x + r * np.cos(angle)"),
                    )
                ),
                Mistake(
                    lambda grid, x, b, r_max: r_max,
                    "You return r_max where a wall is nearer. Is `return r_max` inside the loop, a step longer than a cell is wide, or do you look at few places of the ray only?",
                    id="cast_ray-839415",
                ),
                Mistake(
                    _ray_by_halves,
                    "That is what comes out when the ray is halved again and again. It finds the first wall only where all behind it is occupied as well: walk along, from near to far.",
                ),
                Mistake(
                    lambda grid, x, b, r_max: 0.0,
                    "Your ray ends where it starts. Does it start at x, y of the pose, and go on while the cell is *not* maps.OCCUPIED?",
                ),
                Mistake(
                    lambda grid, x, b, r_max: maps.walk_ray(grid, x, b - 2 * x[2], r_max),
                    "The heading counts the wrong way: the beam points to theta + bearing.",
                ),
                Mistake(
                    lambda grid, x, b, r_max: maps.walk_ray(grid, x, math.degrees(x[2] + b) - x[2], r_max),
                    "cos and sin take radians, and pose and bearing are in radians already.",
                ),
                Mistake(_ray_to_the_last, "Your ray goes on through walls: stop in the *first* occupied cell."),
                *(
                    Mistake(
                        functools.partial(_ray_in_steps, cells=cells),
                        "Your steps are longer than half a cell: the wall is seen up to a whole step late. Take half a cell or less.",
                        id=f"cast-ray-steps-{cells:g}",
                    )
                    for cells in (0.75, 0.8, 0.9, 1.0)
                ),
                *(
                    Mistake(
                        functools.partial(_ray_in_steps, cells=cells),
                        "Your steps are longer than a cell is wide: they pass over corners and thin walls. Take half a cell or less.",
                        id=f"cast_ray-606eb4{which}",
                    )
                    for cells, which in zip((1.5, 2, 2.5, 3, 4, 5, 10), ("", "-2", "-3", "-4", "-5", "-6", "-7"))
                ),
                *(
                    Mistake(
                        functools.partial(_ray_in_places, places=places),
                        f"You look at about {count} places along the ray, however far r_max is: that is too few. Make steps of half a cell.",
                        id=f"ray-in-{places}-places",
                    )
                    for count in (10, 20, 30, 50, 100)
                    for places in (count, count + 1)
                ),
                Mistake(_ray_to_infinity, "Nothing hit means r_max, the scanner's limit, not infinity."),
                Mistake(_ray_without_end, "A scanner sees r_max at most: return r_max when nothing is hit before."),
            ],
        ),
        Exercise(
            "beam_weight",
            reference=beam_weight,
            draw=beams_at_a_pose,
            metric=metrics.Numbers(1e-6),
            noisy=[
                (whole_scan(beams_at_a_pose), metrics.Numbers(1e-6), WHOLE_SCAN),
                (
                    beams_from_a_wrong_pose,
                    metrics.Numbers(1e-6),
                    "right, but not for ranges 45 standard deviations off, which are many meters:",
                ),
                (
                    beams_that_are_alike,
                    metrics.Numbers(1e-6),
                    f"right, but not where ranges are just as expected, several alike, or {R_MAX:g} m: each of them counts:",
                ),
                (
                    functools.partial(beams_of_a_sensor, sharpness=1.0, count=1),
                    metrics.Numbers(1e-6),
                    "right for several beams, but not for a single one:",
                ),
                *(
                    (
                        functools.partial(beams_of_a_sensor, sharpness=sharpness),
                        metrics.Numbers(1e-6),
                        f"right, but not for {words}:",
                    )
                    for sharpness, words in (
                        (1e3, "errors and a std of fractions of a millimeter"),
                        (0.01, "errors and a std of many meters"),
                    )
                ),
            ],
            limit=IMPORTS,
            hints=(
                "Each beam is a normal density of measured minus expected range. A product turns into a sum of logarithms.",
                "log N = -0.5 * (error / std)**2 - log(std sqrt(2 pi)), once for every beam.",
                "`return np.sum(-0.5 * ((ranges - expected) / std) ** 2 - np.log(std * np.sqrt(2 * np.pi)))`",
            ),
            mistakes=[
                Mistake(
                    lambda r, e, s: np.sum(-0.5 * ((r - e) / s) ** 2 - np.log10(s * np.sqrt(2 * np.pi))),
                    "The logarithm is the natural one, np.log: -0.5 (e / std)^2 is one of base e.",
                ),
                Mistake(
                    lambda r, e, s: math.exp(beam_weight(r, e, s)), "This is the product. Its logarithm is asked for."
                ),
                Mistake(
                    lambda r, e, s: _log_of_the_product(_normal_log(r - e, s)),
                    "The product of so many densities, or of a few that are tiny, is zero in float64 before you take its logarithm: "
                    "sum up logarithms.",
                    id="beam_weight-9138c6",
                ),
                Mistake(
                    lambda r, e, s: float((-0.5 * np.square((r - e) / s)).sum() - np.log(s * math.sqrt(2 * math.pi))),
                    "The factor 1 / (std sqrt(2 pi)) stands once in each density: as many times as there are beams.",
                ),
                *_density_mistakes("beam_weight", _beams, "beams"),
                Mistake(
                    lambda r, e, s: float(np.prod(_normal_log(r - e, s))),
                    "You multiplied logarithms. The logarithm of a product is the *sum* of the logarithms.",
                ),
                Mistake(
                    lambda r, e, s: float(_normal_log(r[0] - e[0], s)),
                    "Only the first beam counts. Does a `return` or `break` end the loop in its first round?",
                    "beam_weight-6ac1f0",
                ),
                Mistake(
                    _errors_added_first, "You added the errors and squared their sum. Square each error, then add up."
                ),
                Mistake(
                    lambda r, e, s: len(r) * float(_normal_log(np.mean(r - e), s)),
                    "You took the mean of the errors first, in which those to both sides cancel. Each error has a density of its own.",
                ),
                Mistake(
                    lambda r, e, s: beam_weight(r, e, s) / len(r), "You took the mean over the beams. They add up."
                ),
                Mistake(
                    lambda r, e, s: beam_weight(r, e, s * s),
                    "You divided by the variance: (error / std) is squared, and std stands in the factor in front.",
                ),
                Mistake(
                    lambda r, e, s: float((-0.5 * np.square((r - e) / s)).sum()),
                    "The factor 1 / (std sqrt(2 pi)) of each beam is missing.",
                ),
            ],
        ),
        Exercise(
            "distance_field_weight",
            reference=distance_field_weight,
            draw=scan_at_a_pose,
            fixed={"pose": POSE},
            metric=metrics.Numbers(1e-6),
            noisy=[
                (whole_scan(scan_at_a_pose), metrics.Numbers(1e-6), WHOLE_SCAN),
                (
                    scan_by_a_sharp_sensor,
                    metrics.Numbers(1e-6),
                    "right, but not for end points far from walls and a std of some millimeters:",
                ),
                (
                    scan_on_another_map,
                    metrics.Numbers(1e-6),
                    "Right on the map of the building, but not on another one, of other cells and another origin, with end points in unknown cells:",
                ),
                (
                    scan_in_a_wide_hall,
                    metrics.Numbers(1e-6),
                    "Right near walls, but not in a wide hall with beams of up to 44 m, which end meters away from the nearest one "
                    "(are distances cut off, or beams left out?):",
                ),
                (
                    functools.partial(scan_in_a_wide_hall, count=1),
                    metrics.Numbers(1e-6),
                    "Right for several beams, but not for a single one:",
                ),
            ],
            hints=(
                "Put the end point of each beam on the map and ask how far the nearest obstacle is.",
                "End point: x + r cos(theta + b), y + r sin(theta + b). The distance stands in grid.distance at grid.cell_of(point).",
                "`a = pose[2] + bearings\n"
                "xy = pose[:2] + np.column_stack([ranges * np.cos(a), ranges * np.sin(a)])\n"
                "d = grid.distance[grid.cell_of(xy)]\n"
                "return np.sum(-0.5 * (d / std) ** 2 - np.log(std * np.sqrt(2 * np.pi)))`",
            ),
            mistakes=[
                Mistake(_field_world, "The heading is missing: bearings are relative to the robot, the map is not."),
                Mistake(
                    _field_mirrored, "Bearings count to the left, like angles: theta + bearing, not theta - bearing."
                ),
                Mistake(_field_swapped, "Sine and cosine have changed places: x goes with the cosine."),
                Mistake(
                    _field_at_the_robot, "You looked up the robot's own cell. Look up the end points of its beams."
                ),
                Mistake(
                    _field_plain_product,
                    "The product of so many densities, or of a few that are tiny, is zero in float64 before you take its logarithm: "
                    "sum up logarithms.",
                    id="distance_field_weight-9138c6",
                ),
                *_density_mistakes("distance_field_weight", _field_with, "beams"),
                Mistake(
                    _field_rows_for_columns,
                    "Rows and columns have changed places: grid.cell_of gives the rows first, and grid.distance takes them first.",
                ),
                Mistake(_field_straight_ahead, "The bearings are missing: each beam points to theta + bearing."),
                Mistake(
                    lambda grid, x, r, b, s: distance_field_weight(grid, x, r, b, s * s),
                    "You used the variance as standard deviation: N(0, std^2) divides the distance by std.",
                ),
                Mistake(
                    _field_one_peak,
                    "The factor 1 / (std sqrt(2 pi)) stands once in each density: as many times as there are beams.",
                ),
                Mistake(_field_cells, "The distances are in meters already: do not divide by the resolution."),
                Mistake(
                    _field_shrunk,
                    "The distances are in meters already: do not multiply by the resolution.",
                    id="field-times-resolution",
                ),
                Mistake(
                    _field_in_degrees,
                    "np.cos and np.sin take radians, and the bearings are in radians: leave them as they come.",
                    id="field-degrees",
                ),
                Mistake(_field_mean, "You took the mean over the beams. The logarithms add up."),
                Mistake(_field_probability, "This is p itself, which underflows with many beams. Return log p."),
                Mistake(_field_no_peak, "The factor 1 / (std sqrt(2 pi)) of each beam is missing."),
                Mistake(_field_origin, "The robot's position is missing: a range starts where the robot stands."),
                Mistake(
                    _field_of_all_rows_and_columns,
                    "This is the sum over the row of every end point with the column of every other as well: a cell is the "
                    "row and the column of one end point, `grid.distance[rows, columns]`.",
                    id="field-all-rows-and-columns",
                ),
                Mistake(
                    _field_of_single_cells,
                    "You count each cell once. Several beams may end in one cell, and each of them counts.",
                ),
            ],
        ),
        Prediction(
            "field",
            question="Both models weigh one scan at every place of the building. Which finds more to like in the wrong rooms?",
            choices=("beam model", "likelihood field", "both alike"),
            answer="likelihood field",
            why="It asks only whether each end point lies near some obstacle, and does not mind a wall in between. Its good places "
            "form ridges along parallel walls. Drag the robot: is there a place where it is the other way round?",
        ),
        Exercise(
            "resample_roulette",
            reference=resample_roulette,
            draw=WHEELS,
            properties=(
                _valid,
                _drawn_from_the_rng,
                _comes_twice,
                _proportional,
                _spins_are_independent,
                _of_any_sum,
                _of_whole_numbers,
                _is_right_of_many,
                _is_right_of_one_heavy,
                _is_right_of_a_thousand,
            ),
            hints=(
                "Each weight owns an interval as wide as itself. Where does a random number fall?",
                "np.cumsum(weights) are the ends of the intervals, np.searchsorted finds the interval by bisection.",
                "`ends = np.cumsum(weights)\n"
                "return np.searchsorted(ends, rng.random(len(weights)) * ends[-1], side='right')`",
            ),
            mistakes=[
                Mistake(
                    _largest,
                    "You always took the heaviest particle. It should be drawn as often as its weight asks for.",
                    "resample_roulette-87f542",
                ),
                Mistake(_uniform_choice, "All particles were drawn alike: the weights do not matter yet."),
                Mistake(
                    lambda w, rng: np.arange(len(w)), "Every particle came out once: that is the set you started with."
                ),
                Mistake(
                    lambda w, rng: _spin(w, rng, scale=1.0),
                    "Your spins end at 1, but the weights may have any sum: spin from 0 to W, or divide by W first.",
                ),
                Mistake(
                    lambda w, rng: _spin(w, rng, shift=1),
                    "Off by one: each index is one too high. np.searchsorted gives the index itself.",
                    "resample_roulette-9c7597",
                ),
                Mistake(
                    lambda w, rng: _spin(w, rng, shift=-1),
                    "Off by one: each index is one too low. np.searchsorted gives the index itself.",
                    "resample_roulette-d2e0b0",
                ),
                Mistake(
                    lambda w, rng: np.full(len(w), np.searchsorted(np.cumsum(w), rng.random() * w.sum())),
                    "One spin for all: each particle needs a random number of its own.",
                ),
                Mistake(
                    lambda w, rng: rng.multinomial(len(w), w / w.sum()),
                    "These are counts, how often each particle comes out. Asked for are the indices: np.repeat makes them.",
                ),
                *(
                    Mistake(
                        variant,
                        "You searched in the weights. Search in their running sum, np.cumsum(weights).",
                        id=id,
                    )
                    for variant, id in (
                        (lambda w, rng: np.searchsorted(w, rng.random(len(w))), "resample_roulette-e49150"),
                        (_searched_in_shares, "roulette-searched-in-shares"),
                    )
                ),
                *(
                    Mistake(
                        lambda w, rng, step=step: _spin(np.sort(w)[::step], rng),
                        "You sorted the weights: then an index no longer belongs to its particle.",
                    )
                    for step in (1, -1)
                ),
                Mistake(
                    lambda w, rng: rng.choice(len(w), len(w), replace=False, p=w / w.sum()),
                    "With replace=False each index is drawn once at most, and a heavy particle must come out several times: leave replace=False out.",
                ),
            ],
            draws=8,
            limit=IMPORTS,
        ),
        Exercise(
            "resample_systematic",
            reference=resample_systematic,
            draw=WHEELS,
            properties=(
                _valid,
                _drawn_from_the_rng,
                _turn_is_one_gap,
                _comes_twice,
                _proportional,
                _equal_weights_stay,
                _spokes_are_even,
                _survives_rounding,
                _of_any_sum,
                _spokes_fill_the_wheel,
                _turns_all_the_way,
                _turns_evenly,
                _of_whole_numbers,
            ),
            hints=(
                "One random number turns the whole wheel. Its M spokes are W / M apart.",
                "Spokes: (rng.random() + np.arange(M)) * W / M. Then search them in the running sum, as before.",
                "`ends, M = np.cumsum(weights), len(weights)\n"
                "spokes = (rng.random() + np.arange(M)) * ends[-1] / M\n"
                "return np.minimum(np.searchsorted(ends, spokes), M - 1)`",
            ),
            mistakes=[
                Mistake(
                    _largest,
                    "You always took the heaviest particle. It should be met by as many spokes as its weight asks for.",
                    "resample_systematic-d296b2",
                ),
                Mistake(
                    lambda w, rng: _turn(w, rng.random(len(w))),
                    "Each spoke got its own random number (that is stratified resampling). One number turns the whole wheel.",
                ),
                Mistake(
                    lambda w, rng: _turn(w, rng.random(), scale=1.0),
                    "Your spokes end at 1, but the weights may have any sum: space them by W / M, or divide by W first.",
                ),
                Mistake(
                    lambda w, rng: _turn(w, 1 + rng.random()),
                    "Off by one: the first spoke lies between 0 and W / M, yours between W / M and 2 W / M.",
                ),
                Mistake(
                    lambda w, rng: np.searchsorted(np.cumsum(w), (rng.random() + np.arange(len(w)) / len(w)) * w.sum()),
                    "You turn the wheel by up to W. One gap is enough, up to W / M: W (rng.random() + np.arange(M)) / M.",
                    id="resample_systematic-5930c6",
                ),
                Mistake(
                    lambda w, rng: np.minimum(
                        np.searchsorted(np.cumsum(w), (rng.random() + np.arange(len(w)) / len(w)) * w.sum()), len(w) - 1
                    ),
                    "You turn the wheel by up to W. One gap is enough, up to W / M: W (rng.random() + np.arange(M)) / M.",
                    id="resample_systematic-5930c6-2",
                ),
                *(
                    Mistake(
                        functools.partial(_spokes_to_the_end, more=more, around=around),
                        "Your first and your last spoke stand one whole turn apart, as np.linspace does with its end point: M spokes are W / M apart.",
                        id=id,
                    )
                    for more, around, id in (
                        (0, np.inf, "systematic-end-point"),
                        (-1, np.inf, "systematic-end-point-2"),
                        (0, 1.0, "systematic-end-point-3"),
                    )
                ),
                Mistake(
                    lambda w, rng: _turn(w, 0.5 * rng.random()),
                    "Your first spoke comes to lie between 0 and half of W / M. The turn is one from 0 to W / M.",
                ),
                Mistake(
                    _turned_by_less,
                    "The turn is one from 0 to W / M, and yours goes to 1 / M: the weights may have any sum W, so the turn grows with it.",
                ),
                Mistake(
                    _one_step_a_spoke,
                    "From one spoke to the next you go on by one particle at most. Light ones may be passed over: `while`, not `if`.",
                    id="systematic-if",
                ),
                Mistake(
                    lambda w, rng: _turn(np.sort(w), rng.random()),
                    "You sorted the weights: then an index no longer belongs to its particle.",
                ),
                *(
                    Mistake(
                        spins, "These are M independent spins, the roulette. Here one random number turns all spokes."
                    )
                    for spins in (_spin, lambda w, rng: np.sort(_spin(w, rng)))
                ),
                Mistake(lambda w, rng: _turn(w, 0.0), "The wheel has not been turned: start with one random number."),
                Mistake(lambda w, rng: _turn(w, 0.5), "The wheel has not been turned: start with one random number."),
                Mistake(
                    lambda w, rng: np.arange(len(w)),
                    "Every particle came out once: that is what equal weights give.",
                    "resample_systematic-f6bb6e",
                ),
            ],
            draws=8,
            limit=IMPORTS,
        ),
        Prediction(
            "standing",
            question="A robot stands still, 1000 particles weigh the same, and roulette resamples 200 times. How many of the first 1000 "
            "particles still have descendants?",
            choices=("about 630", "about 100", "about 10", "all 1000"),
            answer="about 10",
            why="The first round loses 37 %. Later, with k families left, the next one dies out after some 2 M / k² rounds: after t rounds about 2 M / t remain.",
        ),
        Exercise(
            "effective_size",
            reference=particles.effective_size,
            sizes=("weights",),
            draw=cloud_weights,
            metric=metrics.Numbers(1e-9),
            noisy=(
                (cloud_with_dead_particles, metrics.Numbers(1e-9), "right, but not where some weights are 0:"),
                (one_heavy, metrics.Numbers(1e-9), "right, but not where one particle weighs all, which is worth 1:"),
                (many_alike, metrics.Numbers(1e-9), "right, but not for thousands of tiny weights that are equal:"),
                (one_particle, metrics.Numbers(1e-9), "right, but not for a single particle:"),
            ),
            hints=(
                "M equal weights should give M, a single heavy one should give 1, whatever the sum of the weights is.",
                "It is the square of the sum over the sum of the squares.",
                "`return weights.sum() ** 2 / (weights ** 2).sum()`",
            ),
            mistakes=[
                Mistake(
                    _from_the_sum_of_squares,
                    "Right for weights that add up to 1. These do not: divide by their sum first.",
                ),
                Mistake(lambda w: w.sum() / np.square(w).sum(), "The sum in the numerator is to be squared."),
                Mistake(
                    lambda w: np.square(w).sum() / w.sum() ** 2,
                    "This is the reciprocal: it is 1/M for equal weights, not M.",
                ),
                Mistake(
                    lambda w: float(len(w)),
                    "This is how many particles there are. Count what their weights are worth.",
                    id="effective_size-3a1bd2",
                ),
                Mistake(
                    lambda w: len(w) / (1 + np.var(w)),
                    "That formula holds for weights of mean 1: divide by their mean first.",
                ),
                Mistake(
                    lambda w: particles.effective_size(w) / len(w),
                    "That is the share of M that is effective. Asked for is the number itself.",
                ),
                Mistake(lambda w: np.square(w).sum(), "That is the sum of the squares: it stands in the denominator."),
                Mistake(
                    lambda w: (w.sum() / np.square(w).sum()) ** 2,
                    "You squared the whole quotient. Squared are the sum above, and each weight below.",
                ),
                Mistake(
                    lambda w: 1 / np.square(w / np.linalg.norm(w)).sum(),
                    "This is 1 for all weights. Divide the square of their sum by the sum of their squares, (weights ** 2).sum().",
                ),
                Mistake(
                    lambda w: 1 / np.square(w / w.mean()).sum(), "Divide the weights by their sum, not by their mean."
                ),
                Mistake(
                    lambda w: 1 / np.square(w / w.max()).sum(), "Divide the weights by their sum, not by the largest."
                ),
                Mistake(
                    lambda w: len(w) / (1 + np.var(w / w.sum())),
                    "That formula holds for weights of mean 1: divide by their mean, not by their sum.",
                ),
                Mistake(
                    lambda w: len(w) / (1 + np.var(w / w.mean(), ddof=1)),
                    "The variance here is the mean square deviation, np.var without ddof=1.",
                ),
                Mistake(
                    lambda w: float(round(particles.effective_size(w))),
                    "An effective size need not be whole: return it as it comes out.",
                ),
                Mistake(
                    lambda w: float(int(particles.effective_size(w))),
                    "An effective size need not be whole: return it as it comes out.",
                ),
                Mistake(
                    lambda w: math.exp(-(w / w.sum()) @ np.log(w / w.sum())),
                    "That is the exponential of the entropy, another measure. Here: squared sum over sum of squares.",
                ),
                Mistake(lambda w: w.sum() / w.max(), "That is another measure. Here: squared sum over sum of squares."),
            ],
        ),
        Exercise(
            "should_resample",
            reference=should_resample,
            draw=(
                *(
                    functools.partial(cloud_and_threshold, slip=slip)
                    for slip, *_ in RESAMPLING_SLIPS
                    if slip is not _up_to_the_share
                ),
                *(functools.partial(near_the_threshold, side=side) for side in (1, -1)),
                functools.partial(cloud_and_threshold, slip=_by_the_variance, beside=_below_a_share_of_the_sum),
                at_the_threshold,
                *(
                    functools.partial(weights_on_their_own_side, place=place, below=below, shares=shares)
                    for place, shares in ((0.1, True), (0.01, True), (0.001, True), (0.1, False), (0.01, False))
                    for below in (True, False)
                ),
                *(functools.partial(many_weights, side=side) for side in (1, -1)),
                one_particle_and_threshold,
            ),
            metric=metrics.Exactly(),
            hints=(
                "Resampling costs diversity. When is it worth its price?",
                "When the effective size is below the share `threshold` of the number of particles.",
                "`return effective_size(weights) < threshold * len(weights)`",
            ),
            mistakes=[
                *(Mistake(slip, text, *id) for slip, text, *id in RESAMPLING_SLIPS),
                *(
                    Mistake(
                        lambda w, t, whole=whole: whole(particles.effective_size(w)) < t * len(w),
                        "Neither the effective size nor threshold * len(weights) need be whole: compare both without rounding.",
                        id=id,
                    )
                    for whole, id in (
                        (np.floor, "should_resample-d1e394"),
                        (np.ceil, "should_resample-d1e394-2"),
                        (np.round, "should_resample-d1e394-3"),
                    )
                ),
                Mistake(
                    lambda w, t: particles.effective_size(w) < np.round(t * len(w)),
                    "Neither the effective size nor threshold * len(weights) need be whole: compare both without rounding.",
                ),
            ],
            draws=37,
        ),
        Exercise(
            "multiply_weights",
            reference=multiply_weights,
            draw=(
                *(functools.partial(cycle_of_weights, step=step) for step in STEPS),
                *(
                    functools.partial(cycle_of_weights, step=lambda rng, n: n * rng.integers(1, 5) + 2, n=n)
                    for n in (4, 6)
                ),
            ),
            draws=7,
            metric=WEIGHTS_AND_WORD,
            noisy=tuple(
                (
                    functools.partial(cycle_of_weights, step=step, n=1),
                    WEIGHTS_AND_WORD,
                    "right for longer cycles, but not for n = 1, where every step is one:",
                )
                for step in (lambda rng, n: 1, lambda rng, n: rng.integers(2, 9))
            )
            + (
                *(
                    (
                        functools.partial(cycle_of_rare_weights, after=after),
                        WEIGHTS_AND_WORD,
                        "right, but not for weights of another sum, tiny likelihoods with zeros among them, and n = 40:",
                    )
                    for after in (0, 20)
                ),
                (cycle_of_one, WEIGHTS_AND_WORD, "right, but not for a single particle:"),
            ),
            hints=(
                "Between two resamplings a particle collects the likelihoods of all measurements. How do they combine?",
                "New weight = old weight times likelihood, divided by the sum. Resample when step is a multiple of n.",
                "`product = weights * likelihood\nreturn product / product.sum(), step % n == 0`",
            ),
            mistakes=[
                Mistake(
                    _cycle(weights=lambda w, p, k, n: p),
                    "The old weights are gone: what the earlier measurements said is forgotten. Multiply.",
                ),
                Mistake(
                    _cycle(weights=lambda w, p, k, n: p if (k - 1) % n else w * p),
                    "The old weights are gone in between: only a resampling makes them equal again.",
                ),
                Mistake(
                    _cycle(weights=lambda w, p, k, n: w + p), "Independent measurements multiply, they do not add."
                ),
                Mistake(
                    _cycle(weights=lambda w, p, k, n: w if k % n else w * p),
                    "Every measurement counts, also those after which nothing is resampled.",
                ),
                Mistake(
                    _cycle(weights=lambda w, p, k, n: np.ones_like(w) if k % n == 0 else w * p),
                    "You made the weights equal already. The resampling comes first: it draws by this product.",
                ),
                Mistake(_cycle(weights=lambda w, p, k, n: w * p ** (1 / n)), "Each likelihood counts fully: no root."),
                Mistake(_cycle(share=lambda w: w), "The weights do not add up to 1: divide by their sum."),
                Mistake(
                    lambda w, p, k, n: (w / w.sum() * p / p.sum(), k % n == 0),
                    "Also where weights and likelihoods add up to 1 each, their products do not: divide the product by its own sum.",
                    id="multiply_weights-cb4652",
                ),
                Mistake(
                    lambda w, p, k, n: (w * p / (w * p).sum() if k % n == 0 else w * p, k % n == 0),
                    "The weights do not add up to 1 in the steps between: divide by their sum in each step.",
                ),
                Mistake(
                    lambda w, p, k, n: (w * p if k % n == 0 else w * p / (w * p).sum(), k % n == 0),
                    "The weights do not add up to 1 where you resample: divide by their sum in each step.",
                ),
                Mistake(_cycle(share=lambda w: w / w.max()), "Divide by the sum of the weights, not by the largest."),
                Mistake(_cycle(share=lambda w: w / len(w)), "Divide by the sum of the weights, not by their number."),
                Mistake(
                    _cycle(due=lambda k, n: k % n != 0),
                    "The weights are right. Resample in every n-th step, not in all others.",
                ),
                Mistake(_cycle(due=lambda k, n: True), "The weights are right. You resample in every step."),
                Mistake(
                    _cycle(due=lambda k, n: False),
                    "The weights are right. You resample in no step that was asked for, and some are an n-th one.",
                    id="multiply_weights-e12379",
                ),
                Mistake(
                    _cycle(due=lambda k, n: k >= n), "The weights are right. From step n on you resample in every step."
                ),
                Mistake(
                    _cycle(due=lambda k, n: k > n),
                    "The weights are right. You resample in every step after n: every n-th is meant, step n itself included.",
                ),
                Mistake(
                    _cycle(due=lambda k, n: k == n),
                    "The weights are right. You resample once, in step n: every n-th is meant.",
                ),
                Mistake(
                    _cycle(due=lambda k, n: n % k == 0),
                    "The weights are right. The remainder is that of step by n, not of n by step.",
                ),
                *(
                    Mistake(
                        _cycle(due=late),
                        "The weights are right. Where n is more than 1 you resample in steps 1, n + 1, 2 n + 1, ... instead of n, 2 n, 3 n, ...",
                        id=id,
                    )
                    for late, id in (
                        (lambda k, n: k % n == 1, "multiply_weights-5ab4db"),
                        (lambda k, n: (k - 1) % n == 0, "multiply_weights-late"),
                    )
                ),
                Mistake(
                    _cycle(due=lambda k, n: (k + 1) % n == 0),
                    "The weights are right. You resample one step before the n-th.",
                ),
                Mistake(lambda w, p, k, n: multiply_weights(w, p, k, n)[::-1], "The order is weights, resample."),
            ],
        ),
        Exercise(
            "circular_mean",
            reference=circular_mean,
            sizes=("weights",),
            draw=(headings, *(functools.partial(headings, about=about) for about in (0.0, 2.0, -2.0))),
            metric=metrics.Angles(1e-9),
            noisy=(
                *(
                    (
                        functools.partial(few_headings, count=count),
                        metrics.Angles(1e-9),
                        f"right, but not for {words} of tiny weight and with full turns in it:",
                    )
                    for count, words in ((1, "a single angle"), (3, "a few angles"))
                ),
                (headings_without_weight, metrics.Angles(1e-9), "right, but not where some angles weigh nothing:"),
                (headings_alike, metrics.Angles(1e-9), "right, but not where several angles are the same:"),
                *(
                    (
                        functools.partial(headings_mirrored, about=math.radians(degrees)),
                        metrics.Angles(1e-9),
                        f"right, but not where the mean direction is exactly {degrees} deg:",
                    )
                    for degrees in (0, 180)
                ),
            ),
            hints=(
                "The mean of 179 deg and -179 deg should be 180 deg. What could be averaged instead of angles?",
                "Average the unit vectors (cos, sin), and take the direction of the result.",
                "`return np.arctan2(np.sum(weights * np.sin(angles)), np.sum(weights * np.cos(angles)))`",
            ),
            mistakes=[
                Mistake(
                    lambda a, w: particles.circular_mean(a, np.array([1.0, *w[1:]])),
                    "The first angle counts as if its weight were 1. It has one of its own, weights[0].",
                ),
                Mistake(
                    lambda a, w: float(planar.wrap_angle(a.mean())),
                    "The arithmetic mean of angles across the seam may point backward. Average directions, not numbers.",
                    "circular_mean-d2e690",
                ),
                Mistake(
                    lambda a, w: float(w @ a / w.sum()),
                    "The arithmetic mean of angles across the seam may point backward. Average directions, not numbers.",
                    "circular_mean-d2e690-2",
                ),
                Mistake(
                    lambda a, w: float(w @ (a % (2 * math.pi)) / w.sum()),
                    "You averaged the numbers, only with their seam elsewhere, between 0 and 2 pi: there it bites other headings. Average directions: their cosines and sines.",
                ),
                Mistake(
                    lambda a, w: float(planar.wrap_angle(w @ np.unwrap(a) / w.sum())),
                    "A mean of unrolled angles, or of differences from one of them, is not the direction of the mean vector, though near it for angles that lie close together: average cosines and sines.",
                    id="circular_mean-394601",
                ),
                Mistake(
                    lambda a, w: float(planar.wrap_angle(a[0] + w @ planar.wrap_angle(a - a[0]) / w.sum())),
                    "A mean of unrolled angles, or of differences from one of them, is not the direction of the mean vector, though near it for angles that lie close together: average cosines and sines.",
                    id="circular_mean-394601-2",
                ),
                Mistake(
                    lambda a, w: math.degrees(particles.circular_mean(np.radians(a), w)),
                    "The angles are in radians already: nothing is to be converted.",
                ),
                Mistake(
                    lambda a, w: 0.5 * math.atan2((w * np.sin(2 * a)).sum(), (w * np.cos(2 * a)).sum()),
                    "You doubled the angles and halved the result. That is the mean of axes, which have no front: directions are averaged as they are.",
                ),
                Mistake(lambda a, w: particles.circular_mean(a), "The weights are missing."),
                Mistake(
                    lambda a, w: (float((w * np.cos(a)).sum()), float((w * np.sin(a)).sum())),
                    "That is the mean vector. Its direction is asked for: np.arctan2(sine part, cosine part).",
                ),
                Mistake(
                    lambda a, w: math.atan2((a * np.sin(w)).sum(), (a * np.cos(w)).sum()),
                    "That is the mean with angles and weights exchanged: sines and cosines are those of the angles.",
                ),
                Mistake(lambda a, w: float(np.median(a)), "The median of angles depends on where their seam lies."),
                Mistake(
                    lambda a, w: float(w @ a),
                    "You added angles. Add directions, (cos, sin) times the weight, and take the direction of the sum.",
                ),
                Mistake(
                    lambda a, w: math.atan2(np.sin(w * a).sum(), np.cos(w * a).sum()),
                    "A weight makes a direction longer, it does not turn it: w * np.sin(a), not np.sin(w * a).",
                ),
                *(
                    Mistake(
                        lambda a, w, unit=unit: math.atan2(
                            np.sin(w * a / unit(w)).sum(), np.cos(w * a / unit(w)).sum()
                        ),
                        "A weight makes a direction longer, it does not turn it: w * np.sin(a), not np.sin(w * a).",
                    )
                    for unit in (np.sum, np.mean, np.max)
                ),
                Mistake(
                    lambda a, w: math.atan2((w * np.sin(a)).sum(), np.cos(a).sum()), "The cosines have no weights."
                ),
                Mistake(
                    lambda a, w: math.atan2(np.average(np.sin(a), weights=w), np.cos(a).mean()),
                    "The cosines have no weights.",
                ),
                Mistake(lambda a, w: math.atan2(np.sin(a).sum(), (w * np.cos(a)).sum()), "The sines have no weights."),
                Mistake(
                    lambda a, w: math.atan2(np.sin(a).mean(), np.average(np.cos(a), weights=w)),
                    "The sines have no weights.",
                ),
                Mistake(
                    lambda a, w: math.asin((w * np.sin(a)).sum() / w.sum()),
                    "The arcsine knows only half the circle, and wants a unit vector. np.arctan2 takes both parts.",
                ),
                Mistake(
                    lambda a, w: math.acos((w * np.cos(a)).sum() / w.sum()),
                    "The arccosine knows only half the circle, and wants a unit vector. np.arctan2 takes both parts.",
                ),
                Mistake(
                    lambda a, w: math.copysign(1, (w * np.sin(a)).sum()) * math.acos((w * np.cos(a)).sum() / w.sum()),
                    "The arccosine wants the cosine part of a unit vector, and the mean of unit vectors is shorter than 1. np.arctan2 takes both parts, whatever their length.",
                ),
                Mistake(
                    lambda a, w: math.atan((w * np.tan(a)).sum() / w.sum()),
                    "Tangents are not parts of a vector. Average cosines and sines, then take np.arctan2.",
                ),
                Mistake(
                    lambda a, w: float(a[np.argmax(w)]), "You took the heaviest angle. The others have a say as well."
                ),
                Mistake(
                    lambda a, w: math.atan2((w * np.cos(a)).sum(), (w * np.sin(a)).sum()),
                    "Sine and cosine have changed places: arctan2 takes the sine part first.",
                ),
                Mistake(
                    lambda a, w: math.atan((w * np.sin(a)).sum() / (w * np.cos(a)).sum()),
                    "The plain arctan knows only half the circle. arctan2 takes both parts and knows the whole of it.",
                    "circular_mean-8e98e4",
                ),
            ],
        ),
        Prediction(
            "kidnap",
            question="The cloud has converged, then the robot is carried into another room. What does the plain filter do?",
            choices=(
                "it finds the robot within some steps",
                "it stays where it is",
                "its weights become zero and it stops",
            ),
            answer="it stays where it is",
            why="No particle is near the new place, and resampling cannot invent one. Weights are normalized, so even hopeless particles look fine.",
        ),
        Exercise(
            "recover",
            reference=recover,
            draw=(*[averages] * 3, averages_that_rise, averages_just_below, functools.partial(averages, low=True)),
            metric=RECOVERY,
            noisy=(
                *(
                    (
                        functools.partial(averages_of_densities, scale=scale, low=True),
                        OF_ANY_SIZE,
                        f"right, but not for {words}:",
                    )
                    for scale, words in (
                        (1e-3, "weights of a thousandth"),
                        (1e-100, "tiny weights"),
                        (100.0, "weights of dozens"),
                    )
                ),
                *(
                    (
                        functools.partial(averages_apart, share=share),
                        RECOVERY,
                        f"right, but not for a share of {words}:",
                    )
                    for share, words in ((1e-5, "some millionths"), (0.9999, "nearly 1"))
                ),
                (averages_that_stand, RECOVERY, "right, but not where nothing changes, w_mean = w_slow = w_fast:"),
            ),
            hints=(
                "When the recent weights are worse than usual, something is wrong. Two averages, one quick and one slow, tell it.",
                "Bring both up to date first: w += alpha (w_mean - w). The share is 1 - w_fast / w_slow, never below 0.",
                "`w_slow += alpha_slow * (w_mean - w_slow)\n"
                "w_fast += alpha_fast * (w_mean - w_fast)\n"
                "return max(0, 1 - w_fast / w_slow), w_slow, w_fast`",
            ),
            mistakes=[
                Mistake(
                    lambda m, s, f, a, b: (max(0.0, 1 - f / s), *mcl.recover(m, s, f, a, b)[1:]),
                    "The share uses the old averages. Bring them up to date first.",
                ),
                Mistake(
                    lambda m, s, f, a, b: (
                        1 - (f + b * (m - f)) / (s + a * (m - s)),
                        *mcl.recover(m, s, f, a, b)[1:],
                    ),
                    "The share can fall below zero when things go well: take the larger of it and 0.",
                ),
                Mistake(
                    lambda m, s, f, a, b: (
                        max(0.0, 1 - (s + a * (m - s)) / (f + b * (m - f))),
                        *mcl.recover(m, s, f, a, b)[1:],
                    ),
                    "The ratio is upside down: w_fast is the one that drops first.",
                ),
                Mistake(
                    lambda m, s, f, a, b: (max(0.0, 1 - f / s), s, f),
                    "Nothing has been brought up to date: w_mean does not enter yet.",
                ),
                Mistake(
                    lambda m, s, f, a, b: mcl.recover(m, s, f, a, b)[::2] + mcl.recover(m, s, f, a, b)[1:2],
                    "Right numbers in another order: return the share, then w_slow, then w_fast.",
                ),
                Mistake(
                    lambda m, s, f, a, b: mcl.recover(m, s, f, a, b)[1:] + mcl.recover(m, s, f, a, b)[:1],
                    "Right numbers in another order: return the share, then w_slow, then w_fast.",
                ),
                Mistake(
                    lambda m, s, f, a, b: _recover(s + b * (m - s), f + a * (m - f)),
                    "The two alphas have changed places: alpha_slow belongs to w_slow.",
                ),
                Mistake(
                    lambda m, s, f, a, b: _recover(m + a * (s - m), m + b * (f - m)),
                    "Your alpha weighs the old value: a small alpha has to change the average little.",
                ),
                Mistake(
                    lambda m, s, f, a, b: _recover(s + a * m, f + b * m),
                    "You added alpha * w_mean. An average moves toward w_mean: add alpha * (w_mean - w).",
                ),
                Mistake(
                    lambda m, s, f, a, b: _recover(s - a * (m - s), f - b * (m - f)),
                    "The averages move away from w_mean: add alpha * (w_mean - w).",
                ),
                Mistake(
                    lambda m, s, f, a, b: (
                        min(0.5, max(0.1, mcl.recover(m, s, f, a, b)[0])),
                        *mcl.recover(m, s, f, a, b)[1:],
                    ),
                    "Limits of the share are the filter's own business: return it as the formula gives it.",
                ),
                Mistake(
                    _share(lambda s, f: min(0.5, max(0.3, 1 - f / s)) if f < s else 0.0),
                    "Limits of the share are the filter's own business: return it as the formula gives it.",
                ),
                *(
                    Mistake(
                        _share(lambda s, f, low=low, high=high: min(high, max(low, 1 - f / s))),
                        "Limits of the share are the filter's own business: return it as the formula gives it.",
                    )
                    for low, high in ((0.3, 0.5), (0.0, 0.5), (0.0, 0.3), (0.1, 0.3), (0.1, 1.0), (0.3, 1.0))
                ),
                *RECOVERIES,
                Mistake(
                    lambda m, s, f, a, b: mcl.recover(m, s, f, 0.05, 0.3),
                    "Your alphas are numbers of your own. They come as arguments: alpha_slow, alpha_fast.",
                ),
                Mistake(
                    lambda m, s, f, a, b: mcl.recover(m, s, f, a, b)[:1] + (s, f),
                    "You returned the old averages: the next step needs the new ones.",
                ),
            ],
            draws=12,
        ),
        Exercise(
            "scan_from_depth",
            reference=scan_from_depth,
            draw=(row_of_depths, functools.partial(row_of_depths, odd=True)),
            metric=DEPTHS,
            noisy=(
                (nothing_seen, DEPTHS, "right where something is seen, but not where no column is:"),
                (one_column, DEPTHS, "right for many columns, but not for a single one:"),
                *(
                    (functools.partial(depths_of_a_camera, **camera), DEPTHS, f"right, but not for {words}:")
                    for camera, words in (
                        (
                            {"field_of_view": 2.6, "n": 640, "scale": 10.0},
                            "a wide camera of 640 columns that sees dozens of meters, some depths just beside a limit",
                        ),
                        (
                            {"field_of_view": 0.1, "n": 2, "scale": 0.01},
                            "a narrow camera of 2 columns that sees centimeters, both depths just beside a limit",
                        ),
                    )
                ),
            ),
            hints=(
                "Where on the picture is column k? Half the picture's width belongs to tan(field_of_view / 2).",
                "With u = (n / 2 - 0.5 - k) / (n / 2): bearing = arctan(u tan(field_of_view / 2)), range = depth / cos(bearing).",
                "`n = len(depth)\n"
                "u = (n / 2 - 0.5 - np.arange(n)) / (n / 2)\n"
                "bearings = np.arctan(u * np.tan(field_of_view / 2))\n"
                "seen = (depth >= near) & (depth <= far)\n"
                "return (depth / np.cos(bearings))[seen], bearings[seen]`",
            ),
            mistakes=[
                Mistake(
                    lambda d, f, near, far: _within(near, far, *scan_from_depth(d, f, 1e-9, 1e9)),
                    "near and far are limits of the depth, along the optical axis: compare the depth, not the range along the ray.",
                ),
                Mistake(
                    lambda d, f, near, far: scan_from_depth(d, np.radians(f), near, far),
                    "The opening angle is in radians already.",
                ),
                Mistake(
                    _depth(of=lambda d, b: d),
                    "The bearings are right. A depth counts along the optical axis: to the sides the range is longer.",
                ),
                Mistake(
                    _depth(of=lambda d, b: d * np.cos(b)),
                    "The bearings are right. The cosine divides: the range is longer than the depth.",
                ),
                Mistake(
                    _depth(of=lambda d, b: d / np.sin(b)),
                    "The bearings are right. The depth is the side along the axis: the cosine.",
                ),
                Mistake(
                    _depth(angle=lambda u, fov: u * fov / 2),
                    "Columns are evenly spaced on the picture, not in angle: a bearing is the arctangent of the place on the picture, which reaches from tan(field_of_view / 2) on the left to minus that.",
                    id="scan_from_depth-469b65",
                ),
                Mistake(
                    _evenly_from_edge_to_edge,
                    "Two slips: columns are evenly spaced on the picture, not in angle; and the first bearing is that of its column's middle, not of the picture's edge.",
                ),
                Mistake(
                    lambda d, f, near, far: scan_from_depth(d[(d >= near) & (d <= far)], f, near, far),
                    "You leave columns out before you compute the bearings. A column keeps its number in the whole picture: leave out at the end.",
                ),
                Mistake(
                    _depth(angle=lambda u, fov: -np.arctan(u * math.tan(fov / 2))),
                    "Left and right are exchanged: column 0 is on the left, where bearings are positive.",
                ),
                Mistake(
                    _depth(angle=lambda u, fov: np.arctan(u * math.tan(fov))),
                    "Half of the opening angle lies on each side: tan(field_of_view / 2).",
                ),
                Mistake(
                    _depth(angle=lambda u, fov: np.arctan(u / math.tan(fov / 2))),
                    "The tangent is upside down: the edge of the picture is at field_of_view / 2.",
                ),
                Mistake(
                    _depth(angle=lambda u, fov: np.arctan(np.linspace(1, -1, len(u)) * math.tan(fov / 2))),
                    "A column has its bearing in its middle: the outermost ones lie half a column inside.",
                ),
                Mistake(
                    _depth(angle=lambda u, fov: np.arctan((u - 1 / len(u)) * math.tan(fov / 2))),
                    "Off by half a column: the middle of column k is at k + 0.5.",
                    "scan_from_depth-4ad7d0",
                ),
                Mistake(
                    _depth(angle=lambda u, fov: np.arctan((u + 1 / len(u)) * math.tan(fov / 2))),
                    "Off by half a column: the middle of column k is at k + 0.5.",
                    "scan_from_depth-4ad7d0-2",
                ),
                Mistake(
                    _depth(seen=lambda d, near, far: (d > near) & (d < far)),
                    "A depth of exactly `near` or `far` is seen as well.",
                ),
                Mistake(
                    _depth(seen=lambda d, near, far: d > 0), "Depths outside of near and far are no readings either."
                ),
                Mistake(
                    _depth(seen=lambda d, near, far: d <= far), "What is nearer than `near`, also 0, is no reading."
                ),
                Mistake(_depth(seen=lambda d, near, far: d >= near), "What is farther than `far` is no reading."),
                Mistake(
                    _depth(seen=lambda d, near, far: np.ones(len(d), bool)),
                    "Columns without a depth between near and far are to be left out.",
                ),
                *(
                    Mistake(
                        _at_the_limit(own),
                        "Columns that are not seen come back as readings at `far`. They are to be left out, of ranges and bearings both.",
                    )
                    for own in (False, True)
                ),
                Mistake(
                    _kept_as_zeros,
                    "Columns that are not seen come back as readings of 0. They are to be left out, of ranges and bearings both.",
                ),
                Mistake(lambda *a: scan_from_depth(*a)[::-1], "The order is ranges, bearings."),
                Mistake(
                    lambda *a: (scan_from_depth(*a)[0], np.degrees(scan_from_depth(*a)[1])),
                    "The ranges are right. The bearings are in degrees: leave them in radians.",
                ),
            ],
        ),
        _hunt(
            "hunt_1",
            hunt_1,
            specimens.specimen_1,
            "An index in front of a heavy one comes out too often. Unequal weights show it, and shares counted over many runs.",
            (
                "What must hold for a resampler on average?",
                "Count how often each index comes out in many runs, and compare with its weight.",
                "`w = np.array([0.1, 0.7, 0.1, 0.1])\n"
                "index = np.concatenate([resample(w, rng) for _ in range(1000)])\n"
                "return np.abs(np.bincount(index, minlength=4) / len(index) - w).max() < 0.05`",
            ),
            others=(SQUARED, UNIFORM, TO_THE_MIDDLE, LAST_ALONE, HEAVIEST_ALONE, SORTED, TWO_ALONE, SAME_SPREAD),
            named="hunt_1-372f30",
        ),
        _hunt(
            "hunt_2",
            hunt_2,
            specimens.specimen_2,
            "Copies of the heavy particles hide it. Count over many runs how often the light ones come out, next to a heavy one.",
            (
                "Does your first test catch it? If not: which weights did it not try?",
                "Use many light particles whose share M w is below 1, next to a heavy one.",
                "`w = np.array([0.5] + 10 * [0.05])\n"
                "index = np.concatenate([resample(w, rng) for _ in range(1000)])\n"
                "return np.abs(np.bincount(index, minlength=11) / len(index) - w).max() < 0.03`",
            ),
            others=(
                SQUARED,
                UNIFORM,
                (_lightest_left_out, "never draws the lightest ones"),
                (
                    _some_light_ones_left_out,
                    "never draws some of the lightest ones, and others of the same weight too often",
                ),
                TO_THE_MIDDLE,
                (_specimen_2_of_many, "has the same defect, but among more than six particles only"),
            ),
            named="hunt_2-3cc571",
        ),
        _hunt(
            "hunt_3",
            hunt_3,
            specimens.specimen_3,
            "While the weights add up to 1 it does no harm. Let their sum be a little less, 0.99 say, and try several times: the last spoke must fall beyond it. The IndexError is the harm: catch it, and return False.",
            (
                "On average it is right. What does it take for granted about the weights?",
                "Floating-point weights need not add up to 1. Try a sum a little below 1, several times, with `except IndexError` around it, and look at the largest index.",
                "`try:\n"
                "    return all(resample(np.full(1000, 0.000999), rng).max() < 1000 for _ in range(20))\n"
                "except IndexError:\n"
                "    return False`",
            ),
            others=((_beyond_the_last, "raises nothing, but hands out an index beyond the last particle"),),
            named="hunt_3-632ac2",
        ),
        _hunt(
            "hunt_4",
            hunt_4,
            specimens.specimen_4,
            "With one reading, or by which particle is heavier, it looks right. What must a second reading do to the *ratio* of two weights?",
            (
                "Independent readings multiply. What must happen when the same reading comes twice?",
                "Weigh two particles by one reading, then by the same reading of the same landmark twice: the ratio of their weights must be squared.",
                "`x, mark = np.array([[0.0, 0, 0], [0.3, 0, 0]]), np.array([[2.0, 0]])\n"
                "a, b = weigh(x, np.array([2.0]), mark, 0.3)\n"
                "c, d = weigh(x, np.array([2.0, 2.0]), np.vstack([mark, mark]), 0.3)\n"
                "return np.isclose(c / d, (a / b) ** 2)`",
            ),
            others=(
                (
                    _mean_of_logarithms,
                    "takes the geometric mean of the densities, so that a second reading adds nothing",
                ),
                (_second_for_half, "takes a second reading for half of one: the ratio changes, but not enough"),
            ),
            good=(_weights_multiplied, _weights_not_normalized),
            extra=(),
            named="hunt_4-c568a6",
        ),
    ],
    further=("landmark_weight", "multiply_weights", "scan_from_depth", "hunt_1", "hunt_2", "hunt_3", "hunt_4"),
)
