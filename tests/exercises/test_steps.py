"""The general layer, steps: in which line of a student's own code it goes wrong, and in which way."""

import ast
import functools
import linecache
import re
import textwrap
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from labkit.chapters.ch04_optimization.exercises import CHAPTER as OPTIMIZATION
from labkit.exercises import budget, guard, metrics, mutation, rerun, session, steps
from labkit.exercises.budget import Budget
from labkit.exercises.engine import Exercise
from labkit.exercises.outcome import CORRECT, NOT_YET


def typed(body, name="formula", arguments="a, b"):
    """A function as a notebook has it: its lines can be read again."""
    text = f"def {name}({arguments}):\n" + textwrap.indent(textwrap.dedent(body).strip(), "    ") + "\n"
    file = f"<typed {hash(text)}>"
    linecache.cache[file] = (len(text), None, text.splitlines(True), file)
    known = {"np": np}
    exec(compile(text, file, "exec"), known)
    return known[name]


def reference(a, b):
    """Length of the part of b that is perpendicular to a, times the number of entries."""
    x = a / np.linalg.norm(a)
    return len(b) * np.linalg.norm(b - (b @ x) * x)


ITEM = Exercise(
    "formula",
    reference=reference,
    draw=lambda rng: (rng.normal(size=3), rng.normal(size=3)),
    metric=metrics.Numbers(1e-9),
    hints=("a", "b", "c"),
)


def told(body):
    outcome = ITEM.judge(typed(body), rng=np.random.default_rng(0))
    assert outcome.status == NOT_YET
    return outcome.text


RIGHT = """
x = a / np.linalg.norm(a)
n = len(b)
r = b - (b @ x) * x
total = 0.0
for k in range(n):
    total += r[k] ** 2
return n * np.sqrt(total)
"""


SUMMED_IN_A_QUEUE = """
x = a / np.linalg.norm(a)
row = [v ** 3 for v in b - (b @ x) * x]
while len(row) > 1:
    row = row[2:] + [row[0] + row[1]]
return len(b) * np.sqrt(row[0])
"""


def test_a_change_without_an_end_costs_its_share_and_hides_no_other(monkeypatch):
    monkeypatch.setattr(budget, "LOOKING", 6.0)
    assert "In line 3, `3`: 3 stands where 2 belongs. With this alone changed" in told(SUMMED_IN_A_QUEUE)


def test_what_is_right_stays_right():
    assert ITEM.judge(typed(RIGHT)).status == CORRECT


@pytest.mark.parametrize(
    "right, wrong, said",
    [
        ("b - (b", "b + (b", "in line 4, `b + (b @ x) * x`: plus stands where minus belongs."),
        ("a / np", "b / np", "in line 2, `b`: `a` belongs in its place."),
        ("range(n)", "range(n - 1)", "in line 6, `n - 1`: the term `1` should be left out."),
        ("r[k] ** 2", "r[k]", f": its square belongs there. {steps.ALONE}."),
        ("total +=", "total =", "in line 7, `total = r[k] ** 2`: `=` throws away what was there before"),
        ("b @ x) * x", "b @ x)", "in line 4, `b @ x`: it is to be multiplied by `x`."),
        ("r[k] ** 2", "r[k] * 2", "n line 7, `r[k] * 2`: `*` stands where `**` belongs."),
        (
            "norm(a)",
            "norm(a, 1)",
            "in line 2, `np.linalg.norm(a, 1)`: the second argument of `norm` should be left out.",
        ),
        ("b - (b", "b - np.mean([0, 0, 1]) - (b", "`b - np.mean([0, 0, 1])`: the term `np.mean([0, 0, 1])` should be"),
        ("= 0.0", "= 1e-3", "in line 5, `1e-3`: 0.001 stands where 0 belongs."),
    ],
)
def test_the_line_and_the_slip_are_told(right, wrong, said):
    assert right in RIGHT
    assert said in told(RIGHT.replace(right, wrong))


@pytest.mark.parametrize(
    "body, said",
    [
        (
            """
            x = a / np.linalg.norm(a)
            q = (b - (b @ x) * x) @ (b - (b @ x) * x)
            root = q
            for _ in range(3):
                root = (root + q / root) / 2
            return len(b) * root
            """,
            "in line 5, `range(3)`: these are too few rounds",
        ),
        (
            """
            G = np.array([a, b]) @ np.array([a, b]).T
            w, V = np.linalg.eigh(G)
            return len(b) * w[0] * w[1] / np.linalg.norm(a)
            """,
            "in line 3, `w`: its root belongs there.",
        ),
        (
            """
            x = np.zeros_like(a)
            x[:] = a / np.linalg.norm(a)
            return len(b) * np.linalg.norm(b + (b @ x) * x)
            """,
            f"{steps.ALONE}, but not for whole numbers yet.",
        ),
        (
            """
            x = a / np.linalg.norm(a)
            r = b - (b @ x) * x
            if r[0] < 0.3:
                r = a - 2 * r
            return len(b) * np.linalg.norm(r)
            """,
            "in line 4, `if r[0] < 0.3:`: this statement should be left out.",
        ),
        (
            """
            x = a / np.linalg.norm(a)
            if np.isclose(max(len(b), 3), 6 / 2):
                return b[0]
            return len(b) * np.linalg.norm(b - (b @ x) * x)
            """,
            "in line 3, `if np.isclose(max(len(b), 3), 6 / 2):`: what stands under this condition should never happen.",
        ),
        (
            """
            T = np.eye(4)
            T[:3, 3] = a
            x = a / np.linalg.norm(a)
            return len(b) * np.linalg.norm(b - (b @ x) * x + T[:3, 3])
            """,
            "in line 5, `b - (b @ x) * x + T[:3, 3]`: the term `T[:3, 3]` should be left out.",
        ),
        (
            """
            x = (9 * a).astype(int)
            x = x / np.linalg.norm(x)
            return len(b) * np.linalg.norm(b - (b @ x) * x)
            """,
            "in line 2, `(9 * a).astype(int)`: `astype` is to be left out, so that `9 * a` stands alone.",
        ),
        (
            """
            total = 7.3
            total += len(b) * np.linalg.norm(b - (b @ a) / (a @ a) * a)
            return total
            """,
            "`+=` keeps what was there before, which does not belong to the result: `=`.",
        ),
        (
            """
            total = len(b) * np.linalg.norm(b - (b @ a) / (a @ a) * a)
            if a[0] < 0:
                total = -total
            return total
            """,
            "in line 3, `if a[0] < 0:`: what stands under this condition should never happen.",
        ),
        (
            """
            D = np.diag(a) - np.eye(3)
            return len(b) * np.linalg.norm(b - (b @ a) / (a @ a) * a) + np.trace(D) - a.sum() + 1
            """,
            "in line 2, `np.eye(3)`: its entry 0 (counted from 0, along the last axis) has the wrong sign.",
        ),
    ],
)
def test_what_is_blamed_is_what_a_student_can_change(body, said):
    assert said in told(body)


def test_a_weight_that_nothing_is_to_be_multiplied_by_is_told_whole():
    body = """
        x = a / np.linalg.norm(a)
        r = b - (b @ x) * x
        w = 1 / (1 + (a - a.mean()) ** 2)
        return len(b) * np.linalg.norm(w * r)
    """
    said = "in line 4, `w = 1 / (1 + (a - a.mean()) ** 2)`: with 1 everywhere on the right side, your result is right"
    assert said in told(body)


def test_a_mask_that_leaves_nothing_out_is_true_everywhere():
    item = replace(ITEM, reference=lambda a, b: a * b)
    body = """
        kept = a**2 - b**2 > 0
        return a[kept] * b[kept]
    """
    text = item.judge(typed(body), rng=np.random.default_rng(0)).text
    assert "n line 2, `kept = a**2 - b**2 > 0`: with True everywhere on the right side, your result is right" in text


@pytest.mark.parametrize("put", ["np.ones(3)", "np.arange(3.0)"])
def test_a_part_too_many_of_what_is_put_together_is_named(put):
    """Zeros in its place mend the rank as well, and say nothing."""
    item = replace(ITEM, reference=lambda a, b: np.linalg.pinv(np.column_stack([a, b])).sum())
    body = f"""
        m = np.column_stack([{put}, a, b])
        return np.linalg.pinv(m).sum()
    """
    text = item.judge(typed(body), rng=np.random.default_rng(0)).text
    assert f"in line 2, `[{put}, a, b]`: the part `{put}` should be left out." in text


