"""Packets, logs, the mounting by the report's equations, errors in motion, and the synthetic data."""

import importlib
import sys

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation

from labkit.calibration import ax_xb
from labkit.chapters.ch06_tracker import exercises as ch06
from labkit.documents.report.reconstruction import synthetic_mountings
from labkit.geometry.frames import invert, pose, pose_distance
from labkit.geometry.lie import exp_so3, log_so3
from labkit.machines import simulation
from labkit.machines.arm import TX40, forward_kinematics
from labkit.machines.log import (
    Log,
    average_stops,
    mean_pose,
    mean_quaternion,
    read_csv,
    reject_outliers,
    write_csv,
)
from labkit.machines.mounting import calibrate_mounting, e_rot, e_trans
from labkit.machines.packet import (
    FIELDS,
    PACKET,
    POSITION,
    TIME,
    VELOCITY,
    decode_packet,
    encode_packet,
    packet_from_pose,
    poses_from_packets,
)
from labkit.machines.simulation import T_FE
from labkit.machines.tracking import (
    filter_positions,
    median_over_speed,
    shift_time,
    speeds,
    static_error_and_lag,
    summarize,
    time_offset,
    tracking_errors,
)
from labkit.tables import DATA, read_table


def some_poses(rng, n):
    return pose(Rotation.random(n, random_state=int(rng.integers(1 << 30))).as_matrix(), rng.uniform(-900, 900, (n, 3)))


# ---- packet


def test_packet_has_the_offsets_of_table_1():
    table = read_table("tracker/packet.csv", text=("bytes", "meaning"))
    assert len(table["bytes"]) == len(FIELDS) == 23 and PACKET.size == 184
    for k, span in enumerate(table["bytes"]):
        first, last = map(int, span.split("-"))
        values = np.zeros(23)
        values[k] = 1.0
        data = encode_packet(values)
        assert data[first : last + 1] == np.array(1.0, dtype="<f8").tobytes()
        assert not any(data[:first]) and not any(data[last + 1 :])


def test_packets_carry_poses_there_and_back():
    T = some_poses(np.random.default_rng(1), 20)
    values = packet_from_pose(T, np.arange(20) / 250, velocity=np.full((20, 3), 100.0))
    decoded = np.array([decode_packet(encode_packet(v)) for v in values])
    np.testing.assert_array_equal(decoded, values)
    np.testing.assert_allclose(poses_from_packets(decoded), T, atol=1e-9)
    np.testing.assert_allclose(decoded[:, VELOCITY], 0.1)


def good():
    return packet_from_pose(np.eye(4), 0.0)


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda v: v[:-1].tobytes(), "length: expected 184 bytes"),
        (lambda v: v.tobytes() + b"x", "length"),
        (lambda v: np.where(np.arange(23) == 7, np.nan, v).tobytes(), "not finite"),
        (lambda v: np.where(np.arange(23) == 20, -np.inf, v).tobytes(), "not finite"),
        (lambda v: np.where(np.arange(23) == 14, 0.9, v).tobytes(), "quaternion"),
        (lambda v: np.where(np.arange(23) == 3, 500.0, v).tobytes(), "more than 10 m away"),
        (lambda v: b"", "length"),
    ],
)
def test_bad_packets_are_refused_with_the_reason(change, words):
    with pytest.raises(ValueError, match=words):
        decode_packet(change(good()))


# ---- log


