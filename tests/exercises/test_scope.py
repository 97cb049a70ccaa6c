"""While an answer is judged its own name means the answer, and the library's twin of it is out of reach."""

import types

import numpy as np
import pytest
from IPython.core.interactiveshell import InteractiveShell

from labkit.chapters.ch02_chaining.exercises import CHAPTER as CHAINING
from labkit.collect import border
from labkit.exercises import metrics, scope
from labkit.exercises.engine import Exercise
from labkit.exercises.outcome import CORRECT, NOT_YET, RAISED
from labkit.geometry import chaining, frames

CHAIN = CHAINING["chain"]


def typed(code, **known):
    """The last function of a notebook cell, in globals of its own."""
    known = {"np": np, "__name__": "__main__", **known}
    exec(code, known)
    return [value for value in known.values() if isinstance(value, types.FunctionType)][-1]


RECURSIVE = "def chain(transforms):\n    return transforms[0] @ chain(transforms[1:]) if len(transforms) else np.eye(4)"


def test_a_function_may_call_itself_at_the_first_run():
    assert CHAIN.judge(typed(RECURSIVE)).status == CORRECT


def test_nobody_is_judged_with_the_reference_an_unsolved_cell_has_bound():
    answer = typed("def chain(transforms): return chain(transforms)", chain=CHAIN.reference)
    outcome = CHAIN.judge(answer)
    assert outcome.status == RAISED and "calls itself again and again" in outcome.text
    assert answer.__globals__["chain"] is answer  # what the cell itself has defined


HELPED = """
@ex.chain
def chain(transforms):
    T = np.eye(4)
    for link in transforms:
        T = joined(T, link)
    return T


def joined(T, link, *, turned=False):
    return T @ link


def printing(text=print("run")): ...
"""


def test_a_function_may_call_one_that_its_cell_defines_further_down(capsys):
    """A student who runs the cell again after a change below is judged with the changed function, too."""
    shell, said = InteractiveShell(), []
    shell.user_ns.update(ex=types.SimpleNamespace(chain=lambda f: said.append(CHAIN.judge(f)) or f), np=np)
    for cell in (HELPED.replace("T @ link", "link @ T"), HELPED):
        shell.run_cell(cell, silent=True)
    assert [outcome.status for outcome in said] == [NOT_YET, CORRECT]
    assert shell.user_ns["chain"].__globals__["joined"] is shell.user_ns["joined"]
    assert capsys.readouterr().out == 2 * "run\n"  # nothing else in the cell runs twice


def test_the_name_is_given_back_afterwards():
    known = {"chain": 17, "np": np}
    exec(RECURSIVE.replace("def chain", "def other").replace("chain(transforms[1:])", "other(transforms[1:])"), known)
    CHAIN.judge(known["other"])
    assert known["chain"] == 17


@pytest.mark.parametrize(
    "answer",
    [
        chaining.chain,
        typed("def mine(transforms): return chaining.chain(transforms)", chaining=chaining),
    ],
)
def test_the_librarys_function_is_no_answer(answer):
    outcome = CHAIN.judge(answer)
    assert outcome.status == NOT_YET and "you are asked to write" in outcome.text
    assert "chaining.chain" in outcome.text


def test_the_library_itself_still_has_its_function():
    stations = typed(
        "def chain(T):\n    return chaining.stations(T)[-1] if len(T) else np.eye(4)", chaining=chaining
    )  # another function of the library may be used, and may use the twin
    assert CHAIN.judge(stations).status == CORRECT
    np.testing.assert_array_equal(chaining.chain([np.eye(4)]), np.eye(4))


def test_data_of_the_notebook_that_a_function_reads_are_named():
    poses = np.eye(4)
    outcome = CHAIN.judge(typed("def chain(transforms): return 2 * poses", poses=poses, helper=len))
    assert outcome.status == NOT_YET and "`poses`" in outcome.text and "helper" not in outcome.text


def test_data_of_the_notebook_are_named_behind_a_property_too():
    item = Exercise(
        "drawn",
        reference=lambda rng: rng.normal(),
        draw=lambda rng: (rng,),
        draws=0,
        properties=(lambda f, rng: None if f(rng) < 3 else "too large.",),
        hints=("a", "b", "c"),
    )
    outcome = item.judge(typed("def drawn(rng): return limit", limit=5.0))
    assert outcome.status == NOT_YET and outcome.text.startswith("too large.\nYour function reads `limit`")


def test_notebook_data_are_found_in_inner_functions_and_modules_are_none():
    function = typed(
        "def f(x):\n    g = lambda y: y + offset\n    return np.sum(g(x)) * frames.MIN_ARM", offset=1.0, frames=frames
    )
    assert scope.notebook_data(function) == ["offset"]


def test_of_a_function_in_another_process_no_data_are_seen():
    assert scope.notebook_data(border.Remote(None, 1, "f", ["x"])) == []


def test_each_of_two_results_may_be_a_slip_of_its_own():
    from labkit.exercises.outcome import Mistake

    two = Exercise(
        "two",
        reference=lambda x: (x + 1, 2 * x),
        draw=lambda rng: (rng.normal(size=3),),
        metric=metrics.Several(metrics.Numbers(), metrics.Numbers(), names=("sum", "product")),
        hints=("a", "b", "c"),
        mistakes=[Mistake(lambda x: (x, 2 * x), "one is missing"), Mistake(lambda x: (x + 1, x), "twice")],
    )
    outcome = two.judge(lambda x: (x, x))
    assert outcome.text == "sum: one is missing\nproduct: twice"
    assert two.judge(lambda x: (x, 2 * x)).text == "one is missing"
