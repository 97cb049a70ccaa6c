"""Write points.csv: eight synthetic three-point measurements whose transforms are the four printed ones.

    python data/chaining/make_points.py

Station s measures K_s and K_s+1. The stand of the measuring arm and the size of the triangles are invented (seed
below). Within the plane of a triangle, x_point slides along x and y_point in the plane by noise of 0.2 mm: that
leaves the frame alone. The rest of the noise is what the printed transforms carry: the second frame is the first
times a link inside the rounding of the printed one, and the four links are chosen, by linear programming, so that
their product rounds to the printed product as well.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.optimize import linprog

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent.parent))

from labkit.documents.lab_sheet import printed as lab_sheet
from labkit.geometry import chaining
from labkit.geometry.frames import relative, transform
from labkit.geometry.lie import exp_se3

SEED = 2016
STD_IN_PLANE = 0.2  # mm


def unrounded_links(printed, product):
    """Rigid links whose entries, and those of their product, are off the printed ones by as little as possible."""
    links = chaining.orthonormalize(printed)

    def deviations(links, x):
        moved = links @ exp_se3(np.reshape(x, (4, 6)))
        return np.concatenate([(moved - printed)[:, :3].ravel(), (chaining.chain(moved) - product)[:3].ravel()])

    for _ in range(3):  # linear in the corrections, which are around 1e-6
        step, now = 1e-4, deviations(links, np.zeros(24))
        J = [(deviations(links, step * e) - deviations(links, -step * e)) / (2 * step) for e in np.eye(24)]
        J, ones = np.column_stack(J), np.ones((len(now), 1))
        fit = linprog(
            [0.0] * 24 + [1.0],
            A_ub=np.block([[J, -ones], [-J, -ones]]) * 1e6,
            b_ub=np.concatenate([-now, now]) * 1e6,
            bounds=[(-1e-2, 1e-2)] * 24 + [(0, None)],
        )
        links = links @ exp_se3(fit.x[:24].reshape(4, 6))
    return links


def lines():
    """The lines of points.csv."""
    rng = np.random.default_rng(SEED)
    links = unrounded_links(lab_sheet.printed_transforms(), lab_sheet.printed_product())
    poses = chaining.stations(links)
    triangles = np.array(
        [[[0, 0, 0], [rng.uniform(80, 120), 0, 0], [*rng.uniform((5, 60), (30, 90)), 0]] for _ in range(4)]
    )
    center = poses[:4, :3, 3].mean(0)
    yield "station,frame,point,x,y,z"
    for s in range(4):
        middle = poses[s : s + 2, :3, 3].mean(0)
        stand = exp_se3(np.concatenate([rng.normal(0, [0.02, 0.02, 1.0]), np.zeros(3)]))
        stand[:3, 3] = middle + 180 * (middle - center) / np.linalg.norm(middle - center) - [0, 0, 120]
        for k in (s, s + 1):
            triangle = triangles[k % 4].copy()
            triangle[1, 0] += rng.normal(0, STD_IN_PLANE)
            triangle[2, :2] += rng.normal(0, STD_IN_PLANE, 2)
            points = transform(relative(stand, poses[s]), transform(links[s], triangle) if k > s else triangle)
            for name, p in zip(("origin", "x_point", "y_point"), points):
                yield f"{s + 1},K{k % 4},{name},{p[0]:.9f},{p[1]:.9f},{p[2]:.9f}"


if __name__ == "__main__":
    (HERE / "points.csv").write_text("\n".join(lines()) + "\n", encoding="utf-8")
