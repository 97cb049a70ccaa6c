"""What the documents could have seen of their own errors: counts by hand, and repeated measurements."""

import numpy as np
import pytest

from labkit.documents import redundancy
from labkit.estimation.influence import VISIBLE

MEASURED, ADDED = zip(*redundancy.checks())


@pytest.mark.parametrize("check", MEASURED, ids=lambda c: c.document)
def test_as_measured_nothing_is_left_to_check(check):
    assert check.left == 0 and np.isinf(check.visible).all() and "no error is ever seen" in str(check)


def test_with_one_thing_more_errors_are_seen():
    left = {check.document: check.left for check in ADDED}
    assert left == {"lab sheet": 3, "thesis": 93 - 9, "report": 5, "lecture": 2}
    assert any("one run of a quantity: 1 number, 1 unknown:" in str(check) for check in MEASURED)
    assert all(np.isfinite(check.visible[0]) and f"from {check.visible[0]:.1f}" in str(check) for check in ADDED)


def test_of_six_runs_an_error_of_one_is_seen_at_4_13_over_the_root_of_five_sixths():
    (six,) = (check for check in ADDED if check.document == "report")
    assert six.visible[0] == pytest.approx(VISIBLE / np.sqrt(5 / 6)) and pytest.approx(4.13, abs=0.01) == VISIBLE


def test_a_point_may_move_across_the_plane_of_its_triangle_unseen():
    """With the three distances known, what changes none of them stays unseen: z of each point."""
    (points,) = (check for check in ADDED if check.document == "lab sheet")
    assert np.isinf(points.visible[1]) and "some never" in str(points)


def test_the_errors_in_print_were_large_enough():
    sizes, limit = redundancy.misprints_seen()
    assert sorted(sizes) == [2, 3, 4, 7, 12, 21, 30] and min(sizes.values()) > 2 * limit
    by_runs, by_average = redundancy.averages_seen()
    assert by_runs > limit and by_average > 1
