"""Figures of chapter 6: the arm with its tracker, readings in space, axes, errors and methods."""

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.ticker import NullFormatter

from ...stage import style
from . import bodies


class ArmPicture:
    """The robot with its tracker, the dials of its joints, its reach, and the frames of base, flange and tracker."""

    def __init__(self, scene, triad=110.0):
        self.robot, self.dials = bodies.Tx40(scene), bodies.Dials(scene)
        self.puck = scene.body(*bodies.puck(), name="puck")
        self.mount = scene.rod(8.0, name="mount")
        self.reach = scene.body(bodies.reach(), name="reach")
        self.base = scene.triad("B", 2 * triad)
        self.flange = scene.triad("F", triad, linestyle=(0, (3, 1.5)))
        self.tool = scene.triad("E", triad)
        self.flange.name_at(-14, 1)
        self.tool.name_at(-8, 11)
        scene.fixed(self.base, np.eye(4))
        scene.fixed(self.reach, np.eye(4))

    def set(self, frames, T_BE, circles, q):
        """`frames`: of base and links, shape (7, 4, 4), mm; the pose of the tracker; where the dials are, and the joint
        angles (rad).
        """
        self.robot.set(frames)
        self.dials.set(circles, q)
        self.puck.set(T_BE)
        self.mount.set(frames[6, :3, 3], T_BE[:3, 3])
        self.flange.set(frames[6])
        self.tool.set(T_BE)


TURN_RADIUS = 150.0  # mm, of the circle on which the part of the cell is turned
SHOWN = {"scanner": "S", "tracker": "W", "marks": "P0", "first reading": "E0", "second reading": "E", "part": "P"}
SUMMARY = ("mean", "RMS", "median", "95 %")


class Trail:
    """Readings on their way through space: good ones, gated ones, and the filtered path; their legend beside them."""

    def __init__(self, scene, beside, triad=90.0):
        self.readings = scene.points(**style.look("measurement", markersize=4.5, markeredgewidth=0))
        self.rejected = scene.points(**style.look("rejected"))
        self.path = scene.line(**style.look("estimate", linewidth=1.8))
        self.puck = scene.body(*bodies.puck(), name="puck")
        self.tracker = scene.triad("E", triad)
        self.tracker.name_at(-9, 10)
        scene.fixed(scene.triad("W", triad, linestyle=(0, (3, 1.5))), np.eye(4))
        keys = (
            ("measurement", "reading", {"markersize": 3}),
            ("rejected", "refused by the gate", {}),
            ("estimate", "filtered", {}),
        )
        beside.legend(
            handles=[Line2D([], [], **style.look(role, label=name, **more)) for role, name, more in keys],
            loc="lower left",
            borderaxespad=0.0,
        )

    def set(self, positions, used, filtered, T_WE):
        """Positions (k, 3), which of them passed the gate, the filtered positions, the last pose."""
        nothing = np.full((1, 3), np.nan)
        for item, points in (
            (self.readings, positions[used]),
            (self.rejected, positions[~used]),
            (self.path, filtered),
        ):
            item.set(points if len(points) else nothing)
        self.tracker.set(T_WE)
        self.puck.set(T_WE)

    def path_in_front(self):
        """The filtered path over its readings, which are as deep in the scene; call it after the scene is drawn."""
        self.path.artist.set_zorder(3.2)


class Sweep:
    """Two base stations, and the sheet of light of each on its way across the tracker; which one it is alternates."""

    def __init__(self, scene, stations):
        for k, T in enumerate(stations):
            scene.fixed(scene.body(*bodies.station(), name=f"station {k + 1}"), T)
        self.sheets = [scene.body(bodies.sheet_of_light(720.0, 0.35), name=f"sheet {k + 1}") for k in range(2)]

    def set(self, poses, on):
        """Where both sheets are, (2, 4, 4), and which of them shines."""
        for k, (sheet, T) in enumerate(zip(self.sheets, poses)):
            sheet.show(k == on)
            sheet.set(T)


