"""Answers typed into the cells of the blank notebooks, as a student would: which are taken, and what is said of them.

    python tests/bench/typed_answers.py FOLDER [NN ...] [--seeds 0 1] [--only 05/01 ...] [--jobs 2]

FOLDER holds one chNN.txt a chapter, written by people who saw the blank notebooks alone. Each answer begins with a line

    #%% 05/01 | wrong | robust_weights | what is wrong with it (or "right", and the way it goes)

behind which the whole code of the exercise's cell follows. The notebook runs up to that cell, and the answer runs in
its place, in a process of its own; once for each seed of the draws. What was said is written to
FOLDER/verdicts/chNN.txt, with --only of these alone; printed are the wrong answers that were taken and the right ones
that were refused, and a table. Whether the texts are true, somebody has to read.
"""

import argparse
import json
import multiprocessing
import os
import re
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np
from IPython.core.interactiveshell import InteractiveShell

from labkit.exercises import feedback, session
from labkit.exercises.outcome import CORRECT
from labkit.places import ROOT

HEAD = re.compile(r"^#%%\s*(\d\d)/(\d+)\s*\|\s*(wrong|right)\s*\|\s*`?(\w+)`?\s*\|\s*(.*)$", re.M)
SECONDS = 180  # that an answer's process may take
NO_VERDICT = "no verdict"


class Typed(NamedTuple):
    """One answer: its number, what its writer holds it for, of which exercise, why, and its cell."""

    number: str
    label: str
    exercise: str
    why: str
    code: str


def read(path):
    """The answers of one file."""
    text = path.read_text(encoding="utf-8")
    heads = list(HEAD.finditer(text))
    ends = [head.start() for head in heads[1:]] + [len(text)]
    return [
        Typed(f"{chapter}/{int(number):02d}", label, exercise, why.strip(), text[head.end() : end].strip("\n") + "\n")
        for head, end in zip(heads, ends)
        for chapter, number, label, exercise, why in [head.groups()]
    ]


def cells(number):
    """The code cells of a chapter's blank notebook."""
    [path] = (ROOT / "notebooks").glob(f"{number}_*.ipynb")
    found = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return ["".join(cell["source"]) for cell in found if cell["cell_type"] == "code"]


def asked(cell, exercises):
    """The exercise whose cell this is, or None."""
    return next((id for id in exercises if re.search(rf"(^@|= )ex\.{id}\b", cell, re.M)), None)


class Check:
    """What a check draws from and shows, in place of the notebook; set before the first cell remembers the library."""

    seed, shown = None, []

    @classmethod
    def watch(cls):
        session.Bound._generator = lambda bound: np.random.default_rng(cls.seed)
        feedback.show = cls.shown.append


def judge(shell, cell, answer, seed, pipe):
    """Type an answer into the running notebook and send (status, text); in a process that ends with it.

    What the cell gives before a value that is asked for runs before.
    """
    given, blank, _ = cell.partition(f"{answer.exercise} = ...")
    if blank:
        shell.run_cell(given)
    Check.seed = seed
    Check.shown.clear()
    result = shell.run_cell(answer.code)
    panels = [thing for thing in Check.shown if isinstance(thing, feedback.Panel) and thing.status]
    error = result.error_before_exec or result.error_in_exec
    if panels:
        pipe.send((panels[-1].status, "\n".join(map(repr, panels))))
    else:
        pipe.send((NO_VERDICT, repr(error) if error else "the cell checks nothing"))


def in_a_copy(shell, cell, answer, seed):
    """What `judge` sends from a copy of this process; one that hangs is ended."""
    copies = multiprocessing.get_context("fork")
    here, there = copies.Pipe(duplex=False)
    copy = copies.Process(target=judge, args=(shell, cell, answer, seed, there))
    copy.start()
    there.close()
    try:
        return here.recv() if here.poll(SECONDS) else (NO_VERDICT, f"nothing came back within {SECONDS} s")
    except EOFError:
        return NO_VERDICT, "the process ended"
    finally:
        copy.kill()
        copy.join()


