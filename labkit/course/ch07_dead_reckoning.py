"""Chapter 7: lateration, motion models, propagation of uncertainty."""

import functools

import numpy as np

from .. import lateration, odometry
from . import metrics
from .engine import Chapter, Exercise, Mistake, Prediction, Value

# Draws -----------------------------------------------------------------------


def two_circles(rng, left=True, up=True, with_origin=True):
    """Two landmarks, exact distances to a robot off their line, and a start near it.

    left: of the way from the first landmark to the second; up: above its mirror image; with_origin: on the origin's
    side of the line, which a search from (0, 0) finds without the start.
    """
    side = 1 if left else -1
    angle, base = rng.uniform(-1.4, 1.4) + (0 if left == up else np.pi), rng.uniform(4, 9)
    along = np.array([np.cos(angle), np.sin(angle)])
    across = side * np.array([-along[1], along[0]])
    a = rng.uniform(-5, 5, 2)
    a = a if (a @ across < 0) == with_origin else -a
    robot = a + rng.uniform(0.2, 0.8) * base * along + rng.uniform(2, 5) * across
    landmarks = np.array([a, a + base * along])
    return landmarks, np.linalg.norm(landmarks - robot, axis=1), robot + rng.uniform(-0.6, 0.6, 2)


def several_circles(rng):
    """Three to five landmarks, distances that do not fit exactly, and a position."""
    landmarks = rng.uniform(-5, 5, (rng.integers(3, 6), 2))
    position = rng.uniform(-5, 5, 2)
    return landmarks, np.linalg.norm(landmarks - position, axis=1) + rng.uniform(0.1, 0.5), position


CIRCLES = tuple(
    functools.partial(two_circles, left=left, up=up, with_origin=left == up) for up in (True, False) for left in (True, False)
)


def two_wheels(rng, faster_right=True):
    """Speeds of the left and the right wheel that turn the robot to this side, and the track."""
    slow, more = rng.uniform(-1, 1), rng.uniform(0.2, 1)
    return (slow, slow + more, rng.uniform(0.2, 0.8)) if faster_right else (slow + more, slow, rng.uniform(0.2, 0.8))


WHEELS = (two_wheels, functools.partial(two_wheels, faster_right=False))


def pose_control_step(rng, side=None):
    """A pose, a control that turns to this side (1 left, -1 right), and a time step that tells the models apart."""
    x = np.array([*rng.uniform(-5, 5, 2), rng.uniform(-3, 3)])
    omega = rng.uniform(0.4, 1.5) * (side or rng.choice([-1, 1]))
    return x, np.array([rng.uniform(0.5, 2), omega]), rng.uniform(0.3, 0.9)


EITHER_SIDE = (functools.partial(pose_control_step, side=1), functools.partial(pose_control_step, side=-1))


def noisy_control(rng, signs):
    """A control whose parts have these signs, a time step, and three noise constants."""
    v, omega = rng.uniform(0.3, 2), rng.uniform(0.2, 1.5)
    return np.array([v, omega]) * signs, rng.uniform(0.05, 0.5), *rng.uniform(0.001, 0.02, 3)


NOISY_CONTROLS = tuple(functools.partial(noisy_control, signs=signs) for signs in ((-1, 1), (1, -1), (-1, -1)))


def pose_and_covariances(rng):
    """Pose, its covariance, control, time step, covariance of the control."""
    x, u, dt = pose_control_step(rng)
    M, N = rng.normal(size=(3, 3)), rng.normal(size=(2, 2))
    return x, 0.1 * M @ M.T, u, dt, 0.05 * N @ N.T


# References and wrong variants ------------------------------------------------


def newton_lateration(landmarks, distances, start):
    return lateration.newton(landmarks, distances, start).position


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


def _mirrored(landmarks, distances, start):
    roots = lateration.circle_intersections(landmarks, distances)
    return roots[np.argmax(np.linalg.norm(roots - start, axis=1))]


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


def _chord(theta, v, omega, dt):
    return v * dt * np.sinc(omega * dt / 2 / np.pi)


def _old(theta, v, omega, dt):
    return theta


def _half(theta, v, omega, dt):
    return theta + omega * dt / 2


def _new(theta, v, omega, dt):
    return theta + omega * dt


def _swapped(x, u, dt):
    return np.array([x[0] + u[0] * dt * np.sin(x[2]), x[1] + u[0] * dt * np.cos(x[2]), x[2] + u[1] * dt])


def _arc_sign(x, u, dt):
    r, after = u[0] / u[1], x[2] + u[1] * dt
    return np.array([x[0] + r * (np.sin(x[2]) - np.sin(after)), x[1] + r * (np.cos(after) - np.cos(x[2])), after])


