"""How a figure is drawn on Agg: words as bitmaps that are kept, and every color exchanged for the dark theme.

The kept words need four names of matplotlib's that are not public. A release without them draws its words itself: a
picture takes longer, and looks the same. All else stands on public functions.
"""

import weakref

import numpy as np
from matplotlib.backend_bases import GraphicsContextBase
from matplotlib.backends import backend_agg
from matplotlib.backends.backend_agg import FigureCanvasAgg, RendererAgg
from matplotlib.colors import to_rgba
from matplotlib.ft2font import FT2Font

from . import style

MAX_WORDS = 3000  # bitmaps a figure keeps
LETTERS = {
    *map(chr, range(32, 127)),
    "\N{MINUS SIGN}",
    "\N{DEGREE SIGN}",
    "\N{PLUS-MINUS SIGN}",
}  # that words are made of


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


class _Letters:
    """The letters of one font in one size. Hinting sets each on a whole pixel, so that words put together from their
    bitmaps are, pixel by pixel, those that the font sets.

    font : function() -> FT2Font, ready to set text; asked each time, for the sizes of a font share it.
    """

    def __init__(self, font):
        self.font, self.flags = font, backend_agg.get_hinting_flag()
        self.alone, self.steps = {}, {}

    def set(self, s):
        """(bitmap, left end of the ink, width, top over the baseline, depth below it) of a word, in 1/64 pixel."""
        font = self.font()
        font.set_text(s, 0.0, flags=self.flags)
        (width, height), descent = font.get_width_height(), font.get_descent()
        font.draw_glyphs_to_bitmap(antialiased=True)
        return np.array(font.get_image()), font.get_bitmap_offset()[0], width, height - descent, descent

    def compose(self, s):
        """The same from the bitmaps of its letters; None where one does not follow another by whole pixels."""
        if not s or not LETTERS.issuperset(s):
            return None
        pens = [0]
        for a, b in zip(s, s[1:]):
            step = self._step(a, b)
            if step is None:
                return None
            pens.append(pens[-1] + step)
        letters = [self._alone(c) for c in s]
        left = min(64 * pen * (c != " ") + letter[1] for c, pen, letter in zip(s, pens, letters))  # a space begins at 0
        top, descent = (max(letter[k] for letter in letters) for k in (3, 4))
        places = [
            (_row(top, letter[3]) - _row(letter[3], letter[3]), int(pen + letter[1] // 64 - left / 64))
            for pen, letter in zip(pens, letters)
        ]
        sizes = [letter[0].shape for letter in letters]
        word = np.zeros(np.max(np.add(places, sizes), axis=0), np.uint8)
        for (down, right), (rows, columns), letter in zip(places, sizes, letters):
            word[down : down + rows, right : right + columns] |= letter[0]
        return word[: (top + descent) // 64 + 2], left, 64 * pens[-1] + letters[-1][2], top, descent

    def _alone(self, letter):
        if letter not in self.alone:
            self.alone[letter] = self.set(letter)
        return self.alone[letter]

    def _step(self, a, b):
        """Pixels from a letter to the one that follows it; None if they are not whole, or both become one."""
        if (a, b) not in self.steps:
            pens = self.font().set_text(a + b, 0.0, flags=self.flags)
            whole = len(pens) == 2 and pens[1][0] % 64 == 0
            self.steps[a, b] = int(pens[1][0]) // 64 if whole else None
        return self.steps[a, b]


def _row(top_of_word, top):
    """The row of a word's bitmap at which a letter begins, as matplotlib rounds it; both in 1/64 pixel."""
    return int(top_of_word / 64 + top // -64 + 1)


class _KeptWords(RendererAgg):
    """Agg that keeps the bitmaps of the words it has drawn: ten letters take matplotlib more than 1 ms. A new word, as
    the next value of a number, is put together from letters. The heights of a font are kept as well, which it would
    read from the font's tables for every text.
    """

    def __init__(self, *args):
        super().__init__(*args)
        self._words, self._heights, self._letters = {}, {}, {}

    def _word(self, s, prop):
        """(bitmap, left, down, width, height, descent) of a word at its own baseline, in pixels."""
        key = s, hash(prop)
        if key not in self._words:
            if len(self._words) >= MAX_WORDS:
                self._words.clear()
            letters = self._letters.get(key[1])
            if letters is None:
                prepare = weakref.WeakMethod(self._prepare_font)  # a ring of references would keep the pixels: `forget`
                letters = self._letters[key[1]] = _Letters(lambda: prepare()(prop))
            bitmap, left, width, top, descent = letters.compose(s) or letters.set(s)
            self._words[key] = bitmap, left / 64, descent / 64, width / 64, (top + descent) / 64, descent / 64
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
