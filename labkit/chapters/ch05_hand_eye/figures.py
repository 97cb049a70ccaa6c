"""Figures of chapter 5: scan line and sphere, steps of differences, iterations, residuals of the 31 poses, patterns."""

import numpy as np

from ...stage import style
from . import bodies

CIRCLE = np.linspace(0, 2 * np.pi, 121)
LINES = {"x": "o", "y": "s", "x*": "^", "y*": "v"}  # a marker for each line of motion


def side_view(ax, limits):
    """Sphere, scan plane and scanner seen along the scan line (y to the right, z down).

    Returns
    -------
    (sphere, other, cloud, spread) : outline, mirror solution, recovered centers, one standard deviation.
    """
    style.axes(ax, "y across the scan plane (mm)", "z (mm)", "side view", equal=True)
    ax.set(xlim=limits[0], ylim=limits[1][::-1])
    ax.axvline(0, color=style.MEASUREMENT, linewidth=1.6)
    ax.annotate("scan plane", (0, limits[1][0]), xytext=(5, -12), textcoords="offset points")
    (sphere,) = ax.plot([], [], **style.look("truth"))
    (other,) = ax.plot([], [], **style.look("guide"))
    (spread,) = ax.plot([], [], color=style.PREDICTION, linewidth=6, alpha=0.6, solid_capstyle="butt")
    (cloud,) = ax.plot([], [], **style.look("estimates", markersize=4, alpha=0.7))
    return sphere, other, cloud, spread


def profile_view(ax, limits):
    """The scan line itself: measured points, fitted circle, its center. Returns (points, circle, center)."""
    style.axes(ax, "x along the scan line (mm)", "z (mm)", "what the scanner sees", equal=True)
    ax.set(xlim=limits[0], ylim=limits[1][::-1])
    (circle,) = ax.plot([], [], **style.look("estimate"))
    (points,) = ax.plot([], [], **style.look("measurement", markersize=3))
    (center,) = ax.plot([], [], **style.look("estimates", markersize=7))
    return points, circle, center


def set_circle(line, x, z, radius):
    """Move a circle."""
    line.set_data(x + radius * np.cos(CIRCLE), z + radius * np.sin(CIRCLE))


def triangle(ax, limits, measures):
    """Base, rays and object of a triangulating sensor seen from the side, the base on top.

    Returns
    -------
    (base, rays, cloud, spread) : the base, both rays, recovered places, one standard deviation of the height.
    """
    style.axes(ax, "along the base (mm)", "height H (mm)", "drag the object", equal=True)
    ax.set(xlim=limits[0], ylim=limits[1][::-1])
    ax.axhspan(*measures, color=style.FAINT, zorder=0)
    (base,) = ax.plot([], [], color=style.INK, linewidth=5, solid_capstyle="butt")
    (rays,) = ax.plot([], [], **style.look("measurement", linestyle="-", linewidth=1.4, marker=""))
    (spread,) = ax.plot([], [], color=style.PREDICTION, linewidth=6, alpha=0.6, solid_capstyle="butt")
    (cloud,) = ax.plot([], [], **style.look("estimates", markersize=3.5, alpha=0.7))
    return base, rays, cloud, spread


def error_over_range(ax, measures, limits):
    """Standard deviation of the height over the distance. Returns (curve, here)."""
    style.axes(ax, "height H (mm)", "error of the height (mm)", "gray: the scanner's range")
    ax.set(yscale="log", xlim=limits[0], ylim=limits[1])
    ax.axvspan(*measures, color=style.FAINT, zorder=0)
    (curve,) = ax.plot([], [], **style.look("prediction"))
    (here,) = ax.plot([], [], **style.look("estimates", markersize=9))
    return curve, here


def target_board(ax, half, hits):
    """Where a robot was sent (a cross) and where it arrived. Returns (ring, hits, mean, accuracy, circle)."""
    style.axes(ax, "x (mm)", "y (mm)", f"{hits} arrivals at the cross", equal=True)
    ax.set(xlim=(-half, half), ylim=(-half, half))
    ax.plot([0], [0], color=style.TRUTH, marker="+", markersize=18, markeredgewidth=2, linestyle="none")
    (accuracy,) = ax.plot([], [], label="accuracy", **style.look("estimate"))
    (circle,) = ax.plot([], [], label="repeatability", **style.look("prediction"))
    (ring,) = ax.plot([], [], color=style.INK, marker="o", markersize=12, markerfacecolor="none", linestyle="none")
    (dots,) = ax.plot([], [], **style.look("measurement", markersize=4))
    (mean,) = ax.plot([], [], **style.look("estimates", markersize=8))
    ax.legend(loc="lower left")
    return ring, dots, mean, accuracy, circle


