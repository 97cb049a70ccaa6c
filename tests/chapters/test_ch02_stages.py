"""Stages of chapter 2: what they compute, against closed forms and the library; each draws, fails, recovers."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from labkit.chapters.ch02_chaining import bodies
from labkit.chapters.ch02_chaining import stages as w
from labkit.geometry import chaining


@pytest.mark.parametrize("make", [w.order_of_product, w.open_loop, w.growth, w.two_loops])
def test_draws_fails_and_recovers(make, draws_fails_and_recovers):
    draws_fails_and_recovers(make)


def order(a, b, a_deg, b_deg):
    return w.compute_order({"A": np.array(a), "B": np.array(b), "A_deg": a_deg, "B_deg": b_deg})


def test_order_of_product():
    result = order((100.0, 0.0, 0.0), (0.0, 50.0, 0.0), 90.0, 0.0)
    assert result["AB"][:3, 3] == pytest.approx([50, 0, 0])  # B is a step along the new y axis, which points to -x
    assert result["BA"][:3, 3] == pytest.approx([100, 50, 0])
    assert result["gap"] == pytest.approx(np.hypot(50, 50)) and result["turn_deg"] == pytest.approx(0, abs=1e-6)
    assert order((100.0, 0.0, 0.0), (0.0, 50.0, 9.0), 0.0, 0.0)["gap"] == pytest.approx(0, abs=1e-12)


def test_turns_about_two_axes_do_not_commute_even_on_the_spot():
    """Quarter turns about z and x: the two products are a third of a turn apart, by their trace of zero."""
    result = order(np.zeros(3), np.zeros(3), 90.0, 90.0)
    turn = Rotation.from_euler("ZX", [90, 90], degrees=True).inv() * Rotation.from_euler("XZ", [90, 90], degrees=True)
    assert result["gap"] == pytest.approx(0, abs=1e-12) and result["turn_deg"] == pytest.approx(120)
    assert np.rad2deg(turn.magnitude()) == pytest.approx(120)


def loop(link, turn_deg, axis="z", **places):
    _, origins = w._sheet_angles()
    state = {f"K{k}": np.append(origins[k], 0.0) for k in (1, 2, 3)} | {"P": np.array([200.0, 100.0, 0.0])}
    return w.compute_open_loop({**state, **places, "link": link, "turn_deg": turn_deg, "axis": axis})


@pytest.mark.parametrize("axis", "xyz")
def test_open_loop_opens_by_the_turn_times_the_lever(axis):
    for link in (1, 2, 3, 4):
        result = loop(link, 2.0, axis)
        chord = 2 * np.sin(np.deg2rad(1.0)) * result["lever"]
        assert result["distance"] == pytest.approx(chord, abs=1e-9)
        assert result["angle_deg"] == pytest.approx(2.0)
    assert loop(4, 2.0, axis)["distance"] == pytest.approx(0, abs=1e-9)
    closed = loop(2, 0.0, axis)
    assert closed["distance"] == pytest.approx(0, abs=1e-9) and closed["at_piece"] == pytest.approx(0, abs=1e-9)


def test_a_turn_about_x_or_y_lifts_the_end_out_of_the_plane():
    angles, origins = w._sheet_angles()
    for axis, toward in (("x", (1, 0)), ("y", (0, 1))):
        along = np.array([[np.cos(angles[2]), -np.sin(angles[2])], [np.sin(angles[2]), np.cos(angles[2])]]) @ toward
        result = loop(2, 5.0, axis)
        assert result["lever"] == pytest.approx(abs(np.linalg.det([along, origins[2]])), rel=1e-9)
        assert abs(result["measured"][-1][2, 3]) == pytest.approx(result["lever"] * np.sin(np.deg2rad(5.0)), rel=1e-9)


def test_open_loop_at_the_work_piece():
    result = loop(1, 3.0, P=np.array([-80.0, 90.0, 0.0]))
    assert np.linalg.norm(result["piece"][0] - result["piece"][1]) == pytest.approx(result["at_piece"])


def test_the_measuring_arm_stands_on_the_floor_and_touches_the_end_of_its_link():
    stage = w.open_loop()
    for link in (1, 2, 3, 4):
        stage.set(link=link)
        end = stage.result["true"][link][:3, 3]
        probe = stage.spaces[0].named("probe").corners().reshape(-1, 3)
        assert np.linalg.norm(probe - end, axis=1).min() < 5.0  # its radius
        foot = stage.spaces[0].named("foot").corners().reshape(-1, 3)
        assert foot[:, 2].min() == pytest.approx(w.FLOOR) and stage.result["stand"][2] == w.FLOOR


@pytest.mark.parametrize("end", [(500.0, 0, 200), (0, 0, 700), (2000.0, 100, 300)])
def test_both_links_of_the_measuring_arm_keep_their_lengths(end):
    start = np.array([0.0, 0, 300])
    elbow, wrist = bodies.bent(start, np.array(end), 400.0, 300.0)
    assert np.linalg.norm(elbow - start) == pytest.approx(400) and np.linalg.norm(wrist - elbow) == pytest.approx(300)
    reached = np.linalg.norm(np.subtract(end, start)) <= 700
    assert np.allclose(wrist, end) == reached


@pytest.mark.parametrize("layout", ["row", "loop"])
@pytest.mark.parametrize("n", [1, 7, 20, 64])
def test_growth_agrees_with_its_laws(layout, n):
    """A hundred runs: their rms scatters by some 7 %, that of a single frame's height as well."""
    result = w.compute_growth({"n": n, "std_rot_deg": 0.1, "layout": layout})
    links = chaining.straight_chain(n, 300.0) if layout == "row" else chaining.polygon_loop(n, 300.0)
    law = chaining.expected_closure(links, np.deg2rad(0.1), w.STD_TRANS)[1]
    assert result["expected"] == pytest.approx(law)
    assert result["here"] == pytest.approx(law, rel=0.25)
    heights = np.sqrt((result["heights"] ** 2).mean(1))
    assert result["heights"].shape == (n + 1, w.RUNS) and heights[0] == 0
    np.testing.assert_allclose(heights[1:], result["std_heights"][1:], rtol=0.3)


