"""What an installation tells Jupyter: settings and the server's extension, as `etc/jupyter/` names them."""

import asyncio
import importlib
import json
import subprocess
import sys
from types import SimpleNamespace

import pytest
from jupyter_client.session import Session
from jupyter_server.services.kernels.connection.channels import ZMQChannelsWebsocketConnection

from labkit import server
from labkit.exercises import source
from labkit.server import connection
from labkit.server.connection import PromptConnection
from labkit.server.saving import keep_language

FOLDER = source.ROOT / "jupyter"


@pytest.mark.parametrize(
    ("before", "after"), [(ZMQChannelsWebsocketConnection, PromptConnection), ("another", "another"), (None, None)]
)
def test_the_extension_sets_connection_and_hook_and_respects_another(before, after, monkeypatch):
    hooks, frozen = [], []
    monkeypatch.setattr(server.gc, "freeze", lambda: frozen.append(True))
    app = SimpleNamespace(
        web_app=SimpleNamespace(settings={server.CONNECTION: before}),
        contents_manager=SimpleNamespace(register_pre_save_hook=hooks.append),
    )
    server._load_jupyter_server_extension(app)
    assert app.web_app.settings[server.CONNECTION] is after and hooks == [keep_language] and frozen


def test_the_extension_is_the_one_that_is_named():
    named = json.loads((FOLDER / "server.json").read_text(encoding="utf-8"))["ServerApp"]["jpserver_extensions"]
    (name,) = [name for name, on in named.items() if on]
    assert importlib.import_module(name)._jupyter_server_extension_points() == [{"module": name}]


def test_nothing_is_asked_and_the_figure_being_dragged_stays_in_the_page():
    settings = json.loads((FOLDER / "settings.json").read_text(encoding="utf-8"))
    assert settings["@jupyterlab/apputils-extension:notification"]["checkForUpdates"] is False
    assert settings["@jupyterlab/notebook-extension:tracker"]["windowingMode"] == "none"


def test_pictures_leave_the_server_at_once(monkeypatch):
    calls = []

    class Handler:
        def set_nodelay(self, on):
            calls.append(on)

    monkeypatch.setattr(ZMQChannelsWebsocketConnection, "connect", lambda self: calls.append("connect"))
    connection = PromptConnection.__new__(PromptConnection)
    connection._trait_values["websocket_handler"] = Handler()
    connection.connect()
    assert calls == [True, "connect"]


class Kernel:
    """A connection whose kernel says what a test lets it say; `told` is what the page hears."""

    def __init__(self, monkeypatch):
        self.told, self.session = [], Session(key=b"key")
        monkeypatch.setattr(connection, "SHORT", 0.02)
        base = ZMQChannelsWebsocketConnection
        monkeypatch.setattr(base, "handle_outgoing_message", lambda _, stream, message: self.told.append(stream))
        monkeypatch.setattr(base, "disconnect", lambda _: None)
        self.connection = PromptConnection(session=self.session)

    def says(self, words, kind, parent, **content):
        message = self.session.msg(kind, content, parent=parent)
        self.connection.handle_outgoing_message(words, self.session.serialize(message, b"topic"))


def test_a_widget_answered_at_once_is_not_told_as_busy_and_a_long_answer_is(monkeypatch):
    async def work():
        kernel = Kernel(monkeypatch)
        moved, ran = (kernel.session.msg_header(kind) for kind in ("comm_msg", "execute_request"))
        kernel.says("busy with a cell", "status", ran, execution_state="busy")
        kernel.says("idle after a cell", "status", ran, execution_state="idle")
        kernel.says("busy", "status", moved, execution_state="busy")
        kernel.says("picture", "comm_msg", moved, data={})
        kernel.says("idle", "status", moved, execution_state="idle")
        await asyncio.sleep(0.03)
        assert kernel.told == ["busy with a cell", "idle after a cell", "picture", "idle"]
        kernel.says("long", "status", moved, execution_state="busy")
        await asyncio.sleep(0.03)
        assert kernel.told[4:] == ["long"]
        kernel.says("idle at last", "status", moved, execution_state="idle")
        kernel.says("closed before", "status", moved, execution_state="busy")
        kernel.connection.disconnect()
        await asyncio.sleep(0.03)
        assert kernel.told[5:] == ["idle at last"]

    asyncio.run(work())


def test_a_students_server_carries_no_figures():
    """Three hundred servers need not hold what kernels alone use."""
    code = "import sys, labkit.server; print({'matplotlib', 'anywidget', 'scipy', 'numpy'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], cwd=source.ROOT, capture_output=True).stdout == b"set()\n"
