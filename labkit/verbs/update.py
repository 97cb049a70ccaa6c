"""`labkit update FOLDER`: this edition's notebooks into a folder; what was written there stays."""

from . import notebook_copies
from .arguments import Parser


def main(arguments):
    """Update the folder and say what changed."""
    parser = Parser("update", description="The notebooks of this edition into FOLDER; what you wrote stays.")
    parser.add_argument("folder", metavar="FOLDER", help="the folder named to start")
    said = notebook_copies.update(parser.parse_args(arguments).folder)
    print("\n".join(said) or "The notebooks are those of this edition already.")
