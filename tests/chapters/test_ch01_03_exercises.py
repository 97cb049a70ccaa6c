"""Answers to chapters 2 and 3 that were once judged wrongly or told too little, and the last hints of their values."""

import functools
import re

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize
from numpy.linalg import lstsq
from scipy.spatial.transform import Rotation

from labkit.calibration import pivot
from labkit.chapters.ch01_frames import exercises as ch01_exercises
from labkit.chapters.ch02_chaining import beyond, exercises
from labkit.chapters.ch03_quirlen import exercises as ch03_exercises
from labkit.documents.lab_sheet import printed as lab_sheet
from labkit.exercises import budget, source
from labkit.exercises.engine import Exercise
from labkit.exercises.outcome import CORRECT, NOT_YET
from labkit.exercises.value import Value
from labkit.files.text import number_in
from labkit.geometry import chaining, frames
from labkit.geometry.frames import relative
from labkit.geometry.lie import exp_se3, exp_so3, log_se3
from tests.chapters.draws_of_a_check import SEEDS

CHAPTERS = (exercises.CHAPTER, ch03_exercises.CHAPTER)
ITEMS = {item.id: item for chapter in CHAPTERS for item in chapter.items}
EXERCISES = [name for name, item in ITEMS.items() if isinstance(item, Exercise)]
VALUES = [name for name, item in ITEMS.items() if isinstance(item, Value)]
KNOWN = {  # what the notebooks have imported
    "np": np, "chaining": chaining, "pivot": pivot, "relative": relative, "exp_se3": exp_se3, "log_se3": log_se3,
}  # fmt: skip


def judged(name, answer, seed=0):
    return ITEMS[name].judge(answer, rng=np.random.default_rng(seed))


def parameters(name):
    """The argument names of an exercise as its notebook has them."""
    for chapter in CHAPTERS:
        found = re.search(rf"def {name}\((.*)\):", source.find(chapter.notebook[:2]).read_text(encoding="utf-8"))
        if found:
            return found[1].split(", ")
    raise AssertionError(name)


def typed(name):
    """The last hint as a student types it: the code between its backticks."""
    hint = ITEMS[name].hints[-1]
    assert hint[0] == hint[-1] == "`" and hint.count("`") == 2, hint
    return hint.strip("`")


@pytest.mark.parametrize("name", VALUES)
def test_the_last_hint_is_the_value(name):
    """With the names that the notebook has by then."""
    poses, product = lab_sheet.kreisel_poses(), chaining.chain(lab_sheet.printed_transforms())
    x = pivot.solve_pivot(pivot.pivot_matrix(poses), pivot.pivot_rhs(poses))
    residuals = pivot.pivot_residuals(poses, x[:3], x[3:])
    space = {**KNOWN, "poses": poses, "product": product, "x": x, "residuals": residuals}
    exec(typed(name), {**space, "closure_error": chaining.closure_error}, space)
    assert judged(name, space[name]).status == CORRECT


@pytest.mark.parametrize("name", EXERCISES)
def test_a_raised_call_is_shown_with_the_names_of_the_notebook(name):
    names = parameters(name)
    assert ITEMS[name].arguments[: len(names)] == names


@pytest.mark.parametrize("digits", [3, 4, 6])
@pytest.mark.parametrize("name", VALUES)
def test_values_may_be_rounded_to_three_digits(name, digits):
    rounded = float(f"{ITEMS[name].reference():.{digits}g}")
    assert judged(name, rounded).status == CORRECT


@pytest.mark.parametrize("solver", [lambda A, b: lstsq(A, b, rcond=None), scipy.linalg.lstsq])
def test_all_that_lstsq_returns_is_answered_by_its_first(solver):
    outcome = judged("solve_pivot", lambda A, b: solver(A, b))
    assert outcome.status == NOT_YET and "[0]" in outcome.text


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("ones", [np.ones, np.eye])
def test_entry_by_entry_is_no_reflection(ones, seed):
    def chain(transforms):
        T = ones(4)
        for link in transforms:
            T = T * link
        return T

    assert "entry by entry" in judged("chain", chain, seed).text


def test_what_stands_for_an_unsolved_chain_takes_no_links_as_a_loop_does():
    """Who writes distribute_closure with P_0 = chain(transforms[:0]) has I there, whoever wrote the chain."""
    assert np.array_equal(ITEMS["chain"].reference([]), np.eye(4))
    assert "the library's own function" in judged("chain", chaining.chain).text


@pytest.mark.parametrize("first", [0, 1])
def test_corrected_poses_are_not_links(first):
    def distribute(transforms):
        poses = chaining.stations(transforms)
        back = [exp_se3(-k / len(transforms) * log_se3(poses[-1])) for k in range(len(poses))]
        return (np.array(back) @ poses)[first:]

    assert "corrected poses" in judged("distribute_closure", distribute).text


def test_blocks_of_the_pivot_matrix_that_overlap():
    def matrix(T_WF):
        A = np.zeros((3 * len(T_WF), 6))
        for i, T in enumerate(T_WF):
            A[i : i + 3, :3], A[i : i + 3, 3:] = T[:3, :3], -np.eye(3)
        return A

    assert "3 * i" in judged("pivot_matrix", matrix).text


@pytest.mark.parametrize("seed", SEEDS)
def test_residuals_are_those_of_the_tip_that_was_given(seed):
    def fitted_anew(T_WF, tip, point):
        x = pivot.solve_pivot(pivot.pivot_matrix(T_WF), pivot.pivot_rhs(T_WF))
        return pivot.pivot_residuals(T_WF, x[:3], x[3:])

    def without_mean(T_WF, tip, point):
        r = pivot.pivot_residuals(T_WF, tip, point)
        return r - r.mean(0)

    for wrong in (fitted_anew, without_mean):
        assert judged("pivot_residuals", wrong, seed).status == NOT_YET


@pytest.mark.parametrize("seed", SEEDS)
def test_general_minimizers_are_right_and_single_precision_is_told(seed):
    def single(T_WF, tip, point):
        T, tip, point = (a.astype(np.float32) for a in (T_WF, tip, point))
        return T[:, :3, :3] @ tip + T[:, :3, 3] - point

    def minimized(A, b):
        return scipy.optimize.minimize(lambda x: ((A @ x - b) ** 2).sum(), np.zeros(6)).x

    assert "`float32` stands where `float64` belongs" in judged("pivot_residuals", single, seed).text
    assert judged("solve_pivot", minimized, seed).status == CORRECT


def test_the_report_of_an_optimizer_is_answered_by_its_x():
    report = judged("solve_pivot", lambda A, b: scipy.optimize.least_squares(lambda x: A @ x - b, np.zeros(6)))
    assert report.status == NOT_YET and "`.x`" in report.text


@pytest.mark.parametrize("seed", SEEDS)
def test_whole_numbers_of_vectorize_never_pass(seed):
    def weights(distances, scale):
        return np.vectorize(lambda d: (1 - (d / (7 * scale)) ** 2) ** 2 if d < 7 * scale else 0)(distances)

    assert "first result" in judged("robust_weights", weights, seed).text


@pytest.mark.parametrize(
    "cosine",
    [
        lambda T: (np.trace(T) - 1) / 2,
        lambda T: np.trace(T[:3, :3]) - 1 / 2,
        lambda T: np.trace(T[:3, :3]) - 1,
        lambda T: (np.trace(T[:3, :3]) + 1) / 2,
    ],
)
def test_an_arccosine_of_more_than_1_names_its_argument(cosine):
    with np.errstate(invalid="ignore"):
        outcome = judged("closure_error", lambda T: (np.arccos(cosine(T)), np.linalg.norm(T[:3, 3])))
    assert "(trace - 1) / 2" in outcome.text


