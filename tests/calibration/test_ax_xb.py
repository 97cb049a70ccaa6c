"""A X = X B: the report's method and maximum likelihood against closed forms, SciPy and the Cramer-Rao bound."""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from labkit.calibration import ax_xb
from labkit.fast import ax_xb as fast_ax_xb
from labkit.geometry.frames import invert, pose, pose_distance
from labkit.geometry.lie import exp_so3, skew

T_FS = pose(exp_so3([0.3, -0.5, 1.1]), [30.0, -20.0, 120.0])
T_BT = pose(exp_so3([2.0, 0.4, -0.3]), [700.0, 80.0, -150.0])


def setup(rng, n=20, std_rot=0.0, std_trans=0.0, axes=None, angle=np.pi / 3):
    """Robot poses and readings with noise in the axes of the target and of S."""
    turn = rng.normal(size=(n, 3)) if axes is None else axes * rng.normal(size=(n, 1))
    turn *= angle * rng.uniform(0.1, 1, (n, 1)) / np.linalg.norm(turn, axis=1, keepdims=True)
    T_BF = pose(exp_so3(turn), rng.uniform(-200, 200, (n, 3)))
    T_ST = invert(T_FS) @ invert(T_BF) @ T_BT
    noisy = pose(
        T_ST[:, :3, :3] @ exp_so3(std_rot * rng.normal(size=(n, 3))),
        T_ST[:, :3, 3] + std_trans * rng.normal(size=(n, 3)),
    )
    return T_BF, noisy


def motions(T_BF, T_ST):
    return invert(T_BF[0]) @ T_BF[1:], T_ST[0] @ invert(T_ST[1:])


def error(T):
    """Rotation vector and translation error of a mounting, shape (6,)."""
    return np.concatenate([Rotation.from_matrix(T[:3, :3].T @ T_FS[:3, :3]).as_rotvec(), T_FS[:3, 3] - T[:3, 3]])


def test_kronecker_matrix_is_the_textbook_product():
    rng = np.random.default_rng(0)
    A, B = Rotation.random(4, random_state=1).as_matrix(), Rotation.random(4, random_state=2).as_matrix()
    expected = np.concatenate([np.kron(np.eye(3), a) - np.kron(b.T, np.eye(3)) for a, b in zip(A, B)])
    np.testing.assert_allclose(ax_xb.kronecker_matrix(A, B), expected, atol=1e-15)
    X = rng.normal(size=(3, 3))
    np.testing.assert_allclose(
        expected @ X.ravel(order="F"),
        np.concatenate([(a @ X - X @ b).ravel(order="F") for a, b in zip(A, B)]),
        atol=1e-13,
    )


@pytest.mark.parametrize("n", [3, 20])
def test_both_methods_are_exact_without_noise(n):
    T_BF, T_ST = setup(np.random.default_rng(n), n)
    for T in (ax_xb.solve_ax_xb(*motions(T_BF, T_ST)), ax_xb.calibrate_hand_eye(T_BF, T_ST).T_FS):
        angle, distance = pose_distance(T, T_FS)
        assert angle < 1e-10 and distance < 1e-8
    angle, distance = pose_distance(ax_xb.calibrate_hand_eye(T_BF, T_ST).T_BT, T_BT)
    assert angle < 1e-10 and distance < 1e-8


def test_singular_values_of_two_motions_in_closed_form():
    """For one motion by the angle t the values are 0 (three times), 2 sin(t/2) (four) and 2 sin t (two); parallel axes
    only add up."""
    t = 0.7
    R = exp_so3([0, 0, t])
    M = ax_xb.kronecker_matrix(R[None], R[None])
    expected = np.sort([0, 0, 0, *[2 * np.sin(t / 2)] * 4, *[2 * np.sin(t)] * 2])[::-1]
    np.testing.assert_allclose(np.linalg.svd(M, compute_uv=False), expected, atol=1e-12)


