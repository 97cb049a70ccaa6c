"""Stages of chapter 6: the TX40 with joints to turn, a live tracker, A X = X B, errors in motion, repeated runs."""

import functools
import itertools
import threading
import time as clock

import numpy as np

from ...calibration import ax_xb
from ...documents.report.printed import COLUMNS, motions, statements, table_d
from ...estimation.gaussian import cut_axes, ellipse, unit_noise
from ...fast.ax_xb import calibrate_hand_eye, solve_ax_xb
from ...geometry.frames import invert, matrix_from_quaternion, pose, pose_distance, transform, unit_vector
from ...geometry.lie import exp_so3
from ...machines import simulation, stations, udp
from ...machines.arm import (
    HOME,
    REACH_FOREARM,
    REACH_WRIST,
    SHOULDER_OFFSET,
    TX40,
    forward_kinematics,
    jacobian,
    link_frames,
    reach_position,
    tool_pose,
)  # fmt: skip
from ...machines.log import reject_outliers
from ...machines.mounting import calibrate_mounting
from ...machines.packet import POSITION, QUATERNION, TIME, packet_from_pose
from ...machines.simulation import T_FE, Tracker
from ...machines.tracking import (
    filter_positions,
    median_over_speed,
    shift_time,
    speeds,
    static_error_and_lag,
    summarize,
    time_offset,
    tracking_errors,
)
from ...stage import Choice, Handle, Play, Slider, Stage, Toggle, living, style
from ...stage.marks import Readout
from ...stage.scene3d import Scene, View
from ...stage.scene3d_handles import Dial, Free, OnSphere
from ...tables import read_table
from . import figures as draw
from .bodies import RINGS
from .whole_cell import whole_cell as whole_cell  # a Stage of this chapter, in a module of its own

ARM, WRIST = ("q1", "q2", "q3"), ("q4", "q5", "q6")
NEARLY_SINGULAR = 25.0  # mm per rad: below it, turning the arm's joints hardly moves the flange in some direction
NEARLY_ALIGNED = 5.0  # deg between the axes 4 and 6, below which the caption speaks of the wrist
# dials of the arm: link, angle from its x axis (deg), radius and height above it (mm); the second is the elbow itself
GRIPS = ((0, 0.0, 128.0, 250.0), (1, -90.0, REACH_WRIST - REACH_FOREARM, SHOULDER_OFFSET), (2, 0.0, 110.0, 0.0))


def joints(state):
    """Joint angles, rad, shape (6,), from the dials (deg)."""
    return np.deg2rad([state[name] for name in (*ARM, *WRIST)])


def compute_tx40(state):
    """Frames of the links, poses of flange and tracker, the wrist's distance from axis 2 (mm), and what the first three
    joints can do at the flange: singular values, mm per rad."""
    q = joints(state)
    frames = link_frames(TX40.dh, q)
    values = np.linalg.svd(jacobian(TX40.dh, q)[3:, :3], compute_uv=False)
    return {
        "q": q, "frames": frames, "T_BF": frames[6], "T_BE": frames[6] @ T_FE, "singular_values": values,
        "wrist": float(np.hypot(*transform(invert(frames[1]), frames[4, :3, 3])[:2])), "reach": state["reach"],
    }  # fmt: skip


def follow(state, moved):
    """Dragging the flange turns the arm, turning the arm moves the flange."""
    q = joints(state)
    if "flange" in moved and not moved & {*ARM, *WRIST}:
        q = reach_position(TX40, state["flange"], q)
    at = forward_kinematics(TX40.dh, q)[:3, 3]
    return {"flange": at, **{name: float(np.rad2deg(q[k])) for k, name in enumerate(ARM)}}


def _sentence(result):
    x, y, z = result["T_BE"][:3, 3]
    if result["singular_values"][-1] < NEARLY_SINGULAR:
        return (
            f"A singular arm: in one direction the flange moves only {result['singular_values'][-1]:.0f} mm per rad. "
            "Stretched out, no joint can push it farther."
        )
    if abs(np.rad2deg(result["q"][4])) < NEARLY_ALIGNED:
        return "The rings of joints 4 and 6 lie on each other: both turn the flange about one line, and one is wasted."
    off = np.linalg.norm(T_FE[:3, 3])
    return f"The tracker E is at ({x:.0f}, {y:.0f}, {z:.0f}) mm in the base, {off:.0f} mm off the flange F."


def _grip(joint):
    """Where the dial of a joint has its circle: about its axis; of the arm on the link it turns, of the wrist on its
    ring."""

    def where(result):
        frames = result["frames"]
        if joint >= 3:
            T = frames[joint].copy()
            T[:3, 3] = frames[4, :3, 3]
            return T, RINGS[joint - 3]
        link, angle, radius, height = GRIPS[joint]
        return frames[link] @ pose(exp_so3([0, 0, np.deg2rad(angle)]), [0, 0, height]), radius

    return where


