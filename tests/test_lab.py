"""The one command: what it does in which situation, and the words it finds when something is missing. No network."""

import ast
import json
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

import lab
from labkit.exercises import source
from labkit.verbs import build


@pytest.fixture
def checkout(tmp_path):
    (tmp_path / "pyproject.toml").write_text("[project]\n", encoding="utf-8")
    (tmp_path / "constraints.txt").write_text("numpy==2.0\n", encoding="utf-8")
    return tmp_path


@pytest.fixture
def fake_set_up(monkeypatch, checkout):
    """A checkout in which environments and installations are only noted down: `set_up()` returns what it did."""
    done = []
    python = lab.venv_python(checkout / ".venv")

    def make_venv(folder):
        done.append("venv")
        python.parent.mkdir(parents=True, exist_ok=True)
        python.write_text("", encoding="utf-8")

    monkeypatch.setattr(lab, "make_venv", make_venv)
    monkeypatch.setattr(lab, "install", lambda python, root: done.append("packages"))
    monkeypatch.setattr(lab, "version_of", lambda path: "3.11" if Path(path).exists() else None)
    monkeypatch.setattr(lab, "works", lambda *words: Path(words[0]).exists())

    def set_up():
        done.clear()
        assert lab.set_up(checkout) == str(python)
        return list(done)

    return set_up


def test_set_up_runs_once(fake_set_up, checkout):
    assert fake_set_up() == ["venv", "packages"]
    assert fake_set_up() == []
    written = checkout / ".venv" / "share" / "jupyter" / "lab" / "settings" / "overrides.json"
    assert json.loads(written.read_text(encoding="utf-8")) == lab.OVERRIDES


@pytest.mark.parametrize("name", ["pyproject.toml", "constraints.txt"])
def test_changed_requirements_are_installed_into_the_same_environment(fake_set_up, checkout, name):
    fake_set_up()
    (checkout / name).write_text("changed", encoding="utf-8")
    assert fake_set_up() == ["packages"]
    assert fake_set_up() == []


def test_another_python_or_a_broken_environment_makes_a_new_one(fake_set_up, checkout, monkeypatch):
    fake_set_up()
    lab.venv_python(checkout / ".venv").unlink()
    assert fake_set_up() == ["venv", "packages"]
    monkeypatch.setattr(lab, "version_of", lambda path: "3.12")
    assert fake_set_up() == ["venv", "packages"]


def test_a_moved_checkout_is_installed_again(fake_set_up, checkout):
    fake_set_up()
    file = checkout / ".venv" / "labkit-stamp.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), "place": "elsewhere"}), encoding="utf-8")
    assert fake_set_up() == ["packages"]


@pytest.mark.parametrize(
    ("stopped_by", "redone"), [(KeyboardInterrupt, ["venv", "packages"]), (lab.Refusal, ["packages"])]
)
def test_an_unfinished_set_up_is_redone(fake_set_up, checkout, monkeypatch, stopped_by, redone):
    def stop(python, root):
        raise stopped_by

    with monkeypatch.context() as patch:
        patch.setattr(lab, "install", stop)
        with pytest.raises(stopped_by):
            lab.set_up(checkout)
    assert fake_set_up() == redone
    assert fake_set_up() == []


def test_a_second_set_up_waits_for_the_first(checkout):
    """A second process asks for the lock while this one holds it, and gets it afterwards."""
    code = "import lab, pathlib, sys\nwith lab.only_one(pathlib.Path(sys.argv[1])): print('got it')"
    path = checkout / ".lab" / "setup.lock"
    with lab.only_one(path):
        second = subprocess.Popen(
            [sys.executable, "-u", "-c", code, str(path)], cwd=source.ROOT, stdout=subprocess.PIPE, text=True
        )
        assert "waiting" in second.stdout.readline()
        assert second.poll() is None
    assert second.communicate(timeout=20)[0] == "got it\n"


