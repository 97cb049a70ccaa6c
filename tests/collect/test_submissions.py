"""Reading what students handed in, as several systems leave it; points, names, tables."""

import ast
import csv
import json
import zipfile

import pytest

from labkit.collect import library, points, report, submissions
from labkit.collect.submissions import Unreadable
from labkit.exercises import session
from labkit.verbs import collect
from labkit.verbs.arguments import Refusal, run

CODE = "from labkit.exercises import course\nex = course('02-chaining')"


def notebook(*sources, **more):
    cells = [{"cell_type": "code", "source": source, "metadata": {}} for source in sources or (CODE,)]
    return json.dumps({"cells": cells, **more})


def keys(path):
    problems = []
    found = {
        student.key: [file.where[-1] for file in student.files] for student in submissions.students([path], problems)
    }
    assert not problems
    return found


def filled(folder, *names):
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(notebook(), encoding="utf-8")
    return folder


def test_moodle_tells_students_apart_by_number_in_folders_and_in_flat_files(tmp_path):
    folder = filled(tmp_path, "Jörg Müller_17_assignsubmission_file_/a.ipynb", "Eve_18_assignsubmission_file_b.ipynb")
    assert keys(folder) == {"17": ["a.ipynb"], "18": ["Eve_18_assignsubmission_file_b.ipynb"]}


def test_ilias_and_nbgitpuller_and_any_folder_a_student(tmp_path):
    ilias = filled(tmp_path / "1", "Übung/Abgaben/Müller_Jörg_jm_4711/x.ipynb", "Übung/Abgaben/Li_Ana_al_4712/y.ipynb")
    assert set(keys(ilias)) == {"4711", "4712"}
    homes = filled(
        tmp_path / "2", "anna/lab/notebooks/01.ipynb", "anna/lab/notebooks/02.ipynb", "bo/lab/notebooks/01.ipynb"
    )
    assert keys(homes) == {"anna": ["01.ipynb", "02.ipynb"], "bo": ["01.ipynb"]}
    assert set(keys(filled(tmp_path / "3", "anna.ipynb", "bo.ipynb"))) == {"anna", "bo"}


def test_zip_files_within_zip_files_and_names_in_any_encoding(tmp_path):
    with zipfile.ZipFile(tmp_path / "inner.zip", "w") as archive:
        archive.writestr("__MACOSX/._x.ipynb", "rubbish")
        archive.writestr("mein Heft ß.ipynb", notebook())
    with zipfile.ZipFile(tmp_path / "outer.zip", "w") as archive:
        archive.write(tmp_path / "inner.zip", "Ünal_12345_assignsubmission_file_/Abgabe.zip")
        archive.writestr("Li_12346_assignsubmission_file_/damaged.zip", b"PK no zip file")
    students = submissions.students([tmp_path / "outer.zip"], [])
    assert [(s.key, s.files[0].where[-1]) for s in students] == [
        ("12345", "mein Heft ß.ipynb"),
        ("12346", "damaged.zip"),
    ]
    assert submissions.parse(students[0].files[0].read()).chapter == "02-chaining"
    with pytest.raises(Unreadable, match="cannot be unpacked"):
        students[1].files[0].read()


def test_what_is_not_there_is_a_problem_and_stops_nothing(tmp_path):
    problems = []
    found = submissions.students([tmp_path / "nowhere", filled(tmp_path / "some", "a/x.ipynb", "b/x.ipynb")], problems)
    assert problems == [("nowhere", "there is no such file or folder")] and len(found) == 2


@pytest.mark.parametrize(
    "text, why",
    [
        ("", "is empty"),
        ("{", "JSON is broken"),
        ("[" * 100_000, "JSON is broken"),
        ("7", "no code cells"),
        (json.dumps({"cells": [{"cell_type": "markdown", "source": CODE}]}), "no code cells"),
        (notebook("print(1)"), "belongs to no chapter"),
        (notebook(*["x = 1"] * 3000), "more than 2000 code cells"),
    ],
    ids=range(7),
)
def test_what_is_no_notebook_is_refused_in_one_sentence(text, why):
    with pytest.raises(Unreadable, match=why):
        submissions.parse(text.encode())


def test_the_chapter_is_read_from_the_cells_not_from_the_name():
    assert submissions.parse(notebook(CODE, "@ex.invert\ndef f(): ...").encode()).chapter == "02-chaining"
    lost = notebook("@ex.kron_row\ndef kron_row(A, B): ...", "@ex.dh_matrix\ndef dh_matrix(): ...")
    assert submissions.parse(lost.encode()).chapter == "06-tracker"
    old = {"worksheets": [{"cells": [{"cell_type": "code", "input": CODE}]}]}
    assert submissions.parse(json.dumps(old).encode()).chapter == "02-chaining"


def test_widget_state_and_large_outputs_are_not_looked_at():
    found = json.loads(notebook(metadata={"widgets": {"state": {"x": "y" * 5_000_000}}}))
    found["cells"][0]["outputs"] = [{"output_type": "stream", "text": "z" * 5_000_000}]
    assert submissions.parse(json.dumps(found).encode()).cells == [CODE]


