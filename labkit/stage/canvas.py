"""A matplotlib figure kept alive on Agg: what moves is drawn over a kept background, in the theme's colors, and only
the pixels that changed travel to the browser.

A full redraw of a figure costs 40 ms and more, mostly for ticks and labels; restoring the background and drawing the
moving artists costs 1 to 6 ms. Of 300,000 pixels a drag changes 2,000 to 15,000: finding them takes 0.3 ms and
setting them in the page less than 1 ms, where a whole picture takes 2 ms to deflate and 4 to 8 ms to decode. Whole
pictures go first and whenever too much changes: PNG without row filters, deflated at level 1, takes 2 ms for 700 x 400
pixels, against 12 ms by Pillow at level 1 and 9 ms as WebP.
"""

import contextlib
import io
import struct
import threading
import warnings
import zlib
from time import monotonic

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from PIL import Image

from . import style
from .renderer import Canvas
from .room import LEGIBLE, LETTERS, LOW, NARROW, PANEL, SLENDER, Legends, Panels, Words, break_lines

CSS_DPI = 100  # a figure inch is 100 CSS pixels: 10 pt text is as large as the notebook's own
MAX_PIXELS = 5e6  # of a picture; beyond, a sharper screen gets fewer of its pixels
SMALLEST = 9.0  # CSS pixels of the smallest letters in any place; a lower one scrolls
TALLER = (1.2, 1.45, 1.75, 2.1, 2.5, 3.0)  # times the height of such a place
ROOMY = 0.85  # of the designed size: down to it letters keep their size, and below as much of it as they can
MAX_STRETCH = 1.6  # a low place makes the picture so much wider than designed, but no wider
WIDEST = 3.2  # width of panels that a low place puts beside each other, as a multiple of their height
STORED_WIDTH, STORED_COLORS = 700, 48  # pixels and colors of a picture in a file
RING = 13  # points across the ring of a handle in such a picture
MAX_CHANGES = 150_000  # pixels, four bytes each; beyond, decoding a whole picture is the quicker way
HOLLOW, CHECK = "\N{WHITE CIRCLE}", "\N{CHECK MARK}"
MAX_PASSES = 4  # of the layout, which halves its error in each

DRAWING = (
    threading.RLock()
)  # widget messages may arrive on another thread than the cells, and matplotlib is not thread-safe


