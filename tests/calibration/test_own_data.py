"""The models behind the calibration of one's own data: derivatives by differences, noise beside the plain fit."""

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation

from labkit.calibration import ax_xb, own_data
from labkit.estimation.differences import numeric_jacobian
from labkit.geometry.frames import frame_from_points, invert, pose
from labkit.geometry.lie import exp_so3

T_FS = pose(exp_so3([0.4, -0.2, 0.9]), np.array([40.0, -30.0, 110.0]))
T_BT = pose(exp_so3([-0.3, 0.5, 2.0]), np.array([600.0, 50.0, -100.0]))


def readings(n=12, std_rot=2e-3, std_trans=0.3):
    rng = np.random.default_rng(n)
    T_BF = pose(exp_so3(rng.uniform(-1, 1, (n, 3))), rng.uniform(-200, 200, (n, 3)))
    T_ST = invert(T_FS) @ invert(T_BF) @ T_BT
    T_ST[:, :3, :3] = T_ST[:, :3, :3] @ exp_so3(std_rot * rng.normal(size=(n, 3)))
    T_ST[:, :3, 3] += std_trans * rng.normal(size=(n, 3))
    return T_BF, T_ST


def moved(T, change):
    return pose(T[:3, :3] @ exp_so3(change[:3]), T[:3, 3] + change[3:])


def test_derivative_of_the_hand_eye_readings():
    model = own_data.HandEyeModel(*readings())

    def residuals(change):
        return model.linearize((moved(T_FS, change[:6]), moved(T_BT, change[6:])))[0].ravel()

    numeric = numeric_jacobian(residuals, np.zeros(12), np.array([1e-6] * 3 + [1e-4] * 3 + [1e-6] * 3 + [1e-4] * 3))
    exact = model.linearize((T_FS, T_BT))[1].reshape(-1, 12)
    size = np.linalg.norm(exact, axis=0)
    np.testing.assert_allclose(numeric / size, exact / size, atol=5e-3)  # first order in the noise


def test_noise_of_all_rows_is_that_of_the_plain_fit():
    T_BF, T_ST = readings(5)
    model, plain = own_data.HandEyeModel(T_BF, T_ST), ax_xb.calibrate_hand_eye(T_BF, T_ST)
    r, J = model.linearize((plain.T_FS, plain.T_BT))
    noise = model.noise(r, J, np.ones(5, bool))
    np.testing.assert_allclose(noise.std, plain.std[[0, 3]], rtol=0.05)
    np.testing.assert_allclose(noise.freedom.sum(), 5 * 6 - 12, rtol=1e-9)  # all parameters are paid for


def test_an_error_over_an_estimated_noise_follows_the_law_of_hotelling():
    """Four touches of a tip are a linear problem with f = 12 - 6 degrees of freedom, so NEES f / (f - 2) / 6 follows
    F(6, f) exactly; 800 fixed draws beside it by the test of Kolmogorov and Smirnov, at odds of 1e-6."""
    rng, R, scores = np.random.default_rng(4), exp_so3(np.random.default_rng(3).uniform(-0.7, 0.7, (4, 3))), []
    tip, point = np.array([10.0, -20.0, 150.0]), np.array([500.0, 0.0, 30.0])
    for _ in range(800):
        model = own_data.PivotModel(pose(R, point - R @ tip + 0.1 * rng.normal(size=(4, 3))))
        found, every = model.fitted(np.ones(4, bool)), np.ones(4, bool)
        _, J, noise = model.whitened(found, every)
        e = np.concatenate([found[0] - tip, found[1] - point])
        N = np.einsum("nki,nkj->ij", *2 * [model.widened(J, noise)])
        scores.append(e @ N @ e)
    np.testing.assert_allclose(noise.freedom, 6.0)
    assert stats.kstest(np.array(scores) * 6 / 4 / 6, stats.f(6, 6).cdf).pvalue > 1e-6
    assert stats.kstest(np.array(scores) / 6, stats.f(6, 6).cdf).pvalue < 1e-6  # without the widening it would not


def test_noise_that_is_told_widens_nothing():
    model = own_data.HandEyeModel(*readings(5), std=(2e-3, 0.3))
    solution = model.fitted(np.ones(5, bool))
    _, J, noise = model.whitened(solution, np.ones(5, bool))
    assert np.isinf(noise.freedom).all() and (model.widened(J, noise) == J).all()


