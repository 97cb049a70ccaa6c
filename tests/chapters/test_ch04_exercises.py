"""Answers to chapter 4 that once passed by luck, or were told something untrue."""

import functools
import math

import numpy as np
import pytest

from labkit.chapters.ch04_optimization import beyond
from labkit.chapters.ch04_optimization.exercises import CHAPTER, gradient_at_the_limit
from labkit.documents.thesis import wells
from labkit.estimation import optimization as opt
from labkit.exercises.outcome import CORRECT, NOT_YET
from tests.chapters.draws_of_a_check import SEEDS, is_missed, one_check

ITEMS = {item.id: item for item in CHAPTER.items}


def judged(name, answer, seed=0):
    return ITEMS[name].judge(answer, rng=np.random.default_rng(seed))


def kind(H):
    e = np.linalg.eigvalsh(H)
    return "minimum" if e[0] > 0 else "maximum" if e[1] < 0 else "saddle"


@functools.cache
def drawn(name, seed):
    return one_check(ITEMS[name], seed)


def is_wrong_in_a_check(name, answer, seed=0):
    with np.errstate(all="ignore"):
        return any(is_missed(answer, *case) for case in drawn(name, seed))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_slope_is_looked_at_before_the_kind(seed):
    def saddle_first(g, H):
        return "saddle" if kind(H) == "saddle" else "not stationary" if np.linalg.norm(g) > 1e-6 else kind(H)

    outcome = judged("classify_extremum", saddle_first, seed)
    assert outcome.status == NOT_YET and 'you say "saddle", whatever g is' in outcome.text


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    "moves, words",
    [
        (lambda g: g @ g > 1e-6, "square of the length"),
        (lambda g: (abs(g) > 1e-6).any(), "both entries just below 1e-6"),
        (lambda g: np.sqrt(np.mean(g**2)) > 1e-6, "both entries just below 1e-6"),
        (lambda g: np.linalg.norm(g) > 1e-3, "limit"),
        (lambda g: np.linalg.norm(g) > 0.1, "limit"),
    ],
)
def test_the_limit_is_the_stated_one(moves, words, seed):
    outcome = judged("classify_extremum", lambda g, H: "not stationary" if moves(g) else kind(H), seed)
    assert outcome.status == NOT_YET and words in outcome.text


def test_break_it_shows_two_answers_also_to_whoever_has_not_solved_it():
    """Out on the plain |g| < 1e-6, so the stated rule speaks of a kind, and the library's does not."""
    run = wells.run("newton", (3.0, 3.0))
    g, H = wells.gradient(run.solution), wells.hessian(run.solution)
    assert ITEMS["classify_extremum"].reference(g, H) == "saddle"
    assert opt.classify_extremum(g, H) == "not stationary"


@pytest.mark.parametrize("seed", SEEDS)
def test_a_damped_step_is_not_wired_to_two_unknowns(seed):
    def two(r, J, damping):
        (a, b), (_, d) = J.T @ J + damping * np.eye(2)
        p, q = -J.T @ r
        return np.array([d * p - b * q, a * q - b * p]) / (a * d - b * b)

    assert judged("damped_step", two, seed).status != CORRECT
    outcome = judged("damped_step", lambda r, J, damping: np.linalg.lstsq(J, -r, rcond=None), seed)
    assert outcome.status == NOT_YET and "[0]" in outcome.text


@pytest.mark.parametrize("seed", SEEDS)
def test_the_leg_taken_backward_is_no_matter_of_the_root_alone(seed):
    def backward(g, B, radius):
        newton, corner = np.linalg.solve(B, -g), -(g @ g) / (g @ B @ g) * g
        if np.linalg.norm(newton) <= radius:
            return newton
        if np.linalg.norm(corner) >= radius:
            return -radius * g / np.linalg.norm(g)
        leg = corner - newton
        a, b, c = leg @ leg, corner @ leg, corner @ corner - radius**2
        return corner + (-b + np.sqrt(b * b - a * c)) / a * leg

    assert "and newton − corner for the leg" in judged("dogleg_step", backward, seed).text


