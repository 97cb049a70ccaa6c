"""Single changes of the solved functions, typed into their checks: which of them does a check let pass?

    python tests/bench/mutants.py [NN ...] [--most 1] [--only EXERCISE]

Each function of a solution is changed in one place after the other (`labkit.exercises.mutation`) and judged. A change
that passes has survived: it computes the same, which `mutants.csv` beside this file gives the reason for, or the check
has a hole. One row an exercise, as it is done; Ctrl-C prints the table of what has been done so far. `--most` is how
unlikely the changes may be, 0 to 4.
"""

import argparse
import ast
import collections
import csv
import os
import warnings
from pathlib import Path

import numpy as np

from labkit.exercises import mutation, session, slips
from labkit.exercises.engine import Exercise
from labkit.exercises.outcome import CORRECT, NOT_YET
from labkit.exercises.trial import Trial

REASONS = Path(__file__).with_name("mutants.csv")
LIMIT = 2.0  # seconds a call of a changed function may take


def reasons():
    """{(exercise, changed line): why the change is none, or does no harm}."""
    with REASONS.open(encoding="utf-8", newline="") as file:
        return {(row["exercise"], row["change"]): row["reason"] for row in csv.DictReader(file)}


def quick_verdict(trial):
    """Right or not, without a word: what a wrong answer is told takes a hundred times as long."""
    right = all(m is None or m.equal(r, e) for m, (r, e) in zip(trial.metrics, trial.pairs)) and not trial.refusal
    named = right and trial.exercise.metric is None and trial._named_mistake()
    return trial.outcome(CORRECT if right and not named else NOT_YET)


def difference(function, changed):
    """The lines in which two functions differ, as "before -> after"."""
    before, after = (ast.unparse(tree).splitlines()[1:] for tree in (function, changed))
    gone = [line.strip() for line in before if line not in after]
    come = [line.strip() for line in after if line not in before]
    return f"{'; '.join(gone)} -> {'; '.join(come)}"


def survivors(item, most):
    """Number of changes tried, and the differences of those that pass."""
    function, known = slips._solution(item)
    seen, found, original = set(), [], ast.unparse(function)
    for change in mutation.changes(function, most):
        tree = change.tree(function)
        text = ast.unparse(tree)
        if text in seen or text == original:
            continue
        seen.add(text)
        namespace = dict(known)
        try:
            exec(compile(ast.Module([tree], []), "<changed>", "exec"), namespace)
        except (SyntaxError, ValueError):
            continue
        with np.errstate(all="ignore"):
            outcome = item.judge(namespace[function.name], rng=np.random.default_rng(len(seen)))
        if outcome.status == CORRECT:
            found.append(difference(function, tree))
    return len(seen), found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("chapters", nargs="*")
    parser.add_argument("--most", type=int, default=1)
    parser.add_argument("--only")
    wanted = parser.parse_args()
    warnings.simplefilter("ignore")
    os.environ.setdefault("LABKIT_PROGRESS", os.devnull)
    Trial.verdict = quick_verdict
    known, table, open_ = reasons(), collections.defaultdict(lambda: np.zeros(3, dtype=int)), []
    try:
        for chapter in session.chapters():
            if wanted.chapters and chapter.name[:2] not in wanted.chapters:
                continue
            for item in chapter.items:
                if not isinstance(item, Exercise) or wanted.only not in (None, item.id):
                    continue
                object.__setattr__(item, "limit", min(item.limit, LIMIT))
                tried, found = survivors(item, wanted.most)
                unknown = [change for change in found if (item.id, change) not in known]
                table[chapter.name] += (tried, len(found), len(unknown))
                print(f"{chapter.name}/{item.id}: {tried} tried, {tried - len(found)} caught, {len(found)} survived, "
                      f"{len(unknown)} without a reason", flush=True)  # fmt: skip
                for change in unknown:
                    open_.append((item.id, change))
                    print(f"    {change}", flush=True)
    except KeyboardInterrupt:
        print("stopped")
    print("\nchapter               tried  caught  survived  without a reason")
    for name, (tried, passed, unknown) in table.items():
        print(f"{name:20} {tried:6} {tried - passed:7} {passed:9} {unknown:17}")
    raise SystemExit(bool(open_))


if __name__ == "__main__":
    main()
