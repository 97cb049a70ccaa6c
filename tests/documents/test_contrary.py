"""No word that agrees is read from a table, and a word cannot be moved as a number can. So each is computed once more
in a contrary world, where what it is computed from is another: a word that comes out there too would be typed.
"""

import csv
from types import SimpleNamespace

import numpy as np
import pytest

from labkit.calibration import literature
from labkit.documents import ledger
from labkit.documents.circular import AGREEING
from labkit.documents.lecture import claims_kalman, claims_monte_carlo
from labkit.documents.report import claims_tracker
from labkit.documents.rounding import half_unit
from labkit.documents.thesis import claims_hand_eye, claims_optimization, printed, wells
from labkit.localization import odometry, particles
from labkit.machines import robot_accuracy
from labkit.tables import DATA

WORDS = {
    row.id: row
    for row in ledger.rows()
    if row.kind in ledger.COUNTED and row.status in AGREEING and half_unit(row.printed) is None
}
VALUE, TABLE, STATEMENTS, LI = wells.value, printed.table_7_1, claims_tracker.statements, literature.li_rotation
BUILDING = SimpleNamespace(points=range(3), grid=SimpleNamespace(cells=np.zeros((3000, 3000))))
STRAYING = SimpleNamespace(truth=np.zeros((3, 3)), estimates=np.ones((2, 3)), odometry=np.zeros((3, 3)))
SHARES = {"newton": (0.9, 0.0, 0.0, 0.1), "gauss_newton": (0.5, 0.0, 0.5, 0.0), "trust_region": (0.1, 0.0, 0.9, 0.0)}
FEWER = ({"Gauss-Newton": 5, "trust region": 9}, {"Gauss-Newton": np.array([9]), "trust region": np.array([4])})


def turned(x, u, dt, model):
    """A step to the left of the heading, turned by the way and not by the rate."""
    (v, _), theta = u, x[2]
    return x + dt * np.array([-v * np.sin(theta), v * np.cos(theta), v])


def ends(x, controls, dt, model):
    """Drives whose simplified model alone ends where the exact one does."""
    return np.full((1, 3), {"euler": 0.0, "arc": 0.0}.get(model, 1.0))


def distorted(method):
    table = TABLE(method)
    return table | {
        "mu": table["mu"] * (100 if method == "newton" else 1),
        "iterations": -table["iterations"],
        "start": 1 / table["start"],
    }


def li_from_four(T_BF, x_S):
    if len(T_BF) < 4:
        raise ValueError("one move more")
    return LI(T_BF, x_S)


MC, OPT, HE = claims_monte_carlo, claims_optimization, claims_hand_eye
CONTRARY = {  # rows: where, what, and what stands there in the contrary world
    ("particles.variants",): (MC, "_errors", lambda start: 5.0),
    ("particles.soccer_path",): (MC, "soccer_run", lambda: STRAYING),
    ("particles.field_speed",): (MC, "load_building", lambda: BUILDING),
    ("particles.roulette_cost",): (MC, "_bisections", lambda m: np.full(m, m)),
    ("particles.spoke_cost",): (MC, "_spokes", lambda weights, share: len(weights) ** 2),
    ("particles.spoke_distance",): (np, "searchsorted", lambda ends, spokes: np.zeros(len(spokes), dtype=int)),
    ("particles.copies",): (MC, "_survivors", lambda: np.arange(100)),
    ("particles.spoke_unchanged",): (particles, "resample_systematic", particles.resample_roulette),
    ("odometry.without_half_turn",): (odometry, "drive", ends),
    tuple(f"odometry.F_{name}" for name in ("x_13", "x_23", "u_11", "u_21", "u_32")): (odometry, "step", turned),
    ("kalman.vehicle_B",): (
        claims_kalman,
        "needed_prediction",
        lambda: (np.array([13.0, 5.1]), np.array([0.05, 0.05])),
    ),
    ("tracker.exceeds_guarantee",): (claims_tracker, "statements", lambda: STATEMENTS() | {"largest_position": 0.1}),
    ("optimization.saddle_is_lower",): (wells, "value", lambda x: np.full(len(x), -1e9)),
    ("optimization.gradient_1", "optimization.gradient_2"): (wells, "value", lambda x: VALUE(x) + np.sum(x, axis=-1)),
    ("optimization.H12", "optimization.H21"): (
        OPT,
        "_hessian_errors",
        lambda: {"C7": np.ones((2, 2)), "C9": np.zeros((2, 2))},
    ),
    ("optimization.eq_2_27",): (OPT, "_newton_equations", lambda: ({"(2-27)": "x - d"}, {"(2-27)": ["x + d"]}, 0.0)),
    tuple(
        f"optimization.{what}"
        for what in (
            "stability_newton",
            "stability_trust_region",
            "saddle_gauss_newton",
            "saddle_trust_region",
            "newton_confuses",
        )
    ): (OPT, "_share", lambda method: np.array(SHARES[method])),
    ("optimization.stability_gauss_newton",): (OPT, "_share", lambda m: np.array([m == "gauss_newton", 0, 0, 0.0])),
    tuple(f"optimization.{what}" for what in ("mu_identical", "fewer_iterations", "farthest_start")): (
        printed,
        "table_7_1",
        distorted,
    ),
    ("handeye.stabler", "handeye.faster"): (HE, "_both_methods", lambda: FEWER),
    ("handeye.height_formula",): (HE, "_base", lambda H, a, b: H * a + H * b),
    ("handeye.repeatability_base",): (robot_accuracy, "repeatability", lambda reached: float(np.abs(reached).sum())),
    ("handeye.li_moves",): (literature, "li_rotation", li_from_four),
}


def test_every_word_that_agrees_has_a_contrary_world():
    named = [name for names in CONTRARY for name in names]
    assert sorted(named) == sorted(WORDS)


def test_no_word_that_agrees_stands_in_a_table():
    cells = {c for path in DATA.glob("*/*.csv") for line in csv.reader(path.open(encoding="utf-8")) for c in line}
    assert "coordinate machine" in cells
    assert not {row.printed for row in WORDS.values()} & cells


@pytest.mark.parametrize("name", WORDS)
def test_another_word_comes_out_of_a_contrary_world(name, monkeypatch):
    where, what, instead = next(world for names, world in CONTRARY.items() if name in names)
    function = ledger.function_of(WORDS[name]).__wrapped__  # around its cache
    assert str(function().value) == WORDS[name].printed
    monkeypatch.setattr(where, what, instead)
    assert str(function().value) != WORDS[name].printed
