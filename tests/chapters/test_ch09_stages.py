"""Chapter 9's Stages without a browser: what they compute, and what happens when they are driven."""

import numpy as np
import pytest

from labkit.chapters.ch09_monte_carlo import stages
from labkit.documents.lecture.examples import load_building
from labkit.localization import maps, particles
from labkit.localization.sensors import SENSORS

NAMES = ("corridor", "map_forms", "field_against_beams", "wheel", "standing", "twelve_pictures", "soccer", "arena")


@pytest.fixture(autouse=True)
def strict(monkeypatch):
    monkeypatch.setenv("LABKIT_STRICT", "1")


@pytest.mark.parametrize("name", NAMES)
def test_stage_is_built_fails_and_comes_back(name):
    stage = getattr(stages, name)()
    before = stage.caption
    stage.make_it_fail()
    stage.reset()
    assert stage.caption == before and stage.status == "" and stage.png()[:4] == b"\x89PNG"


def corridor(**changes):
    state = {"D1": (2, 0), "D2": (4, 0), "D3": (9, 0), "robot": (2, 1), "move": 2.0, "std": 0.1}
    return stages.compute_corridor({**state, **changes})


def test_corridor_finds_the_robot_by_its_second_look():
    result = corridor()
    assert result["said"] == [True, True] and result["near"] > 0.5
    assert [round(truth) for _, _, truth in result["shots"]] == [2, 2, 4, 4, 6]
    assert corridor(D3=(6, 0))["near"] < result["near"]  # evenly spaced doors cannot be told apart
    assert corridor(robot=(3, 1))["said"] == [False, False]


def test_the_corridor_ends_at_a_wall():
    result = corridor(robot=(11.9, 1), move=4.0)
    assert [truth for _, _, truth in result["shots"]] == [11.9, 11.9, 12.0, 12.0, 12.0]
    assert all((np.clip(x, 0, 12) == x).all() for x, _, _ in result["shots"])


def maps_at(x, y):
    return stages.compute_maps({"probe": np.array([x, y])})


def test_six_maps_answer_one_question():
    """In the hall, 1.5 m above the outer wall y = 0, no other wall as near: all forms agree on it."""
    b, result = load_building(), maps_at(8.4, 1.5)
    assert result["answers"]["occupancy grid"] == "free" and result["answers"]["graph"] == "near “hall”"
    assert result["means"]["lines"] == pytest.approx([8.4, 0.0])
    assert np.hypot(*(result["means"]["points"] - [8.4, 1.5])) == pytest.approx(1.5, abs=0.15)
    assert result["free_by"] == pytest.approx(1.5, abs=0.15)
    assert stages.stored()["lines"] == b.lines.size and stages.stored()["points"] == b.points.size
    assert maps_at(-1.0, 2.4)["answers"]["distance field"] == "beyond the map"
    assert maps_at(15.6, 9.8)["answers"]["occupancy grid"] == "unknown" and maps_at(15.6, 9.8)["free_by"] == 0


def test_likelihood_field_likes_wrong_rooms_better_than_the_beam_model():
    """What the prediction `field` asks: median over poses of the best log weight more than 2 m away."""
    poses = particles.uniform_states(load_building().grid, 12, np.random.default_rng(0))
    elsewhere = []
    for pose in poses:
        state = {"robot": pose[:2], "heading_deg": np.rad2deg(pose[2]), "scan": "as mapped", "beams": "mixture"}
        result = stages.compute_heat(state)
        elsewhere.append((result["beams_elsewhere"], result["field_elsewhere"]))
    beams, field = np.median(elsewhere, axis=0)
    assert field > beams + 5


def test_plain_beams_find_every_place_impossible_with_an_echo_missing():
    state = {"robot": np.array([8.4, 2.4]), "heading_deg": 20, "scan": "as mapped", "beams": "plain"}
    result = stages.compute_heat(state)
    assert not result["beams_possible"] and result["field_off"] < 0.4
    stage = stages.field_against_beams()
    stage.set(robot=(7.9, 8.8))
    assert "in a wall" in stage.caption


def wheel_state(method, weights, turn=0.3):
    return {"method": method, "turn": turn, **{f"W{k + 1}": np.array([k + 1, w]) for k, w in enumerate(weights)}}


def test_wheel_counts_follow_the_library():
    weights = np.array([0.1, 0.7, 0.1, 0.3, 0.5, 0.2])
    result = stages.compute_wheel(wheel_state("spoke wheel", weights))
    share = 6 * weights / weights.sum()
    assert result["counts"].sum() == 6 and (np.abs(result["counts"] - share) < 1).all()
    binomial = (share * (1 - share / 6)).sum()
    assert result["variances"]["roulette"] == pytest.approx(binomial, rel=0.15)
    assert result["variances"]["spoke wheel"] < 0.5 * binomial


def test_equal_weights_on_the_wheel():
    equal = np.full(6, 0.5)
    assert (stages.compute_wheel(wheel_state("spoke wheel", equal))["counts"] == 1).all()
    assert (stages.compute_wheel(wheel_state("roulette", equal))["counts"] > 0).sum() < 6


def test_the_wheel_of_zero_weights_draws_nothing():
    stage = stages.wheel()
    stage.set(**{f"W{k}": (k, 0.0) for k in range(1, 7)})
    assert "nothing to draw" in stage.caption and stage.status == ""
    assert not stage.result["counts"].any() and stage.png()[:4] == b"\x89PNG"


