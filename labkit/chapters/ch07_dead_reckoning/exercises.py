"""Chapter 7: lateration, motion models, propagation of uncertainty."""

import functools

import numpy as np

from ...documents.lecture import printed as lecture
from ...exercises import metrics
from ...exercises.draws import scaled
from ...exercises.engine import Chapter, Exercise, Prediction
from ...exercises.outcome import Mistake
from ...exercises.special import right_where
from ...exercises.value import Value
from ...geometry.planar import wrap_angle
from ...localization import lateration, odometry, wheels

# Draws -----------------------------------------------------------------------


def two_circles(rng, left=True, up=True, with_origin=True, angle=None):
    """Two landmarks, exact distances to a robot off their line, and a start near it.

    left: of the way from the first landmark to the second; up: above its mirror image; with_origin: on the origin's
    side of the line, which a search from (0, 0) finds without the start; angle: direction of that way, drawn if None.
    """
    side, base = 1 if left else -1, rng.uniform(4, 9)
    angle = rng.uniform(-1.4, 1.4) + (0 if left == up else np.pi) if angle is None else angle
    along = np.round([np.cos(angle), np.sin(angle)], 15)
    across = side * np.array([-along[1], along[0]])
    a = rng.uniform(-5, 5, 2)
    a = a if (a @ across < 0) == with_origin else -a
    robot = a + rng.uniform(0.2, 0.8) * base * along + rng.uniform(2, 5) * across
    landmarks = np.array([a, a + base * along])
    return landmarks, np.linalg.norm(landmarks - robot, axis=1), robot + rng.uniform(-0.6, 0.6, 2)


def several_circles(rng, n):
    """So many landmarks, distances that do not fit exactly, and a position, of which x is larger than y if n is odd."""
    landmarks = rng.uniform(-5, 5, (n, 2))
    position = np.sort(rng.uniform(-5, 5, 2))[:: -1 if n % 2 else 1].copy()
    off = rng.uniform(0.05, 0.2, len(landmarks)) * (-1) ** np.arange(len(landmarks))
    return landmarks, np.linalg.norm(landmarks - position, axis=1) * (1 + off), position


def nearly_on_the_circles(rng):
    """The same with distances that fit to within nanometers: residuals are small, and none of them is 0."""
    landmarks, _, position = several_circles(rng, 3)
    return landmarks, np.linalg.norm(landmarks - position, axis=1) * (1 + 2e-9), position


def measured_twice(rng):
    """The same where one landmark stands twice in the list, with one distance."""
    landmarks, distances, position = several_circles(rng, 3)
    return landmarks[[0, 1, 1, 2]], distances[[0, 1, 1, 2]], position


SITE = "right in a hall, but not on a site where the landmarks are a kilometer apart:"
TABLE = "right in a hall, but not on a table where the landmarks are half a meter apart at most:"


ASIDE = (
    "from a start some way aside, where Newton's steps, too, stay on their side of the line through both landmarks "
    "(other searches, such as SciPy's fsolve, may cross it)"
)


def from_afar(rng, angle):
    """Landmarks in a row, angle = 0 or pi / 2, and a start so far off that a few steps, or the Jacobian of the start
    alone, do not arrive; one coordinate arrives with the first step.
    """
    landmarks, distances, _ = two_circles(rng, angle=angle)
    line = landmarks[1] - landmarks[0]
    across = np.array([-line[1], line[0]])
    robot = max(lateration.circle_intersections(landmarks, distances), key=lambda p: across @ (p - landmarks[0]))
    return landmarks, distances, robot + rng.uniform(6, 12) * across


def at_places(rng, robot, start, left, angle=None):
    """Two landmarks, exact distances to a robot, and a start, both hardly beside these places: so far along the way from
    the first landmark to the second, and so far across it, in lengths of that way.
    """
    landmarks, *_ = two_circles(rng, left=left, angle=angle)
    line = landmarks[1] - landmarks[0]
    frame = np.array([line, (1 if left else -1) * np.array([-line[1], line[0]])])
    robot, start = (landmarks[0] + rng.uniform(0.97, 1.03, 2) * place @ frame for place in (robot, start))
    return landmarks, np.linalg.norm(landmarks - robot, axis=1), start


def from_a_millimeter_aside(rng):
    """A start so near to a position close to the line through both landmarks that the first step is below a millimeter,
    and ends micrometers beside it.
    """
    landmarks, distances, _ = at_places(rng, robot=(0.5, 0.02), start=(0.5, 0.02), left=rng.choice([True, False]))
    robot, mirrored = lateration.circle_intersections(landmarks, distances)
    return landmarks, distances, robot + rng.uniform(7e-4, 9e-4) * (robot - mirrored) / np.linalg.norm(robot - mirrored)


def from_whole_meters(rng):
    """Two landmarks and a start of whole numbers, in an array of integers."""
    landmarks, distances, start = two_circles(rng)
    return landmarks, distances, np.round(start).astype(int)


def from_the_position_itself(rng):
    """Two landmarks and a start at which the search has arrived."""
    landmarks, distances, start = two_circles(rng)
    roots = lateration.circle_intersections(landmarks, distances)
    return landmarks, distances, min(roots, key=lambda root: np.linalg.norm(root - start))


CIRCLES = tuple(
    functools.partial(two_circles, left=left, up=up, with_origin=left == up)
    for up in (True, False)
    for left in (True, False)
)


def two_wheels(rng, faster_right=True):
    """Speeds of the left and the right wheel that turn the robot to this side, and the track."""
    slow, more = rng.uniform(-1, 1), rng.uniform(0.2, 1)
    return (slow, slow + more, rng.uniform(0.2, 0.8)) if faster_right else (slow + more, slow, rng.uniform(0.2, 0.8))


def wheels_alike(rng, turn):
    """Wheels of one speed: straight on with turn = 1; on the spot, to either side, with turn = -1."""
    speed = rng.uniform(0.2, 1) * rng.choice([-1, 1])
    return speed, turn * speed, rng.uniform(0.2, 0.8)


WHEELS = (
    two_wheels,
    functools.partial(two_wheels, faster_right=False),
    functools.partial(wheels_alike, turn=-1),
    functools.partial(wheels_alike, turn=1),
)


def one_wheel_stands(rng, left):
    """One wheel at rest and the other turning, and the track."""
    speed = rng.uniform(0.2, 1) * rng.choice([-1, 1])
    return (0.0, speed, rng.uniform(0.2, 0.8)) if left else (speed, 0.0, rng.uniform(0.2, 0.8))


def wheels_at_rest(rng):
    return 0.0, 0.0, rng.uniform(0.2, 0.8)


def wheels_at_whole_speeds(rng):
    """Both speeds in integers, one of them odd, so that their mean is none, and the track."""
    left, right = rng.permutation([2 * rng.integers(-2, 3), 2 * rng.integers(-2, 3) + 1])
    return int(left), int(right), rng.uniform(0.2, 0.8)


def pose_control_step(rng, side=1, gear=1):
    """A pose, a control that turns to this side (1 left, -1 right) in this gear (1 forward, -1 reverse), and a time
    step that tells the models apart.
    """
    x = np.array([*rng.uniform(-5, 5, 2), rng.uniform(-3, 3)])
    u = np.array([gear * rng.uniform(0.5, 2), side * rng.uniform(0.4, 1.5)])
    return x, u, rng.uniform(0.3, 0.9)


EITHER_WAY = tuple(functools.partial(pose_control_step, side=side, gear=gear) for gear in (1, -1) for side in (1, -1))


def across_the_seam(rng):
    """The same with a heading that comes to 180 deg, or beyond, during the turn."""
    x, u, dt = pose_control_step(rng, side=rng.choice([-1, 1]), gear=rng.choice([-1, 1]))
    turn = u[1] * dt
    return np.array([*x[:2], np.sign(turn) * np.pi - rng.uniform(0.2, 0.8) * turn]), u, dt


STEPS = (*EITHER_WAY, across_the_seam)
PLANAR = {"x": "a planar pose is always (x, y, theta)", "u": "a control is always (v, omega)"}


def gentle_curve(rng, omega):
    """A pose, a control that turns to one side by hardly less than omega, and a time step long enough to see it."""
    x, _, _ = pose_control_step(rng)
    return x, np.array([rng.uniform(1.5, 2), 0.9 * omega * rng.choice([-1, 1])]), rng.uniform(0.7, 0.9)


def creeping(rng):
    """A pose, a control of a few centimeters and hundredths of a radian per second, and a time step."""
    x, u, dt = pose_control_step(rng)
    return x, 0.03 * u * rng.choice([-1, 1], 2), dt


def exactly_backward(rng):
    """A heading of exactly half a turn, to either side, at the end of the step as well."""
    x, u, dt = pose_control_step(rng, gear=rng.choice([-1, 1]))
    return np.array([*x[:2], np.pi * rng.choice([-1, 1])]), u * [1.0, 0.0], dt


def wheels_nearly_alike(rng, apart):
    """Wheels of which one is faster by less than this (m/s), and the track."""
    speed, track = rng.uniform(0.2, 1) * rng.choice([-1, 1]), rng.uniform(0.2, 0.8)
    return speed, speed + rng.uniform(0.2, 1) * apart * rng.choice([-1, 1]), track


def noisy_control(rng, signs, drifts=None):
    """A control whose parts have these signs, a time step, and three noise constants.

    drifts: whether the drift, and not the turn, makes the larger part of the turn rate's variance; by chance if None.
    """
    v, omega = rng.uniform(0.3, 2), rng.uniform(0.2, 1.5)
    dt, (k_d, k_theta, k_drift) = rng.uniform(0.05, 0.5), rng.uniform(0.001, 0.02, 3)
    if drifts is not None and drifts != (k_drift * v > k_theta * omega):
        k_theta, k_drift = k_drift * v / omega, k_theta * omega / v
    return np.array([v, omega]) * signs, dt, k_d, k_theta, k_drift


NOISY_CONTROLS = tuple(
    functools.partial(noisy_control, signs=signs, drifts=drifts)
    for signs, drifts in (((-1, 1), True), ((1, -1), False), ((-1, -1), True))
)
CREEPING = "right, but not for a robot that hardly moves and hardly turns (a few cm/s and hundredths of a rad/s):"


OF_INTEGERS = (
    "right, but not for a pose of whole numbers, np.array([2, -1, 1]): an array of integers, and each copy of it, cuts "
    "the decimals off what is written into it:"
)
IN_CURVES_ONLY = "right in curves, but not where the robot {}:"


def short_time(rng):
    """A control in a time step of a few thousandths to a hundredth of a second, and three noise constants."""
    u, dt, *constants = noisy_control(rng, rng.choice([-1, 1], 2))
    return u, 0.02 * dt, *constants


def special_control(rng, moves):
    """A pose, a control of which these parts are not zero, and a time step."""
    x, u, dt = pose_control_step(rng)
    return x, u * moves * rng.choice([-1, 1], 2), dt


def gathered_turns(rng):
    """The same with a heading that has gathered several turns."""
    x, u, dt = pose_control_step(rng)
    return x + [0.0, 0.0, 2 * np.pi * rng.integers(2, 5) * rng.choice([-1, 1])], u, dt


def special_controls(metric, draw=special_control):
    """Draws that tell who forgets the robot that turns on the spot, drives straight on, or rests."""
    return tuple(
        (functools.partial(draw, moves=moves), metric, IN_CURVES_ONLY.format(does))
        for moves, does in (
            ((0, 1), "turns on the spot, v = 0"),
            ((1, 0), "drives straight on, omega = 0"),
            ((0, 0), "rests, u = (0, 0)"),
        )
    )


def pose_of_integers(rng):
    """The same from a pose of whole numbers."""
    _, u, dt = pose_control_step(rng)
    return rng.integers(1, 5, 3) * rng.choice([-1, 1], 3), u, dt


def far_and_fast(rng):
    """A pose some hundred meters off, a control of tens of meters a second, and a time step of seconds."""
    x = np.array([*rng.uniform(60, 200, 2) * rng.choice([-1, 1], 2), rng.uniform(-3, 3)])
    return x, rng.uniform((10, 3), (40, 8)) * rng.choice([-1, 1], 2), rng.uniform(2, 6)


def of_other_sizes(metric, far=None, small=None):
    """Draws that tell who cuts off what is large, or drops what is small; far, small: metrics of their own for these."""
    far, small = far or metric, small or metric
    crawling = functools.partial(scaled, draw=pose_control_step, factors=(1, 5e-4, 1))
    short = functools.partial(scaled, draw=pose_control_step, factors=(1, 1, 0.01))
    near_zero = functools.partial(scaled, draw=pose_control_step, factors=(1e-3, 1, 1))
    return (
        (far_and_fast, far, "right, but not far off (60 m and more) at high speed in long steps (2 s and more):"),
        (crawling, small, "right, but not for a robot that moves by less than a millimeter in the step:"),
        (short, small, "right, but not for a time step of less than a hundredth of a second:"),
        (near_zero, metric, "right, but not from a pose within millimeters of (0, 0, 0):"),
    )


def special_steps(metric, small=None):
    turns = "right, but not where theta has gathered several full turns:"
    rows = (creeping, metric, CREEPING), *special_controls(metric), (gathered_turns, metric, turns)
    return *rows, *of_other_sizes(metric, small=small), (pose_of_integers, metric, OF_INTEGERS)


BACKWARD = (
    exactly_backward,
    metrics.Numbers(1e-5),
    "right, but not where the robot looks exactly backward, theta = pi or -pi, and drives straight on (a difference of two "
    "headings is to be wrapped):",
)


