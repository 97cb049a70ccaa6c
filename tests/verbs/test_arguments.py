"""What the command line answers when something cannot be done: one sentence, no traceback."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from labkit import __main__ as command
from labkit.verbs import VERBS, arguments, notebook_copies

ROOT = command.__file__ and os.path.dirname(os.path.dirname(os.path.abspath(command.__file__)))


def raising(error):
    def work(_):
        raise error

    return work


@pytest.mark.parametrize(
    ("number", "said"),
    [
        (errno.ENOSPC, "x.csv: the disk is full."),
        (errno.EROFS, "x.csv: the disk is read-only."),
        (errno.EACCES, "x.csv: you have no permission."),
        (errno.EPERM, "x.csv: you have no permission."),
        (errno.ENOENT, "x.csv: there is no such file or folder."),
        (errno.EIO, "x.csv: Input/output error."),
    ],
)
def test_what_the_system_refuses_is_a_sentence(number, said, capsys):
    assert arguments.run(raising(OSError(number, os.strerror(number), "x.csv")), []) == 1
    assert capsys.readouterr().err == said + "\n"


def test_a_file_that_another_program_has_open_is_said_to_be(capsys, tmp_path, monkeypatch):
    """Windows, emulated: such a file can be neither replaced nor removed."""

    class Held(PermissionError):
        winerror = 32

    def held(path, *_):
        raise Held(errno.EACCES, "The process cannot access the file", str(path))

    monkeypatch.setattr(os, "replace", held)
    assert arguments.run(lambda folder: notebook_copies.give(folder), tmp_path / "workbook") == 1
    assert "another program has it open. Close it there" in capsys.readouterr().err


def test_other_ends(capsys):
    assert arguments.run(raising(arguments.Refusal("so\nand  so")), []) == 1
    assert arguments.run(raising(KeyboardInterrupt()), []) == 130
    assert arguments.run(lambda words: 7 if words == ["a"] else None, ["a"]) == 7
    assert capsys.readouterr().err.startswith("so\nand so\n")
    assert arguments.run(raising(RecursionError()), []) == 1
    assert capsys.readouterr().err == "The data are nested too deeply to be read.\n"


def test_of_a_file_that_cannot_be_put_in_place_its_own_name_is_told(tmp_path, capsys):
    (tmp_path / "a.ipynb").mkdir()
    assert arguments.run(lambda words: notebook_copies.write(tmp_path / "a.ipynb", ""), []) == 1
    assert capsys.readouterr().err.startswith(str(tmp_path / "a.ipynb") + ": ")


def test_every_verb_has_its_module_and_its_line_of_help(capsys):
    assert command.main(["--help"]) == 0
    printed = capsys.readouterr().out
    for verb in VERBS:
        assert f"python lab.py {verb}" in printed
        module = __import__(f"labkit.verbs.{verb}", fromlist=["main"])
        assert callable(module.main)
    assert command.main(["tset"]) == 1
    assert "There is no verb 'tset'. There are start, update" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("encoding", "said"), [("ascii", b"\\u2713 \\xfc\n"), ("cp1252", b"\\u2713 \xfc\n"), ("cp437", b"\\u2713 \x81\n")]
)
def test_a_console_without_the_letters_gets_others_and_no_traceback(encoding, said):
    environment = {**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"}
    words = [sys.executable, "-c", "from labkit.verbs.arguments import run; run(lambda _: print('✓ ü'), [])"]
    told = subprocess.run(words, cwd=ROOT, env=environment, capture_output=True)
    assert told.stdout.replace(b"\r", b"") == said and told.stderr == b""


@pytest.mark.skipif(os.name == "nt", reason="pipes end otherwise on Windows")
def test_a_reader_who_has_seen_enough_is_no_error():
    code = "from labkit.verbs.arguments import run; run(lambda _: print('x\\n' * 10**6), [])"
    process = subprocess.Popen(
        [sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    process.stdout.readline()
    process.stdout.close()
    assert process.stderr.read() == "" and process.wait(10) is not None
    process.stderr.close()


@pytest.mark.skipif(os.name == "nt", reason="a shell closes no streams there")
def test_whoever_gives_no_place_to_print_to_gets_no_traceback():
    code = "from labkit.verbs.arguments import run; run(lambda _: print('x'), [])"
    told = subprocess.run(
        ["sh", "-c", '"$@" >&-', "sh", sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True
    )
    assert (told.returncode, told.stderr) == (0, "")


def test_a_full_disk_is_said_with_the_file_that_found_no_room(monkeypatch, tmp_path, capsys):
    def full(*_, **__):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))  # as a write says it: without a name

    monkeypatch.setattr(Path, "write_text", full)
    monkeypatch.setattr(Path, "unlink", full)
    for write in (
        lambda: notebook_copies.write(tmp_path / "a.ipynb", ""),
        lambda: arguments.write(tmp_path, a__csv=""),
    ):
        assert arguments.run(lambda words, write=write: write(), []) == 1
        said = capsys.readouterr().err
        assert said.startswith(str(tmp_path / "a.")) and said.endswith("the disk is full.\n")
