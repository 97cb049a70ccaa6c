"""Writes the building's tables and picture: `python data/monte_carlo/make_building.py` from the root of the
checkout."""

import csv
import sys
from pathlib import Path

import numpy as np
from scipy.ndimage import label

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent.parent))

from labkit.fast.maps import cast_rays
from labkit.localization.maps import FREE, UNKNOWN, OccupancyGrid
from labkit.localization.sensors import Scanner

RESOLUTION, SEED = 0.1, 9
OUTER = [(0, 0), (16, 0), (16, 8), (13.5, 10), (0, 10), (0, 0)]
WALLS = [  # x1, y1, x2, y2 (m)
    *[(*a, *b) for a, b in zip(OUTER, OUTER[1:])],
    (0, 6, 2, 6), (3, 6, 6, 6), (7, 6, 12.5, 6), (13.5, 6, 16, 6),  # north side of the corridor, three doors
    (0, 4.2, 1, 4.2), (2, 4.2, 8.5, 4.2), (9.5, 4.2, 11.8, 4.2), (12.8, 4.2, 16, 4.2),  # south side, three doors
    (5, 6, 5, 10), (9.5, 6, 9.5, 10), (3.5, 0, 3.5, 4.2), (11, 0, 11, 2.2), (11, 3.2, 11, 4.2),  # between rooms
    (0, 8.2, 1.6, 8.2), (7.6, 8.4, 8.4, 8.4), (8.4, 8.4, 8.4, 9.2), (8.4, 9.2, 7.6, 9.2), (7.6, 9.2, 7.6, 8.4),
    (5.6, 1.2, 6.4, 1.6), (6.4, 1.6, 6.0, 2.4), (6.0, 2.4, 5.2, 2.0), (5.2, 2.0, 5.6, 1.2),  # a turned box
    (3.7, 6, 3.7, 5.6), (3.7, 5.6, 4.9, 5.6), (4.9, 5.6, 4.9, 6),  # a cupboard in the corridor
    (14.6, 6, 14.6, 5.5), (14.6, 5.5, 16, 5.5), (0, 4.9, 0.7, 4.2),
    (14.4, 0, 16, 1.6), (11.2, 8.6, 11.2, 10), (1.4, 1.2, 2.2, 1.2),
]  # fmt: skip
NODES = {
    "office A": (3.2, 8.0), "office B": (6.4, 7.4), "office C": (12.8, 7.4), "store": (1.0, 2.6), "hall": (8.4, 2.4),
    "lab": (13.2, 2.4), "door A": (2.5, 6.0), "door B": (6.5, 6.0), "door C": (13.0, 6.0), "door store": (1.5, 4.2),
    "door hall": (9.0, 4.2), "door lab": (12.3, 4.2), "door hall-lab": (11.0, 2.7), "corridor west": (2.0, 5.1),
    "corridor middle": (6.5, 5.1), "corridor hall": (9.0, 5.1), "corridor east": (12.6, 5.1),
}  # fmt: skip
EDGES = [
    ("office A", "door A"), ("door A", "corridor west"), ("office B", "door B"), ("door B", "corridor middle"),
    ("office C", "door C"), ("door C", "corridor east"), ("store", "door store"), ("door store", "corridor west"),
    ("hall", "door hall"), ("door hall", "corridor hall"), ("lab", "door lab"), ("door lab", "corridor east"),
    ("hall", "door hall-lab"), ("door hall-lab", "lab"), ("corridor west", "corridor middle"),
    ("corridor middle", "corridor hall"), ("corridor hall", "corridor east"),
]  # fmt: skip
LANDMARKS = [
    (0.3, 9.7), (4.7, 9.7), (4.7, 6.3), (5.3, 9.7), (9.2, 6.3), (5.3, 6.3), (9.8, 6.3), (15.7, 7.6), (12.4, 9.7),
    (0.3, 5.7), (7.5, 4.5), (15.7, 4.6), (0.3, 0.3), (3.2, 3.9), (3.8, 0.3), (10.7, 0.3), (3.8, 3.9), (15.7, 3.8),
    (11.3, 0.3),
]  # fmt: skip


def building_grid():
    """The lines as a grid; cells that no free cell inside the building reaches become unknown."""
    grid = OccupancyGrid.from_lines(WALLS, RESOLUTION)
    regions, _ = label(grid.cells == FREE)
    inside = regions == regions[grid.cell_of(NODES["hall"])]
    return OccupancyGrid(np.where((grid.cells == FREE) & ~inside, UNKNOWN, grid.cells), grid.resolution, grid.origin)


def scan_map(grid, rng):
    """Obstacle points from simulated scans at the rooms' nodes, one a cell of 0.2 m."""
    scanner = Scanner(field_of_view_deg=360.0, resolution_deg=0.5)
    found = []
    for name, (x, y) in NODES.items():
        if name.startswith("door"):
            continue
        bearings = scanner.bearings
        ranges = cast_rays(grid, (x, y, 0.0), bearings, scanner.r_max) + 0.02 * rng.standard_normal(len(bearings))
        found.append(np.column_stack([x + ranges * np.cos(bearings), y + ranges * np.sin(bearings)]))
    points = np.concatenate(found)
    _, first = np.unique(np.floor(points / 0.2).astype(int), axis=0, return_index=True)
    return np.round(points[np.sort(first)], 2)


def write(folder=HERE):
    """All files of the building into `folder`."""
    grid = building_grid()
    grid.to_png(folder / "building.png")
    tables = {
        "lines": (("x1", "y1", "x2", "y2"), WALLS),
        "points": (("x", "y"), scan_map(grid, np.random.default_rng(SEED)).tolist()),
        "nodes": (("name", "x", "y"), [(name, *xy) for name, xy in NODES.items()]),
        "edges": (("a", "b"), EDGES),
        "landmarks": (("x", "y"), LANDMARKS),
    }
    for name, (header, rows) in tables.items():
        with open(folder / f"building_{name}.csv", "w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows([header, *rows])


if __name__ == "__main__":
    write()
