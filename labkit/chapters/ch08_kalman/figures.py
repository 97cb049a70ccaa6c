"""Figures of Kalman filters: three bells, bands over time, the landmark arena with its consistency panel."""

import numpy as np

from ...estimation import gaussian
from ...stage import style
from ...stage.marks import robot_outline


class Bells:
    """Prediction, measurement and correction as normal densities over one axis."""

    ROLES = (("prediction", "prediction"), ("measurement", "measurement"), ("estimate", "corrected"))

    def __init__(self, ax, grid):
        self.grid = grid
        self.lines = []
        for role, label in self.ROLES:
            solid = {"marker": "", "linestyle": "-", "linewidth": 2.2} if role == "measurement" else {}
            self.lines += ax.plot([], [], **style.look(role, **solid), label=label)
        (self.before,) = ax.plot([], [], **style.look("guide"), label="before the motion")
        ax.legend(loc="upper left")
        self.artists = [self.before, *self.lines]

    def set(self, before, bells):
        """`before`, and each of `bells` in the order prediction, measurement, corrected: (mean, std)."""
        for line, (mean, std) in zip((self.before, *self.lines), (before, *bells)):
            line.set_data(self.grid, gaussian.density(self.grid, mean, std))


class Belief:
    """Errors of position and velocity within what the filter promises, the sensor's errors as dots, and beside them, as
    a bracket, what the filter believes of the sensor.
    """

    def __init__(self, position, velocity, seconds):
        for ax, label, limit in ((position, "position error (m)", 2.6), (velocity, "velocity (m/s)", 1.3)):
            style.axes(ax, "time (s)" if ax is velocity else "", label)
            ax.set(xlim=(0, 1.09 * seconds), ylim=(-limit, limit), xticks=np.arange(0, seconds + 1, 2))
            ax.axhline(0, color=style.GRID, linewidth=1)
        (self.dots,) = position.plot([], [], **style.look("measurement", markersize=3), label="sensor")
        (self.bracket,) = position.plot(
            [], [], color=style.MEASUREMENT, linewidth=3, label="believed, \N{PLUS-MINUS SIGN}2 sigma"
        )
        self.bands, self.errors = [], []
        for ax in (position, velocity):
            self.bands += ax.plot(
                [], [], **style.look("prediction", linewidth=1.8), label="promised, \N{PLUS-MINUS SIGN}2 sigma"
            )
            self.errors += ax.plot([], [], **style.look("estimate", linewidth=1.6), label="filter")
        style.legend_above(position, ncols=2, fontsize=8, columnspacing=0.8, handlelength=1.4)
        self.artists = [self.dots, *self.bands, *self.errors, self.bracket]

    def set(self, result, at):
        """Draw what `compute_vehicle` returns; the bracket stands at `at` (s)."""
        time, reach = result["time"], 2 * result["std_z"]
        self.dots.set_data(time, result["measured"])
        for k, (band, error) in enumerate(zip(self.bands, self.errors)):
            edge = 2 * result["std"][:, k]
            band.set_data([*time, np.nan, *time], [*edge, np.nan, *-edge])
            error.set_data(time, result["error"][:, k])
        self.bracket.set_data(at + np.array([-0.2, 0, 0, -0.2]), [reach, reach, -reach, -reach])


class Judge:
    """Mean NIS against the noise the filter may believe of its sensor, with the band that holds 99 %."""

    def __init__(self, ax, stds, true):
        style.axes(ax, "believed noise of z (m)", "mean NIS")
        ax.set(xlim=(0, 1.05 * stds[-1]), ylim=(0.05, 300), yscale="log")
        ax.set_yticks([0.1, 1, 10, 100], ["0.1", "1", "10", "100"])
        ax.minorticks_off()
        ax.axvline(true, **style.look("guide"))
        ax.annotate("true", (true, 0.06), xytext=(4, 0), textcoords="offset points", color=style.MUTED)
        self.stds = stds
        self.band = ax.axhspan(0.5, 2, color=style.GRID, label="99 % band")
        (self.others,) = ax.plot([], [], color=style.MUTED, linewidth=1.4, label="all beliefs")
        (self.now,) = ax.plot([], [], **style.look("estimates", markersize=9), label="yours")
        ax.legend(loc="upper right")
        self.artists = [self.band, self.others, self.now]

    def set(self, result):
        """Draw what `compute_vehicle` returns."""
        low, high = result["band"]
        self.band.set(y=low, height=high - low)
        self.others.set_data(self.stds, result["others"])
        self.now.set_data([result["std_z"]], [result["nis"]])


