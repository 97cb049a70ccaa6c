"""A Stage on a page with Python behind it and no notebook: sharp screens, numbers of the caption, a lost WebGL context,
a lost Python.
"""

import driver
import numpy as np
import pytest
from contact_sheets import CUT, UNHEARD, stage_page
from matplotlib.colors import to_rgb
from test_space_in_lab import CONTEXTS, apart, at_rest

from labkit.chapters.ch02_chaining import stages as chaining
from labkit.chapters.ch05_hand_eye import stages as hand_eye
from labkit.chapters.ch06_tracker import stages
from labkit.chapters.ch09_monte_carlo import stages as monte_carlo
from labkit.exercises.feedback import Panel
from labkit.exercises.outcome import NOT_YET
from labkit.stage import Stage, Toggle, View, front
from labkit.stage import scene3d_solids as solids
from labkit.stage.scene3d import Scene

SMALL = """(canvas) => {
    const small = new OffscreenCanvas(100, 60).getContext("2d");
    small.imageSmoothingQuality = "high";
    small.drawImage(canvas, 0, 0, 100, 60);
    return [...small.getImageData(0, 0, 100, 60).data];
}"""


@pytest.fixture(scope="module", autouse=True)
def browser():
    if not driver.find_browser():
        driver.missing("no Chromium on this machine: the browser test needs one")


def opened(page, bridge):
    """The robot of chapter 6, drawn by the page."""
    page.evaluate(CONTEXTS)
    bridge.show(page, stages.tx40())
    page.locator(".labkit-stage canvas[data-space=true]").wait_for(timeout=20_000)
    return page.locator(".labkit-stage")


def middle_of(small):
    """Where the middle of what is covered lies in a picture of 80 x 60 pixels."""
    covered = np.reshape(small, (60, 80, 4))[..., 3]
    return np.tensordot(covered, np.mgrid[:60, :80], axes=([0, 1], [1, 2])) / covered.sum()


def sharp(page, ratio):
    """Every canvas has a pixel for each of the screen's."""
    for canvas in page.locator("canvas").all():
        assert canvas.evaluate("node => node.width / node.clientWidth") == pytest.approx(ratio, abs=0.01)


def test_a_body_one_can_look_through_is_drawn_where_there_is_a_shadow():
    def covered(page):
        return np.mean(np.reshape(at_rest(page, 0)[1][2], (-1, 4))[:, 3] > 10)

    with stage_page(False, 700, 640, 1) as (page, bridge):
        reach = opened(page, bridge).get_by_label("where the wrist can get")
        before = covered(page)
        reach.check()
        assert covered(page) > before + 0.1


def test_a_sharp_screen_shows_the_same_with_more_pixels():
    """In space, drawn several times over: the first picture, one turned to and fro; then in the plane."""
    seen, small = {}, {}
    for ratio in (1, 2):
        with stage_page(False, 700, 640, ratio) as (page, bridge):
            stage = opened(page, bridge)
            stage.locator("canvas:not(.space)").focus()
            for key in ("ArrowRight", "Home"):
                page.keyboard.press(key)
            seen[ratio] = at_rest(page, 0)[1]
            sharp(page, ratio)
            bridge.show(page, chaining.growth())
            small[ratio] = np.array(page.locator("canvas:not(.space)").evaluate(SMALL)).reshape(60, 100, 4)[..., :3]
            sharp(page, ratio)
    assert seen[2][0] == pytest.approx(seen[1][0], rel=0.1)  # as much of it is covered
    middles = [middle_of(seen[ratio][2]) for ratio in (1, 2)]
    assert np.hypot(*np.subtract(*middles)) < 1  # at the same place
    assert np.abs(small[1] - small[2]).mean() < 3  # of 255: letters and lines have their own pixels


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_everything_has_a_name_a_ring_and_keys_and_nothing_is_cut(dark):
    """With reduced motion, as wide as half a screen: points, a scene in space, a click, a pen with time.

    `contact_sheets.py` asks the same of every Stage in four sizes.
    """
    with stage_page(dark, 620, 650, 1) as (page, bridge):
        for make in (chaining.two_loops, hand_eye.thirty_one_poses, monte_carlo.arena):
            bridge.show(page, make())
            assert page.evaluate(CUT) == [] and page.evaluate(UNHEARD) == [], make.__name__
            page.evaluate("() => { document.querySelector('.labkit-stage .buttons button').textContent = ''; }")
            assert page.evaluate(UNHEARD) == ["BUTTON has no name"]  # the question can be answered with no
        tree = page.locator(".labkit-stage").aria_snapshot()
        assert 'slider "time"' in tree and 'button "Make it fail"' in tree and 'application "arena' in tree
        assert page.complaints == []


