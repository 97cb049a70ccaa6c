"""Chapter 1: frames from three points, rigid transforms, KUKA angles."""

import functools
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ...documents.lab_sheet.printed import points
from ...exercises import metrics
from ...exercises.engine import Chapter, Exercise, Prediction
from ...exercises.outcome import Mistake
from ...exercises.special import right_where
from ...exercises.value import Value
from ...geometry import frames, lie
from . import special


def random_direction(rng):
    """A vector of random direction, 20 to 300 long."""
    return frames.unit_vector(rng.normal(size=3)) * rng.uniform(20, 300)


def random_pose(rng):
    """A random pose with its origin some hundred millimeters away."""
    q = rng.normal(size=4)
    return frames.pose(frames.matrix_from_quaternion(q), rng.uniform(-500, 500, 3))


def shift_alone(rng):
    """A pose with the axes of W, elsewhere."""
    return (frames.pose(np.eye(3), rng.uniform(-500, 500, 3)),)


def small_motion(rng):
    """A pose that is nearly the identity: a turn by some hundredths of a degree, a shift by some micrometers."""
    R = Rotation.from_rotvec(rng.uniform(2e-4, 9e-4) * frames.unit_vector(rng.normal(size=3))).as_matrix()
    return (frames.pose(R, 1e-2 * rng.uniform(-1, 1, 3)),)


def nearly_one(rng):
    """Two frames of which one was moved a little."""
    T_WA = random_pose(rng)
    return T_WA, T_WA @ small_motion(rng)[0]


def side_by_side(rng):
    """Two frames turned alike in W, in different places."""
    T_WA = random_pose(rng)
    return T_WA, frames.pose(T_WA[:3, :3], rng.uniform(-500, 500, 3))


ACUTE, OBTUSE = (35, 80), (100, 145)  # deg
SIGNS_OF_AXES = ((1, 1, -1), (1, -1, 1), (-1, -1, 1), (-1, 1, -1))  # of r00, r11 and r22


def two_directions(rng, between=ACUTE, signs=(1, 1, 1)):
    """Two directions at the given angles (deg), of different length; r00, r11 and r22 of their axes have these signs."""
    while True:
        a = random_direction(rng)
        across = frames.unit_vector(np.cross(a, rng.normal(size=3)))
        angle = np.deg2rad(rng.uniform(*between))
        b = rng.uniform(20, 300) * (np.cos(angle) * frames.unit_vector(a) + np.sin(angle) * across)
        if np.array_equal(np.sign(np.diag(frames.gram_schmidt(a, b))), signs):
            return a, b


def three_points(rng, between=ACUTE, signs=(1, 1, 1)):
    """Three measured points of a frame, in millimeters."""
    origin = rng.uniform(-500, 500, 3)
    a, b = two_directions(rng, between, signs)
    return origin, origin + a, origin + b


def either_angle(draw):
    """The draw with an acute and an obtuse angle at the origin, each axis pointing up and down its line, in turn."""
    turns = zip((ACUTE, OBTUSE, ACUTE, OBTUSE), SIGNS_OF_AXES)
    return tuple(functools.partial(draw, between=between, signs=signs) for between, signs in turns)


def scaled_direction(rng, scale):
    """A vector of random direction, tiny or long."""
    return (scale * random_direction(rng),)


def nearly_of_length_1(rng):
    """A vector as one has it that was normalized and then rounded."""
    return ((1 + rng.choice([-4e-6, 4e-6])) * frames.unit_vector(rng.normal(size=3)),)


def nearly_at_right_angles(rng, longest=0.3):
    """Two edges with next to no shadow on each other, which counts all the same; short ones unless told otherwise."""
    between = 90 + rng.choice([-1, 1]) * rng.uniform(5e-4, 2e-3)  # deg
    a, b = two_directions(rng, (between, between), SIGNS_OF_AXES[rng.integers(4)])
    return longest / 300 * a, longest / 300 * b


def nearly_square_points(rng):
    """Three points whose edges are that."""
    origin = rng.uniform(-500, 500, 3)
    return origin, *(origin + edge for edge in nearly_at_right_angles(rng, longest=300))


def edges_on_axes(rng):
    """Two edges along axes of W, at a right angle: many a product in them is exactly 0."""
    one, other = rng.permutation(3)[:2]
    lengths = rng.choice([-1, 1], 2) * rng.uniform(20, 300, 2)
    return lengths[0] * np.eye(3)[one], lengths[1] * np.eye(3)[other]


def edges_nearly_on_axes(rng):
    """The same edges, turned by less than a thousandth: small entries count."""
    turn = Rotation.from_rotvec(rng.uniform(3e-4, 9e-4) * frames.unit_vector(rng.normal(size=3)))
    return tuple(turn.apply(edge) for edge in edges_on_axes(rng))


def points_nearly_on_axes(rng):
    """Three points whose edges are that."""
    origin = rng.uniform(-500, 500, 3)
    return origin, *(origin + edge for edge in edges_nearly_on_axes(rng))


def points_on_axes(rng):
    """The same edges, from the origin of W."""
    return np.zeros(3), *edges_on_axes(rng)


NEARLY_SQUARE = "that are nearly perpendicular, where the shadow is small but not 0:"
NEARLY_ON_AXES = "right, but not nearly along the axes of W, turned by less than a thousandth:"
ON_AXES = "right, but not along the axes of W, where products are exactly 0:"


def kuka_pose(rng, A_deg=(-170, 170), B_deg=(-80, 80), C_deg=(-170, 170)):
    """A KUKA pose, well away from the gimbal lock unless B is asked for there."""
    low, high = zip(A_deg, B_deg, C_deg)
    return (np.concatenate([rng.uniform(-800, 800, 3), np.deg2rad(rng.uniform(low, high))]),)


A_RANGES = ((-80, 80), (100, 170), (-170, -100))  # deg: both signs of r00, and of r10
C_RANGES = ((100, 170), (-80, 80), (-170, -100))  # deg: within and beyond 90 deg at every check, as A is
B_RANGES = ((-80, -5), (5, 80), (-80, 80))  # deg: below and above 0 at every check
QUADRANTS = ((10, 80), (100, 170), (-170, -100), (-80, -10))  # deg: both signs of sine and cosine
NEAR_THE_POLE = ((88, 89), (-89.99, -89.98))  # deg: A and C are still two angles
ROUND = {"A_deg": (185, 355), "B_deg": (-260, -190), "C_deg": (-355, -185)}  # as whoever adds up turns has them
POINT = "a point has three coordinates"
POSE = "one pose is one 4x4 matrix"


def hardly_turned(rng):
    """A KUKA pose with angles of some hundredths of a degree."""
    return (np.concatenate([rng.uniform(-800, 800, 3), 1e-3 * rng.uniform(0.2, 0.9, 3) * rng.choice([-1, 1], 3)]),)


@dataclass(frozen=True)
class _KukaAngles(metrics.Through):
    """Angles of the right pose, and B on the promised side of the poles."""

    def deviations(self, result, expected):
        same_side = _is_beyond_the_poles(result[4]) == _is_beyond_the_poles(expected[4])
        B_deg = np.rad2deg(float(result[4]))
        words = f"{B_deg:.1f} deg is not between -90 and 90 deg; the pose has other angles too, with such a B"
        return [*super().deviations(result, expected), metrics.Deviation("B", float(not same_side), "", 0.5, words)]


def _is_beyond_the_poles(B):
    return abs(float(B)) > np.pi / 2 + 1e-5


def _read_by_kuka(deg):
    return _KukaAngles(frames.matrix_from_kuka, metrics.Poses(deg, 1e-6))


# Wrong variants of Gram-Schmidt, of frames and of transforms -----------------------------------------------------------------


def _columns(x, y, z):
    return np.column_stack([x, y, z])


def _unnormalized(a, b):
    x = a / np.linalg.norm(a)
    y = b - (b @ x) * x
    return _columns(x, y, np.cross(x, y))


def _projected_without_square(a, b):
    x = a / np.linalg.norm(a)
    y = b - (b @ a) / np.linalg.norm(a) * a
    y /= np.linalg.norm(y)
    return _columns(x, y, np.cross(x, y))


def _second_edge_first(a, b):
    y = b / np.linalg.norm(b)
    x = a - (a @ y) * y
    x /= np.linalg.norm(x)
    return _columns(x, y, np.cross(x, y))


def _added(a, b):
    x = a / np.linalg.norm(a)
    y = b + (b @ x) * x
    y /= np.linalg.norm(y)
    return _columns(x, y, np.cross(x, y))


def _not_rejected(a, b):
    x, y = a / np.linalg.norm(a), b / np.linalg.norm(b)
    return _columns(x, y, np.cross(x, y))


def _split_alike(a, b):
    """The rotation nearest to both edges at length 1: it bends x and y alike."""
    x, y = a / np.linalg.norm(a), b / np.linalg.norm(b)
    U, _, Vt = np.linalg.svd(_columns(x, y, np.cross(x, y)))
    return U @ Vt


def _long_z(a, b):
    R = frames.gram_schmidt(a, b)
    return _columns(R[:, 0], R[:, 1], np.cross(a, b))


def _normalized_too_early(a, b):
    x, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    y = b - (b @ x) * x
    return _columns(x, y, np.cross(x, y))


def _projected_on_all_of_a(a, b):
    x, y = a / np.linalg.norm(a), b - (b @ a) * a
    y /= np.linalg.norm(y)
    return _columns(x, y, np.cross(x, y))


def _number_subtracted(a, b):
    x = a / np.linalg.norm(a)
    y = b - b @ x
    y /= np.linalg.norm(y)
    return _columns(x, y, np.cross(x, y))


def _left_handed(a, b):
    R = frames.gram_schmidt(a, b)
    return R * (1, 1, -1)


