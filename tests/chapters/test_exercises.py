"""Every exercise of every chapter, proved by right and wrong answers."""

import ast
import copy
import functools
import pickle
import re
import textwrap
from dataclasses import replace

import numpy as np
import pytest

from labkit.exercises import budget, engine, metrics, regions, session, source
from labkit.exercises.engine import Exercise, Prediction
from labkit.exercises.outcome import CORRECT, NOT_YET, TO_DO
from labkit.exercises.typeset import typeset
from labkit.exercises.value import Value

CHAPTERS = session.chapters()
ITEMS = [(chapter, item) for chapter in CHAPTERS for item in chapter.items]
EXERCISES = [(c, i) for c, i in ITEMS if isinstance(i, Exercise)]
VALUES = [(c, i) for c, i in ITEMS if isinstance(i, Value)]


def names(pairs):
    return [f"{chapter.name}/{item.id}" for chapter, item in pairs]


def mistakes(pairs):
    cases = [(item, k) for _, item in pairs for k in range(len(item.mistakes))]
    return pytest.mark.parametrize("item, k", cases, ids=[f"{item.id}-{k}" for item, k in cases])


def same_answer(item, variant):
    """A student's own function, distinct from the library's, that returns what the variant returns."""

    def answer(*args):
        return variant(*args)

    return answer


@pytest.mark.parametrize("chapter, item", EXERCISES, ids=names(EXERCISES))
def test_reference_passes_on_many_seeds(chapter, item):
    for seed in range(2):
        outcome = item.judge(same_answer(item, item.reference), rng=np.random.default_rng(seed))
        assert outcome.status == CORRECT, outcome.text


@pytest.mark.parametrize("chapter, item", EXERCISES, ids=names(EXERCISES))
def test_blank_is_to_do(chapter, item):
    def untouched(*args):
        """Docstring."""
        ...

    assert item.judge(untouched).status == TO_DO


def drawn_once(draw):
    """A draw that from one state of the generator is made once, and goes on from where it left the generator."""
    known = {}

    def drawn(rng):
        before = str(rng.bit_generator.state)
        if before not in known:
            known[before] = draw(rng), rng.bit_generator.state
        args, rng.bit_generator.state = known[before]
        return copy.deepcopy(args)

    return drawn


def called_once(function):
    """A function that is called once with the same data; functions and generators among its arguments are no data."""
    known = {}

    def called(*args):
        try:
            given = pickle.dumps(args)
        except (pickle.PicklingError, AttributeError, TypeError):
            return function(*args)
        if any(isinstance(arg, np.random.Generator) for arg in args):
            return function(*args)
        if given not in known:
            known[given] = function(*args)
        return copy.deepcopy(known[given])

    return functools.update_wrapper(called, function)


@functools.cache
def drawn_and_called_once(chapter, id):
    """An exercise whose draws, reference and mistakes are computed once for all answers that are judged."""
    item = next(item for c, item in EXERCISES if (c.name, item.id) == (chapter, id))
    quick = replace(
        item,
        reference=called_once(item.reference),
        draw=tuple(map(drawn_once, item.cases)),
        noisy=[(drawn_once(draw), *rest) for draw, *rest in item.noisy],
        mistakes=[replace(mistake, variant=called_once(mistake.variant)) for mistake in item.mistakes],
    )
    object.__setattr__(quick, "chapter", item.chapter)
    return quick


@mistakes(EXERCISES)
def test_each_mistake_gets_its_own_text(item, k, monkeypatch):
    """The draws of one check for all; `tests/bench/check_chance.py` judges each for as long as one likes."""
    monkeypatch.setattr(budget, "SPECIAL", 0.2)  # dear answers are not called thirty times more
    quick = drawn_and_called_once(item.chapter.name, item.id)
    outcome = quick.judge(same_answer(item, quick.mistakes[k].variant), rng=np.random.default_rng(0))
    assert (outcome.status, outcome.text) == (NOT_YET, item.mistakes[k].text)


@pytest.mark.parametrize("chapter, item", VALUES, ids=names(VALUES))
def test_value_accepts_the_reference_and_refuses_its_neighbors(chapter, item, monkeypatch):
    monkeypatch.setattr(regions, "change_words", lambda *_: None)  # refused is enough here
    expected = item.reference()
    assert item.judge(expected).status == CORRECT
    assert item.judge(...).status == TO_DO
    if item.metric is None:
        assert item.judge(np.float64(expected) + 3 * max(item.rtol * abs(expected), item.atol)).status == NOT_YET


