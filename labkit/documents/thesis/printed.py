"""What the thesis prints: measurements, simulation inputs, start poses, the corrections beside them, table 7-1.

Read from `data/hand_eye/` and `data/optimization/`. KUKA poses are x, y, z (mm), A, B, C (deg); centers are mm.
Source: thesis "Optimierung bei der Kalibrierung von Sensor-Roboter-Systemen", HAW Hamburg 2019, tables 6-2 to 7-5,
listings C10, C14, C16, C17.
"""

import functools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...calibration.hand_eye import sphere_in_scanner
from ...checks import as_points, as_positive_number
from ...geometry import frames
from ...tables import read_table
from .. import rounding

POSE_COLUMNS = ("x", "y", "z", "A_deg", "B_deg", "C_deg")
CENTER_COLUMNS = ("x", "y", "z")
SIMULATED_TURNS = {"z": 3, "y": 4, "x": 5}  # which KUKA angle a line of listing C10 varies


@dataclass(frozen=True, eq=False)
class Measurements:
    """31 robot poses with the sphere's center in each.

    Attributes
    ----------
    kuka_deg : array, shape (31, 6), mm and deg
    x_S : array, shape (31, 3), mm
        In the scanner.
    line : array of str, shape (31,)
        The pattern line "x", "y", "z" or "none".
    angle_deg : array, shape (31,)
    """

    kuka_deg: np.ndarray
    x_S: np.ndarray
    line: np.ndarray
    angle_deg: np.ndarray

    @property
    def T_BF(self):
        """Robot poses as transforms, base <- flange, (31, 4, 4)."""
        return frames.matrix_from_kuka(frames.kuka_from_degrees(self.kuka_deg))


def printed_entries():
    """What listings C14 and C17 print, digit by digit.

    Returns
    -------
    entries : dict
        {(table, pose, column): text}, poses counted from 1.

    Source: thesis, listings C14 (poses) and C17 (centers).
    """
    found = {}
    for table, file, columns in (("C14", "poses", POSE_COLUMNS), ("C17", "centers", CENTER_COLUMNS)):
        data = read_table(f"hand_eye/{file}.csv", text=("axis", *columns))
        for i, pose in enumerate(data["pose"]):
            found.update({(table, int(pose), column): str(data[column][i]) for column in columns})
    return found


def corrections():
    """The entries that are not taken as printed.

    Returns
    -------
    corrections : list of dict
        table, pose (from 1), column, printed, corrected, slip, reason.

    Source: data/hand_eye/corrections.csv; `labkit.documents.misprints` finds them.
    """
    keys = ("table", "column", "printed", "corrected", "slip", "reason")
    data = read_table("hand_eye/corrections.csv", text=keys)
    return [{"pose": int(pose), **{key: str(data[key][i]) for key in keys}} for i, pose in enumerate(data["pose"])]


def measurements(corrected=False):
    """The 31 poses and centers as printed, or with corrections.

    Parameters
    ----------
    corrected : bool or iterable of int
        True applies all corrections, a collection of pose numbers (from 1) those of these poses.

    Returns
    -------
    Measurements

    Source: thesis, listings C14 and C17.
    """
    poses = read_table("hand_eye/poses.csv", text=("axis",))
    centers = read_table("hand_eye/centers.csv", text=("axis",))
    tables = {
        "C14": np.column_stack([poses[c] for c in POSE_COLUMNS]),
        "C17": np.column_stack([centers[c] for c in CENTER_COLUMNS]),
    }
    columns = {"C14": POSE_COLUMNS, "C17": CENTER_COLUMNS}
    wanted = range(1, len(poses["pose"]) + 1) if corrected is True else corrected or ()
    for row in corrections():
        if row["pose"] in wanted:
            tables[row["table"]][row["pose"] - 1, columns[row["table"]].index(row["column"])] = float(row["corrected"])
    return Measurements(tables["C14"], tables["C17"], poses["axis"], poses["angle_deg"])


