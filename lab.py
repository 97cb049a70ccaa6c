#!/usr/bin/env python3
"""The workbook's one command.

    python lab.py                   set up if need be, and open JupyterLab on the first notebook
    python lab.py test              set up if need be, and run every test
    python lab.py reset NN          a fresh chapter NN; your copy of it is kept beside it
    python lab.py progress          what you have solved
    python lab.py calibrate ...     your own poses in, a calibration with covariance, outliers and advice out
    python lab.py localize ...      your own log in, the path with its covariance out
    python lab.py collect ...       for lecturers: submitted notebooks in, marks and a page on the class out
    python lab.py ledger            every number the four documents print, recomputed
    python lab.py build [NN ...]    for authors: write the notebooks from solutions/NN_name.py
    python lab.py build --check     for authors: say which notebooks are stale

Options of the first: --no-browser, --port N, --ip ADDRESS; any other option goes to JupyterLab as it is.
Behind `test` you may name what pytest shall run, as in: python lab.py test tests/geometry/test_frames.py -k invert
`test --last-bits SEED` runs unit tests and solved notebooks with last bits as another processor would compute them.

The set-up is a virtual environment in .venv with the packages of constraints.txt. It is repeated only when
pyproject.toml, constraints.txt, the place of this folder or the version of Python has changed.
"""

import argparse
import contextlib
import errno
import hashlib
import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent
OLDEST = (3, 11)
FIRST_NOTEBOOK = "notebooks/00_start_here.ipynb"
FIRST_PORT, PORTS = 8888, 50
ON_OWN_FILES = ("calibrate", "localize", "collect")  # verbs whose files are named from the folder one stands in
OVERRIDES = {
    # neither news nor a look for updates: nothing is asked, and no other host is called
    "@jupyterlab/apputils-extension:notification": {"fetchNews": "false", "checkForUpdates": False},
    # a cell scrolled out of sight stays in the page, and with it the figure being dragged
    "@jupyterlab/notebook-extension:tracker": {"windowingMode": "none"},
    # the state of widgets dies with the kernel: files hold pictures and words instead
    "@jupyter-widgets/jupyterlab-manager:plugin": {"saveState": False},
}
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


class Refusal(Exception):
    """A reason to stop, said in one or two sentences."""


