"""Planned poses: where the sphere appears in them, and what they promise, against geometry and finite differences."""

import numpy as np
import pytest

from labkit.calibration import hand_eye, planning
from labkit.estimation.differences import numeric_jacobian
from labkit.geometry import frames
from labkit.geometry.lie import exp_so3

T_FS0 = frames.pose(exp_so3([0.3, -0.5, 1.1]), np.array([30.0, -20.0, 120.0]))
TARGET0 = np.array([700.0, 80.0, -150.0])


def seen_in(T_BF):
    return frames.transform(frames.invert(T_FS0), frames.transform(frames.invert(T_BF), TARGET0))


def poses_at(x_S, turns):
    return planning.poses_that_see(T_FS0, TARGET0, exp_so3(np.asarray(turns, float)), np.asarray(x_S, float))


def places(n, seed=0):
    return np.random.default_rng(seed).uniform([-20, -20, 200], [20, 20, 280], (n, 3))


def turns(n, seed=1):
    return np.random.default_rng(seed).uniform(-1, 1, (n, 3))


def test_poses_that_see_put_the_sphere_where_asked():
    R = exp_so3(turns(5))
    T_BF = planning.poses_that_see(T_FS0, TARGET0, R, places(5))
    np.testing.assert_allclose(seen_in(T_BF), places(5), atol=1e-9)
    np.testing.assert_array_equal(T_BF[:, :3, :3], R)


@pytest.mark.parametrize(
    "spread, low, high",
    [((25, 25, 50), (-25, 3, 190), (25, 25, 290)), ((10, 8, 20), (-10, 3, 220), (10, 8, 260))],
    ids=["all of the field", "a part of it"],
)
def test_pattern_fills_the_part_of_the_field_asked_for(spread, low, high):
    seen = seen_in(planning.pattern(T_FS0, TARGET0, 0.6, spread, n=200))
    assert planning.field_problem(seen) is None
    assert (np.sign(seen[:, 1]) == np.where(np.arange(200) % 2, 1, -1)).all()  # on either side of the scan plane
    seen[:, 1] = np.abs(seen[:, 1])
    width = np.subtract(high, low)
    assert (seen >= np.array(low) - 1e-9).all() and (seen <= np.array(high) + 1e-9).all()
    assert (seen.min(0) < low + 0.05 * width).all() and (seen.max(0) > high - 0.05 * width).all()
    np.testing.assert_allclose(seen.mean(0), np.add(low, high) / 2, atol=0.05 * width.max())


@pytest.mark.parametrize("tilt, yaw", [(0.6, np.pi), (0.2, np.pi), (0.05, np.pi / 4)])
def test_pattern_tilts_all_around_and_turns_about_the_line_of_sight(tilt, yaw):
    R_BS = planning.pattern(T_FS0, TARGET0, tilt, (25, 25, 50), n=400)[:, :3, :3] @ T_FS0[:3, :3]
    sight = R_BS[:, :, 2]
    tilts = np.arccos(-sight[:, 2])
    assert 0.97 * tilt < tilts.max() <= tilt + 1e-9
    np.testing.assert_allclose(np.median(tilts), tilt / np.sqrt(2), rtol=0.05)  # evenly over the disk
    np.testing.assert_allclose(sight[:, :2].mean(0), 0.0, atol=0.05 * tilt)
    around = np.arctan2(sight[:, 1], sight[:, 0])
    assert np.histogram(around, 8, (-np.pi, np.pi))[0].min() > 35  # 50 in each octant
    # Without the tilt about a horizontal axis, the axis x of the scanner shows how far it is turned about the vertical.
    axes = np.cross([0.0, 0.0, -1.0], sight)
    upright = exp_so3(-axes * (tilts / np.linalg.norm(axes, axis=1))[:, None]) @ R_BS
    turned = np.arctan2(upright[:, 1, 0], upright[:, 0, 0]) % (2 * np.pi)
    assert turned.max() <= 2 * yaw + 1e-9 and turned.max() > 1.9 * yaw
    assert turned.min() < 0.1 * yaw


def test_predicted_covariance_inverts_the_numeric_information():
    T_BF = poses_at(places(9), turns(9))
    x_S = seen_in(T_BF)

    def residuals(change):
        T_FS = T_FS0.copy()
        T_FS[:3, :3] = T_FS[:3, :3] @ exp_so3(change[:3])
        T_FS[:3, 3] += change[3:6]
        return hand_eye.sphere_residuals(T_BF, x_S, T_FS, TARGET0 + change[6:]).ravel()

    J = numeric_jacobian(residuals, np.zeros(9), np.array([1e-6] * 3 + [1e-3] * 6), "central")
    predicted = planning.predicted_sphere_covariance(T_BF, T_FS0, TARGET0, 0.3)
    np.testing.assert_allclose(predicted @ (J.T @ J), 0.09 * np.eye(9), atol=1e-6 * np.abs(J.T @ J).max() * 1e-3)
    scale = np.sqrt(np.diagonal(predicted))
    np.testing.assert_allclose(predicted, 0.09 * np.linalg.inv(J.T @ J), atol=1e-6 * scale.max() ** 2)


