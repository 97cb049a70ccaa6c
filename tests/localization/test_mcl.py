"""The filter: its policies and its recovery by hand, and what it has to do in a building."""

import functools
import math

import numpy as np
import pytest

from labkit.documents.lecture.examples import load_building
from labkit.documents.lecture.printed import example_noise
from labkit.fast.sensors import SensorSuite
from labkit.geometry import planar
from labkit.localization import mcl
from labkit.localization.drives import Drive, random_drive
from labkit.localization.maps import OccupancyGrid
from labkit.localization.particles import KldSampling, effective_size, odometry_motion, uniform_states
from labkit.localization.sensors import SENSORS, Weighting, weigh_beams

ROOM = OccupancyGrid.from_ascii("########\n#......#\n#..#...#\n#......#\n########")
MOTION = odometry_motion(**example_noise())
NEVER, ALWAYS = mcl.when_effective_below(0.0), mcl.every(1)
FAR = 100.0  # where the random poses of these tests come from


@pytest.fixture(scope="module")
def building():
    return load_building()


def stay(states, u, dt, rng):
    return states


def far(n, rng):
    return np.full((n, 3), FAR)


def fits(weight):
    """A measurement that fits every state equally."""
    return Weighting(lambda states: np.full(len(states), math.log(weight)))


def a_filter(n=100, when=ALWAYS, **options):
    return mcl.MonteCarloLocalizer(np.zeros((n, 3)), stay, mcl.Resampling(when), **options)


def steps(filter_, *weightings, seed=1):
    rng = np.random.default_rng(seed)
    return [filter_.step((0.0, 0.0), 0.1, weighting, rng) for weighting in weightings]


# --- when to resample ------------------------------------------------------------------------------------------------


def test_policies_alone_and_combined():
    even, uneven = np.ones(10), np.array([1.0] + 9 * [0.01])
    assert [mcl.every(3)(k, even) for k in range(1, 7)] == [False, False, True] * 2
    assert mcl.when_effective_below(0.5)(1, uneven) and not mcl.when_effective_below(0.5)(1, even)
    assert not NEVER(1, uneven) and not mcl.when_effective_below(1.0)(1, even) and ALWAYS(1, even)
    both, either = mcl.every(2) & mcl.when_effective_below(0.5), mcl.every(2) | mcl.when_effective_below(0.5)
    assert [both(k, w) for k, w in ((1, even), (2, even), (1, uneven), (2, uneven))] == [False, False, False, True]
    assert [either(k, w) for k, w in ((1, even), (2, even), (1, uneven), (2, uneven))] == [False, True, True, True]


def test_weights_multiply_up_between_two_resamplings():
    """The lecture's rule: every third step, the weights of the others kept."""
    half = Weighting(lambda states: np.log(np.where(np.arange(len(states)) < 50, 0.9, 0.3)), best=math.log(0.9))
    reports = steps(a_filter(when=mcl.every(3)), half, half, half, half)
    assert [r.resampled for r in reports] == [False, False, True, False]
    for r, power in zip(reports, (1, 2, 3)):
        np.testing.assert_allclose(r.weights[0] / r.weights[-1], 3.0**power)
        assert r.effective == pytest.approx(effective_size(r.weights)) and r.weights.sum() == pytest.approx(1)
    np.testing.assert_allclose(reports[3].weights[0] / reports[3].weights[-1], 3.0)
    assert reports[0].mean_weight == pytest.approx((1 + 1 / 3) / 2)
    assert reports[1].mean_weight == pytest.approx(0.75 + 0.25 / 3)  # by the weights of the step before


def test_a_report_shows_the_cloud_as_it_was_weighed():
    filter_ = mcl.MonteCarloLocalizer(np.arange(30.0).reshape(10, 3) / 100, stay, mcl.Resampling(ALWAYS))
    (report,) = steps(filter_, Weighting(lambda states: -states[:, 0]))
    np.testing.assert_allclose(report.states, np.arange(30.0).reshape(10, 3) / 100)
    wanted = np.exp(-report.states[:, 0])
    np.testing.assert_allclose(report.weights, wanted / wanted.sum())
    np.testing.assert_allclose(report.estimate.pose, report.weights @ report.states, atol=1e-3)
    assert report.n_particles == 10 and np.ptp(filter_.weights) == 0


def test_no_measurement_is_weighed_twice():
    calls = []
    weighting = Weighting(lambda states: calls.append(1) or np.zeros(len(states)))
    drive = Drive(np.zeros((6, 3)), np.zeros((5, 2)), 0.1)
    pictures = mcl.record(a_filter(), drive, lambda pose, k: weighting if k != 2 else None, np.random.default_rng(1))
    assert len(pictures) == 5 and len(calls) == 4
    assert pictures[2].step.mean_weight is None and (pictures[0].estimate == 0).all()


