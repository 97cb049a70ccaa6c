"""Answers of students to chapter 7 that were once judged wrongly, and sentences of its notebook."""

import math

import numpy as np
import pytest
from scipy.optimize import fsolve

from labkit.chapters.ch07_dead_reckoning import exercises as ch07
from labkit.chapters.ch07_dead_reckoning import stages
from labkit.documents.lecture import printed as lecture
from labkit.exercises import budget
from labkit.exercises.outcome import CORRECT, NOT_YET
from labkit.localization import lateration, odometry
from tests.chapters.draws_of_a_check import SEEDS, is_missed, one_check

ITEMS = {item.id: item for item in ch07.CHAPTER.items}


def texts(name, answer, status=NOT_YET):
    outcomes = [ITEMS[name].judge(answer, rng=np.random.default_rng(seed)) for seed in SEEDS]
    assert all(outcome.status == status for outcome in outcomes), [o.text for o in outcomes]
    return {outcome.text for outcome in outcomes}


def arc(x, u, dt, straight_below):
    theta, (v, omega) = x[2], u
    if abs(omega) <= straight_below:
        return np.array([x[0] + v * dt * np.cos(theta), x[1] + v * dt * np.sin(theta), theta + omega * dt])
    r, after = v / omega, theta + omega * dt
    return np.array([x[0] + r * (np.sin(after) - np.sin(theta)), x[1] - r * (np.cos(after) - np.cos(theta)), after])


@pytest.mark.parametrize(
    "straight_below, told", [(0.3, "gentle"), (0.05, "gentle"), (1e-6, None), (1e-9, None), (0.0, "0.1 + 0.2")]
)
def test_where_an_arc_becomes_straight(straight_below, told):
    found = texts("step_arc", lambda x, u, dt: arc(x, u, dt, straight_below), NOT_YET if told else CORRECT)
    assert not told or all(told in text for text in found)


def test_an_arc_that_only_keeps_the_divisor_from_0_stands_still_on_a_straight_line():
    def guarded(x, u, dt):
        h = u[1] * dt / 2
        chord = u[0] * dt * np.sin(h) / (h + 1e-12)
        return np.array([x[0] + chord * np.cos(x[2] + h), x[1] + chord * np.sin(x[2] + h), x[2] + 2 * h])

    assert all(text.startswith("For omega = 0 your robot stays where it is.") for text in texts("step_arc", guarded))


def test_wheels_that_rounding_alone_makes_unequal_turn_the_robot_that_fast():
    assert abs(odometry.wheel_to_twist(0.3, 0.1 + 0.2, 0.5)[1]) == pytest.approx(ch07.ROUNDED_WHEELS, rel=0.02)


def test_many_short_steps_are_an_arc():
    def short_steps(x, u, dt, n=1000):
        for _ in range(n):
            x = odometry.step(x, u, dt / n, "midpoint")
        return x

    assert ITEMS["step_arc"].judge(short_steps, rng=np.random.default_rng(0)).status == CORRECT


def test_positions_are_drawn_with_either_coordinate_the_larger():
    reference = ITEMS["lateration_residual"].reference
    texts("lateration_residual", lambda landmarks, distances, p: reference(landmarks, distances, np.sort(p)))


@pytest.mark.parametrize("name", ["step_euler", "step_midpoint", "step_arc", "jacobian_state"])
def test_a_robot_that_cannot_reverse_is_told_so(name):
    reference = ITEMS[name].reference
    found = texts(name, lambda x, u, dt: reference(x, np.array([abs(u[0]), u[1]]), dt))
    assert all("|v|" in text for text in found)


def test_a_jacobian_computed_once_and_too_few_steps_never_pass():
    for steps in (20, 4):
        told = texts("newton_lateration", lambda *given, n=steps: ch07._newton_with_one_jacobian(n)(*given))
        assert all("that of the start" in text for text in told)
    for steps in (2, 3, 4, 5):
        told = texts("newton_lateration", lambda *given, n=steps: ch07._newton(lambda J, f, d: (J, f), n)(*given))
        assert all("few steps" in text for text in told)


