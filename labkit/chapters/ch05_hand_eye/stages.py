"""Stages of chapter 5: height from two angles, scan line and sphere, difference steps, iterations at the pole, two
methods, the 31 poses, a measuring pattern, kinds of accuracy.
"""

import functools

import numpy as np

from ...calibration import hand_eye, planning, sphere
from ...documents import misprints
from ...documents.thesis import comparison
from ...documents.thesis import printed as thesis
from ...estimation.differences import numeric_jacobian
from ...estimation.gaussian import unit_noise
from ...fast.hand_eye import calibrate_sphere_target
from ...geometry import frames
from ...geometry.lie import exp_so3, log_so3
from ...machines import robot_accuracy, triangulation
from ...stage import Choice, Handle, Slider, Stage, Target, living, style
from ...stage.scene3d import Scene, View
from ...stage.scene3d_handles import Dial
from . import bodies
from . import figures as draw

RADIUS = 30.0  # mm, the sphere
REPETITIONS = 60
POINTS = 60  # of one scan line
SLIPS_SHOWN = 6
SHOWN_RESIDUAL = 60.0  # mm: a residual vector is drawn no longer than this
REST_MM = 1e-13  # what is left of a residual at the end, on the logarithmic axis


# --- height from two angles ------------------------------------------------------------------------------------------

HEIGHTS = np.linspace(40.0, 420.0, 77)
RECOVERIES = 80


def compute_triangle(state):
    """Places recovered from two noisy angles, the error of the height, and that error over the distance."""
    place, base, std = state["P"], state["base"], np.deg2rad(state["std_deg"])
    alpha, beta = triangulation.angles_to(place, base)
    noise = std * unit_noise((2, RECOVERIES), seed=3)
    noisy = np.clip(alpha + noise[0], 1e-3, None), np.clip(beta + noise[1], 1e-3, None)
    meets = noisy[0] + noisy[1] < np.pi - 1e-3
    recovered = triangulation.place_from_angles(noisy[0][meets], noisy[1][meets], base)
    below = np.column_stack([np.full(len(HEIGHTS), place[0]), HEIGHTS])
    errors = triangulation.height_std(*triangulation.angles_to(below, base), base, std)
    return {
        "recovered": recovered, "lost": int((~meets).sum()), "errors": errors, "place": place, "base": base,
        "std": float(triangulation.height_std(alpha, beta, base, std)),
        "meet_deg": float(np.rad2deg(np.pi - alpha - beta)),
    }  # fmt: skip


def _triangle_sentence(result):
    known = f"{result['std']:.2g}" if result["std"] < 10 else f"{result['std']:.0f}"
    lost = f" {result['lost']} of {RECOVERIES} pairs of rays do not even meet." if result["lost"] else ""
    return (
        f"At H = {result['place'][1]:.0f} mm the rays meet at {result['meet_deg']:.0f} deg, and the height is known to "
        f"{known} mm, {100 * result['std'] / result['place'][1]:.2g} % of it.{lost}"
    )


