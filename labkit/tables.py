"""Reading the tables in `data/`: CSV with a header, refused with the file and the line when something is missing."""

import csv

import numpy as np

from .places import DATA


def read_table(name, text=()):
    """Columns of `data/<name>` as {header: array}; the columns listed in `text` stay strings, all others become floats.

    Raises
    ------
    ValueError
        Naming file and line: an empty file, a duplicate or missing column, a row of another length, no number.
    """
    path = DATA / name
    with open(path, newline="", encoding="utf-8") as file:
        reader = csv.reader(file)
        header = next(reader, None)
        if not header:
            raise ValueError(f"{name}: the file is empty, expected a header line")
        if len(set(header)) != len(header):
            raise ValueError(f"{name}, line 1: a column name appears twice in {header}")
        missing = set(text) - set(header)
        if missing:
            raise ValueError(f"{name}, line 1: expected a column {sorted(missing)[0]!r}, got {header}")
        columns = {key: [] for key in header}
        for row in reader:
            if len(row) != len(header):
                raise ValueError(f"{name}, line {reader.line_num}: expected {len(header)} entries, got {len(row)}")
            for key, entry in zip(header, row):
                columns[key].append(entry if key in text else _number(entry, name, reader.line_num, key))
    return {key: np.array(values) for key, values in columns.items()}


def _number(entry, name, line, column):
    try:
        return float(entry)
    except ValueError:
        raise ValueError(f"{name}, line {line}: expected a number in column {column!r}, got {entry!r}") from None
