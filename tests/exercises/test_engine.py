# ruff: noqa: NPY002, SIM105, SIM223 (hostile student code, on purpose)
"""The engine survives any student code and says what is wrong with it."""

import ast
import copy
import itertools
import json
import math
import os
import re
import struct
import subprocess
import sys
import threading
import time
from dataclasses import replace
from decimal import Decimal

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from labkit.chapters.ch01_frames.exercises import CHAPTER, random_pose
from labkit.exercises import feedback, guard, metrics, progress, session, slips, source, staying, wording
from labkit.exercises.engine import Chapter, Exercise, Prediction
from labkit.exercises.feedback import Panel
from labkit.exercises.outcome import CORRECT, NOT_YET, RAISED, TO_DO, Mistake
from labkit.exercises.trial import Trial
from labkit.exercises.value import Value
from labkit.exercises.wording import short
from labkit.geometry import frames
from labkit.geometry.lie import exp_so3

INVERT = CHAPTER["invert"]
THEIRS = {
    "invert": frames.invert,
    "gram_schmidt": frames.gram_schmidt,
    "relative": frames.relative,
}  # as nobody may call


def scale(v):
    return 2.0 * v


DOUBLE = Exercise(
    "double",
    reference=scale,
    draw=lambda rng: (rng.normal(size=3),),
    metric=metrics.Numbers(),
    hints=("a", "b", "c"),
    mistakes=[Mistake(lambda v: v * v, "squared")],
)


# Correct ways ---------------------------------------------------------------------------------------------------------


def loops(T):
    X = [[0.0] * 4 for _ in range(4)]
    for i in range(3):
        for j in range(3):
            X[i][j] = float(T[j][i])
        X[i][3] = -sum(float(T[k][i] * T[k][3]) for k in range(3))
    X[3][3] = 1.0
    return X


def broadcast(T):
    return np.block([[T[:3, :3].T, -T[:3, :3].T @ T[:3, 3:]], [np.zeros(3), 1.0]])


def with_scipy(T):
    R = Rotation.from_matrix(T[:3, :3]).inv()
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R.as_matrix(), -R.apply(T[:3, 3])
    return X


@pytest.mark.parametrize(
    "way",
    [
        loops,
        broadcast,
        with_scipy,
        np.linalg.inv,
        lambda T: np.asmatrix(np.linalg.inv(T)),
    ],
)
def test_every_correct_way_is_accepted(way):
    assert INVERT.judge(way).status == CORRECT


def test_single_precision_is_refused_by_its_name():
    outcome = INVERT.judge(lambda T: THEIRS["invert"](T).astype(np.float32))
    assert outcome.status == NOT_YET and "as far as single precision goes" in outcome.text


def test_scipy_rotation_counts_as_its_matrix():
    gram_schmidt = CHAPTER["gram_schmidt"]
    assert gram_schmidt.judge(lambda a, b: Rotation.from_matrix(THEIRS["gram_schmidt"](a, b))).status == CORRECT


def test_printing_and_seeding_does_not_make_a_right_answer_wrong():
    def chatty(v):
        np.random.seed(1)
        print("looking at", v)
        return 2 * v

    outcome = DOUBLE.judge(chatty)
    assert outcome.status == CORRECT
    assert outcome.printed.startswith("looking at")


# Hostile code ---------------------------------------------------------------------------------------------------------


def endless(v):
    while True:
        pass


def endless_with_bare_except(v):
    while True:
        try:
            v = v + 0
        except:  # noqa: E722
            pass


def sleeping(v):
    time.sleep(60)


def recursive(v):
    return recursive(v)


def raising(v):
    return 1 / 0


def leaving(v):
    sys.exit(0)


def killing(v):
    os._exit(1)


def asking(v):
    return float(input("value? "))


def flooding(v):
    for _ in range(2000):
        print("x" * 1000)
    return 2 * v


def huge_view(v):
    return np.broadcast_to(0.0, (10**5, 10**5, 3))


def mutating(v):
    v *= 2
    return v


def interrupting(v):
    raise KeyboardInterrupt


class Unprintable(Exception):
    def __str__(self):
        raise RuntimeError("no")


def unprintable(v):
    raise Unprintable


class Hostile:
    def __array__(self, *args, **kwargs):
        raise RuntimeError("no array")


@pytest.mark.parametrize(
    "function, status, words",
    [
        (endless, NOT_YET, "did not finish within 0.5 s"),
        (endless_with_bare_except, NOT_YET, "did not finish within 0.5 s"),
        (sleeping, NOT_YET, "did not finish within 0.5 s"),
        (recursive, RAISED, "calls itself again and again"),
        (raising, RAISED, "ZeroDivisionError"),
        (leaving, NOT_YET, "calls exit()"),
        (killing, NOT_YET, "os._exit()"),
        (asking, NOT_YET, "input()"),
        (interrupting, RAISED, "KeyboardInterrupt"),
        (unprintable, RAISED, "Unprintable"),
        (huge_view, NOT_YET, "got one of shape (100000, 100000, 3)"),
        (mutating, NOT_YET, "changes its argument `v`"),
        (lambda v: 2 * np.arctan(v, v), NOT_YET, "`np.arctan2` takes two"),
        (lambda v: np.arctan(v, 2.0), RAISED, "is `np.arctan2` meant?"),
        (lambda v: None, TO_DO, ""),
        (lambda v: [] and v, NOT_YET, "expected an array of shape (3,), got shape (0,)"),
        (lambda v: np.full(3, np.nan), NOT_YET, "NaN in 3 of 3"),
        (lambda v: (x for x in v), NOT_YET, "still to be computed"),
        (lambda v: object(), NOT_YET, "an object"),
        (lambda v: Hostile(), NOT_YET, "Hostile"),
        (lambda v: np.linalg.norm, NOT_YET, "parentheses"),
        (lambda v: v[:, None], NOT_YET, "the right number of entries, arranged differently"),
        (lambda v: "2v", NOT_YET, "got a str"),
        (lambda v: v + 1j, NOT_YET, "complex"),
        (lambda v: v > 0, NOT_YET, "True or False"),
        (lambda: 0, NOT_YET, "cannot be called with (v)"),
        (lambda a, b: a, NOT_YET, "cannot be called with (v)"),
        (lambda v: [[1, 2], [3]], NOT_YET, "of 2 parts that differ in shape: return one array"),
        (17, NOT_YET, "expected a function"),
        ("text", NOT_YET, "expected a function"),
    ],
)
def test_hostile_code_gets_one_sentence(function, status, words):
    item = replace(DOUBLE, limit=0.5) if "did not finish" in words else DOUBLE
    started = time.thread_time()
    outcome = item.judge(function)
    assert (outcome.status, words in outcome.text) == (status, True), outcome
    assert time.thread_time() - started < 1.5


def test_flood_of_output_is_cut():
    outcome = DOUBLE.judge(flooding)
    assert outcome.status == CORRECT
    assert len(outcome.printed) < 2 * guard.OUTPUT_LIMIT
    assert "more characters" in outcome.printed


def test_time_limit_in_another_thread():
    """Where no signal can be used (Windows, other threads) a second thread ends a Python loop."""
    found = []
    thread = threading.Thread(target=lambda: found.append(replace(DOUBLE, limit=0.5).judge(endless)))
    thread.start()
    thread.join(timeout=10)
    assert "did not finish" in found[0].text


