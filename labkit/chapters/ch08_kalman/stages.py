"""Stages of Kalman filters: three bells, the lecture's vehicle, a landmark arena, a precise sensor and a poor prior."""

import functools

import numpy as np

from ...documents.lecture import printed as lecture
from ...documents.lecture.examples import circle_course, simulate_vehicle
from ...estimation import gaussian, kalman
from ...geometry import planar
from ...localization import ekf, odometry
from ...stage import Choice, Handle, Play, Slider, Stage, Target, Toggle, living, style
from ...stage.marks import Spare, strayed
from . import figures as draw

GRID = np.linspace(0, 20, 401)
SHIFT = 2.0  # m, the commanded motion of the one-dimensional example
PEAK = 1 / np.sqrt(2 * np.pi)  # height of the bell of standard deviation 1
NOISE = {"var_x0": 1.0, "var_v0": 0.01, "var_a": 0.16, "var_z": 0.25}  # the vehicle, as reconstructed
STEPS, DT = 100, 0.1
DROPOUT = slice(45, 75)
STDS_Z = np.arange(1, 25) * 0.05  # m, the range of the slider
BRACKET = 10.4  # s, where the bracket stands
KEYS = {"up": (1.0, 0.0), "down": (-1.0, 0.0), "left": (0.0, np.pi / 2), "right": (0.0, -np.pi / 2)}
KEY_STEPS = 4
ARENA = ((-6.0, 7.0), (-3.0, 8.5))  # m, the part of the floor that is drawn
RUNS = 200
ITERATIONS = np.arange(1, 7)
TWO_MARKS = np.array([[3.0, 0.0], [0.0, 4.0]])


# --- one dimension ------------------------------------------------------------


def compute_bells(state):
    """Prediction and correction of one coordinate: (mean, std) of each bell, the gain and the NIS."""
    std_z = PEAK / state["z"][1]
    before = (5.0, state["std0"])
    x, cov = kalman.predict([before[0]], [[before[1] ** 2]], [[1.0]], [[1.0]], [SHIFT], [[state["std_u"] ** 2]])
    corrected = kalman.update(x, cov, [state["z"][0]], [[1.0]], [[std_z**2]])
    bells = [(x[0], np.sqrt(cov[0, 0])), (state["z"][0], std_z), (corrected.x[0], np.sqrt(corrected.cov[0, 0]))]
    score = float(kalman.nis(corrected.innovation, corrected.cov_innovation))
    return {"before": before, "bells": bells, "gain": float(corrected.gain[0, 0]), "nis": score}


def _bells_sentence(result):
    (_, s_p), (_, s_z), (x, s) = result["bells"]
    text = f"Standard deviations: predicted {s_p:.2f} m, measured {s_z:.2f} m, corrected {s:.2f} m, at {x:.2f} m."
    if result["nis"] > gaussian.chi_square_quantile(0.99, 1):
        text += f" NIS {result['nis']:.0f}: fewer than one in a hundred fits so badly. The bell does not show it."
    return text


def bells():
    """Prediction, measurement, correction in one dimension: drag the peak of the measurement, sharper is higher."""

    def scene(fig):
        ax = style.axes(fig.subplots(), "position (m)", "density (1/m)")
        ax.set(xlim=(0, 20), ylim=(0, 1.15))
        three = draw.Bells(ax, GRID)
        words = ax.set_title("", loc="right")

        def update(state, result):
            three.set(result["before"], result["bells"])
            limit = gaussian.chi_square_quantile(0.99, 1)
            words.set_text(f"gain K = {result['gain']:.2f},  NIS = {result['nis']:.2f} (99 % below {limit:.1f})")

        return [*three.artists, words], update

    return Stage(
        "predict and correct",
        scene=scene,
        compute=compute_bells,
        handles={
            "z": Handle(
                (9.0, PEAK), step=0.1, bounds=((0.5, 19), (0.1, 1.1)), color=style.MEASUREMENT,
                label="peak of the measurement: sideways its value, up and down its sigma",
            )
        },
        controls={
            "std0": Slider(0.2, 3.0, 0.6, step=0.1, label="std before (m)"),
            "std_u": Slider(0.0, 3.0, 0.8, step=0.1, label="std of the motion (m)"),
        },
        fail={"z": (15.0, 1.0)},
        describe=_bells_sentence,
    )  # fmt: skip


# --- the vehicle ----------------------------------------------------------------


@functools.cache
def _vehicle_truth():
    """True states (STEPS, 2) and position measurements of one drive with the reconstructed noise."""
    return simulate_vehicle(STEPS, DT, **NOISE, rng=np.random.default_rng(2))


def _vehicle_measured(dropout):
    """The measurements, (STEPS,), NaN where the sensor is off."""
    z = _vehicle_truth()[1].copy()
    if dropout:
        z[DROPOUT] = np.nan
    return z


