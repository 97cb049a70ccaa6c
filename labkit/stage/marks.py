"""Small things that several chapters draw: a matrix beside its frame, numbers beside a picture, ghosts of other
settings, a robot in the plane, the name of what is not used.
"""

import numpy as np
from matplotlib.text import Text

from . import style

ARROW = np.array([[0.0, 0.6], [1.0, 0.0], [0.0, -0.6], [0.3, 0.0], [0.0, 0.6]])  # a robot that looks along x


def broken(curves):
    """Several curves, (k, n, 2), as one line broken by NaN, (k (n + 1), 2)."""
    curves = np.asarray(curves, dtype=float)
    return np.concatenate([curves, np.full((len(curves), 1, 2), np.nan)], axis=1).reshape(-1, 2)


class Ghosts:
    """What other settings would give, the whole range of a slider for instance: one faint line for all of them."""

    def __init__(self, ax, label="", **look):
        faint = {"color": style.MUTED, "linewidth": 0.8, "alpha": 0.4, "zorder": 1}
        (self.line,) = ax.plot([], [], **{**faint, **look}, label=label)
        self.artists = [self.line]

    def set(self, curves):
        """`curves`: (k, n, 2), or a list of (n, 2) of unlike length."""
        self.line.set_data(*np.concatenate([broken([curve]) for curve in curves]).T)


class Matrix:
    """A homogeneous transform in brackets under its name: the columns of the axes in their colors, the origin in ink.

    Parameters
    ----------
    ax : Axes
    x, y : float
        Left end of the name, and its height, in fractions of the axes.
    heading : str
    dx, dy : float
        From column to column, and from row to row.
    decimals : int
    """

    def __init__(self, ax, x, y, heading, dx=0.24, dy=0.085, decimals=3):
        self.decimals = decimals
        place = {"transform": ax.transAxes, "clip_on": False}
        ax.text(x, y + dy, heading, fontweight="bold", **place)
        low, high = y - 3.75 * dy, y + 0.35 * dy
        for edge, inward in ((x - 0.01, 0.03), (x + 3.88 * dx, -0.03)):
            ax.plot([edge + inward, edge, edge, edge + inward], [high, high, low, low], color=style.INK, **place)
        colors = (*style.AXES, style.INK)
        self.entries = [
            [
                ax.text(x + dx * (j + 0.8), y - dy * (i + 0.2), "", ha="right", va="center",
                        color=style.MUTED if i == 3 else colors[j], **place)
                for j in range(4)
            ]
            for i in range(4)
        ]  # fmt: skip
        self.artists = [entry for row in self.entries for entry in row]

    def set(self, T):
        """`T`: shape (4, 4)."""
        for row, values in zip(self.entries, np.round(T, self.decimals) + 0.0):
            for entry, value in zip(row, values):
                entry.set_text(f"{value:.{self.decimals}f}")


class Readout(Text):
    """Lines of words and numbers that fill a panel from the top: where it is low, the lines draw together before any
    letter gets smaller. A legend of the panel stays free.

    Parameters
    ----------
    ax : Axes
    top : float
        Where the first line begins, in fractions of the axes.
    """

    LOOSE, TIGHT = 1.7, 1.05  # spacing of the lines, as a multiple of the letters' height

    def __init__(self, ax, top=0.95):
        super().__init__(0.0, top, "", va="top", linespacing=self.LOOSE, transform=ax.transAxes)
        self._settled = None
        ax.add_artist(self)
        self.set_clip_on(False)

    def draw(self, renderer):
        self._settle(renderer)
        super().draw(renderer)

    def get_window_extent(self, renderer=None, dpi=None):
        self._settle(renderer or self.figure.canvas.get_renderer())
        return super().get_window_extent(renderer, dpi)

    def _settle(self, renderer):
        """As wide a spacing as the panel has room for, found anew where the panel, its letters or its lines change."""
        now = self.figure.dpi, self.get_fontsize(), *self.axes.bbox.bounds, self.get_text().count("\n")
        if now == self._settled:
            return
        self._settled, legend, low = now, self.axes.get_legend(), self.axes.bbox.y0
        if legend:
            low = max(low, legend.get_window_extent(renderer).y1)
        room = self.get_transform().transform(self.get_position())[1] - low
        tight, loose = (self._height(renderer, spacing) for spacing in (self.TIGHT, self.LOOSE))
        share = (room - tight) / (loose - tight) if loose > tight else 1.0
        self.set_linespacing(self.TIGHT + float(np.clip(share, 0.0, 1.0)) * (self.LOOSE - self.TIGHT))

    def _height(self, renderer, spacing):
        self.set_linespacing(spacing)
        return super().get_window_extent(renderer).height


class Spare:
    """The name of a landmark that can be dragged but is not used at the moment; `away` from it, in points."""

    def __init__(self, ax, text, away, ha):
        place = {"xytext": away, "textcoords": "offset points", "ha": ha}
        self.name = ax.annotate(text, (0, 0), **place, color=style.MUTED, fontsize=9)
        self.artists = [self.name]

    def set(self, point, spare):
        """`point`: (2,); `spare`: whether it is left out now."""
        self.name.xy = tuple(point)
        self.name.set_visible(spare)


def robot_outline(pose, size=0.25):
    """Closed outline of an arrowhead at a pose, (5, 2)."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return pose[:2] + size * (ARROW - [0.35, 0]) @ np.array([[c, s], [-s, c]])


def strayed(pose, view):
    """A sentence for a robot outside the part of the floor that is drawn, ((left, right), (bottom, top)); else none."""
    inside = all(low <= x <= high for x, (low, high) in zip(pose, view))
    return "" if inside else " The robot has left the picture: turn back, or Reset."