def test_on_the_line_distances_that_are_short_leave_no_point_and_off_it_two():
    landmarks = np.array([[0.0, 0.0], [6.0, 0.0]])
    for robot, points in (([2.0, 0.0], 0), ([2.0, 2.0], 2)):
        short = 0.99 * np.linalg.norm(landmarks - robot, axis=1)
        reach, base = short.sum(), 6.0
        meet = 2 if abs(short[0] - short[1]) < base < reach else 0
        assert meet == points
        if points:
            roots = lateration.circle_intersections(landmarks, short)
            np.testing.assert_allclose(np.linalg.norm(roots[:, None] - landmarks, axis=-1), [short, short], atol=1e-9)


def test_the_share_that_is_to_be_predicted():
    share = stages.compute_banana({"path": "straight", "factor": 1.0, "region": "ellipse"})["share"]
    assert 0.8 < share < 0.9


def test_midpoint_and_simplified_model_are_equally_sure_of_their_end():
    sure = [np.sqrt(np.trace(ch07._circle(model)[1][:2, :2])) for model in ("euler", "midpoint")]
    assert abs(sure[0] - sure[1]) < 1e-4


def test_a_drift_grows_with_the_power_of_one_and_a_half_and_a_larger_wheel_with_the_square():
    k_drift = lecture.circle_drive().noise["k_drift"]

    def std(way, dt=0.1):
        controls = np.tile([1.0, 0.0], (round(way / dt), 1))
        noise = {"k_d": 0.0, "k_theta": 0.0, "k_drift": k_drift}
        covs = odometry.drive_with_covariance(np.zeros(3), np.zeros((3, 3)), controls, dt, **noise)[1]
        return np.sqrt(covs[-1][1, 1])

    assert std(14.0) == pytest.approx(np.sqrt(k_drift * 14.0**3 / 3), rel=1e-3)
    assert std(28.0) / std(14.0) == pytest.approx(2**1.5, rel=1e-3)
    offset = ITEMS["wheel_offset"].reference
    assert offset(2.0, 0.01, 0.5) / offset(1.0, 0.01, 0.5) == pytest.approx(4, rel=1e-3)
    assert offset(100.0, 0.01, 0.5) / offset(50.0, 0.01, 0.5) < 4  # it has turned by more than a little


def by_the_radius(v_left, v_right, track):
    v = (v_left + v_right) / 2
    radius = track / 2 * (v_right + v_left) / (v_right - v_left) if v_right != v_left else np.inf
    return np.array([v, v / radius if radius else 0.0])


def between_wrapped_headings(x, u, dt):
    after = np.angle(np.exp(1j * (x[2] + u[1] * dt)))
    middle = (x[2] + after) / 2
    return np.array([x[0] + u[0] * dt * np.cos(middle), x[1] + u[0] * dt * np.sin(middle), after])


def by_half_of_the_wrapped_turn(x, u, dt):
    turn = np.angle(np.exp(1j * u[1] * dt))
    middle = x[2] + turn / 2
    return np.array([x[0] + u[0] * dt * np.cos(middle), x[1] + u[0] * dt * np.sin(middle), x[2] + turn])


def by_powells_method(landmarks, distances, start):
    return fsolve(lambda x: ((landmarks - x) ** 2).sum(axis=1) - distances**2, start)


def on_the_upper_side(landmarks, distances, start):
    """Which of both points is above the other is taken for the side of the start."""
    above, below = sorted(lateration.circle_intersections(landmarks, distances), key=lambda p: -p[1])
    return above if start[1] > 0 else below


def test_what_is_right_on_some_draws_is_told_what_the_others_are():
    told = ITEMS["newton_lateration"].judge(on_the_upper_side, rng=np.random.default_rng(0)).text
    assert "Where it is wrong: This is the mirror image" in told