def tx40():
    """The TX40: grab a joint and turn it, or the flange and pull; F is the flange, E the tracker mounted on it."""

    grips = [_grip(k) for k in range(6)]

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(2.9, 1))
        space = Scene(left, radius=530, half_width=560, floor=0.0, unit="mm")
        arm = draw.ArmPicture(space)
        style.bare(right)
        words = Readout(right)

        def update(state, result):
            arm.set(result["frames"], result["T_BE"], [grip(result) for grip in grips], result["q"])
            arm.reach.show(result["reach"])
            space.draw(state["view"])
            angles = "\n".join(f"joint {k + 1}   {np.rad2deg(a):6.0f} deg" for k, a in enumerate(result["q"]))
            x, y, z = result["T_BF"][:3, 3]
            low = result["singular_values"][-1]
            words.set_text(
                f"{angles}\n\nF at\n{x:.0f}, {y:.0f}, {z:.0f} mm\nwrist to axis 2\n{result['wrist']:.0f} mm\n"
                f"least mobility\n{low:.0f} mm per rad"
            )

        return [*space.artists, words], update

    low, high = np.rad2deg([TX40.q_min, TX40.q_max])
    start = np.round(np.rad2deg(HOME))
    colors = (style.INK,) * 3 + style.AXES[::-1]
    return Stage(
        "TX40 with a tracker on its flange",
        scene=scene,
        compute=compute_tx40,
        handles={
            **{
                name: Dial(start[k], low[k], high[k], grips[k], label=f"joint {k + 1}", color=colors[k])
                for k, name in enumerate((*ARM, *WRIST))
            },
            "flange": Handle(
                tuple(forward_kinematics(TX40.dh, HOME)[:3, 3]), step=10, label="flange", way=Free(),
                color=style.ESTIMATE,
            ),
        },
        controls={"reach": Toggle(False, "where the wrist can get")},
        constrain=follow,
        view=View(-60, 18, center=(120, 0, 440), eye=3200),
        fail={"q1": 30.0, "q2": 60.0, "q3": 14.0, "reach": True},
        presets={
            "arm upright": {"q1": 0.0, "q2": 0.0, "q3": 0.0},
            "wrist in line": {"q4": 40.0, "q5": 0.0, "q6": -40.0},
        },
        describe=_sentence,
    )  # fmt: skip


# ---- live ------------------------------------------------------------------------------------------------------------

LIVE_SECONDS, LIVE_STEP, TRAIL = 60.0, 0.02, 375  # s, s (the browser adds what it needs itself), readings drawn
REHEARSED = 1000  # packets until the tracker is well on its way
IDLE = 1.5  # s without a look after which the stream ends by itself
NEARBY = np.array(
    [stations.looking(place, (-60.0, 60.0, 0.0)) for place in ((-470.0, 60.0, 400.0), (60.0, 470.0, 400.0))]
)  # two stations, drawn close by; real ones hang meters away
SLOWED = 120.0  # times, for the eye
SWING = 1.4  # rad, of a sheet on its way across the tracker


def _faults(loss):
    return udp.Faults(loss=float(loss), duplicate=0.01, reorder=0.02, malformed=0.01)


@functools.cache
def _rehearsed(nonsense):
    """Packets of a tracker that is well on its way."""
    endless = simulation.endless_packets(np.random.default_rng(1), lambda: nonsense)
    return list(itertools.islice(endless, REHEARSED, REHEARSED + TRAIL))


@functools.lru_cache(maxsize=64)
def rehearsal(loss, nonsense):
    """Readings (k, 23) and `udp.Statistics` of a piece of the stream, handed on without a network: what stands there
    before play."""
    receiver = udp.Receiver(keep=TRAIL)
    for _, datagram, kind in udp.stream(_rehearsed(nonsense), simulation.RATE, _faults(loss), np.random.default_rng(2)):
        if kind != "lost":
            receiver.take(datagram)
    return receiver.readings(), receiver.statistics()


class Link:
    """A simulated tracker and a receiver, connected by real UDP packets; both start at the first look and end when
    nobody looks any more."""

    def __init__(self):
        self.faults, self.nonsense = _faults(0.0), False
        self._lock = threading.Lock()
        self._listener = self._sender = None
        self._looked = 0.0

    def look(self, loss, nonsense):
        """Readings (k, 23) and `udp.Statistics` so far; starts the stream if need be."""
        self.faults.loss, self.nonsense = float(loss), bool(nonsense)
        with self._lock:
            self._looked = clock.monotonic()
            if self._listener is None:
                self._listener = udp.listen(keep=TRAIL)
                packets = simulation.endless_packets(np.random.default_rng(1), lambda: self.nonsense)
                stream = udp.stream(packets, simulation.RATE, self.faults, np.random.default_rng(2))
                self._sender = udp.Sender(stream, self._listener.port)
                threading.Thread(target=self._watch, name="tracker link", daemon=True).start()
            return self._listener.readings(), self._listener.statistics()

    def _watch(self):
        while True:
            clock.sleep(0.2)
            with self._lock:
                if clock.monotonic() - self._looked > IDLE:
                    self._sender.close()
                    self._listener.close()
                    self._listener = self._sender = None
                    return


