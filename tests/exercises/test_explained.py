"""What the general layer says beyond relations: terms, shapes, single changes of the formula, arguments without effect,
the case that is special.
"""

import ast
import dataclasses
import linecache
import re
import textwrap

import numpy as np
import pytest

from labkit.exercises import budget, cases, guard, metrics, mutation, operands, shapes
from labkit.exercises.engine import Exercise
from labkit.exercises.outcome import NOT_YET
from labkit.exercises.raised import BEFORE
from labkit.exercises.trial import Trial
from labkit.exercises.wording import short

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
        (lambda e, d: e * d["x"][0], "your result is the expected one times `x[0]`"),
        (lambda e, d: e / abs(d["x"][0]), "the absolute value of `x[0]` times your result is the expected one"),
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
        (lambda e: e[:1], TABLES, "what you return is the first of the expected numbers or rows alone"),
        (lambda e: e[:, :1], TABLES, "the first column of the expected result"),
        (lambda e: e[:, :2], TABLES, "the first 2 columns of the expected result"),
        (lambda e: e[:, 2], TABLES, "column 2 (counted from 0)"),
        (lambda e: np.vstack([e, e[:1]]), TABLES, "one row or entry too many, the last"),
        (lambda e: np.vstack([RNG.normal(size=(9, *e.shape)), e[None]]), TABLES, "the last entry or row"),
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


def test_every_second_row_of_one_of_several_results():
    pairs = [(e, np.vstack([e, e + 1.0])) for e in MATRICES]
    told = shapes.shape_words([(a, b[::2]) for a, b in pairs], pairs, ("state", "covariance"))
    assert told == "covariance: what you return is every second of the expected numbers or rows"


def test_the_case_on_which_an_answer_is_wrong():
    draws = [({"v": v, "n": n}, 1.0) for v, n in ((1.0, 2), (-1.0, 2), (2.0, 3), (-3.0, 3))]
    assert cases.case_words(4 * draws, 4 * [False, True, False, True]) == "exactly where `v` is negative"
    assert cases.case_words(4 * draws, 4 * [False, True, True, False]) is None
    assert cases.case_words(draws, [False, True, False, True]) is None, "so few draws may agree by chance"


def test_what_is_no_angle_is_not_compared_with_pi():
    values = [np.array([4.0 if k % 3 == 0 else 2.0, 1.0, 0.0]) for k in range(24)]
    wrong = [bool(value[0] > 3) for value in values]
    draws = [({"pose": value, "angle": value[0]}, 1.0) for value in values]
    assert cases.case_words(draws, wrong) == "exactly where `angle` is above pi"
    assert cases.case_words([({"pose": given["pose"]}, e) for given, e in draws], wrong) is None


TEXTS = [
    ({"printed": text, "sure": k % 2 == 0}, k % 3) for k, text in enumerate(20 * ["3e4", "1.20", "5e-2", "7,1", "1.05"])
]


@pytest.mark.parametrize(
    "is_wrong, told",
    [
        (lambda g, e: "e4" in g["printed"], "exactly where `printed` has an exponent that is not negative"),
        (lambda g, e: g["printed"] == "1.05", "exactly where `printed` has a zero right behind the point"),
        (
            lambda g, e: g["printed"] == "3e4" and e == 2,
            "exactly where `printed` has an exponent that is not negative and",
        ),
        (lambda g, e: e == 1, "exactly where `1` is right"),
        (lambda g, e: "," in g["printed"] or e == 1, "exactly where `printed` has a comma or `1` is right"),
        (lambda g, e: g["printed"] == "1.20" and e != 1, "only where the decimals of `printed` end with a zero"),
    ],
)
def test_what_texts_and_words_have_in_common_one_or_two_at_once(is_wrong, told):
    assert cases.case_words(TEXTS, [is_wrong(*draw) for draw in TEXTS]).startswith(told)


