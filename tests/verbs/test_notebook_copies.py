"""Notebooks given to a folder, updated without touching what was written, and reset with a copy kept."""

import json
import os

import pytest

from labkit.exercises import progress
from labkit.exercises.session import chapters
from labkit.verbs import notebook_copies, reset, update
from labkit.verbs.arguments import Refusal


def cell(id, text, **more):
    return {"cell_type": "code", "id": id, "source": text, "metadata": {}, **more}


def notebook(**texts):
    return {"cells": [cell(id, text) for id, text in texts.items()], "metadata": {"own": 1}}


def given(mine):
    return {c["id"]: notebook_copies.digest(c) for c in mine["cells"]}


OLD = notebook(a="1", b="2", c="3")


def merged(mine, theirs, old=OLD):
    found, kept = notebook_copies.merge(mine, theirs, given(old))
    return found and [c["source"] for c in found["cells"]], kept


def test_untouched_cells_take_the_new_text_and_written_ones_stay():
    assert merged(OLD, notebook(a="1", b="new", c="3")) == (["1", "new", "3"], 0)
    mine = notebook(a="1", b="my own", c="3")
    assert merged(mine, notebook(a="new", b="new", c="3")) == (["new", "my own", "3"], 1)
    assert merged(mine, OLD) == (None, 0)


def test_outputs_of_what_did_not_change_stay():
    mine = {**OLD, "cells": [cell("a", "1", outputs=["shown"]), *OLD["cells"][1:]]}
    found, _ = notebook_copies.merge(mine, notebook(a="1", b="new", c="3"), given(OLD))
    assert found["cells"][0]["outputs"] == ["shown"] and found["metadata"] == {"own": 1}


def test_new_cells_come_deleted_ones_stay_away_and_dropped_ones_go_unless_written_in():
    assert merged(OLD, notebook(a="1", x="9", b="2", c="3")) == (["1", "9", "2", "3"], 0)
    assert merged(notebook(a="1", c="3"), notebook(a="new", b="2", c="3")) == (["new", "3"], 0)
    assert merged(OLD, notebook(a="1", c="3")) == (["1", "3"], 0)
    assert merged(notebook(a="1", b="mine", c="3"), notebook(a="1", c="new")) == (["1", "mine", "new"], 1)


def test_cells_of_ones_own_stay_behind_the_cell_they_followed():
    mine = {"cells": [cell("q", "0"), cell("a", "1"), cell("x", "mine"), cell("y", "too"), *OLD["cells"][1:]]}
    assert merged(mine, notebook(a="1", b="2", c="new")) == (["0", "1", "mine", "too", "2", "new"], 3)


def test_cells_without_an_id_or_with_a_borrowed_one_are_never_lost():
    bare = {"cell_type": "code", "source": "bare", "metadata": {}}
    mine = {"cells": [bare, *OLD["cells"], dict(bare, source="bare 2"), cell("a", "copied")]}
    assert merged(mine, notebook(a="new", b="2", c="3"))[0] == ["bare", "new", "2", "3", "bare 2", "copied"]


