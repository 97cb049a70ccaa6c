"""The filter along a log against its tuned twin, and the whole localization against a simulated truth."""

import numpy as np
import pytest

from labkit.fast import path as fast
from labkit.geometry.planar import compose_pose
from labkit.localization import odometry, path
from labkit.localization.locate import locate
from labkit.localization.path import Log, Noise

NOISE = Noise(0.1, 0.03, 0.03, 0.03)
MARKS = np.array([[0.0, 0], [10, 0], [10, 8], [0, 8], [5, 11], [-3, 4]])


def drive(seed, n=4000, dt=0.02, k=300, noise=NOISE, spurious=0.0, unknown=0.0):
    """A simulated log, the true poses at its rows, and which readings are spurious."""
    rng = np.random.default_rng(seed)
    time = dt * np.arange(n)
    u = np.stack([0.6 + 0.2 * np.sin(0.1 * time), 0.35 * np.sin(0.07 * time) + 0.15], 1)
    real = u + rng.normal(size=(n, 2)) * [noise.std_way, noise.std_turn] / np.sqrt(dt)
    x = odometry.drive(np.array([4.0, 3.0, 0.5]), real[:-1], dt, "midpoint")
    row = np.sort(rng.integers(0, n - 1, k))
    lag = dt * rng.random(k)
    lag[::7] = 0.0
    order = np.lexsort((lag, row))
    row, lag = row[order], lag[order]
    seen = rng.integers(0, len(MARKS), k)
    at = np.array([odometry.step(x[r], real[r], t + 1e-15, "midpoint") for r, t in zip(row, lag)])
    z = np.array([path.measurement(p, MARKS[m : m + 1])[0] for p, m in zip(at, seen)])
    z += rng.normal(size=(k, 2)) * [noise.std_range, noise.std_bearing]
    bad = rng.random(k) < spurious
    z[bad] = np.stack([rng.uniform(0.5, 15, bad.sum()), rng.uniform(-3, 3, bad.sum())], 1)
    landmark = np.where(rng.random(k) < unknown, -1, seen)
    return Log(time, u, z, row, lag, landmark, MARKS), x, bad


@pytest.mark.parametrize("seed, spurious, unknown", [(0, 0.0, 0.0), (1, 0.2, 0.0), (2, 0.15, 0.3)])
def test_the_tuned_filter_equals_the_readable_one(seed, spurious, unknown):
    log, x, _ = drive(seed, n=500, k=90, spurious=spurious, unknown=unknown)
    cov0 = np.diag([0.04, 0.09, 0.01])
    slow, quick = (module.filter_path(log, x[0], cov0, NOISE) for module in (path, fast))
    assert np.allclose(quick.x, slow.x, atol=1e-9) and np.allclose(quick.cov, slow.cov, rtol=1e-7, atol=1e-12)
    assert np.allclose(quick.nis, slow.nis, rtol=1e-6) and np.allclose(quick.log_det, slow.log_det)
    assert (quick.used == slow.used).all() and (quick.landmark == slow.landmark).all()


@pytest.mark.parametrize("order", [[0, 1, 2, 3], [1, 0, 3, 2], [2, 0, 1, 3], [3, 2, 1, 0]])
@pytest.mark.parametrize("apart", [0.05, 3.0])
def test_a_nameless_reading_that_fits_two_marks_is_used_for_none(order, apart):
    """Two marks side by side and two far ones, in any order; both filters."""
    log, x, _ = drive(4, n=60, k=5)
    near = x[log.row[0], :2] + [2.0, 1.0]
    marks = np.array([near, near + [0.0, apart], near + [9.0, 9.0], near - [9.0, 5.0]])
    z = path.measurement(odometry.step(x[log.row[0]], log.u[log.row[0]], log.lag[0] + 1e-12, "midpoint"), marks[:1])
    one = log.readings(np.arange(len(log.z)) < 1)
    log = Log(one.time, one.u, z, one.row, one.lag, np.array([-1]), marks[order])
    for module in (path, fast):
        found = module.filter_path(log, x[0], np.diag([0.01, 0.01, 0.001]), NOISE)
        assert found.used.tolist() == [apart > 1] and found.landmark[0] == (order.index(0) if apart > 1 else -1)