@pytest.mark.parametrize(
    "draws, told",
    [
        ([{"printed": t} for t in ("3e-12", "3e-2", "3.1", "0.31")], "`printed` has an exponent of several digits"),
        ([{"printed": t} for t in ("0.31", "-5,2", "3.1", "30")], "the digits of `printed` begin with a zero"),
        ([{"texts": t} for t in (["3", "4", "3"], ["3", "4"], ["4", "5", "7"])], "`texts` holds the same text twice"),
        ([{"texts": n * ["3"]} for n in (4, 5, 5)], "`texts` does not have 5 entries"),
        ([{"texts": ["3", t], "mean": "3.5"} for t in ("3.5", "4", "5")], "`texts` holds what `mean` is"),
        ([{"J": np.ones((7, n))} for n in (4, 3, 3)], "`J` has more than 3 columns"),
        ([{"Js": [np.ones((3, 2)), np.ones((3, n))]} for n in (9, 6, 2)], "a matrix in `Js` has more than 6 columns"),
        ([{"Js": n * [np.ones((3, 2))]} for n in (1, 2, 4)], "`Js` has 1 entry"),
    ],
)
def test_what_the_first_of_some_draws_alone_is(draws, told):
    words = cases.case_words([(d, 0.5) for d in 8 * draws], 8 * [True, *(len(draws) - 1) * [False]])
    assert words == (told and f"exactly where {told}")


def test_a_size_that_is_typed_in_is_told_before_those_that_came():
    draws = [({"J": np.ones((n, n))}, 0.5) for n in 8 * [2, 3, 5, 4]]
    assert cases.case_words(draws, 8 * [True, False, True, True]) == "exactly where `J` does not have 3 rows"


@pytest.mark.parametrize(
    "wrong, told",
    [
        ((3, 6, 9), "exactly where `x` has 3, 6 or 9 entries, and not where it has 2 or 4"),
        ((4,), None),  # whatever else is special about this draw
    ],
)
def test_sizes_are_told_as_they_came_and_no_rule_is_made_of_them(wrong, told):
    draws = [({"x": np.ones(n)}, 0.5) for n in 8 * [3, 2, 9, 4, 6]]
    assert cases.case_words(draws, [len(given["x"]) in wrong for given, _ in draws]) == told


def test_what_only_a_few_others_have_is_told_too():
    draws = [({"printed": text}, 0.5) for text in 8 * ["1.5", "2.7", "3.30", "4.1"]]
    wrong = [k % 4 == 2 and k > 8 for k in range(len(draws))]
    assert cases.case_words(draws, wrong) == "only where the decimals of `printed` end with a zero"


@pytest.mark.parametrize(
    "results, told",
    [
        ([("a", "b"), ("c", "c"), ("a", "b")], "it returns 'a' where 'b' is right"),
        ([("a", "b"), ("b", "c"), ("c", "c")], "it returns 'a' where 'b' is right and 'b' where 'c' is right"),
        ([({1}, {1, 2}), (set(), {3})], "what it returns is right, but not all of it is there"),
        (3 * [({1}, {1, 2})], "what it returns is right, but not all of it is there, and never more than one entry"),
        ([({1, 2}, {1}), ({3}, {3})], "all that is right is there, but more is returned than that"),
        ([(set(), {1}), (set(), set())], "it returns an empty set where something belongs into it"),
        ([({1}, {2}), ({3}, {3})], None),
        ([("a", "b"), ("c", "d")], None),
        ([(1.0, 2.0)], None),
    ],
)
def test_words_and_sets_in_the_place_of_others(results, told):
    assert cases.result_words(results) == told


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
    assert "did not change with `std`" in told(item, "return x / (1.7 + std**0 - 1) + np.sin(x)")
    assert "never uses `std`" in told(item, "return x / 1.7 + np.sin(x)")
    assert "never uses `std`" in told(item, "return 0 * x"), "what is not read is told before what comes to nothing"


def test_a_rounded_result_is_said_to_be_rounded_though_an_argument_has_no_effect_on_its_digits():
    item = exercise(lambda x, std: np.sin(x) + 1e-9 * std**3 * np.cos(x), _draw, metrics.Numbers(1e-12))
    assert "your result is the right one, rounded" in told(
        item, "return np.round(np.sin(x) + 1e-9 * std**3 * np.cos(x), 4)"
    )
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
        with pytest.raises(np.linalg.LinAlgError, match="holds NaN"):
            np.polyfit(np.full(3, np.nan), np.ones(3), 1)
    assert capfd.readouterr() == ("", "")


def test_a_change_that_never_ends_is_given_up(monkeypatch):
    def steps(x, std):
        left = 9.0
        while left > 0:
            left -= abs(std)
        return left + x

    monkeypatch.setattr(budget, "LOOKING", 0.05)
    assert "comes out" not in told(exercise(steps, _draw), "return np.sin(x)")


