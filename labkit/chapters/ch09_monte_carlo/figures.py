"""Figures of chapter 9: maps in their forms, clouds of poses on them, the corridor, the resampling wheel, the soccer
field.
"""

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.image import PcolorImage
from matplotlib.patches import PathPatch, Wedge
from matplotlib.path import Path

from ...stage import style
from ...stage.marks import Ghosts

CELLS = {1: style.INK, 2: style.MUTED}  # occupied and unknown cells; free ones stay paper
RING = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 30,
    "markerfacecolor": "none",
    "markeredgewidth": 2.0,
    "markeredgecolor": style.MUTED,
    "zorder": 6,
}  # as around a handle: what a stroke carries away
BARS = np.array([0.0, 1.0, np.nan])


def segments(ends):
    """x and y of segments (n, 4), x1 y1 x2 y2, as one broken line for `set_data`."""
    ends = np.asarray(ends, dtype=float).reshape(-1, 4)
    gap = np.full(len(ends), np.nan)
    return np.column_stack([ends[:, 0], ends[:, 2], gap]).ravel(), np.column_stack(
        [ends[:, 1], ends[:, 3], gap]
    ).ravel()


def bars(x, height):
    """x and y of upright bars from 0 to their height, as one broken line for `set_data`."""
    return np.repeat(np.asarray(x, dtype=float), 3), np.multiply.outer(np.asarray(height, dtype=float), BARS).ravel()


def floor_plan(ax, lines, title=""):
    """Axes of a building (m) with its walls, segments (n, 4). Returns the walls."""
    style.axes(ax, "x (m)", "y (m)", title, equal=True, grid=False)
    x, y = segments(lines)
    ax.set(xlim=(np.nanmin(x) - 0.3, np.nanmax(x) + 0.3), ylim=(np.nanmin(y) - 0.3, np.nanmax(y) + 0.3))
    return ax.plot(x, y, color=style.INK, linewidth=1.8)[0]


def squares(chosen, extent, color):
    """The chosen cells of a grid, bool (rows, columns) from the lower left, as one filled patch in data coordinates."""
    row, column = np.nonzero(chosen)
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]])
    left, right, bottom, top = extent
    size = np.array([right - left, top - bottom]) / chosen.shape[::-1]
    vertices = [left, bottom] + size * (np.column_stack([column, row])[:, None] + corners)
    codes = np.tile([Path.MOVETO, Path.LINETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY], len(row))
    return PathPatch(Path(vertices.reshape(-1, 2), codes), facecolor=color, edgecolor="none")


def key(ax, named):
    """Names of moving artists, {name: Cloud, Robot, ...}, in one line above the axes."""
    handles = [item.artists[-1] for item in named.values()]
    ax.legend(handles, list(named), loc="lower left", bbox_to_anchor=(-0.01, 1.0), ncols=len(named), borderaxespad=0.1)


class Cloud:
    """Particles as dots, one artist for all."""

    def __init__(self, ax, color=style.ESTIMATE, size=3.0, alpha=0.6, **look):
        (self.dots,) = ax.plot(
            [], [], color=color, linestyle="none", marker=".", markersize=size, markeredgewidth=0, alpha=alpha, **look
        )
        self.artists = [self.dots]

    def set(self, states):
        """`states`: (M, 2 or 3)."""
        self.dots.set_data(states[:, 0], states[:, 1])


class RobotMark:
    """A pose as a circle with a nose."""

    def __init__(self, ax, color=style.TRUTH, radius=0.35, zorder=5, **look):
        angle = np.linspace(0, 2 * np.pi, 25)
        self.shape = radius * np.array([[*np.cos(angle), np.nan, 0, 1.9], [*np.sin(angle), np.nan, 0, 0]])
        (self.line,) = ax.plot([], [], **{"color": color, "linewidth": 2.2, "zorder": zorder, **look})
        self.artists = [self.line]

    def set(self, pose):
        """`pose`: x, y, theta; NaN hides it."""
        c, s = np.cos(pose[2]), np.sin(pose[2])
        x, y = np.array([[c, -s], [s, c]]) @ self.shape
        self.line.set_data(pose[0] + x, pose[1] + y)