class RotationAxes:
    """Two rotation axes as lines through a sphere, and the frames that a noisy calibration finds, seen from their
    tips."""

    def __init__(self, scene, radius):
        self.radius = radius
        scene.fixed(scene.ellipsoid(**style.look("guide")), np.zeros(3), radius**2 * np.eye(3))
        self.lines = [scene.line(color=style.INK, linewidth=2.0, linestyle=dash) for dash in ("-", (0, (4, 2)))]
        self.arrows = [scene.arrow(0.022 * radius, name=f"axis {k}") for k in "ab"]
        self.clouds = [
            scene.points(color=color, linestyle="none", marker=".", markersize=6, alpha=0.55, markeredgewidth=0)
            for color in style.AXES
        ]
        self.truth = scene.triad("X", 0.55 * radius)
        self.free = scene.line(**style.look("prediction"))

    def set(self, axes, T, found, free):
        """`axes` (2, 3), the true mounting, the found ones (n, 3, 3), and the path of a point that the data leave free
        (or nothing)."""
        for line, axis in zip(self.lines, axes):
            line.set(np.outer([-1.0, 1.0], axis) * self.radius)
        for arrow, axis in zip(self.arrows, axes):
            arrow.set(np.zeros(3), axis * self.radius)
        for k, cloud in enumerate(self.clouds):
            cloud.set(0.55 * self.radius * found[:, :, k])
        self.truth.set(T)
        self.free.set(free)


def singular_values(ax):
    """The nine singular values of the Kronecker matrix, largest first, logarithmic. Returns (stems, markers)."""
    style.axes(ax, "number", "singular value", "Kronecker matrix")
    ax.set(xlim=(0.4, 9.6), ylim=(1e-4, 10), yscale="log")
    ax.set_xticks(range(1, 10))
    ax.yaxis.set_minor_formatter(NullFormatter())
    (stems,) = ax.plot([], [], color=style.MUTED, linewidth=1.5)
    (markers,) = ax.plot([], [], **style.look("estimates", markersize=7))
    return stems, markers


def set_singular_values(stems, markers, values):
    """Nine values, (9,); what is below the axes is drawn at its edge."""
    x, y = np.arange(1, 10), np.maximum(values, 1.2e-4)
    stems.set_data(np.repeat(x, 3), np.column_stack([np.full(9, 1e-5), y, np.full(9, np.nan)]).ravel())
    markers.set_data(x, y)


def error_over_time(ax, seconds):
    """Error of the readings and after correction over time, logarithmic. Returns (raw, nonsense, corrected)."""
    style.axes(ax, "time, share of the motion", "error of the position (mm)")
    ax.set(xlim=(0, seconds), ylim=(0.5, 20000), yscale="log")
    (raw,) = ax.plot([], [], **style.look("measurement", markersize=2.5, markeredgewidth=0), label="reading")
    (nonsense,) = ax.plot([], [], **style.look("rejected", markersize=5), label="nonsense")
    (corrected,) = ax.plot([], [], **style.look("estimate", linewidth=1.6), label="gated, offset removed")
    ax.legend(loc="upper right", ncol=1, markerscale=1.5)
    return raw, nonsense, corrected


def summary(ax):
    """Mean, RMS, median and 95 % side by side. Returns (raw, corrected, claim, words)."""
    style.axes(ax, "", "mm", "four summaries")
    ax.set(xlim=(-0.5, 3.5), ylim=(0.5, 1000), yscale="log")
    style.words_below(ax, SUMMARY)
    ax.grid(axis="x", visible=False)
    (raw,) = ax.plot([], [], **style.look("measurement", markersize=9))
    (corrected,) = ax.plot([], [], **style.look("estimates", markersize=8))
    claim = ax.axhline(15.0, **style.look("guide"))
    ax.text(3.45, 16.5, "the report's 15 mm", ha="right", va="bottom", color=style.MUTED, fontsize=9)
    words = ax.text(0.02, 0.98, "", transform=ax.transAxes, va="top", linespacing=1.5)
    return raw, corrected, claim, words


