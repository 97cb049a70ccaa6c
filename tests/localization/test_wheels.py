"""Ackermann and Mecanum drives beside geometry, the matrix exponential and differences."""

import numpy as np
import pytest
from scipy.linalg import expm

from labkit.estimation.differences import numeric_jacobian
from labkit.localization import odometry, wheels

RNG = np.random.default_rng(3)


def matrix(pose):
    x, y, theta = pose
    return np.array([[np.cos(theta), -np.sin(theta), x], [np.sin(theta), np.cos(theta), y], [0, 0, 1]])


@pytest.mark.parametrize("steering", [0.5, -0.8, 1.2])
def test_a_car_turns_about_the_point_where_its_axles_meet(steering):
    """Every wheel's velocity, turned by a right angle, points at the center; the front wheel looks along its own."""
    v, omega = wheels.ackermann_to_twist([1.5, steering], 2.0)
    center = np.array([0.0, 2.0 / np.tan(steering)])  # on the rear axle, in the car's axes
    front = np.array([2.0, 0.0])
    velocity = np.array([v, 0.0]) + omega * np.array([-front[1], front[0]])
    assert np.arctan2(velocity[1], velocity[0]) == pytest.approx(steering)
    assert velocity @ (front - center) == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(odometry.turning_center([0, 0, 0], [v, omega]), center)


def test_a_car_straight_on_and_in_reverse():
    np.testing.assert_allclose(wheels.ackermann_to_twist([2.0, 0.0], 2.5), [2.0, 0.0])
    np.testing.assert_allclose(wheels.ackermann_to_twist([[-1.0, 0.3]], 2.5), [[-1.0, -np.tan(0.3) / 2.5]])


def test_derivative_by_speed_and_steering():
    for u in RNG.uniform([-2, -1.3], [2, 1.3], (10, 2)):
        numeric = numeric_jacobian(lambda u: wheels.ackermann_to_twist(u, 1.7), u)
        np.testing.assert_allclose(wheels.ackermann_jacobian(u, 1.7), numeric, rtol=1e-6, atol=1e-8)


def test_the_rollers_of_a_mecanum_wheel_let_only_one_direction_through():
    """A wheel drives along its own plane; its rollers add a free speed along their axle, 45 degrees aside. What is
    left of the contact's velocity across the roller's axle is the rim speed over the root of 2.
    """
    length, width, twist = 0.3, 0.2, np.array([0.4, -0.7, 1.1])
    places = np.array([[length, width], [length, -width], [-length, width], [-length, -width]])
    rolling = np.array([[1, -1], [1, 1], [1, 1], [1, -1]]) / np.sqrt(2)  # across the roller's axle
    contact = twist[:2] + twist[2] * np.stack([-places[:, 1], places[:, 0]], 1)
    rim = np.sqrt(2) * (contact * rolling).sum(1)
    np.testing.assert_allclose(wheels.mecanum_matrix(length, width) @ twist, rim)


def test_mecanum_wheels_tell_the_body_s_velocity_and_their_slip():
    M = wheels.mecanum_matrix(0.3, 0.2)
    twist = RNG.uniform(-1, 1, (5, 3))
    found, slip = wheels.mecanum_to_twist(twist @ M.T, 0.3, 0.2)
    np.testing.assert_allclose(found, twist, atol=1e-12)
    np.testing.assert_allclose(slip, 0, atol=1e-12)
    off = np.array([0.04, 0.0, 0.0, 0.0])
    found, slip = wheels.mecanum_to_twist(twist[0] @ M.T + off, 0.3, 0.2)
    np.testing.assert_allclose(found - twist[0], np.linalg.lstsq(M, off, rcond=None)[0], atol=1e-12)
    rest = off - M @ np.linalg.lstsq(M, off, rcond=None)[0]
    np.testing.assert_allclose(rest, slip * np.array([1, 1, -1, -1]), atol=1e-12)
    assert slip == pytest.approx(0.01)


def test_a_step_is_the_matrix_exponential():
    for x, twist in zip(RNG.uniform(-3, 3, (20, 3)), RNG.uniform(-2, 2, (20, 3))):
        vx, vy, omega = twist
        generator = np.array([[0, -omega, vx], [omega, 0, vy], [0, 0, 0]])
        np.testing.assert_allclose(
            matrix(wheels.step_twist(x, twist, 0.7)), matrix(x) @ expm(0.7 * generator), atol=1e-12
        )
    straight = wheels.step_twist([1.0, 2.0, np.pi / 2], [0.0, 0.5, 0.0], 2.0)
    np.testing.assert_allclose(straight, [0.0, 2.0, np.pi / 2], atol=1e-12)


