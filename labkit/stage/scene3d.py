"""Scenes in space: bodies, frames, points, paths and words described once, then moved by numbers.

    scene = Scene(ax, radius=300)                       # the axes become its place
    base, path = scene.triad("B", length=100), scene.line(**style.look("truth"))
    arm = scene.body(solids.cylinder(40, 0, 200), solids.sphere(45).moved(T_top))
    scene.fixed(base, np.eye(4))                        # what never moves in space
    def update(state, result):
        path.set(result["points"])                      # in the world's coordinates
        arm.set(result["T"])                            # a pose; .show(False) takes a thing out of sight
        scene.draw(state["view"])
    return scene.artists, update

The browser draws it with WebGL (`space.js`) from `describe()` and the numbers of `news()`: it turns without the kernel.
The kernel draws the same description on the axes for files, for tests, and where the browser cannot: a projection of
our own, because mplot3d takes 50 ms per frame and this takes 2. There bodies lie behind lines and words, nearer things
are drawn over farther ones, and farther ends of triads, rings and paths fade. The letter stands at each tip.
"""

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb, to_rgba

from . import scene3d_solids as solids
from . import style

FAR_ALPHA = 0.3  # how much is left of a line at the far side of the scene
CIRCLE = np.stack([np.cos(np.linspace(0, 2 * np.pi, 65)), np.sin(np.linspace(0, 2 * np.pi, 65))], -1)
LIGHT = np.array([-0.42, 0.66, 0.62])  # right, up, toward the eye
ZOOM = (0.2, 12.0)
PIXELS_PER_POINT = 100 / 72
ROUND_PIECES = 24  # of an ellipsoid's half meridian: it may fill the picture, and its outline shows each of them
FARTHEST = 1e18  # of poses and sizes: a page squares them in float32, which ends at 3e38
DASHES = {"-": 0, "none": 0, "None": 0, "": 0, "--": 1, ":": 2, "-.": 1}  # full, dashed, dotted


@dataclass(frozen=True)
class View:
    """Where the eye stands: azimuth from +x towards +y and elevation above the xy plane (deg).

    `center` is the point in space in the middle of the picture. `eye` is the eye's distance from it: near things are
    larger; from infinity parallel lines stay parallel. `zoom` magnifies.
    """

    azimuth_deg: float = -60.0
    elevation_deg: float = 25.0
    center: tuple = (0.0, 0.0, 0.0)
    eye: float = np.inf
    zoom: float = 1.0

    @property
    def axes(self):
        """Unit vectors right, up and toward the eye, as rows; shape (3, 3)."""
        (ca, ce), (sa, se) = np.cos(a := np.deg2rad([self.azimuth_deg, self.elevation_deg])), np.sin(a)
        return np.array([[-sa, ca, 0.0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]])

    def project(self, points):
        """(right, up, toward) of points in space; (..., 3) -> (..., 3)."""
        seen = (np.asarray(points, dtype=float) - self.center) @ self.axes.T
        if np.isfinite(self.eye):
            seen[..., :2] /= np.maximum(1 - seen[..., 2:] / self.eye, 0.05)
        seen[..., :2] *= self.zoom
        return seen

    def unproject(self, shift):
        """The displacement in space, in the plane of the screen, of a shift (right, up); (..., 2) -> (..., 3)."""
        return np.asarray(shift, dtype=float) / self.zoom @ self.axes[:2]

    def ray(self, right, up):
        """From where and in which direction one looks at a place of the screen: (3,), (3,)."""
        axes = self.axes
        place = np.array(self.center) + self.unproject((right, up))
        if np.isfinite(self.eye):
            eye = np.array(self.center) + self.eye * axes[2]
            return eye, place - eye
        return place, -axes[2]

    def turned(self, azimuth_deg, elevation_deg):
        """The view turned by two angles (deg); the elevation ends at +-90."""
        elevation = float(np.clip(self.elevation_deg + elevation_deg, -90, 90))
        return replace(self, azimuth_deg=(self.azimuth_deg + azimuth_deg) % 360, elevation_deg=elevation)

    def describe(self):
        """For the browser; an infinite distance is 0 there."""
        eye = float(self.eye) if np.isfinite(self.eye) else 0.0
        center = [float(v) for v in self.center]
        return {"azimuth": self.azimuth_deg, "elevation": self.elevation_deg, "center": center, "eye": eye,
                "zoom": self.zoom}  # fmt: skip

    def seen(self, page):
        """The view as the browser says it has become."""
        azimuth, elevation, zoom, *center = np.array(page["angles"] + [page["zoom"]] + page["center"], dtype=float)
        if not np.isfinite([azimuth, elevation, zoom, *center]).all():
            return self
        return replace(
            self, azimuth_deg=float(azimuth % 360), elevation_deg=float(np.clip(elevation, -90, 90)),
            zoom=float(np.clip(zoom, *ZOOM)), center=tuple(map(float, center)),
        )  # fmt: skip


