"""Where the functions of chapter 1 are right or wrong in a way of their own: places for `right_where`."""

import functools
import itertools

import numpy as np
from scipy.spatial.transform import Rotation

from ...geometry import frames

AXES = [(k, sign) for k in range(3) for sign in (1, -1)]
HALF, QUARTER = np.pi, np.pi / 2


def direction(rng):
    """A direction, none of its components near 0."""
    return frames.unit_vector(rng.uniform(0.3, 1, 3) * rng.choice([-1, 1], 3))


def anywhere(rng, reach=500):
    """A place some hundred millimeters away, or as far as asked for."""
    return rng.uniform(0.3, 1, 3) * rng.choice([-1, 1], 3) * reach


def vector(rng, length, signs=None):
    """A vector of a given length in a direction, or with given signs of its components, 0 among them."""
    v = direction(rng) if signs is None else np.abs(direction(rng)) * signs
    return (length * frames.unit_vector(v),)


VECTORS = (
    *(
        (f"for a {words} vector", functools.partial(vector, length=length))
        for words, length in (("short", 3.0), ("tiny", 2e-8), ("very long", 1e8))  # tiny: no 0 for np.isclose
    ),
    *(
        (f"where {words}", functools.partial(vector, length=70.0, signs=signs))
        for words, signs in (
            ("no component is negative", (1, 1, 1)),
            ("all components are negative", (-1, -1, -1)),
            ("one component is 0", (1, 0, -1)),
            ("the vector points against an axis", (0, -1, 0)),
        )
    ),
    ("where a component is far smaller than the others", lambda rng: vector(rng, 70.0, signs=(1, -2e-7, 0.5))),
    ("for an axis, whose length is 1", lambda rng: (np.array([0.0, 0.0, 1.0]),)),
)


def edges(rng, lengths, angle_deg=60.0):
    """Two edges of given lengths at a given angle."""
    x = direction(rng)
    y = frames.unit_vector(np.cross(np.cross(x, direction(rng)[[1, 2, 0]] * (1, -1, 1)), x))
    angle = np.deg2rad(angle_deg)
    return lengths[0] * x, lengths[1] * (np.cos(angle) * x + np.sin(angle) * y)


def flat_edges(rng):
    """Two edges in the xy plane of W, along neither axis."""
    turn, angle = rng.uniform(0.3, 1.2), rng.uniform(0.7, 2.4)
    return tuple(100 * np.array([np.cos(a), np.sin(a), 0.0]) for a in (turn, turn + angle * rng.choice([-1, 1])))


def edges_along(rng, axis, sign):
    """An edge along an axis of W, up or down, and one along the next axis."""
    return sign * 80.0 * np.eye(3)[axis], 50.0 * np.eye(3)[axis - 2]


EDGES = (
    *(
        (f"for {words}", functools.partial(edges, lengths=lengths, angle_deg=angle_deg))
        for words, lengths, angle_deg in (
            ("long edges", (2e4, 3e4), 60.0),
            ("edges of one length", (90.0, 90.0), 110.0),
            ("a second edge that is much longer", (25.0, 900.0), 60.0),
            ("a second edge that is much longer, at more than 90 deg to the first", (25.0, 900.0), 120.0),
            ("a second edge that is much shorter", (900.0, 25.0), 60.0),
            ("a flat triangle", (250.0, 200.0), 4.0),
            ("a very flat triangle", (250.0, 200.0), 0.05),
            ("a flat triangle, the origin in its middle", (250.0, 200.0), 176.0),
        )
    ),
    ("for edges in the xy plane of W", flat_edges),
    *(
        (
            f"where the first edge points {'along' if sign > 0 else 'against'} the {'xyz'[axis]} axis of W",
            functools.partial(edges_along, axis=axis, sign=sign),
        )
        for axis, sign in AXES
    ),
)
SHORT_EDGES = (("for edges of some hundredths of a millimeter", functools.partial(edges, lengths=(0.03, 0.02))),)


