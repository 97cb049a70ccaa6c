"""A Stage in every place, for every hand and ear, and on the next day: in JupyterLab, in Chromium.

One small notebook holds a figure with sliders, one with time, one to draw on, a prediction and an exercise.
"""

import json

import driver
import nbformat
import pytest

CELLS = (
    "from labkit.chapters.ch01_frames import stages\nprint('a printed line')\nstages.kuka_gimbal()",
    "from labkit.chapters.ch03_quirlen import stages as swirling\nswirling.swirl()",
    "from labkit.chapters.ch04_optimization import stages as surfaces\nsurfaces.basins()",
    "from labkit.chapters.ch01_frames.stages import three_points\n"
    'from labkit.exercises import course\nex = course("01-frames")\n'
    'ex.predict("pole", ..., reveal=three_points)',
    "ex.invert(lambda T: T)",
)
GIMBAL, SWIRL, BASINS, POINTS = range(4)
ANSWERED = """(number) => {
    const { top, bottom } = document.querySelectorAll(".labkit-stage")[number].getBoundingClientRect();
    const seen = document.querySelector(".jp-Notebook .jp-WindowedPanel-outer").getBoundingClientRect();
    const place = document.activeElement.closest("[data-labkit-live]");
    return { whole: top >= seen.top - 1 && bottom <= seen.bottom + 1,
             focus: place !== null && place.querySelector(".labkit-stage") !== null };
}"""
MENDED = "Run All makes it live again."


@pytest.fixture(scope="module")
def notebook():
    with driver.notebook_of(*CELLS) as copy:
        yield copy


@pytest.fixture(scope="module")
def page(lab, notebook):
    driver.open_instead(lab, notebook)
    lab.untouched = driver.save(lab, notebook)
    driver.run_all(lab)
    lab.locator(".jp-OutputArea-output button", has_text="it does not move").click()
    lab.locator(".labkit-stage[data-picture]").nth(POINTS).wait_for(timeout=20_000)
    lab.wait_for_timeout(1000)
    lab.answered = lab.evaluate(ANSWERED, POINTS)
    driver.show_notebook_alone(lab)
    return lab


def figure(page, number):
    """A Stage, scrolled to."""
    stage = page.locator(".labkit-stage").nth(number)
    stage.scroll_into_view_if_needed()
    page.wait_for_timeout(400)
    return stage


def pixels(page, stage):
    """What is on the canvas, once nothing has changed there for 0.7 s."""
    before = None
    while (now := canvas_of(page, stage)) != before:
        before = now
        page.wait_for_timeout(700)
    return now


def canvas_of(page, stage):
    return page.evaluate("(node) => node.querySelector('canvas').toDataURL()", stage.element_handle())


def test_looking_and_saving_changes_no_byte(page, notebook):
    """The bytes were read after the first save, before anything ran; `driver.written` wrote what the build writes."""
    cells = [nbformat.v4.new_code_cell(code, id=f"cell-{number}") for number, code in enumerate(CELLS)]
    metadata = {"kernelspec": driver.build.KERNEL, "language_info": {"name": "python"}}
    written = driver.build.as_text(nbformat.v4.new_notebook(cells=cells, metadata=metadata))
    assert page.untouched.decode() == written


# -- every hand and every ear


def test_controls_are_native_and_have_names(page):
    tree = figure(page, GIMBAL).aria_snapshot()
    for line in ('slider "A (deg)": "40"', 'slider "B (deg)": "30"', 'button "Reset"', 'button "Make it fail"'):
        assert line.split(": ")[0] in tree
    assert 'button "Play"' in figure(page, SWIRL).aria_snapshot()
    assert 'slider "time"' in figure(page, SWIRL).aria_snapshot()
    points = figure(page, POINTS).aria_snapshot()
    assert 'slider "point on the x axis of K0"' in points and 'slider "point on the x axis of K1"' in points


def test_a_slider_moves_by_keys_keeps_the_focus_and_says_its_value_with_its_unit(page):
    stage = figure(page, GIMBAL)
    slider, before = stage.get_by_role("slider", name="B (deg)"), pixels(page, stage)
    slider.focus()
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    assert driver.soon(page, lambda: slider.get_attribute("aria-valuetext") == "33 deg")
    assert pixels(page, stage) != before
    assert slider.evaluate("node => node === document.activeElement")
    stage.get_by_role("button", name="Reset").click()
    assert driver.soon(page, lambda: slider.input_value() == "120") and pixels(page, stage) == before


