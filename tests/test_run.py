"""The sum of all tests: what is counted, and that nothing that went wrong is lost."""

import importlib.util
import json

import pytest

from labkit.exercises import source

spec = importlib.util.spec_from_file_location("run_tests", source.ROOT / "tests" / "run.py")
run = importlib.util.module_from_spec(spec)
spec.loader.exec_module(run)


@pytest.mark.parametrize(
    ("output", "code", "passed", "failed", "skipped"),
    [
        ("...\n3 passed in 1.20s", 0, 3, 0, 0),
        ("2 failed, 40 passed, 1 skipped in 12.3s", 1, 40, 2, 1),
        ("40 passed, 1 warning in 75.31s (0:01:15)", 0, 40, 0, 0),
        ("1 error in 0.30s", 2, 0, 1, 0),
        ("3 passed, 2 errors in 0.30s", 1, 3, 2, 0),
        ("Segmentation fault", -11, 0, 1, 0),
        ("40 passed in 3.0s\nINTERNALERROR", 3, 40, 1, 0),
        ("no tests ran in 0.01s", 5, 0, 0, 0),
    ],
)
def test_counts(output, code, passed, failed, skipped):
    counts = run.counts_of(output, code)
    assert (counts["passed"], counts["failed"] + counts["error"], counts["skipped"]) == (passed, failed, skipped)


def test_the_last_line_is_the_sum(tmp_path, capsys):
    (tmp_path / "test_a.py").write_text("def test_good(): pass\ndef test_bad(): assert not 1\n", encoding="utf-8")
    assert (
        run.main(
            [str(tmp_path / "test_a.py"), "--rootdir", str(tmp_path), "-p", "no:nbval", "-p", "no:hypothesispytest"]
        )
        == 1
    )
    printed = capsys.readouterr().out
    assert printed.splitlines()[-1] == "1 passed, 1 failed"
    assert "assert not 1" in printed


def test_every_test_file_and_notebook_is_in_exactly_one_job(tmp_path):
    words = [word for job in run.all_jobs(tmp_path).values() for word in job if not word.startswith("-")]
    assert len(set(words)) == len(words)
    files = {str(path) for path in (source.ROOT / "tests").glob("**/test_*.py") if path.parent.name not in run.APART}
    files |= {str(path) for path in (source.ROOT / "tests").glob("test_*.py")}
    files |= {str(path) for path in (source.ROOT / "solutions").glob("*.ipynb")}
    assert files | {str(source.ROOT / "tests" / name) for name in run.APART} <= set(words)
    assert len([word for word in words if word.endswith(".ipynb")]) == 2 * len(source.sources())


def test_a_notebook_a_student_has_worked_in_is_replaced_by_a_fresh_one(tmp_path, monkeypatch):
    (tmp_path / "solutions").mkdir()
    (tmp_path / "notebooks").mkdir()
    (tmp_path / "solutions" / "01_small.py").write_text("# %% a\nx = 1\n", encoding="utf-8")
    (tmp_path / "notebooks" / "01_small.ipynb").write_text("my work", encoding="utf-8")
    monkeypatch.setattr(run, "ROOT", tmp_path)
    monkeypatch.setattr(run.source, "sources", lambda: [tmp_path / "solutions" / "01_small.py"])
    (tmp_path / "scratch").mkdir()
    (notebook,) = run.blank_notebooks(tmp_path / "scratch")
    assert notebook.parent.name == "scratch" and json.loads(notebook.read_text())["cells"][0]["id"] == "a"
    (tmp_path / "notebooks" / "01_small.ipynb").write_text(notebook.read_text(), encoding="utf-8")
    assert list(run.blank_notebooks(tmp_path / "scratch")) == [tmp_path / "notebooks" / "01_small.ipynb"]
