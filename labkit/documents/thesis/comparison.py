"""The thesis's central experiment: Gauss-Newton against a trust region on the scanner's pose.

Both run on the simulation model, whose scanner stands at B = -90 deg, and both with steps in the KUKA angles, as the
thesis has it, or with steps on the pose itself. Source: thesis "Optimierung bei der Kalibrierung von
Sensor-Roboter-Systemen", HAW Hamburg 2019, sections 6.1.5, 6.1.6 and 7.1.2, tables 7-2 and 7-3.
"""

import functools
from dataclasses import dataclass

import numpy as np

from ...calibration import hand_eye
from ...checks import as_positive_number, as_shape
from ...estimation import optimization as opt
from ...geometry import frames
from ...geometry.lie import exp_so3
from . import printed as thesis

METHODS = ("Gauss-Newton", "trust region")
PARAMETERS = ("A, B, C", "pose")
ARRIVED_MM = 1e-6  # a run has arrived where the rms distance falls below this
RATINGS = ("very good", "good", "bad")  # the three levels that stand below table 7-3


@dataclass(frozen=True, eq=False)
class PoseRun:
    """What one method did from one start.

    Attributes
    ----------
    poses : array, shape (k + 1, 4, 4)
        T_FS at the start and after each step; a step that is taken back repeats its pose.
    rms : array, shape (k + 1,)
        Root-mean-square distance there (mm).
    accepted : bool array, shape (k,)
    """

    poses: np.ndarray
    rms: np.ndarray
    accepted: np.ndarray

    @property
    def arrived(self):
        """Whether the rms distance fell below `ARRIVED_MM`."""
        return bool((self.rms <= ARRIVED_MM).any())

    @property
    def steps(self):
        """Steps until it did, those taken back included; all of them where it did not."""
        return int(np.argmax(self.rms <= ARRIVED_MM)) if self.arrived else len(self.accepted)

    @property
    def taken_back(self):
        """Steps on the way that were taken back."""
        return int((~self.accepted[: self.steps]).sum())

    @property
    def climbs(self):
        """Steps after which the distance was larger than before."""
        rms = self.rms[: self.steps + 1]
        return int((rms[1:] > rms[:-1] + ARRIVED_MM).sum())


@functools.cache
def model(B_deg=-90.0):
    """The simulation model with its scanner turned to B: T_BF, x_S, target and the scanner's pose, mm and deg (6,)."""
    T_BF, _, target, scanner = thesis.simulation()
    scanner = np.array([*scanner[:4], B_deg, scanner[5]])
    T_FS = frames.matrix_from_kuka(frames.kuka_from_degrees(scanner))
    return T_BF, hand_eye.sphere_in_scanner(T_BF, T_FS, target), target, scanner


def run(method, start_deg, parameters="A, B, C", radius=10.0, B_deg=-90.0, max_steps=60):
    """One method on the simulation model.

    Parameters
    ----------
    method : str
        One of `METHODS`. The trust region takes dogleg steps on J'J.
    start_deg : array-like, shape (6,)
        KUKA pose x, y, z (mm), A, B, C (deg) of the scanner.
    parameters : str
        One of `PARAMETERS`: what a step is added to.
    radius : float
        First radius of the trust region (mm); angles count by what they move the sphere.
    B_deg : float
        Where the scanner really stands; -90 in the thesis.
    max_steps : int

    Returns
    -------
    PoseRun

    Raises
    ------
    ValueError
        An unknown method or parametrization, a radius that is not positive.
    """
    if method not in METHODS or parameters not in PARAMETERS:
        raise ValueError(
            f"method must be one of {', '.join(METHODS)}, parameters one of {'; '.join(PARAMETERS)}: "
            f"got {method!r} and {parameters!r}"
        )
    start = frames.kuka_from_degrees(as_shape(start_deg, "start_deg", 6))
    if method == "Gauss-Newton":
        return _gauss_newton(model(B_deg), start, parameters, max_steps)
    return _trust_region(model(B_deg), start, parameters, as_positive_number(radius, "radius"), max_steps)


