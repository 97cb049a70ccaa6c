"""Stages of lateration: which method fits a task, and distance circles to drag."""

import functools

import numpy as np

from ...documents.lecture import printed as lecture
from ...estimation import gaussian
from ...geometry.planar import wrap_angle
from ...localization import lateration, odometry, wheels
from ...stage import Choice, Handle, Play, Slider, Stage, style
from ...stage.marks import Spare, strayed
from . import figures as draw

TASKS = {"start known": "local", "start unknown": "global", "may be carried off": "kidnapped"}
SENSES = ("odometry", "distances", "both")
REPETITIONS = 200
WEAK = 0.05  # a second singular value below this share of the first: the caption speaks of the weak direction


def _reason(sensors, needs_map, can_find, state):
    """Why a method cannot be used for a task, or ""."""
    if state["sensor"] != "both" and state["sensor"] not in sensors:
        return f"needs {sensors}"
    if sensors == "odometry and distances" and state["sensor"] != "both":
        return "needs both sensors"
    if needs_map and state["map"] == "none":
        return "needs a map"
    if state["task"] != "local" and not can_find:
        return "needs a known start"
    return ""


def compute_methods(state):
    """For each method of the lecture's table, why it does not fit the task ("" where it does)."""
    table = lecture.methods()
    rows = zip(table["sensors"], table["map"], table["global"])
    verdicts = [_reason(sensors, needed != "no", able == "yes", state) for sensors, needed, able in rows]
    return {"verdicts": verdicts, "usable": [m for m, v in zip(table["method"].tolist(), verdicts) if not v]}


def methods():
    """The lecture's table of localization methods: choose a task, the rows that do not fit turn gray."""

    def scene(fig):
        table = lecture.methods()
        rows = draw.MethodTable(fig.subplots(), zip(table["method"], table["accuracy"], table["sensors"]))

        def update(state, result):
            rows.set(result["verdicts"])

        return rows.artists, update

    return Stage(
        "methods of localization",
        scene=scene,
        compute=compute_methods,
        controls={
            "task": Choice(TASKS, "local", label="task"),
            "sensor": Choice(SENSES, "both", label="sensors"),
            "map": Choice({"known": "known", "none": "none"}, "known", label="landmarks or map"),
        },
        fail={"task": "kidnapped", "sensor": "odometry", "map": "none"},
        size=(7.0, 2.4),
        describe=lambda result: (
            f"Fits: {', '.join(result['usable'])}." if result["usable"] else "Nothing in the table fits this task."
        ),
    )


SHOWN_NOISE = (0.8, -0.9, 0.6)  # of the measurement whose circles are drawn


def _circle_noise():
    """Noise of three distances in REPETITIONS measurements, standard deviation 1; the first one is drawn."""
    return np.vstack([SHOWN_NOISE, gaussian.unit_noise((REPETITIONS, 3), seed=7)[1:]])


def compute_circles(state):
    """Search, repeated estimates, bound and weakest direction for two or three landmarks and a robot."""
    landmarks = np.array([state[name] for name in "ABC"[: state["count"]]])
    robot, std = state["R"], state["std"]
    true = np.maximum(np.linalg.norm(landmarks - robot, axis=1), 1e-3)
    distances = np.maximum(true + std * _circle_noise()[:, : len(landmarks)], 1e-3)
    directions = (robot - landmarks) / true[:, None]
    values, Vt = np.linalg.svd(directions)[1:]
    fixed = values[1] > lateration.RANK_TOLERANCE * values[0]
    if len(landmarks) == 2:
        search = lateration.newton_lateration(landmarks, distances[0], state["S"])
        path, reason = search.path, "" if search.converged else search.reason
    else:
        path, reason = _path(landmarks, distances[0], state["S"]), ""
    return {
        "landmarks": landmarks,
        "distances": distances[0],
        "path": path,
        "reason": reason,
        "cloud": lateration.laterate(landmarks, distances, start=robot + [0, 1e-3], steps=12).position,
        "ellipse": _bound(landmarks, robot, std) if fixed else np.empty((0, 2)),
        "weak": robot + np.outer([-1.2, 1.2], Vt[1]),
        "singular_values": values,
        "error": float(np.linalg.norm(path[-1] - robot)),
        "dilution": float(np.sqrt((1 / values**2).sum())) if fixed else np.inf,
        "std": std,
    }


