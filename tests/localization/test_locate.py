"""A robot found from its own log: clocks, a global start, errors and restarts beside a simulated truth."""

import dataclasses

import numpy as np
import pytest
from scipy import stats

from labkit.estimation.differences import numeric_jacobian
from labkit.fast.path import filter_path
from labkit.geometry.planar import compose_pose, wrap_angle
from labkit.localization import locate as room
from labkit.localization import odometry, path
from labkit.localization.path import Log, Noise

MARKS = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 8.0], [0.0, 8.0], [5.0, 11.0], [-4.0, 5.0]])
NAMES = list("abcdef")
NOISE = {"std_range": 0.05, "std_bearing": 0.02, "std_way": 0.03, "std_turn": 0.02}
DT = 0.1


def course(n=300, seed=1, noise=1.0):
    """(time, u, truth, rows and times of the readings, ids, z): every third row a reading, some between two rows."""
    rng = np.random.default_rng(seed)
    time = 5.0 + DT * np.arange(n)
    u = np.stack([0.6 + 0.2 * np.sin(0.05 * np.arange(n)), 0.3 * np.cos(0.03 * np.arange(n))], 1)
    driven = u + noise * rng.normal(size=u.shape) * [0.03, 0.02] / np.sqrt(DT)
    truth = odometry.drive(np.array([4.0, 3.0, 2.8]), driven[:-1], DT, "midpoint")
    rows, late = np.arange(1, n - 1, 3), np.where(np.arange(1, n - 1, 3) % 2, 0.04, 0.0)
    at = np.array(
        [odometry.step(truth[k], driven[k], lag, "midpoint") if lag else truth[k] for k, lag in zip(rows, late)]
    )
    ids = rng.integers(len(MARKS), size=len(rows))
    z = np.array([path.measurement(x, MARKS[m : m + 1])[0] for x, m in zip(at, ids)])
    z += noise * rng.normal(size=z.shape) * [0.05, 0.02]
    return time, u, truth, rows, time[rows] + late, ids, z


def as_log(time, u, rows, when, ids, z):
    return Log(time, u, z, rows, when - time[rows], ids, MARKS)


def located(time, u, when, ids, z, **more):
    names = [None if m < 0 else NAMES[m] for m in ids]
    given = {"noise": NOISE, "filter_path": filter_path, **more}
    return room.locate(time, u, when, names, z, NAMES, MARKS, **given)


# --- clocks ----------------------------------------------------------------------------------------------------------


def test_a_clock_that_was_set_goes_on_by_a_usual_step():
    steps = np.array([0.1, 0.1, 0.4, 0.1, -3.0, 0.1, 0.0, 0.1, 7.0, 0.1])  # 0.4 s is a pause, 7 s a jump
    clean, starts, said = room.mend_clock(2.0 + np.concatenate([[0.0], np.cumsum(steps)]))
    usual = np.where((steps < 0) | (steps > 5), 0.1, steps)
    np.testing.assert_allclose(clean, np.concatenate([[0.0], np.cumsum(usual)]), atol=1e-12)
    assert starts.tolist() == [0, 5, 9]
    assert "jumps by -3 s before row 6; a step of 0.1 s" in said[0] and "jumps by +7 s before row 10" in said[1]


def test_a_slow_clock_may_pause_for_ten_of_its_steps():
    for gap, starts in ((9.9, [0]), (10.1, [0, 3])):
        assert room.mend_clock(np.cumsum([0, 1.0, 1.0, gap, 1.0, 1.0]))[1].tolist() == starts


@pytest.mark.parametrize(("jumps", "lines"), [(5, 5), (6, 6), (9, 6)])
def test_many_jumps_are_counted(jumps, lines):
    said = room.mend_clock(np.tile(0.1 * np.arange(4), jumps + 1))[2]
    assert len(said) == lines and (lines == 5 or said[-1] == f"and {jumps - 5} jumps more")


def test_a_clock_that_stands_is_refused():
    with pytest.raises(ValueError, match="never increases"):
        room.mend_clock(np.ones(5))


