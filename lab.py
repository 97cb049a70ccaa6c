#!/usr/bin/env python3
"""The workbook's one command.

    python lab.py                   set up if need be, and open JupyterLab on the first notebook
    python lab.py test              set up if need be, and run every test

Options of the first: --no-browser, --port N, --ip ADDRESS; any other option goes to JupyterLab as it is.
Behind `test` you may name what pytest shall run, as in: python lab.py test tests/geometry/test_frames.py -k invert
`test --last-bits SEED` runs unit tests and solved notebooks with last bits as another processor would compute them.

The set-up is a virtual environment in .venv with the packages of constraints.txt; those that only tests need follow
when tests are run. It is repeated only when pyproject.toml, constraints.txt, hatch_build.py, the folder jupyter/, the
place of this folder or the version of Python has changed.
"""

import contextlib
import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent
OLDEST = (3, 11)
if sys.version_info >= OLDEST:  # an older one gets as far as the sentence that says so
    sys.path.insert(0, str(ROOT))
    from labkit.verbs import VERBS, processes, table
    from labkit.verbs.arguments import Refusal, run
    from labkit.verbs.jupyter import refuse_root

ASKED_FOR = ("pyproject.toml", "constraints.txt", "hatch_build.py", "jupyter/settings.json", "jupyter/server.json")
FULL = "The disk is full: the packages need about a gigabyte while they are installed."
OFFLINE = (
    "NewConnectionError",
    "NameResolutionError",
    "ConnectTimeoutError",
    "ReadTimeoutError",
    "ProxyError",
    "Connection refused",
    "Network is unreachable",
    "getaddrinfo failed",
    "Temporary failure in name resolution",
)


def main(arguments):
    """Run one verb; returns the exit code."""
    if sys.version_info < OLDEST:
        print(too_old(sys.version_info), file=sys.stderr)
        return 1
    return run(work, list(arguments))


def work(arguments):
    """What `main` does, with exceptions; returns the exit code."""
    if arguments[:1] and arguments[0] in ("-h", "--help", "help"):
        print(__doc__.strip(), table("python lab.py", without=("start",)), sep="\n\n")
        return 0
    verb, rest = split(arguments)
    if verb == "test":
        return processes.call([set_up(ROOT, "test"), str(ROOT / "tests" / "run.py"), *rest])
    if verb not in VERBS:
        raise Refusal(f"There is no command {verb!r}. There are test, {', '.join(VERBS)}; see: python lab.py --help")
    if verb == "start":
        refuse_root(rest)
    return processes.call([set_up(ROOT), "-m", "labkit", verb, *rest])


def too_old(version):
    return (
        f"The workbook needs Python {OLDEST[0]}.{OLDEST[1]} or newer, and this is Python {version[0]}.{version[1]}. "
        "Install a newer one and start with it, for example: python3.12 lab.py (Windows: py -3.12 lab.py)"
    )


def split(arguments):
    """(verb, remaining arguments); options alone belong to the verb "start"."""
    if not arguments or arguments[0].startswith("-"):
        return "start", list(arguments)
    return arguments[0], list(arguments[1:])


# --- the set-up -----------------------------------------------------------------------------------------------------


def set_up(root, extra=""):
    """The Python of `.venv`, made ready, with the packages of an extra ("test"); does nothing when the stamp says so.

    Without any stamp (interrupted, or of another Python) the environment is made anew. When an installation fails, as
    it does before it changes anything, the environment stays and the next run installs into it.
    """
    folder = root / ".venv"
    python = venv_python(folder)
    stamp_file = folder / "labkit-stamp.json"
    if is_ready(root, python, stamp_file, extra):
        return str(python)
    with only_one(root / ".lab" / "setup.lock") as held:
        if not is_ready(root, python, stamp_file, extra):
            make_ready(root, python, stamp_file, extra, held)
    return str(python)


def is_ready(root, python, stamp_file, extra):
    """Whether the environment is what pyproject.toml and constraints.txt ask for; one with more packages is, too."""
    version, stored = version_of(python), read_stamp(stamp_file)
    enough = not extra or stored.get("extra") == extra
    return version is not None and enough and {**stored, "extra": extra} == stamp(root, version, extra)


def make_ready(root, python, stamp_file, extra, held):
    folder = root / ".venv"
    version, before = version_of(python), read_stamp(stamp_file)
    if version is None or before.get("python") != version or not works(python, "-m", "pip", "--version"):
        make_venv(folder, held)
        before = {}
    extra = extra or before.get("extra", "")
    if stamp_file.exists():
        stamp_file.unlink()
    try:
        install(python, root, extra, held)
    except Refusal:
        with contextlib.suppress(OSError):  # on a full disk the next run begins anew
            stamp_file.write_text(json.dumps({"python": version_of(python)}), encoding="utf-8")
        raise
    stamp_file.write_text(json.dumps(stamp(root, version_of(python), extra)), encoding="utf-8")


@contextlib.contextmanager
def only_one(path):
    """Two set-ups at once would ruin each other: the second waits. Yields the open file that holds the lock.

    The lock falls when this process ends, however, and the programs that inherit the file.
    """
    path.parent.mkdir(exist_ok=True)
    with path.open("a+b") as file:
        try:
            lock(file, wait=False)
        except OSError:
            print("Another window is setting up; waiting for it ...", flush=True)
            lock(file, wait=True)
        yield file