def test_no_change_is_told_that_spoils_an_argument():
    item = replace(ITEM, reference=lambda a, b: np.cumsum(b) + a[0])
    body = """
        p = b.copy()
        for k in range(1, 3):
            p[k] = b[k] + b[k - 1]
        return p + a[0]
    """
    outcome = item.judge(typed(body), rng=np.random.default_rng(0))
    assert outcome.status == NOT_YET and "`copy` is to be left out" not in outcome.text


def test_data_of_the_notebook_are_told_where_an_argument_belongs():
    formula = typed("x = a / np.linalg.norm(a)\nreturn len(b) * np.linalg.norm(b - (b @ x) * box.kept)")
    formula.__globals__["box"] = ModuleType("box")
    formula.__globals__["box"].kept = np.array([0.6, 0.8, 0.0])
    item = replace(ITEM, reference=lambda a, b: len(b) * np.linalg.norm(b - (b @ a) / np.linalg.norm(a) * a))
    outcome = item.judge(formula, rng=np.random.default_rng(0))
    assert "in line 3, `box.kept`: `box.kept` stands where `a` belongs." in outcome.text


def test_what_the_notebook_holds_is_told_wherever_it_stands_for_an_argument():
    formula = typed("return np.sin(box.kept) * b + np.cos(a) * box.kept ** 2")
    formula.__globals__["box"] = ModuleType("box")
    formula.__globals__["box"].kept = np.array([0.6, 0.8, 0.0])
    item = replace(ITEM, reference=lambda a, b: np.sin(a) * b + np.cos(a) * a**2)
    outcome = item.judge(formula, rng=np.random.default_rng(0))
    assert "`box.kept` stands where `a` belongs, and the same in `box.kept` (line 2)" in outcome.text


@pytest.mark.parametrize(
    "right, body, said",
    [
        (
            lambda rows: rows - rows.mean(axis=0),
            "return rows - rows.mean()",
            "in line 2, `rows.mean()`: this takes all numbers together, and `axis=0` belongs there.",
        ),
        (
            lambda rows: np.outer(rows[0], rows[0]) - np.eye(3) / rows[1, 2],
            "d = rows[0]\nreturn d * d - np.eye(3) / rows[1, 2]",
            "in line 3, `d * d`: `np.outer` makes a matrix of it, and belongs there.",
        ),
        (
            lambda rows: np.where(rows[0] > 0.3, rows[0] ** 3, 0.0),
            """
            w = np.zeros(3)
            for k in range(3):
                if rows[0, k] <= 0.3:
                    break
                w[k] = rows[0, k] ** 3
            return w
            """,
            "in line 5, `break`: the rounds behind it are left out, and `continue` belongs there.",
        ),
        (
            lambda rows: sum(np.sqrt(1.0 + row @ row) for row in rows),
            """
            total, q = 0.0, 1.0
            for row in rows:
                q += row @ row
                total += np.sqrt(q)
            return total
            """,
            "in line 3, `for row in rows:`: `q` is changed in each round, and the next one finds it changed: each",
        ),
        (
            lambda rows: float(np.abs(rows[:, 0] * rows[:, 1]).max()),
            """
            most = 0.0
            for row in rows:
                most += abs(row[0] * row[1])
            return most
            """,
            "in line 4, `most += abs(row[0] * row[1])`: all are added up here, and the largest belongs there.",
        ),
    ],
)
def test_an_axis_an_outer_product_and_what_a_loop_leaves_out_are_told(right, body, said):
    def draw(rng):
        return (rng.normal(size=(4, 3)),)

    item = replace(ITEM, id="rows", reference=right, draw=draw)
    outcome = item.judge(typed(body, "rows_made", "rows"), rng=np.random.default_rng(0))
    assert outcome.text.startswith(said)


def test_no_line_is_blamed_when_no_single_change_mends():
    assert "in line" not in told("return np.sin(a).sum() * 0.1 + np.exp(b[0]) - 3.3 * a[1] ** 5")


def test_a_change_without_an_end_is_given_up():
    body = """
    x = a / np.linalg.norm(a)
    left, n = 3.0, 0
    while left > 0.5:
        left -= 1.0
        n += 1
    return n + np.linalg.norm(b - (b @ x) * x)
    """
    assert "plus stands where `*` belongs" in told(body)


def test_running_again_leaves_arguments_globals_and_the_function_alone():
    function = typed("a[0] = 7.0\nc = a + b\nreturn c * 2")
    written, known = rerun.written(function), dict(function.__globals__)
    a, b = np.zeros(3), np.ones(3)
    traced = written.trace((a, b), 1.0)
    assert not a.any() and function.__globals__ == known
    values = {name: found for (_, _, name, *_), (count, found) in zip(written.places, traced) if count}
    assert np.array_equal(values["c"], [[8.0, 1.0, 1.0]])
    assert written.results([("code", 0)], (a, b), 1.0, lambda found: found is not None) in ([True], [False])
    assert not a.any()


@pytest.mark.parametrize(
    "function",
    [lambda a: a, np.sin, typed("return eval('a')"), typed("global c\nc = 1\nreturn a"), typed("open(a)"), len, 3],
)
def test_what_cannot_be_read_again_is_left_alone(function):
    assert rerun.written(function) is None


def test_a_cell_that_imports_what_its_function_calls_is_read_again():
    lines = (
        "import math",
        "def formula(a, b):",
        "    x = a / math.sqrt(a @ b)",
        "    return 3 * np.linalg.norm(b - (b @ x) * x)",
    )
    positive = replace(ITEM, draw=lambda rng: (rng.uniform(1, 2, 3), rng.uniform(1, 2, 3)))
    said = positive.judge(of_cell(*lines)["formula"], rng=np.random.default_rng(0)).text
    assert said.startswith("in line 3, ")


def of_cell(*lines):
    """What a cell of these lines defines."""
    cell = "\n".join(lines) + "\n"
    file = f"<cell {hash(cell)}>"
    linecache.cache[file] = (len(cell), None, cell.splitlines(True), file)
    known = {"np": np}
    exec(compile(cell, file, "exec"), known)
    return known


HELPED = (
    "def unit(v, least=0.0):",
    "    return v / max(np.sqrt(squares(v)), least)",
    "def squares(v):",
    "    return np.sum(v * v)",
    "def formula(a, b):",
    "    x = unit(a)",
    "    return len(b) * np.linalg.norm(b - (b @ x) * x)",
)


@pytest.mark.parametrize(
    "right, wrong, said",
    [
        ("np.sum(v * v)", "np.mean(v * v)", "in line 4, `np.mean(v * v)`: `mean` stands where `sum` belongs."),
        ("np.sqrt(squares(v))", "squares(v)", "in line 2, `squares(v)`: its root belongs there."),
    ],
)
def test_what_is_wrong_in_a_function_beside_the_answer_is_told_there(right, wrong, said):
    assert ITEM.judge(of_cell(*HELPED)["formula"]).status == CORRECT
    wrong = of_cell(*(line.replace(right, wrong) for line in HELPED))["formula"]
    assert ITEM.judge(wrong, rng=np.random.default_rng(0)).text.startswith(said)


def sines(a, b):
    return np.sin(a[0]) * np.sin(b[0]) + np.sin(a[1])


def test_a_slip_that_is_made_wherever_a_line_is_copied_is_told_once():
    item = replace(ITEM, reference=sines)
    said = item.judge(typed("return np.cos(a[0]) * np.cos(b[0]) + np.sin(a[1])"), rng=np.random.default_rng(0)).text
    assert said.startswith(
        "in line 2, `np.cos(a[0])`: `cos` stands where `sin` belongs, and the same in `np.cos(b[0])`"
    )


def test_an_index_that_a_loop_should_count_is_told():
    body = """
    total = 0.0
    for k in range(3):
        total += a[k] * b[0]
    return total
    """
    said = replace(ITEM, reference=lambda a, b: float(a @ b)).judge(typed(body), rng=np.random.default_rng(0)).text
    assert said.startswith("in line 4, `0`: 0 stands where `k` belongs.")


def test_what_is_to_be_done_with_an_argument_that_is_read_twice_is_told():
    item = replace(ITEM, reference=lambda a, b: (b @ a / np.linalg.norm(a)) ** 2 + b[0] * a[1] / np.linalg.norm(a))
    said = item.judge(typed("c = a @ b\nreturn c * (a @ b) + b[0] * a[1]"), rng=np.random.default_rng(0)).text
    assert said.startswith("wherever you read `a`: it is to be divided by its length.")


def test_an_argument_of_which_the_right_result_is_independent_is_told():
    """`u, v = 1` would raise: an array of ones is what mends it."""
    item = replace(ITEM, reference=lambda a, b: b[0])
    said = item.judge(typed("u, v, w = a\nreturn b[0] * (u + a[1] + w) / 3"), rng=np.random.default_rng(0)).text
    assert said.startswith(f"with ones in the place of `a` wherever you read it, {steps.RIGHT}:")


