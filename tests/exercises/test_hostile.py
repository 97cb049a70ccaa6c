# ruff: noqa: NPY002, SIM105 (hostile student code, on purpose)
"""What student code may do to a process: it gets one sentence, and the process is what it was."""

import builtins
import decimal
import gc
import json
import locale
import logging
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from labkit.exercises import guard, kept, metrics, session
from labkit.exercises.engine import Exercise
from labkit.exercises.feedback import Panel
from labkit.exercises.outcome import CORRECT, NOT_YET, RAISED
from labkit.exercises.value import Value

DOUBLE = Exercise(
    "double",
    reference=lambda v: 2 * v,
    draw=lambda rng: (rng.normal(size=3),),
    metric=metrics.Numbers(1e-9),
    hints=("a", "b", "c"),
    limit=0.5,
)
ANGLE = Value("angle_deg", reference=lambda: 12.5, unit="deg", hints=("a", "b", "c"))


class Evil(Exception):
    def __str__(self):
        raise ValueError("no message")


class Endless(Exception):
    def __str__(self):
        while True:
            pass


class Leaving(Exception):
    def __str__(self):
        print("said from __str__")
        sys.exit()


def raising(error):
    def double(v):
        raise error

    return double


def deep(v):
    sys.setrecursionlimit(10**9)

    def down():
        return down()

    return down()


async def waiting(v):
    return 2 * v


def swallowing_in_a_loop_of_numpy(v):
    while True:
        try:
            np.linalg.norm(v)
        except BaseException:
            continue


def swallowing_twice(v):
    while True:
        try:
            try:
                time.sleep(0.2)
            except BaseException:
                pass
        except BaseException:
            pass


@pytest.mark.parametrize(
    ("function", "status", "words"),
    [
        (raising(Evil()), RAISED, "Evil: (its message cannot be shown)"),
        (raising(Endless()), RAISED, "Endless: (its message cannot be shown)"),
        (raising(Leaving()), RAISED, "Leaving: (its message cannot be shown)"),
        (raising(ValueError("half a letter \ud800")), RAISED, "half a letter \\ud800"),
        (raising(MemoryError()), RAISED, "more memory than there is"),
        (raising(KeyboardInterrupt()), RAISED, "the check was interrupted"),
        (raising(ValueError()), RAISED, "ValueError: it says no more"),
        (deep, RAISED, "calls itself again and again"),
        (waiting, NOT_YET, "leave out `async`"),
        (lambda v: 2j * v, NOT_YET, "complex"),
        (swallowing_in_a_loop_of_numpy, NOT_YET, "did not finish within 0.5 s"),
        (swallowing_twice, NOT_YET, "did not finish within 0.5 s"),
    ],
)
def test_one_sentence_within_three_seconds(function, status, words, capsys):
    begun = time.monotonic()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        outcome = DOUBLE.judge(function)
    assert (outcome.status, words in outcome.text) == (status, True), outcome
    json.dumps(outcome.text, ensure_ascii=False).encode()
    assert time.monotonic() - begun < 3 * guard.PATIENCE and capsys.readouterr().out == ""


class Unreadable(float):
    def __float__(self):
        raise RuntimeError("read me not")


HELD_BY_ITSELF = []
HELD_BY_ITSELF.append(HELD_BY_ITSELF)


@pytest.mark.parametrize("result", [Unreadable(1.0), HELD_BY_ITSELF, 10**400, [Unreadable(1.0)] * 3])
def test_what_cannot_be_read_as_numbers_gets_a_sentence(result):
    outcome = DOUBLE.judge(lambda v: result)
    assert outcome.status == NOT_YET and outcome.text.startswith("expected an array of shape (3,), got ")
    assert "decimal" not in ANGLE.judge(result).text


def test_what_has_no_copy_is_no_number():
    assert "still to be computed" in ANGLE.judge(v for v in [12.5]).text


