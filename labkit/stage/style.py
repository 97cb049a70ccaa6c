"""The looks of the whole course: colors by role, line styles, fonts, grid, and what the dark theme makes of them.

The only module with literal colors. Okabe and Ito's palette, readable with the common color blindnesses; no role
relies on color alone:

    truth        ink, solid                      measurement  orange, filled circles
    prediction   sky blue, dashed                estimate     reddish purple, solid, diamonds
    rejected     muted, hollow crosses           axes x, y, z vermilion, bluish green, blue, with the letter at the tip

Figures are written for light paper. In JupyterLab's dark theme a Stage exchanges each color of `DARK` while it draws,
so that no figure needs to know about themes: use the names of this module, and nothing else is to be done.
"""

import contextlib

import matplotlib as mpl
from matplotlib.colors import to_rgb

INK = "#000000"  # text, truth, axes lines
PAPER = "#ffffff"
MUTED = "#6b6b6b"  # secondary text, rejected data
GRID = "#dddddd"
FAINT = "#efefef"  # quiet fills: a region, a covariance, an obstacle's shadow

TRUTH = INK
MEASUREMENT = "#e69f00"
PREDICTION = "#56b4e9"
ESTIMATE = "#cc79a7"
REJECTED = MUTED
AXIS_X, AXIS_Y, AXIS_Z = "#d55e00", "#009e73", "#0072b2"
AXES = (AXIS_X, AXIS_Y, AXIS_Z)
SHELL, STEEL = "#c3c9d2", "#7f8894"  # bodies of machines, and their joints and tools
LASER = "#c8324b"
HEAT = "viridis"  # values over an area: costs, grids, densities
WORD_PAD = 13  # points from an axis down to the baseline of words

DARK = {
    INK: "#e8e8e8",
    PAPER: "#111111",
    MUTED: "#a0a0a0",
    GRID: "#383838",
    FAINT: "#242424",
    AXIS_Z: "#4a8fd9",
    SHELL: "#a9b0bb",
    STEEL: "#68717d",
    LASER: "#ff5c78",
}

LOOKS = {
    "truth": {"color": TRUTH, "linestyle": "-", "linewidth": 1.6},
    "measurement": {"color": MEASUREMENT, "linestyle": "none", "marker": "o", "markersize": 5},
    "prediction": {"color": PREDICTION, "linestyle": (0, (5, 2)), "linewidth": 2.2},
    "estimate": {"color": ESTIMATE, "linestyle": "-", "linewidth": 2.2},
    "estimates": {"color": ESTIMATE, "linestyle": "none", "marker": "D", "markersize": 4.5},
    "rejected": {"color": REJECTED, "linestyle": "none", "marker": "x", "markersize": 6, "markerfacecolor": "none"},
    "guide": {"color": MUTED, "linestyle": ":", "linewidth": 1.2},
}

RC = {
    "font.family": ["DejaVu Sans"],  # comes with matplotlib: the same picture on every machine
    "font.size": 10,
    "axes.titlesize": 10.5,
    "axes.titlelocation": "left",
    "axes.labelsize": 10,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "legend.fontsize": 9,
    "legend.frameon": False,
    "figure.facecolor": PAPER,
    "axes.facecolor": PAPER,
    "savefig.facecolor": PAPER,
    "text.color": INK,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "lines.solid_capstyle": "round",
}


with mpl.rc_context({**mpl.rcParamsDefault, **RC}):
    OURS = {name: value for name, value in dict.items(mpl.rcParams) if name not in ("backend", "interactive")}


@contextlib.contextmanager
def rc():
    """Context in which figures of the course are made: `with style.rc(): fig, ax = plt.subplots()`.

    They hang on nothing that a reader has set for figures of their own, such as letters set by a LaTeX that is not
    there.
    """
    with mpl.rc_context():
        dict.update(mpl.rcParams, OURS)  # checked when this module was loaded
        yield


def look(role, **changes):
    """Keyword arguments of `ax.plot` for a role, with `changes`.

    Roles: truth, measurement, prediction, estimate, estimates (markers instead of a line), rejected, guide.
    """
    if role not in LOOKS:
        raise ValueError(f"role must be one of {', '.join(LOOKS)}, got {role!r}")
    return {**LOOKS[role], **changes}


def axes(ax, xlabel="", ylabel="", title="", equal=False, grid=True):
    """Label and finish one axes; `equal` gives both directions the same scale. Returns ax."""
    ax.set(xlabel=xlabel, ylabel=ylabel, title=title)
    ax.grid(grid)
    if equal:
        ax.set_aspect("equal", adjustable="box")
    return ax


def legend_above(ax, **options):
    """The legend over the axes, where no data lie under it. Returns it."""
    place = {"loc": "lower left", "bbox_to_anchor": (-0.01, 1.0), "borderaxespad": 0.1, "columnspacing": 1.2}
    return ax.legend(**{**place, **options})


def words_below(ax, words):
    """Words instead of numbers along x, at 0, 1, ..., on one baseline whatever their letters. Returns ax."""
    ax.set_xticks(range(len(words)), words, va="baseline")
    ax.tick_params(axis="x", pad=WORD_PAD)
    return ax


def bare(ax, title=""):
    """An axes without ticks, frame and grid: for words, drawings and 3D scenes. Returns ax."""
    ax.set(xticks=[], yticks=[], title=title)
    ax.grid(False)
    ax.set_frame_on(False)
    return ax


def themed(color, dark):
    """`color` as it appears in the light or dark theme, as a hexadecimal string."""
    light = mpl.colors.to_hex(color)
    return DARK.get(light, light) if dark else light


DARK_RGB = {to_rgb(light): to_rgb(dark) for light, dark in DARK.items()}
