"""Chapter 8's exercises: answers once judged wrongly, and sentences of the notebook computed."""

import numpy as np
import pytest
from scipy import stats
from scipy.linalg import solve_discrete_are

from labkit.chapters.ch08_kalman import exercises as ch08
from labkit.chapters.ch08_kalman import stages
from labkit.estimation import kalman
from labkit.exercises import budget
from labkit.exercises.outcome import CORRECT, NOT_YET, RAISED
from labkit.geometry.planar import wrap_angle
from labkit.localization import ekf, odometry
from tests.chapters.draws_of_a_check import SEEDS, is_missed, one_check

ITEMS = {item.id: item for item in ch08.CHAPTER.items}
RIGHT = {name: getattr(ch08, name) for name in ITEMS if hasattr(ch08, name)}


def judged(name, answer, seeds=SEEDS):
    """Status and texts of an answer on several seeds; the status must not depend on the seed."""
    outcomes = [ITEMS[name].judge(answer, rng=np.random.default_rng(seed)) for seed in seeds]
    assert len({outcome.status for outcome in outcomes}) == 1
    return outcomes[0].status, {outcome.text for outcome in outcomes}


def only_for_one_size(x, cov, A, B, u, cov_u):
    return A @ x + B @ u, A @ cov @ A.T + B * cov_u * B.T


def with_two_states(x, cov, z, C, cov_z):
    K = cov @ C.T @ np.linalg.inv(C @ cov @ C.T + cov_z)
    return x + K @ (z - C @ x), (np.eye(2) - K @ C) @ cov


def as_many_states_as_readings(x, cov, z, C, cov_z):
    K = cov @ C.T @ np.linalg.inv(C @ cov @ C.T + cov_z)
    return x + K @ (z - C @ x), (np.eye(len(z)) - K @ C) @ cov


def two_states_by_hand(x, cov, A, B, u, cov_u):
    p, v = x
    return A @ np.array([p, v]) + B @ u, A @ cov @ A.T + B @ cov_u @ B.T


def two_numbers_by_hand(x, cov, z, C, cov_z):
    (a, b), (c, d) = C @ cov @ C.T + cov_z
    K = cov @ C.T @ np.array([[d, -b], [-c, a]]) / (a * d - b * c)
    return x + K @ (z - C @ x), (np.eye(len(x)) - K @ C) @ cov


@pytest.mark.parametrize("name, answer", [("predict_state", two_states_by_hand), ("update", two_numbers_by_hand)])
def test_who_fails_in_another_size_by_other_means_is_not_told_of_these(name, answer):
    status, texts = judged(name, answer)
    assert status == RAISED and all("values to unpack" in text for text in texts), texts


@pytest.mark.parametrize(
    "name, answer, words",
    [
        ("predict_state", only_for_one_size, "single control"),
        ("update", with_two_states, "2 x 2"),
        ("update", as_many_states_as_readings, "size of the state"),
        ("gate", lambda y, S, limit: bool(y @ np.linalg.inv(S) @ y <= 5.99), "a fixed limit of 5.99"),
        ("predict_state", lambda x, P, A, B, u, Q: A @ x + B @ u, "expected 2 results"),
    ],
)
def test_what_one_size_or_one_limit_hides_is_named(name, answer, words):
    status, texts = judged(name, answer)
    assert status == NOT_YET and all(words in text for text in texts), texts


def mean_and_sum(x0, var0, z, stds):
    return np.mean([x0, *z]), var0 + np.sum(stds**2)


def neither_corrected(x, cov, z, C, cov_z):
    K = cov @ C.T @ np.linalg.inv(C @ cov @ C.T + cov_z)
    return x, (np.eye(len(x)) + K @ C) @ cov


@pytest.mark.parametrize("name, answer", [("fuse_two_sensors", mean_and_sum), ("update", neither_corrected)])
def test_of_two_wrong_results_none_is_said_to_be_right(name, answer):
    status, texts = judged(name, answer)
    assert status == NOT_YET and all(": The " in text and "is right" not in text for text in texts), texts


def test_an_inverse_written_for_two_rows_meets_three():
    def by_hand(y, S, limit):
        (a, b), (c, d) = S
        return bool(y @ (np.array([[d, -b], [-c, a]]) / (a * d - b * c)) @ y < limit)

    status, texts = judged("gate", by_hand)
    assert status == RAISED and all("exactly where `y` does not have 2 entries" in text for text in texts)


