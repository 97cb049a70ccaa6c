"""JupyterLab in a headless browser, for the browser test and for screenshots: start, open, run, look.

What has been learned the hard way: commands run before the kernel is idle open a dialog and never answer; promises of
commands are therefore not awaited; and every server gets settings and folders of its own.
"""

import atexit
import contextlib
import functools
import json
import os
import re
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from urllib.parse import urlsplit

from nbformat.v4 import new_code_cell, new_notebook

from labkit.exercises import source
from labkit.verbs import build

ROOT = source.ROOT
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge")
ELSEWHERE = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "C:/Program Files/Google/Chrome/Application/chrome.exe",
    "C:/Program Files (x86)/Microsoft/Edge/Application/msedge.exe",
)
SETTINGS = json.loads((ROOT / "jupyter" / "settings.json").read_text(encoding="utf-8"))
UNINSTALLED = ["--ServerApp.jpserver_extensions=labkit.server=True"]  # what an installation's etc/jupyter would say
FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"]
FLAGS += ["--disable-component-update", "--disable-sync"]


@contextlib.contextmanager
def notebook_copy(chapter, solved=False):
    """A chapter's notebook, blank or solved, as its source gives it: a copy below the checkout, named from its root."""
    path = source.find(chapter)
    notebook = build.solved_notebook(path) if solved else build.blank_notebook(path)
    with written(notebook, path.stem) as copy:
        yield copy


@contextlib.contextmanager
def notebook_of(*codes):
    """A notebook of a few code cells, below the checkout, named from its root."""
    cells = [new_code_cell(code, id=f"cell-{number}") for number, code in enumerate(codes)]
    metadata = {"kernelspec": build.KERNEL, "language_info": {"name": "python"}}
    with written(new_notebook(cells=cells, metadata=metadata), "cells") as copy:
        yield copy


@contextlib.contextmanager
def written(notebook, stem):
    (ROOT / "build").mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(dir=ROOT / "build", prefix="browser-") as folder:
        copy = Path(folder) / f"{stem}.ipynb"
        copy.write_text(build.as_text(notebook), encoding="utf-8", newline="\n")
        yield copy.relative_to(ROOT).as_posix()


def missing(reason):
    """Skip, with the reason; in CI there is no excuse."""
    import pytest

    (pytest.fail if os.environ.get("CI") else pytest.skip)(reason)


def find_browser():
    """The path of a Chromium, or None."""
    found = [shutil.which(name) for name in BROWSERS] + [path for path in ELSEWHERE if Path(path).exists()]
    return next(filter(None, found), None)


@contextlib.contextmanager
def server(words, settings=None, **environment):
    """The address (with token) of the JupyterLab that a command line starts; it ends with the block.

    Settings ({plugin: {name: value}}), workspaces and progress live in a temporary folder: nothing of the user is read
    or written.
    """
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as scratch:
        own = {"JUPYTER_CONFIG_DIR": "config", "JUPYTER_DATA_DIR": "data", "JUPYTER_RUNTIME_DIR": "runtime"}
        own |= {
            "JUPYTERLAB_WORKSPACES_DIR": "workspaces",
            "JUPYTERLAB_SETTINGS_DIR": "settings",
            "IPYTHONDIR": "ipython",
        }
        own |= {"LABKIT_PROGRESS": "progress.jsonl"}
        env = {**os.environ, **{key: str(Path(scratch) / name) for key, name in own.items()}, **environment}
        env.pop("LABKIT_STRICT", None)
        for plugin, values in (settings or {}).items():
            file = Path(scratch) / "settings" / (plugin.replace(":", "/") + ".jupyterlab-settings")
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(json.dumps(values), encoding="utf-8")
        log = Path(scratch) / "server.log"
        with log.open("wb") as file:
            process = subprocess.Popen(words, cwd=ROOT, env=env, stdout=file, stderr=subprocess.STDOUT)
        try:
            yield wait_for_address(process, log)
        finally:
            process.terminate()
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()


def wait_for_address(process, log, seconds=90):
    """The address JupyterLab prints."""
    for _ in range(10 * seconds):
        found = re.search(r"http://(localhost|127\.0\.0\.1):\d+/lab\S*\?token=\w+", log.read_text(errors="replace"))
        if found:
            return found[0]
        if process.poll() is not None:
            break
        time.sleep(0.1)
    raise RuntimeError(f"JupyterLab did not start:\n{log.read_text(errors='replace')[-3000:]}")


@functools.cache
def browser_at(path):
    """The one browser of this process, begun when it is first asked for."""
    from playwright.sync_api import sync_playwright

    playwright = sync_playwright().start()
    browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
    atexit.register(playwright.stop)
    atexit.register(browser.close)  # before that
    return browser


@contextlib.contextmanager
def page_of(browser_path, dark=False, width=1280, height=900, scale=1, calm=False):
    """A page that shares nothing with others of the browser, `calm` for a reader who asks for reduced motion;
    `page.hosts` are the hosts it calls, `page.complaints` the errors in its console.
    """
    page = browser_at(browser_path).new_page(
        viewport={"width": width, "height": height},
        device_scale_factor=scale,
        color_scheme="dark" if dark else "light",
        reduced_motion="reduce" if calm else "no-preference",
    )
    page.hosts, page.complaints = set(), []
    page.on("request", lambda request: page.hosts.add(urlsplit(request.url).hostname))
    page.on("websocket", lambda socket: page.hosts.add(urlsplit(socket.url).hostname))
    page.on("console", lambda m: page.complaints.append(m.text) if m.type == "error" else None)
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    try:
        yield page
    finally:
        page.close()