COVERED = """() => {
    const hint = document.querySelector(".hint"), its = hint.getBoundingClientRect();
    const cut = hint.scrollWidth > hint.clientWidth || hint.scrollHeight > hint.clientHeight + 1;
    if (!its.width || cut) return ["the hint"];
    const beside = (box) => box.left >= its.right - 1 || its.left >= box.right - 1;
    const above = (box) => box.top >= its.bottom - 1 || its.top >= box.bottom - 1;
    const all = [...document.querySelectorAll(".picture, .labkit-stage p:not(:empty), button, input, select, output")];
    const met = all.filter((node) => !beside(node.getBoundingClientRect()) && !above(node.getBoundingClientRect()));
    return met.map((node) => node.className || node.tagName);
}"""


@pytest.mark.parametrize("width, height, lines", [(1000, 800, 0), (360, 640, 1)])
def test_the_hint_on_keys_covers_nothing_and_resizes_no_picture(width, height, lines):
    """In the gap of the buttons' row where it fits there, else in a line of its own; it goes with the focus."""
    with stage_page(False, width, height, 1) as (page, bridge):
        bridge.show(page, monte_carlo.arena())
        before = page.locator(".picture").bounding_box()
        page.keyboard.press("Tab")  # from now on the browser shows where the focus is
        page.locator(".labkit-stage canvas").focus()
        assert page.evaluate(COVERED) == [] and page.locator(".hint.under").count() == lines
        page.evaluate(driver.RESTS)
        assert page.locator(".picture").bounding_box() == before
        page.locator("button.enlarge").focus()
        assert not page.locator(".hint").is_visible() and page.locator(".buttons .hint").count() == 1


EDITOR = """([theme, paper, words]) => {
    document.getElementById("theme").textContent = "";
    const colors = { "editor-background": paper, "editor-foreground": words, "input-background": paper };
    for (const name in colors) document.documentElement.style.setProperty(`--vscode-${name}`, colors[name]);
    document.body.className = `vscode-body ${theme}`;
    document.body.dataset.vscodeThemeKind = theme.split(" ").pop();
}"""
WIDGETS = """
    :root { --jp-content-font-color1: black; --jp-layout-color0: white; --jp-brand-color1: blue; }
    .cell-output-ipywidget-background { background: white !important; }
    body { background: var(--vscode-editor-background); }
"""  # of @jupyter-widgets/controls (css/labvariables.css) and of VS Code's renderer, which bring them in every theme
THEMES = (
    ("vscode-dark", "#1e1e1e", "#cccccc"),
    ("vscode-light", "#ffffff", "#3b3b3b"),
    ("vscode-high-contrast", "#000000", "#ffffff"),
    ("vscode-high-contrast vscode-high-contrast-light", "#ffffff", "#292929"),
)
ANSWER = """(answer) => {
    document.querySelector(".labkit-stage").classList.add("cell-output-ipywidget-background");
    document.body.insertAdjacentHTML("beforeend", `<div class="cell-output-ipywidget-background">${answer}</div>`);
}"""
SEEN = """(node) => {
    const color = getComputedStyle(node).color;
    for (; node; node = node.parentElement) {
        const paper = getComputedStyle(node).backgroundColor;
        if (paper !== "rgba(0, 0, 0, 0)") return [color, paper];
    }
}"""


