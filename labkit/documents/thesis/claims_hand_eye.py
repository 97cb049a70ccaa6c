"""Thesis, chapters 2.6, 4, 6 and 7 and appendix C: inputs, measured tables, the end pose."""

import functools
import itertools

import numpy as np
from scipy.optimize import least_squares

from ...calibration import hand_eye, literature
from ...estimation import optimization
from ...estimation.differences import numeric_jacobian
from ...geometry import frames
from ...geometry.lie import exp_so3
from ...machines import robot_accuracy
from .. import misprints, rounding
from ..ledger import Computed, computes
from ..slips import HERE, explained_by
from . import listings
from . import printed as thesis

NOTEBOOK = "05_hand_eye"


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

SIMULATED = {  # what the inputs of the simulation are printed as: table 6-2, listing C10, both
    "6-2 flange z": "20", "C10 flange z": "10", "6-2 P2 B": "-90", "C10 P2 B": "90",
    "flange y": "5", "plate y": "-5", "plate z": "5", "sphere y": "5", "sphere z": "5", "P2 y": "0",
}  # fmt: skip


@functools.cache
def _model():
    """The simulation model, and its 39 coordinates as printed."""
    return thesis.simulation(), thesis.simulation(exact=False).x_S


def _centers(d, table):
    """The 39 sensor coordinates that one table's inputs give."""
    T_BF, _, target, scanner = _model()[0]
    flange, pose, target = T_BF.copy(), scanner.copy(), target.copy()
    flange[:, 1, 3], flange[:, 2, 3] = float(d["flange y"]), float(d[f"{table} flange z"])
    pose[1], pose[4] = float(d["P2 y"]), float(d[f"{table} P2 B"])
    target[1:] = float(d["plate y"]) + float(d["sphere y"]), float(d["plate z"]) + float(d["sphere z"])
    T_FS = frames.matrix_from_kuka(frames.kuka_from_degrees(pose))
    return hand_eye.sphere_in_scanner(flange, T_FS, target)


@functools.cache
def _misses(entries, table):
    """How far the 39 coordinates of a table's inputs are from the printed ones, mm."""
    return float(np.abs(_centers(dict(entries), table) - _model()[1]).max())


def _unit():
    """A unit in the second decimal of the listing's coordinates (mm): what cutting the others off hides."""
    return 2 * thesis.simulated_digits().halves.min()


def _follow(d):
    """Whether both tables give all 39 coordinates to their two decimals, rounded or cut off."""
    return all(_misses(tuple(d.items()), table) < _unit() for table in ("6-2", "C10"))


@functools.cache
def _solved_inputs():
    """Flange z, B and the sphere's y against the flange, from the 39 printed coordinates by least squares, and how far
    two decimals that may be cut off leave them open.
    """
    printed = _model()[1].ravel()

    def centers(p):
        z, B, y = (repr(float(x)) for x in p)
        return _centers(SIMULATED | {"6-2 flange z": z, "6-2 P2 B": B, "plate y": y}, "6-2").ravel()

    fit = least_squares(lambda p: centers(p) - printed, [15.0, -80.0, -2.0])
    return fit.x, _unit() * np.abs(np.linalg.pinv(numeric_jacobian(centers, fit.x, 1e-6, "central"))).sum(1)


def _solved(which, name, other):
    """One input from the coordinates; `other` are the inputs put right beside it."""
    value, bound = (x[which] for x in _solved_inputs())
    found = explained_by(SIMULATED | other, _follow)
    inputs = (SIMULATED | other, SIMULATED | other | {key: texts[0] for key, texts in found.items() if key == name})
    wrong, right = (max(_misses(tuple(d.items()), table) for table in ("6-2", "C10")) for d in inputs)
    proof = (
        f"Solved for height, B and y the 39 printed coordinates of C10 give {value:.3f} +- {bound:.3f}. With the two "
        f"others put right and this one as printed they are missed by up to {wrong:.1f} mm, with all three put right "
        f"by {right:.4f} mm. Of all single slips in both tables these make them follow: "
        f"{'; '.join(f'{key} {texts[0]}' for key, texts in found.items())}."
    )
    return Computed(value, bound, slips={HERE if key == name else key for key in found}, proof=proof)


RIGHT = {"C10 flange z": "20", "C10 P2 B": "-90", "plate y": "0"}
for _which, (_id, _name) in enumerate(
    {"sim_C10_z": "C10 flange z", "sim_C10_B": "C10 P2 B", "sim_plate_y": "plate y"}.items()
):
    _rest = {key: text for key, text in RIGHT.items() if key != _name}
    computes(f"handeye.{_id}")(functools.partial(_solved, _which, _name, _rest))


@computes("handeye.sim_centers")
def simulated_centers():
    return Computed(
        thesis.simulation()[1],
        proof="From table 6-2's inputs with the plate at y = 0. The listing cuts the exact coordinate after the second "
        "decimal instead of rounding, which moves it by up to 0.01 mm.",
    )


@computes("handeye.sim_62_centers")
def simulated_centers_of_the_table():
    return Computed(thesis.simulation()[1][[4, 3, 8, 12]])


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


