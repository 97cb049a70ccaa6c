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
from labkit.localization.maps import FREE, OCCUPIED, UNKNOWN, OccupancyGrid, RangeTable
from labkit.localization.sensors import LikelihoodField, Scanner
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
        (lambda: OccupancyGrid([[0, 1]], resolution=0), "resolution must be positive"),
        (lambda: maps.distance_field(OccupancyGrid([[0, 0]])), "at least one occupied cell"),
        (lambda: OccupancyGrid.from_lines(np.zeros((0, 4)), 0.1), "at least one segment"),
        (lambda: LikelihoodField(OccupancyGrid([[0, 1]]), 0.1, share_hit=0), "share_hit"),
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
    assert room.cast(pose, [bearing], 6.0)[0] == pytest.approx(expected, abs=1e-5)


def test_range_is_limited(room):
    assert room.cast((1.5, 1.5, 0.0), [0.0], 3.0)[0] == 3.0
    assert maps.walk_ray(room, (1.5, 1.5, 0.0), 0.0, 3.0) == 3.0


def test_traced_rays_against_the_exact_walk(building):
    grid, rng = building.grid, np.random.default_rng(1)
    i, j = np.nonzero(grid.free)
    pick = rng.integers(len(i), size=150)
    jitter = rng.uniform(-0.05, 0.05, (150, 2))
    poses = np.column_stack([grid.center_of(i[pick], j[pick]) + jitter, rng.uniform(-3, 3, 150)])
    bearings = np.linspace(-2, 2, 9)
    exact = np.array([[maps.walk_ray(grid, pose, b, 18.0) for b in bearings] for pose in poses])
    error = np.abs(grid.cast(poses, bearings, 18.0) - exact)
    assert np.median(error) < 1e-4 and np.quantile(error, 0.95) < grid.resolution and (error > 0.3).mean() < 0.02


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


def test_range_table_at_the_middle_of_a_cell(room):
    table = RangeTable(room, r_max=6.0, n_angles=8)
    assert table.nbytes == 8 * 5 * 8 * 4
    np.testing.assert_allclose(table.cast((1.5, 1.5, 0.0), [0.0, math.pi / 2]), [5.5, 2.5], atol=1e-5)
    np.testing.assert_allclose(table.cast((1.5, 1.5, 2 * math.pi - 0.1), [0.0]), [5.5], atol=1e-5)
    np.testing.assert_allclose(table.cast([(99, 0, 0), (1.5, 1.5, -math.pi)], [math.pi], 4.0)[:, 0], [4.0, 4.0])


def test_range_table_rounds_angles_like_tracing(building):
    table = RangeTable(building.grid, 18.0, n_angles=36)
    bearings = table.cast((8.0, 5.1, 0.3), np.linspace(-3, 3, 50))
    snapped = np.round((0.3 + np.linspace(-3, 3, 50)) / (2 * np.pi / 36)) * (2 * np.pi / 36)
    center = building.grid.center_of(*building.grid.cell_of((8.0, 5.1)))
    np.testing.assert_allclose(bearings, building.grid.cast((*center, 0.0), snapped, 18.0), atol=1e-4)


def test_likelihood_field_by_hand(room):
    """The lecture's plain model: the log of N(0, std^2) at distances 0, 1 and 1 (m) of the end points."""
    field = LikelihoodField(room, std=0.5, share_hit=1.0, r_max=6.0, max_distance=2.0)
    log_peak = -math.log(0.5 * math.sqrt(2 * math.pi))
    pose, bearings = (1.5, 1.5, 0.0), [0.0]
    assert field.log_weights(pose, [6.0 - 0.3], bearings) == pytest.approx(log_peak, abs=1e-5)  # in the wall, x 7.2
    assert field.log_weights(pose, [4.7], bearings) == pytest.approx(log_peak - 2.0, abs=1e-5)  # a cell short of it
    assert field.log_weights(pose, [0.0], bearings) == pytest.approx(log_peak - 2.0, abs=1e-5)  # beside walls: 1 m
    assert field.log_weights(pose, [6.0], bearings) == 0.0  # at r_max: no obstacle was seen
    assert field.log_weights((50, 50, 0.0), [1.0], bearings) == pytest.approx(log_peak - 8.0, abs=1e-5)  # off the map
    both = field.log_weights(pose, [5.7, 2.6], [0.0, math.pi / 2])
    assert both == pytest.approx(2 * log_peak, abs=1e-5)


def test_likelihood_field_mixture(room):
    field = LikelihoodField(room, std=0.5, share_hit=0.9, r_max=6.0)
    density = 0.9 * np.exp(-0.5 * (np.array([0, 1.0]) / 0.5) ** 2) / (0.5 * math.sqrt(2 * math.pi)) + 0.1 / 6.0
    np.testing.assert_allclose(field.log_density([0, 1.0]), np.log(density), atol=1e-12)


def test_likelihood_field_against_the_textbook_loop(building):
    grid, rng = building.grid, np.random.default_rng(2)
    field = LikelihoodField(grid, 0.2, r_max=18.0)
    ranges, bearings = Scanner().scan(grid, (8.0, 5.1, 0.4), rng, every=20)
    poses = np.column_stack([rng.uniform(0, 16, 50), rng.uniform(0, 10, 50), rng.uniform(-4, 4, 50)])
    expected = np.zeros(50)
    for k, (x, y, theta) in enumerate(poses):
        for r, b in zip(ranges, bearings):
            if r >= 18.0:
                continue
            i, j = grid.cell_of([x + r * math.cos(theta + b), y + r * math.sin(theta + b)])
            inside = 0 <= i < grid.cells.shape[0] and 0 <= j < grid.cells.shape[1]
            expected[k] += field.log_density(min(grid.distance[i, j] if inside else np.inf, field.max_distance))
    deviation = np.abs(field.log_weights(poses, ranges, bearings) - expected)
    assert np.median(deviation) < 1e-3 and (deviation > 1e-3).mean() < 0.1  # a beam on a cell's edge may round over


def test_scanner_has_the_lectures_beams(building):
    scanner = Scanner()
    assert len(scanner.bearings) == 541
    assert np.degrees(scanner.bearings[[0, -1]]) == pytest.approx([-135, 135])
    assert np.degrees(np.diff(scanner.bearings)) == pytest.approx(np.full(540, 0.5))
    rng = np.random.default_rng(3)
    scans = np.array([scanner.scan(building.grid, (8.0, 5.1, 0.0), rng)[0] for _ in range(60)])
    dropped = scans == scanner.r_max
    assert abs(dropped.mean() - 0.01) < 0.003
    residual = (scans - building.grid.cast((8.0, 5.1, 0.0), scanner.bearings, 18.0))[~dropped]
    assert residual.std() == pytest.approx(0.03, rel=0.03) and abs(residual.mean()) < 1e-3


def test_unmapped_obstacle_shortens_the_scan(building):
    world = building.grid.with_disks([(9.0, 5.1, 0.3)])
    assert world.cast((8.0, 5.1, 0.0), [0.0], 18.0)[0] == pytest.approx(0.7, abs=0.11)
    assert building.grid.cast((8.0, 5.1, 0.0), [0.0], 18.0)[0] > 5


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
