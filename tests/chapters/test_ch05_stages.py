"""Stages of chapter 5: what they compute, against library and closed forms, and that each draws, fails, recovers."""

import numpy as np
import pytest

from labkit.calibration import hand_eye
from labkit.calibration.planning import field_problem
from labkit.chapters.ch05_hand_eye import stages as w
from labkit.documents.thesis.printed import corrections, measurements
from labkit.geometry import frames
from labkit.geometry.lie import exp_so3

ALL = (
    w.triangle,
    w.scan_line,
    w.difference_steps,
    w.convergence,
    w.two_methods,
    w.thirty_one_poses,
    w.pattern_designer,
)


@pytest.mark.parametrize("make", ALL)
def test_draws_fails_and_recovers(make, draws_fails_and_recovers):
    draws_fails_and_recovers(make)


def test_the_triangle_spreads_as_far_as_it_says_and_loses_rays_far_away():
    state = {"P": np.array([0.0, 240.0]), "base": 100, "std_deg": 0.05}
    result = w.compute_triangle(state)
    assert result["recovered"][:, 1].mean() == pytest.approx(240, abs=0.4)
    assert result["recovered"][:, 1].std() == pytest.approx(result["std"], rel=0.35)
    assert np.interp(240, w.HEIGHTS, result["errors"]) == pytest.approx(result["std"], rel=0.01)
    assert result["meet_deg"] == pytest.approx(np.rad2deg(np.arctan(100 / 240))) and result["lost"] == 0
    stage = w.triangle()
    stage.make_it_fail()
    assert stage.result["lost"] and "do not even meet" in stage.caption


def test_scan_line_recovers_the_center_and_its_spread():
    result = w.compute_scan_line({"C": np.array([15.0, 240.0]), "std": 0.1, "half_angle_deg": 60})
    assert result["recovered"].mean(0) == pytest.approx([15, 240], abs=0.1)
    assert result["recovered"][:, 0].std() == pytest.approx(result["std_y"], rel=0.3)
    assert result["impossible"] == 0


def test_scan_line_at_the_equator_says_nothing_about_y():
    near = w.compute_scan_line({"C": np.array([0.5, 240.0]), "std": 0.1, "half_angle_deg": 60})
    far = w.compute_scan_line({"C": np.array([15.0, 240.0]), "std": 0.1, "half_angle_deg": 60})
    assert near["impossible"] > 10 and near["std_y"] > 20 * far["std_y"]
    assert np.isinf(w.compute_scan_line({"C": np.array([0.0, 240.0]), "std": 0.1, "half_angle_deg": 60})["std_y"])


def test_steps_are_best_where_rounding_meets_curvature():
    result = w.compute_steps({"h": 5e-7})
    assert 1e-7 < result["best"]["forward"] < 1e-4 < result["best"]["central"] < 1e-2
    tiny = w.compute_steps({"h": 1e-13})
    assert tiny["at"]["forward"] > 1e4 * result["at"]["forward"]


def test_near_the_place_the_curve_is_its_tangent_then_it_bends_or_breaks_into_stairs():
    """In steps, so that the tangent has the slope 1: residuals of some 1000 mm have digits 1e-13 mm apart."""
    good, bent, broken = (w.compute_steps({"h": h})["curve"] for h in (1e-3, 10.0, 1e-13))
    np.testing.assert_allclose(good, w.AROUND, atol=1e-4)
    off = bent - w.AROUND
    np.testing.assert_allclose(off[::6], off[30 + 6] / 0.3**2 * w.AROUND[::6] ** 2, atol=0.04)  # a parabola, nearly
    assert abs(off[0]) > 0.1 and len(np.unique(broken)) < 15


def test_one_residual_at_many_steps_is_that_of_all_residuals_at_each():
    residual, exact, one, slope = w._turned()
    A = np.array([-0.3, 0.0, 1e-9, 2.0])
    everything = np.array([residual([a]) for a in A])
    number = np.argmin(np.abs(everything - one(A)[:, None]).max(0))
    np.testing.assert_allclose(everything[:, number], one(A), atol=1e-9)
    assert exact[number] == slope


def test_poses_in_which_nothing_is_undone_share_one_fit():
    w._edited_fit.cache_clear()
    for pose in (3, 7, 20):
        w.compute_poses({"click": np.array([pose, 0.0]), "slip": 0, "others": False, "fit": "robust"})
    assert w._edited_fit.cache_info().misses == 1


