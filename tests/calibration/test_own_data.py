"""The models behind the calibration of one's own data: derivatives by differences, noise beside the plain fit."""

import numpy as np

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
    np.testing.assert_allclose(model.noise(r, J, np.ones(5, bool)), plain.std[[0, 3]], rtol=0.05)