def a_log(n=30):
    rng = np.random.default_rng(2)
    return Log(np.arange(n) / 10, some_poses(rng, n), np.arange(n) // 10)


@pytest.mark.parametrize(("unit", "places"), [("m", 5), ("mm", 2)])
def test_a_log_has_so_many_decimals_of_a_meter(tmp_path, unit, places):
    write_csv(tmp_path / "log.csv", a_log(), unit, digits=5)
    rows = [line.split(",") for line in (tmp_path / "log.csv").read_text().splitlines()]
    assert {len(entry.split(".")[1]) for row in rows[1:] for entry in row[2:5]} == {places}


@pytest.mark.parametrize("unit", ["m", "mm"])
def test_log_there_and_back(tmp_path, unit):
    log = a_log()
    write_csv(tmp_path / "log.csv", log, unit)
    back = read_csv(tmp_path / "log.csv")
    np.testing.assert_allclose(back.time, log.time)
    np.testing.assert_array_equal(back.stop, log.stop)
    angle, distance = pose_distance(back.T_WE, log.T_WE)
    assert angle.max() < 5e-6 and distance.max() < 0.01
    write_csv(tmp_path / "plain.csv", Log(log.time, log.T_WE, None), unit)
    assert read_csv(tmp_path / "plain.csv").stop is None


def spoil_line(text, number, change):
    lines = text.splitlines()
    lines[number - 1] = change(lines[number - 1])
    return "\n".join(lines) + "\n"


def in_millimeters(line):
    time, stop, *rest = line.split(",")
    return ",".join([time, stop, *(f"{1000 * float(v):.2f}" for v in rest[:3]), *rest[3:]])


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda t: "", "the file is empty"),
        (lambda t: t[:-20], "line 31: the file ends in the middle of this line"),
        (
            lambda t: spoil_line(t, 1, lambda h: h.replace("y [m]", "y [mm]")),
            "line 1: x, y and z must share one unit, got m, mm, m",
        ),
        (lambda t: spoil_line(t, 1, lambda h: h.replace("[m]", "[in]")), "line 1: lengths must be in m or mm, got in"),
        (lambda t: spoil_line(t, 1, lambda h: h.replace("qx", "qw")), "line 1: a column name appears twice"),
        (lambda t: spoil_line(t, 1, lambda h: h.replace("qx", "Qx")), "line 1: expected a column 'qx'"),
        (lambda t: spoil_line(t, 7, lambda line: line + ",1"), "line 7: expected 9 entries, got 10"),
        (lambda t: spoil_line(t, 9, lambda line: line.replace(",", ";", 3)), "line 9: expected 9 entries, got 6"),
        (lambda t: spoil_line(t, 5, lambda line: line.replace("0.3", "O.3", 1)), "line 5: expected a number, got 'O.3"),
        (lambda t: spoil_line(t, 6, lambda line: "nan" + line[5:]), "line 6: a number is not finite"),
        (lambda t: spoil_line(t, 8, lambda line: "0.000" + line[5:]), "line 8: time does not increase"),
        (
            lambda t: spoil_line(t, 4, lambda line: line.rsplit(",", 1)[0] + ",3"),
            "line 4: the quaternion is not of length 1",
        ),
        (lambda t: spoil_line(t, 12, in_millimeters), "line 12: .*another unit"),
    ],
)
def test_broken_logs_are_refused_with_the_line(tmp_path, change, words):
    path = tmp_path / "log.csv"
    write_csv(path, a_log())
    path.write_text(change(path.read_text()))
    with pytest.raises(ValueError, match=words):
        read_csv(path)


def test_rows_in_another_unit_inside_the_tracking_area(tmp_path):
    """Positions of some millimeters, written in mm in a file of meters, stay within 10 m; the jump gives them away."""
    n = 20
    T = np.tile(np.eye(4), (n, 1, 1))
    T[:, :3, 3] = [400.0, 200.0, 100.0] + np.arange(n)[:, None]
    path = tmp_path / "log.csv"
    write_csv(path, Log(np.arange(n) / 10, T, None), "mm")
    lines = path.read_text().splitlines()
    for k in range(10, n + 1):
        time, *rest = lines[k].split(",")
        lines[k] = ",".join([time, *(f"{float(v) / 1000:.5f}" for v in rest[:3]), *rest[3:]])
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(ValueError, match="line 11: the position jumps by a factor of 1000"):
        read_csv(path)


@pytest.mark.parametrize(
    ("after", "jumps"),
    [
        ([0.415, 0.207, 0.107], True),  # 1000 times less, and moved by 18 mm
        ([0.42, 0.21, 0.11], False),  # by 24.5 mm, more than a twentieth of 458
        ([4.2, 2.1, 1.1], False),
        ([400e3, 200e3, 99e3], True),
        ([-400.0, -200.0, -100.0], False),
    ],
)
def test_a_jump_of_unit_is_a_thousandfold_within_a_twentieth(tmp_path, after, jumps):
    T = np.tile(np.eye(4), (8, 1, 1))
    T[:, :3, 3] = np.where(np.arange(8)[:, None] < 4, [400.0, 200.0, 100.0], after)
    write_csv(tmp_path / "log.csv", Log(np.arange(8) / 10, T, None), "mm", digits=9)
    if jumps:
        with pytest.raises(ValueError, match="line 6: the position jumps by a factor of 1000"):
            read_csv(tmp_path / "log.csv")
    else:
        np.testing.assert_allclose(read_csv(tmp_path / "log.csv").T_WE, T, atol=1e-4)


