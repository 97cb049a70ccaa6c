"""Exercises of chapter 5 beyond its core: kinds of accuracy, triangulation, the methods of Li et al. and of Kim."""

import functools

import numpy as np
from scipy.linalg import polar

from ...calibration import hand_eye, literature
from ...calibration.planning import poses_that_see
from ...documents.thesis import printed as thesis
from ...exercises import metrics
from ...exercises.engine import Exercise
from ...exercises.outcome import Mistake
from ...exercises.value import Value
from ...geometry import frames
from ...geometry.lie import exp_so3, nearest_rotation
from ...machines import robot_accuracy, triangulation

POSE, ROTATION = "a pose is always 4 x 4", "a rotation is always 3 x 3"

# --- draws ---


def scanner(rng):
    """Some scanner on the flange, and where the sphere is."""
    T_FS = frames.pose(
        exp_so3(rng.uniform(0.5, 2.5) * frames.unit_vector(rng.normal(size=3))), rng.uniform(-150, 150, 3)
    )
    return T_FS, rng.uniform(-900, 900, 3)


def translated_poses(rng, directions=3, std=0.0, n=None):
    """Poses of one orientation, shifted in so many directions, and the sphere as each sees it."""
    T_FS, target = scanner(rng)
    n = n or int(rng.integers(directions + 1, 9))
    shifts = rng.uniform(-40, 40, (n, directions)) @ np.linalg.qr(rng.normal(size=(3, 3)))[0][:directions]
    T_BF = poses_that_see(T_FS, target, exp_so3(rng.uniform(-1.5, 1.5, 3))[None], np.array([[0.0, 0.0, 240.0]]))
    T_BF = T_BF @ frames.pose(np.tile(np.eye(3), (n, 1, 1)), shifts)
    return T_BF, hand_eye.sphere_in_scanner(T_BF, T_FS, target) + std * rng.normal(size=(n, 3))


def nearly_in_a_plane(rng):
    """Noisy poses shifted nearly in one plane, whose sum of outer products has a negative determinant: without a look at
    it the nearest orthogonal matrix is a reflection.
    """
    while True:
        T_BF, x_S = translated_poses(rng, directions=2, std=0.05)
        T_BF[:, :3, 3] += 0.05 * rng.normal(size=(len(x_S), 3))
        M = _rotation(lambda R, t, x: (-t @ R).T @ x)(T_BF, x_S)
        values = np.linalg.svd(M, compute_uv=False)
        if np.linalg.det(M) < 0 and values[2] > 1e-9 * values[0]:
            return T_BF, x_S


def visited_twice(rng):
    """Four poses of one orientation, the second and the third at one place: without the first or the last one nothing
    is determined.
    """
    T_BF, x_S = translated_poses(rng, directions=2, n=4)
    T_BF[2], x_S[2] = T_BF[1], x_S[1]
    return T_BF, x_S


def first_ones_on_a_line(rng, numbers=(7, 13)):
    """Noisy poses of which all but three lie nearly on one line, the last one as well: by them alone the turn about it
    is not known.
    """
    T_BF, x_S = translated_poses(rng, directions=3, n=int(rng.integers(*numbers)))
    T_FS = frames.pose(literature.li_rotation(T_BF, x_S), np.zeros(3))
    along = 30 * frames.unit_vector(rng.normal(size=3))
    line = np.r_[1 : len(x_S) - 4, len(x_S) - 1]
    steps = np.outer(line, along)
    T_BF[line, :3, 3] = T_BF[0, :3, 3] + steps + 5e-4 * rng.normal(size=steps.shape)
    moved = (T_BF[:, :3, 3] - T_BF[0, :3, 3]) @ T_BF[0, :3, :3] @ T_FS[:3, :3]
    return T_BF, x_S[0] - moved + 0.02 * rng.normal(size=x_S.shape)


def turned_poses(rng, n=None):
    """Poses that turn about all axes, the sphere as each sees it, and the scanner's rotation."""
    T_FS, target = scanner(rng)
    n = n or int(rng.integers(4, 10))
    x_S = np.column_stack([rng.uniform(-25, 25, n), rng.uniform(-20, 20, n), rng.uniform(190, 290, n)])
    return poses_that_see(T_FS, target, exp_so3(rng.uniform(-1.2, 1.2, (n, 3))), x_S), x_S, T_FS[:3, :3].copy()


def hardly_turned(rng):
    """Poses that turn by a degree or two, about all axes."""
    T_FS, target = scanner(rng)
    x_S = np.column_stack([rng.uniform(-25, 25, 6), rng.uniform(-20, 20, 6), rng.uniform(190, 290, 6)])
    R_BF = exp_so3(rng.normal(size=3)) @ exp_so3(rng.uniform(-0.025, 0.025, (6, 3)))
    return poses_that_see(T_FS, target, R_BF, x_S), x_S, T_FS[:3, :3].copy()


def two_turned_alike(rng):
    """Four poses, the second and the third of one orientation: without the first or the last one nothing is determined."""
    while True:
        T_FS, target = scanner(rng)
        x_S = np.column_stack([rng.uniform(-25, 25, 4), rng.uniform(-20, 20, 4), rng.uniform(190, 290, 4)])
        R_BF = exp_so3(rng.uniform(-1.2, 1.2, (3, 3)))[[0, 1, 1, 2]]
        rows = np.concatenate([R_BF, np.tile(-np.eye(3), (4, 1, 1))], 2).reshape(-1, 6)
        if np.linalg.cond(rows) < 100:
            return poses_that_see(T_FS, target, R_BF, x_S), x_S, T_FS[:3, :3].copy()


def first_ones_turned_alike(rng, numbers=(10, 15)):
    """Noisy poses of which all but the last four hardly turn: by those alone t_FS and target are not known."""
    T_FS, target = scanner(rng)
    n = int(rng.integers(*numbers))
    x_S = np.column_stack([rng.uniform(-25, 25, n), rng.uniform(-20, 20, n), rng.uniform(190, 290, n)])
    turns = np.concatenate([rng.uniform(-0.002, 0.002, (n - 4, 3)), rng.uniform(-1.2, 1.2, (4, 3))])
    T_BF = poses_that_see(T_FS, target, exp_so3(rng.uniform(-1, 1, 3)) @ exp_so3(turns), x_S)
    return T_BF, x_S + 0.02 * rng.normal(size=(n, 3)), T_FS[:3, :3].copy()


def two_motions(rng, turn=1.0, far=2.0):
    """A motion of the flange and the same motion of the scanner."""
    X = frames.pose(exp_so3(rng.uniform(-1, 1, 3)), rng.uniform(-far, far, 3))
    A = frames.pose(exp_so3(rng.uniform(-turn, turn, 3)), rng.uniform(-far, far, 3))
    return A, frames.invert(X) @ A @ X


SPECIAL_MOTIONS = (
    (functools.partial(two_motions, far=1500.0), "right, but not for motions over a meter:"),
    (functools.partial(two_motions, turn=0.0), "right, but not for motions that do not turn:"),
    (functools.partial(two_motions, turn=1e-4), "right, but not for motions that hardly turn:"),
)


