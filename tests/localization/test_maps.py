"""Maps against values computed by hand on tiny drawings, and against an exact walk through the cells."""

import importlib.util
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from labkit.documents.lecture.examples import load_building
from labkit.localization import maps
from labkit.localization.maps import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from labkit.tables import DATA

ROOM = """
    ########
    #......#
    #..#...#
    #......#
    ########
"""  # 8 by 5 cells of 1 m; the pillar covers x 3..4, y 2..3


@pytest.fixture(scope="module")
def room():
    return OccupancyGrid.from_ascii(ROOM)


@pytest.fixture(scope="module")
def building():
    return load_building()


def test_first_line_of_a_drawing_is_the_top():
    grid = OccupancyGrid.from_ascii("#..\n..?", resolution=0.5, origin=(1.0, 2.0))
    assert grid.cells.tolist() == [[FREE, FREE, UNKNOWN], [OCCUPIED, FREE, FREE]]
    assert grid.at([1.1, 2.6]) == OCCUPIED and grid.at([2.4, 2.1]) == UNKNOWN
    assert grid.extent == (1.0, 2.5, 2.0, 3.0)
    assert grid.at([0.9, 2.1], outside=7) == 7
    np.testing.assert_allclose(grid.center_of(*grid.cell_of([2.1, 2.9])), [2.25, 2.75])


def test_drawing_round_trip(room):
    again = OccupancyGrid.from_ascii(room.to_ascii())
    assert (again.cells == room.cells).all()


def test_picture_round_trip(room, tmp_path):
    cells = room.cells.copy()
    cells[1, 1] = UNKNOWN
    OccupancyGrid(cells).to_png(tmp_path / "room.png")
    assert (OccupancyGrid.from_png(tmp_path / "room.png", 1.0).cells == cells).all()


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: OccupancyGrid.from_ascii("#x#"), "'x' in line 1"),
        (lambda: OccupancyGrid.from_ascii("  \n"), "at least one line"),
        (lambda: OccupancyGrid([[0, 5]]), "0 (free), 1 (occupied), 2 (unknown)"),
        (lambda: OccupancyGrid([[0, 1], [0]]), "cells must hold real numbers"),
        (lambda: OccupancyGrid([[0, 1]], resolution=0), "resolution must be positive"),
        (lambda: maps.distance_field(OccupancyGrid([[0, 0]])), "at least one occupied cell"),
        (lambda: OccupancyGrid.from_lines(np.zeros((0, 4)), 0.1), "at least one segment"),
        (lambda: OccupancyGrid([[0, 1]]).cast([0, 0, 0], [[0.0]], 1.0), "bearings must have shape (B,), got (1, 1)"),
        (lambda: OccupancyGrid([[0, 1]]).cast([0, math.nan, 0], [0.0], 1.0), "poses must be finite"),
    ],
)
def test_bad_input_is_named(call, words):
    with pytest.raises(ValueError) as error:
        call()
    assert words in str(error.value)


def test_lines_occupy_each_cell_they_cross():
    grid = OccupancyGrid.from_lines([(0.5, 0.5, 3.5, 0.5), (0.5, 0.5, 2.5, 2.0)], 1.0)
    # the slanted one crosses y = 1 at x = 1.167 and x = 1 at y = 0.875, x = 2 at y = 1.625; it ends on y = 2
    assert grid.to_ascii() == "..#.\n.##.\n####"


def test_distance_field_by_hand():
    grid = OccupancyGrid.from_ascii("#..\n...\n..#", resolution=2.0)
    r2 = math.sqrt(2)
    np.testing.assert_allclose(grid.distance, 2 * np.array([[2, 1, 0], [1, r2, 1], [0, 1, 2]]), atol=1e-12)


def test_distance_field_against_a_search_tree(building):
    grid = building.grid
    obstacles = grid.center_of(*np.nonzero(grid.occupied))
    centers = grid.center_of(*np.mgrid[: grid.cells.shape[0], : grid.cells.shape[1]])
    np.testing.assert_allclose(grid.distance, cKDTree(obstacles).query(centers)[0], atol=1e-9)


@pytest.mark.parametrize(
    ("pose", "bearing", "expected"),
    [
        ((1.5, 1.5, 0.0), 0.0, 5.5),  # along the room to the wall at x = 7
        ((1.5, 2.5, 0.0), 0.0, 1.5),  # to the pillar at x = 3
        ((1.5, 1.5, math.pi / 2), 0.0, 2.5),  # up to the wall at y = 4
        ((6.5, 2.5, math.pi), 0.0, 2.5),  # back to the pillar at x = 4
        ((1.5, 1.5, 0.2), 0.4, 1.5 / math.cos(0.6)),  # slanted up to the pillar's left side, x = 3
        ((5.0, 1.5, math.radians(30)), math.radians(-90), 0.5 / math.cos(math.radians(30))),  # slanted down to y = 1
        ((3.5, 2.5, 0.0), 0.0, 0.0),  # inside the pillar
        ((20.0, 20.0, 0.0), 0.0, 6.0),  # beyond the map: nothing is seen
    ],
)
def test_rays_by_hand(room, pose, bearing, expected):
    assert maps.walk_ray(room, pose, bearing, 6.0) == pytest.approx(expected, abs=1e-12)
    assert room.cast(pose, [bearing], 6.0)[0] == pytest.approx(expected, abs=1e-12)


def test_range_is_limited(room):
    assert room.cast((1.5, 1.5, 0.0), [0.0], 3.0)[0] == 3.0
    assert maps.walk_ray(room, (1.5, 1.5, 0.0), 0.0, 3.0) == 3.0


