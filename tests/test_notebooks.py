"""The notebooks on disk are what the sources give, and strict mode bites."""

import asyncio
import os
import subprocess

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


def test_no_notebook_has_lost_its_source():
    assert not build.orphans(NOTEBOOKS, SOLUTIONS)


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.stem)
def test_a_blank_notebook_fails_in_strict_mode(path):
    """The negative control: were strict mode toothless, the solved notebooks would prove nothing. The cells up to the
    first exercise suffice.
    """
    asked = {cell.id for cell in source.read(path) if source.region(cell.text)}
    if not asked:
        pytest.skip("this chapter asks for no code")
    notebook = build.blank_notebook(path)
    exercises = [k for k, cell in enumerate(notebook.cells) if cell.id in asked and "@ex." in cell.source]
    last = exercises[0] if exercises else len(notebook.cells) - 1
    notebook.cells = notebook.cells[: last + 1]
    with pytest.raises(build.BuildError, match="NotCorrect"):
        asyncio.run(build.execute(notebook, path.stem, path.parent, strict=True))