def chapter(folder, number, seeds, only):
    """Judge one chapter's answers; writes the verdicts and returns [(answer, [(status, text) of each seed])]."""
    answers = [a for a in read(folder / f"ch{number}.txt") if not only or a.number in only]
    os.environ["MPLBACKEND"] = "Agg"
    shell = InteractiveShell.instance()
    Check.watch()
    exercises = {a.exercise for a in answers}
    told = {}
    with tempfile.TemporaryDirectory() as scratch, open(os.devnull, "w") as nowhere:
        os.environ["LABKIT_PROGRESS"] = str(Path(scratch) / "progress.jsonl")
        sys.stdout = sys.stderr = nowhere
        for cell in cells(number):
            here = asked(cell, exercises)
            for answer in answers if here else ():
                if answer.exercise == here:
                    told[answer.number] = [in_a_copy(shell, cell, answer, seed) for seed in seeds]
            shell.run_cell(cell)
        sys.stdout, sys.stderr = sys.__stdout__, sys.__stderr__
    missing = (NO_VERDICT, "the notebook has no cell for it")
    rows = [(answer, told.get(answer.number, [missing])) for answer in answers]
    (folder / "verdicts").mkdir(exist_ok=True)
    (folder / "verdicts" / f"ch{number}.txt").write_text("\n".join(map(block, rows)), encoding="utf-8")
    return rows


def block(row):
    """One answer and what was said of it."""
    answer, told = row
    said = []
    for status, text in told:
        if (status, text) not in said:
            said.append((status, text))
    words = "\n".join(f"--- {status}\n{text}" for status, text in said)
    flag = " | ".join(f"!!! {fault}" for fault in faults(row))
    head = f"#%% {answer.number} | {answer.label} | {answer.exercise} | {answer.why}"
    return f"{'=' * 100}\n{head}\n{flag}\n{answer.code}\n{words}\n"


def faults(row):
    """What is wrong with the statuses: a wrong answer taken, a right one refused, by any seed."""
    answer, told = row
    taken = [status == CORRECT for status, _ in told]
    if any(status == NO_VERDICT for status, _ in told):
        return ["NO VERDICT"]
    if answer.label == "wrong":
        return ["ACCEPTED"] if any(taken) else []
    return [] if all(taken) else ["REFUSED"]


def in_a_process(folder, number, seeds, only):
    """`chapter`, in a process of its own: a shell and its modules are used once."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        return pool.submit(chapter, folder, number, seeds, only).result()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("chapters", nargs="*")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1])
    parser.add_argument("--only", nargs="+", default=[])
    parser.add_argument("--jobs", type=int, default=2)
    wanted = parser.parse_args()
    all_chapters = sorted(path.stem[2:] for path in wanted.folder.glob("ch[0-9][0-9].txt"))
    numbers = wanted.chapters or sorted({answer[:2] for answer in wanted.only}) or all_chapters
    if not numbers:
        sys.exit(f"{wanted.folder} holds no file chNN.txt")
    print("chapter  wrong  accepted  right  refused  no verdict")
    total = np.zeros(5, dtype=int)
    with ThreadPoolExecutor(wanted.jobs) as pool:
        work = {n: pool.submit(in_a_process, wanted.folder, n, wanted.seeds, wanted.only) for n in numbers}
        for number, job in work.items():
            rows = job.result()
            labels, found = [answer.label for answer, _ in rows], [fault for row in rows for fault in faults(row)]
            counts = [labels.count("wrong"), found.count("ACCEPTED"), labels.count("right"), found.count("REFUSED")]
            counts.append(found.count("NO VERDICT"))
            total += counts
            print(number, *counts, sep="\t", flush=True)
            for row in rows:
                for fault in faults(row):
                    print(f"    {fault}: {row[0].number} {row[0].exercise}: {row[0].why}", flush=True)
    print("all", *total, sep="\t")


if __name__ == "__main__":
    main()