def test_zero_weights_are_reported_and_the_cloud_is_kept():
    filter_ = mcl.MonteCarloLocalizer(np.full((50, 3), 1.5), stay)
    impossible = weigh_beams(ROOM, [20.0], [0.0], 0.5, 20.0, shares=(1, 0, 0, 0))
    report = filter_.correct(impossible, np.random.default_rng(14))
    assert report.all_zero and report.mean_weight == 0 and not report.resampled
    np.testing.assert_allclose(filter_.weights, 1 / 50)
    tiny = Weighting(lambda states: np.where(np.arange(len(states)) < 25, -2000.0, -3000.0))
    report = filter_.correct(tiny, np.random.default_rng(14))  # a mean weight of 0 in a float, and yet used
    assert not report.all_zero and report.weights[:25].sum() == pytest.approx(1)


def test_another_number_of_particles():
    filter_ = mcl.MonteCarloLocalizer(np.repeat([[1.0, 0, 0], [2.0, 0, 0]], 50, 0), stay, mcl.Resampling(NEVER))
    steps(filter_, Weighting(lambda states: np.where(states[:, 0] > 1.5, 0.0, -np.inf)))
    filter_.resize(300, np.random.default_rng(1))
    assert filter_.states.shape == (300, 3) and (filter_.states[:, 0] == 2.0).all() and filter_.n_max == 300
    np.testing.assert_allclose(filter_.weights, 1 / 300)


# --- recovery and adaptive number ------------------------------------------------------------------------------------


def test_recovery_by_hand():
    share, slow, fast = mcl.recover(0.1, 0.5, 0.5, 0.1, 0.5)
    assert (slow, fast) == pytest.approx((0.46, 0.3)) and share == pytest.approx(1 - 0.3 / 0.46)
    assert mcl.recover(0.9, 0.5, 0.5).share == 0.0  # better than usual: no random poses
    assert mcl.recover(0.0, 0.0, 0.0).share == 0.0


def test_random_poses_come_with_a_measurement_and_when_resampling_is_due():
    recovery = mcl.Recovery(far, least=0.1)
    reports = steps(a_filter(when=mcl.every(2), recovery=recovery), fits(0.5), None, None, fits(0.5), fits(0.5), None)
    assert [r.injected for r in reports] == [0, 0, 0, 10, 0, 0]
    assert [r.resampled for r in reports] == [False, True] * 3
    filter_ = a_filter(recovery=recovery)
    assert [r.injected for r in steps(filter_, *[None] * 20)] == [0] * 20 and (filter_.states == 0).all()
    assert [r.injected for r in steps(a_filter(when=NEVER, recovery=recovery), *[fits(0.5)] * 5)] == [0] * 5
    assert [r.injected for r in steps(a_filter(), fits(0.5), fits(0.01))] == [0, 0]


def test_as_many_random_poses_as_the_averages_ask_for_within_limits():
    recovery = mcl.Recovery(far, least=0.1, most=0.25, alpha_slow=0.1, alpha_fast=0.2)
    assert [recovery.count(asked, 1000) for asked in (0.0, 0.05, 0.18, 0.9)] == [100, 100, 180, 250]
    filter_ = a_filter(1000, recovery=recovery)
    reports = steps(filter_, fits(1.0), fits(0.2))
    asked = 1 - (1 - 0.2 * 0.8) / (1 - 0.1 * 0.8)
    assert [r.injected for r in reports] == [100, 100] and asked < 0.1
    assert (filter_.states[:, 0] == FAR).sum() == pytest.approx(190, abs=20)  # those of before were redrawn, too


def test_averages_start_over_once_they_have_asked_for_random_poses():
    """Else the random poses, which lower the mean weight, would ask for more of their kind."""
    recovery = mcl.Recovery(far, least=0.0, most=0.5, alpha_slow=0.0, alpha_fast=0.5)
    reports = steps(a_filter(recovery=recovery), fits(1.0), fits(0.4), fits(0.4), fits(0.4), fits(0.2))
    assert [r.injected for r in reports] == [0, 30, 0, 0, 25]
    gently = mcl.Recovery(far, least=0.3, most=0.5, alpha_slow=0.0, alpha_fast=0.5)
    reports = steps(a_filter(recovery=gently), fits(1.0), fits(0.8), fits(0.1), fits(0.1))
    assert [r.injected for r in reports] == [30, 30, 50, 30]  # 0.1 asked for is less than the least: no new start


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: mcl.recover(1, 1, 1, 0.5, 0.1), "alpha_slow"),
        (lambda: mcl.Recovery(far, least=0.6), "least must not be above most"),
        (lambda: mcl.every(0), "n must be a whole number, at least 1"),
        (lambda: mcl.when_effective_below(np.nan), "share must be finite"),
        (lambda: a_filter().resize(0, None), "n_particles must be a whole number"),
    ],
)
def test_bad_input_is_named(call, words):
    with pytest.raises(ValueError) as error:
        call()
    assert words in str(error.value)


