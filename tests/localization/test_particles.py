"""Monte-Carlo localization: sensor models by hand, resamplers by their properties, the filter by what it has to do."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import integrate, stats

from labkit.documents.lecture.examples import load_building
from labkit.geometry import planar
from labkit.localization import maps, mcl, odometry
from labkit.localization import particles as pt
from labkit.localization.drives import find_route, random_drive
from labkit.localization.maps import OCCUPIED, OccupancyGrid
from labkit.localization.sensors import (
    SENSORS,
    LikelihoodField,
    Scanner,
    SensorSuite,
    beam_density,
    see_landmarks,
    weigh_beams,
    weigh_doors,
    weigh_landmarks,
    weigh_likelihood_field,
)

ROOM = OccupancyGrid.from_ascii("########\n#......#\n#..#...#\n#......#\n########")
WEIGHTS = hnp.arrays(np.float64, st.integers(1, 60), elements=st.floats(0, 1)).filter(lambda w: w.sum() > 1e-6)
RESAMPLERS = (pt.resample_roulette, pt.resample_systematic)


@pytest.fixture(scope="module")
def building():
    return load_building()


# --- motion ----------------------------------------------------------------------------------------------------------


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


def test_standing_robot_stands_still_with_the_lectures_noise():
    states = np.random.default_rng(2).normal(size=(20, 3))
    assert (pt.sample_motion(states, (0.0, 0.0), 0.1, np.random.default_rng(3)) == states).all()


# --- sensor models ---------------------------------------------------------------------------------------------------


def test_landmark_weight_by_hand():
    weigh = weigh_landmarks([[5.0, 0.0]], [[5.0, 0.0]], std_range=0.5, std_bearing=0.1)
    peak = -math.log(0.5 * math.sqrt(2 * math.pi)) - math.log(0.1 * math.sqrt(2 * math.pi))
    states = [[0, 0, 0], [0.5, 0, 0], [0, 0, 0.2], [0, 0, 2 * math.pi]]
    np.testing.assert_allclose(weigh(states), [peak, peak - 0.5, peak - 2.0, peak], atol=1e-12)
    assert weigh.best == pytest.approx(peak)
    assert np.shape(weigh([0.0, 0, 0])) == ()


def test_landmark_weight_is_a_product_of_densities():
    z, marks = np.array([[2.0, 0.3], [4.0, -2.0]]), np.array([[1.0, 1.0], [-2.0, 3.0]])
    state = np.array([0.2, -0.3, 0.5])
    weight = 1.0
    for (r, phi), mark in zip(z, marks):
        d = mark - state[:2]
        weight *= stats.norm.pdf(r - np.hypot(*d), scale=0.4)
        weight *= stats.norm.pdf(planar.wrap_angle(phi - math.atan2(d[1], d[0]) + state[2]), scale=0.3)
    assert weigh_landmarks(z, marks, 0.4, 0.3)(state) == pytest.approx(math.log(weight), abs=1e-12)


def test_bearing_behind_the_robot_is_wrapped():
    weigh = weigh_landmarks([[1.0, math.pi - 0.01]], [[-1.0, 0.0]], std_bearing=0.1)
    assert weigh([0.0, 0.02, 0.0]) == pytest.approx(weigh.best - 0.5 * (0.03 / 0.1) ** 2, abs=1e-3)


@pytest.mark.parametrize(("kwargs", "blind"), [({"std_range": 0.1}, (0, 0, 1.0)), ({"std_bearing": 0.1}, (2.0, 0, 0))])
def test_one_reading_alone(kwargs, blind):
    weigh = weigh_landmarks([[5.0, 0.0]], [[5.0, 0.0]], **kwargs)
    assert weigh(blind) == pytest.approx(weigh.best)


def test_same_measurement_twice_squares_the_ratio():
    """Weights multiply: two equal readings count twice in the exponent, which adding them would not do."""
    once = weigh_landmarks([[5.0, 0.1]], [[5.0, 0.0]], 0.5, 0.1)
    twice = weigh_landmarks([[5.0, 0.1]] * 2, [[5.0, 0.0]] * 2, 0.5, 0.1)
    states = np.array([[0.0, 0, 0], [0.7, 0.2, 0.1]])
    np.testing.assert_allclose(np.diff(twice(states)), 2 * np.diff(once(states)))


@pytest.mark.parametrize("expected", [0.05, 0.5, 3.0, 9.9])
@pytest.mark.parametrize("shares", [(1, 0, 0, 0), (0.7, 0.1, 0.05, 0.15)])
def test_beam_model_is_a_density(expected, shares):
    area = integrate.quad(
        lambda z: float(beam_density(z, np.array(expected), 0.2, 10.0, shares)), 0, 10, points=[expected], limit=200
    )[0]
    assert area == pytest.approx(1 - shares[2], abs=1e-6)


def test_beam_weight_by_hand():
    weigh = weigh_beams(ROOM, [5.0, 1.5], [0.0, math.pi / 2], std=0.5, r_max=20.0, shares=(1, 0, 0, 0))
    # at (1.5, 1.5) 5.5 and 2.5 are expected: one and two standard deviations off
    peak = -2 * math.log(0.5 * math.sqrt(2 * math.pi))
    assert weigh([1.5, 1.5, 0.0]) == pytest.approx(peak - 0.5 - 2.0, abs=1e-5)
    mixed = weigh_beams(ROOM, [5.0], [0.0], 0.5, 20.0, shares=(0.6, 0.2, 0.1, 0.1), decay=0.5)
    by_hand = 0.6 * stats.norm.pdf(1.0) / 0.5 + 0.2 * 0.5 * math.exp(-2.5) / (1 - math.exp(-2.75)) + 0.1 / 20
    assert mixed([1.5, 1.5, 0.0]) == pytest.approx(math.log(by_hand), abs=1e-5)


def test_a_lost_beam_has_zero_weight_in_the_plain_model_only():
    lost = ([20.0], [0.0], 0.5, 20.0)
    assert weigh_beams(ROOM, *lost, shares=(1, 0, 0, 0))([1.5, 1.5, 0.0]) == -np.inf
    assert weigh_beams(ROOM, *lost)([1.5, 1.5, 0.0]) == pytest.approx(math.log(0.05 + 0.1 / 20))


def test_tabulated_beam_weight_is_close_to_the_exact_one(building):
    rng = np.random.default_rng(4)
    ranges, bearings = Scanner().scan(building.grid, (8.0, 5.1, 0.3), rng, every=9)
    states = np.column_stack([rng.uniform(1, 15, 200), rng.uniform(4.5, 5.8, 200), rng.uniform(-3, 3, 200)])
    exact = weigh_beams(building.grid, ranges, bearings, 0.2, 18.0)(states)
    table = weigh_beams(building.grid, ranges, bearings, 0.2, 18.0, step=0.02)(states)
    assert np.abs(exact - table).max() < 1.0 and np.abs(exact - table).mean() < 0.2  # of 60 beams together


def test_likelihood_field_weighting(building):
    field = LikelihoodField(ROOM, 0.5, share_hit=1.0, r_max=6.0)
    weigh = weigh_likelihood_field(field, [5.7, 6.0], [0.0, 1.0])
    assert weigh([[1.5, 1.5, 0.0]])[0] == pytest.approx(weigh.best, abs=1e-6)  # the second reading does not count
    assert weigh.best == pytest.approx(-math.log(0.5 * math.sqrt(2 * math.pi)))


@pytest.mark.parametrize("model", SENSORS)
def test_truth_weighs_more_than_elsewhere(building, model):
    rng, suite = np.random.default_rng(5), SensorSuite(building)
    pose = np.array([8.4, 2.4, 0.7])
    weigh = suite.measure(model, pose, rng)
    others = pt.uniform_states(building.grid, 500, rng)
    assert weigh(pose) > weigh(others).max()
    assert weigh(pose) - weigh.best > -60


def test_door_sensor():
    weigh = weigh_doors([2.0, 5.0], saw_door=True, std=0.3, trust=0.9)
    np.testing.assert_allclose(np.exp(weigh(np.array([2.0, 3.5]))), [0.9, 0.1], atol=1e-5)
    wall = weigh_doors([2.0, 5.0], saw_door=False)
    np.testing.assert_allclose(np.exp(weigh(np.linspace(0, 6, 9))) + np.exp(wall(np.linspace(0, 6, 9))), 1.0)


# --- weights and resampling ------------------------------------------------------------------------------------------


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


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: pt.normalize_weights([-np.inf, -np.inf]), "no particle explains the measurement"),
        (lambda: pt.normalize_weights([0.0, np.nan]), "NaN"),
        (lambda: pt.resample_systematic([0.0, 0.0], None), "not all 0"),
        (lambda: pt.resample_roulette([0.5, -0.1], None), "at least 0"),
        (lambda: pt.resample_roulette([[0.5]], None), "vector (M,)"),
        (lambda: pt.circular_mean([0.0, math.pi]), "cancel"),
        (lambda: weigh_landmarks([[1, 0]], [[0, 0]]), "got neither"),
        (lambda: weigh_landmarks([[1, 0]], [[0, 0], [1, 1]], 0.1), "same shape (m, 2)"),
        (lambda: weigh_beams(ROOM, [1.0], [0.0], 0.1, 5.0, shares=(1, 1, 0, 0)), "add up to 1"),
        (lambda: mcl.recover(1, 1, 1, 0.5, 0.1), "alpha_slow"),
        (lambda: find_route([("a", "b")], "a", "c"), "no chain of edges"),
        (lambda: pt.sample_motion([[0, 0]], (1, 0), 0.1, None), "states must have shape (..., 3), got (1, 2)"),
    ],
)
def test_bad_input_is_named(call, words):
    with pytest.raises(ValueError) as error:
        call()
    assert words in str(error.value)


# --- estimates -------------------------------------------------------------------------------------------------------


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


# --- recovery, adaptive size, the filter -----------------------------------------------------------------------------


def test_recovery_by_hand():
    share, slow, fast = mcl.recover(0.1, 0.5, 0.5, 0.1, 0.5)
    assert (slow, fast) == pytest.approx((0.46, 0.3)) and share == pytest.approx(1 - 0.3 / 0.46)
    assert mcl.recover(0.9, 0.5, 0.5)[0] == 0.0  # better than usual: no random poses


def test_kld_size_against_the_chi_square_quantile():
    for bins in (5, 20, 100):
        exact = stats.chi2.ppf(stats.norm.cdf(2.326), bins - 1) / (2 * 0.05)
        assert pt.kld_size(bins) == pytest.approx(exact, rel=0.01)
    assert pt.kld_size(1) == 1


def test_kld_takes_few_of_a_narrow_cloud_and_many_of_a_wide_one():
    rng = np.random.default_rng(13)
    narrow, wide = rng.normal(0.25, 0.02, (5000, 3)), rng.uniform(-8, 8, (5000, 3))
    assert pt.kld_take(narrow, n_min=100) < 200 < 4000 < pt.kld_take(wide)


def run(building, model, seed, n=60, **options):
    rng = np.random.default_rng(seed)
    suite, drive = SensorSuite(building), random_drive(building, n, rng)
    start = drive.truth[0] if options.pop("local", False) else None
    filter_ = mcl.localizer(building, model, options.pop("size", 2000), rng, start=start, **options)
    steps = [
        filter_.step(u, drive.dt, suite.measure(model, x, rng), rng) for u, x in zip(drive.controls, drive.truth[1:])
    ]
    return filter_, drive, steps


@pytest.mark.parametrize("model", SENSORS)
def test_local_localization_tracks(building, model):
    filter_, drive, _ = run(building, model, 21, n=40, local=True)
    found = filter_.estimate().pose
    assert np.hypot(*(found - drive.truth[-1])[:2]) < 0.2
    assert abs(planar.wrap_angle(found[2] - drive.truth[-1, 2])) < math.radians(6)


def test_global_localization_with_fewer_and_fewer_particles(building):
    kld = {"n_min": 500, "epsilon": 0.01}
    filter_, drive, steps = run(building, "likelihood field", 25, size=5000, recovery=False, kld=kld)
    assert np.hypot(*(filter_.estimate().pose - drive.truth[-1])[:2]) < 0.3
    assert steps[1].n_particles > 1000 and steps[-1].n_particles < 1000


def test_random_poses_of_the_recovery_do_not_keep_the_number_of_particles_up(building):
    kld = {"n_min": 2000, "epsilon": 0.005}
    filter_, drive, steps = run(building, "beams", 25, size=5000, kld=kld)
    assert np.hypot(*(filter_.estimate().pose - drive.truth[-1])[:2]) < 0.3
    assert max(s.n_particles for s in steps[5:]) < 2500
    assert 0 < steps[-1].injected <= 0.5 * len(filter_.states)


def test_threshold_and_every(building):
    never = run(building, "landmarks", 23, n=10, threshold=0.0, recovery=False)[0]
    assert never.count == 10 and np.ptp(never.log_weights) > 10  # weights have multiplied up
    _, _, steps = run(building, "landmarks", 23, n=12, threshold=1.0, every=3, recovery=False)
    assert [s.resampled for s in steps] == [False, False, True] * 4


def test_zero_weights_are_reported_and_the_cloud_is_kept():
    filter_ = mcl.MonteCarloLocalizer(np.full((50, 3), 1.5))
    impossible = weigh_beams(ROOM, [20.0], [0.0], 0.5, 20.0, shares=(1, 0, 0, 0))
    step = filter_.correct(impossible, np.random.default_rng(14))
    assert step.all_zero and step.w_mean == 0 and not step.resampled
    np.testing.assert_allclose(filter_.weights, 1 / 50)


def test_converged_cloud_without_recovery_stays_kidnapped(building):
    errors = []
    for recovery in (False, True):
        rng, suite = np.random.default_rng(15), SensorSuite(building)
        before = random_drive(building, 15, rng, start="office A")
        after = random_drive(building, 40, rng, start="lab")
        filter_ = mcl.localizer(building, "likelihood field", 3000, rng, start=before.truth[0], recovery=recovery)
        for drive in (before, after):
            mcl.record(
                filter_, drive, lambda x, k, rng=rng, suite=suite: suite.measure("likelihood field", x, rng), rng
            )
        errors.append(np.hypot(*(filter_.estimate().pose - after.truth[-1])[:2]))
    assert errors[0] > 1.0 and errors[1] < 0.3


def test_route_and_drive_stay_in_free_space(building):
    assert find_route(building.edges, "office A", "store") == [
        "office A", "door A", "corridor west", "door store", "store",
    ]  # fmt: skip
    drive = random_drive(building, 200, np.random.default_rng(16))
    assert drive.truth.shape == (201, 3) and drive.controls.shape == (200, 2)
    assert (building.grid.at(drive.truth[:, :2]) == maps.FREE).all()
    reckoned = odometry.drive(drive.truth[0], drive.controls, drive.dt)
    assert np.hypot(*(reckoned - drive.truth)[-1, :2]) > 0.3  # odometry alone drifts


def test_landmarks_behind_walls_are_not_seen(building):
    index, z = see_landmarks(building.grid, (8.4, 2.4, 0.0), building.landmarks, np.random.default_rng(17))
    assert set(index) == {15, 16, 17}
    r = np.hypot(*(building.landmarks[index] - (8.4, 2.4)).T)
    np.testing.assert_allclose(z[:, 0], r, atol=0.5)
    assert len(see_landmarks(None, (8.4, 2.4, 0.0), building.landmarks, np.random.default_rng(17))[0]) > 2