library_angles = frames.kuka_from_matrix  # by this name a checked function may call it
library_pose = frames.matrix_from_kuka
FRAMES = {item.id: item for item in ch01_exercises.CHAPTER.items}


@pytest.mark.parametrize("seed", SEEDS)
def test_b_keeps_between_the_poles(seed):
    """The same pose with A half a turn on has B beyond 90 deg; whole turns of A and C change nothing."""

    def half_a_turn_on(T):
        xyz, (a, b, c) = T[:3, 3], library_angles(T)[3:]
        return np.array([*xyz, a + np.pi, np.pi - b, c + np.pi])

    def whole_turns_on(T):
        return library_angles(T) + 2 * np.pi * np.array([0, 0, 0, 1, 0, -1])

    rng = np.random.default_rng(seed)
    outcome = FRAMES["kuka_from_matrix"].judge(half_a_turn_on, rng=rng)
    assert outcome.status == NOT_YET and "B leaves the range" in outcome.text
    assert FRAMES["kuka_from_matrix"].judge(whole_turns_on, rng=rng).status == CORRECT


@pytest.mark.parametrize("seed", SEEDS)
def test_an_arcsine_fails_at_the_pole_in_every_check(seed):
    def by_arcsine(cut):
        def angles(T):
            xyzabc = library_angles(T)
            xyzabc[4] = np.arcsin(cut(-T[2, 0]))
            return xyzabc

        return angles

    def judge(cut):
        return FRAMES["kuka_from_matrix"].judge(by_arcsine(cut), rng=np.random.default_rng(seed))

    with np.errstate(invalid="ignore"):
        assert "np.clip" in judge(lambda sine: sine).text
    assert judge(lambda sine: np.clip(sine, -1, 1)).status == CORRECT


@pytest.mark.parametrize("seed", SEEDS)
def test_an_angle_of_more_than_90_deg_and_no_angle_at_all(seed):
    def distance(T):
        return np.linalg.norm(T[:3, 3])

    def cosine(T):
        return (np.trace(T[:3, :3]) - 1) / 2

    def by_arcsine(T):
        R = T[:3, :3]
        return np.arcsin(min(np.linalg.norm(R - R.T) / np.sqrt(8), 1)), distance(T)

    assert "120 deg you get 60 deg" in judged("closure_error", by_arcsine, seed).text
    with np.errstate(invalid="ignore"):
        assert "np.clip" in judged("closure_error", lambda T: (np.arccos(cosine(T)), distance(T)), seed).text
    cut = judged("closure_error", lambda T: (np.arccos(np.clip(cosine(T), -1, 1)), distance(T)), seed)
    assert cut.status == CORRECT


def test_what_a_longer_base_does_to_the_turn_about_x():
    """The sentences of chapter 1: only the ratio of u to the base counts, by the first-order law and by Monte Carlo."""
    rng, law, found = np.random.default_rng(0), {}, {}
    for base, u in ((100, 50), (200, 50), (100, 100), (200, 100)):
        law[base, u] = np.rad2deg(np.sqrt(frames.gram_schmidt_covariance(base, u, 10, 0.05)[0, 0]))
        noise = 0.05 * rng.normal(size=(3, 40_000, 3))
        T = frames.frame_from_points(*(np.array([[0, 0, 0], [base, 0, 0], [u, 10, 0]])[:, None] + noise))
        found[base, u] = np.rad2deg(T[:, 2, 1].std())
    rounded = {key: round(float(value), 3) for key, value in law.items()}
    assert rounded == {(100, 50): 0.351, (200, 50): 0.365, (100, 100): 0.405, (200, 100): 0.351}
    assert all(abs(found[key] / law[key] - 1) < 0.03 for key in law)  # eight standard deviations of a sample of 40 000


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    "words, status",
    [
        (lambda number, line: f"expected three numbers, got {line!r}", NOT_YET),  # its digits name no line
        (lambda number, line: f"line {number - 1}: {line!r}", NOT_YET),  # counts from 0
        (lambda number, line: f"line {number}: {line!r}", CORRECT),
    ],
)
def test_a_refusal_names_the_line(words, status, seed):
    def read_system(text):
        points = []
        for number, line in enumerate(text.splitlines(), start=1):
            entries = [number_in(entry) for entry in line.split("#")[0].replace(",", ".").split()]
            if entries and not (len(entries) == 3 and np.isfinite(entries).all()):
                raise ValueError(words(number, line))
            points += [entries] if entries else []
        if len(points) != 3:
            raise ValueError("three points")
        return np.array(points)

    assert judged("read_system", read_system, seed).status == status


def minus(T_WA, T_WB):
    return -np.asarray(np.linalg.solve(T_WA, T_WB))


def unfilled(T):
    out = [[0.0] * 4 for _ in range(4)]
    for i in range(3):
        for j in range(3):
            out[i][3] -= T[j][i] * T[j][3]
    out[3][3] = 1.0
    return np.array(out)


def signs_alone(a, b):
    b = np.clip(b, -1, 1)
    x = np.asarray(a) / np.linalg.norm(a)
    z = np.cross(a, b)
    z = z / np.linalg.norm(z)
    return -np.asarray(np.stack([x, np.cross(z, x), z], axis=1))


def no_length(T):
    R = Rotation.from_matrix(T[:3, :3])
    return R.magnitude(), np.linalg.norm(T[:0, 3])


def backward(transforms):
    return functools.reduce(np.matmul, transforms[::-1])


def by_a_root(T):
    with np.errstate(invalid="ignore"):
        half_sine = np.sqrt(3 - np.trace(T[:3, :3])) / 2
    return 2 * np.arctan2(half_sine, np.sqrt(1 - half_sine**2)), np.linalg.norm(T[:3, 3])


def way_back_in_parts(transforms):
    poses, n = chaining.stations(transforms), len(transforms)
    turn, shift = log_se3(poses[-1])[:3], poses[-1][:3, 3]
    ways = (frames.pose(exp_so3(k / n * turn), k / n * shift) for k in range(n + 1))
    moved = [frames.invert(way) @ P for way, P in zip(ways, poses)]
    return np.array([frames.relative(A, B) for A, B in zip(moved, moved[1:])])


@pytest.mark.parametrize(
    "name, answer, told, untrue",
    [
        ("relative", minus, "`np.linalg.solve(T_WA, T_WB)`, the result is right", "a right formula"),
        ("invert", unfilled, "not orthonormal", "[0.0] * 4"),
        ("gram_schmidt", signs_alone, "a reflection", "those of the solution"),
        ("closure_error", no_length, "Your distance is 0 for every T", "You took"),
        ("chain", lambda transforms: np.zeros((4, 4)), "Every entry is 0", "You started"),
        (
            "chain",
            lambda Ts: functools.reduce(np.matmul, Ts[::-1]),
            "the product in the reverse order",
            "You multiplied",
        ),
        (
            "chain",
            lambda Ts: np.linalg.inv(functools.reduce(np.matmul, Ts[::-1])),
            "of the inverted links",
            "You inverted",
        ),
        ("closure_error", by_a_root, "a root of what is below 0", "arccos gives"),
        ("distribute_closure", way_back_in_parts, "turn and shift each for itself", "it is off by"),
    ],
)
def test_what_is_said_is_true_of_whatever_gives_the_result(name, answer, told, untrue):
    text = {**FRAMES, **ITEMS}[name].judge(answer, rng=np.random.default_rng(3)).text
    assert told in text and untrue not in text


def test_what_stands_in_an_array_is_told_where_it_is_no_number():
    assert "got an array of text" in judged("read_system", lambda text: np.array([text.split()[:3]] * 3)).text


