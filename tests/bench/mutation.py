"""Whether the tests notice: one operator, sign, factor or comparison of the mathematics changed at a time.

    python tests/bench/mutation.py [ROOM ...] [--count 100] [--seed 1] [--jobs 2] [--module NAME]

Rooms: geometry estimation calibration machines localization fast (all by default). Works in a copy of the repository
in the system's temporary folder, runs the tests that belong to the changed module, and stops each run at six times what
it takes unchanged. Prints every change with its line, killed or survived, and the share at the end. Whether a survivor
changes any result at all (a tolerance, a starting value) is for the reader to judge. No part of the test run: a hundred
changes take half an hour on two cores.
"""

import argparse
import ast
import os
import queue
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("geometry", "estimation", "calibration", "machines", "localization", "fast")
COPIED = ("labkit", "tests", "data", "solutions", "pyproject.toml", "conftest.py", "README.md")
OPERATORS = {ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*")}
OPPOSITE = {"<": ">=", ">": "<=", "<=": ">", ">=": "<", "==": "!=", "!=": "=="}
TWINS = (
    ("sin", "cos"),
    ("minimum", "maximum"),
    ("min", "max"),
    ("argmin", "argmax"),
    ("any", "all"),
    ("exp_so3", "log_so3"),
)
SWAPS = {a: b for pair in TWINS for a, b in (pair, pair[::-1])}


@dataclass(frozen=True)
class Change:
    """Characters start to end of a module's text become `new`."""

    path: Path
    text: str
    line: int
    start: int
    end: int
    new: str


def changes(path):
    """All changes of one module, in the order of its text; refusals and docstrings are left alone."""
    text = path.read_text(encoding="utf-8")
    offsets = [0]
    for line in text.encode().splitlines(keepends=True):
        offsets.append(offsets[-1] + len(line))
    raw = text.encode()

    def at(line, column):
        return len(raw[: offsets[line - 1] + column].decode())

    for node, parent in _walk(ast.parse(text)):
        for start, end, new in _of_node(node, parent, text, at):
            yield Change(path, text, node.lineno, start, end, new)


def _walk(node, parent=None):
    """(node, parent) of everything that computes: no refusals, decorators, defaults or indices."""
    if isinstance(node, (ast.Raise, ast.JoinedStr, ast.Slice, ast.arguments)):
        return
    if hasattr(node, "lineno"):
        yield node, parent
    for field, value in ast.iter_fields(node):
        if field in ("decorator_list", "annotation", "returns") or (
            isinstance(node, ast.Subscript) and field == "slice"
        ):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield from _walk(child, node)


def _of_node(node, parent, text, at):
    """(start, end, new text) of what can be changed at a node."""
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        old, new = OPERATORS[type(node.op)]
        here = _operator(text, old, node.left, node.right, at)
        if here is not None and not isinstance(node.left, (ast.List, ast.Tuple)):
            yield here, here + 1, new
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub) and not isinstance(parent, ast.keyword):
        start = at(node.lineno, node.col_offset)
        if not (
            isinstance(parent, ast.Call) and getattr(parent.func, "attr", "") in ("swapaxes", "reshape", "moveaxis")
        ):
            yield start, start + 1, " "
    elif isinstance(node, ast.Compare) and len(node.ops) == 1:
        between = slice(at(node.left.end_lineno, node.left.end_col_offset), None)
        sign = re.match(r"[\s)]*(<=|>=|==|!=|<|>)", text[between])
        if sign:
            yield between.start + sign.start(1), between.start + sign.end(1), OPPOSITE[sign[1]]
    elif isinstance(node, ast.Constant) and isinstance(parent, ast.BinOp) and type(node.value) in (int, float):
        if 1e-3 <= abs(node.value) <= 1e4 and not isinstance(parent.op, ast.MatMult):
            new = repr(node.value + 1) if type(node.value) is int else repr(1.5 * node.value)
            yield at(node.lineno, node.col_offset), at(node.end_lineno, node.end_col_offset), new
    elif isinstance(node, (ast.Attribute, ast.Name)) and isinstance(parent, ast.Call) and parent.func is node:
        name = node.attr if isinstance(node, ast.Attribute) else node.id
        if name in SWAPS:
            end = at(node.end_lineno, node.end_col_offset)
            yield end - len(name), end, SWAPS[name]


def _operator(text, sign, left, right, at):
    """Where the sign of a sum or product stands between its two sides."""
    start, end = at(left.end_lineno, left.end_col_offset), at(right.lineno, right.col_offset)
    found = re.search(re.escape(sign), text[start:end])
    return None if found is None else start + found.start()


