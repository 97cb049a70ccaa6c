"""Chapter 11: what no mounting can change, what each row says, an honest covariance, and the next pose."""

import functools

import numpy as np
from scipy import special
from scipy.spatial.transform import Rotation

from ...calibration import calibrate, motion
from ...calibration.own_data import Noise
from ...estimation import influence
from ...exercises import metrics
from ...exercises.engine import Chapter, Exercise, Prediction
from ...exercises.outcome import Mistake
from ...exercises.value import Value
from ...files.poses import read_poses
from ...files.samples import sample_cell
from ...geometry.frames import invert, pose
from ...geometry.lie import exp_so3, log_so3
from ...machines.sensor_cell import CELL

# --- draws -----------------------------------------------------------------------------------------------------------


def rows_of_a_cell(rng, n=None, still=False, reach=400.0):
    """Flange poses and exact readings of n rows, or some, from random places; `still`: of which two are the same.

    reach: how far from the base the flange goes, in each direction (mm).
    """
    n = n or int(rng.integers(4, 10))
    T_BF = pose(exp_so3(rng.uniform(-1, 1, (n, 3))), rng.uniform(-reach, reach, (n, 3)))
    if still:
        T_BF[2] = T_BF[1]
    X = pose(exp_so3(rng.uniform(-1, 1, 3)), rng.uniform(-150, 150, 3))
    Y = pose(exp_so3(rng.uniform(-1, 1, 3)), rng.uniform(-900, 900, 3))
    return T_BF, invert(T_BF @ X) @ Y


def rows_that_contradict(rng):
    """The same with readings that err by a degree and a few millimeters."""
    T_BF, T_ST = rows_of_a_cell(rng)
    n = len(T_ST)
    return T_BF, T_ST @ pose(exp_so3(rng.normal(0.0, 0.02, (n, 3))), rng.normal(0.0, 3.0, (n, 3)))


def some_motions(rng, apart, turns=(0.2, 2.0), n=None):
    """n motions, or some, that turn by such angles (rad) about axes in all directions, and how far apart they are compared.

    Some of the axes that are compared have largest entries of different sign: with turns from 2.2 on the scalar part of
    the quaternion that SciPy gives is negative for one of the two.
    """
    n = n or int(rng.integers(5, 10))
    while True:
        axes = rng.normal(size=(n, 3))
        axes /= np.linalg.norm(axes, axis=1, keepdims=True)
        cosines = (axes[apart:] * axes[:-apart]).sum(1)
        largest = np.take_along_axis(axes, np.abs(axes).argmax(1)[:, None], 1)[:, 0]
        both = (largest[apart:] * largest[:-apart]).min() < 0
        if np.abs(cosines).max() < 0.95 and cosines.min() < -0.2 and both:
            break
    return pose(exp_so3(rng.uniform(*turns, (n, 1)) * axes), rng.uniform(-300, 300, (n, 3))), apart


def motions_about_few_axes(rng):
    """Eight motions each about some axes, some of them the other way: so many that some cosine comes out beyond 1 in the
    last bits, in whichever way it is computed.
    """
    while True:
        axes = np.repeat(rng.normal(size=(12, 3)), 8, axis=0)
        turns = rng.uniform(0.2, 2.0, len(axes)) * np.where(np.arange(len(axes)) % 5 < 2, 1, -1)
        R = exp_so3(turns[:, None] * axes / np.linalg.norm(axes, axis=1, keepdims=True))
        phi, apart = log_so3(R), int(rng.integers(1, 4))
        unit = phi / np.linalg.norm(phi, axis=1, keepdims=True)
        if np.abs((unit[apart:] * unit[:-apart]).sum(1)).max() > 1:
            return pose(R, rng.uniform(-300, 300, (len(axes), 3))), apart


def one_pair(rng):
    """As many motions as are needed for one pair of them to be compared."""
    apart = int(rng.integers(1, 4))
    return pose(exp_so3(rng.normal(size=(apart + 1, 3))), rng.uniform(-300, 300, (apart + 1, 3))), apart


def axes_nearly_along(rng):
    """Motions about axes that are less than a tenth of a degree apart, some of them the other way: no angle is rounded off."""
    n, apart = int(rng.integers(5, 9)), int(rng.integers(1, 3))
    axes = rng.normal(size=3) + 4e-4 * rng.normal(size=(n, 3))
    axes *= np.where(np.arange(n) % 5 < 2, 1, -1)[:, None] / np.linalg.norm(axes, axis=1, keepdims=True)
    return pose(exp_so3(rng.uniform(0.2, 2.0, (n, 1)) * axes), rng.uniform(-300, 300, (n, 3))), apart


def axes_hardly_apart(rng):
    """Motions about axes each of which stands 2 millionths of a radian, or hardly more, from the one it is compared with,
    some of them the other way: their cosines are 1 to eleven digits.
    """
    n, apart = int(rng.integers(5, 9)), int(rng.integers(1, 3))
    one, other = np.linalg.qr(rng.normal(size=(3, 2)))[0].T
    along = rng.uniform(1.8e-6, 2.6e-6) / apart * np.arange(n)[:, None]
    axes = (np.cos(along) * one + np.sin(along) * other) * np.where(np.arange(n) % 5 < 2, 1, -1)[:, None]
    return pose(exp_so3(rng.uniform(0.2, 2.0, (n, 1)) * axes), rng.uniform(-300, 300, (n, 3))), apart


def motions_of_half_a_turn(rng):
    """Motions that turn by nearly 180 deg: the sine of their angle is so small that rounding hides an axis in it."""
    T, apart = some_motions(rng, int(rng.integers(1, 4)))
    turns = np.pi - rng.uniform(1, 3, (len(T), 1)) * 1e-12
    return pose(exp_so3(turns * _axes(T)), T[:, :3, 3]), apart


def small_turns(rng):
    """Motions that turn little, up to a quarter of a degree."""
    return some_motions(rng, int(rng.integers(1, 4)), turns=(2e-4, 4e-3))


def fitted_line(
    rng, freedom=(4, 8), p=None, unlike=False, alone=False, unused=False, twice=False, size=1.0, noise=(0.2, 4.0)
):
    """Residuals of a linear fit of p parameters to n numbers, and its derivative.

    freedom: the least and the largest n - p. unlike: the parameters have units of very different size, as radians
    beside millimeters. alone: one number pays for nearly all of a parameter, its share is above 0.999. unused: one number
    does not depend on the parameters. twice: two numbers are equal, and so are their rows, as where a reading stands in
    a file twice. size: of the derivative, as the unit of the parameters makes it. noise: its least
    and largest standard deviation.
    """
    p = p or int(rng.integers(2, 6))
    n = p + int(rng.integers(freedom[0], freedom[1] + 1))
    J, noise = rng.normal(size=(n, p)) * rng.uniform(0.3, 3.0), rng.uniform(*noise) * rng.normal(size=n)
    J *= size
    if unused:
        J[int(rng.integers(n))] = 0.0
    if twice:
        J[-1], noise[-1] = J[0], noise[0]
    if unlike:
        J *= 10.0 ** rng.permutation(np.linspace(-2.2, 2.2, p))
    if alone:
        k = int(rng.integers(n))
        others = np.delete(J, k, axis=0)
        J[k] *= np.sqrt(rng.uniform(1500, 9000) / (J[k] @ np.linalg.solve(others.T @ others, J[k])))
    return noise - J @ np.linalg.lstsq(J, noise, rcond=None)[0], J


def information(rng, p=None):
    """A covariance (p, p) of parameters of very different size; p: how many, or some."""
    p = p or int(rng.integers(3, 7))
    M = rng.normal(size=(p, p + 2)) * rng.uniform(0.02, 3.0, (p, 1))
    return M @ M.T + 1e-3 * np.diag(rng.uniform(0.5, 1.5, p))


def numbers_alike(rng):
    """A covariance, and a reading of which two numbers are of the same kind."""
    C, J = covariance_and_reading(rng, k=3)
    return C, J[[0, 1, 1]]


def covariance_and_reading(rng, more=None, k=None, p=None, unit=1.0, unlike=0.0):
    """A covariance of p parameters, and the derivative of one more reading of k numbers; by how many there are `more` of
    them than parameters. unit: of the parameters, in which they are written; unlike: by how many powers of ten the
    units of the first and the last of them differ.
    """
    C = information(rng, p)
    p = len(C)
    k = k or int(rng.integers(1, p) if more is None else p + more)
    units = unit * 10.0 ** np.linspace(0.0, unlike, p)
    return C / np.outer(units, units), rng.normal(size=(k, p)) * rng.uniform(0.3, 2.0) * units


