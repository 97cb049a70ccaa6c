"""Running student code so that nothing it does reaches the notebook: time, output, exits, seeds, patches.

Student code is hostile by accident. `run` calls a function on copies of its arguments and reports what happened;
whatever the code changed in NumPy, in the interpreter or in labkit is put back.
"""

import builtins
import contextlib
import copy
import ctypes
import functools
import getpass
import inspect
import io
import itertools
import linecache
import operator
import os
import signal
import sys
import threading
import time
import types
import warnings
from dataclasses import dataclass, field

import numpy as np

from . import kept

TIME_LIMIT = 2.0  # seconds of processor time that a single call may take
PATIENCE = 3  # times as long may a call take that shares its processor with others
WAITING = 0.02  # share of its time that code computes which only waits, in a sleep say
ABROAD = 10  # times as long again, where most of it is waiting for another process that works for the call
PERIOD = 0.05  # seconds between two rings of the clock
SWALLOWED = 10  # rings that code may swallow before every line of it raises
OUTPUT_LIMIT = 2000  # characters of printed text that are kept
MESSAGE = 2000  # characters of an error's words that are looked at: somebody may have put a whole array in
PROTECTED = ("numpy", "numpy.linalg", "numpy.random", "math", "random", "builtins", "os", "time", "signal", "inspect")
PROTECTED += ("copy", "json", "html", "itertools", "functools", "types", "contextlib", "traceback")
CHANGING = {
    "builtins": {"_", "input", "breakpoint"},  # what IPython itself sets anew from cell to cell
    "time": {"tzname", "timezone", "altzone", "daylight"},  # what `tzset` makes of the environment, which is put back
    "labkit.exercises.budget": {"LOOKING"},  # which `collect` and tests set otherwise
}
ENDING = ("_exit", "abort", "kill", "fork", "forkpty", "execv", "system")  # of this process, or into another
DEPTH = 10_000  # calls within calls, at most: what student code may raise the limit to


class TimeLimit(BaseException):
    """Raised inside student code that runs too long; no Exception, so that `except Exception` does not swallow it.

    One that was swallowed all the same dies in the code that did it. While `relentless`, the next line there then
    raises another: also the one after an `except`, where no `try` catches it.
    """

    relentless = False

    def __del__(self):
        if TimeLimit.relentless:
            _raise_at_every_line(sys._getframe(1))


class Forbidden(BaseException):
    """Raised inside student code that wants the keyboard or the end of the process."""


@dataclass
class Run:
    """What one call did: its result or its error, what it printed, which arguments it changed."""

    result: object = None
    error: BaseException | None = None
    said: str = ""
    line: str = ""
    printed: str = ""
    changed: list = field(default_factory=list)


