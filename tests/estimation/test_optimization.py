"""The optimizers against SciPy, finite differences and closed forms; the two wells against the thesis's own code."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import least_squares, minimize, rosen, rosen_der, rosen_hess
from scipy.spatial.transform import Rotation

from labkit.documents.thesis import wells
from labkit.documents.thesis.wells import luck
from labkit.estimation import optimization as opt
from labkit.estimation.differences import numeric_jacobian
from labkit.geometry import lie

RNG = np.random.default_rng(4)
POINTS = RNG.uniform(-4, 4, (30, 2))
LEAST_SQUARES = (opt.gauss_newton, opt.levenberg_marquardt, opt.trust_region)


def rosen_residual(x):
    return np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]])


def rosen_jacobian(x):
    return np.array([[-20 * x[0], 10.0], [-1.0, 0.0]])


# --- The two wells ---


def c9(x):
    """Gradient and Hessian term by term, in the order of listings C7-C9, as an independent writing."""
    (a, b), (c, d) = x - np.array([1, 1]), x + np.array([1, 2])
    p, q = a**2 + b**2 + 1, c**2 + d**2 + 1
    g = [200 * a / p**2 + 400 * c / q**2, 200 * b / p**2 + 400 * d / q**2]
    xx = -800 * a**2 / p**3 + 200 / p**2 + 400 / q**2 - 1600 * c**2 / q**3
    yy = -800 * b**2 / p**3 + 200 / p**2 + 400 / q**2 - 1600 * d**2 / q**3
    xy = -800 * a * b / p**3 - 1600 * c * d / q**3
    return -100 / p - 200 / q, np.array(g), np.array([[xx, xy], [xy, yy]])


@pytest.mark.parametrize("x", POINTS[:8])
def test_wells_agree_with_the_code_of_the_thesis(x):
    f, g, H = c9(x)
    assert wells.value(x) == pytest.approx(f, rel=1e-13)
    np.testing.assert_allclose(wells.gradient(x), g, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(wells.hessian(x), H, rtol=1e-11, atol=1e-11)


def test_derivatives_against_central_differences():
    for x in POINTS:
        np.testing.assert_allclose(numeric_jacobian(wells.value, x), wells.gradient(x), atol=1e-6)
        np.testing.assert_allclose(numeric_jacobian(wells.gradient, x), wells.hessian(x), atol=1e-6)
        np.testing.assert_allclose(numeric_jacobian(wells.residual, x), wells.jacobian(x), atol=1e-7)


def test_line_through_the_centers_and_its_model():
    t, h = 0.37, 1e-4
    assert wells.along_line(wells.on_line(t)) == pytest.approx(t)
    np.testing.assert_allclose(wells.on_line([0.0, 1.0]), [[1, 1], [-1, -2]])
    before, here, after = wells.value(wells.on_line([t - h, t, t + h]))
    value, slope, curvature = wells.line_model(t)
    assert value == pytest.approx(here) and slope == pytest.approx((after - before) / (2 * h), rel=1e-6)
    assert curvature == pytest.approx((after - 2 * here + before) / h**2, rel=1e-5)


def test_parts_of_the_newton_step_lie_along_the_curvatures():
    g, H = np.array([1.0, -2.0, 0.5]), np.array([[2.0, 0.3, 0.1], [0.3, -1.0, 0.4], [0.1, 0.4, 3.0]])
    curvatures, directions, parts = opt.newton_parts(g, H)
    np.testing.assert_allclose(parts.sum(1), np.linalg.solve(H, -g))
    np.testing.assert_allclose(np.cross(parts.T, directions.T), np.zeros((3, 3)), atol=1e-12)
    np.testing.assert_allclose(H @ directions, directions * curvatures, atol=1e-12)
    uphill = g @ parts > 0
    np.testing.assert_array_equal(uphill, curvatures < 0)
    with pytest.raises(ValueError, match="singular"):
        opt.newton_parts(g, np.diag([1.0, 0.0, 2.0]))


def test_squares_of_the_residual_add_up_to_the_function():
    np.testing.assert_allclose((wells.residual(POINTS) ** 2).sum(-1), wells.value(POINTS) + 300, rtol=1e-12)
    assert wells.residual(POINTS[:, None]).shape == (30, 1, 4) and wells.jacobian(POINTS[None]).shape == (1, 30, 4, 2)


def test_wider_wells_have_the_right_derivatives_and_lead_to_the_global_minimum():
    for x in POINTS[:6]:
        numeric = numeric_jacobian(lambda p: wells.value(p, 3.0), x)
        np.testing.assert_allclose(numeric, wells.gradient(x, 3.0), atol=1e-6)
        numeric = numeric_jacobian(lambda p: wells.gradient(p, 3.0), x)
        np.testing.assert_allclose(numeric, wells.hessian(x, 3.0), atol=1e-6)
        x = 10 * x
        for width in (4.0, 2.0, 1.0):
            x = wells.run("trust_region", x, width=width).solution
        assert wells.which(x) == 1
    with pytest.raises(ValueError, match="residual of width 1"):
        wells.run("gauss_newton", [0.0, 0.0], width=3.0)


def test_printed_hessian_is_wrong_on_the_diagonal_only():
    wrong = np.abs(wells.printed_hessian(POINTS) - wells.hessian(POINTS)).max(0)
    assert (wrong > 1).tolist() == [[True, False], [False, True]]


def test_extrema_against_scipy_and_on_the_line_through_the_centers():
    local, lowest, saddle = wells.extrema()
    assert [e.kind for e in wells.extrema()] == ["minimum", "minimum", "saddle"]
    for e, start in ((local, (1, 1)), (lowest, (-1, -2))):
        found = minimize(wells.value, start, jac=wells.gradient, hess=wells.hessian, method="trust-exact", tol=1e-12)
        np.testing.assert_allclose(e.x, found.x, atol=1e-8)
    along = np.diff(wells.CENTERS, axis=0)[0]
    for e in wells.extrema():
        assert np.linalg.norm(wells.gradient(e.x)) < 1e-11
        assert abs(np.linalg.det([along, e.x - wells.CENTERS[0]])) < 1e-12
    assert wells.value([0.105, -0.205]) > saddle.value + 0.09


@pytest.mark.parametrize("method", wells.METHODS)
def test_destinations_are_those_of_single_runs(method):
    starts = np.random.default_rng(0).uniform(-5, 5, (60, 2))
    label, steps = wells.destinations(method, starts)
    single = [wells.run(method, start) for start in starts]
    assert label.tolist() == [int(wells.which(run.solution)) for run in single]
    assert steps.shape == (60,) and steps.min() >= 1


def test_table_7_1_newton_iterations():
    runs = [wells.run("newton", start, stop=opt.small_gradient_before()) for start in ((1.25, 1.25), (-1.25, -2.25))]
    assert [run.iterations for run in runs] == [9, 7]


def test_newton_ends_in_the_saddle_and_the_others_never_do():
    grid = np.stack(np.meshgrid(np.linspace(-6, 6, 41), np.linspace(-6, 6, 41)), axis=-1)
    found = {method: np.bincount(wells.destinations(method, grid)[0].ravel(), minlength=4) for method in wells.METHODS}
    assert found["newton"][2] > found["newton"][0] + found["newton"][1] > 0
    assert all(found[method][2] == 0 for method in wells.METHODS[1:])
    assert found["levenberg_marquardt"][3] == found["trust_region"][3] == 0


# --- Methods ---


def test_newton_on_a_quadratic_needs_one_step():
    H = np.array([[3.0, 1.0], [1.0, 2.0]])
    goal = np.array([0.5, -2.0])
    run = opt.newton(lambda x: 0.5 * (x - goal) @ H @ (x - goal), lambda x: H @ (x - goal), lambda x: H, [40.0, 7.0])
    assert run.converged and run.iterations == 1 and run.reason == "the gradient is small"
    np.testing.assert_allclose(run.solution, goal, atol=1e-12)
    assert run.x.shape == (2, 2) and run.cost.shape == (2,) and run.step.shape == (1, 2) and np.isinf(run.radius).all()


@pytest.mark.parametrize("method", LEAST_SQUARES)
def test_rosenbrock_as_a_sum_of_squares(method):
    run = method(rosen_residual, rosen_jacobian, [-1.2, 1.0])
    assert run.converged, run.reason
    np.testing.assert_allclose(run.solution, [1.0, 1.0], atol=1e-9)
    assert len(run.x) == len(run.cost) == run.iterations + 1 == len(run.radius) + 1


@pytest.mark.parametrize("subproblem", [opt.dogleg_step, opt.exact_step])
@pytest.mark.parametrize("n", [2, 4])
def test_rosenbrock_with_its_hessian(subproblem, n):
    x0 = np.tile([-1.2, 1.0], n // 2)
    run = opt.trust_region(rosen, rosen_der, x0, hessian=rosen_hess, subproblem=subproblem)
    assert run.converged, run.reason
    if n == 2:
        np.testing.assert_allclose(run.solution, np.ones(n), atol=1e-8)
    else:  # in four dimensions there is a second minimum, near (-0.776, 0.613, 0.382, 0.146)
        assert opt.classify_extremum(rosen_der(run.solution), rosen_hess(run.solution), tol=1e-9) == "minimum"
    assert (np.diff(run.cost) <= 8 * np.finfo(float).eps * run.cost[:-1]).all()  # down to rounding


def test_cauchy_steps_alone_descend_slowly():
    options = {"hessian": rosen_hess, "max_iterations": 200}
    slow = opt.trust_region(rosen, rosen_der, [-1.2, 1.0], subproblem=opt.cauchy_step, **options)
    fast = opt.trust_region(rosen, rosen_der, [-1.2, 1.0], **options)
    assert fast.iterations < 50 and not slow.converged and slow.cost[-1] < slow.cost[0] and "200" in slow.reason


@pytest.mark.parametrize("method", LEAST_SQUARES)
def test_curve_fit_agrees_with_scipy(method):
    t = np.linspace(0, 4, 25)
    y = 3 * np.exp(-0.7 * t) + 0.5 + 0.05 * np.random.default_rng(1).standard_normal(25)

    def residual(p):
        return p[0] * np.exp(-p[1] * t) + p[2] - y

    def jacobian(p):
        e = np.exp(-p[1] * t)
        return np.column_stack([e, -p[0] * t * e, np.ones_like(t)])

    run = method(residual, jacobian, [2.0, 1.0, 0.0])
    reference = least_squares(residual, [2.0, 1.0, 0.0], jacobian, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert run.converged, run.reason
    np.testing.assert_allclose(run.solution, reference.x, atol=1e-8)
    assert run.cost[-1] == pytest.approx(reference.cost, rel=1e-12)


@pytest.mark.parametrize("method", LEAST_SQUARES)
def test_unknown_on_a_manifold(method):
    """A rotation from four directions with noise: increments exp(phi) R, against the closed form (SVD)."""
    rng = np.random.default_rng(3)
    R_true = lie.exp_so3(np.array([0.3, -1.1, 2.0]))
    a = rng.standard_normal((4, 3))
    b = a @ R_true.T + 0.01 * rng.standard_normal((4, 3))

    def residual(R):
        return (a @ R.T - b).ravel()

    def jacobian(R):
        return -lie.skew(a @ R.T).reshape(-1, 3)

    def retract(R, phi):
        return lie.exp_so3(phi) @ R

    start = retract(R_true, np.array([0.4, -0.3, 0.5]))
    np.testing.assert_allclose(numeric_jacobian(residual, start, retract=retract, n=3), jacobian(start), atol=1e-8)
    run = method(residual, jacobian, start, retract=retract)
    assert run.converged and run.x.shape == (run.iterations + 1, 3, 3), run.reason
    np.testing.assert_allclose(run.solution, Rotation.align_vectors(b, a)[0].as_matrix(), atol=1e-8)


def test_scale_makes_units_equivalent():
    """One unknown a thousand times larger: the same path once `scale` says so."""
    factor = np.array([20.0, 1e5])
    runs = [method(rosen_residual, rosen_jacobian, [-1.2, 1.0]) for method in LEAST_SQUARES[1:]]

    def residual(x):
        return rosen_residual(x / factor)

    def jacobian(x):
        return rosen_jacobian(x / factor) / factor

    scaled = [method(residual, jacobian, factor * [-1.2, 1.0], scale=factor) for method in LEAST_SQUARES[1:]]
    for plain, other in zip(runs, scaled):
        np.testing.assert_allclose(other.x[:10] / factor, plain.x[:10], rtol=1e-8)


# --- Steps ---


@pytest.mark.parametrize("method", LEAST_SQUARES[1:])
def test_one_scale_for_all_unknowns_is_one_for_each(method):
    one, each = (method(rosen_residual, rosen_jacobian, [-1.2, 1.0], scale=s) for s in (7.0, np.full(2, 7.0)))
    np.testing.assert_allclose(one.x, each.x, rtol=1e-9)
    assert one.iterations == each.iterations


@pytest.mark.parametrize("method", LEAST_SQUARES[1:])
def test_one_slope_of_zero_is_no_end(method):
    """At (0, 0) Rosenbrock's function has the gradient (-2, 0)."""
    run = method(rosen_residual, rosen_jacobian, [0.0, 0.0])
    assert run.converged and run.iterations > 1
    np.testing.assert_allclose(run.solution, [1.0, 1.0], atol=1e-9)