@pytest.mark.parametrize(
    "name, answer, words",
    [
        ("wheel_to_twist", by_the_radius, "turn on the spot"),
        ("step_midpoint", between_wrapped_headings, "179 deg"),
        ("step_midpoint", by_half_of_the_wrapped_turn, "more than half a circle"),
        ("newton_lateration", by_powells_method, "on their side of the line through both landmarks"),
    ],
)
def test_special_turns_and_starts_are_drawn(name, answer, words, monkeypatch):
    monkeypatch.setattr(budget, "LOOKING", 0.0)  # what is looked for in the code is not asked here
    assert all(words in text for text in texts(name, answer))


def until_x_stands_still(landmarks, distances, start):
    x = np.array(start, dtype=float)
    for _ in range(30):
        away = x - landmarks
        step = np.linalg.solve(2 * away, (away**2).sum(1) - distances**2)
        x = x - step
        if abs(step[0]) < 1e-9:
            break
    return x


def by_the_radius_of_the_car(speed, steering, wheelbase):
    return np.array([speed, speed / (wheelbase / math.tan(steering))])


@pytest.mark.parametrize(
    "name, answer", [("newton_lateration", until_x_stands_still), ("ackermann_twist", by_the_radius_of_the_car)]
)
def test_landmarks_in_a_row_and_wheels_straight_ahead_are_drawn(name, answer):
    assert CORRECT not in [ITEMS[name].judge(answer, rng=np.random.default_rng(seed)).status for seed in range(3)]


def standing(u, dt, k_d, k_theta, k_drift):
    v, omega = np.abs(u)
    return np.diag([k_d * v / dt, (k_theta * omega + k_drift * v) / dt if v else 0.0])


def turned_or_not(x, u, dt):
    omega = u[1] if abs(u[1]) > 0.1 else 0.0
    middle = x[2] + omega * dt / 2
    return x + dt * np.array([u[0] * np.cos(middle), u[0] * np.sin(middle), omega])


NEARLY = {
    "wheel_to_twist": lambda a, b, l: np.array([(a + b) / 2, (b - a) / l if abs(b - a) > 0.05 else 0.0]),
    "step_midpoint": turned_or_not,
    "control_covariance": standing,
    "ackermann_twist": lambda v, d, l: np.array([v, v * np.tan(d) / l if abs(d) > 0.06 else 0.0]),
    "wheel_offset": lambda w, e, l: (w / e + w / 2) / (w / l) * (1 - np.cos(w * e / l)) if abs(e) > 1e-3 else 0.0,
}


@pytest.mark.parametrize("name", NEARLY)
def test_what_is_nearly_straight_or_nearly_at_rest_is_not_taken_for_it(name):
    outcome = ITEMS[name].judge(NEARLY[name], rng=np.random.default_rng(0))
    assert outcome.status == NOT_YET and outcome.mistake is None


@pytest.mark.parametrize("name", ["step_euler", "step_midpoint", "step_arc"])
def test_a_copy_of_a_pose_of_integers_cuts_off_decimals(name):
    def copied(x, u, dt):
        new = np.array(x)
        new[:] = ITEMS[name].reference(x, u, dt)
        return new

    outcome = ITEMS[name].judge(copied, rng=np.random.default_rng(0))
    assert outcome.status == NOT_YET and "array of integers" in outcome.text


def test_a_drift_that_counts_on_straight_lines_alone_is_not_told_to_be_missing_there():
    def answer(u, dt, k_d, k_theta, k_drift):
        v, w = np.abs(u)
        return np.diag([k_d * v, k_theta * w if w else k_drift * v]) / dt

    outcome = ITEMS["control_covariance"].judge(answer, rng=np.random.default_rng(0))
    assert "in a curve and on a straight line" in outcome.text


def test_a_start_of_whole_numbers_is_not_rounded_on_the_way():
    def in_whole_meters(landmarks, distances, start):
        x = np.array(start)
        for _ in range(20):
            x[:] = x - np.linalg.solve(2 * (x - landmarks), ch07.lateration_residual(landmarks, distances, x))
        return x

    assert all("whole numbers" in text for text in texts("newton_lateration", in_whole_meters))