def triangle():
    """Drag the object before a triangulating sensor and watch the error of its height grow with the distance."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1, 1.1))
        measures = triangulation.RANGE
        base, rays, cloud, spread = draw.triangle(left, ((-60, 260), (-15, 430)), measures)
        curve, here = draw.error_over_range(right, measures, ((0, 430), (1e-3, 300)))

        def update(state, result):
            (x, z), L = result["place"], result["base"]
            base.set_data([0, L], [0, 0])
            rays.set_data([0, x, L], [0, z, 0])
            cloud.set_data(*result["recovered"].T)
            spread.set_data([x, x], [z - result["std"], z + result["std"]])
            curve.set_data(HEIGHTS, result["errors"])
            here.set_data([z], [result["std"]])

        return [spread, base, rays, cloud, curve, here], update

    return Stage(
        "height from two angles",
        scene=scene,
        compute=compute_triangle,
        handles={"P": Handle((0.0, 240.0), step=2.0, bounds=((-40, 200), (40, 400)), label="object")},
        controls={
            "base": Slider(10, 200, 100, step=2, label="base (mm)"),
            "std_deg": Slider(0.002, 1.0, 0.2, log=True, label="noise of each angle (deg)"),
        },
        fail={"P": (0.0, 400.0), "base": 20, "std_deg": 1.0},
        describe=_triangle_sentence,
    )


# --- kinds of accuracy -----------------------------------------------------------------------------------------------

ARRIVALS = 30
BOARD = 3.0  # mm, half the width of the target board
STD, LAG = 0.08, 0.03  # mm and s, of the simulated robot


def compute_accuracy(state):
    """Arrivals of a simulated robot with their accuracy and repeatability, and a corner it drives around."""
    angle = np.linspace(0, 2 * np.pi, ARRIVALS, endpoint=False) if state["around"] else np.zeros(ARRIVALS)
    directions = np.column_stack([np.cos(angle), np.sin(angle)])
    errors = robot_accuracy.RobotErrors(np.asarray(state["M"]), state["backlash"], STD, LAG)
    reached = robot_accuracy.arrive(np.zeros(2), directions, errors, np.random.default_rng(2))
    command, dt = robot_accuracy.corner(state["speed"])
    path = robot_accuracy.drive(
        command, dt, robot_accuracy.RobotErrors(np.zeros(2), lag=LAG), np.random.default_rng(0)
    )[0]
    worst = int(np.argmax(np.linalg.norm(path - command, axis=1)))
    return {
        "reached": reached, "mean": reached.mean(0), "around": state["around"],
        "accuracy": robot_accuracy.position_accuracy(np.zeros(2), reached),
        "repeatability": robot_accuracy.repeatability(reached),
        "command": command, "path": path, "worst": np.array([command[worst], path[worst]]),
        "path_accuracy": robot_accuracy.path_accuracy(command, path[None]),
    }  # fmt: skip


def _accuracy_sentence(result):
    way = "from all around" if result["around"] else "from one side"
    return (
        f"Arriving {way}: accuracy {result['accuracy']:.2f} mm, repeatability {result['repeatability']:.2f} mm. "
        f"Around the corner the path is off by up to {result['path_accuracy']:.1f} mm."
    )


def accuracy_kinds():
    """Drag what is always wrong: accuracy changes, repeatability does not; backlash shows from all around only."""

    def scene(fig):
        left, right = fig.subplots(1, 2)
        ring, dots, mean, accuracy, circle = draw.target_board(left, BOARD, ARRIVALS)
        commanded, driven, worst = draw.driven_corner(right, 62)

        def update(state, result):
            ring.set_data(*state["M"][:, None])
            dots.set_data(*result["reached"].T)
            mean.set_data(*result["mean"][:, None])
            accuracy.set_data(*np.transpose([np.zeros(2), result["mean"]]))
            draw.set_circle(circle, *result["mean"], result["repeatability"])
            commanded.set_data(*result["command"].T)
            driven.set_data(*result["path"].T)
            worst.set_data(*result["worst"].T)

        return [accuracy, circle, ring, dots, mean, commanded, driven, worst], update

    return Stage(
        "kinds of accuracy",
        scene=scene,
        compute=compute_accuracy,
        handles={"M": Handle((1.2, 0.8), step=0.05, bounds=((-2, 2), (-2, 2)), label="what is always wrong")},
        controls={
            "backlash": Slider(0.0, 1.0, 0.4, step=0.05, label="backlash (mm)"),
            "around": Choice({"one side": False, "all around": True}, False, label="arriving from"),
            "speed": Slider(10, 600, 100, step=10, label="speed (mm/s)"),
        },
        fail={"backlash": 1.0, "around": True, "speed": 600},
        because="Each arrival stops short by the backlash, from its own side; and at 600 mm/s the lag cuts the corner.",
        describe=_accuracy_sentence,
    )


# --- one scan line ---------------------------------------------------------------------------------------------------


def compute_scan_line(state):
    """Centers recovered from repeated noisy scan lines, the fitted circle, and the standard deviation of y."""
    y, z = state["C"]
    r = np.sqrt(RADIUS**2 - y * y)
    angle = np.linspace(-1, 1, POINTS) * np.deg2rad(state["half_angle_deg"])
    reach = r + state["std"] * unit_noise((REPETITIONS, POINTS), seed=5)
    x, depth = reach * np.sin(angle), z - reach * np.cos(angle)
    centers, radii = sphere.fit_circle_algebraic(x, depth)
    off = np.sqrt(np.maximum(RADIUS**2 - radii**2, 0.0)) * (1 if y >= 0 else -1)
    circle = sphere.fit_circle(x[0], depth[0], std=state["std"])
    by_r = np.inf if y == 0 else r / abs(y)
    return {
        "y": float(y),
        "points": np.column_stack([x[0], depth[0]]),
        "circle": (centers[0, 0], centers[0, 1], radii[0]),
        "recovered": np.column_stack([off, centers[:, 1]]),
        "impossible": int((radii > RADIUS).sum()),
        "std_y": by_r * float(np.sqrt(circle.covariance[2, 2])),
        "bias_y": float(np.mean(off) - y),
    }


def _scan_line_sentence(result):
    if result["impossible"]:
        return (
            f"{result['impossible']} of {REPETITIONS} circles are larger than the sphere: so close to the equator "
            "the profile says nothing about y."
        )
    known = f"y is known to {result['std_y']:.2g} mm" if result["std_y"] < RADIUS else "y is not known at all"
    return (
        f"The center lies {abs(result['y']):.1f} mm off the plane. First order: {known}; the mean of {REPETITIONS} "
        f"recoveries is off by {result['bias_y']:+.2f} mm. The mirror image (dotted) explains the scan line as well."
    )


def scan_line():
    """Drag the sphere through the scan plane and watch how well its center comes back from one scan line."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.24, 1))  # one scale
        outline, other, cloud, spread = draw.side_view(left, ((-62, 62), (190, 290)))
        points, circle, center = draw.profile_view(right, ((-50, 50), (190, 290)))

        def update(state, result):
            y, z = state["C"]
            draw.set_circle(outline, y, z, RADIUS)
            draw.set_circle(other, -y, z, RADIUS)
            cloud.set_data(*result["recovered"].T)
            reach = min(result["std_y"], 60.0)
            spread.set_data([y - reach, y + reach], [z, z])
            points.set_data(*result["points"].T)
            draw.set_circle(circle, *result["circle"])
            center.set_data([result["circle"][0]], [result["circle"][1]])

        return [spread, outline, other, cloud, circle, points, center], update

    return Stage(
        "scan line and sphere",
        scene=scene,
        compute=compute_scan_line,
        handles={"C": Handle((14.0, 240.0), step=0.5, bounds=((-28, 28), (230, 260)), label="center of the sphere")},
        controls={
            "std": Slider(0.01, 0.5, 0.05, step=0.01, label="noise (mm)"),
            "half_angle_deg": Slider(15, 70, 50, step=1, label="half the arc (deg)"),
        },
        fail={"C": (0.8, 240.0)},
        describe=_scan_line_sentence,
    )


