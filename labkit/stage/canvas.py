"""A matplotlib figure kept alive on Agg: what moves is drawn over a kept background, in the theme's colors, and only
the pixels that changed travel to the browser.

A full redraw of a figure costs 40 ms and more, mostly for ticks and labels; restoring the background and drawing the
moving artists costs 1 to 6 ms. Of 300,000 pixels a drag changes 2,000 to 15,000: finding them takes 0.3 ms and
setting them in the page less than 1 ms, where a whole picture takes 2 ms to deflate and 4 to 8 ms to decode. Whole
pictures go first and whenever too much changes: PNG without row filters, deflated at level 1, takes 2 ms for 700 x 400
pixels, against 12 ms by Pillow at level 1 and 9 ms as WebP.
"""

import struct
import threading
import zlib
from time import monotonic

import numpy as np
from matplotlib.backend_bases import GraphicsContextBase
from matplotlib.backends.backend_agg import FigureCanvasAgg, RendererAgg, get_hinting_flag
from matplotlib.figure import Figure

from . import style

CSS_DPI = 100  # a figure inch is 100 CSS pixels: 10 pt text is as large as the notebook's own
MAX_RATIO = 2.5  # device pixels per CSS pixel; sharper screens see no difference
MIN_SCALE = 0.85  # a narrower cell shrinks the whole picture, letters too, instead of crowding it further
MAX_WORDS = 3000  # bitmaps a figure keeps
MAX_CHANGES = 150_000  # pixels, four bytes each; beyond, decoding a whole picture is the quicker way
MAX_PASSES = 4  # of the layout, which halves its error in each

DRAWING = (
    threading.RLock()
)  # widget messages may arrive on another thread than the cells, and matplotlib is not thread-safe


def _dark(rgba):
    """One color with its dark counterpart; alpha stays."""
    if rgba is None:
        return None
    rgb = tuple(rgba[:3])
    return (*style.DARK_RGB.get(rgb, rgb), *rgba[3:])


def _dark_rows(colors):
    colors = np.array(colors, dtype=float)
    if colors.size:
        light = colors.copy()
        for rgb, dark in style.DARK_RGB.items():
            colors[(light[:, :3] == rgb).all(-1), :3] = dark
    return colors


class _Renderer(RendererAgg):
    """Agg that keeps the bitmaps of the words it has drawn: ten letters take matplotlib more than 1 ms. The heights of
    a font are kept as well, which it would read from the font's tables for every text.
    """

    def __init__(self, *args):
        super().__init__(*args)
        self._words, self._heights = {}, {}

    def _word(self, s, prop):
        """(bitmap, left, down, width, height, descent) of a word at its own baseline, in pixels."""
        key = s, hash(prop)
        if key not in self._words:
            font = self._prepare_font(prop)
            font.set_text(s, 0.0, flags=get_hinting_flag())
            width, height = font.get_width_height()
            descent = font.get_descent()
            font.draw_glyphs_to_bitmap(antialiased=True)
            left, down = font.get_bitmap_offset()
            if len(self._words) >= MAX_WORDS:
                self._words.clear()
            self._words[key] = (
                np.array(font.get_image()), left / 64, (down + descent) / 64, width / 64, height / 64, descent / 64
            )  # fmt: skip
        return self._words[key]

    def _get_font_height_metrics(self, prop):
        """(ascent, descent, line gap) of a font in pixels, three times None if unknown: `Text` asks here first."""
        key = hash(prop)
        if key not in self._heights:
            font = self._prepare_font(prop)
            head, table = font.get_sfnt_table("head"), font.get_sfnt_table("OS/2")
            scale = self.points_to_pixels(prop.get_size_in_points()) / head["unitsPerEm"]
            self._heights[key] = (None, None, None) if table is None else (
                table["sTypoAscender"] * scale, -table["sTypoDescender"] * scale, table["sTypoLineGap"] * scale
            )  # fmt: skip
        return self._heights[key]

    def draw_text(self, gc, x, y, s, prop, angle, ismath=False, mtext=None):
        if ismath or angle:
            return super().draw_text(gc, x, y, s, prop, angle, ismath, mtext)
        bitmap, left, down = self._word(s, prop)[:3]
        self._renderer.draw_text_image(bitmap, round(x + left), round(y + down) + 1, 0, gc)

    def get_text_width_height_descent(self, s, prop, ismath):
        if ismath:
            return super().get_text_width_height_descent(s, prop, ismath)
        return self._word(s, prop)[3:]