# ---- mounting


def readings(rng, n=21, noise=0.0):
    """Poses of the flange, and what a tracker mounted at T_FE reports in the frame of its first reading."""
    T_BF = pose(exp_so3(0.6 * rng.normal(size=(n, 3))), rng.uniform(-200, 200, (n, 3)))
    T_BE = T_BF @ T_FE
    T_BE = pose(
        T_BE[:, :3, :3] @ exp_so3(1e-3 * noise * rng.normal(size=(n, 3))),
        T_BE[:, :3, 3] + noise * rng.normal(size=(n, 3)),
    )
    return T_BF, invert(T_BE[0]) @ T_BE


def test_mounting_is_exact_without_noise():
    m = calibrate_mounting(*readings(np.random.default_rng(3)))
    angle, distance = pose_distance(m.T_FE, T_FE)
    assert angle < 1e-9 and distance < 1e-8 and m.kept.all() and m.E_rot < 1e-12 and m.E_trans < 1e-9
    assert m.rotation[0] == m.translation[0] == 0


def test_errors_are_what_the_equations_say():
    """E_rot and E_trans from the report's matrices, written out with Kronecker products."""
    T_BF, T_WE = readings(np.random.default_rng(4), 12, noise=1.0)
    m = calibrate_mounting(T_BF, T_WE, factor=1e9)
    A, B = np.linalg.inv(T_BF[0]) @ T_BF[1:], np.linalg.inv(T_WE[0]) @ T_WE[1:]
    M = np.concatenate([np.kron(np.eye(3), a[:3, :3]) - np.kron(b[:3, :3].T, np.eye(3)) for a, b in zip(A, B)])
    w, V = np.linalg.eigh(M.T @ M)
    np.testing.assert_allclose(m.E_rot, np.linalg.norm(M.T @ M @ V[:, 0]) / 10, rtol=1e-6)
    np.testing.assert_allclose(m.E_rot, w[0] / 10, rtol=1e-6)
    R, t = m.T_FE[:3, :3], m.T_FE[:3, 3]
    K1 = np.concatenate([np.eye(3) - a[:3, :3] for a in A])
    K2 = np.concatenate([a[:3, 3] - R @ b[:3, 3] for a, b in zip(A, B)])
    np.testing.assert_allclose(t, np.linalg.inv(K1.T @ K1) @ K1.T @ K2, atol=1e-8)
    np.testing.assert_allclose(m.E_trans, np.linalg.norm(K1 @ t - K2) / 10, rtol=1e-9)
    predicted = np.linalg.inv(m.T_FE) @ A @ m.T_FE
    angle, distance = pose_distance(predicted, B)
    np.testing.assert_allclose(m.rotation[1:], angle, rtol=1e-6)
    np.testing.assert_allclose(m.translation[1:], distance, rtol=1e-9)


def test_the_noise_of_a_mounting_is_that_of_its_motions_less_the_unknowns():
    """Three unknowns of rotation and three of translation, from three numbers a motion each."""
    m = calibrate_mounting(*readings(np.random.default_rng(4), 6, noise=1.0), factor=1e9)
    turns, shifts = np.split(m.residuals, 2, axis=1)
    assert m.residuals.shape == (5, 6)
    np.testing.assert_allclose(m.std[[0, 3]], np.sqrt([(turns**2).sum() / (15 - 3), (shifts**2).sum() / (15 - 3)]))