def test_parallel_axes_are_refused_with_the_reason():
    T_BF, T_ST = setup(np.random.default_rng(4), 10, axes=np.array([0.0, 0, 1]))
    with pytest.raises(ValueError, match="parallel or nothing turns"):
        ax_xb.solve_ax_xb(*motions(T_BF, T_ST))
    with pytest.raises(ValueError, match=r"turn about one axis, \(0.000, 0.000, 1.000\) in the base"):
        ax_xb.calibrate_hand_eye(T_BF, T_ST)
    with pytest.raises(ValueError, match=r"in the flange"):
        ax_xb.calibrate_hand_eye(T_BF, T_ST, eye="to hand")
    still = np.tile(np.eye(4), (5, 1, 1))
    with pytest.raises(ValueError, match="only translate"):
        ax_xb.calibrate_hand_eye(still, np.tile(T_ST[0], (5, 1, 1)))


def least_squares_fit(T_BF, T_ST, std_rot, std_trans):
    """The same maximum of the likelihood from SciPy, with matrix exponentials and no derivatives of our own."""

    def at(d):
        return T_FS @ expm(hat(d[:6])), T_BT @ expm(hat(d[6:]))

    def residuals(d):
        X, Y = at(d)
        predicted = np.linalg.inv(X) @ np.linalg.inv(T_BF) @ Y
        turn = Rotation.from_matrix(np.swapaxes(predicted[:, :3, :3], 1, 2) @ T_ST[:, :3, :3]).as_rotvec()
        return np.concatenate([(turn / std_rot).ravel(), ((T_ST - predicted)[:, :3, 3] / std_trans).ravel()])

    fit = least_squares(
        residuals, np.zeros(12), method="lm", x_scale=np.tile([1e-3] * 3 + [1.0] * 3, 2), xtol=1e-14, ftol=1e-14
    )
    return at(fit.x), fit


def hat(xi):
    return np.block([[skew(xi[:3]), xi[3:, None]], [np.zeros((1, 4))]])


@pytest.mark.parametrize("deg, mm", [(0.1, 0.1), (0.1, 1.0), (0.5, 0.1), (0.5, 1.0)])
def test_maximum_likelihood_is_scipys(deg, mm):
    std_rot = np.deg2rad(deg)
    T_BF, T_ST = setup(np.random.default_rng([7, int(10 * mm)]), 20, std_rot, mm)
    ours = ax_xb.calibrate_hand_eye(T_BF, T_ST, std_rot, mm)
    (X, Y), fit = least_squares_fit(T_BF, T_ST, std_rot, mm)
    scale = np.sqrt(np.diagonal(ours.covariance))
    angle, distance = pose_distance(ours.T_FS, X)
    assert angle < 2e-3 * scale[:3].min() + 1e-7 and distance < 2e-3 * scale[3:6].min() + 1e-5
    angle, distance = pose_distance(ours.T_BT, Y)
    assert angle < 2e-3 * scale[6:9].min() + 1e-7 and distance < 2e-3 * scale[9:].min() + 1e-5
    J = fit.jac
    information = (
        J.T @ J
    )  # in twists at the solution: to first order the same rotations, translations turned into the axes of F and B
    turn = np.zeros((12, 12))
    for k, T in ((0, X), (6, Y)):
        turn[k : k + 3, k : k + 3], turn[k + 3 : k + 6, k + 3 : k + 6] = np.eye(3), T[:3, :3]
    expected = turn @ np.linalg.inv(information) @ turn.T
    size = np.sqrt(np.diagonal(expected))
    np.testing.assert_allclose(ours.covariance / np.outer(size, size), expected / np.outer(size, size), atol=0.03)


