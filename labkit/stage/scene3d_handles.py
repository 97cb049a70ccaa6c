"""How a handle moves in space: in the plane of the screen, along a line, on a plane, on a sphere, or about an axis.

A pull is a ray: from the eye through the place on the screen. Each way to move finds the point of its own that the ray
means. Arrow keys go along the axes of the world, as far as the way leaves them free.
"""

from dataclasses import dataclass

import numpy as np

from ..checks import as_finite, shown
from . import style
from .scene3d import as_pose

FLAT = 0.12  # sine of the angle below which a plane is seen too flat to be pointed at
DIAL_PIECES = 720


@dataclass(frozen=True)
class Free:
    """In the plane of the screen; arrow keys along x, y and z."""

    def pull(self, at, eye, ray, toward):
        return eye + ray * ((at - eye) @ toward) / (ray @ toward)

    def ways(self, at):
        return np.eye(3)

    def keep(self, at):
        return at


@dataclass(frozen=True)
class Along:
    """On the line through where it is, in a direction (3,)."""

    direction: tuple

    def pull(self, at, eye, ray, toward):
        d = _unit(self.direction)
        across = np.array([d @ d, -d @ ray, ray @ ray])
        right = np.array([d @ (eye - at), ray @ (eye - at)])
        det = across[0] * across[2] - across[1] ** 2
        if det < 1e-4 * across[2]:  # one looks along the line
            return at
        return at + d * (across[2] * right[0] + across[1] * right[1]) / det

    def ways(self, at):
        return _unit(self.direction)[None]

    def keep(self, at):
        return at


@dataclass(frozen=True)
class OnPlane:
    """On the plane through where it is, with a normal (3,)."""

    normal: tuple = (0.0, 0.0, 1.0)

    def pull(self, at, eye, ray, toward):
        n = _unit(self.normal)
        if abs(ray @ n) > FLAT * np.linalg.norm(ray):
            return eye + ray * ((at - eye) @ n) / (ray @ n)
        there = Free().pull(at, eye, ray, toward)
        return there - ((there - at) @ n) * n

    def ways(self, at):
        n = _unit(self.normal)
        flat = np.eye(3) - np.outer(n, n)
        lengths = np.linalg.norm(flat, axis=1)
        return np.array([flat[k] / lengths[k] for k in np.argsort(-lengths)[:2]])

    def keep(self, at):
        return at


@dataclass(frozen=True)
class OnSphere:
    """On a sphere; `upper` keeps it above the center."""

    radius: float = 1.0
    center: tuple = (0.0, 0.0, 0.0)
    upper: bool = False

    def pull(self, at, eye, ray, toward):
        d = ray / np.linalg.norm(ray)
        beside = np.subtract(self.center, eye)
        nearest = eye + (beside @ d) * d  # of the ray to the center
        inside = self.radius**2 - np.sum((nearest - self.center) ** 2)
        return self.keep(nearest - np.sqrt(max(inside, 0.0)) * d)

    def ways(self, at):
        return np.eye(3)

    def keep(self, at):
        way = np.array(np.subtract(at, self.center))
        if self.upper:
            way[2] = max(way[2], 0.02 * self.radius)
        length = np.linalg.norm(way)
        return np.array(self.center) + (way / length if length > 1e-12 else np.array([0, 0, 1.0])) * self.radius


def stepped(way, at, steps, axes, size):
    """Where arrow keys lead from `at`: each along the free axis that points most nearly there on the screen.

    steps : how often (right, up); axes : the view's axes as rows; size : the length of a step.
    """
    free = list(way.ways(at))
    shift = np.zeros(3)
    for count, screen in zip(steps, axes[:2]):
        if not free or not count:
            continue
        best = max(range(len(free)), key=lambda k: abs(free[k] @ screen))
        shift += count * size * np.sign(free[best] @ screen) * free[best]
        if steps[0] and steps[1]:
            free.pop(best)
    return way.keep(at + shift)


@dataclass(frozen=True)
class Dial:
    """An angle (deg) one turns by pulling a point on a circle: a joint.

    value, low, high : where it starts, and its limits. where : function(result) -> (T, radius), the circle is the one
        about the z axis of T (4, 4) through its origin; angle 0 lies along x. step : what an arrow key turns it by.
    """

    value: float
    low: float
    high: float
    where: object
    step: float = 1.0
    ax: int = 0
    label: str = ""
    color: str = style.INK

    @property
    def at(self):
        return float(self.value)

    def check(self, name, value):
        value = float(as_finite(value, name))
        if not self.low - 1e-9 <= value <= self.high + 1e-9:
            raise ValueError(f"{name} must lie in [{shown(self.low)}, {shown(self.high)}] deg, got {shown(value)}")
        return float(np.clip(value, self.low, self.high))

    def _circle(self, result):
        T, radius = self.where(result)
        called = f"the circle of {self.label or 'a handle'}"
        return as_pose(T, called), float(as_finite(radius, called))

    def point(self, value, result):
        """Where its handle is in space, (3,)."""
        T, radius = self._circle(result)
        angle = np.deg2rad(value)
        return T[:3, 3] + radius * (np.cos(angle) * T[:3, 0] + np.sin(angle) * T[:3, 1])

    def pull(self, value, result, eye, ray):
        """The angle whose point comes nearest to a ray; of two alike the one less far to turn."""
        T, radius = self._circle(result)
        offered = value + np.linspace(-180, 180, DIAL_PIECES + 1)
        angle = np.deg2rad(offered)
        points = T[:3, 3] + radius * (np.outer(np.cos(angle), T[:3, 0]) + np.outer(np.sin(angle), T[:3, 1]))
        d = ray / np.linalg.norm(ray)
        off = np.linalg.norm(np.cross(points - eye, d), axis=-1) + 0.15 * radius * np.abs(offered - value) / 180
        return float(np.clip(offered[np.argmin(off)], self.low, self.high))

    def stepped(self, value, steps):
        return float(np.clip(value + self.step * (steps[0] + steps[1]), self.low, self.high))


def _unit(v):
    v = np.asarray(v, dtype=float)
    return v / np.linalg.norm(v)
