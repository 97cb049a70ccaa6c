"""Chapter 5: hand-eye calibration of a line scanner, from one scan line to 31 audited poses."""

import functools
from collections import Counter

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

from ...calibration import hand_eye, planning, robust, sphere
from ...documents import misprints
from ...documents.thesis import printed as thesis
from ...estimation.differences import numeric_jacobian
from ...exercises import metrics
from ...exercises.engine import Chapter, Exercise, Prediction
from ...exercises.outcome import Mistake
from ...exercises.value import Value
from ...exercises.whole import QUARTER_TURNS
from ...geometry import frames, lie
from ...geometry.chaining import orthonormality_error
from ...geometry.lie import exp_so3, skew
from . import beyond

POSE, POINT = "a pose is always 4 x 4", "a point is always three numbers"
SUBSTITUTES = {("C14", 12, "A_deg"): ("C14", 12, "C_deg")}  # only A - C counts there: either answer is right


# --- draws -----------------------------------------------------------------------------------------------------------


def random_rotation(rng, angle=1.0):
    axis = frames.unit_vector(rng.normal(size=3))
    return exp_so3(angle * rng.uniform(0.3, 1.0) * axis)


def random_scanner(rng):
    return frames.pose(random_rotation(rng, 2.5), rng.uniform(-150, 150, 3))


def scene(rng, n=None, std=0.0):
    """Scanner, robot poses, sphere centers and target of a small calibration; their number differs, it is never 6."""
    n = n or int(rng.integers(9, 14))
    T_FS, target = random_scanner(rng), rng.uniform(-900, 900, 3)
    R = exp_so3(rng.uniform(-1.2, 1.2, (n, 3)))
    x_S = np.column_stack([rng.uniform(-25, 25, n), rng.uniform(-20, 20, n), rng.uniform(190, 290, n)])
    T_BF = frames.pose(R, target - (R @ frames.transform(T_FS, x_S)[..., None])[..., 0])
    return T_FS, T_BF, x_S + std * rng.normal(size=(n, 3)), target


def noisy_scene(rng):
    """Poses and noisy centers whose linear equations give nine numbers that are visibly no rotation."""
    while True:
        _, T_BF, x_S, _ = scene(rng, n=12, std=0.05)
        if orthonormality_error(_linear_without_rotation(T_BF, x_S)[0]) > 2e-3:
            return T_BF, x_S


def first_ones_alike(rng, numbers=(14, 20), turn=0.003):
    """Noisy poses of which all but the last six hardly turn: the first ones alone tell next to nothing."""
    T_FS, T_BF, x_S, target = scene(rng, n=int(rng.integers(*numbers)))
    R = T_BF[0, :3, :3] @ exp_so3(rng.uniform(-turn, turn, (len(x_S) - 6, 3)))
    T_BF[:-6] = frames.pose(R, target - (R @ frames.transform(T_FS, x_S[:-6])[..., None])[..., 0])
    return T_BF, x_S + 0.02 * rng.normal(size=x_S.shape)


def just_enough(rng):
    """Five poses, fifteen equations for fifteen unknowns: without one of them nothing is determined."""
    while True:
        _, T_BF, x_S, _ = scene(rng, n=5)
        if np.linalg.cond(_linear_equations(T_BF, x_S)) < 3e4:
            return T_BF, x_S


MANY = 120  # more poses than the thesis's 31
# some ten rows, one, many, and as many as columns: which of them are which is asked there
COUNTS = (None, 1, MANY, 3)


def kuka_scene(rng, n=None):
    """A KUKA pose (mm, rad) somewhat off the true scanner, with poses, centers and target."""
    T_FS, T_BF, x_S, target = scene(rng, n)
    return (
        frames.kuka_from_matrix(T_FS) + np.append(rng.uniform(-5, 5, 3), rng.uniform(-0.1, 0.1, 3)),
        T_BF,
        x_S,
        target,
    )


def kuka_turned(rng, B, further=0.0):
    """The same with this angle B, and with A and C so many radians further."""
    p2, *others = kuka_scene(rng)
    p2[3:] = p2[3] + further, B, p2[5] - further
    return p2, *others


def kuka_almost_there(rng):
    """A KUKA pose so near the true scanner that all residuals are below 0.001 mm."""
    T_FS, T_BF, x_S, target = scene(rng)
    return frames.kuka_from_matrix(T_FS) + rng.uniform(-1e-6, 1e-6, 6), T_BF, x_S, target


SPECIAL_KUKA = (
    *(
        (functools.partial(kuka_turned, B=B), "right, but not at the pole, where B is 90° or −90°:")
        for B in (np.pi / 2, -np.pi / 2)
    ),
    (
        functools.partial(kuka_turned, B=2.0, further=2 * np.pi),
        "right, but not for angles beyond a half turn, or of a B beyond 90°:",
    ),
    (kuka_almost_there, "right, but not where all residuals are below 0.001 mm:"),
)


def pose_off(rng, n=None, turn=0.15, shift=8):
    """A scanner pose off the truth by some degrees and millimeters."""
    T_FS, T_BF, x_S, target = scene(rng, n)
    return (
        frames.pose(T_FS[:3, :3] @ random_rotation(rng, turn), T_FS[:3, 3] + rng.uniform(-shift, shift, 3)),
        T_BF,
        x_S,
        target,
    )


def close_to_the_scanner(rng):
    """The same without the target, of a sphere so close to the scanner's origin that a turn moves it as little as a shift."""
    T_FS, T_BF, x_S, _ = pose_off(rng)
    return T_FS, T_BF, 1e-3 * x_S


def few_poses(rng):
    """Three poses that determine the step well."""
    while True:
        T_FS, T_BF, x_S, target = pose_off(rng, 3)
        if np.linalg.cond(analytic_jacobian(T_FS, T_BF, x_S)) < 5e3:
            return T_FS, T_BF, x_S, target


def fitting_exactly(rng):
    """A scanner pose from which nothing is left over, in quarter turns and whole millimeters: the step is 0, not nearly."""
    T_FS = frames.pose(QUARTER_TURNS[rng.integers(24)].astype(float), rng.integers(-150, 150, 3).astype(float))
    n, target = int(rng.integers(9, 14)), rng.integers(-900, 900, 3).astype(float)
    x_S = np.column_stack([rng.integers(-25, 25, n), rng.integers(-20, 20, n), rng.integers(190, 290, n)]).astype(float)
    R = QUARTER_TURNS[rng.permutation(24)[:n]].astype(float)
    return T_FS, frames.pose(R, target - (R @ frames.transform(T_FS, x_S)[..., None])[..., 0]), x_S, target


def one_far_off(rng):
    """A scanner pose a little off the truth, and one sphere center off by a decimeter and more: good differences, off by
    1e-8, leave some 1e-6 mm of that.
    """
    T_FS, T_BF, x_S, target = pose_off(rng, turn=0.03, shift=3)
    x_S[rng.integers(len(x_S))] += rng.choice([-1, 1], 3) * rng.uniform(80, 160, 3)
    return T_FS, T_BF, x_S, target


def turned_far(rng):
    """The same off by any turn."""
    T_FS, T_BF, x_S, target = scene(rng)
    start = frames.pose(T_FS[:3, :3] @ random_rotation(rng, 3.1), T_FS[:3, 3] + rng.uniform(-8, 8, 3))
    return start, T_BF, x_S, target


UPHILL = (
    6513,
    7667,
    8731,
    11025,
    12939,
)  # seeds of such scenes in which the residuals grow with a Gauss-Newton step: one in some thousand


def uphill(rng):
    """One of these scenes, seen from another base and by a scanner with other axes: as long residuals, other numbers."""
    T_FS, T_BF, x_S, target = turned_far(np.random.default_rng(rng.choice(UPHILL)))
    base, axes = random_scanner(rng), random_rotation(rng, 3.0)
    return T_FS @ frames.pose(axes.T, np.zeros(3)), base @ T_BF, x_S @ axes.T, frames.transform(base, target)


def smooth_function(rng, m=None, n=None, step=(0.03, 0.08), size=1.0, away=0.0):
    """A curved function of some variables, of some size, a place, and a step large enough to tell the schemes apart."""
    sizes = rng.choice(np.arange(2, 6), 2, replace=False)
    m, n = m or sizes[0], n or sizes[1]
    M, c = rng.normal(size=(m, n)), rng.normal(size=m)
    x = rng.normal(size=n) + away * rng.choice([-1, 1], n)
    return (lambda x: size * (np.sin(M @ x) + c * (x @ x))), x, float(rng.uniform(*step))


def some_at_nought(rng):
    """A curved function at a place of which some variables are 0."""
    f, x, step = smooth_function(rng)
    x[: len(x) - 1] = 0
    return f, rng.permutation(x), step


def returning_a_view(rng):
    """A function that turns its variables around, in the very array that it is given: where that changes, they do."""
    return (lambda x: x[::-1]), rng.normal(size=4), float(rng.uniform(0.03, 0.08))


SPECIAL_FUNCTIONS = (  # what is special, tolerance, least size it is relative to, words
    ({"m": 3, "n": 3}, 1e-9, 1.0, "right, but not for as many values as variables:"),
    ({"m": 2, "n": 8}, 1e-9, 1.0, "right, but not for eight variables:"),
    ({"step": (3e-5, 1e-4)}, 1e-8, 1.0, "right, but not with a step below 1e-4:"),
    ({"step": (1, 3)}, 1e-9, 1.0, "right, but not with a step above 1:"),
    ({"away": 20.0}, 1e-9, 1.0, "right, but not far from 0:"),
    ({"size": 1e-7}, 1e-7, 0.0, "right, but not for a function that hardly changes, its derivatives below 1e-4:"),
)


VIEW = (
    "right, but not for a function that returns a view of the array it is given, such as `x[::-1]` (is that array changed "
    "before what came back is used?):"
)


def sized_arc(rng, size):
    """A scan line of another size as a whole."""
    return tuple(size * v for v in arc(rng))


def arc_elsewhere(rng):
    """A scan line of a circle whose center is next to x = 0 and has a negative z."""
    x, z = arc(rng)
    x_c, z_c, _ = fit_circle(x, z)
    return x - x_c + rng.choice([-1, 1]) * rng.uniform(0.01, 0.05), z - z_c - rng.uniform(50, 300)


THREE_NAMES = ("center x", "center z", "radius")
ANY_CIRCLE = metrics.Several(*3 * (metrics.Numbers(1e-6, "mm"),), names=THREE_NAMES)
NOISY_CIRCLE = metrics.Several(*3 * (metrics.Numbers(6e-5, "mm", absolute=True),), names=THREE_NAMES)


def arc(rng, std=0.0, side=1, n=None):
    """A scan line: points of a circle, 60 to 120 deg of it, more on one side of its lowest point than on the other."""
    n = n or int(rng.integers(50, 90))
    angle = side * np.linspace(-rng.uniform(0.25, 0.5), rng.uniform(0.8, 1.2), n)[::side]
    r = rng.uniform(20, 30) + std * rng.normal(size=n)
    return rng.uniform(-20, 20) + r * np.sin(angle), rng.uniform(200, 280) - r * np.cos(angle)


def profile(rng, side, across, away=(6, 20), std=0.0, size=1.0):
    """A scan line of a sphere of some radius whose center lies on this side of the scan plane, so far away, and across
    it, along x; more of it on one side of its lowest point than on the other.
    """
    radius = float(rng.uniform(25, 35))
    center = np.array([across * rng.uniform(4, 20), side * rng.uniform(*away), rng.uniform(200, 280)])
    x, z = sphere.scan_line(center, radius, rng.uniform(0.7, 1.0), int(rng.integers(50, 80)))
    seen = slice(int(rng.integers(8, 16)), None)
    x, z = (v[::across][seen] + std * rng.normal(size=len(v[seen])) for v in (x, z))
    return size * x, size * z, size * radius, side


SPECIAL_PROFILES = (
    *(
        (
            functools.partial(profile, side=side, across=1, away=(0.3, 1.5)),
            metrics.Numbers(1e-6, "mm"),
            "right, but not where the scan plane passes the center closer than 1.5 mm:",
        )
        for side in (1, -1)
    ),
    *(
        (
            functools.partial(profile, side=1, across=-1, size=size),
            metrics.Numbers(1e-6, "mm"),
            f"right, but not for a sphere {words}:",
        )
        for size, words in ((0.05, "of a millimeter or two"), (20, "half a meter large and more"))
    ),
    *3 * ((functools.partial(profile, side=-1, across=1, std=0.001), metrics.Numbers(2e-4, "mm", absolute=True)),),
)


def increments(rng, n=None, turn=0.2):
    """Nine unknowns around a start pose, with the poses and centers they are judged by."""
    T_FS, T_BF, x_S, target = scene(rng, n)
    return np.concatenate([rng.normal(size=3) * turn, rng.normal(size=3) * 10, target]), T_FS, T_BF, x_S


def beyond_half_a_turn(rng):
    """The same with a rotation vector longer than half a turn, as long as a whole one at most."""
    u, *others = increments(rng)
    u[:3] *= rng.uniform(3.5, 6) / np.linalg.norm(u[:3])
    return u, *others