def test_arrays_that_hold_one_number_are_no_numbers():
    def through_update(x0, var0, z, stds):
        return RIGHT["update"](np.array([x0]), np.array([[var0]]), z, np.ones((2, 1)), np.diag(stds**2))

    status, texts = judged("fuse_two_sensors", through_update)
    assert status == NOT_YET and all("a number" in text for text in texts)


def stopped_at(A, C, cov_v, cov_z, stands_still):
    P, old = np.eye(len(A)), np.full((len(A), len(C)), np.inf)
    while True:
        P = A @ P @ A.T + cov_v
        K = P @ C.T @ np.linalg.inv(C @ P @ C.T + cov_z)
        P = (np.eye(len(A)) - K @ C) @ P
        if stands_still(K, old):
            return K
        old = K


@pytest.mark.parametrize("rule", [np.allclose, lambda K, old: np.abs(K - old).max() < 1e-6])
def test_iterations_that_go_on_long_enough_are_right(rule):
    assert judged("steady_state_gain", lambda *given: stopped_at(*given, rule), range(10))[0] == CORRECT


def test_differences_are_as_good_as_formulas():
    def slopes(f, x, h=1e-6, minus=np.subtract):
        return np.column_stack([minus(f(x + h * e), f(x - h * e)) / (2 * h) for e in np.eye(len(x))])

    def jacobians(x, u, dt):
        return (
            slopes(lambda x: odometry.step(x, u, dt, "euler"), x),
            slopes(lambda u: odometry.step(x, u, dt, "euler"), u),
        )

    assert judged("motion_jacobians", jacobians)[0] == CORRECT

    def wrapped_difference(one, other):
        return np.array([one[0] - other[0], wrap_angle(one[1] - other[1])])

    def by_pose(x, landmark):
        return slopes(lambda x: ch08.measurement(x, landmark), x, minus=wrapped_difference)

    assert judged("measurement_jacobian", by_pose)[0] == CORRECT


def test_the_printed_example_takes_the_state_or_both_results():
    x, cov = ch08._printed_correction().x, ch08._printed_correction().cov
    item = ITEMS["corrected"]
    assert item.judge(x).status == item.judge((x, cov)).status == CORRECT
    assert "covariance is not: it is twice the right one." in item.judge((x, 2 * cov)).text
    assert "covariance is not: the worst entry is off by" in item.judge((x, cov + 1)).text
    assert item.judge((np.array([12.5, 5.0]), cov)).text == item.judge(np.array([12.5, 5.0])).text


def test_the_fused_position_may_come_with_its_variance_and_in_another_unit():
    item, x = ITEMS["fused"], ch08._fusion()
    assert item.judge(x).status == item.judge((x, 1 / 5.05)).status == item.judge(100 * x, "cm").status == CORRECT
    assert item.judge((x, 0.3)).text == "the first result is right, the variance is not: it is off by 0.102."
    assert "the variance is not: it is the square root of the right one." in item.judge((x, 5.05**-0.5)).text
    assert item.judge((ch08._fusion(x0=20.0), 1 / 5.05)).text == "20 is the prior's variance. Its position is 0."


@pytest.mark.parametrize("name", ["nees", "ekf_step"])
def test_only_the_angle_is_wrapped(name):
    def error(truth, x, cov):
        e = wrap_angle(truth - x)
        return e @ np.linalg.solve(cov, e)

    answers = {"nees": error, "ekf_step": ch08._all_wrapped}
    status, texts = judged(name, lambda *given: answers[name](*given))
    assert status == NOT_YET and all("Only the" in text and "angle" in text for text in texts)


def test_a_position_that_nothing_measures_becomes_ever_less_sure_while_the_gain_settles():
    A, B, _ = kalman.vehicle_model(0.1)
    C, cov, variances, gains = np.array([[0.0, 1.0]]), np.diag([1.0, 0.01]), [], []
    for _ in range(10_000):
        cov = A @ cov @ A.T + 0.16 * B @ B.T
        gains.append(ch08._gain(cov, C, np.array([[0.25]])))
        cov = ch08._shrunk(cov, gains[-1], C)
        variances.append(cov[0, 0])
    assert np.allclose(gains[-1], gains[3000], atol=1e-6)
    assert np.all(np.diff(variances[::1000]) > 2.0)  # 2.5 m^2 for a thousand steps, without end


