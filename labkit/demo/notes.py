"""What the lecturer alone reads beside a card: what to show, what tempts, and the mistakes named nearby.

`notes.toml` holds a line of each for every card, by its key. Mistakes are those of the exercises that stand close to it
in the notebook; with the verdicts of a class (`python lab.py collect`) the most frequent come first, with their count.
"""

import functools
import json
import tomllib
from collections import Counter
from pathlib import Path

from ..reading import regular

FILE = Path(__file__).with_name("notes.toml")
MANY = 6


@functools.cache
def _all():
    return tomllib.loads(FILE.read_text(encoding="utf-8"))


def of(key):
    """{"show": ..., "tempts": ...} of a card; empty texts where there is no note."""
    return {"show": "", "tempts": "", **_all().get(key, {})}


def mistakes(exercises, counts):
    """(exercise id, text, count) of the named mistakes of some exercises, the most frequent first, at most `MANY`."""
    found = {}
    for exercise in exercises:
        for mistake in exercise.mistakes:
            key = exercise.id, mistake.text
            found[key] = found.get(key, 0) + counts.get(mistake.id, 0)
    made = [(exercise, text, count) for (exercise, text), count in found.items() if count or not counts]
    if not counts:
        made = _from_each_in_turn(made)
    return sorted(made, key=lambda m: -m[2])[:MANY]


def _from_each_in_turn(found):
    """The first mistake of each exercise, then the second of each, and so on."""
    turn = Counter()
    rows = []
    for row in found:
        rows.append((turn[row[0]], row))
        turn[row[0]] += 1
    return [row for _, row in sorted(rows, key=lambda r: r[0])]


def counted(folder):
    """{mistake id: how often} in a folder that `collect` has written.

    Raises
    ------
    ValueError
        Where there are no verdicts.
    """
    files = sorted((Path(folder) / "judged").glob("*.json"))
    if not files:
        raise ValueError(f"{folder}: expected the folder that `collect` has written, and found no verdicts in it")
    counts = Counter()
    for file in files:
        try:
            items = json.loads(regular(file).read_text(encoding="utf-8")).get("items", {})
            counts.update(v["mistake"] for v in items.values() if v.get("mistake"))
        except (ValueError, AttributeError, TypeError, RecursionError):
            raise ValueError(f"{file}: expected a verdict as `collect` writes it") from None
    return counts