def test_readings_fall_into_the_last_row_before_them():
    time = np.array([1.0, 1.1, 1.2, 1.3])
    row, lag = room.place_readings(time, np.array([0]), np.array([0.99, 1.0, 1.15, 1.3, 1.36, 1.41]))
    assert row.tolist() == [-1, 0, 1, 3, 3, -1]
    np.testing.assert_allclose(lag, [0.0, 0.0, 0.05, 0.0, 0.06, 0.0], atol=1e-12)


def test_times_that_come_twice_belong_to_the_part_their_order_tells():
    time = np.concatenate([0.1 * np.arange(10), 0.1 * np.arange(10), 0.5 + 0.1 * np.arange(10)])
    readings = np.array([0.32, 0.72, 0.12, 0.62, 1.32, 0.72])
    row, lag = room.place_readings(time, np.array([0, 10, 20]), readings)
    assert row.tolist() == [3, 7, 11, 16, 28, 22]
    np.testing.assert_allclose(lag, 0.02, atol=1e-9)


def test_a_reading_may_belong_to_an_earlier_part_and_parts_must_rise():
    time = np.concatenate([0.1 * np.arange(10), 2 + 0.1 * np.arange(10), 5 + 0.1 * np.arange(10)])
    row, lag = room.place_readings(time, np.array([0, 10, 20]), np.array([5.12, 0.32]))
    assert row.tolist() == [21, 3]
    np.testing.assert_allclose(lag, 0.02, atol=1e-9)
    for starts in ([0, 20, 10], [0, 10, 40], [3, 10, 20]):
        with pytest.raises(ValueError, match="starts must rise from 0"):
            room.place_readings(time, np.array(starts), np.array([0.5]))


# --- a global start --------------------------------------------------------------------------------------------------


