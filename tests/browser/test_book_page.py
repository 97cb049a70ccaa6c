"""The reading edition, opened from its folder: no server, no other host; figures scrubbed by mouse, finger and keys."""

import driver
import nbformat
import pytest
from test_space_in_lab import CONTEXTS, apart, at_rest
from test_space_in_lab import PIXELS as SPACE_PIXELS

from labkit.book import figures, notebook, site
from labkit.exercises import source
from labkit.stage import film

STEM = "07_dead_reckoning"
SHORTER = {"AROUND": 12, "ALONG": 9, "PLAYED": 40, "FAILED": 4, "SPARSER": 1}  # films, so that the test is quick
PIXELS = """canvas => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return data.reduce((sum, value, k) => (sum * 31 + value * (k % 97)) % 1e9, 7);
}"""


@pytest.fixture(scope="module")
def book(tmp_path_factory):
    """One chapter as a book."""
    if not driver.find_browser():
        driver.missing("no Chromium on this machine: the browser test needs one")
    folder = tmp_path_factory.mktemp("book")
    (folder / figures.FOLDER).mkdir()
    solved = nbformat.read(source.find(STEM).with_suffix(".ipynb"), as_version=4)
    with pytest.MonkeyPatch.context() as patch:
        for name, value in SHORTER.items():
            patch.setattr(film, name, value)
        made = {name: figures.record(STEM, name, folder) for name in notebook.stages_of(solved).values()}
        scene = figures.record("03_quirlen", "pose_designer", folder)
    site.write([site.Chapter(STEM, solved, made)], [], folder)
    (folder / "scene.html").write_text(site.page("A scene", figures.as_html(scene), [], ""), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def page(book):
    with driver.page_of(driver.find_browser(), width=360, height=740) as page:
        page.goto((book / f"{STEM}.html").as_uri())
        yield page


def figure(page, name):
    """A figure in its opened prediction, once its film runs."""
    found = page.locator(f'figure[data-film="{STEM}-{name}"]')
    found.evaluate("node => { const closed = node.closest('details'); if (closed) closed.open = true; }")
    found.scroll_into_view_if_needed()
    found.locator(".labkit-stage[data-picture]").wait_for(timeout=20_000)
    return found


def shown(found):
    """(a number that stands for the pixels, the caption) of a figure once nothing new has come for a while."""
    stage, before = found.locator(".labkit-stage"), None
    while (now := stage.get_attribute("data-picture")) != before:
        before = now
        found.page.wait_for_timeout(150)
    return found.locator("canvas:not(.space)").evaluate(PIXELS), found.locator(".caption").inner_text()


def after(found, act):
    """What is `shown` once `act()` has been answered, however busy the machine is."""
    stage = found.locator(".labkit-stage")
    before = stage.get_attribute("data-picture")
    act()
    assert driver.soon(found.page, lambda: stage.get_attribute("data-picture") != before)
    return shown(found)


def test_an_answer_opens_the_figure(page):
    question = page.locator("#predict-method")
    assert not question.locator("figure").is_visible()
    question.get_by_role("button", name="none of them").click()
    assert question.locator("figure").is_visible()
    assert question.locator("summary").inner_text() == "That is what happens"


def test_letters_are_as_large_as_they_were_laid_out_for_a_phone_and_a_wide_window_has_the_wide_film(page):
    seen = "node => [node.clientWidth, node.width]"
    found = figure(page, "circles")
    shown, recorded = found.locator("canvas:not(.space)").evaluate(seen)
    assert shown / (recorded / film.RATIO) > 0.9 and recorded <= film.PHONE * film.RATIO
    page.set_viewport_size({"width": 740, "height": 360})
    assert driver.soon(page, lambda: figure(page, "circles").locator("canvas:not(.space)").evaluate(seen)[1] > recorded)
    assert found.locator(".labkit-stage").count() == 1 and found.locator("polyline").count() == 1
    page.set_viewport_size({"width": 360, "height": 740})
    assert driver.soon(
        page, lambda: figure(page, "circles").locator("canvas:not(.space)").evaluate(seen)[1] == recorded
    )


def test_a_handle_follows_the_finger_along_its_line_and_the_arrow_keys(page):
    found = figure(page, "circles")
    start, handle = shown(found), found.locator(".handle")
    line = found.locator("polyline").get_attribute("points").split(",")
    area = found.locator(".picture").bounding_box()
    x, y = (float(word) for word in line[len(line) // 2].split())
    box = handle.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    dragged = after(
        found, lambda: page.mouse.move(area["x"] + x * area["width"], area["y"] + y * area["height"], steps=4)
    )
    page.mouse.up()
    assert dragged[0] != start[0] and dragged[1] != start[1]
    box = handle.bounding_box()
    assert abs(box["x"] + box["width"] / 2 - area["x"] - x * area["width"]) < 4
    handle.focus()
    stepped = set()
    for key in ("ArrowUp", "ArrowLeft", "ArrowDown", "ArrowRight"):
        stepped.add(after(found, lambda key=key: page.keyboard.press(key))[0])
    assert len(stepped - {dragged[0]}) >= 1
    assert after(found, found.get_by_role("button", name="Reset").click) == start


def test_a_slider_scrubs_and_a_failure_is_shown(page):
    found = figure(page, "models")
    slider, seen = found.locator(".controls input[type=range]"), set()
    slider.focus()
    for _ in range(4):
        seen.add(after(found, lambda: page.keyboard.press("ArrowRight")))
    assert len(seen) == 4
    assert after(found, found.get_by_role("button", name="Make it fail").click) not in seen


def test_time_runs_can_be_scrubbed_backward_and_follows_the_theme(page):
    found = figure(page, "drive")
    time = found.get_by_role("slider", name="time", exact=True)
    late = after(found, lambda: time.fill("30"))
    assert after(found, lambda: time.fill("8")) != late
    assert after(found, lambda: time.fill("30")) == late
    found.get_by_role("button", name="Play").click()
    assert driver.soon(page, lambda: int(time.input_value()) > 30)
    found.get_by_role("button", name="Pause").click()
    before = shown(found)[0]
    assert after(found, page.locator("button.theme").click)[0] != before
    page.locator("button.theme").click()


def scene_of(page):
    """(the figure, its picture in space once it stays)."""
    found = page.locator("figure.stage")
    found.locator("canvas[data-space=true]").wait_for(timeout=20_000)
    return found, at_rest(page, 0)[1]


def test_a_scene_turns_and_its_handle_follows_where_one_looks_from(page, book):
    page.add_init_script(f"({CONTEXTS})()")
    page.goto((book / "scene.html").as_uri())
    found, (covered, colors, before) = scene_of(page)
    assert covered > 0.05 and colors > 100
    handle, home = found.locator(".handle"), found.locator(".handle").bounding_box()
    found.locator("canvas:not(.space)").focus()
    for _ in range(6):
        page.keyboard.press("ArrowRight")
    _, (_, _, turned) = scene_of(page)
    hint, picture = found.locator(".hint").bounding_box(), found.locator(".picture").bounding_box()
    assert hint["y"] >= picture["y"] + picture["height"]
    there = handle.bounding_box()
    assert apart(turned, before) > 0.5 and abs(there["x"] - home["x"]) + abs(there["y"] - home["y"]) > 8
    caption = found.locator(".caption").inner_text()
    page.mouse.move(there["x"] + 16, there["y"] + 16)
    page.mouse.down()
    page.mouse.move(there["x"] + 16, there["y"] + 16 + picture["height"] / 5, steps=4)  # into its loop
    page.mouse.up()
    _, (_, _, dragged) = scene_of(page)
    assert apart(dragged, turned) > 0.05 and found.locator(".caption").inner_text() != caption
    found.get_by_role("button", name="Make it fail").click()
    failed = scene_of(page)[1][2]
    assert apart(failed, dragged) > 0.1
    after(
        found,
        lambda: page.evaluate("() => (window.loss = contexts[0].getExtension('WEBGL_lose_context')).loseContext()"),
    )
    kept = found.locator(".labkit-stage").evaluate(SPACE_PIXELS)[2]
    assert apart(kept, failed) < 0.1 and found.locator("canvas.space").is_visible()
    after(found, lambda: page.evaluate("() => loss.restoreContext()"))
    found.get_by_role("button", name="Reset").click()
    assert apart(scene_of(page)[1][2], before) < 0.1


def test_nothing_is_wider_than_a_phone_and_no_other_host_is_called(page, book):
    for name in (f"{STEM}.html", "index.html", "figures.html", "ledger.html", "scene.html"):
        page.goto((book / name).as_uri())
        page.wait_for_timeout(200)
        assert page.evaluate("document.documentElement.scrollWidth") <= 360, name
    assert page.hosts == {None} and page.complaints == []


def test_without_webgl_a_scene_stays_a_picture_that_says_why(page, book):
    page.add_init_script(
        "HTMLCanvasElement.prototype.getContext = ((get) => function (kind, ...more) {"
        "return kind === 'webgl2' ? null : get.call(this, kind, ...more); })"
        "(HTMLCanvasElement.prototype.getContext)"
    )
    page.goto((book / "scene.html").as_uri())
    found = page.locator("figure.stage")
    found.get_by_text("no WebGL 2").wait_for(timeout=10_000)
    assert found.locator("img").is_visible() and not found.locator(".labkit-stage").count()


def test_paper_is_light_and_has_the_pictures_where_the_screen_is_dark(page, book):
    colors = """() => ["pre.code", "body"].flatMap((name) => {
        const { color, backgroundColor } = getComputedStyle(document.querySelector(name));
        return [color, backgroundColor].map((words) => words.match(/\\d+/g).map(Number));
    })"""
    dark = page.context.browser.new_page(color_scheme="dark")
    dark.goto((book / f"{STEM}.html").as_uri())
    moving = figure(dark, "circles")
    assert dark.evaluate(colors)[3][0] < 30
    dark.emulate_media(media="print")
    ink, wash, words, paper = dark.evaluate(colors)
    assert max(ink[:3] + words[:3]) < 60 and min(wash[:3] + paper[:3]) > 230
    assert moving.locator("> img").is_visible() and not moving.locator(".labkit-stage").is_visible()
    assert moving.locator(".still").is_visible()
    dark.close()
