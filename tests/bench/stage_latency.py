"""Latency of every Stage in real JupyterLab: from key press or drag to the new picture, drawn, in headless Chromium.

    python tests/bench/stage_latency.py [--only NAME ...] [--events 40] [--shots DIR] [--chromium PATH]

Finds all functions in labkit.chapters.*.stages that return a Stage without arguments, puts those of a chapter into one
notebook, as a reader has them, starts JupyterLab with fresh settings on a free port, runs all cells, moves each Stage
(first handle by arrow keys and by mouse; the first slider, the view or the cursor in the picture by keys; clicks), and
prints in milliseconds, per Stage and way of moving it: median and 95th percentile of event to picture; medians of
message to answer in the page and of message to answer in the kernel; and without a browser, compute with update, and
drawing with encoding. P is the time of 1000 products of two 3x3 matrices at that moment, as in peers.py: where it is
well above the smallest of the run, others had the machine.
With --shots also a screenshot of each Stage in the light and the dark theme, wide and narrow.
"""

import argparse
import importlib
import importlib.util
import inspect
import itertools
import json
import os
import pkgutil
import secrets
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
FLAGS = [
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
]  # fmt: skip
TARGET_MS, MEDIAN_MS = 50.0, 30.0  # of the 95th percentile, and of the median
WARM_UP = 4

# the page notes when an event was sent and when the picture after it was drawn: everything between is the latency
WATCH = """(root) => {
    const stage = root.querySelector(".labkit-stage");
    window.__latencies = []; window.__sent = null;
    const note = () => { if (window.__sent === null) window.__sent = performance.now(); };
    for (const type of ["keydown", "pointermove", "pointerup"]) root.addEventListener(type, note, true);
    new MutationObserver(() => {
        if (window.__sent !== null) { window.__latencies.push([performance.now() - window.__sent,
            +stage.dataset.answer, +stage.dataset.python]); window.__sent = null;
        }
    }).observe(stage, {attributes: true, attributeFilter: ["data-picture"]});
}"""


def stages():
    """[(chapter, function name)] of all Stages."""
    sys.path.insert(0, str(ROOT))
    import labkit.chapters
    from labkit.stage import Stage

    found = []
    for info in pkgutil.iter_modules(labkit.chapters.__path__):
        if importlib.util.find_spec(f"labkit.chapters.{info.name}.stages") is None:
            continue
        module = importlib.import_module(f"labkit.chapters.{info.name}.stages")
        for name, function in vars(module).items():
            if (
                inspect.isfunction(function) and function.__module__.startswith(module.__package__)
                and not name.startswith(("_", "compute"))
                and all(p.default is not p.empty for p in inspect.signature(function).parameters.values())
                and isinstance(function(), Stage)
            ):  # fmt: skip
                found.append((info.name, name))
    return found


def python_part(module, name, repetitions=30):
    """Median milliseconds of (compute and update, picture and its encoding), without a browser."""
    stage = getattr(importlib.import_module(f"labkit.chapters.{module}.stages"), name)()
    stage._picture.fit(700, 1000, 1.0, False)
    times = []
    for _ in range(repetitions):
        start = time.perf_counter()
        stage.set()
        middle = time.perf_counter()
        stage._picture.news()
        times.append((middle - start, time.perf_counter() - middle))
    return 1e3 * np.median(times, axis=0)


def reference(repetitions=15):
    """P, milliseconds: median time of 1000 products of two 3x3 matrices."""
    A, times = np.eye(3), []
    for _ in range(repetitions):
        start = time.perf_counter()
        for _ in range(1000):
            A @ A
        times.append(time.perf_counter() - start)
    return 1e3 * np.median(times)


def notebook(chosen):
    cells = [
        {"cell_type": "code", "execution_count": None, "id": f"{module}-{name}".replace("_", "-")[:60], "metadata": {},
         "outputs": [], "source": f"from labkit.chapters.{module} import stages\nstages.{name}()"}
        for module, name in chosen
    ]  # fmt: skip
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}