def method_chart(ax, names, ways, elsewhere):
    """Error over bound of several methods, rotation and translation, each with its way; `elsewhere`: the rotation at
    all noises, (noises, methods), as a faint range. Returns (rotation, translation).
    """
    style.axes(ax, "rms error / Cramer-Rao bound")
    ax.set(xlim=(0.8, 150), xscale="log", ylim=(len(names) - 0.4, -0.6))
    ax.set_yticks(range(len(names)), [f"{name}\n{way}" for name, way in zip(names, ways)], fontsize=8)
    ax.set_xticks([1, 3, 10, 30, 100], ["1", "3", "10", "30", "100"])
    ax.minorticks_off()
    ax.axvline(1.0, color=style.INK, linewidth=1.6)
    for row, values in enumerate(elsewhere.T):
        (spread,) = ax.plot(
            np.sort(values), [row] * len(values), color=style.MUTED, marker="o", markersize=4, linewidth=5, alpha=0.25
        )
    hollow = {"marker": "o", "markerfacecolor": "none", "markeredgewidth": 1.8}
    (rotation,) = ax.plot([], [], **style.look("estimates", markersize=8), label="rotation")
    (translation,) = ax.plot([], [], **style.look("estimates", markersize=8, **hollow), label="translation")
    spread.set_label("rotation at all four noises")
    style.legend_above(ax, handles=[rotation, translation, spread], ncols=3)
    return rotation, translation


class Repeated:
    """Repeated calibrations in space, as seen from the truth: each result, the ellipsoid of their spread, the one that
    a single run claims; their legend beside them."""

    def __init__(self, scene, beside, size):
        self.spread = scene.ellipsoid(**style.look("estimate", label="spread of the runs, 3 std"))
        self.claim = scene.ellipsoid(**style.look("prediction", label="covariance of one run, 3 std"))
        self.runs = scene.points(**style.look("estimates", markersize=6, label="one run each"))
        self.off = scene.line(**style.look("guide", linewidth=1.8))
        truth = scene.points(color=style.TRUTH, marker="+", markersize=16, linestyle="none", label="truth")
        scene.fixed(scene.triad("", size), np.eye(4))
        scene.fixed(truth, np.zeros(3))
        lines = (self.runs, self.spread, self.claim, truth)
        beside.legend(handles=[item.artist for item in lines], loc="lower left", borderaxespad=0.0)

    def set(self, results, mean, spread, single, claim):
        """Results (n, 3), their mean and covariance, one of them and the covariance it claims; all less the truth."""
        self.runs.set(results)
        self.off.set([np.zeros(3), mean])
        self.spread.set(mean, 9 * spread)
        self.claim.set(single, 9 * claim)


class Plan:
    """Two base stations on a plan of the room, their rays to a diode, the places found from noisy times; their legend
    beside them."""

    def __init__(self, ax, beside, half_width):
        style.axes(ax, "x (mm)", "y (mm)", "plan of the room", equal=True)
        ax.set(xlim=(-half_width, half_width), ylim=(-half_width, half_width))
        (self.rays,) = ax.plot([], [], **style.look("measurement", marker="", linestyle="-", linewidth=1.0))
        (self.stations,) = ax.plot([], [], **style.look("truth", linestyle="none", marker="s", markersize=8))
        (self.found,) = ax.plot([], [], **style.look("estimates", markersize=3, markeredgewidth=0, alpha=0.7))
        (self.region,) = ax.plot([], [], **style.look("prediction"))
        (self.diode,) = ax.plot([], [], **style.look("truth", linestyle="none", marker="+", markersize=12))
        self.found.set_label("places found")
        self.region.set_label("covariance, 3 std")
        beside.legend(handles=[self.found, self.region], loc="lower left", borderaxespad=0.0)
        self.names = [
            ax.annotate(name, (0, 0), xytext=(8, -14), textcoords="offset points", fontweight="bold") for name in "AB"
        ]
        self.artists = [self.rays, self.stations, self.found, self.region, self.diode, *self.names]

    def set(self, stations, diode, found, region):
        """Stations (2, 2), the diode (2,), places found (n, 2), outline of the region (m, 2)."""
        gap = [np.nan, np.nan]
        self.rays.set_data(*np.transpose([stations[0], diode, gap, stations[1], diode]))
        self.stations.set_data(*stations.T)
        self.diode.set_data(*diode[:, None])
        self.found.set_data(*found.T)
        self.region.set_data(*region.T)
        for name, place in zip(self.names, stations):
            name.xy = tuple(place)


