"""A reader's copies of the blank notebooks: given to a folder, reset, updated without touching what was written.

What a folder was given is remembered in its `.labkit.json`, a digest for every cell. A cell that is still as it was
given takes the text of a new edition; a cell in which something was written stays, with its output.
"""

import contextlib
import hashlib
import itertools
import json
import os
from pathlib import Path

from ..places import IS_CHECKOUT, ROOT
from ..reading import is_taken, regular
from .arguments import Refusal, named

GIVEN = ".labkit.json"


def blank_notebooks():
    """{name: text} of the blank notebooks; in a checkout, where those in place may be worked in, from their sources."""
    if IS_CHECKOUT:
        from ..exercises import source
        from . import build

        return {f"{path.stem}.ipynb": build.as_text(build.blank_notebook(path)) for path in source.sources()}
    return {path.name: path.read_text(encoding="utf-8") for path in sorted((ROOT / "notebooks").glob("[0-9]*.ipynb"))}


def give(folder):
    """Copy those notebooks into a folder that it does not hold yet; returns their names."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    new = {name: text for name, text in blank_notebooks().items() if not is_taken(folder / name)}
    _remember(folder, new)  # first: a notebook that is there and not remembered would count as written in
    for name, text in new.items():
        write(folder / name, text)
    return list(new)


def update(folder):
    """Bring the notebooks of a folder to this edition; returns a sentence for each that changed or could not be read.

    Raises
    ------
    Refusal
        When the folder holds other things and no notebook of the course.
    """
    folder, said = Path(folder), []
    fresh, given = blank_notebooks(), _given(folder)
    if not any(is_taken(folder / name) for name in fresh) and folder.exists() and any(folder.iterdir()):
        raise Refusal(f"{folder} holds no notebook of the course, but other things: name a folder of its own.")
    for name, text in fresh.items():
        try:
            whole, sentence = _brought(folder / name, text, given.get(name, {}))
        except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
            said.append(f"{name} cannot be read as a notebook and is left as it is")
            continue
        if whole:
            write(folder / name, whole)
        _remember(folder, {name: text})  # at once: who is stopped here has no cell that seems to be written in
        said += [sentence] if sentence else []
    return said


def _brought(path, text, given):
    """(one notebook brought to this edition, a sentence about it); both are empty when it is so already."""
    if not is_taken(path):
        return text, f"{path.name} is new"
    merged, kept = merge(_read(path), json.loads(text), given)
    if merged is None:
        return "", ""
    text = json.dumps(merged, indent=1, ensure_ascii=False) + "\n"
    kept = f"; {kept} of its cells stay as you wrote them" if kept else ""
    # half of a letter is written as JSON does: \ud800
    return text.encode("utf-8", "backslashreplace").decode(), f"{path.name} is brought to this edition{kept}"


def merge(mine, theirs, given):
    """(the notebook `mine` with the cells of `theirs` where nothing was written, number of cells that were kept).

    `given` are the digests of the cells that `mine` began with. The notebook is None when nothing changes. A cell that
    was deleted stays away; one's own cells, and those the new edition has dropped, stay behind the cell they followed.
    """
    own = {}
    for cell in mine["cells"]:
        own.setdefault(cell.get("id"), cell)
    written = [c for c in mine["cells"] if own[c.get("id")] is not c or given.get(c.get("id")) != digest(c)]
    cells = []
    for cell in theirs["cells"]:
        old = own.get(cell["id"])
        if old is None and cell["id"] not in given:
            cells.append(cell)
        elif old is not None:
            cells.append(old if _is_in(old, written) or digest(old) == digest(cell) else cell)
    place = 0
    for cell in mine["cells"]:
        found = next((k for k, other in enumerate(cells) if other.get("id") == cell.get("id") is not None), None)
        if _is_in(cell, written) and not _is_in(cell, cells):
            cells.insert(place, cell)
            place += 1
        elif found is not None:
            place = found + 1
    same = [digest(cell) for cell in cells] == [digest(cell) for cell in mine["cells"]]
    return (None, 0) if same else ({**mine, "cells": cells}, len(written))


def _is_in(cell, cells):
    return any(cell is other for other in cells)


def digest(cell):
    """A few characters that change with what a cell says."""
    words = "".join(cell["source"]) if isinstance(cell["source"], list) else cell["source"]
    return hashlib.sha256(f"{cell['cell_type']}\n{words}".encode("utf-8", "surrogatepass")).hexdigest()[:16]


WHERE_OPEN = "If it is open in JupyterLab, choose File > Reload Notebook from Disk there before you save."


def fresh_copy(path, text, shown):
    """Put a notebook's beginning in place; one that differs is kept beside it. Returns what was done, and what to do
    where it is open: JupyterLab goes on showing what it has read, and saving that would undo this.
    """
    if path.is_file() and path.read_text(encoding="utf-8", errors="replace") == text:
        return f"{shown} is as in the beginning already"
    kept = ""
    if is_taken(path):
        copies = (path.with_name(f"{path.stem}.my-copy-{k}.ipynb") for k in itertools.count(1))
        copy = next(copy for copy in copies if not is_taken(copy))
        os.replace(path, copy)
        kept = f"; yours is kept as {shown[: -len(path.name)]}{copy.name}.\n{WHERE_OPEN}"
    write(path, text)
    return f"{shown} is as in the beginning{kept}"


def write(path, text):
    """Write a file whole or not at all; a link stays one, and what it leads to is written."""
    path = Path(os.path.realpath(path))
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".{path.name}.partial")
    try:
        with named(path):
            partial.write_text(text, encoding="utf-8", newline="\n")
            os.replace(partial, path)
    finally:
        with contextlib.suppress(OSError):  # a read-only disk refuses this as well, and would name the part
            partial.unlink(missing_ok=True)


def _read(path):
    return json.loads(regular(path).read_text(encoding="utf-8"))


def _given(folder):
    try:
        found = _read(folder / GIVEN)
    except (OSError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _remember(folder, texts):
    """Note what the cells of these notebooks begin with from now on."""
    cells = {name: {cell["id"]: digest(cell) for cell in json.loads(text)["cells"]} for name, text in texts.items()}
    given = {**_given(folder), **cells}
    if given != _given(folder):
        write(folder / GIVEN, json.dumps(given, indent=1) + "\n")
