"""The hub of docs/hub.md, set up and started by the very commands that stand there."""

import contextlib
import os
import re
import shutil
import signal
import socket
import subprocess
import time
import urllib.request

import lab
from labkit.exercises import source

ROOT = source.ROOT
PLACE, PASSWORD = "/opt/labkit", "choose-one"
SECONDS = 300  # for all that is installed: half a minute where nothing else runs and the registries are near
AWAY = (*lab.OFFLINE, "No matching distribution", "not found in the package registry", "error sending request")
AWAY += ("Failed to fetch", "dns error", "ENOTFOUND", "EAI_AGAIN", "ECONNREFUSED", "ECONNRESET", "ETIMEDOUT", "E404")
IMPATIENT = {"PIP_RETRIES": "1", "PIP_DEFAULT_TIMEOUT": "20", "UV_HTTP_TIMEOUT": "20", "UV_HTTP_RETRIES": "1"}
IMPATIENT |= {"npm_config_fetch_retries": "1", "npm_config_fetch_timeout": "20000"}
STOPPING = 120  # s a hub may take to end its students' servers
AHEAD = " --compile-bytecode"  # for the first start of a class; a quarter of the work where two students come


def commands():
    """The lines of the first block of docs/hub.md."""
    text = (ROOT / "docs" / "hub.md").read_text(encoding="utf-8")
    return re.search(r"(?:^    .+\n)+", text, re.M)[0].replace("    ", "", 1).replace("\n    ", "\n").splitlines()


def what_is_missing():
    """Why the commands cannot be run here, or an empty text."""
    if os.name == "nt":
        return "JupyterHub does not run on Windows"
    missing = [name for name in ("bash", "npm", "node") if not shutil.which(name)]
    return f"{' and '.join(missing)} not found: JupyterHub's proxy needs it" if missing else ""


def set_up(place, seconds=SECONDS):
    """Run all commands but the last, installing into `place`, but nothing is compiled `AHEAD`; returns why no registry
    answers here, or an empty text.

    Raises
    ------
    RuntimeError
        When a command fails otherwise, with what it said.
    """
    until = time.monotonic() + seconds
    for line in commands()[:-1]:
        process = subprocess.Popen(
            ["bash", "-c", line.replace(PLACE, str(place)).replace(AHEAD, "")],
            cwd=ROOT,
            env={**os.environ, **IMPATIENT},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            errors="replace",
            start_new_session=True,
        )
        try:
            said, _ = process.communicate(timeout=until - time.monotonic())
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
            return f"the registries are too slow: {seconds} s did not take `{line}` to its end"
        if process.returncode and is_away(said):
            return f"no registry answers `{line}`: {' '.join(said.split())[-300:]}"
        if process.returncode:
            raise RuntimeError(f"{line}:\n{said[-2000:]}")
    return ""


def is_away(said):
    """Whether pip, uv or npm say that a registry cannot be reached, or does not have what is asked for."""
    return any(word in said for word in AWAY)


@contextlib.contextmanager
def running(place):
    """The address of the hub that the last command starts; it ends with the block, and so do its students' servers.

    It ends as well with a test run that is killed: it lives as long as the pipe from this process is open.
    """
    port = free_ports()
    line = commands()[-1].replace(PLACE, str(place)).partition(" && ")[2]
    with (place / "hub.log").open("wb") as log:
        process = subprocess.Popen(
            ["bash", "-c", f"{{ read; kill $$; }} <&0 & exec env {line} </dev/null"],
            cwd=place,
            env={**os.environ, "HUB_PORT": str(port), "PWD": str(place)},
            stdin=subprocess.PIPE,
            stdout=log,
            stderr=subprocess.STDOUT,
        )
    address = f"http://127.0.0.1:{port}"
    try:
        wait_for(process, address, place / "hub.log")
        yield address
    finally:
        process.stdin.close()
        try:
            process.wait(STOPPING)
        finally:
            process.kill()
            with contextlib.suppress(FileNotFoundError):  # a hub that is killed leaves its servers behind
                subprocess.run(["pkill", "-KILL", "-f", str(place)])


def wait_for(process, address, log, seconds=120):
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline and process.poll() is None:
        with contextlib.suppress(OSError), urllib.request.urlopen(f"{address}/hub/login", timeout=5):
            return
        time.sleep(0.2)
    raise RuntimeError(f"the hub did not start:\n{log.read_text(errors='replace')[-2000:]}")


def free_ports(number=3):
    """The first of so many free ports in a row."""
    for port in range(18000, 19000, number):
        with contextlib.ExitStack() as stack, contextlib.suppress(OSError):
            for k in range(number):
                stack.enter_context(socket.socket()).bind(("127.0.0.1", port + k))
            return port
    raise RuntimeError("no free ports")