def covariance_and_candidates(rng, rules, volume=None, m=None, p=None):
    """A covariance of p parameters and derivatives of m of possible readings among which each of the wrong rules picks another one.

    volume: the smallest determinant that is left, by a choice of units: all far above 1 and small derivatives, or all
    0 to some decimals.
    """
    while True:
        C, count = information(rng, p), m or int(rng.integers(7, 13))
        candidates = rng.normal(size=(count, int(rng.integers(2, 4)), len(C))) * rng.uniform(0.2, 2.0, (count, 1, 1))
        picks = [rule(C, candidates) for rule in (next_pose, *rules)]
        if len({*picks, picks[0] + 1}) == len(picks) + 1 and _alone(C, candidates) != picks[0] != 0:
            unit = 1.0 if volume is None else (volume / _volumes(C, candidates).min()) ** (1 / len(C))
            return unit * C, candidates / np.sqrt(unit)


def best_at(rng, place, **sizes):
    """A covariance and candidates of which the best one stands at this place."""
    C, candidates = covariance_and_candidates(rng, (), **sizes)
    order = np.arange(len(candidates))
    order[[place, next_pose(C, candidates)]] = order[[next_pose(C, candidates), place]]
    return C, candidates[order]


def single_numbers(rng):
    """Candidates of one number each."""
    C = information(rng)
    return C, rng.normal(size=(int(rng.integers(4, 8)), 1, len(C))) * rng.uniform(0.2, 2.0)


def few_candidates(rng, m=None):
    """Fewer candidates than parameters, m or some, and more numbers in each reading than there are parameters."""
    C, m = information(rng, int(rng.integers(4, 7))), m or int(rng.integers(2, 4))
    return C, rng.normal(size=(m, len(C) + 1, len(C))) * rng.uniform(0.1, 0.4, (m, 1, 1))


def shares_of_a_fit(rng, std=(0.05, 3.0), times=(3.0, 6.0), **kind):
    """Whitened derivative, noise of a number, and how many standard deviations are taken as seen."""
    _, J = fitted_line(rng, **kind)
    return J, float(rng.uniform(*std)), float(rng.uniform(*times))


def special_fits(draw, metric, freedom=1):
    """What `noisy` takes of fits at special places; freedom: the least n - p that is allowed."""
    return [
        (functools.partial(draw, unlike=True), metric,
         "right where all parameters have units of one size, but not where they differ, as radians and millimeters do:"),
        (functools.partial(draw, alone=True), metric,
         "right for small shares h, but not where one number has a share above 0.999:"),
        (functools.partial(draw, p=1), metric, "right for several parameters, but not for one, p = 1:"),
        (functools.partial(draw, unused=True), metric,
         "right on ordinary draws, but not where a row of J is 0: this number tells nothing of the parameters, its share h is 0:"),
        (functools.partial(draw, p=7), metric, "right for few parameters, but not for seven:"),
        (functools.partial(draw, freedom=(90, 120)), metric, "right for few numbers, but not for a hundred:"),
        (functools.partial(draw, size=1e-4), metric,
         "right for derivatives of the size of 1, but not where the unit of the parameters makes them ten thousand times as small:"),
        (functools.partial(draw, freedom=(freedom, freedom)), metric,
         f"right where n - p is larger, but not where it is {freedom}, the least that is allowed:"),
    ]  # fmt: skip


def of_other_noise(metric):
    """What `noisy` takes of fits with residuals of other size."""
    return [
        (functools.partial(fitted_line, noise=noise), metric,
         f"right for residuals of the size of 1, but not where they are {words}:")
        for noise, words in (((1e-5, 1e-4), "a ten thousandth, as of angles in rad"), ((2e3, 9e3), "some thousands"))
    ]  # fmt: skip


MOTIONS = metrics.Several(metrics.Poses(1e-6, 1e-6), metrics.Poses(1e-6, 1e-6), names=("A", "B"))


# --- references and wrong variants -----------------------------------------------------------------------------------


def _unturned(T):
    """The inverse of which the translation is negated, and not turned."""
    return pose(np.swapaxes(T[:, :3, :3], 1, 2), -T[:, :3, 3])


def _component_of_the_sine(k):
    def variant(T, apart):
        a, b = _axes(T)[:-apart], _axes(T)[apart:]
        return np.arctan2(np.cross(a, b)[:, k], (a * b).sum(1))

    return variant


def _changed(change):
    def variant(T, apart):
        return change(motion.between_axes(T, apart))

    return variant


def _angles(T):
    return np.linalg.norm(log_so3(T[:, :3, :3]), axis=1)


def _axes(T):
    return log_so3(T[:, :3, :3]) / _angles(T)[:, None]


def _angle_between(a, b):
    return np.arccos(np.clip((a * b).sum(1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1), -1, 1))


def _between(axes):
    """A variant from the axes it takes, a function of the rotations that gives vectors of any length."""
    return lambda T, k: _angle_between(axes(T[:, :3, :3])[k:], axes(T[:, :3, :3])[:-k])


def _sum_of_neighbors(T, k):
    step = motion.between_axes(T, 1)
    return np.array([step[i : i + k].sum() for i in range(len(T) - k)])


def _eigenvectors(R):
    values, vectors = np.linalg.eig(R)
    at = np.abs(values - 1).argmin(1)[:, None, None]
    return np.take_along_axis(vectors, at, 2)[:, :, 0].real


OTHER_AXES = (
    (_between(_eigenvectors),
     "An eigenvector is known up to its sign only. The axis of a motion has a direction, that about which its angle is positive: take the rotation vector."),
    (_between(lambda R: Rotation.from_matrix(R).as_quat()[:, :3]),
     "q and -q are the same turn: where the scalar part of a quaternion is negative, its vector part points against the axis. Turn its sign there, or take the rotation vector."),
    (_between(lambda R: Rotation.from_matrix(R).as_euler("xyz")),
     "Euler angles are three turns one after the other, no axis. The axis is the direction of the rotation vector."),
    (_between(lambda R: Rotation.from_matrix(R).as_euler("XYZ")),
     "Euler angles are three turns one after the other, no axis. The axis is the direction of the rotation vector."),
    (lambda T, k: motion.between_axes(T[::k], 1),
     "You take every motion `apart` further on, and these one after the other. Each motion is compared with the one `apart` further on: n - apart angles."),
    (_sum_of_neighbors,
     "You add the angles between neighbors. Axes in space turn back as well: take the angle between the two themselves."),
)  # fmt: skip


def _without_clip(T, k):
    return np.arccos((_axes(T)[k:] * _axes(T)[:-k]).sum(1))


def left_out(r, J):
    """Reference of the exercise: residuals of each number under the fit to the others, shape (n,)."""
    return influence.leave_out(r[:, None], J[:, None])[0][:, 0]


def _without_several(r, J, count):
    """Residuals under the fit to all others, where so many numbers in succession are left out together."""
    found = []
    for i in range(0, len(r), count):
        J_kept, r_kept = (np.delete(a, np.s_[i : i + count], axis=0) for a in (J, r))
        found.append(r[i : i + count] - J[i : i + count] @ np.linalg.lstsq(J_kept, r_kept, rcond=None)[0])
    return np.concatenate(found)


def _diagonal_alone(M):
    """The inverse of a matrix of which the diagonal is read alone."""
    return np.diag(1 / np.diag(M))


def _shares(J):
    return influence.shares(J[:, None])


def honest_covariance(r, J):
    """Reference of the exercise: covariance of a fit whose noise is estimated from its residuals, (p, p)."""
    freedom = float(len(r) - J.shape[1])
    noise = Noise(np.array([np.sqrt(r @ r / freedom)]), np.array([freedom]))
    return (noise.std * noise.widening)[0] ** 2 * np.linalg.inv(J.T @ J)


def _freedom(r, J):
    return float(len(r) - J.shape[1])


def _covariance(factor):
    """r'r times a factor of n and p, times the inverse of J'J."""

    def variant(r, J):
        n, p = J.shape
        return factor(r @ r, n, n - p) * np.linalg.inv(J.T @ J)

    return variant


def with_one_more(C, J):
    """Reference of the exercise: covariance after one more reading, whitened derivative J (k, p)."""
    return np.linalg.inv(np.linalg.inv(C) + J.T @ J)


