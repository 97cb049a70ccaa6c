"""Figures of chapter 1: frames in the plane, the Gram-Schmidt construction, clouds of noisy frames, gimbal rings."""

import numpy as np
from matplotlib.ticker import MaxNLocator

from ...stage import scene3d_solids as solids
from ...stage import style

CIRCLE_DEG = np.arange(0, 361, 6)
TOPS = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0)  # deg


class Construction:
    """Three measured points in space, the triangle and the plane they span, what Gram-Schmidt removes of the second
    arm (hollow cross) and what it keeps."""

    def __init__(self, scene, name):
        self.plane = scene.body(solids.box((-0.25, 1.3), (-0.25, 1.3), (0, 0)).looks(style.PREDICTION, 0.16), name=name)
        self.plate = scene.body(unit_triangle(), name=f"triangle of {name}")
        self.arms = scene.line(color=style.MEASUREMENT, linewidth=1.4)
        self.removed = scene.line(color=style.REJECTED, linestyle=":", linewidth=2.2)
        self.kept = scene.line(**style.look("prediction"))
        self.foot = scene.points(**style.look("rejected", markersize=7))
        self.points = scene.points(**style.look("measurement", markersize=6))

    def set(self, T, points, foot):
        """The frame (4, 4); origin, x_point, y_point, (3, 3); where y_point falls on the first arm's line, (3,)."""
        origin, x_point, y_point = points
        self.plane.set(T)
        self.plate.set(onto(points, 0.012))
        self.arms.set([x_point, origin, y_point])
        self.points.set(points)
        self.removed.set([origin, foot])
        self.foot.set(foot)
        self.kept.set([foot, y_point])


def unit_triangle():
    """The triangle (0, 0), (1, 0), (0, 1), thin, to be stretched onto another by `onto`."""
    return solids.raised([(0, 0), (1, 0), (0, 1)], -0.5, 0.5).looks(style.MEASUREMENT, 0.25)


def onto(corners, thickness=0.6):
    """The matrix that carries the unit triangle onto three points, (3, 3) -> (4, 4), so thick."""
    o, x, y = corners
    normal = np.cross(x - o, y - o)
    T = np.eye(4)
    T[:3, :3] = np.column_stack([x - o, y - o, thickness * normal / max(np.linalg.norm(normal), 1e-12)])
    T[:3, 3] = o
    return T


def hand():
    """A flange with a finger along its x axis, so that one sees how it is turned."""
    return (
        solids.cylinder(0.26, -0.1, 0.0).looks(style.STEEL), solids.box((-0.1, 0.32), (-0.07, 0.07), (0.0, 0.1)),
    )  # fmt: skip


class TipCloud:
    """Tips of many noisy frames in a 3D scene, a color per axis, around the true frame."""

    def __init__(self, scene, length):
        self.length = length
        self.clouds = [
            scene.points(color=color, linestyle="none", marker=".", markersize=3.5, alpha=0.5, markeredgewidth=0)
            for color in style.AXES
        ]

    def set(self, T):
        """`T`: shape (n, 4, 4)."""
        for k, cloud in enumerate(self.clouds):
            cloud.set(T[:, :3, 3] + self.length * T[:, :3, k])


def error_against_height(ax, heights):
    """Axes of error about x, y, z (deg) against the triangle's height (mm), both logarithmic.

    Returns (bounds, found): a line per axis over `heights`, and a marker per axis for what the repetitions gave.
    """
    style.axes(ax, "height of the triangle (mm)", "error of the frame (deg)", "measured error and its bound")
    ax.set(xscale="log", yscale="log", xlim=(heights[0], heights[-1]), ylim=(0.02, 200))
    ax.set_xticks([1, 3, 10, 30, 100], ["1", "3", "10", "30", "100"])
    ax.set_yticks([0.1, 1, 10, 100], ["0.1", "1", "10", "100"])
    ax.minorticks_off()
    marks = ("o", "s", "^")
    dashes = ("-", "-", (0, (4, 3)))
    bounds, found = [], []
    for letter, color, mark, dash in zip("xyz", style.AXES, marks, dashes):
        bounds += ax.plot([], [], color=color, linestyle=dash, linewidth=1.8)
        found += ax.plot(
            [], [], color=color, linestyle="none", marker=mark, markersize=8, markeredgecolor=style.INK, clip_on=False,
            label=f"about {letter}",
        )  # fmt: skip
    (key,) = ax.plot([], [], color=style.MUTED, label="bound")
    ax.legend(handles=[*found, key], loc="upper right")
    return bounds, found


