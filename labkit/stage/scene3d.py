"""Scenes in space on plain 2D axes: an orthographic projection of our own, because mplot3d takes 50 ms per frame and
this takes 2.

    scene = Scene(ax, radius=300)                       # bare axes, limits fixed: the scene turns inside them
    base, path = scene.triad("B", length=100), scene.line(**style.look("truth"))
    scene.fixed(base, np.eye(4))                        # what never moves in space
    def update(state, result):
        path.set(result["points"])                      # in the world's coordinates
        scene.draw(state["view"])                       # projects everything, in place
    return scene.artists, update

Nearer things are drawn over farther ones, and farther ends of triads, rings and paths fade. The letter stands at each
tip.
"""

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba

from . import style

FAR_ALPHA = 0.3  # how much is left of a line at the far side of the scene
CIRCLE = np.stack([np.cos(np.linspace(0, 2 * np.pi, 65)), np.sin(np.linspace(0, 2 * np.pi, 65))], -1)


@dataclass(frozen=True)
class View:
    """Where the eye stands: azimuth from +x towards +y and elevation above the xy plane (deg).

    `center` is the point in space in the middle of the picture.
    """

    azimuth_deg: float = -60.0
    elevation_deg: float = 25.0
    center: tuple = (0.0, 0.0, 0.0)

    @property
    def axes(self):
        """Unit vectors right, up and toward the eye, as rows; shape (3, 3)."""
        (ca, ce), (sa, se) = np.cos(a := np.deg2rad([self.azimuth_deg, self.elevation_deg])), np.sin(a)
        return np.array([[-sa, ca, 0.0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]])

    def project(self, points):
        """(right, up, toward) of points in space; (..., 3) -> (..., 3)."""
        return (np.asarray(points, dtype=float) - self.center) @ self.axes.T

    def unproject(self, shift):
        """The displacement in space, in the plane of the screen, of a shift (right, up); (..., 2) -> (..., 3)."""
        return np.asarray(shift, dtype=float) @ self.axes[:2]

    def turned(self, azimuth_deg, elevation_deg):
        """The view turned by two angles (deg); the elevation ends at +-90."""
        elevation = float(np.clip(self.elevation_deg + elevation_deg, -90, 90))
        return replace(self, azimuth_deg=(self.azimuth_deg + azimuth_deg) % 360, elevation_deg=elevation)


class Scene:
    """Things in space on one axes.

    radius : half the height of what is visible, in the unit of the points; half_width : the same across, by default
        alike.
    """

    def __init__(self, ax, radius, title="", half_width=None):
        style.bare(ax, title)
        half_width = half_width or radius
        ax.set(xlim=(-half_width, half_width), ylim=(-radius, radius))
        ax.set_aspect("equal", adjustable="box")
        self.ax, self.radius, self.items, self.artists = ax, radius, [], []

    def _add(self, item):
        self.items.append(item)
        self.artists += item.artists
        return item

    def triad(self, name="", length=None, linestyle="-", linewidth=2.2):
        """A frame: `.set(T)` with T of shape (4, 4). Frames differ by name and line style, never by color."""
        return self._add(_Triad(self, name, length or 0.3 * self.radius, linestyle, linewidth))

    def line(self, fade=False, **looks):
        """A path: `.set(points)`, shape (n, 3); a row of NaN breaks it. `fade` lets its far parts pale."""
        return self._add((_FadingLine if fade else _Points)(self, looks))

    def points(self, **looks):
        """Single points: `.set(points)`, shape (n, 3) or (3,). The same as a line; the look has no line style."""
        return self._add(_Points(self, looks))

    def text(self, text="", offset=(6, 6), **looks):
        """Words at a point: `.set(point)` or `.set(point, text)`; `offset` in points of the font."""
        return self._add(_Text(self, text, offset, looks))

    def ellipsoid(self, **looks):
        """Outline of an ellipsoid: `.set(center, shape)`, shape (3, 3): r**2 * I or a covariance."""
        return self._add(_Ellipsoid(self, looks))

    def fixed(self, item, *values):
        """Set an item once and for all; returns it."""
        item.set(*values)
        return item

    def draw(self, view):
        """Project all items that have been set."""
        for item in self.items:
            if item.value is not None:
                item.draw(view)

    def depth(self, toward):
        """zorder from depth: 2 at the far side of the scene, 3 at the near one."""
        return 2.5 + 0.5 * np.clip(toward / self.radius, -1, 1)

    def alpha(self, toward):
        """Opacity from depth, FAR_ALPHA to 1."""
        return FAR_ALPHA + (1 - FAR_ALPHA) * np.clip(0.5 + 0.5 * np.asarray(toward) / self.radius, 0, 1)