class Lab:
    """JupyterLab on a free port with fresh settings, in a folder of its own."""

    def __init__(self, folder):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        token = secrets.token_hex(16)
        names = ("CONFIG_DIR", "DATA_DIR", "RUNTIME_DIR")
        env = {**os.environ, **{f"JUPYTER_{n}": str(folder / n.lower()) for n in names}, "PYTHONPATH": str(ROOT)}
        env["JUPYTERLAB_SETTINGS_DIR"] = str(folder / "settings")
        env["JUPYTERLAB_WORKSPACES_DIR"] = str(folder / "workspaces")
        notification = folder / "settings" / "@jupyterlab" / "apputils-extension"
        notification.mkdir(parents=True)
        (notification / "notification.jupyterlab-settings").write_text(
            '{"fetchNews": "false", "checkForUpdates": false}'
        )
        self.log = open(folder / "lab.log", "w")  # noqa: SIM115
        self.process = subprocess.Popen(
            [sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root", f"--port={port}", "--port-retries=0",
             f"--ServerApp.root_dir={folder}", f"--IdentityProvider.token={token}",
             "--LabApp.expose_app_in_browser=True",
             "--ServerApp.kernel_websocket_connection_class=labkit.server.connection.PromptConnection"],
            env=env, cwd=folder, stdout=self.log, stderr=self.log,
        )  # fmt: skip
        self.folder, self.server, self.token = folder, f"http://127.0.0.1:{port}", token
        for _ in range(150):
            try:
                urllib.request.urlopen(f"http://127.0.0.1:{port}/api?token={token}", timeout=1).read()
                return
            except OSError:
                time.sleep(0.2)
        raise RuntimeError(f"JupyterLab did not start: {(folder / 'lab.log').read_text()[-2000:]}")

    def opened(self, page, name, chosen):
        """Put Stages into a notebook of that name, open it alone, and run it."""
        (self.folder / f"{name}.ipynb").write_text(json.dumps(notebook(chosen)))
        run_all(page, f"{self.server}/lab/tree/{name}.ipynb?reset&token={self.token}", len(chosen))

    def close(self):
        self.process.terminate()
        self.process.wait(20)
        self.log.close()


def run_all(page, url, count):
    """Open the notebook, run all cells, wait until every Stage has its picture."""
    page.goto(url)
    page.wait_for_selector(".jp-Notebook .jp-Cell", timeout=60000)
    page.wait_for_function(
        "document.querySelector('#jp-main-statusbar')?.textContent.includes('| Idle')", timeout=60000
    )
    page.wait_for_timeout(1500)
    page.evaluate("() => { window.jupyterapp.commands.execute('notebook:run-all-cells'); }")
    for k in range(count):  # cells far below are rendered only when scrolled to
        page.evaluate(f"() => document.querySelectorAll('.jp-Notebook .jp-Cell')[{k}]?.scrollIntoView()")
        page.wait_for_timeout(200)
    page.wait_for_function(
        f"document.querySelectorAll('.labkit-stage[data-picture]').length >= {count}", timeout=120000
    )


def stage_of(page, k):
    output = page.locator(".jp-Notebook .jp-Cell").nth(k).locator(".jp-OutputArea")
    output.locator(".labkit-stage[data-picture]").wait_for(timeout=30000)
    output.scroll_into_view_if_needed()
    page.wait_for_timeout(400)
    return output


def latencies(page, output, events):
    """{way: milliseconds of each event} for one Stage."""
    output.evaluate(WATCH)
    handle, found = output.locator(".labkit-stage .handle").first, {}

    def collect(way, act):
        page.evaluate("() => { window.__latencies = []; window.__sent = null; }")
        for k in range(events + WARM_UP):
            act(k)
            page.wait_for_timeout(90)
        found[way] = page.evaluate("() => window.__latencies")[WARM_UP:]

    def arrow(k):
        page.keyboard.press(("ArrowLeft", "ArrowUp", "ArrowRight", "ArrowDown")[k % 4])

    if handle.count():
        handle.focus()
        collect("key", arrow)
        box = handle.bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(x, y)
        page.mouse.down()
        collect("drag", lambda k: page.mouse.move(x + 3 * (k % 5), y - 2 * (k % 7)))
        page.mouse.up()
    slider = output.locator(".labkit-stage .controls input[type=range]").first
    if slider.count():
        slider.focus()
        collect("slider", lambda k: page.keyboard.press(("ArrowLeft", "ArrowRight")[k % 2]))
    canvas = output.locator(".labkit-stage canvas[tabindex='0']").first
    if canvas.count():
        canvas.focus()
        collect("picture", arrow)
    canvas = output.locator(".labkit-stage canvas[data-click=true]").first
    if canvas.count():
        box = canvas.bounding_box()

        def click(k):
            page.mouse.move(box["x"] + box["width"] * (0.58 + 0.015 * (k % 20)), box["y"] + box["height"] * 0.6)
            page.evaluate("() => { window.__sent = null; }")
            page.mouse.down()
            page.mouse.up()

        collect("click", click)
    return found