WATCHED_AFTERWARDS = """
import sys, threading
from labkit.exercises import guard

def endless():
    while True:
        pass

def one():
    return 1

def check():
    assert isinstance(guard.run(endless, (), limit=0.2).error, guard.TimeLimit)
    assert guard.run(one, (), limit=0.2).result == 1
    sys.setprofile(lambda *_: None)
    found.append(one())
    sys.setprofile(None)

found = []
thread = threading.Thread(target=check)
thread.start()
thread.join()
assert found
"""


def test_a_profiler_runs_after_a_check_in_another_thread():
    """Python 3.11 hangs in the first call a profiler sees when an exception of another thread was taken back."""
    words = [sys.executable, "-c", WATCHED_AFTERWARDS]
    assert subprocess.run(words, cwd=source.ROOT, timeout=20, capture_output=True).returncode == 0


def test_interpreter_state_is_put_back():
    def careless(v):
        np.random.seed(0)
        np.seterr(all="raise")
        np.set_printoptions(precision=1)
        sys.setrecursionlimit(5000)
        os.chdir("/")
        return 2 * v

    before = np.random.get_state()[1].copy(), np.geterr(), np.get_printoptions(), sys.getrecursionlimit(), os.getcwd()
    assert DOUBLE.judge(careless).status == CORRECT
    after = np.random.get_state()[1], np.geterr(), np.get_printoptions(), sys.getrecursionlimit(), os.getcwd()
    np.testing.assert_array_equal(before[0], after[0])
    assert before[1:] == after[1:]


def test_patching_the_library_changes_no_check_and_is_named(capsys):
    original, norm = frames._invert, np.linalg.norm
    ex = session.course("01-frames")

    def patching(T):
        frames._invert = lambda T: T
        np.linalg.norm = lambda *_, **__: 0.0
        return T

    ex.invert(patching)
    assert frames._invert is original and np.linalg.norm is norm
    assert "labkit.geometry.frames._invert, numpy.linalg.norm" in capsys.readouterr().out
    frames.invert = None  # a careless cell before the check
    ex.relative(frames.relative)
    assert "Replaced in the library, and put back: labkit.geometry.frames.invert" in capsys.readouterr().out


def test_seeding_numpy_does_not_fix_the_draws():
    seen = []
    for _ in range(2):
        np.random.seed(3)
        seen.append([])
        DOUBLE.judge(lambda v: seen[-1].append(v.tobytes()) or 2 * v)
    assert not set(seen[0][: DOUBLE.draws]) & set(seen[1][: DOUBLE.draws])


# Diagnosis ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda v: -2 * v, "right up to its sign"),
        (lambda v: 2000 * v, "a thousand times the expected one: are two units mixed up?"),
        (lambda v: 4 * v, "twice the expected one"),
        (lambda v: v, "half the expected one"),
        (lambda v: np.rad2deg(2 * v), "180/pi times the expected one, as if it were converted to degrees"),
        (lambda v: np.deg2rad(2 * v), "pi/180 times the expected one, as if it were converted to radians"),
        (lambda v: 2 * v[::-1], "in reverse order"),
        (lambda v: 6.2 * v, "3.1 times the expected one"),
        (lambda v: 6 * v, "3 times the expected one, on every draw: a sum where a mean is meant?"),
        (lambda v: 2 * v / 3, "1/3 of the expected one, on every draw: a mean where a sum is meant?"),
        (lambda v: 2 * v + np.array([0, 0, 0.5]), "off by 0.5"),
        (lambda v: v * v, "squared"),
    ],
)
def test_general_layer_on_numbers(change, words):
    outcome = DOUBLE.judge(change)
    assert outcome.status == NOT_YET
    assert words in outcome.text.lower(), outcome.text


@pytest.mark.parametrize("most, told", [(1.5, False), (np.inf, True)])
def test_a_relation_holds_on_fresh_draws_as_well(most, told):
    outcome = DOUBLE.judge(lambda v: -2 * v if v.max() < most else 3 * v, np.random.default_rng(0))
    assert ("right up to its sign" in outcome.text) is told


POSE = Exercise(
    "pose",
    reference=lambda T: T.copy(),
    draw=lambda rng: (random_pose(rng),),
    metric=metrics.Poses(),
    hints=("a", "b", "c"),
)


def moved(T, R=None, t=None):
    X = T.copy()
    X[:3, :3] = T[:3, :3] if R is None else R
    X[:3, 3] = T[:3, 3] if t is None else t
    return X


@pytest.mark.parametrize(
    "change, words",
    [
        (frames.invert, "inverse of the expected pose"),
        (lambda T: moved(T, R=T[:3, :3].T), "rotation is transposed"),
        (lambda T: moved(T, t=T[:3, 3] / 1000), "mm against m"),
        (lambda T: moved(T, t=-T[:3, 3]), "opposite sign"),
        (lambda T: moved(T, R=T[:3, :3] * (1, 1, -1)), "determinant is -1"),
        (lambda T: moved(T, R=2 * T[:3, :3]), "not orthonormal"),
        (lambda T: moved(T, t=T[:3, 3] + 5), "translation is not"),
        (lambda T: moved(T, R=np.diag([1.0, -1, -1])), "rotation is not"),
        (lambda T: moved(T, R=np.eye(3)), "if `T` did not turn"),
        (lambda T: T.T.copy(), "with `T` transposed"),
        (lambda T: T - 0.5, "last row must be 0 0 0 1"),
        (lambda T: 1.0001 * T, "last row must be 0 0 0 1, got 0 0 0 1.0001"),
        (lambda T: T[:3], "expected an array of shape (4, 4)"),
        (lambda T: frames.pose(T[:3, :3] @ frames.matrix_from_kuka([0, 0, 0, 0.1, 0, 0])[:3, :3], T[:3, 3] + 1), "deg"),
    ],
)
def test_general_layer_on_poses(change, words):
    outcome = POSE.judge(change)
    assert outcome.status == NOT_YET
    assert words in outcome.text, outcome.text


def test_raised_error_names_line_and_call():
    outcome = DOUBLE.judge(raising)
    assert "division by zero" in outcome.text
    assert "return 1 / 0" in outcome.text
    assert "when called as double(v=[" in outcome.text


def asserting(v):
    raise AssertionError  # what a bare assert raises outside of pytest


@pytest.mark.parametrize(
    "answer, words",
    [
        (lambda v: np.eye(3) @ np.ones((5, 3)), "The inner sizes must agree"),
        (lambda v: np.linalg.solve(np.zeros((2, 2)), np.ones(2)), "depend on one another"),
        (lambda v: np.linalg.solve(np.eye(3), np.ones((2, 2))), "as many rows as the matrix"),
        (lambda v: np.sqrt(v, 2.0), "write the result into"),
        (lambda v: [1].shape, "no array"),
        (lambda v: np.linalg.lstsq(np.ones((9, 2)), np.ones((3, 3)))[0], "`.ravel()`"),
        (lambda v: math.sin(v), "`np.sin` and the like take arrays"),
        (lambda v: np.array([[1, 2], [3]]), "differ in shape"),
        (lambda v: v if v > 0 else -v, "go entry by entry"),
        (lambda v: v ^ 2, "write `**`"),
        (lambda v: math.sqrt(-1.0), "np.clip"),
        (lambda v: np.ones((5, 2)) * np.ones(4), "is `@` meant"),
        (lambda v: v * np.ones((5, 2)), "no argument of this call has a size of 2"),
        (asserting, "handed over with `return`"),
        (lambda v: struct.unpack("<3f", bytes(24)), "d takes 8 bytes"),
    ],
)
def test_what_numpy_means(answer, words):
    outcome = DOUBLE.judge(answer)
    told = outcome.text.partition("\nin line")[0]  # the line that is shown behind it is one of this test
    assert outcome.status == RAISED and words in told


