"""Chained transforms: the product around a loop, its closure error, how it grows, and how to share it out.

A loop of N links T_01, T_12, ... T_(N-1)0 should multiply to the identity; what is left is the closure error. Noise
is meant link by link: T_k exp(xi_k) with a twist xi_k = (phi, rho) of independent components. Lengths in mm, angles
in radians. Source: lab sheet "Kalibrierung", Hochschule Darmstadt 2016, section 2.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from ..checks import (
    as_count,
    as_finite,
    as_generator,
    as_items,
    as_matrices,
    as_number,
    as_points,
    as_positive_number,
    as_shape,
    as_size,
    as_transforms,
    fit_together,
    kind,
    shown,
)
from .frames import frame_from_points, invert, relative, rotation_angle, rotation_block, transform
from .lie import adjoint, exp_se3, log_se3, nearest_rotation, skew


def transforms_from_points(points):
    """Transform from the first to the second frame of each station; (..., 2, 3, 3) points -> (..., 4, 4).

    The last axes are frame, point (origin, x_point, y_point) and coordinate. Source: lab sheet, section 2, listing 5.
    """
    points = as_points(points, "points")
    if points.shape[-3:] != (2, 3, 3):
        raise ValueError(f"points must have shape (..., 2, 3, 3): frame, point, coordinate, got {points.shape}")
    first, second = (frame_from_points(*(points[..., f, p, :] for p in range(3))) for f in range(2))
    return relative(first, second)


def _links(transforms, at_least=1):
    if isinstance(transforms, np.ndarray) and transforms.ndim > 2:
        links = list(as_transforms(transforms, "transforms"))  # one check for all
    else:
        if not np.iterable(transforms):
            raise ValueError(f"transforms must be a sequence of transforms, got {type(transforms).__name__}")
        links = [as_transforms(T, f"transforms[{k}]") for k, T in enumerate(transforms)]
        if len({T.shape for T in links}) > 1:
            fit_together(**{f"transforms[{k}]": T.shape[:-2] for k, T in enumerate(links)})
    if len(links) < at_least:
        raise ValueError(f"at least {at_least} transform{'s' * (at_least > 1)} must come, got {len(links)}")
    return links


def chain(transforms):
    """Product of transforms in the order given: T_AB, T_BC, T_CD -> T_AD.

    Parameters
    ----------
    transforms : sequence of array-like, each (..., 4, 4)
        The links; stacks are multiplied element by element.

    Returns
    -------
    T : array, shape (..., 4, 4)

    Source: lab sheet, section 2, listing 6 (the formula above it prints a sum sign; the listing multiplies).
    """
    links = _links(transforms)
    product = links[0]
    for T in links[1:]:
        product = product @ T
    return product


def stations(transforms):
    """Poses of all frames of a chain, seen from the first: I, T_01, T_01 T_12, ...; N links -> (N + 1, ..., 4, 4)."""
    links = _links(transforms)
    poses = [np.broadcast_to(np.eye(4), links[0].shape)]
    for T in links:
        poses.append(poses[-1] @ T)
    return np.array(poses)


def closure_error(T):
    """How far a loop's product T is from the identity: (angle in rad, distance in the unit of T), shapes (...)."""
    T = as_transforms(T, "T")
    return rotation_angle(T), np.linalg.norm(T[..., :3, 3], axis=-1)


def displacement(T, points):
    """How far T moves each point, |T p - p|: the closure error at the work piece.

    Parameters
    ----------
    T : array-like, shape (..., 4, 4)
    points : array-like, shape (..., 3), mm

    Returns
    -------
    distance : array, shape (...), mm
    """
    points = as_points(points, "points")
    return np.linalg.norm(transform(T, points) - points, axis=-1)


def orthonormality_error(T):
    """Largest entry of |R'R - I| of the rotation block; (..., 4, 4) or (..., 3, 3) -> (...)."""
    R = rotation_block(T)
    return np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max((-1, -2))