class Ring:
    """The ring of one angle: a circle about its axis, the arc turned so far, and the axis with its letter."""

    def __init__(self, scene, letter, color, radius, reach):
        self.radius, self.reach = radius, reach
        self.circle = scene.line(fade=True, color=color, linewidth=1.6)
        self.arc = scene.line(color=color, linewidth=4.5)
        self.axis = scene.line(fade=True, color=color, linewidth=1.2, linestyle=(0, (3, 2)))
        self.letter = scene.text(
            letter, offset=(0, 0), color=color, fontweight="bold", fontsize=12, ha="center", va="center"
        )

    def set(self, axis, zero, angle):
        """`axis`, `zero`: unit vectors, shape (3,), of the turning axis and of angle 0; `angle` in rad."""
        side = np.cross(axis, zero)

        def path(angles):
            return self.radius * (np.cos(angles)[:, None] * zero + np.sin(angles)[:, None] * side)

        self.circle.set(path(np.deg2rad(CIRCLE_DEG)))
        self.arc.set(path(np.linspace(0.0, angle, 25)))
        self.axis.set(np.array([-1, 1])[:, None] * 0.92 * self.reach * axis)
        self.letter.set(self.reach * axis)


def compare_errors(ax):
    """Axes that compare two estimators about x, y, z: error found (markers) and bound (bars), in degrees.

    Returns [(markers, bars), ...] for Gram-Schmidt and the SVD fit; each has three entries.
    """
    style.axes(ax, "", "error of the frame (deg)", "error found, and its bound")
    ax.set(xlim=(-0.6, 2.6), ylim=(0, TOPS[3]))
    ax.set_xticks(range(3), [f"about {letter}" for letter in "xyz"])
    ax.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    ax.grid(axis="x", visible=False)
    pairs = []
    for label, shift, mark, fill in (
        ("Gram-Schmidt", -0.16, "D", style.ESTIMATE),
        ("SVD fit", 0.16, "o", "none"),
    ):
        x = np.arange(3) + shift
        (markers,) = ax.plot(
            x,
            x * 0,
            **style.look("estimates", marker=mark, markersize=9, markerfacecolor=fill, markeredgewidth=2),
            label=label,
        )
        (bars,) = ax.plot([], [], color=style.INK, linewidth=2.2, solid_capstyle="butt")
        pairs.append((markers, bars, x))
    (key,) = ax.plot([], [], color=style.INK, linewidth=2.2, label="bound")
    ax.legend(handles=[pairs[0][0], pairs[1][0], key], loc="upper right")
    return pairs


def set_top(ax, value):
    """Raise or lower the upper limit in few steps, so that the axes are redrawn seldom."""
    top = min((t for t in TOPS if t > 1.9 * value), default=TOPS[-1])  # the legend has room above the data
    if ax.get_ylim()[1] != top:
        ax.set_ylim(0, top)


def set_comparison(pair, found, bound):
    """Move the markers and bars of one estimator; `found` and `bound` have shape (3,), deg."""
    markers, bars, x = pair
    markers.set_data(x, found)
    bars.set_data(
        (x[:, None] + (-0.13, 0.13, np.nan)).ravel(), (np.asarray(bound)[:, None] + (0.0, 0.0, np.nan)).ravel()
    )
