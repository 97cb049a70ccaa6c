"""Which single slip would explain it? A misprint is proved by trying all, on every printed thing that takes part."""

import functools
from collections.abc import Mapping

SLIPS = (
    "sign lost",
    "two digits swapped",
    "one digit wrong",
    "one digit too many",
    "one digit missing",
    "decimal point moved",
)
HERE = "here"  # the name of the row's own printed number among those that are tried


def single_slips(text):
    """All numbers one slip away from a printed one: {corrected text: slip}, the rarer slips giving way to the commoner.

    >>> single_slips("12")["21"]
    'two digits swapped'
    """
    return dict(_single_slips(text))


@functools.lru_cache(maxsize=1024)  # a search asks for the same printed numbers again and again
def _single_slips(text):
    sign, body = ("-", text[1:]) if text.startswith("-") else ("", text)
    if not body.replace(".", "", 1).isdigit():
        raise ValueError(f"text must be a plain decimal number, got {text!r}")
    found = {}

    def add(candidate, slip, new_sign=sign):
        if candidate.replace(".", "", 1).isdigit() and not (
            len(candidate) > 1 and candidate[0] == "0" and candidate[1] != "."
        ):
            found.setdefault(new_sign + candidate, slip)

    add(body, SLIPS[0], "" if sign else "-")
    places = [i for i, c in enumerate(body) if c != "."]
    for i, j in zip(places, places[1:]):
        swapped = list(body)
        swapped[i], swapped[j] = body[j], body[i]
        add("".join(swapped), SLIPS[1])
    for i in places:
        for digit in "0123456789":
            add(body[:i] + digit + body[i + 1 :], SLIPS[2])
    for i in places:
        add(body[:i] + body[i + 1 :], SLIPS[3])
    for i in range(len(body) + 1):
        for digit in "0123456789":
            add(body[:i] + digit + body[i:], SLIPS[4])
    digits = body.replace(".", "")
    for i in range(len(digits)):
        add((digits[:i] or "0") + "." + digits[i:], SLIPS[5])
    found.pop(text, None)
    return found


def explained_by(printed, holds, others=single_slips):
    """Every single slip that would make the arithmetic hold.

    Parameters
    ----------
    printed : dict
        {name: what is printed there}, all that takes part; `HERE` names the entry in question.
    holds : callable
        Takes such a dictionary, says whether the arithmetic holds.
    others : callable or dict
        From what is printed to what may have been meant, or {name: alternatives}; without it the slips of a number.

    Returns
    -------
    found : dict
        {name: list of what would have to stand there}; empty where nothing is wrong, or no single slip explains it.
    """
    if holds(dict(printed)):
        return {}
    found = {}
    for name, text in printed.items():
        tried = others.get(name, ()) if isinstance(others, Mapping) else others(text)
        right = [other for other in tried if holds({**printed, name: other})]
        if right:
            found[name] = right
    return found