def compute_live(readings, statistics):
    """What the picture shows of readings (k, 23): positions (mm), which passed the gate, the filtered path, the last
    pose, the statistics."""
    if len(readings) < 5:
        readings = packet_from_pose(np.tile(np.eye(4), (5, 1, 1)), np.arange(5) / simulation.RATE)
    positions = 1000 * readings[:, POSITION]
    filtered, used = filter_positions(readings[:, TIME], positions)
    last = pose(matrix_from_quaternion(readings[-1, QUATERNION]), filtered[-1])
    return {"positions": positions, "used": used, "filtered": filtered, "T_WE": last, "statistics": statistics}


def sheets_of_light(t, place):
    """Poses of both stations' sheets of light at a time (s), (2, 4, 4), and which of them shines; each meets the place,
    (3,), in the middle of its way.
    """
    phase = (t * stations.TURN_RATE / SLOWED) % 2.0
    x, _, z = transform(invert(NEARBY), place).T
    angle = np.arctan2(x, z) + SWING * (phase - np.arange(2) - 0.5)
    return NEARBY @ pose(exp_so3(angle[:, None] * ABOUT_Y), np.zeros(3)), int(phase)


SHORT = {
    "length": "not 184 bytes",
    "a number is not finite": "a number not finite",
    "the quaternion is not of length 1": "quaternion not a unit",
}


def _live_words(result):
    s = result["statistics"]
    bad = "\n".join(f"   {SHORT.get(why, why)}   {count}" for why, count in sorted(s.bad.items())) or "   none"
    return (
        f"datagrams   {s.datagrams}\ngood   {s.good}\nlate   {s.late}\nduplicates   {s.duplicates}\n"
        f"lost (from time stamps)   {s.lost}\nrefused by the gate, of {len(result['used'])}   "
        f"{np.count_nonzero(~result['used'])}\nbad\n{bad}"
    )


def live_tracker():
    """Real packets over UDP on this machine: press play, then lose packets and let the optics talk nonsense."""
    link = Link()

    def compute(state):
        if state["t"] <= 0:
            return {**compute_live(*rehearsal(state["loss"], state["nonsense"])), "playing": False}
        return {**compute_live(*link.look(state["loss"], state["nonsense"])), "playing": True}

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.5, 1))
        space = Scene(left, radius=480, half_width=520, floor=-320.0, unit="mm")
        trail = draw.Trail(space, right)
        sweep = draw.Sweep(space, NEARBY)
        style.bare(right)
        words = Readout(right, 0.97)

        def update(state, result):
            trail.set(result["positions"], result["used"], result["filtered"], result["T_WE"])
            sweep.set(*sheets_of_light(state["t"], result["T_WE"][:3, 3]))
            space.draw(state["view"])
            trail.path_in_front()
            words.set_text(_live_words(result))

        return [*space.artists, words], update

    def sentence(result):
        s = result["statistics"]
        if not s.datagrams:
            return "The first packet is on its way."
        counted = f"{s.good} good readings, {s.lost} lost, {sum(s.bad.values())} bad, each counted once."
        if result["playing"]:
            return counted
        return f"1.5 s of the stream: {counted} Press play{living(': real packets arrive over UDP')}."

    return Stage(
        "live tracker",
        scene=scene,
        compute=compute,
        controls={"loss": Slider(0.0, 0.5, 0.0, step=0.01, label="loss"), "nonsense": Toggle(False, "nonsense")},
        play=Play(LIVE_SECONDS, LIVE_STEP),
        view=View(-50, 24, center=(-60, 60, 80), eye=3200.0),
        fail={"loss": 0.4, "nonsense": True},
        because="Of five packets two are lost, and the stamps tell; the optics talk nonsense, and the gate refuses it.",
        describe=sentence,
    )


# ---- A X = X B with two axes -----------------------------------------------------------------------------------------

REPEATS = 60
X_TRUE = pose(exp_so3([0.3, -0.5, 0.4]), [30.0, -20.0, 60.0])
STD_TRANS = 0.2  # mm, of the sensor's translations