# --- steps of differences --------------------------------------------------------------------------------------------

STEPS_DEG = np.geomspace(1e-13, 10.0, 57)
LISTING = 5e-7  # deg, the step of listing C4
AROUND = np.linspace(-1.5, 1.5, 61)  # steps to each side


@functools.cache
def _turned():
    """(residual, exact, one, slope): all residuals (mm) of the corrected poses as a function of A (deg) away from the
    thesis's end pose, their derivatives there (mm per deg), (n,); one that answers well and bends most as a function
    of many A, and its derivative.
    """
    measured, target = thesis.measurements(True), thesis.printed_target()
    T_BF, x_S = measured.T_BF, measured.x_S
    p = thesis.kuka_pose_deg("scanner_end")
    unit = np.array([1, 1, 1, *np.deg2rad([1, 1, 1])])
    exact = hand_eye.kuka_jacobian(p * unit, T_BF, x_S)[:, 3] * unit[3]

    def turned(A):
        q = np.tile(p, (len(A), 1))
        q[:, 3] += A
        return q * unit

    def residual(A):
        return hand_eye.kuka_residuals(turned(A)[0], T_BF, x_S, target)

    bend = np.abs(residual([10.0]) + residual([-10.0]) - 2 * residual([0.0]))
    number = int(np.argmax(np.where(np.abs(exact) > np.abs(exact).max() / 2, bend, 0)))
    k, axis = divmod(number, 3)

    def one(A):
        T_FS = frames.matrix_from_kuka(turned(A))
        return hand_eye.sphere_residuals(T_BF[k], x_S[k], T_FS, target)[:, axis]

    return residual, exact, one, exact[number]


@functools.cache
def _step_errors():
    """Largest error (mm per deg) of forward and central differences by A at the thesis's end pose, over STEPS_DEG."""
    residual, exact, *_ = _turned()
    errors = {}
    for scheme in ("forward", "central"):
        found = [numeric_jacobian(residual, np.zeros(1), h, scheme)[:, 0] for h in STEPS_DEG]
        errors[scheme] = np.maximum(np.abs(np.array(found) - exact).max(1), 1e-14)
    return errors


