"""The sphere's hand-eye calibration from sums equals the readable one."""

import numpy as np
import pytest

from labkit.calibration import hand_eye as readable
from labkit.calibration.planning import poses_that_see
from labkit.fast import hand_eye as fast
from labkit.geometry import frames
from labkit.geometry.lie import exp_so3, nearest_rotation, skew

T_FS = frames.pose(exp_so3([0.3, -0.5, 1.1]), np.array([30.0, -20.0, 120.0]))
TARGET = np.array([700.0, 80.0, -150.0])


def scene(n, std=0.0, seed=0, turn=1.0):
    rng = np.random.default_rng([n, seed])
    T_BF = frames.pose(exp_so3(turn * rng.uniform(-1, 1, (n, 3))), rng.uniform(-200, 200, (n, 3)))
    x_S = frames.transform(frames.invert(T_FS), frames.transform(frames.invert(T_BF), TARGET))
    return T_BF, x_S + std * rng.normal(size=x_S.shape)


def flat(n=12):
    """All spheres in one plane of the scanner, where the linear start says nothing."""
    rng = np.random.default_rng(5)
    x_S = np.column_stack([rng.uniform(-20, 20, n), rng.uniform(-15, 15, n), np.full(n, 240.0)])
    return poses_that_see(T_FS, TARGET, exp_so3(rng.uniform(-1, 1, (n, 3))), x_S), x_S


def assert_same(one, two, atol=1e-6):
    np.testing.assert_allclose(two.T_FS, one.T_FS, atol=atol)
    np.testing.assert_allclose(two.target, one.target, atol=atol)
    np.testing.assert_allclose(two.weights, one.weights, atol=1e-4)
    np.testing.assert_allclose(two.rms, one.rms, rtol=1e-6, atol=1e-3 * atol)
    size = np.sqrt(np.diagonal(one.covariance))
    np.testing.assert_allclose(two.covariance / np.outer(size, size), one.covariance / np.outer(size, size), atol=1e-3)


@pytest.mark.parametrize("n", [6, 31, 200])
@pytest.mark.parametrize("std", [0.1, 1.0])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_random_poses_give_the_same_result(n, std, dtype):
    T_BF, x_S = (a.astype(dtype) for a in scene(n, std))
    atol = 1e-6 if dtype == np.float64 else 2e-4  # the sums take R'R = I for granted: 1e-7 on an arm of 1000 mm
    assert_same(readable.calibrate_sphere_target(T_BF, x_S), fast.calibrate_sphere_target(T_BF, x_S), atol)


@pytest.mark.parametrize("n", [3, 31])
def test_a_known_target_gives_the_same_result(n):
    T_BF, x_S = scene(n, 0.5)
    one, two = (m.calibrate_sphere_target(T_BF, x_S, TARGET) for m in (readable, fast))
    assert_same(one, two, atol=1e-9)
    assert two.covariance.shape == (6, 6)


def test_outliers_get_the_same_weights():
    T_BF, x_S = scene(31, 0.1)
    x_S[::4] += 80.0 * np.random.default_rng(1).normal(size=x_S[::4].shape)
    one, two = (m.calibrate_sphere_target(T_BF, x_S, robust=True) for m in (readable, fast))
    assert_same(one, two)
    assert (two.weights[::4] == 0).all()


@pytest.mark.parametrize("data", [scene(4), flat(), flat(5)], ids=["four poses", "flat", "flat, five poses"])
def test_where_the_linear_start_fails_both_find_the_same(data):
    one, two = (m.calibrate_sphere_target(*data) for m in (readable, fast))
    np.testing.assert_allclose(one.T_FS, T_FS, atol=1e-6)
    np.testing.assert_allclose(two.T_FS, one.T_FS, atol=1e-6)


def nearly_one_axis(tilt, turn=1.0):
    rng = np.random.default_rng(3)
    turns = np.column_stack([tilt * rng.normal(size=(9, 2)), turn * rng.uniform(-1, 1, 9)])
    T_BF = frames.pose(exp_so3(turns), rng.uniform(-200, 200, (9, 3)))
    return T_BF, frames.transform(frames.invert(T_FS), frames.transform(frames.invert(T_BF), TARGET))


@pytest.mark.parametrize("tilt", [3e-3, 1e-2, 0.1])
def test_nearly_one_axis_gives_the_same_scanner(tilt):
    one, two = (m.calibrate_sphere_target(*nearly_one_axis(tilt)) for m in (readable, fast))
    np.testing.assert_allclose(two.T_FS, one.T_FS, atol=1e-8 / tilt**2)


def still(spread):
    rng = np.random.default_rng(0)
    x_S = np.array([3.0, 5.0, 240.0]) + rng.normal(size=(9, 1)) * np.array(spread)
    return poses_that_see(T_FS, TARGET, exp_so3(rng.uniform(-1, 1, (9, 3))), x_S), x_S


