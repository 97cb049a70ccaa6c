"""Chapter 6: packets of a tracker, a robot's kinematics, A X = X B by the report's method, outliers, time offset."""

import functools

import numpy as np
from scipy.spatial.transform import Rotation

from ...calibration import ax_xb
from ...documents.report.printed import table_d
from ...documents.report.reconstruction import stop_poses, synthetic_log, synthetic_mountings
from ...exercises import metrics
from ...exercises.draws import scaled
from ...exercises.engine import Chapter, Exercise, Prediction
from ...exercises.outcome import Mistake
from ...exercises.special import default_is
from ...exercises.value import Value
from ...geometry import lie
from ...geometry.frames import invert, pose, relative, unit_vector
from ...geometry.lie import exp_so3, log_so3
from ...machines import packet, simulation
from ...machines.arm import TX40, dh_matrix, forward_kinematics
from ...machines.log import average_stops
from ...machines.mounting import calibrate_mounting, e_rot, e_trans
from ...machines.packet import POSITION, QUATERNION, TIME, encode_packet, packet_from_pose
from ...machines.tracking import time_offset
from . import beyond

# Packets ---------------------------------------------------------------------------------------------------------------------


def decode_packet(data):
    """Time (s), position (mm) and quaternion (x, y, z, w) of a packet of 184 bytes."""
    values = packet.decode_packet(data)
    return values[TIME], 1000 * values[POSITION], values[QUATERNION]


DECODED = metrics.Several(
    metrics.Numbers(1e-9, "s"),
    metrics.Numbers(1e-9, "mm"),
    metrics.Numbers(1e-9),
    names=("time", "position", "quaternion"),
)


def _packet(rng, sign, times=1.0, way=None):
    """A good packet with all fields different, its quaternion of either sign; times: how much later; way: how far off, mm."""
    place = rng.uniform(-900, 900, 3)
    T = pose(exp_so3(rng.normal(size=3)), place if way is None else way * place / np.linalg.norm(place))
    values = packet_from_pose(
        T, times * rng.uniform(1, 900), velocity=rng.uniform(50, 300, 3), angular_velocity=rng.uniform(0.1, 1, 3)
    )
    values[8:11], values[18:21] = rng.uniform(0.5, 9, (2, 3))
    values[QUATERNION] *= sign
    return (encode_packet(values),)


def _fields(change=lambda v: v, dtype="<f8", time=1, position=2, quaternion=11, scale=1000.0, double=float):
    def variant(data):
        v = change(np.frombuffer(data, dtype).astype(double))
        return v[time], scale * v[position : position + 3], v[quaternion : quaternion + 4]

    return variant


def _integers(data):
    v = np.frombuffer(data, "<i8")
    return v[1], 1000 * v[2:5], v[11:15]


def _scalar_first(data):
    time, position, q = decode_packet(data)
    return time, position, np.roll(q, 1)


# Kinematics ------------------------------------------------------------------------------------------------------------------


def link(rng, signs):
    """Parameters of one link: rad, mm, mm, rad."""
    return (*(rng.uniform((0.3, 50, 50, 0.3), (3, 300, 300, 1.5)) * signs),)


def obtuse_link(rng):
    """Parameters of a link that turns by more than a right angle about both of its axes."""
    return (*(rng.uniform((1.8, 50, 50, 1.8), (3, 300, 300, 3)) * rng.choice([-1, 1], 4)),)


def long_link_turned_far(rng):
    """Parameters of a long link that turns by three quarters of a turn and more about both of its axes."""
    return (*(rng.uniform((4.8, 500, 500, 4.8), (6.2, 3000, 3000, 6.2)) * rng.choice([-1, 1], 4)),)


def link_without(rng, k):
    """Parameters of a link of which the k-th is 0."""
    return (*(rng.uniform((0.3, 50, 50, 0.3), (3, 300, 300, 1.5)) * rng.choice([-1, 1], 4) * (np.arange(4) != k)),)


def square_link(rng):
    """Parameters of a link whose axes cross at a right angle, as most of the TX40's do."""
    theta, d, a, _ = link_without(rng, 3)
    return theta, d, a, np.pi / 2 * rng.choice([-1, 1])


def joints_of_the_tx40(rng):
    """The table of the TX40, of which most lengths are 0, and joints turned by more than half a turn."""
    return TX40.dh.copy(), rng.uniform(3.3, 6, 6) * rng.choice([-1, 1], 6)


def _entry_by_entry(th, d, a, al):
    steps = ((th, 0, 0, 0), (0, d, 0, 0), (0, 0, a, 0), (0, 0, 0, al))
    return functools.reduce(np.multiply, [dh_matrix(*map(float, step)) for step in steps])


def _link(order, theta=1, alpha=1, swap=False):
    """A product of the four elementary transforms in another order; Z, D, A, X for turn z, along z, along x, turn x."""

    def variant(th, d, a, al):
        if swap:
            d, a = a, d
        parts = {
            "Z": pose(exp_so3([0, 0, theta * th]), [0, 0, 0]),
            "D": pose(np.eye(3), [0, 0, d]),
            "A": pose(np.eye(3), [a, 0, 0]),
            "X": pose(exp_so3([alpha * al, 0, 0]), [0, 0, 0]),
        }
        return functools.reduce(np.matmul, [parts[letter] for letter in order])

    return variant


def _moved_last(th, d, a, al):
    """The link with the step a along an x that nothing has turned, and d along the last z."""
    return pose(exp_so3([0, 0, th]) @ exp_so3([al, 0, 0]), exp_so3([0, 0, th]) @ exp_so3([al, 0, 0]) @ [a, 0, d])


def _without(*steps):
    """The link without some of its steps."""

    def variant(*given):
        return dh_matrix(*(0.0 if k in steps else value for k, value in enumerate(given)))

    return variant


def joint_angles(rng):
    """A robot whose parameters are all off those of the TX40, and angles of its joints."""
    dh = TX40.dh + rng.uniform(0.1, 0.3, (6, 4)) * rng.choice([-1, 1], (6, 4)) * [1, 100, 100, 1]
    return dh, rng.uniform(TX40.q_min, TX40.q_max)


def hardly_turned_link(rng):
    """Parameters of a link whose angles are less than a thousandth."""
    return (*(rng.uniform((2e-4, 50, 50, 2e-4), (9e-4, 300, 300, 9e-4)) * rng.choice([-1, 1], 4)),)


def joints_nearly_straight(rng):
    """A robot that stands so that each of its frames lies along the one before, but for some ten-thousandths."""
    dh, q = joint_angles(rng)
    dh[:, [0, 3]] = rng.uniform(5e-5, 1.5e-4, (6, 2))
    dh[:, 0] -= q
    return dh, q


def joints_at_rest(rng):
    """The same with half of the joints at 0."""
    dh, q = joint_angles(rng)
    return dh, q * rng.permutation([0, 0, 0, 1, 1, 1])


def _links(dh, q):
    return dh_matrix(q + dh[:, 0], dh[:, 1], dh[:, 2], dh[:, 3])


def _without_offsets(dh, q):
    return functools.reduce(np.matmul, dh_matrix(q, dh[:, 1], dh[:, 2], dh[:, 3]))


class SameEquations(metrics.Numbers):
    """Blocks of linear equations, compared by M^T M: however a rotation mixes its rows, and whatever its sign, a block
    has the same solutions and the same singular values.
    """

    def deviations(self, result, expected):
        expected = np.asarray(expected, dtype=float)
        off = super().deviations(result.T @ result, expected.T @ expected)[0]
        return [metrics.Deviation("one entry of M^T M, M your block,", off.amount, "", off.tolerance)]


# A X = X B -------------------------------------------------------------------------------------------------------------------


def motions(rng, n=None, std_deg=0.3, std_mm=1.0, R=None):
    """Motions of flange and tracker with noise, A X = X B, where R turns X if it is given; their number differs from
    draw to draw, never 8 or 9.
    """
    n = n or rng.integers(10, 15)
    axes = rng.uniform(0.3, 1.2, (n, 1)) * unit_vector(rng.normal(size=(n, 3)))
    X = pose(exp_so3(rng.normal(size=3)) if R is None else R, rng.uniform(-80, 80, 3))
    A = pose(exp_so3(axes), rng.uniform(-200, 200, (n, 3)))
    noise = pose(exp_so3(np.deg2rad(std_deg) * rng.normal(size=(n, 3))), std_mm * rng.normal(size=(n, 3)))
    return A, invert(X) @ A @ X @ noise


def motions_about_axes_alike(rng, within=0.06):
    """Exact motions whose axes lie within this angle (rad) of one, and the rotation of the mounting."""
    n, X = int(rng.integers(10, 15)), pose(exp_so3(rng.normal(size=3)), rng.uniform(-80, 80, 3))
    axes = exp_so3(rng.normal(size=3)) @ unit_vector(np.c_[rng.uniform(-within, within, (n, 2)), np.ones(n)]).T
    A = pose(exp_so3(rng.uniform(0.5, 1.2, (n, 1)) * axes.T), rng.uniform(-200, 200, (n, 3)))
    return A, invert(X) @ A @ X, X[:3, :3].copy()


def one_motion(rng):
    A, B = motions(rng, 1)
    return A[0, :3, :3], B[0, :3, :3]


def small_motion(rng):
    """Rotations of flange and tracker in a motion that turns by hundredths of a radian."""
    X, turn = exp_so3(rng.normal(size=3)), rng.uniform(0.01, 0.04) * unit_vector(rng.normal(size=3))
    return exp_so3(turn), exp_so3(X.T @ turn)


def square_motion(rng):
    """The same in a motion by 90 deg about an axis of the flange, which most entries of its rotation are 0 or 1 for."""
    X, turn = exp_so3(rng.normal(size=3)), np.pi / 2 * rng.permutation([0, 0, rng.choice([-1, 1])])
    return np.round(exp_so3(turn)), exp_so3(X.T @ turn)


def kron_row(A, B):
    """The block m_i of one motion, shape (9, 9): I kron A - B^T kron I."""
    return np.kron(np.eye(3), A) - np.kron(B.T, np.eye(3))


def stacked(rng, sign, first=None, trace=None):
    """The Kronecker matrix of noisy motions, so noisy that its null vector is visibly no rotation, and with this sign
    of the null vector's determinant, and of the rotation's first entry and its trace, any if None; `eig`, which does not sort, has another first, nor that of the largest value, and `eigh` gives it the same sign.
    """
    while True:
        R = exp_so3(rng.normal(size=3))
        if not _has_signs(R, first, trace):
            continue
        M = ax_xb.kronecker_matrix(*motions(rng, std_deg=8.0, R=R))
        unsorted = np.linalg.eig(M.T @ M)[0]
        if 0 in (unsorted.argmin(), unsorted.argmax()):
            continue
        X = _null(M).reshape(3, 3)
        if np.linalg.eigh(M.T @ M)[1][:, 0] @ X.ravel() < 0 or sign * np.linalg.det(X) < 0:
            continue
        if _has_signs(sign * X, first, trace) and np.abs(3 * X @ X.T - np.eye(3)).max() > 0.01:
            return (M,)


def blocks(rng, n, **noise):
    """The Kronecker matrix of so many motions with little noise, or other."""
    return (ax_xb.kronecker_matrix(*motions(rng, n, **noise)),)


def blocks_of_frames_alike(rng):
    """The same without noise, of frames that lie along one another, but for some ten-thousandths."""
    return blocks(rng, 20, std_deg=0.0, std_mm=0.0, R=exp_so3(rng.uniform(2e-4, 6e-4, 3)))


def _has_signs(R, first, trace):
    """Whether first entry and trace have these signs (None: any)."""
    return (not first or first * R[0, 0] >= 0.05) and (not trace or trace * np.trace(R) >= 0.05)


BOTH_SIGNS = tuple(functools.partial(stacked, sign=sign) for sign in (1, -1))
ALL_SIGNS = tuple(
    functools.partial(stacked, sign=sign, first=first, trace=trace)
    for sign, first, trace in ((1, 1, -1), (1, -1, None), (-1, 1, -1), (-1, -1, None))
)


