"""Chapter 2: chained transforms, the closure error of a loop, and what to do with it."""

import functools

import numpy as np

from ...documents.lab_sheet import printed as lab_sheet
from ...exercises import metrics
from ...exercises.engine import Chapter, Exercise, Prediction
from ...exercises.outcome import Mistake
from ...exercises.special import right_where
from ...exercises.value import Value
from ...geometry import chaining, frames
from ...geometry.lie import exp_se3, exp_so3, log_se3, nearest_rotation
from . import beyond, special


def random_pose(rng):
    """A random pose with its origin some millimeters or some hundred away."""
    away = rng.uniform(-400, 400, 3) * 10.0 ** rng.uniform(-2, 0)
    return frames.pose(frames.matrix_from_quaternion(rng.normal(size=4)), away)


def random_links(rng, count):
    """Random transforms, stacked."""
    return (np.array([random_pose(rng) for _ in range(count)]),)


def links_nearly_along_the_axes(rng):
    """Transforms that turn by less than a thousandth, or by a quarter turn more: small entries count."""
    turns = exp_so3(rng.uniform(1e-4, 3e-4, (3, 3))) @ exp_so3(np.pi / 2 * np.eye(3)[rng.integers(3)])
    return (frames.pose(turns, rng.uniform(-300, 300, (3, 3))),)


def loop_product(rng, between_deg):
    """The product of a loop that misses itself by some degrees or by many, and by millimeters."""
    turn = frames.unit_vector(rng.normal(size=3)) * np.deg2rad(rng.uniform(*between_deg))
    return (exp_se3(np.concatenate([turn, rng.uniform(0.5, 20) * rng.normal(size=3)])),)


def no_turn(rng):
    """No turn at all, but for rounding that makes (trace - 1) / 2 a hair more than 1, as in T @ inv(T), and half the
    root of 1 + trace as well."""
    T = frames.pose(np.eye(3), rng.normal(size=3))
    T[range(3), range(3)] += 2**-50
    return (T,)


def half_turn(rng):
    """Half a turn about one of the axes, where the sine is 0 to the last bit, and a shift."""
    return (frames.pose(np.diag(rng.permutation([1.0, -1.0, -1.0])), rng.uniform(-20, 20, 3)),)


TINY = (0.01, 0.05)  # deg: a cosine of 1 but for its seventh digit
SMALL, LARGE = (2, 8), (100, 170)  # deg: a sine is no longer its angle, and two angles have the same one
ONE_POSE = "one pose is one 4x4 matrix"


def worn_pose(rng, defects=(0.02, 0.06)):
    """A pose whose rotation block has lost its right angles."""
    T = random_pose(rng)
    T[:3, :3] += rng.uniform(*defects) * rng.normal(size=(3, 3))
    return (T,)


def stretched_pose(rng):
    """A pose whose rotation block is far from one: each of its singular values rounds to another number than 1."""
    T = random_pose(rng)
    T[:3, :3] = T[:3, :3] @ frames.matrix_from_quaternion(rng.normal(size=4)) * rng.permutation([0.4, 1.7, 2.6])
    T[:3, :3] = T[:3, :3] @ frames.matrix_from_quaternion(rng.normal(size=4))
    return (T,)


def open_loop(rng, count):
    """Links of a loop of `count` frames that does not quite close."""
    links = random_links(rng, count)[0]
    links[-1] = frames.relative(chaining.stations(links)[-2], np.eye(4))
    return (links @ exp_se3(rng.normal(size=(len(links), 6)) * np.repeat([0.02, 2.0], 3)),)


def gap_of_one_kind(rng, turn, shift):
    """Links of a loop that ends turned where it began, or unturned beside it."""
    links = random_links(rng, 4)[0]
    links[-1] = frames.relative(chaining.stations(links)[-2], np.eye(4))
    gap = np.concatenate([turn * rng.normal(size=3), shift * rng.normal(size=3)])
    links[0] = exp_se3(gap) @ links[0]
    return (links,)


def closed_loop(rng):
    """Whole quarter turns and whole millimeters that lead back to the last bit: there is nothing to share out."""
    quarter = frames.pose(np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), rng.integers(-90, 90, 3).astype(float))
    to_and_fro = np.array([quarter, frames.pose(np.eye(3), rng.integers(-90, 90, 3).astype(float))])
    return (np.concatenate([to_and_fro, [frames.invert(T) for T in to_and_fro[::-1]]]),)


def chain(transforms):
    """Reference of the exercise: the library's product, and I of no links at all, where a loop over them begins."""
    return chaining.chain(transforms) if len(transforms) else np.eye(4)


# Wrong variants --------------------------------------------------------------------------------------------------------


def _blocks_apart(transforms):
    """Rotations multiplied, translations merely added."""
    T = chaining.chain(transforms)
    T[:3, 3] = transforms[:, :3, 3].sum(0)
    return T


def _turned_too_far(transforms):
    """Each translation turned by its own link as well."""
    T = np.eye(4)
    for link in transforms:
        T[:3, :3] = T[:3, :3] @ link[:3, :3]
        T[:3, 3] += T[:3, :3] @ link[:3, 3]
    return T


def _from(start):
    """A chain that begins with something else than the identity."""
    return lambda transforms: start @ chaining.chain(transforms)


def _twists_added(transforms):
    return exp_se3(log_se3(transforms).sum(axis=0))


def _elementwise(transforms):
    T = np.ones((4, 4))
    for link in transforms:
        T = T * link
    return T


def _closure(angle, distance=None):
    """A variant of closure_error with another angle, or distance."""

    def variant(T):
        right = chaining.closure_error(T)
        return (angle or (lambda T: right[0]))(T), (distance or (lambda T: right[1]))(T)

    return variant


def _distance(distance):
    return _closure(None, distance)


def _twice_sine(T):
    R = T[:3, :3]
    return np.linalg.norm([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])


def _arccos(cosine, clipped):
    """The angle by an arccosine of something else than (trace - 1) / 2."""

    def angle(T):
        value = cosine(T)
        return np.arccos(np.clip(value, -1, 1) if clipped else value)

    return _closure(angle)


def _with_rotation(T, R):
    T = T.copy()
    T[:3, :3] = R
    return T


def _columns_normalized(T):
    R = T[:3, :3]
    return _with_rotation(T, R / np.linalg.norm(R, axis=0))


def _normalized_first(axis):
    """The rotation nearest to the columns (axis 0) or rows (axis 1) at length 1."""

    def variant(T):
        R = T[:3, :3]
        U, _, Vt = np.linalg.svd(R / np.linalg.norm(R, axis=axis, keepdims=True))
        return _with_rotation(T, U @ Vt)

    return variant


def _rows_normalized(T):
    R = T[:3, :3]
    return _with_rotation(T, R / np.linalg.norm(R, axis=1, keepdims=True))


def _gram_schmidt(first, second):
    """Right angles from two columns, in another order than x, y."""

    def variant(T):
        R = np.empty((3, 3))
        R[:, [first, second, 3 - first - second]] = frames.gram_schmidt(T[:3, first], T[:3, second])
        R[:, 3 - first - second] *= np.sign(np.linalg.det(R))
        return _with_rotation(T, R)

    return variant