class Beams:
    """A scan: the end points of its beams, and the beams themselves as faint lines."""

    def __init__(self, ax, size=3.0):
        (self.rays,) = ax.plot([], [], color=style.MEASUREMENT, linewidth=0.6, alpha=0.35)
        (self.ends,) = ax.plot([], [], **style.look("measurement", markersize=size))
        self.artists = [self.rays, self.ends]

    def set(self, pose, points):
        """`points`: end points (n, 2); an empty array hides the scan."""
        points = np.reshape(points, (-1, 2))
        self.rays.set_data(*segments(np.column_stack([np.broadcast_to(pose[:2], points.shape), points])))
        self.ends.set_data(*points.T)


class Disks:
    """Round obstacles that the map lacks, as one broken line of circles."""

    def __init__(self, ax):
        angle = np.linspace(0, 2 * np.pi, 13)
        self.circle = np.append(np.exp(1j * angle), np.nan)
        (self.line,) = ax.plot([], [], color=style.REJECTED, linewidth=1.6)
        self.artists = [self.line]

    def set(self, disks):
        """`disks`: (n, 3), x, y, radius."""
        disks = np.reshape(disks, (-1, 3))
        outline = (disks[:, 0] + 1j * disks[:, 1])[:, None] + disks[:, 2:] * self.circle
        self.line.set_data(outline.real.ravel(), outline.imag.ravel())


def corridor(fig, length):
    """Five pictures of a corridor, as on the lecture's slide. Returns (axes, doors, particles, true places)."""
    axes = fig.subplots(5, 1, sharex=True)
    titles = (
        "(a)  nothing is known",
        "(b)  it looks: weights",
        "(c)  resampled and moved",
        "(d)  it looks again: weights",
        "(e)  resampled and moved",
    )
    sticks, places = [], []
    for ax, title in zip(axes, titles):
        ax.set(xlim=(0, length), ylim=(0, 1.45), yticks=[])  # the robot stands beneath the title, not in it
        ax.set_title(title, pad=2)
        ax.grid(False)
        sticks += ax.plot([], [], color=style.ESTIMATE, linewidth=0.8, alpha=0.7)
        places += ax.plot(
            [], [], color=style.TRUTH, linestyle="none", marker="v", markersize=9, clip_on=False, zorder=4
        )
    axes[-1].set_xlabel("place along the corridor (m)")
    doors = [ax.plot([], [], color=style.MEASUREMENT, linewidth=5, alpha=0.8, solid_capstyle="butt")[0] for ax in axes]
    return axes, doors, sticks, places


class Wheel:
    """The resampling wheel: a sector per particle, as wide as its weight, and the spokes or spins pointing at them."""

    def __init__(self, ax, count):
        style.bare(ax)
        ax.set(xlim=(-1.3, 1.3), ylim=(-1.3, 1.3), aspect="equal")
        self.sectors = [
            ax.add_patch(
                Wedge(
                    (0, 0), 1.0, 0, 1, width=0.3, facecolor=(style.PREDICTION, style.FAINT)[k % 2], edgecolor=style.INK
                )
            )
            for k in range(count)
        ]
        self.numbers = [ax.text(0, 0, str(k + 1), ha="center", va="center") for k in range(count)]
        (self.spokes,) = ax.plot([], [], color=style.ESTIMATE, linewidth=2, marker="o", markersize=4, zorder=4)
        self.artists = [*self.sectors, *self.numbers, self.spokes]

    def set(self, shares, spokes):
        """`shares`: add up to 1; `spokes`: places on the wheel, 0 to 1, clockwise from the top."""
        ends = np.concatenate([[0.0], np.cumsum(shares)])
        for sector, number, start, end in zip(self.sectors, self.numbers, ends[:-1], ends[1:]):
            sector.set_theta1(90 - 360 * end)
            sector.set_theta2(90 - 360 * start)
            middle = np.pi * (start + end)
            number.set_position((1.14 * np.sin(middle), 1.14 * np.cos(middle)))
            number.set_visible(bool(end - start > 0.03))
        s, c = np.sin(2 * np.pi * spokes), np.cos(2 * np.pi * spokes)
        self.spokes.set_data(*segments(np.column_stack([0 * s, 0 * c, 0.98 * s, 0.98 * c])))


