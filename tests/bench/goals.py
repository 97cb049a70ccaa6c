"""The project's speed beside its goals, in one table: `python tests/bench/goals.py PEERS.PY`.

Takes data and references from the peers' benchmark, our functions from `peers_hooks`, and measures P and V in the same
run: P = 1000 products of two 3x3 matrices, V = exp of 1e6 doubles, each timed right after what it is compared with.
PEERS.PY is no part of the workbook, and of the packages it compares with none is needed. Counted is processor time of
one thread, since a busy machine lends it in pieces; its caches are still shared. Takes about half a minute.
"""

import contextlib
import importlib.util
import io
import sys
import timeit
from functools import partial
from pathlib import Path
from time import process_time
from types import SimpleNamespace

sys.path[:0] = [str(Path(__file__).resolve().parents[2]), str(Path(__file__).resolve().parent)]

PACKAGES = ("cv2", "numba", "fkalman", "fmc", "pykalman", "simdkalman", "presample", "pfilter", "ptraj", "spatialmath")
IN_CASES = (  # what, goal, unit, how the title of the benchmark's table begins, row
    ("Kalman filter, 10,000 steps", 0.5, "P", "D. linear KF, 2 states, 10,000", "labkit kalman"),
    ("EKF, 1000 steps, 4 landmarks", 8.0, "P", "D. range-bearing EKF, 4", "labkit ekf"),
    (
        "landmark filter, 10,000 particles",
        0.7,
        "V",
        "E1. landmark particle filter update, M=10000,",
        "labkit pf_update",
    ),
    ("systematic resampling, 100,000", 1.5, "V", "G. resampling, M=100000", "labkit systematic"),
)
GAINS = (  # what, goal, how the title begins, the row compared with, our row
    ("field against textbook", 10.0, "E2. likelihood field, M=10000,", "numpy plain", "labkit likelihood_field"),
    ("rays against sphere tracing", 1.7, "E3. ray casting, M=1000 ", "numpy sphere tracing", "labkit raycast"),
)


def load(path):
    """The benchmark as a module, with our functions put in and every other package left out."""
    spec = importlib.util.spec_from_file_location("peers", path)
    peers = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(peers)
    import peers_hooks  # only now: the script has set the number of threads

    for name in PACKAGES:
        setattr(peers, name, None)
    peers.timeit = SimpleNamespace(**{f: partial(getattr(timeit, f), timer=process_time) for f in ("timeit", "repeat")})
    peers.LABKIT.update(peers_hooks.HOOKS)
    return peers


def run_cases(peers):
    """{(title, row): (seconds, ratio)} of the rows that a goal speaks of."""
    titles = {row[3]: {row[4]} for row in IN_CASES} | {row[2]: {row[3], row[4]} for row in GAINS}
    found = {}

    def timed(title, cases, ref, work=None, unit="", repeats=7):
        for begin, rows in titles.items():
            if title.startswith(begin):
                found.update({(begin, name): peers.bench(fn, ref, repeats) for name, fn in cases if name in rows})

    peers.timed = timed
    with contextlib.redirect_stdout(io.StringIO()):
        for case in "deg":
            getattr(peers, f"case_{case}")(case == "g")
    return found


def solvers(peers):
    """(what, goal, unit, measured) of the calibrations."""
    np, ours = peers.np, peers.LABKIT
    for n, goal in ((20, 0.8), (100, 1.2)):
        T, B = peers.he_data(np.random.default_rng(n), n, 0.1, 0.1)
        yield f"hand-eye AX = XB, {n} poses", goal, "P", peers.bench(lambda T=T, B=B: ours["handeye"](T, B))[1]
    T, _ = peers.pv_data(np.random.default_rng(1000), 1000)
    yield "pivot, 1000 poses", 0.1, "P", peers.bench(lambda: ours["pivot"](T))[1]
    T_BF, x, _ = peers.sp_data(np.random.default_rng(31))
    yield "hand-eye on a sphere, 31 poses", 0.3, "P", peers.bench(lambda: ours["sphere_handeye"](T_BF, x))[1]


def main(path):
    peers = load(path)
    rows = list(solvers(peers))
    found = run_cases(peers)
    rows += [(what, goal, unit, found[title, row][1]) for what, goal, unit, title, row in IN_CASES]
    gains = [(what, goal, found[title, plain][0] / found[title, row][0]) for what, goal, title, plain, row in GAINS]
    p, v = (1e3 * peers.bench(reference)[0] for reference in (peers.ref_p, peers.ref_v))
    print(f"P = {p:.3g} ms, V = {v:.3g} ms\n\n| what | goal | measured | met |\n| --- | ---: | ---: | --- |")
    for what, goal, unit, ratio in rows:
        print(f"| {what} | at most {goal:g} {unit} | {ratio:.3g} {unit} | {'yes' if ratio <= goal else 'no'} |")
    for what, goal, gain in gains:
        print(f"| {what} | at least {goal:g} times | {gain:.3g} times | {'yes' if gain >= goal else 'no'} |")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    main(sys.argv[1])