# --- the other kinds -------------------------------------------------------------------------------------------------

TIP, PIVOT = np.array([20.0, -35.0, 180.0]), np.array([500.0, 120.0, 60.0])


def pivot_model(n=14, std=0.2):
    rng = np.random.default_rng(n)
    R = exp_so3(rng.uniform(-0.8, 0.8, (n, 3)))
    return own_data.PivotModel(pose(R, PIVOT - R @ TIP + std * rng.normal(size=(n, 3))))


def sphere_model(n=14, std=0.2):
    rng = np.random.default_rng(n)
    T_BF = pose(exp_so3(rng.uniform(-1, 1, (n, 3))), rng.uniform(-200, 200, (n, 3)))
    x_S = (invert(T_BF @ T_FS) @ np.append(PIVOT, 1.0))[:, :3]
    return own_data.SphereModel(T_BF, x_S + std * rng.normal(size=(n, 3)))


def frame_model(n=14, std=0.2):
    rng = np.random.default_rng(n)
    nominal = rng.uniform(-300, 300, (n, 3))
    return own_data.FrameModel(nominal, nominal @ T_BT[:3, :3].T + T_BT[:3, 3] + std * rng.normal(size=(n, 3)))


def hand_eye_model(n=14, std=0.2):
    return own_data.HandEyeModel(*readings(n, 1e-2 * std, std))


def shifted(solution, change):
    """A solution moved by its parameters: a pose takes six (rotation in its own frame first), a point three."""
    out, k = [], 0
    for part in solution:
        size = 6 if part.shape == (4, 4) else 3
        out.append(moved(part, change[k : k + 6]) if size == 6 else part + change[k : k + 3])
        k += size
    return tuple(out)


KINDS = [
    (hand_eye_model, (T_FS, T_BT)),
    (pivot_model, (TIP, PIVOT)),
    (sphere_model, (T_FS, PIVOT)),
    (frame_model, (T_BT,)),
]
each_kind = pytest.mark.parametrize(("make", "truth"), KINDS, ids=["hand-eye", "pivot", "sphere", "frame"])


@each_kind
def test_exact_data_give_the_truth_and_its_derivative(make, truth):
    model = make(std=0.0)
    for found, true in zip(model.fit(np.ones(model.n, bool)), truth):
        np.testing.assert_allclose(found, true, atol=1e-7)
    r, J = model.linearize(truth)
    np.testing.assert_allclose(r, 0, atol=1e-9)
    steps = np.concatenate([[1e-6] * 3 + [1e-3] * 3 if part.shape == (4, 4) else [1e-3] * 3 for part in truth])
    numeric = numeric_jacobian(lambda c: model.linearize(shifted(truth, c))[0].ravel(), np.zeros(len(steps)), steps)
    size = np.linalg.norm(J.reshape(-1, J.shape[2]), axis=0)
    np.testing.assert_allclose(J.reshape(-1, J.shape[2]) / size, numeric / size, atol=1e-7)