@pytest.mark.parametrize("seed", SEEDS)
def test_who_compares_the_larger_entry_is_told_of_no_square(seed):
    def in_a_square(g, B, radius):
        newton = np.linalg.solve(B, -g)
        return newton if np.abs(newton).max() <= radius else beyond.bare_dogleg(g, B, radius)

    outcome = judged("dogleg_step", in_a_square, seed)
    assert outcome.status == NOT_YET and "square" not in outcome.text


@pytest.mark.parametrize("seed", SEEDS)
def test_the_square_of_a_length_is_never_a_length(seed):
    def squares(g, B, radius):
        newton = np.linalg.solve(B, -g)
        if newton @ newton <= radius:
            return newton
        return opt.dogleg_step(g, B, radius)

    assert judged("dogleg_step", squares, seed).status == NOT_YET


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("h", [1e-5, 1e-6])
def test_differences_are_a_right_way_to_a_derivative(h, seed):
    def by_differences(function):
        return lambda x: np.stack([(function(x + e) - function(x - e)) / (2 * h) for e in h * np.eye(2)], axis=-1)

    assert judged("hessian", by_differences(wells.gradient), seed).status == CORRECT
    assert judged("jacobian", by_differences(wells.residual), seed).status == CORRECT


def test_what_question_2_compares():
    """J'J belongs to half of f + 300, so its partner is H / 2, and both agree where the residuals vanish."""
    deep = wells.extrema()[1].x
    J, H = wells.jacobian(deep), wells.hessian(deep)
    r = wells.residual(deep)
    assert np.isclose(r @ r, wells.value(deep) + 300)
    assert np.abs(J.T @ J - H / 2).max() < 0.05 * np.abs(H / 2).max()


@pytest.mark.parametrize("seed", SEEDS)
def test_the_loop_of_the_exercise_is_the_librarys_trust_region(seed):
    for draw in ITEMS["trust_region"].cases:
        residual, jacobian, x, radius, steps = draw(np.random.default_rng(seed))
        trace = opt.trust_region(residual, jacobian, x, radius=radius, max_iterations=steps, stop=lambda *_: "")
        found, last = beyond.trust_region(residual, jacobian, x, radius, steps)
        assert found == pytest.approx(trace.solution, abs=1e-9)
        longer = opt.trust_region(residual, jacobian, x, radius=radius, max_iterations=steps + 1, stop=lambda *_: "")
        inside = np.linalg.norm(longer.step[-1]) < 0.999 * last
        assert inside or np.linalg.norm(longer.step[-1]) == pytest.approx(last)


