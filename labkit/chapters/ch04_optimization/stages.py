"""Chapter 4: the walk along the line, four paths on one map, Newton near the saddle, chords, basins to rub free."""

from functools import cache, lru_cache

import contourpy
import numpy as np

from ...documents.thesis import wells
from ...estimation import optimization as opt
from ...estimation.convexity import chord, positive_definite
from ...stage import Choice, Handle, Slider, Stage, Target, Toggle, living, style
from . import figures as draw

LEVELS = (-200, -170, -140, -110, -90, -75, -67.58, -60, -50, -40, -30, -22, -16, -12)
SHOWN = 12  # iterations in the picture; who needs more has left it
SQUARE = (-6.0, 6.0)
CELLS = 121
BRUSH = 0.5
WORDS = {"Newton": "newton", "Gauss-Newton": "gauss_newton", "Levenberg-Marquardt": "levenberg_marquardt"}
METHODS = {**WORDS, "trust region": "trust_region"}


def _grid(x, y, n):
    """Points of a grid over two intervals, shape (n, n, 2)."""
    return np.stack(np.meshgrid(np.linspace(*x, n), np.linspace(*y, n)), axis=-1)


def _map(ax, x, y):
    grid = _grid(x, y, 141)
    points = {name: e.x for name, e in zip(wells.NAMES, wells.extrema())}
    draw.contour_map(ax, grid[..., 0], grid[..., 1], wells.value(grid), LEVELS, points)
    ax.set(xlim=x, ylim=y)
    return ax


# --- The walk along the line ---


def walk(state):
    """Newton from a place on the line: iterates t, the first parabola, its vertex, its curvature."""
    t = float(state["start"][0])
    value, slope, bend = wells.line_model(t)
    run = wells.run("newton", wells.on_line(t), max_iterations=SHOWN)
    around = t + np.linspace(-0.6, 0.6, 61)
    parabola = value + slope * (around - t) + 0.5 * bend * (around - t) ** 2
    vertex = t - slope / bend
    end = wells.NAMES[wells.which(run.solution)] if run.converged else "nowhere"
    return {
        "t": wells.along_line(run.x), "around": around, "parabola": parabola, "bend": bend, "vertex": vertex,
        "end": end,
    }  # fmt: skip


def _walk_caption(result):
    kind = "a minimum" if result["bend"] > 0 else "a maximum"
    return (
        f"At t = {result['t'][0]:.2f} the parabola's vertex is {kind}, at t = {result['vertex']:.2f}. "
        f"Newton goes there, and in the end: {result['end']}."
    )


def line():
    """Drag the start along the line through both wells and see the parabola whose vertex is Newton's next point."""

    def scene(fig):
        ax = fig.subplots()
        t = np.linspace(-0.6, 1.6, 441)
        points = {}
        for name, e in zip(wells.NAMES, wells.extrema()):
            points[name] = (wells.along_line(e.x), e.value)
        parabola, iterates, vertex, text, names = draw.profile(ax, t, wells.value(wells.on_line(t)), points)
        ax.set(xlim=(-0.6, 1.6), ylim=(-240, 10))

        def update(state, result):
            parabola.set_data(result["around"], result["parabola"])
            inside = np.clip(result["t"], -0.6, 1.6)
            iterates.set_data(inside, wells.value(wells.on_line(inside)))
            vertex.set_data([np.clip(result["vertex"], -0.6, 1.6)], [-236])
            text.set_text(f"curvature {result['bend']:+.0f}")

        return [parabola, iterates, vertex, text, *names], update

    def follow(state, moved):
        t = state["start"][0]
        return {"start": (t, float(wells.value(wells.on_line(t))))}

    return Stage(
        "Newton on a line",
        scene=scene,
        compute=walk,
        handles={"start": Handle((0.2, -90.0), step=0.01)},
        constrain=follow,
        fail={"start": (0.84, -160.0)},
        because="Here the curve hardly bends: the vertex of its parabola lies far outside.",
        describe=_walk_caption,
        size=(7.0, 3.6),
    )


# --- Four paths ---


def model_contours(x, model, half_width, count=7):
    """Contour lines of a quadratic model in a square around x, as one polyline broken by NaN, shape (n, 2)."""
    f, g, B = model
    h = _grid((-half_width, half_width), (-half_width, half_width), 41)
    m = f - opt.predicted_decrease(g, B, h)
    levels = np.linspace(m.min(), m.max(), count + 2)[1:-1]
    generator = contourpy.contour_generator(h[0, :, 0] + x[0], h[:, 0, 1] + x[1], m)
    pieces = [piece for level in levels for piece in generator.lines(level)]
    return np.concatenate([np.vstack([piece, [np.nan, np.nan]]) for piece in pieces])