def error_by_stop(ax, stops, printed):
    """Error of each stop of a calibration run after the first, logarithmic, and the printed mean. Returns the line."""
    style.axes(ax, "stop", "error of the position (mm)", "A X against X B")
    ax.set(xlim=(0.3, stops - 0.3), ylim=(0.02, 60), yscale="log", xticks=range(5, stops, 5))
    ax.axhline(printed, **style.look("guide"))
    ax.text(0.5, 0.9 * printed, "mean in the report", va="top", color=style.MUTED, fontsize=9)
    (line,) = ax.plot([], [], **style.look("measurement", linestyle=":", linewidth=1.0))
    return line


class OverSpeed:
    """Errors of several motions over their speed, medians of intervals, a law through them, and two printed levels."""

    def __init__(self, ax, x, end):
        style.axes(ax, "speed, share of the fastest printed (1.4 m/s or 3.7 rad/s)", "error", "same path, three speeds")
        ax.set(xlim=(0, end), ylim=(0.05, 20_000), yscale="log")  # the legend has room above the data
        self.x = x
        self.dots = [
            ax.plot([], [], **style.look("measurement", marker=marker, markersize=3, alpha=0.55), label=name)[0]
            for marker, name in ((".", "slow"), ("^", "middle"), ("s", "fast"))
        ]
        (self.nonsense,) = ax.plot([], [], **style.look("rejected", markersize=5), label="nonsense")
        (self.medians,) = ax.plot([], [], **style.look("estimates", markersize=6), label="median")
        (self.law,) = ax.plot([], [], **style.look("prediction"), label="squares add")
        self.levels = [ax.plot([], [], **style.look("guide", linewidth=1.6))[0] for _ in range(2)]
        paper = {"facecolor": style.PAPER, "edgecolor": "none", "alpha": 0.8, "pad": 1}  # readings may lie under it
        over = {"xytext": (3, 3), "textcoords": "offset points", "bbox": paper}
        self.name = ax.annotate("", (0, 1), **over, color=style.MUTED, fontsize=9)
        named = [*self.dots, self.nonsense, self.medians, self.law]
        legend = ax.legend(handles=named, loc="upper left", ncols=3, columnspacing=0.8, handlelength=1.4)
        for dots in legend.legend_handles[:3]:
            dots.set(markersize=6, alpha=1.0)
        self.artists = [*self.dots, self.nonsense, self.medians, self.law, *self.levels, self.name]

    def set(self, result):
        """Draw the result of `stages.compute_over_speed`."""
        for line, x, y, bad in zip(self.dots, result["share"], result["error"], result["bad"]):
            line.set_data(x[~bad], y[~bad])
        x, y, bad = (np.concatenate(result[key]) for key in ("share", "error", "bad"))
        self.nonsense.set_data(x[bad], y[bad])
        self.medians.set_data(self.x, result["median"])
        self.law.set_data(self.x, result["law"])
        printed = np.isfinite(result["printed"])
        for line, level, shown in zip(self.levels, result["printed"], printed):
            line.set_data([0, 2], [level, level])
            line.set_visible(bool(shown))
        if printed.any():  # over the upper line, and left, where a slow tracker errs least
            words = np.array(["mean", "largest"])[printed]
            self.name.set_text(f"printed {' and '.join(words)}")
            self.name.xy = (0.0, np.nanmax(result["printed"]))
        self.name.set_visible(bool(printed.any()))