def _arc_y_sign(x, u, dt):
    r, after = u[0] / u[1], x[2] + u[1] * dt
    return np.array([x[0] + r * (np.sin(after) - np.sin(x[2])), x[1] + r * (np.cos(after) - np.cos(x[2])), after])


def _straight_line_works(function, rng):
    """The limit omega -> 0: exactly straight, and near it without a jump."""
    x, u, dt = np.array([1.0, 2.0, rng.uniform(-3, 3)]), np.array([1.5, 0.0]), 0.8
    expected = odometry.step(x, u, dt, "arc")
    for omega in (0.0, 1e-9):
        with np.errstate(all="ignore"):
            try:
                result = np.asarray(function(x, np.array([1.5, omega]), dt), dtype=float)
            except ZeroDivisionError:
                result = np.full(3, np.nan)
        if result.shape != (3,) or not np.isfinite(result).all():
            return f"right on curves, but with omega = {omega:g} the result is not finite: the radius v / omega has no value there."
        if not metrics.planar_poses(1e-6).equal(result, expected):
            return f"right on curves, but with omega = {omega:g} the robot should drive straight on; the result is off."
    return None


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
    drive = odometry.circle_drive()
    noise = drive.noise | changes
    poses, covs = odometry.drive_with_covariance(np.zeros(3), np.zeros((3, 3)), drive.controls, drive.dt, **noise, model=model)
    return poses[-1], covs[-1]


