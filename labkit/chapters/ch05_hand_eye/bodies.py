"""Bodies of chapter 5: the KR 60's flange with the line scanner in its hand, the light it sends, and the sphere.

Where flange, scanner and sphere are is the thesis's; how thick the machines are nobody printed.
"""

import numpy as np

from ...calibration.planning import FIELD
from ...stage import scene3d_solids as solids
from ...stage import style

SCANNER = solids.box((-75, 75), (-26, 26), (-90, 0)), solids.box((-55, 55), (-18, 18), (0, 4)).looks(style.INK)


def ghost(color):
    """The scanner where a search believes it to be, in the color of the search."""
    return SCANNER[0].looks(color, 0.45)


class Hand:
    """The flange, the scanner, what holds it, and its fan of light: `.set(T_BF, T_BS)`."""

    def __init__(self, scene):
        (left, right), _, (_, far) = FIELD
        self.flange = scene.body(
            solids.cylinder(84.0, -70.0, -18.0, 92.0), solids.cylinder(80.0, -18.0, 0.0).looks(style.STEEL),
            name="flange plate",
        )  # fmt: skip
        self.holder = scene.rod(22.0, name="holder")
        self.scanner = scene.body(*SCANNER, name="scanner")
        light = solids.raised([(0, 0), (far, left * 1.15), (far, right * 1.15)], -0.6, 0.6).looks(style.LASER, 0.3)
        turn = np.array([[0.0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0], [0, 0, 0, 1]])  # the fan lies in y = 0, down z
        self.light = scene.body(light.moved(turn), name="light")

    def set(self, T_BF, T_BS):
        """Poses of flange and scanner in the base, (4, 4), mm."""
        self.flange.set(T_BF)
        self.scanner.set(T_BS)
        self.light.set(T_BS)
        self.holder.set(T_BF[:3, 3], T_BS[:3, 3] - 40 * T_BS[:3, 2])


def ball(scene, radius):
    """The sphere on its stem: `.set(T)` with its center."""
    return scene.body(
        solids.sphere(radius).looks(style.SHELL), solids.cylinder(7.0, -4 * radius, -0.9 * radius).looks(style.STEEL),
        name="sphere",
    )  # fmt: skip
