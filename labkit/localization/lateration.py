"""Lateration: where a robot is, from its distances to landmarks whose positions are known.

Landmarks are (n, dim) points (m), distances (..., n) (m), positions (..., dim); dim is 2 or 3. Distances do not see the
orientation of the robot. Source: lecture "Lokalisierung", section "Laterationsverfahren".
"""

from dataclasses import dataclass

import numpy as np

from ..checks import (
    as_choice,
    as_count,
    as_finite,
    as_number,
    as_points,
    as_positive,
    as_positive_number,
    as_shape,
    fit_together,
    shown,
)

COSTS = ("distance", "squares")
RANK_TOLERANCE = 1e-7  # a second singular value below this share of the first: the landmarks do not fix the position


@dataclass(frozen=True, eq=False)
class NewtonPath:
    """A Newton iteration.

    Attributes
    ----------
    path : array, shape (k, dim), m
        From start to end.
    converged : bool
    reason : str
        In words, why it stopped.
    """

    path: np.ndarray
    converged: bool
    reason: str

    @property
    def position(self):
        """The last point of the path (m)."""
        return self.path[-1]


@dataclass(frozen=True, eq=False)
class Lateration:
    """A position by least squares.

    Attributes
    ----------
    position : array, shape (..., dim), m
    residuals : array, shape (..., n), m
        Measured minus computed distance.
    covariance : array, shape (..., dim, dim), m^2
        Infinite where the geometry does not fix the position.
    singular_values : array, shape (..., dim)
        Of the unit vectors to the landmarks.
    iterations : int
        Of the slowest run.
    converged : bool array, shape (...)
        Whether each run stopped at a minimum.
    """

    position: np.ndarray
    residuals: np.ndarray
    covariance: np.ndarray
    singular_values: np.ndarray
    iterations: int
    converged: np.ndarray


def _landmarks(landmarks, distances):
    landmarks = as_finite(landmarks, "landmarks")
    if landmarks.ndim != 2 or landmarks.shape[1] not in (2, 3):
        raise ValueError(f"landmarks must have shape (n, 2) or (n, 3), got {landmarks.shape}")
    distances = as_positive(distances, "distances")
    if distances.ndim < 1 or distances.shape[-1] != len(landmarks):
        raise ValueError(f"distances must have shape (..., {len(landmarks)}), one per landmark, got {distances.shape}")
    needed = landmarks.shape[1]
    if len(landmarks) < needed:
        raise ValueError(f"a position in {needed}D needs at least {needed} landmarks, got {len(landmarks)}")
    return landmarks, distances


def square_residuals(landmarks, distances, position):
    """The lecture's equations |landmark - position|^2 - distance^2, zero where all circles meet.

    Parameters
    ----------
    landmarks : array-like, shape (n, dim)
        Positions (m).
    distances : array-like, shape (..., n)
        Measured distances (m).
    position : array-like, shape (..., dim)
        Where the equations are evaluated (m).

    Returns
    -------
    f : array, shape (..., n)
        In m^2.

    Source: lecture, "Algorithmus fuer 2D-Lateration".
    """
    landmarks, distances = _landmarks(landmarks, distances)
    position = as_points(position, "position", landmarks.shape[1])
    fit_together(distances=distances.shape[:-1], position=position.shape[:-1])
    return ((landmarks - position[..., None, :]) ** 2).sum(-1) - distances**2


def square_jacobian(landmarks, position):
    """Derivative of `square_residuals` by the position: rows 2 (position - landmark).

    Parameters
    ----------
    landmarks, position : array-like, shapes (n, dim) and (..., dim)
        In m.

    Returns
    -------
    J : array, shape (..., n, dim)
        In m.

    Raises
    ------
    ValueError
        Landmarks that are no list of points.
    """
    landmarks = as_finite(landmarks, "landmarks")
    if landmarks.ndim != 2:
        raise ValueError(f"landmarks must have shape (n, dim), got {landmarks.shape}")
    position = as_points(position, "position", landmarks.shape[-1])
    return 2 * (position[..., None, :] - landmarks)


