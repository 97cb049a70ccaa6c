"""What stays unknown, in words; one axis, mixed roles, open loops and blocks of rows."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from labkit.calibration import advice
from labkit.calibration.own_data import HandEyeModel
from labkit.geometry.frames import invert, pose


def turned(vectors, degrees=True):
    return pose(Rotation.from_rotvec(vectors, degrees=degrees).as_matrix(), np.zeros((len(vectors), 3)))


@pytest.mark.parametrize("sign", [1, -1])
def test_directions_in_words(sign):
    at = np.deg2rad
    assert advice.axis_name(sign * np.array([np.sin(at(19)), 0, np.cos(at(19))]), "flange") == "the flange's z axis"
    assert advice.axis_name(sign * np.array([0, np.cos(at(5)), np.sin(at(5))]), "base") == "the base's y axis"
    assert (
        advice.axis_name(sign * np.array([0.8, -0.6, 0.0]), "tool") == "the direction (0.80, -0.60, 0.00) of the tool"
    )


def test_how_unevenly_a_block_is_known():
    R = Rotation.from_euler("xyz", [40, 0, 0], degrees=True).as_matrix()
    ratio, words = advice.weak_direction(np.diag([1.0, 4.0, 144.0]), "flange", "turning about")
    assert ratio == pytest.approx(12)
    assert words == "turning about the flange's z axis is known 12 times worse than about the flange's x axis"
    ratio, words = advice.weak_direction(np.diag([6.25, 4.0, 1.0]), "base", "the position along")
    assert ratio == pytest.approx(2.5)
    assert words == "the position along the base's x axis is known 2.5 times worse than along the base's z axis"
    assert advice.weak_direction(R @ np.diag([3.9, 1.0, 1.0]) @ R.T, "base", "turning about")[1] is None
    words = advice.weak_direction(R @ np.diag([1.0, 1.5, 25.0]) @ R.T, "base", "turning about")[1]
    assert words.startswith("turning about the direction (0.00, -0.64, 0.77) of the base is known 5.0 times")
    assert advice.weak_direction(np.zeros((3, 3)), "base", "turning about") == (1.0, None)


def test_turns_about_the_principal_axes():
    """Ten degrees about one axis, three about another, both ways: rms over the poses, the middle one not turned."""
    R = Rotation.from_rotvec([0.3, -0.2, 0.9])
    vectors = R.apply([[10, 0, 0], [-10, 0, 0], [0, 0, 0], [0, 3, 0], [0, -3, 0]])
    first = Rotation.from_rotvec([1.0, 2.0, -0.5]).as_matrix()
    T = turned(vectors)
    T[:, :3, :3] = first @ T[:, :3, :3]
    spread, axes = advice.axis_spread(T)
    np.testing.assert_allclose(np.rad2deg(spread), [np.sqrt(200 / 5), np.sqrt(18 / 5), 0], atol=1e-6)
    np.testing.assert_allclose(np.abs(axes[:, :2].T @ R.apply(np.eye(3))[:2].T), np.eye(2), atol=1e-9)


def test_one_axis_is_refused_by_name():
    angles = np.linspace(-20, 20, 9)[:, None]
    with pytest.raises(ValueError, match=r"about one axis only, the flange's y axis, by 12\.9 deg, and by 0\.5\d* deg"):
        across = np.array([0.5, -0.5, 0.6, -0.6, 0, 0.6, -0.6, 0.5, -0.5])[:, None]
        advice.refuse_one_axis(turned(angles * [0, 1, 0] + across * [1, 0, 0]))
    with pytest.raises(ValueError, match=r"the pen does not turn, by 0\.13 deg"):
        advice.refuse_one_axis(turned(0.01 * angles * [0, 1, 0]), "the pen")
    advice.refuse_one_axis(turned(np.concatenate([angles * [0, 1, 0], 0.2 * angles * [1, 0, 0]])))


def cell(seed=2, n=12, std=0.0):
    rng = np.random.default_rng(seed)
    T_BF = pose(Rotation.from_rotvec(rng.uniform(-0.8, 0.8, (n, 3))).as_matrix(), rng.uniform(-300, 300, (n, 3)))
    X = pose(Rotation.from_rotvec([0.2, 0.4, -1.0]).as_matrix(), np.array([30.0, -50.0, 120.0]))
    Y = pose(Rotation.from_rotvec([1.0, -0.4, 0.3]).as_matrix(), np.array([700.0, 80.0, -40.0]))
    T_ST = invert(T_BF @ X) @ Y
    T_ST[:, :3, 3] += std * rng.normal(size=(n, 3))
    return T_BF, T_ST


@pytest.mark.parametrize("inverse", ["robot", "sensor"])
@pytest.mark.parametrize(("eye_to_hand", "other"), [(False, "or --eye-to-hand"), (True, "or no --eye-to-hand")])
def test_files_whose_inverse_fits_are_refused_and_both_named(inverse, eye_to_hand, other):
    """With the robot inverted the loop closes as it does with the sensor inverted, so the sentence names both."""
    T_BF, T_ST = cell(std=0.2)
    advice.refuse_mixed_roles(HandEyeModel(T_BF, T_ST), eye_to_hand)
    model = HandEyeModel(invert(T_BF), T_ST) if inverse == "robot" else HandEyeModel(T_BF, invert(T_ST))
    with pytest.raises(ValueError, match="sensor file holds the sensor in the target.*times better") as refusal:
        advice.refuse_mixed_roles(model, eye_to_hand)
    assert f"robot file the base in the flange, {other} was meant" in str(refusal.value)


@pytest.mark.parametrize(
    ("misfit", "times"),
    [
        ((11.0, 0.6), "11 times"),
        ((0.6, 11.0), "11 times"),
        ((11.0, 0.4), None),  # one is clearly better, the other worse
        ((9.0, 9.0), None),
        ((999.0, 2.0), "999 times"),
        ((2.0, 1500.0), "over 1000 times"),
    ],
)
def test_roles_are_refused_where_others_fit_ten_times_better_and_in_nothing_half_as_well(misfit, times, monkeypatch):
    """Angle and distance within which the inverse fits are 1 here."""
    model = HandEyeModel(*cell())
    other = SimpleNamespace(misfit=(1.0, 1.0))
    monkeypatch.setattr(advice, "HandEyeModel", lambda T_BF, T_ST: other)
    model._candidate = None, misfit
    if times is None:
        advice.refuse_mixed_roles(model, True)
    else:
        with pytest.raises(ValueError, match=f"closes {times} better"):
            advice.refuse_mixed_roles(model, True)


def test_rows_in_another_order_leave_the_loop_open():
    T_BF, T_ST = cell(n=30)
    residuals = np.zeros((30, 6))
    along, turn = advice.axis_spread(T_BF)[0][:2]
    residuals[:, 1], residuals[:, 4] = 0.29 * turn, 7.0
    advice.refuse_open_loop(T_BF, residuals)
    residuals[:, 1] = 0.31 * turn
    with pytest.raises(ValueError, match=rf"miss by {np.rad2deg(0.31 * turn):.3g} deg and 7 m \(rms\)") as refusal:
        advice.refuse_open_loop(T_BF, residuals, "m")
    turns = f"turn by {np.rad2deg(along):.3g} deg about one axis and by {np.rad2deg(turn):.3g} deg across it"
    assert turns in str(refusal.value)


@pytest.mark.parametrize(
    ("out", "block"),
    [
        (range(5, 9), (6, 9)),
        ([5, 6, 7], None),  # too few
        ([*range(5, 9), *range(10, 15)], (6, 15)),  # nine of ten
        ([5, 6, 8, 9, 11, 12], None),  # six of eight
        ([0, 1, 2, 3], (1, 4)),
    ],
)
def test_a_block_of_rows(out, block):
    kept = ~np.isin(np.arange(20), list(out))
    assert advice.moved_block(kept, True) == block
    assert advice.moved_block(kept, False) is None