def _projection_kept(a, b):
    """y along the part of b that should have been removed, signs aside: the classic mix-up of rejection and projection."""
    R = frames.gram_schmidt(a, b)
    return _columns(R[:, 0], R[:, 0] * np.sign(a @ b), np.zeros(3))


def _frame(axes):
    def variant(origin, x_point, y_point):
        T = np.eye(4)
        T[:3, :3] = axes(x_point - origin, y_point - origin)
        T[:3, 3] = origin
        return T

    return variant


def _axes_in_rows(origin, x_point, y_point):
    T = frames.frame_from_points(origin, x_point, y_point)
    T[:3, :3] = T[:3, :3].T
    return T


def _origin_in_the_last_row(origin, x_point, y_point):
    return _origin_below(frames.frame_from_points(origin, x_point, y_point))


def _origin_below(T):
    T = T.copy()
    T[3, :3], T[:3, 3] = T[:3, 3].copy(), 0
    return T


def _points_as_directions(origin, x_point, y_point):
    T = np.eye(4)
    T[:3, :3] = frames.gram_schmidt(x_point, y_point)
    T[:3, 3] = origin
    return T


def _no_translation(origin, x_point, y_point):
    T = frames.frame_from_points(origin, x_point, y_point)
    T[:3, 3] = 0
    return T


def _inverse_frame(origin, x_point, y_point):
    return frames.invert(frames.frame_from_points(origin, x_point, y_point))


def _with(T, R=None, t=None):
    T = T.copy()
    T[:3, :3] = T[:3, :3] if R is None else R
    T[:3, 3] = T[:3, 3] if t is None else t
    return T


def _never_negative(k, sine):
    """A pose whose sine (or cosine) of one angle is made of the other by a root."""

    def variant(xyzabc):
        changed = xyzabc.copy()
        s, c = np.sin(xyzabc[k]), np.cos(xyzabc[k])
        changed[k] = np.arctan2(abs(s), c) if sine else np.arctan2(s, abs(c))
        return frames.matrix_from_kuka(changed)

    return variant


def _about_z_alone(T):
    """The inverse of a turn about z and a shift, from two entries of the rotation."""
    R = np.array([[T[0, 0], T[1, 0], 0], [-T[1, 0], T[0, 0], 0], [0, 0, 1]])
    return _with(T, R, -R @ T[:3, 3])


def _about_z_by_its_angle(T):
    """The same by the angle that these two entries make, as if they were its cosine and sine."""
    R = _turn("z", -np.arctan2(T[1, 0], T[0, 0]))
    return _with(T, R, -R @ T[:3, 3])


def _two_exchanged(R, i, j):
    """A matrix with two entries in each other's place."""
    R = R.copy()
    R[i, j], R[j, i] = R[j, i], R[i, j]
    return R


def _turned_about_z(T_WA, T_WB):
    """The relative pose, its turn the difference of two angles about z."""
    angle = np.arctan2(T_WB[1, 0], T_WB[0, 0]) - np.arctan2(T_WA[1, 0], T_WA[0, 0])
    return _with(frames.relative(T_WA, T_WB), R=_turn("z", angle))


def _kuka(order, angles=(3, 4, 5)):
    """Turns about other axes, or in another order: `order[k]` by the entry `angles[k]` of the pose."""

    def variant(xyzabc):
        R = np.eye(3)
        for axis, k in zip(order, angles):
            R = R @ _turn(axis, xyzabc[k])
        return frames.pose(R, xyzabc[:3])

    return variant


def _turn(axis, angle):
    abc = {"z": (angle, 0, 0), "y": (0, angle, 0), "x": (0, 0, angle)}[axis]
    return frames.matrix_from_kuka(np.concatenate([np.zeros(3), abc]))[:3, :3]


def _turned_back(*axes):
    """A pose with these of its three turns the other way."""
    signs = np.array([1, 1, 1, *(-1 if axis in axes else 1 for axis in "zyx")])
    return lambda xyzabc: frames.matrix_from_kuka(xyzabc * signs)


def _ry_reversed(xyzabc):
    return frames.matrix_from_kuka(xyzabc * np.array([1, 1, 1, 1, -1, 1]))


def _kuka_entry_by_entry(xyzabc):
    T = np.eye(4)
    T[:3, :3] = _turn("z", xyzabc[3]) * _turn("y", xyzabc[4]) * _turn("x", xyzabc[5])
    T[:3, 3] = xyzabc[:3]
    return T


def _kuka_in_degrees(xyzabc):
    return frames.matrix_from_kuka(np.concatenate([xyzabc[:3], np.deg2rad(xyzabc[3:])]))


def _kuka_transposed(xyzabc):
    T = frames.matrix_from_kuka(xyzabc)
    return _with(T, R=T[:3, :3].T)


def _angles(change):
    def variant(T):
        xyzabc = frames.kuka_from_matrix(T)
        return np.concatenate([xyzabc[:3], change(xyzabc[3:])])

    return variant


def _angles_by_quotients(T):
    with np.errstate(divide="ignore"):
        a, c = np.arctan(T[1, 0] / T[0, 0]), np.arctan(T[2, 1] / T[2, 2])
    return np.array([*T[:3, 3], a, np.arcsin(-T[2, 0]), c])


def _arcsine_of_too_much(T):
    """A and C as they should be, B by an arcsine that rounding can break."""
    xyzabc = frames.kuka_from_matrix(T)
    return np.array([*xyzabc[:4], np.arcsin(-T[2, 0]), xyzabc[5]])


def _undone(a_of, b_of=None, turn=lambda a: _turn("z", a).T):
    """The route of the notebook, with another A, another B, or A undone by something else."""

    def variant(T):
        R = T[:3, :3]
        with np.errstate(all="ignore"):
            a = a_of(R)
        b = b_of(R, a) if b_of else np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
        rest = turn(a) @ R
        return np.array([*T[:3, 3], a, b, np.arctan2(-rest[1, 2], rest[1, 1])])

    return variant


def _right_A(R):
    return np.arctan2(R[1, 0], R[0, 0])


def _B_along(R, a):
    return np.arctan2(-R[2, 0], np.cos(a) * R[0, 0] + np.sin(a) * R[1, 0])


def _angles_one_by_one(T):
    b = np.arctan2(-T[2, 0], np.hypot(T[0, 0], T[1, 0]))
    return np.array([*T[:3, 3], np.arctan2(T[1, 0], T[0, 0]), b, np.arctan2(T[2, 1], T[2, 2])])


def _pole_from(limit_deg):
    """A is set to 0 wherever B is beyond the limit, as if all of that were the pole."""

    def variant(T):
        xyzabc, R = frames.kuka_from_matrix(T), T[:3, :3]
        if abs(xyzabc[4]) > np.deg2rad(limit_deg):
            xyzabc[3], xyzabc[5] = 0, np.arctan2(-R[1, 2], R[1, 1])
        return xyzabc

    return variant


def _at_both_poles(c):
    """At both poles A is set to 0 and C is what this makes of the rotation, as it may be right at one of them."""

    def variant(T):
        xyzabc = frames.kuka_from_matrix(T)
        if np.hypot(T[0, 0], T[1, 0]) < 1e-9:
            xyzabc[3], xyzabc[5] = 0, c(T[:3, :3])
        return xyzabc

    return variant


def at_the_pole(sign, last_bit=2**-52):
    """A draw at B = +-90 deg, with the rounding noise that a product of two matrices leaves."""

    def draw(rng):
        xyzabc = kuka_pose(rng)[0]
        xyzabc[4] = sign * np.pi / 2
        turn = random_pose(rng)
        T = frames.invert(turn) @ (turn @ frames.matrix_from_kuka(xyzabc))
        T[2, 0] = -sign * (1 + last_bit)  # the least number above 1, or the largest below, as rounding may leave it
        return (T,)

    return draw


A_HAIR_BELOW_1 = tuple(
    (f"at B = {90 * sign} deg, where rounding leaves r20 a hair short of {-sign}", at_the_pole(sign, -(2**-53)))
    for sign in (1, -1)
)


def beside_the_axes(rng):
    """A and C of 90 or -90 deg: r00 and r22 are 0, as at the pole, and both angles are what they are."""
    xyzabc = kuka_pose(rng)[0]
    xyzabc[[3, 5]] = rng.choice([-1, 1], 2) * np.pi / 2
    return (frames.matrix_from_kuka(xyzabc),)


def half_turns(rng, signs):
    """Half a turn about one axis: what is 0 in it has no sign."""
    return (frames.pose(np.diag(np.array(signs, dtype=float)), rng.uniform(-500, 500, 3)),)


def _K0_T_K1():
    K0, K1 = (frames.frame_from_points(*points()[name]) for name in ("K0", "K1"))
    return frames.relative(K0, K1)


HOLE = 200.0  # mm from the origin of K1, on its x axis


def _drawn():
    """K1 with its own origin, turned by the drawing's 90 deg."""
    return frames.pose(_turn("z", np.pi / 2), _K0_T_K1()[:3, 3])


def _hole():
    return frames.transform(_K0_T_K1(), np.array([HOLE, 0, 0]))


def _hole_as_drawn():
    return frames.transform(_drawn(), np.array([HOLE, 0, 0]))


def _missing():
    return np.pi / 2 - frames.rotation_angle(_K0_T_K1())


