"""Reading the py:percent sources in `solutions/`: cells with stable ids, and the marked regions students do not get.

A cell begins with `# %% the-id` or `# %% the-id [markdown]`, optionally followed by `tags=["solution"]` (the cell is in
the solved notebook only), `tags=["student"]` (in the blank one only) or nbval's tags. `### BEGIN SOLUTION` and
`### END SOLUTION` enclose what becomes `...  # your code here` in the blank notebook; where such lines already stand
directly above the region, as in `angle_deg = ...  # your code here`, they are kept instead, and the solved notebook
drops them.
The build, `lab.py reset` and the exercises' `.solution()` and `.starter()` all read with it.
"""

import ast
import json
import re
import textwrap
from dataclasses import dataclass
from pathlib import Path

from ..places import ROOT
from ..reading import regular

STUB = "...  # your code here"
BUILD_TAGS = frozenset(("solution", "student"))
TAGS = BUILD_TAGS | {"nbval-ignore-output", "nbval-check-output"}

_HEADER = re.compile(r"# %% (?P<id>[a-z0-9]+(?:[-_][a-z0-9]+)*)(?P<markdown> \[markdown\])?(?: tags=(?P<tags>\[.*\]))?")
_BEGIN, _END = "### BEGIN SOLUTION", "### END SOLUTION"
_MAGIC = re.compile(r"\s*(?:[%!?]|[\w.\[\]]+\?{1,2}\s*$)")
_MAGIC_IN_COMMENT = re.compile(r"#\s*(?:%{1,2}|!)[A-Za-z]")
_STUB_LINE = re.compile(r"(?:.*[\s=(,])?\.\.\.\s+# your code here\s*")


class SourceError(ValueError):
    """A source that cannot be built, said as "file, line N: what is wrong"."""


@dataclass(frozen=True)
class Cell:
    """One cell: `kind` "code" or "markdown", `text` with its solution markers, `line` the line number of its header."""

    kind: str
    id: str
    tags: tuple
    text: str
    line: int


def sources(folder=ROOT / "solutions"):
    """All chapter sources `NN_name.py` of a folder, in order."""
    return sorted(Path(folder).glob("[0-9][0-9]_*.py"))


def find(chapter, folder=ROOT / "solutions"):
    """The source of a chapter, by number ("1", "01") or name ("01_frames", "01-frames"); otherwise lists them."""
    wanted = str(chapter).replace("-", "_")
    wanted = wanted.zfill(2) if wanted.isdigit() else wanted
    found = [path for path in sources(folder) if wanted in (path.stem, path.stem[:2])]
    if len(found) != 1:
        names = ", ".join(p.stem for p in sources(folder)) or "none at all"
        raise ValueError(f"expected the number or the name of one chapter, got {str(chapter)!r}; there are: {names}")
    return found[0]


def read(path):
    """The cells of a source file, in order.

    Raises
    ------
    SourceError
        Naming file and line: no or a duplicate cell id, an unknown tag, an empty cell, a magic, markers that do not
        pair up, a stub without its solution, code that does not parse (as written, blank or solved).
    """
    path = Path(path)
    cells, seen = [], {}
    for line, block in _blocks(path):
        cell = _cell(path.name, line, block)
        if cell.id in seen:
            where = f"{path.name}, line {line}"
            raise SourceError(f"{where}: the cell id {cell.id!r} is already used in line {seen[cell.id]}")
        seen[cell.id] = line
        cells.append(cell)
    if not cells:
        raise SourceError(f"{path.name}, line 1: expected a cell, '# %% the-id', and found none")
    return cells


def blank(text):
    """What the student gets: each marked region becomes its stub."""
    return _join(_parts(text), lambda kept, stub, region, indent: [*kept, *(stub or [indent + STUB])])


def solved(text):
    """The complete code: markers and stubs gone."""
    return _join(_parts(text), lambda kept, stub, region, indent: [*kept, *region])


def region(text):
    """The marked regions alone, each dedented, one after the other; empty where nothing is marked."""
    return "\n".join(textwrap.dedent("\n".join(lines)).strip("\n") for _, _, lines, _ in _parts(text)[0])


def _blocks(path):
    """(line number of the header, lines from the header on) of each cell; refuses code before the first header."""
    blocks = []
    for number, line in enumerate(regular(path).read_text(encoding="utf-8").splitlines(), start=1):
        if re.match(r"#\s*%%", line):
            blocks.append((number, [line]))
        elif blocks:
            blocks[-1][1].append(line)
        elif line.strip() and not line.startswith("#"):
            raise SourceError(f"{path.name}, line {number}: expected a cell header '# %% the-id' before the first code")
    return blocks


def _cell(name, line, block):
    header = block[0].rstrip()
    match = _HEADER.fullmatch(header)
    if not match or len(match["id"]) > 64:
        raise SourceError(
            f"{name}, line {line}: expected '# %% the-id', then perhaps [markdown] and tags=[...] "
            f"(ids of small letters, digits, - and _, at most 64), got {header!r}"
        )
    kind = "markdown" if match["markdown"] else "code"
    first = next((i for i, text in enumerate(block) if i and text.strip()), None)
    if first is None:
        raise SourceError(f"{name}, line {line}: the cell {match['id']!r} is empty")
    lines = [text.rstrip() for text in block[first:]]
    at = line + first
    text = "\n".join(_uncommented(name, at, lines) if kind == "markdown" else lines).strip("\n")
    if not text.strip():
        raise SourceError(f"{name}, line {line}: the cell {match['id']!r} is empty")
    cell = Cell(kind, match["id"], _tags(name, line, match["tags"]), text, line)
    (_check_code if kind == "code" else _check_markdown)(name, at, cell)
    return cell


