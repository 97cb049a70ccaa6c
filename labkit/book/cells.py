"""A chapter's solved notebook as HTML."""

import html
import re

from . import text
from .notebook import is_personal, stages_of

LOCKED = "locked in"


def as_html(notebook, predictions, figure):
    """The cells of a solved notebook, one after the other.

    Parameters
    ----------
    notebook : nbformat.NotebookNode
        Executed.
    predictions : dict
        {id: Prediction} of the chapter.
    figure : function(name, caption) -> str
        HTML of the Stage that `stages.name` gives.
    """
    stages = stages_of(notebook)
    shown = [cell for cell in notebook.cells if not is_personal(cell)]
    return "\n".join(_cell(cell, predictions, stages.get(cell.id), figure) for cell in shown)


def _cell(cell, predictions, stage, figure):
    if cell.cell_type == "markdown":
        return text.as_html(cell.source)
    outputs = "".join(_output(output, stage, figure) for output in cell.outputs)
    asked = re.match(r'\s*(?:guess = .*\n)?ex\.predict\("([^"]+)"', cell.source)
    if asked and asked[1] in predictions:
        return prediction(predictions[asked[1]], cell.id, _shown(cell, stage, figure))
    return f'<section class="cell" id="{cell.id}">{text.python(cell.source)}{outputs}</section>'


def _shown(cell, stage, figure):
    """What a prediction reveals besides its own words."""
    revealed = [o for o in cell.outputs if LOCKED not in o.get("data", {}).get("text/plain", "")[:80]]
    return "".join(_output(output, stage, figure) for output in revealed)


def prediction(item, place, revealed):
    """A question with its choices; the answer, its reason and the figure open on a click."""
    choices = "".join(
        f'<li><button type="button" data-right="{str(choice == item.answer).lower()}">{html.escape(str(choice))}'
        "</button></li>"
        for choice in item.choices
    )
    answer = str(item.answer) if item.choices else f"{item.answer} {item.unit}"
    return (
        f'<section class="prediction" id="{place}"><p class="question">{_marked(item.question)}</p>'
        f'<ul class="choices">{choices}</ul><details><summary>What happens</summary>'
        f'<p role="status"><strong>{html.escape(answer)}</strong></p>'
        f"<p>{_marked(item.why)}</p>{revealed}</details></section>"
    )


def _marked(words):
    """Escaped words with `code` set as code."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(words))


def _output(output, stage, figure):
    if output.output_type == "stream":
        return f'<pre class="printed" tabindex="0">{html.escape(output.text)}</pre>'
    data = output.get("data", {})
    plain = data.get("text/plain", "")
    if plain.startswith("[stage: ") and stage:
        return figure(stage, re.sub(r"^\[stage: .*?\] ?", "", plain))
    for kind, show in (
        ("text/html", _html),
        ("text/markdown", text.as_html),
        ("text/latex", lambda tex: text.as_html(tex.strip())),
        ("image/png", _picture),
        ("text/plain", lambda words: f'<pre class="printed" tabindex="0">{html.escape(words)}</pre>'),
    ):
        if kind in data:
            return show(data[kind])
    return ""


def _html(page):
    """HTML of an output; panels announce nothing in a book, and links to notebooks lead to pages."""
    page = text.linked(page.replace(' role="status"', "").replace(' target="_blank"', ""))
    return f'<div class="output" tabindex="0">{page}</div>'


def _picture(png):
    return f'<img alt="the figure of this cell" src="data:image/png;base64,{png.strip()}">'
