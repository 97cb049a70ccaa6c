"""What keeps the house in order: notebook files that compare well, imports that run one way, colors from one place."""

import ast
import functools
import json
import re
import subprocess
import sys
from types import SimpleNamespace

import pytest

from labkit.exercises import source
from labkit.verbs import build

ROOT = source.ROOT
SOURCES = source.sources()
FRONT_ENDS = {"matplotlib", "ipywidgets", "anywidget", "IPython"}
COLOR_ARGUMENTS = re.compile(r"(.*_)?(colors?|c|facecolors?|edgecolors?|fc|ec|mfc|mec)|marker(face|edge)color")
UNSTABLE = {
    "an address": r"\b0x[0-9a-f]{6,}",
    "a path of one machine": r"(?<![\w.])/(home|Users|tmp|root|var|usr|opt)/\w|[A-Z]:\\\w|ipykernel_\d|site-packages",
    "a time": r"\b20\d\d-\d\d-\d\d[T ]\d\d:\d\d",
}


def notebooks():
    """{name: (chapter, content)} of the solved notebooks on disk and of the blank ones as the sources give them."""
    found = {}
    for path in SOURCES:
        found[f"notebooks/{path.stem}"] = json.loads(build.as_text(build.blank_notebook(path)))
        solved = path.with_suffix(".ipynb")
        if solved.exists():
            found[f"solutions/{path.stem}"] = json.loads(solved.read_text(encoding="utf-8"))
    return found


NOTEBOOKS = notebooks()
EACH_NOTEBOOK = pytest.mark.parametrize("name", NOTEBOOKS)


def cells(name, kind=None):
    return [cell for cell in NOTEBOOKS[name]["cells"] if kind in (None, cell["cell_type"])]


@EACH_NOTEBOOK
def test_metadata_names_the_kernel_and_nothing_else(name):
    notebook = NOTEBOOKS[name]
    assert notebook["metadata"] == {"kernelspec": build.KERNEL, "language_info": {"name": "python"}}
    assert all(set(cell["metadata"]) <= {"tags"} for cell in notebook["cells"])
    ids = [cell["id"] for cell in notebook["cells"]]
    assert len(set(ids)) == len(ids)


@EACH_NOTEBOOK
def test_code_is_short_plain_and_comparable(name):
    """No cell over 15 lines; no magics; nothing that nbval cannot compare."""
    for cell in cells(name, "code"):
        code = "".join(cell["source"])
        assert code.count("\n") < 15, f"cell {cell['id']} has {code.count(chr(10)) + 1} lines"
        bad = re.search(r"^\s*[%!]\w|get_ipython|\bOutput\(|\binteract\w*\(|ipympl|clear_output", code, re.M)
        assert not bad, f"cell {cell['id']} uses {bad[0]!r}"


HALF_A_SCREEN = 88  # letters of code that a cell of half a screen shows


@EACH_NOTEBOOK
def test_code_fits_a_cell_of_half_a_screen(name):
    for cell in cells(name, "code"):
        wide = [line for line in "".join(cell["source"]).split("\n") if len(line) > HALF_A_SCREEN]
        assert not wide, f"cell {cell['id']}: {wide[0]!r} has more than {HALF_A_SCREEN} letters"


@EACH_NOTEBOOK
def test_outputs_are_stored_where_nbval_compares_them_and_hold_text_and_small_pictures_alone(name):
    if name.startswith("notebooks"):
        assert all(not cell["outputs"] and cell["execution_count"] is None for cell in cells(name, "code"))
        return
    for number, cell in enumerate(cells(name, "code"), start=1):
        assert cell["execution_count"] == number, f"cell {cell['id']} was not executed in order"
        if "nbval-check-output" in cell["metadata"].get("tags", []):
            assert cell["outputs"], f"cell {cell['id']} has nothing to compare"
        for output in cell["outputs"]:
            assert output["output_type"] != "error", f"cell {cell['id']} failed"
            assert set(output.get("data", {})) <= {
                "text/plain",
                "text/html",
                "text/latex",
                "text/markdown",
                "image/png",
            }
            text = json.dumps({**output, "data": {**output.get("data", {}), "image/png": ""}})
            for what, pattern in UNSTABLE.items():
                bad = re.search(pattern, text)
                assert not bad, f"the output of cell {cell['id']} holds {what}: {bad[0]!r}"


