"""Bodies of chapter 6: the TX40 from its printed lengths, the tracker's puck, its base stations."""

import numpy as np

from ...geometry.frames import invert, pose
from ...machines.arm import BASE_HEIGHT, REACH_FOREARM, REACH_WRIST, SHOULDER_OFFSET, TX40, link_frames
from ...stage import scene3d_solids as solids
from ...stage import style

ELBOW = BASE_HEIGHT + REACH_WRIST - REACH_FOREARM  # heights of the joints with the arm upright, mm
WRIST = BASE_HEIGHT + REACH_WRIST
FLANGE = WRIST + TX40.dh[5, 1]
ALONG_Y = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # z of a solid along y
RINGS = (112.0, 92.0, 72.0)  # mm: radii of the wrist's gimbal


def _shift(x, y, z):
    return pose(np.eye(3), [x, y, z])


def _across(radius, left, right, height, color=style.SHELL):
    """A cylinder along y between two y, at a height above the base."""
    return solids.cylinder(radius, left, right).looks(color).moved(_shift(0, 0, height) @ ALONG_Y)


def _upright(radius, bottom, top, top_radius=None, y=0.0, color=style.SHELL):
    return solids.cylinder(radius, bottom, top, top_radius).looks(color).moved(_shift(0, y, 0))


def upright_parts():
    """Solids of the TX40 in the base with the arm upright (all joints zero), one tuple for the base and each link.

    Lengths between joints are the printed ones; how thick it is nobody printed.
    """
    y, steel = SHOULDER_OFFSET, style.STEEL
    bar = solids.raised(_stadium(62.0, 48.0, ELBOW - BASE_HEIGHT), y + 12.0, y + 66.0)
    stand = np.array([[-1.0, 0, 0, 0], [0, 0, 1, 0], [0, 1, 0, BASE_HEIGHT], [0, 0, 0, 1]])  # y of the outline upward
    return (
        (solids.box(210, 210, (0, 18)).looks(steel), _upright(92, 18, 60, 80), _upright(80, 60, 196)),
        (_upright(78, 200, 300), _across(78, -78, y + 8, BASE_HEIGHT), _across(60, -84, -78, BASE_HEIGHT, steel)),
        (bar.moved(stand), _across(40, y + 66, y + 72, BASE_HEIGHT, steel), _across(32, y + 66, y + 72, ELBOW, steel)),
        (_across(50, y - 58, y + 9, ELBOW), _upright(46, ELBOW, ELBOW + 110, 40, y)),
        (_upright(38, ELBOW + 114, WRIST - 22, 34, y), _across(30, y - 34, y + 34, WRIST)),
        (_upright(27, WRIST, WRIST + 38, 25, y, steel), _across(24, y - 38, y + 38, WRIST, steel)),
        (_upright(24, WRIST + 41, FLANGE - 6, 22, y), _upright(31, FLANGE - 6, FLANGE, None, y, steel)),
    )


def _stadium(low, high, length):
    """Outline around a circle at the origin and one at (0, length), counter-clockwise."""
    half = np.linspace(0, np.pi, 9)
    upper = np.column_stack([high * np.cos(half), length + high * np.sin(half)])
    lower = np.column_stack([-low * np.cos(half), -low * np.sin(half)])
    return np.concatenate([upper, lower])


LINKS = ("base", "shoulder", "upper arm", "elbow", "forearm", "wrist", "flange plate")


class Tx40:
    """The arm in a scene: `.set(frames)` with `link_frames`, shape (7, 4, 4)."""

    def __init__(self, scene):
        zero = invert(link_frames(TX40.dh, np.zeros(6)))
        self.links = [
            scene.body(*(part.moved(T) for part in parts), name=name)
            for name, parts, T in zip(LINKS, upright_parts(), zero)
        ]

    def set(self, frames):
        for link, T in zip(self.links, frames):
            link.set(T)