def gentle_turn(rng):
    """The same for a rotation whose first entry and trace are positive, with any sign of the null vector's determinant."""
    return stacked(rng, rng.choice([-1, 1]), first=1, trace=1)


def rotation_from_nullvector(M):
    """Rotation of the smallest right singular vector of M, shape (9 N, 9)."""
    return ax_xb.rotation_from_kronecker(M)[0]


def _null(M, row=-1):
    return np.linalg.svd(M)[2][row]


def _signed(X):
    return X * np.sign(np.linalg.det(X))


def _first_positive(v):
    return v * np.sign(v[0])


def _orthonormal(X):
    """The nearest orthogonal matrix, reflections included."""
    U, _, Vt = np.linalg.svd(X)
    return U @ Vt


def _transposed_twice(M):
    U, _, Vt = np.linalg.svd(_signed(_null(M).reshape(3, 3, order="F")))
    return U @ Vt.T


def _by_qr(M, signed):
    Q, R = np.linalg.qr(_signed(_null(M).reshape(3, 3, order="F")))
    return Q * np.sign(np.diag(R)) if signed else Q


def singular_value_ratio(M):
    """Second smallest singular value of the stacked blocks M over the largest: near 0, a second mounting fits as well."""
    values = _values(M)
    return values[-2] / values[0]


def _values(M):
    return np.linalg.svd(M)[1]


def stacks(rng, n=None):
    """Stacked blocks of motions about axes that lie within a cone of 5 to 90 deg, with noise; 3 motions and more."""
    n, width = n or int(rng.integers(3, 15)), np.deg2rad(rng.uniform(5, 90))
    tilt = exp_so3(
        rng.uniform(-width, width, (n, 1)) * unit_vector(np.r_["1", rng.normal(size=(n, 2)), np.zeros((n, 1))])
    )
    A = exp_so3(rng.uniform(0.2, 2.0, (n, 1)) * (tilt @ [0.0, 0.0, 1.0]))
    X = exp_so3(rng.normal(size=3))
    B = X.T @ A @ X @ exp_so3(0.003 * rng.normal(size=(n, 3)))
    return (ax_xb.kronecker_matrix(A, B),)


def stacks_of_axes_alike(rng):
    A, B, _ = motions_about_axes_alike(rng, within=0.006)
    return (ax_xb.kronecker_matrix(A, B),)


def stacks_of_one_axis(rng):
    """Blocks of exact motions about one axis, so that a second mounting fits as well; rounding leaves the eigenvalues of
    M^T M above 0, or who takes their roots would be right or not by chance.
    """
    while True:
        axis, X = unit_vector(rng.normal(size=3)), exp_so3(rng.normal(size=3))
        A = exp_so3(rng.uniform(0.2, 2.0, (int(rng.integers(3, 9)), 1)) * axis)
        M = ax_xb.kronecker_matrix(A, X.T @ A @ X)
        if np.linalg.eigvalsh(M.T @ M)[1] > 0:
            return (M,)


def translation_problem(rng, n=None):
    A, B = motions(rng, n)
    return A, B, ax_xb.rotation_from_kronecker(ax_xb.kronecker_matrix(A, B))[0]


def motions_of_size(rng, factor):
    """Motions whose shifts, and those of the mounting, are multiplied by a factor, and the rotation of the mounting."""
    A, B, R = translation_problem(rng)
    A[:, :3, 3] *= factor
    B[:, :3, 3] *= factor
    return A, B, R


def one_motion_astray(rng):
    """Motions of flange and tracker, one of which the tracker missed by centimeters."""
    A, B, R = translation_problem(rng)
    B[rng.integers(len(B)), :3, 3] += rng.choice([-1, 1], 3) * rng.uniform(30, 60, 3)
    return A, B, R


def translation_lsq(A, B, R):
    """Translation of the mounting by least squares, shape (3,), mm."""
    return ax_xb.translation_from_motions(A, B, R)[0]


def _translation(K1, K2):
    def variant(A, B, R):
        return np.linalg.lstsq(K1(A).reshape(-1, 3), K2(A, B, R).ravel(), rcond=None)[0]

    return variant


def _k1(A):
    return np.eye(3) - A[:, :3, :3]


def _k2(A, B, R):
    return A[:, :3, 3] - B[:, :3, 3] @ R.T


def _weighed(A, B, R, weight):
    """The translation with rows multiplied by something of the angle of their motion."""
    w = weight(np.linalg.norm(log_so3(A[:, :3, :3]), axis=1))[:, None]
    return np.linalg.lstsq((w[..., None] * _k1(A)).reshape(-1, 3), (w * _k2(A, B, R)).ravel(), rcond=None)[0]


def gaps(rng, n=None):
    A, B, R = translation_problem(rng, n)
    return (ax_xb.translation_from_motions(A, B, R)[1],)


# Outliers and time -----------------------------------------------------------------------------------------------------------


def reject_outliers(values, factor=4.0):
    """Reference of the exercise, its rule to the letter; the library's keeps all where more than half are equal."""
    return _keep(np.median, lambda v: 1.4826 * _mad(v))(values, factor)


SHARES = np.array([0.43, 0.5, 0.57, 0.64, 0.71, 0.78, 0.85, 0.92, 1.08, 1.2, 1.5, 1.9, 2.6, 4.0, 30.0])


def _far(rng):
    """A number far from 0, on either side of it."""
    return rng.choice([-1, 1]) * rng.uniform(40, 90)


def spoiled(rng, factor, size=1.0, nearest=()):
    """Values about some number, and more on both sides at certain shares of the limit: every other rule draws its line between
    two of them, the rule itself where none is near, or hardly one but the `nearest`.
    """
    while True:
        n = 2 * int(rng.integers(55, 66)) + 1
        core = np.r_[np.linspace(-1, 1, n), np.zeros(4)] + 0.01 * rng.normal(size=n + 4)
        tail = np.r_[SHARES, SHARES[9:], -SHARES[:9], nearest]
        limit = factor * 1.4826 * _mad(np.r_[core, 99 * np.sign(tail)])
        values = np.r_[core, np.median(np.r_[core, 99 * np.sign(tail)]) + limit * tail]
        shares = np.abs(values - np.median(values)) / (factor * 1.4826 * _mad(values))
        if np.abs(shares - 1).min() > 0.005:  # 1.48 for 1.4826 is good enough
            return rng.permutation(_far(rng) + size * rng.uniform(0.5, 2) * values), factor


def lopsided(rng):
    """Values that lie close below their median and far apart above it, and some at certain shares of the limit."""
    n, factor = 2 * int(rng.integers(50, 80)) + 1, float(rng.uniform(2.6, 5))
    core = 4 * np.linspace(0, 1, n) ** 2
    tail = np.array([-1.5, -1.1, -0.92, 0.92, 1.1, 1.5])
    limit = factor * 1.4826 * _mad(np.r_[core, 99 * np.sign(tail)])
    return rng.permutation(_far(rng) + np.r_[core, np.median(core) + limit * tail]), factor


def two_heaps(rng):
    """An even number of values in two heaps: the median lies halfway between them, where no value is."""
    n, gap = int(rng.integers(8, 20)), rng.uniform(2, 4)
    core = np.r_[-gap - rng.uniform(0, 0.2, n), gap + rng.uniform(0, 0.2, n)]
    factor = float(rng.uniform(2.5, 5))
    limit = factor * 1.4826 * (gap + 0.1)
    values = np.r_[core, limit * np.array([-1.6, -1.3, -0.8, 0.8, 1.3, 1.6])]
    return rng.permutation(_far(rng) + values), factor


def all_equal(rng):
    """Readings without any noise: each lies at the median, and so within any limit, 0 as well."""
    return np.full(int(rng.integers(5, 40)), rng.uniform(-50, 50)), float(rng.uniform(2, 6))


def mostly_equal(rng):
    """Readings of which more than half are equal: the robust standard deviation is 0, and the others are beyond it, one
    of them so far that it stands out by any other measure.
    """
    n = int(rng.integers(4, 20))
    others = np.append(10 ** rng.uniform(-3, 1, n), 1000.0) * rng.choice([-1, 1], n + 1)
    return rng.permutation(_far(rng) + np.r_[np.zeros(n + 3), others]), float(rng.uniform(2, 2.8))


def three_values(rng):
    """Two values close together and one far away."""
    return rng.permutation(_far(rng) + np.array([0.0, rng.uniform(0.1, 1), 50.0])), float(rng.uniform(2, 6))


def one_value(rng):
    """A single value, which is its own median."""
    return _far(rng) + np.array([0.0]), float(rng.uniform(2, 6))


class KeptOrNot(metrics.Exactly):
    """True or False for each value; says how many are kept or refused wrongly."""

    def admit(self, result, expected):
        if np.asarray(expected).dtype == bool and getattr(np.asarray(result), "dtype", None).kind in "iu":
            told = "`values[kept]` takes whole numbers for places"
            raise metrics.Refused(f"expected an array of True and False, got whole numbers: {told}")
        return super().admit(result, expected)

    def deviations(self, result, expected):
        if np.asarray(expected).dtype != bool:
            return super().deviations(result, expected)
        kept, refused = int((result & ~expected).sum()), int((~result & expected).sum())
        parts = [f"keep {kept} that should go"] * bool(kept) + [f"refuse {refused} that should stay"] * bool(refused)
        words = f"of {len(expected)} values you {' and '.join(parts)}"
        return [metrics.Deviation("", float(kept + refused), "", 0.5, words=words)]


class KeptOrAll(KeptOrNot):
    """As the rule says, or all of them, as the docstring allows where there is no scale to judge by."""

    def deviations(self, result, expected):
        return super().deviations(expected if result.all() else result, expected)


def _keep(center, scale, above=False):
    def variant(values, factor):
        distance = values - center(values)
        return (distance if above else np.abs(distance)) <= factor * scale(values)

    return variant


def _tukey(values, factor):
    low, high = np.percentile(values, [25, 75])
    return (values >= low - 1.5 * (high - low)) & (values <= high + 1.5 * (high - low))


def _refused_again(values, factor):
    kept, before = np.ones(len(values), bool), None
    while not np.array_equal(kept, before):
        left, before = values[kept], kept
        kept = kept & (np.abs(values - np.median(left)) <= factor * 1.4826 * _mad(left))
    return kept


def _mad(values):
    return np.median(np.abs(values - np.median(values)))


def speed_curves(rng, sign, wide=False):
    """Angular speeds of a robot and of a tracker that lags (sign 1), or leads (-1), by a fraction of a sample. Where the
    largest offset is wide, the curves match a little at several shifts, and well at one beyond 0.2 s, the default.
    """
    step = float(rng.choice([0.01, 0.0125]))
    time, phase = rng.uniform(1, 50) + step * np.arange(int(rng.integers(550, 700))), rng.uniform(0, 6, 4)
    samples = int(rng.integers(30, 45) if wide else rng.integers(7, 30))
    lag = sign * (samples + rng.choice([0.27, 0.33, 0.67, 0.73])) * step

    def curve(t):
        return (
            1.2
            + 0.6 * np.sin(2.1 * t + phase[0])
            + 0.3 * np.sin(3.7 * t + phase[1])
            + 0.15 * np.sin(5.9 * t + phase[2])
            + 0.45 * wide * np.sin(9.0 * t + phase[3])
        )

    most = int(rng.integers(130, 170)) if wide else samples + int(rng.integers(4, 12))
    reference, delayed = curve(time), curve(time - lag)
    if np.argmax(delayed) - np.argmax(reference) == round(lag / step):
        # whoever compares the times of the peaks is told apart from whoever stops at whole samples
        return speed_curves(rng, sign, wide)
    return time, reference, delayed, step * most