def _through_angles(B):
    """The rotation whose angles A, B, C stand in the entries of which they are read; B in one of several ways."""

    def variant(T):
        R = T[:3, :3]
        abc = [np.arctan2(R[1, 0], R[0, 0]), B(R), np.arctan2(R[2, 1], R[2, 2])]
        return frames.matrix_from_kuka(np.concatenate([T[:3, 3], abc]))

    return variant


READINGS_OF_B = {  # by the row, by the column, by the sine alone
    "angles": lambda R: np.arctan2(-R[2, 0], np.hypot(R[2, 1], R[2, 2])),
    "angles-of-the-column": lambda R: np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0])),
    "angles-by-arcsine": lambda R: np.arcsin(np.clip(-R[2, 0], -1, 1)),
}


def _through_quaternion(T):
    """The rotation of the quaternion that trace and skew part of a rotation would have."""
    R = T[:3, :3]
    vector = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return _with_rotation(T, frames.matrix_from_quaternion([*vector, 1 + np.trace(R)]))


def _not_the_nearest(X, T):
    """Whether the block of X is a rotation, but a nearer one is that of the reference, in words."""
    R, own = T[:3, :3], X[:3, :3]
    off, least = (np.linalg.norm(block - R) for block in (own, nearest_rotation(R)))
    if np.abs(own.T @ own - np.eye(3)).max() > 1e-6 or np.linalg.det(own) < 0 or off <= (1 + 1e-9) * least:
        return None
    return "Your block is a rotation, but another one is nearer to that of T: the squares of its differences have a smaller sum."


def _whether_it_closes(links, transforms):
    """Whether the corrected links lead back to their start, in words."""
    if np.allclose(chaining.chain(links), np.eye(4), atol=1e-5):
        return "The loop of your links closes, but not with the poses exp(-k/N xi) P_k on the way."
    return "The loop of your links does not close: their product is not I."


def _one_step(T):
    """One step of Newton's iteration, the mean of R and its inverse transposed."""
    return _with_rotation(T, (T[:3, :3] + np.linalg.inv(T[:3, :3]).T) / 2)


def _svd_variant(rule):
    def variant(T):
        U, s, Vt = np.linalg.svd(T[:3, :3])
        return _with_rotation(T, rule(U, s, Vt))

    return variant


def _whole_matrix(T):
    U, _, Vt = np.linalg.svd(T)
    return U @ Vt


def _parts(transforms):
    """Links, the poses after 0, 1, ... N links, the twist of the product, and N."""
    poses = chaining.stations(transforms)
    return poses, log_se3(poses[-1]), len(transforms)


def _all_in_the_last(transforms):
    links = transforms.copy()
    links[-1] = links[-1] @ frames.invert(chaining.chain(transforms))
    return links


def _all_in_the_first(transforms):
    links = transforms.copy()
    links[0] = frames.invert(chaining.chain(transforms)) @ links[0]
    return links


def _appended_to_each(transforms, sign=-1):
    _, xi, n = _parts(transforms)
    return transforms @ exp_se3(sign * xi / n)


def _prepended_to_each(transforms, sign=-1):
    _, xi, n = _parts(transforms)
    return exp_se3(sign * xi / n) @ transforms


def _links_moved(first, left=True):
    """The links, not the poses, moved by shares that grow from `first`."""

    def variant(transforms):
        _, xi, n = _parts(transforms)
        moves = exp_se3(-np.arange(first, first + n)[:, None] / n * xi)
        return moves @ transforms if left else transforms @ moves

    return variant


def _twists_subtracted(transforms):
    _, xi, n = _parts(transforms)
    return exp_se3(log_se3(transforms) - xi / n)


def _moved(poses, moves):
    """Links between poses that have been moved."""
    moved = moves @ poses
    return frames.relative(moved[:-1], moved[1:])


def _equal_moves(transforms):
    poses, xi, n = _parts(transforms)
    return _moved(poses, exp_se3(-np.repeat([[0], [1 / n]], [1, n], axis=0) * xi))


def _forward_instead_of_back(transforms):
    poses, xi, n = _parts(transforms)
    return _moved(poses, exp_se3(np.arange(n + 1)[:, None] / n * xi))


def _by_length(transforms):
    """Shares in proportion to the lengths of the links."""
    poses, xi, _ = _parts(transforms)
    lengths = np.linalg.norm(np.asarray(transforms)[:, :3, 3], axis=1)
    shares = np.append(0.0, np.cumsum(lengths) / lengths.sum())
    return _moved(poses, exp_se3(-shares[:, None] * xi))


def _divided_by(number):
    """k / number(N) in place of k / N."""

    def variant(transforms):
        poses, xi, n = _parts(transforms)
        return _moved(poses, exp_se3(-np.arange(n + 1)[:, None] / number(n) * xi))

    return variant


def _between(rule):
    """Another rule than the relative pose for the link between two corrected poses."""
    return lambda transforms: rule(_moved_poses(transforms)[:-1], _moved_poses(transforms)[1:])


def _rotation_only(transforms):
    poses, xi, n = _parts(transforms)
    return _moved(poses, exp_se3(-np.arange(n + 1)[:, None] / n * xi * np.repeat([1, 0], 3)))


def _turn_and_shift_apart(transforms, from_twist=False):
    """Rotation and translation shared out each for itself: of the poses, or of the twist."""
    poses, xi, n = _parts(transforms)
    if from_twist:
        moves = exp_se3(-np.arange(n + 1)[:, None] / n * xi)
        moves[:, :3, 3] = -np.arange(n + 1)[:, None] / n * xi[3:]
        return _moved(poses, moves)
    moved = exp_se3(-np.arange(n + 1)[:, None] / n * xi * np.repeat([1, 0], 3)) @ poses
    moved[:, :3, 3] = poses[:, :3, 3] - np.arange(n + 1)[:, None] / n * poses[-1, :3, 3]
    return frames.relative(moved[:-1], moved[1:])


def _gap_shared_apart(transforms):
    """The way back to the start, its turn and its straight line in N parts each, taken to the poses from the left."""
    poses, _, n = _parts(transforms)
    gap = frames.invert(poses[-1])
    moves = exp_se3(np.arange(n + 1)[:, None] / n * log_se3(gap) * np.repeat([1, 0], 3))
    moves[:, :3, 3] = np.arange(n + 1)[:, None] / n * gap[:3, 3]
    return _moved(poses, moves)


def _way_shared_apart(transforms):
    """The way to the end, its turn and its straight line in N parts each, taken back from the poses from the left."""
    poses, xi, n = _parts(transforms)
    ways = exp_se3(np.arange(n + 1)[:, None] / n * xi * np.repeat([1, 0], 3))
    ways[:, :3, 3] = np.arange(n + 1)[:, None] / n * poses[-1, :3, 3]
    return _moved(poses, frames.invert(ways))


def _translation_from_links(transforms):
    links = transforms.copy()
    links[:, :3, 3] -= chaining.chain(transforms)[:3, 3] / len(links)
    return links


def _translation_only(transforms):
    poses, _, n = _parts(transforms)
    moves = np.tile(np.eye(4), (n + 1, 1, 1))
    moves[:, :3, 3] = -np.arange(n + 1)[:, None] / n * poses[-1][:3, 3]
    return _moved(poses, moves)


