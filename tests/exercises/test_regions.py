"""The general layer, values: which change of the solution's computation gives a wrong value."""

import numpy as np
import pytest

from labkit.exercises import regions, session


@pytest.fixture(autouse=True)
def nothing_found_before(monkeypatch):
    monkeypatch.setattr(regions, "_FOUND", {})


def angle():
    """The first value of the chapter on coordinate systems."""
    return next(c for c in session.chapters() if c.name.startswith("01"))["angle_deg"]


def test_a_computation_is_taken_from_the_notebook_and_gives_the_value():
    value = angle()
    unchanged, changed = regions._variants(value, 30.0)
    assert np.isclose(unchanged, value.reference(), rtol=1e-9) and len(changed) > 10


def test_a_wrong_value_is_told_by_its_change_and_another_one_is_not():
    value = angle()
    _, changed = regions._variants(value, 30.0)
    finite = [float(f) for _, f in changed if f.shape == () and np.isfinite(f) and f]
    found = next(f for f in finite if abs(f / value.reference() - 1) > 0.01)
    told = regions.change_words(value, found, lambda r: np.isclose(r, value.reference()), 30.0)
    assert told.startswith("this is what a right computation gives with")
    assert regions.change_words(value, found * 1.001, lambda r: True, 30.0) is None
    assert regions.change_words(value, found, lambda r: False, 30.0) is None, "its own computation must be right"


def test_an_answer_of_1_is_not_said_to_come_of_a_1_in_the_place_of_something():
    assert regions._is_put_in(1.0, "with 1 in one place where one intermediate result belongs")
    assert not regions._is_put_in(2.0, "with 1 in one place where one intermediate result belongs")
    assert not regions._is_put_in(1.0, "with one sign turned")
