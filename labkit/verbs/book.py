"""`python lab.py book [NN ...] [--out FOLDER]`: the reading edition, a static site whose figures still move.

Text, code and outputs come from the solved notebooks as they are stored; chapters with outputs that are not stored are
executed. Every Stage is recorded, one processor each.
"""

import asyncio
import os
import shutil
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from time import monotonic

import nbformat

from ..book import figures, site
from ..book.notebook import lacks_outputs, stages_of
from ..documents import pages
from ..exercises import source
from ..places import IS_CHECKOUT, ROOT
from . import build
from .arguments import Parser, Refusal

SITE = "index.html"
HERE = Path(os.path.relpath(ROOT / "build" / "book")) if IS_CHECKOUT else Path("book")


def main(arguments=None):
    """Raises `Refusal`, or prints what was written."""
    options = _parser().parse_args(arguments)
    start, out = monotonic(), Path(options.out)
    paths = [source.find(chapter) for chapter in options.chapters] or source.sources()
    if not paths:
        raise Refusal("The book is made from the sources in solutions/, which this edition does not have.")
    _make_empty(out, figures.FOLDER)
    notebooks = {path.stem: _stored(path) for path in paths}
    names = {stem: list(stages_of(notebook).values()) for stem, notebook in notebooks.items()}
    with ProcessPoolExecutor(os.cpu_count() or 1) as workers:
        ledger = workers.submit(pages.entries)
        executed = {path.stem: workers.submit(_executed, notebooks[path.stem], path) for path in paths}
        films = {
            (stem, name): workers.submit(figures.record, stem, name, out) for stem in names for name in names[stem]
        }
        films = {key: _film(key, future) for key, future in films.items()}
        chapters = [
            site.Chapter(stem, executed[stem].result(), {name: films[stem, name] for name in names[stem]})
            for stem in notebooks
        ]
        site.write(chapters, ledger.result(), out)
    size = sum(file.stat().st_size for file in out.rglob("*") if file.is_file())
    print(
        f"{out / SITE}: {len(chapters)} chapters, {len(films)} figures, {size / 1e6:.1f} MB, "
        f"{monotonic() - start:.0f} s. It opens in any browser; any static host can publish the folder."
    )


def _parser():
    parser = Parser("book", description="Write the reading edition: a static site that needs no server.")
    parser.add_argument("chapters", nargs="*", metavar="NN", help="number or name of a chapter; all if none is given")
    parser.add_argument("--out", default=str(HERE), metavar="FOLDER", help=f"({HERE})")
    return parser


def _make_empty(out, films):
    """Take an older book away; a folder that holds anything else is refused."""
    if out.exists() and any(out.iterdir()) and not (out / films).is_dir():
        raise Refusal(f"{out} holds something that is no book. Name another folder with --out.")
    if out.exists():
        shutil.rmtree(out)
    (out / films).mkdir(parents=True)


def _film(key, future):
    try:
        return future.result()
    except Exception as error:
        raise Refusal(f"{key[0]}, figure {key[1]!r} could not be recorded: {error}") from error


def _stored(path):
    """The solved notebook of a source as it is stored."""
    stored = path.with_suffix(".ipynb")
    if not stored.exists() or build.stale([path], ROOT / "notebooks", ROOT / "solutions"):
        raise Refusal(f"The notebooks of {path.stem} are not as their source says: python lab.py build {path.stem[:2]}")
    return nbformat.read(stored, as_version=4)


def _executed(notebook, path):
    """The notebook with all its outputs: those that are not stored, as they differ from day to day, are made."""
    if lacks_outputs(notebook):
        asyncio.run(build.execute(notebook, path.stem, path.parent))
    return notebook
