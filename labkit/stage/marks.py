"""Small things that several chapters draw: a frame in the plane, a robot, the name of what is not used."""

import numpy as np

from . import style

ARROW = np.array([[0.0, 0.6], [1.0, 0.0], [0.0, -0.6], [0.3, 0.0], [0.0, 0.6]])  # a robot that looks along x


class PlaneFrame:
    """A frame seen along the world's z axis: x and y with their letters, z as a dot (towards us) or a cross."""

    def __init__(self, ax, name, length, linestyle="-"):
        self.length = length
        self.axes = [
            ax.plot([], [], color=color, linestyle=linestyle, linewidth=2.4)[0]
            for color in (style.AXIS_X, style.AXIS_Y)
        ]
        self.letters = [
            ax.text(0, 0, letter, color=color, ha="center", va="center", zorder=4, clip_on=True)
            for letter, color in (("x", style.AXIS_X), ("y", style.AXIS_Y))
        ]
        (self.z,) = ax.plot([], [], color=style.AXIS_Z, linestyle="none", marker="o", markersize=4, zorder=4)
        (self.rim,) = ax.plot(
            [], [], color=style.AXIS_Z, linestyle="none", marker="o", markersize=10, markerfacecolor="none", zorder=4
        )
        self.name = ax.annotate(
            name, (0, 0), xytext=(-9, -9), textcoords="offset points", ha="right", va="top", fontweight="bold",
            zorder=4, annotation_clip=True, clip_on=True,
        )  # fmt: skip
        self.artists = [*self.axes, *self.letters, self.z, self.rim, self.name]

    def set(self, T):
        """Place it at T, shape (4, 4)."""
        origin = T[:2, 3]
        for line, letter, axis in zip(self.axes, self.letters, T[:2, :2].T):
            tip = origin + self.length * axis
            line.set_data(*np.transpose([origin, tip]))
            letter.set_position(tip + 0.14 * self.length * axis)
        for marker in (self.z, self.rim):
            marker.set_data([origin[0]], [origin[1]])
        self.z.set_marker("o" if T[2, 2] > 0 else "x")
        self.z.set_markersize(4 if T[2, 2] > 0 else 7)
        self.name.xy = tuple(origin)


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
