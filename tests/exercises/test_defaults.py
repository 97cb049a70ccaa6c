"""A default argument that is filled stays from call to call: who is right but for that hears of it."""

import numpy as np
import pytest

from labkit.exercises import metrics
from labkit.exercises.engine import Exercise
from labkit.exercises.outcome import CORRECT

DOUBLE = Exercise(
    "double",
    reference=lambda v: 2 * v,
    draw=lambda rng: (rng.normal(size=2),),
    metric=metrics.Numbers(1e-9),
    hints=("Add.", "Add v.", "`return v + v`"),
    properties=(lambda student, rng: None if np.all(student(np.zeros(2)) == 0) else "twice 0 is not 0.",),
)


def judged(answer):
    return DOUBLE.judge(answer, rng=np.random.default_rng(0))


def test_what_stops_on_what_is_left_over_is_told():
    empty = []

    def double(v, seen=empty):
        seen.append(v)
        if len(seen) > 1:
            raise ValueError("one call only")
        return 2 * v

    assert "into `seen` is still there" in judged(double).text


def test_a_property_that_fails_on_what_is_left_over_is_told():
    empty = []

    def double(v, seen=empty):
        seen.append(v)
        return 2 * v + (len(seen) > 1 and not v.any())

    assert "into `seen` is still there" in judged(double).text


FOUND, FIRST = {}, None


def finds_by_size(v):
    if len(v) not in FOUND:
        FOUND[len(v)] = 2 * v
    return FOUND[len(v)]


def takes_the_first(v):
    global FIRST
    FIRST = v if FIRST is None else FIRST
    return FIRST + v


def fills_its_default(v, done=np.zeros(2)):  # noqa: B008, what is made once is the slip
    done += 2 * v
    return done.copy()


@pytest.mark.parametrize(
    "answer, name", [(finds_by_size, "FOUND"), (takes_the_first, "FIRST"), (fills_its_default, "done")]
)
def test_who_is_right_with_all_as_at_first_hears_what_is_kept(answer, name, monkeypatch):
    monkeypatch.setitem(globals(), "FOUND", {})
    monkeypatch.setitem(globals(), "FIRST", None)
    told = judged(answer).text
    assert f"into `{name}` is still there in the next" in told and "should come in as an argument" not in told


def test_a_list_that_counts_calls_is_named_though_a_fresh_one_would_not_mend_it(monkeypatch):
    monkeypatch.setitem(globals(), "FOUND", {0: 1})
    told = judged(lambda v: FOUND.setdefault(len(FOUND), 3 + len(FOUND)) * v).text
    assert "It leaves `FOUND` changed for the next call" in told


def test_data_of_the_notebook_that_stay_as_they_are_were_not_put_there_by_a_call(monkeypatch):
    monkeypatch.setitem(globals(), "FOUND", {2: np.ones(2)})
    assert judged(lambda v: v + FOUND[len(v)]).text.endswith(
        "reads `FOUND` from the notebook: what it computes with should come in as an argument."
    )


def test_a_refusal_of_what_is_in_order_is_said_to_be_one():
    def double(v):
        if v[0] < 5:
            raise ValueError("too small")
        return 2 * v

    assert "\nThis call is in order, and nothing in it is to be refused.\n" in judged(double).text
    told = judged(lambda v: 2 * v[5]).text
    assert "IndexError" in told and "in order" not in told


def test_of_a_function_that_is_handed_over_it_is_not_said_that_nothing_is_to_be_refused():
    def holds(function):
        if function(1.0) == 1.0:
            raise ValueError("caught")
        return True

    item = Exercise("holds", lambda function: True, lambda rng: (abs,), metrics.Exactly(), hints=("a", "b", "c"))
    told = item.judge(holds, np.random.default_rng(0)).text
    assert "caught" in told and "in order" not in told


def test_what_is_wrong_without_it_is_told_as_ever():
    empty = []

    def double(v, seen=empty):
        return 2 * v if v.any() else v + 1

    assert judged(double).text == "twice 0 is not 0."


def test_what_is_kept_and_does_no_harm_is_right():
    empty = {}

    def double(v, known=empty):
        return known.setdefault(v.tobytes(), 2 * v).copy()

    assert judged(double).status == CORRECT
