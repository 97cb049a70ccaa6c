"""What the lecture prints: its circle drive and the numbers of its worked examples.

Source: lecture "Lokalisierung"; data/dead_reckoning, data/kalman.
"""

from dataclasses import dataclass

import numpy as np

from ...checks import as_positive_number
from ...tables import read_table

# --- the lecture's worked examples -------------------------------------------


def example(name):
    """Printed numbers of a worked example as {name: value}; name is "fusion" or "vehicle" (see data/kalman)."""
    if name not in ("fusion", "vehicle"):
        raise ValueError(f'name must be "fusion" or "vehicle", got {name!r}')
    table = read_table(f"kalman/{name}.csv", text=("name", "unit"))
    return dict(zip(table["name"].tolist(), table["value"].tolist()))


@dataclass(frozen=True)
class CircleDrive:
    """The lecture's drive: controls (n, 2), time step dt (s), error constants `noise` (k_d, k_theta, k_drift)."""

    controls: np.ndarray
    dt: float
    noise: dict


def circle_drive(dt=None):
    """The lecture's circle drive as a `CircleDrive`; another dt (s) drives the same 14 s in other steps.

    The constants are the squares of the printed standard deviations over their way, degrees turned to radians.
    Source: lecture, section "Koppelnavigation", page "Simulation"; data/dead_reckoning.
    """
    given = _circle_table()
    duration = given["dt"] * given["steps"]
    dt = given["dt"] if dt is None else as_positive_number(dt, "dt")
    if not duration / 1e6 <= dt <= duration:
        raise ValueError(f"dt must lie between {duration / 1e6:g} s and the drive's {duration:g} s, got {dt:g}")
    u = [given["v"], np.radians(given["omega_deg"])]
    return CircleDrive(np.tile(u, (round(duration / dt), 1)), dt, _noise(given, given["std_distance_per_meter"]))


def example_noise():
    """The error constants that the lecture gives as examples ("z.B."), {"k_d", "k_theta", "k_drift"}.

    (0.05 m)^2 per m, (5 deg)^2 per turn of 360 deg and (2 deg)^2 per m, degrees turned to radians. The simulated circle
    drive has a smaller k_d: `circle_drive().noise`.
    Source: lecture, pages "Fehlermodell fuer Steuerbefehl (1)" and "(2)"; data/dead_reckoning.
    """
    given = _circle_table()
    return _noise(given, given["std_distance_per_meter_example"])


def _circle_table():
    table = read_table("dead_reckoning/circle_drive.csv", text=("name", "unit"))
    return dict(zip(table["name"].tolist(), table["value"].tolist()))


def _noise(given, std_distance):
    """Variances per way (m^2/m, rad^2/rad, rad^2/m) from standard deviations after 1 m, one turn and 1 m."""
    return {
        "k_d": std_distance**2,
        "k_theta": np.radians(given["std_heading_per_turn_deg"]) ** 2 / (2 * np.pi),
        "k_drift": np.radians(given["std_heading_per_meter_deg"]) ** 2,
    }