def test_the_bare_dogleg_is_the_librarys():
    rng = np.random.default_rng(0)
    for _ in range(50):
        n = int(rng.integers(2, 5))
        A, g = rng.normal(size=(n + 1, n)), rng.normal(size=n)
        radius = float(rng.uniform(0.05, 3))
        assert beyond.bare_dogleg(g, A.T @ A, radius) == pytest.approx(opt.dogleg_step(g, A.T @ A, radius), abs=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_gradient_by_smaller_steps_is_not_the_central_difference_asked_for(seed):
    def richardson(f, x, h):
        wide, narrow = (beyond.measured_gradient(f, x, step) for step in (h, h / 2))
        return (4 * narrow - wide) / 3

    assert judged("measured_gradient", richardson, seed).status == NOT_YET


@pytest.mark.parametrize("seed", SEEDS)
def test_a_chord_is_judged_however_it_is_walked(seed):
    def by_loop(f, x, y, n):
        rise = 0.0
        for k in range(n):
            t = k / (n - 1)
            rise = max(rise, f(x + t * (y - x)) - (f(x) + t * (f(y) - f(x))))
        return rise

    assert judged("rise_above_chord", by_loop, seed).status == CORRECT


def test_the_tipping_weight_draws_level():
    w = beyond.tipping_weight()
    assert 9 + 8 + 6 + 3 * w == pytest.approx(3 + 3 + 8 + 8 * w)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("good, grown", [(0.9, 2), (0.75, 3)])
def test_a_trust_region_follows_the_stated_rule(seed, good, grown):
    def follow(radius, length, rho):
        return length / 4 if rho < 0.25 else grown * radius if rho > good and length > 0.999 * radius else radius

    assert is_wrong_in_a_check("trust_region", beyond.loop(follow=follow), seed)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_damped_step_may_be_a_taller_least_squares_problem(seed):
    def stacked(r, J, damping):
        n = J.shape[1]
        return np.linalg.lstsq(np.vstack([J, np.sqrt(damping) * np.eye(n)]), -np.append(r, np.zeros(n)), rcond=None)[0]

    assert judged("damped_step", stacked, seed).status == CORRECT


@pytest.mark.parametrize("seed", SEEDS)
def test_a_kind_is_not_read_beside_the_diagonal(seed):
    def beside(g, H):
        if np.linalg.norm(g) > 1e-6:
            return "not stationary"
        return "saddle" if np.linalg.det(H) < 0 else "minimum" if H[0, 1] < 0 else "maximum"

    assert judged("classify_extremum", beside, seed).status == NOT_YET


@pytest.mark.parametrize("seed", SEEDS)
def test_a_step_need_not_go_straight_down(seed):
    def straight(cost, new_cost, g, B, step):
        return (cost - new_cost) / (np.linalg.norm(g) * np.linalg.norm(step) - step @ B @ step / 2)

    def of_a_positive_cost(cost, new_cost, g, B, step):
        return (abs(cost) - abs(new_cost)) / -(g @ step + step @ B @ step / 2)

    for answer in (straight, of_a_positive_cost):
        assert judged("gain_ratio", answer, seed).status == NOT_YET


@pytest.mark.parametrize(
    "place, words",
    [
        (wells.extrema()[0].x + 1e-8, "That is a minimum, or within a hundredth of one"),
        (wells.extrema()[1].x - 1e-5, "That is a minimum, or within a hundredth of one"),
        (np.array([3e4, -2e4]), "far out on the plain"),
        (np.array([0.0, 0.0]), "There the gradient is 11.1 long. At a saddle it vanishes, and one is near"),
        (np.array([0.16, -0.26]), "and one is near: a few of Newton's steps from there end in it."),
        (np.array([-0.16904684, -0.75357026]), "t runs from (1, 1) to (−1, −2)"),
        (wells.extrema()[1].x, "A search downhill ends in a well"),
    ],
)
def test_a_place_where_the_gradient_vanishes_is_told_to_be_no_saddle_by_its_kind(place, words):
    assert words in judged("saddle", place).text


def test_of_a_run_no_part_has_a_slip_of_its_own():
    """Where it ends follows from the radius, and the other way round."""
    half, fixed = (
        beyond.loop(follow=lambda radius, length, rho: length / 2 if rho < 0.25 else beyond.rule(radius, length, rho)),
        beyond.loop(follow=lambda radius, length, rho: radius),
    )
    assert judged("trust_region", half).mistake is not None and judged("trust_region", fixed).mistake is not None
    assert judged("trust_region", lambda *given: (half(*given)[0], fixed(*given)[1])).mistake is None


def test_of_few_small_numbers_a_simple_ratio_is_told_and_no_slip():
    assert judged("tipping_weight", 2.4).text == "your value is 4/3 times the expected one."


def test_one_step_toward_the_saddle_is_not_the_saddle():
    x = np.array([0.105, -0.205])
    step = opt.newton_step(wells.gradient(x), wells.hessian(x))
    text = judged("saddle", x + step).text
    assert text.startswith("There the gradient is 0.0435 long. At a saddle it vanishes, and one is near: a few of")
    assert judged("saddle", np.array([0.169, -0.246])).status == CORRECT


@pytest.mark.parametrize("seed", SEEDS)
def test_a_chord_has_two_places_at_least(seed):
    def between(f, x, y, n):
        rises = [f(x + t * (y - x)) - f(x) - t * (f(y) - f(x)) for t in np.linspace(0, 1, max(n, 3))]
        return max(rises)

    outcome = judged("rise_above_chord", between, seed)
    assert outcome.status == NOT_YET and "both ends alone" in outcome.text


def of_two_unknowns_at_least(f, x, h):
    return np.array([(f(x + e) - f(x - e)) / (2 * h) for e in h * np.eye(max(2, len(x)))])


def of_more_residuals(r, J, damping):
    m, n = J.shape
    return np.linalg.solve(J.T @ J + damping * np.eye(n) * (m > n), -J.T @ r)


def of_a_bent_path(g, B, radius):
    return beyond.bare_dogleg(g, B, radius) * (2 if B[0, 1] == 0 else 1)


@pytest.mark.parametrize(
    "name, answer",
    [
        ("measured_gradient", of_two_unknowns_at_least),
        ("damped_step", of_more_residuals),
        ("dogleg_step", of_a_bent_path),
    ],
)
def test_one_unknown_as_many_residuals_and_a_straight_path_are_drawn(name, answer):
    assert judged(name, answer).status != CORRECT


def one_round_at_least(residual, jacobian, x, radius, steps):
    return beyond.descend(residual, jacobian, x, radius, max(steps, 1))


def by_eigenvectors(g, H):
    """By eigenvectors (b, w - a), which are nothing where H is diagonal."""
    if H[0, 1] == 0:
        return np.zeros(2)
    w = np.linalg.eigvalsh(H)
    V = np.array([[H[0, 1], k - H[0, 0]] for k in w])
    return -sum((v @ g) / (v @ v) / k * v for v, k in zip(V, w))


def of_a_model_that_bends_up(cost, new_cost, g, B, step):
    return (cost - new_cost) / -(g @ step + abs(step @ B @ step) / 2)


@pytest.mark.parametrize(
    "name, answer",
    [
        ("trust_region", one_round_at_least),
        ("newton_step", by_eigenvectors),
        ("gain_ratio", of_a_model_that_bends_up),
    ],
)
def test_no_rounds_a_diagonal_and_a_model_that_bends_down_are_drawn(name, answer):
    assert judged(name, answer).status == NOT_YET


def by_cofactors(g, H):
    (a, b), (c, d) = H
    det = a * d - b * c
    inverse = np.array([[d, b], [c, a]]) / det
    return -inverse @ g


def test_a_part_that_comes_right_is_told_though_a_special_draw_was_right_before():
    told = judged("newton_step", by_cofactors).text
    assert "`b` has the wrong sign. With this changed, entry 0 (counted from 0) comes out right, though not all" in told


def bent_by_more_than_1e_6(g, H):
    if np.linalg.norm(g) > 1e-6:
        return "not stationary"
    e = np.linalg.eigvalsh(H)
    return "minimum" if (e > 1e-6).all() else "maximum" if (e < -1e-6).all() else "saddle"


def without_a_tiny_determinant(g, H):
    return -np.linalg.pinv(H, rcond=1e-3) @ g if abs(np.linalg.det(H)) > 1e-9 else -g


def without_small_singular_values(g, H):
    return -np.linalg.pinv(H, rcond=1e-3) @ g


def of_a_promised_decrease(cost, new_cost, g, B, step):
    return (cost - new_cost) / abs(g @ step + step @ B @ step / 2)


def zero_for_tiny_promises(cost, new_cost, g, B, step):
    promised = -(g @ step + step @ B @ step / 2)
    return (cost - new_cost) / promised if abs(promised) > 1e-9 else 0.0


def without_little_damping(r, J, damping):
    return opt.damped_step(r, J, damping if damping > 1e-3 else 0.0)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    "name, answer",
    [
        ("damped_step", without_little_damping),
        ("classify_extremum", bent_by_more_than_1e_6),
        ("newton_step", without_a_tiny_determinant),
        ("newton_step", without_small_singular_values),
        ("gain_ratio", of_a_promised_decrease),
        ("gain_ratio", zero_for_tiny_promises),
    ],
)
def test_faint_curvatures_narrow_valleys_and_promised_rises_are_drawn(name, answer, seed):
    assert ITEMS[name].judge(answer, rng=np.random.default_rng(seed)).status == NOT_YET