class Scene:
    """Things in space on one axes.

    radius : half the height of what is visible, in the unit of the points; half_width : the same across, by default
        alike. floor : height of a floor with a grid, on which bodies throw their shadow. unit : of the scale.
    """

    def __init__(self, ax, radius, title="", half_width=None, floor=None, unit=""):
        style.bare(ax, title)
        half_width = half_width or radius
        ax.set(xlim=(-half_width, half_width), ylim=(-radius, radius))
        ax.set_aspect("equal", adjustable="box")
        self.ax, self.radius, self.half_width, self.unit = ax, radius, half_width, unit
        self.items, self.artists, self.painted, self.floor = [], [], True, floor
        self._faces, self._view, self._sent = None, None, {}
        ax.space = self  # by which the Stage finds it
        if floor is not None:
            self.fixed(self.line(color=style.GRID, linewidth=0.9), _grid(1.1 * max(radius, half_width), floor))

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
        """An ellipsoid: `.set(center, shape)`, shape (3, 3): r**2 * I or a covariance."""
        return self._add(_Ellipsoid(self, looks))

    def body(self, *parts, name=""):
        """Solids of `scene3d_solids` that move as one: `.set(T)`, shape (4, 4)."""
        return self._add(_Body(self, parts, name))

    def rod(self, radius, color=style.STEEL, opacity=1.0, name="a rod"):
        """A cylinder between two points: `.set(start, end)`."""
        return self._add(_Rod(self, solids.cylinder(1.0, 0.0, 1.0).looks(color, opacity), radius, name))

    def arrow(self, radius, color=style.INK, opacity=1.0, name="an arrow"):
        """An arrow from a point to another: `.set(start, end)`."""
        shaft = self.rod(radius, color, opacity, name)
        tip = self._add(_Rod(self, solids.cylinder(1.0, 0.0, 1.0, 0.0).looks(color, opacity), 2.6 * radius, name))
        return _Arrow(shaft, tip, 7.0 * radius)

    def fixed(self, item, *values):
        """Set an item once and for all; returns it."""
        item.set(*values)
        return item

    def draw(self, view):
        """Project all items that have been set; nothing is to be done where the browser draws."""
        self._view = view
        if not self.painted:
            return
        for item in self.items:
            for artist in item.artists:
                artist.set_visible(item.shown)
            if item.shown and item.value is not None:
                item.draw(view)
        if self._faces is not None:
            self._draw_faces(view)

    def redraw(self):
        """Project again what the last `draw` was given."""
        if self._view is not None:
            self.draw(self._view)

    def add_faces(self):
        """Bodies are drawn as one artist: the kernel sorts all their triangles by depth."""
        if self._faces is None:
            self._faces = PolyCollection([], closed=True, linewidths=0.3, zorder=1.5)
            self.ax.add_collection(self._faces, autolim=False)
            self.artists.append(self._faces)

    def _draw_faces(self, view):
        bodies = [item.faces(view) for item in self.items if isinstance(item, _Body) and item.drawable]
        if not bodies:
            return self._faces.set_verts([])
        corners, colors = (np.concatenate(parts) for parts in zip(*bodies))
        order = np.argsort(corners[..., 2].mean(1), kind="stable")
        self._faces.set_verts(corners[order, :, :2])
        self._faces.set_facecolor(colors[order])
        self._faces.set_edgecolor(np.where(colors[order, 3:] < 1, (1, 1, 1, 0), colors[order]))

    def depth(self, toward):
        """zorder from depth: 2 at the far side of the scene, 3 at the near one."""
        return 2.5 + 0.5 * np.clip(toward / self.radius, -1, 1)

    def alpha(self, toward):
        """Opacity from depth, FAR_ALPHA to 1."""
        return FAR_ALPHA + (1 - FAR_ALPHA) * np.clip(0.5 + 0.5 * np.asarray(toward) / self.radius, 0, 1)

    # -- for the browser

    def describe(self):
        """What does not change, as JSON: sizes, and what each thing is."""
        return {
            "radius": float(self.radius), "halfWidth": float(self.half_width), "unit": self.unit,
            "floor": None if self.floor is None else float(self.floor),
            "colors": {"paper": _pair(style.PAPER), "muted": _pair(style.MUTED), "axes": _AXES},
            "items": [item.describe() for item in self.items],
        }  # fmt: skip

    def named(self, name):
        """The body of that name."""
        return next(item for item in self.items if item.called == name)

    def unset(self):
        """What neither `fixed` nor `update` has given a place, and nothing hides: its name, or its kind."""
        return [item.called for item in self.items if item.value is None and item.shown]

    def news(self, whole=False):
        """What changed since the last call: rows of (number of the thing, shown, count of numbers, words), and the
        numbers, float32.
        """
        rows, numbers = [], []
        for k, item in enumerate(self.items):
            shown = bool(item.shown and item.value is not None)
            with np.errstate(over="ignore"):  # a point farther than float32 reaches: not drawn, as one of NaN
                values = np.asarray(item.numbers() if shown else [], dtype="<f4").ravel()
            now = (shown, values.tobytes(), item.words)
            if whole or self._sent.get(k) != now:
                self._sent[k] = now
                rows.append([k, int(shown), len(values), item.words])
                numbers.append(values)
        return rows, np.concatenate(numbers) if numbers else np.empty(0, "<f4")