def _tags(name, line, text):
    try:
        tags = json.loads(text or "[]")
    except json.JSONDecodeError:
        raise SourceError(f'{name}, line {line}: expected tags as in tags=["solution"], got {text}') from None
    unknown = [tag for tag in tags if tag not in TAGS]
    if unknown:
        raise SourceError(f"{name}, line {line}: unknown tag {unknown[0]!r}, expected one of {', '.join(sorted(TAGS))}")
    if {"solution", "student"} <= set(tags):
        raise SourceError(f"{name}, line {line}: a cell for solution and student alike needs neither tag")
    return tuple(tags)


def _uncommented(name, at, lines):
    for number, line in enumerate(lines, start=at):
        if line and line != "#" and not line.startswith("# "):
            raise SourceError(f"{name}, line {number}: every line of a markdown cell begins with '# ', got {line!r}")
    return [line[2:] for line in lines]


def _check_markdown(name, at, cell):
    for number, line in enumerate(cell.text.split("\n"), start=at):
        if line.strip() in (_BEGIN, _END):
            raise SourceError(f"{name}, line {number}: solution markers belong into code cells")


def _check_code(name, at, cell):
    lines = cell.text.split("\n")
    marked = _check_markers(name, at, lines)
    if marked and "student" in cell.tags:
        raise SourceError(f"{name}, line {at}: a cell for students only cannot hold a solution")
    _check_syntax(name, at, cell.text)
    if "student" not in cell.tags:
        _check_stubs(name, at, lines)
    for version, what in ((blank, "its solution"), (solved, "its markers")):
        try:
            ast.parse(version(cell.text))
        except SyntaxError as error:
            where = f"{name}, line {cell.line}: the cell {cell.id!r}"
            raise SourceError(f"{where} does not parse without {what}: {error.msg}") from None


def _check_markers(name, at, lines):
    """True where regions are marked; refuses markers that do not pair up, are misspelled or enclose nothing."""
    begin, marked = None, False
    for number, line in enumerate(lines, start=at):
        word = line.strip()
        if word == _BEGIN:
            if begin:
                raise SourceError(f"{name}, line {number}: {_BEGIN} inside the region that begins in line {begin}")
            begin, marked = number, True
        elif word == _END:
            if not begin:
                raise SourceError(f"{name}, line {number}: {_END} without {_BEGIN} above it")
            if not any(text.strip() for text in lines[begin - at + 1 : number - at]):
                raise SourceError(f"{name}, line {begin}: the marked region is empty")
            begin = None
        elif re.match(r"#+\s*(BEGIN|END)\s+SOLUTION", word):
            raise SourceError(f"{name}, line {number}: write the marker as {_BEGIN!r} or {_END!r}, got {word!r}")
    if begin:
        raise SourceError(f"{name}, line {begin}: {_BEGIN} without {_END} in its cell")
    return marked


def _check_syntax(name, at, text):
    """Refuses what is no Python, magics first of all, also those that editors find in comments."""
    magic = "magics cannot be tested, write plain Python, got"
    lines = text.split("\n")
    for number, line in enumerate(lines, start=at):
        if _MAGIC_IN_COMMENT.match(line):
            raise SourceError(f"{name}, line {number}: {magic} {line!r}")
    try:
        tree = ast.parse(text)
    except SyntaxError as error:
        i = min(max(error.lineno or 1, 1), len(lines)) - 1
        words = f"{magic} {lines[i]!r}" if _MAGIC.match(lines[i]) else f"the code does not parse: {error.msg}"
        raise SourceError(f"{name}, line {at + i}: {words}") from None
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and node.id == "get_ipython":
            raise SourceError(f"{name}, line {at + node.lineno - 1}: {magic} get_ipython")


def _check_stubs(name, at, lines):
    for i, line in enumerate(lines):
        if _STUB_LINE.fullmatch(line):
            beneath = next((text.strip() for text in lines[i + 1 :] if not _STUB_LINE.fullmatch(text)), "")
            if beneath != _BEGIN:
                raise SourceError(f"{name}, line {at + i}: a stub stands directly above {_BEGIN}, got {beneath!r}")


def _parts(text):
    """([(lines kept before, stub lines, region lines, indentation) of each region], lines after the last one)."""
    parts, kept, lines = [], [], iter(text.split("\n"))
    for line in lines:
        if line.strip() != _BEGIN:
            kept.append(line)
            continue
        stub = []
        while kept and _STUB_LINE.fullmatch(kept[-1]):
            stub.insert(0, kept.pop())
        inner = []
        for line_inside in lines:
            if line_inside.strip() == _END:
                break
            inner.append(line_inside)
        parts.append((kept, stub, inner, line[: len(line) - len(line.lstrip())]))
        kept = []
    return parts, kept


def _join(parts, replace):
    regions, tail = parts
    return "\n".join([line for part in regions for line in replace(*part)] + tail)
