"""Stages of chapter 11: motions of robot and sensor, a pose left out, the next pose, calibrations done again."""

import functools

import numpy as np
from scipy import stats

from ...calibration.motion import between_axes, motions, screw
from ...calibration.own_data import Noise, hand_eye_derivative
from ...estimation.clocks import sample_stream
from ...estimation.gaussian import unit_noise
from ...estimation.influence import free_directions, inverse_normal, invert_normal, shares
from ...files.poses import read_poses
from ...files.samples import sample_cell
from ...geometry.frames import invert
from ...machines.sensor_cell import CELL
from ...stage import Choice, Handle, Slider, Stage, Toggle, style
from ...stage.scene3d import Scene, View
from . import figures as draw

WHITE = np.repeat([CELL.std_rot, CELL.std_trans], 3)
PLACE = (0.0, 0.0, 500.0)  # mm: the target in the sensor
EVERY = 0.5  # s between the samples of a stream that are compared
REPEATED = 4000
BINS = np.linspace(-draw.REACH, draw.REACH, 49)


# --- look before you compute -----------------------------------------------------------------------------------------


@functools.cache
def _cell(name):
    """Robot and second file of a cell, in mm."""
    return tuple(read_poses(path).in_unit("mm") for path in sample_cell(name))


def compute_motions(state):
    """Angles of the motions and between their axes (deg), robot and sensor, and the rms of what differs."""
    robot, other = _cell(state["cell"])
    T_BF, T_ST = robot.T, other.T
    if robot.time is not None:  # two streams: the robot where it was when the tracker saw it, twice a second
        step = max(1, round(EVERY / np.median(np.diff(other.time))))
        T_BF, known = sample_stream(robot.time, robot.T, other.time[::step] + state["clock_ms"] / 1000)
        T_BF, T_ST = T_BF[known], invert(other.T[::step][known])  # the tracker gives the marker in its world
    if state["inverted"]:
        T_ST = invert(T_ST)
    A, B = motions(T_BF, T_ST)
    angles = np.rad2deg([screw(A)[0], screw(B)[0]])
    between = np.rad2deg([between_axes(A, 2), between_axes(B, 2)])
    rms = [float(np.sqrt(np.mean((pair[0] - pair[1]) ** 2))) for pair in (angles, between)]
    return {"angles": angles, "between": between, "rms": rms}


def motions_beside_each_other():
    """The motions of robot and sensor from row to row: what no mounting can change lies on the diagonal."""

    def scene(fig):
        left, right = fig.subplots(1, 2)
        angles, between = (
            draw.diagonal(left, "angle of each motion", 60),
            draw.diagonal(right, "between two axes", 180),
        )

        def update(state, result):
            angles.set_data(*result["angles"])
            between.set_data(*result["between"])

        return [angles, between], update

    return Stage(
        "motions of robot and sensor",
        scene=scene,
        compute=compute_motions,
        controls={
            "cell": Choice(
                {"swapped role": "swapped_role", "slipped screw": "slipped_screw", "late clock": "late_clock"},
                "slipped_screw", label="cell",
            ),
            "inverted": Toggle(False, label="invert the second file"),
            "clock_ms": Slider(-200, 200, 0, step=2, label="clock set forward by (ms)"),
        },
        fail={"cell": "swapped_role"},
        because="One of the files holds the inverse poses: no mounting brings the axes together.",
        describe=lambda result: (
            f"The angles of the motions differ by {result['rms'][0]:.2g} deg (rms), the angles between their axes by "
            f"{result['rms'][1]:.2g} deg."
        ),
    )  # fmt: skip


# --- a pose left out -------------------------------------------------------------------------------------------------


def _derivatives(tilt_deg):
    """Whitened derivatives (n, 6, 12) of readings in which the target is tilted so, and the flange poses."""
    tilt = np.deg2rad(np.atleast_2d(tilt_deg))
    T_BF = CELL.looking(tilt, np.broadcast_to(PLACE, tilt.shape))
    return hand_eye_derivative(T_BF, invert(T_BF @ CELL.T_FS) @ CELL.T_BT, CELL.T_FS) / WHITE[:, None], T_BF


def _normal(J):
    return np.einsum("nki,nkj->ij", J, J)


@functools.cache
def _ten(kind):
    """Tilts (deg) of ten poses: all around, or about one axis but for the fourth."""
    k = np.arange(10)
    if kind == "around":
        return 30 * (2 * ((0.5 + np.outer(k, np.sqrt([2.0, 3.0, 5.0]))) % 1.0) - 1)
    return np.column_stack([np.where(k == 3, 20.0, 0.0), np.where(k == 3, 0.0, np.linspace(-30, 30, 10)), 0.0 * k])


