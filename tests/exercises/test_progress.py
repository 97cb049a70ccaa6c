"""Progress in the reader's home: taken over, kept apart, said once where it cannot be kept; damage and locks."""

import json
import os
import sys
from types import SimpleNamespace

import pytest

from labkit.exercises import progress, session


@pytest.fixture
def reader(tmp_path, monkeypatch):
    """A function that lets another reader, with a home of his own, sit down at this installation."""
    monkeypatch.delenv("LABKIT_PROGRESS")
    monkeypatch.setattr(progress, "OLD", tmp_path / "shared" / ".lab" / "progress.jsonl")
    monkeypatch.setattr(progress, "_told", set())

    def sit_down(name):
        monkeypatch.setattr(progress, "home", lambda: tmp_path / name / "labkit")
        return tmp_path / name / "labkit" / "progress.jsonl"

    return sit_down


def old_file(*ids):
    progress.OLD.parent.mkdir(parents=True, exist_ok=True)
    lines = [json.dumps({"chapter": "01-frames", "exercise": id, "event": "correct"}) for id in ids]
    progress.OLD.write_text("\n".join(lines) + "\n", encoding="utf-8")


def test_it_lies_where_the_system_keeps_data_of_programs(monkeypatch, tmp_path):
    monkeypatch.delenv("LABKIT_PROGRESS")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    if sys.platform.startswith("linux"):
        assert progress.path() == tmp_path / "data" / "labkit" / "progress.jsonl"
    assert progress.path().name == "progress.jsonl" and progress.path().parent.name == "labkit"


def test_two_readers_of_one_installation_keep_apart(reader):
    reader("ada")
    progress.record("01-frames", "invert", "correct")
    reader("bob")
    assert progress.solved() == set()
    progress.record("01-frames", "distance", "correct")
    reader("ada")
    assert progress.solved() == {("01-frames", "invert")}


def test_the_old_file_is_taken_over_once(reader):
    file = reader("ada")
    old_file("invert", "distance")
    assert progress.solved() == {("01-frames", "invert"), ("01-frames", "distance")}
    assert not progress.OLD.exists() and progress.OLD.with_name("progress.taken-over.jsonl").exists()
    progress.record("01-frames", "angle", "correct")
    assert len(progress.events()) == 3 == len(file.read_text(encoding="utf-8").splitlines())


def test_an_old_file_that_cannot_be_moved_is_copied_by_its_owner_once(reader, monkeypatch):
    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    reader("ada")
    old_file("invert")
    monkeypatch.setattr(progress.os, "replace", refuse)
    assert len(progress.events()) == len(progress.events()) == 1 and progress.OLD.exists()
    reader("bob")
    monkeypatch.setattr(progress, "_is_mine", lambda file: False)
    assert progress.events() == []


def test_a_folder_that_cannot_be_written_is_said_once(reader, tmp_path, capsys):
    (tmp_path / "ada").write_text("a file where the home should be", encoding="utf-8")
    reader("ada")
    for _ in range(3):
        progress.record("01-frames", "invert", "correct")
    said = capsys.readouterr().out
    assert said.count("\n") == 1 and f"because {tmp_path / 'ada' / 'labkit'} cannot be written" in said
    assert progress.solved() == set() and "0 of" in session.progress_text()


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full here")
def test_a_full_disk_is_said_and_nothing_stops(monkeypatch, capsys):
    monkeypatch.setenv("LABKIT_PROGRESS", "/dev/full")
    monkeypatch.setattr(progress, "_told", set())
    monkeypatch.setattr(progress, "_cut_off", lambda handle: False)
    progress.record("01-frames", "invert", "correct")
    assert "No space left" in capsys.readouterr().out


@pytest.mark.parametrize(
    "line",
    ['{"chapter": [1], "exercise": "a", "event": "correct"}', "[" * 100_000, '{"chapter": "c"}', "3", "\x00", '"a"',
     '{"chapter": "c", "exercise": {}, "event": "correct"}', '{"chapter": "c", "exercise": "a", "event": 7}'],
)  # fmt: skip
def test_damaged_lines_are_passed_over(line):
    progress.path().write_text(f"{line}\n", encoding="utf-8")
    progress.record("01-frames", "invert", "correct")
    assert progress.solved() == {("01-frames", "invert")} and "1 of" in session.progress_text()


def test_where_locks_are_mandatory_no_reader_meets_one_and_a_writer_waits(monkeypatch):
    """Windows, emulated: the locked byte lies far beyond the end, and a lock that is held is asked for again."""
    places, refusals = [], [OSError(13, "held")] * 3

    def locking(handle, mode, count):
        places.append((os.lseek(handle, 0, os.SEEK_CUR), mode, count))
        if mode == 1 and refusals:
            raise refusals.pop()

    monkeypatch.setitem(sys.modules, "fcntl", None)
    monkeypatch.setitem(sys.modules, "msvcrt", SimpleNamespace(locking=locking, LK_NBLCK=1, LK_UNLCK=0))
    progress.record("01-frames", "invert", "correct")
    assert places == [(progress.LOCKED_BYTE, 1, 1)] * 4 + [(progress.LOCKED_BYTE, 0, 1)]
    assert progress.solved() == {("01-frames", "invert")} and progress.path().stat().st_size < 100
