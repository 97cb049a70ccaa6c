"""What printed digits hide: half units, propagated bounds, digits cut off; and single slips, tried everywhere."""

import numpy as np
import pytest

from labkit.documents import rounding, slips


@pytest.mark.parametrize(
    ("printed", "half"),
    [("1.010000", 0.5e-6), ("-0,5", 0.05), ("12", 0.5), ("3e-4", 0.5e-4), ("1.", 0.5), (".37", 0.005), ("O(M)", None)],
)
def test_half_units(printed, half):
    assert rounding.half_unit(printed) == (None if half is None else pytest.approx(half))


def test_words_are_no_numbers():
    with pytest.raises(ValueError, match="got 'sum'"):
        rounding.read(["1.0", "sum"])


def test_the_bound_of_a_sum_and_of_a_product_is_known():
    given = rounding.read(["1.5", "-2.25", "3"])
    assert rounding.propagate(np.sum, given) == (pytest.approx(2.25), pytest.approx(0.05 + 0.005 + 0.5))
    value, bound = rounding.propagate(np.prod, rounding.read(["2.0", "3.00"]))
    assert (value, bound) == (pytest.approx(6.0), pytest.approx(0.05 * 3 + 0.005 * 2))


def test_the_bound_of_a_chain_is_the_closed_form():
    rng = np.random.default_rng(2)
    rows = np.round(rng.normal(size=(3, 3, 4)), 3)

    def chain(rows):
        last = np.broadcast_to([0.0, 0.0, 0.0, 1.0], (3, 1, 4))
        a, b, c = np.concatenate([rows, last], axis=1)
        return a @ b @ c

    links = np.concatenate([rows, np.broadcast_to([0.0, 0.0, 0.0, 1.0], (3, 1, 4))], axis=1)
    _, bound = rounding.propagate(chain, rounding.read([[[f"{x:.3f}" for x in row] for row in m] for m in rows]))
    before, after = [np.eye(4), links[0], links[0] @ links[1]], [links[1] @ links[2], links[2], np.eye(4)]
    off = np.zeros((4, 4))
    off[:3] = 0.5e-3
    assert np.allclose(bound, sum(np.abs(a) @ off @ np.abs(b) for a, b in zip(before, after)))


def test_the_bound_holds_for_random_inputs_inside_the_digits():
    rng = np.random.default_rng(5)
    given = rounding.read(["1.0", "2.0", "-1.5"])
    value, bound = rounding.propagate(np.linalg.norm, given)
    off = [np.linalg.norm(given.values + rng.uniform(-1, 1, 3) * given.halves) - value for _ in range(500)]
    assert np.abs(off).max() <= bound * 1.02 and np.abs(off).max() > 0.5 * bound


def test_what_is_exact_moves_nothing():
    assert rounding.propagate(lambda a, b: a * b, np.array(3.0), np.array(2.0)) == (6.0, 0.0)


@pytest.mark.parametrize(
    ("printed", "value", "bound", "cut"),
    [("0.99", 0.9987, 0, True), ("0.99", 1.0, 0, False), ("-2.3", -2.39, 0, True), ("-2.3", -2.29, 0, False),
     ("0.5", 0.61, 0.02, True), ("0.0", 0.06, 0, True), ("1.2", -1.25, 0, False)],
)  # fmt: skip
def test_digits_cut_off(printed, value, bound, cut):
    assert rounding.is_cut_off(printed, value, bound) == cut


def test_slips_are_tried_everywhere():
    found = slips.explained_by(
        {slips.HERE: "54", "a": "20", "b": "25"}, lambda d: float(d["a"]) + float(d["b"]) == float(d[slips.HERE])
    )
    assert found[slips.HERE] == ["45"] and found["a"] == ["29"] and "b" not in found
    assert slips.explained_by({slips.HERE: "45"}, lambda d: d[slips.HERE] == "45") == {}
    named = slips.explained_by({slips.HERE: "x - h"}, lambda d: "+" in d[slips.HERE], {slips.HERE: ("x + h",)})
    assert named == {slips.HERE: ["x + h"]}
