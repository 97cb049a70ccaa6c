"""class.html and the feedback pages: one file each, offline, for light and dark screens and for paper."""

import html
import statistics
from pathlib import Path

from ..exercises.engine import Prediction
from . import library, report

SIGNS = {
    "correct": ("c", "✓", "correct"),
    "named": ("n", "✗", "wrong, a named mistake"),
    "wrong": ("w", "✗", "wrong, not named"),
    "raised": ("r", "!", "raised an error"),
    "library": ("l", "L", "called the library's own answer"),
    "unfinished": ("u", "○", "unfinished"),
    "not reached": ("x", "–", "not reached"),
    "predicted": ("p", "▪", "predicted"),
    "no prediction": ("q", "·", "no prediction"),
    "": ("z", "", "not handed in"),
}
STYLE = Path(__file__).with_name("page.css").read_text(encoding="utf-8")


def document(title, body):
    head = '<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'
    head = f"{head}<title>{title}</title><style>{STYLE}</style>"
    return f'<!doctype html>\n<html lang="en"><head>{head}</head>\n<body>{body}</body></html>\n'


def marked(text):
    """Escaped text, `code` set as code, lines kept."""
    pieces = html.escape(str(text)).split("`")
    words = "".join(f"<code>{p}</code>" if k % 2 and k < len(pieces) - 1 else p for k, p in enumerate(pieces))
    return words.replace("\n", "<br>")


def sign_of(verdict):
    if verdict is None:
        return SIGNS[""]
    return SIGNS["named" if verdict["status"] == "wrong" and verdict.get("mistake") else verdict["status"]]


# --- the class ------------------------------------------------------------------------------------------------------


def class_page(rows, chapters, facts):
    """The lecturer's page; `facts` are sentences for its foot: how it was judged."""
    handed = {name: [row for row in rows if name in row.chapters] for name in chapters}
    title = "What the class made of it"
    counted = f"{_number(len(rows), 'student')}, {_number(len(chapters), 'chapter')}"
    parts = [f"<h1>{title}</h1>", f'<p class="soft">{counted}</p>', _key()]
    for name in chapters:
        parts.append(_chapter(name, handed[name]))
    parts.append("<h2>How this was judged</h2>" + "".join(f"<p>{marked(fact)}</p>" for fact in facts))
    return document(title, "\n".join(parts))


def _number(count, what):
    return f"{count} {what}{'' if count == 1 else 's'}"


def _key():
    words = "".join(
        f'<span class="{c}">{sign}</span>{said}' for c, sign, said in SIGNS.values() if said != "not handed in"
    )
    return f'<p class="key">{words}</p>'


def _chapter(name, rows):
    chapter = library.load(name)
    results = [row.chapters[name] for row in rows]
    items = [item for item in chapter.items if not isinstance(item, Prediction)]
    found = [_seen(item, results) for item in items]
    number = name[:2].lstrip("0") or "0"
    parts = [
        f"<h2>Chapter {number}: {html.escape(chapter.title)}</h2>",
        f"<p>{len(rows)} handed in.</p>",
        _take_up(found),
    ]
    parts += [_exercise(exercise) for exercise in found]
    asked = [item for item in chapter.items if isinstance(item, Prediction)]
    parts += [_prediction(item, [result["items"][item.id] for result in results]) for item in asked]
    parts += ["<h3>Who solved what</h3>", _map(chapter, rows, name)]
    return "\n".join(parts)


def _seen(item, results):
    minutes = [result["minutes"][item.id] for result in results if item.id in result["minutes"]]
    return report.exercise(item, [result["items"][item.id] for result in results], minutes)


def _take_up(exercises):
    common, hard = report.take_up(exercises)
    lines = [f"<b>{count}</b> in <code>{id}</code>: {marked(text)}" for count, id, text in common]
    lines += [f"<code>{e.id}</code>: {e.statuses['correct']} of {sum(e.statuses.values())} solved it." for e in hard]
    if not lines:
        none = "No named mistake was made twice, and every exercise was solved by half of those who tried or more."
        return f"<h3>For the next lecture</h3><p>{none}</p>"
    return "<h3>For the next lecture</h3><ul>" + "".join(f"<li>{line}</li>" for line in lines) + "</ul>"


