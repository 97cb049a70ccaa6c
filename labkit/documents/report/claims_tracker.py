"""Report, sections 2 and 3, conclusion and appendices B and D: packet, data sheet, table D against itself,
contradictions, statements."""

from functools import cache, partial
from itertools import permutations

import numpy as np

from ...geometry import frames
from ...machines import simulation, stations
from ...machines.arm import REACH_FLANGE, REACH_WRIST, SHOULDER_OFFSET, TX40, tool_pose, wrist_reach
from ...machines.mounting import calibrate_mounting
from ...machines.packet import FIELDS, PACKET
from .. import rounding
from ..ledger import Computed, computes
from ..slips import HERE, explained_by, single_slips
from .printed import (
    COLUMNS,
    COPIED,
    POSES,
    RUNS,
    UPSIDE_DOWN,
    corrected_runs,
    motions,
    run_minutes,
    statements,
    table_d,
    table_d_texts,
)

NOTEBOOK = "06_tracker"


@computes("tracker.packet")
def packet():
    size = PACKET.size // len(FIELDS)
    text = [f"{size * i}-{size * i + size - 1}" for i in range(len(FIELDS))]
    return Computed(np.array(text), proof="Fields of 8 bytes that follow each other.")


def _rms_angle_deg(E_rot):
    """Root mean square angle of a run that an E_rot without unit means: it is 2/3 of their squares over N - 1."""
    return np.rad2deg(np.sqrt(1.5 * max(E_rot, 0.0) * (POSES - 1) / POSES))


def _column_agrees(texts):
    """Whether six entries, their average and their variance agree, each as printed."""
    (entries, mean, variance), halves = np.split(rounding.read(texts).values, [6, 7]), rounding.read(texts).halves
    average, slack = rounding.propagate(np.mean, rounding.Printed(entries, halves[:6]))
    spread, loose = rounding.propagate(np.var, rounding.Printed(entries, halves[:6]))
    return abs(average - mean[0]) <= slack + halves[6] and abs(spread - variance[0]) <= loose + halves[7]


@computes("tracker.run")
def entries():
    """Run 3's largest error from its column, run 4's largest angle from its own E_rot."""
    runs, mean, _, _ = table_d()
    texts, value, slips = table_d_texts(), runs.copy(), {}
    names = [HERE if k == UPSIDE_DOWN[0] else f"run {k + 1}" for k in range(RUNS)] + ["average", "variance"]
    column = dict(zip(names, texts[:, UPSIDE_DOWN[1]].tolist()))
    slips[UPSIDE_DOWN] = explained_by(column, lambda d: _column_agrees(list(d.values())))
    value[UPSIDE_DOWN] = RUNS * mean[UPSIDE_DOWN[1]] - np.delete(runs[:, UPSIDE_DOWN[1]], UPSIDE_DOWN[0]).sum()

    def ordered(d):
        return float(d["mean"]) <= _rms_angle_deg(float(d["E_rot"])) <= float(d[HERE])

    run = dict(zip(COLUMNS, texts[COPIED[0]].tolist()))
    slips[COPIED] = explained_by({HERE: run["max_deg"], "mean": run["mean_deg"], "E_rot": run["E_rot"]}, ordered)
    value[COPIED] = _rms_angle_deg(float(run["E_rot"]))
    proof = (
        f"Six times the average less the five others gives run 3's largest error: {value[UPSIDE_DOWN]:.3f} mm, not "
        "6; of all single slips in the column, its average and its variance only this entry's explains it. Run 4's "
        f"largest angle equals its mean angle, and its E_rot alone demands at least {value[COPIED]:.3f} deg (root "
        "mean square of the angles); no slip in mean or E_rot helps."
    )
    return Computed(value, slips=slips, proof=proof)


@cache
def _six_runs():
    """The printed entries, run 3 with 9 mm, with the half units of their digits."""
    return rounding.Printed(corrected_runs(), table_d().half_units[:RUNS])


@computes("tracker.average")
def averages():
    value, bound = rounding.propagate(lambda runs: runs.mean(0), _six_runs())
    return Computed(value, bound, proof="The averages of the printed entries, run 3 with 9 mm.")