def compute_without(state):
    """Covariances with all ten poses and without one, what the rest leave free, and each pose's share."""
    J, T_BF = _derivatives(_ten(state["kind"]))
    kept = np.arange(10) != state["drop"] - 1
    everything, C = inverse_normal(J), None
    paid, slide = np.zeros(10), np.zeros(3)
    free = free_directions(_normal(J[kept]))
    if not free.size:
        C, paid[kept] = inverse_normal(J[kept]), shares(J[kept])
    else:
        slide = (free @ np.linalg.svd(free[:3])[2][-1])[3:6]  # of what is free, the part that turns nothing
        slide /= np.linalg.norm(slide)
    std = [float(np.sqrt(np.trace(c[3:6, 3:6]))) if c is not None else np.inf for c in (everything, C)]
    return {
        "T_BF": T_BF, "T_BS": T_BF[0] @ CELL.T_FS, "kept": kept, "drop": state["drop"], "everything": everything,
        "covariance": C, "free": free.shape[1], "slide": T_BF[0, :3, :3] @ slide, "shares": paid, "std": std,
    }  # fmt: skip


def _without_sentence(result):
    if result["free"]:
        return (
            f"Without pose {result['drop']}, {result['free']} of the twelve singular values are zero but for rounding: "
            "the sensor can slide along the line through the target, and turn about it, unseen."
        )
    told = f"the sensor's place is known to {result['std'][1]:.2f} mm"
    if not result["drop"]:
        return f"All ten poses: {told}."
    return f"Without pose {result['drop']}: {told}, with all ten to {result['std'][0]:.2f} mm."