def test_minutes_are_counted_between_cells_without_the_pauses():
    def ran(source, at):
        return {"cell_type": "code", "source": source, "metadata": {"execution": {"iopub.execute_input": at}}}

    day = "2026-04-01T10:{:02}:00.000Z"
    cells = [ran(CODE, day.format(0)), ran("ex.chain(f)", day.format(6)), ran("ex.orthonormalize(f)", day.format(50))]
    assert submissions.parse(json.dumps({"cells": cells}).encode()).minutes == {"chain": 6.0}


# --- points, names, tables ------------------------------------------------------------------------------------------


def test_points_follow_status_mistake_and_worth(tmp_path):
    path = tmp_path / "points.toml"
    path.write_text(
        '[status]\nraised = 0.25\n[worth]\n"01-frames/invert" = 2\n[mistake]\n"01-frames/invert-x" = 0.75\n'
    )
    own = points.read(path)
    assert own.of("01-frames", "invert", {"status": "correct"}) == 2
    assert own.of("01-frames", "invert", {"status": "wrong", "mistake": "invert-x"}) == 1.5
    assert own.of("01-frames", "relative", {"status": "wrong", "mistake": "other"}) == 0.5
    assert own.of("01-frames", "relative", {"status": "raised"}) == 0.25
    assert points.read().best("01-frames", "flat", {"status": "predicted"}) == 0


@pytest.mark.parametrize(
    "text",
    ["[status]\ncorect = 1\n", "[status]\ncorrect = -1\n", "[marks]\n", "[status", 'status = "x"\n'],
    ids=range(5),
)
def test_points_that_cannot_be_are_refused_with_the_entry(tmp_path, text):
    path = tmp_path / "points.toml"
    path.write_text(text)
    with pytest.raises(points.PointsError, match="points.toml: "):
        points.read(path)


def test_names_are_joined_by_number_login_or_folder(tmp_path):
    path = tmp_path / "list.csv"
    path.write_text(
        "Identifier,Full name,Email address\nParticipant 1000007,Jörg Müller,j@x.org\n", encoding="utf-8-sig"
    )
    names = report.read_names(path)
    assert report.named(submissions.Student("1000007", "whoever"), names)["Full name"] == "Jörg Müller"
    assert report.named(submissions.Student("1000008", "whoever"), names) == {}
    path.write_text("login;Vorname;Nachname\nal47;Ana;Li\n", encoding="utf-8")
    assert report.named(submissions.Student("al47", "al47"), report.read_names(path))["Full name"] == "Ana Li"


def test_no_cell_of_a_table_is_a_formula(tmp_path):
    report.write_table(tmp_path / "t.csv", ["a"], [["=1+1"], ["-3.5"], ["@x"]])
    with open(tmp_path / "t.csv", newline="") as file:
        assert [row[0] for row in csv.reader(file)] == ["a", "'=1+1", "-3.5", "'@x"]


def test_equal_wrong_answers_are_counted_and_mistakes_that_share_a_text_are_one():
    item = library.load("01-frames")["relative"]
    mistake = item.mistakes[0]
    verdicts = [{"status": "wrong", "mistake": mistake.id, "text": mistake.text}] * 3
    verdicts += [{"status": "wrong", "alike": "abc", "text": "off by 3 deg"}] * 2 + [{"status": "wrong", "alike": "d"}]
    found = report.exercise(item, verdicts + [{"status": "correct"}] * 4, [])
    assert found.mistakes == [(3, mistake.text, [mistake.id])] and found.alike == [(2, "off by 3 deg")]
    assert found.share == 0.4 and report.take_up([found])[0] == [(3, "relative", mistake.text)]


def test_refusals_are_one_sentence(tmp_path, capsys):
    for words in (
        [],
        [str(tmp_path / "nowhere")],
        ["x", "--jobs", "0"],
        ["x", "--seed", "-1"],
        ["--one", str(tmp_path)],
    ):
        assert run(collect.main, [*words, "--out", str(tmp_path / "out")]) == 1
        said = capsys.readouterr().err.strip()
        assert said and "\n" not in said and "Traceback" not in said
    with pytest.raises(Refusal, match="Which submissions"):
        collect.main(["--out", str(tmp_path / "out")])


@pytest.mark.parametrize("path", sorted(session.SOLUTIONS.glob("*.py")), ids=lambda path: path.stem)
def test_a_notebook_asks_of_its_stages_only_what_a_submission_may(path):
    """Stages are not drawn there: a cell may show one, read a constant, let one compute, and no more."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    shown = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    shown |= {id(word.value) for node in ast.walk(tree) if isinstance(node, ast.Call) for word in node.keywords}
    shown |= {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call) and id(node) in shown}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "stages":
            assert node.attr.isupper() or node.attr.startswith("compute_") or id(node) in shown, ast.unparse(node)
