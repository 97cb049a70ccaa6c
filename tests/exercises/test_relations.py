"""What the general layer finds in a wrong result, and that it finds nothing in an unrelated one."""

import numpy as np
import pytest

from labkit.exercises import metrics, relations
from labkit.exercises.outcome import CORRECT, NOT_YET, Mistake
from labkit.exercises.value import Value
from labkit.geometry.frames import matrix_from_kuka
from labkit.geometry.lie import exp_so3, log_so3

RNG = np.random.default_rng(4)
VECTORS = [RNG.normal(size=4) + 3 for _ in range(4)]
UNITS = [v / np.linalg.norm(v) for v in VECTORS]
TABLES = [RNG.normal(size=(5, 3)) for _ in range(4)]
SQUARES = [RNG.normal(size=(3, 3)) for _ in range(4)]
OF_SYMMETRIC_BLOCKS = [np.vstack([S + S.T for S in RNG.normal(size=(2, 2, 2))]) for _ in range(4)]
TURNS = [exp_so3(RNG.normal(size=3)) for _ in range(4)]


def words(change, expected, metric=None):
    return relations.difference_words(metric or metrics.Numbers(1e-9, "mm"), [(change(e), e) for e in expected])


def changed(index, value):
    def change(e):
        e = e.copy()
        e[index] = value(e[index]) if callable(value) else value
        return e

    return change


@pytest.mark.parametrize(
    "change, expected, told",
    [
        (np.negative, VECTORS, "up to its sign"),
        (np.rad2deg, VECTORS, "180/pi times the expected one: is an angle in it in the wrong unit"),
        (lambda e: e / np.pi, VECTORS, "pi times your result is the expected one"),
        (lambda e: np.sqrt(3) * e, TABLES, "the root of 3 times the expected one"),
        (lambda e: e / 7, TABLES, "1/7 of the expected one"),
        (np.abs, TABLES, "right but for its sign, which is lost"),
        (changed((slice(None), 2), np.abs), TABLES, "entry 2 (counted from 0) has lost its sign in each row"),
        (changed(1, np.negative), VECTORS, "entry 1 (counted from 0) has the opposite sign"),
        (changed((slice(None), 2), np.negative), TABLES, "entry 2 (counted from 0) has the opposite sign in each row"),
        (lambda e: e[[2, 1, 0, 3]], VECTORS, "the entries 0 and 2 (counted from 0) are exchanged"),
        (lambda e: e[:, [1, 0, 2]], TABLES, "the entries 0 and 1 (counted from 0) are exchanged in each row"),
        (lambda e: np.roll(e, 1, axis=0), TABLES, "one place too late, the last one first"),
        (lambda e: np.roll(e, -1), VECTORS, "one place too early, the first one last"),
        (lambda e: np.roll(e, 1), UNITS, "the scalar part comes first in your quaternion"),
        (lambda e: e[[0, 2, 1, 3]], OF_SYMMETRIC_BLOCKS, "the rows are right, in another order"),
        (lambda e: e.T.reshape(e.shape), TABLES, "in the order of columns written as rows"),
        (changed(3, lambda v: v + 5.0), VECTORS, "only entry 3 (counted from 0) is not right: it is off by 5 mm"),
        (changed(slice(3, None), 0.0), TABLES, "the first 3 rows are right"),
        (changed(slice(1, None), 0.0), TABLES, "the first row is right, not all behind it are"),
        (lambda e: e + 2.5, TABLES, "too large by 2.5 mm, on every draw"),
        (np.linalg.inv, SQUARES, "the inverse of the expected one"),
        (np.square, VECTORS, "the square of the expected one"),
        (np.reciprocal, VECTORS, "the reciprocal of the expected one"),
        (lambda e: e / np.linalg.norm(e), VECTORS, "times a number that is not the same on every draw"),
        (np.trunc, [9 * e for e in TABLES], "the right one without its decimals"),
    ],
)
def test_relations_of_numbers(change, expected, told):
    assert told in words(change, expected)


def test_a_part_that_is_off_by_so_little_is_not_called_wrong():
    coarse = metrics.Numbers(1e-5)
    near, far = ([(e + [0, 0, off, 0], e) for e in VECTORS] for off in (1e-3, 1.0))
    assert relations.difference_words(coarse, near) is None
    assert "only entry 2" in relations.difference_words(coarse, far)


