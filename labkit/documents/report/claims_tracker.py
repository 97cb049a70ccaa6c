"""Report, sections 2 and 3, conclusion and appendices B and D: packet, data sheet, table D against itself,
contradictions, motions."""

import numpy as np

from ...geometry import frames
from ...machines import simulation
from ...machines.accuracy import tracking_errors
from ...machines.arm import REACH_FLANGE, REACH_WRIST, SHOULDER_OFFSET, TX40, forward_kinematics, wrist_reach
from ...machines.packet import FIELDS, PACKET
from ..ledger import Computed, computes
from .printed import COLUMNS, COPIED, POSES, RUNS, UPSIDE_DOWN, corrected_runs, motions, packet_bytes, table_d
from .reconstruction import synthetic_table

NOTEBOOK = "06_tracker"


@computes("tracker.packet")
def packet():
    size = PACKET.size // len(FIELDS)
    return Computed(np.array([f"{size * i}-{size * i + size - 1}" for i in range(len(FIELDS))]))


@computes("tracker.packet_size")
def packet_size():
    last = packet_bytes()[-1]
    return Computed(f"0-{PACKET.size - 1}" if last.endswith(f"-{PACKET.size - 1}") else "another size")


@computes("tracker.run")
def entries():
    """Each entry of the six runs, from the printed average of its column and the five other entries."""
    runs, mean, _, halves = table_d()
    implied = RUNS * mean - (runs.sum(0) - runs)
    implied[:, COLUMNS.index("max_mm")] = RUNS * mean[-2] - (corrected_runs()[:, -2].sum() - corrected_runs()[:, -2])
    bound = RUNS * halves[RUNS] + halves[:RUNS].sum(0) - halves[:RUNS]
    least = np.rad2deg(np.sqrt(1.5 * runs[:, COLUMNS.index("E_rot")] * (POSES - 1) / POSES))
    implied[COPIED], bound[COPIED] = least[COPIED[0]], 0.0
    misprint = np.zeros(runs.shape, bool)
    misprint[UPSIDE_DOWN] = abs(implied[UPSIDE_DOWN] - 9) < 1e-9
    misprint[COPIED] = runs[COPIED] == runs[COPIED[0], COLUMNS.index("mean_deg")] and least[COPIED[0]] > runs[COPIED]
    proof = (
        "Six times the average less the five others gives each entry; run 3's largest error comes out as "
        f"{implied[UPSIDE_DOWN]:.3f} mm, not 6. Run 4's largest angle equals its mean angle, and its E_rot alone "
        f"demands at least {least[COPIED[0]]:.3f} deg (root mean square of the angles)."
    )
    return Computed(implied, bound, misprint, proof=proof)


@computes("tracker.average")
def averages():
    halves = table_d().half_units
    return Computed(
        corrected_runs().mean(0), halves[:RUNS].mean(0), proof="The averages of the printed entries, run 3 with 9 mm."
    )


@computes("tracker.variance")
def variances():
    """Printed "Rozptyl": divided by 6, not by 5."""
    runs, halves = corrected_runs(), table_d().half_units[:RUNS]
    spread = 2 * (np.abs(runs - runs.mean(0)) * halves).mean(0) + (halves**2).mean(0)
    return Computed(
        runs.var(0), spread, proof=f"Divided by {RUNS}; the sample variance (by {RUNS - 1}) would be 20 % larger."
    )


@computes("tracker.block")
def results_block():
    """The results block of section 3.1 from the averages as appendix D prints them, in its order and units."""
    _, mean, _, halves = table_d()
    m = dict(zip(COLUMNS, mean))
    half = dict(zip(COLUMNS, halves[RUNS]))
    order = ("x", "y", "z", "qx", "qy", "qz", "qw", "mean_mm", "max_mm", "E_rot", "mean_deg")
    scale = np.array([1000.0] * 3 + [1.0] * 8)
    proof = f"The printed average is {m['mean_mm']:.9f} mm, which rounds to {m['mean_mm']:.3f}."
    wrong = np.array([name == "mean_mm" for name in order])
    return Computed(scale * [m[n] for n in order], scale * [half[n] for n in order], wrong, proof=proof)