@lru_cache(maxsize=4)
def _runs(start):
    """Traces of all methods from a start, a tuple; kept while only the method or the iteration changes."""
    return {name: wells.run(name, np.array(start), max_iterations=SHOWN) for name in wells.METHODS}


def four_runs(state):
    """Traces of all methods from the start, and of the chosen one the model, radius and step at iteration k."""
    runs = _runs(tuple(state["start"].tolist()))
    run = runs[state["method"]]
    k = min(state["k"], max(run.iterations - 1, 0))
    x, step, radius, gain, accepted = run.x[k], np.zeros(2), 0.0, np.nan, True
    if run.iterations:  # none where the slope vanishes at the start
        step, radius, gain, accepted = run.step[k], float(run.radius[k]), float(run.gain[k]), bool(run.accepted[k])
    reach = min(radius if np.isfinite(radius) else np.linalg.norm(step), 3.0)
    return {
        "runs": runs,
        "method": state["method"],
        "k": k,
        "x": x,
        "step": step,
        "radius": radius,
        "gain": gain,
        "accepted": accepted,
        "contours": model_contours(x, wells.model(state["method"], x), max(1.25 * reach, 0.15)),
        "ends": {name: _end(r) for name, r in runs.items()},
    }


def _name(method):
    """A method's name as it begins a sentence."""
    label = draw.PATHS[method]["label"]
    return label[0].upper() + label[1:]


def _end(run):
    return wells.NAMES[wells.which(run.solution, tol=0.05)]


def _four_caption(result):
    ends = ", ".join(f"{draw.PATHS[name]['label']}: {end}" for name, end in result["ends"].items())
    gain = "" if np.isnan(result["gain"]) else f", gain {result['gain']:.2f}"
    taken = "" if result["accepted"] else ", rejected"
    radius = "none" if np.isinf(result["radius"]) else f"{result['radius']:.2f}"
    if not result["runs"][result["method"]].iterations:
        return f"{ends}. {_name(result['method'])} takes no step: there is no slope at its start."
    return (
        f"{ends}. Step {result['k'] + 1} of {draw.PATHS[result['method']]['label']}: length "
        f"{np.linalg.norm(result['step']):.2f}, radius {radius}{gain}{taken}."
    )


def _all_agree(result):
    """Whether all four paths end in the same minimum, which one it may be."""
    ends = set(result["ends"].values())
    return len(ends) == 1 and ends <= {"local minimum", "global minimum"}


def four_paths():
    """Drag the start; compare the four paths, and look at one method's model, radius and step at each iteration."""

    def scene(fig):
        ax, beside = fig.subplots(1, 2, width_ratios=(2.1, 1))
        _map(ax, (-4.5, 4.5), (-4.5, 4.5))
        lines = draw.paths(ax, wells.METHODS)
        contours, rim, step = draw.model(ax)
        costs, here = draw.courses(beside, wells.METHODS, SHOWN, -215, 60)
        circle = np.linspace(0, 2 * np.pi, 121)

        def update(state, result):
            draw.emphasize(lines, result["method"])
            draw.emphasize(costs, result["method"])
            for name, run in result["runs"].items():
                lines[name].set_data(*np.clip(run.x, -50, 50).T)
                costs[name].set_data(np.arange(len(run.cost)), wells.value(run.x))
            x, end = result["x"], result["x"] + result["step"]
            contours.set_data(*result["contours"].T)
            step.set_data(*np.clip([x, end], -50, 50).T)
            radius = result["radius"] if np.isfinite(result["radius"]) else np.nan
            rim.set_data(x[0] + radius * np.cos(circle), x[1] + radius * np.sin(circle))
            here.set_data([result["k"]], [wells.value(x)])

        return [*lines.values(), contours, rim, step, *costs.values(), here], update

    return Stage(
        "four paths",
        scene=scene,
        compute=four_runs,
        handles={"start": Handle((3.0, 3.0), step=0.1)},
        controls={
            "method": Choice(METHODS, "trust_region", label="model of"),
            "k": Slider(0, SHOWN - 1, 0, label="iteration"),
        },
        fail={"start": (1.3, 1.3), "method": "newton", "k": 2},
        because="Newton looks for a place without slope, and a saddle is one: from this start it ends there.",
        target=Target("a start from which all four end in one minimum", _all_agree),
        describe=_four_caption,
        size=(7.6, 4.6),
    )


# --- Near the saddle ---