@pytest.mark.parametrize("expected", [VECTORS, TABLES, SQUARES])
def test_unrelated_numbers_have_no_relation(expected):
    rng = np.random.default_rng(1)
    assert words(lambda e: rng.normal(size=e.shape), expected) is None


def _askew(R):
    y = R[:, 1] + 0.5 * R[:, 0]
    return np.column_stack([R[:, 0], y / np.linalg.norm(y), R[:, 2]])


@pytest.mark.parametrize(
    "change, told",
    [
        (lambda R: R[:, [1, 0, 2]] * (1, 1, -1), "x should be your y, y should be your x, z should be your -z"),
        (lambda R: np.swapaxes(R, -1, -2), "transpose"),
        (lambda R: 1.1 * R, "not orthonormal"),
        (lambda R: R * (1, 1, -1), "reflection"),
        (np.negative, "does an axis point the wrong way, have two changed places?"),
        (lambda R: R * (1, 1, 2), "not orthonormal: the length of its column z is not 1"),
        (lambda R: 2 * R, "the length of its columns x, y and z is not 1"),
        (_askew, "not orthonormal: its columns x and y are not perpendicular"),
    ],
)
def test_relations_of_rotations(change, told):
    assert told in words(change, TURNS, metrics.Rotations())


@pytest.mark.parametrize("more, told", [(0.0, True), (np.pi, False)])
def test_a_turn_of_which_two_make_the_right_one_may_be_the_other_half(more, told):
    said = words(lambda R: exp_so3((0.5 + more / np.linalg.norm(log_so3(R))) * log_so3(R)), TURNS, metrics.Rotations())
    assert (said == "you turn by half the angle") is told


@pytest.mark.parametrize("metric, poses", [(metrics.Rotations(), False), (metrics.Poses(), True)])
def test_axes_that_point_the_other_way_are_named(metric, poses):
    right = [matrix_from_kuka([*RNG.normal(size=3) * 100, *RNG.normal(size=3)]) for _ in range(3)]
    right = right if poses else [T[:3, :3] for T in right]
    signs = (1, -1, -1, 1)[: len(right[0])]
    assert relations.turned_axes(metric, [(T * signs, T) for T in right]) == "your y and z point the other way"
    assert relations.turned_axes(metric, [(T * signs, T) for T in right[:2]] + [(right[2], right[2])]) is None
    assert relations.turned_axes(metrics.Numbers(), [(-right[0], right[0])]) is None


def test_what_is_a_reflection_on_some_draws_is_said_of_these():
    pairs = [(R * (1, 1, 1 if k else -1), R) for k, R in enumerate(TURNS)]
    assert "is a reflection on some draws, its determinant" in relations.difference_words(metrics.Rotations(), pairs)
    (off,) = metrics.Rotations().deviations(*pairs[0])
    assert str(off).endswith("it is a reflection, its determinant is -1")


def test_a_pose_that_is_wrong_in_one_part_says_by_how_much():
    poses = [matrix_from_kuka([*RNG.normal(size=3) * 100, *RNG.normal(size=3)]) for _ in range(3)]
    assert "off by 7 mm" in words(changed((0, 3), lambda x: x + 7.0), poses, metrics.Poses())
    assert words(lambda T: np.round(T, 4), poses, metrics.Poses()).startswith("your result is the right one, rounded")


def test_a_rotation_near_something_that_is_none_is_not_taken_for_it():
    """The polar factor of a sheared matrix turns by nothing against it, and is not equal to it."""
    sheared = TURNS[0] @ (np.eye(3) + 0.2 * np.ones((3, 3)))
    u, _, vt = np.linalg.svd(sheared)
    assert not metrics.Rotations(1e-6).equal(u @ vt, sheared)


@pytest.mark.parametrize(
    "answer, expected, digits",
    [
        (1.41, 1.41421356, 3),
        (1.4142, 1.41421356, 5),
        (2.0, 1.996, 3),
        (1.42, 1.41421356, 0),
        (0.17, 0.169, 2),
        (0, 0, 0),
    ],
)
def test_significant_digits(answer, expected, digits):
    assert relations.significant_digits(answer, expected) == digits


AREA = Value(
    "area",
    reference=lambda: 0.2758,
    unit="mm",
    rtol=0.02,
    hints=("a", "b", "c"),
    mistakes=[
        Mistake(lambda: 0.0625, "one alone"),
        Mistake(lambda: 0.2741, "near the truth"),
        Mistake(lambda: 0.51234, "half"),
        Mistake(lambda: 0.51196, "a bit less"),
    ],
)


