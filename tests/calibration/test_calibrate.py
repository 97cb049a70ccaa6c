"""Calibrations of one's own data: against the truth of simulated cells, and every refusal."""

import dataclasses
import json
import re

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from labkit.calibration import advice, calibrate
from labkit.calibration.own_data import FrameModel, HandEyeModel, PivotModel, SphereModel, majority
from labkit.estimation.differences import numeric_jacobian
from labkit.fast.ax_xb import calibrate_hand_eye
from labkit.geometry.frames import invert, pose
from labkit.geometry.lie import exp_so3, log_so3

X = pose(exp_so3([0.3, -1.1, 2.0]), [30.0, -20.0, 100.0])
Y = pose(exp_so3([1.0, 0.4, -0.2]), [700.0, 50.0, -60.0])
STD_ROT, STD_TRANS = np.deg2rad(0.1), 0.1


def cell(seed=0, n=20, std_rot=STD_ROT, std_trans=STD_TRANS, outliers=0, mounting=None, spread=0.5):
    """Flange poses, readings of a target, and which of them are wrong."""
    rng = np.random.default_rng(seed)
    robot = pose(exp_so3(spread * rng.normal(size=(n, 3))), rng.uniform(-200, 200, (n, 3)))
    sensor = invert(robot @ (X if mounting is None else mounting)) @ Y
    sensor[:, :3, :3] = sensor[:, :3, :3] @ exp_so3(std_rot * rng.normal(size=(n, 3)))
    sensor[:, :3, 3] += std_trans * rng.normal(size=(n, 3))
    bad = rng.permutation(n)[:outliers]
    sensor[bad, :3, :3] = exp_so3(0.3 * rng.normal(size=(outliers, 3))) @ sensor[bad, :3, :3]
    sensor[bad, :3, 3] += 50 * rng.normal(size=(outliers, 3))
    return robot, sensor, bad


def error(result):
    """Rotation vector about the sensor's axes and translation, estimate against truth."""
    return np.concatenate([log_so3(X[:3, :3].T @ result.T[:3, :3]), result.T[:3, 3] - X[:3, 3]])


def score(result):
    return error(result) @ np.linalg.solve(result.covariance, error(result))


# --- hand-eye --------------------------------------------------------------------------------------------------------


def test_outliers_are_named_and_cost_nothing():
    robot, sensor, bad = cell(outliers=6)
    result = calibrate.hand_eye(robot, sensor)
    assert result.rejected == sorted(bad + 1)
    good = np.setdiff1d(np.arange(20), bad)
    clean = calibrate.hand_eye(robot[good], sensor[good])
    assert np.allclose(result.T, clean.T, atol=1e-9) and np.allclose(result.covariance, clean.covariance)
    assert np.linalg.norm(result.plain.T[:3, 3] - X[:3, 3]) > 10 * np.linalg.norm(error(result)[3:])


def test_the_result_is_the_maximum_likelihood_estimate_of_scipy():
    robot, sensor, _ = cell(3, std_rot=2e-3)
    result = calibrate.hand_eye(robot, sensor, std_rot=2e-3, std_trans=0.1)

    def whitened(p):
        mount = pose(Rotation.from_rotvec(p[:3]).as_matrix(), p[3:6])
        target = pose(Rotation.from_rotvec(p[6:9]).as_matrix(), p[9:])
        off = np.linalg.inv(np.linalg.inv(robot @ mount) @ target)[:, :3, :3] @ sensor[:, :3, :3]
        gap = sensor[:, :3, 3] - (np.linalg.inv(robot @ mount) @ target)[:, :3, 3]
        return np.concatenate([Rotation.from_matrix(off).as_rotvec() / 2e-3, gap / 0.1], 1).ravel()

    start = np.concatenate([log_so3(X[:3, :3]), X[:3, 3], log_so3(Y[:3, :3]), Y[:3, 3]])
    best = least_squares(whitened, start, x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14).x
    assert np.allclose(log_so3(result.T[:3, :3]), best[:3], atol=1e-6)
    assert np.allclose(result.T[:3, 3], best[3:6], atol=1e-4)