def test_play_moves_time_and_the_live_region_speaks_meanwhile(page):
    stage = figure(page, SWIRL)
    stage.evaluate("""(node) => { window.heard = []; new MutationObserver(() => window.heard.push(performance.now()))
        .observe(node.querySelector('.spoken'), {childList: true, characterData: true, subtree: true}); }""")
    stage.get_by_role("button", name="Play").click()
    page.wait_for_timeout(5000)
    stage.get_by_role("button", name="Pause").click()
    heard = page.evaluate("() => window.heard")
    assert len(heard) >= 2
    assert all(later - earlier > 1900 for earlier, later in zip(heard, heard[1:]))
    assert int(stage.get_by_role("slider", name="time").input_value()) > 10
    stage.get_by_role("button", name="Reset").click()


def test_keys_draw_as_a_mouse_does(page):
    """The surface of the basins is covered until one rubs: by pointer, or with the keyboard's cursor and its pen."""
    stage = figure(page, BASINS)
    before = pixels(page, stage)
    stage.locator("canvas:not(.space)").focus()
    page.keyboard.press("Enter")
    assert stage.locator(".cursor").is_visible()
    page.keyboard.press("Space")
    for _ in range(5):
        page.keyboard.press("Shift+ArrowRight")
    page.keyboard.press("Space")
    assert pixels(page, stage) != before
    page.keyboard.press("Escape")
    assert not stage.locator(".cursor").is_visible()
    stage.get_by_role("button", name="Reset").click()
    assert pixels(page, stage) == before


def test_an_answer_keeps_the_focus_in_its_place_and_brings_its_whole_figure_into_sight(page):
    """Right after the click that locked a prediction in."""
    assert page.answered == {"whole": True, "focus": True}
    told = page.locator("[data-labkit-live] details", has_text="What happened?")
    assert told.count() == 1 and not told.evaluate("node => node.open")
    assert "What happens" not in page.locator(".jp-Notebook:visible").inner_text()


def test_handles_that_lie_on_each_other_are_pulled_one_by_one(page):
    stage = figure(page, POINTS)
    before = {name: place(stage, name) for name in ("X0", "X1")}
    apart = [abs(a - b) for a, b in zip(before["X0"], before["X1"])]
    assert max(apart) > 20
    x, y = before["X0"]
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - 60, y - 60, steps=5)
    page.mouse.up()
    page.wait_for_timeout(500)
    assert driver.soon(page, lambda: place(stage, "X0")[1] < y - 40)
    assert abs(place(stage, "X1")[1] - before["X1"][1]) < 25
    stage.get_by_role("button", name="Reset").click()
    page.wait_for_timeout(400)


def place(stage, name):
    box = stage.locator(f"[data-handle={name}]").bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


# -- every place


@pytest.mark.parametrize(("width", "height"), [(1440, 900), (1280, 720), (853, 480), (900, 700), (360, 640)])
def test_a_figure_fits_what_one_sees_and_nothing_is_cut(page, width, height):
    """853 x 480 is a projector of 1280 x 720 at 150 %, 360 x 640 a phone."""
    page.set_viewport_size({"width": width, "height": height})
    try:
        for number in (GIMBAL, SWIRL, BASINS):
            stage = figure(page, number)
            must_fit = height > 450 and width > 400
            assert driver.soon(page, lambda stage=stage, fit=must_fit: is_whole(page, stage, fit)), number
    finally:
        page.set_viewport_size({"width": 1280, "height": 900})
        page.wait_for_timeout(400)