def orthonormalize(T):
    """`T` with its rotation block replaced by the nearest rotation matrix (Frobenius norm, by SVD); (..., 4, 4).

    Raises
    ------
    ValueError
        When the rotation block is singular or left-handed: then no rotation is meant.
    """
    T = as_matrices(T, "T", 4, 4)
    det = np.linalg.det(T[..., :3, :3])
    if (det <= 1e-9).any():
        raise ValueError(f"T must have a right-handed rotation block, but its determinant is {shown(det.min(), '.3g')}")
    repaired = T.copy()
    repaired[..., :3, :3] = nearest_rotation(T[..., :3, :3])
    return repaired


def rounding_bound(transforms, half_unit):
    """How far rounding of the printed links can move each entry of their product, to first order.

    Every entry of every link (the last row is exact) may be off by `half_unit`. An error E in link k arrives in the
    product as (links before k) E (links after k): the lever. The bound adds the absolute values over all links.

    Parameters
    ----------
    transforms : sequence of array-like, each (4, 4)
    half_unit : float
        Half a unit in the last printed digit.

    Returns
    -------
    bound : array, shape (4, 4)
    """
    links = [as_shape(T, "transforms", 4, 4) for T in _links(transforms)]
    E = np.zeros((4, 4))
    E[:3] = as_positive_number(half_unit, "half_unit")
    bound = np.zeros((4, 4))
    for k in range(len(links)):
        before = chain(links[:k]) if k else np.eye(4)
        after = chain(links[k + 1 :]) if k + 1 < len(links) else np.eye(4)
        bound += np.abs(before) @ E @ np.abs(after)
    return bound


def distribute_closure(transforms, shares=None):
    """Correct the links of a loop so that their product is the identity and each link takes its share of the error.

    The product is exp(xi). The pose after link k is moved by exp(-s_k xi), where s_k is the sum of the shares up to
    k; so the change of link k, seen from the first frame, is the same screw exp(-share_k xi) for all links, and its
    angle is share_k times the closure angle.

    Parameters
    ----------
    transforms : sequence of array-like, each (..., 4, 4)
        The links of a loop, in order. Rotation blocks that printing has rounded are orthonormalized first.
    shares : array-like, shape (N,), optional
        Share of each link, not negative; scaled to the sum 1. Equal by default.

    Returns
    -------
    corrected : array, shape (N, ..., 4, 4)

    Raises
    ------
    ValueError
        When the closure angle is within 0.001 rad of pi, where the direction of the correction is arbitrary.
    """
    links = orthonormalize(np.array(np.broadcast_arrays(*_links(transforms))))
    poses = stations(links)
    N = len(links)
    shares = np.ones(N) if shares is None else as_points(shares, "shares", dim=N)
    if shares.ndim != 1 or (shares < 0).any() or shares.sum() <= 0:
        raise ValueError(f"shares must be {N} numbers, none negative and not all zero, got {shown(shares)}")
    angle = rotation_angle(poses[-1]).max(initial=0)
    if angle > np.pi - 1e-3:
        raise ValueError(
            f"the loop misses by {shown(np.rad2deg(angle), '.1f')} deg: half a turn has no nearest way back"
        )
    moved = np.concatenate([[0.0], np.cumsum(shares / shares.sum())])
    twist = log_se3(poses[-1])
    corrected = exp_se3(-moved.reshape(-1, *[1] * twist.ndim) * twist) @ poses
    return relative(corrected[:-1], corrected[1:])


def around(links, loop):
    """The links of one loop of a graph in their order, those that are passed backward inverted.

    Parameters
    ----------
    links : array-like, shape (n, ..., 4, 4)
        Of the whole graph.
    loop : sequence of (k, forward)
        Number of each link, from 0, and whether it is passed forward.

    Returns
    -------
    ordered : array, shape (len(loop), ..., 4, 4)

    Raises
    ------
    ValueError
        A loop that is none, or names a link that is not there.
    """
    links = _stack(links)
    numbers, forward = _loop(loop, len(links))
    ordered = links[numbers]
    return np.where(np.reshape(forward, (-1, *[1] * (ordered.ndim - 1))), ordered, invert(ordered))