@computes("tracker.block_max_deg")
def largest_angle():
    """The average of the largest angles, without the entry that cannot be right."""
    runs = table_d().runs[:, -1]
    kept = np.delete(runs, COPIED[0])
    proof = (
        f"One of the averaged maxima, {runs[COPIED[0]]}, copies a mean; the other five average {kept.mean():.3f} deg."
    )
    return Computed(kept.mean(), misprint=True, proof=proof)


def _least_e_trans():
    """What equation (17) can at least be, in mm, for the printed mean errors: the mean is never above the root mean
    square."""
    mean_mm = table_d().mean[COLUMNS.index("mean_mm")]
    return mean_mm * np.sqrt(POSES) / (POSES - 1)


@computes("tracker.E_trans_unit")
def unit_of_e_trans():
    printed, least = table_d().mean[COLUMNS.index("E_trans")], _least_e_trans()
    inside = least <= 1000 * printed <= 2 * least
    return Computed(
        "m" if inside else "mm",
        misprint=inside,
        proof=f"A mean error of 2.666 mm over {POSES} poses makes equation (17) at least {least:.2f} mm. The printed "
        f"{printed:.6f} is {1000 * printed:.2f} mm when read in m, and 800 times too small in mm.",
    )


@computes("tracker.block_E_trans")
def e_trans_in_block():
    printed, least = 1000 * table_d().mean[COLUMNS.index("E_trans")], _least_e_trans()
    return Computed(
        printed,
        misprint=least > 8e-4,
        proof=f"The results block prints the average of appendix D, {printed / 1000:.6f}, as millimeters. Its mean "
        f"error makes equation (17) at least {least:.2f} mm: the number is in m, {printed:.2f} mm.",
    )


@computes("tracker.E_rot_unit")
def unit_of_e_rot():
    """Equation (13) has no unit; for a null vector of length 1 it is 2/3 of the sum of squared angles (rad) over N -
    1."""
    mean = dict(zip(COLUMNS, table_d().mean))
    angle = np.rad2deg(np.sqrt(1.5 * mean["E_rot"] * (POSES - 1) / POSES))
    return Computed(
        "1",
        misprint=mean["mean_deg"] < angle < 1.5 * mean["mean_deg"],
        proof=f"Without a unit, as the block of section 3.1 prints it, {mean['E_rot']:.3e} means an rms angle of "
        f"{angle:.3f} deg, in keeping with the printed mean of {mean['mean_deg']:.3f} deg.",
    )


def _mounting_angle_deg():
    q = table_d().mean[3:7]
    return float(np.rad2deg(frames.rotation_angle(frames.matrix_from_quaternion(q))))


@computes("tracker.turned_180")
def half_turn():
    angle = _mounting_angle_deg()
    return Computed(
        angle,
        proof=f"The printed quaternion turns by {angle:.2f} deg; a half turn about z would read (0, 0, 1, 0). The "
        f"flange frame may include it already.",
    )


@computes("tracker.orientation_negligible")
def orientation_negligible():
    runs, mean, _, _ = table_d()
    spread = np.rad2deg(2 * np.linalg.norm(runs[:, 3:6].std(0)))
    angle = _mounting_angle_deg()
    noise = mean[COLUMNS.index("mean_deg")]
    return Computed(
        "negligible" if angle < noise else "not negligible",
        proof=f"The identified turn of {angle:.2f} deg is {angle / noise:.1f} times the mean error of a reading and "
        f"{angle / spread:.0f} times the spread over the six runs.",
    )


@computes("tracker.conclusion_offset")
def offset_after_half_turn():
    """The mounting seen with x and y reversed, as a half turn about z would, beside the conclusion's offset."""
    x, y, z = 1000 * table_d().mean[:3]
    proof = (
        f"Appendix D and section 3.1 give {z:.2f} mm; the conclusion's 65.3 mm is {65.3 - z:.1f} mm more, and a "
        "half turn about z leaves z alone."
    )
    return Computed(np.array([-x, -y, z]), 1000 * table_d().half_units[RUNS][:3], proof=proof)


@computes("tracker.speed_claim_unit")
def unit_of_angular_speed_claim():
    fastest = motions()["w_high"].max()
    return Computed(
        "deg/s",
        misprint=fastest < 5,
        proof=f"A mean error of 5 rad/s would exceed the fastest angular speed of all motions, {fastest} rad/s; the "
        f"conclusion speaks of 3 deg/s.",
    )