def pose_left_out():
    """Ten poses of a sensor on a flange: leave one out and see what the rest know of the mounting."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.1, 1))
        space = Scene(left, radius=350)
        flanges = space.points(**style.look("measurement"))
        lost = space.points(**style.look("rejected", markersize=9, markeredgewidth=2))
        sights = space.line(**style.look("guide", alpha=0.5))
        target = space.fixed(space.triad("target", length=70), CELL.T_BT)
        full, found = space.ellipsoid(**style.look("guide", linewidth=2.0)), space.ellipsoid(**style.look("estimate"))
        weak = space.line(color=style.ESTIMATE, linewidth=3)
        style.bare(left, "where the sensor sits, errors x 60")
        bars, cross = draw.shares(right, 10)
        target.name_at(-14, 12)

        def update(state, result):
            T_BF, kept = result["T_BF"], result["kept"]
            origins = T_BF[:, :3, 3]
            gap = np.full((1, 3), np.nan)
            flanges.set(origins[kept])
            lost.set(np.concatenate([origins[~kept], gap]))
            rays = [np.array([p, CELL.T_BT[:3, 3], gap[0]]) for p in origins[kept]]
            sights.set(np.concatenate(rays))
            R, at, block = T_BF[0, :3, :3], result["T_BS"][:3, 3], slice(3, 6)
            full.set(at, 60**2 * R @ result["everything"][block, block] @ R.T)
            C = result["covariance"]
            found.set(at, np.zeros((3, 3)) if C is None else 60**2 * R @ C[block, block] @ R.T)
            weak.set(CELL.T_BT[:3, 3] + np.outer([-250, 250], result["slide"]))
            space.draw(state["view"])
            draw.set_bars(bars, result["shares"])
            cross.set_data([result["drop"]] if result["drop"] else [], [0.3] if result["drop"] else [])

        return [*space.artists, bars, cross], update

    return Stage(
        "a pose left out",
        scene=scene,
        compute=compute_without,
        controls={
            "drop": Slider(0, 10, 0, step=1, label="leave out pose no."),
            "kind": Choice({"all around": "around", "one axis, and pose 4": "one"}, "one", label="tilted"),
        },
        view=View(-50, 15, center=(780.0, 100.0, 330.0)),
        fail={"drop": 4},
        describe=_without_sentence,
    )


# --- the next pose ---------------------------------------------------------------------------------------------------


@functools.cache
def _nine():
    """Tilts (deg) of nine poses that turn about y and hardly about x and z; their normal matrix."""
    y = np.linspace(-30, 30, 9)
    tilt = np.column_stack([2 * np.cos(7 * y), y, 2 * np.sin(5 * y)])
    return tilt, _normal(_derivatives(tilt)[0])


def compute_next(state):
    """Standard deviations (6,) now, with the pose that is dragged, and with ninety more of the kind."""
    N = _nine()[1]
    added = _normal(_derivatives([[*state["P"], 0.0]])[0])
    now, after, ninety = (np.sqrt(np.diagonal(invert_normal(M))[:6]) for M in (N, N + added, 11 * N))
    return {"now": now, "after": after, "ninety": ninety, "tilt": state["P"]}


def _next_sentence(result):
    now, after, ninety = (float(np.linalg.norm(result[key][3:])) for key in ("now", "after", "ninety"))
    gain = f"{after:.2f} mm with the next pose, {ninety:.2f} mm with ninety more like the nine"
    alike = abs(result["tilt"][0]) < 2.5
    return f"Sensor's place: {now:.2f} mm now, {gain}." + (" It is one of the same kind." if alike else "")


def next_pose():
    """Nine poses about one axis: drag the tilt of the tenth, and see what it leaves of each standard deviation."""

    def scene(fig):
        left, right = fig.subplots(1, 2)
        point = draw.tilts(left, _nine()[0][:, :2])
        bars, marks = draw.remaining(right)

        def update(state, result):
            point.set_data([state["P"][0]], [state["P"][1]])
            draw.set_bars(bars, 100 * result["after"] / result["now"])
            marks.set_data(np.arange(1, 7), 100 * result["ninety"] / result["now"])

        return [point, bars, marks], update

    return Stage(
        "the next pose",
        scene=scene,
        compute=compute_next,
        handles={"P": Handle((20.0, 0.0), step=1.0, bounds=((-32, 32), (-32, 32)), label="tilt of the next pose")},
        fail={"P": (0.0, 10.0)},
        describe=_next_sentence,
    )


# --- calibrations done again -----------------------------------------------------------------------------------------


@functools.lru_cache(maxsize=64)
def _again(n):
    """Errors of the sensor's x and the variance factor of its noise in REPEATED calibrations from n poses, to first
    order, and the degrees of freedom of that factor."""
    tilt = 30 * (2 * ((0.5 + np.outer(np.arange(n), np.sqrt([2.0, 3.0, 5.0]))) % 1.0) - 1)
    J, _ = _derivatives(tilt)
    rows, C = J.reshape(6 * n, 12), invert_normal(_normal(J))
    e = unit_noise((REPEATED, 6 * n), seed=11)
    estimate = e @ rows @ C
    r = (e - estimate @ rows.T).reshape(REPEATED, n, 6)[:, :, 3:]
    freedom = float(3 * n - shares(rows[:, None]).reshape(n, 6)[:, 3:].sum())
    return estimate[:, 3] / np.sqrt(C[3, 3]), (r**2).sum((1, 2)) / freedom, freedom


def compute_again(state):
    """Errors over the standard deviation told: histogram, share beyond 2, and the degrees of freedom."""
    error, factor, freedom = _again(state["n"])
    noise = Noise(np.ones(1), np.array([freedom]))
    told = {"known": 1.0, "estimated": np.sqrt(factor), "student": np.sqrt(factor) * noise.widening[0]}[state["noise"]]
    ratio = error / told
    density = np.histogram(ratio, BINS)[0] / REPEATED / (BINS[1] - BINS[0])
    widening = {"known": np.inf, "estimated": 1.0, "student": noise.widening[0]}[state["noise"]]
    return {
        "n": state["n"], "density": density, "freedom": freedom, "widening": widening, "noise": state["noise"],
        "beyond": float(np.mean(np.abs(ratio) > 2)), "spread": float(np.sqrt(np.mean(ratio**2))),
    }  # fmt: skip


def _again_sentence(result):
    words = {
        "known": "with the noise known",
        "estimated": f"with the noise estimated from {result['freedom']:.1f} degrees of freedom",
        "student": f"with Student's factor for {result['freedom']:.1f} degrees of freedom",
    }[result["noise"]]
    return (
        f"{result['n']} poses, {words}: {100 * result['beyond']:.1f} % lie beyond two standard deviations; the "
        f"rms error is {result['spread']:.2f} standard deviations."
    )


def done_again():
    """The same calibration thousands of times: how far the truth lies from it, in the standard deviations it told."""
    x = np.linspace(-draw.REACH, draw.REACH, 121)

    def scene(fig):
        steps, normal, student = draw.histogram(fig.subplots())
        normal.set_data(x, stats.norm.pdf(x))

        def update(state, result):
            steps.set_data((BINS[1:] + BINS[:-1]) / 2, result["density"])
            w = result["widening"]
            student.set_data(x, stats.norm.pdf(x) if np.isinf(w) else w * stats.t.pdf(w * x, result["freedom"]))

        return [normal, student, steps], update

    return Stage(
        "calibrations done again",
        scene=scene,
        compute=compute_again,
        controls={
            "n": Slider(3, 30, 4, step=1, label="poses"),
            "noise": Choice(
                {"known": "known", "estimated": "estimated", "with Student": "student"}, "estimated", label="noise"
            ),
        },
        fail={"n": 3},
        because="Three poses hardly tell how large the noise is.",
        describe=_again_sentence,
    )