def test_the_covariance_is_honest():
    """NEES of 100 runs of 6 numbers: chi-square with 600 degrees of freedom, at odds of 1e-6; fixed seeds."""
    total = sum(
        score(calibrate.hand_eye(*cell(seed, n=30)[:2], std_rot=STD_ROT, std_trans=STD_TRANS)) for seed in range(100)
    )
    assert stats.chi2.ppf(5e-7, 600) < total < stats.chi2.ppf(1 - 5e-7, 600)


def test_the_covariance_is_honest_where_the_noise_is_estimated_from_few_poses():
    """NEES of 120 runs of ten poses: its mean is that of 6 (f - 2) / f F(6, f), which is 6; f is at least 18 - 2, the
    band for odds of 1e-6 is the normal one of the mean; fixed seeds."""
    scores = [score(calibrate.hand_eye(*cell(seed, n=10)[:2], solver=calibrate_hand_eye)) for seed in range(120)]
    spread = 6 * (16 - 2) / 16 * stats.f(6, 16).std() / np.sqrt(120)
    assert abs(np.mean(scores) - 6) < 4.9 * spread
    told = calibrate.hand_eye(*cell(0, n=10)[:2], std_rot=STD_ROT, std_trans=STD_TRANS)
    assert told.as_dict()["noise_freedom"] == {"rotation_rad": None, "translation": None}


def test_few_rows_are_told_to_leave_the_noise_open():
    few = calibrate.hand_eye(*cell(3, n=4)[:2])
    assert any("degrees of freedom for the noise" in warning for warning in few.warnings)
    assert not calibrate.hand_eye(*cell(3, n=10)[:2]).warnings


def test_eye_to_hand_is_the_same_problem_with_the_robot_inverted():
    robot, sensor, _ = cell()
    one, other = calibrate.hand_eye(robot, sensor), calibrate.hand_eye(invert(robot), sensor, eye_to_hand=True)
    assert np.allclose(one.T, other.T) and np.allclose(one.T_target, other.T_target)
    assert one.meaning == "sensor in the flange" and other.meaning == "sensor in the base"
    assert np.allclose(one.next_poses, invert(other.next_poses))


@pytest.mark.parametrize("robot_inverse, sensor_inverse", [(0, 1), (1, 0)])
def test_mixed_up_roles_are_named(robot_inverse, sensor_inverse):
    robot, sensor, _ = cell(outliers=2)
    robot, sensor = (invert(T) if inverse else T for T, inverse in ((robot, robot_inverse), (sensor, sensor_inverse)))
    with pytest.raises(ValueError, match="holds the sensor in the target.*or --eye-to-hand was meant"):
        calibrate.hand_eye(robot, sensor)


def test_no_role_is_suspected_where_none_is_mixed_up():
    for seed in range(40):
        robot, sensor, _ = cell(seed, n=12, std_rot=5e-3, std_trans=2.0, outliers=3)
        advice.refuse_mixed_roles(HandEyeModel(robot, sensor), eye_to_hand=False)


def test_a_slipped_screw_is_dated():
    loose = X.copy()
    loose[:3, 3] += [0, 1.5, 2.0]
    mounting = np.where((np.arange(20) < 13)[:, None, None], X, loose)
    robot, sensor, _ = cell(5, mounting=mounting)
    result = calibrate.hand_eye(robot, sensor)
    assert result.rejected == list(range(14, 21))
    assert "did something slip before row 14?" in " ".join(result.warnings)
    assert score(result) < 40


def test_one_axis_is_refused_in_words():
    robot, sensor, _ = cell()
    flat = pose(exp_so3(np.outer(np.linspace(-1, 1, 20), [0, 0, 1])), robot[:, :3, 3])
    with pytest.raises(
        ValueError, match="turns about one axis only, the flange's z axis, by .* deg, and by 0 deg across"
    ):
        calibrate.hand_eye(flat, invert(flat @ X) @ Y)
    with pytest.raises(ValueError, match="the flange does not turn"):
        calibrate.hand_eye(pose(np.eye(3), robot[:, :3, 3]), sensor)


