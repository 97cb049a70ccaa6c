"""The one command: what it does in which situation, and the words it finds when something is missing. No network."""

import ast
import errno
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import lab
from labkit.exercises import source
from labkit.verbs import processes


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

    def make_venv(folder, held):
        done.append("venv")
        python.parent.mkdir(parents=True, exist_ok=True)
        python.write_text("", encoding="utf-8")

    monkeypatch.setattr(lab, "make_venv", make_venv)
    monkeypatch.setattr(lab, "install", lambda python, root, extra, held: done.append(extra or "packages"))
    monkeypatch.setattr(lab, "version_of", lambda path: "3.11" if Path(path).exists() else None)
    monkeypatch.setattr(lab, "works", lambda *words: Path(words[0]).exists())

    def set_up(extra=""):
        done.clear()
        assert lab.set_up(checkout, extra) == str(python)
        return list(done)

    return set_up


def test_set_up_runs_once(fake_set_up, checkout):
    assert fake_set_up() == ["venv", "packages"]
    assert fake_set_up() == []


def test_what_only_tests_need_comes_with_the_first_test_and_stays(fake_set_up, checkout):
    fake_set_up()
    assert fake_set_up("test") == ["test"]
    assert fake_set_up("test") == fake_set_up() == []
    (checkout / "constraints.txt").write_text("changed", encoding="utf-8")
    assert fake_set_up() == ["test"]


@pytest.mark.parametrize("name", lab.ASKED_FOR)
def test_changed_requirements_are_installed_into_the_same_environment(fake_set_up, checkout, name):
    fake_set_up()
    (checkout / name).parent.mkdir(exist_ok=True)
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
    def stop(*_):
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


@pytest.fixture
def programs(monkeypatch):
    """Programs that are not run but answer as told: `answers` are (exit code, words), `asked` the commands."""

    class Programs:
        answers, asked, held = [], [], []

    def logged(words, folder, log, held=None):
        Programs.asked.append(words)
        Programs.held.append(held)
        code, said = Programs.answers.pop(0)
        log.write(said.encode())
        return code

    monkeypatch.setattr(lab, "logged", logged)
    return Programs


def test_uv_installs_where_it_can_be_had(checkout, programs):
    programs.answers = [(0, "uv is here"), (0, "all is here")]
    lab.install("python", checkout, "test")
    assert programs.asked[0][-3:] == ["-c", "constraints.txt", "uv"] and programs.asked[1][1:3] == ["-m", "uv"]
    assert programs.asked[1][-4:] == ["-c", "constraints.txt", "-e", ".[test]"]
    assert "all is here" in (checkout / ".lab" / "setup.log").read_text(encoding="utf-8")


@pytest.mark.parametrize("before", [[(1, "no uv for this machine")], [(0, ""), (2, "uv: index unknown to me")]])
def test_pip_does_it_where_uv_cannot(checkout, programs, before):
    programs.answers = [*before, (0, "")]
    lab.install("python", checkout)
    assert programs.asked[-1][1:4] == ["-m", "pip", "install"] and programs.asked[-1][-2:] == ["-e", "."]
    programs.answers = [*before, (1, "ERROR: ResolutionImpossible")]
    with pytest.raises(lab.Refusal, match="could not be installed: ERROR: ResolutionImpossible"):
        lab.install("python", checkout)


def test_without_a_network_one_attempt_is_enough(checkout, programs):
    programs.answers = [(1, "NewConnectionError: no route")]
    with pytest.raises(lab.Refusal, match="Is the network away"):
        lab.install("python", checkout)


@pytest.mark.skipif(os.name == "nt", reason="file locks are inherited on POSIX alone")
@pytest.mark.parametrize(("number", "ends"), [(signal.SIGTERM, True), (signal.SIGHUP, True), (signal.SIGKILL, False)])
def test_an_installation_ends_with_lab_py_or_keeps_its_lock(tmp_path, number, ends):
    """What installs is told to end, with all it has started; where that cannot be, a second set-up waits for it."""
    path, shown = tmp_path / "lock", tmp_path / "log"
    grandchild = "import os, time; print(os.getpid(), flush=True); time.sleep(60)"
    child = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {grandchild!r}], close_fds=False)"
    code = f"""import lab, pathlib, sys
with lab.only_one(pathlib.Path({str(path)!r})) as held, open({str(shown)!r}, 'ab') as log:
    lab.logged([sys.executable, '-c', {child!r}], '.', log, held)"""
    parent = subprocess.Popen([sys.executable, "-c", code], cwd=source.ROOT)
    while not (shown.exists() and shown.read_text().endswith("\n")):
        time.sleep(0.02)
    pid = int(shown.read_text())
    parent.send_signal(number)
    parent.wait(10)
    with path.open("a+b") as file:
        if ends:
            free_soon(file)
        else:
            with pytest.raises(OSError):
                lab.lock(file, wait=False)
            os.kill(pid, signal.SIGKILL)
            lab.lock(file, wait=True)


