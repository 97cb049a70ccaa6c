"""Stages of chapter 1: three points, noise and height, the KUKA angles at the pole, SVD against Gram-Schmidt."""

import numpy as np

from ...documents.lab_sheet import printed as lab_sheet
from ...estimation.gaussian import unit_noise
from ...geometry import frames
from ...geometry.lie import exp_so3, log_so3
from ...stage import Handle, Slider, Stage, style
from ...stage.marks import Matrix, Readout
from ...stage.scene3d import Scene, View
from ...stage.scene3d_handles import Free, OnPlane
from . import figures as draw

NOISE_OF_A_TAPE = 0.01  # the yardstick of three_points, in the sheet's unit
ROOM = ((0.2, 3.0), (0.4, 3.4), (-0.5, 1.2))  # where its points may be dragged
ARM = 100.0  # mm, the trusted edge of the noisy triangles
HEIGHTS = np.geomspace(1.0, 100.0, 41)  # mm
NEAR_POLE_DEG = 1.0
NEARLY_POLE_DEG = 70.0  # from here on the caption speaks of the weak direction
FLAT_ROLL_DEG = 20.0  # three_points: from here on the caption speaks of the flat triangle


def sheet_points():
    """The sheet's points as {handle name: (x, y, z)}, "O0" the origin of K0 and so on."""
    return {
        f"{letter}{frame[-1]}": tuple(corner.tolist())
        for frame, corners in lab_sheet.points().items()
        for letter, corner in zip("OXY", corners)
    }


def compute_three_points(state):
    """Both frames of six points in space, what Gram-Schmidt removes and keeps of Y, and K0_T_K1."""
    result = {"frames": [], "points": [], "feet": [], "removed": [], "kept": [], "roll_deg": []}
    for k in "01":
        points = np.array([state["O" + k], state["X" + k], state["Y" + k]])
        T = frames.frame_from_points(*points)
        arm, length = points[2] - points[0], np.linalg.norm(points[1] - points[0])
        along = arm @ T[:3, 0]
        height = np.linalg.norm(arm - along * T[:3, 0])
        covariance = frames.gram_schmidt_covariance(length, along, height, NOISE_OF_A_TAPE)
        result["frames"].append(T)
        result["points"].append(points)
        result["feet"].append(points[0] + along * T[:3, 0])
        result["removed"].append(abs(along))
        result["kept"].append(height)
        result["roll_deg"].append(np.rad2deg(np.sqrt(covariance[0, 0])))
    return {**result, "K0_T_K1": frames.relative(*result["frames"])}


def _degrees(std_deg):
    """One standard deviation of an angle in words; beyond a quarter turn its first-order value means nothing."""
    return f"{std_deg:.2g} deg" if std_deg < 90 else "any angle"


def _three_points_sentence(result):
    for k in range(2):
        if result["roll_deg"][k] > FLAT_ROLL_DEG:
            return (
                f"Y of K{k} is only {result['kept'][k]:.3f} away from the x axis: next to nothing is kept of it, "
                "and a touch of noise rolls the frame over."
            )
    return (
        f"Of the arm to Y, {result['removed'][0]:.2f} is removed in K0 and {result['removed'][1]:.2f} in K1. "
        "Hollow cross: where the removed part ends. Dashed: the part that is kept."
    )