def test_a_list_that_is_repeated_is_told():
    item = replace(ITEM, reference=lambda a, b: 10 * a)
    said = item.judge(typed("c = list(a)\nreturn c * 10"), rng=np.random.default_rng(0)).text
    assert "`c * 10`: this repeats a list or tuple, and `np.array(c) * 10` belongs there." in said


def test_the_condition_that_was_met_where_it_is_wrong_is_told():
    body = """
    best = 0.0
    for k in range(3):
        if a[k] * b[k] > 0.5:
            return a[k] * b[k]
        best = max(best, a[k] * b[k])
    return best
    """
    item = replace(ITEM, reference=lambda a, b: max(0.0, (a * b).max()) + (((a * b) > 0.5).any() and 0.1 * a[0] ** 2))
    said = item.judge(typed(body), rng=np.random.default_rng(0)).text
    assert "draws it was wrong exactly where `a[k] * b[k] > 0.5` (line 4) was true in some round" in said


def test_a_step_is_the_second_entry_less_the_first():
    item = replace(
        ITEM,
        draw=lambda rng: (rng.uniform(3, 5) + 0.2 * np.arange(9), rng.normal(size=9)),
        reference=lambda a, b: (a[1] - a[0]) * b.sum(),
    )
    said = item.judge(typed("h, n = a[1], len(a)\nreturn h * sum(b[:n])"), rng=np.random.default_rng(0)).text
    assert f"in line 2, `a[1]`: `a[0]` is to be subtracted. {steps.ALONE}." in said


def test_a_result_that_never_changes_is_told():
    said = ITEM.judge(typed("return 3.7"), rng=np.random.default_rng(0)).text
    assert "your function never uses `a`" in said
    assert "your function uses only the size of `b`, and" in told("return len(b) * a.sum() + np.zeros_like(b)[0]")
    item = replace(ITEM, draw=lambda rng: ({"a": rng.normal()}, {"b": 1.0}), reference=lambda a, b: a["a"])
    said = item.judge(typed("return 3.7 + 0 * len(a) * len(b)"), rng=np.random.default_rng(0)).text
    assert "Your result is the same on every draw" in said


def test_of_a_step_that_binds_several_names_one_is_meant():
    search = steps.search(typed("w, s = b[0], b[1]\nreturn w * s"), ["a", "b"], _cases(), None, Budget(1.0))
    bound = [k for k, (_, code, name, *_) in enumerate(search.written.places) if name and "=" in code]
    assert [search._meant(k) for k in bound] == ["w", "s"]


def _cases():
    rng = np.random.default_rng(0)
    draws = [(rng.normal(size=3), rng.normal(size=3)) for _ in range(4)]
    return [steps.Case(args, ITEM.metric, 1.0, 2.0) for args in draws]


def test_values_in_place_of_others_keep_their_kind():
    assert rerun._like(3, 4.0) == 4 and type(rerun._like(3, 4.0)) is int
    assert rerun._like(True, 0.0) is False
    assert rerun._like(np.array([1, 2]), np.array([2.0, 1.0])).dtype.kind == "i"
    assert rerun._like([1.0, 2.0], np.ones(2)) == [1.0, 1.0]
    assert all(type(v) is int for v in rerun._like([1, 2], np.array([-1.0, -2.0]))), "no list of floats by a sign"


def told_of(id, body, arguments):
    item = next(c for c in session.chapters() if c.name == "01-frames")[id]
    return item.judge(typed(body, id, arguments), rng=np.random.default_rng(0)).text


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("c, s = np.sqrt(1 - np.sin(a) ** 2), np.sin(a)", "a root is never negative, and `np.cos(a)` belongs there"),
        ("s = np.sin(a)\nc = np.sqrt(1 - s * s)", "a root is never negative, and `np.cos(a)` belongs there"),
        ("c, s = np.cos(a), -1\ns = np.sqrt(1.0 - c**2)", "a root is never negative, and `np.sin(a)` belongs there"),
    ],
)
def test_a_sign_that_a_root_has_lost_is_told(body, told):
    item = asked(lambda a, b: np.cos(a) * b + 2 * np.sin(a), lambda rng: tuple(rng.uniform(-6, 6, (2, 4))))
    assert told in judged(item, f"{body}\nreturn c * b + 2 * s")


def test_a_change_that_spoils_another_part_is_no_advice():
    """A translation in place of the rotation, say, where by chance the origin comes out right."""
    turned = np.diag([1.0, -1, -1, 1])
    far, near = np.eye(4), np.eye(4)
    far[:3, 3], near[:3, 3] = 5.0, 1e-3
    case = steps.Case((), metrics.Poses(1e-6, 1e-6), np.eye(4), near)
    assert case.is_farther(far) and case.is_farther(turned) and not case.is_farther(near + 0.5 * (near - np.eye(4)))


def test_the_value_that_is_not_right_is_found_by_that_of_the_solution():
    body = "x = a / np.linalg.norm(a)\nz = np.cross(x, b)\nz = z / np.linalg.norm(z)\n"
    said = told_of("gram_schmidt", f"{body}return np.column_stack([x, b / np.linalg.norm(b), z])", "a, b")
    assert "in line 5, `b / np.linalg.norm(b)`: this value is not right" in said


def test_a_wrong_value_is_told_where_it_is_bound_not_where_it_is_read():
    item = next(c for c in session.chapters() if c.name == "05-hand-eye")["robust_weights"]
    body = """
        length = np.abs(residuals).max(axis=1)
        u = length / (5 * np.median(length) / 1.538)
        return np.where(u < 1, (1 - u**2) ** 2, 0)
    """
    said = item.judge(typed(body, "robust_weights", "residuals"), rng=np.random.default_rng(0)).text
    assert "in line 2, `length = np.abs(residuals).max(axis=1)`: this value is not right" in said
    assert "perhaps because of" not in said


def test_a_wrong_value_may_be_wrong_for_one_that_goes_into_it():
    item = next(c for c in session.chapters() if c.name == "09-monte-carlo")["landmark_weight"]
    body = """
        seen = ((landmarks - pose[:2]) @ [1, 1j]) * np.exp2(-1j * pose[2])
        turn = np.angle(np.exp(1j * z[:, 1]) * np.conj(seen))
        e = ((z[:, 0] - np.abs(seen)) / std_range) ** 2 + (turn / std_bearing) ** 2
        return np.sum(-0.5 * e - np.log(2 * np.pi * std_range * std_bearing))
    """
    wrong = typed(body, "landmark_weight", "pose, z, landmarks, std_range, std_bearing")
    said = item.judge(wrong, rng=np.random.default_rng(0)).text
    assert "in line 3, `turn = " in said and "this value is not right, perhaps because of `seen` in it." in said


def test_a_wrong_value_may_be_wrong_for_an_argument_that_is_bound_anew():
    body = "T_WA = np.abs(T_WA)\nT_WB = np.abs(2 * T_WB)\nT = np.linalg.solve(T_WA, T_WB)\nreturn T"
    said = told_of("relative", body, "T_WA, T_WB")
    solved = "`T = np.linalg.solve(T_WA, T_WB)`: this value is not right"
    assert f"{solved}, perhaps because of `T_WA` or `T_WB` in it." in said


def test_a_loop_that_takes_the_rows_of_the_solutions_array_one_by_one_is_compared_with_them():
    item = next(c for c in session.chapters() if c.name == "07-dead-reckoning")["lateration_residual"]
    cell = of_cell(
        "def square(a, b):",
        "    return sum(abs(p - q) for p, q in zip(a, b)) ** 2",
        "def lateration_residual(landmarks, distances, position):",
        "    return np.array([square(a, position) - d ** 2 for a, d in zip(landmarks, distances)])",
    )
    said = item.judge(cell["lateration_residual"], rng=np.random.default_rng(0)).text
    assert said.startswith("in line 4, `square(a, position)`: this value is not right")


def test_of_two_slips_the_first_is_told_with_what_is_left():
    said = told_of(
        "invert", "R = T[:3, :3]\nout = T.copy()\nout[:3, :3] = R.T\nout[:3, 3] = T[:3, 3] @ R.T\nreturn out", "T"
    )
    assert (
        "`T[:3, 3] @ R.T`: perhaps the factors of one product `@` are exchanged. With this changed, the rotation"
        in said
    )