def curves_in_degrees(rng):
    """Curves of large numbers whose lag, or lead, is a fraction of the first sample."""
    time, _, _, most = speed_curves(rng, 1)
    step = time[1] - time[0]
    lag = rng.choice([-1, 1]) * rng.choice([0.27, 0.33]) * step
    phase = rng.uniform(0, 6, 2)

    def curve(t):
        return 60 + 40 * np.sin(2.1 * t + phase[0]) + 20 * np.sin(3.7 * t + phase[1])

    return time, curve(time), curve(time - lag), most


def periodic_curves(rng):
    """Curves that repeat: they match within the largest offset, between two samples, and beyond it, a period away, on a
    sample, where the cost is 0.
    """
    step, near, period = 0.01, int(rng.integers(12, 22)), int(rng.integers(60, 80))
    part, sign, phase = rng.uniform(0.25, 0.4), rng.choice([-1, 1]), rng.uniform(0, 6, 3)
    time = rng.uniform(1, 50) + step * np.arange(int(rng.integers(550, 700)))
    rate = 2 * np.pi / ((period + part) * step)

    def curve(t):
        waves = (a * np.sin(k * rate * t + p) for k, a, p in zip((1, 2, 3), (0.6, 0.3, 0.15), phase))
        return 1.2 + sum(waves)

    lag = sign * (near + part) * step
    return time, curve(time), curve(time - lag), (period - near - 6) * step


AT_THE_LIMIT = metrics.Numbers(2.5e-3, "s")  # a quarter of a sample: a parabola needs a shift beyond the last


def curves_at_the_limit(rng, sign):
    """Curves that lag (sign 1), or lead (-1), by nearly as much as is looked for: the best of all shifts is at the end.
    They change so quickly that a parabola through shifts that end a sample sooner does not lead there.
    """
    step, samples, phase = 0.01, int(rng.integers(12, 20)), rng.uniform(0, 6, 3)
    time = rng.uniform(1, 50) + step * np.arange(int(rng.integers(200, 240)))

    def curve(t):
        slow = 0.6 * np.sin(4.1 * t + phase[0]) + 0.3 * np.sin(7.3 * t + phase[1])
        return 1.2 + slow + 0.3 * np.sin(40 * t + phase[2])

    lag = sign * (samples - rng.uniform(0.05, 0.12)) * step
    return time, curve(time), curve(time - lag), (samples + 0.2) * step


def noisy_curves(rng):
    """Curves that noise nearly hides, and a third of their length as the largest offset: the sum of the squared
    differences is least where few samples overlap, their mean near the truth, also over a few samples more or less.
    """
    while True:
        time, reference, delayed, largest = speed_curves(rng, rng.choice([-1, 1]), wide=True)
        truth, step = time_offset(time, reference, delayed, largest), time[1] - time[0]
        std = 1.6 * reference.std()
        curves = time, *(curve + std * rng.normal(size=len(time)) for curve in (reference, delayed))
        most = (len(time) - 21) // 3 * step
        if abs(_least(_sum_of_squares, True)(*curves, most) - truth) > 1 and _near(truth, curves, most, step):
            return *curves, most


def _near(truth, curves, most, step):
    """Whether the mean of the squared differences is least near the truth, whichever samples it is taken of."""
    parts = (slice(None), slice(-5), slice(-20), slice(5, None), slice(20, None))
    return (
        abs(_least(_mean_of_squares, True)(*curves, most) - truth) < 0.1
        and all(abs(time_offset(*(values[part] for values in curves), most) - truth) < 0.1 for part in parts)
        and all(abs(time_offset(*curves, most + more * step) - truth) < 0.1 for more in (1, 5))
    )


def _overlap(reference, delayed, n):
    """Sums of products over the overlap for every shift: the correlation NumPy calls "full", and the shifts."""
    return -np.correlate(delayed, reference, "full"), np.arange(1 - len(reference), len(delayed))


def _centered_overlap(reference, delayed, n):
    return _overlap(reference - reference.mean(), delayed - delayed.mean(), n)


def _around(reference, delayed, n):
    """Costs of shifts that bring the end of the curve back in at its beginning."""
    shifts = np.arange(-n, n + 1)
    return np.array([np.mean((np.roll(reference, s) - delayed) ** 2) for s in shifts]), shifts


def _shifted(cost, reference, delayed, shifts):
    """Costs of the shifts over the part both curves share, and the shifts."""
    m = len(reference)
    parts = [(reference[max(0, -s) : m - max(0, s)], delayed[max(0, s) : m + min(0, s)]) for s in shifts]
    return np.array([cost(r, d) for r, d in parts]), shifts


def _forward_only(reference, delayed, n):
    return _shifted(lambda r, d: np.mean((d - r) ** 2), reference, delayed, np.arange(n + 1))


def _distances(reference, delayed, n):
    return _shifted(lambda r, d: np.mean(np.abs(d - r)), reference, delayed, np.arange(-n, n + 1))


def _mean_of_squares(reference, delayed, n):
    return _shifted(lambda r, d: np.mean((d - r) ** 2), reference, delayed, np.arange(-n, n + 1))


def _sum_of_squares(reference, delayed, n):
    return _shifted(lambda r, d: np.sum((d - r) ** 2), reference, delayed, np.arange(-n, n + 1))


def _products(reference, delayed, n):
    """Sums of products over a core of constant length: the amount still varies with what the shift brings in."""
    core, shifts = slice(n, -n), np.arange(-n, n + 1)
    return np.array([-(reference[core] * np.roll(delayed, -s)[core]).sum() for s in shifts]), shifts


def _plain_differences(reference, delayed, n):
    core, shifts = slice(n, -n), np.arange(-n, n + 1)
    return np.array([np.mean(reference[core] - np.roll(delayed, -s)[core]) for s in shifts]), shifts


def _least(costs, between):
    """A time offset from costs of shifts, by whole samples or between them."""

    def variant(time, reference, delayed, max_offset):
        step = time[1] - time[0]
        cost, shifts = costs(reference, delayed, round(max_offset / step))
        k = np.clip(np.argmin(cost), 1, len(cost) - 2) if between else np.argmin(cost)
        part = 0.0
        if between:
            left, middle, right = cost[k - 1 : k + 2]
            part = 0.5 * (left - right) / (left - 2 * middle + right)
        return (shifts[k] + part) * step

    return variant


def _whole_samples(time, reference, delayed, max_offset):
    step = time[1] - time[0]
    return round(time_offset(time, reference, delayed, max_offset) / step) * step


# The six runs ----------------------------------------------------------------------------------------------------------------


@functools.cache
def _run_1(factor=4.0):
    return stop_poses(), average_stops(synthetic_log(1), factor)[0]


def _mounting(factor=4.0, gate=8.0, R=None):
    """The mounting; with a rotation R given, that one, and the translation that belongs to it."""
    found = calibrate_mounting(*_run_1(factor), gate)
    if R is None:
        return found.T_FE
    return pose(R, ax_xb.translation_from_motions(found.A[found.kept][1:], found.B[found.kept][1:], R)[0])


def _from_the_poses():
    T_BF, T_WE = _run_1()
    kept = calibrate_mounting(T_BF, T_WE).kept
    return ax_xb.solve_ax_xb(T_BF[kept], T_WE[kept])


def _against_the_readings():
    T_BF, T_WE = _run_1()
    kept = calibrate_mounting(T_BF, T_WE).kept
    A, B = relative(T_BF[0], T_BF)[kept][1:], relative(T_WE[0], T_WE)[kept][1:]
    return ax_xb.solve_ax_xb(B, A)


def _maximum_likelihood():
    T_BF, T_WE = _run_1()
    return ax_xb.calibrate_hand_eye(T_BF, T_WE, robust=True, eye="to hand").T_FT


def _of_motions(chosen):
    """The mounting from other motions than those of the kept poses: `chosen` makes of these truth values others."""
    found = calibrate_mounting(*_run_1())
    some = chosen(found.kept)
    A, B = found.A[some], found.B[some]
    R = ax_xb.rotation_from_kronecker(ax_xb.kronecker_matrix(A, B))[0]
    return pose(R, np.linalg.lstsq(_k1(A).reshape(-1, 3), _k2(A, B, R).ravel(), rcond=None)[0])


def _aligned():
    """The rotation that brings the rotation vectors of B nearest to those of A, and the translation that follows."""
    found = calibrate_mounting(*_run_1())
    a, b = (log_so3(T[found.kept][1:, :3, :3]) for T in (found.A, found.B))
    return _mounting(R=Rotation.align_vectors(a, b)[0].as_matrix())


def _from_pose_to_pose():
    T_BF, T_WE = _run_1()
    kept = calibrate_mounting(T_BF, T_WE).kept
    F, E = T_BF[kept], T_WE[kept]
    return ax_xb.solve_ax_xb(relative(F[:-1], F[1:]), relative(E[:-1], E[1:]))


@functools.cache
def _heights():
    return np.array([m.T_FE[2, 3] for m in synthetic_mountings()])