def test_a_weak_direction_is_named_and_the_next_poses_mend_it():
    rng = np.random.default_rng(2)
    turn = np.stack([0.03 * rng.normal(size=15), 0.03 * rng.normal(size=15), np.linspace(-1, 1, 15)], 1)
    robot = pose(exp_so3(turn), rng.uniform(-200, 200, (15, 3)))
    T = pose(np.eye(3), [0, 0, 100.0])
    result = calibrate.hand_eye(robot, invert(robot @ T) @ Y, std_rot=1e-3, std_trans=0.1)
    assert any("the position along the flange's z axis is known" in s and "times worse" in s for s in result.advice)
    assert (np.diff(result.next_std, axis=0) < 1e-15).all() and result.next_std[3, 5] < 0.4 * result.next_std[0, 5]
    # measured for real, the three poses give what was predicted
    more = np.concatenate([robot, result.next_poses])
    again = calibrate.hand_eye(more, invert(more @ T) @ Y, std_rot=1e-3, std_trans=0.1)
    assert np.allclose(again.std, result.next_std[3], rtol=1e-3)


def test_groups_are_left_out_together():
    robot, sensor, _ = cell(7, n=24)
    groups = np.repeat([1, 2, 3, 4], 6)
    result = calibrate.hand_eye(robot, sensor, groups=groups, std_rot=STD_ROT, std_trans=STD_TRANS)
    without = calibrate.hand_eye(robot[groups != 3], sensor[groups != 3], std_rot=STD_ROT, std_trans=STD_TRANS)
    moved = np.concatenate([log_so3(result.T[:3, :3].T @ without.T[:3, :3]), without.T[:3, 3] - result.T[:3, 3]])
    assert np.abs((result.group_shifts[3.0] - moved) / result.std).max() < 0.05  # first order
    i = 4
    kept = np.arange(24) != i
    alone = calibrate.hand_eye(robot[kept], sensor[kept], std_rot=STD_ROT, std_trans=STD_TRANS)
    predicted = invert(robot[i] @ alone.T) @ alone.T_target
    assert np.allclose(result.alone[i, 3:], sensor[i, :3, 3] - predicted[:3, 3], atol=5e-3)


# --- the other kinds -------------------------------------------------------------------------------------------------


def touching(n=16, bad=3):
    rng = np.random.default_rng(1)
    R, tip, point = exp_so3(0.5 * rng.normal(size=(n, 3))), np.array([10.0, 20, 150]), np.array([500.0, 0, 30])
    T = pose(R, point - R @ tip + 0.1 * rng.normal(size=(n, 3)))
    T[:bad, :3, 3] += [5, -4, 3]
    return T, tip, point


def test_pivot_sphere_and_frame_find_the_truth_within_their_covariance():
    T, tip, point = touching()
    result = calibrate.pivot(T)
    e = np.concatenate([result.points["tip"] - tip, result.points["pivot"] - point])
    assert result.rejected == [1, 2, 3] and e @ np.linalg.solve(result.covariance, e) < 40
    assert np.allclose(result.T[:3, 3], result.points["tip"]) and result.parameters[0] == "tip x"

    robot, _, _ = cell(4, n=25)
    rng = np.random.default_rng(8)
    seen = (invert(robot @ X) @ Y)[:, :3, 3] + 0.1 * rng.normal(size=(25, 3))
    seen[4] += 30
    result = calibrate.sphere(robot, seen)
    assert result.rejected == [5] and score(result) < 40
    assert np.allclose(result.points["center"], Y[:3, 3], atol=1)

    nominal = rng.uniform(-100, 100, (9, 3))
    measured = nominal @ X[:3, :3].T + X[:3, 3] + 0.05 * rng.normal(size=(9, 3))
    measured[7, 2] -= 4
    result = calibrate.frame(measured, nominal)
    assert result.rejected == [8] and score(result) < 40


def test_three_points_give_the_frame_and_its_covariance():
    points = np.array([[0.0, 0, 0], [200, 0, 0], [30, 150, 0]]) @ X[:3, :3].T + X[:3, 3]
    result = calibrate.frame(points, std_trans=0.1)
    assert np.allclose(result.T, X) and np.isfinite(result.covariance).all()
    rng = np.random.default_rng(0)
    draws = [error(calibrate.frame(points + 0.1 * rng.normal(size=(3, 3)))) for _ in range(2000)]
    assert np.allclose(np.std(draws, axis=0), result.std, rtol=0.1)  # 2000 draws: 6 standard deviations of a std
    assert "--std-trans" in calibrate.frame(points).warnings[0]


