"""Who forgets a case that the docstring admits is refused, whatever is drawn, in chapters 5 to 9."""

import numpy as np
import pytest

from labkit.chapters.ch08_kalman import exercises as ch08
from labkit.exercises import budget, session
from labkit.exercises.outcome import CORRECT
from labkit.geometry import frames
from labkit.geometry.planar import wrap_angle

ITEMS = {item.id: item for chapter in session.chapters() for item in chapter.items}


def stands(x, u, *_):
    return u[0] == 0 == u[1]


def straight(x, u, *_):
    return u[1] == 0 != u[0]


def on_the_spot(x, u, *_):
    return u[0] == 0 != u[1]


def gathered(x, *_):
    return abs(x[2]) > 10


def uphill(T_FS, T_BF, x_S, target):
    """Whether the residuals grow with a Gauss-Newton step."""
    after = ITEMS["gauss_newton_on_pose"].reference(T_FS, T_BF, x_S, target)
    off = [np.linalg.norm(frames.transform(T_BF @ T, x_S) - target) for T in (T_FS, after)]
    return off[1] > off[0]


MODELS = ("step_euler", "step_midpoint", "step_arc", "jacobian_state", "jacobian_control", "motion_jacobians")
FORGOTTEN = [
    *(
        ("height_from_angles", lambda alpha, beta, base, s=s, near=near: 0 < s * (alpha - np.pi / 2) < near)
        for s in (1, -1)
        for near in (0.05, 1e-3)
    ),
    ("gauss_newton_on_pose", uphill),
    ("singular_value_ratio", lambda M: 1e-6 < np.linalg.svd(M)[1][-2] / np.linalg.norm(M, 2) < 0.01),
    ("translation_lsq", lambda A, B, R: np.linalg.cond((np.eye(3) - A[:, :3, :3]).reshape(-1, 3)) > 10),
    ("forward_kinematics", lambda dh, q: (q == 0).any()),
    *((name, case) for name in MODELS for case in (stands, straight, on_the_spot)),
    *((name, gathered) for name in ("step_euler", "step_midpoint", "jacobian_state", "jacobian_control")),
    ("step_arc", lambda x, u, dt: 0 < abs(u[1]) <= 1e-3),
    ("step_arc", lambda x, u, dt: abs(u[1] * dt) > 2 * np.pi),
    *(("propagate", lambda x, cov, u, *_, case=case: case(x, u)) for case in (stands, straight, on_the_spot)),
    *(("control_covariance", lambda u, *_, case=case: case(u, u)) for case in (stands, straight, on_the_spot)),
    ("lateration_residual", lambda landmarks, *_: len(landmarks) == 2),
    ("newton_lateration", lambda L, d, start: np.allclose(np.linalg.norm(L - start, axis=1), d, atol=1e-9)),
    ("wheel_to_twist", lambda left, right, track: 0 < abs(right - left) < 1e-4),
    ("wheel_to_twist", lambda left, right, track: left == 0 != right),
    ("wheel_to_twist", lambda left, right, track: left != 0 == right),
    ("wheel_to_twist", lambda left, right, track: left == 0 == right),
    ("wheel_offset", lambda way, excess, track: abs(way * excess / track) > 2 * np.pi),
    ("ackermann_twist", lambda speed, steering, wheelbase: 0 < abs(steering) < 1e-4),
    ("ackermann_twist", lambda speed, steering, wheelbase: speed == 0),
    ("mecanum_twist", lambda speeds, half_length, half_width: half_length > half_width),
    ("predict_state", lambda x, *_: len(x) == 1),
    ("predict_state", lambda x, cov, A, B, u, cov_u: len(u) > len(x)),
    ("update", lambda x, *_: len(x) == 1),
    ("steady_state_gain", lambda A, *_: np.abs(np.linalg.eigvals(A)).max() > 1.05),
    ("steady_state_gain", lambda A, *_: len(A) == 1),
    ("steady_state_gain", lambda A, C, *_: len(C) > len(A)),
    *(("wrap_angle", lambda a, sign=sign: 0 < sign * (abs(a) - np.pi) < 0.03) for sign in (1, -1)),
    *(
        (name, lambda x, landmark, k=k, sign=sign: landmark[k] == x[k] and sign * (landmark - x[:2])[1 - k] > 0)
        for name in ("measurement", "measurement_jacobian")
        for k in (0, 1)
        for sign in (1, -1)
    ),
    ("nees", lambda truth, x, cov: abs((truth - x)[2]) < np.pi),
    ("gate", lambda y, *_: len(y) == 1),
    ("gate", lambda y, *_: len(y) > 3),
    ("batch_estimate", lambda x0, cov0, z, *_: len(z) == 1),
    ("batch_estimate", lambda x0, cov0, z, C, cov_z: len(C) > len(x0)),
    ("landmark_weight", lambda pose, z, *_: len(z) == 1),
    ("log_sum_exp", lambda l: len(l) == 1),
    ("log_sum_exp", lambda l: len(l) > 1 and np.isfinite(l).sum() == 1),
    *(
        ("cast_ray", lambda grid, x, b, r, c=c, s=s: c * np.cos(x[2] + b) > 0.05 and s * np.sin(x[2] + b) > 0.05)
        for c in (1, -1)
        for s in (1, -1)
    ),
    ("cast_ray", lambda grid, x, b, r: abs(np.cos(x[2] + b)) < 1e-9),
    ("cast_ray", lambda grid, x, b, r: abs(np.sin(x[2] + b)) < 1e-9),
    ("distance_field_weight", lambda grid, *_: grid.resolution != 0.1),
    ("effective_size", lambda weights: (weights == 0).any()),
    ("multiply_weights", lambda w, p, step, n: n == 1),
    ("circular_mean", lambda a, w: -np.pi / 2 - 1 < np.angle(w @ np.exp(1j * a)) < -np.pi / 2),
    ("recover", lambda m, s, f, a, b: f > s and m > s),
    ("scan_from_depth", lambda depth, *_: len(depth) > 1 and len(depth) % 2),
    ("scan_from_depth", lambda depth, *_: len(depth) == 1),
    ("scan_from_depth", lambda depth, fov, near, far: not ((depth >= near) & (depth <= far)).any()),
]


