"""The ledger as text: every row, or results and claims by document and status, refused where one reads its own
answer.
"""

from .circular import trial
from .ledger import COUNTED, KINDS, STATUSES, counts, judge, rows, table

CAVEAT = "The texts were made from PDFs: a digit may have been lost there as well as by the authors."


def as_text():
    """All rows, one line each, and the results and claims by status beneath."""
    lines = []
    for row, computed, status in table():
        value = computed.value
        if value is None or isinstance(value, str) or value != value:
            value = "-" if value is None or value != value else value
        else:
            value = f"{float(value):.8g}"
        mark = "" if status == row.status else f"  (the ledger says {row.status})"
        lines.append(f"{row.id:36} {row.printed:>14} {row.unit:5} computed {value:>14}  {row.kind}, {status}{mark}")
    return "\n".join([*lines, "", counts_text(rows())])


def counts_text(all_rows):
    """Results and claims by document and status, and how many other rows there are."""
    by_document = counts(all_rows)
    by_document["all four"] = {status: sum(c[status] for c in by_document.values()) for status in STATUSES}
    lines = [" " * 10 + "".join(f"{status:>15}" for status in STATUSES) + f"{'all':>6}"]
    for document, count in by_document.items():
        lines.append(f"{document:10}" + "".join(f"{n:15}" for n in count.values()) + f"{sum(count.values()):6}")
    others = [f"{sum(row.kind == kind for row in all_rows)} {kind}" for kind in KINDS if kind not in COUNTED]
    said = f"Results and claims. Not counted: {', '.join(others)}."
    return "\n".join([*lines, "", said, CAVEAT])


def faults(all_rows=None):
    """What a strict reader refuses, a sentence each: a status that does not come out, no proof, a circular row."""
    all_rows = rows() if all_rows is None else all_rows
    found = []
    for row, computed, status in table():
        if status != row.status:
            found.append(f"{row.id}: the ledger says {row.status}, the computation {judge(row, computed)}")
        if status != "reproduced" and not computed.proof:
            found.append(f"{row.id}: {status} without a proof")
    found += [
        f"{row.id}: the computed value follows the printed one, and is read, not computed"
        for row in trial(all_rows).followers
    ]
    return found
