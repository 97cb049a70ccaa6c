"""Stages of chapter 6: what they compute, against closed forms, and that each draws, fails and recovers."""

import threading
import time

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from labkit.chapters.ch06_tracker import stages as wr
from labkit.chapters.ch06_tracker import whole_cell as wc
from labkit.machines import simulation, stations, udp
from labkit.machines.arm import (
    BASE_HEIGHT,
    HOME,
    REACH_FLANGE,
    SHOULDER_OFFSET,
    TX40,
    forward_kinematics,
    within_limits,
)
from labkit.machines.packet import POSITION, decode_packet
from labkit.tables import read_table

ALL = (
    wr.tx40,
    wr.live_tracker,
    wr.two_axes,
    wr.dynamic_errors,
    wr.methods,
    wr.six_runs,
    wr.sweeps,
    wr.moved_station,
    wr.over_speed,
)


@pytest.mark.parametrize("make", ALL)
def test_draws_fails_and_recovers(make):
    stage = make()
    before = stage.png()
    stage.make_it_fail()
    stage.png()
    assert stage.status == "" and any(np.any(stage.state[key] != stage.initial[key]) for key in stage.initial)
    stage.reset()
    assert stage.png() == before
    assert repr(stage) == repr(make()) and stage.caption


# ---- the robot


def test_sliders_and_flange_follow_each_other():
    stage = wr.tx40()
    goal = np.array([300.0, 150.0, 550.0])
    stage.set(flange=goal)
    np.testing.assert_allclose(stage.result["T_BF"][:3, 3], goal, atol=1e-3)
    q = wr.joints(stage.state)
    np.testing.assert_allclose(q[3:], np.deg2rad([0, -70, 0]))
    stage.set(q1=0.0, q2=0.0, q3=0.0)
    expected = forward_kinematics(TX40.dh, [0, 0, 0, *HOME[3:]])[:3, 3]
    np.testing.assert_allclose(stage.state["flange"], expected, atol=1e-9)


def test_an_unreachable_flange_stops_at_the_arms_reach():
    stage = wr.tx40()
    stage.set(flange=(900.0, 0.0, 300.0))
    q = wr.joints(stage.state)
    assert within_limits(TX40, q)
    away = np.linalg.norm(stage.state["flange"] - [0, 0, BASE_HEIGHT])
    assert 400 < away < np.hypot(REACH_FLANGE, SHOULDER_OFFSET)


def test_make_it_fail_is_a_singular_arm():
    stage = wr.tx40()
    stage.make_it_fail()
    assert stage.result["singular_values"][-1] < 1 and "singular" in stage.caption


@pytest.mark.parametrize("width", [500, 700])
@pytest.mark.parametrize("preset", ["Reset", "Make it fail", "arm upright"])
def test_flange_and_tracker_stay_in_the_picture_with_their_letters(preset, width):
    stage = wr.tx40()
    stage._picture.fit(width, 1000, 1.0, False)
    stage.press(preset)
    stage.png()
    canvas, whole = stage._picture.canvas, stage.figure.bbox
    words = {text: text.get_window_extent(canvas.get_renderer()) for text in stage.figure.axes[0].texts}
    assert {"B", "E", "F"} <= {text.get_text() for text in words}
    assert all(box.x0 >= 0 and box.x1 <= whole.x1 and box.y0 >= 0 and box.y1 <= whole.y1 for box in words.values())
    by_name = {text.get_text(): box for text, box in words.items() if text.get_text() in "EF"}
    assert not by_name["E"].overlaps(by_name["F"])


def test_names_of_tracker_and_world_are_apart_before_anything_arrives():
    stage = wr.live_tracker()
    stage.png()
    renderer = stage._picture.canvas.get_renderer()
    boxes = {text.get_text(): text.get_window_extent(renderer) for text in stage.figure.axes[0].texts}
    assert not boxes["E"].overlaps(boxes["W"])


# ---- the stream


def test_live_picture_gates_nonsense():
    packets = simulation.endless_packets(np.random.default_rng(3), lambda: True)
    readings = np.array([decode_packet(next(packets)) for _ in range(1500)])
    clean = simulation.endless_packets(np.random.default_rng(3))
    truth = np.array([decode_packet(next(clean)) for _ in range(1500)])
    result = wr.compute_live(readings, udp.Statistics())
    nonsense = np.linalg.norm(readings[:, POSITION] - truth[:, POSITION], axis=1) > 0.1
    assert nonsense.any() and not result["used"][nonsense].any() and result["used"][~nonsense].mean() > 0.98