def _grid(half, height):
    """Lines of a floor, (n, 3), with a gap after each: some ten of a round distance across."""
    step = 10.0 ** np.floor(np.log10(half / 2))
    step *= next(m for m in (1, 2, 5, 10) if half / (m * step) <= 6)
    marks = step * np.arange(-np.floor(half / step), np.floor(half / step) + 1)
    ends, gap = marks[[0, -1]], [np.nan] * 3
    lines = [[(*p, height) for p in line] + [gap] for m in marks
             for line in ([(m, ends[0]), (m, ends[1])], [(ends[0], m), (ends[1], m)])]  # fmt: skip
    return np.array(lines).reshape(-1, 3)


def _as_points(values, called):
    values = np.asarray(values, dtype=float)
    if values.shape[-1:] != (3,) or values.ndim > 2:
        raise ValueError(f"{called}: points in space must have shape (n, 3), got {values.shape}")
    return values


def as_pose(T, called):
    """A pose, (4, 4), that a page can draw; ValueError names what is none."""
    T = np.asarray(T, dtype=float)
    if T.shape != (4, 4) or not _drawable(T):
        told = _undrawable(T) if T.shape == (4, 4) else f"shape {T.shape}"
        raise ValueError(f"{called}: a pose must be a finite (4, 4) matrix, got {told}")
    return T


def _drawable(values):
    """Whether a page, which counts in float32, can draw with all of the numbers."""
    return bool((np.abs(values) < FARTHEST).all())  # NaN is not less


def _undrawable(values):
    return f"a number of {FARTHEST:g} or more" if np.isfinite(values).all() else "a number that is not finite"


def _pair(color):
    return [style.themed(color, False), style.themed(color, True)]


_AXES = [_pair(color) for color in style.AXES]


class _Item:
    value, shown, words, called, artists = None, True, None, "a path", ()

    def show(self, on=True):
        """In sight or not."""
        self.shown = bool(on)

    def numbers(self):
        return self.value