def triangle(rng, draw, origin=anywhere):
    """Three points of two edges."""
    o = origin(rng)
    return o, *(o + edge for edge in draw(rng))


def nowhere(rng):
    """The origin."""
    return np.zeros(3)


PLAIN_EDGES = functools.partial(edges, lengths=(110.0, 70.0))
TRIANGLES = (
    *((words, functools.partial(triangle, draw=draw)) for words, draw in EDGES),
    *(
        (words, functools.partial(triangle, draw=PLAIN_EDGES, origin=origin))
        for words, origin in (
            ("where the frame sits at the origin of W", nowhere),
            ("where the frame sits next to the origin of W", functools.partial(anywhere, reach=2.0)),
            ("where the frame is many meters away", functools.partial(anywhere, reach=5e4)),
        )
    ),
)


def turned(rng, angle, axis=None):
    """A rotation by an angle about a direction, or about an axis of W."""
    return Rotation.from_rotvec(angle * (direction(rng) if axis is None else np.eye(3)[axis])).as_matrix()


def pose(rng, angle, axis=None, reach=500.0, sign=None):
    """A pose turned like that, somewhere, perhaps with coordinates of one sign."""
    t = anywhere(rng, reach) if reach else np.zeros(3)
    return frames.pose(turned(rng, angle, axis), t if sign is None else sign * np.abs(t))


def of_whole_numbers(rng):
    """A pose of quarter turns and whole millimeters."""
    return frames.pose(turned(rng, QUARTER, int(rng.integers(3))).round(), rng.integers(-90, 90, 3))


KINDS_OF_POSES = (
    ("a pose at the origin of W", dict(angle=1.0, reach=0.0)),
    ("the identity", dict(angle=0.0, reach=0.0)),
    ("a pose a few millimeters away", dict(angle=1.0, reach=3.0)),
    ("a pose some meters away", dict(angle=1.0, reach=3e3)),
    ("a pose turned by very little, but far away", dict(angle=6e-4)),
    ("a pose turned by some hundred-thousandths of a degree", dict(angle=6e-7)),
    ("a pose turned by less than 90 deg", dict(angle=1.2)),
    ("a pose turned by half a turn", dict(angle=HALF)),
    *(
        (f"a pose with {words} x, y and z", dict(angle=2.0, sign=sign))
        for words, sign in (("positive", 1), ("negative", -1))
    ),
    *((f"a pose turned about {'xyz'[axis]} alone", dict(angle=2.0, axis=axis)) for axis in range(3)),
    *((f"a pose turned by half a turn about {'xyz'[axis]}", dict(angle=HALF, axis=axis)) for axis in range(3)),
)
POSES = tuple((f"for {words}", lambda rng, kind=kind: (pose(rng, **kind),)) for words, kind in KINDS_OF_POSES)


def beside(rng, angle, reach):
    """Two frames of which one is turned and shifted from the other."""
    T_WA = pose(rng, 2.0)
    return T_WA, T_WA @ pose(rng, angle, reach=reach)


FRAMES = (
    *(
        (f"where T_W{'AB'[k]} is {words}", lambda rng, kind=kind, k=k: _one_of_two(rng, kind, k))
        for words, kind in KINDS_OF_POSES
        for k in (0, 1)
    ),
    ("for two frames in one place, turned apart", functools.partial(beside, angle=1.4, reach=0.0)),
    (
        "for two frames turned alike, a thousandth of a millimeter apart",
        functools.partial(beside, angle=0.0, reach=1e-3),
    ),
    ("for two frames turned nearly alike, far apart", functools.partial(beside, angle=6e-4, reach=500.0)),
    ("for two frames turned apart by less than 90 deg", functools.partial(beside, angle=1.2, reach=500.0)),
    ("for two frames turned apart by half a turn", functools.partial(beside, angle=HALF, reach=500.0)),
    ("for two frames some meters apart", functools.partial(beside, angle=1.2, reach=3e3)),
)


