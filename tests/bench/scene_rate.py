"""Scenes in space in real JupyterLab, in headless Chromium: how fast they open, turn and follow, and what ten of them
cost.

    python tests/bench/scene_rate.py [--seconds 3] [--drags 60] [--stages 10]

A scene of 60 bodies (about 15,000 triangles) and 2,000 points is turned by the mouse: pictures per second, which the
page draws without the kernel. The TX40's flange is dragged: from the pointer's event to the picture drawn with what
Python computed. Opening: from running the cell to the first picture drawn in space, the first on the page (which loads
the drawing) and the next. Memory: what ten Stages add to the page's own heap and to the browser's renderer process.
P is the time of 1000 products of two 3x3 matrices, as in peers.py: others have the machine where it is large. What a
picture costs the processors, in ms of the page's process and of the one that draws, depends less on others.
"""

import argparse
import os
import statistics
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "browser")]

import driver

CROWD = """
import numpy as np
from labkit.stage import Slider, Stage, View, scene3d_solids as solids, style
from labkit.stage.scene3d import Scene
def scene(fig):
    space = Scene(fig.subplots(), radius=500, floor=-100, unit="mm")
    balls = [space.body(solids.sphere(30, 8)) for _ in range(34)]
    balls += [space.body(solids.cylinder(15, 0, 60), solids.sphere(6, 3)) for _ in range(26)]
    cloud = space.points(**style.look("measurement"))
    rng = np.random.default_rng(0)
    cloud.set(rng.uniform(-400, 400, (2000, 3)))
    places = rng.uniform(-350, 350, (60, 3))
    def update(state, result):
        for ball, place in zip(balls, places):
            T = np.eye(4)
            T[:3, 3] = place + (0, 0, state["up"])
            ball.set(T)
        space.draw(state["view"])
    return space.artists, update
Stage("crowd", scene=scene, compute=lambda state: None, fail={"up": 50.0},
      controls={"up": Slider(0.0, 100.0, 0.0)}, view=View(eye=3000))
"""
ARM = "from labkit.chapters.ch06_tracker import stages\nstages.tx40()"
OPENING = """(number) => new Promise(go => {
    const start = performance.now();
    const stage = () => document.querySelectorAll(".labkit-stage")[number];
    new MutationObserver((records, observer) => {
        const shown = records.some(({ attributeName }) => attributeName === "data-picture");
        if (shown) stage()?.scrollIntoView({block: "nearest"});
        if (!stage()?.querySelector(".picture[data-pictures]")) return;
        observer.disconnect();
        go(performance.now() - start);
    }).observe(document.body, {subtree: true, attributeFilter: ["data-picture", "data-pictures"]});
    window.jupyterapp.shell.currentWidget.content.activeCellIndex = number + 1;
    window.jupyterapp.commands.execute("notebook:run-cell");
})"""
WATCH = """(node) => {
    window.__sent = null; window.__late = []; let answered = 0;
    const picture = node.querySelector(".picture");
    window.addEventListener("pointermove", () => { window.__sent ??= performance.now(); }, true);
    const look = (place, name, then) =>
        new MutationObserver(then).observe(place, {attributes: true, attributeFilter: [name]});
    look(node, "data-picture", () => { answered = performance.now(); });
    look(picture, "data-pictures", () => {
        if (window.__sent === null || answered < window.__sent) return;
        window.__late.push(performance.now() - window.__sent); window.__sent = null;
    });
}"""


def products():
    a, b = np.random.default_rng(0).normal(size=(2, 3, 3))
    start = time.perf_counter()
    for _ in range(1000):
        a @ b
    return 1e3 * (time.perf_counter() - start)


def processes(kind):
    """The folders in /proc of this bench's own Chromium processes of a kind."""
    parents, found = {}, []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parents[int(folder.name)] = int((folder / "stat").read_text().rsplit(")", 1)[1].split()[1])
            if f"--type={kind}".encode() in (folder / "cmdline").read_bytes():
                found.append(folder)
        except OSError:
            pass

    def is_own(number):
        return number == os.getpid() or (number in parents and is_own(parents[number]))

    return [folder for folder in found if is_own(int(folder.name))]


def renderer_megabytes():
    """Resident memory of Chromium's renderer processes."""
    return sum(int((folder / "statm").read_text().split()[1]) * 4096 / 1e6 for folder in processes("renderer"))


def spent(kind):
    """Processor time of Chromium's processes of a kind so far (ms)."""
    times = [(folder / "stat").read_text().rsplit(")", 1)[1].split()[11:13] for folder in processes(kind)]
    return sum(int(t) for pair in times for t in pair) * 1e3 / os.sysconf("SC_CLK_TCK")