def test_the_theme_of_another_editor_is_followed():
    """A page with what VS Code's renderer of widgets puts into its own: names of its themes, its colors, JupyterLab's
    light ones and a white panel around each widget. VS Code itself is not run here.
    """
    with stage_page(False, 700, 640, 1) as (page, bridge):
        page.add_style_tag(content=WIDGETS)
        page.add_style_tag(content=(driver.ROOT / "labkit/live/live.css").read_text(encoding="utf-8"))
        for theme, paper, words in THEMES:
            page.evaluate(EDITOR, [theme, paper, words])
            if bridge.stage is None:
                bridge.show(page, chaining.growth())
                answer = Panel("invert: not yet", ["The translation is off."], NOT_YET).html()
                page.evaluate(ANSWER, answer)
            dark = sum(to_rgb(paper)) < 1.5
            assert driver.soon(page, lambda dark=dark: bridge.stage._picture.dark is dark)
            page.evaluate(driver.RESTS)
            corner = page.locator("canvas:not(.space)").evaluate(
                "node => node.getContext('2d').getImageData(2, node.height - 2, 1, 1).data[0]"
            )
            assert corner < 40 if dark else corner > 220
            for told in (".caption", "button.enlarge", "[role=status] > div + div"):
                seen = page.locator(told).first.evaluate(SEEN)
                assert seen == [f"rgb{tuple(round(255 * v) for v in to_rgb(color))}" for color in (words, paper)], told
        assert page.complaints == []


def test_numbers_of_the_caption_are_dragged_keyed_and_keep_the_focus():
    with stage_page(False, 700, 640, 1) as (page, bridge):
        bridge.show(page, chaining.open_loop())
        number = page.locator('.caption [data-number="turn_deg"]')
        slider = page.get_by_role("slider", name="its error (deg)").last
        assert number.inner_text() == "3.0" and number.get_attribute("aria-valuetext") == "3.0 deg"
        number.focus()
        page.keyboard.press("ArrowRight")
        page.keyboard.press("Shift+ArrowRight")
        page.wait_for_function("() => document.querySelector('[data-number=turn_deg]').textContent === '4.1'")
        assert number.evaluate("node => node === document.activeElement")
        assert (
            bridge.stage.state["turn_deg"] == pytest.approx(4.1) and slider.get_attribute("aria-valuetext") == "4.1 deg"
        )
        box = number.bounding_box()
        page.mouse.move(box["x"] + 4, box["y"] + 4)
        page.mouse.down()
        page.mouse.move(box["x"] + 4 - 40, box["y"] + 4, steps=5)
        page.mouse.up()
        page.wait_for_function("() => document.querySelector('[data-number=turn_deg]').textContent === '3.1'")
        assert bridge.stage.state["turn_deg"] == pytest.approx(3.1) and page.complaints == []
        bridge.is_gone, at = True, slider.input_value()
        number.press("ArrowRight")
        page.locator(".gone", has_text="Python does not answer").wait_for(timeout=20_000)
        page.wait_for_timeout(500)  # longer than a change of size takes to be noticed
        assert slider.input_value() == at
        assert len(bridge.unheard) == 1 and "look" not in bridge.unheard[0]  # what is said asks for no other picture
        bridge.is_gone = False
        number.press("ArrowRight")  # one step on from what is shown
        page.wait_for_function("() => document.querySelector('[data-number=turn_deg]').textContent === '3.2'")


def test_python_draws_while_the_context_is_lost_and_the_page_again_when_it_is_back():
    with stage_page(False, 700, 640, 1) as (page, bridge):
        stage = opened(page, bridge)
        before = at_rest(page, 0)[1]
        assert not bridge.stage._picture.painted and page.evaluate("contexts.length") == 1
        page.evaluate("() => { window.loss = contexts[0].getExtension('WEBGL_lose_context'); loss.loseContext(); }")
        page.locator(".labkit-stage canvas[data-space=false]").wait_for(timeout=30_000)
        assert bridge.stage._picture.painted and not stage.locator("canvas.space").is_visible()
        page.evaluate("() => loss.restoreContext()")
        page.locator(".labkit-stage canvas[data-space=true]").wait_for(timeout=30_000)
        assert not bridge.stage._picture.painted
        assert apart(at_rest(page, 0)[1][2], before[2]) < 0.1
        assert page.complaints == []


def two_balls():
    """A ball and a half shell, which a control mirrors in a plane that changes neither."""

    def scene(fig):
        space = Scene(fig.subplots(), radius=3, floor=-1.5)
        profile = [(1.2 * np.sin(a), -1.2 * np.cos(a)) for a in np.linspace(0, np.pi / 2, 9)]
        bodies = space.body(solids.sphere(1.2)), space.body(solids.turned(profile))

        def update(state, result):
            for body, place in zip(bodies, (-1.4, 1.4)):
                T = np.diag([1.0, -1.0 if state["mirrored"] else 1.0, 1.0, 1.0])
                T[0, 3] = place
                body.set(T)
            space.draw(state["view"])

        return space.artists, update

    return Stage("two balls", scene=scene, compute=lambda state: None, fail={"mirrored": True},
                 controls={"mirrored": Toggle(False)}, view=View(-60, 30))  # fmt: skip


