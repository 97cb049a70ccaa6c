"""Figures of chapter 3: tool directions on a sphere, singular values, errors side by side, outliers."""

import numpy as np

from ...stage import scene3d_solids as solids
from ...stage import style

GRATICULE = np.linspace(0, 2 * np.pi, 49)


def graticule(scene, latitudes_deg=(0, 30, 60), meridians=6):
    """Circles of latitude and longitude of the upper half of a unit sphere, fixed in the scene."""
    lines = []
    for latitude in np.deg2rad(latitudes_deg):
        ring = np.column_stack([np.cos(GRATICULE), np.sin(GRATICULE), 0 * GRATICULE]) * np.cos(latitude)
        lines.append(ring + (0, 0, np.sin(latitude)))
    arc = np.linspace(0, np.pi, 25)
    for azimuth in np.pi * np.arange(meridians // 2) / (meridians // 2):
        lines.append(np.column_stack([np.cos(arc) * np.cos(azimuth), np.cos(arc) * np.sin(azimuth), np.sin(arc)]))
    for points in lines:
        scene.fixed(scene.line(fade=True, color=style.GRID, linewidth=1.0), points)


def dome():
    """The upper half of the unit sphere on which tool directions lie."""
    half = np.linspace(0, np.pi / 2, 13)
    return solids.turned(np.column_stack([np.cos(half), np.sin(half)])).looks(style.FAINT, 0.18)


def tool(length, radius):
    """A straight tool in its frame: the tip at -length along z, the flange's plate at z = 0."""
    tip = min(10 * radius, 0.35 * length)
    return (
        solids.turned([(0, -length), (radius, tip - length), (radius, -0.08 * length), (0, -0.08 * length)]).looks(
            style.STEEL
        ),
        solids.cylinder(2.2 * radius, -0.08 * length, 0.0).looks(style.SHELL),
    )


def anvil():
    """What holds the pivot: a low cone whose tip is the origin."""
    return solids.turned([(0, -12), (16, -12), (16, -9), (2, -0.5), (0, 0)]).looks(style.SHELL), solids.sphere(
        1.6, 8
    ).looks(style.TRUTH)


def touching(R, direction):
    """The pose of a tool turned by R whose flange's plate is at `direction`, so that its tip touches the origin."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, direction
    return T


def singular_value_axes(ax):
    """Logarithmic axes of the six singular values, largest first. Returns (markers, floor).

    `floor` is the line below which a value is nothing but orientation noise.
    """
    style.axes(ax, "", "singular value", "six singular values")
    ax.set(yscale="log", xlim=(0.4, 6.6), ylim=(1e-3, 20))
    ax.set_xticks(range(1, 7), [f"s{k}" for k in range(1, 7)])
    _plain_decades(ax, (0.001, 0.01, 0.1, 1, 10))
    (markers,) = ax.plot([], [], **style.look("estimates", markersize=8))
    (floor,) = ax.plot([], [], **style.look("guide", linewidth=2), label="feigned by noise")
    ax.legend(loc="lower left")
    return markers, floor


def _plain_decades(ax, values):
    ax.set_yticks(values, [f"{v:g}" for v in values])
    ax.minorticks_off()


def error_bars(ax, names, decades, title):
    """Axes of a few lengths (mm) as bars on a logarithmic scale. Returns one line per name, for `set_bars`."""
    style.axes(ax, "", "mm", title)
    ax.set(yscale="log", xlim=(-0.6, len(names) - 0.4), ylim=(decades[0], decades[-1]))
    style.words_below(ax, names)
    _plain_decades(ax, decades)
    ax.grid(axis="x", visible=False)
    return [ax.plot([], [], linewidth=16, solid_capstyle="butt")[0] for _ in names]


def set_bars(bars, values, colors):
    """Set the bars of `error_bars`; values below the axes vanish, values beyond its top end there."""
    for x, (bar, value, color) in enumerate(zip(bars, values, colors)):
        top = bar.axes.get_ylim()[1]
        bar.set_data([x, x], [1e-9, min(max(value, 1e-9), top)])
        bar.set_color(color)


def touch_axes(ax):
    """Plan view of where the tip was in each pose, about the true pivot (mm). Returns the artists (kept, rejected)."""
    style.axes(ax, "x about the pivot (mm)", "y (mm)", "where the true tip was in each pose", equal=True)
    ax.set(xlim=(-16, 16), ylim=(-16, 16))
    ax.plot([0], [0], color=style.TRUTH, marker="+", markersize=14, markeredgewidth=2, linestyle="none")
    (kept,) = ax.plot([], [], **style.look("measurement"))
    (rejected,) = ax.plot([], [], **style.look("rejected", markersize=9, markeredgewidth=2))
    return kept, rejected
