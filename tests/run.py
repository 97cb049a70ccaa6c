"""Every test of the workbook, as `python lab.py test` runs it; named arguments go to one pytest instead.

    python lab.py test                            everything
    python lab.py test tests/stage -k play        what is named
    python lab.py test --last-bits 1              unit tests and solved notebooks, the last bits of what linear algebra
                                                  returns stirred (`last_bits.py`); also before names

Unit tests, solved notebooks (strict) and blank notebooks (lax) are dealt out to a few pytest processes, one more at a
time than there are processors, since browsers, kernels and judges of a class wait for each other. The last line is the
sum, "N passed, N failed"; the exit code is 1 if anything failed.

In continuous integration (CI=true) half of the jobs of unit tests runs with stirred last bits.
A blank notebook that a student has worked in is judged by no test: a fresh one from the source is run in its place.
"""

import contextlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from labkit.exercises import source
from labkit.verbs import build

ROOT = source.ROOT
SECONDS_A_JOB = 900
UNITS = 4  # jobs of unit tests beside the longest: each costs three seconds before its first test
LONGEST = ROOT / "tests" / "chapters" / "test_exercises.py"  # a job of its own, begun among the first
APART = ("browser", "hub", "collect")  # folders of tests that are jobs of their own: they wait for other processes
FIRST = "browser"  # the longest: it has a processor whenever it wants one
WAITING = "hub"  # which waits for registries and servers most of its time: it takes no other job's place
BARE = ("-pno:hypothesispytest",)  # notebooks need none, and its import costs as much as a small kernel
YIELDING = ("nice", "-n", "10") if shutil.which("nice") else ()
COUNTED = ("passed", "failed", "error", "skipped", "xfailed")


def main(arguments):
    """Run the jobs; returns the exit code."""
    begun = time.monotonic()
    try:
        seed, named = split(list(arguments))
    except ValueError as reason:
        print(reason, file=sys.stderr)
        return 1
    with tempfile.TemporaryDirectory(dir=scratch_folder()) as scratch:
        jobs = {"named": named} if named else all_jobs(Path(scratch))
        seeds = stirred_jobs(jobs, seed)
        jobs = {name: words for name, words in jobs.items() if seed is None or name in seeds}
        total = dict.fromkeys(COUNTED, 0)
        places = 1 + max(2, os.cpu_count() or 2) if len(jobs) > 1 else 1
        with ThreadPoolExecutor(places) as pool, ThreadPoolExecutor(1) as beside:
            running = {
                (beside if name == WAITING else pool).submit(run, words, seeds.get(name), name != FIRST): name
                for name, words in jobs.items()
            }
            for job in as_completed(running):
                counts, output, seconds = job.result()
                report(running[job], counts, output, seconds)
                total = {word: total[word] + counts[word] for word in COUNTED}
    failed = total["failed"] + total["error"]
    print(f"{total['skipped']} skipped, {time.monotonic() - begun:.0f} s in all")
    print(f"{total['passed']} passed, {failed} failed")
    return 1 if failed else 0


def split(arguments):
    """(seed of the stirred last bits or None, what pytest is told)."""
    if arguments[:1] != ["--last-bits"]:
        return None, arguments
    if not arguments[1:] or not arguments[1].isdecimal():
        raise ValueError("--last-bits needs a seed, a whole number. For example: python lab.py test --last-bits 1")
    return int(arguments[1]), arguments[2:]


def stirred_jobs(names, seed):
    """{name: seed} of the jobs that run with stirred last bits."""
    if seed is not None:
        return {name: seed for name in names if name.startswith(("named", "unit", "collect", "solved"))}
    even = [name for name in names if name.startswith("unit tests") and int(name.split()[-1]) % 2 == 0]
    return dict.fromkeys(even, 1) if os.environ.get("CI") == "true" else {}


def scratch_folder():
    """A folder git ignores, inside the checkout: there pytest finds the settings of the checkout."""
    folder = ROOT / "build"
    folder.mkdir(exist_ok=True)
    return folder