@pytest.mark.parametrize("k", [0, 1])
def test_few_readings_or_none(k):
    log, x, _ = drive(3, n=50, k=max(k, 1))
    log = log.readings(np.arange(len(log.z)) < k)
    slow, quick = (module.filter_path(log, x[0], np.diag([0.04, 0.09, 0.01]), NOISE) for module in (path, fast))
    assert len(quick.x) == 50 and np.allclose(quick.x, slow.x) and np.allclose(quick.cov, slow.cov)
    assert len(quick.nis) == k


# --- from nothing ----------------------------------------------------------------------------------------------------


def located(log, **options):
    ids = [None if m < 0 else str(m) for m in log.landmark]
    names = [str(m) for m in range(len(MARKS))]
    when = options.pop("when", log.time[log.row] + log.lag)
    time = options.pop("time", log.time)
    return locate(time, log.u, when, ids, log.z, names, MARKS, filter_path=fast.filter_path, **options)


def test_a_sixth_of_spurious_readings_and_unknown_ids():
    log, x, bad = drive(5, n=12000, k=900, spurious=1 / 6, unknown=0.2)
    found = located(log, truth=(log.time, x))
    about = found.as_dict()
    assert about["rms_position"] < 0.12 and about["rms_heading_deg"] < 3
    assert (~found.used[bad]).mean() > 0.97 and found.used[~bad].mean() > 0.99
    for name in ("std_range", "std_bearing"):
        assert abs(np.log(getattr(found.noise, name) / getattr(NOISE, name))) < 0.25  # 600 readings were fitted
    assert 1.7 < found.mean_nis < 2.4 and 1.5 < about["mean_nees"] < 6  # one drive: errors next to each other are alike


def test_ids_outside_the_map_and_times_outside_the_log_are_named():
    log, x, _ = drive(6, n=3000, k=200)
    when = log.time[log.row] + log.lag
    when[5], landmark = 1e6, log.landmark.copy()
    landmark[7] = 99
    found = located(Log(log.time, log.u, log.z, log.row, log.lag, landmark, MARKS), when=when)
    assert found.why[5] == "no odometry at its time" and found.why[7] == "its id is not in the map"
    assert found.used.sum() >= 195


@pytest.mark.parametrize("jump", [-7.0, -0.4, 3600.0])
def test_a_clock_that_jumps_costs_nothing(jump):
    log, x, _ = drive(7, n=6000, k=400)
    raw = log.time + np.where(np.arange(6000) >= 2500, jump, 0.0)
    when = raw[log.row] + log.lag
    found = located(log, time=raw, when=when, noise=vars(NOISE))
    assert found.used.mean() > 0.97
    error = np.linalg.norm(found.x[:, :2] - x[:, :2], axis=1)
    assert np.sqrt((error**2).mean()) < 0.15 and "before row 2501" in found.warnings[0]


def test_a_robot_carried_away_is_found_again():
    log, x, _ = drive(8, n=6000, k=500)
    z, late = log.z.copy(), log.row >= 3000
    there = compose_pose(np.array([3.0, -2.0, 2.0]), x)  # carried in row 3000, and driving on
    z[late] = [path.measurement(there[r], MARKS[m][None])[0] for r, m in zip(log.row[late], log.landmark[late])]
    found = located(Log(log.time, log.u, z, log.row, log.lag, log.landmark, MARKS), noise=vars(NOISE))
    assert len(found.restarts) == 1 and 3000 <= found.restarts[0] < 3300
    assert "found again" in found.warnings[-1]
    after = slice(found.restarts[0] + 200, None)
    assert np.linalg.norm(found.x[after, :2] - there[after, :2], axis=1).max() < 0.5


def test_what_nothing_explains_is_refused():
    log, _, _ = drive(9, n=3000, k=100)
    rng = np.random.default_rng(0)
    z = np.stack([rng.uniform(0.5, 15, 100), rng.uniform(-3, 3, 100)], 1)
    with pytest.raises(ValueError, match="no pose explains the readings: the best one fits"):
        located(Log(log.time, log.u, z, log.row, log.lag, log.landmark, MARKS))
    with pytest.raises(ValueError, match="only 0 readings name a landmark of the map at a time"):
        located(log, when=np.full(100, -1e5))
    with pytest.raises(ValueError, match="never increases"):
        located(log, time=np.zeros(3000))
