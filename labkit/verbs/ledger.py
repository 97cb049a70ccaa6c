"""`labkit ledger`: what the four documents print, recomputed; `--strict` refuses rows that read their own answer."""

from ..documents import strict
from ..documents.ledger import rows
from .arguments import Parser, Refusal


def main(arguments):
    """Print every row, or results and claims alone and what is to be refused."""
    parser = Parser("ledger", description="What the four documents print as results and claims, recomputed.")
    parser.add_argument(
        "--strict",
        action="store_true",
        help="results and claims by document and status; refuses rows that read their own printed answer",
    )
    if not parser.parse_args(arguments).strict:
        print(strict.as_text())
        return
    print(strict.counts_text(rows()))
    faults = strict.faults()
    if faults:
        raise Refusal("\n".join(faults))
    print("No row reads its own printed answer; every status is the one its computation gives.")
