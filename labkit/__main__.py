"""`python -m labkit VERB ...`: the command line of an installed workbook; `lab.py` hands its verbs on to this.

calibrate KIND FILES   your own poses in, a calibration with covariance, outliers and advice out
localize FILES         your own log in, the path with its covariance out
collect FOLDERS        submitted notebooks in, marks, a page on the class and feedback pages out
"""

import sys
from importlib import import_module

from .verbs.arguments import run

VERBS = {"calibrate": "calibrate", "localize": "localize", "collect": "collect"}


def main(arguments=None):
    """Run one verb; returns the exit code."""
    words = sys.argv[1:] if arguments is None else list(arguments)
    if not words or words[0] in ("-h", "--help", "help"):
        print(__doc__.strip())
        return 0
    if words[0] not in VERBS:
        print(f"There is no verb {words[0]!r}. There are {', '.join(VERBS)}.", file=sys.stderr)
        return 1
    return run(import_module(f".verbs.{VERBS[words[0]]}", __package__).main, words[1:])


if __name__ == "__main__":
    sys.exit(main())