def heat(ax, extent, shape, lines, title, low):
    """A picture of log weights over a building, from `low` (relative to the best) to 0, cells in `shape` (rows,
    columns), under the walls. Returns (artists, fill); PcolorImage takes half the time of imshow.
    """
    left, right, bottom, top = extent
    x, y = np.linspace(left, right, shape[1] + 1), np.linspace(bottom, top, shape[0] + 1)
    image = PcolorImage(ax, x, y, np.full(shape, float(low)), cmap=style.HEAT, norm=Normalize(low, 0), zorder=0)
    ax.add_image(image)
    return [image, floor_plan(ax, lines, title)], lambda weights: image.set_data(x, y, weights)


def ancestors(ax, methods):
    """Axes of ancestors left against rounds of resampling. Returns a curve for each of the two methods."""
    style.axes(ax, "rounds", "", "ancestors left")
    ax.set(xlim=(0, 206), ylim=(0.8, 2000), yscale="log")
    ax.set_yticks([1, 10, 100, 1000], ["1", "10", "100", "1000"])
    ax.minorticks_off()
    now = {"marker": "o", "markevery": [-1], "markersize": 5}
    looks = (style.look("estimate", **now), style.look("prediction", linewidth=2, **now))
    curves = [ax.plot([], [], **look, label=method)[0] for look, method in zip(looks, methods)]
    ax.legend(loc="lower left")
    return curves


def error_curve(ax, steps):
    """Axes of the estimate's error (m) over the last steps, logarithmic. Returns the curve."""
    style.axes(ax, "steps shown", "error (m)")
    ax.set(xlim=(0, steps), ylim=(0.01, 20), yscale="log")
    ax.set_yticks([0.01, 0.1, 1, 10], ["0.01", "0.1", "1", "10"])
    ax.minorticks_off()
    ax.axhline(0.3, **style.look("guide"))
    return ax.plot([], [], **style.look("estimate", linewidth=1.6, marker="D", markersize=5, markevery=[-1]))[0]


class MapForm:
    """One form of a building's map, small, under its name and the count of its numbers; the probe, and what it answers.

    The forms: occupancy grid, lines, points, graph, distance field, likelihood field.
    """

    def __init__(self, ax, form, numbers, building, field):
        grid = building.grid
        style.axes(ax, equal=True, grid=False)
        ax.set(xlim=grid.extent[:2], ylim=grid.extent[2:], xticks=(), yticks=(), xlabel=" ")  # room for the answer
        ax.set_title(f"{form}, {numbers:,} numbers", fontsize=9)
        self._draw(ax, form, building, field)
        (self.way,) = ax.plot([], [], color=style.ESTIMATE, linewidth=2)
        (self.probe,) = ax.plot([], [], **style.look("estimates", markersize=6, markeredgecolor=style.PAPER))
        below = {"xycoords": "axes fraction", "xytext": (0, -4), "textcoords": "offset points"}
        self.answer = ax.annotate("", (0.5, 0.0), **below, ha="center", va="top", fontsize=9, fontweight="bold")
        self.artists = [self.way, self.probe, self.answer]

    def _draw(self, ax, form, building, field):
        grid = building.grid
        place = {"extent": grid.extent, "origin": "lower", "interpolation": "nearest", "cmap": style.HEAT}
        if form == "occupancy grid":
            for kind, color in CELLS.items():
                ax.add_patch(squares(grid.cells == kind, grid.extent, color))
        elif form == "lines":
            ax.plot(*segments(building.lines), color=style.INK, linewidth=1.6)
        elif form == "points":
            ax.plot(*building.points.T, **style.look("measurement", markersize=1.6))
        elif form == "graph":
            ways = [(*building.nodes[a], *building.nodes[b]) for a, b in building.edges]
            ax.plot(*segments(ways), color=style.PREDICTION, linewidth=1.6)
            nodes = np.transpose(list(building.nodes.values()))
            ax.plot(*nodes, color=style.PREDICTION, linestyle="none", marker="o", markersize=4.5)
        else:
            ax.imshow(grid.distance if form == "distance field" else field.table, **place)

    def set(self, probe, answer, means=None):
        """`probe`: (2,); `answer`: words; `means`: the place the answer speaks of, (2,), if any."""
        self.probe.set_data(*np.reshape(probe, (2, 1)))
        self.answer.set_text(answer)
        self.way.set_data(*np.transpose([probe, probe if means is None else means]))


