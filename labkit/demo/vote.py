"""Ballots: two rounds on a question, hidden while they are open; in memory only, and without names.

A device is a random word in its cookie. It counts once a round; until the round is closed its last answer counts.
"""

import csv
import io
import math
from collections import Counter
from dataclasses import dataclass, field

ROUNDS = 2
MAX_DEVICES = 2000  # that vote in one round
MAX_SIZE = 1e12  # of a number
BINS = 8


class Refused(ValueError):
    """A vote that does not count, and why, in one sentence."""


@dataclass
class Ballot:
    """The votes on one question: each round {device: number of its choice, or a number}."""

    asked: object
    rounds: list = field(default_factory=list)
    open: bool = False

    def shown(self):
        """What the wall may show: counts always, the distribution of closed rounds alone."""
        closed = self.rounds[: len(self.rounds) - self.open]
        labels, shares = self._distribution(closed)
        return {
            "open": self.open,
            "round": len(self.rounds),
            "counts": [len(votes) for votes in self.rounds],
            "labels": labels,
            "shares": shares,
        }

    def _distribution(self, closed):
        """(label of each bar, [votes for each of them] of each round)."""
        if self.asked.choices:
            return list(self.asked.choices), [
                [Counter(votes.values())[k] for k in range(len(self.asked.choices))] for votes in closed
            ]
        values = [value for votes in closed for value in votes.values()]
        if not values:
            return [], [[] for _ in closed]
        edges = _edges(sorted(values))
        labels = [_label(low, high) for low, high in zip(edges, edges[1:])]
        labels[0] = f"below {edges[1]:g}" if min(values) < edges[0] else labels[0]
        labels[-1] = f"{edges[-2]:g} and more" if max(values) >= edges[-1] else labels[-1]
        return labels, [
            [sum(_bin(value, edges) == k for value in votes.values()) for k in range(len(labels))] for votes in closed
        ]


def _edges(values):
    """Edges of at most `BINS` bins of a round width that hold the middle nine tenths of the values."""
    low, high = values[len(values) // 20], values[-1 - len(values) // 20]
    width = (high - low) / (BINS - 2) or max(abs(low), 1.0) / 10
    decade = 10.0 ** math.floor(math.log10(width))
    width = next(step * decade for step in (1, 2, 5, 10) if step * decade >= width * (1 - 1e-9))
    first, last = math.floor(low / width), math.floor(high / width)
    return [float(f"{k * width:.12g}") for k in range(first, last + 2)]


def _bin(value, edges):
    return sum(value >= edge for edge in edges[1:-1])


def _label(low, high):
    return f"{low:g} to {high:g}"


class Votes:
    """All ballots of a session; at most one is open."""

    def __init__(self):
        self.ballots, self.now, self.version = {}, None, 0

    @property
    def ballot(self):
        """The ballot that phones see, or None before the first."""
        return self.ballots.get(self.now)

    def open(self, key, asked):
        """Open the next round on a question; another one that is still open is closed."""
        ballot = self.ballots.setdefault(key, Ballot(asked))
        if ballot.open:
            return
        if len(ballot.rounds) == ROUNDS:
            raise Refused("Both rounds on this question are held.")
        self.close()
        ballot.rounds.append({})
        ballot.open, self.now = True, key
        self.version += 1

    def close(self):
        """Close the open round; its distribution may be shown from now on."""
        if self.ballot and self.ballot.open:
            self.ballot.open = False
            self.version += 1

    def cast(self, device, key, number, answer):
        """Count a device's answer in round `number` on the question `key`.

        Raises
        ------
        Refused
            When that round is not open, or the answer is none.
        """
        ballot = self.ballot
        if ballot is None or not ballot.open or (key, number) != (self.now, len(ballot.rounds)):
            raise Refused("This round is closed.")
        votes = ballot.rounds[-1]
        if device not in votes and len(votes) >= MAX_DEVICES:
            raise Refused(f"{MAX_DEVICES} devices have voted, and no more are counted.")
        votes[device] = _read(ballot.asked, answer)

    def seen_by(self, device):
        """What a phone shows: the question, whether its round is open, and the device's own answer."""
        ballot = self.ballot
        if ballot is None:
            return {"version": self.version, "open": False, "question": ""}
        mine = ballot.rounds[-1].get(device)
        return {
            "version": self.version,
            "open": ballot.open,
            "key": self.now,
            "round": len(ballot.rounds),
            "question": ballot.asked.question,
            "choices": ballot.asked.choices,
            "unit": ballot.asked.unit,
            "mine": mine,
        }

    def csv(self):
        """All closed rounds as a table: question, round, answer, whether it is right, votes. No device is in it."""
        file = io.StringIO()
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["key", "question", "round", "answer", "right", "votes"])
        for key, ballot in self.ballots.items():
            for number, votes in enumerate(ballot.rounds[: len(ballot.rounds) - ballot.open], start=1):
                for answer, count in _counted(ballot.asked, votes):
                    right = "" if ballot.asked.answer is None else _mark(ballot.asked, answer)
                    table.writerow([key, _cell(ballot.asked.question), number, _cell(answer), right, count])
        return file.getvalue()


def _read(asked, answer):
    """An answer as it is counted."""
    if asked.choices:
        if type(answer) is not int or not 0 <= answer < len(asked.choices):
            raise Refused("That is none of the choices.")
        return answer
    try:
        number = float(str(answer)[:40].strip().replace(",", ".").replace("−", "-"))
    except ValueError:
        number = math.nan
    if not abs(number) <= MAX_SIZE:
        raise Refused("A number is asked for, such as 12.5.")
    return number


def _counted(asked, votes):
    if asked.choices:
        counts = Counter(votes.values())
        return [(choice, counts[k]) for k, choice in enumerate(asked.choices)]
    return sorted(Counter(votes.values()).items())


def _mark(asked, answer):
    right = answer == asked.answer if asked.choices else abs(answer - asked.answer) <= asked.within * abs(asked.answer)
    return "yes" if right else "no"


def _cell(value):
    """Text that no spreadsheet takes for a formula."""
    return f"'{value}" if isinstance(value, str) and value[:1] in "=+-@" else value
