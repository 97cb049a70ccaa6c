"""Screenshots of a chapter: `python tests/browser/screenshots.py 01 OUT [--dark] [--solved] [--no-run]`.

Opens the notebook as built from this checkout's source, runs all, and saves the whole notebook as OUT/NN_name-....png,
cut into pages, and every Stage as a picture of its own. Needs a Chromium, and any Python that has the packages.
"""

import argparse
import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "browser")]

import driver  # noqa: E402

from labkit.verbs import jupyter  # noqa: E402

PAGE = 1600  # CSS pixels a picture


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("chapter", help="number or name")
    parser.add_argument("folder", type=Path, help="where the pictures go")
    parser.add_argument("--dark", action="store_true", help="JupyterLab's dark theme")
    parser.add_argument("--solved", action="store_true", help="the solved notebook instead of the blank one")
    parser.add_argument("--no-run", action="store_true", help="do not run the cells")
    parser.add_argument("--width", type=int, default=1280, help="of the window, in pixels")
    options = parser.parse_args(arguments)
    options.folder.mkdir(parents=True, exist_ok=True)
    with driver.notebook_copy(options.chapter, options.solved) as copy:
        take(copy, Path(copy).stem, options)
    return 0


def take(notebook, stem, options):
    words = jupyter.lab_command(
        sys.executable, ROOT, "notebooks/00_start_here.ipynb", "localhost", jupyter.choose_port("localhost"), True
    )
    words += [*driver.UNINSTALLED, "--LabApp.expose_app_in_browser=True", "--allow-root"]
    paths = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    name = f"{stem}-{'solved' if options.solved else 'blank'}-{'dark' if options.dark else 'light'}"
    with (
        driver.server(words, settings=driver.SETTINGS, PYTHONPATH=paths) as address,
        driver.page_of(driver.find_browser(), options.dark, options.width) as page,
    ):
        driver.open_notebook(page, address, notebook)
        driver.set_theme(page, options.dark)
        driver.show_notebook_alone(page)
        if not options.no_run:
            driver.run_all(page)
        print("\n".join(driver.save_pictures(page, options.folder / name, PAGE)))
        print("".join(f"console: {complaint}\n" for complaint in page.complaints), end="", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