def driven_corner(ax, half):
    """A commanded path around a corner and the driven one. Returns (commanded, driven, worst)."""
    style.axes(ax, "x (mm)", "y (mm)", "once around a corner", equal=True)
    ax.set(xlim=(-half, 0.35 * half), ylim=(-0.35 * half, half))
    (commanded,) = ax.plot([], [], label="commanded", **style.look("truth"))
    (driven,) = ax.plot([], [], label="driven", **style.look("measurement", linestyle="-", marker=""))
    (worst,) = ax.plot([], [], label="path accuracy", **style.look("estimate"))
    ax.legend(loc="upper left")
    return commanded, driven, worst


def differences(ax, around):
    """A function near a place, in steps to each side, with its tangent and the two secants. Returns (curve, forward,
    central).
    """
    style.axes(ax, "steps away", "change, as the tangent has it", equal=True)
    ax.set(xlim=(around[0], around[-1]), ylim=(-2.1, 2.1), xticks=(-1, 0, 1), yticks=(-2, -1, 0, 1, 2))
    ax.plot(around, around, **style.look("truth", linewidth=1.2), label="tangent")
    (curve,) = ax.plot([], [], color=style.MEASUREMENT, linewidth=2.4, label="residual, as computed")
    (forward,) = ax.plot([], [], **style.look("prediction", marker="o", markersize=5), label="forward")
    (central,) = ax.plot([], [], **style.look("estimate", marker="D", markersize=5), label="central")
    style.legend_above(ax, ncols=2, fontsize=8, columnspacing=0.8, handlelength=1.4)
    return curve, forward, central


def error_against_step(ax, logs, curves):
    """Error of finite differences over the logarithm of the step (deg). `curves`: {label: errors}. Returns the markers,
    one per curve.
    """
    style.axes(ax, "step h (deg)", "largest error (mm per deg)")
    ax.set(yscale="log", xlim=(logs[0], logs[-1]), ylim=(1e-13, 1e3))
    ax.set_xticks(range(-12, 1, 3), [f"$10^{{{n}}}$" for n in range(-12, 1, 3)])
    looks = (style.look("prediction"), style.look("estimate"))
    markers = []
    for (label, errors), look in zip(curves.items(), looks):
        ax.plot(logs, errors, label=label, **look)
        markers += ax.plot([], [], color=look["color"], marker="D", markersize=8, linestyle="none", clip_on=False)
    style.legend_above(ax, ncols=2, fontsize=8)
    return markers


class Walks:
    """The flange and its scanner as they are, the walks of two searches for the scanner, each with the scanner where it
    stands after the step shown, the circles the start is turned on, and the line that x of S must not lie along."""

    def __init__(self, scene):
        self.hand = bodies.Hand(scene)
        self.frame = scene.triad("S", 90)
        scene.fixed(scene.triad("F", 110, linestyle=(0, (4, 1.5))), np.eye(4))
        self.pole = scene.line(**style.look("guide", linewidth=1.8))
        self.name = scene.text("x of S along\nthis line:\nB = -90 deg", offset=(8, -26), color=style.MUTED, fontsize=8)
        self.circles = {
            name: scene.line(color=color, linewidth=1.6)
            for name, color in (("yaw", style.AXIS_Z), ("tilt", style.AXIS_Y))
        }
        looks = (
            ("euler", style.look("prediction", marker="o", markersize=5)),
            ("se3", style.look("estimate", marker="D", markersize=4)),
        )
        self.walks = {name: scene.line(**look) for name, look in looks}
        self.scanners = {
            name: scene.body(bodies.ghost(look["color"]), name=f"scanner of {name}") for name, look in looks
        }

    def set(self, result, circles):
        """The result of `stages.compute_iterations`; {name: (T, radius, angle in deg)} of each circle."""
        truth = result["truth"]
        self.hand.set(np.eye(4), truth)
        self.frame.set(truth)
        self.pole.set(truth[:3, 3] + np.outer([-40.0, 215.0], [0.0, 0.0, 1.0]))
        self.name.set(truth[:3, 3] + [0.0, 0.0, 215.0])
        for name, (T, radius, angle) in circles.items():
            turned = np.deg2rad(np.sort([angle, *np.linspace(min(angle, 0.0) - 12, max(angle, 0.0) + 12, 37)]))
            self.circles[name].set(T[:3, 3] + radius * np.column_stack([np.cos(turned), np.sin(turned)]) @ T[:3, :2].T)
        for name, walk in self.walks.items():
            walk.set(result[name]["seen"])
            self.scanners[name].set(result[name]["now"])


