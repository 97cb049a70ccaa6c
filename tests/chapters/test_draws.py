"""Whatever a docstring leaves free varies in the draws: no answer can be wired to a size, a limit or a sign."""

import functools

import numpy as np
import pytest

from labkit.exercises import session
from labkit.exercises.engine import Exercise

ITEMS = [(c.name, i) for c in session.chapters() for i in c.items if isinstance(i, Exercise)]
SEEDS = 6
FIT = "with as many rows as unknowns nothing is left over"
PAIR = "nine rows are one pair of poses, of which no rotation follows"
NEVER_SQUARE = {  # (exercise, argument): why no draw has as many rows as columns
    ("solve_pivot", "A"): "six rows are two poses, of which no tip follows",
    ("pivot_covariance", "A"): "six rows are two poses, of which no tip follows",
    ("pivot_covariance", "residuals"): "three poses are among the properties",
    ("linear_start", "x_S"): "it takes five poses",
    **{(name, "M"): PAIR for name in ("rotation_from_nullvector", "singular_value_ratio", "e_rot")},
    **{(name, "J"): FIT for name in ("left_out", "honest_covariance", "visible")},
}


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


def drawn_shapes(values):
    """The shapes of one argument, draw by draw; nothing where it is no matrix of decimals."""
    kinds = [[np.shape(v) for v in of_draw if isinstance(v, np.ndarray) and v.dtype.kind == "f"] for of_draw in values]
    return [shapes for shapes in kinds if shapes and all(len(shape) == 2 for shape in shapes)]


def is_never_square(shapes):
    """Whether the number of rows varies, and no draw is sure to have as many as columns: there a transpose fits."""
    rows = {n for of_draw in shapes for n, _ in of_draw}
    return len(rows) > 1 and not any(all(n == d for n, d in of_draw) for of_draw in shapes)


@functools.cache
def drawn_of(chapter, id):
    """Arguments of one exercise, draw by draw."""
    item = next(item for name, item in ITEMS if (name, item.id) == (chapter, id))
    draws = [*item.cases, *(draw for draw, *_ in item.noisy)]
    return [[draw(np.random.default_rng(seed)) for seed in range(SEEDS)] for draw in draws]


def each(items):
    return pytest.mark.parametrize("chapter, item", items, ids=[f"{chapter}/{item.id}" for chapter, item in items])


@each([(chapter, item) for chapter, item in ITEMS if item.metric])  # properties draw for themselves
def test_as_many_rows_as_columns_are_drawn_or_it_says_why_not(chapter, item):
    for k, name in enumerate(item.arguments):
        shapes = drawn_shapes(
            [[args[k] for args in of_draw if len(args) > k] for of_draw in drawn_of(chapter, item.id)]
        )
        assert is_never_square(shapes) == ((item.id, name) in NEVER_SQUARE), (item.id, name, shapes)


def test_the_test_sees_what_is_never_square():
    assert is_never_square([[(4, 3)], [(5, 3)]]) and is_never_square([[(3, 3), (5, 3)]])
    assert not is_never_square([[(3, 3), (3, 3)], [(5, 3)]]) and not is_never_square([[(4, 3), (4, 3)]])


@each(ITEMS)
def test_every_argument_varies_or_says_why_not(chapter, item):
    drawn = [args for of_draw in drawn_of(chapter, item.id) for args in of_draw]
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
