"""Chapter 4: gradient, Hessian, and the steps of Newton, Gauss-Newton and the trust region."""

import functools

import numpy as np

from ...documents.thesis import wells
from ...estimation import optimization as opt
from ...exercises import metrics
from ...exercises.engine import Chapter, Exercise, Mistake, Prediction, Value


def place(rng):
    """A point around the two wells."""
    return (rng.uniform(-3, 3, 2),)


def turned(eigenvalues, angle):
    """Symmetric 2x2 matrix with these eigenvalues, its axes turned by the angle."""
    c, s = np.cos(angle), np.sin(angle)
    V = np.array([[c, -s], [s, c]])
    return V @ np.diag(eigenvalues) @ V.T


def kind_of_point(rng, kind):
    """Gradient and Hessian of one kind of point: minimum, maximum, a saddle whose diagonal is positive, one whose
    diagonal is mixed, one whose diagonal is negative, and three places that are not stationary: with a gradient
    of negative entries only, with entries of both signs and a negative sum, and of positive entries only.

    At the stationary ones |g| is about 1e-7, as after an iteration.
    """
    small, large = rng.uniform(0.5, 1.0), rng.uniform(4.0, 8.0)
    bowl = (small, large)
    eigenvalues = (bowl, (-large, -small), (-small, large), (-small, large), (-large, small), bowl, bowl, bowl)
    angle = rng.uniform(2, 8) if kind == 3 else rng.uniform(30, 60)
    signs = {5: (-1, -1), 7: (1, 1)}.get(kind, (1, -3))
    g = rng.uniform(0.5, 1.3, 2) * signs * (1 if kind > 4 else 4e-8)
    return g, turned(eigenvalues[kind], np.deg2rad(angle))


KINDS = tuple(functools.partial(kind_of_point, kind=k) for k in range(8))


def gradient_and_hessian(rng, signs):
    """A gradient and a Hessian with eigenvalues of these signs, far from singular."""
    eigenvalues = rng.uniform(1, 6, 2) * signs
    return rng.normal(scale=5, size=2), turned(eigenvalues, rng.uniform(0.3, 1.2))


MODELS = tuple(functools.partial(gradient_and_hessian, signs=s) for s in ((1, 1), (-1, 1), (-1, -1), (1, -1)))


def residual_and_jacobian(rng):
    """Six residuals of two unknowns."""
    return rng.normal(size=6), rng.normal(scale=2, size=(6, 2))


def tried_step(rng, shares):
    """Cost before and after a step that kept a share between these of its promise, with the model's g and B."""
    g, B = rng.normal(scale=3, size=2), turned(rng.uniform(1, 4, 2), rng.uniform(0.3, 1.2))
    step = -rng.uniform(0.1, 0.4) * g
    cost = rng.uniform(5, 20)
    return cost, cost - rng.uniform(*shares) * opt.predicted_decrease(g, B, step), g, B, step


TRIED_STEPS = tuple(functools.partial(tried_step, shares=s) for s in ((0.2, 1.2), (-0.8, -0.2)))


def dogleg_case(rng, between):
    """Gradient, positive definite curvature and a radius, `between` the corner (at 0) and the Newton point (at 1)."""
    g, B = rng.normal(scale=4, size=2), turned((rng.uniform(0.4, 0.8), rng.uniform(3, 5)), rng.uniform(0.3, 1.2))
    corner = np.linalg.norm(opt.cauchy_step(g, B, 1e9))
    full = np.linalg.norm(opt.newton_step(g, B))
    share = rng.uniform(*between)
    return g, B, float((1 + share) * corner if share < 0 else corner + share * (full - corner))


DOGLEG_CASES = tuple(functools.partial(dogleg_case, between=b) for b in ((-0.7, -0.2), (0.2, 0.8), (1.3, 2.0)))


# Wrong variants --------------------------------------------------------------------------------------------------------------------------


def _terms(x, first=(1.0, 1.0), second=(-1.0, -2.0), one=1.0):
    d = x - np.array([first, second])
    return d, (d * d).sum(-1) + one


