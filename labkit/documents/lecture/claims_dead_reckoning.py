"""Lecture, lateration and dead reckoning: what the printed constants mean, and the entries of the printed Jacobians."""

import numpy as np

from ...localization import lateration, odometry
from ..ledger import Computed, computes
from . import printed as lecture

NOTEBOOK = "07_dead_reckoning"


def _std_after(u, duration, noise):
    """Standard deviations (x, y, theta) after driving u for `duration` in the lecture's time steps."""
    dt = lecture.constants("circle_drive")["dt"]
    controls = np.tile(u, (round(duration / dt), 1))
    cov = odometry.drive_with_covariance(np.zeros(3), np.zeros((3, 3)), controls, dt, **noise, model="euler")[1][-1]
    return np.sqrt(np.diag(cov))


@computes("odometry.std_distance_1m")
def distance_after_one_meter():
    noise = lecture.circle_drive().noise | {"k_theta": 0.0, "k_drift": 0.0}
    return Computed(_std_after([1.0, 0.0], 1.0, noise)[0])


@computes("odometry.std_distance_1m_example")
def distance_after_one_meter_example():
    k_d = lecture.constants("circle_drive")["std_distance_per_meter_example"] ** 2
    return Computed(_std_after([1.0, 0.0], 1.0, {"k_d": k_d, "k_theta": 0.0, "k_drift": 0.0})[0])


@computes("odometry.std_heading_turn_deg")
def heading_after_one_turn():
    return Computed(np.degrees(_std_after([0.0, np.pi / 5], 10.0, lecture.circle_drive().noise)[2]))


@computes("odometry.std_heading_1m_deg")
def heading_after_one_meter():
    return Computed(np.degrees(_std_after([1.0, 0.0], 1.0, lecture.circle_drive().noise)[2]))


def _numeric_jacobians():
    """F_x and F_u of the simplified step by central differences at an arbitrary pose and control."""
    x, u, dt, h = np.array([0.3, -1.2, 0.8]), np.array([0.7, 0.4]), 0.1, 1e-6

    def slope(dx, du):
        return (odometry.step(x + dx, u + du, dt, "euler") - odometry.step(x - dx, u - du, dt, "euler")) / (2 * h)

    F_x = np.column_stack([slope(h * e, 0.0) for e in np.eye(3)])
    return F_x, np.column_stack([slope(0.0, h * e) for e in np.eye(2)])


@computes("odometry.F_x")
def jacobian_by_state():
    return Computed(_numeric_jacobians()[0])


@computes("odometry.F_u")
def jacobian_by_control():
    return Computed(_numeric_jacobians()[1])


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
    half = np.tan(np.radians(given["xtion_horizontal_deg"] / 2)) * given["xtion_rows"] / given["xtion_columns"]
    return Computed(np.degrees(2 * np.arctan(half)))
