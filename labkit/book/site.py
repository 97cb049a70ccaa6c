"""The pages of the book together: contents, chapters, ledger, all figures; one style, one script, no other host."""

import html
import re
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from . import cells, figures, notebook, text

HERE = Path(__file__).parent
STAGE = HERE.parent / "stage"
TITLE = "Robot calibration and localization"
LEDGER = ("document", "place", "quantity", "printed", "computed", "unit", "status", "chapter")


@dataclass(frozen=True)
class Chapter:
    """A chapter of the book: `stem` "01_frames", its executed notebook, and {function name: Figure} of its Stages."""

    stem: str
    notebook: object
    figures: dict

    @property
    def title(self):
        """Its first heading, with the number in front."""
        return re.search(r"^# (.+)$", self.notebook.cells[0].source, re.M)[1]

    @property
    def aim(self):
        """What one will do in it, as Markdown."""
        found = re.search(r"\*\*What you will do[^*]*\*\*(.+?)(?:\n\n|$)", self.notebook.cells[0].source, re.S)
        return found[1].strip() if found else ""


def write(chapters, entries, folder):
    """Write all pages of `Chapter`s into a folder that holds the films already; `entries` are the ledger's rows."""
    pages = {"index.html": contents(chapters), "figures.html": gallery(chapters), "ledger.html": ledger(entries)}
    titles = {"index.html": TITLE, "figures.html": "All figures", "ledger.html": "The ledger"}
    for number, chapter in enumerate(chapters):
        name = f"{chapter.stem}.html"
        titles[name] = chapter.title
        pages[name] = chapter_page(chapter, chapters[number - 1 : number], chapters[number + 1 : number + 2])
    for name, body in pages.items():
        (folder / name).write_text(page(titles[name], body, chapters, name), encoding="utf-8")
    styles = (STAGE / "stage.css", HERE / "book.css")
    (folder / "book.css").write_text("\n".join(path.read_text(encoding="utf-8") for path in styles), encoding="utf-8")
    (folder / "book.js").write_text(script(), encoding="utf-8")
    (folder / "space.js").write_text(space(), encoding="utf-8")
    (folder / "space.LICENSE.txt").write_bytes((STAGE / "space.LICENSE.txt").read_bytes())


def script():
    """One classic script of the three modules: pages opened from a folder may load no modules."""
    parts = [path.read_text(encoding="utf-8") for path in (STAGE / "stage.js", STAGE / "film.js", HERE / "book.js")]
    plain = re.sub(r"^export default .*$|^export (?=class|function|const)", "", "\n".join(parts), flags=re.M)
    return f'"use strict";\n(() => {{\n{plain}}})();\n'


def space():
    """The drawing in space as a classic script that hands its module to `labkitSpace`."""
    head, module = (STAGE / "space.js").read_text(encoding="utf-8").split("\n", 1)
    body, names = re.fullmatch(r"(.*)export\s*\{([^}]*)\};?\s*", module, re.S).groups()
    handed = re.sub(r"(\w+) as (\w+)", r"\2: \1", names)
    return f'{head}\n"use strict";labkitSpace((() => {{ {body}return {{ {handed} }}; }})());\n'


def page(title, body, chapters, here):
    """One page, with the way to all others."""
    targets = [(f"{chapter.stem}.html", chapter.title) for chapter in chapters]
    targets = [("index.html", "Contents"), *targets, ("figures.html", "All figures"), ("ledger.html", "The ledger")]
    links = "".join(
        f'<li><a href="{target}"{" aria-current=page" * (target == here)}>{html.escape(name)}</a></li>'
        for target, name in targets
    )
    heading = title if title == TITLE else f"{title} · {TITLE}"
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{html.escape(heading)}</title>\n"
        '<link rel="stylesheet" href="book.css">\n<script src="book.js" defer></script>\n</head>\n<body>\n'
        '<a class="skip" href="#text">To the text</a>\n'
        f'<header><details class="menu"><summary>Chapters</summary><nav aria-label="Chapters"><ul>{links}</ul></nav>'
        f'</details><a class="home" href="index.html">{TITLE}</a>'
        '<button type="button" class="theme" hidden>Dark</button></header>\n'
        f'<main id="text">\n{body}\n</main>\n</body>\n</html>\n'
    )


