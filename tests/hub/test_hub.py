"""The hub of docs/hub.md, from nothing, by its own commands; two students at work, stopped, and back."""

import itertools
import os
import statistics
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import hub
import students

NAMES = ("ada", "bela")
MOVES, ROUNDS, LIMIT_MS = 9, 20, 50
SOLVE = """from labkit.exercises import course
import numpy as np
@course("01-frames").invert
def invert(T):
    X = np.eye(4)
    X[:3, :3] = T[:3, :3].T
    X[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return X
"""
TELL = "from labkit.exercises import progress; print(sorted(progress.solved()))"


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    if hub.what_is_missing():
        pytest.skip(hub.what_is_missing())
    place = tmp_path_factory.mktemp("hub")
    problem = hub.set_up(place)
    if problem:
        pytest.skip(f"the hub of docs/hub.md cannot be installed here: {problem}")
    with hub.running(place) as found:
        yield found


def test_the_page_needs_at_most_ten_commands():
    assert 1 <= len(hub.commands()) <= 10


@pytest.mark.skipif(os.name == "nt", reason="a hub runs on Linux and macOS")
@pytest.mark.parametrize(
    ("command", "reason"),
    [
        ("echo 'npm error code ENOTFOUND' && exit 1", "no registry answers"),
        ("sleep 30", "the registries are too slow: 0.5 s"),
        ("true", ""),
    ],
)
def test_where_no_registry_answers_a_sentence_says_so(monkeypatch, tmp_path, command, reason):
    monkeypatch.setattr(hub, "commands", lambda: [command, "the last one, which is not run"])
    told = hub.set_up(tmp_path, seconds=5 if "sleep" not in command else 0.5)
    assert told.startswith(reason) and (told == "") == (reason == "")


@pytest.mark.skipif(os.name == "nt", reason="a hub runs on Linux and macOS")
def test_a_command_that_is_wrong_is_no_reason_to_skip(monkeypatch, tmp_path):
    monkeypatch.setattr(hub, "commands", lambda: ["cp nothing nowhere", ""])
    with pytest.raises(RuntimeError, match="cp nothing nowhere"):
        hub.set_up(tmp_path)


def test_students_work_side_by_side_and_come_back_to_their_own_progress(address):
    class_ = [students.Student(address, name, hub.PASSWORD) for name in NAMES]
    with ThreadPoolExecutor(len(class_)) as pool:
        kernels = list(pool.map(a_morning, class_))
        fastest = min(itertools.chain.from_iterable(rounds_of_moves(kernels)))
        assert fastest <= LIMIT_MS, f"from an arrow key to the picture behind the proxy: {fastest:.0f} ms in the median"
        list(pool.map(an_evening, class_, kernels, (True, False)))
        told = list(pool.map(the_next_day, class_))
    assert ["01-frames" in words for words in told] == [True, False], told
    assert all("05-hand-eye" in words for words in told), "predictions of chapter 5 are remembered, too"


def a_morning(student):
    """Log in and run all of chapter 5; the kernel."""
    student.log_in()
    cells, kernel = student.open("workbook/05_hand_eye.ipynb")
    assert kernel.run_all(cells) == [] and len(cells) > 20
    return kernel


def rounds_of_moves(kernels):
    """Medians of the students, one after the other, until one is as fast as it should be.

    Other tests run at the same time, and slow a round down; no load speeds one up.
    """
    for _ in range(ROUNDS):
        stages = [next(s for s, declared in k.stages.items() if declared["handles"]) for k in kernels]
        medians = [statistics.median(k.move(stage, MOVES)) for k, stage in zip(kernels, stages)]
        yield medians
        if min(medians) <= LIMIT_MS:
            return


def an_evening(student, kernel, solves):
    """Solve an exercise, or not; the server is stopped."""
    if solves:
        assert kernel.run(SOLVE) is None
    kernel.close()
    student.stop()


def the_next_day(student):
    """What a new server and a new kernel remember."""
    student.start()
    _, kernel = student.open("workbook/01_frames.ipynb")
    assert kernel.run(TELL) is None
    kernel.close()
    return kernel.printed
