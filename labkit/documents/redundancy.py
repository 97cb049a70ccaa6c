"""What each of the four documents would have needed to see its own errors.

A fit can show an error only where more was measured than is asked for. `Check` counts that, for a measurement as a
document describes it and for the same with one thing added, and tells how large an error of one number must be to be
seen, in standard deviations of a reading (`estimation.influence.visible_errors`).
"""

from dataclasses import dataclass

import numpy as np

from ..calibration.hand_eye import calibrate_sphere_target, joint_jacobian
from ..calibration.own_data import FrameModel
from ..estimation.influence import VISIBLE, visible_errors
from ..geometry.frames import frame_from_points, invert, transform
from ..localization import ekf, odometry
from .lab_sheet import printed as lab_sheet
from .lecture.examples import circle_course
from .report import printed as report
from .thesis import printed as thesis


@dataclass(frozen=True, eq=False)
class Check:
    """One measurement of a document.

    Attributes
    ----------
    document, measured : str
        Which, and what was measured.
    jacobian : array, shape (n, p)
        Derivative of the n whitened numbers by the p unknowns.
    """

    document: str
    measured: str
    jacobian: np.ndarray

    @property
    def left(self):
        """How many numbers are left to check the others."""
        return len(self.jacobian) - self.jacobian.shape[1]

    @property
    def visible(self):
        """Smallest error that is seen, of the number that is checked best and worst (standard deviations)."""
        errors = visible_errors(self.jacobian)
        return float(errors.min()), float(errors.max())

    def __str__(self):
        low, high = self.visible
        n, p = self.jacobian.shape
        size = f"from {low:.1f} std on"
        if high > 1.01 * low:
            size = f"from {low:.1f} to {high:.1f} std on" if np.isfinite(high) else f"{size}, some never"
        seen = f"an error is seen {size}" if self.left else "no error is ever seen"
        counted = f"{n} number{'s' * (n > 1)}, {p} unknown{'s' * (p > 1)}"
        return f"{self.document}: {self.measured}: {counted}: {seen}"


def checks():
    """Two `Check`s a document: as it was measured, and with what was missing.

    Returns
    -------
    found : list of (Check, Check)
    """
    return [_three_points(), _one_position(), _six_runs(), _dead_reckoning()]


def _three_points():
    """The lab sheet's first frame; the points' places in the frame are either unknown as well, or measured once."""
    points = lab_sheet.points()["K0"]
    nominal = transform(invert(frame_from_points(*points)), points)
    known = FrameModel(nominal, points)
    J = known.linearize((frame_from_points(*points),))[1].reshape(9, 6)
    shape = np.zeros((9, 3))  # x of the second point, x and y of the third: what Gram-Schmidt leaves free
    R = frame_from_points(*points)[:3, :3]
    shape[3:6, 0], shape[6:9, 1], shape[6:9, 2] = R[:, 0], R[:, 0], R[:, 1]
    return (
        Check("lab sheet", "a frame through three points", np.column_stack([J, shape])),
        Check("lab sheet", "the same, the distances between them known", J),
    )


def _one_position():
    """The thesis validates its end pose at one position; all 31 were measured."""
    measured, frame = thesis.measurements(True), thesis.frame("scanner_end")
    one = joint_jacobian(measured.T_BF[:1], measured.x_S[:1], frame, target_free=False)[:, 3:]  # where the scanner sits
    fit = calibrate_sphere_target(measured.T_BF, measured.x_S)
    return (
        Check("thesis", "one position validated", one),
        Check("thesis", "all 31 positions, sphere free", joint_jacobian(measured.T_BF, measured.x_S, fit.T_FS)),
    )


def _six_runs():
    """The report's appendix D: a column of one run, and of six."""
    return (
        Check("report", "one run of a quantity", np.ones((1, 1))),
        Check("report", "six runs of it", np.ones((len(report.table_d().runs), 1))),
    )


def _dead_reckoning():
    """The lecture's circle, once around: the pose by dead reckoning, and with a landmark seen from the end."""
    course = circle_course(marks=1)
    x, P = course.x0, course.cov0
    for u in course.controls:
        x, P = odometry.propagate(x, P, u, course.dt, course.cov_u)
    white = np.linalg.inv(np.linalg.cholesky(P))
    H = ekf.measurement_jacobian(x, course.landmarks)[0] / np.array([[course.std_range], [course.std_bearing]])
    return (
        Check("lecture", "a pose by dead reckoning", white),
        Check("lecture", "the same, one landmark seen in the end", np.vstack([white, H])),
    )


def misprints_seen():
    """How far the wrong rows of the thesis lie from the fit of the others, in standard deviations of a coordinate.

    Returns
    -------
    sizes : dict
        {pose: size}, of all rows with a correction.
    limit : float
        From where an error counts as seen.
    """
    measured = thesis.measurements()
    fit = calibrate_sphere_target(measured.T_BF, measured.x_S, robust=True)
    lengths = np.linalg.norm(fit.residuals, axis=1) / fit.std
    return {row["pose"]: float(lengths[row["pose"] - 1]) for row in thesis.corrections()}, VISIBLE


def averages_seen():
    """What shows the wrong entry of the report's run 3: the other runs, or the average printed beneath them.

    Returns
    -------
    by_runs : float
        How far it lies from the mean of the others, in their standard deviations.
    by_average : float
        How far it lies from what the printed average asks for, in units of what rounding explains.
    """
    table = report.table_d()
    run, column = report.UPSIDE_DOWN
    others = np.delete(table.runs[:, column], run)
    by_runs = abs(table.runs[run, column] - others.mean()) / (others.std(ddof=1) * np.sqrt(1 + 1 / len(others)))
    asked = len(table.runs) * table.mean[column] - others.sum()
    explained = (
        len(table.runs) * table.half_units[len(table.runs), column]
        + np.delete(table.half_units[: len(table.runs), column], run).sum()
    )
    return float(by_runs), float(abs(table.runs[run, column] - asked) / explained)
