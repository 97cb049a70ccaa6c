"""The notebooks on disk are what the sources give, and strict mode bites."""

import asyncio
import json
import os
import subprocess

import nbformat
import pytest

from labkit.exercises import source
from labkit.verbs import build

SOURCES = source.sources()
NOTEBOOKS, SOLUTIONS = source.ROOT / "notebooks", source.ROOT / "solutions"
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")


def is_worked_in(path):
    """Whether a student (or an author, mid-work) has changed a notebook since the last commit; in CI nobody has."""
    if os.environ.get("CI"):
        return False
    try:
        unchanged = subprocess.run(["git", "diff", "--quiet", "HEAD", "--", str(path)], cwd=path.parent, timeout=20)
    except (OSError, subprocess.TimeoutExpired):
        return True
    return unchanged.returncode != 0


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.stem)
def test_both_notebooks_are_fresh(path):
    """`lab.py build --check`, except that a blank notebook with a student's work in it is nobody's mistake."""
    found = build.stale([path], NOTEBOOKS, SOLUTIONS)
    blank = NOTEBOOKS / f"{path.stem}.ipynb"
    if len(found) == 1 and f"notebooks/{blank.name}" in found[0] and blank.exists() and is_worked_in(blank):
        pytest.skip(f"notebooks/{blank.name} has been worked in")
    assert not found, f"run: python lab.py build {path.stem[:2]}"


def test_chapter_0_says_what_to_do_when_code_hangs_in_one_compiled_call():
    said = " ".join(cell.text for cell in source.read(source.find("00")))
    assert "Kernel > Restart Kernel" in said and "one single call that Python cannot interrupt" in said


def test_no_notebook_has_lost_its_source():
    assert not build.orphans(NOTEBOOKS, SOLUTIONS)


# --- the negative control: were strict mode toothless, the solved notebooks would prove nothing ----------------------

ASKING = [path for path in SOURCES if any(source.region(cell.text) for cell in source.read(path))]


def up_to_the_first_exercise(path):
    """The code cells of a blank notebook, the first one that checks an answer included."""
    asked = {cell.id for cell in source.read(path) if source.region(cell.text)}
    cells = [cell for cell in build.blank_notebook(path).cells if cell.cell_type == "code"]
    exercises = [k for k, cell in enumerate(cells) if cell.id in asked and "@ex." in cell.source]
    return [cell.source for cell in cells[: exercises[0] + 1 if exercises else len(cells)]]


@pytest.fixture(scope="module")
def ends():
    """{chapter: what each of these cells ended with} in strict mode, all chapters in one kernel."""
    code = f"""
import json
cells = { ({path.stem: up_to_the_first_exercise(path) for path in ASKING})!r}
run = get_ipython().run_cell
found = {{name: [run(cell).error_in_exec for cell in texts] for name, texts in cells.items()}}
print("ENDS", json.dumps({{name: [e and type(e).__name__ for e in errors] for name, errors in found.items()}}))
"""
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(code)])
    asyncio.run(build.execute(notebook, "the control", SOLUTIONS, strict=True))
    printed = "".join(output.get("text", "") for output in notebook.cells[0].outputs)
    return json.loads(printed.rpartition("ENDS ")[2].splitlines()[0])


@pytest.mark.parametrize("path", ASKING, ids=lambda path: path.stem)
def test_a_blank_chapter_fails_in_strict_mode(path, ends):
    assert "NotCorrect" in ends[path.stem] and set(ends[path.stem]) <= {None, "NotCorrect"}


def test_a_blank_notebook_is_not_built_in_strict_mode():
    path = SOURCES[1]
    with pytest.raises(build.BuildError, match="NotCorrect"):
        asyncio.run(build.execute(build.blank_notebook(path), path.stem, path.parent, strict=True))