def _one_of_two(rng, kind, k):
    """Two poses, one of which is special."""
    pair = [pose(rng, 2.2), pose(rng, 2.2)]
    pair[k] = pose(rng, **kind)
    return tuple(pair)


def angles(rng, abc, reach=500.0):
    """A KUKA pose with given angles, one of them drawn where None stands."""
    drawn = rng.uniform(0.5, 1.3, 3) * rng.choice([-1, 1], 3)
    abc = [drawn[k] if angle is None else angle for k, angle in enumerate(abc)]
    return (np.concatenate([anywhere(rng, reach) if reach else np.zeros(3), abc]),)


def _about_one_axis(k, angle):
    return tuple(angle if i == k else 0.0 for i in range(3))


def _with_one(k, angle):
    return tuple(angle if i == k else None for i in range(3))


FREE = (None, None, None)
ANGLES = (
    ("where A, B and C are 0", functools.partial(angles, abc=(0.0, 0.0, 0.0))),
    *(
        (f"where {'ABC'[k]} is {what}", functools.partial(angles, abc=_with_one(k, angle)))
        for k in range(3)
        for what, angle in (
            ("0", 0.0),
            ("90 deg", QUARTER),
            ("-90 deg", -QUARTER),
            ("180 deg", HALF),
            ("200 deg", 3.49),
            ("-200 deg", -3.49),
            ("500 deg", 8.73),
            ("-500 deg", -8.73),
            ("120 deg", 2.09),
            ("-120 deg", -2.09),
        )
    ),
    *((f"where {'ABC'[k]} alone is not 0", functools.partial(angles, abc=_about_one_axis(k, 0.7))) for k in range(3)),
    ("for angles of some thousandths of a degree", functools.partial(angles, abc=(5e-5, -4e-5, 3e-5))),
    ("for angles of some hundred-thousandths of a degree", functools.partial(angles, abc=(5e-7, -4e-7, 3e-7))),
    *(
        (f"where the position is {words}", functools.partial(angles, abc=FREE, reach=reach))
        for words, reach in (("the origin", 0.0), ("near the origin", 0.5), ("many meters away", 5e4))
    ),
)


def read_from(rng, **kind):
    """The matrix of such a pose."""
    return (frames.matrix_from_kuka(angles(rng, **kind)[0]),)


def read_exactly(rng, quarters):
    """The matrix of a pose, so many quarter turns about z, y and x with exact zeros, any angle where None stands."""
    R = np.eye(3)
    for axis, quarter in zip("zyx", quarters):
        angle = rng.uniform(0.5, 1.3) if quarter is None else quarter * QUARTER
        turn = Rotation.from_euler(axis, angle).as_matrix()
        R = R @ (turn if quarter is None else turn.round())
    return (frames.pose(R, anywhere(rng)),)


NEAR_THE_POLE = 6e-5  # rad: nearer to it, a limit of 1e-9 on |sin B| sets A to 0 and is as good as any


def _quadrant(low, k):
    return f"{'ABC'[k]} is between {low} and {low + 90} deg"


