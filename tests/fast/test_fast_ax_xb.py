"""Hand-eye calibration from sums equals the readable one, and a batch of motions equals its single runs."""

import numpy as np
import pytest

from labkit.calibration import ax_xb as readable
from labkit.fast import ax_xb as fast
from labkit.geometry.frames import invert, pose
from labkit.geometry.lie import exp_so3

SENSOR = pose(exp_so3([0.3, -0.5, 1.1]), [30.0, -20.0, 120.0])
TARGET = pose(exp_so3([2.0, 0.4, -0.3]), [700.0, 80.0, -150.0])


def readings(n, std_rot, std_trans, eye="in hand", turn=1.0):
    rng = np.random.default_rng(n)
    T_BF = pose(exp_so3(turn * rng.uniform(-1, 1, (n, 3))), rng.uniform(-200, 200, (n, 3)))
    robot = T_BF if eye == "in hand" else invert(T_BF)
    T_ST = invert(SENSOR) @ invert(robot) @ TARGET
    noise = pose(exp_so3(std_rot * rng.normal(size=(n, 3))), np.zeros(3))
    T_ST = T_ST @ noise
    T_ST[:, :3, 3] += std_trans * rng.normal(size=(n, 3))
    return T_BF, T_ST


def estimates(result):
    return (result.T_FS, result.T_BT) if isinstance(result, readable.EyeInHand) else (result.T_BS, result.T_FT)


@pytest.mark.parametrize("eye", ["in hand", "to hand"])
@pytest.mark.parametrize("n", [3, 20, 100])
@pytest.mark.parametrize("options", [{}, {"std_rot": 2e-3, "std_trans": 0.3}, {"std_rot": 2e-3}, {"std_trans": 0.3}])
def test_random_readings_give_the_same_result(eye, n, options):
    data = readings(n, 2e-3, 0.3, eye)
    one, two = (m.calibrate_hand_eye(*data, **options, eye=eye) for m in (readable, fast))
    for a, b in zip(estimates(one), estimates(two)):
        np.testing.assert_allclose(b, a, atol=1e-7)
    for name in ("residuals", "std", "covariance", "singular_values"):
        a, b = getattr(one, name), getattr(two, name)
        np.testing.assert_allclose(b, a, rtol=1e-5, atol=1e-5 * np.abs(a).max())


@pytest.mark.parametrize("noise", [(0.0, 0.0), (2e-3, 0.3)])
def test_single_precision_and_noise_free_readings(noise):
    data = [T.astype(np.float32) for T in readings(20, *noise)]
    one, two = (m.calibrate_hand_eye(*data) for m in (readable, fast))
    np.testing.assert_allclose(two.T_FS, one.T_FS, atol=1e-7)
    np.testing.assert_allclose(one.T_FS, SENSOR, atol=1.0)


def test_outliers_get_the_same_weights():
    T_BF, T_ST = readings(30, 2e-3, 0.3)
    T_ST[::5, :3, 3] += 100.0
    one, two = (m.calibrate_hand_eye(T_BF, T_ST, robust=True) for m in (readable, fast))
    np.testing.assert_allclose(two.weights, one.weights, atol=1e-4)
    np.testing.assert_allclose(two.T_FS, one.T_FS, atol=1e-5)
    assert (one.weights[::5] == 0).all()


@pytest.mark.parametrize("turn", [0.01, 0.1])
def test_small_turns_give_the_same_result(turn):
    data = readings(20, 1e-4, 0.01, turn=turn)
    one, two = (m.calibrate_hand_eye(*data) for m in (readable, fast))
    np.testing.assert_allclose(two.T_FS, one.T_FS, atol=1e-8 / turn**2)


@pytest.mark.parametrize("turns", [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
def test_both_refuse_with_the_same_words(turns):
    T_BF = pose(exp_so3(np.linspace(0, 1, 6)[:, None] * turns), np.arange(18.0).reshape(6, 3))
    words = []
    for module in (readable, fast):
        with pytest.raises(ValueError) as refused:
            module.calibrate_hand_eye(T_BF, invert(SENSOR) @ invert(T_BF) @ TARGET)
        words.append(str(refused.value))
    assert words[0] == words[1] and "sensor and target can be shifted together" in words[0]


def test_a_batch_of_motions_equals_its_single_runs():
    rng = np.random.default_rng(1)
    A = pose(exp_so3(rng.uniform(-1, 1, (2, 3))), rng.uniform(-100, 100, (2, 3)))
    B = invert(SENSOR) @ A @ SENSOR @ pose(exp_so3(0.01 * rng.normal(size=(7, 2, 3))), rng.normal(size=(7, 2, 3)))
    found = fast.solve_ax_xb(A, B)
    assert found.shape == (7, 4, 4)
    for one, b in zip(found, B):
        np.testing.assert_allclose(one, readable.solve_ax_xb(A, b), atol=1e-9)
    with pytest.raises(ValueError, match="must have shapes"):
        fast.solve_ax_xb(A, B[0, :1])
    still = np.tile(np.eye(4), (2, 1, 1))
    assert np.isfinite(fast.solve_ax_xb(still, still)).all()