def near_saddle(state):
    """One run from the start, and the Newton step there taken apart along the directions of curvature."""
    x = state["start"]
    run = wells.run(state["method"], x, max_iterations=SHOWN)
    eigenvalues, V, shares = opt.newton_parts(wells.gradient(x), wells.hessian(x))
    return {
        "run": run,
        "method": state["method"],
        "eigenvalues": eigenvalues,
        "directions": V,
        "shares": np.clip(shares, -20, 20),
        "climb": float(wells.value(run.x[min(1, run.iterations)]) - wells.value(x)),
        "end": _end(run),
        "distance": float(np.linalg.norm(x - wells.extrema()[2].x)),
    }


def _saddle_caption(result):
    low, high = result["eigenvalues"]
    sense = "rises" if result["climb"] > 0 else "falls"
    return (
        f"{result['distance']:.2f} from S, curvatures {low:.0f} and {high:.0f}. "
        f"In the first step f {sense} by {abs(result['climb']):.1f}. "
        f"{_name(result['method'])} ends here: {result['end']}, after {result['run'].iterations} steps."
    )


def saddle():
    """Drag the start near the saddle: Newton against the trust region, and the Newton step along both curvatures."""

    def scene(fig):
        ax = fig.subplots()
        x, y = (-1.6, 1.9), (-1.3, 0.8)
        grid = _grid(x, y, 101)
        lowest = np.linalg.eigvalsh(wells.hessian(grid))[..., 0]
        draw.indefinite(ax, grid[..., 0], grid[..., 1], lowest)
        _map(ax, x, y)
        ax.set_title("gray: the Hessian is indefinite")
        lines = draw.paths(ax, ("newton", "trust_region"))
        arms = draw.curvature(ax)

        def update(state, result):
            start, V = state["start"], result["directions"]
            draw.emphasize(lines, result["method"])
            for name, drawn in lines.items():
                drawn.set_data(*(np.clip(result["run"].x, -50, 50).T if name == result["method"] else ([], [])))
            for arm, direction, value in zip(arms[:2], (V[:, 1], V[:, 0]), result["eigenvalues"][::-1]):
                arm.set_data(*np.transpose([start - 0.35 * direction, start + 0.35 * direction]))
                arm.set_linestyle("-" if value > 0 else (0, (4, 2)))
            first, second = result["shares"].T
            arms[2].set_data(*np.transpose([start, start + first, start + first + second]))

        return [*lines.values(), *arms], update

    return Stage(
        "near the saddle",
        scene=scene,
        compute=near_saddle,
        handles={"start": Handle((0.6, 0.2), step=0.02)},
        controls={"method": Choice({"Newton": "newton", "trust region": "trust_region"}, "newton", label="method")},
        fail={"start": (0.9, 0.35)},
        because="Farther from S the steps no longer lead to it.",
        describe=_saddle_caption,
        size=(7.0, 4.6),
    )


# --- Convexity ---

PLACES = 101  # on a chord
LOWEST = -225.0  # of the profile


def _curvature(matrix, x):
    """H of f, or 2 J'J, at places (..., 2)."""
    if matrix == "H":
        return wells.hessian(x)
    J = wells.jacobian(x)
    return 2 * np.swapaxes(J, -1, -2) @ J


def chord_between(state):
    """f and its chord from P to Q, and where the chosen matrix is positive definite on the way."""
    P, Q = state["P"], state["Q"]
    share, values, heights = chord(wells.value, P, Q, PLACES)
    positive = positive_definite(_curvature(state["matrix"], P + share[:, None] * (Q - P)))
    gap = values - heights
    return {
        "share": share, "values": values, "heights": heights, "positive": positive, "matrix": state["matrix"],
        "rise": max(float(gap.max()), 0.0), "above": gap > 1e-9 * np.abs(values).max(),
    }  # fmt: skip


def _chord_caption(result):
    words = {"H": "H", "J": "2 JᵀJ"}[result["matrix"]]
    ends = int(result["positive"][0]) + int(result["positive"][-1])
    where = ("at neither end", "at one end", "at both ends")[ends]
    rises = (
        f"f rises up to {result['rise']:.1f} above its chord" if result["above"].any() else "f stays below its chord"
    )
    share = 100 * result["positive"].mean()
    return f"From P to Q {rises}. {words} is positive definite {where} and on {share:.0f} % of the way."


