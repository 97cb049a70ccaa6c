"""Figures of lateration: the table of methods, distance circles with their dilution ellipse."""

import numpy as np

from . import style

CIRCLE = np.stack([np.cos(np.linspace(0, 2 * np.pi, 91)), np.sin(np.linspace(0, 2 * np.pi, 91))], axis=1)


class MethodTable:
    """Four methods in four rows: the printed facts, and a verdict that changes."""

    COLUMNS = (0.0, 0.24, 0.44, 0.76)

    def __init__(self, ax, rows):
        style.bare(ax)
        ax.set(xlim=(0, 1), ylim=(0, 1))
        for x, heading in zip(self.COLUMNS, ("method", "accuracy", "sensors", "for this task")):
            ax.text(x, 0.93, heading, fontweight="bold")
        self.names, self.verdicts = [], []
        for k, (name, accuracy, sensors) in enumerate(rows):
            y = 0.74 - 0.21 * k
            self.names.append(ax.text(self.COLUMNS[0], y, name, fontsize=11))
            ax.text(self.COLUMNS[1], y, accuracy, color=style.MUTED)
            ax.text(self.COLUMNS[2], y, sensors, color=style.MUTED)
            self.verdicts.append(ax.text(self.COLUMNS[3], y, ""))
        self.artists = [*self.names, *self.verdicts]

    def set(self, verdicts):
        """`verdicts`: a reason per method why it cannot be used, or "" where it can."""
        for name, text, reason in zip(self.names, self.verdicts, verdicts):
            name.set_fontweight("normal" if reason else "bold")
            name.set_color(style.MUTED if reason else style.INK)
            text.set_text(f"\N{MULTIPLICATION SIGN} {reason}" if reason else "\N{CHECK MARK} works")
            text.set_color(style.MUTED if reason else style.INK)


class Circles:
    """Landmarks, a circle of the measured distance about each, and the line of sight from the robot."""

    def __init__(self, ax):
        (self.rings,) = ax.plot([], [], color=style.MEASUREMENT, linewidth=1.4)
        (self.marks,) = ax.plot([], [], color=style.INK, linestyle="none", marker="^", markersize=9)
        (self.sights,) = ax.plot([], [], **style.look("guide"))
        self.names = [
            ax.annotate(n, (0, 0), xytext=(8, -14), textcoords="offset points", fontweight="bold") for n in "ABC"
        ]
        self.artists = [self.sights, self.rings, self.marks, *self.names]

    def set(self, landmarks, distances, robot):
        """`landmarks`: (n, 2); `distances`: (n,); `robot`: (2,)."""
        curves = landmarks[:, None, :] + distances[:, None, None] * CIRCLE
        gap = np.full((len(landmarks), 1, 2), np.nan)
        self.rings.set_data(*np.concatenate([curves, gap], axis=1).reshape(-1, 2).T)
        self.marks.set_data(*landmarks.T)
        for k, name in enumerate(self.names):
            name.set_visible(k < len(landmarks))
            name.xy = tuple(landmarks[min(k, len(landmarks) - 1)])
        rays = np.stack([landmarks, np.broadcast_to(robot, landmarks.shape), np.full_like(landmarks, np.nan)], axis=1)
        self.sights.set_data(*rays.reshape(-1, 2).T)


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


class Search:
    """A path of iterates with its end, a cloud of repeated estimates, an ellipse and the weakest direction."""

    def __init__(self, ax):
        cloud = style.look("estimates", marker=".", markersize=3, markeredgewidth=0, alpha=0.6)
        (self.cloud,) = ax.plot([], [], **cloud, label="repeated estimates")
        (self.ellipse,) = ax.plot([], [], **style.look("prediction", linewidth=1.8), label="95 % ellipse (bound)")
        dots = {"linewidth": 1.2, "linestyle": (0, (1, 1.5))}
        (self.weak,) = ax.plot([], [], color=style.INK, **dots, label="weakest direction")
        (self.path,) = ax.plot(
            [], [], color=style.ESTIMATE, linewidth=1.6, marker="o", markersize=3, label="search path"
        )
        (self.end,) = ax.plot([], [], **style.look("estimates", markersize=8))
        (self.robot,) = ax.plot([], [], color=style.TRUTH, linestyle="none", marker="+", markersize=13, label="robot")
        self.artists = [self.cloud, self.ellipse, self.weak, self.path, self.end, self.robot]
        box = {"frameon": True, "facecolor": style.PAPER, "edgecolor": style.PAPER, "framealpha": 0.85}
        ax.legend(loc="upper right", fontsize=8, **box)

    def set(self, robot, path, cloud, ellipse, weak):
        """Points (2,), (k, 2), (n, 2), (m, 2), (2, 2); empty arrays draw nothing."""
        self.robot.set_data(*np.reshape(robot, (1, 2)).T)
        self.path.set_data(*path.T)
        self.end.set_data(*path[-1:].T)
        for line, points in ((self.cloud, cloud), (self.ellipse, ellipse), (self.weak, weak)):
            line.set_data(*np.reshape(points, (-1, 2)).T)
