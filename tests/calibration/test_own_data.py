"""The models behind the calibration of one's own data: derivatives by differences, noise beside the plain fit."""

import numpy as np
from scipy import stats

from labkit.calibration import ax_xb, own_data
from labkit.estimation.differences import numeric_jacobian
from labkit.geometry.frames import invert, pose
from labkit.geometry.lie import exp_so3

T_FS = pose(exp_so3([0.4, -0.2, 0.9]), np.array([40.0, -30.0, 110.0]))
T_BT = pose(exp_so3([-0.3, 0.5, 2.0]), np.array([600.0, 50.0, -100.0]))


def readings(n=12, std_rot=2e-3, std_trans=0.3):
    rng = np.random.default_rng(n)
    T_BF = pose(exp_so3(rng.uniform(-1, 1, (n, 3))), rng.uniform(-200, 200, (n, 3)))
    T_ST = invert(T_FS) @ invert(T_BF) @ T_BT
    T_ST[:, :3, :3] = T_ST[:, :3, :3] @ exp_so3(std_rot * rng.normal(size=(n, 3)))
    T_ST[:, :3, 3] += std_trans * rng.normal(size=(n, 3))
    return T_BF, T_ST


def moved(T, change):
    return pose(T[:3, :3] @ exp_so3(change[:3]), T[:3, 3] + change[3:])


def test_derivative_of_the_hand_eye_readings():
    model = own_data.HandEyeModel(*readings())

    def residuals(change):
        return model.linearize((moved(T_FS, change[:6]), moved(T_BT, change[6:])))[0].ravel()

    numeric = numeric_jacobian(residuals, np.zeros(12), np.array([1e-6] * 3 + [1e-4] * 3 + [1e-6] * 3 + [1e-4] * 3))
    exact = model.linearize((T_FS, T_BT))[1].reshape(-1, 12)
    size = np.linalg.norm(exact, axis=0)
    np.testing.assert_allclose(numeric / size, exact / size, atol=5e-3)  # first order in the noise


def test_noise_of_all_rows_is_that_of_the_plain_fit():
    T_BF, T_ST = readings(5)
    model, plain = own_data.HandEyeModel(T_BF, T_ST), ax_xb.calibrate_hand_eye(T_BF, T_ST)
    r, J = model.linearize((plain.T_FS, plain.T_BT))
    noise = model.noise(r, J, np.ones(5, bool))
    np.testing.assert_allclose(noise.std, plain.std[[0, 3]], rtol=0.05)
    np.testing.assert_allclose(noise.freedom.sum(), 5 * 6 - 12, rtol=1e-9)  # all parameters are paid for


def test_an_error_over_an_estimated_noise_follows_the_law_of_hotelling():
    """Four touches of a tip are a linear problem with f = 12 - 6 degrees of freedom, so NEES f / (f - 2) / 6 follows
    F(6, f) exactly; 800 fixed draws beside it by the test of Kolmogorov and Smirnov, at odds of 1e-6."""
    rng, R, scores = np.random.default_rng(4), exp_so3(np.random.default_rng(3).uniform(-0.7, 0.7, (4, 3))), []
    tip, point = np.array([10.0, -20.0, 150.0]), np.array([500.0, 0.0, 30.0])
    for _ in range(800):
        model = own_data.PivotModel(pose(R, point - R @ tip + 0.1 * rng.normal(size=(4, 3))))
        found, every = model.fitted(np.ones(4, bool)), np.ones(4, bool)
        _, J, noise = model.whitened(found, every)
        e = np.concatenate([found[0] - tip, found[1] - point])
        N = np.einsum("nki,nkj->ij", *2 * [model.widened(J, noise)])
        scores.append(e @ N @ e)
    np.testing.assert_allclose(noise.freedom, 6.0)
    assert stats.kstest(np.array(scores) * 6 / 4 / 6, stats.f(6, 6).cdf).pvalue > 1e-6
    assert stats.kstest(np.array(scores) / 6, stats.f(6, 6).cdf).pvalue < 1e-6  # without the widening it would not


def test_noise_that_is_told_widens_nothing():
    model = own_data.HandEyeModel(*readings(5), std=(2e-3, 0.3))
    solution = model.fitted(np.ones(5, bool))
    _, J, noise = model.whitened(solution, np.ones(5, bool))
    assert np.isinf(noise.freedom).all() and (model.widened(J, noise) == J).all()
