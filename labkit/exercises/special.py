"""A property of answers: right at special places too, where many an answer is right elsewhere and wrong there.

A draw in `Exercise.noisy` is part of the judgment, and an explanation is looked for where it fails. The places here are
many and remote, such as no shift at all, a pose far away or three points in a thousand: they are visited once all else
is right, in every check, and whoever is wrong there hears of the place.
"""

import copy
import inspect

from . import metrics
from .budget import seconds

LONGEST = 0.5  # seconds of processor time for all places: a slow but right function gets as far as it gets


def right_where(reference, metric, *places):
    """A property for `Exercise.properties`.

    Parameters
    ----------
    reference : function
    metric : Metric
    places : (str, function)
        What is special, as it follows "right so far, but not ", and a draw of a random generator: arguments, or None
        where nothing can be asked.

    Returns
    -------
    holds : function
        Of the student's function and a random generator: None, or a sentence.
    """

    def holds(student, rng):
        began = seconds()
        for words, draw in places:
            if seconds() - began > LONGEST:
                return None
            args = draw(rng)
            told = args and _told(student, args, reference, metric)
            if told:
                return f"right so far, but not {words}: {told}."
        return None

    return holds


def default_is(name, value):
    """A property for `Exercise.properties`: an argument that may be left out is then what it is in the cell as given.

    Whoever has no default at all hears of it where the function is called without.
    """

    def holds(student, rng):
        parameter = inspect.signature(student).parameters.get(name)
        found = value if parameter is None or parameter.default is parameter.empty else parameter.default
        if isinstance(found, int | float) and found == value:
            return None
        return f"right, but where `{name}` is left out it is {found!r} in yours, in the cell as it was given {value!r}."

    return holds


def _told(student, args, reference, metric):
    """What is wrong for these arguments, "" where nothing is."""
    expected = reference(*copy.deepcopy(args))
    try:
        result = student(*copy.deepcopy(args))
    except Exception as error:
        return f"there it raises {type(error).__name__}, {error}".rstrip(", .")
    try:
        off = [d for d in metric.deviations(metric.admit(result, expected), expected) if not d.within]
    except metrics.Refused as refusal:
        return str(refusal).rstrip(".")
    return str(off[0]).rstrip(".") if off else ""