def test_a_folder_of_unknown_origin_loses_nothing():
    """Without the digests every cell counts as written."""
    mine = notebook(a="mine", b="2")
    assert notebook_copies.merge(mine, notebook(a="1", b="new", c="3"), {})[0]["cells"][:2] == mine["cells"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    texts = {"01_a.ipynb": json.dumps(OLD), "02_b.ipynb": json.dumps(OLD)}
    monkeypatch.setattr(notebook_copies, "blank_notebooks", lambda: texts)
    assert notebook_copies.give(tmp_path) == list(texts)
    monkeypatch.setattr(
        notebook_copies, "blank_notebooks", lambda: {**texts, "01_a.ipynb": json.dumps(notebook(a="new", b="2"))}
    )
    return tmp_path


def sources(path):
    return [c["source"] for c in json.loads(path.read_text(encoding="utf-8"))["cells"]]


def test_update_says_what_it_did_and_does_it_once(folder, capsys):
    (folder / "01_a.ipynb").write_text(json.dumps(notebook(a="1", b="mine", c="3")), encoding="utf-8")
    (folder / "02_b.ipynb").unlink()
    update.main([str(folder)])
    said = capsys.readouterr().out.splitlines()
    assert said == ["01_a.ipynb is brought to this edition; 1 of its cells stay as you wrote them", "02_b.ipynb is new"]
    assert sources(folder / "01_a.ipynb") == ["new", "mine"]
    update.main([str(folder)])
    assert capsys.readouterr().out == "The notebooks are those of this edition already.\n"


def test_half_of_a_letter_in_a_cell_of_ones_own_is_kept(folder):
    (folder / "01_a.ipynb").write_text(json.dumps(notebook(a="1", b="mine \ud800")), encoding="utf-8")
    assert notebook_copies.update(folder) == [
        "01_a.ipynb is brought to this edition; 1 of its cells stay as you wrote them"
    ]
    assert sources(folder / "01_a.ipynb") == ["new", "mine \ud800"]


def test_update_leaves_what_it_cannot_read_and_tries_again_the_next_time(folder):
    whole = (folder / "01_a.ipynb").read_text(encoding="utf-8")
    for broken in ('{"cells": [', "[]", '{"cells": [{"id": 1}]}', "[" * 100_000):
        (folder / "01_a.ipynb").write_text(broken, encoding="utf-8")
        assert notebook_copies.update(folder) == ["01_a.ipynb cannot be read as a notebook and is left as it is"]
        assert (folder / "01_a.ipynb").read_text(encoding="utf-8") == broken
    (folder / "01_a.ipynb").write_text(whole, encoding="utf-8")
    notebook_copies.update(folder)
    assert sources(folder / "01_a.ipynb") == ["new", "2"]


def test_who_is_stopped_between_two_notebooks_has_no_cell_that_seems_to_be_written_in(folder, monkeypatch):
    """The disk is full at the second one; a later edition finds both as they were given, and brings them."""
    fresh = json.dumps(notebook(a="new", b="2"))

    def until_the_second(path, text, write=notebook_copies.write):
        if path.name == "02_b.ipynb":
            raise OSError("no room")
        write(path, text)

    for work in (notebook_copies.update, notebook_copies.give):
        if work is notebook_copies.give:
            for path in list(folder.iterdir()):
                path.unlink()
        monkeypatch.setattr(notebook_copies, "blank_notebooks", lambda: {"01_a.ipynb": fresh, "02_b.ipynb": fresh})
        with monkeypatch.context() as patch, pytest.raises(OSError, match="no room"):
            patch.setattr(notebook_copies, "write", until_the_second)
            work(folder)
        last = json.dumps(notebook(a="newest", b="2"))
        monkeypatch.setattr(
            notebook_copies, "blank_notebooks", lambda last=last: {n: last for n in ("01_a.ipynb", "02_b.ipynb")}
        )
        assert "01_a.ipynb is brought to this edition" in notebook_copies.update(folder)
        assert sources(folder / "01_a.ipynb") == sources(folder / "02_b.ipynb") == ["newest", "2"]


@pytest.mark.skipif(os.name == "nt", reason="links need a right there that few have")
def test_a_notebook_that_is_a_link_is_written_where_it_leads(folder, tmp_path):
    (tmp_path / "elsewhere").mkdir()
    place = (folder / "01_a.ipynb").rename(tmp_path / "elsewhere" / "mine.ipynb")
    (folder / "01_a.ipynb").symlink_to(place)
    assert notebook_copies.update(folder) == ["01_a.ipynb is brought to this edition"]
    assert (folder / "01_a.ipynb").is_symlink() and sources(place) == ["new", "2"]


def test_update_fills_an_empty_folder_and_refuses_one_of_other_things(folder, tmp_path):
    assert notebook_copies.update(tmp_path / "new") == ["01_a.ipynb is new", "02_b.ipynb is new"]
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "draft.txt").touch()
    with pytest.raises(Refusal, match="holds no notebook of the course"):
        notebook_copies.update(tmp_path / "thesis")


def test_reset_keeps_the_students_copy(tmp_path):
    path = tmp_path / "01_small.ipynb"
    assert notebook_copies.fresh_copy(path, "fresh", path.name) == "01_small.ipynb is as in the beginning"
    assert "already" in notebook_copies.fresh_copy(path, "fresh", path.name)
    for number in (1, 2):
        path.write_text(f"my work {number}", encoding="utf-8")
        said = notebook_copies.fresh_copy(path, "fresh", f"notebooks/{path.name}")
        done, advice = said.split("\n")
        assert done.endswith(f"yours is kept as notebooks/01_small.my-copy-{number}.ipynb.")
        assert "Reload Notebook from Disk" in advice  # the words of JupyterLab's File menu
        assert (tmp_path / f"01_small.my-copy-{number}.ipynb").read_text(encoding="utf-8") == f"my work {number}"
        assert path.read_text(encoding="utf-8") == "fresh"


def test_reset_of_an_installation_works_in_the_folder_one_stands_in(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(reset, "IS_CHECKOUT", False)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(Refusal, match="no folder that holds your notebooks"):
        reset.main(["01"])
    notebook_copies.give(tmp_path)
    (tmp_path / "01_frames.ipynb").write_text("mine", encoding="utf-8")
    reset.main(["1"])
    assert capsys.readouterr().out.startswith("01_frames.ipynb is as in the beginning; yours is kept as 01_frames.my-")


@pytest.mark.parametrize(
    ("words", "said"), [([], "Which chapter"), (["99"], "there are: 00"), (["../../etc"], "got '../..")]
)
def test_reset_names_the_chapters_there_are(words, said):
    with pytest.raises(Refusal, match=said):
        reset.main(words)


def test_predictions_are_asked_again(capsys):
    chapter = next(c for c in chapters() if c.name == "01-frames")
    id = next(item.id for item in chapter.items if hasattr(item, "question"))
    progress.record(chapter.name, id, "predicted", answer="x")
    reset.main(["01", "--predictions"])
    assert progress.of(chapter.name, id) == [] and "asked again" in capsys.readouterr().out
