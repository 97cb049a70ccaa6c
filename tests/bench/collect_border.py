"""Solved notebooks and planted mistakes across the border: are all judged as in the notebook?

python tests/bench/collect_border.py solved [SEEDS] [NN ...]      every function and value of every chapter
python tests/bench/collect_border.py mistakes [NN ...]            every named mistake, handed in in turn
"""

import os
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from labkit.collect import judge, library, sandbox
from labkit.exercises import source
from labkit.exercises.engine import Exercise, Prediction
from labkit.verbs import build


def asked(chapter):
    return [item for item in chapter.items if not isinstance(item, Prediction)]


def solved(seeds, numbers):
    """Prints how many are correct in each chapter, each answer judged on so many seeds; returns (correct, all)."""
    total, judged, missed = [0, 0], judge.Session._judged, []
    judge.WHOLE = 3600.0

    def often(self, item, *rest):
        outcomes = []
        for self.seed[0] in range(seeds):
            outcomes.append(judged(self, item, *rest))
            if outcomes[-1].status != "correct":
                missed.append(f"{item.id}, seed {self.seed[0]}: {outcomes[-1].text[:150]}")
        return outcomes[-1]

    judge.Session._judged = often
    for name in [n for n in library.chapter_names() if not numbers or n[:2] in numbers]:
        chapter, begun = library.load(name), time.monotonic()
        cells = build.solved_notebook(source.find(name)).cells
        missed.clear()
        verdicts = judge.judge(chapter, [cell.source for cell in cells if cell.cell_type == "code"], 0, "solved")
        missed += [f"{item.id} was not handed in" for item in asked(chapter) if item.id not in verdicts.outcomes]
        count = seeds * len(asked(chapter))
        total = [total[0] + count - len(missed), total[1] + count]
        print(f"{name}: {count - len(missed)} of {count} correct, {time.monotonic() - begun:.1f} s", flush=True)
        print(*[f"  {trouble}\n" for trouble in (*missed, *verdicts.failed, *verdicts.stopped)], sep="", end="")
    return total


def mistakes(numbers):
    """Prints the mistakes that are not named across the border; returns (named, all)."""
    os.environ["LABKIT_SANDBOX"] = "none"
    sandbox.WORKER = ROOT / "tests" / "collect" / "planting.py"
    judge.HANDED, judge.WHOLE = 10**6, 3600.0
    total, outcomes = [0, 0], []
    judged = judge.Session._judged

    def noted(self, item, *rest):
        outcomes.append((item, judged(self, item, *rest)))
        return outcomes[-1][1]

    judge.Session._judged, judge.Session._judge_again = noted, lambda self: None
    for name in [n for n in library.chapter_names() if not numbers or n[:2] in numbers]:
        chapter = library.load(name)
        planted = [(item, k) for item in asked(chapter) for k in range(len(item.mistakes))]
        folder = f"labkit.chapters.ch{chapter.notebook}.exercises"
        head = f"from labkit.exercises import course\nfrom {folder} import CHAPTER\nex = course('{name}')"
        outcomes.clear()
        session = judge.Session(chapter, 3, "mistakes", judge.Plan())
        ended = session.run([head, *(cell(item, k) for item, k in planted)], time.monotonic() + judge.WHOLE)
        named = sum(
            found.mistake is not None and found.text == item.mistakes[k].text
            for (item, k), (_, found) in zip(planted, outcomes)
        )
        for (item, k), (_, found) in zip(planted, outcomes):
            if found.text != item.mistakes[k].text:
                print(f"  {item.id} {k}: {found.status}: {found.text[:150]}")
        total = [total[0] + named, total[1] + len(planted)]
        print(
            f"{name}: {named} of {len(planted)} mistakes named {ended}{session.verdicts.failed[:2] or ''}", flush=True
        )
    return total


def cell(item, k):
    variant = f"CHAPTER['{item.id}'].mistakes[{k}].variant"
    is_function = isinstance(item, Exercise)
    return f"ex.{item.id}({f'lambda *args, v={variant}: v(*args)' if is_function else f'{variant}()'})"


if __name__ == "__main__":
    what, *rest = sys.argv[1:] or ["nothing"]
    if what not in ("solved", "mistakes"):
        sys.exit(__doc__)
    if what == "solved":
        seeds, *rest = rest or ["20"]
        found = solved(int(seeds), rest)
    else:
        found = mistakes(rest)
    print(f"{found[0]} of {found[1]}")