def test_poses_are_left_out_until_the_rest_lies_within_the_factor():
    """Robust standard deviations, 1.4826 times the median deviation, written out."""
    T_BF, T_WE = readings(np.random.default_rng(7), 15, noise=1.0)
    m = calibrate_mounting(T_BF, T_WE, factor=1.9)
    errors = np.column_stack([m.translation, m.rotation])[np.flatnonzero(m.kept)[1:]]
    away = errors - np.median(errors, axis=0)
    worst = (away / (1.4826 * np.median(np.abs(away), axis=0))).max()
    assert worst <= 1.9 and 6 < m.kept.sum() < 15
    assert calibrate_mounting(T_BF[m.kept], T_WE[m.kept], factor=1.001 * worst).kept.all()
    assert not calibrate_mounting(T_BF[m.kept], T_WE[m.kept], factor=0.999 * worst).kept.all()


def test_small_errors_make_e_rot_two_thirds_of_the_mean_squared_angle():
    """What the ledger uses to tell the unit of appendix D: E_rot = 2/3 sum(angle^2) / (N - 1) for a null vector of
    length 1."""
    m = calibrate_mounting(*readings(np.random.default_rng(5), 21, noise=3.0), factor=1e9)
    np.testing.assert_allclose(m.E_rot, 2 / 3 * (m.rotation[1:] ** 2).sum() / 19, rtol=0.01)


def test_covariance_of_the_mounting_is_that_of_repeated_runs():
    """Independent errors of 20 motions, 400 times: NEES of 6 degrees of freedom has the standard error 0.17."""
    nees, rng = [], np.random.default_rng(15)
    T_BF, T_WE = readings(np.random.default_rng(14), 21)
    for _ in range(400):
        noise = pose(exp_so3(2e-3 * rng.normal(size=(21, 3))), 0.5 * rng.normal(size=(21, 3)))
        noise[0] = np.eye(4)
        m = calibrate_mounting(T_BF, T_WE @ noise, factor=1e9)
        e = np.concatenate([log_so3(T_FE[:3, :3].T @ m.T_FE[:3, :3]), m.T_FE[:3, 3] - T_FE[:3, 3]])
        nees.append(e @ np.linalg.solve(m.covariance, e))
    assert 5.4 < np.mean(nees) < 7.6  # the estimated noise widens 6 to about 6.5; a fixed seed


@pytest.mark.parametrize(
    "turn, shift", [([0.3, 0, 0.2], [80, -60, 10]), ([0, 0, 0], [80, -60, 10]), ([0, 0.2, 0], [0] * 3)]
)
def test_a_pose_of_nonsense_is_left_out(turn, shift):
    """Nonsense in its rotation, in its position, or in both."""
    T_BF, T_WE = readings(np.random.default_rng(6), 21, noise=0.5)
    T_WE[7] = pose(T_WE[7, :3, :3] @ exp_so3(turn), T_WE[7, :3, 3] + shift)
    m = calibrate_mounting(T_BF, T_WE)
    assert np.flatnonzero(~m.kept).tolist() == [7] and np.isnan(m.translation[7])
    assert pose_distance(m.T_FE, T_FE)[1] < 2


def test_reject_outliers_by_the_rule():
    values = np.array([1.0, 1.1, 0.9, 1.05, 0.95, 9.0])
    np.testing.assert_array_equal(reject_outliers(values), [True] * 5 + [False])
    np.testing.assert_array_equal(reject_outliers(np.ones(5)), [True] * 5)
    clean = np.random.default_rng(7).normal(size=20000)
    assert abs(1 - reject_outliers(clean, 2.0).mean() - 0.0455) < 0.005  # the scale is a standard deviation
    two = np.column_stack([values, np.r_[50.0, values[:-1]]])
    np.testing.assert_array_equal(reject_outliers(two), [False, True, True, True, True, False])


def test_stops_are_averaged_without_their_outliers():
    rng = np.random.default_rng(8)
    T = pose(exp_so3(1e-3 * rng.normal(size=(40, 3))), [100.0, 0, 0] + 0.3 * rng.normal(size=(40, 3)))
    clean = mean_pose(T[:30])
    T[30:, :3, 3] += 300
    half_turn = exp_so3([0.0, 0.0, np.pi])  # the turns from it to the others may have either sign
    T[38], T[39] = pose(half_turn, [-1000.0, 0, 0]), pose(half_turn, [-100.0, 0, 0])
    mean, used = average_stops(Log(np.arange(40) / 10, T, np.zeros(40, int)))
    assert used[0] == 0.75
    angle, distance = pose_distance(mean[0], clean)
    assert angle < 1e-9 and distance < 1e-9


