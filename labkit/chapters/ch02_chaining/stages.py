"""Stages of chapter 2: order of a product, an opening loop, growth with the number of links, two loops."""

import functools

import numpy as np

from ...documents.lab_sheet import printed as lab_sheet
from ...estimation.gaussian import unit_noise
from ...geometry import chaining
from ...geometry.frames import pose, relative, transform
from ...geometry.lie import exp_se3, exp_so3
from ...stage import Choice, Handle, Slider, Stage, Target, style
from ...stage.marks import Readout
from ...stage.scene3d import Scene, View
from ...stage.scene3d_handles import Free, OnPlane
from . import figures as draw

RUNS = 100
LINK_LENGTH = 300.0  # mm, of the chains that grow
LOOP_SIZE = 300.0  # mm across, whatever the number of links
STD_TRANS = 0.1  # mm per coordinate and link
STDS_DEG = np.geomspace(0.01, 1.0, 9)  # the range of the slider
LAYOUTS = {"in a row": "row", "on a loop": "loop"}
CORNERS = np.array([[0, 0, 0], [400, 0, 0], [400, 300, 0], [0, 300, 0], [800, 0, 0], [800, 300, 0.0]])  # mm
EDGES = np.array([(0, 1), (1, 2), (2, 3), (3, 0), (1, 4), (4, 5), (5, 2)])
LOOP_A = ((0, True), (1, True), (2, True), (3, True))
LOOP_B = ((4, True), (5, True), (6, True), (1, False))
COMMON, LAST_OF_A, LAST_OF_B = 1, 3, 6  # links
WALKED = ((0, 1, 2, 3, 0), (1, 4, 5, 2))
STD_ROT_DEG = 0.2
LARGEST = 6.0  # mm along x and y, that a loop can be pulled open
METHODS = ("as measured", "A, then B", "B, then A", "graph")
MAGNIFIED = 30.0
WITHIN = ((-440.0, 360.0), (-580.0, 190.0), (0.0, 0.0))  # mm: where frames may be dragged: the plane of the loop
MOVES = ((-180.0, 180.0),) * 3  # mm: how far a move may shift
FLOOR = -120.0  # mm: the sheet's frames lie on a work piece, the measuring arm stands below
BESIDE = 150.0  # mm: its stand, from the middle of a link
AXES = {"z": 2, "x": 0, "y": 1}


def _turned(axis, angle, shift):
    """The pose of a turn (rad) about an axis (number), with a shift (3,)."""
    return pose(exp_so3(angle * np.eye(3)[axis]), shift)


def compute_order(state):
    """Two moves in space, A about z and B about x, their product in both orders, and how far the results are apart."""
    A = _turned(2, np.deg2rad(state["A_deg"]), state["A"])
    B = _turned(0, np.deg2rad(state["B_deg"]), state["B"])
    AB, BA = chaining.chain([A, B]), chaining.chain([B, A])
    turn, gap = chaining.closure_error(relative(AB, BA))
    return {"A": A, "B": B, "AB": AB, "BA": BA, "gap": float(gap), "turn_deg": float(np.rad2deg(turn))}


def _order_sentence(result):
    if result["gap"] < 0.5 and result["turn_deg"] < 0.5:
        return "Here both orders end at the same place: moves without a turn commute, and show nothing of the rule."
    return (
        f"The two ends lie {result['gap']:.0f} mm apart, and one is turned by {result['turn_deg']:.0f} deg against "
        "the other. Hollow cross: where the other order ends."
    )


def order_of_product():
    """T_A T_B and T_B T_A side by side: the second move is made in the frame that the first one has reached."""

    def scene(fig):
        panels = fig.subplots(1, 2)
        spaces = [
            Scene(ax, radius=235, title=f"first {order[0]}, then {order[1]}", floor=-90.0, unit="mm")
            for ax, order in zip(panels, ("AB", "BA"))
        ]
        sides = [draw.Moves(space, *order) for space, order in zip(spaces, ("AB", "BA"))]

        def update(state, result):
            ends = result["AB"], result["BA"]
            for side, first, end, other in zip(sides, "AB", ends, ends[::-1]):
                side.set(result[first], end, other)
            for space in spaces:
                space.draw(state["view"])

        return [artist for space in spaces for artist in space.artists], update

    return Stage(
        "order of a product",
        scene=scene,
        compute=compute_order,
        handles={
            "A": Handle((150.0, 40.0, 0.0), step=5.0, bounds=MOVES, label="origin of A", way=Free()),
            "B": Handle((60.0, 130.0, 60.0), step=5.0, bounds=MOVES, ax=1, label="origin of B", way=Free()),
        },
        controls={
            "A_deg": Slider(-180, 180, 60, step=5, label="turn of A about z (deg)"),
            "B_deg": Slider(-180, 180, 0, step=5, label="turn of B about x (deg)"),
        },
        view=View(-60, 24, center=(95.0, 75.0, 50.0), eye=2000.0),
        presets={"No turns": {"A_deg": 0, "B_deg": 0}},
        fail={"A_deg": 90, "B_deg": 90},
        because="Each move turns by 90 deg, and leads the move after it another way.",
        describe=_order_sentence,
    )