def main(arguments):
    """Run one verb; returns the exit code."""
    try:
        if sys.version_info < OLDEST:
            raise Refusal(too_old(sys.version_info))
        verb, rest = split(arguments)
        if verb == "help":
            print(__doc__.strip())
            return 0
        options = lab_options(rest) if verb == "lab" else None
        python = set_up(ROOT)
        if verb == "lab":
            return start_lab(python, *options)
        return call(command(verb, python, rest), Path.cwd() if verb in ON_OWN_FILES else ROOT)
    except Refusal as reason:
        print(reason, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("\nInterrupted. What was begun is redone the next time.", file=sys.stderr)
        return 130


def too_old(version):
    return (
        f"The workbook needs Python {OLDEST[0]}.{OLDEST[1]} or newer, and this is Python {version[0]}.{version[1]}. "
        "Install a newer one and start with it, for example: python3.12 lab.py (Windows: py -3.12 lab.py)"
    )


def split(arguments):
    """(verb, remaining arguments); options alone belong to the verb "lab"."""
    if any(word in ("-h", "--help", "help") for word in arguments[:1]):
        return "help", []
    if not arguments or arguments[0].startswith("-"):
        return "lab", list(arguments)
    verb, rest = arguments[0], list(arguments[1:])
    verbs = ("test", "build", "reset", "progress", "ledger", *ON_OWN_FILES)
    if verb not in verbs:
        raise Refusal(f"There is no command {verb!r}. There are {', '.join(verbs)}; see: python lab.py --help")
    if verb == "reset" and not rest:
        raise Refusal("Which chapter? For example: python lab.py reset 01")
    return verb, rest


def command(verb, python, rest):
    """The command line behind every verb but the first."""
    if verb in ON_OWN_FILES:
        return [python, "-m", "labkit", verb, *rest]
    return {
        "test": [python, str(ROOT / "tests" / "run.py"), *rest],
        "build": [python, "-m", "labkit.verbs.build", *rest],
        "reset": [python, "-m", "labkit.verbs.build", "--reset", *rest],
        "progress": [python, "-c", "from labkit.exercises import progress_text; print(progress_text())"],
        "ledger": [python, "-c", "from labkit.documents import ledger; print(ledger.as_text())"],
    }[verb]


# --- the set-up -----------------------------------------------------------------------------------------------------


def set_up(root):
    """The Python of `.venv`, made ready; does nothing when the stamp says that it is.

    Without any stamp (interrupted, or of another Python) the environment is made anew. When pip gives up, as it does
    before it changes anything, the environment stays and the next run installs into it.
    """
    folder = root / ".venv"
    python = venv_python(folder)
    stamp_file = folder / "labkit-stamp.json"
    if is_ready(root, python, stamp_file):
        return str(python)
    with only_one(root / ".lab" / "setup.lock"):
        if not is_ready(root, python, stamp_file):
            make_ready(root, python, stamp_file)
    return str(python)


def is_ready(root, python, stamp_file):
    """Whether the environment is what pyproject.toml and constraints.txt ask for."""
    version = version_of(python)
    return version is not None and read_stamp(stamp_file) == stamp(root, version)


def make_ready(root, python, stamp_file):
    folder = root / ".venv"
    version = version_of(python)
    if (
        version is None
        or read_stamp(stamp_file).get("python") != version
        or not works(python, "-m", "pip", "--version")
    ):
        make_venv(folder)
    if stamp_file.exists():
        stamp_file.unlink()
    try:
        install(python, root)
    except Refusal:
        stamp_file.write_text(json.dumps({"python": version_of(python)}), encoding="utf-8")
        raise
    settings = folder / "share" / "jupyter" / "lab" / "settings"
    settings.mkdir(parents=True, exist_ok=True)
    (settings / "overrides.json").write_text(json.dumps(OVERRIDES, indent=1) + "\n", encoding="utf-8")
    stamp_file.write_text(json.dumps(stamp(root, version_of(python))), encoding="utf-8")


@contextlib.contextmanager
def only_one(path):
    """Two set-ups at once would ruin each other: the second waits. The lock falls when its process ends, however."""
    path.parent.mkdir(exist_ok=True)
    with path.open("a+b") as file:
        try:
            lock(file, wait=False)
        except OSError:
            print("Another window is setting up; waiting for it ...", flush=True)
            lock(file, wait=True)
        yield


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


def stamp(root, version):
    """What a set-up depends on: the packages asked for, the version of Python, the place, the settings."""
    digest = hashlib.sha256()
    for name in ("pyproject.toml", "constraints.txt"):
        digest.update((root / name).read_bytes())
    digest.update(json.dumps(OVERRIDES).encode())
    return {"python": version, "place": str(root), "packages": digest.hexdigest()}


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


def make_venv(folder):
    """A fresh virtual environment; an unfinished one, or one of another Python, is replaced."""
    if Path(sys.prefix).resolve() == folder.resolve():
        raise Refusal("The environment in .venv is broken, and this is its Python. Start with another: python3 lab.py")
    print("Making the environment .venv ...", flush=True)
    made = subprocess.run(
        [sys.executable, "-m", "venv", "--clear", str(folder)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    if made.returncode:
        raise Refusal(venv_advice(made.stdout.decode(errors="replace")))


def venv_advice(output):
    said = " ".join(output.split())
    if "ensurepip is not available" in said or "No module named venv" in said or "No module named ensurepip" in said:
        return (
            "Python's module for virtual environments is missing. On Debian and Ubuntu it comes with: "
            "sudo apt install python3-venv   Then run this again."
        )
    return "The environment .venv could not be made: " + last_line(output)


def install(python, root):
    """Install the pinned packages; the whole story goes to `.lab/setup.log`."""
    log = root / ".lab" / "setup.log"
    log.parent.mkdir(exist_ok=True)
    print("Installing the packages, once: about a minute, half a gigabyte ...", flush=True)
    words = [python, "-m", "pip", "install", "--disable-pip-version-check", "--no-input", "--retries", "2"]
    with log.open("wb") as file:
        pip = subprocess.run(
            [*map(str, words), "-c", "constraints.txt", "-e", ".[test]"],
            cwd=str(root),
            stdout=file,
            stderr=subprocess.STDOUT,
        )
    if pip.returncode:
        raise Refusal(install_advice(log.read_text(encoding="utf-8", errors="replace")))


def install_advice(output):
    if any(word in output for word in OFFLINE):
        reason = "The packages could not be fetched: no connection to the package index. Is the network away?"
    elif "No space left on device" in output:
        reason = "The disk is full: the packages need about a gigabyte while they are installed."
    else:
        reason = "The packages could not be installed: " + last_line(output)
    return reason + "\nRun this again when that is mended; what pip said is in .lab/setup.log."


def last_line(output):
    errors = [line for line in output.splitlines() if line.startswith(("ERROR", "error"))]
    lines = errors or [line for line in output.splitlines() if line.strip()] or ["no reason was given"]
    return lines[-1].strip()


# --- JupyterLab -----------------------------------------------------------------------------------------------------


def lab_options(arguments):
    """(options for us, options for JupyterLab)."""
    parser = argparse.ArgumentParser(prog="lab.py", add_help=False, allow_abbrev=False)
    parser.add_argument("--no-browser", action="store_true")
    parser.add_argument("--port", type=int)
    parser.add_argument("--ip", default="localhost")
    return parser.parse_known_args(arguments)


def start_lab(python, options, passed_on):
    """Open JupyterLab on the first notebook and wait until it ends."""
    port = choose_port(options.ip, options.port)
    words = lab_command(python, options.ip, port, options.no_browser) + passed_on
    print(f"JupyterLab opens at port {port}; stop it with Ctrl-C in this window.", flush=True)
    return call(words, JUPYTERLAB_WORKSPACES_DIR=str(ROOT / ".lab" / "workspaces"), JUPYTER_PREFER_ENV_PATH="1")


def lab_command(python, ip, port, no_browser):
    """The command line that opens JupyterLab on the first notebook; the token stays on."""
    return [
        python,
        "-m",
        "jupyterlab",
        f"--ServerApp.root_dir={ROOT}",
        f"--ServerApp.ip={ip}",
        f"--ServerApp.port={port}",
        f"--LabApp.default_url=/lab/tree/{FIRST_NOTEBOOK}",
        "--LabApp.extension_manager=readonly",
        "--ServerApp.kernel_websocket_connection_class=labkit.stage.connection.PromptConnection",
        "--FileContentsManager.pre_save_hook=labkit.live.saving.keep_language",
        *(["--no-browser"] if no_browser else []),
    ]


def choose_port(ip, wanted=None):
    """The wanted port, or the first free one from 8888 on; says so when it is another."""
    if wanted is not None:
        if not 0 < wanted < 65536:
            raise Refusal(f"A port is a number from 1 to 65535, and {wanted} is none.")
        if not is_free(ip, wanted):
            raise Refusal(f"Port {wanted} is taken. Choose another with --port, or leave the option out.")
        return wanted
    for port in range(FIRST_PORT, FIRST_PORT + PORTS):
        if is_free(ip, port):
            if port != FIRST_PORT:
                print(f"Port {FIRST_PORT} is taken (another JupyterLab?), so this one takes {port}.")
            return port
    raise Refusal(f"The ports {FIRST_PORT} to {FIRST_PORT + PORTS - 1} are all taken. Choose another with --port.")


def is_free(ip, port):
    """Whether a server may listen there, at every address a name stands for; refuses one this machine does not have."""
    own = False
    with contextlib.suppress(socket.gaierror):
        for family, kind, protocol, _, address in socket.getaddrinfo(ip, port, type=socket.SOCK_STREAM):
            try:
                with socket.socket(family, kind, protocol) as probe:
                    if os.name != "nt":
                        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                    probe.bind(address)
            except OSError as error:
                if error.errno in (errno.EADDRINUSE, errno.EACCES):
                    return False
                continue  # such as ::1 on a machine without IPv6
            own = True
    if not own:
        raise Refusal(f"{ip} is no address of this machine. Leave --ip out to listen on localhost.")
    return True


def call(words, folder=ROOT, **environment):
    """Run a command in a folder (this one by default) until it ends, handing signals on; returns its exit code."""
    process = subprocess.Popen(words, cwd=str(folder), env={"PYTHONUTF8": "1", **environment, **os.environ})
    if hasattr(signal, "SIGTERM"):
        signal.signal(signal.SIGTERM, lambda number, frame: process.terminate())
    while True:
        try:
            return process.wait()
        except KeyboardInterrupt:
            continue  # the command has received it too, and decides


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