def _without_carrying():
    """The control's noise of all steps added up, what earlier errors do later left out."""
    drive = odometry.circle_drive()
    poses = odometry.drive(np.zeros(3), drive.controls, drive.dt, "euler")[:-1]
    F_u = odometry.step_jacobians(poses, drive.controls, drive.dt, "euler")[1]
    cov_u = odometry.control_covariance(drive.controls, drive.dt, **drive.noise)
    return (F_u @ cov_u @ np.swapaxes(F_u, -1, -2)).sum(0)


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
            draw=several_circles,
            metric=metrics.numbers(1e-9),
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
                    "Without axis=1 the sum (or the norm) runs over all landmarks at once: one sum a row is wanted.",
                ),
            ],
        ),
        Prediction(
            "roots",
            question="Two landmarks, two exact distances. In how many points of the plane can the robot stand?",
            choices=("one", "two", "infinitely many"),
            answer="two",
            why="Two circles meet in two points, mirror images in the line through the landmarks. Which one Newton finds is decided by the start.",
        ),
        Exercise(
            "newton_lateration",
            reference=newton_lateration,
            draw=CIRCLES,
            metric=metrics.numbers(1e-8, "m"),
            hints=(
                "Replace the residuals by their tangent planes, go to where those are zero, repeat.",
                "Row i of the Jacobian is 2 (position - landmark_i). The step solves J step = -residual.",
                "`position = start; for _ in range(20): position = position - np.linalg.solve(2 * (position - landmarks), lateration_residual(landmarks, distances, position))` on two lines, and on a third `return position`",
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
                    "Newton works, on the wrong equations: the measured distances are not squared.",
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
                Mistake(_mirrored, "This is the mirror image: it also fits, but the given start is nearer to the other one."),
            ],
        ),
        Exercise(
            "wheel_to_twist",
            reference=odometry.wheel_to_twist,
            draw=WHEELS,
            metric=metrics.numbers(1e-9),
            hints=(
                "The middle of the axle moves with the mean of both wheels; what differs between them turns the robot.",
                "v = (v_R + v_L) / 2 and omega = (v_R - v_L) / l.",
                "return np.array([(v_right + v_left) / 2, (v_right - v_left) / track])",
            ),
            mistakes=[
                Mistake(
                    lambda a, b, l: np.array([(a + b) / 2, (a - b) / l]),
                    "Your robot turns the wrong way: when the right wheel is faster it turns left, counterclockwise, omega > 0.",
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
            ],
        ),
        Exercise(
            "step_euler",
            reference=step_euler,
            draw=EITHER_SIDE,
            metric=metrics.planar_poses(),
            hints=(
                "Drive the way v T along the old heading, then turn.",
                "x' = x + v T cos(theta), y' = y + v T sin(theta), theta' = theta + omega T.",
                "return np.array([x[0] + u[0] * dt * np.cos(x[2]), x[1] + u[0] * dt * np.sin(x[2]), x[2] + u[1] * dt])",
            ),
            mistakes=[
                Mistake(_straight(_way, _new, _turn), "You turn first and drive along the new heading. This model drives along the old one."),
                Mistake(_straight(_way, _half, _turn), "This is the midpoint model already. The simplified one leaves omega T / 2 out."),
                Mistake(_swapped, "Sine and cosine are exchanged: a robot with heading 0 drives along x."),
                Mistake(
                    _straight(lambda th, v, w, dt: v, _old, lambda th, v, w, dt: w),
                    "The time step is missing: v and omega are per second.",
                ),
                Mistake(
                    _straight(lambda th, v, w, dt: v, _old, _turn),
                    "The time step is missing from the way: it is v T, not v.",
                ),
                Mistake(
                    _straight(_way, _old, lambda th, v, w, dt: -w * dt),
                    "Your robot turns to the wrong side: theta grows by omega T.",
                ),
                Mistake(
                    _straight(_way, lambda th, v, w, dt: np.radians(th), _turn),
                    "theta is in radians already: no conversion inside cosine and sine.",
                ),
                Mistake(
                    _straight(_way, _old, lambda th, v, w, dt: w),
                    "The heading turns by omega T, not by omega.",
                ),
                Mistake(
                    lambda x, u, dt: np.array([x[0] + u[0] * dt * np.cos(x[2]), x[1] + u[0] * dt * np.sin(x[2]), x[2]]),
                    "The heading stays what it was: add omega T.",
                ),
                Mistake(
                    _straight(_way, lambda th, v, w, dt: np.degrees(th), _turn),
                    "np.cos and np.sin take radians, and theta is in radians already: do not convert.",
                ),
            ],
        ),
        Exercise(
            "step_midpoint",
            reference=step_midpoint,
            draw=EITHER_SIDE,
            metric=metrics.planar_poses(),
            hints=(
                "While it drives the robot turns by omega T; on average it looked half of that aside.",
                "As before, with theta + omega T / 2 inside cosine and sine.",
                "direction = x[2] + u[1] * dt / 2, then drive u[0] * dt along it; the heading still turns by u[1] * dt.",
            ),
            mistakes=[
                Mistake(step_euler, "This is the simplified model: omega T / 2 is missing inside cosine and sine."),
                Mistake(_straight(_way, _new, _turn), "You drive along the new heading: only half of the turn belongs there."),
                Mistake(
                    _straight(_way, _half, lambda th, v, w, dt: w * dt / 2),
                    "The robot ends turned by the whole omega T; the half is only the direction it drove in.",
                ),
                Mistake(
                    _straight(_way, lambda th, v, w, dt: th + w / 2, _turn),
                    "The time step is missing inside cosine and sine: omega T / 2.",
                ),
                Mistake(
                    _straight(_way, lambda th, v, w, dt: th - w * dt / 2, _turn),
                    "The half turn has the wrong sign: the robot looks ahead into the curve.",
                ),
            ],
        ),
        Exercise(
            "step_arc",
            reference=step_arc,
            draw=EITHER_SIDE,
            metric=metrics.planar_poses(),
            properties=(_straight_line_works,),
            hints=(
                "The robot turns about the center (ICR) at distance r = v / omega to its left. Where is it after turning by omega T?",
                "The chord of the arc points along theta + h with h = omega T / 2, and its length is v T sin(h) / h.",
                "length = u[0] * dt * np.sinc(h / np.pi): np.sinc(t) is sin(pi t) / (pi t), and 1 at t = 0.",
            ),
            mistakes=[
                Mistake(step_midpoint, "This is the midpoint model: its way is the length of the arc, but the chord is shorter, by sin(h) / h."),
                Mistake(step_euler, "This is the simplified model: no curve in it yet."),
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
                Mistake(_arc_sign, "Your robot drives its circle backward: check the signs at the center of rotation."),
                Mistake(_arc_y_sign, "x is right, y has the wrong sign: the center lies to the left of the heading for omega > 0."),
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
            draw=pose_control_step,
            metric=metrics.numbers(1e-5),
            hints=(
                "Change x, y or theta a little: what does it change in the pose after the step?",
                "A shift of x or y is passed on as it is. A turn of theta swings the way v T sideways.",
                "np.eye(3), with -v T sin(theta) in row 0 and v T cos(theta) in row 1 of the last column.",
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
                    lambda x, u, dt: jacobian_state(x, u, dt) - np.eye(3),
                    "The pose before the step is missing: its derivative by itself is the identity.",
                ),
            ],
        ),
        Exercise(
            "jacobian_control",
            reference=jacobian_control,
            draw=pose_control_step,
            metric=metrics.numbers(1e-5),
            hints=(
                "Three rows (x, y, theta), two columns (v, omega).",
                "A little more v moves the robot by T along the heading; a little more omega turns it by T.",
                "[[T cos, 0], [T sin, 0], [0, T]] with the heading x[2].",
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
            ],
        ),
        Exercise(
            "control_covariance",
            reference=odometry.control_covariance,
            draw=NOISY_CONTROLS,
            metric=metrics.numbers(1e-9),
            hints=(
                "A diagonal matrix: the variance of v and the variance of omega.",
                "sigma_v^2 = k_d |v| / T and sigma_omega^2 = (k_theta |omega| + k_drift |v|) / T.",
                "v, omega = np.abs(u); return np.diag([k_d * v / dt, (k_theta * omega + k_drift * v) / dt])",
            ),
            mistakes=[
                Mistake(
                    _covariance(lambda v, w, t, a, b, c: a * v / t, lambda v, w, t, a, b, c: (b * w + c * v) / t),
                    "In reverse or to the right your variance is wrong, even negative: take absolute values, as the lecture remarks.",
                ),
                Mistake(
                    _covariance(
                        lambda v, w, t, a, b, c: a * abs(v), lambda v, w, t, a, b, c: b * abs(w) + c * abs(v)
                    ),
                    "The division by T is missing: the constants speak of ways, the variances of speeds.",
                ),
                Mistake(
                    _covariance(
                        lambda v, w, t, a, b, c: a * abs(v) * t, lambda v, w, t, a, b, c: (b * abs(w) + c * abs(v)) * t
                    ),
                    "You multiplied by T. The variance of the way is k_d v T; the speed is that way divided by T, so its variance by T squared.",
                ),
                Mistake(
                    _covariance(lambda v, w, t, a, b, c: a * abs(v) / t, lambda v, w, t, a, b, c: b * abs(w) / t),
                    "The drift is missing: a robot that drives straight on also turns a little.",
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
                    _covariance(lambda v, w, t, a, b, c: a * v**2 / t, lambda v, w, t, a, b, c: (b * w**2 + c * v**2) / t),
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
            ],
        ),
        Exercise(
            "propagate",
            reference=propagate,
            draw=pose_and_covariances,
            metric=metrics.several(metrics.planar_poses(), metrics.numbers(1e-9), names=("pose", "covariance")),
            hints=(
                "The pose takes the step. The covariance takes the old uncertainty along and adds that of the control.",
                "cov' = F_x cov F_x' + F_u cov_u F_u', with both Jacobians at the old pose.",
                "return step_euler(x, u, dt), F_x @ cov @ F_x.T + F_u @ cov_u @ F_u.T",
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
                    "F_x is on the wrong side: F cov F', not F' cov F.",
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
                    "Your Jacobians are taken at the new pose. The step was linearized at the old one.",
                ),
                Mistake(
                    _propagated(lambda F, G, P, Q: F * P * F.T + G @ Q @ G.T),
                    "`*` multiplies entry by entry. The matrix product is `@`.",
                ),
                Mistake(
                    _propagated(lambda F, G, P, Q: F @ P @ F + G @ Q @ G.T),
                    "The last factor is the transpose of F_x.",
                ),
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
            unit="m",
            metric=metrics.planar_poses(1e-6),
            hints=(
                "Start at (0, 0, 0) and take all 140 steps with the simplified model.",
                "Loop over drive.controls with your `propagate`; the covariance starts as zeros.",
                "x, cov = np.zeros(3), np.zeros((3, 3)); for u in drive.controls: x, cov = propagate(x, cov, u, drive.dt, control_covariance(u, drive.dt, **drive.noise))",
            ),
            mistakes=[
                Mistake(lambda: _circle("midpoint")[0], "This is the end of the midpoint model; the lecture propagates with the simplified one."),
                Mistake(lambda: _circle("arc")[0], "This is where the arc ends, the true drive. The estimate of the simplified model ends elsewhere."),
                Mistake(
                    lambda: odometry.drive(np.zeros(3), odometry.circle_drive().controls[:-1], 0.1, "euler")[-1],
                    "One step is missing: there are 140.",
                ),
                Mistake(
                    lambda: _circle()[0] * [1, 1, np.degrees(1)],
                    "The position is right. The heading is in degrees: leave it in radians.",
                ),
            ],
        ),
        Value(
            "end_cov",
            reference=lambda: _circle()[1],
            unit="m, rad",
            metric=metrics.numbers(1e-6),
            hints=(
                "It comes out of the same loop as the pose.",
                "The constants are in radians already; the covariance starts as zeros.",
                "end_cov = cov after the loop.",
            ),
            mistakes=[
                Mistake(lambda: _circle(k_drift=0.0)[1], "The drift is missing from the control's covariance."),
                Mistake(lambda: _circle(k_theta=0.0)[1], "The turning error k_theta is missing from the control's covariance."),
                Mistake(_without_carrying, "You added up the noise of the steps. Earlier heading errors also move all later positions: F_x cov F_x'."),
                Mistake(lambda: _circle("midpoint")[1], "This is the midpoint model's covariance; the lecture uses the simplified one."),
            ],
        ),
        Prediction(
            "banana",
            question="The ellipse of error propagation is said to hold 95 % of the poses. How many of the true ends does it hold after 14 m?",
            choices=("about 95 %", "fewer", "more"),
            answer="fewer",
            why="The true ends lie on a bent band, because a wrong heading swings the way around. An ellipse cannot bend.",
        ),
    ],
)