@functools.cache
def _sheet_angles():
    """Turn of K0 to K3 about z, as printed, and their origins in the plane."""
    poses = chaining.stations(lab_sheet.printed_transforms())[:4]
    return np.arctan2(poses[:, 1, 0], poses[:, 0, 0]), poses[:, :2, 3]


def _stand(start, end):
    """Where the measuring arm stands to measure a link: beside its middle, on the floor, outside of the loop."""
    way = (end - start)[:2]
    length = np.hypot(*way)
    beside = np.array([way[1], -way[0]]) / length if length > 1 else np.array([0.0, 1.0])
    return np.append((start + end)[:2] / 2 + BESIDE * beside, FLOOR)


def compute_open_loop(state):
    """A loop K0 K1 K2 K3 K0 whose link number `link` is measured with a turn of `turn_deg` about an axis of its end.

    `lever` is the distance of the loop's end from that axis.
    """
    angles, _ = _sheet_angles()
    origins = [np.zeros(3), *(state[f"K{k}"] for k in (1, 2, 3))]
    true = np.array([_turned(2, a, p) for a, p in zip(angles, origins)])
    links, number = relative(true, np.roll(true, -1, axis=0)), state["link"]
    axis = AXES[state["axis"]]
    links[number - 1] = links[number - 1] @ _turned(axis, np.deg2rad(state["turn_deg"]), np.zeros(3))
    measured = chaining.stations(links)
    angle, distance = chaining.closure_error(measured[-1])
    end = true[number % 4]
    about = end[:3, axis]
    return {
        "true": np.concatenate([true, true[:1]]),
        "measured": measured,
        "pivot": measured[number, :3, 3],
        "about": about,
        "lever": float(np.linalg.norm(np.cross(end[:3, 3], about))),
        "link": number,
        "axis": state["axis"],
        "angle_deg": float(np.rad2deg(angle)),
        "distance": float(distance),
        "at_piece": float(chaining.displacement(measured[-1], state["P"])),
        "piece": np.array([state["P"], transform(measured[-1], state["P"])]),
        "stand": _stand(true[number - 1, :3, 3], end[:3, 3]),
    }


def _loop_sentence(result):
    return (
        f"An error of {{turn_deg}} deg in link {{link}} turns all that follows about {result['axis']} of "
        f"K{result['link'] % 4}, "
        f"{result['lever']:.0f} mm from the end: the loop opens by {result['distance']:.1f} mm, "
        f"and by {result['at_piece']:.1f} mm at P. "
        f"The closure angle is the error itself: {result['angle_deg']:.1f} deg."
    )