@pytest.mark.parametrize("name, forgotten", FORGOTTEN, ids=[f"{name}-{k}" for k, (name, _) in enumerate(FORGOTTEN)])
def test_who_forgets_a_case_is_refused(name, forgotten, monkeypatch):
    monkeypatch.setattr(budget, "LOOKING", 0.0)
    monkeypatch.setattr(budget, "SPECIAL", 0.0)
    right = ITEMS[name].reference

    def answer(*given):
        return None if forgotten(*given) else right(*given)

    assert ITEMS[name].judge(answer, rng=np.random.default_rng(0)).status != CORRECT


@pytest.mark.parametrize("wrap", [lambda a: a % (2 * np.pi), lambda a: abs(wrap_angle(a)), lambda a: a + 2 * np.pi])
def test_innovations_to_either_side_and_off_the_seam_are_wrapped(wrap, monkeypatch):
    monkeypatch.setattr(budget, "LOOKING", 0.0)
    assert ITEMS["ekf_step"].judge(ch08._ekf(wrap=wrap), rng=np.random.default_rng(0)).status != CORRECT


def test_what_is_wrong_of_a_robot_that_drives_straight_on_is_what_is_seen():
    item = ITEMS["step_arc"]
    for straight_on, words in ((None, "returned None"), (np.zeros(2), "shape (2,)")):
        holds = item.properties[0]
        told = holds(lambda x, u, dt, s=straight_on: item.reference(x, u, dt) if u[1] else s, np.random.default_rng(0))
        assert words in told and "finite" not in told


