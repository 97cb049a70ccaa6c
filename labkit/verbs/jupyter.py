"""Running JupyterLab: its command line, a free port, and what is refused or said before it starts."""

import contextlib
import errno
import os
import socket
import sys
import tempfile
import time
from pathlib import Path

from ..places import IS_CHECKOUT
from .arguments import COMMAND, Refusal, sentence
from .processes import call

FIRST_PORT, PORTS = 8888, 50
STARTING = 20  # seconds within which a port can be lost to another program
ATTEMPTS = 3
EVERYWHERE = ("0.0.0.0", "::", "", "*")


def is_root():
    return hasattr(os, "geteuid") and os.geteuid() == 0


def refuse_root(passed_on):
    """JupyterLab would refuse in a page of words.

    Raises
    ------
    Refusal
        As root, without `--allow-root` among the options.
    """
    if is_root() and "--allow-root" not in passed_on:
        raise Refusal(
            "JupyterLab does not start as root unless it is told to, because every notebook could then change the "
            "whole system. If that is meant, as in a container: "
            f"{COMMAND} {'' if IS_CHECKOUT else 'start FOLDER '}--allow-root"
        )


def open_lab(folder, notebook, options, passed_on):
    """Run JupyterLab; a port that another program takes in the meantime is replaced by the next free one."""
    if options.ip in EVERYWHERE:
        print(
            "JupyterLab will listen at every address of this machine, over plain HTTP: who can read the network can "
            "read the token. The token stays on.",
            flush=True,
        )
    places = {**own_places(folder), **places_without_a_home()}
    for _ in range(ATTEMPTS):
        port, begun = choose_port(options.ip, options.port), time.monotonic()
        print(f"JupyterLab starts at port {port}; stop it with Ctrl-C in this window.", flush=True)
        words = lab_command(sys.executable, folder, notebook, options.ip, port, options.no_browser) + passed_on
        code = call(words, **places)
        if not code or time.monotonic() - begun > STARTING or is_free(options.ip, port):
            return code
        print(f"Another program took port {port} in the meantime.", flush=True)
    raise Refusal("Other programs took every port that was tried. Choose one with --port.")


def own_places(folder):
    """What JupyterLab's environment holds: its workspaces lie beside the notebooks where that can be."""
    workspaces = folder / ".lab" / "workspaces"
    try:
        workspaces.mkdir(parents=True, exist_ok=True)
    except OSError:
        return {"JUPYTER_PREFER_ENV_PATH": "1"}
    return {"JUPYTER_PREFER_ENV_PATH": "1", "JUPYTERLAB_WORKSPACES_DIR": str(workspaces)}


def places_without_a_home():
    """Where JupyterLab and IPython keep their files when the home folder cannot be written; says so. Else nothing."""
    from jupyter_core import paths  # lab.py imports this module before anything is installed

    try:
        for place in (paths.jupyter_config_dir(), paths.jupyter_data_dir(), paths.jupyter_runtime_dir()):
            Path(place).mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=place) as file:
                file.write(b"labkit")
    except OSError as error:
        instead = tempfile.mkdtemp(prefix="labkit-")
        print(f"{sentence(error)} JupyterLab keeps its own files in {instead} this time.", flush=True)
        names = ("JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR", "IPYTHONDIR")
        return {name: str(Path(instead, name.lower())) for name in names}
    return {}


def lab_command(python, folder, notebook, ip, port, no_browser):
    """The command line that opens JupyterLab on a notebook; the token stays on. See `labkit.server` for the rest."""
    return [
        python,
        "-m",
        "jupyterlab",
        f"--ServerApp.root_dir={folder}",
        f"--ServerApp.ip={ip}",
        f"--ServerApp.port={port}",
        "--ServerApp.port_retries=0",
        f"--LabApp.default_url=/lab/tree/{notebook}",
        "--LabApp.extension_manager=readonly",
        *(["--no-browser"] if no_browser else []),
    ]


def choose_port(ip, wanted=None):
    """The wanted port, or the first free one from 8888 on; says so when it is another."""
    if wanted is not None:
        if not 0 < wanted < 65536:
            raise Refusal(f"A port is a number from 1 to 65535, and {wanted} is none.")
        if not is_free(ip, wanted):
            raise Refusal(f"Port {wanted} is taken, or not open to you. Choose another with --port, or leave it out.")
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
        for family, kind, protocol, _, address in socket.getaddrinfo(ip or None, port, type=socket.SOCK_STREAM):
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
