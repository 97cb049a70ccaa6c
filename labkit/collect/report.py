"""From verdicts to files: report.csv, problems.csv, and the numbers that class.html shows."""

import csv
import hashlib
import io
import re
from collections import Counter
from dataclasses import dataclass, field

from ..exercises.engine import Prediction
from ..exercises.value import Value
from ..reading import regular
from . import library

FORMULA = ("=", "+", "-", "@", "\t", "\r")  # a spreadsheet takes such a cell for a formula


@dataclass
class Row:
    """One student: a pseudonym, what a list of names says, and the judged result of each chapter."""

    student: str
    names: dict = field(default_factory=dict)
    chapters: dict = field(default_factory=dict)

    @property
    def shown(self):
        return self.names.get("Full name") or self.names.get("Identifier") or self.student


def pseudonym(key, seed):
    """A name that is the same for a student in every run with this seed, and says nothing to anybody."""
    return "S-" + hashlib.sha256(f"{seed} {key}".encode()).hexdigest()[:8]


def read_names(path):
    """Rows of a list of names, as {what tells a student apart: columns}; every cell of a row may be what does.

    Raises
    ------
    ValueError
        When the file is no table with a header.
    """
    with open(regular(path), newline="", encoding="utf-8-sig") as file:
        text = file.read()
    dialect = ";" if text.partition("\n")[0].count(";") > text.partition("\n")[0].count(",") else ","
    rows = list(csv.DictReader(io.StringIO(text), delimiter=dialect))
    if not rows or any(None in row for row in rows):
        raise ValueError(f"{path}: expected a table with a header line, and as many cells in every line")
    found = {}
    for row in rows:
        for cell in row.values():
            for word in {str(cell or "").strip(), *re.findall(r"^\D*?(\d{3,})$", str(cell or "").strip())}:
                if word:
                    found.setdefault(word, row)
    return found


def named(student, names):
    """What the list says about a student: by number, by folder, by name."""
    row = names.get(student.key) or names.get(student.name) or {}
    if not row:
        return {}
    identifier = next((cell for cell in row.values() if str(cell or "").strip().endswith(student.key)), student.key)
    full = next((row[key] for key in ("Full name", "Vollständiger Name", "name", "Name") if row.get(key)), "")
    first, last = (
        (row.get("First name") or row.get("Vorname")),
        (row.get("Last name", row.get("Surname")) or row.get("Nachname")),
    )
    full = full or " ".join(filter(None, (first, last)))
    mail = next((row[key] for key in ("Email address", "E-Mail-Adresse", "E-Mail", "email") if row.get(key)), "")
    return {"Identifier": identifier, "Full name": full, "Email address": mail}


def safe(cell):
    """A cell that no spreadsheet takes for a formula."""
    text = str(cell)
    return f"'{text}" if text.startswith(FORMULA) and not re.fullmatch(r"-?[\d.]+", text) else text


def write_table(path, header, rows):
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows([[safe(cell) for cell in row] for row in rows])


def columns(chapters):
    """(chapter, exercise id) of all items in the chapters that were handed in, in the order of the notebooks."""
    return [(name, item.id) for name in chapters for item in library.load(name).items]


def marks(row, points, chapters):
    """(points, most points) of each exercise of a student; a chapter that was not handed in earns nothing."""
    found = {}
    for name, id in columns(chapters):
        verdict = row.chapters.get(name, {}).get("items", {}).get(id) or missing(name, id)
        found[name, id] = points.of(name, id, verdict), points.best(name, id, verdict)
    return found


def missing(name, id):
    """The verdict on an item of a chapter that was not handed in."""
    return {"status": "no prediction" if isinstance(library.load(name)[id], Prediction) else "not reached"}


