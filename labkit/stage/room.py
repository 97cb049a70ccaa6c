"""How a figure fits a place that is smaller than designed: panels under or beside each other, long words in two lines,
legends in fewer columns, letters as large as leave the words apart.

Letters that are scaled down with the picture cannot be read on a phone or on a projector at 150 %. So panels that stand
side by side go under each other where the place is narrow, and the other way round where it is low; a legend wider than
its panel's share of the picture, which would push the panel together, takes more rows; and of several sizes of letters
the largest is taken at which no more words lie on each other, or leave the picture, than where the picture has its own
size, and which leaves every panel a third of its share of the picture.
"""

import numpy as np
from matplotlib.legend import Legend
from matplotlib.text import Text

NARROW = 0.68  # of the designed width; narrower, panels stand under each other
LOW = 0.6  # of the designed height; lower, panels stand beside each other
PANEL = 0.55, 0.8  # height of a panel that stands under another, as a share of its width: least and most
SLENDER = (
    (0.8, 1.2),
    (1.25, 1.25),
)  # height where the place is narrow, at most and where words need it: one row, several
LEGEND = 0.8  # of its panel's share of the picture: as wide a legend may be
ALIKE = 1.4, 2.6  # so many times as large as another panel under it, and beside it, at most
ROUGH = 2.0  # pixels that two words may share, for their boxes are larger than their letters
GAP = 0.03  # inches of the picture that two words in one line must stay apart
LEAST = 0.35  # of its share of the picture must be left to a panel
FLATTEST, ROOM_LEFT = 0.36, 0.8  # inches a panel must be high, or that share of its own height where this is less
LETTERS = (1.0, 0.92, 0.85, 0.77, 0.7)  # sizes of the letters that are tried, as shares of their own
LEGIBLE = 0.77  # of their size: to keep a legend off a line, letters shrink no further


class Panels:
    """The panels of a figure: as designed, in one column, in one row, or in as many rows as there were columns.

    Panels in one row or in two columns can stand in one column, two rows of up to three panels in one row, and two rows
    of more than two columns can be turned. What stands in no grid stays where it is.
    """

    def __init__(self, fig):
        self.fig, self.way = fig, "designed"
        self.spec = {ax: ax.get_subplotspec() for ax in fig.axes}
        grids = {spec.get_gridspec() for spec in self.spec.values() if spec is not None}
        self.grid = next(iter(grids)) if len(grids) == 1 and None not in self.spec.values() else None
        self.rows, self.columns = (1, 1) if self.grid is None else (self.grid.nrows, self.grid.ncols)
        self.count = len(self.spec)

    def best(self, narrow, low):
        """How they stand best in a place."""
        if narrow and self.columns > 1 and (self.rows == 1 or self.columns == 2):
            return "column"
        if self.rows == 2 and (narrow or low):
            if narrow and self.columns > 2:
                return "turned"
            return "row" if low and not narrow and len(self.spec) <= 3 else "designed"
        return "designed"

    def share(self, ax):
        """Width that an axes and what belongs to it may take, as a share of the picture."""
        spec = ax.get_subplotspec()
        if self.grid is None or spec is None:
            return 1.0
        widths = np.array(spec.get_gridspec().get_width_ratios() or [1] * spec.get_gridspec().ncols, float)
        return widths[spec.colspan.start : spec.colspan.stop].sum() / widths.sum()

    def arrange(self, way):
        """Let them stand as "designed", in one "column", in one "row", or "turned"."""
        if way == self.way:
            return
        self.way = way
        ways = {"column": self._in_a_column, "row": self._in_a_row, "turned": self._turned}
        specs = ways[way]() if way in ways else self.spec
        for ax, spec in specs.items():
            ax.set_subplotspec(spec)
            if spec.colspan.start == 0 and self.spec[ax].colspan.start:
                ax.tick_params(labelleft=True)  # it may have stood beside one that said it
            elif self.spec[ax].colspan.start and len(ax.get_shared_y_axes().get_siblings(ax)) > 1:
                ax.tick_params(labelleft=False)

    def _in_a_column(self):
        widths, heights = self._ratios()
        shares = [w * h / sum(heights) for w in np.clip(widths, 0, ALIKE[0] * min(widths)) for h in heights]
        grid, rows = self.fig.add_gridspec(len(shares), 1, height_ratios=shares), self.rows
        first = {ax: spec.colspan.start * rows + spec.rowspan.start for ax, spec in self.spec.items()}
        return {ax: grid[first[ax] : first[ax] + len(spec.rowspan), 0] for ax, spec in self.spec.items()}

    def _in_a_row(self):
        widths, heights = self._ratios()
        order = sorted(self.spec, key=lambda ax: (self.spec[ax].colspan.start, self.spec[ax].rowspan.start))
        if self.columns > 1:  # a panel as high as two has its width; two under each other have theirs each
            shares = [widths[self.spec[ax].colspan.start] for ax in order]
        else:
            shares = np.clip(heights, 0, ALIKE[1] * min(heights))
        grid = self.fig.add_gridspec(1, len(order), width_ratios=shares)
        return {ax: grid[0, k] for k, ax in enumerate(order)}

    def _turned(self):
        """As many rows as there were columns; read line by line, the order stays."""
        grid = self.fig.add_gridspec(self.columns, self.rows)
        places = {ax: spec.rowspan.start * self.columns + spec.colspan.start for ax, spec in self.spec.items()}
        return {ax: grid[divmod(place, self.rows)] for ax, place in places.items()}

    def _ratios(self):
        """Widths of the columns and heights of the rows, as designed."""
        return self.grid.get_width_ratios() or [1] * self.columns, self.grid.get_height_ratios() or [1] * self.rows


