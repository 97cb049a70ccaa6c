"""A class of three hundred with fifteen damaged submissions: time, memory, size of the page, and is it as planted?

    python tests/bench/collect_class.py FOLDER [STUDENTS] [DAMAGED] [JOBS]

FOLDER must not exist yet. The time of other work on the machine counts: beside it stands the processor time.
"""

import csv
import json
import os
import resource
import subprocess
import sys
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "collect")]

from classroom import write

from labkit.collect import submissions


def memory(pid):
    """Bytes of a process and all beneath it, shared pages shared out (Linux)."""
    total, waiting = 0, [pid]
    while waiting:
        pid = waiting.pop()
        try:
            words = Path(f"/proc/{pid}/smaps_rollup").read_text().split()
            total += int(words[words.index("Pss:") + 1]) * 1024
            for task in Path(f"/proc/{pid}/task").iterdir():
                waiting += map(int, (task / "children").read_text().split())
        except (OSError, ValueError):
            continue
    return total


def watched(words):
    """(seconds, seconds of processor time, most bytes) of a command."""
    begun, most = time.monotonic(), [0]
    process = subprocess.Popen(words, cwd=ROOT, env={**os.environ, "OMP_NUM_THREADS": "1"})
    done = threading.Event()

    def watch():
        while not done.wait(1.0):
            most[0] = max(most[0], memory(process.pid))

    threading.Thread(target=watch, daemon=True).start()
    assert process.wait() == 0
    done.set()
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.monotonic() - begun, used.ru_utime + used.ru_stime, most[0]


def main(folder, students=300, damaged=15, jobs=2):
    folder = Path(folder)
    planted = write(folder / "class", int(students), int(damaged))
    out = folder / "out"
    words = [sys.executable, "-m", "labkit", "collect", str(folder / "class"), "--out", str(out), "--seed", "5"]
    wall, cpu, most = watched([*words, "--jobs", str(jobs), "--names", "folders"])
    print(f"{students} students: {wall:.0f} s, {cpu:.0f} s of processor time, {most / 2**20:.0f} MB at most")
    print(f"class.html: {(out / 'class.html').stat().st_size / 2**20:.2f} MB")
    with open(out / "report.csv", newline="", encoding="utf-8") as file:
        rows = {row["Identifier"] for row in csv.DictReader(file)}
    print(f"missing from the report: {sorted(set(planted) - rows)}")
    wrong = 0
    for student in submissions.students([folder / "class"], []):
        truth = planted[student.key]
        if not isinstance(truth, str):
            digest = submissions.digest(student.files[0].read())
            path = out / "judged" / f"{digest[:20]}.json"
            result = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {"items": {}}
            found = {id: (v["status"], v.get("mistake")) for id, v in result["items"].items() if id in truth}
            wrong += found != truth
            if found != truth:
                print(
                    f"  {student.key}: {[(id, found.get(id), truth[id]) for id in truth if found.get(id) != truth[id]]}"
                )
    print(f"{wrong} of {len(planted) - int(damaged)} students judged otherwise than planted")


if __name__ == "__main__":
    main(*sys.argv[1:])
