"""What holds of every answer where sizes mean nothing: right for arguments far larger or smaller than others, too.

Draws keep to what a workshop or a robot has. Whoever drops what is small beside the rest, clips what is large or takes
one root for another below a limit is right there alone.
"""

import copy

import numpy as np

from .special import right_where

FACTORS = {1e3: "a thousand times as large", 1e-3: "a thousandth as large"}
UNLIKE = 100.0  # times as large is one unit, or one standard deviation, of a covariance
STIRRED = 1e-12  # relative; where it changes what is expected, any other way of computing it may be as far off


def right_in_all_sizes(exercise):
    """A property of the answers to an exercise: `exercise.sizes` names the arguments, those in one string together."""
    cases = [(names.split(), factor) for names in exercise.sizes for factor in FACTORS]
    places = [(_words(names, factor), _resized(exercise, names, factor)) for names, factor in cases]
    for name in exercise.sizes:
        if name.startswith("cov"):
            words = f"where one standard deviation of `{name}` is a hundred times as large as in other draws"
            places.append((words, _resized(exercise, [name], UNLIKE, one_unlike)))
    return right_where(exercise.reference, exercise.metric, *places)


def _words(names, factor):
    several = [f"`{name}`" for name in names]
    return f"where {' and '.join(several)} {'are' if several[1:] else 'is'} {FACTORS[factor]} as in other draws"


def _resized(exercise, names, factor, change=None):
    """A draw with these arguments multiplied, or changed; None where rounding decides what comes of them."""
    change = change or resized

    def draw(rng):
        args = exercise.cases[rng.integers(len(exercise.cases))](rng)
        changed, stirred = (
            tuple(change(arg, by) if name in names else arg for name, arg in zip(exercise.arguments, args))
            for by in (factor, factor * (1 + STIRRED))
        )
        expected = exercise.reference(*copy.deepcopy(changed))
        return changed if exercise.metric.equal(exercise.reference(*stirred), expected) else None

    return draw


def resized(value, factor):
    """A number, an array or a list of them multiplied by a factor; of poses, (..., 4, 4), the translation alone."""
    if isinstance(value, list | tuple):
        return type(value)(resized(part, factor) for part in value)
    if np.shape(value)[-2:] == (4, 4) and (value[..., 3, :] == [0, 0, 0, 1]).all():
        return value * np.array(3 * [[1, 1, 1, factor]] + [[1, 1, 1, 1]])
    return factor * value


def one_unlike(cov, factor):
    """A covariance of which the first standard deviation is so many times as large, its correlations as they were."""
    units = np.ones(len(cov))
    units[0] = factor
    return cov * np.outer(units, units)