# ---- motion


def test_speeds_of_a_known_rotation_do_not_depend_on_frames():
    time = np.arange(200) / 100
    T = pose(
        exp_so3(np.outer(0.7 * time, [0, 0, 1])),
        np.column_stack([300 * np.cos(0.7 * time), 300 * np.sin(0.7 * time), 0 * time]),
    )
    v, w = speeds(time, T)
    np.testing.assert_allclose(w, 0.7, rtol=1e-6)
    np.testing.assert_allclose(v, 210, rtol=1e-4)
    G = some_poses(np.random.default_rng(9), 1)[0]
    np.testing.assert_allclose(speeds(time, G @ T), (v, w), rtol=1e-9)
    np.testing.assert_allclose(speeds(time, T @ G)[1], w, rtol=1e-9)


@pytest.mark.parametrize("steps", [-5, -4, 0, 4, 5])
def test_the_largest_offset_is_looked_for_and_needs_three_times_as_many_samples(steps):
    """At the ends of the range the parabola through three costs is that of the last three."""
    time = np.arange(15) / 250
    signal = np.cumsum(np.random.default_rng(2).normal(size=40))
    found = time_offset(time, signal[10:25], signal[10 - steps : 25 - steps], 5 / 250)
    assert abs(found * 250 - steps) <= (0.6 if abs(steps) < 5 else 1.0) and round(abs(found) * 250) >= abs(steps) - 1
    with pytest.raises(ValueError, match="needs at least 15 samples, got 14"):
        time_offset(time[:14], signal[:14], signal[:14], 5 / 250)


@pytest.mark.parametrize("delay", [-0.031, 0.0, 0.0123, 0.1])
def test_time_offset_to_a_fraction_of_a_sample(delay):
    time = np.arange(2000) / 250

    def curve(t):
        return 1 + np.sin(2 * t) + 0.5 * np.cos(5 * t)

    rng = np.random.default_rng(10)
    found = time_offset(time, curve(time), curve(time - delay) + 0.03 * rng.normal(size=2000))
    assert abs(found - delay) < 5e-4


def test_shift_time_undoes_a_latency():
    motion = simulation.simulate_motion(
        "slow",
        np.random.default_rng(1),
        simulation.Tracker(0, 0, 0, 0, field_position=0, field_rotation=0, latency=0.05),
    )
    late = tracking_errors(motion.time, motion.T_true, motion.T_read)
    mended = shift_time(motion.time, motion.T_read, 0.05)
    inside = slice(20, -20)
    expected = 0.05 * speeds(motion.time, motion.T_true)[0][inside]
    np.testing.assert_allclose(late.translation[inside], expected, atol=0.8)
    assert pose_distance(mended[inside], motion.T_true[inside])[1].max() < 0.05


def test_summary_of_known_errors():
    s = summarize(np.arange(101.0))
    assert s["mean"] == s["median"] == 50 and s["95 %"] == 95 and s["max"] == 100
    np.testing.assert_allclose(s["RMS"], np.sqrt(100 * 201 / 6))


def test_filter_rejects_nonsense_and_follows_the_motion():
    motion = simulation.simulate_motion("middle", np.random.default_rng(11))
    filtered, used = filter_positions(motion.time, motion.T_read[:, :3, 3])
    assert (used[~motion.nonsense].mean() > 0.99) and not used[motion.nonsense].any()
    raw = np.linalg.norm(motion.T_read[:, :3, 3] - motion.T_true[:, :3, 3], axis=1)
    smooth = np.linalg.norm(filtered - motion.T_true[:, :3, 3], axis=1)
    assert smooth.mean() < 0.6 * raw.mean() and smooth.max() < 0.1 * raw.max()


