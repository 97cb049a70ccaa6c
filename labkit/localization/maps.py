"""Maps of the surroundings and a laser scanner that looks at them.

The lecture shows one room as a grid, as lines, as points and as a graph; the sensor models need the grid. `cells[i,
j]` covers the square from x = origin[0] + j * resolution and y = origin[1] + i * resolution on: row 0 lies at the
*bottom*, as in a coordinate system, and pictures and ASCII art are turned over when they are read. Lengths are
meters, angles radians, planar poses (..., 3) are x, y, theta. Source: lecture "Lokalisierung", slides on maps
("Gitterbasierte Karten" to "Punktbasierte Karten"), "2D-Laser-Scanner", "Likelihoodfield".
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import distance_transform_edt

from ..checks import as_count, as_finite, as_number, as_points, as_positive_number, as_shape, shown

FREE, OCCUPIED, UNKNOWN = 0, 1, 2
_SYMBOLS = {".": FREE, " ": FREE, "#": OCCUPIED, "?": UNKNOWN}
_GRAY = (255, 0, 127)  # white = free, black = occupied, gray = unknown, as the lecture draws it
MOST_CELLS = 1e8  # a larger map is a slip of the unit
_RAYS = 1 << 17
EVERY = 4
_CHUNK = 16384  # rays or beams worked on at once: small enough to stay in the processor's cache


@dataclass(frozen=True, eq=False)
class OccupancyGrid:
    """A map of square cells, each free, occupied or unknown.

    cells: array (H, W) of FREE, OCCUPIED, UNKNOWN; row 0 is the lowest.
    resolution: length of a cell's side (m).
    origin: x, y of the lower left corner of cells[0, 0] (m).
    """

    cells: np.ndarray
    resolution: float = 1.0
    origin: tuple = (0.0, 0.0)

    def __post_init__(self):
        cells = np.asarray(self.cells)
        if cells.ndim != 2 or 0 in cells.shape or not np.isin(cells, (FREE, OCCUPIED, UNKNOWN)).all():
            raise ValueError(
                f"cells must be a (H, W) array of 0 (free), 1 (occupied), 2 (unknown), got shape {cells.shape}"
            )
        object.__setattr__(self, "cells", cells.astype(np.uint8))
        object.__setattr__(self, "resolution", as_positive_number(self.resolution, "resolution"))
        object.__setattr__(self, "origin", tuple(as_shape(self.origin, "origin", 2).tolist()))

    @classmethod
    def from_ascii(cls, art, resolution=1.0, origin=(0.0, 0.0)):
        """Grid from a drawing: '#' occupied, '.' or blank free, '?' unknown; the first line is the top of the map."""
        if not isinstance(art, str):
            raise ValueError(f"art must be a text, got {type(art).__name__}")
        lines = [line for line in art.splitlines() if line.strip()]
        indent = min((len(line) - len(line.lstrip()) for line in lines), default=0)
        lines = [line[indent:].rstrip() for line in lines]
        if not lines:
            raise ValueError("art must hold at least one line of '#', '.' and '?', got none")
        width = max(map(len, lines))
        for number, line in enumerate(lines, 1):
            foreign = set(line) - set(_SYMBOLS)
            if foreign:
                raise ValueError(f"art may hold '#', '.', '?' and blanks, got {sorted(foreign)[0]!r} in line {number}")
        cells = [[_SYMBOLS[symbol] for symbol in line.ljust(width)] for line in lines]
        return cls(np.array(cells[::-1]), resolution, origin)

    @classmethod
    def from_png(cls, path, resolution, origin=(0.0, 0.0), occupied_below=0.35, free_above=0.8):
        """Grid from a gray picture: darker than `occupied_below` (of white) is occupied, lighter than `free_above`
        is free."""
        from PIL import Image

        with Image.open(path) as image:
            gray = np.asarray(image.convert("L"))[::-1] / 255.0
        cells = np.where(gray < occupied_below, OCCUPIED, np.where(gray > free_above, FREE, UNKNOWN))
        return cls(cells, resolution, origin)

    @classmethod
    def from_lines(cls, lines, resolution, margin=0.0):
        """Grid in which each cell that a line segment crosses is occupied and all others are free.

        lines: array (n, 4), each row x1, y1, x2, y2 (m). The grid reaches `margin` (m) beyond the outermost end points.
        """
        lines = as_points(lines, "lines", dim=4).reshape(-1, 4)
        if not len(lines):
            raise ValueError("lines must hold at least one segment, got none")
        resolution, margin = as_positive_number(resolution, "resolution"), as_number(margin, "margin")
        if margin < 0:
            raise ValueError(f"margin must not be negative, got {shown(margin)}")
        ends = lines.reshape(-1, 2)
        low = np.floor((ends.min(0) - margin) / resolution + 1e-9) * resolution
        shape = np.floor((ends.max(0) + margin - low) / resolution + 1e-9) + 1
        if shape.prod() > MOST_CELLS:
            raise ValueError(
                f"the map must have at most {MOST_CELLS:g} cells, got {shown(shape[1])} by {shown(shape[0])}"
            )
        shape = shape.astype(int)
        cells = np.zeros(shape[::-1], dtype=np.uint8)
        for line in (lines.reshape(-1, 2, 2) - low) / resolution + 1e-9:
            j, i = np.floor(_between_crossings(*line)).astype(int).T
            cells[i, j] = OCCUPIED
        return cls(cells, resolution, tuple(low))

    def to_ascii(self):
        """The drawing that `from_ascii` reads, first line on top."""
        symbols = np.array([".", "#", "?"])
        return "\n".join("".join(row) for row in symbols[self.cells[::-1]])

    def to_png(self, path):
        """Write the picture that `from_png` reads."""
        from PIL import Image

        Image.fromarray(np.array(_GRAY, dtype=np.uint8)[self.cells[::-1]]).save(path)

    @property
    def occupied(self):
        """Mask of the occupied cells, shape (H, W)."""
        return self.cells == OCCUPIED

    @property
    def free(self):
        """Mask of the free cells, shape (H, W)."""
        return self.cells == FREE

    @property
    def extent(self):
        """left, right, bottom, top of the map (m), in the order matplotlib's imshow takes."""
        (x, y), (height, width) = self.origin, self.cells.shape
        return x, x + width * self.resolution, y, y + height * self.resolution

    @cached_property
    def distance(self):
        """`distance_field(self)`, computed once."""
        return distance_field(self)

    def cell_of(self, points):
        """Row and column of the cells that hold the points (..., 2); they may lie outside the map."""
        points = as_points(points, "points", dim=2)
        j, i = np.moveaxis(np.floor((points - self.origin) / self.resolution).astype(np.intp), -1, 0)
        return i, j

    def center_of(self, i, j):
        """The midpoint (..., 2) of cells (m)."""
        return np.stack([j + 0.5, i + 0.5], axis=-1) * self.resolution + self.origin

    def at(self, points, outside=UNKNOWN):
        """FREE, OCCUPIED or UNKNOWN at points (..., 2), and `outside` beyond the map."""
        i, j = self.cell_of(points)
        height, width = self.cells.shape
        inside = (i >= 0) & (i < height) & (j >= 0) & (j < width)
        return np.where(inside, self.cells[np.where(inside, i, 0), np.where(inside, j, 0)], outside)

    def with_disks(self, disks):
        """A copy with round obstacles: disks (n, 3), each row x, y, radius (m)."""
        disks = as_points(disks, "disks").reshape(-1, 3)
        height, width = self.cells.shape
        centers = self.center_of(*np.mgrid[:height, :width])
        cells = self.cells.copy()
        for x, y, radius in disks:
            cells[np.hypot(centers[..., 0] - x, centers[..., 1] - y) <= radius] = OCCUPIED
        return OccupancyGrid(cells, self.resolution, self.origin)

    def cast(self, poses, bearings, r_max):
        """`cast_rays(self, poses, bearings, r_max)`: what a scanner in this map would measure."""
        return cast_rays(self, poses, bearings, r_max)

    @cached_property
    def _steps(self):
        """How far a ray may go from each cell without passing an obstacle, in cells, with a rim; 0 where it ends."""
        stop = np.pad(self.occupied, 1, constant_values=True)
        distance = distance_transform_edt(~stop)
        steps = np.maximum(0.999 * distance, 1.0)
        steps[stop] = 0.0
        return steps.astype(np.float32)


