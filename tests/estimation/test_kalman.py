"""Kalman filters against Bayes' rule, least squares, finite differences, and their own statistics over 200 runs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from labkit.documents.lecture import printed as lecture
from labkit.documents.lecture.examples import predict_vehicle, reconstruct_vehicle
from labkit.estimation import kalman
from labkit.fast.ekf import ekf_localize
from labkit.fast.kalman import filter_series
from labkit.geometry import planar
from labkit.localization import ekf, odometry

RUNS = 200
ONE = [[1.0]]
LANDMARKS = np.array([[4.0, 6.0], [-5.0, 4.0], [-3.0, -6.0], [6.0, -3.0]])
CONTROLS = np.tile([1.0, 0.3], (120, 1))
COV_U = np.diag([0.05**2, np.radians(3) ** 2])
STD_RANGE, STD_BEARING = 0.1, np.radians(1)
COV0 = np.diag([0.1**2, 0.1**2, np.radians(3) ** 2])


def random_covariance(rng, n):
    M = rng.normal(size=(n, n))
    return M @ M.T + 0.1 * np.eye(n)


# --- linear -------------------------------------------------------------------


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_update_is_bayes_rule(seed):
    rng = np.random.default_rng(seed)
    x, cov, C, cov_z = rng.normal(size=3), random_covariance(rng, 3), rng.normal(size=(2, 3)), random_covariance(rng, 2)
    z = rng.normal(size=2)
    information = np.linalg.inv(cov) + C.T @ np.linalg.inv(cov_z) @ C
    expected = np.linalg.solve(information, np.linalg.solve(cov, x) + C.T @ np.linalg.solve(cov_z, z))
    for form in kalman.FORMS:
        found = kalman.update(x, cov, z, C, cov_z, form=form)
        np.testing.assert_allclose(found.cov, np.linalg.inv(information), atol=1e-8)
        np.testing.assert_allclose(found.x, expected, atol=1e-7)


def test_predict_is_the_lectures():
    A, B, _ = kalman.vehicle_model(0.1)
    x, cov = kalman.predict([1.0, 2.0], np.diag([1.0, 4.0]), A, B, u=[3.0], cov_u=[[0.5]], cov_v=0.1 * np.eye(2))
    np.testing.assert_allclose(x, [1.2, 2.3])
    np.testing.assert_allclose(cov, A @ np.diag([1, 4]) @ A.T + B @ [[0.5]] @ B.T + 0.1 * np.eye(2))


def test_no_measurement_is_no_correction():
    x, cov = np.array([1.0, 2.0]), np.array([[2.0, 0.3], [0.3, 1.0]])
    found = kalman.update(x, cov, None, [[1.0, 0.0]], [[1.0]])
    np.testing.assert_array_equal(found.x, x)
    np.testing.assert_array_equal(found.cov, cov)


def test_a_series_is_its_steps_and_a_row_of_nan_is_no_correction():
    rng, (A, B, C) = np.random.default_rng(4), kalman.vehicle_model(0.1)
    z = rng.standard_normal((6, 1))
    z[2] = np.nan
    cov_u, cov_v, cov_z = [[0.16]], 0.01 * np.eye(2), [[0.25]]
    run = kalman.filter_steps(z, A, C, cov_z, np.zeros(2), np.eye(2), B, [1.0], cov_u, cov_v)
    x, cov = np.zeros(2), np.eye(2)
    for k, value in enumerate(z):
        x, cov = kalman.predict(x, cov, A, B, [1.0], cov_u, cov_v)
        step = kalman.update(x, cov, None if k == 2 else value, C, cov_z)
        x, cov = step.x, step.cov
        for field in ("x", "cov", "innovation", "cov_innovation", "gain"):
            np.testing.assert_allclose(getattr(run, field)[k], getattr(step, field), atol=1e-14)
    assert run.gain[2].tolist() == [[0.0], [0.0]]


def test_whole_filter_is_weighted_least_squares():
    """The last state of a filter without system noise is the least-squares line through prior and measurements."""
    rng, n, dt = np.random.default_rng(2), 15, 0.5
    A, _, C = kalman.vehicle_model(dt)
    z = 1 + 0.7 * dt * np.arange(1, n + 1) + 0.3 * rng.standard_normal(n)
    x, cov = np.zeros(2), np.diag([4.0, 9.0])
    for value in z:
        x, cov = kalman.predict(x, cov, A)
        corrected = kalman.update(x, cov, [value], C, [[0.09]])
        x, cov = corrected.x, corrected.cov
    rows = np.vstack([np.diag([1 / 2, 1 / 3]), np.column_stack([np.ones(n), dt * np.arange(1, n + 1)]) / 0.3])
    start = np.linalg.lstsq(rows, np.concatenate([[0, 0], z / 0.3]), rcond=None)[0]
    np.testing.assert_allclose(x, [start[0] + n * dt * start[1], start[1]], atol=1e-9)


def test_fusion_of_the_lecture():
    given_ = lecture.example("fusion")
    found = kalman.update([0.0], [[20.0]], [9.4, 10.6], np.ones((2, 1)), np.diag([0.25, 1.0]))
    np.testing.assert_allclose(found.x, 48.2 / 5.05)
    np.testing.assert_allclose(found.cov, 1 / 5.05)
    assert round(float(found.x[0]), 1) == 9.5 != given_["x1"]


def test_vehicle_reconstruction():
    cov = np.array([[1.9469, 0.2550], [0.2550, 0.0916]])
    np.testing.assert_allclose(reconstruct_vehicle(cov, 51, 0.1), [1.0, 0.01, 0.16], atol=1e-9)
    x, P = predict_vehicle(51, 0.1, 1.0, 0.01, 0.16)
    np.testing.assert_allclose(P, cov, atol=1e-10)
    np.testing.assert_allclose(x, [12.75, 5.1])
    for steps in (48, 49, 50, 52):
        off = reconstruct_vehicle(cov, steps, 0.1) - [1.0, 0.01, 0.16]
        assert np.abs(off).max() > 6e-4
    assert (reconstruct_vehicle(cov, 51, 0.05) < 0).any()


def test_joseph_stays_positive_in_single_precision_and_the_short_form_does_not():
    cov, C, cov_z = np.array([[1e6]]), np.array([[1.0]]), np.array([[1e-3]])
    for form in kalman.FORMS:
        P = cov
        for _ in range(2):
            P = kalman.update([0.0], P, [0.0], C, cov_z, form=form, dtype=np.float32).cov
        assert P.dtype == np.float32
        assert (P[0, 0] > 0) == (form == "joseph")
    exact = kalman.update([0.0], kalman.update([0.0], cov, [0.0], C, cov_z, "short").cov, [0.0], C, cov_z, "short").cov
    np.testing.assert_allclose(exact, 5e-4, rtol=1e-6)


def test_steady_state_is_where_the_filter_settles():
    A, B, C = kalman.vehicle_model(0.1)
    cov_v, cov_z = 0.16 * B @ B.T + 1e-6 * np.eye(2), np.array([[0.25]])
    settled = kalman.steady_state(A, C, cov_v, cov_z)
    x, cov = np.zeros(2), np.eye(2)
    for _ in range(2000):
        x, cov = kalman.predict(x, cov, A, cov_v=cov_v)
        before = cov
        corrected = kalman.update(x, cov, [0.0], C, cov_z)
        cov = corrected.cov
    np.testing.assert_allclose(settled.gain, corrected.gain, rtol=1e-8)
    np.testing.assert_allclose(settled.cov_before, before, rtol=1e-8)
    np.testing.assert_allclose(settled.cov_after, cov, rtol=1e-8)


def test_steady_state_needs_what_is_unstable_to_be_measured():
    with pytest.raises(ValueError, match="no steady state"):
        kalman.steady_state(np.diag([1.1, 0.5]), [[0.0, 1.0]], np.eye(2), [[1.0]])


@pytest.mark.parametrize("n", [2, 3])
def test_series_filter_equals_the_loop(n):
    rng, dt = np.random.default_rng(3), 0.1
    A = np.eye(n) + dt * np.eye(n, k=1)
    C, cov_v, r = np.eye(n)[:1], 0.01 * random_covariance(rng, n), 0.04
    z = np.cumsum(rng.normal(size=800)) * 0.05 + 0.2 * rng.normal(size=800)
    x, cov, expected = np.zeros(n), np.eye(n), []
    for value in z:
        x, cov = kalman.predict(x, cov, A, cov_v=cov_v)
        corrected = kalman.update(x, cov, [value], C, [[r]])
        x, cov = corrected.x, corrected.cov
        expected.append(x)
    found = filter_series(z, A, C, cov_v, r, np.zeros(n), np.eye(n))
    np.testing.assert_allclose(found, expected, atol=1e-8)
    np.testing.assert_array_equal(filter_series(z[:5], A, C, cov_v, r, np.zeros(n), np.eye(n)), found[:5])


def test_linear_filter_is_consistent_and_an_overconfident_one_is_not():
    rng, (A, B, C) = np.random.default_rng(4), kalman.vehicle_model(0.1)
    start = np.diag([1.0, 0.01])
    truth = rng.standard_normal((RUNS, 2)) * np.sqrt(np.diag(start))
    noises = rng.standard_normal((50, RUNS, 2))
    for believed, inside in ((0.16, True), (0.016, False)):
        x_true, x, cov = truth.copy(), np.zeros((RUNS, 2)), np.broadcast_to(start, (RUNS, 2, 2))
        for a, w in np.moveaxis(noises, -1, 1):
            x_true = x_true @ A.T + (1.0 + 0.4 * a)[:, None] * B[:, 0]
            x, cov = kalman.predict(x, cov, A, B, u=[1.0], cov_u=[[believed]])
            corrected = kalman.update(x, cov, x_true[:, :1] + 0.5 * w[:, None], C, [[0.25]])
            x, cov = corrected.x, corrected.cov
        mean, (low, high) = kalman.nees(x_true, x, cov).mean(), kalman.mean_band(2, RUNS)
        assert (low < mean < high) == inside, mean


# --- landmarks ----------------------------------------------------------------


def test_measurement_jacobian_agrees_with_central_differences():
    rng, h = np.random.default_rng(5), 1e-6
    x = rng.uniform(-3, 3, (20, 3))
    H = ekf.measurement_jacobian(x, LANDMARKS)
    for i, e in enumerate(np.eye(3)):
        slope = ekf.measurement(x + h * e, LANDMARKS) - ekf.measurement(x - h * e, LANDMARKS)
        slope[..., 1] = planar.wrap_angle(slope[..., 1])
        np.testing.assert_allclose(H[..., i], slope / (2 * h), atol=1e-7)


def test_measurement_undoes_itself():
    x = np.array([1.0, -2.0, 2.5])
    z = ekf.measurement(x, LANDMARKS)
    back = x[:2] + z[:, :1] * np.column_stack([np.cos(x[2] + z[:, 1]), np.sin(x[2] + z[:, 1])])
    np.testing.assert_allclose(back, LANDMARKS, atol=1e-12)


def test_iterated_update_is_the_most_probable_pose():
    rng = np.random.default_rng(6)
    prior, cov = np.array([0.5, -0.3, 0.2]), np.diag([1.0, 1.0, 0.03])
    root = np.linalg.inv(np.linalg.cholesky(cov))
    z = ekf.measurement(prior + [0.8, -0.5, 0.1], LANDMARKS[:2]) + 0.02 * rng.standard_normal((2, 2))

    def residuals(x):
        y = z - ekf.measurement(x, LANDMARKS[:2])
        y[:, 1] = planar.wrap_angle(y[:, 1])
        return np.concatenate([root @ (x - prior), (y / [STD_RANGE, STD_BEARING]).ravel()])

    found = ekf.ekf_update(prior, cov, z, LANDMARKS[:2], STD_RANGE, STD_BEARING, iterations=30)
    best = least_squares(residuals, prior, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    np.testing.assert_allclose(found.x, best.x, atol=1e-6)
    np.testing.assert_allclose(found.cov, np.linalg.inv(best.jac.T @ best.jac), rtol=1e-4)


def simulate(seed, runs=RUNS, **more):
    rng = np.random.default_rng(seed)
    x0 = rng.standard_normal((runs, 3)) * np.sqrt(np.diag(COV0))
    drive = ekf.simulate_drive(x0, CONTROLS, 0.1, COV_U, LANDMARKS, STD_RANGE, STD_BEARING, rng, runs, **more)
    return drive


def localize(drive, **more):
    given_ = {"cov_u": COV_U, "std_range": STD_RANGE, "std_bearing": STD_BEARING} | more
    return ekf_localize(CONTROLS, drive.z, LANDMARKS, np.zeros(3), COV0, 0.1, **given_)


@pytest.mark.parametrize("model", ["euler", "midpoint"])
def test_fast_filters_equal_the_readable_one(model):
    drive = simulate(7, runs=3, reach=7.0, model=model)
    assert np.isnan(drive.z).any() and np.isfinite(drive.z).any()
    many = localize(drive, model=model)
    for run in range(3):
        one = ekf_localize(
            CONTROLS, drive.z[:, run], LANDMARKS, np.zeros(3), COV0, 0.1, STD_RANGE, STD_BEARING, COV_U, model=model
        )
        x, cov = np.zeros(3), COV0
        for k, u in enumerate(CONTROLS):
            step = ekf.ekf_step(x, cov, u, 0.1, COV_U, drive.z[k, run], LANDMARKS, STD_RANGE, STD_BEARING, model)
            x, cov = step.x, step.cov
            np.testing.assert_allclose(one.x[k], x, atol=1e-9)
            np.testing.assert_allclose(one.cov[k], cov, atol=1e-11)
            np.testing.assert_allclose(many.x[k, run], x, atol=1e-9)
            np.testing.assert_allclose(many.cov[k, run], cov, atol=1e-11)
            seen = np.isfinite(drive.z[k, run]).ravel()
            score = kalman.nis(step.innovation[seen], step.cov_innovation[np.ix_(seen, seen)]) if seen.any() else 0.0
            np.testing.assert_allclose([one.nis[k], many.nis[k, run]], score, atol=1e-7)
            assert one.dof[k] == many.dof[k, run] == seen.sum()


def test_landmark_filter_is_consistent_over_200_runs():
    drive = simulate(8)
    found = localize(drive)
    nees = kalman.nees(drive.truth[1:], found.x, found.cov, angle=2)
    low, high = kalman.mean_band(3, RUNS)
    for k in (10, 60, 119):
        assert low < nees[k].mean() < high, (k, nees[k].mean())
    low, high = kalman.mean_band(8, RUNS)
    assert low < found.nis[60].mean() < high


@pytest.mark.parametrize(
    "wrong",
    [{"std_range": STD_RANGE / 3, "std_bearing": STD_BEARING / 3}, {"cov_u": COV_U / 100}, {"wrap": False}],
    ids=["sensor believed too good", "drive believed too good", "not wrapped"],
)
def test_an_inconsistent_filter_is_caught_over_200_runs(wrong):
    drive = simulate(8)
    found = localize(drive, **wrong)
    nees = kalman.nees(drive.truth[1:], found.x, found.cov, angle=2)
    assert nees[119].mean() > kalman.mean_band(3, RUNS)[1]


def test_precise_sensor_and_poor_prior_break_the_plain_update_and_iterating_cures_it():
    rng, truth, marks = np.random.default_rng(9), np.zeros(3), np.array([[3.0, 0.0], [0.0, 4.0]])
    cov = np.diag([1.0, 1.0, np.radians(10) ** 2])
    prior = rng.standard_normal((RUNS, 3)) * np.sqrt(np.diag(cov))
    z = ekf.measurement(truth, marks) + rng.standard_normal((RUNS, 2, 2)) * [0.01, np.radians(0.2)]
    low, high = kalman.mean_band(3, RUNS)
    plain = ekf.ekf_update(prior, cov, z, marks, 0.01, np.radians(0.2))
    cured = ekf.ekf_update(prior, cov, z, marks, 0.01, np.radians(0.2), iterations=10)
    assert kalman.nees(truth, plain.x, plain.cov, angle=2).mean() > 100 * high
    assert low < kalman.nees(truth, cured.x, cured.cov, angle=2).mean() < high


def test_unscented_filter_agrees_where_the_models_are_nearly_linear():
    drive = simulate(10, runs=50)
    found = localize(drive)
    x, cov = np.zeros((50, 3)), np.broadcast_to(COV0, (50, 3, 3))
    for k, u in enumerate(CONTROLS[:60]):
        x, cov = ekf.unscented_predict(x, cov, u, 0.1, COV_U)
        step = ekf.unscented_update(x, cov, drive.z[k], LANDMARKS, STD_RANGE, STD_BEARING)
        x, cov = step.x, step.cov
    assert np.abs(x - found.x[59]).max() < 0.01
    np.testing.assert_allclose(cov, found.cov[59], atol=2e-4)


def test_unscented_transform_is_exact_for_a_linear_map():
    cov, cov_u = np.diag([0.1, 0.2, 1e-8]), np.diag([0.01, 1e-8])
    x, after = ekf.unscented_predict(np.zeros(3), cov, [1.0, 0.0], 0.1, cov_u)
    expected = odometry.propagate(np.zeros(3), cov, [1.0, 0.0], 0.1, cov_u, "euler")
    np.testing.assert_allclose(x, expected[0], atol=1e-8)
    np.testing.assert_allclose(after, expected[1], atol=1e-8)


def test_association():
    x, cov = np.zeros(3), np.diag([0.01, 0.01, 1e-4])
    z = ekf.measurement(x, LANDMARKS)[[2, 0, 3]]
    np.testing.assert_array_equal(ekf.associate(x, cov, z, LANDMARKS, 0.1, 0.02), [2, 0, 3])
    stray = np.array([[3.0, 0.0]])
    for by in ("mahalanobis", "nearest"):
        np.testing.assert_array_equal(ekf.associate(x, cov, stray, LANDMARKS, 0.1, 0.02, by=by), [-1])


def test_mahalanobis_and_nearest_can_disagree():
    """A turned robot: meters prefer the wrong landmark, innovations in units of their covariance the right one."""
    marks, cov = np.array([[10.0, 0.0], [10.0, 2.0]]), np.diag([1e-4, 1e-4, np.radians(8) ** 2])
    truth = np.array([0.0, 0.0, np.radians(-8)])
    marks = np.array([[10.0, 0.0], [8.7, 1.6]])
    z = ekf.measurement(truth, marks)[:1]
    assert ekf.associate(np.zeros(3), cov, z, marks, 0.05, 0.01, by="nearest", probability=0.9999)[0] != 0
    assert ekf.associate(np.zeros(3), cov, z, marks, 0.05, 0.01)[0] == 0


def test_gate_lets_the_stated_share_pass():
    rng = np.random.default_rng(12)
    S = random_covariance(rng, 2)
    y = rng.standard_normal((20_000, 2)) @ np.linalg.cholesky(S).T
    assert abs(kalman.gate(y, S, 0.95).mean() - 0.95) < 0.006


def test_nees_wraps_the_heading():
    cov = np.diag([1.0, 1.0, 0.01])
    np.testing.assert_allclose(kalman.nees([0, 0, 3.1], [0, 0, 3.1 - 2 * np.pi], cov, angle=2), 0, atol=1e-12)


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: kalman.predict(np.zeros(2), np.eye(3), np.eye(2)), r"cov must have shape \(..., 2, 2\)"),
        (lambda: kalman.predict(np.zeros(2), np.eye(2), np.eye(2), u=[1.0]), "B is missing"),
        (lambda: kalman.update(np.zeros(2), np.eye(2), [1.0], [[1.0]], [[1.0]]), "C must have shape"),
        (lambda: kalman.update([0.0], [[1.0]], [1.0], [[1.0]], [[1.0]], form="long"), "form must be one of"),
        (lambda: kalman.filter_steps([1.0], ONE, ONE, ONE, [0.0], ONE), r"z must have shape \(steps, 1\)"),
        (lambda: kalman.filter_steps([[np.inf]], ONE, ONE, ONE, [0.0], ONE), "z must be finite"),
        (lambda: ekf.measurement_jacobian([4.0, 6.0, 0.0], LANDMARKS), "stands on a landmark"),
        (lambda: filter_series(np.zeros((5, 2)), np.eye(2), [1, 0], np.eye(2), 1, [0, 0], np.eye(2)), "one num"),
        (lambda: localize(ekf.SimulatedRuns(None, None, np.zeros((3, 4, 2)))), "z must have shape"),
        (lambda: localize(simulate(1, runs=2), cov_u=np.ones((2, 2))), "diagonal"),
        (lambda: localize(simulate(1, runs=2), model="arc"), "model must be one of"),
        (lambda: ekf.associate(np.zeros(3), np.eye(3), [[1.0, 0.0]], LANDMARKS, 0.1, 0.1, by="eye"), "by must be"),
    ],
)
def test_bad_input_is_refused_in_words(call, words):
    with pytest.raises(ValueError, match=words):
        call()
