"""Lateration against closed forms, SciPy's least squares, and Monte Carlo."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from labkit.localization import lateration

TWO = np.array([[0.0, 0.0], [6.0, 0.0]])
FOUR = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])


def distances(landmarks, position):
    return np.linalg.norm(landmarks - np.asarray(position, dtype=float), axis=-1)


@settings(max_examples=60, deadline=None)
@given(st.tuples(*[st.floats(-8, 8)] * 6))
def test_newton_ends_in_an_intersection_of_the_circles(values):
    landmarks, position = np.reshape(values[:4], (2, 2)), np.array(values[4:])
    d = distances(landmarks, position)
    assume(d.min() > 0.1 and np.linalg.norm(landmarks[1] - landmarks[0]) > 0.5)
    a, b = landmarks[1] - landmarks[0], position - landmarks[0]
    assume(abs(a[0] * b[1] - a[1] * b[0]) > 0.05 * np.linalg.norm(a))
    roots = lateration.circle_intersections(landmarks, d)
    np.testing.assert_allclose(distances(landmarks, roots[0]), d, atol=1e-9)
    np.testing.assert_allclose(np.abs(roots - position).max(1).min(), 0, atol=1e-9)
    end = lateration.newton_lateration(landmarks, d, position + [0.02, -0.01])
    assert end.converged
    assert np.abs(roots - end.position).max(1).min() < 1e-8


def test_the_start_decides_between_the_two_roots():
    d = distances(TWO, [3, 2])
    np.testing.assert_allclose(lateration.newton_lateration(TWO, d, [4, 3]).position, [3, 2], atol=1e-12)
    np.testing.assert_allclose(lateration.newton_lateration(TWO, d, [4, -3]).position, [3, -2], atol=1e-12)


def test_newton_converges_quadratically():
    path = lateration.newton_lateration(TWO, distances(TWO, [3, 2]), [4, 3]).path
    error = np.linalg.norm(path - [3, 2], axis=1)[:4]
    assert (error[1:] < error[:-1] ** 2).all()


def test_newton_says_when_it_starts_on_the_line_of_the_landmarks():
    end = lateration.newton_lateration(TWO, distances(TWO, [3, 2]), [4, 0])
    assert not end.converged and "one line" in end.reason
    assert lateration.newton_lateration(TWO, distances(TWO, [3, 2]), [4, 1e-3]).converged


def test_newton_says_when_the_circles_do_not_meet():
    end = lateration.newton_lateration(TWO, [1.0, 1.0], [3, 1])
    assert not end.converged
    with pytest.raises(ValueError, match="do not meet"):
        lateration.circle_intersections(TWO, [1.0, 1.0])


def test_three_spheres_by_newton():
    landmarks = np.array([[0, 0, 0], [5, 0, 0.5], [1, 4, 0.2]])
    end = lateration.newton_lateration(landmarks, distances(landmarks, [2, 1, 2]), [1.5, 1.5, 3])
    np.testing.assert_allclose(end.position, [2, 1, 2], atol=1e-10)


@pytest.mark.parametrize("cost", lateration.COSTS)
def test_laterate_finds_the_minimum_scipy_finds(cost):
    rng = np.random.default_rng(7)
    for _ in range(5):
        landmarks, position = rng.uniform(0, 10, (5, 2)), rng.uniform(0, 10, 2)
        d = distances(landmarks, position) + 0.2 * rng.standard_normal(5) + 0.3

        def residuals(x, landmarks=landmarks, d=d):
            length = np.linalg.norm(x - landmarks, axis=1)
            return length**2 - d**2 if cost == "squares" else length - d

        found = lateration.laterate(landmarks, d, start=position, cost=cost)
        assert found.converged
        best = least_squares(residuals, position, xtol=1e-15, ftol=1e-15, gtol=1e-15).x
        np.testing.assert_allclose(found.position, best, atol=1e-6)


def test_laterate_reaches_its_bound_and_the_lectures_cost_does_not():
    rng, position, std = np.random.default_rng(11), np.array([9.0, 9.0]), 0.1
    d = distances(FOUR, position) + std * rng.standard_normal((20_000, 4))
    bound = std**2 * lateration.dilution(FOUR, position)
    rms = {}
    for cost in lateration.COSTS:
        found = lateration.laterate(FOUR, d, cost=cost, std=std)
        error = found.position - position
        rms[cost] = np.sqrt((error**2).sum(1).mean())
        np.testing.assert_allclose(found.covariance.mean(0), np.cov(error.T), atol=0.04 * bound.max())
    ml = rms["distance"] / np.sqrt(np.trace(bound))
    assert 0.98 < ml < 1.02
    assert rms["squares"] > 1.05 * rms["distance"]


def test_linear_start_is_exact_without_noise_and_worse_with_it():
    position = np.array([20.0, 12.0])
    d = distances(FOUR, position)
    np.testing.assert_allclose(lateration.linear_start(FOUR, d), position, atol=1e-10)
    noisy = d + 0.1 * np.random.default_rng(3).standard_normal((5000, 4))
    linear = np.linalg.norm(lateration.linear_start(FOUR, noisy) - position, axis=1)
    best = np.linalg.norm(lateration.laterate(FOUR, noisy).position - position, axis=1)
    assert np.sqrt((linear**2).mean()) > 1.3 * np.sqrt((best**2).mean())


def test_dilution_of_a_right_angle_is_one_and_grows_as_the_angle_closes():
    def at(angle):
        return lateration.dilution(5 * np.array([[1, 0], [np.cos(angle), np.sin(angle)]]), [0.0, 0.0])

    np.testing.assert_allclose(at(np.pi / 2), np.eye(2), atol=1e-12)
    for angle in (0.1, 0.5, 1.0):  # closed form: the trace is 2 / sin^2 of the angle between the directions
        np.testing.assert_allclose(np.trace(at(angle)), 2 / np.sin(angle) ** 2, rtol=1e-9)


def test_collinear_landmarks_leave_the_mirror_image():
    line = np.array([[0.0, 0.0], [4.0, 0.0], [9.0, 0.0]])
    d = distances(line, [5, 3])
    np.testing.assert_allclose(lateration.laterate(line, d, start=[5, 1]).position, [5, 3], atol=1e-8)
    np.testing.assert_allclose(lateration.laterate(line, d, start=[5, -1]).position, [5, -3], atol=1e-8)
    with pytest.raises(ValueError, match="mirror image"):
        lateration.laterate(line, d)
    trapped = lateration.laterate(line, d, start=[5.0, 0.0])
    assert abs(trapped.position[1]) < 1e-12 and np.isinf(trapped.covariance).all()
    assert trapped.singular_values[-1] < 1e-9


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: lateration.laterate(TWO[:1], [1.0]), "at least 2 landmarks"),
        (lambda: lateration.laterate(TWO, [1.0, 2.0, 3.0]), "one per landmark"),
        (lambda: lateration.laterate(TWO, [1.0, -2.0]), "positive"),
        (lambda: lateration.laterate(FOUR, np.ones(4), cost="cubes"), "cost must be one of"),
        (lambda: lateration.newton_lateration(FOUR, np.ones(4), [0, 0]), "use laterate"),
        (lambda: lateration.dilution(TWO, [3.0, 0.0]), "one line"),
        (lambda: lateration.dilution(TWO, [0.0, 0.0]), "coincides"),
        (lambda: lateration.laterate([[0, 0], [np.nan, 1]], [1.0, 1.0]), "finite"),
    ],
)
def test_bad_input_is_refused_in_words(call, words):
    with pytest.raises(ValueError, match=words):
        call()


@pytest.mark.parametrize("unit", [1e-9, 1e-3, 1e9])
@pytest.mark.parametrize("start", [None, [3.0, 9.0]])
def test_the_position_does_not_depend_on_the_unit_of_length(unit, start):
    d = distances(FOUR, [1.0, 2.0]) + [0.1, -0.1, 0.05, 0.1]
    expected = lateration.laterate(FOUR, d, start).position
    found = lateration.laterate(unit * FOUR, unit * d, None if start is None else unit * np.array(start))
    assert found.converged
    np.testing.assert_allclose(found.position / unit, expected, rtol=1e-7)


def test_square_jacobian_is_the_derivative_of_the_lectures_equations():
    position, d, h = np.array([1.0, 2.5]), distances(FOUR, [2.0, 3.0]), 1e-6
    J = lateration.square_jacobian(FOUR, position)
    for k, e in enumerate(h * np.eye(2)):
        ahead, behind = (lateration.square_residuals(FOUR, d, position + s * e) for s in (1, -1))
        np.testing.assert_allclose(J[:, k], (ahead - behind) / (2 * h), rtol=1e-8)


def test_the_search_stops_after_so_many_steps():
    d = distances(FOUR, [3.0, 4.0])
    far = np.array([80.0, -60.0])
    ends = [lateration.laterate(FOUR, d, far, steps=steps) for steps in (1, 2, 3, 50)]
    assert [end.iterations for end in ends[:3]] == [1, 2, 3] and not any(end.converged for end in ends[:3])
    away = [np.hypot(*(end.position - [3.0, 4.0])) for end in ends]
    assert away[0] > away[1] > away[2] > away[3] and ends[3].converged and 3 < ends[3].iterations < 50
    assert away[0] < np.hypot(*(far - [3.0, 4.0]))


def test_the_first_step_is_damped_by_a_thousandth_of_the_mean_diagonal():
    d, far = distances(FOUR, [3.0, 4.0]), np.array([8.0, -6.0])
    way = far - FOUR
    J, e = way / np.linalg.norm(way, axis=1)[:, None], np.linalg.norm(way, axis=1) - d
    N = J.T @ J
    step = np.linalg.solve(N + 1e-3 * np.trace(N) / 2 * np.eye(2), J.T @ e)
    np.testing.assert_allclose(lateration.laterate(FOUR, d, far, steps=1).position, far - step, rtol=1e-12)


def test_the_first_intersection_lies_left_of_the_way_between_the_centers():
    """A 3-4-5 triangle over the base, and its mirror image under it; turned around when the centers are."""
    found = lateration.circle_intersections([[0.0, 0.0], [5.0, 0.0]], [3.0, 4.0])
    np.testing.assert_allclose(found, [[1.8, 2.4], [1.8, -2.4]], atol=1e-12)
    found = lateration.circle_intersections([[5.0, 0.0], [0.0, 0.0]], [4.0, 3.0])
    np.testing.assert_allclose(found, [[1.8, -2.4], [1.8, 2.4]], atol=1e-12)


@pytest.mark.parametrize("unit", [1e-9, 1e9])
def test_newton_s_iteration_takes_any_unit(unit):
    d = distances(TWO, [3, 2])
    end = lateration.newton_lateration(unit * TWO, unit * d, unit * np.array([4.0, 3.0]))
    assert end.converged and len(end.path) < 10
    np.testing.assert_allclose(end.position / unit, [3, 2], rtol=1e-9)
    assert "one line" in lateration.newton_lateration(unit * TWO, unit * d, unit * np.array([4.0, 0.0])).reason
    assert "one line" not in lateration.newton_lateration(unit * TWO, unit * d, unit * np.array([4.0, 1e-5])).reason


def test_residuals_are_what_was_measured_less_what_was_computed_one_by_one():
    d = distances(FOUR, [3.0, 4.0]) + [[0.1, -0.2, 0.0, 0.3], [0.0, 0.2, 0.1, -0.1]]
    found = lateration.laterate(FOUR, d)
    lengths = np.array([distances(FOUR, x) for x in found.position])
    np.testing.assert_allclose(found.residuals, d - lengths, atol=1e-12)
    np.testing.assert_allclose(lateration.square_residuals(FOUR, d, found.position), lengths**2 - d**2, atol=1e-9)


def test_the_search_goes_on_while_any_coordinate_of_any_run_moves():
    """From the middle line the first coordinate is right at once; the other runs are one step away, and far."""
    d = distances(FOUR, [5.0, 3.0])
    starts = np.array([[5.0, 80.0], [5.0, 3.0], [200.0, -70.0]])
    found = lateration.laterate(FOUR, np.tile(d, (3, 1)), starts)
    assert found.converged.all()
    np.testing.assert_allclose(found.position, np.tile([5.0, 3.0], (3, 1)), atol=1e-9)


@pytest.mark.parametrize(("angle", "fixed"), [(1.6e-7, False), (2.5e-7, True)])
def test_directions_are_one_when_their_second_singular_value_is_a_ten_millionth(angle, fixed):
    """Two unit vectors at a small angle have the singular values sqrt(2) and angle / sqrt(2)."""
    marks = np.array([[1.0, 0.0], [1.0, angle]])
    found = lateration.laterate(marks, [1.0, 1.0], start=[0.0, 0.0])
    np.testing.assert_allclose(found.singular_values, [np.sqrt(2), angle / np.sqrt(2)], rtol=1e-6)
    assert np.isfinite(found.covariance).all() == fixed
    if fixed:
        assert np.trace(lateration.dilution(marks, [0.0, 0.0])) == pytest.approx(2 / angle**2, rel=1e-3)
    else:
        with pytest.raises(ValueError, match="one line"):
            lateration.dilution(marks, [0.0, 0.0])
