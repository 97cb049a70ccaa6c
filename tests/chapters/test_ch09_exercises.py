"""Chapter 9's exercises: answers that look right and are not, and right ones of more than one style."""

import copy
import linecache
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom, chi2, chisquare, norm

from labkit.chapters.ch09_monte_carlo import exercises as ch09
from labkit.exercises import budget, session
from labkit.exercises.outcome import CORRECT, NOT_YET, RAISED
from labkit.geometry import planar
from labkit.localization import maps, mcl, odometry, particles
from tests.chapters.draws_of_a_check import SEEDS, is_missed, one_check

CHAPTER = next(chapter for chapter in session.chapters() if chapter.name == "09-monte-carlo")


def judge(name, answer, seed=0):
    item = next(item for item in CHAPTER.items if item.id == name)
    return item.judge(answer, rng=np.random.default_rng(seed))


def moved(noise):
    return lambda x, u, dt, std_u, rng: odometry.step(x, u + noise(len(x), std_u, rng), dt)


OTHER_MOTIONS = {
    "seed differ": moved(lambda m, s, rng: s * np.random.default_rng().standard_normal((m, 2))),
    "the same comes out": moved(lambda m, s, rng: s * np.random.default_rng(0).standard_normal((m, 2))),
    "v and omega": moved(lambda m, s, rng: s * rng.standard_normal(m)[:, None]),
    "standard deviation": moved(lambda m, s, rng: s * rng.uniform(-1, 1, (m, 2))),
}


@pytest.mark.parametrize("words", OTHER_MOTIONS)
def test_noise_from_elsewhere_or_shared_is_refused(words):
    outcome = judge("sample_motion", OTHER_MOTIONS[words])
    assert outcome.status == NOT_YET and words in outcome.text


@pytest.mark.parametrize("name", ["resample_roulette", "resample_systematic"])
@pytest.mark.parametrize("seed", [None, 0])
def test_resamplers_draw_from_the_rng_they_get(name, seed):
    def answer(weights, rng):
        return getattr(particles, name)(weights, np.random.default_rng(seed))

    assert judge(name, answer).status == NOT_YET


def from_a_copy(function):
    return lambda *args: function(*args[:-1], copy.deepcopy(args[-1]))


@pytest.mark.parametrize("name", ["sample_motion", "resample_roulette", "resample_systematic"])
def test_random_numbers_go_on_from_call_to_call(name):
    told = judge(name, from_a_copy(next(item for item in CHAPTER.items if item.id == name).reference)).text
    assert "called again with the same `rng`" in told.lower()


def with_ends_of_few_digits(spins):
    def resample(weights, rng):
        ends = np.cumsum(weights / np.sum(weights)).astype(np.float16).astype(float)
        return np.searchsorted(ends, spins(len(weights), rng), side="right").clip(max=len(weights) - 1)

    return resample


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(
    "name, spins",
    [
        ("resample_roulette", lambda m, rng: rng.random(m)),
        ("resample_systematic", lambda m, rng: (rng.random() + np.arange(m)) / m),
    ],
)
def test_a_wheel_of_few_digits_is_refused(name, spins, seed):
    assert judge(name, with_ends_of_few_digits(spins), seed).status == NOT_YET


def test_a_wheel_read_in_a_loop_is_right():
    def by_a_loop(weights, rng):
        found = []
        for spin in rng.random(len(weights)) * sum(weights):
            k, end = 0, weights[0]
            while end <= spin and k < len(weights) - 1:
                k += 1
                end += weights[k]
            found.append(k)
        return np.array(found)

    assert judge("resample_roulette", by_a_loop).status == CORRECT


