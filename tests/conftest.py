"""No test writes into the student's progress file or hangs on the pace of the machine; what every Stage must be able to
do.
"""

import itertools

import pytest
from hypothesis import settings

from labkit.exercises import budget, guard

settings.register_profile("the same examples each time", derandomize=True, database=None, deadline=None)
settings.load_profile("the same examples each time")


@pytest.fixture(scope="session")
def progress_files(tmp_path_factory):
    """Names of files that nothing has been written to yet."""
    folder = tmp_path_factory.mktemp("progress")
    return (str(folder / f"{number}.jsonl") for number in itertools.count())


@pytest.fixture(autouse=True)
def own_progress(progress_files, monkeypatch):
    monkeypatch.setenv("LABKIT_PROGRESS", next(progress_files))
    monkeypatch.delenv("LABKIT_STRICT", raising=False)


@pytest.fixture(autouse=True)
def looks_for_explanations_to_the_end(monkeypatch):
    """Else a slow processor would leave wrong answers unexplained that a fast one explains."""
    monkeypatch.setattr(budget, "LOOKING", 12.0)


@pytest.fixture(autouse=True)
def what_is_put_back_after_each_call_is_forgotten():
    """The guard looks through each library that one test has it remember, after every call of all tests behind it."""
    before = guard.PRISTINE.saved
    guard.PRISTINE.saved = dict(before)
    yield
    guard.PRISTINE.saved = before
    guard.PRISTINE.drain()


@pytest.fixture
def draws_fails_and_recovers():
    """Asserts of the Stage a function makes: a picture, another one when made to fail, the first again after Reset."""

    def check(make):
        stage = make()
        before = stage.png()
        stage.make_it_fail()
        assert stage.png() != before and stage.status == ""
        stage.reset()
        assert stage.png() == before
        assert repr(stage) == repr(make()) and stage.caption

    return check