def test_a_gain_above_one_is_drawn_and_held(monkeypatch):
    def clipped(x, cov, z, C, cov_z):
        K = np.clip(cov @ C.T @ np.linalg.inv(C @ cov @ C.T + cov_z), -1, 1)
        return x + K @ (z - C @ x), (np.eye(len(x)) - K @ C) @ cov

    monkeypatch.setattr(budget, "LOOKING", 0.0)
    assert all(ITEMS["update"].judge(clipped, rng=np.random.default_rng(seed)).status != CORRECT for seed in range(3))


FAR_OR_SMALL = [
    ("lateration_residual", lambda landmarks, distances, position: distances.max() < 2),
    ("lateration_residual", lambda landmarks, *_: len(landmarks) > 20),
    ("newton_lateration", lambda landmarks, distances, start: distances.max() < 1),
    ("newton_lateration", lambda landmarks, distances, start: distances.max() > 300),
    ("wheel_to_twist", lambda left, right, track: abs(right - left) > 10 * track),
    ("wheel_to_twist", lambda left, right, track: track > 1.5),
    *(
        (name, case)
        for name in MODELS[:5]
        for case in (
            lambda x, u, dt: 0 < abs(u[0] * dt) < 1e-3,
            lambda x, u, dt: dt > 1.5 and abs(u[0]) > 5 and np.abs(x[:2]).min() > 50,
            lambda x, u, dt: dt < 0.01,
            lambda x, u, dt: 0 < np.abs(x).max() < 0.01,
        )
    ),
    ("control_covariance", lambda u, dt, *constants: max(constants) < 1e-4),
    ("control_covariance", lambda u, dt, *_: dt > 1 and abs(u[0]) > 2.5),
    ("propagate", lambda x, cov, *_: not cov.any()),
    ("propagate", lambda x, cov, *_: 0 < np.abs(cov).max() < 1e-4),
    ("wheel_offset", lambda way, *_: way < 1),
    ("wheel_offset", lambda way, excess, track: track > 1),
    ("ackermann_twist", lambda speed, steering, wheelbase: wheelbase > 3.6),
    ("ackermann_twist", lambda speed, steering, wheelbase: wheelbase < 0.4),
    ("mecanum_twist", lambda speeds, half_length, half_width: half_length > 1),
    ("mecanum_twist", lambda speeds, half_length, half_width: half_length < 0.1),
    *(("dh_matrix", lambda *given, k=k: given[k] == 0) for k in range(4)),
    ("dh_matrix", lambda theta, *_: abs(theta) > np.pi),
    ("forward_kinematics", lambda dh, q: not dh.all()),
    ("kron_row", lambda A, B: np.trace(A) > 2.99),
    ("translation_lsq", lambda A, *_: len(A) == 2),
    ("e_trans", lambda residuals: len(residuals) == 2),
    ("e_trans", lambda residuals: np.abs(residuals).max() < 0.1),
    ("reject_outliers", lambda values, factor: len(values) == 1),
    ("reject_outliers", lambda values, factor: factor < 1),
    ("mean_quaternion", lambda q: len(q) == 1),
    ("mean_quaternion", lambda q: len(q) > 100),
    ("ray_direction", lambda delays, rate: (np.abs(rate * delays - 0.25) < 1e-9).all()),
    ("ray_direction", lambda delays, rate: rate > 500),
    ("nearest_to_rays", lambda origins, _: len(origins) > 10),
    ("nearest_to_rays", lambda origins, _: np.abs(origins).max() < 100),
    ("static_error_and_lag", lambda speed, error: len(speed) == 3),
    ("static_error_and_lag", lambda speed, error: error.max() < 1),
    ("moved_part", lambda T_BW, T_WE0, T_WE1, T_BP0: np.array_equal(T_WE0, T_WE1)),
    ("point_covariance", lambda T, cov_T, p, cov_p: not cov_p.any()),
    ("point_covariance", lambda T, cov_T, p, cov_p: not p.any()),
    ("shares", lambda jacobians, covariances: len(jacobians) == 1),
    ("shares", lambda jacobians, covariances: max(np.abs(C).max() for C in covariances) < 1e-6),
    ("decode_packet", lambda data: np.frombuffer(data, "<f8")[1] > 5e4),
    ("control_covariance", lambda u, dt, *_: dt < 0.02),
    ("control_covariance", lambda u, *_: 0 < abs(u[0]) < 0.05),
    ("mecanum_twist", lambda speeds, *_: np.abs(speeds).max() < 0.2),
    ("ackermann_twist", lambda speed, steering, wheelbase: steering > 0.9),
    ("fuse_two_sensors", lambda x0, var0, z, stds: stds[0] > stds[1]),
    ("fuse_two_sensors", lambda x0, var0, z, stds: var0 > 20),
    ("fuse_two_sensors", lambda x0, var0, z, stds: var0 < 0.1),
    ("update", lambda x, cov, z, C, cov_z: np.abs(z - C @ x).max() > 10),
    ("measurement", lambda x, landmark: np.hypot(*(landmark - x[:2])) > 10),
    ("measurement_jacobian", lambda x, landmark: np.hypot(*(landmark - x[:2])) < 1),
    ("recover", lambda w_mean, w_slow, *_: w_slow < 0.1),
    ("numeric_jacobian", lambda function, x, step: (x == 0).any()),
    ("analytic_jacobian", lambda T_FS, T_BF, x_S: np.abs(x_S).max() < 1),
    ("gauss_newton_on_pose", lambda T, T_BF, x_S, target: not (frames.transform(T_BF @ T, x_S) - target).any()),
    ("joint_residual", lambda u, *_: np.linalg.norm(u[:3]) > np.pi),
    ("dh_matrix", lambda theta, d, a, alpha: abs(alpha) > np.pi),
    ("dh_matrix", lambda theta, d, a, alpha: abs(alpha) > 1.5 * np.pi),
    ("moved_part", lambda T_BW, T_WE0, T_WE1, T_BP0: np.array_equal(T_WE0[:3, 3], T_WE1[:3, 3])),
    ("point_covariance", lambda T, cov_T, p, cov_p: cov_T.any() and not np.diag(cov_T).all()),
    ("shares", lambda jacobians, covariances: not all(np.diag(C).all() for C in covariances)),
]


