"""Stages of chapter 2: what they compute, against closed forms and the library; each draws, fails, recovers."""

import numpy as np
import pytest

from labkit.chapters.ch02_chaining import stages as w
from labkit.geometry import chaining


@pytest.mark.parametrize("make", [w.order_of_product, w.open_loop, w.growth, w.two_loops])
def test_draws_fails_and_recovers(make, draws_fails_and_recovers):
    draws_fails_and_recovers(make)


def order(a, b, a_deg, b_deg):
    return w.compute_order({"A": np.array(a), "B": np.array(b), "A_deg": a_deg, "B_deg": b_deg})


def test_order_of_product():
    result = order((100.0, 0.0), (0.0, 50.0), 90.0, 0.0)
    assert result["AB"][:2, 3] == pytest.approx([50, 0])  # B is a step along the new y axis, which points to -x
    assert result["BA"][:2, 3] == pytest.approx([100, 50])
    assert result["gap"] == pytest.approx(np.hypot(50, 50))
    assert order((100.0, 0.0), (0.0, 50.0), 0.0, 0.0)["gap"] == pytest.approx(0, abs=1e-12)


def loop(link, turn_deg, **places):
    _, origins = w._sheet_angles()
    state = {f"K{k}": origins[k] for k in (1, 2, 3)} | {"P": np.array([200.0, 100.0])}
    return w.compute_open_loop({**state, **places, "link": link, "turn_deg": turn_deg})


def test_open_loop_opens_by_the_turn_times_the_lever():
    for link in (1, 2, 3, 4):
        result = loop(link, 2.0)
        chord = 2 * np.sin(np.deg2rad(1.0)) * result["lever"]
        assert result["distance"] == pytest.approx(chord, abs=1e-9)
        assert result["angle_deg"] == pytest.approx(2.0)
    assert loop(4, 2.0)["distance"] == pytest.approx(0, abs=1e-9)
    closed = loop(2, 0.0)
    assert closed["distance"] == pytest.approx(0, abs=1e-9) and closed["at_piece"] == pytest.approx(0, abs=1e-9)


def test_open_loop_at_the_work_piece():
    result = loop(1, 3.0, P=np.array([-80.0, 90.0]))
    assert np.linalg.norm(result["piece"][:, 0] - result["piece"][:, 1]) == pytest.approx(result["at_piece"])


@pytest.mark.parametrize("layout", ["row", "loop"])
def test_growth_agrees_with_its_law(layout):
    result = w.compute_growth({"n": 20, "std_rot_deg": 0.1, "layout": layout})
    laws = [
        chaining.expected_closure(w._layout(layout, int(n))[0], np.deg2rad(0.1), w.STD_TRANS)[1]
        for n in result["numbers"]
    ]
    np.testing.assert_allclose(result["found"], laws, rtol=0.2)  # a hundred runs
    assert result["expected"] == pytest.approx(laws[list(result["numbers"]).index(20)])
    assert result["here"] == pytest.approx(result["found"][list(result["numbers"]).index(20)])


def test_growth_exponents():
    result = w.compute_growth({"n": 8, "std_rot_deg": 1.0, "layout": "row"})
    row, ring = (result["laws"][name] for name in ("row", "loop"))
    assert np.log2(row[-1] / row[-2]) == pytest.approx(1.5, abs=0.03)
    assert np.log2(ring[-1] / ring[-2]) == pytest.approx(0.5, abs=0.03)


def test_two_loops_only_the_graph_closes_both():
    for run in range(1, 6):
        left = w.compute_two_loops({"run": run, "std_rot_deg": 0.2})["left"]
        assert left["graph"] == pytest.approx([0, 0], abs=1e-6)
        assert left["A, then B"][1] == pytest.approx(0, abs=1e-6) and left["A, then B"][0] > 0.05
        assert left["B, then A"][0] == pytest.approx(0, abs=1e-6) and left["B, then A"][1] > 0.05


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


@pytest.mark.parametrize("place", [(5000.0, 5000.0), (-5000.0, -5000.0)])
def test_frames_of_the_open_loop_stay_in_the_picture_with_their_names(place):
    stage = w.open_loop()
    for name in ("K1", "K2", "K3", "P"):
        right, down = (1.0, 0.0) if place[0] > 0 else (0.0, 1.0)
        stage.receive({"drag": {name: (right, down)}})
    stage.png()
    names = [text for text in stage.figure.axes[0].texts if text.get_text() in ("K1", "K2", "K3", "P")]
    assert len(names) == 4 and all(inside(name, stage) for name in names)
    assert np.array_equal(stage.state["P"], (360, 190) if place[0] > 0 else (-440, -580))


def test_free_direction_is_the_middle_of_the_widest_gap():
    assert np.rad2deg(w.free_direction([(1, 0), (0, 1)])) == pytest.approx(225)
    assert np.rad2deg(w.free_direction([(2, 0), (0, 1), (-1, 0)])) == pytest.approx(270)
    assert np.rad2deg(w.free_direction([(1, 0), (0, 1), (0, 0)])) == pytest.approx(225)  # no direction: ignored


@pytest.mark.parametrize("A_deg, B_deg", [(60, 0), (-90, 40), (180, 180)])
def test_names_of_the_two_orders_keep_off_their_own_axes(A_deg, B_deg):
    stage = w.order_of_product()
    stage.set(A_deg=A_deg, B_deg=B_deg)
    result = w.compute_order(stage.state)
    names = {text.get_text(): text for ax in stage.figure.axes for text in ax.texts}
    for key in ("A", "B", "AB", "BA"):
        aside = np.array(names[key].xyann) / np.hypot(*names[key].xyann)
        assert (result[key][:2, :2].T @ aside).max() < np.cos(np.deg2rad(40))
