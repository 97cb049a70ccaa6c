"""The attacks that make the judge wait, too slow for the suite: each alone in a solved notebook, with the real limits.

python tests/bench/collect_attacks.py [NAME ...]        default: endless, lucky draws, forged message

Prints, with bubblewrap and without, what became of `invert`, of the other exercises, and how long it took; exits 1 when
an attack is judged correct, costs another exercise, or leaves a file.
"""

import os
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "collect")]

import attacks
from classroom import solved_cells

from labkit.collect import judge, library, sandbox

SLOW = ("endless", "lucky draws", "forged message")
CHAPTER = "01-frames"


def attacked(name, folder):
    """(status of invert, exercises that suffered, files left, seconds) of one attack before a wrong answer."""
    cells = solved_cells()
    k = next(k for k, (_, text) in enumerate(cells) if "ex.invert" in text)
    own = attacks.code(name, secret=folder / "secret", port=9, root=ROOT)
    texts = [text for _, text in cells]
    texts[k : k + 1] = [own, "invert = ex.invert(lambda T: 2 * T)"]
    begun = time.monotonic()
    verdicts = judge.judge(library.load(CHAPTER), texts, 3, "attacks")
    others = {id for id, outcome in verdicts.outcomes.items() if outcome.status != "correct"} - {"invert"}
    status = verdicts.outcomes["invert"].status if "invert" in verdicts.outcomes else "not reached"
    return status, others, sorted(path.name for path in folder.iterdir()), time.monotonic() - begun


def main(names):
    bad = 0
    for boxed in ("bubblewrap", "none"):
        os.environ["LABKIT_SANDBOX"] = boxed
        sandbox.bubblewrap.cache_clear()
        if boxed == "bubblewrap" and sandbox.bubblewrap()[0] is None:
            print("bubblewrap: none runs here")
            continue
        for name in names or SLOW:
            with tempfile.TemporaryDirectory() as folder:
                status, others, left, seconds = attacked(name, Path(folder))
            bad += status == "correct" or bool(others or left)
            words = f"invert {status!r}, others spoilt {sorted(others) or 'none'}, files left {left or 'none'}"
            print(f"{boxed:10} {name:16} {words}, {seconds:.0f} s", flush=True)
    return bool(bad)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
