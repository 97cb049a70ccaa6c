"""What a process has once and student code may change: how it is read, and how it is put back.

`STATE` is read and put back around every single call, `a_check` around a whole check: what takes longer to look at,
and what would appear beneath the cell.
"""

import builtins
import contextlib
import ctypes
import decimal
import gc
import locale
import logging
import os
import random
import signal
import site
import socket
import sys
import sysconfig
import threading
import time
import types
import weakref
from pathlib import Path

import numpy as np

from ..places import PACKAGE

HANDLED = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGCHLD") if hasattr(signal, name)]
HOOKS = [(sys, "excepthook"), (sys, "displayhook"), (sys, "unraisablehook"), (threading, "excepthook")]
HOOKS += [(sys, "stdin"), (sys, "argv")]
OF_IPYTHON = {"_"}  # which it binds anew from cell to cell
NO_EVENTS = types.SimpleNamespace(callbacks={})  # outside of IPython
BEGINNING = 20  # looks, 1 ms apart, at threads that have just been started
IDLE = 5  # looks at which nothing of the student's is seen in a library's threads
PREPARED = ("backend", "interactive")  # what matplotlib finds out by itself the first time it is used
LABKIT = "labkit"  # how the names of this package's own threads begin
OF_LIBRARIES = weakref.WeakSet()  # threads that libraries have begun for themselves while student code ran
NOTED = "_labkit_is_of_the_student"  # attribute of a thread that student code has begun
INSTALLED = tuple(  # what the files of installed code begin with
    {
        f"{Path(place)}{os.sep}"
        for place in (
            *site.getsitepackages(),
            site.getusersitepackages(),
            sysconfig.get_path("stdlib"),
            sysconfig.get_path("platstdlib"),
            PACKAGE,
        )
    }
) + ("<frozen",)
ENCODED = getattr(os.environ, "_data", os.environ)  # as the system holds it: to read it decoded takes 40 us a call
_kill = os.kill  # student code finds another one in its place


def working_folder():
    """The working directory, or None where it has been deleted."""
    try:
        return os.getcwd()
    except OSError:
        return None


def _set_folder(folder):
    if folder is not None and working_folder() != folder:
        os.chdir(folder)


def _environment():
    return dict(ENCODED)


def _set_environment(before):
    if dict(ENCODED) != before:
        values = {os.environ.decodekey(key): os.environ.decodevalue(value) for key, value in before.items()}
        os.environ.clear()
        os.environ.update(values)
        if hasattr(time, "tzset"):
            time.tzset()


def _set_print_options(before):
    if np.get_printoptions() != before:
        np.set_printoptions(**before)


def _set_error_call(before):
    if np.geterrcall() is not before:
        np.seterrcall(before)


def _umask():
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


def _list(entries):
    """How one of the process's own lists is read and put back: it stays the same list."""

    def put(before):
        entries[:] = before

    return lambda: list(entries), put


def _handlers():
    return [(number, signal.getsignal(number)) for number in HANDLED]


def _set_handlers(before):
    for number, handler in before:
        if handler is not None and signal.getsignal(number) != handler:
            signal.signal(number, handler)


def _hooks():
    return [getattr(owner, name) for owner, name in HOOKS]


def _set_hooks(before):
    for (owner, name), hook in zip(HOOKS, before):
        setattr(owner, name, hook)


def _decimals():
    context = decimal.getcontext()
    return context, context.prec, context.rounding, dict(context.traps)


def _set_decimals(before):
    context, context.prec, context.rounding, traps = before
    context.traps.update(traps)
    decimal.setcontext(context)


def _logging():
    return logging.root.level, logging.root.manager.disable


def _set_logging(before):
    if _logging() != before:
        level, logging.root.manager.disable = before
        logging.root.setLevel(level)


def _children():
    """Programs that this thread has started and that still run, or wait to be asked how they ended; where Linux
    tells.
    """
    with contextlib.suppress(OSError):
        return set(Path(f"/proc/self/task/{threading.get_native_id()}/children").read_text().split())
    return set()


def _end_children(before):
    for child in map(int, _children() - before):
        with contextlib.suppress(OSError):
            _kill(child, signal.SIGKILL)
            os.waitpid(child, 0)


def noting_whose(start):
    """`Thread.start` that notes what code of the student begins, in this thread or in one that was noted."""
    checked = threading.get_ident()

    def noting(thread):
        inside = threading.get_ident() == checked or hasattr(threading.current_thread(), NOTED)
        if inside and not is_of_a_library(sys._getframe(1).f_code):
            setattr(thread, NOTED, True)
        return start(thread)

    return noting


def _end_threads(before):
    """Student code that a call has left behind in a thread ends at its next line: it would slow down all that follows.

    A thread that a library has begun for itself goes on: a pool whose threads end never answers again. It may hold more
    student code, now or after a later call, and is looked at until it is idle.
    """
    left = [t for t in set(threading.enumerate()) - (before - set(OF_LIBRARIES)) if not t.name.startswith(LABKIT)]
    OF_LIBRARIES.update(thread for thread in left if not hasattr(thread, NOTED))
    idle = 0
    for _ in range(BEGINNING):
        if not left or idle == IDLE:
            break
        frames = sys._current_frames()
        running = {thread for thread in left if _runs_student_code(thread, frames.get(thread.ident))}
        for thread in running:
            _end(thread)
        left = [t for t in left if t.is_alive() and not (t in running and hasattr(t, NOTED))]
        idle = 0 if running or any(hasattr(thread, NOTED) for thread in left) else idle + 1
        time.sleep(0.001)
    for thread in left:
        if hasattr(thread, NOTED):
            _end(thread)


