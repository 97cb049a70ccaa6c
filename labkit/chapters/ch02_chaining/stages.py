"""Stages of chapter 2: order of a product, an opening loop, growth with the number of links, two loops."""

import functools

import numpy as np

from ...documents.lab_sheet import printed as lab_sheet
from ...estimation.gaussian import unit_noise
from ...geometry import chaining
from ...geometry.frames import relative
from ...geometry.lie import exp_se3
from ...stage import Choice, Handle, Slider, Stage, style
from ...stage.marks import PlaneFrame
from . import figures as draw

RUNS = 100
LINK_LENGTH = 300.0  # mm, of the chains that grow
LOOP_SIZE = 300.0  # mm across, whatever the number of links
STD_TRANS = 0.1  # mm per coordinate and link
LAYOUTS = {"in a row": "row", "on a loop": "loop"}
CORNERS = np.array([[0, 0, 0], [400, 0, 0], [400, 300, 0], [0, 300, 0], [800, 0, 0], [800, 300, 0.0]])  # mm
EDGES = np.array([(0, 1), (1, 2), (2, 3), (3, 0), (1, 4), (4, 5), (5, 2)])
LOOP_A = ((0, True), (1, True), (2, True), (3, True))
LOOP_B = ((4, True), (5, True), (6, True), (1, False))
METHODS = ("as measured", "A, then B", "B, then A", "graph")
MAGNIFIED = 30.0
WITHIN = ((-440.0, 360.0), (-580.0, 190.0))  # mm: where frames may be dragged, so that their names stay in the picture


