"""Thesis, chapters 2.6, 4, 6 and 7 and appendix C: inputs, measured tables, the end pose."""

import functools
import itertools

import numpy as np

from ...calibration import hand_eye
from ...estimation import optimization
from ...estimation.differences import numeric_jacobian
from ...geometry import frames
from .. import misprints
from ..ledger import Computed, computes
from . import listings
from . import printed as thesis

NOTEBOOK = "05_hand_eye"

HALF_LENGTH, HALF_ANGLE = (
    0.005,
    np.deg2rad(0.005),
)  # what rounding to two decimals hides of a length (mm) and an angle (rad)


@functools.cache
def data(*corrected):
    return thesis.measurements(corrected)


@functools.cache
def corrected_data():
    return thesis.measurements(True)


@functools.cache
def joint_fit():
    measured = corrected_data()
    return hand_eye.calibrate_sphere_target(measured.T_BF, measured.x_S)


def rms_at(T_FS, target, measured):
    return float(hand_eye.rms_distance(hand_eye.sphere_residuals(measured.T_BF, measured.x_S, T_FS, target)))


# --- simulation inputs -----------------------------------------------------------------------------------------------


def variants():
    """Largest error (mm) of the 39 sensor coordinates of C10 for each reading (z, B, plate y) of the inputs."""
    found, (_, printed, _, _) = {}, thesis.simulation(exact=False)
    T_BF, _, target, scanner = thesis.simulation()
    for z in (10.0, 20.0):
        for B in (-90.0, 90.0):
            for y in (-5.0, 0.0):
                flange, pose, center = T_BF.copy(), scanner.copy(), target.copy()
                flange[:, 2, 3], pose[4], center[1] = z, B, 5.0 + y
                T_FS = frames.matrix_from_kuka(frames.kuka_from_degrees(pose))
                x_S = frames.transform(frames.invert(T_FS), frames.transform(frames.invert(flange), center))
                found[z, B, y] = np.abs(x_S - printed).max()
    return found


def _consistent_proof():
    found = variants()
    best, second = sorted(found.values())[:2]
    return (
        f"With z = 20, B = -90 deg and the plate at y = 0 all 39 sensor coordinates of C10 follow within {best:.4f} "
        f"mm; the best other reading of the printed inputs misses by {second:.1f} mm."
    )


@computes("handeye.sim_centers")
def simulated_centers():
    x_S = thesis.simulation()[1]
    return Computed(
        x_S,
        bound=0.005,
        proof="The exact coordinate has more digits; the listing cuts it after the second decimal "
        "instead of rounding, which moves it by up to 0.01 mm.",
    )


@computes("handeye.sim_62_centers")
def simulated_centers_of_the_table():
    x_S = thesis.simulation()[1]
    return Computed(x_S[[4, 3, 8, 12]])


@computes("handeye.sim_62_flange", "handeye.sim_C10_flange")
def simulated_flange():
    return Computed(np.array([20.0, 5.0, 20.0, 0.0, 0.0, 0.0]), misprint=True, proof=_consistent_proof())


@computes("handeye.sim_scanner", "handeye.sim_C10_scanner")
def simulated_scanner():
    return Computed(thesis.simulation()[3], misprint=True, proof=_consistent_proof())


@computes("handeye.sim_plate")
def simulated_plate():
    return Computed(
        np.array([25.0, 0.0, 5.0, 0.0, 0.0, 0.0]),
        misprint=True,
        proof=_consistent_proof()
        + " Plate at y = 0, sphere 10 instead of 5 mm above it in y, and flange at y = 0 are the same correction.",
    )


@computes("handeye.sim_sphere")
def simulated_sphere():
    return Computed(thesis.point("simulated_sphere"))


@computes("handeye.sim_poses")
def simulated_poses():
    return Computed(float(len(thesis.simulation()[0])))


# --- table 7-3 -------------------------------------------------------------------------------------------------------


@functools.cache
def listing_runs():
    """The ten runs of listing C5 on the consistent inputs: (last iterate in mm and deg, iterations)."""
    T_BF, x_S, target, _ = thesis.simulation()
    runs = [listings.listing_gauss_newton(start, T_BF, x_S, target)[0] for start in thesis.start_poses_deg()[0]]
    return np.array([run[-1] for run in runs]), np.array([len(run) - 1.0 for run in runs])