def test_what_raises_is_told_with_the_change_that_mends_it():
    outcome = ITEM.judge(typed(RIGHT.replace("range(n)", "range(n + 1)")), rng=np.random.default_rng(0))
    assert outcome.text.startswith("IndexError") and "line 6, `n + 1`: the term `1` should be left out." in outcome.text


def test_how_two_values_differ():
    mine, theirs = [np.ones((1, 2, 3))] * 2, [-np.ones((1, 2, 3))] * 2
    assert "right up to its sign" in steps.value_relation(mine, theirs, [{"a": 1.0}] * 2)


@pytest.mark.parametrize(("shape", "right"), [((3, 2, 2), 1), ((3, 2), 1), ((3,), 1), ((4, 2), 2)])
def test_rounds_are_no_rows(shape, right):
    """Of a value that has several, the first axis counts the rounds."""
    rng = np.random.default_rng(0)
    theirs = [rng.normal(size=shape) for _ in range(2)]
    mine = [np.concatenate([t[:right], rng.normal(size=t[right:].shape)]) for t in theirs]
    told = steps.value_relation(mine, theirs, [{"a": 1.0}] * 2)
    assert "right" in told and "round" in told and "row" not in told


def judged(item, body, arguments="a, b"):
    outcome = item.judge(typed(body, item.id, arguments), rng=np.random.default_rng(0))
    assert outcome.status == NOT_YET
    return outcome.text


def asked(reference, draw, **more):
    exact = metrics.Numbers(1e-9)
    return Exercise("formula", reference=reference, draw=draw, metric=exact, hints=("a", "b", "c"), **more)


def two_numbers(rng):
    return float(rng.uniform(1, 2)), float(rng.uniform(1, 2))


def test_a_change_that_fails_a_property_or_a_special_draw_mends_nothing():
    def at_zero(function, rng):
        return None if np.isfinite(function(1.0, 0.0)) else "at 0 it fails"

    body = """
    if b < 1.5:
        return a - b * b / 6
    return a * np.sin(b) / b
    """

    def right(a, b):
        return a * np.sinc(b / np.pi)

    def draw(rng):
        return float(rng.uniform(1, 2)), float(rng.uniform(0.2, 1.4))

    assert steps.ALONE in judged(asked(right, draw), body)
    assert steps.ALONE not in judged(asked(right, draw, properties=(at_zero,)), body)
    special = (lambda rng: (1.0, 0.0), metrics.Numbers(1e-9), "at 0")
    assert steps.ALONE not in judged(asked(right, draw, noisy=special), body)


def test_a_neutral_operation_is_told_as_a_term_too_many():
    body = """
    one = len("x")
    return a + one
    """
    text = judged(asked(lambda a, b: a, two_numbers), body)
    assert "the term `one` should be left out" in text and "stands where" not in text


def test_an_array_of_integers_is_named_as_such():
    def right(a, b):
        return np.array([a, b, 1.0])

    body = """
    found = np.array([0, 0, 1])
    found[0] = a
    found[1] = b
    return found
    """
    assert "`[0, 0, 1]`: an array made of this is one of integers" in judged(asked(right, two_numbers), body)


@pytest.mark.parametrize(
    "body, said",
    [
        (
            "x = np.array([a, b]).astype(np.float32)\nreturn float(x[0] * (x[0] + 1))",
            "`float32` stands where `float64`",
        ),
        (
            "x = np.array([a, b])\ny = x\ny[0] += 1\nreturn x[0] * y[0]",
            "`y` is no copy of `x`, but another name for it",
        ),
        ("x = np.array([[a, b]])\ny = x[0]\ny[0] += 1\nreturn x[0, 0] * y[0]", "`y` is no copy, but a part of `x`"),
    ],
)
def test_a_copy_that_is_none_and_too_few_digits_are_told(body, said):
    assert said in judged(asked(lambda a, b: a * (a + 1.0), two_numbers), body)


@pytest.mark.parametrize("fill", ["total += b[k] * a", "total[:] = total + b[k] * a"])
def test_an_array_that_is_kept_and_then_filled_on_is_told_to_be_copied(fill):
    """Its value is right where it is kept: any other in its place would mend for being another array."""
    item = asked(lambda a, b: np.cumsum(np.outer(b, a), axis=0), two_vectors)
    body = (
        f"kept, total = [], np.zeros(3)\nfor k in range(3):\n    {fill}\n    kept.append(total)\nreturn np.array(kept)"
    )
    text = "in line 5, `total`: a copy belongs there, as the array itself is changed later on. With this alone"
    assert judged(item, body).startswith(text)


def test_an_array_of_whole_numbers_alone_is_told():
    body = "x = np.array([n for n in (a, b)])\nx[0] = x[0] + 0.5\nreturn x[0] * x[1]"
    item = asked(lambda a, b: (a + 0.5) * b, lambda rng: (int(rng.integers(1, 9)), int(rng.integers(1, 9))))
    assert "`dtype=float` is missing" in judged(item, body)


def test_no_line_that_fills_a_part_is_blamed_for_the_whole():
    def right(a, b):
        return np.linalg.norm([a, b, np.hypot(a, b)])

    body = """
    found = np.zeros(3)
    found[0] = np.exp(a) - 7
    found[1] = np.tan(b) * 3
    found[2] = a - 5 * b
    return np.linalg.norm(found)
    """
    assert "in line 5" not in judged(asked(right, two_numbers), body)


def test_what_is_to_be_done_to_values_with_commas_alone_around_them_is_to_be_done_to_each():
    """It would be typed behind the last of them."""

    def right(a, b, c):
        return (a * c - np.exp(b * c)) / c

    def draw(rng):
        return tuple(rng.uniform(1, 2, 3))

    text = judged(asked(right, draw), "p, q = a, b\nreturn (p - np.exp(q)) / c", "a, b, c")
    assert "in line 2, `a, b`: each of them is to be multiplied by `c`." in text


def solved_by(monkeypatch, text):
    """The function of this text, which is the solution of each exercise from here on."""
    known = {"np": np}
    exec(text, known)
    tree = steps.slips.ast.parse(text).body[0]
    guard.PRISTINE.look()
    kept = guard.PRISTINE.saved["labkit.exercises.slips"][1]
    monkeypatch.delitem(kept, "solved")  # else the one of the library would be put back
    monkeypatch.setattr(steps.slips, "solved", lambda exercise: (known["formula"], tree))
    return known["formula"]


def test_an_entry_that_is_bound_is_not_taken_for_a_right_step(monkeypatch):
    text = "def formula(a, b):\n    d = b[2] - b[0]\n    return a * np.sin(d) + b[0] * b[1]\n"
    reference = solved_by(monkeypatch, text)
    said = judged(asked(reference, far_apart), "d, e = b[2], b[1]\nreturn a * np.sin(d) + b[0] * e")
    assert "in line 2, `d`" in said


def far_apart(rng):
    return rng.normal(size=3), rng.normal(size=3) + [0.0, 3.0, 0.0]


def test_no_end_of_a_range_is_changed_for_its_exponential():
    changed = dict(rerun.OTHERWISE)["its exponential belongs there"]
    assert changed(np.array(2.0)) == np.exp(2.0) and np.all(np.isfinite(changed(np.array([18.0, 19.0]))))
    with pytest.raises(ValueError, match="too long"):
        changed(np.array(18.0))


def test_of_more_rows_than_rounds_are_kept_the_first_are_compared():
    assert len(steps._as_kept(np.zeros((20, 3)), rerun.ROUNDS)) == rerun.ROUNDS
    assert len(steps._as_kept(np.zeros((20, 3)), 5)) == 20 and steps._as_kept(np.array(1.0), 16) == 1.0


@pytest.mark.parametrize(
    "body",
    [
        "x = a * b\nx[1:] = np.sinh(b[:2])\ny = np.tan(x) - 3 * a\nreturn y[0] ** 3 + x[1] * y[2]",
        "x = a * b\nif x[0] > 0:\n    x = np.sinh(b)\ny = np.tan(x) - 3 * a\nreturn y[0] ** 3 + y[2]",
    ],
    ids=["further down", "on some draws"],
)
def test_what_is_changed_or_bound_again_is_not_called_right(monkeypatch, body):
    reference = solved_by(monkeypatch, "def formula(a, b):\n    x = a * b\n    y = np.exp(x)\n    return y[0] + x[1]\n")
    for other in ("words", "partly_words", "given_words"):
        monkeypatch.setattr(steps.Search, other, lambda self, *of: None)
    assert "`x`" not in judged(asked(reference, lambda rng: tuple(rng.normal(size=(2, 3)))), body)


