"""Solids of a scene in space, described by a few numbers: profiles that are turned, outlines that are raised, paths
that get a thickness.

The browser makes its triangles from the description itself (`web/space/solids.js`, the same three rules with more
pieces round); the kernel makes coarse ones for its own picture.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from . import style

ROUND = 12  # pieces of a turn in the kernel's picture


@dataclass(frozen=True)
class Solid:
    """One solid: `shape` holds what it is made of, `at` (4, 4) where it sits in its body; sizes in the scene's unit."""

    shape: dict
    color: str = style.SHELL
    opacity: float = 1.0
    at: np.ndarray = field(default_factory=lambda: np.eye(4))

    def looks(self, color=None, opacity=None):
        """The same solid in another color or opacity."""
        return replace(
            self,
            color=self.color if color is None else color,
            opacity=self.opacity if opacity is None else opacity,
        )

    def moved(self, T):
        """The same solid at T @ at; T may stretch."""
        return replace(self, at=np.asarray(T, dtype=float) @ self.at)

    def describe(self):
        return {
            "shape": self.shape,
            "color": [style.themed(self.color, False), style.themed(self.color, True)],
            "opacity": self.opacity,
            "at": [round(float(v), 6) for v in self.at.ravel()],
        }

    def triangles(self):
        """Corners of its triangles in its body, shape (n, 3, 3)."""
        kind = self.shape["kind"]
        make = {"turned": _turned, "raised": _raised, "tube": _tube}[kind]
        corners = make(**{key: np.asarray(v) for key, v in self.shape.items() if key != "kind"})
        return corners @ self.at[:3, :3].T + self.at[:3, 3]


def turned(profile):
    """A profile (n, 2) of radius and height, turned about z; listed from below it shows its outside."""
    return Solid({"kind": "turned", "profile": _rounded(profile)})


def raised(outline, bottom, top):
    """A convex outline (n, 2), counter-clockwise, raised from z = bottom to z = top."""
    return Solid({"kind": "raised", "outline": _rounded(outline), "bottom": float(bottom), "top": float(top)})


def tube(path, radius):
    """A path (n, 3) with a thickness."""
    return Solid({"kind": "tube", "path": _rounded(path), "radius": float(radius)})


def _rounded(points):
    return np.round(np.asarray(points, dtype=float), 4).tolist()


def sphere(radius, pieces=12):
    """A sphere about the origin."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, pieces + 1)
    return turned(radius * np.column_stack([np.maximum(np.cos(angle), 0), np.sin(angle)]))


def cylinder(radius, bottom, top, top_radius=None):
    """A cylinder about z from z = bottom to z = top; a cone with another radius at the top."""
    end = radius if top_radius is None else top_radius
    return turned([(0, bottom), (radius, bottom), (end, top), (0, top)])


def capsule(radius, bottom, top, pieces=6):
    """A cylinder about z with round ends, whose centers are z = bottom and z = top."""
    angle = np.linspace(0, np.pi / 2, pieces + 1)
    low = np.column_stack([radius * np.sin(angle), bottom - radius * np.cos(angle)])
    high = np.column_stack([radius * np.cos(angle), top + radius * np.sin(angle)])
    return turned([*low, *high])


def box(x, y, z):
    """A box between three pairs of bounds, or of widths about the origin."""
    (x0, x1), (y0, y1), (z0, z1) = (v if np.ndim(v) else (-v / 2, v / 2) for v in (x, y, z))
    return raised([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], z0, z1)


def plane(width, depth):
    """A sheet in the plane z = 0, about the origin."""
    return box(width, depth, (0.0, 0.0))


def between(start, end, scale=1.0):
    """The matrix that carries the unit along z from the origin to the way from start to end, (4, 4); it turns and
    stretches: x and y by `scale`.
    """
    start, way = np.asarray(start, dtype=float), np.subtract(end, start)
    length = np.linalg.norm(way)
    z = way / length if length > 0 else np.array([0.0, 0.0, 1.0])
    side = np.eye(3)[np.argmin(np.abs(z))]
    x = side - (side @ z) * z
    x /= np.linalg.norm(x)
    (zx, zy, zz), (xx, xy, xz) = z.tolist(), x.tolist()
    y = np.array([zy * xz - zz * xy, zz * xx - zx * xz, zx * xy - zy * xx])
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = scale * x, scale * y, length * z, start
    return T


# -- triangles of the kernel's picture


def _quads(corners):
    """Two triangles of each quadrilateral, (..., 4, 3) -> (n, 3, 3)."""
    corners = corners.reshape(-1, 4, 3)
    return np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])


def _turned(profile):
    if len(profile) > 9:  # a coarse picture needs fewer pieces of an arc
        profile = profile[np.unique(np.linspace(0, len(profile) - 1, 9).round().astype(int))]
    angle = np.linspace(0, 2 * np.pi, ROUND + 1)
    r, z = profile.T
    rings = np.stack([np.outer(r, np.cos(angle)), np.outer(r, np.sin(angle)), np.tile(z[:, None], ROUND + 1)], -1)
    triangles = _quads(np.stack([rings[:-1, :-1], rings[:-1, 1:], rings[1:, 1:], rings[1:, :-1]], 2))
    return triangles[_area(triangles) > 1e-12]


def _raised(outline, bottom, top):
    low, high = (np.column_stack([outline, np.full(len(outline), z)]) for z in (bottom, top))
    sides = _quads(np.stack([low, np.roll(low, -1, 0), np.roll(high, -1, 0), high], 1))
    caps = [[face[0], face[k], face[k + 1]] for face in (low[::-1], high) for k in range(1, len(outline) - 1)]
    triangles = np.concatenate([sides, caps])
    return triangles[_area(triangles) > 1e-12]


def _tube(path, radius):
    angle = np.linspace(0, 2 * np.pi, 7)
    ways = np.gradient(path, axis=0)
    side = np.eye(3)[np.argmin(np.abs(ways[0]))]
    rings = []
    for point, way in zip(path, ways):
        z = way / np.linalg.norm(way)
        side = side - (side @ z) * z
        side /= np.linalg.norm(side)
        rings.append(point + radius * (np.outer(np.cos(angle), side) + np.outer(np.sin(angle), np.cross(z, side))))
    rings = np.array(rings)
    return _quads(np.stack([rings[:-1, :-1], rings[:-1, 1:], rings[1:, 1:], rings[1:, :-1]], 2))


def _area(triangles):
    return np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=-1)