def triangle(rng, right_angle=False):
    """Both angles at a base, one of them perhaps a right one, and the base."""
    alpha = np.pi / 2 if right_angle else np.deg2rad(rng.uniform(35, 80))
    return float(alpha), float(np.deg2rad(rng.uniform(45, 75))), float(rng.uniform(30, 200))


def nearly_right_triangle(rng, sign, off):
    """One angle short of a right one or beyond it, by less than this (rad)."""
    return float(np.pi / 2 + sign * off * rng.uniform(0.2, 1.0)), *triangle(rng)[1:]


NEARLY_RIGHT = tuple(
    (
        functools.partial(nearly_right_triangle, sign=sign, off=off),
        f"right, but not for an angle less than {np.rad2deg(off):.2g}° from a right one:",
    )
    for sign in (1, -1)
    for off in (0.04, 5e-4)
)


def obtuse_triangle(rng):
    """The object stands beside the base."""
    return float(np.deg2rad(rng.uniform(95, 110))), float(np.deg2rad(rng.uniform(35, 60))), float(rng.uniform(30, 200))


def mirrored(rng, draw):
    """A triangle with both of its angles exchanged: the right or obtuse one stands at the other end."""
    alpha, beta, *others = draw(rng)
    return beta, alpha, *others


def flat_triangle(rng):
    """Both angles below 3 degrees, as for an object close above the base."""
    return *map(float, rng.uniform(0.03, 0.05, 2)), float(rng.uniform(30, 200))


def isosceles(rng):
    """Both angles alike."""
    angle = float(np.deg2rad(rng.uniform(35, 80)))
    return angle, angle, float(rng.uniform(30, 200))


def long_base(rng):
    """A base of many meters."""
    return *triangle(rng)[:2], float(rng.uniform(1e5, 1e6))


OTHER_TRIANGLES = (
    (flat_triangle, "right, but not where both angles are below 3°:"),
    (isosceles, "right, but not where both angles are alike:"),
    (long_base, "right, but not for a base longer than 100 m:"),
)


def with_noise(rng, draw, std):
    """A triangle and this noise of its angles."""
    return *draw(rng), std


SPECIAL_NOISE = (
    *((functools.partial(with_noise, draw=draw, std=0.005), words) for draw, words in OTHER_TRIANGLES),
    (functools.partial(with_noise, draw=triangle, std=1e-8), "right, but not for angles that err by 1e-8 rad only:"),
    (
        functools.partial(with_noise, draw=triangle, std=0.2),
        "right, but not for angles that err by 0.2 rad. To first order it is the derivative times std there too:",
    ),
    (functools.partial(with_noise, draw=triangle, std=0.0), "right, but not for angles that do not err:"),
)


def noisy_triangle(rng):
    return *triangle(rng), float(np.deg2rad(rng.uniform(0.01, 1.0)))


def noisy_right_triangle(rng):
    return *triangle(rng, right_angle=True), float(np.deg2rad(rng.uniform(0.01, 1.0)))


def noisy_obtuse_triangle(rng):
    return *obtuse_triangle(rng), float(np.deg2rad(rng.uniform(0.01, 1.0)))


def arrivals(rng, d=3, numbers=(5, 40)):
    """Where a robot was sent, and where it arrived so many times, in the plane or in space."""
    n = int(rng.integers(*numbers))
    command = rng.uniform(-500, 500, d)
    return command, command + rng.uniform(-3, 3, d) + rng.uniform(0.1, 1.0) * rng.normal(size=(n, d))


def only_arrivals(rng, d=3, numbers=(5, 40)):
    return arrivals(rng, d, numbers)[1:]


def close_arrivals(rng):
    """Arrivals within micrometers of the command and of one another."""
    command, reached = arrivals(rng)
    return command, command + 1e-3 * (reached - command)


def one_astray(rng):
    """Arrivals, one of which is 10 mm and more away from all others."""
    command, reached = arrivals(rng, numbers=(12, 20))
    reached[rng.integers(len(reached))] += rng.choice([-1, 1], 3) * rng.uniform(10, 30, 3)
    return command, reached


def always_there(rng):
    """Arrivals at one and the same place."""
    command, reached = arrivals(rng)
    return command, np.repeat(np.round(reached[:1]), 8, axis=0)


OTHER_ARRIVALS = (  # draw, least size that the tolerance is relative to, words
    (functools.partial(arrivals, d=1), 1.0, "right, but not along a line, d = 1:"),
    (functools.partial(arrivals, d=6), 1.0, "right, but not for six coordinates, d = 6:"),
    (functools.partial(arrivals, numbers=(200, 300)), 1.0, "right, but not for 200 arrivals and more:"),
    (close_arrivals, 0.0, "right, but not for arrivals within micrometers:"),
    (one_astray, 1.0, "right, but not where one arrival is far from all others. It counts like them:"),
    (always_there, 1.0, "right, but not where all arrivals are at one place:"),
)


def without_command(rng, draw):
    """Where a robot arrived, alone."""
    return draw(rng)[1:]


# --- wrong variants ---


def _spread(change):
    """Something else made of the distances of arrivals from their mean."""
    return lambda reached: float(change(np.linalg.norm(reached - reached.mean(0), axis=1)))


def _spread_of(l):
    """ISO 9283's number of any distances: their mean plus three standard deviations."""
    return float(l.mean() + 3 * l.std(ddof=1))


def marks_with(name, turn_deg=180.0, change=lambda T: T):
    """The way between both marks of the notebook's gauge (mm) with some pose of the scanner, the flange turned in between."""
    truth = _true_pose()
    T_BF, x_S = robot_accuracy.looking_down_at(GAUGE, truth, np.deg2rad([0.0, turn_deg]))
    T_FS = change(truth if name == "calibrated" else thesis.frame(name))
    p, q = frames.transform(T_BF, frames.transform(T_FS, x_S))
    return q - p


def length_with(*args, **kwargs):
    """Length of the gauge (mm), as it is measured so."""
    return float(np.linalg.norm(marks_with(*args, **kwargs)))


def _true_pose():
    """The scanner's pose on the flange, calibrated."""
    measured = thesis.measurements(True)
    return hand_eye.calibrate_sphere_target(measured.T_BF, measured.x_S).T_FS


def _found_with_cad():
    """Both marks of the gauge (mm) as the CAD pose gives them, the flange turned by half a turn in between."""
    T_BF, x_S = robot_accuracy.looking_down_at(GAUGE, _true_pose(), np.deg2rad([0.0, 180.0]))
    return frames.transform(T_BF, frames.transform(thesis.frame("scanner_start"), x_S))


def one_end():
    """How far one mark, measured with the CAD pose, is from where the other one is, mm: either as far."""
    return float(np.linalg.norm(_found_with_cad()[0] - GAUGE[1]))