@computes("tracker.variance")
def variances():
    """Printed "Rozptyl": divided by 6, not by 5."""
    value, bound = rounding.propagate(lambda runs: runs.var(0), _six_runs())
    proof = f"Divided by {RUNS}; the sample variance (by {RUNS - 1}) would be 20 % larger."
    return Computed(value, bound, proof=proof)


@computes("tracker.block")
def results_block():
    """The results block of section 3.1 from the averages as appendix D prints them, in its order and units."""
    texts = dict(zip(COLUMNS, table_d_texts()[RUNS]))
    order = ("x", "y", "z", "qx", "qy", "qz", "qw", "mean_mm", "max_mm", "E_rot", "mean_deg", "max_deg")
    scale = np.array([1000.0] * 3 + [1.0] * 9)
    value, bound = rounding.propagate(lambda mean: scale * mean, rounding.read([texts[n] for n in order]))
    average = table_d().runs[:, COLUMNS.index("mean_mm")].mean()

    def holds(d):
        mean = float(d["average"])
        as_averaged = abs(mean - average) <= rounding.half_unit(d["average"])
        return as_averaged and abs(mean - float(d[HERE])) <= rounding.half_unit(d[HERE])

    found = explained_by({HERE: "2.667", "average": texts["mean_mm"]}, holds)
    proof = (
        f"The printed average is {value[7]:.9f} mm, which the six runs give to the last digit, as in all other "
        f"columns; it rounds to {value[7]:.3f}."
    )
    return Computed(value, bound, slips={(7,): found}, proof=proof)


def _e_trans_range(scale):
    """What equation (17) can be (mm) for the printed mean and largest errors: mean <= root mean square <= largest."""
    mean = dict(zip(COLUMNS, table_d().mean))
    return scale * mean["mean_mm"], scale * mean["max_mm"]


@computes("tracker.E_trans_unit")
def unit_of_e_trans():
    scale, texts = np.sqrt(POSES) / (POSES - 1), table_d_texts()[: RUNS + 1, COLUMNS.index("E_trans")]
    least, most = _e_trans_range(scale)

    def holds(d):
        values = np.array([float(d[k]) for k in range(RUNS + 1)]) * {"mm": 1.0, "m": 1000.0}[d[HERE]]
        return bool(((least <= values) & (values <= most)).all())

    printed = {HERE: "mm"} | dict(enumerate(texts.tolist()))
    found = explained_by(printed, holds, lambda text: ("m",) if text == "mm" else single_slips(text))
    average, mean = float(texts[RUNS]), dict(zip(COLUMNS, table_d().mean))
    return Computed(
        "mm" if holds(printed) else found[HERE][0],
        slips=found,
        proof=f"Mean and largest errors of {mean['mean_mm']:.3f} and {mean['max_mm']:.3f} mm over {POSES} poses keep "
        f"equation (17) between {least:.2f} and {most:.2f} mm. The printed {average:.6f} is {1000 * average:.2f} mm "
        f"when read in m, and at least {least / average:.0f} times too small in mm; a slip in one entry would not move "
        "the six others.",
    )


@computes("tracker.block_E_trans")
def e_trans_in_block():
    printed, (least, most) = table_d().mean[COLUMNS.index("E_trans")], _e_trans_range(np.sqrt(POSES) / (POSES - 1))
    return Computed(
        printed,
        proof=f"The results block prints the average of appendix D, {printed:.6f}, as millimeters, like its heading. "
        f"Between {least:.2f} and {most:.2f} mm is possible: the number is in m, {1000 * printed:.2f} mm.",
    )


