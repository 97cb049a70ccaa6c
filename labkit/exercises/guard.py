"""Running student code so that nothing it does reaches the notebook: time, output, exits, seeds, patches.

Student code is hostile by accident. `run` calls a function on copies of its arguments and reports what happened;
whatever the code changed in NumPy, in the interpreter or in labkit is put back.
"""

import builtins
import contextlib
import copy
import ctypes
import io
import os
import random
import signal
import sys
import threading
import traceback
import warnings
from dataclasses import dataclass, field

import numpy as np

TIME_LIMIT = 2.0  # seconds a single call may take
OUTPUT_LIMIT = 2000  # characters of printed text that are kept
PROTECTED = ("numpy", "numpy.linalg", "math")


class TimeLimit(BaseException):
    """Raised inside student code that runs too long; no Exception, so that `except Exception` does not swallow it."""


class Forbidden(BaseException):
    """Raised inside student code that wants the keyboard or the end of the process."""


@dataclass
class Run:
    """What one call did: its result or its error, what it printed, which arguments it changed."""

    result: object = None
    error: BaseException | None = None
    line: str = ""
    printed: str = ""
    changed: list = field(default_factory=list)


class _Capture(io.TextIOBase):
    """Standard output that keeps the first characters and counts the rest."""

    def __init__(self):
        self.text, self.lost = "", 0

    def write(self, text):
        room = OUTPUT_LIMIT - len(self.text)
        self.text += text[:room]
        self.lost += max(0, len(text) - room)
        return len(text)

    def value(self):
        more = f"\n... and {self.lost} more characters" if self.lost else ""
        return self.text + more


class Pristine:
    """Remembers what labkit's modules (and the NumPy names they use) held at first sight, and puts it back."""

    def __init__(self):
        self.saved = {}
        self.replaced = []

    def look(self):
        """Remember every module of labkit that has been loaded since the last look."""
        for name, module in list(sys.modules.items()):
            ours = name == "labkit" or name.startswith("labkit.") or name in PROTECTED
            if ours and name not in self.saved and module is not None:
                self.saved[name] = (vars(module), dict(vars(module)))

    def restore(self):
        """Put back what was replaced, and note the names, e.g. "labkit.geometry.frames.invert", in `replaced`."""
        for name, (now, then) in self.saved.items():
            for key, value in then.items():
                if now.get(key, self) is not value and key != "__warningregistry__":
                    now[key] = value
                    self.replaced.append(f"{name}.{key}")

    def drain(self):
        """The names noted since the last call, each once."""
        names, self.replaced = sorted(set(self.replaced)), []
        return names


PRISTINE = Pristine()


@contextlib.contextmanager
def time_limit(seconds):
    """Raise `TimeLimit` in this thread after so many seconds, and again and again if the code swallows it.

    Where the platform has interval timers (Linux, macOS) and this is the main thread, a signal does it, which also ends
    a sleep. Elsewhere a second thread raises it between two lines of Python; a single call into compiled code cannot
    be stopped there.
    """
    if hasattr(signal, "setitimer") and threading.current_thread() is threading.main_thread():
        yield from _limit_by_signal(seconds)
    else:
        yield from _limit_by_thread(seconds)


def _limit_by_signal(seconds):
    active = True

    def ring(*_):
        if active:
            raise TimeLimit

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds, 0.05)
    try:
        yield
    finally:
        active = False
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def _limit_by_thread(seconds):
    target = ctypes.c_ulong(threading.get_ident())
    lock, done = threading.Lock(), threading.Event()

    def watch():
        wait = seconds
        while not done.wait(wait):
            wait = 0.05
            with lock:
                if not done.is_set():
                    ctypes.pythonapi.PyThreadState_SetAsyncExc(target, ctypes.py_object(TimeLimit))

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield
    finally:
        with lock:
            done.set()
            ctypes.pythonapi.PyThreadState_SetAsyncExc(target, None)


def _forbid(what):
    def refuse(*_, **__):
        raise Forbidden(what)

    return refuse


