"""Reading what students handed in: folders and zip files as Moodle, ILIAS and nbgitpuller leave them.

Whatever is damaged becomes a sentence in `problems`; nothing here runs a student's code.
"""

import hashlib
import io
import json
import os
import re
import unicodedata
import zipfile
import zlib
from collections import Counter
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

from ..reading import regular
from . import library

LARGEST = 100 << 20  # bytes of one notebook
DEEPEST = 4  # zip files within zip files
MOST = 50_000  # files in all
CELLS, CHARACTERS = 2000, 200_000  # of a notebook; no chapter comes near
PAUSE = 15 * 60  # seconds without a cell that count as a pause
MOODLE = re.compile(r"(?P<name>.+?)_(?P<id>\d+)_assignsubmission_(?:file|onlinetext)_?(?P<rest>.*)")
ILIAS = re.compile(r"(?P<name>[^_]+_.+)_(?P<id>\d{3,})")
SKIPPED = re.compile(r"(__MACOSX|\.ipynb_checkpoints|\.git|\.Trash.*|\._.*|\.DS_Store|Thumbs\.db|desktop\.ini)$")


class Unreadable(Exception):
    """A file that is no notebook; the message says why, in one sentence."""


@dataclass
class File:
    """One file handed in: `where` are the folders and the name, `read` gives its bytes."""

    where: tuple
    read: object
    path: Path | None = None  # where it lies, unless in a zip file


@dataclass
class Student:
    """Everything one student handed in; `key` is the number or the folder that tells him or her apart."""

    key: str
    name: str
    files: list = field(default_factory=list)


@dataclass
class Notebook:
    """The code cells of a notebook, the chapter they belong to, the minutes spent on each exercise, if recorded."""

    chapter: str
    cells: list
    minutes: dict


def students(paths, problems):
    """The `Student`s in folders and zip files, by key; what cannot be opened goes to `problems` as (place, why)."""
    found = {}
    for path in map(Path, paths):
        files = []
        try:
            _collect(path, files, problems)
        except OSError as error:
            problems.append((path.name, f"cannot be read: {why(error)}"))
        for file, (key, name) in zip(files, _owners(path, files)):
            student = found.setdefault(key, Student(key, name))
            student.files.append(file)
    return [found[key] for key in sorted(found)]


def _collect(path, files, problems):
    if path.is_dir():
        for folder, folders, names in os.walk(path):
            folders[:] = sorted(name for name in folders if not SKIPPED.match(name))
            for name in sorted(names):
                file = Path(folder) / name
                where = tuple(unicodedata.normalize("NFC", part) for part in file.relative_to(path).parts)
                _add(File(where, lambda file=file: _bytes(file), file), files, 0)
    elif path.is_file():
        _add(File((unicodedata.normalize("NFC", path.name),), lambda: _bytes(path), path), files, 0)
    else:
        words = "is neither a file nor a folder" if path.exists() else "there is no such file or folder"
        problems.append((path.name, words))


def _bytes(path):
    if regular(path).stat().st_size > LARGEST:
        raise Unreadable(f"is larger than {LARGEST >> 20} MB")
    return path.read_bytes()


