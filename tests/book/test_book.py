"""The book's pages: formulas, code, predictions, figures, ledger; one folder that names no other place."""

import json
import re
from html.parser import HTMLParser
from types import SimpleNamespace

import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output

from labkit.book import cells, figures, notebook, site, text
from labkit.chapters.ch07_dead_reckoning.exercises import CHAPTER
from labkit.exercises import source

SOLVED = {path.stem: nbformat.read(path.with_suffix(".ipynb"), as_version=4) for path in source.sources()}
PICTURE = figures.Figure("07_dead_reckoning-circles", "circles", "A < B", "Recorded: time.", (750, 450), 9)


class Tags(HTMLParser):
    """All tags with their attributes, in order; refuses what is not closed in order."""

    EMPTY = {"meta", "link", "img", "input", "br", "hr"}

    def __init__(self, page):
        super().__init__()
        self.open, self.found = [], []
        self.feed(page)
        assert not self.open, f"not closed: {self.open}"

    def handle_starttag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))
        if tag not in self.EMPTY:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag in self.EMPTY:
            return
        assert self.open[-1] == tag, f"{tag} closed within {self.open}"
        self.open.pop()


@pytest.mark.parametrize("stem", SOLVED)
def test_every_formula_of_the_course_becomes_mathml_and_every_text_well_formed(stem):
    for cell in SOLVED[stem].cells:
        if cell.cell_type == "markdown":
            page = text.as_html(cell.source)
            Tags(page)
            told = re.sub(r"<(code|pre|math).*?</\1>", "", page, flags=re.S)
            assert not re.search(r"\$|\\[A-Za-z]|\*\*", told), f"{cell.id}: left as it was: {told}"


def test_a_formula_is_set_and_one_with_an_unknown_word_is_refused():
    assert re.search(r"<mfrac>.*<mi>a</mi>.*<mi>b</mi>.*</mfrac>", text.mathml(r"\frac{a}{b}"))
    assert 'display="block"' in text.as_html("$$\nx = 1\n$$")
    assert "<msup><mi>Q</mi><mi>&#x022A4;</mi></msup>" in text.mathml(r"Q^\top P")
    assert text.as_html("costs $5 and $6").count("<math") == 0
    with pytest.raises(ValueError, match="nosuchword"):
        text.mathml(r"\nosuchword x")


def test_lines_of_a_formula_are_lined_up_and_their_marks_not_printed():
    made = text.mathml(r"\begin{aligned} a &= b, & c &= d \\ e &= f, & g &= h \end{aligned}", block=True)
    assert made.count("<mtr>") == 2 and made.count("<mtd") == 8 and ">&<" not in made
    with pytest.raises(ValueError, match="holds &"):
        text.mathml("a &= b")


def test_a_formula_within_a_line_can_break_before_its_equal_signs():
    assert [text.mathml(tex).count("<math") for tex in ("a = b = c", "= b", "x^{(n=2)}", r"\frac{a=b}{c}")] == [
        3,
        1,
        1,
        1,
    ]
    assert text.mathml("a = b").count('<mo form="infix">') == 1 and text.mathml("a = b", block=True).count("<math") == 1


def test_links_to_notebooks_lead_to_pages():
    assert 'href="02_chaining.html"' in text.as_html("[on](02_chaining.ipynb)")
    assert 'href="02_chaining.html#why"' in text.as_html("[on](../notebooks/02_chaining.ipynb#why)")
    assert 'href="https://example.org/a.ipynb"' in text.as_html("[off](https://example.org/a.ipynb)")


def test_a_prediction_asks_first_and_answers_in_what_is_closed():
    solved = SOLVED["07_dead_reckoning"]
    known = {item.id: item for item in CHAPTER.items if hasattr(item, "question")}
    page = cells.as_html(solved, known, lambda name, caption: f"<i>{name}</i>")
    asked = re.search(r'<section class="prediction" id="predict-roots">(.*?)</section>', page, re.S)[1]
    before, closed = asked.split("<details>")
    item = known["roots"]
    assert all(f">{choice}</button>" in before for choice in item.choices)
    assert "<strong>none</strong>" in closed and "<i>circles</i>" in closed and "<i>" not in before
    assert "guess" not in asked and before.count('data-right="true"') == 1
    assert "ex.progress()" not in page


