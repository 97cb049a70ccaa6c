"""The bench that types a folder of answers into the notebooks: what it reads, and what it calls a fault."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent / "bench"))

import typed_answers

FILE = """#%% 01/1 | wrong | normalize | divides by the sum
@ex.normalize
def normalize(v):
    return v / v.sum()

#%% 01/02 | right | invert | by NumPy
@ex.invert
def invert(T):
    return np.linalg.inv(T)
"""


@pytest.fixture
def answers(tmp_path):
    (tmp_path / "ch01.txt").write_text(FILE, encoding="utf-8")
    return typed_answers.read(tmp_path / "ch01.txt")


def test_each_answer_has_its_number_and_its_cell(answers):
    assert [(a.number, a.label, a.exercise, a.why) for a in answers] == [
        ("01/01", "wrong", "normalize", "divides by the sum"),
        ("01/02", "right", "invert", "by NumPy"),
    ]
    assert answers[0].code.startswith("@ex.normalize\ndef") and answers[0].code.endswith("v.sum()\n")


def test_the_cell_of_an_exercise_is_found_by_its_check():
    cells = typed_answers.cells("01")
    assert [typed_answers.asked(cell, ["invert", "distance"]) for cell in cells].count("invert") == 1
    assert "distance" in [typed_answers.asked(cell, ["invert", "distance"]) for cell in cells]


@pytest.mark.parametrize(
    "label, statuses, fault",
    [
        ("wrong", ("not yet", "not yet"), []),
        ("wrong", ("not yet", "correct"), ["ACCEPTED"]),
        ("right", ("correct", "correct"), []),
        ("right", ("correct", "your code raised"), ["REFUSED"]),
        ("right", ("correct", "no verdict"), ["NO VERDICT"]),
    ],
)
def test_a_wrong_answer_taken_and_a_right_one_refused_are_faults(answers, label, statuses, fault):
    row = answers[0]._replace(label=label), [(status, "") for status in statuses]
    assert typed_answers.faults(row) == fault
    assert all(word in typed_answers.block(row) for word in fault)