def test_a_heading_is_told_that_it_needs_a_mark():
    told = judged("write_system", lambda points: "x y z\n" + beyond.write_system(points)).text
    assert "A heading needs a # before it" in told
    told = judged("write_system", lambda points: "\n".join(" ".join(map(repr, point)) for point in points)).text
    assert "make it Python's first" in told
    assert "heading" not in judged("write_system", lambda points: beyond.write_system(points[:2])).text


def test_zeros_are_not_taken_for_the_last_row_alone():
    assert "nothing filled in" in judged("pivot_rhs", lambda T: np.zeros(3 * len(T))).text


@pytest.mark.parametrize("seed", SEEDS)
def test_small_singular_values_count(seed):
    outcome = judged("solve_pivot", lambda A, b: np.linalg.pinv(A, rcond=0.1) @ b, seed)
    assert outcome.status == NOT_YET and "are dropped here" in outcome.text


def test_the_worst_direction_is_the_one_an_optimizer_finds():
    T = chaining.chain(lab_sheet.printed_transforms())

    def gain(angles):
        (a, b), (ca, cb) = np.sin(angles), np.cos(angles)
        p = 1000 * np.array([ca * cb, a * cb, b])
        return -np.linalg.norm(T[:3, :3] @ p + T[:3, 3] - p)

    starts = [(turn, tilt) for turn in (0.0, 2.0, 4.0) for tilt in (-0.5, 0.5)]
    best = min(scipy.optimize.minimize(gain, start).fun for start in starts)
    assert ITEMS["worst_at_one_meter"].reference() == pytest.approx(-best, rel=2e-4)


def upward(a, b):
    R = made_frame(np.zeros(3), a, b)[:3, :3]
    return R * (1, 1, -1 if R[2, 2] < 0 else 1)


def from_two_entries(T):
    c, s, t = T[0, 0], T[1, 0], T[:3, 3]
    return np.array([[c, s, 0, -c * t[0] - s * t[1]], [-s, c, 0, s * t[0] - c * t[1]], [0, 0, 1, -t[2]], [0, 0, 0, 1]])


def cosine_by_a_root(xyzabc):
    sine = np.sin(xyzabc[4])
    Rz, Rx = (Rotation.from_euler(axis, xyzabc[k]).as_matrix() for axis, k in (("z", 3), ("x", 5)))
    cosine = np.sqrt(1 - sine**2)
    Ry = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    return np.block([[Rz @ Ry @ Rx, np.reshape(xyzabc[:3], (3, 1))], [0, 0, 0, 1]])


def pole_by_r00(T):
    xyzabc, R = library_angles(T), T[:3, :3]
    if abs(R[0, 0]) < 1e-6:
        xyzabc[3], xyzabc[5] = 0, np.arctan2(-R[1, 2], R[1, 1])
    return xyzabc


def with_C_at_0_at_the_pole(T):
    xyzabc, R = library_angles(T), T[:3, :3]
    if np.hypot(R[0, 0], R[1, 0]) < 1e-9:
        xyzabc[3], xyzabc[5] = np.arctan2(-R[0, 1] * np.sign(xyzabc[4]), R[1, 1]), 0
    return xyzabc


def pole_from_87_deg(T):
    R, sign = T[:3, :3], -np.sign(T[2, 0])
    if abs(R[2, 0]) > 0.999:
        return np.array([*T[:3, 3], 0.0, sign * np.pi / 2, np.arctan2(sign * R[0, 1], R[1, 1])])
    A, C = np.arctan2(R[1, 0], R[0, 0]), np.arctan2(R[2, 1], R[2, 2])
    return np.array([*T[:3, 3], A, -np.arcsin(R[2, 0]), C])


def about_z_by_an_angle(T):
    R = Rotation.from_euler("z", -np.arctan2(T[1, 0], T[0, 0])).as_matrix()
    return frames.pose(R, -R @ T[:3, 3])


def pole_by_r01_and_r02(T):
    R, cosine = T[:3, :3], np.hypot(T[0, 0], T[1, 0])
    A, C = np.arctan2(R[1, 0], R[0, 0]), np.arctan2(R[2, 1], R[2, 2])
    if cosine < 1e-9:
        A, C = 0.0, np.arctan2(R[0, 1], R[0, 2])
    return np.array([*T[:3, 3], A, np.arctan2(-R[2, 0], cosine), C])


def one_sign_of_qr(a, b):
    Q, _ = np.linalg.qr(np.column_stack([a, b, np.cross(a, b)]))
    if Q[:, 0] @ a < 0:
        Q[:, 0] *= -1
    if np.linalg.det(Q) < 0:
        Q[:, 1] *= -1
    return Q


library_fit = frames.fit_frame


def four_points_at_least(points_F, points_W):
    return library_fit(points_F, points_W) if len(points_F) > 3 else np.eye(4)


def through_other_three_points(points_F, points_W):
    k = [2, 0, 1]
    return frames.frame_from_points(*points_W[k]) @ frames.invert(frames.frame_from_points(*points_F[k]))


def last_turn_only(xyzabc):
    R = Rotation.from_euler("x", 3 * xyzabc[5]).as_matrix()
    return np.block([[R, np.reshape(xyzabc[:3], (3, 1))], [0, 0, 0, 1]])


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    "name, answer, told",
    [
        ("gram_schmidt", upward, ""),
        ("invert", from_two_entries, "turned about z alone"),
        ("invert", about_z_by_an_angle, "turned about z alone"),
        ("matrix_from_kuka", last_turn_only, "All three turns take C"),
        ("matrix_from_kuka", cosine_by_a_root, "cosine of B is never negative"),
        ("fit_frame", four_points_at_least, ""),
        ("kuka_from_matrix", pole_by_r00, ""),
        ("kuka_from_matrix", with_C_at_0_at_the_pole, "At B = -90 deg your A + C has the wrong sign"),
        ("kuka_from_matrix", pole_by_r01_and_r02, "At B = -90 deg your A + C is half a turn off"),
        ("kuka_from_matrix", pole_from_87_deg, "but not a degree or two beside one"),
        ("gram_schmidt", one_sign_of_qr, "your y and z point the other way where the result is wrong"),
        ("fit_frame", through_other_three_points, "Another pose brings the points nearer"),
    ],
)
def test_frames_that_are_right_for_some_only(name, answer, told, seed):
    outcome = FRAMES[name].judge(answer, rng=np.random.default_rng(seed))
    assert outcome.status == NOT_YET and told in outcome.text


@pytest.mark.parametrize("centered", [False, True])
def test_an_affine_map_is_no_fit_of_a_frame(centered):
    def fit(points_F, points_W):
        p, q = (points_F.mean(0), points_W.mean(0)) if centered else (0, 0)
        affine = np.linalg.lstsq(np.column_stack([points_F - p, np.ones(len(points_F))]), points_W - q, rcond=None)[0]
        U, _, Vt = np.linalg.svd(affine[:3].T)
        T = np.eye(4)
        T[:3, :3] = U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt
        T[:3, 3] = points_W.mean(0) - T[:3, :3] @ points_F.mean(0)
        return T

    assert "arbitrary linear map" in FRAMES["fit_frame"].judge(fit, rng=np.random.default_rng(0)).text


def two_links_at_least(transforms):
    return np.linalg.multi_dot(list(transforms))


def twists_added(transforms):
    return exp_se3(sum(map(log_se3, transforms)))


def rounded_singular_values(T):
    U, s, Vt = np.linalg.svd(T[:3, :3])
    return np.vstack([np.column_stack([U @ np.diag(s.round()) @ Vt, T[:3, 3]]), T[3]])


def one_newton_step(T):
    R = (T[:3, :3] + np.linalg.inv(T[:3, :3]).T) / 2
    return np.vstack([np.column_stack([R, T[:3, 3]]), T[3]])