def residuals_with_outliers(rng, odd=0, n=None, gross=4, size=1.0):
    """Residual vectors of some twenty poses, an even or an odd number, four of them gross, and their odd-sized noise."""
    n = n or 2 * int(rng.integers(9, 15)) + odd
    e = size * rng.uniform(0.1, 2.0) * rng.normal(size=(n, 3))
    e[rng.choice(n, gross, replace=False)] *= rng.uniform(5, 40, (gross, 1))
    return (e,)


def residuals_of_all_lengths(rng):
    """Residual vectors whose weights are spread from 1 to 0: half are short, the others evenly longer, past the cut."""
    lengths = rng.uniform(0.5, 2.0) * np.append(rng.uniform(0.2, 1.0, 20), np.linspace(1.0, 3.8, 19))
    directions = rng.normal(size=(len(lengths), 3))
    return (rng.permutation(lengths[:, None] * directions / np.linalg.norm(directions, axis=1)[:, None]),)


SPECIAL_RESIDUALS = (
    (functools.partial(residuals_with_outliers, gross=0), "right, but not where no pose is off:"),
    (functools.partial(residuals_with_outliers, n=3, gross=1), "right, but not for three poses:"),
    (functools.partial(residuals_with_outliers, n=100, gross=30), "right, but not for a hundred poses:"),
    (
        functools.partial(residuals_with_outliers, size=2e-3),
        "right, but not where most residuals are some thousandths of a millimeter:",
    ),
    (
        functools.partial(residuals_with_outliers, size=1e3),
        "right, but not where most residuals are longer than 100 mm:",
    ),
)


def entries_with_more_slips(rng, mended=()):
    """The printed tables, misprints of some poses mended, with two further slips in good rows: two digits of a length
    swapped, 9 to 90 mm away.
    """
    entries = thesis.printed_entries()
    for row in thesis.corrections():
        if row["pose"] in mended:
            entries[row["table"], row["pose"], row["column"]] = row["corrected"]
    for pose in rng.choice(np.array([6, 10, 14, 18, 19, 23, 27]), 2, replace=False):
        key = "C14", int(pose), str(rng.choice(["x", "y", "z"]))
        slips = [
            text
            for text, slip in misprints.single_slips(entries[key]).items()
            if slip == "two digits swapped" and 8.5 < abs(float(text) - float(entries[key])) < 95
        ]
        if slips:
            entries[key] = str(rng.choice(slips))
    return (entries,)


# --- wrong variants --------------------------------------------------------------------------------------------------


def _residual(T_FS, T_BF, x_S, target):
    return hand_eye.sphere_residuals(T_BF, x_S, T_FS, target)


def _kuka_without_target(p2, T_BF, x_S, target):
    return _residual(frames.matrix_from_kuka(p2), T_BF, x_S, np.zeros(3))


def _kuka_scanner_first(p2, T_BF, x_S, target):
    return frames.transform(frames.matrix_from_kuka(p2) @ T_BF, x_S) - target


def _kuka_inverse(p2, T_BF, x_S, target):
    return _residual(frames.invert(frames.matrix_from_kuka(p2)), T_BF, x_S, target)


def _kuka_flange_inverse(p2, T_BF, x_S, target):
    return _residual(frames.matrix_from_kuka(p2), frames.invert(T_BF), x_S, target)


def _kuka_in_flange(p2, T_BF, x_S, target):
    seen = frames.transform(frames.matrix_from_kuka(p2), x_S)
    return seen - frames.transform(frames.invert(T_BF), np.tile(target, (len(x_S), 1)))


def _kuka_in_scanner(p2, T_BF, x_S, target):
    from_base = frames.invert(T_BF @ frames.matrix_from_kuka(p2))
    return x_S - frames.transform(from_base, np.tile(target, (len(x_S), 1)))


def _kuka_angles(sequence):
    """Reads the three angles in another order."""

    def variant(p2, T_BF, x_S, target):
        T_FS = frames.pose(Rotation.from_euler(sequence, p2[3:]).as_matrix(), p2[:3])
        return _residual(T_FS, T_BF, x_S, target)

    return variant


def _kuka_degrees(p2, T_BF, x_S, target):
    return _residual(frames.matrix_from_kuka(frames.kuka_from_degrees(p2)), T_BF, x_S, target)


def _kuka_directions(p2, T_BF, x_S, target):
    y = frames.transform(frames.matrix_from_kuka(p2), x_S)
    return (T_BF[:, :3, :3] @ y[..., None])[..., 0] - target


def _forward(function, x, step):
    return numeric_jacobian(function, x, step, "forward")


def _backward(function, x, step):
    return -numeric_jacobian(lambda y: function(-y), -x, step, "forward")


def _central(function, x, step):
    return numeric_jacobian(function, x, step, "central")


def _not_restored(function, x, step):
    """Forgets to undo a step before the next variable is moved."""
    here, columns = x.copy(), []
    for k in range(len(x)):
        here[k] += step
        ahead = function(here)
        here[k] -= 2 * step
        columns.append((ahead - function(here)) / (2 * step))
    return np.column_stack(columns)


def _neither_restored(function, x, step):
    """Moves one place ahead and one behind, each farther with every variable."""
    ahead, behind, columns = x.copy(), x.copy(), []
    for k in range(len(x)):
        ahead[k] += step
        behind[k] -= step
        columns.append((function(ahead) - function(behind)) / (2 * step))
    return np.column_stack(columns)


def _jacobian(T_FS, T_BF, x_S, sign=-1.0, arms=None, left=False):
    R = T_BF[:, :3, :3]
    arms = x_S if arms is None else arms
    turn = skew(arms) if left else T_FS[:3, :3] @ skew(arms)
    return np.concatenate([sign * R @ turn, R], axis=2).reshape(-1, 6)


def analytic_jacobian(T_FS, T_BF, x_S):
    """Reference of the exercise: increments of a pose with the sphere's center held fixed."""
    return hand_eye.joint_jacobian(T_BF, x_S, T_FS, target_free=False)


def _jacobian_without_base(T_FS, T_BF, x_S):
    J = -(T_FS[:3, :3] @ skew(x_S))
    return np.concatenate([J, np.tile(np.eye(3), (len(x_S), 1, 1))], axis=2).reshape(-1, 6)


def fit_circle(x, z):
    """Reference of the exercise: center and radius of the geometric circle."""
    circle = sphere.fit_circle(x, z)
    return circle.center[0], circle.center[1], circle.radius


def _circle(change):
    def variant(x, z):
        return change(*fit_circle(x, z))

    return variant


def _circle_of_parabola(x, z, at_apex):
    """The circle that a parabola fitted to the points has at its apex, or at the middle of the points."""
    a, b, c = np.polyfit(x - x.mean(), z, 2)
    away = -b / (2 * a) if at_apex else 0.0
    slope = 2 * a * away + b
    r = (1 + slope**2) ** 1.5 / (2 * a)
    right_angle = np.array([-slope, 1.0]) / np.hypot(slope, 1)
    return x.mean() + away + r * right_angle[0], (a * away + b) * away + c + r * right_angle[1], abs(r)


def _circle_about_mean(x, z):
    return x.mean(), z.mean(), np.hypot(x - x.mean(), z - z.mean()).mean()


def _circle_from_its_extent(depth):
    """Half of the width as the radius, its middle as the center, which lies at a depth(heights, offsets, radius)."""

    def variant(x, z):
        r = np.ptp(x) / 2
        return x.min() + r, depth(z, x - x.min() - r, r), r

    return variant


def _circle_through(numbers):
    """Uses three points of the scan line, `numbers(count)`, and no other."""

    def variant(x, z):
        k = numbers(len(x))
        p, q, c = np.linalg.solve(np.column_stack([2 * x[k], 2 * z[k], np.ones(3)]), x[k] ** 2 + z[k] ** 2)
        return p, q, np.sqrt(c + p * p + q * q)

    return variant


def _circle_through_origin(x, z):
    a = np.linalg.lstsq(np.column_stack([x, z]), -(x * x + z * z), rcond=None)[0]
    return -a[0] / 2, -a[1] / 2, np.hypot(a[0], a[1]) / 2


def _center(change):
    def variant(x, z, radius, side):
        cx, cz, r = fit_circle(x, z)
        return change(cx, cz, r, radius, side)

    return variant


def gauss_newton_on_pose(T_FS, T_BF, x_S, target):
    """Reference of the exercise: one Gauss-Newton step with an increment on the right of the pose."""
    step = _step(T_FS, T_BF, x_S, target)
    return frames.moved(T_FS, step)


def _step(T_FS, T_BF, x_S, target):
    J = analytic_jacobian(T_FS, T_BF, x_S)
    return -np.linalg.lstsq(J, _residual(T_FS, T_BF, x_S, target).ravel(), rcond=None)[0]


def _step_in_two_frames(T_FS, T_BF, x_S, target):
    e = frames.transform(T_FS, x_S) - frames.transform(frames.invert(T_BF), np.tile(target, (len(x_S), 1)))
    return frames.moved(T_FS, -np.linalg.lstsq(analytic_jacobian(T_FS, T_BF, x_S), e.ravel(), rcond=None)[0])


def _step_of_nine(T_FS, T_BF, x_S, target):
    J = np.hstack([analytic_jacobian(T_FS, T_BF, x_S), np.tile(-np.eye(3), (len(x_S), 1))])
    return frames.moved(T_FS, -np.linalg.lstsq(J, _residual(T_FS, T_BF, x_S, target).ravel(), rcond=None)[0][:6])


def _step_of_translation(T_FS, T_BF, x_S, target):
    J, e = analytic_jacobian(T_FS, T_BF, x_S)[:, 3:], _residual(T_FS, T_BF, x_S, target)
    return frames.pose(T_FS[:3, :3], T_FS[:3, 3] - np.linalg.lstsq(J, e.ravel(), rcond=None)[0])


def _stepped(change):
    def variant(T_FS, T_BF, x_S, target):
        return change(T_FS, _step(T_FS, T_BF, x_S, target))

    return variant


def _gradient_step(T_FS, T_BF, x_S, target):
    J = analytic_jacobian(T_FS, T_BF, x_S)
    return frames.moved(T_FS, -J.T @ _residual(T_FS, T_BF, x_S, target).ravel() / (J * J).sum())


def _iterated(T_FS, T_BF, x_S, target):
    for _ in range(20):
        T_FS = gauss_newton_on_pose(T_FS, T_BF, x_S, target)
    return T_FS


def _step_without_target(T_FS, T_BF, x_S, target):
    return frames.moved(T_FS, _step(T_FS, T_BF, x_S, np.zeros(3)))


def joint_residual(u, T0, T_BF, x_S):
    """Reference of the exercise: nine unknowns, phi and translation about T0, and the sphere's center."""
    return _residual(frames.moved(T0, u[:6]), T_BF, x_S, u[6:]).ravel()


def _linear(change):
    def variant(T_BF, x_S):
        T_FS, target = hand_eye.linear_start(T_BF, x_S)
        return change(T_FS, target)

    return variant


def _linear_equations(T_BF, x_S):
    """The matrix of the linear equations, three rows a pose."""
    R_t, n = np.swapaxes(T_BF[:, :3, :3], 1, 2), len(T_BF)
    M = np.kron(np.eye(3), x_S[:, None, :]).reshape(n, 3, 9)
    return np.concatenate([M, np.tile(np.eye(3), (n, 1, 1)), -R_t], 2).reshape(-1, 15)


def _linear_without_rotation(T_BF, x_S):
    """Leaves the nine entries of R_FS as the linear equations give them."""
    R_t = np.swapaxes(T_BF[:, :3, :3], 1, 2)
    right = -(R_t @ T_BF[:, :3, 3, None]).ravel()
    u = np.linalg.lstsq(_linear_equations(T_BF, x_S), right, rcond=None)[0]
    T_FS = np.eye(4)
    T_FS[:3] = np.column_stack([u[:9].reshape(3, 3), u[9:12]])
    return T_FS, u[12:]


def _linear_by(T_BF, x_S, right=1.0, rotation=lie.nearest_rotation):
    """The linear equations with the right side turned, or something else for the nearest rotation."""
    R_t = np.swapaxes(T_BF[:, :3, :3], 1, 2)
    b = -right * (R_t @ T_BF[:, :3, 3, None])
    u = np.linalg.lstsq(_linear_equations(T_BF, x_S), b.ravel(), rcond=None)[0]
    return frames.pose(rotation(u[:9].reshape(3, 3)), u[9:12]), u[12:]


def _linear_without_turning_back(T_BF, x_S):
    """Writes the equations with R_BF where R_BF^T belongs."""
    R, n = T_BF[:, :3, :3], len(T_BF)
    D = np.concatenate([np.kron(x_S[:, None], np.eye(3)[None]).reshape(n, 3, 9), np.tile(np.eye(3), (n, 1, 1)), -R], 2)
    u = np.linalg.lstsq(D.reshape(-1, 15), -(R @ T_BF[:, :3, 3, None]).ravel(), rcond=None)[0]
    return frames.pose(lie.nearest_rotation(u[:9].reshape(3, 3).T), u[9:12]), u[12:]


def _linear_with_unturned_right_side(T_BF, x_S):
    """Turns the target into F, but not the flange's own position."""
    u = np.linalg.lstsq(_linear_equations(T_BF, x_S), -T_BF[:, :3, 3].ravel(), rcond=None)[0]
    return frames.pose(lie.nearest_rotation(u[:9].reshape(3, 3)), u[9:12]), u[12:]