def measurements_from(entries):
    """The measurements that a dictionary of entries stands for.

    Parameters
    ----------
    entries : dict
        As `printed_entries` returns it.

    Returns
    -------
    Measurements
    """
    line, angle_deg = _pattern()
    numbers = range(1, len(line) + 1)
    kuka_deg = np.array([[float(entries["C14", i, c]) for c in POSE_COLUMNS] for i in numbers])
    x_S = np.array([[float(entries["C17", i, c]) for c in CENTER_COLUMNS] for i in numbers])
    return Measurements(kuka_deg, x_S, line.copy(), angle_deg.copy())


@functools.cache
def _pattern():
    """Pattern line and angle of each pose; read once, for a search asks for thousands of trial tables."""
    printed = measurements()
    return printed.line, printed.angle_deg


def kuka_pose_deg(name):
    """A pose as printed.

    Parameters
    ----------
    name : str
        A name of `data/hand_eye/frames.csv`, which states the place of each.

    Returns
    -------
    pose : array, shape (6,), mm and deg

    Raises
    ------
    ValueError
        For an unknown name, with all known ones.
    """
    data = read_table("hand_eye/frames.csv", text=("name", "place"))
    return _row(data, name, POSE_COLUMNS)


def pose_digits(name):
    """The same with the half units of its digits.

    Parameters
    ----------
    name : str
        As in `kuka_pose_deg`.

    Returns
    -------
    pose : rounding.Printed
        Arrays of shape (6,), mm and deg.
    """
    return rounding.read(
        _row(read_table("hand_eye/frames.csv", text=("name", "place", *POSE_COLUMNS)), name, POSE_COLUMNS)
    )


def frame(name):
    """The same as a transform.

    Returns
    -------
    T : array, shape (4, 4), mm

    See Also
    --------
    kuka_pose_deg
    """
    return frames.matrix_from_kuka(frames.kuka_from_degrees(kuka_pose_deg(name)))


def point(name):
    """A point as printed; names and places stand in `data/hand_eye/points.csv`.

    Returns
    -------
    point : array, shape (3,), mm

    Raises
    ------
    ValueError
        For an unknown name, with all known ones.
    """
    return _row(read_table("hand_eye/points.csv", text=("name", "place")), name, CENTER_COLUMNS)


def point_digits(name):
    """The same with the half units of its digits.

    Parameters
    ----------
    name : str
        As in `point`.

    Returns
    -------
    point : rounding.Printed
        Arrays of shape (3,), mm.
    """
    return rounding.read(
        _row(read_table("hand_eye/points.csv", text=("name", "place", *CENTER_COLUMNS)), name, CENTER_COLUMNS)
    )


def measuring_protocol():
    """What the coordinate machine reports of the calibration body.

    Returns
    -------
    protocol : dict
        {column: array of str, shape (12,)}: feature, nominal, tolerance, actual, deviation (mm), percent.

    Source: thesis, listing C13.
    """
    columns = ("feature", "nominal", "tolerance", "actual", "deviation", "percent")
    return read_table("hand_eye/cmm.csv", text=columns)


def radius(source):
    """A sphere radius, half the printed diameter; sources and places stand in `data/hand_eye/radii.csv`.

    Returns
    -------
    radius : float, mm

    Raises
    ------
    ValueError
        For an unknown source, with all known ones.
    """
    return 0.5 * float(_row(read_table("hand_eye/radii.csv", text=("source", "place")), source, ("diameter",))[0])


def printed_target():
    """Sphere center in the base as the thesis holds it fixed, T_BP x_P'.

    Returns
    -------
    target : array, shape (3,), mm

    Source: thesis, tables 6-4 and 6-5.
    """
    return frames.transform(frame("plate"), point("sphere_in_plate"))


def centers_with_radius(x_S, R, printed_radius=30.0):
    """Sphere centers recomputed for another sphere radius: y' = +-sqrt(y^2 + R^2 - 30^2), the fitted circles staying as
    they are.

    A circle larger than the sphere gives y' = 0.

    Parameters
    ----------
    x_S : array-like, shape (..., 3), mm
    R, printed_radius : float, mm
        The radius to take, and the one that was taken.

    Returns
    -------
    x_S : array, shape (..., 3), mm

    Source: thesis, formula (6-27) and listing C16, which takes R = 30 mm.
    """
    x_S = as_points(x_S, "x_S").copy()
    R, printed_radius = as_positive_number(R, "R"), as_positive_number(printed_radius, "printed_radius")
    x_S[..., 1] = np.sign(x_S[..., 1]) * np.sqrt(np.maximum(x_S[..., 1] ** 2 + R * R - printed_radius**2, 0.0))
    return x_S