@pytest.mark.parametrize("kind", ["hand-eye", "pivot", "sphere", "frame"])
def test_derivatives_are_those_of_finite_differences(kind):
    robot, sensor, _ = cell(6, n=7, std_rot=1e-9, std_trans=1e-6)
    model, solution = {
        "hand-eye": (HandEyeModel(robot, sensor), (X, Y)),
        "pivot": (PivotModel(robot), (np.array([1.0, 2, 3]), np.array([4.0, 5, 6]))),
        "sphere": (SphereModel(robot, sensor[:, :3, 3]), (X, Y[:3, 3])),
        "frame": (FrameModel(robot[:, :3, 3], sensor[:, :3, 3]), (X,)),
    }[kind]

    def moved(p):
        out, k = [], 0
        for part in solution:
            if part.shape == (4, 4):
                T = part.copy()
                T[:3, :3], T[:3, 3] = T[:3, :3] @ exp_so3(p[k : k + 3]), T[:3, 3] + p[k + 3 : k + 6]
                out.append(T)
                k += 6
            else:
                out.append(part + p[k : k + 3])
                k += 3
        return model.linearize(tuple(out))[0].ravel()

    J = model.linearize(solution)[1]
    J = J.reshape(-1, J.shape[2])
    assert np.allclose(J, numeric_jacobian(moved, np.zeros(J.shape[1])), atol=1e-5)


def test_streams_are_compared_across_clocks_and_gaps():
    rng = np.random.default_rng(0)

    def robot_at(t):
        phi = np.stack([np.sin(0.9 * t), 0.7 * np.sin(1.7 * t + 1), 0.5 * np.sin(0.4 * t)], -1)
        return pose(exp_so3(phi), 300 * np.stack([np.cos(0.5 * t), np.sin(0.8 * t), np.cos(1.1 * t)], -1))

    time_a = 0.01 * np.arange(4000)
    time_a = time_a[(time_a < 12) | (time_a > 15)]  # the reference pauses for 3 s
    true_b = 3 + 0.033 * np.arange(1000)
    b = invert(Y) @ robot_at(true_b) @ X
    b[:, :3, 3] += 0.3 * rng.normal(size=(1000, 3))
    b[:, :3, :3] = b[:, :3, :3] @ exp_so3(1e-3 * rng.normal(size=(1000, 3)))
    result = calibrate.compare(time_a, robot_at(time_a), true_b + 0.25, b)
    assert abs(result.time_offset.offset - 0.25) < 5 * result.time_offset.std < 0.01
    assert abs(result.comparison.unmatched - 3 / 0.033) < 3
    assert np.abs(error(result)[3:]).max() < 0.5
    when = result.comparison.time
    moved = np.linalg.norm(robot_at(when + 1e-4)[:, :3, 3] - robot_at(when - 1e-4)[:, :3, 3], axis=1) / 2e-4
    steady = np.ones(len(when), bool)  # differences over 66 ms, but for the ends and the pause
    steady[[0, -1]] = steady[np.flatnonzero(np.diff(when) > 0.1)] = steady[np.flatnonzero(np.diff(when) > 0.1) + 1] = 0
    np.testing.assert_allclose(result.comparison.speed[steady], moved[steady], rtol=0.02, atol=2.0)
    assert all(0.3 < row[4] < 1.2 for row in result.comparison.table)  # 0.3 mm on each of three axes, and the clock


