"""Chapter 0: the first figure one can touch."""

import html

import numpy as np

from ...stage import Handle, Slider, Stage, style
from . import figures

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
    return f"p = {told[0]}, turned by {{angle}} deg once {told[1]}, twice {told[2]}.{hint}"


def quarter_turns():
    """Drag a point and see it turned once and twice; the slider sets the angle, 90 deg at first."""

    def scene(fig):
        ax = figures.plane(fig.subplots())
        lines, labels, circle, across = figures.turned_points(ax)
        around = np.linspace(0, 2 * np.pi, 100)

        def update(state, result):
            circle.set_data(*(np.hypot(*result[0]) * np.array([np.cos(around), np.sin(around)])))
            across.set_data(*-result[:1].T)
            for line, point in zip(lines, result):
                line.set_data([0, point[0]], [0, point[1]])
            figures.name_points(labels, result)

        return [circle, across, *lines, *labels], update

    return Stage(
        "quarter turns",
        scene=scene,
        compute=compute,
        handles={"p": Handle((3, 1), step=0.1)},
        controls={"angle": Slider(0, 180, 90, step=5, label="angle (deg)")},
        constrain=_inside,
        fail={"angle": 80},
        because="Turned by 80 deg instead of 90, twice, 20 deg are missing to the place across (hollow ring).",
        describe=_caption,
    )


ROLES = (
    ("truth", "currentColor", "", "", "solid line"),
    ("measurement", style.MEASUREMENT, "", "dot", "round dots"),
    ("prediction", style.PREDICTION, "7 3", "", "dashed line"),
    ("estimate", style.ESTIMATE, "", "diamond", "solid line or diamonds"),
    ("rejected", style.REJECTED, "", "cross", "hollow crosses"),
    ("x axis", style.AXIS_X, "", "", "with the letter x at the tip"),
    ("y axis", style.AXIS_Y, "", "", "with the letter y at the tip"),
    ("z axis", style.AXIS_Z, "", "", "with the letter z at the tip"),
)
MARKS = {
    "": "M4 9 H52",
    "dot": "M14 9 m-5 0 a5 5 0 1 0 10 0 a5 5 0 1 0 -10 0 M40 9 m-5 0 a5 5 0 1 0 10 0 a5 5 0 1 0 -10 0",
    "diamond": "M4 9 H52 M22 9 L28 3 L34 9 L28 15 Z",
    "cross": "M10 5 L18 13 M10 13 L18 5 M36 5 L44 13 M36 13 L44 5",
}


class Colors:
    """The roles of the course's colors as a table, each with its line or marker; text where no HTML is shown."""

    def __repr__(self):
        return "\n".join(f"{role:12} {words}" for role, _, _, _, words in ROLES)

    def _repr_mimebundle_(self, include=None, exclude=None):
        rows = "".join(f"<tr><td>{_swatch(*look)}</td>{_cell(role)}{_cell(words)}</tr>" for role, *look, words in ROLES)
        return {"text/plain": repr(self), "text/html": f"<table>{rows}</table>"}


def _swatch(color, dashes, mark):
    fill = color if mark in ("dot", "diamond") else "none"
    return (
        f'<svg width="56" height="18" aria-hidden="true"><path d="{MARKS[mark]}" stroke="{color}" fill="{fill}" '
        f'stroke-width="2.2" stroke-dasharray="{dashes}"/></svg>'
    )


def _cell(words):
    return f'<td style="text-align:left">{html.escape(words)}</td>'


def colors():
    """What the colors of the course stand for."""
    return Colors()
