"""Who returns a list where an array is meant is right, and the cells that follow can calculate with it."""

import numpy as np
import pytest

from labkit.chapters.ch07_dead_reckoning.exercises import CHAPTER
from labkit.exercises import session
from labkit.exercises.listed import in_arrays
from labkit.exercises.outcome import CORRECT


def checked(name, answer):
    """What later cells go on with."""
    outcome = CHAPTER[name].judge(answer, rng=np.random.default_rng(0))
    assert outcome.status == CORRECT
    return in_arrays(answer, outcome.listed)


@pytest.mark.parametrize("kind", [list, tuple, np.ndarray.tolist])
def test_a_list_of_numbers_goes_on_as_an_array(kind):
    right = CHAPTER["control_covariance"].reference
    made = checked("control_covariance", lambda *given: kind(right(*given)))
    given = np.array([1.0, 0.5]), 0.1, 0.1, 0.2, 0.3
    np.testing.assert_array_equal(made(*given), right(*given))
    assert isinstance(made(*given), np.ndarray)


def test_of_several_results_those_that_are_lists_do():
    right = CHAPTER["propagate"].reference
    made = checked("propagate", lambda *given: [right(*given)[0], right(*given)[1].tolist()])
    pose, cov = made(np.zeros(3), np.eye(3), np.ones(2), 0.1, np.eye(2))
    assert pose.shape == (3,) and cov[1, 1] > 1


def test_what_returns_arrays_or_numbers_goes_on_as_it_is():
    for name in ("step_arc", "propagate", "wheel_offset"):
        right = CHAPTER[name].reference
        assert checked(name, answer := lambda *given, right=right: right(*given)) is answer


def test_a_notebook_is_handed_the_arrays(monkeypatch, tmp_path):
    monkeypatch.setenv("LABKIT_PROGRESS", str(tmp_path / "progress.jsonl"))
    right = CHAPTER["control_covariance"].reference
    handed = session.course("07-dead-reckoning").control_covariance(lambda *given: right(*given).tolist())
    assert handed(np.array([1.0, 0.5]), 0.1, 0.1, 0.2, 0.3)[1, 1] == pytest.approx(4.0)