def cad_offset():
    """How far the CAD pose is off the calibrated one, mm."""
    return float(np.linalg.norm(_true_pose()[:3, 3] - thesis.frame("scanner_start")[:3, 3]))


def place_error():
    """How far a mark comes out from its true place with the CAD pose, mm: both by as much."""
    return float(np.linalg.norm(_found_with_cad()[0] - GAUGE[0]))


def _height(change):
    """Something else made of the tangents of both angles and the base."""
    return lambda alpha, beta, base: change(np.tan(alpha), np.tan(beta), base)


def _std(change):
    """Something else made of both derivatives and the noise."""
    return lambda alpha, beta, base, std: change(*triangulation.height_derivatives(alpha, beta, base), std)


def _by_angles(alpha, beta, base, power=2, share=1.0):
    """Derivatives with another power of the height or another share of the base."""
    H = triangulation.height_from_angles(alpha, beta, base)
    return H**power / share / np.sin(alpha) ** 2, H**power / share / np.sin(beta) ** 2


def _by_tangents(alpha, beta, base, std):
    """The derivatives of tan in place of those of cot."""
    H = triangulation.height_from_angles(alpha, beta, base)
    return std * H**2 / base * np.hypot(1 / np.cos(alpha) ** 2, 1 / np.cos(beta) ** 2)


def _by_differences(alpha, beta, base, std, share, both):
    """Differences of the height, the step being so large a share of std, to one side or to both."""
    height, step = triangulation.height_from_angles, share * std

    def moved(up, to_the_side):
        ahead = height(alpha + step * up, beta + step * to_the_side, base)
        behind = height(alpha - step * up, beta - step * to_the_side, base) if both else height(alpha, beta, base)
        return (ahead - behind) / (1 + both) / share

    return np.hypot(moved(1, 0), moved(0, 1))


def _rotation(change):
    """The fit of moved to seen shifts with something else for one of them, or for what is made of their product."""

    def variant(T_BF, x_S):
        return change(T_BF[0, :3, :3], T_BF[:, :3, 3] - T_BF[:, :3, 3].mean(0), x_S - x_S.mean(0))

    return variant


def _orthonormal(X):
    """The nearest orthogonal matrix, reflections included."""
    return polar(X)[0]


def _without_det(R, t, x):
    return _orthonormal(-(t @ R).T @ x)


def _all_signs_turned(R, t, x):
    U, _, Vt = np.linalg.svd(-(t @ R).T @ x)
    return U @ Vt * np.linalg.det(U @ Vt)


def _fit(moved, seen):
    return nearest_rotation(moved.T @ seen)


def _translation(right=None, unknown=None, arrange=lambda u: (u[:3], u[3:])):
    """Step 2 with another right side, another matrix, or what is found arranged otherwise."""

    def variant(T_BF, x_S, R_FS):
        R, t = T_BF[:, :3, :3], T_BF[:, :3, 3]
        arm = (R @ (x_S @ R_FS.T)[..., None])[..., 0]
        design = unknown(R) if unknown else np.concatenate([R, np.tile(-np.eye(3), (len(R), 1, 1))], 2)
        b = right(R, t, arm, x_S, R_FS) if right else -(t + arm)
        return arrange(np.linalg.lstsq(design.reshape(-1, 6), b.ravel(), rcond=None)[0])

    return variant


def _kim(left, right, F):
    """D = left - right and F, from A and B."""
    return lambda A, B: (left(A) - right(B), F(A))


def _rows(A):
    return np.kron(A[:3, :3], np.eye(4))


def _turned_back(B):
    return np.kron(np.eye(3), B.T)


def _moved(A, sign=-1.0):
    F = np.zeros((3, 4))
    F[:, 3] = sign * A[:3, 3]
    return F.ravel()


class EitherSide(metrics.Several):
    """Equations D u = F: A X − X B and X B − A X say the same."""

    def admit(self, result, expected):
        D, F = super().admit(result, expected)
        reversed_ = self.metrics[0].equal(-D, expected[0])
        return [-D, -F] if reversed_ else [D, F]


EQUATIONS = EitherSide(metrics.Numbers(1e-9), metrics.Numbers(1e-9), names=("D", "F"))


def _by_columns(A, B):
    """The same equations for the columns of X one after another."""
    order = np.arange(12).reshape(3, 4).T.ravel()
    D, F = literature.kim_matrix(A, B)
    return D[np.ix_(order, order)], F[order]