def test_the_special_case_is_named():
    item = exercise(
        lambda x, std: np.sin(x.sum()) * std + x[0], lambda rng: (rng.normal(size=2), rng.choice([-1.3, 1.7]))
    )
    assert "draws it was wrong exactly where `std` is negative" in told(
        item, "return np.sin(x.sum()) * abs(std) + x[0]"
    )


def test_where_some_draws_are_accurate_enough_it_is_asked_for_accuracy_beside_the_case():
    steps = tuple(lambda rng, step=step: (float(rng.uniform(1, 2)), step) for step in (1e-3, 1e-5))
    item = Exercise(
        "slope", reference=lambda x, step: 5 * x**4, draw=steps, metric=metrics.Numbers(1e-7), hints=("a", "b", "c")
    )
    told = item.judge(lambda x, step: ((x + step) ** 5 - (x - step) ** 5) / (2 * step), np.random.default_rng(0)).text
    assert "accurate enough there alone?" in told


def test_the_special_case_is_named_behind_the_entry_that_is_wrong():
    item = exercise(
        lambda x, std: np.array([x, x * std, 3.0]), lambda rng: (rng.uniform(1, 2), float(rng.choice([-1.3, 1.7])))
    )
    text = told(item, "return np.array([x, x * std if std > 0 else 0.1 * np.exp(x), 3.0])")
    assert text.startswith("only entry 1 (counted from 0) is not right") and "exactly where `std` is negative" in text


def test_the_call_that_is_shown_is_the_one_that_is_off_by_so_much():
    item = exercise(lambda x, std: np.sin(x) + 1.7 * std, lambda rng: (rng.uniform(1, 9), rng.uniform(0.1, 9)))
    text = told(item, "return np.sin(x) + 1.7 * std + 0.3 * np.exp(-x) * np.log(1 + std) ** 1.3")
    amount, x, std = (float(v) for v in re.search(r"off by (\S+?)\D? .*x=(\S+), std=(\S+)\)", text, re.DOTALL).groups())
    assert amount == pytest.approx(0.3 * np.exp(-x) * np.log(1 + std) ** 1.3, rel=0.01)


def test_what_stops_on_some_draws_only_is_told_where():
    def formula(x, std):
        return x * std if std > 0 else x / None

    draws = tuple(lambda rng, std=std: (rng.normal(size=2), std) for std in (1.7, -1.3))
    text = exercise(lambda x, std: x * std, draws).judge(formula, rng=np.random.default_rng(0)).text
    assert "it gave no right result exactly where `std` is negative" in text and "shapes" not in text


def test_of_shapes_is_asked_only_where_they_differ():
    trial = Trial(exercise(lambda x, std: x * std, _draw), None)
    trial.inputs = [(np.ones(4), 1.0), (np.ones(2), 2.0)]
    assert trial._before((np.zeros(2), 3.0)) == BEFORE and "shapes" in trial._before((np.ones(3), 1.0))


class counted(metrics.Exactly):
    """A set whose deviation is told in words of its own."""

    def deviations(self, result, expected):
        return [metrics.Deviation("", float(len(result ^ expected)), "", 0.5, words="one tree too many")]


def test_what_a_metric_says_of_a_set_comes_before_what_is_said_of_all_sets():
    item = exercise(lambda x, std: {int(v) for v in x}, lambda rng: (rng.integers(0, 99, 5), 1.0), counted())
    assert told(item, "return {int(v) for v in x} | {100}").startswith("one tree too many")


def test_a_function_that_is_handed_over_says_what_it_was_called_with():
    def draw(rng):
        a = rng.normal(size=3)
        return (lambda y: float(a @ y)), rng.normal(size=3)

    item = exercise(lambda f, x: f(2 * x), draw)
    rows = item.judge(lambda f, x: f(np.ones((5, 3)) * x), rng=np.random.default_rng(0)).text
    assert "Here `f` is called with an array of shape (5, 3), and takes an array of shape (3,)." in rows
    assert "inner sizes" not in rows

    def of_a_number(f, x):
        return f(x) @ x[:2]

    assert "Here `f`" not in item.judge(of_a_number, rng=np.random.default_rng(0)).text


def test_a_one_that_says_along_which_axis_nothing_is_repeated_is_no_slip():
    function = ast.parse("def f(x, n):\n    return np.tile(x, (n, 1)) + 1").body[0]
    ones = [change.mends for change in mutation.mending(function) if change.mends.startswith("1 stands where")]
    assert len(ones) == len(set(ones)) and "1 stands where 0 belongs" in ones