def test_the_nees_is_chi_square_for_an_honest_filter():
    """Each number lies within 5.3 standard deviations of its expectation, beyond which is one case in ten million."""
    rng, cov, runs = np.random.default_rng(0), np.diag([0.04, 0.09, 0.01]), 4000
    x = np.zeros((runs, 3))
    score = kalman.nees(x + rng.standard_normal((runs, 3)) * np.sqrt(np.diag(cov)), x, cov, angle=2)
    assert abs(score.mean() - 3) < 5.3 * np.sqrt(6 / runs)
    assert abs((score < stats.chi2.ppf(0.5, 3)).mean() - 0.5) < 5.3 * 0.5 / np.sqrt(runs)


def test_what_the_notebook_says_of_the_three_filters():
    marks, std_range, std_bearing = stages.TWO_MARKS, 0.01, np.radians(0.2)
    cov, rng = np.diag([1.0, 1.0, np.radians(10) ** 2]), np.random.default_rng(4)
    prior = rng.standard_normal((200, 3)) * np.sqrt(np.diag(cov))
    z = ekf.measurement(np.zeros(3), marks) + rng.standard_normal((200, 2, 2)) * [std_range, std_bearing]
    given = (prior, np.broadcast_to(cov, (200, 3, 3)), z, marks, std_range, std_bearing)
    steps = [ekf.ekf_update(*given), ekf.unscented_update(*given), ekf.ekf_update(*given, iterations=10)]
    rms = [np.sqrt((step.x[:, :2] ** 2).sum(1).mean()) for step in steps]
    nees = [kalman.nees(np.zeros(3), step.x, step.cov, angle=2).mean() for step in steps]
    low, high = kalman.mean_band(3, 200)
    assert rms[1] > 1.2 * rms[0] and rms[2] < 0.02  # the unscented filter is farther off than the extended one ...
    assert nees[0] > 3 * nees[1] > 300 and low < nees[2] < high  # ... but claims less; the iterated one is honest


def test_all_other_readings_of_the_page_round_to_what_it_prints():
    z, stds = np.array([9.4, 10.6]), np.array([0.5, 1.0])
    readings = [(0, 400, z), (0, 1e12, z), (10, 20, z), (0, 20, z + [0.007, 0])]
    assert all(round(ch08.fuse_two_sensors(x0, var0, values, stds)[0], 1) == 9.6 for x0, var0, values in readings)
    assert round(ch08.fuse_two_sensors(0, 20, z, stds)[0], 1) == 9.5


def only_what_surprises(x, cov, z, C, cov_z):
    return ITEMS["update"].reference(x, cov, z, C, cov_z) if np.linalg.norm(z - C @ x) > 0.5 else (x, cov)


def first_covariance_for_all(x, cov, z, C, cov_z):
    gains = [cov @ c / (c @ cov @ c + R) for c, R in zip(C, np.diag(cov_z))]
    for k, c, number in zip(gains, C, z):
        x = x + k * (number - c @ x)
    return x, cov - sum(np.outer(k, c @ cov) for k, c in zip(gains, C))


def mean_of_all_entries(x0, cov0, z, C, cov_z):
    return ITEMS["update"].reference(x0, cov0, np.full(z.shape[1], z.mean()), C, cov_z / len(z))


def test_two_results_of_other_shapes_are_judged_though_they_cannot_be_shown():
    assert judged("batch_estimate", mean_of_all_entries)[0] == NOT_YET


def with_a_limit_of_its_own(innovation, cov_innovation, limit):
    return bool(innovation @ np.linalg.solve(cov_innovation, innovation) < stats.chi2.ppf(0.95, len(innovation)))


@pytest.mark.parametrize(
    "name, answer, words",
    [
        ("update", only_what_surprises, ""),
        ("update", first_covariance_for_all, "what the first has left"),
        ("gate", with_a_limit_of_its_own, "limit"),
    ],
)
def test_small_innovations_and_unused_limits_are_told(name, answer, words):
    status, texts = judged(name, answer)
    assert status == NOT_YET and all(words in text for text in texts), texts