class Soccer:
    """The soccer field: landmarks, the one that is seen, three paths and the cloud."""

    def __init__(self, ax, landmarks):
        style.axes(ax, "x (m)", "y (m)", equal=True, grid=False)
        ax.set(xlim=(-0.5, 4.7), ylim=(-0.4, 3.4))
        ax.plot([0, 4.2, 4.2, 0, 0], [0, 0, 2.7, 2.7, 0], color=style.MUTED, linewidth=1)
        ax.plot(*landmarks.T, color=style.INK, linestyle="none", marker="s", markersize=9)
        for number, at in enumerate(landmarks, 1):
            ax.annotate(str(number), at, xytext=(8, 6), textcoords="offset points")
        self.landmarks = landmarks
        self.cloud = Cloud(ax, size=3)
        (self.truth,) = ax.plot([], [], **style.look("truth"), label="robot")
        (self.odometry,) = ax.plot([], [], **style.look("prediction", linewidth=1.6), label="odometry")
        (self.path,) = ax.plot([], [], **style.look("estimate"), label="MCL")
        (self.sight,) = ax.plot([], [], color=style.MEASUREMENT, linewidth=2, label="seen")
        self.robot, self.counted = RobotMark(ax, radius=0.12), RobotMark(ax, color=style.PREDICTION, radius=0.12)
        style.legend_above(ax, ncols=4)
        self.artists = [
            *self.cloud.artists, self.sight, self.odometry, self.path, self.truth, *self.counted.artists,
            *self.robot.artists,
        ]  # fmt: skip

    def set(self, truth, odometry, estimates, states, seen):
        """Paths so far, (n, 3) each, the cloud (M, 3) and the index of the landmark seen (-1: none)."""
        self.truth.set_data(*truth[:, :2].T)
        self.odometry.set_data(*odometry[:, :2].T)
        self.path.set_data(*estimates[:, :2].T)
        self.cloud.set(states)
        self.robot.set(truth[-1])
        self.counted.set(odometry[-1])
        ends = [truth[-1, :2], self.landmarks[seen]] if seen >= 0 else [(np.nan, np.nan)]
        self.sight.set_data(*np.transpose(ends))


class SoccerErrors:
    """Errors of odometry and MCL over time up to now, strong, and of all readings over the whole run, faint."""

    def __init__(self, ax, seconds):
        style.axes(ax, "time (s)", "error (m)")
        ax.set_title("gray: MCL with each of the readings", fontsize=9, color=style.MUTED)
        ax.set(xlim=(0, seconds), ylim=(0.01, 6), yscale="log")
        ax.set_yticks([0.01, 0.1, 1], ["0.01", "0.1", "1"])
        ax.minorticks_off()
        self.ghosts = Ghosts(ax)
        looks = {"odometry": style.look("prediction"), "MCL": style.look("estimate")}
        self.curves = {name: ax.plot([], [], **look)[0] for name, look in looks.items()}
        self.artists = [*self.ghosts.artists, *self.curves.values()]

    def set(self, time, step, errors, others):
        """`time`: (n,) s; `step`: the number of now; `errors`: {name: (n,)} m; `others`: those of all readings."""
        self.ghosts.set([np.column_stack([time, np.maximum(other, 0.01)]) for other in others])
        for name, curve in self.curves.items():
            curve.set_data(time[: step + 1], np.maximum(errors[name][: step + 1], 0.01))
