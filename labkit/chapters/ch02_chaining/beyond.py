"""Exercises of chapter 2 beyond its core: the lab sheet's files, read and written."""

import functools
import re

import numpy as np

from ...exercises import metrics
from ...exercises.engine import Exercise
from ...exercises.outcome import Mistake
from ...exercises.special import right_where
from ...files.text import number_in

# --- draws ---


def system(rng):
    """Three points of a system (mm), one number of which needs all its digits."""
    points = rng.uniform(-500, 500, (3, 3)) * 10.0 ** rng.integers(-3, 1, (3, 3))
    points[rng.integers(3), rng.integers(3)] = 0.1 + 0.2
    return points


def system_near_0(rng):
    """Three points whose numbers have any size, some of them so small that no fixed number of decimals shows them."""
    return (rng.uniform(-9, 9, (3, 3)) * 10.0 ** rng.permutation(np.arange(-16, 11, 3)).reshape(3, 3),)


def text_of_system(rng, comments=False, commas=False):
    """The text of a system as someone typed it: blanks and tabs, empty lines, one of them of blanks, a whole number in each
    point, perhaps comments, with blanks before them and without, and decimal commas; without these, exponents."""
    lines, blanks = [], rng.permutation([" ", "   ", "\t"])
    behind, empty = rng.permutation(["  # touched 2 times", "# again", ""]), rng.permutation(["", "  ", None])
    for k, point in enumerate(system(rng).round(int(rng.integers(5, 9)))):
        indent = " " * int(rng.integers(3))
        lines += [f"{indent}# measured by hand, part 2"] * comments
        lines += [] if empty[k] is None else [str(empty[k])]
        numbers = [repr(float(value)) for value in point]
        numbers[k] = str(int(rng.integers(-400, 400)))  # a whole number, without a point
        if not comments and not commas:
            numbers[k - 1] = f"{point[k - 1]:.6e}"
        lines.append(" " * int(rng.integers(3)) + str(blanks[k]).join(numbers) + str(behind[k]) * comments)
    text = "\n".join(lines) + "\n" * int(rng.integers(3))
    return (text.replace(".", ",") if commas else text,)


TEXTS = tuple(
    functools.partial(text_of_system, comments=comments, commas=commas)
    for comments, commas in ((False, False), (True, False), (False, True), (True, True))
)


def _typed(*lines, end="\n"):
    """A draw of one text, as it stands here."""
    return lambda rng: ("\n".join(lines) + end,)


PLAIN = ("1.5 -2.5 3.5", "4.25 5.5 6.5")
TYPED = tuple(
    (f"of a text {words}", _typed(*PLAIN, *lines))
    for words, lines in (
        ("with a number like +1.5", ["+1.5 2.0 +3.25"]),
        ("with a number like .5", [".5 2.0 -.25"]),
        ("with a number like 5.", ["5. 2.0 -3."]),
        ("with a number like 1.5E3", ["1.5E3 2.0E+01 -3.0E-02"]),
        ("with a number like 1.5e-3", ["1.5e-3 2.0e+01 -3e2"]),
        ("with a number like 1,5e2", ["1,5e2 2.0 3,5"]),
        ("with both 1,5 and 1.5", ["1,5 2.5 3"]),
        ("with a number that is 0", ["0 -0.0 0.0"]),
        ("with numbers above 1000", ["1500.5 -2000000.25 12345678.5"]),
        ("with blanks at the end of a line", ["1.5 2.0 3.5  \t"]),
        ("with two # in a line", ["1.5 2.0 3.5 # one # two"]),
        ("with a # and nothing behind it", ["1.5 2.0 3.5 #", "#"]),
        ("with three numbers in a comment", ["# 7.5 8.5 9.5", "1.5 2.0 3.5"]),
        ("with a comment at the end", ["1.5 2.0 3.5", "# the end"]),
        ("with a comma in a comment", ["1.5 2.0 3.5 # first, second"]),
        ("with the same point twice", [PLAIN[0]]),
        ("with empty lines at the end", ["1.5 2.0 3.5", "", "  ", ""]),
    )
)
SIZES = tuple(
    (f"of {words}", lambda rng, entry=entry: (system(rng) * entry,))
    for words, entry in (
        ("numbers far below 1e-100", 1e-200),
        ("numbers far above 1e100", 1e200),
        ("numbers about 1e-30", 1e-30),
        ("numbers about 1e20", 1e20),
        ("a coordinate that is 0", np.array([[1.0, 1, 0], [0, 1, 1], [1, 0, 1]])),
    )
)


# --- references and wrong variants ---