def to_the_corrected_pose(transforms):
    n, xi, P, links = len(transforms), log_se3(chaining.stations(transforms)[-1]), np.eye(4), []
    for k, T in enumerate(transforms, start=1):
        links.append(relative(P, exp_se3(-k / n * xi) @ P @ T))
        P = P @ T
    return np.array(links)


def tip_then_point(A, b):
    tip = lstsq(A[:, :3], b, rcond=None)[0]
    return np.append(tip, lstsq(A[:, 3:], b - A[:, :3] @ tip, rcond=None)[0])


def in_pairs(transforms):
    row = list(transforms)
    while len(row) > 1:
        row = [A @ B for A, B in zip(row[::2], row[1::2])]
    return np.array(row[0])


def each_at_its_end(transforms):
    links = np.array(transforms)
    for _ in range(5):
        links = links @ exp_se3(-log_se3(chaining.chain(links)) / len(links))
    return links


def turned_by_the_skew_part(T):
    S = T[:3, :3] - T[:3, :3].T
    X = exp_se3([S[2, 1] / 2, S[0, 2] / 2, S[1, 0] / 2, 0.0, 0.0, 0.0])
    X[:3, 3] = T[:3, 3]
    return X


library_distribute = chaining.distribute_closure


def a_link_as_it_was(transforms):
    return library_distribute(transforms) if len(transforms) > 1 else transforms


def long_links_alone(transforms):
    T = np.eye(4)
    for link in transforms:
        T = T @ link if np.linalg.norm(link[:3, 3]) > 100 else T
    return T


def slide(T):
    phi = log_se3(T)[:3]
    return np.linalg.norm(phi), abs(T[:3, 3] @ phi) / np.linalg.norm(phi)


def comments_and_empty_lines_at_the_margin(text):
    points = []
    for number, line in enumerate(text.splitlines(), start=1):
        if line and line[0] != "#":
            entries = [number_in(entry) for entry in line.split("#")[0].replace(",", ".").split()]
            if len(entries) != 3 or not np.isfinite(entries).all():
                raise ValueError(f"line {number}: {line!r}")
            points.append(entries)
    if len(points) != 3:
        raise ValueError("three points")
    return np.array(points)


def even_numbers_of_poses(A, b):
    k = len(b) // 6 * 6
    return lstsq(A[:k], b[:k], rcond=None)[0]


def influence_by_distance(distances, scale):
    q = np.minimum(distances / (7 * scale), 1)
    with np.errstate(invalid="ignore"):
        return distances * (1 - q**2) ** 2 / distances


def no_exponents(text):
    lines = [line.split("#")[0].replace(",", ".").split() for line in text.splitlines()]
    if not all(re.fullmatch(r"-?\d+(\.\d+)?", entry) for line in lines for entry in line):
        raise ValueError("line 1")
    return np.array([[number_in(entry) for entry in line] for line in lines if line])


def before_the_first_comment(text):
    return read_points(text.split("#")[0].splitlines())


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    "name, answer, told",
    [
        ("chain", two_links_at_least, ""),
        ("chain", twists_added, "added the twists"),
        ("orthonormalize", rounded_singular_values, ""),
        ("orthonormalize", one_newton_step, "one step of an iteration"),
        ("closure_error", lambda T: (abs(np.arctan2(T[1, 0], T[0, 0])), np.linalg.norm(T[:3, 3])), "about z alone"),
        ("closure_error", lambda T: {"angle": 0.1, "distance": T[0, 3]}, "got a dict"),
        ("distribute_closure", to_the_corrected_pose, "the share of their end"),
        ("distribute_closure", a_link_as_it_was, ""),
        ("chain", long_links_alone, ""),
        ("chain", in_pairs, "where `transforms` has 3, 6 or 9 rows, and not where it has 2 or 4"),
        ("distribute_closure", each_at_its_end, "The loop of your links does not close"),
        ("orthonormalize", turned_by_the_skew_part, "Your block is a rotation, but another one is nearer"),
        ("closure_error", slide, "slides along the axis"),
        ("read_system", no_exponents, "line 1"),
        ("read_system", comments_and_empty_lines_at_the_margin, ""),
        ("write_system", lambda points: "\n".join(" ".join(f"{v:.17f}" for v in p) for p in points), "fixed number of"),
        ("pivot_rhs", lambda T: -np.concatenate(np.squeeze(T[:, :3, 3])), "right before, on other draws"),
        ("pivot_residuals", lambda T, tip, point: np.squeeze(T[:, :3, :3] @ tip + T[:, :3, 3] - point), "(1, 3)"),
        ("solve_pivot", even_numbers_of_poses, ""),
        ("robust_weights", influence_by_distance, "NaN"),
        ("pivot_covariance", lambda A, r: r.sum() ** 2 / len(r) * np.linalg.inv(A.T @ A), "sum the squares"),
        ("solve_pivot", tip_then_point, "You fitted the tip first"),
        ("read_system", before_the_first_comment, "and no further"),
    ],
)
def test_chains_and_pivots_that_are_right_for_some_only(name, answer, told, seed):
    outcome = judged(name, answer, seed)
    assert outcome.status != CORRECT and told in outcome.text


def test_values_near_a_mistake_are_that_mistake():
    angle, distance = chaining.closure_error(chaining.chain(lab_sheet.printed_transforms()))
    chord = 2000 * np.sin(angle / 2)
    assert "turn alone" in judged("worst_at_one_meter", chord).text
    assert "no point can be worse" in judged("worst_at_one_meter", chord + distance).text
    assert "displacement of the origin of K0" in judged("worst_at_one_meter", distance + angle).text
    flanges = lab_sheet.kreisel_poses()[:, :3, 3]
    assert "the positions of the flange" in judged("tip_length", np.linalg.norm(flanges, axis=1).mean()).text


def test_a_rounded_number_is_not_the_sum_it_happens_to_be():
    assert "from the origin of K1" in FRAMES["distance"].judge(200.0).text


@pytest.mark.parametrize("seed", SEEDS)
def test_a_short_vector_is_scaled_as_well(seed):
    def kept_where_short(v):
        n = np.linalg.norm(v)
        return v if n < 1e-3 else v / n

    item = ch01_exercises.CHAPTER["normalize"]
    assert item.judge(kept_where_short, rng=np.random.default_rng(seed)).status == NOT_YET


def test_lines_are_counted_with_the_empty_ones():
    def only_full_lines(text):
        return read_points([line for line in text.splitlines() if line.strip()])

    outcome = judged("read_system", only_full_lines)
    assert outcome.status == NOT_YET and "your sentence does not name the line" in outcome.text


def test_two_systems_and_an_empty_file_are_none():
    def in_threes(text):
        points = read_points(text.splitlines(), count=None)
        if len(points) % 3:
            raise ValueError("no three points")
        return points[-3:]

    outcome = judged("read_system", in_threes)
    assert outcome.status == NOT_YET and "a file of 6 points is no system" in outcome.text


@pytest.mark.parametrize(
    ("place", "status"),
    [
        (lambda lines, number: f"line {lines.index(lines[number - 1]) + 1}: ", NOT_YET),  # where its text is first met
        (lambda lines, number: f"line {number}: ", CORRECT),
        (lambda lines, number: "", CORRECT),
    ],
)
def test_a_fourth_point_that_repeats_the_first_has_its_own_line(place, status):
    def read_system(text):
        lines, points = text.splitlines(), []
        for number, line in enumerate(lines, start=1):
            entries = [number_in(e) for e in line.split("#")[0].replace(",", ".").split()]
            if entries and (len(entries) != 3 or not np.isfinite(entries).all()):
                raise ValueError(f"line {number}: {line!r}")
            if entries and len(points) == 3:
                raise ValueError(f"{place(lines, number)}a fourth point")
            points += [entries] if entries else []
        if len(points) != 3:
            raise ValueError("three points")
        return np.array(points)

    assert judged("read_system", read_system).status == status