def _left(C, candidates):
    """What each candidate leaves, all at once: (m, p, p)."""
    return np.linalg.inv(np.linalg.inv(C) + np.swapaxes(candidates, 1, 2) @ candidates)


def _volumes(C, candidates):
    return np.linalg.det(_left(C, candidates))


def next_pose(C, candidates):
    """Reference of the exercise: number of the candidate that leaves the smallest determinant."""
    return int(np.argmin(_volumes(C, candidates)))


def _smallest_trace(C, candidates):
    return int(np.argmin(np.trace(_left(C, candidates), axis1=1, axis2=2)))


def _smallest_norm(C, candidates):
    return int(np.argmin(np.linalg.norm(_left(C, candidates), axis=(1, 2))))


def _largest_derivative(C, candidates):
    return int(np.argmax((candidates**2).sum((1, 2))))


def _largest_volume(C, candidates):
    return int(np.argmax(_volumes(C, candidates)))


def _least_certain(C, candidates):
    return int(np.argmax(((candidates @ C) * candidates).sum((1, 2))))


def _least_certain_volume(C, candidates):
    return int(np.argmax(np.linalg.det(candidates @ C @ np.swapaxes(candidates, 1, 2))))


def _largest_eigenvalue(C, candidates):
    return int(np.argmin(np.linalg.eigvalsh(_left(C, candidates))[:, -1]))


def _product_of_variances(C, candidates):
    return int(np.argmin(np.prod(np.diagonal(_left(C, candidates), axis1=1, axis2=2), axis=1)))


def _least_certain_first(C, candidates):
    return int(np.argmax([J[0] @ C @ J[0] for J in candidates]))


def _largest_information(C, candidates):
    return int(np.argmax(np.linalg.norm(np.swapaxes(candidates, 1, 2) @ candidates, axis=(1, 2))))


def _one_after_the_other(C, candidates):
    volumes = []
    for J in candidates:
        C = with_one_more(C, J)
        volumes.append(np.linalg.det(C))
    return int(np.argmin(volumes))


def _searched(beats):
    """A search that goes through the candidates: the last one whose determinant `beats` those before it, a list."""

    def variant(C, candidates):
        volumes = list(_volumes(C, candidates))
        return max((i for i in range(1, len(volumes)) if beats(volumes[i], volumes[:i])), default=0)

    return variant


def _first_that_beats(C, candidates):
    volumes = _volumes(C, candidates)
    return int(np.argmax(volumes < volumes[0])) if (volumes < volumes[0]).any() else 0


def _reading_counted(times):
    """The choice where each reading brings its information so many times, 0: divided by how many numbers it has."""
    return lambda C, candidates: next_pose(C, candidates * np.sqrt(times or 1 / candidates.shape[1]))


def _numbers_alone(C, candidates):
    """The choice where the numbers of a reading are taken as independent: det(J C J' + I) of the diagonal alone."""
    return int(np.argmax(np.prod(1 + ((candidates @ C) * candidates).sum(2), axis=1)))


def _one_in_every_entry(C, candidates):
    return int(np.argmax(np.linalg.det(candidates @ C @ np.swapaxes(candidates, 1, 2) + 1)))


def _volume_of_a_part(part):
    return lambda C, candidates: int(np.argmin(np.linalg.det(_left(C, candidates)[:, part, part])))


def _largest_variance(C, candidates):
    return int(np.argmin(np.diagonal(_left(C, candidates), axis1=1, axis2=2).max(1)))


def _largest_drop(C, candidates):
    return int(np.argmax((np.diag(C) - np.diagonal(_left(C, candidates), axis1=1, axis2=2)).max(1)))


def _along_the_worst(C, candidates):
    return int(np.argmax(np.linalg.norm(candidates @ np.linalg.eigh(C)[1][:, -1], axis=1)))


def _alone(C, candidates):
    return int(np.argmax(np.linalg.det(candidates @ np.swapaxes(candidates, 1, 2))))


CHOICES = tuple(
    functools.partial(covariance_and_candidates, rules=rules, volume=volume)
    for rules, volume in (
        ((_smallest_trace, _largest_derivative, _largest_volume, _least_certain), None),
        ((_least_certain_volume, _largest_eigenvalue), None),
        ((_least_certain_first, _least_certain), 1e40),
        ((_product_of_variances, _largest_eigenvalue, _smallest_trace), None),
        ((_largest_information, _largest_derivative, _volume_of_a_part(np.s_[-3:])), 1e-24),
        ((_numbers_alone, _one_in_every_entry), None),
        ((_reading_counted(2),), None),
        ((_reading_counted(0),), None),
    )
)


def visible(J, std, times):
    """Reference of the exercise: the error of each number that the fit shows, shape (n,)."""
    return std * influence.visible_errors(J, times)


# --- the planted faults ----------------------------------------------------------------------------------------------


@functools.cache
def slipped():
    """The calibration of the cell whose screw slipped."""
    robot, sensor = (read_poses(path).in_unit("mm") for path in sample_cell("slipped_screw"))
    return calibrate.hand_eye(robot.T, sensor.T)


def _apart(a, b):
    return float(np.linalg.norm(a[:3, 3] - b[:3, 3]))


def slip_cost():
    """How far the fit to all rows puts the sensor from the fit to those that agree (mm)."""
    return _apart(slipped().plain.T, slipped().T)


def _turn_apart():
    """The angle between the two mountings (rad)."""
    return float(np.linalg.norm(log_so3(slipped().T[:3, :3].T @ slipped().plain.T[:3, :3])))


def _fit_to_the_rejected():
    """The mounting that the rejected rows have among themselves."""
    robot, sensor = (read_poses(path).in_unit("mm") for path in sample_cell("slipped_screw"))
    return calibrate.hand_eye(robot.T[~slipped().kept], sensor.T[~slipped().kept]).T


