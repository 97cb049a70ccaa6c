"""Where a submitted notebook runs: under bubblewrap where there is one, else as a process with limits.

With bubblewrap the kernel keeps the code from the network, from other processes and from every file but Python's, the
library's and its data. Without, `rails` inside the process refuse the same things, which stops what students write by
accident or for fun, and no expert. In both cases the marks are safe, for what judges is in another process.
"""

import contextlib
import functools
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from ..places import DATA, ROOT

PACKAGE = Path(__file__).resolve().parents[1]
WORKER = PACKAGE / "collect" / "worker.py"
ARITHMETIC = ("OPENBLAS_", "MKL_", "NPY_")  # both sides of the border compute alike, to the last bit
HIDDEN = (
    "exercises.py",
    "beyond.py",
    "special.py",
    "proofs.py",
    "__pycache__",
)  # in every chapter: references, draws and mistakes
SYSTEM = ("/usr", "/lib", "/lib32", "/lib64", "/bin", "/sbin", "/etc/alternatives", "/etc/ld.so.cache", "/etc/fonts")
MEMORY, FILES, PROCESSES, CPU = 3 << 30, 8 << 20, 256, 240  # bytes, bytes, number, seconds
PROTECTED = "Notebooks ran under bubblewrap: without a network, without a home folder, on a read-only system."
UNPROTECTED = (
    "Notebooks ran as processes with limits, without bubblewrap{why}. The marks are as safe, because another process "
    "judges; this machine is protected by rails inside Python alone. "
    "Take a machine of its own for submissions you do not trust."
)


@functools.cache
def bubblewrap():
    """(path of a working bwrap or None, why there is none)."""
    path = shutil.which("bwrap")
    if os.environ.get("LABKIT_SANDBOX") == "none":
        return None, " (LABKIT_SANDBOX=none)"
    if path is None:
        return None, " (it is not installed; on Debian and Ubuntu: apt install bubblewrap)"
    with tempfile.TemporaryDirectory() as folder:
        try:
            words = [*_wrapped(path, folder), sys.executable, "-I", "-c", "import numpy"]
            tried = subprocess.run(words, capture_output=True, timeout=60, text=True)
            said = " ".join(tried.stderr.split())[-200:]
        except (OSError, subprocess.TimeoutExpired) as error:
            said = str(error)
    return (path, "") if not said else (None, f" (it does not work here: {said})")


def sentence():
    """Which of the two it is, for the report."""
    path, why = bubblewrap()
    return PROTECTED if path else UNPROTECTED.format(why=why)


@contextlib.contextmanager
def worker(cpu=CPU):
    """A started worker process, and the folder it may write to; both are gone afterwards, with all it started."""
    path, _ = bubblewrap()
    with tempfile.TemporaryDirectory(prefix="labkit-collect-", ignore_cleanup_errors=True) as folder:
        words = [sys.executable, "-s", "-P", str(WORKER), str(PACKAGE.parent), str(cpu)]
        process = subprocess.Popen(
            [*(_wrapped(path, folder) if path else ()), *words, *([] if path else [folder])],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            cwd=folder,
            env=_environment("/tmp" if path else folder),
            start_new_session=os.name != "nt",
        )
        try:
            yield process
        finally:
            end(process)


def end(process):
    """Kill the worker and whatever it started."""
    with contextlib.suppress(OSError):
        if os.name == "nt":
            process.kill()
        else:
            os.killpg(process.pid, 9)
    process.wait()
    for pipe in (process.stdin, process.stdout):
        with contextlib.suppress(OSError):
            pipe.close()


def _wrapped(bwrap, folder):
    """The command line of bubblewrap, up to the command it runs."""
    words = [bwrap, "--unshare-all", "--die-with-parent", "--new-session"]
    words += ["--proc", "/proc", "--dev", "/dev", "--tmpfs", "/tmp"]  # first: a checkout may itself lie in /tmp
    for place in dict.fromkeys((*SYSTEM, sys.base_prefix, sys.prefix)):
        if os.path.islink(place):
            words += ["--symlink", os.readlink(place), place]
        elif os.path.exists(place):
            words += ["--ro-bind", place, place]
    words += ["--ro-bind", str(PACKAGE), str(PACKAGE)]
    if DATA.exists() and not DATA.is_relative_to(PACKAGE):
        words += ["--ro-bind", str(DATA), str(DATA)]
    for place in hidden():
        words += ["--tmpfs", str(place)] if place.is_dir() else ["--ro-bind", os.devnull, str(place)]
    return [*words, "--chdir", "/tmp"]


def hidden():
    """What of the package a submission must not read."""
    shipped = [path for path in (ROOT / "solutions",) if path.is_dir() and path.is_relative_to(PACKAGE)]
    return shipped + [path for name in HIDDEN for path in sorted((PACKAGE / "chapters").glob(f"*/{name}"))]


def folders():
    """Every folder of the package that holds modules."""
    return sorted({path.parent for path in PACKAGE.rglob("*.py")})


def _environment(home):
    kept = {name: os.environ[name] for name in ("PATH", "SYSTEMROOT", "LANG", "LC_ALL") if name in os.environ}
    kept |= {name: value for name, value in os.environ.items() if name.startswith(ARITHMETIC)}
    one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    places = dict.fromkeys(("HOME", "USERPROFILE", "IPYTHONDIR", "MPLCONFIGDIR", "TMPDIR", "TEMP", "TMP"), home)
    return {
        **kept,
        **one,
        **places,
        "MPLBACKEND": "Agg",
        "PYTHONUTF8": "1",
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONHASHSEED": "0",
    }


def limit_this_process(cpu):
    """Limits that the kernel keeps, where it has them: processor time, memory, size of files, number of processes."""
    try:
        import resource
    except ImportError:
        return
    wanted = {
        "RLIMIT_CPU": cpu,
        "RLIMIT_AS": MEMORY,
        "RLIMIT_FSIZE": FILES,
        "RLIMIT_NPROC": PROCESSES,
        "RLIMIT_CORE": 0,
    }
    for name, amount in wanted.items():
        with contextlib.suppress(ValueError, OSError, AttributeError):
            resource.setrlimit(getattr(resource, name), (amount, amount))