def long_turn(rng, by):
    """A pose and a control held so long that the robot turns by an angle from this range."""
    x, u, _ = pose_control_step(rng, side=rng.choice([-1, 1]), gear=rng.choice([-1, 1]))
    return x, u, rng.uniform(*by) / abs(u[1])


def covariances_at_special_controls(rng, moves):
    """Pose, its covariance, a control of which these parts are not zero, time step, covariance of the control."""
    x, cov, u, dt, cov_u = pose_and_covariances(rng)
    return x, cov, u * moves, dt, cov_u


def pose_and_covariances(rng, side=1, gear=1):
    """Pose, its covariance, control, time step, covariance of the control."""
    x, u, dt = pose_control_step(rng, side, gear)
    M, N = rng.normal(size=(3, 3)), rng.normal(size=(2, 2))
    return x, 0.1 * M @ M.T, u, dt, 0.05 * N @ N.T


def car(rng, left=True, gear=1):
    """Speed, steering angle to this side, and wheelbase of a car."""
    steering = (1 if left else -1) * rng.uniform(0.1, 0.9)
    return gear * rng.uniform(0.3, 3), steering, rng.choice([-1, 1]) * rng.uniform(0.2, 0.6) + rng.uniform(1.2, 3)


def car_nearly_straight_on(rng, turned):
    """The same with its wheels turned by less than this (rad)."""
    speed, _, wheelbase = car(rng)
    return speed, rng.uniform(0.2, 1) * turned * rng.choice([-1, 1]), wheelbase


def car_turned_far(rng, left):
    """The same with its wheels turned far to this side."""
    speed, _, wheelbase = car(rng)
    return speed, (1 if left else -1) * rng.uniform(0.9, 1.3), wheelbase


def car_at_rest(rng, steering):
    """A car that stands, with its wheels turned by so much."""
    return 0.0, steering, float(car(rng)[2])


def car_straight_on(rng):
    """The same with its wheels straight, so that the circle has no center, in Python's own numbers, as one types them."""
    speed, _, wheelbase = car(rng)
    return float(speed), 0.0, float(wheelbase)


CARS = (
    *(functools.partial(car, left=left, gear=gear) for gear in (1, -1) for left in (True, False)),
    car_straight_on,
)


def rolling(rng, wide=True):
    """Rim speeds of four Mecanum wheels that slip a little, and half length and half width of the robot."""
    half_length, half_width = sorted((rng.uniform(0.15, 0.3), rng.uniform(0.32, 0.5)), reverse=not wide)
    twist = rng.uniform(0.3, 1.2, 3) * rng.choice([-1, 1], 3)
    slip = rng.uniform(0.03, 0.1, 4) * rng.choice([-1, 1], 4)
    return wheels.mecanum_matrix(half_length, half_width) @ twist + slip, half_length, half_width


def rolling_slowly(rng):
    """The same with speeds of a few centimeters a second."""
    speeds, *lengths = rolling(rng)
    return 0.03 * speeds, *lengths


def unequal_wheels(rng, larger=True, turns=None):
    """Way that was counted, excess of the right wheel over what is believed, and track; `turns`: how far it is led."""
    excess, track = (1 if larger else -1) * rng.uniform(0.005, 0.05), rng.uniform(0.2, 0.8)
    way = rng.uniform(3, 20) if turns is None else turns * track / abs(excess)
    return way, excess, track


def wheels_hardly_unequal(rng):
    """The same with an excess of less than a thousandth, over a long way."""
    return rng.uniform(15, 30), rng.uniform(1e-4, 5e-4) * rng.choice([-1, 1]), rng.uniform(0.2, 0.8)


UNEQUAL = (
    unequal_wheels,
    functools.partial(unequal_wheels, larger=False),
    functools.partial(unequal_wheels, turns=2.5),
    functools.partial(unequal_wheels, larger=False, turns=8.0),  # more than once around
)

# References and wrong variants ------------------------------------------------


def newton_lateration(landmarks, distances, start):
    return lateration.newton_lateration(landmarks, distances, start).position


def lateration_residual(landmarks, distances, position):
    return lateration.square_residuals(landmarks, distances, position)


def _newton(change, steps=20):
    """A Newton iteration whose residuals and Jacobian pass through `change(J, f, distances)` before the step."""

    def variant(landmarks, distances, start):
        x = np.array(start, dtype=float)
        for _ in range(steps):
            away = x - landmarks
            J, f = change(2 * away, (away**2).sum(1) - distances**2, distances)
            x = x - np.linalg.solve(J, f)
        return x

    return variant


def _newton_with_one_jacobian(steps):
    def variant(landmarks, distances, start):
        x, J = np.array(start, dtype=float), 2 * (start - landmarks)
        for _ in range(steps):
            x = x - np.linalg.solve(J, lateration_residual(landmarks, distances, x))
        return x

    return variant


def _newton_of_lengths(landmarks, distances, start):
    x = np.array(start, dtype=float)
    for _ in range(20):
        away = x - landmarks
        r = np.linalg.norm(away, axis=1)
        x = x - np.linalg.solve(away / r[:, None], r - distances)
    return x


def _mirrored(landmarks, distances, start):
    roots = lateration.circle_intersections(landmarks, distances)
    return roots[np.argmax(np.linalg.norm(roots - start, axis=1))]


def ackermann_twist(speed, steering, wheelbase):
    return wheels.ackermann_to_twist([speed, steering], wheelbase)


def mecanum_twist(speeds, half_length, half_width):
    return wheels.mecanum_to_twist(speeds, half_length, half_width)[0]


def _bicycle_about_its_middle(speed, steering, wheelbase):
    return np.array([speed, speed * np.sin(np.arctan(np.tan(steering) / 2)) / (wheelbase / 2)])


def _three_wheels(speeds, half_length, half_width):
    return np.linalg.solve(wheels.mecanum_matrix(half_length, half_width)[:3], speeds[:3])


def _mecanum(lever=lambda a, b: a + b, signs=((1, 1, 1, 1), (-1, 1, 1, -1), (-1, 1, -1, 1)), shares=(4, 4, 4)):
    """Twist as three signed sums of the four speeds, each divided by its share, the last by the lever as well."""

    def variant(speeds, half_length, half_width):
        x, y, turn = np.asarray(signs) @ speeds / shares
        return np.array([x, y, turn / lever(half_length, half_width)])

    return variant


def wheel_offset(way, excess, track):
    turn = way * excess / track
    return odometry.step([0, 0, 0], [way * (1 + excess / 2), turn], 1.0, "arc")[1]


def _offset(of):
    """A variant from (way of the middle, angle turned, the way counted)."""
    return lambda way, excess, track: of(way * (1 + excess / 2), way * excess / track, way)


def _in_straight_steps(n, along):
    """The end of n straight steps, each along the heading after this part of its turn."""

    def variant(way, excess, track):
        turn = way * excess / track
        headings = turn * (np.arange(n) + along) / n
        return way * (1 + excess / 2) * np.sin(headings).mean()

    return variant


def step_euler(x, u, dt):
    return odometry.step(x, u, dt, "euler")


def step_midpoint(x, u, dt):
    return odometry.step(x, u, dt, "midpoint")


def step_arc(x, u, dt):
    return odometry.step(x, u, dt, "arc")


def _straight(length, direction, turn):
    """Step variants: how far, in which direction, by how much the heading turns, each a function of (theta, v, omega, dt)."""

    def variant(x, u, dt):
        values = (x[2], u[0], u[1], dt)
        d, a = length(*values), direction(*values)
        return np.array([x[0] + d * np.cos(a), x[1] + d * np.sin(a), x[2] + turn(*values)])

    return variant


def _way(theta, v, omega, dt):
    return v * dt


def _turn(theta, v, omega, dt):
    return omega * dt


def _before(theta, v, omega, dt):
    return theta - omega * dt / 2


def _mean(theta, v, omega, dt):
    return (theta + omega * dt) / 2


def _beyond(theta, v, omega, dt):
    return theta + 1.5 * omega * dt


def _slips(length, direction, angle):
    """What goes wrong in every model: the right `length` and `direction` with one slip; `angle` names the latter."""
    return [*_slips_of_units(length, direction), *_slips_of_the_sum(_straight(length, direction, _turn), angle)]


def _slips_of_units(length, direction):
    """A time step or a conversion of angles too many or missing."""

    def per_second(theta, v, omega, dt):
        return length(theta, v, omega, dt) / dt

    return [
        Mistake(
            _straight(per_second, direction, lambda th, v, w, dt: w),
            "The time step is missing: v and omega are per second.",
        ),
        Mistake(_straight(per_second, direction, _turn), "The time step is missing from the way: it is v T, not v."),
        Mistake(_straight(length, direction, lambda th, v, w, dt: w), "The heading turns by omega T, not by omega."),
        Mistake(
            _straight(length, direction, lambda th, v, w, dt: -w * dt),
            "Your robot turns to the wrong side: theta grows by omega T.",
        ),
        Mistake(_straight(length, direction, lambda th, v, w, dt: 0.0), "The heading stays what it was: add omega T."),
        Mistake(
            _straight(length, direction, lambda th, v, w, dt: w * dt / 2),
            "The robot ends turned by the whole omega T, not by half of it.",
        ),
        Mistake(
            _straight(length, lambda *given: np.radians(direction(*given)), _turn),
            "theta is in radians already: no conversion inside cosine and sine.",
        ),
        Mistake(
            _straight(length, lambda *given: np.degrees(direction(*given)), _turn),
            "np.cos and np.sin take radians, and theta is in radians already: do not convert.",
        ),
    ]


def _slips_of_the_sum(step, angle):
    """A right `step` put together wrongly."""
    return [
        Mistake(
            lambda x, u, dt: x + (step(x, u, dt) - x)[[1, 0, 2]],
            f"Sine and cosine are exchanged: x goes with the cosine of {angle}, y with the sine.",
        ),
        Mistake(lambda x, u, dt: step(x, u, dt) - x, "You return what the step adds: add the old pose."),
        Mistake(
            lambda x, u, dt: step(x, u, dt) - x * [1, 1, 0],
            "The old position is missing: add x[0] and x[1] to the way.",
        ),
        Mistake(
            lambda x, u, dt: step(x, u, dt) - x * [0, 0, 1], "The old heading is missing: theta' = theta + omega T."
        ),
        Mistake(
            lambda x, u, dt: step(x, u, dt) * [1, 1, np.degrees(1)], "The heading is in degrees: leave it in radians."
        ),
        Mistake(
            lambda x, u, dt: step(x, np.array([abs(u[0]), u[1]]), dt),
            "You take |v|. A robot may reverse: then v is negative, and it drives backward along its heading.",
        ),
        Mistake(
            lambda x, u, dt: step(x, np.array([u[0], abs(u[1])]), dt),
            "You take |omega|. A turn to the right has omega < 0.",
        ),
        Mistake(lambda x, u, dt: step(x, u[::-1], dt), "v and omega have changed places: u = (v, omega)."),
        Mistake(
            lambda x, u, dt: step(x, u, dt) * [1, -1, 1] + 2 * x * [0, 1, 0],
            f"A sign in y: add the way times the sine of {angle}.",
        ),
    ]


def _short_steps(x, u, dt, step, n):
    for _ in range(n):
        x = step(x, u, dt / n)
    return x


def _between_wrapped_headings(x, u, dt):
    after = wrap_angle(x[2] + u[1] * dt)
    return _straight(_way, lambda *given: (x[2] + after) / 2, _turn)(x, u, dt)


def _mean_of_two_ways(x, u, dt):
    turn = np.array([0.0, 0.0, u[1] * dt])
    return (step_euler(x, u, dt) + step_euler(x + turn, u, dt) - turn) / 2


def _chord(theta, v, omega, dt):
    return v * dt * np.sinc(omega * dt / 2 / np.pi)


def _old(theta, v, omega, dt):
    return theta


def _half(theta, v, omega, dt):
    return theta + omega * dt / 2


def _new(theta, v, omega, dt):
    return theta + omega * dt


def _arc_sign(x, u, dt):
    r, after = u[0] / u[1], x[2] + u[1] * dt
    return np.array([x[0] + r * (np.sin(x[2]) - np.sin(after)), x[1] + r * (np.cos(after) - np.cos(x[2])), after])


def _arc_from(radius):
    def variant(x, u, dt):
        r, after = radius(*u), x[2] + u[1] * dt
        return np.array([x[0] + r * (np.sin(after) - np.sin(x[2])), x[1] - r * (np.cos(after) - np.cos(x[2])), after])

    return variant


def _arc_y_sign(x, u, dt):
    r, after = u[0] / u[1], x[2] + u[1] * dt
    return np.array([x[0] + r * (np.sin(after) - np.sin(x[2])), x[1] + r * (np.cos(after) - np.cos(x[2])), after])


GENTLE = "right in sharp curves, but not in gentle ones, where omega is {:g} rad/s or less:"
LONG = "right, but not for a turn that goes more than once around, omega T beyond 2 pi:"
HALF_AROUND = "right, but not for a turn by more than half a circle in one step, omega T beyond pi, which is to be halved as it is:"
ROUNDED_WHEELS = 1.1e-16  # rad/s: wheels at 0.3 and at 0.1 + 0.2 m/s turn the robot so fast, on paper