def printable(text):
    """Text that every file and page takes: a lone surrogate, half of a letter, is written out."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


class _Capture(io.TextIOBase):
    """Standard output that keeps the first characters and counts the rest."""

    def __init__(self):
        self.text, self.lost, self.room = "", 0, OUTPUT_LIMIT

    def write(self, text):
        size = len(text)
        if self.room:
            kept = text[: self.room]
            self.text += kept
            self.room -= len(kept)
            self.lost -= len(kept)
        self.lost += size
        return size

    def value(self):
        more = f"\n... and {self.lost} more characters" if self.lost else ""
        return printable(self.text) + more


class Pristine:
    """Remembers what labkit's modules (and the NumPy names they use) held at first sight, and puts it back."""

    def __init__(self):
        self.saved, self.seen = {}, {}
        self.replaced = []

    def look(self):
        """Remember every module of labkit that has been loaded since the last look."""
        for name, module in list(sys.modules.items()):
            ours = name == "labkit" or name.startswith("labkit.") or name in PROTECTED
            if ours and name not in self.saved and module is not None:
                kept = CHANGING.get(name, ())
                self.saved[name] = (module, {key: v for key, v in vars(module).items() if key not in kept}, None)
                if name.startswith("labkit."):
                    self._look_into(module)

    def _look_into(self, module):
        """Remember the methods of a module's own classes, and how many names each has."""
        for value in list(vars(module).values()):
            if isinstance(value, type) and value.__module__ == module.__name__:
                methods = {k: v for k, v in vars(value).items() if isinstance(v, types.FunctionType | property)}
                self.saved[f"{module.__name__}.{value.__qualname__}"] = (value, methods, len(vars(value)))

    def restore(self):
        """Put back what was replaced, and note the names, e.g. "labkit.geometry.frames.invert", in `replaced`.

        This follows every call, and there are thousands of names: what holds the same things in the same order as when
        it was last looked through is not looked through again.
        """
        for name, (owner, then, size) in self.saved.items():
            if size is None and sys.modules.get(name) is not owner:
                sys.modules[name] = owner
                self.replaced.append(name)
            now, seen = vars(owner), self.seen.get(name, ())
            if len(now) != len(seen) or not all(map(operator.is_, now.values(), seen)):
                self._look_through(name, owner, then, size)
                self.seen[name] = tuple(vars(owner).values())

    def _look_through(self, name, owner, then, size):
        """The same name by name, for one module or class."""
        now = vars(owner)
        if not all(map(operator.is_, map(now.get, then, itertools.repeat(self)), then.values())):
            self._put_back(name, owner, now, then)
        if size is not None and len(now) != size:
            for key in [k for k, v in now.items() if k not in then and isinstance(v, types.FunctionType)]:
                delattr(owner, key)  # it stood before what is inherited
                self.replaced.append(f"{name}.{key}")

    def _put_back(self, name, owner, now, then):
        for key, value in then.items():
            found = now.get(key, self)
            if getattr(found, "_stands_for", found) is not value and key != "__warningregistry__":
                setattr(owner, key, value)
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


class Abroad:
    """How long this process has waited for another that works for it: no time of the code that is judged."""

    ended, since = 0.0, None
    worked = 0.0  # seconds of processor time of the other process, as it tells

    @classmethod
    @contextlib.contextmanager
    def waiting(cls):
        """What runs within waits for the other process."""
        cls.since = time.monotonic()
        try:
            yield
        finally:
            cls.ended, cls.since = cls.seconds(), None

    @classmethod
    def seconds(cls):
        """Since the process began; a wait that still lasts counts, since a ring may come in its midst."""
        since = cls.since
        return cls.ended + (0.0 if since is None else time.monotonic() - since)


class Starved:
    """How long the processor served others while this process's main thread was ready to go on, where Linux tells."""

    file = -1

    @classmethod
    def look(cls):
        """Open what tells it, before rails are laid, and anew in a process that was forked."""
        with contextlib.suppress(OSError):
            cls.file = os.open("/proc/self/schedstat", os.O_RDONLY)

    @classmethod
    def seconds(cls):
        """Since the process began; 0 where nobody tells."""
        try:
            return 1e-9 * int(os.pread(cls.file, 100, 0).split()[1])
        except (OSError, ValueError, IndexError, AttributeError):
            return 0.0


Starved.look()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=Starved.look)


