"""Sensor models: what one measurement says about many poses.

A sensor model takes one measurement and returns a `Weighting`, a function of the states that gives the *logarithm* of
each weight: a product of many small densities is a sum that cannot underflow.
Source: lecture "Lokalisierung", "Monte-Carlo-Lokalisierung", "2D-Laser-Scanner", "Likelihoodfield".
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import ndtr

from ..checks import (
    as_count,
    as_finite,
    as_nonnegative,
    as_number,
    as_points,
    as_positive_number,
    as_shape,
    fit_together,
    shown,
)
from ..geometry.planar import wrap_angle
from .maps import _CHUNK, RangeTable, cast_rays


class LikelihoodField:
    """How well a measured obstacle point fits the map, as a table: log p of its distance to the nearest obstacle.

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

    Source: lecture, "Likelihoodfield (1)" and "(2)".
    """

    def __init__(self, grid, std, share_hit=0.95, r_max=18.0, max_distance=None):
        self.grid, self.std = grid, as_positive_number(std, "std")
        self.r_max = as_positive_number(r_max, "r_max")
        share_hit = as_number(share_hit, "share_hit")
        if not 0 < share_hit <= 1:
            raise ValueError(f"share_hit must be above 0 and at most 1, got {shown(share_hit)}")
        self.share_hit = share_hit
        self.max_distance = 6 * self.std if max_distance is None else as_positive_number(max_distance, "max_distance")
        distance = np.minimum(np.pad(grid.distance, 1, constant_values=np.inf), self.max_distance)
        self.table = self.log_density(distance).astype(np.float32)

    def log_density(self, distance):
        """log p at distances (m) from the nearest obstacle; any shape."""
        quadratic = -0.5 * np.square(as_finite(distance, "distance") / self.std)
        gauss = math.log(self.share_hit / (self.std * math.sqrt(2 * math.pi))) + quadratic
        if self.share_hit == 1:
            return gauss
        return np.logaddexp(gauss, math.log((1 - self.share_hit) / self.r_max))

    def log_weights(self, poses, ranges, bearings):
        """Sum of log p over the beams of one scan, for each pose: (..., 3), (B,), (B,) -> (...).

        The end point of a beam is [1, r cos b, r sin b] times [x, cos, -sin] and [y, cos, sin]: two matrix products
        for all particles and beams, without a sine or cosine per beam, then one look-up each.
        """
        poses = as_points(poses, "poses")
        beams = self._beams(ranges, bearings)
        flat = poses.reshape(-1, 3)
        theta = flat[:, 2].astype(np.float32)
        one_x, one_y = ((flat[:, k] - self.grid.origin[k]) / self.grid.resolution + 1.0 for k in (0, 1))
        c, s = np.cos(theta), np.sin(theta)
        rows_x = np.column_stack([one_x, c, -s]).astype(np.float32)
        rows_y = np.column_stack([one_y, s, c]).astype(np.float32)
        out = np.empty(len(flat), dtype=np.float32)
        rows = max(1, _CHUNK // max(1, beams.shape[1]))
        for start in range(0, len(flat), rows):
            part = slice(start, start + rows)
            out[part] = self._look_up(rows_x[part] @ beams, rows_y[part] @ beams)
        return out.astype(float).reshape(poses.shape[:-1])

    def _beams(self, ranges, bearings):
        """Rows 1, r cos b, r sin b of the beams that hit something, in cells, float32."""
        ranges, bearings = as_finite(ranges, "ranges"), as_finite(bearings, "bearings")
        if ranges.ndim != 1 or ranges.shape != bearings.shape:
            raise ValueError(
                f"ranges and bearings must have the same shape (B,), got {ranges.shape} and {bearings.shape}"
            )
        hit = ranges < self.r_max
        r, b = ranges[hit] / self.grid.resolution, bearings[hit]
        return np.stack([np.ones_like(r), r * np.cos(b), r * np.sin(b)]).astype(np.float32)

    def _look_up(self, x, y):
        """Sum of the table over end points given in cells of the padded map; both are used up."""
        height, width = self.table.shape
        np.clip(x, 0, width - 1, out=x)
        np.clip(y, 0, height - 1, out=y)
        index = y.astype(np.int32)
        index *= width
        index += x.astype(np.int32)
        return self.table.ravel().take(index).sum(1)


@dataclass(frozen=True)
class Scanner:
    """A 2D laser scanner; the defaults are those the lecture gives for the Sick LMS 100.

    r_max: range (m). field_of_view_deg, resolution_deg: scanning angle and spacing of the beams.
    std_range: noise of a reading (m). dropout: share of readings that return nothing (they read r_max).
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

    def scan(self, grid, pose, rng, every=1):
        """One simulated scan from a pose: (ranges, bearings), of every `every`-th beam.

        Obstacles that the robot's map lacks: hand over `grid.with_disks(...)` here, and the bare grid to the filter.
        """
        bearings = self.bearings[:: as_count(every, "every")]
        ranges = cast_rays(grid, as_shape(pose, "pose", 3), bearings, self.r_max).astype(float)
        hit = ranges < self.r_max
        ranges = np.where(hit, ranges + self.std_range * rng.standard_normal(ranges.shape), self.r_max)
        ranges[rng.random(ranges.shape) < self.dropout] = self.r_max
        return np.clip(ranges, 0.0, self.r_max), bearings


