"""Sensor models: what one measurement says about many poses.

A sensor model takes one measurement and returns a `Weighting`, a function of the states that gives the *logarithm* of
each weight: a product of many small densities is a sum that cannot underflow.
Source: lecture "Lokalisierung", "Monte-Carlo-Lokalisierung", "2D-Laser-Scanner", "Likelihoodfield".
"""

import functools
import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from ..checks import (
    as_count,
    as_finite,
    as_floats,
    as_indices,
    as_nonnegative,
    as_number,
    as_points,
    as_positive_number,
    as_shape,
    fit_together,
    shown,
)
from ..documented import documented
from ..geometry.planar import wrap_angle

SENSORS = ("landmarks", "beams", "likelihood field")
# Readings share their errors: 60 neighboring beams do not know 60 times as much as one. Shares of the log weights that
# a filter uses, found by the success rates of tests/bench/mcl_success.py
EXPONENTS = {"landmarks": 0.3, "beams": 0.1, "likelihood field": 0.06}


@dataclass(frozen=True, eq=False)
class Weighting:
    """One measurement as a function of the states.

    Parameters
    ----------
    function : function (states, shape (..., 3)) -> log weights, shape (...)
    best : float
        Log weight of a state that fits perfectly; the yardstick by which recovery judges how bad a cloud has become.
    """

    function: object
    best: float = 0.0

    def __call__(self, states):
        return self.function(states)

    def tempered(self, exponent):
        """The `Weighting` whose weights are these to the power of `exponent`."""
        exponent = as_number(exponent, "exponent")
        return Weighting(lambda states: exponent * self.function(states), exponent * self.best)


# --- landmarks -------------------------------------------------------------------------------------------------------


def weigh_landmarks(z, landmarks, std_range=None, std_bearing=None):
    """Weighting by ranges and bearings to known landmarks: the product of the normal densities of all readings.

    Parameters
    ----------
    z : array-like, shape (m, 2)
        Measured range (m) and bearing (rad) of each landmark that is seen.
    landmarks : array-like, shape (m, 2)
        The positions of the landmarks seen, in the same order (m).
    std_range, std_bearing : float, optional
        Standard deviations (m, rad). Leave one out to use the other reading alone.

    Returns
    -------
    Weighting

    Raises
    ------
    ValueError
        Not one reading per landmark, or neither standard deviation.

    See Also
    --------
    labkit.fast.sensors.weigh_landmarks : the same for thousands of particles

    Source: lecture, "Landmarkbasiertes Verfahren (2)".
    """
    z, landmarks, std_range, std_bearing = as_sighting(z, landmarks, std_range, std_bearing)

    def weigh(states):
        states = as_points(states, "states")
        d = landmarks - states[..., None, :2]
        log_p = np.zeros(states.shape[:-1])
        if std_range is not None:
            log_p += log_normal(z[:, 0] - np.hypot(d[..., 0], d[..., 1]), std_range).sum(-1)
        if std_bearing is not None:
            bearing = np.arctan2(d[..., 1], d[..., 0]) - states[..., 2, None]
            log_p += log_normal(wrap_angle(z[:, 1] - bearing), std_bearing).sum(-1)
        return log_p

    return Weighting(weigh, len(z) * sum(log_normal(0.0, std) for std in (std_range, std_bearing) if std is not None))


def as_sighting(z, landmarks, std_range, std_bearing):
    """The arguments of `weigh_landmarks`, checked."""
    z, landmarks = as_points(z, "z", dim=2), as_points(landmarks, "landmarks", dim=2)
    if z.ndim != 2 or z.shape != landmarks.shape:
        raise ValueError(f"z and landmarks must have the same shape (m, 2), got {z.shape} and {landmarks.shape}")
    if std_range is None and std_bearing is None:
        raise ValueError("std_range or std_bearing must be given, got neither: nothing would be weighed")
    std_range = None if std_range is None else as_positive_number(std_range, "std_range")
    std_bearing = None if std_bearing is None else as_positive_number(std_bearing, "std_bearing")
    return z, landmarks, std_range, std_bearing


def log_normal(error, std):
    """Logarithm of a normal density, log N(0, std^2).

    Parameters
    ----------
    error : array-like
    std : float
        In the unit of the error.

    Returns
    -------
    log_density : array of the error's shape
        -infinity for an infinite error.
    """
    error, std = as_floats(error, "error"), as_positive_number(std, "std")
    return -0.5 * np.square(error / std) - math.log(std * math.sqrt(2 * math.pi))


