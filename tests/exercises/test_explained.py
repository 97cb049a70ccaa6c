"""What the general layer says beyond relations: terms, shapes, single changes of the formula, arguments without effect,
the case that is special.
"""

import ast
import textwrap

import numpy as np
import pytest

from labkit.exercises import cases, engine, guard, metrics, mutation, operands, shapes
from labkit.exercises.engine import NOT_YET, Exercise

RNG = np.random.default_rng(3)
NUMBERS = metrics.Numbers(1e-9)
DRAWS = [{"x": RNG.normal(size=3), "dt": RNG.uniform(0.1, 0.9), "w": RNG.uniform(1, 2, 4)} for _ in range(4)]
EXPECTED = [3.0 * d["x"] + 1.0 for d in DRAWS]


@pytest.mark.parametrize(
    "wrong, told",
    [
        (lambda e, d: d["x"], "your result is the argument `x`, unchanged"),
        (lambda e, d: e - d["x"], "the argument `x` is missing"),
        (lambda e, d: e + d["x"], "the argument `x` is in your result once too often"),
        (lambda e, d: e - 2 * d["x"], "twice the argument `x` is missing"),
        (lambda e, d: e * d["dt"], "your result is the expected one times `dt`"),
        (lambda e, d: e / d["dt"], "`dt` times your result is the expected one"),
        (lambda e, d: e * d["dt"] ** 2, "times the square of `dt`"),
        (lambda e, d: -e * d["dt"], "your result is minus the expected one times `dt`"),
        (lambda e, d: e * d["w"].sum(), "times the sum of `w`"),
        (lambda e, d: e / np.linalg.norm(d["w"]), "the length (norm) of `w` times your result"),
        (lambda e, d: e + 0.1 * d["x"] ** 2, None),
    ],
)
def test_terms_and_factors_that_are_arguments(wrong, told):
    words = operands.operand_words(NUMBERS, [wrong(e, d) for e, d in zip(EXPECTED, DRAWS)], EXPECTED, DRAWS)
    assert words is None if told is None else told in words


MATRICES = [m @ m.T for m in RNG.normal(size=(3, 3, 3))]
TABLES = [RNG.normal(size=(n, 4)) for n in (5, 6, 7)]


@pytest.mark.parametrize(
    "wrong, expected, told",
    [
        (np.diag, MATRICES, "the expected matrix' diagonal alone"),
        (lambda e: np.sqrt(np.diag(e)), MATRICES, "the roots of the expected matrix' diagonal"),
        (lambda e: e.sum(), TABLES, "the sum of the expected numbers"),
        (lambda e: e[:-1], TABLES, "without its last row"),
        (lambda e: e[:, 2], TABLES, "column 2 (counted from 0)"),
        (lambda e: np.vstack([e, e[:1]]), TABLES, "one row too many, the last"),
        (lambda e: RNG.normal(size=9), TABLES, None),
    ],
)
def test_results_of_another_shape(wrong, expected, told):
    words = shapes.shape_words([wrong(e) for e in expected], expected)
    assert words is None if told is None else told in words


def test_one_of_several_results_and_two_exchanged():
    pairs = [(e[0], e) for e in MATRICES]
    assert "is covariance alone" in shapes.shape_words([e for _, e in pairs], pairs, ("state", "covariance"))
    assert "exchanged" in shapes.shape_words([p[::-1] for p in pairs], pairs, ("state", "covariance"))


def test_the_case_on_which_an_answer_is_wrong():
    draws = [({"v": v, "n": n}, 1.0) for v, n in ((1.0, 2), (-1.0, 2), (2.0, 3), (-3.0, 3))]
    assert cases.case_words(4 * draws, 4 * [False, True, False, True]) == "`v` is negative"
    assert cases.case_words(4 * draws, 4 * [False, True, True, False]) is None
    assert cases.case_words(draws, [False, True, False, True]) is None, "so few draws may agree by chance"


FORMULA = """
def formula(a, b):
    c = a @ b.T
    if c.sum() < 0:
        c = -c
    return np.linalg.inv(c) + 2 * a
"""


