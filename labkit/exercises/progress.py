"""What the student has done: one line of JSON an event, only ever appended, in a file of the reader's home.

Two kernels may write at once: each event is a single locked append. A broken line (a full disk, an edit by hand) is
skipped when reading. Earlier editions kept the file in the checkout, `.lab/progress.jsonl`: its owner takes it along.
"""

import contextlib
import json
import os
import time
from pathlib import Path

from ..places import ROOT
from ..reading import regular

OLD = ROOT / ".lab" / "progress.jsonl"
LOCKED_BYTE = 1 << 40  # far beyond the end: where locks are mandatory (Windows), no reader meets it
_told = set()


def path():
    """Where the events go; the environment variable LABKIT_PROGRESS moves it (the tests do)."""
    moved = os.environ.get("LABKIT_PROGRESS")
    return Path(moved) if moved else home() / "progress.jsonl"


def home():
    """The folder of this workbook in the reader's home, where the system keeps the data of programs."""
    import platformdirs

    return Path(platformdirs.user_data_dir("labkit", appauthor=False))


def record(chapter, exercise, event, **details):
    """Append one event; where that cannot be, a line says so once, and the lesson goes on."""
    line = json.dumps({"chapter": chapter, "exercise": exercise, "event": event, **details}) + "\n"
    try:
        _take_over_old()
        _append(path(), line)
    except OSError as error:
        _tell_once(error)


def _append(file, text):
    file.parent.mkdir(parents=True, exist_ok=True)
    handle = os.open(file, os.O_APPEND | os.O_CREAT | os.O_RDWR | getattr(os, "O_BINARY", 0), 0o600)
    try:
        with _locked(handle):
            data = (("\n" if _cut_off(handle) else "") + text).encode()
            while data:
                data = data[os.write(handle, data) :]
    finally:
        os.close(handle)


def _tell_once(error):
    folder = path().parent
    if folder not in _told:
        _told.add(folder)
        reason = error.strerror or str(error)
        print(f"What you solve is not remembered, because {folder} cannot be written ({reason}). All else works.")


def _take_over_old():
    """Append the events of an earlier edition's file to the home's, and put it out of the way; by its owner alone."""
    if os.environ.get("LABKIT_PROGRESS") or not OLD.exists() or not _is_mine(OLD):
        return
    taken = OLD.with_name("progress.taken-over.jsonl")
    try:
        os.replace(OLD, taken)  # of two kernels one succeeds
    except OSError:  # a folder that cannot be written: then its events are taken along by whoever has none yet
        if path().exists():
            return
        taken = OLD
    with contextlib.suppress(OSError):
        _append(path(), regular(taken).read_text(encoding="utf-8", errors="replace"))


def _is_mine(file):
    return not hasattr(os, "getuid") or file.stat().st_uid == os.getuid()


def _cut_off(handle):
    """Whether the file ends in the middle of a line: the next event must not be lost with it."""
    end = os.lseek(handle, 0, os.SEEK_END)
    if not end:
        return False
    os.lseek(handle, end - 1, os.SEEK_SET)
    return os.read(handle, 1) != b"\n"


@contextlib.contextmanager
def _locked(handle):
    try:
        import fcntl
    except ImportError:
        import msvcrt

        _seize(handle, msvcrt)
        try:
            yield
        finally:
            os.lseek(handle, LOCKED_BYTE, os.SEEK_SET)
            msvcrt.locking(handle, msvcrt.LK_UNLCK, 1)
    else:
        fcntl.flock(handle, fcntl.LOCK_EX)
        try:
            yield
        finally:
            fcntl.flock(handle, fcntl.LOCK_UN)


def _seize(handle, msvcrt, seconds=60):
    """Windows' own waiting gives up after ten seconds, and the event would be lost."""
    deadline = time.monotonic() + seconds
    while True:
        os.lseek(handle, LOCKED_BYTE, os.SEEK_SET)
        try:
            return msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        except OSError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.05)


def events():
    """All readable events, oldest first."""
    with contextlib.suppress(OSError):
        _take_over_old()
    try:
        lines = regular(path()).read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return []
    return [event for event in map(_read, lines) if event]


def _read(line):
    """The event of a line, or None where the line is damaged."""
    try:
        event = json.loads(line)
    except (ValueError, RecursionError):
        return None
    keys = ("chapter", "exercise", "event")
    if not isinstance(event, dict) or not all(isinstance(event.get(key), str) for key in keys):
        return None
    return {**event, "chapter": event["chapter"].replace("_", "-")}  # older files say 05-hand_eye


def of(chapter, exercise):
    """The events of one exercise since it was last started over."""
    mine = [e for e in events() if (e["chapter"], e["exercise"]) == (chapter, exercise)]
    starts = [k for k, e in enumerate(mine) if e["event"] == "reset"]
    return mine[starts[-1] + 1 :] if starts else mine


def solved():
    """The (chapter, exercise) pairs whose checks have passed and were not started over since."""
    done = set()
    for e in events():
        key = (e["chapter"], e["exercise"])
        if e["event"] == "reset":
            done.discard(key)
        elif e["event"] in ("correct", "predicted"):
            done.add(key)
    return done