def test_real_packets_arrive_in_the_stage_and_the_stream_ends_by_itself():
    stage = wr.live_tracker()
    before = threading.active_count()
    stage.set(nonsense=True, loss=0.2)
    until = time.perf_counter() + 5
    while time.perf_counter() < until and stage.result["statistics"].good < 100:
        stage.set(t=stage.state["t"] + wr.LIVE_STEP)
        time.sleep(0.03)
    seen = stage.result["statistics"]
    assert seen.good >= 100 and seen.lost > 0 and "good readings" in stage.caption
    until = time.perf_counter() + 6
    while threading.active_count() > before and time.perf_counter() < until:
        time.sleep(0.1)
    assert threading.active_count() <= before


# ---- two axes


def two_axes_state(a, b, angle=40.0, noise=0.1):
    return {"a": np.array(a, float), "b": np.array(b, float), "angle": angle, "noise": noise}


def test_singular_values_of_two_axes():
    parallel = wr.compute_two_axes(two_axes_state([1, 0, 0], [1, 0, 0]))["singular_values"]
    half, full = 2 * np.sin(np.deg2rad(20)), 2 * np.sin(np.deg2rad(40))
    np.testing.assert_allclose(parallel, np.sqrt(2) * np.array([full, full, *[half] * 4, 0, 0, 0]), atol=1e-12)
    apart = wr.compute_two_axes(two_axes_state([1, 0, 0], [0, 1, 0]))
    assert apart["singular_values"][-1] < 1e-12 < 0.5 < apart["singular_values"][-2]
    assert apart["angle_deg"] == pytest.approx(90)


def test_parallel_axes_leave_the_mounting_free_and_small_motions_blow_up_the_error():
    good = wr.compute_two_axes(two_axes_state([1, 0, 0], [0, 0, 1]))
    assert good["error_deg"] < 2 * good["predicted_deg"] and good["error_deg"] > 0.3 * good["predicted_deg"]
    bad = wr.compute_two_axes(two_axes_state([1, 0, 0], [1, 0, 0]))
    assert bad["error_deg"] > 30 and np.isfinite(bad["free"]).all()
    small = wr.compute_two_axes(two_axes_state([1, 0, 0], [0, 0, 1], angle=2.0))
    assert 10 < small["error_deg"] / good["error_deg"] < 40  # 40 deg over 2 deg is 20


def test_found_rotations_are_rotations_near_the_truth():
    found = wr.compute_two_axes(two_axes_state([1, 0, 0], [0, 0, 1]))["found"]
    turn = Rotation.from_matrix(wr.X_TRUE[:3, :3].T @ found).magnitude()
    assert np.rad2deg(turn.max()) < 1


# ---- errors in motion, methods, runs


def dynamic(speed=0.35, latency=8.0, nonsense=True):
    return wr.compute_dynamic({"speed": speed, "latency": latency, "nonsense": nonsense})


@pytest.mark.parametrize("speed, latency", [(0.35, 20.0), (1.0, 40.0), (1.4, 60.0)])
def test_latency_is_found_and_its_error_removed(speed, latency):
    result = dynamic(speed, latency, nonsense=False)
    assert result["offset_ms"] == pytest.approx(latency, abs=3)
    assert result["error"].max() == pytest.approx(speed * latency, abs=8)  # v * dt, and the systematic error
    assert result["mended"].max() < 10


def test_nonsense_moves_the_mean_and_not_the_median():
    with_it, without = dynamic()["raw_summary"], dynamic(nonsense=False)["raw_summary"]
    assert with_it["mean"] > 3 * without["mean"] and with_it["median"] < 1.1 * without["median"]


def test_methods_are_the_stored_benchmark():
    table = read_table("tracker/hand_eye_methods.csv", text=("method",))
    assert len(table["method"]) == 4 * 7
    for case, (deg, mm) in wr.CASES.items():
        result = wr.compute_methods({"case": case})
        rows = (table["std_deg"] == deg) & (table["std_mm"] == mm)
        np.testing.assert_array_equal(result["rotation"], table["rotation"][rows])
        best = result["names"].index("maximum likelihood")
        assert result["rotation"][best] < 1.05 and result["translation"][best] < 1.05
        assert result["rotation"].argmin() == best


def test_repeating_does_not_show_the_systematic_error():
    none, some = wr.compute_six_runs({"field": 0.0}), wr.compute_six_runs({"field": 2.0})
    assert none["off"] < 2 * none["std"] and some["off"] > 5 * some["std"]
    e = some["single"] - simulation.T_FE[:3, 3]
    assert e @ np.linalg.solve(some["claim"], e) < 16.27  # 99.9 % of a chi-square with 3 degrees of freedom


# ---- base stations


def sweeps_state(A=(-1700.0, -1500.0), B=(1700.0, -1500.0), P=(300.0, 700.0), jitter=20.0):
    return {"A": np.array(A), "B": np.array(B), "P": np.array(P), "jitter": jitter}