class _Clock:
    """Raises `TimeLimit` in this thread after so many seconds of processor time, and again if the code swallows it.

    Processor time does not depend on what else the machine is doing; a call that shares its processor is ended after
    `PATIENCE` times as long, one that only waits at once. Waiting for the processor (`Starved`) or a process that works
    for the call (`Abroad`, up to `ABROAD` times as long again) does not count. Where the platform has interval timers
    (Linux, macOS) and this is the main thread, a signal does it, which also ends a sleep. Elsewhere a second thread
    raises it between two lines of Python; a single call into compiled code cannot be stopped there.
    """

    def __init__(self, seconds):
        self.seconds, self.rung = seconds, 0
        self.by_signal = hasattr(signal, "setitimer") and threading.current_thread() is threading.main_thread()

    def start(self):
        self.ends_cpu, self.began = time.thread_time() + self.seconds, time.monotonic()
        self.abroad, self.starved = Abroad.seconds(), Starved.seconds()
        if self.by_signal:
            self.before = signal.signal(signal.SIGALRM, self._ring)
            self.ticking = True
            signal.setitimer(signal.ITIMER_REAL, max(self.seconds, 1e-6), PERIOD)  # 0 would switch it off
        else:
            self.lock, self.done = threading.Lock(), threading.Event()
            self.ticking, self.target = True, ctypes.c_ulong(threading.get_ident())
            threading.Thread(target=self._watch, name=f"{kept.LABKIT} clock", daemon=True).start()

    def stop(self):
        """Afterwards nothing rings any more; a ring on the way out is taken back."""
        while self.ticking:
            with contextlib.suppress(TimeLimit):
                TimeLimit.relentless = False
                if self.rung > SWALLOWED:
                    sys.settrace(None)
                self._disarm()

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

    def _whole(self):
        """Seconds since the start, without those that the processor gave to others."""
        return time.monotonic() - self.began - (Starved.seconds() - self.starved)

    def _own(self):
        """The same without those spent waiting for another process."""
        return self._whole() - (Abroad.seconds() - self.abroad)

    def _is_patient(self):
        return self._own() < PATIENCE * self.seconds and self._whole() < ABROAD * PATIENCE * self.seconds

    def _ring(self, _, frame):
        left = self.ends_cpu - time.thread_time()
        waits = left > (1 - WAITING) * self.seconds and self._own() >= self.seconds
        if self.ticking and (left <= 0 or waits or not self._is_patient()):
            self.rung += 1
            if self.rung > SWALLOWED:
                _raise_at_every_line(frame)
            raise TimeLimit

    def _watch(self):
        wait = self.seconds
        while not self.done.wait(wait):
            wait = PERIOD
            with self.lock:
                if self.ticking and (self._own() >= self.seconds or not self._is_patient()):
                    self.sent = True
                    self.rung += 1
                    TimeLimit.relentless = self.rung > SWALLOWED  # the next one that is swallowed begins it, over there
                    self._send()


def _raise_at_every_line(frame):
    """Code that swallows one `TimeLimit` after the other gets one at its next line, up to the frame that runs it.

    Python stops tracing when a trace function raises: what is swallowed again is followed by `TimeLimit.__del__`.
    """

    def tell(frame, event, value):
        if event == "line" and TimeLimit.relentless:
            raise TimeLimit
        return tell

    beneath = []
    while frame is not None and frame.f_code is not _call.__code__:
        beneath.append(frame)
        frame = frame.f_back
    if frame is not None:
        TimeLimit.relentless = True
        for frame in beneath:
            frame.f_trace = tell
        sys.settrace(lambda *_: None)


def _call(function, args, finish):
    """The frame beneath which a student's code runs."""
    return finish(function(*args))


@contextlib.contextmanager
def time_limit(seconds):
    """Raise `TimeLimit` in what runs under `with` for more than so many seconds; with 0, at once."""
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
def _replaced(*triples):
    """Set attributes, (owner, name, value) each, for a while; nothing happens where an owner does not have one."""
    before = [(owner, name, getattr(owner, name)) for owner, name, _ in triples if hasattr(owner, name)]
    for owner, name, value in triples:
        if hasattr(owner, name):
            setattr(owner, name, value)
    try:
        yield
    finally:
        for owner, name, value in reversed(before):
            setattr(owner, name, value)


def only_finite_matrices():
    """Within, what NumPy decomposes must be finite: LAPACK would write of NaN on the terminal, past `sys.stderr`."""
    return _replaced(*_decompositions())


POLYNOMIALS = sys.modules[inspect.unwrap(np.polyfit).__globals__["__name__"]]  # where `np.polyfit` has its `lstsq`


def _decompositions():
    names = ((np.linalg, "lstsq"), (np.linalg, "pinv"), (np.linalg, "svd"), (POLYNOMIALS, "lstsq"))
    return [(module, name, _finite_only(getattr(np.linalg, name), name)) for module, name in names]