def test_a_matrix_that_bends_down_is_a_case():
    drawn = [np.array([[2.0, -1.5], [-1.5, 1.0 if k % 3 else 2.0]]) for k in range(30)]
    draws = [({"H": H}, 0.5) for H in drawn]
    assert "`H` has a negative eigenvalue" in cases.case_words(draws, [k % 3 > 0 for k in range(30)])


def test_a_result_that_is_nearly_right_by_chance_is_told_so():
    item = exercise(lambda x, std: x + std**2, lambda rng: (rng.uniform(1, 3), rng.uniform(1, 2)))
    many = "r = np.random.default_rng(0)\nreturn x + np.var(std * r.normal(size=300))"
    assert "draws random numbers, so part of this may be chance" in told(item, many)
    assert "random numbers" not in told(item, "return 9 * x ** 3 + np.random.default_rng(0).normal()")


def test_points_that_lie_in_a_plane_are_a_case():
    rng = np.random.default_rng(0)
    clouds = [rng.normal(size=(7, 3)) * [1, 1, k % 2] + 3 for k in range(30)]
    missed = [not k % 2 for k in range(30)]
    words = cases.case_words([({"x": cloud}, 0.0) for cloud in clouds], missed)
    assert words == "exactly where the rows of `x` lie in one plane"


def test_an_argument_scaled_by_another_is_named():
    item = exercise(lambda x, std: x / std + np.sin(x), _draw)
    assert "with `x` times `std` in place of `x`" in told(item, "x = x * std\nreturn x / std + np.sin(x)")


def test_of_two_results_the_right_one_is_told():
    both = metrics.Several(NUMBERS, NUMBERS, names=("sine", "cosine"))
    item = exercise(lambda x, std: (np.sin(x), np.cos(x) + std**3), _draw, both)
    assert "Right are: sine." in told(item, "return np.sin(x), np.cos(x) + std**2.7 - 0.1 * x**4")


@pytest.mark.parametrize(
    "said, args, told",
    [
        ("operands could not be broadcast together with shapes (5,) (2,) ", (np.ones(5), 0.1, len), None),
        (
            "operands could not be broadcast together with shapes (5,) (2,) ",
            (np.ones(5), 0.1, exercise),
            "size of 2: does a function give so many, is it typed in",
        ),
        ("operands could not be broadcast together with shapes (4,3) (5,3) ", ([np.ones((4, 3))], "a"), "size of 5:"),
        ("could not broadcast input array from shape (3,) into shape (2,)", (np.ones((7, 3)),), "size of 2:"),
        ("operands could not be broadcast together with shapes (6,) (2,) ", (np.ones((2, 3)),), None),
        ("operands could not be broadcast together with shapes (6,) (2,) ", (np.ones(5),), None),
        ("operands could not be broadcast together with shapes (6,1,4) (6,2,5) ", (np.ones((6, 5)),), "size of 4:"),
    ],
)
def test_a_size_that_no_argument_has_is_told(said, args, told):
    words = shapes.strange_size(said, args)
    assert told in words if told else words == ""


def test_one_call_is_shown_with_what_it_gives_and_with_the_right_word():
    item = exercise(lambda x, std: float(np.sin(x) * std + x**2), lambda rng: (rng.uniform(1, 3), rng.uniform(1, 2)))
    text = told(item, "return np.tan(x) * std + 0.3 * x**3 + (std > 1.5)")
    x, std, mine = (float(v) for v in re.search(r"x=(\S+), std=(\S+)\): it gives (\S+)$", text).groups())
    assert mine == pytest.approx(np.tan(x) * std + 0.3 * x**3 + (std > 1.5), rel=1e-3)
    assert text.count("\n") == 1 and text.partition("\n")[0].endswith(".")
    words = exercise(lambda x, std: "abcde"[int(x)], lambda rng: (rng.uniform(0, 5), rng.normal()), metrics.Exactly())
    said = told(dataclasses.replace(words, draws=12), "return 'abcde'[int(x * x) % 5]")
    assert re.search(r"x=\S+, std=\S+\): it gives '[a-e]', and '[a-e]' is right$", said)


