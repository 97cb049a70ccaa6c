"""The ledger keeps its word: every row is computed, states the status the numbers give, and reads no printed answer."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from labkit.documents import circular, ledger, rounding, strict
from labkit.documents.ledger import Computed, Row
from labkit.verbs import ledger as verb
from labkit.verbs.arguments import Refusal

ROWS = ledger.rows()
CLAIMS = sorted((Path(ledger.__file__).parent).glob("*/claims_*.py"))


@pytest.mark.parametrize("row", ROWS, ids=[row.id for row in ROWS])
def test_row_has_the_status_it_states(row):
    computed = ledger.compute(row)
    assert ledger.judge(row, computed) == row.status, f"printed {row.printed}, computed {computed.value}"
    if row.status != "reproduced":
        assert computed.proof, "a number that does not come out needs its argument"


def test_every_computation_has_a_row():
    ledger._load_claims()
    used = {row.id.split("[")[0] for row in ROWS}
    assert set(ledger._functions) == used


def a_row(printed, kind="result"):
    return Row("x", "thesis", "", "", printed, "", kind, "reproduced", "")


@pytest.mark.parametrize(
    ("printed", "computed", "status"),
    [
        ("1.25", Computed(1.2549), "reproduced"),
        ("1.25", Computed(1.257, bound=0.004), "rounding"),
        ("1.25", Computed(1.257, bound=0.001), "cut off"),
        ("-1.25", Computed(-1.257), "cut off"),
        ("1.25", Computed(1.243), "contradiction"),
        ("1.25", Computed(1.243, slips=("here",)), "misprint"),
        ("1.25", Computed(1.243, slips=()), "misprint"),
        ("1.25", Computed(1.243, slips=("here", "elsewhere")), "contradiction"),
        ("1.25", Computed(1.9, bound=0.8), "not computable"),
        ("1.25", Computed(1.9, bound=0.8, simulated=True), "not computable"),
        ("1.25", Computed(1.30, bound=0.1, simulated=True), "consistent"),
        ("1.25", Computed(2.0, bound=0.1, simulated=True), "not computable"),
        ("1.25", Computed(None), "not computable"),
        ("1.25", Computed(np.nan), "not computable"),
        ("x + h", Computed("x + h"), "reproduced"),
        ("x + h", Computed("x - h"), "contradiction"),
        ("x + h", Computed("x + h", simulated=True), "consistent"),
    ],
)
def test_the_status_follows_from_the_numbers(printed, computed, status):
    assert ledger.judge(a_row(printed), computed) == status


def test_a_claim_that_fails_is_refuted():
    assert ledger.judge(a_row("none", "claim"), Computed("some")) == "refuted"
    assert ledger.judge(a_row("0.5", "claim"), Computed(0.2)) == "refuted"


@pytest.fixture(scope="module")
def moved():
    return circular.trial(ROWS)


def test_no_result_reads_its_own_printed_answer(moved):
    assert [row.id for row in moved.followers] == []


NO_TABLE = {  # what is computed without a table of data/, and why no move of one is seen
    "lateration.landmarks_2d": "landmarks of our own",
    "lateration.landmarks_3d": "landmarks of our own",
    "lateration.roots": "landmarks of our own",
    "kalman.vehicle_prior_cov": "the parameters found are rounded before it is computed",
    "tracker.reach": "appendix B, in machines.arm",
    "tracker.d6": "appendix B, in machines.arm",
    "optimization.extrema": "function (6-16), in thesis.wells",
    "optimization.stationary_points": "function (6-16), in thesis.wells",
    "optimization.x_newton": "function (6-16), in thesis.wells",
    "optimization.start_newton": "function (6-16), in thesis.wells",
    "optimization.iterations_newton": "a count",
    "handeye.independent_measurements": "a count",
    "chaining.frames_read": "a count",
    "pivot.unknowns": "a count",
    "pivot.min_poses": "a count",
}


def test_moved_tables_move_all_that_is_computed_from_tables(moved):
    assert {ledger.base_of(row) for row in moved.still} == set(NO_TABLE)
    assert all(after is not None for before, after in zip(moved.before, moved.after) if before is not None)


def test_a_row_that_reads_its_answer_is_found():
    read = ("frames.W_T_K0[0,3]", "tracker.block[0]", "handeye.x68_x_star45[2]")
    restated = [replace(row, kind="result") for row in ROWS if row.id in read]
    computed = [row for row in ROWS if row.id in ("tracker.average[0]", "chaining.product[0,3]")]
    assert circular.trial(restated + computed).followers == restated and len(restated) == len(read)


@pytest.mark.parametrize("path", CLAIMS, ids=lambda path: path.stem)
def test_no_verdict_is_typed(path):
    """No claim hands over a fixed value, a bound or a set of slips that is written down instead of computed."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Computed":
            given = {"value": node.args[0]} if node.args else {}
            given |= {"bound": node.args[1]} if len(node.args) > 1 else {}
            given |= {word.arg: word.value for word in node.keywords}
            for name in ("value", "bound", "slips"):
                fixed = not any(isinstance(n, (ast.Name, ast.Call)) for n in ast.walk(given.get(name, ast.Name())))
                nothing = isinstance(given.get(name), ast.Constant) and given[name].value is None
                assert nothing or not fixed, f"{path.name}, line {node.lineno}: {name} is typed"


@pytest.mark.parametrize("path", CLAIMS, ids=lambda path: path.stem)
def test_no_printed_answer_is_typed_into_its_computation(path):
    """A number of three digits or more that stands in the code is not the printed answer of one of its rows."""
    answers = {
        abs(rounding.number(row.printed)): row.id
        for row in ROWS
        if ledger._written(row).__code__.co_filename == str(path)
        and rounding.half_unit(row.printed) is not None
        and len(row.printed.lower().partition("e")[0].replace(".", "").strip("-0")) >= 3
    }
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        number = isinstance(node, ast.Constant) and type(node.value) in (int, float)
        assert not number or abs(node.value) not in answers, f"line {node.lineno} types {answers[abs(node.value)]}"


def test_strict_text_counts_results_and_claims():
    text = strict.counts_text(ROWS)
    counted = [row for row in ROWS if row.kind in ledger.COUNTED]
    assert text.splitlines()[5].split()[-1] == str(len(counted)) and "check" in text


def test_each_row_shows_its_lines():
    place, code = ledger.code_of(next(row for row in ROWS if row.id == "chaining.product[0,3]"))
    assert place.startswith("labkit/documents/lab_sheet/claims_chaining.py, line") and "def product" in code


def test_strict_refuses_what_a_reader_would_strike(monkeypatch, capsys):
    row = a_row("1.25")
    told = [(row, Computed(1.243), "contradiction"), (row, Computed(1.25), "reproduced")]
    monkeypatch.setattr(strict, "table", lambda: told)
    monkeypatch.setattr(strict, "trial", lambda rows: circular.Trial([row], [1.25], [1.26], np.array([[1.25, 0.01]])))
    wrong, unproved, circular_row = strict.faults([row])
    assert "says reproduced, the computation contradiction" in wrong and "without a proof" in unproved
    assert "follows the printed one" in circular_row
    with pytest.raises(Refusal, match="follows the printed one"):
        verb.main(["--strict"])
    assert "Results and claims" in capsys.readouterr().out
    monkeypatch.setattr(strict, "table", lambda: told[1:])
    monkeypatch.setattr(strict, "trial", lambda rows: circular.Trial([], [], [], np.empty((0, 2))))
    verb.main(["--strict"])
    assert "No row reads its own printed answer" in capsys.readouterr().out