def test_the_found_places_scatter_as_the_ellipse_says():
    """Sum of squares over 40 places, in standard deviations: chi-square with 80 degrees of freedom."""
    result = wr.compute_sweeps(sweeps_state())
    off = result["found"] - result["place"]
    total = np.einsum("ni,ij,nj->", off, np.linalg.inv(result["covariance"]), off)
    assert 1e-4 < chi2.cdf(total, 80) < 1 - 1e-4
    turns = 2 * np.pi * 60 * result["delays"] - np.pi / 2
    np.testing.assert_allclose(turns, result["angles"])


def test_stations_side_by_side_know_no_distance():
    """Closed form for a diode on the middle line: the uncertainty along it grows with 1 / base."""
    wide, narrow = (
        wr.compute_sweeps(sweeps_state((-b, -2000.0), (b, -2000.0), (0.0, 0.0)))["std"][0] for b in (400.0, 100.0)
    )
    r2 = np.array([400.0, 100.0]) ** 2 + 2000.0**2
    assert narrow / wide == pytest.approx(4 * r2[1] / r2[0], rel=1e-6)


def moved(tilt, when):
    return wr.compute_moved_station({"tilt": tilt, "when": when})


def test_a_moved_station_shows_in_e_trans_only_if_it_moves_during_the_run():
    still, before, during = moved(0.0, "before the run"), moved(2.0, "before the run"), moved(2.0, "after stop 10")
    assert during["E_trans"] > 15 * before["E_trans"] and during["off"] > 10 * before["off"]
    assert before["E_trans"] < moved(2.0, "slowly, all along")["E_trans"] < during["E_trans"]
    assert still["mean"] < 0.1 and moved(2.0, "at every stop")["E_trans"] > during["E_trans"]
    np.testing.assert_allclose(during["E_trans"], moved(4.0, "after stop 10")["E_trans"] / 2, rtol=0.03)


def test_the_stations_of_the_room_see_the_robot_within_the_makers_distance():
    """Section 1: 0.7 to 5 m from both stations, which are at most 5 m apart."""
    away = np.linalg.norm(stations.STATIONS[:, None, :3, 3] - wr._stops()[1][:, :3, 3], axis=-1)
    assert away.min() > 700 and away.max() < 5000
    assert np.linalg.norm(np.subtract(*stations.STATIONS[:, :3, 3])) < 5000


# ---- errors over speed


def over_speed(of="position", latency=8.0, nonsense=False):
    return wr.compute_over_speed({"of": of, "latency": latency, "nonsense": nonsense})


@pytest.mark.parametrize("latency", [8.0, 20.0, 40.0])
@pytest.mark.parametrize("of", ["position", "rotation"])
def test_the_law_of_squares_finds_the_lag(of, latency):
    assert 1000 * over_speed(of, latency)["lag"] == pytest.approx(latency, abs=1.0)


def test_twice_the_tempo_doubles_the_error_of_a_lag_in_position_and_quadruples_it_in_speed(monkeypatch):
    """A tracker with a lag and nothing else: means over middle and fast, the same path in half the time."""
    monkeypatch.setattr(wr, "Tracker", lambda latency, **_: simulation.Tracker(0, 0, 0, 0, 0, 0, 0, 0, latency=latency))
    for of, factor in (("position", 2.0), ("rotation", 2.0), ("speed", 4.0), ("angular speed", 4.0)):
        slow, middle, _ = (e.mean() for e in over_speed(of, 4.0)["error"])
        assert middle / slow == pytest.approx(factor, rel=0.03)


def test_nonsense_moves_the_mean_and_leaves_the_medians():
    calm, wild = over_speed(), over_speed(nonsense=True)
    assert wild["mean"] > 2.5 * calm["mean"]
    np.testing.assert_allclose(wild["median"], calm["median"], rtol=0.35)


def test_printed_levels_stand_where_the_unit_is_the_same():
    assert over_speed()["printed"] == [15.0, 25.0]
    mean, largest = over_speed("angular speed")["printed"]
    assert np.isnan(mean) and largest == 3.0


# ---- the whole cell


def whole_cell(P=wc.cell.FAR[:2], turn=86.0, marks="seen by the scanner", source="tracker", spoil=0.0):
    P = np.append(P, wc.cell.TABLE)
    return wc.compute_whole_cell({"P": P, "turn": turn, "marks": marks, "source": source, "spoil": spoil})


HOME_AGAIN = {"P": wc.cell.LEARNED[:2], "turn": np.rad2deg(wc.cell.LEARNED[2])}


def test_the_answers_of_both_questions_about_common_errors():
    touched = whole_cell(**HOME_AGAIN, marks="touched with the tip", source="tip", spoil=1.0)
    assert np.linalg.norm(touched["miss"]) < 1e-9
    assert touched["sizes"]["tip"] < 1e-9 and touched["sizes"]["tracker"] < 1e-9
    bent = [np.linalg.norm(whole_cell(**HOME_AGAIN, source="tracker", spoil=spoil)["miss"]) for spoil in (0.0, 1.0)]
    assert bent[0] == pytest.approx(bent[1], abs=1e-9)


