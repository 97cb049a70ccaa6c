"""A class, judged across the border, with bubblewrap and without; and what attacks come to."""

import csv
import json
import py_compile
import re
import shutil
import socket
import threading

import attacks
import pytest
from classroom import notebook_text, replaced, solved_cells, write

from labkit.collect import batch, judge, library, sandbox, submissions
from labkit.exercises import guard, source
from labkit.geometry import frames
from labkit.verbs import collect
from labkit.verbs.arguments import run

WITH_AND_WITHOUT = pytest.mark.parametrize("boxed", ["none", "bubblewrap"], indirect=True)
CHAPTER = "01-frames"


@pytest.fixture
def boxed(request, monkeypatch):
    """The sandbox that a test is run with."""
    monkeypatch.setenv("LABKIT_SANDBOX", request.param)
    sandbox.bubblewrap.cache_clear()
    if request.param == "bubblewrap" and sandbox.bubblewrap()[0] is None:
        sandbox.bubblewrap.cache_clear()
        pytest.skip("there is no bubblewrap that runs here")
    yield request.param
    sandbox.bubblewrap.cache_clear()


def contents(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def results(out):
    found = [json.loads(path.read_text(encoding="utf-8")) for path in (out / "judged").iterdir()]
    return {result["digest"]: result for result in found}


def table(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize(("boxed", "students", "damaged"), [("none", 3, 1), ("bubblewrap", 5, 2)], indirect=["boxed"])
def test_a_class_is_reported_as_it_was_planted(boxed, students, damaged, tmp_path, capsys):
    planted = write(tmp_path / "class", students, damaged)
    out = tmp_path / "out"
    assert run(collect.main, [str(tmp_path / "class"), "--out", str(out), "--seed", "7", "--names", "folders"]) == 0
    found, problems = results(out), []
    handed_in = submissions.students([tmp_path / "class"], problems)
    assert [student.key for student in handed_in] == sorted(planted) and not problems
    for student in handed_in:
        result = found.get(submissions.digest(student.files[0].read()))
        if isinstance(planted[student.key], str):
            assert "unreadable" in result, planted[student.key]
            continue
        verdicts = {
            id: (v["status"], v.get("mistake")) for id, v in result["items"].items() if id in planted[student.key]
        }
        assert verdicts == planted[student.key], student.key
        assert boxed == "none" or result["sandbox"] == sandbox.PROTECTED
    rows = {row["Identifier"]: row for row in table(out / "report.csv")}
    assert set(rows) == set(planted)
    for key, truth in planted.items():
        solved = 0 if isinstance(truth, str) else sum(status == "correct" for status, _ in truth.values())
        named = 0 if isinstance(truth, str) else sum(mistake is not None for _, mistake in truth.values())
        assert float(rows[key]["Grade"]) == solved + 0.5 * named
    assert len(table(out / "problems.csv")) == damaged
    assert len(list((out / "feedback").iterdir())) == students


@pytest.fixture(scope="module")
def class_(tmp_path_factory):
    """(folder of a class of three, what was planted there, the folder of its reports)."""
    place = tmp_path_factory.mktemp("class")
    planted = write(place / "class", 3, 1, seed=4)
    assert run(collect.main, [str(place / "class"), "--out", str(place / "out"), "--seed", "7"]) == 0
    return place / "class", planted, place / "out"


def test_the_same_input_and_seed_give_the_same_bytes_without_any_name(class_, tmp_path):
    folder, _, out = class_
    assert run(collect.main, [str(folder), "--out", str(tmp_path / "again"), "--seed", "7"]) == 0
    first, second = contents(out), contents(tmp_path / "again")
    assert first == second
    names = {word for place in folder.iterdir() for word in re.split(r"[ _]", place.name) if len(word) > 3}
    whole = "".join(first) + "".join(data.decode() for data in first.values())
    assert not [name for name in names - {"assignsubmission", "file"} if name in whole]


def test_what_is_judged_is_not_judged_again_and_a_changed_file_alone_is(class_, tmp_path):
    folder, out = shutil.copytree(class_[0], tmp_path / "class"), shutil.copytree(class_[2], tmp_path / "out")
    stamps = {path: path.stat().st_mtime_ns for path in (out / "judged").iterdir()}
    changed = sorted(folder.rglob("*.ipynb"))[0]
    changed.write_text("{}", encoding="utf-8")
    assert run(collect.main, [str(folder), "--out", str(out), "--seed", "7"]) == 0
    new = {path for path in (out / "judged").iterdir() if stamps.get(path) != path.stat().st_mtime_ns}
    assert len(stamps) > 1
    assert [json.loads(path.read_text())["unreadable"] for path in new] == ["is no notebook: it holds no code cells"]


def test_one_file_and_merge_come_to_the_same_as_all_at_once(class_, tmp_path, capsys):
    folder, planted, whole = class_
    answers = [truth for truth in planted.values() if not isinstance(truth, str)]
    right = [id for truth in answers for id, (status, _) in truth.items() if status == "correct"]
    for key, truth in planted.items():
        (path,) = folder.glob(f"*_{key}_*/*")
        ended = run(collect.main, ["--one", str(path), "--out", str(tmp_path), "--seed", "7"])
        assert ended == isinstance(truth, str), "one that cannot be read is a refusal"
    said = capsys.readouterr().out
    assert right and all(f"correct       {id}" in said for id in right)
    assert run(collect.main, ["--merge", str(folder), "--out", str(tmp_path), "--seed", "7"]) == 0
    assert contents(whole) == contents(tmp_path)


# --- attacks --------------------------------------------------------------------------------------------------------


@pytest.fixture
def listener():
    """A port on which a connection would be noticed."""
    heard = []
    with socket.create_server(("127.0.0.1", 0)) as server:

        def hear():
            try:
                while True:
                    server.accept()[0].close()
                    heard.append(1)
            except OSError:
                return

        threading.Thread(target=hear, daemon=True).start()
        yield server.getsockname()[1], heard


def attacked(names, tmp_path, port, monkeypatch):
    """The notebook with these attacks, each in a cell of its own, judged; and every outcome it got on the way."""
    secret = tmp_path / "secret"
    py_compile.compile(frames.__file__, doraise=True)  # as it lies wherever the library has been used
    (tmp_path / "secret.read").write_text("read me", encoding="utf-8")
    cells, got = solved_cells(), []
    k = next(k for k, (_, text) in enumerate(cells) if "ex.invert" in text)
    own = [("x", attacks.code(name, secret=secret, port=port, root=source.ROOT)) for name in names]
    cells = [*cells[:k], *own, ("x", "invert = ex.invert(lambda T: 2 * T)"), *cells[k + 1 :]]
    judged = judge.Session._judged

    @guard.standing_for(judged)  # else the guard puts back what it has seen before
    def noted(self, item, *rest):
        outcome = judged(self, item, *rest)
        got.append((item.id, outcome.status))
        return outcome

    monkeypatch.setattr(judge.Session, "_judged", noted)
    monkeypatch.setattr(judge, "HANDED", 100)
    verdicts = judge.judge(library.load(CHAPTER), [text for _, text in cells], 3, "attacks")
    left = {path.name for path in tmp_path.iterdir()} - {"secret.read"}
    return verdicts, got, left


@WITH_AND_WITHOUT
def test_attacks_are_never_correct_leave_no_file_and_open_no_connection(boxed, tmp_path, listener, monkeypatch):
    names = [name for name in attacks.ALL if name not in attacks.ENDS_THE_RUN + attacks.SAYS_NOTHING]
    verdicts, got, left = attacked(names, tmp_path, listener[0], monkeypatch)
    assert not left and not listener[1] and not verdicts.stopped
    assert not [pair for pair in got if pair == ("invert", "correct")]
    assert {id for id, status in got if status == "correct"} == {id for id in verdicts.outcomes} - {"invert"}


@WITH_AND_WITHOUT
@pytest.mark.parametrize("names", [attacks.ENDS_THE_RUN, ("sleeps", "forges answers")], ids=["killers", "silent"])
def test_attacks_that_end_their_process_end_nothing_else(boxed, names, tmp_path, listener, monkeypatch):
    monkeypatch.setattr(judge, "SILENCE", 5.0 if "sleeps" in names else judge.SILENCE)
    monkeypatch.setattr(judge, "TURNS", 10)
    verdicts, got, left = attacked(names, tmp_path, listener[0], monkeypatch)
    assert not left and not listener[1]
    assert verdicts.outcomes["invert"].status != "correct"
    assert {id for id, outcome in verdicts.outcomes.items() if outcome.status != "correct"} == {"invert"}


def test_a_value_counts_by_what_is_handed_in_last_but_never_as_the_reference_given_back():
    cells = [text for _, text in replaced(solved_cells(), "distance", "v = ex.distance(0.0)\nex.distance(v)")]
    assert judge.judge(library.load(CHAPTER), cells, 1, "x").outcomes["distance"].status == "not yet"
    both = "ex.distance(0.0)\nex.distance(np.linalg.norm(T_K0K1[:3, 3]))"
    name = next(text for _, text in solved_cells() if "ex.distance" in text)
    cells = [text for _, text in replaced(solved_cells(), "distance", "ex.distance(0.0)\n" + name)]
    assert judge.judge(library.load(CHAPTER), cells, 1, "x").outcomes["distance"].status == "correct", both


def test_a_prediction_an_unfinished_exercise_and_a_missing_cell_are_told_apart():
    cells = replaced(solved_cells(), "invert", "@ex.invert\ndef invert(T):\n    ...")
    cells = replaced(cells, "relative", None)
    cells = [(id, text.replace('guess = "origin to x_point"', "guess = ...")) for id, text in cells]
    result = batch.judged(notebook_text(cells).encode(), 1)
    assert result["items"]["invert"]["status"] == "unfinished"
    assert result["items"]["relative"] == {
        "status": "not reached",
        "text": "no cell of the notebook checks `relative`.",
    }
    assert result["items"]["edges"] == {"status": "no prediction"}
    assert result["items"]["flat"] == {"status": "predicted", "choice": "a height twice as large", "right": True}


def test_a_step_that_is_wrong_is_told_by_its_line_as_in_the_notebook():
    """What is known of a function's code and of its values on the way crosses the border."""
    wrong = "@ex.relative\ndef relative(A, B):\n    back = np.linalg.inv(A)\n    onward = B.T\n    return back @ onward"
    masked = "@ex.normalize\ndef normalize(v):\n    w = v[v**2 < v @ v / 2]\n    return v / (1e-9 + np.sqrt(w @ w))"
    cells = replaced(replaced(solved_cells(), "relative", wrong), "normalize", masked)
    items = batch.judged(notebook_text(cells).encode(), 1)["items"]
    assert "n line 4, `B.T`: one transpose should be left out." in items["relative"]["text"]
    assert "n line 4, `1e-9 + np.sqrt(w @ w)`" in items["normalize"]["text"]


def test_a_stage_computes_for_a_value_but_not_while_an_answer_is_judged():
    head = "from labkit.chapters.ch01_frames import stages\nstate = dict(A_deg=10.0, B_deg=20.0, C_deg=30.0)\n"
    value = f"{head}T = stages.compute_kuka_gimbal(state)['T']\nassert ex.after('invert') and T.shape == (4, 4)\n"
    name = next(text for _, text in solved_cells() if "ex.distance" in text)
    cells = replaced(solved_cells(), "distance", value + name)
    cells = replaced(cells, "invert", f"{head}@ex.invert\ndef invert(T):\n    stages.compute_kuka_gimbal(state)")
    result = batch.judged(notebook_text(cells).encode(), 1)
    assert result["items"]["distance"]["status"] == "correct"
    assert result["items"]["invert"]["status"] == "raised"
    assert "no figure computes while invert is judged" in result["items"]["invert"]["text"]


def test_reordered_cells_and_double_ids_cost_only_what_they_break():
    first, *rest = solved_cells()
    result = batch.judged(notebook_text([first, *(("x", text) for _, text in reversed(rest))]).encode(), 1)
    functions = [item.id for item in library.load(CHAPTER).items if hasattr(item, "draw")]
    assert {result["items"][id]["status"] for id in functions} == {"correct"}
    assert result["items"]["distance"]["text"].startswith("its cell raised NameError")


def test_without_bubblewrap_the_report_says_so(monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    sandbox.bubblewrap.cache_clear()
    assert "bubblewrap (it is not installed" in sandbox.sentence()
    sandbox.bubblewrap.cache_clear()