def test_a_damaged_stamp_counts_as_none(tmp_path):
    for text in ("", "[1]", "{"):
        (tmp_path / "stamp").write_text(text, encoding="utf-8")
        assert lab.read_stamp(tmp_path / "stamp") == {}


def test_interpreters_lie_elsewhere_on_windows():
    assert lab.venv_python(Path("v"), windows=False) == Path("v/bin/python")
    assert lab.venv_python(Path("v"), windows=True) == Path("v/Scripts/python.exe")


def test_version_of_a_real_and_of_a_missing_python(tmp_path):
    assert lab.version_of(sys.executable) == f"{sys.version_info[0]}.{sys.version_info[1]}"
    assert lab.version_of(tmp_path / "none") is None


def test_an_old_python_gets_as_far_as_the_sentence():
    """The file parses with Python 3.6, imports nothing newer at its head, and says what is needed."""
    code = Path(lab.__file__).read_text(encoding="utf-8")
    ast.parse(code, feature_version=(3, 6))
    assert lab.too_old((3, 9)).startswith("The workbook needs Python 3.11 or newer, and this is Python 3.9.")


def test_an_old_python_is_refused_before_anything_else(monkeypatch, capsys):
    monkeypatch.setattr(lab.sys, "version_info", (3, 10, 2))
    monkeypatch.setattr(lab, "set_up", None)
    assert lab.main([]) == 1
    assert "this is Python 3.10" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("output", "words"),
    [
        (
            "The virtual environment was not created because ensurepip is not\navailable.",
            "sudo apt install python3-venv",
        ),
        ("/usr/bin/python3: No module named venv", "sudo apt install python3-venv"),
        ("Error: [Errno 13] Permission denied", "could not be made: Error: [Errno 13] Permission denied"),
    ],
)
def test_a_missing_venv_module_is_explained(output, words):
    assert words in lab.venv_advice(output)


@pytest.mark.parametrize(
    ("output", "words"),
    [
        ("Retrying ... NewConnectionError('...')\nERROR: No matching distribution found", "Is the network away?"),
        ("Temporary failure in name resolution", "Is the network away?"),
        ("ERROR: Could not install packages: [Errno 28] No space left on device", "The disk is full"),
        ("Collecting numpy\nERROR: ResolutionImpossible", "could not be installed: ERROR: ResolutionImpossible"),
        ("", "no reason was given"),
    ],
)  # fmt: skip
def test_a_failed_installation_is_explained(output, words):
    advice = lab.install_advice(output)
    assert words in advice and ".lab/setup.log" in advice


@pytest.mark.parametrize(("code", "refused"), [(0, False), (1, True)])
def test_what_pip_says_goes_to_the_log_and_its_failure_into_a_sentence(checkout, monkeypatch, code, refused):
    real, said = subprocess.run, f"print('NewConnectionError: no route'); raise SystemExit({code})"
    asked = []

    def run(words, **options):
        asked.extend(words)
        return real([sys.executable, "-c", said], **options)

    monkeypatch.setattr(lab.subprocess, "run", run)
    if refused:
        with pytest.raises(lab.Refusal, match="Is the network away"):
            lab.install("python", checkout)
    else:
        lab.install("python", checkout)
    assert asked[-4:] == ["-c", "constraints.txt", "-e", ".[test]"]
    assert "NewConnectionError" in (checkout / ".lab" / "setup.log").read_text(encoding="utf-8")


def test_verbs_and_options():
    assert lab.split([]) == ("lab", [])
    assert lab.split(["--port", "9000"]) == ("lab", ["--port", "9000"])
    assert lab.split(["test", "-k", "invert"]) == ("test", ["-k", "invert"])
    assert lab.split(["--help"]) == ("help", [])
    assert lab.split(["calibrate", "--help"]) == ("calibrate", ["--help"])
    assert lab.command("calibrate", "py", ["pivot", "p.csv"]) == ["py", "-m", "labkit", "calibrate", "pivot", "p.csv"]
    with pytest.raises(lab.Refusal, match="no command 'tset'. There are test, build, reset, progress, ledger"):
        lab.split(["tset"])
    with pytest.raises(lab.Refusal, match="Which chapter"):
        lab.split(["reset"])
    options, passed_on = lab.lab_options(["--no-browser", "--port", "9000", "--allow-root"])
    assert (options.no_browser, options.port, options.ip, passed_on) == (True, 9000, "localhost", ["--allow-root"])