FIRST_DRAWN = """() => {
    const gl = contexts[0];
    const { drawElements } = gl;
    const counts = [];
    gl.drawElements = (kind, count, ...rest) => {
        counts.push(count / 3);
        drawElements.call(gl, kind, count, ...rest);
    };
    dispatchEvent(new Event("beforeprint")); // once more; bodies come first
    gl.drawElements = drawElements;
    return counts[0];
}"""


def test_of_a_closed_body_its_outside_alone_is_drawn_mirrored_or_not():
    with stage_page(False, 500, 500, 1) as (page, bridge):
        page.evaluate(CONTEXTS)
        bridge.show(page, two_balls())
        _, (covered, _, before) = at_rest(page, 0)
        drawn = page.evaluate(FIRST_DRAWN)
        triangles = int(page.locator(".picture").get_attribute("data-triangles"))
        assert triangles / 3 < drawn < 0.8 * triangles  # half of the ball, and the whole shell
        page.locator("input[type=checkbox]").check()
        _, (_, _, after) = at_rest(page, 0)
        assert covered > 0.05 and apart(before, after) < 0.5
        assert page.evaluate(FIRST_DRAWN) == pytest.approx(drawn, rel=0.1)
        assert page.complaints == []


WRITTEN = """() => {
    const pen = CanvasRenderingContext2D.prototype;
    const { fillText } = pen;
    const boxes = [];
    pen.fillText = function (text, x, y) {
        const { actualBoundingBoxLeft: l, actualBoundingBoxRight: r, actualBoundingBoxAscent: u, actualBoundingBoxDescent: d } = this.measureText(text);
        boxes.push([x - l, y - u, x + r, y + d]);
    };
    dispatchEvent(new Event("beforeprint")); // draws it once more
    pen.fillText = fillText;
    return [boxes, document.querySelector("canvas.space").clientWidth];
}"""  # noqa: E501


def test_words_of_a_scene_stay_whole_and_scale_and_base_frame_stand_above_them():
    def scene(fig):
        space = Scene(fig.subplots(), radius=3, unit="mm")
        names = [space.fixed(space.text("a name of several words"), (0, y, -2.8)) for y in (-2.9, 2.9)]
        return space.artists, lambda state, result: space.draw(state["view"]) or names

    stage = Stage(
        "names", scene=scene, compute=dict, fail={"on": True}, controls={"on": Toggle(False)}, view=View(0, 0)
    )
    with stage_page(False, 420, 500, 1) as (page, bridge):
        bridge.show(page, stage)
        boxes, width = page.evaluate(WRITTEN)
    left, top, right, bottom = np.transpose(boxes)
    assert len(boxes) == 5 and left.min() >= 0 and right.max() <= width  # both names, the scale, y and z of the base
    across = np.minimum(right[:, None], right) - np.maximum(left[:, None], left)
    along = np.minimum(bottom[:, None], bottom) - np.maximum(top[:, None], top)
    assert not (np.triu(np.minimum(across, along), 1) > 0).any()


SPACE_OF_THE_PAGE = "globalThis[Symbol.for('labkit.space')]"


def test_a_drawing_that_comes_along_is_ready_before_the_first_picture_and_one_that_does_not_come_is_not_waited_for():
    stage, asked = two_balls(), []
    receive = stage.receive
    stage.receive = lambda message: (asked.append(message), receive(message))
    with stage_page(False, 500, 500, 1) as (page, bridge):
        page.evaluate(f"() => {{ {SPACE_OF_THE_PAGE} = {{ load: () => new Promise(() => {{}}) }}; }}")
        bridge.connect(stage)
        page.evaluate("declaration => window.show(declaration)", stage.declaration())
        page.locator(".labkit-stage[data-picture]").wait_for(timeout=20_000)
        assert [message["look"]["space"] for message in asked if "look" in message] == [False]
        asked.clear()
        page.evaluate(f"() => {{ delete {SPACE_OF_THE_PAGE}; }}")
        page.evaluate("source => window.bring(source)", front.SPACE.read_text(encoding="utf-8"))
        bridge.show(page, stage)
        assert [message["look"]["space"] for message in asked if "look" in message] == [True]
        assert not any("need" in message for message in asked) and page.complaints == []


