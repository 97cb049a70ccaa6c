"""Right in the common range and wrong where something is far larger or smaller: who is, hears of it."""

import numpy as np
import pytest

from labkit.chapters.ch08_kalman.exercises import CHAPTER as KALMAN
from labkit.exercises import session, sizes
from labkit.exercises.engine import Exercise
from labkit.exercises.outcome import NOT_YET
from labkit.geometry.frames import pose
from labkit.geometry.lie import exp_so3

SIZED = [item for chapter in session.chapters() for item in chapter.items if getattr(item, "sizes", ())]
EACH = [(item, names) for item in SIZED for names in item.sizes]


@pytest.mark.parametrize("item, names", EACH, ids=lambda value: getattr(value, "id", value))
def test_what_may_be_of_any_size_is_an_argument_that_the_reference_takes_in_all(item, names):
    assert set(names.split()) <= set(item.arguments)
    for factor in sizes.FACTORS:
        draw = sizes._resized(item, names.split(), factor)
        assert any(draw(np.random.default_rng(seed)) is not None for seed in range(10)), factor


def test_references_are_right_in_all_sizes():
    assert [item.id for item in SIZED if item.in_all_sizes(item.reference, np.random.default_rng(1))] == []


def test_of_a_pose_the_translation_grows_alone():
    R, t = exp_so3([0.1, 0.2, 0.3]), np.array([1.0, -2.0, 3.0])
    assert np.array_equal(sizes.resized(pose(R, t), 1e3), pose(R, 1e3 * t))
    assert np.array_equal(sizes.resized([pose(R, t)], 1e-3)[0], pose(R, 1e-3 * t))
    assert sizes.resized(2.0, 1e3) == 2e3


def without_a_vague_prior(x0, var0, z, stds):
    weights = 1 / stds**2
    if var0 < 100 * max(stds) ** 2:
        weights, z = np.append(weights, 1 / var0), np.append(z, x0)
    return weights @ z / weights.sum(), 1 / weights.sum()


def test_who_drops_what_is_small_is_refused_at_every_check():
    for seed in range(10):
        item = KALMAN["fuse_two_sensors"]
        assert item.judge(without_a_vague_prior, rng=np.random.default_rng(seed)).status == NOT_YET


def test_who_is_right_in_the_common_range_alone_hears_which_size_it_is():
    doubled = Exercise(
        "doubled",
        reference=lambda length, width: length + width,
        draw=lambda rng: tuple(rng.uniform(1, 2, 2)),
        metric=KALMAN["nees"].metric,
        hints=("", "", ""),
        sizes=("length", "length width"),
    )
    told = doubled.judge(lambda length, width: min(length, 50.0) + width, np.random.default_rng(0)).text
    assert told.startswith("right so far, but not where `length` is a thousand times as large as in other draws: ")
    told = doubled.judge(lambda length, width: length + min(width, 50.0), np.random.default_rng(0)).text
    assert "where `length` and `width` are a thousand times as large" in told