def compute_two_axes(state):
    """Two motions about the dragged axes, calibrated from noisy readings again and again by the report's method.

    Returns a dictionary: axes (2, 3), angle_deg between them, singular_values (9,) without noise, found (n, 3, 3),
    error_deg and error_mm (median), predicted_deg (rms, from the smallest but one singular value), free: path of the
    tip of X that parallel axes leave undetermined, (m, 3).
    """
    axes = unit_vector(np.array([state["a"], state["b"]]))
    angle, noise = np.deg2rad(state["angle"]), np.deg2rad(state["noise"])
    A = pose(exp_so3(angle * axes), [[120.0, -60, 80], [-70.0, 150, 40]])
    B = invert(X_TRUE) @ A @ X_TRUE
    values = np.linalg.svd(ax_xb.kronecker_matrix(A, B), compute_uv=False)
    e = unit_noise((REPEATS, 2, 6), seed=6)
    noisy = B @ pose(exp_so3(noise * e[..., :3]), STD_TRANS * e[..., 3:])
    found = solve_ax_xb(A, noisy)
    turn, off = pose_distance(found, X_TRUE)
    apart = np.rad2deg(np.arctan2(np.linalg.norm(np.cross(*axes)), abs(axes[0] @ axes[1])))
    free = (
        exp_so3(np.linspace(0, 2 * np.pi, 60)[:, None] * axes[0]) @ X_TRUE[:3, 0]
        if apart < 2
        else np.full((1, 3), np.nan)
    )
    return {
        "axes": axes, "angle_deg": apart, "singular_values": values, "found": found[:, :3, :3], "free": 0.55 * free,
        "error_deg": float(np.rad2deg(np.median(turn))), "error_mm": float(np.median(off)),
        "predicted_deg": float(np.rad2deg(2 * noise / values[-2])) if values[-2] > 1e-9 else np.inf,
    }  # fmt: skip


def _two(value):
    """A number in words: two digits, and no power of ten where it is large."""
    return f"{value:.0f}" if value >= 100 else f"{value:.2g}"


def _axes_sentence(result):
    if result["angle_deg"] < 2:
        return (
            f"The axes are {result['angle_deg']:.1f} deg apart: the mounting may turn freely about them (dashed "
            f"circle). Median error {result['error_deg']:.0f} deg, and the residuals look perfect."
        )
    error = f"{_two(result['error_deg'])} deg and {_two(result['error_mm'])} mm"
    return f"Axes {result['angle_deg']:.0f} deg apart: median error {error}."


def two_axes():
    """Drag both rotation axes: the singular values and the error of the mounting follow."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.2, 1))
        space = Scene(left, radius=1.3)
        picture = draw.RotationAxes(space, 1.0)
        stems, markers = draw.singular_values(right)
        words = left.text(0.0, 1.0, "", transform=left.transAxes, va="top", fontsize=9)  # one line: the sphere is near

        def update(state, result):
            picture.set(result["axes"], pose(X_TRUE[:3, :3], np.zeros(3)), result["found"], result["free"])
            space.draw(state["view"])
            draw.set_singular_values(stems, markers, result["singular_values"])
            limit = f"{_two(deg)} deg rms" if (deg := result["predicted_deg"]) < 180 else "without limit"
            words.set_text(f"predicted error {limit}")

        return [*space.artists, stems, markers, words], update

    return Stage(
        "A X = X B with two axes",
        scene=scene,
        compute=compute_two_axes,
        handles={
            "a": Handle((1.0, 0.0, 0.0), step=0.05, label="first rotation axis", way=OnSphere()),
            "b": Handle((0.0, 0.6, 0.8), step=0.05, label="second rotation axis", way=OnSphere()),
        },
        controls={
            "angle": Slider(1.0, 120.0, 40.0, step=1.0, label="angle of the motions (deg)"),
            "noise": Slider(0.01, 1.0, 0.1, step=0.01, label="noise (deg)"),
        },
        view=View(-50, 25, eye=7.0),
        fail={"a": (0.0, 0.6, 0.8)},
        presets={"small motions": {"angle": 2.0}},
        describe=_axes_sentence,
    )


# ---- errors in motion ------------------------------------------------------------------------------------------------

SAMPLES = 400


@functools.cache
def _slow_path():
    time, q = simulation.robot_motion("slow", SAMPLES / simulation.SLOW_DURATION)
    return time, tool_pose(TX40, q, T_FE)


@functools.cache
def _slow_speed():
    return speeds(*_slow_path())[0].max() / 1000


def compute_dynamic(state):
    """Errors of the path run at a top speed (m/s) with a latency (ms), with nonsense or not, raw and mended."""
    time, T = _slow_path()
    time = time * _slow_speed() / state["speed"]
    rng = np.random.default_rng(13)
    tracker_now = Tracker(nonsense=0.015 if state["nonsense"] else 0.0, burst=2.0, latency=state["latency"] / 1000)
    read, _, w_read, bad = simulation.follow_path(time, T, tracker_now, rng)
    step = time[1] - time[0]
    offset = time_offset(time, speeds(time, T)[1], w_read, max_offset=max(3 * step, 0.08)) if step < 0.05 else 0.0
    error = pose_distance(T, read)[1]
    mended = pose_distance(shift_time(time, T, -offset), read)[1]
    keep = reject_outliers(mended, 6.0)
    return {
        "share": np.linspace(0, 1, len(time)), "error": error, "bad": bad, "mended": mended, "keep": keep,
        "offset_ms": 1000 * offset,
        "raw_summary": summarize(error), "mended_summary": summarize(mended[keep]),
    }  # fmt: skip


def dynamic_errors():
    """One path at many speeds: latency, nonsense, and what four summaries make of them."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.4, 1))
        raw, nonsense, corrected = draw.error_over_time(left, 1.0)
        before, after, claim, words = draw.summary(right)

        def update(state, result):
            x, good = result["share"], ~result["bad"]
            raw.set_data(x[good], result["error"][good])
            nonsense.set_data(x[~good], result["error"][~good])
            corrected.set_data(x[result["keep"]], result["mended"][result["keep"]])
            before.set_data(range(4), [result["raw_summary"][name] for name in draw.SUMMARY])
            after.set_data(range(4), [result["mended_summary"][name] for name in draw.SUMMARY])
            words.set_text(f"offset found {result['offset_ms']:.1f} ms")

        return [raw, nonsense, corrected, before, after, words], update

    def sentence(result):
        raw, mended = result["raw_summary"], result["mended_summary"]
        return (
            f"Readings: mean {raw['mean']:.1f} mm, median {raw['median']:.1f}, RMS {raw['RMS']:.0f}. Gated, with the "
            f"offset of {result['offset_ms']:.0f} ms removed: mean {mended['mean']:.1f} mm."
        )

    return Stage(
        "errors in motion",
        scene=scene,
        compute=compute_dynamic,
        controls={
            "speed": Slider(0.1, 1.4, 0.35, step=0.05, label="top speed (m/s)"),
            "latency": Slider(0.0, 60.0, 8.0, step=1.0, label="latency (ms)"),
            "nonsense": Toggle(True, "nonsense"),
        },
        fail={"speed": 1.4, "latency": 60.0},
        because="Fast, and 60 ms late: a reading shows where the tracker was, not where it is.",
        presets={"fast, no nonsense": {"speed": 1.4, "latency": 20.0, "nonsense": False}},
        describe=sentence,
    )


