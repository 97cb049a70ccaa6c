"""Chapter 4: contour maps, paths of iterates, models and their trust regions, basins, the walk along the line."""

import numpy as np
from matplotlib.colors import to_rgba
from matplotlib.image import PcolorImage

from ...stage import style

PATHS = {
    "newton": {"linestyle": "-", "marker": "o", "label": "Newton"},
    "gauss_newton": {"linestyle": ":", "marker": "s", "label": "Gauss-Newton"},
    "levenberg_marquardt": {"linestyle": "--", "marker": "^", "label": "Levenberg-Marquardt"},
    "trust_region": {"linestyle": "-.", "marker": "D", "label": "trust region"},
}
BASINS = {
    "local minimum": style.PREDICTION,
    "global minimum": style.ESTIMATE,
    "saddle": style.MEASUREMENT,
    "nowhere": style.MUTED,
}
LETTERS = {"local minimum": "L", "global minimum": "G", "saddle": "S"}


def contour_map(ax, x, y, f, levels, points=()):
    """Thin contour lines of f over the grid x, y, and named points {name: (x, y)}. Returns ax."""
    style.axes(ax, "$x_1$", "$x_2$", equal=True, grid=False)
    ax.contour(x, y, f, levels=levels, colors=style.MUTED, linewidths=0.6, linestyles="solid", alpha=0.7)
    for name, at in dict(points).items():
        ax.plot(*at, marker="+", color=style.INK, markersize=9, markeredgewidth=1.6)
        away = (-12, 9) if name == "saddle" else (14, -7)  # paths run along the line through all three
        beside = {"xytext": away, "textcoords": "offset points", "ha": "center", "va": "center"}
        ax.annotate(LETTERS[name], at, **beside, weight="bold")
    return ax


def paths(ax, names):
    """One empty path for each method. Returns {name: line}."""
    return {name: ax.plot([], [], color=style.MUTED, linewidth=1.3, markersize=4.5, **PATHS[name])[0] for name in names}


def emphasize(lines, chosen):
    """The chosen one of several lines in the color of the estimate and on top, the others thin and muted."""
    for line in lines.values():
        line.set(color=style.MUTED, linewidth=0.9, markersize=0, zorder=3)
    lines[chosen].set(color=style.ESTIMATE, linewidth=2.4, markersize=4.5, zorder=4)


def model(ax):
    """Contours of a quadratic model, the rim of its trust region, and the step. Returns (contours, rim, step)."""
    (contours,) = ax.plot([], [], color=style.PREDICTION, linewidth=1.2, zorder=2)
    (rim,) = ax.plot([], [], color=style.INK, linewidth=1.4, linestyle=(0, (2, 2)), zorder=5)
    (step,) = ax.plot([], [], color=style.INK, linewidth=2.6, marker="o", markevery=[-1], markersize=7, zorder=6)
    return contours, rim, step


def courses(ax, names, iterations, low, high):
    """Cost against iteration, one line per method, and a marker for the one shown. Returns ({name: line}, marker)."""
    style.axes(ax, "iteration", "$f$", "gray: the others")
    ax.set(xlim=(0, iterations), ylim=(low, high), xticks=range(0, iterations + 1, 4))
    lines = paths(ax, names)
    (here,) = ax.plot([], [], marker="o", markersize=11, markerfacecolor="none", color=style.INK, zorder=6)
    return lines, here


def basins(ax, beside, edges):
    """A square image of where each start ends, empty at first, its legend beside it. Returns (image, fill).

    `edges` are the borders of the cells, alike in both directions. PcolorImage takes half the time of imshow.
    """
    image = PcolorImage(ax, edges, edges, np.zeros((len(edges) - 1, len(edges) - 1, 4), dtype=np.uint8), zorder=1)
    ax.add_image(image)
    for name, color in BASINS.items():
        ax.plot([], [], marker="s", markersize=9, linestyle="none", color=color, label=name)
    handles, _ = ax.get_legend_handles_labels()
    style.bare(beside).legend(handles=handles, loc="upper left", title="ends in", alignment="left", borderaxespad=0.0)
    return image, lambda colors: image.set_data(edges, edges, colors)


def basin_colors(labels, covered):
    """RGBA bytes of an array of labels (order of `BASINS`); transparent where covered."""
    table = np.array([*(to_rgba(color, 0.75) for color in BASINS.values()), (0, 0, 0, 0)])
    return np.round(255 * table).astype(np.uint8)[np.where(covered, len(BASINS), labels)]


def profile(ax, t, f, points):
    """f along a line, with named points {name: (t, f)}. Returns artists (parabola, iterates, vertex, text, names)."""
    style.axes(ax, "$t$, on the line through both centers: 0 at (1, 1), 1 at (-1, -2)", "$f$")
    ax.plot(t, f, **style.look("truth"))
    paper = {"facecolor": style.PAPER, "edgecolor": "none", "pad": 2}  # lines may pass under words
    names = []
    for name, at in points.items():
        away = {"xytext": (-4, -15 if name != "saddle" else 8), "textcoords": "offset points"}
        names.append(ax.annotate(LETTERS[name], at, **away, weight="bold", bbox=paper | {"pad": 0}, zorder=3.5))
    (parabola,) = ax.plot([], [], **style.look("prediction"), zorder=3)
    (iterates,) = ax.plot([], [], **style.look("estimate"), marker="D", markersize=5, zorder=4)
    (vertex,) = ax.plot([], [], color=style.PREDICTION, marker="v", markersize=10, linestyle="none", zorder=5)
    text = ax.text(0.02, 0.05, "", transform=ax.transAxes, zorder=6, bbox=paper)
    return parabola, iterates, vertex, text, names


def curvature(ax):
    """Both directions of curvature at a point and the step's share along each. Returns (first, second, shares)."""
    first, second = (ax.plot([], [], color=style.INK, linewidth=1.4, zorder=3)[0] for _ in range(2))
    (shares,) = ax.plot([], [], color=style.PREDICTION, linewidth=3.2, zorder=3)
    return first, second, shares


def indefinite(ax, x, y, lowest):
    """Shade where the smallest eigenvalue of the Hessian is negative. Returns the contour set."""
    return ax.contourf(x, y, lowest, levels=[-1e9, 0], colors=[style.FAINT], zorder=0)


def not_positive_definite(ax, x, y, lowest):
    """Shade where the smallest eigenvalue of a curvature is not positive. Returns the contour set."""
    return ax.contourf(x, y, lowest, levels=[-1e9, 0], colors=[style.GRID], alpha=0.55, zorder=0)


def chord_on_map(ax):
    """The chord between two handles, seen from above. Returns the line."""
    (line,) = ax.plot([], [], color=style.ESTIMATE, linewidth=2.2, zorder=4)
    return line


def chord_profile(ax, low, high):
    """f along a chord, the chord, and where f rises above it. Returns (f, chord, above, positive)."""
    style.axes(ax, "from P (0) to Q (1)", "$f$")
    ax.set(xlim=(0, 1), ylim=(low, high))
    (curve,) = ax.plot([], [], label="f", **style.look("truth"))
    (straight,) = ax.plot([], [], label="chord", **style.look("estimate"))
    (above,) = ax.plot([], [], color=style.AXIS_X, linewidth=5, alpha=0.45, zorder=1, label="f above it")
    (positive,) = ax.plot([], [], color=style.AXIS_Y, linewidth=5, solid_capstyle="butt", label="positive definite")
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, fontsize=8, columnspacing=0.8, handlelength=1.2)
    return curve, straight, above, positive
