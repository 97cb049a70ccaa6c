"""Outlines of Gaussian clouds against the ellipse that they become when nothing bends."""

import numpy as np
from scipy.stats import chi2

from labkit.estimation import gaussian
from labkit.geometry.planar import compose_pose


def test_a_bent_region_of_straight_poses_is_the_ellipse():
    rng = np.random.default_rng(0)
    pose = np.array([3.0, -2.0, 0.7])
    ends = compose_pose(pose, rng.normal(size=(300, 3)) * [0.5, 0.2, 1e-7] + [4.0, 1.0, 0.0])
    outline = gaussian.bent_region(pose, ends, 0.9, 181).outline
    mean, cov = ends[:, :2].mean(0), np.cov(ends[:, :2].T)
    offsets = outline - mean
    distances = np.einsum("ni,ij,nj->n", offsets, np.linalg.inv(cov), offsets)
    np.testing.assert_allclose(distances, chi2.ppf(0.9, 2), rtol=1e-4)
    np.testing.assert_allclose(outline[0], outline[-1], atol=1e-9)  # closed, once around
    x, y = offsets.T
    area = 0.5 * abs(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))
    np.testing.assert_allclose(area, np.pi * chi2.ppf(0.9, 2) * np.sqrt(np.linalg.det(cov)), rtol=1e-3)