@pytest.mark.parametrize("name, forgotten", FAR_OR_SMALL, ids=[f"{n}-{k}" for k, (n, _) in enumerate(FAR_OR_SMALL)])
def test_who_is_right_within_a_range_alone_is_refused(name, forgotten, monkeypatch):
    test_who_forgets_a_case_is_refused(name, forgotten, monkeypatch)


@pytest.mark.parametrize("name", ["rotation_from_nullvector", "e_rot"])
def test_two_motions_and_twenty_are_in_every_check(name):
    rng = np.random.default_rng(0)
    assert {len(draw(rng)[0]) for draw, *_ in ITEMS[name].noisy} == {2 * 9, 20 * 9}


def test_weights_of_zero_keep_their_places(monkeypatch):
    monkeypatch.setattr(budget, "LOOKING", 0.0)

    def without_zeros(weights, rng):
        left = weights[weights > 0]
        return np.searchsorted(np.cumsum(left), rng.random(len(weights)) * left.sum())

    assert ITEMS["resample_roulette"].judge(without_zeros, rng=np.random.default_rng(0)).status != CORRECT


def test_what_is_returned_is_not_called_right_on_the_way():
    def lifted(log_weights):
        top = log_weights.max()
        return top + np.log(np.exp(log_weights - top).sum() + 1e-8)

    text = ITEMS["log_sum_exp"].judge(lifted, rng=np.random.default_rng(0)).text
    assert text and "something else is returned" not in text


def test_what_leaves_directions_out_is_refused_where_axes_are_nearly_alike(monkeypatch):
    monkeypatch.setattr(budget, "LOOKING", 0.0)

    def cut(A, B, R):
        K1 = (np.eye(3) - A[:, :3, :3]).reshape(-1, 3)
        return np.linalg.lstsq(K1, (A[:, :3, 3] - B[:, :3, 3] @ R.T).ravel(), rcond=0.1)[0]

    assert ITEMS["translation_lsq"].judge(cut, rng=np.random.default_rng(0)).status != CORRECT