class _DarkContext(GraphicsContextBase):
    def set_foreground(self, fg, isRGBA=False):
        super().set_foreground(fg, isRGBA)
        self._rgb = _dark(self._rgb)


class _DarkRenderer(_Renderer):
    """Agg with every color of `style.DARK` exchanged at the moment of drawing, so that figures stay free of themes."""

    def new_gc(self):
        return _DarkContext()

    def draw_path(self, gc, path, transform, rgbFace=None):
        super().draw_path(gc, path, transform, _dark(rgbFace))

    def _update_methods(self):
        super()._update_methods()
        markers, collection = self.draw_markers, self.draw_path_collection

        def draw_markers(gc, marker_path, marker_trans, path, trans, rgbFace=None):
            markers(gc, marker_path, marker_trans, path, trans, _dark(rgbFace))

        def draw_path_collection(
            gc, transform, paths, all_transforms, offsets, offset_trans, faces, edges, *args, **kw
        ):
            collection(gc, transform, paths, all_transforms, offsets, offset_trans,
                       _dark_rows(faces), _dark_rows(edges), *args, **kw)  # fmt: skip

        self.draw_markers, self.draw_path_collection = draw_markers, draw_path_collection


class _Canvas(FigureCanvasAgg):
    dark = False

    def get_renderer(self):
        width, height = self.get_width_height(physical=True)
        key = width, height, self.figure.dpi, self.dark
        if key != self._lastKey:
            self.renderer = (_DarkRenderer if self.dark else _Renderer)(width, height, self.figure.dpi)
            self._lastKey = key
        return self.renderer


