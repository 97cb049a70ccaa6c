"""Where the functions of chapter 3 are right or wrong in a way of their own: places for `right_where`."""

import functools

import numpy as np

from ...calibration import pivot
from ...geometry import frames
from ...geometry.lie import exp_so3


def vectors(rng, lengths):
    """Vectors of given lengths, none of their components near 0."""
    v = rng.uniform(0.3, 1, (len(lengths), 3)) * rng.choice([-1, 1], (len(lengths), 3))
    return np.asarray(lengths)[:, None] * v / np.linalg.norm(v, axis=1, keepdims=True)


def poses(rng, count=6, angle=0.5, reach=200.0, tip=90.0, std=1.0):
    """Poses that touch a point with the tip of a tool, turned by about such an angle."""
    R = exp_so3(vectors(rng, angle * rng.uniform(0.8, 1.2, count)))
    point = reach * rng.uniform(0.5, 1, 3)
    return pivot.touching_poses(R, vectors(rng, [tip])[0], point, 0.0, std, rng)


def one_as(change):
    """Poses the second of which is changed."""

    def draw(rng):
        T = poses(rng)
        T[1] = change(T)
        return T

    return draw


COUNTS = ((2, "two"), (4, "four"), (7, "seven"), (12, "twelve"), (40, "forty"))
SETS = (
    *((f"for {words} poses", functools.partial(poses, count=count)) for count, words in COUNTS),
    ("for poses turned by more than 90 deg", functools.partial(poses, angle=2.2)),
    ("for poses turned by very little", functools.partial(poses, angle=1e-6)),
    ("for poses many meters away", functools.partial(poses, reach=5e4)),
    ("for poses next to the origin", functools.partial(poses, reach=0.1, tip=0.1, std=0.01)),
    ("where a pose is the identity", one_as(lambda T: np.eye(4))),
    ("where a pose is half a turn, the tool upside down", one_as(lambda T: np.diag([1.0, -1.0, -1.0, 1.0]))),
    ("where a pose comes twice", one_as(lambda T: T[0])),
    ("where x, y and z of all flanges are positive", functools.partial(poses, reach=900.0)),
    ("where x, y and z of all flanges are negative", functools.partial(poses, reach=-900.0)),
)
ALONE = tuple((words, lambda rng, draw=draw: (draw(rng),)) for words, draw in SETS)


def with_points(draw, tip=60.0, point=250.0):
    """Poses, with any tip and pivot of such lengths."""
    return lambda rng: (draw(rng), vectors(rng, [tip])[0], vectors(rng, [point])[0])


def all_touching(rng):
    """Poses without noise, and the tip and pivot that are theirs."""
    T = poses(rng, std=0.0)
    result = pivot.calibrate_pivot(T)
    return T, result.tip, result.pivot


def nearly_touching(rng):
    """The same, the pivot moved by a little."""
    T, tip, point = all_touching(rng)
    return T, tip, point + vectors(rng, [7e-7])[0]


def of_one_sign(rng, sign):
    """Poses, and a tip and a pivot with coordinates of one sign."""
    return poses(rng), *(sign * np.abs(vectors(rng, [60.0, 250.0])))


WITH_POINTS = (
    *((words, with_points(draw)) for words, draw in SETS),
    *(
        (f"where the {words}", with_points(poses, tip, point))
        for words, tip, point in (
            ("tip is at the flange", 0.0, 250.0),
            ("pivot is at the origin", 60.0, 0.0),
            ("tool is short", 2.0, 250.0),
            ("tool is more than a meter long", 1500.0, 250.0),
            ("pivot is many meters away", 60.0, 5e4),
        )
    ),
    *(
        (f"where all coordinates of tip and pivot are {words}", functools.partial(of_one_sign, sign=sign))
        for words, sign in (("positive", 1), ("negative", -1))
    ),
    ("where every pose touches the point exactly", all_touching),
    ("where the tip misses the pivot by less than a thousandth of a millimeter", nearly_touching),
)


def of_whole_numbers(rng):
    """Poses of quarter turns and whole millimeters, with a tip and a pivot of decimals."""
    R = exp_so3(np.pi / 2 * np.eye(3)[rng.integers(3, size=5)]).round()
    return frames.pose(R, rng.integers(-90, 90, (5, 3)).astype(float)), *vectors(rng, [60.0, 250.0])


