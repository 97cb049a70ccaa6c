"""The ledger as pages: rows with computed values, what does not fit, what nobody can check, the totals.

`python -m labkit.documents.pages` writes the totals into README.md, between two marks; a test says when they are stale.
"""

import html
from dataclasses import dataclass
from pathlib import Path

from .ledger import COUNTED, DOCUMENTS, STATUSES, Row, chapter_of, code_of, counts, rows, table
from .rounding import half_unit

README = Path(__file__).resolve().parents[2] / "README.md"
BEGIN, END = "<!-- ledger totals: begin -->", "<!-- ledger totals: end -->"
WRONG, OPEN = ("misprint", "contradiction", "refuted"), ("consistent", "not computable")


@dataclass(frozen=True)
class Entry:
    """A row with what its computation says: value and bound as text, status found, proof, the chapter's notebook, and
    where and by which lines it is computed.
    """

    row: Row
    value: str
    status: str
    proof: str
    notebook: str
    bound: str = ""
    place: str = ""
    code: str = ""


def entries():
    """All rows as `Entry`s, chapter by chapter; computes the whole ledger."""
    found = [
        Entry(
            row,
            value_text(row, computed.value),
            status,
            computed.proof,
            f"{chapter_of(row)}.ipynb",
            bound_text(computed.bound),
            *code_of(row),
        )
        for row, computed, status in table()
    ]
    return sorted(found, key=lambda entry: entry.notebook)


def value_text(row, value):
    """A computed value as text, with one digit more than is printed; words and counts as they are."""
    if value is None or value != value:
        return "-"
    if half_unit(row.printed) is None or isinstance(value, str):
        return str(value)
    if "e" in row.printed.lower():
        return f"{float(value):.4g}"
    decimals = row.printed.replace(",", ".").partition(".")[2]
    if not decimals and row.unit in ("", "1") and float(value).is_integer():
        return str(int(value))
    text = f"{float(value):.{len(decimals) + 1}f}"
    return text.lstrip("-") if float(text) == 0 else text


def bound_text(bound):
    """A bound as text with two digits, empty where there is none."""
    return f"{float(bound):.1e}" if bound is not None and float(bound) > 0 else ""


@dataclass(frozen=True)
class Finding:
    """Rows of one document that share an argument: entries, and the proof."""

    entries: tuple
    proof: str

    @property
    def places(self):
        """The places of the rows, each once."""
        return list(dict.fromkeys(entry.row.place for entry in self.entries))


def findings(found, statuses):
    """The counted entries of these statuses, and the checks among them, grouped by document and proof, in the order of
    the ledger.
    """
    groups = {}
    for entry in found:
        if entry.status in statuses and entry.row.kind in (*COUNTED, "check"):
            groups.setdefault((entry.row.document, entry.proof), []).append(entry)
    return [Finding(tuple(group), proof) for (_, proof), group in groups.items()]


MAX_SHOWN = 6  # entries of one finding that are written out


def findings_html(found, statuses):
    """A page of findings, one paragraph each, by document: what is printed, what is computed, and the argument."""
    parts = []
    for document in DOCUMENTS:
        here = [f for f in findings(found, statuses) if f.entries[0].row.document == document]
        if not here:
            continue
        parts.append(f"<h3>{document}</h3>")
        parts += [_finding_html(finding) for finding in here]
    return "\n".join(parts) or "<p>Nothing.</p>"


def _finding_html(finding):
    rows_shown = [
        f"<li>{html.escape(e.row.quantity)}: printed <b>{html.escape(e.row.printed)}</b>, computed "
        f"<b>{html.escape(e.value)}</b> {html.escape(e.row.unit if e.row.unit != '1' else '')} "
        f"<i>({e.status})</i></li>"
        for e in finding.entries[:MAX_SHOWN]
    ]
    more = len(finding.entries) - MAX_SHOWN
    if more > 0:
        rows_shown.append(f"<li>and {more} more of the same kind</li>")
    first = finding.entries[0]
    places = html.escape("; ".join(finding.places))
    link = f'<a href="{first.notebook}">{first.notebook.removesuffix(".ipynb")}</a>'
    return f"<p><b>{places}</b> ({link})</p><ul>{''.join(rows_shown)}</ul><p>{html.escape(finding.proof)}</p>"


def totals_markdown(all_rows):
    """Results and claims as a Markdown table, a line per status and one for all."""
    by_document = counts(all_rows)
    columns = [*by_document.values(), {s: sum(c[s] for c in by_document.values()) for s in STATUSES}]
    lines = [f"| results and claims | {' | '.join(DOCUMENTS)} | all four |", f"| --- |{' ---: |' * len(columns)}"]
    for status in STATUSES:
        lines.append(f"| {status} | {' | '.join(str(column[status]) for column in columns)} |")
    lines.append(f"| all | {' | '.join(str(sum(column.values())) for column in columns)} |")
    return "\n".join(lines)


def headline(all_rows):
    """The totals in one sentence."""
    found = {status: sum(count[status] for count in counts(all_rows).values()) for status in STATUSES}
    agree, off = sum(found[s] for s in ("reproduced", "rounding", "cut off")), sum(found[s] for s in WRONG)
    return (
        f"{sum(found.values())} results and claims: {agree} come out from printed inputs, {off} do not, "
        f"{found['consistent']} are possible, {found['not computable']} nobody can check."
    )


def with_totals(text, all_rows):
    """The text of README.md with fresh totals between the marks; refuses a text without them."""
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise ValueError(f"README.md must hold {BEGIN} and {END} once each, to say where the totals stand")
    head, rest = text.split(BEGIN)
    return f"{head}{BEGIN}\n{headline(all_rows)}\n\n{totals_markdown(all_rows)}\n{END}{rest.split(END)[1]}"


def main(readme=README):
    """Write the totals into README.md."""
    readme.write_text(with_totals(readme.read_text(encoding="utf-8"), rows()), encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