def _gram_schmidt(M, by_rows=False):
    """The rotation that Gram-Schmidt makes of nine numbers, column by column or row by row."""
    Q, R = np.linalg.qr(M.T if by_rows else M)
    Q = Q * np.sign(np.diag(R))
    return Q.T if by_rows else Q


class LinearStart(metrics.Several):
    """T_FS and target from noisy data: whoever solves for t_FS anew, or refines, has another target, and some room; the
    target that the linear equations themselves give goes with one T_FS alone.
    """

    def __init__(self, deg, mm, target):
        super().__init__(metrics.Poses(deg, mm), metrics.Numbers(target, "mm"), names=("T_FS", "target"))

    def deviations(self, result, expected):
        if np.abs(result[1] - expected[1]).max() < 1e-8 * np.abs(expected[1]).max():
            exactly = metrics.Several(metrics.Poses(1e-3, 1e-3), self.metrics[1], names=self.names)
            return exactly.deviations(result, expected)
        return super().deviations(result, expected)


def robust_weights(residuals):
    """Reference of the exercise: Tukey weights with the median length as the scale."""
    lengths = np.linalg.norm(residuals, axis=1)
    return robust.tukey_weights(lengths, robust.median_std(lengths), hand_eye.TUKEY_CUT)


def _weights(change):
    def variant(residuals):
        return change(np.linalg.norm(residuals, axis=1))

    return variant


def _weights_of_coordinates(residuals, together):
    """Weights of the coordinates by their own scale, three of them made one."""
    return together(_tukey(np.abs(residuals) / (5 * np.median(np.abs(residuals)) / 0.6745)), axis=1)


def _tukey(u):
    return np.where(u < 1, (1 - u**2) ** 2, 0)


def find_misprints(entries):
    """Reference of the exercise: the first explanation of every suspicious row."""
    found = misprints.find(entries)
    return {(slips[0].table, slips[0].pose, slips[0].column) for slips in found.values() if slips}


def _printed_misprints():
    return {(row["table"], row["pose"], row["column"]) for row in thesis.corrections()}


def _by_plain_least_squares(entries):
    measured = thesis.measurements_from(entries)
    fit = hand_eye.calibrate_sphere_target(measured.T_BF, measured.x_S)
    lengths = np.linalg.norm(fit.residuals, axis=1)
    return _first_slips(entries, fit, np.flatnonzero(lengths > 2 * np.median(lengths)) + 1)


def _robust(entries):
    measured = thesis.measurements_from(entries)
    return hand_eye.calibrate_sphere_target(measured.T_BF, measured.x_S, robust=True)


def _first_slips(entries, fit, suspects):
    named = set()
    for pose in suspects:
        slips = misprints.explanations(entries, int(pose), fit.T_FS, fit.target, fit.std)
        named |= {(slips[0].table, slips[0].pose, slips[0].column)} if slips else {("C14", int(pose), "x")}
    return named


def _too_strict(entries):
    fit = _robust(entries)
    return _first_slips(entries, fit, np.flatnonzero(np.linalg.norm(fit.residuals, axis=1) > 2.5 * fit.std) + 1)


def _all_explanations(entries):
    named = {(e.table, e.pose, e.column) for slips in misprints.find(entries).values() for e in slips}
    return {SUBSTITUTES.get(entry, entry) for entry in named}


def _first_alone(entries):
    return {min(find_misprints(entries), key=lambda entry: entry[1])}


def _worst_alone(entries):
    slips = max((s for s in misprints.find(entries).values() if s), key=lambda s: s[0].before)
    return {(slips[0].table, slips[0].pose, slips[0].column)}


def _only_the_grossest(entries):
    found = misprints.find(entries)
    return {(s[0].table, s[0].pose, s[0].column) for s in found.values() if s and s[0].before > 30}


class Count(metrics.Deviation):
    """How many entries are wrong, in words."""

    def __init__(self, what, count):
        super().__init__(what, float(count), "", 0.5)

    def __str__(self):
        words = (
            self.what
            if self.amount != 1
            else self.what.replace("misprints are", "misprint is").replace("entries are", "entry is")
        )
        return f"{self.amount:.0f} {words}"


HIDDEN = ". Plain least squares are bent by the grossest slips, behind which the others hide; a robust fit is not"


class named_entries(metrics.Exactly):
    """A set of (table, pose, column), where A and C of pose 12 stand for each other."""

    def admit(self, result, expected):
        if result is None:
            raise metrics.Refused("it returned None: is a `return` missing?")
        try:
            found = {(str(table), int(pose), str(column)) for table, pose, column in result}
        except (TypeError, ValueError):
            raise metrics.Refused('expected a set of (table, pose, column) such as ("C14", 3, "x")') from None
        # who names both accuses one wrongly
        return {entry if SUBSTITUTES.get(entry) in found else SUBSTITUTES.get(entry, entry) for entry in found}

    def deviations(self, result, expected):
        missed, accused = len(expected - result), len(result - expected)
        found = {pose for _, pose, _ in expected - result} & {pose for _, pose, _ in result - expected}
        if found:
            which = ", ".join(map(str, sorted(found)))
            words = f"in row {which} you name" if len(found) == 1 else f"in the rows {which} you name"
            here = (
                ":" if {pose for _, pose, _ in expected - result} == found else ";"
            )  # or some in rows that are not named
            words = f"{missed} of {len(expected)} misprints {'is' if missed == 1 else 'are'} not named yet{here} {words} an entry, but not the misprinted one"
            return [metrics.Deviation("", float(missed), "", 0.5, words=words)]
        if missed and result and not accused:
            words = f"{missed} of {len(expected)} misprints {'is' if missed == 1 else 'are'} not named yet, in rows of which you name no entry; of this table, what you name is misprinted"
            words += HIDDEN if 2 * missed > len(expected) else ""
            return [metrics.Deviation("", float(missed), "", 0.5, words=words)]
        rows = Counter((table, pose) for table, pose, _ in result)
        whole = " (several of one row: one slip a row is meant)" if max(rows.values(), default=0) > 1 else ""
        return [
            Count("misprints are not named yet", missed),
            Count(f"entries are accused wrongly{whole}{'' if missed else ', beside the misprinted ones'}", accused),
        ]


# --- designing poses -------------------------------------------------------------------------------------------------


@functools.cache
def corrected_fit():
    measured = thesis.measurements(True)
    return hand_eye.calibrate_sphere_target(measured.T_BF, measured.x_S)


def predicted_stds(T_BF, T_FS, target):
    """Predicted standard deviations of the scanner's rotation (deg) and translation (mm) under these poses."""
    cov = planning.predicted_sphere_covariance(T_BF, T_FS, target, corrected_fit().std)
    return float(np.rad2deg(np.sqrt(np.trace(cov[:3, :3])))), float(np.sqrt(np.trace(cov[3:6, 3:6])))


def design_poses(T_FS, target, rng):
    """Reference of the exercise: the sphere all over the scanner's field, the flange tilted about all axes."""
    x_S = np.column_stack(
        [rng.uniform(-25, 25, 31), rng.uniform(3, 25, 31) * rng.choice([-1, 1], 31), rng.uniform(190, 290, 31)]
    )
    down = np.diag([1.0, -1.0, -1.0]) @ T_FS[:3, :3].T
    tilt = np.column_stack([rng.uniform(-0.8, 0.8, (31, 2)), rng.uniform(-3, 3, 31)])
    return planning.poses_that_see(T_FS, target, exp_so3(tilt) @ down, x_S)


def scanner_and_sphere(rng):
    """A scanner and a sphere near the thesis's own, and a generator."""
    fit = corrected_fit()
    R, t = fit.T_FS[:3, :3], fit.T_FS[:3, 3]
    T_FS = frames.pose(exp_so3(rng.uniform(-0.3, 0.3, 3)) @ R, t + rng.uniform(-40, 40, 3))
    return T_FS, fit.target + rng.uniform(-80, 80, 3), np.random.default_rng(int(rng.integers(1 << 30)))


def design_is_good(student, rng):
    """What the poses of the exercise must fulfil, for three scanners; a sentence when they do not."""
    for _ in range(3):
        T_FS, target, chance = scanner_and_sphere(rng)
        problem = _problem_of_design(_poses_alone(student(T_FS.copy(), target.copy(), chance)), T_FS, target)
        if problem:
            return problem
    return None


def _poses_alone(designed):
    """What was designed as an array; None where it is several results, or no numbers."""
    try:
        return np.asarray(designed, dtype=float)
    except (TypeError, ValueError):
        return None


def _problem_of_design(T_BF, T_FS, target):
    if T_BF is None:
        return "expected one array of shape (31, 4, 4), got something else: hand over the poses alone."
    if T_BF.shape != (31, 4, 4):
        return f"31 poses are wanted, shape (31, 4, 4); got {T_BF.shape}."
    try:
        x_S = hand_eye.sphere_in_scanner(T_BF, T_FS, target)
    except ValueError as refusal:
        return f"{refusal}."
    off = planning.field_problem(x_S)
    return (
        off
        and (_of_another_frame(T_BF, T_FS, target) or off)
        or _looks_up(T_BF, T_FS)
        or _too_uncertain(T_BF, T_FS, target, x_S)
    )


def _of_another_frame(T_BF, T_FS, target):
    """Which other poses these are, if as such they keep the sphere in the field."""
    others = {
        "the scanner's poses, T_BF T_FS. The flange's are wanted: multiply by the inverse of T_FS from the right": T_BF
        @ frames.invert(T_FS),
        "the inverse poses, T_FB. T_BF maps from the flange to the base": frames.invert(T_BF),
    }
    for words, T in others.items():
        if planning.field_problem(hand_eye.sphere_in_scanner(T, T_FS, target)) is None:
            return f"these are {words}."
    return None


def _looks_up(T_BF, T_FS):
    down = T_BF[:, :3, :3] @ T_FS[:3, 2]
    off = np.rad2deg(np.arccos(np.clip(-down[:, 2], -1, 1)))
    if off.max() <= 91:  # a degree more than it says: a pose that was meant to be level may be rounded
        return None
    up = int((off > 90).sum())
    where = "one pose looks" if up == 1 else f"{up} poses look"
    steepest = f"{'the steepest ' if up > 1 else ''}with the scanner's z axis {off.max():.0f} deg from straight down"
    return f"{where} up at the sphere, {steepest}: the table is in the way (90 deg is the limit)."


def _too_uncertain(T_BF, T_FS, target, x_S):
    try:
        hand_eye.calibrate_sphere_target(T_BF, x_S)
    except ValueError as refusal:  # a motion is missing: it says which
        return f"{refusal}."
    fit = corrected_fit()
    printed_turn, printed_shift = predicted_stds(thesis.measurements(True).T_BF, fit.T_FS, fit.target)
    turn, shift = predicted_stds(T_BF, T_FS, target)
    if not turn < 0.7 * printed_turn:
        return f"the rotation would be known to {turn:.2g} deg; the thesis's pattern gives {printed_turn:.2g}, and 0.7 of that is asked for."
    if not shift < printed_shift:
        return f"the rotation is better known, but the translation only to {shift:.2g} mm; the thesis's pattern gives {printed_shift:.2g}. Tilt the flange more, about more than one axis."
    return None


# --- values ----------------------------------------------------------------------------------------------------------


def _rms_of_end_pose(*fixed):
    measured = thesis.measurements(fixed)
    residuals = _residual(thesis.frame("scanner_end"), measured.T_BF, measured.x_S, thesis.printed_target())
    return float(hand_eye.rms_distance(residuals))


def _rms_of_linear_start():
    measured = thesis.measurements(ALL_FIXED)
    T_FS, target = hand_eye.linear_start(measured.T_BF, measured.x_S)
    return float(hand_eye.rms_distance(frames.transform(measured.T_BF @ T_FS, measured.x_S) - target))


def _vectors_of_end_pose():
    measured = thesis.measurements((2,))
    return _residual(thesis.frame("scanner_end"), measured.T_BF, measured.x_S, thesis.printed_target())


def _lengths_of_end_pose():
    return np.linalg.norm(_vectors_of_end_pose(), axis=1)


def _scatter_of_end_pose():
    residuals = _vectors_of_end_pose()
    return float(hand_eye.rms_distance(residuals - residuals.mean(axis=0)))


def _rms_without_pose_2():
    return float(np.sqrt((np.delete(_lengths_of_end_pose(), 1) ** 2).mean()))


def _rms_with_printed_target(fixed=True):
    measured = thesis.measurements(fixed)
    return hand_eye.calibrate_sphere_target(measured.T_BF, measured.x_S, target=thesis.printed_target()).rms


def _per_axis(value):
    return value / np.sqrt(3)


def _joint_rms(*fixed):
    measured = thesis.measurements(fixed)
    return hand_eye.calibrate_sphere_target(measured.T_BF, measured.x_S).rms


def _robust_fit():
    measured = thesis.measurements(True)
    return hand_eye.calibrate_sphere_target(measured.T_BF, measured.x_S, robust=True)


@functools.cache
def _robust_fit_as_printed():
    measured = thesis.measurements()
    return hand_eye.calibrate_sphere_target(measured.T_BF, measured.x_S, robust=True)


