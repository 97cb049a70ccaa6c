"""Figures of lateration: the table of methods, distance circles with their dilution ellipse."""

import numpy as np

from ...stage import style
from ...stage.marks import broken, robot_outline

SHORT = 9  # letters of words that are never broken
CIRCLE = np.stack([np.cos(np.linspace(0, 2 * np.pi, 91)), np.sin(np.linspace(0, 2 * np.pi, 91))], axis=1)


class MethodTable:
    """Four methods in four rows: the printed facts, and a verdict that changes. Longer words stand in two lines, for
    which a phone has room.
    """

    COLUMNS = (0.0, 0.26, 0.5, 0.76)

    def __init__(self, ax, rows):
        style.bare(ax)
        ax.set(xlim=(0, 1), ylim=(0, 1))
        for x, heading in zip(self.COLUMNS, ("method", "accuracy", "sensors", "for this task")):
            ax.text(x, 0.97, heading, fontweight="bold", va="top")
        self.names, self.verdicts = [], []
        for k, (name, accuracy, sensors) in enumerate(rows):
            place = {"y": 0.73 - 0.22 * k, "va": "center"}
            self.names.append(ax.text(self.COLUMNS[0], s=_in_two_lines(name), **place))
            ax.text(self.COLUMNS[1], s=_in_two_lines(accuracy), color=style.MUTED, **place)
            ax.text(self.COLUMNS[2], s=_in_two_lines(sensors), color=style.MUTED, **place)
            self.verdicts.append(ax.text(self.COLUMNS[3], s="", **place))
        self.artists = [*self.names, *self.verdicts]

    def set(self, verdicts):
        """`verdicts`: a reason per method why it cannot be used, or "" where it can."""
        for name, text, reason in zip(self.names, self.verdicts, verdicts):
            name.set_fontweight("normal" if reason else "bold")
            name.set_color(style.MUTED if reason else style.INK)
            words = f"\N{MULTIPLICATION SIGN} {reason}" if reason else "\N{CHECK MARK} works"
            text.set_text(_in_two_lines(words))
            text.set_color(style.MUTED if reason else style.INK)


def _in_two_lines(words):
    """Words broken at the space that leaves the shorter lines; short ones stay."""
    if len(words) <= SHORT:
        return words
    spaces = [k for k, letter in enumerate(words) if letter == " "]
    k = min(spaces, key=lambda k: max(k, len(words) - k - 1), default=None)
    return words if k is None else f"{words[:k]}\n{words[k + 1 :]}"


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
        self.rings.set_data(*broken(curves).T)
        self.marks.set_data(*landmarks.T)
        for k, name in enumerate(self.names):
            name.set_visible(k < len(landmarks))
            name.xy = tuple(landmarks[min(k, len(landmarks) - 1)])
        self.sights.set_data(*broken(np.stack([landmarks, np.broadcast_to(robot, landmarks.shape)], axis=1)).T)


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
        legend = style.legend_above(ax, ncols=3)
        legend.legend_handles[0].set(markersize=9, alpha=1.0)  # a dot too small to be seen among the words

    def set(self, robot, path, cloud, ellipse, weak):
        """Points (2,), (k, 2), (n, 2), (m, 2), (2, 2); empty arrays draw nothing."""
        self.robot.set_data(*np.reshape(robot, (1, 2)).T)
        self.path.set_data(*path.T)
        self.end.set_data(*path[-1:].T)
        for line, points in ((self.cloud, cloud), (self.ellipse, ellipse), (self.weak, weak)):
            line.set_data(*np.reshape(points, (-1, 2)).T)


MODEL_LOOKS = {
    "euler": {"color": style.MEASUREMENT, "linestyle": "-", "marker": "s", "markersize": 5, "linewidth": 1.6},
    "midpoint": {"color": style.ESTIMATE, "linestyle": "-", "marker": "D", "markersize": 4.5, "linewidth": 1.6},
    "arc": {"color": style.TRUTH, "linestyle": "-", "linewidth": 1.6},
}