SENSORS = ("landmarks", "beams", "likelihood field")


# --- sensor models ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Weighting:
    """One measurement as a function of the states: (M, 3) -> log weights (M,).

    best: log weight of a state that fits perfectly; the yardstick by which recovery judges how bad the cloud has
    become.
    """

    function: object
    best: float = 0.0

    def __call__(self, states):
        return self.function(states)


def weigh_landmarks(z, landmarks, std_range=None, std_bearing=None):
    """Weighting by ranges and bearings to known landmarks.

    Parameters
    ----------
    z : array-like, shape (m, 2)
        Measured range (m) and bearing (rad) of each landmark that is seen.
    landmarks : array-like, shape (m, 2)
        The positions of the landmarks seen, in the same order.
    std_range, std_bearing : float, optional
        Standard deviations (m, rad). Leave one out to use the other reading alone.

    Source: lecture, "Landmarkbasiertes Verfahren (2)".
    """
    z, landmarks = as_points(z, "z", dim=2), as_points(landmarks, "landmarks", dim=2)
    if z.ndim != 2 or z.shape != landmarks.shape:
        raise ValueError(f"z and landmarks must have the same shape (m, 2), got {z.shape} and {landmarks.shape}")
    if std_range is None and std_bearing is None:
        raise ValueError("std_range or std_bearing must be given, got neither: nothing would be weighed")
    stds = [None if std is None else as_positive_number(std, name)
            for std, name in ((std_range, "std_range"), (std_bearing, "std_bearing"))]  # fmt: skip
    best = -len(z) * sum(math.log(std * math.sqrt(2 * math.pi)) for std in stds if std is not None)

    def weigh(states):
        states = as_points(states, "states")
        x, y, theta = (states[..., k].copy() for k in range(3))
        c, s = np.cos(theta), np.sin(theta)
        misfit = np.zeros(x.shape)
        for (r, phi), (mark_x, mark_y) in zip(z, landmarks):
            dx, dy = mark_x - x, mark_y - y
            if stds[0] is not None:
                misfit += np.square((r - np.sqrt(dx * dx + dy * dy)) * (1 / stds[0]))
            if stds[1] is not None:  # turned into the measured direction, the difference needs no wrapping
                ahead, left = c * dx + s * dy, c * dy - s * dx
                cos, sin = math.cos(phi), math.sin(phi)
                misfit += np.square(np.arctan2(cos * left - sin * ahead, cos * ahead + sin * left) * (1 / stds[1]))
        return best - 0.5 * misfit

    return Weighting(weigh, best)


