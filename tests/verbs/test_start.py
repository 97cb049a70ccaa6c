"""Opening JupyterLab: where the notebooks lie, which port, and what is said or refused before."""

import os
import socket
import tempfile

import pytest

from labkit import __main__
from labkit.verbs import jupyter, notebook_copies, start
from labkit.verbs.arguments import Refusal


@pytest.fixture
def opened(monkeypatch):
    """Words and environment of the JupyterLab that would have been opened."""
    calls = []
    monkeypatch.setattr(jupyter, "call", lambda words, **environment: calls.append((words, environment)) or 0)
    monkeypatch.setattr(jupyter, "is_root", lambda: False)
    return calls


def test_a_folder_gets_the_notebooks_once_and_is_opened(opened, tmp_path, capsys):
    folder = tmp_path / "Übung 1"
    assert start.main([str(folder), "--no-browser", "--ServerApp.x=1"]) == 0
    assert f"{len(notebook_copies.blank_notebooks())} notebooks are laid out" in capsys.readouterr().out
    (words, environment), first = opened[0], folder / "00_start_here.ipynb"
    assert f"--ServerApp.root_dir={folder}" in words and "--no-browser" in words and words[-1] == "--ServerApp.x=1"
    assert environment["JUPYTERLAB_WORKSPACES_DIR"] == str(folder / ".lab" / "workspaces")
    first.write_text("mine", encoding="utf-8")
    start.main([str(folder)])
    assert first.read_text(encoding="utf-8") == "mine" and "laid out" not in capsys.readouterr().out


def test_a_checkout_opens_itself_and_an_installation_asks_where(opened, monkeypatch):
    start.main([])
    assert any("/lab/tree/notebooks/00_start_here.ipynb" in word for word in opened[0][0])
    monkeypatch.setattr(start, "IS_CHECKOUT", False)
    with pytest.raises(Refusal, match="Which folder shall hold your notebooks.*labkit start workbook"):
        start.main(["--port", "9000"])


def test_root_is_told_before_jupyterlab_tells_it(opened, monkeypatch):
    monkeypatch.setattr(jupyter, "is_root", lambda: True)
    with pytest.raises(Refusal, match="python lab.py --allow-root"):
        start.main([])
    assert start.main(["--allow-root"]) == 0 and "--allow-root" in opened[0][0]


def test_listening_everywhere_is_said_to_be_plain_http(opened, capsys):
    start.main(["--ip", "0.0.0.0"])
    assert "plain HTTP" in capsys.readouterr().out and "--ServerApp.ip=0.0.0.0" in opened[0][0]
    start.main([])
    assert "plain HTTP" not in capsys.readouterr().out


def test_a_port_that_is_lost_before_jupyterlab_listens_is_replaced(monkeypatch, capsys, tmp_path):
    """Another program listens after the port was chosen: JupyterLab gives up, and the next port is tried."""
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        port, tried = other.getsockname()[1], []

        def call(words, **_):
            tried.append(next(word for word in words if "port=" in word))
            other.listen()
            return len(tried) == 1

        monkeypatch.setattr(jupyter, "FIRST_PORT", port)
        monkeypatch.setattr(jupyter, "call", call)
        monkeypatch.setattr(jupyter, "is_free", lambda ip, asked: asked != port if tried else True)
        options = start.parser().parse_args(["--ip", "127.0.0.1"])
        assert jupyter.open_lab(tmp_path, "a.ipynb", options, []) == 0
    assert tried == [f"--ServerApp.port={port}", f"--ServerApp.port={port + 1}"]
    assert f"Another program took port {port}" in capsys.readouterr().out


def test_a_folder_that_cannot_be_written_keeps_its_workspaces_elsewhere(tmp_path):
    (tmp_path / ".lab").write_text("in the way", encoding="utf-8")
    assert jupyter.own_places(tmp_path) == {"JUPYTER_PREFER_ENV_PATH": "1"}


def test_a_home_that_cannot_be_written_keeps_nobody_from_working(tmp_path, monkeypatch, capsys):
    assert jupyter.places_without_a_home() == {} and capsys.readouterr().out == ""
    (tmp_path / "home").write_text("a file", encoding="utf-8")
    monkeypatch.setenv("JUPYTER_DATA_DIR", str(tmp_path / "home" / "jupyter"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    places = jupyter.places_without_a_home()
    assert set(places) > {"JUPYTER_RUNTIME_DIR", "IPYTHONDIR"} and all(str(tmp_path) in p for p in places.values())
    assert "JupyterLab keeps its own files in" in capsys.readouterr().out


def test_jupyterlab_listens_on_this_machine_alone_and_keeps_its_token():
    words = " ".join(jupyter.lab_command("python", "here", "00_start_here.ipynb", "localhost", 8888, no_browser=False))
    assert "--ServerApp.ip=localhost" in words and "token" not in words and "password" not in words
    assert "/lab/tree/00_start_here.ipynb" in words and "--no-browser" not in words and "port_retries=0" in words


def test_a_taken_port_is_avoided_or_named(monkeypatch, capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(Refusal, match=f"Port {port} is taken, or not open to you. Choose another"):
            jupyter.choose_port("127.0.0.1", port)
        monkeypatch.setattr(jupyter, "FIRST_PORT", port)
        found = jupyter.choose_port("127.0.0.1")
        assert found > port
        assert f"Port {port} is taken (another JupyterLab?), so this one takes {found}." in capsys.readouterr().out
        monkeypatch.setattr(jupyter, "PORTS", 1)
        with pytest.raises(Refusal, match="all taken"):
            jupyter.choose_port("127.0.0.1")
    with pytest.raises(Refusal, match="from 1 to 65535, and 99999 is none"):
        jupyter.choose_port("localhost", 99999)
    for ip in ("no.such.host.invalid", "192.0.2.1"):
        with pytest.raises(Refusal, match="no address of this machine"):
            jupyter.choose_port(ip)


def test_localhost_is_taken_when_any_of_its_addresses_is():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        assert not jupyter.is_free("localhost", taken.getsockname()[1])


def test_linear_algebra_has_one_thread_unless_another_number_is_asked_for(monkeypatch, capsys):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    assert __main__.main(["--version"]) == 0 and os.environ["OMP_NUM_THREADS"] == "1"
    monkeypatch.setenv("OMP_NUM_THREADS", "4")
    assert __main__.main(["--version"]) == 0 and os.environ["OMP_NUM_THREADS"] == "4"