def free_soon(file):
    """A lock falls when the last program that holds it has ended, which is some moments after it was told to."""
    deadline = time.monotonic() + 20
    while True:
        try:
            return lab.lock(file, wait=False)
        except OSError:
            assert time.monotonic() < deadline
            time.sleep(0.01)


def test_the_environment_is_made_by_a_program_that_holds_the_lock(checkout, programs):
    """And its words are read from its log: what is made there must not be made twice at the same time."""
    programs.answers = [(0, ""), (1, "ensurepip is not available")]
    with lab.only_one(checkout / ".lab" / "setup.lock") as held:
        lab.make_venv(checkout / ".venv", held)
        with pytest.raises(lab.Refusal, match="sudo apt install python3-venv"):
            lab.make_venv(checkout / ".venv", held)
    assert programs.held == [held, held] and programs.asked[0][-1] == str(checkout / ".venv")


@pytest.mark.parametrize("error", [errno.ENOSPC, errno.EROFS, errno.EACCES])
def test_a_disk_that_takes_nothing_gets_a_sentence(checkout, monkeypatch, capsys, error):
    """Full, read-only or another user's: wherever the set-up writes first."""

    def refuse(path, *_, **__):
        raise OSError(error, os.strerror(error), str(path))

    monkeypatch.setattr(lab, "ROOT", checkout)
    monkeypatch.setattr(lab.Path, "mkdir", refuse)
    assert lab.main(["progress"]) == 1
    told = capsys.readouterr()
    assert told.err.count("\n") == 1 and str(checkout / ".lab") in told.err


def test_a_disk_that_fills_up_meanwhile_gets_one_sentence(checkout, monkeypatch, capsys):
    """Not even the stamp of what was begun can be written then."""

    def install(*_):
        raise lab.Refusal(lab.FULL)

    def refuse(path, *_, **__):
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr(lab, "ROOT", checkout)
    monkeypatch.setattr(lab, "make_venv", lambda folder, held: folder.mkdir())
    monkeypatch.setattr(lab, "install", install)
    monkeypatch.setattr(lab.Path, "write_text", refuse)
    assert lab.main(["progress"]) == 1
    assert capsys.readouterr().err == lab.FULL + "\n"


def test_verbs():
    assert lab.split([]) == ("start", [])
    assert lab.split(["--port", "9000"]) == ("start", ["--port", "9000"])
    assert lab.split(["test", "-k", "invert"]) == ("test", ["-k", "invert"])


def test_what_is_no_verb_is_refused_before_anything_is_set_up(monkeypatch, capsys):
    monkeypatch.setattr(lab, "set_up", None)
    assert lab.main(["tset"]) == 1
    assert "no command 'tset'. There are test, start, update" in capsys.readouterr().err
    monkeypatch.setattr(lab.processes, "call", None)
    assert lab.main(["--help"]) == 0
    printed = capsys.readouterr().out
    assert "python lab.py test" in printed and "python lab.py collect" in printed


def test_each_verb_is_handed_on(monkeypatch):
    calls = []
    monkeypatch.setattr(lab, "set_up", lambda root, extra="": f"python{extra}")
    monkeypatch.setattr(lab.processes, "call", lambda words: calls.append(words) or 3)
    assert lab.main(["calibrate", "pivot", "p.csv"]) == 3
    assert lab.main(["--allow-root", "--port", "9"]) == lab.main(["test", "-k", "x"]) == 3
    assert calls[0] == ["python", "-m", "labkit", "calibrate", "pivot", "p.csv"]
    assert calls[1] == ["python", "-m", "labkit", "start", "--allow-root", "--port", "9"]
    assert calls[2] == ["pythontest", str(source.ROOT / "tests" / "run.py"), "-k", "x"]


def test_signals_and_exit_codes_are_handed_on():
    assert processes.call([sys.executable, "-c", "raise SystemExit(7)"]) == 7


@pytest.mark.skipif(os.name == "nt", reason="signals are POSIX")
def test_stopping_lab_py_stops_what_it_started():
    child = "import time; print(1, flush=True); time.sleep(60)"
    code = f"import sys; from labkit.verbs import processes; processes.call([sys.executable, '-c', {child!r}])"
    process = subprocess.Popen([sys.executable, "-c", code], cwd=source.ROOT, stdout=subprocess.PIPE)
    process.stdout.readline()
    process.terminate()
    assert process.wait(10) is not None