def _gauss_newton(scene, start, parameters, max_steps):
    T_BF, x_S, target, _ = scene
    name = "se3" if parameters == "pose" else "euler"
    found = hand_eye.gauss_newton_pose(start, T_BF, x_S, target, parameters=name, max_steps=max_steps)
    return PoseRun(found.poses, found.rms, np.ones(len(found.rms) - 1, dtype=bool))


def _trust_region(scene, start, parameters, radius, max_steps):
    T_BF, x_S, target, _ = scene
    turns, shifts = [1 / np.sqrt((x_S**2).sum(1).mean())] * 3, [1.0] * 3
    if parameters == "pose":
        trace = opt.trust_region(
            lambda T_FS: hand_eye.sphere_residuals(T_BF, x_S, T_FS, target).ravel(),
            lambda T_FS: hand_eye.joint_jacobian(T_BF, x_S, T_FS, target_free=False),
            frames.matrix_from_kuka(start), retract=frames.moved, scale=turns + shifts, radius=radius,
            max_iterations=max_steps, stop=_arrives,
        )  # fmt: skip
        poses = trace.x
    else:
        trace = opt.trust_region(
            lambda p: hand_eye.kuka_residuals(p, T_BF, x_S, target),
            lambda p: hand_eye.kuka_jacobian(p, T_BF, x_S),
            start, scale=shifts + turns, radius=radius, max_iterations=max_steps, stop=_arrives,
        )  # fmt: skip
        poses = frames.matrix_from_kuka(trace.x)
    return PoseRun(poses, np.sqrt(2 * trace.cost / len(x_S)), trace.accepted)


def _arrives(before, after):
    distance = np.sqrt(2 * after.cost / (len(after.residual) / 3))
    return "the sphere is met" if distance <= ARRIVED_MM else ""


def rating(arrived):
    """The level of table 7-3 that a list of arrivals asks for, where all is very good and more than half good.

    The thesis rates by the starts from which a method arrives and states no limits; these two are ours, and its own
    columns lead to its own words by them.
    """
    share = np.mean(np.asarray(arrived, dtype=float))
    return RATINGS[0] if share == 1 else RATINGS[1] if share > 0.5 else RATINGS[2]


def table_7_3(parameters="A, B, C", radius=10.0):
    """Both methods from the ten starts of table 7-2, the trust region's eighth as the footnote has it.

    Returns
    -------
    runs : dict
        {method: list of ten PoseRun}.
    """
    starts = {"Gauss-Newton": thesis.start_poses_deg()[0], "trust region": thesis.start_poses_deg()[0].copy()}
    starts["trust region"][8] = thesis.footnote_start_deg()
    return {m: [run(m, start, parameters, radius, max_steps=200) for start in starts[m]] for m in METHODS}


def start_cost(start_deg):
    """Sum of the squared residuals (mm^2) that a start pose, KUKA in mm and deg, leaves on the simulation model."""
    T_BF, x_S, target, _ = model()
    residuals = hand_eye.kuka_residuals(frames.kuka_from_degrees(start_deg), T_BF, x_S, target)
    return float(residuals @ residuals)


def start_at(distance, turn_deg, B_deg=-90.0):
    """A start off the truth: shifted by a distance (mm) along all axes alike and turned about y (deg), shape (6,)."""
    truth = frames.matrix_from_kuka(frames.kuka_from_degrees(model(B_deg)[3]))
    turned = exp_so3([0.0, np.deg2rad(turn_deg), 0.0]) @ truth[:3, :3]
    found = frames.kuka_from_matrix(frames.pose(turned, truth[:3, 3] + distance / np.sqrt(3)))
    return np.concatenate([found[:3], np.rad2deg(found[3:])])


def errors(T_FS, B_deg=-90.0):
    """Distance (mm) and angle (deg) of poses from the true one, (..., 4, 4) -> (..., 2)."""
    truth = frames.matrix_from_kuka(frames.kuka_from_degrees(model(B_deg)[3]))
    turn = frames.rotation_angle(np.swapaxes(truth[:3, :3], 0, 1) @ T_FS[..., :3, :3])
    return np.stack([np.linalg.norm(T_FS[..., :3, 3] - truth[:3, 3], axis=-1), np.rad2deg(turn)], axis=-1)