def test_growth_exponents():
    result = w.compute_growth({"n": 8, "std_rot_deg": 1.0, "layout": "row"})
    row, ring = (result["laws"][name] for name in ("row", "loop"))
    assert np.log2(row[-1] / row[-2]) == pytest.approx(1.5, abs=0.03)
    assert np.log2(ring[-1] / ring[-2]) == pytest.approx(0.5, abs=0.03)
    np.testing.assert_allclose(result["others"][-1], row)


def loops(A, B, turn_deg=0.0, way="graph"):
    """What was dragged in mm of error."""
    places = {"A": 30 * np.array(A, dtype=float), "B": np.array([400.0, 300.0]) + 30 * np.array(B, dtype=float)}
    return w.compute_two_loops({**places, "turn_deg": turn_deg, "way": way})


def test_two_loops_are_open_by_what_was_dragged_and_only_the_graph_closes_both():
    for A, B in (((3, 1), (-2, 4)), ((0, 0), (6, 6)), ((-4, 2), (0, 1))):
        left = loops(A, B)["left"]
        assert left["as measured"] == pytest.approx([np.hypot(*A), np.hypot(*B)], abs=1e-6)
        assert left["graph"] == pytest.approx([0, 0], abs=1e-6)
        assert left["A, then B"][1] == pytest.approx(0, abs=1e-6) and left["A, then B"][0] > 0.05
        assert left["B, then A"][0] == pytest.approx(0, abs=1e-6)
    turned = loops((0, 0), (0, 0), turn_deg=0.4)["left"]["as measured"]  # about the common link's end
    assert turned == pytest.approx(np.deg2rad(0.4) * np.array([np.hypot(400, 300), np.hypot(0, 300)]), rel=0.01)


def test_what_sharing_out_a_takes_from_the_common_link_b_may_need():
    """A quarter of A's error goes to the common link: a B that is off by just that is closed, and nothing is undone."""
    result = loops((-4, 0), (1, 0))
    assert result["left"]["A, then B"] == pytest.approx([0, 0], abs=1e-9) and w._closes_both(result)
    assert not w._closes_both(loops((-4, 0), (0, 0)))


def inside(artist, stage):
    """Whether an artist lies within the picture of its Stage."""
    canvas = stage._picture.canvas
    box, whole = artist.get_window_extent(canvas.get_renderer()), stage.figure.bbox
    return whole.x0 <= box.x0 and box.x1 <= whole.x1 and whole.y0 <= box.y0 and box.y1 <= whole.y1


@pytest.mark.parametrize("width", [500, 700])
def test_growth_keeps_room_for_wide_numbers(width):
    stage = w.growth()
    stage._picture.fit(width, 1000, 1.0, False)
    stage.png()  # the layout is made for the numbers at the start
    stage.make_it_fail()
    stage.png()
    left = stage.figure.axes[0]
    label, renderer = left.yaxis.label, stage._picture.canvas.get_renderer()
    assert inside(label, stage)
    numbers = [tick.label1.get_window_extent(renderer) for tick in left.yaxis.get_major_ticks()]
    assert max(left.get_ylim()) == 3000 and min(box.x0 for box in numbers) > label.get_window_extent(renderer).x1


@pytest.mark.parametrize("place", [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
def test_frames_of_the_open_loop_stay_in_their_plane_and_bounds(place):
    stage = w.open_loop()
    for name in ("K1", "K2", "K3", "P"):
        stage.receive({"drag": {name: place}})
        at = stage.state[name]
        assert at[2] == 0 and all(low <= v <= high for v, (low, high) in zip(at, w.WITHIN))