def test_each_verb_has_a_command():
    for verb in ("test", "build", "reset", "progress", "ledger"):
        words = lab.command(verb, "python", ["01"])
        assert words[0] == "python"
        assert (words[-1] == "01") == (verb in ("test", "build", "reset"))


def test_help_names_every_verb(capsys):
    assert lab.main(["--help"]) == 0
    printed = capsys.readouterr().out
    assert all(f"lab.py {verb}" in printed for verb in ("test", "build", "reset", "progress", "ledger"))


def test_jupyterlab_listens_on_this_machine_alone_and_keeps_its_token():
    words = " ".join(lab.lab_command("python", "localhost", 8888, no_browser=False))
    assert "--ServerApp.ip=localhost" in words and "token" not in words and "password" not in words
    assert lab.FIRST_NOTEBOOK in words and "--no-browser" not in words
    assert (source.ROOT / "solutions" / Path(lab.FIRST_NOTEBOOK).with_suffix(".py").name).exists()


def test_a_taken_port_is_avoided_or_named(monkeypatch, capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(lab.Refusal, match=f"Port {port} is taken. Choose another with --port"):
            lab.choose_port("127.0.0.1", port)
        monkeypatch.setattr(lab, "FIRST_PORT", port)
        found = lab.choose_port("127.0.0.1")
        assert found > port
        assert f"Port {port} is taken (another JupyterLab?), so this one takes {found}." in capsys.readouterr().out
        monkeypatch.setattr(lab, "PORTS", 1)
        with pytest.raises(lab.Refusal, match="all taken"):
            lab.choose_port("127.0.0.1")
    with pytest.raises(lab.Refusal, match="from 1 to 65535, and 99999 is none"):
        lab.choose_port("localhost", 99999)
    for ip in ("no.such.host.invalid", "192.0.2.1"):
        with pytest.raises(lab.Refusal, match="no address of this machine"):
            lab.choose_port(ip)


def test_localhost_is_taken_when_any_of_its_addresses_is():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        assert not lab.is_free("localhost", taken.getsockname()[1])


def test_signals_and_exit_codes_are_handed_on():
    assert lab.call([sys.executable, "-c", "raise SystemExit(7)"]) == 7


@pytest.mark.skipif(os.name == "nt", reason="signals are POSIX")
def test_stopping_lab_py_stops_what_it_started():
    code = "import lab, sys; lab.call([sys.executable, '-c', 'import time; print(1, flush=True); time.sleep(60)'])"
    process = subprocess.Popen([sys.executable, "-c", code], cwd=source.ROOT, stdout=subprocess.PIPE)
    process.stdout.readline()
    process.terminate()
    assert process.wait(10) is not None


def test_reset_keeps_the_students_copy(tmp_path):
    path = tmp_path / "solutions" / "01_small.py"
    path.parent.mkdir()
    path.write_text("# %% a\nx = 1\n", encoding="utf-8")
    notebooks = tmp_path / "notebooks"
    assert build.main(["--reset", "01"], tmp_path) == 0
    fresh = (notebooks / "01_small.ipynb").read_text(encoding="utf-8")
    assert "already" in build.reset(path, notebooks)
    for number in (1, 2):
        (notebooks / "01_small.ipynb").write_text(f"my work {number}", encoding="utf-8")
        said = build.reset(path, notebooks)
        assert said.endswith(f"yours is kept as notebooks/01_small.my-copy-{number}.ipynb")
        assert (notebooks / f"01_small.my-copy-{number}.ipynb").read_text(encoding="utf-8") == f"my work {number}"
        assert (notebooks / "01_small.ipynb").read_text(encoding="utf-8") == fresh