def compute_steps(state):
    """Errors of both schemes at the chosen step (mm per deg), the best steps, and the residual that bends most, near
    the thesis's end pose: over AROUND steps to each side, in steps, so that its tangent has the slope 1.
    """
    errors, h = _step_errors(), state["h"]
    at = {k: float(np.exp(np.interp(np.log(h), np.log(STEPS_DEG), np.log(e)))) for k, e in errors.items()}
    best = {k: float(STEPS_DEG[np.argmin(e)]) for k, e in errors.items()}
    *_, one, slope = _turned()
    values = one(AROUND * h)
    return {"h": h, "at": at, "best": best, "curve": (values - values[len(AROUND) // 2]) / (slope * h)}


def difference_steps():
    """The step of a finite difference: too large, and the curve bends away; too small, and it breaks into stairs."""
    middle, one = len(AROUND) // 2, int(np.argmin(np.abs(AROUND - 1)))

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1, 1.25))
        curve, forward, central = draw.differences(left, AROUND)
        errors = _step_errors()
        markers = draw.error_against_step(right, np.log10(STEPS_DEG), errors)
        right.axvline(np.log10(LISTING), **style.look("guide"))
        away = {"xytext": (4, 4), "textcoords": "offset points"}
        right.annotate("listing C4", (np.log10(LISTING), 1e-13), **away, color=style.MUTED)

        def update(state, result):
            y = result["curve"]
            curve.set_data(AROUND, y)
            forward.set_data([0, 1], [0, y[one]])
            central.set_data([-1, 1], [y[2 * middle - one], y[one]])
            for marker, scheme in zip(markers, errors):
                marker.set_data([np.log10(result["h"])], [result["at"][scheme]])

        return [curve, forward, central, *markers], update

    def follow(state, moved):
        """The ring stands on the curve of the central difference, and has a slider."""
        log = state["P"][0] if "P" in moved and "h" not in moved else np.log10(state["h"])
        central = np.interp(log, np.log10(STEPS_DEG), np.log10(_step_errors()["central"]))
        return {"P": (log, 10.0**central), "h": float(np.clip(10.0**log, STEPS_DEG[0], STEPS_DEG[-1]))}

    return Stage(
        "step of the differences",
        scene=scene,
        compute=compute_steps,
        handles={
            "P": Handle(
                (np.log10(LISTING), 1e-6), step=0.1, ax=1, bounds=((-13, 1), (1e-14, 1e3)), color=style.ESTIMATE,
                label="step, as a power of ten",
            )
        },
        constrain=follow,
        controls={"h": Slider(1e-13, 10.0, LISTING, log=True, label="step (deg)")},
        fail={"h": 1e-13, "P": (-13.0, 1.0)},
        because="So small a step drowns in the last digits of the numbers.",
        target=Target("a derivative right to 1e-9 mm per deg", lambda result: min(result["at"].values()) < 1e-9),
        describe=lambda result: (
            f"A step of {{h}} deg: forward is off by {result['at']['forward']:.2g}, central by "
            f"{result['at']['central']:.2g} mm per deg. Best steps: {result['best']['forward']:.1g} and "
            f"{result['best']['central']:.1g} deg."
        ),
    )  # fmt: skip


# --- iterations ------------------------------------------------------------------------------------------------------


MAX_STEPS = 30
SEEN = np.array([0.0, 0.0, 240.0])  # mm, in S: the middle of the scanner's field
DIALS = {"yaw": 150.0, "tilt": 120.0}  # mm, radii of the circles on which the start is turned


@functools.cache
def _simulated(B_deg):
    """The simulation model with its scanner turned to B: T_BF, x_S, target, true T_FS."""
    T_BF, _, target, scanner = thesis.simulation()
    T_FS = frames.matrix_from_kuka(frames.kuka_from_degrees([*scanner[:4], B_deg, scanner[5]]))
    return T_BF, hand_eye.sphere_in_scanner(T_BF, T_FS, target), target, T_FS


def compute_iterations(state):
    """Gauss-Newton from one start in A, B, C and on the pose: errors (tilt, yaw) in deg, rms, steps and largest turn
    (deg), the scanner's pose after each step, where it would see the sphere, and the pose after the step shown.

    The start is turned off the truth by the rotation vector (0, tilt, yaw) in F: tilt changes B, yaw is what A does.
    """
    T_BF, x_S, target, truth = _simulated(state["B_deg"])
    tilt, yaw = np.deg2rad([state["tilt"], state["yaw"]])
    start = truth.copy()
    start[:3, :3] = exp_so3([0, tilt, yaw]) @ truth[:3, :3]
    result = {"truth": truth, "step": state["step"]}
    for name in ("euler", "se3"):
        run = hand_eye.gauss_newton_pose(
            frames.kuka_from_matrix(start), T_BF, x_S, target, parameters=name, max_steps=MAX_STEPS
        )
        R, values = run.poses[:, :3, :3], run.singular_values
        error = np.rad2deg(log_so3(R @ truth[:3, :3].T))
        turns = np.rad2deg(frames.rotation_angle(np.swapaxes(R[:-1], 1, 2) @ R[1:]))
        result[name] = {
            "path": error[:, 1:], "rms": np.maximum(run.rms, REST_MM), "steps": len(run.poses) - 1,
            "arrived": bool(run.converged and run.rms[-1] < 1e-6), "turned_deg": float(turns.sum()),
            "weakest": float(values[0, -1] / values[0, 0]),
            "seen": frames.transform(run.poses, SEEN), "now": run.poses[min(state["step"], len(run.poses) - 1)],
        }  # fmt: skip
    return result


def _iterations_sentence(result):
    def told(run):
        steps = "1 step" if run["steps"] == 1 else f"{run['steps']} steps"
        return steps if run["arrived"] else "no way to the minimum"

    def weakest(run):
        return f"1/{1 / run['weakest']:.0f} of the largest" if run["weakest"] > 1e-6 else "zero"

    euler, se3 = result["euler"], result["se3"]
    return (
        f"In A, B, C: {told(euler)}, turning {euler['turned_deg']:.0f} deg in all; at the start the weakest singular "
        f"value is {weakest(euler)}. On the pose: {told(se3)}, turning {se3['turned_deg']:.0f} deg, and "
        f"{weakest(se3)}."
    )


def _start_circle(turned):
    """Where the dial of the start's tilt (about y of F) or yaw (about z) has its circle: about the scanner."""

    def where(result):
        T = np.eye(4)
        T[:3, :3] = np.eye(3) if turned == "yaw" else [[0, 1, 0], [0, 0, 1], [1, 0, 0]]  # z is what it turns about
        T[:3, 3] = result["truth"][:3, 3]
        return T, DIALS[turned]

    return where


def convergence():
    """Turn the start: the same Gauss-Newton with steps in A, B, C and with steps on the right of the pose, as walks of
    the scanner about the flange."""
    circles = {name: _start_circle(name) for name in DIALS}

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.35, 1))
        space = Scene(left, radius=255, half_width=265, unit="mm")
        picture = draw.Walks(space)
        curves, here = draw.iterations(right)

        def update(state, result):
            picture.set(result, {name: (*where(result), state[name]) for name, where in circles.items()})
            space.draw(state["view"])
            for curve, name in zip(curves, ("euler", "se3")):
                curve.set_data(np.arange(len(result[name]["rms"])), result[name]["rms"])
            here.set_data([result["step"]] * 2, [REST_MM, 1e4])

        return [*space.artists, *curves, here], update

    return Stage(
        "convergence from a dragged start",
        scene=scene,
        compute=compute_iterations,
        handles={
            "yaw": Dial(30.0, -68, 68, circles["yaw"], step=0.5, label="yaw of the start", color=style.AXIS_Z),
            "tilt": Dial(-1.0, -68, 68, circles["tilt"], step=0.5, label="tilt of the start", color=style.AXIS_Y),
        },
        controls={
            "B_deg": Choice({"B = -88 deg": -88.0, "B = -30 deg": -30.0}, -88.0, label="scanner at"),
            "step": Slider(0, MAX_STEPS, 1, label="after step"),
        },
        view=View(-75, 24, center=(-100.0, 0.0, 60.0), eye=2000.0),
        fail={"tilt": -54.0, "yaw": -30.0, "B_deg": -30.0},
        because="In the three angles this start is a long way from the goal, in the pose a short one.",
        describe=_iterations_sentence,
    )