def test_single_changes_of_a_formula_are_functions_that_differ_in_one_place():
    function = ast.parse(FORMULA).body[0]
    found = mutation.changes(function)
    texts = [ast.unparse(change.tree(function)) for change in found]
    plain = ast.unparse(function)
    assert plain not in texts and ast.unparse(ast.parse(FORMULA).body[0]) == plain
    told = dict(zip(texts, (change.words for change in found)))
    for new, words in (
        (plain.replace("b.T", "b"), "without one of its transposes"),
        (plain.replace("@", "*"), "with `*` where `@` belongs"),
        (plain.replace("np.linalg.inv(c)", "c"), "without `inv`"),
        (plain.replace("< 0", "> 0"), "with `>` where `<` belongs"),
        (plain.replace("c = -c", "pass"), "without one of its steps"),
        (plain.replace(" + 2", " - 2"), "with minus where plus belongs"),
    ):
        assert told[new] == words


def exercise(reference, draw, metric=NUMBERS):
    return Exercise("formula", reference=reference, draw=draw, metric=metric, hints=("a", "b", "c"))


def told(item, body):
    known = {"np": np}
    exec(f"def formula(x, std):\n{textwrap.indent(body, '    ')}", known)
    outcome = item.judge(known["formula"], rng=np.random.default_rng(0))
    assert outcome.status == NOT_YET
    return outcome.text


def _draw(rng):
    return rng.normal(size=4), rng.uniform(1, 2)


def test_an_argument_without_effect_is_named():
    item = exercise(lambda x, std: x / std + np.sin(x), _draw)
    assert "does not change with `std`" in told(item, "return x / (1.7 + std**0 - 1) + np.sin(x)")
    assert "never uses `std`" in told(item, "return x / 1.7 + np.sin(x)")


def test_a_rounded_result_is_said_to_be_rounded_though_an_argument_has_no_effect_on_its_digits():
    item = exercise(lambda x, std: np.sin(x) + 1e-9 * std**3 * np.cos(x), _draw, metrics.Numbers(1e-12))
    assert "your result is rounded" in told(item, "return np.round(np.sin(x) + 1e-9 * std**3 * np.cos(x), 4)")
    assert "rounded" not in told(item, "return np.sin(x)")


def test_a_one_that_should_be_a_little_less_is_not_called_rounded():
    item = exercise(lambda x, std: 1.0 - 1e-4 * std * np.cos(x) ** 2, _draw)
    assert "rounded" not in told(item, "return np.ones(4)").partition(":")[0]


def test_what_is_tried_as_explanation_writes_nothing_on_the_terminal(capfd):
    def fit(x, std):
        rows = np.vander(1 / x, 2)
        return np.linalg.lstsq(rows, std * x, rcond=None)[0]

    told(exercise(fit, _draw), "return np.sin(x[:2]) + std")
    assert capfd.readouterr() == ("", "")
    with guard.only_finite_matrices():
        for decompose in (np.linalg.lstsq, np.linalg.pinv, np.linalg.svd):
            with pytest.raises(np.linalg.LinAlgError, match="holds NaN"):
                decompose(np.full((3, 3), np.nan), *([np.ones(3)] if decompose.__name__ == "lstsq" else []))
    assert capfd.readouterr() == ("", "")


def test_a_change_that_never_ends_is_given_up(monkeypatch):
    def steps(x, std):
        left = 9.0
        while left > 0:
            left -= abs(std)
        return left + x

    monkeypatch.setattr(engine, "LOOKING", 0.05)
    assert "comes out" not in told(exercise(steps, _draw), "return np.sin(x)")


def test_the_special_case_is_named():
    item = exercise(
        lambda x, std: np.sin(x.sum()) * std + x[0], lambda rng: (rng.normal(size=2), rng.choice([-1.3, 1.7]))
    )
    assert "draws it was wrong exactly where `std` is negative" in told(
        item, "return np.sin(x.sum()) * abs(std) + x[0]"
    )


def test_an_argument_scaled_by_another_is_named():
    item = exercise(lambda x, std: x / std + np.sin(x), _draw)
    assert "with `x` times `std` in place of `x`" in told(item, "x = x * std\nreturn x / std + np.sin(x)")


def test_of_two_results_the_right_one_is_told():
    both = metrics.Several(NUMBERS, NUMBERS, names=("sine", "cosine"))
    item = exercise(lambda x, std: (np.sin(x), np.cos(x) + std**3), _draw, both)
    assert "Right are: sine." in told(item, "return np.sin(x), np.cos(x) + std**2.7 - 0.1 * x**4")
