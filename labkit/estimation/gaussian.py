"""Normal distributions: noise that repeats, the ellipse that holds a stated share, and who lies in it."""

import functools
from dataclasses import dataclass

import numpy as np
from scipy import special

from ..checks import (
    as_covariances,
    as_finite,
    as_points,
    as_positive_number,
    as_probability,
    as_shape,
    as_size,
    covariance_root,
    fit_together,
    solve_covariance,
)
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


def density(x, mean, std):
    """Height of the normal density at x.

    Parameters
    ----------
    x, mean : float or array-like
    std : float

    Returns
    -------
    height : array

    Raises
    ------
    ValueError
        A standard deviation that is not positive.
    """
    x, mean, std = as_finite(x, "x"), as_finite(mean, "mean"), as_positive_number(std, "std")
    fit_together(x=x.shape, mean=mean.shape)
    return np.exp(-0.5 * ((x - mean) / std) ** 2) / (std * np.sqrt(2 * np.pi))


def chi_square_quantile(probability, dof):
    """What a sum of squares of standard normal numbers stays below with a probability.

    SciPy's `stats.chi2.ppf`; the import of `scipy.stats` would take longer than all else that a command imports.

    Parameters
    ----------
    probability : float or array-like
    dof : int or array-like
        How many numbers.

    Returns
    -------
    limit : float or array
        Infinite for the probability 1.

    Raises
    ------
    ValueError
        A probability outside 0 to 1, no number at all.
    """
    probability, dof = as_finite(probability, "probability"), as_finite(dof, "dof")
    fit_together(probability=probability.shape, dof=dof.shape)
    if ((probability < 0) | (probability > 1)).any() or (dof <= 0).any():
        raise ValueError("probability must lie between 0 and 1, and dof be positive")
    return 2 * special.gammaincinv(dof / 2, probability)


def ellipse(mean, cov, probability=0.95, points=61):
    """Closed outline of the region of a normal distribution in the plane.

    Parameters
    ----------
    mean : array-like, shape (..., 2)
        Its center.
    cov : array-like, shape (..., 2, 2)
        Its covariance.
    probability : float
        Share of the distribution inside the outline.
    points : int
        Number of points of the outline, the last equal to the first.

    Returns
    -------
    outline : array, shape (..., points, 2)

    Raises
    ------
    ValueError
        Wrong shapes, a negative variance, a probability that is none.
    """
    mean, cov = as_points(mean, "mean", 2), as_covariances(cov, "cov", 2)
    probability, points = as_probability(probability, "probability"), as_size(points, "points")
    fit_together(mean=mean.shape[:-1], cov=cov.shape[:-2])
    values, vectors = np.linalg.eigh(cov)
    axes = vectors * np.sqrt(np.maximum(values, 0.0) * chi_square_quantile(probability, 2))[..., None, :]
    angle = np.linspace(0, 2 * np.pi, points)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    return mean[..., None, :] + np.swapaxes(axes @ circle, -1, -2)


def cut_axes(cov, longest):
    """Covariance of the same axes, none of whose standard deviations exceeds a limit: what still fits a picture.

    Parameters
    ----------
    cov : array-like, shape (..., n, n)
    longest : float
        The largest standard deviation, in the unit of the variables.

    Returns
    -------
    cut : array, shape (..., n, n)

    Raises
    ------
    ValueError
        A wrong shape, a limit that is not positive.
    """
    cov = as_finite(cov, "cov")
    if not cov.ndim:
        raise ValueError("cov must have shape (..., n, n), got ()")
    cov, longest = as_covariances(cov, "cov", cov.shape[-1]), as_positive_number(longest, "longest")
    values, axes = np.linalg.eigh(cov)
    return (axes * np.minimum(values, longest**2)[..., None, :]) @ np.swapaxes(axes, -1, -2)


def outlines(mean, cov, probability=0.95, points=61):
    """Many ellipses as one line, a row of NaN after each, so that one artist draws them all.

    The parameters are those of `ellipse`, with n ellipses.

    Returns
    -------
    line : array, shape (n (points + 1), 2)
    """
    curves = ellipse(mean, cov, probability, points)
    gaps = np.full((*curves.shape[:-2], 1, 2), np.nan)
    return np.concatenate([curves, gaps], axis=-2).reshape(-1, 2)


def share_inside(samples, mean, cov, probability=0.95):
    """Share of samples inside the region that should hold `probability` of them.

    Parameters
    ----------
    samples : array-like, shape (n, dim)
    mean, cov : array-like, shapes (dim,) and (dim, dim)
        Of the normal distribution.
    probability : float
        Share of the distribution inside its region.

    Returns
    -------
    share : float

    Raises
    ------
    ValueError
        Wrong shapes, no sample, a covariance that is not symmetric and positive definite.
    """
    mean = as_shape(mean, "mean", "dim")
    d = as_shape(samples, "samples", "n", len(mean)) - mean
    if not d.size:
        raise ValueError("samples must hold at least one, got none")
    probability = as_probability(probability, "probability")
    cov = as_shape(as_covariances(cov, "cov", len(mean)), "cov", len(mean), len(mean))
    covariance_root(cov, "cov")  # refuses one that is not positive definite
    squared = (d * solve_covariance(cov, "cov", d.T).T).sum(-1)
    return float((squared <= chi_square_quantile(probability, d.shape[-1])).mean())


@dataclass(frozen=True, eq=False)
class BentRegion:
    """A region of poses that is an ellipse in exponential coordinates about a pose.

    Attributes
    ----------
    outline : array, shape (points, 2), m
        In the plane.
    twists : array, shape (n, 3)
        Exponential coordinates of the samples, as `planar.log_pose` gives them.
    mean, cov : arrays, shapes (3,) and (3, 3)
        Moments of the twists.
    """

    outline: np.ndarray
    twists: np.ndarray
    mean: np.ndarray
    cov: np.ndarray


def bent_region(pose, ends, probability=0.95, points=61):
    """The region of many poses that is an ellipse in exponential coordinates about one of them.

    Parameters
    ----------
    pose : array-like, shape (3,)
        Where the coordinates start (m, m, rad).
    ends : array-like, shape (n, 3)
        Sampled poses, at least two.
    probability : float
        Share inside the outline of the two widest directions, in their plane.
    points : int
        Number of points of the outline.

    Returns
    -------
    BentRegion

    Raises
    ------
    ValueError
        Wrong shapes, fewer than two poses, a probability that is none.
    """
    pose, ends = as_shape(pose, "pose", 3), as_shape(ends, "ends", "n", 3)
    if len(ends) < 2:
        raise ValueError(f"ends must hold at least two poses, got {len(ends)}")
    probability, points = as_probability(probability, "probability"), as_size(points, "points")
    twists = planar.log_pose(planar.relative_pose(pose, ends))
    mean, cov = twists.mean(0), np.cov(twists.T)
    values, vectors = np.linalg.eigh(cov)
    angle = np.linspace(0, 2 * np.pi, points)
    circle = np.stack([np.sin(angle), np.cos(angle)])
    ring = (vectors[:, 1:] * np.sqrt(np.maximum(values[1:], 0.0) * chi_square_quantile(probability, 2)) @ circle).T
    return BentRegion(planar.compose_pose(pose, planar.exp_pose(mean + ring))[:, :2], twists, mean, cov)