# --- two methods -----------------------------------------------------------------------------------------------------

STEPS_SHOWN = 30


@functools.lru_cache(maxsize=64)
def _descents(start_deg, radius, B_deg):
    return {m: comparison.run(m, start_deg, "A, B, C", radius, B_deg, STEPS_SHOWN) for m in comparison.METHODS}


@functools.cache
def _printed_starts(B_deg):
    """Distance (mm) and turn (deg) off the truth of the starts of table 7-2, the truth itself first."""
    return comparison.errors(frames.matrix_from_kuka(frames.kuka_from_degrees(thesis.start_poses_deg()[0])), B_deg)


def compute_methods(state):
    """Gauss-Newton and the trust region from the dragged start or from one of table 7-2: their runs and their paths.

    A path is the distance (mm) and the turn (deg) off the truth after each step.
    """
    B, number = state["B_deg"], state["number"]
    start = thesis.start_poses_deg()[0][number] if number else comparison.start_at(*state["P"], B)
    runs = _descents(tuple(start.tolist()), state["radius"], B)
    paths = {method: comparison.errors(run.poses, B) for method, run in runs.items()}
    return {"runs": runs, "paths": paths, "number": number, "printed": _printed_starts(B)[1:]}


def _methods_sentence(result):
    def told(method):
        run = result["runs"][method]
        steps = "1 step" if run.steps == 1 else f"{run.steps} steps"
        climbs = {0: "never uphill", 1: "1 of them uphill"}.get(run.climbs, f"{run.climbs} of them uphill")
        return f"{method} in {steps}, {climbs}" if run.arrived else f"{method} not even in {run.steps} steps"

    where = f"start {result['number']} of table 7-2" if result["number"] else "the dragged start"
    newton, trust = (told(method) for method in comparison.METHODS)
    return f"From {where}: {newton}; {trust}, {result['runs']['trust region'].taken_back} taken back."