def test_small_arguments_keep_their_digits():
    assert short(np.array([4e-8, -1.0e-9])) == "[ 4.e-08, -1.e-09]"
    assert short(np.array([4e-8, 2.0])) == "[0., 2.]"


def test_a_near_wrong_value_is_told_from_a_rounded_right_one():
    length = Value(
        "length",
        reference=lambda: 98.352,
        unit="mm",
        hints=("a", "b", "c"),
        mistakes=[Mistake(lambda: 98.337, "y and z alone")],
    )
    assert length.judge(98.35).status == length.judge(98.4).status == CORRECT
    assert length.judge(98.337).text == "y and z alone"


def test_degrees_converted_twice_are_not_told_to_be_radians():
    for unit, other, once_more, once_less in (
        ("deg", "radians", np.rad2deg, np.deg2rad),
        ("rad/s", "degrees", np.deg2rad, np.rad2deg),
    ):
        angle = Value("angle", reference=lambda: 2.5, unit=unit, hints=("a", "b", "c"))
        assert "once too often" in angle.judge(once_more(2.5)).text
        assert f"in {other} where" in angle.judge(once_less(2.5)).text


def test_the_rotation_alone_can_be_a_named_mistake_of_a_pose():
    exercise = replace(INVERT, mistakes=(Mistake(lambda T: T[:3, :3].T, "the rotation alone"),))
    assert exercise.judge(lambda T: T[:3, :3].T).text == "the rotation alone"


def test_a_count_is_not_rounded():
    count = Value("count", reference=lambda: 162, hints=("a", "b", "c"), rtol=1e-6)
    assert "as far as it goes" not in count.judge(160).text
    length = Value("length", reference=lambda: 162.37, hints=("a", "b", "c"), rtol=1e-6)
    assert length.judge(162).status == CORRECT
    assert "as far as it goes" in length.judge(160).text
    assert "right to one digit only" in length.judge(200).text


def test_one_array_for_two_results_is_told_its_shape():
    two = metrics.Several(metrics.Numbers(), metrics.Numbers(), names=("x", "cov"))
    with pytest.raises(metrics.Refused, match=r"got one array of shape \(3,\)"):
        two.admit(np.zeros(3), (0.0, 1.0))


def test_a_function_among_the_arguments_is_shown_by_its_name():
    assert short(asserting) == "asserting"


def test_a_word_written_otherwise_is_told_how_it_is_written():
    words = metrics.Exactly()
    for written in ("not_stationary", "not-stationary"):
        with pytest.raises(metrics.Refused, match="is the right word, but it is written 'not stationary'"):
            words.admit(written, "not stationary")
    assert words.equal(words.admit(" Not stationary", "not stationary"), "not stationary")
    assert not words.equal(words.admit("notstationary", "not stationary"), "not stationary")


@pytest.mark.parametrize(
    "result, words",
    [(np.linalg.lstsq(np.eye(3), np.ones(3)), "four things"), ((np.ones(3), 0.1, 7, np.ones(3)), "got a tuple")],
)
def test_four_results_are_those_of_lstsq_where_they_can_be(result, words):
    with pytest.raises(metrics.Refused, match=words):
        metrics.as_array(result, (3,))


@pytest.mark.parametrize("result", [Decimal("0.5"), np.array([Decimal("0.5"), Decimal(1)])])
def test_a_decimal_is_refused_since_it_mixes_with_no_float(result):
    with pytest.raises(metrics.Refused, match=r"got a Decimal, which does not mix with floats: float\(...\) makes one"):
        metrics.Numbers().admit(result, np.zeros(np.shape(result)))


def test_none_in_place_of_a_set_is_told_what_an_empty_set_is():
    with pytest.raises(metrics.Refused, match=r"is a `return` missing\? The empty set is set\(\)"):
        metrics.Exactly().admit(None, set())


def test_truth_values_are_no_indices():
    exercise = Exercise(
        "keep",
        reference=lambda v: v > 0,
        draw=lambda rng: (rng.normal(size=5),),
        metric=metrics.Exactly(),
        hints=("a", "b", "c"),
    )
    assert "an array of True and False" in exercise.judge(lambda v: np.argsort(v)).text
    assert exercise.judge(lambda v: (v > 0).astype(int)).status == CORRECT


def test_a_rotation_is_a_rotation_also_within_a_loose_angle():
    near = metrics.Rotations(1.0)
    turn = exp_so3([0, 0, np.deg2rad(0.5)])
    assert near.equal(turn, np.eye(3))
    assert not near.equal(turn + 1e-4 * np.ones((3, 3)), np.eye(3))


def test_wrong_on_some_draws_only_says_so():
    exercise = Exercise(
        "size",
        reference=abs,
        draw=lambda rng: (float(rng.choice([-1, 1]) * rng.uniform(1, 2)),),
        metric=metrics.Numbers(),
        hints=("a", "b", "c"),
        draws=20,
    )
    text = exercise.judge(lambda v: v, rng=np.random.default_rng(0)).text
    assert "draws it was wrong exactly where `v` is negative" in text
    assert "Not right when called as size(v=-" in text


def test_a_call_that_is_shown_gives_what_is_shown_and_infinity_may_stand_in_it():
    def judged(draw, reference, answer):
        item = Exercise("f", reference=reference, draw=draw, metric=metrics.Numbers(), hints=("a", "b", "c"))
        return item.judge(answer, rng=np.random.default_rng(0)).text

    def bent(v):
        return v * np.sign(v[0]) / np.linalg.norm(v) + 0.01 * np.sin(1000 * v)

    text = judged(lambda rng: (rng.uniform(-1e-2, 1e-2, 3),), lambda v: v / np.linalg.norm(v), bent)
    given, gives = re.search(r"f\(v=(\[.*?\])\): it gives (\[.*?\])", text).groups()
    assert np.allclose(bent(np.array(ast.literal_eval(given))), ast.literal_eval(gives), atol=6e-4)
    infinite = judged(
        lambda rng: (np.append(rng.normal(size=3), -np.inf),),
        lambda v: float(np.exp(v).sum()),
        lambda v: float(1.7 * (np.exp(v) ** 2).sum() + v[0]),
    )
    assert "-inf" in infinite and "it gives" in infinite


@pytest.mark.parametrize("right_below", [0.0, 3.0])
def test_what_is_off_is_off_in_the_call_that_stands_beside_it(right_below):
    exercise = Exercise(
        "power",
        reference=lambda v: 10.0**v,
        draw=tuple(lambda rng, v=v: (v,) for v in (2.0, 4.0, 6.0, 3.5, 9.0)),
        metric=metrics.Numbers(least=0.0),
        hints=("a", "b", "c"),
    )
    text = exercise.judge(lambda v: 10.0**v + (v**v if v > right_below else 0)).text
    off, v, result = (
        float(re.search(p, text)[1]) for p in (r"off by (\d[\d.e+]*\d)", r"\(v=([\d.]+)\)", r"gives ([\d.e+]+)")
    )
    assert off == pytest.approx(result - 10.0**v, rel=0.01)


def test_noisy_draw_catches_a_fit_that_is_exact_only_on_clean_data():
    mean = Exercise(
        "mean",
        reference=np.mean,
        draw=lambda rng: (np.full(9, rng.normal()),),
        metric=metrics.Numbers(),
        noisy=(lambda rng: (rng.normal(size=9),), metrics.Numbers(1e-6)),
        hints=("a", "b", "c"),
    )
    assert mean.judge(lambda x: x.mean()).status == CORRECT
    assert "on noisy data" in mean.judge(lambda x: x[3]).text


