"""The lecturer's page in Chromium: every Stage by key, addresses, reload, votes of three phones."""

import contextlib
import os
import re
import subprocess
import sys

import driver
import pytest

FIRST = "01/three-points"
INSIDE = "() => document.querySelector('#place .labkit-stage').getBoundingClientRect().bottom <= innerHeight + 1"


@contextlib.contextmanager
def demo(*words):
    """(process, address with its token, address for phones) of `python -m labkit demo`."""
    words = [sys.executable, "-u", "-m", "labkit", "demo", "--no-browser", *words]
    given = {"cwd": driver.ROOT, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    with subprocess.Popen(words, env={**os.environ, "OMP_NUM_THREADS": "1"}, **given) as process:
        try:
            said = process.stdout.readline() + process.stdout.readline()
            said += process.stdout.readline() if "--vote" in words else ""
            found = re.findall(r"http://\S+", said)
            assert found, said
            yield process, found[0], found[-1]
        finally:
            process.terminate()
            process.wait(20)


@pytest.fixture(scope="module")
def browser_path():
    if not driver.find_browser():
        driver.missing("no Chromium on this machine: the browser test needs one")
    return driver.find_browser()


@pytest.fixture(scope="module")
def wall(browser_path):
    with demo("--vote") as (process, address, phones), driver.page_of(browser_path, width=1280, height=720) as page:
        page.phones, page.process = phones, process
        page.goto(address)
        page.wait_for_selector("#place .labkit-stage[data-picture]", state="attached")
        yield page
        assert page.hosts == {"127.0.0.1"}


def show(page, key):
    """Go to a card by its address, up to its figure; the number of its picture."""
    page.evaluate("(key) => { location.hash = key; }", key)
    page.wait_for_function("(key) => wall.card.key === key && wall.now?.key === key", arg=key)
    page.wait_for_selector("#place .labkit-stage[data-picture]", state="attached")
    if page.evaluate("() => wall.step") == "question":
        page.keyboard.press("a")
    page.wait_for_function("() => document.querySelector('#cover').hidden")


def rest(page):
    """Wait until the figure is drawn and nothing is on its way; its pixels."""
    page.evaluate(driver.RESTS)
    return page.evaluate(
        """() => {
            const root = document.querySelector("#place .labkit-stage");
            return root.querySelector("canvas").toDataURL().length + ":" + root.querySelector(".caption").textContent;
        }"""
    )


def moved(page, press):
    """Whether the picture changes after `press()`, however busy the machine is."""
    before = page.get_attribute("#place .labkit-stage", "data-picture")
    press()
    changed = "(before) => document.querySelector('#place .labkit-stage').dataset.picture !== before"
    page.wait_for_function(changed, arg=before, timeout=15_000)


def turned(page):
    """A scene in space is turned by the page alone: it looks different."""
    before = page.locator("#place .picture").screenshot()
    for _ in range(40):
        page.keyboard.press("ArrowRight")
        page.wait_for_timeout(100)
        if page.locator("#place .picture").screenshot() != before:
            return
    raise AssertionError("the arrow keys do not turn the view")


# one a chapter, of every kind: points, turned views, a list, play, keys, a brush; `tests/bench/demo_sweep.py` opens all
KINDS = ("00/quarter-turns", "01/triangle-noise", "02/growth", "03/swirl", "04/basins", "05/thirty-one-poses",
         "06/methods", "07/drive", "08/bells", "09/arena", "11/motions-beside-each-other")  # fmt: skip


@pytest.mark.parametrize("key", KINDS)
def test_a_stage_fails_resets_plays_and_is_moved_by_key(wall, key):
    show(wall, key)
    moved(wall, lambda: wall.keyboard.press("f"))
    moved(wall, lambda: wall.keyboard.press("r"))
    if wall.locator("#place .play").count():
        moved(wall, lambda: wall.keyboard.press("p"))
        wall.keyboard.press("p")
    if wall.locator("#place .picture canvas").count() > 1:
        turned(wall)
    else:
        moved(wall, lambda: wall.keyboard.press("ArrowRight"))
    wall.wait_for_function(INSIDE)
    assert wall.locator("#place .status").inner_text() == ""


def test_a_stage_is_where_it_was_left_and_all_go_back_by_one_key(wall):
    show(wall, FIRST)
    wall.keyboard.press("r")
    start = rest(wall)
    wall.keyboard.press("f")
    failed = rest(wall)
    assert failed != start
    wall.keyboard.press("PageDown")
    wall.wait_for_function("() => wall.card.key === '01/triangle-noise'")
    wall.keyboard.press("PageUp")
    show(wall, FIRST)
    assert rest(wall) == failed
    wall.reload()
    wall.wait_for_selector("#place .labkit-stage[data-picture]", state="attached")
    assert wall.evaluate("() => [wall.card.key, location.hash]") == [FIRST, f"#{FIRST}"]
    assert rest(wall) == failed
    moved(wall, lambda: wall.keyboard.press("Shift+R"))
    wall.wait_for_function("() => wall.step === 'question'")
    assert rest(wall) == start


def test_question_first_then_the_figure_then_what_happened(wall):
    show(wall, "05/scan-line")
    wall.keyboard.press("Shift+R")
    wall.wait_for_function("() => wall.step === 'question'")
    assert "least about how far away" in wall.locator("#cover .question").inner_text()
    assert not wall.locator("#cover .happened").is_visible()
    wall.keyboard.press("Enter")
    wall.wait_for_selector("#cover", state="hidden")
    assert not wall.locator("#bar .happened").is_visible()
    wall.keyboard.press("Enter")
    wall.wait_for_selector("#bar.answered")
    assert "There the circle is largest" in wall.locator("#bar .happened").inner_text()
    assert wall.locator("#bar .right").inner_text().endswith("through the center")


def test_enter_reveals_where_the_figure_would_take_it(wall):
    show(wall, "09/arena")
    wall.keyboard.press("r")
    rest(wall)
    wall.locator("#place canvas").focus()
    wall.keyboard.press("Enter")
    wall.wait_for_selector("#bar.answered")
    assert not wall.locator("#place .cursor").is_visible()
    wall.keyboard.press("Enter")
    wall.wait_for_selector("#place .cursor", state="visible")


PEN_UP = (*["Shift+ArrowUp"] * 3, " ")
BY_KEY = {  # to where it begins, and what is done there; the cursor stands in the middle at first
    "04/basins": (["Shift+ArrowLeft"] * 3, (" ", *PEN_UP), "% uncovered"),
    "05/thirty-one-poses": (["Enter", *["Shift+ArrowRight"] * 6, *["Shift+ArrowDown"] * 3], (" ",), "Pose 17"),
}


@pytest.mark.parametrize("key", BY_KEY)
def test_what_is_rubbed_or_clicked_is_reached_by_key(wall, key):
    way, deed, told = BY_KEY[key]
    revealed(wall, key)
    assert told not in rest(wall)
    for name in (*way, *deed):
        wall.keyboard.press(name)
    assert told in rest(wall)


def test_the_robot_is_carried_off_and_obstacles_are_drawn_by_key(wall):
    revealed(wall, "09/arena")
    seen = [rest(wall)]
    to_the_robot = ["Enter", *["Shift+ArrowLeft"] * 3, *["ArrowLeft"] * 2, *["Shift+ArrowDown"] * 3, *["ArrowDown"] * 3]
    for way in (to_the_robot, (" ", *PEN_UP), ["Shift+ArrowLeft"] * 3, (" ", *PEN_UP)):
        for name in way:
            wall.keyboard.press(name)
        seen.append(rest(wall))
    start, there, carried, elsewhere, drawn = seen
    assert there == start != carried == elsewhere != drawn


def revealed(page, key):
    """Show a card with all its answers, at its start, the keys in its empty space."""
    show(page, key)
    while page.evaluate("() => wall.next"):
        before = page.evaluate("() => wall.step")
        page.keyboard.press("a")
        page.wait_for_function("(before) => wall.step !== before", arg=before)
    page.keyboard.press("r")
    rest(page)
    page.locator("#place canvas[tabindex]").focus()


def test_digits_chapters_overview_theme_and_what_is_not_there(wall):
    show(wall, "05/scan-line")
    number = wall.evaluate("() => wall.chapter.findIndex((card) => card.key === '05/convergence') + 1")
    wall.keyboard.type(str(number))
    wall.wait_for_function("() => wall.card.key === '05/convergence'")
    wall.keyboard.press("Shift+PageDown")
    wall.wait_for_function("() => wall.card.key === '06/live-tracker'")
    wall.keyboard.type(str(wall.evaluate("() => wall.chapter.length + 1")))
    wall.wait_for_function("() => document.querySelector('#said').textContent.includes('has the numbers 1 to')")
    wall.evaluate("() => { location.hash = '05/none'; }")
    wall.wait_for_function("() => document.querySelector('#said').textContent.includes('There is no 05/none')")
    dark = wall.evaluate("() => getComputedStyle(document.body).backgroundColor")
    wall.keyboard.press("d")
    assert wall.evaluate("() => getComputedStyle(document.body).backgroundColor") != dark
    wall.keyboard.press("d")
    wall.keyboard.press("o")
    assert wall.locator("#overview .cards button").count() == wall.evaluate("() => wall.cards.length") >= 48
    wall.wait_for_function(
        "() => [...document.querySelectorAll('#overview img')].slice(30, 34).every((i) => i.naturalWidth)"
    )
    wall.keyboard.press("ArrowRight")
    wall.keyboard.press("Enter")
    wall.wait_for_function("() => wall.card.key === '06/tx40'")


def test_the_hint_on_keys_stands_in_the_head_of_the_page(wall):
    show(wall, "06/tx40")
    rest(wall)
    wall.keyboard.press("Tab")
    wall.locator("#place canvas[tabindex]").focus()
    hint = wall.locator("#aside .hint")
    assert "turn the view" in hint.inner_text()
    box, head = hint.bounding_box(), wall.locator("header").bounding_box()
    assert box["y"] >= head["y"] - 1 and box["y"] + box["height"] <= head["y"] + head["height"] + 1
    show(wall, FIRST)
    assert wall.locator("#aside .hint").count() == 1  # that of the other is gone


def test_three_phones_vote_in_two_rounds(wall):
    show(wall, "05/scan-line")
    wall.keyboard.press("Shift+R")
    wall.wait_for_function("() => wall.step === 'question'")
    browser = wall.context.browser
    phones = [browser.new_context(viewport={"width": 390, "height": 780}).new_page() for _ in range(3)]
    for phone in phones:
        phone.goto(wall.phones)
    for number, answers in ((1, (0, 1, 2)), (2, (0, 0, 2))):
        wall.keyboard.press("v")
        for phone, answer in zip(phones, answers):
            phone.wait_for_function("(n) => now.open && now.round === n", arg=number)
            phone.locator("#answers button").nth(answer).click()
            phone.wait_for_function("() => document.querySelector('#said').textContent.includes('Counted')")
        wall.wait_for_function("() => wall.now.ballot.counts.at(-1) === 3")
        assert wall.locator("#cover .bar.second").count() == 0
        assert wall.locator("#cover .bar.first").count() == (3 if number == 2 else 0)
        wall.keyboard.press("v")
        wall.wait_for_function("() => !wall.now.ballot.open")
        assert not phones[0].locator("#answers button").first.is_enabled() or phones[0].wait_for_function(
            "() => !now.open"
        )
    shares = [row.inner_text() for row in wall.locator("#cover .bar").all()]
    assert shares[:2] == ["33 % (1)", "67 % (2) second round"]
    with wall.expect_download() as saved:
        wall.keyboard.press("s")
    assert "05/scan-line" in saved.value.path().read_text(encoding="utf-8")
    for phone in phones:
        phone.context.close()


def test_a_number_is_typed_on_a_phone_and_nothing_is_wider_than_it(wall):
    wall.evaluate("() => { location.hash = '06/turning'; }")
    wall.wait_for_function("() => wall.now?.key === '06/turning'")
    phone = wall.context.browser.new_context(viewport={"width": 390, "height": 780}).new_page()
    phone.goto(wall.phones)
    wall.keyboard.press("v")
    phone.wait_for_function("() => now.open && now.key === '06/turning'")
    assert phone.inner_text("#said") == "Type a number."
    assert phone.evaluate("document.querySelector('#answers input').getBoundingClientRect().right") <= 390
    phone.locator("#answers input").fill("1,1")
    phone.keyboard.press("Enter")
    wall.wait_for_function("() => wall.now.ballot.counts.at(-1) === 1")
    wall.keyboard.press("v")
    wall.wait_for_function("() => !wall.now.ballot.open")
    phone.context.close()


def test_the_notes_follow_in_a_second_window(wall):
    show(wall, "05/scan-line")
    with wall.expect_popup() as opened:
        wall.keyboard.press("n")
    notes = opened.value
    notes.wait_for_function("() => document.body.innerText.includes('05/scan-line')")
    show(wall, "05/convergence")
    notes.wait_for_function("() => document.querySelector('h1').innerText.includes('05/convergence')")
    notes.close()


def test_a_line_cut_by_sleep_comes_back_and_all_is_where_it_was(wall):
    show(wall, FIRST)
    wall.keyboard.press("f")
    failed = rest(wall)
    wall.evaluate(
        """() => new Promise((told) => { // seen from within: the line is back within a second
            const said = document.querySelector("#said");
            const seen = () => { if (said.textContent.includes("The line to Python is cut")) told(); };
            new MutationObserver(seen).observe(said, { childList: true, characterData: true, subtree: true });
            wall.wire.socket.close();
        })"""
    )
    wall.wait_for_function("() => wall.wire.socket.readyState === 1 && !document.querySelector('#said').textContent")
    show(wall, FIRST)
    assert rest(wall) == failed
    moved(wall, lambda: wall.keyboard.press("r"))


def test_a_play_that_slept_goes_on_where_it_was(wall):
    show(wall, "03/swirl")
    wall.keyboard.press("r")
    rest(wall)
    before, at, end = wall.evaluate(
        """async () => {
            const slider = document.querySelector("#place .time input"), play = document.querySelector("#place .play");
            const sleep = (ms) => new Promise((go) => setTimeout(go, ms));
            const until = async (done) => { for (let k = 0; k < 200 && !done(); k++) await sleep(50); };
            await until(() => { // it runs: a late answer to the reset would have stopped it
                if (play.textContent === "Play") play.click();
                return +slider.value > 0;
            });
            const real = performance.now.bind(performance), before = +slider.value;
            performance.now = () => real() + 3.6e6;
            await until(() => +slider.value !== before);
            play.click();
            delete performance.now;
            return [before, +slider.value, +slider.max];
        }"""
    )
    assert before < at < end


def test_a_browser_opened_again_finds_the_card(wall):
    show(wall, "05/convergence")
    context = wall.context.browser.new_context()
    page = context.new_page()
    page.goto(wall.url.partition("#")[0])  # as the terminal says it: without a card
    assert "token" in page.inner_text("body")  # what it did not see once, it does not open
    context.add_cookies(wall.context.cookies())
    page.reload()
    page.wait_for_function("() => window.wall?.card?.key === '05/convergence'")
    page.wait_for_selector("#place .labkit-stage[data-picture]", state="attached")
    context.close()


def test_a_page_whose_server_is_gone_says_so(wall):
    assert wall.complaints == []
    wall.process.terminate()
    wall.wait_for_function("() => document.querySelector('#said').textContent.includes('The line to Python is cut')")
    wall.complaints.clear()  # of the lines that are tried
