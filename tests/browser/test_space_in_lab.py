"""Scenes in space in JupyterLab, in Chromium: turned without the kernel, dragged, keyed; the drawing is loaded once.

One small notebook with three Stages; what is on the canvases is compared, not only that something was sent.
"""

import driver
import numpy as np
import pytest

CELLS = (
    "from labkit.chapters.ch06_tracker import stages\nrobot = stages.tx40()\nrobot",
    "from labkit.chapters.ch03_quirlen import stages as tools\ntools.pose_designer()",
    "from labkit.chapters.ch01_frames import stages as frames\nframes.kuka_gimbal()",
)
CONTEXTS = """() => {
    window.contexts = [];
    const getContext = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, ...options) {
        const made = getContext.call(this, kind, ...options);
        if (kind === "webgl2" && !contexts.includes(made)) contexts.push(made);
        return made;
    };
}"""
PIXELS = """(stage) => {
    const canvas = stage.querySelector("canvas.space");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const colors = new Set();
    let covered = 0;
    for (let k = 0; k < data.length; k += 4) {
        if (data[k + 3] < 128) continue;
        covered++;
        colors.add(data[k] * 65536 + data[k + 1] * 256 + data[k + 2]);
    }
    const small = new OffscreenCanvas(80, 60).getContext("2d");
    small.imageSmoothingQuality = "high";
    small.drawImage(canvas, 0, 0, 80, 60);
    return [covered / (canvas.width * canvas.height), colors.size, [...small.getImageData(0, 0, 80, 60).data]];
}"""


def apart(one, other):
    """How far two small pictures are apart: mean of the differences of their numbers from 0 to 255."""
    return np.abs(np.subtract(one, other)).mean()


@pytest.fixture(scope="module")
def page(lab):
    with driver.notebook_of(*CELLS) as copy:
        driver.open_instead(lab, copy)
        driver.run_all(lab)
        driver.show_notebook_alone(lab)
        yield lab


def at_rest(page, number):
    """(stage, [share of pixels covered, number of colors, the picture]) once the picture stays."""
    stage = page.locator(".labkit-stage").nth(number)
    stage.scroll_into_view_if_needed()
    stage.locator(".picture[data-pictures]").wait_for(timeout=20_000)
    before = None
    for _ in range(40):
        page.wait_for_timeout(300)
        stage.locator(".picture[data-rest=true]").wait_for(timeout=20_000)  # drawn with all its pixels
        now = stage.evaluate(PIXELS)
        if now == before:
            return stage, now
        before = now
    raise AssertionError("the scene does not come to rest")


def test_the_robot_is_turned_without_the_kernel_and_comes_home(page):
    stage, (covered, colors, before) = at_rest(page, 0)
    assert covered > 0.05 and colors > 200  # bodies with light on them
    answered = stage.get_attribute("data-picture")
    canvas = stage.locator("canvas:not(.space)")
    box, handle = canvas.bounding_box(), stage.locator("[data-handle=flange]")
    flange = handle.bounding_box()
    page.mouse.move(box["x"] + 60, box["y"] + 60)
    page.mouse.down()
    page.mouse.move(box["x"] + 180, box["y"] + 90, steps=6)
    page.mouse.up()
    _, (_, _, turned) = at_rest(page, 0)
    assert apart(turned, before) > 1 and stage.get_attribute("data-picture") == answered
    moved = handle.bounding_box()
    assert np.hypot(moved["x"] - flange["x"], moved["y"] - flange["y"]) > 20  # the handle stays on the flange
    canvas.focus()
    page.keyboard.press("Home")
    _, (_, _, home) = at_rest(page, 0)
    assert apart(home, before) < 0.1


def test_a_tool_is_dragged_over_the_dome(page):
    stage, (_, _, before) = at_rest(page, 1)
    handle, caption = stage.locator("[data-handle=D1]"), stage.locator(".caption").inner_text()
    box = handle.bounding_box()
    page.mouse.move(box["x"] + 16, box["y"] + 16)
    page.mouse.down()
    page.mouse.move(box["x"] + 46, box["y"] + 46, steps=5)
    page.mouse.up()
    _, (_, _, after) = at_rest(page, 1)
    there = handle.bounding_box()
    assert apart(after, before) > 0.2 and stage.locator(".caption").inner_text() != caption
    assert np.hypot(there["x"] - box["x"] - 30, there["y"] - box["y"] - 30) < 3  # it stays under the pointer


def test_keys_turn_the_gimbal_and_its_slider_turns_the_rings(page):
    stage, (_, _, before) = at_rest(page, 2)
    stage.locator("canvas:not(.space)").focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowUp")
    _, (_, _, turned) = at_rest(page, 2)
    assert apart(turned, before) > 0.2
    stage.locator("[data-control=B_deg] input").focus()
    page.keyboard.press("ArrowRight")
    _, (_, _, tilted) = at_rest(page, 2)
    assert apart(tilted, turned) > 0.05
    assert page.evaluate("() => document.querySelectorAll('canvas.space').length") == 3
    assert page.complaints == []