READINGS = (
    *(
        (
            f"where {_quadrant(a, 0)} and {_quadrant(c, 2)}",
            functools.partial(read_from, abc=(np.deg2rad(a + 40), b, np.deg2rad(c + 50))),
        )
        for (a, c), b in zip(itertools.product((-180, -90, 0, 90), repeat=2), 8 * (0.8, -0.8))
    ),
    *(
        (f"where {'ABC'[k]} is {what}", functools.partial(read_from, abc=_with_one(k, angle)))
        for k in range(3)
        for what, angle in (("0", 0.0), ("90 deg", QUARTER), ("-90 deg", -QUARTER))[: 1 if k == 1 else 3]
    ),
    *(
        (f"where {'ABC'[k]} alone is not 0", functools.partial(read_from, abc=_about_one_axis(k, 0.7)))
        for k in range(3)
    ),
    ("where A, B and C are 0", functools.partial(read_from, abc=(0.0, 0.0, 0.0))),
    ("for angles of some thousandths of a degree", functools.partial(read_from, abc=(5e-5, -4e-5, 3e-5))),
    ("for angles of some hundred-thousandths of a degree", functools.partial(read_from, abc=(5e-7, -4e-7, 3e-7))),
    *(
        (
            f"some thousandths of a degree beside B = {sign * 90} deg, where A and C still are two angles",
            functools.partial(read_from, abc=(None, sign * (QUARTER - NEAR_THE_POLE), None)),
        )
        for sign in (1, -1)
    ),
    *(
        (
            f"for a matrix with exact zeros, where {'ABC'[k]} is {90 * quarter} deg",
            functools.partial(read_exactly, quarters=_with_one(k, quarter)),
        )
        for k in (0, 2)
        for quarter in (1, -1, 2)
    ),
    *(
        (
            f"for a matrix with exact zeros, where A, B and C are {a * 90}, {b * 90} and {c * 90} deg",
            functools.partial(read_exactly, quarters=(a, b, c)),
        )
        for a, b, c in ((1, 0, 0), (0, 0, -1), (-1, 0, 2), (0, 1, 0), (1, -1, 0), (2, 1, -1))
    ),
    *(
        (f"where the position is {words}", functools.partial(read_from, abc=FREE, reach=reach))
        for words, reach in (("the origin", 0.0), ("many meters away", 5e4))
    ),
)


def two_sets_in_a_plane(rng, count=6):
    """Points in one plane, turned against the axes of F, and where they were measured."""
    x, y, _ = frames.gram_schmidt(*edges(rng, (1.0, 1.0))).T
    return two_sets(rng, count, drawing=lambda p: p @ np.outer(x, x) + p @ np.outer(y, y) + 80.0)


def two_sets(rng, count=6, angle=1.0, reach=500.0, drawing=None, noise=0.5, size=200.0):
    """Points of a drawing and where they were measured."""
    points_F = rng.uniform(-size, size, (count, 3)) + rng.uniform(-size, size, 3)
    points_F = drawing(points_F) if drawing else points_F
    T_WF = pose(rng, angle, reach=reach)
    return points_F, frames.transform(T_WF, points_F) + noise * rng.normal(size=(count, 3))


BADLY_MEASURED = (("for points measured badly, by some ten millimeters", functools.partial(two_sets, noise=20.0)),)
SETS = tuple(
    (f"for {words}", functools.partial(two_sets, **kind))
    for words, kind in (
        ("four points", dict(count=4)),
        ("five points", dict(count=5)),
        ("eight points", dict(count=8)),
        ("thirty points", dict(count=30)),
        ("points with z = 0 in the drawing", dict(drawing=lambda p: p * (1, 1, 0))),
        ("points with z = 0 in the drawing, measured without noise", dict(drawing=lambda p: p * (1, 1, 0), noise=0.0)),
        ("points whose center is the origin of F", dict(drawing=lambda p: p - p.mean(0))),
        ("points that were measured exactly", dict(noise=0.0)),
        ("points that lie where the drawing has them", dict(angle=0.0, reach=0.0, noise=0.0)),
        ("a frame turned by half a turn", dict(angle=HALF)),
        ("a frame turned by nearly half a turn", dict(angle=2.9)),
        ("a frame hardly turned", dict(angle=1e-3)),
        ("a frame turned by some hundred-thousandths of a degree", dict(angle=6e-7, noise=0.0)),
        ("a small part, of a few millimeters", dict(size=2.0, noise=0.01)),
        ("a part many meters away", dict(reach=5e4)),
        ("points one of which was measured twice", dict(drawing=lambda p: np.concatenate([p[:-1], p[:1]]))),
    )
) + tuple(  # many of them: whether a matrix that should be a rotation is a mirror image there, the processor tosses
    (
        "for points in one plane, where the determinant of pᵀ q is nothing but rounding",
        functools.partial(two_sets_in_a_plane, count=count),
    )
    for count in (4, 5, 6, 7, 8, 9) * 3
)