def three_points():
    """Drag the three measured points of both frames: the axes, the removed part of Y and K0_T_K1 follow."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.25, 1))
        space = Scene(left, radius=1.5, half_width=1.5, floor=-0.6)
        constructions = [draw.Construction(space, f"K{k}") for k in range(2)]
        triads = [space.triad("K0", 0.7), space.triad("K1", 0.7, linestyle=(0, (4, 1.5)))]
        style.bare(right)
        matrix = Matrix(right, 0.0, 0.86, "T_K0K1")
        words = Readout(right, 0.47)

        def update(state, result):
            for k in range(2):
                constructions[k].set(result["frames"][k], result["points"][k], result["feet"][k])
                triads[k].set(result["frames"][k])
            space.draw(state["view"])
            matrix.set(result["K0_T_K1"])
            words.set_text(
                f"removed of Y: {result['removed'][0]:.3f} in K0,\n{result['removed'][1]:.3f} in K1\n"
                f"noise of {NOISE_OF_A_TAPE} rolls K0 by\n{_degrees(result['roll_deg'][0])} about its x axis,\n"
                f"K1 by {_degrees(result['roll_deg'][1])}"
            )

        return [*space.artists, *matrix.artists, words], update

    labels = {"O": "origin", "X": "point on the x axis", "Y": "point on the side of y"}
    return Stage(
        "three measured points",
        scene=scene,
        compute=compute_three_points,
        handles={
            name: Handle(
                at, step=0.01, bounds=ROOM, label=f"{labels[name[0]]} of K{name[1]}", color=style.MEASUREMENT,
                way=Free(),
            )
            for name, at in sheet_points().items()
        },
        view=View(-62, 42, center=(1.5, 1.9, 0.0), eye=10.0),
        fail={"Y0": (1.7, 2.004, 0.0)},
        describe=_three_points_sentence,
    )  # fmt: skip


def _triangle(x_arm, y_along, y_height):
    return np.array([[0.0, 0, 0], [x_arm, 0, 0], [y_along, y_height, 0]])


def compute_triangle_noise(state, repetitions=200):
    """Frames of a noisy triangle measured many times: error about x, y, z (deg, rms), bound here and over HEIGHTS."""
    along, height = state["Y"][:2]
    std = state["std"]
    measured = _triangle(ARM, along, height) + std * unit_noise((repetitions, 3, 3), seed=1)
    T = frames.frame_from_points(*np.moveaxis(measured, 1, 0))
    error_deg = np.rad2deg(np.sqrt((log_so3(T[:, :3, :3]) ** 2).mean(0)))
    bounds_deg = np.rad2deg([np.sqrt(np.diag(frames.gram_schmidt_covariance(ARM, along, h, std))) for h in HEIGHTS])
    bound_deg = np.rad2deg(np.sqrt(np.diag(frames.gram_schmidt_covariance(ARM, along, height, std))))
    return {"T": T, "height": height, "error_deg": error_deg, "bound_deg": bound_deg, "bounds_deg": bounds_deg}


def _stay_in_plane(state, moved):
    """Y moves in the plane z = 0: slide it there along the line of sight, or straight down if that is too flat."""
    y, toward = state["Y"], state["view"].axes[2]
    if abs(toward[2]) > 0.15:
        y = y - y[2] / toward[2] * toward
    return {"Y": (y[0], y[1], 0.0)}


def _noise_sentence(result):
    off, bounds = ([f"{v:.2g}" for v in result[key]] for key in ("error_deg", "bound_deg"))
    return (
        f"Height {result['height']:.0f} mm (1 at least): the frame is off by {off[0]} deg about x, {off[1]} about y, "
        f"{off[2]} about z (bounds {', '.join(bounds)})."
    )


def triangle_noise():
    """Frames from repeated noisy measurements, and their error against the height of the triangle."""
    length = 60.0

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.05, 1))
        space = Scene(left, radius=85, half_width=82, floor=-25.0, unit="mm")
        plate = space.body(draw.unit_triangle(), name="plate")
        cloud = draw.TipCloud(space, length)
        triad = space.triad("F", length)
        space.fixed(triad, np.eye(4))
        edges = space.line(color=style.MEASUREMENT, linewidth=1.4)
        corners = space.points(**style.look("measurement", markersize=6))
        bounds, found = draw.error_against_height(right, HEIGHTS)

        def update(state, result):
            cloud.set(result["T"])
            triangle = _triangle(ARM, *state["Y"][:2])
            edges.set(triangle[[0, 1, 2, 0]])
            plate.set(draw.onto(triangle))
            corners.set(triangle)
            space.draw(state["view"])
            for k in range(3):
                bounds[k].set_data(HEIGHTS, result["bounds_deg"][:, k])
                found[k].set_data([result["height"]], [result["error_deg"][k]])

        return [*space.artists, *bounds, *found], update

    return Stage(
        "noise and height",
        scene=scene,
        compute=compute_triangle_noise,
        handles={
            "Y": Handle(
                (50.0, 10.0, 0.0), step=1.0, bounds=((-20, 80), (1, 80), (-200, 200)), label="y point of the triangle",
                color=style.MEASUREMENT, way=OnPlane(),
            )
        },
        controls={"std": Slider(0.05, 3.0, 0.05, step=0.05, label="noise per coordinate (mm)")},
        view=View(-65, 35, center=(32, 25, 15), eye=600.0),
        constrain=_stay_in_plane,
        fail={"Y": (50.0, 2.0, 0.0), "std": 0.5},
        because="Y lies 2 mm from the x axis, and noise of 0.5 mm now turns the plane of the three points.",
        describe=_noise_sentence,
    )  # fmt: skip


def compute_kuka_gimbal(state):
    """Pose of the angles A, B, C (deg), the axes they turn about, singular values of their rates, angles read back."""
    a, b, c = np.deg2rad([state["A_deg"], state["B_deg"], state["C_deg"]])
    T = frames.matrix_from_kuka([0, 0, 0, a, b, c])
    Rz, Ry = exp_so3([0, 0, a]), exp_so3([0, b, 0])
    axes = np.array([[0.0, 0, 1], Rz[:, 1], (Rz @ Ry)[:, 0]])
    zeros = np.array([[1.0, 0, 0], Rz[:, 0], (Rz @ Ry)[:, 1]])
    _, singular_values, Vt = np.linalg.svd(axes.T)
    return {
        "T": T,
        "angles": np.array([a, b, c]),
        "axes": axes,
        "zeros": zeros,
        "singular_values": singular_values,
        "null": Vt[2] * (1 if Vt[2][0] >= 0 else -1) if singular_values[0] - singular_values[2] > 1e-9 else None,
        "read_back_deg": np.rad2deg(frames.kuka_from_matrix(T)[3:]),
        "B_deg": float(state["B_deg"]),
    }


def _gimbal_sentence(result):
    a, _, c = np.rad2deg(result["angles"])
    if 90 - abs(result["B_deg"]) < NEAR_POLE_DEG:
        sign, total = ("-", a - c) if result["B_deg"] > 0 else ("+", a + c)
        return (
            f"At B = {result['B_deg']:.0f} deg, A and C turn about the same line: only A {sign} C = {total:.0f} deg "
            "counts, and they can trade places while the pose stays."
        )
    if abs(result["B_deg"]) > NEARLY_POLE_DEG:
        return (
            f"The rings of A and C nearly meet: the smallest singular value is {result['singular_values'][2]:.3f}, "
            "and the pose hardly answers to the weakest change."
        )
    return "Each angle turns about its own axis. Bring B to 90 deg and watch the rings of A and C meet."


def kuka_gimbal():
    """KUKA angles as three rings; at B = +-90 deg the axes of A and C are one line."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.3, 1))
        space = Scene(left, radius=1.32)
        rings = [
            draw.Ring(space, letter, color, radius, reach)
            for letter, color, radius, reach in zip("ABC", style.AXES[::-1], (1.0, 0.84, 0.68), (1.25, 1.13, 1.01))
        ]
        tool = space.triad("", 0.58, linewidth=3)
        hand = space.body(*draw.hand(), name="hand")
        style.bare(right)
        rows = (
            ("set (A, B, C)", "deg"), ("read back from the pose", "deg"),
            ("singular values of the rates", ""), ("weakest change of (A, B, C)", ""),
        )  # fmt: skip
        numbers = []
        for k, (heading, unit) in enumerate(rows):
            y = 0.94 - 0.25 * k
            right.text(0.0, y, heading + (f" ({unit})" if unit else ""), transform=right.transAxes, color=style.MUTED)
            numbers.append(right.text(0.04, y - 0.085, "", transform=right.transAxes, fontsize=12))

        def update(state, result):
            for ring, axis, zero, angle in zip(rings, result["axes"], result["zeros"], result["angles"]):
                ring.set(axis, zero, angle)
            tool.set(result["T"])
            hand.set(result["T"])
            space.draw(state["view"])
            rows = (np.rad2deg(result["angles"]), result["read_back_deg"], result["singular_values"], result["null"])
            for text, row, decimals in zip(numbers, rows, (0, 0, 3, 2)):
                words = (
                    "all alike" if row is None else ",  ".join(f"{round(v, decimals) + 0.0:.{decimals}f}" for v in row)
                )
                text.set_text(words)

        return [*space.artists, *numbers], update

    return Stage(
        "KUKA angles and the gimbal",
        scene=scene,
        compute=compute_kuka_gimbal,
        controls={
            "A_deg": Slider(-180, 180, 40, label="A (deg)"),
            "B_deg": Slider(-90, 90, 30, label="B (deg)"),
            "C_deg": Slider(-180, 180, 20, label="C (deg)"),
        },
        view=View(-50, 25, eye=8.0),
        fail={"A_deg": 60, "B_deg": 90, "C_deg": 20},
        presets={"A and C trade places": {"A_deg": 0, "B_deg": 90, "C_deg": -40}},
        describe=_gimbal_sentence,
    )


