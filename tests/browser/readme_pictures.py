"""The pictures of the README: `python tests/browser/readme_pictures.py`, and `... --moving` for the one that moves.

A Stage being used, and an exercise that has just named a mistake, both in JupyterLab and from chapter 1; a Stage of
chapter 7 recorded, as the reading edition shows it. Written to docs/.
"""

import os
import sys
import tempfile
import zlib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "browser")]

import driver  # noqa: E402
import numpy as np  # noqa: E402
import test_jupyterlab  # noqa: E402
from PIL import Image  # noqa: E402

from labkit.chapters.ch07_dead_reckoning import stages  # noqa: E402
from labkit.stage import film  # noqa: E402
from labkit.verbs import jupyter  # noqa: E402


def main():
    words = jupyter.lab_command(
        sys.executable, ROOT, "notebooks/00_start_here.ipynb", "localhost", jupyter.choose_port("localhost"), True
    )
    words += [*driver.UNINSTALLED, "--LabApp.expose_app_in_browser=True", "--allow-root"]
    with tempfile.TemporaryDirectory() as folder, driver.notebook_copy("01") as copy:
        settings = {"PYTHONPATH": str(ROOT), "LABKIT_PROGRESS": str(Path(folder) / "progress.jsonl")}
        with (
            driver.server(words, settings=driver.SETTINGS, **settings) as address,
            driver.page_of(driver.find_browser(), False, 1000, 1400, scale=2) as page,
        ):
            driver.open_notebook(page, address, copy)
            driver.show_notebook_alone(page)
            driver.run_all(page)
            stage(page)
            feedback(page)


def stage(page):
    cell = driver.cell_with(page, '"edges"')
    cell.locator("button").first.click()
    handles = page.locator(".labkit-stage").first.locator(".handle")
    handles.first.wait_for(timeout=20_000)
    for name, keys in (("Y0", ["Shift+ArrowRight"] * 2), ("Y1", ["Shift+ArrowUp"] * 2)):
        found = [h for h in handles.all() if h.get_attribute("data-handle") == name]
        if not found:
            names = [h.get_attribute("data-handle") for h in handles.all()]
            raise SystemExit(f"expected a handle {name!r}, the Stage has {names}")
        found[0].focus()
        for key in keys:
            page.keyboard.press(key)
    page.wait_for_timeout(1500)
    page.locator(".labkit-stage").first.screenshot(path=ROOT / "docs" / "stage_three_points.png")


def feedback(page):
    cell = driver.cell_with(page, "def invert(T)")
    driver.retype(page, cell, test_jupyterlab.WRONG)
    cell.get_by_role("button", name="Hint").click()
    page.wait_for_timeout(800)
    cell.screenshot(path=ROOT / "docs" / "feedback.png")


def moving():
    """A drive that spreads, as an animated picture."""
    made = film.record(stages.drive())
    width, height = made.size
    change = np.frombuffer(zlib.decompress(made.tracks["play"].reel), np.uint8).reshape(-1, height, width)
    frames = []
    for picture in np.bitwise_xor.accumulate(change, axis=0):
        frames.append(Image.fromarray(made.palettes[0][picture]))
    times = [90] * (len(frames) - 1) + [2000]
    frames[0].save(
        ROOT / "docs" / "drive.webp", save_all=True, append_images=frames[1:], duration=times, loop=0, quality=70
    )


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    moving() if "--moving" in sys.argv else main()
