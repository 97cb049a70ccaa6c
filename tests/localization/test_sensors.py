"""Sensor models by hand: what one measurement says about a pose."""

import math

import numpy as np
import pytest
from scipy import integrate, stats

from labkit.documents.lecture.examples import load_building
from labkit.fast import sensors as fast
from labkit.geometry import planar
from labkit.localization import particles as pt
from labkit.localization.maps import OccupancyGrid
from labkit.localization.sensors import (
    SENSORS,
    XTION,
    LikelihoodField,
    Scanner,
    beam_density,
    scan_from_depth,
    see_landmarks,
    weigh_beams,
    weigh_doors,
    weigh_landmarks,
    weigh_likelihood_field,
)

ROOM = OccupancyGrid.from_ascii("########\n#......#\n#..#...#\n#......#\n########")


@pytest.fixture(scope="module")
def building():
    return load_building()


def test_landmark_weight_by_hand():
    weigh = weigh_landmarks([[5.0, 0.0]], [[5.0, 0.0]], std_range=0.5, std_bearing=0.1)
    peak = -math.log(0.5 * math.sqrt(2 * math.pi)) - math.log(0.1 * math.sqrt(2 * math.pi))
    states = [[0, 0, 0], [0.5, 0, 0], [0, 0, 0.2], [0, 0, 2 * math.pi]]
    np.testing.assert_allclose(weigh(states), [peak, peak - 0.5, peak - 2.0, peak], atol=1e-12)
    assert weigh.best == pytest.approx(peak)
    assert np.shape(weigh([0.0, 0, 0])) == ()


def test_landmark_weight_is_a_product_of_densities():
    z, marks = np.array([[2.0, 0.3], [4.0, -2.0]]), np.array([[1.0, 1.0], [-2.0, 3.0]])
    state = np.array([0.2, -0.3, 0.5])
    weight = 1.0
    for (r, phi), mark in zip(z, marks):
        d = mark - state[:2]
        weight *= stats.norm.pdf(r - np.hypot(*d), scale=0.4)
        weight *= stats.norm.pdf(planar.wrap_angle(phi - math.atan2(d[1], d[0]) + state[2]), scale=0.3)
    assert weigh_landmarks(z, marks, 0.4, 0.3)(state) == pytest.approx(math.log(weight), abs=1e-12)


def test_bearing_behind_the_robot_is_wrapped():
    weigh = weigh_landmarks([[1.0, math.pi - 0.01]], [[-1.0, 0.0]], std_bearing=0.1)
    assert weigh([0.0, 0.02, 0.0]) == pytest.approx(weigh.best - 0.5 * (0.03 / 0.1) ** 2, abs=1e-3)


@pytest.mark.parametrize(("kwargs", "blind"), [({"std_range": 0.1}, (0, 0, 1.0)), ({"std_bearing": 0.1}, (2.0, 0, 0))])
def test_one_reading_alone(kwargs, blind):
    weigh = weigh_landmarks([[5.0, 0.0]], [[5.0, 0.0]], **kwargs)
    assert weigh(blind) == pytest.approx(weigh.best)


def test_same_measurement_twice_squares_the_ratio():
    """Weights multiply: two equal readings count twice in the exponent, which adding them would not do."""
    once = weigh_landmarks([[5.0, 0.1]], [[5.0, 0.0]], 0.5, 0.1)
    twice = weigh_landmarks([[5.0, 0.1]] * 2, [[5.0, 0.0]] * 2, 0.5, 0.1)
    states = np.array([[0.0, 0, 0], [0.7, 0.2, 0.1]])
    np.testing.assert_allclose(np.diff(twice(states)), 2 * np.diff(once(states)))


@pytest.mark.parametrize("expected", [0.05, 0.5, 3.0, 9.9])
@pytest.mark.parametrize("shares", [(1, 0, 0, 0), (0.7, 0.1, 0.05, 0.15)])
def test_beam_model_is_a_density(expected, shares):
    area = integrate.quad(
        lambda z: float(beam_density(z, np.array(expected), 0.2, 10.0, shares)), 0, 10, points=[expected], limit=200
    )[0]
    assert area == pytest.approx(1 - shares[2], abs=1e-6)


