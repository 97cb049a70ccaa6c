"""Stages of dead reckoning: three motion models at large time steps, a robot to drive, the banana."""

import functools

import numpy as np

from .. import gaussian, odometry
from ..figures import odometry as draw
from ..figures import style
from .stage import Play, Stage, choice, slider

DURATION = 5.0  # s, of the drive on which the models are compared
COUNTS = np.array([3, 5, 10, 20, 50, 100])  # time steps it is cut into
KEYS = {"up": (1.0, 0.0), "down": (-1.0, 0.0), "left": (0.0, np.pi / 2), "right": (0.0, -np.pi / 2)}  # for 0.4 s
KEY_STEPS = 4
EVERY = 10  # steps between two drawn ellipses
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
        style.axes(left, "x (m)", "y (m)", "5 s at 1 m/s", equal=True)
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
            "count": slider(3, 100, 8, label="number of steps"),
            "omega_deg": slider(-60.0, 60.0, 40.0, step=2.0, label="turn rate (deg/s)"),
        },
        fail={"count": 3, "omega_deg": 60.0},
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
    memory, circle = state["memory"], odometry.circle_drive()
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


def compute_drive(state):
    """Paths, ellipses along the estimated one, and how far off the estimate is."""
    memory = state["memory"]
    truth, estimate, cov = (np.array(memory[key]) for key in ("truth", "estimate", "cov"))
    shown = np.unique([*range(0, len(cov), EVERY), len(cov) - 1])
    return {
        "truth": truth,
        "estimate": estimate,
        "outlines": gaussian.outlines(estimate[shown, :2], cov[shown, :2, :2], points=31),
        "error": float(np.linalg.norm((truth[-1] - estimate[-1])[:2])),
        "std": float(np.sqrt(np.trace(cov[-1, :2, :2]))),
        "std_heading_deg": float(np.degrees(np.sqrt(cov[-1, 2, 2]))),
    }


def strayed(pose, view):
    """A sentence for a robot outside the part of the floor that is drawn, ((left, right), (bottom, top)); else none."""
    inside = all(low <= x <= high for x, (low, high) in zip(pose, view))
    return "" if inside else " The robot has left the picture: turn back, or Reset."


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
        path = draw.Driven(ax)

        def update(state, result):
            path.set(result["truth"], result["estimate"], result["outlines"])

        return path.artists, update

    return Stage(
        "drive a robot",
        scene=scene,
        compute=compute_drive,
        controls={"factor": slider(0.2, 3.0, 1.0, step=0.1, label="noise, times the lecture's")},
        play=Play(odometry.circle_drive().dt * 140, dt=0.1, rate=2.0),
        keys=True,
        start=_start_drive,
        advance=_advance_drive,
        fail={"factor": 3.0},
        describe=_drive_sentence,
    )


@functools.lru_cache(maxsize=64)
def _runs(path, factor):
    """Computed path, covariance, and 1500 true ends of a noisy drive."""
    circle = odometry.circle_drive()
    noise = {name: value * factor**2 for name, value in circle.noise.items()}
    controls = circle.controls if path == "circle" else circle.controls * [1.0, 0.0]
    poses, covs = odometry.drive_with_covariance(np.zeros(3), np.zeros((3, 3)), controls, circle.dt, **noise)
    std = np.sqrt(np.diag(odometry.control_covariance(controls[0], circle.dt, **noise)))
    ends = odometry.drive(np.zeros((RUNS, 3)), controls[:, None, :] + std * _unit_noise(len(controls)), circle.dt)[-1]
    return poses, covs[-1], ends


@functools.cache
def _unit_noise(steps):
    noise = np.random.default_rng(3).standard_normal((steps, RUNS, 2))
    noise.setflags(write=False)
    return noise


def bent_region(mean, ends, probability=0.95, points=61):
    """Outline in the plane of the region that is an ellipse in exponential coordinates about `mean`, and their moments.

    Returns (outline (points, 2), mean (3,), covariance (3, 3)) of the exponential coordinates of the ends.
    """
    xi = odometry.log_pose(odometry.relative_pose(mean, ends))
    center, cov = xi.mean(0), np.cov(xi.T)
    values, vectors = np.linalg.eigh(cov)
    angle = np.linspace(0, 2 * np.pi, points)[:, None]
    radius = np.sqrt(-2 * np.log(1 - probability))
    ring = np.cos(angle) * np.sqrt(values[2]) * vectors[:, 2] + np.sin(angle) * np.sqrt(values[1]) * vectors[:, 1]
    return odometry.compose_pose(mean, odometry.exp_pose(center + radius * ring))[:, :2], center, cov


def compute_banana(state):
    """Ends of the runs, the region said to hold 95 % of them, and the share it does hold (of all three coordinates)."""
    poses, cov, ends = _runs(state["path"], state["factor"])
    if state["region"] == "ellipse":
        outline = gaussian.ellipse(poses[-1, :2], cov[:2, :2])
        error = ends - poses[-1]
        share = gaussian.share_inside(error, np.zeros(3), cov)
    else:
        outline, center, spread = bent_region(poses[-1], ends)
        share = gaussian.share_inside(odometry.log_pose(odometry.relative_pose(poses[-1], ends)), center, spread)
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
            "path": choice({"straight": "straight", "circle": "circle"}, "straight", label="path"),
            "factor": slider(0.5, 4.0, 2.0, step=0.5, label="noise, times the lecture's"),
            "region": choice(["ellipse", "bent"], "ellipse", label="region"),
        },
        fail={"factor": 4.0},
        describe=lambda result: (
            f"{100 * result['share']:.0f} % of the poses lie in the region said to hold 95 %. "
            f"On average the robots end {result['lag']:.2f} m from the computed end."
        ),
    )