def _gradient(power=2, depths=wells.DEPTHS, **changes):
    def variant(x):
        d, q = _terms(x, **changes)
        return (2 * np.array(depths) / q**power) @ d

    return variant


def _gradient_without_square(x):
    d, _ = _terms(x)
    return (2 * wells.DEPTHS / (np.linalg.norm(d, axis=-1) + 1) ** 2) @ d


def _hessian(factor=8.0, power=3, bowl=1.0, depths=wells.DEPTHS, **changes):
    def variant(x):
        d, q = _terms(x, **changes)
        w = np.array(depths)
        outer = np.einsum("k,ki,kj->ij", factor * w / q**power, d, d)
        return bowl * (2 * w / q**2).sum() * np.eye(2) - outer

    return variant


UNIT = np.eye(2)


def _hessian_with(unit=UNIT, product=np.outer, wells_seen=(0, 1)):
    """The sum over the wells with other things than I and the outer product."""

    def variant(x):
        d, q = _terms(x)
        w = wells.DEPTHS
        terms = [2 * w[k] / q[k] ** 2 * unit - 8 * w[k] / q[k] ** 3 * product(d[k], d[k]) for k in wells_seen]
        return sum(terms, np.zeros((2, 2)))

    return variant


def _diagonal_only(x):
    return np.diag(np.diag(wells.hessian(x)))


def _stationary(kind, moves=lambda g: np.linalg.norm(g) > 1e-6):
    def variant(g, H):
        return "not stationary" if moves(g) else kind(H)

    return variant


def _by(signs):
    """Kind by the signs of some numbers."""
    return lambda H: "minimum" if (signs(H) > 0).all() else "maximum" if (signs(H) < 0).all() else "saddle"


def _second_order_only(g, H):
    return _by(np.linalg.eigvalsh)(H)


def _first_order_only(g, H):
    return "not stationary" if np.linalg.norm(g) > 1e-6 else "minimum"


def _swapped(g, H):
    return {"minimum": "maximum", "maximum": "minimum"}.get(opt.classify_extremum(g, H), opt.classify_extremum(g, H))


def _all_positive(H):
    eigenvalues, V = np.linalg.eigh(H)
    return V @ np.diag(np.abs(eigenvalues)) @ V.T


def _predicted(g, B, step, half=0.5, sign=-1.0):
    return sign * (g @ step) - half * step @ B @ step


def _cut_newton(g, B, radius):
    full = opt.newton_step(g, B)
    return full * min(1.0, radius / np.linalg.norm(full))


def _uncut_newton(g, B, radius):
    return opt.newton_step(g, B)


def _always_to_the_rim(g, B, radius):
    step = opt.dogleg_step(g, B, radius)
    return step * radius / np.linalg.norm(step)


def _newton_or_rim(g, B, radius):
    """The Newton point when it is inside, steepest descent to the rim otherwise."""
    full = opt.newton_step(g, B)
    return full if np.linalg.norm(full) <= radius else -radius * g / np.linalg.norm(g)


def _leg_from_zero(g, B, radius):
    """In the second leg: the right share of the leg, added to the start instead of to the corner."""
    full, corner = opt.newton_step(g, B), opt.cauchy_step(g, B, 1e9)
    step = opt.dogleg_step(g, B, radius)
    second = np.linalg.norm(corner) < radius < np.linalg.norm(full)
    return step - corner if second else step


def _leg_by_length(g, B, radius):
    """In the second leg: what the corner leaves of the radius, as if the leg went on in the same direction."""
    full, corner = opt.newton_step(g, B), opt.cauchy_step(g, B, 1e9)
    length = np.linalg.norm(corner)
    if not length < radius < np.linalg.norm(full):
        return opt.dogleg_step(g, B, radius)
    leg = full - corner
    return corner + (radius - length) * leg / np.linalg.norm(leg)


