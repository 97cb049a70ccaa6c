"""How a figure is drawn on Agg: words as bitmaps that are kept, and every color exchanged for the dark theme.

The kept words need four names of matplotlib's that are not public. A release without them draws its words itself: a
picture takes longer, and looks the same. All else stands on public functions.
"""

import numpy as np
from matplotlib.backend_bases import GraphicsContextBase
from matplotlib.backends import backend_agg
from matplotlib.backends.backend_agg import FigureCanvasAgg, RendererAgg
from matplotlib.colors import to_rgba
from matplotlib.ft2font import FT2Font

from . import style

MAX_WORDS = 3000  # bitmaps a figure keeps


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


class _KeptWords(RendererAgg):
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
            font.set_text(s, 0.0, flags=backend_agg.get_hinting_flag())
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
        super().set_foreground(_dark(fg if isRGBA else to_rgba(fg)), isRGBA=True)


class _DarkColors:
    """Every color of `style.DARK` exchanged at the moment of drawing, so that figures stay free of themes."""

    def __init__(self, *args):
        super().__init__(*args)
        markers, collection = self.draw_markers, self.draw_path_collection  # Agg's own, set for this instance alone

        def draw_markers(gc, marker_path, marker_trans, path, trans, rgbFace=None):
            markers(gc, marker_path, marker_trans, path, trans, _dark(rgbFace))

        def draw_path_collection(
            gc, transform, paths, all_transforms, offsets, offset_trans, faces, edges, *args, **kw
        ):
            collection(gc, transform, paths, all_transforms, offsets, offset_trans,
                       _dark_rows(faces), _dark_rows(edges), *args, **kw)  # fmt: skip

        self.draw_markers, self.draw_path_collection = draw_markers, draw_path_collection

    def new_gc(self):
        return _DarkContext()

    def draw_path(self, gc, path, transform, rgbFace=None):
        super().draw_path(gc, path, transform, _dark(rgbFace))


class _DarkKeptWords(_DarkColors, _KeptWords):
    """Dark, with kept words."""


class _DarkAgg(_DarkColors, RendererAgg):
    """Dark, with the words matplotlib draws."""


def can_keep_words(backend=backend_agg, font=FT2Font):
    """Whether this release of matplotlib has all that `_KeptWords` takes from it without being promised it."""
    agg = backend.RendererAgg
    return (
        hasattr(backend, "get_hinting_flag")
        and hasattr(agg, "_prepare_font")
        and hasattr(getattr(agg(1, 1, 72), "_renderer", None), "draw_text_image")
        and hasattr(font, "get_bitmap_offset")
    )


def renderers(keep_words):
    """The renderer of the light and of the dark theme: (light, dark)."""
    return (_KeptWords, _DarkKeptWords) if keep_words else (RendererAgg, _DarkAgg)


class Canvas(FigureCanvasAgg):
    """The canvas of a figure that is drawn light, or dark once `dark` is set."""

    dark = False
    renderers = renderers(can_keep_words())
    _drawn_as, _made = None, {}

    def get_renderer(self):
        drawn_as = *self.get_width_height(physical=True), self.figure.dpi
        if drawn_as != self._drawn_as:
            self._drawn_as, self._made = drawn_as, {}
        if self.dark not in self._made:
            self._made[self.dark] = self.renderers[self.dark](*drawn_as)
        self.renderer = self._made[self.dark]
        return self.renderer

    def forget(self):
        """Let go of the renderer and its pixels, which each text holds as well; the next drawing makes another."""
        self.renderer, self._drawn_as, self._made = None, None, {}
        for artist in self.figure.findobj(lambda artist: getattr(artist, "_renderer", None) is not None):
            artist._renderer = None
