"""What a demo shows is what the notebooks ask and reveal, in their order; own questions are refused in one sentence."""

import json
import re
from types import SimpleNamespace

import pytest

from labkit.demo import notes, program
from labkit.exercises import session, source
from labkit.exercises.engine import Prediction


@pytest.fixture(scope="module")
def whole():
    return program.program()


def test_every_prediction_is_asked_once_in_the_order_of_the_notebooks(whole):
    """Oracle: the chapters' own lists, and a plain search in the sources."""
    predictions = {
        (c.name[:2], i.question): i for c in session.chapters() for i in c.items if isinstance(i, Prediction)
    }
    asked = [(card.chapter, card.asked.question) for card in whole.cards if card.asked]
    assert sorted(asked) == sorted(predictions) and len(asked) >= 44
    order = []
    for path in source.sources():
        text = path.read_text(encoding="utf-8")
        order += [(path.stem[:2], id) for id in re.findall(r'^ex\.predict\("(\w+)"', text, re.M)]
    ids = {key: item.id for key, item in predictions.items()}
    assert [(chapter, ids[chapter, question]) for chapter, question in asked] == order


def test_every_stage_of_the_notebooks_is_shown_once(whole):
    found = set()
    for path in source.sources():
        text = path.read_text(encoding="utf-8")
        names = re.findall(r"reveal=stages\.(\w+)\)|^stages\.(\w+)\(\)$", text, re.M)
        found |= {f"{path.stem[:2]}/{(a or b).replace('_', '-')}" for a, b in names} - {"00/colors"}
    assert sorted(whole.makers()) == sorted(found) and len(found) >= 44
    assert len({card.key for card in whole.cards}) == len(whole.cards)


def test_what_is_revealed_is_the_chapters_own_answer(whole):
    card = whole["05/scan-line"]
    prediction = next(c for c in session.chapters() if c.name == "05-hand-eye")["equator"]
    shown = card.declaration()
    assert (shown["answer"], shown["happened"]) == (prediction.answer, prediction.why)
    assert shown["heading"] == "Where to cut" and shown["shows"].startswith("Drag the sphere")
    number = whole["06/tx40"].declaration()
    assert (number["choices"], number["unit"]) == ((), "mm") and float(number["answer"]) == pytest.approx(
        161.3, abs=0.1
    )


def test_thumbnails_are_the_pictures_of_the_solved_notebooks(whole):
    pictures = program.thumbnails(whole.titles)
    have = [card.key for card in whole.cards if (card.chapter, card.cell) in pictures]
    assert have == [card.key for card in whole.cards if card.stage]
    assert all(png.startswith(b"\x89PNG") for png in pictures.values())


@pytest.mark.parametrize("wanted, said", [("13", "13"), ("frames", "frames")])
def test_an_unknown_chapter_is_refused_with_those_there_are(wanted, said):
    with pytest.raises(ValueError, match=f"{said!r}.*01_frames.*09_monte_carlo"):
        program.program([wanted])


def test_an_edition_without_sources_says_so(tmp_path):
    with pytest.raises(program.NotThere, match="no sources"):
        program.program(folder=tmp_path)


def test_a_card_that_is_not_there_is_named(whole):
    with pytest.raises(program.NotThere, match=r"There is no '05/nothing' here; there are \d+, from 00/quarter-turns"):
        whole["05/nothing"]


OWN = """
[[question]]
question = "How many frames are there?"
choices = ["two", "three"]
answer = "three"
why = "World, flange, tool."
stage = "01/three-points"
before = "01/kuka-gimbal"

[[question]]
question = "How far is it (mm)?"
unit = "mm"
answer = 12
"""


def written(tmp_path, text):
    path = tmp_path / "own.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_own_questions_stand_where_they_were_put_and_show_the_stage_named(tmp_path):
    shown = program.program(["01"], written(tmp_path, OWN))
    keys = [card.key for card in shown.cards]
    assert keys.index("own/1") + 1 == keys.index("01/kuka-gimbal") and keys[-1] == "own/2"
    assert shown["own/1"].make is shown["01/three-points"].make and shown["own/1"].stage == "01/three-points"
    assert shown["own/2"].asked.answer_text == "12" and shown["own/2"].declaration()["stage"] == ""
    assert shown["own/2"].title == "How far is it (mm)?"


def test_a_number_is_asked_for_with_its_unit(tmp_path):
    shown = program.program(["01"], written(tmp_path, OWN.replace(" (mm)?", "?")))
    assert shown["own/2"].asked.question == "How far is it (mm)?"


