"""What an installation tells Jupyter: settings and the server's extension, as `etc/jupyter/` names them."""

import importlib
import json
import subprocess
import sys
from types import SimpleNamespace

import pytest
from jupyter_server.services.kernels.connection.channels import ZMQChannelsWebsocketConnection

from labkit import server
from labkit.exercises import source
from labkit.server.connection import PromptConnection
from labkit.server.saving import keep_language

FOLDER = source.ROOT / "jupyter"


@pytest.mark.parametrize(
    ("before", "after"), [(ZMQChannelsWebsocketConnection, PromptConnection), ("another", "another"), (None, None)]
)
def test_the_extension_sets_connection_and_hook_and_respects_another(before, after):
    hooks = []
    app = SimpleNamespace(
        web_app=SimpleNamespace(settings={server.CONNECTION: before}),
        contents_manager=SimpleNamespace(register_pre_save_hook=hooks.append),
    )
    server._load_jupyter_server_extension(app)
    assert app.web_app.settings[server.CONNECTION] is after and hooks == [keep_language]


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


def test_a_students_server_carries_no_figures():
    """Three hundred servers need not hold what kernels alone use."""
    code = "import sys, labkit.server; print({'matplotlib', 'anywidget', 'scipy', 'numpy'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], cwd=source.ROOT, capture_output=True).stdout == b"set()\n"
