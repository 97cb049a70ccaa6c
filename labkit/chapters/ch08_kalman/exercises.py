"""Chapter 8: the linear Kalman filter, the extended filter with landmarks, and whether they are honest."""

import functools
import itertools

import numpy as np
from scipy.linalg import block_diag, solve_continuous_are, solve_discrete_are

from ...documents.lecture import printed as lecture
from ...estimation import kalman
from ...exercises import metrics
from ...exercises.engine import Chapter, Exercise, Prediction
from ...exercises.outcome import Mistake
from ...exercises.value import Value
from ...geometry.planar import wrap_angle as wrapped
from ...localization import ekf, odometry

# Draws -----------------------------------------------------------------------


def covariance(rng, n, scale=1.0):
    M = rng.normal(size=(n, n))
    return scale * (M @ M.T + 0.3 * np.eye(n))


def vehicle_prediction(rng):
    """State, covariance, A, B, control and its covariance of the lecture's vehicle."""
    A, B, _ = kalman.vehicle_model(rng.uniform(0.3, 0.9))
    return rng.normal(size=2) * 5, covariance(rng, 2), A, B, rng.uniform(1, 3, 1), covariance(rng, 1)


def prediction(rng, n, k, sure=1.0):
    """The same of any system with n states and k controls; sure: in what unit covariances are of the order of 1."""
    A, B = rng.normal(size=(n, n)), rng.normal(size=(n, k))
    return rng.normal(size=n) * 5, covariance(rng, n, sure), A, B, rng.normal(size=k) * 2, covariance(rng, k, sure)


def known_exactly(rng):
    """A state of which nothing is uncertain, and a control of zeros that is."""
    x, cov, A, B, u, cov_u = prediction(rng, 3, 2)
    return x, 0.0 * cov, A, B, 0.0 * u, cov_u


def carried_out_exactly(rng):
    """A control of which nothing is uncertain."""
    x, cov, A, B, u, cov_u = prediction(rng, 3, 2)
    return x, cov, A, B, u, 0.0 * cov_u


def mixed_measurement(rng, n, m, off=1.0, sure=1.0, unit=1.0):
    """State of n, and m numbers measured of mixtures of them; off: how far they are from those expected; sure: how
    small the covariances are; unit: what the sensor shows where a state changes by 1 (a gain may well be above 1).
    """
    x = rng.normal(size=n) * 3
    C = unit * rng.normal(size=(m, n))
    return x, covariance(rng, n, sure), C @ x + off * rng.normal(size=m), C, covariance(rng, m, 0.5 * sure * unit**2)


def measured_often(rng, n, m, k, sure=1.0):
    """What is known of a state, and k measurements of the same mixtures of it; sure: how small covariances are."""
    x = rng.normal(size=n) * 3
    C, cov_z = rng.normal(size=(m, n)), covariance(rng, m, 0.5 * sure)
    z = C @ x + rng.multivariate_normal(np.zeros(m), cov_z, k)
    return x + sure**0.5 * rng.normal(size=n), covariance(rng, n, sure), z, C, cov_z


def one_far_more_exact(rng, measured):
    """The same where all measured numbers but one are a thousand times coarser."""
    x, cov, z, C, cov_z = measured(rng)
    coarser = rng.permutation([1.0, *np.full(len(C) - 1, 1e3)])
    return x, cov, z, C, cov_z * np.outer(coarser, coarser)


def measured_alike(rng):
    """The same where two of the measurements are equal."""
    x0, cov0, z, C, cov_z = measured_often(rng, n=2, m=2, k=4)
    return x0, cov0, z[[0, 1, 1, 2]], C, cov_z


def two_sensors_that_disagree(rng):
    """The same with readings many standard deviations apart, from each other and from the prior."""
    x0, var0, z, stds = one_position_two_sensors(rng)
    return x0, var0, z + rng.uniform(15, 30, 2) * [1, -1], stds


def prior_at_zero(rng):
    """The same with a prior that says 0, and a reading that does."""
    _, var0, z, stds = one_position_two_sensors(rng)
    return 0.0, var0, z * rng.permutation([0, 1]), stds


def two_sensors_alike(rng):
    """The same with two readings that are one number, of sensors that are equally good."""
    x0, var0, z, stds = one_position_two_sensors(rng)
    return x0, var0, z[[0, 0]], stds[[0, 0]]


def equally_good_sensors(rng):
    """The same with two sensors that are equally good, and disagree."""
    x0, var0, z, stds = one_position_two_sensors(rng)
    return x0, var0, z + rng.uniform(1, 3, 2) * [1, -1], stds[[0, 0]]


def two_equal_readings(rng, better):
    """The same with two readings that are one number, of sensors that are not equally good."""
    x0, var0, z, stds = one_position_two_sensors(rng, better)
    return x0, var0, z[[0, 0]], stds


def two_sharp_sensors(rng):
    """The same a kilometer away, known to millimeters."""
    x0, var0, z, stds = one_position_two_sensors(rng)
    return 1000.0 + 1e-3 * x0, 1e-6 * var0, 1000.0 + 1e-3 * z, 1e-3 * stds


def one_position_two_sensors(rng, better=0, var0=(2, 9)):
    """better: which of the sensors has the smaller std; var0: range of the prior's variance."""
    x = rng.uniform(5, 15) * rng.choice([-1, 1])
    stds = np.roll([rng.uniform(0.3, 0.6), rng.uniform(0.8, 1.8)], better)
    return x + rng.normal(), rng.uniform(*var0), x + rng.uniform(-1, 1, 2), stds


def steady_vehicle(rng, T=(0.1, 0.5)):
    """The lecture's vehicle, its position counted forward or backward; T: bounds of the time step, s."""
    A, B, C = kalman.vehicle_model(rng.uniform(*T))
    return (
        A,
        rng.choice([-1, 1]) * C,
        rng.uniform(0.3, 1) * B @ B.T,  # of the control alone: the position is sure after a step from no uncertainty
        np.array([[rng.uniform(0.1, 1)]]),
    )


def steady_system(rng, n, m, sure=1.0):
    """A system of n states that remember for a while, all of them seen in m mixed numbers; sure: how small the noises.

    As in `growing_system`, no round of the filter enlarges what rounding takes from a covariance's symmetry: gains such
    as np.linalg.solve(S, C @ cov).T count on it.
    """
    A = np.diag(rng.uniform(0.6, 0.85, n)) + np.diag(rng.uniform(0.1, 0.3, n - 1), 1)
    return (
        A,
        np.eye(m, n) + 0.3 * rng.normal(size=(m, n)),
        covariance(rng, n, 0.05 * sure),
        covariance(rng, m, 0.3 * sure),
    )


def one_sensor_far_sharper(rng):
    """The same where one sensor is forty times as exact as the other, and what enters is small beside both."""
    A, C, cov_v, cov_z = steady_system(rng, n=2, m=2)
    sharper = rng.permutation([1.0, 0.025])
    return A, C, 1e-4 * cov_v, cov_z * np.outer(sharper, sharper)


def forgetful_system(rng):
    """The same where a state is made anew at every step, of the others: A has no inverse."""
    A, C, cov_v, cov_z = steady_system(rng, n=3, m=2)
    A[0, 0] = 0.0
    return A, C, cov_v, cov_z


def growing_system(rng):
    """States of which one grows by itself, so slowly that rounding has decided none of four forms of the filter; all are measured."""
    A = np.array([[rng.uniform(1.05, 1.15), 0.2], [0.0, rng.uniform(0.5, 0.7)]])
    return A, np.eye(2) + 0.2 * rng.uniform(-1, 1, (2, 2)), covariance(rng, 2, 0.05), covariance(rng, 2, 0.3)


def slow_system(rng):
    """States that stay as they are, but for a noise a few thousandths of the sensor's: some hundred rounds pass before
    the gain stands still, from a covariance far too large or far too small.
    """
    C, cov_z = np.eye(2) + 0.2 * rng.uniform(-1, 1, (2, 2)), covariance(rng, 2, 0.3)
    back = np.linalg.inv(C)
    return np.eye(2), C, rng.uniform(0.003, 0.004) ** 2 * back @ cov_z @ back.T, cov_z


def seen_landmark(rng):
    """A pose and a landmark some meters away, on any side."""
    x = np.array([*rng.uniform(-4, 4, 2), rng.uniform(-3, 3)])
    angle, r = rng.uniform(-np.pi, np.pi), rng.uniform(1.5, 6)
    return x, x[:2] + r * np.array([np.cos(angle), np.sin(angle)])


def landmark_aside(rng, side, turned):
    """A landmark on this side in x, and a heading on this side that takes the unwrapped bearing out of [-pi, pi)."""
    x, r = np.array([*rng.uniform(-4, 4, 2), turned * rng.uniform(2.6, 3.1)]), rng.uniform(1.5, 6)
    angle = -turned * (np.pi / 2 - side * rng.uniform(0.15, 0.95))
    return x, x[:2] + r * np.array([np.cos(angle), np.sin(angle)])


def landmark_along_an_axis(rng, toward):
    """A pose and a landmark of which one coordinate is the robot's own."""
    x, _ = seen_landmark(rng)
    return x, x[:2] + rng.uniform(1.5, 6) * np.array(toward)


AXES = ((1, 0), (0, 1), (-1, 0), (0, -1))
ALONG_AN_AXIS = "right, but not where the landmark lies exactly along an axis of the map, dx = 0 or dy = 0:"


def along_the_axes(metric):
    return [(functools.partial(landmark_along_an_axis, toward=toward), metric, ALONG_AN_AXIS) for toward in AXES]


def landmark_at(rng, within):
    """A pose and a landmark at a distance from this range (m)."""
    x, landmark = seen_landmark(rng)
    away = landmark - x[:2]
    return x, x[:2] + rng.uniform(*within) * away / np.hypot(*away)


def near_and_far(metric):
    return [
        (functools.partial(landmark_at, within=within), metric, f"right, but not for a landmark {where}:")
        for within, where in (((0.1, 0.2), "a decimeter or two away"), ((300, 900), "hundreds of meters away"))
    ]


def turned_several_times(rng):
    """A pose whose heading has gathered several turns, as a sum of steps does, and a landmark."""
    x, landmark = seen_landmark(rng)
    return x + [0.0, 0.0, 2 * np.pi * rng.integers(2, 4) * rng.choice([-1, 1])], landmark


def landmark_seen_at(rng, bearing):
    """A pose and a landmark exactly in this direction, as far as numbers go: some way to a bearing has its seam there."""
    x, r = np.array([*rng.uniform(-4, 4, 2), rng.uniform(-3, 3)]), rng.uniform(1.5, 6)
    angle = x[2] + bearing
    return x, x[:2] + r * np.array([np.cos(angle), np.sin(angle)])


def landmark_behind(rng, side):
    """A landmark so nearly behind the robot that a hundredth of a radian or of a meter takes it across the seam; with
    side = 0 exactly behind.
    """
    return landmark_seen_at(rng, side * (np.pi - rng.uniform(5e-4, 1e-3)) if side else np.pi)


def seen_from_whole_numbers(rng):
    """A pose of whole numbers and a landmark."""
    x, landmark = seen_landmark(rng)
    whole = rng.integers(-3, 4, 3)
    return whole, whole[:2] + landmark - x[:2]


def pose_exactly_backward(rng):
    """A pose whose heading is exactly half a turn, and a control that leaves it so."""
    x, u, dt = pose_control_step(rng, ahead=rng.choice([-1, 1]))
    return np.array([*x[:2], np.pi * rng.choice([-1, 1])]), u * [1.0, 0.0], dt


def landmark_ahead(rng):
    """A landmark hardly to the left or to the right of where the robot looks."""
    return landmark_seen_at(rng, rng.uniform(5e-4, 1e-3) * rng.choice([-1, 1]))


def within_half_a_turn(rng):
    return (rng.uniform(-3, 3),)


def about_half_a_turn(rng, sign, beyond):
    """An angle hardly short of half a turn, or hardly beyond."""
    return (sign * (np.pi + beyond * rng.uniform(0.002, 0.02)),)


def half_a_turn(rng, sign):
    """Exactly half a turn."""
    return (sign * np.pi,)


def turned_too_far(rng, sign, gathered):
    """An angle beyond half a turn; with gathered = 1 it has one to three full turns more, with -1 none."""
    return (sign * (rng.uniform(3.3, 6.0) + 2 * np.pi * rng.integers(1, 4) * (gathered > 0)),)


def turned_often(rng, turns=(30, 90)):
    """An angle that has gathered many turns, as that of a wheel does."""
    return (rng.choice([-1, 1]) * (rng.uniform(3.3, 6.0) + 2 * np.pi * rng.integers(*turns)),)


def hardly_turned(rng, size):
    """An angle next to zero, or zero."""
    return (size * rng.uniform(0.2, 1.0) * rng.choice([-1, 1]),)


def each_way(draw, *names):
    """The draw with every combination of the signs that it takes under these names."""
    signs = itertools.product((1, -1), repeat=len(names))
    return tuple(functools.partial(draw, **dict(zip(names, each))) for each in signs)


def pose_control_step(rng, ahead=1):
    """A pose, a control (forward, or backward with ahead = -1) and a time step."""
    x = np.array([*rng.uniform(-5, 5, 2), rng.uniform(-3, 3)])
    u = np.array([ahead * rng.uniform(0.6, 2), rng.uniform(0.3, 1.5) * rng.choice([-1, 1])])
    return x, u, rng.uniform(0.2, 0.9)


def special_control(rng, moves):
    """A pose, a control of which these parts are not zero, and a time step."""
    x, u, dt = pose_control_step(rng)
    return x, u * moves, dt


def control_at_whole_numbers(rng):
    """The same at a pose of whole numbers."""
    _, u, dt = pose_control_step(rng)
    return rng.integers(1, 5, 3) * rng.choice([-1, 1], 3), u, dt


def fast_control(rng):
    """A pose whose heading has gathered turns, a control ten times as fast, and a time step of seconds."""
    x, u, dt = pose_control_step(rng)
    return x + [0.0, 0.0, 2 * np.pi * rng.integers(2, 4) * rng.choice([-1, 1])], 10 * u, 5 * dt


def filter_step(
    rng,
    ahead=1,
    astray=0.2,
    side=1,
    seam=True,
    moves=(1, 1),
    turns=0,
    within=(2, 5),
    sure=1.0,
    turned=(0.06, 0.12),
    carried_out=False,
):
    """Everything one step of the landmark filter needs; the bearing innovation crosses +-pi if this is a seam.

    astray: how far the measured distance may be off (m); side: of the innovation of the bearing; moves: parts of the
    control that are not zero; turns: that the heading has gathered; within: range of the landmark's distance (m);
    sure: how small the covariances are; turned: range of the innovation of the bearing; carried_out: the control exactly.
    """
    x, u, dt = pose_control_step(rng, ahead)
    x, u = x + [0.0, 0.0, 2 * np.pi * turns], u * moves
    cov, cov_u = covariance(rng, 3, 0.01 * sure), covariance(rng, 2, 0.0 if carried_out else 0.02 * sure)
    moved = odometry.step(x, u, dt, "euler")
    away = moved[2] + side * (np.pi - rng.uniform(0.005, 0.03) if seam else rng.uniform(0.2, 1.5))
    landmark = moved[:2] + rng.uniform(*within) * np.array([np.cos(away), np.sin(away)])
    off = rng.uniform(0.8, 1.0) * astray * (1 if astray > 1 else rng.choice([-1, 1]))
    z = ekf.measurement(moved, landmark[None])[0] + [off, side * rng.uniform(*turned)]
    z[1] = wrapped(z[1])
    return x, cov, u, dt, cov_u, z, landmark, covariance(rng, 2, 0.003 * sure)


def estimate_and_truth(rng, side=1, astray=0.3, turns=0, sure=0.05, turned=(0.15, 0.3)):
    """True and estimated pose whose headings lie on both sides of +-pi, and a covariance; errors up to `astray` m and
    in the range `turned` (rad), and so many full turns that only the estimate has counted.
    """
    truth = np.array([*rng.uniform(-4, 4, 2), side * (np.pi - rng.uniform(0.02, 0.1))])
    off = rng.uniform(0.8, 1.0, 2) * astray * rng.choice([-1, 1], 2)
    return truth, truth + [*off, side * (rng.uniform(*turned) - 2 * np.pi * (1 + turns))], covariance(rng, 3, sure)


def estimate_without_error(rng):
    """An estimate that is the truth."""
    truth, _, cov = estimate_and_truth(rng)
    return truth, truth.copy(), cov


def sharp_estimate(rng):
    """The same within millimeters, a covariance that says so, and both next to the origin of the map."""
    truth, x, cov = estimate_and_truth(rng, astray=3e-3, sure=1e-5)
    start = 0.01 * rng.uniform(-1, 1, 3)
    return start, start + [*(x - truth)[:2], 1e-3 * wrapped(x[2] - truth[2])], cov