@computes("handeye.gn_iterations")
def gauss_newton_iterations():
    return Computed(listing_runs()[1])


@computes("handeye.gn_end")
def gauss_newton_end():
    end = np.round(listing_runs()[0], 9) + 0.0  # what is left below is rounding and differs between machines
    T_BF, x_S, _, scanner = thesis.simulation()
    values = np.linalg.svd(hand_eye.kuka_jacobian(frames.kuka_from_degrees(scanner), T_BF, x_S), compute_uv=False)
    bound = np.array([1e-9, 1e-9, 1e-9, 1e-2, 1e-5, 1e-2])
    turn = np.abs(end[:, 3] + end[:, 5]).max()
    return Computed(
        end,
        bound=np.broadcast_to(bound, end.shape),
        proof=(
            "What is printed beyond the exact 5, 0, 5, 0, -90, 0 is rounding: translation and B to 1e-9, while A and "
            f"C are not determined one by one at B = -90 deg (the last singular value is {values[5] / values[0]:.0e} "
            f"of the first), only their sum, which is {turn:.0e} deg in all ten runs."
        ),
    )


@computes("handeye.gn_end_sum")
def gauss_newton_sum():
    end = np.round(listing_runs()[0], 9) + 0.0
    return Computed(
        end[:, 3] + end[:, 5],
        misprint=True,
        proof=(
            "At B = -90 deg the pose depends on A + C, which is 0 at the minimum; nine of the ten printed rows have "
            "opposite signs, this one has A = C = 4e-4: a sign is missing."
        ),
    )


@functools.cache
def trust_region_runs(radius=10.0, tolerance=1e-6):
    """The ten runs with a trust region in x, y, z, A, B, C (mm, deg), ended by a small gradient: (ends, iterations)."""
    T_BF, x_S, target, _ = thesis.simulation()
    unit = np.array([1, 1, 1, *np.deg2rad([1, 1, 1])])
    runs = [
        optimization.trust_region(
            lambda p: hand_eye.kuka_residuals(p * unit, T_BF, x_S, target),
            lambda p: hand_eye.kuka_jacobian(p * unit, T_BF, x_S) * unit,
            start,
            radius=radius,
            stop=optimization.small_gradient(tolerance),
        )
        for start in thesis.start_poses_deg()[0]
    ]
    return np.array([run.solution for run in runs]), np.array([float(run.iterations) for run in runs])


def _start_cost(i):
    """Sum of squared residuals (mm^2) of a start pose of table 7-2."""
    T_BF, x_S, target, _ = thesis.simulation()
    residuals = hand_eye.kuka_residuals(frames.kuka_from_degrees(thesis.start_poses_deg()[0][i]), T_BF, x_S, target)
    return float(residuals @ residuals)


OTHER_SETTINGS = ((1.0, 1e-6), (100.0, 1e-6), (10.0, 1e-4))  # first radius, gradient tolerance


@computes("handeye.tr_iterations")
def trust_region_iterations():
    counts = trust_region_runs()[1]
    others = np.array([trust_region_runs(*setting)[1] for setting in OTHER_SETTINGS])
    least, most = np.min([counts, *others], axis=0).astype(int), np.max([counts, *others], axis=0).astype(int)
    return Computed(
        counts,
        bound=np.abs(others - counts).max(0),
        simulated=True,
        proof=(
            "The count belongs to a solver, not to the problem. The thesis ran MATLAB's fminunc with the settings of "
            f"listing C6; the trust region of chapter 4 takes {counts.astype(int)} iterations from the ten starts with "
            f"first radius 10 and gradient tolerance 1e-6, and from {least} to {most} with other radii and tolerances."
        ),
    )


