"""The ledger's pages: built from rows and computations alone, and README says what they say."""

import re
from dataclasses import replace

import pytest

from labkit.chapters.ch10_ledger import table as widget
from labkit.documents import ledger, pages


def entry(**changes):
    row = ledger.Row("pivot.tip", "thesis", "table 3", "tip, x", "1.25", "mm", "result", "misprint", "a note")
    given = {
        "value": "1.521",
        "status": "misprint",
        "proof": "The mean of the rows above is 1.521.",
        "notebook": "03_quirlen.ipynb",
        "bound": "",
        "place": "",
        "code": "",
    }
    row = replace(row, **{k: v for k, v in changes.items() if k in ledger.COLUMNS and k != "status"})
    return pages.Entry(row, **{**given, **{k: v for k, v in changes.items() if k in given}})


SOME = [
    entry(),
    entry(id="pivot.tip[1]", quantity="tip, y", printed="2.5", value="5.20"),
    entry(document="lecture", status="reproduced", proof="", quantity="<script>", place="Übersicht"),
    entry(document="report", status="consistent", proof="Simulated: 3 mm.", kind="claim"),
]


def test_readme_shows_the_totals():
    text = pages.README.read_text(encoding="utf-8")
    assert text == pages.with_totals(text, ledger.rows()), "run: python -m labkit.documents.pages"


def test_totals_count_results_and_claims():
    rows = ledger.rows()
    counted = [row for row in rows if row.kind in ("result", "claim")]
    assert sum(sum(count.values()) for count in ledger.counts(rows).values()) == len(counted) < len(rows)
    last = pages.totals_markdown(rows).splitlines()[-1]
    assert last.startswith("| all |") and last.endswith(f"| {len(counted)} |")
    assert sum(map(int, re.findall(r"\d+", pages.headline(rows))[1:])) == len(counted)


def test_totals_need_their_marks():
    with pytest.raises(ValueError, match="once each"):
        pages.with_totals("no marks here", [])
    again = pages.with_totals(f"a\n{pages.BEGIN}\nold\n{pages.END}\nb", [])
    assert "old" not in again and again.startswith("a\n") and again.endswith("\nb")


@pytest.mark.parametrize(
    ("printed", "value", "text"),
    [
        ("1.25", 1.2512, "1.251"),
        ("12", 12.04, "12.0"),
        ("1,5", 1.46, "1.46"),
        ("0.0", -1e-12, "0.00"),
        ("3e-4", 3.14e-4, "0.000314"),
        ("O(M)", "O(M)", "O(M)"),
    ],
)
def test_values_show_one_digit_more_than_is_printed(printed, value, text):
    assert pages.value_text(entry(printed=printed).row, value) == text


def test_what_is_not_computed_is_a_dash():
    assert pages.value_text(entry().row, None) == pages.value_text(entry().row, float("nan")) == "-"
    assert pages.bound_text(None) == "" and pages.bound_text(0.00123) == "1.2e-03"


def test_counts_are_shown_as_counts():
    assert pages.value_text(entry(printed="31", unit="1").row, 24.0) == "24"
    assert pages.value_text(entry(printed="31", unit="mm").row, 24.0) == "24.0"


def test_rows_with_one_argument_make_one_finding():
    found = pages.findings(SOME, pages.WRONG)
    assert len(found) == 1 and len(found[0].entries) == 2 and found[0].places == ["table 3"]
    page = pages.findings_html(SOME, pages.WRONG)
    assert "1.521" in page and "The mean of the rows above" in page and "03_quirlen" in page and "report" not in page
    assert "Simulated: 3 mm." in pages.findings_html(SOME, pages.OPEN)
    assert pages.findings([entry(kind="consequence")], pages.WRONG) == []
    assert "<script>" not in pages.findings_html(SOME, ("reproduced",)) + widget.table_html(SOME)


def test_each_row_knows_its_notebook():
    by_topic = {row.id.split(".")[0]: ledger.chapter_of(row) for row in ledger.rows()}
    assert by_topic["frames"] == "01_frames" and by_topic["particles"] == "09_monte_carlo"
    solved = {path.stem for path in (pages.README.parent / "solutions").glob("*.py")}
    assert {ledger.chapter_of(row) for row in ledger.rows()} <= solved, "every link leads to a notebook"


def test_pages_go_chapter_by_chapter(monkeypatch):
    some = [row for row in ledger.rows() if row.id in ("kalman.fusion_x", "lateration.landmarks_2d")][::-1]
    monkeypatch.setattr(pages, "table", lambda: [(row, ledger.compute(row), row.status) for row in some])
    notebooks = [entry.notebook for entry in pages.entries()]
    assert len(notebooks) > 1 and notebooks == sorted(notebooks)


def test_arguments_open_without_a_mouse_and_no_hit_is_said():
    page = widget.table_html(SOME)
    assert page.count("<details>") == len(SOME) and "<summary" in page
    shown = widget.table_html([entry(proof="", note="", bound="1.0e-03", place="a.py, line 3", code="def f(): <b>")])
    assert "bound 1.0e-03" in shown and "half a unit of the last digit 5.0e-03" in shown
    assert "a.py, line 3" in shown and "def f(): &lt;b&gt;" in shown
    assert "no row" in widget.table_html([]) and "<table" not in widget.table_html([])


@pytest.mark.parametrize(
    ("search", "count"),
    [
        ({}, 4),
        ({"text": "TIP y"}, 1),
        ({"document": "thesis"}, 2),
        ({"status": "misprint"}, 2),
        ({"text": "übersicht"}, 1),
        ({"text": "mean rows", "status": "misprint"}, 2),
        ({"text": "nothing like it"}, 0),
        ({"document": "lab sheet"}, 0),
        ({"kind": "claim"}, 1),
        ({"kind": widget.COUNTED}, 4),
    ],
)
def test_search(search, count):
    assert len(widget.matching(SOME, **search)) == count


def test_table_follows_its_controls_and_its_text_is_constant():
    table = widget.LedgerTable(SOME)
    assert "4 rows" in table.table.value
    table.search.value = "simulated"
    assert "1 row<" in table.table.value and table.status.options[0] == "all"
    assert repr(table) == repr(widget.LedgerTable(SOME[:1]))


def test_long_tables_are_cut():
    many = widget.table_html(SOME * 100)
    assert many.count('<tr style="vertical') == widget.SHOWN and "400 rows, the first 150" in many