def shoot(page, chosen, folder):
    """Screenshots of all Stages: light and dark, wide and narrow."""
    for theme in ("JupyterLab Light", "JupyterLab Dark"):
        page.evaluate(f"() => {{ window.jupyterapp.commands.execute('apputils:change-theme', {{theme: '{theme}'}}); }}")
        page.wait_for_timeout(1500)
        for width in (1280, 700):
            page.set_viewport_size({"width": width, "height": 1000})
            page.wait_for_timeout(800)
            for k, (module, name) in enumerate(chosen):
                output = stage_of(page, k)
                page.wait_for_timeout(300)
                output.screenshot(path=str(folder / f"{module}-{name}-{theme.split()[1].lower()}-{width}.png"))
    page.evaluate("() => { window.jupyterapp.commands.execute('apputils:change-theme', {theme: 'JupyterLab Light'}); }")
    page.set_viewport_size({"width": 1280, "height": 1000})
    page.wait_for_timeout(1500)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", default=[], help="names: module, Stage or module.Stage")
    parser.add_argument("--events", type=int, default=40)
    parser.add_argument("--shots", type=Path)
    parser.add_argument("--ratio", type=float, default=1.0, help="device pixels per CSS pixel")
    parser.add_argument("--chromium", default=shutil.which("chromium") or shutil.which("chromium-browser"))
    options = parser.parse_args()
    from playwright.sync_api import sync_playwright

    every = stages()
    unknown = [word for word in options.only if not any(word in (m, n, f"{m}.{n}") for m, n in every)]
    if unknown:
        parser.error(f"no module or Stage is named {', '.join(unknown)}")
    chosen = [(m, n) for m, n in every if not options.only or {m, n, f"{m}.{n}"} & set(options.only)]
    rows = []  # 95th percentile, P and median
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as play:
        lab = Lab(Path(folder))
        browser = play.chromium.launch(executable_path=options.chromium, args=FLAGS)
        print(
            f"{'Stage':44s} {'way':8s} {'n':>3s} {'median':>7s} {'95 %':>7s} {'answer':>7s} {'kernel':>7s}"
            f" {'compute':>7s} {'draw':>6s} {'P':>5s}"
        )
        try:
            for module, group in itertools.groupby(chosen, key=lambda pair: pair[0]):
                page = browser.new_page(viewport={"width": 1280, "height": 1000}, device_scale_factor=options.ratio)
                page.on("console", lambda m: print("console:", m.text) if m.type == "error" else None)
                page.on("pageerror", lambda error: print("page error:", error))
                rows += chapter(lab, page, module, list(group), options)
                page.close()
        finally:
            browser.close()
            lab.close()
    summary(rows)


def chapter(lab, page, module, chosen, options):
    """Print the rows of one chapter's notebook; its (95th percentile, P, median)."""
    lab.opened(page, module, chosen)
    if options.shots:
        options.shots.mkdir(parents=True, exist_ok=True)
        shoot(page, chosen, options.shots)
    rows = []
    for k, (_, name) in enumerate(chosen):
        apply, draw = python_part(module, name)
        before = reference()
        found = latencies(page, stage_of(page, k), options.events)
        P = max(before, reference())
        for way, ms in ((way, ms) for way, ms in found.items() if ms):
            median, answer, python = np.median(ms, axis=0)
            high = np.percentile(np.array(ms)[:, 0], 95)
            rows.append((high, P, median))
            print(
                f"{module + '.' + name:44s} {way:8s} {len(ms):3d} {median:7.1f} {high:7.1f}"
                f" {answer:7.1f} {python:7.1f}"
                f" {apply:7.1f} {draw:6.1f} {P:5.2f}",
                flush=True,
            )
    return rows


def summary(rows):
    limit = 1.25 * min(speed for _, speed, _ in rows)
    for what, goal, column in (("95th percentile", TARGET_MS, 0), ("median", MEDIAN_MS, 2)):
        slow = [row[1] for row in rows if not row[column] <= goal]
        calm = sum(speed <= limit for speed in slow)
        told = f"{len(slow)} of {len(rows)} rows above {goal:.0f} ms ({what})"
        print(f"{told}, {calm} of them at P <= {limit:.2f} ms")
    print(f"middle of the medians {np.median([row[2] for row in rows]):.1f} ms")


if __name__ == "__main__":
    main()