@computes("handeye.tr_failure")
def trust_region_failure():
    counts = trust_region_runs()[1].astype(int)
    return Computed(
        "found",
        proof=(
            f"From these starts our trust region arrives in {counts[4]}, {counts[6]} and {counts[9]} iterations. "
            f"Starts 4 and 6 cost {_start_cost(4):.1e} mm^2, less than the solver's tolerance 1e-6: it stops before "
            f"the first step. Start 9 costs {_start_cost(9):.0f} mm^2, and there the derivatives by A and C are "
            "parallel (B = -90.1 deg)."
        ),
    )


@computes("handeye.tr_end")
def trust_region_end():
    T_BF, x_S, _, scanner = thesis.simulation()
    unit = np.array([1, 1, 1, *np.deg2rad([1, 1, 1])])
    J = hand_eye.kuka_jacobian(frames.kuka_from_degrees(scanner), T_BF, x_S) * unit
    values = np.linalg.svd(J, compute_uv=False)
    slack = 1e-3 * np.sqrt(np.diag(np.linalg.pinv(J.T @ J)))  # how far a cost of 1e-6 mm^2 lets each unknown be off
    slack[[3, 5]] = 1.0
    return Computed(
        np.tile(scanner, (10, 1)),
        bound=np.tile(slack, (10, 1)),
        simulated=True,
        proof=(
            f"A solver that stops at 1e-6 mm^2 may end {slack[1]:.1e} mm and {slack[4]:.1e} deg (B) off the minimum; "
            f"A and C are free against each other there (last singular value {values[5] / values[0]:.0e} of the first)."
        ),
    )


# --- the measured tables ---------------------------------------------------------------------------------------------


def _suspects():
    return misprints.find(thesis.printed_entries())


def _correction(pose):
    row = next(row for row in thesis.corrections() if row["pose"] == pose)
    before, after = (
        np.linalg.norm(hand_eye.sphere_residuals(m.T_BF, m.x_S, joint_fit().T_FS, joint_fit().target)[pose - 1])
        for m in (data(), corrected_data())
    )
    return row, f" Residual {before:.2f} mm as printed, {after:.2f} mm corrected ({row['slip']})."


def _misprint(pose):
    row, residuals = _correction(pose)
    return Computed(float(row["corrected"]), misprint=True, proof=row["reason"] + residuals)


for _pose, _id in (
    (2, "C17_z_2"),
    (3, "C14_x_3"),
    (4, "C14_y_4"),
    (7, "C14_x_7"),
    (12, "C14_C_12"),
    (21, "C14_C_21"),
    (30, "C14_x_30"),
):
    computes(f"handeye.{_id}")(functools.partial(_misprint, _pose))


@computes("handeye.table66_x45_x")
def misprint_repeated():
    return _misprint(3)


@computes("handeye.misprint_count")
def misprints_found():
    found = _suspects()
    agreed = [row["pose"] for row in thesis.corrections()]
    if sorted(found) != agreed:
        raise AssertionError(f"the search names {sorted(found)}, the corrections {agreed}")
    return Computed(
        float(31 - len(found)),
        proof="Seven of the 31 rows of C14 and C17 carry a misprint each: poses " + ", ".join(map(str, agreed)) + ".",
    )


@computes("handeye.pattern_step")
def pattern_step():
    """Turn from the third to the fourth column, the mean over the four lines of motion."""
    measured = corrected_data()
    at = {(line, angle): T for line, angle, T in zip(measured.line, measured.angle_deg, measured.T_BF)}
    turns = [
        frames.rotation_angle(at[line, 45.0][:3, :3].T @ at[line, 67.5][:3, :3]) for line in ("x", "y", "x*", "y*")
    ]
    return Computed(
        45 + np.rad2deg(np.mean(turns)),
        misprint=True,
        proof=(
            f"The poses of this column are turned by {np.rad2deg(np.mean(turns)):.2f} deg against those of the 45 "
            "deg column; with steps of 22.5 deg (6-22) the column is 67.5 deg."
        ),
    )