def lock(file, wait):
    """Lock a file until it is closed; without `wait` an OSError says that another process holds it."""
    try:
        import fcntl
    except ImportError:
        import msvcrt

        file.seek(0)
        while True:
            try:
                return msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
            except OSError:
                if not wait:
                    raise
                time.sleep(1)
    fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))


def venv_python(folder, windows=os.name == "nt"):
    """Where a virtual environment keeps its interpreter."""
    return folder / ("Scripts" if windows else "bin") / ("python.exe" if windows else "python")


def stamp(root, version, extra):
    """What a set-up depends on: the packages and settings asked for, the version of Python, the place."""
    digest = hashlib.sha256()
    for name in ASKED_FOR:
        if (root / name).exists():
            digest.update((root / name).read_bytes())
    return {"python": version, "place": str(root), "packages": digest.hexdigest(), "extra": extra}


def read_stamp(path):
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def version_of(python):
    """ "3.11" of an interpreter that runs, or None."""
    show = "import sys; print('%d.%d' % sys.version_info[:2])"
    try:
        return subprocess.run([str(python), "-c", show], stdout=subprocess.PIPE, check=True).stdout.decode().strip()
    except (OSError, subprocess.CalledProcessError):
        return None


def works(*words):
    try:
        return subprocess.run([str(word) for word in words], capture_output=True).returncode == 0
    except OSError:
        return False


def make_venv(folder, held=None):
    """A fresh virtual environment; an unfinished one, or one of another Python, is replaced."""
    if Path(sys.prefix).resolve() == folder.resolve():
        raise Refusal("The environment in .venv is broken, and this is its Python. Start with another: python3 lab.py")
    print("Making the environment .venv ...", flush=True)
    with (folder.parent / ".lab" / "setup.log").open("wb+") as log:
        if logged([sys.executable, "-m", "venv", "--clear", str(folder)], folder.parent, log, held):
            raise Refusal(venv_advice(said(log)))


def venv_advice(output):
    said = " ".join(output.split())
    if "ensurepip is not available" in said or "No module named venv" in said or "No module named ensurepip" in said:
        return (
            "Python's module for virtual environments is missing. On Debian and Ubuntu it comes with: "
            "sudo apt install python3-venv   Then run this again."
        )
    if "No space left on device" in said:
        return FULL
    return "The environment .venv could not be made: " + last_line(output)


def install(python, root, extra="", held=None):
    """Install the pinned packages, with uv where it can be had and else with pip, which takes three times as long.

    uv, unlike pip, leaves compiling to the first import: where nothing may be written each kernel would compile all
    it imports, and hold half again as much memory. The whole story goes to `.lab/setup.log`.
    """
    path = root / ".lab" / "setup.log"
    path.parent.mkdir(exist_ok=True)
    print("Installing the packages, once: half a minute to two, 0.6 gigabytes ...", flush=True)
    wanted = ["-c", "constraints.txt", "-e", f".[{extra}]" if extra else "."]
    pip = [str(python), "-m", "pip", "install", "--disable-pip-version-check", "--no-input", "--retries", "2"]
    uv = [str(python), "-m", "uv", "pip", "install", "--quiet", "--compile-bytecode", "--python", str(python)]
    path.write_bytes(b"")
    with path.open("ab+") as log:
        failed = logged([*pip, "--quiet", "-c", "constraints.txt", "uv"], root, log, held)
        if failed and any(word in said(log) for word in OFFLINE):
            raise Refusal(install_advice(said(log)))
        failed = failed or logged([*uv, *wanted], root, log, held)
        if failed:
            log.truncate(0)
            failed = logged([*pip, *wanted], root, log, held)
        if failed:
            raise Refusal(install_advice(said(log)))


def said(log):
    """What stands in a log so far."""
    log.seek(0)
    return log.read().decode(errors="replace")


def logged(words, folder, log, held=None):
    """Exit code of a program that writes into a log; it ends with this one, and where it survives keeps the lock."""
    shared = {} if os.name == "nt" else {"process_group": 0, "pass_fds": [held.fileno()] if held is not None else []}
    process = subprocess.Popen(
        words, cwd=str(folder), stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT, **shared
    )
    with ended_with_this(process):
        return process.wait()


@contextlib.contextmanager
def ended_with_this(process):
    """While a program runs, what ends this one ends it first, and where it leads a group what it has started."""

    def end(number, frame):
        sys.exit(128 + number)

    names = [name for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    before = {name: signal.signal(getattr(signal, name), end) for name in names}
    try:
        yield
    except BaseException:
        if os.name == "nt":
            process.terminate()
        else:
            os.killpg(process.pid, signal.SIGTERM)
        process.wait()
        raise
    finally:
        for name, handler in before.items():
            signal.signal(getattr(signal, name), handler)


def install_advice(output):
    if any(word in output for word in OFFLINE):
        reason = "The packages could not be fetched: no connection to the package index. Is the network away?"
    elif "No space left on device" in output:
        reason = FULL
    else:
        reason = "The packages could not be installed: " + last_line(output)
    return reason + "\nRun this again when that is mended; what pip said is in .lab/setup.log."


def last_line(output):
    errors = [line for line in output.splitlines() if line.startswith(("ERROR", "error"))]
    lines = errors or [line for line in output.splitlines() if line.strip()] or ["no reason was given"]
    return lines[-1].strip()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
