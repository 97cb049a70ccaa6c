"""Writes a synthetic class of chapter 1: what each student got right, wrong, or not done is planted, and known.

    python tests/collect/classroom.py FOLDER [STUDENTS] [DAMAGED]

The wrong answers are code as students write it. Which mistake each is, is asked of the engine as a notebook asks it.
"""

import json
import random
import re
import sys
import zipfile
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from labkit.collect import library
from labkit.exercises import source
from labkit.verbs import build

CHAPTER = "01-frames"
WRONG = {  # code of wrong answers, several an exercise
    "normalize": [
        "v / np.sum(v)",
        "v * np.linalg.norm(v)",
        "v / np.linalg.norm(v) ** 2",
        "v / np.max(np.abs(v)) + 0.1",
    ],
    "invert": ["T.T", "-T", "np.block([[T[:3, :3].T, -T[:3, 3:]], [np.zeros((1, 3)), 1]])", "T", "T[:3]", "T @ T @ T"],
    "relative": ["A_T @ B_T", "np.linalg.inv(B_T) @ A_T", "A_T @ np.linalg.inv(B_T)", "B_T - A_T", "1 / 0"],
    "gram_schmidt": ["np.column_stack([a, b, np.cross(a, b)])", "np.eye(3)", "undefined_name"],
    "angle_deg": ["0.5", "12.0", "'twelve'"],
    "distance": ["0.0", "99.9", "1e6"],
}
ALONE = ("normalize", "invert", "matrix_from_kuka", "kuka_from_matrix")  # their cells define nothing else
FAMILY = ("Müller", "Šťastný", "O'Brien", "García Márquez", "Li", "Ünal", "von der Weide", "=SUM(A1)")
GIVEN = ("Jörg", "Zoë", "Łukasz", "Ana", "Mehmet", "Søren", "<b>Eve</b>")


def solved_cells():
    """[(id, source)] of the code cells of the solved notebook."""
    notebook = build.solved_notebook(source.find(CHAPTER))
    return [(cell.id, cell.source) for cell in notebook.cells if cell.cell_type == "code"]


def replaced(cells, id, code):
    """The cells with another answer in the cell that checks an exercise; None takes the cell away."""
    k = next(k for k, (_, text) in enumerate(cells) if re.search(rf"(?<![\w.])ex\.{id}\b", text))
    return [*cells[:k], *([] if code is None else [(cells[k][0], code)]), *cells[k + 1 :]]


def function_cell(id, expression):
    names = ", ".join(library.load(CHAPTER)[id].arguments)
    return f"@ex.{id}\ndef {id}({names}):\n    return {expression}"


def notebook_text(cells):
    blocks = [
        {"cell_type": "code", "id": id, "metadata": {}, "execution_count": None, "outputs": [], "source": text}
        for id, text in cells
    ]
    return json.dumps({"cells": blocks, "metadata": {}, "nbformat": 4, "nbformat_minor": 5}, ensure_ascii=False)


def verdict_in_a_notebook(id, expression):
    """(status, id of the mistake) that the engine gives in a notebook's own process."""
    item, known = library.load(CHAPTER)[id], {"np": np}
    if hasattr(item, "arguments"):
        exec(f"def {id}({', '.join(item.arguments)}):\n    return {expression}", known)
        outcome = item.judge(known[id], np.random.default_rng(0))
    else:
        outcome = item.judge(eval(expression))
    status = {"correct": "correct", "not yet": "wrong", "your code raised": "raised", "to do": "unfinished"}[
        outcome.status
    ]
    return status, None if outcome.mistake is None else item.mistakes[outcome.mistake].id


