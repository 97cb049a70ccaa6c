"""Lecture, lateration and dead reckoning: the entries of the printed Jacobians, and what the pages claim."""

import functools

import numpy as np

from ...estimation.differences import numeric_jacobian
from ...localization import lateration, odometry
from .. import rounding
from ..ledger import Computed, computes
from . import printed as lecture

NOTEBOOK = "07_dead_reckoning"

POSES_TRIED = (([0.3, -1.2, 0.8], [0.7, 0.4], 0.1), ([2.0, 0.4, -2.1], [1.3, -0.6], 0.25))  # pose, control, time step
STEP = 1e-6  # of the central differences below


def _numeric_jacobians(x, u, dt):
    """F_x and F_u of the simplified step by central differences at a pose and a control."""
    F_x = numeric_jacobian(lambda x: odometry.step(x, u, dt, "euler"), x, STEP)
    return F_x, numeric_jacobian(lambda u: odometry.step(x, u, dt, "euler"), u, STEP)


def _left_by_differences(x, u, dt):
    """What central differences leave of a right derivative: STEP^2 / 6 of the third one, here dt v or dt at most, and
    two rounded ends of a pose, each off by up to two units in the last place (a product and a sum), over 2 STEP.
    """
    third, largest = dt * max(abs(u[0]), 1.0), np.abs(odometry.step(x, u, dt, "euler")).max()
    return STEP**2 / 6 * third + 2 * np.spacing(max(largest, 1.0)) / STEP


@computes("odometry.F_x")
def jacobian_by_state():
    return Computed(
        _numeric_jacobians(*POSES_TRIED[0])[0],
        proof="0 or 1 whatever is driven: the state enters the step by addition.",
    )


@computes("odometry.F_u")
def jacobian_by_control():
    return Computed(
        _numeric_jacobians(*POSES_TRIED[0])[1],
        proof="0 whatever is driven: this control does not move this coordinate.",
    )


def _expression(by, row, column):
    """The one among six simple expressions that agrees with the numeric derivative at two poses and controls."""
    agreeing = None
    for x, u, dt in POSES_TRIED:
        v, theta = u[0], x[2]
        tried = {
            "T cos θ_k": dt * np.cos(theta),
            "T sin θ_k": dt * np.sin(theta),
            "T": dt,
            "-T v_k sin θ_k": -dt * v * np.sin(theta),
            "T v_k cos θ_k": dt * v * np.cos(theta),
            "T v_k sin θ_k": dt * v * np.sin(theta),
        }
        numeric = _numeric_jacobians(x, u, dt)[by][row, column]
        slack = _left_by_differences(x, u, dt)
        right = {name for name, value in tried.items() if abs(value - numeric) <= slack}
        agreeing = right if agreeing is None else agreeing & right
    return Computed(" or ".join(sorted(agreeing)), proof="Compared with central differences at two poses and controls.")


for _id, _entry in {
    "F_x_13": (0, 0, 2),
    "F_x_23": (0, 1, 2),
    "F_u_11": (1, 0, 0),
    "F_u_21": (1, 1, 0),
    "F_u_32": (1, 2, 1),
}.items():
    computes(f"odometry.{_id}")(functools.partial(_expression, *_entry))


@computes("odometry.without_half_turn")
def without_half_turn():
    """The page's words, from the end of the circle drive: is the simplified model farther from the exact arc?"""
    drive = lecture.circle_drive()
    end = {m: odometry.drive(np.zeros(3), drive.controls, drive.dt, m)[-1, :2] for m in odometry.MODELS}
    off = {m: np.hypot(*(end[m] - end["arc"])) for m in odometry.MODELS}
    return Computed("weniger genau" if off["euler"] > off["midpoint"] else "genauer")


def _landmarks_needed(dim):
    """Smallest number of landmarks in general position at which the lecture's equations fix the position locally."""
    landmarks = np.array([[0.0, 0.0, 0.0], [4.0, 0.5, 0.2], [1.0, 3.0, 0.4], [2.0, 1.0, 3.0]])[:, :dim]
    position = np.array([1.5, 1.0, 0.7])[:dim]
    ranks = [np.linalg.matrix_rank(lateration.square_jacobian(landmarks[:n], position)) for n in range(1, 5)]
    return 1 + ranks.index(dim)


@computes("lateration.landmarks_2d")
def landmarks_2d():
    return Computed(_landmarks_needed(2))


@computes("lateration.landmarks_3d")
def landmarks_3d():
    return Computed(_landmarks_needed(3))


@computes("lateration.roots")
def roots():
    """Different ends of Newton's method over a grid of starts around two landmarks."""
    landmarks, position = np.array([[0.0, 0.0], [6.0, 0.0]]), np.array([3.0, 2.0])
    distances = np.linalg.norm(landmarks - position, axis=1)
    ends = [
        lateration.newton_lateration(landmarks, distances, [x, y])
        for x in np.linspace(-4, 10, 8)
        for y in np.linspace(-6, 6, 8)
    ]
    return Computed(len({tuple(np.round(end.position, 6)) for end in ends if end.converged}))


@computes("lateration.lms100_rate")
def scan_rate():
    given = lecture.constants("sensors")
    ratio = given["lms100_resolution_coarse_deg"] / given["lms100_resolution_fine_deg"]
    return Computed(given["lms100_rate_fine"] * ratio)


@computes("lateration.xtion_vertical")
def vertical_field_of_view():
    given = lecture.constants("sensors")
    shape = given["xtion_rows"] / given["xtion_columns"]

    def vertical(horizontal):
        return np.degrees(2 * np.arctan(np.tan(np.radians(horizontal / 2)) * shape))

    value, bound = rounding.propagate(
        vertical, rounding.read(lecture.digits("dead_reckoning/sensors")["xtion_horizontal_deg"])
    )
    return Computed(value, bound=bound)
