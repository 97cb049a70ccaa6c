"""The landmark filter against finite differences, least squares, the unscented transform, and 200 runs of its own."""

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import least_squares

from labkit.estimation import kalman
from labkit.fast.ekf import ekf_localize
from labkit.geometry import planar
from labkit.localization import ekf, odometry

RUNS = 200
LANDMARKS = np.array([[4.0, 6.0], [-5.0, 4.0], [-3.0, -6.0], [6.0, -3.0]])
CONTROLS = np.tile([1.0, 0.3], (120, 1))
COV_U = np.diag([0.05**2, np.radians(3) ** 2])
STD_RANGE, STD_BEARING = 0.1, np.radians(1)
COV0 = np.diag([0.1**2, 0.1**2, np.radians(3) ** 2])


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


def test_unscented_update_is_the_textbooks_sum_over_seven_points():
    """A wide prior next to a landmark, where the mean of the points lies far from the point of the mean."""
    x, cov, marks = np.array([0.2, -0.1, 0.4]), np.diag([0.3, 0.2, 0.05]), np.array([[1.5, 0.8], [-2.0, 1.0]])
    cov[0, 1] = cov[1, 0] = 0.1
    z = ekf.measurement([0.5, 0.1, 0.3], marks)
    z[1] = np.nan
    columns = np.sqrt(3) * np.linalg.cholesky(cov).T
    points, weights = [x, *(x + columns), *(x - columns)], [0.0, *[1 / 6] * 6]
    h = [ekf.measurement(point, marks)[0] for point in points]  # of the landmark seen; no bearing near +-pi
    mean = sum(w * value for w, value in zip(weights, h))
    S = sum(w * np.outer(v - mean, v - mean) for w, v in zip(weights, h)) + np.diag([0.1**2, 0.02**2])
    K = sum(w * np.outer(p - x, v - mean) for w, p, v in zip(weights, points, h)) @ np.linalg.inv(S)
    assert np.abs(mean - h[0]).max() > 0.01
    found = ekf.unscented_update(x, cov, z, marks, 0.1, 0.02)
    np.testing.assert_allclose(found.innovation, [*(z[0] - mean), 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(found.cov_innovation[:2, :2], S, atol=1e-12)
    np.testing.assert_allclose(found.x, x + K @ (z[0] - mean), atol=1e-12)
    np.testing.assert_allclose(found.cov, cov - K @ S @ K.T, atol=1e-12)


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
    marks, cov = np.array([[10.0, 0.0], [8.7, 1.6]]), np.diag([1e-4, 1e-4, np.radians(8) ** 2])
    truth = np.array([0.0, 0.0, np.radians(-8)])
    z = ekf.measurement(truth, marks)[:1]
    assert ekf.associate(np.zeros(3), cov, z, marks, 0.05, 0.01, by="nearest", probability=0.9999)[0] != 0
    assert ekf.associate(np.zeros(3), cov, z, marks, 0.05, 0.01)[0] == 0


def test_gate_counts_only_the_landmarks_seen():
    """One landmark of three: the NIS is chi-square with 2 degrees of freedom, and the gate passes its share, not more.

    20,000 draws: the Kolmogorov distance exceeds 0.02 with a probability below 2 exp(-2 * 20,000 * 0.02^2) = 3e-7, and
    the share of the gate is off by 0.02 at most (counted as six numbers, 99.9 % instead of 95 % would pass).
    """
    rng, runs = np.random.default_rng(13), 20_000
    x, cov = np.array([0.3, -0.2, 0.4]), np.diag([1e-4, 1e-4, 1e-6])  # so well known that the model is linear
    truth = x + rng.standard_normal((runs, 3)) * np.sqrt(np.diag(cov))
    z = ekf.measurement(truth, LANDMARKS[:3]) + rng.standard_normal((runs, 3, 2)) * [STD_RANGE, STD_BEARING]
    z[:, [0, 2]] = np.nan
    for step in (
        ekf.ekf_update(x, cov, z, LANDMARKS[:3], STD_RANGE, STD_BEARING),
        ekf.unscented_update(np.tile(x, (runs, 1)), cov, z, LANDMARKS[:3], STD_RANGE, STD_BEARING),
    ):
        assert step.dof.tolist() == [2] * runs
        assert stats.kstest(step.nis, stats.chi2(2).cdf).statistic < 0.02
        assert abs(kalman.gate(step, 0.95).mean() - 0.95) < 0.02
    alone = ekf.ekf_update(x, cov, z[:, 1:2], LANDMARKS[1:2], STD_RANGE, STD_BEARING)
    seen = ekf.ekf_update(x, cov, z, LANDMARKS[:3], STD_RANGE, STD_BEARING)
    for name in ("x", "cov", "nis", "dof"):  # what was not seen changes nothing
        np.testing.assert_allclose(getattr(seen, name), getattr(alone, name), atol=1e-12)


def test_a_whole_drive_is_its_steps_and_gates_like_them():
    drive = simulate(7, runs=3, reach=7.0)
    found = ekf.ekf_localize(CONTROLS, drive.z, LANDMARKS, np.zeros(3), COV0, 0.1, STD_RANGE, STD_BEARING, COV_U)
    x, cov = np.zeros((3, 3)), np.tile(COV0, (3, 1, 1))
    for k, u in enumerate(CONTROLS[:20]):
        moved, spread = odometry.propagate(x, cov, u, 0.1, COV_U, "euler")
        step = ekf.ekf_update(moved, spread, drive.z[k], LANDMARKS, STD_RANGE, STD_BEARING)
        x, cov = step.x, step.cov
        for name in ("x", "cov", "nis", "dof"):
            np.testing.assert_allclose(getattr(found, name)[k], getattr(step, name), atol=1e-12)
    assert kalman.gate(found, 1 - 1e-9).all() and kalman.gate(found).shape == (120, 3)


def test_further_noise_adds_to_the_prediction():
    cov_v, z = np.diag([0.1, 0.2, 0.03]), np.full((1, 4, 2), np.nan)
    found = ekf.ekf_localize([[1.0, 0.3]], z, LANDMARKS, np.zeros(3), COV0, 0.1, 0.1, 0.1, COV_U, cov_v)
    moved, spread = odometry.propagate(np.zeros(3), COV0, [1.0, 0.3], 0.1, COV_U, "euler")
    np.testing.assert_allclose(found.x[0], moved)
    np.testing.assert_allclose(found.cov[0], spread + cov_v)
    assert found.nis.tolist() == [0.0] and found.dof.tolist() == [0]


def on_landmark(**more):
    """A drive whose third step ends exactly on a landmark (dt = 1/2, 1 m/s straight on)."""
    marks, z = np.array([[1.5, 0.0], [9.0, 9.0]]), np.full((4, 2, 2), np.nan)
    return ekf.ekf_localize(np.tile([1.0, 0.0], (4, 1)), z, marks, np.zeros(3), COV0, 0.5, 0.1, 0.1, **more)


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: ekf.measurement_jacobian([4.0, 6.0, 0.0], LANDMARKS), "stands on a landmark"),
        (on_landmark, "stands on a landmark"),
        (lambda: on_landmark(cov_v=np.eye(2)), r"cov_v must have shape \(..., 3, 3\)"),
        (lambda: on_landmark(cov_u=np.ones((3, 2, 2))), r"cov_u must have shape \(2, 2\) or \(4, 2, 2\)"),
        (lambda: on_landmark(model="straight"), "model must be one of euler, midpoint, arc"),
        (lambda: ekf.associate(np.zeros(3), np.eye(3), [[1.0, 0.0]], LANDMARKS, 0.1, 0.1, by="eye"), "by must be"),
    ],
)
def test_bad_input_is_refused_in_words(call, words):
    with pytest.raises(ValueError, match=words):
        call()


@pytest.mark.parametrize("off", [(0.1, 0.0), (0.0, 0.02)])
def test_gate_of_the_association_is_the_quantile_of_the_noise(off):
    limit = np.sqrt(stats.chi2.ppf(0.95, 2))
    z = np.array([10.0, 0.0]) + np.outer([0.99 * limit, 1.01 * limit], off)
    found = ekf.associate(np.zeros(3), np.zeros((3, 3)), z, [[10.0, 0.0]], 0.1, 0.02, probability=0.95)
    assert found.tolist() == [0, -1]


def test_nearest_compares_the_places_where_the_readings_lie():
    """Without noise, from a turned pose, every reading lies on its own landmark."""
    x, cov = np.array([1.0, -2.0, 2.1]), np.diag([0.01, 0.01, 1e-4])
    z = ekf.measurement(x, LANDMARKS)
    every = np.arange(len(LANDMARKS))
    np.testing.assert_array_equal(ekf.associate(x, cov, z, LANDMARKS, 0.1, 0.02, by="nearest"), every)