@functools.cache
def _from_two_decimals():
    """The pose that the 39 coordinates printed in C10 lead to, from each of the ten starts; mm and deg."""
    T_BF, _, target, _ = thesis.simulation()
    x_S = thesis.simulation(exact=False).x_S
    ends = []
    for start in thesis.start_poses_deg()[0]:
        run = hand_eye.gauss_newton_pose(frames.kuka_from_degrees(start), T_BF, x_S, target, parameters="se3")
        pose = frames.kuka_from_matrix(run.poses[-1])
        ends.append([*pose[:3], *np.rad2deg(pose[3:])])
    return np.array(ends)


@computes("handeye.gn_end")
def gauss_newton_end():
    end = _from_two_decimals()
    T_BF, x_S, _, scanner = thesis.simulation()
    values = np.linalg.svd(hand_eye.kuka_jacobian(frames.kuka_from_degrees(scanner), T_BF, x_S), compute_uv=False)
    return Computed(
        end,
        proof=(
            "From the 39 coordinates as printed, with two decimals. At B = -90 deg A and C are not determined one by "
            f"one (the last singular value is {values[5] / values[0]:.0e} of the first), only their sum; what the "
            "table prints of them and of y is noise of the solver and has no rows."
        ),
    )


@computes("handeye.gn_sign")
def gauss_newton_sign():
    """C of the row "turned about x" from the A beside it: at B = -90 deg only A + C is determined, and it is 0."""
    printed = {HERE: "0.0004", "A": "0.0004"}
    unit = 2 * rounding.half_unit(printed[HERE])  # half of each
    found = explained_by(printed, lambda d: abs(float(d[HERE]) + float(d["A"])) < unit)
    return Computed(
        -float(printed["A"]),
        slips=found,
        proof="The pose depends on A + C, which is 0 at the minimum; nine of the ten printed rows have "
        "opposite signs, this one has A = C = 4e-4: a sign is missing, in "
        f"{' or '.join(sorted('C' if k == HERE else k for k in found))}.",
    )


@functools.cache
def trust_region_runs(radius=10.0, tolerance=1e-6):
    """The ten runs with a trust region in x, y, z, A, B, C (mm, deg), ended by a small gradient: (ends, iterations)."""
    T_BF, x_S, target, _ = thesis.simulation()
    starts, unit = thesis.start_poses_deg()[0], np.array([1, 1, 1, *np.deg2rad([1, 1, 1])])
    runs = [
        optimization.trust_region(
            lambda p: hand_eye.kuka_residuals(p * unit, T_BF, x_S, target),
            lambda p: hand_eye.kuka_jacobian(p * unit, T_BF, x_S) * unit,
            start,
            radius=radius,
            stop=optimization.small_gradient(tolerance),
        )
        for start in [*starts[:8], thesis.footnote_start_deg(), *starts[9:]]
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
        None,
        proof=(
            f"From these starts the trust region of chapter 4 arrives in {counts[4]}, {counts[6]} and {counts[9]} "
            f"iterations; what the thesis's solver did was not published. Starts 4 and 6 cost {_start_cost(4):.1e} "
            f"mm^2, less than its tolerance 1e-6; start 9 costs {_start_cost(9):.0f} mm^2, and there the derivatives "
            "by A and C are parallel (B = -90.1 deg)."
        ),
    )


@computes("handeye.tr_end")
def trust_region_end():
    (ends, counts), (T_BF, x_S, target, _) = trust_region_runs(), thesis.simulation()
    misses = [np.abs(hand_eye.kuka_residuals(frames.kuka_from_degrees(end), T_BF, x_S, target)).max() for end in ends]
    return Computed(
        _from_two_decimals(),
        simulated=True,
        proof=(
            "The minimum of the 39 coordinates as printed. The trust region of chapter 4 finds that of the exact ones "
            f"within {max(misses):.0e} mm from all {len(ends)} starts, in {int(counts.min())} to {int(counts.max())} "
            "iterations. Where the thesis's own solver "
            "stopped short of it, nothing published says why."
        ),
    )


@functools.cache
def _both_methods():
    """What table 7-3 prints of both methods: starts that end in a minimum, and iterations where both do."""
    table = thesis.iterations_7_3()
    both = ~np.isnan(table["Gauss-Newton"]) & ~np.isnan(table["trust region"])
    arrived = {name: int((~np.isnan(counts)).sum()) for name, counts in table.items()}
    return arrived, {name: counts[both].astype(int) for name, counts in table.items()}


@computes("handeye.stabler")
def stabler():
    arrived, _ = _both_methods()
    return Computed(
        "Gauß-Newton" if arrived["Gauss-Newton"] > arrived["trust region"] else "Trust-Region",
        proof=f"By the table itself: {arrived['Gauss-Newton']} of ten starts against {arrived['trust region']}.",
    )


@computes("handeye.faster")
def faster():
    _, counts = _both_methods()
    less = (counts["Gauss-Newton"] <= counts["trust region"]).all() and counts["Gauss-Newton"].sum() < counts[
        "trust region"
    ].sum()
    return Computed(
        "Gauß-Newton" if less else "Trust-Region",
        proof=f"By the table itself, in iterations where both arrive: {counts['Gauss-Newton']} against "
        f"{counts['trust region']}. What an iteration costs is not printed.",
    )


@computes("handeye.rating")
def ratings():
    """Ratings of table 7-3 in the order Gauss-Newton, trust region: the better word for more starts that arrive."""
    arrived, _ = _both_methods()
    best = max(arrived.values())
    words = ["Sehr gut" if arrived[name] == best else "Gut" for name in ("Gauss-Newton", "trust region")]
    return Computed(
        np.array(words),
        proof=f"The better word goes to the method that arrives from more of the ten starts: {arrived['Gauss-Newton']} "
        f"against {arrived['trust region']}. What separates good from very good is not printed.",
    )


