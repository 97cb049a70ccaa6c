"""Running student code so that nothing it does reaches the notebook: time, output, exits, seeds, patches.

Student code is hostile by accident. `run` calls a function on copies of its arguments and reports what happened;
whatever the code changed in NumPy, in the interpreter or in labkit is put back.
"""

import builtins
import contextlib
import copy
import ctypes
import functools
import io
import os
import random
import signal
import sys
import threading
import time
import traceback
import warnings
from dataclasses import dataclass, field

import numpy as np

TIME_LIMIT = 2.0  # seconds of processor time that a single call may take
PATIENCE = 3  # times as long may a call take that shares its processor with others
WAITING = 0.02  # share of its time that code computes which only waits, in a sleep say
PERIOD = 0.05  # seconds between two rings of the clock
SWALLOWED = 10  # rings that code may swallow before every line of it raises
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
                found = now.get(key, self)
                if getattr(found, "_stands_for", found) is not value and key != "__warningregistry__":
                    now[key] = value
                    self.replaced.append(f"{name}.{key}")

    def drain(self):
        """The names noted since the last call, each once."""
        names, self.replaced = sorted(set(self.replaced)), []
        return names


PRISTINE = Pristine()


def standing_for(original):
    """Decorator of a function that takes another one's place for a while, which `PRISTINE` lets it."""

    def decorate(function):
        function._stands_for = original
        return functools.wraps(original)(function)

    return decorate


class _Clock:
    """Raises `TimeLimit` in this thread after so many seconds of processor time, and again if the code swallows it.

    Processor time does not depend on what else the machine is doing; a call that shares its processor is ended after
    `PATIENCE` times as long, one that only waits at once. Where the platform has interval timers (Linux, macOS) and
    this is the main thread, a signal does it, which also ends a sleep. Elsewhere a second thread raises it between two
    lines of Python; a single call into compiled code cannot be stopped there.
    """

    def __init__(self, seconds):
        self.seconds, self.rung = seconds, 0
        self.by_signal = hasattr(signal, "setitimer") and threading.current_thread() is threading.main_thread()

    def start(self):
        self.ends_cpu, self.ends_wall = time.thread_time() + self.seconds, time.monotonic() + PATIENCE * self.seconds
        if self.by_signal:
            self.before = signal.signal(signal.SIGALRM, self._ring)
            self.ticking = True
            signal.setitimer(signal.ITIMER_REAL, self.seconds, PERIOD)
        else:
            self.lock, self.done = threading.Lock(), threading.Event()
            self.ticking, self.target = True, ctypes.c_ulong(threading.get_ident())
            threading.Thread(target=self._watch, daemon=True).start()

    def stop(self):
        """Afterwards nothing rings any more; a ring on the way out is taken back."""
        while self.ticking:
            with contextlib.suppress(TimeLimit):
                self._disarm()
        if self.rung > SWALLOWED:
            sys.settrace(None)

    ticking = sent = False

    def _disarm(self):
        if self.by_signal:
            self.ticking = False
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.signal(signal.SIGALRM, self.before)
        else:
            with self.lock:
                if self.sent:  # it may be on its way: one more takes its place and is met here
                    self.sent = False
                    self._send()
                    while True:
                        pass
                self.ticking = False
                self.done.set()

    def _send(self):
        """Raise `TimeLimit` in the judged thread, between two lines.

        It is never taken back: Python 3.11 would go on looking for it at every call, and a debugger or a profiler
        that is switched on later would never get beyond its first one.
        """
        ctypes.pythonapi.PyThreadState_SetAsyncExc(self.target, ctypes.py_object(TimeLimit))

    def _ring(self, _, frame):
        left = self.ends_cpu - time.thread_time()
        waits = left > (1 - WAITING) * self.seconds
        if self.ticking and (left <= 0 or waits or time.monotonic() >= self.ends_wall):
            self.rung += 1
            if self.rung > SWALLOWED:
                _raise_at_every_line(frame)
            raise TimeLimit

    def _watch(self):
        wait = self.seconds
        while not self.done.wait(wait):
            wait = PERIOD
            with self.lock:
                if self.ticking:
                    self.sent = True
                    self._send()