def convexity():
    """Drag both ends of a chord: does it lie above f, and is the curvature positive definite on the way?"""

    def scene(fig):
        ax, beside = fig.subplots(1, 2, width_ratios=(1.15, 1))
        x, y = (-3.2, 3.0), (-4.0, 3.0)
        _map(ax, x, y)
        grid = _grid(x, y, 141)
        shades = draw.not_positive_definite(
            ax, grid[..., 0], grid[..., 1], np.linalg.eigvalsh(_curvature("H", grid))[..., 0]
        )
        ax.set_title("gray: not positive definite")
        line = draw.chord_on_map(ax)
        curve, straight, above, positive = draw.chord_profile(beside, LOWEST - 8, 5)

        def update(state, result):
            shades.set_visible(result["matrix"] == "H")
            line.set_data(*np.transpose([state["P"], state["Q"]]))
            share = result["share"]
            curve.set_data(share, result["values"])
            straight.set_data(share, result["heights"])
            above.set_data(share, np.where(result["above"], result["values"], np.nan))
            positive.set_data(share, np.where(result["positive"], LOWEST, np.nan))

        return [shades, line, curve, straight, above, positive], update

    return Stage(
        "where f is convex",
        scene=scene,
        compute=chord_between,
        handles={
            "P": Handle((0.8, 0.7), step=0.05, label="P, one end of the chord"),
            "Q": Handle((1.2, 1.1), step=0.05, label="Q, the other end"),
        },
        controls={"matrix": Choice({"H": "H", "2 JᵀJ": "J"}, "H", label="matrix")},
        fail={"P": (1.0, 1.0), "Q": (-1.0, -2.0)},
        describe=_chord_caption,
        size=(7.6, 4.4),
    )


# --- Basins ---


@cache
def basin_map(method):
    """Where each cell of the square ends: labels, shape (CELLS, CELLS), not to be written into."""
    labels, _ = wells.destinations(method, _grid(SQUARE, SQUARE, CELLS))
    labels.setflags(write=False)
    return labels


def covered_at_first(state):
    """Everything covered, or nothing."""
    return np.full((CELLS, CELLS), not state["all"])


def rub(state, event):
    """Uncover the cells within the brush's radius of its last places and of the straight ways between them."""
    covered, places = state["memory"].copy(), state["brush"][-60:]
    ways = [np.linspace(a, b, 2 + int(4 * np.abs(b - a).max() / BRUSH)) for a, b in zip(places, places[1:])]
    cells = np.linspace(*SQUARE, CELLS)
    for x, y in np.concatenate([places, *ways]):
        columns, rows = (slice(*np.searchsorted(cells, (at - BRUSH, at + BRUSH))) for at in (x, y))
        inside = (cells[None, columns] - x) ** 2 + (cells[rows, None] - y) ** 2 <= BRUSH**2
        covered[rows, columns] &= ~inside
    return covered


def basin_view(state):
    """Labels of the chosen method, what is still covered, the shares of what is free, and the path from the handle."""
    labels, covered = basin_map(state["method"]), state["memory"] & (not state["all"])
    free = labels[~covered]
    run = wells.run(state["method"], state["start"], max_iterations=SHOWN)
    shares = np.bincount(free, minlength=4) / max(free.size, 1)
    return {"labels": labels, "covered": covered, "shares": shares, "run": run, "method": state["method"]}


def _basin_caption(result):
    if result["covered"].all():
        return f"Nothing is uncovered yet{living(': rub over the square')}."
    shares = ", ".join(f"{name} {100 * share:.1f} %" for name, share in zip(wells.NAMES, result["shares"]))
    free = 100 * (1 - result["covered"].mean())
    return f"{_name(result['method'])}, {free:.0f} % uncovered, of that: {shares}."


def basins():
    """Rub the square free: the color of a place is where a run from there ends. The handle shows one run."""

    def scene(fig):
        ax, beside = fig.subplots(1, 2, width_ratios=(3.2, 1))
        _map(ax, SQUARE, SQUARE)
        names = [*ax.lines, *ax.texts]  # drawn anew over the colors
        half = (SQUARE[1] - SQUARE[0]) / (CELLS - 1) / 2
        image, fill = draw.basins(ax, beside, np.linspace(SQUARE[0] - half, SQUARE[1] + half, CELLS + 1))
        ax.set(xlim=SQUARE, ylim=SQUARE)
        (path,) = ax.plot([], [], color=style.INK, linewidth=1.4, marker="o", markersize=3.5, zorder=5)

        def update(state, result):
            fill(draw.basin_colors(result["labels"], result["covered"]))
            path.set_data(*np.clip(result["run"].x, -50, 50).T)

        return [image, *names, path], update

    return Stage(
        "basins of attraction",
        scene=scene,
        compute=basin_view,
        handles={"start": Handle((2.0, -2.0), step=0.1)},
        controls={
            "method": Choice(METHODS, "newton", label="method"),
            "all": Toggle(False, label="uncover everything"),
        },
        brush=True,
        start=covered_at_first,
        advance=rub,
        fail={"method": "gauss_newton", "all": True, "start": (4.0, 4.0)},
        because=(
            "From part of the square Gauss-Newton arrives nowhere, and from much of the rest not at the lower minimum."
        ),
        describe=_basin_caption,
        size=(7.0, 5.0),
    )
