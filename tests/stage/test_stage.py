"""Stage without a browser: state, corrections, presets, errors, what goes to the page, and what comes from it."""

import io
import json
import re
import threading
from pathlib import Path
from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image

from labkit import live
from labkit.chapters.ch08_kalman import stages
from labkit.stage import Choice, Handle, Play, Slider, Stage, Target, Toggle, canvas, garbage, style
from labkit.stage.renderer import Canvas
from labkit.stage.scene3d import Scene, View

ROOT = Path(__file__).resolve().parents[2]
LOOK = {"width": 600, "height": 400, "ratio": 1, "dark": False, "letters": 1.0}


def scene(fig):
    ax = style.axes(fig.subplots(), "x (mm)", "y (mm)")
    ax.set(xlim=(0, 10), ylim=(0, 5))
    (line,) = ax.plot([], [], **style.look("estimate"))

    def update(state, result):
        if "P" in state:
            line.set_data(*np.transpose([state["P"], state["Q"]]))

    return [line], update


def compute(state):
    distance = float(np.hypot(*(state["P"] - state["Q"])))
    if distance < 1e-6:
        raise ValueError("P and Q coincide: they have no direction")
    return distance * state.get("scale", 1)


def segment(**options):
    handles = {"P": Handle((1, 1), step=0.5, bounds=((0, 9), (0, 4))), "Q": Handle((4, 5), label="far end")}
    return Stage("segment", **{
        "scene": scene, "compute": compute, "handles": handles, "controls": {"scale": Slider(0.0, 2.0, 1.0, step=0.1)},
        "fail": {"Q": (1, 1)}, "describe": lambda result: f"{result:.1f} mm", **options,
    })  # fmt: skip


def nothing(**options):
    return Stage("nothing", **{"scene": scene, "compute": lambda state: None, "fail": {}, **options})


@pytest.fixture
def wired():
    """A segment whose messages to the page are kept in a list."""
    return wire(segment())


def wire(stage):
    sent = []
    stage.connect(lambda message, buffers: sent.append((message, buffers)))
    stage.receive({"look": LOOK, "serial": "a:1"})
    return stage, sent


# -- state


def test_state_result_and_initial():
    stage = segment()
    assert stage.result == pytest.approx(5.0)
    stage.set(scale=2.0, Q=(1, 3))
    assert stage.result == pytest.approx(4.0)
    assert stage.caption == "4.0 mm"
    assert stage.initial["scale"] == 1.0 and stage.initial["Q"] == pytest.approx([4, 5])
    with pytest.raises(ValueError):
        stage.state["P"][0] = 3  # functions of the state must stay pure


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"R": (1, 2)}, "has no 'R'"),
        ({"P": (1, 2, 3)}, r"P must have shape \(2,\)"),
        ({"P": (1, np.nan)}, "P must be finite"),
        ({"scale": 7}, r"scale must lie in \[0, 2\], got 7"),
        ({"t": 1.0}, "has no 't'"),
    ],
)
def test_set_refuses(changes, sentence):
    with pytest.raises(ValueError, match=sentence):
        segment().set(**changes)


def test_bounds_and_constrain_correct_handles():
    stage = segment()
    stage.set(P=(20, -3))
    assert stage.state["P"] == pytest.approx([9, 0])

    def constrain(state, moved):  # Q hangs 2 above P; dragging Q moves P
        return {"P": state["Q"] - (0, 2)} if moved == {"Q"} else {"Q": state["P"] + (0, 2)}

    stage = segment(constrain=constrain)
    assert stage.state["Q"] == pytest.approx([1, 3])
    assert stage.initial["Q"] == pytest.approx([1, 3])
    stage.set(P=(5, 1))
    assert stage.state["Q"] == pytest.approx([5, 3])
    stage.set(Q=(6, 4))
    assert stage.state["P"] == pytest.approx([6, 2])


def test_controls_follow_and_lead():
    controls = {"n": Slider(1, 9, 3), "way": Choice(["a", "b"], "a"), "on": Toggle(True)}
    stage = nothing(controls=controls, compute=lambda state: (state["n"], state["way"], state["on"]), fail={"n": 9})
    stage, sent = wire(stage)
    stage.receive({"control": {"n": 4}, "serial": "a:2"})
    assert stage.result == (5, "a", True)
    stage.receive({"control": {"way": 1, "on": 0}, "serial": "a:3"})
    assert stage.result == (5, "b", False)
    shown = sent[-1][0]["controls"]
    assert {key: (c["at"], c["text"]) for key, c in shown.items()} == {
        "n": (4, "5"), "way": (1, "b"), "on": (0, "off")
    }  # fmt: skip
    stage.receive({"button": "Make it fail", "serial": "a:4"})
    assert stage.result == (9, "a", True) and sent[-1][0]["controls"]["n"] == {"at": 8, "text": "9"}
    for bad in ({"way": "c"}, {"on": 1}, {"n": 0}):
        with pytest.raises(ValueError):
            stage.set(**bad)