@contextlib.contextmanager
def _replaced(owner, name, value):
    """Set an attribute for a while; nothing happens where the owner does not have it."""
    if not hasattr(owner, name):
        yield
        return
    before = getattr(owner, name)
    setattr(owner, name, value)
    try:
        yield
    finally:
        setattr(owner, name, before)


@contextlib.contextmanager
def sandbox(capture):
    """Everything student code may touch, put back afterwards."""
    state, python_state = np.random.get_state(), random.getstate()  # noqa: NPY002 (what students may seed)
    err = np.geterr()
    options, depth, folder = np.get_printoptions(), sys.getrecursionlimit(), os.getcwd()
    with contextlib.ExitStack() as stack:
        stack.enter_context(warnings.catch_warnings())
        warnings.simplefilter("ignore")
        stack.enter_context(contextlib.redirect_stdout(capture))
        stack.enter_context(contextlib.redirect_stderr(capture))
        stack.enter_context(_replaced(builtins, "input", _forbid("input()")))
        stack.enter_context(_replaced(builtins, "breakpoint", _forbid("breakpoint()")))
        for name in ("_exit", "abort", "kill", "fork", "execv"):
            stack.enter_context(_replaced(os, name, _forbid(f"os.{name}()")))
        stack.enter_context(_replaced(_shell(), "ask_exit", _forbid("exit()")))
        try:
            yield
        finally:
            np.random.set_state(state)  # noqa: NPY002
            random.setstate(python_state)
            np.seterr(**err)
            np.set_printoptions(**options)
            sys.setrecursionlimit(depth)
            if os.getcwd() != folder:
                os.chdir(folder)


def _shell():
    """The IPython shell, where there is one: `exit()` in a notebook is its method, not Python's."""
    ipython = sys.modules.get("IPython")
    return ipython.get_ipython() if ipython else None


def run(function, args, finish=lambda result: result, limit=TIME_LIMIT, author=None):
    """Call `function` on copies of `args`, and `finish` on its result, both guarded.

    `finish` is where a result is converted: a returned object may be as hostile as the function itself. `author` is the
    function whose line is quoted when it raises, if another one than `function`. The first import of a library may
    take longer than a call: then it is called once more.
    """
    known = len(sys.modules)
    outcome = _run_once(function, args, finish, limit, author or function)
    if isinstance(outcome.error, TimeLimit) and len(sys.modules) > known:
        outcome = _run_once(function, args, finish, limit, author or function)
    return outcome


def _run_once(function, args, finish, limit, author):
    given = copy.deepcopy(args)
    outcome, capture = Run(), _Capture()
    try:
        with sandbox(capture), time_limit(limit):
            outcome.result = finish(function(*given))
    except BaseException as error:  # SystemExit and KeyboardInterrupt of student code stay here as well
        outcome.error = error
        outcome.line = _student_line(error, author)
    PRISTINE.restore()
    outcome.printed = capture.value()
    if outcome.error is None:
        outcome.changed = [k for k, (a, b) in enumerate(zip(args, given)) if not _same(a, b)]
    return outcome


def _same(before, after):
    """Whether an argument is what it was; only data count, a random generator may move on."""
    if isinstance(before, np.ndarray):
        return before.shape == np.shape(after) and np.array_equal(before, after, equal_nan=before.dtype.kind in "fc")
    if isinstance(before, list | tuple):
        return len(before) == len(after) and all(map(_same, before, after))
    if isinstance(before, dict):
        return before.keys() == after.keys() and all(_same(before[k], after[k]) for k in before)
    return True


def _student_line(error, function):
    """The student's own line on which it happened, the innermost one, as "line 3: x = 1 / 0"; empty where unknown."""
    code = getattr(function, "__code__", None)
    if code is None:
        return ""
    inside = [f for f in traceback.extract_tb(error.__traceback__) if f.filename == code.co_filename]
    return f"line {inside[-1].lineno}: {inside[-1].line}".rstrip(": ") if inside else ""