@pytest.mark.parametrize("seed", SEEDS)
def test_a_poor_step_that_is_taken_shrinks_the_radius_in_every_check(seed):
    assert is_wrong_in_a_check("trust_region", beyond.loop(follow=beyond.shrunk_where_taken_back), seed)


def by_direction(term):
    """What the wells bring, in which x - c is a length times a direction: it has none at the center."""

    def answer(x):
        offsets = [(w, np.linalg.norm(x - c), x - c) for w, c in zip(wells.DEPTHS, wells.CENTERS)]
        return [term(w, r * r + 1, r, d / r) for w, r, d in offsets]

    return answer


SLOPE = by_direction(lambda w, q, r, u: 2 * w * r / q**2 * u)
BENDS = by_direction(lambda w, q, r, u: 2 * w / q**2 * np.eye(2) - 8 * w * r * r / q**3 * np.outer(u, u))
BLOCKS = by_direction(lambda w, q, r, u: np.sqrt(w / q) * (np.eye(2) - r * r / q * np.outer(u, u)))


def at_the_limit(g, H):
    return "not stationary" if math.hypot(*g) >= 1e-6 else kind(H)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    "name, answer",
    [
        ("gradient", lambda x: sum(SLOPE(x))),
        ("hessian", lambda x: sum(BENDS(x))),
        ("jacobian", lambda x: np.vstack(BLOCKS(x))),
        pytest.param("classify_extremum", at_the_limit, marks=pytest.mark.skipif(
            np.linalg.norm([1e-6, 0]) != 1e-6, reason="the norm along an axis is rounded here")),
        ("trust_region", beyond.loop(follow=lambda radius, length, rho: (
            length / 4 if rho < 0.25 else 2 * radius if rho > 0.75 and length > 0.98 * radius else radius))),
        ("trust_region", beyond.loop(follow=lambda radius, length, rho: (
            length / 4 if rho < 0.25 else 2 * radius if rho > 0.75 and length >= radius else radius))),
        ("trust_region", beyond.loop(follow=lambda radius, length, rho: beyond.rule(radius, length, rho, good=0.7))),
        ("trust_region", beyond.loop(follow=lambda radius, length, rho: beyond.rule(radius, length, rho, poor=0.3))),
    ],
)  # fmt: skip
def test_limits_and_centers_are_met_in_every_check(name, answer, seed):
    assert is_wrong_in_a_check(name, answer, seed)