def heap_megabytes(page, session):
    session.send("HeapProfiler.collectGarbage")
    return session.send("Runtime.getHeapUsage")["usedSize"] / 1e6


def drag(page, box, seconds, at=(0.3, 0.2)):
    x, y = box["x"] + at[0] * box["width"], box["y"] + at[1] * box["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    start, k = time.perf_counter(), 0
    while time.perf_counter() - start < seconds:
        k += 1
        page.mouse.move(x + 80 * np.sin(k / 15), y + 25 * np.sin(k / 22))
        page.wait_for_timeout(6)
    page.mouse.up()
    return time.perf_counter() - start


def turning(page, stage, seconds):
    """Pictures per second while the mouse turns the view, and what each costs the processors, in words."""
    picture = stage.locator(".picture")
    count = lambda: int(picture.get_attribute("data-pictures"))  # noqa: E731
    drag(page, picture.bounding_box(), 1.0)
    before, costs = count(), [spent("renderer"), spent("gpu-process")]
    took = drag(page, picture.bounding_box(), seconds)
    pictures = count() - before
    costs = [(spent(kind) - cost) / pictures for kind, cost in zip(("renderer", "gpu-process"), costs)]
    return f"{pictures / took:.0f} pictures/s (each {costs[0]:.0f} + {costs[1]:.0f} ms of processors)"


def following(page, stage, drags):
    """Milliseconds from the pointer's event to the picture in space with what Python computed."""
    stage.evaluate(WATCH)
    box = stage.locator("[data-handle=flange]").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    for k in range(drags):
        page.mouse.move(x - 60 * np.sin(k / 9), y - 40 * np.sin(k / 13))
        page.wait_for_timeout(90)
    page.mouse.up()
    return page.evaluate("() => window.__late")[3:]


def server():
    words = [sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root", "--ServerApp.port=0"]
    words += ["--LabApp.expose_app_in_browser=True"]
    words += ["--ServerApp.kernel_websocket_connection_class=labkit.server.connection.PromptConnection"]
    return driver.server(words, PYTHONPATH=str(ROOT))


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--seconds", type=float, default=3.0)
    options.add_argument("--drags", type=int, default=60)
    options.add_argument("--stages", type=int, default=10, help="of the TX40")
    chosen = options.parse_args()
    print(f"P = {products():.2f} ms, load {os.getloadavg()[0]:.1f}")
    cells = ["from labkit.chapters.ch06_tracker import stages", CROWD.strip(), ARM, *[ARM] * (chosen.stages - 1)]
    with driver.notebook_of(*cells) as notebook, server() as address, driver.page_of(driver.find_browser()) as page:
        driver.open_notebook(page, address, notebook)
        session = page.context.new_cdp_session(page)
        page.locator(".jp-Notebook:visible .jp-CodeCell").first.click()
        page.keyboard.press("Shift+Enter")
        driver.wait_until_idle(page)
        before = heap_megabytes(page, session), renderer_megabytes()
        times = []
        for k in range(chosen.stages + 1):
            times.append(page.evaluate(OPENING, k))
            if k in (0, 1):
                stage = page.locator(".labkit-stage").nth(k)
                stage.scroll_into_view_if_needed()
                page.wait_for_timeout(1500)
                if k == 0:
                    print(f"triangles: {stage.locator('.picture').get_attribute('data-triangles')}")
                    print(f"turning 60 bodies and 2,000 points: {turning(page, stage, chosen.seconds)}")
                else:
                    print(f"turning the TX40: {turning(page, stage, chosen.seconds)}")
                    late = following(page, stage, chosen.drags)
                    median, most = statistics.median(late), np.percentile(late, 95)
                    print(f"flange to picture: median {median:.0f} ms, 95 % {most:.0f} ms ({len(late)} pictures)")
                    page.wait_for_timeout(1500)
                    first = heap_megabytes(page, session), renderer_megabytes()
        page.wait_for_timeout(2500)
        after = heap_megabytes(page, session), renderer_megabytes()
        more, each = chosen.stages - 1, statistics.median(times[1:])
        print(f"opening: the first {times[0]:.0f} ms, the next {each:.0f} ms (median of {chosen.stages})")
        print(f"page: two Stages add {first[0] - before[0]:.0f} MB of heap, {more} more {after[0] - first[0]:.0f} MB; "
              f"the renderer's process {first[1] - before[1]:.0f} and {after[1] - first[1]:.0f} MB")  # fmt: skip
        print(f"complaints in the console: {page.complaints or 'none'}; P = {products():.2f} ms")


if __name__ == "__main__":
    main()