class Picture:
    """One figure, its moving artists and its background.

    Parameters
    ----------
    scene : function(fig) -> (artists, update)
        Draws everything once. `artists` are the moving ones, `update(...)` sets them in place.
    size : (width, height)
        In inches of 100 CSS pixels, as designed; the picture takes the room it is given and keeps its letters' size.
    """

    def __init__(self, scene, size):
        self.size = size
        self.width, self.height, self._room = size[0] * CSS_DPI, size[1] * CSS_DPI, None
        self.fig = Figure(figsize=size, dpi=CSS_DPI, layout="constrained")
        self.canvas = Canvas(self.fig)
        with DRAWING, style.rc():
            self.fig.set(facecolor=style.PAPER)
            self.artists, self.update = scene(self.fig)
        self.artists = list(self.artists)
        for artist in self.artists:
            artist.set_animated(True)
            artist.set_in_layout(False)  # what moves must not push the axes about
        self._backgrounds, self._sent = {}, None  # a background a theme
        self._heading = None
        self.panels = Panels(self.fig)
        self._words = self._legends = None  # how far apart they were designed, and in how many columns
        self._moving = set(self.artists)
        self.draw_seconds, self._laid_out = 0.0, False
        self.spaces = [ax.space for ax in self.fig.axes if hasattr(ax, "space")]
        self._in_space = {id(artist) for space in self.spaces for artist in space.artists}

    @property
    def dark(self):
        return self.canvas.dark

    def head(self, words, marked):
        """A line over the picture with a hollow mark, or with a check mark and bold; it belongs to the background."""
        line, look = f"{CHECK if marked else HOLLOW} {words}", "bold" if marked else "normal"
        if self._heading is None:
            with style.rc():
                self._heading = self.fig.suptitle(line, x=0.01, ha="left", fontsize=10, fontweight=look)
        elif self._heading.get_text() != line:
            self._heading.set(text=line, fontweight=look)

    @property
    def painted(self):
        """Whether the scenes in space are drawn here, too; else the page draws them."""
        return all(space.painted for space in self.spaces)

    def paint(self, on):
        """Draw the scenes in space here, too, or leave them to the page; returns what was done before."""
        before = self.painted
        for space in self.spaces:
            if space.painted != on:
                space.painted = on
                space.redraw()
        return before

    def fit(self, width, height, ratio, dark, letters=1.0, space=False):
        """Adopt a room of width x height (CSS pixels), the device's pixel ratio, the theme, the size of the letters
        around, as a multiple of the designed one, and whether the page draws scenes in space itself.
        """
        self.paint(not space)
        self.canvas.dark = bool(dark)
        room = max(float(width), 120.0), max(float(height), 120.0), float(ratio), float(letters)
        if room == self._room:
            return
        self._room = room
        width, height, ratio, letters = room
        whole = CSS_DPI * letters * np.array(self.size)
        if self._words is None and min([width, height] / whole) < 1:
            self.draw()  # as large as it is so far, its words are where they were designed
            self._words, self._legends = Words(self.fig), Legends(self.fig)
        narrow, low = width < NARROW * whole[0], height < LOW * whole[1]
        self.panels.arrange(self.panels.best(narrow, low))
        break_lines(self.fig, narrow or low, self._moving)
        self._take_shape(width, height, narrow)
        least = min(1.0, *([self.width, self.height] / (ROOMY * whole)))
        least_letters = min(1.0, SMALLEST / (letters * self._smallest()))
        on_a_line, small = None, min([width, height] / whole) < 1
        for share, growth, folded, taller in self._tries(least, small, least_letters):
            self._take_letters(room, narrow, share, growth, folded, taller)
            fits = least == 1 or self._fits()
            if fits:
                break
            if fits is None and on_a_line is None and share >= LETTERS[-1]:
                on_a_line = share, growth, folded, taller
            if on_a_line and share <= max(LEGIBLE, least_letters) and folded:
                self._take_letters(room, narrow, *on_a_line)  # a legend on a line hides less than letters too small
                break
        self._backgrounds = {}

    def _smallest(self):
        """The smallest letters of the picture as designed, in CSS pixels."""
        sizes = [text.get_fontsize() for text in self.fig.findobj(Text) if text.get_text().strip()]
        return CSS_DPI / 72 * min(sizes, default=10)

    def _take_letters(self, room, narrow, share, growth, folded, taller):
        """Draw for a room, or one some times as high, with letters of a share of their size, legends folded or not."""
        width, height, ratio, letters = room
        self._take_shape(width, taller * height, narrow, growth)
        self._scale(letters * share, min(max(ratio, 1.0), np.sqrt(MAX_PIXELS / (self.width * self.height))))
        if self._legends:
            self._legends.fold(self.panels.share if folded else None)

    def _take_shape(self, width, height, narrow, growth=0.0):
        """Width and height (CSS pixels) of the picture in a room; panels under each other may grow beyond it."""
        aspect = self.size[1] / self.size[0]
        if self.panels.way == "column":
            low, high = (share * self.panels.count * width for share in PANEL)
            height = np.clip(height, low, high)
            height += growth * (high - height)
        elif self.panels.way == "row":
            width = min(width, WIDEST * height)
        else:
            low, high = SLENDER[self.panels.rows > 1] if narrow else (0.0, 0.0)
            height = min(height, width * max(aspect, low + growth * (high - low)))
            width = min(width, MAX_STRETCH * height / aspect)
        self.width, self.height = round(width), round(height)

    def _tries(self, least, small, least_letters):
        """(size of the letters, growth, whether legends are folded, times the height of the room) from the best to the
        one that always goes: all shrunk alike, in a place that scrolls where the letters would be too small.
        """
        if self.panels.way == "column":
            tries = [(1.0, 0.0), *((share, 1.0) for share in LETTERS)]
        else:
            tries = [(share, float(share < 1)) for share in LETTERS if share > least]
            tries += [(least, 1.0), (ROOMY * least, 1.0)]
        shares = [one for one in tries if one[0] > least_letters]
        folds = (False, True) if least < 1 else (small,)
        found = [(*one, folded, 1.0) for one in shares or [(1.0, 0.0)] for folded in folds]
        if len(shares) < len(tries):
            found += [(least_letters, 1.0, True, taller) for taller in (1.0, *TALLER)]
        return found

    def _scale(self, letters, ratio):
        self.fig.set_dpi(CSS_DPI * letters * ratio)
        self.fig.set_size_inches(self.width / (CSS_DPI * letters), self.height / (CSS_DPI * letters))
        self.fig.set_layout_engine("constrained")
        self._laid_out = False

    def _fits(self):
        """Whether all words stand apart; None where a legend lies on a line, and nothing else is wrong."""
        with style.rc(), warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            self._lay_out()
            return not said and self._words.fit()

    def _draw_background(self):
        with style.rc():
            self._lay_out()
            self.canvas.draw()
            if any(ax.yaxis.label.get_window_extent().x0 < 0 for ax in self.fig.axes if ax.get_ylabel()):
                self.fig.set_layout_engine("constrained")  # wider numbers have pushed a name out: this once all moves
                self._lay_out()
                self.canvas.draw()
        self._backgrounds[self.dark] = self.canvas.copy_from_bbox(self.fig.bbox)
        self.fig.stale = False

    def _stand(self):
        """The axes stand where they will be drawn, also before the first drawing."""
        if not self._laid_out:
            with DRAWING, style.rc():
                self._lay_out()

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
        self._laid_out = True

    def draw(self):
        """Draw, anew only what has to be; returns the pixels, array of shape (height, width, 4)."""
        with DRAWING:
            start = monotonic()
            if self.fig.stale:
                self._backgrounds = {}
            if self.dark not in self._backgrounds:
                self._draw_background()
            renderer = self.canvas.get_renderer()
            renderer.restore_region(self._backgrounds[self.dark])
            hidden = set() if self.painted else self._in_space
            for artist in sorted((a for a in self.artists if id(a) not in hidden), key=lambda a: a.zorder):
                artist.draw(renderer)
            self.draw_seconds = monotonic() - start
            return np.asarray(renderer.buffer_rgba())

    def forget_pixels(self):
        """Let go of all pixels, 12 bytes and more a pixel; the next picture is drawn from nothing."""
        with DRAWING:
            self._backgrounds, self._sent = {}, None
            self.canvas.forget()

    def in_both_themes(self):
        """The pixels on light and on dark paper, each of shape (height, width, 4)."""
        with self.on_paper(False):
            light = self.draw().copy()
        with self.on_paper(True):
            return light, self.draw().copy()

    @contextlib.contextmanager
    def on_paper(self, dark):
        """Within the block all is drawn on light or on dark paper, whatever the page has."""
        with DRAWING:
            before, self.canvas.dark = self.dark, dark
            try:
                yield
            finally:
                self.canvas.dark = before

    def png(self):
        """The picture as PNG bytes."""
        with DRAWING:
            before = self.paint(True)
            png = encode_png(self.draw(), self.fig.dpi)
            self.paint(before)
            return png

    def small_png(self, rings=()):
        """The picture on light paper in few colors, with rings at (fraction, color): some 20 kB."""
        with self.on_paper(False):
            before = self.paint(True)
            self.draw()
            self.paint(before)
            renderer = self.canvas.get_renderer()
            for (right, down), color in rings:
                x, y = right * self.fig.bbox.width, (1 - down) * self.fig.bbox.height
                look = {"marker": "o", "markersize": RING, "markerfacecolor": "none", "markeredgewidth": 1.6}
                ring = Line2D([x], [y], markeredgecolor=color, **look)
                ring.set_figure(self.fig)
                ring.draw(renderer)
            image = Image.fromarray(np.array(renderer.buffer_rgba())[..., :3])
        if image.width > STORED_WIDTH:
            image = image.resize((STORED_WIDTH, round(image.height * STORED_WIDTH / image.width)))
        file = io.BytesIO()
        image.quantize(STORED_COLORS, dither=Image.Dither.NONE).save(file, "png")
        return file.getvalue()

    def news(self, whole=False):
        """What the browser lacks since the last call: [png], or [runs, colors] of the changed pixels."""
        with DRAWING:
            pixels, before = self.draw(), self._sent
            found = None if whole or before is None else changes(before, pixels)
            if before is None or before.shape != pixels.shape:
                self._sent = pixels.copy()
            else:
                np.copyto(before, pixels)  # into the memory it has: a new one a picture takes longer to be had
            return [encode_png(pixels, self.fig.dpi)] if found is None else list(found)

    # -- where things are: fractions of the picture, from its upper left corner, as the browser counts

    def fraction(self, ax, xy):
        """Fractions (right, down) of the picture at data coordinates `xy` of an axes."""
        self._stand()
        x, y = ax.transData.transform(xy)
        return float(x / self.fig.bbox.width), float(1 - y / self.fig.bbox.height)

    def place(self, ax):
        """Where a scene in space may be drawn, (left, top, width, height) in fractions of the picture, and how many of
        its units the whole picture is wide. The axes lie in the middle of the place.
        """
        self._stand()
        left, bottom, width, height = ax.get_position(original=True).bounds
        low, high = ax.get_xlim()
        units = (high - low) * self.fig.bbox.width / ax.bbox.width
        return [float(v) for v in (left, 1 - bottom - height, width, height, units)]

    def data(self, ax, fraction):
        """Data coordinates of an axes at fractions (right, down) of the picture; (..., 2) -> (..., 2)."""
        self._stand()
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