def test_number_of_particles_follows_the_cloud_and_not_the_random_poses():
    wide = np.random.default_rng(2).uniform(-8, 8, (5000, 3))
    strewn = mcl.Recovery(lambda n, rng: rng.uniform(-8, 8, (n, 3)), least=0.5)
    for recovery in (None, strewn):
        for cloud, few in ((wide, False), (0.01 * wide, True)):
            options = {"recovery": recovery, "adaptive": KldSampling(n_min=500, epsilon=0.05)}
            filter_ = mcl.MonteCarloLocalizer(cloud, stay, mcl.Resampling(ALWAYS), **options)
            reports = steps(filter_, fits(0.5))
            assert (len(filter_.states) < 800) == few, len(filter_.states)
            assert reports[0].injected == (0 if recovery is None else round(len(filter_.states) / 2))
            assert len(filter_.weights) == len(filter_.states)


# --- in the building -------------------------------------------------------------------------------------------------


def errors(filter_, drive, suite, sensor, rng):
    """Distance of the estimate from the robot after each step (m)."""
    found = mcl.record(filter_, drive, lambda pose, k: suite.measure(sensor, pose, rng), rng)
    return np.array([np.hypot(*(picture.estimate - picture.truth)[:2]) for picture in found])


@pytest.mark.parametrize("sensor", SENSORS)
def test_local_localization_tracks(building, sensor):
    rng, suite = np.random.default_rng(21), SensorSuite(building)
    drive = random_drive(building, example_noise(), 40, rng)
    filter_ = mcl.localizer(building.grid, MOTION, 2000, rng, start=drive.truth[0], recovery=False)
    assert errors(filter_, drive, suite, sensor, rng).max() < 0.5
    found = filter_.estimate().pose
    assert abs(planar.wrap_angle(found[2] - drive.truth[-1, 2])) < math.radians(15)


def test_a_first_cloud_about_a_pose_and_all_over_the_map():
    rng = np.random.default_rng(3)
    near = mcl.localizer(ROOM, MOTION, 4000, rng, start=(2.0, 3.0, 1.0), recovery=False)
    np.testing.assert_allclose(near.states.mean(0), (2, 3, 1), atol=0.03)
    np.testing.assert_allclose(near.states.std(0), (0.2, 0.2, 0.1), rtol=0.1)
    with pytest.raises(ValueError, match="n_particles must be at most"):
        mcl.localizer(ROOM, MOTION, 10**15, rng)
    everywhere = mcl.localizer(ROOM, MOTION, 4000, rng)
    assert (ROOM.at(everywhere.states[:, :2]) == 0).all() and near.recovery is None
    assert (ROOM.at(everywhere.recovery.draw(50, rng)[:, :2]) == 0).all()


def test_converged_cloud_without_recovery_stays_kidnapped(building):
    """Ten steps of at most 0.3 m cannot carry the cloud over the 8 m that the robot was carried: no draw matters."""
    rng, suite, noise = np.random.default_rng(15), SensorSuite(building), example_noise()
    before = random_drive(building, noise, 10, rng, start="office A")
    after = random_drive(building, noise, 10, rng, start="lab")
    assert np.hypot(*(before.truth[-1] - after.truth[0])[:2]) > 8
    filter_ = mcl.localizer(building.grid, MOTION, 1000, rng, start=before.truth[0], recovery=False)
    errors(filter_, before, suite, "likelihood field", rng)
    assert errors(filter_, after, suite, "likelihood field", rng).min() > 2.0


def test_recovery_finds_a_kidnapped_robot(building):
    """60 steps suffice with a probability of 0.96 at least (data/monte_carlo/success.csv), so 300 but for 1e-7."""
    rng, suite, noise = np.random.default_rng(15), SensorSuite(building), example_noise()
    drive = random_drive(building, noise, 300, rng, start="lab")
    office = (*building.nodes["office A"], 0.0)
    filter_ = mcl.localizer(building.grid, MOTION, 5000, rng, start=office)
    for u, pose in zip(drive.controls, drive.truth[1:]):
        report = filter_.step(u, drive.dt, suite.measure("landmarks", pose, rng), rng)
        if np.hypot(*(report.estimate.pose - pose)[:2]) < 0.3:
            return
    raise AssertionError("not found in 300 steps")


def test_random_poses_are_drawn_from_the_whole_building(building):
    draw = functools.partial(uniform_states, building.grid)
    poses = draw(500, np.random.default_rng(1))
    assert (building.grid.at(poses[:, :2]) == 0).all() and np.ptp(poses[:, 0]) > 12 and np.ptp(poses[:, 1]) > 7


def test_many_measurements_lose_no_digit_of_the_weights():
    """Two hundred times a factor of 0.99 between neighbors, and a billionth for all of them."""
    cloud = mcl.MonteCarloLocalizer(np.zeros((4, 3)), stay, mcl.Resampling(NEVER))
    each = np.log(1e-9) + np.log(0.99) * np.arange(4)
    for _ in range(200):
        cloud._weigh(Weighting(lambda states: each))
    expected = 0.99 ** (200 * np.arange(4))
    np.testing.assert_allclose(cloud.weights, expected / expected.sum(), rtol=1e-9)