MANY = """(count) => {
    const place = document.createElement("div");
    document.body.append(place);
    for (let k = 0; k < count; k++) {
        const stage = document.querySelector(".labkit-stage");
        const { module } = globalThis[Symbol.for("labkit.space")];
        const box = Object.assign(document.createElement("div"), { className: "labkit-stage more" });
        const picture = Object.assign(document.createElement("div"), { className: "picture" });
        const canvas = document.createElement("canvas");
        Object.assign(picture.style, { width: "600px", height: "400px" });
        picture.append(canvas);
        box.append(picture);
        place.append(box);
        const hooks = { onMove() {}, onAble() {}, seat() {}, width: 700 };
        const view = new module.View(picture, canvas, window.declared.spaces, window.declared.home, hooks);
        view.receive(window.told.space, window.told.numbers, false);
    }
}"""


def test_twenty_scenes_on_a_page_share_one_context_and_those_out_of_sight_hold_no_pixels():
    with stage_page(False, 700, 640, 1) as (page, bridge):
        opened(page, bridge)
        at_rest(page, 0)
        bridge.stage._picture.fit(600, 400, 1, False, space=True)
        space = bridge.stage.spaces[0]
        rows, numbers = space.news(whole=True)
        told = {"places": [[0, 0, 1, 1, 1300]], "rows": [rows], "view": None}
        page.evaluate(
            "([declared, space, numbers]) => Object.assign(window,"
            " { declared, told: { space, numbers: new Float32Array(numbers) } })",
            [bridge.stage.declaration(), told, np.where(np.isfinite(numbers), numbers, 0).tolist()],
        )
        page.evaluate(MANY, 19)

        def holding():
            return page.evaluate("() => [...document.querySelectorAll('canvas.space')].filter(c => c.width > 1).length")

        assert driver.soon(page, lambda: 1 <= holding() <= 4)  # those in the window or near it
        assert page.locator("canvas.space").count() == 20 and page.evaluate("contexts.length") == 1
        page.locator(".labkit-stage").last.scroll_into_view_if_needed()
        page.wait_for_function("[...document.querySelectorAll('canvas.space')].at(-1).width > 1", timeout=20_000)
        covered, colors, _ = at_rest(page, 19)[1]
        assert covered > 0.02 and colors > 200 and page.complaints == []


def test_a_picture_far_from_the_window_gives_its_pixels_back_and_goes_on_all_the_same():
    with stage_page(False, 700, 640, 1) as (page, bridge):
        bridge.show(page, hand_eye.scan_line())
        canvas = page.locator(".labkit-stage canvas")

        def press(name):
            shown = page.locator(".labkit-stage").get_attribute("data-picture")
            page.get_by_role("button", name=name, include_hidden=True).dispatch_event("click")
            page.wait_for_function(
                "shown => document.querySelector('.labkit-stage').dataset.picture !== shown", arg=shown
            )

        press("Make it fail")
        failed = canvas.evaluate(SMALL)
        press("Reset")
        assert canvas.evaluate(SMALL) != failed
        page.evaluate("document.body.style.marginTop = '6000px'")
        page.wait_for_function("document.querySelector('.labkit-stage canvas').width === 1")
        press("Make it fail")
        assert canvas.evaluate("node => node.width") == 1
        page.evaluate("document.body.style.marginTop = 0")
        assert driver.soon(page, lambda: canvas.evaluate(SMALL) == failed)
        page.evaluate("document.body.style.marginTop = '6000px'")
        page.wait_for_function("document.querySelector('.labkit-stage canvas').width === 1")
        jumped = "scrollTo(0, 1e6); await new Promise(requestAnimationFrame); return node.width; }"
        assert canvas.evaluate(f"async (node) => {{ {jumped}") > 1  # in the very frame: nothing flashes
        page.evaluate("scrollTo(0, 0)")
        page.wait_for_function("document.querySelector('.labkit-stage canvas').width === 1")
        page.evaluate("dispatchEvent(new Event('beforeprint'))")
        assert canvas.evaluate("node => node.width") > 1
        page.evaluate("dispatchEvent(new Event('afterprint'))")
        page.wait_for_function("document.querySelector('.labkit-stage canvas').width === 1")
        page.evaluate("document.body.style.marginTop = 0; document.body.style.width = 0")  # put back before it has room
        page.wait_for_timeout(200)
        page.evaluate("document.body.style.width = ''")
        assert driver.soon(page, lambda: canvas.evaluate("node => node.width") > 1)
        assert page.complaints == []