def storey_of(path):
    """The room of labkit that a module stands in: "geometry", "chapters" and so on; "checks" for `tables`, too."""
    parts = path.relative_to(ROOT / "labkit").parts
    return parts[0] if len(parts) > 1 else GROUND_FLOOR.get(path.stem, "verbs")


@functools.cache
def facts(path):
    """What the guards ask of a Python file, read once: its imports, its long functions, its colors."""
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    return SimpleNamespace(
        imports=list(imported(path, nodes)), long=set(long_functions(nodes)), colors=list(literal_colors(nodes))
    )


def imported(path, nodes):
    """Absolute names of all modules that a module of labkit imports."""
    package = path.relative_to(ROOT).with_suffix("").parts[:-1]
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            module = ".".join([*base, *([node.module] if node.module else [])])
            yield from (f"{module}.{alias.name}" for alias in node.names)


GROUND_FLOOR = {
    "checks": "checks",
    "documented": "checks",
    "tables": "checks",
    "places": "checks",
    "reading": "checks",
    "__init__": "checks",
}
MATHEMATICS = ("geometry", "estimation", "calibration", "machines", "localization", "fast")
MAY_IMPORT = {  # besides itself
    "checks": (),
    "geometry": ("checks",),
    "estimation": ("checks", "geometry"),
    "calibration": ("checks", "geometry", "estimation"),
    "files": ("checks", "geometry"),
    "machines": ("checks", "geometry", "estimation", "calibration"),
    "localization": ("checks", "geometry", "estimation"),
    "fast": ("checks", *MATHEMATICS),
    "documents": ("checks", *MATHEMATICS),
    "live": (),
    "server": (),
    "exercises": ("checks", "geometry", "live"),
    "stage": ("checks", "live"),
    "chapters": ("checks", "files", *MATHEMATICS, "documents", "live", "exercises", "stage"),
    "collect": ("checks", "exercises"),  # chapters are found by name
    "demo": ("checks", "exercises", "stage"),  # as well
    "book": ("exercises", "stage"),  # chapters are found by name
    "verbs": (
        "checks",
        "files",
        *MATHEMATICS,
        "documents",
        "live",
        "exercises",
        "stage",
        "chapters",
        "collect",
        "demo",
        "book",
    ),
}
NEEDS_NO_FRONT_END = ("checks", "files", *MATHEMATICS, "documents")
MODULES = sorted((ROOT / "labkit").rglob("*.py"))


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_go_down_only(path):
    """chapters -> documents -> mathematics -> checks; the engines know no chapter, a chapter knows no other."""
    storey = storey_of(path)
    for name in facts(path).imports:
        first, *rest = name.split(".")
        if first == "labkit" and rest:
            other = GROUND_FLOOR.get(rest[0], rest[0])
            assert other in (storey, *MAY_IMPORT[storey]), f"{storey} must not import {name}"
            if storey == other == "chapters":
                assert rest[1] in path.parts, f"{path.parent.name} must not import {name}: move it down a storey"
            if storey == "chapters" and other == "documents":
                assert not rest[-2].startswith("claims_"), f"{name} belongs to the ledger: move it to what is printed"
        if storey in NEEDS_NO_FRONT_END:
            assert first not in FRONT_ENDS, f"{storey} must not import {name}"