def _share_on_the_right(transforms):
    poses, xi, n = _parts(transforms)
    moved = poses @ exp_se3(-np.arange(n + 1)[:, None] / n * xi)
    return frames.relative(moved[:-1], moved[1:])


def _moved_poses(transforms):
    poses, xi, n = _parts(transforms)
    return exp_se3(-np.arange(n + 1)[:, None] / n * xi) @ poses


def _sheet():
    return chaining.chain(lab_sheet.printed_transforms())


def _lever(T, unit=lambda angle: angle):
    """Distance from the axis at which the turn of T moves a point as far as T moves the origin."""
    angle, distance = chaining.closure_error(T)
    return float(distance / unit(angle))


def _turn_by_arccosine():
    return np.arccos((np.trace(_sheet()[:3, :3]) - 1) / 2)


def _of_either_angle(value, text, id, within=0.0):
    """Mistakes value(angle, distance), the angle by arctan2 and by the arccosine: of the rounded entries these differ."""

    def variant(angle):
        return lambda: float(value(angle(), chaining.closure_error(_sheet())[1]))

    angles = ((lambda: chaining.closure_error(_sheet())[0], id), (_turn_by_arccosine, f"{id}-by-arccosine"))
    return [Mistake(variant(angle), text, name, within) for angle, name in angles]


def _of_one_link(number):
    """Levers of one link alone, of the printed ones and of those from the points."""
    word = ("first", "second", "third", "fourth")[number]
    text = f"This is the {word} link alone. The closure error belongs to the product of all four."
    printed, measured = lab_sheet.printed_transforms, _links_from_points
    return [
        Mistake(lambda: _lever(printed()[number]), text, id=f"lever-{word}-link"),
        Mistake(lambda: _lever(measured()[number]), text, id=f"lever-{word}-link-measured"),
    ]


@functools.cache
def _links_from_points():
    return chaining.transforms_from_points(lab_sheet.station_points())


def _turn_of_loop():
    return np.linalg.norm(log_se3(_sheet())[:3])


@functools.cache
def _shift_across_the_axis():
    """The part (mm) of the loop's shift that is perpendicular to the axis of its turn."""
    T = _sheet()
    twice_sine = T[:3, :3] - T[:3, :3].T
    axis = np.array([twice_sine[2, 1], twice_sine[0, 2], twice_sine[1, 0]])
    return np.linalg.norm(np.cross(axis / np.linalg.norm(axis), T[:3, 3]))


def _worst_at_one_meter():
    """Largest displacement of a point 1000 mm from the origin of K0, over directions 1.3 deg apart (mm)."""
    k = np.arange(20_000) + 0.5
    height, turn = 1 - k / 10_000, np.pi * (1 + 5**0.5) * k  # a spiral from pole to pole
    flat = np.sqrt(1 - height**2)
    points = 1000 * np.column_stack([flat * np.cos(turn), flat * np.sin(turn), height])
    return float(chaining.displacement(_sheet(), points).max())


CLOSURE = metrics.Several(metrics.Angles(1e-7), metrics.Numbers(1e-9, "mm"), names=("angle", "distance"))