def open_loop():
    """Turn one link by a few degrees and watch the loop open; drag the frames to change the levers."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.9, 1))
        space = Scene(left, radius=430, half_width=470, floor=FLOOR, unit="mm")
        loop = draw.Loop(space)
        style.bare(right)
        words = Readout(right)

        def update(state, result):
            loop.set(result)
            space.draw(state["view"])
            words.set_text(
                f"closure error\n   {result['angle_deg']:.2f} deg\n   {result['distance']:.2f} mm\n\n"
                f"at the work piece P\n   {result['at_piece']:.2f} mm\n\n"
                f"lever of link {result['link']}\n   {result['lever']:.0f} mm"
            )

        return [*space.artists, words], update

    _, origins = _sheet_angles()
    return Stage(
        "opening the loop",
        scene=scene,
        compute=compute_open_loop,
        handles={
            **{
                f"K{k}": Handle(
                    (*np.round(origins[k], 1), 0.0), step=5.0, bounds=WITHIN, label=f"frame K{k}", color=style.TRUTH,
                    way=OnPlane(),
                )
                for k in (1, 2, 3)
            },
            "P": Handle(
                (260.0, 60.0, 0.0), step=5.0, bounds=WITHIN, label="work piece", color=style.REJECTED, way=OnPlane()
            ),
        },
        controls={
            "link": Slider(1, 4, 2, label="link with the error"),
            "turn_deg": Slider(-10.0, 10.0, 3.0, step=0.1, label="its error (deg)"),
            "axis": Choice(list(AXES), "z", label="about"),
        },
        view=View(-72, 40, center=(-40.0, -190.0, 0.0), eye=2600.0),
        fail={"link": 2, "turn_deg": 10.0, "K2": (-250.0, -540.0, 0.0)},
        describe=_loop_sentence,
    )  # fmt: skip


@functools.cache
def _layout(name, n):
    """Links of a layout, and the closure distance per rad of noise."""
    links = chaining.straight_chain(n, LINK_LENGTH) if name == "row" else chaining.polygon_loop(n, LOOP_SIZE)
    return links, chaining.expected_closure(links, 1.0, 0.0)[1]


def _law(name, n, std_rot):
    """Closure distance to expect (mm, rms): `chaining.expected_closure` with the sum over the levers remembered."""
    return np.hypot(np.sqrt(3 * n) * STD_TRANS, _layout(name, n)[1] * std_rot)


@functools.lru_cache(maxsize=2)
def _errors(std_rot):
    """Error of each of 64 links in RUNS runs, shape (64, runs, 4, 4); kept while only the number of links changes."""
    return exp_se3(unit_noise((max(draw.LINKS), RUNS, 6), seed=2) * np.repeat([std_rot, STD_TRANS], 3))


def compute_growth(state):
    """Noisy chains of n links: heights of all their frames (mm), where they end, closure distance (mm, rms) of chains
    of 1 to 64 links, and the law for both layouts and for all errors of a link that can be chosen.
    """
    name, n, std_rot = state["layout"], state["n"], np.deg2rad(state["std_rot_deg"])
    links = _layout(name, n)[0]
    right, noisy = chaining.stations(links), chaining.stations(links[:, None] @ _errors(std_rot)[:n])
    off = noisy[:, :, :3, 3] - right[:, None, :3, 3]
    distance = np.sqrt((off[-1] ** 2).sum(-1).mean())
    return {
        "n": n,
        "layout": name,
        "heights": off[..., 2],
        "std_heights": chaining.expected_heights(links, std_rot, STD_TRANS),
        "here": float(distance),
        "expected": float(_law(name, n, std_rot)),
        "laws": {name: np.array([_law(name, k, std_rot) for k in draw.LINKS]) for name in LAYOUTS.values()},
        "others": np.array([[_law(name, k, np.deg2rad(std)) for k in draw.LINKS] for std in STDS_DEG]),
    }


def _mm(length):
    return f"{length:.0f} mm" if length >= 100 else f"{length:.2g} mm"


def growth():
    """A hundred chains open like a trumpet: in a row with every link wider, on a loop of fixed size hardly."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.35, 1))
        runs, law, mean = draw.trumpet_axes(left, RUNS)
        ghosts, laws, here = draw.growth_axes(right)

        def update(state, result):
            heights, frames = result["heights"], np.arange(result["n"] + 1)
            lines = np.stack(np.broadcast_arrays(frames, heights.T), axis=-1)
            runs.set(lines)
            law.set_data([*frames, np.nan, *frames], [*result["std_heights"], np.nan, *-result["std_heights"]])
            mean.set_data(frames, 0.0 * frames)
            draw.set_edge(left, 1.05 * max(np.abs(heights).max(), result["std_heights"].max()))
            ghosts.set([np.column_stack([draw.LINKS, other]) for other in result["others"]])
            for line, values in zip(laws, result["laws"].values()):
                line.set_data(draw.LINKS, values)
            here.set_data([result["n"]], [result["here"]])

        return [*runs.artists, mean, law, *ghosts.artists, *laws, here], update

    return Stage(
        "growth with the number of links",
        scene=scene,
        compute=compute_growth,
        controls={
            "n": Slider(1, 64, 16, label="links"),
            "std_rot_deg": Slider(0.01, 1.0, 0.1, label="error of a link (deg)", log=True),
            "layout": Choice(LAYOUTS, "row", label="frames"),
        },
        fail={"n": 64, "std_rot_deg": 1.0},
        because=(
            "Four times the links, each turned ten times as wrongly: a turn acts on all the links that follow it."
        ),
        target=Target(
            "32 links in a row that end within 20 mm (rms)",
            lambda result: result["layout"] == "row" and result["n"] >= 32 and result["expected"] < 20,
        ),
        describe=lambda result: (
            f"{{n}} links {'in a row' if result['layout'] == 'row' else 'on a loop'}, each turned by {{std_rot_deg}} "
            f"deg: the chain ends {_mm(result['here'])} off (rms of {RUNS} runs); the law says "
            f"{_mm(result['expected'])}."
        ),
    )