def test_properties_judge_stochastic_code():
    def unbiased(draw_one, rng):
        mean = np.mean([draw_one(rng) for _ in range(400)])
        return None if abs(mean - 0.5) < 0.1 else f"the mean of 400 draws is {mean:.2f}, expected about 0.5"

    def uniform(rng):
        return rng.uniform()

    exercise = Exercise(
        "uniform",
        reference=uniform,
        draw=lambda rng: (np.random.default_rng(int(rng.integers(2**31))),),
        properties=[unbiased],
        mistakes=[Mistake(lambda rng: rng.uniform() ** 2, "squared")],
        hints=("a", "b", "c"),
    )
    assert exercise.judge(lambda rng: 1 - rng.uniform()).status == CORRECT
    assert exercise.judge(lambda rng: rng.uniform() ** 2).text == "squared"
    assert "the mean of 400" in exercise.judge(lambda rng: 0.3 * rng.uniform()).text
    assert "ZeroDivisionError" in exercise.judge(lambda rng: 1 / 0).text


def test_several_results_are_named():
    exercise = Exercise(
        "both",
        reference=lambda v: (v, -v),
        draw=lambda rng: (rng.normal(size=3),),
        hints=("a", "b", "c"),
        metric=metrics.Several(metrics.Numbers(unit="mm"), metrics.Numbers(), names=("tip", "pivot")),
    )
    assert exercise.judge(lambda v: [v, -v]).status == CORRECT
    assert "pivot: your result is right up to its sign" in exercise.judge(lambda v: (v, v)).text.lower()
    assert "expected 2 results (tip, pivot), got one array of shape (3,)" in exercise.judge(lambda v: v).text
    nan = exercise.judge(lambda v: np.array([v, np.nan * v])).text  # such an array is taken: it is not its shape
    assert nan.startswith("pivot: the result holds NaN")
    assert "pivot: expected an array of shape (3,)" in exercise.judge(lambda v: (v, 1.0)).text


# Values and predictions -----------------------------------------------------------------------------------------------

LENGTH = Value(
    "length",
    reference=lambda: 1234.5,
    unit="mm",
    rtol=1e-4,
    hints=("a", "b", "c"),
    mistakes=[Mistake(lambda: 1000.0, "rounded")],
)


@pytest.mark.parametrize(
    "answer, unit, status, words",
    [
        (1234.5, None, CORRECT, ""),
        (np.array([1234.5]), None, CORRECT, ""),
        (1.2345, "m", CORRECT, ""),
        (1.2345, None, NOT_YET, "mm against m"),
        (1000, None, NOT_YET, "rounded"),
        (-1234.5, None, NOT_YET, "sign"),
        (5, "deg", NOT_YET, "wanted in mm"),
        (..., None, TO_DO, ""),
        (None, None, TO_DO, ""),
        ("long", None, NOT_YET, "expected a number"),
        (np.nan, None, NOT_YET, "NaN"),
        ([1, 2], None, NOT_YET, "expected a number"),
        (77.0, None, NOT_YET, "not this value in mm"),
    ],
)
def test_values_with_units(answer, unit, status, words):
    outcome = LENGTH.judge(answer, unit)
    assert (outcome.status, words in outcome.text) == (status, True), outcome


SMALL = Chapter(
    "98-small",
    [
        DOUBLE,
        LENGTH,
        Prediction("guess", question="Up or down?", choices=("up", "down"), answer="up", why="Because."),
        Prediction("count", question="How many?", answer=10.0, unit="mm", why="Ten."),
    ],
)


def test_names_are_bound_to_the_answer_or_the_reference(capsys):
    ex = session.Course(SMALL)
    assert ex.double(np.asarray) is scale
    assert "stands for the reference" in capsys.readouterr().out

    def mine(v):
        return 2 * v

    assert ex.double(mine) is mine
    assert ex.length(1234.5) == 1234.5
    assert ex.length(...) == 1234.5


def test_a_reference_value_counts_but_does_not_show_itself(capsys):
    hidden = session.Answer.reference(np.arange(12.0).reshape(3, 4))
    for part in (hidden[0], hidden[:, 1], hidden[[0, 2]], hidden[1, 2], hidden.T, hidden.ravel(), *hidden):
        assert str(part) == repr(part) == "(still to be found)"
    assert str(hidden[:2] + 1) == str(np.arange(8.0).reshape(2, 4) + 1) and hidden[1, 2] + 0 == 6.0
    hidden = session.Course(SMALL).length(...)
    assert f"{hidden:.3f} {hidden} {hidden!r}" == "(still to be found) (still to be found) (still to be found)"
    assert hidden + 1 == 1235.5
    assert "1234" not in capsys.readouterr().out


@pytest.mark.parametrize(
    "text, shown",
    [
        ("a loop", "A loop"), ("your result", "Your result"), ("is-it", "Is-it"), ("", ""), ("s0 divides by n", None),
        ("x is NaN", None), ("`x` is", None), ("dt=0", None), ("T_AB is", None), ("3 of 5", None),
    ],
)  # fmt: skip
def test_sentences_begin_with_a_capital_but_symbols_stay(text, shown):
    assert session._sentence(text) == (text if shown is None else shown)


def test_arguments_are_called_as_in_the_students_function():
    def mine(row):
        raise ValueError("no")

    assert "double(row=" in DOUBLE.judge(mine).text
    assert "double(v=" in DOUBLE.judge(lambda *rows: 1 / 0).text


def test_what_raises_in_a_property_is_told_by_the_students_line():
    def holds(student, rng):
        return None if student(np.ones(3))[0] > 0 else "the first entry must be positive"

    stochastic = Exercise(
        "noise", reference=scale, draw=lambda rng: (np.ones(3),), properties=(holds,), hints=tuple("abc")
    )

    def broken(v):
        return v / undefined  # noqa: F821

    def failing(v):
        raise ValueError("no")

    assert (
        "`undefined` is not known" in stochastic.judge(broken).text
        and "return v / undefined" in stochastic.judge(broken).text
    )
    assert 'raise ValueError("no")' in stochastic.judge(failing).text
    picky, cell = replace(stochastic, draws=0), {}
    exec(compile("number = lambda v: len(v)\nalone = lambda: 1\nnothing = lambda v: {}", "<cell>", "exec"), cell)
    picked = picky.judge(cell["number"])
    assert picked.status == NOT_YET and picked.text.startswith("what your function returned could not be worked with: ")
    converted = replace(picky, properties=(lambda student, rng: float(student(np.ones(3))) or None,))
    assert "worked with: TypeError: float() argument" in converted.judge(cell["nothing"]).text
    assert "cannot be called with (v)" in picky.judge(cell["alone"]).text


def test_the_first_import_of_a_library_does_not_count(monkeypatch):
    monkeypatch.delitem(sys.modules, "colorsys", raising=False)

    def importing(v):
        if "colorsys" not in sys.modules:
            import colorsys  # noqa: F401

            time.sleep(1.0)
        return 2 * v

    assert replace(DOUBLE, limit=0.3).judge(importing).status == CORRECT