def _planar(angle, xy):
    T = np.eye(4)
    T[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    T[:2, 3] = xy
    return T


def compute_order(state):
    """Two moves A and B in the plane, their product in both orders, and how far the results are apart."""
    A, B = (_planar(np.deg2rad(state[f"{k}_deg"]), state[k]) for k in "AB")
    AB, BA = chaining.chain([A, B]), chaining.chain([B, A])
    return {"A": A, "B": B, "AB": AB, "BA": BA, "gap": float(np.linalg.norm(AB[:3, 3] - BA[:3, 3]))}


def free_direction(directions):
    """The angle (rad) in the middle of the widest gap between plane directions, shape (n, 2)."""
    directions = np.asarray(directions, dtype=float)
    x, y = directions[np.linalg.norm(directions, axis=1) > 1e-9].T
    angles = np.sort(np.arctan2(y, x))
    gaps = np.diff(angles, append=angles[0] + 2 * np.pi)
    widest = np.argmax(gaps)
    return float(angles[widest] + gaps[widest] / 2)


def order_of_product():
    """T_A T_B and T_B T_A side by side: the second move is made in the frame that the first one has reached."""

    def scene(fig):
        panels = fig.subplots(1, 2, sharex=True, sharey=True)
        frames, paths = [], []
        for ax, first, second in zip(panels, "AB", "BA"):
            style.axes(ax, "x (mm)", "y (mm)" if first == "A" else "", f"first {first}, then {second}", equal=True)
            ax.set(xlim=(-400, 400), ylim=(-400, 400))
            PlaneFrame(ax, "0", 70).set(np.eye(4))
            middle = PlaneFrame(ax, first, 70, linestyle=(0, (4, 1.5)))
            end = PlaneFrame(ax, first + second, 90)
            (path,) = ax.plot([], [], **style.look("estimate", linewidth=1.4))
            (other,) = ax.plot([], [], **style.look("rejected", markersize=9))
            frames.append((middle, end))
            paths.append((path, other))

        def update(state, result):
            ends = (result["AB"], result["BA"])
            for k, (first, end, other) in enumerate(zip("AB", ends, ends[::-1])):
                frames[k][0].set(result[first])
                frames[k][1].set(end)
                middle = result[first][:2, 3]
                way = end[:2, 3] - middle
                draw.set_name(frames[k][0], free_direction([*result[first][:2, :2].T, -middle, way]))
                draw.set_name(frames[k][1], free_direction([*end[:2, :2].T, -way]))
                paths[k][0].set_data(*np.transpose([(0, 0), middle, end[:2, 3]]))
                paths[k][1].set_data(*other[:2, 3:])

        artists = [a for pair in paths for a in pair] + [a for pair in frames for f in pair for a in f.artists]
        return artists, update

    return Stage(
        "order of a product",
        scene=scene,
        compute=compute_order,
        handles={
            "A": Handle((150.0, 40.0), step=5.0, bounds=((-150, 150), (-150, 150)), label="origin of A"),
            "B": Handle((60.0, 130.0), step=5.0, bounds=((-150, 150), (-150, 150)), ax=1, label="origin of B"),
        },
        controls={
            "A_deg": Slider(-180, 180, 60, step=5, label="turn of A (deg)"),
            "B_deg": Slider(-180, 180, 0, step=5, label="turn of B (deg)"),
        },
        presets={"No turns": {"A_deg": 0, "B_deg": 0}},
        fail={"A_deg": 180, "B_deg": 180},
        because="Each move turns by 180 deg, and sends the move after it the opposite way.",
        describe=lambda result: (
            f"The two ends lie {result['gap']:.0f} mm apart. Hollow cross: where the other order ends."
            if result["gap"] > 0.5
            else "Here both orders end at the same place: moves without a turn commute, and show nothing of the rule."
        ),
    )


@functools.cache
def _sheet_angles():
    """Turn of K0 to K3 about z, as printed, and their origins in the plane."""
    poses = chaining.stations(lab_sheet.printed_transforms())[:4]
    return np.arctan2(poses[:, 1, 0], poses[:, 0, 0]), poses[:, :2, 3]


def compute_open_loop(state):
    """A loop K0 K1 K2 K3 K0 in the plane whose link number `link` is measured with a turn of `turn_deg`."""
    angles, _ = _sheet_angles()
    origins = [np.zeros(2), *(state[f"K{k}"] for k in (1, 2, 3))]
    true = np.array([_planar(a, xy) for a, xy in zip(angles, origins)])
    links = relative(true, np.roll(true, -1, axis=0))
    turn = np.deg2rad(state["turn_deg"])
    links[state["link"] - 1] = links[state["link"] - 1] @ _planar(turn, (0, 0))
    measured = chaining.stations(links)
    angle, distance = chaining.closure_error(measured[-1])
    place = np.append(state["P"], 0.0)
    return {
        "true": np.concatenate([true, true[:1]]),
        "measured": measured,
        "pivot": measured[state["link"], :2, 3],
        "lever": float(np.linalg.norm(true[state["link"] % 4, :2, 3])),
        "link": state["link"],
        "angle_deg": float(np.rad2deg(angle)),
        "distance": float(distance),
        "at_piece": float(chaining.displacement(measured[-1], place)),
        "piece": np.transpose([place[:2], (measured[-1] @ np.append(place, 1.0))[:2]]),
    }


def open_loop():
    """Turn one link by a few degrees and watch the loop open; drag the frames to change the levers."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.7, 1))
        draw.plan_of_loop(left)
        true = draw.Chain(left, "truth", 55, axes=False)
        measured = draw.Chain(left, "estimate", 55)
        (lever,) = left.plot([], [], **style.look("guide", linewidth=2))
        (gap,) = left.plot([], [], color=style.REJECTED, linewidth=3)
        (piece,) = left.plot([], [], color=style.REJECTED, linewidth=3, marker="x", markersize=7)
        labels = draw.names(left, ("K0", "K1", "K2", "K3", "P"))
        style.bare(right)
        words = right.text(0.0, 0.95, "", transform=right.transAxes, va="top", linespacing=1.7)

        def update(state, result):
            true.set(result["true"])
            measured.set(result["measured"])
            start, end = result["true"][0, :2, 3], result["measured"][-1, :2, 3]
            lever.set_data(*np.transpose([result["pivot"], end]))
            gap.set_data(*np.transpose([start, end]))
            piece.set_data(*result["piece"])
            for label, xy in zip(labels, [*result["true"][:4, :2, 3], state["P"]]):
                label.xy = tuple(xy)
            words.set_text(
                f"closure error\n   {result['angle_deg']:.2f} deg\n   {result['distance']:.2f} mm\n\n"
                f"at the work piece P\n   {result['at_piece']:.2f} mm\n\n"
                f"lever of link {result['link']}\n   {result['lever']:.0f} mm"
            )

        return [lever, *true.artists, *measured.artists, gap, piece, *labels, words], update

    _, origins = _sheet_angles()
    return Stage(
        "opening the loop",
        scene=scene,
        compute=compute_open_loop,
        handles={
            **{
                f"K{k}": Handle(
                    tuple(np.round(origins[k], 1)), step=5.0, bounds=WITHIN, label=f"frame K{k}", color=style.TRUTH
                )
                for k in (1, 2, 3)
            },
            "P": Handle((260.0, 60.0), step=5.0, bounds=WITHIN, label="work piece", color=style.REJECTED),
        },
        controls={
            "link": Slider(1, 4, 2, label="link with the error"),
            "turn_deg": Slider(-10.0, 10.0, 3.0, step=0.1, label="its error (deg)"),
        },
        fail={"link": 2, "turn_deg": 10.0, "K2": (-250.0, -540.0)},
        describe=lambda result: (
            f"An error in link {result['link']} turns all that follows about K{result['link'] % 4}, "
            f"{result['lever']:.0f} mm from the end: the loop opens by {result['distance']:.1f} mm, "
            f"and by {result['at_piece']:.1f} mm at P. "
            f"The closure angle is the error itself: {result['angle_deg']:.1f} deg."
        ),
    )


@functools.cache
def _layout(name, n):
    """Links of a layout, where they should end seen backward, and the closure distance per rad of noise."""
    links = chaining.straight_chain(n, LINK_LENGTH) if name == "row" else chaining.polygon_loop(n, LOOP_SIZE)
    return links, relative(chaining.chain(links), np.eye(4)), chaining.expected_closure(links, 1.0, 0.0)[1]


def _law(name, n, std_rot):
    """Closure distance to expect (mm, rms): `chaining.expected_closure` with the sum over the levers remembered."""
    return np.hypot(np.sqrt(3 * n) * STD_TRANS, _layout(name, n)[2] * std_rot)


@functools.lru_cache(maxsize=2)
def _errors(std_rot):
    """Error of each of 64 links in RUNS runs, shape (64, runs, 4, 4); kept while only the number of links changes."""
    return exp_se3(unit_noise((max(draw.LINKS), RUNS, 6), seed=2) * np.repeat([std_rot, STD_TRANS], 3))


def _ends(name, n, errors):
    """Where noisy chains of a layout end, seen from where they should end; errors (64, runs, 4, 4) -> (runs, 3)."""
    links, back, _ = _layout(name, n)
    noisy = links[:, None] @ errors[:n]
    end = back @ noisy[0]
    for T in noisy[1:]:
        end = end @ T
    return end[:, :3, 3]


def compute_growth(state):
    """Closure distance (mm, rms) of noisy chains of 1 to 64 links: both laws, simulation of the chosen layout."""
    std_rot = np.deg2rad(state["std_rot_deg"])
    numbers = np.unique([*draw.LINKS, state["n"]])
    errors = _errors(std_rot)
    ends = {n: _ends(state["layout"], n, errors) for n in numbers.tolist()}
    return {
        "n": state["n"],
        "layout": state["layout"],
        "ends": ends[state["n"]],
        "numbers": numbers,
        "found": np.array([np.sqrt((e**2).sum(-1).mean()) for e in ends.values()]),
        "here": float(np.sqrt((ends[state["n"]] ** 2).sum(-1).mean())),
        "expected": float(_law(state["layout"], state["n"], std_rot)),
        "laws": {name: np.array([_law(name, n, std_rot) for n in draw.LINKS]) for name in LAYOUTS.values()},
    }


def _mm(length):
    return f"{length:.0f} mm" if length >= 100 else f"{length:.2g} mm"


def growth():
    """How the closure error grows with the number of links, in a row and on a loop of fixed size."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1, 1.15))
        cloud, circle = draw.cloud_axes(left)
        laws, found, here = draw.growth_axes(right)

        def update(state, result):
            cloud.set_data(*result["ends"][:, 1:].T)
            draw.set_circle(circle, result["expected"])
            draw.set_edge(left, 1.05 * max(np.abs(result["ends"][:, 1:]).max(), result["expected"]))
            for line, law in zip(laws, result["laws"].values()):
                line.set_data(draw.LINKS, law)
            found.set_data(result["numbers"], result["found"])
            here.set_data([result["n"]], [result["here"]])

        return [cloud, circle, *laws, found, here], update

    return Stage(
        "growth with the number of links",
        scene=scene,
        compute=compute_growth,
        controls={
            "n": Slider(1, 64, 8, label="links"),
            "std_rot_deg": Slider(0.01, 1.0, 0.1, label="error of a link (deg)", log=True),
            "layout": Choice(LAYOUTS, "row", label="frames"),
        },
        fail={"n": 64, "std_rot_deg": 1.0},
        because=(
            "Eight times the links, each turned ten times as wrongly: a turn acts on all the links that follow it."
        ),
        describe=lambda result: (
            f"{result['n']} links {'in a row' if result['layout'] == 'row' else 'on a loop'}: the chain ends "
            f"{_mm(result['here'])} off (rms of {RUNS} runs); the law says {_mm(result['expected'])}."
        ),
    )


def compute_two_loops(state):
    """Two rectangles with a common link: closure left in each (mm) after sharing out, and by the graph."""
    true = np.tile(np.eye(4), (len(CORNERS), 1, 1))
    true[:, :3, 3] = CORNERS
    std_rot = np.deg2rad(state["std_rot_deg"])
    rng = np.random.default_rng(state["run"])
    noise = exp_se3(rng.normal(size=(len(EDGES), 6)) * np.repeat([std_rot, STD_TRANS], 3))
    measured = relative(true[EDGES[:, 0]], true[EDGES[:, 1]]) @ noise
    graph = chaining.solve_pose_graph(EDGES, measured, std_rot, STD_TRANS)
    links = {
        "as measured": measured,
        "A, then B": chaining.distribute_in_turn(measured, (LOOP_A, LOOP_B)),
        "B, then A": chaining.distribute_in_turn(measured, (LOOP_B, LOOP_A)),
        "graph": relative(graph.poses[EDGES[:, 0]], graph.poses[EDGES[:, 1]]),
    }
    every = np.stack(list(links.values()), axis=1)
    left = [chaining.closure_error(chaining.chain(chaining.around(every, loop)))[1] for loop in (LOOP_A, LOOP_B)]
    left = dict(zip(links, np.transpose(left)))
    return {"true": true, "graph": graph.poses, "walked": _walk(links["A, then B"]), "left": left}


def _walk(links):
    """Poses of the six frames along 0-1-2-3 and 1-4-5, shape (6, 4, 4)."""
    poses = {0: np.eye(4)}
    for k in (0, 1, 2, 4, 5):
        i, j = EDGES[k]
        poses[j] = poses[i] @ links[k]
    return np.array([poses[i] for i in range(6)])


def two_loops():
    """Two loops with a common link: sharing out one opens the other, the pose graph closes both."""
    outline = np.array([0, 1, 2, 3, 0, 1, 4, 5, 2])

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.6, 1))
        style.axes(left, "x (mm)", "y (mm)", f"errors magnified {MAGNIFIED:.0f} times", equal=True)
        left.set(xlim=(-180, 980), ylim=(-260, 640))
        truth = draw.Chain(left, "truth", 0, axes=False)
        walked = draw.Chain(left, "prediction", 0, axes=False)
        graph = draw.Chain(left, "estimate", 0, axes=False, marker="D")
        for letter, x in (("A", 200), ("B", 600)):
            left.text(x, 150, letter, ha="center", va="center", fontsize=14, color=style.MUTED)
        lines = (truth.line, walked.line, graph.line)
        left.legend(lines, ("truth", "A, then B", "graph"), loc="upper center", ncols=3, columnspacing=1.2)
        series = draw.compare_loops(right, METHODS)

        def magnified(poses, true):
            poses = poses[outline].copy()
            poses[:, :3, 3] = true[outline, :3, 3] + MAGNIFIED * (poses[:, :3, 3] - true[outline, :3, 3])
            return poses

        def update(state, result):
            truth.set(result["true"][outline])
            walked.set(magnified(result["walked"], result["true"]))
            graph.set(magnified(result["graph"], result["true"]))
            for markers, (shift, values) in zip(series, zip((-0.24, -0.08, 0.08, 0.24), result["left"].values())):
                markers.set_data(np.arange(2) + shift, np.minimum(values, 11.8))

        return [*lines, *series], update

    def sentence(result):
        words = (f"{name} {a + 0.0:.2f} and {b + 0.0:.2f}" for name, (a, b) in result["left"].items())
        return f"Closure left in A and B (mm): {'; '.join(words)}."

    return Stage(
        "two loops",
        scene=scene,
        compute=compute_two_loops,
        controls={
            "run": Slider(1, 30, 3, label="measurement number"),
            "std_rot_deg": Slider(0.01, 0.4, 0.2, step=0.01, label="error of a link (deg)"),
        },
        fail={"run": 7, "std_rot_deg": 0.4},
        because="Another measurement, with twice the error: closing B opens A wider than it was before.",
        describe=sentence,
    )