CHAPTER = Chapter(
    "11-your-own-data",
    title="Your own data",
    items=[
        Exercise(
            "motions",
            reference=motion.motions,
            sizes=("T_BF T_ST",),
            draw=rows_of_a_cell,
            metric=MOTIONS,
            noisy=[
                (functools.partial(rows_of_a_cell, n=2), MOTIONS, "right for many rows, but not for two of them, which make one motion:"),
                (functools.partial(rows_of_a_cell, n=40, reach=20000.0), MOTIONS, "right for few rows, but not for forty of them, meters apart:"),
                (rows_that_contradict, MOTIONS, "right, but not where the sensor's readings err, as all do:"),
                (functools.partial(rows_of_a_cell, still=True), MOTIONS, "right where the robot always moves, but not where it stays, and a motion is the identity:"),
            ],
            hints=(
                "Write the loop for row i and for row i + 1. Both equal T_BT, so they equal each other.",
                "T_BF[i] X T_ST[i] = T_BF[i+1] X T_ST[i+1]: bring all of the robot to the left, all of the sensor to the right.",
                "`return invert(T_BF[:-1]) @ T_BF[1:], T_ST[:-1] @ invert(T_ST[1:])`",
            ),
            mistakes=[
                Mistake(lambda F, S: (invert(F[:-1]) @ F[1:], S[1:] @ invert(S[:-1])),
                        "Your B leads back, from row i + 1 to row i. Both are to lead on: B = T_ST[i] inv(T_ST[i+1]).", id="motions-2caef3"),
                Mistake(lambda F, S: (invert(F[:-1]) @ F[1:], invert(S[:-1]) @ S[1:]),
                        "Your B has the form of A, with the inverse on the left. The target stands on the other side of the sensor: B = T_ST[i] inv(T_ST[i+1]).", id="motions-e2860a"),
                Mistake(lambda F, S: (F[1:] @ invert(F[:-1]), S[:-1] @ invert(S[1:])),
                        "Your A is the motion as the base sees it. X stands at the flange: A = inv(T_BF[i]) T_BF[i+1]."),
                Mistake(lambda F, S: (F[:-1] @ invert(F[1:]), S[:-1] @ invert(S[1:])),
                        "Your A has the form of B, with the inverse on the right. The base stands on the other side of the flange: A = inv(T_BF[i]) T_BF[i+1].", id="motions-8ec248"),
                Mistake(lambda F, S: (invert(F[1:]) @ F[:-1], S[:-1] @ invert(S[1:])),
                        "Your A leads back, from row i + 1 to row i. Both are to lead on: A = inv(T_BF[i]) T_BF[i+1].", id="motions-4d73ae"),
                Mistake(lambda F, S: (invert(F[1:]) @ F[:-1], S[1:] @ invert(S[:-1])),
                        "Both motions lead from each row back to the one before. Asked for is from each row to the next."),
                Mistake(lambda F, S: (S[:-1] @ invert(S[1:]), invert(F[:-1]) @ F[1:]),
                        "A and B have changed places: A is the flange's motion."),
                Mistake(lambda F, S: (invert(F[:1]) @ F[1:], S[:-1] @ invert(S[1:])),
                        "Your A always starts from the first row. Both are to go from each row to the next.", id="motions-first-a"),
                Mistake(lambda F, S: (invert(F[:-1]) @ F[1:], S[:1] @ invert(S[1:])),
                        "Your B always starts from the first row. Both are to go from each row to the next.", id="motions-first-b"),
                Mistake(lambda F, S: (invert(F[:1]) @ F[1:], S[:1] @ invert(S[1:])),
                        "You always start from the first row. Asked for is from each row to the next."),
                Mistake(lambda F, S: (invert(F[:1]) @ F[1:], S[1:] @ invert(S[:1])),
                        "You always start from the first row, and B leads back to it. Asked for is from each row to the next: B = T_ST[i] inv(T_ST[i+1]).", id="motions-first-back"),
                Mistake(lambda F, S: (F[:-1] @ F[1:], S[:-1] @ S[1:]),
                        "You multiplied the two poses without inverting one: that is no motion from one to the other."),
                Mistake(lambda F, S: (np.swapaxes(F[:-1], 1, 2) @ F[1:], S[:-1] @ np.swapaxes(S[1:], 1, 2)),
                        "The transpose of a 4 x 4 pose is not its inverse. Use `invert`."),
                Mistake(lambda F, S: (_unturned(F[:-1]) @ F[1:], S[:-1] @ _unturned(S[1:])),
                        "In your inverse the translation is negated, but not turned: it is -R^T t. Use `invert`."),
                Mistake(lambda F, S: (invert(F) @ np.roll(F, -1, 0), S @ invert(np.roll(S, -1, 0))),
                        "You closed the circle from the last row to the first: n rows make n - 1 motions."),
                Mistake(lambda F, S: (invert(F[:-2]) @ F[2:], S[:-2] @ invert(S[2:])),
                        "You leave a row out: each motion leads from a row to the very next one."),
                *(Mistake(lambda F, S, sign=sign: (np.diff(F, axis=0), sign * np.diff(S, axis=0)),
                          "Poses are not subtracted. The motion from one to the next is a product with an inverse.") for sign in (1, -1)),
            ],
        ),
        Prediction(
            "inverted",
            question="One of the two files holds the inverse poses. What of the motions from row to row changes?",
            choices=("the angles", "the angles and the shifts along the axes", "neither of them"),
            answer="neither of them",
            why="The inverse motion turns by the same angle and shifts as far. What changes is how the axes of two motions that share no row stand to one another.",
        ),
        Exercise(
            "between_axes",
            reference=motion.between_axes,
            draw=(
                *(functools.partial(some_motions, apart=k) for k in (2, 1, 3, 4)),
                functools.partial(some_motions, apart=1, turns=(2.2, 3.0)),
            ),
            metric=metrics.Numbers(1e-7, "rad"),
            noisy=[
                (motions_about_few_axes, metrics.Numbers(1e-6, "rad"),
                 "right for axes in all directions, but not for parallel and opposite ones, where a cosine may come out as 1.0000000000000002:"),
                (axes_nearly_along, metrics.Numbers(1e-6, "rad"),
                 "right for axes in all directions, but not for nearly parallel and nearly opposite ones, whose small angles count:"),
                (axes_hardly_apart, metrics.Numbers(1e-6, "rad", absolute=True),
                 "right for axes in all directions, but not for axes a few millionths of a radian apart, whose cosine is 1 to eleven digits:"),
                (one_pair, metrics.Numbers(1e-6, "rad"), "right for several pairs, but not where one pair alone is to be compared, which gives one angle in an array:"),
                (functools.partial(some_motions, apart=7, n=20), metrics.Numbers(1e-6, "rad"), "right for few motions, but not where there are twenty, compared seven apart:"),
                (small_turns, metrics.Numbers(1e-6, "rad"), "right for large turns, but not for motions that turn by less than a quarter of a degree, which have an axis too:"),
                (motions_of_half_a_turn, metrics.Numbers(1e-6, "rad"),
                 "right on ordinary draws, but not for motions of nearly half a turn, where the sine of the angle, and R less its transpose with it, vanishes:"),
            ],
            hints=(
                "The rotation vector of a motion points along its axis. Its length is the angle, which should not matter here.",
                "Bring the rotation vectors to length 1; the scalar product of two of them is the cosine of the angle between.",
                "`phi = log_so3(T[:, :3, :3])\n"
                "axes = phi / np.linalg.norm(phi, axis=1, keepdims=True)\n"
                "return np.arccos(np.clip((axes[apart:] * axes[:-apart]).sum(axis=1), -1, 1))`",
            ),
            mistakes=[
                Mistake(_without_clip,
                        "Right, but for parallel or opposite axes a scalar product may come out as 1.0000000000000002. Its arccos is NaN, as is the root of 1 less its square: np.clip it to -1 ... 1.", id="between_axes-c342be"),
                Mistake(_changed(np.rad2deg), "These are degrees. Inside, angles are radians."),
                *(Mistake(variant, text) for variant, text in OTHER_AXES),
                Mistake(_changed(np.cos), "These are the cosines: np.arccos is missing."),
                Mistake(_changed(lambda a: np.arccos(np.abs(np.cos(a)))),
                        "Your angles end at 90 deg. An axis has a direction, the one about which the angle is positive, so two may stand at up to 180."),
                *(Mistake(_component_of_the_sine(k),
                          "You take one component of the cross product, with its sign. The sine is the length of all three, and no angle is below 0.") for k in (2, 0, 1)),
                Mistake(_changed(lambda a: np.pi - a), "These are the supplements, pi less the angle, as if one of the two axes pointed the other way.", id="between_axes-208bd2"),
                Mistake(lambda T, k: np.linalg.norm(log_so3(np.swapaxes(T[:-k, :3, :3], 1, 2) @ T[k:, :3, :3]), axis=1),
                        "This is the angle of the turn between two motions. Asked for is the angle between their axes."),
                Mistake(lambda T, k: np.abs(_angles(T)[k:] - _angles(T)[:-k]),
                        "This compares how far two motions turn. Asked for is the angle between their axes."),
                Mistake(lambda T, k: _angles(T)[k:] - _angles(T)[:-k],
                        "This compares how far two motions turn, with a sign. Asked for is the angle between their axes."),
                *(Mistake(lambda T, k, column=column: _angle_between(T[k:, :3, column], T[:-k, :3, column]),
                          "You compared where a coordinate axis goes: a column of the rotation. The axis of a motion is what stays, the direction of its rotation vector.")
                  for column in (2, 0, 1)),
                *(Mistake(lambda T, k, limits=limits: np.arccos(np.clip((log_so3(T[k:, :3, :3]) * log_so3(T[:-k, :3, :3])).sum(1), *limits)),
                          "Your rotation vectors have the length of the angle. Bring them to length 1 before the scalar product.")
                  for limits in ((-1, 1), (-np.inf, np.inf))),
                Mistake(lambda T, k: np.arccos(np.clip((_axes(T)[k:] * _axes(T)[:1]).sum(1), -1, 1)),
                        "You compare every axis with the first. Asked for is each with the one `apart` further on."),
                *(Mistake(lambda T, k, most=most: motion.between_axes(T, 1)[:most(T, k)], "You compare neighbors whatever `apart` says.")
                  for most in (lambda T, k: None, lambda T, k: len(T) - k)),
                Mistake(lambda T, k: np.arccos(np.clip((_axes(T) * np.roll(_axes(T), -k, 0)).sum(1), -1, 1)),
                        "You closed the circle from the last motions to the first: n motions make n - apart pairs."),
                Mistake(lambda T, k: _angle_between(T[k:, :3, 3], T[:-k, :3, 3]),
                        "You took the translations. The axis of a motion is that of its rotation."),
            ],
        ),
        Value(
            "slip_cost",
            reference=slip_cost,
            unit="mm",
            rtol=1e-3,
            hints=(
                "The report holds two fits: one to the rows that agree, and beside it one to all of them.",
                "`slipped.T` and `slipped.plain.T` are the two mountings; the distance is that of their last columns.",
                "`slip_cost = np.linalg.norm(slipped.plain.T[:3, 3] - slipped.T[:3, 3])`",
            ),
            of={
                "slipped.plain.T[:3, 3] - slipped.T[:3, 3]": lambda: slipped().plain.T[:3, 3] - slipped().T[:3, 3],
                "(slipped.plain.T - slipped.T)[:3].T": lambda: (slipped().plain.T - slipped().T)[:3].T,
                "slipped.std[:3]": lambda: slipped().std[:3],
                "slipped.std[3:]": lambda: slipped().std[3:],
                "slipped.T_target[:3, 3]": lambda: slipped().T_target[:3, 3],
                "slipped.T_target[:3, 3] - slipped.T[:3, 3]": lambda: slipped().T_target[:3, 3] - slipped().T[:3, 3],
                "slipped.T_target[:3, 3] - slipped.plain.T[:3, 3]": lambda: slipped().T_target[:3, 3] - slipped().plain.T[:3, 3],
            },
            mistakes=[
                Mistake(lambda: _apart(_fit_to_the_rejected(), slipped().T),
                        "This is how far the sensor slipped. A fit to all rows ends up between the two mountings: how far from the first?"),
                Mistake(lambda: float(np.abs(slipped().plain.T[:3, 3] - slipped().T[:3, 3]).max()),
                        "This is the largest of the three coordinates. Asked for is the distance."),
                Mistake(lambda: float(np.abs(slipped().plain.T[:3, 3] - slipped().T[:3, 3]).sum()),
                        "This is the sum of the three coordinates. A distance is the root of the sum of their squares.", id="slip_cost-555eab"),
                Mistake(lambda: round(slip_cost(), 1), "This is right as far as it goes, but rounded: at least 3 digits are needed, so hand over the computed value."),
                Mistake(lambda: slipped().rms_translation, "This is the rms that the report states of the rows that agree, not how far the mounting moves."),
                Mistake(lambda: float(np.linalg.norm((invert(slipped().T) @ slipped().plain.T)[:3, :3])), "This is the norm of a rotation matrix, the root of 3 for every rotation. The way is in the last column."),
                Mistake(lambda: float(np.abs(slipped().plain.T - slipped().T).sum()),
                        "This adds up all entries of the difference. The last column alone says where the sensor is, and its length is a root of a sum of squares."),
                Mistake(lambda: float(np.rad2deg(_turn_apart())), "This is the angle between the two mountings, in degrees. Asked for is the way in mm: the last columns."),
                Mistake(lambda: _turn_apart(), "This is the angle between the two mountings, in rad. Asked for is the way in mm: the last columns."),
                *(Mistake(lambda k=k: float(np.linalg.norm(np.delete(slipped().plain.T[:3, 3] - slipped().T[:3, 3], k))), "This is the length of two coordinates of the difference. The distance takes all three.") for k in range(3)),
                *(Mistake(lambda of=of: float(np.linalg.norm(of().T[:3, 3])), "This is how far one of the two fits puts the sensor from the flange. Asked for is how far the two places are from each other.")
                  for of in (lambda: slipped().plain, slipped)),
                Mistake(lambda: 0.0, "This is 0, as where a fit is compared with itself, or the last rows, 0 0 0 1, of two poses. The places are their last columns."),
                *(Mistake(lambda k=k: float(np.linalg.norm((slipped().plain.T - slipped().T)[:3, k])),
                          f"This is the length of column {k} (counted from 0) of the difference, which is that of an axis. The places are the last columns, [:3, 3].")
                  for k in range(3)),
                Mistake(lambda: slip_cost() ** 2, "This is the squared distance. The distance is its root.", id="slip_cost-b6a9b3"),
                Mistake(lambda: slipped().plain.rms_translation, "This is the rms of the fit to all rows, not where it puts the sensor."),
                Mistake(lambda: slipped().plain.rms_translation - slipped().rms_translation,
                        "This is by how much the residuals grow. Asked for is by how much the result moves."),
                Mistake(lambda: _apart(invert(slipped().plain.T), invert(slipped().T)),
                        "This compares the inverse matrices: where the flange sits, seen from the sensor.", id="slip_cost-7ac5ea"),
                Mistake(lambda: float(np.linalg.norm(slipped().plain.T - slipped().T)),
                        "This is the norm over the whole matrix: the entries of the rotation are no millimeters. The last column alone says where the sensor is.", id="slip_cost-13ecf4"),
                Mistake(lambda: slip_cost() / np.sqrt(3), "This is the rms of the three coordinates: a distance is the root of the sum of their squares, not of the mean."),
                Mistake(lambda: _apart(slipped().plain.T, CELL.T_FS), "This is how far the fit to all rows is from the truth, which nobody has for data of his own. Asked for is the way from the fit to the rows that agree."),
                Mistake(lambda: _apart(slipped().T, CELL.T_FS), "This is how far the fit to the rows that agree is from the truth. Asked for is the way from it to the fit to all rows."),
                Mistake(lambda: abs(np.linalg.norm(slipped().T[:3, 3]) - np.linalg.norm(slipped().plain.T[:3, 3])),
                        "This is the difference of two distances from the flange. Subtract the places first, then take the length."),
                *(Mistake(lambda k=k: abs(float(slipped().plain.T[k, 3] - slipped().T[k, 3])), "This is one coordinate of the difference. The distance takes all three.") for k in (1, 2)),
                Mistake(lambda: float(np.linalg.norm((slipped().T @ slipped().plain.T)[:3, 3])), "This comes out when the two mountings are multiplied and none is inverted.", id="slip_cost-49c86f"),
            ],
        ),
        Exercise(
            "left_out",
            reference=left_out,
            sizes=("r",),
            draw=fitted_line,
            metric=metrics.Numbers(1e-7),
            noisy=[
                (functools.partial(fitted_line, twice=True), metrics.Numbers(1e-7),
                 "right, but not where a number stands there twice, with the same row of J: one of the two alone is left out:"),
                (functools.partial(fitted_line, p=4, freedom=(8, 8)), metrics.Numbers(1e-7),
                 "right, but not for twelve numbers, as of two rows of six (is each left out alone?):"),
                *special_fits(fitted_line, metrics.Numbers(1e-7)),
                *of_other_noise(metrics.Numbers(1e-7, least=0.0)),
            ],
            hints=(
                "A number that is fitted pulls the fit toward itself. Its share is h = j^T (J^T J)^-1 j, with j its row of J.",
                "Of its own error only 1 - h is left in the residual: divide by that.",
                "`h = np.einsum('ni,ij,nj->n', J, np.linalg.inv(J.T @ J), J)\n"
                "return r / (1 - h)`",
            ),
            mistakes=[
                Mistake(lambda r, J: r * (1 - _shares(J)), "You multiplied by 1 - h. The residual is what the fit has already reduced: divide."),
                Mistake(lambda r, J: r / np.sqrt(1 - _shares(J)),
                        "Divided by the root of 1 - h the residuals are comparable with each other. Under the fit to the others they are r / (1 - h)."),
                Mistake(lambda r, J: r / _shares(J), "You divided by the share h itself. What is left of an error is 1 - h."),
                Mistake(lambda r, J: r / (1 + _shares(J)), "1 + h belongs to a number that was not fitted. These were: 1 - h."),
                Mistake(lambda r, J: _shares(J), "These are the shares h. Divide the residuals by 1 - h."),
                Mistake(lambda r, J: 1 - _shares(J), "These are 1 - h. Divide the residuals by them."),
                Mistake(lambda r, J: r, "You return the residuals of the fit to all. Each number has pulled the fit toward itself."),
                Mistake(lambda r, J: r / (1 - J.shape[1] / len(r)),
                        "You gave every number the mean share p / n. Each row of J has a share of its own."),
                Mistake(lambda r, J: r / (1 - (J**2).sum(1)), "(J^T J)^-1 is missing between the two rows of J.", id="left_out-90a3f2"),
                Mistake(lambda r, J: r / (1 - ((J @ J.T @ J) * J).sum(1)), "J^T J stands between the two rows of J as it is: its inverse belongs there.", id="left_out-b026e8"),
                Mistake(lambda r, J: r / (1 - _shares(J).max()), "You took the largest share for all. Each number has a share of its own."),
                *(Mistake(functools.partial(_without_several, count=count), f"You leave out {words}. Here each number is left out alone.")
                  for count, words in ((3, "three numbers at once, as those of one position"), (6, "six numbers at once, as those of one pose"), (2, "two numbers at once"))),
                Mistake(lambda r, J: r - _shares(J), "You subtracted h, a share without unit, from a residual. What is left of an error is 1 - h of it: divide by that."),
                Mistake(lambda r, J: r * (1 + _shares(J)), "1 + h is only the beginning of 1 / (1 - h): near it for small shares.", id="left_out-25a0de"),
                Mistake(lambda r, J: r / (1 - _shares(J)) ** 2, "You divided by 1 - h twice."),
                Mistake(lambda r, J: r - left_out(r, J), "This is what the fit to the others gives at each number. Asked for is what is left of the number: r less it."),
                Mistake(lambda r, J: 2 * r - left_out(r, J), "The fit to the others is right, its sign is not: their fit is subtracted from the number, not added to it."),
                *(Mistake(lambda r, J, kept=kept: r - J @ np.linalg.lstsq(J[kept], r[kept], rcond=None)[0],
                          "You leave out the same number each time. The one whose residual is asked for is left out, and no other.") for kept in (np.s_[:-1], np.s_[1:])),
                Mistake(lambda r, J: r / (1 - np.linalg.inv(J.T @ J).trace()), "You took one number for all: the trace of (J^T J)^-1. Each row of J has a share of its own, j^T (J^T J)^-1 j.",
                        id="left_out-6638ce"),
            ],
        ),
        Prediction(
            "drop",
            question="Ten poses: nine turn the flange about one axis, one is tilted across. Which one can you least afford to lose?",
            choices=("the one with the largest residual", "the one tilted across", "any one, a tenth of the data"),
            answer="the one tilted across",
            why="It alone fixes what the nine leave free. Its residual is small for that very reason: nobody contradicts it.",
        ),
        Prediction(
            "coverage",
            question="Four poses, noise estimated from their residuals, no factor of Student. How often does the truth lie farther away than two of the standard deviations so told?",
            choices=("1 time in 20", "1 time in 10", "1 time in 3"),
            answer="1 time in 10",
            why="With six degrees of freedom the noise itself is off by a third, and where it came out too small the truth lies outside.",
        ),
        Exercise(
            "honest_covariance",
            reference=honest_covariance,
            sizes=("r",),
            draw=(functools.partial(fitted_line, freedom=(4, 4)), fitted_line),
            metric=metrics.Numbers(1e-8, least=0.0),
            noisy=[
                *special_fits(fitted_line, metrics.Numbers(1e-8, least=0.0), freedom=3),
                *of_other_noise(metrics.Numbers(1e-8, least=0.0)),
            ],
            hints=(
                "First the noise: r^T r, divided by the number of residuals less the number of parameters, f.",
                "C = s^2 (J^T J)^-1 would be right if s were known. It is an estimate as well: the variance of Student's law is f / (f - 2).",
                "`f = len(r) - J.shape[1]\n"
                "s2 = r @ r / f\n"
                "return s2 * f / (f - 2) * np.linalg.inv(J.T @ J)`",
            ),
            mistakes=[
                Mistake(_covariance(lambda rr, n, f: rr / n),
                        "You divided by the number of residuals. The parameters have taken their part: f = n - p. And Student's f / (f - 2) is missing."),
                Mistake(_covariance(lambda rr, n, f: rr / n * n / (n - 2)),
                        "Altogether you divide r^T r by n - 2. The parameters have taken their part, f = n - p: r^T r / f times Student's f / (f - 2) leaves f - 2 below.", id="honest_covariance-a4abe2"),
                Mistake(_covariance(lambda rr, n, f: rr / n * f / (f - 2)),
                        "Student's factor is right, but the noise is not: divide r^T r by f = n - p, not by n.", id="honest_covariance-0ba31b"),
                Mistake(_covariance(lambda rr, n, f: rr / f),
                        "This would be right if r^T r / f were known to be the noise. It is estimated: Student's factor f / (f - 2) is missing.", id="honest_covariance-592a28"),
                Mistake(_covariance(lambda rr, n, f: rr / (f - 1) * (f - 1) / (f - 3)),
                        "Altogether you divide r^T r by f - 3, with f = n - p. The noise r^T r / f times Student's f / (f - 2) leaves f - 2 below.", id="honest_covariance-5a6d1b"),
                Mistake(lambda r, J: r @ r / (_freedom(r, J) - 2) * _diagonal_alone(J.T @ J),
                        "You invert J^T J by its diagonal alone. What two parameters share stands beside it: the inverse of a matrix is np.linalg.inv."),
                *(Mistake(lambda r, J, student=student: student(_freedom(r, J)) * np.linalg.inv(J.T @ J) @ (J.T * r**2) @ J @ np.linalg.inv(J.T @ J),
                          "You let each residual stand for the noise of its own number. Here all have one noise, estimated from all: s^2 = r^T r / f.")
                  for student in (lambda f: f / (f - 2), lambda f: 1.0)),
                Mistake(_covariance(lambda rr, n, f: 1.0), "The noise is missing: this is the covariance for readings of standard deviation 1."),
                Mistake(_covariance(lambda rr, n, f: np.sqrt(rr / f) * f / (f - 2)), "You multiplied by s. A covariance takes its square."),
                Mistake(_covariance(lambda rr, n, f: rr / f * np.sqrt(f / (f - 2))),
                        "sqrt(f / (f - 2)) is the factor of a standard deviation. A covariance takes f / (f - 2)."),
                Mistake(_covariance(lambda rr, n, f: rr / f * (f - 2) / f), "Student's factor stands upside down: f / (f - 2) is larger than 1."),
                Mistake(_covariance(lambda rr, n, f: rr * f / (f - 2)), "r^T r is the sum of squares. The variance is r^T r / f.", id="honest_covariance-bc12c3"),
                Mistake(_covariance(lambda rr, n, f: rr / (f - 1) * f / (f - 2)),
                        "You took one degree of freedom too many away: with p parameters f = n - p, not n - p - 1."),
                Mistake(_covariance(lambda rr, n, f: rr / f * (f / (f - 2)) ** 2), "Student's factor has been squared: f / (f - 2) is that of a variance already."),
                Mistake(_covariance(lambda rr, n, f: rr / f * (special.stdtrit(f, 0.975) / special.ndtri(0.975)) ** 2),
                        "This is what comes out with Student's quantile for 95 %, divided by the normal one's, in the place of a standard deviation. The variance of Student's law is f / (f - 2), and has no level."),
                Mistake(_covariance(lambda rr, n, f: rr / f * f / (f + 2)), "A sign: the variance of Student's law is f / (f - 2), larger than 1."),
                Mistake(_covariance(lambda rr, n, f: rr / (f - 1)), "Altogether you divide r^T r by f - 1. The noise r^T r / f times Student's f / (f - 2) leaves f - 2 below.",
                        id="honest_covariance-433c55"),
                Mistake(_covariance(lambda rr, n, f: rr / (n - 1) * (n - 1) / (n - 3)), "Altogether you divide r^T r by n - 3. Here p parameters are fitted, f = n - p: r^T r / f times Student's f / (f - 2) leaves f - 2 below.", id="honest_covariance-d23061"),
                Mistake(_covariance(lambda rr, n, f: rr / (n - 1)), "You divided by n - 1, as for a mean. Here p parameters are fitted, f = n - p, and Student's f / (f - 2) is missing."),
                Mistake(lambda r, J: np.var(r) * _freedom(r, J) / (_freedom(r, J) - 2) * np.linalg.inv(J.T @ J),
                        "The mean of the residuals is taken off, as `np.var` does it, and you divide by their number. The noise is r^T r / f.", id="honest_covariance-59655a"),
                Mistake(lambda r, J: np.var(r, ddof=J.shape[1]) * _freedom(r, J) / (_freedom(r, J) - 2) * np.linalg.inv(J.T @ J),
                        "The mean of the residuals is taken off, as `np.var` does it, with `ddof` as well. The noise is r^T r / f.", id="honest_covariance-86638a"),
                Mistake(lambda r, J: np.var(r, ddof=J.shape[1]) * np.linalg.inv(J.T @ J),
                        "The mean of the residuals is taken off, as `np.var` does it, with `ddof` as well. The noise is r^T r / f, and Student's f / (f - 2) is missing.", id="honest_covariance-8f01e5"),
                Mistake(lambda r, J: np.var(r) * np.linalg.inv(J.T @ J),
                        "The mean of the residuals is taken off, as `np.var` does it, and you divide by their number. The noise is r^T r / f, and Student's f / (f - 2) is missing.", id="honest_covariance-9cb979"),
                Mistake(lambda r, J: r @ r / (_freedom(r, J) - 2) * (J.T @ J), "J^T J is information. The covariance takes its inverse.", id="honest_covariance-24c944"),
            ],
        ),
        Exercise(
            "with_one_more",
            reference=with_one_more,
            sizes=("C", "J"),
            draw=covariance_and_reading,
            metric=metrics.Numbers(1e-7),
            noisy=[
                *((functools.partial(covariance_and_reading, more=more), metrics.Numbers(1e-7),
                   "right for a reading of fewer numbers than there are parameters, but not for one of as many, or more:")
                  for more in (0, 2)),
                (functools.partial(covariance_and_reading, k=1), metrics.Numbers(1e-7), "right for several numbers, but not for a reading of a single one:"),
                (numbers_alike, metrics.Numbers(1e-7), "right, but not where two numbers of the reading have the same row of J: each counts:"),
                (functools.partial(covariance_and_reading, p=1, k=2), metrics.Numbers(1e-7), "right for several parameters, but not for one, p = 1:"),
                (functools.partial(covariance_and_reading, p=12, k=6), metrics.Numbers(1e-7), "right for few parameters, but not for twelve, as a hand-eye calibration has:"),
                (functools.partial(covariance_and_reading, unlike=4.0), metrics.Numbers(1e-7),
                 "right for parameters of one unit, but not where some are in rad and some in mm, so that their variances are of very different size:"),
                *((functools.partial(covariance_and_reading, unit=unit), metrics.Numbers(1e-7, least=0.0),
                   f"right for variances of the size of 1, but not where their unit makes them a hundred million times as {words}:")
                  for unit, words in ((1e4, "small"), (1e-4, "large"))),
            ],
            hints=(
                "What is known adds up, not what is unknown: information is the inverse of a covariance.",
                "The reading brings the information J^T J. Add it to the inverse of C, and invert the sum.",
                "`return np.linalg.inv(np.linalg.inv(C) + J.T @ J)`",
            ),
            mistakes=[
                Mistake(lambda C, J: np.linalg.inv(C) + J.T @ J, "This is the information. Invert it: asked for is the covariance."),
                Mistake(lambda C, J: C + J.T @ J, "You added information to a covariance. Invert C first, and the sum in the end."),
                Mistake(lambda C, J: np.linalg.inv(C + J.T @ J), "You added information to a covariance: the inverse of C is missing inside."),
                Mistake(lambda C, J: C - J.T @ J, "You took information away from a covariance: their units differ. Invert C, add J^T J, and invert the sum."),
                Mistake(lambda C, J: (C + np.linalg.pinv(J.T @ J)) / 2,
                        "You average two covariances. Information adds up, covariances do not: add J^T J to the inverse of C, and invert the sum.",
                        id="one-more-covariances-mean"),
                Mistake(lambda C, J: C, "This is C as it was given: what the reading tells is missing.", id="with_one_more-8236d8"),
                Mistake(lambda C, J: np.linalg.solve(np.eye(len(C)) + C @ J.T @ J, np.eye(len(C))),
                        "This is I - K J, by which the covariance shrinks. Multiply: (I - K J) C."),
                Mistake(lambda C, J: _diagonal_alone(_diagonal_alone(C) + J.T @ J),
                        "You invert by the diagonal alone. What two parameters share stands beside it: the inverse of a matrix is np.linalg.inv."),
                Mistake(lambda C, J: C - C @ J.T @ np.linalg.solve(J @ C @ J.T, J @ C),
                        "You took the reading as free of noise. Whitened, its covariance is I: J C J^T + I."),
                Mistake(lambda C, J: C - (lambda K: K @ K.T)(C @ J.T @ np.linalg.inv(J @ C @ J.T + np.eye(len(J)))),
                        "Between the gain K and its transpose the covariance of the reading is missing: C - K (J C J^T + I) K^T, or C - K J C."),
                Mistake(lambda C, J: C - C @ np.linalg.inv(C + np.linalg.pinv(J.T @ J)) @ C,
                        "You made a covariance of J^T J. Where the reading has fewer numbers than there are parameters, `pinv` makes it 0 in all it does not see, "
                        "as if that were known exactly: add J^T J to the inverse of C."),
                Mistake(lambda C, J: C - C @ J.T @ J @ C, "This is the first step toward it. The change is not small: (C^-1 + J^T J)^-1, or J C J^T + I between."),
                Mistake(lambda C, J: np.linalg.inv(np.linalg.inv(C) + 2 * J.T @ J), "This comes out where the reading is counted twice.", id="with_one_more-715c12"),
                Mistake(lambda C, J: np.linalg.inv(2 * np.linalg.inv(C) + J.T @ J), "This comes out where what is known already, C, is counted twice.", id="with_one_more-c9a9ec"),
                Mistake(lambda C, J: C @ J.T @ np.linalg.solve(J @ C @ J.T + np.eye(len(J)), J @ C),
                        "This is what the reading takes away. Subtract it from C."),
                Mistake(lambda C, J: C + C @ J.T @ np.linalg.solve(J @ C @ J.T + np.eye(len(J)), J @ C),
                        "You added what the reading takes away: a covariance shrinks with every reading."),
                Mistake(lambda C, J: np.linalg.inv(np.linalg.inv(C) - J.T @ J), "You subtracted the new information. It adds up."),
                Mistake(lambda C, J: C - C @ J.T @ np.linalg.solve(J @ C @ J.T + 1, J @ C),
                        "`+ 1` adds one to every entry of J C J^T. The whitened covariance of the reading is the identity, np.eye(len(J))."),
                Mistake(lambda C, J: np.linalg.inv(np.linalg.inv(C) + np.outer(J[0], J[0])), "Only the first number of the reading counts. J^T J takes all of its rows."),
                Mistake(lambda C, J: 1 / (1 / C + J.T @ J), "`1 / C` is one over each entry by itself. The inverse of a matrix is np.linalg.inv(C).", "with_one_more-347496"),
                Mistake(lambda C, J: np.linalg.inv(1 / C + J.T @ J), "`1 / C` is one over each entry by itself. The inverse of a matrix is np.linalg.inv(C).", "with_one_more-347496-2"),
                Mistake(lambda C, J: np.linalg.inv(np.linalg.inv(C) + np.linalg.pinv(J.T @ J)), "J^T J is information already: it is added as it is, not inverted."),
                Mistake(lambda C, J: C + np.linalg.pinv(J.T @ J), "You added covariances. What adds up are their inverses, the information."),
            ],
        ),
        Prediction(
            "more",
            question="Nine poses turn the flange about one axis, and hardly about the others. What makes the worst known direction better: ninety more of the kind, or a single one tilted across by 20 deg?",
            choices=("ninety more of the kind", "the single one across", "both alike"),
            answer="the single one across",
            why="Ninety more divide every standard deviation by the root of eleven. The one across adds what the nine do not have.",
        ),
        Exercise(
            "next_pose",
            reference=next_pose,
            draw=CHOICES,
            metric=metrics.Exactly(),
            draws=len(CHOICES),
            noisy=[
                (functools.partial(best_at, place=0), metrics.Exactly(), "right where the best candidate is not the first, but not where it is:"),
                (functools.partial(best_at, place=-1), metrics.Exactly(), "right where the best candidate is not the last, but not where it is:"),
                (functools.partial(best_at, place=-1, m=50, p=12), metrics.Exactly(),
                 "right for few, but not where the best of fifty candidates is the last, and there are twelve parameters:"),
                (few_candidates, metrics.Exactly(), "right on ordinary draws, but not where there are fewer candidates than parameters, each of more numbers than these:"),
                (functools.partial(few_candidates, m=1), metrics.Exactly(), "right for several candidates, but not where there is only one to choose:"),
                (single_numbers, metrics.Exactly(), "right for candidates of several numbers, but not where each reading is a single one:"),
            ],
            hints=(
                "Compute what each candidate would leave, and compare one number of it.",
                "Angles and lengths have different units, so a trace would add square radians to square millimeters. The determinant, the volume of the ellipsoid squared, needs no common unit.",
                "`left = [np.linalg.det(with_one_more(C, J)) for J in candidates]\n"
                "return int(np.argmin(left))`",
            ),
            mistakes=[
                *(Mistake(rule, "Your choice is that of the smallest trace, of the smallest norm, or of the smallest of the largest eigenvalues. Among squares of different units the largest numbers decide alone: compare determinants.", id=id)
                  for rule, id in ((_smallest_trace, "next_pose-c25375"), (_smallest_norm, "next_pose-c25375-2"), (_largest_eigenvalue, "next_pose-c25375-3"))),
                Mistake(lambda C, c: next_pose(C, c) * int(_volumes(C, c).min() < 1),
                        "Right where a determinant is below 1, else the first one: does your search begin with the number 1? Begin with infinity, or with the first candidate's own."),
                Mistake(lambda C, c: next_pose(C, c) if _volumes(C, c).min() < 1 else None,
                        "No candidate is found where all determinants are above 1: does your search begin with the number 1? Begin with infinity, or with the first candidate's own."),
                Mistake(_searched(lambda d, before: d < before[0]),
                        "You compare each candidate with the first one, and return the last that is better. Remember the smallest determinant so far, and compare with that."),
                Mistake(_first_that_beats, "You stop at the first candidate that is better than number 0. A later one may be better still: go through all."),
                Mistake(_searched(lambda d, before: d < before[-1]),
                        "You compare each candidate with the one before it. Remember the smallest determinant so far, and compare with that."),
                *(Mistake(_volume_of_a_part(part), "You compare the determinants of a part of each covariance. All parameters count: take the whole matrix.") for part in (np.s_[-3:], np.s_[:3])),
                *(Mistake(rule, "You look at the largest of the variances, or at the largest drop of one. All parameters count, and what they share: compare determinants.")
                  for rule in (_largest_variance, _largest_drop)),
                Mistake(_along_the_worst, "You look at the direction alone that is known worst. Compute what each candidate leaves, in all directions, and compare determinants."),
                Mistake(_product_of_variances, "You multiplied the variances: that is the determinant only where the covariance left has no other entries. What two parameters share counts too: np.linalg.det.", id="next_pose-2eac29"),
                Mistake(_largest_information, "You took the candidate whose own information is largest. It may well tell what is known already: compute what it leaves, with C."),
                Mistake(_least_certain_first, "You look at the first number of each reading alone, and at how well it can be predicted. Compute what the whole reading leaves, and compare determinants."),
                Mistake(_largest_derivative, "You took the candidate with the largest derivative. It may well tell what is known already: compute what it leaves."),
                Mistake(_largest_volume, "You took the candidate that leaves most unknown. The best leaves the smallest determinant of the covariance, which is the largest of the information.", id="next_pose-ce8578"),
                Mistake(_least_certain, "You took the reading that can be predicted least. Its numbers may all say the same: compare the determinants of what is left."),
                Mistake(_least_certain_volume, "You took the candidate with the largest det(J C J^T), the numbers that can be predicted least. They have noise as well: det(J C J^T + I)."),
                Mistake(lambda C, c: next_pose(C, c) + 1, "Candidates count from 0."),
                Mistake(lambda C, c: c[next_pose(C, c)], "This is the candidate's derivative. Asked for is its number."),
                Mistake(lambda C, c: float(_volumes(C, c).min()), "This is the determinant it leaves. Asked for is the candidate's number."),
                Mistake(_one_after_the_other, "You return the last one. In a loop this happens where C keeps what the candidates before it brought, or where the smallest determinant so far is not kept.", id="next_pose-64863e"),
                Mistake(_alone, "You looked at each candidate alone: what is known already, C, makes some of them worth little."),
                Mistake(lambda C, c: 0, "You return the first one, whatever it brings."),
            ],
        ),
        Exercise(
            "visible",
            reference=visible,
            sizes=("J", "std"),
            draw=shares_of_a_fit,
            metric=metrics.Numbers(1e-8),
            noisy=[
                *special_fits(shares_of_a_fit, metrics.Numbers(1e-8)),
                *((functools.partial(shares_of_a_fit, std=std), metrics.Numbers(1e-8, least=0.0),
                   f"right for noise of the size of 1, but not where it is {words}:")
                  for std, words in (((1e-5, 1e-4), "a ten thousandth, as of angles in rad"), ((200.0, 900.0), "some hundreds, as of counts"))),
                *((functools.partial(shares_of_a_fit, times=times), metrics.Numbers(1e-8),
                   f"right where an error must reach a few standard deviations, but not where it is {words}:")
                  for times, words in (((0.2, 0.9), "less than one of them"), ((20.0, 60.0), "some tens of them"))),
            ],
            hints=(
                "An error d of one number leaves (1 - h) d in its own residual. How large is the noise of that residual?",
                "The standard deviation of the residual is std sqrt(1 - h). The error is seen when (1 - h) d is `times` as large.",
                "`h = np.einsum('ni,ij,nj->n', J, np.linalg.inv(J.T @ J), J)\n"
                "return times * std / np.sqrt(1 - h)`",
            ),
            mistakes=[
                Mistake(lambda J, s, k: k * s / (1 - _shares(J)), "The noise of a residual shrinks as well, by the root of 1 - h: what is left to divide by is that root.", id="visible-e13cb4"),
                Mistake(lambda J, s, k: k * s * np.sqrt(1 - _shares(J)),
                        "This is how large the residual is. The error behind it is larger, by 1 / (1 - h)."),
                Mistake(lambda J, s, k: k * s * (1 - _shares(J)), "A number with a large share hides its error better, not worse: divide by the root of 1 - h."),
                Mistake(lambda J, s, k: k * s * np.sqrt(_shares(J) / (1 - _shares(J))),
                        "This is the noise of what the others predict for the number. Its own belongs to it as well: the variances s^2 h / (1 - h) and s^2 add up to s^2 / (1 - h)."),
                *(Mistake(variant, "This holds for a number that the fit does not use. Each fitted number hides part of its error: its share h is missing.")
                  for variant in (lambda J, s, k: np.full(len(J), k * s), lambda J, s, k: k * s)),
                Mistake(lambda J, s, k: k * s / np.sqrt(_shares(J)), "You divided by the root of the share h. What the others check is 1 - h."),
                Mistake(lambda J, s, k: k * s * np.sqrt(_shares(J)),
                        "This is how uncertain the fit is at each number, std sqrt(h), taken `times` times. An error shows in the residual, of which the noise is std sqrt(1 - h).", id="visible-6471af"),
                Mistake(lambda J, s, k: k / np.sqrt(1 - _shares(J)), "The noise is missing: these are standard deviations, not the unit of the readings."),
                Mistake(lambda J, s, k: s / np.sqrt(1 - _shares(J)), "`times` is missing: an error of one standard deviation is not seen."),
                Mistake(lambda J, s, k: k * s**2 / np.sqrt(1 - _shares(J)), "You took the variance of the noise. Its standard deviation belongs here."),
                Mistake(lambda J, s, k: np.full(len(J), k * s / np.sqrt(1 - J.shape[1] / len(J))),
                        "You gave every number the mean share p / n. Each row of J has a share of its own."),
                *(Mistake(lambda J, s, k, power=power: k * s * (1 + _shares(J)) ** power, "1 + h belongs to a number that was not fitted. These were: 1 - h.")
                  for power in (-0.5, 0.5)),
                Mistake(lambda J, s, k: k + s / np.sqrt(1 - _shares(J)), "You added `times`. It says how many of these standard deviations: multiply."),
                *(Mistake(lambda J, s, k, f=f: k * s / np.sqrt(f(1 - s**2 * _shares(J))),
                          "The noise does not belong into h: with equal noise the share of a number follows from J alone.") for f in (np.abs, np.asarray)),
                *(Mistake(lambda J, s, k, f=f: k * s / np.sqrt(f(1 - ((J @ J.T @ J) * J).sum(1))),
                          "J^T J stands between the two rows of J as it is: its inverse belongs there.", id=id)
                  for f, id in ((np.abs, "visible-b026e8"), (np.asarray, "visible-b026e8-2"))),
                Mistake(lambda J, s, k: 4.13 * s / np.sqrt(1 - _shares(J)), "Your 4.13 is fixed. `times` says how many standard deviations are taken."),
            ],
        ),
    ],
)  # fmt: skip