@pytest.mark.parametrize(
    "answer, status, told",
    [
        (0.276, CORRECT, ""),
        (0.0625, NOT_YET, "one alone"),
        (0.0602, NOT_YET, "too small"),  # near a mistake is not that mistake
        (0.2741, NOT_YET, "near the truth"),  # exactly a mistake is one, also within the tolerance
        (0.5123, NOT_YET, "half"),
        (0.512, NOT_YET, "too large"),  # what is rounded to digits that two mistakes share is neither
        (0.9, NOT_YET, "too large"),
        (-0.9, NOT_YET, "the other sign"),
        (-0.2758, NOT_YET, "up to its sign"),
    ],
)
def test_values_are_compared_with_mistakes_by_their_own_digits(answer, status, told):
    outcome = AREA.judge(answer)
    assert outcome.status == status and told in outcome.text


def test_an_answer_that_has_not_converged_is_told_so():
    deviation = metrics.Numbers(1e-9, "m").deviations(np.array(1.0 + 1e-7), 1.0)[0]
    assert "not accurate enough" in relations.not_accurate_enough(deviation)
    assert relations.not_accurate_enough(metrics.Numbers(1e-9).deviations(np.array(1.1), 1.0)[0]) is None


def test_a_coarse_tolerance_makes_no_wrong_answer_right_in_kind():
    deviation = metrics.Numbers(1e-3).deviations(np.array([0.5, 0.93]), np.array([0.5, 1.0]))[0]
    assert relations.not_accurate_enough(deviation) is None
    near = metrics.Numbers(1e-6).deviations(np.array([0.5, 0.9995]), np.array([0.5, 1.0]))[0]
    assert "not accurate enough" in relations.not_accurate_enough(near)


def test_a_single_wrong_entry_of_a_matrix_is_named_by_row_and_column():
    expected = [np.array([[1.5, 2.5], [3.5, k]]) for k in (4.5, 5.5)]
    results = [e.copy() for e in expected]
    for k, result in enumerate(results):
        result[1, 1] = 7.7 * (k + 1) ** 2
    words = relations.difference_words(metrics.Numbers(1e-9), list(zip(results, expected)))
    assert words.startswith("only entry [1, 1] (counted from 0) is not right")


def test_rows_that_hold_what_belongs_into_others_are_told():
    def behind(e):
        return np.vstack([e[2:4], e[2:]])

    told = words(behind, TABLES)
    assert told == (
        "row 0 holds what belongs into row 2, row 1 what belongs into row 3 (counted from 0); all others are right"
    )
    assert words(changed(1, lambda v: 0 * v), TABLES) != told
    first = words(lambda e: np.array([e[0], e[0], *e[2:]]), VECTORS)
    assert first == "entry 1 holds what belongs into entry 0 (counted from 0); all others are right"
    poses = [matrix_from_kuka(RNG.normal(size=6)) for _ in range(3)]  # whose last row is always the same
    assert words(changed(0, np.array([0.0, 0.0, 0.0, 1.0])), poses) is None


def test_what_differences_make_is_nearly_a_multiple():
    told = words(lambda e: 4 * e + 1e-5 * np.cos(e), SQUARES)
    assert told == "your result is nearly 4 times the expected one, within a thousandth of its size, on every draw"
    assert "nearly 1/3 times" in words(lambda e: e / 3 + 1e-6 * np.cos(e), TABLES)
    assert words(lambda e: e + 1e-4 * np.cos(e), TABLES) is None
    assert words(lambda e: 4.3 * e + 1e-5 * np.cos(e), TABLES) is None


@pytest.mark.parametrize("ratio", [1 + 1e-15, 1 + 3e-13])
def test_what_differs_in_its_last_digits_is_no_multiple(ratio):
    assert words(lambda e: ratio * e, VECTORS, metrics.Numbers(0.0)) is None


def test_a_ratio_near_1_is_told_with_its_digits():
    assert words(lambda e: 1.0002 * e, VECTORS) == "your result is 1.0002 times the expected one, on every draw"


def test_a_factor_that_is_a_sign_is_told_as_one():
    expected = [np.array([1.0, 2.0, -4.0]), np.array([3.0, 1.0, 2.0]), np.array([0.5, 2.5, 1.5])]
    results = [sign * e for sign, e in zip((1, -1, 1), expected)]
    assert "its sign is turned on some draws" in relations.difference_words(
        metrics.Numbers(1e-9), list(zip(results, expected))
    )
