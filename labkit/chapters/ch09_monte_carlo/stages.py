"""Stages of chapter 9: corridor, maps, sensor models over the building, resampling, recorded runs, the arena."""

import functools
import itertools

import numpy as np

from ...documents.lecture.examples import global_example, load_building, soccer_run
from ...documents.lecture.printed import example_noise
from ...fast.particles import resample_systematic
from ...fast.sensors import SensorSuite, weigh_beams
from ...localization import maps, mcl, odometry, particles
from ...localization.drives import Wanderer
from ...localization.sensors import SENSORS, weigh_doors, weigh_likelihood_field
from ...stage import Choice, Handle, Play, Slider, Stage, Target, living, style
from . import figures as draw

CORRIDOR = 12.0  # m
SHOWN = 300  # particles of the corridor
DT = 0.5  # s, one step of the arena and of the twelve pictures
HISTORY = 120  # steps of the arena's error curve
HEAT_DEPTH = -250.0  # log weights below the best one by more look alike
DISK = 0.15  # m, radius of the mouse's pen
FEW, SETTLED = 500, 20  # particles, steps: the arena then says why it fails


@functools.cache
def building():
    """The chapter's building, read once."""
    return load_building()


@functools.cache
def recovery():
    """Random poses from all over the building."""
    return mcl.Recovery(functools.partial(particles.uniform_states, building().grid))


@functools.cache
def suite():
    """Its sensors; the range table is made here, once."""
    made = SensorSuite(building())
    _ = made.ranges
    return made


# Corridor ------------------------------------------------------------------------------------------------------------


def compute_corridor(state):
    """Five pictures: places (n,) and heights (n,) of the particles, the true place, and what the door sensor said. The
    wall at the corridor's end stops robot and particles.
    """
    rng = np.random.default_rng(2)
    doors = np.array([state[f"D{k}"][0] for k in (1, 2, 3)])
    truth, x = float(state["robot"][0]), rng.uniform(0, CORRIDOR, SHOWN)
    shots, said = [(x, np.full(SHOWN, 0.6), truth)], []
    for _ in range(2):
        said.append(bool(np.abs(doors - truth).min() < 0.45))
        weights = np.exp(weigh_doors(doors, said[-1])(x))
        shots.append((x, weights / weights.max(), truth))
        x = x[resample_systematic(weights, rng)]
        x = np.clip(x + state["move"] + state["std"] * rng.standard_normal(SHOWN), 0.0, CORRIDOR)
        truth = min(truth + state["move"], CORRIDOR)
        shots.append((x, np.full(SHOWN, 0.6), truth))
    return {"shots": shots, "doors": doors, "said": said, "near": float(np.mean(np.abs(x - truth) < 0.6))}


def corridor():
    """Drag the doors and the robot's first place: the lecture's pictures (a) to (e) follow."""

    def scene(fig):
        axes, doors, sticks, places = draw.corridor(fig, CORRIDOR)
        words = [ax.text(1, 1.02, "", transform=ax.transAxes, ha="right", va="bottom") for ax in (axes[1], axes[3])]

        def update(state, result):
            for door in doors:
                half = 0.25 * np.array([-1, 1])[:, None]
                x = np.concatenate([result["doors"] + half, np.full((1, 3), np.nan)]).T.ravel()
                door.set_data(x, np.zeros(9))
            for stick, place, (x, height, truth) in zip(sticks, places, result["shots"]):
                stick.set_data(*draw.bars(x, height))
                place.set_data([truth], [1.0])
            for word, saw in zip(words, result["said"]):
                word.set_text("sees a door" if saw else "sees a wall")

        return [*doors, *sticks, *places, *words], update

    row = ((0.0, CORRIDOR), (0.0, 0.0))
    return Stage(
        "corridor",
        scene=scene,
        compute=compute_corridor,
        handles={
            **{
                f"D{k}": Handle((x, 0.0), step=0.1, bounds=row, label=f"door {k}", color=style.MEASUREMENT)
                for k, x in ((1, 2.0), (2, 4.0), (3, 9.0))
            },
            "robot": Handle((2.0, 1.0), step=0.1, bounds=((0.0, CORRIDOR), (1.0, 1.0)), label="robot at the start"),
        },
        controls={
            "move": Slider(0.5, 4.0, 2.0, step=0.1, label="each move (m)"),
            "std": Slider(0.0, 0.6, 0.1, step=0.05, label="noise of a move (m)"),
        },
        fail={"D3": (6.0, 0.0)},
        because="The doors stand as far apart as the robot moves: a second door fits two places alike.",
        size=(7.0, 5.4),
        describe=lambda result: (
            f"After (e), {100 * result['near']:.0f} % of the particles lie within 0.6 m of the robot."
        ),
    )


