"""Programs that the command line starts and waits for."""

import os
import signal
import subprocess


def call(words, **environment):
    """Run a command until it ends, handing signals on; returns its exit code."""
    process = subprocess.Popen(words, env={"PYTHONUTF8": "1", **environment, **os.environ})
    for name in ("SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), lambda number, frame: process.terminate())
    while True:
        try:
            return process.wait()
        except KeyboardInterrupt:
            continue  # the command has received it too, and decides
