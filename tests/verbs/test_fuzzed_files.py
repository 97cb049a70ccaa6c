"""A few hundred of the benchmark's spoilt files: a result or a sentence, each time."""

import importlib.util
from pathlib import Path

from labkit.exercises.source import ROOT


def test_spoilt_files_give_a_result_or_a_sentence():
    path = Path(ROOT) / "tests" / "bench" / "fuzz_files.py"
    spec = importlib.util.spec_from_file_location("fuzz_files", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    counts, faults = module.many(140, seed=1)
    assert not faults, faults[0][1]
    assert sum(n for (_, outcome), n in counts.items() if outcome == "result") > 20
    assert sum(counts.values()) == 140