READS_A_TABLE = {  # outside documents/
    "chapters/ch06_tracker/stages.py": "hand_eye_methods.csv is the project's own benchmark, printed by no document",
}


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_what_a_document_prints_is_read_in_its_room(path):
    """No table of `data/` is read above or beside documents/: what two places read would have two names."""
    excused = path.relative_to(ROOT / "labkit").as_posix() in READS_A_TABLE
    if storey_of(path) not in (*MATHEMATICS, "chapters") or excused:
        return
    reads = {name for name in facts(path).imports if name.startswith("labkit.tables")}
    assert not reads, f"{path.name} imports {min(reads)}: move the table to labkit/documents"


LONGEST_FUNCTION = 40  # lines of a body, without its docstring


def long_functions(nodes):
    """Names of the functions of a module whose body is longer than LONGEST_FUNCTION; builders of Stages excepted."""
    for node in nodes:
        if isinstance(node, ast.FunctionDef):
            body = node.body[1:] if ast.get_docstring(node) and len(node.body) > 1 else node.body
            builds = any(isinstance(n, ast.Return) and _makes_a_stage(n.value) for n in node.body)
            if node.end_lineno - body[0].lineno >= LONGEST_FUNCTION and not builds:
                yield node.name


def _makes_a_stage(value):
    return isinstance(value, ast.Call) and getattr(value.func, "id", "") == "Stage"


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_functions_are_short(path):
    found = facts(path).long
    assert not found, f"{found} exceeds {LONGEST_FUNCTION} lines: cut it where its parts have names"


@functools.cache
def public_functions(path):
    """[(definition, docstring)] of each public function of a module with two or more parameters."""
    found = []
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            given = node.args
            if len(given.posonlyargs + given.args + given.kwonlyargs) >= 2:
                found.append((node, ast.get_docstring(node) or ""))
    return found


def own_statements(function):
    """Nodes of a function's body, without those of functions defined in it."""
    open_ = list(function.body)
    while open_:
        node = open_.pop()
        yield node
        if not isinstance(node, (ast.FunctionDef, ast.Lambda)):
            open_ += ast.iter_child_nodes(node)


def has_section(text, name):
    return re.search(rf"^{name}\n-{{{len(name)}}}$", text, re.M) is not None


MATHEMATICAL = [path for path in MODULES if storey_of(path) in MATHEMATICS]
DESCRIBED = {node.name for p in MATHEMATICAL for node, text in public_functions(p) if has_section(text, "Parameters")}


@pytest.mark.parametrize("path", MATHEMATICAL, ids=lambda path: str(path.relative_to(ROOT)))
def test_mathematics_says_what_goes_in_and_what_comes_out(path):
    """Parameters, Returns and Raises as sections; or, in backquotes, the function whose parameters these are.

    Border checks (`as_...`, `refuse_...`) say in a sentence what they let pass.
    """
    for node, text in public_functions(path):
        if node.name.startswith(("as_", "refuse_")):
            continue
        if not has_section(text, "Parameters"):
            named = {name.split(".")[-1] for name in re.findall(r"`([\w.]+)`", text)}
            assert named & DESCRIBED, f"{node.name} needs a section Parameters, or the name of a function that has it"
            continue
        body = list(own_statements(node))
        if any(isinstance(part, ast.Return) and part.value is not None for part in body):
            assert has_section(text, "Returns"), f"{node.name} needs a section Returns"
        if any(isinstance(part, ast.Raise) for part in body):
            assert has_section(text, "Raises"), f"{node.name} needs a section Raises"


def literal_colors(nodes):
    """(line, color) of each color written as text in the code."""
    for node in nodes:
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            if re.fullmatch(r"#(?:[0-9a-fA-F]{3}){1,2}", node.value):
                yield node.lineno, node.value
        elif isinstance(node, ast.Call):
            for keyword in node.keywords:
                value = getattr(keyword.value, "value", None)
                if COLOR_ARGUMENTS.fullmatch(keyword.arg or "") and isinstance(value, str) and value != "none":
                    yield node.lineno, value
            if getattr(node.func, "attr", "") == "plot":
                for argument in node.args:
                    value = getattr(argument, "value", None)
                    if isinstance(value, str) and re.match(r"[-.:o]*[bgrcmykw]|C\d", value):
                        yield node.lineno, value