def test_accuracy_reaches_the_bound_and_the_covariance_is_honest():
    """400 runs of 20 poses for each noise case, noise levels not told: rms error within 5 % of the Cramer-Rao bound.

    Every fourth run also with the levels told: mean NEES 6 over all cases (standard error 0.17; the full measurement is
    tests/bench/hand_eye_bound.py).
    """
    nees = []
    for deg, mm in ((0.1, 0.1), (0.1, 1.0), (0.5, 0.1), (0.5, 1.0)):
        std_rot = np.deg2rad(deg)
        rng = np.random.default_rng([61, int(10 * deg), int(10 * mm)])
        squares, bounds = [], []
        for k in range(400):
            T_BF, T_ST = setup(rng, 20, std_rot, mm)
            e = error(ax_xb.calibrate_hand_eye(T_BF, T_ST).T_FS)
            squares.append([e[:3] @ e[:3], e[3:] @ e[3:]])
            if k % 4 == 0:
                known = ax_xb.calibrate_hand_eye(T_BF, T_ST, std_rot, mm)
                C, e = known.covariance[:6, :6], error(known.T_FS)
                bounds.append([np.trace(C[:3, :3]), np.trace(C[3:, 3:])])
                nees.append(e @ np.linalg.solve(C, e))
        ratio = np.sqrt(np.mean(squares, axis=0) / np.mean(bounds, axis=0))
        assert (ratio < 1.05).all(), (deg, mm, ratio)
    assert abs(np.mean(nees) - 6) < 0.52, np.mean(nees)


def test_noise_levels_are_estimated_without_bias():
    levels = []
    for k in range(60):
        T_BF, T_ST = setup(np.random.default_rng([8, k]), 30, 0.005, 0.3)
        result = ax_xb.calibrate_hand_eye(T_BF, T_ST)
        turn, gap = result.residuals[:, :3], result.residuals[:, 3:]
        levels.append([np.sqrt((turn**2).sum() / 86), np.sqrt((gap**2).sum() / 82)])
    np.testing.assert_allclose(np.mean(levels, axis=0), [0.005, 0.3], rtol=0.03)


def test_robust_ignores_nonsense_and_says_which():
    rng = np.random.default_rng(9)
    T_BF, T_ST = setup(rng, 30, np.deg2rad(0.1), 0.3)
    bad = rng.choice(30, 6, replace=False)
    T_ST[bad] = T_ST[bad] @ pose(exp_so3(0.4 * rng.normal(size=(6, 3))), 150 * rng.normal(size=(6, 3)))
    plain, robust = ax_xb.calibrate_hand_eye(T_BF, T_ST), ax_xb.calibrate_hand_eye(T_BF, T_ST, robust=True)
    clean = ax_xb.calibrate_hand_eye(np.delete(T_BF, bad, 0), np.delete(T_ST, bad, 0))
    assert set(np.flatnonzero(robust.weights < 0.01)) == set(bad)
    assert pose_distance(plain.T_FS, T_FS)[1] > 10 * pose_distance(clean.T_FS, T_FS)[1]
    assert pose_distance(robust.T_FS, clean.T_FS)[1] < 0.3 and pose_distance(robust.T_FS, clean.T_FS)[0] < 1e-3


def test_shifting_the_base_changes_the_target_alone():
    """Gauge: another base frame moves the target and leaves mounting and residuals."""
    T_BF, T_ST = setup(np.random.default_rng(10), 15, 1e-3, 0.2)
    G = pose(exp_so3([0.2, -1.0, 0.4]), [100.0, -300.0, 50.0])
    one, two = ax_xb.calibrate_hand_eye(T_BF, T_ST), ax_xb.calibrate_hand_eye(G @ T_BF, T_ST)
    np.testing.assert_allclose(one.T_FS, two.T_FS, atol=1e-7)
    np.testing.assert_allclose(G @ one.T_BT, two.T_BT, atol=1e-7)
    np.testing.assert_allclose(one.residuals, two.residuals, atol=1e-7)


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda T: ax_xb.solve_ax_xb(T[:2], T[:3]), "must both have shape"),
        (lambda T: ax_xb.solve_ax_xb(T[:1], T[:1]), "N >= 2"),
        (lambda T: ax_xb.calibrate_hand_eye(T[:2], T[:2]), "N >= 3"),
        (lambda T: ax_xb.calibrate_hand_eye(T * 2, T), "last row"),
        (lambda T: ax_xb.calibrate_hand_eye(T, T, std_rot=-1), "std_rot must be positive"),
    ],
)
def test_refusals(call, words):
    with pytest.raises(ValueError, match=words):
        call(setup(np.random.default_rng(1), 5)[0])


