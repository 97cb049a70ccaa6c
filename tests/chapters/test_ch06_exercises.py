"""Answers of students to chapter 6 that were once judged wrongly."""

import functools

import numpy as np
import pytest

from labkit.chapters.ch06_tracker import exercises as ch06
from labkit.exercises.outcome import CORRECT, NOT_YET, RAISED
from labkit.geometry import frames
from labkit.geometry.lie import exp_so3, nearest_rotation
from labkit.machines import arm, log, tracking
from tests.chapters.draws_of_a_check import SEEDS, is_missed, one_check

ITEMS = {item.id: item for item in ch06.CHAPTER.items}


def texts(name, answer, status=NOT_YET):
    outcomes = [ITEMS[name].judge(answer, rng=np.random.default_rng(seed)) for seed in SEEDS]
    assert all(outcome.status == status for outcome in outcomes), [o.text for o in outcomes]
    return {outcome.text for outcome in outcomes}


def test_a_packet_that_is_kept_by_its_time_is_told():
    def decode(data, known={}):  # noqa: B006, what it keeps is the slip
        v = np.frombuffer(data, "<f8")
        return known.setdefault(v[1], (v[1], 1000 * v[2:5], v[11:15]))

    assert all("under a key that leaves a part" in text for text in texts("decode_packet", decode))


@pytest.mark.parametrize("sign", [1, -1])
def test_a_block_of_the_equation_may_have_either_sign(sign):
    texts("kron_row", lambda A, B: sign * (np.kron(np.eye(3), A) - np.kron(B.T, np.eye(3))), CORRECT)


def test_the_number_of_columns_is_not_told_that_it_is_the_number_of_motions():
    wrong = texts("e_rot", lambda M: np.linalg.svd(M)[1][-1] ** 2 / (M.shape[1] - 1))
    assert not any("divide by N" in text for text in wrong)


@pytest.mark.parametrize("constant", [1.48, 1.4826, 1 / 0.6745])
def test_the_constant_of_the_robust_rule_may_be_rounded(constant):
    def keep(values, factor):
        distance = np.abs(values - np.median(values))
        return distance <= factor * constant * np.median(distance)

    texts("reject_outliers", keep, CORRECT)


def test_other_rules_for_outliers_are_not_told_of_a_missing_constant():
    def box_plot(values, factor):
        low, high = np.percentile(values, [25, 75])
        return (values > low - 1.5 * (high - low)) & (values < high + 1.5 * (high - low))

    theirs = log.reject_outliers
    for rule in (box_plot, lambda values, factor: theirs(values, 3.0)):
        assert not any("1.4826" in text for text in texts("reject_outliers", rule))


def test_a_tracker_that_leads_is_asked_for_at_every_check():
    def lags_only(time, reference, delayed, max_offset):
        step = time[1] - time[0]
        cost = [np.mean((reference[: len(time) - s] - delayed[s:]) ** 2) for s in range(round(max_offset / step) + 1)]
        k = np.clip(np.argmin(cost), 1, len(cost) - 2)
        left, middle, right = cost[k - 1 : k + 2]
        return (k + 0.5 * (left - right) / (left - 2 * middle + right)) * step

    assert "one direction" in texts("time_offset", lags_only).pop()


@pytest.mark.parametrize(
    "block",
    [
        lambda A, B: np.kron(B, A) - np.eye(9),
        lambda A, B: np.eye(9) - np.kron(B.T, A.T),
        lambda A, B: np.kron(np.eye(3), A.T) - np.kron(B, np.eye(3)),
        lambda A, B: (np.kron(np.eye(3), A) - np.kron(B.T, np.eye(3)))[[0, 3, 6, 1, 4, 7, 2, 5, 8]],
    ],
)
def test_other_blocks_with_the_same_solutions_and_singular_values_are_right(block):
    texts("kron_row", block, CORRECT)
    A, B = ch06.one_motion(np.random.default_rng(3))
    plain = np.linalg.svd(ch06.kron_row(A, B))[1]
    np.testing.assert_allclose(np.linalg.svd(block(A, B))[1], plain, atol=1e-12)


