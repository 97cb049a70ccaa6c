"""Whether the tests notice: one operator, sign, constant or comparison of the mathematics changed at a time.

    python tests/bench/mutation.py [ROOM ...] [--count 100] [--seed 1] [--jobs 2] [--module NAME]

Rooms: geometry estimation calibration machines localization fast (all by default). No file is touched: a process that
has imported NumPy, SciPy and pytest, but nothing of labkit, forks once a change; the child compiles the changed text in
place of the module and runs the module's own test files, its fast twin's among them, up to the first failure: at first
the tests that enter the changed function, the quickest before the others; what survives these goes through the whole
files. A child may use ten times the processor time of the unchanged run, then the change counts as caught. Left alone
are docstrings, refusals (`raise`), texts, annotations, defaults, indices and numbers below 0.001, which are tolerances.
Prints every survivor with its line and the share at the end. Whether a survivor changes any result at all (a
starting value, a bound on rounding) is for the reader to judge. No part of the test run: a hundred changes take some
five minutes on two cores.
"""

import argparse
import ast
import json
import os
import random
import re
import resource
import signal
import sys
import tempfile
import time
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.machinery import SourceFileLoader
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("geometry", "estimation", "calibration", "machines", "localization", "fast")
IMPORTED = ("numpy", "scipy.linalg", "scipy.optimize", "scipy.spatial", "scipy.ndimage", "scipy.stats", "hypothesis")
# pytest's exit codes; interrupted: a module cannot be imported; unknown: a test's name holds the changed number
PASSED, FAILED, INTERRUPTED, UNKNOWN = 0, 1, 2, 4
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
            new = repr(node.value + 1) if type(node.value) is int else repr(2.0 * node.value)
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
    "estimation/gaussian": ("localization/test_odometry.py", "estimation/test_kalman.py"),
    "calibration/advice": ("calibration/test_calibrate.py", "verbs/test_calibrate_command.py"),
    "calibration/literature": ("calibration/test_hand_eye.py",),
    "calibration/motion": ("calibration/test_ax_xb.py", "calibration/test_calibrate.py"),
    "calibration/own_data": ("verbs/test_calibrate_command.py",),
    "calibration/robust": ("calibration/test_pivot.py", "calibration/test_hand_eye.py"),
    "machines/packet": ("machines/test_tracker.py", "machines/test_udp.py"),
    "machines/log": ("machines/test_tracker.py",),
    "machines/mounting": ("machines/test_tracker.py",),
    "machines/tracking": ("machines/test_tracker.py",),
    "machines/simulation": ("machines/test_tracker.py",),
    "localization/ekf": ("estimation/test_kalman.py",),
    "localization/locate": ("localization/test_path.py", "verbs/test_localize_command.py"),
    "fast/path": ("localization/test_path.py",),
}


def tests_of(path):
    """The test files of a module: its own name in the same room, those of ELSEWHERE, and that of one bad entry."""
    room, module = path.parent.name, path.stem
    own = f"{room}/test_{'fast_' if room == 'fast' else ''}{module}.py"
    twin = f"fast/test_fast_{module}.py"  # compares the readable form with the tuned one
    files = list(dict.fromkeys([own, twin, *ELSEWHERE.get(f"{room}/{module}", ()), "test_one_in_a_batch.py"]))
    found = tuple(f"tests/{file}" for file in files if (ROOT / "tests" / file).exists())
    if len(found) < 2 and module != "__init__":
        raise SystemExit(f"labkit/{room}/{module}.py has no test file: name it in ELSEWHERE")
    return found


class Entered:
    """A pytest plugin: which functions of the mathematics every test enters, and the seconds it takes."""

    def __init__(self):
        self.tests, self.now = {}, set()

    def __call__(self, frame, event, arg):
        code = frame.f_code
        if f"{os.sep}labkit{os.sep}" in code.co_filename:
            self.now.add((code.co_filename, code.co_firstlineno))

    @import_module("pytest").hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item):
        self.now = set()
        start = time.process_time()
        sys.settrace(self)
        try:
            return (yield)
        finally:
            sys.settrace(None)
            self.tests[item.nodeid] = (time.process_time() - start, sorted(self.now))


@dataclass
class Child:
    """A forked process that runs tests."""

    pid: int
    deadline: float


def fork(tests, scratch, limit, change=None, note=None):
    """Run tests in a child of at most `limit` seconds of processor time, with a change; `note`: a file for Entered."""
    pid = os.fork()
    if pid:
        return Child(pid, time.monotonic() + 120 + 10 * limit)
    try:
        os.setsid()
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
        silence = os.open(os.devnull, os.O_RDWR)
        for stream in range(3):
            os.dup2(silence, stream)
        if change:
            put_in_place(change)
        import pytest

        entered = Entered()
        options = ["-x", "-q", "--tb=no", f"--basetemp={scratch}/{os.getpid()}"]
        code = pytest.main([*options, *tests], plugins=[entered] if note else [])
        if note:
            Path(note).write_text(json.dumps(entered.tests), encoding="utf-8")
        os._exit(code)
    except BaseException:
        os._exit(99)