def _table66(name):
    """Matrix of a pose of table 6-6, and how far angles printed to 0.01 deg can move each entry."""
    rad = frames.kuka_from_degrees(thesis.kuka_pose_deg(f"flange_{name}"))
    J = numeric_jacobian(lambda q: frames.matrix_from_kuka(q).ravel(), rad, 1e-6, "central")
    bound = (np.abs(J) @ np.array([0, 0, 0, HALF_ANGLE, HALF_ANGLE, HALF_ANGLE])).reshape(4, 4)
    return Computed(
        frames.matrix_from_kuka(rad),
        bound=bound + 0.00005,
        proof=(
            "Angles printed to 0.01 deg move an entry by up to 0.0001, and the table cuts decimals off instead of "
            "rounding."
        ),
    )


TABLE66 = {"x45": 3, "y45": 10, "x_star45": 19, "y_star45": 27}  # lines of motion and the pose of C14 each shows


def _table66_pose(name, pose):
    """The same pose in C14, which prints the same readings again."""
    return Computed(
        data().kuka_deg[pose - 1],
        bound=0.005 + 1e-9,
        proof=(
            f"C14 prints {data().kuka_deg[pose - 1]} for the same pose: the last digit is cut in one table and "
            "rounded in the other."
        ),
    )


for _name, _pose in TABLE66.items():
    computes(f"handeye.T66_{_name}")(functools.partial(_table66, _name.replace("_star", "*")))
    computes(f"handeye.p66_{_name}")(functools.partial(_table66_pose, _name, _pose))


def _table68(name, pose):
    printed, shown = data().x_S[pose - 1], thesis.point(f"center_{name}")
    return Computed(
        printed,
        bound=np.array([0.0006, 0.0006, 0.005]),
        misprint=True,
        proof=(
            f"C17 prints {printed} for this reading and table 6-8 {shown}: beyond the cut digits they differ by "
            f"{np.abs(printed - shown).max():.4f} mm, too little for the residuals to tell which is right."
        ),
    )


computes("handeye.x68_x_star45")(functools.partial(_table68, "x*45", 19))
computes("handeye.x68_y_star45")(functools.partial(_table68, "y*45", 27))


@computes("handeye.plate_matrix")
def plate_matrix():
    rad = frames.kuka_from_degrees(thesis.kuka_pose_deg("plate"))
    J = numeric_jacobian(lambda q: frames.matrix_from_kuka(q).ravel(), rad, 1e-6, "central")
    bound = (np.abs(J) @ np.array([0, 0, 0, HALF_ANGLE, HALF_ANGLE, HALF_ANGLE])).reshape(4, 4)
    return Computed(
        frames.matrix_from_kuka(rad),
        bound=bound + 0.00005,
        proof="Angles printed to 0.01 deg move an entry by up to 0.0001, and the table cuts decimals off.",
    )


@computes("handeye.start_matrix")
def start_matrix():
    return Computed(thesis.frame("scanner_start"))


# --- the calibration body --------------------------------------------------------------------------------------------


def _body(name):
    x = thesis.point(name)
    return np.linalg.norm(x), np.rad2deg(np.arccos(x / np.linalg.norm(x)))


def _body_angles_proof(name):
    x = thesis.point(name)
    return f"cos = {x / np.linalg.norm(x)} for the printed vector."


for _key, _point in (("cad", "sphere_in_plate_cad"), ("real", "sphere_in_plate")):
    computes(f"handeye.body_{_key}_length")(
        functools.partial(
            lambda name: Computed(_body(name)[0], bound=5e-5 * np.sqrt(3), proof="The vector is printed to 0.0001 mm."),
            _point,
        )
    )
    computes(f"handeye.body_{_key}_angles")(
        functools.partial(
            lambda name: Computed(_body(name)[1], bound=5e-5, misprint=True, proof=_body_angles_proof(name)), _point
        )
    )


@computes("handeye.body_difference")
def body_difference():
    return Computed(thesis.point("sphere_in_plate_cad") - thesis.point("sphere_in_plate"))


@computes("handeye.body_length_difference")
def body_length_difference():
    return Computed(_body("sphere_in_plate_cad")[0] - _body("sphere_in_plate")[0])


@computes("handeye.body_angle_difference")
def body_angle_difference():
    difference = _body("sphere_in_plate_cad")[1] - _body("sphere_in_plate")[1]
    return Computed(
        difference,
        bound=1e-4,
        misprint=True,
        proof=f"The printed vectors give {difference} deg; differences of rounded angles may be off by 0.0001.",
    )