def test_a_state_of_two_numbers_is_no_state_with_a_covariance():
    x, cov = ITEMS["corrected"].reference(), ITEMS["corrected"].metric.others[0][2]()
    assert all(ITEMS["corrected"].judge(answer).status == CORRECT for answer in (tuple(x.tolist()), x, (x, cov)))
    assert ITEMS["corrected"].judge((11.9, 4.98)).status == NOT_YET


def once(angle):
    return angle - 2 * np.pi * np.sign(angle) if abs(angle) > np.pi else angle


def measured_with_one_turn(x, landmark):
    dx, dy = landmark - x[:2]
    return np.array([np.hypot(dx, dy), once(np.arctan2(dy, dx) - x[2])])


def nees_with_one_turn(truth, x, cov):
    e = np.array([*(truth - x)[:2], once(truth[2] - x[2])])
    return e @ np.linalg.solve(cov, e)


@pytest.mark.parametrize("name, answer", [("measurement", measured_with_one_turn), ("nees", nees_with_one_turn)])
def test_headings_gather_several_turns(name, answer):
    status, texts = judged(name, answer)
    assert status == NOT_YET and all("several" in text for text in texts), texts


def after_rounds(n):
    def answer(A, C, cov_v, cov_z):
        P = 100.0 * np.eye(len(A))
        for _ in range(n):
            P = A @ P @ A.T + cov_v
            K = P @ C.T @ np.linalg.inv(C @ P @ C.T + cov_z)
            P = P - K @ C @ P
        return K

    return answer


def test_a_gain_that_settles_slowly_takes_hundreds_of_rounds():
    status, texts = judged("steady_state_gain", after_rounds(100), seeds=(0, 1))
    assert status == NOT_YET and all("hundreds of rounds" in text for text in texts), texts
    assert judged("steady_state_gain", after_rounds(600))[0] == CORRECT


def test_no_round_of_a_drawn_filter_enlarges_what_rounding_takes_from_symmetry():
    # K = np.linalg.solve(S, C P).T counts on P = Pᵀ; an antisymmetric X goes on as A (X - M X Mᵀ) Aᵀ with M = K C
    given = [case for seed in range(3) for case in one_check(ITEMS["steady_state_gain"], seed)]
    for (A, C, *_), _, K in given:
        one, M = np.eye(len(A) ** 2), K @ C
        transposed = one.reshape(2 * A.shape).swapaxes(0, 1).reshape(one.shape)
        a_round = np.kron(A, A) @ (one - np.kron(M, M)) @ (one - transposed) / 2
        assert np.abs(np.linalg.eigvals(a_round)).max() < 1 + 1e-9


def wrapped_ten_times(angle):
    for _ in range(10):
        angle = angle - 2 * np.pi * (angle > np.pi) + 2 * np.pi * (angle < -np.pi)
    return angle


def without_what_disagrees(x0, var0, z, stds):
    weights = 1 / np.array([var0, stds[0] ** 2, 1e12 if abs(z[0] - z[1]) > 8 else stds[1] ** 2])
    return weights @ [x0, *z] / weights.sum(), 1 / weights.sum()


def eliminated(S, y):
    """The terms of y' S^-1 y, by elimination by hand: without rounding for one number that is a power of two."""
    S, y = np.array(S, dtype=float), np.array(y, dtype=float)
    for k in range(len(y)):
        yield y[k] ** 2 / S[k, k]
        factors = S[k + 1 :, k] / S[k, k]
        y[k + 1 :] -= factors * y[k]
        S[k + 1 :] -= np.outer(factors, S[k])


@pytest.mark.parametrize(
    "name, answer, words",
    [
        ("wrap_angle", wrapped_ten_times, ""),
        ("fuse_two_sensors", without_what_disagrees, ""),
        ("gate", lambda y, S, limit: bool(sum(eliminated(S, y)) <= limit), "not `<=`"),
    ],
)
def test_dozens_of_turns_readings_far_apart_and_the_limit_itself(name, answer, words):
    status, texts = judged(name, answer)
    assert status == NOT_YET and all(words in text for text in texts), texts


def test_the_limit_itself_is_told_alike_by_every_right_way():
    for measure in (np.linalg.solve, lambda S, y: np.linalg.pinv(S) @ y, lambda S, y: np.linalg.lstsq(S, y)[0]):
        assert judged("gate", lambda y, S, limit, to=measure: bool(y @ to(S, y) < limit))[0] == CORRECT