def surprise(rng, wanted, along=None, std=(0.3, 1.5), measure=np.linalg.solve, limit=(4.0, 9.0)):
    """An innovation y (2,), its correlated covariance S, and a limit from a range.

    wanted: range of y' S^-1 y in limits; along: 1 along the correlation, where much is little, -1 across, where little
    is much (the diagonal alone would let it pass), None anywhere. `measure` takes the place of S^-1 y.
    """
    rho, std = rng.uniform(0.75, 0.95) * rng.choice([-1, 1]), rng.uniform(*std, 2)
    S, limit = np.outer(std, std) * [[1, rho], [rho, 1]], rng.uniform(*limit)
    y = std * (rng.normal(size=2) if along is None else [1, along * np.sign(rho)]) * rng.choice([-1, 1])
    return y * np.sqrt(rng.uniform(*wanted) * limit / (y @ measure(S, y))), S, limit


def surprise_in_a_sure_direction(rng, wanted):
    """An innovation in the direction in which S is smallest by far, as of two sensors that err together: who leaves weak
    directions out lets it pass.
    """
    angle = rng.uniform(-np.pi, np.pi)
    V = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    stds, limit = np.array([1.0, 0.02]) * rng.uniform(0.5, 2), rng.uniform(4.0, 9.0)
    y = V @ (stds * np.sqrt(rng.uniform(*wanted) * limit * np.array([0.05, 0.95])) * rng.choice([-1, 1], 2))
    return y, V @ np.diag(stds**2) @ V.T, limit


def surprise_of(rng, m, wanted):
    """An innovation of m numbers with y' S^-1 y in this range of limits, its covariance, and a limit.

    What is implausible is so by its last number: whoever looks at the first ones alone lets it pass.
    """
    S, y, limit = covariance(rng, m, 0.2), rng.normal(size=m), rng.uniform(4, 17)
    y[:-1] *= 0.01 if wanted[0] > 1 else 1.0
    return y * np.sqrt(rng.uniform(*wanted) * limit / (y @ np.linalg.solve(S, y))), S, limit


def on_its_own_side(rng, place, plausible, high):
    """A NIS and a limit in the same half, the high or the low one, between two multiples of a decimal place, or of 1:
    rounded or cut off, one of them comes to lie on the other side of the other, or on it.
    """
    parts = np.array([rng.uniform(0.1, 0.2), rng.uniform(0.25, 0.4)])
    near, far = np.sort(1 - parts if high else parts)[:: 1 if plausible else -1]  # of the NIS, of the limit
    whole = rng.integers(4 / place, 16 / place)
    _, S, _ = surprise(rng, (0.5, 0.6))
    y = rng.normal(size=2)
    return y * np.sqrt(place * (whole + near) / (y @ np.linalg.solve(S, y))), S, float(place * (whole + far))


def no_surprise(rng):
    """An innovation of zeros."""
    y, S, limit = surprise(rng, (0.05, 0.9))
    return 0.0 * y, S, limit


def just_at_the_limit(rng):
    """One number whose NIS is the limit itself; all are powers of two, so that nothing need be rounded."""
    y, std = 2.0 ** rng.integers(-2, 3, 2)
    return np.array([y * rng.choice([-1, 1])]), np.array([[std**2]]), float((y / std) ** 2)


AT_THE_LIMIT = 30  # on a processor that is off in the last bit, some are below the limit; all of them by `<=` alone


def _limit_passes_not(student, rng):
    """Refuses `<=`, which lets all of them pass; one that is rounded to below its limit is no mistake."""
    if all(student(*just_at_the_limit(rng)) for _ in range(AT_THE_LIMIT)):
        return "right, but a NIS that is just the limit passes, and it is not below it: `<`, not `<=`."
    return None


SURPRISES = (
    # large in itself, little for its S: refused without S
    functools.partial(surprise, wanted=(0.75, 0.85), along=1, std=(3.0, 4.0), limit=(9.0, 17.0)),
    functools.partial(surprise, wanted=(1.5, 2.5), along=-1, limit=(2.5, 3.5)),
    functools.partial(surprise, wanted=(0.7, 0.9), along=1, std=(0.3, 0.7)),
    functools.partial(surprise, wanted=(0.05, 0.9)),
    functools.partial(surprise, wanted=(0.99, 0.995)),  # next to the limit: rounded, one in two is on its other side
    functools.partial(surprise, wanted=(1.005, 1.01)),
    functools.partial(surprise, wanted=(7, 20)),
    # short enough to pass without S: one implausible, also by its root, one plausible that S instead of S^-1 refuses
    functools.partial(surprise, wanted=(7, 10), along=-1, std=(0.3, 0.5), limit=(4.0, 6.0)),
    functools.partial(surprise, wanted=(0.5, 0.7), along=1, std=(1.3, 1.5), measure=lambda S, y: y, limit=(5.0, 7.0)),
    functools.partial(surprise_of, m=3, wanted=(0.3, 0.9)),
    functools.partial(surprise_of, m=3, wanted=(1.1, 3.0)),
    functools.partial(surprise_of, m=1, wanted=(1.1, 3.0)),
    functools.partial(surprise_of, m=1, wanted=(0.3, 0.9)),
    functools.partial(surprise_of, m=6, wanted=(0.3, 0.9)),
    functools.partial(surprise_of, m=6, wanted=(1.1, 3.0)),
    *(
        functools.partial(on_its_own_side, place=place, plausible=plausible, high=high)
        for place in (1.0, 0.1, 0.01, 0.001)
        for plausible in (True, False)
        for high in (True, False)
    ),
    # numbers of other units, and limits of other probabilities
    functools.partial(surprise, wanted=(0.05, 0.9), along=-1, std=(3e-4, 6e-4), limit=(0.1, 0.3)),
    functools.partial(surprise, wanted=(1.1, 3.0), along=1, std=(3e-4, 6e-4), limit=(0.1, 0.3)),
    functools.partial(surprise, wanted=(0.75, 0.9), along=1, std=(300.0, 600.0), limit=(30.0, 60.0)),
    functools.partial(surprise, wanted=(1.1, 3.0), along=-1, std=(300.0, 600.0), limit=(30.0, 60.0)),
    no_surprise,
    functools.partial(surprise_in_a_sure_direction, wanted=(1.5, 3.0)),
)


# References and wrong variants ------------------------------------------------


def predict_state(x, cov, A, B, u, cov_u):
    return kalman.predict(x, cov, A, B, u, cov_u)


def _predicted(state, cov):
    """A prediction with `state(x, A, B, u)` and `cov(P, A, B, cov_u)`."""

    def variant(x, P, A, B, u, cov_u):
        return state(x, A, B, u), cov(P, A, B, cov_u)

    return variant


def _moved(x, A, B, u):
    return A @ x + B @ u


def _grown(P, A, B, Q):
    return A @ P @ A.T + B @ Q @ B.T


def _without_B(x, P, A, B, u, Q):
    noise, k = np.zeros_like(P), len(u)
    noise[-k:, -k:] = Q
    return _moved(x, A, B, u), A @ P @ A.T + noise


def batch_estimate(x0, cov0, z, C, cov_z):
    return _batch()(x0, cov0, z, C, cov_z)


def _batch(prior=1.0, weight=np.linalg.inv, used=lambda z: z):
    """Weighted least squares over all measurements and what was known before, or a variant in one of its parts."""

    def variant(x0, cov0, z, C, cov_z):
        W, known = weight(cov_z), prior * np.linalg.inv(cov0)
        cov = np.linalg.pinv(known + len(used(z)) * C.T @ W @ C)
        return cov @ (known @ x0 + C.T @ W @ used(z).sum(0)), cov

    return variant


def _batch_of_sums(information, known):
    """All at once from sums; `information(prior's, one measurement's, number)` and the prior's part of the right side."""

    def variant(x0, cov0, z, C, cov_z):
        V, V0 = np.linalg.inv(cov_z), np.linalg.inv(cov0)
        cov = np.linalg.inv(information(V0, C.T @ V @ C, len(z)))
        return cov @ (known(V0, x0) + C.T @ V @ z.sum(0)), cov

    return variant


def _prior_with_each(x0, cov0, z, C, cov_z):
    return _batch(prior=float(len(z)))(x0, cov0, z, C, cov_z)


def _state_unweighted(x0, cov0, z, C, cov_z):
    return _batch_unweighted(x0, cov0, z, C, cov_z)[0], batch_estimate(x0, cov0, z, C, cov_z)[1]


def _batch_with_covariances(x0, cov0, z, C, cov_z):
    cov = np.linalg.inv(cov0 + len(z) * C.T @ cov_z @ C)
    return cov @ (cov0 @ x0 + C.T @ cov_z @ z.sum(0)), cov


def _batch_of_repeated_rows(x0, cov0, z, C, cov_z):
    rows, weight = np.repeat(C, len(z), axis=0), np.kron(np.eye(len(z)), np.linalg.inv(cov_z))
    cov = np.linalg.inv(np.linalg.inv(cov0) + rows.T @ weight @ rows)
    return cov @ (np.linalg.solve(cov0, x0) + rows.T @ weight @ z.ravel()), cov


def _batch_weighed_twice(x0, cov0, z, C, cov_z):
    """Least squares of rows that are multiplied with the whole inverse of their covariance."""
    V0, V = np.linalg.inv(cov0), np.linalg.inv(cov_z)
    W0, W = V0 @ V0, V @ V
    cov = np.linalg.inv(W0 + len(z) * C.T @ W @ C)
    return cov @ (W0 @ x0 + C.T @ W @ z.sum(0)), cov


def _batch_unweighted(x0, cov0, z, C, cov_z):
    cov = np.linalg.inv(np.eye(len(x0)) + len(z) * C.T @ C)
    return cov @ (x0 + C.T @ z.sum(0)), cov


def update(x, cov, z, C, cov_z):
    result = kalman.update(x, cov, z, C, cov_z)
    return result.x, result.cov


def _updated(gain=None, state=None, cov=None):
    """A correction with one part replaced."""

    def variant(x, P, z, C, R):
        K = (gain or _gain)(P, C, R)
        return (state or _corrected)(x, K, z, C), (cov or _shrunk)(P, K, C)

    return variant


def _joseph(sign):
    """Joseph's form with this sign before its second part."""

    def step(x, P, z, C, R):
        K = _gain(P, C, R)
        keep = np.eye(len(P)) - K @ C
        return _corrected(x, K, z, C), keep @ P @ keep.T + sign * K @ R @ K.T

    return step


def _gain(P, C, R):
    return P @ C.T @ np.linalg.inv(C @ P @ C.T + R)


def _gain_by_the_diagonal(P, C, R):
    return P @ C.T / np.diag(C @ P @ C.T + R)


def _by_the_diagonal(short):
    """A gain that divides by the variances of the innovation alone, with one of two forms of the covariance."""

    def variant(x, P, z, C, R):
        K = _gain_by_the_diagonal(P, C, R)
        return _corrected(x, K, z, C), _shrunk(P, K, C) if short else P - K @ (C @ P @ C.T + R) @ K.T

    return variant


def _number_by_number(x, P, z, C, R):
    """The numbers of a measurement one by one, each with the gain of the first covariance."""
    gains = [P @ c / (c @ P @ c + R[i, i]) for i, c in enumerate(C)]
    shrunk = P - sum(np.outer(k, c) @ P for k, c in zip(gains, C))
    for k, c, number in zip(gains, C, z):
        x = x + k * (number - c @ x)
    return x, shrunk


def _corrected(x, K, z, C):
    return x + K @ (z - C @ x)


def _shrunk(P, K, C):
    return (np.eye(len(P)) - K @ C) @ P


def fuse_two_sensors(x0, var0, z, stds):
    weights = np.array([1 / var0, *(1 / np.square(stds, dtype=float))])
    return weights @ [x0, *z] / weights.sum(), 1 / weights.sum()


def _fused(weights, var=None):
    """A weighted mean with `weights(var0, stds)`, three numbers."""

    def variant(x0, var0, z, stds):
        w = np.asarray(weights(var0, stds))
        return w @ [x0, *z] / w.sum(), (1 / w.sum() if var is None else var(var0, stds))

    return variant


def _second_from_the_old_variance(x0, var0, z, stds):
    first, second = (var0 / (var0 + std**2) for std in stds)
    x = x0 + first * (z[0] - x0)
    return x + second * (z[1] - x), (1 - second) * (1 - first) * var0


def _first_gain_for_both(x0, var0, z, stds):
    gain = var0 / (var0 + stds[0] ** 2)
    x = x0 + gain * (z[0] - x0)
    return x + gain * (z[1] - x), (1 - gain) ** 2 * var0


def steady_state_gain(A, C, cov_v, cov_z):
    return kalman.steady_state(A, C, cov_v, cov_z).gain


def _never_corrected(n):
    def variant(A, C, Q, R):
        P = np.eye(len(A))
        for _ in range(n):
            P = A @ P @ A.T + Q
        return _gain(P, C, R)

    return variant


def _settled(A, C, Q, R):
    """Covariance before and after the correction, once it stands still."""
    P = np.eye(len(A))
    for _ in range(1000):
        before = A @ P @ A.T + Q
        P = _shrunk(before, _gain(before, C, R), C)
    return before, P


def _rounds(n, gain=_gain, noise=1, carry=lambda A, P: A @ P @ A.T):
    """The gain after n rounds from the identity; with noise = 0, what the system adds is added at the start only."""

    def variant(A, C, Q, R):
        P = np.eye(len(A)) + (1 - noise) * Q
        for _ in range(n):
            P = carry(A, P) + noise * Q
            K = gain(P, C, R)
            P = _shrunk(P, K, C)
        return K

    return variant


def _stopped_at_zero(A, C, Q, R):
    """The settled gain, or 0 where that is the gain of the first round from a covariance of zeros."""
    return _rounds(1000)(A, C, Q, R) * _gain(Q, C, R).any()


def wrap_angle(angle):
    return wrapped(angle)


def motion_jacobians(x, u, dt):
    return odometry.step_jacobians(x, u, dt, "euler")


def _jacobians(change_x=None, change_u=None):
    def variant(x, u, dt):
        G_x, G_u = motion_jacobians(x, u, dt)
        return (change_x(G_x, x, u, dt) if change_x else G_x), (change_u(G_u, x, u, dt) if change_u else G_u)

    return variant


def _last_column(entries):
    def change(G, x, u, dt):
        G = G.copy()
        G[:2, 2] = entries(x, u, dt)
        return G

    return change


def _sine_sign(G, x, u, dt):
    return G * [[1, 1, -1], [1, 1, 1], [1, 1, 1]]


def _turned_once(angle):
    """Wrapped by one turn at most."""
    return angle - 2 * np.pi * np.sign(angle) if abs(angle) > np.pi else angle


def measurement(x, landmark):
    return ekf.measurement(x, np.atleast_2d(landmark))[0]


def _bearing_by_arccos(wrap):
    def variant(x, landmark):
        d = landmark - x[:2]
        return np.array([np.hypot(*d), wrap(np.arccos(d[0] / np.hypot(*d)) - x[2])])

    return variant


def measurement_jacobian(x, landmark):
    return ekf.measurement_jacobian(x, np.atleast_2d(landmark))[0]


def _in_the_robots_frame(x, landmark):
    r, phi = measurement(x, landmark)
    return np.array([[-np.cos(phi), -np.sin(phi), 0.0], [np.sin(phi) / r, -np.cos(phi) / r, -1.0]])


def _rows(change):
    """A Jacobian of wrong rows from dx, dy, r."""

    def variant(x, landmark):
        d = landmark - x[:2]
        return np.array(change(*d, np.hypot(*d)))

    return variant


def ekf_step(x, cov, u, dt, cov_u, z, landmark, cov_z):
    return _ekf()(x, cov, u, dt, cov_u, z, landmark, cov_z)


def _ekf(
    noise=True,
    wrap=wrapped,
    at="predicted",
    H_at="predicted",
    G_at="old",
    short=False,
    carry=True,
    gain=_gain,
    shrink=_shrunk,
    model="euler",
    control=lambda cov_u, dt: cov_u,
):
    """One step of the landmark filter, or a wrong one; expected measurement and Jacobians "at" old or predicted pose."""

    def step(x, cov, u, dt, cov_u, z, landmark, cov_z):
        pose = {"old": x, "predicted": odometry.step(x, u, dt, model)}
        moved = pose["predicted"]
        G_x, G_u = motion_jacobians(pose[G_at], u, dt)
        cov = (G_x @ cov @ G_x.T if carry else cov) + (G_u @ control(cov_u, dt) @ G_u.T if noise else 0)
        H = measurement_jacobian(pose[H_at], landmark)
        y = z - measurement(pose[at], landmark)
        y[1] = wrap(y[1])
        K = gain(cov, H, cov_z)
        return (moved, cov) if short else (moved + K @ y, shrink(cov, K, H))

    return step