@computes("handeye.start_name")
def start_names():
    """Axis about which the start poses 4 and 6 of table 7-2 are turned, from the angle that is changed."""
    original, *_ = starts = thesis.start_poses_deg()[0]
    axes = {3: "z", 4: "y", 5: "x"}  # KUKA: A about z, B about y, C about x
    turned = [axes[int(np.flatnonzero(starts[i] != original)[0])] for i in (4, 6)]
    printed = {HERE: "x", "row's own words": "z"}
    slips = explained_by(
        printed, lambda d: set(d.values()) == {turned[0]}, {HERE: ("z", "y"), "row's own words": ("x", "y")}
    )
    return Computed(
        np.array([f"p_2,{axis}-rot" for axis in turned]),
        slips=slips,
        proof="Row 4 is called a turn about z and changes A, row 6 a turn about x and changes C, as the pose "
        "convention has it; their symbols name the other axis each.",
    )


# --- the measured tables ---------------------------------------------------------------------------------------------


@functools.cache
def _suspects():
    return misprints.find(thesis.printed_entries())


@functools.cache
def _robust_fit():
    """A calibration in which no suspicious row had a say."""
    return hand_eye.calibrate_sphere_target(data().T_BF, data().x_S, robust=True)


def _predicted(pose, table, column):
    """An entry from the eight others of its row and the calibration, by least squares, and what noise leaves open."""
    fit, columns = _robust_fit(), (*thesis.POSE_COLUMNS, *thesis.CENTER_COLUMNS)
    row = np.concatenate([data().kuka_deg[pose - 1], data().x_S[pose - 1]])
    k = columns.index(column) if table == "C14" else 6 + thesis.CENTER_COLUMNS.index(column)

    def residual(entry):
        trial = row.copy()
        trial[k] = entry[0]
        T_BF = frames.matrix_from_kuka(frames.kuka_from_degrees(trial[:6]))
        return hand_eye.sphere_residuals(T_BF, trial[6:], fit.T_FS, fit.target)

    starts = [row[k]] if k not in (3, 4, 5) else np.arange(-180.0, 180.0, 20.0)
    found = min((least_squares(residual, [start], x_scale=10.0) for start in starts), key=lambda f: f.cost)
    value = float(found.x[0])
    value = value if k not in (3, 4, 5) else (value + 180.0) % 360.0 - 180.0
    return value, misprints.EXPLAINED * fit.std / np.linalg.norm(found.jac)


def _slips_in_table(pose):
    """Columns whose single slip explains a row and, where the pattern speaks, keeps it halfway between neighbors."""
    explained = _suspects()[pose]
    credible = [e for e in explained if not e.turn > misprints.TURNED] or explained
    steps = misprints.neighbor_offsets(corrected_data())
    found = {}
    for e in credible:
        trial = thesis.printed_entries() | {
            (r["table"], r["pose"], r["column"]): r["corrected"] for r in thesis.corrections() if r["pose"] != pose
        }
        trial[e.table, pose, e.column] = e.corrected
        off = np.abs(misprints.neighbor_offsets(misprints.measurements_from(trial))[pose - 1])
        if off <= np.abs(steps).max():
            found.setdefault((e.table, e.column), e)
    return found


def _misprint(pose):
    row = next(row for row in thesis.corrections() if row["pose"] == pose)
    value, bound = _predicted(pose, row["table"], row["column"])
    found = _slips_in_table(pose)
    named = "; ".join(
        f"{e.column} {e.printed} -> {e.corrected} ({e.slip}, leaves {e.after:.2f} mm)" for e in found.values()
    )
    return Computed(
        value,
        bound,
        slips={HERE if key == (row["table"], row["column"]) else key for key in found},
        proof=f"The rest of the row and a calibration without it put this entry at {value:.2f} +- {bound:.2f}. "
        f"Single slips that explain the row, among all in its nine entries: {named}. {row['reason']}",
    )


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


@computes("handeye.pattern_step")
def pattern_step():
    """Turn from the third to the fourth column, the mean over the four lines of motion; and (6-22)'s three steps."""
    measured = corrected_data()
    at = {(line, angle): T for line, angle, T in zip(measured.line, measured.angle_deg, measured.T_BF)}
    turns = [
        frames.rotation_angle(at[line, 45.0][:3, :3].T @ at[line, 67.5][:3, :3]) for line in ("x", "y", "x*", "y*")
    ]
    mean, spread = 45 + np.rad2deg(np.mean(turns)), np.rad2deg(np.ptp(turns))
    printed = {HERE: "67.7", "step": "22.5"}

    def holds(d):
        steps = abs(3 * float(d["step"]) - float(d[HERE])) < rounding.half_unit(printed[HERE])
        return steps and abs(float(d[HERE]) - mean) < spread

    return Computed(
        mean,
        bound=spread,
        slips=explained_by(printed, holds),
        proof=(
            f"The poses of this column are turned by {mean - 45:.2f} deg against those of the 45 deg column (four "
            f"lines, {spread:.2f} deg apart); with steps of 22.5 deg (6-22) the column is 67.5 deg."
        ),
    )