ACCURACY = [
    Exercise(
        "position_accuracy",
        reference=robot_accuracy.position_accuracy,
        sizes=("command reached",),
        draw=(
            arrivals,
            functools.partial(arrivals, d=2),
            functools.partial(arrivals, numbers=(3, 4)),
            functools.partial(arrivals, numbers=(1, 2)),
        ),
        metric=metrics.Numbers(1e-9, "mm"),
        noisy=tuple((draw, metrics.Numbers(1e-8, "mm", least=least), words) for draw, least, words in OTHER_ARRIVALS),
        hints=(
            "First where the robot arrives on average, then how far that is from where it was sent.",
            "|mean of the arrivals − command|, one vector and its length.",
            "`return np.linalg.norm(reached.mean(axis=0) - command)`",
        ),
        mistakes=[
            Mistake(
                lambda command, reached: np.linalg.norm(reached - command, axis=1).mean(),
                "You took the mean of the distances, in which the scatter counts too. Take the distance of the mean.",
                id="accuracy-mean-distance",
            ),
            Mistake(
                lambda command, reached: np.sqrt(((reached - command) ** 2).sum(1).mean()),
                "This is the rms distance of the arrivals, scatter included. Take the distance of their mean.",
                id="accuracy-rms",
            ),
            Mistake(
                lambda command, reached: np.linalg.norm(reached - command, axis=1).max(),
                "This is the worst arrival. Accuracy is about their mean.",
                id="accuracy-worst",
            ),
            Mistake(
                lambda command, reached: np.abs(reached.mean(0) - command).sum(),
                "You added the absolute values of the parts. A distance is the root of the sum of squares.",
                id="accuracy-sum",
            ),
            Mistake(
                lambda command, reached: np.abs(reached.mean(0) - command).mean(),
                "This is the mean of the absolute parts. A distance is the root of the sum of squares.",
                id="accuracy-mean-of-parts",
            ),
            Mistake(
                lambda command, reached: np.abs(reached.mean(0) - command).max(),
                "This is the largest of the parts. A distance is the root of the sum of all their squares.",
                id="accuracy-largest",
            ),
            Mistake(
                lambda command, reached: np.linalg.norm(np.median(reached, axis=0) - command),
                "You took the median of each coordinate. The mean is meant.",
                id="accuracy-median",
            ),
            Mistake(
                lambda command, reached: np.linalg.norm(reached[0] - command),
                "One arrival is no average: use all of them.",
                id="accuracy-first",
            ),
            Mistake(
                lambda command, reached: np.linalg.norm(reached.mean() - command),
                "A mean without an axis averages over the coordinates as well. Write `reached.mean(axis=0)`.",
                id="accuracy-axis",
            ),
            Mistake(
                lambda command, reached: reached.mean(0) - command,
                "This is the vector from the command to the mean. The accuracy is its length.",
                id="accuracy-vector",
            ),
            Mistake(
                lambda command, reached: np.linalg.norm((reached - command).mean(axis=1)),
                "`mean(axis=1)` averages the coordinates of each arrival. The mean of the arrivals is `mean(axis=0)`.",
                id="accuracy-other-axis",
            ),
            Mistake(
                lambda command, reached: abs((reached - command).mean()),
                "This averages over the coordinates as well. Mean of the arrivals, `mean(axis=0)`, then the length of the difference.",
                id="accuracy-all-mean",
            ),
            Mistake(
                lambda command, reached: np.linalg.norm(reached.mean(0)),
                "This is how far the mean is from the origin: subtract the command.",
                id="accuracy-no-command",
            ),
            Mistake(
                lambda command, reached: np.abs(reached - command).mean(0),
                "These are mean deviations of each coordinate, signs lost. First the mean of the arrivals, then its distance from the command.",
                id="accuracy-coordinates",
            ),
            Mistake(
                lambda command, reached: np.linalg.norm((reached - command).sum(0)) / (len(reached) - 1),
                "The sum is divided by n − 1. A mean divides by n.",
                id="accuracy-n-1",
            ),
        ],
    ),
    Exercise(
        "repeatability",
        reference=robot_accuracy.repeatability,
        sizes=("reached",),
        draw=(only_arrivals, functools.partial(only_arrivals, d=2), functools.partial(only_arrivals, numbers=(3, 4))),
        metric=metrics.Numbers(1e-9, "mm"),
        noisy=(
            (
                functools.partial(only_arrivals, numbers=(2, 3)),
                metrics.Numbers(1e-9, "mm"),
                "Right for three arrivals and more. For two, which are equally far from their mean:",
            ),
            *(
                (functools.partial(without_command, draw=draw), metrics.Numbers(1e-8, "mm", least=least), words)
                for draw, least, words in OTHER_ARRIVALS
            ),
        ),
        hints=(
            "Where the robot was sent does not matter here: compare the arrivals with their own mean.",
            "l = distances of the arrivals from their mean; mean of l plus three standard deviations of l, the latter with n − 1 below the root.",
            "`l = np.linalg.norm(reached - reached.mean(axis=0), axis=1)\nreturn l.mean() + 3 * l.std(ddof=1)`",
        ),
        mistakes=[
            Mistake(
                _spread(lambda l: l.mean() + 3 * l.std()),
                "Your standard deviation divides by n: with n − 1 it is `l.std(ddof=1)`.",
                id="repeat-n",
            ),
            Mistake(
                _spread(lambda l: 3 * l.std(ddof=1)),
                "The mean of the distances is missing: mean + 3 standard deviations.",
                id="repeat-no-mean",
            ),
            Mistake(
                _spread(lambda l: l.mean()),
                "That is the mean distance alone. Three standard deviations come on top.",
                id="repeat-mean",
            ),
            Mistake(
                _spread(lambda l: l.mean() + l.std(ddof=1)),
                "One standard deviation on top of the mean; the definition takes three.",
                id="repeat-one",
            ),
            Mistake(
                _spread(lambda l: np.sqrt((l**2).mean())),
                "This is the rms distance. The definition takes the mean distance plus three standard deviations of it.",
                id="repeat-rms",
            ),
            Mistake(
                _spread(lambda l: l.mean() + 3 * l.var(ddof=1)),
                "You added three variances: take the root, `l.std(ddof=1)`.",
                id="repeat-variance",
            ),
            Mistake(
                lambda reached: _spread_of(np.linalg.norm(reached - reached[0], axis=1)),
                "You took the distances from the first arrival. They are taken from the mean of all.",
                id="repeat-from-first",
            ),
            Mistake(
                _spread(lambda l: l.max()),
                "That is the farthest arrival. It grows with the number of arrivals; the definition takes mean + 3 standard deviations.",
                id="repeat-worst",
            ),
            Mistake(
                _spread(lambda l: l.mean() + 3 * np.sqrt((l**2).sum() / (len(l) - 1))),
                "What you take three times is the root of the sum of the squared distances over n − 1; the standard deviations of the "
                "coordinates, put together, are the same. Meant is how much the distances differ among themselves: `l.std(ddof=1)`.",
                id="repeat-from-zero",
            ),
            Mistake(
                lambda reached: float(np.linalg.norm(reached.std(axis=0, ddof=1)) * 3),
                "This is three times the root of the sum of the squared distances over n − 1; the standard deviations of the coordinates, put together, give the same. Take the distances from the mean, one number an arrival: their mean, and three times how much they differ among themselves.",
                id="repeat-coordinates",
            ),
            Mistake(
                lambda reached: _spread_of(np.linalg.norm(reached, axis=1)),
                "The distances are taken from 0. They are those of the arrivals from their own mean.",
                id="repeat-from-origin",
            ),
            Mistake(
                _spread(lambda l: np.sqrt((l**2).sum() / (len(l) - 1))),
                "This is the spread of the arrivals about their mean, in one number. The definition takes the mean distance plus three standard "
                "deviations of the distances.",
                id="repeat-rms-n-1",
            ),
            Mistake(
                lambda reached: _spread_of(np.linalg.norm(reached - reached.mean(0), axis=0)),
                "One distance for each coordinate: `axis=0` runs down the arrivals. One for each arrival is `axis=1`.",
                id="repeat-axis",
            ),
            Mistake(
                lambda reached: _spread_of(np.linalg.norm(reached - np.median(reached, axis=0), axis=1)),
                "The distances are taken from the median. They are those from the mean.",
                id="repeat-median",
            ),
            Mistake(
                lambda reached: _spread_of(np.linalg.norm(np.diff(reached, axis=0), axis=1)),
                "These are distances between one arrival and the next. They are taken from the mean of all.",
                id="repeat-neighbors",
            ),
            Mistake(
                _spread(lambda l: l.mean() + 2 * l.std(ddof=1)),
                "Two standard deviations on top of the mean; the definition takes three.",
                id="repeat-two",
            ),
            Mistake(
                _spread(lambda l: l.mean() - 3 * l.std(ddof=1)),
                "The three standard deviations are subtracted: they come on top of the mean.",
                id="repeat-minus",
            ),
        ],
    ),
]

GAUGE = np.array([[1500.0, -650.0, 1100.0], [1500.0, -550.0, 1100.0]])  # mm, two marks 100 mm apart