def drawn_points(rng, flat=False, count=None):
    """Four to eight points of a drawing and where they were measured, noise of 0.5 mm; flat: nearly in one plane, and
    measured on its other side, so that a mirror image fits better on every processor, the means subtracted or not."""
    while True:
        n = count or int(rng.integers(4, 9))
        points_F = rng.uniform(-200, 200, (n, 3)) + rng.uniform(-300, 300, 3)
        T_WF = frames.pose(Rotation.from_rotvec(rng.uniform(-2, 2, 3)).as_matrix(), rng.uniform(-900, 900, 3))
        if not flat:
            return points_F, frames.transform(T_WF, points_F) + 0.5 * rng.normal(size=(n, 3))
        points_F[:, 2] = rng.uniform(-100, 100) + rng.permutation(np.resize([0.5, -0.5, 1.0], n))
        points_W = frames.transform(T_WF, points_F * [1, 1, -1] + [0, 0, 2 * points_F[:, 2].mean()])
        points_W += 0.01 * rng.normal(
            size=(n, 3)
        )  # else an affine map of them is a mirror image, with three equal singular values
        if np.linalg.det(points_F.T @ points_W) < -1e9:  # mm^6, of about 1e13
            return points_F, points_W


def _kabsch(handed=True, turned=lambda R: R, shift=lambda R, p, q: q.mean(0) - R @ p.mean(0), centered=True):
    """A variant of `frames.fit_frame` in one of its parts."""

    def variant(p, q):
        about_p, about_q = (p.mean(0), q.mean(0)) if centered else (0, 0)
        U, _, Vt = np.linalg.svd((p - about_p).T @ (q - about_q))
        if callable(handed):
            R = handed(U, Vt.T)
        else:
            R = Vt.T @ np.diag([1, 1, np.linalg.det(Vt.T @ U.T) if handed else 1]) @ U.T
        R = turned(R)
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = R, shift(R, p, q)
        return T

    return variant


def _does_not_lie_best(T_WF, points_F, points_W):
    """Whether a pose puts the points farther from where they were measured than the best one does, in words."""
    gaps = (
        np.sum((frames.transform(T, points_F) - points_W) ** 2) for T in (T_WF, frames.fit_frame(points_F, points_W))
    )
    own, least = gaps
    return (
        "Another pose brings the points nearer to where they were measured: it has a smaller sum of squared distances."
        if own > (1 + 1e-9) * least
        else None
    )


def _rotation_of_the_transpose(U, V):
    """What comes of V where its transpose is taken for it, the sign of its last column included."""
    return V.T @ np.diag([1, 1, np.sign(np.linalg.det(V.T @ U.T))]) @ U.T


def _affine_first(handed):
    """The nearest rotation to the block of the best affine map, which may shear and stretch."""

    def variant(p, q):
        block = np.linalg.lstsq(np.column_stack([p, np.ones(len(p))]), q, rcond=None)[0][:3].T
        U, _, Vt = np.linalg.svd(block)
        R = U @ np.diag([1, 1, np.linalg.det(U @ Vt) if handed else 1]) @ Vt
        return frames.pose(R, q.mean(0) - R @ p.mean(0))

    return variant


def _turned_as_three_points(p, q):
    R = (frames.frame_from_points(*q[:3]) @ frames.invert(frames.frame_from_points(*p[:3])))[:3, :3]
    return frames.pose(R, q.mean(0) - R @ p.mean(0))


def _about_the_first_point(p, q):
    T = _kabsch(centered=False)(p - p[0], q - q[0])
    return frames.pose(T[:3, :3], q[0] - T[:3, :3] @ p[0])


def _one_mean_for_all(p, q):
    U, _, Vt = np.linalg.svd((p - p.mean()).T @ (q - q.mean()))
    R = Vt.T @ np.diag([1, 1, np.sign(np.linalg.det(Vt.T @ U.T))]) @ U.T
    return frames.pose(R, q.mean(0) - R @ p.mean(0))