@pytest.mark.parametrize(
    "text, said",
    [
        ("question = 3", "own.toml: expected tables"),
        ("[[question]\n", "own.toml: this is no TOML"),
        ('[[question]]\nquestion = "a?"\nchoice = ["x"]', "question 1: there is no 'choice', only question, choices"),
        ('[[question]]\nchoices = ["x", "y"]', "question 1: a question is needed"),
        ('[[question]]\nquestion = "a?"\nchoices = ["x"]', "choices are 2 to 8 texts"),
        ('[[question]]\nquestion = "a?"\nchoices = ["x", "x"]', "two of the choices are alike"),
        ('[[question]]\nquestion = "a?"\nchoices = ["x", "y"]\nanswer = "z"', "'z' is none of the choices"),
        ('[[question]]\nquestion = "a?"\nanswer = "z"', "'z' is no number"),
        ('[[question]]\nquestion = "a?"\nanswer = true', "True is no number up to 1e"),
        ('[[question]]\nquestion = "a?"\nanswer = nan', "nan is no number up to 1e"),
        ('[[question]]\nquestion = "a?"\nanswer = -inf', "-inf is no number up to 1e"),
        ('[[question]]\nquestion = "a?"\nanswer = 10000000000000', "10000000000000 is no number up to 1e"),
        ("[[question]]\nquestion = 7", "question must be text"),
        ('[[question]]\nquestion = "a?"\nbefore = "01/none"', "question 1: there is no '01/none' here"),
        ('[[question]]\nquestion = "a?"\nstage = "05/scan-line"', "question 1: there is no '05/scan-line' here"),
        (f'[[question]]\nquestion = "{401 * "a"}"', "at most 400 letters long, got 401"),
        (
            f'[[question]]\nquestion = "a?"\nchoices = ["x", "{401 * "a"}"]',
            "choices is at most 400 letters long, got 401",
        ),
        ('[[question]]\nquestion = "  "', "question 1: a question is needed"),
        ("", "nothing else, got nothing"),
        ("question = []", "nothing else, got nothing"),
        ("question = " + 9999 * "[", "own.toml: "),
        (f"question = {9999 * '['}{9999 * ']'}", "brackets within brackets"),
        (f"{401 * 'k'} = 1", "and nothing else, got kkk"),
        (f"[[question]]\nquestion = [{999 * '7, '}7]", "question must be text, got [7, 7"),
        (1100 * 1000 * "#", "own questions take at most 1 MB, and this is 1.0 MB"),
    ],
)
def test_a_question_that_is_none_is_refused_with_its_place(tmp_path, text, said):
    with pytest.raises(ValueError) as refusal:
        program.program(["01"], written(tmp_path, text))
    told = str(refusal.value).replace(str(tmp_path), "")
    assert said in told and "\n" not in told and len(told) < 300


def test_a_file_of_a_windows_editor_is_read(tmp_path):
    shown = program.program(["01"], written(tmp_path, "\ufeff" + OWN.replace("\n", "\r\n")))
    assert "own/2" in [card.key for card in shown.cards]


def test_files_that_are_no_text_or_not_there_are_refused(tmp_path):
    path = tmp_path / "own.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueError, match="UTF-8"):
        program.program(["01"], path)
    with pytest.raises(OSError):
        program.program(["01"], tmp_path / "none.toml")


def test_notes_belong_to_cards(whole):
    """No note is left over; each says what to show, and on a question what tempts."""
    for key, note in notes._all().items():
        assert note["show"].endswith(".")
        assert bool(note.get("tempts")) == (whole[key].asked is not None), key


def test_mistakes_come_from_the_exercises_nearby_the_most_frequent_first():
    def exercise(id, *texts):
        return SimpleNamespace(id=id, mistakes=[SimpleNamespace(id=f"{id}-{t}", text=t) for t in texts])

    near = [exercise("a", "one", "two"), exercise("b", "three")]
    assert notes.mistakes(near, {}) == [("a", "one", 0), ("b", "three", 0), ("a", "two", 0)]
    assert notes.mistakes(near, {"a-two": 5, "b-three": 2}) == [("a", "two", 5), ("b", "three", 2)]


def test_mistakes_of_a_class_are_counted_from_its_verdicts(tmp_path):
    (tmp_path / "judged").mkdir()
    for k, items in enumerate([{"a": {"mistake": "m"}, "b": {}}, {"a": {"mistake": "m"}}, {}]):
        (tmp_path / "judged" / f"{k}.json").write_text(json.dumps({"items": items}), encoding="utf-8")
    assert notes.counted(tmp_path) == {"m": 2}
    with pytest.raises(ValueError, match="found no verdicts"):
        notes.counted(tmp_path / "judged")
    (tmp_path / "judged" / "9.json").write_text("[]", encoding="utf-8")
    with pytest.raises(ValueError, match="9.json: expected a verdict"):
        notes.counted(tmp_path)