def test_the_filter_of_positions_is_the_linear_filter_of_chapter_8():
    """Constant velocity with the acceleration as noise, one axis at a time, at uneven times."""
    rng = np.random.default_rng(12)
    time = np.cumsum(rng.uniform(0.002, 0.01, 80))
    z = np.stack([300 * np.sin(3 * time), 500 * time, np.zeros(80)], 1) + 3.0 * rng.normal(size=(80, 3))
    filtered, used = filter_positions(time, z, std_position=3.0, std_acceleration=4000.0, gate=1e9)
    assert used.all()
    for axis in range(3):
        x, P = np.array([np.median(z[:5, axis]), 0.0]), np.diag([9.0, 1e6])
        for k in range(80):
            dt = time[k] - time[max(k - 1, 0)]
            F, g = np.array([[1, dt], [0, 1]]), np.array([dt**2 / 2, dt])
            x, P = F @ x, F @ P @ F.T + 4000.0**2 * np.outer(g, g)
            gain = P[:, 0] / (P[0, 0] + 9.0)
            x, P = x + gain * (z[k, axis] - x[0]), P - np.outer(gain, P[0])
            assert filtered[k, axis] == pytest.approx(x[0], abs=1e-6)


def test_a_clock_may_be_uneven_by_a_hundredth_of_a_step():
    time = 0.01 * np.arange(200)
    time[100] += 0.009 * 0.01
    assert abs(time_offset(time, np.sin(9 * time), np.sin(9 * time), 0.1)) < 1e-3
    time[100] += 0.006 * 0.01
    with pytest.raises(ValueError, match="even steps"):
        time_offset(time, np.sin(9 * time), np.sin(9 * time), 0.1)


def test_motions_keep_joint_limits_and_speeds():
    for name in ("slow", "middle", "fast", "rotation"):
        time, q = simulation.robot_motion(name, 100)
        robot = TX40
        assert forward_kinematics(robot.dh, q)[:, 2, 3].min() > 0
        assert ((q > robot.q_min) & (q < robot.q_max)).all()
        assert (np.abs(np.gradient(q, time, axis=0)) < robot.speed).all()


def test_rotation_only_turns_at_its_printed_speed():
    time, q = simulation.robot_motion("rotation", 100)
    v, w = speeds(time, forward_kinematics(TX40.dh, q) @ T_FE)
    assert w.max() == pytest.approx(0.2, rel=0.01) and v.max() < 0.1  # rad/s, and mm/s


def test_reported_speeds_are_the_true_ones_with_the_noise_of_each():
    tracker = simulation.Tracker(std_speed=8.0, std_gyro=0.05)
    motion = simulation.simulate_motion("slow", np.random.default_rng(3), tracker)
    v, w = speeds(motion.time, motion.T_true)
    fast = (v > 100) & (w > 0.5)  # far from zero, where a norm cannot become negative
    assert fast.sum() > 500
    assert np.std((motion.v_read - v)[fast]) == pytest.approx(8.0, rel=0.15)
    assert np.std((motion.w_read - w)[fast]) == pytest.approx(0.05, rel=0.15)
    errors = tracking_errors(motion.time, motion.T_true, motion.T_read, (motion.v_read, motion.w_read))
    np.testing.assert_allclose(errors.speed, np.abs(motion.v_read - v))
    np.testing.assert_allclose(errors.angular_speed, np.abs(motion.w_read - w))


def test_nonsense_reports_speeds_up_to_ten_jumps_a_second_more():
    """Uniform from 0: by the test of Kolmogorov and Smirnov at odds of 1e-6, a fixed seed."""
    tracker = simulation.Tracker(nonsense=0.3, jump=200.0, std_speed=0.0)
    motion = simulation.simulate_motion("slow", np.random.default_rng(3), tracker)
    more = motion.v_read - speeds(motion.time, motion.T_true)[0]
    assert motion.nonsense.sum() > 500 and np.abs(more[~motion.nonsense]).max() < 1e-9
    assert stats.kstest(more[motion.nonsense] / 2000.0, "uniform").pvalue > 1e-6
    assert more[motion.nonsense].max() < 2000.0


def test_bursts_of_the_stream_last_as_long_as_stated():
    """Geometric with the mean 5: 400 bursts know it to 0.22; one burst follows the other, with another direction."""
    tracker = simulation.Tracker(nonsense=1.0, burst=5.0, std_position=0, std_rotation=0, field_position=0)
    packets = simulation.endless_packets(np.random.default_rng(1), lambda: True, tracker)
    quiet = simulation.endless_packets(np.random.default_rng(1), lambda: False, tracker)
    shift = np.array([decode_packet(next(p))[POSITION] for p in (packets, quiet) for _ in range(2000)]).reshape(
        2, 2000, 3
    )
    turns = (np.abs(np.diff(shift[0] - shift[1], axis=0)) > 1e-9).any(1).sum()
    assert 2000 / turns == pytest.approx(5.0, abs=1.1)


