"""Stages of chapter 7 without a browser: what their pure functions compute, and that they move and fail as they say."""

import numpy as np
import pytest

from labkit.chapters.ch07_dead_reckoning import stages as drives
from labkit.localization import wheels

LAYOUT = {
    "A": np.array([1.0, 0.0]), "B": np.array([8.0, 0.0]), "C": np.array([4.0, 5.5]), "R": np.array([4.0, 3.0]),
    "S": np.array([6.0, 4.5]), "count": 2, "std": 0.0,
}  # fmt: skip


@pytest.mark.parametrize(
    "make",
    [drives.methods, drives.circles, drives.models, drives.drive, drives.banana, drives.reach],
    ids=lambda f: f.__name__,
)
def test_stage_moves_fails_and_comes_back(make):
    stage = make()
    caption, picture = stage.caption, stage.png()
    stage.make_it_fail()
    if make is drives.drive:
        stage.set(t=3.0)
    assert stage.status == "" and stage.caption != caption and stage.png() != picture
    stage.reset()
    assert stage.caption == caption and stage.png() == picture


def test_only_lateration_survives_being_carried_off():
    near = drives.compute_methods({"task": "local", "sensor": "odometry", "map": "none"})["usable"]
    assert near == ["dead reckoning"]
    lost = drives.compute_methods({"task": "global", "sensor": "both", "map": "known"})["usable"]
    assert lost == ["lateration", "particle filter"]


@pytest.mark.parametrize("count", [2, 3])
def test_circles_without_noise_end_at_the_robot(count):
    result = drives.compute_circles(LAYOUT | {"count": count})
    assert result["error"] < 1e-6
    np.testing.assert_allclose(result["cloud"], np.tile(LAYOUT["R"], (drives.REPETITIONS, 1)), atol=1e-3)


def test_circles_on_one_line_report_instead_of_raising():
    result = drives.compute_circles(LAYOUT | {"R": np.array([4.0, 0.0]), "S": np.array([6.0, 0.0]), "std": 0.1})
    assert "one line" in result["reason"] and len(result["ellipse"]) == 0 and np.isinf(result["dilution"])
    np.testing.assert_allclose(np.abs(result["weak"][1] - result["weak"][0]), [0, 2.4], atol=1e-12)


def test_models_have_slope_one_and_two():
    result = drives.compute_models({"count": 8, "omega_deg": 40.0})
    for model, order in (("euler", 1), ("midpoint", 2)):
        slope = np.diff(np.log(result["errors"][model])) / np.diff(np.log(drives.DURATION / drives.COUNTS))
        np.testing.assert_allclose(slope[-3:], order, atol=0.06)


def test_others_drive_the_same_circle_and_are_gone_where_keys_lead_elsewhere():
    stage = drives.drive()
    paths = stage.result["others"].reshape(drives.OTHERS, -1, 2)
    assert paths.shape[1] == len(stage.result["truth"]) + 1 and np.isnan(paths[:, -1]).all()
    ends, robot = paths[:, -2], stage.result["truth"][-1, :2]
    assert np.abs(paths[:, 0]).max() == 0 and 0.05 < np.linalg.norm(ends - robot, axis=1).mean() < 1.0
    spread = np.ptp(ends, axis=0).sum()
    stage.set(factor=2.0)
    assert np.ptp(stage.result["others"].reshape(drives.OTHERS, -1, 2)[:, -2], axis=0).sum() > 1.5 * spread
    stage.receive({"arrows": ["up"]})
    assert len(stage.result["others"]) == 0


def test_arrow_keys_drive():
    stage = drives.drive()
    stage.set(t=0.0)
    for key in ("up", "up", "left", "up", "down", "right"):
        stage._apply({}, [key])
    assert len(stage.result["truth"]) == 1 + 6 * drives.KEY_STEPS
    assert stage.result["std"] > 0.01


def test_playing_is_the_lectures_circle():
    stage = drives.drive()
    stage.set(t=14.0)
    np.testing.assert_allclose(stage.result["estimate"][-1], [-0.96655, 0.2267, 5.86431], atol=1e-4)


def test_bent_region_holds_its_share_and_the_ellipse_does_not():
    state = {"path": "straight", "factor": 2.0}
    bent = drives.compute_banana(state | {"region": "bent"})
    flat = drives.compute_banana(state | {"region": "ellipse"})
    assert 0.92 < bent["share"] < 0.97 and flat["share"] < 0.85


def test_circles_start_with_both_meeting_points_in_the_picture():
    stage = drives.circles()
    (low_x, high_x), (low_y, high_y) = (-4.0, 14.8), (-5.4, 6.4)
    for name in ("A", "B"):
        radius = np.linalg.norm(LAYOUT["R"] - LAYOUT[name])
        assert low_x < LAYOUT[name][0] - radius and LAYOUT[name][0] + radius < high_x
        assert low_y < LAYOUT[name][1] - radius and LAYOUT[name][1] + radius < high_y
    stage.set(**{"S": (6.0, -2.5)})
    end = stage.result["path"][-1]
    np.testing.assert_allclose(end, [4.0, -3.0], atol=0.5)


def test_straight_on_is_said_in_words_and_not_as_rounding():
    stage = drives.models()
    stage.set(omega_deg=0.0)
    assert "same point" in stage.caption and "e-" not in stage.caption


def test_fourteen_meters_straight_on_stay_in_the_picture_and_more_do_not():
    stage = drives.drive()
    stage.set(factor=0.2, t=0.0)
    for _ in range(35):
        stage._apply({}, ["up"])
    assert stage.result["estimate"][-1][0] == pytest.approx(14.0)
    assert "left the picture" not in stage.caption
    for _ in range(5):
        stage._apply({}, ["up"])
    assert "left the picture" in stage.caption


def test_only_mecanum_wheels_park_sideways():
    found = drives.compute_reach({"G": (0.0, 1.0), "heading_deg": 0.0})["drives"]
    assert found["Mecanum"]["away"] < 1e-6 and found["Mecanum"]["turned_deg"] < 1e-3
    assert all(found[drive]["away"] + found[drive]["turned_deg"] / 100 > 0.5 for drive in ("differential", "Ackermann"))


def test_only_the_car_cannot_turn_on_the_spot():
    found = drives.compute_reach({"G": (0.0, 0.0), "heading_deg": 180.0})["drives"]
    assert [drive for drive in drives.DRIVES if found[drive]["turned_deg"] > 1] == ["Ackermann"]


@pytest.mark.parametrize("name", drives.DRIVES)
def test_a_spot_that_one_command_reaches_is_reached(name):
    """Poses the drive itself ends in; and no path drawn or found is longer than its limits allow."""
    drive = drives.DRIVES[name]
    for share in np.random.default_rng(4).uniform(-1, 1, (5, drive.numbers)):
        spot = wheels.step_twist(np.zeros(3), drive.twist(share), drives.HELD)
        found = drives.compute_reach({"G": tuple(spot[:2]), "heading_deg": np.degrees(spot[2])})["drives"][name]
        assert found["away"] < 0.01 and found["turned_deg"] < 1
        np.testing.assert_allclose(found["path"][0], 0)
    lengths = np.linalg.norm(np.diff(drives.fan(drive), axis=1), axis=2).sum(1)
    assert lengths.max() <= drives.HELD * drives.SPEED + 1e-9
