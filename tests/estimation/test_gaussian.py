"""Outlines of Gaussian clouds against the ellipse that they become when nothing bends."""

import numpy as np
import pytest
from scipy.stats import chi2, norm

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


def test_an_ellipse_runs_once_around_at_one_distance():
    cov = np.array([[4.0, 1.5], [1.5, 1.0]])
    outline = gaussian.ellipse([3.0, -2.0], cov, 0.9, points=73)
    off = outline - [3.0, -2.0]
    np.testing.assert_allclose(np.einsum("ni,ij,nj->n", off, np.linalg.inv(cov), off), chi2.ppf(0.9, 2))
    np.testing.assert_allclose(outline[0], outline[-1])
    turned = np.unwrap(np.arctan2(off[:, 1], off[:, 0]))
    assert abs(turned[-1] - turned[0]) == pytest.approx(2 * np.pi) and np.abs(np.diff(turned)).max() < 0.4


def test_axes_that_are_too_long_are_cut_and_the_others_left():
    R = np.array([[0.6, -0.8], [0.8, 0.6]])
    cov = R @ np.diag([9.0, 0.25]) @ R.T
    np.testing.assert_allclose(gaussian.cut_axes(cov, 2.0), R @ np.diag([4.0, 0.25]) @ R.T, atol=1e-12)
    np.testing.assert_allclose(gaussian.cut_axes(cov, 5.0), cov, atol=1e-12)


def test_quantiles_and_densities_are_those_of_scipy():
    p, dof = np.array([0.0, 1e-9, 0.01, 0.5, 0.99, 1 - 1e-9, 1.0])[:, None], np.array([1, 2, 3, 1000])
    np.testing.assert_allclose(gaussian.chi_square_quantile(p, dof), chi2.ppf(p, dof), rtol=1e-9)
    np.testing.assert_allclose(gaussian.density(p, 0.3, 2.0), norm.pdf(p, 0.3, 2.0), rtol=1e-12)
    for wrong in ((1.1, 2), (-0.1, 2), (0.5, 0), (np.nan, 2)):
        with pytest.raises(ValueError, match="probability"):
            gaussian.chi_square_quantile(*wrong)
    with pytest.raises(ValueError, match="std must be positive"):
        gaussian.density(0.0, 0.0, 0.0)
