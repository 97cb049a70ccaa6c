"""Lecture, Kalman filter: the fusion of two measurements and the correction of the vehicle at k = 50."""

from functools import cache

import numpy as np

from ...estimation import kalman
from .. import rounding
from ..ledger import Computed, computes
from ..slips import HERE, explained_by, single_slips
from . import printed as lecture
from .examples import predict_vehicle, reconstruct_vehicle

NOTEBOOK = "08_kalman"


@computes("kalman.fusion_x")
def fused_position():
    given, texts = lecture.example("fusion"), lecture.digits("kalman/fusion")
    x, bound = rounding.propagate(lambda z: _fusion(given | {"z1": z[0], "z2": z[1]}).x[0], _two_measurements())
    flat = float(_fusion(given | {"var0": 1e12}).x[0])
    std = float(_fusion(given | {"var0": given["var0"] ** 2}).x[0])
    information, least = 1 / _fusion(given).cov[0, 0], given["x1"] - rounding.half_unit(texts["x1"])
    proof = (
        f"{information * x:.1f} / {information:.2f} = {x:.4f}, {least - x:.4f} below what rounds to {texts['x1']}; "
        f"rounding the two measurements moves it by up to {bound:.4f}. Without a prior it is {flat:.4f}, with a "
        f"standard deviation of {texts['var0']} {std:.4f}."
    )
    return Computed(x, bound=bound, proof=proof)


def _two_measurements():
    """Both measured positions as printed, with one decimal; variances are settings of the example, and exact."""
    texts = lecture.digits("kalman/fusion")
    return rounding.read([texts["z1"], texts["z2"]])


def _fusion(given):
    """The update of the printed prior with the two printed measurements."""
    C, cov_z = np.ones((2, 1)), np.diag([given["std1"] ** 2, given["std2"] ** 2])
    return kalman.update([given["x0"]], [[given["var0"]]], [given["z1"], given["z2"]], C, cov_z)


@computes("kalman.fusion_var")
def fused_variance():
    return Computed(_fusion(lecture.example("fusion")).cov[0, 0])


@computes("kalman.fusion_var_index")
def index_of_the_variance():
    """Which of the two variances the printed 0.2 is; a slip in the printed prior is tried as well."""
    given, texts = lecture.example("fusion"), lecture.digits("kalman/fusion")

    def holds(d):
        if float(d["prior"]) < 0:
            return False  # no variance
        result = _fusion(given | {"var0": float(d["prior"])})
        variance = {"Σ_0": float(d["prior"]), "Σ_1": float(result.cov[0, 0])}[d[HERE]]
        near = abs(float(result.x[0]) - given["x1"]) <= rounding.half_unit(texts["x1"]) + fused_position().bound
        return near and abs(variance - given["var1"]) <= rounding.half_unit(texts["var1"])

    printed = {HERE: "Σ_0", "prior": texts["var0"]}
    found = explained_by(printed, holds, lambda text: ("Σ_1",) if text == "Σ_0" else single_slips(text))
    proof = (
        f"The prior's variance is printed as {given['var0']:.0f} above; {_fusion(given).cov[0, 0]:.4f} is the one "
        "after the correction, which the algorithm calls Σ_1. No single slip in the prior makes 0.2 the prior's."
    )
    return Computed("Σ_0" if holds(printed) else found[HERE][0], slips=found, proof=proof)


def _vehicle():
    """Printed numbers of the example, and the printed prior covariance."""
    given = lecture.example("vehicle")
    cov = np.array([[given["prior_cov_xx"], given["prior_cov_xv"]], [given["prior_cov_xv"], given["prior_cov_vv"]]])
    return given, cov


def _rounded(steps):
    """Prediction of so many steps of 0.1 s from rest with 1 m/s^2, from the reconstructed variances in two decimals."""
    return predict_vehicle(steps, 0.1, *np.round(reconstruct_vehicle(_vehicle()[1], steps, 0.1), 2))


def reconstructed():
    """Predicted state and covariance of 51 steps of 0.1 s from rest with 1 m/s^2, from the rounded reconstruction."""
    return _rounded(51)


def _text(name):
    return lecture.digits("kalman/vehicle")[name]


def _needed(posterior, z, cov, var_z):
    """The prediction that a printed correction presupposes: x+ = x + K (z - x) solved for x, then for v."""
    gain = np.array(cov) / (cov[0] + var_z)
    x = (posterior[0] - gain[0] * z) / (1 - gain[0])
    return np.array([x, posterior[1] + gain[1] * (x - z)])


@cache
def needed_prediction():
    """That prediction from the printed numbers, and how far their rounding can move it."""
    posterior, z, cov = (
        rounding.read([_text(name) for name in names])
        for names in (("posterior_x", "posterior_v"), ("z",), ("prior_cov_xx", "prior_cov_xv"))
    )
    var_z = lecture.example("vehicle")["var_z"]
    return rounding.propagate(lambda p, z, cov: _needed(p, z[0], cov, var_z), posterior, z, cov)


def _corrected(prior, cov, z, var_z):
    """State and variance of the position after the correction of a prediction."""
    gain = cov / (cov[0] + var_z)
    return np.array([*(prior + gain * (z[0] - prior[0])), cov[0] * (1 - gain[0])])