def _matrix(name):
    """Matrix of a printed pose, and how far the digits of the pose can move each entry."""
    return rounding.propagate(
        lambda pose: frames.matrix_from_kuka(frames.kuka_from_degrees(pose)), thesis.pose_digits(name)
    )


def _matrix_row(name):
    value, bound = _matrix(name)
    return Computed(
        value,
        bound=bound,
        proof=f"The digits of the pose leave the rotation open by up to {bound[:3, :3].max():.1e}.",
    )


TABLE66 = {"x45": 3, "y45": 10, "x_star45": 19, "y_star45": 27}  # lines of motion and the pose of C14 each shows


def _half_units(table, pose, columns):
    entries = thesis.printed_entries()
    return rounding.read([entries[table, pose, column] for column in columns])


def _table66_pose(name, pose):
    """The same pose in C14, which prints the same readings again."""
    again = _half_units("C14", pose, thesis.POSE_COLUMNS)
    return Computed(
        again.values,
        bound=again.halves,
        proof=(
            f"C14 prints {again.values} for the same pose: where they differ by one in the last digit, it is cut off "
            "in one table and rounded in the other."
        ),
    )


def _table66(name, pose):
    """Matrix of a pose from the finer print of each angle: table 6-6 cuts its digits off, C14 sometimes shows fewer."""
    table, listing = thesis.pose_digits(f"flange_{name}"), _half_units("C14", pose, thesis.POSE_COLUMNS)
    finer = table.halves < listing.halves
    used = rounding.Printed(*(np.where(finer, x, y) for x, y in zip(table, listing)))
    value, bound = rounding.propagate(lambda p: frames.matrix_from_kuka(frames.kuka_from_degrees(p)), used)
    return Computed(
        value,
        bound=bound,
        proof=f"From the finer print of each angle, here and in C14; their digits leave the rotation open by up to "
        f"{bound[:3, :3].max():.1e}.",
    )


for _name, _pose in TABLE66.items():
    computes(f"handeye.T66_{_name}")(functools.partial(_table66, _name.replace("_star", "*"), _pose))
    computes(f"handeye.p66_{_name}")(functools.partial(_table66_pose, _name, _pose))


def _table68(name, pose):
    """A reading of C17 from table 6-8, which prints it with more digits."""
    finer = thesis.point_digits(f"center_{name}")
    listed = _half_units("C17", pose, thesis.CENTER_COLUMNS).values
    return Computed(
        finer.values,
        bound=finer.halves,
        proof=(
            f"Table 6-8 prints {finer.values} for this reading; they differ by up to "
            f"{np.abs(listed - finer.values).max():.4f} mm, too little for the residuals to tell which is right."
        ),
    )


computes("handeye.x68_x_star45")(functools.partial(_table68, "x*45", 19))
computes("handeye.x68_y_star45")(functools.partial(_table68, "y*45", 27))
computes("handeye.plate_matrix")(functools.partial(_matrix_row, "plate"))
computes("handeye.start_matrix")(functools.partial(lambda: Computed(thesis.frame("scanner_start"))))
computes("handeye.end_matrix")(functools.partial(_matrix_row, "scanner_end"))


@computes("handeye.start_text_beta")
def start_text():
    """The angle that section 6.4.3 states in words, from the start pose and matrix printed beside it."""
    T, B = thesis.frame("scanner_start"), thesis.kuka_pose_deg("scanner_start")[4]
    other = frames.matrix_from_kuka(frames.kuka_from_degrees([0, 0, 0, 180.0, -B, 0]))
    return Computed(
        B,
        proof=f"Pose and matrix of table 6-7 have B = {B:.0f} deg and T[0, 2] = {T[0, 2]:.0f}. With alpha = 180 "
        f"and beta = 90 deg in the order of (6-3) T[0, 2] would be {other[0, 2]:.0f}; the words do not say in which "
        "order they turn.",
    )


# --- the calibration body --------------------------------------------------------------------------------------------


def _vector(name):
    """x_P' as printed; the nominal values of the CAD model are exact."""
    return thesis.point(name) if name.endswith("cad") else thesis.point_digits(name)


def _angles_to_axes(x):
    return np.rad2deg(np.arccos(x / np.linalg.norm(x)))


def _body_length(name):
    value, bound = rounding.propagate(np.linalg.norm, _vector(name))
    return Computed(value, bound, proof="From the vector printed beside it.")


def _body_angles(name):
    value, bound = rounding.propagate(_angles_to_axes, _vector(name))
    return Computed(value, bound, proof="The arc cosines of the printed vector's direction.")


for _key, _point in (("cad", "sphere_in_plate_cad"), ("real", "sphere_in_plate")):
    computes(f"handeye.body_{_key}_length")(functools.partial(_body_length, _point))
    computes(f"handeye.body_{_key}_angles")(functools.partial(_body_angles, _point))


def _difference(function):
    """CAD minus measured of a function of x_P', with its bound."""
    return rounding.propagate(lambda cad, real: function(cad) - function(real), *map(_vector, BODIES))


BODIES = ("sphere_in_plate_cad", "sphere_in_plate")


@computes("handeye.body_difference")
def body_difference():
    return Computed(*_difference(lambda x: x))


@computes("handeye.body_length_difference")
def body_length_difference():
    return Computed(*_difference(np.linalg.norm))