def test_both_steps_of_the_report_are_exact_on_exact_motions():
    A = pose(exp_so3(np.random.default_rng(8).uniform(-1, 1, (4, 3))), np.arange(12.0).reshape(4, 3))
    B = invert(T_FS) @ A @ T_FS
    R, values = ax_xb.rotation_from_kronecker(ax_xb.kronecker_matrix(A, B))
    np.testing.assert_allclose(R, T_FS[:3, :3], atol=1e-12)
    assert values[-1] < 1e-7 < 1e-2 < values[-2]
    t, gaps = ax_xb.translation_from_motions(A, B, R)
    np.testing.assert_allclose(t, T_FS[:3, 3], atol=1e-9)
    np.testing.assert_allclose(gaps, 0, atol=1e-9)


def whitened(result):
    by_turns, by_gaps = ax_xb.loop_jacobians(result.T_BF, result.T_FS, result.T_BT, result.T_ST)
    return np.concatenate([by_turns / result.std[0], by_gaps / result.std[3]])


@pytest.mark.parametrize("std_rot, std_trans", [(2e-3, 0.1), (1e-4, 3.0)])
def test_each_noise_level_pays_for_the_unknowns_it_determines(std_rot, std_trans):
    result = ax_xb.calibrate_hand_eye(*setup(np.random.default_rng(31), 5, std_rot, std_trans))
    J = whitened(result)
    paid = np.diagonal(J @ np.linalg.pinv(J)).reshape(2, -1).sum(1)  # traces of the hat matrix: what each kind fits
    squares = (result.residuals**2).reshape(-1, 2, 3).sum((0, 2))
    np.testing.assert_allclose(result.std[[0, 3]] ** 2, squares / (15 - paid), rtol=0.02)


def test_singular_values_are_those_of_the_whitened_jacobian_with_columns_of_length_one():
    result = ax_xb.calibrate_hand_eye(*setup(np.random.default_rng(32), 8, 2e-3, 0.1))
    J = whitened(result)
    values = np.linalg.svd(J / np.linalg.norm(J, axis=0), compute_uv=False)
    np.testing.assert_allclose(result.singular_values, values, atol=1e-7)


def test_robust_weights_are_shares():
    T_BF, T_ST = setup(np.random.default_rng(33), 20, 2e-3, 0.5)
    T_ST[3, 0, 3] += 100.0
    weights = ax_xb.calibrate_hand_eye(T_BF, T_ST, robust=True).weights
    assert weights[3] == 0 and weights.min() >= 0 and 0.9 < weights.max() <= 1.0


@pytest.mark.parametrize("room", [ax_xb, fast_ax_xb])
def test_a_fit_that_runs_out_of_steps_says_so(room, monkeypatch):
    T_BF, T_ST = setup(np.random.default_rng(34), 8, 0.05, 20.0)
    assert room.calibrate_hand_eye(T_BF, T_ST).converged and room.calibrate_hand_eye(T_BF, T_ST, robust=True).converged
    monkeypatch.setattr(room, "MAX_STEPS", 1)
    assert not room.calibrate_hand_eye(T_BF, T_ST).converged


