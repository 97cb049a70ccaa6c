"""Interpolation against SciPy, and the offset of two clocks against the one put in."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from labkit.estimation.clocks import BLOCKS, _jackknife, angular_speed, clock_offset, sample_stream
from labkit.geometry.lie import exp_se3, exp_so3, interpolate


def motion(time):
    """A smooth motion, sampled anywhere."""
    phi = np.stack([np.sin(0.9 * time), 0.7 * np.sin(1.7 * time + 1), 0.5 * np.sin(0.4 * time) + 0.1 * time], -1)
    T = np.tile(np.eye(4), (len(time), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = exp_so3(phi), 300 * np.cos(phi)
    return T


def streams(seed, offset, n=1500, noise=1e-3):
    """One motion seen at 50 Hz and, by something mounted askew, at 30.3 Hz on a clock ahead by `offset`."""
    rng = np.random.default_rng(seed)
    time_a, true_b = 0.02 * np.arange(n), 5 + 0.033 * np.arange(int(0.45 * n)) + 0.002 * rng.random(int(0.45 * n))
    askew, world = exp_se3([0.3, -1, 2, 50, 20, 9]), exp_se3([1, 2, -0.4, 900, -70, 3])
    T_a, T_b = motion(time_a), world @ motion(true_b) @ askew
    for T in (T_a, T_b):
        T[:, :3, :3] = T[:, :3, :3] @ exp_so3(noise * rng.normal(size=(len(T), 3)))
    return time_a, T_a, true_b + offset, T_b


def test_interpolation_turns_evenly_and_meets_the_ends():
    T0, T1 = exp_se3([0.1, 0.2, 0.3, 1, 2, 3]), exp_se3([-1, 2, 0.5, 4, 5, 6])
    s = np.linspace(0, 1, 7)
    T = interpolate(T0, T1, s)
    turned = Slerp([0, 1], Rotation.from_matrix(np.stack([T0, T1])[:, :3, :3]))(s)
    assert np.allclose(T[:, :3, :3], turned.as_matrix()) and np.allclose(T[[0, -1]], [T0, T1])
    steps = np.linalg.inv(T[:-1]) @ T[1:]
    assert np.allclose(steps, steps[0])  # one twist, the same on every part of the way


def test_the_last_interval_lies_between_the_last_two_samples():
    time, T = np.array([0.0, 1.0, 3.0]), np.tile(np.eye(4), (3, 1, 1))
    T[:, 0, 3] = [0.0, 10.0, 50.0]
    poses, known = sample_stream(time, T, np.array([0.5, 2.0, 3.0]), max_gap=5.0)
    assert known.all()
    np.testing.assert_allclose(poses[:, 0, 3], [5.0, 30.0, 50.0])


def test_gaps_are_never_bridged():
    time = np.r_[0:1:0.1, 2:3:0.1]
    when = np.array([-0.01, 0, 0.05, 0.9, 0.95, 1.5, 2.0, 2.55, 2.95])
    poses, known = sample_stream(time, motion(time), when)
    assert known.tolist() == [False, True, True, True, False, False, True, True, False]
    assert np.abs(poses[known] - motion(when)[known]).max() < 0.5  # of 300 mm, over steps of 0.1 s
    assert np.isnan(angular_speed(time, motion(time), np.array([1.5, 0.95]), 0.2)).all()


def test_sampled_speeds_do_not_depend_on_the_mounting():
    time_a, T_a, _, _ = streams(0, 0.0, noise=0)
    when = np.linspace(1, 20, 40)
    askew = exp_se3([1, 2, -0.4, 900, -70, 3]) @ T_a @ exp_se3([0.3, -1, 2, 50, 20, 9])
    assert np.allclose(angular_speed(time_a, T_a, when, 0.1), angular_speed(time_a, askew, when, 0.1), atol=1e-9)


@pytest.mark.parametrize("offset", [0.0, 0.1234, -3.7, 1.7e9])
def test_offset_is_found_at_any_size(offset):
    found = clock_offset(*streams(1, offset))
    assert abs(found.offset - offset) < 5 * found.std and 1e-5 < found.std < 5e-3
    assert found.agreement > 0.99 and found.overlap > 15


def test_the_standard_deviation_of_the_offset_is_honest():
    scores = []
    for seed in range(40):  # fixed seeds
        found = clock_offset(*streams(seed, 0.05, n=900, noise=3e-3))
        scores.append((found.offset - 0.05) / found.std)
    assert 0.6 < np.sqrt(np.mean(np.square(scores))) < 1.6


def test_the_jackknife_leaves_one_block_out_at_a_time():
    """Against fits of a line through the origin to what is left, one after the other."""
    rng = np.random.default_rng(5)
    slope = rng.normal(size=240) * np.linspace(0.2, 3, 240)  # blocks of unequal weight
    d, block = 0.3 * slope + rng.normal(size=240), np.arange(240) // (240 // BLOCKS)
    fits = [np.linalg.lstsq(slope[block != k, None], d[block != k])[0][0] for k in range(BLOCKS)]
    np.testing.assert_allclose(_jackknife(slope, d), np.sqrt(BLOCKS - 1) * np.std(fits), rtol=1e-12)


def test_what_cannot_be_aligned_is_refused():
    time_a, T_a, time_b, T_b = streams(2, 0.0)
    with pytest.raises(ValueError, match="the second stream never changes its angular speed"):
        clock_offset(time_a, T_a, time_b, np.tile(T_b[0], (len(T_b), 1, 1)))
    with pytest.raises(ValueError, match="no time offset brings the angular speeds together"):
        clock_offset(time_a, T_a, time_b, motion(np.cumsum(np.random.default_rng(0).random(len(time_b))) * 0.05)[::-1])
    with pytest.raises(ValueError, match="at least 24 steps"):
        clock_offset(time_a[:9], T_a[:9], time_b, T_b)
    with pytest.raises(ValueError, match="do not overlap enough"):
        clock_offset(time_a, T_a, time_b + 100, T_b, max_offset=10)


def test_each_stream_may_begin_at_any_time_of_its_clock():
    time_a, T_a, time_b, T_b = streams(2, 0.2)
    found = clock_offset(time_a + 100.0, T_a, time_b + 40.0, T_b)
    assert abs(found.offset - (0.2 + 40.0 - 100.0)) < 5 * found.std
    part = clock_offset(time_a[300:], T_a[300:], time_b[120:], T_b[120:])
    assert abs(part.offset - 0.2) < 5 * part.std


def test_a_steady_turn_has_its_own_speed():
    time = np.arange(0, 4, 0.05)
    T = np.tile(np.eye(4), (len(time), 1, 1))
    T[:, :3, :3] = exp_so3(np.outer(time, [0.3, -0.4, 0.0]))  # 0.5 rad/s
    when = np.array([0.14, 0.16, 1.0, 3.79, 3.81])
    speed = angular_speed(time, T, when, 0.3)
    np.testing.assert_allclose(speed[1:4], 0.5, rtol=1e-9)
    assert np.isnan(speed[[0, 4]]).all()  # half the interval lies before the first sample, or behind the last


def test_the_overlap_is_the_time_both_cover():
    """A stream of 6 s within one of 30 s, less the interval over which a turn is measured."""
    time_a, T_a, time_b, T_b = streams(3, 0.4)
    part = clock_offset(time_a, T_a, time_b[100:280], T_b[100:280])
    assert abs(part.offset - 0.4) < 5 * part.std
    assert part.overlap == pytest.approx(time_b[279] - time_b[100] - 0.3, abs=0.1)
    both = clock_offset(time_a, T_a, time_b, T_b)
    assert both.overlap == pytest.approx(min(time_a[-1], time_b[-1] - 0.4) - (time_b[0] - 0.4) - 0.3, abs=0.1)


def test_the_fewest_samples_that_can_be_aligned():
    """Twice twelve blocks of steps behind the 0.3 s over which a turn is measured."""
    time_a, T_a, time_b, T_b = streams(2, 0.0)
    few = 24 + 9  # of 0.033 s; ten are behind the 0.3 s
    with pytest.raises(ValueError, match="at least 24 steps"):
        clock_offset(time_a, T_a, time_b[: few - 12], T_b[: few - 12])
    assert abs(clock_offset(time_a, T_a, time_b[: few + 60], T_b[: few + 60]).offset) < 0.05


@pytest.mark.parametrize(("steps", "span"), [((0.02, 0.03), "0.3"), ((0.02, 0.5), "1"), ((0.5, 0.02), "1")])
def test_a_turn_is_measured_over_two_steps_of_the_slower_stream_and_sampled_at_those_of_the_quicker(steps, span):
    """So many of the quicker steps must be left beyond the span in both streams: 24 are enough, 23 are not."""
    quick, span_s = min(steps), float(span)
    for left, refused in ((23.5, False), (22.5, True)):  # points at 0, 1, ... of the steps
        ends = [span_s + quick * left if step == quick else 60.0 for step in steps]
        times = [np.append(np.arange(0, end - 1e-9, step), end) for end, step in zip(ends, steps)]
        try:
            said = str(clock_offset(times[0], motion(times[0]), times[1], motion(times[1])))
        except ValueError as refusal:  # short streams may be refused for other reasons
            said = str(refusal)
        assert (f"at least 24 steps each beyond {span} s" in said) is refused


def test_streams_that_are_too_short_or_too_long_are_refused_whichever_it_is():
    time_a, T_a, time_b, T_b = streams(2, 0.0, n=200)
    with pytest.raises(ValueError, match="at least 2 samples each, got 200 and 1"):
        clock_offset(time_a, T_a, time_b[:1], T_b[:1])
    late = np.append(time_a[:-1], 1e9)
    for first, second in (((late, T_a), (time_b, T_b)), ((time_b, T_b), (late, T_a))):
        with pytest.raises(ValueError, match=r"at most .* of their median steps, got 5e\+10"):
            clock_offset(*first, *second)
