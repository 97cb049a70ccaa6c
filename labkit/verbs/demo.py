"""`python lab.py demo [NN ...]`: the chapters' Stages full window, question first; with --vote the room answers."""

import asyncio

from .arguments import Parser


def main(arguments=None):
    """Raises what `arguments.run` turns into a sentence."""
    options = _parser().parse_args(arguments)
    from ..demo import notes, program, show  # the mathematics takes a second to load: not for --help

    counts = notes.counted(options.marks) if options.marks else {}
    shown = program.program(options.chapters, options.questions)
    try:
        asyncio.run(show.run(shown, options, counts))
    except KeyboardInterrupt:
        print("\nThe demo has ended.")


def _parser():
    parser = Parser("demo", description="Show Stages full window, one at a time, each with its question.")
    parser.add_argument("chapters", nargs="*", metavar="NN", help="chapters to show, by number or name (all)")
    parser.add_argument("--no-browser", action="store_true", help="open none; the address is printed")
    parser.add_argument("--port", type=int, help="of the page (the first free one from 8890 on)")
    parser.add_argument("--ip", default="127.0.0.1", help="address to listen on (127.0.0.1: this machine alone)")
    parser.add_argument("--vote", action="store_true", help="let phones in the same network vote on the questions")
    parser.add_argument("--vote-ip", metavar="IP", help="the address phones reach, where the one found is another")
    parser.add_argument("--questions", metavar="TOML", help="own questions; docs/lecturer.md shows one")
    parser.add_argument("--marks", metavar="DIR", help="what `collect` wrote: the notes count its named mistakes")
    return parser
