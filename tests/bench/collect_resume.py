"""`collect` interrupted by Ctrl-C and called again goes on where it was, and ends with the same bytes.

python tests/bench/collect_resume.py [STUDENTS]         default: 6
"""

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "collect")]

from classroom import write


def collect(folder, out):
    words = [sys.executable, "-m", "labkit", "collect", str(folder), "--out", str(out), "--seed", "5", "--jobs", "1"]
    return subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                            env={**os.environ, "PYTHONPATH": str(ROOT)}, start_new_session=True)  # fmt: skip


def contents(out):
    return {str(p.relative_to(out)): p.read_bytes() for p in sorted(out.rglob("*")) if p.is_file()}


def main(students):
    with tempfile.TemporaryDirectory() as place:
        place = Path(place)
        write(place / "class", students, 3)
        whole, broken = place / "whole", place / "broken"
        began = time.monotonic()
        collect(place / "class", whole).communicate()
        first = time.monotonic() - began
        process = collect(place / "class", broken)
        while len(list((broken / "judged").glob("*.json"))) < 2 and process.poll() is None:
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal sends it, to all of them
        said, _ = process.communicate(timeout=60)
        kept = {p.name: p.stat().st_mtime_ns for p in (broken / "judged").glob("*.json")}
        print(f"interrupted: exit code {process.returncode}, {len(kept)} judged, said {said.strip()[-2500:]}")
        began = time.monotonic()
        collect(place / "class", broken).communicate()
        again = time.monotonic() - began
        untouched = all((broken / "judged" / name).stat().st_mtime_ns == when for name, when in kept.items())
        same = contents(whole) == contents(broken)
        print(f"whole {first:.1f} s, the rest {again:.1f} s; judged before untouched: {untouched}; same bytes: {same}")
        return not (untouched and same and 0 < len(kept) < students and "Traceback" not in said)


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 6))