def two_methods():
    """Drag the start, or take one of table 7-2: Gauss-Newton against a trust region on the scanner's pose."""
    names = comparison.METHODS

    def scene(fig):
        left, right = fig.subplots(1, 2)
        *paths, printed = draw.start_plane(left)
        *curves, back = draw.descents(right, names, STEPS_SHOWN, 1e-9, 1e3)

        def update(state, result):
            for path, curve, name in zip(paths, curves, names):
                rms = result["runs"][name].rms
                path.set_data(*result["paths"][name].T)
                curve.set_data(np.arange(len(rms)), np.maximum(rms, 1e-9))
            run = result["runs"]["trust region"]
            rejected = np.flatnonzero(~run.accepted[: run.steps])
            back.set_data(rejected + 1, np.maximum(run.rms[rejected + 1], 1e-9))
            printed.set_data(*result["printed"].T)

        return [printed, *paths, *curves, back], update

    def follow(state, moved):
        if "P" in moved and "number" not in moved:
            return {"number": 0}
        return {"P": _printed_starts(state["B_deg"])[state["number"]]} if state["number"] else {}

    return Stage(
        "Gauss-Newton against trust region",
        scene=scene,
        compute=compute_methods,
        handles={"P": Handle((70.0, 60.0), step=1.0, bounds=((0, 120), (0, 179)), label="start, distance and turn")},
        constrain=follow,
        controls={
            "number": Slider(0, 9, 0, step=1, label="start of table 7-2 (0: yours)"),
            "radius": Slider(0.1, 1000.0, 10.0, log=True, label="first radius (mm)"),
            "B_deg": Choice({"B = -90 deg": -90.0, "B = -88 deg": -88.0}, -90.0, label="scanner at"),
        },
        fail={"P": (70.0, 175.0), "B_deg": -88.0},
        because="Next to the pole and turned by 175 deg: Gauss-Newton takes every step, also those that lead uphill.",
        describe=_methods_sentence,
    )


# --- the 31 poses ----------------------------------------------------------------------------------------------------


@functools.cache
def _explained():
    """Up to SLIPS_SHOWN slips that would explain each suspicious pose, the most credible first: a list of 31 lists."""
    entries, fit = thesis.printed_entries(), _reference_fit()
    innocent = np.linalg.norm(fit.residuals, axis=1) <= misprints.SUSPICIOUS * fit.std
    return [
        [] if innocent[pose - 1] else misprints.explanations(entries, pose, fit.T_FS, fit.target, fit.std)[:SLIPS_SHOWN]
        for pose in range(1, 32)
    ]


@functools.cache
def _reference_fit():
    measured = thesis.measurements()
    return calibrate_sphere_target(measured.T_BF, measured.x_S, robust=True)


def _edited(fixed, slip):
    """Measurements with the poses in `fixed` corrected and one slip undone, if any."""
    measured = thesis.measurements(fixed)
    kuka, x_S = measured.kuka_deg, measured.x_S
    if slip:
        e = slip
        table, columns = (kuka, thesis.POSE_COLUMNS) if e.table == "C14" else (x_S, thesis.CENTER_COLUMNS)
        table[e.pose - 1, columns.index(e.column)] = float(e.corrected)
    return frames.matrix_from_kuka(frames.kuka_from_degrees(kuka)), x_S


@functools.lru_cache(maxsize=256)
def _edited_fit(fixed, slip, fit):
    """Residuals (31, 3) in B, scanner, target and the poses that `_edited` gives."""
    T_BF, x_S = _edited(fixed, slip)
    if fit == "end pose":
        T_FS, target = thesis.frame("scanner_end"), thesis.printed_target()
    else:
        found = calibrate_sphere_target(T_BF, x_S, robust=fit == "robust")
        T_FS, target = found.T_FS, found.target
    return hand_eye.sphere_residuals(T_BF, x_S, T_FS, target), T_FS, target, T_BF, x_S


def _pose_fit(pose, slip, others, fit):
    """What `_edited_fit` gives, the slip that is undone in the chosen pose, and how many would explain it.

    The chosen pose stays as printed but for that slip; where nothing in it is undone, many poses share one fit.
    """
    slips = _explained()[pose - 1]
    chosen = slips[slip - 1] if 0 < slip <= len(slips) else None
    fixed = {row["pose"] for row in thesis.corrections()} - {pose} if others else ()
    return *_edited_fit(tuple(sorted(fixed)), chosen, fit), chosen, len(slips)


def compute_poses(state):
    """Residuals of all poses under the chosen fit, the chosen pose (from 1), the slip undone in it, and the rms."""
    pose = 3 if state["click"] is None else int(np.clip(np.rint(state["click"][0]), 1, 31))
    residuals, T_FS, target, T_BF, x_S, slip, offered = _pose_fit(pose, state["slip"], state["others"], state["fit"])
    lengths = np.linalg.norm(residuals, axis=1)
    return {
        "pose": pose, "residuals": residuals, "lengths": lengths, "rms": float(hand_eye.rms_distance(residuals)),
        "median": float(np.median(lengths)), "T_FS": T_FS, "target": target, "T_BF": T_BF, "x_S": x_S, "slip": slip,
        "offered": offered, "number": state["slip"], "picked": state["click"] is not None,
    }  # fmt: skip


