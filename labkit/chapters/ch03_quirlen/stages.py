"""Stages of chapter 3: the designer of a pose set, the swirling tool, outliers dragged in."""

import functools

import numpy as np

from ...calibration import pivot
from ...estimation.gaussian import cut_axes, unit_noise
from ...fast.pivot import calibrate_pivot
from ...geometry.lie import exp_so3, nearest_rotation
from ...stage import Handle, Play, Slider, Stage, style
from ...stage.scene3d import Scene, View
from ...stage.scene3d_handles import OnSphere
from . import figures as draw

TIP = np.array([0.0, 0.0, -100.0])  # mm: a straight tool that points down, as long as the lab sheet's
STD_TRANS = 0.2  # mm per coordinate
LONGEST = 1.0  # mm, the radius of the sphere: how far an ellipsoid is drawn
SWIRL_POSES, SWIRL_STD_ROT_DEG = 60, 0.05
OUTLIER_POSES = 12


def _ring(tilt_deg, n=6):
    angle = 2 * np.pi * np.arange(n) / n
    tilt = np.deg2rad(tilt_deg)
    return np.column_stack([np.sin(tilt) * np.cos(angle), np.sin(tilt) * np.sin(angle), np.full(n, np.cos(tilt))])


def compute_pose_designer(state):
    """Singular values, null direction and predicted tip covariance of six planned tool directions."""
    directions = np.array([state[f"D{k}"] for k in range(1, 7)])
    spin = np.deg2rad(state["spin_deg"]) * np.arange(6)
    R = pivot.tilted(directions, spin)
    std_rot = np.deg2rad(state["std_rot_deg"])
    A = pivot.pivot_matrix(pivot.touching_poses(R, TIP, np.zeros(3)))
    _, values, Vt = np.linalg.svd(A)
    null = Vt[5, :3] / np.linalg.norm(Vt[5, :3])
    floor = pivot.NOISE_TOLERANCE * std_rot * values[0]
    undetermined = values[5] <= max(floor, pivot.RANK_TOLERANCE * values[0])
    if not undetermined:
        covariance = pivot.predicted_covariance(R, TIP, std_rot, STD_TRANS)[:3, :3]
    mean = R.mean(0)
    null = null if (mean @ null)[2] >= 0 else -null
    seen = mean @ null
    return {
        "directions": directions,
        "R": R,
        "singular_values": values,
        "floor": float(floor),
        "null": null,
        "null_seen": seen / max(np.linalg.norm(seen), 1e-12),
        "undetermined": bool(undetermined),
        "deviations": np.full(3, np.inf) if undetermined else np.sqrt(np.linalg.eigvalsh(covariance))[::-1],
        "covariance_seen": np.zeros((3, 3)) if undetermined else _in_scene(covariance, mean),
    }


def _in_scene(covariance, mean):
    """The tip's covariance turned into the world by the rotation nearest to the mean, with its axes cut at LONGEST."""
    R = nearest_rotation(mean)
    return R @ cut_axes(covariance, LONGEST) @ R.T