def test_where_the_first_entries_are_right_it_is_told_on_which_draws_the_others_are_not():
    item = exercise(lambda x, std: np.array([x, x * x, np.sin(3 * x), np.cos(3 * x)]), lambda rng: (rng.normal(), 1.0))
    text = told(item, "return np.array([x, x * x, *((np.sin(3 * x), np.cos(3 * x)) if x > 0.0 else (0.3, x - 0.2))])")
    assert text.startswith("the first 2 are right, not all behind them are. On ")
    assert "draws it was wrong exactly where `x` is negative." in text


def test_what_is_small_on_every_draw_is_said_to_be():
    item = exercise(lambda x, std: float(np.exp(x) + std), lambda rng: (rng.uniform(1, 3), rng.uniform(1, 2)))
    assert "too small on every draw of this check" in told(item, "return 1.0 + x * 0.3 * np.cos(std) ** 2")


def test_what_is_small_on_the_few_draws_of_a_check_alone_is_not_said_to_be():
    item = exercise(lambda x, std: float(np.exp(x) + std), lambda rng: (rng.uniform(1, 3), rng.uniform(1, 2)))
    text = told(item, "return 1.0 + x * 0.3 * np.cos(std) ** 2 + 100 * (x > 2.7 and std > 1.5)")
    assert text.startswith("it is off by ") and "on every draw" not in text


def test_a_vector_and_a_number_that_are_both_wrong_are_compared_apart():
    two = metrics.Several(metrics.Numbers(), metrics.Numbers(), names=("place", "radius"))
    item = Exercise(
        "walk",
        reference=lambda x: (np.cos(x), float(x @ x)),
        draw=lambda rng: (rng.normal(size=3),),
        metric=two,
        hints=("a", "b", "c"),
    )
    outcome = item.judge(lambda x: (x**3 - np.sin(x), float(np.exp(x[0]) + x[1])), rng=np.random.default_rng(0))
    assert outcome.status == NOT_YET and "is off by" in outcome.text


def test_numpys_words_and_numbers_are_shown_as_one_types_them():
    assert short([np.str_("4.5"), np.int64(3)]) == "['4.5', 3]"
    assert short((np.str_("a"),)) == "('a',)"


LOOPS = {
    "x is changed": (
        "total = 0.0\nfor k in range(4):\n    x[k] += std\n    total += np.prod(x)\nreturn total",
        "`x` is changed in each round, and the next one finds it changed",
    ),
    "the first round ends it": (
        "for k in range(4):\n    if x[k] < 0:\n        return x[k] * std\n    else:\n        return std\n",
        "`return std`: this ends the loop in its first round; behind the loop it is right",
    ),
    "entry by entry": ("M = np.outer(x, x) + np.eye(4)\nreturn (M * np.diag(x) * std)", "`*` stands where `@` belongs"),
    "a division that cuts": ("return 7 * std // 2 + x", "`//` stands where `/` belongs"),
}


def _one_at_a_time(x, std):
    return sum(float(np.prod(x + std * np.eye(4)[k])) for k in range(4))


def _first_negative(x, std):
    return float(next((v for v in x if v < 0), 1.0) * std)


RIGHT = (
    _one_at_a_time,
    _first_negative,
    lambda x, std: (np.outer(x, x) + np.eye(4)) @ np.diag(x) * std,
    lambda x, std: 3.5 * std + x,
)


@pytest.mark.parametrize("name, right", [*zip(LOOPS, RIGHT)])
def test_loops_that_keep_what_they_changed_and_loops_that_end_at_once(name, right):
    body, words = LOOPS[name]
    body = f"x = list(x)\n{body}" if "changed" in name else body
    text = "def formula(x, std):\n" + textwrap.indent(body, "    ") + "\n"
    linecache.cache[name] = (len(text), None, text.splitlines(True), name)
    known = {"np": np}
    exec(compile(text, name, "exec"), known)
    assert words in exercise(right, _draw).judge(known["formula"], rng=np.random.default_rng(0)).text


def test_the_pose_that_is_none_is_shown():
    T = np.tile(np.eye(4), (3, 1, 1))
    T[2] = 0
    with pytest.raises(metrics.Refused, match="got 0 0 0 0"):
        metrics.Poses().admit(T, T)


