"""Normal distributions: noise that repeats, the ellipse that holds a stated share, and who lies in it."""

import functools

import numpy as np
from scipy.stats import chi2

from ..checks import as_count, as_covariances, as_points, as_probability, as_shape, fit_together, solve_covariance
from ..geometry import planar


@functools.cache
def unit_noise(shape, seed):
    """Independent normal numbers of standard deviation 1: the same for a shape and a seed, and read-only.

    A figure that scales them shows the change alone: what is dragged moves, the draw stays.

    Parameters
    ----------
    shape : tuple of int
    seed : int

    Returns
    -------
    noise : array of that shape, read-only
    """
    noise = np.random.default_rng(seed).standard_normal(shape)
    noise.setflags(write=False)
    return noise


def ellipse(mean, cov, probability=0.95, points=61):
    """Closed outline of the region of a plane normal distribution, (..., points, 2).

    mean : (..., 2).    cov : (..., 2, 2).    probability : share of the distribution inside the outline.
    """
    mean, cov = as_points(mean, "mean", 2), as_covariances(cov, "cov", 2)
    probability, points = as_probability(probability, "probability"), as_count(points, "points")
    fit_together(mean=mean.shape[:-1], cov=cov.shape[:-2])
    values, vectors = np.linalg.eigh(cov)
    axes = vectors * np.sqrt(np.maximum(values, 0.0) * chi2.ppf(probability, 2))[..., None, :]
    angle = np.linspace(0, 2 * np.pi, points)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    return mean[..., None, :] + np.swapaxes(axes @ circle, -1, -2)


def outlines(mean, cov, probability=0.95, points=61):
    """Many ellipses as one line, (n (points + 1), 2), a row of NaN after each: one artist draws them all."""
    curves = ellipse(mean, cov, probability, points)
    gaps = np.full((*curves.shape[:-2], 1, 2), np.nan)
    return np.concatenate([curves, gaps], axis=-2).reshape(-1, 2)


def share_inside(samples, mean, cov, probability=0.95):
    """Share of samples, (n, dim), inside the region that should hold `probability` of them."""
    mean = as_shape(mean, "mean", "dim")
    d = as_shape(samples, "samples", "n", len(mean)) - mean
    if not d.size:
        raise ValueError("samples must hold at least one, got none")
    probability = as_probability(probability, "probability")
    squared = (d * solve_covariance(as_shape(cov, "cov", len(mean), len(mean)), "cov", d.T).T).sum(-1)
    return float((squared <= chi2.ppf(probability, d.shape[-1])).mean())


def bent_region(mean, ends, probability=0.95, points=61):
    """Outline in the plane of the region that is an ellipse in exponential coordinates about `mean`, and their moments.

    Returns (outline (points, 2), mean (3,), covariance (3, 3)) of the exponential coordinates of the ends.
    """
    xi = planar.log_pose(planar.relative_pose(mean, ends))
    center, cov = xi.mean(0), np.cov(xi.T)
    values, vectors = np.linalg.eigh(cov)
    angle = np.linspace(0, 2 * np.pi, points)[:, None]
    radius = np.sqrt(-2 * np.log(1 - probability))
    ring = np.cos(angle) * np.sqrt(values[2]) * vectors[:, 2] + np.sin(angle) * np.sqrt(values[1]) * vectors[:, 1]
    return planar.compose_pose(mean, planar.exp_pose(center + radius * ring))[:, :2], center, cov