def _poses_sentence(result):
    e = result["slip"]
    slips = "a single slip" if result["offered"] == 1 else f"{result['offered']} single slips"
    told = (
        f"with {e.column.removesuffix('_deg')} in {e.table} read as {e.corrected} for {e.printed} ({e.slip})"
        if e
        else f"as printed: there is no slip no. {result['number']}, {slips} would explain it"
        if result["offered"] and result["number"]
        else f"as printed, and {slips} would explain it"
        if result["offered"]
        else "as printed, nothing to explain"
    )
    invitation = "" if result["picked"] else living(" Click a bar.")
    return (
        f"Pose {result['pose']}: residual {result['lengths'][result['pose'] - 1]:.2f} mm {told}. All 31: rms "
        f"{result['rms']:.2f} mm, median {result['median']:.2f} mm.{invitation}"
    )


def thirty_one_poses():
    """Robot, scanner and sphere with the residual vectors of all 31 poses; click a pose, undo a slip, see the fit
    change.
    """
    lines = thesis.measurements().line

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.25, 1))
        space = Scene(left, radius=520, title="residuals at their flanges, x 8", unit="mm")
        items = draw.cell(space, RADIUS)
        stems, chosen, yardstick = draw.residual_bars(right, 31)

        def update(state, result):
            target, T_BF, k = result["target"], result["T_BF"], result["pose"] - 1
            for line in draw.LINES:
                items[line].set(T_BF[lines == line, :3, 3])
            items["sphere"].set(frames.pose(np.eye(3), target))
            seen = result["residuals"] * np.minimum(1, SHOWN_RESIDUAL / np.maximum(result["lengths"], 1e-9))[:, None]
            feet = T_BF[:, :3, 3]
            tips = feet + 8 * seen  # magnified, for the eye
            items["residuals"].set(np.stack([feet, tips, np.full_like(tips, np.nan)], 1).reshape(-1, 3))
            items["chosen"].set([feet[k], tips[k]])
            scanner = T_BF[k] @ result["T_FS"]
            items["flange"].set(T_BF[k])
            items["scanner"].set(scanner)
            items["hand"].set(T_BF[k], scanner)
            items["sight"].set([T_BF[k, :3, 3], scanner[:3, 3], frames.transform(scanner, result["x_S"][k])])
            space.draw(state["view"])
            draw.set_bars(stems, result["lengths"])
            chosen.set_data([k + 1], [max(result["lengths"][k], 0.08) * 1.5])
            yardstick.set_data([0, 32], [result["rms"]] * 2)

        return [*space.artists, stems, chosen, yardstick], update

    return Stage(
        "31 poses and their residuals",
        scene=scene,
        compute=compute_poses,
        controls={
            "slip": Slider(0, SLIPS_SHOWN, 0, step=1, label="undo slip no."),
            "others": Choice({"as printed": False, "corrected": True}, False, label="other poses"),
            "fit": Choice(
                {"thesis": "end pose", "least squares": "least squares", "robust": "robust"}, "robust", label="fit"
            ),
        },
        click=1,
        view=View(-60, 20, center=(1500.0, -600.0, 1300.0), eye=3200.0),
        fail={"fit": "least squares"},
        because="Least squares over all 31 as printed: the few wrong rows pull the fit away from all the others.",
        presets={"All corrected": {"others": True, "slip": 1, "fit": "least squares"}},
        describe=_poses_sentence,
        size=(7.6, 4.4),
    )


# --- a measuring pattern ---------------------------------------------------------------------------------------------


@functools.cache
def _corrected_fit():
    measured = thesis.measurements(True)
    return calibrate_sphere_target(measured.T_BF, measured.x_S)


@functools.cache
def _printed_pattern():
    fit = _corrected_fit()
    return planning.predicted_sphere_covariance(thesis.measurements(True).T_BF, fit.T_FS, fit.target, fit.std)