# ---- methods beside the bound ----------------------------------------------------------------------------------------

CASES = {
    "0.1 deg, 0.1 mm": (0.1, 0.1),
    "0.1 deg, 1 mm": (0.1, 1.0),
    "0.5 deg, 0.1 mm": (0.5, 0.1),
    "0.5 deg, 1 mm": (0.5, 1.0),
}


FIRST, AT_ONCE = "rotation first", "both at once"
WAYS = {
    "OpenCV Tsai": FIRST, "OpenCV Park": FIRST, "OpenCV Horaud": FIRST, "OpenCV Andreff": AT_ONCE,
    "OpenCV Daniilidis": AT_ONCE, "report": FIRST, "maximum likelihood": "both, weighed by noise",
}  # fmt: skip


@functools.cache
def _benchmark():
    return read_table("tracker/hand_eye_methods.csv", text=("method",))


def compute_methods(state):
    """Stored benchmark of one noise case: names, and error over bound of rotation and translation."""
    table = _benchmark()
    deg, mm = CASES[state["case"]]
    rows = (table["std_deg"] == deg) & (table["std_mm"] == mm)
    return {
        "names": list(table["method"][rows]),
        "rotation": table["rotation"][rows],
        "translation": table["translation"][rows],
    }


def methods():
    """Seven methods for A X = X B, their error as a multiple of the Cramer-Rao bound; stored results."""

    def scene(fig):
        cases = [compute_methods({"case": case}) for case in CASES]
        names, elsewhere = cases[0]["names"], np.array([case["rotation"] for case in cases])
        rotation, translation = draw.method_chart(fig.subplots(), names, [WAYS[name] for name in names], elsewhere)

        def update(state, result):
            for markers, key in ((rotation, "rotation"), (translation, "translation")):
                markers.set_data(result[key], range(len(result["names"])))

        return [rotation, translation], update

    def sentence(result):
        best, worst = np.argmin(result["rotation"]), np.argmax(result["rotation"])
        return (
            f"Best: {result['names'][best]}, {result['rotation'][best]:.2f} times the bound in rotation; "
            f"worst: {result['names'][worst]}, {result['rotation'][worst]:.1f} times."
        )

    return Stage(
        "methods beside the bound",
        scene=scene,
        compute=compute_methods,
        controls={"case": Choice(list(CASES), "0.1 deg, 1 mm", label="noise")},
        fail={"case": "0.5 deg, 0.1 mm"},
        because="The noise is 0.5 deg, yet only 0.1 mm: a method that does not weigh the two apart pays for it.",
        describe=sentence,
        size=(7.0, 4.2),
    )


# ---- six runs --------------------------------------------------------------------------------------------------------

THREE_STD = 1 - np.exp(-0.5 * 3.0**2)  # share of a normal distribution in the plane within three standard deviations


@functools.cache
def _stops():
    joints = simulation.measuring_joints()
    return simulation.flange_poses(joints), tool_pose(TX40, joints, T_FE)


