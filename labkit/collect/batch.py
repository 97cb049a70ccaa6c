"""One file in, one JSON out; and many of them at once, each in a process of its own, kept for the next time."""

import contextlib
import functools
import hashlib
import json
import multiprocessing.connection
import os
import re
import secrets
import signal
import sys
import threading
import time
from pathlib import Path

from ..exercises.engine import Prediction
from ..exercises.outcome import CORRECT, NOT_YET, RAISED, TO_DO
from ..reading import regular
from . import judge, library, sandbox, submissions
from .submissions import Unreadable

STATUS = {CORRECT: "correct", NOT_YET: "wrong", RAISED: "raised", TO_DO: "unfinished"}
HARDEST = judge.WHOLE + 120.0  # seconds after which a judge is ended from outside
MEMORY = 4 << 30  # bytes that a judge may use


@functools.cache
def edition():
    """What tells one version of the exercises and of the judge from another: results of an older one are not taken."""
    whole = hashlib.sha256()
    for path in sorted(sandbox.PACKAGE.rglob("*.py")):
        whole.update(path.read_bytes())
    return whole.hexdigest()[:16]


def judged(data, seed):
    """What is found out about one file, as plain data: its chapter and a verdict on every exercise, or why not."""
    digest = submissions.digest(data)
    result = {"digest": digest, "seed": seed, "edition": edition(), "sandbox": sandbox.sentence()}
    try:
        notebook = submissions.parse(data)
    except Unreadable as reason:
        return {**result, "unreadable": str(reason)}
    chapter = library.load(notebook.chapter)
    verdicts = judge.judge(chapter, notebook.cells, seed, digest)
    items = {item.id: _verdict(item, verdicts, notebook) for item in chapter.items}
    cells = [f"code cell {number + 1} raised {error}" for number, error in verdicts.failed]
    return {
        **result,
        "chapter": chapter.name,
        "items": items,
        "minutes": notebook.minutes,
        "cells": cells,
        "stopped": verdicts.stopped,
    }


def _verdict(item, verdicts, notebook):
    if isinstance(item, Prediction):
        choice, right = verdicts.predictions.get(item.id, (None, False))
        return (
            {"status": "no prediction"} if choice is None else {"status": "predicted", "choice": choice, "right": right}
        )
    outcome = verdicts.outcomes.get(item.id)
    if outcome is None:
        return {"status": judge.NOT_REACHED, "text": _why_not_reached(item.id, verdicts, notebook)}
    verdict = {"status": STATUS.get(outcome.status, outcome.status), "text": outcome.text}
    if outcome.mistake is not None:
        verdict["mistake"] = item.mistakes[outcome.mistake].id
    elif item.id in verdicts.alike and verdicts.alike[item.id]:
        verdict["alike"] = verdicts.alike[item.id]
    return verdict


def _why_not_reached(id, verdicts, notebook):
    own = [k for k, source in enumerate(notebook.cells) if re.search(rf"(?<![\w.])ex\.{id}\b", source)]
    if not own:
        return f"no cell of the notebook checks `{id}`."
    errors = {number: error for number, error in verdicts.failed}
    raised = next((errors[k] for k in own if k in errors), None)
    return f"its cell raised {raised}" if raised else "its cell was not run to its end."


def judge_file(path, seed, folder):
    """`--one`: the JSON of one notebook file, written into `folder`; returns its path."""
    data = regular(path).read_bytes()
    return _write(folder, judged(data, seed))


def _write(folder, result):
    target = place(folder, result["digest"])
    target.parent.mkdir(parents=True, exist_ok=True)
    partial = target.with_suffix(f".{os.getpid()}.partial")
    partial.write_text(
        json.dumps(result, indent=1, sort_keys=True, ensure_ascii=False) + "\n", encoding="utf-8", newline="\n"
    )
    os.replace(partial, target)
    return target


def place(folder, digest):
    """Where the result on a file of this content lies."""
    return Path(folder) / "judged" / f"{digest[:20]}.json"


def known(folder, digest, seed):
    """The stored result on a file, if it was judged with this seed by this edition; else None."""
    try:
        result = json.loads(regular(place(folder, digest)).read_text(encoding="utf-8"))
        fresh = (result["digest"], result["seed"], result["edition"]) == (digest, seed, edition())
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return result if fresh else None


def seed_of(folder, wanted=None):
    """The seed of all draws: the wanted one, else the one this folder has, else a new one nobody can guess."""
    file = Path(folder) / "seed.txt"
    if wanted is None:
        try:
            return int(regular(file).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            wanted = secrets.randbelow(2**62)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(f"{wanted}\n", encoding="utf-8")
    return wanted


def judge_all(files, seed, folder, jobs, say):
    """Judge all files that are not known yet; `say` shows how far it is. Returns {digest: why} of those that failed.

    `files` are (digest, function that gives the bytes). A process that dies or hangs fails alone.
    """
    waiting = [(digest, read) for digest, read in files if known(folder, digest, seed) is None]
    context = multiprocessing.get_context("fork" if sys.platform.startswith("linux") else "spawn")
    running, failed, done, begun = {}, {}, 0, time.monotonic()
    total = len(waiting)
    sandbox.bubblewrap(), edition()
    with _interrupt_noted() as interrupted:
        try:
            while waiting or running:
                while waiting and len(running) < jobs and not interrupted:
                    digest, read = waiting.pop(0)
                    process = context.Process(target=_work, args=(read(), seed, str(folder)), daemon=False)
                    process.start()
                    running[process] = digest, time.monotonic()
                multiprocessing.connection.wait([process.sentinel for process in running], timeout=1.0)
                if interrupted:
                    raise KeyboardInterrupt
                for process in [p for p, (_, start) in running.items() if not p.is_alive() or _is_late(start)]:
                    digest, start = running.pop(process)
                    _end(process)
                    done += 1
                    if known(folder, digest, seed) is None:
                        failed[digest] = (
                            "took too long" if _is_late(start) else f"ended its judge (exit code {process.exitcode})"
                        )
                    say(done, total, (time.monotonic() - begun) / done * (total - done))
        finally:
            for process in running:
                _end(process)
    return failed


@contextlib.contextmanager
def _interrupt_noted():
    """A list that Ctrl-C makes true; raised in the moment in which a process is forked, the interrupt would be lost."""
    noted, before = [], None
    if threading.current_thread() is threading.main_thread():
        before = signal.signal(signal.SIGINT, lambda *_: noted.append(True))
    try:
        yield noted
    finally:
        if before is not None:
            signal.signal(signal.SIGINT, before)


def _is_late(start):
    return time.monotonic() - start > HARDEST


def _end(process):
    if process.is_alive():
        process.kill()
    process.join()


def _work(data, seed, folder):
    """A judge's process: limits its own memory, for it computes with what a submission asks for.

    A terminal sends Ctrl-C to all processes; the first one ends the others.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    except (ImportError, ValueError, OSError):
        pass
    _write(folder, judged(data, seed))