def compute_pattern(state):
    """Predicted covariance of a designed pattern beside the thesis's: standard deviations, weakest direction, poses."""
    fit, x_mid, z_mid = _corrected_fit(), 0.0, 240.0
    spread = np.array([state["E"][0] - x_mid, state["across"], state["E"][1] - z_mid])
    T_BF = planning.pattern(fit.T_FS, fit.target, np.deg2rad(state["tilt_deg"]), spread)
    x_S = hand_eye.sphere_in_scanner(T_BF, fit.T_FS, fit.target)
    unseen = planning.unseen_changes(T_BF, fit.T_FS, fit.target)
    determined = not (len(unseen.turns) or len(unseen.slides))
    if determined:
        cov = planning.predicted_sphere_covariance(T_BF, fit.T_FS, fit.target, fit.std)
        std = _three_stds(cov)
    else:
        cov, std = np.full((9, 9), np.nan), (np.inf,) * 3
    return {
        "T_BF": T_BF, "x_S": x_S, "spread": spread, "unseen": unseen, "target": fit.target, "T_FS": fit.T_FS,
        "determined": determined, "cov": cov, "std": std,
        "printed_cov": _printed_pattern(), "printed_std": _three_stds(_printed_pattern()),
    }  # fmt: skip


def _three_stds(cov):
    """Standard deviations of rotation (deg), translation (mm) and sphere center (mm)."""
    blocks = [np.sqrt(np.trace(cov[k : k + 3, k : k + 3])) for k in (0, 3, 6)]
    return float(np.rad2deg(blocks[0])), float(blocks[1]), float(blocks[2])


def _pattern_sentence(result):
    if not result["determined"]:
        unseen, line = result["unseen"], "in any direction"
        if len(unseen.slides) == 1:
            line = "along the line drawn through the sphere"
        told = [f"scanner and sphere can slide together {line}"] * bool(len(unseen.slides))
        told += ["the scanner can turn about the line on which it sees the sphere"] * bool(len(unseen.turns))
        ratio = unseen.singular_values[-1] / unseen.singular_values[0]
        return f"Not determined: the last singular value is {ratio:.0e} of the first; {', and '.join(told)}."
    (a, b, c), (A, B, C) = result["std"], result["printed_std"]
    return (
        f"Predicted: orientation {a:.2f} deg, translation {b:.2f} mm, sphere center {c:.2f} mm. The thesis's 31 poses "
        f"(dotted): {A:.2f} deg, {B:.2f} mm, {C:.2f} mm."
    )


def pattern_designer():
    """Choose how much of the field and how much tilt 31 poses use, and see how well the scanner would be known."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.15, 1))
        space = Scene(left, radius=480, unit="mm")
        ball, hand = bodies.ball(space, RADIUS), bodies.Hand(space)
        flanges = space.points(**style.look("measurement", markersize=4))
        sights = space.line(**style.look("guide", alpha=0.5))
        printed = space.ellipsoid(**style.look("guide", linewidth=2.0))
        found = space.ellipsoid(**style.look("estimate"))
        weak = space.line(color=style.ESTIMATE, linewidth=3)
        name = space.text("translation errors, x 40", offset=(0, 4), ha="center")
        used, places = draw.field_of_view(right, planning.FIELD)

        def update(state, result):
            target, T_BF = result["target"], result["T_BF"]
            flanges.set(T_BF[:, :3, 3])
            gaps = np.full((len(T_BF), 3), np.nan)
            sights.set(np.stack([T_BF[:, :3, 3], np.broadcast_to(target, (len(T_BF), 3)), gaps], 1).reshape(-1, 3))
            ball.set(frames.pose(np.eye(3), target))
            hand.set(T_BF[-1], T_BF[-1] @ result["T_FS"])
            aside = target + np.array([0.0, 0.0, -230.0])
            printed.set(aside, 40**2 * result["printed_cov"][3:6, 3:6])
            found.set(aside, 40**2 * (result["cov"][3:6, 3:6] if result["determined"] else np.zeros((3, 3))))
            along = [np.outer([-300, 300, np.nan], direction) for direction in result["unseen"].slides]
            weak.set(target + np.concatenate(along or [np.full((2, 3), np.nan)]))
            name.set(aside + [0, 0, -175.0])
            space.draw(state["view"])
            (dx, _, dz) = result["spread"]
            used.set_data(dx * np.array([-1, 1, 1, -1, -1]), 240 + dz * np.array([-1, -1, 1, 1, -1]))
            places.set_data(result["x_S"][:, 0], result["x_S"][:, 2])

        return [*space.artists, used, places], update

    return Stage(
        "designing a measuring pattern",
        scene=scene,
        compute=compute_pattern,
        handles={
            "E": Handle((6.0, 250.0), step=1.0, bounds=((0, 25), (240, 290)), ax=1, label="corner of the used field")
        },
        controls={
            "tilt_deg": Slider(0, 85, 30, step=1, label="tilt up to (deg)"),
            "across": Slider(3, 25, 12, step=1, label="|y| up to (mm)"),
        },
        view=View(-55, 15, center=(1528.0, -602.0, 1190.0), eye=3200.0),
        fail={"tilt_deg": 0},
        because="The scanner is never tilted.",
        describe=_pattern_sentence,
    )