def all_jobs(scratch):
    """{name: arguments of pytest}, the longest first."""
    tests = (path for path in (ROOT / "tests").glob("**/test_*.py") if path.parent.name not in APART)
    units = sorted(str(path) for path in tests if path != LONGEST)
    solved = sorted(str(path) for path in (ROOT / "solutions").glob("[0-9][0-9]_*.ipynb"))
    jobs = {
        **{name: [str(ROOT / "tests" / name)] for name in APART},
        "unit tests 0": [str(LONGEST)],
        **{f"unit tests {k}": units[k - 1 :: UNITS] for k in range(1, UNITS + 1)},
        "solved notebooks 1": ["--nbval", *BARE, *solved[0::2]],
        "solved notebooks 2": ["--nbval", *BARE, *solved[1::2]],
    }
    blank = [str(path) for path in blank_notebooks(scratch)]
    jobs["blank notebooks 1"] = ["--nbval-lax", *BARE, "-ptests.memory_of_kernels", *blank[0::2]]
    jobs["blank notebooks 2"] = ["--nbval-lax", *BARE, "-ptests.memory_of_kernels", *blank[1::2]]
    return {name: words for name, words in jobs.items() if any(not word.startswith("-") for word in words)}


def blank_notebooks(scratch):
    """The blank notebook of every chapter: that in `notebooks/` where it is fresh, else a fresh one in `scratch`."""
    for path in source.sources():
        notebook = ROOT / "notebooks" / f"{path.stem}.ipynb"
        fresh = build.as_text(build.blank_notebook(path))
        if not notebook.exists() or notebook.read_text(encoding="utf-8") != fresh:
            notebook = scratch / notebook.name
            notebook.write_text(fresh, encoding="utf-8", newline="\n")
        yield notebook


def run(words, seed=None, yields=False):
    """(counts, output, seconds) of one pytest process; with a seed its last bits are stirred, and its kernels'.

    One that yields lets others go first.
    """
    begun = time.monotonic()
    environment = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", **os.environ}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # some fifty processes would compile the same packages, each anew
    if seed is not None:
        paths = filter(None, [environment.get("PYTHONPATH"), str(ROOT / "tests")])
        environment |= {"LAST_BITS": str(seed), "PYTHONPATH": os.pathsep.join(paths)}
        words = ["-p", "last_bits", *words]
    with contextlib.suppress(subprocess.TimeoutExpired):
        process = subprocess.run(
            [
                *(YIELDING if yields else ()),
                sys.executable,
                "-m",
                "pytest",
                "-rs",
                "--durations=5",
                "--durations-min=5",
                *words,
            ],
            cwd=ROOT,
            env=environment,
            timeout=SECONDS_A_JOB,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            errors="replace",
        )
        return counts_of(process.stdout, process.returncode), process.stdout, time.monotonic() - begun
    return counts_of("", 1), f"stopped after {SECONDS_A_JOB} s", SECONDS_A_JOB


def counts_of(output, returncode):
    """How many tests passed, failed and so on, from pytest's last lines; a crash counts as one error."""
    lines = [line for line in output.splitlines() if re.search(r"\d+ \w+.* in [\d.]+s", line)]
    found = re.findall(r"(\d+) (passed|failed|error|skipped|xfailed)", lines[-1]) if lines else []
    counts = {**dict.fromkeys(COUNTED, 0), **{word: int(number) for number, word in found}}
    if returncode not in (0, 5) and not counts["failed"] + counts["error"]:
        counts["error"] = 1
    return counts


def report(name, counts, output, seconds):
    """One line a job; all pytest said where something failed, and the reasons of what was skipped."""
    words = ", ".join(f"{number} {word}" for word, number in counts.items() if number) or "nothing to run"
    print(f"{name}: {words} ({seconds:.0f} s)", flush=True)
    shown = output.splitlines() if counts["failed"] + counts["error"] else re.findall(r"^SKIPPED .*$", output, re.M)
    print("".join(f"  {line}\n" for line in shown), end="", flush=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
