"""What has a file's name and is none, a pipe say, is left alone or refused in a sentence: nobody waits for it."""

import contextlib
import json
import os
import signal
import socket

import pytest

from labkit.__main__ import main
from labkit.collect import batch
from labkit.demo import notes
from labkit.demo.program import read_questions
from labkit.exercises import progress
from labkit.localization.maps import OccupancyGrid
from labkit.machines.log import read_csv
from labkit.verbs import build, notebook_copies

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes are POSIX")
NONE = "it is a pipe, a socket or a device, and no file"


@pytest.fixture(autouse=True)
def nobody_waits():
    """What waits for a pipe is stopped: a test that hangs tells nothing."""

    def stop(*_):
        raise AssertionError("somebody waits for a pipe")

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(20)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.fixture
def pipe(tmp_path):
    def made(name):
        os.mkfifo(tmp_path / name)
        return tmp_path / name

    return made


def bound(path):
    with socket.socket(socket.AF_UNIX) as listener, contextlib.chdir(path.parent):
        listener.bind(path.name)  # the whole path may be too long for a socket


IN_THE_WAY = {
    "pipe": os.mkfifo if hasattr(os, "mkfifo") else None,
    "socket": bound,
    "folder": os.mkdir,
    "link to nothing": lambda path: os.symlink("nowhere", path),
    "link to itself": lambda path: os.symlink(path.name, path),
}


@pytest.mark.parametrize("kind", IN_THE_WAY)
def test_an_update_leaves_what_is_no_notebook_and_brings_all_others(tmp_path, monkeypatch, kind):
    notebook = json.dumps({"cells": [{"id": "a", "cell_type": "code", "source": "1"}]})
    monkeypatch.setattr(notebook_copies, "blank_notebooks", lambda: {"01_a.ipynb": notebook, "02_b.ipynb": notebook})
    IN_THE_WAY[kind](tmp_path / "01_a.ipynb")
    before = os.lstat(tmp_path / "01_a.ipynb")
    said = ["01_a.ipynb cannot be read as a notebook and is left as it is", "02_b.ipynb is new"]
    assert notebook_copies.update(tmp_path) == said
    assert notebook_copies.update(tmp_path) == said[:1] and notebook_copies.give(tmp_path) == []
    after = os.lstat(tmp_path / "01_a.ipynb")
    assert (before.st_ino, before.st_mode) == (after.st_ino, after.st_mode)
    assert "is as in the beginning; yours is kept" in notebook_copies.fresh_copy(tmp_path / "01_a.ipynb", "x", "01_a")


@pytest.mark.parametrize(
    "words",
    [
        ["calibrate", "pivot", "PIPE"],
        ["calibrate", "hand-eye", "--robot", "PIPE", "--sensor", "PIPE"],
        ["localize", "--odometry", "PIPE", "--landmarks", "PIPE", "--measurements", "PIPE"],
        ["collect", "PIPE", "--points", "PIPE"],
        ["collect", "PIPE", "--names", "PIPE"],
        ["collect", "--one", "PIPE"],
    ],
    ids=lambda words: f"{words[0]} {words[-2]}",
)
def test_a_verb_refuses_it_in_a_sentence(pipe, tmp_path, monkeypatch, capsys, words):
    monkeypatch.chdir(tmp_path)
    path = str(pipe("robot.csv"))
    assert main([path if word == "PIPE" else word for word in words]) == 1
    told = capsys.readouterr().err
    assert told.count("\n") == 1 and NONE in told


def test_submissions_that_are_none_are_named_and_not_opened(pipe, tmp_path, monkeypatch, capsys):
    (tmp_path / "class").mkdir()
    monkeypatch.chdir(tmp_path)
    for name in ("class/01_frames.ipynb", "class/all.zip"):
        pipe(name)
    assert main(["collect", "class", str(pipe("alone")), "--out", "out"]) == 0
    problems = (tmp_path / "out" / "problems.csv").read_text(encoding="utf-8")
    assert NONE in problems and f"cannot be unpacked: {NONE}" in problems and "neither a file nor a folder" in problems
    assert str(tmp_path) not in problems


def test_what_labkit_wrote_itself_may_have_been_replaced(pipe, tmp_path, monkeypatch):
    monkeypatch.setenv("LABKIT_PROGRESS", str(pipe("progress.jsonl")))
    assert progress.events() == []
    (tmp_path / "judged").mkdir()
    pipe("judged/abc.json")
    assert batch.known(tmp_path, "abc", 1) is None
    with pytest.raises(OSError, match=NONE):
        notes.counted(tmp_path)
    with pytest.raises(OSError, match=NONE):
        build.keep_pictures(None, pipe("01_a.ipynb"))


def test_functions_that_take_a_path_refuse_it(pipe):
    for read, name in (
        (read_csv, "log.csv"),
        (read_questions, "own.toml"),
        (lambda path: OccupancyGrid.from_png(path, 0.1), "map.png"),
    ):
        with pytest.raises(OSError, match=NONE):
            read(pipe(name))