def put_in_place(change):
    """Let the import system find the changed text where the module's file is."""
    plain = SourceFileLoader.get_code
    changed = change.text[: change.start] + change.new + change.text[change.end :]

    def get_code(loader, name):
        if Path(loader.path) == change.path:
            return compile(changed, loader.path, "exec", dont_inherit=True)
        return plain(loader, name)

    SourceFileLoader.get_code = get_code


def outcome(child):
    """ "survived", "killed" or "too long" once a child has ended; None while it runs."""
    pid, status = os.waitpid(child.pid, os.WNOHANG)
    if not pid:
        if time.monotonic() < child.deadline:
            return None
        os.killpg(child.pid, signal.SIGKILL)
        os.waitpid(child.pid, 0)
        return "too long"
    if os.WIFSIGNALED(status):
        return "too long" if os.WTERMSIG(status) in (signal.SIGXCPU, signal.SIGKILL) else "killed"
    code = os.WEXITSTATUS(status)
    if code not in (PASSED, FAILED, INTERRUPTED, UNKNOWN):
        raise SystemExit(f"pytest ended with {code}, which says nothing about a change")
    return "survived" if code in (PASSED, UNKNOWN) else "killed"  # then the whole files decide


def all_outcomes(starts, jobs, seen=lambda place, found: None):
    """The outcomes of children, `jobs` at a time; `starts` are functions that fork one."""
    found, running, waiting = [None] * len(starts), {}, list(enumerate(starts))
    while waiting or running:
        while waiting and len(running) < jobs:
            place, start = waiting.pop(0)
            running[place] = start()
        for place, child in list(running.items()):
            ended = outcome(child)
            if ended:
                found[place] = ended
                del running[place]
                seen(place, ended)
        time.sleep(0.02)
    return found


@cache
def functions(path):
    """(first line with decorators, last line) of every function of a module."""
    defs = [n for n in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(n, ast.FunctionDef)]
    return [(min([n.lineno, *(d.lineno for d in n.decorator_list)]), n.end_lineno) for n in defs]


def entering(change, tests):
    """The tests that enter the changed function, the quickest first; none for what runs at import."""
    around = [first for first, last in functions(change.path) if first <= change.line <= last]
    if not around:
        return []
    place = [str(change.path), max(around)]
    return [name for _, name in sorted((seconds, name) for name, (seconds, seen) in tests.items() if place in seen)]


def described(change):
    """Module, line and the changed line itself, old => new."""
    text = change.text
    left, right = text.rfind("\n", 0, change.start) + 1, text.find("\n", change.end)
    new = text[left : change.start] + "[" + change.new + "]" + text[change.end : right]
    where = f"{change.path.relative_to(ROOT / 'labkit')}:{change.line}"
    return f"{where}  {text[left:right].strip()}  =>  {new.strip()}"


def unchanged(files, scratch, jobs):
    """{test files: {test: (seconds, functions it enters)}} of the unchanged mathematics."""
    notes = {tests: f"{scratch}/{place}.json" for place, tests in enumerate(files)}
    starts = [lambda tests=tests, note=note: fork(tests, scratch, 600, note=note) for tests, note in notes.items()]
    for tests, found in zip(notes, all_outcomes(starts, jobs)):
        if found != "survived":
            raise SystemExit(f"{' '.join(tests)}: red without any change")
    return {tests: json.loads(Path(note).read_text(encoding="utf-8")) for tests, note in notes.items()}


def main(rooms, count, seed, jobs, module):
    os.chdir(ROOT)
    os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", PYTEST_DISABLE_PLUGIN_AUTOLOAD="1")
    for name in IMPORTED:
        import_module(name)
    modules = [p for room in rooms for p in sorted((ROOT / "labkit" / room).glob("*.py")) if tests_of(p)]
    modules = [p for p in modules if not module or p.stem == module]
    sites = [change for path in modules for change in changes(path)]
    drawn = random.Random(seed).sample(sites, min(count, len(sites)))
    print(f"{len(sites)} places in {len(modules)} modules; {len(drawn)} changes, seed {seed}", flush=True)
    with tempfile.TemporaryDirectory() as scratch:
        known = unchanged({tests_of(change.path) for change in drawn}, scratch, jobs)

        def tried(changes_now, whole):
            starts = []
            for change in changes_now:
                files = tests_of(change.path)
                limit = 10 + int(10 * sum(seconds for seconds, _ in known[files].values()))
                tests = (not whole and entering(change, known[files])) or files
                starts.append(lambda tests=tests, limit=limit, change=change: fork(tests, scratch, limit, change))
            return all_outcomes(starts, jobs, lambda place, found: whole and report(changes_now[place], found))

        first = tried(drawn, False)
        left = [change for change, found in zip(drawn, first) if found == "survived"]
        survived = tried(left, True).count("survived")
    slow = first.count("too long")
    print(f"\n{len(drawn) - survived} of {len(drawn)} caught ({slow} ran too long), {survived} survived")


def report(change, found):
    """Print a change that the tests which enter its function did not notice."""
    if found == "survived":
        print(f"survived {described(change)}", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rooms", nargs="*", default=[], choices=[*ROOMS, []])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--module", default="")
    given = parser.parse_args()
    main(given.rooms or ROOMS, given.count, given.seed, given.jobs, given.module)