@computes("tracker.speed_claim")
def angular_speed_claims():
    """Mean error claimed in section 3.2 against the largest one claimed in the conclusion."""
    return Computed(
        3.0,
        proof="A mean of 5 deg/s (section 3.2) cannot exceed the 3 deg/s that the conclusion states as the largest "
        "error: the two do not hold together. Which of them is meant, the report does not show.",
    )


@computes("tracker.reach")
def reaches():
    """Data-sheet reaches from the DH model, mm: axis 1 to 6, R.M, R.m1, R.m2, R.b."""
    fold = TX40.q_max[2]
    folded, stretched = (
        wrist_reach(TX40, [0, 0, fold, 0, 0, 0]),
        wrist_reach(TX40, [0, np.pi / 2, 0, 0, 0, 0]),
    )
    flange = forward_kinematics(TX40.dh, [0, np.pi / 2, 0, 0, 0, 0])
    away = np.hypot(stretched[0], SHOULDER_OFFSET)
    half_degree = np.deg2rad(0.5)
    shorter = wrist_reach(TX40, [0, 0, fold - half_degree, 0, 0, 0])
    values = np.array([flange[0, 3], stretched[0], folded[0], folded[1], folded[2]])
    bound = np.array([0.0, 0.0, shorter[0] - folded[0], shorter[1] - folded[1], 0.0])
    return Computed(
        values,
        bound,
        proof=f"The elbow's limit is printed as 138 deg: half a degree of rounding moves this reach by {bound[3]:.1f} "
        f"mm. All reaches are measured in the plane of the arm: with the shoulder offset the wrist gets {away:.1f} mm "
        "away from axis 1.",
    )


@computes("tracker.d6")
def wrist_to_flange():
    return Computed((REACH_FLANGE - REACH_WRIST) / 1000)


@computes("tracker.motion")
def motion_speeds():
    """Speeds of the simulated motions: 20 % and 100 % quantile of the speed (m/s) and the angular speed (rad/s) of the
    tracker."""
    rows = []
    for name in simulation.MOTIONS:
        v, w = simulation.motion_speeds(name)
        rows.append([np.quantile(v, 0.2) / 1000, v.max() / 1000, np.quantile(w, 0.2), w.max()])
    rows = np.array(rows)
    return Computed(
        rows,
        0.35 * rows,
        simulated=True,
        proof="Path and timing were not published; a path of seven points, run in 10, 5 and 2.5 s.",
    )


@computes("tracker.motion_turn")
def turning_speed():
    w = simulation.motion_speeds("rotation")[1]
    return Computed(w.max(), simulated=True, proof="The tracker turns about its own axes; its angle was not published.")


@computes("tracker.mean_error")
def mean_errors_in_motion():
    """Mean errors of the simulated motions, nonsense included: mm and deg, over slow, middle and fast."""
    errors = []
    for k, name in enumerate(simulation.MOTIONS):
        motion = simulation.simulate_motion(name, np.random.default_rng([40, k]))
        e = tracking_errors(motion.time, motion.T_true, motion.T_read)
        errors.append([e.translation.mean(), np.rad2deg(e.rotation.mean()), np.median(e.translation)])
    errors = np.array(errors)
    proof = (
        f"Simulated with {100 * simulation.MOVING.nonsense * simulation.MOVING.burst:.0f} % nonsense: the means of "
        "slow, middle and fast are "
        + ", ".join(f"{mm:.0f} mm / {deg:.1f} deg" for mm, deg, _ in errors)
        + ", the medians "
        + ", ".join(f"{median:.1f} mm" for median in errors[:, 2])
        + "."
    )
    return Computed(errors[:, :2].mean(0), np.array([6.0, 0.6]), simulated=True, proof=proof)


@computes("tracker.calibration_error")
def calibration_errors():
    """Averages over the six synthetic runs, in the order mean mm, mean deg, max mm, E_trans mm, E_rot."""
    average = synthetic_table().mean(0)
    return Computed(
        average[[9, 10, 11, 7, 8]] * [1, 1, 1, 1000, 1],
        np.array([0.5, 0.1, 4.0, 0.3, 1.5e-5]),
        simulated=True,
        proof="Six synthetic runs with a systematic error of 2 mm and 0.28 deg per axis that depends on the place.",
    )
