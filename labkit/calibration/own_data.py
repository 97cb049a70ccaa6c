"""Calibrations of one's own data: what is fitted, what disagrees, what stays unknown, and what to measure next.

A `Model` knows the data of one kind of calibration: it fits the rows it is told to keep, and gives the residuals of all
rows with their derivative by the parameters. Everything else is one mechanism for all kinds: the noise from the
residuals, the rows that disagree with the majority, leaving rows and groups out, and the poses that would help most.
Parameters begin with the rotation vector in the moving frame (rad) and the translation; lengths in any one unit.
"""

import functools
import math
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ..checks import (
    as_count,
    as_indices,
    as_instance,
    as_items,
    as_number,
    as_points,
    as_positive_number,
    as_shape,
    as_size,
    as_transforms,
    as_truths,
)
from ..documented import documented
from ..estimation.influence import distance_limit, inverse_normal, invert_normal, squared_distances
from ..geometry.frames import fit_frame, frame_from_points, invert
from ..geometry.lie import exp_so3, log_so3, nearest_rotation, skew
from ..geometry.propagation import three_point_jacobian
from .ax_xb import EyeInHand, calibrate_hand_eye
from .hand_eye import SphereHandEye, calibrate_sphere_target, joint_jacobian
from .pivot import calibrate_pivot

SAMPLES, SCORED = 100, 200  # three-row candidates of a robust start, and rows that judge them
LEAST_SHARE, LEAST = 0.45, 6  # of the rows, that a candidate must explain well
ROUNDS = 12  # of fitting, looking at distances, and choosing again
FIRST_STRETCH = 3.0  # on the limit of the first round: its noise comes from the best rows alone
FLOOR = 1e-9  # of the lengths, and rad: noise-free data must not divide by zero
TILT = np.deg2rad(30.0)  # of a proposed pose against one that was measured
LEAST_FREEDOM = 3.0  # below, Student's law has hardly a standard deviation: it is told as if there were so many


class Noise(NamedTuple):
    """What a reading scatters, channel by channel.

    std: standard deviations, (c,). freedom: degrees of freedom each was estimated from, (c,), infinite where given.
    """

    std: np.ndarray
    freedom: np.ndarray

    @property
    def widening(self):
        """Factor (c,) on what the noise does to an estimate, because the noise is itself an estimate.

        An error divided by an estimated standard deviation follows Student's law, whose standard deviation is
        sqrt(f / (f - 2)).
        """
        f = np.maximum(self.freedom, LEAST_FREEDOM)
        return np.sqrt(1 / (1 - 2 / f))