def read_system(text):
    """Reference of the exercise: the three points, or one sentence with the line."""
    points = []
    for number, line in enumerate(text.splitlines(), start=1):
        entries = [number_in(entry) for entry in line.split("#")[0].replace(",", ".").split()]
        if entries and not (len(entries) == 3 and np.isfinite(entries).all()):
            raise ValueError(f"line {number}: expected three numbers x y z, got {line!r}")
        points += [entries] if entries else []
    if len(points) != 3:
        raise ValueError(f"expected three points, got {len(points)}")
    return np.array(points)


def write_system(points):
    """Reference of the exercise: a line a point, all digits."""
    return "\n".join(" ".join(repr(float(value)) for value in point) for point in points) + "\n"


def _reading(change):
    """The same with each line changed before it is taken apart."""
    return lambda text: read_system("\n".join(change(line) for line in text.splitlines()))


def _plainly(text):
    """Splits lines and converts entries, nothing else."""
    return np.array([[float(entry) for entry in line.split()] for line in text.splitlines() if line.strip()])


def _written(form):
    """A line a point in another format."""
    return lambda points: "\n".join(" ".join(format(value, form) for value in point) for point in points)


class Points(metrics.Numbers):
    """Points of a file (mm); one that holds NaN let through what is no number."""

    def admit(self, result, expected):
        try:
            return super().admit(result, expected)
        except metrics.Refused:
            if isinstance(result, np.ndarray | list | tuple) and _holds_nan(result):
                words = (
                    "NaN stands among your points, as `number_in` and `np.genfromtxt` give it for what is no number: does "
                    "1,5 get its point first, and are comments left out"
                )
                raise metrics.Refused(words) from None
            raise


def _holds_nan(result):
    try:
        return bool(np.isnan(np.asarray(result, dtype=float)).any())
    except (TypeError, ValueError):
        return False


class ReadBack(np.ndarray):
    """Points that were read from a student's text, told from an array that was returned."""


class reads_back(metrics.Metric):
    """What is read back from a text, beside what was to be written; nothing may be lost."""

    def admit(self, result, expected):
        if isinstance(result, ReadBack):
            return result
        if not isinstance(result, str):
            raise metrics.Refused(f"expected a text, got {metrics._describe(result)}")
        try:
            return read_system(result).view(ReadBack)
        except ValueError as fault:
            raise metrics.Refused(f"what you wrote cannot be read: {fault}{_why_unread(result)}") from None

    def deviations(self, result, expected):
        off = float(np.abs(result - self.admit(expected, expected)).max())
        return [metrics.Deviation("what is read back", off, "mm", 0.0)]

    def parts(self, result, expected):
        return [("", metrics.Numbers(0.0, "mm"), result, self.admit(expected, expected))]


def _why_unread(text):
    """What of a text is no number that can be read, as a further sentence, where it is known."""
    if "np.float" in text:
        return ". This is how `repr` and `!r` write a number of NumPy: make it Python's first, by `float` or `tolist`"
    return ". A heading needs a # before it" if _begins_with_words(text) else ""


def _begins_with_words(text):
    """Whether the first line of a text is none of three points, which stand below it."""
    heading, _, points = text.lstrip("\n").partition("\n")
    try:
        return bool(heading) and read_system(points) is not None
    except ValueError:
        return False


FAULTS = (
    ("a word in place of a number", "12.5 seven 3.0"),
    ("two numbers", "12.5 3.0"),
    ("four numbers", "12.5 3.0 4.0 5.0"),
    ("nan", "12.5 nan 3.0"),
    ("inf", "12.5 3.0 -inf"),
    ("a letter behind a number", "12.5 7x 3.0"),
    ("six numbers", "12.5 3.0 4.0 5.0 6.0 7.0"),
    ("words alone", "x y z"),
    ("two numbers before a comment", "12.5 3.0 # by hand"),
    ("1e999, which no float holds", "12.5 1e999 3.0"),
)


def names_the_line(student, rng):
    """A sentence about the first fault that is not refused with its line, None if all are.

    The points stand far down, below empty lines and comments, at a line whose number is none of those in it. Each fault
    stands in place of each point, then the number of points is wrong, then each fault stands below three good points.
    """
    good = write_system(system(rng).round(3)).splitlines()
    above = [""] * EMPTY_FIRST + ["# a comment", "", "  "] * int(rng.integers(20, 30))
    first = int(rng.integers(3))
    for what, bad in FAULTS:
        for at in np.roll(range(3), -first):
            told = _misread(student, [*above, *good[:at], bad, *good[at + 1 :]], len(above) + at + 1, f"holds {what}")
            if told:
                return told
    for count in (1, 2, 4, 6, 0):
        words = f"a file of {count} point{'s' * (count > 1)}" if count else "an empty text"
        if _refusal(student, [*good, *good][:count], words) is None:
            return f"{words} is no system: {ACCEPTED}"
    told = _misplaced(student, above, good)
    if told:
        return told
    for what, bad in FAULTS:
        number = len(above) + len(good) + 1
        told = _misread(student, [*above, *good, bad], number, f"stands below three points and holds {what}")
        if told:
            return told
    return None