@documented
def see_landmarks(grid, pose, landmarks, rng, std_range=0.1, std_bearing=0.035, r_max=8.0):
    """The landmarks in sight, nearer than r_max and not behind a wall, and noisy readings of them.

    Parameters
    ----------
    grid : OccupancyGrid or None
        Or anything with `cast(poses, bearings, r_max)`. None: nothing hides anything. Landmarks may sit on a wall: the
        last 0.1 m before one does not hide it.
    pose : array-like, shape (3,)
        x, y, theta (m, m, rad).
    landmarks : array-like, shape (m, 2)
        m.
    rng : numpy.random.Generator
    std_range, std_bearing, r_max : float
        Standard deviations (m, rad) and reach (m), none negative.

    Returns
    -------
    index : array of int, shape (k,)
    z : array, shape (k, 2)
        Range (m) and bearing (rad) of each landmark seen.
    """
    pose, landmarks = as_shape(pose, "pose", 3), as_shape(landmarks, "landmarks", "m", 2)
    named = ((std_range, "std_range"), (std_bearing, "std_bearing"), (r_max, "r_max"))
    std_range, std_bearing, r_max = (float(as_nonnegative(as_number(value, name), name)) for value, name in named)
    d = landmarks - pose[:2]
    r, phi = np.hypot(*d.T), wrap_angle(np.arctan2(d[:, 1], d[:, 0]) - pose[2])
    seen = r < r_max
    if grid is not None:
        seen &= grid.cast(pose, phi, r_max + 1.0) > r - 0.1
    index = np.flatnonzero(seen)
    noise = rng.standard_normal((len(index), 2)) * [std_range, std_bearing]
    return index, np.column_stack([r[index], phi[index]]) + noise


# --- beams -----------------------------------------------------------------------------------------------------------


def as_scan(ranges, bearings):
    """Ranges and bearings of one scan, two arrays of shape (B,)."""
    ranges, bearings = as_finite(ranges, "ranges"), as_finite(bearings, "bearings")
    if ranges.ndim != 1 or ranges.shape != bearings.shape:
        raise ValueError(f"ranges and bearings must have the same shape (B,), got {ranges.shape} and {bearings.shape}")
    return ranges, bearings


def weigh_beams(world, ranges, bearings, std, r_max, shares=(0.75, 0.1, 0.05, 0.1), decay=0.5):
    """Weighting by the beam model: each range is compared with the one that the map predicts.

    Parameters
    ----------
    world : OccupancyGrid
        Or anything with `cast(poses, bearings, r_max)`.
    ranges, bearings : array-like, shape (B,)
        One scan (m, rad).
    std, r_max, shares, decay
        As for `beam_density`. The lecture's model is shares = (1, 0, 0, 0): one surprise makes the whole product zero
        or nearly so.

    Returns
    -------
    Weighting

    See Also
    --------
    labkit.fast.sensors.weigh_beams : the same for thousands of particles

    Source: lecture, "Strahlenmodell"; the mixture is the usual extension.
    """
    ranges, bearings = as_scan(ranges, bearings)

    def log_density(expected):
        with np.errstate(divide="ignore"):  # log 0 = -inf is the honest weight of an impossible pose
            return np.log(beam_density(ranges, expected, std, r_max, shares, decay))

    best = log_density(ranges)
    return Weighting(
        lambda states: log_density(world.cast(states, bearings, r_max)).sum(-1), float(best[best > -np.inf].sum())
    )


def beam_density(ranges, expected, std, r_max, shares, decay=0.5):
    """p(range | expected range) of the beam model, in 1/m (a share where the reading is r_max).

    Each part integrates to its share over [0, r_max], so the whole is a density for every expected range.

    Parameters
    ----------
    ranges, expected : array-like
        Measured and expected ranges (m); shapes broadcast.
    std : float
        Standard deviation of a range (m).
    r_max : float
        Range of the scanner (m).
    shares : array-like, shape (4,)
        Numbers that add up to 1. Hit: Gauss about the expected range, normalized on [0, r_max]. Short: something
        unmapped stood in the way. Max: nothing came back. Random.
    decay : float
        Rate of the short readings (1/m).

    Returns
    -------
    array, the broadcast shape

    Raises
    ------
    ValueError
        Shares that do not add up to 1; a std, r_max or decay that is not positive.
    """
    std, r_max, shares, decay = as_beam_model(std, r_max, shares, decay)
    ranges, expected = as_finite(ranges, "ranges"), as_finite(expected, "expected")
    fit_together(ranges=ranges.shape, expected=expected.shape)
    hit, short, none, anywhere = shares
    in_range = np.maximum(ndtr((r_max - expected) / std) - ndtr(-expected / std), 1e-12)
    p_hit = np.exp(-0.5 * np.square((ranges - expected) / std)) / (std * math.sqrt(2 * math.pi)) / in_range
    before = np.maximum(-np.expm1(-decay * expected), 1e-12)
    p_short = (ranges < expected) * decay * np.exp(-decay * ranges) / before
    density = hit * p_hit + short * p_short + anywhere / r_max
    return np.where(ranges >= r_max, none + anywhere / r_max + (expected >= r_max) * hit, density)