def _newton_to_the_rim(g, B, radius):
    """In the second leg: the Newton step shortened to the radius."""
    full, corner = opt.newton_step(g, B), opt.cauchy_step(g, B, 1e9)
    second = np.linalg.norm(corner) < radius < np.linalg.norm(full)
    return _cut_newton(g, B, radius) if second else opt.dogleg_step(g, B, radius)


def _past_newton(g, B, radius):
    """Corner outside, or else the rim on the second leg, also where the Newton point is inside."""
    full, corner = opt.newton_step(g, B), opt.cauchy_step(g, B, 1e9)
    if np.linalg.norm(corner) >= radius:
        return -radius * g / np.linalg.norm(g)
    leg = full - corner
    a, b, c = leg @ leg, corner @ leg, corner @ corner - radius**2
    return corner + (-b + np.sqrt(b * b - a * c)) / a * leg


def _dogleg(
    corner=lambda p: p, full=lambda n: n, rim=None, share=lambda a, b, c: (-b + np.sqrt(b * b - a * c)) / a, leg=None
):
    """The whole path, one of its parts replaced: corner, Newton point, step to the rim, share of the leg, leg."""

    def variant(g, B, radius):
        n, p = full(opt.newton_step(g, B)), corner(-(g @ g) / (g @ B @ g) * g)
        if np.linalg.norm(n) <= radius:
            return n
        if np.linalg.norm(p) >= radius:
            return rim(g, p, radius) if rim else -radius * g / np.linalg.norm(g)
        way = leg(n, p) if leg else n - p
        return p + share(way @ way, p @ way, p @ p - radius**2) * way

    return variant