def newton_lateration(landmarks, distances, start, steps=50, tolerance=1e-12):
    """Newton's method on the lecture's equations with as many landmarks as coordinates.

    Two circles meet in two points; the start decides which one is found. On the line through both landmarks the
    Jacobian loses its rank; the iteration stops there and says so.

    Parameters
    ----------
    landmarks : array-like, shape (dim, dim)
        Positions (m).
    distances : array-like, shape (dim,)
        Measured distances (m).
    start : array-like, shape (dim,)
        Where the search starts (m).
    steps : int
        At most so many.
    tolerance : float
        A step shorter than this share of the scene ends the search.

    Returns
    -------
    NewtonPath

    Raises
    ------
    ValueError
        Wrong shapes, more landmarks than coordinates.

    Source: lecture, "Algorithmus fuer 2D-Lateration".
    """
    landmarks, distances = _landmarks(landmarks, distances)
    if len(landmarks) != landmarks.shape[1] or distances.ndim != 1:
        raise ValueError(
            f"newton needs as many landmarks as coordinates and one set of distances, got {len(landmarks)} landmarks "
            f"in {landmarks.shape[1]}D and distances of shape {distances.shape}; use laterate"
        )
    path = [as_shape(start, "start", landmarks.shape[1])]
    steps, tolerance = as_count(steps, "steps", at_least=0), as_number(tolerance, "tolerance")
    scale = np.abs(landmarks - landmarks.mean(0)).max() + distances.max()
    for _ in range(steps):
        J = square_jacobian(landmarks, path[-1])
        values = np.linalg.svd(J, compute_uv=False)
        if values[-1] <= RANK_TOLERANCE * values[0]:
            return NewtonPath(np.array(path), False, "singular: start and landmarks lie on one line")
        path.append(path[-1] - np.linalg.solve(J, square_residuals(landmarks, distances, path[-1])))
        if np.abs(path[-1] - path[-2]).max() <= tolerance * scale:
            return NewtonPath(np.array(path), True, "the step is below the tolerance")
    return NewtonPath(np.array(path), False, f"no convergence in {steps} steps: the circles may not meet")


def _two_circles(landmarks, distances):
    landmarks, distances = _landmarks(landmarks, distances)
    if landmarks.shape != (2, 2) or distances.shape != (2,):
        raise ValueError(f"two landmarks and two distances expected, got shapes {landmarks.shape}, {distances.shape}")
    return landmarks, distances


def circle_intersections(landmarks, distances):
    """Both points where two circles meet, in closed form; the first lies left of the way from landmark 1 to 2.

    Parameters
    ----------
    landmarks, distances : array-like, shapes (2, 2) and (2,)
        Centers and radii (m).

    Returns
    -------
    points : array, shape (2, 2)

    Raises
    ------
    ValueError
        Where the circles do not meet, or have one center.
    """
    (a, b), (r1, r2) = _two_circles(landmarks, distances)
    along = b - a
    base = np.hypot(*along)
    if base == 0 or not abs(r1 - r2) <= base <= r1 + r2:
        raise ValueError(
            f"the circles do not meet in two points: radii {shown(r1)} and {shown(r2)} m, centers {shown(base)} m apart"
        )
    foot = (r1**2 - r2**2 + base**2) / (2 * base)
    height = np.sqrt(max(0.0, r1**2 - foot**2))
    along = along / base
    across = np.array([-along[1], along[0]])
    return a + foot * along + np.array([[height], [-height]]) * across


def linear_start(landmarks, distances):
    """Position from the differences of the squared equations, which are linear; a start for `laterate`.

    Subtracting the mean equation removes |position|^2.

    Parameters
    ----------
    landmarks, distances : array-like, shapes (n, dim) and (..., n)
        In m.

    Returns
    -------
    position : array, shape (..., dim)

    Raises
    ------
    ValueError
        Where the landmarks lie on one line (in 3D: in one plane): then the mirror image fits as well, and a linear
        equation cannot choose.
    """
    landmarks, distances = _landmarks(landmarks, distances)
    mean = landmarks.mean(0)
    centered = landmarks - mean
    values = np.linalg.svd(centered, compute_uv=False)
    if len(landmarks) <= landmarks.shape[1] or values[-1] <= RANK_TOLERANCE * values[0]:
        raise ValueError(
            "the landmarks are too few or lie on one line: the mirror image fits as well, give laterate a start"
        )
    right = 0.5 * ((centered**2).sum(1) - distances**2)
    right = right - right.mean(-1, keepdims=True)
    return mean + right @ np.linalg.pinv(centered).T


def _errors(landmarks, distances, x, cost):
    """Residuals and Jacobian of the chosen cost, (..., n) and (..., n, dim)."""
    away = x[..., None, :] - landmarks
    length = np.sqrt((away**2).sum(-1))
    if cost == "squares":
        return length**2 - distances**2, 2 * away
    return length - distances, away / np.maximum(length, 1e-300)[..., None]