class _Points(_Item):
    def __init__(self, scene, looks):
        self.scene, self.looks = scene, looks
        (self.artist,) = scene.ax.plot([], [], **looks)
        self.artists = [self.artist]

    def set(self, value):
        self.value = _as_points(value, self.called)

    def draw(self, view):
        right, up, toward = view.project(np.atleast_2d(self.value)).T
        self.artist.set_data(right, up)
        self.artist.set_zorder(self.scene.depth(np.nanmean(toward)) if np.isfinite(toward).any() else 2)

    def describe(self):
        line = self.artist
        return described_path(
            line.get_color(), line.get_linewidth(), self.looks.get("linestyle", "-"), line.get_alpha(),
            line.get_marker(), line.get_markersize(), line.get_markerfacecolor(),
        )  # fmt: skip


def described_path(color, width, linestyle, alpha=None, marker="None", size=0.0, face=None):
    """A path for the browser: widths and sizes in CSS pixels."""
    drawn = linestyle not in ("none", "None", "")
    dash = DASHES[linestyle] if isinstance(linestyle, str) else 1
    return {
        "kind": "path", "color": _pair(color), "opacity": 1.0 if alpha is None else float(alpha), "dash": dash,
        "width": round(PIXELS_PER_POINT * width, 2) if drawn else 0,
        "marker": "" if marker in ("None", "none", None, "") else str(marker),
        "size": round(PIXELS_PER_POINT * size, 2), "hollow": isinstance(face, str) and face == "none",
    }  # fmt: skip


class _FadingLine(_Item):
    def __init__(self, scene, looks):
        self.scene, self.looks = scene, dict(looks)
        color = looks.pop("color", style.INK)
        self.color = to_rgba(color)
        self.artist = LineCollection([], capstyle="round", **looks)
        scene.ax.add_collection(self.artist, autolim=False)
        self.artists = [self.artist]

    def set(self, value):
        self.value = _as_points(value, self.called)

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

    def describe(self):
        looks = self.looks
        return described_path(
            looks.get("color", style.INK), looks.get("linewidth", 1.5), looks.get("linestyle", "-"), looks.get("alpha")
        )


class _Text(_Item):
    called = "words"

    def __init__(self, scene, text, offset, looks):
        self.scene, self.words = scene, text
        self.artist = scene.ax.annotate(
            text, (0, 0), xytext=offset, textcoords="offset points", annotation_clip=False, **{"zorder": 4, **looks}
        )
        self.artists = [self.artist]

    def set(self, value, text=None):
        self.value = _as_points(value, self.called)
        if text is not None:
            self.words = text
            self.artist.set_text(text)

    def draw(self, view):
        self.artist.xy = tuple(view.project(self.value)[:2])

    def describe(self):
        return {"kind": "text", **_label(self.artist)}


def _label(words):
    """An annotation for the browser: offset in CSS pixels right and up, how it is set, its color."""
    return {
        "offset": [round(PIXELS_PER_POINT * v, 2) for v in words.xyann], "align": words.get_ha(),
        "baseline": words.get_va(), "bold": words.get_fontweight() == "bold",
        "size": words.get_fontsize() / 10, "color": _pair(words.get_color()),
    }  # fmt: skip


class _Ellipsoid(_Item):
    called = "an ellipsoid"

    def __init__(self, scene, looks):
        (self.artist,) = scene.ax.plot([], [], **looks)
        self.scene, self.artists = scene, [self.artist]

    def set(self, center, shape):
        center, shape = _as_points(center, self.called), np.asarray(shape, dtype=float)
        if center.shape != (3,) or shape.shape != (3, 3) or not (_drawable(center) and _drawable(shape)):
            raise ValueError(f"{self.called}: center (3,) and shape (3, 3) must be finite, and below {FARTHEST:g}")
        self.value, self.shape = center, shape

    def draw(self, view):
        right, up, toward = view.project(self.value)
        values, vectors = np.linalg.eigh(view.axes[:2] @ self.shape @ view.axes[:2].T)
        near = view.zoom / max(1 - toward / view.eye, 0.05)
        outline = near * CIRCLE @ (vectors * np.sqrt(np.maximum(values, 0))).T + (right, up)
        self.artist.set_data(*outline.T)
        self.artist.set_zorder(self.scene.depth(toward))

    def describe(self):
        ball = solids.sphere(1.0, ROUND_PIECES).looks(self.artist.get_color(), 0.22)
        return {"kind": "body", "parts": [ball.describe()]}

    def numbers(self):
        values, vectors = np.linalg.eigh(self.shape)
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = vectors * np.sqrt(np.maximum(values, 0)), self.value
        return T