@pytest.mark.parametrize("which", ["newton", "corner"])
def test_a_square_about_the_origin_is_no_trust_region(which):
    def inside(step, radius, of):
        return np.abs(step).max() <= radius if of == which else np.linalg.norm(step) <= radius

    def by_entries(g, B, radius):
        newton, corner = opt.newton_step(g, B), opt.cauchy_step(g, B, 1e9)
        if inside(newton, radius, "newton"):
            return newton
        if not inside(corner, radius, "corner"):
            return -radius * g / np.linalg.norm(g)
        leg = newton - corner
        a, b, c = leg @ leg, corner @ leg, corner @ corner - radius**2
        return corner + (-b + np.sqrt(max(b * b - a * c, 0.0))) / a * leg

    assert judged("dogleg_step", by_entries).status == NOT_YET


def test_doubling_from_one_half_on_is_not_told_of_one_quarter():
    half = beyond.loop(follow=lambda *given: beyond.rule(*given, good=0.5))
    told = judged("trust_region", half).text
    assert told and "not poor" not in told


def test_a_length_is_no_sum_of_absolute_values_at_any_check():
    def by_sum(g, H):
        return "not stationary" if np.abs(g).sum() > 1e-6 else kind(H)

    assert {judged("classify_extremum", by_sum, seed).mistake is None for seed in range(5)} == {False}