def test_the_result_in_another_shape_is_not_blamed(monkeypatch):
    """That its numbers are wrong is known already."""
    reference = solved_by(monkeypatch, "def formula(a, b):\n    x = np.exp(a)[:, None]\n    return x[:, 0]\n")
    for other in ("words", "partly_words"):
        monkeypatch.setattr(steps.Search, other, lambda self, *of: None)
    body = "rows = np.sin(a + b)[:, None]\nreturn np.hstack(rows)"
    told = judged(asked(reference, lambda rng: tuple(rng.uniform(1, 2, size=(2, 3)))), body)
    assert "With the right value there" not in told


@pytest.mark.parametrize(
    "body, lines",
    [
        ("v = a\nw = 2\nreturn solve(lambda v: v, v, tol=1e-3)", {2, 4}),
        ("g = lambda v: v\nreturn solve(\n    g,\n    [0, 1])", {5}),
        ("return list(map(lambda k: k, range(3)))", set()),
        ("return solve(a, b)", set()),
    ],
)
def test_lines_in_which_stands_where_a_search_begins(body, lines):
    assert rerun.written(typed(body)).searched == lines


@pytest.mark.parametrize(
    "body, other",
    [
        ("from scipy.optimize import fsolve\nreturn fsolve(lambda v: v**3 - a, np.zeros(1))[0]", "ones"),
        ("from scipy.optimize import fsolve\nv = np.zeros(1)\nreturn fsolve(lambda v: v**3 - a, v)[0]", "ones"),
        ("return np.cbrt(a) * np.trace(np.diag([a, b])) / 2", "ones of its shape"),
    ],
    ids=["start", "start that is bound", "as good as no factor"],
)
def test_another_start_mends_by_luck_and_no_weights_stand_alone_in_a_call(body, other):
    item = replace(asked(lambda a, b: np.cbrt(a), two_numbers), metric=metrics.Numbers(1e-6))
    assert other not in judged(item, body)


def test_a_number_that_cancels_is_not_what_belongs():
    changes = mutation.mending(ast.parse("def f(a, b):\n    return g(a / 2, b / 2)").body[0])
    assert not [c.mends for c in changes if "minus belongs, and the same" in c.mends]
    assert [c.mends for c in changes if "should be left out, and the same" in c.mends]


@pytest.mark.parametrize(
    "body, told",
    [
        (
            "h = 1e-11\nreturn (np.sin(a + h) - np.sin(a - h)) / (2 * h)",
            "in line 2, `1e-11`: rounding shows where a step",
        ),
        (
            "h = 1e-12\nfor e in h * np.eye(1)[0]:\n    s = (np.sin(a + e) - np.sin(a - e)) / (2 * h)\nreturn s",
            "in line 2, `1e-12`: rounding shows where a step is as short as this: 1e-06 will do",
        ),
        (
            "return (np.sin(a + 1e-13) - np.sin(a)) / 1e-13",
            "with 1e-10 in its place the result comes nearer on every draw",
        ),
        ("return np.cos(a) + b * 1e-9 / (b + 1e-9)", ""),
    ],
)
def test_a_step_of_differences_may_be_too_short(body, told):
    item = replace(asked(lambda a, b: np.cos(a), two_numbers), metric=metrics.Numbers(1e-8))
    said = judged(item, body) if told else item.judge(typed(body)).text
    assert told in said and ("step" in said) == bool(told)


def unit_vector(rng):
    a = rng.normal(size=2)
    return a / np.linalg.norm(a), rng.uniform(0.5, 2.0)


FROM_X = replace(
    asked(lambda a, b: b * np.arccos(np.clip(a[0], -1, 1)), unit_vector),
    metric=metrics.Numbers(1e-6),
    noisy=(lambda rng: (np.array([1 + 2**-52, 0.0]), 1.0), metrics.Numbers(1e-6), "right, but not along x:"),
)


@pytest.mark.parametrize(
    "body, told",
    [
        ("return b * np.arccos(a[0])", "`np.arccos(a[0])`: what is put in comes out beyond -1 or 1, and `np.clip` to"),
        ("return b * np.arctan2(np.sqrt(1 - a[0] ** 2), a[0])", "comes out below 0, and `np.maximum` with 0 belongs"),
    ],
)
def test_what_rounding_brings_beyond_what_a_function_takes_is_told(body, told):
    said = judged(FROM_X, body)
    assert "the result is NaN. In line 2" in said.replace("holds", "is") and told in said


def test_what_cancels_is_not_told_where_rounding_alone_is_wrong(monkeypatch):
    monkeypatch.setattr(steps.Search, "code_words", lambda self, ranks: None)
    body = "c = a * 1.0\nif c[0] > 1:\n    return b * np.nan\nreturn b * np.arccos(c[0] / np.hypot(*c))"
    assert steps.ALONE not in judged(FROM_X, body) and metrics.NOT_FINITE in judged(FROM_X, body)
    monkeypatch.setattr(steps.Search, "_does_not_matter", lambda self, plan: False)
    assert "`a`: half of it belongs there" in judged(FROM_X, body)


def test_what_was_given_infinite_is_not_what_went_wrong():
    def impossible(rng):
        return np.array([-np.inf, *rng.normal(size=2)]), rng.normal()

    item = asked(lambda a, b: a.max() * b, (impossible, lambda rng: (rng.normal(size=3), rng.normal())))
    told = judged(item, "c = a * 1.0\nd = np.sqrt(c.max() - 90)\nreturn d * np.exp(b)")
    assert "The first value on the way that is not finite is `d = np.sqrt(c.max() - 90)` in line 3." in told


def test_a_condition_of_the_notebook_that_leaves_out_what_counts_is_to_be_true():
    formula = typed("seen = a < kept\nreturn np.sum(a[seen] * b[seen])")
    formula.__globals__["kept"] = 0.3
    item = asked(lambda a, b: np.sum(a * b), lambda rng: tuple(rng.normal(size=(2, 9))))
    told = item.judge(formula, rng=np.random.default_rng(0)).text
    assert told.startswith("in line 2, `seen = a < kept`: True belongs in the place of each of its entries.")


def test_numbers_do_not_stand_in_for_truth_values():
    for value in (True, np.array([True, False])):
        with pytest.raises(ValueError):
            rerun._like(value, np.array([0.3, 1.0]))


def test_data_of_the_notebook_are_looked_at_first(monkeypatch):
    text = "def formula(a, b):\n    x = a - b[0] ** 3\n    return np.exp(x) * b\n"
    reference = solved_by(monkeypatch, text)
    formula = typed("x = kept * 1.0\nreturn np.exp(x) * b")
    formula.__globals__["kept"] = np.array([0.3, 0.7, -0.2])
    item = asked(reference, lambda rng: tuple(rng.normal(size=(2, 3))))
    monkeypatch.setattr(steps.Search, "words", lambda self: None)  # the other search leaves no time for slow functions
    told = item.judge(formula, rng=np.random.default_rng(0)).text
    assert told.startswith("in line 2, `kept`: ") and "reads `kept` from the notebook" in told


def test_a_term_of_the_notebook_that_is_too_many_is_told_as_such(monkeypatch):
    reference = solved_by(monkeypatch, "def formula(a, b):\n    x = a - b**3\n    return np.exp(x) * b\n")
    formula = typed("x = a - b**3 - kept\nreturn np.exp(x) * b")
    formula.__globals__["kept"] = np.array([0.3, 0.7, -0.2])
    item = asked(reference, lambda rng: tuple(rng.normal(size=(2, 3))))
    told = item.judge(formula, rng=np.random.default_rng(0)).text
    assert (
        told.startswith("in line 2, `a - b**3 - kept`: the term `kept` should be left out.") and "reads `kept`" in told
    )


def _root(a, b):
    return np.sqrt(1 + a @ a)


def _up_to_above(a, b):
    """Entries of a that are not above 1, each with its place, and the largest of b."""
    return sum(k * v for k, v in enumerate(a) if v <= 1) + b.max()