def read_points(lines, count=3):
    points = []
    for number, line in enumerate(lines, start=1):
        entries = [number_in(entry) for entry in line.split("#")[0].replace(",", ".").split()]
        if entries and (len(entries) != 3 or not np.isfinite(entries).all()):
            raise ValueError(f"line {number}: three numbers are expected, not {line!r}")
        points += [entries] if entries else []
    if count and len(points) != count:
        raise ValueError(f"expected {count} points, got {len(points)}")
    return np.array(points)


def test_half_a_turn_has_an_angle_though_its_sine_has_no_sign():
    def by_signs(T):
        R, turned = T[:3, :3], ch01_exercises.CHAPTER["kuka_from_matrix"].reference(T)
        away = np.hypot(R[0, 0], R[1, 0]) > 1e-9
        A = np.sign(R[1, 0]) * np.arccos(np.clip(R[0, 0] / np.cos(turned[4]), -1, 1)) if away else turned[3]
        return np.array([*turned[:3], A, *turned[4:]])

    outcome = ch01_exercises.CHAPTER["kuka_from_matrix"].judge(by_signs, rng=np.random.default_rng(0))
    assert outcome.status == NOT_YET and outcome.text.startswith("right, but not where A is 180 deg:")


@pytest.mark.parametrize(
    "name, answer",
    [
        ("normalize", lambda v: v / np.linalg.norm(v) if v.all() else v),
        ("frame_from_points", lambda o, x, y: made_frame(o, x, y) if o.any() else np.diag([1.0, 1, 1, 0])),
        ("relative", lambda A, B: A if np.allclose(A, B) else np.linalg.inv(A) @ B),
    ],
)
def test_zeros_and_one_frame_twice_are_drawn(name, answer):
    outcome = ch01_exercises.CHAPTER[name].judge(answer, rng=np.random.default_rng(0))
    assert outcome.status == NOT_YET


def made_frame(origin, x_point, y_point):
    x = (x_point - origin) / np.linalg.norm(x_point - origin)
    y = y_point - origin - (y_point - origin) @ x * x
    y /= np.linalg.norm(y)
    return np.vstack([np.column_stack([x, y, np.cross(x, y), origin]), [0, 0, 0, 1]])


