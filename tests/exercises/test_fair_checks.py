"""Checks of chapters 7, 8 and 10 that no lucky draw may decide, and answers that are right in another form."""

import re

import numpy as np
import pytest

from labkit.chapters.ch07_dead_reckoning import exercises as ch07
from labkit.chapters.ch08_kalman import exercises as ch08
from labkit.chapters.ch10_ledger import exercises as ch10
from labkit.documents.lecture import printed as lecture
from labkit.exercises import metrics
from labkit.exercises.engine import Exercise
from labkit.exercises.outcome import CORRECT, NOT_YET
from labkit.exercises.value import Value
from labkit.geometry import planar
from labkit.localization import ekf, odometry


def item(module, name):
    return next(i for i in module.CHAPTER.items if i.id == name)


def turned(pose):
    """The same pose, its heading in (-pi, pi]."""
    return np.array([*pose[:2], -planar.wrap_angle(-pose[2])])


def test_a_planar_pose_is_the_same_after_a_turn():
    metric, pose = metrics.PlanarPoses(), np.array([1.0, -2.0, 3.1])
    assert metric.equal(pose + [0, 0, -2 * np.pi], pose) and metric.equal(list(pose), pose)
    assert not metric.equal(pose + [0, 0, 0.01], pose) and not metric.equal(pose + [1e-6, 0, 0], pose)
    position, heading = metric.deviations(pose + [0.3, 0.4, 2 * np.pi + 0.1], pose)
    assert str(position) == "the position is off by 0.5 m" and str(heading) == "the heading is off by 5.73 deg"
    assert not metric.equal([1.0, 2.0], pose)


@pytest.mark.parametrize("name", ["step_euler", "step_midpoint", "step_arc"])
def test_a_wrapped_heading_is_correct(name):
    exercise = item(ch07, name)
    for seed in range(4):
        outcome = exercise.judge(lambda x, u, dt: turned(exercise.reference(x, u, dt)), rng=np.random.default_rng(seed))
        assert outcome.status == CORRECT, outcome.text


def test_a_wrapped_heading_is_correct_in_the_loop_and_in_the_filter():
    end = item(ch07, "end_pose")
    assert end.judge(turned(end.reference())).status == CORRECT
    for module, name in ((ch07, "propagate"), (ch08, "ekf_step")):
        exercise = item(module, name)

        def answer(*given, exercise=exercise):
            pose, cov = exercise.reference(*given)
            return turned(pose), cov

        assert exercise.judge(answer, rng=np.random.default_rng(0)).status == CORRECT


def luck(exercise, variant, tries=200):
    """The probability that a wrong variant is right on all draws of a check, from its share of right answers a case."""
    rng, shares = np.random.default_rng(5), []
    for draw in exercise.cases:
        arguments = [draw(rng) for _ in range(tries)]
        shares.append(np.mean([exercise.metric.equal(variant(*a), exercise.reference(*a)) for a in arguments]))
    return np.prod([shares[k % len(shares)] for k in range(exercise.draws)])


@pytest.mark.parametrize(
    "module, name, variant",
    [
        (ch08, "gate", lambda y, S, limit: bool((y**2 / np.diag(S)).sum() <= limit)),
        (ch08, "gate", lambda y, S, limit: True),
        (ch08, "wrap_angle", lambda a: a - 2 * np.pi * np.sign(a) * (abs(a) > np.pi)),
        (ch08, "wrap_angle", lambda a: np.fmod(a + np.pi, 2 * np.pi) - np.pi),
        (ch10, "half_unit", ch10._without_comma),
        (ch10, "half_unit", ch10._without_exponent),
    ],
)
def test_no_wrong_answer_passes_by_luck(module, name, variant):
    exercise = item(module, name)
    assert luck(exercise, variant) < 2e-3


def test_letting_everything_pass_is_named_as_such():
    outcome = item(ch08, "gate").judge(lambda y, S, limit: True, rng=np.random.default_rng(1))
    assert outcome.status == NOT_YET and "everything" in outcome.text


def test_references_take_lists_as_the_student_would_write_them():
    x, var = ch08.fuse_two_sensors(0, 20, [9.4, 10.6], [0.5, 1])
    np.testing.assert_allclose([x, var], [48.2 / 5.05, 1 / 5.05])
    np.testing.assert_allclose(ch08.measurement([0.0, 0.0, 0.0], [3.0, 4.0]), [5.0, np.arctan2(4, 3)])
    assert ch08.measurement_jacobian([0.0, 0.0, 0.0], [3.0, 4.0]).shape == (2, 3)


def lines_of(item):
    """The code of a last hint, a line in each pair of backquotes."""
    return re.findall("`([^`]*)`", item.hints[-1])


def notebook_names(module):
    known = {i.id: i.reference for i in module.CHAPTER.items if isinstance(i, Exercise)}
    prior_cov = np.array([[1.9469, 0.2550], [0.2550, 0.0916]])
    return known | {"np": np, "odometry": odometry, "drive": lecture.circle_drive(), "prior_cov": prior_cov}


@pytest.mark.parametrize("name", ["end_pose", "end_cov", "fused", "corrected"])
def test_the_last_hint_gives_the_value_as_it_stands(name):
    module = ch07 if name.startswith("end") else ch08
    value, space = item(module, name), notebook_names(module)
    assert isinstance(value, Value)
    exec("\n".join(lines_of(value)), space)
    assert value.judge(space[name]).status == CORRECT


def test_forward_differences_are_a_jacobian():
    def slopes(function, x, h=1e-6, minus=np.subtract):
        return np.column_stack([minus(function(x + h * e), function(x)) / h for e in np.eye(len(x))])

    def F_x(x, u, dt):
        return slopes(lambda x: odometry.step(x, u, dt, "euler"), x)

    def H(x, landmark):
        return slopes(lambda x: ekf.measurement(x, landmark[None])[0], x, minus=with_the_bearing_wrapped)

    def with_the_bearing_wrapped(one, other):
        return np.array([one[0] - other[0], ch08.wrap_angle(one[1] - other[1])])

    assert item(ch07, "jacobian_state").judge(F_x, rng=np.random.default_rng(0)).status == CORRECT
    assert item(ch08, "measurement_jacobian").judge(H, rng=np.random.default_rng(0)).status == CORRECT


@pytest.mark.parametrize("seed", range(10))
def test_a_search_that_ignores_its_start_never_passes(seed):
    def from_origin(landmarks, distances, start):
        return ch07.newton_lateration(landmarks, distances, np.zeros(2))

    outcome = item(ch07, "newton_lateration").judge(from_origin, rng=np.random.default_rng(seed))
    assert outcome.status == NOT_YET and "origin" in outcome.text
