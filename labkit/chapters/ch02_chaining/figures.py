"""Figures of chapter 2: loops of frames in plan view, where they open, growth of the error, two loops side by side."""

import numpy as np
from matplotlib.ticker import LinearLocator
from matplotlib.transforms import ScaledTranslation

from ...stage import style
from ...stage.marks import Ghosts
from . import bodies

EDGES = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0)  # mm
LINKS = (1, 2, 4, 8, 16, 32, 64)
LABEL_INCHES = 0.64  # from an axes to the name of its numbers, wide enough for five letters


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

    Returns (ghosts, laws, here): the law for other errors of a link, a line per layout, what was found for the number
    chosen.
    """
    style.axes(ax, "number of links", "closure distance (mm, rms)")
    ax.set(xscale="log", yscale="log", xlim=(0.9, 75), ylim=(0.1, 30_000))
    ax.set_xticks(LINKS, [str(n) for n in LINKS])
    ax.set_yticks([0.1, 1, 10, 100, 1000, 10_000], ["0.1", "1", "10", "100", "1000", "10000"])
    ax.minorticks_off()
    ghosts = Ghosts(ax, label="0.01 to 1 deg")
    (straight,) = ax.plot([], [], **style.look("prediction"), label="law, in a row")
    (loop,) = ax.plot([], [], **style.look("prediction", linestyle=":"), label="on a loop")
    (here,) = ax.plot([], [], **style.look("estimates", markersize=8), label="simulated")
    ax.legend(loc="upper left")
    return ghosts, (straight, loop), here


def trumpet_axes(ax, runs):
    """Axes for the heights of noisy chains from frame to frame. Returns (runs, law, mean), the runs as `Ghosts`."""
    style.axes(ax, "frame", "height over the plane (mm)")
    left_of_numbers = ScaledTranslation(-LABEL_INCHES, 0, ax.figure.dpi_scale_trans)
    ax.yaxis.set_label_coords(0, 0.5, transform=ax.transAxes + left_of_numbers)  # room for -3000 at any edge
    lines = Ghosts(ax, label=f"{runs} chains", color=style.ESTIMATE, linewidth=0.7, alpha=0.5)
    (law,) = ax.plot([], [], **style.look("prediction"), label="law, one sigma")
    (mean,) = ax.plot([], [], **style.look("truth"), label="as it should be")
    ax.set(xlim=(0, LINKS[-1]), xticks=[0, *LINKS[3:]])
    ax.yaxis.set_major_locator(LinearLocator(5))
    ax.legend(loc="upper left")
    set_edge(ax, EDGES[0])
    return lines, law, mean


def set_edge(ax, reach):
    """Limits of the height that show `reach`, in few steps, so that the axes are redrawn seldom."""
    edge = next((e for e in EDGES if e >= reach), EDGES[-1])
    if ax.get_ylim()[1] != edge:
        ax.set(ylim=(-edge, edge))


def plan_of_two_loops(ax, corners, edges, title):
    """Plan view of two loops with a common link. Returns (measured, walks, gaps): both loops as they were measured, as
    `Ghosts`; a line for each as it is walked after sharing out; and how far it stays open.
    """
    style.axes(ax, "x (mm)", "y (mm)", title, equal=True)
    ax.set(xlim=(-230, 960), ylim=(-340, 640))
    for pair in edges:
        ax.plot(*corners[pair].T, color=style.INK, linewidth=1)
    for letter, x in (("A", 200), ("B", 600)):
        ax.text(x, 150, letter, ha="center", va="center", fontsize=14, color=style.MUTED)
    measured = Ghosts(ax, color=style.MEASUREMENT, linewidth=1.4, alpha=0.8)
    looks = ({"linestyle": "-"}, {"linestyle": (0, (5, 2))})
    walks = [ax.plot([], [], **style.look("estimate", marker="o", markersize=4, **look))[0] for look in looks]
    gaps = [ax.plot([], [], color=style.MEASUREMENT, linewidth=5, solid_capstyle="butt")[0] for _ in "AB"]
    return measured, walks, gaps


def levels(number, values):
    """x and y of a bar for each loop, for way number `number`; `values` (mm) of A and B."""
    x = np.array([0.0, 1.0]) + 0.2 * (number - 1.5)
    return np.repeat(x, 3), np.ravel([(0.0, value, np.nan) for value in values])


def compare_loops(ax, methods):
    """Axes of the closure distance left in loops A and B, a bar per way. Returns (series, chosen)."""
    style.axes(ax, "", "left open (mm)")
    ax.set(xlim=(-0.5, 1.5), ylim=(0, 9))
    ax.set_xticks([0, 1], ["loop A", "loop B"])
    ax.grid(axis="x", visible=False)
    looks = (style.MEASUREMENT, style.PREDICTION, style.STEEL, style.ESTIMATE)
    wide = {"linewidth": 11, "solid_capstyle": "butt"}
    (chosen,) = ax.plot([], [], color=style.INK, **{**wide, "linewidth": 16})
    series = [ax.plot([], [], color=color, label=method, **wide)[0] for method, color in zip(methods, looks)]
    key = style.legend_above(ax, ncols=2, fontsize=8, handlelength=0.9)
    for handle in key.legend_handles:
        handle.set_linewidth(8)
    return series, chosen
