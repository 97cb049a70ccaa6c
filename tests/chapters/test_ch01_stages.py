"""Stages of chapter 1: what they compute, against closed forms and SciPy, and that each draws, fails and recovers."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from labkit.chapters.ch01_frames import stages as w
from labkit.geometry import frames
from labkit.stage.scene3d import View

ALL = (w.three_points, w.triangle_noise, w.kuka_gimbal, w.svd_against_gram_schmidt)


@pytest.mark.parametrize("make", ALL)
def test_draws_fails_and_recovers(make, draws_fails_and_recovers):
    draws_fails_and_recovers(make)


def state_of_sheet(**changes):
    return {**{name: np.array(at) for name, at in w.sheet_points().items()}, **changes}


def test_removed_and_kept_make_up_the_arm():
    result = w.compute_three_points(state_of_sheet(Y0=np.array([1.8, 2.9, 0.0])))
    assert result["removed"][0] ** 2 + result["kept"][0] ** 2 == pytest.approx((1.8 - 1.01) ** 2 + 0.9**2)


def test_three_points_gives_the_sheets_frames():
    result = w.compute_three_points(state_of_sheet())
    assert result["K0_T_K1"] == pytest.approx(frames.relative(*result["frames"]))
    for T, points, foot in zip(result["frames"], result["points"], result["feet"]):
        assert (points[2] - foot) @ T[:3, 0] == pytest.approx(0, abs=1e-12)  # what is kept is perpendicular
        removed = np.cross(foot - points[0], T[:3, 0])
        assert removed == pytest.approx(np.zeros(3), abs=1e-12)  # what is removed lies along x


def test_three_points_removes_the_part_along_x():
    result = w.compute_three_points(
        state_of_sheet(O0=np.zeros(3), X0=np.array([2.0, 0, 0]), Y0=np.array([0.7, 0.4, 0]))
    )
    assert result["feet"][0] == pytest.approx([0.7, 0.0, 0.0])
    assert result["frames"][0] == pytest.approx(np.eye(4))


def test_a_point_lifted_out_of_the_plane_turns_the_frame_about_its_x_axis():
    points = {"O0": np.zeros(3), "X0": np.array([2.0, 0, 0]), "Y0": np.array([0.7, 0.3, 0.4])}
    result = w.compute_three_points(state_of_sheet(**points))
    assert result["kept"][0] == pytest.approx(0.5) and result["removed"][0] == pytest.approx(0.7)
    axes = result["frames"][0][:3, :3].T
    assert axes == pytest.approx(np.array([[1, 0, 0], [0, 0.6, 0.8], [0, -0.8, 0.6]]))


def test_three_points_roll_matches_repetitions():
    state = state_of_sheet(Y0=np.array([1.4, 2.5, 0.3]))
    rng = np.random.default_rng(3)
    points = w.compute_three_points(state)["points"][0]
    noisy = points + w.NOISE_OF_A_TAPE * rng.standard_normal((20000, 3, 3))
    T = frames.frame_from_points(*np.moveaxis(noisy, 1, 0))
    true = frames.frame_from_points(*points)
    errors = Rotation.from_matrix(true[:3, :3].T @ T[:, :3, :3]).as_rotvec(degrees=True)
    assert w.compute_three_points(state)["roll_deg"][0] == pytest.approx(errors[:, 0].std(), rel=0.03)


def test_three_points_flat_and_collinear():
    stage = w.three_points()
    stage.make_it_fail()
    assert "next to nothing" in stage.caption
    stage.set(Y0=(1.5, 2.0, 0.0))
    assert "collinear" in stage.status
    stage.set(Y0=(1.5, 1.5, 0.0))  # on the other side: z turns away from us
    assert stage.status == "" and stage.result["frames"][0][2, 2] == pytest.approx(-1)


def test_noise_reaches_its_bound():
    result = w.compute_triangle_noise({"Y": np.array([30.0, 60.0, 0.0]), "std": 0.2}, repetitions=20000)
    assert result["error_deg"] == pytest.approx(result["bound_deg"], rel=0.03)
    assert result["bound_deg"][1] == pytest.approx(np.rad2deg(np.sqrt(2) * 0.2 / w.ARM))
    k = np.argmin(np.abs(w.HEIGHTS - 60))
    assert result["bounds_deg"][k, 0] == pytest.approx(result["bound_deg"][0], rel=0.2)


def test_flat_triangles_roll():
    tall, flat = (w.compute_triangle_noise({"Y": np.array([30.0, h, 0.0]), "std": 0.2}) for h in (50.0, 5.0))
    assert flat["error_deg"][0] == pytest.approx(10 * tall["error_deg"][0], rel=0.05)
    assert flat["error_deg"][1:] == pytest.approx(tall["error_deg"][1:], rel=0.01)


def test_y_stays_in_the_plane_of_the_triangle():
    stage = w.triangle_noise()
    view = stage.state["view"]
    aim = view.project((50, 40, 0))[:2]
    at = stage._picture.fraction(stage.figure.axes[0], aim)
    stage.receive({"drag": {"Y": at}})
    assert stage.state["Y"] == pytest.approx([50, 40, 0], abs=1e-9)
    stage.set(view=View(0, 0, center=view.center), Y=(40, 30, 5))  # seen from the side: straight down
    assert stage.state["Y"] == pytest.approx([40, 30, 0])


def test_gimbal_pose_and_read_back():
    result = w.compute_kuka_gimbal({"A_deg": 40, "B_deg": 30, "C_deg": 20})
    oracle = Rotation.from_euler("ZYX", [40, 30, 20], degrees=True).as_matrix()
    assert result["T"][:3, :3] == pytest.approx(oracle)
    assert result["read_back_deg"] == pytest.approx([40, 30, 20])
    assert result["singular_values"] == pytest.approx(np.sqrt([1.5, 1.0, 0.5]))  # sqrt(1 +- sin B) and 1


def test_gimbal_axes_are_the_derivatives_of_the_pose():
    angles, h = np.array([40.0, 30.0, 20.0]), 1e-4
    axes = w.compute_kuka_gimbal(dict(zip(("A_deg", "B_deg", "C_deg"), angles)))["axes"]
    for k in range(3):
        before, after = (Rotation.from_euler("ZYX", angles + s * h * np.eye(3)[k], degrees=True) for s in (-1, 1))
        assert (after * before.inv()).as_rotvec(degrees=True) / (2 * h) == pytest.approx(axes[k], abs=1e-6)


@pytest.mark.parametrize("pole", [90, -90])
def test_at_the_pole_a_and_c_trade_places(pole):
    first = w.compute_kuka_gimbal({"A_deg": 60, "B_deg": pole, "C_deg": 20})
    second = w.compute_kuka_gimbal({"A_deg": 60 + 25, "B_deg": pole, "C_deg": 20 + np.sign(pole) * 25})
    assert first["T"] == pytest.approx(second["T"], abs=1e-12)
    assert first["singular_values"][2] < 1e-9
    assert first["null"] == pytest.approx([np.sqrt(0.5), 0, np.sign(pole) * np.sqrt(0.5)])
    assert frames.matrix_from_kuka([0, 0, 0, *np.deg2rad(first["read_back_deg"])]) == pytest.approx(
        first["T"], abs=1e-12
    )


def test_gimbal_presets_show_the_same_pose():
    stage = w.kuka_gimbal()
    stage.make_it_fail()
    pose = stage.result["T"]
    assert "A - C = 40 deg" in stage.caption
    stage.press("A and C trade places")
    assert stage.result["T"] == pytest.approx(pose, abs=1e-12)


def test_svd_and_gram_schmidt_reach_their_bounds():
    state = {"X": np.array([100.0, 0]), "Y": np.array([30.0, 60.0]), "std": 0.3}
    result = w.compute_svd_against_gram_schmidt(state, repetitions=20000)
    for name in ("gram_schmidt", "svd"):
        assert result[f"{name}_deg"] == pytest.approx(result[f"{name}_bound_deg"], rel=0.03)
    assert (result["svd_bound_deg"] <= result["gram_schmidt_bound_deg"] + 1e-12).all()