@computes("tracker.E_rot_unit")
def unit_of_e_rot():
    """Equation (13) has no unit; for a null vector of length 1 it is 2/3 of the sum of squared angles (rad) over N -
    1."""
    texts = table_d_texts()[: RUNS + 1]
    mean, largest, E_rot = (texts[:, COLUMNS.index(name)] for name in ("mean_deg", "max_deg", "E_rot"))

    def holds(d):
        runs = [k for k in range(RUNS + 1) if k != COPIED[0]]
        angles = np.array([_rms_angle_deg(float(d[k])) for k in runs])
        angles = np.deg2rad(angles) if d[HERE] == "deg" else angles
        return bool(((mean[runs].astype(float) <= angles) & (angles <= largest[runs].astype(float))).all())

    printed = {HERE: "deg"} | dict(enumerate(E_rot.tolist()))
    found = explained_by(printed, holds, lambda text: ("1",) if text == "deg" else single_slips(text))
    angle = _rms_angle_deg(float(E_rot[RUNS]))
    return Computed(
        "deg" if holds(printed) else found[HERE][0],
        slips=found,
        proof=f"Without a unit, as the block of section 3.1 prints it, {float(E_rot[RUNS]):.3e} means an rms angle of "
        f"{angle:.3f} deg, between the printed mean of {mean[RUNS]} and the printed largest of {largest[RUNS]} deg, "
        "and so in each run; read in degrees it is far below the mean.",
    )


def _mounting_angle_deg():
    q = table_d().mean[3:7]
    return float(np.rad2deg(frames.rotation_angle(frames.matrix_from_quaternion(q))))


@computes("tracker.turned_180")
def half_turn():
    return Computed(
        None,
        proof=f"The printed quaternion turns by {_mounting_angle_deg():.2f} deg; a half turn about z would read "
        "(0, 0, 1, 0). The flange frame may include it already: the report does not say, so nothing is refuted.",
    )


@computes("tracker.orientation_negligible")
def orientation_negligible():
    angle, mean = _mounting_angle_deg(), dict(zip(COLUMNS, table_d().mean))
    return Computed(
        None,
        proof=f"The identified turn is {angle:.2f} deg. It is {angle / mean['mean_deg']:.1f} times the mean error of a "
        f"reading, equals the mean largest one ({mean['max_deg']:.3f} deg), and is within the maker's "
        f"{statements()['orientation_precision']:.0f} deg: the yardstick decides, and none is stated.",
    )


@computes("tracker.conclusion_offset")
def offset_after_half_turn():
    """The mounting seen with x and y reversed, as a half turn about z would, beside the conclusion's offset."""
    mean = rounding.read(table_d_texts()[RUNS, :3])
    value, bound = rounding.propagate(lambda m: 1000 * m * [-1, -1, 1], mean)
    said = statements()["offset_z"]
    proof = (
        f"Appendix D and section 3.1 give ({-value[0]:.2f}, {-value[1]:.2f}, {value[2]:.2f}) mm. With the half turn "
        f"of the text x and y come out; the conclusion's {said:g} mm is {said - value[2]:.1f} "
        "mm more than z, which a half turn about z leaves alone."
    )
    return Computed(value, bound, proof=proof)


@computes("tracker.mean_angular_speed")
def mean_angular_speed():
    """The mean error of section 3.2 against the largest error of the conclusion and the fastest motion."""
    said, fastest = statements(), motions()["w_high"].max()
    largest = np.deg2rad(said["largest_angular_speed"])
    return Computed(
        largest,
        proof=f"A mean of 5 rad/s exceeds the fastest motion, {fastest} rad/s, and the {largest:.3f} rad/s (3 "
        "deg/s) that the conclusion calls the largest error. 5 deg/s would still exceed it; 0.05 rad/s, which is 2.9 "
        "deg/s, would not. The report does not tell which is meant.",
    )


@computes("tracker.exceeds_guarantee")
def exceeds_guarantee():
    said = statements()
    beyond = (
        said["largest_position"] > said["precision"] and said["largest_orientation"] > said["orientation_precision"]
    )
    return Computed(
        "překračují" if beyond else "nepřekračují",
        proof=f"{said['largest_position']:.0f} mm and {said['largest_orientation']:.0f} deg against the maker's "
        f"precision of {said['precision']:.0f} mm and {said['orientation_precision']:.0f} deg; against its accuracy "
        f"of {said['accuracy']:.0f} mm as well.",
    )


def _unpublished():
    return Computed(
        None,
        proof="The logs of section 3.2 were never published, and no printed number leads to this one. Chapter "
        "6 simulates such a run; what comes out there depends on the noise that is put in.",
    )


for _id in (
    "mean_position",
    "mean_orientation",
    "mean_speed",
    "largest_position",
    "largest_orientation",
    "largest_speed",
    "largest_angular_speed",
):
    computes(f"tracker.{_id}")(partial(_unpublished))


