"""Bodies of chapter 2: the measuring arm of the lab sheet on its stand, and the piece that the moves carry about.

How the arm looks nobody printed; where it touches is what was measured.
"""

import numpy as np

from ...geometry.frames import pose
from ...stage import scene3d_solids as solids
from ...stage import style

SHOULDER = 300.0  # mm, height of its shoulder over the floor
UPPER, FORE = 400.0, 400.0  # mm, from the shoulder to the elbow, and on to the wrist
PROBE = 70.0  # mm, from the wrist down to the tip


class MeasuringArm:
    """A foot, a column, two links that bend, and a probe: `.set(stand, tip)`."""

    def __init__(self, scene):
        self.foot = scene.body(
            solids.cylinder(60, 0, 20).looks(style.STEEL), solids.cylinder(26, 20, SHOULDER - 34, 22),
            solids.cylinder(32, SHOULDER - 34, SHOULDER + 22), name="foot",
        )  # fmt: skip
        self.upper, self.fore = (
            scene.rod(15.0, style.SHELL, name="upper arm"),
            scene.rod(12.0, style.SHELL, name="forearm"),
        )
        self.probe = scene.rod(4.5, name="probe")
        self.elbow = scene.body(solids.sphere(23.0, 8).looks(style.STEEL), name="elbow")
        self.wrist = scene.body(solids.sphere(17.0, 8).looks(style.STEEL), name="wrist")

    def set(self, stand, tip):
        """Where its foot stands on the floor, and what it touches, (3,), mm; what is out of reach it points at."""
        shoulder, wrist = np.add(stand, [0, 0, SHOULDER]), np.add(tip, [0, 0, PROBE])
        elbow, wrist = bent(shoulder, wrist, UPPER, FORE)
        self.foot.set(pose(np.eye(3), stand))
        self.upper.set(shoulder, elbow)
        self.elbow.set(pose(np.eye(3), elbow))
        self.fore.set(elbow, wrist)
        self.wrist.set(pose(np.eye(3), wrist))
        self.probe.set(wrist, np.subtract(wrist, [0, 0, PROBE]))


def bent(start, end, first, second):
    """Elbow and end of two links between two points, bent upward; stretched toward an end out of reach."""
    way = np.subtract(end, start)
    length = max(np.linalg.norm(way), 1e-9)
    ahead = way / length
    length = min(length, first + second)
    along = (length**2 + first**2 - second**2) / (2 * length)
    up = np.array([0.0, 0.0, 1.0]) - ahead[2] * ahead
    up = up / np.linalg.norm(up) if np.linalg.norm(up) > 1e-9 else np.array([1.0, 0.0, 0.0])
    return start + along * ahead + np.sqrt(max(first**2 - along**2, 0.0)) * up, start + length * ahead


def piece():
    """A piece with a long and a short side, so that one sees how it is turned."""
    return (
        solids.box((0, 95), (0, 26), (0, 20)), solids.box((0, 26), (26, 70), (0, 20)),
        solids.box((0, 26), (0, 26), (20, 44)).looks(style.STEEL),
    )  # fmt: skip