def weigh_beams(world, ranges, bearings, std, r_max, shares=(0.75, 0.1, 0.05, 0.1), decay=0.5, step=None):
    """Weighting by the beam model: each range is compared with the one that ray casting expects.

    Parameters
    ----------
    world : OccupancyGrid or RangeTable
        Anything with `cast(poses, bearings, r_max)`.
    ranges, bearings : array-like, shape (B,)
        One scan (m, rad).
    std : float
        Standard deviation of a range (m).
    r_max : float
        Range of the scanner (m).
    shares : four numbers that add up to 1
        hit: Gauss about the expected range, normalized on [0, r_max]; short: something unmapped stood in the way;
        max: nothing came back; random. The lecture's model is (1, 0, 0, 0): one such surprise makes the whole product
        zero or nearly so.
    decay : float
        Rate of the short readings (1/m).
    step : float, optional
        Compute the density once a scan at expected ranges every `step` m and look it up: faster for thousands of
        particles, and harmless while step is far below std.

    Source: lecture, "Strahlenmodell"; the mixture is the usual extension.
    """
    ranges, bearings = as_finite(ranges, "ranges"), as_finite(bearings, "bearings")
    if ranges.ndim != 1 or ranges.shape != bearings.shape:
        raise ValueError(f"ranges and bearings must have the same shape (B,), got {ranges.shape} and {bearings.shape}")
    shares = _shares(shares)
    std, r_max, decay = (as_positive_number(v, n) for v, n in ((std, "std"), (r_max, "r_max"), (decay, "decay")))

    def log_density(expected):
        with np.errstate(divide="ignore"):  # log 0 = -inf is the honest weight of an impossible pose
            return np.log(_beam_density(ranges, expected, std, r_max, shares, decay))

    if step is not None:
        step = as_positive_number(step, "step")
        if r_max / step > 1e6:
            raise ValueError(f"step must be at least a millionth of r_max, got {shown(step)} m")
        nodes = np.append(np.arange(0, r_max, step), r_max).astype(np.float32)
        table = np.ascontiguousarray(log_density(nodes[:, None]).T)
        rows = np.arange(len(ranges), dtype=np.int32) * len(nodes)

    def weigh(states):
        expected = world.cast(states, bearings, r_max)
        if step is None:
            return log_density(expected).sum(-1)
        node = (expected * np.float32(1 / step) + np.float32(0.5)).astype(np.int32)
        np.minimum(node, len(nodes) - 1, out=node)
        node += rows
        return table.ravel().take(node).sum(-1, dtype=float)

    best = log_density(ranges)
    return Weighting(weigh, float(best[np.isfinite(best)].sum()))


def beam_density(ranges, expected, std, r_max, shares, decay=0.5):
    """p(range | expected range) of the beam model, in 1/m (a share where the reading is r_max); shapes broadcast.

    Each part integrates to its share over [0, r_max], so the whole is a density for every expected range.
    """
    std, r_max, decay = (as_positive_number(v, n) for v, n in ((std, "std"), (r_max, "r_max"), (decay, "decay")))
    ranges, expected = as_finite(ranges, "ranges"), as_finite(expected, "expected")
    fit_together(ranges=ranges.shape, expected=expected.shape)
    return _beam_density(ranges, expected, std, r_max, _shares(shares), decay)


def _shares(shares):
    shares = as_finite(shares, "shares")
    if shares.shape != (4,) or (shares < 0).any() or abs(shares.sum() - 1) > 1e-9:
        raise ValueError(f"shares must be four numbers from 0 to 1 that add up to 1, got {shown(shares)}")
    return shares


def _beam_density(ranges, expected, std, r_max, shares, decay):
    """`beam_density` in the precision of the expected ranges, which ray casting gives as float32."""
    hit, short, none, anywhere = (float(share) for share in shares)
    shape = np.broadcast_shapes(np.shape(ranges), np.shape(expected))
    expected = np.atleast_1d(expected)
    expected = expected if expected.dtype == np.float32 else expected.astype(float)
    ranges = np.asarray(ranges, dtype=expected.dtype)
    density = (ranges - expected) / std
    density *= density
    density *= -0.5
    np.exp(density, out=density)
    density *= hit / (std * math.sqrt(2 * math.pi))
    near_end = (expected < 5 * std) | (expected > r_max - 5 * std)  # elsewhere the whole bell is in range
    z = expected[near_end].astype(float)
    inside = np.ones(expected.shape, dtype=expected.dtype)
    inside[near_end] = np.maximum(ndtr((r_max - z) / std) - ndtr(-z / std), 1e-12)
    density /= inside
    density += anywhere / r_max
    if short > 0:
        norm = np.maximum(-np.expm1(-decay * expected), 1e-12)
        density += (ranges < expected) * (short * decay * np.exp(-decay * ranges)) / norm
    lost = none + anywhere / r_max + (expected >= r_max) * hit
    return np.where(ranges >= r_max, lost, density).reshape(shape)