def _add(file, files, depth):
    """A file, or what is in it if it is a zip file."""
    if SKIPPED.match(file.where[-1]) or len(files) >= MOST:
        return
    if not file.where[-1].lower().endswith(".zip"):
        files.append(file)
        return
    try:
        if depth >= DEEPEST:
            raise Unreadable("is a zip file within too many others")
        archive = zipfile.ZipFile(regular(file.path) if file.path else io.BytesIO(file.read()))
        for info in sorted(archive.infolist(), key=lambda info: info.filename):
            parts = tuple(part for part in _name(info).split("/") if part not in ("", ".", ".."))
            if info.is_dir() or not parts or any(SKIPPED.match(part) for part in parts):
                continue
            inner = File((*file.where, *parts), lambda archive=archive, info=info: _unzipped(archive, info))
            _add(inner, files, depth + 1)
    except (Unreadable, zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
        files.append(File(file.where, _raising(f"cannot be unpacked: {why(error)}")))


def why(error):
    """What an error says, without the name of the file: students' names may stand in it."""
    return getattr(error, "strerror", None) or str(error)


def _raising(words):
    def read():
        raise Unreadable(words)

    return read


def _name(info):
    """The name in a zip file; an old program's bytes are read as UTF-8 where they are."""
    name = info.filename
    if not info.flag_bits & 0x800:
        try:
            name = name.encode("cp437").decode("utf-8")
        except (UnicodeEncodeError, UnicodeDecodeError):
            name = info.filename
    return unicodedata.normalize("NFC", name.replace("\\", "/"))


def _unzipped(archive, info):
    if info.file_size > LARGEST:
        raise Unreadable(f"is larger than {LARGEST >> 20} MB")
    try:
        with archive.open(info) as file:
            data = file.read(LARGEST + 1)
    except (zipfile.BadZipFile, zlib.error, EOFError, OSError, RuntimeError, NotImplementedError) as error:
        raise Unreadable(f"cannot be unpacked: {error}") from None
    if len(data) > LARGEST:
        raise Unreadable(f"is larger than {LARGEST >> 20} MB")
    return data


def _owners(path, files):
    """(key, name) of the student of each file."""
    shared = os.path.commonprefix([file.where[:-1] for file in files]) if files else ()
    for file in files:
        yield _by_pattern(file.where) or _by_folder(path, file.where, len(shared))


def _by_pattern(where):
    for part in where:
        found = MOODLE.fullmatch(part) or (ILIAS.fullmatch(part) if part != where[-1] else None)
        if found:
            return found["id"], found["name"].replace("_", " ")
    return None


def _by_folder(path, where, shared):
    """One folder a student: the first folder that not all files share, or the last that they do."""
    folders = where[:-1]
    if not folders:
        name = Path(where[-1]).stem
    elif len(folders) > shared:
        name = folders[shared]
    else:
        name = folders[-1] if shared and path.is_dir() and len(folders) > 1 else Path(where[shared]).stem
    name = name.removesuffix(".zip")
    return name, name


# --- notebooks ------------------------------------------------------------------------------------------------------


def digest(data):
    """What tells two files apart; the draws follow from it, so that the same file is judged alike under any name."""
    return hashlib.sha256(data).hexdigest()


def parse(data):
    """The `Notebook` in a file.

    Raises
    ------
    Unreadable
        With the reason in one sentence.
    """
    try:
        found = json.loads(data)
    except (ValueError, RecursionError) as error:
        at = f" (line {error.lineno})" if hasattr(error, "lineno") else ""
        raise Unreadable(f"is no notebook: its JSON is broken{at}" if data.strip() else "is empty") from None
    cells = _cells(found)
    if not cells:
        raise Unreadable("is no notebook: it holds no code cells")
    if len(cells) > CELLS or sum(len(source) for source, _ in cells) > CHARACTERS:
        raise Unreadable(f"holds more than {CELLS} code cells or {CHARACTERS} characters of code")
    chapter = chapter_of([source for source, _ in cells])
    return Notebook(chapter, [source for source, _ in cells], _minutes(cells))


def _cells(found):
    """(source, when it was run or None) of each code cell; of a notebook of version 3, too."""
    cells = found.get("cells") if isinstance(found, dict) else None
    if cells is None and isinstance(found, dict) and isinstance(found.get("worksheets"), list):
        cells = [cell for sheet in found["worksheets"] if isinstance(sheet, dict) for cell in sheet.get("cells") or []]
    code = []
    for cell in cells if isinstance(cells, list) else []:
        if isinstance(cell, dict) and cell.get("cell_type") == "code":
            source = cell.get("source", cell.get("input", ""))
            source = "".join(map(str, source)) if isinstance(source, list) else source
            if isinstance(source, str):
                code.append((source, _time(cell)))
    return code


def _time(cell):
    """When a cell was last run, in seconds, where JupyterLab was asked to record it."""
    try:
        return datetime.fromisoformat(
            cell["metadata"]["execution"]["iopub.execute_input"].replace("Z", "+00:00")
        ).timestamp()
    except (KeyError, TypeError, AttributeError, ValueError):
        return None


def chapter_of(sources):
    """The chapter of a notebook, read from its cells: what `course` is asked for, or the exercises it checks."""
    text = "\n".join(sources)
    names = library.chapter_names()
    asked = [name.replace("_", "-") for name in re.findall(r"""course\(\s*["']([\w-]+)["']""", text)]
    known = Counter(name for name in asked if name in names)
    if known:
        return known.most_common(1)[0][0]
    used = set(re.findall(r"(?<![\w.])ex\.(\w+)", text)) | set(re.findall(r"""ex\.predict\(\s*["'](\w+)["']""", text))
    fits = {name: len(used & {item.id for item in library.load(name).items}) for name in names} if used else {}
    best = max(fits, key=fits.get, default=None)
    if not best or not fits[best]:
        raise Unreadable("belongs to no chapter: no cell says `course(...)`")
    return best


def _minutes(cells):
    """{exercise id: minutes before its cell was last run}, pauses left out; empty where no times were recorded."""
    runs = sorted((time, source) for source, time in cells if time is not None)
    minutes = Counter()
    for (before, _), (time, source) in zip(runs, runs[1:]):
        for id in set(re.findall(r"(?<![\w.])ex\.(\w+)", source)) - {"predict"}:
            if time - before < PAUSE:
                minutes[id] += (time - before) / 60
    return {id: round(amount, 1) for id, amount in sorted(minutes.items())}
