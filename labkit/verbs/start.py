"""`labkit start [FOLDER]`: JupyterLab on the first notebook; the notebooks are copied into FOLDER the first time.

A checkout is opened as it is when no folder is named. Any other option goes to JupyterLab.
"""

from pathlib import Path

from ..places import IS_CHECKOUT, ROOT
from . import jupyter, notebook_copies
from .arguments import Parser, Refusal

FIRST_NOTEBOOK = "00_start_here.ipynb"


def main(arguments):
    """Lay the notebooks out if need be, open JupyterLab and wait until it ends; returns its exit code."""
    named = bool(arguments) and not arguments[0].startswith("-")
    options, passed_on = parser().parse_known_args(arguments[named:])
    jupyter.refuse_root(passed_on)
    folder, notebook = place(arguments[0] if named else None)
    return jupyter.open_lab(folder, notebook, options, passed_on)


def parser():
    """The parser of the options that are not JupyterLab's alone."""
    words = f"FOLDER, where you work, comes first; {__doc__.splitlines()[-1]}"
    parser = Parser("start [FOLDER]", description=words, allow_abbrev=False)
    parser.add_argument("--no-browser", action="store_true", help="open no browser")
    parser.add_argument("--port", type=int, help=f"where it listens; else the first free one from {jupyter.FIRST_PORT}")
    parser.add_argument("--ip", default="localhost", help="the address it listens at (localhost: this machine alone)")
    return parser


def place(folder):
    """(folder that JupyterLab shows, first notebook in it), the notebooks laid out there."""
    if folder is None:
        if not IS_CHECKOUT:
            raise Refusal("Which folder shall hold your notebooks? For example: labkit start workbook")
        return ROOT, f"notebooks/{FIRST_NOTEBOOK}"
    new = notebook_copies.give(folder)
    if new:
        print(f"{len(new)} notebooks are laid out in {folder}.", flush=True)
    return Path(folder).resolve(), FIRST_NOTEBOOK