def test_a_slow_answer_still_meets_every_kind_of_draw(monkeypatch):
    monkeypatch.setattr(time, "perf_counter", itertools.count(0.0, 3.0).__next__)  # every call takes 3 s
    seen = []

    def student(v):
        seen.append(v[0])
        return 2 * v

    special = replace(DOUBLE, noisy=(lambda rng: (np.full(3, 7.0),), metrics.Numbers()))
    assert special.judge(student).status == CORRECT
    assert seen[2:4] == [7.0, 7.0]  # and the last one first when all are called again


def test_a_tall_system_is_told_of_lstsq():
    assert "`lstsq` takes more" in DOUBLE.judge(lambda v: np.linalg.solve(np.ones((3, 2)), v)).text


def test_an_exercise_may_allow_more_time_or_less():
    def slow(v):
        time.sleep(0.3)
        return 2 * v

    patient = replace(DOUBLE, draws=1)
    assert patient.judge(slow).status == CORRECT
    assert "did not finish within 0.1 s" in replace(patient, limit=0.1).judge(slow).text


def test_feedback_never_shows_the_reference_result():
    for answer in (lambda v: v, lambda v: v + 1, lambda v: np.zeros(2), lambda v: 1 / 0):
        given = []

        def spy(v, answer=answer, given=given):
            given.append(v)
            return answer(v)

        text = DOUBLE.judge(spy, rng=np.random.default_rng(5)).text
        assert not any(f"{entry:.3f}" in text for v in given[:6] for entry in np.ravel(2 * v))  # then come explanations


def test_strict_mode_raises_unless_correct(monkeypatch):
    monkeypatch.setenv("LABKIT_STRICT", "1")
    ex = session.Course(SMALL)
    with pytest.raises(session.NotCorrect, match="double: to do"):
        ex.double(lambda v: None)
    with pytest.raises(session.NotCorrect, match="prediction"):
        ex.predict("guess")
    with pytest.raises(session.NotCorrect, match="not the right one"):
        ex.predict("guess", "down")

    def twice(v):
        return v + v

    assert ex.double(twice) is twice
    ex.predict("guess", "up")


def test_the_first_prediction_stays_and_reveals(capsys):
    ex, shown = session.Course(SMALL), []
    ex.predict("guess", "sideways", reveal=lambda: shown.append(1))
    assert "Expected one of: up; down" in capsys.readouterr().out.replace("expected", "Expected")
    assert not shown
    ex.predict("guess", "Down", reveal=lambda: shown.append(1))
    assert "Your prediction: down. What happens: up." in capsys.readouterr().out
    ex.predict("guess", "up", reveal=lambda: shown.append(1))
    assert "Your prediction: down." in capsys.readouterr().out
    assert shown == [1, 1]
    ex.predict("count", 11)
    assert "Your prediction: 11.0 mm. That is what happens." in capsys.readouterr().out


def test_a_click_locks_in_and_reveals():
    import ipywidgets

    class Figure:
        widget, at_rest = ipywidgets.Label("the figure"), []

        def still(self):
            return "<p>its picture</p>"

    box = session._question(SMALL, SMALL["guess"], Figure)
    assert "<li>up</li><li>down</li>" in box.still()
    buttons = box.children[1].children
    assert [b.description for b in buttons] == ["up", "down"]
    assert repr(box) == "[predict first: Up or down? up | down]"
    buttons[0].click()
    assert box.children[1].value == "the figure" and Figure.at_rest == [box.store]
    asked, answered = box.still().split("<p>its picture</p>")
    assert "Your prediction: up" in asked and "That is what happens" not in asked  # one looks first
    assert answered.startswith("<details><summary") and "That is what happens" in answered
    assert ("98-small", "guess") in progress.solved()


def test_unknown_names_are_answered_with_the_known_ones():
    ex = session.course("01-frames")
    with pytest.raises(AttributeError, match="did you mean 'invert'"):
        _ = ex.inverse
    with pytest.raises(AttributeError, match="no prediction"):
        ex.predict("nothing")
    with pytest.raises(ValueError, match="there is no chapter '77-none'; there are .*01-frames"):
        session.course("77-none")


# Hints, solution, progress --------------------------------------------------------------------------------------------


def test_hints_come_one_after_the_other(capsys):
    ex = session.course("01-frames")
    for number in (1, 2, 3, 1):
        ex.invert.hint()
        assert f"hint {number} of 3" in capsys.readouterr().out
    ex.invert.hint(2)
    assert INVERT.hints[1] in capsys.readouterr().out
    with pytest.raises(ValueError, match="hints 1, 2 and 3"):
        ex.invert.hint(4)