def test_of_a_message_as_long_as_an_array_the_beginning_is_told():
    begun = time.process_time()
    assert len(DOUBLE.judge(raising(ValueError("x" * 10**7))).text) < 1000
    assert time.process_time() - begun < 3


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")  # pytest tells what Python does not
def test_a_thread_that_is_left_behind_ends():
    started = []

    def burning():
        while True:
            pass

    def double(v):
        started.append(threading.Thread(target=burning, daemon=True))
        started[-1].start()
        return 2 * v

    assert DOUBLE.judge(double).status == CORRECT and len(started) > 2
    for thread in started:
        thread.join(30)
    assert not any(thread.is_alive() for thread in started)


def test_a_thread_that_a_library_keeps_for_later_goes_on_and_what_it_was_left_with_ends():
    """A pool whose threads have ended never answers again: at the second draw the right answer would seem endless."""

    def endless():
        while True:
            pass

    with ThreadPoolExecutor(1) as pool, ThreadPoolExecutor(1) as left:
        burning = []

        def double(v):
            burning.append(left.submit(endless))
            return pool.submit(np.multiply, 2, v).result()

        assert DOUBLE.judge(double).status == CORRECT and pool.submit(abs, -1).result(30) == 1
        assert all(isinstance(task.exception(30), SystemExit) for task in burning)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_timer_of_the_student_never_rings():
    rung, timers = [], []

    def double(v):
        timers.append(threading.Timer(3.0, rung.append, [1]))
        timers[-1].start()
        return 2 * v

    assert DOUBLE.judge(double).status == CORRECT
    for timer in timers:
        timer.join(30)
    assert rung == [] and len(timers) > 2


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="only Linux tells which programs have been started")
def test_programs_that_a_check_leaves_behind_end_and_others_go_on():
    words = [sys.executable, "-c", "import time; time.sleep(60)"]
    own = subprocess.Popen(words)
    with kept.a_check():
        left = subprocess.Popen(words)
    assert own.poll() is None and not Path(f"/proc/{left.pid}").exists()
    own.kill()
    own.wait()
    left.wait()


def test_half_letters_that_are_printed_reach_no_page():
    def double(v):
        print("\udfff")
        return v

    outcome = DOUBLE.judge(double)
    assert outcome.printed == "\\udfff\n"
    Panel("double", [outcome.printed]).html().encode()


def test_what_a_check_touches_is_put_back():
    def read():
        state = [get() for get, _ in kept.STATE]
        return [s[1].tolist() if isinstance(s, tuple) and len(s) == 5 else s for s in state]

    def careless(v):
        np.random.seed(0)
        np.seterr(all="raise")
        np.seterrcall(print)
        sys.setrecursionlimit(5000)
        sys.path.append("nowhere")
        os.environ["PATH"] = "nowhere"
        os.environ["NEW"] = "1"
        os.umask(0o777)
        os.chdir("/")
        gc.disable()
        locale.setlocale(locale.LC_ALL, "C")
        if hasattr(signal, "pthread_sigmask"):
            signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGUSR1])
        warnings.simplefilter("error")
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        decimal.getcontext().prec = 2
        logging.warning("the first one makes a handler for what is standard error at that moment")
        logging.disable()
        gc.set_threshold(1)
        gc.callbacks.append(lambda *_: None)
        sys.excepthook = sys.displayhook = print
        sys.setswitchinterval(1.0)
        socket.setdefaulttimeout(0.001)
        threading.settrace(lambda *_: None)
        return 2 * v

    before, filters = read(), list(warnings.filters)
    assert DOUBLE.judge(careless).status == CORRECT
    assert read() == before and "NEW" not in os.environ and warnings.filters == filters