class CellScene:
    """The whole cell in space: arm with tip and scanner at the hole, part and tracker on their trolley, the part as it
    was learned and, with its error enlarged, as it was found; the chosen source, its ellipsoid and its error; misses of
    simulated cells about the hole, the budget's ellipsoid and the miss of this cell."""

    def __init__(self, scene, cell):
        self.cell = cell
        self.robot = bodies.Tx40(scene)
        self.tool = scene.rod(4.0, style.INK, name="tool")
        self.scanner = scene.body(*bodies.scanner(), name="scanner")
        self.holder = scene.rod(9.0, name="holder")
        self.part = scene.body(*bodies.part(), name="part")
        self.trolley = scene.body(*bodies.trolley(cell.T_PE), name="trolley")
        self.learned = scene.line(**style.look("guide", linewidth=1.8))
        self.found = scene.body(bodies.plate().looks(style.ESTIMATE, 0.55), name="part as found")
        scene.fixed(scene.triad("B", 90), np.eye(4))
        self.frames = {name: scene.triad(letter, 60) for name, letter in SHOWN.items()}
        self.links = scene.line(**style.look("guide", linewidth=1.4))
        self.chosen = scene.points(color=style.INK, linestyle="none", marker="o", markersize=13, markerfacecolor="none")
        self.known = scene.ellipsoid(**style.look("estimate"))
        self.off = scene.triad("", 60, linestyle=(0, (3, 1.5)))
        self.circle = scene.line(**style.look("guide", linewidth=1.6))
        self.cloud = scene.points(**style.look("measurement", markersize=2, markeredgewidth=0, alpha=0.5))
        self.expected = scene.ellipsoid(**style.look("prediction"))
        self.miss = scene.arrow(6.0, style.ESTIMATE, name="miss")

    def set(self, result, frames, enlarged):
        """The result of `whole_cell.compute_whole_cell`, the arm's `link_frames`, how much larger errors are drawn."""
        T_BF, part, places = result["T_BF"], result["part"], result["places"]
        self.robot.set(frames)
        self.tool.set(T_BF[:3, 3], places["tip"])
        self.scanner.set(T_BF @ result["cell"].T_FS)
        self.holder.set(T_BF[:3, 3], places["scanner"])
        self.part.set(part)
        self.trolley.set(part)
        self.found.set(result["found"])
        corners = self.cell.MARKS[[0, 1, 2, 0]]
        self.learned.set(corners @ result["learned"][:3, :3].T + result["learned"][:3, 3])
        for name, frame in self.frames.items():
            frame.set(result["frames"][name])
        base, gap = np.zeros(3), np.full(3, np.nan)
        world = places["tracker"]
        self.links.set([
            base, world, places["first reading"], gap, world, places["second reading"], gap, base, places["marks"],
        ])  # fmt: skip
        self.chosen.set(places[result["source"]])
        self.known.set(result["place"][:3, 3], (3 * enlarged) ** 2 * result["known"])
        self.off.set(result["off"])
        turned = result["turn"] + np.linspace(0, 2 * np.pi, 61)
        self.circle.set(part[:3, 3] + TURN_RADIUS * np.column_stack([np.cos(turned), np.sin(turned), 0 * turned]))
        hole = result["hole"]
        self.cloud.set(hole + enlarged * result["cloud"])
        self.expected.set(hole, (3 * enlarged) ** 2 * result["covariance"])
        self.miss.set(hole, hole + enlarged * result["miss"])


class Budget:
    """What each source contributes, as bars with their numbers, and the total."""

    def __init__(self, ax, sources, longest=1.4):
        self.sources, self.longest = sources, longest
        style.axes(ax, "standard deviation (mm)", "", "whose error is it?")
        ax.set(xlim=(0, longest), ylim=(len(sources) + 0.6, -0.6))
        ax.set_yticks(range(len(sources) + 1), [*sources, "total"])
        ax.grid(axis="y", visible=False)
        (self.bars,) = ax.plot([], [], color=style.PREDICTION, linewidth=9, solid_capstyle="butt")
        (self.total,) = ax.plot([], [], color=style.INK, linewidth=9, solid_capstyle="butt")
        self.numbers = [ax.text(0, k, "", va="center", fontsize=9) for k in range(len(sources) + 1)]
        self.artists = [self.bars, self.total, *self.numbers]

    def set(self, sizes, total):
        """Sizes {source: mm} and their total."""
        lengths = [*(sizes[name] for name in self.sources), total]
        gap = [np.nan, np.nan]
        self.bars.set_data(*np.concatenate([[[0, k], [v, k], gap] for k, v in enumerate(lengths[:-1])]).T)
        self.total.set_data([0, total], [len(self.sources)] * 2)
        for text, length in zip(self.numbers, lengths):
            text.set_text(f"{length:.2f}")
            text.set_x(min(length, 0.82 * self.longest) + 0.03 * self.longest)