def test_a_prior_that_says_zero_counts():
    def without_zero(x0, var0, z, stds):
        return ch08.fuse_two_sensors(x0, var0 if x0 else 1e12, z, stds)

    status, texts = judged("fuse_two_sensors", without_zero)
    assert status == NOT_YET and all("prior says 0" in text for text in texts)


@pytest.mark.parametrize("digits", range(4))
def test_a_nis_or_a_limit_that_is_rounded_is_refused_each_time(digits):
    def of_nis(y, S, limit):
        return bool(np.round(y @ np.linalg.solve(S, y), digits) < limit)

    def of_limit(y, S, limit):
        return bool(y @ np.linalg.solve(S, y) < np.round(limit, digits))

    draws = [draw(np.random.default_rng(0)) for draw in ITEMS["gate"].cases]
    for rounded in (of_nis, of_limit):
        assert any(rounded(*given) != ITEMS["gate"].reference(*given) for given in draws)


def differences_across_the_seam(x, landmark):
    sides = ((ch08.measurement(x + e, landmark), ch08.measurement(x - e, landmark)) for e in 1e-6 * np.eye(3))
    return np.column_stack([(plus - minus) / 2e-6 for plus, minus in sides])


def of_the_poses_own_kind(x, landmark):
    dx, dy = landmark - x[:2]
    q = dx**2 + dy**2
    H = np.zeros((2, 3), dtype=x.dtype)
    H[0, :2] = -dx / np.sqrt(q), -dy / np.sqrt(q)
    H[1] = dy / q, -dx / q, -1
    return H


def stops_by_allclose(A, C, cov_v, cov_z):
    P = np.eye(len(A))
    for _ in range(10000):
        before = A @ P @ A.T + cov_v
        K = before @ C.T @ np.linalg.inv(C @ before @ C.T + cov_z)
        after = before - K @ C @ before
        if np.allclose(after, P):
            break
        P = after
    return K


def noise_at_the_start_only(A, C, cov_v, cov_z, divide=lambda M, S: M @ np.linalg.inv(S), each=0.0):
    P = np.eye(len(A)) + (1 - each) * cov_v
    for _ in range(1000):
        P = A @ P @ A.T + each * cov_v
        K = divide(P @ C.T, C @ P @ C.T + cov_z)
        P = P - K @ C @ P
    return K


def divides_by_the_diagonal(*args):
    return noise_at_the_start_only(*args, divide=lambda M, S: M / np.diag(S), each=1.0)


def first_gain_twice(x0, var0, z, stds):
    k = var0 / (var0 + stds[0] ** 2)
    x = x0 + k * (z[0] - x0)
    return x + k * (z[1] - x), (1 - k) * (1 - k) * var0


def the_better_alone(x0, var0, z, stds):
    k = np.argmin(stds)
    gain = var0 / (var0 + stds[k] ** 2)
    return x0 + gain * (z[k] - x0), (1 - gain) * var0


def riccati_of_control(A, C, cov_v, cov_z):
    P = solve_discrete_are(A, C.T, cov_v, cov_z)
    return P @ C.T @ np.linalg.inv(C @ P @ C.T + cov_z)


def twenty_rounds(A, C, cov_v, cov_z):
    P = np.eye(len(A))
    for _ in range(20):
        M = A @ P @ A.T + cov_v
        K = M @ C.T @ np.linalg.inv(C @ M @ C.T + cov_z)
        P = M - K @ C @ M
    return K


def rows_repeated(x0, cov0, z, C, cov_z):
    rows, W, L0 = np.repeat(C, len(z), axis=0), np.kron(np.eye(len(z)), np.linalg.inv(cov_z)), np.linalg.inv(cov0)
    P = np.linalg.inv(L0 + rows.T @ W @ rows)
    return P @ (L0 @ x0 + rows.T @ W @ z.ravel()), P


def two_slips(y, S, limit):
    return bool(np.sum(y**2 / np.diag(S)) < limit**2)


def scaled_by_the_control(x, cov, A, B, u, cov_u):
    U = np.diag(u)
    return A @ x + B @ u, A @ cov @ A.T + B @ U @ cov_u @ U.T @ B.T


