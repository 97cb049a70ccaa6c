"""A scene in space on a page with Python behind it and no notebook: a lost WebGL context, a lost Python."""

import driver
import numpy as np
import pytest
from contact_sheets import stage_page
from test_space_in_lab import apart, at_rest

from labkit.chapters.ch06_tracker import stages

CONTEXTS = """() => {
    window.contexts = [];
    const getContext = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, ...options) {
        const made = getContext.call(this, kind, ...options);
        if (kind === "webgl2" && !contexts.includes(made)) contexts.push(made);
        return made;
    };
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


def test_python_draws_while_the_context_is_lost_and_the_page_again_when_it_is_back():
    with stage_page(False, 700, 640, 1) as (page, bridge):
        stage = opened(page, bridge)
        before = at_rest(page, 0)[1]
        assert not bridge.stage._picture.painted and page.evaluate("contexts.length") == 1
        page.evaluate("() => { window.loss = contexts[0].getExtension('WEBGL_lose_context'); loss.loseContext(); }")
        page.locator(".labkit-stage canvas[data-space=false]").wait_for(timeout=10_000)
        assert bridge.stage._picture.painted and not stage.locator("canvas.space").is_visible()
        page.evaluate("() => loss.restoreContext()")
        page.locator(".labkit-stage canvas[data-space=true]").wait_for(timeout=10_000)
        assert not bridge.stage._picture.painted
        assert apart(at_rest(page, 0)[1][2], before[2]) < 0.1
        assert page.complaints == []


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
        stage.locator(".gone", has_text="Python does not answer").wait_for(timeout=5000)
        there = handle.bounding_box()
        assert np.hypot(there["x"] - start["x"], there["y"] - start["y"]) < 1
        stage.locator("canvas:not(.space)").focus()
        page.keyboard.press("Shift+ArrowRight")
        page.keyboard.press("ArrowRight")
        assert apart(at_rest(page, 0)[1][2], before[2]) > 0.5
        assert stage.locator(".gone").inner_text() != ""