def _map(chapter, rows, name):
    head = "".join(f'<th scope="col"><div>{item.id}</div></th>' for item in chapter.items)
    lines = []
    for row in sorted(rows, key=lambda row: (-_solved(row, name), row.student)):
        signs = [sign_of(row.chapters[name]["items"][item.id]) for item in chapter.items]
        cells = "".join(f"<td class={c}>{sign}" for c, sign, _ in signs)
        lines.append(f'<tr><th scope="row">{html.escape(row.shown)}</th>{cells}')
    body = f"<thead><tr><th></th>{head}</tr></thead><tbody>{''.join(lines)}</tbody>"
    return f'<div class="wide"><table class="map">{body}</table></div>'


def _solved(row, name):
    return sum(verdict["status"] == "correct" for verdict in row.chapters[name]["items"].values())


def _exercise(exercise):
    total = sum(exercise.statuses.values())
    solved = exercise.statuses["correct"]
    order = ("wrong", "raised", "library", "unfinished", "not reached")
    others = ", ".join(f"{exercise.statuses[s]} {s}" for s in order if exercise.statuses[s])
    time = f"; half of the class took {statistics.median(exercise.minutes):.0f} min or less" if exercise.minutes else ""
    words = f"{solved} of {total} solved it{'; the others: ' + others if others else ''}{time}."
    parts = [
        f"<h3><code>{exercise.id}</code> {_bar(solved / max(1, total))} {round(100 * solved / max(1, total))} %</h3>"
    ]
    parts.append(f'<p class="soft">{words}</p>')
    for count, text, ids in exercise.mistakes:
        shown = f'{marked(text)} <span class="id">{", ".join(ids)}</span>'
        parts.append(f'<div class="row"><span class="count">{count}</span><span>{shown}</span></div>')
    if exercise.alike:
        parts.append("<p>Alike, and no mistake names them:</p>")
    for count, text in exercise.alike[:5]:
        parts.append(f'<div class="row"><span class="count">{count}</span><span>{marked(text)}</span></div>')
    return "".join(parts)


def _bar(share, kind=""):
    return f'<span class="track{kind}"><i style="width:{100 * share:.0f}%"></i></span>'


def _prediction(item, verdicts):
    parts = [f"<h3>Prediction <code>{item.id}</code></h3><p>{marked(item.question)}</p>"]
    for choice, count, right in report.predictions(item, verdicts):
        unit = f" {item.unit}" if item.unit and not choice.startswith("no") else ""
        what = f"{html.escape(choice)}{unit}{' ✓' if right else ''}"
        bar = _bar(count / max(1, len(verdicts)), "" if right else " other")
        parts.append(f'<div class="row"><span class="count">{count}</span>{bar}<span>{what}</span></div>')
    return "".join(parts)


# --- one student ----------------------------------------------------------------------------------------------------


def feedback_page(row, points, chapters, problems):
    """What a student would have read beneath the cells, with the points; nothing of anybody else."""
    title = f"Feedback for {html.escape(row.shown)}"
    parts = [f"<h1>{title}</h1>"]
    parts += [f'<div class="card r"><p>{marked(problem)}</p></div>' for problem in problems]
    for name in [name for name in chapters if name in row.chapters]:
        parts.append(_own_chapter(row, name, points))
    return document(title, "\n".join(parts))


def _own_chapter(row, name, points):
    chapter, result = library.load(name), row.chapters[name]
    found = report.marks(row, points, [name])
    total, most = (round(sum(mark[k] for mark in found.values()), 4) for k in (0, 1))
    parts = [f"<h2>{html.escape(chapter.title)}: {total:g} of {most:g} points</h2>"]
    for item in chapter.items:
        verdict = result["items"][item.id]
        kind, sign, said = sign_of(verdict)
        got, best = found[name, item.id]
        worth = f", {got:g} of {best:g}" if best else ""
        text = _prediction_text(item, verdict) if isinstance(item, Prediction) else verdict.get("text", "")
        parts.append(
            f'<div class="card {kind}"><h3><b aria-hidden="true">{sign}</b><code>{item.id}</code>: {said}{worth}</h3>'
            f"<p>{marked(text)}</p></div>"
        )
    notes = [*result["stopped"], *result["cells"]]
    if notes:
        parts.append("<h3>Cells</h3><ul>" + "".join(f"<li>{marked(note)}</li>" for note in notes) + "</ul>")
    return "\n".join(parts)


def _prediction_text(item, verdict):
    if verdict["status"] != "predicted":
        return "No prediction stands in the notebook; one made with a button is not stored in it."
    return f"Your prediction: {verdict['choice']}. {item.why}"
