"""`labkit progress`: all chapters with a bar of what is solved."""

from ..exercises import progress_text
from .arguments import Parser


def main(arguments):
    """Print it."""
    Parser("progress", description="What you have solved, over all chapters.").parse_args(arguments)
    print(progress_text())