class ModelPaths:
    """The exact path and two approximations in the plane, and their errors against the time step."""

    def __init__(self, plane, errors, steps):
        names = {"arc": "arc", "euler": "simplified", "midpoint": "midpoint"}
        self.lines = {m: plane.plot([], [], **MODEL_LOOKS[m], label=name)[0] for m, name in names.items()}
        close = {"fontsize": 8, "handlelength": 1.5, "columnspacing": 0.8}
        style.legend_above(plane, ncols=3, **close)  # a turn may go either way, and cross each corner
        self.curves, self.now = {}, {}
        for model in ("euler", "midpoint"):
            look = MODEL_LOOKS[model] | {"marker": ""}
            (self.curves[model],) = errors.plot(steps, np.ones_like(steps), **look)
            (self.now[model],) = errors.plot([], [], **(MODEL_LOOKS[model] | {"markersize": 8, "linestyle": "none"}))
        self.artists = [*self.lines.values(), *self.curves.values(), *self.now.values()]

    def set(self, result):
        """Draw what `compute_models` returns."""
        for model, line in self.lines.items():
            line.set_data(*result["paths"][model][:, :2].T)
        for model, curve in self.curves.items():
            curve.set_ydata(result["errors"][model])
            self.now[model].set_data([result["dt"]], [result["error"][model]])


class Driven:
    """True path, estimated path, ellipses along it and both robots; others that were given the same commands."""

    def __init__(self, ax, others):
        faint = {"color": style.MUTED, "linewidth": 0.7, "alpha": 0.45}
        (self.others,) = ax.plot([], [], **faint, label=f"{others} others, same commands")
        (self.outlines,) = ax.plot([], [], color=style.PREDICTION, linewidth=1.1, label="95 % ellipses")
        (self.truth,) = ax.plot([], [], **style.look("truth"), label="true path")
        (self.estimate,) = ax.plot([], [], **style.look("estimate", linewidth=1.8), label="dead reckoning")
        (self.robot,) = ax.plot([], [], color=style.TRUTH, linewidth=1.6)
        (self.ghost,) = ax.plot([], [], color=style.ESTIMATE, linewidth=1.6)
        self.artists = [self.others, self.outlines, self.truth, self.estimate, self.ghost, self.robot]
        style.legend_above(ax, ncols=2)

    def set(self, truth, estimate, outlines, others):
        """`truth`, `estimate`: (n, 3) poses; `outlines`, `others`: (k, 2), rows of NaN between ellipses or paths."""
        self.others.set_data(*others.T)
        self.truth.set_data(*truth[:, :2].T)
        self.estimate.set_data(*estimate[:, :2].T)
        self.outlines.set_data(*outlines.T)
        self.robot.set_data(*robot_outline(truth[-1], 0.6).T)
        self.ghost.set_data(*robot_outline(estimate[-1], 0.6).T)


class Banana:
    """End points of many runs, the computed path, its ellipse or its bent region, and both means."""

    def __init__(self, ax):
        (self.path,) = ax.plot([], [], **style.look("guide"))
        look = style.look("truth", linestyle="none", marker=".", markersize=2.5, markeredgewidth=0, alpha=0.5)
        (self.samples,) = ax.plot([], [], **look, label="1500 true ends")
        (self.outline,) = ax.plot([], [], **style.look("prediction"), label="region said to hold 95 %")
        (self.mean,) = ax.plot([], [], **style.look("estimates", markersize=8), label="computed end")
        look = {"linestyle": "none", "marker": "P", "markersize": 10, "markeredgewidth": 1.2}
        (self.center,) = ax.plot(
            [], [], color=style.MEASUREMENT, markeredgecolor=style.INK, **look, label="mean of the true ends"
        )
        self.artists = [self.path, self.samples, self.outline, self.mean, self.center]
        ax.legend(loc="lower left", fontsize=8)

    def set(self, path, ends, outline):
        """`path`: (n, 3); `ends`: (runs, 3); `outline`: (m, 2)."""
        self.path.set_data(*path[:, :2].T)
        self.samples.set_data(*ends[:, :2].T)
        self.outline.set_data(*outline.T)
        self.mean.set_data(*path[-1:, :2].T)
        self.center.set_data(*ends[:, :2].mean(0)[:, None])


class Reach:
    """What one command reaches: a fan of paths, the best one, the robot at its end, and the spot."""

    def __init__(self, ax, paths):
        ax.plot(*broken(paths).T, color=style.GRID, linewidth=1.1)
        ax.fill(*robot_outline(np.zeros(3), 0.16).T, facecolor=style.FAINT, edgecolor=style.MUTED)
        (self.spot,) = ax.plot([], [], **style.look("prediction"))
        (self.path,) = ax.plot([], [], **style.look("estimate"))
        (self.robot,) = ax.plot([], [], color=style.ESTIMATE, linewidth=1.6)
        self.artists = [self.spot, self.path, self.robot]

    def set(self, spot, path):
        """`spot`: pose (3,); `path`: poses (n, 3)."""
        self.spot.set_data(*robot_outline(spot, 0.2).T)
        self.path.set_data(*path[:, :2].T)
        self.robot.set_data(*robot_outline(path[-1], 0.16).T)
