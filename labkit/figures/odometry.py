"""Figures of dead reckoning: paths of three models, a driven robot with its ellipses, the banana."""

import numpy as np

from . import style

MODEL_LOOKS = {
    "euler": {"color": style.MEASUREMENT, "linestyle": "-", "marker": "s", "markersize": 5, "linewidth": 1.6},
    "midpoint": {"color": style.ESTIMATE, "linestyle": "-", "marker": "D", "markersize": 4.5, "linewidth": 1.6},
    "arc": {"color": style.TRUTH, "linestyle": "-", "linewidth": 1.6},
}
ARROW = np.array([[0.0, 0.6], [1.0, 0.0], [0.0, -0.6], [0.3, 0.0], [0.0, 0.6]])


def robot_outline(pose, size=0.25):
    """Closed outline of an arrowhead at a pose, (5, 2)."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return pose[:2] + size * (ARROW - [0.35, 0]) @ np.array([[c, s], [-s, c]])


class ModelPaths:
    """The exact path and two approximations in the plane, and their errors against the time step."""

    def __init__(self, plane, errors, steps):
        names = {"arc": "arc", "euler": "simplified", "midpoint": "midpoint"}
        self.lines = {m: plane.plot([], [], **MODEL_LOOKS[m], label=name)[0] for m, name in names.items()}
        plane.legend(loc="upper left", fontsize=8)
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
    """True path, estimated path, ellipses along it and both robots."""

    def __init__(self, ax):
        (self.outlines,) = ax.plot([], [], color=style.PREDICTION, linewidth=1.1, label="95 % ellipses")
        (self.truth,) = ax.plot([], [], **style.look("truth"), label="true path")
        (self.estimate,) = ax.plot([], [], **style.look("estimate", linewidth=1.8), label="dead reckoning")
        (self.robot,) = ax.plot([], [], color=style.TRUTH, linewidth=1.6)
        (self.ghost,) = ax.plot([], [], color=style.ESTIMATE, linewidth=1.6)
        self.artists = [self.outlines, self.truth, self.estimate, self.ghost, self.robot]
        ax.legend(loc="upper left", fontsize=8)

    def set(self, truth, estimate, outlines):
        """`truth`, `estimate`: (n, 3) poses; `outlines`: (k, 2), rows of NaN between ellipses."""
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