@functools.lru_cache(maxsize=8)
def _nis_of_all_beliefs(std_a, dropout):
    """Mean NIS of the filters that believe STDS_Z of the sensor, all of them stepped at once."""
    A, B, C = kalman.vehicle_model(DT)
    x, cov, scores = np.zeros((len(STDS_Z), 2)), np.diag([NOISE["var_x0"], NOISE["var_v0"]]), []
    for z in _vehicle_measured(dropout):
        x, cov = kalman.predict(x, cov, A, B, [1.0], [[std_a**2]])
        if np.isfinite(z):
            step = kalman.update(x, cov, [z], C, STDS_Z[:, None, None] ** 2)
            x, cov = step.x, step.cov
            scores.append(kalman.nis(step.innovation, step.cov_innovation))
    return np.mean(scores, axis=0)


def compute_vehicle(state):
    """Errors of the sensor and of the filter over STEPS steps, what the filter promises, its mean NIS, the band of 99 %
    for it, and the mean NIS for every noise of the sensor one may believe in.
    """
    truth, z = _vehicle_truth()[0], _vehicle_measured(state["dropout"])
    A, B, C = kalman.vehicle_model(DT)
    beliefs = {"cov_z": [[state["std_z"] ** 2]], "cov_u": [[state["std_a"] ** 2]]}
    cov0 = np.diag([NOISE["var_x0"], NOISE["var_v0"]])
    run = kalman.filter_steps(z[:, None], A, C, x0=np.zeros(2), cov0=cov0, B=B, u=[1.0], **beliefs)
    seen = np.isfinite(z)
    return {
        "time": DT * np.arange(1, STEPS + 1),
        "error": run.x - truth,
        "measured": z - truth[:, 0],
        "std": np.sqrt(np.diagonal(run.cov, axis1=-2, axis2=-1)),
        "std_z": state["std_z"],
        "gain": run.gain[..., 0],
        "nis": float(kalman.nis(run.innovation, run.cov_innovation)[seen].mean()),
        "band": kalman.mean_band(1, int(seen.sum())),
        "others": _nis_of_all_beliefs(state["std_a"], state["dropout"]),
    }


def _is_honest(result):
    low, high = result["band"]
    return low < result["nis"] < high


def _vehicle_sentence(result):
    low, high = result["band"]
    verdict = "in its band" if _is_honest(result) else "too large: the filter promises too much" if (
        result["nis"] > high) else "too small: the filter promises too little"  # fmt: skip
    return (
        f"The filter believes {{std_z}} m of its sensor and {{std_a}} m/s\N{SUPERSCRIPT TWO} of its motor. Mean NIS "
        f"{result['nis']:.2f} (99 % band {low:.2f} to {high:.2f}): {verdict}. Velocity known to "
        f"{result['std'][-1, 1]:.2f} m/s."
    )


def vehicle():
    """What the filter believes of its sensor against how the sensor scatters: pull the bracket, the NIS judges it."""

    def scene(fig):
        grid = fig.subplot_mosaic([["x", "nis"], ["v", "nis"]], width_ratios=(1.5, 1), height_ratios=(1.6, 1))
        position = draw.Belief(grid["x"], grid["v"], DT * STEPS)
        judge = draw.Judge(grid["nis"], STDS_Z, np.sqrt(NOISE["var_z"]))

        def update(state, result):
            position.set(result, state["P"][0])
            judge.set(result)

        return [*position.artists, *judge.artists], update

    def follow(state, moved):
        """The bracket shows twice the deviation of the slider, and sets it."""
        if "P" in moved and "std_z" not in moved:
            return {"std_z": state["P"][1] / 2}
        return {"P": (BRACKET, 2 * state["std_z"])}

    return Stage(
        "the vehicle",
        scene=scene,
        compute=compute_vehicle,
        handles={
            "P": Handle(
                (BRACKET, 2.0), step=0.1, bounds=((BRACKET, BRACKET), (2 * STDS_Z[0], 2 * STDS_Z[-1])),
                label="twice the noise the filter believes of its sensor", color=style.MEASUREMENT,
            )
        },
        constrain=follow,
        controls={
            "std_z": Slider(STDS_Z[0], STDS_Z[-1], 1.0, step=0.05, label="believed noise of z (m)"),
            "std_a": Slider(0.02, 2.0, 0.4, step=0.02, label="believed noise of a (m/s\N{SUPERSCRIPT TWO})"),
            "dropout": Toggle(False, label="no measurements from 4.5 to 7.5 s"),
        },
        fail={"std_z": 0.15, "std_a": 0.04, "P": (BRACKET, 0.3)},
        because="The filter is told of less noise than there is: it trusts itself too much.",
        target=Target("a filter that is honest: mean NIS within its 99 % band", _is_honest),
        describe=_vehicle_sentence,
    )  # fmt: skip