def compute_svd_against_gram_schmidt(state, repetitions=400):
    """Error (deg, rms about x, y, z) of both constructions on the same noisy points, and the bound of each."""
    (x_arm, _), (along, height), std = state["X"], state["Y"], state["std"]
    truth = _triangle(x_arm, along, height)
    measured = truth + std * unit_noise((repetitions, 3, 3), seed=1)

    def error_deg(T):
        return np.rad2deg(np.sqrt((log_so3(T[:, :3, :3]) ** 2).mean(0)))

    return {
        "triangle": truth,
        "measured": measured,
        "gram_schmidt_deg": error_deg(frames.frame_from_points(*np.moveaxis(measured, 1, 0))),
        "gram_schmidt_bound_deg": np.rad2deg(
            np.sqrt(np.diag(frames.gram_schmidt_covariance(x_arm, along, height, std)))
        ),
        "svd_deg": error_deg(frames.fit_frame(truth, measured)),
        "svd_bound_deg": np.rad2deg(np.sqrt(np.diag(frames.fit_covariance(truth, std)))),
    }


def svd_against_gram_schmidt():
    """Both constructions on the same noisy points: the fit shares the error among all edges, the other trusts one."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.15, 1))
        style.axes(left, "x (mm)", "y (mm)", "measured 400 times", equal=True)
        left.set(xlim=(-25, 135), ylim=(-20, 105))
        (cloud,) = left.plot(
            [], [], **style.look("measurement", marker=".", markersize=3, markeredgewidth=0, alpha=0.6)
        )
        (edges,) = left.plot([], [], **style.look("truth"))
        names = [
            left.annotate(n, (0, 0), xytext=(9, 7), textcoords="offset points", fontweight="bold")
            for n in ("O", "X", "Y")
        ]
        pairs = draw.compare_errors(right)

        def update(state, result):
            cloud.set_data(result["measured"][..., 0].ravel(), result["measured"][..., 1].ravel())
            edges.set_data(*result["triangle"][[0, 1, 2, 0], :2].T)
            for name, corner in zip(names, result["triangle"]):
                name.xy = tuple(corner[:2])
            draw.set_top(right, max(result["gram_schmidt_deg"].max(), result["svd_deg"].max()))
            draw.set_comparison(pairs[0], result["gram_schmidt_deg"], result["gram_schmidt_bound_deg"])
            draw.set_comparison(pairs[1], result["svd_deg"], result["svd_bound_deg"])

        moving = [cloud, edges, *names, *(artist for pair in pairs for artist in pair[:2])]
        return moving, update

    def sentence(result):
        pairs = zip("xyz", result["gram_schmidt_deg"], result["svd_deg"])
        errors = ", ".join(f"about {axis} {a:.2g} and {b:.2g}" for axis, a, b in pairs)
        short = " So short a base makes every turn about y and z bad." if result["triangle"][1, 0] < 25 else ""
        return f"Gram-Schmidt and SVD fit, deg: {errors}.{short}"

    return Stage(
        "SVD against Gram-Schmidt",
        scene=scene,
        compute=compute_svd_against_gram_schmidt,
        handles={
            "X": Handle((100.0, 0.0), step=1.0, bounds=((10, 120), (0, 0)), label="x point"),
            "Y": Handle((30.0, 60.0), step=1.0, bounds=((-20, 120), (2, 95)), label="y point"),
        },
        controls={"std": Slider(0.1, 4.0, 2.0, step=0.1, label="noise per coordinate (mm)")},
        fail={"X": (15.0, 0.0)},
        describe=sentence,
    )