def test_without_sideways_speed_it_is_the_arc_of_odometry():
    x, u = RNG.uniform(-3, 3, (6, 3)), RNG.uniform(-2, 2, (6, 2))
    twist = np.stack([u[:, 0], np.zeros(6), u[:, 1]], 1)
    np.testing.assert_allclose(wheels.step_twist(x, twist, 0.4), odometry.step(x, u, 0.4, "arc"), atol=1e-12)
    F_x, F_u = wheels.step_twist_jacobians(x, twist, 0.4)
    plain_x, plain_u = odometry.step_jacobians(x, u, 0.4, "arc")
    np.testing.assert_allclose(F_x, plain_x, atol=1e-12)
    np.testing.assert_allclose(F_u[..., [0, 2]], plain_u, atol=1e-12)


@pytest.mark.parametrize("omega", [0.0, 1e-4, 0.8, -2.5])
def test_derivatives_of_a_step(omega):
    x, twist = np.array([1.0, -2.0, 0.7]), np.array([0.8, -0.5, omega])
    F_x, F_u = wheels.step_twist_jacobians(x, twist, 0.9)
    np.testing.assert_allclose(F_x, numeric_jacobian(lambda x: wheels.step_twist(x, twist, 0.9), x), atol=1e-7)
    np.testing.assert_allclose(F_u, numeric_jacobian(lambda u: wheels.step_twist(x, u, 0.9), twist), atol=1e-7)


DRIVES = {
    "differential": wheels.differential_drive(0.8, 1.5),
    "Ackermann": wheels.ackermann_drive(0.8, 0.6, 1.1),
    "Mecanum": wheels.mecanum_drive(0.8, 1.5),
}


def test_shares_of_the_limits_become_the_body_s_velocity():
    half = {name: drive.twist(np.full((3, drive.numbers), -0.5)) for name, drive in DRIVES.items()}
    np.testing.assert_allclose(half["differential"], np.tile([-0.4, 0, -0.75], (3, 1)))
    np.testing.assert_allclose(half["Ackermann"], np.tile([-0.4, 0, 0.4 * np.tan(0.3) / 1.1], (3, 1)))
    np.testing.assert_allclose(half["Mecanum"], np.tile([-0.4, -0.4, -0.75], (3, 1)))


@pytest.mark.parametrize("name", DRIVES)
def test_the_nearest_command_misses_by_no_more_than_a_fine_grid(name):
    """Beside 300 000 commands tried; and where one of them was given as the spot, it is reached."""
    drive, dt, lever, rng = DRIVES[name], 1.5, 0.3, np.random.default_rng(5)
    axis = np.linspace(-1, 1, 551 if drive.numbers == 2 else 67)
    grid = np.stack(np.meshgrid(*[axis] * drive.numbers), -1).reshape(-1, drive.numbers)
    ends = wheels.step_twist(np.zeros(3), drive.twist(grid), dt)

    def miss(end, spot):
        off = end - spot
        turned = np.arctan2(np.sin(off[..., 2]), np.cos(off[..., 2]))
        return np.sqrt(off[..., 0] ** 2 + off[..., 1] ** 2 + (lever * turned) ** 2)

    for spot in rng.uniform([-1.5, -1.5, -np.pi], [1.5, 1.5, np.pi], (6, 3)):
        share = wheels.nearest_command(drive, spot, dt, lever)
        assert np.abs(share).max() <= 1
        found = miss(wheels.step_twist(np.zeros(3), drive.twist(share), dt), spot)
        assert found <= miss(ends, spot).min() + 1e-6
    for spot in ends[rng.integers(0, len(ends), 6)]:
        share = wheels.nearest_command(drive, spot, dt, lever)
        assert miss(wheels.step_twist(np.zeros(3), drive.twist(share), dt), spot) < 1e-5


def test_of_commands_that_miss_alike_the_one_ahead_is_taken():
    """A spot straight beside the robot: an arc ahead and one back end equally far from it."""
    assert wheels.nearest_command(DRIVES["differential"], [0, 1, 0], 2.0, 0.25)[0] > 0.05


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: wheels.ackermann_to_twist([1.0, np.pi / 2], 2.0), "less than a right angle"),
        (lambda: wheels.ackermann_to_twist([1.0, 0.1], 0.0), "wheelbase must be positive"),
        (lambda: wheels.mecanum_to_twist([1.0, 2.0, 3.0], 0.3, 0.2), "wheels must have"),
        (lambda: wheels.mecanum_matrix(0.3, -0.2), "half_width must be positive"),
        (lambda: wheels.step_twist(np.zeros(3), np.zeros(2), 0.1), "twist must have"),
        (lambda: wheels.step_twist(np.zeros(3), np.zeros(3), 0.0), "dt must be positive"),
        (lambda: wheels.nearest_command(DRIVES["Mecanum"], [0.0, 1.0], 2.0, 0.2), "spot must have"),
        (lambda: wheels.nearest_command(DRIVES["Mecanum"], [0.0, 1.0, 0.0], 2.0, 0.0), "lever must be positive"),
    ],
)
def test_refusals(call, words):
    with pytest.raises(ValueError, match=words):
        call()