# --- the arena ------------------------------------------------------------------


def _start_arena(state):
    course = circle_course(2)
    return {
        "truth": [course.x0],
        "estimate": [course.x0],
        "cov": [course.cov0],
        "nees": [],
        "nis": [],
        "seen": np.empty((0, 2)),
        "rng": np.random.default_rng(21),
    }


def _landmarks(state):
    return np.array([state["L1"], state["L2"]])[: state["count"]]


def _advance_arena(state, event):
    """One step of the circle for a tick, four for an arrow key: move, measure, predict, correct."""
    memory, course = state["memory"], circle_course(2)
    u = course.controls[0] if event == "tick" else np.array(KEYS[event])
    for _ in range(1 if event == "tick" else KEY_STEPS):
        _arena_step(state, memory, course, u)
    return memory


def _arena_step(state, memory, course, u):
    rng, marks = memory["rng"], _landmarks(state)
    noise = lecture.circle_drive().noise
    cov_u = odometry.control_covariance(u, course.dt, **noise)
    real = u + np.sqrt(np.diag(cov_u)) * rng.standard_normal(2)
    truth = odometry.step(memory["truth"][-1], real, course.dt, "euler")
    z = ekf.measurement(truth, marks) + rng.standard_normal((len(marks), 2)) * [course.std_range, course.std_bearing]
    z[:, 1] = planar.wrap_angle(z[:, 1])
    believed = (state["factor"] * course.std_range, state["factor"] * course.std_bearing)
    before, cov = memory["estimate"][-1], memory["cov"][-1]
    step = ekf.ekf_step(before, cov, u, course.dt, cov_u, z, marks, *believed, wrap=state["wrap"])
    memory["truth"].append(truth)
    memory["estimate"].append(step.x)
    memory["cov"].append(step.cov)
    memory["nees"].append(float(kalman.nees(truth, step.x, step.cov, angle=2)))
    memory["nis"].append(float(kalman.nis(step.innovation, step.cov_innovation)) / len(marks))
    toward = step.x[2] + z[:, 1]
    memory["seen"] = step.x[:2] + z[:, :1] * np.stack([np.cos(toward), np.sin(toward)], axis=1)


def compute_arena(state):
    """Paths, ellipse and consistency of the drive so far."""
    memory = state["memory"]
    truth, estimate = np.array(memory["truth"]), np.array(memory["estimate"])
    return {
        "truth": truth,
        "estimate": estimate,
        "ellipse": gaussian.ellipse(estimate[-1, :2], memory["cov"][-1][:2, :2]),
        "landmarks": _landmarks(state),
        "seen": memory["seen"],
        "nees": np.array(memory["nees"]),
        "error": float(np.linalg.norm((truth[-1] - estimate[-1])[:2])),
        "wrap": state["wrap"],
    }


def _rounded(number):
    """Three digits, written out up to a million."""
    return f"{float(f'{number:.3g}'):g}"


def _arena_sentence(result):
    if not len(result["nees"]):
        return f"{living('Click the picture and drive with the arrow keys, or press', 'Press')} play for the circle."
    over = float((result["nees"] > gaussian.chi_square_quantile(0.995, 3)).mean())
    text = f"The filter is {100 * result['error']:.0f} cm off; NEES now {_rounded(result['nees'][-1])}, expected 3."
    text += strayed(result["truth"][-1], ARENA)
    if not result["wrap"] and result["nees"].max() > 100:
        text += " A bearing near 180 deg jumped by a whole turn, and the correction took it at its word."
    return text + (f" Above the upper limit in {100 * over:.0f} % of the steps, expected 0.5 %." if over > 0.02 else "")