class _Item:
    value = None

    def set(self, value):
        self.value = np.asarray(value, dtype=float)


class _Points(_Item):
    def __init__(self, scene, looks):
        self.scene = scene
        (self.artist,) = scene.ax.plot([], [], **looks)
        self.artists = [self.artist]

    def draw(self, view):
        right, up, toward = view.project(np.atleast_2d(self.value)).T
        self.artist.set_data(right, up)
        self.artist.set_zorder(self.scene.depth(np.nanmean(toward)) if np.isfinite(toward).any() else 2)


class _FadingLine(_Item):
    def __init__(self, scene, looks):
        self.scene = scene
        self.color = to_rgba(looks.pop("color", style.INK))
        self.artist = LineCollection([], capstyle="round", **looks)
        scene.ax.add_collection(self.artist, autolim=False)
        self.artists = [self.artist]

    def draw(self, view):
        p = view.project(np.atleast_2d(self.value))
        segments = np.stack([p[:-1], p[1:]], 1)
        segments = segments[np.isfinite(segments).all((1, 2))]
        toward = segments[..., 2].mean(1)
        order = np.argsort(toward)
        colors = np.tile(self.color, (len(order), 1))
        colors[:, 3] *= self.scene.alpha(toward[order])
        self.artist.set_segments(segments[order, :, :2])
        self.artist.set_color(colors)


class _Text(_Item):
    words = None

    def __init__(self, scene, text, offset, looks):
        self.scene = scene
        self.artist = scene.ax.annotate(
            text, (0, 0), xytext=offset, textcoords="offset points", annotation_clip=False, **{"zorder": 4, **looks}
        )
        self.artists = [self.artist]

    def set(self, value, text=None):
        super().set(value)
        if text is not None:
            self.artist.set_text(text)

    def draw(self, view):
        self.artist.xy = tuple(view.project(self.value)[:2])


class _Ellipsoid(_Item):
    def __init__(self, scene, looks):
        (self.artist,) = scene.ax.plot([], [], **looks)
        self.scene, self.artists = scene, [self.artist]

    def set(self, center, shape):
        super().set(center)
        self.shape = np.asarray(shape, dtype=float)

    def draw(self, view):
        right, up, toward = view.project(self.value)
        values, vectors = np.linalg.eigh(view.axes[:2] @ self.shape @ view.axes[:2].T)
        outline = CIRCLE @ (vectors * np.sqrt(np.maximum(values, 0))).T + (right, up)
        self.artist.set_data(*outline.T)
        self.artist.set_zorder(self.scene.depth(toward))


class _Triad(_Item):
    def __init__(self, scene, name, length, linestyle, linewidth):
        self.scene, self.length = scene, length
        self.lines = [
            scene.ax.plot([], [], color=color, linestyle=linestyle, linewidth=linewidth)[0] for color in style.AXES
        ]
        self.letters = [
            scene.ax.text(0, 0, letter, color=color, ha="center", va="center", fontsize=9, zorder=4, clip_on=False)
            for letter, color in zip("xyz", style.AXES)
        ]
        self.name = scene.ax.annotate(
            name, (0, 0), xytext=(-5, -5), textcoords="offset points", ha="right", va="top", zorder=4, fontweight="bold"
        )
        self.artists = [*self.lines, *self.letters, *([self.name] if name else [])]

    def name_at(self, right, up):
        """Put the name elsewhere than below on the left, in points from the origin, when another frame is near."""
        self.name.set(ha="center", va="center")
        self.name.xyann = right, up

    def draw(self, view):
        R, origin = self.value[:3, :3], self.value[:3, 3]
        start, tips = view.project(origin), view.project(origin + self.length * R.T)
        for line, letter, tip in zip(self.lines, self.letters, tips):
            line.set_data([start[0], tip[0]], [start[1], tip[1]])
            line.set_zorder(self.scene.depth(tip[2]))
            line.set_alpha(self.scene.alpha(tip[2]) ** 0.5)
            letter.set_position(tip[:2] + 0.13 * (tip - start)[:2])
        self.name.xy = tuple(start[:2])
