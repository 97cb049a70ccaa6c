"""The TX40's kinematics against elementary transforms, finite differences and the data sheet."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from labkit.geometry.frames import pose, pose_distance
from labkit.machines import arm
from labkit.machines.arm import (
    BASE_HEIGHT,
    HOME,
    REACH_FLANGE,
    REACH_FOREARM,
    REACH_WRIST,
    SHOULDER_OFFSET,
    TX40,
    _ramp,
    _spline,
    arm_points,
    dh_matrix,
    forward_kinematics,
    inverse_kinematics,
    jacobian,
    joint_speeds,
    measuring_poses,
    pose_error,
    reach_position,
    rotation_only,
    smooth_motion,
    tool_pose,
    within_limits,
    wrist_reach,
)

RNG = np.random.default_rng(60)
Q = RNG.uniform(TX40.q_min, TX40.q_max, (50, 6))


def elementary(theta, d, a, alpha):
    """Rot(z) Trans(z) Trans(x) Rot(x), multiplied out one by one with SciPy's rotations."""
    turn_z, turn_x = Rotation.from_rotvec([0, 0, theta]).as_matrix(), Rotation.from_rotvec([alpha, 0, 0]).as_matrix()
    zero = np.zeros(3)
    return pose(turn_z, zero) @ pose(np.eye(3), [0, 0, d]) @ pose(np.eye(3), [a, 0, 0]) @ pose(turn_x, zero)


def test_dh_matrix_is_the_product_of_four_elementary_transforms():
    for row in RNG.uniform(-3, 3, (20, 4)):
        np.testing.assert_allclose(dh_matrix(*row), elementary(*row), atol=1e-14)


def test_dh_matrix_broadcasts():
    rows = RNG.uniform(-3, 3, (4, 5, 1))
    T = dh_matrix(rows[0], rows[1], rows[2].T, 0.3)
    assert T.shape == (5, 5, 4, 4)
    np.testing.assert_allclose(T[2, 3], dh_matrix(rows[0, 2, 0], rows[1, 2, 0], rows[2, 3, 0], 0.3))


def test_forward_kinematics_is_the_product_of_the_links_and_broadcasts():
    T = forward_kinematics(TX40.dh, Q.reshape(5, 10, 6))
    for k in range(10):
        expected = np.eye(4)
        for (offset, d, a, alpha), angle in zip(TX40.dh, Q[k]):
            expected = expected @ elementary(offset + angle, d, a, alpha)
        np.testing.assert_allclose(T[0, k], expected, atol=1e-10)


def test_the_arm_stands_upright_at_zero():
    T = forward_kinematics(TX40.dh, np.zeros(6))
    upright = BASE_HEIGHT + REACH_FLANGE
    np.testing.assert_allclose(T, pose(np.eye(3), [0, SHOULDER_OFFSET, upright]), atol=1e-10)


def test_jacobian_against_central_differences():
    h = 1e-6
    for q in Q[:10]:
        J = jacobian(TX40.dh, q)
        for k in range(6):
            step = h * np.eye(6)[k]
            left, right = forward_kinematics(TX40.dh, q - step), forward_kinematics(TX40.dh, q + step)
            turn = Rotation.from_matrix(right[:3, :3] @ left[:3, :3].T).as_rotvec()
            np.testing.assert_allclose(J[:, k], np.concatenate([turn, right[:3, 3] - left[:3, 3]]) / (2 * h), atol=1e-5)


def test_inverse_kinematics_reaches_the_measuring_poses():
    joints = measuring_poses(TX40, np.random.default_rng(1))
    T = forward_kinematics(TX40.dh, joints)
    q, reached = inverse_kinematics(TX40, T, HOME)
    assert reached.all() and within_limits(TX40, q).all()
    angle, distance = pose_distance(forward_kinematics(TX40.dh, q), T)
    assert angle.max() < 1e-8 and distance.max() < 1e-5
    alone, reached = inverse_kinematics(TX40, T[-1], HOME)
    assert reached and np.allclose(forward_kinematics(TX40.dh, alone), T[-1], atol=1e-5)


