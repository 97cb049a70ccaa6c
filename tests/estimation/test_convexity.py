"""Chords and definite curvature, against functions whose convexity is known."""

import numpy as np
import pytest

from labkit.documents.thesis import printed as thesis
from labkit.documents.thesis import wells
from labkit.estimation import convexity


def test_definite_exactly_where_all_leading_minors_are_positive():
    rng = np.random.default_rng(0)
    A = rng.normal(size=(400, 3, 3))
    B = A + np.swapaxes(A, 1, 2) + 2 * np.eye(3)
    minors = np.array([[np.linalg.det(b[:k, :k]) for k in (1, 2, 3)] for b in B])
    assert (convexity.positive_definite(B) == (minors > 0).all(1)).all()
    assert 20 < convexity.positive_definite(B).sum() < 380
    assert not convexity.positive_definite(np.diag([1.0, 0.0]))


def test_a_quadratic_sags_below_its_chord_by_a_known_amount():
    """(1 - t) f(x) + t f(y) - f(z) = t (1 - t) (y - x)' A (y - x) for f = z' A z."""
    rng = np.random.default_rng(1)
    M, (x, y) = rng.normal(size=(3, 3)), rng.normal(size=(2, 3))
    A = M @ M.T
    share, values, heights = convexity.chord(lambda z: z @ A @ z, x, y, 11)
    assert heights - values == pytest.approx(share * (1 - share) * ((y - x) @ A @ (y - x)), abs=1e-12)
    assert convexity.rise_above_chord(lambda z: z @ A @ z, x, y, 11) == pytest.approx(0, abs=1e-12)
    assert convexity.rise_above_chord(lambda z: -z @ A @ z, x, y, 11) == pytest.approx((y - x) @ A @ (y - x) / 4)


def test_a_well_is_convex_within_one_over_root_three():
    """Where 2 w / q^2 - 8 w d^2 / q^3 > 0 with q = d^2 + 1, so d < 1 / sqrt(3)."""

    def well(x):
        return -1 / (x @ x + 1)

    inside, outside = np.array([0.57, 0.0]), np.array([0.6, 0.0])
    assert convexity.rise_above_chord(well, inside, 0.9 * inside, 9) <= 1e-15
    assert convexity.rise_above_chord(well, outside, 1.1 * outside, 9) > 1e-6


def test_the_wells_are_convex_in_about_one_percent_of_the_square():
    square = np.stack(np.meshgrid(*2 * [np.linspace(-6, 6, 601)]), -1)
    H = wells.hessian(square)
    trace, det = H[..., 0, 0] + H[..., 1, 1], np.linalg.det(H)
    positive = convexity.positive_definite(H)
    assert (positive == ((trace > 0) & (det > 0))).all() and 0.013 < positive.mean() < 0.016
    J = wells.jacobian(square)
    assert convexity.positive_definite(np.swapaxes(J, -1, -2) @ J).all()


def test_no_chord_between_places_near_a_minimum_is_crossed():
    rng = np.random.default_rng(2)
    for e in wells.extrema()[:2]:
        for x, y in e.x + 0.4 * rng.uniform(-1, 1, (50, 2, 2)) / np.sqrt(2):
            assert convexity.rise_above_chord(wells.value, x, y, 21) < 1e-9


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: convexity.chord(wells.value, [0, 0], [1, 1, 1], 5), "same shape"),
        (lambda: convexity.chord(wells.value, [0, 0], [1, 1], 1), "n must be"),
        (lambda: convexity.positive_definite(np.ones((2, 3))), "B must have shape"),
    ],
)
def test_what_does_not_fit_is_refused(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_printed_tables_of_choice():
    table = thesis.table_4_1()
    assert [row["points"].sum() for row in table.values()] == [row["sum"] for row in table.values()] == [22, 26, 16]
    assert all(10 * len(row["points"]) == 40 and row["of"] == 50 for row in table.values())
    levels = thesis.table_5_2()
    assert {name for name, row in levels.items() if row.sum() == 16} == {
        "least squares, Gauss-Newton", "least squares, Levenberg-Marquardt",
    }  # fmt: skip
    assert levels["trust region, Newton"].sum() == 12 and all(set(row) <= {1, 2, 3, 4} for row in levels.values())
