"""Dead reckoning against geometry, numerical integration, finite differences and Monte Carlo."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from labkit.documents.lecture import printed as lecture
from labkit.estimation import gaussian
from labkit.estimation.differences import numeric_jacobian
from labkit.geometry import planar
from labkit.localization import odometry

finite = st.floats(-3, 3, allow_nan=False)
DRIVE = lecture.circle_drive()


def test_wheels_and_twist_are_inverse():
    rng = np.random.default_rng(0)
    left, right = rng.normal(size=(2, 20))
    u = odometry.wheel_to_twist(left, right, 0.4)
    np.testing.assert_allclose(u[:, 0], (left + right) / 2)
    np.testing.assert_allclose(odometry.twist_to_wheel(u, 0.4), (left, right), atol=1e-14)


@settings(max_examples=40, deadline=None)
@given(st.tuples(finite, finite, finite), st.tuples(finite, finite), st.floats(0.01, 2))
def test_arc_is_the_integral_of_the_motion(x, u, dt):
    ode = solve_ivp(lambda t, s: [u[0] * np.cos(s[2]), u[0] * np.sin(s[2]), u[1]], (0, dt), x, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(odometry.step(x, u, dt, "arc"), ode.y[:, -1], atol=1e-7)


def test_arc_turns_about_the_center_of_rotation():
    x, u = np.array([1.0, 2.0, 0.7]), np.array([0.8, -0.5])
    center = odometry.turning_center(x, u)
    ahead = odometry.step(x, u, 1.3, "arc")
    np.testing.assert_allclose(odometry.turning_center(ahead, u), center, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(ahead[:2] - center), 0.8 / 0.5, atol=1e-12)
    with pytest.raises(ValueError, match="straight line"):
        odometry.turning_center(x, [1.0, 0.0])


def test_all_models_agree_on_a_straight_line_and_the_arc_is_smooth_there():
    x = np.array([0.0, 0.0, 0.4])
    for model in odometry.MODELS:
        np.testing.assert_allclose(odometry.step(x, [1, 0], 2, model), [2 * np.cos(0.4), 2 * np.sin(0.4), 0.4])
    for omega in (1e-12, 1e-8, 1e-5):
        near, at = odometry.step(x, [1, omega], 2, "arc"), odometry.step(x, [1, 0], 2, "arc")
        assert np.abs(near - at).max() < 3 * omega


@pytest.mark.parametrize("model, order", [("euler", 1), ("midpoint", 2)])
def test_order_of_accuracy(model, order):
    errors = []
    for steps in (20, 40, 80):
        controls = np.tile([1.0, 0.5], (steps, 1))
        end = odometry.drive(np.zeros(3), controls, 4 / steps, model)[-1]
        errors.append(np.linalg.norm((end - odometry.drive(np.zeros(3), controls, 4 / steps, "arc")[-1])[:2]))
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(slopes, order, atol=0.05)


@pytest.mark.parametrize("model", odometry.MODELS)
def test_jacobians_agree_with_central_differences(model):
    rng, h = np.random.default_rng(1), 1e-6
    x, u = rng.normal(size=(30, 3)), rng.normal(size=(30, 2))
    u[0, 1], u[1, 1], u[2, 1] = 0.0, 1e-4, 0.01
    F_x, F_u = odometry.step_jacobians(x, u, 0.7, model)
    for i, e in enumerate(np.eye(3)):
        slope = (odometry.step(x + h * e, u, 0.7, model) - odometry.step(x - h * e, u, 0.7, model)) / (2 * h)
        np.testing.assert_allclose(F_x[..., i], slope, atol=1e-8)
    for i, e in enumerate(np.eye(2)):
        slope = (odometry.step(x, u + h * e, 0.7, model) - odometry.step(x, u - h * e, 0.7, model)) / (2 * h)
        np.testing.assert_allclose(F_u[..., i], slope, atol=1e-8)


def test_printed_jacobians_of_the_simplified_model():
    T, v, theta = 0.1, 0.7, 0.3
    F_x, F_u = odometry.step_jacobians([1.0, 2.0, theta], [v, 0.2], T, "euler")
    np.testing.assert_allclose(F_x, [[1, 0, -T * v * np.sin(theta)], [0, 1, T * v * np.cos(theta)], [0, 0, 1]])
    np.testing.assert_allclose(F_u, [[T * np.cos(theta), 0], [T * np.sin(theta), 0], [0, T]])


def test_control_covariance_takes_absolute_values():
    noise = {"k_d": 0.01, "k_theta": 0.02, "k_drift": 0.03}
    for u in ([2, 1], [-2, 1], [2, -1], [-2, -1]):
        np.testing.assert_allclose(
            odometry.control_covariance(u, 0.1, **noise), np.diag([0.2, 0.2 + 0.6]), atol=1e-14, err_msg=str(u)
        )


def test_covariance_of_a_way_does_not_depend_on_the_time_step():
    covs = []
    for dt in (0.01, 0.1, 0.5):
        controls = np.tile([1.0, 0.0], (round(5 / dt), 1))
        covs.append(odometry.drive_with_covariance(np.zeros(3), np.zeros((3, 3)), controls, dt, **DRIVE.noise)[1][-1])
    for cov in covs:
        np.testing.assert_allclose(cov[0, 0], 5 * DRIVE.noise["k_d"])
        np.testing.assert_allclose(cov[2, 2], 5 * DRIVE.noise["k_drift"])
    # across the way the heading's random walk adds up to k s^3 / 3 in the limit of small steps
    np.testing.assert_allclose(covs[0][1, 1], DRIVE.noise["k_drift"] * 5**3 / 3, rtol=0.01)


def test_propagated_covariance_against_sampling():
    rng = np.random.default_rng(5)
    noise = {name: value / 25 for name, value in DRIVE.noise.items()}  # small enough for the first order to hold
    controls = DRIVE.controls[:60]
    cov = odometry.drive_with_covariance(np.zeros(3), np.zeros((3, 3)), controls, DRIVE.dt, **noise)[1][-1]
    ends = odometry.sample_drives(np.zeros(3), controls, DRIVE.dt, **noise, rng=rng, runs=10_000)[-1]
    root = np.linalg.inv(np.linalg.cholesky(cov))
    np.testing.assert_allclose(root @ np.cov(ends.T) @ root.T, np.eye(3), atol=0.05)


def test_the_banana_pulls_the_mean_back():
    """On a straight line the mean of cos of a Gaussian heading is exp(-var/2): the sampled mean lags behind."""
    rng = np.random.default_rng(6)
    std = np.radians(20)
    x = np.zeros((20_000, 3))
    x[:, 2] = std * rng.standard_normal(len(x))
    mean = odometry.step(x, [10.0, 0.0], 1.0).mean(0)
    np.testing.assert_allclose(mean[0], 10 * np.exp(-(std**2) / 2), atol=0.02)


def test_circle_drive_constants():
    assert DRIVE.controls.shape == (140, 2) and DRIVE.dt == 0.1
    np.testing.assert_allclose(DRIVE.noise["k_d"], 4e-4)
    np.testing.assert_allclose(np.degrees(DRIVE.controls[0, 1]), 24)
    poses = odometry.drive(np.zeros(3), DRIVE.controls, DRIVE.dt, "arc")
    np.testing.assert_allclose(np.degrees(poses[-1, 2]), 336)
    radius = 1 / np.radians(24)
    np.testing.assert_allclose(np.linalg.norm(poses[:, :2] - [0, radius], axis=1), radius)
    assert len(lecture.circle_drive(dt=0.5).controls) == 28


def test_functions_broadcast():
    x, u = np.zeros((7, 1, 3)), np.ones((5, 2))
    assert odometry.step(x, u, 0.1).shape == (7, 5, 3)
    F_x, F_u = odometry.step_jacobians(x, u, 0.1, "arc")
    assert F_x.shape == (7, 5, 3, 3) and F_u.shape == (7, 5, 3, 2)
    assert odometry.step(np.zeros(3), u, np.full(5, 0.1)).shape == (5, 3)


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: odometry.step([0, 0], [1, 0], 0.1), r"x must have shape \(..., 3\)"),
        (lambda: odometry.step([0, 0, 0], [1, 0], 0.0), "dt must be positive"),
        (lambda: odometry.step([0, 0, 0], [1, 0], 0.1, "rk4"), "model must be one of"),
        (lambda: odometry.step([0, 0, np.nan], [1, 0], 0.1), "finite"),
        (lambda: odometry.control_covariance([1, 0], 0.1, -1, 0, 0), "k_d must not be negative"),
        (lambda: odometry.propagate(np.zeros(3), np.eye(2), [1, 0], 0.1, np.eye(2)), "cov"),
        (lambda: odometry.wheel_to_twist(1, 1, 0), "track must be positive"),
        (lambda: odometry.drive(np.zeros(3), [1.0, 0.0], 0.1), "controls must have shape"),
    ],
)
def test_bad_input_is_refused_in_words(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_wrap_angle():
    wrapped = planar.wrap_angle([0.0, 3.5, -3.5, np.pi, 7.0])
    np.testing.assert_allclose(wrapped, [0, 3.5 - 2 * np.pi, 2 * np.pi - 3.5, -np.pi, 7 - 2 * np.pi])


def test_exponential_coordinates():
    rng = np.random.default_rng(2)
    xi = rng.uniform(-2, 2, (50, 3))
    np.testing.assert_allclose(planar.log_pose(planar.exp_pose(xi)), xi, atol=1e-12)
    arc = odometry.step(np.zeros(3), [0.7, -0.9], 1.0, "arc")
    np.testing.assert_allclose(planar.log_pose(arc), [0.7, 0, -0.9], atol=1e-12)
    x, y = rng.normal(size=(2, 50, 3))
    np.testing.assert_allclose(planar.compose_pose(x, planar.relative_pose(x, y))[:, :2], y[:, :2], atol=1e-12)
    T = expm(np.array([[0, -xi[0, 2], xi[0, 0]], [xi[0, 2], 0, xi[0, 1]], [0, 0, 0]]))
    np.testing.assert_allclose(planar.exp_pose(xi[0])[:2], T[:2, 2], atol=1e-12)


def test_ellipse_holds_its_share():
    rng, cov = np.random.default_rng(3), np.array([[2.0, 0.8], [0.8, 1.0]])
    outline = gaussian.ellipse([1.0, 2.0], cov, 0.9)
    d = outline - [1.0, 2.0]
    np.testing.assert_allclose((d * np.linalg.solve(cov, d.T).T).sum(1), -2 * np.log(0.1))
    samples = rng.multivariate_normal([1, 2], cov, 20_000)
    assert abs(gaussian.share_inside(samples, [1.0, 2.0], cov, 0.9) - 0.9) < 0.008
    assert gaussian.outlines(np.zeros((4, 2)), np.broadcast_to(cov, (4, 2, 2)), points=11).shape == (48, 2)


def test_noisy_controls_have_the_variances_of_the_error_model():
    u, dt, runs = np.array([[0.5, -0.3], [-0.2, 0.4]]), 0.2, 40_000
    noisy = odometry.noisy_controls(u, dt, 0.02, 0.03, 0.01, np.random.default_rng(6), runs)
    np.testing.assert_allclose(noisy.mean(1), u, atol=5 * 0.25 / np.sqrt(runs))
    expected = [[0.02 * 0.5 / dt, (0.03 * 0.3 + 0.01 * 0.5) / dt], [0.02 * 0.2 / dt, (0.03 * 0.4 + 0.01 * 0.2) / dt]]
    np.testing.assert_allclose(noisy.var(1), expected, rtol=5 * np.sqrt(2 / runs))


@pytest.mark.parametrize("h", [1e-9, 1e-4, 0.0099, 0.0101, 0.5, -2.0])
def test_the_slope_of_sinc_near_zero_and_beyond(h):
    """Its series to four more orders near zero, a difference of long step and high order elsewhere."""
    if abs(h) < 0.02:
        exact = h * (-1 / 3 + h**2 / 30 - h**4 / 840 + h**6 / 45360 - h**8 / 3991680)
        limit = 1e-15 if abs(h) < 1e-2 else 1e-9  # beyond, the closed form loses four digits
    else:
        exact, limit = float(numeric_jacobian(lambda x: np.sinc(x / np.pi), np.array([h]), 1e-3)[0, 0]), 1e-6
    assert odometry.sinc_slope(np.array(h)) == pytest.approx(exact, rel=limit)
