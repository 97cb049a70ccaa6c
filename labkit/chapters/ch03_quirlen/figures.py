"""Figures of chapter 3: tool directions on a sphere, singular values, errors side by side, outliers."""

import numpy as np

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


class Spokes:
    """Lines from one center to many points, as one artist of a scene."""

    def __init__(self, scene, **looks):
        self.line = scene.line(**looks)

    def set(self, center, points):
        center = np.broadcast_to(center, np.shape(points))
        self.line.set(np.stack([center, points, np.full_like(center, np.nan)], axis=1).reshape(-1, 3))


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