@computes("handeye.body_angle_difference")
def body_angle_difference():
    value, bound = _difference(_angles_to_axes)
    angles = {name: rounding.propagate(_angles_to_axes, _vector(name)) for name in BODIES}
    printed = {HERE: "0.0010", BODIES[0]: "64.1921", BODIES[1]: "64.1920"}
    half = rounding.half_unit(printed[HERE])  # that of all three

    def holds(d):
        agree = all(abs(float(d[name]) - x[1]) <= slack[1] + half for name, (x, slack) in angles.items())
        return agree and abs(float(d[BODIES[0]]) - float(d[BODIES[1]]) - float(d[HERE])) <= 3 * half * (1 + 1e-6)

    return Computed(
        value,
        bound,
        slips={(1,): explained_by(printed, holds)},
        proof=f"The printed vectors give {value} deg, and the printed angles about y differ by 0.0001.",
    )


@computes("handeye.body_diameter_difference")
def body_diameter_difference():
    protocol = thesis.measuring_protocol()
    measured = rounding.read(protocol["actual"][list(protocol["feature"]).index("diameter")])
    value, bound = rounding.propagate(lambda d: thesis.radius("listing") * 2 - d, measured)
    printed = {HERE: "0.5541", "CAD": "60.00", "measured": f"{float(measured.values):.4f}"}
    half, again = rounding.half_unit(printed[HERE]), 2 * thesis.radius("coordinate machine")  # C13 prints it again

    def holds(d):
        off = abs(float(d["CAD"]) - float(d["measured"]) - float(d[HERE]))
        return abs(float(d["measured"]) - again) <= half and off <= 2 * half

    return Computed(
        value,
        bound,
        slips=explained_by(printed, holds),
        proof=f"All other rows of the table are CAD minus measured; here that is {value:.4f} mm: the sign is missing.",
    )


@computes("handeye.cmm_vector")
def cmm_vector():
    points = map(thesis.point_digits, ("sphere_cmm", "corner_cmm"))
    value, bound = rounding.propagate(lambda sphere, corner: np.abs(sphere - corner), *points)
    return Computed(value, bound=bound, proof="Difference of two readings printed to 0.0001 mm.")


@computes("handeye.cmm_deviation")
def cmm_deviation():
    protocol = thesis.measuring_protocol()
    actual, nominal = rounding.read(protocol["actual"]), rounding.read(protocol["nominal"]).values
    return Computed(*rounding.propagate(lambda x: x - nominal, actual), proof="Actual minus nominal, which is exact.")


@computes("handeye.cmm_percent")
def cmm_percent():
    protocol = thesis.measuring_protocol()
    deviation, tolerance = rounding.read(protocol["deviation"]), rounding.read(protocol["tolerance"]).values
    value, bound = rounding.propagate(lambda x: 100 * x / tolerance, deviation)
    return Computed(value, bound, proof="The printed deviation as a share of the tolerance of 0.2 mm.")


@computes("handeye.cmm_form")
def form_deviation():
    """The machine's form deviation of the sphere against the certificate's roundness, in mm."""
    certificate, protocol = thesis.roundness_um() / 1000, thesis.measuring_protocol()
    actual = dict(zip(protocol["feature"], protocol["actual"].astype(float)))
    return Computed(
        certificate.max(),
        proof="The certificate of the same sphere (C11) prints roundness deviations of "
        f"{1000 * certificate.min():.3f} to {1000 * certificate.max():.3f} um, with an uncertainty of 0.04 um; the "
        f"machine reports {1000 * actual['form']:.1f} um, {actual['form'] / certificate.max():.0f} times as much. "
        f"Whatever it touched, its diameter of {actual['diameter']:.4f} mm is not the sphere's.",
    )


@computes("handeye.cmm_accuracy")
def cmm_accuracy():
    """Permissible error of the machine over the length of x_P', from its own limit 1.7 um + L / 350, um."""
    length = np.linalg.norm(thesis.point("sphere_in_plate"))
    limit = 1.7 + length / 350.0
    return Computed(
        limit,
        proof=f"1.7 um is the part of the limit that holds at length 0 (C12: MPE = 1.7 um + L / 350 mm um); over the "
        f"{length:.1f} mm of x_P' it is {limit:.2f} um.",
    )


def _half(source):
    return Computed(thesis.radius(source), proof="Half of the printed diameter.")


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
    held = {source: thesis.radius(source) for source in ("certificate", "listing", "coordinate machine")}
    away = {source: [radius_distance(r, skip) for skip in ((), (4,))] for source, r in held.items()}
    distances = ", ".join(f"the {name}'s {held[name]:.4f} mm {R:.1f} ({R4:.1f})" for name, (R, R4) in away.items())
    return (
        f"With the radius as a tenth unknown the 31 corrected poses give {R:.3f} +- {std:.3f} mm (without pose 4, "
        f"which cuts next to the equator, {R4:.3f} +- {std4:.3f} mm). By the growth of the sum of squares, in "
        f"standard deviations and in brackets without pose 4: {distances} away."
    )


@computes("handeye.diameter_machine")
def machine_diameter():
    """The certificate's diameter of the same sphere."""
    return Computed(
        2 * thesis.radius("certificate"),
        proof="The certificate prints 59.94507 +- 0.0003 mm for this sphere. " + _radius_proof(),
    )