def test_hints_advance_where_nothing_can_be_written(capsys, monkeypatch, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("LABKIT_PROGRESS", str(blocked / "progress.jsonl"))
    ex = session.course("01-frames")
    ex.invert.hint()
    ex.invert.hint()
    assert "hint 2 of 3" in capsys.readouterr().out


def test_solution_and_starter_come_from_the_source(capsys):
    ex = session.course("01-frames")
    ex.invert.solution()
    shown = capsys.readouterr().out
    assert ".T" in shown and "SOLUTION" not in shown
    ex.invert.starter()
    shown = capsys.readouterr().out
    assert "def invert" in shown and "your code here" in shown


def test_an_edition_for_exams_has_starters_and_no_solutions(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(session, "SOLUTIONS", tmp_path)
    ex = session.course("01-frames")
    ex.invert.solution()
    assert "no solution is stored in this edition" in capsys.readouterr().out
    ex.invert.starter()
    assert "def invert" in capsys.readouterr().out


def test_a_mistake_keeps_its_id_when_others_come_before_it_or_its_sentence_is_improved():
    def ids(*mistakes):
        hints = ("a", "b", "c")
        return [m.id for m in Value("n", reference=lambda: 1.0, hints=hints, mistakes=mistakes).mistakes]

    first, second = Mistake(lambda: 2.0, "Twice."), Mistake(lambda: 3.0, "Thrice.")
    same, again = ids(first, Mistake(lambda: -2.0, "Twice."))
    assert same == "n-e82e28" and again == "n-e82e28-2"
    assert ids(second, first)[1] == same
    assert ids(Mistake(lambda: 2.0, "That is twice as much.", id=same)) == [same]


def test_progress_records_which_mistake_it_was():
    ex = session.course("01-frames")
    mistake = ex._chapter["distance"].mistakes[2]
    ex.distance(mistake.variant())
    assert [(e["event"], e["mistake"]) for e in progress.of("01-frames", "distance")] == [("not yet", mistake.id)]


def test_progress_is_counted_and_started_over():
    ex = session.course("01-frames")
    ex.invert(loops)
    assert ("01-frames", "invert") in progress.solved()
    assert "1 of" in session.progress_text().split("01-frames")[1].splitlines()[0]
    ex.invert.reset()
    assert ("01-frames", "invert") not in progress.solved()


def test_a_cell_that_would_give_an_answer_away_waits_for_it(monkeypatch, capsys):
    ex = session.course("01-frames")
    assert not ex.after("invert", "distance") and "waits for invert, distance" in capsys.readouterr().out
    progress.record("01-frames", "invert", "correct")
    assert ex.after("invert") and not capsys.readouterr().out
    with pytest.raises(KeyError):
        ex.after("invented")
    monkeypatch.setenv("LABKIT_STRICT", "1")
    assert ex.after("distance")


def test_progress_survives_broken_lines_and_two_writers():
    progress.record("c", "a", "correct")
    with open(progress.path(), "a", encoding="utf-8") as file:
        file.write('{"chapter": "c", "exer')
    writers = [
        threading.Thread(target=lambda k=k: [progress.record("c", f"e{k}_{i}", "correct") for i in range(50)])
        for k in range(4)
    ]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    assert len(progress.solved()) == 201
    lines = progress.path().read_text(encoding="utf-8").splitlines()
    assert sum(1 for line in lines if not line.endswith("}")) == 1
    assert json.loads(lines[-1])["event"] == "correct"


def test_button_row_shows_hint_solution_and_starter():

    bound = session.course("01-frames").invert
    row = feedback.button_row(bound._next_hint, bound._solution, bound._start_over)
    assert repr(row) == "[buttons: hint, solution, start over]"
    hint, solution, again = row.children[0].children
    hint.click()
    assert "hint 1 of 3" in row.children[1].value and hint.description == "Hint (2 left)"
    solution.click()
    assert "a solution" in row.children[1].value
    again.click()
    assert "your code here" in row.children[1].value


def test_panel_is_readable_without_color_and_by_a_screen_reader():

    panel = Panel("invert: not yet", ["Use `R.T`, not <R>."], NOT_YET)
    assert repr(panel) == "✗ invert: not yet\nUse `R.T`, not <R>."
    html = panel.html()
    assert 'role="status"' in html and "<code>R.T</code>" in html and "&lt;R&gt;" in html
    assert "var(--jp-" in html and "<script" not in html and " id=" not in html


def test_malformed_definitions_are_refused():
    with pytest.raises(ValueError, match="three hints, got 2"):
        Exercise("x", reference=abs, draw=lambda rng: (1,), metric=metrics.Numbers(), hints=("a", "b"))
    with pytest.raises(ValueError, match="none of the choices"):
        Prediction("x", question="?", choices=("a",), answer="b")
    with pytest.raises(ValueError, match="'double' is taken"):
        Chapter("98-x", [DOUBLE, DOUBLE])
    with pytest.raises(ValueError, match="metric or properties"):
        Exercise("x", reference=abs, draw=lambda rng: (1,), hints=("a", "b", "c"))


# What a student's walk through the first chapters taught --------------------------------------------------------------


def test_an_array_that_stands_for_the_reference_is_not_shown(capsys):
    saddle = np.array([0.169, -0.246])
    place = Value("place", reference=lambda: saddle, hints=("a", "b", "c"), metric=metrics.Numbers(1e-6))
    bound = session.Course(Chapter("98-place", [place])).place(...)
    assert f"{bound} {bound!r}" == "(still to be found) (still to be found)"
    np.testing.assert_array_equal(bound + 1, saddle + 1)
    assert "0.169" in repr(bound + 1 - 1) and "0.169" not in capsys.readouterr().out
    assert place.judge([0.17, -0.25]).text.startswith("right as far as it goes")
    assert place.judge([0.169, -0.246]).status == CORRECT


@pytest.mark.parametrize(
    "answer, status, words",
    [
        (1235, CORRECT, ""),
        (1230.0, CORRECT, ""),
        (1200.0, NOT_YET, "at least 3 digits"),
        (1100.0, NOT_YET, ": yours is too small"),
    ],
)
def test_rounded_values_need_three_digits(answer, status, words):
    """1234.5: what a notebook prints is enough, whatever the tolerance."""
    outcome = LENGTH.judge(answer)
    assert outcome.status == status and words in outcome.text


def test_a_negative_value_is_called_small_without_its_sign():
    below = replace(LENGTH, reference=lambda: -1234.5, mistakes=())
    assert ": without its sign yours is too small" in below.judge(-1100.0).text


def test_words_count_without_their_case_and_wrong_ones_are_quoted():
    kind = Exercise(
        "kind", reference=lambda x: "minimum", draw=lambda rng: (1.0,), metric=metrics.Exactly(), hints=("a", "b", "c")
    )
    assert kind.judge(lambda x: " Minimum").status == CORRECT
    said = kind.judge(lambda x: "low").text
    assert said.startswith("`'low'` is not the answer here.") and "minimum" not in said


def of_a_name_bound_later(v):
    def taken():
        return later

    half = taken()
    later = v
    return half


def test_a_name_from_a_cell_not_yet_run_is_explained():
    assert "is not known" not in DOUBLE.judge(of_a_name_bound_later).text
    outcome = DOUBLE.judge(lambda v: normalize(v))  # noqa: F821
    assert outcome.status == RAISED
    assert (
        "`normalize` is not known: it is defined neither where it is read nor in a cell that has been run"
        in outcome.text
    )


def test_questions_end_without_a_second_mark():
    assert DOUBLE.judge(lambda v: [None] and np.array(v, copy=True).fill(0)).text.endswith("missing?")


def test_the_pole_is_checked_apart():
    def one_by_one(T):
        b = np.arctan2(-T[2, 0], np.hypot(T[0, 0], T[1, 0]))
        return np.array([*T[:3, 3], np.arctan2(T[1, 0], T[0, 0]), b, np.arctan2(T[2, 1], T[2, 2])])

    def zero_at_the_pole(T):
        return np.zeros(6) if abs(T[2, 0]) > 1 - 1e-9 else one_by_one(T)  # draws end 0.1 deg before

    exercise = CHAPTER["kuka_from_matrix"]
    assert "rounding noise" in exercise.judge(one_by_one).text
    told = "right on ordinary draws away from the pole, but not at B = 90 deg:"
    assert exercise.judge(zero_at_the_pole).text.startswith(told)


KEPT, BUFFER = [], np.zeros(3)


def keeps_a_sum(v):
    KEPT.append(v)
    return 2 * sum(KEPT)


def fills_one_array(v):
    BUFFER[:] = BUFFER + v
    return BUFFER


def keeps_a_set(v, found={0.5}):  # noqa: B006, the slip in question
    found.add(round(v[0], 6))
    return found


def test_what_stays_in_a_set_between_calls_is_told():
    exercise = replace(DOUBLE, reference=lambda v: {round(v[0], 6)}, metric=metrics.Exactly())
    assert "called twice with the same arg" in exercise.judge(keeps_a_set, rng=np.random.default_rng(0)).text


def test_what_is_never_filled_is_asked_for_where_an_empty_array_is_made():
    calls = itertools.count()

    def left_empty(v):
        result = np.empty(3)
        result[:] = next(calls)
        return result

    assert "Is each entry of what `np.empty` makes filled?" in DOUBLE.judge(left_empty).text


@pytest.mark.parametrize("text, told", [("6,25", True), ("-,5", True), ("sign lost, perhaps", False)])
def test_a_decimal_comma_is_told_of_numbers_alone(text, told):
    said = DOUBLE.judge(lambda v: float(text), rng=np.random.default_rng(0)).text
    assert ("replace a decimal comma" in said) == told


def test_results_that_are_tiny_and_differ_are_not_one_and_the_same():
    exercise = replace(DOUBLE, reference=lambda v: v[0], metric=metrics.Numbers(1e-9))
    assert "same on every draw" not in exercise.judge(lambda v: 1e-16 * v[1], rng=np.random.default_rng(0)).text


def test_a_tolerance_may_shrink_with_what_is_expected():
    assert metrics.Numbers(1e-6).equal(3e-9, 1e-9)
    assert not metrics.Numbers(1e-6, least=0.0).equal(np.array(3e-9), 1e-9)
    assert metrics.Numbers(1e-6, least=0.0).equal(np.array(1e-9 + 1e-16), 1e-9)


@pytest.mark.parametrize(
    "function, words",
    [
        (keeps_a_sum, "into `KEPT` is still there in the next"),
        (fills_one_array, "one and the same array at every call"),
    ],
)
def test_what_stays_between_calls_is_told(function, words, monkeypatch):
    monkeypatch.setitem(globals(), "KEPT", [])
    assert words in DOUBLE.judge(function, rng=np.random.default_rng(0)).text


def counts_its_calls(step, n):
    KEPT.append(step)
    return step, len(KEPT) % n == 0


def test_what_counts_its_calls_is_told_so_and_not_taken_for_a_mistake(monkeypatch):
    monkeypatch.setitem(globals(), "KEPT", [])
    cycle = Exercise(
        "cycle",
        reference=lambda step, n: (step, step % n == 0),
        draw=lambda rng: (int(rng.integers(2, 5)) * 7, 7),
        metric=metrics.Several(metrics.Numbers(), metrics.Exactly(), names=("step", "due")),
        hints=("a", "b", "c"),
        mistakes=[Mistake(lambda step, n: (step, False), "never")],
    )
    told = cycle.judge(counts_its_calls, rng=np.random.default_rng(0)).text
    assert "called twice with the same arguments" in told and "`KEPT`" in told
    assert cycle.judge(lambda step, n: (step, False), rng=np.random.default_rng(0)).text == "never"


def test_what_raises_on_data_of_the_notebook_is_told_of_them():
    assert "reads `KEPT` from the notebook" in DOUBLE.judge(lambda v: [0.0][len(KEPT) + 1] * v).text


def test_a_part_of_several_results_that_the_next_call_overwrites_is_told():
    def two(v):
        BUFFER[:] = v
        return float(v.sum()), BUFFER[:2]

    exercise = replace(
        DOUBLE,
        reference=lambda v: (float(v.sum()), v[:2]),
        metric=metrics.Several(metrics.Numbers(), metrics.Numbers(), names=("sum", "ends")),
        mistakes=[],
    )
    assert "one and the same array" in exercise.judge(two, rng=np.random.default_rng(0)).text


KNOWN, FACTORS = {}, [2.0, 3.0]


def remembers_by_the_first(a, b):
    if a not in KNOWN:
        KNOWN[a] = a + b
    return KNOWN[a]


def remembers_by_the_number(a, b):
    return KNOWN.setdefault(("number", a), a + (b[0] if b[0] > 0.5 else 0.0))


def remembers_by_both(a, b, known={}):  # noqa: B006, what it keeps is kept by all that it depends on
    return known.setdefault((a, b), a + b)


def test_a_result_that_is_kept_by_a_part_of_the_arguments_is_told():
    exercise = replace(
        DOUBLE,
        reference=lambda a, b: a + b,
        draw=lambda rng: (float(rng.normal()), float(rng.normal())),
        mistakes=[],
    )
    outcome = exercise.judge(remembers_by_the_first, rng=np.random.default_rng(0))
    assert outcome.status == NOT_YET and "with another `b` and all else as before" in outcome.text
    for right in (remembers_by_both, lambda a, b: (FACTORS[0] * a + FACTORS[0] * b) / 2):
        assert exercise.judge(right, rng=np.random.default_rng(0)).status == CORRECT


@pytest.mark.parametrize("first", [0, 3])
def test_a_result_that_is_kept_by_a_part_of_an_argument_is_told(first):
    def remembers(v, known={}):  # noqa: B006, what it keeps is the slip
        return known.setdefault(float(v[first]), 2 * v)

    exercise = replace(DOUBLE, draw=lambda rng: (rng.normal(size=8),), mistakes=[])
    outcome = exercise.judge(remembers, rng=np.random.default_rng(0))
    assert outcome.status == NOT_YET and "under a key that leaves a part of the arguments out" in outcome.text


def test_a_result_that_is_kept_by_all_but_an_argument_that_is_no_number_and_seldom_counts_is_told():
    """As rays do by all but the grid: most end at their reach in every grid."""
    exercise = replace(
        DOUBLE,
        reference=lambda a, b: a + (b[0] if b[0] > 0.5 else 0.0),
        draw=lambda rng: (float(rng.normal()), [float(rng.normal())]),
        mistakes=[],
    )
    outcome = exercise.judge(remembers_by_the_number, rng=np.random.default_rng(0))
    assert outcome.status == NOT_YET and "with another `b` and all else as before" in outcome.text


def test_an_argument_that_follows_from_another_need_not_be_read():
    """Exchanged for another draw's, it no longer follows; who reads the other one is right all the same."""
    exercise = replace(
        DOUBLE,
        reference=lambda a, twice: twice / 2,
        draw=lambda rng: (lambda a: (a, 2 * a))(rng.normal(size=3)),
        mistakes=[],
    )
    assert exercise.judge(lambda a, twice: a * FACTORS[0] / 2, rng=np.random.default_rng(0)).status == CORRECT


def test_a_row_that_is_returned_as_it_came_is_told():
    exercise = replace(
        DOUBLE, reference=lambda v: v.mean(axis=0), draw=lambda rng: (rng.normal(size=(4, 3)),), mistakes=[]
    )
    outcome = exercise.judge(lambda v: v[np.argmax(v.sum(axis=1))], rng=np.random.default_rng(0))
    assert "your result is one of the rows of `v` as it came" in outcome.text


def patient(times):
    """An answer that gives in after so many small numbers in a row."""
    small = []

    def large(v):
        small[:] = [] if v[0] > 0 else [*small, v]
        return bool(v[0] > 0) or len(small) > times

    return large


@pytest.mark.parametrize("times, status", [(5, NOT_YET), (1000, CORRECT)])
def test_what_many_calls_in_a_row_bring_about_is_told(times, status):
    signs = tuple(lambda rng, sign=sign: (sign * rng.uniform(1, 2, 3),) for sign in (1, -1))
    item = replace(DOUBLE, reference=lambda v: bool(v[0] > 0), draw=signs, metric=metrics.Exactly(), draws=12)
    outcome = item.judge(patient(times), rng=np.random.default_rng(0))
    assert outcome.status == status
    assert "called twice with the same arguments, your function gives another" in outcome.text or status == CORRECT


def test_what_is_wrong_at_a_later_call_only_is_told_of_several():
    calls = []

    def tired(v):
        calls.append(1)
        return 2 * v if len(calls) < 12 else 3 * v

    said = DOUBLE.judge(tired, rng=np.random.default_rng(0)).text
    assert said.startswith("called several times with the same arguments, your function gives another result in the")


def test_an_answer_that_is_slow_is_called_once_more_at_most():
    calls, of_whole_numbers = [], replace(DOUBLE, draw=lambda rng: (rng.integers(1, 99, 3),))

    def slow(v):
        calls.append(1)
        until = time.thread_time() + staying.REPEATING
        while time.thread_time() < until:
            pass
        return 2 * v

    assert of_whole_numbers.judge(slow, rng=np.random.default_rng(0)).status == CORRECT
    assert len(calls) == DOUBLE.draws + 1


def test_an_array_that_nobody_writes_into_is_not_overwritten():
    assert "overwrites" not in DOUBLE.judge(lambda v: BUFFER, rng=np.random.default_rng(0)).text


def test_what_follows_from_a_value_is_told_where_nothing_else_is():
    def about(answer):
        return f"Its square is {answer**2:g}" if answer > 0 else f"Its root is {1 / 0}"

    root = Value("root", reference=lambda: np.sqrt(7.3), hints=("a", "b", "c"), about=about)
    assert root.judge(2.1).text == "Its square is 4.41."
    assert root.judge(-2.1).text == "not this value, and it should have the other sign: the hints lead on."
    assert root.judge(np.nan).status == NOT_YET


def test_how_near_a_wrong_array_is_stands_where_no_entry_is_right():
    item = Value(
        "nearly", reference=lambda: np.array([2.0, 5.0, 3.0]), metric=metrics.Numbers(1e-6), hints=("a", "b", "c")
    )
    told = item.judge(np.array([2.03, 4.93, 3.11])).text
    assert told.startswith("not this value, though no entry is off by more than 3 % of the largest (perhaps")
    assert item.judge(np.array([9.0, 1.0, 7.0])).text == "not this value: the hints lead on."


def test_constants_of_any_shape_are_no_arguments_that_are_read():
    def nested(v):
        return sum(w * c[0] for w, c in ((100, (1, 1)), (200, (-1, -2)))) * np.ones(3)

    assert "your function never uses `v`" in DOUBLE.judge(nested, rng=np.random.default_rng(0)).text


@pytest.mark.parametrize("times, told", [(0, False), (3, True)])
def test_a_result_that_never_changes_is_no_slip_of_a_formula(times, told, monkeypatch):
    """Whatever makes 0 of a formula would explain a 0."""
    trial, rng = Trial(DOUBLE, lambda v: times * v), np.random.default_rng(0)
    for _ in range(3):
        trial.draw(DOUBLE.draw(rng), DOUBLE.metric)
    # after the draws: what student code has run beside, the guard puts back
    monkeypatch.setattr(slips, "changed_formulas", lambda exercise: [("with a slip", lambda v: times * v)])
    assert bool(trial._one_change()) == told


def test_a_list_of_texts_or_numbers_that_is_changed_is_told():
    def changes(texts):
        texts[0] = texts[0].replace(",", ".")
        return float(texts[0])

    item = Exercise(
        "first",
        reference=lambda texts: float(texts[0].replace(",", ".")),
        draw=lambda rng: ([f"{rng.integers(9)},5", "2"],),
        metric=metrics.Numbers(1e-9),
        hints=("a", "b", "c"),
    )
    assert "changes its argument `texts` in place" in item.judge(changes).text
    assert not guard.is_same([1.0, 2], [1.0, 3]) and guard.is_same([np.nan, "a"], [np.nan, "a"])


def test_a_set_is_asked_for_as_a_set():
    with pytest.raises(metrics.Refused, match=r"got a list: set\(...\) makes one of it"):
        metrics.Exactly().admit([1, 2], {1, 2})
    assert metrics.Exactly().admit(frozenset([np.int64(1)]), {1}) == {1}


def test_what_an_exercise_says_of_a_special_draw_leads_where_it_is_refused_or_raises():
    words = "right for long vectors, but not for one entry:"
    item = replace(DOUBLE, noisy=(lambda rng: (rng.normal(size=1),), metrics.Numbers(1e-9), words))
    said = "Right on ordinary draws for long vectors, but not for one entry"
    assert item.judge(lambda v: np.squeeze(2 * v)).text.startswith(f"{said}: exp")
    assert f"{said}." in item.judge(lambda v: 2 * v + 0 * v[1]).text


def test_right_but_for_one_kind_is_said_of_ordinary_cases_where_another_kind_is_wrong_or_not_tried():
    kinds = [(np.ones(n), metrics.Numbers(1e-9), f"right, but not for {n} entries:") for n in (6, 7)]
    item = replace(DOUBLE, noisy=[(lambda rng, v=v: (v,), metric, words) for v, metric, words in kinds])
    one, both = (item.judge(lambda v, n=n: (2 if len(v) <= n else 3) * v).text for n in (6, 5))
    assert one.startswith("right, but not for 7 entries: ")
    assert both.startswith("right on ordinary draws, but not for 6 entries: ")
    assert item.judge(lambda v: 2 * v[:5]).text.startswith("Right on ordinary draws, but not for 6 entries: exp")
    assert "Right on ordinary draws, but not for 6 entries." in item.judge(lambda v: 2 * v + (len(v) > 5 and v[9])).text


@pytest.mark.parametrize(
    "words, told",
    [
        ("Right as long as all differ. Where", "Right on ordinary draws as long as all differ. Where"),
        ("right in curves, but not", "right on ordinary draws in curves, but not"),
        ("right on ordinary draws, but not", "right on ordinary draws, but not"),
        ("exact on the clean data tried, but not", "exact on the clean data tried, but not"),
    ],
)
def test_what_is_right_somewhere_is_said_to_be_so_on_ordinary_draws(words, told):
    assert wording.on_ordinary_draws(words) == told


def test_a_special_draw_that_is_refused_is_not_told_while_plain_ones_are_wrong():
    item = replace(DOUBLE, noisy=(lambda rng: (np.ones(1),), metrics.Numbers(1e-9), "right, but not for one entry:"))
    assert item.judge(lambda v: 3 * v / (len(v) > 1)).text.startswith("your result is 1.5 times the expected one")


def test_a_message_keeps_its_blanks_and_loses_its_lines():
    """A line that came with two blanks looked right where one was shown."""
    assert (
        guard.message_of(ValueError("got '1.5   2.5'\n   of three  \n\nnumbers")) == "got '1.5   2.5' of three numbers"
    )


def test_a_mistake_at_a_special_place_is_named_if_it_shows_at_others_of_that_kind_too():
    below = (lambda rng: (-float(rng.integers(1, 3)),), metrics.Numbers(1e-9), "right, but not below 0:")
    exercise = Exercise(
        "same",
        reference=lambda x: x,
        draw=lambda rng: (rng.uniform(1, 2),),
        metric=metrics.Numbers(1e-9),
        hints=("a", "b", "c"),
        noisy=(below, below, below, below),
        mistakes=(Mistake(abs, "No absolute value."),),
    )
    checks = [np.random.default_rng(seed) for seed in range(40)]
    assert {exercise.judge(lambda x: abs(x), rng).text for rng in copy.deepcopy(checks)} == {"No absolute value."}
    assert not any("No absolute" in exercise.judge(lambda x: x if x > 0 else 1.0, rng).text for rng in checks)


def test_a_mistake_is_named_if_it_shows_on_draws_that_this_check_had_not():
    def draw(rng):
        return (rng.uniform(1, 2, int(rng.integers(3, 8))),)

    exercise = Exercise(
        "total",
        reference=np.sum,
        draw=draw,
        metric=metrics.Numbers(1e-9),
        hints=("a", "b", "c"),
        mistakes=(Mistake(lambda x: x[:3].sum(), "You added the first three."),),
        draws=1,
    )

    def by_threes(x):
        return sum(x[k : k + 3].sum() for k in range(0, len(x) - 2, 3))

    checks = [np.random.default_rng(seed) for seed in range(8)]
    assert {exercise.judge(lambda x: sum(x[:3]), rng).text for rng in copy.deepcopy(checks)} >= {
        "You added the first three."
    }
    assert not any("first three" in exercise.judge(by_threes, rng).text for rng in checks)


@pytest.mark.parametrize("kind, nearly", [(float, True), (str, False)])
def test_an_argument_is_called_nearly_the_same_where_it_is(kind, nearly):
    def remembers(v, known={}):  # noqa: B006, what it keeps is the slip
        return known.setdefault(round(float(v), 3) if nearly else len(v), 2 * float(v))

    exercise = replace(
        DOUBLE, reference=lambda v: 2 * float(v), draw=lambda rng: (kind(round(rng.normal(), 9)),), mistakes=[]
    )
    text = exercise.judge(remembers, rng=np.random.default_rng(0)).text
    assert text and ("nearly the same" in text) == nearly