def _bound(landmarks, robot, std):
    return gaussian.ellipse(robot, std**2 * lateration.dilution(landmarks, robot))


def _path(landmarks, distances, start):
    """Iterates of least squares from the start: the library's search, cut off after one, two, ... steps."""
    steps = [lateration.laterate(landmarks, distances, start=start, steps=k).position for k in (1, 2, 3, 5, 30)]
    return np.array([start, *steps])


def _circles_sentence(result):
    ratio = result["singular_values"][1] / result["singular_values"][0]
    values = "Singular values of the lines of sight: {:.2f}, {:.2f}.".format(*result["singular_values"])
    if result["reason"]:
        return f"Newton gives up. {result['reason'].capitalize()}. {values}"
    text = f"The search ends {result['error']:.2f} m from the robot. Dilution {result['dilution']:.3g}: "
    text += f"{result['std']:.2f} m in a distance become {result['dilution'] * result['std']:.3g} m in the position. "
    text += values
    if ratio < WEAK:
        text += " The lines of sight are nearly parallel: across them the distances say little."
    return text


def circles():
    """Two or three landmarks, a robot and the start of the search, all to be dragged."""

    def scene(fig):
        ax = style.axes(fig.subplots(), "x (m)", "y (m)", equal=True)
        ax.set(xlim=(-4.0, 14.8), ylim=(-5.4, 6.4))
        rings, search, spare = draw.Circles(ax), draw.Search(ax), Spare(ax, "C, unused", (-11, -4), "right")

        def update(state, result):
            rings.set(result["landmarks"], result["distances"], state["R"])
            spare.set(state["C"], state["count"] == 2)
            search.set(state["R"], result["path"], result["cloud"], result["ellipse"], result["weak"])

        return [*rings.artists, *spare.artists, *search.artists], update

    return Stage(
        "distance circles",
        scene=scene,
        compute=compute_circles,
        handles={
            "A": Handle((1.0, 0.0), step=0.1, label="landmark A"),
            "B": Handle((8.0, 0.0), step=0.1, label="landmark B"),
            "C": Handle((4.0, 5.5), step=0.1, label="landmark C, used with three"),
            "R": Handle((4.0, 3.0), step=0.1, label="robot", color=style.TRUTH),
            "S": Handle((6.0, 4.5), step=0.1, label="start of the search", color=style.ESTIMATE),
        },
        controls={
            "count": Choice({"two": 2, "three": 3}, 2, label="landmarks"),
            "std": Slider(0.0, 0.5, 0.2, step=0.01, label="noise of a distance (m)"),
        },
        fail={"R": (4.5, 0.3), "S": (6.0, 0.0)},
        presets={"Start below": {"S": (6.0, -2.5)}},
        describe=_circles_sentence,
    )


DURATION = 5.0  # s, of the drive on which the models are compared
COUNTS = np.array([3, 5, 10, 20, 50, 100])  # time steps it is cut into
KEYS = {"up": (1.0, 0.0), "down": (-1.0, 0.0), "left": (0.0, np.pi / 2), "right": (0.0, -np.pi / 2)}  # for 0.4 s
KEY_STEPS = 4
EVERY = 10  # steps between two drawn ellipses
OTHERS = 30  # robots that were given the same commands
RUNS = 1500
VIEW = ((-4.4, 15.0), (-4.7, 7.5))  # m; holds the lecture's circle and 14 m straight on


def _end_error(omega, count, model):
    end = odometry.drive(np.zeros(3), np.tile([1.0, omega], (count, 1)), DURATION / count, model)[-1]
    exact = odometry.step(np.zeros(3), [1.0, omega], DURATION, "arc")
    return float(np.linalg.norm((end - exact)[:2]))


@functools.lru_cache(maxsize=256)
def _errors(omega):
    return {m: np.array([_end_error(omega, n, m) for n in COUNTS]) for m in ("euler", "midpoint")}