CHAPTER = Chapter(
    "06-tracker",
    title="A tracker on a robot flange",
    items=[
        Exercise(
            "decode_packet",
            reference=decode_packet,
            draw=tuple(functools.partial(_packet, sign=sign) for sign in (1, -1)),
            metric=DECODED,
            noisy=(
                (
                    functools.partial(_packet, sign=1, times=1e5, way=9e3),
                    DECODED,
                    "right, but not after a day, or nine meters off:",
                ),
                (
                    functools.partial(_packet, sign=-1, times=1e-4, way=0.05),
                    DECODED,
                    "right, but not in the first tenth of a second, within a tenth of a millimeter:",
                ),
            ),
            hints=(
                "Read all 184 bytes as 23 numbers of 8 bytes, then pick by the order of table 1.",
                '`np.frombuffer(data, "<f8")` gives 23 little-endian doubles; number 0 is the device.',
                "`v = np.frombuffer(data, '<f8')\nreturn v[1], 1000 * v[2:5], v[11:15]`",
            ),
            mistakes=[
                Mistake(
                    _fields(scale=1.0),
                    "The position is in meters, as the packet carries it. The workbook computes in mm.",
                ),
                Mistake(
                    _fields(time=0, position=1, quaternion=10),
                    "You are one field too early: number 0 is the device, the time stamp comes second.",
                ),
                Mistake(
                    _fields(position=5),
                    "These are the linear velocities (bytes 40 to 63). The position starts at byte 16.",
                ),
                Mistake(
                    _fields(quaternion=8),
                    "Your quaternion begins with the three accelerations. It comes behind them, numbers 11 to 14.",
                    id="decode_packet-3b6145",
                ),
                Mistake(
                    _fields(quaternion=15),
                    "Your quaternion begins with the angular velocities. It starts at byte 88, which is number 11.",
                    id="decode_packet-f12f2d",
                ),
                Mistake(
                    _fields(position=8),
                    "These are the linear accelerations (bytes 64 to 87). The position starts at byte 16.",
                ),
                Mistake(_fields(time=0), "Number 0 is the device. The time stamp comes second, number 1."),
                *(
                    Mistake(
                        _fields(quaternion=k),
                        "The quaternion is shifted by one field: it is numbers 11 to 14, counted from 0.",
                        id=f"decode_packet-fb2af7{number}",
                    )
                    for k, number in ((10, ""), (12, "-2"))
                ),
                *(
                    Mistake(
                        _fields(dtype="<f4", double=kind),
                        "You read 46 numbers of 4 bytes. The fields have 8 bytes each: 23 doubles, `<f8`.",
                    )
                    for kind in (np.float32, np.float64)
                ),
                Mistake(
                    _integers,
                    "You read the fields as integers, so the numbers come out absurd. The workbook assumes doubles, `<f8`.",
                ),
                Mistake(
                    _fields(dtype="u1"),
                    "You picked single bytes. Turn every 8 bytes into one number first: `np.frombuffer` or `struct.unpack`.",
                ),
                Mistake(
                    _fields(double=np.float32),
                    "You cut the packet's doubles to single precision: seven digits are left, and a clock that has run for an hour goes by "
                    "steps of 0.2 ms.",
                    id="decode_packet-single",
                ),
                Mistake(_scalar_first, "The packet's quaternion is x, y, z, w: you put w first."),
                Mistake(
                    _fields(dtype=">f8"),
                    "You read the bytes in the wrong order (big-endian): the numbers come out absurd. The workbook assumes little-endian doubles.",
                ),
            ],
        ),
        Prediction(
            "loss",
            question="The packet has no sequence number and no checksum. How can a receiver know that one was lost?",
            choices=("it cannot", "from gaps in the time stamps", "UDP reports it"),
            answer="from gaps in the time stamps",
            why="UDP says nothing. At a known rate a gap in the time stamps can be counted; a duplicate shows the same stamp twice.",
        ),
        Prediction(
            "fold",
            question="Upper arm and forearm are 225 mm each, the elbow bends by up to 138 deg from straight. How close can the wrist come to axis 2 (mm)?",
            answer=161.3,
            unit="mm",
            within=0.03,
            why="An isosceles triangle: 2 * 225 mm * cos(138 deg / 2) = 161 mm. The data sheet prints 162 mm, so its 138 deg are rounded.",
        ),
        Exercise(
            "dh_matrix",
            reference=dh_matrix,
            sizes=("d", "a"),
            draw=(
                *(
                    functools.partial(link, signs=s)
                    for s in ((1, 1, 1, -1), (-1, -1, 1, 1), (1, -1, -1, -1), (-1, 1, -1, 1))
                ),
                obtuse_link,
            ),
            metric=metrics.Poses(1e-6, 1e-6),
            noisy=(
                *(
                    (
                        functools.partial(link_without, k=k),
                        metrics.Poses(1e-6, 1e-6),
                        f"right, but not for a link whose {name} is 0:",
                    )
                    for k, name in enumerate(("theta", "d", "a", "alpha"))
                ),
                (
                    hardly_turned_link,
                    metrics.Poses(1e-6, 1e-6),
                    "right, but not for angles below a thousandth, which count as well:",
                ),
                (square_link, metrics.Poses(1e-6, 1e-6), "right, but not where alpha is 90 deg or -90 deg:"),
                (
                    long_link_turned_far,
                    metrics.Poses(1e-6, 1e-6),
                    "right, but not for a link of half a meter and more that is turned by more than three quarters of a turn:",
                ),
                *(
                    (
                        functools.partial(scaled, draw=obtuse_link, factors=factors),
                        metrics.Poses(1e-6, 1e-6),
                        f"right, but not for a link {this}:",
                    )
                    for factors, this in (
                        (
                            (2, 10, 10, 2),
                            "of half a meter and more that is turned by more than half a turn, about both axes",
                        ),
                        (
                            (1e-3, 1e-2, 1e-2, 1e-3),
                            "that is short, by millimeters, and hardly turned, by thousandths of a radian",
                        ),
                    )
                ),
            ),
            hints=(
                "Four elementary transforms in a row: turn about z, go along z, go along the new x, turn about the new x.",
                "Rot(z, theta) Trans(z, d) Trans(x, a) Rot(x, alpha): the last column is (a cos theta, a sin theta, d).",
                "`c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)\n"
                "return np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])`",
            ),
            mistakes=[
                Mistake(
                    _link("XAZD"),
                    "This is the modified (Craig) convention, Rot(x) Trans(x) Rot(z) Trans(z). The classic one begins with the turn about z.",
                ),
                Mistake(_link("ZDAX", swap=True), "d and a have changed places: d goes along z, a along x."),
                Mistake(_link("ZDAX", alpha=-1), "alpha has the wrong sign: check the entries with sin(alpha)."),
                Mistake(_link("ZDAX", theta=-1), "theta has the wrong sign: check the entries with sin(theta)."),
                Mistake(
                    _link("DAZX"),
                    "The step a ignores theta, as it does where the way along x comes before the turn about z. The last column begins with a cos(theta), "
                    "a sin(theta).",
                    id="dh_matrix-bd3295",
                ),
                Mistake(
                    _moved_last,
                    "d goes along the old z, before the turn by alpha. Yours goes along the new one.",
                    id="dh_matrix-48a360",
                ),
                Mistake(_entry_by_entry, "`*` multiplies entry by entry. The product of two transforms is `@`."),
                Mistake(_without(1), "d is missing: the last column is (a cos theta, a sin theta, d)."),
                Mistake(
                    lambda th, d, a, al: dh_matrix(al, d, a, th),
                    "The angles have changed places: theta turns about z, alpha about x.",
                ),
                Mistake(
                    lambda th, d, a, al: pose(
                        exp_so3([al, 0, 0]) @ exp_so3([0, 0, th]), dh_matrix(th, d, a, al)[:3, 3]
                    ),
                    "The two turns come in the wrong order: first about z, then about the new x, so R = Rz(theta) Rx(alpha).",
                ),
                Mistake(lambda *p: invert(dh_matrix(*p)), "This is the inverse: it maps from frame i - 1 to frame i."),
                Mistake(
                    lambda th, d, a, al: dh_matrix(np.deg2rad(th), d, a, np.deg2rad(al)),
                    "The angles already are radians: you converted them once too often.",
                ),
                Mistake(
                    lambda th, d, a, al: dh_matrix(np.rad2deg(th), d, a, np.rad2deg(al)),
                    "The angles already are radians, which is what np.sin and np.cos take: convert nothing.",
                ),
            ],
        ),
        Exercise(
            "forward_kinematics",
            reference=forward_kinematics,
            draw=joint_angles,
            fixed={"dh": "six joints, four parameters each", "q": "six joints"},
            metric=metrics.Poses(1e-6, 1e-6),
            noisy=(
                (
                    joints_nearly_straight,
                    metrics.Poses(1e-6, 1e-6),
                    "right, but not where each frame lies nearly along the one before, but for ten-thousandths:",
                ),
                (joints_at_rest, metrics.Poses(1e-6, 1e-6), "right, but not where joints stand at 0:"),
                (
                    joints_of_the_tx40,
                    metrics.Poses(1e-6, 1e-6),
                    "right, but not for the TX40 itself, most of whose lengths are 0, with joints turned by more than half a turn:",
                ),
            ),
            hints=(
                "Each link's frame is given in the frame before it, so neighboring letters cancel from the base to the flange.",
                "T_BF = T_01 T_12 ... T_56, and the angle of a link is its offset plus the joint's angle.",
                "`T = np.eye(4)\n"
                "for (offset, d, a, alpha), angle in zip(dh, q): T = T @ dh_matrix(offset + angle, d, a, alpha)\n"
                "return T`",
            ),
            mistakes=[
                Mistake(
                    lambda dh, q: functools.reduce(np.matmul, dh_matrix(dh[:, 0], dh[:, 1], dh[:, 2], dh[:, 3] + q)),
                    "The joint angles are added to alpha, in the last column. They turn about z: the angle is offset + q, in the first.",
                    id="forward_kinematics-alpha",
                ),
                Mistake(
                    lambda dh, q: forward_kinematics(TX40.dh, q),
                    "You took the table of the TX40. Any robot may come in: use the argument `dh`.",
                ),
                Mistake(
                    _without_offsets,
                    "The offsets in the first column of dh are missing: the angle of a link is its offset plus the joint's angle.",
                ),
                Mistake(
                    lambda dh, q: functools.reduce(np.matmul, _links(dh, q)[::-1]),
                    "You multiplied from the flange to the base. A new link goes on the right: T = T @ link.",
                ),
                Mistake(
                    lambda dh, q: functools.reduce(np.matmul, _links(dh, q)[:-1]),
                    "The last link is missing: this is the wrist, not the flange.",
                ),
                Mistake(
                    lambda dh, q: functools.reduce(np.matmul, _links(dh, q)[1:]),
                    "The first link is missing: did the loop start at 1?",
                ),
                Mistake(
                    lambda dh, q: invert(forward_kinematics(dh, q)),
                    "This is the base seen from the flange: the inverse.",
                ),
                Mistake(
                    lambda dh, q: functools.reduce(np.multiply, _links(dh, q)),
                    "`*` multiplies entry by entry. The product of two transforms is `@`.",
                ),
                Mistake(
                    lambda dh, q: forward_kinematics(dh, 0 * q),
                    "q does nothing here: the angle of a link is its offset plus the joint's angle.",
                ),
                Mistake(
                    lambda dh, q: forward_kinematics(dh, np.deg2rad(q)),
                    "The joint angles already are radians: you converted them once too often.",
                ),
                Mistake(
                    lambda dh, q: forward_kinematics(dh[:, [0, 2, 1, 3]], q),
                    "d and a have changed places: the columns of dh are theta offset, d, a, alpha.",
                ),
                Mistake(
                    lambda dh, q: forward_kinematics(dh[:, [3, 1, 2, 0]], q),
                    "Offset and alpha have changed places: the columns of dh are theta offset, d, a, alpha.",
                ),
                Mistake(
                    lambda dh, q: forward_kinematics(dh, q - 2 * dh[:, 0]),
                    "The offset enters with the wrong sign: the angle of a link is offset + q.",
                ),
                Mistake(
                    lambda dh, q: _links(dh, q)[-1],
                    "This is the last link alone. Multiply inside the loop: T = T @ link.",
                ),
                Mistake(
                    lambda dh, q: _links(dh, q)[0],
                    "This is the first link alone: does `return` stand inside the loop?",
                ),
                Mistake(
                    lambda dh, q: _links(dh, q).sum(axis=0),
                    "You added the links. Transforms in a row are multiplied with `@`.",
                ),
                Mistake(
                    _links, "You return all links. Their product is the flange: T = T @ link, from base to flange."
                ),
                Mistake(
                    lambda dh, q: forward_kinematics(dh, -q),
                    "The joint angles enter with the wrong sign: the angle of a link is offset + q.",
                ),
            ],
        ),
        Prediction(
            "axes",
            question="All motions turn about one and the same axis. What do the residuals of the calibration look like?",
            choices=(
                "large, one sees it at once",
                "perfect, and the mounting is arbitrary",
                "perfect, and so is the mounting",
            ),
            answer="perfect, and the mounting is arbitrary",
            why="Turning the mounting about the common axis changes nothing in A X = X B. Only the singular values tell.",
        ),
        Exercise(
            "kron_row",
            reference=kron_row,
            draw=one_motion,
            metric=SameEquations(1e-9),
            fixed=dict.fromkeys("AB", "a rotation is always 3 x 3"),
            noisy=(
                (small_motion, SameEquations(1e-12), "right, but not for a small motion, by hundredths of a radian:"),
                (
                    square_motion,
                    SameEquations(1e-9),
                    "right, but not for a turn by 90 deg about an axis of the flange:",
                ),
            ),
            hints=(
                "Bring A X - X B = 0 into the form M vec(X) = 0, with the columns of X stacked.",
                "For stacked columns, vec(P X Q) = (Q^T kron P) vec(X). Once P = A, Q = I, once P = I, Q = B.",
                "`return np.kron(np.eye(3), A) - np.kron(B.T, np.eye(3))`",
            ),
            mistakes=[  # what has the same M^T M says the same, so it shares a text
                *(
                    Mistake(
                        variant,
                        "For stacked columns this says B X = X A. Either the rows are stacked (NumPy's ravel), where the report stacks "
                        "columns, as Matlab does; or A and B have changed places: in the report A is the tracker's motion, here the flange's.",
                    )
                    for variant in (
                        lambda A, B: np.kron(A, np.eye(3)) - np.kron(np.eye(3), B.T),
                        lambda A, B: np.kron(np.eye(3), B) - np.kron(A.T, np.eye(3)),
                    )
                ),
                *(
                    Mistake(
                        variant,
                        "For stacked columns this says A X = X B^T, and A X = X B is meant. vec(X B) is (B^T kron I) vec(X), and vec(A X B^T) is "
                        "(B kron A) vec(X): B is transposed in one of them alone.",
                        id=id,
                    )
                    for id, variant in (
                        ("kron_row-dede0d", lambda A, B: np.kron(np.eye(3), A) - np.kron(B, np.eye(3))),
                        ("kron_row-dede0d-2", lambda A, B: np.kron(B.T, A) - np.eye(9)),
                    )
                ),
                Mistake(
                    lambda A, B: np.kron(np.eye(3), A) + np.kron(B.T, np.eye(3)),
                    "The sign between the two products is a minus: A X - X B = 0.",
                ),
                Mistake(
                    lambda A, B: np.outer(np.eye(3), A) - np.outer(B.T, np.eye(3)),
                    "`np.outer` stretches both matrices out into vectors first. The product meant is `np.kron`, a block for each entry.",
                    id="kron_row-outer",
                ),
                Mistake(
                    lambda A, B: np.kron(A, np.eye(3)) - np.kron(np.eye(3), B),
                    "vec(P X Q) = (Q^T kron P) vec(X): P stands on the right of the product, Q on the left and transposed. A is a P, B is a Q.",
                ),
                *(
                    Mistake(
                        variant,
                        "One of the two factors stands on the wrong side: vec(A X) = (I kron A) vec(X), vec(X B) = (B^T kron I) vec(X).",
                    )
                    for variant in (
                        lambda A, B: np.kron(np.eye(3), A) - np.kron(np.eye(3), B.T),
                        lambda A, B: np.kron(A, np.eye(3)) - np.kron(B.T, np.eye(3)),
                    )
                ),
                *(
                    Mistake(
                        variant,
                        "Your block is an orthogonal matrix, as one kron of two rotations is: only X = 0 solves it. The block of A X - X B = 0 is a difference of two such products.",
                        id=f"kron_row-a04e51{also}",
                    )
                    for also, variant in (
                        ("", lambda A, B: np.kron(B.T, A)),
                        ("-2", lambda A, B: np.kron(A, B.T)),
                        ("-3", lambda A, B: np.kron(A, B)),
                        ("-4", lambda A, B: np.kron(np.eye(3), A)),
                        ("-5", lambda A, B: np.kron(B.T, np.eye(3))),
                    )
                ),
            ],
        ),
        Exercise(
            "rotation_from_nullvector",
            reference=rotation_from_nullvector,
            sizes=("M",),
            draw=(*ALL_SIGNS, gentle_turn),
            metric=metrics.Rotations(1e-5),
            noisy=(
                (
                    functools.partial(blocks, n=2, std_deg=0.0, std_mm=0.0),
                    metrics.Rotations(1e-5),
                    "right, but not for two motions alone, without noise:",
                ),
                (
                    blocks_of_frames_alike,
                    metrics.Rotations(1e-5),
                    "right, but not where the frames lie nearly along one another, but for ten-thousandths:",
                ),
                (functools.partial(blocks, n=20), metrics.Rotations(1e-5), "right, but not for twenty motions:"),
            ),
            hints=(
                "The singular vector of the smallest singular value, put back into a 3 x 3 matrix column by column.",
                'Vt[-1].reshape(3, 3, order="F"); its sign is free, so make the determinant positive; then the nearest rotation, U times Vt of a second SVD.',
                "`Vt = np.linalg.svd(M)[2]\n"
                "X = Vt[-1].reshape(3, 3, order='F')\n"
                "X *= np.sign(np.linalg.det(X))\n"
                "U, _, Wt = np.linalg.svd(X)\n"
                "return U @ Wt`",
            ),
            mistakes=[
                Mistake(
                    lambda M: rotation_from_nullvector(M).T,
                    "Your rotation is the transpose. The null vector holds the columns of X, and NumPy's reshape fills rows, the classic silent "
                    "error; or was it transposed once more on the way?",
                ),
                Mistake(
                    lambda M: -rotation_from_nullvector(M),
                    "Your matrix has determinant -1. The null vector's sign is arbitrary: turn it so that the determinant is positive.",
                ),
                Mistake(
                    lambda M: _signed(_null(M).reshape(3, 3, order="F")),
                    "The null vector has length 1, a rotation has length sqrt(3): scaling and projection to SO(3) are missing.",
                ),
                Mistake(
                    lambda M: np.sqrt(3) * _signed(_null(M).reshape(3, 3, order="F")),
                    "Scaled so, noise has still sheared the matrix: its columns are not orthonormal. Project it to SO(3).",
                    id="rotation_from_nullvector-4c6c17",
                ),
                Mistake(
                    lambda M: _orthonormal(_null(M).reshape(3, 3, order="F")),
                    "The sign is missing: the null vector may come out as -X, and then your matrix is a reflection. Turn it so that the determinant is positive.",
                ),
                *(
                    Mistake(
                        lambda M, nearest=nearest: nearest(_first_positive(_null(M)).reshape(3, 3, order="F")),
                        "You made the first entry positive, but R[0, 0] may well be negative. The sign that a rotation needs is that of its determinant.",
                    )
                    for nearest in (lie.nearest_rotation, _orthonormal)
                ),
                *(
                    Mistake(
                        lambda M, nearest=nearest: nearest(-_first_positive(_null(M)).reshape(3, 3, order="F")),
                        "You made the first entry negative, but R[0, 0] is positive in every gentle turn. The sign that a rotation needs is "
                        "that of its determinant.",
                        id=f"rotation_from_nullvector-first-negative{words}",
                    )
                    for nearest, words in ((lie.nearest_rotation, ""), (_orthonormal, "-as-it-comes"))
                ),
                *(
                    Mistake(
                        lambda M, nearest=nearest: nearest((v := _null(M)).reshape(3, 3, order="F") * np.sign(v.sum())),
                        "You made the sum of the entries positive, but a rotation's may well be negative. The sign that it needs is that of its "
                        "determinant.",
                        id=f"rotation_from_nullvector-sum{words}",
                    )
                    for nearest, words in ((lie.nearest_rotation, ""), (_orthonormal, "-as-it-comes"))
                ),
                *(
                    Mistake(
                        lambda M, nearest=nearest: nearest(
                            (X := _null(M).reshape(3, 3, order="F")) * np.sign(np.trace(X))
                        ),
                        "You made the trace positive, but a turn by more than 120 deg has a negative one. The sign that a rotation needs is that of "
                        "its determinant.",
                        id=f"rotation_from_nullvector-trace{words}",
                    )
                    for nearest, words in ((lie.nearest_rotation, ""), (_orthonormal, "-as-it-comes"))
                ),
                Mistake(
                    lambda M: lie.nearest_rotation(_null(M).reshape(3, 3, order="F")),
                    "The sign is missing. Where the null vector came out as -X you projected a reflection, and that gives another rotation: make the determinant positive first.",
                ),
                *(
                    Mistake(
                        lambda M, order=order, scale=scale: scale * _null(M).reshape(3, 3, order=order),
                        "The null vector as it comes is no rotation yet: its length is 1, its sign is arbitrary, its columns are not orthonormal, and NumPy's reshape fills rows.",
                    )
                    for order in "CF"
                    for scale in (1.0, np.sqrt(3))
                ),
                Mistake(
                    lambda M: lie.nearest_rotation(_signed(np.linalg.svd(M)[2][:, -1].reshape(3, 3, order="F"))),
                    "You took a column of NumPy's third result. That is V transposed: the singular vectors are its rows.",
                ),
                Mistake(
                    lambda M: lie.nearest_rotation(_signed(_null(M, 0).reshape(3, 3, order="F"))),
                    "This belongs to the largest singular value. `svd` has the smallest last (the last row of Vt), `eigh` first (the first column).",
                    id="rotation_from_nullvector-230478",
                ),
                Mistake(
                    lambda M: lie.nearest_rotation(_signed(np.linalg.eigh(M.T @ M)[1][0].reshape(3, 3, order="F"))),
                    "You took a row of what `eigh` returns. Its eigenvectors are the columns, smallest eigenvalue first.",
                ),
                Mistake(
                    lambda M: lie.nearest_rotation(_signed(_null(M[:9]).reshape(3, 3, order="F"))),
                    "Only the first motion is used, and one axis leaves the rotation about it free: take all rows of M.",
                ),
                Mistake(
                    lambda M: lie.nearest_rotation(
                        _signed(np.linalg.eig(M.T @ M)[1][:, 0].real.reshape(3, 3, order="F"))
                    ),
                    "You took the first of the vectors that `eig` gives: it does not sort them. `eigh` does, the smallest first.",
                    id="rotation_from_nullvector-unsorted",
                ),
                Mistake(
                    lambda M: np.zeros((3, 3)),
                    "Zero solves M x = 0 as well, and that is what `lstsq` and `solve` find. A solution of length 1 is wanted: "
                    "the last row of Vt.",
                ),
                Mistake(
                    _transposed_twice,
                    "NumPy's svd returns V transposed as its third result: the nearest rotation is U @ Vt, without another `.T`.",
                ),
                *(
                    Mistake(
                        lambda M, signed=signed: _by_qr(M, signed),
                        "The first column keeps its direction and the others are bent to fit, as by QR or Gram-Schmidt. The nearest rotation treats all alike: "
                        "U @ Vt of a second SVD.",
                        id=f"rotation_from_nullvector-5facee{words}",
                    )
                    for signed, words in ((True, ""), (False, "-2"))
                ),
                *(
                    Mistake(
                        variant,
                        "The lengths are right, but noise has sheared the matrix: its columns are not orthogonal. Project it to SO(3).",
                    )
                    for variant in (
                        lambda M: unit_vector(_signed(_null(M).reshape(3, 3))).T,
                        lambda M: unit_vector(_signed(_null(M).reshape(3, 3, order="F"))),
                    )
                ),
            ],
        ),
        Exercise(
            "singular_value_ratio",
            reference=singular_value_ratio,
            sizes=("M",),
            draw=(stacks, functools.partial(stacks, n=2)),
            metric=metrics.Numbers(1e-9),
            noisy=(
                (functools.partial(stacks, n=20), metrics.Numbers(1e-9), "right, but not for twenty motions:"),
                (
                    stacks_of_axes_alike,
                    metrics.Numbers(1e-9),
                    "right where the axes differ, but not where they lie within a degree of one another, and the ratio is below 0.01:",
                ),
                (
                    stacks_of_one_axis,
                    metrics.Numbers(1e-7),  # a root of what rounding leaves of 0 is as right
                    "right where the axes differ, but not where all motions turn about one axis, and the ratio is 0:",
                ),
            ),
            hints=(
                "The smallest singular value belongs to the answer itself, the null vector. Which one says how nearly there is a second answer?",
                "`np.linalg.svd` gives the singular values largest first; `[-2]` is the second smallest.",
                "`values = np.linalg.svd(M)[1]\nreturn values[-2] / values[0]`",
            ),
            mistakes=[
                Mistake(
                    lambda M: _values(M)[-1] / _values(M)[0],
                    "The smallest one is near 0 for every good set of motions: it belongs to the mounting itself. The second smallest tells whether "
                    "there is another.",
                    id="singular_value_ratio-smallest",
                ),
                Mistake(
                    lambda M: _values(M)[1] / _values(M)[0],
                    "This is the second largest. `svd` sorts from large to small, so that `[-2]` is the second smallest; `eigvalsh` from small to large.",
                    id="singular_value_ratio-second-largest",
                ),
                *(
                    Mistake(
                        lambda M, k=k: _values(M)[0] / _values(M)[k],
                        "This is largest over small, a condition number. Asked for is small over largest.",
                        id=f"singular_value_ratio-inverse{k}",
                    )
                    for k in (-2, -1)
                ),
                Mistake(
                    lambda M: _values(M)[-2] / _values(M)[-1],
                    "You divided by the smallest, which is noise. Divide by the largest.",
                    id="singular_value_ratio-by-noise",
                ),
                Mistake(
                    lambda M: _values(M)[-1] / _values(M)[-2],
                    "This is the smallest over the second smallest. Asked for is the second smallest over the largest.",
                    id="singular_value_ratio-two-smallest",
                ),
                Mistake(
                    lambda M: (_values(M)[-2] / _values(M)[0]) ** 2,
                    "This is the square of the ratio, that of two eigenvalues of M^T M: they are the squares of the singular values of M.",
                    id="singular_value_ratio-squares",
                ),
                Mistake(
                    lambda M: _values(M)[-2],
                    "The second smallest itself grows with the number of motions: divide by the largest.",
                    id="singular_value_ratio-undivided",
                ),
                Mistake(
                    lambda M: _values(M)[-3] / _values(M)[0],
                    "This is the third smallest.",
                    id="singular_value_ratio-third",
                ),
                Mistake(
                    lambda M: _values(M[:9])[-2] / _values(M[:9])[0],
                    "You looked at one motion alone, which never fixes the rotation. Take all rows of M.",
                    id="singular_value_ratio-one-motion",
                ),
            ],
        ),
        Exercise(
            "translation_lsq",
            reference=translation_lsq,
            sizes=("A", "B"),
            draw=tuple(functools.partial(translation_problem, n=n) for n in (None, 3, 25)),
            fixed={"R": "a rotation is always 3 x 3"},
            metric=metrics.Numbers(1e-7, "mm"),
            noisy=(
                (
                    motions_about_axes_alike,
                    metrics.Numbers(1e-6, "mm"),
                    "right where the axes differ, but not where they lie within a few degrees of one another:",
                ),
                (
                    functools.partial(motions_about_axes_alike, within=0.015),
                    metrics.Numbers(1e-6, "mm"),
                    "right where the axes differ, but not where they lie within a degree of one another:",
                ),
                (
                    functools.partial(translation_problem, n=2),
                    metrics.Numbers(1e-6, "mm"),
                    "right, but not for two motions alone:",
                ),
                (
                    one_motion_astray,
                    metrics.Numbers(1e-7, "mm"),
                    "right, but not where one motion is far off. Least squares hear it like all others:",
                ),
                *(
                    (functools.partial(motions_of_size, factor=factor), metrics.Numbers(1e-8, "mm"), words)
                    for factor, words in (
                        (100.0, "right for motions of centimeters, but not for ones of meters:"),
                        (0.01, "right for motions of centimeters, but not for ones of a millimeter or two:"),
                    )
                ),
            ),
            hints=(
                "Write out the last column of A X = X B. It is linear in the translation t once R is known.",
                "R_A t + t_A = R t_B + t, so (I - R_A) t = t_A - R t_B: three rows per motion, stacked.",
                "`K1 = np.eye(3) - A[:, :3, :3]\n"
                "K2 = A[:, :3, 3] - B[:, :3, 3] @ R.T\n"
                "return np.linalg.lstsq(K1.reshape(-1, 3), K2.ravel())[0]`",
            ),
            mistakes=[
                Mistake(
                    _translation(lambda A: -_k1(A), _k2),
                    "The result has the opposite sign: (I - R_A) t = t_A - R t_B.",
                    id="translation_lsq-0db086",
                ),
                Mistake(
                    _translation(_k1, lambda A, B, R: A[:, :3, 3] - B[:, :3, 3]),
                    "R is missing: the tracker's translations are written in its own axes and must be turned into the flange's.",
                ),
                Mistake(
                    _translation(_k1, lambda A, B, R: A[:, :3, 3] - B[:, :3, 3] @ R),
                    "You turned the tracker's translations by R^T instead of R. For rows, R t is `t @ R.T`.",
                ),
                Mistake(
                    _translation(lambda A: np.eye(3) - np.swapaxes(A[:, :3, :3], 1, 2), _k2),
                    "K1 holds the rotations of the motions transposed: (I - R_A) t = t_A - R t_B.",
                    id="translation_lsq-3399ce",
                ),
                Mistake(
                    lambda A, B, R: np.linalg.lstsq(_k1(A)[0], _k2(A, B, R)[0], rcond=None)[0],
                    "Only the first motion is used. Its axis component stays undetermined: stack all motions.",
                ),
                Mistake(
                    lambda A, B, R: np.einsum("nij,nj->ni", np.linalg.pinv(_k1(A)), _k2(A, B, R)).mean(axis=0),
                    "You solved each motion alone and averaged. Each leaves t along its own axis free, and pinv, like lstsq, sets that part "
                    "to zero: stack all motions, solve once.",
                    id="translation_lsq-2ce056",
                ),
                *(
                    Mistake(
                        lambda A, B, R, weight=weight: _weighed(A, B, R, weight),
                        "You weigh the motions by their angles. Plain least squares is meant, each row as it is: large angles have their say by "
                        "I - R_A already.",
                        id=f"translation_lsq-{name}",
                    )
                    for name, weight in (
                        ("by-angle", lambda w: w),
                        ("by-root-of-angle", np.sqrt),
                        ("by-sine", np.sin),
                        ("over-angle", lambda w: 1 / w),
                        ("over-sine-of-half", lambda w: 1 / np.sin(w / 2)),  # by the norm of I - R_A
                    )
                ),
                Mistake(
                    lambda A, B, R: np.linalg.solve(_k1(A).mean(axis=0), _k2(A, B, R).mean(axis=0)),
                    "The equations of all motions are added up into three, or averaged. Least squares keeps all 3 N rows, one under the other.",
                    id="translation_lsq-averaged",
                ),
                Mistake(
                    _translation(lambda A: np.eye(3) + A[:, :3, :3], _k2),
                    "K1 has the wrong sign: (I - R_A) t = t_A - R t_B.",
                ),
                Mistake(
                    _translation(_k1, lambda A, B, R: A[:, :3, 3] + B[:, :3, 3] @ R.T),
                    "K2 has the wrong sign: (I - R_A) t = t_A - R t_B.",
                ),
                Mistake(
                    lambda A, B, R: _translation(_k1, _k2)(B, A, R),
                    "A and B have changed places: K1 takes the rotations of the flange, and R turns the tracker's translations.",
                ),
                Mistake(
                    lambda A, B, R: _translation(lambda _: _k1(B), _k2)(A, B, R),
                    "K1 holds the rotations of the tracker. (I - R_A) t = t_A - R t_B: the flange's belong here.",
                ),
                *(
                    Mistake(
                        variant,
                        "K1 and K2 stack their rows in different orders: first x, y, z of motion 1, then of motion 2, in both.",
                    )
                    for variant in (
                        lambda A, B, R: np.linalg.lstsq(_k1(A).reshape(-1, 3), _k2(A, B, R).T.ravel(), rcond=None)[0],
                        lambda A, B, R: np.linalg.lstsq(
                            np.hstack(_k1(A)).reshape(-1, 3), _k2(A, B, R).ravel(), rcond=None
                        )[0],
                    )
                ),
            ],
        ),
        Exercise(
            "e_rot",
            reference=e_rot,
            draw=BOTH_SIGNS,
            metric=metrics.Numbers(1e-9),
            noisy=tuple(
                (
                    functools.partial(blocks, n=n),
                    metrics.Numbers(1e-6, least=0),
                    f"right, but not for {n} motions with little noise:",
                )
                for n in (2, 20)
            ),
            hints=(
                "Equation (13), taken at its word: the norm of M^T M v, divided by N - 1. v is the null vector, of length 1.",
                "M has 9 rows per motion, so N = len(M) / 9.",
                "`v = np.linalg.svd(M)[2][-1]\nreturn np.linalg.norm(M.T @ (M @ v)) / (len(M) / 9 - 1)`",
            ),
            mistakes=[
                *(
                    Mistake(
                        lambda M, N=N: e_rot(M) * (len(M) / 9 - 1) / (N - 1),
                        f"You divide by {N - 1}, as for {N} motions. How many they are, M tells: nine rows for each.",
                        id=f"e_rot-of-{N}",
                    )
                    for N in (19, 21)
                ),
                Mistake(
                    lambda M: e_rot(M) * (len(M) / 9 - 1) / (len(M) / 9),
                    "You divide by N. The report divides by N - 1.",
                ),
                Mistake(
                    lambda M: e_rot(M) * np.sqrt(len(M) / 9 - 1),
                    "You divide by the root of N - 1. In equation (13) no root stands there.",
                ),
                Mistake(
                    lambda M: e_rot(M) * (len(M) / 9 - 1) / 19,
                    "N = 20 is the report's number of motions. Here it is len(M) / 9.",
                ),
                Mistake(
                    lambda M: np.linalg.svd(M)[1][-1] / (len(M) / 9 - 1),
                    "You took the norm of M v, the smallest singular value. The report writes M^T M v, which brings it in once more: its square.",
                    id="e_rot-ede8c2",
                ),
                Mistake(
                    lambda M: np.sqrt(3) * e_rot(M),
                    "Your v has the length of a rotation, sqrt(3). Equation (11) divides by the norm of v: length 1.",
                ),
                Mistake(
                    lambda M: e_rot(M) * (len(M) / 9 - 1) / (len(M) - 1),
                    "N counts motions. M has nine rows for each of them.",
                ),
                Mistake(
                    lambda M: np.linalg.norm(M.T @ M @ _null(M, 0)) / (len(M) / 9 - 1),
                    "This comes of the largest singular value, or its vector. The null vector is the last row of Vt.",
                    id="e_rot-3dc217",
                ),
                Mistake(
                    lambda M: e_rot(M) * (len(M) / 9 - 1),
                    "The division by N - 1 is missing; N is the number of motions, len(M) / 9.",
                ),
                Mistake(
                    lambda M: e_rot(M) * (len(M) / 9 - 1) / (len(M) / 9) - 1,
                    "Parentheses are missing: / (N - 1), not / N - 1.",
                ),
                Mistake(
                    lambda M: (e_rot(M) * (len(M) / 9 - 1)) ** 2 / (len(M) / 9 - 1),
                    "You squared the norm. Equation (13) does not square it; M^T M contains the squares already.",
                ),
                Mistake(
                    lambda M: np.linalg.norm(M.T @ M @ np.linalg.svd(M)[2][:, -1]) / (len(M) / 9 - 1),
                    "You took a column of NumPy's third result. That is V transposed: the singular vectors are its rows.",
                ),
                *(
                    Mistake(
                        lambda M, order=order: (
                            np.linalg.norm(M.T @ M @ rotation_from_nullvector(M).ravel(order)) / (len(M) / 9 - 1)
                        ),
                        "You put in the projected rotation. Equation (13) takes the null vector v itself, before sign, length and projection.",
                    )
                    for order in "FC"
                ),
                *(
                    Mistake(
                        lambda M, order=order: (
                            np.linalg.norm(M.T @ M @ rotation_from_nullvector(M).ravel(order))
                            / np.sqrt(3)
                            / (len(M) / 9 - 1)
                        ),
                        "You put in the projected rotation, brought to length 1. Equation (13) takes the null vector v itself: the projection has moved it.",
                    )
                    for order in "FC"
                ),
                Mistake(
                    lambda M: np.linalg.norm(M.T @ M) / (len(M) / 9 - 1),
                    "v is missing: this is the norm of the whole matrix M^T M, not of M^T M v.",
                ),
            ],
        ),
        Exercise(
            "e_trans",
            reference=e_trans,
            sizes=("residuals",),
            draw=(gaps, functools.partial(gaps, n=3), functools.partial(gaps, n=25)),
            metric=metrics.Numbers(1e-9, "mm"),
            noisy=(
                (functools.partial(gaps, n=2), metrics.Numbers(1e-9, "mm"), "right, but not for two motions:"),
                (functools.partial(gaps, n=60), metrics.Numbers(1e-9, "mm"), "right, but not for sixty motions:"),
                *(
                    (
                        functools.partial(scaled, draw=gaps, factors=(factor,)),
                        metrics.Numbers(1e-9, "mm", least=0),
                        words,
                    )
                    for factor, words in (
                        (1e-3, "right, but not for small residuals, of micrometers:"),
                        (1e3, "right, but not for large residuals, of many centimeters:"),
                    )
                ),
            ),
            hints=(
                "Equation (17), taken at its word: the norm of K1 t - K2, divided by N - 1.",
                "The norm runs over all components of all N residuals, and it is not squared.",
                "`return np.linalg.norm(residuals) / (len(residuals) - 1)`",
            ),
            mistakes=[
                Mistake(lambda r: np.linalg.norm(r) / len(r), "You divide by N. The report divides by N - 1."),
                Mistake(
                    lambda r: (r**2).sum() / (len(r) - 1),
                    "You squared the norm. The text speaks of squares, equation (17) does not square.",
                ),
                Mistake(
                    lambda r: np.sqrt((r**2).sum() / (len(r) - 1)),
                    "N - 1 stands outside the root in equation (17). Yours would be the better definition.",
                ),
                Mistake(
                    lambda r: np.linalg.norm(r, axis=1).mean(),
                    "This is the mean distance. Equation (17) takes one norm over everything.",
                ),
                Mistake(
                    lambda r: np.linalg.norm(r, axis=1).sum() / (len(r) - 1),
                    "You added N distances. Equation (17) takes one norm over everything.",
                ),
                Mistake(
                    lambda r: np.linalg.norm(r, 2) / (len(r) - 1),
                    "For a matrix, norm(..., 2) is its largest singular value. Equation (17) takes the norm of one long vector.",
                ),
                *(
                    Mistake(variant, "N counts motions, not coordinates.")
                    for variant in (
                        lambda r: np.linalg.norm(r) / (r.size - 1),
                        lambda r: np.linalg.norm(r) / (r.size - 3),
                        lambda r: np.linalg.norm(r) / r.size,
                    )
                ),
                Mistake(
                    np.linalg.norm, "The division by N - 1 is missing; N is the number of motions, len(residuals)."
                ),
                Mistake(lambda r: np.linalg.norm(r) / len(r) - 1, "Parentheses are missing: / (N - 1), not / N - 1."),
                *(
                    Mistake(
                        variant,
                        "This is a root mean square, the better definition. Equation (17) takes no mean inside the root, and divides by N - 1.",
                    )
                    for variant in (
                        lambda r: np.sqrt((r**2).mean()),
                        lambda r: np.sqrt((r**2).sum(axis=1).mean()),
                    )
                ),
                *(
                    Mistake(
                        lambda r, axis=axis: np.linalg.norm(r, axis=axis) / (len(r) - 1),
                        "You return several norms. Equation (17) takes one norm over everything: no `axis`.",
                    )
                    for axis in (0, 1)
                ),
                Mistake(
                    lambda r: np.abs(r).sum() / (len(r) - 1),
                    "You added absolute values. The norm is the root of the sum of the squares.",
                ),
            ],
        ),
        Exercise(
            "reject_outliers",
            reference=reject_outliers,
            sizes=("values",),
            draw=tuple(functools.partial(spoiled, factor=factor) for factor in (4.0, 3.0, 5.0)),
            metric=KeptOrNot(),
            noisy=(
                (
                    all_equal,
                    KeptOrNot(),
                    "Right as long as no two values are equal. Where all are, each lies at the median, at a distance of 0, and 0 is within a limit of 0:",
                ),
                (
                    lopsided,
                    KeptOrNot(),
                    "Right where the values lie alike on both sides of the median. Where they do not, the distances from it have another median "
                    "than half the way between the quartiles, say:",
                ),
                (
                    two_heaps,
                    KeptOrNot(),
                    "Right where the number of values is odd. Where it is even, the median lies halfway between the two in the middle:",
                ),
                (
                    mostly_equal,
                    KeptOrAll(),
                    "Right where hardly any values are equal. Where more than half are, the robust standard deviation is 0, and only what "
                    "lies at the median itself is within a limit of 0 (or all may stay):",
                ),
                (
                    functools.partial(spoiled, factor=4.0, nearest=(1.006, -0.994)),
                    KeptOrNot(),
                    "Right where no value is near the limit. Where some lie within a percent of it (is it 1.4826, to three digits?):",
                ),
                (
                    functools.partial(spoiled, factor=4.0, size=1e-4),
                    KeptOrNot(),
                    "Right where the values scatter by about 1. Where they scatter by a ten thousandth of that:",
                ),
                (
                    functools.partial(spoiled, factor=0.8, size=1e3),
                    KeptOrNot(),
                    "Right for factors of 3 and more. For one below 1, and values that scatter by a thousand:",
                ),
                (
                    three_values,
                    KeptOrNot(),
                    "Right for many values. For three, two close together and one far away:",
                ),
                (one_value, KeptOrNot(), "Right for many values. For one alone, which is its own median:"),
            ),
            properties=(default_is("factor", 4.0),),
            hints=(
                "Measure how far each value is from the middle, in units of a spread. Outliers must move neither of the two.",
                "Middle: the median. Spread: 1.4826 times the median of the distances from it; for normal noise that is a standard deviation.",
                "`d = np.abs(values - np.median(values))\nreturn d <= factor * 1.4826 * np.median(d)`",
            ),
            mistakes=[
                *(
                    Mistake(
                        _keep(middle, np.std),
                        "The standard deviation, like the mean, is moved by the very values you want to find: the nonsense hides itself. Take the "
                        "median, and 1.4826 times the median distance.",
                    )
                    for middle in (np.mean, np.median)
                ),
                Mistake(
                    lambda v, f: np.abs(v) <= f * 1.4826 * np.median(np.abs(v)),
                    "You measure the values themselves, from 0. Subtract the median first.",
                ),
                Mistake(
                    _keep(np.median, lambda v: 1.4826 * np.abs(v - np.median(v)).mean()),
                    "You took 1.4826 times the mean of the distances. Gross values blow it up; take their median.",
                ),
                Mistake(
                    _keep(np.median, lambda v: 1.4826 * np.median(np.abs(v - v.mean()))),
                    "The distances inside the spread are taken from the mean, which gross values move: take them from the median.",
                    id="reject_outliers-mean-inside",
                ),
                Mistake(
                    _keep(np.median, _mad),
                    "The factor 1.4826 is missing: the median distance is only 0.67 standard deviations.",
                ),
                Mistake(
                    _keep(np.median, lambda v: np.abs(v - np.median(v)).mean()),
                    "You took the mean of the distances. Gross values blow it up; take their median.",
                ),
                Mistake(lambda v, f: ~reject_outliers(v, f), "True means keep: your answer is the opposite."),
                *(
                    Mistake(
                        _keep(np.mean, scale),
                        "The mean is moved by the nonsense: measure the distances from the median.",
                    )
                    for scale in (
                        lambda v: 1.4826 * _mad(v),
                        lambda v: 1.4826 * np.median(np.abs(v - v.mean())),
                    )
                ),
                Mistake(
                    _keep(np.median, lambda v: _mad(v) / 1.4826),
                    "Your limit is about half as wide as that of the rule. It takes the median of the distances, no smaller part of them, and multiplies it by "
                    "1.4826; perhaps you divided.",
                ),
                Mistake(
                    lambda v, f: reject_outliers(v, 1.0),
                    "You allow one standard deviation. How many they are, `factor` says.",
                    id="reject_outliers-013298",
                ),
                *(
                    Mistake(
                        lambda v, f, fixed=fixed: reject_outliers(v, fixed),
                        "You use a number of your own in place of `factor`: the caller chooses it.",
                    )
                    for fixed in (4.0, 3.0)
                ),
                Mistake(
                    _keep(np.median, lambda v: 1.0),
                    "You compare distances with `factor` itself. It counts standard deviations: multiply it by the robust one.",
                ),
                Mistake(
                    lambda v, f: v[reject_outliers(v, f)],
                    "You return the values that stay. Wanted is True or False for each value.",
                ),
                *(
                    Mistake(variant, "You return indices. Wanted is True or False for each value.")
                    for variant in (
                        lambda v, f: np.flatnonzero(reject_outliers(v, f)),
                        lambda v, f: np.flatnonzero(~reject_outliers(v, f)),
                    )
                ),
                Mistake(
                    _refused_again,
                    "You apply the rule again to what it has kept, until nothing more goes: each time it has another limit, and good "
                    "values may go as well. It is applied once.",
                    id="reject_outliers-again",
                ),
                Mistake(
                    _tukey,
                    "This is the rule of a box plot, 1.5 times the quartile distance. It knows no `factor`; take the median distance.",
                ),
                Mistake(
                    _keep(np.median, lambda v: 1.4826 * _mad(v), above=True),
                    "Values far below the middle pass: take the absolute value of the distance.",
                ),
            ],
        ),
        *beyond.STOPS,
        Value(
            "mounting",
            reference=_mounting,
            unit="mm",
            metric=metrics.Poses(0.002, 0.02),
            hints=(
                "Put your own functions in a row: blocks, rotation, translation. A pose that `kept` excludes must not take part.",
                "A_kept, B_kept = A[kept][1:], B[kept][1:] are the motions that take part: kept poses, without the reference itself. A kron_row of each motion, stacked; then the rotation, then the translation; both go into a 4x4 identity.",
                "`A_kept, B_kept = A[kept][1:], B[kept][1:]\n"
                "M = np.concatenate([kron_row(a[:3, :3], b[:3, :3]) for a, b in zip(A_kept, B_kept)])\n"
                "R = rotation_from_nullvector(M)\n"
                "mounting = np.eye(4)\n"
                "mounting[:3, :3] = R\n"
                "mounting[:3, 3] = translation_lsq(A_kept, B_kept, R)`",
            ),
            mistakes=[
                Mistake(
                    lambda: _mounting(gate=1e9),
                    "The stop at which the tracker talked nonsense is still in: leave out what `kept` excludes.",
                ),
                Mistake(
                    lambda: simulation.T_FE,
                    "This is the truth that the simulation started from. Asked for is what the readings say, which is something else: they err.",
                ),
                Mistake(
                    _maximum_likelihood,
                    "This is the maximum likelihood solution, which comes later. Here the report's method is asked for: your own three functions.",
                ),
                Mistake(
                    _aligned,
                    "This comes out where the axes of the motions are aligned, by `align_vectors` for instance: a good route with other weights, 0.004 deg away. Asked for is what your `rotation_from_nullvector` and `translation_lsq` give.",
                    id="mounting-aligned",
                ),
                Mistake(
                    lambda: _mounting(R=np.eye(3)) @ pose(_mounting()[:3, :3], np.zeros(3)),
                    "The rotation is right. The translation comes out so with the identity for R: `translation_lsq` needs the R just found.",
                    id="mounting-identity",
                ),
                Mistake(
                    _from_pose_to_pose,
                    "This comes out of the motions from each pose to the next. The report takes all from pose 0, as `A` and `B` are.",
                    id="mounting-f9cf46",
                ),
                Mistake(
                    lambda: _of_motions(lambda kept: np.isin(np.arange(len(kept)), np.arange(1, 5))),
                    "These are the first four motions alone. All that `kept` leaves in should take part.",
                    id="mounting-first-four",
                ),
                Mistake(lambda: invert(_mounting()), "This is the flange seen from the tracker: the inverse."),
                Mistake(
                    _against_the_readings,
                    "A and B have changed places: A is what the flange did, B what the tracker saw.",
                ),
                Mistake(
                    lambda: pose(_mounting()[:3, :3], _mounting()[:3, 3] / 1000),
                    "The translation is in meters; wanted are mm.",
                ),
                Mistake(
                    lambda: _mounting(gate=1e9, R=_mounting()[:3, :3]),
                    "The rotation is right. For the translation the stop that `kept` excludes is still in.",
                ),
                Mistake(
                    lambda: _mounting(R=_mounting(gate=1e9)[:3, :3]),
                    "The translation leaves out what `kept` excludes. For the rotation that stop is still in.",
                ),
                Mistake(
                    _from_the_poses,
                    "This comes out of the poses themselves. A X = X B holds for motions, `A` and `B`: the tracker's poses stand in a frame of its own.",
                    id="mounting-e9d6a5",
                ),
            ],
        ),
        Value(
            "spread",
            reference=lambda: _heights().std(),
            unit="mm",
            rtol=1e-2,
            of={"the six heights": _heights},
            hints=(
                "Six numbers, the z of each mounting. Appendix D prints their variance (Rozptyl), divided by 6.",
                "The standard deviation is the root of that variance.",
                "`spread = mountings[:, 2, 3].std()`",
            ),
            mistakes=[
                Mistake(
                    lambda: _heights().std(ddof=1),
                    "Here the sum is divided by 5. For estimating a spread that is the better choice; appendix D divides by 6.",
                    id="spread-196c75",
                ),
                Mistake(lambda: _heights().var(), "This is the variance, in square millimeters. Its root is wanted."),
                Mistake(
                    lambda: np.std([np.linalg.norm(m.T_FE[:3, 3]) for m in synthetic_mountings()]),
                    "This is the scatter of the distances from the flange. Asked for is that of their height z, `mountings[:, 2, 3]`.",
                    id="spread-distance",
                ),
                Mistake(
                    lambda: _heights().var(ddof=1),
                    "This is a variance, in square millimeters, and divided by 5. Divide by 6 and take the root.",
                ),
                Mistake(
                    lambda: _heights().mean(), "This is the mean height. Wanted is how far the six scatter about it."
                ),
                *(
                    Mistake(
                        lambda axis=axis: np.std([m.T_FE[axis, 3] for m in synthetic_mountings()]),
                        "This is the spread of another coordinate. The height z is `mountings[:, 2, 3]`.",
                    )
                    for axis in (0, 1)
                ),
                Mistake(
                    lambda: np.std([m.T_FE[:3, 3] for m in synthetic_mountings()]),
                    "This is the spread of the three coordinates together. The height z is `mountings[:, 2, 3]`.",
                    id="spread-41e48b",
                ),
                Mistake(
                    lambda: np.std([m.T_FE for m in synthetic_mountings()]),
                    "This is the spread of all entries of all matrices together. The height z is `mountings[:, 2, 3]`.",
                    id="spread-25cc36",
                ),
                Mistake(
                    lambda: np.abs(_heights() - _heights().mean()).mean(),
                    "This is the mean distance from the mean. A standard deviation is the root of the mean square.",
                    id="spread-mean-distance",
                ),
                Mistake(
                    lambda: np.sqrt(np.mean((_heights() - simulation.T_FE[2, 3]) ** 2)),
                    "This is the scatter about the true height, so that what all six err alike counts as well. A standard deviation is taken about "
                    "their own mean.",
                    id="spread-about-truth",
                ),
                Mistake(
                    lambda: np.ptp(_heights()),
                    "This is the range from the lowest to the highest. Wanted is the standard deviation.",
                ),
                Mistake(
                    lambda: _heights().std() / np.sqrt(6),
                    "This is the standard error of the mean. Wanted is the spread of single runs.",
                ),
                Mistake(
                    lambda: np.sqrt(np.sum([np.var([m.T_FE[k, 3] for m in synthetic_mountings()]) for k in range(3)])),
                    "This is the spread in space, all three coordinates. The height z alone is `mountings[:, 2, 3]`.",
                    id="spread-space",
                ),
                Mistake(
                    lambda: np.sqrt(np.mean((_heights() - _heights()[0]) ** 2)),
                    "This is the spread about the first run. A standard deviation is taken about the mean of the six.",
                    id="spread-first",
                ),
                Mistake(
                    lambda: np.std([m.T_FE[2, 2] for m in synthetic_mountings()]),
                    "This is an entry of the rotation, `[2, 2]` of each mounting. The height z is `mountings[:, 2, 3]`.",
                    id="spread-rotation",
                ),
                Mistake(
                    lambda: 0.0,
                    "All six have the same number there, as in the last row of a pose. The height z is `mountings[:, 2, 3]`.",
                    id="spread-last-row",
                ),
                Mistake(
                    lambda: 1000 * np.sqrt(table_d().variance[2]),
                    "This is the spread of the report's runs. Wanted is that of the six in `mountings`.",
                ),
            ],
        ),
        Prediction(
            "runs",
            question="Six runs over the same 21 poses agree within 0.2 mm. How far from the truth is their mean?",
            choices=("about 0.1 mm, the spread over root 6", "about 0.2 mm, the spread", "the runs alone cannot tell"),
            answer="the runs alone cannot tell",
            why="An error that depends on the place repeats with the poses. Repeating shows the random part only; here the mean is off by more than 1 mm.",
        ),
        *beyond.STATIONS,
        Prediction(
            "methods",
            question="Rotations are noisy (0.5 deg), translations good (0.1 mm). Which way finds the mounting's rotation best?",
            choices=("from the rotations alone", "from rotations and translations at once", "both alike"),
            answer="from rotations and translations at once",
            why="Good translations at a distance know the rotation better than the rotations do, if both are weighed by their noise. Rotation first throws that away, and both at once without weights gets no closer.",
        ),
        Prediction(
            "turning",
            question="The robot turns the tracker at 3.7 rad/s, and the tracker lags 8 ms behind. How large is the error of the rotation (deg)? The report's mean is 1.",
            answer=1.696,
            unit="deg",
            within=0.05,
            why="3.7 rad/s times 0.008 s = 0.0296 rad = 1.7 deg. A rotation lags like a position, by its own speed.",
        ),
        Prediction(
            "motion",
            question="A robot moves at 1.4 m/s and the tracker lags 8 ms behind. How large is the error of the position (mm)? The report found 15.",
            answer=11.2,
            unit="mm",
            within=0.05,
            why="1400 mm/s times 0.008 s = 11.2 mm: accuracy in motion is a matter of time first. But such an error shrinks with the speed, and the report's does not.",
        ),
        Exercise(
            "time_offset",
            reference=time_offset,
            draw=tuple(functools.partial(speed_curves, sign=s, wide=wide) for wide in (False, True) for s in (1, -1)),
            metric=metrics.Numbers(6e-4, "s"),
            noisy=(
                (
                    curves_in_degrees,
                    metrics.Numbers(6e-4, "s"),
                    "Right for lags of several samples and speeds about 1. For a part of a single sample, and speeds of many deg/s:",
                ),
                (
                    periodic_curves,
                    metrics.Numbers(6e-4, "s"),
                    "Right where the curves match at one shift. Where they repeat, and match at one within max_offset and at another beyond it:",
                ),
                *(
                    (
                        functools.partial(curves_at_the_limit, sign=sign),
                        AT_THE_LIMIT,
                        f"Right for offsets well within max_offset. For a tracker that {does} by nearly as much:",
                    )
                    for sign, does in ((-1, "leads"), (1, "lags"))
                ),
                (
                    noisy_curves,
                    metrics.Numbers(0.2, "s"),
                    "Right on clean curves. On noisy ones that are shifted by up to a third of their length, where the shifts differ in how many samples overlap:",
                ),
            ),
            properties=(default_is("max_offset", 0.2),),
            hints=(
                "Shift one curve against the other, sample by sample, and find where they differ least. Then look between the samples.",
                "Cost of a shift s: mean of (delayed[k + s] - reference[k])^2 over the common part. A parabola through the best three has its vertex at the offset.",
                "`step = time[1] - time[0]\n"
                "n = round(max_offset / step)\n"
                "core = reference[n:-n]\n"
                "cost = [np.mean((delayed[n + s : len(time) - n + s] - core) ** 2) for s in range(-n, n + 1)]\n"
                "k = np.clip(np.argmin(cost), 1, 2 * n - 1)\n"
                "l, m, r = cost[k - 1 : k + 2]\n"
                "return (k - n + 0.5 * (l - r) / (l - 2 * m + r)) * step`",
            ),
            mistakes=[
                Mistake(
                    lambda time, reference, delayed, max_offset: time[np.argmax(delayed)] - time[np.argmax(reference)],
                    "You compare the times of two largest values. Each curve has many like it, and noise decides which is the largest: "
                    "compare the curves as a whole.",
                    id="time_offset-peaks",
                ),
                Mistake(
                    lambda time, reference, delayed, max_offset: (
                        time_offset(time, reference, delayed, max_offset) * 0.004 / (time[1] - time[0])
                    ),
                    "You take 4 ms from sample to sample. How far apart the samples are, `time` tells.",
                    id="time_offset-4-ms",
                ),
                Mistake(
                    lambda *a: -time_offset(*a),
                    "The sign is reversed: positive means that the tracker lags behind.",
                ),
                Mistake(
                    _whole_samples,
                    "You stop at whole samples. At 1 m/s half a sample of 10 ms is 5 mm: fit a parabola through the best three.",
                ),
                Mistake(
                    lambda t, *a: time_offset(t, *a) / (t[1] - t[0]),
                    "Your answer counts samples. Multiply by the time between samples.",
                ),
                Mistake(lambda *a: 1000 * time_offset(*a), "Your answer is in milliseconds; wanted are seconds."),
                Mistake(
                    lambda t, r, d, m: 2 * _whole_samples(t, r, d, m) - time_offset(t, r, d, m),
                    "The fraction has the wrong sign: the vertex lies toward the smaller of the two neighbors.",
                ),
                *(
                    Mistake(
                        _least(_around, between),
                        "The end of the curve comes back in at its beginning, as by `np.roll` or an FFT. Compare only the part both curves share.",
                        id=f"time_offset-af621c{also}",
                    )
                    for between, also in ((True, ""), (False, "-2"))
                ),
                *(
                    Mistake(
                        _least(costs, between),
                        "Your offset is 0, or pulled toward it. A sum of products does that (`np.correlate`): it counts how many samples overlap as "
                        "well as how alike they are. Take the mean of the squared differences over the part both curves share.",
                    )
                    for costs in (_overlap, _centered_overlap)
                    for between in (True, False)
                ),
                Mistake(
                    _least(_sum_of_squares, True),
                    "A sum of squares is smaller where fewer samples overlap, so that noise draws it to the largest shifts. Take their mean.",
                    id="time_offset-sum-of-squares",
                ),
                *(
                    Mistake(
                        lambda t, r, d, m, between=between: -_least(_centered_overlap, between)(t, r, d, m),
                        "You correlate, with the sign reversed: positive means that the tracker lags behind. And a sum of products pulls its peak "
                        "toward 0: take the mean of the squared differences over the part both curves share.",
                    )
                    for between in (True, False)
                ),
                *(
                    Mistake(
                        _least(_products, between),
                        "A sum of products also grows with the speeds that a shift brings in, so its peak is pulled aside. Take the mean of the "
                        "squared differences.",
                    )
                    for between in (True, False)
                ),
                Mistake(
                    lambda *a: abs(time_offset(*a)),
                    "No absolute value: a tracker that leads has a negative offset.",
                ),
                Mistake(
                    _least(_distances, True),
                    "The mean of absolute differences has a corner at its least, the root of the mean of squares as well, and a parabola fits no "
                    "corner: the result is off by a part of a sample. Take the mean of the squares, without a root.",
                    id="time_offset-6fe11a",
                ),
                Mistake(
                    lambda t, r, d, m: time_offset(t, r, d, m) + m,
                    "You count the shifts from the first one tried. That is -max_offset, not 0.",
                ),
                Mistake(
                    lambda t, r, d, m: 2 * time_offset(t, r, d, m) - _whole_samples(t, r, d, m),
                    "The fraction is twice too large: the vertex is at 0.5 * (l - r) / (l - 2 m + r).",
                ),
                *(
                    Mistake(
                        _least(_forward_only, between),
                        "You try shifts in one direction only. The tracker may also lead: from -max_offset to max_offset.",
                    )
                    for between in (True, False)
                ),
                Mistake(
                    lambda *given: max(0.0, _least(_forward_only, True)(*given)),
                    "You try shifts in one direction only. The tracker may also lead: from -max_offset to max_offset.",
                ),
                Mistake(
                    _least(_plain_differences, False),
                    "Differences of both signs cancel in a mean. Square them, or take absolute values.",
                ),
            ],
        ),
        *beyond.SPEEDS,
        *beyond.CELL,
    ],
    further=(
        "e_rot",
        "e_trans",
        "mean_quaternion",
        "sweep",
        "ray_direction",
        "nearest_to_rays",
        "moved",
        "knock",
        "methods",
        "time_offset",
        "tempo",
        "static_error_and_lag",
        "moved_part",
        "touch",
        "returns",
        "point_covariance",
        "shares",
        "halved",
    ),
)