def test_the_ring_of_the_step_stands_on_the_curve_and_has_a_slider():
    stage = w.difference_steps()
    stage.set(P=(-3.0, 5.0))
    assert stage.state["h"] == pytest.approx(1e-3) and stage.reached
    assert stage.state["P"] == pytest.approx([-3.0, stage.result["at"]["central"]], rel=1e-6)
    stage.set(h=0.1)
    assert stage.state["P"][0] == pytest.approx(-1.0) and not stage.reached


def test_steps_on_the_pose_need_no_detour():
    result = w.compute_iterations({"tilt": -54.0, "yaw": -30.0, "B_deg": -30.0, "step": 1})
    assert result["euler"]["arrived"] and result["se3"]["arrived"]
    assert result["euler"]["steps"] > 2 * result["se3"]["steps"]
    assert result["euler"]["turned_deg"] > 4 * result["se3"]["turned_deg"]
    assert result["se3"]["path"][0] == pytest.approx([-54, -30], abs=1e-9)


def test_two_methods_from_the_dragged_start_and_from_a_printed_one():
    state = {"P": np.array([70.0, 60.0]), "number": 0, "radius": 10.0, "B_deg": -90.0}
    result = w.compute_methods(state)
    for path in result["paths"].values():
        assert path[0] == pytest.approx([70.0, 60.0]) and path[-1] == pytest.approx([0, 0], abs=1e-4)
    printed = w.compute_methods({**state, "number": 5})
    assert printed["paths"]["trust region"][0] == pytest.approx([0.0, 0.1], abs=1e-9)


def test_taking_a_printed_start_moves_the_handle_and_dragging_lets_go_of_it():
    stage = w.two_methods()
    stage.set(number=9)
    assert stage.state["P"] == pytest.approx([np.sqrt(70**2 + 75**2 + 50**2), 0.102], abs=1e-3)
    assert stage.caption.startswith("From start 9")
    stage.set(B_deg=-88.0)  # the truth moves away from the printed starts, and the handle stays at its cross
    assert stage.state["P"] == pytest.approx(stage.result["printed"][8])
    assert stage.state["P"] == pytest.approx(stage.result["paths"]["Gauss-Newton"][0])
    stage.set(P=(40, 30))
    assert stage.state["number"] == 0 and stage.caption.startswith("From the dragged start")
    stage.make_it_fail()
    assert "of them uphill; trust region" in stage.caption and "steps, never uphill" in stage.caption


def test_residuals_of_the_31_poses_follow_the_edits():
    state = {"click": np.array([3.2, 1.0]), "slip": 0, "others": False, "fit": "robust"}
    printed = w.compute_poses(state)
    assert printed["pose"] == 3 and printed["lengths"][2] == pytest.approx(18.27, abs=0.01)
    undone = w.compute_poses({**state, "slip": 1})
    assert undone["slip"].corrected == "1397.64" and undone["lengths"][2] < 0.6
    all_right = w.compute_poses({**state, "slip": 1, "others": True, "fit": "least squares"})
    corrected = measurements(True)
    fit = hand_eye.calibrate_sphere_target(corrected.T_BF, corrected.x_S)
    assert all_right["rms"] == pytest.approx(fit.rms, abs=1e-9)
    thesis = w.compute_poses({**state, "fit": "end pose", "others": True, "slip": 1})
    assert thesis["rms"] == pytest.approx(5.436, abs=0.01)


def test_every_misprint_is_offered_as_the_first_slip():
    for row in corrections():
        first = w._explained()[row["pose"] - 1][0]
        assert (first.table, first.column, float(first.corrected)) == (
            row["table"],
            row["column"],
            float(row["corrected"]),
        )


def test_innocent_poses_are_offered_no_slip():
    suspects = {row["pose"] for row in corrections()}
    assert {pose for pose, slips in enumerate(w._explained(), start=1) if slips} == suspects


