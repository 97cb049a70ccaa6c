"""A Stage in a notebook: the widget that carries its messages, and what is stored of it."""

import base64
import html
import importlib
import uuid
from pathlib import Path

import anywidget
import traitlets
from IPython.display import display

from .. import live

SPACE = Path(__file__).with_name("space.js")  # the drawing in space, which the first Stage of a page asks for


class Front(anywidget.AnyWidget):
    """`stage.js` with its model: the declaration, and messages both ways.

    The first Stage of a kernel that has a scene in space brings the drawing along: the page gets it ready while Python
    still works at the picture that is stored.
    """

    _esm = Path(__file__).with_name("stage.js")
    _css = Path(__file__).with_name("stage.css")
    declaration = traitlets.Dict().tag(sync=True)
    drawing = traitlets.Bytes().tag(sync=True)
    own = traitlets.Unicode().tag(sync=True)  # number of the model, by which the page finds it
    is_sent = False  # whether one has brought it


def widget(stage):
    """The widget of a Stage, connected to it."""
    brings = stage.spaces and not Front.is_sent
    Front.is_sent = Front.is_sent or bool(brings)
    own = uuid.uuid4().hex
    drawing = SPACE.read_bytes() if brings else b""
    made = Front(declaration=stage.declaration(), drawing=drawing, own=own, model_id=own)
    stage.connect(made.send)
    made.on_msg(lambda _, message, buffers: stage.receive(message))
    return made


def still(stage):
    """Picture with handles, and caption, as HTML."""
    picture = base64.b64encode(stage.small_png()).decode()
    words = html.escape(stage.caption)
    return (
        f'<figure style="margin:0"><img alt="{html.escape(stage.name)}: {words}" '
        f'style="max-width:100%" src="data:image/png;base64,{picture}"/>'
        f"<figcaption>{words}<br/><small>{live.AGAIN}</small></figcaption></figure>"
    )


def show_window(stage):
    """Show a Stage on the demo's page; where nobody looks, its text alone."""
    if live.is_built():
        print(repr(stage))
        return
    print(importlib.import_module("labkit.demo.window").open_window(stage))  # found by name, as a chapter is


def show(stage):
    """Show a Stage beneath the running cell; in notebooks that are built, its text and its small picture."""
    if live.is_built():
        picture = {"text/plain": repr(stage), "image/png": stage.small_png()}
        display(picture, metadata={"image/png": {"alt": stage.caption or stage.name}}, raw=True)
        return
    shown = live.show(lambda: stage.widget, repr(stage), stage.still)
    if shown:
        stage.at_rest.append(shown.refresh)