def test_the_robot_by_heart_is_refused():
    def flange(dh, q):
        return functools.reduce(np.matmul, [arm.dh_matrix(o + x, d, a, al) for (o, d, a, al), x in zip(arm.TX40.dh, q)])

    told = texts("forward_kinematics", flange)
    assert all("use the argument `dh`" in text for text in told)


def test_the_sign_of_the_first_entry_is_not_the_sign_of_the_determinant():
    def rotation(M):
        v = np.linalg.svd(M)[2][-1]
        U, _, Vt = np.linalg.svd((v * np.sign(v[0])).reshape(3, 3, order="F"))
        return U @ Vt

    assert all("R[0, 0] may well be negative" in text for text in texts("rotation_from_nullvector", rotation))


@pytest.mark.parametrize("seed", range(10))
def test_four_byte_numbers_are_named_whatever_they_hold(seed):
    def decode(data):
        values = np.frombuffer(data, "<f4")
        return values[1], 1000 * values[2:5], values[11:15]

    outcome = ITEMS["decode_packet"].judge(decode, rng=np.random.default_rng(seed))
    assert "46 numbers of 4 bytes" in outcome.text


def test_a_bound_of_e_trans_holds_since_both_errors_are_equally_long():
    """K1 t - K2 and the translation error of a motion differ by a rotation; the mean never exceeds the rms."""
    A, B, R = ch06.translation_problem(np.random.default_rng(2))
    t = ch06.translation_lsq(A, B, R)
    X = frames.pose(R, t)
    error = frames.invert(A @ X) @ X @ B
    rows = (np.eye(3) - A[:, :3, :3]) @ t - (A[:, :3, 3] - B[:, :3, 3] @ R.T)
    lengths = np.linalg.norm(error[:, :3, 3], axis=1)
    np.testing.assert_allclose(lengths, np.linalg.norm(rows, axis=1), rtol=1e-9)
    assert ch06.e_trans(rows) >= lengths.mean() * np.sqrt(len(A)) / (len(A) - 1)


# ---- other right ways through the further parts


def cross_of_the_planes(delays, rate):
    alpha, beta = 2 * np.pi * rate * np.array(delays) - np.pi / 2
    d = np.cross([np.cos(alpha), 0, -np.sin(alpha)], [0, np.cos(beta), -np.sin(beta)])
    return d / np.linalg.norm(d) * np.sign(d[2])


def lengths_along_the_rays(origins, directions):
    n = len(origins)
    A = np.hstack([np.tile(np.eye(3), (n, 1)), np.zeros((3 * n, n))])
    for k, d in enumerate(directions):
        A[3 * k : 3 * k + 3, 3 + k] = -d
    return np.linalg.lstsq(A, origins.ravel(), rcond=None)[0][:3]


def by_differences(T, cov_T, p, cov_p):
    def moved(e):
        return T[:3, :3] @ exp_so3(e[:3]) @ (p + e[6:]) + T[:3, 3] + e[3:6]

    J = np.array([(moved(1e-6 * e) - moved(-1e-6 * e)) / 2e-6 for e in np.eye(9)]).T
    return J[:, :6] @ cov_T @ J[:, :6].T + J[:, 6:] @ cov_p @ J[:, 6:].T


@pytest.mark.parametrize(
    "name, answer",
    [
        ("ray_direction", cross_of_the_planes),
        ("nearest_to_rays", lengths_along_the_rays),
        ("singular_value_ratio", lambda M: np.sqrt(np.divide(*np.linalg.eigvalsh(M.T @ M)[[1, -1]]))),
        ("static_error_and_lag", lambda speed, error: np.sqrt(np.polyfit(speed**2, error**2, 1))[::-1]),
        ("moved_part", lambda W, E0, E1, P: W @ E1 @ np.linalg.inv(E0) @ np.linalg.inv(W) @ P),
        ("point_covariance", by_differences),
        ("shares", lambda Js, Cs: [float(np.sqrt(np.einsum("ij,jk,ik->", J, C, J))) for J, C in zip(Js, Cs)]),
    ],
)
def test_other_ways_through_the_further_parts_are_right(name, answer):
    texts(name, answer, CORRECT)