def pose_designer():
    """Drag six tool directions on the sphere and see, before measuring, what they will say about the tip."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.35, 1))
        space = Scene(left, radius=1.12, floor=0.0)
        draw.graticule(space)
        space.fixed(space.body(draw.dome(), name="dome"), np.eye(4))
        tools = [space.body(*draw.tool(1.0, 0.035), name=f"tool {k}") for k in range(1, 7)]
        heads = space.points(**style.look("measurement", markersize=7))
        ellipsoid = space.ellipsoid(**style.look("estimate"))
        null = space.line(color=style.TRUTH, linewidth=2.2, linestyle=(0, (2, 1.5)))
        name = space.text("null vector", offset=(34, 4))  # beside the rings of tools that stand there
        markers, floor = draw.singular_value_axes(right)

        def update(state, result):
            for tool, direction, R in zip(tools, result["directions"], result["R"]):
                tool.set(draw.touching(R, direction))
            heads.set(result["directions"])
            ellipsoid.set(np.zeros(3), result["covariance_seen"])
            far = result["null_seen"] * (1.15 if result["undetermined"] else 0.0)
            null.set(np.array([-far, far]))
            name.set(far if result["undetermined"] else (0, 0, 99.0))
            space.draw(state["view"])
            markers.set_data(np.arange(1, 7), np.maximum(result["singular_values"], 1.2e-3))
            floor.set_data([0.4, 6.6], [max(result["floor"], 1e-9)] * 2)

        return [*space.artists, markers, floor], update

    def sentence(result):
        if result["undetermined"]:
            v = ", ".join(f"{round(float(c), 2) + 0.0:.2f}" for c in result["null"])
            return f"The tip is not determined along ({v}) of the tool: s6 = {result['singular_values'][5]:.4f}."
        a, b, c = result["deviations"]
        return (
            f"Predicted tip: standard deviations {a:.2f}, {b:.2f}, {c:.2f} mm along the axes of the ellipsoid "
            f"(the sphere's radius is 1 mm{'; longer axes are cut there' if a > LONGEST else ''}); "
            f"s6 = {result['singular_values'][5]:.2f}."
        )

    return Stage(
        "designer of a pose set",
        scene=scene,
        compute=compute_pose_designer,
        handles={
            f"D{k}": Handle(
                tuple(d), step=0.05, label=f"tool direction {k}", color=style.MEASUREMENT, way=OnSphere(upper=True)
            )
            for k, d in enumerate(_ring(30.0), start=1)
        },
        controls={
            "spin_deg": Slider(0, 60, 0, step=5, label="spin between poses (deg)"),
            "std_rot_deg": Slider(0.0, 0.5, 0.1, step=0.05, label="orientation noise (deg)"),
        },
        view=View(-60, 30, center=(0, 0, 0.4), eye=6.0),
        presets={"Narrow cone": {f"D{k}": tuple(d) for k, d in enumerate(_ring(3.0), start=1)}},
        fail={"spin_deg": 60, **{f"D{k}": (0.0, 0.0, 1.0) for k in range(1, 7)}},
        because="All six tools point the same way, and spin about it: what lies along it never shows.",
        describe=sentence,
    )


def _swirl(cone_deg, std_trans, std_rot):
    """Poses of a tool led twice around a cone while it spins, with noise; true rotations and measured poses."""
    R = pivot.cone(SWIRL_POSES, np.deg2rad(cone_deg), turns=3.0)[(2 * np.arange(SWIRL_POSES)) % SWIRL_POSES]
    T = pivot.touching_poses(R, TIP, np.zeros(3))
    turns, shifts = unit_noise((2, SWIRL_POSES, 3), seed=4)
    T[:, :3, :3] = R @ exp_so3(std_rot * turns)
    T[:, :3, 3] += std_trans * shifts
    return R, T


def compute_swirl(state):
    """Tip from the poses measured until now: residual, true error and predicted deviation (mm)."""
    std_rot = np.deg2rad(SWIRL_STD_ROT_DEG)
    R, T = _swirl(state["cone_deg"], state["std_trans"], std_rot)
    n = 3 + int(round(state["t"] / 0.1))
    x = pivot.solve_pivot(pivot.pivot_matrix(T[:n]), pivot.pivot_rhs(T[:n]))
    found = pivot.PivotCalibration(x[:3], x[3:], T[:n], np.ones(n))  # also where `calibrate_pivot` would refuse
    values = found.singular_values
    return {
        "n": n,
        "T": T[n - 1],
        "trail": T[:n, :3, 3],
        "tip_seen": T[n - 1, :3, :3] @ found.tip + T[n - 1, :3, 3],
        "residual": found.s0,
        "error": float(np.linalg.norm(found.tip - TIP)),
        "deviation": float(np.sqrt(np.trace(found.covariance_of("tip")))),
        "ratio": float(values[-1] / values[0]),
    }


def swirl():
    """The tool swirls about the fixed point: the residual is small at once, the error only with a wide cone."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.2, 1))
        space = Scene(left, radius=95, half_width=95, floor=-12.0, unit="mm")
        space.fixed(space.body(*draw.anvil(), name="anvil"), np.eye(4))
        trail = space.points(**style.look("measurement", markersize=4))
        tool = space.body(*draw.tool(100.0, 4.0), name="tool")
        frame = space.triad("F", 35)
        point = space.points(color=style.TRUTH, linestyle="none", marker="o", markersize=9)
        space.fixed(point, np.zeros(3))
        space.fixed(space.text("pivot", offset=(10, -6)), np.zeros(3))
        tip = space.points(**style.look("estimates", markersize=8))
        names = ("residual s0", "true error", "predicted")
        bars = draw.error_bars(right, names, (0.01, 0.1, 1, 10, 100, 1000), "residual, and error of the tip")
        colors = (style.MEASUREMENT, style.TRUTH, style.ESTIMATE)

        def update(state, result):
            trail.set(result["trail"])
            tool.set(result["T"])
            frame.set(result["T"])
            tip.set(result["tip_seen"])
            space.draw(state["view"])
            draw.set_bars(bars, (result["residual"], result["error"], result["deviation"]), colors)

        return [*space.artists, *bars], update

    return Stage(
        "swirling about the pivot",
        scene=scene,
        compute=compute_swirl,
        controls={
            "cone_deg": Slider(0.0, 45.0, 25.0, step=0.5, label="half angle of the cone (deg)"),
            "std_trans": Slider(0.0, 1.0, 0.2, step=0.05, label="noise (mm)"),
        },
        play=Play(5.7, 0.1),
        view=View(-60, 18, center=(0, 0, 50), eye=600.0),
        fail={"cone_deg": 0.0, "t": 5.7},
        describe=_swirl_sentence,
    )