@pytest.mark.parametrize(
    ("owner", "name", "shown"),
    [
        (np.random, "default_rng", "numpy.random.default_rng"),
        (builtins, "print", "builtins.print"),
        (builtins, "len", "builtins.len"),
        (json, "dumps", "json.dumps"),
        (time, "sleep", "time.sleep"),
        (metrics.Poses, "equal", "labkit.exercises.metrics.Poses.equal"),
        (Exercise, "judge", "labkit.exercises.engine.Exercise.judge"),
    ],
)
def test_what_is_replaced_is_put_back_and_named(owner, name, shown, capsys):
    ex, original = session.course("01-frames"), getattr(owner, name)
    guard.PRISTINE.drain()  # what other tests replaced

    def invert(T):
        setattr(owner, name, lambda *_, **__: None)
        return T

    ex.invert(invert)
    assert getattr(owner, name) is original
    said = capsys.readouterr().out
    assert f"Replaced in the library, and put back: {shown}" in said


@pytest.mark.skipif(not hasattr(time, "tzset"), reason="time zones are set on POSIX")
def test_a_time_zone_that_was_set_is_put_back_and_is_no_replaced_library():
    def double(v):
        os.environ["TZ"] = "Asia/Tokyo"
        time.tzset()
        return 2 * v

    before = time.localtime(0)
    guard.PRISTINE.look()
    guard.PRISTINE.drain()
    assert DOUBLE.judge(double).status == CORRECT
    assert time.localtime(0) == before and not [n for n in guard.PRISTINE.drain() if n.startswith("time.")]


def test_a_module_thrown_out_comes_back(capsys):
    ex = session.course("01-frames")

    def invert(T):
        del sys.modules["numpy"]
        return T

    ex.invert(invert)
    assert sys.modules["numpy"] is np and "put back: numpy" in capsys.readouterr().out


def test_a_folder_that_is_gone_changes_no_verdict(tmp_path, monkeypatch):
    folder = tmp_path / "gone"
    folder.mkdir()
    monkeypatch.chdir(folder)
    folder.rmdir()
    assert DOUBLE.judge(lambda v: 2 * v).status == CORRECT


def test_a_kernel_may_end_with_its_parent_while_a_check_runs(monkeypatch):
    """ipykernel watches its parent in a thread of its own and leaves by os._exit: that must get through."""
    left = []
    monkeypatch.setattr(os, "_exit", left.append)

    def double(v):
        thread = threading.Thread(target=lambda: os._exit(1))
        thread.start()
        thread.join()
        os._exit(0)

    assert "os._exit()" in DOUBLE.judge(double).text and left == [1]


def test_a_check_within_a_check_is_refused_and_the_next_one_runs(capsys):
    ex = session.course("01-frames")

    def invert(T):
        return ex.invert(invert)

    for _ in range(2):
        ex.invert(invert)
        assert "calls ex.invert(), which a checked function must not do" in " ".join(capsys.readouterr().out.split())


def test_a_decimal_comma_is_named():
    assert "written with a point, 12.5, and not 12,5" in ANGLE.judge(12, 5).text


def test_without_interval_timers_no_limit_leaks_into_what_follows(monkeypatch):
    """Windows, emulated: a second thread raises the limit, and never again once the check is over."""
    monkeypatch.delattr(guard.signal, "setitimer", raising=False)
    for _ in range(3):
        outcome = guard.run(lambda: [i for i in iter(int, 1)], (), limit=0.2)
        assert isinstance(outcome.error, guard.TimeLimit)
        until = time.monotonic() + 5 * guard.PERIOD
        while time.monotonic() < until:
            pass
    assert threading.active_count() < 20


def test_without_interval_timers_swallowed_limits_end_too(monkeypatch):
    """What swallows every limit meets one at each line, there as well: the second thread cannot do it, the swallowed
    error in the thread that swallows can.
    """

    def swallows():
        until = time.thread_time() + 2
        while time.thread_time() < until:
            try:
                time.sleep(0.001)
            except BaseException:
                pass

    monkeypatch.delattr(guard.signal, "setitimer", raising=False)
    monkeypatch.setattr(guard, "PERIOD", 0.005)
    outcome = guard.run(swallows, (), limit=0.05)
    assert isinstance(outcome.error, guard.TimeLimit) and sys.gettrace() is None and not guard.TimeLimit.relentless