def compute_models(state):
    """Paths of the three models over 5 s at 1 m/s, and the distance of their ends from the exact one (m)."""
    count, omega = int(state["count"]), np.radians(state["omega_deg"])
    dt = DURATION / count
    controls = np.tile([1.0, omega], (count, 1))
    paths = {m: odometry.drive(np.zeros(3), controls, dt, m) for m in ("euler", "midpoint")}
    paths["arc"] = odometry.drive(np.zeros(3), np.tile([1.0, omega], (60, 1)), DURATION / 60, "arc")
    error = {m: max(float(np.linalg.norm((p[-1] - paths["arc"][-1])[:2])), 1e-12) for m, p in paths.items()}
    errors = {m: np.maximum(e, 1e-12) for m, e in _errors(round(omega, 9)).items()}
    return {"dt": dt, "paths": paths, "error": error, "errors": errors}


def _models_sentence(result):
    if max(result["error"].values()) < 1e-9:
        return f"T = {result['dt']:.2f} s: straight on, all three models end in the same point."
    return (
        f"T = {result['dt']:.2f} s: the simplified model ends {result['error']['euler']:.2g} m from the arc, "
        f"the midpoint model {result['error']['midpoint']:.2g} m."
    )


def models():
    """Euler, midpoint and exact arc on the same drive, cut into few or many steps."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.2, 1))
        style.axes(left, "x (m), in 5 s at 1 m/s", "y (m)", equal=True)
        left.set(xlim=(-2.4, 5.6), ylim=(-4, 5))
        style.axes(right, "time step T (s)", "error of the end (m)", "slope 1 and slope 2")
        right.set(xscale="log", yscale="log", xlim=(0.05, 2.5), ylim=(1e-4, 10))
        paths = draw.ModelPaths(left, right, DURATION / COUNTS)

        def update(state, result):
            paths.set(result)

        return paths.artists, update

    return Stage(
        "three motion models",
        scene=scene,
        compute=compute_models,
        controls={
            "count": Slider(3, 100, 8, label="number of steps"),
            "omega_deg": Slider(-60.0, 60.0, 40.0, step=2.0, label="turn rate (deg/s)"),
        },
        fail={"count": 3, "omega_deg": 60.0},
        because=("In three steps, each turning by 100 deg: the simplified model drives straight through every one."),
        describe=_models_sentence,
    )


def _start_drive(state):
    zero = np.zeros(3)
    return {
        "truth": [zero],
        "estimate": [zero],
        "cov": [np.zeros((3, 3))],
        "rng": np.random.default_rng(11),
    }


def _advance_drive(state, event):
    """Drive on: a tick is one step of the lecture's circle, an arrow key four steps of its own."""
    memory, circle = state["memory"], lecture.circle_drive()
    u = circle.controls[0] if event == "tick" else np.array(KEYS[event])
    noise = {name: value * state["factor"] ** 2 for name, value in circle.noise.items()}
    cov_u = odometry.control_covariance(u, circle.dt, **noise)
    for _ in range(1 if event == "tick" else KEY_STEPS):
        real = u + np.sqrt(np.diag(cov_u)) * memory["rng"].standard_normal(2)
        x, cov = odometry.propagate(memory["estimate"][-1], memory["cov"][-1], u, circle.dt, cov_u, "euler")
        memory["truth"].append(odometry.step(memory["truth"][-1], real, circle.dt, "arc"))
        memory["estimate"].append(x)
        memory["cov"].append(cov)
    return memory


@functools.lru_cache(maxsize=8)
def _others(factor):
    """Paths of OTHERS robots on the lecture's circle at so many times its noise, shape (n + 1, OTHERS, 2)."""
    circle = lecture.circle_drive()
    noise = {name: value * factor**2 for name, value in circle.noise.items()}
    rng = np.random.default_rng(3)
    return odometry.sample_drives(np.zeros(3), circle.controls, circle.dt, **noise, rng=rng, runs=OTHERS, model="arc")[
        ..., :2
    ]


def _others_so_far(state, steps):
    """The others' paths one after the other, (k, 2) with rows of NaN between; none where keys have driven elsewhere."""
    if steps != round(state["t"] / lecture.circle_drive().dt):
        return np.empty((0, 2))
    paths = _others(state["factor"])[: steps + 1].swapaxes(0, 1)
    return np.concatenate([paths, np.full((OTHERS, 1, 2), np.nan)], axis=1).reshape(-1, 2)


