"""Lines and columns of a text file, whatever separates them.

Comma, semicolon, tab or blanks; decimal comma; comments behind `#`; a byte order mark; a header or none. Each row keeps
the number of its line, and every refusal names file and line.
"""

import contextlib
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..reading import regular

MAX_BYTES = 500_000_000
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.IGNORECASE)
DECIMAL_COMMA = re.compile(r"[+-]?\d+(,\d+)?([eE][+-]?\d+)?")
SHOWN = 40  # letters of a bad entry that a refusal repeats


class FileError(ValueError):
    """What is wrong with a file, in one sentence with its name and the line."""


@contextlib.contextmanager
def naming(*paths):
    """Whatever is refused within and names no file is a `FileError` that names these; None is a file not given."""
    try:
        yield
    except FileError:
        raise
    except ValueError as reason:
        raise FileError(f"{' and '.join(path.name for path in paths if path)}: {reason}") from None


@dataclass(frozen=True, eq=False)
class Table:
    """Rows of a file as text: name of the file, titles of its columns or None, cells row by row, and their lines."""

    name: str
    titles: tuple | None
    cells: list
    lines: np.ndarray
    from_comment: bool = False  # the titles stood behind a #: a hint, no more

    @property
    def width(self):
        """Number of columns."""
        return len(self.cells[0])

    def numbers(self, columns=None):
        """The cells of some columns (all by default) as floats, shape (n, k); refuses a cell that is none."""
        columns = range(self.width) if columns is None else columns
        picked = [[row[k] for k in columns] for row in self.cells]
        try:
            return np.array(picked, dtype=float).reshape(len(picked), -1)
        except ValueError:
            pass
        for row, line in zip(picked, self.lines):
            for entry in row:
                if not NUMBER.fullmatch(entry):
                    raise FileError(f"{self.name}, line {line}: expected a number, got {shown(entry)}")
        # Fortran's 1.0D+02
        return np.array([[float(re.sub("[dD]", "e", entry)) for entry in row] for row in picked])


def number_in(entry):
    """An entry as a float; NaN where it is no number."""
    try:
        return float(entry)
    except ValueError:
        return float("nan")


def shown(entry):
    """An entry as a refusal repeats it."""
    return "an empty cell" if entry == "" else repr(entry if len(entry) <= SHOWN else entry[:SHOWN] + "...")


def read_text(path):
    """The text of a file; refuses what is missing, a folder, empty, binary or beyond reason."""
    path = Path(path)
    if path.is_dir():
        raise FileError(f"{path.name}: expected a file, got a folder")
    try:
        if regular(path).stat().st_size > MAX_BYTES:
            raise FileError(f"{path.name}: the file has more than {MAX_BYTES // 10**6} million bytes")
        data = path.read_bytes()
    except FileNotFoundError:
        raise FileError(f"{path.name}: there is no such file") from None
    except (OSError, ValueError) as error:
        raise FileError(f"{path.name}: the file cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16", errors="replace")
    else:
        text = data.removeprefix(b"\xef\xbb\xbf").decode("utf-8", errors="replace")
    if "\0" in text:
        raise FileError(f"{path.name}: expected text, got binary data")
    if not text.strip():
        raise FileError(f"{path.name}: the file is empty")
    return text


def read_table(path):
    """The rows of a text file, as a `Table`.

    Raises
    ------
    FileError
        Naming file and line: no rows, or rows of different length.
    """
    name, titles, comment, rows = Path(path).name, None, None, []
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        content, _, remark = line.partition("#")
        if content.strip():
            rows.append((number, content))
        elif remark.strip() and not rows:
            comment = remark
    if not rows:
        raise FileError(f"{name}: the file holds comments alone, expected rows of numbers")
    separator, decimal = _separator(rows[-1][1] if len(rows) < 3 else rows[len(rows) // 2][1])
    cells = [split(line, separator, decimal) for _, line in rows]
    lines = np.array([number for number, _ in rows])
    words = [entry for entry in cells[0] if entry and not _starts_like_a_number(entry)]
    if 2 * len(words) > len(cells[0]) and not all(NUMBER.fullmatch(entry) for entry in words):
        titles = tuple(split(rows[0][1], separator, False))
        cells, lines = cells[1:], lines[1:]
        if not cells:
            raise FileError(f"{name}: the file holds a header alone, expected rows of numbers")
    from_comment = False
    if titles is None and comment is not None:
        words = next((w for w in (split(comment, separator, False), comment.split()) if len(w) == len(cells[0])), ())
        from_comment = bool(words) and not any(NUMBER.fullmatch(word) for word in words)
        titles = tuple(words) if from_comment else None
    _refuse_ragged(name, titles, cells, lines)
    return Table(name, titles, cells, lines, from_comment)


def _starts_like_a_number(entry):
    return bool(re.match(r"[+-]?\.?\d", entry))


def _refuse_ragged(name, titles, cells, lines):
    width = len(titles) if titles else len(cells[0])
    for row, line in zip(cells, lines):
        if len(row) != width:
            where = "as the header has" if titles else f"as line {lines[0]} has"
            raise FileError(f"{name}, line {line}: expected {width} entries, {where}, got {len(row)}")


def _separator(line):
    """(separator or None for blanks, whether numbers have a decimal comma), judged by one row of numbers."""
    for mark in (";", "\t"):
        if mark in line:
            return mark, True
    if "," not in line:
        return None, False
    words = line.split()
    if len(words) > 1 and all(DECIMAL_COMMA.fullmatch(word) for word in words):
        return None, True
    return ",", False


def split(line, separator, decimal):
    """The cells of a line; blanks around them and quotes are dropped, a separator at the very end ends the line."""
    line = line.strip(" \r\n") if separator == "\t" else line.strip()
    cells = line.split(separator)
    if separator and len(cells) > 1 and not cells[-1].strip():
        cells.pop()
    cells = [cell.strip().strip("\"'") for cell in cells] if separator or '"' in line else cells
    return [cell.replace(",", ".") for cell in cells] if decimal else cells
