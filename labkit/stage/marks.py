"""Small things that several chapters draw: a robot in the plane, the name of what is not used."""

import numpy as np

from . import style

ARROW = np.array([[0.0, 0.6], [1.0, 0.0], [0.0, -0.6], [0.3, 0.0], [0.0, 0.6]])  # a robot that looks along x


class Spare:
    """The name of a landmark that can be dragged but is not used at the moment."""

    def __init__(self, ax, text):
        away = {"xytext": (11, -4), "textcoords": "offset points"}
        self.name = ax.annotate(text, (0, 0), **away, color=style.MUTED, fontsize=9)
        self.artists = [self.name]

    def set(self, point, spare):
        """`point`: (2,); `spare`: whether it is left out now."""
        self.name.xy = tuple(point)
        self.name.set_visible(spare)


def robot_outline(pose, size=0.25):
    """Closed outline of an arrowhead at a pose, (5, 2)."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return pose[:2] + size * (ARROW - [0.35, 0]) @ np.array([[c, s], [-s, c]])


def strayed(pose, view):
    """A sentence for a robot outside the part of the floor that is drawn, ((left, right), (bottom, top)); else none."""
    inside = all(low <= x <= high for x, (low, high) in zip(pose, view))
    return "" if inside else " The robot has left the picture: turn back, or Reset."