def as_beam_model(std, r_max, shares, decay):
    """The parameters of the beam model, checked."""
    shares = as_finite(shares, "shares")
    if shares.shape != (4,) or (shares < 0).any() or abs(shares.sum() - 1) > 1e-9:
        raise ValueError(f"shares must be four numbers from 0 to 1 that add up to 1, got {shown(shares)}")
    std, r_max, decay = (as_positive_number(v, n) for v, n in ((std, "std"), (r_max, "r_max"), (decay, "decay")))
    return std, r_max, tuple(shares.tolist()), decay


# --- likelihood field ------------------------------------------------------------------------------------------------


class LikelihoodField:
    """How well a measured obstacle point fits the map: p of its distance d to the nearest obstacle.

    p(d) = share_hit * N(0, std^2)(d) + (1 - share_hit) / r_max; the lecture's model is share_hit = 1.

    Parameters
    ----------
    grid : OccupancyGrid
    std : float
        Standard deviation of the distance (m).
    share_hit : float, 0 < share_hit <= 1
        The rest is spread evenly over the range: a beam that fits nowhere costs a bounded amount.
    r_max : float
        Range of the scanner (m): readings at or beyond it say nothing about obstacles and are left out.
    max_distance : float, optional
        Distances are cut off here (m), and a point beyond the map counts as this far away; 6 std when not given.

    Attributes
    ----------
    table : array, shape (H, W)
        log p in the middle of each cell, computed once.

    See Also
    --------
    labkit.fast.sensors.LikelihoodField : the same for thousands of particles

    Source: lecture, "Likelihoodfield (1)" and "(2)".
    """

    @documented
    def __init__(self, grid, std, share_hit=0.95, r_max=18.0, max_distance=None):
        self.grid, self.std = grid, as_positive_number(std, "std")
        self.r_max = as_positive_number(r_max, "r_max")
        share_hit = as_number(share_hit, "share_hit")
        if not 0 < share_hit <= 1:
            raise ValueError(f"share_hit must be above 0 and at most 1, got {shown(share_hit)}")
        self.share_hit = share_hit
        self.max_distance = 6 * self.std if max_distance is None else as_positive_number(max_distance, "max_distance")
        self.table = self.log_density(np.minimum(grid.distance, self.max_distance))

    def log_density(self, distance):
        """log p at distances from the nearest obstacle (m); any shape."""
        log_hit = math.log(self.share_hit) + log_normal(as_finite(distance, "distance"), self.std)
        if self.share_hit == 1:
            return log_hit
        return np.logaddexp(log_hit, math.log((1 - self.share_hit) / self.r_max))

    def log_weights(self, poses, ranges, bearings):
        """Sum of log p over the end points of one scan's beams, seen from each pose.

        Parameters
        ----------
        poses : array-like, shape (..., 3)
            x, y, theta (m, m, rad).
        ranges, bearings : array-like, shape (B,)
            One scan (m, rad).

        Returns
        -------
        array, shape (...)
        """
        poses = as_points(poses, "poses")
        ranges, bearings = as_scan(ranges, bearings)
        hit = ranges < self.r_max
        r, angle = ranges[hit], poses[..., 2, None] + bearings[hit]
        x, y = poses[..., 0, None] + r * np.cos(angle), poses[..., 1, None] + r * np.sin(angle)
        i, j = self.grid.cell_of(np.stack([x, y], axis=-1))
        height, width = self.table.shape
        inside = (i >= 0) & (i < height) & (j >= 0) & (j < width)
        log_p = self.table[np.where(inside, i, 0), np.where(inside, j, 0)]
        return np.where(inside, log_p, self.log_density(self.max_distance)).sum(-1)