class Picture:
    """One figure, its moving artists and its background.

    Parameters
    ----------
    scene : function(fig) -> (artists, update)
        Draws everything once. `artists` are the moving ones, `update(...)` sets them in place.
    size : (width, height)
        In inches of 100 CSS pixels: the largest width at which the picture is shown; narrower cells keep the
        proportions.
    """

    def __init__(self, scene, size):
        self.size = size
        self.width, self.ratio = size[0] * CSS_DPI, 1.0
        self.fig = Figure(figsize=size, dpi=CSS_DPI, layout="constrained")
        self.canvas = _Canvas(self.fig)
        with DRAWING, style.rc():
            self.fig.set(facecolor=style.PAPER)
            self.artists, self.update = scene(self.fig)
        self.artists = list(self.artists)
        for artist in self.artists:
            artist.set_animated(True)
            artist.set_in_layout(False)  # what moves must not push the axes about
        self._background = self._sent = None
        self.draw_seconds = 0.0

    @property
    def dark(self):
        return self.canvas.dark

    def fit(self, width, ratio, dark):
        """Adopt the width of the cell (CSS pixels), the device's pixel ratio and the theme."""
        width = min(max(float(width), 120.0), self.size[0] * CSS_DPI)
        ratio = min(max(float(ratio), 1.0), MAX_RATIO)
        if bool(dark) != self.dark:
            self.canvas.dark, self._background = bool(dark), None
        if (width, ratio) == (self.width, self.ratio):
            return
        self.width, self.ratio = width, ratio
        inches = max(width / CSS_DPI, MIN_SCALE * self.size[0])
        self.fig.set_dpi(width * ratio / inches)
        self.fig.set_size_inches(inches, inches * self.size[1] / self.size[0])
        self.fig.set_layout_engine("constrained")
        self._background = None

    def _draw_background(self):
        with style.rc():
            self._lay_out()
            self.canvas.draw()
        self._background = self.canvas.copy_from_bbox(self.fig.bbox)
        self.fig.stale = False

    def _lay_out(self):
        """Place the axes once a size: a layout at every change of limits would make them jump.

        Each pass starts from where the axes stand and comes nearer to where they stay. They are there when a pass moves
        them by less than half a pixel; going back and forth between two widths then moves nothing.
        """
        engine = self.fig.get_layout_engine()
        if engine is None:
            return
        before = np.inf
        for _ in range(MAX_PASSES):
            engine.execute(self.fig)
            places = np.array([ax.get_position().bounds for ax in self.fig.axes]) * self.fig.bbox.width
            if np.abs(places - before).max() < 0.5:
                break
            before = places
        self.fig.set_layout_engine("none")

    def draw(self):
        """Draw, anew only what has to be; returns the pixels, array of shape (height, width, 4)."""
        with DRAWING:
            start = monotonic()
            if self._background is None or self.fig.stale:
                self._draw_background()
            renderer = self.canvas.get_renderer()
            renderer.restore_region(self._background)
            for artist in sorted(self.artists, key=lambda a: a.zorder):
                artist.draw(renderer)
            self.draw_seconds = monotonic() - start
            return np.asarray(renderer.buffer_rgba())

    def png(self):
        """The picture as PNG bytes."""
        with DRAWING:
            return encode_png(self.draw(), self.fig.dpi)

    def news(self, whole=False):
        """What the browser lacks since the last call: [png], or [runs, colors] of the changed pixels."""
        with DRAWING:
            pixels, before = self.draw(), self._sent
            self._sent = pixels.copy()
            found = None if whole or before is None else changes(before, self._sent)
            return [encode_png(pixels, self.fig.dpi)] if found is None else list(found)

    # -- where things are: fractions of the picture, from its upper left corner, as the browser counts

    def fraction(self, ax, xy):
        """Fractions (right, down) of the picture at data coordinates `xy` of an axes."""
        x, y = ax.transData.transform(xy)
        return float(x / self.fig.bbox.width), float(1 - y / self.fig.bbox.height)

    def data(self, ax, fraction):
        """Data coordinates of an axes at fractions (right, down) of the picture; (..., 2) -> (..., 2)."""
        right, down = np.moveaxis(np.asarray(fraction, dtype=float), -1, 0)
        pixels = np.stack([right * self.fig.bbox.width, (1 - down) * self.fig.bbox.height], -1)
        return ax.transData.inverted().transform(pixels)


def changes(before, after):
    """Runs of changed pixels: first place (counted along the rows) and length of each, shape (n, 2), and their colors
    one after the other, both uint32; None if the shapes differ or too many pixels do.

    before, after : RGBA pixels, shape (height, width, 4), uint8.
    """
    if before.shape != after.shape:
        return None
    colors = after.view("<u4").ravel()
    places = np.flatnonzero(before.view("<u4").ravel() != colors)
    if len(places) > MAX_CHANGES:
        return None
    first = np.flatnonzero(np.diff(places, prepend=-2) > 1)
    runs = np.column_stack([places[first], np.diff(first, append=len(places))])
    return runs.astype("<u4"), colors[places]


def encode_png(pixels, dpi=CSS_DPI):
    """PNG of RGBA pixels, shape (height, width, 4), uint8: no row filters, deflate level 1."""
    height, width = pixels.shape[:2]
    rows = np.zeros((height, 1 + 4 * width), np.uint8)
    rows[:, 1:] = pixels.reshape(height, -1)

    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    per_meter = round(dpi / 0.0254)
    return b"".join((
        b"\x89PNG\r\n\x1a\n",
        chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)),
        chunk(b"pHYs", struct.pack(">IIB", per_meter, per_meter, 1)),
        chunk(b"IDAT", zlib.compress(rows, 1)),
        chunk(b"IEND", b""),
    ))  # fmt: skip