def _between_crossings(start, end):
    """One point within each cell of side 1 that the segment passes through, shape (n, 2)."""
    cuts = [0.0, 1.0]
    for a, b in zip(start, end):
        if a != b:
            lines = np.arange(math.floor(min(a, b)) + 1, math.ceil(max(a, b)))
            cuts.extend((lines - a) / (b - a))
    cuts = np.unique(cuts)
    middle = (cuts[:-1] + cuts[1:]) / 2 if len(cuts) > 1 else np.zeros(1)
    return start + np.concatenate([[0.0], middle, [1.0]])[:, None] * (end - start)


def distance_field(grid):
    """Distance from the middle of each cell to the middle of the nearest occupied one.

    Returns
    -------
    array, shape (H, W), in meters; 0 in the occupied cells themselves.

    Raises
    ------
    ValueError
        When no cell is occupied: there is nothing to be near to.

    Source: lecture, "Likelihoodfield (2)": the distance can be computed in advance, for all places at once.
    """
    if not grid.occupied.any():
        raise ValueError("grid must have at least one occupied cell, got none: no distance is defined")
    return distance_transform_edt(~grid.occupied) * grid.resolution


def walk_ray(grid, pose, bearing, r_max):
    """Distance to the first occupied cell along one ray, exactly: from cell to cell, in the order the ray crosses them.

    Parameters
    ----------
    grid : OccupancyGrid
    pose : array-like, shape (3,)
        x, y, theta of the sensor (m, m, rad).
    bearing : float
        Direction of the ray, relative to the pose (rad).
    r_max : float
        The range of the sensor (m); returned where nothing is hit.

    Source: lecture, "Strahlenmodell": the distance to the first obstacle by following the beam.
    """
    x, y, theta = as_shape(pose, "pose", 3)
    angle = float(theta) + as_number(bearing, "bearing")
    u = np.array([math.sin(angle), math.cos(angle)])  # rows first, as cells are indexed
    start = (np.array([y, x]) - grid.origin[::-1]) / grid.resolution
    cell = np.floor(start).astype(int)
    step = np.where(u > 0, 1, -1)
    with np.errstate(divide="ignore", over="ignore"):  # along an axis, or all but
        per_cell = np.abs(1.0 / u)
    to_edge = np.where(u > 0, cell + 1 - start, start - cell)
    crossing = np.array([edge * pace if pace < np.inf else np.inf for edge, pace in zip(to_edge, per_cell)])
    travelled, reach = 0.0, as_positive_number(r_max, "r_max") / grid.resolution
    while travelled < reach and all(0 <= c < n for c, n in zip(cell, grid.cells.shape)):
        if grid.cells[tuple(cell)] == OCCUPIED:
            return travelled * grid.resolution
        axis = int(crossing[1] < crossing[0])
        travelled = crossing[axis]
        crossing[axis] += per_cell[axis]
        cell[axis] += step[axis]
    return float(r_max)


