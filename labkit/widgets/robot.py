"""Stages of chapter 6: the TX40 with joint sliders and a flange to drag."""

import numpy as np

from .. import robot
from ..figures import robot as draw
from ..figures import style
from ..figures.scene3d import Scene
from ..robot import HOME, TX40
from ..tracker_simulation import T_FE
from .stage import Handle, Stage, View, slider

ARM = ("q1", "q2", "q3")
NEARLY_SINGULAR = 25.0  # mm per rad: below it, turning the arm's joints hardly moves the flange in some direction


def joints(state):
    """Joint angles, rad, shape (6,): the arm from the sliders (deg), the wrist as at home."""
    return np.concatenate([np.deg2rad([state[name] for name in ARM]), HOME[3:]])


def compute_tx40(state):
    """Arm, poses of flange and tracker, and what the first three joints can do at the flange: singular values, mm per
    rad."""
    q = joints(state)
    T_BF = robot.forward_kinematics(TX40.dh, q)
    values = np.linalg.svd(robot.jacobian(TX40.dh, q)[3:, :3], compute_uv=False)
    return {"q": q, "points": robot.arm_points(TX40, q), "T_BF": T_BF, "T_BE": T_BF @ T_FE, "singular_values": values}


def follow(state, moved):
    """Dragging the flange turns the arm, turning the arm moves the flange."""
    q = joints(state)
    if "flange" in moved and not moved & set(ARM):
        q = robot.reach_position(TX40, state["flange"], q)
    at = robot.forward_kinematics(TX40.dh, q)[:3, 3]
    return {"flange": at, **{name: float(np.rad2deg(q[k])) for k, name in enumerate(ARM)}}


def _sentence(result):
    x, y, z = result["T_BE"][:3, 3]
    if result["singular_values"][-1] < NEARLY_SINGULAR:
        return (
            f"A singular arm: in one direction the flange moves only {result['singular_values'][-1]:.0f} mm per rad. "
            "Stretched out, no joint can push it farther."
        )
    off = np.linalg.norm(T_FE[:3, 3])
    return f"The tracker E is at ({x:.0f}, {y:.0f}, {z:.0f}) mm in the base, {off:.0f} mm off the flange F."


def tx40():
    """The TX40: sliders for the arm's joints, the flange to drag; F is the flange, E the tracker mounted on it."""

    def scene(fig):
        left, right = fig.subplots(1, 2, width_ratios=(1.7, 1))
        space = Scene(left, radius=530)
        arm = draw.Arm(space)
        style.bare(right)
        words = right.text(0.0, 0.95, "", transform=right.transAxes, va="top", linespacing=1.7)

        def update(state, result):
            arm.set(result["points"], result["T_BF"], result["T_BE"])
            space.draw(state["view"])
            angles = "\n".join(f"joint {k + 1}   {np.rad2deg(a):6.0f} deg" for k, a in enumerate(result["q"]))
            x, y, z = result["T_BF"][:3, 3]
            low = result["singular_values"][-1]
            words.set_text(f"{angles}\n\nF at {x:.0f}, {y:.0f}, {z:.0f} mm\nleast mobility\n{low:.0f} mm per rad")

        return [*space.artists, words], update

    limits = np.rad2deg([TX40.q_min[:3], TX40.q_max[:3]])
    start = np.rad2deg(HOME[:3])
    return Stage(
        "TX40 with a tracker on its flange",
        scene=scene,
        compute=compute_tx40,
        handles={"flange": Handle(tuple(robot.forward_kinematics(TX40.dh, HOME)[:3, 3]), step=10, label="flange")},
        controls={
            name: slider(
                float(limits[0, k]), float(limits[1, k]), float(round(start[k])), step=1.0, label=f"joint {k + 1} (deg)"
            )
            for k, name in enumerate(ARM)
        },
        constrain=follow,
        view=View(-60, 18, center=(120, 0, 440)),
        fail={"q1": 30.0, "q2": 60.0, "q3": 14.0},
        presets={"arm upright": {"q1": 0.0, "q2": 0.0, "q3": 0.0}},
        describe=_sentence,
    )
