"""The Stages of the course as the book shows them: recorded, one file each, and a picture for where no script runs."""

import html
import json
from dataclasses import dataclass
from importlib import import_module

from ..stage import film

FOLDER = "films"
NARROW = "-narrow"  # of the film for a phone; book.js chooses


@dataclass(frozen=True)
class Figure:
    """One Stage of a chapter, recorded.

    key : "01_frames-three_points"; name : what the Stage is called; caption : the sentence under it at first;
    words : what of it was recorded, in one sentence; size : (width, height) of its picture in pixels;
    bytes : of the picture's file.
    """

    key: str
    name: str
    caption: str
    words: str
    size: tuple
    bytes: int


def record(stem, function, folder):
    """Record the Stage that `stages.function()` of a chapter gives, write its two films and its picture; a `Figure`."""
    stage = getattr(import_module(f"labkit.chapters.ch{stem}.stages"), function)()
    key, declared = f"{stem}-{function}", stage.declaration()
    still = stage.small_png()
    data = film.record(stage).as_data()
    caption = data["tracks"]["start"]["notes"][0]["caption"]
    for name, recorded in ((key, data), (f"{key}{NARROW}", film.record(stage, narrow=True).as_data())):
        (folder / FOLDER / f"{name}.js").write_text(
            f"labkitFilm({json.dumps(name)},{json.dumps(recorded, separators=(',', ':'))});\n", encoding="utf-8"
        )
    (folder / FOLDER / f"{key}.png").write_bytes(still)
    return Figure(key, stage.name, caption, recorded_words(data, declared), tuple(data["size"]), len(still))


def recorded_words(data, declared):
    """What was recorded of a Stage, and what its notebook has beyond that."""
    shown, tracks = data["declaration"], data["tracks"]
    parts = ["the ring along its dotted line"] * ("handle" in tracks) + ["the view"] * ("view" in tracks)
    parts += [f"“{control['label']}”" for control in shown["controls"].values()] + ["time"] * ("play" in tracks)
    more = len(declared["handles"]) - len(shown["handles"]), len(declared["controls"]) - len(shown["controls"])
    beyond = [f"{n} more {word}{'s' * (n > 1)}" for n, word in zip(more, ("point", "control")) if n]
    said = f"Recorded: {', '.join(parts)}." if parts else "Recorded: its buttons."
    said += " It turns freely." if "space" in data else ""
    if beyond:
        said += f" In the notebook {' and '.join(beyond)} move{'s' * (sum(more) == 1)}."
    return said


def as_html(figure):
    """A recorded Stage: its picture, which the page's script makes move."""
    width, height = figure.size
    return (
        f'<figure class="stage" data-film="{figure.key}" aria-label="{html.escape(figure.name)}">'
        f'<img loading="lazy" alt="{html.escape(f"{figure.name}: {figure.caption}")}" '
        f'width="{width}" height="{height}" src="{FOLDER}/{figure.key}.png">'
        f'<figcaption><span class="still">{html.escape(figure.caption)}</span> '
        f"<small>{html.escape(figure.words)}</small></figcaption></figure>"
    )
