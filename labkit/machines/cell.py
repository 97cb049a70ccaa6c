"""One cell from beginning to end: frames, tip, scanner and tracker together find a part and send the tip to it.

The part P stands on a trolley that also carries the tracker E. Once it is *learned*: from three flange poses its marks
are seen by the scanner S, or touched with the tip, and the frame through them is T_BP0, while the tracker reads T_WE0.
Later the trolley stands elsewhere and the tracker reads T_WE1. Nothing has moved between tracker and part, so

    T_BP = T_BW T_WE1 (T_BW T_WE0)^-1 T_BP0,

and the tip is sent to a hole of the part: the flange goes where R tip + t is the hole as it was found. Three
calibrations enter: the tip (chapter 3), T_FS (chapter 5), T_BW (chapter 6). The arm itself counts as exact, as in the
report (section 3). Lengths mm, angles rad; errors of transforms as in `geometry.propagation`.

A *source* of error is what is measured independently of the rest: each calibration, the three marks, each reading.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..calibration.ax_xb import calibrate_hand_eye
from ..calibration.hand_eye import calibrate_sphere_target, sphere_in_scanner
from ..calibration.pivot import calibrate_pivot, cone, touching_poses
from ..calibration.planning import DOWN, pattern, poses_that_see
from ..checks import as_choice, as_count, as_points, as_shape, as_size, fit_together
from ..documented import documented
from ..geometry.frames import frame_from_points, invert, moved, pose, transform
from ..geometry.lie import exp_so3
from ..geometry.propagation import (
    chain_jacobians,
    error_budget,
    inverse_jacobian,
    point_jacobians,
    product_jacobians,
    three_point_jacobian,
)
from . import simulation
from .arm import TX40, tool_pose

SOURCES = ("tip", "scanner", "tracker", "marks", "first reading", "second reading")
FRAMES = ("W", "E0", "E", "P0", "P", "F", "S")  # of `frame_in_base`


@dataclass(frozen=True, eq=False)
class Cell:
    """The calibrations of a cell, each with its covariance.

    Attributes
    ----------
    tip : array, shape (3,)
        In F (mm).
    T_FS, T_BW : arrays, shape (4, 4)
        The scanner on the flange; the tracker's world in the base (mm).
    cov_tip : array, shape (3, 3)
    cov_FS, cov_BW : arrays, shape (6, 6)
        Rotation vector (rad, about the axes of the second frame), then translation (mm, in the first).
    """

    tip: np.ndarray
    T_FS: np.ndarray
    T_BW: np.ndarray
    cov_tip: np.ndarray
    cov_FS: np.ndarray
    cov_BW: np.ndarray


@dataclass(frozen=True, eq=False)
class Job:
    """A part that was learned once and is found again.

    Attributes
    ----------
    T_BF : array, shape (3, 4, 4)
        Flange poses at the marks: origin, a point on x, a point on the side of y of the part's frame.
    marks : array, shape (3, 3)
        The marks as measured there: in S when seen by the scanner; when touched, how far from the tip, in F: 0 but
        for the touch's own error.
    T_WE0, T_WE1 : arrays, shape (4, 4)
        The tracker's readings when the part was learned, and now.
    hole : array, shape (3,)
        In P (mm).
    R_tool : array, shape (3, 3)
        How the flange is turned when the tip goes to the hole.
    touched : bool
        Whether the marks were touched with the tip instead of seen by the scanner.
    std_mark : float
        Of each coordinate of a mark (mm).
    std_reading : tuple
        Of each component of a reading, (rad, mm).
    """

    T_BF: np.ndarray
    marks: np.ndarray
    T_WE0: np.ndarray
    T_WE1: np.ndarray
    hole: np.ndarray
    R_tool: np.ndarray
    touched: bool = False
    std_mark: float = 0.1
    std_reading: tuple = (np.deg2rad(0.02), 0.12)


@documented
def cell_from(tip, scanner, tracker):
    """The cell that three calibrations describe.

    Parameters
    ----------
    tip : calibration.pivot.PivotCalibration
    scanner : calibration.hand_eye.SphereHandEye
    tracker : calibration.ax_xb.EyeToHand
        Its sensor frame S is the tracker's world W.

    Returns
    -------
    Cell
    """
    return Cell(
        tip.tip, scanner.T_FS, tracker.T_BS,
        tip.covariance_of("tip"), scanner.covariance_of("T_FS"), tracker.covariance_of("T_BS"),
    )  # fmt: skip


# ---- from the marks to the tip ---------------------------------------------------------------------------------------


@documented
def marks_in_base(cell, job):
    """The three marks of the part in the base, where it was learned.

    Parameters
    ----------
    cell : Cell
    job : Job

    Returns
    -------
    marks : array, shape (..., 3, 3), mm
    """
    if job.touched:
        return transform(job.T_BF, cell.tip[..., None, :] + job.marks)
    return transform(job.T_BF, transform(cell.T_FS[..., None, :, :], job.marks))


@documented
def learned_pose(cell, job):
    """T_BP0, the frame through the marks: chapter 1.

    Parameters
    ----------
    cell : Cell
    job : Job

    Returns
    -------
    T_BP : array, shape (..., 4, 4)
    """
    return frame_from_points(*np.moveaxis(marks_in_base(cell, job), -2, 0))


@documented
def moved_part(T_BW, T_WE0, T_WE1, T_BP0):
    """Where a part stands after its tracker has moved with it: chapter 2's chain around the tracker.

    Parameters
    ----------
    T_BW : array, shape (..., 4, 4)
        The tracker's world in the base (mm).
    T_WE0, T_WE1 : array, shape (..., 4, 4)
        Its readings when the part was learned, and now.
    T_BP0 : array, shape (..., 4, 4)
        The part as it was learned.

    Returns
    -------
    T_BP : array, shape (..., 4, 4)
    """
    fit_together(T_BW=T_BW.shape[:-2], T_WE0=T_WE0.shape[:-2], T_WE1=T_WE1.shape[:-2], T_BP0=T_BP0.shape[:-2])
    T_BE0, T_BE1 = T_BW @ T_WE0, T_BW @ T_WE1
    return T_BE1 @ invert(T_BE0) @ T_BP0


@documented
def part_pose(cell, job):
    """T_BP, where the part is now.

    Parameters
    ----------
    cell : Cell
    job : Job

    Returns
    -------
    T_BP : array, shape (..., 4, 4)
    """
    return moved_part(cell.T_BW, job.T_WE0, job.T_WE1, learned_pose(cell, job))


@documented
def hole_in_base(cell, job):
    """Where the hole is found.

    Parameters
    ----------
    cell : Cell
    job : Job

    Returns
    -------
    hole : array, shape (..., 3), mm
    """
    return transform(part_pose(cell, job), job.hole)


@documented
def flange_at_hole(cell, job):
    """Flange pose that brings the tip to the hole as it was found.

    Parameters
    ----------
    cell : Cell
    job : Job

    Returns
    -------
    T_BF : array, shape (..., 4, 4)
    """
    return pose(job.R_tool, hole_in_base(cell, job) - (job.R_tool @ cell.tip[..., None])[..., 0])


@documented
def miss(truth, cell, job, measured=None):
    """How far the tip misses the hole when everything is computed with a cell and is really as in another.

    Parameters
    ----------
    truth : Cell
        What the true cell would be.
    cell : Cell
        The calibrated cell.
    job : Job
        With the marks and readings of the true cell.
    measured : Job, optional
        With the marks and readings the calibrated cell is given; unless given they are exact, those of `job`.

    Returns
    -------
    miss : array, shape (..., 3), mm
        Tip less hole, in the base.
    """
    flange = flange_at_hole(cell, job if measured is None else measured)
    return transform(flange, truth.tip) - hole_in_base(truth, job)


# ---- how sure it is --------------------------------------------------------------------------------------------------


@documented
def source_covariances(cell, job):
    """Covariance of each source.

    Parameters
    ----------
    cell : Cell
    job : Job

    Returns
    -------
    covariances : dict
        {source: array}, (3, 3) for the tip, (9, 9) for the marks, (6, 6) for all others.
    """
    reading = np.diag(np.repeat(job.std_reading, 3) ** 2)
    return dict(zip(SOURCES, (cell.cov_tip, cell.cov_FS, cell.cov_BW, job.std_mark**2 * np.eye(9), reading, reading)))


def _mark_jacobians(cell, job):
    """How the marks in the base, (9,), move with tip, scanner and marks."""
    R = job.T_BF[:, :3, :3]
    if job.touched:
        by_mark = R
        by_tip, by_scanner = R.reshape(9, 3), np.zeros((9, 6))
    else:
        by_frame, by_point = point_jacobians(cell.T_FS, job.marks)
        by_mark = R @ by_point
        by_tip, by_scanner = np.zeros((9, 3)), (R @ by_frame).reshape(9, 6)
    every = np.zeros((3, 3, 3, 3))
    every[range(3), :, range(3), :] = by_mark
    return {"tip": by_tip, "scanner": by_scanner, "marks": every.reshape(9, 9)}


@documented
def part_jacobians(cell, job):
    """How the part's pose T_BP moves with each source.

    Parameters
    ----------
    cell : Cell
    job : Job

    Returns
    -------
    jacobians : dict
        {source: array, shape (6, n)}.
    """
    marks = marks_in_base(cell, job)
    chain = (cell.T_BW, job.T_WE1, invert(job.T_WE0), invert(cell.T_BW), frame_from_points(*marks))
    _, (world, now, then, back, part) = chain_jacobians(chain)
    by_marks = part @ three_point_jacobian(*marks)
    return {name: by_marks @ J for name, J in _mark_jacobians(cell, job).items()} | {
        "tracker": world + back @ inverse_jacobian(cell.T_BW),
        "first reading": then @ inverse_jacobian(job.T_WE0),
        "second reading": now,
    }


@documented
def miss_jacobians(cell, job):
    """How the tip's miss of the hole moves with each source; the tip may enter twice, and cancel.

    Parameters
    ----------
    cell : Cell
    job : Job

    Returns
    -------
    jacobians : dict
        {source: array, shape (3, n)}: by an error of the source as it is used; the miss is of the opposite sign for
        an error of the truth.
    """
    by_part = point_jacobians(part_pose(cell, job), job.hole)[0]
    jacobians = {name: by_part @ J for name, J in part_jacobians(cell, job).items()}
    jacobians["tip"] = jacobians["tip"] - job.R_tool
    return jacobians


@documented
def part_covariance(cell, job):
    """Covariance of T_BP to first order.

    Parameters
    ----------
    cell : Cell
    job : Job

    Returns
    -------
    covariance : array, shape (6, 6)
        Rotation vector (rad, about the axes of P), then translation (mm).
    """
    return sum(error_budget(part_jacobians(cell, job), source_covariances(cell, job)).values())


@documented
def miss_budget(cell, job):
    """What each source contributes to the covariance of the miss.

    Parameters
    ----------
    cell : Cell
    job : Job

    Returns
    -------
    shares : dict
        {source: array, shape (3, 3), mm^2}; their sum is the covariance.
    """
    return error_budget(miss_jacobians(cell, job), source_covariances(cell, job))


def sizes(shares):
    """Standard deviation in space that each share stands for, the root of its trace.

    Parameters
    ----------
    shares : dict
        {source: array, shape (3, 3), mm^2}, as `miss_budget` gives them.

    Returns
    -------
    sizes : dict
        {source: float, mm}.
    """
    return {name: float(np.sqrt(np.trace(share))) for name, share in shares.items()}


@documented
def with_errors(cell, job, errors):
    """The cell and the job as they would be with errors in their sources.

    Parameters
    ----------
    cell : Cell
    job : Job
    errors : dict
        {source: array, shape (..., n)}; what is not named stays.

    Returns
    -------
    cell : Cell
    job : Job

    Raises
    ------
    ValueError
        A source that there is not, an error of another shape.
    """
    known = source_covariances(cell, job)
    e = {name: np.zeros(len(cov)) for name, cov in known.items()}
    for name, error in errors.items():
        as_choice(name, "errors", known)
        e[name] = as_points(error, name, len(known[name]))
    marks = job.marks + e["marks"].reshape(*e["marks"].shape[:-1], 3, 3)
    return (
        replace(cell, tip=cell.tip + e["tip"], T_FS=moved(cell.T_FS, e["scanner"]),
                T_BW=moved(cell.T_BW, e["tracker"])),
        replace(job, marks=marks, T_WE0=moved(job.T_WE0, e["first reading"]),
                T_WE1=moved(job.T_WE1, e["second reading"])),
    )  # fmt: skip


@documented
def draw_errors(cell, job, rng, n=10_000):
    """Errors of all sources in many simulated cells, drawn from their covariances: they hang on nothing else.

    Parameters
    ----------
    cell : Cell
    job : Job
    rng : numpy.random.Generator
    n : int

    Returns
    -------
    errors : dict
        {source: array, shape (n, k)}, as `with_errors` takes them.
    """
    n = as_size(n, "n")
    return {
        name: rng.multivariate_normal(np.zeros(len(cov)), cov, n, method="svd")
        for name, cov in source_covariances(cell, job).items()
    }


@documented
def misses_by(cell, job, errors):
    """The miss of the hole in cells with these errors; nothing is linearized.

    Parameters
    ----------
    cell : Cell
        Taken as the truth.
    job : Job
    errors : dict
        {source: array, shape (..., k)}, as `draw_errors` draws them.

    Returns
    -------
    misses : array, shape (..., 3), mm

    Raises
    ------
    ValueError
        A source that there is not, an error of another shape.
    """
    drawn_cell, drawn_job = with_errors(cell, job, errors)
    return miss(cell, drawn_cell, job, drawn_job)


@documented
def simulate_misses(cell, job, rng, n=10_000):
    """The miss of the hole in many simulated cells, all sources drawn from their covariances; nothing is linearized.

    Parameters
    ----------
    cell : Cell
        The center of the draws, taken as the truth.
    job : Job
    rng : numpy.random.Generator
    n : int

    Returns
    -------
    misses : array, shape (n, 3), mm
    """
    return misses_by(cell, job, draw_errors(cell, job, rng, n))


@documented
def frame_in_base(cell, job, name):
    """One frame of the cell as it stands in the base when the tip goes to the hole, with its covariance.

    Parameters
    ----------
    cell : Cell
    job : Job
    name : {"W", "E0", "P0", "E", "P", "F", "S"}
        W, the tracker and the part as they were learned (E0, P0) and now (E, P), the flange F, which counts as exact,
        and the scanner S on it.

    Returns
    -------
    T : array, shape (4, 4)
    covariance : array, shape (6, 6)
    """
    if name == "W":
        return cell.T_BW, cell.cov_BW
    if name in ("E0", "E"):
        return _tracker_in_base(cell, job, "first reading" if name == "E0" else "second reading")
    if name == "P0":
        return learned_pose(cell, job), _learned_covariance(cell, job)
    if name == "P":
        return part_pose(cell, job), part_covariance(cell, job)
    T_BF = flange_at_hole(cell, job)
    if name == "F":
        return T_BF, np.zeros((6, 6))
    turned = product_jacobians(T_BF, cell.T_FS)[1]
    return T_BF @ cell.T_FS, turned @ cell.cov_FS @ turned.T


@documented
def frames_in_base(cell, job):
    """Every frame of `frame_in_base`, each with its covariance.

    Parameters
    ----------
    cell : Cell
    job : Job

    Returns
    -------
    frames : dict
        {name: (T, covariance)}, shapes (4, 4) and (6, 6).
    """
    return {name: frame_in_base(cell, job, name) for name in FRAMES}


def _tracker_in_base(cell, job, reading):
    """A reading of the tracker in the base, with its covariance."""
    T_WE = job.T_WE0 if reading == "first reading" else job.T_WE1
    by_world, by_reading = product_jacobians(cell.T_BW, T_WE)
    cov_reading = source_covariances(cell, job)[reading]
    return cell.T_BW @ T_WE, by_world @ cell.cov_BW @ by_world.T + by_reading @ cov_reading @ by_reading.T


def _learned_covariance(cell, job):
    """Covariance of T_BP0."""
    J0, cov = three_point_jacobian(*marks_in_base(cell, job)), source_covariances(cell, job)
    by_marks = {name: J0 @ J for name, J in _mark_jacobians(cell, job).items()}
    return sum(error_budget(by_marks, {name: cov[name] for name in by_marks}).values())


# ---- a simulated cell ------------------------------------------------------------------------------------------------

MARKS = np.array([[0.0, 0, 0], [110.0, 0, 0], [25.0, 80, 0]])  # in P
HOLE = np.array([80.0, 55.0, 0.0])  # in P
T_PE = pose(exp_so3([0.0, 0.0, 0.4]), [-70.0, 40.0, 60.0])  # the tracker on the trolley
TABLE = 100.0  # mm, height of the part over the robot's foot
TRUTH = Cell(
    np.array([0.0, 30.0, 130.0]),
    pose(exp_so3([0.1, -0.08, 0.3]), [45.0, -15.0, 50.0]),
    tool_pose(TX40, simulation.measuring_joints()[0], simulation.T_FE),
    np.zeros((3, 3)), np.zeros((6, 6)), np.zeros((6, 6)),
)  # fmt: skip
STD_TOUCH, STD_CENTER = 0.15, 0.33  # mm per axis: a tip on its point; a sphere's center, 0.57 mm in space (chapter 5)
STD_STOP = (np.deg2rad(0.1), 0.6)  # rad and mm per axis: a reading at the short stops of the tracker's calibration
LEARNED = (190.0, -180.0, 0.3)  # x, y (mm) and turn (rad) of the part when it is learned
FAR = (60.0, 250.0, 1.5)  # and somewhere else


@documented
def calibrate_tip(rng, n=24, half_angle=0.5):
    """The tip by *Quirlen*, as in chapter 3.

    Parameters
    ----------
    rng : numpy.random.Generator
    n : int
        Number of poses.
    half_angle : float, rad
        Of the cone on which the tool is led.

    Returns
    -------
    calibration.pivot.PivotCalibration
    """
    R = DOWN @ cone(n, half_angle, turns=0.5)
    return calibrate_pivot(touching_poses(R, TRUTH.tip, [300.0, 50.0, 200.0], 0.0, STD_TOUCH, rng))


@documented
def calibrate_scanner(rng, n=31, tilt=0.35):
    """The scanner from a sphere, as in chapter 5.

    Parameters
    ----------
    rng : numpy.random.Generator
    n : int
        Number of poses.
    tilt : float, rad
        Largest angle between the line of sight and straight down.

    Returns
    -------
    calibration.hand_eye.SphereHandEye
    """
    target = np.array([240.0, 0.0, 110.0])
    T_BF = pattern(TRUTH.T_FS, target, tilt, (20.0, 20.0, 20.0), n)
    x_S = sphere_in_scanner(T_BF, TRUTH.T_FS, target)
    return calibrate_sphere_target(T_BF, x_S + STD_CENTER * rng.normal(size=x_S.shape))


@documented
def calibrate_tracker(rng, n=21):
    """Where the tracker's world is, with the tracker still on the flange, as in chapter 6.

    Parameters
    ----------
    rng : numpy.random.Generator
    n : int
        Number of stops, at most 21.

    Returns
    -------
    calibration.ax_xb.EyeToHand
    """
    q = simulation.measuring_joints()[: as_count(n, "n", at_least=3)]
    noise = rng.normal(size=(len(q), 6)) * np.repeat(STD_STOP, 3)
    T_WE = moved(invert(TRUTH.T_BW) @ tool_pose(TX40, q, simulation.T_FE), noise)
    return calibrate_hand_eye(simulation.flange_poses(q), T_WE, *STD_STOP, eye="to hand")


@documented
def calibrated_cell(rng):
    """A cell whose three calibrations were simulated, one after the other.

    Parameters
    ----------
    rng : numpy.random.Generator

    Returns
    -------
    Cell
    """
    return cell_from(calibrate_tip(rng), calibrate_scanner(rng), calibrate_tracker(rng))


def place_on_table(x, y, turn):
    """Pose of a part on the table, shape (4, 4).

    Parameters
    ----------
    x, y : float, mm
    turn : float, rad

    Returns
    -------
    T_BP : array, shape (4, 4)
    """
    return pose(exp_so3([0.0, 0.0, turn]), [x, y, TABLE])


@documented
def true_reading(T_BP):
    """What the tracker reads on the true cell, without noise.

    Parameters
    ----------
    T_BP : array, shape (4, 4)
        Where its part stands (mm).

    Returns
    -------
    T_WE : array, shape (4, 4)
    """
    return invert(TRUTH.T_BW) @ T_BP @ T_PE


@documented
def simulated_job(now, learned=LEARNED, touched=False):
    """The job of a part, without noise: what the true cell would measure.

    Parameters
    ----------
    now, learned : array-like, shape (3,)
        Where the part stands and where it was learned: x, y (mm) and turn (rad) on the table.
    touched : bool
        Whether its marks were touched with the tip, the flange turned as later at the hole.

    Returns
    -------
    Job
    """
    now, learned = as_shape(now, "now", 3), as_shape(learned, "learned", 3)
    T_BP0, T_BP1 = place_on_table(*learned), place_on_table(*now)
    R_tool = exp_so3([0.0, 0.0, learned[2]]) @ DOWN
    if touched:
        marks, R_BF = np.zeros((3, 3)), np.broadcast_to(R_tool, (3, 3, 3))
        T_FM = pose(np.eye(3), TRUTH.tip)  # M is what measures the marks: the tip, or the scanner
    else:
        marks = np.array([[6.0, 5.0, 215.0], [-8.0, -6.0, 230.0], [4.0, 7.0, 220.0]])
        tilts = exp_so3(np.deg2rad([[8.0, 0, 0], [-6.0, -6.0, 20.0], [0, -8.0, -20.0]]))
        R_BF, T_FM = tilts @ R_tool @ TRUTH.T_FS[:3, :3].T, TRUTH.T_FS
    T_BF = poses_that_see(T_FM, transform(T_BP0, MARKS), R_BF, marks)
    return Job(T_BF, marks, true_reading(T_BP0), true_reading(T_BP1), HOLE, R_tool, touched)
