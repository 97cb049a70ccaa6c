"""Stages of chapter 3: what they compute, against closed forms and the library; each draws, fails, recovers."""

import numpy as np
import pytest

from labkit.calibration import pivot
from labkit.chapters.ch03_quirlen import stages as w


@pytest.mark.parametrize("make", [w.pose_designer, w.swirl, w.outliers])
def test_draws_fails_and_recovers(make, draws_fails_and_recovers):
    draws_fails_and_recovers(make)


def design(directions, spin_deg=0.0, std_rot_deg=0.1):
    state = {f"D{k}": np.array(d) for k, d in enumerate(directions, start=1)}
    return w.compute_pose_designer({**state, "spin_deg": spin_deg, "std_rot_deg": std_rot_deg})


def test_designer_predicts_what_a_calibration_finds():
    directions = w._ring(25.0)
    result = design(directions, spin_deg=20.0)
    R = pivot.tilted(directions, np.deg2rad(20.0) * np.arange(6))
    T = pivot.touching_poses(R, w.TIP, np.zeros(3))
    assert result["singular_values"] == pytest.approx(pivot.calibrate_pivot(T).singular_values)
    rng, errors = np.random.default_rng(1), []
    for _ in range(1500):
        noisy = pivot.touching_poses(R, w.TIP, np.zeros(3), np.deg2rad(0.1), w.STD_TRANS, rng)
        errors.append(pivot.calibrate_pivot(noisy, np.deg2rad(0.1), w.STD_TRANS).tip - w.TIP)
    found = np.sqrt(np.linalg.eigvalsh(np.cov(np.transpose(errors))))[::-1]
    np.testing.assert_allclose(result["deviations"], found, rtol=0.08)
    assert np.linalg.eigvalsh(result["covariance_seen"])[::-1] == pytest.approx(result["deviations"] ** 2)


def test_designer_finds_the_null_vector():
    spin = design([(0.0, 0.0, 1.0)] * 6, spin_deg=60.0)
    assert spin["undetermined"] and spin["null"] == pytest.approx([0, 0, 1])
    assert spin["singular_values"][5] == pytest.approx(0, abs=1e-9)
    hinge = design([(np.sin(a), 0.0, np.cos(a)) for a in np.linspace(-0.8, 0.8, 6)])
    assert hinge["undetermined"] and np.abs(hinge["null"]) == pytest.approx([0, 1, 0], abs=1e-9)  # the hinge's axis
    assert not design(w._ring(3.0), std_rot_deg=0.1)["undetermined"]
    assert design(w._ring(0.1), std_rot_deg=0.1)["undetermined"]  # a tilt like the noise says nothing


def test_designer_keeps_directions_on_the_sphere():
    stage = w.pose_designer()
    stage.set(D1=(3.0, 4.0, -2.0))
    assert np.linalg.norm(stage.state["D1"]) == pytest.approx(1) and stage.state["D1"][2] > 0


def swirl(t, cone_deg=25.0, std_trans=0.2):
    return w.compute_swirl({"t": t, "cone_deg": cone_deg, "std_trans": std_trans})


def test_swirl_is_the_calibration_of_the_first_poses():
    result = swirl(2.0)
    _, T = w._swirl(25.0, 0.2, np.deg2rad(w.SWIRL_STD_ROT_DEG))
    expected = pivot.calibrate_pivot(T[: result["n"]])
    assert result["n"] == 23
    assert result["residual"] == pytest.approx(expected.s0)
    assert result["error"] == pytest.approx(np.linalg.norm(expected.tip - w.TIP))
    assert result["deviation"] == pytest.approx(np.sqrt(np.trace(expected.covariance[:3, :3])))
    assert result["ratio"] == pytest.approx(expected.singular_values[5] / expected.singular_values[0])


def test_swirl_spin_only_has_a_small_residual_and_a_large_error():
    wide, spin = swirl(5.7), swirl(5.7, cone_deg=0.0)
    assert wide["error"] < 0.3 and spin["error"] > 30
    assert spin["residual"] == pytest.approx(wide["residual"], rel=0.3)


def test_outliers_move_the_plain_tip_alone():
    places = {f"pose {k + 1}": np.array(w._where_tip(k)) for k in w.DRAGGED}
    clean = w.compute_outliers(places)
    assert clean["error_plain"] < 0.4 and clean["error_robust"] < 0.4
    spoiled = w.compute_outliers({**places, "pose 2": np.array([14.0, 10.0])})
    assert spoiled["error_plain"] > 5 * spoiled["bound"] > spoiled["error_robust"]
    assert spoiled["weights"][1] == 0 and np.count_nonzero(spoiled["weights"]) == 11
    assert spoiled["touches"][1] == pytest.approx([14.0, 10.0], abs=0.01)


@pytest.mark.parametrize("make", [w.swirl, w.outliers])
def test_words_below_the_bars_stand_on_one_baseline(make):
    stage = make()
    stage.png()
    words = [tick.label1 for tick in stage._picture.fig.axes[1].xaxis.get_major_ticks()]
    baselines = {round(word.get_transform().transform(word.get_position())[1], 6) for word in words}
    assert len(baselines) == 1 and {word.get_va() for word in words} == {"baseline"}
    renderer, axes = stage._picture.canvas.get_renderer(), stage._picture.fig.axes[1]
    assert all(word.get_window_extent(renderer).y0 > 0 for word in words)
    assert all(word.get_window_extent(renderer).y1 < axes.bbox.y0 for word in words)


def test_a_large_ellipsoid_is_cut_at_the_sphere_and_said_to_be():
    stage = w.pose_designer()
    assert "cut" not in stage.caption
    small = np.linalg.eigvalsh(stage.result["covariance_seen"])
    assert np.sqrt(small) == pytest.approx(stage.result["deviations"][::-1])
    stage.set(**{f"D{k}": tuple(d) for k, d in enumerate(w._ring(3.0), start=1)})
    assert stage.result["deviations"].min() > w.LONGEST and "cut there" in stage.caption
    assert np.sqrt(np.linalg.eigvalsh(stage.result["covariance_seen"])) == pytest.approx(np.full(3, w.LONGEST))
