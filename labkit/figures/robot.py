"""Figures of chapter 6: a serial arm as a stick figure with its flange and its tool."""

import numpy as np

from . import style

GROUND = np.linspace(0, 2 * np.pi, 49)


class Arm:
    """The links of a robot, its joints, and the frames of flange and tool, in a 3D scene."""

    def __init__(self, scene, triad=110.0):
        floor = np.column_stack([np.cos(GROUND), np.sin(GROUND), 0 * GROUND])
        for radius in (120.0, 240.0):
            scene.fixed(scene.line(**style.look("guide")), radius * floor)
        self.links = scene.line(color=style.MUTED, linewidth=7, solid_joinstyle="round")
        self.core = scene.line(color=style.INK, linewidth=1.4)
        self.joints = scene.points(color=style.INK, linestyle="none", marker="o", markersize=6)
        self.base = scene.triad("B", triad)
        self.flange = scene.triad("F", triad, linestyle=(0, (3, 1.5)))
        self.tool = scene.triad("E", triad)
        self.flange.name_at(-14, 1)
        self.tool.name_at(-8, 11)
        scene.fixed(self.base, np.eye(4))

    def set(self, points, T_BF, T_BE):
        """`points`: where the arm goes along, shape (6, 3), mm; the poses of flange and tool."""
        for line in (self.links, self.core, self.joints):
            line.set(points)
        self.flange.set(T_BF)
        self.tool.set(T_BE)