def contents(chapters):
    """The first page: what the book is, and the chapters with a picture each."""
    cards = []
    for chapter in chapters:
        richest = max(chapter.figures.values(), key=lambda figure: figure.bytes, default=None)
        picture = f'<img alt="" loading="lazy" src="{figures.FOLDER}/{richest.key}.png">' if richest else ""
        cards.append(
            f'<li><a href="{chapter.stem}.html">{picture}<strong>{html.escape(chapter.title)}</strong></a>'
            f"{text.as_html(chapter.aim)}</li>"
        )
    return (
        f"<h1>{TITLE}</h1>\n<p>Four real documents, a lab sheet, a master thesis, a research report and a lecture, are "
        "recomputed number by number. This is the reading edition of the workbook: its text, its code with the "
        "solutions, and its figures. They move: pull a ring along its dotted line, a slider, or time; what lies in "
        "space turns under the finger. Every figure can be made to fail. In the notebooks everything in them is free, "
        "and the code is yours to write.</p>\n"
        '<p>Where a question stands before a figure, choose an answer first.</p>\n<ol class="cards" start="0">'
        f'{"".join(cards)}</ol>\n<p><a href="figures.html">All figures on one page</a> · '
        '<a href="ledger.html">The ledger: every printed number, recomputed</a></p>'
    )


def chapter_page(chapter, before, after):
    """A chapter's cells, and the ways on and back."""
    known = import_module(f"labkit.chapters.ch{chapter.stem}.exercises").CHAPTER.items
    predictions = {item.id: item for item in known if hasattr(item, "question")}
    body = cells.as_html(chapter.notebook, predictions, lambda name, caption: figures.as_html(chapter.figures[name]))
    ways = [f'<a rel="prev" href="{c.stem}.html">← {html.escape(c.title)}</a>' for c in before]
    ways += [f'<a rel="next" href="{c.stem}.html">{html.escape(c.title)} →</a>' for c in after]
    return f'{body}\n<nav class="ways" aria-label="Before and after">{"".join(ways)}</nav>'


def gallery(chapters):
    """All figures, with the way to where each is explained."""
    parts = ["<h1>All figures</h1>\n<p>Each with its failure. The heading leads to the chapter that explains it.</p>"]
    for chapter in chapters:
        places = {name: cell for cell, name in notebook.stages_of(chapter.notebook).items()}
        for name, figure in chapter.figures.items():
            target = f"{chapter.stem}.html#{places[name]}"
            parts.append(f'<h2><a href="{target}">{html.escape(figure.name)}</a></h2>{figures.as_html(figure)}')
    return "\n".join(parts)


def ledger(entries):
    """Every printed number with what is computed today, and a search."""
    head = "".join(f'<th scope="col">{word}</th>' for word in LEDGER)
    documents = list(dict.fromkeys(entry.row.document for entry in entries))
    statuses = list(dict.fromkeys(entry.status for entry in entries))
    rows = "".join(_ledger_row(entry) for entry in entries)
    return (
        "<h1>The ledger</h1>\n<p>Every number the documents print as a result, with what is computed from their data. "
        "<em>why</em> opens the argument.</p>\n"
        '<form class="search" role="search" hidden><label>Search <input type="search" '
        'placeholder="a place, a quantity, a number"></label>'
        f"{_choice('document', documents)}{_choice('status', statuses)}"
        '<output role="status"></output></form>\n<div class="wide"><table class="ledger">'
        f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _choice(name, words):
    options = "".join(f"<option>{html.escape(word)}</option>" for word in ["all", *words])
    return f'<label>{name.capitalize()} <select name="{name}">{options}</select></label>'


def _ledger_row(entry):
    row, stem = entry.row, entry.notebook.removesuffix(".ipynb")
    told = (row.document, row.place, row.quantity, row.printed, entry.value, "" if row.unit == "1" else row.unit)
    fields = [html.escape(str(word)) for word in told]
    argument = entry.proof or row.note
    if argument:
        fields[2] += f"<details><summary>why</summary>{html.escape(argument)}</details>"
    fields += [html.escape(entry.status), f'<a href="{stem}.html">{stem}</a>']
    cells_of_it = "".join(f'<td data-name="{name}">{field}</td>' for name, field in zip(LEDGER, fields))
    return f'<tr id="{html.escape(row.id)}">{cells_of_it}</tr>'