@pytest.mark.parametrize(
    "data, words",
    [
        (scene(8, turn=0.0), "only translate"),
        (nearly_one_axis(0.0), r"one axis, \(0.000, 0.000, 1.000\) in the base"),
        (nearly_one_axis(3e-4), "one axis"),
        (nearly_one_axis(4e-4, turn=0.03), "one axis"),
        (still((0, 0, 0)), "at one place"),
        (still((0, 0, 30)), "on one line"),
        ((scene(6)[0], scene(5)[1]), r"\(N, 4, 4\) and \(N, 3\)"),
        ((scene(3)[0], scene(3)[1]), "at least 4 poses"),
    ],
)
def test_both_refuse_with_the_same_words(data, words):
    found = []
    for module in (readable, fast):
        with pytest.raises(ValueError, match=words) as refused:
            module.calibrate_sphere_target(*data)
        found.append(str(refused.value))
    assert found[0] == found[1]


def test_the_history_ends_with_the_rms_of_the_result():
    T_BF, x_S = scene(12, std=0.5)
    for room in (readable, fast):
        result = room.calibrate_sphere_target(T_BF, x_S)
        assert result.history[-1] == pytest.approx(result.rms, rel=1e-6)
        assert (np.diff(result.history) <= 1e-9).all()


def test_ordinary_poses_need_no_closer_look(monkeypatch):
    def refuse(*_):
        raise AssertionError("a closer look")

    monkeypatch.setattr(fast, "refuse_undetermined", refuse)
    for n, turn in ((6, 1.0), (31, 0.3), (31, 1.0), (200, 1.0)):
        fast.calibrate_sphere_target(*scene(n, 0.1, turn=turn))
        fast.calibrate_sphere_target(*scene(n, 0.1, turn=0.01), TARGET)  # a known target needs no turning


@pytest.mark.parametrize("tilt", np.geomspace(3e-4, 3e-2, 9))
@pytest.mark.parametrize("turn", [0.03, 0.3, 1.0])
def test_what_is_cleared_at_a_glance_is_not_refused_by_a_closer_look(tilt, turn):
    """Turns about one axis and ever less about a second: the sums clear them later than the eigenvalues do."""
    T_BF, x_S = nearly_one_axis(tilt, turn)
    weights = np.ones(len(T_BF))
    mean, G, total = fast._moments(T_BF[:, :3, :3], T_BF[:, :3, 3], x_S, weights, None)
    cleared = fast._is_clearly_determined(mean, G, total, None)
    try:
        readable.refuse_undetermined(T_BF, x_S, weights, False)
        assert cleared or tilt < 0.02
    except ValueError:
        assert not cleared


def quadratic(seed, std=0.5, n=9):
    """S and h of the cost r'Sr - 2 h'r of a scene, and its best rotation."""
    T_BF, x_S = scene(n, std, seed)
    mean, G, _ = fast._moments(T_BF[:, :3, :3], T_BF[:, :3, 3], x_S, np.ones(n), None)
    S, h = fast._reduce(mean, G)[:2]
    return S, h, readable.calibrate_sphere_target(T_BF, x_S).T_FS[:3, :3]


def one_step(S, h, R):
    """What a step of the descent should be, derivatives from differences: rotation, costs, how often it is halved."""

    def cost(phi, Q):
        q = (exp_so3(phi) @ Q).ravel()
        return q @ S @ q - 2 * h @ q

    def slopes(Q):
        return np.array([cost(d, Q) - cost(-d, Q) for d in 1e-5 * np.eye(3)]) / 2e-5

    e, halved = 1e-3 * np.eye(3), 0
    H = np.array([[cost(a + b, R) - cost(a - b, R) - cost(b - a, R) + cost(-a - b, R) for a in e] for b in e]) / 4e-6
    step = -np.linalg.solve(H, slopes(R))
    if slopes(R) @ step > 0:
        turned = np.array([(skew(a) @ R).ravel() for a in np.eye(3)])
        step = -np.linalg.solve(2 * turned @ S @ turned.T, slopes(R))
    step *= min(1.0, 1 / np.linalg.norm(step))
    while cost(step, R) > cost(np.zeros(3), R):
        step, halved = step / 2, halved + 1
    after, costs = exp_so3(step) @ R, [cost(np.zeros(3), R), cost(step, R)]
    if np.linalg.norm(step) < 1e-2:
        again = -np.linalg.solve(H, slopes(after))
        costs.append(cost(again, after))
        after = exp_so3(again) @ after
    return after, costs, halved


def check_step(S, h, R):
    expected, expected_costs, halved = one_step(S, h, R)
    found, costs = fast._descend(S, h, R, 1)
    np.testing.assert_allclose(found, expected, atol=2e-4)
    np.testing.assert_allclose(costs, expected_costs, rtol=1e-3, atol=1e-6 * abs(expected_costs[0]))
    return halved