@documented
def weigh_likelihood_field(field, ranges, bearings):
    """Weighting by a `LikelihoodField`: how near do the measured obstacle points lie to mapped ones?

    Parameters
    ----------
    field : LikelihoodField
    ranges, bearings : array-like, shape (B,)
        One scan (m, rad); readings at the field's r_max are left out.

    Returns
    -------
    Weighting

    Source: lecture, "Likelihoodfield (1)" and "(2)".
    """
    ranges, bearings = as_scan(ranges, bearings)
    hits = int((ranges < field.r_max).sum())
    return Weighting(lambda states: field.log_weights(states, ranges, bearings), hits * float(field.log_density(0.0)))


# --- doors, and all three sensors together ---------------------------------------------------------------------------


def weigh_doors(doors, saw_door, std=0.3, trust=0.9):
    """Weighting of positions along a corridor by a sensor that says "door" or "no door".

    Parameters
    ----------
    doors : array-like, shape (n,)
        Positions (m), at least one.
    saw_door : bool
    std : float
        Half width of a door as a Gauss (m).
    trust : float, 0.5 <= trust < 1
        Share of right answers in front of a door.

    Returns
    -------
    Weighting
        Of positions x (m), shape (M,).

    Raises
    ------
    ValueError
        No door, or a trust outside [0.5, 1).

    Source: lecture, "Idee", pictures (b) and (d).
    """
    doors = as_shape(doors, "doors", "n")
    if not len(doors):
        raise ValueError("doors must hold at least one position, got none")
    std, trust = as_positive_number(std, "std"), as_number(trust, "trust")
    if not 0.5 <= trust < 1:
        raise ValueError(f"trust must be at least 0.5 and below 1, got {shown(trust)}")

    def weigh(x):
        nearest = np.abs(as_finite(x, "x")[..., None] - doors).min(-1)
        says_door = (1 - trust) + (2 * trust - 1) * np.exp(-0.5 * (nearest / std) ** 2)
        return np.log(says_door if saw_door else 1 - says_door)

    return Weighting(weigh, math.log(trust))


@dataclass(frozen=True)
class Scanner:
    """A 2D laser scanner; the defaults are those the lecture gives for the Sick LMS 100.

    Parameters
    ----------
    r_max : float
        Range (m).
    field_of_view_deg, resolution_deg : float
        Scanning angle and spacing of the beams (deg).
    std_range : float
        Standard deviation of a reading (m).
    dropout : float
        Share of readings that return nothing (they read r_max).

    Source: lecture, "2D-Laser-Scanner".
    """

    r_max: float = 18.0
    field_of_view_deg: float = 270.0
    resolution_deg: float = 0.5
    std_range: float = 0.03
    dropout: float = 0.01

    @property
    def bearings(self):
        """Directions of the beams relative to the robot (rad), from right to left."""
        n = round(self.field_of_view_deg / self.resolution_deg)
        return np.radians(np.linspace(-self.field_of_view_deg / 2, self.field_of_view_deg / 2, n + 1))

    @documented
    def scan(self, grid, pose, rng, every=1):
        """One simulated scan.

        Parameters
        ----------
        grid : OccupancyGrid
            The world, or anything with `cast(poses, bearings, r_max)`. Obstacles that the robot's map lacks: hand over
            `grid.with_disks(...)` here, and the bare grid to the filter.
        pose : array-like, shape (3,)
            x, y, theta (m, m, rad).
        rng : numpy.random.Generator
        every : int
            Of the beams, every so many is used.

        Returns
        -------
        ranges, bearings : arrays, shape (B,)
            m, rad.
        """
        bearings = self.bearings[:: as_count(every, "every")]
        ranges = grid.cast(as_shape(pose, "pose", 3), bearings, self.r_max)
        hit = ranges < self.r_max
        ranges = np.where(hit, ranges + self.std_range * rng.standard_normal(ranges.shape), self.r_max)
        ranges[rng.random(ranges.shape) < self.dropout] = self.r_max
        return np.clip(ranges, 0.0, self.r_max), bearings


XTION = Scanner(r_max=3.5, field_of_view_deg=58.0, resolution_deg=58.0 / 640)  # lecture, "RGBD-Kamera": one row of it