# Maps ----------------------------------------------------------------------------------------------------------------

FAR = 2.0  # m
FORMS = ("occupancy grid", "lines", "points", "graph", "distance field", "likelihood field")


def compute_maps(state):
    """What each form of the map answers at the probe, in words; the places that lines, points and graph mean; how far
    (m) every wall is from it, by the distance field, if it is free.
    """
    b, at = building(), state["probe"]
    i, j = b.grid.cell_of(at)
    inside = 0 <= i < b.grid.cells.shape[0] and 0 <= j < b.grid.cells.shape[1]
    nodes = np.array(list(b.nodes.values()))
    node = int(np.argmin(np.hypot(*(nodes - at).T)))
    means = {
        "lines": maps.nearest_on_lines(b.lines, at),
        "points": b.points[np.argmin(np.hypot(*(b.points - at).T))],
        "graph": nodes[node],
    }
    off = {form: float(np.hypot(*(place - at))) for form, place in means.items()}
    cell = ("free", "occupied", "unknown")[int(b.grid.at(at))]
    distance, weight = (float(table[i, j]) if inside else np.nan for table in (b.grid.distance, suite().field.table))
    return {
        "means": means,
        "free_by": distance if cell == "free" else 0.0,
        "answers": {
            "occupancy grid": cell,
            "lines": f"a wall {off['lines']:.2f} m away",
            "points": f"a point {off['points']:.2f} m away",
            "graph": f"near “{list(b.nodes)[node]}”",
            "distance field": f"obstacle in {distance:.2f} m" if inside else "beyond the map",
            "likelihood field": f"log weight {weight:.1f}" if inside else "beyond the map",
        },
    }


@functools.cache
def stored():
    """How many numbers each form of the map holds."""
    b = building()
    graph = 2 * len(b.nodes) + 2 * len(b.edges)
    return dict(zip(FORMS, (b.grid.cells.size, b.lines.size, b.points.size, graph, *2 * (b.grid.cells.size,))))


def _maps_sentence(result):
    told = "; ".join(f"{form}: {answer}" for form, answer in result["answers"].items())
    return f"Under the probe, {told}."


def map_forms():
    """One building as the lecture's four kinds of map and the two fields of the grid: one probe asks all six."""

    def scene(fig):
        axes = fig.subplots(2, 3).ravel()
        b, field = building(), suite().field
        pictures = [draw.MapForm(ax, form, stored()[form], b, field) for ax, form in zip(axes, FORMS)]

        def update(state, result):
            for form, picture in zip(FORMS, pictures):
                picture.set(state["probe"], result["answers"][form], result["means"].get(form))

        return [artist for picture in pictures for artist in picture.artists], update

    return Stage(
        "one building, six maps",
        scene=scene,
        compute=compute_maps,
        handles={"probe": Handle((5.0, 5.3), step=0.1, label="probe", color=style.ESTIMATE)},
        fail={"probe": (15.6, 9.8)},
        because="The probe stands where nothing was ever measured: some maps say so, the others answer all the same.",
        target=Target(f"a place {FAR} m from every wall", lambda result: result["free_by"] >= FAR),
        describe=_maps_sentence,
        size=(7.6, 4.4),
    )


# Beam model against likelihood field ---------------------------------------------------------------------------------


@functools.cache
def _places(step=0.25):
    """Free places of the building, (n, 2), and their cells in a coarse picture: (rows, columns, shape)."""
    left, right, bottom, top = building().grid.extent
    x, y = np.meshgrid(np.arange(left + step / 2, right, step), np.arange(bottom + step / 2, top, step))
    free = building().grid.at(np.stack([x, y], axis=-1)) == maps.FREE
    return np.column_stack([x[free], y[free]]), np.nonzero(free), x.shape