@functools.lru_cache(32)
def _finite_only(original, name):
    @standing_for(original)
    def decompose(a, *args, **kwargs):
        if not np.isfinite(a).all():
            raise np.linalg.LinAlgError(f"the matrix given to `{name}` holds NaN or infinity")
        return original(a, *args, **kwargs)

    return decompose


class Judging:
    """Whether student code runs: what it calls in turn must not judge it once more, and so on without an end."""

    depth = 0

    @classmethod
    @contextlib.contextmanager
    def on(cls):
        cls.depth += 1
        try:
            yield
        finally:
            cls.depth -= 1


@contextlib.contextmanager
def sandbox(capture):
    """Everything student code may touch, put back afterwards."""
    state = [(put, read()) for read, put in kept.STATE]
    with contextlib.ExitStack() as stack:
        stack.enter_context(Judging.on())
        stack.enter_context(warnings.catch_warnings())
        warnings.simplefilter("ignore")
        stack.enter_context(_replaced((sys, "stdout", capture), (sys, "stderr", capture), *_stand_ins()))
        try:
            yield
        finally:
            for put, value in state:
                with contextlib.suppress(Exception):  # such as a folder that is gone
                    put(value)


def _stand_ins():
    """(owner, name, what stands there while student code runs)."""
    limit, shell = sys.setrecursionlimit, _shell()
    words = {"ask_exit": "exit()", "run_cell": "run_cell()", "system": "system()"}
    return [
        *_decompositions(),
        (sys, "setrecursionlimit", lambda depth: limit(min(depth, DEPTH))),
        (builtins, "input", _forbid("input()")),
        (builtins, "breakpoint", _forbid("breakpoint()")),
        (getpass, "getpass", _forbid("getpass()")),
        *((os, name, _forbid(f"os.{name}()", getattr(os, name, None))) for name in ENDING),
        (threading.Thread, "start", kept.noting_whose(threading.Thread.start)),
        *((shell, name, _forbid(said)) for name, said in words.items()),
    ]


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
    outcome.said = message_of(outcome.error)
    outcome.printed = capture.value()
    PRISTINE.restore()
    if outcome.error is None:
        outcome.changed = [k for k, (a, b) in enumerate(zip(args, given)) if not is_same(a, b)]
    return outcome


def message_of(error, limit=0.5):
    """What an error says, in one line; a student's exception class may fail to print itself, or never end."""
    if error is None:
        return ""
    try:
        with time_limit(limit), sandbox(_Capture()):
            return _call(str, (error,), lambda said: printable(_one_line(said[:MESSAGE])[:300]))
    except BaseException:  # also TimeLimit, and SystemExit of student code
        return "(its message cannot be shown)"


def _one_line(text):
    """A text without its ends of lines; blanks within a line stay, since they may be what it is about."""
    return " ".join(line.strip() for line in text.splitlines() if line.strip())


def is_same(before, after):
    """Whether an argument is what it was; only data count, a random generator may move on."""
    if isinstance(before, np.ndarray):
        return before.shape == np.shape(after) and np.array_equal(before, after, equal_nan=before.dtype.kind in "fc")
    if isinstance(before, list | tuple):
        return len(before) == len(after) and all(map(is_same, before, after))
    if isinstance(before, dict):
        return before.keys() == after.keys() and all(is_same(before[k], after[k]) for k in before)
    if isinstance(before, str | int | float | np.number):
        return type(before) is type(after) and (before == after or before != before and after != after)
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
    inside, trace = None, error.__traceback__
    while trace is not None:
        inside = trace if trace.tb_frame.f_code.co_filename == code.co_filename else inside
        trace = trace.tb_next
    if inside is None:
        return ""
    line = linecache.getline(code.co_filename, inside.tb_lineno, inside.tb_frame.f_globals).strip()
    return f"line {inside.tb_lineno}: {line}".rstrip(": ")
