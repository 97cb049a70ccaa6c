"""Sensor models for thousands of particles; each equals its namesake in `localization.sensors`."""

import functools
import math

import numpy as np
from scipy.special import ndtr

from ..checks import as_points, as_positive_number, shown
from ..localization import sensors as plain
from ..localization.sensors import Weighting, as_beam_model, as_scan, as_sighting
from .maps import RangeTable, Tracer

CHUNK = 16384  # beams worked on at once: small enough to stay in the processor's cache
MANY = 4096  # states from which on single precision pays


def weigh_landmarks(z, landmarks, std_range=None, std_bearing=None):
    """As `localization.sensors.weigh_landmarks`, on contiguous coordinates.

    Thousands of states are weighed in single precision, as long as it rounds a reading by no more than about a
    ten-thousandth of its standard deviation and overflows nowhere.
    """
    z, landmarks, std_range, std_bearing = as_sighting(z, landmarks, std_range, std_bearing)
    stds = (std_range, std_bearing)
    best = -len(z) * sum(math.log(std * math.sqrt(2 * math.pi)) for std in stds if std is not None)
    coarse = (std_range is None or (z[:, 0] < 1e3 * std_range).all()) and (std_bearing is None or std_bearing > 5e-3)

    def weigh(states):
        states = as_points(states, "states")
        coordinates = states.reshape(-1, 3).T.copy()
        misfit = None
        if coarse and states.size >= 3 * MANY:
            with np.errstate(over="ignore", invalid="ignore"):
                misfit = _misfit(z, landmarks, std_range, std_bearing, coordinates, np.float32)
        if misfit is None or not np.isfinite(misfit).all():
            misfit = _misfit(z, landmarks, std_range, std_bearing, coordinates, float)
        return (best - misfit).reshape(states.shape[:-1])

    return Weighting(weigh, best)


def _misfit(z, landmarks, std_range, std_bearing, coordinates, dtype):
    """Half the sum of squared errors of all readings, each in standard deviations, worked out in `dtype`."""
    turns = coordinates[2] / math.tau
    turns -= np.rint(turns)
    d = np.empty((len(landmarks), 2, len(turns)), dtype)
    np.subtract(landmarks[:, :, None], coordinates[:2], out=d, casting="same_kind")
    misfit = np.zeros(len(turns))
    if std_bearing is not None:
        off = np.arctan2(d[:, 1], d[:, 0])
        off *= 1 / math.tau
        off -= turns.astype(dtype, copy=False)
        off -= (z[:, 1:] / math.tau).astype(dtype)
        off -= np.rint(off)
        off *= off
        scale = math.tau * math.sqrt(0.5) / std_bearing
        misfit += off.sum(0) * scale * scale
    if std_range is not None:
        d *= d
        far = np.sqrt(d[:, 0] + d[:, 1])
        far -= z[:, :1].astype(dtype)
        far *= far
        scale = math.sqrt(0.5) / std_range
        misfit += far.sum(0) * scale * scale
    return misfit


def weigh_beams(world, ranges, bearings, std, r_max, shares=(0.75, 0.1, 0.05, 0.1), decay=0.5, step=0.02):
    """As `localization.sensors.weigh_beams`, with the density computed once per scan and looked up.

    Parameters
    ----------
    step : float
        Distance of the expected ranges in the look-up table (m); harmless while far below std.

    Returns
    -------
    Weighting

    Raises
    ------
    ValueError
        A step too small for a table.

    The other parameters are those of the namesake.
    """
    ranges, bearings = as_scan(ranges, bearings)
    std, r_max, shares, decay = as_beam_model(std, r_max, shares, decay)
    step = as_positive_number(step, "step")
    if r_max / step > 1e6:
        raise ValueError(f"step must be at least a millionth of r_max, got {shown(step)} m")

    def log_density(expected):
        with np.errstate(divide="ignore"):
            return np.log(_beam_density(ranges, expected, std, r_max, shares, decay))

    nodes = np.append(np.arange(0, r_max, step), r_max).astype(np.float32)
    table = np.ascontiguousarray(log_density(nodes[:, None]).T)
    rows = np.arange(len(ranges), dtype=np.int32) * len(nodes)

    def weigh(states):
        expected = world.cast(states, bearings, r_max)
        node = (expected * np.float32(1 / step) + np.float32(0.5)).astype(np.int32)
        np.minimum(node, len(nodes) - 1, out=node)
        node += rows
        return table.ravel().take(node).sum(-1, dtype=float)

    best = log_density(ranges)
    return Weighting(weigh, float(best[np.isfinite(best)].sum()))


def _beam_density(ranges, expected, std, r_max, shares, decay):
    """`localization.sensors.beam_density` in the precision of the expected ranges, its arguments checked."""
    hit, short, none, anywhere = shares
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
    return np.where(ranges >= r_max, lost, density)


class LikelihoodField(plain.LikelihoodField):
    """As `localization.sensors.LikelihoodField`, looked up in single precision in a table with a rim."""

    def __init__(self, grid, std, share_hit=0.95, r_max=18.0, max_distance=None):
        super().__init__(grid, std, share_hit, r_max, max_distance)
        outside = float(self.log_density(self.max_distance))
        self._padded = np.pad(self.table, 1, constant_values=outside).astype(np.float32)

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
        rows = max(1, CHUNK // max(1, beams.shape[1]))
        for start in range(0, len(flat), rows):
            part = slice(start, start + rows)
            out[part] = self._look_up(rows_x[part] @ beams, rows_y[part] @ beams)
        return out.astype(float).reshape(poses.shape[:-1])

    def _beams(self, ranges, bearings):
        """Rows 1, r cos b, r sin b of the beams that hit something, in cells, float32."""
        ranges, bearings = as_scan(ranges, bearings)
        hit = ranges < self.r_max
        r, b = ranges[hit] / self.grid.resolution, bearings[hit]
        return np.stack([np.ones_like(r), r * np.cos(b), r * np.sin(b)]).astype(np.float32)

    def _look_up(self, x, y):
        """Sum of the table over end points given in cells of the padded map; both are used up."""
        height, width = self._padded.shape
        np.clip(x, 0, width - 1, out=x)
        np.clip(y, 0, height - 1, out=y)
        index = y.astype(np.int32)
        index *= width
        index += x.astype(np.int32)
        return self._padded.ravel().take(index).sum(1)


class SensorSuite(plain.SensorSuite):
    """As `localization.sensors.SensorSuite`, with this module's sensors; the beam model looks its ranges up."""

    weigh_landmarks = staticmethod(weigh_landmarks)
    weigh_beams = staticmethod(weigh_beams)
    likelihood_field = LikelihoodField
    caster = Tracer

    @functools.cached_property
    def ranges(self):
        """The `RangeTable` of the beam model, made at its first use."""
        return RangeTable(self.building.grid, self.scanner.r_max)
