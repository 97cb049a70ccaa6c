"""Every Stage of every chapter in the demo: opened, made to fail, reset, played, moved by key; both themes, both sizes.

    python tests/bench/demo_sweep.py [--chapters NN ...] [--sizes 1280x720 ...] [--themes light dark] [--shots FOLDER]

Prints what is cut, what does not answer within ten seconds, and what the page complains of; the last line is the sum.
A size such as 1280x720@1.5 is that window with the browser's zoom at 150 %. With --shots a picture of each Stage,
failed, with its answer shown.
"""

import argparse
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "browser"), str(ROOT / "tests" / "bench")]

import driver
from demo_speed import SIZES, demo

SECONDS = 10
PLAIN = [f"{width}x{height}" for width, height in SIZES]
CUT = """() => {
    const stage = document.querySelector("#place .labkit-stage"), box = stage.getBoundingClientRect();
    const place = document.querySelector("#place");
    const words = document.querySelectorAll("#place :is(.caption, .row, .status), #bar :is(p, li)");
    const wide = [...words].filter((node) => node.offsetParent && node.scrollWidth > node.clientWidth + 1);
    return [box.bottom > innerHeight + 1 && "below the window by " + Math.round(box.bottom - innerHeight),
            place.scrollHeight > place.clientHeight + 1 && "scrolls by " + (place.scrollHeight - place.clientHeight),
            wide.length && "too wide: " + wide[0].className].filter(Boolean).join(", ");
}"""


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--chapters", nargs="*", default=[])
    parser.add_argument("--sizes", nargs="*", default=PLAIN)
    parser.add_argument("--themes", nargs="*", choices=("light", "dark"), default=("light", "dark"))
    parser.add_argument("--shots", type=Path)
    options = parser.parse_args()
    faults, opened = [], 0
    for size in options.sizes:
        for theme in options.themes:
            where = f"{size} {theme}"
            with (
                demo(*options.chapters) as (_, address, _, _),
                driver.page_of(driver.find_browser(), dark=theme == "dark", **window(size)) as page,
            ):
                page.goto(address)
                page.wait_for_function("() => window.wall?.now")
                for key in page.evaluate("() => wall.cards.filter((card) => card.stage).map((card) => card.key)"):
                    opened += 1
                    found = [f"{where} {key}: {fault}" for fault in visit(page, key)]
                    faults += found
                    print("\n".join(found), end="\n" if found else "", flush=True)
                    if options.shots:
                        picture(page, options.shots, f"{key.replace('/', '-')}-{size}-{theme}.png")
                faults += [f"{where}: {words}" for words in page.complaints]
                faults += [f"{where}: it calls {host}" for host in page.hosts - {"127.0.0.1"}]
    print(f"{opened} Stages opened, {len(faults)} faults")
    return 1 if faults else 0


def window(size):
    """What a size as 1280x720@1.5 is for the browser: with its zoom a window has fewer, larger pixels."""
    pixels, _, zoom = size.partition("@")
    zoom = float(zoom or 1)
    width, height = (round(int(number) / zoom) for number in pixels.split("x"))
    return {"width": width, "height": height, "scale": zoom}


def visit(page, key):
    """What is wrong with one Stage."""
    page.evaluate("(key) => { location.hash = key; }", key)
    page.wait_for_function("(key) => wall.card.key === key && wall.now?.key === key", arg=key)
    page.wait_for_selector("#place .labkit-stage[data-picture]", state="attached", timeout=60_000)
    if page.evaluate("() => wall.step") == "question":
        page.keyboard.press("a")
    page.wait_for_selector("#cover", state="hidden")
    faults = []
    keys = ["f", "r", "p", "ArrowRight"] if page.locator("#place .play").count() else ["f", "r", "ArrowRight"]
    if page.locator("#place .picture canvas").count() > 1:
        keys.remove("ArrowRight")  # the page alone turns a scene in space: no picture comes
    for pressed in keys:
        if not press(page, pressed):
            faults.append(f"no picture after {pressed}")
        if pressed == "p":
            page.keyboard.press("p")
        if pressed == "f":
            faults += [f"failed: {words}" for words in [cut(page)] if words]
    faults += [words for words in [cut(page)] if words]
    said = page.locator("#place .status").inner_text()
    return [*faults, *([f"it says: {said}"] if said else [])]


def press(page, key):
    """Whether a picture comes after a key."""
    before = page.get_attribute("#place .labkit-stage", "data-picture")
    page.keyboard.press(key)
    try:
        changed = "(before) => document.querySelector('#place .labkit-stage').dataset.picture !== before"
        page.wait_for_function(changed, arg=before, timeout=1000 * SECONDS)
    except Exception:
        return False
    return True


def cut(page):
    """What is cut for good: a caption of another length has its picture a moment later."""
    page.wait_for_timeout(450)
    for _ in range(10):
        words = page.evaluate(CUT)
        if not words:
            break
        page.wait_for_timeout(300)
    return words


def picture(page, folder, name):
    """The window with the Stage failed and the answer shown."""
    folder.mkdir(parents=True, exist_ok=True)
    press(page, "f")
    if page.evaluate("() => wall.step") == "figure":
        page.keyboard.press("a")
    cut(page)
    page.screenshot(path=folder / name)


if __name__ == "__main__":
    sys.exit(main())