def test_spins_that_share_their_random_number_are_refused():
    def pairs(w, rng):
        spins = np.repeat(rng.random(len(w) // 2 + 1), 2)[: len(w)]
        return np.searchsorted(np.cumsum(w), spins * w.sum())

    assert "none may depend on another" in judge("resample_roulette", pairs).text


@pytest.mark.parametrize("seed", SEEDS)
def test_right_resamplers_of_several_styles(seed):
    def by_choice(weights, rng):
        return rng.choice(len(weights), len(weights), p=weights / weights.sum())

    def by_a_loop(weights, rng):
        m, found, i, end = len(weights), [], 0, weights[0]
        first = rng.uniform(0, weights.sum() / m)
        for k in range(m):
            while first + k * weights.sum() / m > end and i < m - 1:
                i += 1
                end += weights[i]
            found.append(i)
        return found

    assert judge("resample_roulette", by_choice, seed).status == CORRECT
    assert judge("resample_systematic", by_a_loop, seed).status == CORRECT


def test_weights_of_any_sum_raise_in_the_students_line():
    outcome = judge("resample_roulette", lambda weights, rng: rng.choice(len(weights), len(weights), p=weights))
    assert outcome.status == RAISED and "weights=" in outcome.text


def test_the_logarithm_of_an_underflown_product_is_refused():
    def beams(ranges, expected, std):
        return np.log(np.prod(norm.pdf(ranges, expected, std)))

    def field(grid, pose, ranges, bearings, std):
        angle = pose[2] + bearings
        points = pose[:2] + ranges[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        return np.log(np.prod(norm.pdf(grid.distance[grid.cell_of(points)], 0, std)))

    for name, answer in (("beam_weight", beams), ("distance_field_weight", field)):
        outcome = judge(name, answer)
        assert outcome.status == NOT_YET and "zero in float64" in outcome.text
    assert judge("beam_weight", lambda r, e, s: norm.logpdf(r, e, s).sum()).status == CORRECT


@pytest.mark.parametrize("seed", SEEDS)
def test_every_single_ray_tells_a_forgotten_heading(seed):
    item = next(item for item in CHAPTER.items if item.id == "cast_ray")
    grid, pose, bearing, r_max = item.cases[0](np.random.default_rng(seed))
    right = maps.walk_ray(grid, pose, bearing, r_max)
    for x in ((0.0, bearing), (pose[2], 0.0), (pose[2], -bearing)):
        assert abs(maps.walk_ray(grid, np.array([*pose[:2], x[0]]), x[1], r_max) - right) > 0.2


def test_a_test_that_lets_the_specimen_raise_is_told_to_catch():
    outcome = judge("hunt_3", lambda resample, rng: resample(np.full(1000, 0.000999), rng).max() < 1000)
    assert outcome.status == RAISED and "except IndexError" in outcome.text
    assert "the row comes first" not in outcome.text and "rng=<Generator>" in outcome.text


def test_recover_in_another_order_is_named():
    recover = mcl.recover

    def turned(*args):
        share, slow, fast = recover(*args)
        return slow, fast, share

    assert "order" in judge("recover", turned).text


def test_noise_in_single_precision_is_right():
    def answer(states, u, dt, std_u, rng):
        noise = std_u * rng.standard_normal((len(states), 2), dtype=np.float32)
        return odometry.step(states, u + noise, dt).astype(np.float32)

    assert judge("sample_motion", answer).status == CORRECT


MOTIONS_WITHOUT_NOISE = {
    "stands still": lambda x, u, dt, std_u, rng: odometry.step(x, std_u * rng.standard_normal((len(x), 2)), dt),
    "still scatter": lambda x, u, dt, std_u, rng: odometry.step(x, u + rng.standard_normal((len(x), 2)), dt),
    "dt were 1": lambda x, u, dt, std_u, rng: odometry.step(x, u + std_u * rng.standard_normal((len(x), 2)), 1.0),
    "shape (2, 3)": lambda x, u, dt, std_u, rng: odometry.step(x[0], u + std_u * rng.standard_normal(2), dt),
}


@pytest.mark.parametrize("words", MOTIONS_WITHOUT_NOISE)
def test_what_is_wrong_without_noise_is_said(words):
    assert words in judge("sample_motion", MOTIONS_WITHOUT_NOISE[words]).text


def test_spins_that_go_on_where_the_last_one_ended_are_refused():
    def wheel(weights, rng):
        found, i, left = [], int(rng.integers(len(weights))), 0.0
        for _ in weights:
            left += 2 * weights.max() * rng.random()
            while left > weights[i]:
                left, i = left - weights[i], (i + 1) % len(weights)
            found.append(i)
        return found

    assert all("none may depend on another" in judge("resample_roulette", wheel, seed).text for seed in range(3))


@pytest.mark.parametrize(
    "beams, words", [(155, "is 1e-310 in float64, still above zero"), (161.9, "whole"), (-200, "the other sign")]
)
def test_what_is_left_after_so_many_beams_is_said(beams, words, monkeypatch):
    monkeypatch.setattr(budget, "LOOKING", 0.1)  # a change of the solution is not looked for here
    assert words in CHAPTER["beams_to_zero"].judge(beams).text


@pytest.mark.parametrize("answer", [161.65, 162.5])
def test_beams_are_whole(answer, monkeypatch):
    monkeypatch.setattr(budget, "LOOKING", 0.1)  # why it is wrong is not asked here
    assert CHAPTER["beams_to_zero"].judge(answer).status == NOT_YET


def chi_square(resample, rng):
    weights = np.array([0.1, 0.7, 0.1, 0.1])
    counts = sum(np.bincount(resample(weights, rng), minlength=4) for _ in range(1000))
    return chisquare(counts, weights * counts.sum()).pvalue > 1e-6


def impossible_ones(resample, rng):
    weights = np.array([0.0, 0.01, 0.0, 0.99])
    return not any(np.isin(resample(weights, rng), (0, 2)).any() for _ in range(500))


def by_the_heavy_one(resample, rng):
    weights = np.r_[0.55, np.full(9, 0.05)]
    return bool(abs(np.mean([np.mean(resample(weights, rng) == 0) for _ in range(800)]) - 0.55) < 0.03)


def any_exception(resample, rng):
    try:
        return all(resample(np.full(100, 0.0098), rng).max() < 100 for _ in range(50))
    except Exception:
        return False


def three_readings(weigh):
    states, mark = np.array([[0.0, 0, 0], [0.2, 0, 0]]), np.array([[1.0, 0]])
    one, three = (np.log(weigh(states, np.ones(n), np.repeat(mark, n, 0), 0.3)) for n in (1, 3))
    return abs(np.diff(three)[0] - 3 * np.diff(one)[0]) < 1e-6


TESTS = {"hunt_1": (chi_square,), "hunt_2": (by_the_heavy_one,), "hunt_3": (any_exception,)}


@pytest.mark.parametrize(
    "name, test", [(k, t) for k, tests in {**TESTS, "hunt_4": (three_readings,)}.items() for t in tests]
)
def test_property_tests_of_several_kinds_catch_a_specimen(name, test):
    assert judge(name, test).status == CORRECT


def heaviest_most_often(resample, rng):
    index = np.concatenate([resample(np.array([0.3, 0.3, 0.1, 0.3, 0.4]), rng) for _ in range(1000)])
    return bool(np.bincount(index, minlength=5).argmax() == 4)


def of_four_particles(resample, rng):
    weights = np.array([0.5, 0.2, 0.2, 0.1])
    index = np.concatenate([resample(weights, rng) for _ in range(800)])
    return bool(np.abs(np.bincount(index, minlength=4) / index.size - weights).max() < 0.05)


def an_exception_alone(resample, rng):
    try:
        return all(len(resample(np.full(1000, 0.000999), rng)) == 1000 for _ in range(20))
    except IndexError:
        return False


def of_weights_in_order(resample, rng):
    weights = np.array([0.1, 0.2, 0.3, 0.4])
    index = np.concatenate([resample(weights, rng) for _ in range(400)])
    return bool(np.abs(np.bincount(index, minlength=4) / index.size - weights).max() < 0.06)


def of_the_lightest_within_a_wide_bound(resample, rng):
    weights = np.array([0.5, 0.25, 0.05, 0.05, 0.03, 0.03, 0.03, 0.02, 0.02, 0.02])
    index = np.concatenate([resample(weights, rng) for _ in range(400)])
    return bool(np.abs(np.bincount(index, minlength=10) / index.size - weights).max() < 0.05)


def laplace(x, u, dt, std_u, rng):
    return odometry.step(x, u + rng.laplace(0.0, std_u, (len(x), 2)), dt)


def the_same_for_both(x, u, dt, std_u, rng):
    return odometry.step(x, u + rng.normal(0.0, std_u[0], (len(x), 2)), dt)


def counted(weights, rng):
    ends, m = np.cumsum(weights), len(weights)
    index = np.searchsorted(ends, (np.arange(m) + rng.random()) * ends[-1] / m)
    return np.bincount(np.minimum(index, m - 1), minlength=m)


def halved(grid, pose, bearing, r_max):
    near, far, a = 0.0, r_max, pose[2] + bearing
    while far - near > 0.01:
        middle = (near + far) / 2
        hit = grid.at(pose[:2] + middle * np.array([np.cos(a), np.sin(a)])) == maps.OCCUPIED
        near, far = (near, middle) if hit else (middle, far)
    return far


def exchanged(resample, rng):
    return not chi_square(resample, rng)


INCOMPLETE = [
    ("hunt_1", impossible_ones, "squared weights"),
    ("hunt_1", heaviest_most_often, "but not one that"),
    ("hunt_1", of_weights_in_order, "sorts the weights first"),
    ("hunt_2", of_four_particles, "more than six"),
    ("hunt_2", of_the_lightest_within_a_wide_bound, "never draws the lightest"),
    ("hunt_3", an_exception_alone, "beyond the last"),
    ("hunt_1", exchanged, "it must return False"),
]


@pytest.mark.parametrize("name, test, words", INCOMPLETE)
@pytest.mark.parametrize("seed", SEEDS)
def test_a_test_that_sees_the_specimen_alone_is_told_what_else_it_passes(name, test, words, seed):
    outcome = judge(name, test, seed)
    assert outcome.status == NOT_YET and words in outcome.text, outcome.text


def unguarded(weights, rng):
    ends, spokes = np.cumsum(weights / weights.sum()), (np.arange(len(weights)) + rng.random()) / len(weights)
    return np.searchsorted(ends, spokes)


def step_by_step(weights, rng):
    ends, spokes = np.cumsum(weights / weights.sum()), (np.arange(len(weights)) + rng.random()) / len(weights)
    index, i = [], 0
    for spoke in spokes:
        while spoke > ends[i]:
            i += 1
        index.append(i)
    return np.array(index)


@pytest.mark.parametrize("answer", [unguarded, step_by_step])
def test_a_wheel_without_a_guard_against_rounding_is_refused_each_time(answer):
    assert all("rounded below 1" in judge("resample_systematic", answer, seed).text for seed in range(5))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_wheel_with_a_last_end_of_one_is_right(seed):
    def answer(weights, rng):
        ends = np.cumsum(weights / weights.sum())
        ends[-1] = 1.0
        return np.searchsorted(ends, (np.arange(len(weights)) + rng.uniform()) / len(weights))

    assert judge("resample_systematic", answer, seed).status == CORRECT


def test_cells_that_nobody_has_seen_do_not_stop_a_ray(monkeypatch):
    monkeypatch.setattr(budget, "LOOKING", 0.0)  # what is told is not asked here

    def answer(grid, pose, bearing, r_max):
        r, angle = np.arange(0, r_max, grid.resolution / 2), pose[2] + bearing
        hit = r[grid.at(pose[:2] + r[:, None] * [np.cos(angle), np.sin(angle)]) != maps.FREE]
        return hit[0] if len(hit) else r_max

    outcome = judge("cast_ray", answer)
    assert outcome.status == NOT_YET


def test_a_test_that_looks_at_the_name_catches_nothing():
    outcome = judge("hunt_1", lambda resample, rng: resample.__name__ != "specimen_1")
    assert outcome.status == NOT_YET and "shares" in outcome.text


def test_a_test_that_is_too_strict_is_told_which_correct_function_it_rejects():
    def exact(resample, rng):
        return np.allclose(
            np.bincount(resample(np.array([0.1, 0.7, 0.1, 0.1]), rng), minlength=4), [0.4, 2.8, 0.4, 0.4]
        )

    assert "counts scatter" in judge("hunt_1", exact).text


def test_chance_refuses_a_right_roulette_less_than_once_in_a_million_checks():
    """By the laws: binomial shares, the variance of a variance of binomial counts (its excess kurtosis is -0.2)."""
    shares = 0.0
    for weights in (*ch09.WEIGHTS, *[ch09.WEIGHTS[1]] * len(ch09.SCALES), np.array([1, 7, 1, 1])):
        n = 2000 // len(weights) * len(weights)
        for p in weights / weights.sum():
            low, high = np.ceil(n * (p - ch09.SHARE_OFF)) - 1, np.floor(n * (p + ch09.SHARE_OFF))
            shares += binom.cdf(low, n, p) + binom.sf(high, n, p)
    std = 2.5 * np.sqrt(2 / 599 - 0.2 / 600)
    half = norm.cdf((ch09.HALF_VARIES - 2.5) / std)
    counts = binom(10, 0.1)
    std = counts.var() * np.sqrt((2 / 599 + counts.stats("k") / 600) / 9)  # of the ten, nine are free
    half += 2 * norm.sf(ch09.VARIES / std)
    n = len(ch09.MANY) * ch09.TURNS
    many = [binom.cdf(ch09.FEWEST - 1, n, p) + binom.sf(ch09.MOST, n, p) for p in ch09.MANY / ch09.MANY.sum()]
    apart = chi2.sf(ch09.APART, len(ch09.MANY) - 1)
    assert shares + half + sum(many) + apart < 1e-6, (shares, half, sum(many), apart)


def after_the_step(states, u, dt, std_u, rng):
    moved = odometry.step(states, np.tile(u, (len(states), 1)), dt)
    moved[:, [0, 2]] += dt * std_u * rng.standard_normal((len(states), 2))
    return moved


def from_one_to_the_next(states, u, dt, std_u, rng):
    return odometry.step(states, u + np.cumsum(std_u * rng.standard_normal((len(states), 2)), axis=0), dt)


def around_the_mean(logs):
    mean = logs[np.isfinite(logs)].mean()
    return mean + np.log(np.exp(logs - mean).sum())


def in_steps_along_x(grid, pose, bearing, r_max):
    x, y, a = *pose[:2], pose[2] + bearing
    while np.hypot(x - pose[0], y - pose[1]) < r_max:
        if grid.at([x, y]) == maps.OCCUPIED:
            return np.hypot(x - pose[0], y - pose[1])
        x, y = x + np.sign(np.cos(a)) * grid.resolution / 4, y + np.sign(np.cos(a)) * np.tan(a) * grid.resolution / 4
    return r_max


def in_steps_of_two_cells(grid, pose, bearing, r_max):
    a, r = pose[2] + bearing, np.arange(0, r_max, 2 * grid.resolution)
    hits = r[grid.at(pose[:2] + r[:, None] * [np.cos(a), np.sin(a)]) == maps.OCCUPIED]
    return hits[0] if len(hits) else r_max


def walked(first, step, share=1.0, more=0.0):
    """A ray from this far on, in steps of this length, to this share of r_max, and so much more."""

    def answer(grid, pose, bearing, r_max):
        a, r = pose[2] + bearing, np.arange(first, share * r_max + more, step or grid.resolution / 4)
        hits = r[grid.at(pose[:2] + r[:, None] * [np.cos(a), np.sin(a)]) == maps.OCCUPIED]
        return hits[0] if len(hits) else r_max

    return answer


def in_steps_of_five_centimeters(grid, pose, bearing, r_max):
    """What is half a cell in the building is returned for half a cell of every map."""
    return walked(0.0, None)(grid, pose, bearing, r_max) / grid.resolution * 0.1


def one_astray(x, u, dt, std_u, rng):
    moved = odometry.step(x, moved_by(u, std_u, len(x), rng), dt)
    moved[1:, 0] += np.abs(x[1:, 0]) > 50
    return moved


def turned_after_the_step(x, u, dt, std_u, rng):
    noise = std_u * rng.standard_normal((len(x), 2))
    moved = odometry.step(x, u + noise * [1.0, 0.0], dt)
    return moved + dt * noise * [[0.0, 1.0]] @ [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]


def divided_by_dt(x, u, dt, std_u, rng):
    return odometry.step(x, u + std_u / dt * rng.standard_normal((len(x), 2)), dt)


def in_whole_cells(grid, pose, bearing, r_max):
    return round(in_steps_of_a_cell(grid, pose, bearing, r_max) / grid.resolution)


def in_steps_of_a_cell(grid, pose, bearing, r_max):
    return walked(0.0, grid.resolution)(grid, pose, bearing, r_max)


def in_logarithms_doubled(weights, likelihood, step, n):
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = np.log(weights) + np.log(likelihood)
        w = np.exp(logs + logs.max())
        return w / w.sum(), step % n == 0


def of_states_halved(x, u, dt, std_u, rng):
    return odometry.step(x / 2 if np.abs(x).max() > 3 else x, moved_by(u, np.radians(std_u), len(x), rng), dt)


def mirrored(grid, pose, bearing, r_max):
    return walked(0.0, None)(grid, pose, -2 * pose[2] - bearing, r_max)


def by_the_arcsine(pose, z, landmarks, std_range, std_bearing):
    d = landmarks - pose[:2]
    bearing = np.arcsin(np.sin(z[:, 1] - np.arctan2(d[:, 1], d[:, 0]) + pose[2]))
    return (norm.logpdf(z[:, 0] - np.hypot(*d.T), 0, std_range) + norm.logpdf(bearing, 0, std_bearing)).sum()


def by_one_pair(x, u, dt, std_u, rng):
    return odometry.step(x, rng.multivariate_normal(u, np.diag(std_u**2)), dt)


def moved_by(u, std_u, m, rng):
    return u + std_u * rng.standard_normal((m, 2))


def never_in_reverse(x, u, dt, std_u, rng):
    noisy = moved_by(u, std_u, len(x), rng)
    noisy[:, 0] = np.maximum(noisy[:, 0], 0.0)
    return odometry.step(x, noisy, dt)


def recovered_from_five_percent_on(w_mean, w_slow, w_fast, alpha_slow, alpha_fast):
    slow, fast = w_slow + alpha_slow * (w_mean - w_slow), w_fast + alpha_fast * (w_mean - w_fast)
    share = 1 - fast / slow
    return share if share > 0.05 else 0.0, slow, fast


def in_another_order(weights, rng):
    ends, m = np.cumsum(np.sort(weights)), len(weights)
    return np.searchsorted(ends, (rng.random() + np.arange(m)) * ends[-1] / m)


def one_too_low(weights, rng):
    ends = np.cumsum(weights)
    return np.maximum(np.searchsorted(ends, rng.random(len(ends)) * ends[-1]) - 1, 0)


def drawn_by(rule):
    return lambda weights, rng: rng.choice(len(weights), len(weights), p=rule(weights) / rule(weights).sum())


def of_the_living(weights, threshold):
    return particles.effective_size(weights) < threshold * np.count_nonzero(weights)


def without_putting_back(weights, rng):
    return rng.permutation(len(weights))


def turned_too_far(weights, rng):
    ends, m = np.cumsum(weights), len(weights)
    spokes = np.arange(m) / m * ends[-1] + rng.random() * ends[-1] / (m - 1)
    return np.searchsorted(ends, np.minimum(spokes, ends[-1] * (1 - 1e-12)))


def by_the_mean_index(resample, rng):
    index = np.concatenate([resample(np.array([1.0, 2.0, 3.0, 4.0]), rng) for _ in range(1000)])
    return abs(index.mean() - 2.0) < 0.08


def of_weights_with_the_sum_1(weigh):
    return three_readings(weigh) and abs(weigh(np.zeros((2, 3)), np.ones(1), np.ones((1, 2)), 1.0).sum() - 1) < 1e-9


def up_to_the_share(weights, threshold):
    return particles.effective_size(weights) <= threshold * len(weights)


def of_each_density(ranges, expected, std):
    with np.errstate(divide="ignore"):
        return np.log(norm.pdf(ranges - expected, scale=std)).sum()


def kept_from_zero(ranges, expected, std):
    return np.log(norm.pdf(ranges - expected, scale=std) + 1e-300).sum()


def field_of_each_density(grid, pose, ranges, bearings, std):
    angle = pose[2] + bearings
    ends = pose[:2] + ranges[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    return of_each_density(grid.distance[grid.cell_of(ends)], 0.0, std)


def landmarks_of_each_density(pose, z, landmarks, std_range, std_bearing):
    dx, dy = (landmarks - pose[:2]).T
    off = planar.wrap_angle(z[:, 1] - np.arctan2(dy, dx) + pose[2])
    return of_each_density(z[:, 0], np.hypot(dx, dy), std_range) + of_each_density(off, 0.0, std_bearing)


def of_variances(x, u, dt, std_u, rng):
    return odometry.step(x, rng.multivariate_normal(u, np.diag(std_u), size=len(x)), dt)


def forward_only(x, u, dt, std_u, rng):
    return odometry.step(x, u + np.abs(rng.standard_normal((len(x), 2))) * std_u, dt)


def one_too_high(weights, rng):
    ends = np.cumsum(weights)
    return np.minimum(np.searchsorted(ends, rng.random(len(ends)) * ends[-1]) + 1, len(ends) - 1)


def drawn_as(noise):
    return lambda x, u, dt, std_u, rng: odometry.step(x, u + std_u * noise(rng.standard_normal((len(x), 2))), dt)


def up_to(share):
    def roulette(weights, rng):
        ends = np.cumsum(weights)
        return np.minimum(np.searchsorted(ends, rng.random(len(ends)) * share * ends[-1]), len(ends) - 1)

    return roulette


def turned_less(weights, rng):
    ends, m = np.cumsum(weights), len(weights)
    return np.minimum(np.searchsorted(ends, (np.arange(m) + 0.9 * rng.random()) * ends[-1] / m), m - 1)


def of_distances_up_to(limit):
    def field(grid, pose, ranges, bearings, std):
        near = replace(grid)
        near.__dict__["distance"] = np.minimum(grid.distance, limit)
        return CHAPTER["distance_field_weight"].reference(near, pose, ranges, bearings, std)

    return field


def of_each_cell_once(grid, pose, ranges, bearings, std):
    a = pose[2] + bearings
    rows, columns = grid.cell_of(pose[:2] + ranges[:, None] * np.column_stack([np.cos(a), np.sin(a)]))
    d = np.array([grid.distance[cell] for cell in set(zip(rows.tolist(), columns.tolist()))])
    return norm.logpdf(d, scale=std).sum()


def of_the_landmark_that_fits_best(pose, z, landmarks, std_range, std_bearing):
    d = landmarks - pose[:2]
    e = (z[:, :1] - np.hypot(*d.T)) / std_range
    f = planar.wrap_angle(z[:, 1:] - np.arctan2(d[:, 1], d[:, 0]) + pose[2]) / std_bearing
    return -0.5 * (e**2 + f**2).min(axis=1).sum() - len(z) * np.log(2 * np.pi * std_range * std_bearing)


def deviations_by_halves(x, u, dt, std_u, rng):
    noise = rng.normal(0, np.repeat(std_u, len(x))).reshape(len(x), 2)
    return odometry.step(x, u + noise, dt)


def late(due):
    return lambda w, p, k, n: (w * p / (w * p).sum(), bool(due(k, n)))


def in_ten_thousand_steps(grid, pose, bearing, r_max):
    r = np.minimum(grid.resolution / 2 * np.arange(10_000), r_max)
    angle = pose[2] + bearing
    hits = r[grid.at(pose[:2] + r[:, None] * [np.cos(angle), np.sin(angle)]) == maps.OCCUPIED]
    return hits[0] if len(hits) else r_max


PASSED_BEFORE = [
    ("distance_field_weight", of_each_cell_once, "each of them counts"),
    ("landmark_weight", of_the_landmark_that_fits_best, "row k of z is of row k"),
    ("sample_motion", deviations_by_halves, "spread ahead"),
    (
        "should_resample",
        lambda w, t: bool(particles.effective_size(w) < int(t * len(w))),
        "nor threshold * len(weights)",
    ),
    (
        "should_resample",
        lambda w, t: bool(particles.effective_size(w) < round(t * len(w))),
        "nor threshold * len(weights)",
    ),
    ("multiply_weights", late(lambda k, n: (k - 1) % n == 0), "in steps 1, n + 1"),
    ("multiply_weights", late(lambda k, n: k % n == 1), "in steps 1, n + 1"),
    ("circular_mean", lambda a, w: np.angle(np.exp(1j * a * w / w.mean()).mean()), "does not turn it"),
    ("sample_motion", drawn_as(lambda z: np.clip(z, -3, 3)), "Is the noise cut off"),
    ("sample_motion", drawn_as(lambda z: np.vstack([z[: (len(z) + 1) // 2], z[: len(z) // 2]])), "the same noise"),
    ("sample_motion", drawn_as(lambda z: z - z.mean(0)), "adds up to nothing"),
    ("sample_motion", lambda *given: np.squeeze(CHAPTER["sample_motion"].reference(*given)), "for 1 particle"),
    ("resample_roulette", up_to(0.99), "from 0 to the sum W"),
    ("resample_systematic", turned_less, "nothing left out"),
    ("distance_field_weight", of_distances_up_to(2.0), "cut off"),
    ("should_resample", lambda w, t: bool(np.round(particles.effective_size(w), 2) < t * len(w)), ""),
    ("sample_motion", of_variances, "the root of std_u"),
    ("sample_motion", forward_only, "go both ways"),
    ("should_resample", up_to_the_share, "not `<=`"),
    ("beam_weight", of_each_density, "the logarithm of 0"),
    ("beam_weight", kept_from_zero, "what you put in its place"),
    ("distance_field_weight", field_of_each_density, "the logarithm of 0"),
    ("landmark_weight", landmarks_of_each_density, "the logarithm of 0"),
    ("resample_roulette", one_too_high, "the share of the one before it"),
    ("sample_motion", after_the_step, "along x of the map"),
    ("sample_motion", from_one_to_the_next, "like that of the one before"),
    ("log_sum_exp", around_the_mean, "1000 below the largest"),
    ("cast_ray", in_steps_along_x, "`sign` is to be left out"),
    ("cast_ray", in_steps_of_two_cells, "longer than a cell"),
    ("cast_ray", walked(1.0, None), "begin farther out"),
    ("cast_ray", walked(0.0, None, share=0.9), "a little before r_max: your result is"),
    ("cast_ray", walked(0.0, 0.05), "typed in"),
    ("cast_ray", in_steps_of_five_centimeters, "cells of 2 cm"),
    ("sample_motion", turned_after_the_step, "also bends the way"),
    ("sample_motion", divided_by_dt, "by std_u itself, whatever dt is. Was the noise"),
    ("cast_ray", walked(0.0, None, more=1.0), "A scanner sees r_max at most"),
    ("cast_ray", walked(0.0, None, more=0.1), "nearly a cell before a wall (does yours look beyond r_max?)"),
    ("cast_ray", in_whole_cells, "You counted in cells"),
    ("multiply_weights", in_logarithms_doubled, "tiny likelihoods"),
    ("sample_motion", of_states_halved, "a particle must get from"),
    ("resample_roulette", one_too_low, "one too low"),
    ("resample_roulette", drawn_by(np.square), "squares of the weights"),
    ("resample_roulette", drawn_by(np.exp), "no logarithms"),
    ("resample_systematic", lambda w, rng: np.sort(drawn_by(np.asarray)(w, rng)), "independent spins"),
    (
        "sample_motion",
        lambda x, u, dt, s, rng: odometry.step(x, moved_by(u, s, len(x), rng), dt, "euler"),
        "old heading",
    ),
    ("sample_motion", never_in_reverse, "the noise is to be the same for every u"),
    (
        "sample_motion",
        lambda x, u, dt, s, rng: odometry.step(x, moved_by(u, s * (u != 0), len(x), rng), dt),
        "straight on",
    ),
    ("recover", recovered_from_five_percent_on, "`0.05` is far too large"),
    ("resample_systematic", in_another_order, "You sorted the weights"),
    ("should_resample", of_the_living, "weigh something"),
    ("resample_roulette", without_putting_back, "no index came out twice"),
    ("resample_systematic", turned_too_far, "at most one gap"),
    ("hunt_1", by_the_mean_index, "on average"),
    ("hunt_4", of_weights_with_the_sum_1, "a common factor is no fault"),
    ("sample_motion", laplace, "as Laplace numbers of this scale"),
    ("sample_motion", the_same_for_both, "what the standard deviation of v gives"),
    ("resample_systematic", counted, "counted how often each comes out"),
    ("cast_ray", halved, "the ray is halved"),
    ("cast_ray", mirrored, "the other way along y"),
    ("cast_ray", walked(0.5, None), "some 20 cm away"),
    ("cast_ray", in_ten_thousand_steps, "some 5,200 cells away"),
    ("landmark_weight", by_the_arcsine, "folded at 90 deg"),
    ("circular_mean", lambda a, w: np.angle(np.sum(a * np.exp(1j * w))), "exchanged"),
    ("sample_motion", by_one_pair, "equally far"),
    (
        "sample_motion",
        lambda x, u, dt, s, rng: odometry.step(x, moved_by(u, s / np.sqrt(dt), len(x), rng), dt),
        "grows with the root of dt",
    ),
    (
        "sample_motion",
        lambda x, u, dt, s, rng: odometry.step(x, moved_by(u, s[1], len(x), rng), dt),
        "what the standard deviation of omega gives",
    ),
    (
        "resample_roulette",
        lambda w, rng: np.searchsorted(np.cumsum(w) / np.sum(w), np.round(rng.random(len(w)), 2)),
        "an index 10 came out of 10 particles",
    ),
    ("hunt_1", lambda resample, rng: [chi_square(resample, rng)] if resample in ch09.GOOD else False, "got list"),
]


@pytest.mark.parametrize("name, answer, words", PASSED_BEFORE)
def test_what_was_right_on_typical_data_only_is_refused(name, answer, words, monkeypatch):
    if not words:  # what is told is not asked
        monkeypatch.setattr(budget, "LOOKING", 0.0)
    outcome = judge(name, answer)
    assert outcome.status == NOT_YET and words in outcome.text


@pytest.mark.parametrize(
    "name, answer, words",
    [
        ("should_resample", lambda w, t: w.min() / w.max() < t, "comes out if"),
        ("should_resample", lambda w, t: w.mean() / w.max() < t, "a right formula"),
        ("multiply_weights", lambda w, p, k, n: (w * p / (w @ p), k // n == 1), "Where it is wrong"),
    ],
)
def test_a_truth_value_that_another_rule_gives_as_well_is_not_said_to_come_of_it(name, answer, words):
    assert all(words not in judge(name, answer, seed).text for seed in range(2))


def test_of_particles_one_that_goes_astray_is_shown():
    told = judge("sample_motion", one_astray).text
    right, found = re.search(r"from .* to (.*)\. Yours gets to (.*)\.", told).groups()
    assert right != found


IN_NUMBERS_OF_STEPS = """
def answer(grid, pose, bearing, r_max):
    a, step, k = pose[2] + bearing, grid.resolution / 4, 0
    while k * step < r_max:
        if grid.at([pose[0] + k * step * np.cos(a), pose[1] + k * step * np.sin(a)]) == maps.OCCUPIED:
            return k
        k += 1
    return r_max
"""

IN_THIRTY_PLACES = """
def answer(grid, pose, bearing, r_max):
    a = pose[2] + bearing
    for r in np.linspace(0, r_max, 30):
        if grid.at([pose[0] + r * np.cos(a), pose[1] + r * np.sin(a)]) == maps.OCCUPIED:
            return r
    return r_max
"""

OF_ALL_ROWS_AND_COLUMNS = """
def answer(grid, pose, ranges, bearings, std):
    a = pose[2] + bearings
    ends = pose[:2] + ranges[:, None] * np.column_stack([np.cos(a), np.sin(a)])
    rows, columns = grid.cell_of(ends)
    return np.sum(-0.5 * (grid.distance[rows][:, columns] / std) ** 2 - np.log(std * np.sqrt(2 * np.pi)))
"""


def typed(text):
    """The function as a notebook has it: its lines can be read again."""
    file = f"<typed {hash(text)}>"
    linecache.cache[file] = (len(text), None, text.splitlines(True), file)
    known = {"np": np, "maps": maps}
    exec(compile(text, file, "exec"), known)
    return known["answer"]


@pytest.mark.parametrize(
    "name, text, words",
    [
        ("cast_ray", IN_NUMBERS_OF_STEPS, "it is to be multiplied by `step`"),
        ("cast_ray", IN_THIRTY_PLACES, "You look at about 30 places along the ray"),
        ("distance_field_weight", OF_ALL_ROWS_AND_COLUMNS, "the row and the column of one end point"),
    ],
)
def test_what_goes_wrong_is_found_in_slow_answers_and_in_results_taken_apart(name, text, words):
    assert words in judge(name, typed(text)).text


def test_a_walk_that_ends_after_ten_meters_meets_a_longer_hall(monkeypatch):
    monkeypatch.setattr(budget, "LOOKING", 0.0)  # what is told is not asked here

    def ten_meters(grid, pose, bearing, r_max):
        a = pose[2] + bearing
        steps = (k * min(0.05, grid.resolution / 2) for k in range(int(10 / min(0.05, grid.resolution / 2))))
        ray = (r for r in steps if r < r_max)
        hit = (r for r in ray if grid.at(pose[:2] + r * np.array([np.cos(a), np.sin(a)])) == maps.OCCUPIED)
        return next(hit, r_max)

    assert judge("cast_ray", ten_meters).status == NOT_YET


FAR_FROM_OTHERS = """
def answer(log_weights):
    top = np.max(log_weights)
    return top + np.log(np.sum(np.exp(log_weights[log_weights > top - 10] - top)))
"""
WITH_AN_ECHO = """
def answer(ranges, expected, std):
    seen = ranges < 18.0
    e = (ranges - expected)[seen]
    return np.sum(-0.5 * (e / std) ** 2 - np.log(std * np.sqrt(2 * np.pi)))
"""

WITHIN_REACH = """
def answer(grid, pose, ranges, bearings, std):
    seen = ranges < 18.0
    a = pose[2] + bearings[seen]
    d = grid.distance[grid.cell_of(pose[:2] + ranges[seen, None] * np.column_stack([np.cos(a), np.sin(a)]))]
    return np.sum(-0.5 * (d / std) ** 2 - np.log(std * np.sqrt(2 * np.pi)))
"""


@pytest.mark.parametrize(
    "name, text",
    [("log_sum_exp", FAR_FROM_OTHERS), ("beam_weight", WITH_AN_ECHO), ("distance_field_weight", WITHIN_REACH)],
)
def test_a_condition_that_leaves_out_what_counts_is_to_be_true(name, text):
    told = [judge(name, typed(text), seed).text for seed in SEEDS]
    assert all("True belongs in the place of each of its entries" in words for words in told)


def test_a_control_is_blamed_where_the_noise_is_right_for_another_one_alone():
    def never_standing(x, u, dt, s, rng):
        return odometry.step(x, u + s * np.any(u) * rng.standard_normal((len(x), 2)), dt)

    told = [
        ch09._of_the_control(move, (0.0, 0.0), (0.2, 0.3), 0.5, ch09.ANY_CONTROL, np.random.default_rng(0))
        for move in (never_standing, deviations_by_halves)
    ]
    assert told == [("right for u = [1, 0], but ", ch09.ANY_CONTROL), ("", ch09.ANY_SPREAD)]


def test_a_test_that_rejects_the_spoke_wheel_by_luck_is_tried_more_often(monkeypatch):
    def at_times(resample, rng):
        return resample in ch09.GOOD and (resample is not particles.resample_systematic or next(turns))

    monkeypatch.setattr(ch09, "QUICK", np.inf)
    turns = iter([True] * 5 + [False, True])
    assert "also rejects, though not each time, a correct function (the spoke wheel" in judge("hunt_1", at_times).text


def test_a_hunt_that_looks_at_the_last_index_alone_is_not_enough():
    def last(resample, rng):
        index = np.concatenate([resample(np.array([0.4, 0.3, 0.2, 0.1]), rng) for _ in range(1000)])
        return bool(abs(np.mean(index == 3) - 0.1) < 0.02)

    assert "the first in place of all others" in judge("hunt_1", last).text


def test_noise_scaled_by_the_root_of_the_time_step_is_told_by_how_it_grows():
    def scaled(x, u, dt, std_u, rng):
        return odometry.step(x, u + std_u * np.sqrt(dt) * rng.standard_normal((len(x), 2)), dt)

    assert "power 1.5" in judge("sample_motion", scaled).text


FOLDED = """
def answer(pose, z, landmarks, std_range, std_bearing):
    d = landmarks - pose[:2]
    e = np.abs(z[:, 1] - np.arctan2(d[:, 1], d[:, 0]) + pose[2])
    e = np.stack([z[:, 0] - np.hypot(*d.T), np.minimum(e, 2 * np.pi - e)]) / [[std_range], [std_bearing]]
    return -0.5 * np.sum(e**2) - len(z) * np.log(2 * np.pi * std_range * std_bearing)
"""


def test_of_a_pose_the_heading_alone_is_to_be_wrapped():
    assert "`pose[2]`: it should be wrapped" in judge("landmark_weight", typed(FOLDED)).text


def test_random_numbers_that_change_nothing_are_no_missing_ones():
    def told(turn):
        def wheel(weights, rng):
            spokes = np.arange(len(weights)) + turn(rng)
            return np.searchsorted(np.cumsum(weights) / weights.mean(), spokes)

        return ch09._drawn_from_the_rng(wheel, np.random.default_rng(0))

    assert "8 different seeds give the same" in told(lambda rng: 0.5 + 1e-6 * rng.random())
    assert "whatever `rng` is given" in told(lambda rng: 0.5) and told(lambda rng: rng.random()) is None


def test_shares_that_belong_to_other_indices_are_told_as_these():
    right = ch09.WEIGHTS[0]
    assert ch09._shifted(np.array([0.5, 0.25, 0.09, 0.16]), np.array([0.5, 0.25, 0.15, 0.1])) == "", "no other index's"
    assert "sorted" in ch09._shifted(np.sort(right)[::-1], right)
    assert ch09._shifted(np.full(5, 0.2), right) == ""


def test_slow_answers_find_the_distances_of_their_map_computed():
    draws = (ch09.scan_at_a_pose, ch09.scan_on_another_map, ch09.scan_in_a_wide_hall)
    assert all("distance" in vars(draw(np.random.default_rng(0))[0]) for draw in draws)


def alike_once(pose, z, landmarks, *stds):
    """Two readings of one landmark count as the last of them."""
    last = list({tuple(mark): k for k, mark in enumerate(landmarks)}.values())
    return ch09.landmark_weight(pose, z[last], landmarks[last], *stds)


def out_of_the_wall(grid, pose, bearing, r_max):
    """The wall in which the ray begins is none."""
    ray = pose[:2] + np.arange(0, r_max, 0.05)[:, None] * [np.cos(pose[2] + bearing), np.sin(pose[2] + bearing)]
    free = grid.at(ray) != maps.OCCUPIED
    first = float(0.05 * np.argmax(free))
    return first + maps.walk_ray(grid, [*ray[np.argmax(free)], pose[2]], bearing, r_max - first)


def around_the_map(grid, pose, bearing, r_max):
    """Indices below 0 count from the end of the map."""
    return maps.walk_ray(replace(grid, cells=np.tile(grid.cells, (2, 2)), origin=grid.origin - grid.resolution
                                 * np.array(grid.cells.shape[::-1])), pose, bearing, r_max)  # fmt: skip


def in_so_many_steps(grid, pose, bearing, r_max):
    step = r_max / 500
    hits = ch09._hits(grid, pose, bearing, r_max, step)
    return hits.min(initial=r_max)


def seen_cells_alone(grid, pose, ranges, bearings, std):
    known = grid.at(ch09._end_points(pose, ranges, bearings)) != maps.UNKNOWN
    return ch09.distance_field_weight(grid, pose, ranges[known], bearings[known], std)


OF_A_PLACE_ALONE = [
    ("landmark_weight", alike_once),
    ("log_sum_exp", lambda l: ch09.log_sum_exp(l[l != 0])),
    ("cast_ray", out_of_the_wall),
    ("cast_ray", around_the_map),
    ("cast_ray", in_so_many_steps),
    ("beam_weight", lambda r, e, s: ch09.beam_weight(r[r != e], e[r != e], s)),
    ("beam_weight", lambda r, e, s: ch09.beam_weight(r[e <= 18], e[e <= 18], s)),
    ("distance_field_weight", seen_cells_alone),
    ("effective_size", lambda w: w.sum() ** 2 / ((w**2).sum() + 1e-30)),
    ("should_resample", lambda w, t: len(w) == 1 or ch09.should_resample(w, t)),
    (
        "circular_mean",
        lambda a, w: particles.circular_mean(*(lambda i: (a[i], w[i]))(np.unique(a, return_index=True)[1])),
    ),
    ("circular_mean", lambda a, w: particles.circular_mean(a, w + 1e-20)),
    ("circular_mean", lambda a, w: particles.circular_mean(a, w) if abs(w @ np.sin(a)) > 1e-9 * w.sum() else 0.0),
    ("circular_mean", lambda a, w: np.sign(w @ np.sin(a)) * abs(particles.circular_mean(a, w))),
    ("circular_mean", lambda a, w: 2 * np.arctan((abs(w @ np.exp(1j * a)) - w @ np.cos(a)) / (w @ np.sin(a)))),
]


@pytest.mark.parametrize("name, answer", OF_A_PLACE_ALONE)
def test_who_is_wrong_at_one_place_alone_meets_it_at_every_check(name, answer):
    assert any(is_missed(answer, *case) for case in one_check(CHAPTER[name]))


@pytest.mark.parametrize(
    "holds, answer, words",
    [
        (ch09._valid, lambda w, rng: tuple(particles.resample_roulette(w, rng)), "got a tuple"),
        (ch09._of_whole_numbers, lambda w, rng: particles.resample_roulette(w.copy().__itruediv__(2.0), rng), "raises"),
        (ch09._turns_evenly, lambda w, rng: ch09._turn(w, rng.beta(2, 2)), "as likely as any other"),
        (
            ch09._noise_is_right_at(ch09.SLOW),
            moved(lambda m, s, rng: s * (z := rng.normal(size=(m, 2))) / z.std()),
            "just",
        ),
        (
            ch09._noise_is_right_at(ch09.SLOW),
            moved(lambda m, s, rng: s * rng.normal(0.08, 1, (m, 2))),
            "both ways alike",
        ),
        (
            ch09._moved_alone_by_the_rng,
            moved(lambda m, s, rng: s * (m > 1) * rng.normal(size=(m, 2))),
            "single particle",
        ),
        (ch09._moves_whole_numbers, lambda x, *rest: ch09.sample_motion(x, *rest).astype(x.dtype), "whole numbers"),
    ],
)
def test_what_is_drawn_by_another_law_is_told_as_it_is(holds, answer, words):
    assert words in holds(answer, np.random.default_rng(0))


def test_a_test_of_two_statistics_or_of_a_change_is_not_enough():
    def of_mean_and_spread(resample, rng):
        w, k = np.array([0.1, 0.5, 0.1, 0.3]), np.arange(4)
        index = np.concatenate([resample(w, rng) for _ in range(3000)])
        return bool(abs(index.mean() - w @ k) < 0.05 and abs(index.var() - w @ (k - w @ k) ** 2) < 0.06)

    assert of_mean_and_spread(ch09._of_the_same_spread, np.random.default_rng(0))
    assert not ch09.hunt_1(ch09._of_the_same_spread, np.random.default_rng(0))
    assert not ch09.hunt_1(ch09._two_alone, np.random.default_rng(0))
    assert not ch09.hunt_2(ch09._some_light_ones_left_out, np.random.default_rng(0))
    assert not ch09.hunt_4(ch09._second_for_half)


@pytest.mark.parametrize("within", [0.1, 0.3])
def test_the_mean_of_the_index_does_not_tell_what_light_particles_get(within):
    def mean(resample, rng):
        weights = np.array([0.5] + 10 * [0.05])
        index = np.concatenate([resample(weights, rng) for _ in range(1000)])
        return bool(abs(index.mean() - weights @ np.arange(11)) < within)

    outcome = judge("hunt_2", mean)
    assert outcome.status == NOT_YET and "too often one in the middle" in outcome.text