def laterate(landmarks, distances, start=None, cost="distance", std=1.0, steps=100):
    """Position by least squares from two or more distances: Levenberg-Marquardt, all runs at once.

    Parameters
    ----------
    landmarks : array-like, shape (n, dim)
        Positions (m).
    distances : array-like, shape (..., n)
        Measured distances (m).
    start : array-like, shape (..., dim), optional
        Where the search starts (m); `linear_start` by default.
    cost : {"distance", "squares"}
        Sum (length - distance)^2, maximum likelihood for equal Gaussian noise on the distances, or the lecture's
        (length^2 - distance^2)^2, which weighs each landmark with its squared distance.
    std : float
        Standard deviation of a distance (m), for the covariance.
    steps : int
        At most so many.

    Returns
    -------
    Lateration

    Raises
    ------
    ValueError
        Wrong shapes, distances that are not positive, no start where landmarks on one line need one.

    Source: lecture, "Least-Square-Verfahren bei mehr als 2 Landmarken" (the cost "squares").
    """
    landmarks, distances = _landmarks(landmarks, distances)
    cost = as_choice(cost, "cost", COSTS)
    std, dim, steps = as_positive_number(std, "std"), landmarks.shape[1], as_count(steps, "steps")
    x = linear_start(landmarks, distances) if start is None else as_points(start, "start", dim)
    x = np.broadcast_to(x, (*fit_together(start=x.shape[:-1], distances=distances.shape[:-1]), dim)).copy()
    x, iterations, converged = _minimize(landmarks, distances, x, cost, steps)
    e, J = _errors(landmarks, distances, x, "distance")
    values = np.linalg.svd(J, compute_uv=False)
    fixed = values[..., -1] > RANK_TOLERANCE * values[..., 0]
    if cost == "distance":
        gain = np.linalg.pinv(J)
    else:
        gain = np.linalg.pinv(_errors(landmarks, distances, x, cost)[1]) * (2 * distances)[..., None, :]
    covariance = std**2 * gain @ np.swapaxes(gain, -1, -2)
    covariance = np.where(fixed[..., None, None], covariance, np.inf)
    return Lateration(x, -e, covariance, values, iterations, converged)


def _minimize(landmarks, distances, x, cost, steps):
    """Levenberg-Marquardt with one damping per run; returns positions, iterations, converged."""
    eye, size = np.eye(x.shape[-1]), np.abs(landmarks - landmarks.mean(0)).max() + distances.max(initial=0.0)
    damping = np.full(x.shape[:-1], 1e-3)
    e, J = _errors(landmarks, distances, x, cost)
    value, done = (e**2).sum(-1), np.zeros(x.shape[:-1], bool)
    for k in range(1, steps + 1):
        N = np.swapaxes(J, -1, -2) @ J
        scale = np.trace(N, axis1=-2, axis2=-1) / x.shape[-1]
        g = np.einsum("...ni,...n->...i", J, e)
        delta = -np.linalg.solve(N + (damping * scale + 1e-300)[..., None, None] * eye, g[..., None])[..., 0]
        tried = x + np.where(done[..., None], 0.0, delta)
        e2, J2 = _errors(landmarks, distances, tried, cost)
        value2 = (e2**2).sum(-1)
        small = np.abs(delta).max(-1) <= 1e-11 * (size + np.abs(x).max(-1))
        better = value2 <= value
        x, J = np.where(better[..., None], tried, x), np.where(better[..., None, None], J2, J)
        e, value = np.where(better[..., None], e2, e), np.where(better, value2, value)
        damping = np.clip(np.where(better, damping / 10, damping * 10), 1e-12, 1e12)
        done = done | small
        if done.all():
            return x, k, done
    return x, steps, done


def dilution(landmarks, position):
    """Dilution of precision at a position: the covariance per unit distance variance, without unit.

    The inverse of the sum of u u' over the unit vectors u to the landmarks. The root of its trace times the standard
    deviation of a distance is the position's RMS error; std^2 times the matrix is the Cramer-Rao bound.

    Parameters
    ----------
    landmarks, position : array-like, shapes (n, dim) and (..., dim)
        In m.

    Returns
    -------
    dilution : array, shape (..., dim, dim)

    Raises
    ------
    ValueError
        Where position and landmarks lie on one line (in 3D: the unit vectors in one plane).
    """
    landmarks = as_finite(landmarks, "landmarks")
    if landmarks.ndim != 2:
        raise ValueError(f"landmarks must have shape (n, dim), got {landmarks.shape}")
    position = as_points(position, "position", landmarks.shape[-1])
    away = position[..., None, :] - landmarks
    length = np.linalg.norm(away, axis=-1, keepdims=True)
    if (length == 0).any():
        raise ValueError("the position coincides with a landmark: its direction is undefined there")
    U = away / length
    values = np.linalg.svd(U, compute_uv=False)
    if values.shape[-1] < U.shape[-1] or (values[..., -1] <= RANK_TOLERANCE * values[..., 0]).any():
        raise ValueError("position and landmarks lie on one line: the distances do not fix the position across it")
    return np.linalg.inv(np.swapaxes(U, -1, -2) @ U)