def of_plain_size(right, small=1e-3, large=1e3):
    """An answer that takes results smaller for 0, and cuts larger ones."""
    return lambda *given: np.clip(
        np.where(np.abs(value := np.asarray(right(*given))) < small, 0.0, value), -large, large
    )


def eliminated(first):
    """Newton's step by elimination, which divides by one entry of H."""
    order = [0, 1] if first == 0 else [1, 0]

    def answer(g, H):
        (a, b), (c, d) = H[np.ix_(order, order)]
        p, q = -g[order]
        y = (q - c / a * p) / (d - c / a * b)
        return np.array([(p - b * y) / a, y])[order]

    return answer


def run_of(cap=np.inf, floor=0.0, rounds=100, **changes):
    """The loop with a largest and a smallest radius, rounds at most, or with other limits."""

    def follow(radius, length, rho):
        return min(cap, max(floor, changes.get("rule", beyond.rule)(radius, length, rho)))

    keep = changes.get("keep", lambda rho: rho > 0.1)
    return lambda residual, jacobian, x, radius, steps: beyond.descend(
        residual, jacobian, x, radius, min(steps, rounds), follow=follow, keep=keep
    )


def by_forward_differences(x, h=1e-8):
    return np.array([(wells.value(x + e) - wells.value(x)) / h for e in h * np.eye(2)])


def by_the_order_of(beside):
    """Kind by eigenvalues that are taken to be sorted, though they stand as the diagonal has them: `np.linalg.eig`."""

    def variant(g, H):
        first, second = np.linalg.eigvalsh(H)[:: -1 if beside(H[0, 0], H[1, 1]) else 1]
        kind = "minimum" if first > 0 and second > 0 else "saddle" if first < 0 < second else "maximum"
        return "not stationary" if np.linalg.norm(g) > 1e-6 else kind

    return variant


def run_in_one_array(residual, jacobian, x, radius, steps):
    x = np.array(x)
    for _ in range(steps):
        r, J = residual(x), jacobian(x)
        g, B = J.T @ r, J.T @ J
        h = beyond.bare_dogleg(g, B, radius)
        x += h
        rho = opt.gain_ratio(r @ r / 2, residual(x) @ residual(x) / 2, g, B, h)
        x -= h * (rho <= 0.1)
        radius = beyond.rule(radius, np.linalg.norm(h), rho)
    return x, radius


CHORD, KIND = ITEMS["rise_above_chord"].reference, ITEMS["classify_extremum"].reference


def by_small_eigenvalues(g, H):
    """The kind with eigenvalues that are small beside the largest one left out."""
    e = np.linalg.eigvalsh(H)
    e[np.abs(e) < 1e-4 * np.abs(e).max()] = 0
    return "not stationary" if np.linalg.norm(g) > 1e-6 else by_signs(e)


def by_signs(e):
    return "minimum" if (e > 0).all() else "maximum" if (e < 0).all() else "saddle"


def in_steps(f, x, y, n):
    """The rise at places that `np.arange` counts, one too many for some n."""
    t = np.arange(0, 1 + 1 / (n - 1), 1 / (n - 1))
    return max(f((1 - s) * x + s * y) - (1 - s) * f(x) - s * f(y) for s in t)


def first_hill(f, x, y, n):
    """The rise up to where it first falls below what it was."""
    best = 0.0
    for s in np.linspace(0, 1, n):
        rise = f((1 - s) * x + s * y) - (1 - s) * f(x) - s * f(y)
        if rise < best:
            break
        best = rise if rise > 1e-9 else best
    return best


def by_inverse(r, J, damping):
    G = np.linalg.inv(J.T @ J)
    return -np.linalg.solve(np.eye(len(G)) + damping * G, G @ J.T @ r)


def from_a_unit_gradient(g, B, radius):
    length = np.linalg.norm(g)
    return length * beyond.bare_dogleg(g / length, B, radius / length)


def nearly_at_the_rim(share):
    """The dogleg with the Newton point taken where it is within so many radii."""

    def step(g, B, radius):
        newton = np.linalg.solve(B, -g)
        return newton if np.linalg.norm(newton) < share * radius else beyond.bare_dogleg(g, B, radius * min(share, 1))

    return step


