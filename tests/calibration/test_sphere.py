"""Circles and spheres against closed forms, SciPy, finite differences and Monte Carlo."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from labkit.calibration import sphere


def arc(center, radius, half_angle, n, std=0.0, seed=0):
    rng = np.random.default_rng(seed)
    angle = np.linspace(-half_angle, half_angle, n)
    r = radius + std * rng.normal(size=n)
    return center[0] + r * np.sin(angle), center[1] - r * np.cos(angle)


@pytest.mark.parametrize("half_angle", [0.05, 0.5, 3.0])
def test_noise_free_circle_is_found_by_both_fits(half_angle):
    x, z = arc((3.0, 240.0), 28.5, half_angle, 30)
    fit = sphere.fit_circle(x, z)
    np.testing.assert_allclose([*fit.center, fit.radius], [3.0, 240.0, 28.5], rtol=1e-9)
    center, radius = sphere.fit_circle_algebraic(x, z)
    np.testing.assert_allclose([*center, radius], [3.0, 240.0, 28.5], rtol=1e-9)


def test_many_scan_lines_at_once():
    lines = [arc((3.0 + k, 240.0), 25.0 + k, 0.6, 30, std=0.1, seed=k) for k in range(4)]
    centers, radii = sphere.fit_circle_algebraic(*np.moveaxis(lines, 1, 0))
    for k, line in enumerate(lines):
        center, radius = sphere.fit_circle_algebraic(*line)
        np.testing.assert_allclose([*centers[k], radii[k]], [*center, radius], rtol=1e-12)


def test_geometric_circle_is_the_least_squares_circle_of_scipy():
    x, z = arc((3.0, 240.0), 28.5, 0.6, 40, std=0.2)
    fit = sphere.fit_circle(x, z)
    want = least_squares(lambda q: np.hypot(x - q[0], z - q[1]) - q[2], [0, 239, 27], xtol=1e-14, ftol=1e-14)
    np.testing.assert_allclose([*fit.center, fit.radius], want.x, rtol=1e-7)
    cov = 2 * want.cost / 37 * np.linalg.inv(want.jac.T @ want.jac)
    np.testing.assert_allclose(fit.covariance, cov, rtol=1e-4)
    np.testing.assert_allclose(fit.residuals, want.fun, atol=1e-6)


def test_algebraic_circle_of_a_short_arc_is_too_small_and_the_geometric_one_is_not():
    found = (
        np.array(
            [
                (sphere.fit_circle_algebraic(x, z)[1], sphere.fit_circle(x, z).radius)
                for x, z in (arc((0.0, 240.0), 28.0, 0.35, 60, std=0.15, seed=k) for k in range(300))
            ]
        )
        - 28.0
    )
    error = found.std(0) / np.sqrt(300)
    assert found[:, 0].mean() < -8 * error[0]
    assert abs(found[:, 1].mean()) < 0.35 * abs(found[:, 0].mean())


def test_sphere_fit_against_scipy():
    rng = np.random.default_rng(2)
    v = rng.normal(size=(60, 3))
    v[:, 2] = -np.abs(v[:, 2])
    points = [5.0, -3.0, 240.0] + 30 * v / np.linalg.norm(v, axis=1, keepdims=True) + 0.1 * rng.normal(size=v.shape)
    fit = sphere.fit_sphere(points)
    want = least_squares(lambda q: np.linalg.norm(points - q[:3], axis=1) - q[3], [0, 0, 230, 25], xtol=1e-14)
    np.testing.assert_allclose([*fit.center, fit.radius], want.x, rtol=1e-7)


@pytest.mark.parametrize("side", [1, -1])
def test_center_from_a_scan_line(side):
    center = np.array([4.0, side * 9.2, 235.0])
    x, z = sphere.scan_line(center, 30.0, 0.8, 50)
    np.testing.assert_allclose(sphere.sphere_center_from_profile(x, z, 30.0, side), center, atol=1e-8)
    wrong = sphere.sphere_center_from_profile(x, z, 30.0, -side)
    assert wrong[1] == pytest.approx(-center[1])  # the other center explains the scan line as well


def test_sensitivity_is_the_derivative_and_diverges_at_the_equator():
    h = 1e-6
    d = sphere.center_offset
    by_R, by_r = sphere.offset_sensitivity(30.0, 28.0)
    assert by_R == pytest.approx((d(30 + h, 28.0) - d(30 - h, 28.0)) / (2 * h), rel=1e-6)
    assert by_r == pytest.approx((d(30.0, 28 + h) - d(30.0, 28 - h)) / (2 * h), rel=1e-6)
    assert np.isneginf(sphere.offset_sensitivity(30.0, 30.0)[1])


def test_center_covariance_against_monte_carlo():
    center, std = np.array([4.0, 12.0, 235.0]), 0.05
    rng = np.random.default_rng(3)
    found = np.array(
        [
            sphere.sphere_center_from_profile(*sphere.scan_line(center, 30.0, 0.9, 80, std, rng), 30.0, 1)
            for _ in range(800)
        ]
    )
    x, z = sphere.scan_line(center, 30.0, 0.9, 80)
    cov = sphere.profile_center_covariance(30.0, sphere.fit_circle(x, z, std=std), 1)
    np.testing.assert_allclose(found.std(0), np.sqrt(np.diag(cov)), rtol=0.1)


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda: sphere.fit_circle([0, 1], [0, 1]), "same shape"),
        (lambda: sphere.fit_circle([0, 1, 2, 3], [0, 2, 4, 6]), "collinear"),
        (lambda: sphere.fit_circle([0, 1, np.nan], [0, 1, 5]), "finite"),
        (lambda: sphere.fit_sphere([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]), "one plane"),
        (lambda: sphere.sphere_center_from_profile([0, 1, 2], [0, 1, 0], 30.0, 0), r"side must be \+1 or -1"),
        (lambda: sphere.center_offset(30.0, 30.1), "larger than the sphere"),
        (lambda: sphere.scan_line([0, 40, 200], 30.0, 1.0, 5), "misses the sphere"),
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize("unit", [1e-9, 1e-3, 1e9])
def test_fits_do_not_depend_on_the_unit_of_length(unit):
    points = np.random.default_rng(3).normal(size=(9, 3))
    ball, scaled = sphere.fit_sphere(points), sphere.fit_sphere(unit * points)
    np.testing.assert_allclose(scaled.center / unit, ball.center, rtol=1e-9)
    x, z = arc((3.0, 200.0), 20.0, 1.0, 30, std=0.5)
    circle, scaled = sphere.fit_circle(x, z), sphere.fit_circle(unit * x, unit * z)
    np.testing.assert_allclose(scaled.center / unit, circle.center, rtol=1e-9)


def test_an_uncertain_radius_moves_the_center_across_the_scan_plane():
    circle = sphere.fit_circle(*arc([2.0, 240.0], 20.0, 1.0, 60, 0.05), std=0.05)
    step = 1e-5
    by_R = (
        (sphere.center_offset(30.0 + step, circle.radius) - sphere.center_offset(30.0 - step, circle.radius)) / 2 / step
    )
    more = sphere.profile_center_covariance(30.0, circle, 1, 0.3) - sphere.profile_center_covariance(30.0, circle, 1)
    np.testing.assert_allclose(more, np.diag([0.0, (0.3 * by_R) ** 2, 0.0]), rtol=1e-6, atol=1e-12)


def test_a_fit_that_does_not_settle_says_so(monkeypatch):
    monkeypatch.setattr(sphere, "MAX_STEPS", 1)
    x, z = arc([2.0, 240.0], 20.0, 0.5, 30, 0.2)
    with pytest.raises(ValueError, match="does not settle: after 1 steps the radius is"):
        sphere.fit_circle(x, z)


class Started(Exception):
    """Carries the start of a fit out of it."""


def test_the_algebraic_start_of_a_sphere_is_exact_without_noise(monkeypatch):
    """Gauss-Newton forgives most starts, so the start is looked at alone: a shallow cap far from the origin."""

    def stop(points, start):
        raise Started(start)

    monkeypatch.setattr(sphere, "_geometric", stop)
    v = np.random.default_rng(6).normal(size=(40, 3)) * [0.3, 0.3, 0.0] + [0.0, 0.0, 1.0]
    points = [900.0, -400.0, 250.0] + 30.0 * v / np.linalg.norm(v, axis=1, keepdims=True)
    with pytest.raises(Started) as caught:
        sphere.fit_sphere(points)
    np.testing.assert_allclose(caught.value.args[0], [900.0, -400.0, 250.0, 30.0], rtol=1e-9)


def test_the_scanner_sees_the_side_of_the_sphere_that_faces_it():
    center, radius = np.array([5.0, 12.0, 240.0]), 30.0
    x, z = sphere.scan_line(center, radius, 0.7, 9)
    cut = np.sqrt(radius**2 - 12.0**2)
    assert (np.diff(x) > 0).all() and x[0] == pytest.approx(5.0 - cut * np.sin(0.7))
    np.testing.assert_allclose(z, 240.0 - np.sqrt(cut**2 - (x - 5.0) ** 2))


def test_a_line_beside_the_origin_is_no_arc_and_flat_points_are_no_sphere():
    with pytest.raises(ValueError, match="collinear"):
        sphere.fit_circle(np.linspace(-5, 5, 9), np.full(9, 240.0))
    rng = np.random.default_rng(1)
    for unit in (1e-6, 1e6):
        points = rng.normal(size=(12, 3))
        points *= unit / np.linalg.norm(points, axis=1, keepdims=True)
        assert sphere.fit_sphere(points).radius == pytest.approx(unit)
        with pytest.raises(ValueError, match="one plane"):
            sphere.fit_sphere(points * [1, 1, 1e-14])


def test_points_at_the_middle_of_all_are_points():
    """On the axes of the sphere or circle two coordinates, or one, are those of the middle."""
    found = sphere.fit_sphere(30.0 * np.concatenate([np.eye(3), -np.eye(3)]))
    np.testing.assert_allclose([*found.center, found.radius], [0, 0, 0, 30.0], atol=1e-9)
    center, radius = sphere.fit_circle_algebraic([30.0, 0, -30, 0], [0, 30.0, 0, -30])
    np.testing.assert_allclose([*center, radius], [0, 0, 30.0], atol=1e-9)


def test_a_fit_goes_on_while_any_of_its_unknowns_moves():
    """Mirror images about x = 0: that coordinate of the center is right from the start."""
    x, z = arc((0.0, 240.0), 28.5, 0.6, 20, std=0.5)
    x, z = np.concatenate([x, -x]), np.concatenate([z, z])
    found = sphere.fit_circle(x, z)
    best = least_squares(lambda q: np.hypot(x, z - q[0]) - q[1], [240.0, 28.0], xtol=1e-15, ftol=1e-15, gtol=1e-15).x
    np.testing.assert_allclose([found.center[1], found.radius], best, rtol=1e-8)


@pytest.mark.parametrize("start", [(0.0, 0.0, 1.0), (40.0, -9.0, 5.0), (0.0, 0.5, 90.0)])
def test_steps_that_go_too_far_are_halved(start):
    """From bad starts, where a whole step would raise the sum of squares; the minimum is SciPy's."""
    x, z = arc((3.0, 10.0), 28.5, 1.2, 25, std=0.3)
    points = np.column_stack([x, z])
    found, residuals, J = sphere._geometric(points, np.array(start))
    best = least_squares(lambda q: np.hypot(x - q[0], z - q[1]) - q[2], found, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    np.testing.assert_allclose(found, best.x, atol=1e-6)
    assert np.abs(J.T @ residuals).max() < 1e-6