def iterations(ax, steps=30):
    """Error of the scanner over the iterations, logarithmic. Returns ((Euler curve, SE(3) curve), the step shown)."""
    style.axes(ax, "iteration", "rms distance (mm)")
    ax.set(yscale="log", xlim=(0, steps), ylim=(1e-13, 1e4))
    (here,) = ax.plot([], [], **style.look("guide"))
    (euler,) = ax.plot([], [], label="steps in A, B, C", **style.look("prediction", marker="o", markersize=5))
    (se3,) = ax.plot([], [], label="steps on the pose", **style.look("estimate", marker="D", markersize=5))
    style.legend_above(ax, ncols=2, fontsize=8, columnspacing=0.8, handlelength=1.6)
    return (euler, se3), here


def start_plane(ax, far=125.0):
    """Plane of a start's distance and turn off the truth. Returns (first path, second, the printed starts)."""
    style.axes(ax, "distance off the truth (mm)", "turn off the truth (deg)", "drag the start; crosses: table 7-2")
    ax.set(xlim=(-4, far), ylim=(-6, 184))
    ax.set_yticks([0, 45, 90, 135, 180])
    (printed,) = ax.plot([], [], color=style.INK, marker="x", markersize=8, linestyle="none", clip_on=False)
    (first,) = ax.plot([], [], **style.look("estimate", marker="D", markersize=5))
    (second,) = ax.plot([], [], **style.look("prediction", marker="o", markersize=5))
    return first, second, printed


def descents(ax, names, steps, low, high):
    """Rms distance over the steps of two methods, those taken back as crosses. Returns (first, second, taken back)."""
    style.axes(ax, "step", "rms distance (mm)")
    ax.set(yscale="log", xlim=(0, steps), ylim=(low, high))
    (first,) = ax.plot([], [], label=names[0], **style.look("estimate", marker="D", markersize=5))
    (second,) = ax.plot([], [], label=names[1], **style.look("prediction", marker="o", markersize=5))
    (back,) = ax.plot([], [], label="taken back", **style.look("rejected", markersize=8, color=style.INK))
    style.legend_above(ax, ncols=3, fontsize=8, columnspacing=0.8, handlelength=1.6)
    return first, second, back


def residual_bars(ax, n, top=3000.0):
    """Residual length of each pose on a logarithmic scale; returns (stems, chosen, yardstick)."""
    style.axes(ax, "pose", "residual (mm)")
    ax.set(yscale="log", xlim=(0, n + 1), ylim=(0.08, top))
    ax.set_xticks([1, 9, 17, 25], ["1\nline x", "9\ny", "17\nx*", "25\ny*"])
    (stems,) = ax.plot([], [], color=style.ESTIMATE, linewidth=4, solid_capstyle="butt")
    (chosen,) = ax.plot([], [], color=style.INK, marker="v", markersize=9, linestyle="none")
    (yardstick,) = ax.plot([], [], **style.look("guide", linewidth=1.6))
    return stems, chosen, yardstick


def set_bars(stems, lengths, floor=0.08):
    """Move the bars of `residual_bars`."""
    n = len(lengths)
    x = np.repeat(np.arange(1, n + 1, dtype=float), 3)
    y = np.column_stack([np.full(n, floor), np.maximum(lengths, floor), np.full(n, np.nan)]).ravel()
    stems.set_data(x, y)


def cell(scene, radius):
    """Sphere, flange positions by line of motion, hand and scanner of the chosen pose, residual vectors in space.

    Returns a dictionary of the items of the scene.
    """
    flanges = {
        line: scene.points(color=style.MEASUREMENT, marker=marker, markersize=4.5, linestyle="none")
        for line, marker in LINES.items()
    }
    return {
        **flanges,
        "sight": scene.line(**style.look("guide")),
        "sphere": bodies.ball(scene, radius),
        "hand": bodies.Hand(scene),
        "residuals": scene.line(color=style.ESTIMATE, linewidth=2.0),
        "chosen": scene.line(color=style.INK, linewidth=2.6),
        "flange": scene.triad("F", 110),
        "scanner": scene.triad("S", 90, linestyle=(0, (4, 1.5))),
    }


def field_of_view(ax, field):
    """The scanner's field with what is used of it. Returns (used, places)."""
    (x_low, x_high), _, (z_low, z_high) = field
    style.axes(ax, "x along the scan line (mm)", "z (mm)", "where the sphere is seen")
    ax.set(xlim=(x_low - 8, x_high + 8), ylim=(z_high + 8, z_low - 8))
    ax.plot([x_low, x_high, x_high, x_low, x_low], [z_low, z_low, z_high, z_high, z_low], color=style.INK, linewidth=1)
    (used,) = ax.plot([], [], **style.look("prediction"))
    (places,) = ax.plot([], [], **style.look("measurement"))
    return used, places