class _Triad(_Item):
    def __init__(self, scene, name, length, linestyle, linewidth):
        self.scene, self.length, self.linestyle, self.linewidth = scene, length, linestyle, linewidth
        self.called = f"the frame {name}".rstrip()
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

    def set(self, T):
        self.value = as_pose(T, self.called)

    def draw(self, view):
        R, origin = self.value[:3, :3], self.value[:3, 3]
        start, tips = view.project(origin), view.project(origin + self.length * R.T)
        for line, letter, tip in zip(self.lines, self.letters, tips):
            line.set_data([start[0], tip[0]], [start[1], tip[1]])
            line.set_zorder(self.scene.depth(tip[2]))
            line.set_alpha(self.scene.alpha(tip[2]) ** 0.5)
            letter.set_position(tip[:2] + 0.13 * (tip - start)[:2])
        self.name.xy = tuple(start[:2])

    def describe(self):
        return {
            "kind": "triad", "length": float(self.length), "name": self.name.get_text(), "label": _label(self.name),
            "broken": self.linestyle != "-", "width": round(PIXELS_PER_POINT * self.linewidth, 2),
            "axes": _AXES,
        }  # fmt: skip


class _Body(_Item):
    """Solids that move as one. `value` is the pose; it may stretch."""

    def __init__(self, scene, parts, name):
        if not parts:
            raise ValueError("a body needs at least one solid")
        self.scene, self.parts, self.called, self._mesh = scene, parts, name or "a body", None
        scene.add_faces()

    def set(self, T):
        self.value = as_pose(T, self.called)

    def draw(self, view):
        """All bodies of the scene are drawn together."""

    @property
    def drawable(self):
        return self.shown and self.value is not None

    def describe(self):
        return {"kind": "body", "parts": [part.describe() for part in self.parts]}

    def corners(self):
        """Corners of its triangles where it is now, (n, 3, 3)."""
        mesh = np.concatenate([part.triangles() for part in self.parts])
        return mesh @ self.value[:3, :3].T + self.value[:3, 3]

    def faces(self, view):
        """Its triangles on the screen that look toward the eye, (n, 3, 3), and their colors, (n, 4)."""
        if self._mesh is None:
            meshes = [part.triangles() for part in self.parts]
            colors = [(*to_rgb(part.color), part.opacity) for part in self.parts]
            self._mesh = np.concatenate(meshes), np.repeat(colors, [len(m) for m in meshes], axis=0)
        corners, colors = self._mesh
        seen = view.project(corners @ self.value[:3, :3].T + self.value[:3, 3])
        normals = np.cross(seen[:, 1] - seen[:, 0], seen[:, 2] - seen[:, 0])
        front = normals[:, 2] > 0
        normals = normals[front] / np.linalg.norm(normals[front], axis=1, keepdims=True)
        light = 0.62 + 0.38 * np.clip(normals @ LIGHT, 0, 1)
        return seen[front], np.column_stack([colors[front, :3] * light[:, None], colors[front, 3]])


class _Rod(_Body):
    def __init__(self, scene, solid, radius, name):
        super().__init__(scene, (solid,), name)
        self.radius = radius

    def set(self, start, end):
        start, end = (_as_points(v, self.called) for v in (start, end))
        super().set(solids.between(start, end, self.radius))


class _Arrow:
    """A shaft and a tip that is never longer than the arrow."""

    def __init__(self, shaft, tip, length):
        self.shaft, self.tip, self.length = shaft, tip, length

    def set(self, start, end):
        way = np.subtract(end, start)
        whole = np.linalg.norm(way)
        neck = np.asarray(end, dtype=float) - way * min(1.0, self.length / max(whole, 1e-12))
        self.shaft.set(start, neck)
        self.tip.set(neck, end)

    def show(self, on=True):
        self.shaft.show(on)
        self.tip.show(on)