def scan_from_depth(depth, field_of_view, near=0.8, far=3.5):
    """Ranges and bearings that a row of a depth camera holds; the defaults are those the lecture gives for the Xtion.

    A depth is measured along the optical axis, so the range of a column is depth / cos(bearing); columns are evenly
    spaced on the picture, f tan(bearing) from its middle, not in angle.

    Parameters
    ----------
    depth : array-like, shape (n,)
        Of each column, from left to right (m); 0 where the camera saw nothing.
    field_of_view : float
        Opening angle of the whole row (rad), below pi.
    near, far : float
        Depths that the camera measures (m); other columns are left out.

    Returns
    -------
    ranges, bearings : arrays, shape (m,)
        m and rad, positive to the left.

    Raises
    ------
    ValueError
        Wrong shapes, an opening angle of a half turn or more, limits that are not ordered.

    Source: lecture, "RGBD-Kamera": 640 columns, 58 deg, 0.8 to 3.5 m.
    """
    depth, field_of_view = as_shape(depth, "depth", "n"), as_positive_number(field_of_view, "field_of_view")
    near, far = as_positive_number(near, "near"), as_positive_number(far, "far")
    if field_of_view >= math.pi or near >= far:
        raise ValueError("field_of_view must be less than pi, and near less than far")
    n = len(depth)
    offset = (n / 2 - 0.5 - np.arange(n)) / (n / 2)  # of the columns' middles, 1 at the left edge
    bearings = np.arctan(offset * math.tan(field_of_view / 2))
    seen = (depth >= near) & (depth <= far)
    return (depth / np.cos(bearings))[seen], bearings[seen]


class SensorSuite:
    """The three sensor models in one building: measures in the world, weighs by the robot's map.

    Parameters
    ----------
    building : Building
        With `grid` and `landmarks`.
    scanner : Scanner
    every : int
        Of the scanner's beams, every so many is used.
    std_field, std_beam : float
        Standard deviations of likelihood field and beam model (m).
    exponents : dict
        {sensor: share of its log weights that counts}.

    See Also
    --------
    labkit.fast.sensors.SensorSuite : the same for thousands of particles
    """

    std_range, std_bearing = 0.1, 0.035  # of the landmarks' readings, m and rad
    weigh_landmarks = staticmethod(weigh_landmarks)
    weigh_beams = staticmethod(weigh_beams)
    likelihood_field = LikelihoodField
    caster = staticmethod(lambda grid: grid)  # what casts a grid's rays

    @documented
    def __init__(self, building, scanner=Scanner(), every=9, std_field=0.15, std_beam=0.2, exponents=EXPONENTS):
        self.building, self.scanner, self.every, self.std_beam = building, scanner, every, std_beam
        self.exponents = exponents
        self.field = self.likelihood_field(building.grid, std_field, r_max=scanner.r_max)

    @functools.cached_property
    def ranges(self):
        """What predicts the ranges of the beam model: has `cast(poses, bearings, r_max)`."""
        return self.caster(self.building.grid)

    @documented
    def measure(self, sensor, pose, rng, world=None):
        """A tempered `Weighting` from one measurement at the true pose; None when no landmark is in sight.

        Parameters
        ----------
        sensor : {"landmarks", "beams", "likelihood field"}
        pose : array-like, shape (3,)
        rng : numpy.random.Generator
        world : OccupancyGrid, optional
            The map as it really is, with what the robot's map lacks.
        """
        world = self.building.grid if world is None else world
        if sensor == "landmarks":
            return self.weigh_sighting(*self.look(pose, rng, world))
        return self.weigh_scan(sensor, *self.scan(pose, rng, world))

    def look(self, pose, rng, world):
        """`see_landmarks` in a world, with this suite's landmarks and noise."""
        seen_from = (self.caster(world), pose, self.building.landmarks)
        return see_landmarks(*seen_from, rng, self.std_range, self.std_bearing)

    def scan(self, pose, rng, world):
        """`Scanner.scan` in a world, with this suite's scanner and beams."""
        return self.scanner.scan(self.caster(world), pose, rng, self.every)

    @documented
    def weigh_sighting(self, index, z):
        """The tempered `Weighting` of the landmarks `index` read as z; None when there are none.

        Parameters
        ----------
        index : array of int, shape (m,)
        z : array, shape (m, 2)
        """
        if not len(index):
            return None
        index = as_indices(index, "index", below=len(self.building.landmarks))
        weighting = self.weigh_landmarks(z, self.building.landmarks[index], self.std_range, self.std_bearing)
        return weighting.tempered(self.exponents["landmarks"])

    @documented
    def weigh_scan(self, sensor, ranges, bearings):
        """The tempered `Weighting` of a scan.

        Parameters
        ----------
        sensor : {"beams", "likelihood field"}
        ranges, bearings : array-like, shape (B,)
        """
        if sensor == "beams":
            weighting = self.weigh_beams(self.ranges, ranges, bearings, self.std_beam, self.scanner.r_max)
        else:
            weighting = weigh_likelihood_field(self.field, ranges, bearings)
        return weighting.tempered(self.exponents[sensor])