def test_the_first_robust_rounds_weigh_by_one_over_the_distance_and_the_later_ones_by_tukey(monkeypatch):
    """Seen from outside: the weights handed to the solver, for residuals that stay as they are."""
    rng = np.random.default_rng(2)
    r = rng.normal(size=(12, 6)) * np.array([1e-3] * 3 + [0.2] * 3)
    r[0] *= 3.0
    given = []

    class Still:
        residuals, weights = r, np.ones(12)

    def solve(weights):
        given.append(weights)
        Still.weights = weights
        return Still

    scales = [np.median(np.linalg.norm(part, axis=1)) / 1.5381722544550522 for part in (r[:, :3], r[:, 3:])]
    d = np.hypot(np.linalg.norm(r[:, :3], axis=1) / scales[0], np.linalg.norm(r[:, 3:], axis=1) / scales[1])
    monkeypatch.setattr(ax_xb, "_size", lambda result: 1000.0)
    ax_xb._reweighted(solve, Still)
    np.testing.assert_allclose(given[0], 1 / np.maximum(d, 1.0), rtol=1e-6)
    np.testing.assert_allclose(given[ax_xb.LOOSE_ROUNDS], np.maximum(1 - (d / ax_xb.TUKEY) ** 2, 0) ** 2, rtol=1e-6)
    assert d.max() > ax_xb.TUKEY > 1 and len(given) == ax_xb.LOOSE_ROUNDS + 1


@pytest.mark.parametrize("room", [ax_xb, fast_ax_xb])
def test_exact_readings_have_the_noise_of_their_rounding(room):
    """At least a billionth of a radian, and of the longest coordinates of robot and sensor together; how much more
    rounding leaves, up to the root of a double's precision, depends on the processor.
    """
    T_BF, T_ST = setup(np.random.default_rng(40), 12)
    result = room.calibrate_hand_eye(T_BF, T_ST)
    units = [1.0, np.abs(T_BF[:, :3, 3]).max() + np.abs(T_ST[:, :3, 3]).max()]
    for std in (result.std[[0, 3]], result.history[-1, :2]):
        relative = std / units
        assert (relative > 1e-9 * (1 - 1e-9)).all() and (relative < 1e-7).all()


@pytest.mark.parametrize("room", [ax_xb, fast_ax_xb])
@pytest.mark.parametrize("robust", [False, True])
@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_the_unit_of_length_changes_lengths_alone(room, robust, unit):
    T_BF, T_ST = setup(np.random.default_rng(41), 12, 1e-3, 0.2)
    T_ST[4, 1, 3] += 50.0
    plain = room.calibrate_hand_eye(T_BF, T_ST, robust=robust)
    for T in (T_BF, T_ST):
        T[:, :3, 3] *= unit
    other = room.calibrate_hand_eye(T_BF, T_ST, robust=robust)
    lengths = np.repeat([1.0, unit, 1.0, unit], 3)
    np.testing.assert_allclose(other.T_FS[:3, :3], plain.T_FS[:3, :3], atol=1e-7)
    np.testing.assert_allclose(other.T_FS[:3, 3] / unit, plain.T_FS[:3, 3], atol=1e-5)
    np.testing.assert_allclose(other.weights, plain.weights, atol=1e-4)
    np.testing.assert_allclose(other.std / lengths[:6], plain.std, rtol=1e-4)
    size = np.sqrt(np.diagonal(plain.covariance))
    correlations = other.covariance / np.outer(lengths * size, lengths * size)
    np.testing.assert_allclose(correlations, plain.covariance / np.outer(size, size), atol=1e-3)


@pytest.mark.parametrize(
    ("n", "tilt", "refused"), [(2, 1.2, True), (2, 3.0, False), (200, 1.2, True), (200, 3.0, False)]
)
def test_how_far_from_parallel_axes_must_be_does_not_depend_on_their_number(n, tilt, refused):
    """Half of the motions turn about z, half about an axis tilted by some millionths of a radian."""
    turns = np.tile([[0.0, 0, 1], [0, tilt * 1e-6, 1]], (n // 2, 1))
    A = pose(exp_so3(np.pi / 2 * turns), np.random.default_rng(5).uniform(-99, 99, (n, 3)))
    B = invert(T_FS) @ A @ T_FS
    if refused:
        with pytest.raises(ValueError, match="parallel"):
            ax_xb.solve_ax_xb(A, B)
    else:
        ax_xb.solve_ax_xb(A, B)