def test_nonsense_of_the_stream_jumps_by_the_stated_length():
    still = {"std_position": 0.0, "std_rotation": 0.0, "field_position": 0.0, "field_rotation": 0.0}
    tracker = simulation.Tracker(nonsense=1.0, burst=3.0, jump=350.0, **still)

    def positions(nonsense):
        packets = simulation.endless_packets(np.random.default_rng(1), lambda: nonsense, tracker)
        return np.array([decode_packet(next(packets))[POSITION] for _ in range(40)])

    shift = positions(True) - positions(False)
    np.testing.assert_allclose(np.linalg.norm(shift, axis=1), 0.35, rtol=1e-9)  # m
    assert len(np.unique(shift.round(9), axis=0)) > 5  # several bursts, each in a direction of its own


def test_the_stream_counts_its_time_in_packets():
    packets = simulation.endless_packets(np.random.default_rng(1))
    times = [decode_packet(next(packets))[TIME] for _ in range(5)]
    assert times == pytest.approx(np.arange(5) / simulation.RATE, abs=1e-12)


# ---- synthetic data and what they teach


def test_the_generator_gives_the_stored_files(tmp_path):
    sys.path.insert(0, str(DATA / "tracker"))
    try:
        importlib.import_module("make_runs").write(tmp_path)
    finally:
        sys.path.remove(str(DATA / "tracker"))
    for path in sorted(tmp_path.iterdir()):
        new, old = path.read_text().splitlines(), (DATA / "tracker" / path.name).read_text().splitlines()
        assert len(new) == len(old) and new[0] == old[0]
        table = [np.array([line.split(",") for line in lines[1:]], dtype=float) for lines in (new, old)]
        np.testing.assert_allclose(
            *table, atol=2.1e-5
        )  # the last digit may round differently with another linear algebra


def test_six_runs_agree_with_each_other_better_than_with_the_truth():
    """The systematic error repeats, so the spread over the runs says nothing about it; the covariance of one run
    does."""
    mountings = synthetic_mountings()
    t = np.array([m.T_FE[:3, 3] for m in mountings])
    off = np.linalg.norm(t.mean(0) - T_FE[:3, 3])
    assert np.linalg.norm(t.std(0)) < 0.3 < 1.0 < off < 3.0
    assert [np.flatnonzero(~m.kept).tolist() for m in mountings][0] == [13]


def test_more_poses_shrink_e_trans_and_leave_e_rot():
    """What chapter 6 says of equations (13) and (17): a mean of squares, and one that falls as 1 / sqrt(N)."""
    few, many = (
        [ax_xb.kronecker_matrix(*m) for m in runs]
        for runs in ([ch06.motions(np.random.default_rng(s), n) for s in range(30)] for n in (20, 80))
    )
    means = [np.mean([e_rot(M) for M in runs]) for runs in (few, many)]
    np.testing.assert_allclose(means[1] / means[0], 1.0, atol=0.15)
    gaps = np.random.default_rng(0).normal(size=(8000, 3))
    np.testing.assert_allclose(e_trans(gaps) / e_trans(gaps[:2000]), 0.5, rtol=0.05)


def test_hand_eye_with_the_tracker_on_the_flange():
    """The eye stands still: the tracker is the target on the flange, seen from the frame it was reset in."""
    T_BF, T_WE = readings(np.random.default_rng(12), 21, noise=0.5)
    result = ax_xb.calibrate_hand_eye(T_BF, T_WE, eye="to hand")
    angle, distance = pose_distance(result.T_FT, T_FE)
    assert angle < 4 * np.linalg.norm(result.std_of("T_FT.rotation"))
    assert distance < 4 * np.linalg.norm(result.std_of("T_FT.translation"))


def test_one_uneven_step_of_time_is_enough():
    time = np.arange(100) / 250
    time[50:] += 0.001
    with pytest.raises(ValueError, match="even steps"):
        time_offset(time, np.ones(100), np.ones(100), 0.05)


