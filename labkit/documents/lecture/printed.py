"""What the lecture prints: its circle drive, its table of methods and the numbers of its worked examples.

Lengths are m. Source: lecture "Lokalisierung"; data/dead_reckoning, data/kalman.
"""

import functools
from dataclasses import dataclass

import numpy as np

from ...checks import as_positive_number, shown
from ...tables import read_table


def constants(name):
    """Numbers that the lecture prints one by one.

    Parameters
    ----------
    name : str
        "circle_drive" (the simulated drive) or "sensors" (laser scanner and depth camera).

    Returns
    -------
    constants : dict
        {name: number}; the units stand in data/dead_reckoning.

    Source: lecture, pages "Simulation", "Fehlermodell für Steuerbefehl (1)" and "(2)", "2D-Laser-Scanner" and
    "RGBD-Kamera".
    """
    return _by_name(f"dead_reckoning/{name}")


def example(name):
    """Numbers of a worked example of the Kalman filter.

    Parameters
    ----------
    name : str
        "fusion" or "vehicle".

    Returns
    -------
    numbers : dict
        {name: number}; the units stand in data/kalman.

    Raises
    ------
    ValueError
        For any other name.

    Source: lecture, Kalman filter; the pages stand in data/kalman.
    """
    if name not in ("fusion", "vehicle"):
        raise ValueError(f'name must be "fusion" or "vehicle", got {name!r}')
    return _by_name(f"kalman/{name}")


def digits(file):
    """Numbers that the lecture prints one by one, digit by digit.

    Parameters
    ----------
    file : str
        "kalman/fusion", "kalman/vehicle", "dead_reckoning/circle_drive" or "dead_reckoning/sensors".

    Returns
    -------
    texts : dict
        {name: str}
    """
    table = read_table(f"{file}.csv", text=("name", "value", "unit"))
    return dict(zip(table["name"].tolist(), table["value"].tolist()))


def _by_name(file):
    return dict(_named(file))


@functools.cache
def _named(file):
    table = read_table(f"{file}.csv", text=("name", "unit"))
    return tuple(zip(table["name"].tolist(), table["value"].tolist()))


@functools.cache
def methods():
    """The table of localization methods: what each can do, how accurately, with which sensors, and with a map or not.

    Returns
    -------
    methods : dict
        {column: array (4,) of str}: method, local, global, accuracy, sensors, map.

    Source: lecture, page "Übersicht über Lokalisierungsverfahren", translated; data/dead_reckoning.
    """
    return read_table(
        "dead_reckoning/methods.csv", text=("method", "local", "global", "accuracy", "sensors", "map")
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class CircleDrive:
    """The lecture's drive: controls (n, 2) in m/s and rad/s, time step dt (s), `noise` (k_d, k_theta, k_drift).

    k_d is m^2 per m, k_theta rad^2 per rad, k_drift rad^2 per m.
    """

    controls: np.ndarray
    dt: float
    noise: dict


def circle_drive(dt=None):
    """The lecture's circle drive; the constants are the squares of the printed standard deviations over their way.

    Parameters
    ----------
    dt : float, s, optional
        Drive the same 14 s in other steps.

    Returns
    -------
    CircleDrive

    Raises
    ------
    ValueError
        When dt is longer than the drive, or shorter than a millionth of it.

    Source: lecture, section "Koppelnavigation", page "Simulation"; data/dead_reckoning.
    """
    given = constants("circle_drive")
    duration = given["dt"] * given["steps"]
    dt = given["dt"] if dt is None else as_positive_number(dt, "dt")
    if not duration / 1e6 <= dt <= duration:
        raise ValueError(
            f"dt must lie between {shown(duration / 1e6)} s and the drive's {shown(duration)} s, got {shown(dt)}"
        )
    u = [given["v"], np.radians(given["omega_deg"])]
    return CircleDrive(np.tile(u, (round(duration / dt), 1)), dt, _noise(given, given["std_distance_per_meter"]))


def example_noise():
    """The error constants that the lecture gives as examples ("z.B."): a larger k_d than its simulated drive has.

    (0.05 m)^2 per m, (5 deg)^2 per turn of 360 deg and (2 deg)^2 per m, degrees turned to radians.

    Returns
    -------
    noise : dict
        {"k_d", "k_theta", "k_drift"}: float, m^2 per m, rad^2 per rad, rad^2 per m.

    See Also
    --------
    circle_drive

    Source: lecture, pages "Fehlermodell fuer Steuerbefehl (1)" and "(2)"; data/dead_reckoning.
    """
    given = constants("circle_drive")
    return _noise(given, given["std_distance_per_meter_example"])


def _noise(given, std_distance):
    """Variances per way (m^2/m, rad^2/rad, rad^2/m) from standard deviations after 1 m, one turn and 1 m."""
    return {
        "k_d": std_distance**2,
        "k_theta": np.radians(given["std_heading_per_turn_deg"]) ** 2 / (2 * np.pi),
        "k_drift": np.radians(given["std_heading_per_meter_deg"]) ** 2,
    }
