"""Figures of chapter 11: motions beside each other, shares of poses, standard deviations, errors in units of what was
told."""

import numpy as np

from ...stage import style

NAMES = ("rx", "ry", "rz", "x", "y", "z")
REACH = 6.0  # standard deviations either way


def diagonal(ax, title, limit):
    """Robot against sensor, both in deg up to `limit`, with the diagonal. Returns the points."""
    style.axes(ax, "robot (deg)", "sensor (deg)", title, equal=True)
    ax.set(xlim=(0, limit), ylim=(0, limit))
    ax.plot([0, limit], [0, limit], **style.look("guide"))
    return ax.plot([], [], **style.look("measurement", markersize=4.5, alpha=0.8))[0]


def shares(ax, n):
    """Bars of what each of n poses contributes. Returns (bars, cross of the one left out)."""
    style.axes(ax, "pose", "parameters it pays for", "what each pose contributes, of 12")
    ax.set(xlim=(0.3, n + 0.7), ylim=(0, 7), xticks=range(1, n + 1))
    (bars,) = ax.plot([], [], color=style.MEASUREMENT, linewidth=9, solid_capstyle="butt")
    (cross,) = ax.plot([], [], **style.look("rejected", markersize=10, markeredgewidth=2))
    return bars, cross


def set_bars(line, heights):
    """Give a line of bars its heights; the first bar stands at 1."""
    x = np.repeat(np.arange(1, len(heights) + 1), 3).astype(float)
    line.set_data(x, np.column_stack([np.zeros(len(heights)), heights, np.full(len(heights), np.nan)]).ravel())


def tilts(ax, measured):
    """The plane of tilts with the poses already measured. Returns the next one."""
    style.axes(ax, "tilt about x (deg)", "tilt about y (deg)", "drag the next pose", equal=True)
    ax.set(xlim=(-35, 35), ylim=(-35, 35))
    ax.plot(*measured.T, **style.look("measurement"))
    return ax.plot([], [], **style.look("estimates", markersize=8))[0]


def remaining(ax):
    """Six standard deviations as shares of what they are now. Returns (bars of the next pose, marks of ninety more)."""
    style.axes(ax, "", "% of the std now", "what is left")
    ax.set(xlim=(0.3, 6.7), ylim=(0, 112))
    ax.set_xticks(range(1, 7), NAMES)
    ax.axhline(100, **style.look("guide"))
    (bars,) = ax.plot([], [], color=style.ESTIMATE, linewidth=13, solid_capstyle="butt", label="with the next pose")
    (marks,) = ax.plot([], [], color=style.PREDICTION, marker="_", markersize=18, markeredgewidth=2.5, linestyle="none",
                       label="with 90 more like the nine")  # fmt: skip
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.08), ncols=1)
    return bars, marks


def histogram(ax):
    """Errors over the standard deviation told. Returns (steps, normal law, Student's law)."""
    style.axes(ax, "calibrations done again: error / standard deviation told", "density")
    ax.set(xlim=(-REACH, REACH), ylim=(0, 0.48))
    for side in (-2, 2):
        ax.axvline(side, **style.look("guide"))
    (steps,) = ax.plot([], [], color=style.MEASUREMENT, linewidth=1.8, drawstyle="steps-mid", label="errors")
    (normal,) = ax.plot([], [], **style.look("prediction", label="if the noise were known"))
    (student,) = ax.plot([], [], **style.look("estimate", label="Student's law"))
    style.legend_above(ax, ncols=3)
    return steps, normal, student
