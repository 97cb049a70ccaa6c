"""Chapter 10: the ledger as a table one can search."""

import html

import ipywidgets

from ... import live

ALL = "all"
SHOWN = 150  # rows that are drawn at once; the search narrows what is longer
HEADER = ("document", "place", "quantity", "printed", "computed", "unit", "status", "chapter")
LINK = "color: var(--jp-content-link-color, currentColor); cursor: pointer"
SIGNS = {"reproduced": "✓", "rounding": "≈", "misprint": "✗", "superseded": "✗", "unpublished": "?"}


def matching(entries, text="", document=ALL, status=ALL):
    """The entries of a document and a status whose row holds every word of `text`, in any column, in any case."""
    words = text.lower().split()
    return [
        entry
        for entry in entries
        if document in (ALL, entry.row.document)
        and status in (ALL, entry.status)
        and all(word in _haystack(entry) for word in words)
    ]


def _haystack(entry):
    row = entry.row
    told = (row.document, row.place, row.quantity, row.printed, row.id, row.note, entry.status, entry.proof)
    return " ".join(told).lower()


def table_html(entries):
    """The first rows as an HTML table, with a link to each row's chapter, and how many there are in all."""
    head = "".join(f"<th>{title}</th>" for title in HEADER)
    body = "".join(_row_html(entry) for entry in entries[:SHOWN])
    count = f"{len(entries)} row{'' if len(entries) == 1 else 's'}"
    count += f", the first {SHOWN} of them shown" if len(entries) > SHOWN else ""
    if not entries:
        return '<p role="status">0 rows: no row of this document and status holds all these words.</p>'
    return (
        f'<p role="status">{count}</p><div style="max-height: 26em; overflow: auto">'
        f'<table style="border-spacing: 0.8em 0.15em; line-height: 1.4">'
        f'<thead><tr style="text-align: left">{head}</tr></thead>'
        f"<tbody>{body}</tbody></table></div>"
    )


def _row_html(entry):
    row = entry.row
    chapter = entry.notebook.removesuffix(".ipynb")
    link = f'<a href="{entry.notebook}" target="_blank" style="{LINK}">{chapter}</a>'
    cells = (row.document, row.place, row.quantity, row.printed, entry.value, "" if row.unit == "1" else row.unit)
    told = [html.escape(cell) for cell in cells]
    told[2] += _argument_html(entry)
    text = "".join(f"<td>{cell}</td>" for cell in told)
    hover = html.escape(entry.proof or row.note, quote=True)
    status = f'<td style="white-space: nowrap">{SIGNS[entry.status]} {entry.status}</td>'
    return f'<tr title="{hover}" style="vertical-align: top">{text}{status}<td>{link}</td></tr>'


def _argument_html(entry):
    """The argument, folded away: it opens by mouse, touch and keyboard, and stays open to be pointed at."""
    said = entry.proof or entry.row.note
    if not said:
        return ""
    told = f'<div style="width: 24em">{html.escape(said)}</div>'
    return f'<details><summary style="{LINK}">why</summary>{told}</details>'


class LedgerTable(ipywidgets.VBox):
    """A search field and two choices over a table of ledger entries; works offline, and its text output never changes.

    entries: objects with `row`, `value`, `status`, `proof`, `notebook`, as `labkit.documents.pages.entries` gives them.
    """

    def __init__(self, entries):
        self.entries, self.at_rest = list(entries), []
        documents = [ALL, *dict.fromkeys(entry.row.document for entry in self.entries)]
        statuses = [ALL, *(status for status in SIGNS if any(entry.status == status for entry in self.entries))]
        self.search = ipywidgets.Text(placeholder="a place, a quantity, a number", description="search")
        self.document = ipywidgets.Dropdown(options=documents, value=ALL, description="document")
        self.status = ipywidgets.Dropdown(options=statuses, value=ALL, description="status")
        self.table = ipywidgets.HTML()
        controls = (self.search, self.document, self.status)
        super().__init__([ipywidgets.HBox(controls, layout={"flex_flow": "row wrap"}), self.table])
        for control in controls:
            control.observe(self._show, "value")
        self._show()

    def _show(self, change=None):
        found = matching(self.entries, self.search.value, self.document.value, self.status.value)
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