@pytest.mark.parametrize(
    "control, value, shown",
    [
        (Slider(-180.0, 180.0, 20.0, step=1.0), 33.3, 33.0),
        (Slider(0.0, 1.0, 0.3, step=0.1), 0.26, 0.3),
        (Slider(0.0, 4.0, 2.0), 1.0101, 1.0),
        (Slider(0.01, 100.0, 0.7, log=True), 0.7001, 0.7),
        (Slider(1e-13, 10.0, 5e-7, log=True), 10.0, 10.0),
        (Slider(1, 9, 3), 4, 4),
    ],
)
def test_a_knob_stands_on_the_nearest_step_and_ends_at_both_ends(control, value, shown):
    assert control.at(control.position(value)) == pytest.approx(shown, abs=1e-12)
    assert control.at(control.position(control.value)) == control.value
    assert (control.at(0), control.at(control.positions)) == (control.low, control.high)
    assert [control.position(control.at(k)) for k in range(control.positions + 1)] == [*range(control.positions + 1)]
    assert control.at(-3) == control.low and control.at(10**6) == control.high


def test_a_value_between_two_steps_stays_until_the_knob_is_moved():
    stage, _ = wire(nothing(controls={"a": Slider(0.0, 1.0, 0.3, step=0.1)}, compute=lambda state: state["a"]))
    stage.set(a=0.26)
    assert stage.result == 0.26 and stage._shown_control("a") == {"at": 3, "text": "0.3"}
    stage.receive({"control": {"a": 4}, "serial": "a:2"})
    assert stage.result == pytest.approx(0.4)


def test_the_declaration_says_what_the_page_draws():
    controls = {"std": Slider(1e-3, 1.0, 0.1, label="noise (mm)", log=True), "k": Choice({w: w for w in "abcd"}, "b")}
    told = segment(controls={**controls, "on": Toggle(label="all")}, click=True).declaration()
    json.dumps(told)
    assert told["handles"] == {"P": "P", "Q": "far end"} and told["buttons"] == ("Reset", "Make it fail")
    assert told["controls"]["std"]["unit"] == "mm" and told["controls"]["std"]["label"] == "noise (mm)"
    assert told["controls"]["k"] == {"kind": "list", "label": "k", "words": ["a", "b", "c", "d"]}
    assert told["controls"]["on"] == {"kind": "toggle", "label": "all"}
    assert (told["click"], told["empty"], told["play"]) == (True, "", None)