@pytest.mark.parametrize(
    "reference, body, said",
    [
        (
            _up_to_above,
            "s = b.max()\nfor k, v in enumerate(a):\n    if v > 1:\n        break\n    s += k * v\nreturn s",
            "line 5, `break`: the rounds behind it are left out, and `continue` belongs there",
        ),
        (
            lambda a, b: sum(a[k] * b[j] ** k for j in range(3) for k in range(3)),
            "s = 0.0\nfor j in range(3):\n    for k in range(j, 3):\n        s += a[k] * b[j] ** k\nreturn s",
            "`range(j, 3)`: the loop begins at `j`, and belongs from 0 on",
        ),
        (
            lambda a, b: a * (np.sin((np.pi - b[0]) / 3) + b[1]),
            "return a * (np.sin((180 - b[0]) / 3) + b[1])",
            "`180`: 180 is typed in where `np.pi` belongs",
        ),
        (lambda a, b: a.sum() * b, "return a.sum() * 1.5", "`1.5`: 1.5 is typed in where `b` belongs"),
        (lambda a, b: a.sum() * b + b, "return 0.3 * a.sum() + b", "`0.3`: 0.3 is typed in where `b` belongs"),
        (
            lambda a, b: np.sum(a**2) / len(a) + np.exp(len(a) - b[0]),
            "return np.sum(a**2) / 7 + np.exp(7 - b[0])",
            "7 is typed in where `len(a)` belongs, here and where it stands again",
        ),
        (
            lambda a, b: np.sum(a**2) / len(a) + np.exp(len(a) - b[0]),
            "grown = np.exp(-(b[0] - 7))\nreturn np.sum(a**2) / 7 + grown",
            "in line 2, `7`: 7 is typed in",
        ),
    ],
)
def test_loops_and_numbers_that_are_typed_in_are_told(reference, body, said):
    def draw(rng):
        n = int(rng.integers(3, 6))
        return rng.uniform(0.5, 1.3, n), rng.normal(size=3)

    assert said in judged(asked(reference, draw), body)


def test_a_column_that_is_nought_with_its_indices_exchanged_is_told_as_a_term_too_many():
    body = "S, T = np.eye(4), np.eye(4)\nS[:3, 3], T[:3, 3] = b, a\nreturn (S[:3, 3] - T[:3, 3]) ** 3"
    text = judged(asked(lambda a, b: -(a**3), two_vectors), body)
    assert "`S[:3, 3] - T[:3, 3]`: the term `S[:3, 3]` should be left out." in text


@pytest.mark.parametrize(
    "weights", ["np.clip(a, -1, 1)", "np.maximum(a, 1e-9)", "np.clip((a - 1) / 2, 0, 1)", "np.maximum(a, 0)"]
)
def test_a_change_that_makes_weights_alike_is_not_told_as_the_slip(weights):
    body = f"w = {weights}\nreturn (w @ b) / w.sum()"
    text = judged(asked(lambda a, b: b.mean(), two_vectors), body)
    assert not re.search("exchanged|stands where|should be left out", text)


def test_a_sign_that_only_leads_to_a_bound_is_told_as_a_weight_that_is_not_needed():
    body = "w = 1 / np.maximum(np.abs(a), 1e-9)\nreturn (w @ b) / w.sum()"
    said = judged(asked(lambda a, b: b.mean(), two_vectors), body)
    assert f"with 1 everywhere in its place, {steps.RIGHT}, so perhaps it is not needed" in said


def test_a_sign_within_a_bound_is_told_as_a_bound_that_is_not_needed():
    body = "return b[0] * np.diag(np.maximum(1, np.abs(a)))"
    said = judged(
        asked(lambda a, b: b[0] * np.eye(len(a)), lambda rng: (rng.uniform(0.3, 3, 3), two_vectors(rng)[1])), body
    )
    assert f"`np.maximum(1, np.abs(a))`: with 1 everywhere in its place, {steps.RIGHT}" in said


@pytest.mark.parametrize(
    "reference, body, said",
    [
        (
            lambda a, b: np.diag(np.outer(a, b)) - 1,
            "M = np.outer(a, b)\nreturn M.sum(axis=1) - 1",
            "`M.sum(axis=1)`: sums stand where the diagonal belongs, `np.diag(M)`",
        ),
        (
            lambda a, b: np.outer(a, b) ** 3,
            "M = np.outer(a, b)\nreturn np.diag(np.diag(M)) ** 3",
            "`np.diag(np.diag(M))`: all but the diagonal is set to 0, and all of `M` belongs there",
        ),
        (
            lambda a, b: np.cos(b / a),
            "return np.cos(b / (a + 1e-3))",
            "`a + 1e-3`: the term `0.001` should be left out",
        ),
        (
            lambda a, b: np.where(np.round(a, 1) > 0.5, b, 0.0),
            "d = np.maximum(np.round(a, 1) - 0.5, 0)\nreturn b * d / (d + 5e-3)",
            "`0.005` is far too large: a millionth of it will do. With",
        ),
        (
            lambda a, b: np.cos(b),
            "if abs(a).min() < 0.4:\n    return 0 * b\nreturn np.cos(b)",
            "`0.4` is far too large: a millionth of it will do, if this case is needed at all. With",
        ),
        (np.arctan2, "c = b * 1.0\nreturn np.arctan(a, c)", "`arctan` stands where `arctan2` belongs"),
    ],
)
def test_diagonals_and_what_is_added_to_a_divisor_are_told(reference, body, said):
    item = replace(asked(reference, two_vectors), metric=metrics.Numbers(1e-6))
    assert said in judged(item, body)


def test_no_factor_is_told_for_what_only_counts():
    def draw(rng):
        return rng.normal(size=2), rng.normal(size=(int(rng.integers(3, 9)), 2))

    text = judged(asked(lambda a, b: np.cos(b.sum() / len(b)), draw), "return np.cos(b.sum() / len(a))")
    assert text.startswith("in line 2, `a`: `b` belongs in its place.")


@pytest.mark.parametrize("before, name", [("c, _ = np.cos(a), np.sqrt(b)", "`_` of line 2"), ("r = np.sqrt(b)", "`r`")])
def test_what_is_bound_to_another_value_is_told_by_the_right_side(before, name):
    """In the place of the whole line the name alone would bind nothing."""
    text = judged(
        asked(lambda a, b: b**1.5 + np.cos(b), two_numbers), f"{before}\ns = np.cos(a * b)\nreturn s**3 + np.cos(b)"
    )
    assert text.startswith(f"in line 3, `s = np.cos(a * b)`: {name} belongs on the right side. With this alone")


def test_an_argument_that_was_bound_anew_before_is_told_as_it_was_given():
    """By its name alone the changed one would be meant."""
    text = judged(asked(lambda a, b: np.cos(a) + b, two_numbers), "a = np.floor(a)\na = a + 3\nreturn np.cos(a) + b")
    assert text.startswith("in line 3, `a = a + 3`: `a` as it was given belongs on the right side. With this alone")


def test_the_sum_of_a_vector_is_not_that_of_its_rows():
    text = judged(asked(lambda a, b: np.exp(a.sum()) + b, two_vectors), "return np.exp(a) + b")
    assert "in line 2, `a`: its sum belongs there." in text


def two_vectors(rng):
    return rng.uniform(0.1, 0.9, 3), rng.normal(size=3)


@pytest.mark.parametrize(
    "reference, body, said",
    [
        (
            _root,
            "s = 1.0\nfor _ in range(2):\n    s = (s + (1 + a @ a) / s) / 2\nreturn s",
            "`range(2)`: these are too few",
        ),
        (
            _root,
            "s, t = 1.0, 9.0\nwhile abs(s - t) > 0.5:\n    s, t = (s + (1 + a @ a) / s) / 2, s\nreturn s",
            "line 3, `abs(s - t) > 0.5`: `0.5` is far too large",
        ),
        (
            lambda a, b: np.cos(a),
            "h = 0.3\nreturn (np.sin(a + h) - np.sin(a)) / h",
            "line 2, `h = 0.3`: `0.3` is far too",
        ),
    ],
)
def test_bounds_that_are_too_coarse_and_loops_that_end_too_early_are_told(reference, body, said):
    item = replace(ITEM, reference=reference, metric=metrics.Numbers(1e-6))
    outcome = item.judge(typed(body), rng=np.random.default_rng(0))
    assert outcome.status == NOT_YET and said in outcome.text


def test_nothing_computed_is_to_be_equal_to_a_number_with_decimals():
    outcome = ITEM.judge(typed(f"if abs(b[0]) < 0.5:\n    return 0.0\n{RIGHT.strip()}"), rng=np.random.default_rng(0))
    assert "`0.5` is far too large" in outcome.text


def _wrapped(a, b):
    return (a + np.pi) % (2 * np.pi) - np.pi


def _summed(a, b):
    return a @ a / len(b) + b[0]


def _clipped(a, b):
    return np.maximum(a, 0.0)


def several(rng):
    n = rng.integers(3, 9)
    return 3 * rng.normal(size=n), 2 + rng.normal(size=n)