# --- the end pose ----------------------------------------------------------------------------------------------------


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
        np.array([*found[:3], np.nan, np.rad2deg(found[4]), np.nan]),
        proof=(
            f"The least-squares pose of the printed data (decimal point of pose 2 repaired) lies {distance:.2f} mm "
            f"and {np.rad2deg(angle):.2f} deg away and has an rms of {fit.rms:.2f} mm against "
            f"{rms_at(end, target, measured):.2f} mm; of all sets of the seven corrections {nearest} comes nearest, "
            f"{near_distance:.2f} mm and {np.rad2deg(near_angle):.2f} deg. Tables and end pose exclude each other; "
            "which of them the run did not have, the thesis does not show. A and C are hardly determined one by one "
            "so close to B = -90 deg."
        ),
    )


@computes("handeye.end_iterations")
def end_iterations():
    """No number where the start lies on the pole B = -90 deg: the last bit of the first step decides the count."""
    counts, measured, pole = [], data(2), thesis.kuka_pose_deg("scanner_start")
    rank = int(
        np.linalg.matrix_rank(hand_eye.kuka_jacobian(frames.kuka_from_degrees(pole), measured.T_BF, measured.x_S))
    )
    for nudge in np.random.default_rng(0).uniform(-0.1, 0.1, 12):
        start = pole + [0, 0, 0, 0, nudge, 0]
        runs, ended = listings.listing_gauss_newton(
            start, measured.T_BF, measured.x_S, thesis.printed_target(), 1e-5, 1e-5
        )
        counts.append(len(runs) - 1.0 if ended else np.inf)
    return Computed(
        None if rank < 6 else np.median(counts),
        proof=(
            f"At the start B = -90 deg the six derivatives have rank {rank}, and the first step of the listing is "
            f"undetermined: {len(counts)} starts within 0.1 deg of it take {min(counts):.0f} to {max(counts):.0f} "
            "iterations on the printed data."
        ),
    )


@computes("handeye.validation")
def validation():
    """Residual of the best pose under the printed end pose; which pose and center the thesis took, it does not say."""
    target = thesis.printed_target()

    def residuals(pose_deg):
        T_FS = frames.matrix_from_kuka(frames.kuka_from_degrees(pose_deg))
        return hand_eye.sphere_residuals(data(2).T_BF, data(2).x_S, T_FS, target)

    value, bound = rounding.propagate(residuals, thesis.pose_digits("scanner_end"))
    lengths = np.linalg.norm(value, axis=1)
    best, second = np.argsort(lengths)[:2]
    signed = np.append(value[best], 0.0)
    return Computed(
        signed,
        bound=np.append(bound[best], 0.0),
        simulated=True,
        proof=(
            "The pose is not named and its center came from a sphere fit of its own (radius 30.198 mm). Pose "
            f"{best + 1} gives ({signed[0]:.3f}, {signed[1]:.3f}, {signed[2]:.3f}) mm, {lengths[best]:.3f} mm long, "
            f"pose {second + 1} {lengths[second]:.3f} mm; y and z fit pose {best + 1}, and x would, had it lost its "
            "sign."
        ),
    )