def is_whole(page, stage, must_fit):
    """Nothing stands out of the Stage, nor the Stage out of what one sees; the picture has a pixel for each of the
    screen's.
    """
    inner = stage.bounding_box()
    seen = page.locator(".jp-Notebook:visible .jp-WindowedPanel-outer").first.bounding_box()
    boxes = [part.bounding_box() for part in stage.locator("canvas, button, input, select, .caption").all()]
    inside = all(
        box["x"] >= inner["x"] - 1 and box["x"] + box["width"] <= inner["x"] + inner["width"] + 1 for box in boxes
    )
    sharp = abs(stage.locator("canvas:not(.space)").evaluate("node => node.width / node.clientWidth") - 1) < 0.02
    return inside and sharp and (not must_fit or inner["height"] <= seen["height"])


def test_printed_lines_wrap_between_words(page):
    printed = page.locator(".jp-RenderedText pre", has_text="a printed line")
    assert printed.evaluate("node => getComputedStyle(node).wordBreak") == "normal"


def test_enlarged_it_fills_the_window_and_escape_leads_back(page):
    stage = figure(page, GIMBAL)
    assert driver.soon(page, lambda: stage.locator("canvas:not(.space)").bounding_box()["width"] > 600)
    pixels(page, stage)  # it has come to rest in the window of this size, after the phone's of the test before
    small = stage.locator("canvas:not(.space)").bounding_box()
    stage.get_by_role("button", name="Enlarge").click()

    def size():
        box = stage.locator("canvas:not(.space)").bounding_box()
        return box["width"] * box["height"]

    assert driver.soon(page, lambda: size() > 1.2 * small["width"] * small["height"])
    assert tuple(stage.bounding_box().values()) == (0, 0, 1280, 900)
    for part in stage.locator("button, input, .caption").all():
        place = part.bounding_box()
        assert place["y"] + place["height"] <= 900 and place["x"] + place["width"] <= 1280
    page.keyboard.press("Escape")
    picture = stage.locator("canvas:not(.space)")
    assert driver.soon(page, lambda: picture.bounding_box()["width"] == pytest.approx(small["width"], abs=1))
    assert stage.get_by_role("button", name="Enlarge").is_visible()


# -- the next day


def test_a_restarted_kernel_is_said_within_three_seconds_and_the_handle_goes_back(page, notebook):
    stage = figure(page, POINTS)
    page.wait_for_timeout(2500)  # the last pictures are stored
    page.saved = driver.save(page, notebook)
    driver.with_kernel(page, "kernel => kernel.restart()")
    handle = stage.locator("[data-handle=Y0]")
    start = handle.bounding_box()
    x, y = start["x"] + start["width"] / 2, start["y"] + start["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 80, y + 40, steps=4)
    page.mouse.up()
    stage.locator(".gone", has_text="Run All makes the figure live again").wait_for(timeout=3000)
    assert list(handle.bounding_box().values()) == pytest.approx(list(start.values()), abs=2)


def test_a_notebook_opened_without_its_kernel_shows_what_was_there(page, address, notebook):
    """Not even a message in the console; `page.saved` is the file as it was saved before the kernel went."""
    driver.with_kernel(page, "kernel => kernel.shutdown()")
    page.goto("about:blank")
    page.complaints.clear()  # of the lost connection
    driver.open_notebook(page, address, notebook)
    stills = page.locator("[data-labkit-still] figure")
    assert stills.count() == 4 and page.locator(".labkit-stage").count() == 0
    for number in range(4):
        assert stills.nth(number).locator("img").evaluate("node => node.complete && node.naturalWidth > 400")
        assert MENDED in stills.nth(number).inner_text()
    words = page.locator(".jp-Notebook:visible").inner_text()
    assert "Your prediction: it does not move" in words and "invert: not yet" in words
    assert "Error displaying widget" not in words and not page.complaints


def test_the_file_and_its_export_hold_pictures_and_no_widget(page):
    stored = json.loads(page.saved)
    kinds = {kind for cell in stored["cells"] for output in cell["outputs"] for kind in output.get("data", {})}
    assert kinds == {"text/plain", "text/html"} and "widgets" not in stored["metadata"]
    from nbconvert import HTMLExporter

    exported, _ = HTMLExporter().from_notebook_node(nbformat.reads(page.saved.decode(), as_version=4))
    assert (
        exported.count("<figure style") == exported.count('src="data:image/png;base64,') == 4
        and exported.count(MENDED) == 4
    )
    assert "Error displaying widget" not in exported and "application/vnd.jupyter.widget" not in exported