@pytest.mark.parametrize(
    "reference, body, said",
    [
        (
            _wrapped,
            "return (a + 3.14) % 6.28 - 3.14",
            "in line 2, `3.14`: 3.14 and 6.28 are rounded: np.pi has all the digits.",
        ),
        (lambda a, b: b - a, "return np.maximum(b - a, 1 / len(b))", "/ len(b))`: `maximum` is to be left out"),
        (lambda a, b: np.exp(a), "return np.exp(np.minimum(2, a))", "`np.minimum(2, a)`: `minimum` is to be left out"),
        (lambda a, b: np.maximum(b, 0) + a, "return np.maximum(b, 1e-3) + a", "`1e-3`: 0.001 stands where 0 belongs"),
        (
            lambda a, b: np.outer(b, b) @ a,
            "M = np.multiply(b, b)\nreturn M @ a",
            "`multiply` stands where `outer` belongs",
        ),
        (_summed, "return a @ a / 30 + b[0]", "in line 2, `30`: 30 is typed in where `len(a)` belongs."),
        (
            _clipped,
            "return np.where(a < 0, 0.0, np.where(a > 2, 2.0, a))",
            "`np.where(a > 2, 2.0, a)`: `a` belongs there in all cases.",
        ),
        (
            _clipped,
            "c = np.maximum(a, 0)\nif c.min() >= 0:\n    c = c + 1\nreturn c",
            "`if c.min() >= 0:`: what stands under this condition should never happen.",
        ),
    ],
)
def test_rounded_numbers_typed_lengths_and_cases_that_are_none_are_told(reference, body, said):
    assert said in judged(asked(reference, several), body)


@pytest.mark.parametrize(
    "body, words",
    [
        ("t = 0.0\nwhile t < a:\n    t += 0.3\nreturn t", "are far too long: a hundredth of that will do"),
        ("t = np.arange(0, 9, 3 * 0.1)\nreturn t[t >= a][0]", "are far too long: a hundredth of that will do"),
        ("t = np.linspace(0, 3, 20)\nreturn t[t >= a][0]", "20 places are far too few: 600 will do"),
    ],
)
def test_steps_that_are_too_long_are_told(body, words):
    item = replace(asked(lambda a, b: a, lambda rng: rng.uniform(1, 2, 2)), metric=metrics.Numbers(0.01))
    assert words in judged(item, body)


def test_too_long_a_step_of_differences_is_told_wherever_it_stands():
    item = replace(asked(lambda a, b: 4 * a**3, two_numbers), metric=metrics.Numbers(1e-4))
    for body in ("return ((a + 0.1) ** 4 - a**4) / 0.1", "return ((a + 0.4) ** 4 - (a - 0.4) ** 4) / 0.8"):
        assert "is far too long a step for differences: a millionth of it will do" in judged(item, body)


def on_either_side(rng, side):
    return side * float(rng.uniform(1, 2)), side * float(rng.uniform(1, 2))


def test_what_a_number_bounds_can_have_the_wrong_sign_alone():
    """`h * b > 1e-8` would mend as well, since b has the sign of h."""
    sides = tuple(functools.partial(on_either_side, side=side) for side in (1, -1, 0))
    item = asked(lambda a, b: a + np.sinc(a / np.pi), sides)
    said = judged(item, "h = 1.0 * a\nreturn h + (np.sin(h) / h if h > 1e-8 else 1.0)")
    assert said.startswith("in line 3, `h` in `h > 1e-8`: its absolute value belongs there."), said


def chosen(rng):
    return rng.normal(size=(6, 3)), float(rng.uniform(0.5, 2.0))


@pytest.mark.parametrize(
    "body",
    [
        "best, which = 0.9, 0\nfor k in range(len(a)):\n    d = b * a[k] @ a[k]\n    if d < best:\n"
        "        best, which = d, k\nreturn which",
        "return int(np.argmin([np.abs(v).max() + v[0] for v in a]))",
    ],
)
def test_no_unit_or_factor_is_blamed_for_a_choice(body):
    item = asked(lambda a, b: int(np.argmin((a**2).sum(1))), chosen)
    said = judged(replace(item, metric=metrics.Exactly()), body)
    assert not re.search("radians|degrees|divided by|thousand|half of|special", said), said


def two_equations(rng):
    q, _ = np.linalg.qr(rng.normal(size=(2, 2)))
    return q @ np.diag(rng.uniform(1, 2, 2)) @ q.T + np.array([[0.0, 0.3], [0.0, 0.0]]), rng.normal(size=2)


SOLVED = asked(np.linalg.solve, two_equations)


@pytest.mark.parametrize(
    "body, told",
    [
        (
            "det = a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]\n"
            "return np.array([a[0, 0] * b[0] - a[0, 1] * b[1], a[1, 1] * b[1] - a[1, 0] * b[0]]) / det",
            "`a[0, 0]` and `a[1, 1]` have changed places in this step",
        ),
        (
            "(p, q), (r, s) = a\nu, v = b\ndet = p * s - q * r\nreturn np.array([p * u - q * v, s * v - r * u]) / det",
            "`p` and `s` have changed places in this step",
        ),
        (
            "return np.linalg.solve(a, int(1000 * b[0]) / 1000 * np.array([1, 0]) + b * np.array([0, 1]))",
            "`int` is to be left out",
        ),
        (
            "x = np.zeros(2)\nfor _ in range(20):\n    x = x - 0.05 * a.T @ (a @ x - b)\nreturn x",
            "`range(20)`: these are too few rounds: on all draws here 2000 will do",
        ),
        (
            "x = np.zeros(2)\nfor _ in range(5):\n    x = x - 0.02 * a.T @ (a @ x - b)\nreturn x",
            "`range(5)`: with 400 rounds the result comes nearer on every draw",
        ),
    ],
)
def test_what_changed_places_and_what_ends_too_early(body, told):
    assert told in judged(SOLVED, body)


def test_the_start_of_an_iteration_is_not_called_wrong():
    """With the right result to start from all would stay right; nothing is wrong with zeros."""
    told = judged(SOLVED, "x = np.zeros(2)\nfor _ in range(5):\n    x = x - 0.0003 * a.T @ (a @ x - b)\nreturn x")
    assert "np.zeros" not in told


def test_a_row_of_the_result_is_no_step_on_the_way():
    """That the rows are not right says no more than that the result is not."""
    item = asked(lambda a, b: np.cumsum(np.outer(a, b), axis=0), lambda rng: tuple(rng.normal(size=(2, 4))))
    told = judged(item, "return np.array([np.sinh(a[: k + 1]).sum() * b + 0.3 * k * b**3 for k in range(len(a))])")
    assert "this value is not right" not in told or "b**3`: this value" not in told


def test_what_is_right_after_the_last_round_is_no_part_of_the_result_in_each():
    item = {item.id: item for chapter in session.chapters() for item in chapter.items}["newton_lateration"]
    body = """
    p = np.array(start, float)
    for _ in range(20):
        away = p - landmarks
        p = p - np.linalg.solve(2 * away, (away**2).sum(1) - distances**2)
    return np.array([p[0], np.log(-np.abs(p[1]))])
    """
    answer = typed(body, "newton_lateration", "landmarks, distances, start")
    text = item.judge(answer, rng=np.random.default_rng(0)).text
    assert "the result is right, in the last round" in text


ROOT = """
x = b
for _ in range(20):
    x = (x + a / x) / 2
return x
"""


def both_positive(rng):
    return tuple(rng.uniform(1, 4, 2))


def test_the_right_result_of_an_earlier_round_is_not_called_that_of_the_last(monkeypatch):
    item = asked(solved_by(monkeypatch, f"def formula(a, b):{textwrap.indent(ROOT, '    ')}"), both_positive)
    twice = """
    for x in (b, -b):
        for _ in range(20):
            x = (x + a / x) / 2
    return np.cos(x) - 3 * x
    """
    assert "the result is right, in some round, but something else" in judged(item, twice)


def test_what_is_too_coarse_is_told_before_the_solution_is_looked_at(monkeypatch):
    reference, looked_at = solved_by(monkeypatch, f"def formula(a, b):{textwrap.indent(ROOT, '    ')}"), []
    monkeypatch.setattr(steps.slips, "solved", looked_at.append)
    coarse = """
    x = b
    while abs(x * x - a) > 0.001:
        x = (x + a / x) / 2
    return x
    """
    assert "`0.001` is far too large" in judged(asked(reference, both_positive), coarse) and not looked_at


def test_an_argument_on_which_nothing_depends_is_told_as_such():
    item = asked(lambda a, b: np.array([a, 2 * a]), both_positive)
    body = "c = b\nreturn np.array([a * np.cosh(c), 2 * a * np.cos(c)])"
    assert f"`c = b`: with 0 on the right side, {steps.RIGHT}. What you make of it there" in judged(item, body)


