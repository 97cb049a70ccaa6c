"""The loop of chapter 2 against closed forms, Monte Carlo and the printed sheet."""

import importlib.util
from math import factorial

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from labkit.documents.lab_sheet import printed as lab_sheet
from labkit.geometry import chaining
from labkit.geometry.frames import pose, relative, rotation_angle
from labkit.geometry.lie import exp_se3, exp_so3, log_se3
from labkit.tables import DATA


def random_links(rng, n, reach=200.0):
    return exp_se3(np.concatenate([rng.normal(size=(n, 3)), reach * rng.normal(size=(n, 3))], axis=-1))


def closed_loop(rng, n):
    links = random_links(rng, n - 1)
    return np.concatenate([links, relative(chaining.chain(links), np.eye(4))[None]])


def test_points_file_is_what_its_script_writes():
    path = DATA / "chaining" / "make_points.py"
    spec = importlib.util.spec_from_file_location("make_points", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    written = [line.split(",") for line in (DATA / "chaining" / "points.csv").read_text().splitlines()]
    made = [line.split(",") for line in module.lines()]
    assert [row[:3] for row in made] == [row[:3] for row in written]
    np.testing.assert_allclose(
        np.array([row[3:] for row in made[1:]], float), np.array([row[3:] for row in written[1:]], float), atol=1e-5
    )


def test_synthetic_points_round_to_the_printed_transforms_and_product():
    T = chaining.transforms_from_points(lab_sheet.station_points())
    assert np.abs(T - lab_sheet.printed_transforms()).max() < lab_sheet.HALF_DIGIT
    assert np.abs(chaining.chain(T) - lab_sheet.printed_product()).max() < lab_sheet.HALF_DIGIT


def test_chain_multiplies_in_order_and_broadcasts():
    rng = np.random.default_rng(1)
    A, B, C = random_links(rng, 3)
    np.testing.assert_allclose(chaining.chain([A, B, C]), A @ B @ C)
    stack = random_links(rng, 15).reshape(3, 5, 4, 4)
    np.testing.assert_allclose(chaining.chain(stack)[2], stack[0, 2] @ stack[1, 2] @ stack[2, 2])
    np.testing.assert_allclose(chaining.chain([A, stack[0]])[3], A @ stack[0, 3])
    assert chaining.stations(stack).shape == (4, 5, 4, 4)
    np.testing.assert_allclose(chaining.stations([A, B, C])[-1], chaining.chain([A, B, C]))


def test_closure_error_is_the_angle_and_the_distance():
    turn = pose(Rotation.from_rotvec([0, 0.3, 0]).as_matrix(), [3.0, 0.0, 4.0])
    angle, distance = chaining.closure_error(turn)
    assert angle == pytest.approx(0.3) and distance == pytest.approx(5.0)
    assert chaining.displacement(turn, [0, 0, 0]) == pytest.approx(5.0)
    lever = pose(Rotation.from_rotvec([0, 0, 0.01]).as_matrix(), np.zeros(3))
    assert chaining.displacement(lever, [200, 0, 5]) == pytest.approx(200 * 2 * np.sin(0.005))


def test_orthonormalize_finds_the_nearest_rotation():
    rng = np.random.default_rng(2)
    T = random_links(rng, 20)
    sheared = T.copy()
    sheared[:, :3, :3] += 0.05 * rng.normal(size=(20, 3, 3))
    repaired = chaining.orthonormalize(sheared)
    assert chaining.orthonormality_error(repaired).max() < 1e-14 < chaining.orthonormality_error(sheared).min()
    np.testing.assert_allclose(np.linalg.det(repaired[:, :3, :3]), 1)
    np.testing.assert_array_equal(repaired[:, :, 3], sheared[:, :, 3])
    best = np.linalg.norm(repaired - sheared, axis=(1, 2))
    for _ in range(50):  # no rotation nearby is nearer
        turned = repaired.copy()
        turned[:, :3, :3] = turned[:, :3, :3] @ Rotation.from_rotvec(0.01 * rng.normal(size=3)).as_matrix()
        assert (np.linalg.norm(turned - sheared, axis=(1, 2)) > best).all()
    with pytest.raises(ValueError, match="right-handed"):
        chaining.orthonormalize(np.diag([1.0, 1.0, -1.0, 1.0]))


def test_the_orthonormality_error_is_that_of_the_worst_entry():
    T = np.tile(np.eye(4), (2, 1, 1))
    T[0, 0, 0], T[1, 1, 2] = 1.01, -0.02  # one column too long; one that leans
    np.testing.assert_allclose(chaining.orthonormality_error(T), [1.01**2 - 1, 0.02], rtol=1e-12)


def test_rounding_bound_holds_and_is_reached():
    rng = np.random.default_rng(3)
    links, half = lab_sheet.printed_transforms(), 1e-4
    bound, product = chaining.rounding_bound(links, half), chaining.chain(links)
    worst = np.zeros((4, 4))
    for _ in range(2000):
        wrong = links.copy()
        wrong[:, :3] += half * rng.choice([-1.0, 1.0], size=(4, 3, 4))
        worst = np.maximum(worst, np.abs(np.linalg.multi_dot(wrong) - product))
    assert (worst[:3] <= bound[:3] * 1.001).all() and not bound[3].any()
    assert worst[:3].min() > 0 and (worst[:3] / bound[:3]).min() > 0.4
    signs = np.sign(links[0] @ links[1] @ links[2])[
        0, :3
    ]  # the signs that push entry (0, 3) furthest through the last link
    last = links.copy()
    last[3, :3, 3] += half * signs
    assert np.linalg.multi_dot(last)[0, 3] - product[0, 3] == pytest.approx(
        half * np.abs((links[0] @ links[1] @ links[2])[0, :3]).sum()
    )


@pytest.mark.parametrize("n", [2, 3, 5, 12])
def test_distribution_closes_the_loop_and_gives_each_link_its_share(n):
    rng = np.random.default_rng(n)
    links = closed_loop(rng, n) @ exp_se3(0.02 * rng.normal(size=(n, 6)) * [1, 1, 1, 50, 50, 50])
    twist = log_se3(chaining.chain(links))
    shares = rng.uniform(0, 1, n)
    for given, expected in ((None, np.full(n, 1 / n)), (shares, shares / shares.sum())):
        corrected = chaining.distribute_closure(links, given)
        np.testing.assert_allclose(chaining.chain(corrected), np.eye(4), atol=1e-10)
        np.testing.assert_allclose(
            rotation_angle(relative(links, corrected)), expected * np.linalg.norm(twist[:3]), atol=1e-9
        )
        before, after = chaining.stations(links)[:-1], chaining.stations(corrected)
        seen = before @ corrected @ relative(links, np.eye(4)) @ relative(before, np.eye(4))
        np.testing.assert_allclose(log_se3(seen), -expected[:, None] * twist, atol=1e-8)
        np.testing.assert_allclose(after[-1], np.eye(4), atol=1e-10)


def test_distribution_refuses_what_has_no_answer():
    half_turn = np.diag([-1.0, -1.0, 1.0, 1.0])
    with pytest.raises(ValueError, match="half a turn"):
        chaining.distribute_closure([half_turn, np.eye(4)])
    with pytest.raises(ValueError, match="none negative"):
        chaining.distribute_closure([np.eye(4), np.eye(4)], [2, -1])
    with pytest.raises(ValueError, match="last axis|shape"):
        chaining.distribute_closure([np.eye(4), np.eye(4)], [1, 1, 1])


@pytest.mark.parametrize(
    "links",
    [
        chaining.straight_chain(6, 300.0),
        chaining.polygon_loop(9, 800.0),
        chaining.orthonormalize(lab_sheet.printed_transforms()),
    ],
)
def test_expected_closure_agrees_with_simulation(links):
    rng, std_rot, std_trans, runs = np.random.default_rng(4), 1e-3, 0.2, 4000
    product = chaining.chain(chaining.noisy_links(links, std_rot, std_trans, rng, runs))
    error = relative(chaining.chain(links), product)
    angle, distance = chaining.closure_error(error)
    found = np.sqrt(np.mean(angle**2)), np.sqrt(np.mean(distance**2))
    np.testing.assert_allclose(found, chaining.expected_closure(links, std_rot, std_trans), rtol=0.03)


def test_height_of_a_row_is_the_sum_over_its_levers():
    levers = [300.0 * np.arange(k) for k in range(6)]  # from the ends of the links before
    expected = [np.sqrt(k * 0.1**2 + 0.002**2 * np.sum(lever**2)) for k, lever in enumerate(levers)]
    np.testing.assert_allclose(chaining.expected_heights(chaining.straight_chain(5, 300.0), 0.002, 0.1), expected)


def test_expected_heights_of_a_chain_in_space_agree_with_simulation():
    rng, std_rot, std_trans, runs = np.random.default_rng(5), 1e-3, 0.2, 4000
    links = exp_se3(rng.normal(size=(7, 6)) * np.repeat([0.8, 200.0], 3))
    noisy = chaining.stations(chaining.noisy_links(links, std_rot, std_trans, rng, runs))
    off = noisy[..., 2, 3] - chaining.stations(links)[:, None, 2, 3]
    np.testing.assert_allclose(
        np.sqrt((off**2).mean(1)), chaining.expected_heights(links, std_rot, std_trans), rtol=0.06
    )


def test_growth_has_the_derived_exponents():
    lengths = np.array([100, 200])
    straight = [chaining.expected_closure(chaining.straight_chain(n, 100.0), 1e-3, 0.0)[1] for n in lengths]
    loops = [chaining.expected_closure(chaining.polygon_loop(n, 500.0), 1e-3, 0.0)[1] for n in lengths]
    assert np.log2(straight[1] / straight[0]) == pytest.approx(1.5, abs=0.01)
    assert np.log2(loops[1] / loops[0]) == pytest.approx(0.5, abs=0.01)


def test_polygon_closes():
    for n in (1, 2, 7):
        np.testing.assert_allclose(chaining.chain(chaining.polygon_loop(n, 300.0)), np.eye(4), atol=1e-12)


def two_loops():
    """Six frames, two squares that share an edge: edges and true links."""
    rng = np.random.default_rng(5)
    corners = np.array([[0, 0, 0], [400, 0, 0], [400, 300, 0], [0, 300, 0], [800, 0, 0], [800, 300, 0.0]])
    poses = pose(Rotation.from_rotvec(np.vstack([np.zeros(3), rng.normal(size=(5, 3))])).as_matrix(), corners)
    edges = np.array([(0, 1), (1, 2), (2, 3), (3, 0), (1, 4), (4, 5), (5, 2)])
    return edges, poses, relative(poses[edges[:, 0]], poses[edges[:, 1]])


def test_pose_graph_recovers_exact_links_and_is_consistent():
    edges, poses, links = two_loops()
    exact = chaining.solve_pose_graph(edges, links, 1e-3, 0.2)
    np.testing.assert_allclose(exact.poses, poses, atol=1e-6)
    assert exact.dof == 12 and exact.chi2 < 1e-9
    rng, chi2, nees = np.random.default_rng(6), [], []
    for _ in range(40):
        noisy = links @ exp_se3(rng.normal(size=(7, 6)) * np.repeat([1e-3, 0.2], 3))
        graph = chaining.solve_pose_graph(edges, noisy, 1e-3, 0.2)
        error = log_se3(relative(graph.poses[1:], poses[1:])).ravel()
        chi2.append(graph.chi2)
        nees.append(error @ np.linalg.solve(graph.covariance, error))
    assert np.mean(chi2) == pytest.approx(12, abs=3)
    assert np.mean(nees) == pytest.approx(30, abs=5)


def test_jacobian_of_the_graph_agrees_with_finite_differences():
    edges, _, links = two_loops()
    noisy = links @ exp_se3(np.random.default_rng(8).normal(size=(7, 6)) * np.repeat([0.05, 5.0], 3))
    graph = chaining.solve_pose_graph(edges, noisy, 0.05, 5.0)

    def weighted(x):
        X = np.concatenate([graph.poses[:1], graph.poses[1:] @ exp_se3(x.reshape(-1, 6))])
        e = log_se3(relative(noisy, relative(X[edges[:, 0]], X[edges[:, 1]])))
        return (e / np.repeat([0.05, 5.0], 3)).ravel()

    scale = np.tile(np.repeat([1e-5, 1e-3], 3), 5)
    J = np.column_stack([(weighted(s * e) - weighted(-s * e)) / (2 * s) for s, e in zip(scale, np.eye(30))])
    gradient = J.T @ weighted(np.zeros(30))
    assert np.abs(gradient * np.tile(np.repeat([0.05, 5.0], 3), 5)).max() < 1e-3  # the optimum of the exact problem
    np.testing.assert_allclose(np.linalg.inv(J.T @ J), graph.covariance, rtol=0.02, atol=1e-5)
    np.testing.assert_allclose(np.linalg.svd(J, compute_uv=False), graph.singular_values, rtol=0.02)


def test_right_jacobian_and_its_inverse_against_the_matrix_exponential():
    """J = (1 - exp(-ad)) / ad, read from a block's exponential; the series is good to 1e-4 at half a radian."""
    xi = np.array([0.3, -0.2, 0.35, 40.0, -10, 25])
    ad = chaining._ad(xi)
    exact = expm(np.block([[-ad, np.eye(6)], [np.zeros((6, 12))]]))[:6, 6:]
    scale = np.repeat([1.0, 50.0], 3)  # a turn of 1 rad beside a length of 50 mm
    orders = [np.linalg.matrix_power(ad, k) for k in range(5)]
    taylor = sum((-1) ** k * power / factorial(k + 1) for k, power in enumerate(orders))
    np.testing.assert_allclose(chaining._right_jacobian(xi), taylor, rtol=1e-12, atol=1e-15)
    numbers = [1, 1 / 2, 1 / 6, 0, -1 / 30]  # of Bernoulli, the second with its other sign
    inverse = sum(b * power / factorial(k) for k, (b, power) in enumerate(zip(numbers, orders)))
    np.testing.assert_allclose(chaining._right_jacobian_inverse(xi), inverse, rtol=1e-12, atol=1e-15)
    for J, goal in (
        (chaining._right_jacobian(xi), exact),
        (chaining._right_jacobian_inverse(xi), np.linalg.inv(exact)),
    ):
        assert np.abs((J - goal) * scale / scale[:, None]).max() < 3e-4


def test_graph_closes_both_loops_where_sharing_out_one_loop_opens_the_other():
    edges, poses, links = two_loops()
    noisy = links @ exp_se3(np.random.default_rng(7).normal(size=(7, 6)) * np.repeat([2e-3, 0.5], 3))
    loops = [(0, True), (1, True), (2, True), (3, True)], [(4, True), (5, True), (6, True), (1, False)]

    def left(links):
        return [chaining.closure_error(chaining.chain(chaining.around(links, loop)))[1] for loop in loops]

    np.testing.assert_allclose(left(links), 0, atol=1e-9)
    first, second = (
        left(chaining.distribute_in_turn(noisy, loops)),
        left(chaining.distribute_in_turn(noisy, loops[::-1])),
    )
    assert first[0] > 0.1 and first[1] < 1e-9  # the shared link was changed again
    assert second[0] < 1e-9 < second[1]
    graph = chaining.solve_pose_graph(edges, noisy, 2e-3, 0.5)
    np.testing.assert_allclose(left(relative(graph.poses[edges[:, 0]], graph.poses[edges[:, 1]])), 0, atol=1e-9)


def test_pose_graph_refuses_an_island():
    with pytest.raises(ValueError, match="no link leads to node 2"):
        chaining.solve_pose_graph([(0, 1), (2, 3)], np.tile(np.eye(4), (2, 1, 1)), 1e-3, 0.1)
    with pytest.raises(ValueError, match="edges must be pairs"):
        chaining.solve_pose_graph([(0, 1)], np.tile(np.eye(4), (2, 1, 1)), 1e-3, 0.1)
    for edge in ((1, -1), (1, 0.5), (1, 1)):
        with pytest.raises(ValueError, match="two different nodes, numbered from 0"):
            chaining.solve_pose_graph([(0, 1), edge], np.tile(np.eye(4), (2, 1, 1)), 1e-3, 0.1)


@pytest.mark.parametrize(
    "call, text",
    [
        (lambda: chaining.chain([]), "at least 1"),
        (lambda: chaining.chain([np.eye(3)]), r"transforms\[0\] must have shape"),
        (lambda: chaining.chain(np.eye(4)), r"transforms\[0\] must have shape"),
        (lambda: chaining.around(np.tile(np.eye(4), (3, 1, 1)), [(0, True), (3, True)]), "from 0 to 2, got 3"),
        (lambda: chaining.chain([np.eye(4), 2 * np.eye(4)]), r"transforms\[1\]"),
        (lambda: chaining.rounding_bound([np.eye(4)], 0.0), "half_unit must be positive"),
        (lambda: chaining.expected_closure([np.eye(4)], -1.0, 0.0), "std_rot must not be negative"),
        (lambda: chaining.polygon_loop(0, 1.0), "n must be a whole number, at least 1, got 0"),
        (lambda: chaining.straight_chain(0, 1.0), "n must be a whole number, at least 1, got 0"),
        (lambda: chaining.transforms_from_points(np.zeros((3, 3))), "frame, point, coordinate"),
        (lambda: chaining.orthonormalize(np.eye(3)), "must have shape"),
        (lambda: chaining.orthonormalize([np.eye(4), np.diag([1.0, 1, -1, 1])]), "right-handed rotation block"),
        (lambda: chaining.chain([np.tile(np.eye(4), (n, 1, 1)) for n in (2, 3)]), r"transforms\[0\]"),
    ],
)
def test_bad_input_is_refused_in_words(call, text):
    with pytest.raises(ValueError, match=text):
        call()


@pytest.mark.parametrize("n", [3, 7])
def test_polygon_stands_on_a_circle_of_its_size(n):
    links = chaining.polygon_loop(n, 300.0)
    origins = np.array([chaining.chain(links[:k])[:3, 3] for k in range(1, n + 1)])
    np.testing.assert_allclose(np.linalg.norm(origins - origins.mean(0), axis=1), 150.0, rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(np.diff(origins, axis=0), axis=1), 300 * np.sin(np.pi / n), rtol=1e-12)


def test_a_loop_that_misses_by_half_a_turn_has_no_nearest_way_back():
    """Up to a thousandth of a radian short of it the closure is distributed."""
    axis = np.array([0.6, 0.0, 0.8])
    for short, refused in ((1.5e-3, False), (0.5e-3, True)):
        links = pose(exp_so3(np.outer([0.5, 0.5], (np.pi - short) * axis)), np.eye(3)[:2])
        if refused:
            with pytest.raises(ValueError, match="half a turn has no nearest way back"):
                chaining.distribute_closure(links)
        else:
            closed = chaining.distribute_closure(links)
            np.testing.assert_allclose(closed[0] @ closed[1], np.eye(4), atol=1e-9)
