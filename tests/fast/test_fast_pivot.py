"""The pivot calibration from sums equals the readable one."""

import numpy as np
import pytest

from labkit.calibration import pivot as readable
from labkit.fast import pivot as fast
from labkit.geometry.lie import exp_so3

TIP, POINT = np.array([12.0, -8.0, 150.0]), np.array([100.0, 50.0, -900.0])


def measured(rng, n, std_rot=2e-3, std_trans=0.2):
    return readable.touching_poses(exp_so3(0.5 * rng.normal(size=(n, 3))), TIP, POINT, std_rot, std_trans, rng)


@pytest.mark.parametrize("n", [3, 4, 12, 100, 1000])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_random_poses_give_the_same_result(n, dtype):
    T = measured(np.random.default_rng(n), n).astype(dtype)
    one, two = readable.calibrate_pivot(T), fast.calibrate_pivot(T)
    np.testing.assert_allclose(two.tip, one.tip, atol=1e-8)
    np.testing.assert_allclose(two.pivot, one.pivot, atol=1e-8)
    for name in ("residuals", "s0", "std", "covariance", "singular_values", "weights"):
        np.testing.assert_allclose(getattr(two, name), getattr(one, name), rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("options", [{"robust": True}, {"std_rot": 2e-3, "std_trans": 0.2}])
def test_what_it_leaves_to_the_readable_one_is_the_same(options):
    T = measured(np.random.default_rng(1), 20)
    one, two = readable.calibrate_pivot(T, **options), fast.calibrate_pivot(T, **options)
    np.testing.assert_array_equal(two.tip, one.tip)
    np.testing.assert_array_equal(two.weights, one.weights)


@pytest.mark.parametrize("half_angle_deg", [0.02, 0.1, 1.0, 60.0])
def test_nearly_degenerate_poses_give_the_same_tip(half_angle_deg):
    T = readable.touching_poses(readable.cone(9, np.deg2rad(half_angle_deg), turns=0.3), TIP, POINT)
    one, two = readable.calibrate_pivot(T), fast.calibrate_pivot(T)
    np.testing.assert_allclose(two.tip, one.tip, atol=1e-8 / np.deg2rad(half_angle_deg) ** 2)


@pytest.mark.parametrize("half_angle_deg", [0.001, 0.01, 0.1, 1.0, 60.0])
def test_the_quick_bound_of_the_rank_never_hides_a_free_tip(half_angle_deg):
    T = readable.touching_poses(readable.cone(9, np.deg2rad(half_angle_deg), turns=0.3), TIP, POINT)
    values = np.linalg.svd(readable.pivot_matrix(T), compute_uv=False)
    ratio = values[-1] / values[0]
    rows = T[:, :3] - T[:, :3].mean(0)
    gram = np.einsum("nij,nik->jk", rows, rows)
    with pytest.raises(ValueError, match="free"):
        fast._tip(gram, T, 1.001 * ratio)
    assert np.isfinite(fast._tip(gram, T, 0.999 * ratio)).all()


@pytest.mark.parametrize(
    "T",
    [
        np.tile(np.eye(4), (8, 1, 1)),
        readable.touching_poses(exp_so3(np.outer(np.linspace(0, 3, 20), [0, 0, 1.0])), TIP, POINT),
        readable.touching_poses(readable.cone(30, 0.4, turns=1.0), TIP, POINT),
        np.tile(np.eye(4), (2, 1, 1)),
        np.eye(4),
        np.full((5, 4, 4), np.nan),
    ],
    ids=["still", "one axis", "cone with one turn", "two poses", "one matrix", "NaN"],
)
def test_both_refuse_with_the_same_words(T):
    words = []
    for module in (readable, fast):
        with pytest.raises(ValueError) as refused:
            module.calibrate_pivot(T)
        words.append(str(refused.value))
    assert words[0] == words[1]
