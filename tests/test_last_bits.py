"""Stirred last bits: small, the same for the same input, different for another seed, and in the kernels too."""

import importlib.util
import json

import numpy as np
import pytest

from labkit.exercises import source


def load(name):
    spec = importlib.util.spec_from_file_location(name, source.ROOT / "tests" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


last_bits = load("last_bits")
A = np.random.default_rng(0).normal(size=(20, 20))


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.complex128])
def test_entries_move_by_two_units_in_the_last_place_at_most(dtype):
    value = A.astype(dtype)
    moved = last_bits.stirred(value, 1)
    assert moved.dtype == dtype and (moved != value).any() and (moved == value).any()
    np.testing.assert_allclose(moved, value, rtol=2 * np.finfo(dtype).eps, atol=0)
    np.testing.assert_array_equal(moved, last_bits.stirred(value, 1))
    assert (moved != last_bits.stirred(value, 2)).any()


def test_zeros_whole_numbers_and_names_stay():
    odd = np.array([0.0, -0.0, np.inf, -np.inf, np.nan])
    np.testing.assert_array_equal(last_bits.stirred(odd, 1), odd)
    assert not last_bits.stirred(np.zeros(5), 1).any()
    assert last_bits.stirred(np.arange(5), 1).tolist() == [0, 1, 2, 3, 4]
    result = last_bits.stirring(np.linalg.qr, 1)(A)
    assert type(result).__name__ == "QRResult" and (result.R != np.linalg.qr(A).R).any()
    assert isinstance(last_bits.stirred(np.float64(0.1), 1), np.float64)


def test_a_given_array_receives_the_stirred_result():
    out = np.empty_like(A)
    assert last_bits.stirring(np.dot, 1)(A, A, out=out) is out
    np.testing.assert_array_equal(out, last_bits.stirred(np.dot(A, A), 1))


def test_a_notebook_runs_with_stirred_last_bits(tmp_path, monkeypatch):
    monkeypatch.delenv("LAST_BITS", raising=False)  # set when this very test runs with stirred last bits
    run = load("run")
    code = "import numpy as np\nprint(type(np.linalg.inv).__name__)"
    output = {"output_type": "stream", "name": "stdout", "text": "function\n"}
    cell = {"cell_type": "code", "id": "a", "metadata": {}, "source": code, "outputs": [output], "execution_count": 1}
    notebook = {"cells": [cell], "metadata": {}, "nbformat": 4, "nbformat_minor": 5}
    folder = run.scratch_folder() / tmp_path.name
    folder.mkdir()
    path = folder / "small.ipynb"
    path.write_text(json.dumps(notebook), encoding="utf-8")
    try:
        passed, failed = (run.run(["--nbval", *run.BARE, str(path)], seed)[0] for seed in (1, None))
    finally:
        path.unlink()
        folder.rmdir()
    assert (passed["passed"], failed["failed"]) == (1, 1)


def test_the_jobs_that_are_stirred(monkeypatch):
    run = load("run")
    names = ["unit tests 1", "unit tests 2", "browser", "solved notebooks 1", "blank notebooks 1"]
    monkeypatch.setenv("CI", "true")
    assert run.stirred_jobs(names, None) == {"unit tests 2": 1}
    monkeypatch.delenv("CI")
    assert run.stirred_jobs(names, None) == {}
    assert run.stirred_jobs(names, 7) == dict.fromkeys(["unit tests 1", "unit tests 2", "solved notebooks 1"], 7)
    assert run.stirred_jobs(["named"], 7) == {"named": 7}


@pytest.mark.parametrize(
    "arguments, split",
    [
        ([], (None, [])),
        (["tests/stage", "-k", "play"], (None, ["tests/stage", "-k", "play"])),
        (["--last-bits", "3"], (3, [])),
        (["--last-bits", "3", "tests/stage"], (3, ["tests/stage"])),
    ],
)
def test_the_seed_stands_before_what_is_named(arguments, split):
    assert load("run").split(arguments) == split


@pytest.mark.parametrize("arguments", [["--last-bits"], ["--last-bits", "tests/stage"], ["--last-bits", "-1"]])
def test_a_missing_seed_is_said_in_one_sentence(arguments, capsys):
    assert load("run").main(arguments) == 1
    assert "--last-bits needs a seed" in capsys.readouterr().err