EMPTY_FIRST = 2  # lines, which `strip` takes off
LONGEST = 150  # characters of a sentence that are shown
REFUSED = "that must raise a ValueError"
ACCEPTED = f"{REFUSED}, yours returned without one."


def _misplaced(student, above, good):
    """What is wrong with the refusal of a fourth point that repeats the first, None if no other line than its own is named."""
    first, number = len(above) + 1, len(above) + len(good) + 1
    refusal = _refusal(
        student, [*above, *good, good[0]], f"a file of four points, the fourth as the first, in line {number}"
    )
    named = [int(digits) for digits in re.findall(r"\bline (\d+)", refusal or "")]
    if not named or number in named:
        return None
    where = f"line {number} of a file is a fourth point, the same as the first in line {first}"
    return f"{where}: your sentence names another line. It says: {_quoted(refusal)}."


def _misread(student, lines, number, what):
    """What is wrong with the refusal of a text with one fault in such a line, None if nothing is."""
    where = f"line {number} of a file {what}"
    refusal = _refusal(student, lines, f"a text, line {number} of which {what}")
    if refusal is None:
        return f"{where}: {ACCEPTED}"
    if _names(refusal, number):
        return None
    why, kept = "", (str.strip, _content, _uncommented)
    if _counts(refusal, number - 1):
        why = " The first line is line 1: is it 0 in your count?"
    elif _counts(refusal, number - EMPTY_FIRST):
        why = " Empty lines at the beginning are lines of the file too: does `strip` take them off before lines are counted?"
    elif any(_counts(refusal, sum(map(bool, map(held, lines[:number])))) for held in kept):
        why = " Empty lines and comments are lines of the file too: are they left out before lines are counted?"
    return f"{where}: your sentence does not name the line. It says: {_quoted(refusal)}.{why}"


def _quoted(sentence):
    """A sentence as it was raised, the end of a long one left out."""
    return repr(sentence if len(sentence) <= LONGEST else f"{sentence[:LONGEST]} ...")


def _content(line):
    """What stands before a comment."""
    return line.partition("#")[0].strip()


def _uncommented(line):
    """Whether a line is no comment from its beginning on."""
    return not line.strip().startswith("#")


def _counts(refusal, number):
    """Whether a sentence says that it is this line; the number of points that it may hold as well is none."""
    return bool(re.search(rf"\bline\W{{0,3}}{number}\b", refusal, re.IGNORECASE))


def _names(refusal, number):
    """Whether a sentence holds this number, and not as a part of another one."""
    return bool(re.search(rf"(?<![-\d])(?<!\d[.,]){number}(?![.,]?\d)\b", refusal))


def _refusal(student, lines, words):
    """What a ValueError says of a text, None where it is taken; another error is told with what the text is, in words."""
    try:
        student("\n".join(lines))
    except ValueError as refusal:
        return str(refusal)
    except Exception as error:
        error.given = f"{words}: {REFUSED}"
        raise
    return None