def test_what_stands_within_bounds_has_not_changed_places_with_another():
    function = ast.parse("def answer(d, s, factor):\n    return d / max(s, 1e-3) <= factor").body[0]
    exchanged = [change.mends for change in mutation.mending(function) if "changed places" in change.mends]
    assert exchanged == ["`factor` and `d` have changed places in this step"]


def test_a_value_off_by_next_to_nothing_is_not_called_the_right_result():
    """It is what is returned, within the accuracy of a comparison, and wrong where everything is tiny."""
    item = OPTIMIZATION["newton_step"]
    answer = typed("return np.linalg.solve(H + 1e-8 * np.eye(2), -g)", "newton_step", "g, H")
    outcome = item.judge(answer, rng=np.random.default_rng(0))
    assert outcome.status == NOT_YET and "the result is right" not in outcome.text


def test_a_bound_is_no_matter_of_units_where_a_word_is_chosen():
    item = OPTIMIZATION["classify_extremum"]
    body = """
    if np.linalg.norm(g) > 1e-6:
        return "not stationary"
    if np.linalg.det(H) < -1e-9:
        return "saddle"
    return "minimum" if np.trace(H) > 0 else "maximum"
    """
    outcome = item.judge(typed(body, "classify_extremum", "g, H"), rng=np.random.default_rng(0))
    assert outcome.status == NOT_YET and not re.search("thousand|by its own length", outcome.text)


def test_a_case_that_is_not_needed_is_told_and_not_what_it_asks():
    body = """
    x = a / np.linalg.norm(a)
    q = a[-1] - a[2]
    if abs(q) < 1e-12:
        return 0.0
    return len(b) * np.linalg.norm(b - (b @ x) * x)
    """
    assert "should never happen" in told(body)


def test_what_stands_behind_a_return_is_told_to_be_never_reached():
    said = told("x = a\nreturn len(b) * np.linalg.norm(b - (b @ x) * x)\nx = x / np.linalg.norm(x)")
    assert "what stands behind this `return` is never reached, and belongs before it. With this alone" in said


def test_of_parts_that_look_alike_the_larger_part_is_quoted_as_well():
    shown = {code for _, _, code, _ in rerun.written(typed("return a * b[0] - a @ b")).changes}
    assert {"a` in `a * b[0]", "a` in `a @ b", "b[0]"} <= shown and "a" not in shown


@pytest.mark.parametrize(
    "reference, body, said",
    [
        (
            lambda a, b: a * b.mean(),
            "return a * np.clip(b.mean(), -np.deg2rad(2), np.deg2rad(2))",
            "`clip` is to be left out",
        ),
        (
            lambda a, b: a[0] + b,
            "limit = np.deg2rad(20)\nx, y = np.minimum(a[0], limit), np.minimum(b, limit)\nreturn x + y",
            "`minimum` is to be left out, and the same in `np.minimum(b, limit)` (line 3)",
        ),
        (
            lambda a, b: np.sin(a) + np.cos(b),
            "s, c = np.round(np.sin(a), 1), np.round(np.cos(b), 1)\nreturn s + c",
            "`round` is to be left out, and the same in `np.round(np.cos(b), 1)` (line 2)",
        ),
        (
            lambda a, b: np.sqrt(np.abs(a[0])) + b,
            "d = np.sqrt(a[0] - 9)\nreturn d * 3 + np.exp(b)",
            "The first value on the way that is not finite is `d = np.sqrt(a[0] - 9)` in line 2.",
        ),
    ],
)
def test_bounds_roundings_and_what_is_not_finite_are_told(reference, body, said):
    text = judged(asked(reference, far_apart), body)
    assert said in text and "?." not in text


def test_a_variable_is_put_together_with_what_it_holds_by_then():
    function = typed("""
        least = 10.0
        for k in range(3):
            d = 2.0 * a[k]
            if d < least:
                least = d
        return d
        """)
    found = rerun.written(function)
    bound = [k for k, (_, code, name, *_) in enumerate(found.places) if name == "least" != code]
    there = next(k for k, (_, code, *_) in enumerate(found.places) if code == "d" and k > bound[-1])
    divided = next(k for k, (words, _) in enumerate(rerun.OTHERWISE) if words == "it is to be divided by {}")
    drawn = (np.array([3.0, 2.0, 4.0]), np.zeros(3))
    for variable in bound:
        assert found.results([("own", there, divided, variable)], drawn, 1.0, lambda result: result) == [(2.0,)]


def test_a_difference_that_was_there_before_is_no_gain():
    expected = np.array([1.2, 2.4, 3.6])
    case = steps.Case((), metrics.Numbers(), expected, result=2 * expected)
    assert case.gain((2 * expected,), []) == 0 and case.gain((-expected,), []) == 100


def test_the_larger_part_is_one_that_stands_there_once():
    written = rerun.written(typed("n = len(a)\nreturn 1 / (n - 1) * (a @ a) + 1 / (n - 1) * (b @ b)"))
    told = {code for _, _, code, _ in written.changes if code.startswith("n - 1` in")}
    assert told == {"n - 1` in `1 / (n - 1) * (a @ a)", "n - 1` in `1 / (n - 1) * (b @ b)"}


def test_of_several_comparisons_in_a_row_it_is_said_which():
    changes = rerun.written(typed("return 0 < a < b")).changes
    assert any(mends == "the second `<` stands where `<=` belongs" for *_, mends in changes)


def test_what_is_changed_where_the_result_is_right_and_stays_right_is_not_told(monkeypatch):
    """Where both numbers are alike, each of them is taken twice; turned, one of them is the smallest."""
    alike = (
        lambda rng: (np.full(2, 1.5), rng.normal(size=2)),
        metrics.Numbers(1e-9),
        "right, but not where all are alike:",
    )
    item = replace(
        ITEM, reference=lambda a, b: a @ b, draw=lambda rng: (rng.uniform(1, 2, 2), rng.normal(size=2)), noisy=alike
    )
    body = "i, k = np.argmin(a), np.argmax(a)\nreturn np.abs(a[i]) * b[i] + np.abs(a[k]) * b[k]"
    assert judged(item, body).startswith("right, but not where all are alike:")
    monkeypatch.setattr(steps.Search, "_does_not_matter", lambda self, plan: False)
    assert "its entry 0" in judged(item, body)


@pytest.mark.parametrize(
    ("chapter", "id", "arguments", "body", "told"),
    [
        (
            "08-kalman",
            "gate",
            "innovation, cov_innovation, limit",
            """
            from scipy.linalg import cholesky, solve_triangular
            L = cholesky(cov_innovation, lower=True)
            white = solve_triangular(L, innovation)
            return bool(white @ white < limit)
            """,
            "this reads the upper triangle alone: `lower=True` is missing.",
        ),
        (
            "04-optimization",
            "newton_step",
            "g, H",
            "from scipy.linalg import solve_triangular\nreturn solve_triangular(H, -g)",
            "reads one triangle alone: `np.linalg.solve` belongs there, of the whole matrix.",
        ),
        (
            "04-optimization",
            "gradient",
            "x",
            """
            def f(a, b):
                return -100 / ((a - 1) ** 2 + (b - 1) ** 2 + 1) - 200 / ((a + 1) ** 2 + (b + 2) ** 2 + 1)
            (a, b), h = x, 0.02
            return np.array([f(a + h, b) - f(a - h, b), f(a, b + h) - f(a, b - h)]) / (2 * h)
            """,
            "`0.02` is far too large: a thousandth of it will do.",
        ),
        (
            "03-quirlen",
            "robust_weights",
            "distances, scale",
            """
            s = max(np.median(distances) / 0.6745, scale)
            return np.where(distances < 7 * s, (1 - (distances / (7 * s)) ** 2) ** 2, 0.0)
            """,
            "`max` is to be left out, so that `scale` stands alone.",
        ),
    ],
)
def test_what_a_library_call_does_otherwise_than_meant_is_told(chapter, id, arguments, body, told):
    item = next(c for c in session.chapters() if c.name == chapter)[id]
    assert told in item.judge(typed(body, id, arguments), rng=np.random.default_rng(0)).text


def test_a_last_entry_from_which_the_first_is_not_taken_is_told():
    """Of times that do not begin at 0, the last one is no duration."""
    body = "return b * a[-1] / (len(a) - 1)"
    item = asked(
        lambda a, b: b * (a[-1] - a[0]) / (len(a) - 1),
        lambda rng: (rng.uniform(1, 9) + rng.uniform(0.1, 1) * np.arange(rng.integers(4, 9)), rng.normal()),
    )
    assert "`a[-1]`: `a[0]` is to be taken off, as that need not be 0." in judged(item, body)