def _raise_at_every_line(frame):
    """Code that swallows one `TimeLimit` after the other gets one at each line, up to the frame that runs it."""

    def tell(frame, event, value):
        if event == "line":
            raise TimeLimit
        return tell

    while frame is not None and frame.f_code is not _call.__code__:
        frame.f_trace = tell
        frame = frame.f_back
    sys.settrace(lambda *_: None)


def _call(function, args, finish):
    """The frame beneath which a student's code runs."""
    return finish(function(*args))


@contextlib.contextmanager
def time_limit(seconds):
    """Raise `TimeLimit` in what runs under `with` for more than so many seconds."""
    clock = _Clock(seconds)
    clock.start()
    try:
        yield
    finally:
        clock.stop()


def _forbid(what, original=None):
    """A function that refuses in this thread; others, such as the kernel's watch on its parent, go on with theirs."""
    checked = threading.get_ident()

    def refuse(*args, **kwargs):
        if original is not None and threading.get_ident() != checked:
            return original(*args, **kwargs)
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
    options, depth, folder = np.get_printoptions(), sys.getrecursionlimit(), _working_folder()
    with contextlib.ExitStack() as stack:
        stack.enter_context(warnings.catch_warnings())
        warnings.simplefilter("ignore")
        stack.enter_context(contextlib.redirect_stdout(capture))
        stack.enter_context(contextlib.redirect_stderr(capture))
        stack.enter_context(_replaced(builtins, "input", _forbid("input()")))
        stack.enter_context(_replaced(builtins, "breakpoint", _forbid("breakpoint()")))
        for name in ("_exit", "abort", "kill", "fork", "execv"):
            stack.enter_context(_replaced(os, name, _forbid(f"os.{name}()", getattr(os, name, None))))
        stack.enter_context(_replaced(_shell(), "ask_exit", _forbid("exit()")))
        try:
            yield
        finally:
            np.random.set_state(state)  # noqa: NPY002
            random.setstate(python_state)
            np.seterr(**err)
            np.set_printoptions(**options)
            sys.setrecursionlimit(depth)
            if folder is not None and _working_folder() != folder:
                with contextlib.suppress(OSError):
                    os.chdir(folder)


def _working_folder():
    """The working directory, or None where it has been deleted."""
    try:
        return os.getcwd()
    except OSError:
        return None


def _shell():
    """The IPython shell, where there is one: `exit()` in a notebook is its method, not Python's."""
    ipython = sys.modules.get("IPython")
    return ipython.get_ipython() if ipython else None


def run(function, args, finish=lambda result: result, limit=TIME_LIMIT, author=None):
    """Call `function` on copies of `args`, and `finish` on its result, both guarded.

    `finish` is where a result is converted: a returned object may be as hostile as the function itself. `author` is the
    function whose line is quoted when it raises, if another one than `function`. The first import of a library may
    take longer than a call: then it is called once more. An author with a `clock` of its own, such as a function in
    another process, keeps time itself.
    """
    known = len(sys.modules)
    outcome = _run_once(function, args, finish, limit, author or function)
    if isinstance(outcome.error, TimeLimit) and len(sys.modules) > known:
        outcome = _run_once(function, args, finish, limit, author or function)
    return outcome


def _run_once(function, args, finish, limit, author):
    given = copy.deepcopy(args)
    outcome, capture, clock = Run(), _Capture(), getattr(author, "clock", _Clock)(limit)
    try:
        try:
            with sandbox(capture):
                try:
                    clock.start()
                    outcome.result = _call(function, given, finish)
                finally:
                    clock.stop()
        finally:
            clock.stop()  # a ring on the way to the first one leaves it for this
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
    """The student's own line on which it happened, the innermost one, as "line 3: x = 1 / 0"; empty where unknown.

    An error that comes from another process brings its line along as `student_line`.
    """
    if hasattr(error, "student_line"):
        return error.student_line
    code = getattr(function, "__code__", None)
    if code is None:
        return ""
    inside = [f for f in traceback.extract_tb(error.__traceback__) if f.filename == code.co_filename]
    return f"line {inside[-1].lineno}: {inside[-1].line}".rstrip(": ") if inside else ""