def write_report(path, rows, points, chapters):
    """report.csv: one row a student, the columns of Moodle's import of grades first."""
    with_names = any(row.names for row in rows)
    head = ["Identifier", *(["Full name", "Email address"] if with_names else [])]
    header = [*head, "Grade", "Maximum Grade", "Feedback comments", *(f"{name}/{id}" for name, id in columns(chapters))]
    lines = []
    for row in rows:
        found = marks(row, points, chapters)
        total, most = (sum(mark[k] for mark in found.values()) for k in (0, 1))
        own = [row.names.get(column, "") for column in head] if row.names else [row.student, *[""] * (len(head) - 1)]
        solved = sum(v["status"] == "correct" for result in row.chapters.values() for v in result["items"].values())
        asked = sum(not isinstance(item, Prediction) for name in row.chapters for item in library.load(name).items)
        comment = f"{solved} of {asked} exercises correct" if row.chapters else "no readable notebook"
        cells = [f"{mark[0]:g}" for mark in found.values()]
        lines.append([*own, f"{round(total, 4):g}", f"{round(most, 4):g}", comment, *cells])
    write_table(path, header, lines)


# --- the class ------------------------------------------------------------------------------------------------------


@dataclass
class Exercise:
    """What a class made of one exercise."""

    id: str
    statuses: Counter
    mistakes: list  # (count, text, ids of the mistakes that share it)
    alike: list  # (count, what they have in common)
    minutes: list

    @property
    def tried(self):
        return sum(self.statuses[s] for s in ("correct", "wrong", "raised", "library"))

    @property
    def share(self):
        return self.statuses["correct"] / max(1, sum(self.statuses.values()))


def exercise(item, verdicts, minutes):
    """An `Exercise` from the verdicts of all who handed the chapter in."""
    text_of = {mistake.id: mistake.text for mistake in item.mistakes}
    counts, ids, alike = Counter(), {}, {}
    for verdict in verdicts:
        if verdict.get("mistake") in text_of:
            text = text_of[verdict["mistake"]]
            counts[text] += 1
            ids.setdefault(text, set()).add(verdict["mistake"])
        elif verdict.get("alike"):
            alike.setdefault(verdict["alike"], []).append(verdict.get("text", ""))
    mistakes = sorted(((n, text, sorted(ids[text])) for text, n in counts.items()), key=lambda m: (-m[0], m[1]))
    same = [(len(texts), _in_common(item, key, texts)) for key, texts in sorted(alike.items()) if len(texts) > 1]
    same.sort(key=lambda pair: (-pair[0], pair[1]))
    return Exercise(item.id, Counter(v["status"] for v in verdicts), mistakes, same, sorted(minutes))


def _in_common(item, key, texts):
    """A wrong value itself; of a wrong function what was said about it most often."""
    if isinstance(item, Value):
        return f"`{key}`{' ' + item.unit if item.unit else ''}"
    said, _ = max(Counter(texts).items(), key=lambda pair: (pair[1], pair[0]))
    return said


def predictions(item, verdicts):
    """(choice, count, whether it is right) of a prediction: its choices in order, or the numbers that were given."""
    counts = Counter(v["choice"] for v in verdicts if v["status"] == "predicted")
    choices = [str(choice) for choice in item.choices] or sorted((c for c in counts if c != "not a choice"), key=float)
    rows = [(choice, counts[choice], item.is_right(choice if item.choices else float(choice))) for choice in choices]
    rows += [("not a choice", counts["not a choice"], False)] if counts["not a choice"] else []
    return rows + [("none in the notebook", sum(v["status"] == "no prediction" for v in verdicts), False)]


def take_up(exercises):
    """What to take up in the next lecture: the named mistakes most made, then the exercises fewest have solved."""
    common = sorted(
        ((count, exercise.id, text) for exercise in exercises for count, text, _ in exercise.mistakes if count > 1),
        key=lambda found: (-found[0], found[1], found[2]),
    )
    hard = sorted((e for e in exercises if e.tried), key=lambda e: (e.share, e.id))
    return common[:3], [e for e in hard[:3] if e.share < 0.5]