def student(rng, verdicts):
    """(cells, {exercise: (status, mistake)}) of one student."""
    cells, truth = solved_cells(), {}
    for item in library.load(CHAPTER).items:
        if hasattr(item, "question"):
            continue
        truth[item.id] = ("correct", None)
        what = rng.random()
        if what < 0.3 and item.id in WRONG:
            expression = WRONG[item.id][min(int(rng.expovariate(0.7)), len(WRONG[item.id]) - 1)]
            is_function = hasattr(item, "arguments")
            code = (
                function_cell(item.id, expression)
                if is_function
                else f"{item.id} = {expression}\nex.{item.id}({item.id})"
            )
            truth[item.id] = verdicts[item.id, expression]
        elif what < 0.4:
            code = function_cell(item.id, "...") if hasattr(item, "arguments") else f"ex.{item.id}(...)"
            code = code.replace("return ...", "...")
            truth[item.id] = ("unfinished", None)
        elif what < 0.45 and item.id in ALONE:
            code, truth[item.id] = None, ("not reached", None)
        else:
            continue
        cells = replaced(cells, item.id, code)
    return cells, truth


def damages(text):
    """(name, bytes or None) of notebooks that are none any more, one sort each."""
    found = json.loads(text)
    big = {
        **found,
        "cells": [
            {**found["cells"][0], "outputs": [{"output_type": "stream", "name": "stdout", "text": "x" * (20 << 20)}]}
        ],
    }
    killer = {**found, "cells": [{**found["cells"][0], "source": "import os\nos._exit(0)"}, *found["cells"]]}
    return {
        "broken JSON": text[: len(text) // 2],
        "empty": "",
        "no notebook": json.dumps({"a": 1}),
        "a list": "[1, 2]",
        "binary": "\x00\x01\x02 PK",
        "no cells": json.dumps({"cells": []}),
        "cells are a word": json.dumps({"cells": "all of them"}),
        "sources are numbers": json.dumps({"cells": [{"cell_type": "code", "source": 7}]}),
        "no chapter": json.dumps({"cells": [{"cell_type": "code", "source": "print(1)"}]}),
        "deep": "[" * 100_000 + "]" * 100_000,
        "10000 cells": json.dumps({"cells": [{"cell_type": "code", "source": f"x = {k}"} for k in range(10_000)]}),
        "outputs of 20 MB": json.dumps(big),
        "a cell that ends the process": json.dumps(killer),
        "a zip file that is none": "PK but not really",
        "a PDF": "%PDF-1.4",
    }


def write(folder, students=12, damaged=3, seed=1):
    """Write a Moodle folder of so many students; returns {key: truth or the name of the damage}."""
    rng, truth, folder = random.Random(seed), {}, Path(folder)
    verdicts = {
        (id, code): verdict_in_a_notebook(id, code)
        for id, codes in WRONG.items()
        for code in codes
        if code not in ("1 / 0", "undefined_name")
    }
    verdicts |= {("relative", "1 / 0"): ("raised", None), ("gram_schmidt", "undefined_name"): ("raised", None)}
    whole = notebook_text(solved_cells())
    sorts = list(damages(whole).items())
    for k in range(students):
        key = str(1_000_000 + k)
        name = f"{rng.choice(GIVEN)} {rng.choice(FAMILY)}".replace("/", "")
        place = folder / f"{name}_{key}_assignsubmission_file_"
        place.mkdir(parents=True, exist_ok=True)
        if k < damaged:
            what, text = sorts[k % len(sorts)]
            ending = {"a zip file that is none": "zip", "a PDF": "pdf"}.get(what, "ipynb")
            (place / f"01_frames.{ending}").write_text(text, encoding="utf-8")
            truth[key] = what
            continue
        cells, truth[key] = student(rng, verdicts)
        text = notebook_text(cells)
        if k % 5 == 4:  # zipped once more by the student, under a name of his own
            with zipfile.ZipFile(place / "Abgabe.zip", "w") as archive:
                archive.writestr("mein Notebook ä.ipynb", text)
        else:
            (place / "01_frames.ipynb").write_text(text, encoding="utf-8")
    return truth


if __name__ == "__main__":
    place, *counts = sys.argv[1:]
    planted = write(place, *map(int, counts))
    (Path(place).with_suffix(".planted.json")).write_text(json.dumps(planted, indent=1), encoding="utf-8")
    print(f"{len(planted)} students in {place}")