def test_inverse_kinematics_says_what_is_out_of_reach():
    far = pose(np.eye(3), [2000.0, 0, 0])
    q, reached = inverse_kinematics(TX40, far, HOME)
    assert not reached and within_limits(TX40, q)


def test_measuring_poses_are_reachable_and_spread_out():
    joints = measuring_poses(TX40, np.random.default_rng(3), count=30)
    T = forward_kinematics(TX40.dh, joints)
    assert joints.shape == (30, 6) and within_limits(TX40, joints).all() and (T[:, 2, 2] >= 0.3).all()
    with pytest.raises(ValueError, match="widen spread or box"):
        measuring_poses(TX40, np.random.default_rng(3), box=[[0, 0, 0], [1, 1, 1]])


def test_measuring_poses_that_are_nowhere_are_not_looked_for_for_long(monkeypatch):
    monkeypatch.setattr(arm, "IN_VAIN", 30)
    with pytest.raises(
        ValueError,
        match="only 1 of 1000000 measuring poses were found in 30 draws: widen spread or box, or ask for fewer",
    ):
        measuring_poses(TX40, np.random.default_rng(3), count=10**6, box=[[0, 0, 0], [1, 1, 1]])


def test_data_sheet_reaches():
    in_plane, shoulder, elbow = wrist_reach(TX40, Q)
    assert in_plane.max() <= REACH_WRIST + 1e-9 and shoulder.max() <= REACH_WRIST + 1e-9
    np.testing.assert_allclose(elbow, REACH_FOREARM)
    fold = TX40.q_max[2]  # law of cosines, and the legs of the right triangle with the arm upright
    folded = wrist_reach(TX40, [0, 0, fold, 0, 0, 0])
    np.testing.assert_allclose(folded[1], 2 * 225 * np.cos(fold / 2))
    np.testing.assert_allclose(folded[0], 225 * np.sin(fold))


@pytest.mark.parametrize("ends", [0.05, 0.12, 0.5])
def test_ramp_starts_and_ends_at_rest_and_is_symmetric(ends):
    s = np.linspace(0, 1, 2001)
    u = _ramp(s, ends)
    speed = np.gradient(u, s)
    np.testing.assert_allclose(u[[0, 1000, 2000]], [0, 0.5, 1], atol=1e-12)
    np.testing.assert_allclose(u + u[::-1], 1, atol=1e-12)
    assert speed[0] < 1e-4 and speed[-1] < 1e-4 and (speed > -1e-9).all()
    np.testing.assert_allclose(speed.max(), 1 / (1 - ends), rtol=1e-3)


def test_smooth_motion_passes_its_points_within_the_joint_speeds():
    via = HOME + RNG.uniform(-0.3, 0.3, (4, 6))
    time, q = smooth_motion(via, 4.0, 100)
    np.testing.assert_allclose(q[[0, -1]], via[[0, -1]], atol=1e-12)
    assert all(np.abs(q - point).max(1).min() < 0.02 for point in via)
    assert (np.abs(joint_speeds(time, q)) < TX40.speed).all()


@pytest.mark.parametrize("count", [2, 3, 4, 5, 30])
def test_the_spline_is_the_not_a_knot_spline(count):
    via, at = RNG.normal(size=(count, 2)), np.linspace(0, count - 1, 61)
    np.testing.assert_allclose(_spline(via, at), CubicSpline(np.arange(count), via)(at), atol=1e-13)