def definite(n, rng):
    A = rng.standard_normal((n, n))
    return A @ A.T + 0.1 * np.eye(n)


@pytest.mark.parametrize("n", [2, 3, 6])
def test_trust_region_steps_stay_inside_and_order_as_they_should(n):
    rng = np.random.default_rng(n)
    for _ in range(40):
        g, B, radius = rng.standard_normal(n), definite(n, rng), rng.uniform(0.05, 5)
        steps = [step(g, B, radius) for step in (opt.cauchy_step, opt.dogleg_step, opt.exact_step)]
        assert all(np.linalg.norm(step) <= radius * (1 + 1e-9) for step in steps)
        cauchy, dogleg, exact = (opt.predicted_decrease(g, B, step) for step in steps)
        assert 0 < cauchy <= dogleg * (1 + 1e-9) and dogleg <= exact * (1 + 1e-9)


def test_cauchy_step_is_the_best_along_the_gradient():
    rng = np.random.default_rng(0)
    for B in (definite(2, rng), np.diag([1.0, -2.0])):
        g = rng.standard_normal(2)
        along = -np.linspace(0, 0.7, 7001)[:, None] * g / np.linalg.norm(g)
        best = along[opt.predicted_decrease(g, B, along).argmax()]
        np.testing.assert_allclose(opt.cauchy_step(g, B, 0.7), best, atol=1e-4)


