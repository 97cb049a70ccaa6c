"""Clouds of poses: motion against propagated covariances, resamplers by their properties, estimates by hand."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import stats

from labkit.geometry import planar
from labkit.localization import odometry
from labkit.localization import particles as pt
from labkit.localization.maps import OCCUPIED, OccupancyGrid

ROOM = OccupancyGrid.from_ascii("########\n#......#\n#..#...#\n#......#\n########")
WEIGHTS = hnp.arrays(np.float64, st.integers(1, 60), elements=st.floats(0, 1)).filter(lambda w: w.sum() > 1e-6)
RESAMPLERS = (pt.resample_roulette, pt.resample_systematic)


def test_motion_without_noise_is_dead_reckoning():
    states = np.array([[0.0, 0, 0], [1, 2, 1.5]])
    moved = pt.sample_motion(states, (1.0, 0.5), 0.1, np.random.default_rng(0), cov_u=np.zeros((2, 2)))
    np.testing.assert_allclose(moved, odometry.step(states, (1.0, 0.5), 0.1), atol=1e-15)


@pytest.mark.parametrize("model", odometry.MODELS)
def test_spread_of_the_motion_is_the_propagated_covariance(model):
    rng, cov_u = np.random.default_rng(1), np.array([[0.01, 0.004], [0.004, 0.02]])
    moved = pt.sample_motion(np.zeros((100_000, 3)), (1.0, 0.3), 0.5, rng, cov_u=cov_u, model=model)
    _, cov = odometry.propagate(np.zeros(3), np.zeros((3, 3)), (1.0, 0.3), 0.5, cov_u, model)
    np.testing.assert_allclose(np.cov(moved.T), cov, atol=0.02 * np.abs(cov).max())


def test_odometry_motion_has_the_covariance_of_its_constants():
    noise = {"k_d": 0.02, "k_theta": 0.03, "k_drift": 0.01}
    motion = pt.odometry_motion(**noise, model="arc")
    moved = motion(np.zeros((100_000, 3)), (-1.0, 0.3), 0.5, np.random.default_rng(3))
    cov_u = odometry.control_covariance([-1.0, 0.3], 0.5, **noise)
    _, cov = odometry.propagate(np.zeros(3), np.zeros((3, 3)), (-1.0, 0.3), 0.5, cov_u, "arc")
    np.testing.assert_allclose(np.cov(moved.T), cov, atol=0.03 * np.abs(cov).max())
    states = np.random.default_rng(2).normal(size=(20, 3))
    assert (motion(states, (0.0, 0.0), 0.1, np.random.default_rng(3)) == states).all()


def test_162_beams_underflow_as_a_product_but_not_as_a_sum():
    assert np.prod(np.full(162, 0.01)) == 0.0
    np.testing.assert_allclose(pt.normalize_weights(162 * np.log([0.01, 0.01, 0.005])), [0.5, 0.5, 0.5**163], rtol=1e-9)


@given(WEIGHTS, st.floats(1e-3, 1e3))
def test_normalize_forgets_a_common_factor(w, factor):
    with np.errstate(divide="ignore"):
        np.testing.assert_allclose(
            pt.normalize_weights(np.log(w)), pt.normalize_weights(np.log(w * factor)), atol=1e-12
        )


@settings(deadline=None)
@given(WEIGHTS, st.integers(0, 2**32 - 1), st.sampled_from(RESAMPLERS), st.integers(1, 80))
def test_resamplers_return_valid_indices_and_never_a_zero_weight(w, seed, resample, size):
    index = resample(w, np.random.default_rng(seed), size)
    assert len(index) == size and index.min() >= 0 and index.max() < len(w)
    assert (w[index] > 0).all() and (np.diff(index) >= 0).all()


@settings(deadline=None)
@given(WEIGHTS, st.integers(0, 2**32 - 1))
def test_systematic_counts_are_the_floor_or_the_ceiling(w, seed):
    count = np.bincount(pt.resample_systematic(w, np.random.default_rng(seed)), minlength=len(w))
    share = len(w) * w / w.sum()
    assert (np.abs(count - share) < 1 + 1e-9).all()


@pytest.mark.parametrize("resample", RESAMPLERS)
def test_draws_follow_the_weights(resample):
    w, rng = np.array([0.1, 0.7, 0.1, 0.1, 0.0]), np.random.default_rng(6)
    count = sum(np.bincount(resample(w, rng), minlength=5) for _ in range(20_000))
    np.testing.assert_allclose(count / count.sum(), w, atol=0.004)


def test_roulette_counts_are_multinomial():
    w, rng = np.array([0.5, 0.25, 0.15, 0.1]), np.random.default_rng(7)
    counts = np.array([np.bincount(pt.resample_roulette(w, rng, 40), minlength=4) for _ in range(5000)])
    np.testing.assert_allclose(counts.var(0), 40 * w * (1 - w), rtol=0.08)
    found = stats.chisquare(np.bincount(counts[:, 3], minlength=41)[:12], None).statistic
    assert found > 0  # counts vary
    expected = stats.binom.pmf(np.arange(12), 40, 0.1) * 5000
    chi2 = ((np.bincount(counts[:, 3], minlength=41)[:12] - expected) ** 2 / expected).sum()
    assert chi2 < stats.chi2.ppf(0.9999, 11)


def test_systematic_keeps_equal_weights_and_roulette_does_not():
    w, rng = np.full(1000, 1 / 1000), np.random.default_rng(8)
    assert (pt.resample_systematic(w, rng) == np.arange(1000)).all()
    kept = np.mean([len(np.unique(pt.resample_roulette(w, rng))) for _ in range(50)]) / 1000
    assert kept == pytest.approx(1 - 1 / math.e, abs=0.005)


def test_standing_robot_loses_its_ancestors_under_roulette_only():
    rng = np.random.default_rng(9)
    roulette = pt.count_ancestors(pt.resample_roulette, 1000, 200, rng)
    assert 20 < roulette[50] < 60 and roulette[200] < 20
    assert (pt.count_ancestors(pt.resample_systematic, 1000, 200, rng) == 1000).all()
    with pytest.raises(ValueError, match="n_particles times n_steps must be at most"):
        pt.count_ancestors(pt.resample_roulette, 10**5, 10**5, rng)


def test_systematic_is_exact_for_float32_weights():
    rng = np.random.default_rng(10)
    for _ in range(300):
        w = rng.exponential(size=1000).astype(np.float32)
        w /= w.sum()
        count = np.bincount(pt.resample_systematic(w, rng), minlength=1000)
        assert count.sum() == 1000
        assert (np.abs(count - 1000 * w.astype(float) / w.sum(dtype=float)) < 1 + 1e-9).all()


@given(WEIGHTS)
def test_effective_size_and_variance_say_the_same(w):
    n = pt.effective_size(w)
    mean_one = w / w.mean()
    assert 1 - 1e-9 <= n <= len(w) * (1 + 1e-9)
    assert len(w) / n == pytest.approx(1 + mean_one.var(), rel=1e-6)
    assert pt.should_resample(w, 0.5) == (n < 0.5 * len(w))


RNG = np.random.default_rng(0)  # refused before it draws


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: pt.normalize_weights([-np.inf, -np.inf]), "no particle explains the measurement"),
        (lambda: pt.normalize_weights([0.0, np.nan]), "NaN"),
        (lambda: pt.resample_systematic([0.0, 0.0], RNG), "not all 0"),
        (lambda: pt.resample_roulette([0.5, -0.1], RNG), "at least 0"),
        (lambda: pt.resample_roulette([[0.5]], RNG), "vector (M,)"),
        (lambda: pt.circular_mean([0.0, math.pi]), "cancel"),
        (
            lambda: pt.sample_motion([[0, 0]], (1, 0), 0.1, RNG, np.eye(2)),
            "states must have shape (..., 3), got (1, 2)",
        ),
    ],
)
def test_bad_input_is_named(call, words):
    with pytest.raises(ValueError) as error:
        call()
    assert words in str(error.value)


def test_circular_mean_across_the_seam():
    angles = np.radians([179.0, -179.0])
    assert abs(abs(pt.circular_mean(angles)) - math.pi) < 1e-12
    assert np.mean(angles) == pytest.approx(0.0, abs=1e-12)  # what the arithmetic mean says


@given(hnp.arrays(np.float64, 12, elements=st.floats(-0.7, 0.7)), st.floats(-3, 3))
def test_circular_mean_turns_with_the_angles(angles, turn):
    turned = pt.circular_mean(planar.wrap_angle(angles + turn))
    assert abs(planar.wrap_angle(turned - pt.circular_mean(angles) - turn)) < 1e-9


def test_estimate_of_a_gaussian_cloud():
    rng, cov = np.random.default_rng(11), np.diag([0.04, 0.01, 0.02])
    states = rng.multivariate_normal([3.0, 1.0, math.pi], cov, 50_000)
    states[:, 2] = planar.wrap_angle(states[:, 2])
    found = pt.estimate(states)
    np.testing.assert_allclose(found.pose[:2], [3, 1], atol=0.01)
    assert abs(planar.wrap_angle(found.pose[2] - math.pi)) < 0.01
    np.testing.assert_allclose(found.covariance, cov, atol=1e-3)


def test_mean_of_two_modes_lies_in_the_wall():
    rng = np.random.default_rng(12)
    two = np.concatenate([rng.normal([2.0, 2.5, 0], 0.1, (600, 3)), rng.normal([5.0, 2.5, 0], 0.1, (400, 3))])
    mean, mode = pt.estimate(two), pt.estimate_mode(two)
    assert ROOM.at(mean.pose[:2]) == OCCUPIED and ROOM.at(mode.pose[:2]) != OCCUPIED
    np.testing.assert_allclose(mode.pose, [2.0, 2.5, 0], atol=0.03)
    assert mode.share == pytest.approx(0.6, abs=0.01)


def test_bins_tell_poses_apart():
    poses = np.array(
        [[0.1, 0.1, 0.0], [0.4, 0.4, 0.1], [0.6, 0.1, 0.0], [0.1, -0.1, 0.0], [0.1, 0.1, 0.5], [0.1, 0.1, -0.01]]
    )
    bins = pt.pose_bins(poses)
    assert bins[0] == bins[1] and len(set(bins.tolist())) == 5


def test_headings_fall_into_24_bins_around_the_circle():
    middles = np.deg2rad(7.5 + 15 * np.arange(24))
    poses = np.column_stack([np.full((24, 2), 0.2), middles])
    bins = pt.pose_bins(poses)
    assert len(set(bins.tolist())) == 24 and (np.diff(bins) == 1).all()
    for turns in (-3, 1, 40):
        np.testing.assert_array_equal(pt.pose_bins(poses + [0, 0, 2 * np.pi * turns]), bins)
    assert pt.pose_bins([0.2, 0.2, -1e-17]) == bins[0]
    with pytest.raises(ValueError, match="turn must be at least 1e-4 rad"):
        pt.pose_bins(poses, turn=9e-5)


def test_kld_size_against_the_chi_square_quantile():
    for bins in (5, 20, 100):
        exact = stats.chi2.ppf(stats.norm.cdf(2.326), bins - 1) / (2 * 0.05)
        assert pt.kld_size(bins) == pytest.approx(exact, rel=0.01)
    assert pt.kld_size(1) == 1


def test_kld_takes_few_of_a_narrow_cloud_and_many_of_a_wide_one():
    rng = np.random.default_rng(13)
    narrow, wide = rng.normal(0.25, 0.02, (5000, 3)), rng.uniform(-8, 8, (5000, 3))
    assert pt.KldSampling(n_min=100).enough(narrow) < 200 < 4000 < pt.KldSampling().enough(wide)


def test_uniform_states_fill_each_free_cell_and_no_other():
    cells = np.full((2, 3), OCCUPIED)
    cells[1, 2] = cells[0, 0] = 0
    grid = OccupancyGrid(cells, 0.5, (10.0, 20.0))
    states = pt.uniform_states(grid, 400, np.random.default_rng(0))
    i, j = np.nonzero(grid.free)
    offsets = states[:, None, :2] - grid.center_of(i, j)
    which = np.abs(offsets).max(-1).argmin(1)
    own = offsets[np.arange(400), which]
    assert np.abs(own).max() <= 0.25 and (own.min(0) < -0.24).all() and (own.max(0) > 0.24).all()
    assert np.bincount(which).min() > 140  # of 200 each; six standard deviations
    assert states[:, 2].min() < -3.0 and states[:, 2].max() > 3.0


def test_the_mode_is_what_lies_within_one_and_a_half_bins():
    """Bins of 0.4 m and 0.2 rad about one place: 0.55 m and 0.25 rad belong to it, 0.65 m and 0.35 rad do not."""
    core = np.tile([1.0, 1.0, 1.0], (50, 1))
    beside = core[:4] + np.array([[0.55, 0, 0], [0, 0.65, 0], [0, 0, 0.25], [0, 0, -0.35]])
    mode = pt.estimate_mode(np.concatenate([core, beside]), cell=0.4, turn=0.2)
    kept = np.concatenate([core, beside[[0, 2]]])
    np.testing.assert_allclose(mode.pose, kept.mean(0), atol=1e-4)  # headings within 0.25 rad: sine is nearly the angle
    np.testing.assert_allclose(mode.covariance, np.cov(kept.T, bias=True), atol=1e-5)
    assert mode.share == pytest.approx(52 / 54)


@pytest.mark.parametrize("size", [1e-250, 1e-20, 1.0, 1e20, 1e250])
def test_figures_of_weights_know_no_common_factor(size):
    assert pt.effective_size(np.full(5, size)) == pytest.approx(5.0)
    assert pt.effective_size([size, size, 0.0]) == pytest.approx(2.0)
    if 1e-100 < size < 1e100:
        assert pt.circular_mean([0.1, 0.3], [size, size]) == pytest.approx(0.2)
        with pytest.raises(ValueError, match="must not cancel"):
            pt.circular_mean([0.7, 0.7 + np.pi], [size, size])


def test_ancestors_are_counted_for_equal_weights_of_sum_one():
    seen = []

    def halves(weights, rng):
        seen.append(weights)
        return np.arange(len(weights)) // 2

    assert pt.count_ancestors(halves, 8, 3, np.random.default_rng(0)).tolist() == [8, 4, 2, 1]
    np.testing.assert_array_equal(seen, np.full((3, 8), 1 / 8))


def test_bins_are_as_wide_as_they_are_long():
    states = np.array([[0.1, 0.1, 0], [0.1, 0.4, 0], [0.1, 0.6, 0], [0.4, 0.1, 0], [0.6, 0.1, 0]])
    first, *others = pt.pose_bins(states, cell=0.5)
    assert (others == first).tolist() == [True, False, True, False] and others[1] != others[3]


@pytest.mark.parametrize("seed", range(4))
def test_enough_is_the_first_number_that_its_own_bins_ask_for(seed):
    """Counted one particle after the other."""
    sampling = pt.KldSampling(n_min=20, epsilon=0.2)
    states = np.random.default_rng(seed).normal(scale=[0.6, 0.4, 0.1], size=(400, 3))
    for some in (states, states[:30]):
        bins = pt.pose_bins(some, sampling.cell, sampling.turn)
        asked = [max(20, pt.kld_size(len(set(bins[:n])), 0.2, 2.326)) for n in range(1, len(some) + 1)]
        enough = [n for n, least in enumerate(asked, 1) if n >= least]
        assert sampling.enough(some) == (enough[0] if enough else len(some))