CAD_LENGTH = Value(
    "cad_length",
    reference=lambda: length_with("scanner_start"),
    unit="mm",
    rtol=1e-3,
    of={"the way between both marks": lambda: marks_with("scanner_start")},
    hints=(
        "Bring both marks into the base with the CAD pose, and take their distance.",
        "p = T_BF T_FS x_S, mark by mark: `frames.transform` twice, with `cad` for T_FS and the poses `turned`.",
        "`p, q = frames.transform(turned, frames.transform(cad, seen))\ncad_length = np.linalg.norm(q - p)`",
    ),
    mistakes=[
        Mistake(
            lambda: length_with("calibrated"),
            "This is the true length. The calibrated pose gives it, and so does the CAD pose while the flange keeps its orientation "
            "(`alike`). Take `cad` with the poses `turned`.",
            id="length-calibrated",
        ),
        Mistake(
            lambda: length_with("scanner_end"),
            "This is the length with the thesis's end pose. Take `cad`, the pose it started from.",
            id="length-end-pose",
        ),
        Mistake(
            lambda: length_with("scanner_start") - 100.0,
            "This is by how much the length is wrong. Asked for is the length.",
            id="length-difference",
        ),
        Mistake(
            one_end,
            "One end of this is the mark as it is, from `marks`, the other one as it is measured. Take both as the CAD pose measures them.",
            id="length-one-end",
        ),
        Mistake(
            place_error,
            "This is how far a mark is off its place. Asked for is the distance between both marks, as the CAD pose gives it.",
            id="length-place",
        ),
        Mistake(
            lambda: length_with("scanner_start", 90.0),
            "This is the length after a quarter turn. The poses `turned` differ by half a turn.",
            id="length-quarter",
        ),
        Mistake(
            lambda: length_with("scanner_start", change=frames.invert),
            "The CAD pose is inverted here. `cad` takes coordinates in the scanner to the flange, as it stands.",
            id="length-inverted",
        ),
        Mistake(
            lambda: length_with("scanner_start", change=lambda T: np.eye(4)),
            "This comes out where the scanner's pose is missing, or comes after the robot's, where it changes no length. The marks are seen in its frame: first `cad` takes them to the flange.",
            id="length-no-scanner",
        ),
        Mistake(
            lambda: np.linalg.norm(GAUGE[1] - GAUGE[0]) + 2 * cad_offset(),
            "Twice the offset of the CAD pose is added to the true length, as if all of it were along the gauge. Compute where both marks land.",
            id="length-twice-offset",
        ),
        Mistake(
            lambda: np.linalg.norm(GAUGE[1] - GAUGE[0]) + cad_offset(),
            "The offset of the CAD pose is added to the true length, as if it were along the gauge. Compute where both marks land.",
            id="length-offset",
        ),
        Mistake(
            lambda: 164.0,
            "100 and twice 32 are added as if the CAD pose were off along the gauge. Compute where both marks land.",
            id="length-guessed",
        ),
    ],
)