def test_dogleg_without_a_bound_is_newton_and_with_a_tight_one_steepest_descent():
    rng = np.random.default_rng(5)
    g, B = rng.standard_normal(3), definite(3, rng)
    np.testing.assert_allclose(opt.dogleg_step(g, B, 1e9), opt.newton_step(g, B))
    np.testing.assert_allclose(opt.dogleg_step(g, B, 1e-6), -1e-6 * g / np.linalg.norm(g))
    middle = 0.5 * np.linalg.norm(opt.cauchy_step(g, B, 1e9)) + 0.5 * np.linalg.norm(opt.newton_step(g, B))
    assert np.linalg.norm(opt.dogleg_step(g, B, middle)) == pytest.approx(middle)


@pytest.mark.parametrize("least", [0.0, 1e-16, -1e-3])
def test_dogleg_goes_down_the_gradient_where_nothing_bends_up_for_sure(least):
    g, B = np.array([1.0, -1.0]), np.diag([1.0, least])
    np.testing.assert_allclose(opt.dogleg_step(g, B, 5.0), opt.cauchy_step(g, B, 5.0))
    assert np.linalg.norm(opt.dogleg_step(g, np.diag([1.0, 1e-12]), 5.0)) == pytest.approx(5.0)


def test_exact_step_minimizes_the_model_on_the_disk_also_when_indefinite():
    angle, share = np.meshgrid(np.linspace(0, 2 * np.pi, 721), np.linspace(0, 1, 101))
    disk = np.stack([share * np.cos(angle), share * np.sin(angle)], axis=-1)
    cases = [(np.array([0.4, -1.0]), np.diag([2.0, -1.0]))]
    cases += [(np.array([0.0, 1.0]), np.diag([-3.0, 1.0]))]  # the hard case: no gradient along the negative curvature
    cases += [(RNG.standard_normal(2), (lambda A: A + A.T)(RNG.standard_normal((2, 2)))) for _ in range(10)]
    for g, B in cases:
        best = opt.predicted_decrease(g, B, disk).max()
        assert opt.predicted_decrease(g, B, opt.exact_step(g, B, 1.0)) == pytest.approx(best, abs=2e-3)
        assert opt.predicted_decrease(g, B, opt.exact_step(g, B, 1.0)) > best - 1e-9