def _straight_line_works(function, rng):
    """The limit omega -> 0: exactly straight, and near it without a jump, forward and in reverse."""
    x, dt = np.array([1.0, 2.0, rng.uniform(-3, 3)]), 0.8
    for omega in (0.0, 1e-9, ROUNDED_WHEELS):
        for v in (1.5, -1.5):
            expected = odometry.step(x, np.array([v, 0.0]), dt, "arc")
            problem = _not_straight(function, x, np.array([v, omega]), dt, expected)
            if problem:
                return problem
    return None


def _not_straight(function, x, u, dt, expected):
    given = f"with omega = {u[1]:g}"
    with np.errstate(all="ignore"):
        try:
            result = function(x, u, dt)
        except ZeroDivisionError:
            result = np.full(3, np.nan)
    if result is None:
        return f"right on curves, but {given} it returned None: is a `return` missing there?"
    result = np.asarray(result, dtype=float)
    if result.shape != (3,):
        return f"right on curves, but {given} it returns an array of shape {result.shape}. A pose has shape (3,)."
    if not np.isfinite(result).all():
        return f"right on curves, but {given} the result is not finite: is something divided by omega, or by half the turn?"
    if metrics.PlanarPoses(1e-6).equal(result, expected):
        return None
    if u[1] == ROUNDED_WHEELS:
        return (
            f"right on curves and for omega = 0, but {given} (wheels at 0.3 and 0.1 + 0.2 m/s give that) the robot should drive "
            "straight on. If you compute with the radius: one of 10^16 m leaves no digits for the difference of two sines. "
            "The chord has no radius in it."
        )
    return f"right on curves, but {given} the robot should drive straight on; the result is off."


def jacobian_state(x, u, dt):
    return odometry.step_jacobians(x, u, dt, "euler")[0]


def jacobian_control(x, u, dt):
    return odometry.step_jacobians(x, u, dt, "euler")[1]


def _state_entries(first, second):
    def variant(x, u, dt):
        F = np.eye(3)
        F[0, 2], F[1, 2] = first(x, u, dt), second(x, u, dt)
        return F

    return variant


def _control_entries(first, second, third):
    def variant(x, u, dt):
        F = np.zeros((3, 2))
        F[0, 0], F[1, 0], F[2, 1] = first(x, dt), second(x, dt), third(dt)
        return F

    return variant


def _covariance(var_v, var_omega):
    def variant(u, dt, k_d, k_theta, k_drift):
        arguments = (u[0], u[1], dt, k_d, k_theta, k_drift)
        return np.diag([var_v(*arguments), var_omega(*arguments)])

    return variant


def _without_absolute_values():
    """The control's covariance with one or more of its three absolute values left out."""
    places = (
        "|v| in the variance of v",
        "|omega| in the first term of that of omega",
        "|v| in the second term of that of omega",
    )
    left_out = ((0,), (1,), (2,), (1, 2), (0, 2), (0, 1, 2), (0, 1))
    for number, which in enumerate(left_out, 1):
        first, turn, drift = (float if k in which else abs for k in range(3))
        yield Mistake(
            _covariance(
                lambda v, w, t, a, b, c, first=first: a * first(v) / t,
                lambda v, w, t, a, b, c, turn=turn, drift=drift: (b * turn(w) + c * drift(v)) / t,
            ),
            f"No variance is negative, though v and omega may be: it is {' and '.join(places[k] for k in which)}.",
            id="control_covariance-9dac3b" + (f"-{number}" if number > 1 else ""),
        )


def propagate(x, cov, u, dt, cov_u):
    return odometry.propagate(x, cov, u, dt, cov_u, "euler")


def _propagated(change):
    """Propagation with `change(F_x, F_u, cov, cov_u)` for the covariance."""

    def variant(x, cov, u, dt, cov_u):
        F_x, F_u = odometry.step_jacobians(x, u, dt, "euler")
        return odometry.step(x, u, dt, "euler"), change(F_x, F_u, cov, cov_u)

    return variant


@functools.cache
def _circle(model="euler", **changes):
    drive = lecture.circle_drive()
    noise = drive.noise | changes
    poses, covs = odometry.drive_with_covariance(
        np.zeros(3), np.zeros((3, 3)), drive.controls, drive.dt, **noise, model=model
    )
    return poses[-1], covs[-1]


def _in_one_step():
    """The covariance after one step as long as the whole drive, with its first control."""
    drive = lecture.circle_drive()
    u, T = drive.controls[0], len(drive.controls) * drive.dt
    return propagate(np.zeros(3), np.zeros((3, 3)), u, T, odometry.control_covariance(u, T, **drive.noise))[1]


@functools.cache
def _loop(step=propagate, steps=None, again=0, start_cov=0.0, at_the_end=False, noise_time=None, turns=0.0, **noise):
    """The loop over the circle with another step, fewer or more steps, another start or other constants of the noise; turns: so
    many turns of a step before the start.
    """
    drive = lecture.circle_drive()
    ahead = np.array([0.0, 0.0, turns * drive.controls[0, 1] * drive.dt])
    x, cov = _circle()[0] if at_the_end else ahead, start_cov * np.eye(3)
    for u in [*drive.controls[:steps], *drive.controls[:again]]:
        cov_u = odometry.control_covariance(u, noise_time or drive.dt, **(drive.noise | noise))
        x, cov = step(x, cov, u, drive.dt, cov_u)
    return x, cov


def _turned_first(x, cov, u, dt, cov_u):
    return _straight(_way, _new, _turn)(x, u, dt), cov


def _wrong_side(x, cov, u, dt, cov_u):
    F_x, F_u = odometry.step_jacobians(x, u, dt, "euler")
    return step_euler(x, u, dt), F_x.T @ cov @ F_x + F_u @ cov_u @ F_u.T


def _from_elsewhere(x):
    """Where the circle ends that does not start at the origin with the heading 0."""
    for u in lecture.circle_drive().controls:
        x = step_euler(x, u, lecture.circle_drive().dt)
    return x


def _at_new_pose(x, cov, u, dt, cov_u):
    moved = step_euler(x, u, dt)
    return moved, propagate(moved, cov, u, dt, cov_u)[1]


def _begun_anew(x, cov, u, dt, cov_u):
    return propagate(x, np.zeros((3, 3)), u, dt, cov_u)


def _moved_before(x, cov, u, dt, cov_u):
    return propagate(step_euler(x, u, dt), cov, u, dt, cov_u)


def _not_handed_on(x, cov, u, dt, cov_u):
    return x, propagate(x, cov, u, dt, cov_u)[1]


def _exchanged(one, other):
    noise = lecture.circle_drive().noise
    return _loop(**{one: noise[other], other: noise[one]})[1]


def _without_carrying():
    """The control's noise of all steps added up, what earlier errors do later left out."""
    drive = lecture.circle_drive()
    poses = odometry.drive(np.zeros(3), drive.controls, drive.dt, "euler")[:-1]
    F_u = odometry.step_jacobians(poses, drive.controls, drive.dt, "euler")[1]
    cov_u = odometry.control_covariance(drive.controls, drive.dt, **drive.noise)
    return (F_u @ cov_u @ np.swapaxes(F_u, -1, -2)).sum(0)


POSE_AND_COV = metrics.Several(metrics.PlanarPoses(), metrics.Numbers(1e-9), names=("pose", "covariance"))
POSE_AND_SMALL_COV = metrics.Several(
    metrics.PlanarPoses(), metrics.Numbers(1e-9, least=0), names=("pose", "covariance")
)