class Simulation(NamedTuple):
    """The simulation model of the thesis.

    Attributes
    ----------
    T_BF : array, shape (13, 4, 4), mm
    x_S : array, shape (13, 3), mm
    target : array, shape (3,), mm
    scanner_deg : array, shape (6,), mm and deg
        The true pose of the scanner.
    """

    T_BF: np.ndarray
    x_S: np.ndarray
    target: np.ndarray
    scanner_deg: np.ndarray


def simulation(exact=True, printed=False):
    """The thirteen poses of the simulation model.

    The printed inputs contradict each other. With table 6-2's height z = 20 and B = -90 deg, and the sphere at y = 5
    instead of 0 (the plate at y = 0 instead of -5), all 39 printed sensor coordinates follow to their two decimals; no
    other choice of the printed variants does.

    Parameters
    ----------
    exact : bool
        Sensor coordinates to full precision; False takes the two decimals of listing C10.
    printed : bool
        The contradictory inputs of listing C10 as they stand (z = 10, B = 90 deg, plate at y = -5).

    Returns
    -------
    Simulation

    Source: thesis, table 6-2 and listing C10.
    """
    data = read_table("hand_eye/simulation.csv", text=("axis",))
    flange = kuka_pose_deg("simulated_flange_C10" if printed else "simulated_flange")
    kuka_deg = np.tile(flange, (len(data["axis"]), 1))
    for i, axis in enumerate(data["axis"]):
        kuka_deg[i, SIMULATED_TURNS[axis]] = data["angle_deg"][i]
    T_BF = frames.matrix_from_kuka(frames.kuka_from_degrees(kuka_deg))
    plate = kuka_pose_deg("simulated_plate")
    if not printed:
        plate[1] = 0.0
    target = plate[:3] + point("simulated_sphere")
    scanner = kuka_pose_deg("simulated_scanner_C10" if printed else "simulated_scanner")
    x_S = np.column_stack([data[c] for c in CENTER_COLUMNS])
    if exact and not printed:
        T_FS = frames.matrix_from_kuka(frames.kuka_from_degrees(scanner))
        x_S = sphere_in_scanner(T_BF, T_FS, target)
    return Simulation(T_BF, x_S, target, scanner)


def simulated_digits():
    """The sensor coordinates of the simulation model as printed.

    Returns
    -------
    x_S : rounding.Printed
        Arrays of shape (13, 3), mm. Whole numbers are printed without decimals.

    Source: thesis, listing C10.
    """
    table = read_table("hand_eye/simulation.csv", text=("axis", *CENTER_COLUMNS))
    return rounding.read(np.column_stack([table[c] for c in CENTER_COLUMNS]))


def start_poses_deg():
    """The ten start poses of the comparison.

    Returns
    -------
    poses : array, shape (10, 6), mm and deg
    names : array of str, shape (10,)

    Source: thesis, table 7-2.
    """
    data = read_table("hand_eye/start_poses.csv", text=("name",))
    return np.column_stack([data[c] for c in POSE_COLUMNS]), data["name"]


def iterations_7_3():
    """Iterations that the thesis counts from the ten start poses.

    Returns
    -------
    iterations : dict
        {"Gauss-Newton", "trust region": array (10,)}; NaN where it found no minimum. The trust region's entry 8 belongs
        to a start turned by 0.001 deg about z and x, as the footnote says, and not by 0.005 deg as in table 7-2.

    Source: thesis, table 7-3.
    """
    table = read_table("hand_eye/table_7_3.csv", text=("gauss_newton", "trust_region", "remark"))
    columns = {"Gauss-Newton": "gauss_newton", "trust region": "trust_region"}
    return {
        method: np.array([np.nan if entry == "-" else float(entry) for entry in table[column]])
        for method, column in columns.items()
    }


