"""The linear Kalman filter against Bayes' rule, least squares, the Riccati equation, and its own statistics."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from labkit.documents.lecture import printed as lecture
from labkit.documents.lecture.examples import predict_vehicle, reconstruct_vehicle, simulate_vehicle
from labkit.estimation import kalman

RUNS = 200
ONE = [[1.0]]


def random_covariance(rng, n):
    M = rng.normal(size=(n, n))
    return M @ M.T + 0.1 * np.eye(n)


# --- filter -------------------------------------------------------------------


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
        for field in ("x", "cov", "innovation", "cov_innovation", "gain", "dof"):
            np.testing.assert_allclose(getattr(run, field)[k], getattr(step, field), atol=1e-14)
    assert run.gain[2].tolist() == [[0.0], [0.0]] and run.dof.tolist() == [1, 1, 0, 1, 1, 1]


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


def test_a_series_without_steps_is_empty():
    run = kalman.filter_steps(np.zeros((0, 1)), np.eye(2), [[1.0, 0.0]], ONE, np.zeros(2), np.eye(2))
    shapes = [run.x.shape, run.cov.shape, run.innovation.shape, run.cov_innovation.shape, run.gain.shape, run.dof.shape]
    assert shapes == [(0, 2), (0, 2, 2), (0, 1), (0, 1, 1), (0, 2, 1), (0,)]


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


def test_joseph_stays_right_in_single_precision_and_the_short_form_does_not():
    """1 - K is 1e-9, and single precision makes it 0 or +-6e-8: what the short form is left with is rounding alone."""
    cov, C, cov_z = np.array([[1e6]]), np.array([[1.0]]), np.array([[1e-3]])
    for form in kalman.FORMS:
        P = cov
        for _ in range(2):
            P = kalman.update([0.0], P, [0.0], C, cov_z, form=form, dtype=np.float32).cov
        assert P.dtype == np.float32
        off = abs(P[0, 0] - 5e-4) / 5e-4
        assert off < 1e-3 if form == "joseph" else off > 0.9
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


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_steady_state_of_numbers_too_far_apart_is_refused_in_a_sentence():
    with pytest.raises(ValueError, match="too unlike in size"):
        kalman.steady_state([[1.0, 0.1], [0.0, 1.0]], [[1e-320, 0.0]], np.diag([1e-6, 1.6e-3]), [[0.25]])


# --- consistency ---------------------------------------------------------------


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


def test_gate_lets_the_stated_share_pass():
    """20,000 draws at 95 %: the count is binomial, and 0.94 or 0.96 is 6.5 of its standard deviations away."""
    rng = np.random.default_rng(12)
    z, C, cov_z = 3 * rng.standard_normal((20_000, 2)), np.eye(2), random_covariance(rng, 2)
    step = kalman.update(np.zeros(2), 9 * np.eye(2) - 0.5 * cov_z, z, C, 0.5 * cov_z)
    np.testing.assert_allclose(step.cov_innovation, 9 * np.eye(2), atol=1e-12)
    assert abs(kalman.gate(step, 0.95).mean() - 0.95) < 0.01
    assert step.dof.tolist() == [2] * 20_000


def test_gate_draws_the_line_at_the_quantile_of_the_numbers_measured():
    for m in (1, 2, 3):
        limit = np.sqrt(stats.chi2.ppf(0.9, m))
        for factor, plausible in ((0.999, True), (1.001, False)):
            z = np.eye(m)[0] * limit * factor
            step = kalman.update(np.zeros(m), 0.5 * np.eye(m), z, np.eye(m), 0.5 * np.eye(m))
            assert kalman.gate(step, 0.9) == plausible, (m, factor)
            np.testing.assert_allclose(step.nis, (limit * factor) ** 2)


def test_nothing_measured_is_nothing_implausible():
    step = kalman.update(np.zeros(2), np.eye(2), None, np.eye(2), np.eye(2))
    assert step.dof == 0 and step.nis == 0 and kalman.gate(step)


def test_mean_band_is_where_the_mean_of_chi_squares_lies():
    """The sum of 50 chi-squares with 3 degrees of freedom is a chi-square with 150."""
    low, high = kalman.mean_band(3, 50, 0.9)
    np.testing.assert_allclose(stats.chi2.cdf([50 * low, 50 * high], 150), [0.05, 0.95], atol=1e-12)


def test_results_compare_by_identity_and_hold_what_they_say():
    step = kalman.update(np.zeros((5, 2)), np.eye(2), np.ones((5, 1)), [[1.0, 0.0]], ONE)
    assert step == step and step != kalman.update(np.zeros((5, 2)), np.eye(2), np.ones((5, 1)), [[1.0, 0.0]], ONE)
    assert [step.x.shape, step.gain.shape, step.dof.shape, step.nis.shape] == [(5, 2), (2, 1), (5,), (5,)]
    np.testing.assert_allclose(step.nis, 0.5)  # innovation 1, variance 1 + 1


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
        (lambda: kalman.filter_steps([[1.0, np.nan]], ONE, [[1.0]] * 2, np.eye(2), [0.0], ONE), "z must be finite"),
        (lambda: kalman.filter_steps([[1.0]], np.ones((2, 1, 1)), ONE, ONE, [0.0], ONE), r"A must have shape \(1, 1\)"),
        (lambda: kalman.filter_steps([[1.0]], ONE, ONE, ONE, [0.0], ONE, ONE, [[1.0], [2.0]]), "B u must have shape"),
    ],
)
def test_bad_input_is_refused_in_words(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_simulated_vehicle_spreads_as_predicted():
    """Of 2000 drives; a variance is known to 3.2 %, so 20 % are six standard deviations."""
    variances, rng = {"var_x0": 0.5, "var_v0": 0.1, "var_a": 0.3}, np.random.default_rng(3)
    drives = [simulate_vehicle(10, 0.1, **variances, var_z=0.25, rng=rng) for _ in range(2000)]
    ends, measured = np.array([x[-1] for x, _ in drives]), np.array([z[-1] for _, z in drives])
    x, P = predict_vehicle(10, 0.1, **variances)
    np.testing.assert_array_less(np.abs(ends.mean(0) - x), 6 * np.sqrt(np.diag(P) / 2000))
    np.testing.assert_allclose(np.diag(np.cov(ends.T)), np.diag(P), rtol=0.2)
    assert np.var(measured - ends[:, 0]) == pytest.approx(0.25, rel=0.2)
