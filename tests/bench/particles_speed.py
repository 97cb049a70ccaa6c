"""Chapter 9 against the goals of its issue, in units of the same run.

    python tests/bench/particles_speed.py PEERS [--repeats 7]

PEERS is the path of the peers' benchmark (peers.py). V is exp of 1e6 doubles, timed right after each repeat; "plain"
is the textbook form in the same file. Goals: landmark update at most 0.7 V at 1e4 particles, likelihood field at most
3 V at 1e4 x 60 and 10 times the textbook, ray casting at least 1.7 times plain sphere tracing, systematic resampling
at most 1.5 V at 1e5.
"""

import argparse
import importlib.util
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(Path(__file__).parent)]


def load(path):
    spec = importlib.util.spec_from_file_location("peers", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)  # sets one thread a process before numpy starts
    return module


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("peers", type=Path)
    parser.add_argument("--repeats", type=int, default=7)
    args = parser.parse_args()
    peers = load(args.peers)
    import hooks_particles as ours

    rng = np.random.default_rng(5)
    marks, u = np.array([[0.0, 0], [10, 0], [10, 10], [0, 10]]), (1.0, 0.2)
    true = np.array([[4.0, 3.0, 0.5]])
    z = peers.pf_see(peers.pf_move(true, u, np.random.default_rng(0)), marks)[0]
    dist, res, sigma = peers.grid_map(), 0.05, 0.2
    metres = dist * res
    bearings = np.linspace(-np.pi, np.pi, 60, endpoint=False)
    free = np.argwhere(dist > 3)[:, ::-1]

    def scatter(m):
        places = free[rng.integers(len(free), size=m)] + rng.random((m, 2))
        return np.column_stack([places, rng.uniform(-3, 3, m)])

    scan = peers.ray_numpy(scatter(1), bearings, dist, 300.0)[0] * res

    def report(name, call, plain=None):
        t, v = peers.bench(call, peers.ref_v, args.repeats)
        line = f"{name:44s} {1e3 * t:9.2f} ms {v:7.2f} V"
        if plain is not None:
            t_plain, _ = peers.bench(plain, peers.ref_v, args.repeats)
            line += f"   {t_plain / t:5.1f} times the plain form"
        print(line, flush=True)

    for m in (1000, 10_000, 100_000):
        p = true + rng.normal(size=(m, 3)) * [0.5, 0.5, 0.2]
        g = np.random.default_rng(1)

        def plain_update(p=p, g=g):
            h = peers.pf_move(p, u, g)
            return h[peers.rs_search(peers.pf_weigh(peers.pf_see(h, marks), z), g)]

        report(f"landmark update, {m} particles", lambda p=p, g=g: ours.pf_update(p, u, z, marks, g), plain_update)
    for m in (1000, 10_000):
        q = scatter(m)
        p = q * [res, res, 1]
        deviation = np.abs(
            ours.likelihood_field(p, scan, bearings, metres, res, sigma)
            - peers.lf_numpy(p, scan, bearings, metres, res, sigma)
        )
        report(
            f"likelihood field, {m} x 60",
            lambda p=p: ours.likelihood_field(p, scan, bearings, metres, res, sigma),
            lambda p=p: peers.lf_numpy(p, scan, bearings, metres, res, sigma),
        )
        print(f"    deviation from the textbook's log likelihood, 99 %: {np.quantile(deviation, 0.99):.1e}")
        report(
            f"ray casting, {m} x 60",
            lambda q=q: ours.raycast(q, bearings, dist, 300.0),
            lambda q=q: peers.ray_numpy(q, bearings, dist, 300.0),
        )
    for m in (10_000, 100_000):
        g = np.random.default_rng(8)
        w = g.exponential(size=m) ** 2
        w /= w.sum()
        report(
            f"systematic, {m}", lambda w=w, g=g: ours.HOOKS["systematic"](w, g), lambda w=w, g=g: peers.rs_search(w, g)
        )


if __name__ == "__main__":
    main()