def test_squares_of_independent_errors_lie_on_a_line():
    """Against numpy's own line, and exactly where there is no scatter."""
    rng = np.random.default_rng(8)
    speed = rng.uniform(10, 1500, 60)
    assert static_error_and_lag(speed, np.hypot(4.0, 0.012 * speed)) == pytest.approx((4.0, 0.012), rel=1e-9)
    error = np.abs(np.hypot(4.0, 0.012 * speed) + rng.normal(size=60))
    slope, intercept = np.polyfit(speed**2, error**2, 1)
    assert static_error_and_lag(speed, error) == pytest.approx((np.sqrt(intercept), np.sqrt(slope)), rel=1e-7)
    assert static_error_and_lag([1.0, 2.0], [2.0, 1.0])[1] == 0.0
    for unit in (1e-6, 1.0, 1e6):
        assert static_error_and_lag([0.0, unit], [0.0, 2.0])[1] == pytest.approx(2.0 / unit)
        with pytest.raises(ValueError, match="speeds must differ"):
            static_error_and_lag(unit * np.array([5.0, 5.0, 5.0]), [1.0, 2.0, 3.0])
        with pytest.raises(ValueError, match="speeds must differ"):
            static_error_and_lag(unit * np.array([5.0, 5.0 + 1e-10, 5.0]), [1.0, 2.0, 3.0])


def test_medians_of_intervals():
    medians = median_over_speed([0.1, 0.2, 0.3, 1.1], [1.0, 5.0, 3.0, 7.0], [0.0, 1.0, 2.0, 3.0])
    np.testing.assert_array_equal(medians, [3.0, 7.0, np.nan])


@pytest.mark.parametrize("turn", [0.3, np.pi])
def test_the_mean_of_quaternions_is_scipys_whatever_their_signs(turn):
    rng = np.random.default_rng(9)
    R = Rotation.from_rotvec([0.0, 0.0, turn]) * Rotation.from_rotvec(0.1 * rng.normal(size=(12, 3)))
    mean = mean_quaternion(R.as_quat() * rng.choice([-1, 1], (12, 1)))
    assert (Rotation.from_quat(mean).inv() * R.mean()).magnitude() < 1e-12
    with pytest.raises(ValueError, match="at least one"):
        mean_quaternion(np.empty((0, 4)))


def test_a_clock_may_begin_anywhere():
    """Offsets and shifts in time are those of the differences: 1000 s more on every time change nothing."""
    time = np.arange(400) * 0.01
    curve, late = (
        np.sin(2 * time) + 0.3 * np.sin(5.1 * time),
        np.sin(2 * (time - 0.043)) + 0.3 * np.sin(5.1 * (time - 0.043)),
    )
    assert time_offset(time + 1000.0, curve, late) == pytest.approx(time_offset(time, curve, late), abs=1e-9)
    assert time_offset(time, curve, late) == pytest.approx(0.043, abs=1e-3)


@pytest.mark.parametrize("name", ["slow", "middle", "fast"])
def test_motions_are_about_as_quick_as_the_report_says(name):
    """Its table gives what each speed reaches; the way is ours, so a tenth more or less is left to it."""
    printed = read_table("tracker/motions.csv", text=("motion",))
    row = list(printed["motion"]).index(name)
    time, q = simulation.robot_motion(name, 250)
    v, w = speeds(time, forward_kinematics(TX40.dh, q) @ T_FE)
    assert v.max() / 1000 == pytest.approx(printed["v_high"][row], rel=0.1)
    assert w.max() == pytest.approx(printed["w_high"][row], rel=0.1)


def test_a_shifted_stream_lies_on_the_lines_between_its_samples():
    """Uneven steps, shifts of parts of a step and of several; the ends hold on."""
    rng = np.random.default_rng(3)
    time = np.cumsum(rng.uniform(0.01, 0.05, 30))
    T = some_poses(rng, 30)
    for offset in (0.013, -0.031, 0.2, -0.4):
        when = np.clip(time + offset, time[0], time[-1])
        found = shift_time(time, T, offset)
        expected = np.stack([np.interp(when, time, T[:, k, 3]) for k in range(3)], axis=1)
        np.testing.assert_allclose(found[:, :3, 3], expected, atol=1e-9)