def compute_heat(state):
    """Log weights of one scan over the building for both models, relative to the best place, and the scan itself."""
    b, sensors = building(), suite()
    pose = np.array([*state["robot"], np.deg2rad(state["heading_deg"])])
    world = b.grid
    if state["scan"] != "as mapped":
        world = world.with_disks([(*(pose[:2] + 0.9 * np.array([np.cos(pose[2]), np.sin(pose[2])])), 0.25)])
    ranges, bearings = sensors.scan(pose, np.random.default_rng(4), world)
    xy, cells, shape = _places()
    poses = np.column_stack([xy, np.full(len(xy), pose[2])])
    shares = (1, 0, 0, 0) if state["beams"] == "plain" else (0.75, 0.1, 0.05, 0.1)
    models = {
        "beams": weigh_beams(sensors.ranges, ranges, bearings, 0.2, 18.0, shares=shares),
        "field": weigh_likelihood_field(sensors.field, ranges, bearings),
    }
    free = bool(b.grid.at(pose[:2]) == maps.FREE)
    result = {"pose": pose, "ends": _ends(pose, ranges, bearings), "free": free}
    for name, weigh in models.items():
        log_w = weigh(poses)
        best = log_w.max()
        picture = np.full(shape, np.nan)
        picture[cells] = np.maximum(log_w - best, HEAT_DEPTH) if np.isfinite(best) else HEAT_DEPTH
        result[name] = picture
        result[f"{name}_possible"] = bool(np.isfinite(best))
        result[f"{name}_off"] = float(np.hypot(*(xy[np.argmax(log_w)] - pose[:2]))) if np.isfinite(best) else np.inf
        away = np.hypot(*(xy - pose[:2]).T) > 2.0
        result[f"{name}_elsewhere"] = float(log_w[away].max() - best) if np.isfinite(best) else -np.inf
    return result


