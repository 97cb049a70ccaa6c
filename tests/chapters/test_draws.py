"""Whatever a docstring leaves free varies in the draws: no answer can be wired to a size, a limit or a sign."""

import numpy as np
import pytest

from labkit.exercises import session
from labkit.exercises.engine import Exercise

ITEMS = [(c.name, i) for c in session.chapters() for i in c.items if isinstance(i, Exercise)]
SEEDS = 6


def same_each_time(values):
    """What does not vary among the values of one argument: "value", "shape", or nothing."""
    first = values[0]
    if all(type(v) is type(first) and _equal(v, first) for v in values):
        return "value"
    if isinstance(first, np.ndarray) and first.ndim and all(np.shape(v) == first.shape for v in values):
        return "shape"
    return ""


def _equal(a, b):
    if isinstance(a, np.ndarray):
        return a.shape == b.shape and np.array_equal(a, b)
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(map(_equal, a, b))
    return a is b or bool(np.all(a == b)) if not callable(a) else a is b


@pytest.mark.parametrize("chapter, item", ITEMS, ids=[f"{chapter}/{item.id}" for chapter, item in ITEMS])
def test_every_argument_varies_or_says_why_not(chapter, item):
    draws = [*item.cases, *(draw for draw, *_ in item.noisy)]
    drawn = [draw(np.random.default_rng(seed)) for draw in draws for seed in range(SEEDS)]
    constant = {
        name: same
        for k, name in enumerate(item.arguments)
        if (values := [args[k] for args in drawn if len(args) > k]) and (same := same_each_time(values))
    }
    unexplained = {name: same for name, same in constant.items() if not item.fixed.get(name)}
    assert not unexplained, f"{item.id}: the same in all draws: {unexplained}; vary it, or say why in `fixed`"
    assert set(item.fixed) <= set(item.arguments), f"{item.id}: `fixed` names an argument it does not have"
    assert set(item.fixed) <= set(constant), f"{item.id}: {set(item.fixed) - set(constant)} varies after all"


def test_the_test_sees_what_does_not_vary():
    assert same_each_time([np.ones(3), np.ones(3)]) == "value"
    assert same_each_time([np.ones(3), np.zeros(3)]) == "shape"
    assert same_each_time([np.ones(3), np.ones(4)]) == ""
    assert same_each_time([0.5, 0.5]) == "value" and same_each_time([0.5, 0.6]) == ""