@computes("handeye.body_diameter_difference")
def body_diameter_difference():
    difference = 60.0 - 2 * thesis.radius("coordinate machine")
    return Computed(
        difference,
        misprint=True,
        proof=(
            f"All other rows of the table are CAD minus measured; here that is {difference:.4f} mm: the sign is "
            "missing."
        ),
    )


@computes("handeye.cmm_vector")
def cmm_vector():
    difference = thesis.point("sphere_cmm") - thesis.point("corner_cmm")
    return Computed(np.abs(difference), bound=1e-4, proof="Difference of two readings printed to 0.0001 mm.")


CMM_NOMINAL = np.array([-103.0, -440.6, 66.7, 60.6, -4.4, -540.5, -114.9, 98.5, 99.9, 181.6])


@computes("handeye.cmm_deviation")
def cmm_deviation():
    actual = np.concatenate(
        [
            thesis.point("sphere_cmm"),
            [2 * thesis.radius("coordinate machine")],
            thesis.point("corner_cmm"),
            thesis.point("sphere_in_plate"),
        ]
    )
    return Computed(actual - CMM_NOMINAL)


def _half(source):
    return Computed(
        thesis.radius(source),
        bound=5e-5,
        proof="Half of the printed diameter; the last digit is cut, not rounded.",
    )


computes("handeye.radius_real_model")(functools.partial(_half, "coordinate machine"))
computes("handeye.radius_computed_model")(functools.partial(_half, "computed model"))


@functools.cache
def radius_fit(skip=()):
    """Sphere radius as a tenth unknown on the corrected data: (radius, its standard deviation), mm."""
    fit = hand_eye.fit_radius(*_without(skip))
    return fit.radius, fit.std_of("radius")


def _without(skip):
    measured = corrected_data()
    keep = np.setdiff1d(np.arange(31), np.array(skip, int) - 1)
    return measured.T_BF[keep], measured.x_S[keep]


def radius_distance(R, skip=()):
    """How far a held radius is from the fitted one, by the growth of the sum of squares, in standard deviations.

    The usual standard deviation misleads: at 29.977 mm, where the circle of pose 4 becomes larger than the sphere, the
    rms has a kink.
    """
    T_BF, x_S = _without(skip)
    found = hand_eye.fit_radius(T_BF, x_S)
    held = hand_eye.calibrate_sphere_target(T_BF, thesis.centers_with_radius(x_S, R))
    return float(np.sqrt(len(T_BF) * (held.rms**2 - found.rms**2)) / found.std)


def _radius_proof():
    (R, std), (R4, std4) = radius_fit(), radius_fit((4,))
    away = {name: [radius_distance(r, skip) for skip in ((), (4,))] for name, r in RADII.items()}
    distances = ", ".join(f"the {name} {R:.1f} ({R4:.1f})" for name, (R, R4) in away.items())
    return (
        f"With the radius as a tenth unknown the 31 corrected poses give {R:.3f} +- {std:.3f} mm (without pose 4, "
        f"which cuts next to the equator, {R4:.3f} +- {std4:.3f} mm). By the growth of the sum of squares, in standard "
        f"deviations and in brackets without pose 4: {distances} away."
    )


RADII = {"certificate's 29.9725 mm": 29.9725, "listing's 30 mm": 30.0, "coordinate machine's 30.2770 mm": 30.27705}


@computes("handeye.diameter_certificate")
def certificate_diameter():
    R, std = radius_fit()
    return Computed(2 * R, bound=4 * std, proof=_radius_proof())


@computes("handeye.diameter_listing")
def listing_diameter():
    R, std = radius_fit()
    return Computed(2 * R, bound=4 * std, proof=_radius_proof())


@computes("handeye.diameter_machine", "handeye.diameter_computed")
def machine_diameter():
    return Computed(2 * radius_fit()[0], bound=4 * radius_fit()[1], proof=_radius_proof())


# --- the end pose ----------------------------------------------------------------------------------------------------