@pytest.mark.parametrize("source", wc.SPOILED)
def test_a_spoiled_source_moves_the_located_part_and_hardly_the_budget(source):
    good, bad = whole_cell(), whole_cell(source=source, spoil=1.0)
    assert bad["total"] == pytest.approx(good["total"], rel=0.05)
    moved = np.abs(bad["found"] - good["found"]).max()
    assert np.linalg.norm(bad["miss"] - good["miss"]) > 0.9
    assert (moved < 1e-6) == (source == "tip")  # seen by the scanner, the part is found without the tip
    assert np.linalg.norm(bad["off"][:3, 3] - bad["place"][:3, 3]) + np.abs(bad["off"] - bad["place"]).max() > 0.1


def test_simulated_cells_lie_as_the_covariance_says():
    """Of 400 cells, 97.1 % are expected within three standard deviations in space."""
    result = whole_cell()
    cov = sum(wc.cell.miss_budget(result["cell"], result["job"]).values())
    assert result["covariance"] == pytest.approx(cov)
    d2 = np.einsum("ni,ij,nj->n", result["cloud"], np.linalg.inv(cov), result["cloud"])
    assert 0.94 < (d2 < 9).mean() < 1.0
    assert result["total"] == pytest.approx(np.linalg.norm(list(result["sizes"].values())))


@pytest.mark.parametrize("marks", ["seen by the scanner", "touched with the tip"])
@pytest.mark.parametrize("source", wc.SPOILED)
def test_what_is_drawn_of_the_cell_is_what_the_mathematics_gives(source, marks):
    result = whole_cell(marks=marks, source=source, spoil=0.7)
    used, measured = result["cell"], result["job"]
    true = wc.cell.simulated_job((*wc.cell.FAR[:2], np.deg2rad(86.0)), touched=measured.touched)
    np.testing.assert_allclose(result["miss"], wc.cell.miss(wc.cell.TRUTH, used, true, measured), atol=1e-9)
    cloud = wc.cell.simulate_misses(used, measured, np.random.default_rng(62), wc.CLOUD)
    np.testing.assert_allclose(result["cloud"], cloud, atol=1e-9)
    frames = wc.cell.frames_in_base(used, measured)
    R = frames["F"][0][:3, :3]
    known = R @ used.cov_tip @ R.T if source == "tip" else frames[wc.draw.SHOWN[source]][1][3:, 3:]
    np.testing.assert_allclose(result["known"], known, atol=1e-12)


def test_the_failing_cell_says_that_it_misses_by_more_than_admitted():
    stage = wc.whole_cell()
    assert "Far more" not in stage.caption
    stage.make_it_fail()
    assert "Far more than the budget admits" in stage.caption
    stage.press("back where it was learned")
    np.testing.assert_allclose(stage.result["part"][:2, 3], wc.cell.LEARNED[:2])


@pytest.mark.parametrize(
    "view",
    [wc.View(28, 27, center=(110, 20, 200), eye=2800.0), wc.View(-60, 65, center=(110, 20, 200), eye=2800.0, zoom=0.8)],
)
def test_every_source_of_the_cell_is_chosen_by_a_click_on_its_frame_from_wherever_one_looks(view):
    stage = wc.whole_cell()
    stage.set(view=view)
    ax = stage.figure.axes[0]
    for name in wc.SPOILED:
        here = stage._picture.fraction(ax, view.project(stage.result["places"][name])[:2])
        stage.receive({"click": here, "serial": "a:1"})
        assert stage.state["source"] == name and stage.caption.startswith(wc.CALLED[name][:1].upper())
    stage.receive({"click": stage._picture.fraction(ax, (-400.0, -390.0)), "serial": "a:2"})
    assert stage.state["source"] == name  # a click beside all of them chooses none


def test_the_arm_says_where_it_does_not_get():
    assert whole_cell()["reached"]
    stage = wc.whole_cell()
    stage.set(P=(0.0, 0.0, wc.cell.TABLE), turn=0.0)
    assert "does not get there" in stage.caption


def test_wherever_station_or_diode_is_dragged_both_stations_see_it():
    stage = wr.sweeps()
    for key in "ABP":
        for place in [(-2600.0, -2600.0), (2600.0, -2600.0), (-2600.0, 2600.0), (0.0, -2600.0), (0.0, 0.0)]:
            stage.reset()
            stage.set(**{key: place})
            assert stage.status == "" and np.all(np.abs(stage.result["angles"]) < np.pi / 2), (key, place)