def test_a_click_on_a_frame_of_the_cell_chooses_it_from_wherever_one_looks():
    with stage_page(False, 820, 700, 1) as (page, bridge):
        page.evaluate(CONTEXTS)
        bridge.show(page, stages.whole_cell())
        page.locator(".labkit-stage canvas[data-space=true]").wait_for(timeout=20_000)
        at_rest(page, 0)
        stage, canvas = bridge.stage, page.locator(".labkit-stage canvas:not(.space)")
        there = stage.state["view"].azimuth_deg - 15  # after three presses; what one sees is told at rest
        canvas.focus()
        for _ in range(3):
            page.keyboard.press("ArrowLeft")
        assert driver.soon(page, lambda: abs((stage.state["view"].azimuth_deg - there + 180) % 360 - 180) < 1e-6)
        at_rest(page, 0)
        box = canvas.bounding_box()
        place = stage.state["view"].project(stage.result["places"]["marks"])[:2]
        x, y = stage._picture.fraction(stage.figure.axes[0], place)
        page.mouse.click(box["x"] + x * box["width"], box["y"] + y * box["height"])
        page.locator(".caption", has_text="The part as learned").wait_for(timeout=20_000)
        assert stage.state["source"] == "marks" and page.complaints == []


def test_without_python_the_view_still_turns_and_a_pulled_handle_goes_back():
    with stage_page(False, 700, 640, 1) as (page, bridge):
        stage = opened(page, bridge)
        before = at_rest(page, 0)[1]
        bridge.is_gone = True
        handle = stage.locator("[data-handle=flange]")
        start = handle.bounding_box()
        x, y = start["x"] + start["width"] / 2, start["y"] + start["height"] / 2
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 40, y - 30, steps=3)
        page.mouse.up()
        stage.locator(".gone", has_text="Python does not answer").wait_for(timeout=20_000)
        there = handle.bounding_box()
        assert np.hypot(there["x"] - start["x"], there["y"] - start["y"]) < 1
        stage.locator("canvas:not(.space)").focus()
        page.keyboard.press("Shift+ArrowRight")
        page.keyboard.press("ArrowRight")
        assert apart(at_rest(page, 0)[1][2], before[2]) > 0.5
        assert stage.locator(".gone").inner_text() != ""


def test_a_bar_beside_a_scene_in_space_is_picked_by_key():
    with stage_page(False, 700, 640, 1) as (page, bridge):
        stage = hand_eye.thirty_one_poses()
        bridge.show(page, stage)
        before, view = stage.caption, stage.state["view"]
        page.locator("canvas:not(.space)").focus()
        for key in ("Enter", *["Shift+ArrowRight"] * 6, "Space"):
            page.keyboard.press(key)
        page.evaluate(driver.RESTS)
        assert page.locator(".cursor").evaluate("node => node.style.left") == "80%"
        assert stage.caption != before and stage.state["view"] == view  # Shift moves the cursor, not the view


GIVEN_UP = """async () => {
    const heard = [];
    class Plain { _handle_comm_msg(message) { heard.push(message); } }
    class Waiting extends Plain { async _handle_comm_msg() { throw new Error("given up"); } }
    const found = Object.assign(new Waiting(), { comm: { on_msg(hear) { this.hear = hear; } } });
    const manager = { get_model: async (own) => ({ seven: found })[own] };
    initialize({ model: { get: (name) => ({ own: "seven" })[name], widget_manager: manager } });
    await new Promise((go) => setTimeout(go));
    found.comm.hear("a picture");
    return heard;
}"""


def test_a_model_that_was_given_up_while_the_page_was_busy_hears_nevertheless():
    with stage_page(False, 700, 400, 1) as (page, _):
        assert page.evaluate(GIVEN_UP) == ["a picture"]
        assert page.complaints == []
