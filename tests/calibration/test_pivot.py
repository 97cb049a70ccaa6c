"""The pivot calibration of chapter 3 against SciPy, closed forms, Monte Carlo and the printed sheet."""

import importlib.util

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from labkit.calibration import pivot, robust
from labkit.documents.lab_sheet import printed as lab_sheet
from labkit.tables import DATA

TIP, POINT = np.array([12.0, -8.0, 150.0]), np.array([100.0, 50.0, -900.0])
STD_ROT = np.deg2rad(0.1)


def turns(rng, n, largest_deg=45.0):
    axis = rng.normal(size=(n, 3))
    axis *= np.deg2rad(largest_deg) * rng.uniform(0.1, 1, (n, 1)) / np.linalg.norm(axis, axis=1, keepdims=True)
    return Rotation.from_rotvec(axis).as_matrix()


def measured(rng, n, std_rot=STD_ROT, std_trans=0.2):
    return pivot.touching_poses(turns(rng, n), TIP, POINT, std_rot, std_trans, rng)


def with_outliers(T, rng, share):
    T = T.copy()
    bad = rng.permutation(len(T))[: int(share * len(T))]
    away = rng.normal(size=(len(bad), 3))
    T[bad, :3, 3] += rng.uniform(20, 50, (len(bad), 1)) * away / np.linalg.norm(away, axis=1, keepdims=True)
    return T, bad