def test_a_step_that_would_raise_the_cost_is_halved_until_it_does_not():
    """Costs of no scene, ever flatter along nine directions; one step is halved twice, three others once."""
    halved = []
    for seed, skipped in ((3, 0), (3, 4), (21, 2), (30, 2)):
        rng = np.random.default_rng(seed)
        A = rng.normal(size=(9, 9)) * np.geomspace(1, 1e-2, 9)
        S, h = A @ A.T, rng.normal(size=9)
        for _ in range(skipped + 1):
            axis = rng.normal(size=3)
            R = exp_so3(rng.uniform(0, 3.1) * axis / np.linalg.norm(axis))
        halved.append(check_step(S, h, R))
    assert halved == [2, 1, 1, 1]


@pytest.mark.parametrize("seed", [0, 1, 7])
def test_a_step_of_the_descent_is_newton_s_or_gauss_newton_s_of_length_one_at_most(seed):
    """From beside the minimum, where one more step follows, to the other side, where Newton's points uphill."""
    (S, h, best), rng = quadratic(seed), np.random.default_rng(seed)
    for off in (1e-4, 3e-3, 0.02, 0.4, *np.linspace(1, 3.1, 22)):
        axis = rng.normal(size=3)
        R = exp_so3(off * axis / np.linalg.norm(axis)) @ best
        check_step(S, h, R)


def test_the_descent_ends_when_the_next_step_would_be_nothing():
    S, h, best = quadratic(0)
    found, costs = fast._descend(S, h, exp_so3([0.02, -0.03, 0.01]) @ best, 50)
    np.testing.assert_allclose(found, best, atol=1e-8)
    assert 3 <= len(costs) <= 7 and len(fast._descend(S, h, found, 50)[1]) == 2  # one step below 1e-7, and no more


def test_the_start_is_next_to_the_free_minimum_or_one_of_24(monkeypatch):
    S, h, _ = quadratic(1)
    free = np.linalg.solve(S, h).reshape(3, 3)
    np.testing.assert_allclose(fast._rotation_start(S, h), nearest_rotation(free), atol=1e-8)
    tried = []
    monkeypatch.setattr(fast, "right_angled", lambda: tried.append(1) or readable.right_angled()[:2])
    T_BF, x_S = flat()
    for unit in (1e-3, 1.0, 1e3):
        T = T_BF.copy()
        T[:, :3, 3] *= unit
        mean, G, _ = fast._moments(T[:, :3, :3], T[:, :3, 3], unit * x_S, np.ones(len(T)), None)
        fast._rotation_start(*fast._reduce(mean, G)[:2])
    assert len(tried) == 3


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize(
    ("along", "across", "cleared"),
    [(30.0, 0.8e-5, False), (30.0, 1.3e-5, True), (2e-9 * 240, 1.0, False), (8e-9 * 240, 1.0, True)],
)
def test_places_are_cleared_at_a_glance_beside_their_spread_and_their_distance(unit, along, across, cleared):
    """Across a line by a hundred thousandth of it; about one place by 4e-9 of the distance."""
    rng = np.random.default_rng(8)
    shape = np.linalg.qr(rng.normal(size=(9, 3)) - rng.normal(size=(9, 3)).mean(0))[0]
    shape -= shape.mean(0)
    shape = np.linalg.qr(shape)[0] * along * [1.0, across, across if across == 1.0 else 0.0]
    x_S = unit * (np.array([0.0, 0.0, 240.0]) / 3 * 3**0.5 + shape * 3 / 3**0.5)
    T_BF = scene(9)[0]
    mean, G, total = fast._moments(T_BF[:, :3, :3], unit * T_BF[:, :3, 3], x_S, np.ones(9), TARGET)
    assert fast._is_clearly_determined(mean, G, total, TARGET) == cleared


@pytest.mark.parametrize(("share", "cleared"), [(0.9, False), (1.1, True)])
def test_turns_are_cleared_by_a_bound_on_the_least_eigenvalue(share, cleared):
    """det = a b c is at most a (b + c)^2 / 4, so that a is at least 4 det / trace^2."""
    n = 9

    def bound(tilt):
        T_BF, x_S = nearly_one_axis(tilt)
        mean, G, total = fast._moments(T_BF[:, :3, :3], T_BF[:, :3, 3], x_S, np.ones(n), None)
        values = np.linalg.eigvalsh(fast._turning(G))
        lower = 4 * values.prod() / values.sum() ** 2
        assert 0 < lower <= values[0]
        return lower / (2 * n * fast.MIN_TURN**2), fast._is_clearly_determined(mean, G, total, None)

    low, high = 1e-4, 1e-1
    for _ in range(60):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if bound(middle)[0] < share else (low, middle)
    assert bound(high)[0] == pytest.approx(share, rel=1e-3) and bound(high)[1] == cleared
