"""Routes and drives: the shortest way, free space, what odometry reports."""

from types import SimpleNamespace

import numpy as np
import pytest

from labkit.documents.lecture.examples import load_building
from labkit.documents.lecture.printed import example_noise
from labkit.geometry.planar import wrap_angle
from labkit.localization import maps, odometry
from labkit.localization.drives import Wanderer, find_route, follow, random_drive


@pytest.fixture(scope="module")
def building():
    return load_building()


def test_route_and_drive_stay_in_free_space(building):
    assert find_route(building.edges, "office A", "store") == [
        "office A", "door A", "corridor west", "door store", "store",
    ]  # fmt: skip
    drive = random_drive(building, example_noise(), 200, np.random.default_rng(16))
    assert drive.truth.shape == (201, 3) and drive.controls.shape == (200, 2)
    assert (building.grid.at(drive.truth[:, :2]) == maps.FREE).all()
    reckoned = odometry.drive(drive.truth[0], drive.controls, drive.dt)
    assert np.hypot(*(reckoned - drive.truth)[-1, :2]) > 0.3  # odometry alone drifts


def test_of_two_ways_the_shorter_is_taken():
    ring = [("a", "b"), ("b", "c"), ("c", "d"), ("e", "d"), ("a", "e")]
    assert find_route(ring, "a", "d") == ["a", "e", "d"] and find_route(ring, "b", "b") == ["b"]


def test_places_that_nothing_connects_are_refused():
    with pytest.raises(ValueError, match="no chain of edges"):
        find_route([("a", "b")], "a", "c")
    with pytest.raises(ValueError, match="pairs of names"):
        find_route([("a", "b", "c")], "a", "c")


def test_controls_lead_through_the_waypoints_and_no_faster_than_allowed():
    start, waypoints, dt = np.array([1.0, 2.0, 2.5]), [[4.0, 2.0], [4.0, -1.0], [2.0, -1.0]], 0.5
    controls = follow(start, waypoints, 80, dt, speed=0.6, turn_rate=0.8)
    assert controls.shape == (80, 2) and not (controls[:, 0] * controls[:, 1]).any()
    assert np.abs(controls[:, 0]).max() <= 0.6 * (1 + 1e-9) and np.abs(controls[:, 1]).max() <= 0.8 * (1 + 1e-9)
    truth = odometry.drive(start, controls, dt)
    for point in waypoints:
        assert np.hypot(*(truth[:, :2] - point).T).min() < 1e-9
    moving = np.flatnonzero(controls.any(1))
    turns = [2.5, np.pi / 2, np.pi / 2]  # back to 0, then right twice
    least = sum(np.ceil(t / 0.4) for t in turns) + sum(np.ceil(way / 0.3 - 1e-9) for way in (3.0, 3.0, 2.0))
    assert len(moving) == least and moving[-1] == least - 1  # then it stands
    np.testing.assert_allclose(truth[-1, :2], [2.0, -1.0], atol=1e-9)
    np.testing.assert_allclose(follow(start, waypoints, 7, dt), controls[:7])


def test_a_long_drive_never_runs_out_of_places(building):
    drive = random_drive(building, {"k_d": 0.0, "k_theta": 0.0, "k_drift": 0.0}, 900, np.random.default_rng(3))
    assert drive.controls[-50:].any(1).all() and drive.controls.any(1).all()
    np.testing.assert_allclose(odometry.drive(drive.truth[0], drive.controls, 0.5), drive.truth, atol=1e-9)
    visited = [name for name, xy in building.nodes.items() if np.hypot(*(drive.truth[:, :2] - xy).T).min() < 1e-6]
    assert sum(not name.startswith(("door", "corridor")) for name in visited) >= 2


def test_a_drive_begins_where_it_is_told(building):
    rng = np.random.default_rng(4)
    starts = [random_drive(building, example_noise(), 5, rng, start="store").truth[0] for _ in range(60)]
    np.testing.assert_allclose([pose[:2] for pose in starts], [building.nodes["store"]] * 60)
    headings = np.array([pose[2] for pose in starts])
    assert headings.min() < -2 and headings.max() > 2 and np.abs(headings).max() <= np.pi


# --- a wanderer ------------------------------------------------------------------------------------------------------

OPEN = SimpleNamespace(
    nodes={"a": (1.0, 1.0), "b": (4.0, 1.0), "c": (4.0, 3.0)},
    edges=[("a", "b"), ("b", "c")],
    grid=SimpleNamespace(cast=lambda pose, direction, r_max: np.full(len(direction), 9.0)),
)


def test_it_turns_toward_its_place_then_drives_there():
    robot = Wanderer(OPEN, np.random.default_rng(0))
    np.testing.assert_allclose(robot.control([1.5, 1.0, 0.0], 0.1), [0.0, -0.8])  # "a" is next, half a turn away
    assert robot.goal == "a"
    for heading in (2.9, -2.9):
        turn = float(wrap_angle(np.pi - heading))
        np.testing.assert_allclose(robot.control([1.5, 1.0, heading], 1.0), [0.0, turn])
        np.testing.assert_allclose(robot.control([1.5, 1.0, heading], 0.1), [0.0, np.clip(turn / 0.1, -0.8, 0.8)])
    np.testing.assert_allclose(robot.control([1.5, 1.0, np.pi], 0.1), [0.6, 0.0])
    np.testing.assert_allclose(robot.control([1.03, 1.0, np.pi], 0.1), [0.3, 0.0])
    np.testing.assert_allclose(robot.control([1.5, 1.0, np.pi - 0.019], 0.1), [0.6, 0.0])


def test_arrived_it_goes_on_and_turns_back_only_at_a_dead_end():
    robot = Wanderer(OPEN, np.random.default_rng(1))
    robot.at, robot.goal = "a", "b"
    np.testing.assert_allclose(robot.control([4.0, 0.99, np.pi / 2], 0.1), [0.6, 0.0])
    assert (robot.at, robot.goal) == ("b", "c")
    robot.control([4.0, 2.985, np.pi / 2], 0.1)
    assert (robot.at, robot.goal) == ("c", "b")
    robot.start_over()
    assert robot.at is None and robot.goal is None


def test_it_heads_for_the_nearest_place_in_sight():
    asked = []

    def cast(pose, direction, r_max):
        asked.append((pose, np.array(direction)))
        return np.array([0.5, 2.6, 9.0])  # a wall before "a"

    seeing = SimpleNamespace(nodes=OPEN.nodes, edges=OPEN.edges, grid=SimpleNamespace(cast=cast))
    robot = Wanderer(seeing, np.random.default_rng(0))
    robot.control([1.9, 1.5, 1.0], 0.1)
    assert robot.goal == "b"
    np.testing.assert_allclose(asked[0][0], [1.9, 1.5, 0.0])
    np.testing.assert_allclose(asked[0][1], np.arctan2([-0.5, -0.5, 1.5], [-0.9, 2.1, 2.1]))
    blind = Wanderer(SimpleNamespace(**{**vars(seeing), "grid": SimpleNamespace(cast=lambda *a: np.zeros(3))}), None)
    np.testing.assert_allclose(blind.control([1.9, 1.5, 1.0], 0.1, turn_rate=1.0), [0.0, 0.5])


def test_it_wanders_through_free_space(building):
    robot, pose, seen = Wanderer(building, np.random.default_rng(5)), np.array([*building.nodes["store"], 1.0]), set()
    for _ in range(1500):
        pose = odometry.step(pose, robot.control(pose, 0.2), 0.2)
        seen.add(robot.goal)
        assert building.grid.at(pose[:2]) == maps.FREE
    assert len(seen) > 4