def test_exact_readings_name_the_first_pose():
    time, u, truth, rows, when, ids, z = course(120, noise=0.0)
    x0, cov0 = room.global_start(as_log(time, u, rows, when, ids, z), Noise(**NOISE), np.random.default_rng(0))
    np.testing.assert_allclose(x0[:2], truth[0, :2], atol=1e-5)
    assert abs(wrap_angle(x0[2] - truth[0, 2])) < 1e-5

    def predicted(x):
        way = odometry.drive(x, u[:119], DT, "midpoint")
        at = [
            odometry.step(way[k], u[k], lag, "midpoint") if lag > 1e-9 else way[k]
            for k, lag in zip(rows, when - time[rows])
        ]
        z = np.array([path.measurement(p, MARKS[m : m + 1])[0] for p, m in zip(at, ids)])[: room.WINDOW]
        return (z / [3 * NOISE["std_range"], 3 * NOISE["std_bearing"]]).ravel()

    J = numeric_jacobian(predicted, truth[0], np.full(3, 1e-6))
    np.testing.assert_allclose(cov0, room.WEAK_PRIOR * np.linalg.inv(J.T @ J), rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize("named", [True, False])
def test_spurious_and_nameless_readings_do_not_mislead(named):
    time, u, truth, rows, when, ids, z = course(150, seed=4)
    z[2], z[7], z[11] = [3.0, 2.0], [9.0, -1.0], [1.0, 0.3]
    ids = ids if named else np.where(np.arange(len(ids)) % 3 == 0, -1, ids)
    x0, cov0 = room.global_start(as_log(time, u, rows, when, ids, z), Noise(**NOISE), np.random.default_rng(0))
    assert np.hypot(*(x0 - truth[0])[:2]) < 0.15 and abs(wrap_angle(x0[2] - truth[0, 2])) < 0.05
    assert np.linalg.eigvalsh(cov0).min() > 0


def test_a_start_that_nothing_explains_is_refused():
    time, u, _, rows, when, ids, z = course(120)
    log = as_log(time, u, rows, when, ids, z)
    with pytest.raises(ValueError, match="at least 4 readings, got 3"):
        room.global_start(log.readings(np.arange(len(log.z)) < 3), Noise(**NOISE), np.random.default_rng(0))
    wild = dataclasses.replace(log, z=np.random.default_rng(2).uniform([1, -3], [12, 3], log.z.shape))
    with pytest.raises(ValueError, match=r"fits \d+ of the first 30"):
        room.global_start(wild, Noise(**NOISE), np.random.default_rng(0))


@pytest.mark.parametrize("named", [True, False])
def test_every_proposed_pose_would_read_what_was_read(named):
    time, u, truth, rows, when, ids, z = course(60)
    log = as_log(time, u, rows, when, ids if named else np.full(len(ids), -1), z)
    way = np.array([0.7, -0.4, 0.9])  # since the first row
    poses = room._around(log, 4, way, np.random.default_rng(3))
    marks = MARKS[ids[4] : ids[4] + 1] if named else MARKS
    assert poses.shape == (len(marks) * room.PARTICLES, 3)
    for mark, some in zip(marks, poses.reshape(len(marks), room.PARTICLES, 3)):
        at = np.array([compose_pose(x, way) for x in some])
        off = np.array([path.measurement(x, mark[None])[0] for x in at]) - z[4]
        off[:, 1] = wrap_angle(off[:, 1])
        np.testing.assert_allclose(off, 0, atol=1e-9)
        around = np.sort(np.arctan2(*(at[:, :2] - mark).T[::-1]))
        assert np.diff(around).max() < 0.3  # from all sides


def test_a_reading_without_a_name_is_of_the_mark_it_fits_best():
    x, way, std = np.array([[4.0, 3.0, 2.8], [1.0, 1.0, -2.0]]), np.array([0.7, -0.4, 0.9]), np.array([0.1, 0.05])
    z = np.array([5.0, -3.0])
    for pose_, found, total in zip(
        x, room._difference(x, way, z, -1, MARKS, std), room._misfits(x, way, z, -1, MARKS, std)
    ):
        off = z - path.measurement(compose_pose(pose_, way), MARKS)
        off[:, 1] = wrap_angle(off[:, 1])
        off /= std
        np.testing.assert_allclose(found, off[np.argmin(np.hypot(*off.T))])
        assert total == pytest.approx((off**2).sum(1).min())
    named = room._difference(x, way, z, 2, MARKS, std)[0]
    off = z - path.measurement(compose_pose(x[0], way), MARKS[2:3])[0]
    np.testing.assert_allclose(named, [off[0] / 0.1, wrap_angle(off[1]) / 0.05])


# --- the whole -------------------------------------------------------------------------------------------------------


def test_errors_and_figures_against_the_truth():
    time, u, truth, _, when, ids, z = course()
    found = located(time, u, when, ids, z, truth=(time[20:250], truth[20:250]))
    e = found.x - truth
    e[:, 2] = wrap_angle(e[:, 2])
    inside = np.zeros(len(time), bool)
    inside[20:250] = True
    assert np.isnan(found.errors[~inside]).all() and np.isnan(found.nees[~inside]).all()
    np.testing.assert_allclose(found.errors[inside], e[inside], atol=1e-9)
    nees = [d @ np.linalg.inv(cov) @ d for d, cov in zip(e, found.cov)]
    np.testing.assert_allclose(found.nees[inside], np.array(nees)[inside], rtol=1e-6)
    told = found.as_dict()
    assert told["rms_position"] == pytest.approx(np.sqrt((e[inside, :2] ** 2).sum(1).mean()))
    assert told["rms_heading_deg"] == pytest.approx(np.rad2deg(np.sqrt((e[inside, 2] ** 2).mean())))
    assert told["mean_nees"] == pytest.approx(np.mean(nees, where=inside))
    assert told["rms_position"] < 0.1 and told["mean_nis"] == pytest.approx(found.nis[found.used].mean())
    assert 1.0 < told["mean_nis"] < 3.5 and told["mean_nis_band"][0] < 2 < told["mean_nis_band"][1]
    assert told["fitted"] == [] and told["noise"] == NOISE
    n = int(found.used.sum())  # the sum of their NIS has two degrees of freedom a reading
    np.testing.assert_allclose(told["mean_nis_band"], stats.chi2.ppf([0.005, 0.995], 2 * n) / n, rtol=1e-6)


def test_between_the_samples_of_the_truth_the_way_is_straight():
    time, u, truth, _, when, ids, z = course()
    found = located(time, u, when, ids, z, truth=(time[::2], truth[::2]))
    middle = 0.5 * (truth[0:-2:2] + truth[2::2])
    d = found.x[1:-1:2] - middle
    d[:, 2] = wrap_angle(d[:, 2])
    np.testing.assert_allclose(found.errors[1:-1:2], d, atol=1e-9)


def test_the_path_is_the_filter_s_from_the_same_start():
    time, u, _, rows, when, ids, z = course()
    found = located(time, u, when, ids, z)
    clean = room.mend_clock(time)[0]
    log = Log(clean, u, z, rows, when - time[rows], ids, MARKS)
    x0, cov0 = room.global_start(log.rows(0, len(time) - 1), Noise(**NOISE), np.random.default_rng(0))
    plain = path.filter_path(log, x0, cov0, Noise(**NOISE))
    np.testing.assert_allclose(found.x, plain.x, atol=1e-6)
    np.testing.assert_allclose(found.cov, plain.cov, atol=1e-8)
    np.testing.assert_allclose(found.nis, plain.nis, rtol=1e-4, atol=1e-6)


def test_why_a_reading_was_not_used():
    time, u, _, _, when, ids, z = course()
    z[40] += [4.0, 1.0]
    when = np.append(when, time[-1] + 50)
    names = [*(NAMES[m] for m in ids), "a"]
    names[10] = "unknown"
    found = room.locate(
        time, u, when, names, np.vstack([z, [3.0, 0.0]]), NAMES, MARKS, noise=NOISE, filter_path=filter_path
    )
    assert found.why[10] == "its id is not in the map" and found.why[-1] == "no odometry at its time"
    assert found.why[40] == "beyond the gate"
    assert not found.used[[10, 40, -1]].any() and np.isnan(found.nis[[10, -1]]).all()
    rejected = {row["reading"]: row["why"] for row in found.as_dict()["rejected"]}
    assert rejected[11] == found.why[10] and rejected[41] == found.why[40] and rejected[len(z) + 1] == found.why[-1]


def test_a_carried_robot_is_found_again():
    time, u, truth, rows, when, ids, z = course(400, seed=6)
    n = 200
    moved = odometry.drive(np.array([7.0, 6.0, -2.0]), u[n:-1], DT, "midpoint")
    for k in np.flatnonzero(rows >= n):
        at = odometry.step(moved[rows[k] - n], u[rows[k]], max(when[k] - time[rows[k]], 1e-9), "midpoint")
        z[k] = path.measurement(at, MARKS[ids[k] : ids[k] + 1])[0]
    found = located(time, u, when, ids, z)
    assert len(found.restarts) == 1 and n <= found.restarts[0] <= n + 6
    assert "lost and found again at row" in found.warnings[-1]
    assert found.as_dict()["restarts"] == [found.restarts[0] + 1]
    after = slice(found.restarts[0], None)
    np.testing.assert_allclose(found.x[after, :2], moved[found.restarts[0] - n :, :2], atol=0.1)
    before = slice(0, n)
    assert np.hypot(*(found.x - truth)[before, :2].T).max() < 0.3


def test_rows_before_the_first_readings_that_agree_are_dead_reckoning():
    time, u, truth, rows, when, ids, z = course(400, seed=7, noise=0.0)
    wild = np.random.default_rng(8).uniform([1, -3], [12, 3], z.shape)
    early = rows < 100
    z[early] = wild[early]
    found = located(time, u, when, ids, z)
    assert "first" in " ".join(found.warnings) and "backwards" in " ".join(found.warnings)
    first = int(next(w for w in found.warnings if "backwards" in w).split()[2])
    np.testing.assert_allclose(found.x[:first, :2], truth[:first, :2], atol=0.05)
    np.testing.assert_allclose(wrap_angle(found.x[:first, 2] - truth[:first, 2]), 0, atol=0.02)
    np.testing.assert_allclose(found.cov[0], found.cov[first] + np.diag([1.0, 1.0, 0.1]))


def test_behind_a_jump_of_the_clock_no_error_is_told():
    time, u, truth, _, when, ids, z = course()
    jumped, late = time.copy(), when.copy()
    jumped[150:] += 100.0
    late[when >= time[150] - 1e-9] += 100.0
    found = located(jumped, u, late, ids, z, truth=(jumped, truth))
    assert np.isfinite(found.nees[:150]).all() and np.isnan(found.nees[150:]).all()
    assert "jumps" in found.warnings[0] and np.hypot(*(found.x - truth)[:, :2].T).max() < 0.3


def test_noise_that_is_fitted_is_near_what_was_drawn():
    """Of 200 readings the noise is known within 10 %, that of the odometry within 30 %: three times that."""
    time, u, _, _, when, ids, z = course(600, seed=9)
    found = located(time, u, when, ids, z, noise=None)
    assert found.fitted == room.NAMES
    for name, share in zip(room.NAMES, (0.3, 0.3, 0.9, 0.9)):
        assert abs(getattr(found.noise, name) / NOISE[name] - 1) < share
    some = located(time, u, when, ids, z, noise={"std_range": 0.05})
    assert some.noise.std_range == 0.05 and some.fitted == room.NAMES[1:]
    assert "std_range 0.05 m," in some.lines()[1] and "(fitted)" in some.lines()[1]


def test_a_notebook_shows_the_lines_as_a_list():
    time, u, _, _, when, ids, z = course(120)
    found = located(time, u, when, ids, z)
    shown = dataclasses.replace(found, warnings=("a < b",))._repr_html_()
    assert shown.startswith("<ul><li>120 poses from") and shown.endswith("<li>warning: a &lt; b</li></ul>")
    assert shown.count("<li>") == len(found.lines()) + 1 and repr(found) == "\n".join(found.lines())


def test_a_mean_over_the_readings_used_is_told_when_some_are_not():
    time, u, truth, rows, when, ids, z = course(60)
    z[5] += [3.0, 1.0]
    found = located(time, u, when, ids, z)
    assert not found.used[5] and found.used.sum() > 12
    told = found.as_dict()["mean_nis"]
    assert told == pytest.approx(found.nis[found.used].mean()) and 0.3 < told < 4


@pytest.mark.parametrize(("readings", "tries"), [(34, 2), (31, 2), (20, 2), (19, 1), (100, 7), (400, 13)])
def test_a_start_is_looked_for_every_half_window_and_not_for_ever(readings, tries, monkeypatch):
    """At readings 0, 15, 30, ... as long as four would be left behind the next, and up to six windows."""
    asked = []

    def refuse(part, noise, rng):
        asked.append(len(part.z))
        raise ValueError("none fits")

    monkeypatch.setattr(room, "global_start", refuse)
    time, u, truth, rows, when, ids, z = course(3 * readings + 2)
    log = as_log(time, u, rows, when, ids, z)
    assert len(log.z) == readings
    with pytest.raises(ValueError, match="none fits"):
        room._first_start(log, Noise(**NOISE), np.random.default_rng(0))
    assert asked == [readings - 15 * k for k in range(tries)]


def test_after_a_restart_the_filter_has_a_window_of_readings_to_settle(monkeypatch):
    """A filter that uses nothing is lost at its twelfth reading, and begun anew, not before the 31st, at the 20th."""
    monkeypatch.setattr(room, "global_start", lambda log, noise, rng: (np.zeros(3), np.eye(3)))
    time, u, truth, rows, when, ids, z = course(302)

    def useless(log, x0, cov0, noise):
        n, k = len(log.time), len(log.z)
        nothing = np.zeros(k)
        return path.Path(np.zeros((n, 3)), np.tile(np.eye(3), (n, 1, 1)), nothing, nothing, nothing > 0, log.landmark)

    log = as_log(time, u, rows, when, ids, z)
    _, restarts, _ = room._with_restarts(log, np.zeros(3), np.eye(3), 0, Noise(**NOISE), None, useless)
    assert restarts == tuple(rows[:77:19].tolist())


# --- noise -----------------------------------------------------------------------------------------------------------


def stub(log, nis_and_log_det):
    """A filter that knows the NIS and log det S of each reading for every standard deviation of the range."""

    def filter_stub(part, x0, cov0, noise):
        told = [np.broadcast_to(v, len(log.z)) for v in nis_and_log_det(noise.std_range)]
        return path.Path(np.zeros((1, 3)), np.eye(3)[None], *told, np.ones(len(log.z), bool), log.landmark)

    return filter_stub


def test_fitted_noise_has_the_greatest_likelihood_of_a_mixture():
    """Against a search through a grid. Half of the readings hold the logarithm of the noise by a parabola, the other
    half pull it down, the less the nearer their density comes to that of readings that mean nothing: a fifth more or
    less of that moves the optimum by 0.2."""
    levels, middle = np.linspace(-3, 0, 3001), np.log(0.2)
    log = as_log(*(course(62)[k] for k in (0, 1, 3, 4, 5, 6)))
    reach, held = log.z[:, 0].max(), np.arange(len(log.z)) < 10
    assert len(log.z) == 20 and reach > 2

    def told(std):
        level = np.log(std)
        falling = 2 * (np.log(9 * reach) + 2 * (level - middle))
        return np.where(held, 1.25 * (level - middle - 0.8) ** 2, 0.0), np.where(held, -20.0, falling)

    def mixture(level):
        nis, log_det = told(np.exp(level))
        density = np.exp(-0.5 * (nis + log_det)) / (2 * np.pi)
        return -np.log(0.9 * density + 0.1 / (2 * np.pi * reach)).sum() + 0.01 * (level - middle) ** 2

    best = levels[np.argmin([mixture(level) for level in levels])]
    noise = Noise(0.2, 0.05, 0.05, 0.05)
    found = room.fit_noise(log, np.zeros(3), np.eye(3), noise, ("std_range",), stub(log, told))
    assert abs(np.log(found.std_range) - best) < 0.06
    assert (found.std_bearing, found.std_way, found.std_turn) == (0.05, 0.05, 0.05)


@pytest.mark.parametrize("pull", [0.0, 1.0, -1.0])
def test_what_the_readings_do_not_tell_stays_near_the_start(pull):
    """A likelihood that falls by 0.02 for each factor e moves the logarithm by one: 0.01 times its square holds it."""
    log = as_log(*(course(60)[k] for k in (0, 1, 3, 4, 5, 6)))
    noise = Noise(0.3, 0.05, 0.05, 0.05)
    flat = stub(log, lambda std: (0.04 * pull * np.log(std) / len(log.z), -20.0))
    found = room.fit_noise(log, np.zeros(3), np.eye(3), noise, ("std_range",), flat)
    assert abs(np.log(found.std_range / 0.3) + pull) < 0.05


def test_noise_is_fitted_to_the_first_readings_and_the_rows_they_need(monkeypatch):
    monkeypatch.setattr(room, "FIT_READINGS", 7)
    log, seen = as_log(*(course(60)[k] for k in (0, 1, 3, 4, 5, 6))), []

    def look(part, x0, cov0, noise):
        seen.append(part)
        return stub(part, lambda std: (0.0, 0.0))(part, x0, cov0, noise)

    room.fit_noise(log, np.zeros(3), np.eye(3), Noise(**NOISE), ("std_range",), look)
    np.testing.assert_array_equal(seen[0].z, log.z[:7])
    np.testing.assert_array_equal(seen[0].time, log.time[: log.row[6] + 2])  # from the row of the last to the next