@computes("tracker.drift")
def drift_between_the_runs():
    """What of the claim appendix D can show: a trend of its columns over the times in the names of its files."""
    minutes, runs = run_minutes(), corrected_runs()
    orders = minutes[list(permutations(range(RUNS)))]
    orders = orders - minutes.mean()
    chance = {}
    for name, column in zip(COLUMNS, runs.T):
        if np.ptp(column) > 0:
            slopes = np.abs(orders @ column)
            chance[name] = float((slopes >= slopes[0] * (1 - 1e-9)).mean())
    least = min(chance, key=chance.get)
    return Computed(
        None,
        proof=f"No drift within a motion is printed. The six runs of appendix D span {minutes[-1]:.0f} minutes, and in "
        f"none of {len(chance)} columns is the trend one that chance would make less often than in "
        f"{chance[least]:.2f} of all 720 orders ({least}): nothing there speaks against the claim.",
    )


@computes("tracker.independent_of_speed")
def independent_of_speed():
    """What a lag within the maker's latency adds to the printed mean errors, squares added."""
    said, fastest = statements(), 1000 * motions()["v_high"][:3]
    lags = 1e-3 * said["latency"] * fastest
    mean = said["mean_position"]
    return Computed(
        None,
        proof=f"The maker allows {said['latency']:.0f} ms. At the highest speeds of the three motions that is "
        + ", ".join(f"{lag:.1f}" for lag in lags)
        + f" mm, which makes {mean:.0f} mm at rest {np.hypot(mean, lags[0]):.1f} mm in the slow and "
        f"{np.hypot(mean, lags[-1]):.1f} mm in the fast motion: nearly independent, though a smaller lag or none "
        "would be so as well.",
    )


@computes("tracker.clamped_stations")
def clamped_stations():
    """By how much one of two stations must rock for errors ten times as large as those of appendix D."""
    joints = simulation.measuring_joints()
    T_BF, T_BE = simulation.flange_poses(joints), tool_pose(TX40, joints, simulation.T_FE)
    rng = np.random.default_rng(2018)
    actual = stations.last_turned(stations.STATIONS, 1e-3 * rng.normal(size=(len(T_BE), 3)))
    read = stations.read_poses(T_BE, stations.STATIONS, actual, rng)
    found = calibrate_mounting(T_BF, frames.invert(read[0]) @ read, factor=1e9)
    per_mrad, printed = found.translation[1:].mean(), table_d().mean[COLUMNS.index("mean_mm")]
    return Computed(
        None,
        proof=f"Two simulated stations, 3.6 m apart: one that is turned by 1 mrad per axis at each stop makes a mean "
        f"error of {per_mrad:.1f} mm. About {10 * printed / per_mrad:.0f} mrad "
        f"({np.rad2deg(0.01 * printed / per_mrad):.1f} deg) make ten times the printed {printed:.2f} mm. Possible; "
        "that it was so, nothing printed shows.",
    )


@computes("tracker.reach")
def reaches():
    """Smallest reaches R.m1, R.m2 (mm) of the folded arm, from the elbow's limit and the largest reaches."""

    def folded(limit_deg):
        return wrist_reach(TX40, [0, 0, np.deg2rad(limit_deg[0]), 0, 0, 0])[:2]

    limit = rounding.read([f"{np.rad2deg(TX40.q_max[2]):.0f}"])
    value, bound = rounding.propagate(folded, limit)
    away = np.hypot(wrist_reach(TX40, [0, np.pi / 2, 0, 0, 0, 0])[0], SHOULDER_OFFSET)
    return Computed(
        value,
        bound,
        proof=f"The elbow's limit is printed as 138 deg: half a degree of rounding moves this reach by {bound[1]:.1f} "
        f"mm. All reaches are measured in the plane of the arm: with the shoulder offset the wrist gets {away:.1f} "
        "mm away from axis 1.",
    )


@computes("tracker.d6")
def wrist_to_flange():
    """The last link from appendix B: the reach to axis 6 less the reach to axis 5."""
    return Computed((REACH_FLANGE - REACH_WRIST) / 1000)
