"""Command lines that refuse in one sentence: no usage dump, no traceback, exit code 1."""

import argparse
import contextlib
import errno
import io
import json
import os
import sys

from ..places import IS_CHECKOUT

COMMAND = "python lab.py" if IS_CHECKOUT else "labkit"  # what a reader types before a verb
REASONS = {
    errno.ENOSPC: "the disk is full",
    errno.EDQUOT: "your share of the disk is full",
    errno.EROFS: "the disk is read-only",
    errno.EACCES: "you have no permission",
    errno.EPERM: "you have no permission",
    errno.ENOENT: "there is no such file or folder",
    errno.EISDIR: "it is a folder",
    errno.EEXIST: "a file of this name is there already",
    errno.ENOTDIR: "it is, or lies in, a file and not a folder",
    errno.EMFILE: "too many files are open",
    errno.ENAMETOOLONG: "the name is too long",
}
HELD = (32, 33)  # what Windows says of a file that another program has open, and of a part of one that it has locked


class Refusal(Exception):
    """A reason to stop, said in one or two sentences."""


class Parser(argparse.ArgumentParser):
    """The argument parser of a verb; its faults are one sentence."""

    def __init__(self, verb="", prog=None, **options):
        super().__init__(prog=prog or f"{COMMAND} {verb}", **options)

    def error(self, message):
        raise Refusal(f"{self.prog}: {message}; see: {self.prog} --help")


def run(work, arguments=None):
    """Exit code of `work(arguments)`: what it returns, or 1 with what it refused on standard error."""
    sys.stdout = sys.stdout or io.StringIO()  # whoever started this has closed it, or never gave it one
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # a console that has no letter for it stops nothing
    try:
        code = work(sys.argv[1:] if arguments is None else arguments) or 0
        sys.stdout.flush()
        return code
    except (Refusal, ValueError) as reason:
        return _refuse("\n".join(" ".join(line.split()) for line in str(reason).splitlines()))
    except MemoryError:
        return _refuse("The data are too large for this machine's memory.")
    except RecursionError:
        return _refuse("The data are nested too deeply to be read.")
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # whoever read has seen enough
        return 1
    except OSError as error:
        return _refuse(sentence(error))
    except KeyboardInterrupt:
        _refuse("\nInterrupted. What was begun is redone the next time.")
        return 130


def _refuse(words):
    print(words, file=sys.stderr)
    return 1


def sentence(error):
    """What the operating system refused, in a sentence that names the file."""
    if getattr(error, "winerror", None) in HELD:
        return f"{error.filename or 'A file'}: another program has it open. Close it there, and run this again."
    reason = REASONS.get(error.errno) or error.strerror or str(error)
    return f"{error.filename or 'A file or what is printed'}: {reason}."


@contextlib.contextmanager
def named(path):
    """What the operating system refuses within bears the file's name: of a write to a full disk it says none."""
    try:
        yield
    except OSError as error:
        error.filename = str(path)  # and not that of a part of it, or none
        raise


def write(folder, **files):
    """Write {name: text or data} into a folder, made if need be; data become JSON."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        name = name.replace("__", ".")
        text = content if isinstance(content, str) else json.dumps(content, indent=1, allow_nan=False) + "\n"
        with named(folder / name):
            (folder / name).write_text(text, encoding="utf-8")