def compute_six_runs(state):
    """Six calibrations over the same 21 poses, with a systematic error of a size (mm rms per axis) that depends on the
    place."""
    T_BF, T_BE = _stops()
    field = float(state["field"])
    tracker_now = Tracker(
        std_position=0.06, std_rotation=np.deg2rad(0.008), field_position=field, field_rotation=np.deg2rad(0.14) * field
    )
    rngs = [np.random.default_rng([66, run]) for run in range(simulation.RUNS)]
    readings = [simulation.stop_readings(T_BE, tracker_now, rng) for rng in rngs]
    A = invert(T_BF[0]) @ T_BF[1:]
    results = np.array([ax_xb.solve_ax_xb(A, T_WE[1:])[:3, 3] for T_WE in readings])
    single = calibrate_hand_eye(T_BF, readings[-1], eye="to hand")
    spread, claim = np.cov(results.T, bias=True), single.covariance_of("T_FT.translation")
    return {
        "results": results, "spread": spread, "mean": results.mean(0), "single": single.T_FT[:3, 3], "claim": claim,
        "off": float(np.linalg.norm(results.mean(0) - T_FE[:3, 3])),
        "std": float(np.sqrt(results.var(0).sum())),
    }  # fmt: skip


def six_runs():
    """Six runs over the same poses: how well they agree, and how far they all are from the truth."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.35, 1))
        space = Scene(left, radius=7.0, half_width=7.5, title="six runs, each 21 poses, seen from the truth", unit="mm")
        picture = draw.Repeated(space, right, 2.5)
        style.bare(right)
        words = Readout(right, 0.9)

        def update(state, result):
            truth = T_FE[:3, 3]
            picture.set(
                result["results"] - truth, result["mean"] - truth, result["spread"], result["single"] - truth,
                result["claim"],
            )  # fmt: skip
            space.draw(state["view"])
            words.set_text(
                f"spread over six runs\n{result['std']:.2f} mm\n\nmean off the truth\n{result['off']:.2f} mm\n\n"
                f"std that one run claims\n{np.sqrt(np.trace(result['claim'])):.2f} mm"
            )

        return [*space.artists, words], update

    return Stage(
        "six runs",
        scene=scene,
        compute=compute_six_runs,
        controls={"field": Slider(0.0, 6.0, 2.0, step=0.1, label="systematic error (mm)")},
        view=View(-50, 22),
        fail={"field": 6.0},
        because="What is always wrong is wrong in each of the six runs: repeating them shows nothing of it.",
        presets={"no systematic error": {"field": 0.0}},
        describe=lambda r: (
            f"The six runs agree within {r['std']:.2f} mm; their mean is {r['off']:.2f} mm off the truth, "
            f"{r['off'] / r['std']:.1f} times as much."
        ),
    )


# ---- base stations ---------------------------------------------------------------------------------------------------

SWEEPS = 40  # simulated readings of one place
FLOOR = 2600.0  # mm, half the width of the room that is drawn
CLOSEST = 200.0  # mm of the diode in front of a station


def _flat(place):
    """A place on the plan as a point in space, at the height of the stations."""
    return np.append(place, 0.0)


def compute_sweeps(state):
    """Two stations in a plane and a diode: what they measure, where the rays meet, how sure the place is.

    Returns a dictionary: angles (2,) rad, delays (2,) s, covariance (2, 2) mm^2, outline (n, 2), found (n, 2),
    std (2,) mm, the larger first.
    """
    T_WL = np.array([stations.looking(_flat(state[name]), np.zeros(3)) for name in "AB"])
    std = 2 * np.pi * stations.TURN_RATE * 1e-6 * state["jitter"]
    place = _flat(state["P"])
    angles = stations.station_angles(T_WL, place)
    cov = stations.place_covariance(T_WL, place, std)[:2, :2]
    noisy = angles + std * unit_noise((SWEEPS, 2, 1), seed=61) * [1.0, 0.0]
    directions = (T_WL[:, :3, :3] @ stations.ray_direction(noisy)[..., None])[..., 0]
    found = np.array([stations.nearest_to_rays(T_WL[:, :3, 3], d)[:2] for d in directions])
    return {
        "angles": angles[:, 0], "delays": stations.sweep_delay(angles[:, 0]), "covariance": cov,
        "outline": ellipse(place[:2], cut_axes(cov, FLOOR), THREE_STD), "found": found,
        "std": np.sqrt(np.linalg.eigvalsh(cov)[::-1]), "stations": T_WL[:, :2, 3], "place": place[:2],
    }  # fmt: skip


def _in_view(state, moved):
    """Stations off the middle they look at, and the diode in front of both: a station sees nothing behind itself."""
    seen = {"P": np.array(state["P"], dtype=float)}
    for name in "AB":
        far = np.hypot(*state[name])
        ahead = -np.array(state[name]) / far if far else np.array([0.0, 1.0])
        seen[name] = -ahead * max(far, 2 * CLOSEST)
    for _ in range(20):  # from one station to the other until both see it
        for name in "AB":
            ahead = -seen[name] / np.hypot(*seen[name])
            seen["P"] = seen["P"] + max(0.0, CLOSEST - (seen["P"] - seen[name]) @ ahead) * ahead
    return {key: np.clip(place, -FLOOR, FLOOR) for key, place in seen.items() if not np.array_equal(place, state[key])}


def _sweeps_sentence(result):
    longer, shorter = result["std"]
    return f"The place is uncertain by {longer:.0f} mm in one direction and by {shorter:.0f} mm across it."


def sweeps():
    """Two base stations and a diode on a plan: delays, rays, and the ellipse of the place.

    A plan: the angle at which both rays cross is the whole matter, and a view from aside would falsify it.
    """

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.5, 1))
        picture = draw.Plan(left, right, FLOOR)
        style.bare(right)
        words = Readout(right, 0.92)

        def update(state, result):
            picture.set(result["stations"], result["place"], result["found"], result["outline"])
            lines = [
                f"{name}: {1000 * delay:.3f} ms after its flash\n    {np.rad2deg(angle):.1f} deg"
                for name, delay, angle in zip("AB", result["delays"], result["angles"])
            ]
            words.set_text(
                "\n".join(lines) + f"\n\nstandard deviation\n{result['std'][0]:.1f} mm and {result['std'][1]:.1f} mm"
            )

        return [*picture.artists, words], update

    reach = ((-FLOOR, FLOOR), (-FLOOR, FLOOR))
    return Stage(
        "two sweeps, one place",
        scene=scene,
        compute=compute_sweeps,
        handles={
            "A": Handle((-1700.0, -1500.0), step=50, bounds=reach, label="station A"),
            "B": Handle((1700.0, -1500.0), step=50, bounds=reach, label="station B"),
            "P": Handle((300.0, 700.0), step=50, bounds=reach, label="diode"),
        },
        controls={"jitter": Slider(1.0, 80.0, 40.0, step=1.0, label="error of a time (us)")},
        constrain=_in_view,
        fail={"A": (-1900.0, -1500.0), "B": (-1500.0, -1300.0)},
        because="Both stations look from nearly the same side: their rays run along each other.",
        describe=_sweeps_sentence,
    )


STD_ANGLE = 2e-5  # rad: white noise of an angle averaged over a stop, a twentieth of a millimeter at 2.5 m
KEEP_ALL = 1e9  # no stop is left out: what one moved station does to the fit is the question
STOPS = np.arange(simulation.STOPS)
ABOUT_Y = np.array([0.0, 1.0, 0.0])
COURSES = {  # the station's rotation vector at each stop, for a turn of 1
    "before the run": np.tile(ABOUT_Y, (len(STOPS), 1)),
    "after stop 10": (STOPS > 10)[:, None] * ABOUT_Y,
    "slowly, all along": (STOPS / STOPS[-1])[:, None] * ABOUT_Y,
    "at every stop": unit_noise((len(STOPS), 3), seed=9),
}


def compute_moved_station(state):
    """A calibration run whose second station turns by `tilt` mrad: errors of the stops, figures of merit, mounting.

    Returns a dictionary: errors (21,) mm, E_trans (mm), mean (mm), off (mm): of the mounting from the truth.
    """
    T_BF, T_BE = _stops()
    actual = stations.last_turned(stations.STATIONS, 1e-3 * state["tilt"] * COURSES[state["when"]])
    read = stations.read_poses(T_BE, stations.STATIONS, actual, np.random.default_rng(5), STD_ANGLE)
    found = calibrate_mounting(T_BF, invert(read[0]) @ read, factor=KEEP_ALL)
    return {
        "errors": found.translation, "E_trans": found.E_trans, "mean": float(found.translation[1:].mean()),
        "off": float(np.linalg.norm(found.T_FE[:3, 3] - T_FE[:3, 3])),
    }  # fmt: skip


def moved_station():
    """The run of section 3.1 with a station that moves: error of each stop, E_trans, and the mounting's own error."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.7, 1))
        errors = draw.error_by_stop(left, simulation.STOPS, table_d().mean[COLUMNS.index("mean_mm")])
        style.bare(right)
        words = Readout(right, 0.92)

        def update(state, result):
            errors.set_data(np.arange(1, simulation.STOPS), result["errors"][1:])
            words.set_text(
                f"E_trans\n{result['E_trans']:.2f} mm\n\nmean error of a stop\n{result['mean']:.2f} mm\n\n"
                f"mounting off the truth\n{result['off']:.2f} mm"
            )

        return [errors, words], update

    return Stage(
        "a station that moves",
        scene=scene,
        compute=compute_moved_station,
        controls={
            "tilt": Slider(0.0, 6.0, 1.7, step=0.1, label="turn of station 2 (mrad)"),
            "when": Choice(list(COURSES), "before the run", label="it moves"),
        },
        fail={"tilt": 4.0, "when": "at every stop"},
        because="The station turns anew at every stop: no single mounting fits them all.",
        presets={"after stop 10": {"when": "after stop 10"}},
        describe=lambda r: f"E_trans is {r['E_trans']:.2f} mm, and the mounting is {r['off']:.2f} mm off the truth.",
    )