def test_a_letter_behind_a_number_is_drawn():
    def found_by_a_pattern(text):
        lines = [line.split("#")[0].replace(",", ".") for line in text.splitlines()]
        return read_points([" ".join(re.findall(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?", line)) for line in lines])

    assert judged("read_system", lambda text: read_points(text.splitlines())).status == CORRECT
    assert "holds a letter behind a number" in judged("read_system", found_by_a_pattern).text


def of_length_1_as_it_is(v):
    n = np.linalg.norm(v)
    return v if np.isclose(n, 1) else v / n


def without_a_small_shadow(least):
    def gram_schmidt(a, b):
        x = a / np.linalg.norm(a)
        y = b - (b @ x) * x if abs(b @ x) > least else b
        return np.column_stack([x, y / np.linalg.norm(y), np.cross(x, y / np.linalg.norm(y))])

    return gram_schmidt


def framed(gram_schmidt):
    return lambda o, p, q: frames.pose(gram_schmidt(p - o, q - o), o)


def of_turned_poses(T):
    return T if np.allclose(T[:3, :3], np.eye(3)) else np.linalg.inv(T)


def by_first_order(T):
    return 2 * np.eye(4) - T if np.abs(T - np.eye(4)).max() < 0.02 else np.linalg.inv(T)


def of_frames_turned_apart(T_WA, T_WB):
    if np.allclose(T_WA[:3, :3], T_WB[:3, :3]):
        return frames.pose(np.eye(3), T_WB[:3, 3] - T_WA[:3, 3])
    return np.linalg.inv(T_WA) @ T_WB


def of_frames_a_step_apart(T_WA, T_WB):
    return np.eye(4) if np.allclose(T_WA, T_WB) else np.linalg.inv(T_WA) @ T_WB


def without_links_that_hardly_move(transforms):
    moving = [T for T in transforms if not np.allclose(T, np.eye(4), atol=1e-2)]
    return functools.reduce(np.matmul, moving, np.eye(4))


def none_where_hardly_any(T):
    angle = np.linalg.norm(Rotation.from_matrix(T[:3, :3]).as_rotvec())
    return (0.0, 0.0) if np.allclose(T, np.eye(4), atol=1e-3) else (angle, np.linalg.norm(T[:3, 3]))


def pole_from_a_thousandth(T):
    found, R = library_angles(T), T[:3, :3]
    if np.hypot(R[0, 0], R[1, 0]) < 1e-3:
        found[3], found[5] = 0, np.arctan2(-R[1, 2], R[1, 1])
    return found


library_closure, library_repair = chaining.closure_error, chaining.orthonormalize


def without_small_angles(T):
    angle, distance = library_closure(T)
    return (0.0 if np.cos(angle) > 0.99999 else angle), distance


def as_good_as_orthonormal(T):
    return T.copy() if abs(np.linalg.det(T[:3, :3]) - 1) < 1e-5 else library_repair(T)


def by_the_axis_of_the_gap(transforms):
    """The angle goes into a division: of a loop that is closed nothing is left."""
    xi = log_se3(chaining.chain(transforms))
    xi = xi / np.linalg.norm(xi) * np.linalg.norm(xi)
    P, N = chaining.stations(transforms), len(transforms)
    Q = [exp_se3(-k / N * xi) @ p for k, p in enumerate(P)]
    return np.array([relative(a, b) for a, b in zip(Q, Q[1:])])


def of_frames_apart(T_WA, T_WB):
    return np.eye(4) if np.allclose(T_WA, T_WB, atol=1e-2) else np.linalg.inv(T_WA) @ T_WB


def without_small_turns(xyzabc):
    return library_pose(np.where(np.arange(6) < 3, xyzabc, np.where(abs(xyzabc) < 1e-3, 0, xyzabc)))


def within_half_a_turn(xyzabc):
    return library_pose(np.concatenate([xyzabc[:3], np.clip(xyzabc[3:], -np.pi, np.pi)]))


def angles_of_four_decimals(T):
    xyzabc = library_angles(T)
    return np.concatenate([xyzabc[:3], xyzabc[3:].round(4)]) if T[0, 0] > 0.99999 else xyzabc


def of_several(distances, scale):
    w = np.maximum(1 - (distances / 7 / scale) ** 2, 0) ** 2
    return w if len(w) > 1 else np.ones(1)


@pytest.mark.filterwarnings("ignore:invalid value")
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    "name, answer",
    [
        ("relative", of_frames_apart),
        ("matrix_from_kuka", without_small_turns),
        ("matrix_from_kuka", within_half_a_turn),
        ("kuka_from_matrix", angles_of_four_decimals),
        ("robust_weights", of_several),
        ("normalize", of_length_1_as_it_is),
        ("gram_schmidt", without_a_small_shadow(1e-4)),
        ("frame_from_points", framed(without_a_small_shadow(0.02))),
        ("invert", of_turned_poses),
        ("invert", by_first_order),
        ("relative", of_frames_turned_apart),
        ("relative", of_frames_a_step_apart),
        ("chain", without_links_that_hardly_move),
        ("closure_error", none_where_hardly_any),
        ("kuka_from_matrix", pole_from_a_thousandth),
        ("closure_error", without_small_angles),
        ("orthonormalize", as_good_as_orthonormal),
        ("distribute_closure", by_the_axis_of_the_gap),
    ],
)
def test_what_is_nearly_a_special_case_is_drawn(name, answer, seed):
    outcome = {**FRAMES, **ITEMS}[name].judge(answer, rng=np.random.default_rng(seed))
    assert outcome.status != CORRECT and "the library's" not in outcome.text


def test_a_part_of_the_text_that_is_nearly_right_is_told_in_words():
    told = judged("write_system", lambda points: "\n".join(" ".join(f"{v:.14f}" for v in p) for p in points)).text
    assert "times the expected" not in told and not told.startswith(" ")


def test_a_place_on_the_axis_a_meter_away_is_not_called_near():
    product = chaining.chain(lab_sheet.printed_transforms())
    axis = frames.unit_vector(log_se3(product)[:3])
    told = judged("worst_at_one_meter", chaining.displacement(product, 1000 * axis[None]).max()).text
    assert "on an axis through it" in told


def _even_lever_in_the_plane():
    T = chaining.chain(lab_sheet.printed_transforms())
    return np.hypot(T[0, 3], T[1, 3]) / chaining.closure_error(T)[0]


def _by_the_arccosine(of):
    """Of the angle by the trace, which the rounded entries put a little elsewhere, and the distance."""
    T = chaining.chain(lab_sheet.printed_transforms())
    angle = np.arccos((np.trace(T[:3, :3]) - 1) / 2)
    return lambda: of(angle, np.linalg.norm(T[:3, 3]))


def _lever_of_a_measured_link():
    angle, distance = chaining.closure_error(chaining.transforms_from_points(lab_sheet.station_points()))
    return distance[2] / angle[2]


def _farthest_point():
    T, u = chaining.chain(lab_sheet.printed_transforms()), np.random.default_rng(0).normal(size=(10000, 3))
    return np.linalg.norm(frames.transform(T, 1000 * u / np.linalg.norm(u, axis=1)[:, None]), axis=1).max()


def _hole_by_matrices():
    return 200 * np.linalg.norm((ch01_exercises._K0_T_K1() - ch01_exercises._drawn())[:3, :3])


def _hole_along_x():
    hole = np.array([200.0, 0, 0, 1])
    return abs(((ch01_exercises._K0_T_K1() - ch01_exercises._drawn()) @ hole)[0])


@pytest.mark.parametrize(
    ("chapter", "name", "answer", "words"),
    [
        (exercises, "even_lever", _even_lever_in_the_plane, "lost its z"),
        (exercises, "even_lever", _by_the_arccosine(lambda angle, d: d * angle), "angle times distance"),
        (exercises, "even_lever", _by_the_arccosine(lambda angle, d: d / np.sin(angle / 2)), "Twice too large"),
        (exercises, "even_lever", _by_the_arccosine(lambda angle, d: d / (1 - np.cos(angle))), "toward the axis"),
        (exercises, "even_lever", _by_the_arccosine(lambda angle, d: d / np.rad2deg(angle)), "angle in degrees"),
        (exercises, "worst_at_one_meter", _by_the_arccosine(lambda angle, d: 1000 * angle), "turn alone"),
        (exercises, "worst_at_one_meter", _by_the_arccosine(lambda angle, d: 1000 * angle + d), "none is that bad"),
        (exercises, "even_lever", _lever_of_a_measured_link, "the third link alone"),
        (ch01_exercises, "distance", _hole_by_matrices, "the distance times the root of 2"),
        (ch01_exercises, "distance", _hole_along_x, "lies off in y too"),
        (ch01_exercises, "angle_deg", lambda: 90 + np.rad2deg(np.arcsin(0.01)), "180 deg less the angle"),
        (exercises, "worst_at_one_meter", _farthest_point, "Subtract p"),
    ],
)
def test_a_neighbor_within_the_tolerance_is_named(chapter, name, answer, words):
    assert words in chapter.CHAPTER[name].judge(answer()).text


def _guarded_by_a_length(v):
    return v if np.linalg.norm(v) < 1e-6 else v / np.linalg.norm(v)


def _angle_of_a_half(T):
    """By the cosine of half the angle, which rounding can push above 1."""
    return 2 * np.arccos(np.sqrt(1 + np.trace(T[:3, :3])) / 2), np.linalg.norm(T[:3, 3])


def _with_a_point(part):
    return float(part) if re.fullmatch(r"-?\d+\.\d+(e.\d+)?", part) else None


def _closed_where(measure):
    """Shares nothing out where the turn of the gap, or its distance, is next to 0."""

    def answer(transforms):
        gap = chaining.closure_error(chaining.chain(transforms))
        moved = exercises._moved_poses(transforms)
        return transforms.copy() if gap[measure] < 1e-9 else relative(moved[:-1], moved[1:])

    return answer


def _reading(entry):
    """A reader that leaves each entry of a line to `entry`, which returns None where it takes it for no number."""

    def answer(text):
        points = []
        for number, line in enumerate(text.splitlines(), start=1):
            entries = [entry(part) for part in line.partition("#")[0].replace(",", ".").split()]
            if entries and (len(entries) != 3 or None in entries):
                raise ValueError(f"line {number}: {line}")
            points += [entries] if entries else []
        if len(points) != 3:
            raise ValueError("three points")
        return np.array(points)

    return answer


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    ("chapter", "name", "answer"),
    [
        (ch01_exercises, "normalize", _guarded_by_a_length),
        (exercises, "closure_error", lambda T: (round(frames.rotation_angle(T[:3, :3]), 6), np.linalg.norm(T[:3, 3]))),
        (exercises, "closure_error", _angle_of_a_half),
        (exercises, "distribute_closure", _closed_where(0)),
        (exercises, "distribute_closure", _closed_where(1)),
        (exercises, "read_system", _reading(_with_a_point)),
        (ch03_exercises, "solve_pivot", lambda A, b: lstsq(A, b, rcond=0.02)[0]),
    ],
)  # fmt: skip
def test_what_is_wrong_in_one_case_alone_never_passes(chapter, name, answer, seed, monkeypatch):
    monkeypatch.setattr(budget, "LOOKING", 0.0)  # what is told is not asked here
    with np.errstate(invalid="ignore"):
        outcome = chapter.CHAPTER[name].judge(answer, rng=np.random.default_rng(seed))
    assert outcome.status != CORRECT


@pytest.mark.parametrize("seed", SEEDS)
def test_a_text_to_read_holds_every_sort_of_line(seed):
    """A whole number, a tab, a line of blanks, a comment behind a number without a blank: none of them by chance."""
    rng = np.random.default_rng(seed)
    for draw in beyond.TEXTS:
        (text,) = draw(rng)
        assert re.search(r"(^|\s)-?\d+(\s|#|$)", text) and "\t" in text and re.search(r"^ +$", text, re.MULTILINE)
        assert ("#" not in text) or re.search(r"\d# again", text)


def test_a_variance_about_the_mean_is_no_sum_of_squares():
    def about_mean(A, residuals):
        return np.var(residuals, ddof=6) * np.linalg.inv(A.T @ A)

    assert judged("pivot_covariance", about_mean).status == NOT_YET


def _rms(p, q):
    return np.sqrt(np.mean((frames.transform(frames.fit_frame(p, q), p) - q) ** 2))


def _turn(T):
    return frames.rotation_angle(T[..., :3, :3])


FORGOTTEN = [
    ("normalize", lambda v: np.linalg.norm(v) < 1e-6),
    ("normalize", lambda v: np.linalg.norm(v) < 2.1e-8),
    ("normalize", lambda v: np.count_nonzero(v) == 2),
    ("gram_schmidt", lambda a, b: frames.arm_angle(a, b) < 0.1),
    ("gram_schmidt", lambda a, b: frames.arm_angle(a, b) < 0.01),
    ("gram_schmidt", lambda a, b: np.linalg.norm(b) > 20 * np.linalg.norm(a)),
    ("frame_from_points", lambda o, x, y: np.linalg.norm(o) > 1e3),
    ("frame_from_points", lambda o, x, y: o[2] == x[2] == y[2] != 0),
    ("invert", lambda T: _turn(T) > 0 and not T[:3, 3].any()),
    ("invert", lambda T: 0 < _turn(T) < 0.01 and np.linalg.norm(T[:3, 3]) > 1),
    ("relative", lambda A, B: np.array_equal(A, np.eye(4))),
    ("relative", lambda A, B: np.allclose(A[:3, 3], B[:3, 3]) and not np.allclose(A, B)),
    *(("matrix_from_kuka", lambda p, k=k: p[3 + k] == 0) for k in range(3)),
    *(("matrix_from_kuka", lambda p, k=k, s=s: s * p[3 + k] > 2 * np.pi) for k in range(3) for s in (1, -1)),
    ("kuka_from_matrix", lambda T: 1e-9 < np.hypot(T[0, 0], T[1, 0]) < 1e-4),
    ("kuka_from_matrix", lambda T: T[0, 0] == 0 and T[0, 2] * T[2, 0] != 0),
    *(("kuka_from_matrix", lambda T, s=s: 1 - 1e-15 < s * T[2, 0] < 1) for s in (1, -1)),
    ("kuka_from_matrix", lambda T: T[1, 0] < 0 < T[0, 0] and T[2, 2] < 0 < T[2, 1]),
    ("fit_frame", lambda p, q: len(p) > 8),
    ("fit_frame", lambda p, q: _rms(p, q) > 5),
    ("fit_frame", lambda p, q: not p[:, 2].any()),
    ("fit_frame", lambda p, q: len(p) > 3 and p[:, 2].any() and np.linalg.matrix_rank(p - p.mean(0), 1e-6) < 3),
    ("chain", lambda links: len(links) > 9),
    ("chain", lambda links: (links == np.eye(4)).all(axis=(1, 2)).any()),
    ("closure_error", lambda T: _turn(T) > 0 and not T[:3, 3].any()),
    ("closure_error", lambda T: 0 < _turn(T) < 1e-5),
    ("closure_error", lambda T: 0 < _turn(T) < 1e-6 and np.linalg.norm(T[:3, 3]) < 1e-6),
    ("closure_error", lambda T: abs(_turn(T) - np.pi / 2) < 0.1),
    ("closure_error", lambda T: 1e-6 < np.pi - _turn(T) < 0.01),
    ("orthonormalize", lambda T: np.linalg.det(T[:3, :3]) > 5),
    ("orthonormalize", lambda T: np.allclose(T[:3, :3].T @ T[:3, :3], np.eye(3), atol=1e-12)),
    (
        "orthonormalize",
        lambda T: np.ptp([1, np.linalg.norm(T[:3, 0])]) > 1e-7 and np.allclose(T[:3, :3].T @ T[:3, :3], np.eye(3)),
    ),
    ("distribute_closure", lambda links: len(links) > 7),
    ("distribute_closure", lambda links: 0 < _turn(chaining.chain(links)) < 1e-3),
    ("distribute_closure", lambda links: _turn(chaining.chain(links)) > np.pi / 2),
    *((name, lambda T, *_: len(T) == 2) for name in ("pivot_matrix", "pivot_rhs", "pivot_residuals")),
    *((name, lambda T, *_: len(T) > 13) for name in ("pivot_matrix", "pivot_rhs", "pivot_residuals")),
    *((name, lambda T, *_: _turn(T).max() > np.pi / 2) for name in ("pivot_matrix", "pivot_residuals")),
    ("pivot_residuals", lambda T, tip, point: not tip.any()),
    ("solve_pivot", lambda A, b: len(b) == 9),
    ("pivot_covariance", lambda A, r: len(r) == 3),
    (
        "solve_pivot",
        lambda A, b: (lambda r: np.abs(r).max() > 5 * np.abs(r).mean() > 1e-6)(A @ lstsq(A, b, rcond=None)[0] - b),
    ),
    ("pivot_covariance", lambda A, r: r.std() > 5),
    ("pivot_covariance", lambda A, r: np.abs(r).max() > 5 * r.std()),
    ("robust_weights", lambda d, scale: ((d > 6.8 * scale) & (d < 7 * scale)).any()),
    ("robust_weights", lambda d, scale: scale > 10),
    ("robust_weights", lambda d, scale: scale < 0.01),
    ("read_system", lambda text: "+1.5" in text),
    ("read_system", lambda text: re.search(r"#.*#", text)),
    ("read_system", lambda text: re.search(r"\d,\d", text) and re.search(r"\d\.\d", text)),
    ("read_system", lambda text: re.search(r"# \d+\.\d \d+\.\d \d+\.\d$", text, re.MULTILINE)),
    ("write_system", lambda points: np.abs(points).min() < 1e-100),
    ("write_system", lambda points: np.abs(points).max() > 1e100),
    ("write_system", lambda points: (points == 0).any()),
]


@pytest.mark.parametrize("name, forgotten", FORGOTTEN, ids=[f"{name}-{k}" for k, (name, _) in enumerate(FORGOTTEN)])
def test_who_forgets_a_place_is_refused(name, forgotten, monkeypatch):
    monkeypatch.setattr(budget, "LOOKING", 0.0)
    item = {**FRAMES, **ITEMS}[name]

    def answer(*given):
        return None if forgotten(*given) else item.reference(*given)

    assert item.judge(answer, rng=np.random.default_rng(0)).status == NOT_YET


def test_a_minimizer_that_stops_at_a_hundred_millionth_is_right_of_a_bad_measurement():
    def by_minimizing(points_F, points_W):
        p, q = points_F - points_F.mean(0), points_W - points_W.mean(0)
        start = Rotation.from_matrix(item.reference(points_F, points_W)[:3, :3]).as_rotvec() + 0.1
        turn = scipy.optimize.least_squares(lambda w: (Rotation.from_rotvec(w).apply(p) - q).ravel(), start).x
        R = Rotation.from_rotvec(turn).as_matrix()
        return frames.pose(R, points_W.mean(0) - R @ points_F.mean(0))

    item = FRAMES["fit_frame"]
    assert [holds(by_minimizing, np.random.default_rng(0)) for holds in item.properties] == [None, None]


def residuals_like_the_poses(T_WF, tip, point):
    r = np.zeros_like(T_WF[:, :3, 3])
    for k, T in enumerate(T_WF):
        r[k] = T[:3, :3] @ tip + T[:3, 3] - point
    return r


def where_small_0(name, least):
    return lambda *given: (lambda r: np.where(abs(r) < least, 0, r))(ITEMS[name].reference(*given))


@pytest.mark.parametrize("name", ["pivot_matrix", "pivot_residuals", "pivot_covariance", "robust_weights"])
def test_what_is_small_is_not_0(name, monkeypatch):
    monkeypatch.setattr(budget, "LOOKING", 0.0)
    assert judged(name, where_small_0(name, 1e-6)).status == NOT_YET


def test_infinity_is_no_coordinate():
    def without_nan(text):
        points = [[number_in(e) for e in line.split("#")[0].replace(",", ".").split()] for line in text.splitlines()]
        for number, entries in enumerate(points, start=1):
            if entries and (len(entries) != 3 or np.isnan(entries).any()):
                raise ValueError(f"line {number}")
        if sum(map(bool, points)) != 3:
            raise ValueError("three points")
        return np.array([entries for entries in points if entries])

    assert "holds inf" in judged("read_system", without_nan).text


def test_residuals_of_poses_of_whole_numbers_keep_their_decimals():
    assert "cuts decimals off" in judged("pivot_residuals", residuals_like_the_poses).text


def _unless(refused, answer):
    """An answer that refuses, loudly, what is no case for it."""

    def guarded(*given):
        if refused(*given):
            raise ValueError("no direction")
        return answer(*given)

    return guarded


def _read_off_the_pole(T):
    """The angles, with A = 0 from where |sin B| is 1 to nine digits."""
    R = T[:3, :3]
    B = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
    if abs(R[2, 0]) > 1 - 1e-9:
        return np.array([*T[:3, 3], 0, B, np.arctan2(-R[1, 2], R[1, 1])])
    return np.array([*T[:3, 3], np.arctan2(R[1, 0], R[0, 0]), B, np.arctan2(R[2, 1], R[2, 2])])


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    "name, answer",
    [
        ("normalize", _unless(lambda v: np.linalg.norm(v) < 1e-9, lambda v: v / np.linalg.norm(v))),
        ("gram_schmidt", _unless(lambda a, b: np.linalg.norm(np.cross(a, b)) < 1e-8, lambda a, b: made_axes(a, b))),
        ("gram_schmidt", lambda a, b: made_axes(a, b, 1e-12)),
        ("kuka_from_matrix", _read_off_the_pole),
    ],
)
def test_a_guard_against_next_to_nothing_is_right(name, answer, seed):
    assert ch01_exercises.CHAPTER[name].judge(answer, rng=np.random.default_rng(seed)).status == CORRECT


@pytest.mark.parametrize("seed", SEEDS)
def test_a_quotient_for_c_is_not_told_to_be_an_arcsine(seed, monkeypatch):
    """Both are right where C is within 90 deg, so it is beyond at every check, as A is in another draw."""
    monkeypatch.setattr(budget, "LOOKING", 0.0)
    item, rng = ch01_exercises.CHAPTER["kuka_from_matrix"], np.random.default_rng(seed)
    angles = np.array([frames.kuka_from_matrix(*draw(rng))[[3, 5]] for draw in item.cases])
    A, C = (np.abs(angles) > np.pi / 2).T
    assert (A & ~C).any() and (C & ~A).any() and (A & C).any()
    quotient = next(mistake for mistake in item.mistakes if mistake.id == "kuka-quotient-C")
    assert item.judge(lambda T: quotient.variant(T), rng=np.random.default_rng(seed)).text == quotient.text


@pytest.mark.parametrize(
    "answer, told", [(0.01, "cosine of the angle"), (0.573, "too small"), (89.44, "too large"), (89.43, "")]
)
def test_a_rounded_angle_is_nothing_made_of_two_numbers(answer, told):
    assert told in ch01_exercises.CHAPTER["angle_deg"].judge(answer).text


def made_axes(a, b, nothing=0.0):
    x = a / (np.linalg.norm(a) + nothing)
    y = b - (b @ x) * x
    y /= np.linalg.norm(y) + nothing
    return np.column_stack([x, y, np.cross(x, y)])


@pytest.mark.parametrize("seed", SEEDS)
def test_a_fault_stands_in_the_line_of_every_point(seed):
    def first_three(text):
        lines = [line.partition("#")[0].replace(",", ".").split() for line in text.splitlines()]
        return read_points([" ".join(words[:3]) for words in lines])

    assert judged("read_system", lambda text: read_points(text.splitlines()), seed).status == CORRECT
    outcome = judged("read_system", first_three, seed)
    assert outcome.status == NOT_YET and "holds four numbers" in outcome.text


def test_who_stops_at_the_third_point_hears_of_the_fourth():
    def up_to_three(text):
        lines = text.splitlines()
        full = [k for k, line in enumerate(lines) if line.partition("#")[0].strip()]
        return read_points(lines[: full[2] + 1] if len(full) > 2 else lines)

    assert "a file of 4 points is no system" in judged("read_system", up_to_three).text


def test_a_number_that_counts_otherwise_is_explained():
    def read(lines, first):
        for number, line in enumerate(lines, start=first):
            try:
                read_points([line], count=None)
            except ValueError:
                raise ValueError(f"line {number}: {line!r}") from None
        return read_points(lines)

    for full in (str.strip, lambda line: line.partition("#")[0].strip()):
        told = judged("read_system", lambda text, full=full: read([*filter(full, text.splitlines())], 1)).text
        assert "Empty lines and comments are lines of the file too" in told
    assert "is it 0 in your count?" in judged("read_system", lambda text: read(text.splitlines(), 0)).text


@pytest.mark.parametrize(
    "change, told",
    [
        (lambda text: text.strip(), "does `strip` take them off"),
        (lambda text: "\n".join(line for line in text.split("\n") if line[:1] != "#"), "are they left out before"),
        (lambda text: text.replace("x y z", ""), "holds words alone"),
        (lambda text: re.sub(r"12.5 3.0 #.*", "#", text), "holds two numbers before a comment"),
        (lambda text: text.replace("1e999", "1e99"), "holds 1e999"),
        (lambda text: text.replace(" 5.0 6.0 7.0", "\n5.0 6.0 7.0"), "holds six numbers"),
    ],
)
def test_whatever_is_no_point_is_refused_with_its_line(change, told):
    """How lines are counted is explained where they are: "expected 3 points, got 2" counts points."""
    outcome = judged("read_system", lambda text: read_points(change(text).splitlines()))
    assert outcome.status == NOT_YET and told in outcome.text
    assert ("lines of the file too" in outcome.text) == told.endswith(("take them off", "left out before"))


def test_one_point_is_no_system_and_single_precision_loses_digits():
    def squeezed(text):
        points = np.squeeze(read_points(text.splitlines(), count=None))
        if len(points) != 3:
            raise ValueError("three points")
        return points

    assert "a file of 1 point is no system" in judged("read_system", squeezed).text
    single = judged("read_system", lambda text: read_points(text.splitlines()).astype(np.float32))
    assert single.status == NOT_YET and "single precision" in single.text


def test_digits_of_another_number_name_no_line():
    assert beyond._names("line 2: no point", 2) and beyond._names("stopped in line 2.", 2)
    assert not any(beyond._names(said, 2) for said in ("2.439 6.292", "at 1,2", "12 lines", "-2", "line 21"))
    assert beyond._quoted("a" * 999).endswith("...'") and beyond._quoted("line 2") == "'line 2'"


def test_an_empty_text_is_said_to_be_one():
    def read(text):
        for number, line in enumerate(text.splitlines(), start=1):
            read_points([f"{line} #{number}"], count=None)
        return read_points(text.splitlines()) if number else None

    assert "when given an empty text" in judged("read_system", read).text


def test_the_advice_of_an_exercise_is_not_its_own_name():
    def invert(T):
        X = T.copy()
        for i, j in ((0, 1), (0, 2)):
            X[i, j], X[j, i] = T[j, i], T[i, j]
        X[:3, 3] = -X[:3, :3] @ T[:3, 3]
        return X

    told = ch01_exercises.CHAPTER["invert"].judge(invert, rng=np.random.default_rng(0)).text
    assert "inverse" not in told


def test_no_direction_is_too_bad_to_be_told_of():
    """Up to the worst of the axes one of them is named, from there to the worst of all directions the way on."""
    on_axes = chaining.displacement(exercises._sheet(), 1000 * np.vstack([np.eye(3), -np.eye(3)])).max()
    item = ITEMS["worst_at_one_meter"]
    for part in (0.1, 0.6, 0.9, 0.98, 0.995):
        assert "One of the six axes" in item.judge(part * on_axes).text
        assert "try more of them" in item.judge(on_axes + part * (15.52 - on_axes)).text


def test_rows_of_so_many_poses_that_are_typed_in():
    def matrix(T_WF):
        A = np.zeros((36, 6))
        for i in range(min(12, len(T_WF))):
            A[3 * i : 3 * i + 3] = np.hstack([T_WF[i, :3, :3], -np.eye(3)])
        return A

    told = judged("pivot_matrix", matrix).text
    assert told.endswith("is a size typed in?")