def test_no_angle_is_spoken_of_where_there_is_none():
    """A threshold that is a matter of scale: any smaller number would do, and degrees are none of it."""
    item = exercise(lambda x, std: int(np.argmin(x) if x.min() < 9 else 0), lambda rng: (rng.uniform(1, 8, 5), 1.0))
    item = dataclasses.replace(item, metric=metrics.Exactly())
    loop = "    for k in range(5):\n        if x[k] < best:\n            best, which = x[k], k\n"
    text = f"def formula(x, std):\n    best, which = 1.0, 0\n{loop}    return which\n"
    linecache.cache["choice"] = (len(text), None, text.splitlines(True), "choice")
    known = {}
    exec(compile(text, "choice", "exec"), known)
    told = item.judge(known["formula"], rng=np.random.default_rng(0)).text
    assert "radians" not in told and "half of it" not in told


TURN = exercise(lambda x, std: np.array([np.cos(x), 2.0]) * std, lambda rng: (rng.normal(), rng.uniform(1, 2)))


def test_a_result_without_a_number_and_one_that_is_always_the_same_are_not_those_of_other_arguments():
    nothing = told(TURN, "return np.array([np.nan, np.nan]) * x * std")
    assert "NaN" in nothing and "comes out" not in nothing and "right formula" not in nothing
    zero = exercise(lambda x, std: np.array([0.0, abs(x), std]), lambda rng: (rng.normal(), 1.0))
    assert told(zero, "return 0.0") == "expected an array of shape (3,), got a number."
    sizes = exercise(lambda x, std: np.arange(1.0, 3 + (x > 0)) * std, lambda rng: (rng.normal(), rng.uniform(1, 2)))
    zeros = told(sizes, "return np.zeros(2 + (x > 0)) * std")
    assert zeros == "your result is nothing but zeros, on every draw of this check."


def test_a_word_that_never_comes_out_is_told():
    words = exercise(lambda x, std: "abc"[int(x)], lambda rng: (rng.uniform(0, 3), rng.normal()), metrics.Exactly())
    said = told(dataclasses.replace(words, draws=30), "return 'aba'[int(x)]")
    assert said.startswith("`'c'` came out on no draw, though it is right on some. ")


def test_one_less_than_a_number_is_told_so_that_its_square_is_plain():
    few = [{"x": np.ones(n)} for n in (3, 4, 6)]
    expected = [np.array(float(n)) for n in (2, 7, 9)]
    results = [e * (len(d["x"]) - 1) ** 2 for e, d in zip(expected, few)]
    words = operands.operand_words(NUMBERS, results, expected, few)
    assert words.endswith("times the square of one less than the number of entries of `x`")


def test_the_last_of_several_rows_is_told_however_many_there_are_and_a_name_keeps_its_letter():
    draws = tuple(lambda rng, n=n: (rng.normal(size=(n, 2)),) for n in (2, 5, 4))
    metric = metrics.Several(NUMBERS, NUMBERS, names=("x", "y"))
    item = Exercise("ends", lambda v: (v[-1] * 2, v.sum()), draw=draws, metric=metric, hints=("a", "b", "c"))
    text = item.judge(lambda v: (2 * v, v.sum())).text
    assert text.endswith(" x: the expected result is the last entry or row of what you return.")


def test_a_part_is_told_where_it_is_all_of_it_on_some_draws():
    draws = tuple(lambda rng, n=n: (rng.normal(size=n),) for n in (2, 5, 4))
    item = Exercise("whole", lambda v: np.exp(v) * v.sum(), draw=draws, metric=NUMBERS, hints=("a", "b", "c"))
    text = item.judge(lambda v: (np.exp(v) * v.sum())[:2]).text
    assert "What you return is the first 2 of the expected numbers or rows alone." in text


def test_an_argument_is_told_only_if_another_one_in_its_place_mends():
    """Where a is negative b is large: who is wrong for a large b hears nothing of the sign of a."""

    def draw(rng):
        side = rng.choice([-1.0, 1.0])
        return side * rng.uniform(1, 2), rng.uniform(1, 2) + (4 if side < 0 else 0)

    item = Exercise("sum", reference=np.add, draw=draw, metric=NUMBERS, hints=("a", "b", "c"), draws=6)
    said = [
        item.judge(answer, np.random.default_rng(0)).text
        for answer in (lambda a, b: a + b**1.0 + max(-a, 0), lambda a, b: a + b * (1 + 0.1 * (b > 4.5)))
    ]
    assert "exactly where `a` is negative" in said[0] and "`a`" not in said[1]
