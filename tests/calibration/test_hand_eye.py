"""Hand-eye calibration on a sphere against SciPy, finite differences, Monte Carlo and the thesis's own numbers."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from labkit.calibration import hand_eye, literature, planning
from labkit.calibration.literature import compare_methods, kim_linear, kim_matrix, li_two_step
from labkit.calibration.robust import tukey_weights
from labkit.documents.thesis import printed as thesis
from labkit.documents.thesis.listings import listing_cost, listing_gauss_newton
from labkit.estimation.differences import numeric_jacobian
from labkit.fast import hand_eye as fast_hand_eye
from labkit.geometry import frames
from labkit.geometry.lie import exp_so3

T_FS0 = frames.pose(exp_so3([0.3, -0.5, 1.1]), np.array([30.0, -20.0, 120.0]))
TARGET0 = np.array([700.0, 80.0, -150.0])


def scene(n=31, std=0.1, seed=0, turn=1.0, reach=200.0):
    """Random poses, and the sphere as the scanner sees it."""
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=(n, 3))
    angle = turn * rng.uniform(0.1, 1, (n, 1))
    R = exp_so3(angle * axis / np.linalg.norm(axis, axis=1, keepdims=True))
    T_BF = frames.pose(R, rng.uniform(-reach, reach, (n, 3)))
    x_S = frames.transform(frames.invert(T_FS0), frames.transform(frames.invert(T_BF), TARGET0))
    return T_BF, x_S + std * rng.normal(size=x_S.shape)


def scipy_fit(T_BF, x_S, T_FS, target, free=True):
    def at(d):
        T = T_FS.copy()
        T[:3, :3] = T[:3, :3] @ exp_so3(d[:3])
        T[:3, 3] = T[:3, 3] + d[3:6]
        return T, target + d[6:] if free else target

    fit = least_squares(
        lambda d: hand_eye.sphere_residuals(T_BF, x_S, *at(d)).ravel(),
        np.zeros(9 if free else 6),
        x_scale=[1e-3] * 3 + [1.0] * (6 if free else 3),
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    )
    return *at(fit.x), fit


# --- the estimate ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [5, 31])
def test_noise_free_data_give_the_exact_pose(n):
    fit = hand_eye.calibrate_sphere_target(*scene(n, std=0))
    np.testing.assert_allclose(fit.T_FS, T_FS0, atol=1e-9)
    np.testing.assert_allclose(fit.target, TARGET0, atol=1e-8)
    assert fit.rms < 1e-8


@pytest.mark.parametrize("seed", range(4))
def test_estimate_and_covariance_are_those_of_scipy(seed):
    T_BF, x_S = scene(seed=seed, std=0.5)
    fit = hand_eye.calibrate_sphere_target(T_BF, x_S)
    T_FS, target, want = scipy_fit(T_BF, x_S, T_FS0, TARGET0)
    np.testing.assert_allclose(fit.T_FS, T_FS, atol=2e-6)
    np.testing.assert_allclose(fit.target, target, atol=2e-5)
    assert (fit.residuals**2).sum() <= 2 * want.cost * (1 + 1e-12)
    T0, _, at_end = scipy_fit(T_BF, x_S, fit.T_FS, fit.target)
    cov = 2 * want.cost / (93 - 9) * np.linalg.inv(at_end.jac.T @ at_end.jac)
    np.testing.assert_allclose(
        fit.covariance, cov, rtol=1e-3, atol=1e-4 * np.sqrt(np.outer(np.diag(cov), np.diag(cov))).max()
    )


def test_known_target_is_one_fit_of_two_point_sets():
    T_BF, x_S = scene(std=0.5)
    fit = hand_eye.calibrate_sphere_target(T_BF, x_S, target=TARGET0)
    kabsch = frames.fit_frame(x_S, frames.transform(frames.invert(T_BF), TARGET0))
    np.testing.assert_allclose(fit.T_FS, kabsch, atol=1e-9)
    assert fit.covariance.shape == (6, 6)
    np.testing.assert_allclose(fit.T_FS, scipy_fit(T_BF, x_S, T_FS0, TARGET0, free=False)[0], atol=1e-5)


def test_error_reaches_the_bound():
    errors, bounds = [], []
    for seed in range(150):
        fit = hand_eye.calibrate_sphere_target(*scene(seed=seed))
        T_BF, _ = scene(seed=seed, std=0)
        cov = planning.predicted_sphere_covariance(T_BF, T_FS0, TARGET0, 0.1)
        errors.append(
            (frames.rotation_angle(fit.T_FS[:3, :3].T @ T_FS0[:3, :3]), np.linalg.norm(fit.T_FS[:3, 3] - T_FS0[:3, 3]))
        )
        bounds.append((np.sqrt(np.trace(cov[:3, :3])), np.sqrt(np.trace(cov[3:6, 3:6]))))
    ratio = np.sqrt(np.mean(np.square(errors), 0) / np.mean(np.square(bounds), 0))
    assert (ratio < 1.08).all()  # 150 draws scatter by 4 percent


def test_flat_data_need_no_linear_start():
    """All spheres in one plane of the scanner: the 15 linear unknowns are not determined, the 9 of the problem are."""
    rng = np.random.default_rng(5)
    x_S = np.column_stack([rng.uniform(-20, 20, 12), rng.uniform(-15, 15, 12), np.full(12, 240.0)])
    R = exp_so3(rng.uniform(-1, 1, (12, 3)))
    T_BF = frames.pose(R, TARGET0 - (R @ frames.transform(T_FS0, x_S)[..., None])[..., 0])
    with pytest.raises(ValueError, match="rank 15"):
        hand_eye.linear_start(T_BF, x_S)
    np.testing.assert_allclose(hand_eye.calibrate_sphere_target(T_BF, x_S).T_FS, T_FS0, atol=1e-7)


def flat_scene(rng, count, std):
    """Spheres in the scan plane itself, as a scanner sees them that computes no y."""
    x_S = np.column_stack([rng.uniform(-20, 20, count), np.zeros(count), rng.uniform(200, 260, count)])
    R = exp_so3(rng.normal(size=(count, 3)))
    T_BF = frames.pose(R, TARGET0 - (R @ frames.transform(T_FS0, x_S)[..., None])[..., 0])
    return T_BF, x_S + std * rng.normal(size=x_S.shape) * [1, 0, 1]


@pytest.mark.parametrize("std", [0.0, 0.1, 5.0])
def test_the_search_among_24_orientations_finds_the_lowest_valley(std):
    T_BF, x_S = flat_scene(np.random.default_rng(8), 9, std)
    every = [hand_eye._gauss_newton(R, T_BF, x_S, np.ones(9), 50)[2][-1] for R in hand_eye.right_angled()]
    found = hand_eye.calibrate_sphere_target(T_BF, x_S).history[-1]
    np.testing.assert_allclose(found, min(every), rtol=1e-9, atol=1e-9)


def test_rounds_of_weights_go_down_one_valley_each(monkeypatch):
    """A search of 24 valleys in each round took minutes for `leave_one_out` of 31 such poses."""
    descents, descend = [], hand_eye._gauss_newton
    monkeypatch.setattr(hand_eye, "_gauss_newton", lambda *given: descents.append(len(given[1])) or descend(*given))
    T_BF, x_S = flat_scene(np.random.default_rng(8), 12, 0.1)
    fit = hand_eye.calibrate_sphere_target(T_BF, x_S, robust=True)
    assert descents.count(12) >= len(fit.history) and len(descents) <= 60 + 3 * 5 + len(fit.history)


def test_linear_start_is_exact_without_noise():
    T_FS, target = hand_eye.linear_start(*scene(std=0))
    np.testing.assert_allclose(T_FS, T_FS0, atol=1e-9)
    np.testing.assert_allclose(target, TARGET0, atol=1e-8)


def test_robust_fit_survives_a_third_of_bad_poses_and_costs_little_without():
    T_BF, x_S = scene(seed=3)
    bad = np.arange(0, 30, 3)
    clean = hand_eye.calibrate_sphere_target(np.delete(T_BF, bad, 0), np.delete(x_S, bad, 0))
    x_S[bad] += np.random.default_rng(1).normal(size=(10, 3)) * 100
    fit = hand_eye.calibrate_sphere_target(T_BF, x_S, robust=True)
    assert (fit.weights[bad] == 0).all()
    assert np.linalg.norm(fit.T_FS[:3, 3] - clean.T_FS[:3, 3]) < 0.05
    assert fit.std == pytest.approx(0.1, rel=0.3)
    again = hand_eye.calibrate_sphere_target(T_BF, x_S, robust=True)
    np.testing.assert_array_equal(fit.T_FS, again.T_FS)


def test_the_majority_decides_even_where_the_others_agree_to_the_last_digit():
    """Fourteen of 31 poses show, without any noise, a sphere that stands elsewhere."""
    T_BF, x_S = scene(seed=3)
    other = np.arange(0, 28, 2)
    x_S[other] = hand_eye.sphere_in_scanner(T_BF[other], T_FS0, TARGET0 + [60.0, -40.0, 0.0])
    fit = hand_eye.calibrate_sphere_target(T_BF, x_S, robust=True)
    assert (fit.weights[other] == 0).all() and np.linalg.norm(fit.target - TARGET0) < 1


def test_robust_fit_of_noise_free_data_keeps_all():
    fit = hand_eye.calibrate_sphere_target(*scene(std=0), robust=True)
    np.testing.assert_array_equal(fit.weights, 1.0)


# --- refusals --------------------------------------------------------------------------------------------------------


def test_pure_translation_is_refused():
    T_BF, x_S = scene(8, turn=0)
    with pytest.raises(ValueError, match="only translate.*two different axes"):
        hand_eye.calibrate_sphere_target(T_BF, x_S)


@pytest.mark.parametrize("axis", [(0, 0, 1), (0.6, 0, 0.8)])
def test_turns_about_one_axis_are_refused_with_the_axis(axis):
    rng = np.random.default_rng(0)
    T_BF = frames.pose(exp_so3(rng.uniform(-1, 1, (8, 1)) * np.array(axis)), rng.uniform(-200, 200, (8, 3)))
    x_S = frames.transform(frames.invert(T_FS0), frames.transform(frames.invert(T_BF), TARGET0))
    with pytest.raises(ValueError, match=rf"one axis, \({axis[0]:.3f}, {axis[1]:.3f}, {axis[2]:.3f}\)"):
        hand_eye.calibrate_sphere_target(T_BF, x_S)


@pytest.mark.parametrize("spread, where", [((0, 0, 0), "at one place"), ((0, 0, 30), "on one line")])
def test_sphere_that_does_not_move_in_the_field_is_refused(spread, where):
    rng = np.random.default_rng(0)
    R = exp_so3(rng.uniform(-1, 1, (9, 3)))
    x_S = np.array([3.0, 5.0, 240.0]) + rng.normal(size=(9, 1)) * np.array(spread)
    T_BF = frames.pose(R, TARGET0 - (R @ frames.transform(T_FS0, x_S)[..., None])[..., 0])
    with pytest.raises(ValueError, match=where):
        hand_eye.calibrate_sphere_target(T_BF, x_S)


@pytest.mark.parametrize("times, refused", [(0.3, True), (3.0, False)])
def test_a_line_is_what_is_a_millionth_as_wide_as_long(times, refused):
    along = np.linspace(-1, 1, 9)
    across = np.cos(5 * along) - np.cos(5 * along) @ along / (along @ along) * along
    across -= across.mean()
    across *= np.linalg.norm(along) / np.linalg.norm(across)
    x_S = np.column_stack([20 * along, np.full(9, 7.0), 240 + times * hand_eye.MIN_SPREAD * 20 * across])
    if refused:
        with pytest.raises(ValueError, match="on one line"):
            hand_eye.refuse_one_line(x_S, np.ones(9))
    else:
        hand_eye.refuse_one_line(x_S, np.ones(9))


def test_shapes_and_numbers_are_checked():
    T_BF, x_S = scene(6)
    with pytest.raises(ValueError, match=r"\(N, 4, 4\) and \(N, 3\), got"):
        hand_eye.calibrate_sphere_target(T_BF, x_S[:5])
    with pytest.raises(ValueError, match="at least 4 poses"):
        hand_eye.calibrate_sphere_target(T_BF[:3], x_S[:3])
    with pytest.raises(ValueError, match="finite"):
        hand_eye.calibrate_sphere_target(T_BF, np.where(x_S > 0, np.nan, x_S))


# --- derivatives -----------------------------------------------------------------------------------------------------


def test_jacobians_against_central_differences():
    T_BF, x_S = scene(7)
    p2, p3, x_P = (
        np.array([30.0, -20, 120, 0.4, -0.9, 1.3]),
        np.array([1.0, 2, 3, 0.1, 0.2, -0.3]),
        np.array([98.0, 99, 181]),
    )
    want = numeric_jacobian(lambda q: hand_eye.kuka_residuals(q, T_BF, x_S, TARGET0), p2, 1e-5, "central")
    np.testing.assert_allclose(hand_eye.kuka_jacobian(p2, T_BF, x_S), want, atol=1e-5)

    def both(q):
        target = frames.transform(frames.matrix_from_kuka(q[6:]), x_P)
        return hand_eye.kuka_residuals(q[:6], T_BF, x_S, target)

    want = numeric_jacobian(both, np.append(p2, p3), 1e-5, "central")
    J = hand_eye.plate_jacobian(T_BF, x_S, p2, p3, x_P)
    np.testing.assert_allclose(J, want, atol=1e-5)
    assert np.linalg.matrix_rank(J, tol=1e-6) == 9


def test_rate_matrix_gives_the_angular_velocity_and_loses_rank_at_90_deg():
    abc, rate, h = np.array([0.4, -1.1, 2.0]), np.array([0.3, -0.7, 0.2]), 1e-6
    R = [frames.matrix_from_kuka(np.append(np.zeros(3), abc + s * h * rate))[:3, :3] for s in (-1, 1)]
    W = (R[1] - R[0]) / (2 * h) @ ((R[0] + R[1]) / 2).T
    np.testing.assert_allclose([W[2, 1], W[0, 2], W[1, 0]], hand_eye.rate_matrix(*abc[:2]) @ rate, atol=1e-8)
    assert np.linalg.det(hand_eye.rate_matrix(0.4, -1.1)) == pytest.approx(-np.cos(-1.1))
    assert np.linalg.cond(hand_eye.rate_matrix(0.0, np.deg2rad(-89.9))) == pytest.approx(1146, rel=1e-3)


def test_numeric_jacobian_orders():
    errors = {}
    for scheme in ("forward", "central"):
        errors[scheme] = [abs(numeric_jacobian(np.sin, [1.0], h, scheme)[0, 0] - np.cos(1.0)) for h in (1e-2, 1e-3)]
    assert errors["forward"][0] / errors["forward"][1] == pytest.approx(10, rel=0.02)
    assert errors["central"][0] / errors["central"][1] == pytest.approx(100, rel=0.02)
    with pytest.raises(ValueError, match="scheme must be one of"):
        numeric_jacobian(np.sin, [1.0], 1e-3, "backward")


# --- the thesis's iteration ------------------------------------------------------------------------------------------


def test_the_code_squares_the_sum():
    e = np.array([[1.0, 2, 0], [-1, 2, 0]])
    np.testing.assert_allclose(listing_cost(e), [0.0, 4.0, 0.0])


@pytest.mark.parametrize("parameters", ["euler", "se3"])
def test_plain_gauss_newton_ends_at_the_estimate(parameters):
    T_BF, x_S = scene(std=0.2)
    start = frames.kuka_from_matrix(T_FS0) + [5, -5, 5, 0.1, -0.1, 0.1]
    run = hand_eye.gauss_newton_pose(start, T_BF, x_S, parameters=parameters)
    fit = hand_eye.calibrate_sphere_target(T_BF, x_S)
    assert run.converged
    np.testing.assert_allclose(run.poses[-1], fit.T_FS, atol=1e-7)
    assert run.rms[-1] == pytest.approx(fit.rms)
    assert len(run.poses) == len(run.rms) == len(run.singular_values)


def test_iteration_counts_of_table_7_3():
    T_BF, x_S, target, _ = thesis.simulation()
    counts = [len(listing_gauss_newton(p, T_BF, x_S, target)[0]) - 1 for p in thesis.start_poses_deg()[0]]
    assert counts == [1] + 9 * [4]


# --- literature ------------------------------------------------------------------------------------------------------


def cube_scene(seed=0, std=0.0, n=10):
    rng = np.random.default_rng(seed)
    T_BF, _ = scene(n, seed=seed)
    corners = 40.0 * (np.indices((2, 2, 2)).reshape(3, 8).T - 0.5)
    points_S = frames.transform(frames.invert(T_BF @ T_FS0)[:, None], corners + TARGET0)
    return T_BF, points_S + std * rng.normal(size=points_S.shape), corners


def test_kim_solves_the_cube_and_refuses_the_sphere():
    T_BF, points_S, corners = cube_scene()
    np.testing.assert_allclose(kim_linear(T_BF, points_S, corners), T_FS0, atol=1e-7)
    with pytest.raises(ValueError, match="rank 1, not 4"):
        kim_linear(T_BF, points_S[:, :1], corners[:1])


def test_kim_matrix_is_the_printed_one():
    rng = np.random.default_rng(0)
    A, B, X = (np.vstack([rng.normal(size=(3, 4)), [0, 0, 0, 1]]) for _ in range(3))  # true of any X, and of any B
    A[:3, :3] = Rotation.random(rng=rng).as_matrix()
    D, F = kim_matrix(A, B)
    np.testing.assert_allclose(D @ X[:3].ravel() - F, (A @ X - X @ B)[:3].ravel(), atol=1e-12)
    np.testing.assert_allclose(
        D[0, :6], [A[0, 0] - B[0, 0], -B[1, 0], -B[2, 0], -B[3, 0], A[0, 1], 0]
    )  # first row of appendix A


def test_the_two_steps_of_li_one_by_one():
    scene = literature.suitable_scene(1e-9, np.random.default_rng(3))
    same = scene.translated
    R_FS = literature.li_rotation(scene.T_BF[same], scene.x_S[same])
    aligned = Rotation.align_vectors(-np.diff(scene.T_BF[same, :3, 3], axis=0) @ scene.T_BF[0, :3, :3],
                                     np.diff(scene.x_S[same], axis=0))[0].as_matrix()  # fmt: skip
    assert pytest.approx(aligned, abs=1e-8) == R_FS and pytest.approx(scene.T_FS[:3, :3], abs=1e-8) == R_FS
    t_FS, target = literature.li_translation(scene.T_BF, scene.x_S, R_FS)
    assert t_FS == pytest.approx(scene.T_FS[:3, 3], abs=1e-6) and target == pytest.approx(scene.target, abs=1e-6)
    with pytest.raises(ValueError, match="one line"):
        literature.li_rotation(scene.T_BF[[0, 12]], scene.x_S[[0, 12]])
    with pytest.raises(ValueError, match="two axes"):
        literature.li_translation(scene.T_BF[same], scene.x_S[same], R_FS)


def test_the_suitable_scene_shows_sphere_and_cube_with_the_stated_noise():
    """The rms of 48 normal numbers is within half of its expectation but for two seeds in a million; this is fixed."""
    scene = literature.suitable_scene(0.3, np.random.default_rng(8))
    T_BS = scene.T_BF @ scene.T_FS
    sphere = np.einsum("nij,nj->ni", T_BS, np.column_stack([scene.x_S, np.ones(16)]))[:, :3] - scene.target
    corners = np.concatenate([scene.cube_S, np.ones((16, 8, 1))], axis=2)
    cube = np.einsum("nij,nkj->nki", T_BS, corners)[..., :3] - scene.target - scene.cube_W
    for off in (sphere, cube):
        assert np.sqrt((off**2).mean()) == pytest.approx(0.3, rel=0.5)


def test_the_printed_sign_of_2_41_gives_no_scanner():
    """R_0 R_s (X_l2 - X_l1) = T_02 - T_01 holds for no pose: with the sign reversed it holds for all."""
    scene = literature.suitable_scene(1e-9, np.random.default_rng(5))
    p, q = scene.translated[:2]
    seen = scene.T_BF[p, :3, :3] @ scene.T_FS[:3, :3] @ (scene.x_S[q] - scene.x_S[p])
    moved = scene.T_BF[q, :3, 3] - scene.T_BF[p, :3, 3]
    assert seen == pytest.approx(-moved, abs=1e-6) and np.linalg.norm(seen - moved) > 10


def test_methods_of_ones_own_are_compared_as_well():
    found, bound = literature.compare_methods(3, 0.1, np.random.default_rng(0), {"truth": lambda scene: scene.T_FS})
    assert found == {"truth": 0.0} and bound > 0.1


def test_li_two_steps_and_their_missing_motion():
    T_BF, _ = scene(6)
    shifted = T_BF[:1] @ frames.pose(np.tile(np.eye(3), (3, 1, 1)), 60.0 * np.eye(3))
    T_BF = np.concatenate([T_BF, shifted])
    x_S = frames.transform(frames.invert(T_FS0), frames.transform(frames.invert(T_BF), TARGET0))
    T_FS, target = li_two_step(T_BF, x_S)
    np.testing.assert_allclose(T_FS, T_FS0, atol=1e-9)
    np.testing.assert_allclose(target, TARGET0, atol=1e-8)
    measured = thesis.measurements(True)
    with pytest.raises(ValueError, match="no two poses have the same orientation"):
        li_two_step(measured.T_BF, measured.x_S)


# --- the measured data -----------------------------------------------------------------------------------------------


def test_corrections_change_one_entry_each_and_bring_the_fit_below_the_goal():
    printed, corrected = thesis.measurements(), thesis.measurements(True)
    changed = (printed.kuka_deg != corrected.kuka_deg).sum(1) + (printed.x_S != corrected.x_S).sum(1)
    assert changed.max() == 1 and changed.sum() == 7
    entries = thesis.printed_entries()
    for row in thesis.corrections():
        assert entries[row["table"], row["pose"], row["column"]] == row["printed"]
    fit = hand_eye.calibrate_sphere_target(corrected.T_BF, corrected.x_S)
    assert fit.rms == pytest.approx(0.5722, abs=1e-3)
    six = thesis.measurements((2, 3, 4, 7, 21, 30))
    assert hand_eye.calibrate_sphere_target(six.T_BF, six.x_S).rms < 0.78


def test_leaving_out_a_line_is_harder_than_leaving_out_a_pose():
    measured = thesis.measurements(True)
    one, line = (
        hand_eye.rms_distance(hand_eye.leave_one_out(measured.T_BF, measured.x_S, groups=groups))
        for groups in (None, measured.line)
    )
    assert one == pytest.approx(0.6252, abs=1e-4) and line == pytest.approx(0.715, abs=5e-4)
    with pytest.raises(ValueError, match="one group a pose"):
        hand_eye.leave_one_out(measured.T_BF, measured.x_S, groups=["x"])


def test_leave_one_out_is_a_real_refit():
    measured = thesis.measurements(True)
    left = hand_eye.leave_one_out(measured.T_BF, measured.x_S)
    keep = np.arange(31) != 4
    T_FS, target, _ = scipy_fit(
        measured.T_BF[keep], measured.x_S[keep], thesis.frame("scanner_end"), np.array([1528.0, -601, 1121])
    )
    np.testing.assert_allclose(
        left[4], hand_eye.sphere_residuals(measured.T_BF[4], measured.x_S[4], T_FS, target), atol=1e-3
    )
    assert np.sqrt((left**2).sum(1).mean()) == pytest.approx(0.625, abs=2e-3)


def test_radius_as_a_tenth_unknown_against_scipy():
    measured = thesis.measurements(True)
    fit = hand_eye.calibrate_sphere_target(measured.T_BF, measured.x_S)

    def residuals(d):
        T = fit.T_FS.copy()
        T[:3, :3], T[:3, 3] = T[:3, :3] @ exp_so3(d[:3]), T[:3, 3] + d[3:6]
        return hand_eye.sphere_residuals(
            measured.T_BF, thesis.centers_with_radius(measured.x_S, d[9]), T, fit.target + d[6:9]
        ).ravel()

    want = least_squares(residuals, [0] * 9 + [30.0], x_scale=[1e-3] * 3 + [1] * 6 + [0.1], xtol=1e-13)
    found = hand_eye.fit_radius(measured.T_BF, measured.x_S)
    assert found.radius == pytest.approx(want.x[9], abs=1e-4)
    cov = 2 * want.cost / 83 * np.linalg.inv(want.jac.T @ want.jac)
    assert found.std_of("radius") == pytest.approx(np.sqrt(cov[9, 9]), rel=0.02)


def test_a_radius_that_does_not_settle_is_refused():
    T_BF, x_S = scene(8, std=0.0)
    x_S[:, 1] = np.where(np.arange(8) % 2, 1.0, -1.0) * (20.0 + 5.0 * np.random.default_rng(3).normal(size=8))
    with pytest.raises(ValueError, match=r"does not settle: after 50 steps it is .* mm"):
        hand_eye.fit_radius(T_BF, x_S)


@pytest.mark.parametrize("known, n, words", [(None, 6, "at least 7"), (TARGET0, 4, "at least 5")])
def test_robust_needs_one_pose_more_than_a_sample(known, n, words):
    with pytest.raises(ValueError, match=f"{words} poses are needed when robust, got {n}"):
        hand_eye.calibrate_sphere_target(*scene(n), known, robust=True)


def test_without_redundancy_the_noise_is_unknown():
    fit = hand_eye.calibrate_sphere_target(*scene(3, std=0.1), target=TARGET0)
    assert fit.std > 0 and len(fit.covariance) == 6
    weights = np.array([1.0, 1.0, 0.0])
    assert np.isnan(dataclasses.replace(fit, weights=weights).std)


def test_simulation_inputs_give_the_printed_coordinates():
    _, exact, _, _ = thesis.simulation()
    _, printed, _, _ = thesis.simulation(exact=False)
    assert np.abs(exact - printed).max() < 0.01
    _, _, target, scanner = thesis.simulation(printed=True)
    T_FS = frames.matrix_from_kuka(frames.kuka_from_degrees(scanner))
    T_BF, x_S, _, _ = thesis.simulation(printed=True)
    assert hand_eye.rms_distance(hand_eye.sphere_residuals(T_BF, x_S, T_FS, target)) > 10


def test_methods_of_the_literature_do_not_beat_the_bound():
    errors, bound = compare_methods(25, 0.1, np.random.default_rng(4))
    assert errors["joint fit (sphere)"] < 1.35 * bound
    assert errors["Li et al. (sphere)"] > errors["joint fit (sphere)"]


def test_the_tukey_weights_fall_smoothly_to_zero_at_the_cut():
    lengths = np.array([0.0, 1.0, 5.0, 10.0, 11.0, 1e9])
    np.testing.assert_allclose(tukey_weights(lengths, 2.0, 5.0), [1, 0.99**2, 0.75**2, 0, 0, 0])


def test_singular_values_of_an_iterate_are_millimeters_per_millimeter():
    T_BF, x_S = scene()
    start = frames.kuka_from_matrix(T_FS0)
    found = hand_eye.gauss_newton_pose(start, T_BF, x_S, TARGET0, "se3", max_steps=0).singular_values[0]
    reach = np.sqrt((x_S**2).sum(1).mean())
    J = hand_eye.joint_jacobian(T_BF, x_S, T_FS0, target_free=False) / [reach, reach, reach, 1, 1, 1]
    np.testing.assert_allclose(found, np.linalg.svd(J, compute_uv=False), rtol=1e-9)


def test_the_cube_is_one_of_60_mm():
    sides = np.linalg.norm(literature.CUBE[:, None] - literature.CUBE, axis=-1)
    assert np.unique(sides.round(9)) == pytest.approx(60 * np.sqrt([0, 1, 2, 3]))
    np.testing.assert_allclose(literature.CUBE.mean(0), 0, atol=1e-12)


def test_kim_refuses_a_cube_that_is_flat_to_a_billionth():
    T_BF, points_S, corners = cube_scene()
    for thickness, flat in ((1e-9, True), (1e-3, False)):
        squeezed = corners * [1.0, 1.0, thickness / np.ptp(corners[:, 2])]
        seen = frames.transform(frames.invert(T_BF @ T_FS0)[:, None], squeezed)
        if flat:
            with pytest.raises(ValueError, match="rank 3, not 4"):
                kim_linear(T_BF, seen, squeezed)
        else:
            kim_linear(T_BF, seen, squeezed)


def test_li_says_by_how_much_the_nearest_orientations_differ():
    turned = exp_so3(np.deg2rad([[0.0, 0, 0], [3.0, 0, 0], [0, 9.0, 0]]))
    with pytest.raises(ValueError, match="the nearest differ by 3 deg"):
        li_two_step(frames.pose(turned, np.eye(3)), np.eye(3))


@pytest.mark.parametrize(("n", "half"), [(20, 13), (9, 7)])
def test_the_robust_start_rests_on_the_half_that_agrees(n, half, monkeypatch):
    """Half of the poses and of a sample of four, and one more: they are exact, the others far off."""
    monkeypatch.setattr(hand_eye, "SUBSETS", 50)
    T_BF, _ = scene(n)
    x_S = frames.transform(frames.invert(T_BF @ T_FS0), TARGET0)
    x_S[half:] += np.random.default_rng(1).uniform(20, 60, (n - half, 3))
    weights = hand_eye._trimmed_start(hand_eye._least_squares, T_BF, x_S, TARGET0, 4, np.random.default_rng(0))
    np.testing.assert_array_equal(weights, np.arange(n) < half)


def test_the_linear_system_is_judged_by_its_condition():
    """Smallest over largest singular value of the 15 columns, centers divided by their root mean square."""
    T_BF, x_S = scene(9)
    reach = np.sqrt((x_S**2).sum(1).mean())
    rows = [np.hstack([np.kron(np.eye(3), x / reach), np.eye(3), -T[:3, :3].T]) for T, x in zip(T_BF, x_S)]
    _, found = hand_eye._linear_solution(T_BF, x_S, np.ones(9))
    assert found == pytest.approx(1 / np.linalg.cond(np.vstack(rows)), rel=1e-9)
    assert hand_eye._linear_solution(T_BF[:4], x_S[:4], np.ones(4))[1] == 0.0


@pytest.mark.parametrize("known", [True, False])
def test_singular_values_are_those_of_the_weighted_jacobian_in_lengths(known):
    """Turns times the root-mean-square distance of the sphere; with a free radius, columns of length one."""
    T_BF, x_S = scene(12)
    x_S[:3] += 40.0
    found = hand_eye.calibrate_sphere_target(T_BF, x_S, TARGET0 if known else None, robust=True)
    w, J = found.weights, hand_eye.joint_jacobian(T_BF, x_S, found.T_FS, target_free=not known)
    reach = np.sqrt((w * (x_S**2).sum(1)).sum() / w.sum())
    J = np.sqrt(np.repeat(w, 3))[:, None] * J / np.r_[[reach] * 3, np.ones(J.shape[1] - 3)]
    np.testing.assert_allclose(found.singular_values, np.linalg.svd(J, compute_uv=False), rtol=1e-9)


def test_singular_values_with_a_free_radius_are_those_of_columns_of_length_one(monkeypatch):
    T_BF, x_S = scene(12)
    J = np.random.default_rng(3).normal(size=(36, 10)) * np.r_[np.full(3, 200.0), np.ones(7)]
    fit = hand_eye.SphereRadius(T_FS0, TARGET0, T_BF, x_S, np.ones(12), np.zeros(1), radius=30.0)
    monkeypatch.setattr(hand_eye, "radius_jacobian", lambda *given: J)
    np.testing.assert_allclose(
        fit.singular_values, np.linalg.svd(J / np.linalg.norm(J, axis=0), compute_uv=False), rtol=1e-9
    )


def test_orientations_count_as_one_up_to_the_angle_asked_for():
    """Pairs turned by 0.009 deg are translated ones, by 0.011 deg they are not; 1 deg when asked for."""
    T_BF, _ = scene(6)

    def seen_after(turn_deg, **more):
        turns = exp_so3(np.deg2rad(turn_deg) * np.eye(3))
        T = np.concatenate([T_BF, T_BF[:1] @ frames.pose(turns, 60.0 * np.eye(3))])
        x_S = frames.transform(frames.invert(T @ T_FS0), TARGET0)
        return li_two_step(T, x_S, **more)[0]

    np.testing.assert_allclose(seen_after(0.006)[:3, :3], T_FS0[:3, :3], atol=2e-3)  # 0.006 deg move it 0.07 mm of 60
    np.testing.assert_allclose(seen_after(0.6, max_turn_deg=1.0)[:3, :3], T_FS0[:3, :3], atol=0.2)
    seen_after(0.98, max_turn_deg=1.0)
    for turn, least, limit in ((0.011, "0.011", 0.0105), (1.2, "1.2", 1.0)):
        with pytest.raises(ValueError, match=f"the nearest differ by {least} deg"):
            seen_after(turn, max_turn_deg=limit)


def test_scenes_of_the_literature_fill_their_ranges():
    """The scanner within 100 mm along each axis of the flange, the sphere within 500 mm; 40 scenes fill this."""
    rng = np.random.default_rng(0)
    scenes = [literature.suitable_scene(0.1, rng) for _ in range(40)]
    for values, half in (([s.T_FS[:3, 3] for s in scenes], 100.0), ([s.target for s in scenes], 500.0)):
        values = np.array(values)
        assert (
            np.abs(values).max() <= half and (values.min(0) < -0.8 * half).all() and (values.max(0) > 0.8 * half).all()
        )
    x_S = np.array([s.x_S[:12] for s in scenes])
    assert (x_S[..., :2].min((0, 1)) < [-24, -19]).all() and (x_S[..., :2].max((0, 1)) > [24, 19]).all()
    turns = np.array([Rotation.from_matrix(s.T_FS[:3, :3]).as_rotvec() for s in scenes])
    assert (turns.min(0) < -0.8).all() and (turns.max(0) > 0.8).all() and np.abs(turns).max() <= 1
    shifts = np.array([s.T_BF[0, :3, :3].T @ (s.T_BF[12:, :3, 3] - s.T_BF[0, :3, 3])[..., None] for s in scenes])[
        ..., 0
    ]
    np.testing.assert_allclose(
        shifts, np.tile([[30.0, 0, 0], [0, 30, 0], [0, 0, 30], [-30, 20, 10]], (40, 1, 1)), atol=1e-9
    )
    assert (np.abs(x_S[..., :2]).max((0, 1)) < [26, 21]).all() and 188 < x_S[..., 2].min() < x_S[..., 2].max() < 292


@pytest.mark.parametrize("room", [hand_eye, fast_hand_eye])
def test_a_fit_that_runs_out_of_steps_says_so(room, monkeypatch):
    T_BF, x_S = scene(12, std=3.0)
    x_S[:2] += 25.0
    for robust in (False, True):
        assert room.calibrate_sphere_target(T_BF, x_S, robust=robust).converged
    monkeypatch.setattr(hand_eye, "MAX_STEPS", 1)
    for robust in (False, True):
        assert not room.calibrate_sphere_target(T_BF, x_S, robust=robust).converged


def test_the_right_angled_rotations_are_the_24_of_a_cube():
    cube = {tuple(R.round().astype(int).ravel()) for R in Rotation.create_group("O").as_matrix()}
    found = [tuple(R.astype(int).ravel()) for R in hand_eye.right_angled()]
    assert len(found) == 24 and set(found) == cube


def test_the_distance_of_many_sets_is_that_of_each():
    sets = np.random.default_rng(3).normal(size=(2, 4, 5, 3))
    expected = [[np.sqrt(np.mean([r @ r for r in rows])) for rows in few] for few in sets]
    np.testing.assert_allclose(hand_eye.rms_distance(sets), expected)


def test_one_center_in_the_scan_plane_is_enough_to_refuse():
    T_BF, x_S = scene(6)
    x_S[2, 1] = 0.0
    with pytest.raises(ValueError, match="no center in the scan plane"):
        hand_eye.radius_jacobian(T_BF, x_S, T_FS0, 20.0)
    with pytest.raises(ValueError, match="off the scan plane"):
        hand_eye.fit_radius(T_BF, x_S, 20.0)


@pytest.mark.parametrize("room", [hand_eye, fast_hand_eye])
@pytest.mark.parametrize(
    ("along", "around", "words"),
    [(0.0, 1e-10, "at one place"), (1e-5, 1e-10, "at one place"), (1e-2, 1e-10, "on one line")],
)
def test_what_rounding_makes_of_a_place_is_a_place(room, along, around, words):
    """Beside a distance of 720 mm, the root of nine times 240 squared: a millionth of it along, of that across."""
    rng = np.random.default_rng(6)
    x_S = np.array([0.0, 5.0, 240.0]) + rng.uniform(-1, 1, (9, 1)) * [0, 0, along] + around * rng.normal(size=(9, 3))
    T_BF = planning.poses_that_see(T_FS0, TARGET0, exp_so3(rng.uniform(-1, 1, (9, 3))), x_S)
    with pytest.raises(ValueError, match=words):
        room.calibrate_sphere_target(T_BF, x_S)


def test_only_where_the_linear_system_says_nothing_are_right_angles_tried(monkeypatch):
    tried = []
    everywhere = hand_eye.right_angled
    monkeypatch.setattr(hand_eye, "right_angled", lambda: tried.append(1) or everywhere()[:2])
    hand_eye.calibrate_sphere_target(*scene(12))
    assert not tried
    hand_eye.calibrate_sphere_target(*scene(4))
    assert tried


@pytest.mark.parametrize("turn", [0.3, 1.5, 2.2, 2.8, 3.1])
def test_a_step_that_ends_higher_is_cut_where_its_parabola_is_lowest(turn):
    """Written out: slope at the start, heights at both ends, a tenth at least."""
    T_BF, x_S = scene(9, std=0.5)
    ones = np.ones(9)
    R = T_FS0[:3, :3] @ exp_so3(turn * np.array([0.6, 0.0, 0.8]))
    linear = np.concatenate([T_BF[:, :3, :3], np.tile(-np.eye(3), (9, 1, 1))], axis=2).reshape(27, 6)
    fixed = (T_BF[:, :3, :3] @ (x_S @ R.T)[..., None])[..., 0] + T_BF[:, :3, 3]
    shift = -np.linalg.lstsq(linear, fixed.ravel(), rcond=None)[0]
    T, target = frames.pose(R, shift[:3]), shift[3:]

    def after(step):
        moved = frames.pose(T[:3, :3] @ exp_so3(step[:3]), T[:3, 3] + step[3:6]), target + step[6:]
        return *moved, (hand_eye.sphere_residuals(T_BF, x_S, *moved) ** 2).sum()

    cost = after(np.zeros(9))[2]
    r, J = hand_eye.sphere_residuals(T_BF, x_S, T, target).ravel(), hand_eye.joint_jacobian(T_BF, x_S, T)
    step = np.linalg.lstsq(J, -r, rcond=None)[0]
    slope, cuts = r @ J @ step, 0  # half the derivative of the cost along the step
    while after(step)[2] > cost:
        rise = after(step)[2] - cost
        share = max(0.1, -2 * slope / (2 * (rise - 2 * slope)))
        step, slope, cuts = share * step, share * slope, cuts + 1
    found, center, history = hand_eye._gauss_newton(R, T_BF, x_S, ones, 1)
    np.testing.assert_allclose(found, after(step)[0], atol=1e-7)
    np.testing.assert_allclose(center, after(step)[1], atol=1e-6)
    np.testing.assert_allclose(history, np.sqrt(np.array([cost, after(step)[2]]) / 9))


def test_plain_steps_have_settled_when_all_parts_are_short():
    T_BF, x_S = scene(9)
    start = frames.kuka_from_matrix(
        frames.pose(T_FS0[:3, :3] @ exp_so3([0.02, 0.0, 0.01]), T_FS0[:3, 3] + [1.0, 0, 3.0])
    )
    told = {"parameters": "se3", "max_steps": 1}
    poses = hand_eye.gauss_newton_pose(start, T_BF, x_S, TARGET0, **told).poses
    turned = Rotation.from_matrix(poses[0, :3, :3].T @ poses[1, :3, :3]).as_rotvec()
    longest = max(np.abs(poses[1, :3, 3] - poses[0, :3, 3]).max(), np.abs(turned).max() * hand_eye.rms_distance(x_S))
    for share, settled in ((0.99, False), (1.01, True)):
        again = hand_eye.gauss_newton_pose(start, T_BF, x_S, TARGET0, tolerance=share * longest, **told)
        assert again.converged is settled


@pytest.mark.parametrize("room", [hand_eye, fast_hand_eye])
def test_of_exact_poses_all_count_and_what_is_off_does_not(room):
    T_BF, x_S = scene(15, std=0.0)
    x_S[0, 0] = T_BF[0, 0, 3] = 0.0  # a coordinate that happens to be zero
    x_S = planning.sphere_in_scanner(T_BF, T_FS0, TARGET0)
    x_S[[3, 8]] += [[1e-5, 0, 0], [0, 5.0, 0]]
    found = room.calibrate_sphere_target(T_BF, x_S, robust=True)
    assert found.weights.tolist() == [float(k not in (3, 8)) for k in range(15)]
    lengths = np.linalg.norm(found.residuals, axis=1)
    assert found.history[-1] == pytest.approx(np.sqrt((lengths**2).mean()), rel=1e-6)


def test_kim_needs_a_cube_in_every_pose():
    T_BF, X_S, cube = cube_scene()[:3]
    X_S = X_S.copy()
    X_S[4, :, 2] = 0.0
    with pytest.raises(ValueError, match="span space in every pose"):
        kim_linear(T_BF, X_S, cube)


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_li_s_first_step_takes_any_unit(unit):
    rng = np.random.default_rng(3)
    T_BF = frames.pose(np.tile(exp_so3([0.3, 0.1, -0.4]), (5, 1, 1)), unit * rng.uniform(-99, 99, (5, 3)))
    x_S = frames.transform(frames.invert(T_BF @ T_FS0), unit * TARGET0)
    np.testing.assert_allclose(literature.li_rotation(T_BF, x_S), T_FS0[:3, :3], atol=1e-7)
    T_BF[:, :3, 3] = np.outer(unit * rng.uniform(-99, 99, 5), [1.0, 2.0, 0.5])
    with pytest.raises(ValueError, match="along one line"):
        literature.li_rotation(T_BF, frames.transform(frames.invert(T_BF @ T_FS0), unit * TARGET0))