@pytest.mark.parametrize("chapter, item", VALUES, ids=names(VALUES))
def test_a_notebook_checks_a_value_once_and_goes_on_with_what_the_check_returns(chapter, item):
    text = (session.SOLUTIONS / f"{chapter.notebook}.py").read_text(encoding="utf-8")
    checks = re.findall(rf"^.*\bex\.{item.id}\(.*$", text, re.MULTILINE)
    assert checks == [f"{item.id} = ex.{item.id}({item.id})"]


@functools.cache
def computed_once(id):
    """A Value whose reference and wrong variants, functions without arguments, are computed once for all mistakes."""
    item = next(i for _, i in VALUES if i.id == id)
    wrong = [replace(mistake, variant=functools.cache(mistake.variant)) for mistake in item.mistakes]
    return replace(item, reference=functools.cache(item.reference), mistakes=wrong)


@mistakes(VALUES)
def test_each_wrong_value_gets_its_own_text(item, k):
    item = computed_once(item.id)
    outcome = item.judge(item.mistakes[k].variant())
    assert (outcome.status, outcome.mistake) == (NOT_YET, k), outcome.text


@pytest.mark.parametrize("chapter, item", EXERCISES + VALUES, ids=names(EXERCISES + VALUES))
def test_shown_solution_stands_in_the_source(chapter, item):
    """That it also passes is proved by the solved notebook, which runs in strict mode."""
    bound = session.Bound(chapter, item)
    cell = bound._cell()
    assert cell, f"no cell of solutions/{chapter.notebook}.py checks {item.id}"
    assert source.region(cell).strip()
    assert "your code here" in source.blank(cell)


@pytest.mark.parametrize("chapter", CHAPTERS, ids=lambda c: c.name)
def test_every_item_is_used_in_the_notebook(chapter):
    text = (session.SOLUTIONS / f"{chapter.notebook}.py").read_text(encoding="utf-8")
    for item in chapter.items:
        used = rf'ex\.predict\(\s*"{item.id}"' if isinstance(item, Prediction) else rf"ex\.{item.id}\b"
        assert re.search(used, text), f"{item.id} is defined but never asked"


def typed(hint):
    """The code of a last hint as a student types it: each pair of backquotes is a line, or several."""
    parts = re.findall("`([^`]*)`", hint) or [hint.removesuffix(".")]
    return "\n".join(part if "\n" in part else "\n".join(part.split("; ")) for part in parts)