def _through_the_linear_filter(predict_too, correct_too):
    """One step that hands the Jacobians to the linear filter: the bent functions themselves are lost."""

    def step(x, cov, u, dt, cov_u, z, landmark, cov_z):
        G_x, G_u = motion_jacobians(x, u, dt)
        moved = G_x @ x + G_u @ u if predict_too else odometry.step(x, u, dt, "euler")
        cov = G_x @ cov @ G_x.T + G_u @ cov_u @ G_u.T
        H = measurement_jacobian(moved, landmark)
        y = z - (H @ moved if correct_too else measurement(moved, landmark))
        if not correct_too:
            y[1] = wrapped(y[1])
        K = _gain(cov, H, cov_z)
        return moved + K @ y, _shrunk(cov, K, H)

    return step


def _ekf_by_the_slope(x, cov, u, dt, cov_u, z, landmark, cov_z):
    moved, cov = _ekf(short=True)(x, cov, u, dt, cov_u, z, landmark, cov_z)
    H = measurement_jacobian(moved, landmark)
    y = z - H @ moved
    y[1] = wrapped(y[1])
    K = _gain(cov, H, cov_z)
    return moved + K @ y, _shrunk(cov, K, H)


def _sum_wrapped(x, cov, u, dt, cov_u, z, landmark, cov_z):
    """Of z - h(x) + H x, from which `update` takes H x again, the bearing is wrapped, and not that of z - h(x)."""
    moved, cov = _ekf(short=True)(x, cov, u, dt, cov_u, z, landmark, cov_z)
    H = measurement_jacobian(moved, landmark)
    pseudo = z - measurement(moved, landmark) + H @ moved
    pseudo[1] = wrapped(pseudo[1])
    K = _gain(cov, H, cov_z)
    return moved + K @ (pseudo - H @ moved), _shrunk(cov, K, H)


def _ekf_in_degrees(x, cov, u, dt, cov_u, z, landmark, cov_z):
    moved, cov = _ekf(short=True)(x, cov, u, dt, cov_u, z, landmark, cov_z)
    H, expected = measurement_jacobian(moved, landmark), measurement(moved, landmark)
    y = np.array([z[0] - expected[0], wrapped(z[1] - np.rad2deg(expected[1]))])
    K = _gain(cov, H, cov_z)
    return moved + K @ y, _shrunk(cov, K, H)


def _all_wrapped(x, cov, u, dt, cov_u, z, landmark, cov_z):
    moved, cov = _ekf(short=True)(x, cov, u, dt, cov_u, z, landmark, cov_z)
    H = measurement_jacobian(moved, landmark)
    K = _gain(cov, H, cov_z)
    return moved + K @ wrapped(z - measurement(moved, landmark)), _shrunk(cov, K, H)


def _shrunk_at_the_end(x, cov, u, dt, cov_u, z, landmark, cov_z):
    moved, cov = _ekf(short=True)(x, cov, u, dt, cov_u, z, landmark, cov_z)
    K = _gain(cov, measurement_jacobian(moved, landmark), cov_z)
    y = z - measurement(moved, landmark)
    y[1] = wrapped(y[1])
    return _shrunk(cov, K, measurement_jacobian(moved + K @ y, landmark))


def _old_cov_corrected(x, cov, u, dt, cov_u, z, landmark, cov_z):
    predicted = _ekf(short=True)(x, cov, u, dt, cov_u, z, landmark, cov_z)[1]
    corrected = _ekf()(x, cov, u, dt, cov_u, z, landmark, cov_z)[1]
    return corrected @ np.linalg.solve(predicted, cov)


def nees(truth, x, cov):
    return kalman.nees(truth, x, cov, angle=2)


def _error(truth, x):
    e = truth - x
    e[2] = wrapped(e[2])
    return e


def _nees_of(heading):
    """NEES with `heading(true one, estimated one)` for the error of the heading."""

    def variant(truth, x, cov):
        e = np.append((truth - x)[:2], heading(truth[2], x[2]))
        return e @ np.linalg.solve(cov, e)

    return variant


def gate(innovation, cov_innovation, limit):
    return bool(kalman.nis(innovation, cov_innovation) < limit)


def _gated(score):
    def variant(y, S, limit):
        return bool(score(y, S) < limit)

    return variant


def _prior_cov(given):
    return np.array([[given["prior_cov_xx"], given["prior_cov_xv"]], [given["prior_cov_xv"], given["prior_cov_vv"]]])


def _printed_correction(change=lambda given: given, C=(1.0, 0.0)):
    given = change(dict(lecture.example("vehicle")))
    return kalman.update([given["prior_x"], given["prior_v"]], _prior_cov(given), [given["z"]], [C], [[given["var_z"]]])


def _with_prior_cov(prior, corrected):
    """So many times the covariance before the correction, and so many times the one behind it."""
    return prior * _prior_cov(lecture.example("vehicle")) + corrected * _printed_correction().cov


COVARIANCES = {  # wrong ones beside the right state
    "it is the one before the correction, prior_cov": lambda: _with_prior_cov(1, 0),
    "it is larger than prior_cov by just what a correction takes away, K C prior_cov": lambda: _with_prior_cov(2, -1),
    "it is what the correction takes away from prior_cov, K C prior_cov": lambda: _with_prior_cov(1, -1),
}
VARIANCES = {  # of other weights beside the right position
    "it is that of the prior": lambda: 20.0,
    "it is that of the sensors alone, without the prior": lambda: 1 / 5,
    "it is that of prior and first sensor": lambda: 1 / 4.05,
    "it is that of prior and second sensor": lambda: 1 / 1.05,
}
ONE_STEP_MORE = {"prior_cov_xx": 1.9469 + 0.2 * 0.2550 + 0.01 * 0.0916, "prior_cov_xv": 0.2550 + 0.1 * 0.0916}


def _not_divided(prior_x, prior_v, prior_cov_xx, prior_cov_xv, z, **_):
    return np.array([prior_x, prior_v]) + np.array([prior_cov_xx, prior_cov_xv]) * (z - prior_x)


def _each_by_its_own_variance(prior_x, prior_v, prior_cov_xx, prior_cov_vv, var_z, z, **_):
    variances = np.array([prior_cov_xx, prior_cov_vv])
    return np.array([prior_x, prior_v]) + variances / (variances + var_z) * (z - prior_x)


def _fusion(**changes):
    given = lecture.example("fusion") | changes
    stds = np.array([given["std1"], given["std2"]])
    return fuse_two_sensors(given["x0"], given["var0"], np.array([given["z1"], given["z2"]]), stds)[0]


OF_INTEGERS = (
    "right, but not for a pose of whole numbers, np.array([2, -1, 1]): an array of integers, and each copy of it, cuts "
    "the decimals off what is written into it:"
)
POSE = "a planar pose has three numbers"
LANDMARK = "a landmark of the floor has two coordinates"
READING = "a reading is a distance and a bearing"
CONTROL = "the control is a speed and a turn rate"

UNLIKE_SENSORS = "right, but not where one of the two measured numbers is a thousand times as exact as the other:"
STATE_AND_COV = metrics.Several(metrics.Numbers(1e-8), metrics.Numbers(1e-8), names=("state", "covariance"))

SMALL = metrics.Numbers(1e-8, least=0.0)
FUSED = metrics.Several(metrics.Numbers(1e-9, "m"), metrics.Numbers(1e-9), names=("position", "variance"))

POSE_AND_COV = metrics.Several(metrics.PlanarPoses(1e-7), metrics.Numbers(1e-7), names=("pose", "covariance"))

JACOBIANS = metrics.Several(metrics.Numbers(1e-5), metrics.Numbers(1e-5), names=("G_x", "G_u"))
ONE_STATE = "right, but not for a single state:"