def open_notebook(page, address, path):
    """Open the notebook `path` (below the server's folder) and wait until its kernel is idle."""
    page.goto(re.sub(r"/lab\S*\?", f"/lab/tree/{path}?", address) + "&reset")
    wait_until_idle(page)


def open_instead(page, path):
    """Open a notebook in place of the one in front, in which nothing was changed, and wait until its kernel is idle."""
    page.evaluate(
        """(path) => {
            const { commands, shell } = window.jupyterapp;
            shell.currentWidget.dispose();
            commands.execute("docmanager:open", { path });
        }""",
        path,
    )
    page.wait_for_function("(path) => window.jupyterapp.shell.currentWidget?.context?.path === path", arg=path)
    wait_until_idle(page)


def wait_until_idle(page, seconds=120):
    """Until the status bar says that the kernel is idle, for a second and a half."""
    page.wait_for_selector(".jp-Notebook:visible .jp-Cell", timeout=60_000)
    deadline, calm = time.monotonic() + seconds, 0
    while calm < 6:
        status = page.locator("#jp-bottom-panel, #jp-main-statusbar").first.inner_text(timeout=10_000)
        calm = calm + 1 if "| Idle" in status else 0
        if time.monotonic() > deadline:
            raise RuntimeError(f"the kernel did not become idle: {status!r}")
        page.wait_for_timeout(250)


RESTS = """async () => {
    const frame = () => new Promise(requestAnimationFrame);
    for (let still = 0; still < 3; ) { // what a picture changes around it is noticed in the frame after
        await frame();
        const stage = document.querySelector("#place .labkit-stage, body > .labkit-stage");
        const sharp = stage?.querySelector(".picture").dataset.rest !== "false"; // a scene in space, once it is still
        still = sharp && stage?.dataset.rest === "true" ? still + 1 : 0;
    }
}"""


def soon(page, check, seconds=15):
    """Wait until `check()` holds, however busy the machine is; whether it came to hold."""
    for _ in range(10 * seconds):
        if check():
            return True
        page.wait_for_timeout(100)
    return False


def run_all(page, seconds=120):
    """Run all cells and wait for the last one."""
    page.evaluate("() => { window.jupyterapp.commands.execute('notebook:run-all-cells'); }")
    page.wait_for_function(
        """() => [...document.querySelectorAll('.jp-Notebook:not(.lm-mod-hidden) .jp-CodeCell .jp-InputPrompt')]
                 .every(prompt => /\\[\\d+\\]/.test(prompt.textContent))""",
        timeout=1000 * seconds,
    )
    wait_until_idle(page, seconds)


def cell_with(page, code):
    """The code cell whose source holds `code`."""
    return page.locator(".jp-Notebook:visible .jp-CodeCell", has=page.locator(".jp-InputArea", has_text=code)).first


def retype(page, cell, code):
    """Type other code into a cell, as by hand, and run it."""
    cell.locator(".cm-content").click()
    page.keyboard.press("ControlOrMeta+a")
    page.keyboard.insert_text(code)
    page.keyboard.press("ControlOrMeta+Enter")
    page.wait_for_timeout(300)
    wait_until_idle(page)


def save(page, path):
    """Save the notebook; the bytes of its file."""
    before = (ROOT / path).stat().st_mtime_ns
    page.evaluate("() => { window.jupyterapp.commands.execute('docmanager:save'); }")
    deadline = time.monotonic() + 20
    while (ROOT / path).stat().st_mtime_ns == before:
        if time.monotonic() > deadline:
            raise RuntimeError("the notebook was not saved")
        page.wait_for_timeout(50)
    page.wait_for_timeout(200)
    return (ROOT / path).read_bytes()


def with_kernel(page, action):
    """Await `action(kernel)`, JavaScript, for the kernel of the notebook in front."""
    page.evaluate(
        f"async () => {{ const kernel = window.jupyterapp.shell.currentWidget.sessionContext.session.kernel; "
        f"await ({action})(kernel); }}"
    )


def set_theme(page, dark):
    """JupyterLab's own theme."""
    name = "JupyterLab Dark" if dark else "JupyterLab Light"
    page.evaluate("(theme) => { window.jupyterapp.commands.execute('apputils:change-theme', { theme }); }", name)
    page.wait_for_function(f"document.body.dataset.jpThemeName === '{name}'", timeout=20_000)
    page.wait_for_timeout(1000)


def show_notebook_alone(page):
    """Fold the side bars away, so that the notebook has the window's width."""
    for command in ("collapseLeft", "collapseRight"):
        page.evaluate(f"() => window.jupyterapp.shell.{command}()")
    page.wait_for_timeout(500)


def save_pictures(page, stem, page_height):
    """Save the whole notebook page by page, and each Stage; returns the files. Needs `windowingMode` "none"."""
    scroller = "document.querySelector('.jp-Notebook:not(.lm-mod-hidden) .jp-WindowedPanel-outer')"
    height = page.evaluate(f"() => {scroller}.scrollHeight")
    page.set_viewport_size({"width": page.viewport_size["width"], "height": height + 200})
    page.wait_for_timeout(1000)
    page.evaluate(f"() => {scroller}.scrollTo(0, 0)")
    page.wait_for_timeout(1000)
    area = page.locator(".jp-Notebook:visible").first.bounding_box()
    files = []
    for number, top in enumerate(range(0, height, page_height), start=1):
        clip = {**area, "y": area["y"] + top, "height": min(page_height, height - top)}
        files.append(f"{stem}-page{number}.png")
        page.screenshot(path=files[-1], clip=clip)
    for number, stage in enumerate(page.locator(".labkit-stage").all(), start=1):
        files.append(f"{stem}-stage{number}.png")
        stage.screenshot(path=files[-1])
    return files