def test_beam_weight_by_hand():
    weigh = weigh_beams(ROOM, [5.0, 1.5], [0.0, math.pi / 2], std=0.5, r_max=20.0, shares=(1, 0, 0, 0))
    # at (1.5, 1.5) 5.5 and 2.5 are expected: one and two standard deviations off
    peak = -2 * math.log(0.5 * math.sqrt(2 * math.pi))
    assert weigh([1.5, 1.5, 0.0]) == pytest.approx(peak - 0.5 - 2.0, abs=1e-5)
    mixed = weigh_beams(ROOM, [5.0], [0.0], 0.5, 20.0, shares=(0.6, 0.2, 0.1, 0.1), decay=0.5)
    by_hand = 0.6 * stats.norm.pdf(1.0) / 0.5 + 0.2 * 0.5 * math.exp(-2.5) / (1 - math.exp(-2.75)) + 0.1 / 20
    assert mixed([1.5, 1.5, 0.0]) == pytest.approx(math.log(by_hand), abs=1e-5)


def test_a_lost_beam_has_zero_weight_in_the_plain_model_only():
    lost = ([20.0], [0.0], 0.5, 20.0)
    assert weigh_beams(ROOM, *lost, shares=(1, 0, 0, 0))([1.5, 1.5, 0.0]) == -np.inf
    assert weigh_beams(ROOM, *lost)([1.5, 1.5, 0.0]) == pytest.approx(math.log(0.05 + 0.1 / 20))


def test_likelihood_field_weighting():
    field = LikelihoodField(ROOM, 0.5, share_hit=1.0, r_max=6.0)
    weigh = weigh_likelihood_field(field, [5.7, 2.6, 6.0], [0.0, math.pi / 2, 1.0])
    assert weigh([[1.5, 1.5, 0.0]])[0] == pytest.approx(weigh.best, abs=1e-5)  # the third reading does not count
    assert weigh.best == pytest.approx(-2 * math.log(0.5 * math.sqrt(2 * math.pi)))


def test_likelihood_field_by_hand():
    """The lecture's plain model: the log of N(0, std^2) at distances 0, 1 and 1 (m) of the end points."""
    field = LikelihoodField(ROOM, std=0.5, share_hit=1.0, r_max=6.0, max_distance=2.0)
    log_peak = -math.log(0.5 * math.sqrt(2 * math.pi))
    pose, bearings = (1.5, 1.5, 0.0), [0.0]
    assert field.log_weights(pose, [6.0 - 0.3], bearings) == pytest.approx(log_peak, abs=1e-5)  # in the wall, x 7.2
    assert field.log_weights(pose, [4.7], bearings) == pytest.approx(log_peak - 2.0, abs=1e-5)  # a cell short of it
    assert field.log_weights(pose, [0.0], bearings) == pytest.approx(log_peak - 2.0, abs=1e-5)  # beside walls: 1 m
    assert field.log_weights(pose, [6.0], bearings) == 0.0  # at r_max: no obstacle was seen
    assert field.log_weights((50, 50, 0.0), [1.0], bearings) == pytest.approx(log_peak - 8.0, abs=1e-5)  # off the map
    both = field.log_weights(pose, [5.7, 2.6], [0.0, math.pi / 2])
    assert both == pytest.approx(2 * log_peak, abs=1e-5)


def test_likelihood_field_mixture():
    field = LikelihoodField(ROOM, std=0.5, share_hit=0.9, r_max=6.0)
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


@pytest.mark.parametrize("model", SENSORS)
def test_truth_weighs_more_than_elsewhere(building, model):
    rng, suite = np.random.default_rng(5), fast.SensorSuite(building, exponents=dict.fromkeys(SENSORS, 1.0))
    pose = np.array([8.4, 2.4, 0.7])
    weigh = suite.measure(model, pose, rng)
    others = pt.uniform_states(building.grid, 500, rng)
    assert weigh(pose) > weigh(others).max()
    assert weigh(pose) - weigh.best > -60


def test_door_sensor():
    weigh = weigh_doors([2.0, 5.0], saw_door=True, std=0.3, trust=0.9)
    np.testing.assert_allclose(np.exp(weigh(np.array([2.0, 3.5]))), [0.9, 0.1], atol=1e-5)
    wall = weigh_doors([2.0, 5.0], saw_door=False)
    np.testing.assert_allclose(np.exp(weigh(np.linspace(0, 6, 9))) + np.exp(wall(np.linspace(0, 6, 9))), 1.0)