@pytest.mark.parametrize("n, along", [(50, 0.0), (100, 0.5), (20, 1.0)])
def test_a_circle_of_short_straight_steps_is_told(n, along):
    def steps(way, excess, track):
        x, turn = np.zeros(2), way * excess / track
        for k in range(n):
            heading = turn * (k + along) / n
            x = x + way * (1 + excess / 2) / n * np.array([np.cos(heading), np.sin(heading)])
        return x[1]

    assert all("short straight steps" in text for text in texts("wheel_offset", steps))


def by_the_hypotenuse(way, excess, track):
    radius = track / excess + track / 2
    return radius * (1 - np.cos(np.hypot(way, radius)))


def test_an_argument_is_not_called_right_where_another_one_belongs():
    text = ITEMS["wheel_offset"].judge(by_the_hypotenuse, rng=np.random.default_rng(0)).text
    assert "though `radius` in it is a value of the solution as well: look at what is done with it" in text


def newton_until(step_below):
    def answer(landmarks, distances, start):
        x, step = np.array(start, dtype=float), np.inf
        while np.linalg.norm(step) >= step_below:
            step = np.linalg.solve(2 * (x - landmarks), ch07.lateration_residual(landmarks, distances, x))
            x = x - step
        return x

    return answer


def straight_below(omega):
    return lambda x, u, dt: arc(x, u, dt, np.nextafter(omega, 0))


def propagated_by_a_root(x, cov, u, dt, cov_u):
    L = np.linalg.cholesky(cov_u)
    return ch07.propagate(x, cov, u, dt, L @ L.T)


def slopes_of_wrapped_steps(x, u, dt):
    def step(x):
        end = ch07.step_euler(x, u, dt)
        return np.append(end[:2], np.angle(np.exp(1j * end[2])))

    return np.column_stack([(step(x + e) - step(x - e)) / 2e-6 for e in 1e-6 * np.eye(3)])


def by_the_largest_wheel(speeds, half_length, half_width):
    largest = np.abs(speeds).max()
    return largest * ch07.mecanum_twist(speeds / largest, half_length, half_width)


@pytest.mark.parametrize(
    "name, wrong, right",
    [
        ("newton_lateration", newton_until(1e-3), newton_until(1e-6)),
        ("step_arc", straight_below(1e-4), ch07.step_arc),
        ("propagate", propagated_by_a_root, ch07.propagate),
        ("jacobian_state", slopes_of_wrapped_steps, ch07.jacobian_state),
        ("mecanum_twist", by_the_largest_wheel, ch07.mecanum_twist),
    ],
)
def test_what_is_wrong_at_one_place_alone_is_missed_there(name, wrong, right):
    drawn = one_check(ITEMS[name])
    with np.errstate(invalid="ignore"):
        assert any(is_missed(wrong, *case) for case in drawn)
    assert not any(is_missed(right, *case) for case in drawn)


def test_a_rounded_pose_may_have_its_heading_wrapped():
    item = ITEMS["end_pose"]
    pose = item.reference() - [0.0, 0.0, 2 * np.pi]
    assert item.judge(np.round(pose, 4)).status == CORRECT
    assert item.judge(np.round(pose, 1)).status == NOT_YET
    assert "midpoint" in item.judge(ch07._circle("midpoint")[0] - [0.0, 0.0, 2 * np.pi]).text


def test_the_larger_part_of_the_noise_of_the_turn_rate_is_not_always_the_same():
    parts = [
        (k_theta * abs(u[1]), k_drift * abs(u[0]))
        for (u, _, _, k_theta, k_drift), *_ in one_check(ITEMS["control_covariance"])[:3]
    ]
    assert len({turn > drift for turn, drift in parts}) == 2


@pytest.mark.parametrize("below", [0.1, 0.05, 0.02, 0.01, 0.005])
def test_gentle_curves_are_no_midpoint_steps(below):
    def answer(x, u, dt):
        return odometry.step(x, u, dt, "midpoint" if abs(u[1]) < below else "arc")

    assert any(is_missed(answer, *case) for case in one_check(ITEMS["step_arc"]))