def _swirl_sentence(result):
    words = (
        f"{result['n']} poses: residual {result['residual']:.2f} mm, true error of the tip {result['error']:.2f} mm, "
        f"predicted {_length(result['deviation'])}; smallest singular value {result['ratio']:.2g} of the largest"
    )
    if result["ratio"] > pivot.NOISE_TOLERANCE * np.deg2rad(SWIRL_STD_ROT_DEG):
        return words + "."
    return words + ": no more than orientation noise feigns, so even the prediction is worthless."


def _length(mm):
    return f"{mm:.2f} mm" if mm < 1000 else "more than a meter"


@functools.cache
def _clean_poses():
    """Twelve poses on a cone of 30 deg with noise of 0.2 mm, and their rotations."""
    rng = np.random.default_rng(6)
    R = pivot.cone(OUTLIER_POSES, np.deg2rad(30), turns=2.0)
    return pivot.touching_poses(R, TIP, np.zeros(3), 0.0, STD_TRANS, rng)


def _where_tip(k):
    """Where the tip is in pose k, in plan view, when the tool is known."""
    return tuple(np.round((_clean_poses()[k, :3, :3] @ TIP + _clean_poses()[k, :3, 3])[:2], 2))


DRAGGED = {1: (1.0, 3.0), 5: (-4.0, -1.5), 8: (3.0, -4.0)}  # poses one can spoil, and where their touches start (mm)


def compute_outliers(state):
    """Plain and robust calibration of twelve poses, some dragged away: touches in plan, weights, tip errors (mm)."""
    T = _clean_poses().copy()
    for k in DRAGGED:
        T[k, :2, 3] += state[f"pose {k + 1}"] - _where_tip(k)
    touches = pivot.pivot_residuals(T, TIP, np.zeros(3))[:, :2]
    plain, robust = calibrate_pivot(T), calibrate_pivot(T, robust=True)
    bound = pivot.predicted_covariance(T[:, :3, :3], TIP, 0.0, STD_TRANS)
    return {
        "touches": touches,
        "weights": robust.weights,
        "error_plain": float(np.linalg.norm(plain.tip - TIP)),
        "error_robust": float(np.linalg.norm(robust.tip - TIP)),
        "bound": float(np.sqrt(np.trace(bound[:3, :3]))),
        "s0": plain.s0,
    }


def outliers():
    """Drag touches away from the pivot: the plain tip follows at once, the robust one gives the pose no weight."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.2, 1))
        kept, rejected = draw.touch_axes(left)
        bars = draw.error_bars(right, ("plain", "robust", "bound"), (0.01, 0.1, 1, 10), "error of the tip")
        colors = (style.PREDICTION, style.ESTIMATE, style.TRUTH)

        def update(state, result):
            used = result["weights"] > 0
            kept.set_data(*result["touches"][used].T)
            rejected.set_data(*result["touches"][~used].T)
            draw.set_bars(bars, (result["error_plain"], result["error_robust"], result["bound"]), colors)

        return [kept, rejected, *bars], update

    return Stage(
        "outliers",
        scene=scene,
        compute=compute_outliers,
        handles={
            f"pose {k + 1}": Handle(at, step=0.5, label=f"touch of pose {k + 1}", color=style.MEASUREMENT)
            for k, at in DRAGGED.items()
        },
        presets={"All in place": {f"pose {k + 1}": _where_tip(k) for k in DRAGGED}},
        fail={"pose 2": (12.0, 9.0), "pose 6": (13.0, 6.0), "pose 9": (10.0, 11.0)},
        because="The three bad poses lie to one side: what they do to the plain estimate adds up.",
        describe=lambda result: (
            f"Tip error: plain {result['error_plain']:.2f} mm, robust {result['error_robust']:.2f} mm, "
            f"bound {result['bound']:.2f} mm (rms). "
            f"Without weight: {np.count_nonzero(result['weights'] == 0)} of {OUTLIER_POSES} poses."
        ),
    )