@computes("handeye.end_matrix")
def end_matrix():
    T = thesis.frame("scanner_end")
    rad = frames.kuka_from_degrees(thesis.kuka_pose_deg("scanner_end"))
    J = numeric_jacobian(lambda q: frames.matrix_from_kuka(q).ravel(), rad, 1e-6, "central")
    bound = (np.abs(J) @ np.array([0, 0, 0, HALF_ANGLE, HALF_ANGLE, 0.1 * HALF_ANGLE])).reshape(4, 4)
    return Computed(
        T,
        bound=bound + 0.0005,
        misprint=np.abs(T) < 0.5,
        proof=(
            "The pose printed beside the matrix gives "
            f"{np.array2string(T[:3, :3], precision=4, suppress_small=True)}; decimals are cut, not rounded."
        ),
    )


@functools.cache
def fixed_target_fit(*fixed):
    measured = data(*fixed)
    return hand_eye.calibrate_sphere_target(measured.T_BF, measured.x_S, target=thesis.printed_target())


def _nearest_subset():
    """Of all sets of the seven corrections the one whose minimum is nearest the printed end pose: (poses, rad, mm)."""
    poses, end = [row["pose"] for row in thesis.corrections()], thesis.frame("scanner_end")
    sets = (subset for size in range(8) for subset in itertools.combinations(poses, size) if 2 in subset)
    found = [(subset, *frames.pose_distance(fixed_target_fit(*subset).T_FS, end)) for subset in sets]
    return min(found, key=lambda f: 240 * f[1] + f[2])  # mm at the sphere


@computes("handeye.end_pose")
def end_pose():
    target, measured = thesis.printed_target(), data(2)
    fit, end = fixed_target_fit(2), thesis.frame("scanner_end")
    angle, distance = frames.pose_distance(fit.T_FS, end)
    found = frames.kuka_from_matrix(fit.T_FS)
    nearest, near_angle, near_distance = _nearest_subset()
    return Computed(
        np.array([*found[:3], *np.rad2deg(found[3:])]),
        proof=(
            f"The least-squares pose of the printed data (decimal point of pose 2 repaired) lies {distance:.2f} mm "
            f"and {np.rad2deg(angle):.2f} deg away and has an rms of {fit.rms:.2f} mm against "
            f"{rms_at(end, target, measured):.2f} mm; of all sets of the seven corrections {nearest} comes nearest, "
            f"{near_distance:.2f} mm and {np.rad2deg(near_angle):.2f} deg: the run had other data."
        ),
    )


@computes("handeye.end_iterations")
def end_iterations():
    """The start lies on the pole B = -90 deg: the last bit of the first step decides how long the listing takes."""
    counts, measured = [], data(2)
    for nudge in np.random.default_rng(0).uniform(-0.1, 0.1, 60):
        start = thesis.kuka_pose_deg("scanner_start") + [0, 0, 0, 0, nudge, 0]
        runs, ended = listings.listing_gauss_newton(
            start, measured.T_BF, measured.x_S, thesis.printed_target(), 1e-5, 1e-5
        )
        counts.append(len(runs) - 1.0 if ended else np.inf)
    middle = np.median(counts)
    return Computed(
        middle,
        bound=np.abs(counts - middle).max(),
        simulated=True,
        proof=(
            "At the start B = -90 deg the first step of the listing is undetermined: 60 starts within 0.1 deg of it "
            f"take {min(counts):.0f} to {max(counts):.0f} iterations on the printed data, half of them {middle:.0f} or "
            "more. The run that is reported had other data, which were never published."
        ),
    )


@computes("handeye.validation")
def validation():
    residual = hand_eye.sphere_residuals(data().T_BF, data().x_S, thesis.frame("scanner_end"), thesis.printed_target())[
        0
    ]
    bound = np.array([HALF_LENGTH + 240 * HALF_ANGLE] * 3)
    return Computed(
        np.append(residual, 0.0),
        bound=np.append(bound, 0.0),
        misprint=np.array([True, False, False, False]),
        proof=(
            f"Pose 1 gives ({residual[0]:.3f}, {residual[1]:.3f}, {residual[2]:.3f}) mm under the printed end pose, "
            f"rounding of the printed pose moves it by {bound[0]:.3f}; all other poses give residuals of more than "
            "1.4 mm, so this is the one used, and x has lost its sign."
        ),
    )


