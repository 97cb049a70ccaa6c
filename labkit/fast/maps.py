"""Rays through a map for thousands of poses; equals `localization.maps.cast_rays` but where a ray clips a corner."""

import functools

import numpy as np
from scipy.ndimage import distance_transform_edt

from ..checks import as_instance, as_points, as_positive_number, as_shape, as_size
from ..localization.maps import OccupancyGrid, as_rays

RAYS = 1 << 17  # rays worked on at once
STRIDE = 4  # jumps between two looks at which rays have ended


def cast_rays(grid, poses, bearings, r_max):
    """As `localization.maps.cast_rays`, by sphere tracing, in single precision.

    The distance field says how far a ray may jump without hitting anything; near a wall the jumps shrink to one cell.
    Where a ray ends, the edge of the cell it entered gives the distance. A ray that clips the corner of a cell may pass
    it: `walk_ray` does not.
    """
    as_instance(grid, "grid", OccupancyGrid)
    poses, bearings, r_max = as_rays(poses, bearings, r_max)
    flat = poses.reshape(-1, 3)
    ranges = np.empty((len(flat), len(bearings)), dtype=np.float32)
    rows = max(1, RAYS // max(1, len(bearings)))
    for start in range(0, len(flat), rows):
        _trace(grid, flat[start : start + rows], bearings, r_max, ranges[start : start + rows])
    return ranges.reshape(*poses.shape[:-1], len(bearings))


@functools.lru_cache(maxsize=8)
def _jumps(grid):
    """How far a ray may go from each cell without passing an obstacle, in cells, with a rim; 0 where it ends."""
    stop = np.pad(grid.occupied, 1, constant_values=True)
    distance = distance_transform_edt(~stop)
    jumps = np.maximum(0.999 * distance, 1.0)
    jumps[stop] = 0.0
    return jumps.astype(np.float32)


def _trace(grid, poses, bearings, r_max, out):
    """Sphere tracing of one chunk of poses (n, 3) into `out` (n, B); all in cells of the map with its rim."""
    height, width = _jumps(grid).shape
    jumps = _jumps(grid).ravel()
    c, s, x0, y0 = _rays(grid, poses, bearings, height, width)
    x, y, t = x0.copy(), y0.copy(), np.zeros_like(x0)
    reach = np.float32(r_max / grid.resolution)
    live, result = np.arange(x.size), np.full(x.size, reach, dtype=np.float32)
    while live.size:
        for _ in range(STRIDE):
            index = y.astype(np.int32)
            index *= width
            index += x.astype(np.int32)
            jump = jumps.take(index)
            t += jump
            x += jump * c
            y += jump * s
        done = np.flatnonzero(jump == 0)
        hit = live.take(done)
        result[hit] = _entry(x0[hit], y0[hit], c[done], s[done], index[done], width, height, reach)
        keep = np.flatnonzero((jump > 0) & (t < reach))
        live, x, y, t, c, s = (a.take(keep) for a in (live, x, y, t, c, s))
    out[:] = result.reshape(out.shape)
    out *= grid.resolution
    np.minimum(out, r_max, out=out)


def _rays(grid, poses, bearings, height, width):
    """Directions (c, s) and starts (x, y) of all rays, (n B,) each, in cells; what starts outside ends on the rim."""
    angle = (poses[:, 2:] + bearings).astype(np.float32).ravel()
    start = ((poses[:, :2] - grid.origin) / grid.resolution + 1.0).astype(np.float32)
    inside = ((start >= 1) & (start < (width - 1, height - 1))).all(1)
    start[~inside] = 0.5
    return np.cos(angle), np.sin(angle), *np.repeat(start, len(bearings), axis=0).T.copy()


def _entry(x, y, c, s, index, width, height, reach):
    """Where a ray from (x, y) along (c, s) enters the cell in which it ended, in cells; `reach` on the map's rim."""
    i, j = np.divmod(index, width)
    with np.errstate(divide="ignore", invalid="ignore"):
        tx = np.where(c != 0, (j + (c < 0) - x) / c, -np.inf)
        ty = np.where(s != 0, (i + (s < 0) - y) / s, -np.inf)
    rim = (i == 0) | (j == 0) | (i == height - 1) | (j == width - 1)
    return np.where(rim, reach, np.maximum(np.maximum(tx, ty), 0))


class Tracer:
    """A grid that casts its rays by `cast_rays` of this module."""

    def __init__(self, grid):
        self.grid = as_instance(grid, "grid", OccupancyGrid)

    def cast(self, poses, bearings, r_max):
        """`cast_rays(grid, poses, bearings, r_max)`."""
        return cast_rays(self.grid, poses, bearings, r_max)


class RangeTable:
    """Ranges computed in advance: for each cell and each of `n_angles` directions, from the middle of the cell.

    A look-up takes the place of the tracing, some thirty times faster, at the price of memory (`nbytes`) and of
    rounding the direction: 3 deg at 120 angles, so 2.6 cells across at 100 cells' distance. Good enough for a filter
    with a wide standard deviation.

    Parameters
    ----------
    grid : OccupancyGrid
    r_max : float
        Range of the scanner (m).
    n_angles : int
    """

    def __init__(self, grid, r_max, n_angles=120):
        self.grid, self.r_max, self.n_angles = grid, as_positive_number(r_max, "r_max"), as_size(n_angles, "n_angles")
        height, width = as_instance(grid, "grid", OccupancyGrid).cells.shape
        table = np.zeros((height, width, self.n_angles), dtype=np.float32)
        i, j = np.nonzero(~grid.occupied)
        poses = np.column_stack([grid.center_of(i, j), np.zeros(len(i))])
        table[i, j] = cast_rays(grid, poses, np.arange(self.n_angles) * (2 * np.pi / self.n_angles), self.r_max)
        self.table = table

    @property
    def nbytes(self):
        """Size of the table in bytes."""
        return self.table.nbytes

    def cast(self, poses, bearings, r_max=None):
        """As `cast_rays`, looked up; `r_max` may shorten the range the table was made for."""
        poses, bearings = as_points(poses, "poses"), as_shape(bearings, "bearings", "B")
        flat = poses.reshape(-1, 3)
        i, j = self.grid.cell_of(flat[:, :2])
        height, width = self.grid.cells.shape
        inside = (i >= 0) & (i < height) & (j >= 0) & (j < width)
        cell = np.where(inside, i * width + j, 0) * self.n_angles
        turn = self.n_angles / (2 * np.pi)
        theta, beam = (np.remainder(angle * turn, self.n_angles).astype(np.float32) for angle in (flat[:, 2], bearings))
        k = (theta[:, None] + (beam + np.float32(0.5))).astype(np.int32)  # 0 to 2 n_angles: two turns too far at most
        for _ in range(2):
            np.subtract(k, self.n_angles, out=k, where=k >= self.n_angles)
        ranges = self.table.ravel().take(k + cell[:, None])
        ranges[~inside] = self.r_max
        if r_max is not None:
            np.minimum(ranges, as_positive_number(r_max, "r_max"), out=ranges)
        return ranges.reshape(*poses.shape[:-1], len(bearings))