def _end(thread):
    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread.ident), ctypes.py_object(SystemExit))


def _runs_student_code(thread, frame):
    """Whether a thread at this frame has got as far as what student code began it with, or is running student code.

    One that ends before its first own line would stay in Python's list of threads.
    """
    if hasattr(thread, NOTED):
        return frame is not None and frame.f_code.co_filename != threading.__file__
    while frame is not None and is_of_a_library(frame.f_code):
        frame = frame.f_back
    return frame is not None


def is_of_a_library(code):
    """Whether code is installed, and not the student's; what came with Python is installed, too."""
    return code.co_filename.startswith(INSTALLED)


STATE = [  # (how to read it, how to put it back)
    (np.random.get_state, np.random.set_state),
    (random.getstate, random.setstate),
    (np.geterr, lambda values: np.seterr(**values)),
    (np.geterrcall, _set_error_call),
    (np.get_printoptions, _set_print_options),
    (sys.getrecursionlimit, sys.setrecursionlimit),
    (sys.gettrace, sys.settrace),
    (sys.getprofile, sys.setprofile),
    (threading.gettrace, threading.settrace),
    (threading.getprofile, threading.setprofile),
    (sys.getswitchinterval, sys.setswitchinterval),
    _list(sys.path),
    _list(sys.meta_path),
    (_environment, _set_environment),
    (lambda: locale.setlocale(locale.LC_ALL), lambda name: locale.setlocale(locale.LC_ALL, name)),
    (gc.isenabled, lambda on: gc.enable() if on else gc.disable()),
    (gc.get_threshold, lambda numbers: gc.set_threshold(*numbers)),
    _list(gc.callbacks),
    (_umask, os.umask),
    (working_folder, _set_folder),
    (_handlers, _set_handlers),
    (_hooks, _set_hooks),
    (_decimals, _set_decimals),
    (_logging, _set_logging),
    _list(logging.root.handlers),
    (socket.getdefaulttimeout, socket.setdefaulttimeout),
    (lambda: set(threading.enumerate()), _end_threads),
]
if hasattr(sys, "set_int_max_str_digits"):
    STATE.append((sys.get_int_max_str_digits, sys.set_int_max_str_digits))
if hasattr(signal, "pthread_sigmask"):
    STATE.append(
        (lambda: signal.pthread_sigmask(signal.SIG_BLOCK, ()), lambda m: signal.pthread_sigmask(signal.SIG_SETMASK, m))
    )


# --- around a whole check -------------------------------------------------------------------------------------------


@contextlib.contextmanager
def a_check():
    """What a check in a notebook needs beside: nothing of what student code shows or starts appears or goes on."""
    shell, names = _shell(), set(vars(builtins))
    numbers = np.random.get_state(legacy=False)  # noqa: NPY002 (a student's own, in its plain cells)
    children, looks, figures, callbacks = _children(), _rc_params(), _figures(), _callbacks(shell)
    with _publishing_to_print(shell):
        try:
            yield
        finally:
            np.random.set_state(numbers)  # noqa: NPY002
            for name in set(vars(builtins)) - names - OF_IPYTHON:
                delattr(builtins, name)
            _end_children(children)
            _set_rc_params(looks)
            for number in _figures() - figures:
                sys.modules["matplotlib.pyplot"].close(number)
            _forget_callbacks(shell, callbacks)


def _shell():
    ipython = sys.modules.get("IPython")
    return ipython.get_ipython() if ipython else None


@contextlib.contextmanager
def _publishing_to_print(shell):
    """What student code displays is text that it has printed: it would appear once for every draw."""
    publisher = getattr(shell, "display_pub", None)
    if publisher is None:
        yield
        return

    def publish(data, *_, **__):
        print(data.get("text/plain", ""))

    before = vars(publisher).copy()
    publisher.publish, publisher.clear_output = publish, lambda *_, **__: None
    try:
        yield
    finally:
        for name in ("publish", "clear_output"):
            if name in before:
                setattr(publisher, name, before[name])
            else:
                delattr(publisher, name)


def _rc_params():
    """How Matplotlib shall draw, as it is stored: nothing is checked again."""
    matplotlib = sys.modules.get("matplotlib")
    values = {} if matplotlib is None else dict(dict.items(matplotlib.rcParams))
    return {name: value for name, value in values.items() if name not in PREPARED}


def _set_rc_params(before):
    if before:
        dict.update(sys.modules["matplotlib"].rcParams, before)


def _figures():
    """Numbers of pyplot's open figures: those that were not there before would be shown at the end of the cell."""
    pyplot = sys.modules.get("matplotlib.pyplot")
    return set(pyplot.get_fignums()) if pyplot else set()


def _callbacks(shell):
    """What IPython calls before and after a cell."""
    return {name: list(functions) for name, functions in getattr(shell, "events", NO_EVENTS).callbacks.items()}


def _forget_callbacks(shell, before):
    """A notebook's own functions among what has been added are taken out again; a library's stay, they show figures."""
    for name, functions in getattr(shell, "events", NO_EVENTS).callbacks.items():
        known = before.get(name, ())
        functions[:] = [f for f in functions if f in known or getattr(f, "__module__", "") != "__main__"]