class Consistency:
    """NIS or NEES over time on a logarithmic axis, with the limits between which 99 % should lie."""

    def __init__(self, ax, label, role="measurement"):
        look = style.look(role, linestyle="none", marker="." if role == "measurement" else "D", markersize=4)
        (self.values,) = ax.plot([], [], **look, label=label)
        (self.limits,) = ax.plot([], [], **style.look("guide", color=style.INK), label="99 % limits")
        self.artists = [self.limits, self.values]

    def set(self, time, values, low, high):
        """`time`, `values`: (n,); `low`, `high`: the limits."""
        self.values.set_data(time, np.maximum(values, 1e-3))
        ends = [time[0], time[-1]] if len(time) else [0, 1]
        self.limits.set_data([*ends, np.nan, *ends], [low, low, np.nan, high, high])


class Arena:
    """True and estimated path, one ellipse, both robots, landmarks and where each measurement puts its landmark."""

    def __init__(self, ax):
        (self.truth,) = ax.plot([], [], **style.look("truth"), label="true path")
        (self.estimate,) = ax.plot([], [], **style.look("estimate", linewidth=1.6), label="filter")
        (self.ellipse,) = ax.plot([], [], **style.look("prediction", linewidth=1.6), label="95 % ellipse")
        (self.robot,) = ax.plot([], [], color=style.TRUTH, linewidth=1.6)
        (self.ghost,) = ax.plot([], [], color=style.ESTIMATE, linewidth=1.6)
        (self.marks,) = ax.plot([], [], color=style.INK, linestyle="none", marker="^", markersize=9)
        stars = style.look("measurement", marker="*", markersize=7, alpha=0.7)
        (self.seen,) = ax.plot([], [], **stars, label="measured")
        self.artists = [self.seen, self.truth, self.estimate, self.ellipse, self.marks, self.ghost, self.robot]
        style.legend_above(ax, ncols=2)

    def set(self, truth, estimate, ellipse, landmarks, seen):
        """`truth`, `estimate`: (n, 3); `ellipse`: (m, 2); `landmarks`: (k, 2); `seen`: (j, 2)."""
        self.truth.set_data(*truth[:, :2].T)
        self.estimate.set_data(*estimate[:, :2].T)
        self.ellipse.set_data(*ellipse.T)
        self.robot.set_data(*robot_outline(truth[-1], 0.5).T)
        self.ghost.set_data(*robot_outline(estimate[-1], 0.5).T)
        self.marks.set_data(*landmarks.T)
        self.seen.set_data(*seen.T)


class Honesty:
    """Estimates of many runs around the true position with the ellipse they believe in, and NEES against iterations."""

    def __init__(self, plane, score, iterations):
        look = style.look("estimates", marker=".", markersize=4, markeredgewidth=0, alpha=0.7)
        (self.cloud,) = plane.plot([], [], **look, label="corrected")
        (self.believed,) = plane.plot([], [], **style.look("prediction"), label="95 % believed")
        cross = {"linestyle": "none", "marker": "+", "markersize": 13}
        (self.truth,) = plane.plot([0], [0], color=style.TRUTH, **cross, label="true")
        plane.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, columnspacing=1.0)
        dots = style.look("estimate", marker="o", markersize=4)
        (self.curve,) = score.plot(iterations, np.ones(len(iterations)), **dots)
        (self.now,) = score.plot([], [], **style.look("estimates", markersize=9))
        self.artists = [self.cloud, self.believed, self.truth, self.curve, self.now]

    def set(self, cloud, believed, curve, iterations):
        """`cloud`: (n, 2); `believed`: (m, 2); `curve`: mean NEES for 1, 2, ... iterations; `iterations`: chosen."""
        self.cloud.set_data(*cloud.T)
        self.believed.set_data(*believed.T)
        self.curve.set_ydata(curve)
        self.now.set_data([iterations], [curve[iterations - 1]])
