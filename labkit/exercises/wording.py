"""Arguments and results in a few characters, and sentences made whole."""

import inspect
import re

import numpy as np

SHOWN = 4  # entries of a set or vector that is shown whole
WHERE = "as long as|where|for|in|on|near|away|without|to"  # what an answer is said to be right of
RIGHT_WHERE = re.compile(f"^([Rr]ight)(?=, but not | (?!on ordinary )({WHERE}) )")
NOISY = "exact on the clean data tried, but noise enters otherwise than it should: on noisy data"


def shown_whole(value):
    """A number, word, set or short vector as it is shown whole; None for anything larger."""
    value = value.item() if isinstance(value, np.ndarray) and not value.ndim else value
    if isinstance(value, set | frozenset):
        plain = len(value) <= SHOWN and all(type(v) in (int, float, str) for v in value)
        words = ", ".join(sorted(map(short, value), key=lambda text: (len(text), text))) if plain else ""
        return f"{{{words}}}" if words else None if value else "set()"
    if isinstance(value, np.ndarray) and value.ndim == 1 and 0 < value.size <= SHOWN:
        return short(value)
    return short(value) if isinstance(value, str | int | float | np.generic) else None


def plainly(value):
    """A value with NumPy's numbers and words, within it too, as Python's, which are shown as one types them."""
    if isinstance(value, np.generic):
        return value.item()
    return type(value)(map(plainly, value)) if type(value) in (list, tuple, set) else value


def short(value):
    """An argument in a few characters."""
    value = plainly(value)
    if isinstance(value, np.ndarray):
        if value.size > 16:
            return f"<array of shape {value.shape}>"
        tiny = value.dtype.kind == "f" and 0 < np.abs(value).max(initial=0.0) < 1e-3
        words = np.array2string(value, precision=3, suppress_small=not tiny, separator=", ", max_line_width=100)
        return words.replace("\n", "")
    if inspect.isfunction(value):
        return value.__name__
    if isinstance(value, np.random.Generator):
        return "<Generator>"
    text = f"{value:.6g}" if isinstance(value, float) else repr(value)
    return text if len(text) <= 60 else f"<{type(value).__name__}>"


def joined(words, conjunction="and"):
    """Words in a row: "a", "a and b", "a, b and c"."""
    *first, last = words
    return f"{', '.join(first)} {conjunction} {last}" if first else last


def closed(sentence):
    """The sentence with a period, unless it ends already."""
    return sentence if sentence[-1:] in ".?:" else f"{sentence}."


def leading(words):
    """What an exercise says of the first special draw that fails, as a sentence, those behind it not tried; "" where it
    says nothing of its own.
    """
    return "" if words in (None, NOISY) else on_ordinary_draws(f"{words[0].upper()}{words[1:].rstrip(':')}.")


def on_ordinary_draws(text):
    """What is said to be right but for one kind of case, said of ordinary draws alone: other kinds may be wrong too."""
    return RIGHT_WHERE.sub(r"\1 on ordinary draws", text)