@computes("handeye.claim")
def claim():
    """Least and largest deviation by the table's own three numbers, and what the pose leaves on all 31."""
    printed = np.abs(thesis.point("validation"))
    target, end = thesis.printed_target(), thesis.frame("scanner_end")
    corrected, joint = rms_at(end, target, corrected_data()), joint_fit().rms
    return Computed(
        np.array([printed.min(), printed.max()]),
        proof=(
            f"Table 7-5 prints deviations from {printed.min():.2f} to {printed.max():.2f} mm, at one pose. Over the "
            f"31 poses of the corrected tables the end pose leaves {corrected:.2f} mm (rms), a fit with the center "
            f"free {joint:.3f} mm: {corrected / joint:.1f} times less. The sentence itself speaks of the one pose."
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
    J = J / np.linalg.norm(J, axis=0)
    ranks = [np.linalg.matrix_rank(J[: 3 * n]) for n in range(1, 32)]  # against what rounding leaves of a zero
    open_, four = J.shape[1] - max(ranks), next((n for n, rank in enumerate(ranks, 1) if rank == J.shape[1]), None)
    return Computed(
        "vierfach unterbestimmtes Gleichungssystem"
        if four == 4
        else f"{open_} unknowns stay open with any number of poses",
        proof=(
            "The sentence counts twelve unknowns against three equations a measurement, so that four should do. All "
            f"{len(J)} equations of the 31 poses have rank {ranks[-1]}: the plate's pose enters by the one point "
            "T_BP x_P', so its three rotations stay free."
        ),
    )


@computes("handeye.independent_measurements")
def independent_measurements():
    """Nine angles on four axes, each turned through the same start: different ones among the printed definitions."""
    lines, angles = 4, np.arange(-4, 5)
    poses = {(line if n else None, int(n)) for line in range(lines) for n in angles}
    return Computed(
        float(lines * len(angles)),
        proof=f"(6-22) to (6-25) define {lines} x {len(angles)} = {lines * len(angles)} measurements; n = 0 is "
        f"the same direction on all four lines, which leaves {len(poses)} directions of view. 31 were taken.",
    )


ZERO = 1e-9  # what floating point leaves of an identity; where it is none, numbers of the order of 1 are left

COSTS = {"squares summed": lambda e: 0.5 * (e**2).sum(0), "sum squared": lambda e: listings.listing_cost(e)}


@computes("handeye.listing_cost")
def listing_cost():
    """Of (6-11) and listing C3 the one whose gradient is the J' e that listing C5 steps along."""
    measured, target = data(2), thesis.printed_target()
    p = frames.kuka_from_degrees(thesis.kuka_pose_deg("scanner_end"))

    def residuals(q):
        return hand_eye.kuka_residuals(q, measured.T_BF, measured.x_S, target)

    J, e = numeric_jacobian(residuals, p, 1e-6, "central"), residuals(p)

    def holds(d):
        slope = numeric_jacobian(lambda q: COSTS[d["(6-11)"]](residuals(q).reshape(-1, 3)).sum(), p, 1e-6, "central")
        # central differences agree within 1e-6; the gradient of the other cost is another by several times
        return d[HERE] == d["(6-11)"] and np.allclose(slope, J.T @ e, rtol=1e-3, atol=1e-3 * np.abs(J.T @ e).max())

    printed = {HERE: "sum squared", "(6-11)": "squares summed"}
    found = explained_by(printed, holds, lambda text: [name for name in COSTS if name != text])
    listed, formula = (COSTS[printed[name]](e.reshape(-1, 3)).sum() for name in (HERE, "(6-11)"))
    return Computed(
        printed[HERE] if holds(printed) else found[HERE][0],
        slips=found,
        proof=(
            f"Listing C3 squares the sum, (6-11) sums the squares: at the end pose {listed:.1f} against "
            f"{formula:.1f} mm^2. Listing C5 steps along J' e, the gradient of (6-11)."
        ),
    )


@computes("handeye.li_sign")
def li_sign():
    """Which right side of (2-41) follows from (2-40), tried on a flange that moves by 10 mm."""
    T_BF = np.tile(np.eye(4), (2, 1, 1))
    T_BF[1, 0, 3] = 10.0
    T_FS, target = joint_fit().T_FS, np.array([200.0, 0.0, 300.0])
    x = hand_eye.sphere_in_scanner(T_BF, T_FS, target)
    left, step = T_FS[:3, :3] @ (x[1] - x[0]), T_BF[1, :3, 3] - T_BF[0, :3, 3]
    right = {"T_02 - T_01": step, "T_01 - T_02": -step}
    signs = {"+ T_0": 1.0, "- T_0": -1.0}

    def holds(d):
        seen = frames.transform(T_FS, x) + signs[d["(2-40)"]] * T_BF[:, :3, 3]
        return np.allclose(seen, target) and np.allclose(left, right[d[HERE]])

    found = explained_by(
        {HERE: "T_02 - T_01", "(2-40)": "+ T_0"}, holds, {HERE: ("T_01 - T_02",), "(2-40)": ("- T_0",)}
    )
    return Computed(
        found[HERE][0],
        slips=found,
        proof=(
            f"A flange moved by +10 mm along x sees the sphere shifted by {left[0]:.0f} mm there: X_b = R0 (R_s X_l "
            "+ T_s) + T_0 being constant, the right side of (2-41) is T_01 - T_02, or the left one has the other "
            "order; (2-40) is right."
        ),
    )


@computes("handeye.kim_equation")
def kim_equation():
    """The form that (2-44) and the matrix D of appendix A belong to."""
    rng = np.random.default_rng(4)
    A, X = (frames.pose(exp_so3(rng.normal(size=3)), rng.normal(size=3)) for _ in range(2))
    B = frames.invert(X) @ A @ X
    u, D, F = X[:3].ravel(), _appendix_d(A, B), _appendix_f(A)
    other = frames.pose(exp_so3(rng.normal(size=3)), rng.normal(size=3))
    forms = {"AX = BX": other @ X - B @ X, "AX = XB": A @ X - X @ B}
    holds = {
        name: float(np.abs(D @ u - F).max()) < ZERO and float(np.abs(off).max()) < ZERO for name, off in forms.items()
    }
    printed = {HERE: "AX = BX", "section 4.1": "AX = XB"}
    found = explained_by(
        printed, lambda d: d[HERE] == d["section 4.1"] and holds[d[HERE]], lambda text: [n for n in forms if n != text]
    )
    return Computed(
        found[HERE][0],
        slips=found,
        proof=f"Appendix A's D U = F holds for motions with A X = X B (off by {np.abs(D @ u - F).max():.0e}), "
        "and (2-44) and section 4.1 print that order; A X = B X would leave nothing but A = B.",
    )


def _appendix_d(A, B):
    """The matrix D of appendix A, row by row of A X - X B = 0."""
    return np.kron(A[:3, :3], np.eye(4)) - np.kron(np.eye(3), B.T)


def _appendix_f(A):
    F = np.zeros((3, 4))
    F[:, 3] = -A[:3, 3]
    return F.ravel()


@computes("handeye.rating_total")
def rating_sums():
    """Table 4-1: the sums of its four ratings."""
    sums = [approach["points"].sum() for approach in thesis.table_4_1().values()]
    return Computed(np.array(sums), proof="The sum of the four ratings above it.")


@computes("handeye.rating_scale")
def rating_scale():
    criteria = max(len(approach["points"]) for approach in thesis.table_4_1().values())
    return Computed(
        10 * criteria,
        proof=f"Each approach is rated under {criteria} criteria from 1 to 10: no sum can exceed "
        f"{10 * criteria}. Either a fifth criterion is missing from the table or the scale is wrong.",
    )


def _rotation(angles_deg):
    return frames.matrix_from_kuka(frames.kuka_from_degrees([0.0, 0.0, 0.0, *angles_deg]))[:3, :3]


ORDERS = {"Rz(C) Ry(B) Rx(A)": (2, 1, 0), "Rz(A) Ry(B) Rx(C)": (0, 1, 2)}


@computes("handeye.angle_names")
def angle_names():
    """Which order gives the matrices of table 6-6 from the poses printed beside them."""
    off, within, matrices = {}, {}, thesis.matrices_66()
    for name, order in ORDERS.items():
        off[name], within[name] = 0.0, True
        for k, line in enumerate(("x45", "y45", "x*45", "y*45")):
            angles, halves = (x[3:] for x in thesis.pose_digits(f"flange_{line}"))
            given = rounding.Printed(angles[list(order)], 2 * halves[list(order)])  # table 6-6 cuts digits off
            R, bound = rounding.propagate(_rotation, given)
            misses = np.abs(R - matrices.values[k])
            off[name] = max(off[name], float(misses.max()))
            within[name] &= bool((misses <= bound + 2 * matrices.halves[k]).all())
    printed = {HERE: "Rz(C) Ry(B) Rx(A)", "(6-7), (6-9), C2": "Rz(A) Ry(B) Rx(C)"}
    found = explained_by(
        printed,
        lambda d: d[HERE] == d["(6-7), (6-9), C2"] and within[d[HERE]],
        lambda text: [name for name in ORDERS if name != text],
    )
    return Computed(
        found[HERE][0],
        slips=found,
        proof=(
            "Section 6.1.2, (6-7), (6-9) and listing C2 turn about z by A and about x by C, formula (6-3) the other "
            f"way round. The matrices of table 6-6 follow from their poses within {off['Rz(A) Ry(B) Rx(C)']:.0e} by "
            f"the former, and are missed by {off['Rz(C) Ry(B) Rx(A)']:.1f} by the latter."
        ),
    )


@computes("handeye.angle_names_2")
def angle_names_of_chapter_2():
    return Computed(
        angle_names().value,
        proof="Section 2.1.2 turns about z by C and about x by A, section 6.1.2, listing C2 and the tables "
        "about z by A and "
        "about x by C. Each is a convention; together they exchange A and C.",
    )


@computes("handeye.angle_axes")
def angle_axes():
    """The axis about which each of A, B and C alone turns the poses of table 6-6, in the order that fits them."""
    order, axes = angle_names().value, {}
    for factor in order.split():
        axes[factor[3]] = factor[1]
    return Computed(
        np.array([f"um die {axes[name]}-Achse" for name in "ABC"]),
        proof=f"The list of symbols gives all three angles the z axis; the matrices of table 6-6 need {order}.",
    )


# --- what the sensor, the robot and the papers are said to do --------------------------------------------------------


def _base(H, tan_alpha, tan_beta):
    """(2-11): the base under a height H between two angles."""
    return H / tan_alpha + H / tan_beta


@computes("handeye.height_formula")
def height_formula():
    """The form of H that satisfies (2-11), L = H / tan(alpha) + H / tan(beta), in random triangles."""
    alpha, beta, L = np.random.default_rng(0).uniform((0.3, 0.3, 20.0), (1.4, 1.4, 200.0), (100, 3)).T
    a, b = np.tan(alpha), np.tan(beta)
    forms = {
        "L tan alpha tan beta / (tan alpha + tan beta)": L * a * b / (a + b),
        "L (tan alpha + tan beta) / (tan alpha tan beta)": L * (a + b) / (a * b),
        "L / (tan alpha + tan beta)": L / (a + b),
    }
    off = {form: float(np.abs(_base(H, a, b) - L).max()) for form, H in forms.items()}
    return Computed(
        min(off, key=off.get),
        proof=f"In 100 triangles it returns the base to {min(off.values()):.0e} mm; sum and product exchanged miss it "
        f"by {sorted(off.values())[1]:.0f} mm and more.",
    )


@computes("handeye.repeatability_base")
def repeatability_without_base():
    """Whether repeatability changes with the base the arrivals are given in."""
    rng = np.random.default_rng(0)
    reached, base = rng.normal(size=(30, 3)), frames.pose(exp_so3(rng.normal(size=3)), rng.uniform(-900, 900, 3))
    here, there = robot_accuracy.repeatability(reached), robot_accuracy.repeatability(frames.transform(base, reached))
    return Computed(
        "ohne bekannte Lage" if abs(here - there) < ZERO else "mit bekannter Lage",
        proof=f"The same arrivals seen from a base {np.linalg.norm(base[:3, 3]):.0f} mm away and turned have the same "
        "repeatability: only their distances from one another enter.",
    )


@computes("handeye.li_moves")
def li_moves():
    """With how many translations of the robot the rotation of Li et al. follows."""
    scene = literature.suitable_scene(1e-6, np.random.default_rng(0))
    words = ("eine", "zwei", "drei")
    enough = []
    for moves in (1, 2, 3):
        used = scene.translated[: moves + 1]
        try:
            found = literature.li_rotation(scene.T_BF[used], scene.x_S[used])
            enough.append(np.abs(found - scene.T_FS[:3, :3]).max() < 1e-4)  # noise of 1e-6 mm leaves far less
        except ValueError:
            enough.append(False)
    return Computed(
        words[enough.index(True)],
        proof="One translation leaves the turn about its own direction free; two in different directions fix it.",
    )