def test_shape_of_the_cast(room):
    assert room.cast(np.full((2, 3, 3), 1.5), [0.0, 0.1], 5.0).shape == (2, 3, 2)
    assert room.cast((1.5, 1.5, 0.0), [], 5.0).shape == (0,)
    assert room.cast(np.zeros((0, 3)), [0.0], 5.0).shape == (0, 1)


@settings(deadline=None, max_examples=40)
@given(st.floats(1.05, 6.95), st.floats(1.05, 3.95), st.floats(-7, 7), st.floats(-4, 4))
@example(1.5, 1.5, 5e-324, 0.0)
def test_turning_robot_and_beam_oppositely_changes_nothing(x, y, theta, bearing):
    grid = OccupancyGrid.from_ascii(ROOM)
    if grid.at([x, y]) == OCCUPIED:
        return
    one = maps.walk_ray(grid, (x, y, theta), bearing, 20.0)
    assert one == pytest.approx(maps.walk_ray(grid, (x, y, 0.0), theta + bearing, 20.0), abs=1e-6)
    hit = np.array([x + one * np.cos(theta + bearing), y + one * np.sin(theta + bearing)])
    assert grid.at(hit + 1e-6 * np.array([np.cos(theta + bearing), np.sin(theta + bearing)])) == OCCUPIED


def test_building_in_four_forms(building):
    grid = building.grid
    assert (OccupancyGrid.from_lines(building.lines, 0.1).occupied == grid.occupied).all()
    i, j = grid.cell_of(building.points)
    assert grid.distance[i.clip(0, 100), j.clip(0, 160)].max() < 0.25  # scan points lie on walls
    for a, b in building.edges:
        way = np.linspace(building.nodes[a], building.nodes[b], 60)
        assert grid.distance[grid.cell_of(way)].min() > 0.35  # a robot 0.7 m wide passes
    assert (grid.at(building.landmarks) == FREE).all() and (grid.cells == UNKNOWN).any()


def test_building_files_are_what_the_script_writes(tmp_path):
    spec = importlib.util.spec_from_file_location("make_building", DATA / "monte_carlo/make_building.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    script.write(tmp_path)
    for path in sorted(tmp_path.glob("*.csv")):
        assert path.read_text() == (DATA / "monte_carlo" / path.name).read_text(), path.name
    stored = OccupancyGrid.from_png(DATA / "monte_carlo/building.png", 0.1)
    assert (OccupancyGrid.from_png(tmp_path / "building.png", 0.1).cells == stored.cells).all()


def test_the_nearest_place_of_a_wall_is_its_foot_or_its_end():
    walls = np.array([[0, 0, 4, 0], [10, 0, 10, 5.0]])
    assert maps.nearest_on_lines(walls, [1.0, 2.0]) == pytest.approx([1, 0])
    assert maps.nearest_on_lines(walls, [6.0, 1.0]) == pytest.approx([4, 0])
    assert maps.nearest_on_lines(walls, [9.0, 7.0]) == pytest.approx([10, 5])
    with pytest.raises(ValueError, match="at least one wall"):
        maps.nearest_on_lines(np.empty((0, 4)), [1.0, 2.0])


def test_a_ray_is_cast_from_where_the_map_begins():
    """The same room with its corner elsewhere and cells of 0.5 m: twice as near, nothing else."""
    moved = OccupancyGrid.from_ascii(ROOM, resolution=0.5, origin=(-7.0, 3.0))
    plain = OccupancyGrid.from_ascii(ROOM)
    for x, y, theta in ((1.5, 1.5, 0.0), (1.5, 2.2, 0.3), (6.2, 3.1, -2.6), (4.4, 1.2, 1.9)):
        far = maps.walk_ray(plain, (x, y, theta), 0.1, 30.0)
        near = maps.walk_ray(moved, (-7.0 + x / 2, 3.0 + y / 2, theta), 0.1, 15.0)
        assert near == pytest.approx(far / 2) and 0 < far < 8


def test_a_margin_lies_around_the_lines():
    grid = OccupancyGrid.from_lines([[1.0, 2.0, 3.0, 2.0], [3.0, 2.0, 3.0, 4.0]], 0.5, margin=1.0)
    assert grid.extent == (0.0, 4.5, 1.0, 5.5)  # the cells that hold 0 and 4, 1 and 5
    assert grid.at([3.1, 3.0]) == OCCUPIED and grid.at([0.1, 1.1]) == FREE == grid.at([4.4, 5.4])


def test_the_nearest_place_on_walls_is_that_of_a_fine_search():
    rng = np.random.default_rng(3)
    lines = rng.uniform(-5, 5, (6, 4)) + [7, -3, 7, -3]
    share = np.linspace(0, 1, 4001)[:, None, None]
    along = lines[:, :2] + share * (lines[:, 2:] - lines[:, :2])
    for point in rng.uniform(-6, 6, (30, 2)) + [7, -3]:
        found = maps.nearest_on_lines(lines, point)
        least = np.hypot(*(along - point).reshape(-1, 2).T).min()
        assert np.hypot(*(found - point)) == pytest.approx(least, abs=1e-5)


def test_free_is_neither_occupied_nor_unknown():
    grid = OccupancyGrid.from_ascii("#..\n..?")
    assert grid.free.tolist() == [[True, True, False], [False, True, True]]


def test_lines_of_a_drawing_may_be_indented_and_of_unequal_length():
    """The least indent is none of the map; what a line lacks at its end is free."""
    grid = OccupancyGrid.from_ascii("     ##\n   #\n    ##\n")
    assert (grid.cells == OCCUPIED)[::-1].tolist() == [[0, 0, 1, 1], [1, 0, 0, 0], [0, 1, 1, 0]]
