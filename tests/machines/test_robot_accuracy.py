"""Accuracy and repeatability: known shapes, invariance, the laws of a simulated robot, a gauge measured two ways."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from labkit.documents.thesis import printed as thesis
from labkit.geometry import frames
from labkit.machines import robot_accuracy as ra

STILL = np.random.default_rng(0)


def test_a_ring_has_its_radius_as_repeatability_and_its_center_as_accuracy():
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    reached = np.array([3.0, -4.0]) + 0.7 * np.column_stack([np.cos(angle), np.sin(angle)])
    assert ra.position_accuracy([0.0, 0.0], reached) == pytest.approx(5.0)
    assert ra.repeatability(reached) == pytest.approx(0.7)
    pair = np.array([[0.0, 0.0], [2.0, 0.0]])
    assert ra.repeatability(pair) == pytest.approx(1.0)
    three = np.array([[0.0], [0.0], [3.0]])  # distances 1, 1, 2: mean 4/3, standard deviation 1/sqrt(3)
    assert ra.repeatability(three) == pytest.approx(4 / 3 + np.sqrt(3))


def test_repeatability_needs_no_base_and_accuracy_does():
    rng = np.random.default_rng(1)
    command, reached = rng.normal(size=3), rng.normal(size=(20, 3))
    moved = reached @ Rotation.random(random_state=2).as_matrix().T + [100.0, 0, 0]
    assert ra.repeatability(moved) == pytest.approx(ra.repeatability(reached), rel=1e-9)
    assert ra.position_accuracy(command, moved) > 50 > ra.position_accuracy(command, reached)


def test_backlash_moves_the_mean_from_one_side_and_scatters_from_all():
    errors = ra.RobotErrors(np.zeros(2), backlash=0.5)
    one = ra.arrive(np.zeros(2), np.tile([1.0, 0.0], (10, 1)), errors, STILL)
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    ring = ra.arrive(np.zeros(2), np.column_stack([np.cos(angle), np.sin(angle)]), errors, STILL)
    assert (ra.position_accuracy([0, 0], one), ra.repeatability(one)) == pytest.approx((0.5, 0.0))
    assert (ra.position_accuracy([0, 0], ring), ra.repeatability(ring)) == pytest.approx((0.0, 0.5))


def test_the_noise_of_arriving_has_the_stated_deviation():
    """Of 4000 numbers the estimate scatters by 1.1 %; the generator is fixed."""
    reached = ra.arrive(np.zeros(2), np.ones((2000, 2)), ra.RobotErrors(np.zeros(2), std=0.2), np.random.default_rng(4))
    assert reached.std() == pytest.approx(0.2, rel=0.06)


def test_a_lag_delays_a_straight_path_by_speed_times_lag():
    """Once settled, a first-order lag T follows a constant speed v at the distance v T (here with steps of dt)."""
    speed, dt, lag = 200.0, 1e-4, 0.03
    command = np.column_stack([speed * dt * np.arange(4000), np.zeros(4000)])
    path = ra.drive(command, dt, ra.RobotErrors(np.zeros(2), lag=lag), STILL)[0]
    assert command[-1, 0] - path[-1, 0] == pytest.approx(speed * lag, rel=0.005)
    assert ra.drive(command, dt, ra.RobotErrors(np.zeros(2)), STILL)[0] == pytest.approx(command)


def test_path_numbers_are_the_worst_of_those_of_single_instants():
    rng = np.random.default_rng(3)
    command, dt = ra.corner(100.0, instants=21)
    paths = ra.drive(command, dt, ra.RobotErrors(np.array([0.4, 0.0]), std=0.1, lag=0.02), rng, n=8)
    each = [ra.position_accuracy(command[k], paths[:, k]) for k in range(21)]
    assert ra.path_accuracy(command, paths) == pytest.approx(max(each))
    assert ra.path_repeatability(paths) == pytest.approx(max(ra.repeatability(paths[:, k]) for k in range(21)))
    assert np.linalg.norm(np.diff(command, axis=0), axis=1) == pytest.approx(100.0 * dt)


def test_a_wrong_pose_of_the_scanner_shifts_alike_and_turns_with_the_flange():
    truth, cad = thesis.frame("scanner_end"), thesis.frame("scanner_start")
    marks = np.array([[1500.0, -650, 1100], [1500, -550, 1100]])
    for turn in (0.0, 0.7, np.pi):
        T_BF, x_S = ra.looking_down_at(marks, truth, [0.0, turn])
        assert frames.transform(T_BF, frames.transform(truth, x_S)) == pytest.approx(marks, abs=1e-9)
        assert T_BF[:, :3, :3] @ truth[:3, 2] == pytest.approx(np.tile([0, 0, -1.0], (2, 1)), abs=1e-9)
        p, q = frames.transform(T_BF, frames.transform(cad, x_S))
        shift = p - marks[0]
        turned = Rotation.from_rotvec([0, 0, turn]).apply(shift)
        assert q - p == pytest.approx(marks[1] - marks[0] + turned - shift, abs=1e-9)


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: ra.repeatability(np.zeros((1, 3))), "at least 2 arrivals"),
        (lambda: ra.position_accuracy([0.0, 0.0], np.zeros((4, 3))), "command"),
        (lambda: ra.path_accuracy(np.zeros((5, 2)), np.zeros((3, 4, 2))), "paths"),
        (lambda: ra.corner(0.0), "speed must be"),
        (lambda: ra.drive(np.zeros((3, 2)), 0.0, ra.RobotErrors(np.zeros(2)), STILL), "dt must be"),
    ],
)
def test_what_does_not_fit_is_refused(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_backlash_holds_a_robot_back_on_its_way():
    """It stops short of the command, and beyond it by the offset; exactly so without noise."""
    errors = ra.RobotErrors(np.array([0.1, 0.0, -0.2]), backlash=0.05)
    ways = np.array([[1.0, 0, 0], [0, -1.0, 0]])
    found = ra.arrive([10.0, 20.0, 30.0], ways, errors, STILL)
    np.testing.assert_allclose(found, [[10.05, 20.0, 29.8], [10.1, 20.05, 29.8]])


def test_paths_are_offset_and_noisy_as_stated():
    rng = np.random.default_rng(3)
    errors = ra.RobotErrors(offset=np.array([2.0, -1.0]), std=0.5)
    paths = ra.drive(np.zeros((50, 2)), 0.1, errors, rng, 40)
    np.testing.assert_allclose(paths.mean((0, 1)), [2.0, -1.0], atol=0.06)  # five standard deviations
    np.testing.assert_allclose(paths.std((0, 1)), 0.5, rtol=0.08)