def test_rotation_only_leaves_the_tool_where_it_is():
    T_FE = pose(Rotation.from_rotvec([0.1, 0.2, 0]).as_matrix(), [10, 20, 50])
    time, q = rotation_only(TX40, T_FE, HOME, np.eye(3), 0.4, 6.0, 50)
    T = tool_pose(TX40, q, T_FE)
    assert np.abs(T[:, :3, 3] - T[0, :3, 3]).max() < 1e-4
    turned = pose_distance(T[0], T)[0]
    np.testing.assert_allclose(turned.max(), 0.4, atol=1e-3)
    with pytest.raises(ValueError, match="cannot be reached"):
        rotation_only(TX40, T_FE, HOME, np.eye(3), 3.0, 6.0, 20)


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: forward_kinematics(TX40.dh, np.zeros(5)), r"q must have shape \(\.\.\., 6\)"),
        (lambda: forward_kinematics(np.zeros((6, 3)), np.zeros(6)), r"dh must have shape \(n, 4\)"),
        (lambda: forward_kinematics(TX40.dh, [0, 0, np.nan, 0, 0, 0]), "q must be finite"),
        (lambda: smooth_motion([HOME], 1, 10), "at least 2 joint positions"),
        (lambda: rotation_only(TX40, np.eye(4), HOME, [[0, 0, 1], [0, 0, 0]], 0.4, 6.0, 50), "none may be zero"),
        (lambda: rotation_only(TX40, np.eye(4), HOME, np.zeros((0, 3)), 0.4, 6.0, 50), "at least one direction"),
    ],
)
def test_refusals(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_points_of_the_arm_upright_and_turned():
    """At zero everything stands above the shoulder, which is offset along the second axis: +y, then turned by q1."""
    upright = np.array([[0, 0, 0], [0, 0, 320], [0, 35, 320], [0, 35, 545], [0, 35, 770], [0, 35, 835]])
    np.testing.assert_allclose(arm_points(TX40, np.zeros(6)), upright, atol=1e-9)
    turned = Rotation.from_euler("z", 40, degrees=True).apply(upright)
    np.testing.assert_allclose(arm_points(TX40, np.deg2rad([40, 0, 0, 0, 0, 0])), turned, atol=1e-9)
    bent = arm_points(TX40, np.deg2rad([0, 90, 0, 0, 0, 0]))  # the whole arm leans forward
    np.testing.assert_allclose(bent[2:], [[0, 35, 320], [225, 35, 320], [450, 35, 320], [515, 35, 320]], atol=1e-9)


def test_pose_error_is_what_leads_to_the_goal():
    rng = np.random.default_rng(4)
    T = forward_kinematics(TX40.dh, rng.uniform(-1, 1, (5, 6)))
    goal = forward_kinematics(TX40.dh, rng.uniform(-1, 1, (5, 6)))
    error = pose_error(T, goal)
    turned = Rotation.from_rotvec(error[:, :3]).as_matrix() @ T[:, :3, :3]
    np.testing.assert_allclose(turned, goal[:, :3, :3], atol=1e-12)
    np.testing.assert_allclose(T[:, :3, 3] + error[:, 3:], goal[:, :3, 3], atol=1e-9)


def test_three_joints_reach_a_position_and_leave_the_wrist_alone():
    goal = forward_kinematics(TX40.dh, HOME + [0.3, -0.2, 0.1, 0.0, 0.0, 0.0])[:3, 3]
    q = reach_position(TX40, goal, HOME)
    np.testing.assert_allclose(arm_points(TX40, q)[-1], goal, atol=1e-5)
    np.testing.assert_array_equal(q[3:], HOME[3:])


def test_samples_of_a_motion_are_even_and_end_with_it():
    time, _ = smooth_motion(HOME + np.linspace(0, 0.2, 3)[:, None], 4.0, 100)
    np.testing.assert_allclose(time, np.linspace(0.0, 4.0, 401), atol=1e-12)


def test_one_instant_out_of_order_is_enough():
    with pytest.raises(ValueError, match="time must hold at least two instants and increase"):
        joint_speeds([0.0, 1.0, 0.5, 2.0], np.zeros((4, 6)))


def test_every_coordinate_of_a_measuring_pose_is_inside_the_box():
    box = np.array([[0.0, -150.0, 100.0], [500.0, 150.0, 700.0]])
    joints = measuring_poses(TX40, np.random.default_rng(8), count=25, box=box)
    places = forward_kinematics(TX40.dh, joints[1:])[:, :3, 3]  # the first is the center, as given
    assert (places >= box[0]).all() and (places <= box[1]).all()


def test_a_place_out_of_reach_is_approached_as_far_as_the_arm_goes():
    """Beside a search over the three joints that may move."""
    goal = np.array([700.0, 300.0, 500.0])

    def gap(joints):
        q = HOME.copy()
        q[:3] = joints
        return forward_kinematics(TX40.dh, q)[:3, 3] - goal

    best = min(
        np.linalg.norm(least_squares(gap, start, bounds=(TX40.q_min[:3], TX40.q_max[:3])).fun)
        for start in np.random.default_rng(9).uniform(-1, 1, (8, 3))
    )
    q = reach_position(TX40, goal, HOME, iterations=200)
    assert np.linalg.norm(gap(q[:3])) == pytest.approx(best, rel=0.02) and best > 100


@pytest.mark.parametrize("seed", range(6))
def test_a_place_within_reach_is_reached(seed):
    rng = np.random.default_rng(seed)
    q = HOME.copy()
    q[:3] += rng.uniform(-0.4, 0.4, 3)
    goal = forward_kinematics(TX40.dh, q)[:3, 3]
    found = reach_position(TX40, goal, HOME)
    np.testing.assert_allclose(forward_kinematics(TX40.dh, found)[:3, 3], goal, atol=1e-5)
    np.testing.assert_array_equal(found[3:], HOME[3:])


def damped(J, gap, weight, longest):
    """(J'J + weight I)^-1 J' gap, by the stacked least squares; shortened to the longest turn of a joint."""
    n = J.shape[1]
    step = np.linalg.lstsq(np.vstack([J, np.sqrt(weight) * np.eye(n)]), np.append(gap, np.zeros(n)), rcond=None)[0]
    return step * min(1.0, longest / np.abs(step).max())


@pytest.mark.parametrize("far", [1e-3, 0.02, 0.2, 1.2])
def test_each_step_of_the_inverse_kinematics_is_damped_and_bounded(far):
    """The weight is the squared error, in rad and 200 mm, at most a thousandth; no joint turns by more than 0.5 rad."""
    start = HOME + 0.1
    goal = forward_kinematics(TX40.dh, start + far * np.array([-1.0, 0.5, 0.4, 1.0, -0.6, 0.8]))
    scale = np.array([1, 1, 1, 0.005, 0.005, 0.005])
    gap = scale * pose_error(forward_kinematics(TX40.dh, start), goal)
    step = damped(scale[:, None] * jacobian(TX40.dh, start), gap, min(1e-3, gap @ gap) + 1e-12, 0.5)
    found, _ = inverse_kinematics(TX40, goal, start, iterations=2)  # the second step is not looked at
    np.testing.assert_allclose(found, start + step, atol=1e-9)


@pytest.mark.parametrize("far", [0.01, 0.3, 1.0])
def test_each_step_to_a_position_is_damped_and_bounded(far):
    goal = forward_kinematics(TX40.dh, HOME + far * np.array([1.0, 0.5, -0.6, 0, 0, 0]))[:3, 3]
    gap = goal - forward_kinematics(TX40.dh, HOME)[:3, 3]
    J = jacobian(TX40.dh, HOME)[3:, :3]
    step = damped(J, gap, 1e-6 + 10 * min(np.linalg.norm(gap), 100.0), 0.3)
    np.testing.assert_allclose(reach_position(TX40, goal, HOME, iterations=2)[:3], HOME[:3] + step, atol=1e-9)


def test_one_joint_beyond_its_limit_is_enough():
    q = np.tile(HOME, (3, 1))
    q[1, 4], q[2, 2] = TX40.q_min[4] - 0.01, TX40.q_max[2] + 0.01
    assert within_limits(TX40, q).tolist() == [True, False, False]


def test_a_pose_counts_as_reached_within_the_tolerance_asked_for():
    goal = forward_kinematics(TX40.dh, HOME + 0.02)
    found, reached = inverse_kinematics(TX40, goal, HOME, tolerance=1e-2)
    angle, distance = pose_distance(forward_kinematics(TX40.dh, found), goal)
    assert reached and 1e-6 < np.hypot(angle, distance / 200) < 1e-2


def test_each_corner_of_the_box_binds():
    for k in range(3):
        for side in range(2):
            box = np.array([[-900.0] * 3, [900.0] * 3])
            middle = forward_kinematics(TX40.dh, HOME)[k, 3]
            box[side, k] = middle + (30.0 if side else -30.0)
            joints = measuring_poses(TX40, np.random.default_rng(8), count=12, box=box)
            places = forward_kinematics(TX40.dh, joints[1:])[:, :3, 3]
            assert (places >= box[0]).all() and (places <= box[1]).all()
