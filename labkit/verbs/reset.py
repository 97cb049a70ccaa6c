"""`labkit reset NN ... [--predictions]`: fresh chapters; the copies one has written in are kept."""

from pathlib import Path

from ..exercises import progress
from ..exercises.engine import Prediction
from ..exercises.session import chapters
from ..places import IS_CHECKOUT, ROOT
from . import notebook_copies
from .arguments import COMMAND, Parser, Refusal


def main(arguments):
    """Put the beginning of each chapter back into its place, and say what was done."""
    parser = Parser("reset", description="A fresh chapter; your copy of it is kept beside it.")
    parser.add_argument("chapters", nargs="*", metavar="NN", help="number or name of a chapter")
    parser.add_argument("--predictions", action="store_true", help="ask its predictions again, and leave the notebook")
    options = parser.parse_args(arguments)
    if not options.chapters:
        raise Refusal(f"Which chapter? For example: {COMMAND} reset 01")
    found = [find(wanted) for wanted in options.chapters]
    print("\n".join(map(predictions if options.predictions else notebook, found)))


def find(wanted):
    """The chapter of a number ("1", "01") or a name ("01_frames", "01-frames").

    Raises
    ------
    Refusal
        When there is none, with those there are.
    """
    name = wanted.replace("_", "-")
    name = name.zfill(2) if name.isdecimal() else name
    known = {chapter.name: chapter for chapter in chapters()}
    for full, chapter in known.items():
        if name in (full, full[:2]):
            return chapter
    raise Refusal(f"expected the number or the name of a chapter, got {wanted!r}; there are: {', '.join(known)}")


def notebook(chapter):
    """Put its beginning back; returns what was done."""
    name, folder = f"{chapter.notebook}.ipynb", ROOT / "notebooks" if IS_CHECKOUT else Path.cwd()
    if not (IS_CHECKOUT or (folder / notebook_copies.GIVEN).exists()):
        raise Refusal(f"{folder} is no folder that holds your notebooks: call this in the one you named to start.")
    return notebook_copies.fresh_copy(
        folder / name, notebook_copies.blank_notebooks()[name], f"notebooks/{name}" if IS_CHECKOUT else name
    )


def predictions(chapter):
    """Forget what was predicted, so that it is asked again; returns what was done."""
    items = [item for item in chapter.items if isinstance(item, Prediction)]
    for item in items:
        progress.record(chapter.name, item.id, "reset")
    return f"chapter {chapter.name}: its {len(items)} predictions are asked again"