def test_landmarks_behind_walls_are_not_seen(building):
    index, z = see_landmarks(building.grid, (8.4, 2.4, 0.0), building.landmarks, np.random.default_rng(17))
    assert set(index) == {15, 16, 17}
    r = np.hypot(*(building.landmarks[index] - (8.4, 2.4)).T)
    np.testing.assert_allclose(z[:, 0], r, atol=0.5)
    assert len(see_landmarks(None, (8.4, 2.4, 0.0), building.landmarks, np.random.default_rng(17))[0]) > 2


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: weigh_landmarks([[1, 0]], [[0, 0]]), "got neither"),
        (lambda: weigh_landmarks([[1, 0]], [[0, 0], [1, 1]], 0.1), "same shape (m, 2)"),
        (lambda: weigh_beams(ROOM, [1.0], [0.0], 0.1, 5.0, shares=(1, 1, 0, 0)), "add up to 1"),
    ],
)
def test_bad_input_is_named(call, words):
    with pytest.raises(ValueError) as error:
        call()
    assert words in str(error.value)


def test_a_row_of_depths_becomes_a_scan():
    """A wall straight ahead at 2 m: one depth, ranges that grow to the sides; columns project evenly."""
    ranges, bearings = scan_from_depth(np.full(640, 2.0), np.radians(58))
    np.testing.assert_allclose(ranges * np.cos(bearings), 2.0)
    across = ranges * np.sin(bearings)
    np.testing.assert_allclose(np.diff(across), np.diff(across)[0])
    edge = 2.0 * np.tan(np.radians(29))
    assert across[0] == pytest.approx(edge * 639 / 640) and across[-1] == pytest.approx(-edge * 639 / 640)
    assert bearings[0] > 0 > bearings[-1] and abs(bearings).max() < np.radians(29)


def test_columns_without_a_depth_are_left_out():
    depth = np.array([0.0, 0.79, 0.8, 2.0, 3.5, 3.51])
    ranges, bearings = scan_from_depth(depth, 1.0)
    np.testing.assert_allclose(ranges * np.cos(bearings), [0.8, 2.0, 3.5])
    np.testing.assert_allclose(np.tan(bearings), np.tan(0.5) * np.array([0.5, -0.5, -1.5]) / 3)


@pytest.mark.parametrize(("field_of_view", "near"), [(np.pi, 0.8), (1.0, 3.5)])
def test_a_camera_that_cannot_be_is_refused(field_of_view, near):
    with pytest.raises(ValueError, match="field_of_view must be less than pi, and near less than far"):
        scan_from_depth(np.ones(4), field_of_view, near)


def test_a_tempered_weighting_is_a_power_of_the_weights():
    weighting = weigh_landmarks([[5.0, 0.1]], [[5.0, 0.0]], std_range=0.5, std_bearing=0.1)
    tempered, states = weighting.tempered(0.3), np.array([[0.0, 0, 0], [0.5, 0, 0.2]])
    np.testing.assert_allclose(tempered(states), 0.3 * weighting(states))
    assert tempered.best == pytest.approx(0.3 * weighting.best) and abs(weighting.best) > 0.1


def test_a_door_is_a_bell_of_its_standard_deviation():
    """At one and a half standard deviations from the nearest of two doors, from either side."""
    says = (1 - 0.8) + (2 * 0.8 - 1) * stats.norm.pdf(1.5) / stats.norm.pdf(0)
    for door, not_door in ((True, False), (False, True)):
        weigh = weigh_doors([2.0, 5.0], saw_door=door, std=0.4, trust=0.8)
        np.testing.assert_allclose(np.exp(weigh(np.array([1.4, 2.6, 4.4, 5.6]))), says if door else 1 - says)
        assert weigh.best == pytest.approx(math.log(0.8)) and door != not_door


def test_landmarks_on_a_wall_and_a_tenth_of_a_meter_behind_it_are_seen():
    marks = [[6.95, 1.5], [7.0, 1.5], [7.08, 1.5], [7.13, 1.5]]  # the wall begins at x = 7
    index, _ = see_landmarks(ROOM, (1.5, 1.5, 0.0), marks, np.random.default_rng(1), r_max=9.0)
    assert index.tolist() == [0, 1, 2]


def test_a_likelihood_field_reaches_as_far_as_six_standard_deviations():
    for std in (0.1, 0.4):
        assert LikelihoodField(ROOM, std).max_distance == pytest.approx(6 * std)


def test_doors_are_seen_from_any_number_of_places():
    weigh = weigh_doors([1.0, 4.0, 9.0], True)
    places = np.array([[1.0, 2.5], [4.1, 8.8], [20.0, 3.9]])
    expected = [[float(weigh(x)) for x in row] for row in places]
    np.testing.assert_allclose(weigh(places), expected)


def test_the_camera_of_the_lecture_divides_its_view_into_640():
    degrees = np.rad2deg(XTION.bearings)
    np.testing.assert_allclose(degrees[[0, -1]], [-29.0, 29.0])
    np.testing.assert_allclose(np.diff(degrees), 58.0 / 640)