def test_poses_file_is_what_its_script_writes():
    path = DATA / "quirlen" / "make_poses.py"
    spec = importlib.util.spec_from_file_location("make_poses", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    written = (DATA / "quirlen" / "poses.csv").read_text().splitlines()
    made = list(module.lines())
    assert made[0] == written[0] and len(made) == len(written)
    numbers = [np.array([row.split(",") for row in rows[1:]], float) for rows in (made, written)]
    np.testing.assert_allclose(numbers[0], numbers[1], atol=2e-9)


def test_listing_shows_twelve_poses():
    assert lab_sheet.poses_in_listing() == 12 == len(lab_sheet.kreisel_poses())


def test_euler_poses_agree_with_scipy():
    rows = np.random.default_rng(1).uniform(-170, 170, (20, 6))
    T = pivot.poses_from_euler(rows)
    np.testing.assert_allclose(
        T[:, :3, :3], Rotation.from_euler("XYZ", rows[:, 3:], degrees=True).as_matrix(), atol=1e-14
    )
    np.testing.assert_array_equal(T[:, :3, 3], rows[:, :3])


def test_exact_poses_give_the_exact_tip():
    T = pivot.touching_poses(turns(np.random.default_rng(2), 7), TIP, POINT)
    for options in (
        {},
        {"std_rot": 1e-3, "std_trans": 0.2},
        {"robust": True},
        {"std_rot": 1e-3, "std_trans": 0.2, "robust": True},
    ):
        result = pivot.calibrate_pivot(T, **options)
        np.testing.assert_allclose(result.tip, TIP, atol=1e-9)
        np.testing.assert_allclose(result.pivot, POINT, atol=1e-9)
        assert np.abs(result.residuals).max() < 1e-9


def test_plain_is_the_least_squares_solution_of_the_stacked_system():
    rng = np.random.default_rng(3)
    for n in (3, 12, 200):
        T = measured(rng, n)
        A, b = pivot.pivot_matrix(T), pivot.pivot_rhs(T)
        result, x = pivot.calibrate_pivot(T), np.linalg.lstsq(A, b, rcond=None)[0]
        np.testing.assert_allclose(np.concatenate([result.tip, result.pivot]), x, atol=1e-9)
        np.testing.assert_allclose(pivot.solve_pivot(A, b), x, atol=1e-9)
        np.testing.assert_allclose(result.residuals, (A @ x - b).reshape(n, 3), atol=1e-9)
        np.testing.assert_allclose(result.residuals, pivot.pivot_residuals(T, result.tip, result.pivot), atol=1e-9)
        np.testing.assert_allclose(result.singular_values, np.linalg.svd(A, compute_uv=False), rtol=1e-9)
        assert result.s0 == pytest.approx(np.sqrt((result.residuals**2).sum() / n))
        assert result.std == pytest.approx(np.sqrt((result.residuals**2).sum() / (3 * n - 6)))
        expected = result.std**2 * np.linalg.inv(A.T @ A)
        np.testing.assert_allclose(result.covariance, expected, rtol=1e-7, atol=1e-12)
        np.testing.assert_allclose(pivot.pivot_covariance(A, result.residuals), expected, rtol=1e-7, atol=1e-12)


def test_a_result_keeps_its_own_poses():
    T = measured(np.random.default_rng(8), 15)
    early, late = pivot.calibrate_pivot(T), pivot.calibrate_pivot(T)
    expected = early.residuals
    T[:] = np.eye(4)
    np.testing.assert_array_equal(late.residuals, expected)
    assert late.s0 == early.s0 and late.weights.tolist() == [1.0] * 15


def test_poses_with_printed_digits_solve_the_same_system():
    T = measured(np.random.default_rng(4), 15)
    T[:, :3] = np.round(T[:, :3], 5)
    result = pivot.calibrate_pivot(T)
    x = np.linalg.lstsq(pivot.pivot_matrix(T), pivot.pivot_rhs(T), rcond=None)[0]
    np.testing.assert_allclose(np.concatenate([result.tip, result.pivot]), x, atol=1e-9)


def test_weighted_minimizes_the_weighted_sum():
    rng, std_rot, std_trans = np.random.default_rng(5), np.deg2rad(0.3), 0.1
    T = measured(rng, 30, std_rot, std_trans)
    result = pivot.calibrate_pivot(T, std_rot, std_trans)
    lever = np.cross(np.eye(3), result.tip).T
    C = std_trans**2 * np.eye(3) + std_rot**2 * lever @ lever.T
    whiten = np.linalg.cholesky(np.linalg.inv(C)).T

    def residuals(x):
        r = pivot.pivot_residuals(T, x[:3], x[3:])
        return (np.einsum("nji,nj->ni", T[:, :3, :3], r) @ whiten.T).ravel()

    fit = least_squares(residuals, np.concatenate([TIP, POINT]), method="lm", xtol=1e-14, ftol=1e-14)
    np.testing.assert_allclose(np.concatenate([result.tip, result.pivot]), fit.x, atol=1e-5)
    np.testing.assert_allclose(result.covariance, np.linalg.inv(fit.jac.T @ fit.jac), rtol=1e-4, atol=1e-6)


def test_covariance_of_the_weighted_calibration_is_the_bound():
    rng = np.random.default_rng(6)
    R = turns(rng, 40)
    T = pivot.touching_poses(R, TIP, POINT)
    result = pivot.calibrate_pivot(T, 1e-3, 0.2)
    np.testing.assert_allclose(result.covariance, pivot.predicted_covariance(R, TIP, 1e-3, 0.2), rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize(
    "share, options, ratio",
    [
        (0.0, {}, 1.16),
        (0.0, {"std_rot": np.deg2rad(0.1), "std_trans": 0.2}, 1.06),
        (0.1, {"std_rot": np.deg2rad(0.1), "std_trans": 0.2, "robust": True}, 1.15),
        (0.3, {"std_rot": np.deg2rad(0.1), "std_trans": 0.2, "robust": True}, 1.3),
    ],
)
def test_error_stays_near_the_bound(share, options, ratio):
    rng, squares, bound, nees = np.random.default_rng(7), [], [], []
    for _ in range(300):
        R = turns(rng, 50)
        T, _ = with_outliers(pivot.touching_poses(R, TIP, POINT, np.deg2rad(0.1), 0.2, rng), rng, share)
        result = pivot.calibrate_pivot(T, **options)
        error = result.tip - TIP
        squares.append(error @ error)
        nees.append(error @ np.linalg.solve(result.covariance[:3, :3], error))
        bound.append(np.trace(pivot.predicted_covariance(R, TIP, np.deg2rad(0.1), 0.2)[:3, :3]))
    assert np.sqrt(np.mean(squares) / np.mean(bound)) < ratio
    assert np.max(squares) < 25 * np.mean(bound)
    assert np.mean(nees) == pytest.approx(3, abs=0.6)


def test_robust_finds_the_outliers_at_forty_percent():
    rng = np.random.default_rng(8)
    for n in (10, 25, 300):
        T, bad = with_outliers(measured(rng, n), rng, 0.4)
        result = pivot.calibrate_pivot(T, robust=True)
        assert (result.weights[bad] == 0).all()
        assert np.count_nonzero(result.weights) == n - len(bad)
        assert np.linalg.norm(result.tip - TIP) < 2


def test_the_robust_covariance_is_that_of_an_m_estimate():
    """Huber's: sum psi^2 over the freedom and over the squared mean slope of psi, here from differences; times the
    inverse of the weighted normal matrix.
    """
    T, _ = with_outliers(measured(np.random.default_rng(5), 40), np.random.default_rng(6), 0.2)
    result = pivot.calibrate_pivot(T, robust=True)
    r, w = result.residuals, result.weights
    d = np.linalg.norm(r, axis=1)
    assert 0 < (w == 0).sum() < 20
    cut = np.median((d / np.sqrt(1 - np.sqrt(w)))[w > 0])  # w = (1 - (d / cut)^2)^2

    def psi(v):
        return np.maximum(1 - (v**2).sum(1) / cut**2, 0)[:, None] ** 2 * v

    slopes = sum((psi(r + h) - psi(r - h))[:, k] / 2e-5 for k, h in enumerate(1e-5 * np.eye(3))) / 3
    A = np.sqrt(w)[:, None, None] * pivot.pivot_matrix(T).reshape(-1, 3, 6)
    freedom = 3 * w.sum() - 6
    spread = (psi(r) ** 2).sum() / freedom / (slopes.sum() / w.sum()) ** 2
    np.testing.assert_allclose(psi(r), w[:, None] * r, rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(result.covariance, spread * np.linalg.inv(np.einsum("nki,nkj->ij", A, A)), rtol=1e-3)


def test_robust_goes_on_until_no_weight_moves():
    T, _ = with_outliers(measured(np.random.default_rng(5), 12, std_trans=1.0), np.random.default_rng(55), 0.3)
    result = pivot.calibrate_pivot(T, robust=True)
    d, w = np.linalg.norm(result.residuals, axis=1), result.weights
    inner = (w > 0) & (w < 0.9)
    cut = np.median(d[inner] / np.sqrt(1 - np.sqrt(w[inner])))
    np.testing.assert_allclose(w, np.maximum(1 - (d / cut) ** 2, 0) ** 2, atol=1e-4)


def test_robust_is_repeatable_and_takes_a_generator():
    T, _ = with_outliers(measured(np.random.default_rng(9), 40), np.random.default_rng(9), 0.2)
    first, second = (pivot.calibrate_pivot(T, robust=True) for _ in range(2))
    np.testing.assert_array_equal(first.tip, second.tip)
    other = pivot.calibrate_pivot(T, robust=True, rng=np.random.default_rng(99))
    np.testing.assert_allclose(other.tip, first.tip, atol=1e-2)


def test_estimates_do_not_depend_on_the_unit_of_length():
    T, _ = with_outliers(measured(np.random.default_rng(10), 40), np.random.default_rng(10), 0.2)
    meters = T.copy()
    meters[:, :3, 3] /= 1000
    for options in ({}, {"robust": True}):
        np.testing.assert_allclose(
            pivot.calibrate_pivot(meters, **options).tip * 1000, pivot.calibrate_pivot(T, **options).tip, rtol=1e-6
        )


def test_tukey_constants_are_those_of_three_normal_components():
    d = np.linspace(0, 12, 20001)
    density = stats.chi(3).pdf(d)
    w = robust.tukey_weights(d, 1.0, pivot.TUKEY)
    shrink = np.trapezoid(w * d**2 * density, d) / (3 * np.trapezoid(w * density, d))
    slope = np.trapezoid((w - 4 / 3 * (d / pivot.TUKEY) ** 2 * np.sqrt(w)) * density, d)
    assert shrink == pytest.approx(pivot.TUKEY_SHRINK, rel=1e-6)
    assert slope**2 / np.trapezoid(w**2 * d**2 / 3 * density, d) == pytest.approx(0.982, abs=0.001)
    assert stats.chi(3).median() == pytest.approx(robust.MEDIAN_CHI3)
    draws = np.linalg.norm(np.random.default_rng(11).normal(size=(20001, 3)), axis=1)
    assert robust.median_std(0.3 * draws) == pytest.approx(0.3, rel=0.03)


def test_spinning_about_the_tool_axis_is_refused_with_the_direction():
    spin = Rotation.from_rotvec(np.outer(np.linspace(0, 3, 20), [0, 0, 1])).as_matrix()
    T = pivot.touching_poses(spin, TIP, POINT)
    with pytest.raises(
        ValueError, match=r"free along \(0.00, 0.00, 1.00\) in the tool frame.*turn the tool about another axis"
    ):
        pivot.calibrate_pivot(T)
    with pytest.raises(ValueError, match="free in 3 directions"):
        pivot.calibrate_pivot(np.tile(T[0], (8, 1, 1)))
    A = pivot.pivot_matrix(T)
    assert np.linalg.matrix_rank(A, tol=1e-9) == 5
    for scale in (1e-3, 1e3):  # relative: the unit of length changes nothing
        other = T.copy()
        other[:, :3, 3] *= scale
        with pytest.raises(ValueError, match="free along"):
            pivot.calibrate_pivot(other)


def test_orientation_noise_does_not_hide_a_spin_when_its_size_is_given():
    rng, std_rot = np.random.default_rng(12), np.deg2rad(0.2)
    spin = Rotation.from_rotvec(np.outer(np.linspace(0, 3, 50), [0, 0, 1])).as_matrix()
    T = pivot.touching_poses(spin, TIP, POINT, std_rot, 0.1, rng)
    with pytest.raises(ValueError, match="free along"):
        pivot.calibrate_pivot(T, std_rot, 0.1)
    blind = pivot.calibrate_pivot(
        T
    )  # without it the noise passes for a tilt: a small residual, a tip that is off, a large covariance
    assert blind.std < 1 and abs(blind.tip[2] - TIP[2]) > 10


def test_two_poses_are_never_enough():
    rng = np.random.default_rng(13)
    for T in (pivot.touching_poses(turns(rng, 2, 170), TIP, POINT) for _ in range(20)):
        assert np.linalg.svd(pivot.pivot_matrix(T), compute_uv=False)[5] < 1e-9
        with pytest.raises(ValueError, match="two poses always leave the tip free"):
            pivot.calibrate_pivot(T)


def test_cone_angle_sets_the_smallest_singular_values():
    for angle in np.deg2rad([1, 5, 20, 45]):
        R = pivot.cone(60, angle, turns=0.0)
        s = pivot.calibrate_pivot(pivot.touching_poses(R, TIP, POINT)).singular_values
        along, across = (
            np.cos(angle),
            (1 + np.cos(angle)) / 2,
        )  # singular values of the mean rotation, the second one twice
        expected = np.sqrt(60 * np.array([1 - along, 1 - across, 1 - across]))
        np.testing.assert_allclose(s[3:], expected, rtol=1e-6)


def test_a_cone_with_one_turn_is_a_single_axis():
    R = pivot.cone(30, np.deg2rad(25), turns=1.0)
    np.testing.assert_allclose(R @ R[0].T @ [0, 0, 1], np.tile([0, 0, 1.0], (30, 1)), atol=1e-12)
    with pytest.raises(ValueError, match="free along"):
        pivot.calibrate_pivot(pivot.touching_poses(R, TIP, POINT))


def test_tilted_points_the_tool_axis():
    d = np.random.default_rng(14).normal(size=(50, 3))
    d = np.vstack([d, [0, 0, 1.0], [0, 0, -2.0], [1e-9, 0, 1]])
    R = pivot.tilted(d, spin=0.7)
    np.testing.assert_allclose(R[..., 2], d / np.linalg.norm(d, axis=1, keepdims=True), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(R), 1)


@pytest.mark.parametrize(
    "call, text",
    [
        (lambda: pivot.calibrate_pivot(np.eye(4)), r"shape \(n, 4, 4\)"),
        (lambda: pivot.calibrate_pivot(np.full((5, 4, 4), np.nan)), "finite"),
        (lambda: pivot.calibrate_pivot(np.tile(np.eye(4), (4, 1, 1)), robust=True), "at least 5"),
        (lambda: pivot.calibrate_pivot(measured(np.random.default_rng(0), 5), std_rot=1e-3), "come together"),
        (lambda: pivot.calibrate_pivot(measured(np.random.default_rng(0), 5), 1e-3, 0.0), "std_trans must be positive"),
        (lambda: pivot.solve_pivot(np.ones((9, 6)), np.ones(9)), "rank is 1"),
        (lambda: pivot.solve_pivot(np.ones((9, 6)), np.ones(8)), "shapes"),
        (lambda: pivot.pivot_covariance(np.ones((6, 6)), np.ones(6)), "more than 6 rows"),
        (lambda: pivot.pivot_covariance(np.ones((9, 6)), np.ones(9)), "rank 6"),
        (lambda: robust.tukey_weights([1.0], 0.0, 5.0), "std must be positive"),
        (lambda: robust.tukey_weights([1.0], 1.0, 0.0), "cut must be positive"),
        (lambda: pivot.touching_poses(np.eye(3), TIP, POINT, 1e-3), "rng must be given"),
        (lambda: pivot.predicted_covariance(np.eye(3)[None], TIP, 1e-3, 0.1), "do not fix the tip"),
        (lambda: pivot.tilted([0.0, 0.0, 0.0]), "must not be zero"),
        (lambda: pivot.cone(0, 0.1), "n must be a whole number, at least 1, got 0"),
    ],
)
def test_bad_input_is_refused_in_words(call, text):
    with pytest.raises(ValueError, match=text):
        call()


def test_the_robust_standard_deviation_is_that_of_gaussian_noise():
    """3 x 900 residual numbers tell it to 1.4 %; the weights alone would leave 4 % too little."""
    T = measured(np.random.default_rng(21), 900)
    plain, found = pivot.calibrate_pivot(T), pivot.calibrate_pivot(T, robust=True)
    assert found.std == pytest.approx(plain.std, rel=0.015)


def test_a_small_singular_value_is_told_and_none_is_called_nothing():
    spin = pivot.touching_poses(Rotation.from_rotvec(np.outer(np.linspace(0, 3, 9), [0, 0, 1])).as_matrix(), TIP, POINT)
    with pytest.raises(ValueError, match="singular value is practically nothing of the largest"):
        pivot.refuse_free_tip(spin, 1e-6)
    few = measured(np.random.default_rng(4), 9)
    ratio = 1 / np.linalg.cond(pivot.pivot_matrix(few))
    with pytest.raises(ValueError, match=f"singular value is {ratio:.1e} of the largest"):
        pivot.refuse_free_tip(few, 0.9)
    pivot.refuse_free_tip(few, 0.9 * ratio)


@pytest.mark.parametrize("axis", np.vstack([np.eye(3), -np.eye(3), [[0.6, -0.8, 0], [-0.6, 0, 0.8], [0, -0.6, -0.8]]]))
def test_the_free_direction_is_told_with_its_largest_part_positive(axis):
    T = pivot.touching_poses(Rotation.from_rotvec(np.outer(np.linspace(0, 3, 12), axis)).as_matrix(), TIP, POINT)
    upward = np.sign(axis[np.abs(axis).argmax()]) * axis + 0.0
    words = ", ".join(f"{x:.2f}" for x in upward)
    with pytest.raises(ValueError, match=rf"free along \({words}\)"):
        pivot.calibrate_pivot(T)
    A = pivot.pivot_matrix(T)
    with pytest.raises(ValueError, match="rank 6"):
        pivot.pivot_covariance(A, np.ones(len(A)))


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_of_exact_poses_all_count(unit):
    """Rounding is no outlier, also where a coordinate is zero; one that is off by more than rounding is."""
    T = pivot.touching_poses(turns(np.random.default_rng(2), 15), TIP, POINT)
    T[:, :3, 3] *= unit
    T = np.concatenate([T, pivot.touching_poses(np.eye(3)[None], unit * TIP, unit * np.array([12.0, -8.0, 0.0]))])
    T[-1] = T[0]
    np.testing.assert_allclose(pivot.calibrate_pivot(T, robust=True).weights, 1.0, atol=0.2)
    T[3, 0, 3] += 1e-3 * unit
    weights = pivot.calibrate_pivot(T, robust=True).weights
    assert weights[3] == 0 and np.delete(weights, 3).min() > 0.7
