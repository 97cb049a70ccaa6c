"""`python lab.py collect FOLDER_OR_ZIP... --out DIR`: submissions in, report.csv, class.html and feedback pages out.

One file at a time, for a cluster: `collect --one FILE --out DIR`, and then `collect --merge FOLDER... --out DIR`.
"""

import argparse
import json
import os
import re
import shutil
import sys
from pathlib import Path

from ..collect import batch, library, page, points, report, sandbox, submissions
from .arguments import COMMAND, Parser, Refusal


def main(arguments=None):
    """Raises `Refusal` or what `arguments.run` turns into a sentence."""
    options = _parser().parse_args(arguments)
    try:
        if options.points == "default":
            print(points.DEFAULT, end="")
        elif options.one:
            _one(options)
        else:
            _collect(options)
    except KeyboardInterrupt:
        raise Refusal("Interrupted. Called again it goes on where it was.") from None


def _parser():
    parser = Parser("collect", description="Judge submitted notebooks, and show what the class made of them.")
    parser.add_argument("folders", nargs="*", metavar="FOLDER_OR_ZIP", help="as Moodle, ILIAS or nbgitpuller give them")
    parser.add_argument("--out", default="collected", metavar="DIR", help="where the report goes (collected)")
    parser.add_argument(
        "--seed", type=_seed, help="of all draws; left out, a new one that nobody can guess, kept in DIR"
    )
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, metavar="N", help="notebooks judged at a time")
    parser.add_argument("--points", metavar="TOML", help="what a verdict is worth; `default` prints the default")
    parser.add_argument(
        "--names", metavar="CSV", help="a list that gives the pseudonyms names; `folders` takes the folders'"
    )
    parser.add_argument("--one", metavar="FILE", help="judge one notebook, write its JSON into DIR, print its verdicts")
    parser.add_argument("--merge", action="store_true", help="judge nothing: report on what is judged already")
    return parser


def _seed(text):
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"a seed is a whole number from 0 on, got {text!r}")
    return int(text)


def _one(options):
    """One file in, one JSON out; the verdicts are printed, with the draws on which an answer failed."""
    seed = batch.seed_of(options.out, options.seed)
    path = batch.judge_file(options.one, seed, options.out)
    result = json.loads(path.read_text(encoding="utf-8"))
    if "unreadable" in result:
        raise Refusal(f"{options.one} {result['unreadable']}")
    print(f"{options.one}: chapter {result['chapter']}, seed {seed}; judged in {path}")
    for id, verdict in result["items"].items():
        said = verdict.get("text") or verdict.get("choice") or ""
        print(f"{verdict['status']:13} {id}{': ' + said if said else ''}")
    print("\n".join([*result["stopped"], *result["cells"], result["sandbox"]]))


def _collect(options):
    if not options.folders:
        raise Refusal(f"Which submissions? For example: {COMMAND} collect submissions.zip --out marks")
    if options.jobs < 1:
        raise Refusal(f"--jobs is the number of notebooks judged at a time, got {options.jobs}")
    weights = points.read(options.points)
    names = report.read_names(options.names) if options.names not in (None, "folders") else {}
    out, problems = Path(options.out), []
    seed = batch.seed_of(out, options.seed)
    students = submissions.students(options.folders, problems)
    if not students:
        raise Refusal("; ".join(f"{key} {why}" for key, why in problems) or "no submission was found there")
    read, files = _read(students, problems)
    failed = {} if options.merge else batch.judge_all(files.items(), seed, out, options.jobs, _say)
    rows, gripes = _rows(students, read, failed, seed, out, weights, names, options.names == "folders")
    gripes = [("", place, why) for place, why in problems] + gripes
    _write(out, rows, gripes, weights, seed)
    print(
        f"{len(rows)} students, {len(gripes)} problems: {out / 'report.csv'}, {out / 'class.html'}, {out / 'feedback'}"
    )


def _read(students, problems):
    """({(student, number of file): digest or reason}, {digest: function that reads the file}) of all notebooks."""
    read, files = {}, {}
    for student in students:
        for k, file in enumerate(student.files):
            if not file.where[-1].lower().endswith((".ipynb", ".zip", ".json")):
                continue
            try:
                digest = submissions.digest(file.read())
            except (submissions.Unreadable, OSError) as reason:
                read[student.key, k] = None, submissions.why(reason)
                continue
            read[student.key, k] = digest, ""
            files.setdefault(digest, file.read)
    return read, files