def test_standing_robot_keeps_about_two_m_over_t_ancestors():
    result = stages.compute_standing({"rounds": 200})
    assert 4 <= result["left"]["roulette"][-1] <= 20 and result["left"]["spoke wheel"][-1] == 1000
    assert len(result["clouds"]["roulette"]) == result["left"]["roulette"][-1]


def test_twelve_pictures_end_right_with_many_and_wrong_with_few_particles():
    assert stages.compute_twelve({"particles": 5000, "t": 5.5})["error"] < 0.3
    assert stages.compute_twelve({"particles": 200, "t": 5.5})["error"] > 1.0
    assert stages.compute_twelve({"particles": 5000, "t": 0.0})["number"] == 1


def test_soccer_errors_are_the_distances_of_the_paths():
    rms = {}
    for reads in stages.READINGS:
        result = stages.compute_soccer({"reads": reads, "t": 47.6})
        rms[reads] = np.sqrt((result["errors"]["MCL"] ** 2).mean())
        tail = np.hypot(*(result["estimates"] - result["truth"][1:])[:, :2].T)
        np.testing.assert_allclose(result["errors"]["MCL"][-len(tail) :], tail)
        assert len(tail) == stages.TAIL + 1 and len(result["others"]) == 4
    assert rms["range and bearing"] < 0.15 and rms["range only"] < 0.25 and rms["bearing only"] < 0.25
    assert rms["nothing"] > 2 * rms["range and bearing"]


def drive(stage, *events):
    for event in events:
        stage._apply({}, events=[event])
    return stage.result


def stroke(stage, *points):
    for k in range(1, len(points) + 1):
        stage._apply({"brush": np.array(points[:k], dtype=float)}, events=["brush"])
    return stage.result


def until_right(stage, ticks=400):
    """Ticks until the estimate lies within 0.5 m of the robot, or None."""
    return next((k for k in range(ticks) if drive(stage, "tick")["errors"][-1] < 0.5), None)


@pytest.mark.parametrize("model", SENSORS)
def test_arena_localizes_and_recovers_from_kidnapping(model):
    """60 ticks suffice with a probability of 0.9 at least (data/monte_carlo/success.csv), so 400 but for 3e-7."""
    stage = stages.arena()
    stage.set(model=model, particles=5000, resampler="spoke wheel + recovery")
    assert until_right(stage) is not None
    home = stage.result["pose"].copy()
    result = stroke(stage, home[:2], (3.2, 8.0))
    np.testing.assert_allclose(result["pose"][:2], (3.2, 8.0))
    assert len(result["disks"]) == 0 and result["off"] > 2
    assert until_right(stage) is not None


def test_arena_without_recovery_stays_kidnapped():
    stage = stages.arena()
    drive(stage, *["tick"] * 25)
    stroke(stage, stage.result["pose"][:2], (13.0, 8.0))
    assert drive(stage, *["tick"] * 20)["errors"][-1] > 2.0


def test_arena_keys_walls_and_obstacles():
    stage = stages.arena()
    start = stage.result["pose"].copy()
    moved = drive(stage, "up", "left", "right")["pose"]
    np.testing.assert_allclose(np.hypot(*(moved - start)[:2]), 0.3)
    result = stroke(stage, (13.0, 1.0), (13.5, 1.0), (14.0, 1.2))
    gaps = np.hypot(*np.diff(result["disks"][:, :2], axis=0).T)
    assert len(gaps) > 5 and gaps.max() < 0.16 and (result["pose"] == moved).all()
    np.testing.assert_allclose(result["disks"][[0, -1], :2], [(13.0, 1.0), (14.0, 1.2)])
    for _ in range(60):
        result = drive(stage, "up")
        assert load_building().grid.at(result["pose"][:2]) == maps.FREE


def test_a_click_into_the_arena_only_takes_the_focus():
    stage = stages.arena()
    pose = stage.result["pose"].copy()
    assert len(stroke(stage, (13.0, 1.0))["disks"]) == 0
    assert (stroke(stage, pose[:2])["pose"] == pose).all()
    stage._apply({"brush": np.array([(13.0, 1.0), (13.0, 2.2)])}, events=["brush"])  # a fast stroke: two points at once
    assert len(stage.result["disks"]) > 6


def test_a_carried_robot_leaves_its_scan_and_the_caption_says_how_far_off_the_estimate_is():
    stage = stages.arena()
    drive(stage, *["tick"] * 25)
    assert len(stage.result["ends"]) > 20
    result = stroke(stage, stage.result["pose"][:2], (13.0, 8.0))
    assert len(result["ends"]) == 0 and result["off"] > 2
    assert f"Off by {result['off']:.2f} m" in stage.caption


def test_arena_changes_its_number_of_particles_while_it_runs():
    stage = stages.arena()
    drive(stage, "tick")
    for count in (20_000, 100, 10_000):
        stage.set(particles=count)
        assert len(drive(stage, "tick")["states"]) == count


def test_the_arena_begins_with_an_error():
    """No picture begins empty: the densest place of the first cloud is an estimate, and a wrong one."""
    stage = stages.arena()
    (first,) = stage.result["errors"]
    assert first == pytest.approx(stage.result["off"]) and first > 0.5 and f"{first:.2f} m off" in stage.caption
