"""Chapter 0: the first figure one can touch."""

import numpy as np

from ..figures import start
from .stage import Handle, Stage, slider

RADIUS = 3.8  # what fits into the picture in every direction


def compute(state):
    """The point and its two turns by the slider's angle, shape (3, 2)."""
    angle = np.deg2rad(state["angle"])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    p = state["p"]
    return np.array([p, turn @ p, turn @ turn @ p])


def _inside(state, moved):
    """Keep the point where its turns are still in the picture."""
    length = np.hypot(*state["p"])
    return {"p": state["p"] * RADIUS / length} if length > RADIUS else {}


def _caption(points):
    """The three points in words."""
    told = [f"({x:.1f}, {y:.1f})" for x, y in points]
    hint = " At the origin there is nothing to turn." if np.allclose(points[0], 0) else ""
    return f"p = {told[0]}, turned once {told[1]}, twice {told[2]}.{hint}"


def quarter_turns():
    """Drag a point and see it turned once and twice; the slider sets the angle, 90 deg at first."""

    def scene(fig):
        ax = start.plane(fig.subplots())
        lines, labels = start.turned_points(ax)

        def update(state, result):
            for line, label, point in zip(lines, labels, result):
                line.set_data([0, point[0]], [0, point[1]])
                label.set_position(point * (1 + 0.5 / max(np.hypot(*point), 1)))

        return [*lines, *labels], update

    return Stage(
        "quarter turns",
        scene=scene,
        compute=compute,
        handles={"p": Handle((3, 1), step=0.1)},
        controls={"angle": slider(0, 180, 90, step=5, label="angle (deg)")},
        constrain=_inside,
        fail={"p": (0, 0)},
        describe=_caption,
    )
