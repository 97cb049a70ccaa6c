"""The project's functions in the peers' benchmark: `python tests/bench/beside_peers.py PEERS.PY a|...|g [--quick]`.

Loads the benchmark script, puts the functions of `peers_hooks` into its LABKIT table, and runs the case. The script and
the packages it compares with are no part of the workbook; what is not installed is left out of the tables.
"""

import importlib.util
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[2]), str(Path(__file__).resolve().parent)]


def main(path, *arguments):
    spec = importlib.util.spec_from_file_location("peers", path)
    peers = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(peers)
    import peers_hooks  # only now: the script has set the number of threads

    unknown = set(peers_hooks.HOOKS) - set(peers.LABKIT)
    if unknown:
        raise SystemExit(f"{path} has no hook {min(unknown)!r}; it has {', '.join(peers.LABKIT)}")
    peers.LABKIT.update(peers_hooks.HOOKS)
    sys.argv = [path, *arguments]
    peers.main()


if __name__ == "__main__":
    if len(sys.argv) < 3:
        raise SystemExit(__doc__)
    main(*sys.argv[1:])