TRIANGULATION = [
    Exercise(
        "height_from_angles",
        reference=triangulation.height_from_angles,
        sizes=("base",),
        draw=(
            triangle,
            functools.partial(triangle, right_angle=True),
            obtuse_triangle,
            functools.partial(mirrored, draw=obtuse_triangle),
        ),
        metric=metrics.Numbers(1e-9, "mm"),
        noisy=tuple((draw, metrics.Numbers(1e-9, "mm"), words) for draw, words in (*NEARLY_RIGHT, *OTHER_TRIANGLES)),
        hints=(
            "Drop the height: it cuts the base in two parts, and each belongs to a right triangle.",
            "L = H / tan α + H / tan β. Solve for H.",
            "`return base / (1 / np.tan(alpha) + 1 / np.tan(beta))`",
        ),
        mistakes=[
            Mistake(
                _height(lambda a, b, L: L * (1 / a + 1 / b)),
                "You multiplied by the sum of 1/tan: L = H (1/tan α + 1/tan β), so H is L divided by it.",
                id="height-inverse",
            ),
            Mistake(
                lambda alpha, beta, base: base * np.tan(alpha) * np.tan(beta) / np.tan(alpha + beta),
                "The sum of two tangents is not the tangent of the sum: L tan α tan β/(tan α + tan β).",
                id="height-tangent-of-sum",
            ),
            Mistake(
                _height(lambda a, b, L: L / (a + b)),
                "The tangents stand in the denominators: L = H/tan α + H/tan β, not H tan α + H tan β.",
                id="height-tangents",
            ),
            Mistake(
                _height(lambda a, b, L: (a + b) / (a * b * L)),
                "This is 1/H, upside down: (2-12) is L tan α tan β over the sum of the tangents.",
                id="height-upside-down",
            ),
            Mistake(
                _height(lambda a, b, L: L * a * b / (b - a)),
                "You subtracted. The two parts of the base add up to L, so 1/tan α and 1/tan β are added.",
                id="height-minus",
            ),
            Mistake(
                _height(lambda a, b, L: L * b / (a + b)),
                "This is the part of the base on the side of α. The height is tan α times that.",
                id="height-part",
            ),
            Mistake(
                _height(lambda a, b, L: L * b),
                "This takes α for a right angle. Its part of the base, H/tan α, counts as well.",
                id="height-right-angle",
            ),
            Mistake(
                lambda alpha, beta, base: base / 2 * np.tan((alpha + beta) / 2),
                "This is the height of a triangle with two equal sides, whose angles are the mean of both. Here they differ.",
                id="height-of-equal-sides",
            ),
            Mistake(
                lambda alpha, beta, base: triangulation.height_from_angles(np.deg2rad(alpha), np.deg2rad(beta), base),
                "The angles are in rad already: `np.tan` takes them as they are.",
                id="height-degrees",
            ),
            Mistake(
                lambda alpha, beta, base: base * np.sin(alpha) * np.sin(beta) / (np.sin(alpha) + np.sin(beta)),
                "With sines in place of tangents the sum is another one: it is sin(α + β) then, or take tangents.",
                id="height-sines",
            ),
            Mistake(
                lambda alpha, beta, base: base * np.sin(beta) / np.sin(alpha + beta),
                "This is the length of the ray from the end at α to the object. Its height is sin α times that.",
                id="height-ray",
            ),
            Mistake(
                lambda alpha, beta, base: base * np.sin(alpha) / np.sin(alpha + beta),
                "This is the length of the ray from the end at β to the object. Its height is sin β times that.",
                id="height-other-ray",
            ),
            Mistake(
                _height(lambda a, b, L: L * a * b / (a - b)),
                "The denominator holds a difference, of the tangents or in the sine, where a sum belongs: H = L tan α tan β / (tan α + tan β) = L sin α sin β / sin(α + β).",
                id="height-minus-reversed",
            ),
            Mistake(
                _height(lambda a, b, L: L * (a + b)),
                "The base is multiplied by the sum of both tangents. H = L / (1/tan α + 1/tan β).",
                id="height-times-tangents",
            ),
            Mistake(
                _height(lambda a, b, L: L / 2 * b),
                "This cuts the base in the middle, which is right only where both angles are alike. The height cuts it in H/tan α and H/tan β.",
                id="height-half-base",
            ),
            Mistake(
                lambda alpha, beta, base: base * np.sin(alpha) * np.sin(beta),
                "The sine of the third angle is missing: L sin α sin β / sin(α + β).",
                id="height-third-sine",
            ),
            Mistake(
                lambda alpha, beta, base: base / (1 / np.cos(alpha) + 1 / np.cos(beta)),
                "Cosines stand where tangents belong: in a right triangle with the height H, the other leg is H/tan α.",
                id="height-cosine",
            ),
        ],
    ),
    Exercise(
        "height_std",
        reference=triangulation.height_std,
        sizes=("base", "std"),
        draw=(
            noisy_triangle,
            noisy_right_triangle,
            noisy_obtuse_triangle,
            functools.partial(mirrored, draw=noisy_obtuse_triangle),
        ),
        metric=metrics.Numbers(1e-5, "mm"),
        noisy=tuple((draw, metrics.Numbers(1e-4, "mm", least=0.0), words) for draw, words in SPECIAL_NOISE),
        hints=(
            "How much does H change when one angle changes a little? Differentiate L = H (cot α + cot β), with L fixed.",
            "The derivative of cot α is −1/sin² α, so ∂H/∂α = H²/(L sin² α), and alike for β. Independent errors add up in their squares.",
            "`H = height_from_angles(alpha, beta, base)\nby_alpha, by_beta = (H**2 / (base * np.sin(a) ** 2) for a in (alpha, beta))\n"
            "return std * np.hypot(by_alpha, by_beta)`",
        ),
        mistakes=[
            Mistake(
                _std(lambda a, b, s: s * (a + b)),
                "You added the two effects as if both angles erred alike. Independent errors add up in their squares.",
                id="std-sum",
            ),
            Mistake(
                _std(lambda a, b, s: s**2 * (a * a + b * b)),
                "This is the variance: take the root.",
                id="std-variance",
            ),
            Mistake(
                _std(lambda a, b, s: s * (a * a + b * b)),
                "The root covers the derivatives as well: std √((∂H/∂α)² + (∂H/∂β)²).",
                id="std-root",
            ),
            Mistake(
                _std(lambda a, b, s: s * b),
                "Only β errs here. Both angles do.",
                id="std-beta",
            ),
            Mistake(
                _std(lambda a, b, s: s * a),
                "Only α errs here. Both angles do.",
                id="std-alpha",
            ),
            Mistake(
                lambda alpha, beta, base, std: std * np.hypot(*_by_angles(alpha, beta, base)),
                "Your result is L times what it should be: ∂H/∂α = H²/(L sin² α). A longer base makes the height better.",
                id="std-no-base",
            ),
            Mistake(
                lambda alpha, beta, base, std: std * np.hypot(*_by_angles(alpha, beta, base, 1)),
                "H enters squared, and L divides: ∂H/∂α = H²/(L sin² α).",
                id="std-linear",
            ),
            Mistake(
                lambda alpha, beta, base, std: (
                    std
                    * triangulation.height_from_angles(alpha, beta, base) ** 2
                    / base
                    * np.hypot(1 / np.sin(alpha), 1 / np.sin(beta))
                ),
                "Under the root belong the fourth powers of the sines: the derivative of cot α is −1/sin² α, and it enters squared.",
                id="std-sine",
            ),
            Mistake(
                lambda alpha, beta, base, std: (
                    np.deg2rad(std) * np.hypot(*triangulation.height_derivatives(alpha, beta, base))
                ),
                "std is in rad already.",
                id="std-degrees",
            ),
            *(
                Mistake(
                    functools.partial(_by_differences, share=share, both=both),
                    "You moved each angle by a whole standard deviation, or half of it. To first order it is the derivative times std: "
                    "take a small step, or the formula.",
                    id=id,
                )
                for share, both, id in (
                    (1.0, False, "std-finite"),
                    (1.0, True, "std-finite-both"),
                    (0.5, True, "std-finite-half"),
                )
            ),
            Mistake(
                _std(lambda a, b, s: s * np.hypot(a, b) / 2),
                "Your result is half of what it should be: no mean of the two effects is asked for, and a difference over one step is divided by one step.",
                id="std-mean",
            ),
            Mistake(
                lambda alpha, beta, base, std: np.hypot(*triangulation.height_derivatives(alpha, beta, base)),
                "std is missing: this is by how much the height errs for one rad.",
                id="std-missing",
            ),
            Mistake(
                lambda alpha, beta, base, std: std * np.hypot(*_by_angles(alpha, beta, base, 1, base)),
                "H enters squared: ∂H/∂α = H²/(L sin² α).",
                id="std-height-once",
            ),
            Mistake(
                lambda alpha, beta, base, std: std * triangulation.height_from_angles(alpha, beta, base),
                "This is H times std. How much H changes with an angle is its derivative, H²/(L sin² α) for α.",
                id="std-times-height",
            ),
            Mistake(
                lambda alpha, beta, base, std: (
                    triangulation.height_from_angles(alpha + std, beta + std, base)
                    - triangulation.height_from_angles(alpha, beta, base)
                ),
                "Both angles are raised at once, as if they erred alike. Independent errors add up in their squares.",
                id="std-both-at-once",
            ),
            Mistake(
                _std(lambda a, b, s: s * abs(a - b)),
                "The two effects are subtracted, as if one angle erred upward whenever the other errs downward. Independent errors add up in their squares.",
                id="std-subtracted",
            ),
            Mistake(
                _by_tangents,
                "The derivative is that of tan, 1/cos². In L = H (cot α + cot β) stand cotangents: −1/sin².",
                id="std-cosine",
            ),
            Mistake(
                _std(lambda a, b, s: 3 * s * np.hypot(a, b)),
                "These are three standard deviations. One is asked for.",
                id="std-three",
            ),
            Mistake(
                _std(lambda a, b, s: s * np.sqrt(abs(a * a - b * b))),
                "The squares are subtracted. Independent errors add up in their squares.",
                id="std-squares-subtracted",
            ),
        ],
    ),
]

STEP_2 = metrics.Several(*2 * (metrics.Numbers(1e-6, "mm"),), names=("t_FS", "target"))
NOISY_STEP_2 = metrics.Several(  # differences from one pose are weighed otherwise, and right as well
    *2 * (metrics.Numbers(0.3, "mm", absolute=True),), names=("t_FS", "target")
)

