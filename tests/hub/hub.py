"""The hub of docs/hub.md, set up and started by the very commands that stand there."""

import contextlib
import os
import re
import shutil
import socket
import subprocess
import time
import urllib.request

from labkit.exercises import source

ROOT = source.ROOT
PLACE, PASSWORD = "/opt/labkit", "choose-one"


def commands():
    """The lines of the first block of docs/hub.md."""
    text = (ROOT / "docs" / "hub.md").read_text(encoding="utf-8")
    return re.search(r"(?:^    .+\n)+", text, re.M)[0].replace("    ", "", 1).replace("\n    ", "\n").splitlines()


def what_is_missing():
    """Why the commands cannot be run here, or an empty text."""
    missing = [name for name in ("bash", "npm", "node") if not shutil.which(name)]
    return f"{' and '.join(missing)} not found: JupyterHub's proxy needs it" if missing else ""


def set_up(place):
    """Run all commands but the last, installing into `place`; returns a reason why that was impossible, or nothing."""
    for line in commands()[:-1]:
        done = subprocess.run(
            ["bash", "-c", line.replace(PLACE, str(place))], cwd=ROOT, capture_output=True, text=True, errors="replace"
        )
        if done.returncode:
            return f"{line}: {' '.join((done.stdout + done.stderr).split())[-400:]}"
    return ""


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
            process.wait(30)
        except subprocess.TimeoutExpired:
            process.kill()


def wait_for(process, address, log, seconds=60):
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