@functools.cache
def known_in(notebook):
    """What a notebook knows, imports and exercises; and the parameters of each function, as written there."""
    tree = ast.parse((session.SOLUTIONS / f"{notebook}.py").read_text(encoding="utf-8"))
    known = {item.id: item.reference for chapter, item in EXERCISES if chapter.notebook == notebook}
    for node in tree.body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            exec(ast.unparse(node), known)
    return known, {node.name: ast.unparse(node.args) for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


@pytest.mark.parametrize("chapter, item", EXERCISES, ids=names(EXERCISES))
def test_the_last_hint_is_right_when_typed_as_it_stands(chapter, item):
    known, parameters = known_in(chapter.notebook)
    known = dict(known)
    exec(f"def {item.id}({parameters[item.id]}):\n{textwrap.indent(typed(item.hints[-1]), '    ')}", known)
    outcome = item.judge(known[item.id], rng=np.random.default_rng(0))
    assert outcome.status == CORRECT, outcome.text


def test_what_takes_more_than_three_lines_gets_its_steps_between_formula_and_code():
    """The second hint says what comes after what, which takes some words; whether the right ones, a reader sees."""
    for _, item in EXERCISES:
        if len(item.hints[2].strip("`").splitlines()) > 3:
            assert len(item.hints[1].split()) >= 20, (item.id, item.hints[1])


def test_hints_and_texts_write_the_transpose_as_the_notebook_does():
    """A raised T outside of code; a prime means the next state there, and says nothing of rows and columns."""
    for _, item in EXERCISES + VALUES:
        for text in (*item.hints, *(mistake.text for mistake in item.mistakes)):
            words = "".join(text.split("`")[::2])
            assert not re.search(r"\^T\b|\^-1\b|\b([A-Zjr]|cov|F_[xu])'(?! =|s\b)", words), text


def test_what_is_typed_with_a_caret_is_shown_raised_but_not_in_code():
    assert typeset("K = cov C^T S^-1, or `C^T`: 2^-10, A^Tx") == "K = cov Cᵀ S⁻¹, or `C^T`: 2^-10, A^Tx"


def test_words_of_a_special_draw_are_a_sentence_that_leads_on():
    """They stand alone where an answer stops with an error, and before what is off where it does not."""
    leads = {words for _, item in EXERCISES for *_, words in item._plan() if words not in (None, engine.NOISY)}
    assert leads and all(words.endswith(":") for words in leads)


def test_hints_do_not_repeat():
    for _, item in EXERCISES + VALUES:
        assert len(set(item.hints)) == 3


def test_a_text_is_shared_only_by_variants_of_one_mistake():
    """Signs and orders multiply the variants of one slip: those may share their text, side by side in the list."""
    for _, item in EXERCISES + VALUES:
        texts = [mistake.text for mistake in item.mistakes]
        groups = [text for k, text in enumerate(texts) if k == 0 or text != texts[k - 1]]
        assert len(set(groups)) == len(groups), item.id


@pytest.mark.parametrize("chapter", CHAPTERS, ids=lambda c: c.name)
def test_the_ids_of_mistakes_are_unique_in_their_chapter(chapter):
    ids = [mistake.id for item in chapter.items for mistake in getattr(item, "mistakes", ())]
    assert all(ids) and len(set(ids)) == len(ids)


def test_metrics_of_all_exercises_admit_their_reference():
    for _, item in EXERCISES:
        if isinstance(item.metric, metrics.Metric):
            args = item.cases[0](np.random.default_rng(1))
            expected = item.reference(*args)
            assert item.metric.equal(expected, expected)


@pytest.mark.parametrize("chapter, item", VALUES, ids=names(VALUES))
def test_the_last_hint_of_a_value_is_code_that_binds_its_name(chapter, item):
    tree = ast.parse(typed(item.hints[-1]))
    bound = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    assert item.id in bound, item.hints[-1]


@pytest.mark.parametrize("chapter", CHAPTERS, ids=lambda c: c.name)
def test_the_question_of_a_prediction_stands_before_its_cell(chapter):
    """Whoever reads before running knows what is to be decided; the cell's output repeats it with the choices."""
    text = ""
    for cell in source.read(session.SOLUTIONS / f"{chapter.notebook}.py"):
        asked = cell.kind == "code" and re.search(r'ex\.predict\(\s*"(\w+)"', cell.text)
        assert not asked or "?" in text, f"{asked[1]}: the text before it asks nothing"
        text = cell.text if cell.kind == "markdown" else text


def with_further(chapter):
    """The cells of a chapter's source, each with whether the heading it stands under says further."""
    level = None
    for cell in source.read(session.SOLUTIONS / f"{chapter.notebook}.py"):
        if cell.kind == "markdown":
            for depth, words in re.findall(r"^(#+) (.*)", cell.text, re.MULTILINE):
                if level is None or len(depth) <= level:
                    level = len(depth) if re.search(r"\bfurther\b", words, re.IGNORECASE) else None
        yield cell, level is not None


def asked_in(chapter):
    """The ids of a chapter's items in the order of its notebook, and those in sections whose heading says further."""
    order, further, ids = [], [], {item.id for item in chapter.items}
    for cell, beyond in with_further(chapter):
        if cell.kind == "code" and "student" not in cell.tags:
            for groups in re.findall(r'ex\.predict\(\s*"(\w+)"|ex\.(\w+)\b', cell.text):
                id = "".join(groups)
                if id in ids and id not in order:
                    order.append(id)
                    further += [id] if beyond else []
    return order, further


def names_of(text):
    """The names a cell binds, and those it reads, wherever in it."""
    nodes = list(ast.walk(ast.parse(text)))
    bound = {n.id for n in nodes if isinstance(n, ast.Name) and not isinstance(n.ctx, ast.Load)}
    bound |= {n.name for n in nodes if isinstance(n, ast.FunctionDef | ast.ClassDef)}
    bound |= {
        (a.asname or a.name).split(".")[0] for n in nodes if isinstance(n, ast.Import | ast.ImportFrom) for a in n.names
    }
    bound |= {n.arg for n in nodes if isinstance(n, ast.arg)}
    return bound, {n.id for n in nodes if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)}


@pytest.mark.parametrize("chapter", CHAPTERS, ids=lambda c: c.name)
def test_the_core_of_a_chapter_needs_nothing_from_what_goes_further(chapter):
    """Whoever leaves the sections called further out meets no name that only they define."""
    core, elsewhere = set(), set()
    for cell, beyond in with_further(chapter):
        if cell.kind == "code" and "student" not in cell.tags:
            bound, read = names_of(cell.text)
            if beyond:
                elsewhere |= bound
            else:
                core |= bound
                assert not (read & elsewhere) - core, f"{cell.id} reads {sorted((read & elsewhere) - core)}"


@pytest.mark.parametrize("chapter", CHAPTERS, ids=lambda c: c.name)
def test_progress_lists_what_the_notebook_asks_in_its_order_and_marks_what_goes_further(chapter):
    order, further = asked_in(chapter)
    assert [item.id for item in chapter.items] == order
    assert sorted(chapter.further) == sorted(further)