# ---- errors over speed -----------------------------------------------------------------------------------------------

SHARES = np.linspace(0.0, 1.25, 11)  # edges of the intervals of speed
MIDDLES = 0.5 * (SHARES[1:] + SHARES[:-1])
OVER = {  # quantity: its place in `TrackingErrors`, its unit, and the speed it is drawn over
    "position": ("translation", "mm", 0),
    "rotation": ("rotation", "deg", 1),
    "speed": ("speed", "mm/s", 0),
    "angular speed": ("angular_speed", "deg/s", 1),
}


@functools.cache
def _fastest():
    """The highest speeds of all motions, mm/s and rad/s: what the axis counts as 1."""
    return 1000 * motions()["v_high"][:3].max(), motions()["w_high"].max()


def _printed(quantity):
    """Mean and largest error as the report prints them; of the angular speed it prints the mean in rad/s, NaN here."""
    said, name = statements(), {"rotation": "orientation"}.get(quantity, quantity).replace(" ", "_")
    return [np.nan if quantity == "angular speed" else said[f"mean_{name}"], said[f"largest_{name}"]]


@functools.cache
def _motion_path(name):
    time, q = simulation.robot_motion(name, 50.0)
    T = tool_pose(TX40, q, T_FE)
    return time, T, speeds(time, T)