DRAWING = [p for p in MODULES if storey_of(p) in ("stage", "chapters") and p.name != "style.py"] + SOURCES


@pytest.mark.parametrize("path", DRAWING, ids=lambda path: str(path.relative_to(ROOT)))
def test_colors_come_from_the_style_alone(path):
    found = facts(path).colors
    assert not found, f"line {found[0][0]} writes the color {found[0][1]!r}: take it from labkit/stage/style.py"


def test_the_color_guard_sees_colors():
    code = 'ax.plot(x, y, "k--")\nax.scatter(x, y, c="red")\nINK = "#112233"\nax.plot(x, y, "-", color="none")'
    assert [value for _, value in sorted(literal_colors(ast.walk(ast.parse(code))))] == ["k--", "red", "#112233"]


def test_constraints_hold_no_address():
    text = (ROOT / "constraints.txt").read_text(encoding="utf-8")
    pins = [line for line in text.splitlines() if line and not line.lstrip().startswith("#")]
    assert pins and all(re.match(r"[A-Za-z0-9][\w.-]*==[\w.]+( ; .+)?$", pin) for pin in pins)
    assert "://" not in text and not re.search(r"[\s=](/|[A-Z]:\\|~)", text), (
        "the header must hold relative paths alone"
    )


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.stem)
def test_the_readme_lists_every_chapter(path):
    assert f"| {int(path.stem[:2])} | `{path.stem}` |" in (ROOT / "README.md").read_text(encoding="utf-8")


ROOMS = sorted(folder for folder in (ROOT / "labkit").iterdir() if (folder / "__init__.py").exists())


@pytest.mark.parametrize("room", ROOMS, ids=lambda room: room.name)
def test_the_readme_shows_every_room(room):
    """The tree of the README names each room of labkit; of the mathematics and of `files` every module as well."""
    tree = (ROOT / "README.md").read_text(encoding="utf-8").partition("## The house")[2]
    (row,) = re.findall(rf"^      {room.name}/ +(.+)$", tree, re.M)
    if room.name in (*MATHEMATICS, "files") and room.name != "fast":
        modules = {path.stem for path in room.glob("*.py")} - {"__init__"}
        assert modules == set(re.findall(r"[a-z_]+", row.partition(":")[0]))


LISTED = (*MATHEMATICS, "files", "documents", "stage")


@pytest.mark.parametrize("room", LISTED)
def test_a_room_says_what_lies_in_it(room):
    """The first lines of a room name each of its modules."""
    text = ast.get_docstring(ast.parse((ROOT / "labkit" / room / "__init__.py").read_text(encoding="utf-8")))
    modules = {path.stem for path in (ROOT / "labkit" / room).glob("*.py")} - {"__init__"}
    assert not modules - set(re.findall(r"\w+", text))


@pytest.mark.parametrize("arguments", (["check", "--output-format=concise"], ["format", "--check"]), ids=" ".join)
def test_ruff_is_content(arguments):
    ruff = subprocess.run([sys.executable, "-m", "ruff", *arguments, "."], cwd=ROOT, capture_output=True, text=True)
    assert not ruff.returncode, ruff.stdout + ruff.stderr


def test_version_change_log_and_citation_agree():
    """One version: the newest section of the change log, the citation, and what is built."""
    version = re.search(r'^version = "(\d+\.\d+\.\d+)"$', (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.M)[
        1
    ]
    newest = re.search(r"^## (\S+)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.M)[1]
    cited = re.search(r"^version: (\S+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.M)[1]
    assert version == newest == cited


def test_no_two_test_files_share_a_name():
    """pytest imports them by name alone: of two, one process can run one."""
    names = [path.name for path in (ROOT / "tests").glob("**/*.py") if path.name != "conftest.py"]
    assert len(names) == len(set(names)), sorted(name for name in set(names) if names.count(name) > 1)
