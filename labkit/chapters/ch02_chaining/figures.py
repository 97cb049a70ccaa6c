"""Figures of chapter 2: loops of frames in plan view, where they open, growth of the error, two loops side by side."""

import numpy as np
from matplotlib.ticker import LinearLocator
from matplotlib.transforms import ScaledTranslation

from ...stage import style
from . import bodies

EDGES = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0)  # mm
LINKS = (1, 2, 4, 8, 16, 32, 64)
LABEL_INCHES = 0.64  # from an axes to the name of its numbers, wide enough for five letters


class Chain:
    """Frames in plan view, a line from origin to origin: `.set(poses)`, shape (n, 4, 4)."""

    def __init__(self, ax, look, **changes):
        (self.line,) = ax.plot([], [], **{**style.look(look), "marker": "o", "markersize": 4, **changes})

    def set(self, poses):
        self.line.set_data(*poses[:, :2, 3].T)


class Moves:
    """Two moves one after the other: where they begin, the frame after the first, what both carry about, and a hollow
    cross where the other order ends."""

    def __init__(self, scene, first, second):
        scene.fixed(scene.triad("0", 70), np.eye(4))
        self.middle = scene.triad(first, 70, linestyle=(0, (4, 1.5)))
        self.end = scene.triad(first + second, 90)
        self.carried = scene.body(*bodies.piece(), name="piece")
        self.path = scene.line(**style.look("estimate", linewidth=1.6))
        self.other = scene.points(**style.look("rejected", markersize=9))

    def set(self, middle, end, other):
        """Poses (4, 4) after the first move, after both, and after both in the other order."""
        self.middle.set(middle)
        self.end.set(end)
        self.carried.set(end)
        self.path.set([np.zeros(3), middle[:3, 3], end[:3, 3]])
        self.other.set(other[:3, 3])


class Loop:
    """The sheet's loop as it is and as the chain sees it, the lever of a wrong link with the axis it turns about, the
    gaps at K0 and at a work piece, and the measuring arm at the stand of that link."""

    def __init__(self, scene):
        self.arm = bodies.MeasuringArm(scene)
        self.true = scene.line(**style.look("truth", marker="o", markersize=4))
        self.measured = scene.line(**style.look("estimate", marker="o", markersize=4))
        self.frames = [scene.triad(f"K{k}", 62) for k in range(4)]
        self.lever = scene.line(**style.look("guide", linewidth=2))
        self.axis = scene.line(**style.look("prediction"))
        self.gap = scene.rod(5.0, style.REJECTED, name="gap at K0")
        self.piece = scene.rod(5.0, style.REJECTED, name="gap at P")
        self.name = scene.text("P", fontweight="bold")

    def set(self, result):
        """Draw the result of `stages.compute_open_loop`."""
        true, measured, k = result["true"], result["measured"], result["link"]
        self.true.set(true[:, :3, 3])
        self.measured.set(measured[:, :3, 3])
        for frame, T in zip(self.frames, measured):
            frame.set(T)
        self.lever.set([result["pivot"], measured[-1, :3, 3]])
        self.axis.set(result["pivot"] + np.outer([-110.0, 110.0], result["about"]))
        self.gap.set(true[0, :3, 3], measured[-1, :3, 3])
        self.piece.set(*result["piece"])
        self.name.set(result["piece"][0])
        self.arm.set(result["stand"], true[k % 4, :3, 3])


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