def _rms_without_the_seven():
    measured, good = thesis.measurements(True), ~np.isin(np.arange(1, 32), ALL_FIXED)
    return hand_eye.calibrate_sphere_target(measured.T_BF[good], measured.x_S[good]).rms


def _rms_left_out():
    measured = thesis.measurements(True)
    return float(hand_eye.rms_distance(hand_eye.leave_one_out(measured.T_BF, measured.x_S)))


def _mean_distance():
    return float(np.linalg.norm(corrected_fit().residuals, axis=1).mean())


GROWS_BEYOND = (
    "Below u = 1 the weight is (1 - u^2)^2, beyond it 0. Yours grows beyond, and from u = 1.41 on it is more than 1."
)
ALL_FIXED = (2, 3, 4, 7, 12, 21, 30)


def _rms_with_radius(R):
    measured = thesis.measurements(True)
    return hand_eye.calibrate_sphere_target(measured.T_BF, thesis.centers_with_radius(measured.x_S, R)).rms


@functools.cache
def _shallower_radius():
    """The second minimum of the rms, where the circle of pose 4 is larger than the sphere."""
    return float(minimize_scalar(_rms_with_radius, bounds=(29.9, 29.97), method="bounded").x)


def _rms_beside(R):
    """What a fit of the scanner and the center leaves with a wrong radius, beside the least, as a sentence."""
    if not 29 < R < 31:
        return None
    least, here = _rms_with_radius(_fitted_radius()), _rms_with_radius(R)
    return f"With this radius the fit of scanner and center leaves {here:.4f} mm rms. The least that a radius leaves is {least:.4f} mm"


@functools.cache
def _fitted_radius():
    measured = thesis.measurements(True)
    return hand_eye.fit_radius(measured.T_BF, measured.x_S).radius


@functools.cache
def _radius_with_printed_target():
    measured, target = thesis.measurements(True), thesis.printed_target()

    def rms(R):
        x_S = thesis.centers_with_radius(measured.x_S, R)
        return hand_eye.calibrate_sphere_target(measured.T_BF, x_S, target=target).rms

    return float(minimize_scalar(rms, bounds=(29.98, 31), method="bounded").x)


@functools.cache
def _std_of_radius():
    measured = thesis.measurements(True)
    return hand_eye.fit_radius(measured.T_BF, measured.x_S).std


@functools.cache
def _radius_without(pose):
    measured = thesis.measurements(True)
    return hand_eye.fit_radius(*(np.delete(a, pose - 1, axis=0) for a in (measured.T_BF, measured.x_S))).radius


@functools.cache
def _radius_with_pose_2_alone():
    measured = thesis.measurements((2,))
    return hand_eye.fit_radius(measured.T_BF, measured.x_S).radius