def _stack(links):
    links = _links(links)
    if len({T.shape for T in links}) > 1:
        raise ValueError(f"all links must have one shape, got {[T.shape for T in links]}")
    return np.array(links)


def _loop(loop, count):
    """Numbers and directions of a loop's links."""
    try:
        numbers, forward = zip(*loop)
    except (TypeError, ValueError):
        said = f"a loop must be a sequence of pairs (number of the link, forward), got {kind(loop)}"
        raise ValueError(said) from None
    numbers = [as_count(k, "the number of a link", at_least=-count) for k in numbers]
    if max(numbers) >= count:
        raise ValueError(f"a loop must name links from 0 to {count - 1}, got {max(numbers)}")
    return numbers, forward


def distribute_in_turn(links, loops):
    """Share out the closure error of several loops one after another.

    Each loop closes when its turn comes. A link that two loops share is changed twice: the earlier loop opens again.

    Parameters
    ----------
    links : sequence of array-like, each (4, 4)
        All measured links of a graph.
    loops : sequence of loops
        Each a sequence of (k, forward): which link, and whether along its direction.

    Returns
    -------
    corrected : array, shape (m, 4, 4)

    Raises
    ------
    ValueError
        Links that are no stack of poses, loops that are none.
    """
    links = _stack(links)
    if np.ndim(links) != 3:
        raise ValueError(f"links must have shape (m, 4, 4), got {links.shape}")
    for loop in as_items(loops, "loops", "loops"):
        corrected = distribute_closure(around(links, loop))
        for k, forward, T, back in zip(*_loop(loop, len(links)), corrected, invert(corrected)):
            links[k] = T if forward else back
    return links


def expected_closure(transforms, std_rot, std_trans):
    """Closure error to expect from noisy links, to first order.

    Angles add like random steps; a turn at frame k moves the end of the chain by its lever l_k, the distance from
    frame k to the end:

        angle^2    = 3 N std_rot^2
        distance^2 = 3 N std_trans^2 + 2 std_rot^2 sum |l_k|^2

    On a straight chain of N equal links the sum grows with N^3, so the distance grows with N^1.5; on a loop of fixed
    size with N^0.5.

    Parameters
    ----------
    transforms : sequence of array-like, each (4, 4)
    std_rot, std_trans : float
        Standard deviation of each component of a link's rotation vector (rad) and translation.

    Returns
    -------
    angle, distance : float
        Root mean square closure angle (rad) and distance.
    """
    std_rot, std_trans = _noise(std_rot, std_trans)
    origins = stations(transforms)[1:, :3, 3]
    levers = np.linalg.norm(origins[-1] - origins, axis=-1)
    n = len(origins)
    return np.sqrt(3 * n) * std_rot, np.sqrt(3 * n * std_trans**2 + 2 * std_rot**2 * (levers**2).sum())


def expected_heights(transforms, std_rot, std_trans):
    """Error to expect in the height of each frame of a chain with noisy links, to first order.

    Height is measured along z of the first frame. A turn at the end of link j lifts frame k by its lever l_jk, their
    distance seen along z:

        height_k^2 = k std_trans^2 + std_rot^2 sum_{j <= k} l_jk^2

    Parameters
    ----------
    transforms : sequence of array-like, each (4, 4)
    std_rot, std_trans : float
        Standard deviation of each component of a link's rotation vector (rad) and translation.

    Returns
    -------
    heights : array, shape (N + 1,)
        Standard deviations, 0 for the first frame.
    """
    std_rot, std_trans = _noise(std_rot, std_trans)
    origins = stations([as_shape(T, "transforms", 4, 4) for T in _links(transforms)])[:, :2, 3]
    levers = np.linalg.norm(origins[:, None] - origins, axis=-1)
    turned = np.tril(levers**2)[:, 1:].sum(1)  # a link's turn stands at its end, and moves what follows
    return np.sqrt(np.arange(len(origins)) * std_trans**2 + std_rot**2 * turned)