def test_pattern_predicts_the_covariance_of_simulated_fits():
    state = {"E": np.array([25.0, 290.0]), "across": 25, "tilt_deg": 40}
    result = w.compute_pattern(state)
    rng, found, std = np.random.default_rng(0), [], w._corrected_fit().std
    for _ in range(150):
        seen = result["x_S"] + std * rng.normal(size=(31, 3))
        found.append(hand_eye.calibrate_sphere_target(result["T_BF"], seen).T_FS[:3, 3] - result["T_FS"][:3, 3])
    assert np.sqrt((np.array(found) ** 2).sum(1).mean()) == pytest.approx(result["std"][1], rel=0.15)
    assert field_problem(result["x_S"]) is None


def test_pattern_without_tilt_is_not_determined():
    result = w.compute_pattern({"E": np.array([25.0, 290.0]), "across": 25, "tilt_deg": 0})
    assert not result["determined"]
    x_S = frames.transform(
        frames.invert(result["T_FS"]), frames.transform(frames.invert(result["T_BF"]), result["target"])
    )
    J = hand_eye.joint_jacobian(result["T_BF"], x_S, result["T_FS"])
    assert np.abs(J @ result["unseen"].weakest).max() < 1e-6  # sliding along it changes nothing the scanner sees


def test_pattern_says_what_is_free():
    def caption(**state):
        return w._pattern_sentence(
            w.compute_pattern({"E": np.array([25.0, 290.0]), "across": 25, "tilt_deg": 30} | state)
        )

    one_place = np.array([0.0, 240.0])  # the sphere on one line of the field, along y
    assert "slide together in any direction" in caption(tilt_deg=0) and "turn about" not in caption(tilt_deg=0)
    assert "turn about the line" in caption(E=one_place) and "slide" not in caption(E=one_place)
    assert "in any direction, and the scanner can turn" in caption(E=one_place, tilt_deg=0)
    free = w.compute_pattern({"E": one_place, "across": 25, "tilt_deg": 30})
    turn = free["T_FS"] @ frames.pose(exp_so3([0, 0.01, 0]), np.zeros(3))
    turn[:3, 3] += free["T_FS"][:3, :3] @ ([0, 0, 240] - exp_so3([0, 0.01, 0]) @ [0, 0, 240])
    assert np.abs(hand_eye.sphere_residuals(free["T_BF"], free["x_S"], turn, free["target"])).max() < 1e-9


def test_scan_line_through_the_center_knows_no_y():
    result = w.compute_scan_line({"C": np.array([0.0, 240.0]), "std": 0.5, "half_angle_deg": 15})
    assert "y is not known at all" in w._scan_line_sentence(result)


def test_one_step_is_one_step():
    assert "1 step," in w._iterations_sentence(
        w.compute_iterations({"tilt": 0.0, "yaw": 0.0, "B_deg": -88.0, "step": 1})
    )


def test_convergence_opens_next_to_the_pole_where_the_detour_is_seen():
    stage = w.convergence()
    result = stage.result
    assert abs(stage.state["tilt"] - (-90.0 - stage.state["B_deg"])) < 2
    assert result["euler"]["arrived"] and result["euler"]["steps"] > 2 * result["se3"]["steps"]


def test_caption_of_a_pose_says_what_would_explain_it():
    stage = w.thirty_one_poses()
    assert stage.caption.startswith("Pose 3: residual 18.27 mm as printed, and a single slip would explain it.")
    stage.set(slip=1)
    assert stage.caption.startswith("Pose 3: residual 0.41 mm with x in C14 read as 1397.64 for 1379.64")
    stage.set(slip=6)
    assert "as printed: there is no slip no. 6, a single slip would explain it" in stage.caption
    stage.set(slip=0, click=(10.0, 1.0))
    assert "as printed, nothing to explain" in stage.caption


def test_captions_of_both_ways_to_converge_say_the_same_things():
    caption = w.convergence().caption
    assert caption.count("turning") == 2 and caption.count("of the largest") == 2


def test_what_is_always_wrong_changes_accuracy_alone():
    state = {"M": np.array([1.0, 0.5]), "backlash": 0.4, "around": False, "speed": 100}
    here, there = w.compute_accuracy(state), w.compute_accuracy({**state, "M": np.array([-1.5, 0.0])})
    assert here["repeatability"] == pytest.approx(there["repeatability"], rel=1e-9)
    assert there["accuracy"] - here["accuracy"] > 0.5
    around = w.compute_accuracy({**state, "around": True})
    assert around["repeatability"] > 2 * here["repeatability"]
    assert w.compute_accuracy({**state, "speed": 400})["path_accuracy"] > 2 * here["path_accuracy"]