def test_steps_broadcast():
    g, H = wells.gradient(POINTS), wells.hessian(POINTS)
    radius = np.linspace(0.1, 3, 30)
    for step in (opt.cauchy_step, opt.dogleg_step, opt.exact_step):
        one_by_one = [step(g[i], H[i], radius[i]) for i in range(30)]
        np.testing.assert_allclose(step(g, H, radius), one_by_one, atol=1e-12)
    r, J = wells.residual(POINTS), wells.jacobian(POINTS)
    lstsq = [np.linalg.lstsq(J[i], -r[i], rcond=None)[0] for i in range(30)]
    np.testing.assert_allclose(opt.gauss_newton_step(r, J), lstsq, rtol=1e-9)
    damped = -np.linalg.solve(J[0].T @ J[0] + 7 * np.eye(2), J[0].T @ r[0])
    np.testing.assert_allclose(opt.damped_step(r[0], J[0], 7.0), damped)


def test_gain_ratio_is_one_for_a_quadratic_and_negative_uphill():
    g, H, s = np.array([1.0, 2.0]), np.diag([2.0, 4.0]), np.array([-0.1, -0.2])
    exact = 5 + g @ s + 0.5 * s @ H @ s
    assert opt.gain_ratio(5.0, exact, g, H, s) == pytest.approx(1)
    assert opt.gain_ratio(5.0, 5.5, g, H, s) < 0
    assert opt.gain_ratio(1e6, 1e6, g * 1e-9, H, s * 1e-9) == pytest.approx(1)


