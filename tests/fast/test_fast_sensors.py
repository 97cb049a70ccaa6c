"""Sensor models for thousands of particles beside their readable namesakes."""

import math

import numpy as np
import pytest

from labkit.documents.lecture.examples import load_building
from labkit.fast import maps as fast_maps
from labkit.fast import sensors as fast
from labkit.localization import sensors as plain
from labkit.localization.maps import OccupancyGrid

GRID = OccupancyGrid.from_ascii("########\n#..?...#\n#..#...#\n#......#\n########", 0.5, (-1.0, 2.0))
RNG = np.random.default_rng(3)
EDGES = [[50, 0, 0], [-1.0, 2.0, 9.0], [0.7, 3.3, 0], [0.7, 3.8, -40.0], [1e6, -1e6, 3]]
STATES = np.concatenate([RNG.uniform([-2, 1, -9], [4, 5, 9], (300, 3)), EDGES])


@pytest.mark.parametrize("dtype", [float, np.float32])
@pytest.mark.parametrize("stds", [(0.2, 0.1), (0.2, None), (None, 0.1)])
@pytest.mark.parametrize("m", [0, 1, 4])
def test_landmarks(dtype, stds, m):
    marks, z = RNG.uniform(-2, 4, (m, 2)), np.column_stack([RNG.uniform(0, 5, m), RNG.uniform(-4, 4, m)])
    states = STATES[:-1].astype(dtype)
    a, b = (module.weigh_landmarks(z, marks, *stds) for module in (fast, plain))
    assert a.best == pytest.approx(b.best, abs=1e-12)
    np.testing.assert_allclose(a(states), b(states), rtol=1e-9, atol=1e-9)
    assert a(states[0]) == pytest.approx(b(states[0])) and a(states.reshape(4, -1, 3)).shape == (4, len(states) // 4)


@pytest.mark.parametrize(("stds", "error"), [((0.2, 0.1), 1e-5), ((0.2, 1e-3), 1e-10), ((1e-3, 0.1), 1e-10)])
def test_thousands_in_single_precision(stds, error):
    """Only where it cannot be told: readings that are finer than it are weighed in double precision.

    Readings are rounded by about 3e-7 rad and 1e-6 m, 5e-6 standard deviations: this moves k^2 / 2 by 5e-6 k.
    """
    rng = np.random.default_rng(8)
    marks, z = rng.uniform(-5, 5, (4, 2)), np.column_stack([rng.uniform(1, 6, 4), rng.uniform(-4, 4, 4)])
    states = rng.uniform([-6, -6, -30], [6, 6, 30], (fast.MANY, 3))
    a, b = (module.weigh_landmarks(z, marks, *stds)(states) for module in (fast, plain))
    assert a.dtype == float and (np.abs(a - b) < error * (1 + np.abs(b))).all()


def test_thousands_too_far_for_single_precision():
    states = np.full((fast.MANY, 3), [1e30, -1e25, 2.0])
    states[0] = 0.0
    a, b = (module.weigh_landmarks([[2.0, 0.3]], [[1.0, 2.0]], 0.2, 0.1)(states) for module in (fast, plain))
    assert np.isfinite(a).all()
    np.testing.assert_allclose(a, b, rtol=1e-9)


def test_a_state_on_the_landmark():
    """It sees it in no direction: only the range counts alike, and no NaN comes out."""
    for stds, same in (((0.1, None), True), ((0.1, 0.1), False)):
        weighed = [
            module.weigh_landmarks([[1.0, 0.3]], [[2.0, 1.0]], *stds)([2.0, 1.0, 0.2]) for module in (fast, plain)
        ]
        assert np.isfinite(weighed).all() and (not same or np.ptp(weighed) < 1e-9)


@pytest.mark.parametrize("dtype", [float, np.float32])
@pytest.mark.parametrize("shares", [(1, 0, 0, 0), (0.75, 0.1, 0.05, 0.1), (0, 0.5, 0, 0.5)])
def test_beams(dtype, shares):
    """The table's step rounds expected ranges by 0.05 mm at most, 1/4000 of std; in single precision a beam whose
    weight is below e^-80 may count as impossible.
    """
    tracer, pose, bearings = fast_maps.Tracer(GRID), np.array([0.3, 2.8, 0.3]), np.linspace(-3, 3, 7).astype(dtype)
    ranges = (tracer.cast(pose, bearings, 4.0) + 0.05).astype(dtype)
    states = np.concatenate([pose + RNG.normal(0, 0.03, (200, 3)), STATES]).astype(dtype)
    a = fast.weigh_beams(tracer, ranges, bearings, 0.2, 4.0, shares, step=1e-4)
    b = plain.weigh_beams(tracer, ranges, bearings, 0.2, 4.0, shares)
    likely = b(states) > -80
    assert likely.sum() > 100
    np.testing.assert_allclose(a(states)[likely], b(states)[likely], rtol=2e-3, atol=0.02)
    assert (a(states)[~likely] < -75).all() and not np.isnan(a(states)).any()
    assert a.best == pytest.approx(b.best, rel=1e-5)


@pytest.mark.parametrize("dtype", [float, np.float32])
def test_density(dtype):
    """Short, long, lost and certain readings, near both ends of the range and in its middle."""
    expected = np.array([0.0, 1e-3, 0.1, 1.0, 3.0, 3.9, 4.0])[:, None].astype(dtype)
    ranges = np.array([0.0, 0.05, 0.9, 3.0, 3.95, 4.0])
    shares = (0.7, 0.1, 0.05, 0.15)
    found = fast._beam_density(ranges, expected, 0.2, 4.0, shares, 0.5)
    wanted = plain.beam_density(ranges, expected, 0.2, 4.0, shares, 0.5)
    np.testing.assert_allclose(found, wanted, rtol=2e-5 if dtype == np.float32 else 1e-6)


@pytest.mark.parametrize("dtype", [float, np.float32])
@pytest.mark.parametrize("share_hit", [0.9, 1.0])
def test_likelihood_field(dtype, share_hit):
    """Equal but where an end point falls onto a cell's edge in single precision, which the draws here do not."""
    a, b = (module.LikelihoodField(GRID, 0.3, share_hit, r_max=4.0) for module in (fast, plain))
    ranges, bearings = np.array([0.3, 1.1, 0.0, 4.0, 2.0], dtype), np.array([0, 1, 2, 3, -1.0], dtype)
    states = STATES.astype(dtype)
    np.testing.assert_allclose(
        a.log_weights(states, ranges, bearings), b.log_weights(states, ranges, bearings), rtol=1e-5
    )
    assert a.log_weights(states[0], ranges, bearings).shape == ()
    assert (
        a.log_weights(states, [4.0], [0.0]).tolist()
        == b.log_weights(states, [4.0], [0.0]).tolist()
        == [0.0] * len(states)
    )


@pytest.mark.parametrize("sensor", plain.SENSORS)
def test_suites_weigh_alike(sensor):
    building, pose = load_building(), np.array([8.4, 2.4, 0.7])
    suites = [module.SensorSuite(building, every=60) for module in (fast, plain)]
    if sensor == "landmarks":
        weightings = [suite.measure(sensor, pose, np.random.default_rng(5)) for suite in suites]
    else:  # the same scan, as a traced one may pass a corner
        scan = suites[0].scan(pose, np.random.default_rng(5), building.grid)
        weightings = [suite.weigh_scan(sensor, *scan) for suite in suites]
    near = pose + np.random.default_rng(6).normal(0, 0.02, (12, 3))
    a, b = (weighting(near) - weighting.best for weighting in weightings)
    limit = 1.0 if sensor == "beams" else 1e-4  # the table of ranges rounds places to cells, half a cell is std / 4
    assert np.abs(a - b).max() < limit
    assert weightings[0].best == pytest.approx(weightings[1].best, rel=1e-3)


def test_tabulated_ranges_are_close_to_the_exact_ones():
    building, rng = load_building(), np.random.default_rng(4)
    tracer = fast_maps.Tracer(building.grid)
    ranges, bearings = plain.Scanner().scan(tracer, (8.0, 5.1, 0.3), rng, every=9)
    states = np.column_stack([rng.uniform(1, 15, 200), rng.uniform(4.5, 5.8, 200), rng.uniform(-3, 3, 200)])
    exact = plain.weigh_beams(tracer, ranges, bearings, 0.2, 18.0)(states)
    table = fast.weigh_beams(tracer, ranges, bearings, 0.2, 18.0)(states)
    assert np.abs(exact - table).max() < 1.0 and np.abs(exact - table).mean() < 0.2  # of 60 beams together
    assert math.isfinite(exact.sum())