def weigh_likelihood_field(field, ranges, bearings):
    """Weighting by a `LikelihoodField`: how near do the measured obstacle points lie to mapped ones?

    ranges, bearings: one scan, shapes (B,), in m and rad; readings at the field's r_max are left out.
    Source: lecture, "Likelihoodfield (1)" and "(2)".
    """
    hits = int((as_finite(ranges, "ranges") < field.r_max).sum())
    return Weighting(lambda states: field.log_weights(states, ranges, bearings), hits * float(field.log_density(0.0)))


def weigh_doors(doors, saw_door, std=0.3, trust=0.9):
    """Weighting of positions x along a corridor, shape (M,), by a sensor that says "door" or "no door".

    doors: positions (m). std: half width of a door as a Gauss (m). trust: share of right answers in front of a door.
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


def see_landmarks(grid, pose, landmarks, rng, std_range=0.1, std_bearing=0.035, r_max=8.0):
    """Indices and noisy (range, bearing) of the landmarks in sight: nearer than r_max and not behind a wall.

    Landmarks may sit on a wall: the last 0.1 m before one does not count as an obstacle. grid None: nothing hides
    anything.
    """
    pose, landmarks = as_shape(pose, "pose", 3), as_shape(landmarks, "landmarks", "m", 2)
    named = ((std_range, "std_range"), (std_bearing, "std_bearing"), (r_max, "r_max"))
    std_range, std_bearing, r_max = (float(as_nonnegative(as_number(value, name), name)) for value, name in named)
    d = landmarks - pose[:2]
    r, phi = np.hypot(*d.T), wrap_angle(np.arctan2(d[:, 1], d[:, 0]) - pose[2])
    seen = r < r_max
    if grid is not None:
        seen &= cast_rays(grid, pose, phi, r_max + 1.0) > r - 0.1
    index = np.flatnonzero(seen)
    noise = rng.standard_normal((len(index), 2)) * [std_range, std_bearing]
    return index, np.column_stack([r[index], phi[index]]) + noise


class SensorSuite:
    """The three sensor models in one building: measures in the world, hands out weightings made from the robot's map.

    building: a `maps.Building`. scanner: its scans; every `every`-th beam is used. The beam model looks its ranges up
    in a `RangeTable`, made at the first use.
    """

    def __init__(self, building, scanner=Scanner(), every=9, std_field=0.15, std_beam=0.2):
        self.building, self.scanner, self.every, self.std_beam = building, scanner, every, std_beam
        self.field = LikelihoodField(building.grid, std_field, r_max=scanner.r_max)

    @cached_property
    def table(self):
        """Ranges for the beam model, computed in advance."""
        return RangeTable(self.building.grid, self.scanner.r_max)

    def measure(self, model, pose, rng, world=None):
        """A `Weighting` from one measurement at the true pose; None when no landmark is in sight.

        model: one of `SENSORS`. world: the map as it really is, with what the robot's map lacks.
        """
        world = world or self.building.grid
        if model == "landmarks":
            index, z = see_landmarks(world, pose, self.building.landmarks, rng)
            return weigh_landmarks(z, self.building.landmarks[index], 0.1, 0.035) if len(index) else None
        return self.weigh_scan(model, *self.scanner.scan(world, pose, rng, self.every))

    def weigh_scan(self, model, ranges, bearings):
        """The `Weighting` of a scan by "beams" or "likelihood field"."""
        if model == "beams":
            return weigh_beams(self.table, ranges, bearings, self.std_beam, self.scanner.r_max, step=0.02)
        if model == "likelihood field":
            return weigh_likelihood_field(self.field, ranges, bearings)
        raise ValueError(f"model must be one of {', '.join(SENSORS)}, got {model!r}")