FORGETFUL = [
    ("gradient", by_forward_differences),
    *(("gradient", lambda x, c=c, k=k: wells.gradient(x) * (x[k] != c[k])) for c in wells.CENTERS for k in range(2)),
    ("gradient", lambda x: np.clip(wells.gradient(x), -120, 120)),
    ("jacobian", lambda x: wells.jacobian(x) * (x[0] != 1)),
    ("hessian", lambda x: wells.hessian(x) * (x[1] != 1)),
    ("measured_gradient", lambda f, x, h: beyond.measured_gradient(f, x, h) * (x != 0)),
    ("classify_extremum", by_small_eigenvalues),
    *(
        ("classify_extremum", lambda g, H, word=word: word if KIND(0 * g, H) == word and g @ g < 1e-7 else KIND(g, H))
        for word in ("saddle", "maximum")
    ),
    ("newton_step", lambda g, H: -np.linalg.pinv(H, rcond=1e-5) @ g),
    ("rise_above_chord", in_steps),
    ("rise_above_chord", first_hill),
    ("damped_step", by_inverse),
    ("damped_step", lambda r, J, d: -np.linalg.pinv(J.T @ J + d * np.eye(J.shape[1]), rcond=1e-6) @ J.T @ r),
    ("gain_ratio", lambda *given: np.clip(opt.gain_ratio(*given), -10, 10)),
    ("dogleg_step", from_a_unit_gradient),
    ("dogleg_step", nearly_at_the_rim(0.99)),
    ("dogleg_step", nearly_at_the_rim(1.01)),
    ("trust_region", run_of(rule=beyond.no_praise_for_luck)),
    ("trust_region", lambda *given: beyond.loop(keep=lambda rho: given[-1] == 1 or rho > 0.1)(*given)),
    ("gradient", lambda x: wells.gradient(x) * (np.linalg.norm(x) < 100)),
    ("gradient", lambda x: wells.gradient(x) * (x != 0).all()),
    ("hessian", of_plain_size(wells.hessian)),
    ("jacobian", lambda x: wells.jacobian(x) * (np.linalg.norm(x) < 100)),
    ("measured_gradient", lambda f, x, h: beyond.measured_gradient(f, x, max(h, 1e-3))),
    ("measured_gradient", lambda f, x, h: beyond.measured_gradient(f, x, min(h, 0.1))),
    ("measured_gradient", lambda f, x, h: beyond.measured_gradient(f, x, h) * (np.arange(len(x)) < 5)),
    ("measured_gradient", of_plain_size(beyond.measured_gradient)),
    ("classify_extremum", lambda g, H: KIND(g, H) if g.any() else "not stationary"),
    ("classify_extremum", lambda g, H: KIND(g, H) if np.ptp(np.linalg.eigvalsh(H)) > 1e-9 else "saddle"),
    ("classify_extremum", lambda g, H: KIND(g, H) if np.abs(H).max() > 1e-10 else "saddle"),
    ("classify_extremum", by_the_order_of(np.greater)),
    ("classify_extremum", by_the_order_of(np.less)),
    ("newton_step", eliminated(0)),
    ("newton_step", eliminated(1)),
    ("newton_step", of_plain_size(opt.newton_step, small=0)),
    ("newton_step", lambda g, H: np.linalg.norm(g) * np.linalg.solve(H, -g / np.linalg.norm(g))),
    ("rise_above_chord", lambda f, x, y, n: CHORD(f, x, y, min(n, 50))),
    ("rise_above_chord", lambda f, x, y, n: CHORD(f, x, y, n) * (n != 3)),
    ("rise_above_chord", lambda f, x, y, n: CHORD(f, x, y, n) * (len(x) > 1)),
    ("rise_above_chord", of_plain_size(CHORD)),
    ("rise_above_chord", lambda f, x, y, n: CHORD(f, x, y, n) / (x != y).any()),
    ("damped_step", lambda r, J, damping: opt.damped_step(r, J, damping * (damping > 1e-5))),
    ("damped_step", lambda r, J, damping: opt.damped_step(r, J, min(damping, 1e5))),
    ("damped_step", lambda r, J, damping: opt.damped_step(r[:20], J[:20], damping)),
    ("damped_step", lambda r, J, damping: opt.damped_step(r, J, damping) * (J.size > 1)),
    ("gain_ratio", lambda *given: min(opt.gain_ratio(*given), 1.0)),
    ("gain_ratio", lambda *given: max(opt.gain_ratio(*given), -2.0)),
    ("gain_ratio", lambda *given: opt.gain_ratio(*given) if given[0] != given[1] else 1.0),
    ("gain_ratio", lambda *given: opt.gain_ratio(*given) if abs(given[0]) < 1e4 else 0.0),
    ("gain_ratio", lambda *given: opt.gain_ratio(*given) if given[2].any() else 0.0),
    ("dogleg_step", lambda g, B, radius: beyond.bare_dogleg(g, B, max(radius, 1e-3))),
    ("dogleg_step", lambda g, B, radius: beyond.bare_dogleg(g, B, min(radius, 1e3))),
    ("dogleg_step", lambda g, B, radius: beyond.bare_dogleg(g, B, radius) * (B[0, 1] != 0)),
    ("dogleg_step", lambda g, B, radius: beyond.bare_dogleg(g, B, radius) * g.all()),
    ("trust_region", run_in_one_array),
    ("trust_region", run_of(cap=1e3)),
    ("trust_region", run_of(floor=1e-3)),
    ("trust_region", run_of(rounds=20)),
    ("trust_region", run_of(keep=lambda rho: rho > 0.15)),
    ("trust_region", run_of(rule=lambda *given: beyond.rule(*given, good=0.8))),
    ("trust_region", run_of(rule=lambda *given: beyond.rule(*given, poor=0.2))),
]  # fmt: skip


