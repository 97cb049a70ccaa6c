"""Lecture, Kalman filter: the fusion of two measurements and the correction of the vehicle at k = 50."""

import numpy as np

from ...estimation import kalman
from ..ledger import Computed, computes
from . import printed as lecture
from .examples import predict_vehicle, reconstruct_vehicle

NOTEBOOK = "08_kalman"


@computes("kalman.fusion_x")
def fused_position():
    given = lecture.example("fusion")
    x, rounding = _fusion(given)
    flat = _fusion(given | {"var0": 1e12})[0]
    std = _fusion(given | {"var0": given["var0"] ** 2})[0]
    proof = (
        f"48.2 / 5.05 = {x:.4f}, {9.55 - x:.4f} below what rounds to 9.6; rounding the two measurements moves it "
        f"by up to {rounding:.4f}. Without a prior it is {flat:.4f}, with a standard deviation of 20 {std:.4f}."
    )
    return Computed(x, bound=rounding, proof=proof)


def _fusion(given):
    """Fused position, and how far rounding of the two printed measurements (one decimal) can move it."""
    C, cov_z = np.ones((2, 1)), np.diag([given["std1"] ** 2, given["std2"] ** 2])
    result = kalman.update([given["x0"]], [[given["var0"]]], [given["z1"], given["z2"]], C, cov_z)
    return float(result.x[0]), 0.05 * float(np.abs(result.gain).sum())


@computes("kalman.fusion_var")
def fused_variance():
    given = lecture.example("fusion")
    cov_z = np.diag([given["std1"] ** 2, given["std2"] ** 2])
    return Computed(kalman.update([0.0], [[given["var0"]]], [0.0, 0.0], np.ones((2, 1)), cov_z).cov[0, 0])


def _vehicle():
    """Printed prior covariance, printed numbers, and the gain they give."""
    given = lecture.example("vehicle")
    cov = np.array([[given["prior_cov_xx"], given["prior_cov_xv"]], [given["prior_cov_xv"], given["prior_cov_vv"]]])
    return given, cov, cov[:, 0] / (cov[0, 0] + given["var_z"])


def reconstructed():
    """Predicted state and covariance of 51 steps of 0.1 s from rest with 1 m/s^2, from the rounded reconstruction."""
    _, cov, _ = _vehicle()
    return predict_vehicle(51, 0.1, *np.round(reconstruct_vehicle(cov, 51, 0.1), 3))


@computes("kalman.vehicle_prior")
def predicted_state():
    """The prediction that the printed correction presupposes: x+ = x + K (z - x) solved for x, then for v."""
    given, _, gain = _vehicle()
    x = (given["posterior_x"] - gain[0] * given["z"]) / (1 - gain[0])
    v = given["posterior_v"] + gain[1] * (x - given["z"])
    slack_x = (0.005 + gain[0] * 0.005) / (1 - gain[0])
    bound = np.array([slack_x, 0.005 + gain[1] * (slack_x + 0.005)])
    model = reconstructed()[0]
    proof = (
        f"The printed correction (11.90, 4.98) of 11.79 needs ({x:.3f} +- {bound[0]:.3f}, {v:.3f} +- {bound[1]:.3f})"
        f" before it; 51 predictions from rest give ({model[0]:.2f}, {model[1]:.2f}). 12.5 and 5.0 are a t^2/2 and "
        f"a t at t = 5 s."
    )
    return Computed(np.array([x, v]), bound=bound, misprint=True, proof=proof)


@computes("kalman.vehicle_B")
def input_matrix():
    """Which of two input matrices leads to the prediction that the printed correction needs (their velocity agrees)."""
    needed, time = predicted_state(), 5.1  # s, 51 steps of 0.1 s
    states = {"(0, T)": reconstructed()[0], "(T^2/2, T)": np.array([time**2 / 2, time])}  # at 1 m/s^2
    hits = [name for name, state in states.items() if (np.abs(state - needed.value) <= needed.bound).all()]
    euler, exact = (state[0] for state in states.values())
    proof = (
        "A constant acceleration a also moves the position, by a T^2/2 in a step. The printed correction needs "
        f"({needed.value[0]:.3f} +- {needed.bound[0]:.3f}) m before it: 51 steps with (0, T) give {euler:.2f} m, with "
        f"(T^2/2, T) {exact:.3f} m. The simulation leaves the term out, as the formula does."
    )
    return Computed(" or ".join(hits), proof=proof)


@computes("kalman.vehicle_prior_cov")
def covariance_after_prediction():
    cov = reconstructed()[1]
    proof = (
        "Time step, starting covariance and noise are not printed. 51 predictions with T = 0.1 s, starting variances 1 "
        f"and 0.01, acceleration noise 0.4 give {cov[0, 0]:.4f}, {cov[0, 1]:.4f}, {cov[1, 1]:.4f}; with T = 0.1 s no "
        "number of steps near 50 but 51 gives round parameters."
    )
    return Computed(cov, bound=0.0, simulated=True, proof=proof)


@computes("kalman.vehicle_posterior")
def corrected_state():
    """The correction of the reconstructed prediction; from the printed one neither number comes out."""
    given, cov, _ = _vehicle()
    C, cov_z = [[1.0, 0.0]], [[given["var_z"]]]
    x, v = kalman.update(*reconstructed(), [given["z"]], C, cov_z).x
    printed = kalman.update([given["prior_x"], given["prior_v"]], cov, [given["z"]], C, cov_z).x
    proof = (
        f"The reconstructed prediction gives ({x:.4f}, {v:.4f}): 11.90 comes out, 4.98 is {v:.4f} cut off instead of "
        f"rounded (z moves it by 0.0006 at most). From the printed one follows ({printed[0]:.3f}, {printed[1]:.3f})."
    )
    return Computed(np.array([x, v]), misprint=np.array([False, True]), proof=proof)


@computes("kalman.vehicle_posterior_cov")
def corrected_covariance():
    given, cov, _ = _vehicle()
    return Computed(kalman.update([0.0, 0.0], cov, [0.0], [[1.0, 0.0]], [[given["var_z"]]]).cov)
