"""The student's afternoon in a real browser: `python lab.py` opens JupyterLab, cells answer, handles move.

Runs against a copy of chapter 1 as the source gives it. Skipped where there is no Chromium, except in CI.
"""

import driver
import pytest

WRONG = '''@ex.invert
def invert(T):
    """Return the inverse of a rigid transform, shape (4, 4); nothing needs to be solved."""
    X = np.eye(4)
    X[:3, :3] = T[:3, :3].T
    X[:3, 3] = -T[:3, 3]
    return X
'''
RIGHT = WRONG.replace("-T[:3, 3]", "-T[:3, :3].T @ T[:3, 3]")


@pytest.fixture(scope="module")
def notebook():
    """A fresh blank chapter 1 below the checkout, so that no student's file is touched."""
    with driver.notebook_copy("01") as copy:
        yield copy


@pytest.fixture(scope="module")
def page(lab):
    return lab


def test_the_first_notebook_opens_and_nothing_is_asked(page):
    page.get_by_role("heading", name="start here").wait_for(timeout=30_000)
    assert page.locator(".jp-Dialog, .Toastify__toast").count() == 0


def test_chapter_1_runs_to_its_end_unsolved(page, notebook):
    driver.open_instead(page, notebook)
    driver.run_all(page)
    errors = page.locator(".jp-Notebook:visible [data-mime-type='application/vnd.jupyter.stderr']").all_inner_texts()
    assert not errors
    assert "to do" in feedback(page)


def feedback(page):
    """What stands beneath the exercise `invert`."""
    return driver.cell_with(page, "def invert(T)").locator(".jp-OutputArea").inner_text(timeout=10_000)


def test_a_wrong_answer_is_named_and_the_right_one_is_correct(page):
    cell = driver.cell_with(page, "def invert(T)")
    driver.retype(page, cell, WRONG)
    assert "invert: not yet" in feedback(page)
    assert "translation" in feedback(page)
    driver.retype(page, cell, RIGHT)
    assert "invert: correct" in feedback(page)
    assert "not yet" not in feedback(page)


def test_a_handle_follows_mouse_and_arrow_keys(page):
    driver.cell_with(page, '"edges"').locator("button").first.click()
    stage = page.locator(".labkit-stage").first
    stage.locator(".handle").first.wait_for(timeout=20_000)
    handle = stage.locator(".handle").first
    start, before = handle.bounding_box(), look(page, stage)
    x, y = start["x"] + start["width"] / 2, start["y"] + start["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 30, y - 25, steps=6)
    page.mouse.up()
    dragged = look(page, stage)
    moved = handle.bounding_box()
    assert dragged != before
    assert abs(moved["x"] - start["x"] - 30) < 3 and abs(moved["y"] - start["y"] + 25) < 3
    handle.focus()
    for key in ("ArrowLeft", "Shift+ArrowLeft"):
        page.keyboard.press(key)
    assert look(page, stage) != dragged
    assert handle.bounding_box()["x"] < moved["x"]
    stage.page.get_by_role("button", name="Make it fail").first.click()
    failing = look(page, stage)
    stage.page.get_by_role("button", name="Reset").first.click()
    assert look(page, stage) != failing
    assert abs(handle.bounding_box()["x"] - start["x"]) < 2


def test_a_picture_made_of_changes_is_the_whole_picture(page):
    stage = page.locator(".labkit-stage").first
    stage.locator(".handle").nth(1).focus()
    for key in ("Shift+ArrowUp", "Shift+ArrowRight", "ArrowUp"):
        page.keyboard.press(key)
    followed = look(page, stage)
    for dark in (True, False):  # a new theme brings a whole picture
        number = stage.get_attribute("data-picture")
        driver.set_theme(page, dark)
        page.wait_for_function(
            "([node, number]) => node.dataset.picture !== number", arg=[stage.element_handle(), number]
        )
        assert (look(page, stage) == followed) != dark


def look(page, stage):
    """The pixels of a Stage, once it has come to rest."""
    page.wait_for_timeout(600)
    return page.evaluate("(node) => node.querySelector('canvas').toDataURL()", stage.element_handle())


def test_a_wide_formula_scrolls_and_is_not_cut(page):
    page.set_viewport_size({"width": 853, "height": 480})
    page.wait_for_timeout(500)
    formulas = page.evaluate("""() => {
        const seen = document.querySelector(".jp-Notebook .jp-WindowedPanel-outer").getBoundingClientRect();
        return [...document.querySelectorAll('.jp-Notebook mjx-container[display="true"]')].map((node) =>
            [node.getBoundingClientRect().right <= seen.right, node.scrollWidth > node.clientWidth + 5]);
    }""")
    page.set_viewport_size({"width": 1280, "height": 900})
    assert all(inside for inside, _ in formulas)
    assert any(scrolls for _, scrolls in formulas), "chapter 1 has formulas wider than this window"


def test_no_other_host_was_called_and_the_console_is_quiet(page):
    """Last in this file: it looks at all that happened above."""
    assert page.hosts <= {"localhost", "127.0.0.1", None}, "None stands for pictures the page makes itself"
    assert not page.complaints