class Model:
    """Data of one calibration. Subclasses say how rows are fitted, linearized and proposed.

    channels: how many numbers of a row share one standard deviation, such as (3, 3) for a rotation and a translation.
    std: standard deviations of the channels, None where they are to be estimated. needed: the fewest rows of a fit.
    way: poses of the robot (n, 4, 4), or None.
    unknowns: what a solution holds, {name: shape}.
    """

    channels = (3,)
    needed = 3
    way = None
    unknowns = {}

    def __init__(self, n, std):
        self.n, self.std, self._fits = n, std, {}

    def __init_subclass__(cls):
        """The methods of every kind take its own rows and solutions alone."""
        checks = {
            "fit": cls.as_rows,
            "linearize": cls.as_solution,
            "proposals": cls.as_solution,
            "size": cls.as_channel,
        }
        for name, check in checks.items():
            if name in vars(cls):
                setattr(cls, name, _of_its_own(vars(cls)[name], check))

    def as_rows(self, kept):
        """Which rows count, bool (n,); refuses what says it of others."""
        kept = as_truths(kept, "kept")
        if kept.shape != (self.n,):
            raise ValueError(f"kept must have shape ({self.n},), got {kept.shape}")
        return kept

    def as_solution(self, solution):
        """The parts of a solution as arrays; refuses those of another kind of calibration."""
        parts, names = as_items(solution, "solution", "arrays"), ", ".join(self.unknowns)
        if len(parts) != len(self.unknowns):
            raise ValueError(f"solution must hold {names}, got {len(parts)} parts")
        parts = [as_shape(part, name, *shape) for part, (name, shape) in zip(parts, self.unknowns.items())]
        return tuple(as_transforms(part, "solution") if part.ndim == 2 else part for part in parts)

    def as_channel(self, channel):
        """The number of a channel; refuses one that there is not."""
        return int(as_indices(as_number(channel, "channel"), "channel", below=len(self.channels)))

    def fitted(self, kept):
        """The solution from some rows, remembered."""
        kept = self.as_rows(kept)
        key = kept.tobytes()
        if key not in self._fits:
            self._fits[key] = self.fit(kept)
        return self._fits[key]

    def fit(self, kept):
        """The solution from some rows."""
        raise NotImplementedError

    def linearize(self, solution):
        """Residuals (n, k) of all rows and their derivative (n, k, p)."""
        raise NotImplementedError

    def start(self):
        """Rows to begin with, bool (n,): a majority that agrees."""
        return np.ones(self.n, bool)

    def candidate(self):
        """The rows that the best of many three-row solutions explains.

        The score is the product of the channels' misfits at the row that closes the required share, so no scale is
        needed. `_solve(rows (m, 3))` gives m solutions, `_misfit(solutions, rows)` an array (m, len(rows)) a channel.

        Returns
        -------
        explained : bool array, shape (n,)
        misfit : tuple
            Of the best, in each channel.
        """
        n, rng = self.n, np.random.default_rng(0)
        if math.comb(n, 3) <= SAMPLES:
            rows = np.array(list(combinations(range(n), 3)))
        else:
            rows = rng.random((SAMPLES, min(n, 1000))).argsort(1)[:, :3] * (max(n // 1000, 1))
        judges = np.arange(n) if n <= SCORED else rng.choice(n, SCORED, replace=False)
        solutions = self._solve(rows)
        rank = min(max(int(np.ceil(LEAST_SHARE * len(judges))), LEAST), len(judges)) - 1
        parts = self._misfit(solutions, judges)
        scores = sum(np.log(np.partition(m, rank, axis=1)[:, rank] + 1e-12) for m in parts)
        best = int(np.nanargmin(np.where(np.isfinite(scores), scores, np.inf)))
        parts = self._misfit(tuple(part[best : best + 1] for part in solutions), np.arange(n))
        rank = min(max(int(np.ceil(LEAST_SHARE * n)), LEAST), n) - 1
        reached = tuple(float(np.partition(m[0], rank)[rank]) for m in parts)
        total = sum((m[0] / (limit + 1e-12)) ** 2 for m, limit in zip(parts, reached))
        kept = np.zeros(n, bool)
        kept[np.argsort(total)[: rank + 1]] = True
        return kept, reached

    def proposals(self, solution):
        """Poses that could be measured next, (m, 4, 4), and the derivative (m, k, p) of what they would measure."""
        raise ValueError(f"a {type(self).__name__} knows no poses to measure next")

    @documented
    def noise(self, r, J, kept):
        """`Noise` of the kept rows, each channel charged the share of the parameters that it fixes.

        Parameters
        ----------
        r : array, shape (n, k)
            Residuals.
        J : array, shape (n, k, p)
        kept : bool array, shape (n,)
        """
        J, edges = self._as_derivative(J), np.cumsum((0, *self.channels))
        parts = [slice(a, b) for a, b in zip(edges, edges[1:])]
        p, count = J.shape[2], kept.sum()
        floors = [max(FLOOR * self.size(c), 1e-300) for c in range(len(parts))]
        shares = np.full(len(parts), p / len(parts))
        std = np.ones(len(parts))
        rows = [J[kept, part].reshape(-1, p) for part in parts]
        normals = np.array([flat.T @ flat for flat in rows])
        squares = [(r[kept, part] ** 2).sum() for part in parts]
        for _ in range(4):
            freedom = np.maximum(count * np.array(self.channels) - shares, 1e-9)
            for c in range(len(parts)):
                std[c] = self.std[c] or max(np.sqrt(squares[c] / freedom[c]), floors[c])
            weighted = normals / (std**2)[:, None, None]
            shares = np.einsum("ij,cij->c", invert_normal(weighted.sum(0)), weighted)
        return Noise(std, np.where([given is None for given in self.std], freedom, np.inf))

    def size(self, channel):
        """Size of the numbers of a channel, beside which a residual is nothing."""
        return 1.0

    def whitened(self, solution, kept):
        """(residuals, derivative, `Noise`), the first two in units of the noise."""
        (r, J), kept = self.linearize(solution), self.as_rows(kept)
        noise = self.noise(r, J, kept)
        per_number = np.repeat(noise.std, self.channels)
        return r / per_number, J / per_number[:, None], noise

    @documented
    def widened(self, J, noise):
        """A whitened derivative in units of what is known of the noise: `inverse_normal` of it is the covariance.

        Parameters
        ----------
        J : array, shape (n, k, p)
        noise : Noise
        """
        return self._as_derivative(J) / np.repeat(noise.widening, self.channels)[:, None]

    def _as_derivative(self, J):
        J = as_shape(J, "J", "n", sum(self.channels), "p")
        as_count(J.shape[2], "the number of parameters in J")
        return J


def _of_its_own(method, check):
    """A method of a `Model` whose argument has passed a check of that model."""

    @functools.wraps(method)
    def checked(self, given):
        return method(self, check(self, given))

    return checked


@documented
def majority(model):
    """Rows that agree with each other, and the fit to them: (solution, kept).

    Fits, measures the distance of each row from what the kept ones predict, keeps those that a good row would reach
    with 99.9 %, and repeats until nothing changes.

    Parameters
    ----------
    model : Model

    Raises
    ------
    ValueError
        When too few rows agree to follow them.
    """
    kept = model.start()
    stretch = FIRST_STRETCH if kept.sum() < model.n else 1.0
    seen = []
    for _ in range(ROUNDS):
        if kept.sum() < max(model.needed, LEAST_SHARE * model.n - 1):
            raise ValueError(
                f"only {int(kept.sum())} of {model.n} rows agree with each other, so no majority can be followed"
            )
        solution = model.fitted(kept)
        r, J, _ = model.whitened(solution, kept)
        dof = kept.sum() * r.shape[1] - J.shape[2] if None in model.std else 10**6
        fresh = squared_distances(r, J, kept) <= stretch * distance_limit(r.shape[1], dof)
        if stretch == 1.0 and (any((fresh == old).all() for old in seen)):
            break
        stretch, kept = 1.0, fresh
        seen.append(fresh)
    return model.fitted(kept), kept


@documented
def next_poses(model, solution, kept, count=3):
    """Poses that would improve the first six parameters most, one after the other.

    Parameters
    ----------
    model : Model
    solution : tuple
        As `model.fit` gives it.
    kept : bool array, shape (n,)
        The rows that count.
    count : int
        At least 1.

    Returns
    -------
    poses : array, shape (count, 4, 4)
        As the robot would report them.
    std : array, shape (count + 1, 6)
        Predicted standard deviations now and after each of them, for noise as found.
    """
    count = as_size(count, "count")
    _, J, noise = model.whitened(solution, kept)
    poses, candidates = model.proposals(solution)
    candidates = model.widened(candidates / np.repeat(noise.std, model.channels)[:, None], noise)
    covariance = inverse_normal(model.widened(J[kept], noise))
    now, chosen, course = np.diag(covariance)[:6], [], [np.sqrt(np.diag(covariance)[:6])]
    for _ in range(count):
        CJ = candidates @ covariance
        gain = np.linalg.solve(np.eye(J.shape[1]) + CJ @ np.swapaxes(candidates, 1, 2), CJ)
        drop = np.einsum("mkp,mkp->mp", CJ, gain)[:, :6]
        best = int(np.argmax((drop / now).sum(1)))
        covariance = covariance - CJ[best].T @ gain[best]
        chosen.append(poses[best])
        course.append(np.sqrt(np.maximum(np.diag(covariance)[:6], 0.0)))
    return np.array(chosen), np.array(course)


def turned_both_ways(angle=TILT):
    """Small catalog of rotations (18, 3, 3): about x, y, z and the diagonals between them, both ways."""
    axes, angle = np.array([a for a in np.ndindex(3, 3, 3)]) - 1.0, as_number(angle, "angle")
    axes = axes[(np.abs(axes).sum(1) > 0) & (np.abs(axes).sum(1) < 3)]
    return exp_so3(angle * axes / np.linalg.norm(axes, axis=1)[:, None])


# --- the kinds -------------------------------------------------------------------------------------------------------


class HandEyeModel(Model):
    """T_BF T_FS T_ST = T_BT with noise on the sensor's readings; parameters of T_FS, then of T_BT."""

    channels = (3, 3)
    unknowns = {"T_FS": (4, 4), "T_BT": (4, 4)}

    def __init__(self, T_BF, T_ST, std=(None, None), solver=calibrate_hand_eye):
        T_BF, T_ST = as_transforms(T_BF, "robot"), as_transforms(T_ST, "sensor")
        if T_BF.ndim != 3 or T_BF.shape != T_ST.shape:
            raise ValueError(f"robot and sensor must be as many poses, (N, 4, 4), got {T_BF.shape} and {T_ST.shape}")
        if len(T_BF) < 3:
            raise ValueError(f"hand-eye calibration needs at least 3 poses, better 10, got {len(T_BF)}")
        super().__init__(len(T_BF), std)
        self.T_BF, self.T_ST, self.solver, self.way = T_BF, T_ST, solver, T_BF

    def size(self, channel):
        return 1.0 if channel == 0 else np.abs(self.T_BF[:, :3, 3]).max() + np.abs(self.T_ST[:, :3, 3]).max()

    def fit(self, kept):
        found = self.solver(self.T_BF[kept], self.T_ST[kept], *self.std)
        as_instance(found, "what solver returns", EyeInHand)
        return found.T_FS, found.T_BT

    def linearize(self, solution):
        X, Y = solution
        predicted = invert(self.T_BF @ X) @ Y  # the reading without noise
        turn = log_so3(np.swapaxes(predicted[:, :3, :3], 1, 2) @ self.T_ST[:, :3, :3])
        gap = self.T_ST[:, :3, 3] - predicted[:, :3, 3]
        return np.concatenate([turn, gap], 1), hand_eye_derivative(self.T_BF, predicted, X)

    def start(self):
        return self._candidate[0]

    @property
    def misfit(self):
        """Angle (rad) and distance within which the best three-row solution explains enough rows."""
        return self._candidate[1]

    @functools.cached_property
    def _candidate(self):
        return self.candidate()

    def _solve(self, rows):
        """Mounting and target from three poses each: two motions turn one pair of vectors into the other."""
        F, S = self.T_BF[rows], self.T_ST[rows]
        A, B = invert(F[:, :1]) @ F[:, 1:], S[:, :1] @ invert(S[:, 1:])  # A X = X B
        a, b = log_so3(A[..., :3, :3]), log_so3(B[..., :3, :3])
        a, b = (np.concatenate([v, np.cross(v[:, 0], v[:, 1])[:, None]], 1) for v in (a, b))
        R = nearest_rotation(np.swapaxes(a, 1, 2) @ b)
        K = (np.eye(3) - A[..., :3, :3]).reshape(-1, 6, 3)
        right = (A[..., :3, 3] - (R[:, None] @ B[..., :3, 3, None])[..., 0]).reshape(-1, 6, 1)
        K_t = np.swapaxes(K, 1, 2)
        t = np.linalg.solve(K_t @ K + 1e-12 * np.eye(3), K_t @ right)[..., 0]
        X = np.tile(np.eye(4), (len(rows), 1, 1))
        X[:, :3, :3], X[:, :3, 3] = R, t
        return X, F[:, 0] @ X @ S[:, 0]

    def _misfit(self, solutions, rows):
        """Angle and distance by which each reading misses each solution: both are linear in products of the unknowns.

        trace(X'F'Y S') is a sum of X_ba Y_cd times F_cb S_ad; the gap is X_R s + x + F'f - F'y, in the axes of F.
        """
        (X, Y), F, S = solutions, self.T_BF[rows], self.T_ST[rows]
        R, m, n = F[:, :3, :3], len(X), len(rows)
        unknown = np.einsum("mba,mcd->mabcd", X[:, :3, :3], Y[:, :3, :3]).reshape(m, 81)
        known = np.einsum("ncb,nad->nabcd", R, S[:, :3, :3]).reshape(n, 81)
        angle = np.sqrt(np.clip(3 - unknown @ known.T, 0, 4))
        unknown = np.concatenate([X[:, :3, :3].reshape(m, 9), X[:, :3, 3], Y[:, :3, 3], np.ones((m, 1))], 1)
        known = np.zeros((n, 3, 16))
        for k in range(3):
            known[:, k, 3 * k : 3 * k + 3], known[:, k, 9 + k] = S[:, :3, 3], 1.0
        known[:, :, 12:15] = -np.swapaxes(R, 1, 2)
        known[:, :, 15] = (np.swapaxes(R, 1, 2) @ F[:, :3, 3, None])[..., 0]
        gap = (unknown @ known.reshape(-1, 16).T).reshape(m, n, 3)
        return angle, np.sqrt((gap**2).sum(-1))

    def proposals(self, solution):
        X, Y = solution
        some = self.T_ST[:: max(self.n // 16, 1)]
        readings = np.repeat(some, 18, axis=0)
        readings[:, :3, :3] = np.tile(turned_both_ways(), (len(some), 1, 1)) @ readings[:, :3, :3]
        flange = Y @ invert(readings) @ invert(X)
        return flange, hand_eye_derivative(flange, readings, X)


@documented
def hand_eye_derivative(T_BF, predicted, T_FS):
    """Derivative of the residuals of hand-eye readings by the poses of sensor and target.

    Parameters
    ----------
    T_BF : array, shape (n, 4, 4)
        Flange poses.
    predicted : array, shape (n, 4, 4)
        The readings that are predicted there, T_ST without noise.
    T_FS : array, shape (4, 4)

    Returns
    -------
    J : array, shape (n, 6, 12)
        Rows: rotation vector, translation. Columns: those of T_FS, then of T_BT.
    """
    J, R = np.zeros((len(T_BF), 6, 12)), T_FS[:3, :3]
    J[:, :3, :3] = np.swapaxes(predicted[:, :3, :3], 1, 2)
    J[:, :3, 6:9] = -np.eye(3)
    J[:, 3:, :3] = -skew(predicted[:, :3, 3])
    J[:, 3:, 3:6] = R.T
    J[:, 3:, 9:] = -R.T @ np.swapaxes(T_BF[:, :3, :3], 1, 2)
    return J


class PivotModel(Model):
    """R tip + p = pivot with noise of one size on every coordinate; parameters are tip, then pivot."""

    unknowns = {"tip": (3,), "pivot": (3,)}

    def __init__(self, T_WF, std=(None,)):
        T_WF = as_transforms(T_WF, "poses")
        if T_WF.ndim != 3 or len(T_WF) < 3:
            raise ValueError(f"pivot calibration needs at least 3 poses, better 10, got {T_WF.shape[0]}")
        super().__init__(len(T_WF), std)
        self.T_WF = self.way = T_WF

    def size(self, channel):
        return np.abs(self.T_WF[:, :3, 3]).max()

    def fit(self, kept):
        found = calibrate_pivot(self.T_WF[kept])
        return found.tip, found.pivot

    def start(self):
        return calibrate_pivot(self.T_WF, robust=True).weights > 0 if self.n >= 5 else super().start()

    def linearize(self, solution):
        tip, pivot = solution
        R = self.T_WF[:, :3, :3]
        J = np.concatenate([R, np.broadcast_to(-np.eye(3), R.shape)], axis=2)
        return R @ tip + self.T_WF[:, :3, 3] - pivot, J

    def proposals(self, solution):
        tip, pivot = solution
        some = self.T_WF[:: max(self.n // 16, 1), :3, :3]
        R = np.repeat(some, 18, axis=0) @ np.tile(turned_both_ways(), (len(some), 1, 1))
        T = np.tile(np.eye(4), (len(R), 1, 1))
        T[:, :3, :3], T[:, :3, 3] = R, pivot - R @ tip
        return T, PivotModel(T).linearize(solution)[1]


class SphereModel(Model):
    """T_BF T_FS x_S = center, noise of one size on the seen centers; parameters of T_FS, then the center."""

    needed = 4
    unknowns = {"T_FS": (4, 4), "center": (3,)}

    def __init__(self, T_BF, x_S, std=(None,), solver=calibrate_sphere_target):
        T_BF, x_S = as_transforms(T_BF, "robot"), as_points(x_S, "points")
        if T_BF.ndim != 3 or x_S.shape != (len(T_BF), 3):
            raise ValueError(
                f"robot and points must come row by row, (N, 4, 4) and (N, 3), got {T_BF.shape} and {x_S.shape}"
            )
        if len(T_BF) < 4:
            raise ValueError(f"calibration with a sphere needs at least 4 poses, better 10, got {len(T_BF)}")
        super().__init__(len(T_BF), std)
        self.T_BF, self.x_S, self.solver, self.way = T_BF, x_S, solver, T_BF

    def size(self, channel):
        return np.abs(self.T_BF[:, :3, 3]).max() + np.abs(self.x_S).max()

    def fit(self, kept):
        found = self.solver(self.T_BF[kept], self.x_S[kept])
        as_instance(found, "what solver returns", SphereHandEye)
        return found.T_FS, found.target

    def start(self):
        if self.n < 7:
            return super().start()
        found = self.solver(self.T_BF, self.x_S, robust=True)
        return as_instance(found, "what solver returns", SphereHandEye).weights > 0

    def linearize(self, solution):
        X, center = solution
        r = (self.T_BF[:, :3, :3] @ (self.x_S @ X[:3, :3].T + X[:3, 3])[..., None])[..., 0] + self.T_BF[:, :3, 3]
        return r - center, joint_jacobian(self.T_BF, self.x_S, X).reshape(self.n, 3, 9)

    def proposals(self, solution):
        X, center = solution
        rows = np.arange(0, self.n, max(self.n // 16, 1))
        R = np.repeat(self.T_BF[rows, :3, :3], 18, axis=0) @ np.tile(turned_both_ways(), (len(rows), 1, 1))
        seen = np.repeat(self.x_S[rows], 18, axis=0)
        T = np.tile(np.eye(4), (len(R), 1, 1))
        T[:, :3, :3] = R
        T[:, :3, 3] = center - (R @ (seen @ X[:3, :3].T + X[:3, 3])[..., None])[..., 0]
        return T, SphereModel(T, seen).linearize(solution)[1]


class FrameModel(Model):
    """T_WF p_F = p_W with noise of one size on the measured points; parameters of T_WF."""

    unknowns = {"T_WF": (4, 4)}

    def __init__(self, nominal, measured, std=(None,)):
        nominal, measured = as_points(nominal, "nominal"), as_points(measured, "measured")
        if nominal.shape != measured.shape or nominal.ndim != 2:
            raise ValueError(
                f"nominal and measured must be as many points, (N, 3), got {nominal.shape} and {measured.shape}"
            )
        super().__init__(len(measured), std)
        self.nominal, self.measured = nominal, measured

    def size(self, channel):
        return np.abs(self.measured).max()

    def fit(self, kept):
        return (fit_frame(self.nominal[kept], self.measured[kept]),)

    def start(self):
        if self.n < 6:
            return super().start()
        return self.candidate()[0]

    def _solve(self, rows):
        sides = self.nominal[rows[:, 1:]] - self.nominal[rows[:, :1]]
        area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
        rows = np.where((area > 1e-3 * area.max())[:, None], rows, rows[np.argmax(area)])  # flat ones fix nothing
        return (fit_frame(self.nominal[rows], self.measured[rows]),)

    def _misfit(self, solutions, rows):
        (T,) = solutions
        moved = self.nominal[rows] @ np.swapaxes(T[:, :3, :3], 1, 2) + T[:, None, :3, 3]
        return (np.linalg.norm(moved - self.measured[rows], axis=-1),)

    def linearize(self, solution):
        (T,) = solution
        r = self.nominal @ T[:3, :3].T + T[:3, 3] - self.measured
        J = np.concatenate([-T[:3, :3] @ skew(self.nominal), np.broadcast_to(np.eye(3), (self.n, 3, 3))], axis=2)
        return r, J


def three_point_frame(points, std):
    """Frame through three points, with its covariance.

    Parameters
    ----------
    points : array-like, shape (3, 3)
        Origin, a point on x, a point beyond it in the x-y plane.
    std : float or None
        Noise of each coordinate.

    Returns
    -------
    T : array, shape (4, 4)
    covariance : array, shape (6, 6), or None without noise
    """
    points, std = as_shape(points, "points", 3, 3), None if std is None else as_positive_number(std, "std")
    T = frame_from_points(*points)
    if std is None:
        return T, None
    J = three_point_jacobian(*points)
    return T, std**2 * J @ J.T