LITERATURE = [
    Exercise(
        "li_rotation",
        reference=literature.li_rotation,
        draw=(
            translated_poses,
            functools.partial(translated_poses, directions=2),
            functools.partial(translated_poses, directions=2, n=3),
        ),
        metric=metrics.Rotations(1e-6),
        noisy=(
            (functools.partial(translated_poses, std=0.01), metrics.Rotations(0.2)),
            (
                nearly_in_a_plane,
                metrics.Rotations(5.0),
                "right where the moves fill space, but not where they lie nearly in a plane:",
            ),
            (
                visited_twice,
                metrics.Rotations(1e-6),
                "right, but not where the second and the third of four poses are at one place (is each of them heard?):",
            ),
            (
                first_ones_on_a_line,
                metrics.Rotations(0.5),
                "right without noise, but not for noisy poses that lie nearly on a line, all but three (are all heard?):",
            ),
            *2  # a turn about the line that nothing tells may be nearly right by chance
            * (
                (
                    functools.partial(first_ones_on_a_line, numbers=(40, 50)),
                    metrics.Rotations(0.5),
                    "right without noise, but not for 40 noisy poses and more nearly on a line, all but three (are all heard?):",
                ),
            ),
        ),
        hints=(
            "Subtract the equations of two poses: target and t_FS drop out, and R_FS alone is left.",
            "In the flange's frame it reads R_FS (x_q − x_p) = −R_BFᵀ (t_q − t_p). Sum the outer products (right side)(left side)ᵀ over all poses, both "
            "sides taken from their means, and take the nearest rotation.",
            "`R_BF = T_BF[0, :3, :3]\nseen = x_S - x_S.mean(axis=0)\nmoved = -(T_BF[:, :3, 3] - T_BF[:, :3, 3].mean(axis=0)) @ R_BF\n"
            "return nearest_rotation(moved.T @ seen)`",
        ),
        mistakes=[
            Mistake(
                _rotation(lambda R, t, x: _fit(t @ R, x)),
                "This is what (2-41) gives as it is printed. If the flange moves one way, the sphere moves the other way in the scanner: the right side is T_01 − T_02.",
                id="li-sign",
            ),
            Mistake(
                _rotation(lambda R, t, x: _fit(-t, x)),
                "This is R_BF R_FS: the robot's orientation is still in it. Bring the moves of the flange into its own frame, R_BFᵀ (t_p − t_q).",
                id="li-in-base",
            ),
            Mistake(
                _rotation(lambda R, t, x: _fit(-t @ R.T, x)),
                "You turned the moves by R_BF. They are given in the base: R_BFᵀ brings them into the flange.",
                id="li-untransposed",
            ),
            Mistake(
                _rotation(lambda R, t, x: _fit(-t @ R, x).T),
                "This is the transpose: it turns from the flange into the scanner. R_FS turns what is seen into what was moved, so sum (moved)(seen)ᵀ.",
                id="li-transposed",
            ),
            Mistake(
                _rotation(_without_det),
                "Where all moves lie in one plane, U Vᵀ can be a reflection. `nearest_rotation` looks at the determinant.",
                id="li-reflection",
            ),
            Mistake(
                _rotation(_all_signs_turned),
                "Where all moves lie in one plane, U Vᵀ can be a reflection, and you change all of its signs: that is a rotation, half a turn away "
                "from the nearest one. Only the last column of U changes its sign: `nearest_rotation` does it.",
                id="li-reflection-all-signs",
            ),
            Mistake(
                _rotation(lambda R, t, x: (-t @ R).T @ x),
                "The sum of the outer products is no rotation yet: take the nearest one.",
                id="li-sum",
            ),
            Mistake(
                lambda T, x: _fit(-T[:, :3, 3] @ T[0, :3, :3], x),
                "You used positions. Only their differences tell of R_FS: take both sides from their means.",
                id="li-positions",
            ),
            Mistake(
                lambda T, x: _fit(-(T[1:2, :3, 3] - T[:1, :3, 3]) @ T[0, :3, :3], x[1:2] - x[:1]),
                "One move leaves the turn about its direction free. Use all poses.",
                id="li-one-move",
            ),
            Mistake(
                lambda T, x: _fit(np.diff(T[:, :3, 3], axis=0) @ T[0, :3, :3], np.diff(x, axis=0)),
                "The sign is that of (2-41) as it is printed. If the flange moves one way, the sphere moves the other way in the scanner: the right "
                "side is T_01 − T_02.",
                id="li-sign-differences",
            ),
            Mistake(
                lambda T, x: _fit((T[1:, :3, 3] - T[0, :3, 3]) @ T[0, :3, :3], x[1:] - x[0]),
                "The sign is that of (2-41) as it is printed. If the flange moves one way, the sphere moves the other way in the scanner: the right "
                "side is T_01 − T_02.",
                id="li-sign-from-the-first",
            ),
            Mistake(
                lambda T, x: _fit(np.diff(T[:, :3, 3], axis=0), np.diff(x, axis=0)),
                "R_BF is missing, and the sign is that of (2-41) as it is printed. In the flange's frame: R_FS (x_q − x_p) = −R_BFᵀ (t_q − t_p).",
                id="li-as-printed",
            ),
            Mistake(
                _rotation(lambda R, t, x: _fit(t, x)),
                "R_BF is missing, and the sign is that of (2-41) as it is printed. In the flange's frame: R_FS (x_q − x_p) = −R_BFᵀ (t_q − t_p).",
                id="li-as-printed-means",
            ),
            Mistake(
                _rotation(lambda R, t, x: np.linalg.lstsq(x, -t @ R, rcond=None)[0].T),
                "Least squares over all nine entries gives no rotation where the moves lie nearly in a plane or noise is about: sum the outer products "
                "and take the nearest rotation.",
                id="li-nine-entries",
            ),
            Mistake(
                lambda T, x: (
                    np.linalg.lstsq(np.diff(x, axis=0), -np.diff(T[:, :3, 3], axis=0) @ T[0, :3, :3], rcond=None)[0].T
                ),
                "Least squares over all nine entries gives no rotation where the moves lie nearly in a plane or noise is about: sum the outer products "
                "and take the nearest rotation.",
                id="li-nine-entries-differences",
            ),
            *(
                Mistake(
                    _rotation(lambda R, t, x, nearest=nearest: nearest(np.linalg.lstsq(x, -t @ R, rcond=None)[0].T)),
                    "These are nine entries found by least squares, made orthonormal afterwards. Where the moves lie nearly in a plane they tell "
                    "little of one direction, and noise decides it: sum the outer products instead, and take `nearest_rotation` of the sum.",
                    id=f"li-nine-entries-{words}",
                )
                for nearest, words in ((nearest_rotation, "turned"), (_orthonormal, "as-it-comes"))
            ),
        ],
    ),
    Exercise(
        "li_translation",
        reference=literature.li_translation,
        draw=(turned_poses, functools.partial(turned_poses, n=3)),
        fixed={"R_FS": ROTATION},
        metric=STEP_2,
        noisy=(
            (hardly_turned, STEP_2, "right, but not for poses that turn by a degree or two, without noise:"),
            (two_turned_alike, STEP_2, "right, but not where two of four poses have one orientation:"),
            (
                first_ones_turned_alike,
                NOISY_STEP_2,
                "right without noise, but not for noisy poses that hardly turn, all but four (are all heard?):",
            ),
            (
                functools.partial(first_ones_turned_alike, numbers=(40, 50)),
                NOISY_STEP_2,
                "right without noise, but not for 40 noisy poses and more that hardly turn, all but four (are all heard?):",
            ),
        ),
        hints=(
            "With R_FS known, (2-40) is linear in what is left: t_FS and the target, six numbers.",
            "Each pose gives R_BF t_FS − target = −(t_BF + R_BF R_FS x_S), three rows: R_BF beside −I. Stack the rows of all poses, and solve for six numbers by least squares.",
            "`R, t = T_BF[:, :3, :3], T_BF[:, :3, 3]\nrows = np.vstack([np.hstack([R_i, -np.eye(3)]) for R_i in R])\n"
            "right = np.concatenate([-(t_i + R_i @ R_FS @ x) for R_i, t_i, x in zip(R, t, x_S)])\n"
            "u = np.linalg.lstsq(rows, right, rcond=None)[0]\nreturn u[:3], u[3:]`",
        ),
        mistakes=[
            Mistake(
                _translation(right=lambda R, t, arm, x, R_FS: t + arm),
                "Both results have the wrong sign: R_BF t_FS − target = −(t_BF + R_BF R_FS x_S), with a minus on the right.",
                id="step2-sign",
            ),
            Mistake(
                _translation(right=lambda R, t, arm, x, R_FS: -t),
                "The sphere as the scanner sees it is missing: the right side is −(t_BF + R_BF R_FS x_S).",
                id="step2-no-sphere",
            ),
            Mistake(
                _translation(right=lambda R, t, arm, x, R_FS: -arm),
                "The flange's own position is missing: the right side is −(t_BF + R_BF R_FS x_S).",
                id="step2-no-flange",
            ),
            Mistake(
                _translation(right=lambda R, t, arm, x, R_FS: arm - t),
                "t_BF and R_BF R_FS x_S go to the right side together, with one sign: R_BF t_FS − target = −(t_BF + R_BF R_FS x_S).",
                id="step2-one-sign",
            ),
            Mistake(
                _translation(right=lambda R, t, arm, x, R_FS: -(t + x @ R_FS.T)),
                "R_FS x_S is written in the flange. R_BF brings it into the base.",
                id="step2-in-flange",
            ),
            Mistake(
                _translation(right=lambda R, t, arm, x, R_FS: -(t + (R @ x[..., None])[..., 0])),
                "x_S is written in the scanner: R_FS is missing between R_BF and x_S.",
                id="step2-no-rotation",
            ),
            Mistake(
                _translation(right=lambda R, t, arm, x, R_FS: -(t + (R @ (x @ R_FS)[..., None])[..., 0])),
                "R_FS enters transposed: `x_S @ R_FS` turns the rows back. Write `R_FS @ x` for one, `x_S @ R_FS.T` for all.",
                id="step2-transposed",
            ),
            Mistake(
                _translation(
                    unknown=lambda R: np.concatenate([np.swapaxes(R, 1, 2), np.tile(-np.eye(3), (len(R), 1, 1))], 2)
                ),
                "Your rows hold R_BFᵀ. t_FS is written in the flange, and R_BF brings it into the base.",
                id="step2-rows",
            ),
            Mistake(
                _translation(arrange=lambda u: (u[:3], -u[3:])),
                "The target has the wrong sign: it stands with −I on the left.",
                id="step2-target-sign",
            ),
            Mistake(
                _translation(arrange=lambda u: (u[3:], u[:3])),
                "The two results have changed places: t_FS comes first.",
                id="step2-order",
            ),
        ],
    ),
    Exercise(
        "kim_system",
        reference=literature.kim_matrix,
        draw=two_motions,
        fixed={"A": POSE, "B": POSE},
        metric=EQUATIONS,
        noisy=tuple((draw, EQUATIONS, words) for draw, words in SPECIAL_MOTIONS),
        hints=(
            "Write entry (1, 1) of A X and of X B out, then (1, 2): which u's appear, with which factors? X's last row is 0 0 0 1.",
            "With the rows of X one after another, A X is (A₃ₓ₃ ⊗ I₄) u plus the last column of A, which has no u and goes to F; X B is (I₃ ⊗ Bᵀ) u.",
            "`D = np.kron(A[:3, :3], np.eye(4)) - np.kron(np.eye(3), B.T)\nF = np.zeros(12)\nF[3::4] = -A[:3, 3]\nreturn D, F`",
        ),
        mistakes=[
            Mistake(
                lambda A, B: (_rows(A) - _rows(B), _moved(A) - _moved(B)),
                "These are the equations of A X = B X, as (2-43) prints it. (2-44) and the appendix have A X = X B.",
                id="kim-as-printed",
            ),
            Mistake(
                lambda A, B: (_rows(A) - _rows(B), _moved(A)),
                "This D is that of A X = B X, as (2-43) prints it. (2-44) and the appendix have A X = X B.",
                id="kim-as-printed-left",
            ),
            Mistake(
                _kim(_rows, lambda B: -_turned_back(B), _moved),
                "You added X B. It stands on the other side: A X − X B = 0.",
                id="kim-plus",
            ),
            Mistake(
                _kim(_rows, lambda B: np.kron(np.eye(3), B), _moved),
                "Bᵀ belongs where your D holds B: row i of X B is Bᵀ times row i of X.",
                id="kim-untransposed",
            ),
            Mistake(
                _kim(_rows, _turned_back, lambda A: _moved(A, 1.0)),
                "F has the wrong sign for this D: with A X − X B the last column of A goes to F with a minus, with X B − A X with a plus.",
                id="kim-sign",
            ),
            Mistake(
                _kim(_rows, _turned_back, lambda A: np.zeros(12)),
                "F is zero, but the 1 in X's last row leaves the last column of A without a u: it goes to F, with a minus beside A X − X B.",
                id="kim-no-right-side",
            ),
            Mistake(
                _kim(_rows, _turned_back, lambda A: np.concatenate([np.zeros(9), -A[:3, 3]])),
                "F has its entries at the end. They belong to the fourth equation of each row of X: places 4, 8, 12.",
                id="kim-places",
            ),
            Mistake(
                _by_columns,
                "These are the columns of X one after another. Appendix A takes the rows: u1 to u4 are x11 to x14.",
                id="kim-columns",
            ),
            Mistake(
                lambda A, B: (np.kron(A, np.eye(4)) - np.kron(np.eye(4), B.T), np.zeros(16)),
                "Sixteen equations: the last row of X is known, 0 0 0 1. Leave it out, and its 1 fills F.",
                id="kim-sixteen",
            ),
            Mistake(
                _kim(lambda A: np.kron(A[:3, :3].T, np.eye(4)), _turned_back, _moved),
                "A enters transposed. Row i of A X is the sum of a_ik times row k of X: A₃ₓ₃ ⊗ I₄ as it stands.",
                id="kim-A-transposed",
            ),
            Mistake(
                lambda A, B: (_turned_back(A) - _rows(B), -_moved(B)),
                "These are the equations of X A = B X. A and B have changed sides: A X = X B.",
                id="kim-sides",
            ),
            *(
                Mistake(
                    lambda A, B, sign=sign: (literature.kim_matrix(A, B)[0], sign * _moved(B)),
                    "F holds the last column of B. The 1 in X's last row meets the last column of A.",
                    id=f"kim-F-of-B{also}",
                )
                for sign, also in ((1, ""), (-1, "-plus"))
            ),
        ],
    ),
]