class Dials:
    """Circles on which the joints are turned: arcs of the arm's three, whole rings about the center of the wrist."""

    def __init__(self, scene):
        self.arcs = [scene.line(**style.look("guide", linewidth=1.8)) for _ in range(3)]
        self.rings = [scene.line(color=color, linewidth=2.0) for color in style.AXES[::-1]]
        self.spans = [np.deg2rad(np.linspace(-a, a, 36 * a // 180 * 2 + 13)) for a in (28, 28, 28, 180, 180, 180)]

    def set(self, circles, q):
        """`circles`: (T, radius) of each joint; `q`: its angle (rad), (6,)."""
        for line, span, (T, radius), angle in zip((*self.arcs, *self.rings), self.spans, circles, q):
            turned = angle + span
            flat = np.column_stack([np.cos(turned), np.sin(turned), 0 * turned])
            line.set(T[:3, 3] + radius * flat @ T[:3, :3].T)


def reach():
    """Where the wrist can get with the arm stretched: a circle about axis 2, led about axis 1; open below, where the
    limits of joint 2 end it.
    """
    lean = np.linspace(TX40.q_max[1], 0.0, 25)
    radius = np.hypot(SHOULDER_OFFSET, REACH_WRIST * np.sin(lean))
    return solids.turned(np.column_stack([radius, BASE_HEIGHT + REACH_WRIST * np.cos(lean)])).looks(
        style.PREDICTION, 0.12
    )


def puck():
    """The tracker in its own frame: origin on the face that is screwed to the flange's plate, z out of it."""
    shell = solids.turned([(0, 0), (38, 0), (49, 9), (49, 18), (40, 27), (16, 33), (0, 33)]).looks(style.STEEL)
    return shell, *(
        solids.sphere(5.0, 8).looks(style.INK).moved(_shift(34 * np.cos(a), 34 * np.sin(a), 27))
        for a in 2 * np.pi * np.arange(3) / 3
    )


def station():
    """A base station that looks along its z axis."""
    return (
        solids.box(74, 66, (-58, 0)).looks(style.SHELL),
        solids.box(66, 58, (0, 3)).looks(style.INK),
        solids.cylinder(7, 3, 6).looks(style.PREDICTION).moved(_shift(-16, 0, 0)),
        solids.cylinder(7, 3, 6).looks(style.PREDICTION).moved(_shift(16, 0, 0)),
    )


def sheet_of_light(length, half_angle):
    """The fan a station sends out, in its frame: a thin triangle that looks along z, upright in y."""
    side = length * np.tan(half_angle)
    fan = solids.raised([(0, 0), (length, -side), (length, side)], -0.5, 0.5)
    turn = np.array([[0.0, 0, -1, 0], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]])  # x of the outline along z
    return fan.looks(style.PREDICTION, 0.25).moved(turn)


def scanner():
    """A small line scanner that looks along its z axis, from its own frame."""
    light = solids.raised([(0, 0), (215, -38), (215, 38)], -0.5, 0.5).looks(style.LASER, 0.22)
    turn = np.array([[0.0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0], [0, 0, 0, 1]])  # the fan lies in y = 0, down z
    return solids.box((-30, 30), (-12, 12), (-36, 0)).looks(style.STEEL), light.moved(turn)


def plate():
    """The part of the cell: a plate around its three marks, top at z = 0."""
    return solids.raised([(-18, -18), (128, -18), (128, 60), (60, 98), (-18, 98)], -12.0, 0.0)


def part():
    """The plate with its marks and its hole."""
    marks = (
        solids.cylinder(6, 0, 3).looks(style.MEASUREMENT).moved(_shift(*p, 0)) for p in ((0, 0), (110, 0), (25, 80))
    )
    return plate(), solids.cylinder(7, 0, 2).looks(style.INK).moved(_shift(80, 55, 0)), *marks


def trolley(T_PE):
    """What carries the part and its tracker, in P: a board, a leg down to the floor, a post with the puck."""
    x, y, z = T_PE[:3, 3]
    return (
        solids.box((-110, 140), (-40, 110), (-22, -12)).looks(style.STEEL),
        solids.cylinder(26, -100, -22, 20).looks(style.STEEL).moved(_shift(30, 35, 0)),
        solids.cylinder(7, -12, z).looks(style.STEEL).moved(_shift(x, y, 0)),
        *(solid.moved(T_PE @ _scaled(0.55)) for solid in puck()),
    )


def _scaled(factor):
    return np.diag([factor, factor, factor, 1.0])