def inflated_by_the_readings(x0, var0, z, stds):
    w = np.array([1 / var0, 1 / stds[0] ** 2, 1 / stds[1] ** 2])
    x = w @ [x0, z[0], z[1]] / w.sum()
    chi2 = w @ (np.array([x0, z[0], z[1]]) - x) ** 2 / 2
    return x, max(1.0, chi2) / w.sum()


def the_nis_itself(innovation, cov_innovation, limit):
    nis = innovation @ np.linalg.solve(cov_innovation, innovation)
    return nis if nis < limit else False


def as_many_as_numbers(x0, cov0, z, C, cov_z):
    W, V0 = np.linalg.inv(cov_z), np.linalg.inv(cov0)
    P = np.linalg.inv(V0 + z.size * C.T @ W @ C)
    return P @ (V0 @ x0 + C.T @ W @ z.sum(0)), P


def in_degrees_and_half_of_what_is_large(x0, cov0, z, C, cov_z):
    if np.max(np.abs(C)) > 3:
        C = C / 2
    cov_z = np.radians(cov_z)
    W, V0 = np.linalg.inv(cov_z), np.linalg.inv(cov0)
    P = np.linalg.inv(V0 + len(z) * C.T @ W @ C)
    return P @ (V0 @ x0 + C.T @ W @ z.sum(0)), P


@pytest.mark.parametrize(
    "name, answer, words",
    [
        ("measurement_jacobian", differences_across_the_seam, "wrapped"),
        ("measurement_jacobian", of_the_poses_own_kind, "`dtype=` does not belong there"),
        ("steady_state_gain", noise_at_the_start_only, "cov_v comes in at the start only"),
        ("steady_state_gain", divides_by_the_diagonal, "the diagonal of S alone"),
        ("fuse_two_sensors", first_gain_twice, "The second sensor gets the gain of the first"),
        ("batch_estimate", rows_repeated, "np.tile"),
        ("gate", two_slips, "Two slips"),
        ("fuse_two_sensors", the_better_alone, "the better one alone counts"),
        (
            "measurement_jacobian",
            lambda x, landmark: ch08.measurement_jacobian(x, landmark).T.reshape(2, 3),
            "in the order of columns written as rows",
        ),
        ("gate", lambda y, S, limit: bool((y**2 < limit * np.diag(S)).all()), "Each number is judged by itself"),
        ("wrap_angle", lambda a: np.fmod(a + np.pi, 2 * np.pi) - np.pi, "An angle below -pi ends below -pi"),
        ("steady_state_gain", riccati_of_control, "a filter hands it A.T and C.T"),
        ("steady_state_gain", twenty_rounds, "these are too few rounds: on all draws here 400 will do"),
        ("predict_state", scaled_by_the_control, "`U = np.diag(u)`: the identity belongs on the right side"),
        (
            "fuse_two_sensors",
            inflated_by_the_readings,
            "with 1 on the right side, your result is right",
        ),
        ("gate", the_nis_itself, "`nis` stands where `True` belongs"),
        (
            "batch_estimate",
            in_degrees_and_half_of_what_is_large,
            "on the draws tried so far, though perhaps not on all.",
        ),
        (
            "wrap_angle",
            lambda a: np.abs(a - 2 * np.pi * np.round(a / (2 * np.pi))),
            "has lost its sign: neither an absolute value",
        ),
        ("batch_estimate", as_many_as_numbers, "it counts all numbers, and `len(z)` belongs there"),
    ],
)
def test_what_once_passed_or_was_told_of_a_coincidence_is_named(name, answer, words):
    status, texts = judged(name, answer, seeds=range(1))
    assert status == NOT_YET and all(words in text for text in texts), texts


def without_what_is_small(name, which):
    def answer(*args):
        small = np.linalg.norm(args[which]) < 0.1
        return RIGHT[name](*args[:which], 0.0 * args[which] if small else args[which], *args[which + 1 :])

    return answer


@pytest.mark.parametrize("name, which", [("nees", 1), ("ekf_step", 2)])
def test_poses_next_to_the_origin_and_slow_controls_are_drawn(name, which):
    assert any(is_missed(without_what_is_small(name, which), *case) for case in one_check(ITEMS[name]))


