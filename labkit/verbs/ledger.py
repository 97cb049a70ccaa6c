"""`labkit ledger`: every number the four documents print, recomputed."""

from ..documents import ledger
from .arguments import Parser


def main(arguments):
    """Print it."""
    Parser("ledger", description="Every number the four documents print, recomputed.").parse_args(arguments)
    print(ledger.as_text())