CHAPTER = Chapter(
    "02-chaining",
    title="Chaining and closing the loop",
    items=[
        Prediction(
            "order",
            question="Move A shifts and turns, move B only shifts. Does the order of the two matter?",
            choices=("no, shifts can be exchanged", "yes, one turn is enough", "only if both turn"),
            answer="yes, one turn is enough",
            why="B is made in the frame that A has reached. One turn is enough to send it in another direction (only a shift along "
            "the axis of the turn would not mind).",
        ),
        Prediction(
            "operator",
            question="The sheet writes the sum of the transforms, and prints one result. Which of the two did its program compute?",
            choices=("the sum", "the product", "neither"),
            answer="the product",
            why="Each row of the 3x3 block has length 1, as in a rotation; the sum of four rotations almost never has. The row left out "
            "settles it: it ends in 1, where the sum has a 4. Listing 6 multiplies (`T *= myT`).",
        ),
        Exercise(
            "chain",
            reference=chain,
            sizes=("transforms",),
            draw=tuple(functools.partial(random_links, count=n) for n in (3, 2, 9, 4, 6)),
            metric=metrics.Poses(1e-6, 1e-6),
            noisy=(
                (
                    functools.partial(random_links, count=1),
                    metrics.Poses(1e-6, 1e-6),
                    "right, but not for a single link:",
                ),
                (
                    links_nearly_along_the_axes,
                    metrics.Poses(1e-6, 1e-6),
                    "right, but not where the links lie nearly along the axes of one another, but for less than a thousandth:",
                ),
            ),
            properties=(right_where(chain, metrics.Poses(1e-6, 1e-6), *special.CHAINS),),
            hints=(
                "Neighboring letters cancel: T_AB T_BC T_CD = T_AD. Where does a link that has just been measured go, to the left or to the right?",
                "Start with the identity and multiply each link from the right, in the order given: a loop over the links that keeps the product.",
                "`T = np.eye(4)\nfor link in transforms:\n    T = T @ link\nreturn T`",
            ),
            mistakes=[
                Mistake(
                    lambda Ts: np.sum(Ts, axis=0),
                    "You added the matrices, as the sheet's sum sign says. The last row became 0 0 0 N: a chain of moves is a product.",
                ),
                Mistake(
                    lambda Ts: chaining.chain(Ts[::-1]),
                    "This is the product in the reverse order. In a loop over the links as they come, each new one goes to the right of what you have.",
                    id="chain-953c02",
                ),
                Mistake(
                    _elementwise,
                    "You multiplied entry by entry, as `*` and np.prod do. Matrices multiply with @.",
                    id="chain-88ac46",
                ),
                Mistake(
                    lambda Ts: np.eye(4) * _elementwise(Ts),
                    "You multiplied entry by entry, so that only the diagonal is left of the identity: `*` is not `@`.",
                ),
                Mistake(
                    lambda Ts: chaining.chain([frames.invert(T) for T in Ts]),
                    "This is the product of the inverted links. They come as T_01, T_12, ...: their letters meet as they are.",
                    id="chain-0effad",
                ),
                Mistake(
                    lambda Ts: chaining.chain(Ts[1:]),
                    "The first link is missing: start with the identity, or with the first link and go on from the second.",
                ),
                Mistake(
                    lambda Ts: chaining.chain(Ts[:-1]),
                    "The last link is missing from your product.",
                ),
                Mistake(
                    lambda Ts: Ts[-1] @ Ts[-1],
                    "This is the last link times itself. Have the loop variable and the product the same name? Give the product one of its own.",
                    id="chain-same-name",
                ),
                Mistake(
                    _blocks_apart,
                    "The rotations are multiplied, but the translations merely added. Each one has to be turned into the first frame: let the 4x4 product do it.",
                ),
                Mistake(
                    lambda Ts: np.eye(4),
                    "This is the identity: no product is kept. In a loop over the links, write T = T @ link.",
                    id="chain-87b725",
                ),
                Mistake(
                    lambda Ts: Ts[0],
                    "This is the first link alone: does `return` stand inside the loop?",
                ),
                Mistake(
                    lambda Ts: frames.invert(chaining.chain(Ts)),
                    "This is the inverse of the chain: T_N0 instead of T_0N.",
                    id="chain-417ee1",
                ),
                Mistake(
                    lambda Ts: chaining.chain(Ts).T,
                    "This is the transpose of the chain: the translation belongs in the last column.",
                ),
                Mistake(
                    _from(np.zeros((4, 4))),
                    "Every entry is 0, as in a product that starts with zeros: start with the identity, np.eye(4).",
                    id="chain-796a27",
                ),
                Mistake(
                    _from(np.ones((4, 4))),
                    "You started with ones everywhere. Start with the identity, np.eye(4).",
                ),
                Mistake(
                    lambda Ts: np.eye(4) + np.sum(Ts, axis=0),
                    "You added the matrices to the identity: a chain of moves is a product, T = T @ link.",
                ),
                Mistake(
                    lambda Ts: _from(Ts[0])(Ts),
                    "The first link is in your product twice: start with the identity, or go on from the second link.",
                ),
                Mistake(
                    lambda Ts: Ts[-1],
                    "This is the last link alone. In a loop over the links, T = T @ link keeps what came before.",
                    id="chain-eef2ea",
                ),
                Mistake(
                    lambda Ts: Ts[-2] @ Ts[-1],
                    "This is the product of the last two links alone. In a loop over the links, T = T @ link keeps what came before.",
                    id="chain-c5c121",
                ),
                Mistake(
                    lambda Ts: chaining.stations(Ts),
                    "These are the poses after 0, 1, ... N links. The chain is the last of them.",
                ),
                Mistake(
                    lambda Ts: chaining.stations(Ts)[1:],
                    "These are the poses after 1, 2, ... N links. The chain is the last of them.",
                ),
                Mistake(
                    _twists_added,
                    "You added the twists of the links. Twists of turns about different axes do not add up: multiply the matrices.",
                    id="chain-twists",
                ),
                Mistake(
                    _turned_too_far,
                    "The rotations are right, but you turned each translation by its own link too: add R @ p first, then go on to the new R.",
                ),
            ],
        ),
        Exercise(
            "closure_error",
            reference=chaining.closure_error,
            sizes=("T",),
            draw=tuple(functools.partial(loop_product, between_deg=between) for between in (SMALL, LARGE)),
            fixed={"T": ONE_POSE},
            metric=CLOSURE,
            noisy=[
                (lambda rng: (np.eye(4),), CLOSURE, "right, but not for the identity itself:"),
                (no_turn, CLOSURE, "right, but not where T does not turn at all:"),
                (
                    functools.partial(loop_product, between_deg=TINY),
                    CLOSURE,
                    "right, but not where T turns by very little:",
                ),
                (half_turn, CLOSURE, "right, but not where T is half a turn:"),
            ],
            properties=(right_where(chaining.closure_error, CLOSURE, *special.PRODUCTS),),
            hints=(
                "How far is T from the identity? One number for the turn, one for the shift.",
                "The trace of the 3x3 rotation block is 1 + 2 cos of the angle (NaN means an arccosine of more than 1, by rounding perhaps: "
                "`np.clip`), R - Rᵀ has the Frobenius norm 2 sqrt(2) sin; the distance is the length of the translation.",
                "`R = T[:3, :3]\ntwice_sine = np.linalg.norm(R - R.T) / np.sqrt(2)\n"
                "return np.arctan2(twice_sine, np.trace(R) - 1), np.linalg.norm(T[:3, 3])`",
            ),
            mistakes=[
                Mistake(
                    _closure(lambda T: np.rad2deg(chaining.closure_error(T)[0])),
                    "Your angle is in degrees. Inside the workbook angles are radians.",
                ),
                *(
                    Mistake(
                        _arccos(lambda T: (np.trace(T) - 1) / 2, clipped),
                        "You took the trace of the 4x4 matrix, whose corner is no part of the rotation, or forgot the - 1. The argument is "
                        "(trace - 1) / 2, with the trace of the 3x3 block.",
                        id=f"closure-trace-4x4-{clipped}",
                    )
                    for clipped in (False, True)
                ),
                *(
                    Mistake(
                        _arccos(cosine, clipped),
                        "The argument of your arccosine is not the cosine of the angle, and for small turns it is more than 1. It is "
                        "(trace - 1) / 2, parentheses included, with the trace of the 3x3 block.",
                        id=f"closure-cosine-{name}-{clipped}",
                    )
                    for name, cosine in (
                        ("parentheses", lambda T: np.trace(T[:3, :3]) - 1 / 2),
                        ("half", lambda T: np.trace(T[:3, :3]) - 1),
                        ("plus", lambda T: (np.trace(T[:3, :3]) + 1) / 2),
                        ("trace", lambda T: np.trace(T[:3, :3])),
                        ("parentheses-4x4", lambda T: np.trace(T) - 1 / 2),
                        ("half-4x4", lambda T: np.trace(T) - 1),
                    )
                    for clipped in (False, True)
                ),
                Mistake(
                    _arccos(lambda T: (np.trace(T[:3, :3]) - 1) / 2, False),
                    "Right, but rounding can push the trace a hair over 3, as in T @ inv(T). An arccosine of what is more than 1 by that is NaN, and so is a root of what is below 0: cut it with `np.clip`, or read sine and cosine with arctan2.",
                    id="closure-clip",
                ),
                Mistake(
                    _closure(lambda T: np.arcsin(np.clip(_twice_sine(T) / 2, -1, 1))),
                    "For 120 deg you get 60 deg: both have the same sine, and a cosine of the same size. The sign of the cosine, "
                    "(trace - 1) / 2, tells them apart; np.arctan2 takes sine and cosine.",
                    id="closure-arcsine",
                ),
                Mistake(
                    _closure(lambda T: np.arccos(np.trace(T[:3, :3]) / 3)),
                    "You took a third of the trace. The trace of a rotation is 1 + 2 cos(angle): solve this for the angle.",
                ),
                Mistake(
                    _closure(lambda T: log_se3(T)[:3]),
                    "This is the rotation vector. The angle is its length.",
                ),
                Mistake(
                    _closure(lambda T: _twice_sine(T) / 2),
                    "This is the sine of the angle. The angle itself is np.arctan2(sine, cosine), with the cosine (trace - 1) / 2.",
                ),
                Mistake(
                    _closure(_twice_sine),
                    "The length of the vector from R - Rᵀ is twice the sine of the angle. Twice the cosine is trace - 1: np.arctan2 takes both.",
                ),
                Mistake(
                    _closure(lambda T: np.arctan2(np.sqrt(2) * _twice_sine(T), np.trace(T[:3, :3]) - 1)),
                    "Your sine is sqrt(2) times too large beside your cosine: R - Rᵀ holds each entry twice, so its norm is 2 sqrt(2) sin(angle).",
                    id="closure-sine-twice",
                ),
                Mistake(
                    _closure(lambda T: np.linalg.norm(frames.kuka_from_matrix(T)[3:])),
                    "You took the root of the sum of squares of three Euler angles. Successive turns about different axes do not add like lengths; the trace gives the angle.",
                ),
                Mistake(
                    _closure(lambda T: np.abs(frames.kuka_from_matrix(T)[3:]).max()),
                    "This is the largest of three Euler angles. The angle of the whole rotation is another one; the trace gives it.",
                ),
                Mistake(
                    _distance(lambda T: abs(T[:3, 3] @ frames.unit_vector(log_se3(T)[:3]))),
                    "This is how far T slides along the axis of its turn. The distance is the length of the whole translation.",
                    id="closure-slide",
                ),
                Mistake(
                    _distance(lambda T: T[:3, 3]),
                    "This is the translation as a vector. The distance is its length.",
                ),
                Mistake(
                    _distance(lambda T: np.linalg.norm(T)),
                    "Your distance is the norm of the whole matrix. Only the last column holds lengths.",
                ),
                Mistake(
                    _distance(lambda T: np.linalg.norm(T[3, :3])),
                    "Your distance is 0 for every T, as the length of the last row is without its 1. The translation stands in the last column, T[:3, 3].",
                    id="closure_error-d13966",
                ),
                Mistake(
                    _distance(lambda T: np.linalg.norm(T[:2, 3])),
                    "You took x and y alone. The loop also misses in z.",
                ),
                Mistake(
                    _distance(lambda T: np.linalg.norm(T[:, 3])),
                    "Your distance takes the whole last column, the 1 of the last row included.",
                ),
                Mistake(
                    _distance(lambda T: np.linalg.norm(T - np.eye(4))),
                    "Your distance is the norm of T - I, which adds millimeters to numbers without a unit. Only the last column holds lengths.",
                ),
                Mistake(
                    _closure(lambda T: np.linalg.norm(T[:3, :3] - np.eye(3))),
                    "The norm of R - I is no angle: for small turns it is sqrt(2) times too large.",
                ),
                Mistake(
                    _distance(lambda T: np.sum(T[:3, 3] ** 2)),
                    "This is the squared distance.",
                ),
                *(
                    Mistake(
                        _closure(lambda T, size=size: size(np.arctan2(T[1, 0], T[0, 0]))),
                        "You read the turn about z alone. The loop also tilts: the angle of the whole rotation is asked for.",
                    )
                    for size in (float, abs)
                ),
                *(
                    Mistake(
                        _closure(
                            lambda T, part=part: 2 * np.arcsin(min(np.linalg.norm(T[:3, :3] - np.eye(3)) / part, 1))
                        ),
                        "By the squares of all nine entries |R - I| is 2 sqrt(2) sin(angle / 2), as a 2-norm 2 sin(angle / 2): solve this for the angle.",
                        id=f"closure-chord-{name}",
                    )
                    for name, part in (("2", 2), ("sqrt-2", np.sqrt(2)), ("4", 4))
                ),
                Mistake(
                    _closure(lambda T: (np.trace(T[:3, :3]) - 1) / 2),
                    "This is the cosine of the angle: its arccosine is missing.",
                ),
                Mistake(
                    _distance(lambda T: np.abs(T[:3, 3]).sum()),
                    "You added the components of the shift. The distance is the root of the sum of squares.",
                ),
                Mistake(
                    _distance(lambda T: T[:3, 3].sum()),
                    "You added the components of the shift. The distance is the root of the sum of squares.",
                ),
                Mistake(
                    _distance(lambda T: np.abs(T[:3, 3]).max()),
                    "This is the largest component of the shift. The distance is the root of the sum of squares.",
                ),
                Mistake(
                    _distance(lambda T: np.linalg.norm(log_se3(T)[3:])),
                    "This is the length of the twist's shift, a path along a screw. The distance asked for is straight: the length of the translation of T.",
                ),
                Mistake(
                    lambda T: chaining.closure_error(T)[::-1],
                    "Angle and distance have changed places.",
                ),
                Mistake(
                    _closure(lambda T: np.linalg.norm(T[:3, :3] - np.eye(3)) / np.sqrt(2)),
                    "This is twice the sine of half the angle, as |R - I| / sqrt(2) is: the angle itself for small turns only.",
                    id="closure-chord",
                ),
                Mistake(
                    _closure(lambda T: np.linalg.norm(log_se3(T))),
                    "This is the length of the whole twist, rad and mm in one number. The angle is the length of its first three entries.",
                    id="closure-twist",
                ),
            ],
        ),
        Value(
            "even_lever",
            reference=lambda: _lever(_sheet()),
            unit="mm",
            rtol=5e-3,  # arccos of the trace of a rounded matrix is that bad at small angles
            of={
                "angle": lambda: chaining.closure_error(_sheet())[0],
                "distance": lambda: chaining.closure_error(_sheet())[1],
            },
            hints=(
                "A turn moves a point by the angle times its distance from the axis.",
                "The angle in rad times the lever is to be the closure distance: divide.",
                "`angle, distance = closure_error(product)\neven_lever = distance / angle`",
            ),
            mistakes=[
                *_of_either_angle(
                    lambda angle, distance: distance / np.rad2deg(angle),
                    "This divides by the angle in degrees. A turn moves a point by the angle in rad times its lever.",
                    "lever-degrees",
                ),
                Mistake(
                    lambda: np.linalg.norm(np.cross(*np.split(log_se3(_sheet()), 2))) / _turn_of_loop() ** 2,
                    "This is, or nearly, how far the origin of K0 is from the axis of the closure motion. Asked for is how far from it a "
                    "point has to be for the turn to move it by the loop's distance.",
                    id="lever-of-the-origin",
                    within=0.5,
                ),
                *_of_either_angle(
                    lambda angle, distance: angle / distance,
                    "Upside down: the distance in mm, divided by the angle in rad, is a length.",
                    "lever-inverse",
                ),
                *_of_either_angle(
                    lambda angle, distance: angle * distance,
                    "This is angle times distance. Which lever, times the angle, makes the distance?",
                    "lever-product",
                ),
                *_of_either_angle(
                    lambda angle, distance: 1000 * angle * distance,
                    "This is 1000 times angle times distance. Which lever, times the angle, makes the distance?",
                    "lever-product-thousand",
                ),
                *(
                    mistake
                    for id, part in (
                        ("lever-half-angle", lambda angle: angle / 2),
                        ("lever-half-chord", lambda angle: np.sin(angle / 2)),
                    )
                    for mistake in _of_either_angle(
                        lambda angle, distance, part=part: distance / part(angle),
                        "Twice too large: the whole angle moves the point, not half of it; along the chord that is 2 sin(angle / 2) times the lever.",
                        id,
                    )
                ),
                *_of_either_angle(
                    lambda angle, distance: distance / (1 - np.cos(angle)),
                    "1 - cos(angle) times the lever is how far a point moves toward the axis. It moves across by the angle in rad times "
                    "its lever, which is far more.",
                    "lever-toward-the-axis",
                ),
                Mistake(
                    lambda: _lever(chaining.chain(lab_sheet.printed_transforms()[::-1])),
                    "This belongs to the links multiplied in the reverse order.",
                    id="lever-reverse",
                ),
                *(mistake for number in range(4) for mistake in _of_one_link(number)),
                Mistake(
                    lambda: chaining.closure_error(_sheet())[1] / np.arctan2(_sheet()[1, 0], _sheet()[0, 0]),
                    "This divides by arctan2(r10, r00), the turn about z. The loop turns about x and y as well.",
                    id="lever-about-z",
                ),
                Mistake(
                    lambda: np.linalg.norm(_sheet()[:3, 3]) / np.linalg.norm(_sheet()[:3, :3] - np.eye(3)),
                    "The norm of R - I is no angle: for small turns it is sqrt(2) times too large.",
                    id="lever-norm",
                ),
                *_of_either_angle(
                    lambda angle, distance: np.linalg.norm(_sheet()[:2, 3]) / angle,
                    "The distance has lost its z here: the loop misses itself by a little in z too, `product[:3, 3]`.",
                    "lever-without-z",
                ),
                Mistake(
                    lambda: chaining.closure_error(_sheet())[1],
                    "This is the loop's distance. Which lever, times the angle in rad, makes as much?",
                    id="lever-distance",
                ),
                *_of_either_angle(
                    lambda angle, distance: np.linalg.norm(lab_sheet.printed_transforms()[-1][:3, 3]) / angle,
                    "This divides the length of the last link. The distance by which the loop misses itself is that of the product.",
                    "lever-last-link",
                ),
            ],
        ),
        Value(
            "worst_at_one_meter",
            reference=_worst_at_one_meter,
            unit="mm",
            rtol=2e-3,
            of={
                "angle": lambda: chaining.closure_error(_sheet())[0],
                "distance": lambda: chaining.closure_error(_sheet())[1],
            },
            hints=(
                "The displacement depends on the direction of p: try many of length 1000 mm, in all directions.",
                "Random directions: normal numbers, shape (n, 3), each divided by its length. Ten thousand are plenty.",
                "`p = np.random.default_rng(0).normal(size=(20000, 3))\np *= 1000 / np.linalg.norm(p, axis=1)[:, None]\n"
                "worst_at_one_meter = chaining.displacement(product, p).max()`",
            ),
            mistakes=[
                Mistake(
                    lambda: chaining.displacement(_sheet(), 1000 * np.vstack([np.eye(3), -np.eye(3)])).max(),
                    "This is the worst of the six axes. Between them lies a worse direction.",
                    id="meter-axes",
                ),
                *_of_either_angle(
                    lambda angle, distance: 1000 * angle,
                    "This is what the turn alone does. The shift of the loop adds to it, or takes from it.",
                    "meter-turn",
                    within=0.005,  # the chord in place of the arc
                ),
                *_of_either_angle(
                    lambda angle, distance: 1000 * angle + distance,
                    "This adds angle times lever and distance as if both pointed the same way: no point can be worse, and none is that bad.",
                    "meter-sum",
                    within=0.005,
                ),
                *_of_either_angle(
                    lambda angle, distance: np.hypot(1000 * angle, distance),
                    "This takes what the turn does and what the shift does to be perpendicular. In the worst direction nearly all of the shift adds to the turn.",
                    "meter-hypot",
                ),
                *_of_either_angle(
                    lambda angle, distance: 1000 * angle + _shift_across_the_axis(),
                    "This leaves out how far the closure motion slides along its axis, perpendicular to the rest.",
                    "meter-no-slide",
                ),
                *_of_either_angle(
                    lambda angle, distance: 2000 * np.sin(angle / 2) + _shift_across_the_axis(),
                    "This leaves out how far the closure motion slides along its axis, perpendicular to the rest.",
                    "meter-no-slide-chord",
                ),
                Mistake(
                    lambda: chaining.closure_error(_sheet())[1],
                    "This is the displacement of the origin of K0, of a point near it, or of one on an axis through it that the turn leaves "
                    "where it is. Elsewhere a meter away the turn adds to it.",
                    id="meter-origin",
                    within=0.02,
                ),
                Mistake(
                    lambda: 1000 * np.linalg.norm(_sheet()[:3, :3] - np.eye(3)),
                    "The norm of R - I is sqrt(2) times the angle: no single point moves that far. Take |T p - p| for many p.",
                    id="meter-norm",
                ),
                Mistake(
                    lambda: 1000 + chaining.closure_error(_sheet())[1],
                    "This is how far the displaced point is from the origin. Subtract p.",
                    id="meter-no-difference",
                    within=0.2,  # of directions tried, none points along the shift
                ),
                *_of_either_angle(
                    lambda angle, distance: 1000 * np.rad2deg(angle),
                    "The lever is multiplied by an angle in degrees here: arcs take radians.",
                    "meter-degrees",
                ),
                Mistake(
                    lambda: 1000 * np.linalg.norm(_sheet()[:3, :3] - np.eye(3)) + chaining.closure_error(_sheet())[1],
                    "The norm of R - I is sqrt(2) times the angle for small turns: no point is carried that far.",
                    id="meter-norm-and-shift",
                ),
                *_of_either_angle(
                    lambda angle, distance: 1000 * angle - distance,
                    "This takes the shift off what the turn does. In the worst direction it adds to it, nearly all of it.",
                    "meter-difference",
                ),
                Mistake(
                    lambda: 15.245,
                    "Worse than any of the six axes, and still not the worst direction: try more of them, on all sides.",
                    id="meter-few-directions",
                    within=0.28,
                ),
                Mistake(
                    lambda: 7.48,
                    "One of the six axes in the table above is worse than that, perhaps several are: look for the largest, and between the axes too.",
                    id="meter-below-the-axes",
                    within=7.48,  # up to the worst of the axes, 14.96 mm
                ),
                Mistake(
                    lambda: 1e5,
                    "No point 1000 mm away can be carried that far: the turn does at most 1000 mm times its angle in rad, the shift adds its length.",
                    id="meter-too-far",
                    within=1e5 - 15.7,
                ),
            ],
        ),
        Prediction(
            "lever",
            question="One link of the loop K0 K1 K2 K3 K0 is turned wrongly by 3 deg, no other has an error. Which link opens the loop most at K0?",
            choices=("the first, to K1", "the second, to K2", "the fourth, back to K0"),
            answer="the second, to K2",
            why="The error turns everything after the link about its end. K2 is farthest from K0; the fourth link ends at K0 and has no lever at all.",
        ),
        Prediction(
            "growth",
            question="Frames in a row, each measured from the one before with a small turning error. Twice as many links: how much larger is the error at the end?",
            choices=("1.4 times", "2 times", "2.8 times"),
            answer="2.8 times",
            why="The turns add like random steps, with the square root of N; each one acts through a lever that grows with N: together N^1.5, and 2^1.5 = 2.8 (somewhat more in short rows).",
        ),
        Exercise(
            "orthonormalize",
            reference=chaining.orthonormalize,
            sizes=("T",),
            draw=(worn_pose, stretched_pose),
            fixed={"T": ONE_POSE},
            decimals={"T": "a copy of it is asked for, and that of whole numbers holds whole numbers"},
            metric=metrics.Poses(1e-6, 1e-6),
            noisy=[
                (
                    functools.partial(worn_pose, defects=defects),
                    metrics.Poses(1e-6, 1e-6),
                    "right, but not for a block that is a little worn, as after some products:",
                )
                for defects in ((1e-6, 3e-6), (1e-4, 2e-4))
            ],
            properties=(right_where(chaining.orthonormalize, metrics.Poses(1e-6, 1e-6), *special.BLOCKS),),
            about=_not_the_nearest,
            hints=(
                "Which rotation lies nearest to a matrix that is almost one? The translation stays.",
                "With R = U S Vᵀ, the nearest rotation is U Vᵀ: the SVD with its singular values set to 1.",
                "`U, _, Vt = np.linalg.svd(T[:3, :3])\nX = T.copy()\nX[:3, :3] = U @ Vt\nreturn X`",
            ),
            mistakes=[
                Mistake(
                    lambda T: _with_rotation(T, np.linalg.qr(T[:3, :3])[0]),
                    "The Q of a QR factorization has right angles, but it trusts the first column, and its columns may even point the other way. "
                    "The nearest rotation comes from the SVD.",
                ),
                Mistake(
                    lambda T: _with_rotation(T, frames.gram_schmidt(T[:3, 0], T[:3, 1])),
                    "Gram-Schmidt gives right angles, but not the nearest rotation: it trusts the first column and bends the others.",
                ),
                Mistake(
                    _gram_schmidt(0, 2),
                    "Gram-Schmidt gives right angles, but not the nearest rotation: it trusts one column and bends the others.",
                ),
                Mistake(
                    _gram_schmidt(1, 0),
                    "Gram-Schmidt gives right angles, but not the nearest rotation: it trusts one column and bends the others.",
                ),
                Mistake(
                    _gram_schmidt(1, 2),
                    "Gram-Schmidt gives right angles, but not the nearest rotation: it trusts one column and bends the others.",
                ),
                Mistake(
                    _gram_schmidt(2, 0),
                    "Gram-Schmidt gives right angles, but not the nearest rotation: it trusts one column and bends the others.",
                ),
                Mistake(
                    _gram_schmidt(2, 1),
                    "Gram-Schmidt gives right angles, but not the nearest rotation: it trusts one column and bends the others.",
                ),
                Mistake(
                    _columns_normalized,
                    "The columns have length 1, but they are still not perpendicular.",
                ),
                Mistake(
                    _rows_normalized,
                    "The rows have length 1, but they are still not perpendicular.",
                ),
                *(
                    Mistake(
                        _normalized_first(axis),
                        f"You made the {what} length 1 before the SVD. The result is a rotation, but another one is nearest to R "
                        "as it stands: U Vᵀ alone sets all lengths right.",
                        id=f"orthonormalize-{what}-first",
                    )
                    for axis, what in enumerate(("columns", "rows"))
                ),
                Mistake(
                    lambda T: _with_rotation(T, T[:3, :3] / np.linalg.norm(T[:3, :3], axis=1)),
                    "You divided columns by the lengths of rows. And length 1 alone makes no right angles.",
                ),
                Mistake(
                    _svd_variant(lambda U, s, Vt: U @ Vt.T),
                    "`np.linalg.svd` returns V already transposed: multiply U by it as it is.",
                ),
                Mistake(
                    _svd_variant(lambda U, s, Vt: U @ np.diag(s) @ Vt),
                    "This is R, as worn as before. (U S Vᵀ puts it together again: leave the singular values out.)",
                    id="orthonormalize-729c13",
                ),
                Mistake(
                    _svd_variant(lambda U, s, Vt: Vt @ U),
                    "The factors have changed places: U Vᵀ is not Vᵀ U.",
                ),
                Mistake(
                    _svd_variant(lambda U, s, Vt: Vt.T @ U.T),
                    "This is the transpose of the nearest rotation, V Uᵀ instead of U Vᵀ.",
                ),
                Mistake(
                    _whole_matrix,
                    "You took the SVD of the whole 4x4 matrix: the translation went into it. Only the rotation block is repaired.",
                ),
                Mistake(
                    lambda T: _with_rotation(np.eye(4), nearest_rotation(T[:3, :3])),
                    "The rotation is right, but the translation has got lost.",
                ),
                Mistake(
                    lambda T: _with_rotation(T, T[:3, :3] / np.cbrt(np.linalg.det(T[:3, :3]))),
                    "The determinant is 1 now, but that is the volume alone: lengths and angles are still wrong.",
                ),
                Mistake(
                    lambda T: _with_rotation(T, T[:3, :3] / np.linalg.det(T[:3, :3])),
                    "Dividing by the determinant makes all axes longer or shorter alike: the angles between them are still wrong.",
                ),
                Mistake(
                    _svd_variant(lambda U, s, Vt: U * Vt),
                    "You multiplied entry by entry: `*` is not `@`.",
                ),
                Mistake(
                    lambda T: _with_rotation(T, T[:3, :3] @ (3 * np.eye(3) - T[:3, :3].T @ T[:3, :3]) / 2),
                    "R (3 I - Rᵀ R) / 2 is one step of an iteration toward the nearest rotation, good enough where R is hardly worn: take the SVD.",
                    id="orthonormalize-first-order",
                ),
                Mistake(
                    _one_step,
                    "The mean of R and its inverse transposed is one step of an iteration toward the nearest rotation: go on until "
                    "nothing changes, or take the SVD.",
                    id="orthonormalize-one-step",
                ),
                Mistake(
                    _through_quaternion,
                    "This is what comes of a quaternion read from the trace and R - Rᵀ, and set to length 1: a rotation, but another one is "
                    "nearest to R. Take the SVD.",
                    id="orthonormalize-quaternion",
                ),
                *(
                    Mistake(
                        _through_angles(B),
                        "You read three angles and make a rotation of them. They come from five of the nine entries; the nearest rotation "
                        "listens to all nine.",
                        id=f"orthonormalize-{name}",
                    )
                    for name, B in READINGS_OF_B.items()
                ),
            ],
        ),
        Exercise(
            "distribute_closure",
            reference=chaining.distribute_closure,
            sizes=("transforms",),
            draw=tuple(functools.partial(open_loop, count=n) for n in (3, 4, 7)),
            metric=metrics.Poses(1e-5, 1e-5),
            noisy=[
                (functools.partial(open_loop, count=n), metrics.Poses(1e-5, 1e-5), f"right, but not for {words}:")
                for n, words in ((2, "two links"), (1, "a single link"))
            ]
            + [(closed_loop, metrics.Poses(1e-5, 1e-5), "right, but not for a loop that closes exactly:")]
            + [
                (
                    functools.partial(gap_of_one_kind, turn=turn, shift=shift),
                    metrics.Poses(1e-5, 1e-5),
                    f"right, but not for a loop that ends {words}:",
                )
                for turn, shift, words in (
                    (0.0, 2.0, "beside its start, unturned"),
                    (0.02, 0.0, "at its start, turned"),
                )
            ],
            properties=(right_where(chaining.distribute_closure, metrics.Poses(1e-5, 1e-5), *special.LOOPS),),
            about=_whether_it_closes,
            hints=(
                "The product is exp(xi). Going back by all of xi at the end closes the loop; how far back should the pose after link k go? "
                "P_k, the pose after k links, becomes exp(-k/N xi) P_k.",
                "Collect P_0 = I, P_1, ... P_N in a list of N + 1 poses, and take xi from the last. Multiply each from the left by its "
                "exp_se3(-k / N * xi). The corrected links are `relative(A, B)` of each pose and the next.",
                "`poses = chaining.stations(transforms)\nN = len(transforms)\nxi = log_se3(poses[-1])\n"
                "moved = [exp_se3(-k / N * xi) @ P for k, P in enumerate(poses)]\nreturn np.array([relative(A, B) for A, B in zip(moved, moved[1:])])`",
            ),
            mistakes=[
                Mistake(
                    _all_in_the_last,
                    "The loop closes, but the last link alone pays for it. Each link is to take its N-th part.",
                ),
                Mistake(
                    _all_in_the_first,
                    "The loop closes, but the first link alone pays for it. Each link is to take its N-th part.",
                ),
                Mistake(
                    lambda Ts: np.tile(np.eye(4), (len(Ts), 1, 1)),
                    "All your links are the identity. Such a loop closes, but nothing is left of the measurement.",
                ),
                Mistake(
                    _appended_to_each,
                    "You appended exp(-xi/N) to each link. But xi is written in the first frame, and each link ends in another one: the loop stays open.",
                ),
                Mistake(
                    _prepended_to_each,
                    "You put exp(-xi/N) in front of each link. But xi is written in the first frame, and each link begins in another one.",
                ),
                Mistake(
                    lambda Ts: _appended_to_each(Ts, 1),
                    "You appended exp(xi/N) to each link: that is on in the direction of the error, and in the frame of the link, while xi is written in the first frame.",
                ),
                Mistake(
                    lambda Ts: _prepended_to_each(Ts, 1),
                    "You put exp(xi/N) in front of each link: that is on in the direction of the error, and in the frame of the link, while xi is written in the first frame.",
                ),
                Mistake(
                    _links_moved(0),
                    "You moved the links. What goes back by k/N is the pose after k links, P_k: the product of the first k.",
                ),
                Mistake(
                    _links_moved(1),
                    "You moved the links. What goes back by k/N is the pose after k links, P_k: the product of the first k.",
                ),
                Mistake(
                    _links_moved(0, left=False),
                    "You moved the links. What goes back by k/N is the pose after k links, P_k: the product of the first k.",
                ),
                Mistake(
                    _links_moved(1, left=False),
                    "You moved the links. What goes back by k/N is the pose after k links, P_k: the product of the first k.",
                ),
                Mistake(
                    _twists_subtracted,
                    "You subtracted xi/N from the twist of each link. Twists of different motions do not add up: move the poses P_k by exp_se3(-k / N * xi).",
                ),
                Mistake(
                    _equal_moves,
                    "All poses behind P_0 are moved by the same share here. The pose after k links has collected k shares of the error.",
                    id="distribute_closure-e199db",
                ),
                Mistake(
                    _forward_instead_of_back,
                    "This is what poses moved by +k/N xi give, on in the direction of the error: now the loop is twice as far open. The pose after k links goes back by k/N.",
                    id="distribute_closure-1045e8",
                ),
                Mistake(
                    _divided_by(lambda n: n + 1),
                    "You divide by N + 1, the number of poses. There are N links, and the pose after the last one has to go back by all of xi.",
                ),
                Mistake(
                    _divided_by(lambda n: n - 1),
                    "You divide by N - 1: the pose after the last link goes back by more than xi. There are N links.",
                ),
                Mistake(
                    _divided_by(lambda n: 1),
                    "The division by N is missing: the pose after the last link is to go back by xi, not by N xi.",
                ),
                Mistake(
                    _translation_only,
                    "You shared out the translation but not the rotation: the loop still ends turned.",
                ),
                Mistake(
                    _translation_from_links,
                    "You took a share of the translation off each link. But each is written in another frame, and the rotation stays open.",
                ),
                Mistake(
                    _rotation_only,
                    "You shared out the rotation but not the translation: the loop still ends beside its start.",
                ),
                Mistake(
                    _turn_and_shift_apart,
                    "You shared out turn and shift each for itself. The loop closes, but half the shift is not half the way: move the poses by exp_se3(-k / N * xi).",
                ),
                Mistake(
                    _gap_shared_apart,
                    "You shared out turn and shift each for itself. The loop closes, but half the shift is not half the way: move the poses by exp_se3(-k / N * xi).",
                ),
                Mistake(
                    _way_shared_apart,
                    "You shared out turn and shift each for itself. The loop closes, but half the shift is not half the way: move the poses by exp_se3(-k / N * xi).",
                ),
                Mistake(
                    lambda Ts: _turn_and_shift_apart(Ts, from_twist=True),
                    "You took the shift of the twist for the translation of the motion: exp_se3(-k / N * xi) makes the one from the other.",
                ),
                Mistake(
                    lambda transforms: transforms,
                    "The links are as they were. If every pose moves alike, nothing between neighbors changes: the pose after k links goes back by k/N.",
                ),
                Mistake(
                    _share_on_the_right,
                    "You put the share to the right of P_k. But xi is written in the first frame, so it belongs on the left.",
                ),
                Mistake(
                    lambda Ts: _moved_poses(Ts)[1:],
                    "These are the corrected poses. The corrected links are asked for: the relative poses of neighbors.",
                ),
                Mistake(
                    _moved_poses,
                    "These are the N + 1 corrected poses, P_0 included. Between neighbors lie the N corrected links, which are asked for.",
                ),
                Mistake(
                    lambda Ts: _moved_poses(Ts)[:-1],
                    "These are corrected poses, and the last one is missing. The corrected links are asked for: the relative poses of neighbors.",
                ),
                Mistake(
                    lambda Ts: _moved(_moved_poses(Ts), np.eye(4))[1:],
                    "One link is missing: the first one leads from P_0, the identity, to P_1.",
                ),
                Mistake(
                    _between(lambda A, B: A @ B),
                    "You multiplied neighboring poses. The link from A to B is inv(A) @ B, `relative(A, B)`.",
                ),
                Mistake(
                    _between(lambda A, B: frames.relative(B, A)),
                    "Your links lead backward: the link from A to B is inv(A) @ B, `relative(A, B)`.",
                ),
                Mistake(
                    _between(lambda A, B: B @ frames.invert(A)),
                    "B @ inv(A) is the move seen from K0. The link from A to B, seen from A, is inv(A) @ B, `relative(A, B)`.",
                ),
                Mistake(
                    lambda Ts: frames.relative(chaining.stations(Ts)[:-1], _moved_poses(Ts)[1:]),
                    "Your links take the share of their end, k/N, and forget that their beginning has moved as well: `relative(A, B)` of two moved poses.",
                    id="distribute-one-end",
                ),
                Mistake(
                    lambda Ts: frames.relative(_moved_poses(Ts)[:-1], chaining.stations(Ts)[1:]),
                    "Your links take off the share of their beginning, and forget that their end moves as well: `relative(A, B)` of two moved poses.",
                    id="distribute-other-end",
                ),
                Mistake(
                    _divided_by(lambda n: 4),
                    "You divide by 4 whatever the loop: it has as many parts as it has links, N = len(transforms).",
                    id="distribute-four",
                ),
                Mistake(
                    _divided_by(lambda n: 2 * n),
                    "Half of the error is shared out: the loop stays open by the other half. The pose after k links goes back by k/N.",
                    id="distribute-half",
                ),
                Mistake(
                    _by_length,
                    "Each link pays in proportion to its length. The loop closes; here the shares are equal, k/N.",
                    id="distribute-by-length",
                ),
            ],
        ),
        Prediction(
            "two_loops",
            question="Two loops share a link. You share out the error of loop A, then that of loop B. What about loop A?",
            choices=("it stays closed", "it opens again", "it opens, but less than the noise of one link"),
            answer="it opens again",
            why="Closing B changes the common link, and A contains it. Doing it the other way round moves the leftover to B; "
            "only all links at once can close both.",
        ),
        *beyond.FILES,
    ],
    further=(
        "two_loops",
        "read_system",
        "write_system",
    ),
)