@each_kind
@pytest.mark.parametrize("n", [14, 9])
def test_rows_that_disagree_are_left_out(make, truth, n):
    """Rows off by a hundred standard deviations go; at most one in a thousand good ones may (none does here)."""
    model = make(n)
    bad = np.zeros(n, bool)
    bad[[1, 6, 7][: n // 4]] = True
    data = {"HandEyeModel": "T_ST", "PivotModel": "T_WF", "SphereModel": "x_S", "FrameModel": "measured"}
    array = getattr(model, data[type(model).__name__]).copy()
    (array[:, :3, 3] if array.shape[1:] == (4, 4) else array)[bad] += [14.0, -9.0, 11.0]
    rest = {
        "HandEyeModel": lambda: own_data.HandEyeModel(model.T_BF, array),
        "PivotModel": lambda: own_data.PivotModel(array),
        "SphereModel": lambda: own_data.SphereModel(model.T_BF, array),
        "FrameModel": lambda: own_data.FrameModel(model.nominal, array),
    }
    model = rest[type(model).__name__]()
    solution, kept = own_data.majority(model)
    assert kept.tolist() == (~bad).tolist()
    for found, clean in zip(solution, model.fit(~bad)):
        np.testing.assert_allclose(found, clean, rtol=1e-9, atol=1e-9)


def test_no_majority_is_followed_that_is_none():
    rng = np.random.default_rng(3)
    nominal = rng.uniform(-300, 300, (20, 3))
    with pytest.raises(ValueError, match=r"only \d+ of 20 rows agree"):
        own_data.majority(own_data.FrameModel(nominal, rng.uniform(-300, 300, (20, 3)), std=(0.1,)))


@pytest.mark.parametrize(("agree", "followed"), [(10, True), (9, True), (7, False)])
def test_how_many_rows_a_majority_takes(agree, followed):
    """At least 45 % of the rows less one: of 20 rows eight."""
    rng = np.random.default_rng(5)
    nominal = rng.uniform(-300, 300, (20, 3))
    measured = nominal + 0.01 * rng.normal(size=(20, 3))
    measured[agree:] = rng.uniform(-300, 300, (20 - agree, 3))
    model = own_data.FrameModel(nominal, measured, std=(0.01,))
    model.start = lambda: np.arange(20) < agree
    if followed:
        assert own_data.majority(model)[1].tolist() == [True] * agree + [False] * (20 - agree)
    else:
        with pytest.raises(ValueError, match=f"only {agree} of 20 rows"):
            own_data.majority(model)


def candidate(n, solve, misfit):
    """The best candidate of a model that solves and misses like this."""
    model = own_data.Model(n, ())
    model._solve, model._misfit = solve, misfit
    return model.candidate()


@pytest.mark.parametrize(("n", "count"), [(3, 1), (5, 10), (8, 56), (9, 84), (10, 100), (40, 100), (5000, 100)])
def test_three_rows_are_tried_in_every_way_or_a_hundred(n, count):
    tried = []

    def solve(rows):
        tried.append(rows)
        return (rows.astype(float),)

    kept, reached = candidate(n, solve, lambda found, rows: (np.abs(rows - found[0][:, :1] + 0.0),))
    assert tried[0].shape == (count, 3) and all(len(set(row)) == 3 for row in tried[0].tolist())
    assert tried[0].min() >= 0 and tried[0].max() < n and len(np.unique(tried[0], axis=0)) > 0.9 * count
    assert tried[0].max() > 0.9 * (n - 1)
    wanted = max(int(np.ceil(own_data.LEAST_SHARE * n)), min(own_data.LEAST, n))
    assert kept.sum() == wanted
    away = np.abs(np.arange(n) - tried[0][:, :1])  # of each candidate
    explained = np.sort(away, axis=1)[:, wanted - 1] == reached[0]
    assert (explained & (away[:, kept].max(1) == reached[0])).any()


def test_the_misfit_of_a_mounting_is_its_chord_and_its_gap():
    T_BF, T_ST = readings(6, 0.5, 20.0)
    model = own_data.HandEyeModel(T_BF, T_ST)
    X = np.array([T_FS, moved(T_FS, [2.0, 0.5, -1.0, 30.0, 0.0, 9.0])])
    Y = np.array([T_BT, moved(T_BT, [0.1, -2.5, 0.3, 0.0, 50.0, 0.0])])
    angle, gap = model._misfit((X, Y), np.arange(6))
    for i, k in np.ndindex(2, 6):
        closed = T_BF[k] @ X[i] @ T_ST[k]
        turn = Rotation.from_matrix(Y[i, :3, :3].T @ closed[:3, :3]).magnitude()
        assert angle[i, k] == pytest.approx(2 * np.sin(turn / 2), abs=1e-6)
        assert gap[i, k] == pytest.approx(np.linalg.norm(closed[:3, 3] - Y[i, :3, 3]), rel=1e-9)
    assert angle.max() > 1.8  # beyond a right angle too


def test_the_noise_is_what_the_degrees_of_freedom_say():
    model = pivot_model()
    r, J = model.linearize(model.fit(np.ones(14, bool)))
    assert model.noise(r, J, np.ones(14, bool)).std[0] == pytest.approx(np.sqrt((r**2).sum() / (3 * 14 - 6)))
    given = own_data.PivotModel(model.T_WF, (0.7,))
    assert given.noise(r, J, np.ones(14, bool)).std.tolist() == [0.7]
    exact = pivot_model(std=0.0)
    r, J = exact.linearize((TIP, PIVOT))
    assert exact.noise(0 * r, J, np.ones(14, bool)).std[0] == pytest.approx(1e-9 * np.abs(exact.T_WF[:, :3, 3]).max())


# --- what to measure next --------------------------------------------------------------------------------------------


def test_thirty_degrees_about_eighteen_axes():
    turns = Rotation.from_matrix(own_data.turned_both_ways()).as_rotvec(degrees=True)
    np.testing.assert_allclose(np.linalg.norm(turns, axis=1), 30.0)
    axes = np.round(turns / 30.0, 6)
    assert len(np.unique(axes, axis=0)) == 18 and np.abs(axes.sum(0)).max() < 1e-9
    assert sorted(np.unique(np.abs(axes))) == pytest.approx([0.0, np.sqrt(0.5), 1.0], abs=1e-6)


@each_kind
def test_a_proposed_pose_would_see_what_is_there(make, truth):
    model = make(40)
    if make is frame_model:
        with pytest.raises(ValueError, match="a FrameModel knows no poses to measure next"):
            model.proposals(truth)
        return
    poses, J = model.proposals(truth)
    assert len(poses) == 18 * 20 and J.shape[0] == len(poses)
    if make is pivot_model:
        r, same = own_data.PivotModel(poses).linearize(truth)
        np.testing.assert_allclose(r, 0, atol=1e-9)
        np.testing.assert_allclose(J, same)
        turn = np.swapaxes(model.T_WF[::2, :3, :3], 1, 2)[:, None] @ poses[:, :3, :3].reshape(20, 18, 3, 3)
    else:
        T_ST = invert(poses @ truth[0])
        target = T_ST @ truth[1] if truth[1].shape == (4, 4) else (T_ST @ np.append(truth[1], 1.0))[:, :3]
        seen = model.T_ST[::2] if truth[1].shape == (4, 4) else model.x_S[::2]
        point = (lambda T: T[..., :3, 3]) if truth[1].shape == (4, 4) else (lambda x: x)
        np.testing.assert_allclose(point(target).reshape(20, 18, 3), np.repeat(point(seen)[:, None], 18, 1), atol=1e-9)
        flange = np.swapaxes(poses[:, :3, :3].reshape(20, 18, 3, 3), 2, 3)
        if truth[1].shape == (4, 4):
            turn = target[:, :3, :3].reshape(20, 18, 3, 3) @ np.swapaxes(seen[:, :3, :3], 1, 2)[:, None]
        else:
            turn = flange @ model.T_BF[::2, None, :3, :3]
    np.testing.assert_allclose(np.trace(turn, axis1=2, axis2=3), 1 + 2 * np.cos(np.deg2rad(30)), atol=1e-9)


@each_kind
def test_the_next_pose_is_the_one_that_helps_most(make, truth):
    """Beside the inverse of the information with each candidate in turn."""
    if make is frame_model:
        return
    model = make(8)
    kept = np.arange(8) != 3
    poses, course = own_data.next_poses(model, truth, kept, count=2)
    _, J, noise = model.whitened(truth, kept)
    candidates, C = model.proposals(truth)
    J, C = model.widened(J, noise), model.widened(C / np.repeat(noise.std, model.channels)[:, None], noise)
    N = np.einsum("nkp,nkq->pq", J[kept], J[kept])
    np.testing.assert_allclose(course[0], np.sqrt(np.diag(np.linalg.inv(N)))[:6], rtol=1e-6)
    for k in range(2):
        now = np.diag(np.linalg.inv(N))[:6]
        after = np.array([np.diag(np.linalg.inv(N + c.T @ c))[:6] for c in C])
        gain = ((now - after) / np.diag(np.linalg.inv(np.einsum("nkp,nkq->pq", J[kept], J[kept])))[:6]).sum(1)
        best = int(np.flatnonzero((candidates == poses[k]).all((1, 2)))[0])
        assert gain[best] >= gain.max() * (1 - 1e-6)
        N = N + C[best].T @ C[best]
        np.testing.assert_allclose(course[k + 1], np.sqrt(np.diag(np.linalg.inv(N)))[:6], rtol=1e-5)


def test_the_covariance_of_three_points_is_carried_through():
    points = np.array([[10.0, 20.0, -5.0], [210.0, 60.0, 15.0], [40.0, 170.0, 60.0]])
    T, cov = own_data.three_point_frame(points, 0.3)
    np.testing.assert_allclose(T, frame_from_points(*points))

    def change(x):
        other = frame_from_points(*x.reshape(3, 3))
        return np.concatenate([Rotation.from_matrix(T[:3, :3].T @ other[:3, :3]).as_rotvec(), other[:3, 3] - T[:3, 3]])

    J = numeric_jacobian(change, points.ravel(), np.full(9, 1e-3))
    np.testing.assert_allclose(cov, 0.09 * J @ J.T, rtol=1e-4, atol=1e-9)
    assert own_data.three_point_frame(points, None)[1] is None


@each_kind
def test_the_size_of_a_channel_is_the_largest_length_in_it(make, truth):
    """Residuals are nothing beside a billionth of it."""
    model, largest = make(), {"T_BF": 0.0, "T_WF": 0.0, "T_ST": 0.0, "x_S": 0.0, "measured": 0.0}
    for name in largest:
        array = getattr(model, name, None)
        if array is not None:
            largest[name] = np.abs(array[:, :3, 3] if array.shape[1:] == (4, 4) else array).max()
    assert model.size(len(model.channels) - 1) == pytest.approx(sum(largest.values()))
    assert len(model.channels) == 1 or model.size(0) == 1.0


def test_the_distance_allowed_counts_the_numbers_left_over(monkeypatch):
    """12 rows of 6 numbers less 12 parameters where the noise is estimated, and no end of them where it is given."""
    asked, real = [], own_data.distance_limit
    monkeypatch.setattr(own_data, "distance_limit", lambda k, dof: asked.append((k, dof)) or real(k, dof))
    own_data.majority(own_data.HandEyeModel(*readings()))
    assert asked[-1] == (6, 12 * 6 - 12)
    own_data.majority(own_data.HandEyeModel(*readings(), std=(2e-3, 0.3)))
    assert asked[-1][1] >= 10**5


def test_a_row_may_be_wrong_in_the_smaller_channel_alone():
    """Angles of thousandths beside lengths of ones: each channel counts in units of what the majority reaches."""
    turns, lengths = 1e-3 * np.linspace(0.5, 1.0, 12), np.linspace(1.0, 0.5, 12)
    turns[4], lengths[9] = 0.1, 90.0
    kept, reached = candidate(
        12,
        lambda rows: (np.zeros((len(rows), 1)),),
        lambda solutions, rows: (
            np.broadcast_to(turns[rows], (len(solutions[0]), len(rows))),
            np.broadcast_to(lengths[rows], (len(solutions[0]), len(rows))),
        ),
    )
    assert not kept[4] and not kept[9] and 5e-4 < reached[0] < 1e-3 and 0.5 < reached[1] < 1.0


@pytest.mark.parametrize("n", [12, 32, 33])
def test_proposals_turn_every_so_many_row_both_ways_about_all_axes(n):
    """18 turns of each of the rows 0, n // 16, 2 (n // 16), ..., each of which still sees what the model says."""
    T_BF, T_ST = readings(n)
    x_S = T_ST[:, :3, 3]
    center = (T_BF @ T_FS @ np.concatenate([x_S, np.ones((n, 1))], axis=1)[..., None])[:, :3, 0].mean(0)
    rows = np.arange(0, n, max(n // 16, 1))
    poses, J = own_data.SphereModel(T_BF, x_S).proposals((T_FS, center))
    assert poses.shape == (18 * len(rows), 4, 4) and J.shape == (18 * len(rows), 3, 9)
    seen = np.repeat(x_S[rows], 18, axis=0)
    np.testing.assert_allclose(
        (poses @ T_FS @ np.concatenate([seen, np.ones((len(seen), 1))], axis=1)[..., None])[:, :3, 0],
        np.broadcast_to(center, (len(seen), 3)),
        atol=1e-9,
    )
    assert len(own_data.PivotModel(T_BF).proposals((np.ones(3), center))[0]) == 18 * len(rows)
    assert len(own_data.HandEyeModel(T_BF, T_ST).proposals((T_FS, T_BT))[0]) == 18 * len(rows)


def test_three_points_on_a_line_give_way_to_the_widest_triangle(monkeypatch):
    nominal = np.array(
        [[500.0, 400, 300], [510, 400, 300], [520, 400, 300], [500, 430, 300], [500, 400, 320], [530, 0, 0]]
    )
    T = pose(exp_so3([0.2, 0.1, -0.4]), np.array([10.0, 20.0, 30.0]))
    model = own_data.FrameModel(nominal, nominal @ T[:3, :3].T + T[:3, 3])
    rows = np.array([[0, 1, 2], [0, 3, 4], [0, 3, 5]])  # a line, a triangle, the widest
    asked, real = [], own_data.fit_frame
    monkeypatch.setattr(own_data, "fit_frame", lambda a, b: asked.append(a) or real(a, b))
    model._solve(rows)
    np.testing.assert_array_equal(asked[0], nominal[[[0, 3, 5], [0, 3, 4], [0, 3, 5]]])


def test_one_wrong_point_of_five_is_left_out_though_the_search_begins_with_all():
    """Fewer than six points are not searched for a start: the first fit holds them all, and its distances tell."""
    rng = np.random.default_rng(5)
    nominal = rng.uniform(-300, 300, (5, 3))
    T = pose(exp_so3([0.2, 0.1, -0.4]), np.array([10.0, 20.0, 30.0]))
    measured = nominal @ T[:3, :3].T + T[:3, 3] + 0.02 * rng.normal(size=(5, 3))
    measured[3] += [0.0, 0.9, 0.0]  # nine standard deviations
    model = own_data.FrameModel(nominal, measured, std=(0.1,))
    assert model.start().all()
    solution, kept = own_data.majority(model)
    assert kept.tolist() == [True, True, True, False, True]
    np.testing.assert_allclose(solution[0], own_data.fit_frame(nominal[kept], measured[kept]))


@pytest.mark.parametrize(("explained", "wins"), [(8, False), (9, True)])
def test_a_candidate_is_judged_at_the_row_that_closes_the_required_share(explained, wins):
    """Of 20 rows nine: one candidate explains some exactly and no others, the rest explain all of them alike."""

    def misfit(found, rows):
        one = np.where(rows < explained, 0.0, 10.0)
        return (np.where(found[0][:, :1] == 0, one, 1.0),)

    kept, reached = candidate(20, lambda rows: (np.arange(len(rows))[:, None].astype(float),), misfit)
    assert reached == ((0.0,) if wins else (1.0,)) and kept.sum() == 9
    assert (kept == (np.arange(20) < 9)).all() or not wins


def test_rows_are_explained_by_the_squares_of_all_their_misfits():
    """Two channels of unlike size; the nine rows with the least sum, each in units of what the ninth reaches."""
    rng = np.random.default_rng(4)
    parts = rng.uniform(0.1, 1, 20), 1e4 * rng.uniform(0.1, 1, 20)

    def misfit(found, rows):
        return tuple(np.tile(part[rows], (len(found[0]), 1)) for part in parts)

    kept, reached = candidate(20, lambda rows: (rows.astype(float),), misfit)
    np.testing.assert_allclose(reached, [np.sort(part)[8] for part in parts])
    total = sum((part / limit) ** 2 for part, limit in zip(parts, reached))
    assert kept.tolist() == (total <= np.sort(total)[8]).tolist()


@pytest.mark.parametrize("unit", [1e-4, 1.0, 1e4])
def test_three_points_in_a_row_propose_no_frame_whatever_the_unit(unit):
    """A grid of three times three points, two of them measured wrong: many triples lie on a line."""
    nominal = unit * np.array([[0.1 * i, 0.1 * j, 0.0] for i in range(3) for j in range(3)])
    measured = nominal @ T_BT[:3, :3].T + unit * np.array([1.0, 2.0, 3.0])
    measured[[2, 4]] += 0.5 * unit
    solution, kept = own_data.majority(own_data.FrameModel(nominal, measured))
    assert np.flatnonzero(~kept).tolist() == [2, 4]
    np.testing.assert_allclose(solution[0][:3, :3], T_BT[:3, :3], atol=1e-7)
