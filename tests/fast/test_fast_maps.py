"""Traced rays beside the exact walk: equal but where a ray clips a corner; looked-up ranges beside traced ones."""

import math

import numpy as np
import pytest

from labkit.documents.lecture.examples import load_building
from labkit.fast import maps as fast
from labkit.fast.maps import RangeTable
from labkit.localization import maps
from labkit.localization.maps import OccupancyGrid

ROOM = OccupancyGrid.from_ascii("########\n#......#\n#..#...#\n#......#\n########")


@pytest.fixture(scope="module")
def building():
    return load_building()


def test_traced_rays_against_the_exact_walk(building):
    grid, rng = building.grid, np.random.default_rng(1)
    i, j = np.nonzero(grid.free)
    pick = rng.integers(len(i), size=150)
    jitter = rng.uniform(-0.05, 0.05, (150, 2))
    poses = np.column_stack([grid.center_of(i[pick], j[pick]) + jitter, rng.uniform(-3, 3, 150)])
    bearings = np.linspace(-2, 2, 9)
    exact = np.array([[maps.walk_ray(grid, pose, b, 18.0) for b in bearings] for pose in poses])
    error = np.abs(fast.cast_rays(grid, poses, bearings, 18.0) - exact)
    assert np.median(error) < 1e-4 and np.quantile(error, 0.95) < grid.resolution and (error > 0.3).mean() < 0.02


def test_range_table_at_the_middle_of_a_cell():
    table = RangeTable(ROOM, r_max=6.0, n_angles=8)
    assert table.nbytes == 8 * 5 * 8 * 4
    np.testing.assert_allclose(table.cast((1.5, 1.5, 0.0), [0.0, math.pi / 2]), [5.5, 2.5], atol=1e-5)
    np.testing.assert_allclose(table.cast((1.5, 1.5, 2 * math.pi - 0.1), [0.0]), [5.5], atol=1e-5)
    np.testing.assert_allclose(table.cast([(99, 0, 0), (1.5, 1.5, -math.pi)], [math.pi], 4.0)[:, 0], [4.0, 4.0])


def test_range_table_rounds_angles_like_tracing(building):
    table = RangeTable(building.grid, 18.0, n_angles=36)
    bearings = table.cast((8.0, 5.1, 0.3), np.linspace(-3, 3, 50))
    snapped = np.round((0.3 + np.linspace(-3, 3, 50)) / (2 * np.pi / 36)) * (2 * np.pi / 36)
    center = building.grid.center_of(*building.grid.cell_of((8.0, 5.1)))
    np.testing.assert_allclose(bearings, fast.cast_rays(building.grid, (*center, 0.0), snapped, 18.0), atol=1e-4)


@pytest.mark.parametrize("dtype", [float, np.float32])
def test_rays_from_everywhere_equal_the_exact_walk(dtype):
    """Walls seen head on from inside, in an obstacle, beyond the map, in an unknown cell, along the axes."""
    grid = OccupancyGrid.from_ascii("########\n#..?...#\n#..#...#\n#......#\n########", 0.5, (-1.0, 2.0))
    poses = np.array([[0.3, 2.8, 0.0], [0.7, 3.3, 1.0], [50, 0, 0], [-1.0, 2.0, 0.3], [2.3, 3.1, -2.5]])
    poses, bearings = poses.astype(dtype), np.array([0.0, 0.1, math.pi / 2, -math.pi, 7.0]).astype(dtype)
    for r_max in (0.2, 1.0, 20.0):
        found = fast.cast_rays(grid, poses, bearings, r_max)
        np.testing.assert_allclose(found, maps.cast_rays(grid, poses, bearings, r_max), atol=2e-5)
        assert found.dtype == np.float32 and np.isfinite(found).all()
        assert (fast.Tracer(grid).cast(poses, bearings, r_max) == found).all()


def test_a_traced_ray_passes_a_corner_at_most():
    """It is never shorter than the exact one, wherever it starts."""
    rng = np.random.default_rng(2)
    poses = np.column_stack([rng.uniform(-1, 9, 300), rng.uniform(-1, 6, 300), rng.uniform(-9, 9, 300)])
    bearings = rng.uniform(-4, 4, 5)
    longer = fast.cast_rays(ROOM, poses, bearings, 6.0) - maps.cast_rays(ROOM, poses, bearings, 6.0)
    assert longer.min() > -1e-4 and (longer < 1e-4).mean() > 0.9


def test_no_rays_and_no_poses():
    for cast in (fast.cast_rays, maps.cast_rays):
        assert cast(ROOM, np.zeros((0, 3)), [0.0], 5.0).shape == (0, 1)
        assert cast(ROOM, (1.5, 1.5, 0.0), [], 5.0).shape == (0,)
        assert cast(ROOM, np.full((2, 3, 3), 1.5), [0.0, 0.1], 5.0).shape == (2, 3, 2)


def test_rays_of_a_map_without_walls_end_at_a_cell_or_nowhere():
    """Starts in the last row and column, and beyond them; where no corner is clipped, both say the same."""
    grid = OccupancyGrid.from_ascii("....#\n.....\n..#..\n....#", 0.5, (-1.0, 2.0))
    poses = np.array([[1.3, 3.2, 3], [-0.8, 3.8, 0.1], [1.4, 2.9, 1.6], [1.6, 3.2, 3], [0.2, 4.1, -1.5], [0, 4.6, 1]])
    bearings = np.linspace(-3.1, 3.1, 23)
    longer = fast.cast_rays(grid, poses, bearings, 9.0) - maps.cast_rays(grid, poses, bearings, 9.0)
    assert longer.min() > -1e-4 and (longer < 1e-4).mean() > 0.97
    assert (fast.cast_rays(grid, poses[3:], bearings, 9.0) == 9.0).all()


@pytest.mark.parametrize("place", [(8.2, 1.5), (9.7, 2.5), (-0.4, 1.5), (3.5, 5.3), (3.5, 6.6), (2.5, -0.2)])
def test_rays_from_beside_the_map_are_those_of_the_exact_walk(place):
    poses, bearings = np.array([[*place, 0.3]]), np.linspace(-3, 3, 13)
    found = fast.cast_rays(ROOM, poses, bearings, 4.0)
    np.testing.assert_allclose(found, maps.cast_rays(ROOM, poses, bearings, 4.0), atol=2e-5)