def test_outputs_are_shown_as_what_they_are():
    outputs = [
        new_output("stream", text="a < b\n"),
        new_output("display_data", {"text/plain": "x", "text/html": '<a href="01_frames.ipynb" target="_blank">x</a>'}),
        new_output("display_data", {"text/plain": "x", "text/markdown": "**y** $z$"}),
        new_output("execute_result", {"text/plain": "1 < 2"}, execution_count=1),
    ]
    made = new_notebook(cells=[new_code_cell("print(1)", id="one", outputs=outputs), new_markdown_cell("## End")])
    page = cells.as_html(made, {}, None)
    Tags(page)
    for piece in ("a &lt; b", 'href="01_frames.html"', "<strong>y</strong>", "<math", "1 &lt; 2", '<h2 id="end">'):
        assert piece in page


def test_every_stage_of_the_course_is_found_by_the_name_its_cell_calls():
    for stem, solved in SOLVED.items():
        shown = [o for c in solved.cells for o in c.get("outputs", []) if "image/png" in o.get("data", {})]
        assert len(notebook.stages_of(solved)) == len(shown), stem


def test_a_page_from_a_folder_gets_the_drawing_in_space_as_a_classic_script():
    script = site.space()
    assert "export" not in script and "labkitSpace(" in script and "twgl" in script.splitlines()[0]
    assert re.search(r"return \{ View: \w+, ?works: \w+ \};", script[-80:])


def test_what_was_recorded_is_said():
    stage = {"handles": {"A": "A", "B": "B"}, "controls": {"n": {"label": "n"}, "m": {"label": "m"}}}
    data = {
        "declaration": {"handles": {"A": "A"}, "controls": {"n": {"label": "n"}}},
        "tracks": {"handle": 1, "play": 1},
    }
    said = figures.recorded_words(data, stage)
    assert said == (
        "Recorded: the ring along its dotted line, “n”, time. In the notebook 1 more point and 1 more control move."
    )


def entry(**changes):
    row = {"id": "a[0,1]", "document": "thesis", "place": "p. 3", "quantity": "x < y", "printed": "1,5", "unit": "mm"}
    row = SimpleNamespace(**{**row, "note": "", **changes})
    return SimpleNamespace(
        row=row, value="1.50", status="reproduced", proof="as 3 < 4", notebook="07_dead_reckoning.ipynb"
    )


def test_the_site_is_whole_well_formed_and_calls_no_other_host(tmp_path):
    solved = SOLVED["07_dead_reckoning"]
    shown = dict.fromkeys(notebook.stages_of(solved).values(), PICTURE)
    chapters = [site.Chapter("07_dead_reckoning", solved, shown), site.Chapter("08_kalman", SOLVED["10_ledger"], {})]
    site.write(chapters, [entry()], tmp_path)
    pages = {path.name: path.read_text(encoding="utf-8") for path in tmp_path.iterdir()}
    assert sorted(pages) == [
        "07_dead_reckoning.html", "08_kalman.html", "book.css", "book.js", "figures.html", "index.html", "ledger.html",
            "space.LICENSE.txt", "space.js",
    ]  # fmt: skip
    ids = {}
    for name, page in pages.items():
        if name.endswith(".html"):
            tags = Tags(page).found
            ids[name] = [attributes["id"] for _, attributes in tags if "id" in attributes]
            assert len(set(ids[name])) == len(ids[name]), f"{name}: an id is used twice"
    for name in ids:
        for tag, attributes in Tags(pages[name]).found:
            target = attributes.get("href", attributes.get("src", ""))
            assert not re.match(r"\w+:(?!image/png)|//", target), f"{name} calls {target}"
            page, _, place = target.partition("#")
            if tag == "a":
                assert (page or name) in ids and (not place or place in ids[page or name]), f"{name}: {target}"
            if tag == "img":
                assert "alt" in attributes
    assert not re.search(r"https?://(?!www\.w3\.org)|@import|url\(", pages["book.css"] + pages["book.js"])
    assert not re.search(r"^\s*(export|import)\b", pages["book.js"], re.M), "no modules where no server is"
    assert "x &lt; y" in pages["ledger.html"] and "as 3 &lt; 4" in pages["ledger.html"]


def test_a_film_is_a_script_that_hands_over_its_data(tmp_path):
    (tmp_path / figures.FOLDER).mkdir()
    made = figures.record("07_dead_reckoning", "methods", tmp_path)
    written = (tmp_path / figures.FOLDER / f"{made.key}.js").read_text(encoding="utf-8")
    key, data = json.loads(f"[{written.removeprefix('labkitFilm(').removesuffix(');' + chr(10))}]")
    assert key == made.key and data["size"] == list(made.size) and set(data["tracks"]) >= {"start", "control"}
    assert (tmp_path / figures.FOLDER / f"{made.key}.png").stat().st_size == made.bytes
