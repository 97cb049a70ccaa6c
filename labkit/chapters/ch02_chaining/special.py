"""Where the functions of chapter 2 are right or wrong in a way of their own: places for `right_where`."""

import functools

import numpy as np
from scipy.spatial.transform import Rotation

from ...geometry import chaining, frames
from ...geometry.lie import exp_se3

HALF = np.pi


def direction(rng):
    """A direction, none of its components near 0."""
    return frames.unit_vector(rng.uniform(0.3, 1, 3) * rng.choice([-1, 1], 3))


def pose(rng, angle=None, reach=200.0, axis=None, along=None):
    """A pose turned by an angle, some at random, shifted by so many millimeters, perhaps in a given direction."""
    angle = rng.uniform(0.5, 2.5) if angle is None else angle
    R = Rotation.from_rotvec(angle * (direction(rng) if axis is None else np.eye(3)[axis])).as_matrix()
    return frames.pose(R, reach * (direction(rng) if along is None else frames.unit_vector(along)))


def links(rng, count=4, **kind):
    """Links of a chain, the last but one of which is special."""
    found = [pose(rng) for _ in range(count)]
    found[count // 2] = pose(rng, **kind) if kind else found[count // 2]
    return (np.array(found),)


def one_link_twice(rng):
    """Links of which two neighbors are the same."""
    found = links(rng)[0]
    found[2] = found[1]
    return (found,)


def to_and_fro(rng):
    """A way and the same way back."""
    found = links(rng)[0]
    return (np.concatenate([found, frames.invert(found[::-1])]),)


CHAINS = (
    *(
        (f"for {words} links", functools.partial(links, count=count))
        for words, count in (("five", 5), ("six", 6), ("thirty", 30))
    ),
    *(
        (f"where one link {words}", functools.partial(links, **kind))
        for words, kind in (
            ("is the identity", dict(angle=0.0, reach=0.0)),
            ("shifts without a turn", dict(angle=0.0)),
            ("turns without a shift", dict(reach=0.0)),
            ("turns by very little", dict(angle=1e-3)),
            ("turns by some hundred-thousandths of a degree", dict(angle=6e-7)),
            ("turns by some thousandths of a degree and hardly shifts", dict(angle=4e-5, reach=4e-5)),
            ("is shorter than a hundredth of a millimeter", dict(reach=5e-3)),
            ("is many meters long", dict(reach=5e4)),
            ("is half a turn", dict(angle=HALF)),
        )
    ),
    ("where one link follows upon itself", one_link_twice),
    ("for a way there and back", to_and_fro),
)

PRODUCTS = tuple(
    (f"where T {words}", lambda rng, kind=kind: (pose(rng, **kind),))
    for words, kind in (
        ("turns without a shift", dict(reach=0.0)),
        ("shifts by very little", dict(reach=1e-3)),
        ("shifts by some meters", dict(reach=4e3)),
        ("turns by 30 deg", dict(angle=0.52)),
        ("turns by 60 deg", dict(angle=1.05)),
        ("turns by 90 deg", dict(angle=HALF / 2)),
        ("turns by nearly half a turn", dict(angle=3.08)),
        ("turns by a thousandth of a radian less than half a turn", dict(angle=HALF - 1e-3)),
        ("is half a turn", dict(angle=HALF)),
        ("turns by a few millionths of a radian", dict(angle=4e-6)),
        ("turns by some thousandths of a degree and hardly shifts", dict(angle=4e-5, reach=4e-5)),
        ("turns by less than a millionth of a radian and hardly shifts", dict(angle=4e-7, reach=4e-7)),
        ("shifts along x alone", dict(along=(1.0, 0.0, 0.0))),
        ("shifts against x, y and z", dict(along=(-1.0, -2.0, -1.5))),
        *((f"turns about {'xyz'[axis]} alone", dict(angle=2.0, axis=axis)) for axis in range(3)),
    )
)


def block(rng, values, reach=200.0, unturned=False):
    """A pose whose rotation block has these singular values."""
    T = pose(rng, reach=reach)
    V = pose(rng)[:3, :3]
    T[:3, :3] = (V if unturned else T[:3, :3]) @ np.diag(values) @ V.T
    return (T,)


BLOCKS = (
    *(
        (f"for {words}", functools.partial(block, values=values))
        for words, values in (
            ("a block that is a rotation already", (1, 1, 1)),
            ("a block three times as long as a rotation", (3, 3, 3)),
            ("a block off by some thousandths", (1.003, 0.998, 1.001)),
            ("a block off by 1e-8", (1 + 1e-8, 1, 1 - 2e-8)),
            ("a block with nearly right angles, too long by some millionths", (1 + 4e-6, 1 + 4.005e-6, 1 + 3.997e-6)),
            ("a block with a small singular value", (1.3, 0.9, 0.08)),
            ("a block with a large singular value", (12, 1.5, 0.9)),
        )
    ),
    ("for a block that is hardly turned", functools.partial(block, values=(1.1, 0.95, 0.9), unturned=True)),
    *(
        (f"for a pose {words}", functools.partial(block, values=(1.1, 0.95, 0.9), reach=reach))
        for words, reach in (("at the origin", 0.0), ("many meters away", 5e4))
    ),
)


def loop(rng, count=4, angle=0.05, reach=2.0, twin=False):
    """Links of a loop that ends turned by an angle, and by so many millimeters beside its start."""
    found = links(rng, count)[0]
    if twin:
        found[1] = found[0]
    gap = exp_se3(np.concatenate([angle * direction(rng), reach * direction(rng)]))
    found[-1] = frames.invert(chaining.chain(found[:-1])) @ gap if count > 1 else gap
    return (found,)


LOOPS = tuple(
    (f"for a loop {words}", functools.partial(loop, **kind))
    for words, kind in (
        ("for five links", dict(count=5)),
        ("for six links", dict(count=6)),
        ("for twenty links", dict(count=20)),
        ("that misses itself by a thousandth of a degree and of a millimeter", dict(angle=2e-5, reach=1e-3)),
        ("that misses itself by 30 deg", dict(angle=0.52)),
        ("that misses itself by more than 90 deg", dict(angle=1.9)),
        ("that misses itself by a meter", dict(reach=1e3)),
        ("with two equal links", dict(twin=True)),
    )
)