def test_levenberg_marquardt_radius_is_the_ball_its_step_minimizes_in():
    run = wells.run("levenberg_marquardt", (3.0, 0.0))
    for x, step, radius in zip(run.x, run.step, run.radius):
        r, J = wells.residual(x), wells.jacobian(x)
        np.testing.assert_allclose(opt.exact_step(J.T @ r, J.T @ J, radius), step, rtol=1e-4, atol=1e-9)


@pytest.mark.parametrize(
    ("H", "kind"),
    [((2, 1), "minimum"), ((-2, -1), "maximum"), ((2, -1), "saddle"), ((2, 1e-9), "degenerate")],
)
def test_classify_extremum(H, kind):
    turn = Rotation.from_euler("z", 0.7).as_matrix()[:2, :2]
    assert opt.classify_extremum([0, 0], turn @ np.diag(H).astype(float) @ turn.T) == kind
    assert opt.classify_extremum([0.1, 0], np.diag(H)) == "not stationary"


# --- What can go wrong is said in words ---


def test_singular_problems_end_with_a_reason():
    flat = opt.newton(lambda x: x[0] ** 2, lambda x: np.array([2 * x[0], 0]), lambda x: np.diag([2.0, 0.0]), [1.0, 1.0])
    assert not flat.converged and flat.reason == "the Hessian is singular" and flat.step.shape == (0, 2)
    same = opt.gauss_newton(lambda x: np.array([x.sum(), 1.0]), lambda x: np.array([[1.0, 1], [0, 0]]), [1.0, 2])
    assert not same.converged and same.reason == "the Jacobian has rank 1, but there are 2 unknowns"