@pytest.mark.parametrize("n, about", [(2, turns(2)), (9, np.zeros((9, 3))), (9, np.outer(np.arange(9), [0, 0, 0.3]))])
def test_poses_that_leave_something_free_have_no_covariance(n, about):
    with pytest.raises(ValueError, match="undetermined: too few, or turned about one axis only"):
        planning.predicted_sphere_covariance(poses_at(places(n), about), T_FS0, TARGET0, 0.3)


def test_good_poses_leave_nothing_unseen_and_the_weakest_change_is_what_it_says():
    T_BF = poses_at(places(9), turns(9))
    unseen = planning.unseen_changes(T_BF, T_FS0, TARGET0)
    assert unseen.turns.shape == unseen.slides.shape == (0, 3)
    moved = hand_eye.joint_jacobian(T_BF, seen_in(T_BF), T_FS0) @ unseen.weakest
    np.testing.assert_allclose(np.linalg.norm(moved), unseen.singular_values[-1], rtol=1e-9)
    reach = np.sqrt((seen_in(T_BF) ** 2).sum(1).mean())
    np.testing.assert_allclose(np.linalg.norm(unseen.weakest * np.array([reach] * 3 + [1.0] * 6)), 1.0, rtol=1e-12)


def test_poses_that_only_translate_let_scanner_and_sphere_slide_anywhere():
    unseen = planning.unseen_changes(poses_at(places(9), np.tile([0.4, 0.1, -0.2], (9, 1))), T_FS0, TARGET0)
    assert len(unseen.slides) == 3 and len(unseen.turns) == 0


def test_turns_about_one_axis_let_them_slide_along_it():
    axis = np.array([0.6, 0.0, 0.8])
    unseen = planning.unseen_changes(poses_at(places(9), np.outer(np.linspace(-1, 1, 9), axis)), T_FS0, TARGET0)
    np.testing.assert_allclose(np.abs(unseen.slides @ axis), [1.0], rtol=1e-9)


def test_a_sphere_on_one_line_lets_the_scanner_turn_about_it():
    line = np.array([0.0, 0.6, 0.8])
    x_S = np.outer(np.linspace(200, 280, 9), line)
    unseen = planning.unseen_changes(poses_at(x_S, turns(9)), T_FS0, TARGET0)
    np.testing.assert_allclose(np.abs(unseen.turns @ line), [1.0], rtol=1e-9)
    assert len(unseen.slides) == 0


@pytest.mark.parametrize("axis, low, high", [(0, -25, 25), (1, 3, 25), (1, -25, -3), (2, 190, 290)])
def test_the_field_ends_where_it_says(axis, low, high):
    inside = np.tile([0.0, 10.0, 240.0], (3, 1))
    name, (from_, to) = ["x", "|y|", "z"][axis], planning.FIELD[axis]
    for edge, outward in ((low, -1), (high, 1)):
        inside[1, axis] = edge
        assert planning.field_problem(inside) is None
        outside = inside.copy()
        outside[1, axis] += 0.1 * outward
        found = abs(outside[1, axis]) if axis == 1 else outside[1, axis]
        told = f"the sphere lies outside {name} = {from_:g} to {to:g} mm,"
        assert planning.field_problem(outside) == f"in one pose {told} at {found:.1f} mm."
        outside[2] = outside[1]
        assert planning.field_problem(outside) == f"in 2 poses {told} first at {found:.1f} mm."


def test_whether_poses_determine_all_is_judged_on_columns_of_length_one():
    """Turns as small as 1e-4 rad are enough, those of 1e-7 are not: the limit is 1e-6 of the largest singular value."""
    for size in (1e-4, 1e-7):
        T_BF = poses_at(places(9), size * turns(9))
        J = planning.joint_jacobian(T_BF, seen_in(T_BF), T_FS0)
        ratio = 1 / np.linalg.cond(J / np.linalg.norm(J, axis=0))
        assert (ratio > planning.MIN_SPREAD) == (size == 1e-4)
        if ratio > planning.MIN_SPREAD:
            found = planning.predicted_sphere_covariance(T_BF, T_FS0, TARGET0, 0.1)
            np.testing.assert_allclose(found, 0.01 * np.linalg.inv(J.T @ J), rtol=1e-3)
        else:
            with pytest.raises(ValueError, match="undetermined"):
                planning.predicted_sphere_covariance(T_BF, T_FS0, TARGET0, 0.1)


def test_a_pattern_begins_in_the_middle_and_stays_in_the_field():
    seen = seen_in(planning.pattern(T_FS0, TARGET0, 0.6, (25, 100, 50), n=60))
    np.testing.assert_allclose(seen[0], [0.0, -14.0, 240.0], atol=1e-9)
    assert planning.field_problem(seen) is None and np.abs(seen[:, 1]).max() > 24
    for place, inside in (((-24.0, 5.0, 240.0), True), ((-26.0, 5.0, 240.0), False), ((24.0, -5.0, 200.0), True)):
        assert (planning.field_problem(np.array([place])) is None) == inside