def _agrees(d):
    """Whether printed numbers agree, each rounded or cut off: the correction of state and variance, and the model.

    The covariance needs 51 steps of 0.1 s; from rest x = a T^2 n (n - 1) / 2 and v = a T n, so that v = 2 x / (T (n -
    1)).
    """
    prior, cov, z = (
        rounding.read([d[name] for name in names])
        for names in (("prior_x", "prior_v"), ("prior_cov_xx", "prior_cov_xv"), ("z",))
    )
    var_z = float(d["var_z"])
    speed, slack = rounding.propagate(lambda prior: 2 * prior[0] / (0.1 * 50) - prior[1], prior)
    if abs(speed) > slack:
        return False
    values, bounds = rounding.propagate(lambda prior, cov, z: _corrected(prior, cov, z, var_z), prior, cov, z)
    return all(
        abs(value - float(d[name])) <= bound + rounding.half_unit(d[name]) or rounding.is_cut_off(d[name], value)
        for name, value, bound in zip(("posterior_x", "posterior_v", "posterior_cov_xx"), values, bounds)
    )


@computes("kalman.vehicle_prior")
def predicted_state():
    value, bound = needed_prediction()
    without = ("prior_cov_vv", "posterior_cov_xv", "posterior_cov_vv")  # do not enter `_agrees`
    printed = {name: text for name, text in lecture.digits("kalman/vehicle").items() if name not in without}
    model = reconstructed()[0]
    found = explained_by(printed | {"prior_v": f"{model[1]:.2f}"}, _agrees)  # the velocity beside it put right
    proof = (
        f"The printed correction (11.90, 4.98) of 11.79 needs ({value[0]:.3f} +- {bound[0]:.3f}, {value[1]:.3f} +- "
        f"{bound[1]:.3f}) before it; 51 predictions from rest give ({model[0]:.2f}, {model[1]:.2f}) with 1 m/s^2, "
        "which is not printed. 12.5 and 5.0 are a t^2/2 and a t at t = 5 s. No rounding leads to 12.5, and of all "
        f"single slips in the {len(printed)} printed numbers only those in the prediction make correction, covariance "
        f"and model agree. 5.0 alone could be a velocity between {value[1] - bound[1]:.2f} and 5.10 with its further "
        "digits cut off, as 4.98 is: the milder word."
    )
    return Computed(value, bound=bound, slips={(0,): {HERE if key == "prior_x" else key for key in found}}, proof=proof)


@computes("kalman.vehicle_B")
def input_matrix():
    """Which of two input matrices leads to the prediction that the printed correction needs (their velocity agrees)."""
    (needed, bound), time = needed_prediction(), 5.1  # s, 51 steps of 0.1 s
    states = {"(0, T)": reconstructed()[0], "(T^2/2, T)": np.array([time**2 / 2, time])}  # at 1 m/s^2
    hits = [name for name, state in states.items() if (np.abs(state - needed) <= bound).all()]
    euler, exact = (state[0] for state in states.values())
    proof = (
        "A constant acceleration a also moves the position, by a T^2/2 in a step. The printed correction needs "
        f"({needed[0]:.3f} +- {bound[0]:.3f}) m before it: 51 steps with (0, T) give {euler:.2f} m, with (T^2/2, T) "
        f"{exact:.3f} m. The simulation leaves the term out, as the formula does."
    )
    return Computed(" or ".join(hits), proof=proof)


@computes("kalman.vehicle_prior_cov")
def covariance_after_prediction():
    cov, printed = reconstructed()[1], _vehicle()[1]
    var_x0, var_v0, var_a = np.round(reconstruct_vehicle(printed, 51, 0.1), 2)
    half = rounding.half_unit(_text("prior_cov_xx"))
    fits = [str(n) for n in range(40, 61) if (np.abs(_rounded(n)[1] - printed) <= half * (1 + 1e-6)).all()]
    proof = (
        "Time step, starting covariance and noise are not printed. 51 predictions with T = 0.1 s, starting variances "
        f"{var_x0:g} and {var_v0:g}, acceleration noise {np.sqrt(var_a):g} give {cov[0, 0]:.4f}, {cov[0, 1]:.4f}, "
        f"{cov[1, 1]:.4f}; of 40 to 60 predictions with T = 0.1 s, only {', '.join(fits)} reach all printed digits "
        "from variances of two decimals."
    )
    return Computed(cov, simulated=True, proof=proof)


@computes("kalman.vehicle_posterior")
def corrected_state():
    """The correction of the reconstructed prediction; from the printed one neither number comes out."""
    given, cov = _vehicle()
    C, cov_z = [[1.0, 0.0]], [[given["var_z"]]]
    (x, v), bound = rounding.propagate(
        lambda z: kalman.update(*reconstructed(), z, C, cov_z).x, rounding.read([_text("z")])
    )
    printed = kalman.update([given["prior_x"], given["prior_v"]], cov, [given["z"]], C, cov_z).x
    proof = (
        f"The reconstructed prediction gives ({x:.4f}, {v:.4f}): 11.90 comes out, 4.98 is {v:.4f} cut off instead of "
        f"rounded (z moves it by {bound[1]:.4f} at most). From the printed one follows ({printed[0]:.3f}, "
        f"{printed[1]:.3f})."
    )
    return Computed(np.array([x, v]), bound=bound, simulated=True, proof=proof)


@computes("kalman.vehicle_posterior_cov")
def corrected_covariance():
    var_z = lecture.example("vehicle")["var_z"]

    def corrected(entries):
        cov = entries[[[0, 1], [1, 2]]]
        return kalman.update([0.0, 0.0], cov, [0.0], [[1.0, 0.0]], [[var_z]]).cov

    names = ("prior_cov_xx", "prior_cov_xv", "prior_cov_vv")
    value, bound = rounding.propagate(corrected, rounding.read([_text(name) for name in names]))
    return Computed(value, bound=bound)
