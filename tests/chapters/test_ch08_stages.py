"""Stages of chapter 8 without a browser: what their pure functions compute, and that they move and fail as they say."""

import numpy as np
import pytest
from scipy.stats import chi2

from labkit.chapters.ch08_kalman import stages
from labkit.estimation import kalman


@pytest.mark.parametrize("make", [stages.bells, stages.vehicle, stages.arena, stages.honesty], ids=lambda f: f.__name__)
def test_stage_moves_fails_and_comes_back(make):
    stage = make()
    caption, picture = stage.caption, stage.png()
    stage.make_it_fail()
    if make is stages.arena:
        stage.set(t=2.0)
    assert stage.status == "" and stage.caption != caption and stage.png() != picture
    stage.reset()
    assert stage.caption == caption and stage.png() == picture


def test_bells_weigh_by_one_over_variance():
    state = {"std0": 3.0, "std_u": 3.0, "z": np.array([9.0, 4.0])}
    _, measured, (mean, std) = stages.compute_bells(state)["bells"]
    np.testing.assert_allclose(measured, [9.0, 1 / (4 * np.sqrt(2 * np.pi))])
    weights = np.array([1 / 18, 1 / measured[1] ** 2])
    np.testing.assert_allclose([mean, std], [weights @ [7, 9] / weights.sum(), weights.sum() ** -0.5])


def test_vehicle_settles_at_the_riccati_gain_and_loses_sight_in_a_dropout():
    result = stages.compute_vehicle({"std_a": 0.4, "std_z": 0.5, "dropout": False})
    A, B, C = kalman.vehicle_model(stages.DT)
    settled = kalman.steady_state(A, C, 0.16 * B @ B.T + 1e-12 * np.eye(2), [[0.25]])
    np.testing.assert_allclose(result["gain"][-1], settled.gain[:, 0], rtol=0.02)
    blind = stages.compute_vehicle({"std_a": 0.4, "std_z": 0.5, "dropout": True})
    assert blind["std"][74, 0] > 3 * result["std"][74, 0]
    assert np.isnan(blind["measured"][60]) and np.isfinite(blind["measured"][80])


@pytest.mark.parametrize("dropout", [False, True])
def test_every_belief_is_judged_as_its_own_filter(dropout):
    """The curve on the right is stepped for all beliefs at once; each of its points is a filter of its own."""
    low, high = stages.compute_vehicle({"std_a": 0.4, "std_z": 0.5, "dropout": dropout})["band"]
    for k, std in list(enumerate(stages.STDS_Z))[::6]:
        result = stages.compute_vehicle({"std_a": 0.4, "std_z": float(std), "dropout": dropout})
        assert result["others"][k] == pytest.approx(result["nis"], rel=1e-9)
        assert stages._is_honest(result) == (low < result["nis"] < high)
    assert (np.diff(result["others"]) < 0).all()  # the more noise is believed, the less surprises


def test_the_bracket_and_its_slider_are_one():
    stage = stages.vehicle()
    assert stage.state["P"] == pytest.approx([stages.BRACKET, 2.0])
    stage.set(P=(3.0, 1.0))
    assert stage.state["std_z"] == pytest.approx(0.5) and stage.state["P"][0] == stages.BRACKET and stage.reached
    stage.set(std_z=0.3)
    assert stage.state["P"][1] == pytest.approx(0.6) and not stage.reached


def scores(**changes):
    """NEES of 270 steps of the circle."""
    state = {"L1": np.array([5.0, 5.0]), "L2": np.array([-4.0, 5.5]), "count": 1, "factor": 1.0, "wrap": True} | changes
    state["memory"] = stages._start_arena(state)
    for _ in range(270):
        state["memory"] = stages._advance_arena(state, "tick")
    return stages.compute_arena(state)["nees"]


def test_arena_is_honest_until_it_forgets_to_wrap():
    assert (scores(count=2) > chi2.ppf(0.995, 3)).mean() < 0.05
    assert scores(count=2, wrap=False).max() > 1000
    assert (scores(factor=0.2) > chi2.ppf(0.995, 3)).mean() > 0.5


def test_arena_takes_keys_and_dragged_landmarks():
    stage = stages.arena()
    stage.set(t=0.0)
    for key in ("up", "left", "up", "right", "down"):
        stage._apply({}, [key])
    stage.set(L1=(3.0, 6.0))
    stage._apply({}, ["up"])
    assert len(stage.result["nees"]) == 6 * stages.KEY_STEPS
    np.testing.assert_array_equal(stage.result["landmarks"], [[3.0, 6.0]])


def test_honesty_is_lost_with_a_precise_sensor_and_comes_back_by_iterating():
    low, high = kalman.mean_band(3, stages.RUNS)
    easy = stages.compute_honesty({"std_prior": 0.3, "std_range": 0.1, "iterations": 1})
    hard = stages.compute_honesty({"std_prior": 1.0, "std_range": 0.01, "iterations": 1})
    cured = stages.compute_honesty({"std_prior": 1.0, "std_range": 0.01, "iterations": 6})
    assert low < easy["nees"] < high and hard["nees"] > 100 and low < cured["nees"] < high


def test_bells_start_as_the_prediction_says_equally_sure_and_2_m_apart():
    (x, std), (z, std_z), _ = stages.bells().result["bells"]
    assert z - x == pytest.approx(2.0) and std_z == pytest.approx(std, rel=1e-6)


def test_arena_says_when_the_robot_has_left_the_picture():
    stage = stages.arena()
    stage.set(t=0.0)
    for _ in range(16):
        stage._apply({}, ["up"])
    assert "left the picture" not in stage.caption
    for _ in range(3):
        stage._apply({}, ["up"])
    assert "left the picture" in stage.caption


def test_making_the_arena_fail_fails_at_once_and_says_why():
    stage = stages.arena()
    assert len(stage.result["nees"]) == 60 and stage.result["error"] < 0.1
    stage.make_it_fail()
    assert stage.result["error"] > 0.4 and stage.result["nees"].max() > 500
    assert "jumped by a whole turn" in stage.caption
    stage.reset()
    assert "jumped" not in stage.caption and len(stage.result["nees"]) == 60