CHAPTER = Chapter(
    "04-optimization",
    [
        Exercise(
            "gradient",
            reference=wells.gradient,
            draw=place,
            metric=metrics.Numbers(1e-9),
            hints=(
                "Each well is −w/q with q = |x − c|² + 1. Differentiate it by the chain rule, q first.",
                "The derivative of −w/q is (w/q²) times the gradient of q, and the gradient of q is 2(x − c).",
                "`d1, d2 = x - [1, 1], x - [-1, -2]`, `q1, q2 = d1 @ d1 + 1, d2 @ d2 + 1`, `return 200 / q1**2 * d1 + 400 / q2**2 * d2`.",
            ),
            mistakes=[
                Mistake(
                    lambda x: wells.gradient(x) / 2,
                    "Half of the gradient: the gradient of |x − c|² is 2(x − c), the 2 is missing.",
                ),
                Mistake(
                    lambda x: -wells.gradient(x),
                    "This points downhill. The wells are −w/q, and the derivative of −1/q is +1/q² times that of q.",
                ),
                Mistake(
                    _gradient(power=1),
                    "Your denominators are q, not q²: the derivative of 1/q is −1/q² times that of q.",
                ),
                Mistake(
                    _gradient(second=(1.0, 2.0)), "The second well sits at (−1, −2): its offsets are x1 + 1 and x2 + 2."
                ),
                Mistake(
                    _gradient(second=(-1.0, 2.0)),
                    "The second center is (−1, −2): its second offset is x2 + 2, not x2 − 2.",
                ),
                Mistake(
                    _gradient_without_square,
                    "Your q holds the distance |x − c|, not its square: q = |x − c|² + 1, so `d @ d + 1`.",
                ),
                Mistake(
                    _gradient(first=(-1.0, -1.0), second=(1.0, 2.0)),
                    "Both centers have the wrong sign: x − c has offsets x1 − 1, x2 − 1 at (1, 1).",
                ),
                Mistake(_gradient(depths=(100.0, 0.0)), "This is the well at (1, 1) alone: add the one at (−1, −2)."),
                Mistake(_gradient(depths=(0.0, 200.0)), "This is the well at (−1, −2) alone: add the one at (1, 1)."),
                Mistake(
                    _gradient(depths=(200.0, 100.0)),
                    "The depths are exchanged: w = 100 at (1, 1), w = 200 at (−1, −2).",
                ),
                Mistake(_gradient(depths=(100.0, 100.0)), "The well at (−1, −2) is twice as deep: w = 200 there."),
                Mistake(
                    _gradient(depths=(100.0, -200.0)),
                    "The second well is subtracted: both terms are −w/q, so their gradients add up.",
                ),
                Mistake(_gradient(one=0.0), "The 1 in q = |x − c|² + 1 is missing from your denominators."),
            ],
        ),
        Prediction(
            "top",
            question="The start lies a fifth of the way from (1, 1) to (-1, -2), where f bends downward. Where does Newton end?",
            choices=("in the well near (1, 1)", "in the well near (-1, -2)", "on the pass between the wells"),
            answer="on the pass between the wells",
            why="Newton goes to the vertex of the parabola. Where f bends down, that vertex is a maximum.",
        ),
        Exercise(
            "hessian",
            reference=wells.hessian,
            draw=place,
            metric=metrics.Numbers(1e-9),
            hints=(
                "Differentiate the gradient (2w/q²)(x − c) once more: the product rule gives two terms for each well.",
                "One term is (2w/q²) I. The other one is (x − c) times the gradient of 2w/q², an outer product.",
                "`d1, d2 = x - [1, 1], x - [-1, -2]`, `q1, q2 = d1 @ d1 + 1, d2 @ d2 + 1`, `one = 200 / q1**2 * np.eye(2) - 800 / q1**3 * np.outer(d1, d1)`, "
                "`return one + 400 / q2**2 * np.eye(2) - 1600 / q2**3 * np.outer(d2, d2)`.",
            ),
            mistakes=[
                Mistake(
                    wells.printed_hessian,
                    "These are the formulas of listing C7, misprints included. Check them against differences of your gradient.",
                ),
                Mistake(
                    _hessian(factor=0.0),
                    "You differentiated only x − c. The factor 2w/q² depends on x as well: product rule.",
                ),
                Mistake(_hessian(factor=-8.0), "The outer product has the wrong sign: 1/q² shrinks as q grows."),
                Mistake(_diagonal_only, "The mixed derivatives are not zero: the wells lie diagonally to each other."),
                Mistake(
                    _hessian(factor=4.0), "The outer product is too small by a factor 2: the gradient of q is 2(x − c)."
                ),
                Mistake(_hessian(power=2), "The derivative of 1/q² has q³ in its denominator."),
                Mistake(
                    _hessian_with(product=np.dot),
                    "`d @ d` is a number and lowers all four entries alike. The matrix is `np.outer(d, d)`.",
                ),
                Mistake(
                    _hessian_with(product=np.multiply),
                    "`d * d` has two entries and not four. The matrix is `np.outer(d, d)`.",
                ),
                Mistake(
                    _hessian_with(unit=1.0),
                    "The number 2w/q² is added to all four entries: it belongs to the diagonal, times `np.eye(2)`.",
                ),
                Mistake(
                    _hessian_with(wells_seen=(1,)),
                    "This is the last well alone: the wells add up, `H += ...` and not `H = ...`.",
                ),
                Mistake(
                    _hessian_with(wells_seen=(0,)),
                    "This is the first well alone: add the one at (−1, −2). A `return` inside the loop ends it too early.",
                ),
                Mistake(
                    _hessian(factor=2.0),
                    "The outer product is too small by a factor 4: the derivative of 2w/q² is −4w/q³ times that of q, 2(x − c).",
                ),
                Mistake(
                    _hessian(depths=(200.0, 100.0)), "The depths are exchanged: w = 100 at (1, 1), w = 200 at (−1, −2)."
                ),
                Mistake(
                    _hessian(second=(1.0, 2.0)), "The second well sits at (−1, −2): its offsets are x1 + 1 and x2 + 2."
                ),
                Mistake(_hessian(one=0.0), "The 1 in q = |x − c|² + 1 is missing."),
                Mistake(
                    _hessian(bowl=0.0),
                    "Only the outer products are there. The part (2w/q²) I comes from differentiating x − c.",
                ),
            ],
        ),
        Exercise(
            "classify_extremum",
            reference=opt.classify_extremum,
            draw=KINDS,
            metric=metrics.Exactly(),
            draws=16,
            hints=(
                "First order first: only a place where the gradient vanishes is a candidate at all.",
                "Second order: the signs of the eigenvalues of H tell how f bends along its two main directions.",
                '`if np.linalg.norm(g) > 1e-6: return "not stationary"`, `e = np.linalg.eigvalsh(H)`, '
                '`return "minimum" if (e > 0).all() else "maximum" if (e < 0).all() else "saddle"`.',
            ),
            mistakes=[
                Mistake(
                    _second_order_only,
                    "You judge places where the gradient is not zero: they are no extrema, whatever H says.",
                ),
                Mistake(_first_order_only, "A vanishing gradient is necessary, not sufficient: a saddle has one too."),
                Mistake(
                    _stationary(_by(np.diag)),
                    "The diagonal of H bends up in both coordinates and it can still be a saddle: use the eigenvalues.",
                ),
                Mistake(
                    _stationary(_by(np.trace)),
                    "The trace is the sum of the eigenvalues: a saddle with one large positive one has a positive trace too.",
                ),
                Mistake(
                    _stationary(_by(np.linalg.eigvalsh), lambda g: g.any()),
                    "After an iteration the gradient is never exactly 0: up to a norm of 1e-6 it counts as vanished (`np.allclose` stops at 1e-8).",
                ),
                Mistake(
                    _stationary(_by(np.linalg.eigvalsh), lambda g: (g > 1e-6).any()),
                    "A large negative component is not small: use the norm of g.",
                ),
                Mistake(
                    _stationary(lambda H: "minimum" if np.linalg.det(H) > 0 else "saddle"),
                    "A positive determinant also belongs to a maximum: two negative eigenvalues.",
                ),
                Mistake(
                    _stationary(lambda H: "minimum" if np.linalg.det(H) > 0 else "maximum"),
                    "The determinant alone does not tell: it is negative at a saddle, and positive at a minimum and at a maximum.",
                ),
                Mistake(
                    _stationary(lambda H: "minimum" if H[0, 0] > 0 else "maximum"),
                    "H[0, 0] is the curvature along x1 alone: use both eigenvalues.",
                ),
                Mistake(
                    _stationary(_by(np.ravel)),
                    "The entries of H are no curvatures along its main directions: use the signs of the eigenvalues.",
                ),
                Mistake(
                    _stationary(lambda H: "minimum" if (np.linalg.eigvalsh(H) > 0).any() else "maximum"),
                    "One positive eigenvalue makes no minimum: all of them have to be positive.",
                ),
                Mistake(
                    _stationary(lambda H: "maximum" if (np.linalg.eigvalsh(H) < 0).any() else "minimum"),
                    "One negative eigenvalue makes no maximum: all of them have to be negative.",
                ),
                Mistake(
                    _stationary(_by(np.linalg.eigvalsh), lambda g: g.sum() > 1e-6),
                    "Positive and negative components of g cancel in a sum: use its norm.",
                ),
                Mistake(
                    lambda g, H: opt.classify_extremum(g, H).replace("saddle", "saddle point"),
                    'The kinds are right; the word is "saddle", without "point".',
                ),
                Mistake(
                    _swapped,
                    "Minimum and maximum are exchanged: at a minimum f bends up, all eigenvalues are positive.",
                ),
            ],
        ),
        Exercise(
            "newton_step",
            reference=opt.newton_step,
            draw=MODELS,
            metric=metrics.Numbers(1e-9),
            hints=(
                "The quadratic model is stationary where its gradient g + H h vanishes.",
                "Solve H h = −g for h. No inverse is needed, and no H⁻¹ as in equation (2-26) either.",
                "`return -np.linalg.solve(H, g)`.",
            ),
            mistakes=[
                Mistake(
                    lambda g, H: np.linalg.solve(H, g),
                    "This is the step with the wrong sign, the d of equations (2-24) and (2-25): there x − d is the next point.",
                ),
                Mistake(
                    lambda g, H: -H @ g, "You multiplied by H, as equation (2-26) has it; the step solves H h = −g."
                ),
                Mistake(
                    lambda g, H: -g / np.diag(H),
                    "Dividing by the diagonal ignores the mixed derivatives: solve the system.",
                ),
                Mistake(lambda g, H: -g, "That is steepest descent: H is not used at all."),
                Mistake(
                    lambda g, H: -(1 / H) @ g,
                    "`H**-1` inverts each entry by itself. The inverse matrix is `np.linalg.inv(H)`; better solve the system.",
                ),
                Mistake(
                    lambda g, H: -g / np.linalg.det(H),
                    "Dividing by the determinant is not solving: H h = −g is a system of two equations.",
                ),
                Mistake(
                    lambda g, H: -np.linalg.solve(_all_positive(H), g),
                    "Downhill along every direction, by |curvature|. Newton keeps the signs of H: where f bends down it climbs.",
                ),
            ],
        ),
        Value(
            "saddle",
            reference=lambda: wells.extrema()[2].x,
            metric=metrics.Numbers(1e-3),
            hints=(
                "Close to a place where the gradient vanishes Newton goes there, whatever its kind.",
                "Start at (0, 0) and repeat x = x + newton_step(gradient(x), hessian(x)) until x stands still. If it runs away, start between the wells.",
                "Ten rounds of `x = x + newton_step(gradient(x), hessian(x))` from `x = np.zeros(2)` are plenty.",
            ),
            mistakes=[
                Mistake(
                    lambda: np.array([0.105, -0.205]),
                    "That is what the thesis prints. Evaluate your gradient there: it is about 2.5 long.",
                ),
                Mistake(
                    lambda: wells.CENTERS.mean(0),
                    "That is halfway between the centers. The deeper well pulls the pass away from there.",
                ),
                Mistake(
                    lambda: wells.extrema()[0].x,
                    "That is the local minimum: start nearer to the pass between the wells.",
                ),
                Mistake(
                    lambda: wells.extrema()[1].x,
                    "That is the global minimum: start nearer to the pass between the wells.",
                ),
            ],
        ),
        Prediction(
            "neighborhood",
            question="The thesis says a saddle is found only if it is hit exactly. How close must Newton really start?",
            choices=("exactly at it", "within 0.01 of it", "within 0.7 of it"),
            answer="within 0.7 of it",
            why="For Newton the saddle is a root of the gradient like any other, with a whole neighborhood that flows into it.",
        ),
        Exercise(
            "gauss_newton_step",
            reference=opt.gauss_newton_step,
            draw=residual_and_jacobian,
            metric=metrics.Numbers(1e-8),
            hints=(
                "Replace r(x + h) by r + J h and minimize its length.",
                "That is linear least squares with matrix J and right-hand side −r; its normal equations are J'J h = −J'r.",
                "`return -np.linalg.lstsq(J, r)[0]`. The normal equations are right as well; they lose twice the digits, as in chapter 3.",
            ),
            mistakes=[
                Mistake(
                    lambda r, J: np.linalg.lstsq(J, r)[0],
                    "The sign is wrong: r + J h should become small, so h has to counter r.",
                ),
                Mistake(
                    lambda r, J: -J.T @ r, "That is the gradient of the cost, downhill; the curvature J'J is missing."
                ),
                Mistake(lambda r, J: -J.T @ J @ J.T @ r, "You multiplied by J'J instead of solving with it."),
                Mistake(
                    lambda r, J: -0.5 * np.linalg.lstsq(J, r)[0],
                    "Half a step: cost 1/2 |r|² has gradient J'r and curvature J'J, both without a 2.",
                ),
                Mistake(
                    lambda r, J: -(J.T @ r) / (J * J).sum(0),
                    "Only the diagonal of J'J is used: the columns of J are not perpendicular.",
                ),
            ],
        ),
        Exercise(
            "gain_ratio",
            reference=opt.gain_ratio,
            draw=TRIED_STEPS,
            metric=metrics.Numbers(1e-8),
            draws=6,
            hints=(
                "Compare what the step brought with what the model promised, equation (2-36).",
                "Actual: cost − new_cost. Promised: m(0) − m(h) with m(h) = cost + g'h + 1/2 h'B h.",
                "`return (cost - new_cost) / -(g @ step + 0.5 * step @ B @ step)`.",
            ),
            mistakes=[
                Mistake(
                    lambda cost, new_cost, g, B, step: _predicted(g, B, step) / (cost - new_cost),
                    "Upside down: actual over predicted, so that 0.1 means that little of the promise came true.",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: (cost - new_cost) / _predicted(g, B, step, half=1.0),
                    "The quadratic term of the model carries a factor 1/2.",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: (cost - new_cost) / _predicted(g, B, step, half=0.0),
                    "Only the linear term is promised here: the curvature 1/2 h'B h is missing.",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: (new_cost - cost) / _predicted(g, B, step),
                    "The sign is wrong: a step that lowers the cost as promised has gain +1.",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: (cost - new_cost) / _predicted(g, B, step, half=-0.5),
                    "The promised decrease m(0) − m(h) changes the sign of both terms, of 1/2 h'B h too.",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: abs(cost - new_cost) / _predicted(g, B, step),
                    "A step that raised the cost has a negative gain: no absolute value, or it would never be taken back.",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: (cost - new_cost) / (cost - _predicted(g, B, step)),
                    "You divide by the model's value m(h). What it promised is the decrease m(0) − m(h).",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: new_cost / (cost - _predicted(g, B, step)),
                    "This compares values, new cost with m(h). The gain compares decreases.",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: cost - new_cost,
                    "That is the actual decrease. Divide it by the promised one, m(0) − m(h).",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: _predicted(g, B, step),
                    "That is the promised decrease: divide the actual one, cost − new_cost, by it.",
                ),
                Mistake(
                    lambda cost, new_cost, g, B, step: cost - new_cost / _predicted(g, B, step),
                    "Division comes before subtraction: put `cost - new_cost` in parentheses.",
                ),
            ],
        ),
        Exercise(
            "dogleg_step",
            reference=opt.dogleg_step,
            draw=DOGLEG_CASES,
            metric=metrics.Numbers(1e-8),
            draws=9,
            hints=(
                "Three cases: the Newton point is inside; the corner is outside; the rim cuts the second leg.",
                "The corner is −(g'g / g'Bg) g. On the second leg solve |corner + s (newton − corner)| = radius for s between 0 and 1.",
                "`newton, corner = np.linalg.solve(B, -g), -(g @ g) / (g @ B @ g) * g`, `if np.linalg.norm(newton) <= radius: return newton`, "
                "`if np.linalg.norm(corner) >= radius: return -radius * g / np.linalg.norm(g)`, `leg = newton - corner`, "
                "`a, b, c = leg @ leg, corner @ leg, corner @ corner - radius**2`, `return corner + (-b + np.sqrt(b * b - a * c)) / a * leg`.",
            ),
            mistakes=[
                Mistake(
                    opt.cauchy_step, "That is the Cauchy point: it stops at the corner and never takes the second leg."
                ),
                Mistake(
                    _cut_newton,
                    "You shorten the Newton step to the radius. The dogleg bends: first downhill, then toward Newton.",
                ),
                Mistake(
                    _uncut_newton,
                    "The step leaves the trust region: the Newton point counts only when it lies within the radius.",
                ),
                Mistake(
                    _newton_or_rim,
                    "Between corner and Newton point the rim cuts the second leg; you run straight downhill to the rim.",
                ),
                Mistake(
                    _always_to_the_rim,
                    "When the Newton point is inside the radius, stop there: the model rises beyond it.",
                ),
                Mistake(
                    _leg_by_length,
                    "The path bends at the corner: radius − |corner| along the second leg ends inside the rim. Solve |corner + s leg| = radius.",
                ),
                Mistake(
                    _newton_to_the_rim,
                    "Where the rim cuts the second leg you shorten the Newton step. The path runs from the corner toward Newton there.",
                ),
                Mistake(
                    _past_newton,
                    "The Newton point inside the radius is a case of its own: there s exceeds 1, and you run past it to the rim.",
                ),
                Mistake(
                    _dogleg(rim=lambda g, p, radius: p),
                    "Where the corner lies outside the radius, the first leg ends at the rim: you return the corner itself.",
                ),
                Mistake(
                    _dogleg(rim=lambda g, p, radius: -radius * g),
                    "The step to the rim is `radius` times a unit vector: divide g by its norm.",
                ),
                Mistake(
                    _dogleg(rim=lambda g, p, radius: -p * radius / np.linalg.norm(p)),
                    "Where the corner lies outside you run uphill to the rim: downhill is −g.",
                ),
                Mistake(
                    lambda g, B, radius: -radius * g / np.linalg.norm(g),
                    "That is always steepest descent to the rim: corner and Newton point are never used.",
                ),
                Mistake(
                    _dogleg(share=lambda a, b, c: (-b - np.sqrt(b * b - a * c)) / a),
                    "The other root leads backward, to s below 0: take the one with + before the square root.",
                ),
                Mistake(
                    _dogleg(share=lambda a, b, c: (-b + np.sqrt(b * b - 4 * a * c)) / (2 * a)),
                    "The equation is a s² + 2 b s + c = 0, its middle term holds the 2 already: s = (−b + √(b² − ac))/a.",
                ),
                Mistake(
                    _dogleg(leg=lambda n, p: n), "The second leg is newton − corner; yours is the whole Newton step."
                ),
                Mistake(_dogleg(corner=lambda p: -p), "Your corner lies uphill: it is −(g'g / g'Bg) g."),
                Mistake(_dogleg(full=lambda n: -n), "Your Newton point has the wrong sign: it solves B h = −g."),
                Mistake(_leg_from_zero, "The second leg starts at the corner: add corner to s times the leg."),
            ],
        ),
        Prediction(
            "four",
            question="All four methods start at (3, 3). How many of them reach the global minimum?",
            choices=("none", "one", "two", "all"),
            answer="one",
            why="Newton and Gauss-Newton fly away, the trust region settles in the local minimum, Levenberg-Marquardt happens to jump across it.",
        ),
        Value(
            "luck",
            reference=wells.luck,
            rtol=0.02,
            hints=(
                "First one stand-in: four tosses, all of them right.",
                "At least one of five is the opposite of none of five.",
                "`1 - (1 - p)**5`, where p is the probability that one stand-in has all four right.",
            ),
            mistakes=[
                Mistake(lambda: 0.5**4, "That is one stand-in by itself. Five were tried."),
                Mistake(
                    lambda: 5 * 0.5**4,
                    "Adding up counts those cases several times where more than one stand-in is right.",
                ),
                Mistake(lambda: (1 - 0.5**4) ** 5, "That is the probability that none of the five is right."),
                Mistake(
                    lambda: 1 - (1 - 0.5**5) ** 4, "Four and five are exchanged: four landings each, five stand-ins."
                ),
                Mistake(
                    lambda: 100 * wells.luck(), "Right, in percent: give the probability as a number between 0 and 1."
                ),
                Mistake(lambda: 0.5**20, "That all five stand-ins have all landings right. One is enough."),
            ],
        ),
        Prediction(
            "share",
            question="From what share of the starts in the square from −6 to 6 does Newton reach one of the two minima?",
            choices=("less than 1 %", "about 10 %", "about half"),
            answer="less than 1 %",
            why="0.7 % end in a minimum, 2.8 % in the saddle, all others run away across the plain.",
        ),
    ],
    title="Optimization",
)