CHAPTER = Chapter(
    "08-kalman",
    title="Kalman filters",
    items=[
        Exercise(
            "predict_state",
            reference=predict_state,
            sizes=("x", "cov", "A", "B", "u", "cov_u"),
            draw=(
                vehicle_prediction,
                functools.partial(prediction, n=3, k=2),
                functools.partial(prediction, n=2, k=2, sure=1e-3),
                functools.partial(prediction, n=4, k=1, sure=100.0),
            ),
            metric=STATE_AND_COV,
            noisy=(
                (functools.partial(prediction, n=1, k=1), STATE_AND_COV, ONE_STATE),
                (
                    functools.partial(prediction, n=2, k=3),
                    STATE_AND_COV,
                    "right, but not for more controls than states:",
                ),
                (
                    functools.partial(prediction, n=6, k=4, sure=1e4),
                    STATE_AND_COV,
                    "right, but not for six states and four controls, of which little is sure:",
                ),
                (
                    known_exactly,
                    STATE_AND_COV,
                    "right, but not where the state is known exactly, cov = 0, and the control is zero, though uncertain:",
                ),
                (
                    carried_out_exactly,
                    STATE_AND_COV,
                    "right, but not where the control is carried out exactly, cov_u = 0:",
                ),
            ),
            hints=(
                "The state follows the model; its uncertainty is carried along, and that of the control is added.",
                "x = A x + B u and cov = A cov A^T + B cov_u B^T (lines 2 and 3 of the lecture's algorithm).",
                "`return A @ x + B @ u, A @ cov @ A.T + B @ cov_u @ B.T`",
            ),
            mistakes=[
                Mistake(
                    _predicted(_moved, lambda P, A, B, Q: A @ P @ A.T),
                    "The control's noise is missing: add B cov_u B^T.",
                ),
                Mistake(
                    _predicted(lambda x, A, B, u: A @ x, _grown),
                    "The control itself is missing from the state: add B u.",
                ),
                Mistake(
                    _predicted(_moved, lambda P, A, B, Q: A.T @ P @ A + B @ Q @ B.T),
                    "A stands on the wrong side: A cov A^T, not A^T cov A.",
                ),
                Mistake(
                    _predicted(_moved, lambda P, A, B, Q: A @ P + B @ Q @ B.T),
                    "A covariance is multiplied from both sides: A cov A^T.",
                ),
                Mistake(
                    _predicted(_moved, lambda P, A, B, Q: A @ P @ A.T + Q),
                    "You added cov_u as it is. The control acts through B, and so does its noise: B cov_u B^T.",
                ),
                Mistake(
                    _predicted(_moved, lambda P, A, B, Q: P + B @ Q @ B.T),
                    "The old covariance must be carried along by A, as the state is: A cov A^T.",
                    id="predict_state-1d98b0",
                ),
                Mistake(
                    _predicted(_moved, lambda P, A, B, Q: A * P * A.T + B @ Q @ B.T),
                    "`*` multiplies entry by entry. The matrix product is `@`.",
                ),
                Mistake(
                    _predicted(_moved, lambda P, A, B, Q: A @ P @ A + B @ Q @ B.T),
                    "The last factor is the transpose of A.",
                ),
                Mistake(
                    _predicted(_moved, lambda P, A, B, Q: A @ P @ A.T + B * Q * B.T),
                    "This is right for a single control only. Several take matrix products, B @ cov_u @ B.T, and no `*`.",
                    id="predict_state-212af3",
                ),
                Mistake(
                    _predicted(_moved, lambda P, A, B, Q: A @ P @ A.T + B @ B.T * Q),
                    "This is right for a single control only. Several take matrix products, B @ cov_u @ B.T, and no `*`.",
                    id="predict_state-212af3-2",
                ),
                Mistake(
                    _predicted(_moved, lambda P, A, B, Q: A @ P @ A.T - B @ Q @ B.T),
                    "Uncertainties add: there is no minus.",
                ),
                Mistake(
                    _predicted(lambda x, A, B, u: A @ x - B @ u, _grown), "A sign: the control is added, A x + B u."
                ),
                Mistake(
                    _predicted(lambda x, A, B, u: x + B @ u, _grown),
                    "The old state is added as it is. It must be carried along by A: A x + B u.",
                    id="predict_state-5060be",
                ),
                Mistake(_predicted(lambda x, A, B, u: B @ u, _grown), "The old state is missing: add A x."),
                Mistake(
                    _predicted(lambda x, A, B, u: A @ (x + B @ u), _grown),
                    "The control acts during this step: it is added after A x, not before.",
                ),
                Mistake(
                    _predicted(lambda x, A, B, u: x @ A + B @ u, _grown),
                    "The order: A x is written A @ x. Yours is A^T x.",
                ),
                Mistake(
                    _predicted(lambda x, A, B, u: A @ x + u, _grown),
                    "You added u as it is. The control acts through B: B u.",
                ),
                Mistake(
                    _predicted(_moved, lambda P, A, B, Q: A @ P @ A.T + B @ Q),
                    "The control's covariance is multiplied from both sides: B cov_u B^T.",
                ),
                Mistake(
                    _predicted(_moved, lambda P, A, B, Q: A @ P @ A.T + B @ B.T),
                    "The covariance of the control is missing between B and its transpose.",
                ),
                Mistake(
                    _predicted(_moved, lambda P, A, B, Q: A @ P @ A.T + B @ Q @ Q @ B.T),
                    "cov_u holds variances already: do not square it.",
                ),
                Mistake(
                    _predicted(_moved, lambda P, A, B, Q: A @ (P + B @ Q @ B.T) @ A.T),
                    "The control's noise comes in during this step: it is added after A cov A^T, not carried along with it.",
                ),
                Mistake(
                    _predicted(_moved, lambda P, A, B, Q: A @ P @ A.T + Q[0, 0] * B @ B.T),
                    "You took the first entry of cov_u alone. It is a matrix, one row per control: B cov_u B^T.",
                ),
                Mistake(
                    _predicted(lambda x, A, B, u: A @ x + B[:, 0] * u[0], _grown),
                    "You added the first control alone: B u takes them all, B @ u.",
                ),
                Mistake(
                    _predicted(_moved, lambda P, A, B, Q: A @ P @ np.linalg.inv(A) + B @ Q @ B.T),
                    "The last factor is the transpose of A, not its inverse.",
                ),
                Mistake(
                    _predicted(_moved, lambda P, A, B, Q: B @ Q @ B.T), "The old covariance is missing: add A cov A^T."
                ),
                Mistake(
                    _predicted(_moved, lambda P, A, B, Q: A @ P @ A.T + Q[0, 0] * np.eye(len(A))),
                    "You added the variance of the first control to every state. It acts through B: B cov_u B^T.",
                ),
                Mistake(lambda *given: predict_state(*given)[::-1], "The order is state, covariance."),
                Mistake(
                    _without_B,
                    "B is missing in the covariance: the control's noise enters through it, as B cov_u Bᵀ, not as a block by itself.",
                ),
            ],
        ),
        Exercise(
            "update",
            reference=update,
            sizes=("x", "cov", "z", "C", "cov_z"),
            draw=tuple(
                functools.partial(mixed_measurement, n=n, m=m, off=off, sure=sure, unit=unit)
                for n, m, off, sure, unit in (
                    (2, 2, 30.0, 1.0, 1.0),
                    (3, 1, 0.01, 1.0, 1.0),
                    (2, 3, 1.0, 1e-3, 1.0),
                    (3, 3, 0.01, 1.0, 1.0),
                    (4, 2, 1.0, 100.0, 0.1),
                )
            ),
            metric=STATE_AND_COV,
            noisy=(
                (functools.partial(mixed_measurement, n=1, m=1), STATE_AND_COV, ONE_STATE),
                (
                    functools.partial(mixed_measurement, n=6, m=5, off=1000.0, sure=1e4),
                    STATE_AND_COV,
                    "right, but not for six states and five measured numbers, of which little is sure:",
                ),
                (
                    functools.partial(mixed_measurement, n=3, m=2, off=0.0),
                    STATE_AND_COV,
                    "right, but not where just what was expected is measured: the covariance shrinks all the same:",
                ),
                (
                    functools.partial(mixed_measurement, n=3, m=2, off=1e6),
                    STATE_AND_COV,
                    "right, but not for a measurement that is a million off: however far, none is left out here:",
                ),
                (
                    functools.partial(one_far_more_exact, measured=functools.partial(mixed_measurement, n=3, m=2)),
                    STATE_AND_COV,
                    UNLIKE_SENSORS,
                ),
            ),
            hints=(
                "How surprising is the measurement, and how much of the surprise belongs to the state?",
                "S = C cov C^T + cov_z, K = cov C^T S^-1, x + K (z - C x), (I - K C) cov.",
                "`K = cov @ C.T @ np.linalg.inv(C @ cov @ C.T + cov_z)\n"
                "return x + K @ (z - C @ x), (np.eye(len(x)) - K @ C) @ cov`",
            ),
            mistakes=[
                Mistake(
                    _updated(gain=lambda P, C, R: P @ C.T @ np.linalg.inv(C @ P @ C.T)),
                    "The sensor's noise is missing from S: your filter believes every measurement.",
                ),
                Mistake(
                    _updated(gain=lambda P, C, R: P @ C.T @ np.linalg.inv(R)),
                    "S is the noise of the sensor plus the uncertainty of the expected measurement, C cov C^T.",
                ),
                Mistake(
                    _updated(state=lambda x, K, z, C: x - K @ (z - C @ x)),
                    "You correct away from the measurement: add K times the innovation.",
                ),
                Mistake(
                    _updated(state=lambda x, K, z, C: x + K @ z),
                    "Only the surprise is news: subtract the expected measurement C x.",
                ),
                Mistake(
                    _updated(state=lambda x, K, z, C: K @ (z - C @ x)),
                    "You return the correction alone: add it to the prediction x.",
                ),
                Mistake(
                    _updated(gain=lambda P, C, R: P @ C.T @ (C @ P @ C.T + R)),
                    "You multiplied by S. The gain divides by it: its inverse stands there.",
                ),
                Mistake(
                    _updated(cov=lambda P, K, C: P), "The covariance stays as it was: a measurement must shrink it."
                ),
                Mistake(
                    _updated(cov=lambda P, K, C: (np.eye(len(P)) + K @ C) @ P),
                    "A sign: (I - K C) cov. Yours grows with every measurement.",
                ),
                Mistake(
                    _updated(cov=lambda P, K, C: P @ (np.eye(len(P)) - K @ C)),
                    "The order: (I - K C) stands to the left of cov.",
                ),
                Mistake(
                    _updated(cov=lambda P, K, C: (1 - K @ C) @ P),
                    "1 - K C subtracts from a matrix full of ones. The identity is np.eye(n).",
                ),
                Mistake(
                    _updated(cov=lambda P, K, C: (np.eye(len(C)) - K @ C) @ P),
                    "The identity has the size of the state, np.eye(len(x)), whatever the number of measurements.",
                ),
                Mistake(
                    _updated(cov=lambda P, K, C: (np.eye(2) - K @ C) @ P),
                    "The identity is 2 x 2 in your function. It has the size of the state: np.eye(len(x)).",
                ),
                Mistake(
                    _updated(cov=lambda P, K, C: P - K @ C),
                    "The last factor is missing: what is taken away is K C cov.",
                ),
                Mistake(
                    _joseph(-1),
                    "Joseph's form has a plus: the sensor's noise K cov_z K^T comes in again.",
                    id="update-ee7d3e",
                ),
                Mistake(
                    _updated(gain=lambda P, C, R: _gain(P, C, np.diag(np.diag(R)))),
                    "You took the diagonal of cov_z alone. Noises that belong together have entries off the diagonal.",
                    "update-27aa40",
                ),
                Mistake(
                    _updated(gain=lambda P, C, R: C @ P @ np.linalg.inv(C @ P @ C.T + R)),
                    "The gain begins with cov C^T, not C cov.",
                ),
                Mistake(
                    _updated(gain=lambda P, C, R: P @ C.T @ np.linalg.inv(C @ P @ C.T - R)),
                    "Uncertainties add: S = C cov C^T + cov_z.",
                ),
                Mistake(
                    _updated(gain=lambda P, C, R: P @ np.linalg.inv(P + R)),
                    "C is missing from the gain: the sensor does not see the state itself.",
                ),
                Mistake(
                    _updated(gain=lambda P, C, R: P @ C @ np.linalg.inv(C @ P @ C.T + R)),
                    "C stands transposed in the gain: cov C^T S^-1.",
                ),
                Mistake(
                    _updated(gain=lambda P, C, R: C.T @ np.linalg.inv(C @ P @ C.T + R)),
                    "cov is missing from the gain: cov C^T S^-1.",
                ),
                Mistake(
                    _updated(gain=lambda P, C, R: np.linalg.inv(C @ P @ C.T + R) @ P @ C.T),
                    "The order: the inverse of S stands to the right of cov C^T.",
                ),
                Mistake(
                    _updated(gain=lambda P, C, R: np.linalg.inv(C @ P @ C.T + R) @ C @ P),
                    "This is the transpose of the gain: K = cov C^T S^-1.",
                ),
                Mistake(_updated(gain=lambda P, C, R: P @ C.T), "The division by S is missing from the gain."),
                Mistake(
                    _updated(gain=lambda P, C, R: P @ C.T / (C @ P @ C.T + R)),
                    "`/` divides entry by entry. Dividing by a matrix is multiplying by its inverse, np.linalg.inv(S).",
                ),
                Mistake(
                    _updated(gain=lambda P, C, R: P @ C.T @ (1 / (C @ P @ C.T + R))),
                    "`1 / S` is one over each entry by itself. The inverse of a matrix is np.linalg.inv(S).",
                    "update-2ffc44",
                ),
                Mistake(
                    _updated(gain=lambda P, C, R: P @ C.T @ np.linalg.inv(C @ P @ C.T + R @ R)),
                    "cov_z holds variances already: do not square it.",
                ),
                Mistake(
                    _updated(gain=lambda P, C, R: P @ C.T @ np.linalg.inv(C.T @ P @ C + R)),
                    "C is on the wrong side in S: C cov C^T, not C^T cov C.",
                ),
                Mistake(_updated(state=lambda x, K, z, C: x + K @ (z - x)), "The expected measurement is C x, not x."),
                Mistake(
                    _updated(state=lambda x, K, z, C: x + (z - C @ x)),
                    "The gain is missing from the state: K times the innovation.",
                ),
                Mistake(
                    _updated(state=lambda x, K, z, C: z),
                    "You return the measurement. The filter believes only a part of it: x + K (z - C x).",
                ),
                Mistake(
                    _updated(state=lambda x, K, z, C: x),
                    "The covariance is right, but the state was not corrected: x + K (z - C x).",
                ),
                Mistake(
                    _updated(state=lambda x, K, z, C: x + K.T @ (z - C @ x)),
                    "K stands transposed in the state: K (z - C x).",
                ),
                Mistake(
                    _updated(cov=lambda P, K, C: (np.eye(len(P)) - K) @ P),
                    "C is missing from the covariance: (I - K C) cov.",
                ),
                Mistake(_updated(cov=lambda P, K, C: (np.eye(len(P)) - C @ K) @ P), "The order: K C, not C K."),
                Mistake(
                    _updated(cov=lambda P, K, C: K @ C @ P),
                    "This is what is taken away. The new covariance is what is left: (I - K C) cov.",
                ),
                Mistake(
                    _updated(cov=lambda P, K, C: np.eye(len(P)) - K @ C @ P), "Brackets are missing: (I - K C) cov."
                ),
                Mistake(
                    _updated(cov=lambda P, K, C: (np.eye(len(P)) - K @ C) * P),
                    "`*` multiplies entry by entry. The matrix product is `@`.",
                ),
                Mistake(
                    _updated(cov=lambda P, K, C: np.eye(len(P)) - K @ C), "The last factor is missing: (I - K C) cov."
                ),
                Mistake(
                    _updated(cov=lambda P, K, C: (np.eye(len(P)) - K @ C) @ P @ (np.eye(len(P)) - K @ C).T),
                    "Half of Joseph's form: K cov_z K^T is missing. Or leave the last factor out: (I - K C) cov.",
                    id="update-076e3e",
                ),
                Mistake(
                    lambda x, P, z, C, R: (
                        _corrected(x, _gain(update(x, P, z, C, R)[1], C, R), z, C),
                        update(x, P, z, C, R)[1],
                    ),
                    "The gain comes from the covariance before the correction. You computed it anew from the corrected one.",
                ),
                Mistake(lambda *given: update(*given)[::-1], "The order is state, covariance."),
                *(
                    Mistake(
                        _by_the_diagonal(short),
                        "You divide by the diagonal of S alone. What is measured together goes together: S is to be inverted as a whole.",
                    )
                    for short in (True, False)
                ),
                Mistake(
                    _number_by_number,
                    "Each number of the measurement meets the covariance from before them all. One by one, the second meets what the first has left.",
                ),
            ],
        ),
        Prediction(
            "printed",
            question="The slide's algorithm is called as KalmanFilter(x_k, u_k, z_k+1) and returns x_k+1. What is missing to call it step after step?",
            choices=("nothing", "the covariance, in and out", "the gain, in and out", "the next control"),
            answer="the covariance, in and out",
            why="Line 3 reads the covariance of step k and line 8 computes that of step k + 1, but neither the arguments nor the result "
            "name it. The gain is made anew in each step and needs no memory.",
        ),
        Prediction(
            "bell",
            question="Prediction and measurement are equally sure but 2 m apart. The corrected bell, compared with both, is ...",
            choices=("wider than both", "as wide as both", "narrower than both"),
            answer="narrower than both",
            why="Two independent opinions always make the filter surer, even when they contradict each other. Only the NIS notices the contradiction.",
        ),
        Exercise(
            "fuse_two_sensors",
            reference=fuse_two_sensors,
            sizes=("x0", "var0", "z", "stds"),
            draw=(
                one_position_two_sensors,
                functools.partial(one_position_two_sensors, better=1),
                functools.partial(one_position_two_sensors, var0=(20, 500)),
                functools.partial(one_position_two_sensors, better=1, var0=(0.01, 0.05)),
            ),
            fixed={"z": "there are two sensors", "stds": "there are two sensors"},
            metric=FUSED,
            noisy=[
                (
                    two_sensors_that_disagree,
                    FUSED,
                    "right where the sensors agree. Where they are far apart the weights stay what they are:",
                ),
                (prior_at_zero, FUSED, "right, but not where the prior says 0: that is a position like any other:"),
                (equally_good_sensors, FUSED, "right, but not for two equally good sensors that do not agree:"),
                *(
                    (
                        functools.partial(two_equal_readings, better=better),
                        FUSED,
                        "right, but not for two equal readings of sensors that are not equally good:",
                    )
                    for better in (0, 1)
                ),
                (two_sensors_alike, FUSED, "right, but not for two equal readings of equally good sensors:"),
                (
                    two_sharp_sensors,
                    metrics.Several(metrics.Numbers(1e-9, "m"), SMALL, names=("position", "variance")),
                    "right, but not a kilometer away and known to millimeters:",
                ),
            ],
            hints=(
                "Each opinion (the prior, two sensors) counts as much as it is certain.",
                "Weights are 1 / variance. The variance of the weighted mean is 1 / (sum of the weights).",
                "`w = np.array([1 / var0, *(1 / stds**2)])\nreturn w @ [x0, *z] / w.sum(), 1 / w.sum()`",
            ),
            mistakes=[
                Mistake(
                    lambda x0, v, z, s: (
                        _fused(lambda v, s: [v, *s**2])(x0, v, z, s)[0],
                        fuse_two_sensors(x0, v, z, s)[1],
                    ),
                    "The variance is right. Your weights of the position are the variances: what is uncertain counts most. Take one over them.",
                ),
                Mistake(
                    _second_from_the_old_variance,
                    "The second sensor meets the variance from before the first one. After a correction the new variance counts.",
                ),
                Mistake(
                    _first_gain_for_both,
                    "The second sensor gets the gain of the first. Each has its own, var / (var + std^2), with its std and the variance that is left.",
                ),
                *(
                    Mistake(
                        _fused(lambda v, s: [1 / np.sqrt(v), *(1 / s)], var),
                        "Weights are one over the variance, not over the standard deviation.",
                        id=id,
                    )
                    for var, id in (
                        (None, "fuse_two_sensors-0bee01"),
                        (lambda v, s: (1 / np.sqrt(v) + (1 / s).sum()) ** -2, "fuse_two_sensors-stds-squared"),
                        (lambda v, s: 1 / (1 / v + (1 / s**2).sum()), "fuse_two_sensors-stds-position"),
                    )
                ),
                Mistake(
                    _fused(lambda v, s: [0, *(1 / s**2)]), "The prior is missing. It is an opinion like the others."
                ),
                Mistake(
                    _fused(lambda v, s: [1, 1, 1]), "You took the plain mean. The better sensor should count more."
                ),
                Mistake(
                    _fused(lambda v, s: [v, *s**2]),
                    "You weigh by the variance: the worst opinion counts most. Take one over it.",
                ),
                Mistake(
                    _fused(lambda v, s: [1 / v**2, *(1 / s**2)]),
                    "The prior comes as a variance already: do not square it.",
                ),
                Mistake(
                    _fused(lambda v, s: [1 / v, *(1 / s**2)], lambda v, s: 1 / np.sqrt(1 / v + (1 / s**2).sum())),
                    "The position is right; you return the standard deviation. The variance is asked for.",
                ),
                Mistake(
                    _fused(lambda v, s: [1 / v, *(1 / s)]),
                    "The sensors come with standard deviations: square them first, a weight is one over the variance.",
                    "fuse_two_sensors-569d4f",
                ),
                Mistake(lambda *given: fuse_two_sensors(*given)[::-1], "The order is position, variance."),
                Mistake(
                    _fused(lambda v, s: [1 / v, *(1 / s**2)], lambda v, s: 1 / v + (1 / s**2).sum()),
                    "The position is right. The new variance is one over the sum of the weights.",
                ),
                Mistake(
                    _fused(lambda v, s: [1 / v, *(1 / s**2)], lambda v, s: v + (s**2).sum()),
                    "The position is right. Variances do not add here, their reciprocals do: 1 / (sum of the weights).",
                ),
                Mistake(
                    _fused(lambda v, s: [1 / v, *(1 / s**2)], lambda v, s: v),
                    "The position is right, but the variance is still the prior's.",
                ),
                Mistake(
                    _fused(lambda v, s: [1 / v, *(1 / s**2)], lambda v, s: 1 / (1 / s**2).sum()),
                    "The position is right. The prior is missing from the variance.",
                ),
                Mistake(
                    _fused(lambda v, s: [1 / v, *(1 / s**2)], lambda v, s: (v + (s**2).sum()) / 3),
                    "The position is right. The variance is no mean: three opinions are surer than each of them.",
                ),
                Mistake(
                    _fused(lambda v, s: [0, 1, 1]),
                    "You took the mean of the sensors: the better one should count more, and the prior is an opinion, too.",
                ),
                Mistake(
                    lambda x0, v, z, s: (np.mean([x0, *z]), fuse_two_sensors(x0, v, z, s)[1]),
                    "The variance is right. The position is no plain mean: the weights 1 / variance belong to it, too.",
                ),
                Mistake(
                    _fused(lambda v, s: [1 / v, *(s == s.min()) / s**2]),
                    "Of the sensors the better one alone counts in yours. The other is an opinion as well, if a weaker one.",
                ),
                Mistake(_fused(lambda v, s: [1 / v, 1 / s[0] ** 2, 0]), "The second sensor is missing."),
                Mistake(_fused(lambda v, s: [1 / v, 0, 1 / s[1] ** 2]), "The first sensor is missing."),
                Mistake(_fused(lambda v, s: [1 / v, *(1 / s**4)]), "You squared the standard deviations twice."),
                Mistake(
                    lambda x0, v, z, s: (
                        fuse_two_sensors(x0, v, z, s)[0] / fuse_two_sensors(x0, v, z, s)[1],
                        fuse_two_sensors(x0, v, z, s)[1],
                    ),
                    "The variance is right. A weighted mean is divided by the sum of its weights.",
                ),
                Mistake(
                    lambda x0, v0, z, s: fuse_two_sensors(x0, v0, [np.mean(z)] * 2, [np.sqrt((s @ s) / 2)] * 2),
                    "You take the plain mean of both sensors first. The better one is to count more: each weighs one over its variance.",
                ),
            ],
        ),
        Value(
            "fused",
            reference=_fusion,
            unit="m",
            rtol=5e-5,
            beside=(("variance", metrics.Numbers(1e-4), lambda: 1 / 5.05, VARIANCES),),
            hints=(
                "The page's prior is 0 with the variance 20, its sensors have the standard deviations 0.5 and 1.",
                "Put the printed numbers into your `fuse_two_sensors`; its first result is the position. Hand over both, or the position alone.",
                "`fused = fuse_two_sensors(0.0, 20.0, np.array([9.4, 10.6]), np.array([0.5, 1.0]))[0]`",
            ),
            mistakes=[
                Mistake(
                    lambda: _fusion(var0=1e15),
                    "This is the fusion of the sensors alone. The page prints a prior, Sigma_0 = 20; it pulls a little toward 0.",
                ),
                Mistake(
                    lambda: _fusion(var0=400.0),
                    "This takes the 20 as a standard deviation. Interesting: that gives the printed 9.6. But the page writes Sigma_0, a variance.",
                    id="fused-ef2548",
                ),
                Mistake(
                    lambda: _fusion(z1=9.407),
                    "This takes 9.407 for the first reading, which would give the printed 9.6. The page prints 9.4: take that.",
                    id="fused-unprinted",
                ),
                Mistake(lambda: 9.6, "This is what the page prints. It is not what its numbers give: compute it."),
                Mistake(
                    lambda: _fusion(std1=0.25, std2=1.0),
                    "0.25 is the first sensor's variance already; its standard deviation is 0.5.",
                ),
                Mistake(
                    lambda: 10.0,
                    "This is the plain mean of both sensors, and the true position. Asked is the weighted mean: one over the variance is 4 and 1, and 1/20 for the prior.",
                    id="fused-ef4d72",
                ),
                Mistake(
                    lambda: _fusion(std1=np.sqrt(0.5), std2=1.0),
                    "This weighs the sensors by one over the standard deviation. One over the variance is 4 and 1.",
                    id="fused-47698a",
                ),
                Mistake(lambda: 1 / 5.05, "This is the variance, the second result. The position is asked for."),
                Mistake(
                    lambda: 20 / 3, "The plain mean of prior and sensors. Each counts as much as one over its variance."
                ),
                Mistake(
                    lambda: _fusion(x0=10.0),
                    "This has the true position as the prior. The page's prior is 0.",
                    id="fused-6c1ba9",
                ),
                Mistake(
                    lambda: _fusion(std1=1.0, std2=0.5),
                    "The standard deviations, or the measurements, are exchanged: 9.4 comes with 0.5, 10.6 with 1.",
                    id="fused-5acd72",
                ),
                Mistake(lambda: _fusion(x0=20.0), "20 is the prior's variance. Its position is 0."),
                Mistake(
                    lambda: _fusion(var0=20.0**0.5),
                    "This has the root of the prior's variance, which goes in as it is.",
                    id="fused-9ac8d0",
                ),
                Mistake(lambda: _fusion(std2=1e9), "The second sensor is missing."),
                Mistake(lambda: _fusion(std1=1e9), "The first sensor is missing."),
                Mistake(lambda: 9.4 * 4 + 10.6, "A weighted mean is divided by the sum of its weights."),
                Mistake(
                    lambda: (9.4 / 0.5 + 10.6) / (20**-0.5 + 2 + 1),
                    "Weights are one over the variance, not over the standard deviation.",
                ),
            ],
        ),
        Prediction(
            "velocity",
            question="The vehicle measures its position, never its velocity. What becomes of the velocity's uncertainty while it drives?",
            choices=("it grows without end", "it stays as in the beginning", "it settles at a small value"),
            answer="it settles at a small value",
            why="The off-diagonal entry of the covariance ties both together: whoever is surprised in position learns about the velocity.",
        ),
        Exercise(
            "steady_state_gain",
            reference=steady_state_gain,
            draw=(
                functools.partial(steady_system, n=3, m=2),
                functools.partial(steady_system, n=2, m=2),
                steady_vehicle,
                functools.partial(steady_vehicle, T=(1.0, 2.0)),  # where what enters the position would tell
                functools.partial(steady_system, n=3, m=1),
            ),
            metric=metrics.Numbers(1e-3),
            noisy=(
                (
                    slow_system,
                    metrics.Numbers(1e-3),
                    "right where the gain settles soon, but not where the system's noise is tiny beside the sensor's, and it takes "
                    "hundreds of rounds (do you stop earlier?):",
                ),
                (
                    growing_system,
                    metrics.Numbers(1e-3),
                    "right, but not for a system of which a state grows by itself, by an eigenvalue of A above 1:",
                ),
                (
                    one_sensor_far_sharper,
                    metrics.Numbers(1e-3),
                    "right for sensors of like quality, but not where one is forty times as exact as the other:",
                ),
                (
                    forgetful_system,
                    metrics.Numbers(1e-3),
                    "right, but not for a system that forgets a state from step to step, so that A has no inverse:",
                ),
                (functools.partial(steady_system, n=1, m=1), metrics.Numbers(1e-3), ONE_STATE),
                *(
                    (
                        functools.partial(steady_system, n=5, m=3, sure=sure),
                        metrics.Numbers(1e-3),
                        f"right, but not for noises whose variances are {words} (tried with five states):",
                    )
                    for sure, words in (
                        (1e3, "hundreds"),
                        (1e-3, "some thousandths at most"),
                        (1e-8, "some hundred-millionths at most, as those of a sensor good to a tenth of a millimeter"),
                    )
                ),
                (
                    functools.partial(steady_system, n=2, m=3),
                    metrics.Numbers(1e-3),
                    "right, but not for more measured numbers than states:",
                ),
            ),
            hints=(
                "The gain does not depend on the data. Run the covariance alone until the gain stands still.",
                "Repeat: cov = A cov A^T + cov_v, K = cov C^T S^-1, cov = (I - K C) cov. Some thousand times are cheap. Or let SciPy solve the Riccati equation.",
                "`from scipy.linalg import solve_discrete_are\n"
                "P = solve_discrete_are(A.T, C.T, cov_v, cov_z)\n"
                "return P @ C.T @ np.linalg.inv(C @ P @ C.T + cov_z)`",
            ),
            mistakes=[
                Mistake(
                    lambda A, C, Q, R: kalman.steady_state(A, C, Q, R).gain.T,
                    "This is the transpose: the gain turns m numbers into n states, (n, m).",
                ),
                Mistake(
                    lambda A, C, Q, R: _settled(A, C, Q, R)[0],
                    "This is the covariance before the correction. The gain is made of it: cov C^T S^-1.",
                ),
                Mistake(
                    lambda A, C, Q, R: _settled(A, C, Q, R)[1],
                    "This is the covariance after the correction. Asked for is the gain.",
                ),
                Mistake(
                    lambda A, C, Q, R: _gain(kalman.steady_state(A, C, Q, R).cov_after, C, R),
                    "Your gain comes from the covariance after the correction. It needs the one before.",
                ),
                Mistake(
                    lambda A, C, Q, R: _gain(A @ A.T + Q, C, R),
                    "This is the gain of the first step. Repeat until it stands still.",
                ),
                Mistake(
                    lambda A, C, Q, R: _gain(Q, C, R),
                    "This is the gain that belongs to cov_v alone, as in a first step from a covariance of zeros. The covariance is what builds up: repeat until the gain stands still.",
                    id="steady_state_gain-4fcede",
                ),
                Mistake(
                    lambda A, C, Q, R: kalman.steady_state(A, C, Q, R).cov_before @ C.T @ np.linalg.inv(R),
                    "Not cov_z alone is divided by: the covariance before the correction goes with S = C cov C^T + cov_z.",
                ),
                Mistake(
                    lambda A, C, Q, R: A @ kalman.steady_state(A, C, Q, R).gain,
                    "This is A K, the gain of the form that predicts and corrects in one line. Here the correction's own gain is asked for.",
                ),
                Mistake(
                    lambda A, C, Q, R: solve_continuous_are((A - np.eye(len(A))).T, C.T, Q, R) @ C.T @ np.linalg.inv(R),
                    "This solves the Riccati equation of continuous time. The filter goes in steps: solve_discrete_are, and K = P C^T S^-1.",
                    id="steady-continuous-rate",
                ),
                Mistake(
                    lambda A, C, Q, R: solve_continuous_are(A.T, C.T, Q, R) @ C.T @ np.linalg.inv(R),
                    "This solves the Riccati equation of continuous time. The filter goes in steps: solve_discrete_are, and K = P C^T S^-1.",
                    id="steady_state_gain-d48c64",
                ),
                Mistake(
                    _rounds(5), "Five rounds are too few: repeat until the gain stands still, some thousand times."
                ),
                Mistake(
                    _rounds(10), "Ten rounds are too few: repeat until the gain stands still, some thousand times."
                ),
                Mistake(
                    _stopped_at_zero,
                    "Your gain stays 0 where the noise reaches the position only through the velocity. From a covariance of zeros the first "
                    "gain is 0 there: a loop that compares it with a gain of zeros stops at once.",
                ),
                Mistake(
                    _rounds(1000, gain=_gain_by_the_diagonal),
                    "You divide by the diagonal of S alone. What is measured together goes together: S is to be inverted as a whole.",
                ),
                Mistake(
                    _rounds(1000, carry=lambda A, P: A.T @ P @ A),
                    "A stands on the wrong side: A cov A^T, not A^T cov A.",
                ),
                Mistake(
                    lambda A, C, Q, R: _gain(solve_discrete_are(A, C.T, Q, R), C, R),
                    "A stands where its transpose belongs: solve_discrete_are is written for control, and a filter hands it A.T and C.T.",
                    id="steady_state_gain-a-of-control",
                ),
                Mistake(
                    _rounds(1000, carry=lambda A, P: P),
                    "The old covariance must be carried along by A, in every round: A cov A^T.",
                ),
                Mistake(
                    _rounds(1000, gain=lambda P, C, R: _gain(P, C, 0 * R)),
                    "The sensor's noise is missing from S: this gain believes every measurement.",
                ),
                *(
                    Mistake(
                        _rounds(n, noise=0),
                        "Here cov_v comes in at the start only, or not at all. The system adds its noise anew with every step: add it within the loop.",
                        id=id,
                    )
                    for n, id in ((1000, "steady_state_gain-08a959"), (3000, "steady_state_gain-08a959-2"))
                ),
                Mistake(
                    lambda A, C, Q, R: kalman.steady_state(A, C, Q, R @ R).gain,
                    "cov_z holds variances already: do not square it.",
                ),
                Mistake(
                    lambda A, C, Q, R: steady_state_gain(A, C, Q, R)[:, 0],
                    "This is the first column alone. K is a matrix, shape (n, m), also where it has one column.",
                ),
                *(
                    Mistake(
                        _never_corrected(n),
                        "The correction is missing in your loop, cov = (I - K C) cov: this is the gain of a filter that has never measured before.",
                    )
                    for n in (100, 200, 300, 500, 1000, 2000, 3000, 5000)
                ),
            ],
        ),
        Value(
            "corrected",
            reference=lambda: _printed_correction().x,
            unit="m, m/s",
            metric=metrics.First(
                metrics.Numbers(1e-4),
                (("covariance", metrics.Numbers(1e-4), lambda: _printed_correction().cov, COVARIANCES),),
            ),
            hints=(
                "Only the correction is asked for: the prediction is printed.",
                "Your `update` with C = (1, 0), z = 11.79 and the variance 0.25. State and covariance, or the state alone.",
                "`corrected = update(np.array([12.5, 5.0]), prior_cov, np.array([11.79]), np.array([[1.0, 0.0]]), np.array([[0.25]]))`",
            ),
            mistakes=[
                Mistake(
                    lambda: _printed_correction(C=(0.0, 1.0)).x,
                    "This takes the measurement for one of the velocity. The sensor sees the position: C = (1, 0).",
                    id="corrected-fd1dc1",
                ),
                Mistake(
                    lambda: _not_divided(**lecture.example("vehicle")),
                    "The gain is not divided by S, the variance of the innovation: 1.9469 + 0.25.",
                ),
                Mistake(
                    lambda: np.array([11.90, 4.98]),
                    "This is what the page prints. Its own numbers give something else: compute it.",
                ),
                Mistake(
                    lambda: _printed_correction(lambda g: g | {"var_z": 0.25**2}).x,
                    "This squares 0.25. The page prints it as Sigma_z: it is a variance already.",
                    id="corrected-56ad3c",
                ),
                Mistake(
                    lambda: _printed_correction(lambda g: g | {"prior_cov_xv": 0.0}).x,
                    "The velocity is not corrected at all: use the whole covariance, its off-diagonal entry carries the news.",
                ),
                Mistake(
                    lambda: 2 * np.array([12.5, 5.0]) - _printed_correction().x,
                    "This corrects away from the measurement.",
                    id="corrected-7b2ede",
                ),
                Mistake(
                    lambda: np.array([12.5, 5.0]) + np.array([0.886, 0.116]) * (12.5 - 11.79),
                    "This corrects away from the measurement.",
                    id="corrected-away-rounded",
                ),
                Mistake(
                    lambda: _printed_correction(lambda g: g | {"var_z": 0.5}).x,
                    "This takes the root of 0.25. A variance goes in as it is.",
                    id="corrected-279f26",
                ),
                Mistake(
                    lambda: _printed_correction(lambda g: g | {"prior_x": 12.75, "prior_v": 5.1}).x,
                    "This is the correction of (12.75, 5.10). The page prints the prediction (12.5, 5.0): start from it.",
                ),
                Mistake(
                    lambda: _each_by_its_own_variance(**lecture.example("vehicle")),
                    "You divide each variance by itself plus 0.25. The velocity is not measured: its gain is the covariance 0.2550 by S = 1.9469 + 0.25.",
                ),
                Mistake(lambda: np.array([12.5, 5.0]), "This is the prediction: the correction is missing."),
                Mistake(
                    lambda: np.array([11.79, 5.0]),
                    "This is the measurement itself. The filter believes only a part of it.",
                    id="corrected-886caa",
                ),
                Mistake(
                    lambda: _printed_correction().x - [12.5, 5.0],
                    "This is the correction alone: add it to the prediction.",
                ),
                Mistake(
                    lambda: (
                        _printed_correction(
                            lambda g: g | {"prior_cov_xx": 0.2216, "prior_cov_xv": 0.0290, "prior_cov_vv": 0.0620}
                        ).x
                    ),
                    "This comes out with the covariance after the correction. The gain comes from the one before, prior_cov.",
                    id="corrected-0bd9ba",
                ),
                Mistake(
                    lambda: _printed_correction(lambda g: g | {"var_z": 0.0}).x,
                    "The sensor's variance 0.25 is missing: your filter believes the measurement entirely.",
                ),
                *(
                    Mistake(
                        lambda further=further: _printed_correction(lambda g: g | {"prior_x": 13.0} | further).x,
                        "You predict once more before you correct. The printed state is the prediction already.",
                    )
                    for further in ({}, ONE_STEP_MORE, ONE_STEP_MORE | {"prior_v": 5.1})
                ),
            ],
        ),
        Exercise(
            "wrap_angle",
            reference=wrap_angle,
            draw=(*each_way(turned_too_far, "sign", "gathered"), within_half_a_turn),
            metric=metrics.Numbers(1e-9, "rad"),
            noisy=(
                (
                    turned_often,
                    metrics.Numbers(1e-9, "rad"),
                    "right for a few turns, but not for an angle that has gathered dozens of them:",
                ),
                (
                    functools.partial(turned_often, turns=(2000, 4000)),
                    metrics.Numbers(1e-9, "rad"),
                    "right for dozens of turns, but not for an angle that has gathered thousands of them:",
                ),
                *(
                    (
                        functools.partial(hardly_turned, size=size),
                        metrics.Numbers(1e-9, "rad"),
                        f"right, but not for an angle {words}, which stays as it is:",
                    )
                    for size, words in ((1e-4, "next to zero"), (0.0, "of zero"))
                ),
                *(
                    (
                        draw,
                        metrics.Numbers(1e-9, "rad"),
                        "right, but not close to half a turn, a few thousandths of a radian inside or outside:",
                    )
                    for draw in each_way(about_half_a_turn, "sign", "beyond")
                ),
                *(
                    (
                        functools.partial(half_a_turn, sign=sign),
                        metrics.UpToSign(1e-9, "rad"),
                        "right, but not at exactly half a turn, pi or -pi, either of which is right for both:",
                    )
                    for sign in (1, -1)
                ),
            ),
            draws=12,
            hints=(
                "An angle and the same angle plus a full turn are one direction. Choose the one nearest to zero.",
                "Shift by pi, take the remainder of a full turn, shift back.",
                "`return (angle + np.pi) % (2 * np.pi) - np.pi`",
            ),
            mistakes=[
                Mistake(
                    lambda a: a % (2 * np.pi),
                    "Your angles lie between 0 and 2 pi. An error of -0.1 becomes 6.18: shift by pi before and after.",
                ),
                Mistake(
                    lambda a: a - 2 * np.pi * np.sign(a) * (abs(a) > np.pi),
                    "You take off one turn. An angle that has gathered several keeps the others: take the remainder of a full turn.",
                ),
                Mistake(
                    lambda a: np.fmod(a + np.pi, 2 * np.pi) - np.pi,
                    "An angle below -pi ends below -pi: np.fmod, np.trunc and int() cut off toward zero. The operator `%` does not.",
                    id="wrap_angle-97beb8",
                ),
                Mistake(
                    lambda a: np.fmod(a, 2 * np.pi),
                    "Whole turns are gone, but up to a full turn on either side is left: shift by pi before and after, and use `%`.",
                ),
                Mistake(
                    lambda a: a % np.pi,
                    "Half turns are lost: your angles lie between 0 and pi, as if 2.5 and 2.5 + pi were one direction. Only full turns, 2 pi, may be taken off.",
                ),
                Mistake(
                    lambda a: (a + np.pi) % np.pi - np.pi,
                    "Half turns are lost: your angles lie between -pi and 0. The remainder is to be taken of a full turn, 2 pi.",
                ),
                Mistake(
                    lambda a: np.clip(a, -np.pi, np.pi),
                    "You cut the angle off at pi. A turn too many has to be subtracted.",
                ),
                Mistake(
                    lambda a: (a + np.pi) % (2 * np.pi),
                    "Your angles lie between 0 and 2 pi, each the right one plus pi: is the second shift missing? Subtract pi.",
                    id="wrap_angle-8d9df2",
                ),
                Mistake(
                    lambda a: (a + 180) % 360 - 180,
                    "Your angles come back as they were: no turn is taken off. The remainder `%` is taken of (angle + pi), in brackets, and of 2 pi: radians, not degrees.",
                    id="wrap_angle-9eb29d",
                ),
                Mistake(
                    lambda a: a % (2 * np.pi) - np.pi,
                    "Yours points backward: it is off by pi, as where pi is not added before the remainder.",
                    id="wrap_angle-c921e6",
                ),
                Mistake(
                    lambda a: (a - np.pi) % (2 * np.pi) + np.pi,
                    "The second shift has the wrong sign: your angles lie between pi and 3 pi. Subtract pi again.",
                ),
                Mistake(
                    lambda a: a - np.pi * np.round(a / np.pi),
                    "Take off full turns, 2 pi. Half a turn more or less points backward.",
                ),
                Mistake(
                    lambda a: np.arctan2(np.cos(a), np.sin(a)),
                    "This is pi/2 less the angle, as where np.arctan2 gets the cosine first: it takes the sine first.",
                    id="wrap_angle-fca799",
                ),
                Mistake(
                    lambda a: np.arcsin(np.sin(a)),
                    "Your angles stay within a quarter turn, as if mirrored: the sine alone cannot tell ahead from behind, np.arctan2(sin, cos) can.",
                    id="wrap_angle-2e5f67",
                ),
                Mistake(
                    lambda a: np.arccos(np.cos(a)),
                    "Your angle has lost its sign: neither an absolute value nor the cosine alone can tell left from right, np.arctan2(sin, cos) can.",
                    id="wrap_angle-a605d2",
                ),
                Mistake(
                    lambda a: wrapped(a) if a > 0 else a,
                    "Right for positive angles. Negative ones below -pi have to be turned up as well.",
                ),
                Mistake(
                    lambda a: a - 2 * np.pi if a > np.pi else a,
                    "You take off one turn, and only from positive angles: take the remainder of a full turn.",
                ),
                Mistake(
                    lambda a: (a + np.pi) % 2 * np.pi - np.pi,
                    "Brackets are missing: % (2 * np.pi). Without them Python takes the remainder of 2, then multiplies by pi.",
                ),
            ],
        ),
        Exercise(
            "measurement",
            reference=measurement,
            sizes=("landmark",),
            draw=(*each_way(landmark_aside, "side", "turned"), turned_several_times),
            fixed={"x": POSE, "landmark": LANDMARK},
            draws=12,
            metric=metrics.Numbers(1e-9),
            noisy=[
                *along_the_axes(metrics.Numbers(1e-9)),
                *near_and_far(metrics.Numbers(1e-9)),
                (landmark_ahead, metrics.Numbers(1e-9), "right, but not where the robot looks nearly at the landmark:"),
                *(
                    (
                        functools.partial(landmark_behind, side=side),
                        metrics.Numbers(1e-9),
                        "right, but not where the landmark stands nearly behind the robot:",
                    )
                    for side in (1, -1)
                ),
                (seen_from_whole_numbers, metrics.Numbers(1e-9), OF_INTEGERS),
            ],
            hints=(
                "How far away is the landmark, and in which direction seen from where the robot looks?",
                "d = sqrt(dx^2 + dy^2), alpha = atan2(dy, dx) - theta, with (dx, dy) from robot to landmark.",
                "`dx, dy = landmark - x[:2]\n"
                "return np.array([np.hypot(dx, dy), wrap_angle(np.arctan2(dy, dx) - x[2])])`",
            ),
            mistakes=[
                Mistake(
                    lambda x, l: measurement(x, l) * [1, 0] + [0, np.arctan2(*(l - x[:2])[::-1])],
                    "This is the bearing in the hall. The robot sees it relative to its own heading: subtract theta.",
                ),
                Mistake(
                    lambda x, l: measurement(x, l) * [1, 0] + [0, np.arctan2(*(l - x[:2])[::-1]) - x[2]],
                    "Distance and bearing are right, but the bearing can lie outside [-pi, pi): wrap it.",
                    id="measurement-3b3222",
                ),
                Mistake(
                    lambda x, l: np.array([measurement(x, l)[0], wrapped(np.arctan2(*(x[:2] - l)[::-1]) - x[2])]),
                    "Your bearing is the opposite one, as from the landmark to the robot. It is to lead from the robot to the landmark, by dx, dy = landmark - x[:2].",
                    id="measurement-aa4934",
                ),
                Mistake(
                    lambda x, l: np.array([measurement(x, l)[0], np.arctan2(*(x[:2] - l)[::-1]) - x[2]]),
                    "Your bearing is the opposite one, as from the landmark to the robot. It is to lead from the robot to the landmark, by dx, dy = landmark - x[:2].",
                    id="measurement-aa4934-2",
                ),
                Mistake(
                    lambda x, l: np.array([measurement(x, l)[0], wrapped(np.arctan2(*(l - x[:2])) - x[2])]),
                    "Your direction is counted from the y axis: np.arctan2 takes y first, then x.",
                    id="measurement-f28213",
                ),
                Mistake(
                    lambda x, l: measurement(x, l) * [1, 0] + [0, _turned_once(np.arctan2(*(l - x[:2])[::-1]) - x[2])],
                    "Right within one full turn. A heading that has gathered several keeps the others: take the remainder, as wrap_angle does.",
                ),
                Mistake(
                    lambda x, l: wrapped(measurement(x, l)),
                    "You wrapped both numbers. Only the bearing is an angle: a distance of 5 m stays 5 m.",
                ),
                Mistake(
                    lambda x, l: measurement(x, l) % [np.inf, 2 * np.pi],
                    "Your bearing lies between 0 and 2 pi: a landmark just to the right would be seen at 6.2. Wrap it to [-pi, pi).",
                ),
                Mistake(
                    lambda x, l: np.array([measurement(x, l)[0], wrapped(np.arctan2(*(l - x[:2])[::-1]) + x[2])]),
                    "The heading has the wrong sign: what turns with the robot is subtracted.",
                ),
                Mistake(
                    lambda x, l: np.array([measurement(x, l)[0], np.arctan(np.divide(*(l - x[:2])[::-1])) - x[2]]),
                    "The arctangent of dy / dx is the same for (dx, dy) and (-dx, -dy): np.arctan2(dy, dx) tells them apart. And the bearing has to be wrapped.",
                    id="measurement-62b89b",
                ),
                *(
                    Mistake(
                        _bearing_by_arccos(wrap),
                        "You see a landmark at dy and one at -dy in the same direction: an arccosine or an absolute value knows no sign. "
                        "np.arctan2(dy, dx) tells them apart.",
                        id=f"measurement-arccos-{name}",
                    )
                    for name, wrap in (("wrapped", wrapped), ("plain", float))
                ),
                Mistake(lambda x, l: measurement(x, l)[::-1], "The order is distance, bearing."),
                Mistake(
                    lambda x, l: measurement(x, l) * [measurement(x, l)[0], 1],
                    "The distance is squared: the root is missing.",
                ),
                Mistake(
                    lambda x, l: np.array(
                        [measurement(x, l)[0], wrapped(np.arctan(np.divide(*(l - x[:2])[::-1])) - x[2])]
                    ),
                    "The arctangent of dy / dx is the same for (dx, dy) and (-dx, -dy): np.arctan2(dy, dx) tells them apart.",
                    id="measurement-baf232",
                ),
                Mistake(
                    lambda x, l: measurement(x, l) * [1, -1],
                    "The bearing has the wrong sign: direction to the landmark minus heading; the left is positive.",
                ),
                Mistake(
                    lambda x, l: np.array([measurement(x, l)[0], x[2] - np.arctan2(*(l - x[:2])[::-1])]),
                    "The bearing has the wrong sign, and it is not wrapped: direction to the landmark minus heading.",
                ),
                Mistake(
                    lambda x, l: measurement(x, l) * [1, np.degrees(1)],
                    "The bearing is in degrees: leave it in radians.",
                ),
                Mistake(
                    lambda x, l: np.array([measurement(x, l)[0], np.arctan2(*(l - x[:2])) - x[2]]),
                    "Your direction is counted from the y axis: np.arctan2 takes y first, then x. And the bearing has to be wrapped.",
                    id="measurement-dc8471",
                ),
                Mistake(
                    lambda x, l: np.array(
                        [measurement(x, l)[0], np.arcsin((l - x[:2])[1] / measurement(x, l)[0]) - x[2]]
                    ),
                    "The arcsine cannot tell ahead from behind, in x: np.arctan2(dy, dx) can. And the bearing has to be wrapped.",
                ),
                Mistake(
                    lambda x, l: measurement(x, l) + [0, np.pi],
                    "Your bearing is the right one plus pi: does it point backward, or is the second shift of the wrap missing? Subtract pi.",
                    id="measurement-277f22",
                ),
                Mistake(
                    lambda x, l: np.array([measurement(x, l)[0], abs(measurement(x, l)[1])]),
                    "Your bearings are never negative, but a landmark on the right has a negative one: an absolute value or an arccosine cannot tell left from right.",
                ),
                Mistake(
                    lambda x, l: np.array([measurement(x, l)[0], np.arcsin(np.sin(measurement(x, l)[1]))]),
                    "Your bearings stay within a quarter turn: an arcsine cannot tell ahead from behind. np.arctan2(left, ahead) can, or np.arctan2(dy, dx) minus heading.",
                ),
                Mistake(
                    lambda x, l: np.array([measurement(x, l)[0], np.arctan(np.tan(measurement(x, l)[1]))]),
                    "Your bearings stay within a quarter turn: the arctangent of a quotient takes what is behind for what is ahead. np.arctan2(left, ahead) does not, nor np.arctan2(dy, dx) minus heading.",
                ),
                Mistake(
                    lambda x, l: np.array([np.abs(l - x[:2]).sum(), measurement(x, l)[1]]),
                    "The bearing is right. The distance is the root of dx^2 + dy^2.",
                ),
                Mistake(
                    lambda x, l: np.array([np.hypot(*l), wrapped(np.arctan2(l[1], l[0]) - x[2])]),
                    "The robot's position is missing: dx and dy lead from the robot to the landmark.",
                ),
            ],
        ),
        Exercise(
            "measurement_jacobian",
            reference=measurement_jacobian,
            sizes=("landmark",),
            draw=seen_landmark,
            fixed={"x": POSE, "landmark": LANDMARK},
            metric=metrics.Numbers(1e-5),
            noisy=[
                (
                    functools.partial(landmark_behind, side=side),
                    metrics.Numbers(1e-5),
                    "right, but not where the landmark stands nearly behind the robot: a difference of two bearings is to be wrapped:",
                )
                for side in (1, -1, 0)
            ]
            + [
                (
                    functools.partial(landmark_seen_at, bearing=bearing),
                    metrics.Numbers(1e-5),
                    "right, but not where the landmark stands exactly ahead or abeam of the robot:",
                )
                for bearing in (0, np.pi / 2, -np.pi / 2)
            ]
            + along_the_axes(metrics.Numbers(1e-5))
            + near_and_far(metrics.Numbers(1e-5))
            + [(seen_from_whole_numbers, metrics.Numbers(1e-5), OF_INTEGERS)],
            hints=(
                "Move the robot a little toward the landmark, then across, then turn it. What do distance and bearing do?",
                "Row 0: (-dx/r, -dy/r, 0). Row 1: (dy/q, -dx/q, -1) with q = r^2. Compute dx, dy, q and r first, then write both rows as one array.",
                "`dx, dy = landmark - x[:2]\n"
                "q = dx**2 + dy**2\n"
                "r = np.sqrt(q)\n"
                "return np.array([[-dx / r, -dy / r, 0], [dy / q, -dx / q, -1]])`",
            ),
            mistakes=[
                Mistake(
                    _in_the_robots_frame,
                    "Your first two columns are the derivatives along the robot's own axes. x and y are those of the map: dx, dy = landmark - x[:2].",
                ),
                Mistake(
                    lambda x, l: -measurement_jacobian(x, l) * (1, 1, 0),
                    "These are the derivatives by the place of the landmark, and by no heading. The robot moves: signs turn, and the last entry is -1.",
                ),
                Mistake(
                    _rows(lambda dx, dy, r: [[dx / r, dy / r, 0], [-dy / r**2, dx / r**2, -1]]),
                    "These are the derivatives by the landmark's position. By the robot's they have the opposite sign.",
                ),
                Mistake(
                    _rows(lambda dx, dy, r: [[-dx / r, -dy / r, 0], [dy / r, -dx / r, -1]]),
                    "In the bearing's row dx and dy are divided by r squared, not by r: a shift across turns it by the shift over r, and dx over r is but the direction.",
                    id="measurement_jacobian-8ef0d0",
                ),
                Mistake(
                    _rows(lambda dx, dy, r: [[-dx / r, -dy / r, 0], [dy / r**2, -dx / r**2, 1]]),
                    "When the robot turns left the landmark moves to the right: the last entry is -1.",
                ),
                Mistake(
                    _rows(lambda dx, dy, r: [[-dx / r, -dy / r, 0], [dy / r**2, -dx / r**2, 0]]),
                    "The bearing also depends on the heading.",
                ),
                Mistake(
                    _rows(lambda dx, dy, r: [[-dx / r, -dy / r, 0], [-dx / r**2, dy / r**2, -1]]),
                    "In row 1 the first two entries have changed places: only a shift across the line of sight turns it.",
                    id="measurement_jacobian-ddcb05",
                ),
                Mistake(
                    _rows(lambda dx, dy, r: [[dx / r, dy / r, 0], [dy / r**2, -dx / r**2, -1]]),
                    "The sign of row 0: a step toward the landmark makes the distance smaller.",
                ),
                Mistake(
                    _rows(lambda dx, dy, r: [[-dx / r, -dy / r, 0], [-dy / r**2, dx / r**2, -1]]),
                    "The signs of dx and dy in row 1: a step to the left turns the landmark to the right.",
                ),
                Mistake(
                    _rows(lambda dx, dy, r: [[-dx / r**2, -dy / r**2, 0], [dy / r**2, -dx / r**2, -1]]),
                    "Row 0 is divided by r, not by r squared: a step straight toward the landmark shortens the distance by just this step.",
                ),
                Mistake(
                    _rows(lambda dx, dy, r: [[-dx, -dy, 0], [dy, -dx, -1]]),
                    "The divisions are missing: row 0 by r, row 1 by r squared.",
                ),
                Mistake(
                    _rows(lambda dx, dy, r: [[-2 * dx, -2 * dy, 0], [dy / r**2, -dx / r**2, -1]]),
                    "Row 0 is the derivative of the squared distance. That of the distance is -dx / r, -dy / r.",
                ),
                Mistake(
                    _rows(lambda dx, dy, r: [[-dx / r / 2, -dy / r / 2, 0], [dy / r**2, -dx / r**2, -1]]),
                    "The derivative of the root has a factor 1/2, that of the square a factor 2: they cancel in row 0.",
                ),
                Mistake(
                    _rows(lambda dx, dy, r: [[-2 * dx / r, -2 * dy / r, 0], [dy / r**2, -dx / r**2, -1]]),
                    "The derivative of the root has a factor 1/2, that of the square a factor 2: they cancel in row 0.",
                ),
                Mistake(
                    lambda x, l: np.array([[-np.cos(x[2]), -np.sin(x[2]), 0], [np.sin(x[2]), -np.cos(x[2]), -1]]),
                    "The heading is not the direction to the landmark, and a far landmark turns less than a near one: take dx, dy and r.",
                ),
                Mistake(
                    lambda x, l: measurement_jacobian(x, l)[::-1],
                    "The order is distance, bearing: your rows are exchanged.",
                ),
                Mistake(
                    lambda x, l: measurement_jacobian(x, l)[:, :2],
                    "The column of the heading is missing: distance and bearing by theta are 0 and -1.",
                ),
                Mistake(
                    _rows(lambda dx, dy, r: [[-dx / r, -dy / r, 0], [dy / r**2, dx / r**2, -1]]),
                    "A sign in row 1: -dx / r^2 in the column of y.",
                ),
                Mistake(
                    _rows(lambda dx, dy, r: [[-dx / r, -dy / r, 0], [-dy / r**2, -dx / r**2, -1]]),
                    "A sign in row 1: plus dy / r^2 in the column of x.",
                ),
                Mistake(
                    _rows(lambda dx, dy, r: [[dx / r, dy / r, 0], [-dy / r**2, dx / r**2, 1]]),
                    "All signs are turned around: these are the derivatives of minus the measurement.",
                ),
                Mistake(
                    _rows(lambda dx, dy, r: [[-dy / r, -dx / r, 0], [dy / r**2, -dx / r**2, -1]]),
                    "In row 0 dx and dy are exchanged.",
                ),
                Mistake(
                    _rows(lambda dx, dy, r: [[-dx / r, -dy / r, 0], [dx / r**2, -dy / r**2, -1]]),
                    "In row 1 dx and dy are exchanged: only a shift across the line of sight turns it.",
                ),
                Mistake(
                    lambda x, l: measurement_jacobian(x, l) * [[1], [np.degrees(1)]],
                    "Row 1 is in degrees: angles are radians here.",
                ),
                Mistake(
                    _rows(lambda dx, dy, r: [[-dx / r, -dy / r, -1], [dy / r**2, -dx / r**2, -1]]),
                    "The distance does not depend on the heading: the last entry of row 0 is 0.",
                ),
            ],
        ),
        Exercise(
            "motion_jacobians",
            reference=motion_jacobians,
            sizes=("u", "dt"),
            draw=each_way(pose_control_step, "ahead"),
            fixed={"x": POSE, "u": CONTROL},
            metric=JACOBIANS,
            noisy=tuple(
                (
                    functools.partial(special_control, moves=moves),
                    JACOBIANS,
                    f"right in curves, but not where the robot {does}:",
                )
                for moves, does in (
                    ((0, 1), "turns on the spot, v = 0"),
                    ((1, 0), "drives straight on, omega = 0"),
                    ((0, 0), "rests, u = (0, 0)"),
                )
            )
            + (
                (control_at_whole_numbers, JACOBIANS, OF_INTEGERS),
                (
                    pose_exactly_backward,
                    JACOBIANS,
                    "right, but not where the robot looks exactly backward, theta = pi or -pi, and drives straight on (a "
                    "difference of two headings is to be wrapped):",
                ),
                (
                    fast_control,
                    JACOBIANS,
                    "right, but not for a heading that has gathered turns, a fast control and a time step of seconds:",
                ),
            ),
            hints=(
                "They are F_x and F_u of chapter 7 under another letter.",
                "G_x is the identity with -v T sin(theta) and v T cos(theta) in the last column; G_u has T cos, T sin and T.",
                "`c, s, d = np.cos(x[2]), np.sin(x[2]), u[0] * dt\n"
                "return np.array([[1, 0, -d * s], [0, 1, d * c], [0, 0, 1]]), dt * np.array([[c, 0], [s, 0], [0, 1]])`",
            ),
            mistakes=[
                Mistake(_jacobians(_sine_sign), "In G_x, the derivative of the cosine is minus the sine."),
                Mistake(
                    _jacobians(lambda G, x, u, t: G - np.eye(3)),
                    "In G_x the identity is missing: the old pose is part of the new one.",
                ),
                Mistake(_jacobians(change_u=lambda G, x, u, t: G / t), "In G_u the time step is missing."),
                Mistake(
                    _jacobians(change_u=lambda G, x, u, t: G * u),
                    "In G_u, v and omega must not appear: the step is linear in both.",
                ),
                Mistake(
                    _jacobians(change_u=lambda G, x, u, t: G * [[1], [1], [0]]),
                    "In G_u the last row is zero, but omega turns the robot: theta' = theta + omega T.",
                ),
                Mistake(lambda x, u, t: motion_jacobians(x, u, t)[::-1], "The order is G_x, G_u."),
                Mistake(
                    lambda x, u, t: odometry.step_jacobians(x, u, t, "midpoint"),
                    "These are the midpoint model's. The lecture's filter moves along the old heading.",
                ),
                Mistake(
                    _jacobians(lambda G, x, u, t: G * [[1, 1, 1], [1, 1, -1], [1, 1, 1]]),
                    "In G_x, the derivative of the sine is plus the cosine: a sign in row 1.",
                ),
                Mistake(
                    _jacobians(_last_column(lambda x, u, t: (-u[0] * np.sin(x[2]), u[0] * np.cos(x[2])))),
                    "In G_x the time step is missing: the way is v T.",
                ),
                Mistake(
                    _jacobians(_last_column(lambda x, u, t: (-np.sin(x[2]), np.cos(x[2])))),
                    "In G_x the way is missing, speed and time step: -v T sin(theta), v T cos(theta).",
                ),
                Mistake(
                    _jacobians(_last_column(lambda x, u, t: (-t * np.sin(x[2]), t * np.cos(x[2])))),
                    "In G_x the speed is missing: the way is v T.",
                ),
                Mistake(
                    _jacobians(lambda G, x, u, t: G * [[1, 1, -1], [1, 1, -1], [1, 1, 1]]),
                    "In G_x both signs of the last column are turned: -v T sin(theta) and +v T cos(theta).",
                ),
                Mistake(
                    _jacobians(
                        _last_column(lambda x, u, t: (-u[0] * np.sin(x[2]), u[0] * np.cos(x[2]))),
                        lambda G, x, u, t: G / t,
                    ),
                    "The time step is missing from both.",
                ),
                Mistake(
                    _jacobians(_last_column(lambda x, u, t: (-u[0] * t * np.cos(x[2]), u[0] * t * np.sin(x[2])))),
                    "In G_x, sine and cosine are exchanged.",
                ),
                Mistake(
                    _jacobians(_last_column(lambda x, u, t: (u[0] * t * np.cos(x[2]), u[0] * t * np.sin(x[2])))),
                    "In G_x you put in the step itself. It holds the derivative of the step by theta.",
                ),
                Mistake(
                    _jacobians(_last_column(lambda x, u, t: (-u[1] * t * np.sin(x[2]), u[1] * t * np.cos(x[2])))),
                    "In G_x you took omega for the speed: v is u[0].",
                ),
                Mistake(
                    _jacobians(lambda G, x, u, t: G + np.diag([0, 0, u[1] * t])),
                    "In G_x, omega T does not depend on theta: the last entry is 1.",
                ),
                Mistake(
                    _jacobians(change_u=lambda G, x, u, t: G / [[1, 1], [1, 1], [1, t]]),
                    "In G_u the last entry is T: omega acts for a time step.",
                ),
                Mistake(
                    _jacobians(change_u=lambda G, x, u, t: G / [[t, 1], [t, 1], [1, 1]]),
                    "In G_u the time step is missing from the first column.",
                ),
                Mistake(_jacobians(change_u=lambda G, x, u, t: G[[1, 0, 2]]), "In G_u, sine and cosine are exchanged."),
                Mistake(
                    _jacobians(change_u=lambda G, x, u, t: G[:, ::-1]),
                    "In G_u the columns are exchanged: first v, then omega.",
                ),
                Mistake(
                    _jacobians(change_u=lambda G, x, u, t: G * [u[0], 1]),
                    "In G_u, v must not appear: the step is linear in it.",
                ),
                Mistake(
                    _jacobians(change_u=lambda G, x, u, t: G * [1, u[1]]),
                    "In G_u, omega must not appear: the step is linear in it.",
                ),
                Mistake(
                    lambda x, u, t: motion_jacobians(odometry.step(x, u, t, "euler"), u, t),
                    "You put in the new heading. The simplified model drives along the old one.",
                ),
                Mistake(
                    lambda x, u, t: odometry.step_jacobians(x, u, t, "arc"),
                    "These are the exact arc's. The lecture's filter moves along the old heading.",
                ),
            ],
        ),
        Exercise(
            "ekf_step",
            reference=ekf_step,
            sizes=("cov", "cov_u", "cov_z"),
            draw=(
                filter_step,
                functools.partial(filter_step, ahead=-1, side=-1),
                functools.partial(filter_step, astray=5.0),
                functools.partial(filter_step, seam=False),
                functools.partial(filter_step, seam=False, side=-1),
            ),
            fixed={
                "x": POSE,
                "cov": POSE,
                "u": CONTROL,
                "cov_u": CONTROL,
                "z": READING,
                "landmark": LANDMARK,
                "cov_z": READING,
            },
            metric=POSE_AND_COV,
            noisy=tuple(
                (functools.partial(filter_step, **special), POSE_AND_COV, f"right, but not {words}:")
                for special, words in (
                    ({"moves": (0, 0)}, "where the robot rests, u = (0, 0): what is uncertain of the control stays so"),
                    ({"moves": (1, 0), "seam": False}, "where the robot drives straight on, omega = 0"),
                    ({"moves": (0, 1), "seam": False, "side": -1}, "where the robot turns on the spot, v = 0"),
                    (
                        {"turns": -3, "moves": (0.03, 0.03)},
                        "for a slow control and a heading that has gathered several turns",
                    ),
                    (
                        {"within": (0.8, 1.2), "seam": False, "turned": (1.0, 1.4)},
                        "for a landmark a meter away and a bearing that is off by a radian",
                    ),
                    *(
                        (
                            {"seam": False, "side": side, "turned": (1.8, 2.6)},
                            "for a bearing that is off by more than a quarter turn: wrapping takes off whole turns alone",
                        )
                        for side in (1, -1)
                    ),
                    (
                        {"seam": False, "turned": (3.05, 3.1)},
                        "for a bearing that is off by nearly half a turn: however far, no measurement is left out here",
                    ),
                    (
                        {"seam": False, "astray": 1e4},
                        "for a distance that is off by kilometers: however far, no measurement is left out here",
                    ),
                    (
                        {"seam": False, "astray": 0.0, "turned": (0.0, 0.0)},
                        "where just what was expected is measured: the covariance shrinks all the same",
                    ),
                    ({"seam": False, "carried_out": True}, "where the control is carried out exactly, cov_u = 0"),
                    ({"within": (60, 90), "sure": 30.0}, "for a landmark 60 m away and uncertainties that are large"),
                )
            ),
            hints=(
                "The pose takes the motion model itself, only its covariance takes G_x and G_u. Then correct: the innovation takes the measurement itself, gain and covariance take H in place of C.",
                "Jacobians at the old pose; the pose by `odometry.step(x, u, dt, 'euler')`, its covariance by both Jacobians. Then, at the predicted pose, H and the expected measurement; the innovation, its bearing wrapped; gain and correction as in `update`.",
                "`G_x, G_u = motion_jacobians(x, u, dt)\n"
                "x = odometry.step(x, u, dt, 'euler')\n"
                "cov = G_x @ cov @ G_x.T + G_u @ cov_u @ G_u.T\n"
                "H = measurement_jacobian(x, landmark)\n"
                "y = z - measurement(x, landmark)\n"
                "y[1] = wrap_angle(y[1])\n"
                "K = cov @ H.T @ np.linalg.inv(H @ cov @ H.T + cov_z)\n"
                "return x + K @ y, (np.eye(3) - K @ H) @ cov`",
            ),
            mistakes=[
                Mistake(
                    _ekf_by_the_slope,
                    "Your innovation is z - H x. The sensor measures by the bent function: z - measurement(x, landmark). H is only its slope.",
                ),
                Mistake(
                    _sum_wrapped,
                    "The bearing is wrapped after H x is added to it. What is an angle is the difference of measured and expected bearing: wrap that, before anything is added.",
                    id="ekf-sum-wrapped",
                ),
                Mistake(
                    _ekf_in_degrees,
                    "Your innovation mixes degrees and radians: `measurement` gives the bearing in radians already.",
                ),
                Mistake(
                    _ekf(wrap=float),
                    "The bearing innovation is not wrapped: a measurement just across +-pi is taken for a surprise of a full turn.",
                    id="ekf_step-9e7c1b",
                ),
                Mistake(
                    _ekf(wrap=lambda angle: angle % (2 * np.pi)),
                    "Your bearing innovation lies between 0 and 2 pi: a hundredth to the right becomes 6.27. Wrap it to [-pi, pi).",
                ),
                Mistake(
                    _ekf(wrap=lambda angle: abs(wrapped(angle))),
                    "Your bearing innovation has lost its sign, by an absolute value or an arccosine: a landmark seen farther right counts as if farther left.",
                ),
                Mistake(
                    _through_the_linear_filter(True, False),
                    "The pose is moved as G_x x + G_u u: a straight line through a bent model. The pose takes the motion itself, only its covariance takes the Jacobians.",
                ),
                Mistake(
                    _through_the_linear_filter(False, True),
                    "You expect H x, as in the linear filter, and the bearing is not wrapped. The expected measurement is `measurement(x, landmark)`; H belongs into gain and covariance.",
                ),
                Mistake(
                    _through_the_linear_filter(True, True),
                    "This is the linear filter with Jacobians for its matrices. The pose takes the motion itself, the innovation the measurement itself; Jacobians move covariances only.",
                ),
                Mistake(
                    _all_wrapped,
                    "You wrapped the whole innovation. Only the bearing is an angle: a distance that is 5 m off stays 5 m off.",
                ),
                Mistake(_ekf(noise=False), "The control's noise G_u cov_u G_u^T is missing from the prediction."),
                Mistake(
                    _ekf(at="old", H_at="old"),
                    "Expected measurement and H belong to the predicted pose; you used the old one.",
                ),
                Mistake(
                    _ekf(H_at="old"),
                    "Your H is taken at the old pose. The sensor measures after the motion: H belongs to the predicted pose.",
                ),
                Mistake(
                    _ekf(at="old"), "The expected measurement is that of the predicted pose; you used the old one."
                ),
                Mistake(
                    _ekf(G_at="predicted"),
                    "Your G_x and G_u are taken at the new pose. The motion starts at the old one, and is linearized there.",
                ),
                Mistake(
                    lambda x, *given: (
                        ekf_step(x, *given)[0] - _ekf(short=True)(x, *given)[0] + x,
                        ekf_step(x, *given)[1],
                    ),
                    "You add the correction to the old pose: it belongs to the predicted one.",
                ),
                Mistake(
                    lambda x, cov, u, dt, *given: (
                        odometry.step(x, u, dt, "midpoint")
                        - odometry.step(x, u, dt, "euler")
                        + ekf_step(x, cov, u, dt, *given)[0],
                        ekf_step(x, cov, u, dt, *given)[1],
                    ),
                    "The pose takes the midpoint step before the correction, the Jacobians are those of the simplified model.",
                ),
                Mistake(
                    lambda x, cov, *given: (ekf_step(x, cov, *given)[0], _old_cov_corrected(x, cov, *given)),
                    "The pose is right. (I - K H) is to be applied to the predicted covariance; you applied it to the old one.",
                ),
                Mistake(
                    _ekf(control=lambda cov_u, dt: np.eye(2)),
                    "The covariance of the control is missing between G_u and its transpose.",
                ),
                Mistake(
                    _ekf(control=lambda cov_u, dt: cov_u * dt),
                    "The time step stands in G_u already: G_u cov_u G_u^T as it is.",
                ),
                Mistake(
                    lambda x, cov, *given: (ekf_step(x, cov, *given)[0], _shrunk_at_the_end(x, cov, *given)),
                    "The pose is right. (I - K H) takes the H of the gain, at the predicted pose; yours is taken at the corrected one.",
                ),
                Mistake(_ekf(short=True), "You only predicted: the correction is missing."),
                Mistake(_ekf(carry=False), "The old covariance must be carried along: G_x cov G_x^T."),
                Mistake(
                    _ekf(gain=lambda P, H, R: P @ H.T @ np.linalg.inv(H @ P @ H.T)),
                    "The sensor's noise is missing from S.",
                ),
                Mistake(
                    lambda *given: (2 * _ekf(short=True)(*given)[0] - ekf_step(*given)[0], ekf_step(*given)[1]),
                    "You correct away from the measurement: the innovation is measured minus expected.",
                ),
                Mistake(
                    lambda *given: (ekf_step(*given)[0], _ekf(short=True)(*given)[1]),
                    "The pose is right. The covariance was predicted but not corrected: (I - K H) cov.",
                ),
                Mistake(
                    _ekf(gain=lambda P, H, R: P @ H.T @ np.linalg.inv(R)),
                    "S is the noise of the sensor plus the uncertainty of the expected measurement, H cov H^T.",
                ),
                Mistake(
                    _ekf(gain=lambda P, H, R: P @ H.T @ (H @ P @ H.T + R)),
                    "You multiplied by S. The gain divides by it: its inverse stands there.",
                ),
                Mistake(_ekf(gain=lambda P, H, R: P @ H.T), "The division by S is missing from the gain."),
                Mistake(
                    _ekf(gain=lambda P, H, R: P @ H.T @ np.linalg.inv(H @ P @ H.T + R @ R)),
                    "cov_z holds variances already: do not square it.",
                ),
                Mistake(
                    _ekf(shrink=lambda P, K, H: (np.eye(3) + K @ H) @ P),
                    "A sign: (I - K H) cov. Yours grows with every measurement.",
                ),
                Mistake(
                    _ekf(shrink=lambda P, K, H: (1 - K @ H) @ P),
                    "1 - K H subtracts from a matrix full of ones. The identity is np.eye(3).",
                ),
                Mistake(
                    _ekf(shrink=lambda P, K, H: P @ (np.eye(3) - K @ H)),
                    "The order: (I - K H) stands to the left of cov.",
                ),
                Mistake(
                    _ekf(shrink=lambda P, K, H: K @ H @ P),
                    "This is what is taken away. The new covariance is what is left: (I - K H) cov.",
                ),
                Mistake(
                    _ekf(model="midpoint"),
                    'The pose takes the midpoint step. This filter moves with the simplified model, "euler".',
                ),
                Mistake(
                    _ekf(model="arc"), 'The pose drives the arc. This filter moves with the simplified model, "euler".'
                ),
                Mistake(
                    lambda x, cov, u, dt, cov_u, *given: _ekf(noise=False, carry=False)(
                        x, cov, np.zeros(2), dt, cov_u, *given
                    ),
                    "You only corrected: the prediction, motion and growing covariance, is missing.",
                ),
                Mistake(
                    lambda x, cov, u, dt, cov_u, *given: _ekf(short=True)(
                        *_ekf(noise=False)(x, cov, np.zeros(2), dt, cov_u, *given), u, dt, cov_u, *given
                    ),
                    "You corrected first and moved then. The sensor measures after the motion: predict, then correct.",
                ),
                Mistake(
                    lambda *given: (ekf_step(*given)[0] - _ekf(short=True)(*given)[0], ekf_step(*given)[1]),
                    "You return the correction alone: add it to the predicted pose.",
                ),
                Mistake(lambda *given: ekf_step(*given)[::-1], "The order is pose, covariance."),
            ],
        ),
        Prediction(
            "wrapping",
            question="Two landmarks, a robot in circles, and a filter that forgets to wrap the bearing innovation. What happens when a bearing crosses from +180 to -180 deg?",
            choices=(
                "nothing, the filter averages it out",
                "the estimate is thrown off at once",
                "the filter becomes slowly less accurate",
            ),
            answer="the estimate is thrown off at once",
            why="An innovation of a few hundredths becomes one of 6.28 rad. The gain turns it into meters, and the covariance shrinks as if all were well.",
        ),
        Exercise(
            "nees",
            reference=nees,
            sizes=("cov",),
            draw=(
                *each_way(estimate_and_truth, "side"),
                functools.partial(estimate_and_truth, astray=50.0),
                functools.partial(estimate_and_truth, turns=2, sure=5.0),
                *(functools.partial(estimate_and_truth, side=side, turns=-1) for side in (1, -1)),
            ),
            draws=6,
            fixed={"truth": POSE, "x": POSE, "cov": POSE},
            metric=metrics.Numbers(1e-8),
            noisy=(
                *(
                    (
                        functools.partial(estimate_and_truth, side=side, turns=turns, turned=(1.8, 2.9)),
                        metrics.Numbers(1e-8),
                        "right, but not where the heading is off by more than a quarter turn: wrapping takes off whole turns alone:",
                    )
                    for side, turns in ((1, 0), (-1, 0), (1, -1))
                ),
                (estimate_without_error, metrics.Numbers(1e-8), "right, but not where the estimate is the truth:"),
                (
                    sharp_estimate,
                    metrics.Numbers(1e-8),
                    "right, but not for errors and uncertainties of millimeters, next to the origin of the map:",
                ),
            ),
            hints=(
                "Measure the error in units of the uncertainty the filter claims.",
                "e' cov^-1 e with e = truth - x, the heading wrapped.",
                "`e = truth - x\ne[2] = wrap_angle(e[2])\nreturn e @ np.linalg.solve(cov, e)`",
            ),
            mistakes=[
                Mistake(
                    lambda t, x, P: (t - x) @ np.linalg.solve(P, t - x),
                    "The heading error is not wrapped: 179 deg and -179 deg are nearly the same direction.",
                    id="nees-63cd65",
                ),
                Mistake(
                    _nees_of(lambda true, found: _turned_once(true - found)),
                    "Right within one full turn. A heading that has gathered several keeps the others: take the remainder, as wrap_angle does.",
                ),
                Mistake(
                    _nees_of(lambda true, found: abs(wrapped(true - found))),
                    "Your heading error has lost its sign, by an absolute value or an arccosine. The correlations need it.",
                ),
                Mistake(
                    _nees_of(lambda true, found: wrapped(true) - wrapped(found)),
                    "With each heading between -pi and pi, 179 deg and -179 deg are still 358 deg apart: wrap their difference.",
                    id="nees-786433",
                ),
                Mistake(
                    lambda t, x, P: float(wrapped(t - x) @ np.linalg.solve(P, wrapped(t - x))),
                    "You wrapped all three differences. Only the heading is an angle: a position that is 5 m off stays 5 m off.",
                ),
                Mistake(
                    lambda t, x, P: _error(t, x) @ np.linalg.solve(block_diag(P[:2, :2], P[2:, 2:]), _error(t, x)),
                    "What position and heading share is left out: cov[:2, 2] counts as well. Invert the whole matrix.",
                    id="nees-position-and-heading",
                ),
                Mistake(
                    lambda t, x, P: _error(t, x) @ P @ _error(t, x),
                    "You multiplied by the covariance. Divide by it: its inverse stands in the middle.",
                ),
                Mistake(
                    lambda t, x, P: np.sqrt(nees(t, x, P)),
                    "You took the root. The normalized error *squared* has the expectation 3.",
                ),
                Mistake(
                    lambda t, x, P: _error(t, x) @ _error(t, x),
                    "The covariance is missing: the error counts in units of what the filter promised.",
                ),
                Mistake(
                    lambda t, x, P: (_error(t, x) ** 2 / np.diag(P)).sum(),
                    "You left the correlations out: use the whole inverse, not only the diagonal.",
                ),
                Mistake(
                    lambda t, x, P: nees(t, x, P) / 3,
                    "You divided by the number of states. Then the expectation is 1; here it should be 3.",
                ),
                Mistake(
                    lambda t, x, P: _error(t, x)[:2] @ np.linalg.solve(P[:2, :2], _error(t, x)[:2]),
                    "The heading is missing: all three states count.",
                ),
                Mistake(
                    lambda t, x, P: (_error(t, x) / np.sqrt(np.diag(P))).sum(),
                    "The errors have to be squared before they are added: e' cov^-1 e.",
                ),
                Mistake(
                    lambda t, x, P: (_error(t, x) ** 2 / np.sqrt(np.diag(P))).sum(),
                    "Squares are divided by variances, and the correlations count as well: e' cov^-1 e.",
                ),
                Mistake(
                    lambda t, x, P: _error(t, x) * np.linalg.solve(P, _error(t, x)),
                    "The sum is missing: `e @ ...` multiplies and adds, `e * ...` only multiplies.",
                ),
                Mistake(
                    lambda t, x, P: _error(t, x) @ (1 / P) @ _error(t, x),
                    "`1 / cov` is one over each entry by itself. The inverse of a matrix is np.linalg.inv(cov).",
                    "nees-f848b8",
                ),
                Mistake(
                    lambda t, x, P: _error(t, x) @ _error(t, x) / np.linalg.det(P),
                    "A determinant does not weigh directions: the inverse stands between e' and e.",
                ),
                Mistake(
                    lambda t, x, P: _error(t, x) @ _error(t, x) / np.trace(P),
                    "The trace does not weigh directions: the inverse stands between e' and e.",
                ),
                Mistake(
                    lambda t, x, P: nees(t, x, P) ** 2, "Squared once too often: e' cov^-1 e is the square already."
                ),
                Mistake(
                    lambda t, x, P: nees(t, x, P) / 2,
                    "No half: that belongs to the exponent of the bell. The expectation is 3.",
                ),
                Mistake(
                    lambda t, x, P: ((t - x) ** 2 / np.diag(P)).sum(),
                    "Two slips: the heading error is not wrapped, and the correlations are left out.",
                ),
                Mistake(
                    lambda t, x, P: (t - x) @ P @ (t - x),
                    "Two slips: the heading error is not wrapped, and the covariance stands there instead of its inverse.",
                ),
            ],
        ),
        Prediction(
            "precise",
            question="A poorly known start, two landmarks. You replace the sensor by one ten times more precise. Is the filter's covariance more or less trustworthy?",
            choices=("more trustworthy", "equally", "less trustworthy"),
            answer="less trustworthy",
            why="The filter replaces a curved circle of positions by its tangent. The better the sensor, the thinner the tangent, and the farther the truth lies from it.",
        ),
        Exercise(
            "gate",
            reference=gate,
            sizes=("innovation", "cov_innovation", "limit"),
            draw=SURPRISES,
            metric=metrics.Exactly(),
            properties=(_limit_passes_not,),
            draws=40,
            hints=(
                "Is the surprise larger than the filter's own idea of how large surprises are?",
                "Compare y' S^-1 y with the limit.",
                "`return bool(innovation @ np.linalg.solve(cov_innovation, innovation) < limit)`",
            ),
            mistakes=[
                Mistake(lambda y, S, g: not gate(y, S, g), "Exactly the other way round: True means plausible."),
                Mistake(
                    _gated(lambda y, S: y @ y),
                    "You compare what has units, such as meters and radians, with a number that has none: divide by the covariance S.",
                    id="gate-1a49bc",
                ),
                Mistake(
                    _gated(lambda y, S: np.linalg.norm(y)),
                    "You compare what has units, such as meters and radians, with a number that has none: divide by the covariance S.",
                    id="gate-1a49bc-2",
                ),
                Mistake(
                    _gated(lambda y, S: y @ (1 / S) @ y),
                    "`1 / S` is one over each entry by itself. The inverse of a matrix is np.linalg.inv(S), or np.linalg.solve.",
                    "gate-4792aa",
                ),
                Mistake(
                    lambda y, S, g: gate(y, S, 5.991),
                    "You decide as a fixed limit of 5.99 would. The limit comes as an argument: other sizes and probabilities have others.",
                    id="gate-024d64",
                ),
                Mistake(
                    _gated(lambda y, S: np.sqrt(y @ np.linalg.solve(S, y))),
                    "The limit belongs to y' S^-1 y itself: no root is taken of it, and the limit stays what is given.",
                    id="gate-c1dc0d",
                ),
                Mistake(
                    _gated(lambda y, S: (y**2 / np.diag(S)).sum()),
                    "You left the correlation out: use the whole inverse of S, not only its diagonal.",
                ),
                Mistake(
                    lambda y, S, g: bool((y**2 <= g * np.diag(S)).all()),
                    "Each number is judged by itself here, and the correlation is left out. Judge them together: y' S^-1 y, with the whole inverse of S.",
                    id="gate-de1e7e-2",
                ),
                Mistake(
                    lambda y, S, g: bool((np.abs(y) <= 3 * np.sqrt(np.diag(S))).all()),
                    "Each number is judged by itself here, and the correlation is left out. Judge them together: y' S^-1 y, with the whole inverse of S.",
                    id="gate-de1e7e-3",
                ),
                Mistake(
                    lambda y, S, g: bool((np.abs(y) <= 2 * np.sqrt(np.diag(S))).all()),
                    "Each number is judged by itself here, and the correlation is left out. Judge them together: y' S^-1 y, with the whole inverse of S.",
                    id="gate-de1e7e-4",
                ),
                Mistake(_gated(lambda y, S: y @ S @ y), "You multiplied by S. In the middle stands its inverse."),
                Mistake(
                    _gated(lambda y, S: y @ np.linalg.solve(S, y) / len(y)),
                    "Too much passes: the limit belongs to the sum, not to the mean over the numbers. It is larger for more of them.",
                ),
                Mistake(
                    _gated(lambda y, S: (y @ np.linalg.solve(S, y)) ** 2),
                    "y' S^-1 y is the square already, and the limit belongs to it as it is.",
                    id="gate-e5ee0a",
                ),
                *(
                    Mistake(
                        _gated(lambda y, S, power=power: (y**2 / np.diag(S)).sum() ** power),
                        f"Two slips: the correlation is left out, and the limit {belongs}",
                    )
                    for power, belongs in (
                        (0.5, "belongs to the sum of squares itself: no root, and no square of the limit."),
                        (2.0, "belongs to the square as it is, which is not squared again."),
                    )
                ),
                Mistake(
                    lambda y, S, g: True, "On all draws everything passed: what is the limit for?", id="gate-9e5d6f"
                ),
                Mistake(
                    lambda y, S, g: False,
                    "On all draws nothing passed: such a filter never corrects itself.",
                    id="gate-afdfe3",
                ),
            ],
        ),
        Exercise(
            "batch_estimate",
            reference=batch_estimate,
            sizes=("x0", "z"),
            draw=tuple(
                functools.partial(measured_often, n=n, m=m, k=k, sure=sure)
                for n, m, k, sure in ((2, 1, 9, 1.0), (3, 2, 3, 100.0), (2, 2, 6, 1e-3))
            ),
            metric=STATE_AND_COV,
            noisy=(
                (
                    functools.partial(measured_often, n=2, m=2, k=1),
                    STATE_AND_COV,
                    "right for several measurements, but not for a single one:",
                ),
                (functools.partial(measured_often, n=1, m=1, k=4), STATE_AND_COV, ONE_STATE),
                (measured_alike, STATE_AND_COV, "right, but not where two measurements are equal: each counts:"),
                (
                    functools.partial(measured_often, n=5, m=2, k=40, sure=1e4),
                    STATE_AND_COV,
                    "right, but not for five states and forty measurements, of which little is sure:",
                ),
                (
                    functools.partial(measured_often, n=2, m=3, k=3),
                    STATE_AND_COV,
                    "right, but not for measurements of more numbers than there are states:",
                ),
                (
                    functools.partial(one_far_more_exact, measured=functools.partial(measured_often, n=3, m=2, k=4)),
                    STATE_AND_COV,
                    UNLIKE_SENSORS,
                ),
            ),
            hints=(
                "What is known before is one more measurement, of the state itself, with its own covariance.",
                "N = cov0^-1 + sum C^T cov_z^-1 C and b = cov0^-1 x0 + sum C^T cov_z^-1 z; then x = N^-1 b, with covariance N^-1.",
                "`N, b = np.linalg.inv(cov0), np.linalg.solve(cov0, x0)\n"
                "for one in z:\n"
                "    N = N + C.T @ np.linalg.solve(cov_z, C)\n"
                "    b = b + C.T @ np.linalg.solve(cov_z, one)\n"
                "return np.linalg.solve(N, b), np.linalg.inv(N)`",
            ),
            mistakes=[
                Mistake(
                    _batch_of_sums(lambda V, C, n: V + C, lambda V0, x0: V0 @ x0),
                    "All measurements count for the state, but the covariance knows of one only: their information adds up, k times C^T cov_z^-1 C.",
                ),
                Mistake(
                    _batch_of_sums(lambda V, C, n: V + n * C, lambda V0, x0: x0),
                    "The covariance is right. x0 counts with its own weight, cov0^-1 x0.",
                ),
                Mistake(
                    _batch_with_covariances,
                    "You weigh with the covariances themselves: what is uncertain would count most. Their inverses are the weights.",
                ),
                Mistake(
                    _batch_unweighted,
                    "You gave x0 and all measurements the same weight. Each counts with the inverse of its covariance: weighted least squares.",
                ),
                Mistake(
                    _batch(prior=0.0),
                    "What was known before the measurements is missing: x0 with cov0 counts like one more measurement.",
                ),
                Mistake(
                    _batch(weight=lambda cov_z: np.eye(len(cov_z))),
                    "The measurements count with the inverse of their covariance.",
                ),
                Mistake(_batch(weight=lambda cov_z: cov_z), "The covariance of the measurement weighs inversely."),
                Mistake(
                    _batch(weight=lambda cov_z: np.diag(1 / np.diag(cov_z))),
                    "The correlations of the measurement are missing: the whole inverse of cov_z.",
                ),
                Mistake(_batch(used=lambda z: z[-1:]), "Only the last measurement counts in yours."),
                Mistake(_batch(used=lambda z: z[:1]), "Only the first measurement counts in yours."),
                Mistake(
                    _batch(used=lambda z: z.mean(0, keepdims=True)),
                    "This is what one measurement, the mean of them all, would give. A mean of k is surer: its covariance is cov_z / k.",
                    id="batch_estimate-1b66a7",
                ),
                Mistake(
                    lambda x0, cov0, z, C, cov_z: (
                        batch_estimate(x0, cov0, z, C, cov_z)[0],
                        np.linalg.inv(batch_estimate(x0, cov0, z, C, cov_z)[1]),
                    ),
                    "The state is right. What you return beside it is the information; the covariance is its inverse.",
                ),
                Mistake(
                    lambda x0, cov0, z, C, cov_z: (batch_estimate(x0, cov0, z, C, cov_z)[0], cov0),
                    "The state is right. The covariance is that from before the measurements.",
                ),
                Mistake(
                    lambda x0, cov0, z, C, cov_z: (x0, batch_estimate(x0, cov0, z, C, cov_z)[1]),
                    "The covariance is right. The state is that from before the measurements.",
                ),
                Mistake(
                    lambda x0, cov0, z, C, cov_z: batch_estimate(np.zeros_like(x0), cov0, z, C, cov_z),
                    "The covariance is right. To the state what was known before has to be added: cov0^-1 x0, beside the sum of C^T cov_z^-1 z.",
                ),
                Mistake(
                    _batch_of_repeated_rows,
                    "Here the first row of C counts k times, then the second, as `np.repeat` writes them. The numbers of z follow one another measurement by measurement: `np.tile(C, (k, 1))`.",
                    id="batch_estimate-69baed",
                ),
                Mistake(lambda *a: batch_estimate(*a)[::-1], "The order is state, covariance."),
                Mistake(
                    _batch_weighed_twice,
                    "The inverse covariances count squared here, as where they stand before the rows of least squares, which squares them. There their roots belong: np.linalg.solve(L, row), with L from np.linalg.cholesky of the covariance.",
                    id="batch_estimate-4a8a61",
                ),
                Mistake(
                    _prior_with_each,
                    "What is known before counts once. You add it anew with each measurement.",
                ),
                Mistake(
                    _state_unweighted,
                    "The covariance is right. For the state all rows weigh alike: each is to count as the inverse of its covariance says, cov0 or cov_z.",
                ),
            ],
        ),
    ],
    further=(
        "precise",
        "batch_estimate",
    ),
)