class Words:
    """What must stay apart in a figure, judged against how it was designed.

    fig : Figure
        At its own size, drawn.
    """

    def __init__(self, fig):
        self.fig = fig
        self.in_space = {id(text) for ax in fig.axes if hasattr(ax, "space") for text in ax.texts}
        self.crowd, self.shares = self.crowded(), self._shares()
        self.flattest = np.minimum(FLATTEST, ROOM_LEFT * self._heights())

    def fit(self):
        """Whether they stay apart, and no panel is too small or flat; None where only a legend lies on a line."""
        if (self._shares() < LEAST * self.shares).any() or (self._heights() < self.flattest).any():
            return False
        crowd = self.crowded()
        if crowd <= self.crowd:
            return True
        return None if crowd - self.covered() <= self.crowd else False

    def crowded(self):
        """How many words lie on another, or leave the figure, and how many legends lie on a line or its marks."""
        boxes = self._boxes()
        low, high = boxes[:, :2], boxes[:, 2:]
        shared = np.minimum(high[:, None], high) - np.maximum(low[:, None], low)
        pairs = np.triu((shared > (-GAP * self.fig.dpi, ROUGH)).all(-1), 1).sum()
        outside = ((low < -ROUGH) | (high > self.fig.bbox.size + ROUGH)).any(-1).sum()
        return int(pairs + outside) + self.covered()

    def covered(self):
        """How many legends lie on a line or its marks."""
        return sum(map(self._covers, self.fig.axes))

    def _covers(self, ax):
        """Whether the legend of an axes lies on one of its lines."""
        if ax.get_legend() is None:
            return False
        low, high = ax.get_legend().get_window_extent().get_points()
        along = np.linspace(0, 1, 9)[:, None, None]
        for line in ax.lines:
            path = line.get_transform().transform(line.get_xydata()) if line.get_visible() else np.empty((0, 2))
            if line.get_linestyle() != "None" and len(path) > 1:
                path = ((1 - along) * path[:-1] + along * path[1:]).reshape(-1, 2)
            if ((path > low) & (path < high)).all(-1).any():
                return True
        return False

    def _shares(self):
        return np.array([np.prod(ax.get_window_extent().size / self.fig.bbox.size) for ax in self.fig.axes])

    def _heights(self):
        """Of the panels, in inches, which grow where letters shrink."""
        return np.array([ax.get_window_extent().height / self.fig.dpi for ax in self.fig.axes])

    def _boxes(self):
        """Boxes (left, bottom, right, top) in pixels of all words that are shown, shape (n, 4); letters in space move
        with what they name.
        """
        renderer, unseen = self.fig.canvas.get_renderer(), set(self.in_space)
        for legend in self.fig.findobj(Legend):
            legend.draw(renderer)  # only then its words know where they stand; the background will be drawn over them
        for ax in self.fig.axes:
            for axis, k in ((ax.xaxis, 0), (ax.yaxis, 1)):
                low, high = sorted(axis.get_view_interval())
                shown = ax.axison and axis.get_visible()
                labels = axis.get_ticklabels(which="both")
                unseen |= {id(label) for label in labels if not (shown and low <= label.get_position()[k] <= high)}

        def is_shown(artist):
            return (
                isinstance(artist, Text) and artist.get_visible() and artist.get_text().strip()
                and id(artist) not in unseen
            )  # fmt: skip

        legends = [legend for legend in self.fig.findobj(Legend) if legend.get_visible()]
        unseen |= {id(text) for legend in legends for text in legend.findobj(Text)}  # a legend counts as one word
        boxes = [text.get_window_extent(renderer).extents for text in [*legends, *self.fig.findobj(is_shown)]]
        return np.array(boxes).reshape(-1, 4)


class Legends:
    """The legends of a figure, with as many columns as designed or fewer.

    fig : Figure
    """

    def __init__(self, fig):
        self.fig = fig
        self.designed = []  # (legend, its columns, their entries)
        for legend in fig.findobj(Legend):
            columns = list(_columns(legend))
            self.designed.append((legend, columns, [list(column.get_children()) for column in columns]))

    def fold(self, share=None):
        """Take columns from each legend until it is no wider than its part of the picture, where that is needed.

        share : callable, optional
            Part of the picture that belongs to an axes. Without it each has its columns back.
        """
        for legend, columns, entries in self.designed:
            for count in range(len(columns), 0, -1):
                self._deal(legend, columns[:count], entries)
                room = np.inf if share is None else LEGEND * share(legend.axes) * self.fig.bbox.width
                if legend.get_window_extent(self.fig.canvas.get_renderer()).width <= room:
                    break

    def _deal(self, legend, columns, entries):
        if len(columns) < len(entries):
            entries = np.array_split(np.array(sum(entries, []), dtype=object), len(columns))
        for column, part in zip(columns, entries):
            column.get_children()[:] = part
        _columns(legend)[:] = columns


def _columns(legend):
    """The list of a legend's columns itself: what is changed in it changes the legend."""
    _, box = legend.get_children()[0].get_children()  # under its title
    return box.get_children()


def break_lines(fig, on, moving):
    """Let words that would leave the figure go on in a second line; not those that move, which would take longer, and
    not those of legends, whose boxes would not follow.
    """
    kept = {*moving, *(text for legend in fig.findobj(Legend) for text in legend.get_texts())}
    for text in fig.findobj(Text):
        if text not in kept:
            text.set_wrap(on)