def arena():
    """A robot, one or two landmarks and an extended Kalman filter, with its consistency beside it."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.45, 1))
        style.axes(left, "x (m)", "y (m)", equal=True)
        left.set(xlim=ARENA[0], ylim=ARENA[1])
        style.axes(right, "steps", "NEES")
        right.set(xlim=(0, 400), ylim=(1e-2, 1e5), yscale="log")
        world, spare = draw.Arena(left), Spare(left, "2, unseen", (-8, 10), "left")
        panel = draw.Consistency(right, "NEES of each step", role="estimates")
        style.legend_above(right)
        limits = gaussian.chi_square_quantile([0.005, 0.995], 3)

        def update(state, result):
            spare.set(state["L2"], state["count"] == 1)
            world.set(*(result[key] for key in ("truth", "estimate", "ellipse", "landmarks", "seen")))
            panel.set(np.arange(1, len(result["nees"]) + 1), result["nees"], *limits)

        return [*world.artists, *spare.artists, *panel.artists], update

    return Stage(
        "landmark arena",
        scene=scene,
        compute=compute_arena,
        handles={
            "L1": Handle((5.0, 5.0), step=0.2, label="landmark 1"),
            "L2": Handle((-4.0, 5.5), step=0.2, label="landmark 2, seen with two"),
        },
        controls={
            "count": Choice({"one": 1, "two": 2}, 1, label="landmarks"),
            "factor": Slider(0.1, 5.0, 1.0, label="believed sensor noise, times the true one", log=True),
            "wrap": Toggle(True, label="wrap the bearing innovation"),
        },
        play=Play(30.0, dt=0.1, rate=2.0, start=6.0),
        keys=True,
        start=_start_arena,
        advance=_advance_arena,
        fail={"wrap": False, "count": 2, "t": 13.0},
        presets={"Sensor believed too good": {"factor": 0.2}},
        describe=_arena_sentence,
    )


# --- curvature ------------------------------------------------------------------


@functools.lru_cache(maxsize=64)
def corrections(std_prior, std_range):
    """One correction of 200 poor priors by two landmarks, for 1 to 6 iterations: (positions, cov, NEES) of each."""
    cov = np.diag([std_prior**2, std_prior**2, np.radians(10) ** 2])
    std_bearing = std_range / 3.0  # as precise across a landmark 3 m away as along it
    noise = gaussian.unit_noise((RUNS * 7,), seed=9)
    starts, noises = noise[: RUNS * 3].reshape(RUNS, 3), noise[RUNS * 3 :].reshape(RUNS, 2, 2)
    prior = starts * np.sqrt(np.diag(cov))
    z = ekf.measurement(np.zeros(3), TWO_MARKS) + noises * [std_range, std_bearing]
    found = []
    for n in ITERATIONS:
        step = ekf.ekf_update(prior, cov, z, TWO_MARKS, std_range, std_bearing, iterations=int(n))
        score = kalman.nees(np.zeros(3), step.x, step.cov, angle=2).mean()
        found.append((step.x[:, :2], step.cov.mean(0), float(score)))
    return found


def compute_honesty(state):
    """Corrected positions, the mean believed ellipse and mean NEES over the iterations."""
    found = corrections(round(float(state["std_prior"]), 4), round(float(state["std_range"]), 4))
    positions, cov, score = found[state["iterations"] - 1]
    scale = float(np.sqrt(np.percentile((positions**2).sum(1), 90)) * 1.4)
    return {
        "positions": positions / scale,
        "ellipse": gaussian.ellipse(np.zeros(2), cov[:2, :2]) / scale,
        "scale": scale,
        "curve": np.array([row[2] for row in found]),
        "iterations": state["iterations"],
        "nees": score,
        "rms": float(np.sqrt((positions**2).sum(1).mean())),
    }


def _honesty_sentence(result):
    low, high = kalman.mean_band(3, RUNS)
    verdict = "honest" if low < result["nees"] < high else "the filter believes its ellipse, and is wrong"
    return (
        f"RMS error {1000 * result['rms']:.0f} mm, mean NEES {_rounded(result['nees'])} "
        f"(99 % band {low:.2f} to {high:.2f}): {verdict}."
    )


def honesty():
    """A poor prior, a precise sensor: plain and iterated corrections of 200 robots at the origin."""

    def scene(fig):
        left, right = fig.subplots(1, 2)
        style.axes(left, "error in x", "error in y", equal=True)
        left.set(xlim=(-1, 1), ylim=(-1, 1), xticks=[], yticks=[])
        style.axes(right, "iterations", "mean NEES of 200 runs")
        right.set(xlim=(0.5, 6.5), ylim=(1, 1e6), yscale="log")
        low, high = kalman.mean_band(3, RUNS)
        right.axhspan(low, high, color=style.GRID)
        parts = draw.Honesty(left, right, ITERATIONS)
        words = right.text(0.98, 0.98, "", transform=right.transAxes, va="top", ha="right", fontsize=8)

        def update(state, result):
            parts.set(result["positions"], result["ellipse"], result["curve"], result["iterations"])
            words.set_text(f"errors shown: ±{result['scale']:.2g} m,\n90 % of them")

        return [*parts.artists, words], update

    return Stage(
        "a precise sensor and a poor prior",
        scene=scene,
        compute=compute_honesty,
        controls={
            "std_prior": Slider(0.1, 1.5, 0.3, step=0.1, label="std of the prior (m)"),
            "std_range": Slider(0.01, 0.5, 0.1, label="std of the distance (m)", log=True),
            "iterations": Slider(1, 6, 1, label="iterations"),
        },
        fail={"std_prior": 1.0, "std_range": 0.01},
        because="The distance is linearized far from the robot, and so precise a sensor is believed all the same.",
        presets={"Iterate": {"std_prior": 1.0, "std_range": 0.01, "iterations": 6}},
        describe=_honesty_sentence,
    )