@pytest.mark.parametrize("name, answer", FORGETFUL, ids=[f"{name}-{k}" for k, (name, _) in enumerate(FORGETFUL)])
def test_what_the_docstring_admits_is_drawn_in_every_check(name, answer):
    assert is_wrong_in_a_check(name, answer)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("limit", [1e-8, 5e-7, 7e-7])
def test_a_smaller_limit_is_told_and_no_length_is_an_angle(limit, seed):
    outcome = judged("classify_extremum", lambda g, H: "not stationary" if np.linalg.norm(g) > limit else kind(H), seed)
    assert "your limit is smaller than the stated one" in outcome.text


@pytest.mark.parametrize(
    ("rounded", "asked"), [(1e-6, 1e-6), (np.nextafter(1e-6, 1), 0.0), (np.nextafter(1e-6, 0), 0.0)]
)
def test_no_length_at_the_limit_is_asked_where_the_norm_rounds(monkeypatch, rounded, asked):
    monkeypatch.setattr(np.linalg, "norm", lambda v: rounded)
    assert np.abs(gradient_at_the_limit(np.random.default_rng(0))[0]).max() == asked


def without_small_slopes(x):
    g = np.zeros(2)
    for w, c in ((100.0, [1, 1]), (200.0, [-1, -2])):
        d = x - np.array(c)
        g = g + 2 * w / (d @ d + 1) ** 2 * d
    g[np.abs(g) < 1e-3] = 0
    return g


def test_a_bound_beside_the_largest_entry_is_no_matter_of_the_gradient():
    def by_a_bound(g, H):
        if np.linalg.norm(g) > 1e-6:
            return "not stationary"
        s = np.linalg.eigvalsh(H / np.abs(H).max())
        return "minimum" if s[0] > 1e-6 else "maximum" if s[1] < -1e-6 else "saddle"

    told = judged("classify_extremum", by_a_bound)
    assert told.status == NOT_YET and "divided by" not in told.text and "its mean" not in told.text, told.text


def test_what_sets_small_slopes_to_zero_may_be_needless():
    assert "if this case is needed at all" in judged("gradient", without_small_slopes).text
