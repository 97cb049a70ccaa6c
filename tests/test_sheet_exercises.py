"""Answers to chapters 2 and 3 that were once judged wrongly or told too little, and their last hints as they stand."""

import re

import numpy as np
import pytest
import scipy.linalg
from numpy.linalg import lstsq

from labkit import chaining, pivot
from labkit.course import ch02_chaining, ch03_quirlen, source
from labkit.course.engine import CORRECT, NOT_YET, Exercise, Value
from labkit.frames import relative
from labkit.lie import exp_se3, log_se3

CHAPTERS = (ch02_chaining.CHAPTER, ch03_quirlen.CHAPTER)
ITEMS = {item.id: item for chapter in CHAPTERS for item in chapter.items}
EXERCISES = [name for name, item in ITEMS.items() if isinstance(item, Exercise)]
KNOWN = {  # what the notebooks have imported
    "np": np, "chaining": chaining, "pivot": pivot, "relative": relative, "exp_se3": exp_se3, "log_se3": log_se3,
}  # fmt: skip


def judged(name, answer, seed=0):
    return ITEMS[name].judge(answer, rng=np.random.default_rng(seed))


def parameters(name):
    """The argument names of an exercise as its notebook has them."""
    for chapter in CHAPTERS:
        found = re.search(rf"def {name}\((.*)\):", source.find(chapter.notebook[:2]).read_text(encoding="utf-8"))
        if found:
            return found[1].split(", ")
    raise AssertionError(name)


@pytest.mark.parametrize("name", EXERCISES)
def test_the_last_hint_is_a_solution(name):
    lines = "\n    ".join(ITEMS[name].hints[-1].removesuffix(".").split("; "))
    space = dict(KNOWN)
    exec(f"def answer({', '.join(parameters(name))}):\n    {lines}", space)
    outcome = judged(name, space["answer"])
    assert outcome.status == CORRECT, outcome.text


@pytest.mark.parametrize("name", EXERCISES)
def test_a_raised_call_is_shown_with_the_names_of_the_notebook(name):
    names = parameters(name)
    assert ITEMS[name].arguments[: len(names)] == names


@pytest.mark.parametrize("digits", [3, 4, 6])
@pytest.mark.parametrize("name", [name for name, item in ITEMS.items() if isinstance(item, Value)])
def test_values_may_be_rounded_to_three_digits(name, digits):
    rounded = float(f"{ITEMS[name].reference():.{digits}g}")
    assert judged(name, rounded).status == CORRECT


@pytest.mark.parametrize("solver", [lambda A, b: lstsq(A, b, rcond=None), scipy.linalg.lstsq])
def test_all_that_lstsq_returns_is_answered_by_its_first(solver):
    outcome = judged("solve_pivot", lambda A, b: solver(A, b))
    assert outcome.status == NOT_YET and "[0]" in outcome.text


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("ones", [np.ones, np.eye])
def test_entry_by_entry_is_no_reflection(ones, seed):
    def chain(transforms):
        T = ones(4)
        for link in transforms:
            T = T * link
        return T

    assert "entry by entry" in judged("chain", chain, seed).text


@pytest.mark.parametrize("first", [0, 1])
def test_corrected_poses_are_not_links(first):
    def distribute(transforms):
        poses = chaining.stations(transforms)
        back = [exp_se3(-k / len(transforms) * log_se3(poses[-1])) for k in range(len(poses))]
        return (np.array(back) @ poses)[first:]

    assert "corrected poses" in judged("distribute_closure", distribute).text


def test_blocks_of_the_pivot_matrix_that_overlap():
    def matrix(T_WF):
        A = np.zeros((3 * len(T_WF), 6))
        for i, T in enumerate(T_WF):
            A[i : i + 3, :3], A[i : i + 3, 3:] = T[:3, :3], -np.eye(3)
        return A

    assert "3 * i" in judged("pivot_matrix", matrix).text