def compute_two_loops(state):
    """Two rectangles with a common link, of which three links are measured wrongly: the last of A and the last of B by
    what was dragged, the common one by a turn. The walk around each loop after sharing out, and what is left open (mm)
    by each way.
    """
    noise = np.tile(np.eye(4), (len(EDGES), 1, 1))
    noise[LAST_OF_A, :2, 3] = (state["A"] - CORNERS[0, :2]) / MAGNIFIED
    noise[LAST_OF_B, :2, 3] = (state["B"] - CORNERS[2, :2]) / MAGNIFIED
    noise[COMMON] = _turned(AXES["z"], np.deg2rad(state["turn_deg"]), np.zeros(3))
    true = np.tile(np.eye(4), (len(CORNERS), 1, 1))
    true[:, :3, 3] = CORNERS
    measured = relative(true[EDGES[:, 0]], true[EDGES[:, 1]]) @ noise
    graph = chaining.solve_pose_graph(EDGES, measured, np.deg2rad(STD_ROT_DEG), STD_TRANS)
    links = {
        "as measured": measured,
        "A, then B": chaining.distribute_in_turn(measured, (LOOP_A, LOOP_B)),
        "B, then A": chaining.distribute_in_turn(measured, (LOOP_B, LOOP_A)),
        "graph": relative(graph.poses[EDGES[:, 0]], graph.poses[EDGES[:, 1]]),
    }
    every = np.stack(list(links.values()), axis=1)
    left = [chaining.closure_error(chaining.chain(chaining.around(every, loop)))[1] for loop in (LOOP_A, LOOP_B)]
    return {
        "measured": _walks(measured),
        "walks": _walks(links[state["way"]]),
        "left": dict(zip(links, np.transpose(left))),
        "way": state["way"],
    }


def _walks(links):
    """Origins along 0-1-2-3-0 and along 1-4-5-2, (5, 2) and (4, 2), their way off the true corners magnified."""
    around_a = chaining.stations(links[list(range(4))])
    around_b = around_a[1] @ chaining.stations(links[[4, 5, 6]])
    true = [CORNERS[list(walked), :2] for walked in WALKED]
    return [at + MAGNIFIED * (walk[:, :2, 3] - at) for at, walk in zip(true, (around_a, around_b))]


def _loops_sentence(result):
    words = (f"{name} {a + 0.0:.2f} and {b + 0.0:.2f}" for name, (a, b) in result["left"].items())
    return f"The common link is turned by {{turn_deg}} deg. Left open in A and B (mm): {'; '.join(words)}."


def _closes_both(result):
    return result["left"]["as measured"][0] > 3.99 and result["left"]["A, then B"].max() < 0.05


def two_loops():
    """Two loops with a common link: pull either open; sharing out one opens the other, the pose graph closes both.

    A plan: the loops lie in a plane, and gaps that are magnified could not be compared in a perspective.
    """

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.7, 1))
        measured, walks, gaps = draw.plan_of_two_loops(
            left, CORNERS[:, :2], EDGES, f"errors magnified {MAGNIFIED:.0f} times"
        )
        series, chosen = draw.compare_loops(right, METHODS)

        def update(state, result):
            around_a, around_b = result["walks"]
            measured.set(result["measured"])
            for line, origins in zip(walks, result["walks"]):
                line.set_data(*origins.T)
            for gap, ends in zip(gaps, ((around_a[0], around_a[-1]), (around_a[2], around_b[-1]))):
                gap.set_data(*np.transpose(ends))
            for k, (bars, values) in enumerate(zip(series, result["left"].values())):
                bars.set_data(*draw.levels(k, values))
            chosen.set_data(*draw.levels(METHODS.index(result["way"]), result["left"][result["way"]]))

        return [*measured.artists, *gaps, *walks, chosen, *series], update

    reach = MAGNIFIED * LARGEST
    return Stage(
        "two loops",
        scene=scene,
        compute=compute_two_loops,
        handles={
            name: Handle(
                at, step=MAGNIFIED / 10, label=f"where the way around loop {name} was measured to end",
                bounds=[(float(x) - reach, float(x) + reach) for x in corner], color=style.MEASUREMENT,
            )
            for name, at, corner in (("A", (-75.0, -60.0), CORNERS[0, :2]), ("B", (490.0, 390.0), CORNERS[2, :2]))
        },
        controls={
            "way": Choice(METHODS, "A, then B", label="shared out"),
            "turn_deg": Slider(-0.4, 0.4, 0.0, step=0.02, label="turn of the common link (deg)"),
        },
        fail={"A": (0.0, 0.0), "B": (580.0, 480.0)},
        because="A was measured without an error; closing B moves the common link, and tears A open.",
        target=Target("“A, then B” closes both, with A measured 4 mm open", _closes_both),
        describe=_loops_sentence,
    )  # fmt: skip