def compute_over_speed(state):
    """Errors of the slow, middle and fast motion over the speed, figures 10 to 15 of the report.

    Returns a dictionary: share (3 arrays) of the fastest speed, error (3 arrays) in the unit, bad (3 bool arrays),
    median and law (10,) over the middles of the intervals, the law at rest and at the fastest, and the lag (s) it
    stands for, nonsense left out; the mean error of all readings and the largest but nonsense; unit, printed (2,).
    """
    field, unit, kind = OVER[state["of"]]
    follower = Tracker(nonsense=0.015 if state["nonsense"] else 0.0, burst=2.0, latency=state["latency"] / 1000)
    share, error, bad = [], [], []
    for k, name in enumerate(simulation.MOTIONS):
        time, T, v = _motion_path(name)
        read, *velocities, wrong = simulation.follow_path(time, T, follower, np.random.default_rng([32, k]))
        e = getattr(tracking_errors(time, T, read, velocities), field)
        share.append(v[kind] / _fastest()[kind])
        error.append(np.rad2deg(e) if kind else e)
        bad.append(wrong)
    x, y, good = np.concatenate(share), np.concatenate(error), ~np.concatenate(bad)
    e0, slope = static_error_and_lag(x[good], y[good])
    return {
        "share": share, "error": error, "bad": bad, "unit": unit, "printed": _printed(state["of"]),
        "median": median_over_speed(x[good], y[good], SHARES), "law": np.hypot(e0, slope * MIDDLES),
        "rest": e0, "fastest": float(np.hypot(e0, slope)),
        "mean": float(y.mean()), "largest": float(y[good].max()),
        "lag": slope / (_fastest()[0], np.rad2deg(_fastest()[1]))[kind] if "speed" not in field else None,
    }  # fmt: skip


def over_speed():
    """Error against speed for three motions through the same points, with what the report prints."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.8, 1))
        picture = draw.OverSpeed(left, MIDDLES, SHARES[-1])
        style.bare(right)
        words = Readout(right)

        def update(state, result):
            picture.set(result)
            lag = "" if result["lag"] is None else f"\nas of a lag of {1000 * result['lag']:.1f} ms"
            words.set_text(
                f"{state['of']}, {result['unit']}\n\nat rest {result['rest']:.2g}\n"
                f"at the fastest {result['fastest']:.2g}{lag}\n\n"
                f"mean of all {result['mean']:.2g}\nlargest but nonsense {result['largest']:.2g}"
            )

        return [*picture.artists, words], update

    return Stage(
        "error over speed",
        scene=scene,
        compute=compute_over_speed,
        controls={
            "of": Choice(list(OVER), "position", label="error of"),
            "latency": Slider(0.0, 40.0, 8.0, step=1.0, label="latency (ms)"),
            "nonsense": Toggle(False, "nonsense"),
        },
        fail={"of": "position", "latency": 40.0, "nonsense": True},
        because="A lag of 40 ms: what moves is read where it was. Nonsense lifts the mean, hardly a median.",
        presets={"no lag": {"latency": 0.0}, "speed": {"of": "speed"}},
        describe=lambda r: (
            f"At rest {r['rest']:.2g} {r['unit']}, at the fastest {r['fastest']:.2g} {r['unit']}; "
            f"the mean of all readings is {r['mean']:.2g}."
        ),
    )