def test_samples_that_share_their_errors_widen_the_covariance():
    """Errors that last for 2 s, in a stream of 40 s at 10 Hz: twenty samples are worth one."""

    def robot_at(t):
        phi = np.stack([np.sin(0.9 * t), 0.7 * np.sin(1.7 * t + 1), 0.5 * np.sin(0.4 * t)], -1)
        return pose(exp_so3(phi), 300 * np.stack([np.cos(0.5 * t), np.sin(0.8 * t), np.cos(1.1 * t)], -1))

    time = 0.1 * np.arange(400)
    found = {}
    for lasting in (1, 20):
        rng = np.random.default_rng(3)
        shake = np.repeat(rng.normal(size=(400 // lasting, 6)), lasting, axis=0)
        b = invert(Y) @ robot_at(time) @ X
        b[:, :3, 3] += 0.3 * shake[:, :3]
        b[:, :3, :3] = b[:, :3, :3] @ exp_so3(1e-3 * shake[:, 3:])
        found[lasting] = calibrate.compare(time, robot_at(time), time, b)
    assert not found[1].warnings and "neighboring samples share their errors" in found[20].warnings[-1]
    assert (found[20].std > 2 * found[1].std).all()
    assert error(found[20]) @ np.linalg.solve(found[20].covariance, error(found[20])) < 40


# --- what is shown ---------------------------------------------------------------------------------------------------


def test_each_point_is_printed_once():
    one, two = np.array([1.0, 2.0, 3.0]), np.array([4.0, 5.0, 6.0])
    found = calibrate.hand_eye(*cell()[:2], length_unit="mm")
    for kind, points in (("sphere", {"center": one}), ("pivot", {"tip": one, "pivot": two})):
        shown = repr(dataclasses.replace(found, kind=kind, points=points))
        assert all(shown.count(f"\n  {name} ") == 1 for name in points), shown


def test_results_print_themselves_and_fit_into_json():
    result = calibrate.hand_eye(*cell(outliers=2)[:2], length_unit="mm")
    assert repr(result).startswith("sensor in the flange (mm):") and "18 of 20 rows agree" in repr(result)
    assert "<table>" in result._repr_html_() and "translation [mm]" in result._repr_html_()
    found = json.loads(json.dumps(result.as_dict(), allow_nan=False))
    assert np.shape(found["T"]) == (4, 4) and np.shape(found["covariance"]) == (6, 6) and found["rows"] == 20
    assert found["rejected"] == result.rejected and found["rms_translation"] > 0 and found["time_offset"] is None


def test_rows_out_of_order_are_told():
    """And beside what they miss by, how far the poses turn: about their main axis, and across it."""
    robot, sensor, _ = cell()
    with pytest.raises(
        ValueError, match="the loop does not close: .* are the rows of both files in the same order"
    ) as e:
        calibrate.hand_eye(robot, np.roll(sensor, 1, axis=0))
    told = re.search(r"turn by (\S+) deg about one axis and by (\S+) deg across it", str(e.value))
    along, across = map(float, told.groups())
    largest = np.rad2deg(max(np.linalg.norm(log_so3(a[:3, :3].T @ b[:3, :3])) for a in robot for b in robot))
    assert across <= along <= largest <= 6 * along


def test_no_minority_is_followed():
    model = PivotModel(touching(n=12, bad=0)[0])
    model.start = lambda: np.arange(12) < 4
    model.fit = lambda kept: pytest.fail("four of twelve rows are no majority")
    with pytest.raises(ValueError, match="only 4 of 12 rows agree with each other, so no majority can be followed"):
        majority(model)


def test_the_table_over_speed_counts_every_sample_once():
    rng = np.random.default_rng(6)
    speed, angle, distance = rng.uniform(0, 90, 400), rng.uniform(0, 0.01, 400), rng.uniform(0, 2, 400)
    table = calibrate._over_speed(angle, distance, speed)
    assert sum(row[2] for row in table) == 400 and [row[0] for row in table[1:]] == [row[1] for row in table[:-1]]
    for low, high, n, rms_angle, rms in table:
        inside = (speed >= low) & ((speed < high) | (high == speed.max()))
        assert n == inside.sum()
        assert rms_angle == pytest.approx(np.rad2deg(np.sqrt((angle[inside] ** 2).mean())))
        assert rms == pytest.approx(np.sqrt((distance[inside] ** 2).mean()))
    lines = calibrate.Comparison(np.arange(400.0), angle, distance, speed, table, 7).lines("mm")
    assert lines[0].startswith("400 samples compared, 7 of the second stream") and len(lines) == 1 + len(table)
    assert f"{table[0][2]:6d} samples" in lines[1] and "mm/s" in lines[1]


def test_blocks_that_move_the_result_widen_its_covariance():
    """Shifts of three standard deviations along every column of a root: (12 - 1) / 12 of 2 * 9 times the covariance."""
    robot, sensor, _ = cell(1)
    plain = calibrate.hand_eye(robot, sensor)
    root = 3 * np.linalg.cholesky(plain.covariance)
    shifts = dict(enumerate(np.concatenate([root.T, -root.T])))
    wide = calibrate._widened_by_blocks(calibrate._with(plain, group_shifts=shifts))
    np.testing.assert_allclose(wide.covariance, 11 / 12 * 18 * plain.covariance, rtol=1e-6)
    assert "4.1 times" in wide.warnings[-1]
    spoilt = shifts | {5: np.full(6, np.nan)}
    few = {k: shifts[k] for k in range(11)}
    small = {k: v / 3.1 for k, v in shifts.items()}
    for none in (spoilt, few, small):
        as_it_was = calibrate._widened_by_blocks(calibrate._with(plain, group_shifts=none))
        assert (as_it_was.covariance == plain.covariance).all()


def test_errors_are_told_over_six_ranges_of_speed_with_as_many_rows_each():
    rng = np.random.default_rng(0)
    speed, angle, distance = rng.permutation(600) + 0.5, rng.random(600), rng.random(600)
    table = calibrate._over_speed(angle, distance, speed)
    assert [row[2] for row in table] == [100] * 6 and table[0][0] == 0.5 and table[-1][1] == 599.5
    for k, row in enumerate(table):
        inside = (speed > 100 * k) & (speed < 100 * (k + 1))
        assert row[3] == pytest.approx(np.rad2deg(np.sqrt((angle[inside] ** 2).mean())))
        assert row[4] == pytest.approx(np.sqrt((distance[inside] ** 2).mean()))


def test_residuals_and_singular_values_are_those_of_the_model():
    """Rows that were rejected among them; lengths that leave the mean, and angles in degrees."""
    robot, sensor, bad = cell(7, outliers=3)
    result = calibrate.hand_eye(robot, sensor)
    model, solution = HandEyeModel(robot, sensor), (result.T, result.T_target)
    r, J = model.linearize(solution)[0], model.whitened(solution, result.kept)[1][result.kept].reshape(-1, 12)
    np.testing.assert_allclose(result.residuals, r, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(result.alone[~result.kept], r[~result.kept], rtol=1e-6, atol=1e-9)
    values = np.linalg.svd(J / np.linalg.norm(J, axis=0), compute_uv=False)
    np.testing.assert_allclose(result.singular_values, values, rtol=1e-6)
    kept = r[result.kept]
    assert result.rms_rotation_deg == pytest.approx(np.rad2deg(np.sqrt((kept[:, :3] ** 2).sum(1).mean())))
    assert result.rms_translation == pytest.approx(np.sqrt((kept[:, 3:] ** 2).sum(1).mean()))
    assert np.isnan(calibrate.pivot(touching()[0]).rms_rotation_deg)


def test_a_frame_of_points_along_one_line_turns_about_its_own_axis():
    nominal = np.array([[-100.0, 0, 0], [-50, 4, 0], [0, -3, 2], [40, 1, -4], [80, -2, 3], [120, 3, 1]])
    measured = nominal @ X[:3, :3].T + X[:3, 3] + 0.05 * np.random.default_rng(2).normal(size=(6, 3))
    advice_ = " ".join(calibrate.frame(measured, nominal).advice)
    assert "turning about the frame's x axis is known" in advice_
    robot, sensor, _ = cell(6)
    told = " ".join(calibrate.hand_eye(robot, sensor, std_rot=STD_ROT, std_trans=STD_TRANS).advice)
    assert "of the frame" not in told and "the frame's" not in told


@pytest.mark.parametrize(("scatter", "slipped"), [(1.0, True), (40.0, False)])
def test_rejected_rows_that_scatter_among_themselves_are_no_slip(scatter, slipped):
    """The block of a slipped screw, read as well as the others or forty times worse."""
    loose = X.copy()
    loose[:3, 3] += [0, 15.0, 20.0]
    mounting = np.where((np.arange(20) < 13)[:, None, None], X, loose)
    robot, sensor, _ = cell(5, mounting=mounting)
    sensor[13:, :3, 3] += scatter * STD_TRANS * np.random.default_rng(1).normal(size=(7, 3))
    result = calibrate.hand_eye(robot, sensor)
    assert result.rejected == list(range(14, 21))
    assert ("did something slip" in " ".join(result.warnings)) is slipped
