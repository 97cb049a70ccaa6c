"""What a cell shows while its kernel lives, and what is left of it afterwards.

A stored output that names a widget is an error message tomorrow: the widget is gone with its kernel. Here nothing
stored names one. A cell gets two outputs: what was there last as plain HTML, and an empty place with a number of its
own. While the kernel lives, `live.js` puts the widget into the place and hides the HTML; in a notebook opened again, in
exported HTML and on the web the HTML is all there is.
"""

import os
import uuid
from pathlib import Path

import anywidget
import traitlets
from IPython import get_ipython
from IPython.display import display

AGAIN = "Run All makes it live again."
WIDGET = "application/vnd.jupyter.widget-view+json"


def is_built():
    """Whether notebooks are being built or tested: then nobody looks, and outputs are compared."""
    return os.environ.get("LABKIT_STRICT", "") not in ("", "0")


class Live(anywidget.AnyWidget):
    """A widget in the outputs of the running cell.

    Parameters
    ----------
    widget : ipywidgets.Widget
    text : str
        What stands for it where there is text alone; the same each time.
    still : function() -> str
        HTML of what it shows now.
    """

    _esm = Path(__file__).with_name("live.js")
    _css = Path(__file__).with_name("live.css")
    place = traitlets.Unicode().tag(sync=True)
    child = traitlets.Unicode().tag(sync=True)

    def __init__(self, widget, text, still):
        super().__init__(place=uuid.uuid4().hex, child=widget.model_id)
        self._widget, self._text, self._still, self._stored = widget, text, still, ""

    def show(self):
        """Display it beneath the running cell: its place at once, so that the page makes the widget while Python still
        writes what is stored.
        """
        self._put("")
        place = {"text/plain": "", "text/html": f'<div data-labkit-live="{self.place}"></div>'}
        if "VSCODE_PID" in os.environ and "JPY_SESSION_NAME" not in os.environ:
            # VS Code runs no widget's script before an output names one
            place[WIDGET] = {"version_major": 2, "version_minor": 0, "model_id": self._widget.model_id}
        display(place, raw=True)
        self._put(self._still())

    def refresh(self):
        """Store anew what it shows."""
        if get_ipython() is not None:
            self._put(self._still())

    def _put(self, still):
        page = f'<div data-labkit-still="{self.place}">{still}</div>'
        if page != self._stored:
            bundle = {"text/plain": self._text, "text/html": page}
            display(bundle, raw=True, display_id=self.place, update=bool(self._stored))
            self._stored = page


def show(widget, text, still):
    """Show a widget beneath the running cell; returns what can `refresh()` the stored HTML, None where nobody looks.

    widget : function() -> ipywidgets.Widget. The other parameters are those of `Live`.
    """
    if get_ipython() is None:
        print(text)
        return None
    if is_built():
        display({"text/plain": text}, raw=True)
        return None
    live = Live(widget(), text, still)
    live.show()
    return live
