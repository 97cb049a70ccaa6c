"""The quick forms of the whole cell beside the readable ones."""

import numpy as np
import pytest

from labkit.fast import cell as fast
from labkit.geometry.frames import moved
from labkit.machines import cell


@pytest.fixture(scope="module")
def covariances():
    A = {n: np.random.default_rng(n).normal(size=(n, n)) for n in (3, 6)}
    return {n: 1e-4 * a @ a.T for n, a in A.items()}


def cells(rng, covariances, touched):
    """A cell near the simulated one, and a job somewhere on its table, with a hole beside the plane of the marks."""
    turned = 0.1 * rng.normal(size=(2, 6))
    of = cell.Cell(
        cell.TRUTH.tip + rng.normal(size=3), moved(cell.TRUTH.T_FS, turned[0]), moved(cell.TRUTH.T_BW, turned[1]),
        covariances[3], covariances[6], 2 * covariances[6],
    )  # fmt: skip
    job = cell.simulated_job(rng.uniform([-100, -200, -1], [200, 200, 2]), touched=touched)
    return of, cell.Job(**{**vars(job), "hole": rng.normal(0, 60, 3), "std_mark": 0.2})


@pytest.mark.parametrize("touched", [False, True])
@pytest.mark.parametrize("seed", [0, 1])
def test_poses_budget_and_misses_equal_the_readable_ones(seed, touched, covariances):
    rng = np.random.default_rng(seed)
    of, job = cells(rng, covariances, touched)
    for name in ("learned_pose", "part_pose", "flange_at_hole"):
        np.testing.assert_allclose(getattr(fast, name)(of, job), getattr(cell, name)(of, job), rtol=1e-12, atol=1e-9)
    readable, quick = cell.miss_budget(of, job), fast.miss_budget(of, job)
    assert list(readable) == list(quick)
    for name, share in readable.items():
        np.testing.assert_allclose(quick[name], share, rtol=1e-9, atol=1e-12, err_msg=name)
    errors = cell.draw_errors(of, job, rng, 20)
    errors["tracker"][0] = 0.5  # nothing is linearized
    np.testing.assert_allclose(fast.Misses(errors).of(of, job), cell.misses_by(of, job, errors), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("source", cell.SOURCES)
def test_an_error_of_one_source_enters_as_in_the_readable_form(source, covariances):
    rng = np.random.default_rng(5)
    of, job = cells(rng, covariances, False)
    error = rng.normal(size=len(cell.source_covariances(of, job)[source]))
    for quick, readable in zip(fast.with_errors(of, job, {source: error}), cell.with_errors(of, job, {source: error})):
        for name, value in vars(readable).items():
            np.testing.assert_allclose(getattr(quick, name), value, rtol=1e-12, atol=1e-12, err_msg=name)


@pytest.mark.parametrize(
    ("errors", "words"),
    [
        ({"other": np.zeros(3)}, "errors must be one of tip, scanner"),
        ({"tip": np.zeros(6)}, "tip must have shape (3,), got (6,)"),
        ({"scanner": [np.nan] * 6}, "scanner"),
        ([np.zeros(3)], "errors must be dict"),
    ],
)
def test_what_is_no_cell_and_no_error_is_refused(errors, words, covariances):
    of, job = cells(np.random.default_rng(6), covariances, True)
    with pytest.raises(ValueError) as refusal:
        fast.with_errors(of, job, errors)
    assert words in str(refusal.value)
    for function in (fast.learned_pose, fast.part_pose, fast.flange_at_hole, fast.miss_budget):
        with pytest.raises(ValueError, match="cell must be Cell, got"):
            function(job, job)
    with pytest.raises(ValueError, match="as many of each source"):
        fast.Misses({"tip": np.zeros((5, 3))})
    with pytest.raises(ValueError, match="as many of each source"):
        fast.Misses({**cell.draw_errors(of, job, np.random.default_rng(7), 4), "tip": np.zeros((5, 3))})
