"""`labkit VERB ...` or `python -m labkit VERB ...`: the command line; `lab.py` hands its verbs on to this."""

import os
import sys
from importlib import import_module

from .verbs import VERBS, table
from .verbs.arguments import COMMAND, Refusal, run

THREADS = "1"  # of linear algebra: on matrices as small as the workbook's, several wait for each other


def main(arguments=None):
    """Run one verb; returns the exit code."""
    os.environ.setdefault("OMP_NUM_THREADS", THREADS)  # before anything loads NumPy; kernels inherit it
    return run(_verb, sys.argv[1:] if arguments is None else list(arguments))


def _verb(words):
    if not words or words[0] in ("-h", "--help", "help"):
        print(table(COMMAND))
        return 0
    if words[0] == "--version":
        print(version())
        return 0
    if words[0] not in VERBS:
        raise Refusal(f"There is no verb {words[0]!r}. There are {', '.join(VERBS)}; see: {COMMAND} --help")
    return import_module(f".verbs.{words[0]}", __package__).main(words[1:])


def version():
    """The version of the installed workbook."""
    from importlib import metadata

    return metadata.version("labkit")


if __name__ == "__main__":
    sys.exit(main())