def footnote_start_deg():
    """The start pose of row 8 of table 7-3 for the trust region, as its footnote changes it.

    Returns
    -------
    pose : array, shape (6,), mm and deg

    Source: thesis, footnote of table 7-3.
    """
    start = start_poses_deg()[0][8].copy()
    start[[3, 5]] = 0.001
    return start


def matrices_66():
    """Rotation parts of the four matrices of table 6-6.

    Returns
    -------
    R : rounding.Printed
        Arrays of shape (4, 3, 3).

    Source: thesis, table 6-6, lines x, y, x*, y*.
    """
    columns = ("c1", "c2", "c3")
    table = read_table("hand_eye/table_6_6.csv", text=("line", *columns))
    return rounding.read(np.column_stack([table[c] for c in columns]).reshape(4, 3, 3))


def roundness_um():
    """Roundness deviations of the sphere in three planes, micrometers.

    Returns
    -------
    deviations : array, shape (3,)

    Source: thesis, listing C11, certificate.
    """
    return read_table("hand_eye/roundness.csv", text=("plane",))["deviation"]


def table_7_1(method):
    """Results of one method on the surface with two minima, local minimum first.

    Parameters
    ----------
    method : str
        "newton", "gauss_newton", "levenberg_marquardt" or "trust_region".

    Returns
    -------
    lines : dict
        {"ideal", "x", "start", "mu": array (2 minima, 2 coordinates), "iterations": array (2,)}.

    Source: thesis, table 7-1.
    """
    table = read_table("optimization/table_7_1.csv", text=("method", "minimum"))
    rows = table["method"] == method
    names = ("ideal", "x", "start", "mu")
    pairs = {name: np.column_stack([table[f"{name}_1"], table[f"{name}_2"]])[rows] for name in names}
    return pairs | {"iterations": table["iterations"][rows]}


LEVELS = {"schlecht": 1, "sehr aufwändig": 1, "aufwändig": 2, "ausreichend": 2, "gut": 3, "sehr gut": 4}
CRITERIA_5_2 = ("implementation", "stability", "adaptation", "accuracy")


def table_4_1():
    """Three ways to calibrate, rated from 1 to 10 under four criteria.

    Returns
    -------
    approaches : dict
        {"cube", "sphere", "laser tracker": {"points": array (4,), "sum": float, "of": float}}; the criteria are the
        body, placing it, taking the data, and solving.

    Source: thesis, table 4-1.
    """
    table = read_table("optimization/table_4_1.csv", text=("approach", "criterion"))
    found = {}
    for name in dict.fromkeys(table["approach"].tolist()):
        rows = table["approach"] == name
        total, most = ({float(entry) for entry in table[column][rows]} for column in ("sum", "of"))
        found[name] = {"points": table["points"][rows], "sum": total.pop(), "of": most.pop()}
    return found


def table_5_2():
    """Methods of minimization, rated in four levels under four criteria.

    Returns
    -------
    methods : dict
        {"group, method": array (4,)}, 1 for the worst level and 4 for the best, in the order of `CRITERIA_5_2`.

    Source: thesis, table 5-2; the words of each level stand below it.
    """
    table = read_table("optimization/table_5_2.csv", text=("group", "method", *CRITERIA_5_2))
    names = [f"{group}, {method}" for group, method in zip(table["group"], table["method"])]
    levels = np.array([[LEVELS[word] for word in table[criterion]] for criterion in CRITERIA_5_2]).T
    return dict(zip(names, levels))


def extrema():
    """The stationary points of function (6-16).

    Returns
    -------
    extrema : dict
        {"saddle", "local minimum", "global minimum": array (3,), f and both coordinates}.

    Source: thesis, section 6.2, "Numerische Lösung".
    """
    table = read_table("optimization/extrema.csv", text=("point",))
    return dict(zip(table["point"].tolist(), np.column_stack([table["f"], table["x1"], table["x2"]])))


def _row(data, name, columns):
    key = "name" if "name" in data else "source"
    found = np.flatnonzero(data[key] == name)
    if len(found) != 1:
        raise ValueError(f"{key} must be one of {', '.join(sorted(data[key]))}, got {name!r}")
    return np.array([data[c][found[0]] for c in columns])