def _rows(students, read, failed, seed, out, weights, names, by_folder):
    """The students with their results, and (student, file, what) of all that went wrong."""
    rows, gripes = [], []
    for student in students:
        row = report.Row(report.pseudonym(student.key, seed))
        if by_folder:
            row.names = {"Identifier": student.key, "Full name": student.name, "Email address": ""}
        elif names:
            row.names = report.named(student, names)
            if not row.names:
                gripes.append((row.student, "", "is not in the list of names"))
        own = [(k, *read[student.key, k]) for k in range(len(student.files)) if (student.key, k) in read]
        if not own:
            gripes.append((row.student, "", f"handed in no notebook: {_kinds(student)}"))
        for k, digest, why in own:
            label = f"file {k + 1} of {len(student.files)}"
            result = batch.known(out, digest, seed) if digest else None
            why = why or failed.get(digest, "")
            gripes += [(row.student, label, what) for what in _troubles(result, why)]
            if result and "chapter" in result:
                _keep_better(row, result, weights, gripes, label)
        rows.append(row)
    return sorted(rows, key=lambda row: (row.names.get("Full name", ""), row.student)), gripes


def _kinds(student):
    """The endings of what was handed in; the names of files may hold a student's own."""
    return ", ".join(sorted({Path(file.where[-1]).suffix or "a file" for file in student.files}))


def _troubles(result, why):
    if result is None:
        return [why or "is not judged yet"]
    return [result["unreadable"]] if "unreadable" in result else result["stopped"]


def _keep_better(row, result, weights, gripes, label):
    """Of several notebooks of one chapter the one with more points counts."""
    name = result["chapter"]
    before = row.chapters.get(name)
    if before is not None:
        gripes.append((row.student, label, f"another notebook of chapter {name}: the one with more points counts"))
        if _total(result, weights) <= _total(before, weights):
            return
    row.chapters[name] = result


def _total(result, weights):
    return sum(weights.of(result["chapter"], id, verdict) for id, verdict in result["items"].items())


def _write(out, rows, gripes, weights, seed):
    handed = {name for row in rows for name in row.chapters}
    chapters = [name for name in library.chapter_names() if name in handed]
    report.write_report(out / "report.csv", rows, weights, chapters)
    report.write_table(out / "problems.csv", ["student", "file", "what"], gripes)
    used = sorted({result["sandbox"] for row in rows for result in row.chapters.values()} or {sandbox.sentence()})
    facts = [
        *used,
        f"The draws follow from the seed {seed} and the content of each file. To judge one again, and to see "
        f"the calls on which an answer failed: `{COMMAND} collect --one FILE --seed {seed}`",
        "A prediction is counted where it stands in the notebook; one made with a button is not stored there.",
    ]
    (out / "class.html").write_text(page.class_page(rows, chapters, facts), encoding="utf-8", newline="\n")
    shutil.rmtree(out / "feedback", ignore_errors=True)
    (out / "feedback").mkdir()
    for row in rows:
        own = [f"{file} {what}".strip() for student, file, what in gripes if student == row.student]
        text = page.feedback_page(row, weights, chapters, own)
        (out / "feedback" / f"{_file_name(row, rows)}.html").write_text(text, encoding="utf-8", newline="\n")


def _file_name(row, rows):
    """The name where it is known and no other student has it, else the pseudonym."""
    name = re.sub(r"[^\w.-]+", "_", row.names.get("Full name", "")).strip("._")
    same = [other for other in rows if other.names.get("Full name") == row.names.get("Full name")]
    return name if name and len(same) == 1 else f"{name}_{row.student}" if name else row.student


def _say(done, total, left):
    """A line that is written over: how far it is, and how long it will take; into a file the end alone."""
    if done < total and not sys.stderr.isatty():
        return
    bar = "#" * round(30 * done / total)
    words = f"\r[{bar:30}] {done} of {total}, {left / 60:.0f} min left "
    print(words, end="" if done < total else "\n", file=sys.stderr, flush=True)
