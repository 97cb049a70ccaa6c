"""Figures of chapter 2: loops of frames in plan view, where they open, growth of the error, two loops side by side."""

import numpy as np
from matplotlib.ticker import LinearLocator
from matplotlib.transforms import ScaledTranslation

from ...stage import style

EDGES = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0)  # mm
LINKS = (1, 2, 4, 8, 16, 32, 64)
LABEL_INCHES = 0.64  # from an axes to the name of its numbers, wide enough for five letters
NAME_POINTS = 17  # from an origin to the middle of its name


class Chain:
    """Frames in plan view: a line from origin to origin, and the x and y axis of each as short strokes."""

    def __init__(self, ax, look, length, axes=True, **changes):
        self.length = length
        (self.line,) = ax.plot([], [], **{**style.look(look), "marker": "o", "markersize": 4, **changes})
        self.strokes = [
            ax.plot([], [], color=color, linewidth=1.8, alpha=0.9)[0] for color in (style.AXIS_X, style.AXIS_Y) if axes
        ]
        self.artists = [self.line, *self.strokes]

    def set(self, poses):
        """`poses`: shape (n, 4, 4)."""
        origins = poses[:, :2, 3]
        self.line.set_data(*origins.T)
        for stroke, axis in zip(self.strokes, (0, 1)):
            tips = origins + self.length * poses[:, :2, axis]
            gaps = np.full_like(tips, np.nan)
            stroke.set_data(*np.stack([origins, tips, gaps], axis=1).reshape(-1, 2).T)


def plan_of_loop(ax):
    """Plan view of the sheet's loop, in mm, with room to drag. Returns ax."""
    style.axes(ax, "x of K0 (mm)", "y of K0 (mm)", equal=True)
    ax.set(xlim=(-460, 380), ylim=(-600, 240))
    return ax


def names(ax, texts):
    """Bold names that are moved with `.xy`; returns the annotations."""
    place = {"xytext": (8, 8), "textcoords": "offset points", "fontweight": "bold", "zorder": 4}
    return [ax.annotate(text, (0, 0), **place) for text in texts]


def set_name(frame, angle):
    """Put the name of a `PlaneFrame` beside its origin, in the direction `angle` (rad)."""
    frame.name.set(ha="center", va="center")
    frame.name.xyann = NAME_POINTS * np.cos(angle), NAME_POINTS * np.sin(angle)


def growth_axes(ax):
    """Closure distance against the number of links, both logarithmic, with the laws and what was found.

    Returns (laws, found, here): a line per layout, markers of the layout shown, a ring for the number chosen.
    """
    style.axes(ax, "number of links", "closure distance (mm, rms)", "law and simulation")
    ax.set(xscale="log", yscale="log", xlim=(0.9, 75), ylim=(0.1, 3000))
    ax.set_xticks(LINKS, [str(n) for n in LINKS])
    ax.set_yticks([0.1, 1, 10, 100, 1000], ["0.1", "1", "10", "100", "1000"])
    ax.minorticks_off()
    (straight,) = ax.plot([], [], **style.look("prediction"), label="law, in a row")
    (loop,) = ax.plot([], [], **style.look("prediction", linestyle=":"), label="law, on a loop")
    (found,) = ax.plot([], [], **style.look("estimates", markersize=6), label="simulated")
    (here,) = ax.plot([], [], color=style.ESTIMATE, linestyle="none", marker="o", markersize=14, markerfacecolor="none")
    ax.legend(loc="upper left")
    return (straight, loop), found, here


def cloud_axes(ax):
    """Axes for where noisy chains end, relative to where they should. Returns (cloud, circle)."""
    style.axes(ax, "error in y (mm)", "error in z (mm)", "where 100 chains end", equal=True)
    left_of_numbers = ScaledTranslation(-LABEL_INCHES, 0, ax.figure.dpi_scale_trans)
    ax.yaxis.set_label_coords(0, 0.5, transform=ax.transAxes + left_of_numbers)  # room for -3000 at any edge
    (cloud,) = ax.plot([], [], **style.look("estimates", markersize=3.5, alpha=0.6))
    (circle,) = ax.plot([], [], **style.look("prediction"))
    ax.plot([0], [0], color=style.TRUTH, marker="+", markersize=10)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(LinearLocator(5))
    set_edge(ax, EDGES[0])
    return cloud, circle


def set_edge(ax, reach):
    """Square limits that show `reach`, in few steps, so that the axes are redrawn seldom."""
    edge = next((e for e in EDGES if e >= reach), EDGES[-1])
    if ax.get_xlim()[1] != edge:
        ax.set(xlim=(-edge, edge), ylim=(-edge, edge))


def set_circle(line, radius):
    """A circle about the origin."""
    angle = np.linspace(0, 2 * np.pi, 73)
    line.set_data(radius * np.cos(angle), radius * np.sin(angle))


def compare_loops(ax, methods):
    """Axes of the closure distance left in loops A and B, a marker per method. Returns the marker series."""
    style.axes(ax, "", "closure left (mm)", "what is left in each loop")
    ax.set(xlim=(-0.6, 1.6), ylim=(-0.6, 12))
    ax.set_xticks([0, 1], ["loop A", "loop B"])
    ax.grid(axis="x", visible=False)
    looks = (
        {"color": style.MEASUREMENT, "marker": "o"},
        {"color": style.PREDICTION, "marker": "s"},
        {"color": style.PREDICTION, "marker": "^", "markerfacecolor": "none"},
        {"color": style.ESTIMATE, "marker": "D"},
    )
    series = [
        ax.plot([], [], linestyle="none", markersize=9, markeredgewidth=2, label=method, **look)[0]
        for method, look in zip(methods, looks)
    ]
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=2, columnspacing=1.0, handletextpad=0.3)
    return series
