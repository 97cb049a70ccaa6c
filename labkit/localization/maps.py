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
from pathlib import Path

import numpy as np
from scipy.ndimage import distance_transform_edt

from ..checks import (
    as_finite,
    as_floats,
    as_indices,
    as_number,
    as_points,
    as_positive_number,
    as_shape,
    as_whole,
    fit_together,
    shown,
)
from ..documented import documented
from ..reading import regular

FREE, OCCUPIED, UNKNOWN = 0, 1, 2
_SYMBOLS = {".": FREE, " ": FREE, "#": OCCUPIED, "?": UNKNOWN}
_GRAY = (255, 0, 127)  # white = free, black = occupied, gray = unknown, as the lecture draws it
MOST_CELLS = 1e8  # a larger map is a slip of the unit


@dataclass(frozen=True, eq=False)
class OccupancyGrid:
    """A map of square cells, each free, occupied or unknown.

    Parameters
    ----------
    cells : array-like, shape (H, W)
        FREE, OCCUPIED or UNKNOWN; row 0 is the lowest.
    resolution : float
        Length of a cell's side (m).
    origin : array-like, shape (2,)
        x, y of the lower left corner of cells[0, 0] (m).

    Raises
    ------
    ValueError
        Other cells, a resolution that is not positive.

    Source: lecture, "Gitterbasierte Karten".
    """

    cells: np.ndarray
    resolution: float = 1.0
    origin: tuple = (0.0, 0.0)

    def __post_init__(self):
        is_plain = type(self.cells) is np.ndarray and self.cells.dtype.kind in "bui"
        cells = self.cells if is_plain else as_floats(self.cells, "cells")
        if cells.ndim != 2 or 0 in cells.shape or not np.isin(cells, (FREE, OCCUPIED, UNKNOWN)).all():
            raise ValueError(
                f"cells must be a (H, W) array of 0 (free), 1 (occupied), 2 (unknown), got shape {cells.shape}"
            )
        object.__setattr__(self, "cells", cells.astype(np.uint8))
        object.__setattr__(self, "resolution", as_positive_number(self.resolution, "resolution"))
        object.__setattr__(self, "origin", tuple(as_shape(self.origin, "origin", 2).tolist()))

    @classmethod
    def from_ascii(cls, art, resolution=1.0, origin=(0.0, 0.0)):
        """Grid from a drawing.

        Parameters
        ----------
        art : str
            '#' occupied, '.' or blank free, '?' unknown; the first line is the top of the map.
        resolution, origin
            As for the grid.
        """
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
    @documented
    def from_png(cls, path, resolution, origin=(0.0, 0.0), occupied_below=0.35, free_above=0.8):
        """Grid from a gray picture.

        Parameters
        ----------
        path : str or Path
        resolution, origin
            As for the grid.
        occupied_below, free_above : float
            Shares of white: what is darker is occupied, what is lighter is free, what lies between is unknown.
        """
        from PIL import Image, UnidentifiedImageError

        try:
            with Image.open(regular(path)) as image:
                gray = np.asarray(image.convert("L"))[::-1] / 255.0
        except UnidentifiedImageError:
            raise ValueError(f"path must name a picture, and {path} is none") from None
        cells = np.where(gray < occupied_below, OCCUPIED, np.where(gray > free_above, FREE, UNKNOWN))
        return cls(cells, resolution, origin)

    @classmethod
    def from_lines(cls, lines, resolution, margin=0.0):
        """Grid in which each cell that a line segment crosses is occupied and all others are free.

        Parameters
        ----------
        lines : array-like, shape (n, 4)
            x1, y1, x2, y2 of each segment (m).
        resolution : float
            m.
        margin : float
            How far the grid reaches beyond the outermost end points (m).

        Raises
        ------
        ValueError
            No segment, or more than MOST_CELLS cells.

        Source: lecture, "Linienbasierte Karten".
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

    @documented
    def to_png(self, path):
        """Write the picture that `from_png` reads.

        Parameters
        ----------
        path : str or Path
            Its name ends in .png.
        """
        from PIL import Image

        if Path(path).suffix.lower() != ".png":
            raise ValueError(f"path must end in .png, got {str(path)!r}")

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
        cells = np.floor((points - self.origin) / self.resolution).astype(np.intp)
        return (cells[1], cells[0]) if cells.ndim == 1 else (cells[..., 1], cells[..., 0])

    def center_of(self, i, j):
        """The midpoint (..., 2) of cells (m)."""
        i, j = as_finite(i, "i"), as_finite(j, "j")
        fit_together(i=i.shape, j=j.shape)
        return np.stack(np.broadcast_arrays(j + 0.5, i + 0.5), axis=-1) * self.resolution + self.origin

    def at(self, points, outside=UNKNOWN):
        """FREE, OCCUPIED or UNKNOWN at points (..., 2), and `outside` beyond the map."""
        i, j = self.cell_of(points)
        plain = outside is UNKNOWN  # and needs no check
        outside = np.array(outside) if plain else as_indices(as_whole(outside, "outside"), "outside")
        height, width = self.cells.shape
        if i.ndim == 0:  # one point, as in a walk along a ray, in less than half of the time
            return np.array(int(self.cells[i, j] if 0 <= i < height and 0 <= j < width else outside))
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


@documented
def distance_field(grid):
    """Distance from the middle of each cell to the middle of the nearest occupied one.

    Parameters
    ----------
    grid : OccupancyGrid

    Returns
    -------
    array, shape (H, W)
        m; 0 in the occupied cells themselves.

    Raises
    ------
    ValueError
        When no cell is occupied: there is nothing to be near to.

    Source: lecture, "Likelihoodfield (2)": the distance can be computed in advance, for all places at once.
    """
    if not grid.occupied.any():
        raise ValueError("grid must have at least one occupied cell, got none: no distance is defined")
    return distance_transform_edt(~grid.occupied) * grid.resolution


def nearest_on_lines(lines, point):
    """The place on the walls of a line map that is nearest to a point: the foot of a wall's perpendicular, or an end.

    Parameters
    ----------
    lines : array-like, shape (n, 4)
        Walls, x1, y1, x2, y2 (m).
    point : array-like, shape (2,), m

    Returns
    -------
    place : array, shape (2,), m

    Raises
    ------
    ValueError
        No wall at all, or other shapes.
    """
    lines, point = as_shape(lines, "lines", "n", 4), as_shape(point, "point", 2)
    if not len(lines):
        raise ValueError("lines must hold at least one wall")
    start, along = lines[:, :2], lines[:, 2:] - lines[:, :2]
    share = np.clip(((point - start) * along).sum(1) / np.maximum((along**2).sum(1), 1e-12), 0, 1)
    feet = start + share[:, None] * along
    return feet[np.argmin(np.hypot(*(feet - point).T))]


@documented
def walk_ray(grid, pose, bearing, r_max):
    """Distance to the first occupied cell along one ray, exactly: from cell to cell, in the order the ray crosses them.

    Parameters
    ----------
    grid : OccupancyGrid
        Unknown cells do not stop a ray.
    pose : array-like, shape (3,)
        x, y, theta of the sensor (m, m, rad). A pose inside an obstacle sees 0, a pose beyond the map sees nothing.
    bearing : float
        Direction of the ray, relative to the pose (rad).
    r_max : float
        The range of the sensor (m).

    Returns
    -------
    float
        m; r_max where nothing is hit.

    Source: lecture, "Strahlenmodell" (*Strahlverfolgung*): the distance to the first obstacle by following the beam.
    """
    x, y, theta = as_shape(pose, "pose", 3).tolist()
    angle = theta + as_number(bearing, "bearing")
    r_max = as_positive_number(r_max, "r_max")
    height, width = grid.cells.shape
    row = _Axis((y - grid.origin[1]) / grid.resolution, math.sin(angle))
    column = _Axis((x - grid.origin[0]) / grid.resolution, math.cos(angle))
    travelled = 0.0
    while travelled < r_max / grid.resolution and 0 <= row.cell < height and 0 <= column.cell < width:
        if grid.cells[row.cell, column.cell] == OCCUPIED:
            return travelled * grid.resolution
        nearer = column if column.crossing < row.crossing else row
        travelled = nearer.go_on()
    return r_max


class _Axis:
    """One coordinate of a ray, in cells: the cell it is in, and the way along the ray to where it leaves that cell."""

    def __init__(self, start, slope):
        self.cell = math.floor(start)
        self.step = 1 if slope > 0 else -1
        self.per_cell = abs(1.0 / slope) if abs(slope) > 1e-300 else math.inf
        to_edge = self.cell + 1 - start if slope > 0 else start - self.cell
        self.crossing = to_edge * self.per_cell if self.per_cell < math.inf else math.inf

    def go_on(self):
        """Enter the next cell; the way to its edge."""
        travelled = self.crossing
        self.cell += self.step
        self.crossing += self.per_cell
        return travelled


@documented
def cast_rays(grid, poses, bearings, r_max):
    """`walk_ray` from many poses in many directions.

    Parameters
    ----------
    grid : OccupancyGrid
    poses : array-like, shape (..., 3)
        x, y, theta of the sensor (m, m, rad).
    bearings : array-like, shape (B,)
        Directions relative to the pose (rad).
    r_max : float
        The range of the sensor (m).

    Returns
    -------
    array, shape (..., B)
        m; r_max where nothing is hit.

    Raises
    ------
    ValueError
        Wrong shapes, numbers that are not finite, a range that is not positive.

    See Also
    --------
    labkit.fast.maps.cast_rays : the same for thousands of poses

    Source: lecture, "Strahlenmodell" (*Strahlverfolgung*).
    """
    poses, bearings, r_max = as_rays(poses, bearings, r_max)
    ranges = [walk_ray(grid, pose, bearing, r_max) for pose in poses.reshape(-1, 3) for bearing in bearings]
    return np.array(ranges).reshape(*poses.shape[:-1], len(bearings))


def as_rays(poses, bearings, r_max):
    """The arguments of `cast_rays`, checked."""
    poses, bearings = as_points(poses, "poses"), as_finite(bearings, "bearings")
    if bearings.ndim != 1:
        raise ValueError(f"bearings must have shape (B,), got {bearings.shape}")
    return poses, bearings, as_positive_number(r_max, "r_max")