@computes("handeye.claim")
def claim():
    target, end = thesis.printed_target(), thesis.frame("scanner_end")
    lengths = np.linalg.norm(hand_eye.sphere_residuals(data(2).T_BF, data(2).x_S, end, target), axis=1)
    return Computed(
        float(hand_eye.rms_distance(hand_eye.sphere_residuals(data(2).T_BF, data(2).x_S, end, target))),
        proof=(
            f"Over the 31 poses (decimal point of pose 2 repaired) the end pose leaves {lengths.min():.2f} to "
            f"{lengths.max():.1f} mm, rms {np.sqrt((lengths**2).mean()):.2f} mm: the one validated pose is the best "
            "of all."
        ),
    )


@computes("handeye.underdetermined")
def underdetermined():
    measured = corrected_data()
    J = hand_eye.plate_jacobian(
        measured.T_BF,
        measured.x_S,
        frames.kuka_from_matrix(joint_fit().T_FS),
        frames.kuka_from_degrees(thesis.kuka_pose_deg("plate")),
        thesis.point("sphere_in_plate"),
    )
    rank = np.linalg.matrix_rank(J / np.linalg.norm(J, axis=0), tol=1e-9)
    return Computed(
        "no number of poses suffices",
        proof=(
            f"Four poses give 12 equations for 12 unknowns, but all 93 equations of the 31 poses have rank {rank}: "
            "the plate's pose enters by the one point T_BP x_P', so its three rotations stay free."
        ),
    )


@computes("handeye.listing_cost")
def listing_cost():
    measured = data(2)
    e = hand_eye.sphere_residuals(measured.T_BF, measured.x_S, thesis.frame("scanner_end"), thesis.printed_target())
    listed, formula = listings.listing_cost(e).sum(), 0.5 * (e**2).sum()
    return Computed(
        "half the squared sum over n",
        misprint=True,
        proof=(
            f"Listing C3 squares the sum, (6-11) sums the squares: at the end pose {listed:.1f} against "
            f"{formula:.1f} mm^2."
        ),
    )


@computes("handeye.li_sign")
def li_sign():
    T_BF = np.tile(np.eye(4), (2, 1, 1))
    T_BF[1, 0, 3] = 10.0
    T_FS, target = joint_fit().T_FS, np.array([200.0, 0.0, 300.0])
    x = frames.transform(frames.invert(T_FS), frames.transform(frames.invert(T_BF), target))
    left = T_FS[:3, :3] @ (x[1] - x[0])
    return Computed(
        "T_01 - T_02",
        misprint=True,
        proof=(
            f"A flange moved by +10 mm along x sees the sphere shifted by {left[0]:.0f} mm there: X_b = R0 (R_s X_l "
            "+ T_s) + T_0 being constant, the right side of (2-41) is T_01 - T_02."
        ),
    )


@computes("handeye.kim_rank")
def kim_rank():
    x = np.append(corrected_data().x_S[0], 1.0)
    rank = np.linalg.matrix_rank(np.outer(x, np.append(thesis.printed_target(), 1.0)))
    return Computed(
        float(rank),
        proof=(
            f"X_S X_W' of one point has rank {rank}: the inverse in (2-44) needs four points or more that do not lie "
            "in one plane."
        ),
    )


@computes("handeye.angle_names")
def angle_names():
    rad = np.deg2rad([10.0, 20.0, 30.0])
    T = frames.matrix_from_kuka(np.append(np.zeros(3), rad))[:3, :3]
    swapped = frames.matrix_from_kuka(np.append(np.zeros(3), rad[::-1]))[:3, :3]
    angle = np.rad2deg(frames.rotation_angle(T.T @ swapped))
    return Computed(
        "Rz(A) Ry(B) Rx(C)",
        misprint=True,
        proof=(
            "Section 6.1.2, (6-7), (6-9) and listing C2 turn about z by A and about x by C, formula (6-3) the other "
            f"way round; for A, B, C = 10, 20, 30 deg that is {angle:.0f} deg apart, and only the former gives the "
            "matrices of table 6-6."
        ),
    )