def compute_drive(state):
    """Paths, ellipses along the estimated one, and how far off the estimate is."""
    memory = state["memory"]
    truth, estimate, cov = (np.array(memory[key]) for key in ("truth", "estimate", "cov"))
    shown = np.unique([*range(0, len(cov), EVERY), len(cov) - 1])
    return {
        "truth": truth,
        "estimate": estimate,
        "others": _others_so_far(state, len(truth) - 1),
        "outlines": gaussian.outlines(estimate[shown, :2], cov[shown, :2, :2], points=31),
        "error": float(np.linalg.norm((truth[-1] - estimate[-1])[:2])),
        "std": float(np.sqrt(np.trace(cov[-1, :2, :2]))),
        "std_heading_deg": float(np.degrees(np.sqrt(cov[-1, 2, 2]))),
    }


def _drive_sentence(result):
    text = (
        f"The estimate is {result['error']:.2f} m off; it expects {result['std']:.2f} m, "
        f"and {result['std_heading_deg']:.1f} deg in the heading."
    )
    return text + strayed(result["truth"][-1], VIEW)


def drive():
    """Drive with the arrow keys, or play the lecture's circle: what odometry believes drifts away from the truth."""

    def scene(fig):
        ax = style.axes(fig.subplots(), "x (m)", "y (m)", equal=True)
        ax.set(xlim=VIEW[0], ylim=VIEW[1])
        path = draw.Driven(ax, OTHERS)

        def update(state, result):
            path.set(result["truth"], result["estimate"], result["outlines"], result["others"])

        return path.artists, update

    return Stage(
        "drive a robot",
        scene=scene,
        compute=compute_drive,
        controls={"factor": Slider(0.2, 3.0, 1.0, step=0.1, label="noise, times the lecture's")},
        play=Play(lecture.circle_drive().dt * 140, dt=0.1, rate=2.0, start=6.0),
        keys=True,
        start=_start_drive,
        advance=_advance_drive,
        fail={"factor": 3.0, "t": 14.0},
        because=("Three times the noise, and no landmark to correct it: what the robot does not know can only grow."),
        describe=_drive_sentence,
    )


@functools.lru_cache(maxsize=64)
def _runs(path, factor):
    """Computed path, covariance, and 1500 true ends of a noisy drive."""
    circle = lecture.circle_drive()
    noise = {name: value * factor**2 for name, value in circle.noise.items()}
    controls = circle.controls if path == "circle" else circle.controls * [1.0, 0.0]
    poses, covs = odometry.drive_with_covariance(np.zeros(3), np.zeros((3, 3)), controls, circle.dt, **noise)
    std = np.sqrt(np.diag(odometry.control_covariance(controls[0], circle.dt, **noise)))
    noisy = controls[:, None, :] + std * gaussian.unit_noise((len(controls), RUNS, 2), seed=3)
    ends = odometry.drive(np.zeros((RUNS, 3)), noisy, circle.dt)[-1]
    return poses, covs[-1], ends


def compute_banana(state):
    """Ends of the runs, the region said to hold 95 % of them, and the share it does hold (of all three coordinates)."""
    poses, cov, ends = _runs(state["path"], state["factor"])
    if state["region"] == "ellipse":
        outline = gaussian.ellipse(poses[-1, :2], cov[:2, :2])
        error = ends - poses[-1]
        share = gaussian.share_inside(error, np.zeros(3), cov)
    else:
        bent = gaussian.bent_region(poses[-1], ends)
        outline, share = bent.outline, gaussian.share_inside(bent.twists, bent.mean, bent.cov)
    lag = float(np.linalg.norm((ends.mean(0) - poses[-1])[:2]))
    return {"poses": poses, "ends": ends, "outline": outline, "share": share, "lag": lag, "region": state["region"]}


def banana():
    """Where 1500 noisy drives really end, against the ellipse of error propagation."""

    def scene(fig):
        ax = style.axes(fig.subplots(), "x (m)", "y (m)", equal=True)
        ax.set(xlim=(-4.5, 16.5), ylim=(-6.4, 6.4))
        cloud = draw.Banana(ax)

        def update(state, result):
            cloud.set(result["poses"], result["ends"], result["outline"])

        return cloud.artists, update

    return Stage(
        "the banana",
        scene=scene,
        compute=compute_banana,
        controls={
            "path": Choice({"straight": "straight", "circle": "circle"}, "straight", label="path"),
            "factor": Slider(0.5, 4.0, 1.0, step=0.5, label="noise, times the lecture's"),
            "region": Choice(["ellipse", "bent"], "ellipse", label="region"),
        },
        fail={"factor": 4.0},
        because="Four times the noise: the headings differ so much that the cloud bends.",
        describe=lambda result: (
            f"{100 * result['share']:.0f} % of the poses lie in the region said to hold 95 %. "
            f"On average the robots end {result['lag']:.2f} m from the computed end."
        ),
    )