CHAPTER = Chapter(
    "07-dead-reckoning",
    title="Lateration and dead reckoning",
    items=[
        Prediction(
            "method",
            question="A robot wakes up somewhere in a known hall and has nothing but wheel odometry. Which method finds out where it is?",
            choices=("dead reckoning", "the Kalman filter", "the particle filter", "none of them"),
            answer="none of them",
            why="Odometry only says how far the robot came from where it was. Without a known start there is nothing to add it to.",
        ),
        Exercise(
            "lateration_residual",
            reference=lateration_residual,
            sizes=("landmarks", "distances", "position"),
            draw=tuple(functools.partial(several_circles, n=n) for n in (3, 5, 2, 4)),
            fixed={"position": "a place in the plane"},
            metric=metrics.Numbers(1e-9),
            noisy=(
                (measured_twice, metrics.Numbers(1e-9), "right, but not where a landmark stands twice in the list:"),
                (
                    nearly_on_the_circles,
                    metrics.Numbers(1e-9),
                    "right, but not where the position lies nearly on the circles, and all residuals are next to 0:",
                ),
                (
                    functools.partial(several_circles, n=30),
                    metrics.Numbers(1e-9),
                    "right for a few landmarks, but not for thirty:",
                ),
                (
                    functools.partial(scaled, draw=functools.partial(several_circles, n=3), factors=(300, 300, 300)),
                    metrics.Numbers(1e-9),
                    "right in a hall, but not on a site of kilometers:",
                ),
                (
                    functools.partial(scaled, draw=functools.partial(several_circles, n=3), factors=(0.02, 0.02, 0.02)),
                    metrics.Numbers(1e-9),
                    "right in a hall, but not on a table, where all distances are below half a meter:",
                ),
            ),
            hints=(
                "Each landmark gives one equation that is zero when the position lies on its circle.",
                "The lecture's equation i: (x_i - x)^2 + (y_i - y)^2 - d_i^2.",
                "`return ((landmarks - position) ** 2).sum(axis=1) - distances**2`",
            ),
            mistakes=[
                Mistake(
                    lambda L, d, p: np.linalg.norm(L - p, axis=1) - d,
                    "You compare lengths, in meters. That is the better cost, as you will see, but the lecture's equation compares squares.",
                ),
                Mistake(lambda L, d, p: ((L - p) ** 2).sum(1) - d, "You forgot to square the measured distances."),
                Mistake(
                    lambda L, d, p: (((L - p) ** 2).sum(1) - d**2) ** 2,
                    "You squared the residual as well. The squaring is done when the residuals are added up to the cost.",
                ),
                Mistake(
                    lambda L, d, p: ((L - p) ** 2).sum(1) + d**2,
                    "The measured square is to be subtracted: on the circle the residual is zero.",
                ),
                Mistake(
                    lambda L, d, p: (L**2).sum(1) - (p**2).sum() - d**2,
                    "|a - b|^2 is not |a|^2 - |b|^2: subtract first, then square.",
                ),
                Mistake(
                    lambda L, d, p: np.linalg.norm(L - p) ** 2 - d**2,
                    "Your sum of squares runs over all landmarks at once, as it does without axis=1: one sum a landmark is wanted.",
                    id="lateration_residual-4a1dc4",
                ),
                Mistake(
                    lambda L, d, p: d**2 - ((L - p) ** 2).sum(1),
                    "Turned around: the lecture's equation is computed square minus measured square.",
                ),
                Mistake(
                    lambda L, d, p: np.abs(((L - p) ** 2).sum(1) - d**2),
                    "No absolute value: the sign tells inside from outside of the circle, and the search needs it.",
                ),
                Mistake(
                    lambda L, d, p: np.linalg.norm(L - p, axis=1) - d**2,
                    "You square the measured distance, but not the computed one.",
                ),
                Mistake(
                    lambda L, d, p: 2 * d * (np.linalg.norm(L - p, axis=1) - d),
                    "2 d (|l - p| - d) is nearly the difference of the squares, close to the circle alone. Square both, then "
                    "subtract.",
                    id="lateration_residual-linearized",
                ),
                Mistake(
                    lambda L, d, p: (np.linalg.norm(L - p, axis=1) - d) ** 2,
                    "Square first, then subtract: (a - b)^2 is not a^2 - b^2.",
                ),
                Mistake(
                    lambda L, d, p: (np.linalg.norm(L - p, axis=1) - d) * np.abs(np.linalg.norm(L - p, axis=1) - d),
                    "Square first, then subtract: (a - b)^2, with the sign of a - b, is not a^2 - b^2.",
                    id="lateration-signed-square",
                ),
                Mistake(
                    lambda L, d, p: (L - p).sum(1) ** 2 - d**2,
                    "Square dx and dy one by one, then add: (dx + dy)^2 is not dx^2 + dy^2.",
                ),
                Mistake(
                    lambda L, d, p: (((L - p) ** 2).sum(1) - d**2).sum(),
                    "One residual a landmark is wanted, not their sum.",
                ),
                Mistake(
                    lambda L, d, p: ((((L - p) ** 2).sum(1) - d**2) ** 2).sum(),
                    "This is the cost, one number. Here the residuals are wanted, one per landmark.",
                ),
                Mistake(
                    lambda L, d, p: ((L[0] - p) ** 2).sum() - d[0] ** 2,
                    "Only the first landmark: does a `return` stand inside a loop?",
                    id="lateration_residual-7eff7e",
                ),
            ],
        ),
        Exercise(
            "newton_lateration",
            reference=newton_lateration,
            draw=(
                *CIRCLES,
                # from where steps for the lengths instead of their squares run away, too
                *(
                    functools.partial(at_places, robot=(0.25, 0.3), start=(0.25, 10.5), left=left)
                    for left in (True, False)
                ),
                *(functools.partial(from_afar, angle=angle) for angle in (0.0, np.pi / 2)),
            ),
            draws=8,
            fixed={
                "landmarks": "with two of them the two equations can be solved",
                "distances": "one for each landmark",
                "start": "a place in the plane",
            },
            metric=metrics.Numbers(1e-8, "m"),
            noisy=(
                (
                    from_the_position_itself,
                    metrics.Numbers(1e-8, "m"),
                    "right, but not from a start that is the position itself:",
                ),
                *(
                    (
                        functools.partial(at_places, robot=(0.25, 0.3), start=(0.25, 300.0), left=left),
                        metrics.Numbers(1e-8, "m"),
                        "right, but not from a start that is a kilometer away and more, from where fewer than twenty rounds "
                        "may not arrive:",
                    )
                    for left in (True, False)
                ),
                *(
                    (
                        functools.partial(at_places, robot=(0.5, 0.5), start=(0.4, 0.002), left=left, angle=angle),
                        metrics.Numbers(1e-8, "m"),
                        "right, but not from a start next to the landmarks' line: Newton's steps stay on their side of the line "
                        "through both landmarks (do yours begin at `start`, and nowhere else?):",
                    )
                    for left in (True, False)
                    for angle in (0.0, np.pi / 2)
                ),
                (
                    from_a_millimeter_aside,
                    metrics.Numbers(1e-8, "m"),
                    "right, but not from a start hardly a millimeter beside the position, where this is next to the line "
                    "through both landmarks, and one step is not enough:",
                ),
                (
                    from_whole_meters,
                    metrics.Numbers(1e-8, "m"),
                    "right, but not from a start of whole numbers, np.array([4, 1]): an array of integers, and each copy of it, "
                    "cuts the decimals off what is written into it:",
                ),
                (
                    functools.partial(scaled, draw=two_circles, factors=(250, 250, 250)),
                    metrics.Numbers(1e-8, "m"),
                    SITE,
                ),
                (
                    functools.partial(scaled, draw=two_circles, factors=(0.05, 0.05, 0.05)),
                    metrics.Numbers(1e-6, "m"),
                    TABLE,
                ),
            ),
            properties=(
                right_where(
                    newton_lateration,
                    metrics.Numbers(1e-8, "m"),
                    *(
                        (ASIDE, functools.partial(at_places, robot=robot, start=start, left=left, angle=0.0))
                        for robot, start, left in (
                            ((0.57, 0.43), (-1.62, 1.1), True),
                            ((0.547, 0.816), (-3.037, 1.892), False),
                        )
                    ),
                ),
            ),
            hints=(
                "Replace the residuals by their tangent planes, go to where those are zero, repeat.",
                "Row i of the Jacobian is 2 (position - landmark_i). The step solves J step = -residual. Twenty times over: Jacobian and residual of the present position, then the step.",
                "`position = start\n"
                "for _ in range(20): position = position - np.linalg.solve(2 * (position - landmarks), lateration_residual(landmarks, distances, position))\n"
                "return position`",
            ),
            mistakes=[
                Mistake(
                    _newton(lambda J, f, d: (J, f), steps=1),
                    "This is one Newton step. Repeat it, each time with a new Jacobian.",
                ),
                Mistake(
                    lambda L, d, s: s - 20 * np.linalg.solve(2 * (s - L), lateration_residual(L, d, s)),
                    "You take the same step again and again: residuals and Jacobian have to be computed anew at each position.",
                ),
                Mistake(
                    _newton(lambda J, f, d: (J, f + d**2 - d)),
                    "These are Newton's steps for other equations: the measured distances are not squared.",
                    id="newton_lateration-d480e8",
                ),
                Mistake(
                    _newton(lambda J, f, d: (J, np.sqrt(f + d**2) - d)),
                    "Your residuals are lengths, your Jacobian is that of the squares: both must belong to one f.",
                ),
                Mistake(
                    _newton(lambda J, f, d: (J, -f)),
                    "You walk uphill: J points the other way, or the sign of the step is wrong.",
                ),
                Mistake(
                    _newton(lambda J, f, d: (J / 2, f)),
                    "You end where you started. Does the loop change the position? A Jacobian without the factor 2 of the square doubles every step, and every second one then leads back.",
                ),
                Mistake(
                    lambda L, d, s: newton_lateration(L, d, s) - s,
                    "You return the way from the start to the position. Add the start.",
                ),
                Mistake(
                    _mirrored, "This is the mirror image: it also fits, but the given start is nearer to the other one."
                ),
                *(
                    Mistake(
                        _newton(lambda J, f, d: (J, f), steps=steps),
                        "Newton is right, but so few steps do not arrive from a start farther off: take about twenty.",
                    )
                    for steps in (2, 3, 4, 5)
                ),
                Mistake(
                    _newton_of_lengths,
                    "These are Newton's steps for the lengths, |l - x| - d. From a start farther off they run away. The "
                    "equations here are of squares, and J = 2 (x - l).",
                ),
                *(
                    Mistake(
                        _newton_with_one_jacobian(steps),
                        "Your Jacobian is that of the start. From a start farther off such steps do not arrive: compute it anew at each position.",
                        id=f"newton_lateration-f09ebd{'' if steps == 20 else f'-{steps}'}",
                    )
                    for steps in (20, 2, 3, 4, 5, 10)
                ),
                Mistake(
                    lambda L, d, s: newton_lateration(L, d, np.zeros(2)),
                    "That is where a search from the origin ends: it has to begin at `start`, or it may find the mirror image.",
                    id="newton_lateration-52342d",
                ),
                Mistake(
                    lambda L, d, s: np.zeros(2),
                    "You return zeros. Is it the last step, or the residuals, which are zero by then? The position is asked for.",
                    id="newton_lateration-a92204",
                ),
                Mistake(
                    lambda L, d, s: np.full(2, np.nan),
                    "No number comes out: does the search run off to infinity, is something divided by zero, or a root taken of what is negative? The step must solve J step = -f, with J = 2 (position - landmarks) at the present position.",
                    id="newton_lateration-552b1c",
                ),
            ],
        ),
        Prediction(
            "roots",
            question="A robot stands on the line between two landmarks, and both measured distances come out 1 % short. In how many points do the circles meet?",
            choices=("none", "one", "two"),
            answer="none",
            why="The two distances no longer add up to the way between the landmarks. Off the line the circles meet in two points, mirror images of each other, and the start decides which one Newton finds.",
        ),
        Exercise(
            "wheel_to_twist",
            reference=odometry.wheel_to_twist,
            sizes=("v_left", "v_right", "track"),
            draw=WHEELS,
            metric=metrics.Numbers(1e-9),
            noisy=(
                *(
                    (
                        functools.partial(wheels_nearly_alike, apart=apart),
                        metrics.Numbers(1e-9),
                        f"right, but not where the wheels run nearly alike, by less than {1000 * apart:g} mm/s apart:",
                    )
                    for apart in (0.03, 0.0001)
                ),
                *(
                    (
                        functools.partial(one_wheel_stands, left=left),
                        metrics.Numbers(1e-9),
                        "right, but not where one of the wheels stands still:",
                    )
                    for left in (True, False)
                ),
                (wheels_at_rest, metrics.Numbers(1e-9), "right, but not where both wheels stand still:"),
                (
                    wheels_at_whole_speeds,
                    metrics.Numbers(1e-9),
                    "right, but not where both speeds are typed as whole numbers, 1 and 2 (is an array made of them, which "
                    "cuts decimals off?):",
                ),
                *(
                    (
                        functools.partial(scaled, draw=two_wheels, factors=factors),
                        metrics.Numbers(1e-9),
                        f"right for a robot of common size and speed, but not for {this}:",
                    )
                    for factors, this in (
                        ((20, 20, 10), "a large and fast one, its wheels two meters apart and more"),
                        ((20, 20, 0.1), "a small one that turns fast, its wheels 8 cm apart at most"),
                        ((5e-4, 5e-4, 1), "one whose wheels run at 1 mm/s at most"),
                    )
                ),
            ),
            hints=(
                "The middle of the axle moves with the mean of both wheels; what differs between them turns the robot.",
                "v = (v_R + v_L) / 2 and omega = (v_R - v_L) / l.",
                "`return np.array([(v_right + v_left) / 2, (v_right - v_left) / track])`",
            ),
            mistakes=[
                Mistake(
                    lambda a, b, l: np.array([(a + b) / 2, (a - b) / l]),
                    "Your robot turns the wrong way: with v_right > v_left it turns left, counterclockwise, omega > 0.",
                    id="wheel_to_twist-862695",
                ),
                Mistake(
                    lambda a, b, l: np.array([a + b, (b - a) / l]),
                    "The robot's v is the mean of the wheel speeds: the sum is twice too fast.",
                ),
                Mistake(
                    lambda a, b, l: np.array([(a + b) / 2, (b - a) / (l / 2)]),
                    "The difference acts across the whole track l, not across half of it.",
                ),
                Mistake(
                    lambda a, b, l: np.array([(a + b) / 2, (b - a) / 2 / l]),
                    "Half the difference is the speed of a wheel about the middle, which is l/2 away: the halves cancel.",
                ),
                Mistake(
                    lambda a, b, l: np.array([(b - a) / l, (a + b) / 2]), "The order is (v, omega): yours is exchanged."
                ),
                Mistake(
                    lambda a, b, l: np.array([(a + b) / 2, (b - a) * l]),
                    "A turn rate is speed divided by distance: divide by the track, do not multiply.",
                ),
                Mistake(
                    lambda a, b, l: np.array([(a + b) / 2, b - a]),
                    "The turn rate is to be divided by the track: wheels farther apart turn the robot more slowly.",
                ),
                Mistake(
                    lambda a, b, l: np.array([(a + b) / 2, np.degrees((b - a) / l)]),
                    "The turn rate is wanted in rad/s, and the quotient is in rad/s already.",
                ),
                Mistake(lambda a, b, l: np.array([a + b, b - a]), "Divide: the sum by 2, the difference by the track."),
                Mistake(
                    lambda a, b, l: np.array([(b - a) / 2, (a + b) / l]),
                    "Sum and difference have changed places: the sum drives, the difference turns.",
                ),
                Mistake(
                    lambda a, b, l: np.array([b + a / 2, (b - a) / l]), "Brackets are missing: (v_right + v_left) / 2."
                ),
                Mistake(
                    lambda a, b, l: np.array([(a + b) / 2, b - a / l]),
                    "Brackets are missing: (v_right - v_left) / track.",
                ),
                Mistake(
                    lambda a, b, l: np.array([(a + b) / 2, abs(b - a) / l]),
                    "Your turn rate is never negative, as with an absolute value or the wheels sorted. A turn to the right has omega < 0.",
                    id="wheel_to_twist-2346f4",
                ),
                Mistake(
                    lambda a, b, l: np.array([(a + b) / 2, (b - a) / l if a + b else 0.0]),
                    "Right but for a turn on the spot. There v and the radius are both 0, and v / radius says nothing: the difference of the wheels does.",
                ),
                Mistake(
                    lambda a, b, l: np.array([max(a, b), (b - a) / l]),
                    "You take the larger speed for v. The middle of the axle moves with the mean of both.",
                ),
                Mistake(
                    lambda a, b, l: np.array([a + b, (a - b) / l]),
                    "Two slips: v is half the sum, and omega is positive where v_right > v_left.",
                    id="wheel_to_twist-259431",
                ),
            ],
        ),
        Exercise(
            "step_euler",
            reference=step_euler,
            sizes=("u", "dt"),
            draw=STEPS,
            fixed=PLANAR,
            metric=metrics.PlanarPoses(),
            noisy=special_steps(metrics.PlanarPoses()),
            hints=(
                "Drive the way v T along the old heading, then turn.",
                "x' = x + v T cos(theta), y' = y + v T sin(theta), theta' = theta + omega T.",
                "`return np.array([x[0] + u[0] * dt * np.cos(x[2]), x[1] + u[0] * dt * np.sin(x[2]), x[2] + u[1] * dt])`",
            ),
            mistakes=[
                Mistake(
                    _straight(_way, _new, _turn),
                    "You turn first and drive along the new heading. This model drives along the old one.",
                ),
                Mistake(
                    _straight(_way, _half, _turn),
                    "This is the midpoint model already. The simplified one leaves omega T / 2 out.",
                ),
                Mistake(
                    _straight(_way, _before, _turn),
                    "The half turn does not belong here, and its sign is wrong: drive along theta.",
                ),
                Mistake(
                    lambda x, u, dt: x + dt * np.array([u[0], u[1], u[1]]),
                    "v goes into x and omega into y, and the heading into neither: v T cos(theta) and v T sin(theta) are the way.",
                ),
                *(
                    Mistake(
                        lambda x, u, dt, share=share: x + dt * np.array([u[0], share * u[0], u[1]]),
                        "The heading does not enter the way: it is v T cos(theta) in x and v T sin(theta) in y.",
                    )
                    for share in (1, 0)
                ),
                *_slips(_way, _old, "theta"),
            ],
        ),
        Exercise(
            "step_midpoint",
            reference=step_midpoint,
            sizes=("u", "dt"),
            draw=STEPS,
            fixed=PLANAR,
            metric=metrics.PlanarPoses(),
            noisy=(
                (functools.partial(long_turn, by=(3.4, 6.0)), metrics.PlanarPoses(), HALF_AROUND),
                *special_steps(metrics.PlanarPoses()),
            ),
            hints=(
                "While it drives the robot turns by omega T; on average it looked half of that aside.",
                "As before, with theta + omega T / 2 inside cosine and sine.",
                "`a = x[2] + u[1] * dt / 2\n"
                "return np.array([x[0] + u[0] * dt * np.cos(a), x[1] + u[0] * dt * np.sin(a), x[2] + u[1] * dt])`",
            ),
            mistakes=[
                Mistake(step_euler, "This is the simplified model: omega T / 2 is missing inside cosine and sine."),
                Mistake(
                    step_arc,
                    "This is the exact arc, whose chord is shorter than v T. The midpoint model drives all of v T.",
                ),
                Mistake(
                    _straight(_way, _new, _turn),
                    "You drive along the new heading: only half of the turn belongs there.",
                ),
                Mistake(
                    _straight(_way, lambda th, v, w, dt: th + w / 2, _turn),
                    "The time step is missing inside cosine and sine: omega T / 2.",
                ),
                Mistake(
                    _straight(_way, lambda th, v, w, dt: th - w * dt / 2, _turn),
                    "The half turn has the wrong sign: the robot looks ahead into the curve.",
                ),
                Mistake(
                    _straight(_way, _mean, _turn),
                    "You halve theta as well: the direction is theta + omega T / 2, not (theta + omega T) / 2.",
                    id="step_midpoint-3e15da",
                ),
                Mistake(
                    _between_wrapped_headings,
                    "Right until the heading passes 180 deg: the mean of 179 deg and -179 deg is 0. Add half of the turn to the old heading.",
                ),
                Mistake(
                    _mean_of_two_ways,
                    "You take the mean of two ways, along the old and along the new heading. The midpoint model drives one way, v T, along the heading in their middle.",
                ),
                Mistake(
                    lambda x, u, dt: step_euler(step_euler(x, u, dt / 2), u, dt / 2),
                    "This is where two steps of the simplified model end, each of half the time. The midpoint model takes one, along the heading of half the turn.",
                    id="step_midpoint-42d4c5",
                ),
                Mistake(
                    _straight(_way, _beyond, _turn),
                    "Your direction is theta + 3 omega T / 2: is the heading turned before cosine and sine use it? To the old theta half of the turn is added.",
                    id="step_midpoint-950064",
                ),
                *_slips(_way, _half, "theta + omega T / 2"),
            ],
        ),
        Exercise(
            "step_arc",
            reference=step_arc,
            draw=STEPS,
            fixed=PLANAR,
            metric=metrics.PlanarPoses(1e-7),  # thousands of short steps are right as well
            noisy=(
                *(
                    (functools.partial(gentle_curve, omega=omega), metrics.PlanarPoses(1e-7), GENTLE.format(omega))
                    for omega in (0.1, 0.03, 0.01, 5e-3, 1e-3, 1e-4)
                ),
                (functools.partial(long_turn, by=(6.8, 11)), metrics.PlanarPoses(1e-3), LONG),
                (pose_of_integers, metrics.PlanarPoses(1e-7), OF_INTEGERS),
                *special_controls(metrics.PlanarPoses(1e-7)),
                *of_other_sizes(metrics.PlanarPoses(1e-7), far=metrics.PlanarPoses(1e-3)),
            ),
            properties=(_straight_line_works,),
            hints=(
                "The robot turns about the center (ICR) at distance r = v / omega to its left. Where is it after turning by omega T?",
                "The chord of the arc points along theta + h with h = omega T / 2, and its length is v T sin(h) / h.",
                "np.sinc(t) is sin(pi t) / (pi t), and 1 at t = 0:\n"
                "`h = u[1] * dt / 2\n"
                "d = u[0] * dt * np.sinc(h / np.pi)\n"
                "return np.array([x[0] + d * np.cos(x[2] + h), x[1] + d * np.sin(x[2] + h), x[2] + 2 * h])`",
            ),
            mistakes=[
                Mistake(
                    step_midpoint,
                    "This is the midpoint model: its way is the length of the arc, but the chord is shorter, by sin(h) / h.",
                ),
                Mistake(step_euler, "This is the simplified model: no curve in it yet."),
                Mistake(
                    _straight(lambda th, v, w, dt: v * dt * np.sinc(w * dt / np.pi), _new, _turn),
                    "You put h = omega T. h is half the turn, omega T / 2.",
                ),
                Mistake(
                    _straight(lambda th, v, w, dt: v * dt * np.sinc(w * dt / 2), _half, _turn),
                    "`np.sinc(t)` is sin(pi t) / (pi t): give it h / pi.",
                ),
                Mistake(
                    _straight(lambda th, v, w, dt: v * dt * np.sin(w * dt) / (w * dt), _half, _turn),
                    "In sin(h) / h, h is half the turn, omega T / 2.",
                ),
                Mistake(
                    _straight(_chord, _new, _turn),
                    "The length of the chord is right. It points along theta + h, halfway through the turn; yours along the new heading.",
                ),
                Mistake(
                    _straight(_chord, _old, _turn),
                    "The length of the chord is right. It points along theta + h, halfway through the turn; yours along the old heading.",
                ),
                Mistake(
                    _arc_sign,
                    "Your robot drives the other way: x and y change by the right amounts, with the wrong signs. The center of rotation lies at x - r sin(theta), y + r cos(theta), with r = v / omega.",
                    id="step_arc-e5a54e",
                ),
                Mistake(
                    _arc_y_sign,
                    "x is right; y changes by the right amount with the wrong sign. The center of rotation lies at y + r cos(theta), with r = v / omega.",
                    id="step_arc-f3baa0",
                ),
                Mistake(
                    _straight(_chord, _before, _turn),
                    "The half turn has the wrong sign: the chord points along theta + h.",
                ),
                Mistake(
                    _straight(_chord, _mean, _turn),
                    "You halve theta as well: the direction is theta + omega T / 2, not (theta + omega T) / 2.",
                    id="step_arc-3e15da",
                ),
                Mistake(
                    _straight(_chord, _beyond, _turn),
                    "Your direction is theta + 3 omega T / 2: is the heading turned before cosine and sine use it? To the old theta half of the turn is added.",
                    id="step_arc-950064",
                ),
                Mistake(
                    _straight(_chord, lambda th, v, w, dt: th + w / 2, _turn),
                    "The time step is missing inside cosine and sine: h = omega T / 2.",
                ),
                Mistake(
                    _straight(lambda th, v, w, dt: v * dt * np.sinc(w * dt), _half, _turn),
                    "`np.sinc(t)` is sin(pi t) / (pi t): give it h / pi, with h = omega T / 2.",
                ),
                Mistake(
                    _straight(lambda th, v, w, dt: v * dt * np.sin(w * dt / 2), _half, _turn),
                    "The division by h is missing: sin(h) / h.",
                ),
                Mistake(
                    _straight(lambda th, v, w, dt: v / w * np.sin(w * dt / 2), _half, _turn),
                    "This is half the chord: with r = v / omega it is 2 r sin(h).",
                ),
                Mistake(
                    _arc_from(lambda v, w: v / abs(w)),
                    "No absolute value: r = v / omega changes its sign with omega, and the center of rotation its side.",
                    id="step_arc-e83ed8",
                ),
                Mistake(
                    _arc_from(lambda v, w: w / v),
                    "The radius is v / omega: the faster it turns, the smaller the circle.",
                ),
                Mistake(
                    lambda x, u, dt: step_arc(x, u, dt) + u[0] / u[1] * np.array([np.sin(x[2]), -np.cos(x[2]), 0.0]),
                    "The center of rotation is missing: it lies at x - r sin(theta), y + r cos(theta).",
                ),
                Mistake(
                    lambda x, u, dt: step_arc(x, u, dt) * [-1, 1, 1] + 2 * x * [1, 0, 0],
                    "y is right; x changes by the right amount with the wrong sign. The center of rotation lies at x - r sin(theta), with r = v / omega.",
                    id="step_arc-039c64",
                ),
                *(
                    Mistake(
                        functools.partial(_short_steps, step=step, n=n),
                        "Short straight steps come near the arc, but so few do not reach it: write down the arc itself, in one step.",
                    )
                    for step in (step_euler, step_midpoint)
                    for n in (2, 4, 5, 10, 20, 50, 100)
                ),
                *_slips(_chord, _half, "theta + h")[:-1],  # the sign in y has its own text above
                Mistake(
                    lambda x, u, dt: step_arc(x, u, dt) if u[1] else x + [0.0, 0.0, 0.0],
                    "For omega = 0 your robot stays where it is. There it drives v T straight on: sin(h) / h is 1, and not 0, at h = 0.",
                    id="step_arc-stands-still",
                ),
            ],
        ),
        Prediction(
            "order",
            question="You halve the time step. What becomes of the midpoint model's error at the end of a drive?",
            choices=("it halves", "it becomes a quarter", "it stays"),
            answer="it becomes a quarter",
            why="The midpoint model is of second order, the simplified one of first. The arc is exact at any time step.",
        ),
        Exercise(
            "jacobian_state",
            reference=jacobian_state,
            sizes=("u", "dt"),
            draw=EITHER_WAY,
            fixed=PLANAR,
            metric=metrics.Numbers(1e-5),
            noisy=(BACKWARD, *special_steps(metrics.Numbers(1e-5), small=metrics.Numbers(1e-6))),
            hints=(
                "Change x, y or theta a little: what does it change in the pose after the step?",
                "A shift of x or y is passed on as it is. A turn of theta swings the way v T sideways.",
                "`F_x = np.eye(3)\n"
                "F_x[0, 2] = -u[0] * dt * np.sin(x[2])\n"
                "F_x[1, 2] = u[0] * dt * np.cos(x[2])\n"
                "return F_x`",
            ),
            mistakes=[
                Mistake(
                    _state_entries(lambda x, u, t: u[0] * t * np.sin(x[2]), lambda x, u, t: u[0] * t * np.cos(x[2])),
                    "The derivative of the cosine is minus the sine: a sign in row 0.",
                ),
                Mistake(
                    _state_entries(lambda x, u, t: -t * np.sin(x[2]), lambda x, u, t: t * np.cos(x[2])),
                    "The speed is missing: the way is v T.",
                ),
                Mistake(
                    _state_entries(lambda x, u, t: -u[0] * np.sin(x[2]), lambda x, u, t: u[0] * np.cos(x[2])),
                    "The time step is missing: the way is v T.",
                ),
                Mistake(
                    _state_entries(lambda x, u, t: u[0] * t * np.cos(x[2]), lambda x, u, t: u[0] * t * np.sin(x[2])),
                    "You put in the step itself. The Jacobian holds its derivative by theta.",
                ),
                Mistake(
                    _state_entries(lambda x, u, t: -u[0] * t * np.cos(x[2]), lambda x, u, t: u[0] * t * np.sin(x[2])),
                    "Sine and cosine are exchanged: the derivative of the cosine is minus the sine.",
                ),
                Mistake(
                    lambda x, u, t: jacobian_state(step_euler(x, u, t), u, t),
                    "You put in the new heading. The simplified model drives along the old one.",
                ),
                Mistake(
                    lambda x, u, t: odometry.step_jacobians(x, u, t, "midpoint")[0],
                    "This belongs to the midpoint model. The lecture derives the simplified one.",
                ),
                Mistake(
                    lambda x, u, t: odometry.step_jacobians(x, u, t, "arc")[0],
                    "This belongs to the exact arc. The lecture derives the simplified model.",
                ),
                Mistake(
                    lambda x, u, t: jacobian_state(x, np.abs(u), t),
                    "You take |v|. In reverse v is negative, and the signs of both entries in the last column turn with it.",
                ),
                Mistake(
                    lambda x, u, dt: jacobian_state(x, u, dt) - np.eye(3),
                    "The pose before the step is missing: its derivative by itself is the identity.",
                ),
                Mistake(
                    _state_entries(lambda x, u, t: -u[0] * t * np.sin(x[2]), lambda x, u, t: -u[0] * t * np.cos(x[2])),
                    "The derivative of the sine is plus the cosine: a sign in row 1.",
                ),
                Mistake(
                    _state_entries(lambda x, u, t: u[0] * t * np.sin(x[2]), lambda x, u, t: -u[0] * t * np.cos(x[2])),
                    "Both signs in the last column are turned around: the cosine becomes minus the sine, the sine plus the cosine.",
                ),
                Mistake(
                    _state_entries(lambda x, u, t: -np.sin(x[2]), lambda x, u, t: np.cos(x[2])),
                    "Speed and time step are missing: the way is v T.",
                ),
                Mistake(
                    _state_entries(lambda x, u, t: -u[1] * t * np.sin(x[2]), lambda x, u, t: u[1] * t * np.cos(x[2])),
                    "You took omega for the speed: the way is v T, and v is u[0].",
                ),
                Mistake(
                    lambda x, u, t: jacobian_state(x, u, t) - np.diag([0, 0, 1]),
                    "theta' = theta + omega T: its derivative by theta, the last entry, is 1.",
                ),
                Mistake(
                    lambda x, u, t: jacobian_state(x, u, t) + np.diag([0, 0, u[1] * t]),
                    "omega T does not depend on theta: the last entry is 1.",
                ),
                Mistake(
                    lambda x, u, t: jacobian_state(x, u, t) + np.diag([0, 0, t - 1]),
                    "theta' = theta + omega T: its derivative by theta, the last entry, is 1, not T.",
                ),
                Mistake(
                    lambda x, u, t: np.hstack([jacobian_state(x, u, t), jacobian_control(x, u, t)]),
                    "This is the whole Jacobian, by pose and control. F_x is its first three columns.",
                ),
                Mistake(
                    lambda x, u, t: jacobian_control(x, u, t),
                    "This is F_u, by the control. F_x is the derivative by the pose.",
                ),
            ],
        ),
        Exercise(
            "jacobian_control",
            reference=jacobian_control,
            sizes=("u", "dt"),
            draw=EITHER_WAY,
            fixed=PLANAR,
            metric=metrics.Numbers(1e-5),
            noisy=(BACKWARD, *special_steps(metrics.Numbers(1e-5), small=metrics.Numbers(1e-6))),
            hints=(
                "Three rows (x, y, theta), two columns (v, omega).",
                "A little more v moves the robot by T along the heading; a little more omega turns it by T.",
                "`return dt * np.array([[np.cos(x[2]), 0], [np.sin(x[2]), 0], [0, 1]])`",
            ),
            mistakes=[
                Mistake(
                    _control_entries(lambda x, t: np.cos(x[2]), lambda x, t: np.sin(x[2]), lambda t: 1.0),
                    "The time step is missing.",
                ),
                Mistake(
                    _control_entries(lambda x, t: t * np.sin(x[2]), lambda x, t: t * np.cos(x[2]), lambda t: t),
                    "Sine and cosine are exchanged.",
                ),
                Mistake(
                    lambda x, u, t: jacobian_control(x, u, t) * u,
                    "You left v and omega in. The step is linear in both, so its derivatives by them no longer contain them.",
                ),
                Mistake(
                    lambda x, u, t: odometry.step_jacobians(x, u, t, "midpoint")[1],
                    "This belongs to the midpoint model. The lecture derives the simplified one.",
                ),
                Mistake(
                    lambda x, u, t: odometry.step_jacobians(x, u, t, "arc")[1],
                    "This belongs to the exact arc. The lecture derives the simplified model.",
                ),
                Mistake(
                    _control_entries(lambda x, t: t * np.cos(x[2]), lambda x, t: t * np.sin(x[2]), lambda t: 1.0),
                    "The last entry is T: omega acts for a time step.",
                ),
                Mistake(
                    _control_entries(lambda x, t: np.cos(x[2]), lambda x, t: np.sin(x[2]), lambda t: t),
                    "The time step is missing from the first column: the way is v T.",
                ),
                Mistake(
                    lambda x, u, t: jacobian_control(x, u, t) * [u[0], 1.0],
                    "You left v in the first column. The way is v T, so its derivative by v is T.",
                ),
                Mistake(
                    lambda x, u, t: jacobian_control(x, u, t) * [1.0, u[1]],
                    "You left omega in the second column: the derivative of omega T by omega is T.",
                ),
                Mistake(
                    lambda x, u, t: jacobian_control(x, u, t) * u / t,
                    "You left v and omega in, and the time step out: the derivatives of v T and omega T are T.",
                ),
                Mistake(
                    lambda x, u, t: jacobian_control(x, u, t)[:, ::-1],
                    "The columns are exchanged: first v, then omega.",
                ),
                Mistake(
                    _control_entries(lambda x, t: -t * np.sin(x[2]), lambda x, t: t * np.cos(x[2]), lambda t: t),
                    "You took the derivative by theta. By v the cosine stays a cosine and the sine a sine.",
                ),
                Mistake(
                    _control_entries(lambda x, t: t * np.cos(x[2]), lambda x, t: t * np.sin(x[2]), lambda t: 0.0),
                    "omega turns the robot: the last entry is T.",
                ),
                Mistake(
                    _control_entries(lambda x, t: t * np.cos(x[2]), lambda x, t: -t * np.sin(x[2]), lambda t: t),
                    "A sign: by v, the sine in row 1 stays plus the sine.",
                ),
                Mistake(
                    lambda x, u, t: jacobian_control(step_euler(x, u, t), u, t),
                    "You put in the new heading. The simplified model drives along the old one.",
                ),
                Mistake(
                    lambda x, u, t: jacobian_state(x, u, t),
                    "This is F_x, by the pose. F_u is the derivative by the control.",
                ),
            ],
        ),
        Exercise(
            "control_covariance",
            reference=odometry.control_covariance,
            sizes=("u", "dt", "k_d", "k_theta", "k_drift"),
            draw=NOISY_CONTROLS,
            fixed={"u": PLANAR["u"]},
            metric=metrics.Numbers(1e-9),
            noisy=[
                (functools.partial(noisy_control, signs=signs), metrics.Numbers(1e-9), IN_CURVES_ONLY.format(does))
                for signs, does in (
                    ((0, 1), "turns on the spot, v = 0"),
                    ((0, -1), "turns to the right on the spot"),
                    ((1, 0), "drives straight on, omega = 0"),
                    ((-1, 0), "drives straight back"),
                    ((0, 0), "rests, u = (0, 0)"),
                    ((0.03, 0.03), "hardly moves and hardly turns"),
                )
            ]
            + [
                (short_time, metrics.Numbers(1e-9), "right, but not for time steps of a hundredth of a second:"),
                *(
                    (
                        functools.partial(scaled, draw=NOISY_CONTROLS[0], factors=factors),
                        metrics.Numbers(1e-9, least=0),
                        f"right, but not for {this}:",
                    )
                    for factors, this in (
                        ((10, 40, 50, 50, 50), "a fast robot, time steps of seconds and large constants of the noise"),
                        ((1, 1, 1e-3, 1e-3, 1e-3), "small constants of the noise, below 0.0001"),
                    )
                ),
            ],
            hints=(
                "A diagonal matrix: the variance of v and the variance of omega.",
                "sigma_v^2 = k_d |v| / T and sigma_omega^2 = (k_theta |omega| + k_drift |v|) / T.",
                "`v, omega = np.abs(u)\nreturn np.diag([k_d * v / dt, (k_theta * omega + k_drift * v) / dt])`",
            ),
            mistakes=[
                *_without_absolute_values(),
                Mistake(
                    _covariance(lambda v, w, t, a, b, c: a * abs(v), lambda v, w, t, a, b, c: b * abs(w) + c * abs(v)),
                    "The division by T is missing: the constants speak of ways, the variances of speeds.",
                ),
                Mistake(
                    _covariance(
                        lambda v, w, t, a, b, c: a * abs(v) * t, lambda v, w, t, a, b, c: (b * abs(w) + c * abs(v)) * t
                    ),
                    "You multiplied by T. The variance of the way is k_d |v| T; the speed is that way divided by T, so its variance by T squared.",
                    id="control_covariance-ab70e0",
                ),
                Mistake(
                    _covariance(lambda v, w, t, a, b, c: a * abs(v) / t, lambda v, w, t, a, b, c: b * abs(w) / t),
                    "The drift is missing: k_drift |v| / T counts in a curve and on a straight line, on which a robot turns a little as well.",
                    id="control_covariance-bd269a",
                ),
                Mistake(
                    _covariance(lambda v, w, t, a, b, c: a * abs(v) / t, lambda v, w, t, a, b, c: c * abs(v) / t),
                    "k_theta is missing: turning errs as well, by k_theta |omega| / T.",
                ),
                Mistake(
                    _covariance(lambda v, w, t, a, b, c: a * abs(v) / t, lambda v, w, t, a, b, c: (b + c) * abs(w) / t),
                    "The drift comes with the way, not with the turn: k_drift |v| / T.",
                ),
                Mistake(
                    _covariance(
                        lambda v, w, t, a, b, c: a * v**2 / t, lambda v, w, t, a, b, c: (b * w**2 + c * v**2) / t
                    ),
                    "Here the variance grows with the way itself, not with its square: |v| and |omega|.",
                ),
                Mistake(
                    lambda u, dt, a, b, c: np.sqrt(odometry.control_covariance(u, dt, a, b, c)),
                    "These are standard deviations. A covariance matrix holds variances.",
                ),
                Mistake(
                    _covariance(
                        lambda v, w, t, a, b, c: a * abs(v) / t,
                        lambda v, w, t, a, b, c: (c * abs(w) + b * abs(v)) / t,
                    ),
                    "k_theta and k_drift have changed places: k_theta belongs to the turn, k_drift to the way.",
                ),
                Mistake(
                    _covariance(
                        lambda v, w, t, a, b, c: a * abs(v) / t,
                        lambda v, w, t, a, b, c: abs(b * w + c * v) / t,
                    ),
                    "Take the absolute values one by one: both errors add, whichever way it turns.",
                ),
                Mistake(
                    _covariance(
                        lambda v, w, t, a, b, c: a * v**2 / t,
                        lambda v, w, t, a, b, c: (b * abs(w) + c * v**2) / t,
                    ),
                    "The speed is squared here. Its variances grow with the way, |v| T, not with its square.",
                    id="control-speed-squared",
                ),
                Mistake(
                    _covariance(
                        lambda v, w, t, a, b, c: a * abs(v) / t**2,
                        lambda v, w, t, a, b, c: (b * abs(w) + c * abs(v)) / t**2,
                    ),
                    "You divided by T twice: k_d d / T^2 with the way d = v T leaves one T.",
                ),
                Mistake(
                    _covariance(
                        lambda v, w, t, a, b, c: a * abs(v) / t,
                        lambda v, w, t, a, b, c: b * abs(w) + c * abs(v) / t,
                    ),
                    "Both parts of the turn rate's variance are divided by T: brackets.",
                ),
                Mistake(
                    _covariance(
                        lambda v, w, t, a, b, c: a * abs(v) / t,
                        lambda v, w, t, a, b, c: b * abs(w) / t + c * abs(v),
                    ),
                    "Both parts of the turn rate's variance are divided by T: the drift, too.",
                ),
                Mistake(
                    _covariance(
                        lambda v, w, t, a, b, c: a * abs(v) / t,
                        lambda v, w, t, a, b, c: b * abs(w) + c * abs(v),
                    ),
                    "The division by T is missing from the turn rate's variance.",
                ),
                Mistake(
                    _covariance(
                        lambda v, w, t, a, b, c: a * abs(v),
                        lambda v, w, t, a, b, c: (b * abs(w) + c * abs(v)) / t,
                    ),
                    "The division by T is missing from the speed's variance.",
                ),
                Mistake(
                    _covariance(
                        lambda v, w, t, a, b, c: (a + c) * abs(v) / t,
                        lambda v, w, t, a, b, c: b * abs(w) / t,
                    ),
                    "The drift comes from the way, but it turns the robot: it belongs to the variance of omega.",
                ),
                Mistake(
                    _covariance(
                        lambda v, w, t, a, b, c: (b * abs(w) + c * abs(v)) / t,
                        lambda v, w, t, a, b, c: a * abs(v) / t,
                    ),
                    "The order is v, omega: your variances are exchanged.",
                ),
                Mistake(
                    _covariance(
                        lambda v, w, t, a, b, c: a * abs(v) / t,
                        lambda v, w, t, a, b, c: (b * abs(w) - c * abs(v)) / t,
                    ),
                    "Variances of independent errors add.",
                ),
                Mistake(
                    lambda u, dt, a, b, c: np.diag(odometry.control_covariance(u, dt, a, b, c)),
                    "The variances are right. A covariance matrix has them on its diagonal: np.diag.",
                ),
                Mistake(
                    lambda u, dt, a, b, c: odometry.control_covariance(u, dt, a, b, c) ** 2,
                    "sigma^2 in the formula is the variance already: do not square it.",
                ),
            ],
        ),
        Exercise(
            "propagate",
            reference=propagate,
            sizes=("cov", "u", "dt", "cov_u"),
            draw=tuple(functools.partial(pose_and_covariances, side=s, gear=g) for g in (1, -1) for s in (1, -1)),
            fixed=PLANAR | {"cov": "the covariance of a planar pose", "cov_u": "the covariance of v and omega"},
            metric=POSE_AND_COV,
            noisy=(
                *special_controls(POSE_AND_COV, covariances_at_special_controls),
                *(
                    (functools.partial(scaled, draw=pose_and_covariances, factors=factors), POSE_AND_SMALL_COV, words)
                    for factors, words in (
                        ((1, 0, 1, 1, 1), "right, but not where the drive begins, with a covariance of zeros:"),
                        ((1, 1, 1, 1, 0), "right, but not where the control is carried out exactly, cov_u = 0:"),
                        ((20, 1e-6, 1, 0.01, 1e-4), "right, but not for small covariances and short time steps:"),
                        (
                            (1, 1e4, 20, 10, 1e3),
                            "right, but not for large covariances, high speeds and long time steps:",
                        ),
                    )
                ),
            ),
            hints=(
                "The pose takes the step. The covariance takes the old uncertainty along and adds that of the control.",
                "cov' = F_x cov F_x^T + F_u cov_u F_u^T, with both Jacobians at the old pose.",
                "`F_x, F_u = jacobian_state(x, u, dt), jacobian_control(x, u, dt)\n"
                "return step_euler(x, u, dt), F_x @ cov @ F_x.T + F_u @ cov_u @ F_u.T`",
            ),
            mistakes=[
                Mistake(
                    _propagated(lambda F, G, P, Q: F @ P @ F.T),
                    "You only carry the old uncertainty along: the control's own is missing.",
                ),
                Mistake(
                    _propagated(lambda F, G, P, Q: P + G @ Q @ G.T),
                    "You only add the control's uncertainty: the old one must be carried along by F_x.",
                ),
                Mistake(
                    _propagated(lambda F, G, P, Q: F.T @ P @ F + G @ Q @ G.T),
                    "F_x is on the wrong side: F cov F^T, not F^T cov F.",
                ),
                Mistake(
                    lambda x, P, u, t, Q: (x, propagate(x, P, u, t, Q)[1]),
                    "The covariance is right, but the pose did not move.",
                ),
                Mistake(
                    lambda x, P, u, t, Q: (step_midpoint(x, u, t), propagate(x, P, u, t, Q)[1]),
                    "The covariance is right. The pose took the midpoint step; the lecture propagates with the simplified model.",
                ),
                Mistake(
                    lambda x, P, u, t, Q: (step_euler(x, u, t), propagate(step_euler(x, u, t), P, u, t, Q)[1]),
                    "Your Jacobians are taken at the new pose. They belong at the old one, where the step begins.",
                    id="propagate-8e456c",
                ),
                Mistake(
                    _propagated(lambda F, G, P, Q: F * P * F.T + G @ Q @ G.T),
                    "`*` multiplies entry by entry. The matrix product is `@`.",
                ),
                Mistake(
                    _propagated(lambda F, G, P, Q: F @ P @ F + G @ Q @ G.T),
                    "The last factor is the transpose of F_x.",
                ),
                Mistake(
                    _propagated(lambda F, G, P, Q: G @ Q @ G.T),
                    "The old covariance is missing: F_x cov F_x^T is to be added.",
                ),
                Mistake(
                    _propagated(lambda F, G, P, Q: F @ P @ F.T - G @ Q @ G.T), "Uncertainties add: there is no minus."
                ),
                Mistake(
                    _propagated(lambda F, G, P, Q: F @ P + G @ Q @ G.T),
                    "A covariance is multiplied from both sides: F_x cov F_x^T.",
                ),
                Mistake(
                    _propagated(lambda F, G, P, Q: F @ P @ F.T + G @ G.T),
                    "The covariance of the control is missing between F_u and its transpose.",
                ),
                Mistake(
                    _propagated(lambda F, G, P, Q: P @ F @ F.T + G @ Q @ G.T),
                    "The order: cov stands between F_x and its transpose.",
                ),
                Mistake(
                    _propagated(lambda F, G, P, Q: F @ P @ np.linalg.inv(F) + G @ Q @ G.T),
                    "The last factor is the transpose of F_x, not its inverse.",
                ),
                Mistake(
                    _propagated(lambda F, G, P, Q: F @ (P + G @ Q @ G.T) @ F.T),
                    "The control's noise comes in during this step: it is added after F_x cov F_x^T, not carried along with it.",
                ),
                Mistake(
                    _propagated(lambda F, G, P, Q: F @ np.diag(np.diag(P)) @ F.T + G @ Q @ G.T),
                    "You left the correlations of the old pose out: carry the whole matrix.",
                ),
                Mistake(
                    lambda x, P, u, t, Q: (
                        jacobian_state(x, u, t) @ x + jacobian_control(x, u, t) @ u,
                        propagate(x, P, u, t, Q)[1],
                    ),
                    "The covariance is right. The pose takes the step of the model itself: the Jacobians only carry small errors.",
                ),
                Mistake(
                    lambda x, P, u, t, Q: (step_arc(x, u, t), propagate(x, P, u, t, Q)[1]),
                    "The covariance is right. The pose drove the arc; the lecture propagates with the simplified model.",
                ),
                Mistake(
                    lambda x, P, u, t, Q: odometry.propagate(x, P, u, t, Q, "midpoint"),
                    "This is the midpoint model throughout; the lecture propagates with the simplified one.",
                ),
                Mistake(lambda x, P, u, t, Q: propagate(x, P, u, t, Q)[::-1], "The order is pose, covariance."),
            ],
        ),
        Prediction(
            "spread",
            question="The robot drives 14 m straight on by odometry alone. Where does its true position most likely differ?",
            choices=("ahead or behind", "to the left or right", "all around alike"),
            answer="to the left or right",
            why="A small turn at the beginning moves the far end sideways, and more so the farther it drives: heading errors win over distance errors.",
        ),
        Value(
            "end_pose",
            reference=lambda: _circle()[0],
            unit="m, rad",
            metric=metrics.PlanarPoses(1e-6),
            hints=(
                "Start at (0, 0, 0) and take all 140 steps with the simplified model.",
                "Loop over drive.controls with your `step_euler`: the pose after one step is the start of the next.",
                "`end_pose = np.zeros(3)\nfor u in drive.controls: end_pose = step_euler(end_pose, u, drive.dt)`",
            ),
            mistakes=[
                Mistake(
                    lambda: _circle("midpoint")[0],
                    "This is the end of the midpoint model; the lecture propagates with the simplified one.",
                ),
                Mistake(
                    lambda: _circle("arc")[0],
                    "This is where the arc ends, the true drive. The estimate of the simplified model ends elsewhere.",
                ),
                Mistake(
                    lambda: odometry.drive(np.zeros(3), lecture.circle_drive().controls[:-1], 0.1, "euler")[-1],
                    "One step is missing: there are 140.",
                ),
                Mistake(
                    lambda: step_euler(_circle()[0], lecture.circle_drive().controls[-1], 0.1),
                    "One step too many: there are 140.",
                ),
                Mistake(
                    lambda: step_euler(np.zeros(3), lecture.circle_drive().controls[0], 14.0),
                    "This is one step of 14 s, straight along the first heading. Take 140 steps of 0.1 s.",
                ),
                Mistake(
                    lambda: _circle()[0] * [1, 1, np.degrees(1)],
                    "The position is right. The heading is in degrees: leave it in radians.",
                ),
                Mistake(
                    lambda: _loop(steps=1)[0],
                    "This is the end of the first step: the pose has to be handed on from step to step.",
                ),
                Mistake(lambda: np.zeros(3), "This is the start. Does the loop store the new pose?"),
                Mistake(
                    lambda: _from_elsewhere(np.array([0.0, 0.0, np.pi / 2])),
                    "Your drive starts with a heading of 90 deg. At the origin of the poses, (0, 0, 0), it is 0.",
                ),
                Mistake(
                    lambda: _loop(_turned_first)[0],
                    "Each step turns first and drives along the new heading. The simplified model drives along the old one.",
                ),
                Mistake(
                    lambda: odometry.drive(np.zeros(3), lecture.circle_drive().controls, 1.0, "euler")[-1],
                    "Your steps last 1 s. `drive.dt` is 0.1 s.",
                ),
                Mistake(
                    lambda: np.array([0, 0, _circle()[0][2]]),
                    "The heading is right. The circle does not close: it turns by 336 deg, so the position follows from the steps.",
                ),
                Mistake(
                    lambda: np.array([0.0, 0.0, 2 * np.pi]),
                    "This is a circle that closes. 140 steps turn by 336 deg, and straight steps do not stay on the arc: add them up.",
                ),
                Mistake(lambda: _circle()[0] * [1, 1, 0], "The position is right, the heading is missing."),
                Mistake(
                    lambda: _circle()[0] * [1, -1, -1],
                    "Your robot drives its circle to the right: omega > 0 turns left.",
                ),
            ],
        ),
        Value(
            "end_cov",
            reference=lambda: _circle()[1],
            metric=metrics.Numbers(1e-6),
            hints=(
                "The same loop as for the pose, with `propagate` in place of the step: it hands on pose and covariance.",
                "The control's covariance is `control_covariance(u, drive.dt, **drive.noise)`; the pose's starts as zeros.",
                "`x, end_cov = np.zeros(3), np.zeros((3, 3))\n"
                "for u in drive.controls: x, end_cov = propagate(x, end_cov, u, drive.dt, control_covariance(u, drive.dt, **drive.noise))`",
            ),
            mistakes=[
                Mistake(lambda: _circle(k_drift=0.0)[1], "The drift is missing from the control's covariance."),
                Mistake(
                    lambda: _circle(k_theta=0.0)[1],
                    "The turning error k_theta is missing from the control's covariance.",
                ),
                Mistake(
                    _without_carrying,
                    "Here the noise of the steps is added up, no more. Earlier heading errors also move all later positions: F_x cov F_x^T.",
                    id="end_cov-53000c",
                ),
                *(
                    Mistake(
                        lambda turns=turns: _loop(turns=turns)[1],
                        "The ellipse has its size, and is turned: the drive begins with another heading, or each step takes its Jacobians at another. Start at (0, 0, 0), and "
                        "take them at the old pose.",
                        id=f"end-cov-turned-{turns:g}",
                    )
                    for turns in (0.5, -0.5)
                ),
                Mistake(
                    _in_one_step,
                    "This takes the whole drive as one step. There are 140, and each begins where the one before ended, with another heading.",
                    id="end-cov-one-step",
                ),
                Mistake(
                    lambda: _circle("midpoint")[1],
                    "This is the midpoint model's covariance; the lecture uses the simplified one.",
                ),
                Mistake(
                    lambda: _loop(**{name: value**0.5 for name, value in lecture.circle_drive().noise.items()})[1],
                    "This takes the roots of the three constants. They are variances per meter or turn, as drive.noise holds them.",
                ),
                Mistake(lambda: _loop(k_d=0.0)[1], "The distance error k_d is missing from the control's covariance."),
                Mistake(
                    lambda: _loop(k_theta=5.0**2 / 360, k_drift=2.0**2)[1],
                    "k_theta and k_drift are in degrees. `drive.noise` holds them in radians.",
                ),
                Mistake(
                    lambda: _loop(_not_handed_on)[1],
                    "Every step starts at the pose of the start here: hand the pose on as well as the covariance, `x, end_cov = propagate(...)`.",
                ),
                Mistake(
                    lambda: _loop(_moved_before)[1],
                    "The pose is moved twice in every step. `propagate` takes the step itself, from the pose before it.",
                ),
                Mistake(
                    lambda: _loop(at_the_end=True)[1],
                    "This starts where the drive before ended. The pose starts at zeros again, like the covariance.",
                ),
                Mistake(
                    lambda: _loop(_begun_anew)[1],
                    "This is what the last step alone adds. The covariance of zeros belongs before the loop: each step takes up "
                    "that of the step before.",
                ),
                Mistake(
                    lambda: _loop(noise_time=1.0)[1],
                    "The control's covariance is that of a step of 1 s, as it is too when multiplied by `drive.dt`. Make it for `drive.dt`, 0.1 s, and take it as it is.",
                    id="end_cov-2116a0",
                ),
                *(
                    Mistake(functools.partial(_exchanged, *names), f"{' and '.join(names)} have changed places.")
                    for names in (("k_theta", "k_drift"), ("k_d", "k_drift"), ("k_d", "k_theta"))
                ),
                Mistake(
                    lambda: _loop(start_cov=1.0)[1],
                    "This starts with the identity. The start is known: a covariance of zeros.",
                    id="end_cov-4019c7",
                ),
                Mistake(
                    lambda: np.zeros((3, 3)), "This is the covariance of the start. Does the loop store the new one?"
                ),
                Mistake(lambda: _loop(steps=-1)[1], "One step is missing: there are 140."),
                Mistake(lambda: _loop(again=1)[1], "One step too many: there are 140."),
                Mistake(
                    lambda: _loop(again=140)[1],
                    "The drive is taken twice: is the cell's loop run on what it left behind? Begin it with zeros.",
                ),
                Mistake(
                    lambda: _loop(steps=1)[1],
                    "This is one step's covariance: it has to be handed on from step to step.",
                ),
                Mistake(
                    lambda: np.diag(np.sqrt(np.diag(_circle()[1]))),
                    "These are standard deviations on the diagonal. Asked for is the covariance matrix as `propagate` gives it.",
                ),
                Mistake(
                    lambda: np.sqrt(np.abs(_circle()[1])),
                    "These are the roots of all entries. Asked for is the covariance matrix as `propagate` gives it.",
                ),
                Mistake(
                    lambda: np.diag(np.diag(_circle()[1])),
                    "The diagonal is right. Hand in the whole matrix, correlations included.",
                ),
                Mistake(
                    lambda: _circle()[1] * np.outer([1, 1, np.degrees(1)], [1, 1, np.degrees(1)]),
                    "The heading is in degrees: leave it in radians.",
                ),
                Mistake(lambda: _loop(_wrong_side)[1], "F_x is on the wrong side: F cov F^T, not F^T cov F."),
                Mistake(
                    lambda: _loop(_at_new_pose)[1],
                    "Your Jacobians are taken at the new pose: compute them before the pose moves.",
                ),
                Mistake(
                    lambda: _circle("arc")[1],
                    "This is the covariance of the exact arc; the lecture uses the simplified model.",
                ),
            ],
        ),
        Prediction(
            "banana",
            question="The ellipse of error propagation is said to hold 95 % of the poses. What share of the true ends does it hold after 14 m straight on?",
            choices=("about 60 %", "about 85 %", "about 95 %"),
            answer="about 85 %",
            why="The true ends lie on a bent band, because a wrong heading swings the way around. An ellipse cannot bend.",
        ),
        Exercise(
            "wheel_offset",
            reference=wheel_offset,
            sizes=("way", "track"),
            draw=UNEQUAL,
            metric=metrics.Numbers(1e-6, "m"),
            noisy=(
                (
                    wheels_hardly_unequal,
                    metrics.Numbers(1e-6, "m"),
                    "right, but not for an excess of less than a thousandth, which shows on a long way as well:",
                ),
                (
                    functools.partial(scaled, draw=unequal_wheels, factors=(0.005, 1, 1)),
                    metrics.Numbers(1e-9, "m"),
                    "right, but not for a short way, 10 cm at most:",
                ),
                (
                    functools.partial(scaled, draw=unequal_wheels, factors=(50, 10, 8)),
                    metrics.Numbers(1e-6, "m"),
                    "right, but not for a long way of a wide robot whose wheels are very unequal (an excess of 5 % and more):",
                ),
            ),
            hints=(
                "The larger wheel goes farther than it is believed to: by how much does the robot turn, and how long is the way of its middle?",
                "It turns by delta = way * excess / track over d = way * (1 + excess / 2), on a circle of radius d / delta. How far aside is its end?",
                "`turn = way * excess / track\n"
                "middle = way * (1 + excess / 2)\n"
                "return middle / turn * (1 - np.cos(turn))`",
            ),
            mistakes=[
                Mistake(
                    lambda way, excess, track: way * excess,
                    "This is by how much farther the right wheel goes. Divided by the track it is an angle.",
                ),
                Mistake(
                    _offset(lambda d, turn, way: d * turn),
                    "You take the last heading for the whole way. It grows from 0: to first order half of it counts.",
                ),
                Mistake(
                    _offset(lambda d, turn, way: d * np.sin(turn)),
                    "You take the last heading for the whole way. It grows from 0 on.",
                ),
                Mistake(
                    _offset(lambda d, turn, way: d * turn / 2),
                    "Right to first order. Where the robot turns far, that is not enough: use the circle itself.",
                    id="wheel_offset-553a5b",
                ),
                Mistake(
                    _offset(lambda d, turn, way: way * turn / 2),
                    "Right to first order. Where the robot turns far, that is not enough, and the middle does not go the way that was counted: use the circle.",
                    "wheel_offset-d23ac4",
                ),
                Mistake(
                    _offset(lambda d, turn, way: d * np.sin(turn / 2)),
                    "The direction of the chord is right. The chord is shorter than the arc: times sin(h) / h, h half the turn.",
                ),
                Mistake(
                    _offset(lambda d, turn, way: way / turn * (1 - np.cos(turn))),
                    "Here the middle of the robot goes the way that was counted. The left wheel goes that way, the middle "
                    "way (1 + excess / 2): on a circle whose signed radius is larger by half a track.",
                    "wheel_offset-6b4841",
                ),
                Mistake(
                    _offset(lambda d, turn, way: d / turn * (1 - np.cos(d * turn / way))),
                    "The radius is right. This turns by the middle's way times excess / track; the turn is the difference of "
                    "both wheels' ways, way * excess, by the track.",
                ),
                Mistake(
                    _offset(lambda d, turn, way: way / turn * (1 - np.cos(d * turn / way))),
                    "Two slips: the middle goes round a circle of radius track / excess + track / 2, and it turns by "
                    "way * excess / track.",
                ),
                Mistake(
                    _offset(lambda d, turn, way: d / turn * (1 - np.cos(way * turn / d))),
                    "The radius is right. The middle does not go the way that was counted: it turns by way (1 + excess / 2) / radius.",
                    id="wheel_offset-3771a4",
                ),
                Mistake(
                    lambda way, excess, track: wheel_offset(way, excess, track) * (1 + excess) / (1 + excess / 2),
                    "You let the middle of the robot go as far as its right wheel.",
                ),
                Mistake(
                    _offset(lambda d, turn, way: d / turn * np.sin(turn)),
                    "This is how far ahead it ends. Asked is how far to the left.",
                ),
                Mistake(
                    _offset(lambda d, turn, way: 2 * d / turn * np.sin(turn / 2)),
                    "This is the chord, 2 r sin(h) with h half the turn. Asked is how far to the left: times sin(h).",
                    id="wheel_offset-1c6a82",
                ),
                *(
                    Mistake(
                        _in_straight_steps(n, along),
                        "You add up short straight steps. The more there are, the nearer they come, but the circle gives the "
                        "exact answer.",
                        id=f"wheel_offset-{n}-steps-{along:g}",
                    )
                    for n in (10, 14, 20, 50, 100, 140, 200, 500, 1000)
                    for along in (0.0, 0.5, 1.0)
                    if along != 0.5 or n < 500  # so many steps along the middle heading are as good as the circle
                ),
                Mistake(
                    lambda way, excess, track: -wheel_offset(way, excess, track),
                    "The sign: a larger right wheel goes farther and turns the robot to the left, a smaller one to the right.",
                    id="wheel_offset-b7b78f",
                ),
                Mistake(
                    lambda way, excess, track: wheel_offset(way, 2 * excess, track) * (1 + excess / 2) / (1 + excess),
                    "Your turn is twice too large: the difference of the ways is divided by the whole track, not by half of it.",
                ),
                Mistake(
                    lambda way, excess, track: way * excess / track,
                    "This is the angle by which it turns (rad). Asked is how far aside it ends.",
                ),
                Mistake(
                    lambda way, excess, track: abs(wheel_offset(way, excess, track)),
                    "Where the right wheel is smaller the robot ends on its right: no absolute value.",
                ),
            ],
        ),
        Exercise(
            "ackermann_twist",
            reference=ackermann_twist,
            sizes=("speed", "wheelbase"),
            draw=CARS,
            metric=metrics.Numbers(1e-9),
            noisy=(
                *(
                    (
                        functools.partial(car_nearly_straight_on, turned=np.radians(turned)),
                        metrics.Numbers(1e-9),
                        f"right, but not where the wheels are turned by less than {turned:g} degrees:",
                    )
                    for turned in (3, 0.005)
                ),
                *(
                    (
                        functools.partial(car_at_rest, steering=steering),
                        metrics.Numbers(1e-9),
                        "right for a car that drives, but not for one that stands:",
                    )
                    for steering in (0.4, 0.0)
                ),
                *(
                    (
                        functools.partial(car_turned_far, left=left),
                        metrics.Numbers(1e-9),
                        "right, but not where the wheels are turned by more than 50 degrees:",
                    )
                    for left in (True, False)
                ),
                *(
                    (
                        functools.partial(scaled, draw=car, factors=factors),
                        metrics.Numbers(1e-9, least=0.0),
                        f"right for a car, but not for {this}:",
                    )
                    for factors, this in (
                        ((20, 1, 6), "a fast truck, more than 3.5 m between its axles"),
                        ((1e-4, 1, 0.1), "a slow model of one, less than 40 cm between its axles, at less than 1 mm/s"),
                    )
                ),
            ),
            hints=(
                "All wheels turn about one point on the line of the rear axle. How far aside is it?",
                "The front wheel looks across the line to that point, so tan(steering) = wheelbase / radius, and omega = v / radius.",
                "`return np.array([speed, speed * np.tan(steering) / wheelbase])`",
            ),
            mistakes=[
                Mistake(
                    lambda v, steering, L: np.array([v, L / np.tan(steering) if steering else np.inf]),
                    "This is the radius of the circle. The turn rate is the speed divided by it.",
                ),
                Mistake(
                    lambda v, d, L: np.array([v, v * np.sin(d) / L]),
                    "With the sine, v would be the speed of the front wheel. It is that of the rear axle: the tangent.",
                ),
                Mistake(
                    lambda v, d, L: np.array([v * np.cos(d), v * np.sin(d) / L]),
                    "You take the speed for that of the front wheel. It is that of the middle of the rear axle.",
                ),
                Mistake(
                    lambda v, d, L: np.array([v, v * d / L]), "Right for small angles only: the tangent is missing."
                ),
                Mistake(
                    _bicycle_about_its_middle,
                    "That is the model about the middle of the car, which does not move along the car's axis, with v as the speed there. Here v is the speed of the rear axle's middle.",
                    "ackermann_twist-534253",
                ),
                Mistake(
                    lambda v, d, L: np.array([v, v * np.tan(d) * L]),
                    "The wheelbase divides: a longer car turns more slowly.",
                ),
                Mistake(
                    lambda v, d, L: np.array([v, v / (L * np.tan(d))]),
                    "The tangent is upside down: with straight wheels your car would spin.",
                ),
                Mistake(
                    lambda v, d, L: np.array([v, L * np.tan(d) / v]),
                    "Speed and wheelbase have changed places: omega = v tan(steering) / wheelbase, and a car that stands does not turn.",
                ),
                Mistake(
                    lambda v, d, L: np.array([v, v * np.tan(d)]),
                    "The wheelbase is missing: omega is per second, v tan / wheelbase.",
                ),
                Mistake(
                    lambda v, d, L: np.array([v, np.tan(d) / L]),
                    "This is the curvature, 1 / radius. Times v it is the turn rate.",
                ),
                Mistake(
                    lambda v, d, L: np.array([v, d]),
                    "The steering angle is no turn rate: a car that stands does not turn.",
                ),
                Mistake(
                    lambda v, d, L: np.array([v, -v * np.tan(d) / L]),
                    "A sign: wheels turned to the left, driven forward, turn the car to the left.",
                ),
                Mistake(
                    lambda v, d, L: np.array([v, abs(v) * np.tan(d) / L]),
                    "Your car turns to the side of its wheels in reverse as well. Backward it turns the other way: omega changes its sign with v.",
                    id="ackermann_twist-697df0",
                ),
                Mistake(
                    lambda v, d, L: np.array([v, v * np.tan(np.radians(d)) / L]),
                    "The steering angle is in radians already.",
                ),
                Mistake(
                    lambda v, d, L: np.array([v, 2 * v * np.tan(d) / L]),
                    "Half the wheelbase would be right for a car whose rear wheels steer as far the other way.",
                ),
                Mistake(
                    lambda v, d, L: np.array([v, v * np.cos(d) / L]),
                    "The tangent belongs here, not the cosine: with straight wheels a car does not turn.",
                ),
                Mistake(lambda v, d, L: ackermann_twist(v, d, L)[::-1], "The order is v, omega."),
            ],
        ),
        Exercise(
            "mecanum_twist",
            reference=mecanum_twist,
            sizes=("speeds", "half_length half_width"),
            draw=(rolling, functools.partial(rolling, wide=False)),
            noisy=(
                (rolling_slowly, metrics.Numbers(1e-9), "right, but not for a robot that hardly moves, a few cm/s:"),
                *(
                    (functools.partial(scaled, draw=rolling, factors=factors), metrics.Numbers(1e-9), words)
                    for factors, words in (
                        ((20, 10, 10), "right, but not for a large and fast robot, several meters long:"),
                        ((1e-3, 0.1, 0.1), "right, but not for a small and slow robot, a few mm/s:"),
                        ((0, 1, 1), "right, but not for a robot at rest, whose wheels all stand:"),
                    )
                ),
            ),
            fixed={"speeds": "a Mecanum robot has four wheels"},
            metric=metrics.Numbers(1e-9),
            hints=(
                "Four equations, three unknowns: write them as speeds = M @ (v_x, v_y, omega) and solve by least squares.",
                "The columns of M are orthogonal, so least squares is three signed means: v_x is the mean of the four speeds, "
                "v_y and omega the means with the signs of their columns, omega divided by the lever as well.",
                "`lever = half_length + half_width\n"
                "M = np.array([[1, -1, -lever], [1, 1, lever], [1, 1, -lever], [1, -1, lever]])\n"
                "return np.linalg.lstsq(M, speeds, rcond=None)[0]`",
            ),
            mistakes=[
                Mistake(
                    _three_wheels,
                    "You solved the first three equations: the fourth wheel knows something too. Least squares uses all.",
                ),
                Mistake(_mecanum(shares=(1, 1, 1)), "Sums instead of means: divide by 4."),
                Mistake(_mecanum(shares=(2, 2, 2)), "Divided by 2. There are four wheels."),
                Mistake(_mecanum(shares=(4, 4, 1)), "v is right. omega lacks the 4."),
                Mistake(
                    _mecanum(lever=lambda a, b: b),
                    "The lever of the turn is half length plus half width: the rollers stand at 45 degrees.",
                ),
                Mistake(
                    _mecanum(lever=lambda a, b: a),
                    "The lever of the turn is half length plus half width: the rollers stand at 45 degrees.",
                ),
                Mistake(
                    _mecanum(lever=np.hypot),
                    "The lever is the sum of half length and half width, not the distance of the wheel.",
                ),
                Mistake(
                    _mecanum(lever=lambda a, b: 2 * (a + b)),
                    "omega is half as large as it should be: the lever is half length plus half width, not twice that, and the wheels are four.",
                    id="mecanum_twist-137736",
                ),
                Mistake(
                    _mecanum(lever=lambda a, b: 1.0),
                    "omega is still a speed at the rim: divide by half length plus half width.",
                ),
                Mistake(_mecanum(lever=lambda a, b: 1 / (a + b)), "The lever divides."),
                Mistake(
                    _mecanum(signs=((1, 1, 1, 1), (1, -1, -1, 1), (-1, 1, -1, 1))),
                    "v_y has the wrong sign: it counts to the left.",
                ),
                Mistake(
                    _mecanum(signs=((1, 1, 1, 1), (-1, 1, 1, -1), (1, -1, 1, -1))),
                    "omega has the wrong sign: it counts to the left.",
                ),
                Mistake(
                    _mecanum(signs=((1, 1, 1, 1), (-1, 1, -1, 1), (-1, 1, 1, -1)), lever=lambda a, b: a + b),
                    "v_y and omega have each other's signs, as if the rear wheels had changed places. The order is front left, "
                    "front right, rear left, rear right.",
                ),
                Mistake(
                    lambda w, a, b: np.array([w.mean(), 0.0, mecanum_twist(w, a, b)[2]]),
                    "This robot can drive sideways: v_y is missing.",
                ),
                Mistake(lambda w, a, b: mecanum_twist(w, a, b)[[1, 0, 2]], "v_x and v_y are exchanged."),
            ],
        ),
        Prediction(
            "reach",
            question="A spot one meter to your left, the same heading. Which drive gets there with one command held for two seconds?",
            choices=("all three", "differential and Mecanum", "only Mecanum", "none"),
            answer="only Mecanum",
            why="The wheels of the others do not slip sideways: each of their commands leads along a circle that leaves straight "
            "ahead. They reach the spot too, by more than one command, as everyone knows who has parked a car.",
        ),
    ],
    further=(
        "wheel_offset",
        "ackermann_twist",
        "mecanum_twist",
        "reach",
    ),
)
