"""What the student has done: one line of JSON an event, only ever appended, in `.lab/progress.jsonl`.

Two kernels may write at once: each event is a single locked append. A broken line (a full disk, an edit by hand) is
skipped when reading.
"""

import contextlib
import json
import os
from pathlib import Path

from ..tables import DATA

DEFAULT = DATA.parent / ".lab" / "progress.jsonl"


def path():
    """Where the events go; the environment variable LABKIT_PROGRESS moves it (the tests do)."""
    return Path(os.environ.get("LABKIT_PROGRESS", DEFAULT))


def record(chapter, exercise, event, **details):
    """Append one event; a checkout that cannot be written to is no reason to stop a lesson."""
    line = json.dumps({"chapter": chapter, "exercise": exercise, "event": event, **details}) + "\n"
    with contextlib.suppress(OSError):
        file = path()
        file.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(file, os.O_APPEND | os.O_CREAT | os.O_RDWR, 0o644)
        try:
            with _locked(handle):
                os.write(handle, (("\n" if _cut_off(handle) else "") + line).encode())
        finally:
            os.close(handle)


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

        os.lseek(handle, 0, os.SEEK_SET)
        msvcrt.locking(handle, msvcrt.LK_LOCK, 1)
        try:
            yield
        finally:
            os.lseek(handle, 0, os.SEEK_SET)
            msvcrt.locking(handle, msvcrt.LK_UNLCK, 1)
    else:
        fcntl.flock(handle, fcntl.LOCK_EX)
        try:
            yield
        finally:
            fcntl.flock(handle, fcntl.LOCK_UN)


def events():
    """All readable events, oldest first."""
    try:
        lines = path().read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return []
    found = []
    for line in lines:
        with contextlib.suppress(ValueError):
            event = json.loads(line)
            if isinstance(event, dict) and {"chapter", "exercise", "event"} <= event.keys():
                event["chapter"] = str(event["chapter"]).replace("_", "-")  # older files say 05-hand_eye
                found.append(event)
    return found


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