HELD = 2.0  # s, for which one command is held
SPEED, TURN_RATE, STEERING = 1.0, np.radians(100), np.radians(35)  # m/s, rad/s, rad: what the drives are told at most
DRIVES = {
    "differential": wheels.differential_drive(SPEED, TURN_RATE),
    "Ackermann": wheels.ackermann_drive(SPEED, STEERING, wheelbase=1.0),
    "Mecanum": wheels.mecanum_drive(SPEED, TURN_RATE),
}
LEVER = 0.25  # m: what an error of 1 rad in the heading counts beside one in the place
CLOSE = 0.03  # m: there


def _driven(drive, share, points):
    """Poses (..., points + 1, 3) on the way of commands (..., k) held for HELD seconds."""
    times = np.linspace(0, HELD, points + 1)[1:]
    poses = wheels.step_twist(np.zeros(3), drive.twist(np.asarray(share))[..., None, :], times)
    return np.concatenate([np.zeros_like(poses[..., :1, :]), poses], axis=-2)


def fan(drive):
    """Paths (n, k, 2) of a few commands at full speed, ahead and back, or to all sides (m)."""
    if drive.numbers == 2:
        share = [(v, turn) for v in (1, -1) for turn in np.linspace(-1, 1, 9)]
    else:
        angles = np.linspace(-np.pi, np.pi, 12, endpoint=False)
        share = [(np.cos(angle), np.sin(angle), turn) for turn in (0, 0.5) for angle in angles]
    return _driven(drive, share, 24)[..., :2]


def compute_reach(state):
    """For each drive the one command that ends nearest to the spot: its path, and what is left in m and degrees."""
    spot = np.array([*state["G"], np.radians(state["heading_deg"])])
    found = {}
    for name, drive in DRIVES.items():
        path = _driven(drive, wheels.nearest_command(drive, spot, HELD, LEVER), 40)
        x, y, turned = path[-1] - spot
        found[name] = {
            "path": path,
            "away": float(np.hypot(x, y)),
            "turned_deg": float(np.degrees(abs(wrap_angle(turned)))),
        }
    return {"spot": spot, "drives": found}


def _reach_sentence(result):
    words = []
    for name, found in result["drives"].items():
        there = found["away"] < CLOSE and found["turned_deg"] < 2
        off = f"stays {found['away']:.2f} m and {found['turned_deg']:.0f}° off"
        words.append(f"{name} {'gets there' if there else off}")
    return f"By one command, {'; '.join(words)}."


def reach():
    """A spot to park on: how near each drive comes with one command held for two seconds."""

    def scene(fig):
        views = {}
        for ax, (name, drive) in zip(fig.subplots(1, 3, sharey=True), DRIVES.items()):
            style.axes(ax, "x (m)", "" if views else "y (m)", name, equal=True)
            ax.set(xlim=(-2.3, 2.5), ylim=(-2.4, 2.4))
            views[name] = draw.Reach(ax, fan(drive))

        def update(state, result):
            for name, view in views.items():
                view.set(result["spot"], result["drives"][name]["path"])

        return [artist for view in views.values() for artist in view.artists], update

    return Stage(
        "one command to a spot",
        scene=scene,
        compute=compute_reach,
        handles={"G": Handle((1.2, 0.6), step=0.1, label="the spot, in the first picture")},
        controls={"heading_deg": Slider(-180.0, 180.0, 50.0, step=5.0, label="heading on the spot (deg)")},
        fail={"G": (0.0, 1.0), "heading_deg": 0.0},
        because="The spot lies straight beside the robot, and wheels that roll do not go sideways.",
        presets={"U-turn": {"G": (0.0, 0.0), "heading_deg": 180.0}},
        size=(7.0, 3.0),
        describe=_reach_sentence,
    )