KINDS = (
    ("for three poses", dict(count=3)),
    ("for four poses", dict(count=4)),
    ("for five poses", dict(count=5)),
    ("for twelve poses", dict(count=12)),
    ("for forty poses", dict(count=40)),
    ("for poses turned by more than 90 deg", dict(angle=2.2)),
)


def _one_beside(rng, outlier, **kind):
    """Poses of which the first is so far beside the others, in mm along each axis."""
    T = poses(rng, **kind)
    T[0, :3, 3] += outlier
    return T


def system(rng, outlier=0.0, **kind):
    """Stacked matrix and right-hand side, one pose perhaps an outlier."""
    T = _one_beside(rng, outlier, **kind)
    return pivot.pivot_matrix(T), pivot.pivot_rhs(T)


SYSTEMS = tuple(
    (words, functools.partial(system, **kind))
    for words, kind in (
        *KINDS,
        ("for poses next to the origin", dict(reach=3.0, tip=3.0, std=0.1)),
        ("for poses many meters away", dict(reach=5e4)),
        ("for poses that miss the point by some ten millimeters", dict(std=30.0)),
        ("where one pose is far beside the others", dict(outlier=40.0, count=12)),
    )
)


def matrix_and_residuals(rng, std=0.5, outlier=0.0, **kind):
    """Stacked matrix and the residuals of its solution, one pose perhaps an outlier."""
    T = _one_beside(rng, outlier, std=std, **kind)
    return pivot.pivot_matrix(T), pivot.calibrate_pivot(T).residuals


RESIDUALS = tuple(
    (words, functools.partial(matrix_and_residuals, **kind))
    for words, kind in (
        ("for a narrow set of poses", dict(angle=0.06, count=12)),  # the first: few poses are often narrow as well
        ("for a very narrow set of poses", dict(angle=0.012, count=12)),
        *KINDS,
        ("for residuals of some hundredths of a millimeter", dict(angle=0.06, count=12, std=0.02)),
        ("for residuals of some ten-thousandths of a millimeter", dict(std=2e-4)),
        ("for residuals of some ten millimeters", dict(std=30.0)),
        ("where one pose is far beside the others", dict(outlier=40.0, count=12)),
        ("where one pose of forty is far beside the others", dict(outlier=40.0, count=40)),
    )
)


def distances(rng, quotients, scale=0.7):
    """Distances of so many cutoffs, and the scale."""
    return pivot.TUKEY * scale * rng.permutation(quotients), scale


MIXED = (0.05, 0.4, 0.7, 1.8, 0.25)
DISTANCES = (
    *(
        (f"where {words}", functools.partial(distances, quotients=quotients))
        for words, quotients in (
            ("a distance is far below the scale", (0.002, 0.01, *MIXED)),
            ("a distance is about the scale", (0.15, 0.13, *MIXED)),
            ("a distance is just below the cutoff", (0.975, 0.9997, *MIXED)),
            ("a distance is just above the cutoff", (1.005, 1.03, *MIXED)),
            ("a distance is the cutoff", (1.0, *MIXED)),
            ("a distance is a hundred times the cutoff", (100.0, *MIXED)),
            ("no pose is too far away", (0.05, 0.4, 0.7)),
            ("two distances are 0", (0.0, 0.0, *MIXED)),
            ("all distances are 0", (0.0, 0.0, 0.0)),
            ("a distance comes twice", (0.4, *MIXED)),
        )
    ),
    *(
        (f"for {words} distances", functools.partial(distances, quotients=np.linspace(0.03, 1.7, count)))
        for words, count in (("two", 2), ("fifty", 50))
    ),
    *(
        (f"for a scale {words}", functools.partial(distances, quotients=MIXED, scale=scale))
        for words, scale in (
            ("for 1", 1.0),
            ("for a whole number", 2),
            ("far below 1 mm", 0.004),
            ("for some ten millimeters", 40.0),
        )
    ),
    ("for distances that are sorted", lambda rng: (pivot.TUKEY * np.array(sorted(MIXED)), 1.0)),
)
