"""Stages of lateration: which method fits a task, and distance circles to drag."""

import functools

import numpy as np

from .. import gaussian, lateration
from ..figures import lateration as draw
from ..figures import style
from ..tables import read_table
from .stage import Handle, Stage, choice, slider

TASKS = {"start known": "local", "start unknown": "global", "may be carried off": "kidnapped"}
SENSES = ("odometry", "distances", "both")
REPETITIONS = 200
WEAK = 0.05  # a second singular value below this share of the first: the caption speaks of the weak direction


@functools.cache
def _methods():
    return read_table(
        "dead_reckoning/methods.csv", text=("method", "local", "global", "accuracy", "sensors", "map")
    )  # fmt: skip


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
    table = _methods()
    rows = zip(table["sensors"], table["map"], table["global"])
    verdicts = [_reason(sensors, needed != "no", able == "yes", state) for sensors, needed, able in rows]
    return {"verdicts": verdicts, "usable": [m for m, v in zip(table["method"].tolist(), verdicts) if not v]}


def methods():
    """The lecture's table of localization methods: choose a task, the rows that do not fit turn gray."""

    def scene(fig):
        table = _methods()
        rows = draw.MethodTable(fig.subplots(), zip(table["method"], table["accuracy"], table["sensors"]))

        def update(state, result):
            rows.set(result["verdicts"])

        return rows.artists, update

    return Stage(
        "methods of localization",
        scene=scene,
        compute=compute_methods,
        controls={
            "task": choice(TASKS, "local", label="task"),
            "sensor": choice(SENSES, "both", label="sensors"),
            "map": choice({"known": "known", "none": "none"}, "known", label="landmarks or map"),
        },
        fail={"task": "kidnapped", "sensor": "odometry", "map": "none"},
        size=(7.0, 2.4),
        describe=lambda result: (
            f"Fits: {', '.join(result['usable'])}." if result["usable"] else "Nothing in the table fits this task."
        ),
    )


@functools.cache
def _unit_noise():
    noise = np.random.default_rng(7).standard_normal((REPETITIONS, 3))
    noise[0] = 0.8, -0.9, 0.6  # the measurement whose circles are drawn
    noise.setflags(write=False)
    return noise


def compute_circles(state):
    """Search, repeated estimates, bound and weakest direction for two or three landmarks and a robot."""
    landmarks = np.array([state[name] for name in "ABC"[: state["count"]]])
    robot, std = state["R"], state["std"]
    true = np.maximum(np.linalg.norm(landmarks - robot, axis=1), 1e-3)
    distances = np.maximum(true + std * _unit_noise()[:, : len(landmarks)], 1e-3)
    directions = (robot - landmarks) / true[:, None]
    values, Vt = np.linalg.svd(directions)[1:]
    fixed = values[1] > lateration.RANK_TOLERANCE * values[0]
    if len(landmarks) == 2:
        search = lateration.newton(landmarks, distances[0], state["S"])
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
    if result["reason"]:
        return f"Newton gives up. {result['reason'].capitalize()}."
    text = f"The search ends {result['error']:.2f} m from the robot. Dilution {result['dilution']:.3g}: "
    text += f"{result['std']:.2f} m in a distance become {result['dilution'] * result['std']:.3g} m in the position."
    if ratio < WEAK:
        text += " The lines of sight are nearly parallel: across them the distances say little."
    return text


def circles():
    """Two or three landmarks, a robot and the start of the search, all to be dragged."""

    def scene(fig):
        ax = style.axes(fig.subplots(), "x (m)", "y (m)", equal=True)
        ax.set(xlim=(-4.0, 14.8), ylim=(-5.4, 6.4))
        rings, search, spare = draw.Circles(ax), draw.Search(ax), draw.Spare(ax, "C, not used")
        words = ax.text(0.02, 0.02, "", transform=ax.transAxes, va="bottom", fontsize=9)

        def update(state, result):
            rings.set(result["landmarks"], result["distances"], state["R"])
            spare.set(state["C"], state["count"] == 2)
            search.set(state["R"], result["path"], result["cloud"], result["ellipse"], result["weak"])
            words.set_text("singular values of the lines of sight: {:.2f}, {:.2f}".format(*result["singular_values"]))

        return [*rings.artists, *spare.artists, *search.artists, words], update

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
            "count": choice({"two": 2, "three": 3}, 2, label="landmarks"),
            "std": slider(0.0, 0.5, 0.2, step=0.01, label="noise of a distance (m)"),
        },
        fail={"R": (4.5, 0.3), "S": (6.0, 0.0)},
        presets={"Start below": {"S": (6.0, -2.5)}},
        describe=_circles_sentence,
    )