def noisy_links(transforms, std_rot, std_trans, rng, runs=1):
    """Links with noise, T_k exp(xi_k).

    Parameters
    ----------
    transforms : array-like, shape (N, 4, 4)
    std_rot, std_trans : float
        Standard deviation of each component of the rotation vector (rad) and the translation (mm).
    rng : numpy.random.Generator
    runs : int

    Returns
    -------
    links : array, shape (N, runs, 4, 4)
    """
    std_rot, std_trans = _noise(std_rot, std_trans)
    links, runs = as_shape(_stack(transforms), "transforms", "n", 4, 4), as_size(runs, "runs")
    rng = as_generator(rng)
    xi = rng.normal(size=(len(links), runs, 6)) * np.repeat([std_rot, std_trans], 3)
    return links[:, None] @ exp_se3(xi)


def _noise(std_rot, std_trans):
    values = [as_number(v, n) for v, n in ((std_rot, "std_rot"), (std_trans, "std_trans"))]
    for value, name in zip(values, ("std_rot", "std_trans")):
        if value < 0:
            raise ValueError(f"{name} must not be negative, got {shown(value)}")
    return values


def polygon_loop(n, size):
    """Links of a loop of n frames on a circle in the x-y plane, each turned by 360/n deg.

    Parameters
    ----------
    n : int
    size : float
        Diameter of the circle (mm).

    Returns
    -------
    links : array, shape (n, 4, 4)
    """
    n, size = as_size(n, "n"), as_number(size, "size")
    turn = 2 * np.pi / n
    link = np.eye(4)
    link[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    link[:2, 3] = size / 2 * np.array([np.sin(turn), 1 - np.cos(turn)])
    return np.repeat(link[None], n, axis=0)


def straight_chain(n, length):
    """Links of n frames in a row along x.

    Parameters
    ----------
    n : int
    length : float
        Of each link (mm).

    Returns
    -------
    links : array, shape (n, 4, 4)
    """
    n, length = as_size(n, "n"), as_number(length, "length")
    links = np.repeat(np.eye(4)[None], n, axis=0)
    links[:, 0, 3] = length
    return links


@dataclass(frozen=True)
class PoseGraph:
    """Poses that fit many measured links at once.

    Attributes
    ----------
    poses : array, shape (n, 4, 4)
        Node 0 is the identity.
    residuals : array, shape (m, 6)
        log(Z^-1 X_i^-1 X_j), rotation (rad) first.
    chi2 : float
        Weighted sum of squares, to be expected near dof.
    dof : int
    covariance : array, shape (6n - 6, 6n - 6)
        Of the twists of nodes 1..n-1 in their own frames.
    singular_values : array
        Of the weighted Jacobian.
    """

    poses: np.ndarray
    residuals: np.ndarray
    chi2: float
    dof: int
    covariance: np.ndarray
    singular_values: np.ndarray


def solve_pose_graph(edges, measured, std_rot, std_trans):
    """Poses of all nodes from measured links between them, by weighted least squares over every loop at once.

    Parameters
    ----------
    edges : sequence of (i, j)
        Link k was measured from node i to node j. Node 0 is held at the identity; every node must be reached.
    measured : array-like, shape (m, 4, 4)
        The measured T_ij.
    std_rot, std_trans : float
        Standard deviation of each component of a link's rotation vector (rad) and translation, both positive.

    Returns
    -------
    PoseGraph

    Source: Grisetti, Kuemmerle, Stachniss, Burgard, "A tutorial on graph-based SLAM", IEEE ITS Magazine 2 (2010) 31.
    """
    pairs, Z = _as_graph(edges, measured)
    stds = [as_positive_number(std_rot, "std_rot"), as_positive_number(std_trans, "std_trans")]
    weight = np.repeat(1 / np.array(stds), 3)
    start, Z_inverse = _spanning_poses(pairs, Z), invert(Z)

    def poses(x):
        return np.concatenate([start[:1], start[1:] @ exp_se3(x.reshape(-1, 6))])

    def weighted_residuals(x):
        return (_graph_residuals(poses(x), pairs, Z_inverse) * weight).ravel()

    def jacobian(x):
        return _graph_jacobian(poses(x), x, pairs, Z_inverse, weight)

    zero = np.zeros(6 * (len(start) - 1))
    fit = least_squares(weighted_residuals, zero, jac=jacobian, method="lm", x_scale="jac")
    X, dof = poses(fit.x), 6 * (len(Z) - len(start) + 1)
    J = _graph_jacobian(X, zero, pairs, Z_inverse, weight)
    values = np.linalg.svd(J, compute_uv=False)
    return PoseGraph(X, _graph_residuals(X, pairs, Z_inverse), 2 * fit.cost, dof, np.linalg.inv(J.T @ J), values)


def _as_graph(edges, measured):
    """Pairs of nodes, (m, 2), and measured links, (m, 4, 4), one for each other."""
    Z = as_transforms(measured, "measured")
    pairs = as_finite(edges, "edges")
    if Z.ndim != 3 or pairs.shape != (len(Z), 2):
        raise ValueError(f"edges must be pairs, one for each of the measured links, got {pairs.shape} for {Z.shape}")
    if not len(pairs) or (pairs < 0).any() or (pairs % 1 != 0).any() or (pairs[:, 0] == pairs[:, 1]).any():
        raise ValueError(f"edges must be pairs of two different nodes, numbered from 0, got {shown(pairs)}")
    return pairs.astype(int), Z


def _graph_residuals(X, pairs, Z_inverse):
    """log(Z^-1 X_i^-1 X_j) of every link from i to j, (m, 6)."""
    i, j = pairs.T
    return log_se3(Z_inverse @ relative(X[i], X[j]))


def _graph_jacobian(X, x, pairs, Z_inverse, weight):
    """Weighted Jacobian of the residuals to the steps x from the start that led to X, (6m, 6n - 6); node 0 is held."""
    steps = np.concatenate([np.zeros((1, 6)), x.reshape(-1, 6)])
    i, j = pairs.T
    between = relative(X[i], X[j])
    outer = weight[:, None] * _right_jacobian_inverse(log_se3(Z_inverse @ between))
    J, m = np.zeros((len(pairs), 6, len(X), 6)), np.arange(len(pairs))
    J[m, :, j] += outer @ _right_jacobian(steps[j])
    J[m, :, i] -= outer @ adjoint(invert(between)) @ _right_jacobian(steps[i])
    return J[:, :, 1:].reshape(6 * len(pairs), -1)


def _ad(xi):
    """Matrix of the Lie bracket of twists, rotation first; (..., 6) -> (..., 6, 6)."""
    ad = np.zeros((*xi.shape, 6))
    ad[..., :3, :3] = ad[..., 3:, 3:] = skew(xi[..., :3])
    ad[..., 3:, :3] = skew(xi[..., 3:])
    return ad


def _right_jacobian(xi):
    """J with exp(xi + d) = exp(xi) exp(J d) to first order, by its series: exact to 1e-4 at half a radian."""
    ad = _ad(xi)
    square = ad @ ad
    return np.eye(6) - ad / 2 + square / 6 - square @ ad / 24 + square @ square / 120


def _right_jacobian_inverse(xi):
    """Inverse of `_right_jacobian`, by its series (Bernoulli numbers)."""
    ad = _ad(xi)
    square = ad @ ad
    return np.eye(6) + ad / 2 + square / 12 - square @ square / 720


def _spanning_poses(pairs, Z):
    """First guess: walk from node 0 along the links as measured, each node reached once."""
    known, n = {0: np.eye(4)}, pairs.max(initial=0) + 1
    while len(known) < n:
        before = len(known)
        for (i, j), T in zip(pairs.tolist(), Z):
            if i in known and j not in known:
                known[j] = known[i] @ T
            elif j in known and i not in known:
                known[i] = known[j] @ relative(T, np.eye(4))
        if len(known) == before:
            lost = sorted(set(range(n)) - set(known))
            raise ValueError(f"every node must be reached from node 0, but no link leads to node {lost[0]}")
    return np.array([known[i] for i in range(n)])