def _ends(pose, ranges, bearings):
    hit = ranges < 18.0
    angle = pose[2] + bearings[hit]
    return pose[:2] + ranges[hit, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def _heat_sentence(result):
    if not result["free"]:
        return "The robot stands in a wall: nothing can be scanned from there."
    words = []
    for name, long in (("beams", "beam model"), ("field", "likelihood field")):
        if not result[f"{name}_possible"]:
            words.append(f"{long}: every place has weight zero")
        elif result[f"{name}_off"] > 0.4:
            words.append(f"{long}: best place is wrong, {result[f'{name}_off']:.1f} m off")
        else:
            elsewhere = f"e^{result[f'{name}_elsewhere']:.0f}"
            words.append(f"{long}: best place is right, more than 2 m away at most {elsewhere} of its weight")
    return "; ".join(words).capitalize() + "."


def field_against_beams():
    """Drag the robot: how likely is its scan at every other place, by the beam model and by the likelihood field?"""

    def scene(fig):
        axes = fig.subplots(1, 2)
        plan = building().grid.extent, _places()[2], building().lines
        heats = [
            draw.heat(ax, *plan, f"{model}: bright is likely (log scale)", HEAT_DEPTH)
            for ax, model in zip(axes, ("beam model", "likelihood field"))
        ]
        robots, scans = [draw.RobotMark(ax) for ax in axes], [draw.Beams(ax, size=2) for ax in axes]

        def update(state, result):
            for (_, fill), key in zip(heats, ("beams", "field")):
                fill(result[key])
            for robot, scan in zip(robots, scans):
                robot.set(result["pose"])
                scan.set(result["pose"], result["ends"])

        pictures = [a for artists, _ in heats for a in artists]
        return [*pictures, *(a for item in (*scans, *robots) for a in item.artists)], update

    return Stage(
        "beam model against likelihood field",
        scene=scene,
        compute=compute_heat,
        handles={"robot": Handle((8.4, 2.4), step=0.1, bounds=((0.3, 15.7), (0.3, 9.7)), label="robot")},
        controls={
            "heading_deg": Slider(-180, 180, 20, step=5, label="heading (deg)"),
            "scan": Choice(("as mapped", "something in the way"), "as mapped", label="world"),
            "beams": Choice(("mixture", "plain"), "mixture", label="beam model"),
        },
        fail={"scan": "something in the way", "beams": "plain"},
        because="Something that is not in the map stands in the way, and the plain beam model forgives nothing.",
        describe=_heat_sentence,
        size=(7.6, 3.0),
    )


# Resampling ----------------------------------------------------------------------------------------------------------

SECTORS = 6
SPINS = np.random.default_rng(6).random((400, SECTORS))
METHODS = ("spoke wheel", "roulette")


def _counts(shares, places):
    """How often each sector is met, (..., SECTORS), by places on the wheel (..., SECTORS)."""
    index = np.minimum(np.searchsorted(np.cumsum(shares), places, side="right"), SECTORS - 1)
    return (index[..., None] == np.arange(SECTORS)).sum(-2)


def compute_wheel(state):
    """One turn of the wheel for six dragged weights, and the variance of the counts over 400 turns of either method."""
    weights = np.array([state[f"W{k + 1}"][1] for k in range(SECTORS)], dtype=float)
    if weights.sum() == 0:
        none = np.zeros(SECTORS)
        return {
            "weights": weights,
            "shares": none,
            "spokes": none + np.nan,
            "counts": none.astype(int),
            "variances": dict.fromkeys(METHODS, 0.0),
            "effective": 0.0,
        }
    shares, turn = weights / weights.sum(), state["turn"]
    even = np.arange(SECTORS) / SECTORS
    spokes = even + turn / SECTORS if state["method"] == "spoke wheel" else SPINS[round(200 * turn)]
    variances = {
        "spoke wheel": _counts(shares, even + SPINS[:, :1] / SECTORS).var(0).sum(),
        "roulette": _counts(shares, SPINS).var(0).sum(),
    }
    return {
        "weights": weights,
        "shares": shares,
        "spokes": spokes,
        "counts": _counts(shares, spokes),
        "variances": variances,
        "effective": particles.effective_size(weights),
    }


def _wheel_sentence(result):
    if not result["weights"].any():
        return "All weights are zero: there is nothing to draw from."
    alive = int((result["counts"] > 0).sum())
    return f"{alive} of {SECTORS} particles survive; their weights are worth {result['effective']:.1f} equal ones."


def wheel():
    """Drag the weights, turn the wheel: roulette spins six times, the spoke wheel turns once."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1, 1))
        style.axes(left, "particle", "weight")
        left.set(xlim=(0.3, SECTORS + 0.7), ylim=(0, 1.4))
        left.set(xticks=range(1, SECTORS + 1), yticks=(0, 0.2, 0.4, 0.6, 0.8, 1))
        left.grid(axis="x", visible=False)
        (sticks,) = left.plot([], [], color=style.PREDICTION, linewidth=14, solid_capstyle="butt")
        look = {"ha": "center", "va": "bottom", "color": style.INK, "fontsize": 8}  # side by side on a phone
        labels = [left.text(k + 1, 0, "", **look) for k in range(SECTORS)]
        disk = draw.Wheel(right, SECTORS)
        words = left.text(0.02, 0.99, "", transform=left.transAxes, va="top")

        def update(state, result):
            sticks.set_data(*draw.bars(np.arange(1, SECTORS + 1), result["weights"]))
            for k, label in enumerate(labels):
                label.set_text(f"{result['counts'][k]}\nof {SECTORS * result['shares'][k]:.1f}")
                label.set_y(result["weights"][k] + 0.07)
            disk.set(result["shares"], result["spokes"])
            words.set_text(
                f"variance of the counts:  roulette {result['variances']['roulette']:.2f},  "
                f"spokes {result['variances']['spoke wheel']:.2f}"
            )

        return [sticks, *labels, *disk.artists, words], update

    start = (0.1, 0.7, 0.1, 0.3, 0.5, 0.2)
    return Stage(
        "resampling wheel",
        scene=scene,
        compute=compute_wheel,
        handles={
            f"W{k + 1}": Handle((k + 1, w), step=0.02, bounds=((k + 1, k + 1), (0.0, 1.0)), label=f"weight {k + 1}")
            for k, w in enumerate(start)
        },
        controls={
            "method": Choice(METHODS, METHODS[0], label="method"),
            "turn": Slider(0.0, 0.995, 0.3, step=0.005, label="turn of the wheel"),
        },
        fail={"method": "roulette", **{f"W{k + 1}": (k + 1, 0.5) for k in range(SECTORS)}},
        because="All weights are equal: nothing needs to be drawn, and roulette draws all the same.",
        describe=_wheel_sentence,
    )


@functools.cache
def _descendants(n=1000, rounds=200):
    """Names of the first particles still in the set after each round of equal weights: {method: (rounds + 1, n)}."""
    found = {}
    for method, resample in zip(METHODS, (resample_systematic, particles.resample_roulette)):
        rng, names = np.random.default_rng(7), [np.arange(n)]
        for _ in range(rounds):
            names.append(names[-1][resample(np.full(n, 1 / n), rng)])
        found[method] = np.array(names)
    return found


@functools.cache
def _first_cloud(n=1000):
    return np.random.default_rng(8).normal(0, 0.3, (n, 2))


def compute_standing(state):
    """Places still occupied after so many rounds, and the ancestors left after each round, for both methods."""
    history = _descendants()
    left = {
        name: np.array([len(np.unique(row)) for row in names[: state["rounds"] + 1]]) for name, names in history.items()
    }
    clouds = {name: _first_cloud()[np.unique(names[state["rounds"]])] for name, names in history.items()}
    return {"rounds": state["rounds"], "left": left, "clouds": clouds}


def standing():
    """A robot that stands still: resampling alone empties the cloud under roulette."""

    def scene(fig):
        axes = fig.subplots(1, 3, width_ratios=(1, 1, 1.2))
        clouds = []
        for ax, method in zip(axes, METHODS):
            style.axes(ax, "x (m)", "y (m)" if method == METHODS[0] else "", method, equal=True)
            ax.set(xlim=(-1.1, 1.1), ylim=(-1.1, 1.1))
            clouds.append(draw.Cloud(ax, size=5, alpha=0.8))
        curves = draw.ancestors(axes[2], METHODS)

        def update(state, result):
            for cloud, curve, method in zip(clouds, curves, METHODS):
                cloud.set(result["clouds"][method])
                curve.set_data(np.arange(result["rounds"] + 1), result["left"][method])

        return [*(a for cloud in clouds for a in cloud.artists), *curves], update

    return Stage(
        "the standing robot",
        scene=scene,
        compute=compute_standing,
        controls={"rounds": Slider(0, 200, 20, step=1, label="rounds of resampling")},
        fail={"rounds": 200},
        because="Nothing was learned in 200 rounds: what is lost was lost by drawing alone.",
        describe=lambda result: (
            f"After {result['rounds']} rounds {result['left']['roulette'][-1]} of 1000 first particles have "
            f"descendants under roulette, {result['left']['spoke wheel'][-1]} under the spoke wheel."
        ),
        size=(7.0, 3.2),
    )


# Recorded runs -------------------------------------------------------------------------------------------------------


@functools.cache
def _global_pictures(n_particles):
    return global_example(building(), n_particles)


def compute_twelve(state):
    """One picture of a global localization: cloud, truth, estimate, its error (m), number of the picture."""
    pictures = _global_pictures(state["particles"])
    k = min(int(round(state["t"] / DT)), len(pictures) - 1)
    shot = pictures[k]
    error = float(np.hypot(*(shot.estimate - shot.truth)[:2]))
    path = np.array([p.truth[:2] for p in pictures[: k + 1]])
    return {
        "number": k + 1,
        "states": shot.states,
        "truth": shot.truth,
        "estimate": shot.estimate,
        "error": error,
        "path": path,
    }


def twelve_pictures():
    """The lecture's example in twelve pictures, on our building: from everywhere to one place."""

    def scene(fig):
        ax = fig.subplots()
        draw.floor_plan(ax, building().lines)
        cloud, truth, guess = draw.Cloud(ax), draw.RobotMark(ax), draw.RobotMark(ax, color=style.ESTIMATE)
        (path,) = ax.plot([], [], **style.look("truth"))
        draw.key(ax, {"robot": truth, "estimate": guess})
        words = ax.text(1, 1.02, "", transform=ax.transAxes, va="bottom", ha="right")

        def update(state, result):
            cloud.set(result["states"])
            truth.set(result["truth"])
            guess.set(result["estimate"])
            path.set_data(*result["path"].T)
            words.set_text(f"picture {result['number']} of 12")

        return [*cloud.artists, path, *guess.artists, *truth.artists, words], update

    return Stage(
        "twelve pictures",
        scene=scene,
        compute=compute_twelve,
        controls={"particles": Choice((200, 1000, 5000), 5000, label="particles")},
        play=Play(t_max=11 * DT, dt=DT, rate=1.5 * DT),
        fail={"particles": 200, "t": 11 * DT},
        because="With so few particles none need lie near the robot, and copies of a wrong one stay wrong.",
        describe=lambda result: f"Picture {result['number']}: the estimate is off by {result['error']:.2f} m.",
        size=(7.0, 4.6),
    )


SOCCER_DT, SOCCER_END, TAIL = 0.4, 47.6, 25  # s a step, s to the last one; steps of the paths that are shown
READINGS = {
    "range and bearing": ("range", "bearing"),
    "range only": ("range",),
    "bearing only": ("bearing",),
    "nothing": (),
}


@functools.cache
def _soccer(use):
    return soccer_run(use=use)


@functools.cache
def _soccer_errors():
    """Distance (m) of odometry and of MCL with each reading from the robot, after every step: {name: (n,)}."""
    runs = {name: _soccer(use) for name, use in READINGS.items()}
    paths = {"odometry": runs["nothing"].odometry[1:], **{name: run.estimates for name, run in runs.items()}}
    return {name: np.hypot(*(path - runs["nothing"].truth[1:])[:, :2].T) for name, path in paths.items()}


def compute_soccer(state):
    """The soccer run up to now: the last TAIL steps of the paths, cloud, the landmark seen, and the errors (m) of
    odometry and MCL, and those of MCL with each of the readings.
    """
    run, errors = _soccer(READINGS[state["reads"]]), _soccer_errors()
    k = min(int(round(state["t"] / SOCCER_DT)), len(run.estimates) - 1)
    first = max(0, k - TAIL)
    return {
        "truth": run.truth[first : k + 2],
        "odometry": run.odometry[first : k + 2],
        "estimates": run.estimates[first : k + 1],
        "states": run.pictures[k].states,
        "seen": int(run.seen[k]),
        "time": SOCCER_DT * np.arange(1, len(run.estimates) + 1),
        "step": k,
        "errors": {"odometry": errors["odometry"], "MCL": errors[state["reads"]]},
        "others": [errors[name] for name in READINGS],
        "landmarks": run.landmarks,
    }


def _soccer_sentence(result):
    k = result["step"]
    mcl, odometry_off = (float(result["errors"][name][k]) for name in ("MCL", "odometry"))
    sight = f"it sees landmark {result['seen'] + 1}" if result["seen"] >= 0 else "no landmark is read"
    return f"MCL is off by {mcl:.2f} m, odometry by {odometry_off:.2f} m; {sight}."


def soccer():
    """Six landmarks around a soccer field: odometry walks away from the robot, what the camera reads pulls MCL back."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.7, 1))
        field = draw.Soccer(left, _soccer(READINGS["range and bearing"]).landmarks)
        curves = draw.SoccerErrors(right, SOCCER_END)

        def update(state, result):
            field.set(*(result[key] for key in ("truth", "odometry", "estimates", "states", "seen")))
            curves.set(result["time"], result["step"], result["errors"], result["others"])

        return [*field.artists, *curves.artists], update

    return Stage(
        "soccer field",
        scene=scene,
        compute=compute_soccer,
        controls={"reads": Choice(tuple(READINGS), "range and bearing", label="the camera reads")},
        play=Play(t_max=SOCCER_END, dt=SOCCER_DT, rate=4.0, start=20.0),
        fail={"reads": "nothing", "t": SOCCER_END},
        because="No landmark is read: the particles count steps as odometry does, and drift as it does.",
        presets={"At the end": {"t": SOCCER_END}},
        describe=_soccer_sentence,
        size=(7.6, 4.2),
    )


# Arena ---------------------------------------------------------------------------------------------------------------

RESAMPLERS = {
    "spoke wheel": mcl.Resampling(draw=resample_systematic),
    "roulette": mcl.Resampling(draw=particles.resample_roulette),
    "spoke wheel + recovery": mcl.Resampling(draw=resample_systematic),
}
KEYS = {"up": (0.6, 0.0), "down": (-0.6, 0.0), "left": (0.0, 0.6), "right": (0.0, -0.6)}
COUNTS = (100, 500, 1000, 2000, 5000, 10_000, 20_000)


def start_arena(state):
    """The memory of the arena: true pose, filter, world, history; global localization begins."""
    rng = np.random.default_rng(8)
    pose = np.array([*building().nodes["hall"], 0.3])
    motion = particles.odometry_motion(**example_noise())
    filter_ = mcl.localizer(building().grid, motion, state["particles"], rng, recovery=False)
    return {
        "rng": rng,
        "pose": pose,
        "filter": filter_,
        "wanderer": Wanderer(building(), rng),
        "world": building().grid,
        "disks": np.empty((0, 3)),
        "ends": np.empty((0, 2)),
        "estimate": (estimate := filter_.estimate().pose),
        "errors": [float(np.hypot(*(estimate - pose)[:2]))],
        "step": None,
        "stroke": None,
        "drawn": 0,
        "carried": False,
    }


def advance_arena(state, event):
    """One step of the filter on a tick or an arrow key; a stroke carries the robot away or draws obstacles."""
    memory = state["memory"]
    if event == "brush":
        return _stroke(memory, state["brush"])
    u = np.array(KEYS[event]) if event in KEYS else memory["wanderer"].control(memory["pose"], DT)
    if event in KEYS:
        memory["wanderer"].start_over()
    target = odometry.step(memory["pose"], u, DT)
    if building().grid.at(target[:2]) != maps.FREE:
        u, target = np.zeros(2), memory["pose"]
        memory["wanderer"].start_over()
    memory["pose"] = target
    _filter_step(state, memory, u)
    return memory


def _filter_step(state, memory, u):
    rng, filter_, pose = memory["rng"], memory["filter"], memory["pose"]
    _adopt(filter_, state, rng)
    noisy = odometry.noisy_controls(u[None], DT, **example_noise(), rng=rng, runs=1)[0, 0]
    if state["model"] == "landmarks":
        index, z = suite().look(pose, rng, memory["world"])
        weighting, memory["ends"] = suite().weigh_sighting(index, z), building().landmarks[index]
    else:
        ranges, bearings = suite().scan(pose, rng, memory["world"])
        weighting, memory["ends"] = suite().weigh_scan(state["model"], ranges, bearings), _ends(pose, ranges, bearings)
    memory["step"] = filter_.step(noisy, DT, weighting, rng)
    memory["estimate"] = memory["step"].estimate.pose
    memory["errors"] = [*memory["errors"], float(np.hypot(*(memory["estimate"] - pose)[:2]))][-HISTORY:]


def _adopt(filter_, state, rng):
    """Carry over what the controls say: resampling, recovery, number of particles."""
    filter_.resampling = RESAMPLERS[state["resampler"]]
    filter_.recovery = recovery() if "recovery" in state["resampler"] else None
    if len(filter_.states) != state["particles"]:
        filter_.resize(state["particles"], rng)


def _stroke(memory, path):
    """A stroke that begins on the robot carries it; any other leaves obstacles that the map does not know. A click does
    neither: it gives the picture the arrow keys.
    """
    begin = tuple(path[0])
    if begin != memory["stroke"]:
        memory["stroke"], memory["drawn"] = begin, 0
        memory["carried"] = bool(np.hypot(*(path[0] - memory["pose"][:2])) < 0.7)
    if len(path) < 2:
        return memory
    if not memory["carried"]:
        return _draw_obstacles(memory, path)
    if building().grid.at(path[-1]) == maps.FREE:
        memory["pose"] = np.array([*path[-1], memory["pose"][2]])
        memory["ends"] = np.empty((0, 2))  # the last scan was taken elsewhere
        memory["wanderer"].start_over()
    return memory


def _draw_obstacles(memory, path):
    """Disks along what is new of a stroke, without gaps however fast it was drawn."""
    new = []
    for place in _along(path[max(memory["drawn"] - 1, 0) :], DISK):
        known = np.vstack([memory["disks"][:, :2], *new])
        if not len(known) or np.hypot(*(known - place).T).min() > 0.6 * DISK:
            new.append(place)
    memory["drawn"] = len(path)
    if new:
        disks = np.column_stack([new, np.full(len(new), DISK)])
        memory["disks"] = np.vstack([memory["disks"], disks])
        memory["world"] = memory["world"].with_disks(disks)
    return memory


def _along(path, gap):
    """Points (n, 2) along a path (k, 2), at most `gap` apart, its corners among them."""
    points = [path[:1]]
    for start, end in itertools.pairwise(path):
        n = max(1, int(np.ceil(np.hypot(*(end - start)) / gap)))
        points.append(start + (end - start) * np.arange(1, n + 1)[:, None] / n)
    return np.concatenate(points)


def compute_arena(state):
    """What the picture shows: cloud, true pose, estimate, its distance from the robot (m), scan, obstacles, the errors
    of the steps so far, and the filter's numbers.
    """
    memory = state["memory"]
    estimate = memory["estimate"]
    return {
        "states": memory["filter"].states,
        "pose": memory["pose"],
        "estimate": estimate,
        "off": float(np.hypot(*(estimate - memory["pose"])[:2])),
        "ends": memory["ends"],
        "disks": memory["disks"],
        "errors": np.array(memory["errors"]),
        "step": memory["step"],
    }


def _arena_sentence(result):
    if result["step"] is None:
        where = f"The particles are everywhere, and where they happen to be densest is {result['off']:.2f} m off."
        return (
            f"{where} Press play{living(', or click the picture and use the arrow keys; drag the robot to kidnap it')}."
        )
    step = result["step"]
    words = f"Off by {result['off']:.2f} m; {step.n_particles} particles worth {step.effective:.0f} equal ones"
    if step.n_particles <= FEW and len(result["errors"]) > SETTLED and result["off"] > 1:
        return f"{words}. So few at the start seldom hold one near the robot, and copies of a wrong one stay wrong."
    if step.all_zero:
        return f"{words}; no particle explains the scan: all weights are zero."
    return f"{words}; {step.injected} random poses put in." if step.injected else f"{words}."


def arena():
    """Drive, scan, localize: drag the robot to kidnap it, draw obstacles elsewhere, switch models and resamplers while
    it runs.
    """

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(2.2, 1))
        draw.floor_plan(left, building().lines)
        cloud, truth, guess = draw.Cloud(left), draw.RobotMark(left), draw.RobotMark(left, color=style.ESTIMATE)
        scan, disks = draw.Beams(left), draw.Disks(left)
        (ring,) = left.plot([], [], **draw.RING)
        draw.key(left, {"robot": truth, "estimate": guess, "scan": scan, "not on the map": disks})
        curve = draw.error_curve(right, HISTORY)

        def update(state, result):
            cloud.set(result["states"])
            truth.set(result["pose"])
            guess.set(result["estimate"])
            scan.set(result["pose"], result["ends"])
            disks.set(result["disks"])
            ring.set_data(*result["pose"][:2, None])
            curve.set_data(np.arange(len(result["errors"])), np.maximum(result["errors"], 0.011))

        moving = [a for item in (scan, cloud, disks, guess, truth) for a in item.artists]
        return [*moving, ring, curve], update

    return Stage(
        "arena",
        scene=scene,
        compute=compute_arena,
        controls={
            "particles": Choice(COUNTS, 10_000, label="particles"),
            "model": Choice(SENSORS, "likelihood field", label="model"),
            "resampler": Choice(tuple(RESAMPLERS), "spoke wheel", label="resampling"),
        },
        play=Play(t_max=300.0, dt=DT, rate=8.0),  # sixteen pictures a second
        start=start_arena,
        advance=advance_arena,
        brush=True,
        keys=True,
        fail={"particles": 100, "t": 20.0},
        describe=_arena_sentence,
        size=(7.6, 4.2),
    )