CHAPTER = Chapter(
    "01-frames",
    title="Frames from three points",
    items=[
        Exercise(
            "normalize",
            reference=frames.unit_vector,
            sizes=("v",),
            draw=tuple(functools.partial(scaled_direction, scale=s) for s in (1.0, 1e-9, 1e3, 1e-4)),
            fixed={"v": POINT},
            metric=metrics.Numbers(1e-9),
            noisy=[
                (lambda rng: (edges_on_axes(rng)[0],), metrics.Numbers(1e-9), ON_AXES),
                (nearly_of_length_1, metrics.Numbers(1e-9), "right, but not for a vector whose length is nearly 1:"),
            ],
            properties=(right_where(frames.unit_vector, metrics.Numbers(1e-9), *special.VECTORS),),
            hints=(
                "A direction says which way, not how far. What has to become 1, and by which number do you divide to get it there?",
                "The length of v is the root of the sum of its squared components.",
                "`return v / np.linalg.norm(v)`",
            ),
            mistakes=[
                Mistake(
                    lambda v: v / ((v @ v) / 2),
                    "You divide by half the sum of squares, not by its root. If you wrote `**1/2`, Python takes the power 1 and halves afterward: write `**0.5` or np.sqrt.",
                    id="normalize-41c4ee",
                ),
                Mistake(
                    lambda v: v / (v @ v) / 2,
                    "You divide by twice the sum of squares, not by its root. If you wrote `**1/2`, Python takes the power 1 and halves afterward: write `**0.5` or np.sqrt.",
                    id="normalize-half-inline",
                ),
                Mistake(
                    lambda v: v / (v @ v),
                    "You divide by the squared length. The length is its root.",
                    id="normalize-28cec7",
                ),
                Mistake(
                    lambda v: v / v.sum(),
                    "You divide by the sum of the components. The length is the root of the sum of their squares.",
                ),
                Mistake(
                    lambda v: v / np.abs(v).sum(),
                    "You divide by the sum of absolute values (the 1-norm). The Euclidean length is the root of the sum of squares.",
                ),
                Mistake(
                    lambda v: v / np.abs(v).max(),
                    "You divide by the largest component, its sign aside: that one becomes 1 or -1. The length should become 1.",
                    id="normalize-a1a562",
                ),
                Mistake(
                    lambda v: v / len(v),
                    "You divide by 3, the number of the components, as `len(v)` counts them. The length you need is `np.linalg.norm(v)`.",
                    id="normalize-2139dc",
                ),
                Mistake(
                    lambda v: v / np.abs(v).mean(),
                    "You divide by a mean. The length is the root of the sum of the squared components.",
                ),
                Mistake(
                    lambda v: v / v.mean(),
                    "You divide by a mean. The length is the root of the sum of the squared components.",
                ),
                Mistake(
                    lambda v: v / np.sqrt((v @ v) / len(v)),
                    "You divide by the root of the *mean* square. The length is the root of the sum of the squares.",
                ),
                Mistake(
                    lambda v: v / np.hypot(v[0], v[1]),
                    "Only x and y are in your length, as np.hypot(v[0], v[1]) takes them; np.linalg.norm(v) takes all three.",
                    id="normalize-bb078a",
                ),
                Mistake(lambda v: v, "You return v as it came. Its length is not 1 yet."),
                Mistake(
                    lambda v: v * np.linalg.norm(v),
                    "You multiply by the length: what was long gets longer. Divide by it.",
                    id="normalize-multiplied",
                ),
                Mistake(
                    lambda v: v / np.sqrt(np.linalg.norm(v)),
                    "You divide by the root of the length. The length itself is the root of the sum of squares: one root is too many.",
                    id="normalize-root-twice",
                ),
            ],
        ),
        Prediction(
            "edges",
            question="The three points carry the same noise. Which measured direction does Gram-Schmidt keep exactly?",
            choices=("origin to x_point", "origin to y_point", "neither, it averages"),
            answer="origin to x_point",
            why="x is the first edge, untouched. Of the second edge only the part across x survives, so y_point decides nothing but the plane.",
        ),
        Exercise(
            "gram_schmidt",
            reference=frames.gram_schmidt,
            sizes=("a", "b"),
            draw=either_angle(two_directions),
            fixed={"a": POINT, "b": POINT},
            metric=metrics.Rotations(1e-7),
            noisy=[
                (edges_on_axes, metrics.Rotations(1e-7), ON_AXES),
                (edges_nearly_on_axes, metrics.Rotations(1e-7), NEARLY_ON_AXES),
                (nearly_at_right_angles, metrics.Rotations(1e-7), f"right, but not for short edges {NEARLY_SQUARE}"),
            ],
            properties=(
                right_where(frames.gram_schmidt, metrics.Rotations(1e-7), *special.EDGES, *special.SHORT_EDGES),
            ),
            hints=(
                "x takes the direction of a. y may only use what b has across x.",
                "Remove from b its part along x: b - (b . x) x, with x of length 1. Then normalize. z follows from the right-hand rule.",
                "`x = normalize(a)\ny = normalize(b - (b @ x) * x)\nz = np.cross(x, y)\nreturn np.column_stack([x, y, z])`",
            ),
            mistakes=[
                Mistake(
                    lambda a, b: frames.gram_schmidt(a, b).T,
                    "Your axes stand in the rows. As columns they turn coordinates in F into coordinates in W; your matrix is the transpose.",
                ),
                Mistake(
                    _not_rejected,
                    "Your x and y are not perpendicular: you normalized b without removing its part along x.",
                ),
                Mistake(
                    _unnormalized,
                    "You removed the part along x, but y has not been normalized afterwards (and z inherits its length).",
                ),
                Mistake(
                    _projected_without_square,
                    "You removed (b . a)/|a| a. The part of b along a is (b . a)/(a . a) a, or (b . x) x: x in both places.",
                    id="gram_schmidt-59572b",
                ),
                Mistake(
                    _split_alike,
                    "This is the rotation nearest to both edges: it turns x and y by half the error each. Gram-Schmidt keeps the "
                    "direction of a, and takes only what b has across it.",
                    id="gram-schmidt-nearest",
                ),
                Mistake(
                    _long_z,
                    "x and y are right, but your z is a cross b, whose length is the area between the edges: take x cross y, or normalize.",
                    id="gram-schmidt-long-z",
                ),
                Mistake(
                    _normalized_too_early,
                    "Your y and z are too short: y is what is left of b without its part along x, over the length of all of b. It is to be divided by its own length (and z inherits that of y).",
                    id="gram-schmidt-early",
                ),
                Mistake(
                    _projected_on_all_of_a,
                    "You removed (b . a) a, with an a that is not of length 1: take x, or divide by a . a.",
                    id="gram-schmidt-whole-a",
                ),
                Mistake(
                    _second_edge_first,
                    "Your y runs along b, and x gives way. The sheet trusts the first edge: x runs along a, and y takes what b has across it.",
                    id="gram_schmidt-ce3914",
                ),
                Mistake(
                    _left_handed,
                    "Your z points the wrong way: x, y, z form a left-handed system. z = x cross y, in this order.",
                ),
                Mistake(
                    _added,
                    "You added the part of b along x. It has to go: b - (b . x) x.",
                ),
                Mistake(
                    lambda a, b: frames.gram_schmidt(a, b) * (1, -1, -1),
                    "Your y points away from b, and z the wrong way with it: y is b minus its part along x, not the other way round; by cross "
                    "products z = a cross b, and y = z cross x.",
                    id="gram_schmidt-58f852",
                ),
                Mistake(
                    lambda a, b: frames.gram_schmidt(a, b) * (-1, -1, 1),
                    "Your x points against a, and y away from b. (QR leaves the signs open: turn each column to the side of its edge.)",
                    id="gram_schmidt-2662c3",
                ),
                Mistake(
                    lambda a, b: np.linalg.qr(np.column_stack([a, b, np.cross(a, b)]))[0],
                    "QR does Gram-Schmidt's work, but leaves the signs open. Give each of the first two columns the sign with which it points to the side of its edge; the third is their cross product.",
                    "gram_schmidt-303399",
                ),
                Mistake(
                    _projection_kept,
                    "You kept the part of b along x and threw the rest away. y is the rest: b minus its projection.",
                ),
                Mistake(
                    lambda a, b: _columns(a, *frames.gram_schmidt(a, b).T[1:]),
                    "Your first column is a with its length. Axes have length 1: put x there.",
                    id="gram-schmidt-long-x",
                ),
                Mistake(
                    _number_subtracted,
                    "You subtracted the number b . x from every component. What b has along x is a vector: (b . x) x.",
                    id="gram-schmidt-number",
                ),
            ],
        ),
        Exercise(
            "frame_from_points",
            reference=frames.frame_from_points,
            sizes=("origin", "x_point", "y_point"),
            draw=either_angle(three_points),
            fixed={"origin": POINT, "x_point": POINT, "y_point": POINT},
            metric=metrics.Poses(1e-6, 1e-6),
            noisy=[
                (points_on_axes, metrics.Poses(1e-6, 1e-6), ON_AXES),
                (points_nearly_on_axes, metrics.Poses(1e-6, 1e-6), NEARLY_ON_AXES),
                (nearly_square_points, metrics.Poses(1e-6, 1e-6), f"right, but not for edges {NEARLY_SQUARE}"),
            ],
            properties=(right_where(frames.frame_from_points, metrics.Poses(1e-6, 1e-6), *special.TRIANGLES),),
            hints=(
                "A pose is a rotation (which way the axes point) and a translation (where the origin is).",
                "The two directions are x_point - origin and y_point - origin; gram_schmidt makes axes of them. Start with np.eye(4), and fill in its block and its last column.",
                "`T = np.eye(4)\nT[:3, :3] = gram_schmidt(x_point - origin, y_point - origin)\nT[:3, 3] = origin\nreturn T`",
            ),
            mistakes=[
                Mistake(
                    _frame(lambda a, b: frames.gram_schmidt(-a, -b)),
                    "Your x and y axes point backward, as edges toward the origin make them: it is x_point - origin, not origin - x_point.",
                    id="frame_from_points-71040f",
                ),
                Mistake(
                    _axes_in_rows,
                    "Your rotation is the transpose: the axes stand in the rows, so it maps W to F, while the origin is that of T_WF.",
                ),
                Mistake(
                    _inverse_frame,
                    "This is T_FW, the inverse: it maps coordinates in W to the frame. T_WF has the origin itself in its last column.",
                ),
                Mistake(
                    _points_as_directions,
                    "You used the points themselves as directions. They are positions in W; a direction is the difference of two points.",
                ),
                Mistake(
                    _no_translation,
                    "The axes are right, but the frame sits at the origin of W: put `origin` into the last column.",
                ),
                Mistake(
                    lambda o, px, py: _with(
                        frames.frame_from_points(o, px, py), t=frames.frame_from_points(o, px, py)[:3, :3] @ o
                    ),
                    "You rotated the origin. It is measured in W already: put it into the last column as it is.",
                ),
                Mistake(
                    _frame(_not_rejected),
                    "Your x and y are not perpendicular: the part of the second edge along x must go first.",
                ),
                Mistake(
                    _frame(_second_edge_first),
                    "You trusted the edge to y_point and bent x. The first edge is the trusted one.",
                ),
                Mistake(_frame(_left_handed), "Your frame is left-handed: z = x cross y, in this order."),
                Mistake(
                    lambda o, px, py: frames.frame_from_points(o, py, px),
                    "x_point and y_point have changed places: your x axis runs toward y_point.",
                ),
                Mistake(
                    lambda o, px, py: frames.frame_from_points(o, px, o + px - py),
                    "Your y points away from y_point, and takes z to the other side with it: the second edge is y_point - origin, and y that edge minus its part along x.",
                    id="frame-edge-between",
                ),
                Mistake(
                    lambda o, px, py: _with(frames.frame_from_points(o, px, py), t=(o + px + py) / 3),
                    "You put the center of the three points into the last column. The frame sits at `origin`.",
                    id="frame-center",
                ),
                Mistake(
                    _origin_in_the_last_row,
                    "The origin stands in the last row. It belongs in the last column, `T[:3, 3]`.",
                    id="frame-last-row",
                ),
            ],
        ),
        Exercise(
            "invert",
            reference=frames.invert,
            sizes=("T",),
            draw=lambda rng: (random_pose(rng),),
            fixed={"T": POSE},
            metric=metrics.Poses(1e-6, 1e-6),
            noisy=[
                (shift_alone, metrics.Poses(1e-6, 1e-6), "right, but not for a pose that shifts without a turn:"),
                (small_motion, metrics.Poses(1e-6, 1e-6), "right, but not for a small turn and a small shift:"),
            ],
            properties=(right_where(frames.invert, metrics.Poses(1e-6, 1e-6), *special.POSES),),
            hints=(
                "Solve p_W = R p_F + t for p_F.",
                "p_F = Rᵀ (p_W - t) = Rᵀ p_W - Rᵀ t: the rotation is Rᵀ, the translation is -Rᵀ t.",
                "`R, t = T[:3, :3], T[:3, 3]\nX = np.eye(4)\nX[:3, :3] = R.T\nX[:3, 3] = -R.T @ t\nreturn X`",
            ),
            mistakes=[
                Mistake(
                    lambda T: T.T,
                    "You transposed the whole 4x4 matrix: the translation slipped into the last row. Only the rotation is transposed.",
                ),
                Mistake(
                    lambda T: _with(T, R=T[:3, :3].T),
                    "You transposed the rotation but left the translation as it was. It becomes -Rᵀ t.",
                ),
                Mistake(
                    lambda T: _with(T, R=T[:3, :3].T, t=-T[:3, 3]),
                    "You negated the translation but did not rotate it: seen from the frame, W lies at -Rᵀ t, not at -t.",
                ),
                Mistake(
                    lambda T: _with(T, R=T[:3, :3].T, t=T[:3, :3].T @ T[:3, 3]),
                    "You rotated the translation but kept its sign: it is -Rᵀ t.",
                ),
                Mistake(
                    lambda T: _with(T, R=T[:3, :3].T, t=-T[:3, :3] @ T[:3, 3]),
                    "Your translation is -R t. On the way back everything turns by Rᵀ: it is -Rᵀ t. If that is what you wrote, has what you call R been "
                    "overwritten by its transpose before? A slice is no copy.",
                    id="invert-2756b6",
                ),
                Mistake(
                    lambda T: _with(T, t=-T[:3, 3]),
                    "You negated the translation, but the rotation has to be undone as well: use Rᵀ, for the translation too, -Rᵀ t.",
                    id="invert-531209",
                ),
                Mistake(
                    lambda T: _with(T, R=T[:3, :3].T, t=np.zeros(3)),
                    "The rotation is undone, the translation is missing: it is -Rᵀ t.",
                ),
                Mistake(lambda T: T, "This is T itself. The inverse maps the other way."),
                Mistake(
                    lambda T: _origin_below(frames.invert(T)),
                    "The translation stands in the last row. It belongs in the last column, `X[:3, 3]`.",
                    id="invert-last-row",
                ),
                *(
                    Mistake(
                        about_z,
                        "Of the rotation you use two entries, as if it turned about z alone. T turns about any axis: take the whole block, Rᵀ.",
                        id=id,
                    )
                    for about_z, id in (
                        (_about_z_alone, "invert-about-z"),
                        (_about_z_by_its_angle, "invert-about-z-by-angle"),
                    )
                ),
                *(
                    Mistake(
                        lambda T, i=i, j=j: _with(T, R := _two_exchanged(T[:3, :3], i, j), -R @ T[:3, 3]),
                        f"You exchanged [{i}, {j}] and [{j}, {i}] alone. The transpose exchanges all three pairs beside the diagonal.",
                        id=f"invert-pair-{i}{j}",
                    )
                    for i, j in ((0, 1), (0, 2), (1, 2))
                ),
            ],
        ),
        Exercise(
            "relative",
            reference=frames.relative,
            sizes=("T_WA", "T_WB"),
            draw=lambda rng: (random_pose(rng), random_pose(rng)),
            fixed={"T_WA": POSE, "T_WB": POSE},
            metric=metrics.Poses(1e-6, 1e-6),
            noisy=[
                (
                    lambda rng: 2 * (random_pose(rng),),
                    metrics.Poses(1e-6, 1e-6),
                    "right, but not where both frames are one:",
                ),
                (side_by_side, metrics.Poses(1e-6, 1e-6), "right, but not where both frames are turned alike:"),
                (nearly_one, metrics.Poses(1e-6, 1e-6), "right, but not where both frames are nearly one:"),
            ],
            properties=(right_where(frames.relative, metrics.Poses(1e-6, 1e-6), *special.FRAMES),),
            hints=(
                "Neighboring letters cancel: which two transforms give T_AB when W stands between them?",
                "T_AB = T_AW T_WB, and T_AW is the inverse of T_WA.",
                "`return invert(T_WA) @ T_WB`",
            ),
            mistakes=[
                Mistake(lambda A, B: frames.invert(A) * B, "You multiplied entry by entry. Matrices multiply with @."),
                Mistake(
                    lambda A, B: A * B,
                    "You multiplied entry by entry (matrices multiply with @), and T_WA is not inverted.",
                ),
                Mistake(
                    lambda A, B: A @ frames.invert(B),
                    "This is T_WA T_BW, which puts an A beside a B: nothing cancels. It is T_AW T_WB.",
                    id="relative-54b9b4",
                ),
                Mistake(
                    lambda A, B: B @ frames.invert(A),
                    "This is T_WB T_AW: the motion that carries A to B, seen from W. Seen from A it is T_AW T_WB.",
                ),
                Mistake(
                    lambda A, B: frames.relative(B, A),
                    "This is T_BA, the inverse, as T_BW T_WA gives it. T_AB is T_AW T_WB: T_WA is the one to be inverted.",
                    id="relative-208794",
                ),
                Mistake(
                    lambda A, B: A @ B, "You multiplied T_WA by T_WB without inverting: in T_WA T_WB nothing cancels."
                ),
                Mistake(
                    lambda A, B: lie.exp_se3(lie.log_se3(B) - lie.log_se3(A)),
                    "This subtracts the logarithms of both poses, which is right of motions that commute alone. Invert T_WA, and multiply.",
                    id="relative-logarithms",
                ),
                Mistake(
                    lambda A, B: frames.invert(A) @ frames.invert(B),
                    "This is T_AW T_BW: both are inverted, and nothing cancels. Only T_WA is turned round.",
                ),
                Mistake(
                    lambda A, B: _with(frames.relative(A, B), t=np.zeros(3)),
                    "The rotation is right, the translation is missing: multiply the whole 4x4 matrices.",
                ),
                Mistake(lambda A, B: A.T @ B, "The transpose of a 4x4 pose is not its inverse: use your `invert`."),
                Mistake(
                    lambda A, B: frames.pose(A[:3, :3].T @ B[:3, :3], B[:3, 3] - A[:3, 3]),
                    "The rotation is right. The vector from A to B is still written in W: turn it into A with R_WAᵀ.",
                ),
                Mistake(
                    _turned_about_z,
                    "The translation is right. The rotation is made of two entries of each pose, as if both frames were turned about z alone: "
                    "take the whole blocks, R_WAᵀ R_WB.",
                    id="relative-about-z",
                ),
                Mistake(
                    lambda A, B: B - A,
                    "You subtracted the matrices. Points are subtracted, poses are multiplied: T_AW T_WB.",
                    id="relative-difference",
                ),
            ],
        ),
        Value(
            "angle_deg",
            reference=lambda: np.rad2deg(frames.rotation_angle(_K0_T_K1())),
            unit="deg",
            rtol=1e-4,
            of={
                "the angle": lambda: frames.rotation_angle(_K0_T_K1()),
                "T_K0K1[:3, 3]": lambda: _K0_T_K1()[:3, 3],
            },
            hints=(
                "The trace of a rotation matrix knows its angle.",
                "trace(R) = 1 + 2 cos(angle).",
                "`angle_deg = np.rad2deg(np.arccos((np.trace(T_K0K1[:3, :3]) - 1) / 2))`",
            ),
            mistakes=[
                Mistake(
                    lambda: 90.0,
                    "90 deg is what the sheet's drawing suggests. The points were moved by 0.01, and the angle shows it: compute it from the matrix.",
                ),
                Mistake(
                    lambda: np.rad2deg(np.arccos(np.clip(np.trace(_K0_T_K1()) / 2 - 0.5, -1, 1))),
                    "This is what comes of the trace of the 4x4 matrix, whose corner is no part of the rotation, or without the - 1: the cosine is "
                    "(trace(R) - 1) / 2, of the 3x3 block.",
                    id="angle_deg-9b97c7",
                ),
                Mistake(
                    lambda: np.rad2deg(np.arccos(np.trace(_K0_T_K1()[:3, :3]) - 1)),
                    "The half is missing: trace(R) = 1 + 2 cos(angle).",
                ),
                *(
                    Mistake(
                        lambda cosine=cosine: 2 * np.rad2deg(np.arccos(cosine(np.trace(_K0_T_K1())))),
                        "Twice an arccosine is the angle of a quaternion, of which w = cos(angle / 2) = sqrt(1 + trace(R)) / 2, with the trace of "
                        "the 3x3 block. Yours has another trace, or no root.",
                        id=f"angle-quaternion-{name}",
                    )
                    for name, cosine in (
                        ("no-root", lambda trace: (trace - 1) / 4),
                        ("no-root-4x4", lambda trace: trace / 4),
                    )
                ),
                Mistake(
                    lambda: np.rad2deg(np.arccos(np.trace(_K0_T_K1()[:3, :3]) / 3)),
                    "This takes a third of the trace for the cosine. trace(R) = 1 + 2 cos(angle): take 1 off, then half of it.",
                    id="angle-third-of-trace",
                ),
                Mistake(
                    lambda: 90 - np.rad2deg(frames.rotation_angle(_K0_T_K1())),
                    "This is what is missing to 90 deg. By what angle is K1 turned?",
                    id="angle-complement",
                ),
                Mistake(
                    lambda: 180 - np.rad2deg(frames.rotation_angle(_K0_T_K1())),
                    "This is 180 deg less the angle, or as good as that: a sign, or a direction, is turned around.",
                    id="angle-turned-around",
                    within=1e-3,
                ),
                Mistake(
                    lambda: np.deg2rad(frames.rotation_angle(_K0_T_K1())),
                    "This is the angle in radians, converted to radians once more: np.rad2deg makes degrees.",
                    id="angle-deg2rad",
                ),
                Mistake(
                    lambda: _K0_T_K1()[0, 0],
                    "This is the cosine of the angle. Its arccosine, in degrees, is asked for.",
                    id="angle-cosine",
                ),
                Mistake(
                    lambda: np.rad2deg(np.arctan(_K0_T_K1()[0, 0])),
                    "The first entry of the matrix is the cosine of the angle, and this is its arctangent. np.arctan2 takes sine and cosine.",
                    id="angle-arctangent",
                ),
                Mistake(
                    lambda: np.rad2deg(np.arctan(_K0_T_K1()[1, 0])),
                    "This is 45 deg, or nearly, as is the arctangent of the sine that stands below the first entry of the matrix. np.arctan2 takes sine and cosine.",
                    id="angle-arctangent-of-sine",
                ),
                Mistake(
                    lambda: np.rad2deg(np.arctan2(_K0_T_K1()[1, 3], _K0_T_K1()[0, 3])),
                    "This is the direction in which the origin of K1 lies. How K1 is turned stands in the 3x3 block.",
                    id="angle-of-translation",
                ),
                *(
                    Mistake(
                        lambda off=off: 90 + off,
                        "The 0.01 by which the points were moved are millimeters, not degrees. What they do to the angle, the matrix tells.",
                        id=f"angle-moved-by-{off}",
                    )
                    for off in (0.01, -0.01)
                ),
            ],
        ),
        Value(
            "distance",
            reference=lambda: np.linalg.norm(_hole() - _hole_as_drawn()),
            unit="mm",
            rtol=1e-4,
            of={
                "the hole in K0": _hole,
                "the drawing's hole in K0": _hole_as_drawn,
                "the way between both": lambda: _hole() - _hole_as_drawn(),
                "T_K0K1[:3, 3]": lambda: _K0_T_K1()[:3, 3],
            },
            hints=(
                "Half a degree at the origin is more, the farther away one looks: take the hole to K0 by both frames.",
                "T_K0K1 and `drawn` both map coordinates in K1 to K0. Map (200, 0, 0) with each, and take the length of the difference.",
                "`hole = np.array([200.0, 0, 0, 1])\ndistance = np.linalg.norm((T_K0K1 @ hole - drawn @ hole)[:3])`",
            ),
            mistakes=[
                Mistake(
                    lambda: np.linalg.norm(_K0_T_K1()[:3, 3]),
                    "This is the distance of the two origins: where K1 lies, not where the hole lands.",
                    id="distance-origins",
                ),
                Mistake(
                    lambda: HOLE * np.rad2deg(_missing()),
                    "The lever is multiplied by an angle in degrees here: arcs take radians.",
                    id="distance-degrees",
                ),
                *(
                    Mistake(
                        lambda part=part: HOLE * abs(part * np.sin(np.rad2deg(_missing()) / part)),
                        "The angle that is missing is in degrees here, and its sine is taken as if it were in radians: np.deg2rad comes first.",
                        id=f"distance-sine-of-degrees-{part}",
                    )
                    for part in (1, 2)
                ),
                Mistake(
                    lambda: np.linalg.norm(_hole() - _hole_as_drawn()) ** 2,
                    "This is the squared distance.",
                    id="distance-squared",
                ),
                Mistake(
                    lambda: abs(np.linalg.norm(_hole()) - np.linalg.norm(_hole_as_drawn())),
                    "This is the difference of two lengths. Two places equally far from the origin may lie far apart: subtract them first, "
                    "then take the length.",
                    id="distance-of-lengths",
                ),
                Mistake(
                    lambda: np.abs(_hole() - _hole_as_drawn()).max(),
                    "This is how far the hole lands off in x, 200 mm times the first entry of the matrix. It lies off in y too, by "
                    "very little: the distance is the root of the sum of squares.",
                    id="distance-along-x",
                ),
                Mistake(
                    lambda: np.abs(_hole() - _hole_as_drawn()).sum(),
                    "The components are added. The distance is the root of the sum of squares.",
                    id="distance-sum",
                ),
                Mistake(
                    lambda: np.sqrt(2) * np.linalg.norm(_hole() - _hole_as_drawn()),
                    "This is the distance times the root of 2. So is 200 mm times the norm of the difference of both matrices, in "
                    "which x and y both count. The hole lies on x alone.",
                    id="distance-of-matrices",
                ),
                Mistake(
                    lambda: np.linalg.norm(_hole()),
                    "This is how far the hole is from the origin of K0. How far is it from its place in the drawing?",
                    id="distance-from-K0",
                ),
                Mistake(
                    lambda: HOLE,
                    "This is how far the hole is from the origin of K1. How far is it from its place in the drawing?",
                    id="distance-from-K1",
                ),
                Mistake(
                    lambda: np.linalg.norm(_hole_as_drawn()),
                    "This is how far the drawing's hole is from the origin of K0. How far apart are both holes?",
                    id="distance-drawn-from-K0",
                ),
                Mistake(
                    lambda: np.linalg.norm(_hole() - [HOLE, 0, 0]),
                    "This compares the hole with (200, 0, 0) in K0. Its place in the drawing is where `drawn` takes it.",
                    id="distance-unmapped",
                ),
                Mistake(
                    lambda: HOLE * frames.rotation_angle(_K0_T_K1()),
                    "This takes the whole turn of K1. The drawing wants 90 deg of it: only the difference moves the hole away.",
                    id="distance-whole-turn",
                ),
                Mistake(
                    lambda: HOLE * np.sin(frames.rotation_angle(_K0_T_K1())),
                    "This is 200 mm times the sine of the whole turn of K1. The drawing wants 90 deg of it: only what is missing moves the hole away.",
                    id="distance-sine-of-turn",
                ),
                Mistake(
                    lambda: 2 * HOLE * np.sin(frames.rotation_angle(_K0_T_K1()) / 2),
                    "This is the chord of the whole turn of K1. The drawing wants 90 deg of it: only what is missing moves the hole away.",
                    id="distance-chord-of-turn",
                ),
                Mistake(
                    lambda: 0.01,
                    "0.01 is by how much the points were moved, and nearly the angle that is missing to 90 deg, in rad. How much is it 200 mm away?",
                    id="distance-moved",
                ),
                Mistake(
                    _missing,
                    "This is the angle that is missing to 90 deg, in rad. How much is it 200 mm away?",
                    id="distance-angle",
                ),
                Mistake(
                    lambda: np.rad2deg(_missing()),
                    "This is the angle that is missing to 90 deg. How much is it 200 mm away, in mm?",
                    id="distance-angle-deg",
                ),
                Mistake(
                    lambda: np.linalg.norm(_K0_T_K1() - _drawn()),
                    "This is the norm of the difference of two matrices. Let both act on the hole, and take the length of what differs.",
                    id="distance-matrices",
                ),
                Mistake(
                    lambda: np.linalg.norm(
                        frames.transform(frames.invert(_K0_T_K1()), np.array([HOLE, 0, 0]))
                        - frames.transform(frames.invert(_drawn()), np.array([HOLE, 0, 0]))
                    ),
                    "Both poses are inverted here: that takes (200, 0, 0) from K0 to K1. The hole is given in K1 and wanted in K0.",
                    id="distance-inverted",
                ),
                Mistake(
                    lambda: np.linalg.norm(_hole() - _drawn()[:3, :3] @ [HOLE, 0, 0]),
                    "In the drawing K1 has its origin too: `drawn` maps the hole with its translation.",
                    id="distance-drawn-at-K0",
                ),
            ],
        ),
        Prediction(
            "flat",
            question="The triangle is 100 mm long and 10 mm high, y_point above the middle of the base; the noise is 0.05 mm. What helps the rotation about x most?",
            choices=("a base twice as long", "a height twice as large", "both help alike"),
            answer="a height twice as large",
            why="About x, the frame turns by noise over height. A base twice as long, y_point above its middle as before, leaves that as it is: "
            "it helps the two other angles.",
        ),
        Exercise(
            "matrix_from_kuka",
            reference=frames.matrix_from_kuka,
            draw=tuple(
                functools.partial(kuka_pose, A_deg=QUADRANTS[k], B_deg=QUADRANTS[k - 1], C_deg=QUADRANTS[k - 2])
                for k in range(4)
            ),
            fixed={"xyzabc": "a pose has six numbers"},
            metric=metrics.Poses(1e-6, 1e-6),
            noisy=[
                (hardly_turned, metrics.Poses(1e-6, 1e-6), "right, but not for small angles:"),
                (
                    functools.partial(kuka_pose, **ROUND),
                    metrics.Poses(1e-6, 1e-6),
                    "right, but not for angles beyond 180 deg:",
                ),
            ],
            properties=(right_where(frames.matrix_from_kuka, metrics.Poses(1e-6, 1e-6), *special.ANGLES),),
            hints=(
                "Three elementary turns, multiplied in the order the controller names them, and a translation.",
                "R = Rz(A) Ry(B) Rx(C). Write each turn as a 3x3 array, with the cosines and sines of A, B, C (radians, in this order), multiply "
                "them with @, and fill the 4x4 identity with R and x, y, z.",
                "`(cA, cB, cC), (sA, sB, sC) = np.cos(xyzabc[3:]), np.sin(xyzabc[3:])\nRz = np.array([[cA, -sA, 0], [sA, cA, 0], [0, 0, 1]])\n"
                "Ry = np.array([[cB, 0, sB], [0, 1, 0], [-sB, 0, cB]])\nRx = np.array([[1, 0, 0], [0, cC, -sC], [0, sC, cC]])\n"
                "T = np.eye(4)\nT[:3, :3] = Rz @ Ry @ Rx\nT[:3, 3] = xyzabc[:3]\nreturn T`",
            ),
            mistakes=[
                Mistake(
                    _ry_reversed,
                    "Your Ry turns the wrong way: in Ry, + sin B stands top right and - sin B bottom left.",
                ),
                Mistake(_kuka_entry_by_entry, "You multiplied entry by entry. Matrices multiply with @."),
                Mistake(
                    _kuka("xyz", (5, 4, 3)),
                    'This is Rx(C) Ry(B) Rz(A). KUKA turns about z first, then about the new y and the new x: Rz(A) Ry(B) Rx(C). (SciPy means that by capital letters, "ZYX".)',
                ),
                Mistake(
                    _kuka("zyx", (5, 4, 3)),
                    'A and C have changed places: A belongs to z, B to y, C to x. (SciPy means that by from_euler("ZYX", [A, B, C]).)',
                ),
                Mistake(
                    _kuka("xyz"),
                    "You read A, B, C as turns about x, y, z. At KUKA, A turns about z, B about y, C about x.",
                ),
                Mistake(_kuka("zyz"), "You turned about z, y, z. KUKA's third turn is about x: Rz(A) Ry(B) Rx(C)."),
                Mistake(
                    lambda p: frames.matrix_from_kuka(p * np.array([1, 1, 1, -1, 1, 1])),
                    "Your Rz turns the wrong way: in Rz, - sin A stands above the diagonal and + sin A below.",
                    id="matrix_from_kuka-a1c0ae",
                ),
                Mistake(
                    lambda p: frames.matrix_from_kuka(p * np.array([1, 1, 1, 1, 1, -1])),
                    "Your Rx turns the wrong way: in Rx, - sin C stands above the diagonal and + sin C below.",
                ),
                Mistake(
                    _kuka_in_degrees,
                    "The angles already are radians: here they are taken for degrees, by a conversion too many or by SciPy's `degrees=True`.",
                    id="matrix_from_kuka-df5e01",
                ),
                Mistake(
                    _kuka_transposed,
                    "Your rotation is the transpose of the right one, as if every turn went the other way, in reverse order.",
                ),
                Mistake(
                    lambda p: _with(frames.matrix_from_kuka(p), t=np.zeros(3)),
                    "The rotation is right; x, y, z are missing from the last column.",
                ),
                Mistake(
                    lambda p: _with(frames.matrix_from_kuka(p), t=frames.matrix_from_kuka(p)[:3, :3] @ p[:3]),
                    "You rotated the position as well. x, y, z are already written in the base frame.",
                ),
                Mistake(
                    lambda p: frames.pose(Rotation.from_rotvec(p[3:]).as_matrix(), p[:3]),
                    "A, B, C are taken for a rotation vector, a single turn. They are three turns, one after the other.",
                    id="kuka-rotvec",
                ),
                Mistake(
                    lambda p: frames.matrix_from_kuka(np.roll(p, 3)),
                    "This takes the first three numbers for angles and the last three for the position. x, y, z come first.",
                    id="kuka-angles-first",
                ),
                *(
                    Mistake(
                        _turned_back(*wrong),
                        f"Your {words} turn the wrong way: the minus before the sine stands above the diagonal in Rz "
                        "and Rx, and bottom left in Ry.",
                        id=f"kuka-turned-back-{''.join(wrong)}",
                    )
                    for wrong, words in (
                        ("zyx", "Rz, Ry and Rx"),
                        ("zy", "Rz and Ry"),
                        ("zx", "Rz and Rx"),
                        ("yx", "Ry and Rx"),
                    )
                ),
                *(
                    Mistake(
                        _never_negative(3 + k, sine),
                        f"Your {word} of {angle} is never negative, as a root of 1 less a square is: take np.{word[:3]} of the angle as it comes.",
                        id=f"kuka-positive-{word}-{angle}",
                    )
                    for k, angle in enumerate("ABC")
                    for word, sine in (("sine", True), ("cosine", False))
                ),
                *(
                    Mistake(
                        _kuka(order, (5, 5, 5)),
                        "All three turns take C. If you made functions in a loop: they look up its variables when they are called, and "
                        "find the last ones. Compute each matrix within the loop.",
                        id=f"kuka-all-C-{order}",
                    )
                    for order in ("xxx", "zyx")
                ),
            ],
        ),
        Prediction(
            "pole",
            question="At B = 90 deg you raise A by 30 deg and C by 30 deg. How does the flange move?",
            choices=("it does not move", "it turns by 30 deg", "it turns by 60 deg"),
            answer="it does not move",
            why="At the pole the axes of A and C coincide in opposite sense: only A - C counts, and it has not changed.",
        ),
        Exercise(
            "kuka_from_matrix",
            reference=frames.kuka_from_matrix,
            sizes=("T",),
            draw=tuple(
                lambda rng, ranges=ranges: (frames.matrix_from_kuka(kuka_pose(rng, *ranges)[0]),)
                for ranges in zip(A_RANGES, B_RANGES, C_RANGES)
            ),
            fixed={"T": POSE},
            metric=_read_by_kuka(1e-6),
            noisy=[
                (
                    lambda rng, B_deg=B_deg: (frames.matrix_from_kuka(kuka_pose(rng, B_deg=B_deg)[0]),),
                    _read_by_kuka(1e-6),
                    f"right away from the poles, but not {words} beside one, where A and C still are two angles:",
                )
                for B_deg, words in zip(NEAR_THE_POLE, ("a degree or two", "a hundredth of a degree"))
            ]
            + [
                (at_the_pole(sign), _read_by_kuka(1e-4), words)
                for sign, words in (
                    (1, "right away from the pole, but not at B = 90 deg:"),
                    (-1, "right away from the pole, but not at B = -90 deg:"),
                )
            ]
            + [(small_motion, _read_by_kuka(1e-6), "right, but not where all angles are small:")]
            + [(beside_the_axes, _read_by_kuka(1e-6), "right, but not where A and C are 90 or -90 deg:")]
            + [
                (functools.partial(half_turns, signs=signs), _read_by_kuka(1e-6), f"right, but not where {words}:")
                for signs, words in (((-1, -1, 1), "A is 180 deg"), ((1, -1, -1), "C is 180 deg"))
            ],
            properties=(
                right_where(frames.kuka_from_matrix, _read_by_kuka(1e-6), *special.READINGS),
                right_where(frames.kuka_from_matrix, _read_by_kuka(1e-4), *A_HAIR_BELOW_1),
            ),
            hints=(
                "Compare the entries of Rz(A) Ry(B) Rx(C) that hold few terms: the first column gives A and B. Then undo A: "
                "Rz(A)ᵀ R = Ry(B) Rx(C), whose middle row is 0, cos C, -sin C.",
                "A by `np.arctan2` of r10 and r00. B by `np.arctan2` of -r20 and the root of r00² + r10², which rounding cannot break, as it "
                "does an arcsine. The middle row of Rz(A)ᵀ R is -sin A times the first row of R plus cos A times the second: read C from it.",
                "`R = T[:3, :3]\nA = np.arctan2(R[1, 0], R[0, 0])\nB = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))\n"
                "row = np.cos(A) * R[1] - np.sin(A) * R[0]\nreturn np.array([*T[:3, 3], A, B, np.arctan2(-row[2], row[1])])`",
            ),
            mistakes=[
                Mistake(
                    _angles_one_by_one,
                    "Right except at the pole: there r10, r00, r21, r22 are rounding noise, and A and C, read one by one, do not fit "
                    "each other. Take A first, undo it, and read C from the middle row of what is left.",
                    id="kuka_from_matrix-760252",
                ),
                Mistake(
                    _arcsine_of_too_much,
                    "Right except at the pole: there rounding can push r20 a hair beyond 1, and its arcsine is NaN. Cut it with "
                    "`np.clip(..., -1, 1)`, or take arctan2 of -r20 and the root of r00² + r10².",
                    id="kuka-arcsine",
                ),
                *(
                    Mistake(
                        _pole_from(limit_deg),
                        "Right except near the pole: A may be chosen freely at B = +-90 deg alone. Even a hundredth of a degree beside it "
                        "A and C are two angles, and np.arctan2 still reads both.",
                        id=f"kuka-pole-from-{limit_deg:g}",
                    )
                    for limit_deg in (85, 89.5, 89.96)
                ),
                *(
                    Mistake(
                        _at_both_poles(lambda R, s=sign: np.arctan2(s * R[0, 1], R[1, 1])),
                        f"At B = {-90 * sign} deg your A {'+' if sign > 0 else '-'} C has the wrong sign: r01 is sin(C - A) at B = 90 deg and "
                        "-sin(A + C) at -90 deg.",
                        id=f"kuka-as-at-{90 * sign:g}",
                    )
                    for sign in (1, -1)
                ),
                *(
                    Mistake(
                        _at_both_poles(lambda R, s=sign: np.arctan2(s * R[0, 1], s * R[0, 2])),
                        f"At B = {-90 * sign} deg your A {'+' if sign > 0 else '-'} C is half a turn off: r01 and r02 are sin(C - A) "
                        "and cos(C - A) at B = 90 deg, -sin(A + C) and -cos(A + C) at -90 deg.",
                        id=f"kuka-half-turn-at-{-90 * sign:g}",
                    )
                    for sign in (1, -1)
                ),
                Mistake(
                    _undone(lambda R: np.arctan(R[1, 0] / R[0, 0]), _B_along),
                    "The pose is right, but where r00 is negative B leaves the range from -90 to 90 deg, and A is half a turn away. That comes of the quotient r10/r00, or where A is kept within 90 deg: A is np.arctan2(r10, r00) as it is, and B has a cosine above 0.",
                    id="kuka-quotient-undone",
                ),
                Mistake(
                    _undone(lambda R: np.arctan(R[1, 0] / R[0, 0])),
                    "A quotient loses the quadrant: A = np.arctan2(r10, r00).",
                    id="kuka-quotient-A",
                ),
                *(
                    Mistake(
                        _undone(
                            lambda R, k=k, inverse=inverse: inverse(
                                np.clip(R[k, 0] / np.hypot(R[0, 0], R[1, 0]), -1, 1)
                            )
                        ),
                        f"Your A {bound}, as an {name} is: take np.arctan2(r10, r00), which knows the quadrant. All that follows from A is wrong with it.",
                        id=f"kuka-{name}-A",
                    )
                    for k, inverse, name, bound in (
                        (0, np.arccos, "arccosine", "is never negative"),
                        (1, np.arcsin, "arcsine", "is never beyond 90 deg"),
                    )
                ),
                Mistake(
                    _undone(lambda R: _right_A(R) + np.pi, _B_along),
                    "The pose is right, but A is half a turn away, so that B leaves the range from -90 to 90 deg.",
                    id="kuka-half-turn",
                ),
                Mistake(
                    _undone(lambda R: np.arctan2(R[0, 0], R[1, 0])),
                    "np.arctan2 takes y first, then x: A = np.arctan2(r10, r00). All that follows from A is wrong with it.",
                    id="kuka-swapped-A",
                ),
                Mistake(
                    _undone(_right_A, turn=lambda a: _turn("z", a)),
                    "A and B are right. To undo A, multiply by Rz(A)ᵀ from the left: Rz(A) itself turns by A once more.",
                    id="kuka-not-undone",
                ),
                Mistake(
                    _angles(lambda abc: abc * (1, 1, -1)),
                    "C has the wrong sign: after A is undone the middle row is 0, cos C, -sin C.",
                    id="kuka-sign-C",
                ),
                Mistake(
                    _angles_by_quotients,
                    "A and C come out as by quotients, which lose the quadrant: np.arctan2 takes numerator and denominator and keeps it.",
                    id="kuka_from_matrix-c5e676",
                ),
                Mistake(
                    _angles(np.rad2deg),
                    "Your angles are in degrees. Inside the workbook angles are radians; degrees are for people.",
                ),
                Mistake(
                    _angles(lambda abc: abc[::-1]),
                    'Your angles come in the order C, B, A. (SciPy gives A, B, C by as_euler("ZYX"), and C, B, A by "xyz".)',
                ),
                Mistake(
                    lambda T: np.roll(frames.kuka_from_matrix(T), 3),
                    "The position comes first, then the angles: x, y, z, A, B, C.",
                ),
                Mistake(
                    _angles(lambda abc: np.array([np.pi / 2 - abc[0], abc[1], np.pi / 2 - abc[2]])),
                    "np.arctan2 takes y first, then x: the sine before the cosine.",
                ),
                Mistake(
                    lambda T: np.array([*T[:3, 3], *Rotation.from_matrix(T[:3, :3]).as_euler("XYZ")]),
                    'These are turns about x, then the new y, then the new z. KUKA turns about z first, then about the new y and the new x: in SciPy "ZYX", in capitals.',
                    id="kuka_from_matrix-b29330",
                ),
                Mistake(
                    lambda T: np.array([*T[:3, 3], *Rotation.from_matrix(T[:3, :3]).as_euler("XYZ")[::-1]]),
                    'These are turns about x, then the new y, then the new z. KUKA turns about z first, then about the new y and the new x: in SciPy "ZYX", in capitals.',
                    id="kuka_from_matrix-b29330-2",
                ),
                Mistake(
                    lambda T: np.array([*T[:3, 3], *Rotation.from_matrix(T[:3, :3]).as_rotvec()]),
                    "These are the entries of the rotation vector, of one turn about one axis. A, B, C are three turns, about z, then y, then x.",
                    id="kuka-read-rotvec",
                ),
                Mistake(_angles(lambda abc: abc * (1, -1, 1)), "B has the wrong sign: the entry r20 is -sin B."),
                Mistake(
                    lambda T: frames.kuka_from_matrix(_with(T, R=T[:3, :3].T)),
                    "You read the angles from the transposed rotation: rows and columns have changed places.",
                    id="kuka-transposed",
                ),
                Mistake(
                    lambda T: frames.kuka_from_matrix(frames.invert(T)),
                    "This is the pose of the inverse: F seen from W has become W seen from F.",
                ),
                Mistake(
                    _angles(lambda abc: np.array([np.pi / 2 - abc[0], abc[1], abc[2]])),
                    "B and C are right. np.arctan2 takes y first, then x: A = np.arctan2(r10, r00).",
                    id="kuka-swapped-A-alone",
                ),
                Mistake(
                    _angles(lambda abc: np.array([abc[0], abc[1], np.pi / 2 - abc[2]])),
                    "A and B are right. np.arctan2 takes y first, then x: the sine of C before its cosine.",
                    id="kuka-swapped-C-alone",
                ),
                *(
                    Mistake(
                        _angles(lambda abc, lossy=lossy: np.array([lossy(abc[0]), abc[1], lossy(abc[2])])),
                        f"B is right. Your A and C {bound}, as {name}s are: take np.arctan2, which knows the quadrant.",
                        id=f"kuka-{name}-A-C",
                    )
                    for lossy, name, bound in (
                        (np.abs, "arccosine", "are never negative"),
                        (lambda angle: np.arcsin(np.sin(angle)), "arcsine", "are never beyond 90 deg"),
                    )
                ),
                Mistake(
                    _angles(lambda abc: np.array([abc[0], abc[1], np.arcsin(np.sin(abc[2]))])),
                    "A and B are right. Your C is never beyond 90 deg, as an arcsine is: take np.arctan2, which knows the quadrant.",
                    id="kuka-arcsine-C",
                ),
                Mistake(
                    _angles(lambda abc: np.array([abc[0], abc[1], np.arctan(np.tan(abc[2]))])),
                    "A and B are right. Your C is that of a quotient, which loses the quadrant: C = np.arctan2(r21, r22) away from the pole.",
                    id="kuka-quotient-C",
                ),
            ],
        ),
        Prediction(
            "svd",
            question="The SVD weighs all three points alike. About which axes is its frame better than Gram-Schmidt's?",
            choices=("about all three", "only about x", "only about z"),
            answer="only about z",
            why="Three points lie in one plane whatever method you take, so the turns about x and y agree. Within the plane, "
            "Gram-Schmidt listens to the first edge alone; the SVD hears the third point too.",
        ),
        Exercise(
            "fit_frame",
            reference=frames.fit_frame,
            draw=(drawn_points, functools.partial(drawn_points, flat=True)),
            metric=metrics.Poses(1e-6, 1e-6),
            properties=(
                # a minimizer stops where the sum of squares changes by 1e-8 of itself: the larger that, the farther away
                right_where(frames.fit_frame, metrics.Poses(1e-5, 1e-5), *special.SETS),
                right_where(frames.fit_frame, metrics.Poses(1e-3, 1e-2), *special.BADLY_MEASURED),
            ),
            about=_does_not_lie_best,
            noisy=(
                functools.partial(drawn_points, count=3),
                metrics.Poses(1e-5, 1e-5),
                "right, but not for three points, which lie in one plane wherever they are:",
            ),
            hints=(
                "First the turn, about the two centers of gravity; then the shift that puts one onto the other.",
                "With p and q measured from their means, the SVD of p^T q = U S V^T gives R = V U^T; where det R = -1, "
                "the last column of V changes its sign first. Then t = mean of W minus R times mean of F.",
                "`p, q = points_F - points_F.mean(0), points_W - points_W.mean(0)\n"
                "U, _, Vt = np.linalg.svd(p.T @ q)\n"
                "R = Vt.T @ np.diag([1, 1, np.linalg.det(Vt.T @ U.T)]) @ U.T\n"
                "T = np.eye(4)\n"
                "T[:3, :3], T[:3, 3] = R, points_W.mean(0) - R @ points_F.mean(0)\n"
                "return T`",
            ),
            mistakes=[
                Mistake(
                    _kabsch(handed=False),
                    "On points in one plane this can be a mirror image (det R = -1): then the last column of V changes its sign.",
                ),
                Mistake(
                    _kabsch(handed=lambda U, V: V @ np.diag([np.linalg.det(V @ U.T), 1, 1]) @ U.T),
                    "The sign belongs to the last column, that of the smallest singular value: there it costs least.",
                ),
                Mistake(
                    _kabsch(handed=lambda U, V: V @ np.diag([1, np.linalg.det(V @ U.T), 1]) @ U.T),
                    "The sign belongs to the last column, that of the smallest singular value: there it costs least.",
                ),
                Mistake(
                    _kabsch(handed=lambda U, V: V @ np.diag([1, 1, -1]) @ U.T),
                    "The last column of V changes its sign everywhere. It must where V Uᵀ is a mirror image (det = -1), and nowhere else.",
                    id="fit-frame-sign-everywhere",
                ),
                Mistake(
                    _kabsch(handed=lambda U, V: np.diag([1, 1, np.linalg.det(V @ U.T)]) @ V @ U.T),
                    "You changed the sign of the last row of V Uᵀ. Where it is a mirror image, the last column of V changes its sign, before Uᵀ is multiplied.",
                    id="fit_frame-last-row",
                ),
                Mistake(
                    _kabsch(handed=lambda U, V: V @ U.T @ np.diag([1, 1, np.linalg.det(V @ U.T)])),
                    "Where V Uᵀ is a mirror image, this is V Uᵀ with its own last column turned around. It is the last column of V that "
                    "changes its sign, before Uᵀ is multiplied.",
                    id="fit_frame-last-column",
                ),
                Mistake(
                    _kabsch(handed=lambda U, V: V @ U.T * np.sign(np.linalg.det(V @ U.T))),
                    "The sign belongs to the last column alone: minus a mirror image is another rotation.",
                ),
                Mistake(
                    lambda p, q: frames.invert(frames.fit_frame(p, q)),
                    "This is T_FW, from W to F: exchange the roles of both sets of points.",
                ),
                Mistake(
                    _kabsch(turned=lambda R: R.T),
                    "Your rotation is the transpose: from p^T q = U S V^T follows R = V U^T.",
                ),
                Mistake(
                    _kabsch(centered=False),
                    "Subtract the means before the SVD: a rotation leaves a point where it is, and that point must be the center.",
                ),
                Mistake(
                    _kabsch(shift=lambda R, p, q: q.mean(0) - p.mean(0)),
                    "The rotation is right. The mean of F has to be turned before it is subtracted: t = mean W - R mean F.",
                ),
                Mistake(
                    _kabsch(shift=lambda R, p, q: q.mean(0)),
                    "The rotation is right. The translation is where the frame's origin lies, not the center of the points.",
                ),
                Mistake(
                    _kabsch(shift=lambda R, p, q: np.zeros(3)), "The rotation is right, the translation is missing."
                ),
                Mistake(
                    _kabsch(shift=lambda R, p, q: q[0] - R @ p[0]),
                    "The rotation is right. You put the first point exactly: the means are to fall together.",
                ),
                Mistake(
                    _turned_as_three_points,
                    "Your rotation is that of a frame through the first three points of each set. All points count, and all alike.",
                    id="fit-frame-turned-as-three",
                ),
                Mistake(
                    _about_the_first_point,
                    "You measured the points from the first one, which is put exactly and weighs more than all others. Measure both sets from their means.",
                    id="fit-frame-about-the-first",
                ),
                Mistake(
                    lambda p, q: frames.fit_frame(p[:3], q[:3]),
                    "You use the first three points only. All of them count.",
                ),
                Mistake(
                    _kabsch(handed=False, centered=False),
                    "Subtract the means before the SVD: a rotation leaves a point where it is, and that point must be the center. (And "
                    "where det R = -1 the last column of V changes its sign.)",
                    id="fit-frame-not-centered-mirror",
                ),
                Mistake(
                    _kabsch(handed=_rotation_of_the_transpose),
                    "`np.linalg.svd` returns V already transposed: U, S, Vt. R = V U^T is `Vt.T @ U.T`.",
                    id="fit-frame-V-as-returned",
                ),
                Mistake(
                    _one_mean_for_all,
                    "You took one mean over all numbers. Each coordinate has its own: `mean(axis=0)`.",
                    id="fit-frame-mean-of-all",
                ),
                Mistake(
                    lambda p, q: frames.frame_from_points(*q[:3]) @ frames.invert(frames.frame_from_points(*p[:3])),
                    "You laid a frame through the first three points of each set. All points count, and all alike.",
                    id="fit-frame-three-points",
                ),
                *(
                    Mistake(
                        _affine_first(handed),
                        "You fitted an arbitrary linear map, and made a rotation of it afterwards. The rotation nearest to that map is not the one "
                        "that lies best to the points: take the SVD of p^T q.",
                        id=f"fit-frame-affine-{handed}",
                    )
                    for handed in (True, False)
                ),
            ],
        ),
    ],
    further=(
        "svd",
        "fit_frame",
    ),
)