ELSEWHERE = {  # modules whose tests stand in files of another name
    "geometry/planar": ("localization/test_odometry.py",),
    "estimation/differences": ("estimation/test_optimization.py",),
    "estimation/gaussian": ("localization/test_odometry.py", "estimation/test_kalman.py"),
    "calibration/literature": ("calibration/test_hand_eye.py",),
    "machines/packet": ("machines/test_tracker.py", "machines/test_udp.py"),
    "machines/log": ("machines/test_tracker.py",),
    "machines/mounting": ("machines/test_tracker.py",),
    "machines/accuracy": ("machines/test_tracker.py",),
    "machines/simulation": ("machines/test_tracker.py",),
    "localization/ekf": ("estimation/test_kalman.py",),
    "fast/ekf": ("estimation/test_kalman.py",),
    "fast/kalman": ("estimation/test_kalman.py",),
}


def tests_of(path):
    """The test files of a module: its own name in the same room, or those of ELSEWHERE, whichever exist."""
    name = path.relative_to(ROOT / "labkit").with_suffix("").as_posix()
    room, _, module = name.partition("/")
    own = f"{room}/test_{module}.py"
    files = [own, *ELSEWHERE.get(name, ())]
    return tuple(f"tests/{file}" for file in files if (ROOT / "tests" / file).exists())


def run(folder, tests, limit):
    """ "killed", "survived" or "too long", and the seconds, of a run of test files in a copy of the repository."""
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1", "OMP_NUM_THREADS": "1", "PYTHONPATH": str(folder)}
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    start = time.perf_counter()
    try:
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, timeout=limit)
    except subprocess.TimeoutExpired:
        return "too long", limit
    return "survived" if done.returncode == 0 else "killed", time.perf_counter() - start


def try_change(change, folder, limit):
    """The outcome of one change in a copy, which is as before afterwards."""
    target = folder / change.path.relative_to(ROOT)
    text = change.text
    target.write_text(text[: change.start] + change.new + text[change.end :], encoding="utf-8")
    try:
        return run(folder, tests_of(change.path), limit)[0]
    finally:
        target.write_text(text, encoding="utf-8")


def described(change):
    """Module, line and the changed line itself, old => new."""
    text = change.text
    left, right = text.rfind("\n", 0, change.start) + 1, text.find("\n", change.end)
    new = text[left : change.start] + "[" + change.new + "]" + text[change.end : right]
    where = f"{change.path.relative_to(ROOT / 'labkit')}:{change.line}"
    return f"{where}  {text[left:right].strip()}  =>  {new.strip()}"


def main(rooms, count, seed, jobs, module):
    modules = [p for room in rooms for p in sorted((ROOT / "labkit" / room).glob("*.py")) if tests_of(p)]
    modules = [p for p in modules if not module or p.stem == module]
    sites = [change for path in modules for change in changes(path)]
    drawn = random.Random(seed).sample(sites, min(count, len(sites)))
    print(f"{len(sites)} places in {len(modules)} modules; {len(drawn)} changes, seed {seed}", flush=True)
    with tempfile.TemporaryDirectory() as scratch:
        folders = queue.Queue()
        for job in range(jobs):
            folder = Path(scratch) / str(job)
            for name in COPIED:
                copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
                folder.mkdir(exist_ok=True)
                copy(ROOT / name, folder / name, **({"ignore": SKIPPED} if copy is shutil.copytree else {}))
            folders.put(folder)
        unchanged = {}
        for tests in {tests_of(change.path) for change in drawn}:
            outcome, unchanged[tests] = run(folder, tests, 600)
            if outcome != "survived":
                raise SystemExit(f"{' '.join(tests)}: red without any change")

        def one(change):
            folder = folders.get()
            outcome = try_change(change, folder, 20 + 6 * unchanged[tests_of(change.path)])
            folders.put(folder)
            print(f"{outcome:9} {described(change)}", flush=True)
            return outcome

        with ThreadPoolExecutor(jobs) as pool:
            outcomes = list(pool.map(one, drawn))
    survived = outcomes.count("survived")
    print(f"\n{len(outcomes) - survived} of {len(outcomes)} caught, {survived} survived")


SKIPPED = shutil.ignore_patterns("__pycache__", "*.ipynb", "browser", "bench")

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rooms", nargs="*", default=ROOMS, choices=ROOMS)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--module", default="")
    given = parser.parse_args()
    main(given.rooms or ROOMS, given.count, given.seed, given.jobs, given.module)