def test_two_rays_alone_are_no_answer():
    assert "first two rays" in texts("nearest_to_rays", lambda o, d: lengths_along_the_rays(o[:2], d[:2])).pop()


def test_a_packet_read_in_single_precision_is_not_right():
    def decoded(data):
        v = np.frombuffer(data, "<f8").astype(np.float32)
        return v[1], 1000 * v[2:5], v[11:15]

    assert "single precision" in texts("decode_packet", decoded).pop()


def test_the_median_of_an_even_number_and_truth_values_that_are_whole_numbers():
    def upper(values, factor=4.0):
        m = np.sort(values)[len(values) // 2]
        d = np.abs(values - m)
        return d <= factor * 1.4826 * np.sort(d)[len(d) // 2]

    def ones(values, factor=4.0):
        d = np.abs(values - np.median(values))
        return np.where(d <= factor * 1.4826 * np.median(d), 1, 0)

    def listed(values, factor=4.0):
        return [bool(kept) for kept in ones(values, factor)]

    assert all("Where it is even, the median" in text for text in texts("reject_outliers", upper))
    assert all("whole numbers for places" in text for text in texts("reject_outliers", ones))
    texts("reject_outliers", listed, CORRECT)


def test_the_first_shift_that_is_least_among_its_neighbors_is_not_enough():
    def offset(time, reference, delayed, max_offset=0.2):
        step, n = time[1] - time[0], len(time)
        shifts = np.arange(-round(max_offset / step), round(max_offset / step) + 1)
        cost = [
            np.mean((reference[max(0, -k) : n - max(0, k)] - delayed[max(0, k) : n - max(0, -k)]) ** 2) for k in shifts
        ]
        i = 1
        while i < len(cost) - 2 and cost[i + 1] < cost[i]:
            i += 1
        left, middle, right = cost[i - 1 : i + 2]
        return (shifts[i] + 0.5 * (left - right) / (left - 2 * middle + right)) * step

    assert ITEMS["time_offset"].judge(offset, rng=np.random.default_rng(0)).status == NOT_YET


def test_a_link_may_turn_and_step_either_way():
    def no_way_back(theta, d, a, alpha):
        return arm.dh_matrix(theta, abs(d), a, alpha)

    texts("dh_matrix", no_way_back)


def test_what_is_wrong_for_two_kinds_of_values_is_not_called_right_but_for_one():
    def kept_from_0(values, factor=4.0):
        d = np.abs(values - np.median(values))
        return d / (1.4826 * np.median(d) + 1e-3) <= factor

    told = texts("reject_outliers", kept_from_0)
    assert all(text.startswith("Right on ordinary draws where hardly any values are equal") for text in told)


def test_quartiles_are_no_median_of_distances():
    def quartiles(values, factor=4.0):
        low, middle, high = np.percentile(values, [25, 50, 75])
        return np.abs(values - middle) <= factor * (high - low) / 1.349

    assert all("on both sides of the median" in text for text in texts("reject_outliers", quartiles))


def test_no_part_of_a_quaternion_tells_the_sign_of_all_readings():
    def by(number):
        def mean(q):
            total = (q * np.sign(number(q))[:, None]).sum(axis=0)
            return total / np.linalg.norm(total)

        return mean

    def largest(q):
        return q[np.arange(len(q)), np.abs(q).argmax(axis=1)]

    assert all("You made the largest part" in text for text in texts("mean_quaternion", by(largest)))
    assert all("the sum of the parts" in text for text in texts("mean_quaternion", by(lambda q: q.sum(axis=1))))


def test_noise_draws_a_sum_of_squares_to_the_largest_shift():
    assert all("Take their mean" in t for t in texts("time_offset", ch06._least(ch06._sum_of_squares, True)))
    texts("time_offset", ch06._least(ch06._mean_of_squares, True), CORRECT)


def test_values_may_lie_anywhere_and_a_packet_holds_either_sign():
    centers = [
        np.median(draw(np.random.default_rng(seed))[0]) for seed in range(4) for draw in ITEMS["reject_outliers"].cases
    ]
    assert np.ptp(centers) > 50

    def positive(data):
        time, position, q = ch06.decode_packet(data)
        return time, position, q if q[3] > 0 else -q

    texts("decode_packet", positive)


@pytest.mark.parametrize("null", [lambda M: np.linalg.svd(M)[2][-1], lambda M: np.linalg.eigh(M.T @ M)[1][:, 0]])
def test_a_null_vector_whose_sign_is_left_to_chance_is_named(null):
    answers = texts("rotation_from_nullvector", lambda M: nearest_rotation(null(M).reshape(3, 3).T))
    assert all("The sign is missing" in text for text in answers)


def test_the_first_of_unsorted_eigenvectors_is_never_the_null_vector():
    draws = [draw(np.random.default_rng(seed))[0] for seed in SEEDS for draw in ITEMS["rotation_from_nullvector"].cases]
    assert all(np.linalg.eig(M.T @ M)[0].argmin() for M in draws)


def test_the_sign_of_the_trace_is_not_the_sign_of_the_determinant():
    def by_trace(M):
        X = np.linalg.svd(M)[2][-1].reshape(3, 3).T
        return nearest_rotation(X if np.trace(X) > 0 else -X)

    assert all("You made the trace positive" in text for text in texts("rotation_from_nullvector", by_trace))


def floor(values, factor):
    distance = np.abs(values - np.median(values))
    return distance <= factor * 1.4826 * np.median(distance) + 1e-3


def one_for_none(values, factor):
    distance = np.abs(values - np.median(values))
    return distance <= factor * (1.4826 * np.median(distance) or 1.0)


def few_stay(values, factor):
    return ch06.reject_outliers(values, factor) | (len(values) < 5)


@pytest.mark.parametrize("rule", [floor, one_for_none, few_stay])
def test_the_rule_for_outliers_has_no_floor_and_holds_for_three_values(rule):
    texts("reject_outliers", rule)


@pytest.mark.parametrize("rule", [log.reject_outliers, ch06.reject_outliers])
def test_where_most_values_are_equal_both_readings_of_the_rule_are_right(rule):
    values, factor = ch06.mostly_equal(np.random.default_rng(0))
    assert ch06.KeptOrAll().equal(rule(values, factor), ch06.reject_outliers(values, factor))


def test_a_better_match_beyond_the_largest_offset_does_not_count():
    def anywhere(time, reference, delayed, max_offset):
        return ch06.time_offset(time, reference, delayed, max(max_offset, len(time) // 3 * (time[1] - time[0])))

    texts("time_offset", anywhere)


def test_obtuse_links_and_few_motions_are_drawn():
    def acute(theta, d, a, alpha):
        c, s, sine = np.cos(theta), np.sin(theta), np.sin(alpha)
        cosine = np.sqrt(1 - sine**2)
        turn = [[c, -s * cosine, s * sine, a * c], [s, c * cosine, -c * sine, a * s]]
        return np.array([*turn, [0, sine, cosine, d], [0, 0, 0, 1]])

    texts("dh_matrix", acute)
    texts("singular_value_ratio", lambda M: ch06.singular_value_ratio(M) if len(M) > 18 else 0.0)
    texts("e_trans", lambda r: np.linalg.norm(r) / max(len(r) - 1, 5))


def test_roots_of_eigenvalues_are_right_at_every_check():
    texts("singular_value_ratio", lambda M: np.sqrt(np.divide(*np.linalg.eigvalsh(M.T @ M)[[1, -1]])), CORRECT)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("wide", [False, True])
def test_who_stops_at_whole_samples_is_told_apart_from_who_compares_peaks(sign, wide):
    for seed in range(20):
        time, reference, delayed, most = ch06.speed_curves(np.random.default_rng(seed), sign, wide)
        peaks = time[np.argmax(delayed)] - time[np.argmax(reference)]
        assert abs(peaks - ch06._whole_samples(time, reference, delayed, most)) > 5e-3


@pytest.mark.parametrize("sign", [1, -1])
def test_where_the_largest_offset_is_wide_the_default_finds_another_lag(sign):
    for seed in range(20):
        time, reference, delayed, most = ch06.speed_curves(np.random.default_rng(seed), sign, wide=True)
        found = ch06.time_offset(time, reference, delayed)
        assert abs(found - ch06.time_offset(time, reference, delayed, most)) > 1e-2


@pytest.mark.parametrize("turn", [0.0, 0.802 / 3000])
def test_a_turn_that_hardly_shows_makes_as_much_as_the_noise(turn):
    text = ITEMS["knock"].judge(turn).text
    assert "about 0.014 mm, no more than the noise, not 0.802 mm" in text


def test_a_turn_in_rad_is_known_without_its_digits():
    assert ITEMS["knock"].judge(0.0022).text.startswith("This is in rad.")


def distinct(M):
    s = np.unique(np.linalg.svd(M)[1].round(9))
    return s[1] / s[-1]


def all_of_them(values, factor):
    s = 0 * np.median(np.abs(values - np.median(values)))
    return np.ones(len(values), bool) if s == 0 else np.abs(values - np.median(values)) <= factor * s


def from_one_to_another(order):
    def found(speed, error):
        first, last = order(speed)[[0, -1]]
        return error[first], np.sqrt(abs(error[last] ** 2 - error[first] ** 2)) / speed[last]

    return found


def by_fourier(time, reference, delayed, max_offset):
    step, (a, b) = time[1] - time[0], map(np.fft.fft, (reference, delayed))
    shifts = np.arange(-round(max_offset / step), round(max_offset / step) + 1)
    alike = np.fft.ifft(b * a.conj()).real[shifts]
    k = np.clip(alike.argmax(), 1, len(shifts) - 2)
    left, middle, right = alike[k - 1 : k + 2]
    return (shifts[k] + 0.5 * (left - right) / (left - 2 * middle + right)) * step


def test_motions_from_pose_to_pose_are_told_without_a_word_of_their_size():
    assert "They are shorter" not in ITEMS["mounting"].judge(ch06._from_pose_to_pose()).text


@pytest.mark.parametrize(
    "name, answer, said, unsaid",
    [
        ("singular_value_ratio", distinct, "all motions turn about one axis", "typed in"),
        ("reject_outliers", all_of_them, "every entry of your result is True, on every draw", "were 0"),
        (
            "reject_outliers",
            lambda v, f: ch06.reject_outliers(v, min(f, 1)),
            "You allow one standard deviation",
            "missing",
        ),
        ("static_error_and_lag", from_one_to_another(lambda v: np.arange(len(v))), "error of the first reading", "off"),
        ("static_error_and_lag", from_one_to_another(np.argsort), "error of the slowest reading", "off"),
        ("kron_row", lambda A, B: np.eye(9), "Your block is an orthogonal matrix", "product alone"),
        ("time_offset", by_fourier, "or an FFT. Compare only the part both curves share", "off"),
    ],
)
def test_what_is_told_of_a_wrong_answer_is_true_of_it(name, answer, said, unsaid):
    told = texts(name, answer)
    assert all(said in text and unsaid not in text for text in told), told


def lag_by_squares(time, reference, delayed, max_offset, at_the_end, root=False):
    """The lag by a parabola; `at_the_end` makes its middle of the place of the least cost and of the last place."""
    step, n = time[1] - time[0], len(time)
    most = round(max_offset / step)
    pairs = (
        (reference[max(0, -s) : n - max(0, s)], delayed[max(0, s) : n + min(0, s)]) for s in range(-most, most + 1)
    )
    cost = np.array([np.mean((d - r) ** 2) for r, d in pairs])
    k = at_the_end(int(np.argmin(cost)), 2 * most)
    left, middle, right = (np.sqrt(cost) if root else cost)[[k - 1, k, k + 1]]
    return (k - most + 0.5 * (left - right) / (left - 2 * middle + right)) * step


@pytest.mark.parametrize(
    "at_the_end, root, said",
    [
        (lambda k, last: min(k, last - 1), False, "leads by nearly as much"),
        (lambda k, last: min(max(k, 1), last - 1), True, "the root of the mean of squares as well"),
    ],
)
def test_a_vertex_at_the_end_and_one_of_roots_are_told(at_the_end, root, said):
    told = texts("time_offset", functools.partial(lag_by_squares, at_the_end=at_the_end, root=root))
    assert all(said in text for text in told), told


def test_a_parabola_beyond_the_last_shift_is_none():
    beyond = functools.partial(lag_by_squares, at_the_end=lambda k, last: max(k, 1))
    assert all("lags by nearly as much" in text for text in texts("time_offset", beyond, RAISED))


def test_a_vertex_beyond_the_last_shift_but_one_is_right():
    within = functools.partial(lag_by_squares, at_the_end=lambda k, last: min(max(k, 1), last - 1))
    texts("time_offset", within, CORRECT)


def test_the_total_over_the_root_of_two_is_right_by_chance_alone():
    outcome = ITEMS["halved"].judge(ch06.beyond.budget()[1] / np.sqrt(2))
    assert outcome.status == NOT_YET and "chance" in outcome.text


@pytest.mark.parametrize("part, name", [*enumerate("xyz")])
def test_who_makes_one_part_positive_is_told_which(part, name):
    def mean(q):
        m = (q * np.where(q[:, part] < 0, -1, 1)[:, None]).mean(axis=0)
        return m / np.linalg.norm(m)

    assert all(f"You made {name} positive" in text for text in texts("mean_quaternion", mean))


def test_an_argument_that_is_left_out_is_what_it_is_in_the_cell():
    def keep(values, factor=3.0):
        return ITEMS["reject_outliers"].reference(values, factor)

    assert all("it is 3.0 in yours, in the cell as it was given 4.0" in text for text in texts("reject_outliers", keep))
    holds = ITEMS["time_offset"].properties[0]
    for default, told in ((0.2, None), (0.1, "right, but where `max_offset` is left out it is 0.1 in yours")):
        said = holds(lambda time, reference, delayed, max_offset=default: 0.0, None)
        assert said is told if told is None else said.startswith(told)


def test_a_factor_of_one_and_a_half_is_not_the_constant():
    def keep(values, factor):
        distance = np.abs(values - np.median(values))
        return distance <= factor * 1.5 * np.median(distance)

    texts("reject_outliers", keep)


def test_six_equal_numbers_are_no_heights():
    assert "last row of a pose" in ITEMS["spread"].judge(0.0).text


def is_right_in_one_check(name, answer, seed=0):
    return not any(is_missed(answer, *case) for case in one_check(ITEMS[name], seed))


@pytest.mark.parametrize("fewer, right", [((0, 1), False), ((1, 0), False), ((0, 0), True)])
def test_the_last_shift_is_asked_for_on_either_side(fewer, right):
    def offset(time, reference, delayed, max_offset):
        step = time[1] - time[0]
        n = round(max_offset / step)
        shifts = np.arange(fewer[0] - n, n + 1 - fewer[1])
        cost = [np.mean((delayed[n + s : len(time) - n + s] - reference[n:-n]) ** 2) for s in shifts]
        k = np.clip(np.argmin(cost), 1, len(cost) - 2)
        left, middle, last = cost[k - 1 : k + 2]
        return (shifts[k] + 0.5 * (left - last) / (left - 2 * middle + last)) * step

    assert is_right_in_one_check("time_offset", offset) == right


@pytest.mark.parametrize("seed", range(3))
def test_the_last_samples_need_not_be_compared(seed):
    def offset(time, reference, delayed, max_offset):
        return tracking.time_offset(time[:-2], reference[:-2], delayed[:-2], max_offset)

    assert is_right_in_one_check("time_offset", offset, seed)