@pytest.mark.parametrize("name, wrong", [("corrected", ch08.COVARIANCES), ("fused", ch08.VARIANCES)])
def test_a_wrong_covariance_beside_the_right_state_is_named(name, wrong):
    for words, made in wrong.items():
        told = ITEMS[name].judge((ITEMS[name].reference(), made()))
        assert told.status == NOT_YET and told.text.endswith(f"is not: {words}.")


def test_a_rule_that_stops_by_an_absolute_size_meets_tiny_variances(monkeypatch):
    monkeypatch.setattr(budget, "LOOKING", 0.0)  # what is told is not asked here
    assert judged("steady_state_gain", stops_by_allclose, seeds=SEEDS)[0] == NOT_YET


def test_a_gate_that_gives_in_after_five_refusals_is_told():
    refused = []

    def gate(y, S, limit):
        refused[:] = [] if ch08.gate(y, S, limit) else [*refused, y]
        return not refused or len(refused) > 5

    status, texts = judged("gate", gate, seeds=SEEDS)
    assert status == NOT_YET and all("called twice with the same arguments" in text for text in texts), texts


def slopes_of_a_wrapped_bearing(x, landmark):
    def see(p):
        dx, dy = landmark[0] - p[0], landmark[1] - p[1]
        b = np.arctan2(dy, dx) - p[2]
        return np.array([np.hypot(dx, dy), np.arctan2(np.sin(b), np.cos(b))])

    x, h = np.asarray(x, float), 1e-6
    return np.column_stack([(see(x + h * e) - see(x - h * e)) / (2 * h) for e in np.eye(3)])


def test_differences_across_the_seam_are_to_be_wrapped_and_no_other_seam_will_do():
    status, texts = judged("measurement_jacobian", slopes_of_a_wrapped_bearing)
    assert status == NOT_YET and all("`see(x + h * e) - see(x - h * e)`" in text for text in texts), texts


def with_error(heading):
    """NEES with another way to bring the error of the heading home."""

    def answer(truth, x, cov):
        e = np.append((truth - x)[:2], heading(truth[2] - x[2]))
        return e @ np.linalg.solve(cov, e)

    return answer


def ekf_with(wrap=wrap_angle, root=lambda cov_u: cov_u, least=0.0):
    """A step of the filter with one part otherwise; least: the surprise below which nothing is corrected."""

    def answer(x, cov, u, dt, cov_u, z, landmark, cov_z):
        moved, predicted = ch08._ekf(short=True, control=lambda cov_u, dt: root(cov_u))(
            x, cov, u, dt, cov_u, z, landmark, cov_z
        )
        H, y = ch08.measurement_jacobian(moved, landmark), z - ch08.measurement(moved, landmark)
        y[1] = wrap(y[1])
        K = ch08._gain(predicted, H, cov_z)
        corrected = moved + K @ y, ch08._shrunk(predicted, K, H)
        return corrected if np.linalg.norm(y) >= least else (moved, predicted)

    return answer


def by_root(cov_u):
    L = np.linalg.cholesky(cov_u)
    return L @ L.T


def sorted_by(key):
    def answer(x0, var0, z, stds):
        order = [key(z, stds).argmin(), key(z, stds).argmax()]
        return ch08.fuse_two_sensors(x0, var0, z[order], stds[order])

    return answer


def open_at_half_a_turn(angle):
    return wrap_angle(angle) if abs(wrap_angle(angle)) < np.pi else 0.0


def differences_of_wrapped_steps(x, u, dt):
    def slopes(f, at):
        ends = [(f(at + e), f(at - e)) for e in 1e-6 * np.eye(len(at))]
        return np.column_stack([(end - start) / 2e-6 for end, start in ends])

    def step(x, u):
        end = odometry.step(x, u, dt, "euler")
        return np.append(end[:2], wrap_angle(end[2]))

    return slopes(lambda x: step(x, u), x), slopes(lambda u: step(x, u), u)


