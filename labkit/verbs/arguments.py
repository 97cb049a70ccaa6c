"""Command lines that refuse in one sentence: no usage dump, no traceback, exit code 1."""

import argparse
import json
import sys


class Refusal(Exception):
    """A reason to stop, said in one sentence."""


class Parser(argparse.ArgumentParser):
    """An argument parser whose faults are one sentence."""

    def error(self, message):
        raise Refusal(f"{self.prog}: {message}; see: {self.prog} --help")


def run(work, arguments=None):
    """Exit code of `work(arguments)`: 0, or 1 with what it refused on standard error."""
    try:
        work(sys.argv[1:] if arguments is None else arguments)
    except (Refusal, ValueError) as reason:
        print(" ".join(str(reason).split()), file=sys.stderr)
        return 1
    except MemoryError:
        print("the data are too large for this machine's memory", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"{error.filename or 'a file'}: {error.strerror or error}", file=sys.stderr)
        return 1
    return 0


def write(folder, **files):
    """Write {name: text or data} into a folder, made if need be; data become JSON."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        name = name.replace("__", ".")
        text = content if isinstance(content, str) else json.dumps(content, indent=1, allow_nan=False) + "\n"
        (folder / name).write_text(text, encoding="utf-8")
