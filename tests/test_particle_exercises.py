"""Chapter 9's exercises: answers that look right and are not, and right ones of more than one style."""

import numpy as np
import pytest
from scipy.stats import norm

from labkit import maps, odometry, particles
from labkit.course import session
from labkit.course.engine import CORRECT, NOT_YET, RAISED

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


def test_spins_that_share_their_random_number_are_refused():
    def pairs(w, rng):
        spins = np.repeat(rng.random(len(w) // 2 + 1), 2)[: len(w)]
        return np.searchsorted(np.cumsum(w), spins * w.sum())

    assert "own" in judge("resample_roulette", pairs).text


@pytest.mark.parametrize("seed", range(5))
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
        assert outcome.status == NOT_YET and "541" in outcome.text
    assert judge("beam_weight", lambda r, e, s: norm.logpdf(r, e, s).sum()).status == CORRECT


@pytest.mark.parametrize("seed", range(5))
def test_every_single_ray_tells_a_forgotten_heading(seed):
    item = next(item for item in CHAPTER.items if item.id == "cast_ray")
    grid, pose, bearing, r_max = item.cases[0](np.random.default_rng(seed))
    right = maps.walk_ray(grid, pose, bearing, r_max)
    for x in ((0.0, bearing), (pose[2], 0.0), (pose[2], -bearing)):
        assert abs(maps.walk_ray(grid, np.array([*pose[:2], x[0]]), x[1], r_max) - right) > 0.2


def test_a_test_that_lets_the_specimen_raise_is_told_to_catch():
    outcome = judge("hunt_3", lambda resample, rng: resample(np.full(1000, 0.000999), rng).max() < 1000)
    assert outcome.status == RAISED and "except IndexError" in outcome.text


def test_recover_in_another_order_is_named():
    def turned(*args):
        share, slow, fast = particles.recover(*args)
        return slow, fast, share

    assert "order" in judge("recover", turned).text