FILES = [
    Exercise(
        "read_system",
        reference=read_system,
        draw=TEXTS,
        metric=Points(1e-12, "mm"),
        properties=(names_the_line, right_where(read_system, Points(1e-12, "mm"), *TYPED)),
        hints=(
            "Go through the lines with their numbers; a line that holds nothing but a comment holds no point.",
            "Cut each line at `#`, make commas points, split it at blanks. Three finite numbers are a point; whatever else is left is a fault, and its line is named.",
            "`points = []\nfor number, line in enumerate(text.splitlines(), start=1):\n"
            "    entries = [number_in(e) for e in line.split('#')[0].replace(',', '.').split()]\n"
            "    if entries and not (len(entries) == 3 and np.isfinite(entries).all()):\n"
            "        raise ValueError(f'line {number}: expected x y z, got {line!r}')\n"
            "    points += [entries] if entries else []\n"
            "if len(points) != 3:\n    raise ValueError(f'expected three points, got {len(points)}')\n"
            "return np.array(points)`",
        ),
        mistakes=[
            Mistake(
                _plainly,
                "A comment goes from # to the end of its line, blanks before it or not, and no further: cut each line at its #, before you split it, "
                "and leave out a line of which nothing is left.",
                id="read-comments",
            ),
            Mistake(
                lambda text: _plainly(re.sub("#.*", "", text)),
                "Some write 1,5 for 1.5, and a line may hold several of them: put a point in the place of every comma, before you split the line into words.",
                id="read-comma",
            ),
            Mistake(
                _reading(lambda line: line.replace(",", "")),
                "You dropped the decimal comma: 1,5 became 15. Replace it by a point.",
                id="read-comma-dropped",
            ),
            Mistake(
                lambda text: read_system(text).T,
                "Your points stand in columns. One row a point: origin, x_point, y_point.",
                id="read-columns",
            ),
            Mistake(
                lambda text: read_system(text)[[0, 2, 1]],
                "The last two points have changed places: the second point of the file is the one on the x axis.",
                id="read-order",
            ),
            Mistake(
                lambda text: read_system(text) - read_system(text)[0],
                "You subtracted the origin. The three points are returned as they stand in the file.",
                id="read-relative",
            ),
            Mistake(
                lambda text: read_system(text).ravel(),
                "These are the right nine numbers in one row: shape (3, 3), one row a point.",
                id="read-flat",
            ),
            Mistake(
                lambda text: read_system(text).round(3),
                "You rounded. A reader keeps what the file holds.",
                id="read-rounded",
            ),
            Mistake(
                lambda text: read_system(text).astype(np.float32),
                "Your points are in single precision, seven digits. A reader keeps all that the file holds: an array of floats as NumPy makes it.",
                id="read-single",
            ),
        ],
    ),
    Exercise(
        "write_system",
        reference=write_system,
        draw=lambda rng: (system(rng),),
        fixed={"points": "a system is always three points"},
        metric=reads_back(),
        noisy=(
            system_near_0,
            reads_back(),
            "right, but not for points among whose numbers some are tiny and some are huge:",
        ),
        properties=(right_where(write_system, reads_back(), *SIZES),),
        hints=(
            "One line a point, blanks in between. How many digits does a double need so that none is lost?",
            "17 significant digits always suffice, and so does `repr`, which writes as few as needed.",
            "`return '\\n'.join(' '.join(repr(float(v)) for v in point) for point in points)`",
        ),
        mistakes=[
            *(
                Mistake(
                    _written(f".{decimals}f"),
                    "A fixed number of decimals cuts off the last digits, all of them of a number that is small enough. Take 17 significant digits, "
                    "as `.17g` does, or `repr(float(v))`.",
                    id=f"write-decimals-{decimals}",
                )
                for decimals in (10, 12, 16, 17, 18, 20)
            ),
            Mistake(
                _written(".6f"),
                "Six decimals, as the sheet prints them, lose the rest: what is read back is another number. Take 17 significant digits, or `repr(float(v))`.",
                id="write-six",
            ),
            Mistake(
                _written(".3f"),
                "Three decimals look tidy and lose the rest. Take 17 significant digits, or `repr(float(v))`.",
                id="write-three",
            ),
            Mistake(
                lambda points: write_system(points[::-1]),
                "The points stand in reverse order. The origin comes first, then x_point, then y_point.",
                id="write-reversed",
            ),
            *(
                Mistake(
                    _written(form),
                    f"{digits} significant digits are kept here, as by `{form}`: what is read back is another number. It takes 17, as `.16e` has them, or `repr(float(v))`.",
                    id=f"write-{digits}-with-exponent",
                )
                for form, digits in (("e", 7), (".10e", 11), (".12e", 13))
            ),
            Mistake(
                _written("g"),
                "`g` keeps six significant digits, and so does `{v:g}`. Take 17, or `repr(float(v))`.",
                id="write-g",
            ),
            Mistake(
                _written(".15g"),
                "15 significant digits nearly suffice: 0.30000000000000004 comes back as 0.3. It takes 17, or `repr(float(v))`.",
                id="write-fifteen",
            ),
            Mistake(
                _written(".16g"),
                "16 significant digits suffice for many numbers, not for all. It takes 17, or `repr(float(v))`.",
                id="write-sixteen",
            ),
            Mistake(
                lambda points: write_system(points.T),
                "Your lines hold the columns: x of all points, then y, then z. One line a point.",
                id="write-columns",
            ),
            Mistake(
                lambda points: write_system(points - points[0]),
                "The origin is subtracted. The points are written as they are.",
                id="write-relative",
            ),
            Mistake(
                lambda points: write_system(np.abs(points)),
                "The signs have got lost.",
                id="write-abs",
            ),
            Mistake(
                _written(".15f"),
                "15 places after the point are too few for a small number: its digits begin later. Take 17 significant digits, or `repr(float(v))`.",
                id="write-fifteen-places",
            ),
            Mistake(
                lambda points: write_system(points.astype(np.float32)),
                "You wrote single precision, seven digits. Keep the doubles.",
                id="write-single",
            ),
        ],
    ),
]