CHAPTER = Chapter(
    "05-hand-eye",
    title="Hand-eye calibration on 31 real poses",
    items=[
        Prediction(
            "twice_as_far",
            question="An object stands twice as far from the scanner, both angles err as before. How does the error of its height grow?",
            choices=("not at all", "twice", "nearly four times"),
            answer="nearly four times",
            why="H²/(L sin²) grows with the square of the distance, once it is larger than the base: the rays meet at an ever smaller angle.",
        ),
        *beyond.TRIANGULATION,
        Exercise(
            "fit_circle",
            reference=fit_circle,
            draw=(arc, functools.partial(arc, side=-1), functools.partial(arc, n=3)),
            metric=ANY_CIRCLE,
            noisy=(
                *5 * ((lambda rng: arc(rng, 0.001), NOISY_CIRCLE),),
                (lambda rng: arc(rng, 0.001, n=600), NOISY_CIRCLE, "right, but not for a scan line of 600 noisy points:"),
                *((functools.partial(sized_arc, size=size), ANY_CIRCLE, f"right, but not for a circle of {words}:")
                  for size, words in ((0.02, "half a millimeter"), (50, "a meter and more"))),
                (arc_elsewhere, ANY_CIRCLE, "right, but not for a circle whose center is next to x = 0, with a negative z:"),
            ),
            hints=(
                "A circle is linear in the right unknowns: multiply (x - xc)^2 + (z - zc)^2 = r^2 out.",
                "x^2 + z^2 + a1 x + a2 z + a3 = 0 with a1 = -2 xc, a2 = -2 zc, a3 = xc^2 + zc^2 - r^2: one equation a point.",
                "`a = np.linalg.lstsq(np.column_stack([x, z, np.ones(len(x))]), -(x**2 + z**2), rcond=None)[0]\n"
                "return -a[0]/2, -a[1]/2, np.sqrt(a[0]**2/4 + a[1]**2/4 - a[2])`",
            ),
            mistakes=[
                Mistake(_circle(lambda x, z, r: (-x, -z, r)), "Your center has the opposite sign. With a1 = -2 xc, as in the text, xc = -a1/2.", id="fit_circle-77849e"),
                Mistake(_circle(lambda x, z, r: (-2 * x, -2 * z, r)), "You return a1 and a2 themselves. The center is -a1/2, -a2/2."),
                Mistake(_circle(lambda x, z, r: (-2 * x, -2 * z, x * x + z * z - r * r)),
                        "You return a1, a2 and a3 themselves. The center is -a1/2, -a2/2; the radius follows from a3."),
                Mistake(_circle(lambda x, z, r: (x, z, np.sqrt(3 * x * x + 3 * z * z + r * r))),
                        "Twice the center entered the radius, as a1 and a2 hold it: halve before you square.", id="fit_circle-7bfed6"),
                Mistake(_circle(lambda x, z, r: (x, z, np.sqrt(x * x + z * z - r * r))),
                        "Your radius is the root of a3 alone. The center is in it as well: in the text a3 = xc^2 + zc^2 - r^2. Solve for r.", id="fit_circle-0fe8df"),
                Mistake(_circle_through(lambda n: [0, n // 2, -1]), "Three points make a circle, with all their noise in it. Let every point of the scan line count."),
                Mistake(_circle(lambda x, z, r: (x, z, r * r)), "Your third number is the squared radius: a root is missing."),
                Mistake(_circle(lambda x, z, r: (x, z, np.sqrt(max(2 * x * x + 2 * z * z - r * r, 0)))),
                        "a3 entered the radius with the wrong sign: r^2 = xc^2 + zc^2 - a3, where a3 is xc^2 + zc^2 - r^2.", id="fit_circle-aa6121"),
                *(Mistake(_circle_from_its_extent(depth), "Half of the width that is seen is no radius: the scan line is an arc, less than half of the circle.", id=id)
                  for id, depth in (("", lambda z, u, r: z.min() + r), ("circle-extent-mean", lambda z, u, r: np.mean(z + np.sqrt(np.maximum(r * r - u * u, 0)))))),
                *(Mistake(functools.partial(_circle_of_parabola, at_apex=at_apex),
                          "This circle has the curvature of a parabola through the points. An arc bends more strongly than that toward its ends: fit the circle itself.",
                          id=f"circle-parabola-{at_apex + 1}") for at_apex in (True, False)),
                Mistake(_circle_about_mean, "You took the mean of the points for the center. An arc lies on one side of its center."),
                Mistake(_circle(lambda x, z, r: (z, x, r)), "The two coordinates of the center have changed places."),
                Mistake(_circle_through(lambda n: [0, 1, 2]), "The circle goes through the first three points. All points of the scan line count."),
                Mistake(_circle(lambda x, z, r: (2 * x, 2 * z, np.sqrt(3 * x * x + 3 * z * z + r * r))),
                        "Your center is twice as far from the origin as it should be, and the radius follows from it: halve it before you go on.", id="fit_circle-76a188"),
                Mistake(_circle(lambda cx, cz, r: (cx, cz, 2 * r)), "Your third number is the diameter. The radius is asked for."),
                Mistake(_circle_through_origin, "Your circle goes through the origin, as every circle without a3 does. It is what the column of ones is for.", id="fit_circle-2133a7"),
            ],
        ),
        Prediction(
            "equator",
            question="The scan plane may cut the sphere anywhere. Where does the profile tell least about how far away the center is?",
            choices=("through the center", "halfway out", "near the edge"),
            answer="through the center",
            why="There the circle is largest and hardly changes when the plane moves: dd/dr = -r/d, and d is 0. Near the edge the arc gets short instead.",
        ),
        Exercise(
            "sphere_center_from_profile",
            reference=sphere.sphere_center_from_profile,
            draw=tuple(functools.partial(profile, side=side, across=x) for side, x in ((-1, 1), (1, 1), (-1, -1), (1, -1))),
            metric=metrics.Numbers(1e-6, "mm"),
            noisy=SPECIAL_PROFILES,
            hints=(
                "The scan line gives a circle in the plane y = 0; the center of the sphere lies straight before or behind its center.",
                "Pythagoras: R^2 = r^2 + d^2, and side says whether y is +d or -d.",
                "`xc, zc, r = fit_circle(x, z)\n"
                "return np.array([xc, side * np.sqrt(radius**2 - r**2), zc])`",
            ),
            mistakes=[
                Mistake(_center(lambda x, z, r, R, s: np.array([x, -s * np.sqrt(R * R - r * r), z])),
                        "The sign of y is reversed: side = +1 means a positive y."),
                Mistake(_center(lambda x, z, r, R, s: np.array([x, z, s * np.sqrt(R * R - r * r)])),
                        "The offset belongs into y, the second coordinate; the third is z, the distance."),
                Mistake(_center(lambda x, z, r, R, s: np.array([x, s * np.sqrt(R * R + r * r), z])),
                        "R is the hypotenuse: d^2 = R^2 - r^2, with a minus."),
                Mistake(_center(lambda x, z, r, R, s: np.array([x, s * (R - r), z])), "You took R - r for the distance from the plane: the three form a right triangle."),
                Mistake(_center(lambda x, z, r, R, s: np.array([x, s * np.sqrt(900 - r * r), z])),
                        "You took R = 30 mm, as listing C16 does. Which R it is will be asked later: use the argument `radius`."),
                Mistake(_center(lambda x, z, r, R, s: np.array([x, np.sqrt(R * R - r * r), z])),
                        "You always take the positive root, but the center may lie on either side: multiply by side."),
                Mistake(_center(lambda x, z, r, R, s: np.array([x, -np.sqrt(R * R - r * r), z])),
                        "You always take the minus sign, as listing C16 does: multiply by side instead."),
                Mistake(_center(lambda x, z, r, R, s: np.array([x, s * (R * R - r * r), z])),
                        "This is the square of the offset: take the root of R^2 - r^2."),
                Mistake(_center(lambda x, z, r, R, s: np.array([x, s * R, z])),
                        "You went a whole radius of the sphere aside. The offset is d = sqrt(R^2 - r^2)."),
                Mistake(_center(lambda x, z, r, R, s: np.array([x, s * r, z])),
                        "You went the circle's radius aside. The offset is d = sqrt(R^2 - r^2)."),
                Mistake(lambda x, z, R, s: np.array([x.mean(), s * np.sqrt(R * R - fit_circle(x, z)[2] ** 2), z.mean()]),
                        "x and z are the mean of the points, but an arc lies on one side of its center. Take the circle's center."),
                Mistake(_center(lambda x, z, r, R, s: np.array([x, 0.0, z])),
                        "This is the center of the circle. The sphere's center lies off the plane by d."),
                Mistake(_center(lambda x, z, r, R, s: np.array([x, s * np.sqrt(R * R - r * r), z + R])),
                        "You went a radius deeper. The circle's center is already as deep as the sphere's."),
                Mistake(_center(lambda cx, cz, r, R, side: np.array([cx, side * np.sqrt(abs(30.0**2 - r * r)), cz])),
                        "This takes a sphere of 30 mm, whatever `radius` says."),
                Mistake(_center(lambda cx, cz, r, R, side: np.array([cx, side * np.sqrt(abs(R - r)), cz])),
                        "The squares are missing under the root: d^2 = R^2 - r^2."),
            ],
        ),
        Exercise(
            "kuka_residual",
            reference=lambda p2, T_BF, x_S, target: _residual(frames.matrix_from_kuka(p2), T_BF, x_S, target),
            sizes=("T_BF", "x_S", "target"),
            draw=tuple(functools.partial(kuka_scene, n=n) for n in COUNTS),
            fixed={"p2": "a KUKA pose is always six numbers", "target": POINT},
            metric=metrics.Numbers(1e-9, "mm"),
            noisy=tuple((draw, metrics.Numbers(1e-9, "mm"), words) for draw, words in SPECIAL_KUKA),
            hints=(
                "Follow the point from the scanner outward: which transform comes first?",
                "T_BF T_FS x_S - target, with T_FS = matrix_from_kuka(p2). `frames.transform` takes stacks of poses.",
                "`return frames.transform(T_BF, frames.transform(frames.matrix_from_kuka(p2), x_S)) - target`",
            ),
            mistakes=[
                Mistake(lambda p2, T, x, c: -_residual(frames.matrix_from_kuka(p2), T, x, c),
                        "The sign is reversed: (4-3) subtracts the target from the measured side."),
                Mistake(lambda p2, T, x, c: _residual(frames.matrix_from_kuka(p2), T, x, -c), "The target is to be subtracted; yours is added."),
                Mistake(lambda p2, T, x, c: frames.transform(T, x) - c, "T_FS is missing: x_S is still in the scanner's frame when T_BF meets it."),
                Mistake(_kuka_flange_inverse, "You used the inverse of T_BF: it maps F to B, as it stands."),
                Mistake(_kuka_in_flange, "These are the residuals along the axes of F, as if the target were brought into the flange. (4-3) brings the sphere into B.", id="kuka_residual-in-flange"),
                Mistake(_kuka_in_scanner, "These are the residuals along the axes of S, as if the target were brought into the scanner. (4-3) brings the sphere into B.", id="kuka_residual-in-scanner"),
                Mistake(_kuka_angles("XYZ"), "You turned by A about x and by C about z. KUKA: A about z, then B about y, then C about x."),
                Mistake(_kuka_angles("zyx"), "This is Rx(C) Ry(B) Rz(A), as for turns about fixed axes. A, B, C turn about axes that move along: Rz(A) Ry(B) Rx(C).", id="kuka_residual-23be1c"),
                Mistake(_kuka_without_target, "The target is missing: these are positions of the sphere in the base, not residuals."),
                Mistake(_kuka_scanner_first, "The order is T_FS T_BF: the letters do not cancel. From S to F, then from F to B: T_BF T_FS."),
                Mistake(_kuka_inverse, "You used the inverse of T_FS: p2 is the scanner in the flange frame, it maps S to F."),
                Mistake(_kuka_degrees, "You converted the angles from degrees, but p2 holds radians here."),
                Mistake(lambda p2, T, x, c: _residual(frames.matrix_from_kuka(np.deg2rad(p2)), T, x, c),
                        "You converted all of p2 from degrees, but it holds millimeters and radians."),
                Mistake(lambda p2, T, x, c: frames.transform(T, x @ frames.matrix_from_kuka(p2)[:3, :3] + p2[:3]) - c,
                        "You turned x_S by the transpose of R_FS. For points in rows, R x is `x @ R.T`."),
                Mistake(lambda p2, T, x, c: frames.transform(T, x @ frames.matrix_from_kuka(p2)[:3, :3].T) - c,
                        "The translation of T_FS is missing, or the fourth coordinate of x_S is 0: a point has 1 there."),
                Mistake(lambda p2, T, x, c: frames.transform(T, frames.transform(frames.matrix_from_kuka(p2), x) - c),
                        "You subtracted the target in the flange's frame. It is written in B: subtract it last."),
                Mistake(lambda p2, T, x, c: frames.transform(T, frames.transform(frames.matrix_from_kuka(p2), x - c)),
                        "You subtracted the target from x_S. They are written in different frames: subtract it last, in B."),
                Mistake(_kuka_directions, "The flange's own position is missing, or the fourth coordinate is 0 where T_BF is applied: a point has 1 there.", id="kuka_residual-4fbf1c"),
                Mistake(lambda p2, T_BF, x_S, target: np.einsum("nij,nj->ni", T_BF @ frames.matrix_from_kuka(p2), np.insert(x_S, 3, 0.0, axis=1))[:, :3] - target,
                        "Both translations are missing. A point in homogeneous coordinates ends in 1; with 0 it is a direction."),
            ],
        ),
        Prediction(
            "thirty_one",
            question="At its one validated pose the thesis is off by 0.7 mm. What is the rms over all 31 (with one digit of pose 2 put right)?",
            choices=("about 0.7 mm", "about 3 mm", "about 12 mm"),
            answer="about 12 mm",
            why="The validated pose is the best of the 31. Two poses stand 36 and 43 mm away, and most others 2 to 9.",
        ),
        Value(
            "rms_before",
            reference=lambda: _rms_of_end_pose(2),
            unit="mm",
            rtol=2e-3,
            of={"the residuals": _vectors_of_end_pose},
            hints=(
                "The residuals of all 31 poses under the thesis's end pose and its printed sphere center.",
                "rms distance: the root of the mean of the squared lengths, one length per pose.",
                "`residuals = kuka_residual(p2_end, repaired.T_BF, repaired.x_S, target)\n"
                "rms_before = np.sqrt((residuals**2).sum(axis=1).mean())`",
            ),
            mistakes=[
                Mistake(lambda: _per_axis(_rms_of_end_pose(2)), "This is the rms of one coordinate, smaller by a factor of sqrt(3). Sum the squares of a pose first.", "rms_before-19745e"),
                Mistake(_rms_of_end_pose, "This includes the 2237 mm of pose 2. Use the measurements with that one entry repaired."),
                Mistake(lambda: _rms_of_end_pose(*ALL_FIXED), "This uses all corrections. At this point only pose 2 is repaired."),
                Mistake(lambda: _per_axis(_rms_of_end_pose()),
                        "This is the rms of one coordinate, and it includes the 2237 mm of pose 2. Use `repaired`, and sum the squares of a pose first."),
                Mistake(lambda: _joint_rms(2), "This is a fit. Asked for are the residuals under the thesis's own end pose and its printed center."),
                Mistake(lambda: _rms_with_printed_target((2,)), "This is a fit of the scanner's pose, the center held. Asked for are the residuals under the thesis's own end pose `p2_end`.", id="rms_before-fit"),
                Mistake(lambda: float(_lengths_of_end_pose().max()), "This is the worst pose. Asked for is the rms over all 31."),
                Mistake(lambda: float(_lengths_of_end_pose().mean()), "This is the mean length: square before you take the mean, then take the root."),
                Mistake(lambda: float(np.median(_lengths_of_end_pose())), "This is the median length. Asked for is the rms, in which the worst poses count."),
                Mistake(lambda: float(np.sqrt(np.mean(_vectors_of_end_pose().sum(axis=1) ** 2))), "The three coordinates of a pose are added before they are squared, as listing C3 does: errors of opposite sign cancel. Square first."),
                Mistake(lambda: _rms_of_end_pose(2) ** 2, "This is the mean square: take its root."),
                Mistake(lambda: np.sqrt(31) * _rms_of_end_pose(2), "This is the root of the sum: divide by the number of poses first."),
                Mistake(lambda: _rms_of_end_pose(2) * np.sqrt(31 / 30), "The mean of the squares divides by n - 1 here. A mean divides by the 31 poses."),
                Mistake(_rms_without_pose_2, "Pose 2 is left out. Repaired, it counts like the others: use `repaired`, all 31."),
                Mistake(lambda: float(_lengths_of_end_pose()[0]), "This is pose 1 alone. The rms is over all 31."),
                Mistake(_scatter_of_end_pose, "This is how far the residuals scatter about their mean. The mean is part of them: do not take it off.", id="rms_before-scatter"),
                Mistake(lambda: float(_vectors_of_end_pose().std()), "This is the standard deviation of all coordinates, their mean taken off. Asked for is the rms of the lengths."),
            ],
        ),
        Exercise(
            "numeric_jacobian",
            reference=_central,
            draw=(smooth_function, functools.partial(smooth_function, m=1), functools.partial(smooth_function, n=1)),
            metric=metrics.Numbers(1e-9),
            decimals={"x": "the docstring says floats"},
            noisy=tuple(
                (functools.partial(smooth_function, **special), metrics.Numbers(tol, least=least), words)
                for special, tol, least, words in SPECIAL_FUNCTIONS
            )
            + (
                (some_at_nought, metrics.Numbers(1e-9), "right, but not where variables are 0:"),
                (returning_a_view, metrics.Numbers(1e-9), VIEW),
            ),
            hints=(
                "Move one variable at a time, and look at the function ahead and behind.",
                "Column k is (f(x + h e_k) - f(x - h e_k)) / (2 h), with e_k the k-th unit vector.",
                "`return np.column_stack([(function(x + h) - function(x - h)) / (2 * step) for h in step * np.eye(len(x))])`",
            ),
            mistakes=[
                Mistake(_forward, "This is the forward difference of listing C4, off by h f''/2. Take the step in both directions."),
                Mistake(_backward, "This is the backward difference. Take the step in both directions."),
                Mistake(lambda f, x, h: _central(f, x, h) * h * h, "Your differences are halved and then multiplied by the step, as by `/ 2 * step`. Divide by both: / (2 * step).", id="numeric_jacobian-49395f"),
                Mistake(lambda f, x, h: _central(f, x, 1e-6), "This is what a far smaller step than `step` gives, or the derivative itself. Use the argument `step`: the figure below varies it.", id="numeric_jacobian-dce1a6"),
                Mistake(lambda f, x, h: (f(x + h) - f(x - h)) / (2 * h), "You moved all variables at once. Move one at a time: one column each."),
                Mistake(lambda f, x, h: -_central(f, x, h),
                        "The sign is reversed: what is ahead minus what is behind."),
                *(
                    Mistake(variant, "One of your two places is x itself, one step from the other one, and you divide by two steps. Take the step in both directions.", id=f"numeric_jacobian-half-{side}")
                    for side, variant in (("ahead", lambda f, x, h: _forward(f, x, h) / 2), ("behind", lambda f, x, h: _backward(f, x, h) / 2))
                ),
                Mistake(
                    lambda f, x, h: np.column_stack([np.imag(f(x + 1j * e)) / h for e in h * np.eye(len(x))]),
                    "This steps to complex places: where a function takes them that is a derivative too, but no central difference. Step to both sides of x.",
                    id="numeric_jacobian-complex",
                ),
                *(Mistake(lambda f, x, h, small=small: (4 * _central(f, x, h * small) - _central(f, x, 2 * h * small)) / 3,
                          "Here differences of two steps are put together, so that their first errors cancel (Richardson). Asked for is the one central difference, a whole step to each side.",
                          id=f"numeric_jacobian-richardson-{small:g}") for small in (1, 0.5)),
                Mistake(lambda f, x, h: 2 * _central(f, x, h), "Your result is twice too large: between ahead and behind lie two steps, so divide by 2 h."),
                Mistake(lambda f, x, h: _central(f, x, h) * 2 * h, "You have not divided by the distance 2 h yet."),
                Mistake(lambda f, x, h: _central(f, x, h).T, "Your matrix is the transpose: one row a function value, one column a variable."),
                Mistake(lambda f, x, h: _central(f, x, h / 2),
                        "You go half a step to each side. That is a central difference too, but of step / 2; here each side takes a whole step."),
                *(Mistake(variant, "After a variable has been moved it must go back before the next one moves: work on a fresh copy of x.", id=id)
                  for variant, id in ((_not_restored, "numeric_jacobian-309efc"), (_neither_restored, "numeric_jacobian-neither-restored"))),
                Mistake(lambda f, x, h: np.column_stack([(f(x + d * x) - f(x - d * x)) / (2 * h) for d in h * np.eye(len(x))]),
                        "Your step grows with x: step times x. It is the same for all variables."),
                Mistake(lambda f, x, h: _central(f, x, h).sum(axis=0), "The values of the function are added. Each has a row of its own: shape (m, n)."),
            ],
        ),
        Prediction(
            "step",
            question="With which step is a central difference by the angle A most accurate here?",
            choices=("near 0.0000001 deg", "near 0.001 deg", "near 1 deg"),
            answer="near 0.001 deg",
            why="Rounding grows as 1/h, curvature as h²: they meet near the cube root of the machine's precision. The listing's step is too small.",
        ),
        Exercise(
            "analytic_jacobian",
            reference=analytic_jacobian,
            sizes=("T_FS", "T_BF", "x_S"),
            draw=tuple(lambda rng, n=n: pose_off(rng, n)[:3] for n in COUNTS),
            fixed={"T_FS": POSE},
            metric=metrics.Numbers(1e-6),  # good differences are right as well
            noisy=((close_to_the_scanner, metrics.Numbers(1e-5), "right, but not for a sphere within a millimeter of the scanner's origin:"),),
            hints=(
                "Insert T_FS exp(phi) into the residual and keep what is linear in phi and in the translation.",
                "R_BF R_FS exp(phi) x = R_BF R_FS (x + phi x x) = ... - R_BF R_FS [x] phi; the translation enters through R_BF alone.",
                "`R_BF, R_FS = T_BF[:, :3, :3], T_FS[:3, :3]\n"
                "return np.concatenate([-R_BF @ R_FS @ skew(x_S), R_BF], axis=2).reshape(-1, 6)`",
            ),
            mistakes=[
                Mistake(functools.partial(_jacobian, sign=1.0), "The first three columns have the wrong sign: phi x x = -[x] phi."),
                Mistake(lambda T, B, x: _jacobian(T, B, frames.transform(T, x), left=True),
                        "Your arm is T_FS x_S: this turns about the origin and the axes of F, exp(phi) T_FS. Here phi turns x_S alone, in the scanner's axes: R_BF R_FS [x_S].", id="analytic_jacobian-256065"),
                Mistake(lambda T, B, x: _jacobian(T, B, frames.transform(T, x)),
                        "Your arm is T_FS x_S, turned by R_FS once more. phi turns x_S itself, in the scanner's axes: R_BF R_FS [x_S]."),
                Mistake(lambda T, B, x: analytic_jacobian(T, B, x).reshape(-1, 3, 6).swapaxes(0, 1).reshape(-1, 6),
                        "The rows stand all x, all y, all z; wanted is x, y, z of pose 1, then of pose 2, ..."),
                Mistake(lambda T, B, x: analytic_jacobian(T, B, x).reshape(-1, 3, 6),
                        "The blocks are right; stack them into one matrix of 3 N rows, `.reshape(-1, 6)`."),
                Mistake(lambda T, B, x: _jacobian(T, B, x @ T[:3, :3].T, left=True),
                        "You turned about the axes of F, exp(phi) R_FS. Here the increment stands on the right, R_FS exp(phi)."),
                Mistake(_jacobian_without_base, "R_BF is missing: the residual is written in the base."),
                Mistake(lambda T, B, x: analytic_jacobian(T, B, x)[:, [3, 4, 5, 0, 1, 2]],
                        "The blocks have changed places: rotation first, then translation."),
                Mistake(lambda T, B, x: np.hstack([analytic_jacobian(T, B, x)[:, :3], (B[:, :3, :3] @ T[:3, :3]).reshape(-1, 3)]),
                        "Your translation columns hold R_BF R_FS, but tau is added to t_FS, which is written in F: R_BF alone."),
                Mistake(lambda T, B, x: _jacobian(T, B, x, left=True), "R_FS is missing between R_BF and [x]."),
                Mistake(lambda T, B, x: np.hstack([analytic_jacobian(T, B, x)[:, :3], np.tile(np.eye(3), (len(x), 1))]),
                        "tau is a change in F, the residual is in B: its columns are R_BF, not I."),
                Mistake(lambda T, B, x: _jacobian(T, np.swapaxes(B, 1, 2), x), "Your R_BF is the transpose: the residual is written in B, so F is turned into B."),
                Mistake(lambda T, B, x: _jacobian(T.T, B, x), "Your R_FS is the transpose: x_S is turned from S into F."),
                Mistake(lambda T, B, x: np.concatenate([-T[:3, :3] @ B[:, :3, :3] @ skew(x), B[:, :3, :3]], axis=2).reshape(-1, 6),
                        "R_FS and R_BF have changed places. From S to F comes first: R_BF R_FS [x]."),
                Mistake(lambda T, B, x: np.concatenate([-B[:, :3, :3] @ T[:3, :3] @ skew(x), B[:, :3, :3]], axis=1).reshape(-1, 6),
                        "The two blocks of a pose belong side by side: axis=2, or np.hstack for one pose."),
                Mistake(lambda T_FS, T_BF, x_S: analytic_jacobian(T_FS, T_BF, x_S) * np.repeat([np.pi / 180, 1.0], 3),
                        "The first three columns are per degree. phi is in rad."),
                Mistake(lambda T_FS, T_BF, x_S: analytic_jacobian(T_FS, T_BF, x_S) * np.repeat([1.0, -1.0], 3),
                        "The columns of tau have the wrong sign: t_FS + tau moves the point by + R_BF tau."),
            ],
        ),
        Exercise(
            "gauss_newton_on_pose",
            reference=gauss_newton_on_pose,
            draw=(pose_off, functools.partial(pose_off, n=MANY)),
            fixed={"T_FS": POSE, "target": POINT},
            metric=metrics.Poses(1e-6, 1e-6),
            noisy=(
                (uphill, metrics.Poses(1e-5, 1e-5), "right, but not from a start so far off that the residuals grow with the step. Gauss-Newton takes it whole all the same:"),
                (functools.partial(pose_off, turn=1e-6, shift=1e-4), metrics.Poses(1e-6, 1e-6), "right, but not from a start that is off by less than 0.001 mm and a millionth of a rad:"),
                (few_poses, metrics.Poses(1e-4, 1e-4), "right, but not for three poses:"),
                (fitting_exactly, metrics.Poses(1e-6, 1e-6), "right, but not from a start that fits exactly, from where the step is 0:"),
                (one_far_off, metrics.Poses(1e-5, 1e-5), "right, but not where one sphere center is far off. Gauss-Newton's step hears it like all others:"),
            ),
            hints=(
                "Solve the linearized problem for the step, then move the pose by it.",
                "step = argmin |J step + e|; the first three entries are a rotation vector on the right of R_FS, the last three a translation.",
                "`J = analytic_jacobian(T_FS, T_BF, x_S)\n"
                "e = frames.transform(T_BF, frames.transform(T_FS, x_S)) - target\n"
                "step = np.linalg.lstsq(J, -e.ravel(), rcond=None)[0]\n"
                "return frames.pose(T_FS[:3, :3] @ exp_so3(step[:3]), T_FS[:3, 3] + step[3:])`",
            ),
            mistakes=[
                Mistake(_step_in_two_frames, "Your residuals stand along the axes of F, the rows of the Jacobian in B: bring both into one frame.", id="gauss_newton-two-frames"),
                Mistake(_step_of_nine, "This is the step with the sphere's center free as well, nine unknowns. Here the target is held fixed: six.", id="gauss_newton-nine"),
                Mistake(_step_of_translation, "Only tau is solved for. Rotation and translation move the residuals together: all six columns at once.", id="gauss_newton-translation"),
                Mistake(_iterated, "This is where the steps end, the pose that fits best. Asked for is one step.", id="gauss_newton_on_pose-a1607f"),
                Mistake(lambda *a: gauss_newton_on_pose(gauss_newton_on_pose(*a), *a[1:]), "You took two steps. Asked for is one."),
                Mistake(_stepped(lambda T, s: s), "You return the step. Move the pose by it: R_FS exp(phi) and t_FS + tau."),
                Mistake(_stepped(lambda T, s: frames.pose(exp_so3(s[:3]), s[3:]) @ T),
                        "You moved the pose from the left as a whole. Turn it on the right, R_FS exp(phi), and add tau to t_FS."),
                Mistake(_stepped(lambda T, s: T @ frames.pose(exp_so3(s[:3]), s[3:])),
                        "You moved the pose from the right as a whole, so tau is turned by R_FS. It is written in F: add it to t_FS."),
                Mistake(_stepped(lambda T, s: frames.moved(T, s / 2)), "Your step is half of Gauss-Newton's, in rotation and translation.", id="gauss_newton_on_pose-05e1fd"),
                Mistake(_step_without_target, "The target is missing from your residual: the step leads to the base's origin."),
                Mistake(_stepped(lambda T, s: frames.pose(T[:3, :3] @ exp_so3(s[3:]), T[:3, 3] + s[:3])),
                        "Rotation and translation have changed places: the first three entries of the step are phi."),
                Mistake(_stepped(lambda T, s: frames.pose(T[:3, :3] @ Rotation.from_euler("xyz", s[:3]).as_matrix(), T[:3, 3] + s[3:])),
                        "phi is one rotation vector, not three angles to turn by in turn: use exp_so3."),

                Mistake(_stepped(lambda T, s: frames.moved(T, -s)), "You stepped uphill: the step solves J step = -e."),
                Mistake(_stepped(lambda T, s: frames.pose(exp_so3(s[:3]) @ T[:3, :3], T[:3, 3] + s[3:])),
                        "The turn exp(phi) stands on the left. Your Jacobian turns about the scanner's axes, so it belongs on the right of R_FS."),
                Mistake(_stepped(lambda T, s: frames.pose(T[:3, :3] @ lie.nearest_rotation(np.eye(3) + skew(s[:3])), T[:3, 3] + s[3:])),
                        "The nearest rotation to I + [phi] would arrive too, but it turns by atan |phi|, not |phi|. Asked for is exp_so3."),
                Mistake(_stepped(lambda T, s: np.block([[T[:3, :3] @ (np.eye(3) + skew(s[:3])), (T[:3, 3] + s[3:])[:, None]], [0, 0, 0, 1]])),
                        "I + [phi] is only nearly a rotation. Use exp_so3, or the error grows with every step."),
                Mistake(_stepped(lambda T, s: frames.pose(T[:3, :3], T[:3, 3] + s[3:])), "The rotation has not been moved."),
                Mistake(_stepped(lambda T, s: frames.pose(T[:3, :3] @ exp_so3(s[:3]), T[:3, 3])), "The translation has not been moved."),
                Mistake(_gradient_step, "You went along the gradient. Gauss-Newton solves with J^T J as well."),
                Mistake(lambda T_FS, T_BF, x_S, target: frames.moved(T_FS, -analytic_jacobian(T_FS, T_BF, x_S).T @ _residual(T_FS, T_BF, x_S, target).ravel()),
                        "This steps down the gradient. Gauss-Newton solves J step = -e in the least-squares sense."),
                Mistake(lambda T_FS, T_BF, x_S, target: frames.moved(T_FS, _step(T_FS, T_BF, x_S, thesis.printed_target())),
                        "The thesis's sphere center stands where the argument `target` belongs."),
                Mistake(lambda T_FS, T_BF, x_S, target: frames.moved(T_FS, _step(T_FS, T_BF, x_S, -target)),
                        "The target is added to what is measured. The residual subtracts it."),
                Mistake(lambda T_FS, T_BF, x_S, target: gauss_newton_on_pose(np.eye(4), T_BF, x_S, target),
                        "The step starts from the identity. It starts where T_FS is."),
            ],
        ),
        Prediction(
            "pole",
            question="The scanner sits next to B = -90 deg. What do Gauss-Newton steps in A, B, C do that steps on the pose do not?",
            choices=("they never arrive", "they take detours", "nothing"),
            answer="they take detours",
            why="Near the pole A and C turn about one line: their steps become huge and nearly cancel. The pose often arrives all the same, after two or three times the steps.",
        ),
        Prediction(
            "trust_arrives",
            question="From how many of the ten starts of table 7-2 does the trust region of chapter 4 arrive?",
            choices=("seven", "nine", "all ten"),
            answer="all ten",
            why="The residuals are linear in the translation and nearly so in these small turns: the model is good, no step is taken back, and only the radius makes it slower.",
        ),
        Exercise(
            "joint_residual",
            reference=joint_residual,
            sizes=("T0", "T_BF", "x_S"),
            draw=tuple(functools.partial(increments, n=n) for n in COUNTS),
            noisy=(
                (functools.partial(increments, turn=0.0), metrics.Numbers(1e-9, "mm"),
                 "Right where phi turns. Where phi is 0, as at the start of a search, exp(phi) is I:"),
                (functools.partial(increments, turn=3e-7), metrics.Numbers(1e-9, "mm"), "right, but not where phi is some 1e-7 rad:"),
                (functools.partial(increments, turn=2.0), metrics.Numbers(1e-9, "mm"), "right, but not where phi turns far:"),
                (beyond_half_a_turn, metrics.Numbers(1e-9, "mm"), "right, but not where phi is longer than half a turn:"),
            ),
            fixed={"u": "nine unknowns", "T0": POSE},
            metric=metrics.Numbers(1e-9, "mm"),
            hints=(
                "Six of the nine unknowns move the scanner, three are the sphere's center itself.",
                "T_FS = (R0 exp(phi), t0 + dt) with phi = u[:3], dt = u[3:6]; the center is u[6:].",
                "`T_FS = frames.pose(T0[:3, :3] @ exp_so3(u[:3]), T0[:3, 3] + u[3:6])\n"
                "return (frames.transform(T_BF, frames.transform(T_FS, x_S)) - u[6:]).ravel()`",
            ),
            mistakes=[
                Mistake(lambda u, T, B, x: _residual(frames.pose(exp_so3(u[:3]) @ T[:3, :3], T[:3, 3] + u[3:6]), B, x, u[6:]).ravel(),
                        "The turn exp(phi) belongs on the right of R0."),
                Mistake(lambda u, T, B, x: _residual(frames.pose(T[:3, :3] @ exp_so3(u[:3]), u[3:6]), B, x, u[6:]).ravel(),
                        "The change of translation u[3:6] is to be added to the translation of T0."),
                Mistake(lambda u, T, B, x: _residual(frames.pose(T[:3, :3] @ exp_so3(u[:3]), T[:3, 3] + T[:3, :3] @ u[3:6]), B, x, u[6:]).ravel(),
                        "Your change of translation is turned by R0. It is written in F, so add it as it is."),
                Mistake(lambda u, T, B, x: _residual(frames.moved(T, u[:6]), B, x, -u[6:]).ravel(), "The center is subtracted, yours is added."),
                Mistake(lambda u, T, B, x: _residual(frames.moved(T, u[:6]), B, x, np.zeros(3)).ravel(), "The center u[6:] is missing."),
                Mistake(lambda u, T, B, x: _residual(frames.pose(T[:3, :3] @ exp_so3(u[3:6]), T[:3, 3] + u[:3]), B, x, u[6:]).ravel(),
                        "Rotation and translation have changed places: phi comes first."),
                Mistake(lambda u, T, B, x: _residual(frames.moved(T, np.r_[-u[:3], u[3:6]]), B, x, u[6:]).ravel(), "You turned by exp(-phi), backward."),
                Mistake(lambda u, T, B, x: -_residual(frames.moved(T, u[:6]), B, x, u[6:]).ravel(), "The sign is reversed: the center is subtracted from what is measured."),
                Mistake(lambda u, T, B, x: (frames.transform(frames.moved(T, u[:6]), x) - frames.transform(frames.invert(B), u[6:])).ravel(),
                        "Your residual is written in the flange's frame: bring the measured point to B, and subtract the center there."),
                Mistake(lambda u, T, B, x: _residual(T, B, x, u[6:]).ravel(), "T0 has not been moved by u[:6]."),
                Mistake(lambda u, T, B, x: _residual(frames.pose(exp_so3(u[:3]), u[3:6]), B, x, u[6:]).ravel(),
                        "T0 is missing: u[:6] is a change of T0, not a pose of its own."),
                Mistake(lambda u, T, B, x: _residual(frames.pose(exp_so3(u[:3]), u[3:6]) @ T, B, x, u[6:]).ravel(),
                        "You moved T0 from the left as a whole. Turn it on the right, R0 exp(phi), and add the change of translation."),
                Mistake(lambda u, T, B, x: frames.transform(B, x @ (T[:3, :3] @ (np.eye(3) + skew(u[:3]))).T + T[:3, 3] + u[3:6]).ravel() - np.tile(u[6:], len(x)),
                        "I + [phi] is only nearly a rotation, and phi need not be small: use exp_so3."),
                Mistake(lambda u, T, B, x: hand_eye.kuka_residuals(u[:6], B, x, u[6:]).ravel(),
                        "You read u[:6] as a KUKA pose. It is a rotation vector and a change of translation about T0."),
                Mistake(lambda u, T, B, x: _residual(frames.moved(T, u[:6]), B, x, u[6:]).T.ravel(), "The order is all x, all y, all z; wanted is x, y, z of pose 1, then of pose 2, ..."),
                Mistake(lambda u, T, B, x: _residual(frames.moved(T, u[:6]), B, x, u[6:]), "The residuals are right; stack them into one vector of 3 N numbers."),
                Mistake(lambda u, T0, T_BF, x_S: joint_residual(np.concatenate([u[3:], u[:3]]), T0, T_BF, x_S),
                        "The order of the unknowns is phi, tau, center; here the center is read from the front."),
            ],
        ),
        Exercise(
            "linear_start",
            reference=hand_eye.linear_start,
            draw=(lambda rng: scene(rng)[1:3], just_enough, lambda rng: scene(rng, MANY)[1:3]),
            metric=metrics.Several(metrics.Poses(1e-5, 1e-4), metrics.Numbers(1e-7, "mm"), names=("T_FS", "target")),
            noisy=((noisy_scene, LinearStart(0.5, 2.5, 2e-3), "exact on the clean data tried, but not on noisy data:"),
                   (first_ones_alike, LinearStart(0.4, 2.0, 2e-3),
                    "exact on the clean data tried, but not where only the last of the noisy poses turn far (are all heard?):"),
                   (functools.partial(first_ones_alike, numbers=(60, 70), turn=1e-4), LinearStart(0.4, 2.0, 2e-3),
                    "exact on the clean data tried, but not for 60 noisy poses and more of which only the last ones turn far (are all heard?):")),
            hints=(
                "Forget for a moment that R_FS is a rotation: then all unknowns enter linearly.",
                "R_FS x + t_FS - R_BF^T target = -R_BF^T t_BF. Fifteen unknowns: nine of R_FS, three of t_FS, three of the target. A pose gives three rows: `np.kron(np.eye(3), x)` for R_FS row by row, then `np.eye(3)`, then -R_BF^T. Solve all rows, and take `nearest_rotation` of the first nine.",
                "`A = np.vstack([np.hstack([np.kron(np.eye(3), x), np.eye(3), -T[:3, :3].T]) for T, x in zip(T_BF, x_S)])\n"
                "b = np.concatenate([-T[:3, :3].T @ T[:3, 3] for T in T_BF])\n"
                "u = np.linalg.lstsq(A, b, rcond=None)[0]\n"
                "return frames.pose(nearest_rotation(u[:9].reshape(3, 3)), u[9:12]), u[12:]`",
            ),
            mistakes=[
                Mistake(_linear(lambda T, c: (frames.pose(T[:3, :3].T, T[:3, 3]), c)),
                        "Your rotation is the transpose: perhaps the nine unknowns came back in the other order (rows and columns).", id="linear_start-5d0710"),
                Mistake(_linear(lambda T, c: (T, -c)), "The target has the wrong sign: beside R_FS x + t_FS stands -R_BF^T target.", id="linear_start-8ce953"),
                Mistake(_linear_without_rotation, "On noisy data your nine numbers are not a rotation: take the nearest one."),
                Mistake(_linear(lambda T, c: (frames.invert(T), c)), "Your pose is the inverse, T_SF."),
                Mistake(_linear(lambda T, c: (frames.pose(T[:3, :3], -T[:3, 3]), c)), "The translation of T_FS has the wrong sign."),
                Mistake(_linear_with_unturned_right_side, "Your right side is -t_BF. It is to be turned into the flange frame as well: -R_BF^T t_BF."),
                Mistake(_linear_without_turning_back, "You multiplied by R_BF where R_BF^T is needed: bring everything into the flange frame."),
                Mistake(functools.partial(_linear_by, right=-1.0),
                        "The right side has the wrong sign for your left one: R_FS x + t_FS - R_BF^T target = -R_BF^T t_BF.", id="linear_start-b9d505"),
                Mistake(functools.partial(_linear_by, rotation=lambda M: np.linalg.qr(M)[0]),
                        "QR leaves the signs of its columns open, and trusts the first one most. Take the nearest rotation."),
                *(Mistake(functools.partial(_linear_by, rotation=functools.partial(_gram_schmidt, by_rows=by_rows)),
                          "Gram-Schmidt keeps the direction of one axis and bends the others to it. The nearest rotation trusts all three alike.",
                          id=f"linear_start-gram-schmidt-{by_rows + 1}") for by_rows in (False, True)),
                Mistake(_linear(lambda T, c: (frames.pose(T[:3, :3], c), T[:3, 3])),
                        "t_FS and the center have changed places. In which order do your unknowns stand?", id="linear_start-b9ba7f"),
            ],
        ),
        Exercise(
            "robust_weights",
            reference=robust_weights,
            sizes=("residuals",),
            draw=(residuals_with_outliers, functools.partial(residuals_with_outliers, odd=1), residuals_of_all_lengths),
            metric=metrics.Numbers(1e-3),  # the printed 1.538 is good enough
            noisy=tuple((draw, metrics.Numbers(1e-3), words) for draw, words in SPECIAL_RESIDUALS),
            hints=(
                "First a scale that outliers cannot spoil, then a weight that falls to zero.",
                "std = median length / 1.538; u = length / (5 std); the weight is (1 - u^2)^2 below u = 1 and 0 above.",
                "`r = np.linalg.norm(residuals, axis=1)\n"
                "u = r / (5 * np.median(r) / robust.MEDIAN_CHI3)\n"
                "return np.where(u < 1, (1 - u**2)**2, 0)`",
            ),
            mistakes=[
                Mistake(_weights(lambda r: _tukey(r / (5 * np.sqrt((r**2).mean() / 3)))), "Your scale is the rms: the outliers themselves stretch it. Take the median."),
                Mistake(_weights(lambda r: _tukey(r / (5 * np.mean(r) / robust.MEDIAN_CHI3))), "Your scale is the mean length: the outliers stretch it. Take the median."),
                Mistake(lambda e: _tukey(np.linalg.norm(e, axis=1) / (5 * np.std(e))), "Your scale is the standard deviation of the entries: the outliers stretch it. Take the median length."),
                Mistake(lambda e: _tukey(np.linalg.norm(e, axis=1) / (5 * np.median(np.abs(e)) / robust.MEDIAN_CHI3)),
                        "You took the median of the absolute values of all entries. Take the median of the lengths, one per pose.", id="robust_weights-d9fe20"),
                Mistake(lambda e: _tukey(np.linalg.norm(e, axis=1) / (5 * 1.4826 * np.median(np.abs(e)))),
                        "Your scale is 1.4826 times the median of the absolute values of all entries. Take the median of the lengths, one per pose, and divide it by 1.538.", id="robust-weights-mad-of-entries"),
                Mistake(_weights(lambda r: _tukey(r / 5 * np.median(r) / robust.MEDIAN_CHI3)), "Your lengths are divided by 5 and multiplied by s, as by `/ 5 * s`. Divide by both: / (5 * s).", id="robust_weights-33979a"),
                Mistake(_weights(lambda r: _tukey((r / (5 * np.median(r) / robust.MEDIAN_CHI3)) ** 2)), "u itself is squared in the formula, yours is squared twice."),
                Mistake(_weights(lambda r: (1 - (r / (5 * np.median(r) / robust.MEDIAN_CHI3)) ** 2) ** 2),
                        GROWS_BEYOND, id="robust_weights-37ae9f"),
                Mistake(_weights(lambda r: np.where(r < 5 * np.median(r) / robust.MEDIAN_CHI3, 0, (1 - (r / (5 * np.median(r) / robust.MEDIAN_CHI3)) ** 2) ** 2)),
                        GROWS_BEYOND, id="robust_weights-37ae9f-2"),
                Mistake(_weights(lambda r: _tukey(r / (5 * np.median(r)))), "The median length of a 3-vector is 1.538 standard deviations: divide by it."),
                Mistake(_weights(lambda r: _tukey(r / (5 * np.median(r) / 0.6745))), "1.4826 (= 1/0.6745) belongs to single numbers. The length of a 3-vector has the median 1.538: divide by that."),
                Mistake(_weights(lambda r: _tukey(r / (5 * np.std(r)))), "Your scale is the standard deviation of the lengths: the outliers stretch it. Take the median length / 1.538."),
                Mistake(_weights(lambda r: _tukey(r / (5 * 1.4826 * np.median(np.abs(r - np.median(r)))))),
                        "Your scale is the median distance of the lengths from their median (MAD). A length is itself a distance, from 0: take its median / 1.538."),
                Mistake(_weights(lambda r: _tukey(r / (5 * np.median(np.abs(r - np.median(r))) / robust.MEDIAN_CHI3))),
                        "You took the median distance of the lengths from their median (MAD). A length is itself a distance, from 0: divide its own median by 1.538.",
                        id="robust-weights-mad-1538"),
                Mistake(_weights(lambda r: 1 - _tukey(r / (5 * np.median(r) / robust.MEDIAN_CHI3))), "Turned around: good poses get weight 1, gross ones 0."),
                Mistake(_weights(lambda r: np.clip(1 - r / (5 * np.median(r) / robust.MEDIAN_CHI3), 0, None) ** 2), "Inside the bracket u is squared: (1 - u^2)^2."),
                Mistake(_weights(lambda r: np.minimum(1, np.median(r) / robust.MEDIAN_CHI3 * 1.345 / r)), "These are Huber's weights, which never reach zero. Tukey's do: (1 - u^2)^2 below u = 1, else 0."),
                Mistake(_weights(lambda r: np.minimum(1, np.median(r) / robust.MEDIAN_CHI3 * 5 / r)), "These are Huber's weights, which never reach zero. Tukey's do: (1 - u^2)^2 below u = 1, else 0.", id="robust_weights-huber-5"),
                *(Mistake(_weights(lambda r, power=power: np.exp(-power * (r / (5 * np.median(r) / robust.MEDIAN_CHI3)) ** 2)), "Weights of this kind (Welsch) never reach zero. Tukey's do: (1 - u^2)^2 below u = 1, else 0.", id=f"robust_weights-welsch-{power:g}")
                  for power in (1, 0.5)),
                Mistake(_weights(lambda r: 1 / (1 + (r / (5 * np.median(r) / robust.MEDIAN_CHI3)) ** 2)), "These are Cauchy's weights, which never reach zero. Tukey's do: (1 - u^2)^2 below u = 1, else 0.", id="robust_weights-cauchy"),
                Mistake(_weights(lambda r: _tukey(r * robust.MEDIAN_CHI3 / np.median(r))), "The factor 5 is missing: u = length / (5 s)."),
                Mistake(_weights(lambda r: _tukey(r / (5 * np.median(r) * robust.MEDIAN_CHI3))), "You multiplied by 1.538: divide the median by it."),
                Mistake(_weights(lambda r: _tukey(r / (5 * np.sort(r)[len(r) // 2] / robust.MEDIAN_CHI3))),
                        "Your middle length is the upper of two where their number is even. The median lies halfway between them: `np.median`.", id="robust-weights-upper-median"),
                Mistake(_weights(lambda r: _tukey(r / (5 * np.sort(r)[(len(r) - 1) // 2] / robust.MEDIAN_CHI3))),
                        "Your middle length is the lower of two where their number is even. The median lies halfway between them: `np.median`.", id="robust-weights-lower-median"),
                Mistake(_weights(lambda r: np.sqrt(_tukey(r / (5 * np.median(r) / robust.MEDIAN_CHI3)))), "The bracket is squared: (1 - u^2)^2."),
                Mistake(_weights(lambda r: (r < 5 * np.median(r) / robust.MEDIAN_CHI3).astype(float)),
                        "You cut off sharply. Tukey's weight falls smoothly, so that no pose decides by crossing a line."),
                Mistake(_weights(lambda r: _tukey(r / 5)), "There is no scale in it: u = length / (5 s), with s from the median length."),
                Mistake(_weights(lambda r: _tukey(r / (7 * np.median(r) / robust.MEDIAN_CHI3))), "The cutoff is that of chapter 3, 7 scales. Here it is 5."),
                Mistake(_weights(lambda r: np.where(r < 5 * np.median(r) / robust.MEDIAN_CHI3, (1 - (r / (5 * np.median(r) / robust.MEDIAN_CHI3)) ** 3) ** 3, 0)),
                        "These are third powers (tricube). Tukey's biweight has squares: (1 - u^2)^2."),
                Mistake(lambda e: _tukey(np.abs(e) / (5 * np.median(np.abs(e)) / robust.MEDIAN_CHI3)),
                        "This weighs each coordinate. A pose is good or bad as a whole: one weight per pose, from the length of its vector."),
                *(Mistake(functools.partial(_weights_of_coordinates, together=together),
                          "Here each coordinate has a weight, and the three are put together. A pose is good or bad as a whole: one weight, from the length of its vector.",
                          id=f"robust_weights-coordinates-{together.__name__}") for together in (np.prod, np.min, np.mean)),
            ],
        ),
        Prediction(
            "slip",
            question="Pose 3 is printed with x = 1379.64 and misses the sphere by 18.27 mm along -x. What happened?",
            choices=("the robot sagged", "a digit is missing", "two digits changed places"),
            answer="two digits changed places",
            why="1397.64 is 18.00 mm farther, and the neighbors on the line stand at 1397.6 to 1398.1. Then 0.41 mm remain, like everywhere else.",
        ),
        Exercise(
            "find_misprints",
            reference=find_misprints,
            draw=(entries_with_more_slips, functools.partial(entries_with_more_slips, mended=(2, 21))),
            metric=named_entries(),
            draws=2,
            limit=15.0,
            properties=(lambda student, rng: _judge_printed(student) or _judge_ambiguous(student),),
            hints=(
                "Two questions: which rows do not fit a robust calibration, and which single slip explains each of them?",
                "Fit the entries robustly. Rows whose residual is longer than 6 `fit.std` are suspects: `misprints.explanations(entries, pose, T_FS, target, std)` tries every slip of a row and puts the most credible first.",
                "`m = thesis.measurements_from(entries)\n"
                "fit = hand_eye.calibrate_sphere_target(m.T_BF, m.x_S, robust=True)\n"
                "bad = np.flatnonzero(np.linalg.norm(fit.residuals, axis=1) > 6 * fit.std)\n"
                "best = [misprints.explanations(entries, int(i) + 1, fit.T_FS, fit.target, fit.std)[0] for i in bad]\n"
                "return {(e.table, e.pose, e.column) for e in best}`",
            ),
            mistakes=[
                Mistake(_by_plain_least_squares, "This is all that a plain least-squares fit shows: its grossest slip bends it so far that the others hide. Fit robustly, and take every pose that stands out, not the worst alone.", id="find_misprints-389b20"),
                Mistake(_too_strict, "You accuse poses that are merely noisy. Among 31 poses some exceed 2.5 standard deviations by chance; take 6."),
                Mistake(_all_explanations, "You name every entry that could be changed. One slip per row: take the most credible explanation."),
                Mistake(lambda entries: _printed_misprints(),
                        "These are the seven of the printed tables. The check plants slips of its own: search the `entries` you are given."),
                Mistake(lambda entries: {key for key in _printed_misprints() if entries[key] == thesis.printed_entries()[key]},
                        "These are the misprints of the printed tables alone. The check plants slips of its own: fit the `entries` you are given, and search their rows.", id="find_misprints-printed"),
                Mistake(lambda entries: {(table, pose - 1, column) for table, pose, column in find_misprints(entries)}, "Your poses are one too low: they count from 1, arrays from 0."),
                Mistake(_first_alone, "You name one misprint, that of the first suspicious row. Does `return` stand inside the loop?", id="find_misprints-first"),
                Mistake(_worst_alone, "You name one misprint, that of the row with the largest residual. Every row that stands out has one.", id="find_misprints-worst"),
                Mistake(_only_the_grossest, "You named the grossest ones only. After the robust fit 9 mm and even 3 mm stand out as clearly."),
            ],
        ),
        Value(
            "rms_after",
            reference=lambda: _joint_rms(*ALL_FIXED),
            unit="mm",
            rtol=3e-3,
            of={"the residuals": lambda: corrected_fit().residuals},
            hints=(
                "Scanner and center together, all 31 poses, all seven corrections.",
                "`hand_eye.calibrate_sphere_target` on the corrected measurements; no pose is dropped.",
                "`rms_after = hand_eye.calibrate_sphere_target(corrected.T_BF, corrected.x_S).rms`",
            ),
            mistakes=[
                Mistake(lambda: _per_axis(_joint_rms(*ALL_FIXED)), "This is the rms of one coordinate. Sum the squares of a pose first."),
                Mistake(lambda: _robust_fit().rms, "This is a robust fit, which hears some poses less. The tables are corrected: all 31 count alike, `robust=False`."),
                Mistake(_rms_without_the_seven, "Here the seven corrected poses are left out. They are good now: let them count."),
                Mistake(_rms_left_out, "This is the rms with each pose left out in turn, a good question for later. Asked for is the rms of the fit to all 31."),
                Mistake(_mean_distance, "This is the mean length: square before you take the mean, then take the root."),
                Mistake(lambda: _joint_rms(2, 3, 4, 7, 21, 30), "Pose 12 is not corrected yet: one degree is missing there."),
                Mistake(_rms_with_printed_target, "Here the thesis's sphere center was held fixed. Free it."),
                Mistake(lambda: _joint_rms(2), "Only pose 2 is repaired in this fit. Use all corrections."),
                Mistake(lambda: _robust_fit().std, "This is the noise of one coordinate that a robust fit estimates. Asked for is the rms distance of the fit to all 31.", id="rms_after-robust-std"),
                Mistake(lambda: corrected_fit().std, "This is the estimated noise of one coordinate, with 84 degrees of freedom. Asked for is the rms distance."),
                Mistake(_rms_of_linear_start, "This is the rms at the linear start, which takes R_FS for any nine numbers. Iterate from there: `hand_eye.calibrate_sphere_target`.", id="rms_after-linear"),
                Mistake(lambda: _rms_of_end_pose(*ALL_FIXED), "These are the corrected data under the thesis's end pose. Fit scanner and center anew."),
                Mistake(_joint_rms, "These are the tables as printed, with all their slips. Use `corrected`."),
                Mistake(lambda: _joint_rms(*ALL_FIXED) ** 2, "This is the mean square: take its root."),
                Mistake(lambda: _joint_rms(*ALL_FIXED) * np.sqrt(31), "This is the root of the sum: divide by the number of poses first."),
                Mistake(lambda: _robust_fit_as_printed().rms, "This is a robust fit to the tables as printed. Use `corrected`, all 31 alike."),
                Mistake(lambda: _robust_fit_as_printed().std, "This is the noise of one coordinate that a robust fit to the tables as printed estimates. Fit `corrected`, and take the rms distance of all 31.", id="rms_after-printed-std"),
            ],
        ),
        Value(
            "radius",
            reference=lambda: _fitted_radius(),
            unit="mm",
            rtol=2e-4,  # to 0.01 mm
            digits=4,  # three do not tell the radii in question apart
            about=lambda R: _rms_beside(R),
            hints=(
                "Every y was computed as sqrt(30^2 - r^2). Another radius moves all centers along y, and some radius fits best.",
                "`thesis.centers_with_radius(x_S, R)` gives the centers for another R: try a grid, or make R a tenth unknown.",
                "`radius = hand_eye.fit_radius(corrected.T_BF, corrected.x_S).radius`",
            ),
            mistakes=[
                Mistake(lambda: thesis.radius("certificate"), "This is the certificate's radius. Ask the 31 poses instead."),
                Mistake(lambda: thesis.radius("coordinate machine"), "This is the coordinate machine's radius, and the data exclude it. Fit it."),
                Mistake(lambda: thesis.radius("listing"), "This is what listing C16 assumes; if your search gave it, its steps are too coarse. Go to 0.01 mm or finer."),
                Mistake(_shallower_radius,
                        "This is a second, shallower minimum of the rms: below 29.977 mm the circle of pose 4 is larger than the sphere, and its y' is "
                        "pressed flat to 0. Search from 29.98 to 30.02.", within=0.01),
                Mistake(lambda: np.sqrt(2 * 30.0**2 - _fitted_radius() ** 2),
                        "The sign under the root is reversed: y'^2 = y^2 + R^2 - 30^2, so a larger sphere means a larger y'.", within=0.002),
                Mistake(lambda: 2 * _fitted_radius(),
                        "This is a diameter: half of it.", within=0.05),
                Mistake(_radius_with_printed_target, "This radius fits best with the sphere's center held where the thesis has it. Free the center as well.", within=0.002, id="radius-center-held"),
                Mistake(lambda: _rms_with_radius(_fitted_radius()), "This is the rms that the best radius leaves. Asked for is the radius at which it is the least.", within=0.001, id="radius-least-rms"),
                Mistake(_std_of_radius, "This is the standard deviation of the radius. Asked for is the radius itself.", id="radius-std"),
                Mistake(lambda: _radius_without(4), "Pose 4, next to the equator, is left out. Here all 31 corrected poses are asked.", within=0.001),
                Mistake(_radius_with_pose_2_alone, "Only pose 2 is repaired in this fit. Use `corrected`.", within=0.001),
                Mistake(lambda: np.mean([thesis.radius(s) for s in ("certificate", "listing", "coordinate machine")]),
                        "This is the mean of the three radii. Ask the poses, none of the three."),
            ],
        ),
        Prediction(
            "weak",
            question="All 31 poses keep the sphere near one place of the scanner's field. What is known worst?",
            choices=("the sphere's center", "the scanner's orientation", "the distance to the sphere"),
            answer="the scanner's orientation",
            why="Turning the scanner about the sphere, and shifting it to match, changes hardly anything it sees: rotation and translation err together.",
        ),
        Exercise(
            "design_poses",
            reference=design_poses,
            draw=scanner_and_sphere,
            fixed={"T_FS": POSE, "target": POINT},
            properties=(design_is_good,),
            draws=1,
            hints=(
                "Choose where the scanner should see the sphere, and how the flange should be turned; the flange's position then follows.",
                "The scanner's orientation in the base is R_BS = R_BF R_FS, so R_BF = R_BS R_FS.T. Looking straight down is R_BS = diag(1, -1, -1); turn that by up to 45 deg about all axes. `planning.poses_that_see` finds t_BF.",
                "`x_S = np.column_stack([rng.uniform(-25, 25, 31), rng.uniform(3, 25, 31) * rng.choice([-1, 1], 31), rng.choice([190, 290], 31)])\n"
                "turns = rng.uniform(-0.8, 0.8, (31, 3))\n"
                "return planning.poses_that_see(T_FS, target, exp_so3(turns) @ np.diag([1, -1, -1]) @ T_FS[:3, :3].T, x_S)`",
            ),
        ),
        *beyond.LITERATURE,
        Prediction(
            "price_of_two_steps",
            question="Li's method fits the rotation first and then the translation, from the same sixteen poses as the joint fit. How much larger are its errors of the translation?",
            choices=("hardly", "about three times", "about thirty times"),
            answer="about three times",
            why="Step 1 hears only the five poses of one orientation, and what it errs is multiplied by the distance of the sphere in step 2. The joint fit lets all poses speak on both.",
        ),
        Prediction(
            "repeats",
            question="A robot is recalibrated, and the mean of its arrivals moves onto the cross. What happens to its repeatability?",
            choices=("it gets better", "it stays", "it gets worse"),
            answer="it stays",
            why="Repeatability compares the arrivals with one another. Backlash and noise spoil it, and no calibration of lengths and zeros touches them.",
        ),
        *beyond.ACCURACY,
        Prediction(
            "same_orientation",
            question="The scanner's CAD pose is 32 mm off. Two marks are seen from the same flange orientation. By how much is their distance wrong?",
            choices=("not at all", "by 3 mm or so", "by 32 mm or so"),
            answer="not at all",
            why="As long as the flange does not turn and each mark is seen at the same place of the field, the wrong pose shifts both marks alike.",
        ),
        beyond.CAD_LENGTH,
    ],
    further=("twice_as_far", "height_from_angles", "height_std", "trust_arrives", "joint_residual", "linear_start", "weak", "design_poses", "li_rotation", "li_translation", "kim_system", "price_of_two_steps", "repeats", "position_accuracy", "repeatability", "same_orientation", "cad_length",),
)  # fmt: skip


def _judge_printed(student):
    """The printed tables themselves must be among what is checked."""
    wanted = _printed_misprints()
    named = named_entries().admit(student(thesis.printed_entries()), wanted)
    if named - wanted:
        return f"in the printed tables {sorted(named - wanted)[0]} is accused wrongly."
    if wanted - named:
        return f"in the printed tables {len(wanted - named)} of the 7 misprints are not named yet."
    return None


def _judge_ambiguous(student):
    """Nor is it left to chance that of several entries that explain a row the most credible is taken: here the last one
    of row 12 is another entry.
    """
    entries = entries_with_more_slips(np.random.default_rng(0), mended=(2, 21))[0]
    wanted = find_misprints(entries)
    named = named_entries().admit(student(entries), wanted)
    off = named ^ wanted
    of_12 = {entry for entry in named if entry[1] == 12}
    if of_12 and not of_12 & wanted and {pose for _, pose, _ in off} == {12}:
        return "several entries explain row 12, and yours is not the most credible: `explanations` puts that one first."
    return "on one more table not all misprints are named, or too many entries are." if off else None