def test_start_in_the_minimum_and_steps_into_nothing():
    there = opt.trust_region(rosen, rosen_der, [1.0, 1.0], hessian=rosen_hess)
    assert there.converged and there.iterations == 0

    def barrier(x):
        return x[0] - np.log(x[0])

    def slope(x):
        return 1 - 1 / x

    def bend(x):
        return np.diag(1 / x**2)

    log = opt.newton(barrier, slope, bend, [3.0])  # to x = -3, where there is no logarithm
    assert not log.converged and "not finite" in log.reason
    safe = opt.trust_region(barrier, slope, [9.0], hessian=bend, radius=20)
    assert safe.converged and safe.solution[0] == pytest.approx(1)
    assert not safe.accepted[0] and safe.gain[0] == -np.inf


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: wells.run("simplex", (0, 0)), "method must be one of"),
        (lambda: wells.destinations("simplex", (0, 0)), "method must be one of"),
        (lambda: wells.value([1, 2, 3]), r"x must have shape \(..., 2\), got \(3,\)"),
        (lambda: opt.gauss_newton(wells.residual, wells.jacobian, [np.nan, 0]), "x0 must be finite"),
        (lambda: opt.gauss_newton(wells.residual, lambda x: wells.jacobian(x).T, [1, 0]), r"got \(4,\) and \(2, 4\)"),
        (lambda: opt.newton(wells.value, wells.hessian, wells.hessian, [1, 0]), "gradient and hessian must return"),
        (lambda: wells.run("trust_region", [1, 0], radius=-1), "radius must be positive"),
        (lambda: wells.run("trust_region", [1, 0], accept=0.5), "accept must lie in"),
        (lambda: wells.run("levenberg_marquardt", [1, 0], damping=0), "damping must be positive"),
        (lambda: opt.newton(lambda x: np.inf, wells.gradient, wells.hessian, [1, 0]), "not finite at the start"),
        (lambda: opt.classify_extremum([0, 0], np.eye(3)), "g and H must have shapes"),
    ],
)
def test_bad_input_is_refused_in_one_sentence(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_luck_is_what_tosses_of_a_coin_give():
    right = np.random.default_rng(1).integers(2, size=(100_000, 5, 4)).astype(bool)
    assert right.all(axis=2).any(axis=1).mean() == pytest.approx(luck(), abs=0.005)


def test_the_radius_follows_the_scheme_of_the_thesis():
    gains = np.array([-np.inf, 0.2, 0.5, 0.9, 0.9, 0.9])
    lengths = np.array([1.0, 0.4, 1.0, 0.5, 1.0, 1.0])
    limits = np.array([9.0, 9.0, 9.0, 9.0, 9.0, 1.5])
    np.testing.assert_allclose(opt.next_radius(1.0, lengths, gains, limits), [0.25, 0.1, 1.0, 1.0, 2.0, 1.5])


# --- when to stop ----------------------------------------------------------------------------------------------------


def at(x=(0.0,), cost=0.0, gradient=(1.0, 1.0), residual=None, jacobian=None):
    arrays = {"x": x, "gradient": gradient, "residual": residual, "jacobian": jacobian}
    return SimpleNamespace(cost=cost, **{k: None if v is None else np.array(v, float) for k, v in arrays.items()})


def test_the_rules_of_the_listings_look_at_what_they_name():
    change, small, before = opt.small_change(1e-3), opt.small_gradient(1e-3), opt.small_gradient_before(1e-3)
    assert change(at(cost=5.0), at(cost=5.0005)) and change(at(cost=5.0005), at(cost=5.0))
    assert not change(at(cost=5.0), at(cost=4.99)) and not change(at(cost=4.99), at(cost=5.0))
    flat, steep = at(gradient=[4e-4, -4e-4]), at(gradient=[6e-4, -6e-4])
    assert small(steep, flat) and not small(flat, steep) and before(flat, steep) and not before(steep, flat)


def test_settled_is_a_short_step_or_a_residual_at_right_angles_to_every_column():
    rule, J, r = opt.settled(1e-6), [[3.0, 0.0], [0.0, 0.2], [0.0, 0.0]], [0.0, 0.0, 5.0]
    far = {"x": [1.0, 2.0]}
    assert rule(at([1.0, 2.0]), at([1.0, 2.0 + 1e-7])) == "the step is small"
    assert not rule(at([1.0, 2.0]), at([1.0, 2.1]))
    assert rule(at([1.0, 2.0]), at([1.0, 2.0 + 2.1e-6])) and not rule(at([1.0, 2.0]), at([1.0, 2.0 + 2.4e-6]))
    for gradient, said in (([1e-6, 1e-7], True), ([1e-6, 1e-4], False), ([1e-4, 1e-7], False), ([1.4e-5, 9e-7], True)):
        assert bool(rule(at([0.0, 0.0]), at(**far, gradient=gradient, residual=r, jacobian=J))) is said


def test_dogleg_s_doubt_grows_with_the_matrix():
    g = np.array([1.0, -1.0])
    np.testing.assert_allclose(
        opt.dogleg_step(g, np.diag([1e6, 1e-10]), 5.0), opt.cauchy_step(g, np.diag([1e6, 1e-10]), 5.0)
    )
    assert np.linalg.norm(opt.dogleg_step(g, np.diag([1e-6, 1e-15]), 5.0)) == pytest.approx(5.0)


@pytest.mark.parametrize(("gradient", "converged"), [(1e-9, True), (1e-3, False)])
def test_a_search_that_is_stuck_has_arrived_only_where_nothing_is_promised(gradient, converged):
    """Half g^2 / B beside rounding of the cost: 5e-19 of 1 is nothing, 5e-7 is not."""
    point = SimpleNamespace(x=np.array([1.0]), cost=1.0, gradient=np.array([gradient]), curvature=np.array([[1.0]]))
    assert opt._stuck(point, np.array([1e-17])) == ("no step lowers the cost, down to rounding", converged)
    assert opt._stuck(point, np.array([1e-3])) == ("", False)
    large = SimpleNamespace(**vars(point) | {"x": np.array([1e3])})
    assert opt._stuck(large, np.array([1e-13]))[0] and not opt._stuck(large, np.array([3e-13]))[0]
    point.cost = 1e9  # whose rounding is 1e-7: now both promise nothing
    assert opt._stuck(point, np.array([1e-17]))[1] == (0.5 * gradient**2 < 8 * 2.3e-16 * 1e9)


def test_stationary_means_a_small_gradient_beside_the_largest_curvature():
    """H has eigenvalues 1 and 2 and a skew part, which no quadratic form has."""
    H, tol = np.array([[1.0, 5.0], [-5.0, 2.0]]), 1e-3
    assert (
        opt.classify_extremum([0.0, 1.9e-3], H, tol) == "minimum"
        and opt.classify_extremum([0.0, 1.9e-3], -H, tol) == "maximum"
    )
    assert opt.classify_extremum([0.0, 2.1e-3], H, tol) == "not stationary"
    assert opt.classify_extremum([0.0, 0.0], np.diag([2.0, 2.1e-3]), tol) == "minimum"
    assert opt.classify_extremum([0.0, 0.0], np.diag([2.0, 1.9e-3]), tol) == "degenerate"


@pytest.mark.parametrize("radius", [0.3, 1.0, 4.0])
def test_the_exact_step_is_the_lowest_point_of_the_disk(radius):
    """Convex, saddle and the hard case, where the gradient has no part along the lowest direction: by a fine search."""
    angle, inner = np.linspace(0, 2 * np.pi, 3601), np.linspace(0, 1, 201)[:, None]
    disk = radius * np.stack([inner * np.cos(angle), inner * np.sin(angle)], axis=-1).reshape(-1, 2)
    for g, B in (
        ([1.0, -2.0], [[3.0, 1.0], [1.0, 2.0]]),
        ([1.0, -2.0], [[3.0, 1.0], [1.0, -2.0]]),
        ([0.0, 0.5], [[-2.0, 0.0], [0.0, 1.0]]),
        ([0.0, 0.0], [[-2.0, 0.0], [0.0, 1.0]]),
    ):
        g, B = np.array(g), np.array(B)
        step = opt.exact_step(g, B, radius)
        lowest = (disk @ g + 0.5 * np.einsum("ni,ij,nj->n", disk, B, disk)).min()
        assert np.linalg.norm(step) <= radius * (1 + 1e-6)
        assert step @ g + 0.5 * step @ B @ step == pytest.approx(lowest, rel=2e-3)
        if np.linalg.eigvalsh(B)[0] < 0:
            assert np.linalg.norm(step) == pytest.approx(radius, rel=1e-6)


def test_the_damping_of_levenberg_marquardt_follows_nielsens_rule():
    """Read back from the steps, (J'J + damping I) step = -J'r: a third at least, more after a rise, and twice that."""
    trace = opt.levenberg_marquardt(rosen_residual, rosen_jacobian, [-1.9, 2.0], damping=1e-3)
    assert trace.converged and not trace.accepted.all()
    dampings = []
    for x, step in zip(trace.x, trace.step):
        r, J = rosen_residual(x), rosen_jacobian(x)
        dampings.append(-(step @ (J.T @ r + J.T @ J @ step)) / (step @ step))
    assert dampings[0] == pytest.approx(1e-3 * (rosen_jacobian(trace.x[0]) ** 2).sum(0).max(), rel=1e-6)
    growth = 2.0
    for damping, after, gain in zip(dampings, dampings[1:], trace.gain):
        if after < 1e-5:
            break  # below, rounding hides it
        expected = max(1 / 3, 1 - (2 * gain - 1) ** 3) if gain > 0 else growth
        growth = 2.0 if gain > 0 else 2 * growth
        assert after / damping == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("run", [opt.levenberg_marquardt, opt.trust_region])
def test_the_stopping_rule_is_asked_after_accepted_steps_alone(run):
    """And with the points before and after the step."""
    asked = []

    def low(before, after):
        asked.append((before.x, after.x))
        return "low" if after.cost < 1e-3 else ""

    trace = run(rosen_residual, rosen_jacobian, [-1.9, 2.0], stop=low)
    assert trace.converged and trace.reason == "low" and not trace.accepted.all()
    assert len(asked) == trace.accepted.sum()
    pairs = zip(trace.x[:-1][trace.accepted], trace.x[1:][trace.accepted])
    assert all(np.array_equal(asked[k], pair) for k, pair in enumerate(pairs))


def test_a_good_step_to_the_rim_doubles_any_radius():
    assert opt.next_radius(3.0, 3.0, 0.9, 100.0) == 6.0 and opt.next_radius(0.2, 0.2, 0.9, 100.0) == 0.4
    assert opt.next_radius(3.0, 3.0, 0.9, 5.0) == 5.0 and opt.next_radius(3.0, 2.0, 0.9, 100.0) == 3.0


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("tilt", [0.0, 1e-15, -1e-15, 1e-9])
def test_the_exact_step_depends_on_no_unit_and_stays_inside_where_it_is_hard(unit, tilt):
    """A slope along the lowest curvature that is nothing beside rounding: the step still ends on the rim."""
    g, B = unit * np.array([tilt, 0.5]), unit * np.diag([-2.0, 1.0])
    for radius in (0.5, 3.0):
        step = opt.exact_step(g, B, radius)
        assert np.linalg.norm(step) == pytest.approx(radius, rel=1e-9)
        rest = max(-0.5 / (1 + 2), -radius)  # (B + 2) step = -g across, and the rim along
        np.testing.assert_allclose(np.abs(step), [np.sqrt(radius**2 - rest**2), -rest], rtol=1e-6)
        assert step[0] * tilt <= 0  # down


@pytest.mark.parametrize(("bits", "converged"), [(7.6, True), (8.4, False)])
def test_arrived_means_that_no_more_than_eight_bits_of_the_cost_are_promised(bits, converged):
    """The whole Newton step of a quadratic promises half g^2 / B."""
    g = np.sqrt(2 * bits * np.finfo(float).eps * 3.0 * 5.0)
    point = SimpleNamespace(x=np.array([1.0]), cost=5.0, gradient=np.array([g]), curvature=np.array([[3.0]]))
    assert opt._stuck(point, np.array([1e-17]))[1] is converged
