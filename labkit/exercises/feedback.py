"""What appears beneath a cell: stable text, the same as HTML that follows JupyterLab's theme, a row of buttons."""

import html

import ipywidgets
from IPython.display import display

from .. import live
from .outcome import CORRECT, NOT_YET, RAISED, TO_DO

SIGNS = {TO_DO: "○", NOT_YET: "✗", CORRECT: "✓", RAISED: "!"}
COLORS = {
    TO_DO: "--jp-info-color1",
    NOT_YET: "--jp-warn-color1",
    CORRECT: "--jp-success-color1",
    RAISED: "--jp-error-color1",
}


class Panel:
    """Text for everyone: `text/plain` for nbval and terminals, HTML with word, sign and color for the notebook."""

    def __init__(self, head, paragraphs=(), status=None, code=""):
        self.head, self.paragraphs, self.status, self.code = head, [p for p in paragraphs if p], status, code

    def __repr__(self):
        sign = f"{SIGNS[self.status]} " if self.status else ""
        return "\n".join([sign + self.head, *self.paragraphs, *([self.code] if self.code else [])])

    def html(self):
        """The panel as HTML; no ids, no script, colors from the theme's variables with a fallback for other viewers."""
        color = f"var({COLORS[self.status]}, currentColor)" if self.status else "var(--jp-border-color1, currentColor)"
        sign = (
            f'<span aria-hidden="true" style="color:{color};font-weight:bold">{SIGNS[self.status]}</span> '
            if self.status
            else ""
        )
        parts = [f'<div style="font-weight:600">{sign}{html.escape(self.head)}</div>']
        parts += [f'<div style="white-space:pre-wrap">{_marked(p)}</div>' for p in self.paragraphs]
        if self.code:
            parts.append(
                f'<pre style="margin:4px 0 0 0;color:inherit;background:transparent">{html.escape(self.code)}</pre>'
            )
        return (
            f'<div role="status" style="border-left:4px solid {color};padding:4px 10px;max-width:60em;line-height:1.45;'
            "font-size:var(--jp-content-font-size1, inherit);"
            f'color:var(--jp-content-font-color1, inherit)">{"".join(parts)}</div>'
        )

    def _repr_mimebundle_(self, include=None, exclude=None):
        return {"text/plain": repr(self), "text/html": self.html()}


def _marked(text):
    """Escaped text with `code` set as code."""
    pieces = html.escape(text).split("`")
    return "".join(f"<code>{p}</code>" if k % 2 and k < len(pieces) - 1 else p for k, p in enumerate(pieces))


class Named(ipywidgets.VBox):
    """A box of widgets with a constant text where no front end runs, and `still()`, HTML of what it shows now."""

    def __init__(self, children, text, still):
        super().__init__(children)
        self.text, self.still, self._live = text, still, None

    def __repr__(self):
        return self.text

    def _ipython_display_(self):
        self._live = live.show(lambda: self, self.text, self.still)

    def store(self):
        """What it shows has changed: the notebook shall remember it."""
        if self._live:
            self._live.refresh()


def button(label, action):
    """A button that calls `action()`."""
    widget = ipywidgets.Button(description=label, layout=ipywidgets.Layout(width="auto"))
    widget.on_click(lambda _: action())
    return widget


def button_row(hint, solution, starter):
    """Hint, Solution, Start over: each shows its panel under the row; the callables return panels."""
    shown = ipywidgets.HTML()

    def show(panel):
        shown.value = panel.html()
        row.store()

    def next_hint():
        panel, left = hint()
        hints.description = f"Hint ({left} left)" if left else "Hints again"
        show(panel)

    hints = button("Hint", next_hint)
    buttons = [hints, button("Solution", lambda: show(solution())), button("Start over", lambda: show(starter()))]
    row = Named([ipywidgets.HBox(buttons), shown], "[buttons: hint, solution, start over]", lambda: shown.value)
    return row


def show(thing):
    """Display a panel or a widget beneath the running cell."""
    display(thing)