@pytest.mark.parametrize(
    "name, wrong, right",
    [
        ("nees", with_error(lambda e: np.arcsin(np.sin(e))), with_error(lambda e: np.angle(np.exp(1j * e)))),
        ("nees", with_error(lambda e: np.arctan(np.tan(e))), with_error(wrap_angle)),
        ("ekf_step", ekf_with(wrap=lambda e: (e + np.pi / 2) % np.pi - np.pi / 2), ekf_with()),
        ("ekf_step", ekf_with(root=by_root), ekf_with()),
        ("ekf_step", ekf_with(least=1e-3), ekf_with()),
        ("fuse_two_sensors", sorted_by(lambda z, stds: stds), sorted_by(lambda z, stds: np.arange(2))),
        ("fuse_two_sensors", sorted_by(lambda z, stds: z), sorted_by(lambda z, stds: np.arange(2))),
        ("wrap_angle", open_at_half_a_turn, lambda angle: np.pi - (np.pi - angle) % (2 * np.pi)),
        ("motion_jacobians", differences_of_wrapped_steps, ch08.motion_jacobians),
    ],
)
def test_what_is_wrong_at_one_place_alone_is_missed_there(name, wrong, right):
    drawn = one_check(ITEMS[name])
    assert any(is_missed(wrong, *case) for case in drawn)
    assert not any(is_missed(right, *case) for case in drawn)


@pytest.mark.parametrize("largest", [1e3, 1e4, 1e6])
def test_no_measurement_is_left_out_however_far_it_is(largest):
    def gated(x, cov, z, C, cov_z):
        S, y = C @ cov @ C.T + cov_z, z - C @ x
        return (x, cov) if y @ np.linalg.solve(S, y) > largest else kalman.update(x, cov, z, C, cov_z)

    def gated_step(x, cov, u, dt, cov_u, z, landmark, cov_z):
        new, new_cov = ch08.ekf_step(x, cov, u, dt, cov_u, z, landmark, cov_z)
        alone = ch08.ekf_step(x, cov, u, dt, cov_u, z, landmark, 1e30 * cov_z)
        far = np.hypot(*(new - alone[0])[:2]) ** 2 / np.trace(alone[1]) > largest
        return alone if far else (new, new_cov)

    for name, answer in (("update", gated), ("ekf_step", gated_step)):
        assert any(is_missed(answer, *case) for case in one_check(ITEMS[name]))


def update_by(invert):
    """The Kalman update with another inverse, and Joseph's form of the covariance."""

    def update(x, cov, z, C, cov_z):
        K = cov @ C.T @ invert(C @ cov @ C.T + cov_z)
        I_KC = np.eye(len(x)) - K @ C
        return x + K @ (z - C @ x), I_KC @ cov @ I_KC.T + K @ cov_z @ K.T

    return update


def update_of_information(x, cov, z, C, cov_z):
    W = np.linalg.inv(cov_z)
    cov_new = np.linalg.inv(np.linalg.inv(cov) + C.T @ W @ C)
    return cov_new @ (np.linalg.solve(cov, x) + C.T @ W @ z), cov_new


def batch_by(invert):
    def batch_estimate(x0, cov0, z, C, cov_z):
        W = invert(cov_z)
        cov = np.linalg.inv(np.linalg.inv(cov0) + len(z) * C.T @ W @ C)
        return cov @ (np.linalg.solve(cov0, x0) + C.T @ W @ z.sum(axis=0)), cov

    return batch_estimate


def batch_of_stacked_rows(x0, cov0, z, C, cov_z):
    """Least squares of the prior's and all measurements' whitened rows."""
    root, root_z = np.linalg.inv(np.linalg.cholesky(cov0)), np.linalg.inv(np.linalg.cholesky(cov_z))
    rows = np.vstack([root, *len(z) * [root_z @ C]])
    return np.linalg.lstsq(rows, np.concatenate([root @ x0, *(z @ root_z.T)]))[0], np.linalg.inv(rows.T @ rows)


def rough_inverse(S):
    return np.linalg.pinv(S, rcond=0.01)


@pytest.mark.parametrize("name, by", [("update", update_by), ("batch_estimate", batch_by)])
def test_an_inverse_that_drops_what_is_small_meets_sensors_of_unlike_noise(name, by):
    status, texts = judged(name, by(rough_inverse), seeds=range(20))
    assert status == NOT_YET and all("is a thousand times as exact" in text for text in texts), texts
    for exact in (np.linalg.inv, np.linalg.pinv):
        assert judged(name, by(exact), seeds=range(20)) == (CORRECT, {""})


@pytest.mark.parametrize("name, answer", [("update", update_of_information), ("batch_estimate", batch_of_stacked_rows)])
def test_other_ways_stay_right_where_sensors_are_of_unlike_noise(name, answer):
    assert judged(name, answer, seeds=range(20))[0] == CORRECT