def test_presets():
    stage = segment(presets={"close": {"Q": (1, 2)}})
    assert list(stage.buttons) == ["Reset", "Make it fail", "close"]
    stage.set(scale=2.0)
    stage.press("close")
    assert stage.result == pytest.approx(1.0)
    stage.press("Reset")
    assert stage.result == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"controls": {k: Toggle() for k in "abcd"}}, "at most 3 controls, got 4"),
        ({"controls": {"t": Toggle()}}, "reserved"),
        ({"handles": {"a": Handle((0, 0))}, "controls": {"a": Toggle()}}, "used twice"),
        ({"handles": {"a": Handle((0, 0, 0))}}, "3 and the Stage a view"),
        ({"keys": True}, "keys=True needs advance"),
        ({"start": lambda state: 0}, "come together"),
        ({"view": View(), "brush": True}, "both view and brush"),
        ({"fail": {"zz": 1}}, "has no 'zz'"),
        ({"handles": {"a": Handle((0, 0), ax=1)}}, "a wants axes 1, but the scene has 1"),
        ({"click": 2}, "click wants axes 2"),
    ],
)
def test_options_are_checked(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        nothing(**options)


# -- errors


def test_an_error_at_construction_is_raised():
    with pytest.raises(ValueError, match="coincide"):
        segment(handles={"P": Handle((1, 1)), "Q": Handle((1, 1))})


def test_an_error_in_use_is_one_sentence_and_the_picture_stays(wired):
    stage, sent = wired
    before = stage.png()
    stage.make_it_fail()
    assert sent[-1][0]["status"] == stage.status == "P and Q coincide: they have no direction"
    assert stage.result == pytest.approx(5.0) and stage.png() == before
    stage.set(Q=(4, 1))
    assert stage.status == "" and stage.result == pytest.approx(3.0)


def test_other_errors_come_with_their_type():
    stage = nothing(controls={"n": Slider(0, 3, 1)}, compute=lambda state: 6 // state["n"])
    stage.set(n=0)
    assert stage.status.startswith("ZeroDivisionError: ")


def test_strict_raises_too(monkeypatch):
    stage = segment()
    monkeypatch.setenv("LABKIT_STRICT", "1")
    with pytest.raises(ValueError, match="coincide"):
        stage.make_it_fail()
    assert stage.status


# -- outputs


def test_a_stage_stands_in_the_page_before_its_stored_picture_is_made(monkeypatch):
    said = []
    monkeypatch.setattr(live, "display", lambda bundle, **how: said.append((bundle["text/html"], how.get("update"))))
    shown = live.Live(segment().widget, "words", lambda: f"drawn after {len(said)}")
    shown.show()
    empty, place, stored = said
    assert empty == (f'<div data-labkit-still="{shown.place}"></div>', False) and shown.place in place[0]
    assert stored == (f'<div data-labkit-still="{shown.place}">drawn after 2</div>', True)


def test_text_is_constant_and_what_is_stored_needs_no_kernel():
    stage = segment()
    before = stage.still()
    stage.set(Q=(1, 2))
    assert repr(stage) == "[stage: segment] 5.0 mm"
    assert "1.0 mm" in stage.still() and stage.still() != before and "widget" not in stage.still()
    assert Image.open(io.BytesIO(stage.png())).size == (700, 420)


def test_a_small_picture_shows_the_rings_of_the_handles():
    stage = segment(handles={"P": Handle((1, 1)), "Q": Handle((4, 2), color=style.MEASUREMENT)})
    image = np.asarray(Image.open(io.BytesIO(stage.small_png())).convert("RGB")).astype(int)
    right, down = stage._picture.fraction(stage.figure.axes[0], (4, 2))
    near = image[round(420 * down) - 12 : round(420 * down) + 12, round(700 * right) - 12 : round(700 * right) + 12]
    orange = np.abs(near - 255 * np.array(to_rgb(style.MEASUREMENT))).max(-1) < 60
    assert orange.sum() > 40 and len(stage.small_png()) < 20_000


def test_what_is_stored_is_on_light_paper_also_where_the_page_is_dark():
    stage = segment()
    stage._picture.fit(700, 420, 1, False)
    stored, light = stage.small_png(), pixels(stage)
    stage._picture.fit(700, 420, 1, True)
    dark = pixels(stage)
    assert stage.small_png() == stored
    assert (pixels(stage) == dark).all() and (dark != light).any(), "and the page stays dark"


def test_png_holds_the_pixels():
    pixels = np.random.default_rng(0).integers(0, 256, (7, 5, 4), dtype=np.uint8)
    assert (np.asarray(Image.open(io.BytesIO(canvas.encode_png(pixels)))) == pixels).all()


def test_what_a_reader_has_set_for_figures_of_their_own_changes_nothing():
    before = stages.bells().png()
    with matplotlib.rc_context({"text.usetex": True, "font.size": 40, "axes.facecolor": "k", "lines.linewidth": 9}):
        assert stages.bells().png() == before


# -- the browser's messages


def test_a_drag_is_answered_with_one_picture(wired):
    stage, sent = wired
    at = sent[-1][0]["handles"]["Q"]["at"]
    stage.receive({"drag": {"Q": (at[0], at[1] + 0.1)}, "serial": "a:2", "shown": 1})
    message, buffers = sent[-1]
    assert len(sent) == 2 and message["serial"] == "a:2" and message["on"] == 1 and len(buffers) == 2
    assert stage.state["Q"][0] == pytest.approx(4.0) and 0 < stage.state["Q"][1] < 5.0
    assert message["handles"]["Q"]["at"] == pytest.approx((at[0], at[1] + 0.1))


def page_after(sent):
    """The pixels of a page that follows the messages, and the number of its picture."""
    pixels = shown = None
    for message, buffers in sent:
        if message["on"] is None:
            pixels = np.array(Image.open(io.BytesIO(*buffers)))
        else:
            assert message["on"] == shown
            runs, colors = (np.frombuffer(bytes(buffer), "<u4") for buffer in buffers)
            places = [np.arange(first, first + length) for first, length in runs.reshape(-1, 2)]
            pixels.view("<u4").reshape(-1)[np.concatenate([[], *places]).astype(int)] = colors
        shown = message["picture"]
    return pixels, shown


def test_only_changed_pixels_follow_a_whole_picture(wired):
    stage, sent = wired
    for k in range(2, 6):
        stage.receive({"step": {"P": (k, 1)}, "serial": f"a:{k}", "shown": k - 1})
        assert (page_after(sent)[0] == stage._picture.draw()).all()
    assert [message["on"] for message, _ in sent] == [None, 1, 2, 3, 4]
    assert all(0 < len(colors) < 10_000 for _, (_, colors) in sent[1:])
    stage.receive({"serial": "a:6"})
    assert len(sent[-1][1][0]) == len(sent[-1][1][1]) == 0  # nothing new


@pytest.mark.parametrize("look", [{}, {"dark": True}, {"width": 400}, {"ratio": 2.0}])
def test_a_page_that_looks_gets_a_whole_picture(wired, look):
    stage, sent = wired
    stage.receive({"step": {"P": (1, 0)}, "serial": "a:2", "shown": 1})
    stage.receive({"look": {**LOOK, **look}, "serial": "a:3", "shown": 2})
    assert sent[-1][0]["on"] is None and (page_after(sent)[0] == stage._picture.draw()).all()


def test_a_whole_picture_goes_where_too_much_changes():
    before = np.zeros((400, 400, 4), np.uint8)
    after = before.copy()
    after[[0, 0, 0, 5, 399], [0, 1, 7, 7, 399], 3] = 255
    runs, colors = canvas.changes(before, after)
    assert runs.tolist() == [[0, 2], [7, 1], [2007, 1], [159_999, 1]] and (colors == 255 << 24).all()
    after[...] = 7
    assert canvas.changes(before, after) is None and canvas.changes(before, after[:200]) is None


def test_drags_end_at_axes_and_bounds_and_the_page_is_told(wired):
    stage, sent = wired
    stage.receive({"drag": {"Q": (1.0, 0.0), "P": (1.0, 0.0)}, "serial": "a:2"})
    assert stage.state["Q"] == pytest.approx([10, 5]) and stage.state["P"] == pytest.approx([9, 4])
    assert sent[-1][0]["handles"]["P"]["at"][0] < 1.0


def test_steps(wired):
    stage, _ = wired
    stage.receive({"step": {"P": (1, 0), "Q": (0, -10)}, "serial": "a:2"})
    assert stage.state["P"] == pytest.approx([1.5, 1.0])
    assert stage.state["Q"] == pytest.approx([4.0, 4.0])  # a hundredth of the width, ten times


def test_newest_wins_while_the_page_is_busy(wired):
    stage, sent = wired
    for k in range(20):
        stage.set(P=(k / 10, 1))
    assert len(sent) == 1 + 3  # no more than three unseen
    stage.receive({"shown": sent[-1][0]["picture"]})
    assert len(sent) == 5 and sent[-1][0]["handles"]["P"]["now"] == pytest.approx(1.9)
    stage.receive({"shown": sent[-1][0]["picture"]})
    assert len(sent) == 5  # nothing new, nothing sent


def test_nothing_is_sent_before_a_page_looks():
    stage, sent = segment(), []
    stage.connect(lambda *args: sent.append(args))
    stage.set(scale=2.0)
    assert not sent


def test_set_from_many_threads(wired):
    stage, _ = wired
    threads = [threading.Thread(target=lambda k=k: [stage.set(P=(k, i / 10)) for i in range(10)]) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert stage.result == pytest.approx(compute(stage.state)) and stage.status == ""


def test_click_and_brush():
    stage, sent = wire(nothing(click=True, brush=True, compute=lambda state: (state["click"], state["brush"])))
    assert stage.state["click"] is None and stage.state["brush"].shape == (0, 2)
    ax = stage.figure.axes[0]
    at = [stage._picture.fraction(ax, xy) for xy in ((2, 2), (4, 3), (6, 3))]
    stage.receive({"click": at[0], "serial": "a:2"})
    assert stage.result[0] == pytest.approx([2, 2])
    stage.receive({"click": (0.001, 0.999), "serial": "a:3"})  # outside the axes
    assert stage.result[0] == pytest.approx([2, 2])
    stage.receive({"brush": at[:2], "fresh": True, "serial": "a:4"})
    stage.receive({"brush": at[2:], "serial": "a:5"})
    assert stage.result[1] == pytest.approx(np.array([[2, 2], [4, 3], [6, 3]]))
    stage.receive({"brush": at[2:], "fresh": True, "serial": "a:6"})
    assert len(stage.result[1]) == 1 and stage.declaration()["empty"] == "draw"
    stage.receive({"cursor": at[0], "serial": "a:7"})
    assert sent[-1][0]["cursor"] == "x 2, y 2"


# -- time and memory


def test_play():
    stage, sent = wire(nothing(play=Play(2.0, 0.1), compute=lambda state: state["t"]))
    stage.receive({"time": {"at": 7, "epoch": 0}, "serial": "a:2"})
    assert stage.result == pytest.approx(0.7)
    assert sent[-1][0]["time"] == {"at": 7, "text": "t = 0.70 s", "epoch": 0}
    stage.set(t=99)
    assert stage.result == 2.0
    assert stage.declaration()["play"] == {"steps": 20, "interval": 100, "stride": 1, "patient": False}


def test_reset_wins_against_a_step_of_time_that_was_under_way():
    stage, sent = wire(nothing(play=Play(2.0, 0.1), compute=lambda state: state["t"]))
    stage.receive({"time": {"at": 7, "epoch": 0}, "serial": "a:2"})
    stage.reset()
    stage.receive({"time": {"at": 8, "epoch": 0}, "serial": "a:3"})
    assert stage.result == 0.0 and sent[-1][0]["serial"] == "a:3"
    stage.receive({"time": {"at": 1, "epoch": sent[-1][0]["time"]["epoch"]}, "serial": "a:4"})
    assert stage.result == pytest.approx(0.1)


def test_a_button_is_answered_once_and_what_was_moved_after_it_counts(wired):
    stage, sent = wired
    stage.receive({"button": "Reset", "step": {"P": (1, 0)}, "serial": "a:2"})
    assert [message["serial"] for message, _ in sent].count("a:2") == 1
    assert stage.state["P"] == pytest.approx([1.5, 1.0])
    with pytest.raises(ValueError, match="no button 'Undo', only Reset, Make it fail"):
        stage.press("Undo")


def test_a_rest_stores_what_is_shown(wired):
    stage, _ = wired
    stored = []
    stage.at_rest.append(lambda: stored.append(stage.caption))
    stage.receive({"step": {"P": (2, 0)}, "serial": "a:2"})
    assert not stored
    stage.receive({"rest": True})
    assert stored == [stage.caption]


def test_a_pass_through_all_garbage_waits_for_rest(wired, monkeypatch):
    stage, _ = wired
    told, passes = [], [4]
    monkeypatch.setattr(garbage, "gc", SimpleNamespace(
        get_threshold=lambda: (700, 10, 10), set_threshold=lambda *after: told.append(after), isenabled=lambda: True,
        get_count=lambda: (0, 0, passes[-1]), collect=lambda: told.append("collected"),
    ))  # fmt: skip
    stage.receive({"look": LOOK, "serial": "a:2"})
    assert told == [(700, 10, garbage.PATIENT)]
    stage.receive({"rest": True})
    passes.append(12)
    stage.receive({"step": {"P": (1, 0)}, "serial": "a:3"})
    assert told[1:] == []
    stage.receive({"rest": True})
    assert told[1:] == ["collected"]


def counting(**options):
    """A memory that lists the events it has seen."""
    return nothing(
        start=lambda state: [], advance=lambda state, event: [*state["memory"], event],
        compute=lambda state: list(state["memory"]), **options,
    )  # fmt: skip


def test_memory_follows_ticks_keys_and_clicks():
    stage, sent = wire(counting(play=Play(2.0, 0.1), keys=True, click=True))
    assert stage.declaration()["keys"] is True and sent[-1][0]["time"]["at"] == 0
    stage.receive({"time": {"at": 2, "epoch": 0}, "serial": "a:1"})
    stage.receive({"arrows": ["up", "left"], "serial": "a:2"})
    stage.receive({"click": stage._picture.fraction(stage.figure.axes[0], (1, 1)), "serial": "a:3"})
    assert stage.result == ["tick", "tick", "up", "left", "click"]
    stage.set(t=0.1)  # back in time
    assert stage.result == ["tick"]
    stage.reset()
    assert stage.result == [] and stage.state["t"] == 0.0


def wandering(**options):
    """A simulation that draws a random number a step and remembers clicks."""

    def advance(state, event):
        memory = state["memory"]
        if event == "tick":
            memory["x"] += memory["rng"].standard_normal()
        else:
            memory["x"] += 100.0
        return memory

    return nothing(
        start=lambda state: {"x": 0.0, "rng": np.random.default_rng(5)}, advance=advance,
        compute=lambda state: (round(state["t"], 6), state["memory"]["x"]), **options,
    )  # fmt: skip


def test_time_is_scrubbed_backward_and_forward_again_to_what_happened():
    stage, _ = wire(wandering(play=Play(40.0, 0.1), click=True))

    def at(step):
        stage.receive({"time": {"at": step, "epoch": 0}, "serial": f"a:{step}"})
        return stage.result

    seen = {step: at(step) for step in range(0, 301, 7)}
    stage.receive({"click": stage._picture.fraction(stage.figure.axes[0], (1, 1)), "serial": "a:c"})
    clicked, after = stage.result, at(330)
    assert clicked[1] == pytest.approx(seen[294][1] + 100)
    for step in (7, 203, 105, 287):
        assert at(step) == seen[step]
    assert at(294) == clicked and at(330) == after
    at(105)
    stage.receive({"click": stage._picture.fraction(stage.figure.axes[0], (1, 1)), "serial": "a:d"})
    assert at(112)[1] == pytest.approx(seen[112][1] + 100)  # from here on something else happened
    assert at(98) == seen[98]


def test_a_page_waits_no_longer_for_steps_than_it_may(monkeypatch):
    stage, _ = wire(wandering(play=Play(40.0, 0.1)))
    clock = iter(range(10_000))
    monkeypatch.setattr("labkit.stage.stage.monotonic", lambda: next(clock))
    monkeypatch.setattr("labkit.stage.stage.MAX_WAIT", 10)
    stage.receive({"time": {"at": 300, "epoch": 0}, "serial": "a:1"})
    assert 0 < stage.state["t"] < 3.0
    stage.set(t=30.0)
    assert stage.state["t"] == 30.0


def test_make_it_fail_says_why_until_something_is_touched():
    stage = nothing(
        controls={"n": Slider(0, 9, 1)}, fail={"n": 9}, because="It is nine.", describe=lambda result: "Words.",
        play=Play(1.0, 0.1),
    )  # fmt: skip
    assert stage.caption == "Words."
    stage.make_it_fail()
    assert stage.caption == "It is nine. Words."
    stage.set(t=0.5)
    assert stage.caption == "It is nine. Words."
    stage.set(n=4)
    assert stage.caption == "Words."
    stage.make_it_fail()
    stage.reset()
    assert stage.caption == "Words."


# -- space


def test_view_projects_and_unprojects():
    view = View(30, 20, center=(1, 2, 3))
    assert view.axes @ view.axes.T == pytest.approx(np.eye(3))
    assert np.cross(view.axes[0], view.axes[1]) == pytest.approx(view.axes[2])
    assert view.project((1, 2, 3)) == pytest.approx([0, 0, 0])
    assert view.project(view.unproject((3, 4)) + (1, 2, 3)) == pytest.approx([3, 4, 0])
    assert view.project((1, 2, 4))[1] == pytest.approx(np.cos(np.deg2rad(20)))  # up is up
    assert View(0, 80).turned(-10, 30) == View(350, 90)


def space(**options):
    def scene(fig):
        world = Scene(fig.subplots(), radius=10)
        triad, ball = world.triad("W", 4), world.ellipsoid(**style.look("estimate"))
        path = world.line(fade=True, color=style.TRUTH)
        world.fixed(triad, np.eye(4))
        path.set([(0, 0, 0), (1, 2, 3), (np.nan,) * 3, (1, 0, 0), (4, 0, 0)])

        def update(state, result):
            ball.set(state["P"], 4 * np.eye(3))
            world.draw(state["view"])

        return world.artists, update

    return Stage(
        "space", scene=scene, compute=lambda state: state["P"], fail={}, view=View(-60, 25),
        handles={"P": Handle((1, 2, 3), step=1.0)}, **options,
    )  # fmt: skip


def test_a_point_in_space_is_dragged_in_the_plane_of_the_screen():
    stage, sent = wire(space())
    before, view = stage.state["P"], stage.state["view"]
    stage.receive({"step": {"P": (2, 1)}, "serial": "a:2"})
    shift = view.project(stage.state["P"]) - view.project(before)
    assert shift == pytest.approx([2, 1, 0])
    at = stage._picture.fraction(stage.figure.axes[0], (-3, 4))
    stage.receive({"drag": {"P": at}, "serial": "a:3"})
    assert view.project(stage.state["P"])[:2] == pytest.approx([-3, 4])
    assert sent[-1][0]["handles"]["P"]["at"] == pytest.approx(at)


def test_orbit_turns_the_view_and_presets_keep_it():
    stage, _ = wire(space(presets={"home": {"P": (0, 0, 0)}}))
    stage.receive({"orbit": (20, 10), "serial": "a:2"})
    turned = View(310, 30)
    assert stage.state["view"] == turned
    stage.press("home")
    assert stage.state["view"] == turned
    stage.reset()
    assert stage.state["view"] == View(-60, 25)


def test_ellipsoid_outline_of_a_sphere_is_a_circle():
    fig = Figure()
    world = Scene(fig.subplots(), radius=10)
    ball = world.ellipsoid(**style.look("estimate"))
    ball.set((1, 1, 1), 9 * np.eye(3))
    view = View(17, 33)
    world.draw(view)
    outline = np.transpose(ball.artist.get_data())
    assert np.hypot(*(outline - view.project((1, 1, 1))[:2]).T) == pytest.approx(3.0)


# -- drawing


def pixels(stage):
    return np.asarray(Image.open(io.BytesIO(stage.png())))[..., :3]


@pytest.mark.parametrize(
    ("room", "ratio", "expected"),
    [
        ((700, 900), 1, (700, 420)),
        ((1400, 900), 1, (1400, 840)),
        ((350, 900), 1, (350, 280)),
        ((700, 900), 2, (1400, 840)),
        ((350, 900), 3, (1050, 840)),
        ((1000, 300), 1, (800, 300)),
        ((2000, 1200), 3, (2887, 1732)),
    ],
)
def test_the_picture_takes_its_room_sharply_and_letters_keep_their_size(room, ratio, expected):
    """Wider rooms give wider pictures, narrow ones slenderer pictures; 5 million pixels are enough."""
    stage = segment()
    stage._picture.fit(*room, ratio, False)
    assert np.abs(np.subtract(Image.open(io.BytesIO(stage.png())).size, expected)).max() <= 1
    assert stage.figure.dpi == pytest.approx(canvas.CSS_DPI * expected[0] / stage._picture.width, rel=1e-3)


def test_letters_grow_with_those_around():
    stage = segment()
    stage._picture.fit(1400, 840, 1, False, letters=2.0)
    assert stage.figure.get_size_inches() == pytest.approx([7.0, 4.2]) and stage.figure.dpi == 200


def test_dark_theme_exchanges_paper_and_ink_only():
    stage = segment()
    light = pixels(stage)
    stage._picture.fit(700, 900, 1, True)
    dark = pixels(stage)

    def count(image, color):
        return (np.abs(image - 255 * np.array(to_rgb(color))).max(-1) <= 2).sum()

    assert count(light, style.PAPER) > 2e5 and count(dark, style.DARK[style.PAPER]) > 2e5
    assert count(dark, style.PAPER) == 0 and count(light, style.INK) > 50 and count(dark, style.INK) == 0
    assert count(light, style.ESTIMATE) > 100
    assert count(dark, style.ESTIMATE) == pytest.approx(count(light, style.ESTIMATE), rel=0.05)


def test_dark_theme_reaches_collections_and_markers():
    def scene(fig):
        ax = style.bare(fig.subplots())
        ax.set(xlim=(0, 1), ylim=(0, 1))
        dots = ax.scatter([0.3, 0.7], [0.5, 0.5], s=[900, 2500], color=style.INK)
        (mark,) = ax.plot([0.5, 0.2], [0.2, 0.2], "s", color=style.INK, markersize=30)
        return [dots, mark], lambda state, result: None

    stage = Stage("dots", scene=scene, compute=lambda state: None, fail={})
    stage._picture.fit(700, 900, 1, True)
    assert pixels(stage).min(-1).max() == round(255 * to_rgb(style.DARK[style.INK])[0])
    assert pixels(stage).max(-1).min() > 0


def test_background_is_drawn_only_when_it_changes(monkeypatch):
    stage = segment()
    stage.png()
    draws, original = [], canvas.Picture._draw_background
    monkeypatch.setattr(canvas.Picture, "_draw_background", lambda self: (draws.append(1), original(self)))
    for k in range(5):
        stage.set(P=(k, 1))
        stage.png()
    assert not draws
    stage.figure.axes[0].set_xlim(0, 20)
    stage.png()
    assert len(draws) == 1
    stage._picture.fit(500, 900, 1, False)
    stage.png()
    assert len(draws) == 2


def test_words_kept_as_bitmaps_look_like_matplotlibs_own():
    def ink(canvas_class):
        fig = Figure((4, 1), dpi=100)
        canvas_class(fig)
        for k, word in enumerate(("0.123 mm", "Ågy, top", "two\nlines")):
            fig.text(0.02 + 0.33 * k, 0.4, word)
        fig.canvas.draw()
        return 255 - np.asarray(fig.canvas.buffer_rgba())[..., 0].astype(float)

    own, theirs = ink(Canvas), ink(FigureCanvasAgg)
    assert own.sum() == pytest.approx(theirs.sum(), rel=0.1)
    shifted = [np.roll(theirs, (i, j), (0, 1)) for i in (-1, 0, 1) for j in (-1, 0, 1)]
    assert min(np.abs(own - other).sum() for other in shifted) < 0.35 * theirs.sum()


# -- style


def test_colors_are_written_in_one_module_only():
    literal = re.compile(r"#[0-9a-fA-F]{3,8}\b|\brgba?\(|color\w*\s*[=:]\s*[\"'](?!none)[a-z]", re.IGNORECASE)
    for folder in ("stage", "chapters"):
        for path in (ROOT / "labkit" / folder).rglob("*.*"):
            if path.suffix in (".py", ".js", ".css") and path.name not in ("style.py", "exercises.py"):
                for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                    assert not literal.search(line), f"{path.name}, line {number}: take the color from stage/style.py"


def luminance(color):
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(color)]
    return np.dot((0.2126, 0.7152, 0.0722), linear)


@pytest.mark.parametrize("dark", [False, True])
def test_colors_stand_out_from_the_paper(dark):
    paper = luminance(style.themed(style.PAPER, dark))

    def contrast(color):
        low, high = sorted((paper, luminance(style.themed(color, dark))))
        return (high + 0.05) / (low + 0.05)

    assert contrast(style.INK) > 12 and contrast(style.MUTED) > 4.5  # words
    for color in (*style.AXES, style.MEASUREMENT, style.PREDICTION, style.ESTIMATE):
        assert contrast(color) > (4 if dark else 2.2)


def test_going_back_to_a_width_moves_no_axes():
    picture = stages.honesty()._picture
    places = []
    for width in (700, 420, 700):
        picture.fit(width, 900, 1.0, dark=False)
        picture.draw()
        places.append([ax.get_position().bounds for ax in picture.fig.axes])
    np.testing.assert_allclose(places[0], places[2], atol=2 / 700)


# -- a target, and numbers of the sentence


def test_a_target_is_over_the_picture_ends_the_caption_and_turns_when_it_is_reached():
    stage = segment(target=Target("P and Q within 2 mm", lambda distance: distance < 2))
    assert stage.caption == "5.0 mm Target: P and Q within 2 mm." and not stage.reached
    heading, before = stage.figure._suptitle, stage.png()
    assert heading.get_text() == "\N{WHITE CIRCLE} Target: P and Q within 2 mm" and heading.get_fontweight() == "normal"
    extent = heading.get_window_extent(stage._picture.canvas.get_renderer())
    assert stage.figure.bbox.x0 <= extent.x0 and extent.x1 <= stage.figure.bbox.x1
    assert extent.y0 > stage.figure.axes[0].get_window_extent().y1  # the layout made room for it
    stage.set(Q=(1, 2))
    assert stage.caption == "1.0 mm Target reached: P and Q within 2 mm." and stage.reached
    assert heading.get_text().startswith("\N{CHECK MARK} Target reached") and heading.get_fontweight() == "bold"
    stage.reset()
    assert stage.png() == before and not stage.reached


def test_a_target_that_asks_nothing_or_says_too_much_is_refused():
    with pytest.raises(ValueError, match="reached before anything is touched: 'P and Q within 9 mm'"):
        segment(target=Target("P and Q within 9 mm", lambda distance: distance < 9))
    with pytest.raises(ValueError, match="at most 64 letters, got 65"):
        Target("x" * 65, bool)


def test_numbers_of_the_sentence_are_a_sliders_and_say_where_they_stand():
    told = {"describe": lambda distance: f"Times {{scale}} it is {distance:.1f} mm in {{words}}, {{scale}} times."}
    stage, sent = wire(segment(**told))
    assert stage.caption == "Times 1.0 it is 5.0 mm in {words}, 1.0 times."
    stage.receive({"control": {"scale": 20}, "serial": "a:2"})
    message = sent[-1][0]
    assert message["caption"] == "Times 2.0 it is 10.0 mm in {words}, 2.0 times."
    assert [(message["caption"][a:b], name) for a, b, name in message["numbers"]] == [
        ("2.0", "scale"),
        ("2.0", "scale"),
    ]
    stage.make_it_fail()
    assert sent[-1][0]["caption"] == stage.caption