def cast_rays(grid, poses, bearings, r_max):
    """Distances to the first occupied cell from many poses in many directions, by sphere tracing.

    The distance field says how far a ray may jump without hitting anything; near a wall the jumps shrink to one cell.
    Where a ray ends, the edge of the cell it entered gives the distance. A ray that clips the corner of a cell may pass
    it: `walk_ray` does not.

    Parameters
    ----------
    grid : OccupancyGrid
        Unknown cells do not stop a ray.
    poses : array-like, shape (..., 3)
        x, y, theta of the sensor (m, m, rad). A pose inside an obstacle sees 0, a pose beyond the map sees nothing.
    bearings : array-like, shape (B,)
        Directions relative to the pose (rad).
    r_max : float
        The range of the sensor (m); returned where nothing is hit.

    Returns
    -------
    array, shape (..., B), in meters, float32

    Source: lecture, "Strahlenmodell" (*Strahlverfolgung*).
    """
    poses, bearings = as_points(poses, "poses"), as_finite(bearings, "bearings")
    if bearings.ndim != 1:
        raise ValueError(f"bearings must have shape (B,), got {bearings.shape}")
    r_max = as_positive_number(r_max, "r_max")
    flat = poses.reshape(-1, 3)
    ranges = np.empty((len(flat), len(bearings)), dtype=np.float32)
    rows = max(1, _RAYS // max(1, len(bearings)))
    for start in range(0, len(flat), rows):
        _trace(grid, flat[start : start + rows], bearings, r_max, ranges[start : start + rows])
    return ranges.reshape(*poses.shape[:-1], len(bearings))


def _trace(grid, poses, bearings, r_max, out):
    """Sphere tracing of one chunk of poses (n, 3) into `out` (n, B); all in cells of the map with its rim."""
    steps, width = grid._steps.ravel(), grid._steps.shape[1]
    angle = (poses[:, 2:] + bearings).astype(np.float32).ravel()
    c, s = np.cos(angle), np.sin(angle)
    start = ((poses[:, :2] - grid.origin) / grid.resolution + 1.0).astype(np.float32)
    height = grid._steps.shape[0]
    inside = ((start >= 1) & (start < (width - 1, height - 1))).all(1)
    start[~inside] = 0.5  # on the rim, where a ray ends at once
    x0, y0 = np.repeat(start, len(bearings), axis=0).T.copy()
    x, y = x0.copy(), y0.copy()
    reach = np.float32(r_max / grid.resolution)
    t = np.zeros_like(x)
    live, result = np.arange(x.size), np.full(x.size, reach, dtype=np.float32)
    while live.size:
        for _ in range(EVERY):
            index = y.astype(np.int32)
            index *= width
            index += x.astype(np.int32)
            step = steps.take(index)
            t += step
            x += step * c
            y += step * s
        done = np.flatnonzero(step == 0)
        hit = live.take(done)
        result[hit] = _entry(x0[hit], y0[hit], c[done], s[done], index[done], width, height, reach)
        keep = np.flatnonzero((step > 0) & (t < reach))
        live, x, y, t, c, s = (a.take(keep) for a in (live, x, y, t, c, s))
    out[:] = result.reshape(out.shape)
    out *= grid.resolution
    np.minimum(out, r_max, out=out)


def _entry(x, y, c, s, index, width, height, reach):
    """Where a ray from (x, y) along (c, s) enters the cell in which it ended, in cells; `reach` on the rim of the
    map."""
    i, j = np.divmod(index, width)
    with np.errstate(divide="ignore", invalid="ignore"):
        tx = np.where(c != 0, (j + (c < 0) - x) / c, -np.inf)
        ty = np.where(s != 0, (i + (s < 0) - y) / s, -np.inf)
    rim = (i == 0) | (j == 0) | (i == height - 1) | (j == width - 1)
    return np.where(rim, reach, np.maximum(np.maximum(tx, ty), 0))


class RangeTable:
    """Ranges computed in advance: for each cell and each of `n_angles` directions, from the middle of the cell.

    A look-up takes the place of the tracing, some thirty times faster, at the price of memory (`nbytes`) and of
    rounding the
    direction: 3 deg at 120 angles, so 2.6 cells across at 100 cells' distance. Good enough for a filter with a wide
    sigma.
    """

    def __init__(self, grid, r_max, n_angles=120):
        self.grid, self.r_max, self.n_angles = grid, as_positive_number(r_max, "r_max"), as_count(n_angles, "n_angles")
        height, width = grid.cells.shape
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
