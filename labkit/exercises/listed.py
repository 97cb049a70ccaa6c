"""Right answers that return lists where arrays are meant: the cells that follow calculate with arrays."""

import functools

import numpy as np


def listed_in(result, expected):
    """Whether a result is a list (or tuple) where an array is meant; of several results, a tuple of this."""
    if isinstance(expected, tuple) and isinstance(result, list | tuple):
        return tuple(map(listed_in, result, expected))
    return isinstance(expected, np.ndarray) and isinstance(result, list | tuple)


def in_arrays(function, listed):
    """The function with arrays in the place of such lists, by what `listed_in` told; itself where there are none."""
    if not (any(listed) if isinstance(listed, tuple) else listed):
        return function

    @functools.wraps(function)
    def returning_arrays(*args, **kwargs):
        result = function(*args, **kwargs)
        if not isinstance(listed, tuple):
            return np.asarray(result)
        return tuple(np.asarray(part) if is_list else part for part, is_list in zip(result, listed))

    return returning_arrays
