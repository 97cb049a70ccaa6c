"""Chapter 10: the ledger as a table one can search."""

import html

import ipywidgets

from ... import live
from ...documents import ledger
from ...documents.rounding import half_unit

ALL = "all"
SHOWN = 150  # rows that are drawn at once; the search narrows what is longer
HEADER = {"status": "8.5em", "quantity": "auto", "printed": "7em", "computed": "7em"}  # column: its width
LINK = "color: var(--jp-content-link-color, currentColor); cursor: pointer"
SIGNS = {
    "reproduced": "✓",
    "rounding": "≈",
    "cut off": "≈",
    "misprint": "✗",
    "contradiction": "✗",
    "refuted": "✗",
    "consistent": "?",
    "not computable": "–",
}
COUNTED = "results and claims"


def matching(entries, text="", document=ALL, status=ALL, kind=ALL):
    """The entries of a document, status and kind whose row holds every word of `text`, in any column, in any case."""
    words = text.lower().split()
    return [
        entry
        for entry in entries
        if document in (ALL, entry.row.document)
        and status in (ALL, entry.status)
        and (kind in (ALL, entry.row.kind) or (kind == COUNTED and entry.row.kind in ledger.COUNTED))
        and all(word in _haystack(entry) for word in words)
    ]


def _haystack(entry):
    row = entry.row
    told = (row.document, row.place, row.quantity, row.printed, row.id, row.note, row.kind, entry.status, entry.proof)
    return " ".join(told).lower()


def table_html(entries):
    """The first rows as an HTML table, with a link to each row's chapter, and how many there are in all."""
    head = "".join(f'<th style="width: {width}; text-align: left">{title}</th>' for title, width in HEADER.items())
    body = "".join(_row_html(entry) for entry in entries[:SHOWN])
    count = f"{len(entries)} row{'' if len(entries) == 1 else 's'}"
    count += f", the first {SHOWN} of them shown" if len(entries) > SHOWN else ""
    if not entries:
        return '<p role="status">0 rows: no row of this document, status and kind holds all these words.</p>'
    return (
        f'<p role="status">{count}</p><div style="max-height: 32em; overflow: auto">'
        f'<table style="table-layout: fixed; width: 100%; border-spacing: 0.4em 0.15em; line-height: 1.35">'
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"
    )


def _row_html(entry):
    """Two table rows: what is printed and computed, and beneath it, over the whole width, the argument."""
    row = entry.row
    unit = "" if row.unit in ("", "1") or entry.value == "-" else f" {row.unit}"
    where = f'{html.escape(f"{row.document}, {row.place}")}, <a href="{entry.notebook}" target="_blank" style="{LINK}">'
    where += f"chapter {int(entry.notebook[:2])}</a>"
    what = f"{html.escape(row.quantity)}<br><small>{where}</small>"
    status = f"{SIGNS[entry.status]} {entry.status}"
    cells = (status, what, html.escape(row.printed), html.escape(entry.value + unit))
    told = "".join(f'<td style="{WRAP}">{cell}</td>' for cell in cells)
    why = f'<td colspan="{len(HEADER)}" style="{WRAP}">{_argument_html(entry)}</td>'
    return f'<tr style="vertical-align: top">{told}</tr><tr>{why}</tr>'


WRAP = "overflow-wrap: anywhere; text-align: left"


def _argument_html(entry):
    """The argument, its numbers and its code, folded away: it opens by mouse, touch and keyboard."""
    numbers = f"A {entry.row.kind}. Printed {entry.row.printed}, computed {entry.value}"
    numbers += f", bound {entry.bound}" if entry.bound else ""
    numbers += f", half a unit of the last digit {half:.1e}." if (half := half_unit(entry.row.printed)) else "."
    said = " ".join(part for part in (entry.proof, entry.row.note and f"({entry.row.note})", numbers) if part)
    code = f"<div>{html.escape(entry.place)}</div>{code_html(entry.code)}" if entry.code else ""
    told = f'<div style="max-width: 48em">{html.escape(said)}</div>{code}'
    return f'<details><summary style="{LINK}">why</summary>{told}</details>'


def code_html(code):
    """Lines of code as HTML that scrolls instead of growing wider."""
    style = "max-height: 16em; overflow: auto; margin: 0.3em 0; font-size: 0.9em"
    return f'<pre tabindex="0" style="{style}">{html.escape(code)}</pre>'


class LedgerTable(ipywidgets.VBox):
    """A search field and three choices over a table of ledger entries; works offline, its text output never changes.

    entries: objects with `row`, `value`, `status`, `proof`, `notebook`, as `labkit.documents.pages.entries` gives them.
    """

    def __init__(self, entries):
        self.entries, self.at_rest = list(entries), []
        documents = [ALL, *dict.fromkeys(entry.row.document for entry in self.entries)]
        statuses = [ALL, *(status for status in SIGNS if any(entry.status == status for entry in self.entries))]
        self.search = ipywidgets.Text(placeholder="a place, a quantity, a number", description="search")
        self.document = ipywidgets.Dropdown(options=documents, value=ALL, description="document")
        self.status = ipywidgets.Dropdown(options=statuses, value=ALL, description="status")
        kinds = [
            ALL,
            COUNTED,
            *(kind for kind in ledger.KINDS if any(entry.row.kind == kind for entry in self.entries)),
        ]
        self.kind = ipywidgets.Dropdown(options=kinds, value=ALL, description="kind")
        self.table = ipywidgets.HTML()
        controls = (self.search, self.kind, self.document, self.status)
        super().__init__([ipywidgets.HBox(controls, layout={"flex_flow": "row wrap"}), self.table])
        for control in controls:
            control.observe(self._show, "value")
        self._show()

    def _show(self, change=None):
        found = matching(self.entries, self.search.value, self.document.value, self.status.value, self.kind.value)
        self.table.value = table_html(found)
        for store in self.at_rest:
            store()

    def __repr__(self):
        return "[table: the ledger, searchable]"

    @property
    def widget(self):
        """Itself: what a prediction reveals is asked for its widget."""
        return self

    def still(self):
        """The table as it is now, as HTML that needs no kernel."""
        return f"{self.table.value}<small>{live.AGAIN}</small>"

    def _ipython_display_(self):
        shown = live.show(lambda: self, repr(self), self.still)
        if shown:
            self.at_rest.append(shown.refresh)
